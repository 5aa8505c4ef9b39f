"""What `motion prepare --write` has written, with the digests of the clips, so that only clips that change are prepared again.

    .contextdb-cache/prepared.json     for each clip: its digest, its proposals, and the marks that were written for it

When a clip changes, marks that were written for it as it was, and that nobody has edited since, are taken back. Without the file
every clip is looked at, and nothing is taken back. An edge: this touches the disk.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from contextdb.disk.own_files import has_own, make_own_folder, read_own, write_own
from contextdb.errors import FileError
from contextdb.motion.clips.clip import Clip
from contextdb.motion.markup.file import COLUMNS
from contextdb.motion.preparing.proposal import KeptClip, KnownProposals, Proposal, key_of
from contextdb.motion.storage.building import CACHE_FOLDER

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
