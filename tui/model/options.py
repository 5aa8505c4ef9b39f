"""The settings of a table as fields: what each is for, what it may be, and the edit that sets it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from contextdb.tables.table import Table

POLICY_WORDS = {
    "collect": "several may be valid: that is variety",
    "first": "the first valid row of the file plays",
    "unique": "at most one may be valid; two are a fault",
    "priority": "the highest priority plays",
    "specific": "the row with most cells that are not Any plays",
    "cheapest": "the row whose soft cells cost least plays",
}
"""What each policy means, in a few words."""


@dataclass(frozen=True)
class Option:
    """A setting: its key in contextdb.toml, its name for people, and what it does."""

    key: str
    label: str
    meaning: str


OPTIONS = (
    Option("policy", "Policy", "What the game does when several rows are valid at once."),
    Option("asset", "Asset column", "Names the asset of each row."),
    Option("outputs", "Outputs", "Columns that are data for the game. They are not conditions: they exclude no row."),
    Option("enabled", "Enabled column", "A row that says False here never matches."),
    Option("priority", "Priority column", "A whole number in each row. Of the valid rows those with the highest are picked from."),
    Option("weight", "Weight column", "How often a row is picked among equals: 2 is twice as often as 1."),
    Option("fallback", "Fallback", "The asset that plays when no row is valid. Empty: none does."),
    Option(
        "assume", "Assumptions", "What is always so, such as: not (IsRunning and IsIdle). Coverage leaves out all other contexts."
    ),
    Option("once", "Once column", "A row that says True here is picked once by each character, then no more."),
    Option("cooldown_s", "Cooldown seconds", "A column: for so many seconds after it was picked a row is not picked again."),
    Option("cooldown_turns", "Cooldown picks", "A column: for so many picks after it was picked a row is not picked again."),
)


def columns_for(table: Table, key: str) -> list[str]:
    """The columns that may have a job: those with no other job and not declared as a condition; the one that has it comes too."""
    taken = {name for job, name in table.settings.jobs if job != key} | (set() if key == "asset" else {table.asset_column})
    return [c.name for c in table.columns if c.name not in taken and c.name not in table.schema.conditions]


def with_expression(expressions: Sequence[str], at: int, text: str) -> list[str]:
    """The expressions with one changed, added behind the last, or, when the text is empty, taken away."""
    changed = [*expressions[:at], text.strip(), *expressions[at + 1 :]]
    return [one for one in changed if one]
