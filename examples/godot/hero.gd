extends Spatial
# A character of game.motion that the arrow keys steer; a box at each joint.

const ContextCharacters = preload("res://context_characters.gdns")

var characters = ContextCharacters.new()
var boxes = []

func _ready():
	var refusal = characters.open(ProjectSettings.globalize_path("res://game.motion"), "player", 1)
	if refusal != "":
		push_error(refusal)
		return
	for _joint in characters.joints():
		var box = MeshInstance.new()
		box.mesh = preload("res://joint.tres")
		add_child(box)
		boxes.append(box)

func _process(delta):
	var x = Input.get_action_strength("ui_left") - Input.get_action_strength("ui_right")
	var z = Input.get_action_strength("ui_up") - Input.get_action_strength("ui_down")
	step(delta, 1.4 * x, 1.4 * z)

# One update: the stick is a velocity, m/s, x to the left and z ahead. What was wrong, or "".
func step(delta, x, z):
	var problem = characters.steer(0, x, z, null, {"gait": "Walk" if x != 0 or z != 0 else "Idle", "style": "normal"})
	if problem == "":
		problem = characters.update(delta)
	var places = characters.positions(0)
	for joint in range(boxes.size()):
		boxes[joint].translation = Vector3(places[3 * joint], places[3 * joint + 1], places[3 * joint + 2])
	return problem
