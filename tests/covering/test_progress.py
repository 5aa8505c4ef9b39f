"""A long computation tells how far it is and can be stopped; neither changes the report."""

import itertools

import pytest

import contextdb as cdb
from contextdb.covering import Cancelled, coverage


def table(n_rows: int = 60, n_conditions: int = 20) -> cdb.Table:
    """A table whose count takes some work."""
    names = [f"n{i}" for i in range(n_conditions)]
    columns = {
        name: [f"{(7 * i + 13 * r) % 61}..{(7 * i + 13 * r) % 61 + 39}" if (i + r) % 3 else "Any" for r in range(n_rows)]
        for i, name in enumerate(names)
    }
    schema = {name: {"type": "number", "min": 0, "max": 100} for name in names}
    return cdb.Table.from_columns({"Asset": [f"A{r}" for r in range(n_rows)], **columns}, schema)


def test_the_report_is_the_same_whether_somebody_watches_or_not():
    options = {"work": 400_000, "samples": 5000, "max_gaps": 20}
    told: list[float] = []
    options["impossible"] = [{"n0": "..10", "n1": "..10"}, {"n1": "5..20", "n2": "50.."}]
    silent = coverage(table(), **options)
    watched = coverage(table(), **options, progress=lambda part, share: told.append(share), should_stop=lambda: False)
    assert silent == watched
    assert told == sorted(told)
    assert 0.0 <= told[0] < 0.1
    assert told[-1] == 1.0 or told[-1] > 0.9


def test_every_part_of_the_work_is_named():
    parts: list[str] = []
    coverage(table(), work=100_000, samples=2000, max_gaps=5, progress=lambda part, share: parts.append(part))
    assert [part for part, _ in itertools.groupby(parts)] == [
        "Reading the cells",
        "Counting contexts",
        "Trying random contexts",
        "Looking for gaps",
        "Measuring gaps",
        "Comparing rows",
        "Looking for crowded contexts",
    ]


@pytest.mark.parametrize("part", ["Reading", "Counting", "Trying", "Looking for gaps", "Measuring", "Comparing", "Looking for cr"])
def test_a_stop_ends_any_part_of_the_work(part):
    now: list[str] = [""]
    with pytest.raises(Cancelled):
        coverage(
            table(),
            work=1_000_000,
            samples=5000,
            max_gaps=10,
            progress=lambda name, share: now.__setitem__(0, name),
            should_stop=lambda: now[0].startswith(part),
        )


def test_a_stop_is_asked_for_again_and_again_within_each_part():
    asked: dict[str, int] = {}
    now: list[str] = [""]

    def should_stop() -> bool:
        asked[now[0]] = asked.get(now[0], 0) + 1
        return False

    coverage(
        table(),
        work=200_000,
        samples=20_000,
        max_gaps=10,
        progress=lambda name, share: now.__setitem__(0, name),
        should_stop=should_stop,
    )
    assert asked["Reading the cells"] > 60
    assert asked["Trying random contexts"] > 4
    assert asked["Looking for gaps"] > 20
    assert asked["Comparing rows"] > 60


def test_an_error_of_whoever_is_told_ends_the_count():
    class Broken(Exception):
        pass

    def tell(part: str, share: float) -> None:
        if part == "Counting contexts":
            raise Broken

    with pytest.raises(Broken):
        coverage(table(), progress=tell)
