"""A link: what is watched tells of itself while somebody listens, and is what it was before when nobody does."""

import copy
import gc
import os
import pickle
import random
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from links import FACTS, listening, meeting, next_lines, recorded, table, until

import contextdb as cdb
from contextdb import motion
from contextdb.cells.facts import FactSet
from contextdb.compiled.live import LiveContext
from contextdb.compiled.table import data_of
from contextdb.telemetry.link.feed import MOST_ENTRIES, Feed, Moments, Picked, Source
from contextdb.telemetry.link.lines import given_facts
from contextdb.telemetry.link.listeners import FileListener

__all__ = ["meeting"]
pytestmark = pytest.mark.skipif(not hasattr(os, "getuid"), reason="sockets in folders of a user are of Unix")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "moments.jsonl"


@pytest.fixture
def link(meeting: Path) -> Iterator[cdb.Link]:
    with cdb.link("game") as opened:
        yield opened


def test_what_is_watched_is_the_object_that_it_was_and_its_copies_are_watched_by_nobody(link: cdb.Link, meeting: Path):
    jog = table()
    live = jog.live(FACTS)
    jog.query(FACTS)
    ask = data_of(jog)._ask
    link.watch(jog, "player")
    link.watch(live, "npc")
    with listening(link, meeting):
        assert (data_of(jog)._ask, type(live)) == (ask, LiveContext)
        for copied in (live.copy(), copy.deepcopy(live), pickle.loads(pickle.dumps(live))):
            assert copied._watcher is None
            assert copied.matches().assets == live.matches().assets
        assert data_of(pickle.loads(pickle.dumps(jog)))._watcher is None
    link.close()
    assert data_of(jog)._watcher is live._watcher is None


def test_a_copy_of_a_controller_is_watched_by_nobody(link: cdb.Link):
    controller = motion.Controller(two_databases())
    link.watch(controller)
    assert copy.deepcopy(controller)._watcher is None
    assert controller.copy()._watcher is None


def test_while_nobody_listens_nothing_is_published(link: cdb.Link, meeting: Path):
    jog = table()
    link.watch(jog, "player")
    jog.pick(jog.query(FACTS))
    jog.live(FACTS).matches()
    assert not link._feed.entries


def test_a_listener_learns_who_asked_what_and_what_was_picked(link: cdb.Link, meeting: Path):
    jog = table()
    link.watch(jog, "player")
    with listening(link, meeting) as hearing:
        assert hearing.header["game"] == "game"
        assert hearing.header["pid"] == os.getpid()
        told = hearing.header["tables"]["jog"]
        assert told == {"version": jog.version, "rows": 3, "conditions": {"speed": "number", "gait": "enum"}}
        with link._writer.lock:  # so that both are told at once
            asset = jog.pick(jog.query(FACTS))
        [line] = next_lines(hearing, "ask")
    assert (line["who"], line["table"], line["facts"]) == ("player", "jog", FACTS)
    assert (int(line["rows"], 16), line["valid"]) == (0b110, 2)
    assert jog.assets[line["pick"]["row"]] == line["pick"]["asset"] == asset


def test_a_row_that_the_game_plays_of_itself_belongs_to_the_last_question(meeting: Path, file: Path):
    with cdb.link("game", record=file) as link:
        jog = table()
        link.watch(jog, "player")
        with link._writer.lock:  # so that all are written at once
            valid = jog.query(FACTS)
            link.picked(jog, "player", int(valid.rows[0]))
            link.picked(jog, "npc", -1)
    [played], [other] = recorded(file), recorded(file, "pick")
    assert (played["who"], played["pick"]) == ("player", {"row": 1, "asset": jog.assets[1]})
    assert (other["who"], other["pick"]["row"]) == ("npc", None)


@pytest.mark.parametrize("row", [3, -2, 1.5, "run"])
def test_a_row_that_the_table_does_not_have_is_not_published(link: cdb.Link, row: object):
    with pytest.raises(cdb.ContextDBError):
        link.picked(table(), "player", row)  # type: ignore[arg-type]
    with pytest.raises(cdb.ContextDBError, match="a compiled table"):
        link.picked({}, "player", 0)  # type: ignore[arg-type]


def test_every_way_to_ask_a_table_is_told_once(meeting: Path, file: Path):
    with cdb.link("game", record=file) as link:
        jog = table()
        link.watch(jog, "player")
        ask = jog.query  # kept by the game
        ask(FACTS)
        jog.query(FACTS, unknown="any")
        jog.query({"speed": 1.0}, unknown="never")  # read with care
        jog.query({"speed": FactSet("0..5"), "gait": "Idle"})
        with link._writer.lock:
            jog.pick(FACTS)
        with pytest.raises(cdb.ContextError):
            jog.query({"speed": 1.0})
    lines = recorded(file)
    assert [line["facts"] for line in lines] == [
        FACTS, FACTS, {"speed": 1.0}, {"speed": {"cell": "0..5"}, "gait": "Idle"}, FACTS
    ]  # fmt: skip
    assert [given_facts(line["facts"]) for line in lines[:2]] == [FACTS, FACTS]
    assert ["pick" in line for line in lines] == [False, False, False, False, True]


def test_a_question_with_actors_tells_who_was_offered(meeting: Path, file: Path):
    schema: dict[str, dict[str, object]] = {"Defender.speed": {"type": "number"}, "far": {"type": "bool"}}
    cells = {"Asset": ["a", "b"], "Defender.speed": ["0..1", "1.."], "far": ["Any", "True"]}
    tackle = cdb.Table.from_columns(cells, schema, name="tackle").compile()
    with cdb.link("game", record=file) as link:
        link.watch(tackle)
        live = tackle.live({"far": True})
        link.watch(live, "npc")
        tackle.query({"far": True}, actors={"Defender": [{"id": 7, "speed": 2.0}]})
        live.actors({"Defender": [{"id": 8, "speed": 0.5}]})
        live.matches()
    first, second = recorded(file)
    assert (first["who"], first["actors"], first["rows"]) == (None, {"Defender": [{"id": 7, "speed": 2.0}]}, "2")
    assert (second["who"], second["actors"], second["rows"]) == ("npc", {"Defender": [{"id": 8, "speed": 0.5}]}, "1")


def test_a_question_that_only_the_mirror_asks_is_not_told(meeting: Path, file: Path):
    schema: dict[str, dict[str, object]] = {"direction": {"type": "angle"}, "side": {"type": "enum", "values": ["Left", "Right"]}}
    schema["side"]["mirror"] = {"Left": "Right"}
    turn = cdb.Table.from_columns({"Asset": ["l"], "direction": ["0..90"], "side": ["Any"]}, schema, name="turn").compile()
    with cdb.link("game", record=file) as link:
        link.watch(turn)
        assert turn.query({"direction": 45.0, "side": "Left"}).mirrored.assets == []
    assert [line["facts"] for line in recorded(file)] == [{"direction": 45.0, "side": "Left"}]


def test_a_live_context_tells_what_it_is_asked_and_its_picks_are_its_own(meeting: Path, file: Path):
    jog = table()
    contexts = [jog.live({"speed": speed, "gait": "Walk"}) for speed in (0.7, 2.5)]
    with cdb.link("game", record=file) as link:
        for number, live in enumerate(contexts):
            link.watch(live, f"npc{number}")
        with link._writer.lock:
            answers = [live.matches() for live in contexts]
            for answer in answers:
                jog.pick(answer)
        jog.pick(jog.query(FACTS))  # nobody watches the table itself
        contexts[0]["speed"] = float("nan")
        contexts[0]["speed"] = 2**60
        contexts[0].matches()
    lines = recorded(file)
    assert [line["who"] for line in lines] == ["npc0", "npc1", "npc0"]
    assert [line["facts"]["speed"] for line in lines] == [0.7, 2.5, 2**60]
    assert [line["pick"]["row"] in answer.rows for line, answer in zip(lines, answers, strict=False)] == [True, True]
    assert recorded(file, "pick") == []


def test_a_live_context_with_derived_facts_and_rules_is_watched_too(meeting: Path, file: Path):
    schema: dict[str, dict[str, object]] = {
        "speed": {"type": "number"},
        "goal": {"type": "number"},
        "gap": {"type": "number", "expr": "goal - speed"},
    }
    jog = cdb.Table.from_columns({"Asset": ["a"], "gap": ["0.."]}, schema, name="jog").compile()
    live = jog.live({"speed": 1.0, "goal": 3.0})
    with cdb.link("game", record=file) as link:
        link.watch(live, "npc")
        assert len(live.matches()) == 1
    assert type(live) is LiveContext
    assert [line["facts"] for line in recorded(file)] == [{"speed": 1.0, "goal": 3.0}]


def test_facts_are_those_of_the_question_whatever_the_game_does_with_them_after(meeting: Path, file: Path):
    jog = table(schema={"tags": {"type": "tags"}}, cells={"tags": ["Any"] * 3})
    tags = {"InAir"}
    facts = {**FACTS, "tags": tags}
    with cdb.link("game", record=file) as link:
        link.watch(jog)
        jog.query(facts)
        tags.add("Hurt")
        facts["speed"] = 9.0
    assert recorded(file)[0]["facts"] == {**FACTS, "tags": ["InAir"]}


def test_who_asks_can_be_a_function(meeting: Path, file: Path):
    jog, names = table(), iter(["a", "b", None])
    with cdb.link("game", record=file) as link:
        link.watch(jog, lambda: next(names))
        for _ in range(3):
            jog.query(FACTS)
    assert [line["who"] for line in recorded(file)] == ["a", "b", None]


def test_who_is_watched_again_is_renamed(meeting: Path, file: Path):
    jog = table()
    with cdb.link("game", record=file) as link:
        link.watch(jog, "a")
        link.watch(jog, "b")
        jog.query(FACTS)
    assert [line["who"] for line in recorded(file)] == ["b"]


def test_a_folder_that_is_watched_stays_watched_over_a_hot_reload(meeting: Path, tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n')
    (tmp_path / "jog.csv").write_text("Asset,speed\nwalk,0..2\n")
    clock = [0.0]
    watch = cdb.watch(tmp_path, poll_s=None, clock=lambda: clock[0])
    with cdb.link("game") as link:
        link.watch(watch, "player")
        old = watch["jog"]
        with listening(link, meeting) as hearing:
            (tmp_path / "jog.csv").write_text("Asset,speed\nwalk,0..2\nrun,2..9\n")
            for _ in range(3):
                clock[0] += 1.0
                watch.poll()
            new = watch["jog"]
            assert new is not old
            until(lambda: data_of(new)._watcher is not None)
            assert next_lines(hearing, "tables")[0]["tables"]["jog"]["version"] == new.version
            new.query({"speed": 5.0})
            assert next_lines(hearing, "ask")[0]["rows"] == "2"
    assert data_of(new)._watcher is None


def test_what_the_game_lets_go_is_watched_no_more(meeting: Path, file: Path):
    with cdb.link("game", record=file) as link:
        jog = table()
        link.watch(jog)
        for _ in range(50):
            link.watch(jog.live(FACTS), "gone")
        gc.collect()
        until(lambda: len(link._watched) == 1)
        del jog
        gc.collect()
        until(lambda: len(link._watched) == 0)


def two_databases() -> motion.Selector:
    features, starts, stops = [[0.0], [1.0], [2.0]], [0, 2], [2, 3]
    import numpy as np

    database = motion.MotionDatabase.from_features(
        np.array(features, np.float32), np.array(starts), np.array(stops), ["walk", "run"]
    )
    return motion.Selector([motion.Entry("all", database)])


def test_a_controller_tells_its_decisions_and_keeps_its_own_recorder(meeting: Path, file: Path):
    class Kept:
        n_candidates = 1

        def __init__(self) -> None:
            self.decisions: list[object] = []

        def record(self, decision: object) -> None:
            self.decisions.append(decision)

    own = Kept()
    controller = motion.Controller(two_databases(), recorder=own)
    with cdb.link("game", record=file) as link:
        link.watch(controller, "player")
        decision = controller.update(0.1, [2.0])
    assert controller.recorder is own
    assert own.decisions == [decision]
    [line] = recorded(file, "decision")
    assert (line["who"], line["decision"]["playing"]["asset"]) == ("player", "run")


def test_a_link_watches_all_controllers_of_a_group(meeting: Path, file: Path):
    group = motion.ControllerGroup(motion.Controller(two_databases()) for _ in range(2))
    with cdb.link("game", record=file) as link:
        link.watch(group, "npc")
        group.update(0.1, [[0.0], [2.0]])
    told = [(line["who"], line["decision"]["playing"]["asset"]) for line in recorded(file, "decision")]
    assert told == [("npc 0", "walk"), ("npc 1", "run")]


def test_a_decision_and_a_choice_can_be_told_without_watching(meeting: Path, file: Path):
    selector = two_databases()
    with cdb.link("game", record=file) as link:
        link.tell("player", motion.Controller(selector).update(0.1, [0.0]))
        link.tell("npc", selector.search([2.0]))
        with pytest.raises(cdb.ContextError, match="of type int"):
            link.tell("npc", 3)
    first, second = recorded(file, "decision")
    assert first["decision"]["action"] == "starts"
    assert second["decision"]["choice"]["hit"]["asset"] == "run"


@pytest.mark.parametrize("wrong", [3, None, "jog", {"a": 1}])
def test_what_cannot_be_watched_is_refused(link: cdb.Link, wrong: object):
    with pytest.raises(cdb.ContextError, match="a link cannot watch"):
        link.watch(wrong)


def test_a_table_that_is_not_compiled_is_refused_with_what_to_do(link: cdb.Link):
    plain = cdb.Table.from_columns({"Asset": ["a"]}, name="x")
    with pytest.raises(cdb.ContextError, match="Try to compile it first"):
        link.watch(plain)


def test_two_links_do_not_watch_one_table(link: cdb.Link, meeting: Path):
    jog = table()
    with cdb.link("other") as other:
        other.watch(jog)
        with pytest.raises(cdb.ContextError, match='"jog" is watched by another link'):
            link.watch(jog)
    gc.collect()
    link.watch(jog)


def test_a_link_that_is_closed_watches_nothing(meeting: Path):
    link = cdb.link("game")
    link.close()
    link.close()
    with pytest.raises(cdb.ContextError, match="closed"):
        link.watch(table())
    assert repr(link) == "<Link 'game': closed>"


@pytest.mark.parametrize("per_second", [0.5, 61])
def test_a_link_sends_one_to_sixty_times_a_second(meeting: Path, per_second: float):
    with pytest.raises(cdb.ContextError, match="from 1 to 60"):
        cdb.link("game", per_second=per_second)


@pytest.mark.parametrize(("name", "why"), [("x.csv", r"ends in \.jsonl"), ("no/x.jsonl", "cannot be written")])
def test_a_recording_that_cannot_be_written_is_refused(meeting: Path, tmp_path: Path, name: str, why: str):
    with pytest.raises(cdb.FileError, match=why):
        cdb.link("game", record=tmp_path / name)


def test_a_recording_is_not_written_over_another_file(meeting: Path, file: Path):
    file.write_text("mine")
    with pytest.raises(cdb.FileError, match="there already"):
        cdb.link("game", record=file)
    assert file.read_text() == "mine"


def test_a_process_that_is_forked_off_tells_nothing_and_takes_nothing_along(link: cdb.Link, meeting: Path):
    jog = table()
    link.watch(jog)
    with listening(link, meeting) as hearing:
        child = os.fork()
        if child == 0:
            jog.query(FACTS)
            os._exit(0 if data_of(jog)._watcher is None and link._is_closed else 1)
        assert os.waitpid(child, 0)[1] == 0
        jog.query(FACTS)
        assert next_lines(hearing, "ask")


# ---- the queue


SOURCE = Source("jog", "v", 3, {})


def lines_of(*entries: tuple[str, object, object], every: bool = False) -> list[tuple[str | None, object, object]]:
    feed, moments = Feed(), Moments()
    for who, what, answer in entries:
        feed.put(who, SOURCE, what, answer)  # type: ignore[arg-type]
    new = moments.of(feed.take(100))
    return [(one.who, one.facts, one.pick and one.pick.asset) for one in (new if every else moments.newest())]


def test_of_each_character_the_newest_question_is_sent_and_the_newest_that_was_picked_from():
    answers = [object() for _ in range(4)]
    entries = [("a", {"n": i}, answer) for i, answer in enumerate(answers)]
    entries.insert(2, ("a", Picked(0, "walk"), answers[1]))  # type: ignore[arg-type]
    entries.insert(1, ("a", Picked(1, "old"), answers[0]))  # type: ignore[arg-type]
    entries.append(("b", {"n": 9}, object()))
    assert lines_of(*entries) == [("a", {"n": 1}, "walk"), ("a", {"n": 3}, None), ("b", {"n": 9}, None)]
    assert lines_of(*entries, every=True) == [
        ("a", {"n": 0}, "old"), ("a", {"n": 1}, "walk"), ("a", {"n": 2}, None), ("a", {"n": 3}, None), ("b", {"n": 9}, None)
    ]  # fmt: skip


def test_characters_that_ask_first_and_are_picked_for_later_keep_their_picks():
    answers = {name: object() for name in "abcdef"}
    asked = [(name, {"n": 1}, answer) for name, answer in answers.items()]
    picked = [("table", Picked(0, f"of {name}"), answers[name]) for name in "abc"]
    assert [(who, asset) for who, _, asset in lines_of(*asked, *picked)] == [
        ("a", "of a"), ("b", "of b"), ("c", "of c"), ("d", None), ("e", None), ("f", None)
    ]  # fmt: skip


def test_a_pick_of_a_question_that_was_sent_before_is_of_who_asked():
    answer, feed, moments = object(), Feed(), Moments()
    feed.put("a", SOURCE, {"n": 1}, answer)  # type: ignore[arg-type]
    [question] = moments.of(feed.take(9))
    question._line = b"{}"
    moments.newest()
    feed.put("table", SOURCE, Picked(2, "run"), answer)  # type: ignore[arg-type]
    [pick] = moments.of(feed.take(9))
    assert (pick.who, pick.facts, pick.pick) == ("a", None, Picked(2, "run"))


def test_a_full_queue_drops_what_comes_next_and_counts_it():
    feed = Feed(4)
    for n in range(10):
        feed.put("a", SOURCE, {"n": n})
    assert [entry[3] for entry in feed.take(100)] == [{"n": n} for n in range(4)]
    assert (feed.dropped(), feed.dropped()) == (6, 0)


def test_no_entry_is_lost_or_told_twice_when_several_threads_ask(meeting: Path, file: Path):
    jog, n_threads, n_each = table(), 4, 200
    jog.query(FACTS)
    with cdb.link("game", record=file) as link:
        link.watch(jog)
        threads = [
            threading.Thread(
                target=lambda first: [jog.query({**FACTS, "speed": first + i}) for i in range(n_each)], args=(n * 1000,)
            )
            for n in range(n_threads)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    speeds = [line["facts"]["speed"] for line in recorded(file)]
    assert sorted(speeds) == sorted(n * 1000 + i for n in range(n_threads) for i in range(n_each))
    assert recorded(file, "lost") == []


def test_lines_that_are_lost_are_told(link: cdb.Link, meeting: Path):
    jog = table()
    link.watch(jog)
    with listening(link, meeting, every=True) as hearing:
        until(lambda: link._writer._listeners and link._writer._listeners[0].wants_every)
        with link._writer.lock:  # the thread waits, as on a machine that is busy
            generator = random.Random(0)
            for _ in range(3 * MOST_ENTRIES):
                jog.query({**FACTS, "speed": generator.random()})
        jog.query(FACTS)
        lost = sum(line["count"] for line in next_lines(hearing, "lost"))
    assert lost >= MOST_ENTRIES


def test_a_listener_that_wants_the_newest_gets_each_character_of_a_table(link: cdb.Link, meeting: Path):
    jog, now = table(), {"who": ""}
    link.watch(jog, lambda: now["who"])
    live = jog.live(FACTS)
    link.watch(live, "npc")
    with listening(link, meeting) as hearing, link._writer.lock:
        for now["who"] in ("a", "b", "a"):
            jog.query(FACTS)
        picked = jog.pick(live.matches())
        link._writer.lock.release()
        try:
            lines = next_lines(hearing, "ask", 3)
        finally:
            link._writer.lock.acquire()
    assert sorted((line["who"], line.get("pick", {}).get("asset")) for line in lines) == [("a", None), ("b", None), ("npc", picked)]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no disk that is always full")
def test_a_game_goes_on_when_the_disk_of_its_recording_is_full(caplog: pytest.LogCaptureFixture):
    full = FileListener(Path("m.jsonl"), open("/dev/full", "wb", buffering=0))  # noqa: SIM115
    for _ in range(3):
        full.offer(b"{}\n")
        full.send()
    full.close()
    assert caplog.messages == ["m.jsonl: the recording ends here: No space left on device"]
