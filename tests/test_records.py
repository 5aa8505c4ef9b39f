"""What is quickly made is what `dataclass` makes: the same fields, defaults, errors and frozenness."""

import copy
import gc
import inspect
import pickle
from dataclasses import FrozenInstanceError, dataclass, replace

import pytest

from contextdb.motion.records import Unfinished, collector_at_rest, quickly_made


@dataclass(frozen=True, slots=True)
class Plain:
    name: str
    start: int
    parts: tuple[str, ...] = ()
    share: float | None = None

    def __post_init__(self) -> None:
        if self.start < 0:
            raise ValueError("before the start")


@quickly_made
@dataclass(frozen=True, slots=True)
class Quick:
    name: str
    start: int
    parts: tuple[str, ...] = ()
    share: float | None = None

    def __post_init__(self) -> None:
        if self.start < 0:
            raise ValueError("before the start")


@dataclass(frozen=True)
class Wider(Quick):
    more: int = 0


@quickly_made
@dataclass(frozen=True, slots=True)
class Late(Unfinished):
    name: str
    start: int
    share: float | None = None


@pytest.mark.parametrize("make", [lambda of: of("a", 1), lambda of: of("a", start=2, share=0.5), lambda of: of("a", 1, ("b",))])
def test_it_has_the_fields_of_the_plain_one(make):
    plain, quick = make(Plain), make(Quick)
    assert type(quick) is Quick
    assert repr(quick) == repr(plain).replace("Plain", "Quick")
    assert (quick == make(Quick), hash(quick)) == (True, hash(plain))


def test_it_is_frozen():
    with pytest.raises(FrozenInstanceError):
        Quick("a", 1).start = 2


@pytest.mark.parametrize(("arguments", "error"), [(("a",), TypeError), (("a", 1, (), 0.5, 2), TypeError), (("a", -1), ValueError)])
def test_it_refuses_what_the_plain_one_refuses(arguments, error):
    for of in (Plain, Quick):
        with pytest.raises(error):
            of(*arguments)


def test_it_can_be_replaced_copied_pickled_and_asked_for_its_signature():
    quick = Quick("a", 1, share=0.5)
    assert replace(quick, start=3) == Quick("a", 3, share=0.5)
    assert copy.copy(quick) == pickle.loads(pickle.dumps(quick)) == quick
    assert inspect.signature(Quick) == inspect.signature(Plain)


def test_a_subclass_with_more_fields_is_made_too():
    assert Wider("a", 1, more=4).more == 4
    assert type(Wider("a", 1)) is Wider


def test_what_is_not_known_yet_is_worked_out_once_when_it_is_read_and_what_may_wait_waits():
    n_asked = []

    def rest():
        n_asked.append("rest")
        return {"start": 2, "share": 0.5}

    def first():
        n_asked.append("first")
        return {"name": "a", "_rest": rest}

    late, whole = Late.begun(first), Late("a", 2, 0.5)
    assert not hasattr(late, "other")
    assert (late.name, n_asked) == ("a", ["first"])
    assert (late.share, late.start, n_asked) == (0.5, 2, ["first", "rest"])
    with pytest.raises(FrozenInstanceError):
        late.start = 3
    for made in (copy.copy, replace, lambda one: pickle.loads(pickle.dumps(one)), lambda one: one):
        assert made(Late.begun(first)) == whole
    assert (hash(Late.begun(first)), repr(Late.begun(first))) == (hash(whole), repr(whole))
    assert Late.begun(first).share == 0.5
    assert not hasattr(whole, "other")


@pytest.mark.parametrize("is_on", [True, False])
def test_the_collector_is_left_as_it_was_also_after_an_error(is_on):
    was_on = gc.isenabled()
    try:
        (gc.enable if is_on else gc.disable)()
        with collector_at_rest():
            assert not gc.isenabled()
        assert gc.isenabled() is is_on
        with pytest.raises(ValueError, match="inside"), collector_at_rest():
            raise ValueError("inside")
        assert gc.isenabled() is is_on
    finally:
        (gc.enable if was_on else gc.disable)()
