extends Spatial
# Shows what a running game plays, in Python or not: a Skeleton for each of its characters, with a box at each joint.
# `python -m examples.web.live` passes on the lines of the game: the bones of a character once, then its poses. docs/live.md says
# what they hold.

signal posed(who, asset)    # a character has a new pose; null for what has no name, or plays nothing
signal ended                # the game, or what passes its lines on, has gone; it is asked again

export var host = "127.0.0.1"
export var port = 8017
export var again_s = 1.0

const MOST_WAITING = 1 << 20    # characters of a line that does not end

var characters = {}    # by who: the bones, and their Skeleton

var _stream = null
var _is_asked = false
var _waiting = ""
var _rest_s = 0.0

func _process(delta):
	_rest_s -= delta
	if _stream == null and _rest_s <= 0.0:
		_begin()
	if _stream != null:
		_receive()
	var camera = get_node_or_null("Camera")
	if camera != null and not characters.empty():
		camera.translation = characters.values()[0].skeleton.translation + Vector3(0, 2.4, 4)

func _begin():
	_stream = StreamPeerTCP.new()
	_is_asked = false
	_waiting = ""
	if _stream.connect_to_host(host, port) != OK:
		_end()

func _end():
	_stream.disconnect_from_host()
	_stream = null
	_rest_s = again_s
	emit_signal("ended")

func _receive():
	var status = _stream.get_status()
	if status == StreamPeerTCP.STATUS_CONNECTED:
		_ask()
		_read(_stream.get_available_bytes())
	elif status != StreamPeerTCP.STATUS_CONNECTING:
		_end()

func _ask():
	if not _is_asked:
		_stream.put_data(("GET /lines HTTP/1.0\r\nHost: %s:%d\r\n\r\n" % [host, port]).to_ascii())
	_is_asked = true

# Read what has come, a whole line at a time: neither what HTTP says first, nor the empty lines between.
func _read(n_bytes):
	if n_bytes <= 0:
		return
	var lines = (_waiting + _stream.get_data(n_bytes)[1].get_string_from_ascii()).split("\n")
	_waiting = lines[-1]
	for i in range(lines.size() - 1):
		if lines[i].begins_with("data: "):
			_take(JSON.parse(lines[i].substr(6)).result)
	if _waiting.length() > MOST_WAITING:
		_end()

func _take(line):
	if not line is Dictionary:
		return
	if line.get("line") == "bones":
		_make(line)
	elif line.get("line") == "pose" and characters.has(line.who):
		_pose(characters[line.who], line)
		emit_signal("posed", line.who, line.get("asset"))

# A skeleton at rest where the joints are against their parents.
func _make(bones):
	if characters.has(bones.who):
		characters[bones.who].skeleton.queue_free()
	var skeleton = Skeleton.new()
	add_child(skeleton)
	for joint in range(bones.names.size()):
		var bone = bones.names[joint].replace(":", "_").replace("/", "_")    # which no bone of Godot has in its name
		if skeleton.find_bone(bone) >= 0:
			bone += "_%d" % joint
		skeleton.add_bone(bone)
		skeleton.set_bone_parent(joint, int(bones.parents[joint]))
		skeleton.set_bone_rest(joint, Transform(Basis(), _vector(bones.offsets[joint])))
		var box = MeshInstance.new()
		box.mesh = preload("res://joint.tres")
		var place = BoneAttachment.new()
		place.bone_name = bone
		place.add_child(box)
		skeleton.add_child(place)
	characters[bones.who] = {"bones": bones, "skeleton": skeleton}

# A pose of Godot's is against the rest: a joint with a place of its own is moved by what that differs.
func _pose(character, line):
	var bones = character.bones
	var skeleton = character.skeleton
	skeleton.transform = Transform(Basis(Vector3.UP, line.root[2]), Vector3(line.root[0], 0.0, line.root[1]))
	for joint in range(line.rotations.size()):
		skeleton.set_bone_pose(joint, Transform(Basis(_rotation(line.rotations[joint])), Vector3.ZERO))
	for i in range(bones.moving.size()):
		var joint = int(bones.moving[i])
		var moved = _vector(line.translations[i]) - _vector(bones.offsets[joint])
		skeleton.set_bone_pose(joint, Transform(Basis(_rotation(line.rotations[joint])), moved))

# Where the joints of a character are in the world, in metres.
func places(who):
	var skeleton = characters[who].skeleton
	var found = []
	for joint in range(skeleton.get_bone_count()):
		found.append(skeleton.transform.xform(skeleton.get_bone_global_pose(joint).origin))
	return found

static func _vector(numbers):
	return Vector3(numbers[0], numbers[1], numbers[2])

static func _rotation(numbers):
	return Quat(numbers[1], numbers[2], numbers[3], numbers[0]).normalized()    # Godot has w last
