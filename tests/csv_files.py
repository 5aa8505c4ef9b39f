"""CSV files for property tests, and a reader of them that is too simple to be wrong."""

import re
from dataclasses import dataclass

from hypothesis import strategies as st

FIELD = re.compile(r'"(?:[^"]|"")*"|[^",\r\n]*')
END = re.compile(r",|\r\n|\n|\r|\Z")
BOM = "\ufeff"


def strict_records(text: str) -> list[list[str]] | None:
    """The raw fields of every record that is not blank; None when a quote stands where none may."""
    at, fields, records = 0, list[str](), list[list[str]]()
    while at < len(text) or fields:
        field = FIELD.match(text, at)
        end = END.match(text, field.end()) if field else None
        if not field or not end:
            return None
        fields.append(field[0])
        at = end.end()
        if end[0] != ",":
            if fields != [""]:
                records.append(fields)
            fields = []
    return records


def raw_lines(text: str) -> list[str]:
    """The text cut after every line end outside quotes, nothing left away."""
    lines, start, is_quoted = list[str](), 0, False
    for at, character in enumerate(text):
        is_quoted ^= character == '"'
        ends = character == "\n" or (character == "\r" and text[at + 1 : at + 2] != "\n")
        if ends and not is_quoted:
            lines.append(text[start : at + 1])
            start = at + 1
    return [*lines, text[start:]] if text[start:] else lines


@dataclass(frozen=True)
class CsvFile:
    """A well-formed file and what it says."""

    text: str
    names: list[str]
    rows: list[list[str]]

    @property
    def raw(self) -> bytes:
        return self.text.encode()


CELLS = st.one_of(
    st.sampled_from(["Any", "", "True", "20, 9.99", "CB FS SS", '"Half Back"', "170..-170", " ", "-", "é ± 1", "*", "^a.*$"]),
    st.text(st.sampled_from('ab ",\n\r\té\u2028\ufeff;#<'), max_size=6),
    st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=5),
)
LINE_ENDS = st.sampled_from(["\n", "\r\n", "\r"])


@st.composite
def csv_files(draw: st.DrawFn, max_rows: int = 6) -> CsvFile:
    """Files with every freedom that the format leaves: quotes without need, line ends, blank lines, a BOM, no last line end."""
    width = draw(st.integers(1, 4))
    names = draw(st.lists(CELLS.filter(str.strip), min_size=width, max_size=width, unique=True))
    rows = draw(st.lists(st.lists(CELLS, min_size=width, max_size=width), max_size=max_rows))
    is_mixed, is_wordy = draw(st.booleans()), draw(st.booleans())
    usual = draw(LINE_ENDS)
    text = BOM if draw(st.booleans()) else ""
    if draw(st.booleans()):
        text += draw(st.sampled_from(["", "\n", "\r\n"]))
    for at, row in enumerate([names, *rows]):
        text += (
            ",".join(written(t, at == 0 or is_wordy or draw(st.integers(0, 5)) == 0) for t in row)
            if width > 1
            else written(row[0], True)
        )
        text += draw(LINE_ENDS) if is_mixed else usual
        text += "\n" if draw(st.integers(0, 9)) == 0 else ""
    if draw(st.booleans()):
        text = text.rstrip("\r\n")
    return CsvFile(text, names, rows)


def written(text: str, is_quoted: bool) -> str:
    """A text as a field."""
    return '"' + text.replace('"', '""') + '"' if is_quoted or re.search('[",\r\n]', text) or text.startswith(("<", BOM)) else text
