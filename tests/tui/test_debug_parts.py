"""The parts of the debugger without a screen: canvas, camera, weights by steps, bars, and what it says of jumps."""

from pathlib import Path

import numpy as np
import pytest
from made_once import make_clip
from test_motion_measure_command import here, made

from contextdb.motion import Channel, Controller, Entry, FeatureSchema, MotionDatabase, PoseBank, Selector, Trace, open_or_build
from contextdb.motion.features.channels import Permutations
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.pose_files import poses_path, save_poses
from contextdb.motion.trace.stats import gains_of
from contextdb.tables.project import Project
from tui.debug import ladder
from tui.debug.camera import MOST_ZOOM, Camera
from tui.debug.canvas import Canvas
from tui.debug.landscape import Landscape
from tui.debug.recording import Moment, Recording, Turned

__all__ = ["here", "made"]
"""Fixtures of another file."""


def recording_of(folder: Path) -> Recording:
    """The session of a folder, with the databases of its project."""
    trace = Trace.load(folder / "session.parquet")
    project = Project.load(folder / "game")
    config = MotionConfig.from_dict(project.schema.motion, tables=project.tables)
    assets = {name: table.compile().leaves for name, table in project.tables.items()}
    databases = open_or_build(config, project.folder, assets, names=list(trace.about))
    assert trace.use(databases) == ""
    return Recording("session.parquet", trace, str(folder / "game"), databases, "")


# ---- canvas and camera


def test_a_dot_is_the_bit_of_its_cell():
    canvas = Canvas(2, 1)
    canvas.dots(np.array([[0.0, 0.0], [3.0, 3.0]]), 1)
    lines, layers = canvas.cells()
    assert lines == ["⠁⢀"]
    assert layers.tolist() == [[1, 1]]


def test_a_line_sets_every_row_of_dots_between_its_ends():
    canvas = Canvas(1, 2)
    canvas.lines(np.array([[0.0, 0.0]]), np.array([[0.0, 7.0]]), 1)
    assert canvas.cells()[0] == ["⡇", "⡇"]


def test_a_cell_has_the_colour_of_its_highest_layer():
    canvas = Canvas(1, 1)
    canvas.dots(np.array([[0.0, 0.0]]), 3)
    canvas.dots(np.array([[1.0, 0.0], [0.0, 0.0]]), 2)
    assert canvas.layers[0].tolist() == [3, 2]
    assert canvas.cells()[1].tolist() == [[3]]


def test_what_is_outside_or_no_number_is_not_drawn():
    canvas = Canvas(2, 2)
    far = np.array([[-5.0, 1.0], [1e12, 1.0], [np.nan, 0.0], [np.inf, 0.0]])
    canvas.dots(far, 1)
    canvas.lines(far, far[::-1], 1)
    assert not canvas.layers[2:].any()
    assert Canvas(0, 0).cells()[0] == []


def test_from_behind_left_is_left_and_up_is_up():
    camera = Camera(yaw=0.0, pitch=0.0)
    origin, left, up = camera.dots(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), 100, 100)
    assert left[0] < origin[0]
    assert up[1] < origin[1]
    assert left[1] == origin[1]


def test_a_body_that_is_seen_from_its_left_goes_to_the_left():
    ahead = Camera(yaw=-np.pi / 2, pitch=0.0).dots(np.array([[0.0, 0.0, 1.0]]), 100, 100)
    assert ahead[0, 0] < 50.0


def test_zoom_and_tilt_have_ends():
    camera = Camera().turned(0.0, 10.0)
    assert camera.pitch < np.pi / 2
    assert Camera().turned(0.0, -10.0).pitch == 0.0
    for _ in range(50):
        camera = camera.zoomed(1.25)
    assert camera.zoom == MOST_ZOOM


# ---- weights by steps


@pytest.mark.parametrize("value", [0.0, 0.05, 0.33, 1.0, 7.0, 100.0])
def test_a_step_up_and_one_down_come_back_to_a_step(value: float):
    up = ladder.turned(value, up=True)
    assert up > value
    down = ladder.turned(up, up=False)
    assert down <= value if value in ladder.STEPS else down in ladder.STEPS
    assert ladder.turned(down, up=True) == up


def test_below_nothing_is_nothing_and_above_the_last_step_it_doubles():
    assert ladder.turned(0.0, up=False) == 0.0
    assert ladder.turned(150.0, up=True) == 300.0
    assert ladder.turned(300.0, up=False) == 150.0


# ---- a session


def test_the_timeline_says_what_the_decisions_say(here: Path):
    trace = Trace.load("session.parquet")
    line = recording_of(here).line
    for i, decision in enumerate(trace):
        assert (line.ticks[i], line.times_s[i], line.searched[i]) == (decision.tick, decision.time_s, decision.searched)
        plays = decision.playing
        assert (None if line.playing[i] < 0 else line.assets[line.playing[i]]) == (None if plays is None else plays.asset)
        assert line.jumped[i] == (str(decision.action) in ("starts", "jumps"))
        assert line.forced[i] == (str(decision.action) == "jumps" and decision.continuing_cost is None)
        if decision.searched:
            assert (None if np.isnan(line.costs[i]) else line.costs[i]) == decision.cost
            assert line.n_valid[i] == sum(int(chosen.ranges.sum()) for _, chosen in decision.filters)
        if decision.body is not None:
            np.testing.assert_array_equal(line.roots[i], decision.body)


def test_a_session_in_memory_has_the_same_timeline_as_its_file(here: Path):
    saved = Trace.load("session.parquet")
    kept = Trace()
    for decision in saved:
        kept.record(decision)
    names = ("tick", "action", "cost")
    assert kept.columns(names).equals(saved.columns(names))


def test_the_figures_are_those_of_the_statistics(here: Path):
    recording, stats = recording_of(here), Trace.load("session.parquet").stats()
    told = recording.figures
    assert (told.jumps, told.forced) == (stats.jumps, stats.forced_jumps)
    assert told.jumps_per_s == pytest.approx(stats.jumps_per_s)
    assert told.gain_median == pytest.approx(stats.gain_median)
    assert told.gain_small_share == pytest.approx(stats.gain_small_share)
    assert told.stay_s == pytest.approx(stats.stay_s)


def test_rows_of_bars_are_the_best_frames_of_assets_asked_again(here: Path):
    recording = recording_of(here)
    moment = Moment.of(recording, int(recording.jumps[1]), Turned())
    assert moment.turned is not None
    best = {(each.database, each.row.range): each.row for each in moment.turned.best_of_assets()}
    rows = [row for row in moment.landscape.rows if row.is_searched]
    assert {(row.database, row.range) for row in rows} == set(best)
    for row in rows:
        other = best[row.database, row.range]
        assert (row.frame, row.cost, row.left_out) == (other.frame, other.cost, other.left_out)


def test_a_bar_is_the_cheapest_of_its_frames_that_may_be_chosen(here: Path):
    recording = recording_of(here)
    moment = Moment.of(recording, int(recording.jumps[1]), Turned())
    scene = moment.landscape
    for row in scene.rows:
        levels, may, (start, stop) = scene.bars(row, 16)
        search = scene.searches[row.database]
        cheapest = []
        for i in range(len(levels)):
            own = np.arange(start + i * (stop - start) // len(levels), start + (i + 1) * (stop - start) // len(levels))
            free = own[search.left_out[own] == LeftOut.NO]
            assert may[i] == (len(free) > 0 and row.is_searched)
            cheapest.append(search.costs[free if len(free) else own].min())
        assert levels[np.argsort(cheapest)].tolist() == sorted(levels.tolist(), reverse=True)


def test_the_order_is_by_best_by_name_or_by_use(here: Path):
    recording = recording_of(here)
    scene = Moment.of(recording, int(recording.jumps[1]), Turned()).landscape
    best = scene.ordered("best")
    assert best[0].may_play
    assert [row.cost for row in best if row.may_play] == sorted(row.cost for row in best if row.may_play)
    assert [row.asset for row in scene.ordered("name")] == sorted(row.asset for row in scene.rows)
    used = [recording.uses.get((row.asset, row.mirrored), 0) for row in scene.ordered("use", "", recording.uses)]
    assert used == sorted(used, reverse=True)
    assert {row.asset for row in scene.ordered("best", "TIRED")} == {"walk_tired"}
    assert Landscape({}).ordered("best") == []


# ---- what jumps spare


@pytest.mark.parametrize(
    ("continuing", "cost", "gain"),
    [
        (1.0, 0.25, 0.75),
        (1.0, 0.0, 1.0),
        (0.001, 0.5, -0.998),
        (0.0, 0.5, -1.0),
        (0.0, 0.0, 0.0),
        (-0.1, 0.1, -1.0),
        (0.1, -0.1, 1.0),
    ],
)
def test_a_gain_is_a_share_also_where_playing_on_costs_about_nothing(continuing: float, cost: float, gain: float):
    assert gains_of(np.array([continuing]), np.array([cost])).tolist() == pytest.approx([gain])


# ---- permutations of clips


def test_poses_are_those_of_a_database_with_permutations_and_each_has_a_bar(tmp_path: Path):
    walk = make_clip("walk").clip
    channels = (Channel("position", bone="LeftFoot", permuted=True),)
    database = MotionDatabase.build([walk], FeatureSchema("steps", 30.0, channels, permutations=Permutations(2, 0.4, 0.2)))
    save_poses(PoseBank.build([walk], database.schema), poses_path(tmp_path, "loco"))
    trace = Trace()
    Controller(Selector([Entry("loco", database)]), recorder=trace).update(0.0, database.raw(5))
    recording = Recording("session.parquet", trace, str(tmp_path), {"loco": database}, "")
    assert list(recording.saved_banks()) == ["loco"]
    rows = Landscape(trace.reasked()[0].searches).rows
    assert [row.name for row in rows] == ["walk +0.2 s", "walk +0.6 s"]
