"""Check that files are as they were written.

Compiled tables, motion databases, recorded sessions, Parquet tables, reports (coverage, motion coverage, motion measure) and the
editor's journals contain a digest or checksums of their contents. In a folder every such file below it is checked. Tables in CSV
and contextdb.toml have none: they are read, and reported as readable.

Exits with 1 if a file is damaged, or of a version that this one does not read.

  contextdb verify hit_mid_air.safetensors
  contextdb verify tables/ --json
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from contextdb.console import ExitCode, aligned, output, progress, wants_colour
from contextdb.disk import read_bytes
from contextdb.disk.boundary import inside
from contextdb.errors import ArtefactError, ContextDBError, Fault, FileError, Place, in_quotes, plural
from contextdb.report.render_json import as_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("files", nargs="+", metavar="FILE", help="a file, or a folder of them")
    parser.add_argument("--json", action="store_true", help="print one JSON document")


def run(arguments: argparse.Namespace) -> ExitCode:
    paths = _paths(arguments.files)
    verdicts = [verified(path) for path in progress(paths, "verifying")]
    with output():
        print(_as_json(verdicts) if arguments.json else _as_text(verdicts, wants_colour(sys.stdout)), end="")
    return ExitCode.FOUND if any(v.state in UNUSABLE for v in verdicts) else ExitCode.OK


def _paths(texts: Sequence[str]) -> list[Path]:
    """The files that the arguments mean, each once."""
    paths: dict[Path, None] = {}
    for text in texts:
        below = files_under(Path(text)) if os.path.isdir(text) else [Path(text)]
        if not below:
            fault = Fault("the folder holds no file of contextdb.", f"a folder with {', '.join(CHECKS)}", place=Place(text))
            raise FileError(fault)
        paths |= dict.fromkeys(below)
    return list(paths)


def _as_json(verdicts: Sequence[Verdict]) -> str:
    return as_json({"format": 1, "files": [verdict.to_json() for verdict in verdicts]})


def _as_text(verdicts: Sequence[Verdict], colour: bool) -> str:
    words = {"whole": "whole", "no-digest": "readable", "older": "OLDER", "newer": "NEWER", "damaged": "DAMAGED"}
    lines = aligned([[words[v.state], v.file, f"{v.kind}: {v.message}"] for v in verdicts])
    return "".join(f"{line}\n" for line in lines)


# ---- whether files of contextdb are as they were written, by the digests and check sums that they hold. An edge: this reads
# files


State = Literal["whole", "no-digest", "older", "newer", "damaged"]
UNUSABLE: frozenset[State] = frozenset({"older", "newer", "damaged"})

NO_DIGEST = "read without a fault; files of this kind hold no digest"


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is known of one file."""

    file: str
    kind: str
    state: State
    """`older` and `newer`: of a version of contextdb whose files of this kind this one does not read."""
    message: str

    def to_json(self) -> dict[str, str]:
        return {"file": self.file, "kind": self.kind, "state": self.state, "message": self.message}


def verified(path: Path) -> Verdict:
    """Read a file and compare it with the digest that it holds.

    Raises
    ------
    FileError
        There is no such file, the disk refuses, or the file is of no kind that contextdb writes.
    """
    if not os.path.isfile(path):
        read_bytes(path)  # raises, with the reason
    check = CHECKS.get(path.suffix.lower())
    if check is None:
        accepted = f"a file that contextdb writes: {', '.join(CHECKS)}"
        raise FileError(Fault(f"{in_quotes(path.name)} is not a file of contextdb.", accepted, place=Place(str(path))))
    kind = "file"
    try:
        for kind, message in check(path):
            if message is not None:
                return Verdict(str(path), kind, "no-digest", message)
        return Verdict(str(path), kind, "whole", "as it was written")
    except FileError:
        raise
    except _OtherVersion as other:
        return Verdict(str(path), kind, other.state, str(other))
    except ContextDBError as error:
        return Verdict(str(path), kind, "damaged", " ".join(fault.message for fault in error.faults[:3]))


def files_under(folder: Path) -> list[Path]:
    """The files below a folder that contextdb may have written, in order; what is in hidden folders counts too. Raises
    FileError where a link leads out of the folder."""
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in CHECKS and path.is_file())
    return [inside(path, folder) for path in files]


class _OtherVersion(Exception):
    """The layout of a file is one that this version does not read: which version wrote it, older or newer, and what to do."""

    def __init__(self, state: State, why: str) -> None:
        super().__init__(why)
        self.state = state


def _require_layout(number: object, known: int, mend: str) -> None:
    """Tell a file of another version from a damaged one; what is no number is for the reader to refuse."""
    text = str(number)
    if not (text.isascii() and text.isdecimal() and len(text) < 6) or int(text) == known:
        return
    is_older = int(text) < known
    version, what = ("an older version", mend) if is_older else ("a newer version", "to install that version")
    raise _OtherVersion("older" if is_older else "newer", f"layout {text}, of {version}; this one reads {known}. Try {what}.")


# ---- kinds of files. Each check yields what it takes the file for, and at last why it holds no digest, where it holds none.
#
# A file of ours that holds a digest is read whole and compared with it. A CSV table or a contextdb.toml holds none, since git
# guards it, and is only read here; so is a Parquet file that another program wrote.

Kinds = Iterator[tuple[str, str | None]]


def _safetensors(path: Path) -> Kinds:
    from contextdb.compiled.artefact import COMPILED, open_artefact
    from contextdb.files.tensors import metadata_of
    from contextdb.motion.storage.pose_files import STORED_POSES, open_poses
    from contextdb.motion.storage.stored import CLIP_FEATURES, STORED, open_database

    keys = metadata_of(path, COMPILED)
    if STORED.key in keys:
        yield "motion database", None
        _require_layout(keys[STORED.key], STORED.layout, STORED.mend)
        open_database(path, verify=True)
    elif STORED_POSES.key in keys:
        yield "pose bank", None
        _require_layout(keys[STORED_POSES.key], STORED_POSES.layout, STORED_POSES.mend)
        open_poses(path, verify=True)
    elif CLIP_FEATURES.key in keys:
        yield "features of a clip", "cached by a build; the next build checks them and computes altered ones again"
    else:
        yield "compiled table", None
        _require_layout(keys.get(COMPILED.key), COMPILED.layout, COMPILED.mend)
        open_artefact(path)


def _parquet(path: Path) -> Kinds:
    from contextdb.files.parquet_frame import DamagedFrame, require_whole_file
    from contextdb.motion.trace.session import Trace
    from contextdb.motion.trace.session_file import FORMAT, FORMAT_KEY, MEND

    yield "Parquet file", None
    try:
        frame = require_whole_file(path)
    except DamagedFrame as error:
        raise ArtefactError(Fault(f"the file is damaged: {error}.", "a Parquet file as it was written")) from None
    if FORMAT_KEY in frame.metadata:
        yield "recorded session", None
        _require_layout(frame.metadata[FORMAT_KEY], FORMAT, MEND)
        Trace.load(path)
    elif frame.is_sealed:
        yield "table", None
    else:
        yield "Parquet file", "its frame is whole; another program wrote it, without a digest"


def _csv(path: Path) -> Kinds:
    from contextdb.files.csv_source import read_csv

    yield "CSV", None
    read_csv(read_bytes(path), str(path))
    yield "CSV", NO_DIGEST


def _toml(path: Path) -> Kinds:
    from contextdb.tables.project import read_folder_schema

    yield "contextdb.toml", None
    read_folder_schema(path.parent)
    yield "contextdb.toml", NO_DIGEST


def _json(path: Path) -> Kinds:
    from contextdb.covering.baseline import read_baseline
    from contextdb.files.reports import document_of, is_ours

    yield "JSON", None
    text = read_bytes(path).decode("utf-8-sig", "replace")
    try:
        document = document_of(text)
    except ValueError as error:
        raise ArtefactError(Fault(f"{error}.", "a document as it was written")) from None
    if not is_ours(document):
        yield "JSON", "a document of another program, or of another command; nothing to compare"
        return
    kind = _report(document)
    yield kind, None
    _require_layout(document.get("format"), 1, "to write the report again")
    if kind == COVERAGE:
        read_baseline(text, str(path))


COVERAGE = "coverage report"


def _report(document: Mapping[str, object]) -> str:
    """Which of our reports a document is. Only that of `motion coverage` has bins."""
    if "sessions" in document:
        return "report of measures"
    return COVERAGE if "bins" not in document else "report of motion coverage"


def _journal(path: Path) -> Kinds:
    from contextdb.files.journal_lines import FORMAT, n_lost, read_records

    yield "journal", None
    raw = read_bytes(path)
    records, n_bytes = read_records(raw)
    if n_bytes < len(raw):
        n_lines = n_lost(raw, n_bytes)
        what = f"altered, and {plural(n_lines, 'line')} cannot be used" if n_lines else "cut off"
        raise ArtefactError(Fault(f"line {len(records) + 1} is {what}.", "lines with their check sums"))
    if records:
        _require_layout(records[0].get("format"), FORMAT, "the version that wrote it")


CHECKS: Mapping[str, Callable[[Path], Kinds]] = {
    ".safetensors": _safetensors,
    ".parquet": _parquet,
    ".csv": _csv,
    ".toml": _toml,
    ".json": _json,
    ".journal": _journal,
}
