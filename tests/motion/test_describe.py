"""A table from clips: made clips of known speed, turn, direction, gait and style come back; their cells share out all contexts."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from made_once import made_clips, make_clip
from strategies import for_each

import contextdb as cdb
from contextdb import motion
from contextdb.errors import ContextDBError
from contextdb.motion.clips.feet import Footfalls
from contextdb.motion.clips.poses import poses_of
from contextdb.motion.clips.trajectory import Trajectory, root_trajectory
from contextdb.motion.made.recipes import MadeClip
from contextdb.motion.preparing.cells_of_clips import cells_of, reason
from contextdb.motion.preparing.clip_facts import Moments, Spread, common_words, gait_of, is_moving, style_of
from contextdb.motion.preparing.describing import Described, condition_sections, patterns_of, table_section

MADE = made_clips()
ROWS = {row.asset: row for row in motion.describe([made.clip for made in MADE])}
STEADY = [made for made in MADE if made.recipe.change == "steady"]


def table_of(rows: list[Described]) -> cdb.Table:
    columns = {"Asset Name": [row.asset for row in rows]}
    columns |= {name: [row.cells[name] for row in rows] for name in rows[0].cells}
    conditions = {name: said for (_, name), said in condition_sections(rows).items()}
    return cdb.Table.from_columns(columns, conditions, table_section(rows, "Asset Name"), "moves")


# ---- what is measured


@for_each(STEADY)
def test_a_made_clip_has_the_speed_and_turn_of_its_recipe(made: MadeClip):
    facts = ROWS[made.name].facts
    assert facts.speed_mps.middle == pytest.approx(made.recipe.pace.speed_mps, abs=0.02)
    assert facts.turn_dps.middle == pytest.approx(made.recipe.turn_dps, abs=1.0)
    if made.recipe.gait != "Idle":
        assert facts.direction_deg is not None
        assert abs(facts.direction_deg.middle) < 1.0
        assert facts.step_s == pytest.approx(1.0 / made.recipe.pace.cycles_per_s, abs=0.04)


@for_each(MADE)
def test_gait_style_and_duration_come_back(made: MadeClip):
    facts = ROWS[made.name].facts
    assert facts.gait == made.recipe.gait
    assert facts.style == made.recipe.style
    assert facts.duration_s == pytest.approx(made.clip.duration_s, abs=1e-3)


@for_each(MADE)
def test_starts_begin_and_stops_end_standing(made: MadeClip):
    facts = ROWS[made.name].facts
    is_idle = made.recipe.gait == "Idle"
    assert (facts.start == "Idle") == (is_idle or made.recipe.change == "start")
    assert (facts.end == "Idle") == (is_idle or made.recipe.change == "stop")
    assert facts.gaits == (("Idle", made.recipe.gait) if made.recipe.change == "stop" else (made.recipe.gait,))


@pytest.mark.parametrize("degrees", [-135.0, -90.0, -45.0, 45.0, 90.0, 135.0, 180.0])
def test_a_direction_against_the_facing_comes_back(degrees: float):
    path = motion.steady_path(1.3, 40.0, strafe_deg=degrees, rate=30.0)
    moments = Moments.of(path, 1.0)
    found = np.degrees(np.arctan2(moments.velocities[:, 0], moments.velocities[:, 1]))
    assert np.abs((found - degrees + 180.0) % 360.0 - 180.0).max() < 0.5
    assert moments.speeds == pytest.approx(1.3, abs=0.002)
    assert moments.turns == pytest.approx(40.0, abs=0.01)


def test_a_clip_that_walks_sideways_has_that_direction():
    walk = make_clip("walk").clip
    turned = turned_by(walk, 90.0)
    row = motion.describe([turned])[0]
    assert row.facts.direction_deg is not None
    assert abs(abs(row.facts.direction_deg.middle) - 90.0) < 2.0
    assert row.facts.speed_mps.middle == pytest.approx(1.3, abs=0.02)


def turned_by(clip: motion.Clip, degrees: float) -> motion.Clip:
    """A clip whose hips go in another direction than its body faces: their places on the ground turned about the origin."""
    poses = poses_of(clip)
    path = root_trajectory(poses)
    root = clip.skeleton.channels[0]
    columns = [root.index("Xposition"), root.index("Zposition")]
    values = np.array(clip.values)
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    values[:, columns] = (path.positions @ turn.T) / clip.metres_per_unit
    return replace(clip, values=values)


def test_a_path_of_one_frame_stands():
    moments = Moments.of(Trajectory(30.0, np.zeros((1, 2)), np.zeros(1)), 1.0)
    assert moments.speeds.tolist() == [0.0]
    assert moments.turns.tolist() == [0.0]


def test_a_clip_of_one_frame_is_described():
    walk = make_clip("walk").clip
    row = motion.describe([replace(walk, values=walk.values[:1])])[0]
    assert row.cells["gait"] == "Idle"
    assert row.cells["duration_s"] == "0"


# ---- styles from names


@pytest.mark.parametrize(
    ("name", "style"),
    [
        ("walk_tired", "tired"),
        ("walk_turn_left_90", "normal"),
        ("start_run", "normal"),
        ("dataset-2_walk-turn-left_exhausted_001", "exhausted"),
        ("RunInjuredLeft", "injured"),
        ("02_10_wash_self", "wash_self"),
        ("Walk_Neutral_Fwd", "normal"),
        ("Müde gehen #1", "müde_gehen"),
        ("Mu\u0308deWALKÉlan", "müde_élan"),
        ("走るWalk_ΓΩΛ2", "走る_γωλ"),
        ("", "normal"),
    ],
)
def test_a_style_is_what_the_name_says_beside_the_movement(name: str, style: str):
    assert style_of(name) == style


def test_words_that_all_names_hold_are_no_style():
    names = ["hero_walk_sad", "hero_run"]
    assert [style_of(name, common_words(names)) for name in names] == ["sad", "normal"]


# ---- cells


@pytest.mark.parametrize("mirrored", [False, True])
def test_every_cell_accepts_what_its_clip_shows(mirrored: bool):
    rows = motion.describe([made.clip for made in MADE], mirrored=mirrored)
    compiled = table_of(rows).compile()
    for row in rows:
        facts = row.facts
        direction = 0.0 if facts.direction_deg is None else facts.direction_deg.middle
        context = {"gait": facts.gait, "speed": facts.speed_mps.middle, "direction": direction}
        assert row.asset in compiled.query({**context, "turn": facts.turn_dps.middle, "style": facts.style}).assets


def test_for_every_context_some_clip_is_valid():
    compiled = table_of(list(ROWS.values())).compile()
    speeds, turns, directions = (0.0, 0.9, 1.55, 2.9, 6.0), (-200.0, -60.0, -20.0, 0.0, 20.0, 60.0, 200.0), (-179.0, 0.0, 90.0)
    for gait, speed, turn, direction, style in itertools.product(
        ("Idle", "Walk", "Run"), speeds, turns, directions, ("normal", "tired")
    ):
        context = {"gait": gait, "speed": speed, "turn": turn, "direction": direction, "style": style}
        assert compiled.query(context), context


def test_neighbours_overlap_a_little_and_far_ones_do_not():
    compiled = table_of(list(ROWS.values())).compile()
    context = {"gait": "Walk", "direction": 0.0, "turn": 0.0, "style": "normal"}
    steady = {"walk_slow", "walk", "walk_fast"}
    assert steady & set(compiled.query({**context, "speed": 1.3}).assets) == {"walk"}
    assert steady & set(compiled.query({**context, "speed": 1.05}).assets) == {"walk_slow", "walk"}
    assert steady & set(compiled.query({**context, "speed": 0.6}).assets) == {"walk_slow"}


def turning(*spreads: tuple[float, float, float], mirrored: bool = False) -> list[str]:
    """The turn cells of clips that are alike but for how they turn."""
    walk = ROWS["walk"].facts
    facts = [replace(walk, asset=f"c{i}", turn_dps=Spread(*spread)) for i, spread in enumerate(spreads)]
    return [cells["turn"] for cells in cells_of(facts, ["rig"] * len(facts), mirrored)]


def test_a_clip_that_turns_for_a_while_is_the_one_for_turns_where_no_other_turns():
    assert turning((-3.0, 0.0, 3.0), (-2.0, 10.0, 82.0)) == ["<=51", ">=-12"]
    assert turning((-3.0, 0.0, 3.0), (-2.0, 10.0, 82.0), mirrored=True) == ["-51..51", ">=-12"]
    assert turning((-3.0, 0.0, 3.0), (-2.0, 10.0, 82.0), (-46.0, -9.0, 0.0)) == ["-30..51", ">=-12", "<=7"]


def test_a_clip_that_turns_for_a_while_keeps_its_own_range_where_another_turns_all_the_time():
    assert turning((-3.0, 0.0, 3.0), (38.0, 43.0, 45.0), (-2.0, 10.0, 82.0)) == ["<=28", ">=15", "-12..92"]


def test_a_slow_clip_moves_where_its_name_says_so_and_slow_hops_are_no_run():
    slow, still = (Spread(0.0, 0.2, 0.33), Spread(0.0, 0.1, 0.2))
    assert [is_moving(name, slow, 0.3) for name in ("sneak_walk", "look")] == [True, False]
    assert not is_moving("walk_up_and_wait", still, 0.0)
    hops = Footfalls(1.0, {"L": np.array([[0.0, 0.4]]), "R": np.array([[0.6, 0.9]])})
    assert [gait_of("hops", Spread(0.4, speed, speed), hops) for speed in (0.5, 2.5)] == ["Walk", "Run"]


def test_a_mirrored_turn_leaves_the_other_side_to_its_mirror():
    clips = [make_clip(name).clip for name in ("walk", "walk_turn_left_90")]
    alone, both = ({row.asset: row.cells["turn"] for row in motion.describe(clips, mirrored=each)} for each in (False, True))
    assert alone["walk"].startswith("<=")
    assert both["walk"] == "-55..55"
    assert both["walk_turn_left_90"] == alone["walk_turn_left_90"] == ">=35"


def test_where_no_normal_clip_stands_another_stands_for_all_styles():
    clips = [make_clip(name).clip for name in ("idle", "walk", "walk_tired")]
    clips[0] = replace(clips[0], name="idle_sad")
    rows = motion.describe(clips)
    assert {row.asset: row.cells["style"] for row in rows} == {"idle_sad": "Any", "walk": "normal sad", "walk_tired": "tired"}
    assert table_section(rows, "Asset Name")["fallback"] == "idle_sad"


def test_a_normal_clip_serves_styles_without_one_of_its_gait():
    clips = [make_clip(name).clip for name in ("idle", "walk", "walk_tired")]
    styles = {row.asset: row.cells["style"] for row in motion.describe(clips)}
    assert styles == {"idle": "Any", "walk": "normal", "walk_tired": "tired"}


def test_each_cell_has_the_reason_of_its_clip():
    def why(asset: str, column: str) -> str:
        return reason(ROWS[asset].facts, column, ROWS[asset].cells[column])

    assert why("stop_walk", "gait") == "it goes at 1.3 m/s (0.64 to 1.3), and comes to a stand"
    assert why("idle", "direction") == "it stands, and goes to no side"
    assert why("walk_fast", "direction") == "it goes to 0°; no other clip of its gait and style differs in direction"
    assert why("walk_fast", "speed").endswith("the cell ends a little past the middle to the next clip of its gait, style and turn")
    assert why("start_walk", "speed").endswith("the cell is what it passes through, and a little more")
    assert why("walk_tired", "style") == "its name says tired"
    assert all(why(asset, column) for asset in ROWS for column in ROWS[asset].cells)


def test_a_description_does_not_depend_on_the_order_of_clips():
    again = motion.describe([made.clip for made in reversed(MADE)])
    assert {row.asset: dict(row.cells) for row in again} == {name: dict(row.cells) for name, row in ROWS.items()}


def test_two_clips_of_one_name_are_refused():
    clip = make_clip("walk").clip
    with pytest.raises(ContextDBError, match='two clips are named "walk"'):
        motion.describe([clip, clip])


def test_progress_tells_of_each_clip():
    told: list[tuple[int, int, str]] = []
    motion.describe([make_clip(name).clip for name in ("idle", "walk")], progress=lambda *args: told.append(args))
    assert told == [(0, 2, "idle"), (1, 2, "walk")]


# ---- patterns of files


@pytest.mark.parametrize(
    ("own", "others", "patterns"),
    [
        (["clips/a.bvh", "clips/b.bvh"], set(), ["clips/*.bvh"]),
        (["x/a.bvh"], {"y/a.bvh"}, ["x/*.bvh"]),
        (["c/01.bvh", "c/02.bvh"], {"c/131.bvh"}, ["c/0*.bvh"]),
        (["c/a.bvh", "c/ab.bvh"], {"c/abc.bvh"}, ["c/{a.bvh,ab.bvh}"]),
        (["c/a,.bvh", "c/a,b.bvh"], {"c/a,bc.bvh"}, ["c/a,.bvh", "c/a,b.bvh"]),
        (["c/[a].bvh"], {"c/b.bvh"}, ["c/[[]*.bvh"]),
        (["a.bvh"], {"c/b.bvh"}, ["*.bvh"]),
    ],
)
def test_patterns_fit_the_clips_of_a_rig_and_no_others(own: list[str], others: set[str], patterns: list[str]):
    assert patterns_of(own, others) == patterns


def test_a_clip_that_is_too_far_away_is_refused():
    walk = make_clip("walk").clip
    for call in (motion.describe, motion.prepare):
        with pytest.raises(ContextDBError, match="too far away"):
            call([replace(walk, values=walk.values * 1e300)])


def test_files_of_several_formats_share_a_pattern():
    paths = ["clips/a.bvh", "clips/b.fbx", "clips/c.glb", "more/d.bvh"]
    assert patterns_of(paths, set()) == ["clips/*.{bvh,fbx,glb}", "more/*.bvh"]
    assert patterns_of(paths[:2], {"clips/cc.fbx"}) == ["clips/{a*.bvh,b*.fbx}"]
