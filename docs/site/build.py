"""Make the site in build/site: the pages of docs/, with their navigation, a page for all names, and live pages of the samples.

    python docs/site/build.py

The pages stay plain Markdown, which a forge shows too. What only the site has is added on the way: the groups of the navigation,
which are the headings and links of docs/index.md, pictures for a light screen, and captions for blocks that are files.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import names
import sections
from sphinx.cmd.build import main as sphinx

from contextdb import cli
from contextdb.motion import write_made_clips

sys.path.insert(1, str(Path(__file__).parents[2]))
from examples.web import __main__ as web

HERE = Path(__file__).parent
DOCS = HERE.parent
ROOT = DOCS.parent
BUILD = ROOT / "build"
SOURCE, SITE, CACHE = BUILD / "site-source", BUILD / "site", BUILD / "site-cache"
SEARCH = '<script src="_static/sections.js"></script><script src="_static/rank.js"></script>'
NAMES = [f"names-{where}" for where in names.MODULES]
SITE_ONLY = {"Start": ["live-pages"], "Reference": NAMES, "Project": ["lab-book", "changelog", "security"]}
"""Pages that the site has beside those of docs/, by group."""

ROOT_PAGES = {"benchmarks/README.md": "lab-book.md", "CHANGELOG.md": "changelog.md", "SECURITY.md": "security.md"}
"""Files outside docs/ that are pages of the site too."""

MENDS = {
    'role="heading"': 'role="heading" aria-level="2"',
    '<aside class="sidebar-drawer': '<aside aria-label="Pages" class="sidebar-drawer',
    '<aside class="toc-drawer': '<aside aria-label="On this page" class="toc-drawer',
    '<div class="highlight"><pre>': '<div class="highlight"><pre tabindex="0">',
    'colwidths-auto docutils container"': 'colwidths-auto docutils container" tabindex="0"',
}


def main() -> int:
    """Make the site; gives the exit code."""
    for folder in (SOURCE, SITE, CACHE):
        shutil.rmtree(folder, ignore_errors=True)
    for folder in ("pictures", "pages"):
        shutil.copytree(DOCS / folder, SOURCE / folder)
    for file in ("conf.py", "site.css", "favicon.svg"):
        shutil.copy(HERE / file, SOURCE)
    for page in DOCS.glob("*.md"):
        write_page(page.name, page.read_text(encoding="utf-8"))
    write_page("live-pages.md", LIVE_PAGES)
    for file, page in ROOT_PAGES.items():
        write_page(page, (ROOT / file).read_text(encoding="utf-8"))
    for where, page in zip(names.MODULES, NAMES, strict=True):
        write_page(f"{page}.md", names.page(where))
    make_live_pages(SOURCE / "extra" / "live")
    code = sphinx(["--fail-on-warning", "--keep-going", "--quiet", "-d", str(CACHE), str(SOURCE), str(SITE)])
    for page in SITE.glob("*.html"):
        mend(page)
    rank_search()
    return code


def rank_search() -> None:
    """Let the page of the search rank by sections: rank.js, over what sections.js lists."""
    static = SITE / "_static"
    (static / "sections.js").write_text(sections.script(sections.pages_in(SOURCE)), encoding="utf-8")
    shutil.copy(HERE / "rank.js", static)
    page = SITE / "search.html"
    text = page.read_text(encoding="utf-8")
    new, n = re.subn(r'(<script src="_static/searchtools\.js[^>]*></script>)', rf"\1{SEARCH}", text)
    assert n == 1, "search.html does not load searchtools.js as it did"
    page.write_text(new, encoding="utf-8")


def mend(page: Path) -> None:
    """Say what screen readers need and the theme leaves out; boxes that scroll can be reached with the keyboard."""
    text = page.read_text(encoding="utf-8")
    for found, wanted in MENDS.items():
        text = text.replace(found, wanted)
    page.write_text(text, encoding="utf-8")


def write_page(name: str, text: str) -> None:
    """Put a page among the sources, as Sphinx wants it."""
    text = re.sub(r"(?m)^```(\w+) ([^\s`]+)$", r"```{code-block} \1\n:caption: \2\n", text)
    text = re.sub(r"!\[([^]]*)\]\((pictures/[\w-]+)\.svg\)", _in_both_themes, text)
    text = re.sub(r"\]\(\.\./([^)#]+)", _outside, text.replace("](../docs/", "]("))
    if name == "api.md":
        text += f"\nWith types and docstrings: {', '.join(f'[{page[6:]}]({page}.md)' for page in NAMES)}.\n"
    if name == "index.md":
        text = text.replace("\n## Three doors", f"{LIVE}\n## Three doors", 1)
        text += "".join(_contents(caption, [*pages, *SITE_ONLY.get(caption, [])]) for caption, pages in groups(text))
    (SOURCE / name).write_text(text, encoding="utf-8")


def groups(index: str) -> Iterator[tuple[str, list[str]]]:
    """The groups of the navigation, and their pages: the headings of the index and the first links in the rows below each."""
    for caption, rows in re.findall(r"(?m)^### (.+)\n\n((?:\|.*\n)+)", index):
        pages = re.findall(r"(?m)^\| \[[^]]+\]\(([\w-]+)\.md\) \|", rows)
        yield caption, pages


def _contents(caption: str, pages: list[str]) -> str:
    return "\n".join(["", "```{toctree}", f":caption: {caption}", ":hidden:", "", *pages, "```", ""])


def _in_both_themes(found: re.Match[str]) -> str:
    """A picture, and where there is one, another for light screens."""
    about, name = found.groups()
    if not (DOCS / f"{name}-light.svg").exists():
        return found[0]
    return f"![{about}]({name}.svg){{.only-dark}}![{about}]({name}-light.svg){{.only-light}}"


def _outside(found: re.Match[str]) -> str:
    """A link to a file outside docs/: a page of its own, or a copy of the file."""
    if found[1] in ROOT_PAGES:
        return f"]({ROOT_PAGES[found[1]]}"
    name = f"{found[1]}.txt" if found[1].endswith(".md") else found[1]  # Sphinx would take it for a page
    target = SOURCE / "files" / name
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / found[1], target)
    return f"](files/{name}"


def make_live_pages(folder: Path) -> None:
    """The pages that are made of the samples: a character to steer, a session that plays, and the coverage of the tables."""
    folder.mkdir(parents=True)
    make_character(folder / "character.html")
    with tempfile.TemporaryDirectory() as made:
        work = Path(made)
        shutil.copytree(ROOT / "tables", work / "tables")
        write_made_clips(work / "tables" / "clips")
        (work / "stick.csv").write_text(STICK, encoding="utf-8")
        for command in (
            "coverage tables --format html -o coverage.html",
            "motion run tables player stick.csv --out run.parquet",
            "motion replay run.parquet --html session.html",
        ):
            with contextlib.chdir(work), contextlib.redirect_stdout(io.StringIO()):
                code = cli.main(command.split())
            if code:
                raise SystemExit(f"contextdb {command} ended with {code}")
        for page in ("coverage.html", "session.html"):
            shutil.copy(work / page, folder)


NO_CHARACTER = """<!DOCTYPE html>
<html lang="en"><title>A character to steer</title>
<main><h1>A character to steer</h1><p>It was not made with this site: PyPI's ziglang was not installed.</p></main></html>
"""


def make_character(page: Path) -> None:
    """The example in a browser as one file; a line in its place where the compiler that makes it is not installed."""
    if importlib.util.find_spec("ziglang") is None:
        page.write_text(NO_CHARACTER, encoding="utf-8")
        return
    with tempfile.TemporaryDirectory() as made, contextlib.redirect_stdout(io.StringIO()):
        web.build(Path(made))
        shutil.copy(Path(made) / "one_file.html", page)


LIVE_PAGES = """\
# Live pages

Three pages that were made of samples when this site was built. Each is one file, and needs no network.

- <a href="live/character.html">A character to steer</a>: the core in C as WebAssembly plays what its table allows. Change a cell of
  the table and see what plays instead. [Game engines](engines.md#in-a-browser) says more.
- <a href="live/session.html">A session that plays</a>: eight seconds of a character who follows a stick, as
  `contextdb motion replay --html` writes it. Scrub the timeline, and see the costs of all assets at each change.
  [Sessions](sessions.md) says more.
- <a href="live/coverage.html">The coverage of the sample tables</a>, as `contextdb coverage --format html` writes it: which
  contexts have an asset, which have none, and what would close the largest gaps. [CI](ci.md#coverage) says more.
"""

LIVE = """
## See it live

<iframe class="live" src="live/character.html" title="A character to steer, and its table" loading="lazy"></iframe>

Drag to steer, and change a cell: the <a href="live/character.html">character</a> plays what its table allows, here in the browser.

<iframe class="live" src="live/session.html" title="A session that plays: a character follows a stick" loading="lazy"></iframe>

A <a href="live/session.html">session</a>, as `contextdb motion replay` writes it: press play, scrub, and read why each clip was
chosen. Below, the <a href="live/coverage.html">coverage</a> of the sample tables.

<iframe class="live low" src="live/coverage.html" title="The coverage of the sample tables" loading="lazy"></iframe>
"""
"""What the front page of the site has beside that of docs/."""

STICK = """\
time_s,x_mps,z_mps,gait,style
0,0,0,Idle,normal
1,0,1.3,Walk,normal
3,1.3,0,Walk,normal
5,2.6,0,Run,normal
7,0,0,Idle,normal
8,0,0,Idle,normal
"""
"""What a player asks for in the session that plays on the site."""

if __name__ == "__main__":
    sys.exit(main())
