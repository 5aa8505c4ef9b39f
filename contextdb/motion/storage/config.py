"""What contextdb.toml says of motion: feature schemas, databases, selectors and controllers, and how they are built from a folder.

    [features.NAME]     what a search compares
    [databases.NAME]    which clips, by which features; `table` names the table whose assets it holds
    [selectors.NAME]    databases in order: all but the last with the threshold under which they win outright
    [controllers.NAME]  a selector, and how often and how a character may jump with it
    [output.NAME]       how what the controller of that name decides becomes poses

Reading touches no file; only `load_clips` and what builds do.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TypedDict, TypeVar, Unpack

from contextdb.cells.arguments import require_mapping, require_text
from contextdb.cells.notebook import one_line
from contextdb.errors import (
    ClipError,
    Fault,
    FileError,
    MotionError,
    Place,
    SchemaError,
    in_quotes,
    mend_for,
    plural,
    safe_text,
    some,
)
from contextdb.files.settings import Section, Setting
from contextdb.files.toml_shapes import Mapped, as_toml, between, filled, listed, nothing, one_of, what
from contextdb.motion.clips.clip import Clip
from contextdb.motion.features.schema import CustomFunction, FeatureSchema
from contextdb.motion.joint.database import JointDatabase
from contextdb.motion.joint.searcher import JointSearcher
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.controller import Clock, Controller
from contextdb.motion.selection.controller_settings import ControllerSettings, read_controllers
from contextdb.motion.selection.decision import Recorder
from contextdb.motion.selection.selector import Entry, Selector
from contextdb.motion.selection.variation import Rng
from contextdb.motion.storage.clip_files import clip_files, read_clip
from contextdb.motion.storage.database_settings import DatabaseSettings, read_databases

__all__ = ["DatabaseSettings", "MotionConfig", "SelectorSettings"]

SECTIONS = ("features", "databases", "selectors", "controllers", "output")
SELECTOR = {
    "order": Setting(
        listed('databases in order, such as [{ database = "jog_tired", threshold = 0.1 }, { database = "jog" }]', nothing),
        "Databases in order.",
        more="Each wins outright under its `threshold`, a [cost](choosing.md#the-scale-of-costs), and the last has none.",
    )
}
"""The keys of `[selectors.NAME]`."""
A_THRESHOLD = between("a cost", such_as=0.1)
STEP = {
    "database": Setting(filled("the name of a database"), "The name of a database."),
    "threshold": Setting(
        A_THRESHOLD, "Under it this database wins outright, before those behind it.", None, without="on the last alone"
    ),
}
"""The keys of one entry of `order`."""
JOINTLY = "motion.JointSearcher in Python, for databases with roles"

Part = TypeVar("Part")


@dataclass(frozen=True)
class SelectorSettings:
    """What `[selectors.NAME]` says: the databases in order, each with its threshold; the last has none."""

    name: str
    order: tuple[tuple[str, float | None], ...]


@dataclass(frozen=True)
class MotionConfig:
    """The sections `features`, `databases`, `selectors`, `controllers` and `output` of a contextdb.toml.

    A controller is the name of its selector and its settings. `joint_clips` are, of controllers that have any, the names
    of selectors and databases of joint clips that their characters may be cast for.
    """

    features: Mapping[str, FeatureSchema] = field(default_factory=dict)
    databases: Mapping[str, DatabaseSettings] = field(default_factory=dict)
    selectors: Mapping[str, SelectorSettings] = field(default_factory=dict)
    controllers: Mapping[str, tuple[str, ControllerSettings]] = field(default_factory=dict)
    output: Mapping[str, PoseSettings] = field(default_factory=dict)
    file: str | None = None
    joint_clips: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def __repr__(self) -> str:
        sections = ("schema", self.features), ("database", self.databases), ("selector", self.selectors)
        counts = [plural(len(own), noun) for noun, own in (*sections, ("controller", self.controllers))]
        return one_line("MotionConfig", "", ", ".join(counts))

    @classmethod
    def from_dict(cls, mapping: Mapped, *, tables: Collection[str] | None = None, file: str | None = None) -> MotionConfig:
        """Read the five sections; other keys of `mapping` are passed over.

        The sections are those of contextdb.toml, `{"features": {...}, "databases": {...}, "selectors": {...}, "controllers": {...},
        "output": {...}}`; each may be absent. `Schema.motion` is such a mapping. `tables` are the names of the tables there are
        (None: any name is accepted), `file` is the name of the file in messages. Raises SchemaError with every fault of all
        sections.
        """
        faults: list[Fault] = []
        require_mapping(mapping, "mapping", 'a mapping such as {"features": {...}, "databases": {...}}')
        parts = {section: _named_parts(mapping, section, faults, file) for section in SECTIONS}
        schemas = _collected(parts["features"], partial(FeatureSchema.from_dict, file=file), faults)
        databases = {
            settings.name: settings
            for settings in read_databases(parts["databases"], parts["features"], schemas, tables, faults, file)
        }
        selectors = dict(_read_selectors(parts, faults, file))
        known = list(read_controllers(parts["controllers"], parts["selectors"], faults, file))
        controllers = {name: (selector, settings) for name, selector, _, settings in known}
        joint = {name: names for name, _, names, _ in known if names}
        faults += _joint_faults(joint, databases, selectors, file)
        output = _collected(parts["output"], lambda name, part: PoseSettings.from_dict(part, name=name, file=file), faults)
        if faults:
            raise SchemaError(*faults)
        return cls(schemas, databases, selectors, controllers, output, file, joint)

    def database(self, name: str) -> DatabaseSettings:
        """The settings of the database of a name; an unknown name raises SchemaError with the nearest."""
        return _known("databases", name, self.databases, self.file)

    def load_clips(self, name: str, folder: str | Path, assets: Collection[str] | None = None) -> list[Clip]:
        """Read the clips of a database on its rig, in the order of their names.

        `folder` is that of contextdb.toml. With `assets`, clips of these names alone are read; an asset without a clip is not
        missed.
        """
        settings = self.database(name)
        files = clip_files(settings, self.features[settings.features], Path(folder), assets, self.file)
        clips: list[Clip] = []
        faults: list[Fault] = []
        for each in files:
            try:
                clips.append(read_clip(each))
            except (MotionError, FileError) as error:
                faults.extend(error.faults)
        if faults:
            raise ClipError(*faults)
        return clips

    def with_functions(self, functions: Mapping[str, CustomFunction]) -> MotionConfig:
        """The same with functions for custom channels, by the names that the channels of any schema give. Raises SchemaError where
        no channel asks for a name."""
        wanted = {name: {channel.function for channel in schema.channels} for name, schema in self.features.items()}
        every = {function for names in wanted.values() for function in names if function is not None}
        for unknown in (function for function in functions if function not in every):
            problem = f"no channel has function = {in_quotes(unknown)}."
            raise SchemaError(Fault(problem, some(sorted(every)), mend_for(unknown, every), Place(self.file)))
        given = {
            name: schema.with_functions({each: functions[each] for each in functions if each in wanted[name]})
            for name, schema in self.features.items()
        }
        return replace(self, features=given)

    def selector(self, name: str, databases: Mapping[str, MotionDatabase]) -> Selector:
        """The selector of a name over built databases; one that is not among them counts as not loaded.

        Raises SchemaError for an unknown name, and for one of joint databases, which `joint_searcher` takes.
        """
        settings = _known("selectors", name, self.selectors, self.file)
        for database, _ in settings.order:
            if self.databases[database].roles:
                problem = f"[selectors.{name}] has the database {in_quotes(database)} of clips that are cast and chosen together."
                raise SchemaError(Fault(problem, JOINTLY, place=Place(self.file)))
        return Selector([Entry(database, databases.get(database), threshold) for database, threshold in settings.order])

    def joint_databases_of(self, controller: str) -> list[str]:
        """The databases of the joint clips that the characters of a controller may be cast for, each once. Raises SchemaError for
        an unknown one."""
        _known("controllers", controller, self.controllers, self.file)
        names = [each for name in self.joint_clips.get(controller, ()) for each in self._ordered(name)]
        return list(dict.fromkeys(names))

    def played_by(self, controller: str) -> list[str]:
        """The databases whose poses the characters of a controller have: those of its selector and of its joint clips."""
        return [*self.databases_of(self.selector_of(controller)), *self.joint_databases_of(controller)]

    def _ordered(self, name: str) -> list[str]:
        """The databases of a selector, in order, or the one of that name."""
        return [name] if name not in self.selectors else self.databases_of(name)

    def joint(self, name: str, database: MotionDatabase) -> JointDatabase:
        """The joint clips of a built database whose settings name roles; see `JointDatabase.of` for what it raises."""
        settings = self.database(name)
        weights = {"place_weight": settings.place_weight, "facing_weight": settings.facing_weight}
        if not settings.roles:
            raise SchemaError(Fault(f"[databases.{name}] has no roles.", 'roles = ["Tackler", "Carrier"]', place=Place(self.file)))
        return JointDatabase.of(database, settings.roles, **weights)

    def joint_searcher(self, name: str, databases: Mapping[str, MotionDatabase]) -> JointSearcher:
        """The searcher of the selector of a name over built databases, or of the one database of that name; databases that are not
        loaded are passed over."""
        if name in self.databases and name not in self.selectors:
            order: Sequence[tuple[str, float | None]] = [(name, None)]
        else:
            order = _known("selectors", name, self.selectors, self.file).order
        joint = {each: self.joint(each, databases[each]) for each, _ in order if each in databases}
        return JointSearcher(joint, {each: limit for each, limit in order if limit is not None and each in joint})

    def databases_of(self, selector: str) -> list[str]:
        """The databases of the selector of a name, in order."""
        return [database for database, _ in _known("selectors", selector, self.selectors, self.file).order]

    def selector_of(self, controller: str) -> str:
        """The selector of the controller of a name."""
        return _known("controllers", controller, self.controllers, self.file)[0]

    def output_of(self, controller: str) -> PoseSettings:
        """The settings of `[output.NAME]` for the controller of a name; the default ones where there is no such section."""
        return self.output.get(controller, PoseSettings())

    def controller(self, name: str, databases: Mapping[str, MotionDatabase], **options: Unpack[ControllerOptions]) -> Controller:
        """The controller of a name over built databases; `recorder`, `rng` and `clock` are those of `Controller`."""
        selector, settings = _known("controllers", name, self.controllers, self.file)
        return Controller(self.selector(selector, databases), settings, **options)


class ControllerOptions(TypedDict, total=False):
    """What a controller is given next to its selector and settings."""

    recorder: Recorder | None
    rng: Rng | int | None
    clock: Clock | None


def _known(section: str, name: str, parts: Mapping[str, Part], file: str | None) -> Part:
    """The part of a name, or a SchemaError with the nearest name."""
    if require_text(name, "name") not in parts:
        raise SchemaError(Fault(f"there is no [{section}.{name}].", some(parts), mend_for(name, parts), Place(file)))
    return parts[name]


def _named_parts(mapping: Mapped, section: str, faults: list[Fault], file: str | None) -> dict[str, Mapped]:
    """The tables [section.NAME] of a section; what is not a table leaves a fault."""
    whole = mapping.get(section, {})
    parts = whole if isinstance(whole, Mapping) else {}
    if not isinstance(whole, Mapping):
        faults.append(Fault(f"{section} is {what(whole)}, not a table.", f"[{section}.NAME] and its keys", place=Place(file)))
    for name, part in parts.items():
        if not isinstance(part, Mapping):
            found = f"{section}.{name} = {safe_text(as_toml(part))}: this is {what(part)}, not a table."
            faults.append(Fault(found, f"[{section}.{name}] and its keys", place=Place(file)))
    return {name: part for name, part in parts.items() if isinstance(part, Mapping)}


def _collected(parts: Mapping[str, Mapped], read: Callable[[str, Mapped], Part], faults: list[Fault]) -> dict[str, Part]:
    """What each part reads as; the faults of those that do not are collected."""
    values = {}
    for name, part in parts.items():
        try:
            values[name] = read(name, part)
        except SchemaError as error:
            faults.extend(error.faults)
    return values


def _joint_faults(
    joint: Mapping[str, Sequence[str]],
    databases: Mapping[str, DatabaseSettings],
    selectors: Mapping[str, SelectorSettings],
    file: str | None,
) -> Iterator[Fault]:
    """The names of joint clips that are none: of no selector and no database, or of databases without roles."""
    orders = {name: [name] for name in databases} | {name: [each for each, _ in own.order] for name, own in selectors.items()}
    known = [name for name, order in orders.items() if all(each in databases and databases[each].roles for each in order)]
    for controller, names in joint.items():
        where, place = f"[controllers.{controller}]", Place(file)
        for name in names:
            order = orders.get(name, [name])
            if any(each not in databases for each in order):
                problem = f"{where} joint: there is no selector and no database {in_quotes(name)}."
                yield Fault(problem, some(known) or "none: no database has roles", mend_for(name, known), place)
            elif without := [each for each in order if not databases[each].roles]:
                problem = f"{where} joint: [databases.{without[0]}] has no roles."
                yield Fault(problem, 'roles = ["Tackler", "Carrier"] in it', place=place)


def _read_selectors(
    parts: Mapping[str, Mapping[str, Mapped]], faults: list[Fault], file: str | None
) -> Iterator[tuple[str, SelectorSettings]]:
    for name, part in parts["selectors"].items():
        n_faults = len(faults)
        section = Section(f"[selectors.{name}]", part, SELECTOR, faults, file)
        steps = section.values(SELECTOR).get("order", ())
        order = [_read_step(section, i, step, len(steps), list(parts["databases"])) for i, step in enumerate(steps)]
        _check_once(section, [database for database, _ in order])
        _check_one_schema(section, [database for database, _ in order], parts["databases"])
        if len(faults) == n_faults:
            yield name, SelectorSettings(name, tuple((database, cost) for database, cost in order if database is not None))


def _read_step(section: Section, i: int, step: object, n_steps: int, known: list[str]) -> tuple[str | None, float | None]:
    if not isinstance(step, Mapping):
        section.add(
            f"{section.where} order {i + 1} is {safe_text(as_toml(step))}: this is {what(step)}, not a table.",
            '{ database = "jog" }',
        )
        return None, None
    part, is_last = section.inside(f"order {i + 1}", step, STEP), i == n_steps - 1
    values = part.values(STEP, database=one_of(known, "database"))
    if is_last and "threshold" in step:
        part.wrong("threshold", "nothing follows that it could spare a search", "no threshold on the last database")
    elif not is_last and "threshold" not in step:
        about = STEP["threshold"].about
        part.add(f'{part.where} has no "threshold".', f"{A_THRESHOLD.accepted}: {about[0].lower()}{about[1:-1]}")
    return values.get("database"), values.get("threshold")


def _check_once(section: Section, databases: list[str | None]) -> None:
    for database in dict.fromkeys(databases):
        if database is not None and databases.count(database) > 1:
            section.add(f"{section.where} names the database {in_quotes(database)} {databases.count(database)} times.", "each once")


def _check_one_schema(section: Section, databases: list[str | None], parts: Mapping[str, Mapped]) -> None:
    """Costs can be compared when they come from one feature schema."""
    schemas = {name: parts[name].get("features") for name in databases if name is not None}
    if len(set(map(as_toml, schemas.values()))) > 1:
        schemas_text = ", ".join(f"{in_quotes(name)} {safe_text(as_toml(schema))}" for name, schema in schemas.items())
        section.add(
            f"{section.where} has databases of different features: {schemas_text}.",
            "one feature schema, so that costs can be compared",
        )
