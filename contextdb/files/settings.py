"""Settings: each is declared once, with what it accepts, what it does and its default.

    @dataclass(frozen=True)
    class PoseSettings(Declared, error=MotionError):
        halflife_s: float = number("The half-life of the spring.", 0.1, 0.001, 60.0, "seconds")

From the declarations come the reader of contextdb.toml (`Section.values`), the check of what Python gives, the text of
`help`, the editor's Options, and the tables of docs/format.md (`docs/settings.py`). Where what is read is not one
dataclass, a mapping of keys to `Setting` declares them.

A `Section` keeps the faults of what it reads, so that the caller reads on, and raises once at the end with every fault.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from typing import Any, ClassVar

from contextdb.errors import ContextDBError, Fault, Place, in_quotes, nearest
from contextdb.files.toml_shapes import FLAG, MOST, Mapped, Shape, as_toml, between, key_value, no_key, one_of

Settings = Mapping[str, "Setting"]
REQUIRED: Any = object()
"""The default of a setting that has to be given."""


@dataclass(frozen=True)
class Setting:
    """One setting."""

    shape: Shape
    about: str
    """What it does, in a sentence."""
    default: object = REQUIRED
    more: str = ""
    """What docs/format.md says besides, in Markdown."""
    without: str = ""
    """What holds without it, where the default does not tell."""
    label: str = ""
    """Its name in the editor's Options, which has those with a name."""
    hint: str = ""
    """What the editor says of it instead of `about`."""
    types: tuple[str, ...] = ()
    """The types of what it is a setting of that have it; none: all have."""
    is_needed: bool = False
    """Whether contextdb.toml has to give it, though Python need not."""
    in_python: Shape | None = None
    """What Python may give, where that is more."""

    @property
    def is_required(self) -> bool:
        return self.is_needed or self.default is REQUIRED

    @property
    def summary(self) -> str:
        """What `help` says of it."""
        return f"{self.about} Required." if self.is_required else f"{self.about} Default: {self.usual}."

    @property
    def meaning(self) -> str:
        """What the editor says of it."""
        return self.hint or self.about

    def has_place(self, kind: object) -> bool:
        """Whether a type has it."""
        return not self.types or kind in self.types

    @property
    def usual(self) -> str:
        """What holds where it is not given."""
        return self.without or ("required" if self.is_required else as_toml(self.default))


def setting(shape: Shape, about: str, default: Any = REQUIRED, **more: Any) -> Any:
    """A field of a dataclass that declares a setting; `more` are further fields of `Setting`."""
    given: Any = {} if default is REQUIRED else {"default_factory": dict} if default == {} else {"default": default}
    return field(metadata={"setting": Setting(shape, about, default, **more)}, **given)


def number(
    about: str,
    default: Any = REQUIRED,
    least: float = -MOST,
    most: float = MOST,
    unit: str = "a number",
    such_as: float | None = None,
    note: str = "",
    *,
    is_whole: bool = False,
    **more: Any,
) -> Any:
    """A field for a number; the example in messages is the default where none is given."""
    example = default if such_as is None and isinstance(default, (int, float)) else such_as
    return setting(between(unit, least, most, example, note, is_whole=is_whole), about, default, **more)


def flag(about: str, default: bool, **more: Any) -> Any:
    """A field for true or false."""
    return setting(FLAG, about, default, **more)


def word(
    words: Sequence[str],
    about: str,
    default: Any = REQUIRED,
    noun: str = "word",
    synonyms: Mapping[str, str] | None = None,
    **more: Any,
) -> Any:
    """A field for one of some words."""
    return setting(one_of(words, noun, synonyms), about, default, **more)


def settings_of(declared: type) -> Settings:
    """The settings that a dataclass declares."""
    return {each.name: each.metadata["setting"] for each in fields(declared) if "setting" in each.metadata}


def settings_with(settings: Settings, kind: str) -> Settings:
    """The settings that a type has."""
    return {key: each for key, each in settings.items() if each.has_place(kind)}


class Declared:
    """A dataclass whose fields declare settings. Its docstring lists them. When one is made they are checked, and kept as
    contextdb.toml would give them: 1 as 1.0, a list as a tuple."""

    __slots__ = ()
    _error: ClassVar[type[ContextDBError]]

    def __init_subclass__(cls, error: type[ContextDBError] | None = None) -> None:
        if error is not None:  # else it is made again, with slots
            given = {key: each.metadata["setting"] for key, each in vars(cls).items() if isinstance(each, Field) and each.metadata}
            lines = (f"    {key}\n        {each.summary}" for key, each in given.items())
            cls._error, cls.__doc__ = (
                error,
                f"{(cls.__doc__ or '').rstrip()}\n\n    Attributes\n    ----------\n" + "\n".join(lines),
            )

    def __post_init__(self) -> None:
        faults = []
        for key, each in settings_of(type(self)).items():
            value = getattr(self, key)
            if type(value) is type(each.default) and value == each.default:
                continue
            shape = each.in_python or each.shape
            if fault := shape.fault("", key, value):
                faults.append(fault)
            else:
                object.__setattr__(self, key, shape.read(value))
        if faults:
            raise self._error(*faults)


class Section:
    """One section, or one table inside it, being read."""

    def __init__(self, where: str, part: Mapped, keys: Collection[str], faults: list[Fault], file: str | None = None) -> None:
        self.where = where
        self.part = part
        self.faults = faults
        self.file = file
        self._keep(*(no_key(where, key, keys, nearest(str(key), keys)) for key in part if key not in keys))

    def inside(self, where: str, part: Mapped, keys: Collection[str]) -> Section:
        """A table inside it, which is named by `where`."""
        return Section(f"{self.where} {where}", part, keys, self.faults, self.file)

    def values(self, settings: Settings, **shapes: Shape) -> dict[str, Any]:
        """The values of settings that are given and accepted; `shapes` are those that other sections decide about."""
        values = {}
        for key, each in settings.items():
            shape = shapes.get(key, each.shape)
            if key not in self.part:
                if each.is_required:
                    self.add(f"{self.where} has no {in_quotes(key)}.", shape.accepted)
            elif fault := shape.fault(self.where, key, self.part[key]):
                self._keep(fault)
            else:
                values[key] = shape.read(self.part[key])
        return values

    def add(self, problem: str, accepted: str = "", mend: str = "") -> None:
        self._keep(Fault(problem, accepted, mend))

    def wrong(self, key: str, why: str, accepted: str, mend: str = "") -> None:
        """Keep a fault of a key's value."""
        self.add(f"{self.where} {key_value(key, self.part.get(key))}: {why}.", accepted, mend)

    def _keep(self, *faults: Fault) -> None:
        self.faults.extend(fault.at(Place(self.file)) for fault in faults)
