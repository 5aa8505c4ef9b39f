"""Write into contextdb.toml what edits of a table change: settings, conditions, blueprints, selectors. An edge: this
touches the disk.

Only the keys that an edit changed are written; every other byte of the file stays, also what somebody else wrote into it meanwhile.
Where somebody else changed the same key, nothing is written. Before the file is replaced, its new text is read, and must say what
the table says.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from contextdb.disk import read_bytes, real_path, write_atomic
from contextdb.disk.together import NewFile
from contextdb.errors import Fault, FileError, Place, SchemaError, safe_text, some
from contextdb.files.file_names import alike
from contextdb.files.toml_shapes import Path as KeyPath
from contextdb.files.toml_shapes import as_toml, dotted, plain_numbers
from contextdb.schema import toml_edit
from contextdb.schema.contracts import header
from contextdb.schema.sections import schema_to_dict, settings_to_dict
from contextdb.schema.settings import EMPTY, Schema, TableSettings, resolved, without_inherited
from contextdb.tables.project import SCHEMA_FILE, read_folder_schema, schema_of
from contextdb.tables.table import Table

Keys = dict[KeyPath, object]
"""What each key says: ("tables", "jog", "policy") to "first". Lists are lists, and a key without a say is missing."""

Changes = dict[KeyPath, tuple[object, object]]
"""What each key said, and what it shall say now; None for nothing."""

_BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class SchemaChange:
    """A contextdb.toml as it is to be written."""

    path: Path
    raw: bytes
    was: bytes | None
    """The file that the change was made for; None where there was none."""

    @property
    def new_file(self) -> NewFile:
        """The file as `contextdb.disk.together.write_together` writes it, unless somebody has changed it meanwhile."""
        return NewFile(self.path, self.raw, self.was)

    @property
    def fault(self) -> Fault:
        """What is said when somebody has changed it meanwhile."""
        problem = "the file was changed by somebody else in this moment."
        return Fault(problem, mend="to do the same once more", place=Place(str(self.path)), rule="merge-conflict")

    def write(self) -> None:
        """Replace the file in one step. Raises FileError where the disk refuses, or somebody has changed the file since it was
        read; the old file is then whole."""
        if not write_atomic(self.path, self.raw, self.was):
            raise FileError(self.fault)


def schema_change(before: Table | None, after: Table) -> SchemaChange | None:
    """What is to be written so that contextdb.toml says what a table says; None when it says so already.

    `before` is the table as it was loaded or saved last; None for a file that is new, or that has another place now: then its
    settings and the conditions of its columns are declared there. `after` is the table as it is saved; it has a path. Raises
    SchemaError where the file cannot be read, somebody else changed the same key, or it could not say what the table says;
    FileError where it may not be read.
    """
    path = schema_path(after)
    wanted = _changes({} if before is None else _keys(before, path), _keys(after, path, only_own=before is None))
    if not wanted:
        return None
    raw = read_bytes(path) if path.is_file() else b""
    theirs = read_folder_schema(path.parent) if raw else EMPTY
    require_declared_here(((key[0], key[1]) for key in wanted), theirs, path)
    wanted = _not_there_yet(wanted, theirs, path)
    if not wanted:
        return None
    bom = _BOM if raw.startswith(_BOM) else b""
    text = raw.removeprefix(_BOM).decode()
    if not path.is_file():
        text = toml_edit.set_key("", ("project", "name"), real_path(path.parent).name or "tables")
    now = _edited(text, wanted, after, _settings_name(after, path))
    _require_changed(now, wanted, theirs, path)
    return SchemaChange(path, bom + now.encode(), raw if path.is_file() else None)


def require_declared_here(parts: Iterable[tuple[str, str]], schema: Schema, path: Path) -> None:
    """Raise SchemaError where a part is to change, such as ("conditions", "speed"), that the project has from what it extends."""
    for part in parts:
        if part in schema.shared and schema.studio is not None:
            problem = f"{header(part)} is not declared in this file, but in one that it extends: {schema.studio.file}."
            mend = f"to change it there, or to declare {header(part)} here too"
            raise SchemaError(Fault(problem, "what this project declares itself", mend, Place(str(path))))


def schema_path(table: Table) -> Path:
    """The contextdb.toml of a table: the one it was read under, else the one next to it."""
    assert table.path is not None, "a table without a file has no contextdb.toml"
    if table.schema.file is not None and _is_below(table.path, Path(table.schema.file).parent):
        return Path(table.schema.file)
    return table.path.parent / SCHEMA_FILE


# ---- what a table says, key by key


def _keys(table: Table, path: Path, only_own: bool = False) -> Keys:
    """What the table says in the file; with `only_own` of conditions those that it has, and nothing of the rest."""
    document = schema_to_dict(table.schema)
    if only_own:
        own = {c.condition.name for c in table.conditions}
        document = {"conditions": {name: part for name, part in document["conditions"].items() if name in own}}
    keys = _flat(document)
    settings = settings_to_dict(own_settings(table))
    name = _settings_name(table, path)
    if settings or only_own:
        settings = {"file": None} | settings | {"file": _file(table, path)}
    return keys | {("tables", name, key): value for key, value in settings.items()}


def own_settings(table: Table) -> TableSettings:
    """The settings of a table without those that it has from its base."""
    base = table.schema.tables.get(table.settings.base or "")
    return table.settings if base is None else without_inherited(table.settings, resolved(base, table.schema.tables))


def _settings_name(table: Table, path: Path) -> str:
    """The name of the table in the file: its own, unless that is declared for another file."""
    assert table.path is not None
    return table.settings.name if _file(table, path) in table.settings.files else table.path.stem


def _file(table: Table, path: Path) -> str:
    """The table's file as contextdb.toml has it, whatever the disk makes of its name."""
    assert table.path is not None
    folder = path.parent
    is_below = table.path.is_relative_to(folder)
    whole = table.path if is_below else real_path(table.path.parent) / table.path.name
    file = whole.relative_to(folder if is_below else real_path(folder)).as_posix()
    return next((declared for declared in table.settings.files if alike(declared) == alike(file)), file)


def _is_below(file: Path, folder: Path) -> bool:
    return file.is_relative_to(folder) or (real_path(file.parent) / file.name).is_relative_to(real_path(folder))


def _flat(document: Mapping[str, Mapping[str, Mapping[str, object]]]) -> Keys:
    return {
        (section, name, key): value
        for section, parts in document.items()
        for name, part in parts.items()
        for key, value in part.items()
    }


def _changes(before: Keys, after: Keys) -> Changes:
    """The keys that say something else now."""
    paths = dict.fromkeys((*before, *after))
    return {path: (before.get(path), after.get(path)) for path in paths if before.get(path) != after.get(path)}


# ---- what the file says


def _keys_of(schema: Schema) -> Keys:
    tables = {name: settings_to_dict(settings) for name, settings in schema.tables.items()}
    return _flat(schema_to_dict(schema) | {"tables": tables})


def _not_there_yet(wanted: Changes, theirs: Schema, path: Path) -> Changes:
    """The changes that the file does not have yet; SchemaError where somebody else changed the same key."""
    theirs_by_key = _keys_of(theirs)
    faults, changes = [], {}
    for key, (was, now) in wanted.items():
        if theirs_by_key.get(key) == now or _is_file_by_default(key, now, theirs):
            continue
        if theirs_by_key.get(key) == was:
            changes[key] = (was, now)
        else:
            faults.append(_conflict(key, theirs_by_key.get(key), now, path))
    if faults:
        raise SchemaError(*faults)
    return changes


def _is_file_by_default(key: KeyPath, file: object, theirs: Schema) -> bool:
    section, name, last = key
    if section != "tables" or last != "file" or name not in theirs.tables:
        return False
    return theirs.tables[name].file is None if file is None else file in theirs.tables[name].files


def _conflict(key: KeyPath, theirs: object, ours: object, path: Path) -> Fault:
    state = "is gone from the file" if theirs is None else f"is {_short(theirs)} in the file"
    wanted = "to be removed" if ours is None else f"to be {_short(ours)}"
    where = f"[{dotted(key[:-1])}] {key[-1]}"
    problem = f"{where} {state}, where somebody else changed it, and was {wanted} here."
    return Fault(problem, "a key that one of the two changed", "to reload the table, or to undo the change", Place(str(path)))


def _short(value: object) -> str:
    return safe_text(as_toml(value))


# ---- the text


def _edited(text: str, wanted: Changes, table: Table, name: str) -> str:
    parts: dict[KeyPath, dict[str, object]] = {}
    for key, now in _finest(wanted):
        parts.setdefault(key[:-1], {})[key[-1]] = now
    gone = [part for part, keys in parts.items() if all(now is None for now in keys.values())]
    new = {} if gone else _new_conditions(text, parts, table)  # what is gone may be what a new one was called
    if new:
        text = toml_edit.add_sections(text, new, _behind(next(iter(new)), table, name))
    for part in [part for part in parts if part not in new and part not in gone]:
        old = next((one for one in gone if _is_renamed(wanted, one, part)), None)
        renamed = toml_edit.rename_section(text, old, part) if old is not None else None
        if old is not None and renamed is not None:
            gone.remove(old)
            text = renamed
        else:
            text = _with_keys(text, part, parts[part], _behind(part, table, name))
    for part in gone:
        text = toml_edit.drop_empty_section(_with_keys(text, part, parts[part], ()), part)
    return text


def _finest(wanted: Changes) -> Iterator[tuple[KeyPath, object]]:
    """The keys to write: of a table's key that is a table itself, such as its outputs, those in it that change."""
    for key, (was, now) in wanted.items():
        if key[0] == "tables" and isinstance(was, Mapping) and isinstance(now, Mapping):
            inner = {(*key, name): (was.get(name), now.get(name)) for name in {**was, **now}}
            yield from _finest({path: pair for path, pair in inner.items() if repr(pair[0]) != repr(pair[1])})  # false is not 0
        else:
            yield key, plain_numbers(now)


def _new_conditions(text: str, parts: Mapping[KeyPath, Mapping[str, object]], table: Table) -> dict[KeyPath, dict[str, object]]:
    """The parts that are conditions of the table and of which nothing is in the text, and what their keys say."""
    own = {("conditions", c.condition.name) for c in table.conditions}
    new = toml_edit.absent(text, [part for part in parts if part in own])
    return {part: {key: now for key, now in parts[part].items() if now is not None} for part in new}


def _with_keys(text: str, part: KeyPath, keys: Mapping[str, object], behind: Sequence[KeyPath]) -> str:
    for key, now in keys.items():
        path = (*part, key)
        if now is None and key == "policy" and toml_edit.has_comment(text, path):
            text = toml_edit.set_key(text, path, TableSettings("").policy)  # its comment stays
        else:
            text = toml_edit.drop_key(text, path) if now is None else toml_edit.set_key(text, path, now, behind)
    return text


def _is_renamed(wanted: Changes, old: KeyPath, new: KeyPath) -> bool:
    """Whether all that one part said is now said by another, which said nothing."""
    before = {key[-1]: was for key, (was, _) in wanted.items() if key[:-1] == old}
    after = {key[-1]: now for key, (_, now) in wanted.items() if key[:-1] == new}
    is_new = all(was is None for key, (was, _) in wanted.items() if key[:-1] == new)
    return old[0] == new[0] == "conditions" and is_new and before == after


def _behind(part: KeyPath, table: Table, name: str) -> list[KeyPath]:
    """The sections behind which a new one is put."""
    if part[0] == "tables":
        return []
    if part[0] == "selectors":
        return [("selectors",), ("databases",)]
    return [("tables", name), *(("conditions", c.condition.name) for c in table.conditions)]


def _require_changed(text: str, wanted: Changes, theirs: Schema, path: Path) -> None:
    """Raise SchemaError unless the text says what is wanted, and all else as before."""
    now = schema_of(text.encode(), path)
    before, after = _keys_of(theirs), _keys_of(now)
    expected = {key: value for key, value in before.items() if key not in wanted}
    expected |= {key: value for key, (_, value) in wanted.items() if value is not None}
    same = ("features", "databases", "controllers", "output")
    if after != expected or any(getattr(now, section) != getattr(theirs, section) for section in same):
        keys = [f"[{dotted(key[:-1])}] {key[-1]}" for key in wanted]
        problem = f"{some(keys)} cannot be changed without changing more of the file."
        raise SchemaError(Fault(problem, "sections such as [tables.NAME]", "to change it in a text editor", Place(str(path))))
