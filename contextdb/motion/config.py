"""What contextdb.toml says of motion: feature schemas, databases and selectors, and how they are built from a folder.

    [features.NAME]     what a search compares
    [databases.NAME]    which clips, by which features; `table` names the table whose assets it holds
    [selectors.NAME]    databases in order: all but the last with the threshold under which they win outright

Reading touches no file; only `load_clips` and what calls it do.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath
from typing import TypeVar, cast

from contextdb.errors import Fault, MotionError, Place, SchemaError, in_quotes, nearest, some
from contextdb.motion import clips
from contextdb.motion.clips import CENTIMETRE, UPS, Clip, Up
from contextdb.motion.database import MotionDatabase, build_databases
from contextdb.motion.features import FeatureSchema
from contextdb.motion.reading import Mapped, Section, as_toml, what_is
from contextdb.motion.selector import Entry, Selector

DATABASE_KEYS = ("table", "clips", "features", "metres_per_unit", "up")
STEP_KEYS = ("database", "threshold")
MOST_COST = 1e30

Part = TypeVar("Part")


@dataclass(frozen=True)
class DatabaseSettings:
    """What `[databases.NAME]` says.

    Attributes
    ----------
    name : str
    clips : str
        A pattern of files below the folder of contextdb.toml, such as "clips/jog/*.bvh".
    features : str
        The name of a feature schema.
    table : str, optional
        The table whose assets it holds: other clips are left out. Default: all clips of the pattern.
    metres_per_unit, up
        What the clips' files leave open; see `load_bvh`.
    """

    name: str
    clips: str
    features: str
    table: str | None = None
    metres_per_unit: float = CENTIMETRE
    up: Up = "y"


@dataclass(frozen=True)
class SelectorSettings:
    """What `[selectors.NAME]` says: the databases in order, each with its threshold; the last has none."""

    name: str
    order: tuple[tuple[str, float | None], ...]


@dataclass(frozen=True)
class MotionConfig:
    """The sections `features`, `databases` and `selectors` of a contextdb.toml."""

    features: Mapping[str, FeatureSchema] = field(default_factory=dict)
    databases: Mapping[str, DatabaseSettings] = field(default_factory=dict)
    selectors: Mapping[str, SelectorSettings] = field(default_factory=dict)
    file: str | None = None

    @classmethod
    def from_dict(cls, mapping: Mapped, *, tables: Collection[str] | None = None, file: str | None = None) -> MotionConfig:
        """Read the three sections; other keys of `mapping` are passed over.

        Parameters
        ----------
        mapping : mapping
            `{"features": {...}, "databases": {...}, "selectors": {...}}`, as contextdb.toml holds them; each may be absent.
        tables : collection of str, optional
            The names of the tables there are. Default: any name is accepted.
        file : str, optional
            The name of the file in messages.

        Raises
        ------
        SchemaError
            With every fault of all sections.
        """
        faults: list[Fault] = []
        parts = {section: _named_parts(mapping, section, faults, file) for section in ("features", "databases", "selectors")}
        schemas = dict(_read_schemas(parts["features"], faults, file))
        databases = dict(_read_databases(parts, tables, faults, file))
        selectors = dict(_read_selectors(parts, faults, file))
        if faults:
            raise SchemaError(*faults)
        return cls(schemas, databases, selectors, file)

    def load_clips(self, name: str, folder: str | Path, assets: Collection[str] | None = None) -> list[Clip]:
        """Read the clips of a database, in the order of their names.

        `folder` is that of contextdb.toml. With `assets`, clips of these names alone are read; an asset without a clip is not
        missed.
        """
        settings = _known("databases", name, self.databases, self.file)
        paths = sorted(Path(folder).glob(settings.clips))
        if not paths:
            place = Place(self.file)
            raise MotionError(
                Fault(f"[databases.{name}] no file fits clips = {as_toml(settings.clips)}.", place=place, rule="file")
            )
        wanted = [path for path in paths if assets is None or path.stem in assets]
        return clips.load_clips(wanted, metres_per_unit=settings.metres_per_unit, up=settings.up)

    def build(self, folder: str | Path, assets: Mapping[str, Collection[str]] | None = None) -> dict[str, MotionDatabase]:
        """Build all databases from the clips in a folder; those of one feature schema share a normalisation.

        `assets` gives for a table's name the assets in it: a database of that table holds the clips of these alone.
        """
        built: dict[str, MotionDatabase] = {}
        for schema in self.features.values():
            members = [settings for settings in self.databases.values() if settings.features == schema.name]
            loaded = {s.name: self.load_clips(s.name, folder, (assets or {}).get(s.table or "")) for s in members}
            built.update(build_databases(loaded, schema))
        return {name: built[name] for name in self.databases}

    def selector(self, name: str, databases: Mapping[str, MotionDatabase]) -> Selector:
        """The selector of a name over built databases; one that is not among them counts as not loaded."""
        settings = _known("selectors", name, self.selectors, self.file)
        return Selector([Entry(database, databases.get(database), threshold) for database, threshold in settings.order])


def _known(section: str, name: str, parts: Mapping[str, Part], file: str | None) -> Part:
    """The part of a name, or a SchemaError with the nearest name."""
    if name not in parts:
        near = nearest(name, parts)
        found = f"there is no [{section}.{name}]."
        raise SchemaError(Fault(found, some(parts), in_quotes(near) if near else "", Place(file)))
    return parts[name]


def _named_parts(mapping: Mapped, section: str, faults: list[Fault], file: str | None) -> dict[str, Mapped]:
    """The tables [section.NAME] of a section; what is no table leaves a fault."""
    whole = mapping.get(section, {})
    parts = whole if isinstance(whole, Mapping) else {}
    if not isinstance(whole, Mapping):
        faults.append(Fault(f"{section} is {what_is(whole)}, not a table.", f"[{section}.NAME] and its keys", place=Place(file)))
    for name, part in parts.items():
        if not isinstance(part, Mapping):
            found = f"{section}.{name} = {as_toml(part)}: this is {what_is(part)}, not a table."
            faults.append(Fault(found, f"[{section}.{name}] and its keys", place=Place(file)))
    return {name: part for name, part in parts.items() if isinstance(part, Mapping)}


def _read_schemas(parts: Mapping[str, Mapped], faults: list[Fault], file: str | None) -> Iterator[tuple[str, FeatureSchema]]:
    for name, part in parts.items():
        try:
            yield name, FeatureSchema.from_dict(name, part, file=file)
        except SchemaError as error:
            faults.extend(error.faults)


def _read_databases(
    parts: Mapping[str, Mapping[str, Mapped]], tables: Collection[str] | None, faults: list[Fault], file: str | None
) -> Iterator[tuple[str, DatabaseSettings]]:
    for name, part in parts["databases"].items():
        section = Section(f"[databases.{name}]", part, DATABASE_KEYS, faults, file)
        pattern = _read_pattern(section)
        has_features = section.has("features", some(parts["features"]) or "the name of a [features.NAME]")
        features = section.one_of("features", list(parts["features"]), "feature schema") if has_features else None
        table = _read_table(section, tables) if "table" in part else None
        unit = section.number("metres_per_unit", "metres, such as 0.01", 1e-9, 1e9) if "metres_per_unit" in part else CENTIMETRE
        up = section.one_of("up", UPS, "axis") if "up" in part else "y"
        if pattern is not None and features is not None and unit is not None and up is not None:
            yield name, DatabaseSettings(name, pattern, features, table, unit, cast(Up, up))


def _read_table(section: Section, tables: Collection[str] | None) -> str | None:
    return section.text("table", "the name of a table") if tables is None else section.one_of("table", list(tables), "table")


def _read_pattern(section: Section) -> str | None:
    accepted = 'a pattern of files in the folder of contextdb.toml or below it, such as "clips/*.bvh"'
    pattern = section.text("clips", accepted) if section.has("clips", accepted) else None
    if pattern is None:
        return None
    windows = PureWindowsPath(pattern)
    if windows.drive or windows.root or ".." in windows.parts or "\\" in pattern:
        section.wrong("clips", "this leaves the folder, or is a place on one machine", accepted)
        return None
    if windows.suffix.casefold() != ".bvh":
        section.wrong("clips", "these are no BVH files", accepted)
        return None
    return pattern


def _read_selectors(
    parts: Mapping[str, Mapping[str, Mapped]], faults: list[Fault], file: str | None
) -> Iterator[tuple[str, SelectorSettings]]:
    accepted = 'databases in order, such as [{ database = "jog_tired", threshold = 2.75 }, { database = "jog" }]'
    for name, part in parts["selectors"].items():
        section = Section(f"[selectors.{name}]", part, ("order",), faults, file)
        steps = part.get("order") if section.has("order", accepted) else ()
        if not isinstance(steps, (list, tuple)) or (not steps and "order" in part):
            section.wrong("order", "this is no list, or empty", accepted)
            continue
        n_faults = len(faults)
        order = [_read_step(section, i, step, len(steps), list(parts["databases"])) for i, step in enumerate(steps)]
        _check_once(section, [database for database, _ in order])
        _check_one_schema(section, [database for database, _ in order], parts["databases"])
        if len(faults) == n_faults:
            yield (
                name,
                SelectorSettings(name, tuple((database, threshold) for database, threshold in order if database is not None)),
            )


def _read_step(section: Section, i: int, step: object, n_steps: int, known: list[str]) -> tuple[str | None, float | None]:
    where = f"{section.where} order {i + 1}"
    if not isinstance(step, Mapping):
        section.add(f"{where} is {as_toml(step)}: this is {what_is(step)}, not a table.", '{ database = "jog" }')
        return None, None
    part = Section(where, step, STEP_KEYS, section.faults, section.file)
    database = part.one_of("database", known, "database") if part.has("database", some(known) or "the name of a database") else None
    accepted = "a cost, such as 2.75"
    if "threshold" in step:
        if i == n_steps - 1:
            part.wrong("threshold", "nothing follows that it could spare a search", "no threshold on the last database")
        return database, part.number("threshold", accepted, -MOST_COST, MOST_COST)
    if i < n_steps - 1:
        part.has("threshold", f"{accepted}: under it this database wins outright, before those behind it")
    return database, None


def _check_once(section: Section, databases: list[str | None]) -> None:
    for database in dict.fromkeys(databases):
        if database is not None and databases.count(database) > 1:
            section.add(f"{section.where} names the database {in_quotes(database)} {databases.count(database)} times.", "each once")


def _check_one_schema(section: Section, databases: list[str | None], parts: Mapping[str, Mapped]) -> None:
    """Costs can be compared when they come from one feature schema."""
    schemas = {name: parts[name].get("features") for name in databases if name is not None}
    if len(set(map(as_toml, schemas.values()))) > 1:
        told = ", ".join(f"{in_quotes(name)} {as_toml(schema)}" for name, schema in schemas.items())
        section.add(
            f"{section.where} has databases of different features: {told}.", "one feature schema, so that costs can be compared"
        )
