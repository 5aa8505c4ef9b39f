"""What `make fuzz` once found stays mended: every file of the corpus is read, or refused in words."""

import signal
import sys
from pathlib import Path

import pytest
from fuzz import BATCH, CORPUS, HANG_CPU_S, batch, how_it_ended, input_of
from fuzz_readers import READERS, examples, read_bytes

FILES = sorted(path for path in CORPUS.rglob("*") if path.is_file())


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_file_of_the_corpus_is_read_or_refused(path: Path):
    read_bytes(path.parent.name, path.read_bytes())


def test_every_folder_of_the_corpus_has_its_reader():
    assert {path.parent.name for path in FILES} <= READERS.keys()


@pytest.mark.parametrize("reader", READERS)
def test_a_reader_reads_its_whole_examples_and_some_damaged_ones(reader: str):
    for raw in (*examples(reader), *(input_of(reader, seed) for seed in range(15))):
        read_bytes(reader, raw)


def test_a_seed_means_one_input_and_a_batch_finds_nothing_in_a_sound_reader():
    assert input_of("cells", 7) == input_of("cells", 7) != input_of("cells", 8)
    one = batch("journal", 0)
    assert (one.n_read, one.finds) == (BATCH, [])


def test_a_batch_that_goes_no_further_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("fuzz.HANG_S", 0.05)
    waits = [sys.executable, "-c", "import threading; threading.Event().wait()"]
    assert how_it_ended(waits, tmp_path / "progress") == "no answer after 0 s"


def test_how_a_process_ended_is_told(tmp_path: Path):
    assert how_it_ended([sys.executable, "-c", "raise SystemExit(3)"], tmp_path / "progress") == "the process ended with 3"


@pytest.mark.skipif(not hasattr(signal, "SIGPROF"), reason="a limit of CPU as POSIX has it")
def test_a_batch_that_works_on_one_input_for_ever_is_ended(tmp_path: Path):
    ends = [sys.executable, "-c", "import os, signal; os.kill(os.getpid(), signal.SIGPROF)"]
    assert how_it_ended(ends, tmp_path / "progress") == f"no answer after {HANG_CPU_S:.0f} s of CPU"
