"""What the search of the site looks through: the sections of the pages, each with its page, place, title and words."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

REFERENCE = (
    "commands",
    "messages",
    "api",
    "format",
    "keys",
    "names-contextdb",
    "names-motion",
    "names-telemetry",
    "changelog",
    "security",
)
"""Pages that are looked up, and come after those that are read."""
MOST_WORDS = 400
_WORD = re.compile(r"[a-z0-9_+#%.-]*[a-z0-9_+#%]")
_MARKS = re.compile(r"!?\[([^\]]*)\]\([^)]*\)|<[^>]+>|[`*|]")


def sections(pages: Mapping[str, str]) -> list[list[object]]:
    """One entry a section: page, anchor, title, title of the page, whether it is reference, its words and how often each stands."""
    return [entry for page, text in pages.items() for entry in _of_page(page, text)]


def script(pages: Mapping[str, str]) -> str:
    """The same as a script, which a page that was opened from a disk can load."""
    return f"const SECTIONS = {json.dumps(sections(pages), ensure_ascii=False, separators=(',', ':'))};\n"


def pages_in(folder: Path) -> dict[str, str]:
    """The Markdown pages of a folder, by name."""
    return {path.stem: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.md"))}


def _of_page(page: str, text: str) -> Iterator[list[object]]:
    title, parts = "", list(_split(text))
    for heading, body in parts:
        plain = _MARKS.sub(lambda found: found[1] or "", heading)
        title = title or plain
        words = Counter(_WORD.findall(_MARKS.sub(lambda found: f"{found[1] or ''} ", body).lower()))
        counts = {word: n for word, n in words.most_common(MOST_WORDS) if len(word) < 30}
        yield [page, "" if plain == title else _anchor(plain), plain, title, page in REFERENCE or page.startswith("names-"), counts]


def _split(text: str) -> Iterator[tuple[str, str]]:
    """The headings of a page, of three levels, and the text below each; a heading inside a block is none."""
    heading, lines, fence = "", list[str](), ""
    for line in text.splitlines():
        marks = re.match(r"`{3,}", line)
        if marks:
            fence = "" if fence and marks[0] == fence else fence or marks[0]
        level = None if fence else re.match(r"#{1,4} (.+)", line)
        if level:
            if heading:
                yield heading, "\n".join(lines)
            heading, lines = level[1], []
        else:
            lines.append(line)
    if heading:
        yield heading, "\n".join(lines)


def _anchor(heading: str) -> str:
    """What a heading is called in links."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
