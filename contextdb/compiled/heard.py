"""Who hears what a table is asked and what is picked of its answers, while somebody listens to the game.

While nobody listens, a table, and a live context, is the object that it always was: the plain attribute `_ask` that answers every
query is exchanged when somebody begins to listen, and put back when nobody does any more. A live context changes its class in the
same way. See `contextdb.telemetry.link`, which listens.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, Self, cast

from contextdb.cells.facts import Context
from contextdb.compiled.casting.facts import Actors
from contextdb.compiled.data import CompiledData
from contextdb.compiled.live import LiveContext
from contextdb.compiled.live_asking import AskingLiveContext
from contextdb.compiled.matches import Matches


class LiveEars(Protocol):
    """What hears of the questions of a live context, in the thread that asks."""

    def asked(self, context: Context, answer: Matches, actors: Actors | None = None) -> None:
        """Hear of a question that was answered."""
        ...


class Ears(LiveEars, Protocol):
    """What hears of the questions and the picks of a table, in the thread that asks. `asked` is for questions that are answered
    with care, or with actors."""

    def around(self, ask: Callable[[Context], Matches]) -> Callable[[Context], Matches]:
        """The function that answers the usual questions, which then tells of them too."""
        ...

    def picked(self, answer: Matches, row: int | None, asset: str | None) -> None:
        """Hear what was picked of an answer; no row where it is the fallback."""
        ...


def hear(compiled: CompiledData, ears: Ears) -> None:
    """Tell of the questions of a table, and of its picks, from now on. It must have been asked once: see `made_ready`."""
    ask = compiled._ask
    vars(compiled)["heard"] = ears
    vars(compiled)["_unheard"] = ask
    object.__setattr__(compiled, "_ask", ears.around(ask))


def unhear(compiled: CompiledData) -> None:
    """Make a table what it was before `hear`."""
    if (ask := vars(compiled).pop("_unheard", None)) is not None:
        object.__setattr__(compiled, "_ask", ask)
        vars(compiled).pop("heard", None)


def made_ready(compiled: CompiledData) -> None:
    """Have a table build what answers its queries, so that `hear` finds it."""
    compiled.query({}, unknown="any")


class _Heard:
    """What a live context does besides while somebody listens."""

    __slots__ = ()

    def matches(self) -> Matches:
        """The valid rows now."""
        live = cast(LiveContext, self)
        answer: Matches = super().matches()  # type: ignore[misc]
        cast_now = live._cast
        live._ears.asked(live._told, answer, None if cast_now is None else cast_now.ask.actors)
        return answer

    def copy(self) -> Self:
        """An independent context, which nobody hears."""
        new: Any = super().copy()  # type: ignore[misc]
        unhear_live(new)
        return cast(Self, new)

    __copy__ = copy

    def __reduce__(self) -> tuple[object, ...]:
        """What is pickled: a context that nobody hears."""
        make, (kind, *facts) = cast("tuple[Any, tuple[Any, ...]]", super().__reduce__())
        return make, (_UNHEARD[kind], *facts)


class HeardLiveContext(_Heard, LiveContext):
    """A live context while somebody listens."""

    __slots__ = ()


class HeardAskingLiveContext(_Heard, AskingLiveContext):
    """The same for a table with derived facts or rules."""

    __slots__ = ()


_HEARD: dict[type[LiveContext], type[LiveContext]] = {
    LiveContext: HeardLiveContext,
    AskingLiveContext: HeardAskingLiveContext,
}
_UNHEARD = {heard: plain for plain, heard in _HEARD.items()}


def hear_live(live: LiveContext, ears: LiveEars) -> None:
    """Tell of what a live context is asked from now on."""
    live._ears = ears
    live.__class__ = _HEARD[type(live)]


def unhear_live(live: LiveContext) -> None:
    """Make a live context what it was before `hear_live`."""
    if type(live) in _UNHEARD:
        live.__class__ = _UNHEARD[type(live)]
        del live._ears
