extends SceneTree
# The hero walks a square: godot3-server --path . -s walk.gd writes every pose into poses.bin, and what it plays into poses.txt.

const SIDES = [[0.0, 1.4], [1.4, 0.0], [0.0, -1.4], [-1.4, 0.0], [0.0, 0.0]]
const N_TICKS = 90

func _init():
	var world = load("res://hero.tscn").instance()
	var hero = world.get_node("Hero")
	hero._ready()
	var poses = File.new()
	var played = File.new()
	poses.open("res://poses.bin", File.WRITE)
	played.open("res://poses.txt", File.WRITE)
	for side in SIDES:
		for _tick in range(N_TICKS):
			var problem = hero.step(1.0 / 60.0, side[0], side[1])
			if problem != "":
				printerr(problem)
			for numbers in [hero.characters.root(0), hero.characters.rotations(0), hero.characters.positions(0)]:
				for number in numbers:
					poses.store_double(number)
			played.store_line(hero.characters.asset(0) + "|" + hero.characters.why(0))
	poses.close()
	played.close()
	world.free()
	quit()
