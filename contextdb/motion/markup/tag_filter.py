"""Which tags the frames of a search must, must not or should have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from contextdb.cells.arguments import as_number
from contextdb.errors import Fault, QueryError, in_quotes
from contextdb.motion.markup.reserved import MOST_COST

Penalties: TypeAlias = Mapping[str, float] | Iterable[tuple[str, float]]


@dataclass(frozen=True, init=False)
class TagFilter:
    """Which tags the frames of a search must, must not or should have.

    Attributes
    ----------
    include : tuple of str
        A frame has at least one of these. Empty: no matter.
    every : tuple of str
        A frame has all of these.
    exclude : tuple of str
        A frame has none of these.
    prefer : tuple of (str, float)
        Soft categories: a frame without the tag costs so much more.
    avoid : tuple of (str, float)
        A frame with the tag costs so much more.

    Notes
    -----
    A tag covers those below it: `Move` covers `Move.Run`. A filter can be a key, so that its answer is computed once and cached.
    """

    include: tuple[str, ...]
    every: tuple[str, ...]
    exclude: tuple[str, ...]
    prefer: tuple[tuple[str, float], ...]
    avoid: tuple[tuple[str, float], ...]

    def __init__(
        self,
        include: str | Iterable[str] = (),
        every: str | Iterable[str] = (),
        exclude: str | Iterable[str] = (),
        prefer: Penalties = (),
        avoid: Penalties = (),
    ) -> None:
        """Take tags as one name or several, penalties as a mapping from tag to cost: `TagFilter("Move", prefer={"HipFire": 5.0})`.
        Raises QueryError for a tag that is not text, or a penalty that is not a number from 0 to 1e30; all faults together."""
        faults: list[Fault] = []
        for field, names in (("include", include), ("every", every), ("exclude", exclude)):
            object.__setattr__(self, field, _names(field, names, faults))
        for field, costs, other in (("prefer", prefer, "avoid"), ("avoid", avoid, "prefer")):
            object.__setattr__(self, field, _penalties(field, costs, other, faults))
        if faults:
            raise QueryError(*faults)

    @property
    def names(self) -> tuple[str, ...]:
        """Every tag that the filter names, once."""
        soft = (tag for tag, _ in (*self.prefer, *self.avoid))
        return tuple(dict.fromkeys((*self.include, *self.every, *self.exclude, *soft)))

    @property
    def text(self) -> str:
        """The filter in words; "any" when it asks nothing."""
        parts = [
            f"include {' or '.join(self.include)}" if self.include else "",
            f"every {' and '.join(self.every)}" if self.every else "",
            f"exclude {' or '.join(self.exclude)}" if self.exclude else "",
            *(f"prefer {tag} ~{cost:g}" for tag, cost in self.prefer),
            *(f"avoid {tag} ~{cost:g}" for tag, cost in self.avoid),
        ]
        return "; ".join(part for part in parts if part) or "any"


def _names(field: str, names: object, faults: list[Fault]) -> tuple[str, ...]:
    """Names as a tuple, each once; one name alone is a tuple of one."""
    listed: list[Any] = [names] if isinstance(names, str) or not isinstance(names, Iterable) else list(names)
    if all(isinstance(name, str) and name for name in listed):
        return tuple(dict.fromkeys(listed))
    wrong = next(name for name in listed if not isinstance(name, str) or not name)
    faults.append(Fault(f"{field} holds {wrong!r}.", "names of tags"))
    return ()


def _penalties(field: str, costs: object, other: str, faults: list[Fault]) -> tuple[tuple[str, float], ...]:
    """Tags with their costs, in the order of the tags, so that equal penalties are equal filters."""
    pairs = list(costs.items() if isinstance(costs, Mapping) else costs) if isinstance(costs, Iterable) else None
    if pairs is None or isinstance(costs, str) or not all(isinstance(pair, tuple) and len(pair) == 2 for pair in pairs):
        faults.append(Fault(f"{field} is {costs!r}.", 'a cost for each tag, such as {"HipFire": 5.0}'))
        return ()
    _names(field, [tag for tag, _ in pairs], faults)
    for tag, cost in pairs:
        fault = _penalty_fault(f"{field}[{in_quotes(str(tag))}]", tag, cost, other)
        if fault:
            faults.append(fault)
    return () if faults else tuple(sorted((tag, float(cost)) for tag, cost in dict(pairs).items()))


def _penalty_fault(what: str, tag: object, cost: object, other: str) -> Fault | None:
    number = as_number(cost)
    if number is not None and 0.0 <= number <= MOST_COST:
        return None
    accepted = f"a cost from 0 to {MOST_COST:g}"
    if number is not None and -MOST_COST <= number < 0.0:
        return Fault(f"{what} is {number:g}: a penalty below 0.", accepted, f"{other}={{{in_quotes(str(tag))}: {-number:g}}}")
    return Fault(f"{what} is {cost!r}.", accepted, "exclude or every, which rule frames out" if number is not None else "")


ANY_TAGS = TagFilter()


def covers(tag: str, other: str) -> bool:
    """Whether a tag is another or is above it: `Move` covers `Move.Run`."""
    return other == tag or other.startswith(f"{tag}.")


def tags_of(names: str | Iterable[str] | TagFilter) -> TagFilter:
    """A filter from one, or from the tags of which a frame has at least one."""
    return names if isinstance(names, TagFilter) else TagFilter(include=names)
