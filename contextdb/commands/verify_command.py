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
from collections.abc import Sequence
from pathlib import Path

from contextdb.authoring.verify import CHECKS, UNUSABLE, Verdict, files_under, verified
from contextdb.console import ExitCode, aligned, output, progress, wants_colour
from contextdb.errors import Fault, FileError, Place
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
