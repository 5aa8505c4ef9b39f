"""Weights learned from choices: hidden ones come back, nothing costs less than what was fitted, and sessions follow the choices."""

import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_reasked import DATABASES, LOCO

from contextdb.errors import MotionError
from contextdb.motion import Controller, ControllerSettings, Entry, Selector, Trace
from contextdb.motion.trace.choice_pairs import ChoiceSession, Preference, read_choices, write_choices
from contextdb.motion.trace.learning import PULL, SURE, fitted_weights, learn
from contextdb.motion.trace.reasked_decision import asset_of
from contextdb.motion.trace.stock import Stock

N_PAIRS = 60


def noisy_pairs(seed: int, hidden: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of candidates that nearly cost the same, with a judge who errs in one of five; and as many judged without an error."""
    rng = np.random.default_rng(seed)
    draws = rng.chisquare(3, (2, 12_000, len(hidden)))
    differences = draws[0] - draws[1]
    margins = differences @ hidden
    near = np.flatnonzero(np.abs(margins) < 0.1 * margins.std())
    judged = margins + 0.03 * margins.std() * rng.logistic(size=len(margins))
    first, others = near[:N_PAIRS], near[N_PAIRS : 2 * N_PAIRS]
    return differences[first] * np.sign(judged[first])[:, None], differences[others] * np.sign(margins[others])[:, None]


@pytest.mark.parametrize("seed", range(6))
def test_hidden_weights_come_back_within_5_percent_from_60_noisy_pairs(seed):
    hidden = np.random.default_rng(100 + seed).uniform(0.3, 2.0, 4)
    pairs, held_out = noisy_pairs(seed, hidden)
    learned = fitted_weights(pairs, np.ones(4))
    learned *= hidden.sum() / learned.sum()
    assert np.linalg.norm(learned - hidden) <= 0.05 * np.linalg.norm(hidden)
    assert np.mean(held_out @ learned > 0.0) > max(0.75, np.mean(held_out @ np.ones(4) > 0.0))


def objective(fitted: np.ndarray, differences: np.ndarray, weights: np.ndarray) -> float:
    """What is fitted is the least of, written out."""
    size = np.sqrt((differences**2).mean(axis=0))
    sure = SURE / np.sqrt(((differences @ weights) ** 2).mean())
    pull = ((size * (fitted - sure * weights)) ** 2).sum()
    return float(np.logaddexp(0.0, -(differences @ fitted)).sum() + PULL / 2.0 * pull)


@given(st.integers(0, 2**32 - 1))
def test_no_weights_nearby_fit_better(seed):
    rng = np.random.default_rng(seed)
    n_channels = int(rng.integers(2, 6))
    differences, weights = rng.normal(size=(int(rng.integers(1, 30)), n_channels)), rng.uniform(0.1, 2.0, n_channels)
    fitted = fitted_weights(differences, weights)
    assert (fitted >= 0.0).all()
    least = objective(fitted, differences, weights)
    for step in rng.normal(size=(40, n_channels)):
        other = np.maximum(0.0, fitted + 0.05 * fitted.max() * step)
        assert objective(other, differences, weights) >= least - 1e-4 * (1.0 + abs(least))


def test_a_channel_that_no_pair_says_anything_of_keeps_its_weight():
    differences = np.array([[1.0, -0.4, 0.0]])
    learned = fitted_weights(differences, np.array([0.2, 1.0, 3.0]))
    assert learned @ differences[0] > 0.0
    assert learned[0] / learned[1] > 0.4
    now = fitted_weights(np.array([[-0.4, 1.0, 0.0]]), np.array([0.2, 1.0, 3.0]))
    assert now / now[2] * 3.0 == pytest.approx([0.2, 1.0, 3.0], rel=0.02)


@pytest.fixture(scope="module")
def trace() -> Trace:
    """Forty searches for poses between those of clips."""
    rng = random.Random(11)
    trace = Trace(8, {"loco": LOCO})
    controller = Controller(Selector([Entry("loco", LOCO)]), ControllerSettings(), trace)
    for _ in range(40):
        one, other = (LOCO.raw(rng.randrange(LOCO.n_frames)) for _ in range(2))
        controller.update(1 / 30, np.where(np.arange(LOCO.n_features) < 6, one, other), force=True)
    return trace


def chosen(trace: Trace, weights: dict[str, float]) -> list[str | None]:
    return [asset_of(each.choice) for each in trace.reasked(weights=weights)]


def session_of(trace: Trace, preferences: list[Preference]) -> ChoiceSession:
    return ChoiceSession("s.parquet", trace, preferences, Stock({"loco": LOCO}), {"loco": "loco"})


def test_choices_made_by_hidden_weights_are_followed_in_the_searches_that_are_repeated(trace):
    hidden = {"LeftFoot position": 0.2, LOCO.channel_names[-1]: 4.0}
    ticks = [each.tick for each in trace.brief()]
    now, wished = chosen(trace, {}), chosen(trace, hidden)
    others = [(tick, was, wish) for tick, was, wish in zip(ticks, now, wished, strict=True) if was != wish]
    assert len(others) > 5
    preferences = [Preference(tick, wish, True) for tick, _, wish in others]
    learned = learn([session_of(trace, preferences)])
    assert (learned.choices, learned.searches, learned.now.searches) == (len(others), len(others), 0)
    assert learned.is_better
    assert learned.after.searches == len(others)
    weights = learned.of_features["loco"]
    assert [asset for asset, was, wish in zip(chosen(trace, weights), now, wished, strict=True) if was != wish] == [
        wish for _, _, wish in others
    ]
    sizes = {name: part.stop - part.start for name, part in zip(LOCO.channel_names, LOCO.slices, strict=True)}
    before = sum(sizes[each.channel] * each.now for each in learned.weights)
    assert sum(sizes[each.channel] * each.learned for each in learned.weights) == pytest.approx(before, rel=0.02)
    rejected = learn([session_of(trace, [Preference(tick, was, False) for tick, was, _ in others[:3]])])
    assert rejected.after.searches == 3 > rejected.now.searches
    followed = learn([session_of(trace, [Preference(ticks[0], now[0], True)])])
    assert (followed.is_better, followed.pairs, followed.now.searches) == (False, 0, 1)


def test_what_no_weight_can_follow_is_said_and_what_is_unknown_is_refused(trace):
    forbidden = np.array([asset != "idle" for asset in LOCO.assets])
    recorded = Trace(8, {"loco": LOCO})
    controller = Controller(Selector([Entry("loco", LOCO)]), ControllerSettings(), recorded)
    controller.update(1 / 30, LOCO.raw(3), {"loco": forbidden}, force=True)
    controller.update(1 / 30, LOCO.raw(3), {"loco": forbidden})
    learned = learn([session_of(recorded, [Preference(recorded[0].tick, "idle", True)])])
    assert learned.unusable == (
        f"s.parquet, tick {recorded[0].tick}: idle cannot be chosen whatever the weights are: asset not valid",
    )
    assert not learned.is_better
    with pytest.raises(MotionError) as caught:
        learn(
            [session_of(recorded, [Preference(recorded[1].tick, "idle", True, 2), Preference(recorded[0].tick, "idel", True, 3)])]
        )
    assert "s.choices.csv, line 2: nothing was searched at tick" in str(caught.value)
    assert 'line 3: no database has an asset "idel"' in str(caught.value)
    assert 'Did you mean "idle"?' in str(caught.value)


def test_choices_are_read_as_they_were_written_and_every_fault_is_reported(tmp_path):
    session = tmp_path / "a.b.parquet"
    assert read_choices(session) == []
    choices = {(30, 'walk, "tired"'): True, (4, "idle"): False}
    write_choices(session, choices)
    assert (tmp_path / "a.b.choices.csv").read_bytes() == b'tick,asset,choice\n4,idle,-\n30,"walk, ""tired""",+\n'
    assert {(each.tick, each.asset): each.is_preferred for each in read_choices(session)} == choices
    (tmp_path / "a.b.choices.csv").write_bytes(b"tick,asset,choice\n-1,idle,+\n2,,-\n3,idle,yes\n4,idle\n")
    with pytest.raises(MotionError) as caught:
        read_choices(session)
    assert [fault.place.line for fault in caught.value.faults] == [5, 2, 3, 4]


def test_databases_with_other_features_do_not_learn_from_each_other(trace):
    assert set(DATABASES) == {"tired", "loco"}
    both = Trace(8, DATABASES)
    controller = Controller(Selector([Entry("tired", DATABASES["tired"]), Entry("loco", LOCO)]), ControllerSettings(), both)
    controller.update(1 / 30, LOCO.raw(40), force=True)
    winner = asset_of(both[0].choice)
    wish = "walk_tired" if winner != "walk_tired" else "walk"
    session = ChoiceSession(
        "s.parquet", both, [Preference(both[0].tick, wish, True)], Stock(DATABASES), {"tired": "a", "loco": "b"}
    )
    assert learn([session]).pairs == (1 if (wish.endswith("tired") == str(winner).endswith("tired")) else 0)
