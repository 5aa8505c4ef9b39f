"""The parts of an XLSX file that are the same for every table, and how texts are in them.

Source: ECMA-376, Office Open XML, part 1 (SpreadsheetML) and 22.9.2.19 (ST_Xstring: "_x000D_").
"""

from __future__ import annotations

import re
from xml.sax.saxutils import escape

MOST_ROWS, MOST_COLUMNS, MOST_CHARACTERS = 1_048_576, 16_384, 32_767
"""What a sheet of Excel can hold."""
TYPES_SHEET = "contextdb"
"""The sheet that keeps what contextdb.toml says of the table, as the lines of one."""
FIRST_LINE = "# contextdb 1: what contextdb.toml says of this table; contextdb import reads it"

TEXT, HEADER, ASSET = 1, 2, 3
"""The styles of cells."""

_UNESCAPED = re.compile(r"_(?=x[0-9A-Fa-f]{4}_)")
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f]")
NEVER = re.compile("[\x00\ufffe\uffff\ud800-\udfff]")
"""Characters that no workbook holds."""
_FORBIDDEN = re.compile(r"[\[\]:*?/\\\x00-\x1f]")

_MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_SHEET_TYPE = "application/vnd.openxmlformats-officedocument.spreadsheetml"
DECLARATION = '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>\n'

CONTENT_TYPES = (
    f'{DECLARATION}<Types xmlns="{_PACKAGE}/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="xml" ContentType="application/xml"/>'
    f'<Override PartName="/xl/workbook.xml" ContentType="{_SHEET_TYPE}.sheet.main+xml"/>'
    f'<Override PartName="/xl/worksheets/sheet1.xml" ContentType="{_SHEET_TYPE}.worksheet+xml"/>'
    f'<Override PartName="/xl/worksheets/sheet2.xml" ContentType="{_SHEET_TYPE}.worksheet+xml"/>'
    f'<Override PartName="/xl/styles.xml" ContentType="{_SHEET_TYPE}.styles+xml"/>'
    f'<Override PartName="/xl/sharedStrings.xml" ContentType="{_SHEET_TYPE}.sharedStrings+xml"/></Types>'
)
RELATIONS = (
    f'{DECLARATION}<Relationships xmlns="{_PACKAGE}/relationships">'
    f'<Relationship Id="rId1" Type="{_OFFICE}/officeDocument" Target="xl/workbook.xml"/></Relationships>'
)
WORKBOOK_RELATIONS = (
    f'{DECLARATION}<Relationships xmlns="{_PACKAGE}/relationships">'
    f'<Relationship Id="rId1" Type="{_OFFICE}/worksheet" Target="worksheets/sheet1.xml"/>'
    f'<Relationship Id="rId2" Type="{_OFFICE}/worksheet" Target="worksheets/sheet2.xml"/>'
    f'<Relationship Id="rId3" Type="{_OFFICE}/styles" Target="styles.xml"/>'
    f'<Relationship Id="rId4" Type="{_OFFICE}/sharedStrings" Target="sharedStrings.xml"/></Relationships>'
)
STYLES = (
    f'{DECLARATION}<styleSheet xmlns="{_MAIN}">'
    '<fonts count="2"><font><sz val="11"/><name val="Calibri"/><family val="2"/></font>'
    '<font><b/><sz val="11"/><name val="Calibri"/><family val="2"/></font></fonts>'
    '<fills count="3"><fill><patternFill patternType="none"/></fill><fill><patternFill patternType="gray125"/></fill>'
    '<fill><patternFill patternType="solid"><fgColor rgb="FFE7EDF3"/><bgColor indexed="64"/></patternFill></fill></fills>'
    '<borders count="2"><border><left/><right/><top/><bottom/><diagonal/></border>'
    '<border><left/><right/><top/><bottom style="thin"><color rgb="FF8497A8"/></bottom><diagonal/></border></borders>'
    '<cellStyleXfs count="1"><xf numFmtId="0" fontId="0" fillId="0" borderId="0"/></cellStyleXfs>'
    '<cellXfs count="4"><xf numFmtId="0" fontId="0" fillId="0" borderId="0" xfId="0"/>'
    '<xf numFmtId="49" fontId="0" fillId="0" borderId="0" xfId="0" applyNumberFormat="1"/>'
    '<xf numFmtId="49" fontId="1" fillId="2" borderId="1" xfId="0" applyNumberFormat="1" applyFont="1" applyFill="1"'
    ' applyBorder="1"/>'
    '<xf numFmtId="49" fontId="1" fillId="0" borderId="0" xfId="0" applyNumberFormat="1" applyFont="1"/></cellXfs>'
    '<cellStyles count="1"><cellStyle name="Normal" xfId="0" builtinId="0"/></cellStyles></styleSheet>'
)


def workbook(sheet: str, last_frozen: str) -> str:
    """The list of sheets: the table's, and the one of types. Each page in print repeats what is frozen on the screen."""
    name = attribute(sheet.replace("'", "''"))
    titles = f"'{name}'!$A:${last_frozen},'{name}'!$1:$1"
    return (
        f'{DECLARATION}<workbook xmlns="{_MAIN}" xmlns:r="{_OFFICE}"><bookViews><workbookView/></bookViews><sheets>'
        f'<sheet name="{attribute(sheet)}" sheetId="1" r:id="rId1"/>'
        f'<sheet name="{TYPES_SHEET}" sheetId="2" r:id="rId2"/></sheets>'
        f'<definedNames><definedName name="_xlnm.Print_Titles" localSheetId="0">{titles}</definedName></definedNames></workbook>'
    )


def sheet_start(fits_page: bool = False) -> str:
    """How the XML of a sheet begins; one that `fits_page` is printed as wide as the page."""
    page = '<sheetPr><pageSetUpPr fitToPage="1"/></sheetPr>' if fits_page else ""
    return f'{DECLARATION}<worksheet xmlns="{_MAIN}">{page}'


def page(fits_page: bool) -> str:
    """How a sheet is printed: across, and as high as it is."""
    height = ' fitToHeight="0"' if fits_page else ""
    return f'<pageSetup orientation="landscape"{height}/>'


def shared_strings(texts: list[str]) -> str:
    """The texts of all cells, each once."""
    items = "".join([f'<si><t xml:space="preserve">{text_xml(text)}</t></si>' for text in texts])
    return f'{DECLARATION}<sst xmlns="{_MAIN}" uniqueCount="{len(texts)}">{items}</sst>'


def text_xml(text: str) -> str:
    """A text as XML holds it; characters that XML has no place for as Excel writes them: _x000D_."""
    marked = _UNESCAPED.sub("_x005F_", text) if "_x" in text else text
    return escape(_CONTROL.sub(lambda found: f"_x{ord(found[0]):04X}_", marked))


def attribute(text: str) -> str:
    """A text inside the quotes of an attribute."""
    return escape(text, {'"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"})


def sheet_name(name: str) -> str:
    """A name that a sheet may have, as near to a table's as can be."""
    kept = _FORBIDDEN.sub("_", name).strip(" '")[:31].strip(" '") or "table"
    return f"{kept[:30]}_" if kept.casefold() in (TYPES_SHEET, "history") else kept
