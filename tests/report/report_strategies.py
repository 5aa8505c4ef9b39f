"""Reports whose every text may be hostile: line ends, markup of every format, terminal escapes, NUL, halves of surrogate pairs."""

from hypothesis import strategies as st

from contextdb.checks.rules import RULES
from contextdb.findings import LEVELS, Finding
from contextdb.report.results import CheckReport, TableSummary

MARKUP = [
    *("\n", "\r\n", "\r", "\t", "\0", "\x1b[31m", "\x9b2J", "\u2028", "\u202e", "\ud800", "\udfff", "\ufffe", "\x7f"),
    *("|", "`", "```", "<", "</failure>", "<!--", "]]>", "&amp;", "&", '"', "'", "\\", "*", "_", "__", "~~", "#", "[a](1)", "!["),
    *("::error::", "::", "##[error]", "%0A", "%", ",", ":", "=", "{0}", "{", "}", "$x$", "- ", "1. ", "> ", "---", "= "),
    *(" ", "  ", "é", "±", "…", "漢字", "e\u0301", "😀", "Any", "10..30", "C:\\x", "../", "/"),
]
TEXTS = st.lists(st.sampled_from(MARKUP) | st.text(st.characters(exclude_categories=()), max_size=3), max_size=5).map("".join)
NAMES = st.sampled_from(["jog", "jog run", "tables/jog.csv"]) | TEXTS
FILES = st.sampled_from(["tables/jog.csv", "tables/run.parquet", "tables/contextdb.toml"]) | TEXTS
ROWS = st.integers(0, 10**6)
LINES = st.integers(1, 10**6)

TABLES = st.builds(TableSummary, NAMES, st.none() | FILES, ROWS, st.integers(0, 80))


@st.composite
def findings(draw: st.DrawFn, tables: list[TableSummary]) -> Finding:
    """A finding of one of the tables, or of something that is not a table."""
    table = draw(st.sampled_from(tables)) if tables and draw(st.booleans()) else None
    return Finding(
        draw(st.sampled_from([*RULES, "a-rule-of-tomorrow"])),
        draw(st.sampled_from(LEVELS)),
        draw(TEXTS),
        table.name if table else draw(st.none() | NAMES),
        table.file if table else draw(st.none() | FILES),
        draw(st.none() | ROWS),
        draw(st.none() | TEXTS),
        draw(st.none() | LINES),
        draw(st.none() | NAMES),
        tuple(draw(st.lists(ROWS, max_size=3))),
    )


@st.composite
def reports(draw: st.DrawFn) -> CheckReport:
    """A report of a few tables."""
    tables = draw(st.lists(TABLES, max_size=3, unique_by=lambda t: (t.name, t.file)))
    return CheckReport(tuple(tables), tuple(draw(st.lists(findings(tables), max_size=5))))


def many(n_findings: int, n_tables: int = 1, rules: tuple[str, ...] = ("empty-cell",)) -> CheckReport:
    """A report with so many findings of each rule in each table."""
    tables = [TableSummary(f"table_{i}", f"tables/table_{i}.csv", n_findings, 3) for i in range(n_tables)]
    found = [
        Finding(rule, "error", '"5..3" accepts no value at all.', t.name, t.file, row, f"Asset_{row}", row + 2, "speed")
        for t in tables
        for rule in rules
        for row in range(n_findings)
    ]
    return CheckReport(tuple(tables), tuple(found))


JOG = TableSummary("jog", "tables/jog.csv", 17, 8)
RUN = TableSummary("run", "tables/run.parquet", 3, 1)
EXAMPLE = CheckReport(
    (JOG, RUN, TableSummary("walk", "tables/walk.csv", 1, 2)),
    (
        Finding("undeclared-condition", "info", "its cells read as bool.", "jog", "tables/jog.csv", column="IsLeft"),
        Finding("empty-cell", "error", '"5..3" accepts no value.', "jog", "tables/jog.csv", 3, "Jog_Fast", 5, "speed"),
        Finding("empty-cell", "error", '"9..1" accepts no value.', "jog", "tables/jog.csv", 8, "Jog_Slow", 10, "speed"),
        Finding("identical-rows", "warning", "the same as row 0: 50%, a|b.", "run", "tables/run.parquet", 2, "Run_2", by=(0,)),
        Finding("unreadable", "error", "the file is empty.", "jump", "tables/jump.csv"),
    ),
)
"""A small report with a bit of everything."""
