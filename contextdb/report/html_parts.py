"""What HTML reports are made of."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files

from contextdb.console import printable

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
