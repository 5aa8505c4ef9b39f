"""The site: its pages are those of docs/; where `make site` has made it, links lead somewhere and nothing comes from elsewhere."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from urllib.parse import unquote

import pytest
from strategies import for_each

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
SITE = ROOT / "build" / "site"
GROUPS = ["Start", "Designers", "Programmers", "Animators", "Reference", "Project"]
made = pytest.mark.skipif(not (SITE / "index.html").exists(), reason="there is no site here: make site")


class Links(HTMLParser):
    """What a page links to, what it loads, and the places in it that a link can lead to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.places = {""}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.places.add(given.get("id", ""))
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag in ("script", "img", "source", "iframe") and "src" in given:
            self.loaded.append(given["src"])
        elif tag == "link" and given.get("rel") in ("stylesheet", "icon", "preload"):
            self.loaded.append(given["href"])


@cache
def read(page: Path) -> Links:
    return Links(page.read_text(encoding="utf-8"))


def pages() -> list[Path]:
    return sorted(SITE.rglob("*.html"))


def missing(page: Path, links: list[str]) -> Iterator[str]:
    """The links of a page that lead nowhere."""
    for link in links:
        if re.match(r"[a-z]+:", link):
            continue
        path, _, place = link.partition("#")
        target = page.parent / unquote(path.partition("?")[0]) if path else page
        if not target.is_file():
            yield f"{page.name}: there is no {link}"
        elif target.suffix == ".html" and "live" not in target.parts and unquote(place) not in read(target).places:
            yield f"{page.name}: {link} leads to no place of that page"


@pytest.fixture(scope="module")
def names() -> ModuleType:
    found = importlib.util.spec_from_file_location("names", DOCS / "site" / "names.py")
    assert found
    assert found.loader
    module = importlib.util.module_from_spec(found)
    sys.modules["names"] = module
    found.loader.exec_module(module)
    return module


def test_the_index_has_each_page_in_one_group():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    assert re.findall(r"(?m)^### (.+)$", index) == GROUPS
    listed = re.findall(r"(?m)^\| \[[^]]+\]\(([\w-]+)\.md\) \|", index)
    assert sorted(listed) == sorted(page.stem for page in DOCS.glob("*.md") if page.stem != "index")


@for_each(sorted(DOCS.glob("*.md")))
def test_a_page_begins_with_what_it_is_for(page: Path):
    title, blank, first = page.read_text(encoding="utf-8").splitlines()[:3]
    assert title.startswith("# ")
    assert blank == ""
    assert re.match(r"(`|\*\*)?[\w\[]", first), "a sentence, before any block"


def test_the_pages_of_names_have_every_public_name_with_its_docstring(names: ModuleType):
    for where, module in names.MODULES.items():
        page = names.page(where)
        for name in set(module.__all__) - set(names.MODULES):
            assert f"\n### {name}\n" in page
    assert "#### Table.compile\n\n```py\nTable.compile(" in names.page("contextdb")
    assert "-> CompiledTable\n```\n\n" in names.page("contextdb")
    assert "\n**Raises**\n\n- `ContextError`: " in names.page("contextdb")
    assert "class Action(StrEnum):\n    START = 'starts'" in names.page("motion")
    assert ": Never" not in names.page("contextdb")
    assert [*names.topics("contextdb")][:4] == ["Reading", "Tables", "A running game", "Queries"]
    assert "Character" in names.topics("motion")["Characters"]


def test_a_name_is_shown_with_a_line_that_the_pages_run(names: ModuleType):
    page, line = names.uses()["contextdb.load"]
    assert line in (DOCS / f"{page}.md").read_text(encoding="utf-8")


def test_thirty_questions_are_answered_by_a_recipe_or_a_link():
    recipes, _, elsewhere = (DOCS / "recipes.md").read_text(encoding="utf-8").partition("## Answered elsewhere")
    assert len(re.findall(r"(?m)^### How do I .+\?$", recipes)) + elsewhere.count("](") >= 30


@made
def test_every_link_of_the_site_leads_somewhere():
    assert [fault for page in pages() for fault in missing(page, read(page).links + read(page).loaded)] == []


@made
def test_the_site_loads_nothing_from_elsewhere():
    for page in pages():
        assert [source for source in read(page).loaded if re.match(r"(https?:)?//", source)] == []
    for style in SITE.rglob("*.css"):
        assert re.findall(r"url\(['\"]?(?:https?:)?//|@import", style.read_text(encoding="utf-8")) == []


@made
def test_the_search_needs_no_network():
    """A page that was opened from a disk may run scripts and cannot fetch."""
    assert "searchindex.js" in [Path(source).name for source in read(SITE / "search.html").loaded]
    assert (SITE / "searchindex.js").read_text(encoding="utf-8").startswith("Search.setIndex(")


@made
def test_what_scrolls_can_be_reached_with_the_keyboard_and_headings_have_levels():
    """What docs/site/build.py mends in the pages of the theme; it finds them by their text."""
    for page in SITE.glob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert text.count('role="heading" aria-level="2"') == text.count('role="heading"') == len(GROUPS)
        assert re.findall(r'<pre>|<aside class=|docutils container">', text) == []


@made
def test_the_site_and_its_first_page_are_small():
    assert sum(file.stat().st_size for file in SITE.rglob("*") if file.is_file()) < 20_000_000
    first = SITE / "index.html"
    loaded = {first, *(SITE / source.partition("?")[0] for source in read(first).loaded if not source.startswith("live/"))}
    sizes = {file.name: file.stat().st_size for file in loaded}
    assert sizes.pop("playground.png") < 3_500_000, "the film"
    assert sum(sizes.values()) < 300_000


# ---- in a browser


BROWSER = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
MEASURED = """<script>addEventListener("load", () => {{
  const sides = (name) => {{ const box = document.querySelector(name).getBoundingClientRect(); return [box.left, box.right]; }};
  const lists = [sides(".sidebar-tree"), sides(".toc-tree")];
  parent.postMessage(JSON.stringify([innerWidth, document.documentElement.scrollWidth, ...lists]), "*");
}});</script></body>"""


def seen_in(page: Path, width: int, milliseconds: int = 5000) -> str:
    """What a page posts to the frame that it is in, in a browser."""
    assert BROWSER
    frame = page.with_name("frame.html")
    frame.write_text(FRAME.format(page=page.name, width=width), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    command = [BROWSER, *options, f"--virtual-time-budget={milliseconds}", "--dump-dom", frame.as_uri()]
    seen = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", timeout=120, check=True).stdout
    found = re.search(r"<pre>(.+?)</pre>", seen, re.DOTALL)
    assert found, "the page did not answer"
    return found[1]


@made
@pytest.mark.skipif(not BROWSER, reason="there is no Chromium here")
@pytest.mark.parametrize("name", ["designers", "format", "names-contextdb", "index"])
def test_a_page_of_1280_pixels_has_both_lists_and_one_of_390_does_not_scroll_aside(name: str, tmp_path: Path):
    copy = Path(shutil.copytree(SITE, tmp_path / "site"))
    page = copy / "measured.html"
    page.write_text((SITE / f"{name}.html").read_text("utf-8").replace("</body>", MEASURED.format()), encoding="utf-8")
    width, scrolled, (left, _), (_, right) = json.loads(seen_in(page, 1280))
    assert scrolled <= width
    assert left < 40
    assert 0 < right <= width
    width, scrolled, *_ = json.loads(seen_in(page, 390))
    assert scrolled <= width


# ---- axe, where it is


AXE = os.environ.get("AXE", "")
ASK = """<script>document.body.dataset.theme = "{theme}";</script><script src="{axe}"></script><script>
addEventListener("load", () => axe.run(document, {{resultTypes: ["violations"]}}).then(
  (told) => parent.postMessage(JSON.stringify(told.violations.map((each) => [each.impact, each.id])), "*")));
</script></body>"""
FRAME = """<iframe src="{page}" style="width: {width}px; height: 900px"></iframe><pre></pre>
<script>addEventListener("message", (told) => document.querySelector("pre").textContent = told.data);</script>"""


@made
@pytest.mark.skipif(not (AXE and BROWSER), reason="AXE names no file of axe-core, or there is no Chromium")
@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("name", ["index", "format", "recipes", "names-motion"])
def test_axe_finds_nothing_serious(name: str, theme: str, width: int, tmp_path: Path):
    copy = Path(shutil.copytree(SITE, tmp_path / "site"))
    text = (SITE / f"{name}.html").read_text(encoding="utf-8")
    asked = ASK.format(theme=theme, axe=Path(AXE).resolve().as_uri())
    (copy / "asked.html").write_text(text.replace("</body>", asked), encoding="utf-8")
    found = seen_in(copy / "asked.html", width, 20_000)
    assert [each for each in json.loads(found) if each[0] in ("serious", "critical")] == []
