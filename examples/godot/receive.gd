extends SceneTree
# Writes what live.tscn receives until the game ends: godot3-server --path . -s receive.gd [--port=8017] writes a line of JSON for
# each pose into received.jsonl, with the places of its joints.

var live = load("res://live.tscn").instance()
var received = File.new()
var has_begun = false

func _initialize():
	received.open("res://received.jsonl", File.WRITE)
	for word in OS.get_cmdline_args():
		if word.begins_with("--port="):
			live.port = int(word.substr(7))
	live.connect("posed", self, "_write")
	live.connect("ended", self, "_leave")
	root.add_child(live)

func _write(who, asset):
	var places = []
	for place in live.places(who):
		places.append([place.x, place.y, place.z])
	received.store_line(to_json({"who": who, "asset": asset, "places": places}))
	has_begun = true

func _leave():
	if has_begun:
		quit()

func _finalize():
	received.close()
