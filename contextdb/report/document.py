"""A report as a document, which is written once: sections of blocks, and how a terminal and Markdown display them.

A terminal gets the first items of each list, unless `shows_all`; Markdown as many as a comment on a pull request holds; a page
(`contextdb.report.document_html`) all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest

from contextdb.console import aligned, printable, styled, width_of
from contextdb.errors import joined
from contextdb.report.render_markdown import MOST_BYTES, escaped
from contextdb.report.render_text import INDENT, hanging, wrapped
from contextdb.report.results import Gate

BAR_CELLS = 40
GATE_WORDS = {"passed": ("passed", "green"), "failed": ("FAILED", "red"), "skipped": ("skipped", "yellow")}
GATE_MARKS = {"passed": "✓", "failed": "✗", "skipped": "–"}
FEW, MOST = 6, 20
"""The most items of a list in a terminal, and in Markdown."""


@dataclass(frozen=True, slots=True)
class Listing:
    """Names on one line, after a title and what they have in common."""

    title: str
    items: Sequence[str]
    meaning: str = ""


@dataclass(frozen=True, slots=True)
class Numbered:
    """Sentences in order of importance; `more` says how to see those that are left out."""

    title: str
    items: Sequence[str]
    few: int = FEW
    more: str = "--all"


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under a head: a name, then numbers."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""


@dataclass(frozen=True, slots=True)
class Bar:
    """A share: certainly `lower`, at most `upper`."""

    lower: float
    upper: float
    label: str

    @property
    def text(self) -> str:
        """Full up to the lower bound, dotted up to the upper one. It is full, or empty, only where the share is."""
        full = min(int(self.lower * BAR_CELLS), BAR_CELLS)
        full = 1 if full == 0 and self.lower > 0.0 else full
        dotted = 0 if self.lower == self.upper else max(1, round(self.upper * BAR_CELLS) - full)
        dotted = min(dotted, BAR_CELLS - full)
        return "█" * full + "▒" * dotted + "░" * (BAR_CELLS - full - dotted)


@dataclass(frozen=True, slots=True)
class Picture:
    """Lines of fixed width, with colours or without; a page may have its own."""

    title: str
    lines: Callable[[bool], Iterable[str]]
    html: Callable[[], str] | None = None


@dataclass(frozen=True, slots=True)
class Folded:
    """Of each of some things its id, a sentence, and blocks that a page opens."""

    title: str
    items: Sequence[tuple[str, str, Sequence[Block]]]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Row:
    """Texts in a column of their own, after short ones."""

    texts: Sequence[str]
    columns: Sequence[str] = ()

    @property
    def line(self) -> str:
        return ": ".join(filter(None, [", ".join(self.columns), "; ".join(self.texts)]))


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows under a title; with a head, of the columns and then of the texts, Markdown and a page have a table, else a list."""

    title: str
    rows: Sequence[Row]
    head: Sequence[str] = ()
    more: str = ""


Block = str | Bar | Listing | Numbered | Table | Picture | Rows | Folded
"""A part of a section; a text is a sentence."""


@dataclass(frozen=True, slots=True)
class Section:
    """One table or session: its name, what matters most, sentences about it, blocks, and its thresholds."""

    title: str
    summary: str = ""
    sentences: Sequence[str | Bar] = ()
    blocks: Sequence[Block] = ()
    gates: Sequence[Gate] = ()
    is_dense: bool = False
    """Without empty lines between the blocks in a terminal."""


@dataclass(frozen=True, slots=True)
class Document:
    """The sections of a command's report, `noun` each, and what is about all of them."""

    command: str
    noun: str
    sections: Sequence[Section]
    closing: Section = Section("")
    """Blocks and thresholds without a title; its summary is the verdict on all thresholds."""


def as_text(document: Document, colour: bool = False, width: int = 100, shows_all: bool = False) -> str:
    """For people in a terminal of some cells."""
    parts = ["\n".join(section_lines(section, colour, width, shows_all)) for section in document.sections]
    closing = document.closing
    tail = [line for block in closing.blocks for line in _lines(block, colour, width, shows_all)]
    tail += [line for gate in closing.gates for line in gate_lines(gate, colour, width)]
    is_met = all(gate.passed for section in (closing, *document.sections) for gate in section.gates)
    tail += [styled(closing.summary, "green" if is_met else "red", colour)] if closing.summary else []
    return "\n\n".join([*parts, *(["\n".join(tail)] if tail else [])]) + "\n"


def section_lines(section: Section, colour: bool, width: int, shows_all: bool = True) -> Iterator[str]:
    """One table or session for people in a terminal."""
    heading = ": ".join(filter(None, (section.title, section.summary)))
    yield from (styled(line, "bold", colour) for line in wrapped(printable(heading), width))
    for sentence in section.sentences:
        yield from _lines(sentence, colour, width, shows_all)
    for block in section.blocks:
        yield from () if section.is_dense else [""]
        yield from _lines(block, colour, width, shows_all)
    yield from [""] if section.gates and not section.is_dense else []
    for gate in section.gates:
        yield from gate_lines(gate, colour, width)


def _lines(block: Block, colour: bool, width: int, shows_all: bool) -> Iterator[str]:
    match block:
        case str():
            yield from wrapped(printable(block), width)
        case Bar():
            yield from wrapped(block.text, width)
        case Listing(title, items, meaning):
            about = f" ({meaning})" if meaning else ""
            yield from wrapped(printable(f"{title}{about}: {joined(items, len(items) if shows_all else FEW)}"), width)
        case Numbered(title, items, few, more):
            yield styled(title, "bold", colour)
            listed = items if shows_all else items[:few]
            for i, item in enumerate(listed, 1):
                yield from hanging(f"{i:>2}. ", item, width)
            if len(listed) < len(items):
                yield f"    and {len(items) - len(listed):,} more ({more})"
        case Table(head, rows, title):
            yield from [styled(title, "bold", colour)] if title else []
            yield from aligned([head, *rows], right=range(1, len(head)))
        case Picture(title, lines):
            yield styled(title, "bold", colour)
            yield from lines(colour)
        case Rows():
            yield from _row_lines(block, colour, width)
        case Folded():
            return


def _row_lines(block: Rows, colour: bool, width: int) -> Iterator[str]:
    yield from (styled(line, "bold", colour) for line in wrapped(printable(block.title), width))
    rows = block.rows
    if block.head and rows:
        n = len(rows[0].columns)
        rows = [Row(block.head[n : n + 1], block.head[:n]), *rows]
    columns = zip_longest(*(row.columns for row in rows), fillvalue="")
    widths = [max(map(width_of, column)) for column in columns]
    for row in rows:
        cells = [f"{text:<{n}}" if text[:1].isalpha() else f"{text:>{n}}" for text, n in zip(row.columns, widths, strict=False)]
        start = INDENT + "".join(f"{text}  " for text in cells)
        for text in row.texts:
            yield from hanging(start, text, width)
            start = " " * width_of(start)
    if block.more:
        yield from hanging(INDENT, block.more, width)


def gate_lines(gate: Gate, colour: bool, width: int) -> Iterator[str]:
    """A threshold, and whether it is met."""
    word, style = GATE_WORDS[gate.word]
    first, *rest = hanging(f"{word}  {gate.name}  ", gate.message, width)
    yield styled(word, style, colour) + first.removeprefix(word)
    yield from rest


def as_markdown(document: Document, most_bytes: int = MOST_BYTES) -> str:
    """For a job summary or a comment on a pull request, with as many sections as that holds."""
    closing = document.closing
    head = [f"## contextdb {document.command}", f"**{closing.summary}**" if closing.summary else "", _gates(closing.gates)]
    text = "\n\n".join(filter(None, (*head, *map(_markdown, closing.blocks)))) + "\n"
    for i, section in enumerate(document.sections):
        title, summary = f"### {escaped(section.title)}", escaped(section.summary)
        parts = [title, summary, *map(_markdown, section.sentences), _gates(section.gates), *map(_markdown, section.blocks)]
        part = "\n" + "\n\n".join(filter(None, parts)) + "\n"
        if len((text + part).encode()) > most_bytes:
            return f"{text}\n{len(document.sections) - i:,} more {document.noun}s are not shown.\n"
        text += part
    return text


def _gates(gates: Iterable[Gate]) -> str:
    return "\n".join(f"- {GATE_MARKS[gate.word]} {escaped(gate.name)}: {escaped(gate.message)}" for gate in gates)


def _markdown(block: Block) -> str:
    match block:
        case str():
            return escaped(block)
        case Bar():
            return block.text
        case Listing(title, items, meaning):
            about = f" ({escaped(meaning)})" if meaning else ""
            return f"**{escaped(title)}**{about}: {escaped(joined(items, MOST))}"
        case Numbered(title, items):
            more = [f"… and {len(items) - MOST:,} more"] if len(items) > MOST else []
            return "\n".join([f"**{title}**\n", *(f"{i}. {escaped(item)}" for i, item in enumerate(items[:MOST], 1)), *more])
        case Table(head, rows, title):
            return (f"**{escaped(title)}**\n\n" if title else "") + _table(head, rows, "---:")
        case Picture(title, lines):
            return "\n".join([f"{title}\n", "```text", *lines(False), "```"])
        case Rows(title, rows, head, more):
            if head and rows:
                listed = _table(head[: len(rows[0].columns) + 1], ([*row.columns, "; ".join(row.texts)] for row in rows), "---")
            else:
                listed = "\n".join(f"- {escaped(row.line)}" for row in rows)
            return "\n\n".join(filter(None, [f"**{escaped(title)}**", listed, escaped(more)]))
        case Folded():
            return ""


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], number: str) -> str:
    lines = [head, ["---", *[number] * (len(head) - 1)], *(list(map(escaped, row)) for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
