"""Find what is wrong with the tables: unreadable cells, cells that accept nothing, redundant rows, saved contexts that fail, and
contracts that some context breaks.

Exits with 1 if there are findings at the level of --fail-on, with 2 if the path does not exist.

  contextdb check tables/
  contextdb check tables/ --format github --fail-on warning
  contextdb check tables/hit_mid_air.cases.csv
  contextdb check --projects games/
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from contextdb import report
from contextdb.cells.row_play import RowPlay
from contextdb.checks.cases import CaseBar, check_cases, read_cases
from contextdb.checks.contracts import contract_findings, proofs_of, strayed
from contextdb.checks.run import check, check_rows, unused_conditions
from contextdb.commands import add_format_arguments, deliver, is_coloured
from contextdb.commands.numbers import percent, whole_type
from contextdb.commands.progress import Bar, has_many_cells, log_of
from contextdb.console import ExitCode, printable, progress, terminal_width
from contextdb.covering.contracts import Proof, prove
from contextdb.disk import CASES_SUFFIX, TABLE_SUFFIXES, path_in_quotes, read_bytes
from contextdb.disk.boundary import inside
from contextdb.errors import ContextDBError, Fault, in_quotes, nearest
from contextdb.expressions.tokens import written_name, written_text
from contextdb.files.file_names import alike, composed, confusable, why_unportable
from contextdb.files.texts import read_texts
from contextdb.files.toml_shapes import as_toml
from contextdb.findings import LEVELS, Finding, Level
from contextdb.motion.markup.markup import Markup
from contextdb.motion.markup.reserved import ReservedTag, reserved_of
from contextdb.motion.markup.span_faults import Span
from contextdb.motion.storage.config import MotionConfig
from contextdb.report.results import CheckReport, TableSummary
from contextdb.schema.contracts import Contract, header, keys_of
from contextdb.schema.settings import Schema
from contextdb.schema.toml_lines import key_lines
from contextdb.tables import project
from contextdb.tables.expected_file import expected_path, read_situations
from contextdb.tables.gap_work import GapWork
from contextdb.tables.other_files import cases_path, notes_path
from contextdb.tables.places import table_path
from contextdb.tables.table import Table
from contextdb.tables.variety import finding_at


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", nargs="?", help="a folder of tables, one table or its name, or its cases")
    parser.add_argument("--projects", metavar="ROOT", help="check every project below a folder, and say which fail")
    add_format_arguments(parser, report.formats("check"))
    parser.add_argument(
        "--fail-on", choices=("error", "warning", "none"), default="error", help="the lowest level that fails (default: error)"
    )
    parser.add_argument("--all", action="store_true", help="print every finding, not the first few of each kind")
    number = whole_type("a number of saved contexts, such as 10.")
    parser.add_argument(
        "--min-cases", type=number, default=0, metavar="N", help="fail if a table has fewer saved contexts that expect something"
    )
    share = "fail if they reach a smaller part of the rows of a table"
    parser.add_argument("--min-rows-reached", type=percent, default=0.0, metavar="PCT", help=share)
    parser.add_argument(
        "--propose",
        action="store_true",
        help="print contracts that hold today and are likely meant, and nothing else",
    )


def run(arguments: argparse.Namespace) -> ExitCode:
    """Check one table, a folder of them, or all projects below one."""
    _require_one(arguments)
    if arguments.propose:
        return _propose(arguments)
    bar = CaseBar(arguments.min_cases, arguments.min_rows_reached)
    if arguments.projects is not None:
        return printed(_of_projects(arguments.projects, bar, failing_levels(arguments.fail_on)), arguments)
    return printed(check_path(arguments.path, bar), arguments)


def _require_one(arguments: argparse.Namespace) -> None:
    """Refuse no path, and two; and contracts proposed for many projects."""
    if (arguments.path is None) == (arguments.projects is None) or (arguments.propose and arguments.projects is not None):
        given = "PATH is missing." if arguments.path is None and arguments.projects is None else "--projects ROOT stands by itself."
        raise ContextDBError(Fault(given, "PATH, or --projects ROOT"))


def _of_projects(root: str, bar: CaseBar, failing: Sequence[Level]) -> CheckReport:
    from contextdb.commands.projects_below import ProjectCheck, ProjectsReport, extend_up_to, project_folders

    folders = project_folders(root)
    extend_up_to(root)
    return ProjectsReport.of([ProjectCheck(folder, check_path(str(folder), bar)) for folder in folders], failing)


def failing_levels(fail_on: str) -> tuple[Level, ...]:
    """The levels that fail, by the lowest of them or "none"."""
    return LEVELS[: LEVELS.index(fail_on) + 1] if fail_on != "none" else ()


def _propose(arguments: argparse.Namespace) -> ExitCode:
    """Print the contracts of tables that can be read which hold and are likely meant."""
    from contextdb.report.render_json import as_json

    path = arguments.path
    is_folder = os.path.isdir(path) or Path(path).name == project.SCHEMA_FILE
    tables = project.Project.load(path).tables.values() if is_folder else [project.load_table(table_path(path))]
    proofs = [proof for table in tables for proof in proposals(table)]
    if arguments.format == "json":
        text = as_json({"format": 1, "proposed": [proof.to_json() | {"toml": proposal_toml(proof.contract)} for proof in proofs]})
    else:
        text = "\n".join(proposal_toml(proof.contract) for proof in proofs)
    deliver(text or "# no contract holds that is likely meant\n", arguments)
    return ExitCode.OK


def printed(checked: CheckReport, arguments: argparse.Namespace) -> ExitCode:
    """Print a report in the wanted format; the code says whether anything in it fails."""
    failing = failing_levels(arguments.fail_on)
    text = report.render(
        arguments.format,
        checked,
        colour=is_coloured(arguments),
        width=terminal_width(),
        shows_all=arguments.all,
        failing=failing,
    )
    deliver(text, arguments)
    return ExitCode.FOUND if any(f.level in failing for f in checked.findings) else ExitCode.OK


def check_path(text: str, bar: CaseBar | None = None) -> CheckReport:
    """Check everything under a path, saved contexts too; what cannot be read at all is a finding. `bar`: of saved contexts."""
    path = Path(text)
    if not os.path.isdir(text) and path.name != project.SCHEMA_FILE:
        file = table_path(text)
        table = _table_of(file) if _is_cases(file) else file
        return CheckReport((), (_stray(file),)) if table is None else _check_files([(None, table)], None, bar)
    folder = project.folder_of(path)
    try:
        schema = project.read_folder_schema(folder)
        files = list(project.table_files(folder, schema))
    except ContextDBError as error:
        return CheckReport((), tuple(_as_findings(error, None)))
    if not files:
        accepted = f"a folder with {project.SCHEMA_FILE} and a .csv or .parquet file for each table"
        return CheckReport(
            (), (Finding("no-tables", "error", f"the folder holds no table. Accepted: {accepted}.", file=str(folder)),)
        )
    report = _check_files(files, schema, bar)
    others = (Finding("not-a-table", "info", sentence, file=str(path)) for path, sentence in project.stray_files(folder, schema))
    strays = _strays(folder, [file for _, file in files])
    return replace(report, findings=(*report.findings, *_unportable(files, schema), *others, *strays))


def _unportable(files: Sequence[tuple[str, Path]], schema: Schema) -> Iterator[Finding]:
    """A finding for every table whose file another system could not have, or would take for another one."""
    others = dict(confusable(str(path) for _, path in files))
    for name, path in files:
        wanted = [Path(one).name for one in (schema.tables[name].files if name in schema.tables else ())]
        declared = next((one for one in wanted if alike(one) == alike(path.name)), path.name)
        messages = [f"{why}." for why in [why_unportable(path.name)] if why]
        if other := others.get(str(path)):
            ignored = "the Unicode form of names" if composed(other) == composed(str(path)) else "case"
            messages.append(f"this and {path_in_quotes(other)} are one file on disks that ignore {ignored}.")
        if composed(declared) != composed(path.name):
            messages.append(
                f"{project.SCHEMA_FILE} calls it {in_quotes(declared)}: there is no such file on disks that distinguish case."
            )
        yield from (Finding("unportable-name", "warning", message, name, str(path)) for message in messages)


def _check_files(files: Sequence[tuple[str | None, Path]], schema: Schema | None = None, bar: CaseBar | None = None) -> CheckReport:
    """Check some tables; `schema` is given when they are all of its folder."""
    tables: list[TableSummary] = []
    read: list[Table] = []
    proofs: list[Proof] = []
    findings = [Finding.of(fault) for fault in project.twice_named((name, path) for name, path in files if name is not None)]
    for name, path in progress(files, "checking"):
        try:
            table = project.load_table(path, strict=False)
        except ContextDBError as error:
            findings += _as_findings(error, name)
            continue
        tables.append(TableSummary(table.name, str(path), table.n_rows, len(table.conditions)))
        read.append(table)
        log = log_of(f"checking {printable(table.name)}", has_many_cells(table))
        if log is not None:
            log(0, 1, "Reading rows")
        findings += check(table)
        tell = None if log is None else partial(_tell, log)
        findings += check_rows(table, progress=tell)
        proofs += proofs_of(table, tell)
        findings += _check_cases(table, cases_path(path), bar or CaseBar())
        findings += [*_check_notes(table, notes_path(path)), *_check_expected(table)]
    if schema is not None:
        names = [name for name, _ in files if name is not None]
        proofs += strayed(schema, names, [name for name in names if name not in {table.name for table in read}])
    known = schema or next((table.schema for table in read), None)
    if known is not None and known.file:
        lines = key_lines(read_bytes(Path(known.file)).decode("utf-8-sig"))
        findings += contract_findings(proofs, read, known, lines)
        findings += unused_conditions(known, read, lines) if schema is not None and len(read) == len(files) else []
        findings += check_against_markup(read, Path(known.file).parent)
    return CheckReport(tuple(tables), tuple(findings), tuple(proofs))


def _tell(progress: Bar, part: str, share: float) -> None:
    progress(int(1000 * share), 1000, part)


def _check_cases(table: Table, path: Path, bar: CaseBar) -> list[Finding]:
    try:
        cases = read_cases(path)
        return [*check_cases(table, cases, str(path)), *bar.findings(table, cases, str(table.path) if table.path else None)]
    except ContextDBError as error:
        return _as_findings(error, table.name)


def _check_expected(table: Table) -> list[Finding]:
    """What is wrong in the file of the contexts that are expected of a table."""
    if table.settings.expected is None or table.faults:
        return []
    try:
        path = expected_path(table)
        if path is not None:
            read_situations(path, [column.condition for column in table.flat().conditions])
    except ContextDBError as error:
        return _as_findings(error, table.name)
    return []


def _check_notes(table: Table, path: Path) -> list[Finding]:
    """A finding for notes, or work on gaps, that cannot be read, such as between git's marks: nobody would see any of it."""
    try:
        if path.is_file():
            read_texts(path)
        if table.path is not None:
            GapWork.beside(table.path)
    except ContextDBError as error:
        return _as_findings(error, table.name)
    return []


def _strays(folder: Path, tables: Sequence[Path]) -> Iterator[Finding]:
    """A finding for every file of cases next to the tables that is none of theirs."""
    taken = {os.path.abspath(cases_path(table)) for table in tables}
    for folder_near in sorted({folder, *(table.parent for table in tables if table.parent.is_dir())}):
        for path in sorted(folder_near.iterdir()):
            if _is_cases(path) and path.is_file() and os.path.abspath(path) not in taken:
                taken.add(os.path.abspath(path))
                yield _stray(path)


def _stray(path: Path) -> Finding:
    stem = path.name[: -len(CASES_SUFFIX)]
    stems = [p.stem for p in path.parent.iterdir() if _is_table(p)]
    near = nearest(stem, stems)
    mend = f" Did you mean {in_quotes(near + CASES_SUFFIX)}?" if near else ""
    accepted = " or ".join(in_quotes(stem + suffix) for suffix in TABLE_SUFFIXES)
    message = f"its cases cannot be evaluated: there is no table next to it. Accepted: {accepted}.{mend}"
    return Finding("unreadable-case", "error", message, file=str(path))


def _table_of(cases: Path) -> Path | None:
    """The table that a file of cases belongs to."""
    return next((p for p in sorted(cases.parent.iterdir()) if _is_table(p) and cases_path(p) == cases), None)


def _is_cases(path: Path) -> bool:
    return path.name.lower().endswith(CASES_SUFFIX) and not path.name.startswith(".")


def _is_table(path: Path) -> bool:
    return path.suffix.lower() in TABLE_SUFFIXES and not _is_cases(path)


def _as_findings(error: ContextDBError, table: str | None) -> list[Finding]:
    return [Finding.of(fault if isinstance(fault, Fault) else Fault(str(fault)), "error", table) for fault in error.faults]


# ---- contracts that hold of a table today and are likely meant: what `contextdb check --propose` lists


ANY_ROW = "asset like '*'"
MOST_VALUES = 20
"""Of an enum with more values none is proposed for each."""


def proposals(table: Table) -> Iterator[Proof]:
    """Contracts of a table that hold and that contextdb.toml does not have: some row always plays, so that a fallback is never
    reached; else one plays for each value of an enum; and never two are valid at once."""
    known = {replace(contract, name="", why="") for contract in table.schema.contracts.values()}
    always = prove(_contract(table, "always_a_row", some=ANY_ROW), table)
    held = [always] if _is_meant(always) else [p for c in _of_values(table) if _is_meant(p := prove(c, table))]
    single = prove(_contract(table, "one_at_a_time", at_most=1), table)
    held += [single] if table.n_rows > 1 and _is_meant(single) else []
    yield from (proof for proof in held if replace(proof.contract, name="", why="") not in known)


def proposal_toml(contract: Contract) -> str:
    """A contract as contextdb.toml has it."""
    keys = ((key, getattr(contract, key)) for key in keys_of("contracts"))
    given = ((key, value[0] if key == "at_most" and value else value) for key, value in keys)
    lines = [f"{key} = {as_toml(value)}" for key, value in given if value not in (None, "")]
    return "\n".join([header(("contracts", contract.name)), *lines, ""])


def _contract(table: Table, name: str, when: str | None = None, **demand: object) -> Contract:
    return Contract(f"{table.name}_{name}", table=table.name, when=when, **demand)  # type: ignore[arg-type]


def _of_values(table: Table) -> Iterator[Contract]:
    """That some row plays for each value of an enum."""
    for column in table.conditions:
        condition = column.condition
        values = condition.domain.values if condition.domain.type.needs_values else None
        for value in values if values is not None and len(values) <= MOST_VALUES else ():
            text = written_text(value) if "'" in value else f"'{value}'"
            when = f"{written_name(condition.name)} == {text}"
            yield _contract(table, f"{condition.name}_{value}_has_a_row", when, some=ANY_ROW)


def _is_meant(proof: Proof) -> bool:
    return proof.holds is True and not proof.is_vacuous


# ---- where a row says that its clip plays otherwise than the markup of its database says; clips are not read


def check_against_markup(tables: Iterable[Table], folder: Path) -> Iterator[Finding]:
    """The contradictions of some tables of a project. Motion settings and markup that cannot be read are reported by
    `contextdb motion check`."""
    saying = [table for table in tables if table.outputs.plays is not None and table.schema.motion]
    for table in saying:
        try:
            config = MotionConfig.from_dict(table.schema.motion, tables=[table.name], file=table.schema.file)
        except ContextDBError:
            continue
        for database in (each for each in config.databases.values() if each.table == table.name):
            try:
                markup = Markup() if database.markup is None else Markup.load(inside(folder / database.markup, folder))
            except ContextDBError:
                continue
            has_mirror = bool(config.features[database.features].mirror)
            yield from _of_table(table, markup, database.markup is not None, has_mirror, database.name)


def _of_table(table: Table, markup: Markup, is_marked: bool, has_mirror: bool, database: str) -> Iterator[Finding]:
    plays = table.outputs.plays
    assert plays is not None, "only tables that say how rows play are looked at"
    for row, asset in enumerate(table.assets):
        how = RowPlay.of(plays[row].tolist())
        if how is None:
            continue
        for column, message in _contradictions(how, markup.spans_of(asset), is_marked):
            yield finding_at(table, row, "row-against-markup", "error", message, column)
        if how.mirror == "always" and not has_mirror:
            message = f"mirror is always, but the features of [databases.{database}] have no `mirror`: the row never plays."
            yield finding_at(table, row, "row-against-markup", "error", message, "mirror")


def _contradictions(how: RowPlay, spans: Iterable[Span], is_marked: bool) -> Iterator[tuple[str, str]]:
    """The column and what is wrong with it, for each part that the markup of the asset contradicts."""
    tags: dict[ReservedTag, list[Span]] = {}
    for span in spans:
        if (tag := reserved_of(span.tag)) is not None:
            tags.setdefault(tag, []).append(span)
    looping = ReservedTag.LOOPING in tags
    if how.loop is not None and is_marked and how.loop != looping:
        yield "loop", f"loop is {how.loop}, but the markup {'marks' if looping else 'does not mark'} the clip as Looping."
    if how.until == "any" and ReservedTag.NEXT_NATURAL_ONLY in tags:
        yield "until", "until is any, but the markup has NextNaturalOnly, which is left at natural transitions alone."
    weights = {span.value for span in tags.get(ReservedTag.ROOT_MOTION_WEIGHT, ())}
    if (how.root == "code" and weights - {0.0}) or (how.root == "animation" and weights - {1.0}):
        listed = ", ".join(f"{weight:g}" for weight in sorted(weight for weight in weights if weight is not None))
        yield "root", f"root is {how.root}, but the markup gives RootMotionWeight {listed}."
    for tag in (ReservedTag.EXCLUDED, ReservedTag.DO_NOT_CHOOSE):
        for span in tags.get(tag, ()):
            if how.start_s is not None and span.from_s <= how.start_s < span.to_s:
                where = f"from {span.from_s:g} to {span.to_s:g} s"
                yield "start_s", f"start_s is {how.start_s:g}, where nothing can be entered: {in_quotes(str(tag))} {where}."
