"""Telemetry on a real Dask cluster: the same sums, also when a worker is killed; a failure names the files."""

import os
import signal
import sys
from concurrent.futures import ThreadPoolExecutor

import polars as pl
import pytest
from running import run
from strategies import in_full_runs

from contextdb.disk.engines import EngineError
from contextdb.tables.table import Table
from contextdb.telemetry import observe

SCHEMA = {"speed": {"type": "number", "min": 0.0, "max": 10.0}}
TABLE = Table.from_columns({"Asset": ["a", "b"], "speed": ["0..2", "4..5"]}, SCHEMA)
N_FILES = 12


@pytest.fixture
def recorded(tmp_path):
    """Twelve files; the moments of file i are i..i+1."""
    for i in range(N_FILES):
        pl.DataFrame({"speed": [i + k / 5000 for k in range(5000)]}).write_parquet(tmp_path / f"{i:02}.parquet")
    return tmp_path


@pytest.fixture(scope="module")
def workers():
    """Two workers, each a process."""
    distributed = pytest.importorskip("distributed", reason='dask is not installed: pip install "contextdb[dask]"')
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as made:
        yield made


@pytest.fixture
def cluster(workers):
    """Both workers are there: one that a test before killed has been started again."""
    with workers.get_client() as client:
        client.wait_for_workers(2)
        yield workers


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
def test_a_worker_killed_half_way_changes_no_sum(recorded, cluster):
    killed = []

    def kill_one(n_done, n_files):
        if n_done == 3 and not killed:
            killed.append(next(iter(cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    found = observe(TABLE, f"{recorded}/*", engine="dask", scheduler=cluster.scheduler_address, progress=kill_one)
    assert killed
    assert found == observe(TABLE, f"{recorded}/*")
    assert found.moments == 5000 * N_FILES


@in_full_runs
def test_files_that_kill_every_worker_are_named(recorded, cluster, monkeypatch):
    monkeypatch.setattr("contextdb.disk.engines._run", die)
    with pytest.raises(EngineError, match=r"could not be finished: .*00\.parquet"):
        observe(TABLE, str(recorded / "00.parquet"), engine="dask", scheduler=cluster.scheduler_address)


def die(table: bytes, path: str) -> None:
    """What a worker does when it runs out of memory."""
    os._exit(1)


def test_a_scheduler_that_does_not_answer_is_told(recorded, monkeypatch):
    pytest.importorskip("distributed", reason='dask is not installed: pip install "contextdb[dask]"')
    with pytest.raises(EngineError, match="does not answer"):
        observe(TABLE, f"{recorded}/*", engine="dask", scheduler="nonsense://nowhere")


def test_without_dask_the_error_says_how_to_install_it(recorded, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(EngineError, match=r'pip install "contextdb\[dask\]"'):
        observe(TABLE, f"{recorded}/*", engine="dask")


def test_a_misspelt_engine_is_told_the_nearest(recorded):
    from contextdb.errors import ContextError

    with pytest.raises(ContextError, match='Did you mean "dask"'):
        observe(TABLE, f"{recorded}/*", engine="dsk")


# ---- contextdb evaluate


@pytest.fixture
def table_file(tmp_path):
    """The table as a file, in a folder of its own."""
    folder = tmp_path / "tables"
    folder.mkdir()
    (folder / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\nmin = 0\nmax = 10\n', encoding="utf-8")
    (folder / "t.csv").write_text("Asset,speed\na,0..2\nb,4..5\n", encoding="utf-8")
    return str(folder / "t.csv")


def test_evaluate_on_workers_gives_the_bytes_that_one_process_gives_though_one_is_killed(recorded, cluster, table_file):
    told = ("evaluate", table_file, f"{recorded}/*.parquet", "--json")
    here = run(*told, "--out", str(recorded / "here.csv"))
    pid = next(iter(cluster.workers.values())).pid
    with ThreadPoolExecutor(1) as pool:
        there = pool.submit(
            run, *told, "--out", str(recorded / "there.csv"), "--engine", "dask", "--scheduler", cluster.scheduler_address
        )
        while not (held := list(recorded.glob(".contextdb-*/*"))) and not there.done():
            pass
        assert held
        os.kill(pid, signal.SIGKILL)
        found = there.result()
    assert (found.code, found.json) == (0, here.json)
    assert found.json["contexts"] == 5000 * N_FILES
    assert (recorded / "there.csv").read_bytes() == (recorded / "here.csv").read_bytes()
    assert not list(recorded.glob(".contextdb-*"))


def test_evaluate_names_the_faults_of_every_file_and_writes_nothing(recorded, cluster, table_file):
    for name in ("03", "07"):
        path = recorded / f"{name}.parquet"
        path.write_bytes(path.read_bytes()[:-50])
    told = ("evaluate", table_file, f"{recorded}/*.parquet", "--out", str(recorded / "answers.csv"))
    found = run(*told, "--engine", "dask", "--scheduler", cluster.scheduler_address)
    assert (found.code, found.out) == (2, "")
    assert "03.parquet: " in found.err
    assert "07.parquet: " in found.err
    assert not list(recorded.glob("*answers*"))


@in_full_runs
def test_evaluate_that_kills_every_worker_names_the_files(recorded, cluster, table_file, monkeypatch):
    monkeypatch.setattr("contextdb.disk.engines._run", die)
    told = ("evaluate", table_file, str(recorded / "00.parquet"), "--out", str(recorded / "answers.csv"))
    found = run(*told, "--engine", "dask", "--scheduler", cluster.scheduler_address)
    assert (found.code, found.out) == (2, "")
    assert "1 file could not be finished: " in found.err
    assert "00.parquet" in found.err
    assert not list(recorded.glob("*answers*")) + list(recorded.glob(".contextdb-*"))


@in_full_runs
def test_an_opened_artefact_is_asked_on_workers_too(recorded, cluster, table_file):
    artefact = str(recorded / "t.safetensors")
    assert run("compile", table_file, "-o", artefact).code == 0
    told = (f"{recorded}/0*.parquet", "--json", "--engine", "dask", "--scheduler", cluster.scheduler_address)
    assert run("evaluate", artefact, *told).json["rows"] == run("evaluate", table_file, *told).json["rows"]
