"""Hot reload: what is at hand is always one whole good version, and the newest one soon after the files have come to rest."""

import json
import logging
import os
import random
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import polars as pl
import pytest
from strategies import IS_FULL

import contextdb as cdb
from contextdb.compiled.table import data_of
from contextdb.tables.watching import Snapshot, Watch, table_like
from contextdb.tables.watching.rest import Rest

N_SAVED = 1000 if IS_FULL else 250
N_TURNS = 200 if IS_FULL else 25
"""Turns of each thread that asks and reloads."""
STEP_S = 0.06
"""Between two looks; the files have to rest for 0.1 s, so a change is taken at the third look that sees it."""

TOML = '[conditions.speed]\ntype = "number"\n[conditions.state]\ntype = "enum"\nvalues = ["Air", "Ground"]\n[tables.jog]\n'


class Folder:
    """A folder of tables that is watched by a clock of its own, with all that its watch calls."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.time_s = 0.0
        self.changes: list[Snapshot] = []
        self.errors: list[cdb.ContextDBError] = []
        self.write("contextdb.toml", TOML)
        self.write("jog.csv", "Asset,speed,state\njog,2..4,Air\nrun,4..9,Any\n")
        self.watch: Watch = cdb.watch(path, self.changes.append, self.errors.append, poll_s=None, clock=lambda: self.time_s)

    def write(self, name: str, text: str) -> None:
        (self.path / name).write_text(text, encoding="utf-8", newline="")

    def replace(self, name: str, text: str) -> None:
        self.write(f"{name}.part", text)
        os.replace(self.path / f"{name}.part", self.path / name)

    def jog(self, *rows: str) -> None:
        self.write("jog.csv", "\n".join(["Asset,speed,state", *rows, ""]))

    def look(self, times: int = 1) -> int:
        """Look so many times; gives how many versions were swapped in."""
        found = 0
        for _ in range(times):
            self.time_s += STEP_S
            found += self.watch.poll()
        return found

    def assets(self, speed: float = 3.0) -> list[str]:
        return self.watch["jog"].query({"speed": speed, "state": "Air"}).assets


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    return Folder(tmp_path)


# ---- what is swapped in


def test_a_change_is_swapped_in_once_the_files_have_rested(folder: Folder):
    folder.jog("walk,1..3,Any")
    assert [folder.look(), folder.assets()] == [0, ["jog"]]
    assert folder.look(2) == 1
    assert folder.assets() == ["walk"]
    assert [(s.number, s.changed) for s in folder.changes] == [(2, ("jog",))]
    assert folder.look(50) == 0
    assert folder.watch.project["jog"].assets == ["walk"]


def test_a_change_of_contextdb_toml_is_swapped_in(folder: Folder):
    folder.write("contextdb.toml", TOML + 'fallback = "idle"\n')
    assert folder.look(4) == 1
    assert folder.watch["jog"].fallback == "idle"
    assert folder.watch["jog"].pick({"speed": 99.0, "state": "Air"}) == "idle"


def test_a_new_table_and_one_that_is_taken_away_are_swapped_in(folder: Folder):
    folder.write("new.csv", "Asset,speed\nn,1\n")
    assert folder.look(4) == 1
    assert folder.watch["new"].query({"speed": 1}).assets == ["n"]
    (folder.path / "new.csv").unlink()
    assert folder.look(4) == 1
    with pytest.raises(cdb.TableError, match='there is no table "new"'):
        folder.watch["new"]


def test_a_table_that_contextdb_toml_newly_names_in_a_folder_below_is_watched_from_then_on(folder: Folder):
    (folder.path / "deep").mkdir()
    folder.write("deep/d.csv", "Asset,speed\nd,1\n")
    folder.write("contextdb.toml", TOML + '[tables.d]\nfile = "deep/d.csv"\n')
    assert folder.look(8) == 1
    folder.write("deep/d.csv", "Asset,speed\nother,1\n")
    assert folder.look(4) == 1
    assert folder.watch["d"].query({"speed": 1}).assets == ["other"]


def test_a_parquet_table_is_watched(folder: Folder):
    pl.DataFrame({"Asset": ["p"], "speed": [3]}).write_parquet(folder.path / "p.parquet")
    assert folder.look(4) == 1
    pl.DataFrame({"Asset": ["q"], "speed": [3]}).write_parquet(folder.path / "p.parquet")
    assert folder.look(4) == 1
    assert folder.watch["p"].query({"speed": 3}).assets == ["q"]


def test_files_that_are_touched_or_saved_without_an_edit_change_nothing(folder: Folder):
    os.utime(folder.path / "jog.csv", (1, 1))
    folder.replace("contextdb.toml", TOML)
    assert folder.look(60) == 0
    assert folder.changes == folder.errors == []


def test_a_change_that_the_file_times_do_not_show_is_found_while_they_are_coarse(folder: Folder, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("contextdb.tables.watching.rest._stamp", lambda path: (1, 2, 3, 4))
    folder.jog("one,1..3,Any")
    assert [folder.look(4), folder.assets()] == [1, ["one"]]
    folder.jog("two,1..3,Any")
    assert [folder.look(), folder.assets()] == [0, ["one"]]
    assert [folder.look(3), folder.assets()] == [1, ["two"]]


# ---- what is passed over


def test_a_file_that_is_still_being_written_is_not_read(folder: Folder):
    with (folder.path / "jog.csv").open("w", encoding="utf-8") as file:
        for line in ("Asset,speed,state\n", *(f"a{i},1..3,Any\n" for i in range(30))):
            file.write(line)
            file.flush()
            assert folder.look() == 0
            assert folder.assets() == ["jog"]
    assert folder.look(2) == 1
    assert len(folder.assets()) == 30
    assert folder.errors == []


def test_an_editor_that_deletes_or_renames_on_its_way_is_not_noticed(folder: Folder):
    os.replace(folder.path / "jog.csv", folder.path / "jog.csv~")
    assert folder.look() == 0
    folder.write("4913", "")
    folder.jog("walk,1..3,Any")
    assert folder.look(4) == 1
    assert (folder.assets(), folder.errors) == (["walk"], [])


def test_of_rapid_saves_the_last_is_swapped_in(folder: Folder):
    for i in range(10):
        folder.jog(f"{'a' * (i + 1)},1..3,Any")  # of another size each: the disk's clock may not tell two quick saves apart
        assert folder.look() == 0
    assert folder.look(3) == 1
    assert folder.assets() == ["a" * 10]


def test_saves_that_never_rest_are_taken_about_every_second_when_each_replaces_the_file(folder: Folder):
    taken = []
    for i in range(100):
        folder.replace("jog.csv", f"Asset,speed,state\na{i},1..3,Any\n")
        if folder.look():
            taken.append((i, folder.assets()))
    assert 4 <= len(taken) <= 7
    assert all(assets == [f"a{i}"] for i, assets in taken)


# ---- what is wrong


def test_a_bad_file_keeps_the_last_good_version_and_tells_every_fault_once(folder: Folder):
    folder.jog("jog,fast,Air", "run,slow,Any")
    folder.write("contextdb.toml", TOML)
    folder.look(60)
    assert folder.assets() == ["jog"]
    (error,) = folder.errors
    assert [f.place.line for f in error.faults] == [2, 3]
    assert folder.watch.faults == error.faults
    folder.jog("jog,fast,Air", "run,1,Any", "x,y,Any")
    folder.look(4)
    assert [[f.place.line for f in e.faults] for e in folder.errors] == [[2, 3], [4]]


def test_the_faults_of_all_files_are_told_together(folder: Folder):
    folder.write("new.csv", "Asset,speed\nn,?\n")
    folder.jog("jog,fast,Air")
    folder.look(4)
    (error,) = folder.errors
    assert {Path(f.place.file or "").name for f in error.faults} == {"new.csv", "jog.csv"}


def test_a_mended_file_is_swapped_in_and_its_faults_are_told_again_when_they_return(folder: Folder):
    for asset in ("one", "two"):
        folder.jog(f"{asset},fast,Air")
        folder.look(4)
        folder.jog(f"{asset},1..3,Air")
        assert folder.look(4) == 1
        assert (folder.assets(), folder.watch.faults) == ([asset], ())
    assert len(folder.errors) == 2


def test_going_back_to_the_version_at_hand_ends_the_faults_without_a_swap_and_is_called_back(folder: Folder):
    good = (folder.path / "jog.csv").read_text(encoding="utf-8")
    for n in (1, 2):
        folder.jog("jog,fast,Air")
        folder.look(4)
        assert len(folder.errors) == n
        folder.write("jog.csv", good)
        assert folder.look(4) == 0
        assert folder.watch.faults == ()
        assert folder.changes == [folder.watch.snapshot()] * n
    folder.write("jog.csv", good + " ")
    folder.write("jog.csv", good)
    assert folder.look(4) == 0
    assert len(folder.changes) == 2, "nothing was wrong"


@pytest.mark.parametrize("name", ["jog.csv", "contextdb.toml"])
def test_a_file_that_is_deleted_is_told_once_and_may_come_back(folder: Folder, name: str):
    text = (folder.path / name).read_text(encoding="utf-8")
    (folder.path / name).unlink()
    folder.look(60)
    assert folder.assets() == ["jog"]
    (error,) = folder.errors
    assert [(f.rule, Path(f.place.file or "").name) for f in error.faults] == [("no-such-path", name)]
    folder.write(name, text)
    folder.look(4)
    assert folder.watch.faults == ()


def test_a_folder_that_is_moved_away_is_told_once_and_may_come_back(folder: Folder):
    away = folder.path.with_name(f"{folder.path.name}-away")
    os.replace(folder.path, away)
    folder.look(60)
    assert (folder.assets(), len(folder.errors)) == (["jog"], 1)
    os.replace(away, folder.path)
    folder.look(4)
    assert folder.watch.faults == ()


def test_the_tables_of_a_folder_that_cannot_be_listed_are_not_gone(tmp_path: Path):
    plain = tmp_path / "plain"
    plain.mkdir()
    (plain / "a.csv").write_text("Asset,x\na,1\n", encoding="utf-8")
    errors: list[cdb.ContextDBError] = []
    watch = cdb.watch(plain, on_error=errors.append, poll_s=None, settle_s=0.0)
    os.replace(plain, tmp_path / "away")
    assert not any(watch.poll() for _ in range(5))
    assert watch["a"].assets == ["a"]
    assert len(errors) == 1
    os.replace(tmp_path / "away", plain)
    watch.poll()
    assert watch.faults == ()


@pytest.mark.parametrize("toml", ["[conditions", '[conditions.speed]\ntype = "nunber"\n', "\xff"])
def test_a_contextdb_toml_that_cannot_be_used_keeps_the_last_good_version(folder: Folder, toml: str):
    (folder.path / "contextdb.toml").write_bytes(toml.encode("latin-1"))
    folder.look(60)
    assert (folder.assets(), len(folder.errors)) == (["jog"], 1)


def test_faults_are_logged_where_nobody_asks_for_them(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    (tmp_path / "a.csv").write_text("Asset,x\na,1\n", encoding="utf-8")
    times = iter(range(100))
    watch = cdb.watch(tmp_path, poll_s=None, clock=lambda: float(next(times)))
    (tmp_path / "a.csv").write_text("Asset,x\na,1,2\n", encoding="utf-8")
    with caplog.at_level(logging.ERROR, "contextdb"):
        assert not any(watch.poll() for _ in range(3))
    assert len(caplog.records) == 1
    assert "a.csv, line 2" in caplog.text


def test_a_watch_begins_with_a_good_version_or_not_at_all(tmp_path: Path):
    (tmp_path / "jog.csv").write_text("Asset,x\na,1,2\n", encoding="utf-8")
    with pytest.raises(cdb.TableError, match="line 2"):
        cdb.watch(tmp_path)
    with pytest.raises(cdb.FileError, match="there is no such folder"):
        cdb.watch(tmp_path / "none")


# ---- what a reload costs


def test_only_the_columns_that_changed_are_compiled(folder: Folder):
    before = folder.watch.snapshot()
    folder.jog("jog,2..4,Air", "run,4..8,Any")
    assert folder.look(4) == 1
    after = folder.watch.snapshot()
    assert data_of(after["jog"]).masks[1] is data_of(before["jog"]).masks[1]
    assert data_of(after["jog"]).masks[0] is not data_of(before["jog"]).masks[0]
    assert after["jog"].query({"speed": 9, "state": "Air"}).assets == []


def test_a_table_that_did_not_change_is_the_same_compiled_table(folder: Folder):
    folder.write("new.csv", "Asset,speed\nn,1\n")
    folder.look(4)
    before = folder.watch["new"]
    folder.jog("walk,1..3,Any")
    assert folder.look(4) == 1
    assert folder.watch["new"] is before


def test_a_new_contextdb_toml_costs_the_columns_whose_conditions_changed(folder: Folder):
    before = folder.watch.snapshot()
    folder.write("contextdb.toml", TOML.replace('"Ground"]', '"Ground", "Water"]'))
    assert folder.look(4) == 1
    after = folder.watch.snapshot()
    assert data_of(after["jog"]).masks[0] is data_of(before["jog"]).masks[0]
    assert after["jog"].query({"speed": 5, "state": "Water"}).assets == ["run"]


def test_a_reloaded_table_is_what_a_fresh_one_is(folder: Folder):
    rng = random.Random(5)
    cells = ["1..3", "5", "Any", "not 2", "fast", "Air", "True", "", "7 ~2", "Air Ground"]
    names = ["Asset", "speed", "state", "guessed", "also"]
    for _ in range(150):
        columns = ["Asset", *rng.sample(names[1:], rng.randint(1, 4))]
        rows = [",".join([f"a{r}", *(rng.choice(cells) for _ in columns[1:])]) for r in range(rng.randint(0, 4))]
        folder.write("jog.csv", "\n".join([",".join(columns), *rows, ""]))
        fresh = cdb.load(folder.path / "jog.csv", strict=False)
        old = folder.watch.project["jog"]
        assert fresh.source is not None
        found = table_like(old, fresh.columns, fresh.schema, fresh.settings, folder.path / "jog.csv", fresh.source)
        assert [str(f) for f in found.faults] == [str(f) for f in fresh.faults]
        assert [c.condition for c in found.conditions] == [c.condition for c in fresh.conditions]
        for one, other in zip(found.conditions, fresh.conditions, strict=True):
            assert [one.cell(r) for r in range(found.n_rows)] == [other.cell(r) for r in range(fresh.n_rows)]
        folder.look(4)
        if not fresh.faults:
            assert [c.to_list() for c in folder.watch.project["jog"].columns] == [c.to_list() for c in fresh.columns]


# ---- threads


@contextmanager
def asking(ask: Callable[[], None], n_threads: int = 4) -> Iterator[Callable[[], None]]:
    """Threads that ask, while the block goes on, as often as it calls what it is given; what one of them raises is raised here."""
    is_over, turns, raised = threading.Event(), threading.Semaphore(0), list[BaseException]()

    def run() -> None:
        try:
            while turns.acquire() and not is_over.is_set():
                ask()
        except BaseException as error:
            raised.append(error)

    threads = [threading.Thread(target=run) for _ in range(n_threads)]
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)  # threads take turns often: more mixtures to find
    for thread in threads:
        thread.start()
    try:
        yield lambda: turns.release(2 * n_threads)
    finally:
        is_over.set()
        turns.release(n_threads)
        for thread in threads:
            thread.join()
        sys.setswitchinterval(interval_s)
    assert raised == []


def test_every_answer_is_of_one_good_version_while_hundreds_are_saved_and_four_threads_ask(tmp_path: Path):
    rng = random.Random(3)
    time_s = 0.0

    def whole(version: int) -> dict[str, str]:
        return {
            "contextdb.toml": f'[conditions.x]\ntype = "number"\n[tables.a]\nfallback = "v{version}"\n',
            "a.csv": "Asset,x\n" + "".join(f"v{version}_{i},Any\n" for i in range(5)),
            "b.csv": "Asset,x\n" + "".join(f"v{version}_{i},Any\n" for i in range(3)),
        }

    def write(files: dict[str, str]) -> None:
        for name, text in files.items():
            if rng.random() < 0.5:
                (tmp_path / name).write_text(text, encoding="utf-8")
            else:
                (tmp_path / "part").write_text(text, encoding="utf-8")
                os.replace(tmp_path / "part", tmp_path / name)

    write(whole(0))
    errors: list[cdb.ContextDBError] = []
    watch = cdb.watch(tmp_path, on_error=errors.append, poll_s=None, clock=lambda: time_s)
    good, latest, seen = {0}, 0, set[int]()

    def ask() -> None:
        snapshot = watch.snapshot()
        answers = [*snapshot["a"].query({"x": 1}).assets, *snapshot["b"].query({"x": 1}).assets]
        (version,) = {asset.partition("_")[0] for asset in answers}
        assert (len(answers), snapshot["a"].fallback) == (8, version)
        assert int(version[1:]) in good
        seen.add(int(version[1:]))

    with asking(ask) as let_ask:
        for version in range(1, N_SAVED + 1):
            files, kind = whole(version), rng.choice(["good", "good", "broken", "half"])
            if kind == "half":  # stopped in the middle of a file, perhaps at the end of a line, and gone on with in time
                cut = rng.randrange(len(files["a.csv"]))
                write({**files, "a.csv": files["a.csv"][:cut]})
                time_s += STEP_S
                let_ask()
                watch.poll()
            elif kind == "broken":
                files["b.csv"] += "one,two,three\n"
            good |= {version} if kind != "broken" else set()
            write(files)
            n_looks = rng.choice([1, 3])
            for _ in range(n_looks):
                time_s += STEP_S
                let_ask()
                watch.poll()
            if n_looks == 3 and kind != "broken":
                latest = version
                assert watch["a"].fallback == f"v{latest}", "a good version that rested for the stated delay is at hand"
            elif n_looks == 3:
                assert watch.faults
    assert latest > 0.9 * N_SAVED
    assert len(seen) > 10
    assert len(errors) > 0.05 * N_SAVED


def test_eight_threads_ask_and_reload_together_and_no_answer_is_wrong(tmp_path: Path):
    """Row i of version v accepts speeds from i to i + v, the gait that i leaves with three, and every third row only True."""
    gaits, latest, turn = ("Idle", "Walk", "Run"), 0, threading.Lock()
    (tmp_path / "contextdb.toml").write_text(
        '[conditions.speed]\ntype = "number"\n[conditions.ok]\ntype = "bool"\n'
        '[conditions.gait]\ntype = "enum"\nvalues = ["Idle", "Walk", "Run"]\n[tables.a]\n',
        encoding="utf-8",
    )

    def write(version: int) -> None:
        rows = (f"v{version}_{i},{i}..{i + version},{gaits[i % 3]},{'Any' if i % 3 else True}" for i in range(100 + version))
        (tmp_path / "part").write_text("\n".join(["Asset,speed,gait,ok", *rows, ""]), encoding="utf-8")
        os.replace(tmp_path / "part", tmp_path / "a.csv")

    def expected(version: int, speed: float, gait: str, ok: bool) -> list[int]:
        rows = range(100 + version)
        return [i for i in rows if i <= speed <= i + version and gaits[i % 3] == gait and (ok or i % 3 > 0)]

    def ask_and_reload(seed: int) -> None:
        nonlocal latest
        rng, swapped = random.Random(seed), 0
        try:
            for _ in range(N_TURNS):
                table = watch["a"]
                version, live = int(table.assets[0][1:].partition("_")[0]), table.live(unknown="never")
                for _ in range(20):
                    facts = {"speed": rng.uniform(-1, 110), "gait": rng.choice(gaits), "ok": rng.random() < 0.5}
                    again = json.loads(json.dumps(facts))  # equal texts that are other objects
                    live.update(again)
                    for answer in (table.query(facts), table.query(again), live.matches()):
                        assert answer.indices.tolist() == expected(version, *facts.values())  # type: ignore[arg-type]
                if rng.random() < 0.3:
                    with turn:
                        latest = latest % 40 + 1
                        write(latest)
                swapped += watch.poll()
            n_swapped.append(swapped)
        except BaseException as error:
            wrong.append(error)

    write(latest)
    wrong, n_swapped = list[BaseException](), list[int]()
    with cdb.watch(tmp_path, poll_s=None, settle_s=0.0) as watch:
        threads = [threading.Thread(target=ask_and_reload, args=(seed,)) for seed in range(8)]
        interval_s = sys.getswitchinterval()
        sys.setswitchinterval(1e-5)
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        sys.setswitchinterval(interval_s)
    assert wrong == []
    assert len(n_swapped) == 8
    assert sum(n_swapped) > N_TURNS


def test_a_thread_of_the_watch_swaps_in_by_itself_until_it_is_closed(tmp_path: Path):
    (tmp_path / "a.csv").write_text("Asset,x\na,1\n", encoding="utf-8")
    is_swapped = threading.Event()
    with cdb.watch(tmp_path, lambda snapshot: is_swapped.set(), poll_s=0.001, settle_s=0.001) as watch:
        (tmp_path / "a.csv").write_text("Asset,x\nb,1\n", encoding="utf-8")
        assert is_swapped.wait(60)
        assert watch["a"].assets == ["b"]
    (tmp_path / "a.csv").write_text("Asset,x\nc,1\n", encoding="utf-8")
    assert watch["a"].assets == ["b"]
    assert "contextdb.watch" not in {thread.name for thread in threading.enumerate()}


def test_what_a_callback_raises_is_told_and_the_watch_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    told: list[object] = []
    monkeypatch.setattr(threading, "excepthook", lambda arguments: told.append(arguments.exc_type))
    (tmp_path / "a.csv").write_text("Asset,x\na,1\n", encoding="utf-8")
    is_second = threading.Event()

    def changed(snapshot: Snapshot) -> None:
        if snapshot.number == 3:
            is_second.set()
        (tmp_path / "a.csv").write_text(f"Asset,x\nb{snapshot.number},1\n", encoding="utf-8")
        raise KeyError(snapshot.number)

    with cdb.watch(tmp_path, changed, poll_s=0.001, settle_s=0.001):
        (tmp_path / "a.csv").write_text("Asset,x\nb,1\n", encoding="utf-8")
        assert is_second.wait(60)
    assert told[0] is KeyError


def test_a_callback_may_close_the_watch(folder: Folder):
    with cdb.watch(folder.path, lambda snapshot: watch.close(), poll_s=None, settle_s=0.0) as watch:
        folder.jog("walk,1..3,Any")
        assert watch.poll() or watch.poll()


# ---- rest


def test_files_rest_when_none_has_moved_for_long_enough():
    a, b = Path("a"), Path("b")
    rest = Rest({a: (1, 1, 1, 1), b: (2, 1, 1, 1)}, 0.0, settle_s=0.5)
    assert rest.is_due({a: (1, 1, 1, 1), b: (2, 1, 1, 1)}, 0.1)
    assert not rest.is_due({a: (1, 2, 1, 1), b: (2, 1, 1, 1)}, 0.2)
    assert not rest.is_due({a: (1, 2, 1, 1), b: None}, 0.6)
    assert rest.wait_s(0.8) == pytest.approx(0.3)
    assert not rest.is_due({a: (1, 2, 1, 1), b: None}, 1.0)
    assert rest.is_due({a: (1, 2, 1, 1), b: None}, 1.1)
    assert not rest.is_due({a: (1, 2, 1, 1)}, 1.2)
    assert rest.wait_s(2.0) is None


def test_patience_does_not_hold_for_a_file_that_is_written_in_place():
    a, b = Path("a"), Path("b")
    rest = Rest({a: (0, 1, 1, 1), b: (0, 1, 1, 1)}, 0.0, settle_s=0.5, patience_s=2.0)
    for i in range(1, 40):
        assert not rest.is_due({a: (i, 1, 1, 1), b: (0, i + 1, 1, 1)}, i * 0.1)
    assert not rest.is_due({a: (40, 1, 1, 1), b: (0, 40, 1, 1)}, 4.3)
    assert rest.is_due({a: (41, 1, 1, 1), b: (0, 40, 1, 1)}, 4.5)
