"""What HTML reports are made of."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files

from contextdb.console import printable
from contextdb.report.results import Gate

POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"


def page(title: str, name: str, body: str, *, style: str = "") -> str:
    """A document that needs no network, with the style sheet and the script of a name; `style` is added to the first."""
    css, script = (files("contextdb.report").joinpath(f"{name}.{kind}").read_text(encoding="utf-8") for kind in ("css", "js"))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{css}{style}</style>\n</head>\n<body>\n"
        f"{body}<script>\n{script}</script>\n</body>\n</html>\n"
    )


def embedded(document: object) -> str:
    """A JSON document that ends no script."""
    text = json.dumps(document, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def gates_of(gates: Iterable[Gate]) -> str:
    """Bars, and whether each is kept."""
    items = (
        f'<li><span class="{"passed" if g.passed else "failed"}">{"Passed" if g.passed else "Failed"}</span> '
        f"{escape(g.name)}: {escaped(g.message)}</li>"
        for g in gates
    )
    return f'<ul class="gates">{"".join(items)}</ul>\n'


def verdict_of(passed: bool, verdict: str) -> str:
    """A sentence on all bars."""
    return f'<p class="{"passed" if passed else "failed"}">{escape(verdict)}</p>' if verdict else ""


def cell(text: str, value: float | None = None) -> str:
    """A cell of a table; one with a value is sorted by it."""
    return f"<td>{escaped(text)}</td>" if value is None else f'<td class="n" data-v="{value!r}">{escaped(text)}</td>'


def table_of(label: str, columns: Sequence[tuple[str, bool]], lines: Iterable[Sequence[str]]) -> str:
    """A table that its reader can sort; of each column its title, and whether it holds numbers."""
    head = "".join(f'<th{" class=n" if is_number else ""} scope="col">{escape(name)}</th>' for name, is_number in columns)
    body = "".join(f"<tr>{''.join(line)}</tr>\n" for line in lines)
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(label)}"><table class="sortable">'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n"
    )


def paragraph(said: str, kind: str = "") -> str:
    """A paragraph; `kind` is its class."""
    return f"<p{f' class={kind}' if kind else ''}>{escaped(said)}</p>\n"


def escaped(said: str) -> str:
    """A text of a table or a file, with nothing in it that a browser would obey."""
    return escape(printable(said))
