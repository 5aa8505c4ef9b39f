"""The pages of all public names: signature with types, docstring, and the first lines of the pages that use the name."""

from __future__ import annotations

import ast
import dataclasses
import enum
import functools
import inspect
import re
import textwrap
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import contextdb
from contextdb import motion, telemetry

DOCS = Path(__file__).parent.parent
MODULES: dict[str, ModuleType] = {"contextdb": contextdb, "motion": motion, "telemetry": telemetry}
ROOMS = {
    "characters": "Characters",
    "clips": "Clips",
    "features": "Features",
    "storage": "Databases and settings",
    "search": "The search",
    "selection": "What plays: selectors and controllers",
    "nodes": "What plays once",
    "joint": "Several characters",
    "markup": "Marks of clips",
    "preparing": "Marks of clips",
    "output": "Poses",
    "trace": "Sessions",
    "measuring": "Measures",
    "made": "Clips made by formulas",
}
"""The topics of motion, by the package that a name comes from; those of one topic are beside each other."""
API = (DOCS / "api.md").read_text(encoding="utf-8")
_HEADINGS = re.compile(r"(?m)^## (.+)$")
SPELT = {"cdb": "contextdb", "motion": "motion", "telemetry": "telemetry"}
"""What the pages call each module."""
WIDTH = 100
MODULE = re.compile(r"\b(?:[a-z_]+\.)+(?=[A-Z])")
"""What stands before the name of a type: `collections.abc.Mapping`."""
SECTION = re.compile(r"(?m)^(\w+)\n-{3,}\n")
"""The heading of a section of a docstring, with a line below it; names follow, and what they mean, indented."""
ITEM = re.compile(r"(?m)^(\S.*)\n?((?:^(?: .*)?(?:\n|\Z))*)")


@dataclasses.dataclass(frozen=True)
class Name:
    """A public name: a class, a function, a constant, or what a class has."""

    path: str
    """As it is written: `Table.compile`."""
    value: object
    about: str
    is_member: bool = False


def page(where: str) -> str:
    """The page of a module, in Markdown."""
    about = "Every public name, with its types, what it does, and a line that uses it; the [overview](api.md) groups them by use."
    parts = [f"# All names of {where}\n\n{about}\n"]
    known = list(names_of(where))
    for topic, names in topics(where).items():
        parts.append(f"## {topic}\n")
        parts += [_section(where, each) for name in names for each in known if each.path.partition(".")[0] == name]
    return "\n".join(parts)


def topics(where: str) -> dict[str, list[str]]:
    """The names of a module by what they are for: as docs/api.md groups them, those of motion by the room they come from."""
    names = sorted(set(MODULES[where].__all__) - set(MODULES), key=str.lower)
    found: dict[str, list[str]] = {}
    for name in names:
        found.setdefault(_room(where, name) if where == "motion" else _heading(name), []).append(name)
    order = list(ROOMS.values()) if where == "motion" else _HEADINGS.findall(API)
    return {topic: found[topic] for topic in sorted(found, key=lambda topic: order.index(topic) if topic in order else len(order))}


def _heading(name: str) -> str:
    """The first section of docs/api.md whose lists have a name."""
    parts = _HEADINGS.split(API)
    listed = re.compile(rf"(?m)^- (?:(?!: ).)*`{name}\b")
    return next((heading for heading, text in zip(parts[1::2], parts[2::2], strict=True) if listed.search(text)), "More")


def _room(where: str, name: str) -> str:
    parts = getattr(getattr(MODULES[where], name), "__module__", "").split(".")
    return ROOMS.get(parts[2] if len(parts) > 2 else "", "More")


def names_of(where: str) -> Iterator[Name]:
    """All names of a module, each class before what it has."""
    module = MODULES[where]
    for name in sorted(set(module.__all__) - set(MODULES), key=str.lower):
        value = getattr(module, name)
        yield Name(name, value, _about(value))
        if isinstance(value, type):
            yield from _members(name, value)


def _members(owner: str, kind: type) -> Iterator[Name]:
    """What a class of ours has and does, that which it inherits from another first."""
    found: dict[str, Name] = {}
    for each in reversed(kind.__mro__):
        if not each.__module__.startswith("contextdb"):
            continue
        for name, value in vars(each).items():
            called = getattr(value, "__func__", value)
            is_ours = isinstance(called, (property, functools.cached_property)) or inspect.isfunction(called)
            if is_ours and not name.startswith("_"):
                found[name] = Name(f"{owner}.{name}", value, inspect.getdoc(getattr(kind, name)) or "", is_member=True)
    yield from found.values()


def _about(value: object) -> str:
    """What an object says of itself; a value says only what its type is."""
    if isinstance(value, type) or inspect.isroutine(value):
        return inspect.getdoc(value) or ""
    return ""


def _section(where: str, name: Name) -> str:
    level = "####" if name.is_member else "###"
    parts = [f"{level} {name.path}", f"```py\n{signature(name)}\n```", _markdown(name.about), *_shown(where, name)]
    return "\n\n".join(part for part in parts if part) + "\n"


def signature(name: Name) -> str:
    """The name with the types of what it takes and gives, as Python writes it."""
    value = name.value
    if isinstance(value, (property, functools.cached_property)):
        getter = value.fget if isinstance(value, property) else value.func
        return f"{name.path}: {_type(inspect.signature(getter).return_annotation)}"
    if isinstance(value, type) and issubclass(value, BaseException):
        return f"class {name.path}({value.__mro__[1].__name__})"
    if isinstance(value, type) and issubclass(value, enum.Enum):
        members = [f"    {member.name} = {member.value!r}" for member in value]
        return "\n".join([f"class {name.path}({value.__mro__[1].__name__}):", *members])
    if isinstance(value, type) or inspect.isroutine(value) or isinstance(value, (classmethod, staticmethod)):
        return _call(name)
    return f"{name.path} = {textwrap.shorten(re.sub(MODULE, '', repr(value)), WIDTH)}"


def _call(name: Name) -> str:
    value = getattr(name.value, "__func__", name.value)
    try:
        found = inspect.signature(value)
    except ValueError:
        return name.path
    hidden = [p.name for p in found.parameters.values() if p.name.startswith("_") or p.annotation == "Never"]
    parameters = [p for p in found.parameters.values() if p.name not in ("self", "cls", *hidden)]
    parts, is_keyword = [], False
    for p in parameters:
        if p.kind is p.KEYWORD_ONLY and not is_keyword:
            parts.append("*")
        is_keyword = is_keyword or p.kind in (p.KEYWORD_ONLY, p.VAR_POSITIONAL)
        star = {p.VAR_POSITIONAL: "*", p.VAR_KEYWORD: "**"}.get(p.kind, "")
        default = "" if p.default is p.empty else f" = {_default(p.default)}"
        parts.append(f"{star}{p.name}{_typed(p.annotation)}{default}")
    result = "" if isinstance(value, type) or found.return_annotation is found.empty else f" -> {_type(found.return_annotation)}"
    kind = "class " if isinstance(value, type) else ""
    if kind and not parts:
        return f"{kind}{name.path}"  # made by others
    line = f"{kind}{name.path}({', '.join(parts)}){result}"
    if len(line) <= WIDTH:
        return line
    return "\n".join([f"{kind}{name.path}(", *(f"    {part}," for part in parts), f"){result}"])


def _typed(annotation: object) -> str:
    return "" if annotation is inspect.Parameter.empty else f": {_type(annotation)}"


def _type(annotation: object) -> str:
    return annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))


def _default(value: object) -> str:
    return repr(value) if value is None or isinstance(value, (bool, int, float, str)) or value == () else "..."


def _markdown(text: str) -> str:
    """A docstring, with its sections as lists."""
    about, *sections = SECTION.split(text)
    parts = [about.strip()]
    for heading, body in zip(sections[::2], sections[1::2], strict=True):
        parts += [f"**{heading}**", "\n".join(_item(name, said) for name, said in ITEM.findall(body))]
    return "\n\n".join(parts)


def _item(name: str, said: str) -> str:
    """A name and what it means; a line with nothing indented below it is a sentence, unless it declares a name."""
    if said.strip():
        return f"- `{name}`: {' '.join(said.split())}"
    return f"- `{name}`" if " : " in name or " " not in name else f"\n{name}"


# ---- where a name is used, in what the tests of the pages run


def _shown(where: str, name: Name) -> list[str]:
    is_method = name.is_member and not isinstance(name.value, (property, functools.cached_property))
    found = uses().get(name.path.rpartition(".")[2] if is_method else f"{where}.{name.path}")
    return [f"In [{found[0]}]({found[0]}.md):", f"```py\n{found[1]}\n```"] if found else []


@functools.cache
def uses() -> dict[str, tuple[str, str]]:
    """The page and the first statement that use a name: `motion.Character` or, for a method that one class has, `with_cell`."""
    owners = Counter(name.path.rpartition(".")[2] for where in MODULES for name in names_of(where) if name.is_member)
    found: dict[str, tuple[str, str]] = {}
    for page in ("recipes", *(path.stem for path in sorted(DOCS.glob("*.md")))):
        for source in re.findall(r"(?ms)^```python\n(.*?)^```", (DOCS / f"{page}.md").read_text(encoding="utf-8")):
            for statement in _statements(ast.parse(source)):
                for used in _names_in(statement):
                    if "." in used or owners[used] == 1:
                        found.setdefault(used, (page, ast.get_source_segment(source, statement) or ""))
    return found


def _statements(tree: ast.Module) -> Iterator[ast.stmt]:
    """The statements that hold no others."""
    yield from (each for each in ast.walk(tree) if isinstance(each, (ast.Assign, ast.Expr, ast.AugAssign, ast.AnnAssign)))


def _names_in(statement: ast.stmt) -> Iterator[str]:
    """The names of ours in a statement, and the methods that it calls."""
    called = {each.func for each in ast.walk(statement) if isinstance(each, ast.Call)}
    for each in ast.walk(statement):
        if isinstance(each, ast.Attribute):
            owner = each.value.id if isinstance(each.value, ast.Name) else ""
            if owner in SPELT:
                yield f"{SPELT[owner]}.{each.attr}"
            elif each in called:
                yield each.attr
