"""Every reader of the project, each with whole examples of what it reads: what `make fuzz` damages, and the corpus is read by.

A reader takes a file. Whatever stands in it, it comes back, or raises a ContextDBError: a command ends with 0, 1 or 2.
"""

from __future__ import annotations

import io
import os
import shutil
import socket
import zlib
from collections.abc import Callable, Mapping
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import clip_files
import numpy as np
import polars as pl
from running import ROOT, run

import contextdb as cdb
from contextdb import motion
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, BOOL, INT, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.grammar import parse_cell
from contextdb.commands.live_command import Changes, _show
from contextdb.covering.baseline import read_baseline
from contextdb.disk.folder_lock import UNFINISHED
from contextdb.errors import ContextDBError
from contextdb.exchange.formats import FORMATS, write
from contextdb.expressions import read_expression
from contextdb.files.journal_lines import line_of
from contextdb.motion.markup.markup import Markup
from contextdb.motion.storage.stored import open_database, save_database
from contextdb.tables.gap_work import gaps_path
from contextdb.tables.other_files import notes_path
from contextdb.telemetry.link.hearing import Hearing, Wanted
from contextdb.telemetry.link.listeners import SocketListener
from tui.model.journal import journal_path
from tui.model.session import Session
from tui.model.watched import digest_of

SCHEMA = {
    "speed": {"type": "number", "min": 0, "max": 10},
    "n": {"type": "int"},
    "heading": {"type": "angle"},
    "ok": {"type": "bool"},
    "pos": {"type": "enum", "values": ["CB", "FS", "Half Back"]},
    "tags": {"type": "tags", "values": ["Move.Run", "Stunned"]},
}
CELLS = {
    "Asset": ["jog", "run", "von Hand"],
    "speed": ["0..5 | 7", "20, 9.99 ~2", "Any"],
    "n": ["not 3", ">=2", ""],
    "heading": ["170, 20", "(30..-30]", "-"],
    "ok": ["True", "no", "Any"],
    "pos": ['CB "Half Back"', "not FS", "Any"],
    "tags": ["+Move -Stunned", "Any", "+Move.Run"],
}
TOML = (ROOT / "tables/contextdb.toml").read_text(encoding="utf-8")
DOMAINS = (BOOL, INT, NUMBER, ANGLE, Domain("enum", ("CB", "FS", "Half Back")), TEXT, TAGS)
CONTEXTS = {"speed": [1.0, 2.5], "ok": [True, None], "pos": ["CB", "FS"], "tags": [["Move.Run"], []]}
STICK = "time_s,speed_mps,turn_dps,ok\n0,1.5,0,True\n0.5,2,-30,False\n1.25,0,,True\n"
MARKS = (ROOT / "tables/clips/marks.csv").read_bytes()


NOTES = b'Asset,Column,Note,Colour\njog,speed,"too, fast",red\nrun,,hm,#ff0000\n'
GAP_WORK = b'State,Owner,hit,speed\nanimating,Ana,True,"(3..5]"\nopen,,,9..\n'
UNFINISHED_RECORD = b'{"format":1,"files":[{"file":"t.csv","new":".contextdb-00000000-aa.tmp","is":"00","old":null,"was":"11"}]}'
LINK = (
    b'{"line":"header","format":1,"game":"g","pid":1,"tables":{"t":{"version":"0"}}}\n'
    b'{"line":"ask","t":1.5,"who":"a","table":"t","facts":{"speed":1.5,"ok":true,"n":{"number":"inf"}},"rows":"AQ==","valid":1}\n'
    b'{"line":"pick","t":1.5,"who":"a","table":"t","pick":{"row":0,"asset":"jog"}}\n{"line":"lost","count":3}\n{"line":"end"}\n'
)
EXPRESSIONS = (
    b'speed > 2 and not (ok or pos in ["CB", "FS"])\nabs(heading - 90) <= 30\n"Move" in tags\nmin(speed, 3) * 2 % 5 // 1\n'
)
FBX = clip_files.fbx(clip_files.BODY)
BVH = b"""HIERARCHY
ROOT Hips
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT LeftFoot
  {
    OFFSET 10 -90 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 0 10
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.033333
0 90 0 0 0 0 1 2 3
0 90 5 0 0 0 1 2 3
0 90 9 0 0 0 1.5e0 2 -3
"""


@dataclass(frozen=True)
class Reader:
    """One reader, the suffix of its files, and whole files that it reads."""

    suffix: str
    examples: Callable[[], list[bytes]]
    read: Callable[[Path], object]


def table() -> cdb.Table:
    return cdb.Table.from_columns(CELLS, SCHEMA)


def commanded(*arguments: str | Path) -> None:
    """Run a command; it must end with one of its exit codes and, where it refuses, with words."""
    result = run(*arguments)
    assert result.code in (0, 1, 2), result
    assert result.out or result.err or result.code == 0, arguments


def saved(save: Callable[[Path], object], suffix: str) -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"x{suffix}"
        save(path)
        return path.read_bytes()


def parquet(columns: Mapping[str, object]) -> bytes:
    out = io.BytesIO()
    pl.DataFrame(columns).write_parquet(out)
    return out.getvalue()


# ---- examples


def csv_table() -> bytes:
    rows = zip(*CELLS.values(), strict=True)
    quoted = ([f'"{text.replace(chr(34), 2 * chr(34))}"' if set(text) & set(',"') else text for text in row] for row in rows)
    return "".join(f"{','.join(row)}\n" for row in [list(CELLS), *quoted]).encode()


def database() -> motion.MotionDatabase:
    return motion.MotionDatabase.from_features(np.eye(5, 3, dtype=np.float32), [0, 2], [2, 5], ["jog", "run"])


def save_motion(path: Path) -> None:
    save_database(database(), path)


def session() -> bytes:
    return motion.Trace(databases={"loco": database()}).to_bytes()


def baseline() -> bytes:
    with TemporaryDirectory() as folder:
        (Path(folder) / "t.csv").write_text("Asset,ok\njog,True\n", encoding="utf-8")
        return run("coverage", Path(folder) / "t.csv", "--json").out.encode()


def parts(path: Path) -> list[bytes]:
    """The lines of a file, a few at a time."""
    lines = path.read_bytes().splitlines(keepends=True)
    return [b"".join(lines[at : at + 5]) for at in range(0, len(lines), 5)]


def foreign(name: str) -> list[bytes]:
    return [write(table(), FORMATS[name])[0]]


def journal() -> bytes:
    head = {"format": 1, "file": "t.csv", "digest": digest_of(csv_table())}
    return b"".join(map(line_of, [head, {"do": {"name": "x", "changes": []}}, {"go": 0}, {"saving": "0" * 32}]))


# ---- readers


def read_toml(path: Path) -> None:
    (path.parent / "contextdb.toml").write_bytes(path.read_bytes())
    (path.parent / "t.csv").write_bytes(csv_table())
    commanded("check", path.parent)


def read_cases(path: Path) -> None:
    (path.parent / "t.csv").write_bytes(csv_table())
    path.rename(path.parent / "t.cases.csv")
    commanded("check", path.parent / "t.cases.csv")


def read_artefact(path: Path) -> None:
    compiled = cdb.CompiledTable.open(path)
    compiled.query({"speed": 1.0, "n": 2, "heading": 0.0, "ok": True, "pos": "CB", "tags": {"Move.Run"}}, unknown="any")


def read_database(path: Path) -> None:
    opened = open_database(path, verify=True)
    opened.search(np.zeros(opened.n_features, np.float32))


def read_import(path: Path) -> None:
    commanded("import", path, path.parent / "new.csv")


def read_contexts(path: Path) -> None:
    (path.parent / "t.csv").write_bytes(csv_table())
    commanded("evaluate", path.parent / "t.csv", path, "--unknown", "any")


def read_merge(path: Path) -> None:
    (path.parent / "base.csv").write_bytes(csv_table())
    (path.parent / "ours.csv").write_bytes(csv_table() + b"new,1,1,1,True,CB,Any\n")
    commanded("merge", path.parent / "base.csv", path.parent / "ours.csv", path)


def opened(path: Path) -> None:
    """Open a table as the editor does."""
    with suppress(ContextDBError):
        Session(path).close()


def read_journal(path: Path) -> None:
    """As it is, and with check sums that are right: what is altered in a line is then read."""
    (path.parent / "t.csv").write_bytes(csv_table())
    raw, journal = path.read_bytes(), journal_path(path.parent / "t.csv")
    journal.parent.mkdir()
    path.unlink()
    bodies = [line[9:] for line in raw.split(b"\n")]
    for altered in (raw, b"".join(b"%08x %s\n" % (zlib.crc32(body), body) for body in bodies)):
        journal.write_bytes(altered)
        opened(path.parent / "t.csv")


def read_notes(path: Path) -> None:
    (path.parent / "t.csv").write_bytes(csv_table())
    notes = path.rename(notes_path(path.parent / "t.csv"))
    commanded("check", path.parent)
    commanded("merge", notes, notes, notes, "--path", "t.notes.csv", "--out", path.parent / "merged")
    opened(path.parent / "t.csv")


def read_gap_work(path: Path) -> None:
    (path.parent / "t.csv").write_bytes(csv_table())
    gaps = path.rename(gaps_path(path.parent / "t.csv"))
    commanded("check", path.parent)
    commanded("merge", gaps, gaps, gaps, "--path", "t.gaps.csv", "--out", path.parent / "merged")
    commanded("coverage", path.parent / "t.csv")


def read_unfinished(path: Path) -> None:
    (path.parent / "t.csv").write_bytes(csv_table())
    path.rename(path.parent / UNFINISHED)
    commanded("check", path.parent)


def read_merged_toml(path: Path) -> None:
    for name in ("base", "ours"):
        (path.parent / f"{name}.toml").write_text(TOML, encoding="utf-8")
    commanded("merge", path.parent / "base.toml", path.parent / "ours.toml", path, "--path", "contextdb.toml")


def read_link(path: Path) -> None:
    """What a game sends to `contextdb live`, and what somebody sends to a game."""
    raw = path.read_bytes()
    for hears in (True, False):
        game, listener = socket.socketpair()
        with game, listener, redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()), suppress(ContextDBError, OSError):
            game.settimeout(5.0)
            game.sendall(raw[:100_000])
            game.shutdown(socket.SHUT_WR)
            if hears:
                _show(Hearing(Path("game.sock"), listener, Wanted()), Changes({}, False), None, None)
            else:
                one = SocketListener(listener, "", lambda: b"{}\n")
                while not one.is_gone:
                    one.read()


# ---- folders in which something odd is in the place of a file

ODD = ("a file", "empty", "folder", "link to nothing", "link to itself", "link to a folder", "not allowed", "pipe")
PROJECT = (
    "t.csv", "u.csv", "contextdb.toml", "t.cases.csv", "t.notes.csv", "t.actors.json", "t.safetensors", UNFINISHED,
    ".contextdb-journal", ".contextdb-journal/t.csv.journal", ".contextdb-journal/t.csv.lock", ".contextdb-cache", "clips",
    "t.gaps.csv",
)  # fmt: skip
FOLDER_COMMANDS = (
    "", "check {0}", "coverage {0} --work 1000 --samples 100", "compile {0}", "query {0}/t.csv speed=1 --unknown any",
    "verify {0}/t.csv", "motion check {0}", "motion build {0}", "export {0}/t.csv {0}/new.json",
    "import {0}/t.csv {0}/u.csv --force",
    "diff {0}/t.csv {0}/u.csv", "evaluate {0}/t.csv {0}/u.csv --unknown any",
)  # fmt: skip


def read_folder(path: Path) -> None:
    """A byte for what is in the place of each file, 64 and above something odd, and a last one for the command."""
    folder, raw = path.parent / "project", path.read_bytes() or b"\0"
    (folder / ".contextdb-journal").mkdir(parents=True)
    (folder / "t.csv").write_bytes(csv_table())
    for name, byte in zip(PROJECT, raw[:-1], strict=False):
        if byte >= 64 and (folder / name).parent.is_dir():
            make_odd(folder / name, ODD[byte % len(ODD)])
    command = FOLDER_COMMANDS[raw[-1] % len(FOLDER_COMMANDS)]
    if command:
        commanded(*(word.format(folder) for word in command.split()))
    else:
        opened(folder / "t.csv")


def make_odd(path: Path, kind: str) -> None:
    """Put something into the place of a file."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    match kind:
        case "a file":
            path.write_bytes(csv_table())
        case "folder":
            path.mkdir()
        case "link to nothing":
            path.symlink_to("nothing")
        case "link to itself":
            path.symlink_to(path.name)
        case "link to a folder":
            path.symlink_to(".")
        case "not allowed":
            path.touch(0)
        case "pipe" if hasattr(os, "mkfifo"):
            os.mkfifo(path)
        case _:
            path.touch()


# ---- texts


def read_cells(path: Path) -> None:
    for text in path.read_bytes().decode("utf-8", "replace").split("\n"):
        for domain in DOMAINS:
            with suppress(ContextDBError):
                parse_cell(text, domain)


@cache
def conditions() -> tuple[Condition, ...]:
    return table().compile().conditions


def read_expressions(path: Path) -> None:
    for text in path.read_bytes().decode("utf-8", "replace").split("\n"):
        with suppress(ContextDBError):
            read_expression(text, conditions())


def read_clips(path: Path) -> None:
    """Each refusal names the file."""
    try:
        motion.load_clips([path])
    except ContextDBError as error:
        if not str(error).startswith(str(path)):
            raise RuntimeError(f"the file is not named: {error}") from None
        raise


READERS: dict[str, Reader] = {
    "csv": Reader(".csv", lambda: [csv_table()], lambda path: commanded("check", path)),
    "parquet": Reader(".parquet", lambda: [parquet(CELLS)], lambda path: commanded("check", path)),
    "toml": Reader(".toml", lambda: [TOML.encode()], read_toml),
    "cases": Reader(".csv", lambda: [(ROOT / "tables/locomotion.cases.csv").read_bytes()], read_cases),
    "artefact": Reader(".safetensors", lambda: [saved(table().compile().save, ".safetensors")], read_artefact),
    "database": Reader(
        ".safetensors", lambda: [saved(lambda path: save_database(database(), path), ".safetensors")], read_database
    ),
    "session": Reader(".parquet", lambda: [session()], lambda path: commanded("motion", "replay", path)),
    "baseline": Reader(".json", lambda: [baseline()], lambda path: read_baseline(path.read_text("utf-8", "replace"), str(path))),
    "contexts": Reader(".csv", lambda: [b"speed,ok,pos\n1,True,CB\n2.5,,FS\n"], read_contexts),
    "telemetry": Reader(".parquet", lambda: [parquet(CONTEXTS)], read_contexts),
    "merge": Reader(".csv", lambda: [csv_table()], read_merge),
    "journal": Reader(".journal", lambda: [journal()], read_journal),
    "bvh": Reader(".bvh", lambda: [BVH], lambda path: motion.load_bvh(path)),
    "npz": Reader(".npz", lambda: [clip_files.amass(clip_files.SMPL_OFFSETS), clip_files.joints()], read_clips),
    "glb": Reader(".glb", lambda: [clip_files.gltf(clip_files.BODY)], read_clips),
    "fbx": Reader(".fbx", lambda: [FBX, clip_files.skinned(FBX, clip_files.BODY)], read_clips),
    "fbx-binary": Reader(".fbx", lambda: [clip_files.binary_fbx(FBX)], read_clips),
    "usd": Reader(".usda", lambda: [clip_files.usda(clip_files.BODY)], read_clips),
    "usdc": Reader(".usdc", lambda: [clip_files.usdc(clip_files.usda(clip_files.BODY))], read_clips),
    "gltf": Reader(".gltf", lambda: [clip_files.gltf(clip_files.BODY, binary=False)], read_clips),
    "marks": Reader(".csv", lambda: [MARKS], lambda path: Markup.load(path)),
    "notes": Reader(".csv", lambda: [NOTES], read_notes),
    "gap-work": Reader(".csv", lambda: [GAP_WORK], read_gap_work),
    "unfinished": Reader(".json", lambda: [UNFINISHED_RECORD], read_unfinished),
    "merge-toml": Reader(".toml", lambda: [TOML.encode()], read_merged_toml),
    "link": Reader(".jsonl", lambda: [LINK, b'{"format":1,"every":true,"who":["a"],"tables":["t"],"trace":true}\n'], read_link),
    "folder": Reader(
        ".bin", lambda: [bytes([byte] * len(PROJECT) + [at]) for at, byte in enumerate(bytes(range(60, 72)))], read_folder
    ),
    "cells": Reader(".txt", lambda: parts(ROOT / "tests/cells.csv"), read_cells),
    "expressions": Reader(".txt", lambda: [*parts(ROOT / "tests/expressions/refused.txt"), EXPRESSIONS], read_expressions),
    **{
        f"import-{name}": Reader(one.suffixes[0] if one.suffixes else ".csv", lambda name=name: foreign(name), read_import)
        for name, one in FORMATS.items()
        if one.is_read and one.suffixes
    },
}


@cache
def examples(name: str) -> list[bytes]:
    """The whole files of a reader, made once."""
    return READERS[name].examples()


def read_bytes(name: str, raw: bytes) -> None:
    """Read bytes as a file in a folder of its own; raises what is no answer in words."""
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        path = Path(folder) / f"x{READERS[name].suffix}"
        path.write_bytes(raw)
        with suppress(ContextDBError):
            READERS[name].read(path)
