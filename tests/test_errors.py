"""Errors: what built-in ones they are, that their text is ours, and that they travel between processes."""

import copy
import errno
import pickle
from pathlib import Path

import pytest

import contextdb as cdb
from contextdb import errors, motion
from contextdb.commands.edit_command import TerminalError
from contextdb.disk import read_bytes, refused_writing
from contextdb.disk.engines import EngineError
from contextdb.errors import ContextDBError, Fault, FileError, Place
from contextdb.files.tensors import FileKind
from contextdb.files.texts import scanned_parquet
from contextdb.tables.table import Table
from contextdb.telemetry.evaluate_file import answers_written

BUILT_IN: dict[type[ContextDBError], tuple[type[Exception], ...]] = {
    errors.CellError: (ValueError,),
    errors.SchemaError: (ValueError,),
    errors.TableError: (ValueError,),
    errors.NoSuchTable: (ValueError, KeyError),
    errors.NoSuchRow: (ValueError, IndexError),
    errors.FileError: (OSError,),
    errors.ContextError: (ValueError,),
    errors.NoSuchFact: (ValueError, KeyError),
    errors.NoSuchOutput: (ValueError, KeyError),
    errors.NoSuchPlace: (ValueError, IndexError),
    errors.WrongType: (ValueError, TypeError),
    errors.PolicyError: (),
    errors.ArtefactError: (ValueError,),
    errors.MotionError: (ValueError,),
    errors.ClipError: (ValueError,),
    errors.QueryError: (ValueError,),
}
FAULTS = (
    Fault("there is no such file.", "a file", '"jog.csv"', Place("tables/jgo.csv", 3, "speed")),
    Fault("it's \\ no table.", place=Place(row=4)),
)
TEXT = (
    'tables/jgo.csv, line 3, column "speed": there is no such file. Accepted: a file. Did you mean "jog.csv"?\n'
    "row 5: it's \\ no table."
)
KINDS = pytest.mark.parametrize("kind", [ContextDBError, *BUILT_IN, EngineError, TerminalError])


def test_every_error_says_which_built_in_error_it_is():
    ours = {e for e in vars(errors).values() if isinstance(e, type) and issubclass(e, ContextDBError)}
    assert ours == {ContextDBError, *BUILT_IN}
    kinds = (ValueError, OSError, KeyError, IndexError, TypeError)
    assert {e: tuple(k for k in kinds if issubclass(e, k)) for e in BUILT_IN} == BUILT_IN


@KINDS
def test_the_text_of_an_error_is_that_of_its_faults(kind: type[ContextDBError]):
    assert str(kind(*FAULTS)) == TEXT
    assert kind(*FAULTS).args == (TEXT,)
    assert str(kind("one sentence")) == "one sentence"
    assert str(kind()) == ""
    assert repr(kind("one sentence")) == f"{kind.__name__}('one sentence')"


@KINDS
@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda error: pickle.loads(pickle.dumps(error))])
def test_an_error_pickles_and_copies(kind, again):
    error = kind(*FAULTS)
    other = again(error)
    assert (type(other), other.faults, str(other), other.args) == (kind, FAULTS, TEXT, error.args)


def test_an_error_of_the_disk_has_what_an_os_error_has(tmp_path: Path):
    missing = tmp_path / "jog.csv"
    with pytest.raises(OSError, match="there is no such file") as caught:
        read_bytes(missing)
    for error in (caught.value, pickle.loads(pickle.dumps(caught.value)), copy.copy(caught.value)):
        assert (error.errno, error.filename, error.strerror) == (errno.ENOENT, str(missing), "there is no such file.")
    assert FileError("full").errno is None


def test_a_name_that_a_project_has_not_is_a_key_error_with_our_text():
    project = cdb.Project.load(Path(__file__).parent.parent / "tables")
    with pytest.raises(KeyError) as caught:
        project["locomotoin"]
    assert str(caught.value).endswith('Did you mean "locomotion"?')
    assert project.get("locomotoin") is None


def test_facts_and_arguments_that_cannot_be_used_are_value_errors():
    table = Table.from_columns({"Asset": ["a"], "speed": ["1..2"]}, {"speed": {"type": "number"}}).compile()
    with pytest.raises(ValueError, match="speed"):
        table.query({})
    with pytest.raises(IndexError):
        table.explain({"speed": 1}).row(1)
    with pytest.raises(ValueError, match="the query has shape"):
        motion.MotionDatabase.from_features([[1.0], [2.0]], [0], [2], ["a"]).search([1.0, 2.0])


@pytest.mark.parametrize("kind", [FileError, errors.TableError, errors.ArtefactError, errors.SchemaError])
@pytest.mark.parametrize(
    "guard",
    [
        lambda path: refused_writing(path, b""),
        answers_written,
        scanned_parquet,
        lambda path: FileKind("thing", 1, "a thing", "one", "to make it").reading(path),
    ],
)
def test_an_error_of_ours_passes_what_turns_those_of_the_system_into_ours(tmp_path: Path, guard, kind):
    path = tmp_path / "jog.parquet"
    cdb.load(Path(__file__).parent.parent / "tables" / "locomotion.csv").save(path)
    error = kind(*FAULTS)
    with pytest.raises(kind) as caught, guard(path):
        raise error
    assert caught.value is error


def test_a_watch_of_no_folder_says_that_there_is_none(tmp_path: Path):
    with pytest.raises(FileError, match="there is no such folder"):
        cdb.watch(tmp_path / "none")
