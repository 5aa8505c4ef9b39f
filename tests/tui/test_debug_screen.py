"""The debugger's screen, with keys: it shows what `motion replay --json` says, answers the four questions, and writes weights."""

import shutil
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import pytest
from running import run
from terminal import alone, drive, press, screen_text
from test_contrast import faint
from test_debug_parts import recording_of
from test_motion_measure_command import here, made
from textual.pilot import Pilot

from contextdb.errors import MotionError
from contextdb.motion import Action, Decision, Trace
from contextdb.motion.selection.decision import Playing, Together
from contextdb.motion.trace.cost_views import cost_text
from tui.debug.app import DebugApp
from tui.debug.opening import opened
from tui.debug.recording import Recording
from tui.debug.screen import DebugScreen
from tui.debug.timeline import Timeline
from tui.themes import THEMES

__all__ = ["here", "made"]
"""Fixtures of another file."""

T = TypeVar("T")
SMALL, MIDDLE, LARGE = (80, 24), (120, 40), (160, 48)
JUMP, FIRST = "right_square_bracket", 30
"""The first jump of the session is at tick 30."""


def shown(
    recording: Recording,
    script: Callable[[DebugScreen, Pilot[Any]], Awaitable[T]],
    size: tuple[int, int] = LARGE,
    *,
    measures: bool = False,
) -> T:
    """Show a session while `script` presses keys; gives what the script gives."""
    app = DebugApp(recording, measures=measures)

    async def on_screen(pilot: Pilot[Any]) -> T:
        screen = app.screen
        assert isinstance(screen, DebugScreen)
        return await script(screen, pilot)

    with alone(Path.cwd()):
        return drive(app, on_screen, size)


def after(recording: Recording, *keys: str, size: tuple[int, int] = LARGE) -> str:
    """The screen after some keys."""

    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> str:
        await press(pilot, *keys)
        return screen_text(screen.app)

    return shown(recording, script, size)


def told(tick: int, *options: str) -> dict[str, Any]:
    """What `motion replay --at --json` says of a tick."""
    result = run("motion", "replay", "session.parquet", "--at", str(tick), "--json", *options)
    assert result.code == 0, result.err
    found: dict[str, Any] = result.json
    return found


@pytest.fixture
def recording(here: Path) -> Recording:
    return recording_of(here)


# ---- what is shown is what is told


def test_every_jump_is_shown_as_replay_tells_it(recording: Recording):
    jumps = [d for d in run("motion", "replay", "session.parquet", "--json").json["decisions"] if d["action"] == "jumps"]

    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> list[str]:
        texts = [screen_text(screen.app)]
        for _ in jumps[1:]:
            await press(pilot, JUMP)
            texts.append(screen_text(screen.app))
        return texts

    for decision, text in zip(jumps, shown(recording, script), strict=True):
        head, why, *_ = text.splitlines()
        playing = decision["playing"]
        assert f"{decision['time_s']:.2f} s of" in head
        assert f"tick {decision['tick']}" in head
        assert f"{playing['asset']} at {playing['time_s']:.2f} s" in head
        assert why.strip() == decision["why"]
        assert ("forced" in head) == (decision["continuing_cost"] is None)


def test_the_bars_have_the_costs_of_all_assets(recording: Recording):
    ranked = told(FIRST, "--name", "")["candidates"]

    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> list[tuple[str, float]]:
        return [(row.asset, row.cost) for row in screen.bars.rows]

    rows = shown(recording, script)
    chosen = min(row["cost"] for each in ranked for row in each["rows"] if not row["left_out"])
    assert rows[0][1] == pytest.approx(chosen)
    text = after(recording)
    for asset, cost in rows:
        line = next(line for line in text.splitlines() if f" {asset} " in line and cost_text(cost) in line)
        assert cost_text(cost) in line


def test_the_weights_show_what_each_channel_adds(recording: Recording):
    decision = told(FIRST, "--name", "walk")
    (chosen,) = [row for row in decision["asked"] if row["asset"] == "walk" and not row["left_out"]]
    assert chosen["cost"] == decision["cost"]
    lines = after(recording).splitlines()
    for channel, cost in chosen["channels"].items():
        line = next(line for line in lines if line.strip().startswith(channel[:15]) and "◀" in line)
        assert cost_text(cost) in line


def test_a_moment_without_a_search_shows_the_last_one(recording: Recording):
    text = after(recording, "home", "right")
    assert "Nothing was searched. The last search, at 0.00 s:" in text
    assert "idle" in text


# ---- time


@pytest.mark.parametrize(
    ("keys", "tick"),
    [
        (("right",), 31),
        (("left",), 29),
        (("shift+right",), 40),
        (("home",), 0),
        (("home", "left"), 0),
        (("end",), 150),
        (("end", "right"), 150),
        (("end", "left_square_bracket"), 123),
        ((JUMP,), 61),
    ],
)
def test_keys_scrub(recording: Recording, keys: tuple[str, ...], tick: int):
    assert f"tick {tick} " in after(recording, *keys).splitlines()[0]


def test_the_mouse_scrubs(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> list[int]:
        line = screen.query_one(Timeline)
        seen = []
        for x in (10, 85, 158):
            await pilot.click(line, offset=(x, 3))
            await pilot.pause()
            seen.append(screen.index)
        return seen

    first, middle, last = shown(recording, script)
    assert first == 0
    assert 70 <= middle <= 80
    assert 147 <= last <= 150


def test_n_goes_to_the_next_peak_of_the_chosen_measure(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> tuple[int, float]:
        await press(pilot, "home", "n")
        return screen.index, float(recording.line.costs[screen.index])

    index, cost = shown(recording, script)
    costs = recording.line.costs
    assert cost == costs[index] > costs[index - 1]
    assert cost >= sorted(costs)[int(0.9 * len(costs)) - 1]


def test_play_goes_on_and_ends_with_the_session(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> tuple[int, int, object]:
        screen.action_play()
        screen.play_to(2.5)
        middle = screen.index
        screen.play_to(99.0)
        await pilot.pause()
        return middle, screen.index, screen._playing

    assert shown(recording, script) == (75, 150, None)


# ---- the four questions


def test_why_this_clip(recording: Recording):
    text = after(recording)
    assert "idle is not valid any more: walk at 3.10 s costs 0.8544." in text
    assert "walk is chosen: cost 0.8544" in text


def test_why_not_mine_names_the_failing_cells_and_what_it_would_take(recording: Recording):
    text = after(recording, "slash", *"tired", "enter")
    why = told(FIRST, "--why", "walk_tired")["why_not"]
    assert why["reasons"]
    assert "why not walk_tired" in text
    assert "table: row 3 of moves: style is normal, the cell says tired" in text
    assert "× style  is normal, cell tired; normal tired would accept it" in text
    winning = [change for change in why["changes"] if change["wins"]]
    assert ("✓" in text) == bool(winning)


def test_why_does_it_jump_so_much(recording: Recording):
    stats = Trace.load("session.parquet").stats()
    text = after(recording, size=SMALL)
    assert f"{stats.jumps} jumps, {stats.jumps_per_s:.2f} a second, {stats.forced_jumps} forced" in text


def test_a_turned_weight_searches_the_moment_again(recording: Recording):
    keys = ("tab", "tab", "tab", *["minus"] * 20)
    text = after(recording, JUMP, JUMP, *keys)
    other = Trace.load("session.parquet")
    other.use(recording.databases)
    asked = other.reasked(recording.databases, weights={"LeftFoot position": 0.0})
    choice = asked[int(recording.jumps[3])].choice
    assert choice is not None
    assert "◀ 0 ▶" in text
    assert f"is chosen: {choice.hit.asset} at cost {cost_text(choice.hit.cost)}." in text


def test_assets_are_marked_in_the_bars_and_motion_learn_reads_them(recording: Recording):
    chosen = recording.trace[FIRST].choice
    assert chosen is not None

    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> list[str]:
        texts = []
        for key in ("minus", "down", "plus", "end", "home"):
            await press(pilot, key)
            texts.append(screen.message)
        return texts

    messages = shown(recording, script)
    path = Path("session.choices.csv")
    assert messages[0].startswith(f"{chosen.hit.asset} should not have been chosen · 1 choice in session.choices.csv")
    assert f"{FIRST},{chosen.hit.asset},-" in path.read_text().splitlines()
    learned = run("motion", "learn", "session.parquet", "--json")
    assert learned.code in (0, 1), learned.err
    assert learned.json["choices"] == len(path.read_text().splitlines()) - 1
    assert f"▶-{chosen.hit.asset}" in after(recording, "left", "right")
    after(recording, "minus")
    assert f",{chosen.hit.asset},-" not in path.read_text()
    path.write_text("tick,asset\n")
    assert "session.choices.csv" in after(recording, "minus")
    assert path.read_text() == "tick,asset\n"


def test_the_weight_of_every_channel_is_never_0(recording: Recording):
    keys = [key for _ in range(4) for key in (*["minus"] * 20, "down")]
    text = after(recording, "tab", "tab", "tab", *keys)
    assert text.count("◀ 0 ▶") == 3


def test_the_whole_session_is_run_again_beside_the_screen(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> tuple[str, Any]:
        await press(pilot, "tab", "tab", "tab", "plus", "plus", "plus", "r")
        await pilot.app.workers.wait_for_complete()
        await pilot.pause()
        return screen_text(screen.app), screen.outcome

    text, outcome = shown(recording, script)
    trace = Trace.load("session.parquet")
    trace.use(recording.databases)
    expected = trace.what_if(recording.databases, weights={"LeftFoot position": 1.75})
    assert outcome is not None
    assert (outcome.searches, outcome.other_frames) == (expected.searches, expected.other_frames)
    assert outcome.other_assets == len(expected.other_assets)
    assert dict(outcome.before) == dict(expected.before)
    assert dict(outcome.after) == dict(expected.after)
    assert f"{outcome.other_assets} of {outcome.searches} searches choose another asset" in text


def test_weights_are_written_and_taken_back(recording: Recording, here: Path):
    path = here / "game" / "contextdb.toml"
    before = path.read_text(encoding="utf-8")

    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> tuple[str, str, str]:
        await press(pilot, "tab", "tab", "tab", "plus", "plus", "down", "down", "down", "down", "minus", "w")
        written, said = path.read_text(encoding="utf-8"), screen_text(screen.app)
        await press(pilot, "u")
        return written, said, path.read_text(encoding="utf-8")

    written, said, back = shown(recording, script)
    assert '{ type = "position", bone = "LeftFoot", weight = 1.5 }' in written
    assert "threshold = 0.0 }" in written
    assert len(set(written.splitlines()) - set(before.splitlines())) == 2
    assert "has these weights now; u undoes it." in said
    assert back == before


def test_nothing_is_written_where_nothing_is_turned(recording: Recording, here: Path):
    assert "No weight is changed" in after(recording, "w")
    assert "There is nothing written to undo" in after(recording, "u")


# ---- panes, poses and sizes


def test_a_small_screen_shows_one_pane_and_tab_the_next(recording: Recording):
    titles = ["─Bars · ", "─Why─", "─Poses─", "─Weights─"]
    for n in range(5):
        text = after(recording, *["tab"] * n, size=SMALL)
        assert [title in text for title in titles] == [i == n % 4 for i in range(4)], n
        assert len(text.splitlines()) == 24


@pytest.mark.parametrize("size", [MIDDLE, LARGE])
def test_a_large_screen_shows_all_panes(recording: Recording, size: tuple[int, int]):
    text = after(recording, size=size)
    for title in ("─Bars · ", "─Why─", "─Poses─", "─Weights─"):
        assert title in text


@pytest.mark.parametrize("size", [(1, 1), (20, 5), (39, 24), (80, 11), (40, 12), (500, 100)])
def test_any_size_is_shown(recording: Recording, size: tuple[int, int]):
    text = after(recording, JUMP, "tab", "tab", "f1", "escape", size=size)
    if size == (39, 24):
        assert "The screen is too small: 39 x 24; 40 x 12" in text.replace("\n", " ")


def test_poses_are_drawn_and_turned(recording: Recording):
    recording_banks = recording.open_banks()

    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> list[str]:
        screen._take_banks(recording_banks)
        seen = []
        for key in ("l", "k", "z", "x"):
            seen.append("\n".join(screen.stage.draw(60, 20).cells()[0]))
            await press(pilot, key)
        return seen

    first, *others = shown(recording, script)
    assert sum("⠀" < sign <= "⣿" for sign in first) > 60
    assert len({first, *others}) == 4


def test_measures_come_as_strips(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> tuple[str, list[str]]:
        await pilot.app.workers.wait_for_complete()
        await pilot.pause()
        return screen_text(screen.app), list(screen.timeline.strips)

    text, strips = shown(recording, script, measures=True)
    assert strips == ["cost", "valid", "accel", "skate", "error"]
    assert "path err" in text
    assert "no poses" not in text
    assert "Esc ends it" not in text, "what has ended is at work no more"


def test_the_order_and_the_filter_are_said(recording: Recording):
    assert "may play · by name" in after(recording, "s")
    assert "1 of 5 may play" in after(recording)
    assert "name holds jog" in after(recording, "slash", *"jog", "enter")
    assert "no asset's name holds 'zzz'" in after(recording, "slash", *"zzz", "enter")
    assert "name holds" not in after(recording, "slash", *"jog", "enter", "escape")


def test_the_cursor_goes_with_what_is_chosen_until_it_is_moved(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> list[str]:
        seen = []
        for keys in ((JUMP,), (JUMP,), ("down",), (JUMP,), ("c",), (JUMP,)):
            await press(pilot, *keys)
            row = screen.bars.row
            seen.append("" if row is None else row.asset)
        return seen

    first, second, moved, same, chosen, last = shown(recording, script)
    assert (first, second) == ("walk", "jog")
    assert same == moved != second
    assert chosen == "jog"
    assert last == "walk"


def test_the_help_has_the_questions_and_every_key(recording: Recording):
    text = after(recording, "f1", size=(160, 100))
    for question in ("Why this clip?", "Why not mine?", "Why does it jump so much?", "What if this weight were different?"):
        assert question in text
    for about in ("To the next jump.", "Write turned weights", "Look from farther left"):
        assert about in text


# ---- sessions that lack something


def test_a_session_without_its_project_says_so_and_can_be_scrubbed(here: Path):
    shutil.rmtree("game")
    trace = Trace.load("session.parquet")
    lone = Recording("session.parquet", trace, "", {}, "its project is no longer there.")
    text = after(lone, JUMP, "plus", "w", "r", "o", "tab")
    assert "tick 61 " in text
    assert "its project is no longer there." in text


def test_a_choice_for_several_characters_is_told_with_its_roles(here: Path):
    trace = Trace()
    costs = {"Host": {"Hips velocity": 0.1}, "Guest": {"Hips velocity": 0.2}}
    entered = Together("Host", "greet", 0.5, {"Host": "7", "Guest": "3"}, costs)
    sentence = "7 as Host (0.1000) and 3 as Guest (0.2000) enter greet together at 0.50 s, at cost 0.3000."
    playing = Playing("joint", "greet.Host", 0, 15, 0.5, mirrored=False)
    trace.record(Decision(1, 0.0, Action.JUMP, sentence, True, playing, None, 0.3, together=entered))
    trace.record(Decision(2, 0.1, Action.CONTINUE, "plays greet on", False, playing, None))
    text = after(Recording("session.parquet", trace, "", {}, ""), "end")
    assert "7 as Host (0.1000) and 3 as Guest (0.2000) enter greet together" in text


def test_hostile_names_are_text(here: Path):
    trace = Trace.load("session.parquet")
    lone = Recording("a\x1b[31m[b]\n.parquet", trace, "", {}, "no \x1b[0m[/b]")
    text = after(lone)
    assert "\x1b" not in text
    assert "[b]" in text


# ---- how it stands


def test_the_status_is_that_of_replay_once_the_poses_are_made(recording: Recording):
    recording.strips(recording.open_banks(), lambda: None)
    status, expected = recording.status_at(FIRST), told(FIRST)["status"]
    assert status.to_json() == {**expected, "stride": status.to_json()["stride"], "warp_deg": status.to_json()["warp_deg"]}
    assert status.stride is not None
    assert expected["speed_mps"]["clip_off"] == pytest.approx(
        expected["speed_mps"]["clip"] - expected["speed_mps"]["wanted"], abs=1e-3
    )

    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> str:
        screen.go(FIRST)
        await pilot.pause()
        return " ".join(screen_text(screen.app).split())

    found = shown(recording, script)
    for name, text in status.lines():
        assert f"{name} {text}".replace(",", "") in found  # what is compared stands in columns


def test_the_pose_is_the_one_that_was_shown_and_the_pane_says_so(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> tuple[str, str, bool]:
        screen.banks = recording.open_banks()
        screen.go(FIRST + 2)
        assert screen.stage.figure is not None
        before, bones = str(screen.stage.border_title), screen.stage.figure.chosen
        screen._take_strips(recording.strips(screen.banks, lambda: None))
        return before, str(screen.stage.border_title), bool(abs(screen.stage.figure.chosen - bones).max() > 1e-3)

    of_clips, blended, is_other = shown(recording, script)
    assert "not blended" in of_clips
    assert "as shown, blended" in blended
    assert is_other


@pytest.mark.parametrize("size", [SMALL, LARGE])
def test_every_text_has_the_contrast_of_wcag_in_every_theme(recording: Recording, size: tuple[int, int]):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> set[tuple[str, str]]:
        screen.go(FIRST)
        unreadable = set[tuple[str, str]]()
        for theme in THEMES:
            screen.app.theme = theme.name
            await pilot.pause()
            unreadable |= faint(screen.app)
        return unreadable

    assert shown(recording, script, size) == set()


# ---- looking and measuring by hand


def test_the_next_measure_is_marked_and_said_and_a_window_is_zoomed(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> tuple[list[str], list[float | None]]:
        measures, windows = [], []
        for _ in range(2):
            await press(pilot, "m")
            measures.append(screen.timeline.measure)
            assert "goes to the next peak of" in screen_text(screen.app)
        for key in ("comma", "comma", "full_stop", "full_stop"):
            await press(pilot, key)
            windows.append(screen.timeline.window_s)
        return measures, windows

    measures, windows = shown(recording, script)
    assert len(set(measures)) == 2
    assert windows == [2.0, 2.0, None, None]


def test_what_is_not_there_is_said(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> list[str]:
        seen = []
        for *keys, last in (("home", "left_square_bracket"), ("home", "N"), ("r",), ("w",), ("u",)):
            await press(pilot, *keys, last)
            seen.append(screen_text(screen.app))
        return seen

    jump, peak, run, write, undo = shown(recording, script)
    assert "There is no jump before this moment." in jump
    assert "There is no peak of" in peak
    for text in (run, write):
        assert "No weight is changed" in text
    assert "nothing written to undo" in undo


def test_a_weight_that_is_turned_back_is_turned_no_more(recording: Recording):
    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> list[bool]:
        await press(pilot, "shift+tab")
        seen = []
        for key in ("plus", "minus"):
            await press(pilot, key)
            seen.append(bool(screen.turned))
        return seen

    assert shown(recording, script) == [True, False]


def test_the_mouse_goes_to_a_bar_and_a_weight_and_turns_the_view(recording: Recording):
    banks = recording.open_banks()

    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> None:
        await pilot.click(screen.bars, offset=(5, 3))
        assert screen.bars.at == 1
        await pilot.click(screen.channels, offset=(screen.channels.size.width // 2, 3))
        assert screen.channels.at == 1
        assert screen._pane == "channels"
        screen._take_banks(banks)
        before = screen.stage.camera
        await pilot.mouse_down(screen.stage, offset=(10, 5))
        await pilot.hover(screen.stage, offset=(20, 8))
        await pilot.mouse_up(screen.stage, offset=(20, 8))
        turned = screen.stage.camera
        assert turned != before
        await pilot.hover(screen.stage, offset=(5, 5))
        assert screen.stage.camera == turned  # let go

    shown(recording, script)


def test_escape_leaves_the_filter_and_space_stops_what_plays(recording: Recording, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("tui.debug.screen.time", SimpleNamespace(monotonic=lambda: 0.0))  # no time passes while it plays

    async def script(screen: DebugScreen, pilot: Pilot[Any]) -> list[bool]:
        await press(pilot, "slash", "w", "escape")
        seen = [screen.focused is screen.bars]
        for key in ("space", "escape", "space", "space"):
            await pilot.press(key)
            seen.append(screen._playing is not None)
        await press(pilot, "end", "space")
        seen.append(screen.index < 150)
        screen.action_stop()
        return seen

    assert shown(recording, script) == [True, True, False, True, False, True]


def test_a_session_without_a_decision_is_refused(here):
    (here / "none.parquet").write_bytes(Trace().to_bytes())
    with pytest.raises(MotionError, match="the session has no decision"):
        opened(here / "none.parquet", here / "game")
