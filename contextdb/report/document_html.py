"""A document as one HTML page that needs no network: every text is escaped, and nothing of it can become markup or script.

What is in the page is complete without its script, which only sorts tables and opens the squares of a map.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from importlib.resources import files
from itertools import zip_longest

from contextdb.console import __version__, printable
from contextdb.report.document import Bar, Block, Document, Folded, Listing, Numbered, Picture, Rows, Section, Table
from contextdb.report.results import Gate

_FIGURE = re.compile(r"(?:≈ |about |at least )?([<>]?)(-?\d[\d,]*(?:\.\d+)?)(?: %|\+| or more)?")
_WORD = re.compile(r"[\w-]{0,16}")
REGION = 'role="region" aria-label="'
"""How a box that scrolls begins to say its name; no text of a table can hold this."""
POINT = "point"
"""A share of no volume, which is sorted as 0."""


def as_html(document: Document) -> str:
    """The page. Every section has the anchor `t` and its number, from 0, to which the page leads where there are several."""
    sections, closing = document.sections, document.closing
    subject = f"{len(sections)} {document.noun}s" if len(sections) != 1 else printable(sections[0].title)
    title = f"{document.command.capitalize()} of {subject}"
    is_met = all(gate.passed for section in (closing, *sections) for gate in section.gates)
    parts = [f"<h1>{escape(title)}</h1>\n"]
    parts += [f'<p class="{"passed" if is_met else "failed"}">{escape(closing.summary)}</p>\n'] if closing.summary else []
    parts += [_gates(closing.gates), _contents(sections) if len(sections) > 1 else "", *map(_block, closing.blocks)]
    articles = "".join(_section(section, number, len(sections) > 1) for number, section in enumerate(sections))
    main = f'{"".join(parts)}{articles}<p class="muted">contextdb {__version__}</p>\n'
    return page(title, "coverage", f"<main>\n{main}</main>\n")


def _contents(sections: Sequence[Section]) -> str:
    """The sections with what matters most of each, and the thresholds that it misses."""
    items = []
    for number, section in enumerate(sections):
        missed = [gate.name for gate in section.gates if not gate.passed]
        first = [sentence for sentence in section.sentences[:2] if isinstance(sentence, str)]
        texts = [section.summary, *first, *([f"missed: {', '.join(missed)}"] if missed else [])]
        sentences = " ".join(f"{text.rstrip('.')}." for text in texts if text)
        items.append(f'<li><a href="#t{number}">{escaped(section.title)}</a>: {escaped(sentences)}</li>\n')
    return f"<ul>\n{''.join(items)}</ul>\n"


def _section(section: Section, number: int, is_one_of_several: bool) -> str:
    """A section; where there are several, the names of its regions begin with its title."""
    parts = [f'<h2 id="t{number}">{escaped(section.title)}</h2>\n', paragraph(section.summary, "muted") if section.summary else ""]
    parts += [*map(_block, section.sentences), _gates(section.gates), *map(_block, section.blocks)]
    article = f"<article>\n{''.join(parts)}</article>\n"
    return article.replace(REGION, f"{REGION}{escaped(section.title)}: ") if is_one_of_several else article


def _gates(gates: Iterable[Gate]) -> str:
    items = []
    for gate in gates:
        items.append(
            f'<li><span class="{gate.word}">{gate.word.capitalize()}</span> {escape(gate.name)}: {escaped(gate.message)}</li>'
        )
    return f'<ul class="gates">{"".join(items)}</ul>\n' if items else ""


def _block(block: Block) -> str:
    match block:
        case str():
            return paragraph(block)
        case Bar(lower, upper, label):
            ends = [(upper, "open"), (lower, "")] if lower < upper else [(lower, "")]
            inner = "".join(f'<i class="{name}" style="width:{_width(share)}"></i>' for share, name in ends)
            return f'<div class="bar" role="img" aria-label="{escape(label)}">{inner}</div>\n'
        case Listing(title, items, meaning):
            return _list("ul", f"{title}: {meaning}" if meaning else title, items)
        case Numbered(title, items):
            return _list("ol", title, items)
        case Table(head, rows, title):
            return heading(title) + _table(title or head[0], head, rows)
        case Picture(title, lines, html):
            return heading(title) + (html() if html else f'<pre tabindex="0">{escaped_lines(lines(False))}</pre>\n')
        case Rows(title, rows, head) if head and rows:
            return heading(title) + _table(title, head, [(*row.columns, *row.texts) for row in rows])
        case Rows(title, rows):
            return _list("ul", title, [row.line for row in rows])
        case Folded():
            return "".join(_folded(block))


def _folded(folded: Folded) -> Iterator[str]:
    yield heading(folded.title)
    yield paragraph(folded.note, "muted") if folded.note else ""
    for name, summary, blocks in folded.items:
        yield f'<details id="c{escape(name)}"><summary>{escaped(summary)}</summary>\n{"".join(map(_block, blocks))}</details>\n'


def _list(tag: str, title: str, items: Sequence[str]) -> str:
    if not items:
        return heading(title)
    return f"{heading(title)}<{tag}>\n{''.join(f'<li>{escaped(item)}</li>{chr(10)}' for item in items)}</{tag}>\n"


def _table(label: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table that its reader can sort; a column of figures by their size."""
    columns = list(zip_longest(*rows, fillvalue=""))[: len(head)]
    cells = [_cells(column) for column in columns]
    classes = ['<th scope="col" class="n">' if "data-v" in column[0] else '<th scope="col">' for column in cells]
    top = "".join(f"{opening}{escape(name) or '#'}</th>" for opening, name in zip(classes, head, strict=False))
    body = "".join(f"<tr>{''.join(row)}</tr>\n" for row in zip(*cells, strict=True))
    return (
        f'<div class="scroll" tabindex="0" {REGION}{escaped(label)}"><table class="sortable">'
        f"<thead><tr>{top}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n"
    )


def _cells(texts: Sequence[str]) -> list[str]:
    values = [figure(text) for text in texts]
    if any(values) and None not in values:
        return [f'<td class="n" data-v="{value!r}">{escaped(text)}</td>' for text, value in zip(texts, values, strict=True)]
    kind = ' class="k"' if all(_WORD.fullmatch(text) for text in texts) else ""
    return [f"<td{kind}>{escaped(text)}</td>" for text in texts]


def figure(text: str) -> float | None:
    """The number that a text shows, to sort by; None for another text."""
    if text in ("", POINT):
        return 0.0
    match = _FIGURE.fullmatch(text)
    if match is None:
        return None
    return float(match[2].replace(",", "")) * {"<": 1.0 - 1e-9, ">": 1.0 + 1e-9}.get(match[1], 1.0)


def heading(title: str) -> str:
    """A heading in a section; nothing without a title."""
    return f"<h3>{escaped(title)}</h3>\n" if title else ""


def paragraph(text: str, kind: str = "") -> str:
    """A paragraph; `kind` is its class."""
    return f"<p{f' class={kind}' if kind else ''}>{escaped(text)}</p>\n"


def escaped_lines(lines: Iterable[str]) -> str:
    return "\n".join(map(escaped, lines))


def _width(share: float) -> str:
    """A width that is full, or nothing, only where the share is."""
    percent = 100.0 * share
    return f"{percent if percent in (0.0, 100.0) else min(max(percent, 0.3), 99.7):.2f}%"


# ---- what HTML reports are made of


POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"


def page(title: str, name: str, body: str) -> str:
    """A document that needs no network, with the style sheet and the script of a name."""
    css, script = (files("contextdb.report").joinpath(f"{name}.{kind}").read_text(encoding="utf-8") for kind in ("css", "js"))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{css}</style>\n</head>\n<body>\n"
        f"{body}<script>\n{script}</script>\n</body>\n</html>\n"
    )


def embedded(document: object) -> str:
    """A JSON document that ends no script."""
    text = json.dumps(document, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def escaped(text: str) -> str:
    """A text of a table or a file, with nothing in it that a browser would obey."""
    return escape(printable(text))
