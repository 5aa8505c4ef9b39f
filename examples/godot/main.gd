extends SceneTree
# Asks a table for every moment of a file, one JSON object a line, and writes what it answers: godot3-server --path . -s main.gd

const ContextTable = preload("res://context_table.gdns")

func _init():
	var table = ContextTable.new()
	var refusal = table.open(ProjectSettings.globalize_path("res://moves.safetensors"), 7)
	if refusal != "":
		printerr(refusal)
	var moments = File.new()
	var answers = File.new()
	moments.open("res://moments.jsonl", File.READ)
	answers.open("res://answers.jsonl", File.WRITE)
	var time_s = 0.0
	while not moments.eof_reached():
		var line = moments.get_line()
		if line == "":
			continue
		var rows = table.query(parse_json(line))
		var problem = table.problem()
		var row = table.pick(time_s) if problem == "" else -1
		# a digest has 64 bits, and a number of JSON has fewer
		answers.store_line(to_json({"rows": rows, "row": row, "asset": table.asset(row), "digest": str(table.digest()), "problem": problem}))
		time_s += 0.5
	answers.close()
	quit()
