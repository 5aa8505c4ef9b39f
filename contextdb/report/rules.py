"""The rules of a check, each in a sentence with its cure, for formats that carry their own help. docs/messages.md tells more."""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.findings import Level


@dataclass(frozen=True, slots=True)
class Rule:
    """What a rule finds, how bad that usually is, and what to do about it."""

    level: Level
    summary: str
    cure: str


RULES: dict[str, Rule] = {
    "unreadable": Rule(
        "error",
        "A file cannot be read as what it should be.",
        "Mend the line that the message names; nothing of the file is used until it reads.",
    ),
    "no-such-path": Rule(
        "error",
        "There is no file or folder of this name.",
        "Correct the name, or bring the file back; contextdb.toml may name a table that was moved or deleted.",
    ),
    "unreadable-cell": Rule(
        "error",
        "The text of a cell is not in the grammar of its type.",
        "Write the cell as the message says is accepted, or correct the type of the condition in contextdb.toml.",
    ),
    "unreadable-penalty": Rule(
        "error",
        "What stands after the ~ of a soft cell is no penalty.",
        "Write a number from 0 up after the ~, such as 3..5 ~2.5, or put a text with a ~ in it in double quotes.",
    ),
    "unknown-value": Rule(
        "error",
        "A cell names a value or a tag that the condition does not declare.",
        "Correct the spelling, or add the value to `values` of the condition in contextdb.toml.",
    ),
    "empty-cell": Rule(
        "error",
        "A cell accepts no value at all, so its row can never match.",
        "Correct the cell; an interval runs upwards, such as 3..5. To switch a row off, use an `enabled` column.",
    ),
    "outside-domain": Rule(
        "warning",
        "A cell accepts only numbers outside the declared `min` and `max`, so its row matches no expected value.",
        "Correct the cell, or widen `min` and `max` of the condition in contextdb.toml.",
    ),
    "beyond-domain": Rule(
        "info",
        "A cell reaches beyond the declared `min` and `max`.",
        "Nothing need be done; to be exact, leave the end open (3..) or widen `min` and `max` in contextdb.toml.",
    ),
    "no-asset": Rule(
        "error",
        "A row names no asset.",
        "Name the asset of the row, or delete the row.",
    ),
    "duplicate-asset": Rule(
        "warning",
        "An asset stands in more than one row.",
        "Delete one of the rows, or keep both where the asset is meant to be valid in either of two cases.",
    ),
    "identical-rows": Rule(
        "warning",
        "Every condition of a row is the same as in another row, so the two are always valid together.",
        "Tell the rows apart by a condition, or keep both where the game should have a choice.",
    ),
    "undeclared-condition": Rule(
        "warning",
        "A column is not declared in contextdb.toml, so its type is a guess from its cells.",
        "Declare the condition in contextdb.toml, correct the header, or list the column under `outputs`.",
    ),
    "no-rows": Rule(
        "warning",
        "A table has no rows, so no context has an asset.",
        "Add rows, or take the table out of the folder until it is needed.",
    ),
    "mixed-line-ends": Rule(
        "info",
        "Some lines of a file end in LF and some in CRLF.",
        "Nothing need be done; to have one kind, convert the file once and set `text` or `eol` in .gitattributes.",
    ),
    "no-tables": Rule(
        "error",
        "The folder holds no table.",
        "Name the folder that holds contextdb.toml and the tables.",
    ),
}
"""Every rule that a check may break, by name."""

TABLE_RULES: tuple[str, ...] = tuple(name for name in RULES if name not in ("unreadable", "no-such-path", "more"))
"""The rules that every table which can be read is held to."""
