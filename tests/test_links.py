"""The pages of docs/ and README.md: links lead somewhere, and what a page lists is what there is."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from strategies import for_each

import contextdb
from contextdb.cells.domains import Domain
from contextdb.cells.grammar import reads
from contextdb.motion import MotionConfig
from contextdb.schema.settings import read_schema

ROOT = Path(__file__).parent.parent
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]
DOMAINS = {
    "Cells of every type": Domain("number"),
    "bool": Domain("bool"),
    "int and number": Domain("number"),
    "date": Domain("date"),
    "angle": Domain("angle"),
    "enum and text": Domain("enum", ("CB", "FS", "SS", "Half Back")),
    "tags": Domain("tags", ("InAir", "Catching", "Stunned", "Move.Run")),
}
"""What the tables of cells in docs/designers.md are about, by heading."""

FACTS = {
    "speed": 3.5,
    "heading": 170.0,
    "target_heading": -170.0,
    "vx": 3.0,
    "vz": 4.0,
    "moving": True,
    "gait": "Run",
    "Defender.Tags": {"Move.Run"},
    "Stage Name": "arena",
    "day": "2026-01-31",
}
"""What the examples of expressions in docs/format.md are computed from."""
FACT_TYPES: dict[str, dict[str, object]] = {
    **{name: {"type": "number"} for name in ("speed", "vx", "vz")},
    **{name: {"type": "angle"} for name in ("heading", "target_heading")},
    "moving": {"type": "bool"},
    "gait": {"type": "enum", "values": ["Walk", "Run"]},
    "Defender.Tags": {"type": "tags", "values": ["Move.Run", "Stunned"]},
    "Stage Name": {"type": "text"},
    "day": {"type": "date"},
}


def named(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def prose(text: str) -> str:
    """A page without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)


def links(text: str) -> list[str]:
    """The targets of all links and pictures that stay inside the repository."""
    found = re.findall(r"\]\(([^)\s]+)\)", prose(text))
    return [target for target in found if not re.match(r"[a-z]+:", target)]


def anchors(text: str) -> set[str]:
    """What GitHub calls the headings of a page."""
    headings = re.findall(r"^#+ (.+)$", prose(text), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def sections(text: str) -> dict[str, str]:
    """The text under each heading."""
    parts = re.split(r"^#+ (.+)$", text, flags=re.M)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def first_column(section: str) -> Iterator[str]:
    """Everything between backticks in the first column of a section's tables."""
    for row in re.findall(r"^\| ((?:[^|\\]|\\.)+) \|", section, re.M):
        yield from (code.replace("\\|", "|") for code in re.findall(r"`([^`]+)`", row))


@for_each(PAGES)
def test_every_link_inside_the_repository_leads_somewhere(page: Path):
    for target in links(page.read_text(encoding="utf-8")):
        path, _, anchor = target.partition("#")
        file = page.parent / path if path else page
        assert file.exists(), f"{target}: there is no such file"
        if anchor:
            assert anchor in anchors(file.read_text(encoding="utf-8")), f"{target}: there is no such heading"


def test_every_page_can_be_reached_from_the_index():
    linked = {target.partition("#")[0] for target in links(text_of("docs/index.md"))}
    assert {page.name for page in (ROOT / "docs").glob("*.md")} - {"index.md"} <= linked


def test_the_api_page_lists_every_public_name():
    listed = set(re.findall(r"`(\w+)", text_of("docs/api.md")))
    assert set(contextdb.__all__) <= listed


def test_every_example_of_a_cell_in_the_designers_page_can_be_read():
    found = sections(text_of("docs/designers.md"))
    for heading, domain in DOMAINS.items():
        cells = list(first_column(found[heading]))
        assert cells, f"{heading} has no examples"
        for cell in cells:
            assert reads(cell, domain), f"{heading}: {cell}"


def test_every_example_of_a_contextdb_toml_is_accepted():
    examples = re.findall(r"^```toml\n(.*?)^```$", text_of("docs/format.md"), re.M | re.S)
    assert examples
    for example in examples:
        schema = read_schema(example, "contextdb.toml")
        MotionConfig.from_dict(schema.motion, file="contextdb.toml")


def results_on_the_format_page() -> Iterator[tuple[str, object]]:
    """Each example of an expression with what the page says it gives."""
    section = sections(text_of("docs/format.md"))["Expressions"]
    for row in re.findall(r"^\| .* \| (`.*`) \| (.*) \|$", section, re.M):
        sources = [found.strip().strip("`").strip() for found in re.findall(r"``.+?``|`.+?`", row[0])]
        yield from zip(sources, (ast.literal_eval(text) for text in row[1].split(", ")), strict=True)


@for_each(list(results_on_the_format_page()))
def test_an_example_of_an_expression_gives_what_the_page_says(source: str, result: object):
    kinds = {bool: {"type": "bool"}, str: {"type": "enum", "values": ["fast", "slow"]}}
    schema = FACT_TYPES | {"result": {**kinds.get(type(result), {"type": "number"}), "expr": source}}
    table = contextdb.Table.from_columns({"Asset Name": ["a"], "result": ["Any"]}, schema=schema)
    live = table.compile().live({name: FACTS[name] for name in table.compile().asked})
    assert live["result"] == result
    assert type(live["result"]) is type(result) or not isinstance(result, bool)
