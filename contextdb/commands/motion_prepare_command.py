"""Propose markup for clips, as a diff that you can review, edit, apply and revert: each mark with its reason and measure.

If hips sway, root_smooth_s for the features of the databases is proposed too. No clip file changes. Nothing is proposed where
there is a mark. In the folder, `patch -p1` applies the diff, and `patch -p1 -R` reverts it. With --write the next run reads only
changed clips, and replaces the marks that were written for their earlier versions, except those that were edited.

Exits with 1 if a proposal is not written, or a clip could not be read.

  contextdb motion prepare game/
  contextdb motion prepare game/ --only loops --only starts
  contextdb motion prepare game/ --write --watch
"""

from __future__ import annotations

import argparse
import csv
import difflib
import io
import json
import os
import tomllib
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from contextdb.authoring.clip_folder import CLIPS_OR_TABLES, MARKUP, FolderClips, below, clips_of
from contextdb.authoring.clip_looks import Looks
from contextdb.commands.engine_options import engines_of
from contextdb.commands.motion_build_command import add_clip_arguments, progress_of, watched
from contextdb.console import ExitCode, note, output, printable
from contextdb.disk import read_bytes
from contextdb.disk.boundary import inside
from contextdb.disk.own_files import has_own, make_own_folder, read_own, write_own
from contextdb.disk.together import NewFile, write_together
from contextdb.errors import Fault, FileError, Place, plural
from contextdb.motion.clips.clip import Clip
from contextdb.motion.markup.file import COLUMNS, text_of
from contextdb.motion.markup.markup import Markup
from contextdb.motion.preparing.proposal import KINDS, KeptClip, KnownProposals, Proposal, key_of
from contextdb.motion.preparing.proposals import ROOT_SMOOTH_S, prepare_again
from contextdb.motion.storage.building import CACHE_FOLDER
from contextdb.motion.storage.clip_files import named_takes
from contextdb.report.render_json import as_json
from contextdb.schema.toml_edit import set_key
from contextdb.tables.project import SCHEMA_FILE, folder_of

ROOT_KEY = "root_smooth_s"
JOINT_KINDS = ("roots", "contacts", "noise")
"""What is proposed for clips with roles: two people may move alike, and where they meet only a person can say."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clip_arguments(parser)
    help_text = f"propose only this: {', '.join(KINDS)}; may be repeated"
    parser.add_argument("--only", metavar="KIND", choices=KINDS, action="append", help=help_text)
    parser.add_argument("--write", action="store_true", help="write the marks into the markup file")
    parser.add_argument("--watch", action="store_true", help="do it again whenever a clip, markup or contextdb.toml is saved")
    parser.add_argument("--json", action="store_true", help="print a JSON document instead of a diff")


@dataclass
class Change:
    """A file as it is, and as it is proposed to be."""

    path: Path
    was: bytes | None
    old: str
    new: str

    @property
    def data(self) -> bytes:
        return self.new.encode()


@dataclass
class MarkupFile:
    """A markup file, and the clips that it is about."""

    path: Path
    clips: list[Clip] = field(default_factory=list)
    joint: list[Clip] = field(default_factory=list)
    """Those of databases with roles: they are entered and left together."""
    databases: list[str] = field(default_factory=list)
    """The databases that do not name it yet."""
    features: list[str] = field(default_factory=list)
    """The features of its databases that do not say yet how a root is made."""
    has_roots: bool = False
    """Whether all its databases have features that say it, or there is none to say it."""


def run(arguments: argparse.Namespace) -> ExitCode:
    """Propose markup, and write it with --write."""
    return watched(arguments.path, partial(_prepare, arguments)) if arguments.watch else _prepare(arguments)


def _prepare(arguments: argparse.Namespace) -> ExitCode:
    prepared = Prepared.load(folder_of(Path(arguments.path), CLIPS_OR_TABLES))
    looks = Looks(kinds=tuple(arguments.only or KINDS), known=prepared.cached.clips)
    with progress_of("reading clips") as tell:
        folder_clips = clips_of(
            arguments.path,
            arguments.metres_per_unit,
            arguments.up,
            tell,
            looks=looks,
            engines=engines_of(arguments),
            root=arguments.root_from,
        )
    prepared.cached.clips |= folder_clips.proposals()
    proposals, changes = [], []
    settings: dict[tuple[str, str, str], str | float] = {}
    done, n_clips = 0, len(folder_clips.seen)
    with progress_of("preparing") as tell:
        for file in _markup_files(folder_clips):

            def report_progress(i: int, _total: int, name: str, before: int = done) -> None:
                tell(before + i, n_clips, name)

            old, was = _text(file.path)
            if old:
                Markup.parse(old, str(file.path))  # a fault is reported with its line in the file as it is
            kinds = _kinds(arguments.only, file)
            wanted = [(file.clips, kinds), (file.joint, [kind for kind in kinds if kind in JOINT_KINDS])]
            outdated = {mark: name for clips, each in wanted for mark, name in prepared.outdated(clips, each, old).items()}
            rest = without(old, outdated)
            markup = Markup.parse(rest, str(file.path)) if rest else Markup()
            own = [prepare_again(clips, markup, each, report_progress, prepared.cached) for clips, each in wanted]
            done += len(file.clips) + len(file.joint)
            marks = {line_of(each): each for listed in own for each in listed if each.tag is not None}
            for clips, each in wanted:
                prepared.take(clips, each, marks)
            added = {line: each for line, each in marks.items() if line not in outdated}
            proposals += [each for listed in own for each in listed if each.tag is None or line_of(each) in added]
            gone = {line: name for line, name in outdated.items() if line not in marks}
            folder_clips.notes += _outdated(gone)
            if any(each.kind == "roots" for listed in own for each in listed):
                settings |= dict.fromkeys((("features", name, ROOT_KEY) for name in file.features), ROOT_SMOOTH_S)
            if added or gone:
                rest = without(old, gone)
                changes.append(Change(file.path, was, old, with_marks(rest, added) if added else rest))
                Markup.parse(changes[-1].new, str(file.path))
                name = file.path.relative_to(folder_clips.folder).as_posix()
                settings |= dict.fromkeys((("databases", database, "markup") for database in file.databases), name)
    changes += _settings(folder_clips.folder, settings)
    if arguments.write:
        _write(folder_clips, changes)
        prepared.save(folder_clips.clips)
    _report(folder_clips, proposals, changes, arguments)
    is_open = bool(changes) and not arguments.write
    return ExitCode.FOUND if is_open or folder_clips.left_out else ExitCode.OK


def _outdated(marks: Mapping[Line, str]) -> Iterator[str]:
    """Messages about marks that were written for an earlier version of a clip."""
    for name, n_marks in Counter(marks.values()).items():
        yield f"{name} changed since it was prepared: {plural(n_marks, 'mark')} of the earlier clip removed."


def _write(folder_clips: FolderClips, changes: Sequence[Change]) -> None:
    if changes and not write_together(folder_clips.folder, [NewFile(each.path, each.data, each.was) for each in changes]):
        fault = Fault("a file was changed by somebody else in this moment.", mend="to do the same once more")
        raise FileError(fault.at(Place(str(changes[0].path))))


def _kinds(only: Sequence[str] | None, file: MarkupFile) -> list[str]:
    """What is looked for: no roots where all features say how they are made."""
    return [kind for kind in only or KINDS if kind != "roots" or not file.has_roots]


def _markup_files(folder_clips: FolderClips) -> list[MarkupFile]:
    """The markup file of each clip: that of the first database that holds it, else one next to the clips."""
    at: dict[Path, list[Clip]] = {}
    for path, clip in zip(folder_clips.paths, folder_clips.clips, strict=True):
        at.setdefault(path, []).append(clip)
    if not folder_clips.config.databases:
        return [MarkupFile(inside(folder_clips.folder / MARKUP, folder_clips.folder), list(folder_clips.clips), has_roots=True)]
    files: dict[Path, MarkupFile] = {}
    roots = _with_roots(folder_clips.folder)
    for name, settings in folder_clips.config.databases.items():
        paths = [path for _, path, _ in named_takes(settings, folder_clips.folder, folder_clips.config.file)]
        own = [clip for path in paths for clip in at.pop(path, [])]
        if not paths:
            continue
        path = folder_clips.folder / settings.markup if settings.markup is not None else paths[0].parent / MARKUP
        file = files.setdefault(inside(path, folder_clips.folder), MarkupFile(path))
        (file.joint if settings.roles else file.clips).extend(own)
        file.databases += [] if settings.markup is not None else [name]
        if settings.features not in roots and settings.features not in file.features:
            file.features.append(settings.features)
    for file in files.values():
        file.has_roots = not file.features
    return list(files.values())


def _with_roots(folder: Path) -> set[str]:
    """The features that say how a root is made, be it 0: as the hips are."""
    parts = tomllib.loads(read_bytes(folder / SCHEMA_FILE).decode("utf-8-sig")).get("features", {})
    return {name for name, part in parts.items() if ROOT_KEY in part}


def _text(path: Path) -> tuple[str, bytes | None]:
    if not os.path.exists(path):
        return "", None
    raw = read_bytes(path)
    return (BOM if raw.startswith(BOM.encode()) else "") + text_of(raw, str(path)), raw


def _settings(folder: Path, settings: dict[tuple[str, str, str], str | float]) -> list[Change]:
    """What contextdb.toml becomes so that databases name their markup, and features say how a root is made."""
    if not settings:
        return []
    path = folder / SCHEMA_FILE
    raw = read_bytes(path)
    old = raw.decode()
    new = old.removeprefix(BOM)
    for key, value in settings.items():
        new = set_key(new, key, value)
    return [Change(path, raw, old, (BOM if old.startswith(BOM) else "") + new)]


# ---- what is printed


def _report(
    folder_clips: FolderClips, proposals: Sequence[Proposal], changes: Sequence[Change], arguments: argparse.Namespace
) -> None:
    note(*folder_clips.notes, *(f"left out: {message}" for message in folder_clips.left_out))
    n_marks = sum(each.tag is not None for each in proposals)
    with output():
        if arguments.json:
            print(as_json(_document(folder_clips, proposals, changes, arguments.write)), end="")
        elif proposals:
            print("\n".join(map(printable, _reasons(proposals))))
            print("".join(_diff(change, folder_clips.folder) for change in changes), end="")
    where = " and ".join(str(change.path) for change in changes)
    if arguments.write and changes:
        what = plural(n_marks, "mark") if n_marks else ROOT_KEY
        note(f"{what} written to {where}.")
    elif not changes:
        nothing = "nothing to write: only you can cut the files of clips." if proposals else "nothing to propose."
        note(nothing)


def _reasons(proposals: Sequence[Proposal]) -> Iterator[str]:
    """Each proposal with its reason; the contacts of a foot together."""
    together: dict[tuple[str, str | None], list[Proposal]] = {}
    for i, each in enumerate(proposals):
        key = (each.asset, each.tag) if each.kind == "contacts" else (each.asset, f"{each.tag} {i}")
        together.setdefault(("", "roots") if each.kind == "roots" else key, []).append(each)
    for (asset, _), own in together.items():
        first = own[0]
        if first.kind == "roots":
            most = max(own, key=lambda each: each.measure)
            yield f"# {plural(len(own), 'clip')}: {ROOT_KEY}: hips sway about the body's path, most {most.asset}: {most.reason}"
        elif first.kind == "contacts":
            yield f"# {asset}: {first.tag}: {plural(len(own), 'stance')}, {sum(each.measure for each in own):.2f} s"
        else:
            what = "cut" if first.tag is None else first.tag
            yield f"# {asset}: {what} {_span(first)}: {first.reason}"


def _span(each: Proposal) -> str:
    if each.from_s is None and each.to_s is None:
        return "all of it"
    start = "the start" if each.from_s is None else f"{each.from_s:g} s"
    return f"from {start} to {'the end' if each.to_s is None else f'{each.to_s:g} s'}"


def _diff(change: Change, folder: Path) -> str:
    """The change as `patch` reads it."""
    name = (below([change.path], folder) or [str(change.path)])[0]
    before = "/dev/null" if change.was is None else f"a/{name}"
    old, new = change.old.splitlines(keepends=True), change.new.splitlines(keepends=True)
    return "".join(map(_line, difflib.unified_diff(old, new, before, f"b/{name}")))


def _line(line: str) -> str:
    body = line.rstrip("\r\n")
    end = line[len(body) :]
    return f"{printable(body)}{end}" if end else f"{printable(body)}\n\\ No newline at end of file\n"


def _document(
    folder_clips: FolderClips, proposals: Sequence[Proposal], changes: Sequence[Change], is_written: bool
) -> dict[str, object]:
    return {
        "format": 1,
        "written": is_written and bool(changes),
        "proposals": [each.to_json() for each in proposals],
        "files": [{"file": str(change.path), "diff": _diff(change, folder_clips.folder)} for change in changes],
        "left_out": folder_clips.left_out,
        "notes": folder_clips.notes,
    }


# ---- what `motion prepare --write` has written, with the digests of the clips, so that only clips that change are prepared
# again. .contextdb-cache/prepared.json for each clip: its digest, its proposals, and the marks that were written for it When
# a clip changes, marks that were written for it as it was, and that nobody has edited since, are taken back. Without the file
# every clip is looked at, and nothing is taken back. An edge: this touches the disk

BOM = "\ufeff"
FORMAT = 2
FILE = "prepared.json"
Line = tuple[str, ...]
"""A mark as its file has it: asset, tag, from, to, value."""


@dataclass
class Written:
    """The marks of one kind that were written for a clip, and the digest of the clip that they are about."""

    key: str
    marks: list[Line]


@dataclass
class Prepared:
    """The proposals for a folder's clips, and by clip and kind what was written for them."""

    path: Path
    cached: KnownProposals = field(default_factory=KnownProposals)
    written: dict[str, dict[str, Written]] = field(default_factory=dict)

    @classmethod
    def load(cls, folder: Path) -> Prepared:
        """That of a folder; nothing where there is none that can be read."""
        prepared = cls(folder / CACHE_FOLDER / FILE)
        with suppress(OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):  # as if it were not there
            if has_own(prepared.path):
                document = json.loads(read_own(prepared.path))
                if document["format"] == FORMAT:
                    clips, written = dict(_clips(document["clips"])), dict(_written(document["clips"]))
                    prepared.cached, prepared.written = KnownProposals(clips), written
        return prepared

    def outdated(self, clips: Iterable[Clip], kinds: Collection[str], text: str) -> dict[Line, str]:
        """The marks in a markup file that were written for clips that changed since, of some kinds, each with its asset.

        Where somebody has edited marks of one tag of a clip, all of that tag stay.
        """
        lines = lines_of(text)
        stale = {
            mark: clip.name
            for clip in clips
            for kind, written in self.written.get(clip.name, {}).items()
            if kind in kinds and written.key != key_of(clip)
            for mark in written.marks
            if mark in lines
        }
        edited = {mark[:2] for mark in lines if mark not in stale}
        return {mark: name for mark, name in stale.items() if mark[:2] not in edited}

    def take(self, clips: Iterable[Clip], kinds: Collection[str], marks: Mapping[Line, Proposal]) -> None:
        """Take down the marks of some kinds that are written now for clips as they are."""
        for clip in clips:
            key, own = self.cached.of(clip).key, self.written.setdefault(clip.name, {})
            for kind in kinds:
                new = [line for line, each in marks.items() if (each.asset, each.kind) == (clip.name, kind)]
                before = own[kind].marks if kind in own and own[kind].key == key else []
                own[kind] = Written(key, [*before, *(line for line in new if line not in before)])

    def save(self, clips: Iterable[Clip]) -> None:
        """Keep it, as far as it is about these clips; where that cannot be written the next run looks at all of them."""
        names = {clip.name for clip in clips}
        document = {
            name: {
                **cached.to_json(),
                "written": {kind: [each.key, each.marks] for kind, each in self.written.get(name, {}).items()},
            }
            for name, cached in self.cached.clips.items()
            if name in names
        }
        with suppress(FileError, OSError):
            make_own_folder(self.path.parent)
            write_own(self.path, json.dumps({"format": FORMAT, "clips": document}).encode(), syncs=False)


def _clips(document: Mapping[str, Any]) -> Iterator[tuple[str, KeptClip]]:
    for name, clip in document.items():
        yield name, KeptClip.of_json(clip)


def _written(document: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Written]]]:
    for name, clip in document.items():
        yield name, {kind: Written(str(key), [tuple(mark) for mark in marks]) for kind, (key, marks) in clip["written"].items()}


def columns_of(text: str) -> list[str]:
    """The columns of a markup file, in the order of its header; of an empty one those of a new file."""
    header = next((line for line in text.removeprefix(BOM).splitlines() if line.strip()), "")
    return [name.strip().casefold() for name in next(csv.reader([header]))] if header else list(COLUMNS)


def line_of(mark: Proposal) -> Line:
    """A mark as a markup file has it."""
    return mark.asset, str(mark.tag), *map(_number, (mark.from_s, mark.to_s, mark.value))


def with_marks(text: str, marks: Iterable[Line]) -> str:
    """The text of a markup file with some marks behind its own lines, in the order of its columns."""
    end = "\r\n" if "\r\n" in text else "\n"
    columns, has_header = columns_of(text), bool(text.removeprefix(BOM).strip())
    start = text if has_header else f"{','.join(COLUMNS)}{end}"
    added = io.StringIO()
    writer = csv.writer(added, lineterminator=end)
    for mark in marks:
        fields = dict(zip(COLUMNS, mark, strict=True))
        writer.writerow([fields[column] for column in columns])
    return f"{start}{'' if start.endswith(end) else end}{added.getvalue()}"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}".rstrip("0").rstrip(".")


def without(text: str, marks: Collection[Line]) -> str:
    """The text of a markup file without the lines of some marks."""
    columns = columns_of(text)
    return "".join(line for line in text.splitlines(keepends=True) if _mark_of(line, columns) not in marks) if marks else text


def lines_of(text: str) -> set[Line]:
    """The marks of a markup file."""
    columns = columns_of(text)
    return {_mark_of(line, columns) for line in text.splitlines()}


def _mark_of(line: str, columns: list[str]) -> Line:
    fields = dict(zip(columns, (each.strip() for each in next(csv.reader([line]), [])), strict=False))
    return tuple(fields.get(column, "") for column in COLUMNS)
