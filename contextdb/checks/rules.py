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
    "no-such-table": Rule(
        "error",
        "A row stands for a table that is not there.",
        "Correct the name after the @, bring the table back, or put the asset in quotes where its name begins with @.",
    ),
    "cyclic-tables": Rule(
        "error",
        "A table stands in itself, by way of the tables inside it.",
        "Take one of the rows on the way out, or let it stand for another table.",
    ),
    "unusable-table": Rule(
        "error",
        "A row stands for a table that cannot be used.",
        "Mend the faults of that table; its own check tells them.",
    ),
    "unlike-conditions": Rule(
        "error",
        "A condition has another type in a table inside the table.",
        "Declare the condition in contextdb.toml, so that its type is no guess.",
    ),
    "too-many-rows": Rule(
        "error",
        "With the rows of its inner tables a table has too many rows.",
        "Let rows of one table stand for another in fewer places.",
    ),
    "shut-out-row": Rule(
        "info",
        "A row of an inner table can never be valid where the table stands.",
        "Nothing, where the inner table stands in several places; else widen one of the two cells, or delete the row.",
    ),
    "duplicate-asset": Rule(
        "warning",
        "An asset stands in more than one row.",
        "Delete one of the rows, or keep both where the asset is meant to be valid in either of two cases.",
    ),
    "identical-rows": Rule(
        "warning",
        "Every condition of a row is the same as in another row, and the policy, or the asset, leaves no choice between the two.",
        "Tell the rows apart by a condition, delete one of them, or set the policy collect where the game should have a choice.",
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
    "unportable-name": Rule(
        "warning",
        "Another system cannot have a table's file under its name, or takes it for another file.",
        "Rename the file, or write its name in contextdb.toml as the folder has it.",
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
    "not-a-table": Rule(
        "info",
        "A file beside the tables looks like something else than a table, so it is not read as one.",
        "Declare the file in contextdb.toml where it is a table; else nothing need be done, or move it out of the folder.",
    ),
    "case-failed": Rule(
        "error",
        "A saved context expects other assets to be valid than are valid.",
        "Look at the context in the editor or with `contextdb query --explain`; correct the table, or what is expected.",
    ),
    "unreadable-case": Rule(
        "error",
        "A saved context cannot be asked",
        "Write facts as in `contextdb query`, and what is expected as asset names, +name, -name or (none).",
    ),
    "subsumed-row": Rule(
        "warning",
        "Wherever a row is valid, one other row is valid too, and elsewhere besides.",
        "Narrow the other row, widen this one, or set the policy collect where the game should have a choice.",
    ),
    "equal-row": Rule(
        "warning",
        "A row is valid in just the contexts of another row, though its cells are written otherwise.",
        "Tell the rows apart by a condition, or set the policy collect where the game should have a choice.",
    ),
    "variety": Rule(
        "info",
        "Several assets are valid in the same contexts, in a table whose policy lets the game choose.",
        "Nothing need be done; `weight` says how often each is picked. Where one row was to play, set the policy first or unique.",
    ),
    "redundant-row": Rule(
        "info",
        "Several rows together are valid wherever a row is.",
        "Nothing need be done; where the table should be shorter, the row can go without opening a gap.",
    ),
    "dead-row": Rule(
        "warning",
        "A row is valid only in contexts that the table's assumptions rule out.",
        "Correct the row, or the assumption; or delete the row.",
    ),
    "never-chosen": Rule(
        "warning",
        "By the table's policy another valid row always comes before this one.",
        "Move the row up, give it a higher priority, or narrow the rows that come before it.",
    ),
    "policy-overlap": Rule(
        "error",
        'Two rows can be valid at once in a table whose policy is "unique".',
        "Change a cell so that the rows exclude each other, rule the overlap out by `assume`, or set another policy.",
    ),
    "no-context": Rule(
        "error",
        "The table's assumptions leave no context that can happen.",
        "Correct the assumption that the message names; `and` may have been meant as `or`.",
    ),
    "bad-assumption": Rule(
        "error",
        "An assumption of a table cannot be read.",
        "Correct it in contextdb.toml; it may name conditions that are declared, and columns of its table.",
    ),
    "always-any": Rule(
        "info",
        "Every cell of a condition is Any, so it excludes no row.",
        "Nothing need be done; delete the column where nobody is going to fill it.",
    ),
    "always-true": Rule(
        "info",
        "A rule is true in every context of the declared values and bounds, so it excludes nothing.",
        "Nothing need be done; empty the cell, or correct the rule where it was to exclude something.",
    ),
    "never-true": Rule(
        "warning",
        "A rule is false in every context of the declared values and bounds, so its row never matches.",
        "Correct the rule, or widen `min`, `max` or `values` of its conditions. To switch a row off, use an `enabled` column.",
    ),
    "inferred-mirror": Rule(
        "info",
        "Angles are negated for clips that are played mirrored, though contextdb.toml does not declare it.",
        'Nothing need be done; declare `mirror = "negate"`, or `mirror = "none"` for an angle that is the same in a mirror.',
    ),
    "undeclared-mirror": Rule(
        "info",
        "A condition has names of both sides, its clips are played mirrored, and it does not declare how its facts change.",
        'Declare `mirror = { Left = "Right" }`, or `mirror = "none"` where its facts are the same in a mirror.',
    ),
    "uneven-mirror": Rule(
        "warning",
        "A number is negated for clips that are played mirrored, and its min is not the opposite of its max.",
        'Correct `min` or `max`; where the number is no side, such as a speed, take `mirror = "negate"` out.',
    ),
    "undecided-rows": Rule(
        "info",
        "Some rows were not compared with all others, because that would have taken longer than a check may.",
        "Nothing need be done; `contextdb coverage` compares with ten times the work, and with more by `--work`.",
    ),
    "unused-condition": Rule(
        "info",
        "A condition is declared, and no table of the folder uses it.",
        "Nothing need be done; delete its section where no table is going to use it.",
    ),
    "gap": Rule(
        "info",
        "Some contexts have no valid row.",
        "Add a row, or widen the nearest one, where the contexts can happen; where they cannot, say so by `assume`.",
    ),
    "new-gap": Rule(
        "warning",
        "Contexts that had a valid row in the baseline have none now, or are new.",
        "Look at what changed since the baseline; mend it, or make a new baseline where it is meant.",
    ),
    "coverage-below": Rule(
        "error",
        "A smaller share of the contexts is covered than `--fail-under` demands.",
        "Fill the largest gaps, rule out what cannot happen by `assume`, or lower the bar.",
    ),
    "table-gone": Rule(
        "error",
        "A table of the baseline is not there any more, or has no rows any more.",
        "Bring the table back; where it was renamed or removed on purpose, name it with `--gone`, or make a new baseline.",
    ),
    "coverage-dropped": Rule(
        "error",
        "The covered share fell by more than `--max-drop` allows since the baseline.",
        "Look at the new gaps; mend them, or make a new baseline where they are meant.",
    ),
    "telemetry-below": Rule(
        "error",
        "A smaller share of the recorded moments is covered than `--fail-under-telemetry` demands.",
        "Fill the gaps that come up most often in the recordings, or lower the bar.",
    ),
}
"""Every rule that a check, or coverage, may break, by name."""

OF_COVERAGE = ("gap", "new-gap", "coverage-below", "table-gone", "coverage-dropped", "telemetry-below")
"""The rules that only `contextdb coverage` tells of."""

TABLE_RULES: tuple[str, ...] = tuple(
    name
    for name in RULES
    if name not in ("unreadable", "no-such-path", "no-tables", "unused-condition", "unportable-name", "not-a-table", *OF_COVERAGE)
)
"""The rules that every table which can be read is held to by a check."""
