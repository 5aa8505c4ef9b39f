"""The rules of a check, each in one sentence with its remedy, for formats that include help. docs/messages.md explains more."""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.findings import Level


@dataclass(frozen=True, slots=True)
class Rule:
    """What a rule reports, its usual level, what to do about it, and where it is found."""

    level: Level
    summary: str
    cure: str
    modules: tuple[str, ...]
    """The modules of contextdb whose code reports it."""


RULES: dict[str, Rule] = {
    "unreadable": Rule(
        "error",
        "A file is not in the expected format.",
        "Correct the line that the message names; nothing in the file is used until all of it can be read.",
        ("errors", "expressions.tokens", "schema.faults"),
    ),
    "no-such-path": Rule(
        "error",
        "There is no file or folder of this name.",
        "Correct the name, or restore the file; contextdb.toml may name a table that was moved or deleted.",
        (
            "cells.arguments",
            "commands.evaluate_command",
            "commands.import_command",
            "commands.motion_page",
            "commands.motion_replay_command",
            "commands.motion_run_command",
            "disk",
            "disk.boundary",
            "tables.places",
            "tables.project",
            "tables.watching.snapshot",
            "telemetry.contexts",
            "telemetry.observe",
        ),
    ),
    "unreadable-cell": Rule(
        "error",
        "The text of a cell does not follow the grammar of its type.",
        "Write the cell in an accepted form, or correct the type of the condition in contextdb.toml.",
        ("cells.grammar", "expressions.rules.column", "tables.expected_file", "tables.plain_columns"),
    ),
    "unreadable-penalty": Rule(
        "error",
        "The text after the ~ of a soft cell is not a penalty.",
        "Write a number from 0 up after the ~, such as 3..5 ~2.5 or 3..5 ~2.5/10, or put a text with a ~ in double quotes.",
        ("cells.grammar",),
    ),
    "unknown-value": Rule(
        "error",
        "A cell names a value or a tag that the condition does not declare.",
        "Correct the spelling, or add the value to `values` of the condition in contextdb.toml.",
        ("cells.grammar",),
    ),
    "empty-cell": Rule(
        "error",
        "A cell accepts no value at all, so its row can never match.",
        "Correct the cell; an interval runs upwards, such as 3..5. To disable a row, use an `enabled` column.",
        ("checks.run",),
    ),
    "outside-domain": Rule(
        "warning",
        "A cell accepts only numbers outside the declared `min` and `max`, so its row matches no expected value.",
        "Correct the cell, or widen `min` and `max` of the condition in contextdb.toml.",
        ("checks.run",),
    ),
    "beyond-domain": Rule(
        "info",
        "A cell reaches beyond the declared `min` and `max`.",
        "No action needed; to be exact, leave the end open (3..) or widen `min` and `max` in contextdb.toml.",
        ("checks.run",),
    ),
    "unreadable-output": Rule(
        "error",
        "A cell of an output cannot be read as the output's type.",
        "Write the cell in an accepted form, or correct the type or the values of the output in contextdb.toml.",
        ("cells.outputs",),
    ),
    "output-out-of-bounds": Rule(
        "error",
        "A cell of an output is outside the declared `min` and `max`.",
        "Correct the cell, or widen `min` and `max` of the output in contextdb.toml.",
        ("cells.outputs",),
    ),
    "missing-output": Rule(
        "error",
        "A cell of an output is empty, and the output has no default.",
        "Fill in the cell, or declare `default` for the output in contextdb.toml.",
        ("cells.outputs",),
    ),
    "row-against-markup": Rule(
        "error",
        "A row says that its clip plays otherwise than the markup of its database says.",
        "Correct the cell, or the markup of the clip.",
        ("commands.check_command",),
    ),
    "no-asset": Rule(
        "error",
        "A row names no asset.",
        "Write the asset of the row, or delete the row.",
        ("checks.run",),
    ),
    "no-such-table": Rule(
        "error",
        "A row refers to a missing table, or the base of a variant is missing.",
        "Correct the name after the @ or of the base, restore the table, or put the asset in quotes if its name begins with @.",
        ("tables.nesting.links", "tables.table", "tables.variants"),
    ),
    "cyclic-tables": Rule(
        "error",
        "A table contains itself, directly or through an inner table, or is a variant of itself.",
        "Remove one of the rows on the path, or let it refer to another table; of a variant name another base.",
        ("tables.nesting.links", "tables.variants"),
    ),
    "unusable-table": Rule(
        "error",
        "A row, or a variant, refers to a table that cannot be used.",
        "Correct the faults of that table; they are reported with it.",
        ("checks.nested",),
    ),
    "unlike-conditions": Rule(
        "error",
        "A condition has different types in a table and in a table inside it.",
        "Declare the condition in contextdb.toml, so that its type is not guessed.",
        ("tables.nesting.flat",),
    ),
    "unlike-outputs": Rule(
        "error",
        "An output has different types in a table and in a table inside it.",
        "Declare the output in the same way in both tables.",
        ("tables.nesting.expansion",),
    ),
    "too-many-rows": Rule(
        "error",
        "A table has too many rows, or has when the rows of its inner tables are counted.",
        "Refer to inner tables from fewer rows, or write a table with fewer.",
        ("files.parquet", "tables.nesting.expansion"),
    ),
    "shut-out-row": Rule(
        "info",
        "A row of an inner table can never be valid in the place where the table is used.",
        "No action needed if other rows refer to the inner table too; otherwise widen one of the two cells, or delete the row.",
        ("checks.nested",),
    ),
    "duplicate-asset": Rule(
        "warning",
        "An asset appears in more than one row.",
        "Delete one of the rows, or keep both if the asset should be valid in either of two cases.",
        ("checks.run",),
    ),
    "identical-rows": Rule(
        "warning",
        "Every condition of a row is the same as in another row, and the policy, or the asset, leaves no choice between the two.",
        "Distinguish the rows by a condition, delete one of them, or set the policy collect if the game should have a choice.",
        ("tables.variety",),
    ),
    "undeclared-condition": Rule(
        "warning",
        "A column is not declared in contextdb.toml, so its type is guessed from its cells.",
        "Declare the condition in contextdb.toml, correct the header, or list the column under `outputs`.",
        ("checks.run",),
    ),
    "no-rows": Rule(
        "warning",
        "A table has no rows, so no context has an asset.",
        "Add rows, or remove the table from the folder until it is needed.",
        ("checks.run",),
    ),
    "unportable-name": Rule(
        "warning",
        "Another operating system cannot store a table's file under its name, or confuses it with another file.",
        "Rename the file, or write its name in contextdb.toml as it is in the folder.",
        ("commands.check_command",),
    ),
    "mixed-line-ends": Rule(
        "info",
        "Some lines of a file end in LF and some in CRLF.",
        "No action needed; for uniform line ends, convert the file once and set `text` or `eol` in .gitattributes.",
        ("checks.run",),
    ),
    "broken-contract": Rule(
        "error",
        "A context breaks what a contract of contextdb.toml demands.",
        "Change the rows so that the counterexample is as demanded, narrow the contract by `when`, or delete it.",
        ("checks.contracts",),
    ),
    "unreadable-contract": Rule(
        "error",
        "A contract names a table, a condition or an output that there is not.",
        "Correct the name in the section of contextdb.toml.",
        ("checks.contracts",),
    ),
    "open-contract": Rule(
        "warning",
        "A contract could be neither proved nor broken.",
        "Write `when` and `assume` as comparisons of one condition with constants, or raise the work.",
        ("checks.contracts",),
    ),
    "empty-contract": Rule(
        "warning",
        "No context that can happen is as the contract says, so that it holds of nothing.",
        "Correct `when`, or the assumptions of the table.",
        ("checks.contracts",),
    ),
    "no-tables": Rule(
        "error",
        "The folder contains no table.",
        "Name the folder that contains contextdb.toml and the tables.",
        ("commands.check_command", "commands.coverage_command"),
    ),
    "not-a-table": Rule(
        "info",
        "A file in the folder looks like something other than a table, so it is not read as one.",
        "Declare the file in contextdb.toml if it is a table; otherwise no action is needed, or move it out of the folder.",
        ("commands.check_command",),
    ),
    "case-failed": Rule(
        "error",
        "The valid assets of a saved context differ from those expected.",
        "Look at the context in the editor or with `contextdb query --explain`; correct the table, or the expectation.",
        ("checks.cases",),
    ),
    "unreadable-case": Rule(
        "error",
        "A saved context cannot be evaluated",
        "Write facts as in `contextdb query`, and the expected assets as names, +name, -name or (none).",
        ("checks.cases", "commands.check_command"),
    ),
    "subsumed-row": Rule(
        "warning",
        "Wherever a row is valid, one other row is valid too, and also elsewhere.",
        "Narrow the other row, widen this one, or set the policy collect if the game should have a choice.",
        ("covering.judge",),
    ),
    "equal-row": Rule(
        "warning",
        "A row is valid in exactly the same contexts as another row, although its cells are written differently.",
        "Distinguish the rows by a condition, or set the policy collect if the game should have a choice.",
        ("covering.judge",),
    ),
    "variety": Rule(
        "info",
        "Several assets are valid in the same contexts, in a table whose policy lets the game choose.",
        "No action needed; `weight` says how often each is picked. If only one row should play, set the policy first or unique.",
        ("checks.run", "covering.judge"),
    ),
    "redundant-row": Rule(
        "info",
        "Wherever a row is valid, at least one of several other rows is valid too.",
        "No action needed; to shorten the table, you can delete the row without opening a gap.",
        ("covering.judge",),
    ),
    "dead-row": Rule(
        "warning",
        "A row is valid only in contexts that the table's assumptions exclude.",
        "Correct the row or the assumption, or delete the row.",
        ("covering.judge",),
    ),
    "never-chosen": Rule(
        "warning",
        "By the table's policy another valid row always comes before this one.",
        "Move the row up, give it a higher priority or more cells, or narrow the rows that come before it.",
        ("covering.judge",),
    ),
    "policy-overlap": Rule(
        "error",
        'Two rows can be valid at once in a table whose policy is "unique".',
        "Change a cell so that the rows exclude each other, exclude the overlap with `assume`, or set another policy.",
        ("covering.judge",),
    ),
    "no-context": Rule(
        "error",
        "The table's assumptions leave no possible context.",
        "Correct the assumption that the message names; perhaps `and` should be `or`.",
        ("checks.run", "covering.judge"),
    ),
    "bad-assumption": Rule(
        "error",
        "An assumption of a table cannot be read.",
        "Correct it in contextdb.toml; it may name declared conditions and columns of its table.",
        ("checks.run",),
    ),
    "always-any": Rule(
        "info",
        "Every cell of a condition is Any, so it excludes no row.",
        "No action needed; delete the column if nobody is going to fill it.",
        ("checks.run",),
    ),
    "always-true": Rule(
        "info",
        "A rule is true in every context of the declared values and bounds, so it excludes nothing.",
        "No action needed; empty the cell, or correct the rule if it should exclude something.",
        ("checks.run",),
    ),
    "never-true": Rule(
        "warning",
        "A rule is false in every context of the declared values and bounds, so its row never matches.",
        "Correct the rule, or widen `min`, `max` or `values` of its conditions. To disable a row, use an `enabled` column.",
        ("checks.run",),
    ),
    "inferred-mirror": Rule(
        "info",
        "Angles are negated for clips that are played mirrored, although contextdb.toml does not declare it.",
        'No action needed; declare `mirror = "negate"`, or `mirror = "none"` for an angle that is the same in a mirror.',
        ("checks.run",),
    ),
    "undeclared-mirror": Rule(
        "info",
        "A condition has names of both sides, or is itself of one side, and its clips are played mirrored, but it does not declare"
        " how its facts change, or the condition of the other side is not a column.",
        'Declare `mirror = { Left = "Right" }`, with both conditions as columns, or `mirror = "none"` if its facts are the same in'
        " a mirror.",
        ("checks.run",),
    ),
    "uneven-mirror": Rule(
        "warning",
        "A number is negated for clips that are played mirrored, but its min is not the opposite of its max.",
        'Correct `min` or `max`; if the number has no side, as a speed, remove `mirror = "negate"`.',
        ("checks.run",),
    ),
    "undecided-rows": Rule(
        "info",
        "Some rows were not compared with all others, because that would exceed the work limit of a check.",
        "No action needed; `contextdb coverage` allows ten times the work, and more with `--work`.",
        ("checks.run", "covering.judge"),
    ),
    "unused-condition": Rule(
        "info",
        "A condition is declared, but no table of the folder uses it.",
        "No action needed; delete its section if no table is going to use it.",
        ("checks.run",),
    ),
    "gap": Rule(
        "info",
        "Some contexts have no valid row.",
        "Add a row, or widen the nearest one, if the contexts can occur; otherwise exclude them with `assume`.",
        ("report.coverage_results",),
    ),
    "new-gap": Rule(
        "warning",
        "Contexts that had a valid row in the baseline have none now, or are new.",
        "Look at what changed since the baseline; correct it, or make a new baseline if the change is intended.",
        ("report.coverage_results",),
    ),
    "coverage-below": Rule(
        "error",
        "The covered share of the contexts is below `--fail-under`.",
        "Fill the largest gaps, exclude impossible contexts with `assume`, or lower the threshold.",
        ("report.coverage_results",),
    ),
    "table-gone": Rule(
        "error",
        "A table of the baseline no longer exists, or no longer has rows.",
        "Restore the table; if it was renamed or removed on purpose, name it with `--gone`, or make a new baseline.",
        ("report.coverage_results",),
    ),
    "table-new": Rule(
        "error",
        "A table is not in the baseline, so it is compared with nothing.",
        "If the table is new or renamed on purpose, name it with `--new`, or make a new baseline.",
        ("report.coverage_results",),
    ),
    "space-changed": Rule(
        "error",
        "Since the baseline, the conditions of a table, their bounds or values, its `assume`, its rules or its policy changed, or "
        "fewer situations are expected of it.",
        "Look at what the message names; if the change is intended, name the table with `--redefined`, or make a new baseline.",
        ("report.coverage_results",),
    ),
    "few-cases": Rule(
        "error",
        "A table has fewer saved contexts than `--min-cases`, or they reach fewer rows than `--min-rows-reached`.",
        "Restore a file of cases that was deleted, or let `contextdb cases --write` add the fewest contexts.",
        ("checks.cases",),
    ),
    "cases-fewer": Rule(
        "error",
        "The saved contexts of a table expect less than in the baseline, or reach fewer rows.",
        "Restore them; if they were deleted or weakened on purpose, name the table with `--fewer-cases`.",
        ("report.coverage_results",),
    ),
    "coverage-dropped": Rule(
        "error",
        "Since the baseline, the covered share fell by more than `--max-drop` allows.",
        "Look at the new gaps; correct them, or make a new baseline if they are intended.",
        ("report.coverage_results",),
    ),
    "expected-below": Rule(
        "error",
        "The covered share of what is expected of a table is below `--fail-under-expected`.",
        "Add rows for the parts that the report lists first, or lower the threshold.",
        ("report.coverage_results",),
    ),
    "telemetry-below": Rule(
        "error",
        "The covered share of the recorded moments is below `--fail-under-telemetry`.",
        "Fill the gaps that occur most often in the recordings, or lower the threshold.",
        ("report.coverage_results",),
    ),
}
"""Every rule of check and coverage, by name."""

OF_COVERAGE = (
    "gap",
    "new-gap",
    "coverage-below",
    "table-gone",
    "table-new",
    "space-changed",
    "cases-fewer",
    "coverage-dropped",
    "expected-below",
    "telemetry-below",
)
"""The rules that only `contextdb coverage` reports."""

OF_OPTIONS = ("few-cases",)
"""The rules of bars that an option of check sets."""

OF_CONTRACTS = ("broken-contract", "unreadable-contract", "open-contract", "empty-contract")
"""The rules of contracts, which are of contextdb.toml."""

TABLE_RULES: tuple[str, ...] = tuple(
    name
    for name in RULES
    if name
    not in (
        "unreadable",
        "no-such-path",
        "no-tables",
        "unused-condition",
        "unportable-name",
        "not-a-table",
        *OF_CONTRACTS,
        *OF_OPTIONS,
        *OF_COVERAGE,
    )
)
"""The rules that a check applies to every table it can read."""
