"""Every update of a character against a plain reading of all rules, frame by frame."""

import math
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from lines import DT, RATE, line
from strategies import examples

from contextdb.motion import Entry, Selector
from contextdb.motion.markup.marks import Mark
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action
from contextdb.motion.selection.variation import Variation

SEED = 5


@st.composite
def scenes(draw):
    """A database of a few short assets with markup, settings, and what is asked at each of some updates of one frame."""
    names = "pqr"[: draw(st.integers(1, 3))]
    assets = {name: draw(st.lists(st.integers(0, 6), min_size=1, max_size=9)) for name in names}
    rows = []
    for name in names:
        if draw(st.booleans()):
            rows.append(f"{name},Looping,,,")
        if draw(st.booleans()):
            start, length = draw(st.integers(0, 6)) / RATE, draw(st.integers(0, 3)) / RATE
            tag = draw(st.sampled_from(["DoNotChoose", "Excluded", "NextNaturalOnly"]))
            rows.append(f"{name},{tag},{start},{start + length},{0.1 if length and tag == 'NextNaturalOnly' else ''}")
    made = line("\n".join(rows), continuing=draw(st.sampled_from([0.0, -0.5, -3.0])), **assets)
    if len(names) == 3 and draw(st.booleans()):
        made = replace(made, assets=("p", "q", "p"))  # another take of the same asset
    seconds = st.sampled_from([0.0, 0.1, 0.2, 0.3])
    rules = {key: draw(seconds) for key in ("search_every_s", "jump_threshold_s", "history_s", "grace_s")}
    rules["asset_history_s"] = draw(st.sampled_from([0.0, 0.0, 0.2, 0.5, 1.3]))
    rules["cost_bar"] = draw(st.sampled_from([None, 0.0, 1.0, 4.0]))
    rules["until_natural"] = draw(st.booleans())
    rules["settle_bias"], rules["settle_s"] = draw(st.sampled_from([None, -0.77, -2.3, -9.1])), draw(st.sampled_from([0.2, 0.5]))
    rules["variation"] = draw(st.sampled_from([None, None, Variation(0.0), Variation(1.0, 0), Variation(4.0, 2)]))
    masks = st.one_of(st.none(), st.lists(st.booleans(), min_size=len(names), max_size=len(names)))
    asked = draw(st.lists(st.tuples(st.integers(0, 6), masks, st.sampled_from([False] * 4 + [True])), min_size=1, max_size=25))
    return made, rules, asked


@examples(10)
@given(scenes())
def test_every_update_follows_from_the_rules_read_frame_by_frame(scene):
    database, rules, asked = scene
    one = Controller(Selector([Entry("a", database)]), ControllerSettings(**rules, rate=RATE), rng=SEED)
    oracle = Oracle(database, rules)
    for place, mask, interrupt in asked:
        decision = one.update(DT, [float(place)], None if mask is None else np.array(mask), interrupt=interrupt)
        expected = oracle.update(float(place), mask, interrupt)
        assert (decision.action, decision.searched, decision.playing and decision.playing.frame) == expected
        assert decision.held == oracle.held


class Oracle:
    """A character at one frame an update; every rule asked of every frame, one by one."""

    def __init__(self, database, rules):
        self.database = database
        self.n = {key: round(seconds * RATE) for key, seconds in rules.items() if key.endswith("_s")}
        self.bar, self.is_until_natural = math.inf if rules["cost_bar"] is None else rules["cost_bar"], rules["until_natural"]
        self.frame, self.tick, self.searched_at, self.played = None, 0, 0, {}
        self.held, self.waiting_from, self.entered_at = "", None, 0
        self.settle_bias, self.settle_s = rules["settle_bias"] or 0.0, rules["settle_s"]
        self.variation, self.recent, self.n_drawn = rules["variation"], [], 0

    def update(self, place, mask, interrupt=False):
        self.tick += 1
        following, passed, is_looped = self._following()
        is_forced = following is not None and not interrupt and not self._is_valid(following, mask)
        self.held = self._held_by_nature(following, is_looped) if is_forced else ""
        searched = not self.held and (interrupt or self._must_search(following, mask))
        may_continue = following is not None and not interrupt and self._is_valid(following, mask)
        before, here = self.frame, (passed or [self.frame])[-1]
        self.played.update(dict.fromkeys(passed, self.tick))
        chosen = self._best(place, mask, here, may_continue, following is None) if searched else following
        is_over = is_forced and searched and chosen is not None and self._cost(chosen, place) > self.bar
        if is_over and self.tick - (self.waiting_from or self.tick) < self.n["grace_s"]:
            self.held, chosen = "cost bar", None
        self.waiting_from = (self.waiting_from or (self.tick if self.held == "cost bar" else None)) if self.held else None
        if searched:
            self.searched_at = self.tick
        self.frame = here if chosen is None else chosen
        if self.frame is not None and chosen is not None:
            self.played[chosen] = self.tick
        onward = Action.LOOP if is_looped else Action.CONTINUE
        if self.frame is None:
            return Action.NOTHING, True, None
        if chosen is None:
            return Action.HOLD if following is None else onward, True, self.frame
        if chosen == following and (may_continue or not searched):
            return onward, searched, chosen
        self.entered_at = self.tick
        self.recent.insert(0, self._asset(chosen))
        return Action.START if before is None else Action.JUMP, True, chosen

    def _held_by_nature(self, following, is_looped):
        if self.database.marks.mark_of(following) & Mark.NEXT_NATURAL and not is_looped:
            return "next natural"
        is_looping = self._loops(self.database.range_of(following))
        return "until natural" if self.is_until_natural and not is_looping else ""

    def _loops(self, i):
        return self.database.marks.looping[i] and self.database.stops[i] - self.database.starts[i] > 1

    def _cost(self, frame, place):
        return float(self.database.features[frame, 0] - place) ** 2

    def _following(self):
        """The frame one on, None for none; the frames that are passed on the way; and whether the end was passed."""
        if self.frame is None:
            return None, [], False
        i = self.database.range_of(self.frame)
        start, stop = int(self.database.starts[i]), int(self.database.stops[i])
        is_excluded = [bool(self.database.marks.mark_of(frame) & Mark.EXCLUDED) for frame in range(stop)]
        if self.frame + 1 < stop:
            return (None, [], False) if is_excluded[self.frame + 1] else (self.frame + 1, [self.frame + 1], False)
        if not self.database.marks.looping[i] or stop - start < 2 or is_excluded[start]:
            return None, [], False
        if is_excluded[start + 1]:  # the last frame is the first once more
            return None, [start], True
        return start + 1, [start, start + 1], True

    def _must_search(self, following, mask):
        if following is None or not self._is_valid(following, mask):
            return True
        return self.tick - self.searched_at >= self.n["search_every_s"]

    def _is_valid(self, frame, mask):
        return mask is None or mask[self.database.range_of(frame)]

    def _asset(self, frame):
        return self.database.assets[self.database.range_of(frame)]

    def _best(self, place, mask, here, may_continue, is_ended):
        found, least, costs = None, math.inf, {}
        for frame in range(self.database.n_frames):
            is_current = may_continue and frame == here
            if not is_current and not self._may_enter(frame, mask, here, is_ended):
                continue
            cost = self._cost(frame, place)
            cost += self.database.biases.continuing if is_current else 0.0
            costs[frame] = cost
            if cost < least or (cost == least and is_current):
                found, least = frame, cost
        if self.variation is not None and found is not None:
            if may_continue and costs[here] <= least + self.variation.within:
                return here
            found = self._drawn({frame: cost for frame, cost in costs.items() if cost <= least + self.variation.within})
            least = costs[found]
        if may_continue and found is not None and found != here:
            into, own = (self.database.range_of(frame) for frame in (found, here))
            is_to_loop = self.database.marks.looping[into] and not self.database.marks.looping[own]
            playing_on = self._cost(here, place) + self.database.biases.continuing + self._settling()
            return here if not is_to_loop and self._settling() and playing_on <= least else found
        return found

    def _drawn(self, ties):
        """One of the best frames of ranges, by the generator of Steele and others that Java calls SplittableRandom."""
        of_ranges = {}
        for frame in sorted(ties, key=lambda frame: (ties[frame], frame)):
            of_ranges.setdefault(self.database.range_of(frame), frame)
        frames = [of_ranges[i] for i in sorted(of_ranges)]
        among = [frame for frame in frames if self._asset(frame) not in self.recent[: self.variation.memory]] or frames
        self.n_drawn += 1
        mixed = (SEED + self.n_drawn * 0x9E3779B97F4A7C15) % 2**64
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            mixed = (mixed ^ mixed >> shift) * factor % 2**64
        return among[((mixed ^ mixed >> 31) >> 32) * len(among) >> 32]

    def _settling(self):
        """What was entered just now is left for a large gain only."""
        return self.settle_bias * max(0.0, 1.0 - (self.tick - self.entered_at) / RATE / self.settle_s)

    def _may_enter(self, frame, mask, here, is_ended):
        mark = self.database.marks.mark_of(frame)
        if mark & (Mark.EXCLUDED | Mark.DO_NOT_CHOOSE | Mark.PAST_ENTRY) or not self._is_valid(frame, mask):
            return False
        if self.tick - self.played.get(frame, -99) < self.n["history_s"]:
            return False
        of_asset = [played for each, played in self.played.items() if self._asset(each) == self._asset(frame)]
        if self.tick - max(of_asset, default=-99) < self.n["asset_history_s"]:
            return False
        if here is None or self.database.range_of(frame) != self.database.range_of(here):
            return True
        i = self.database.range_of(here)
        start, stop = int(self.database.starts[i]), int(self.database.stops[i])
        if is_ended:
            near = max(self.n["jump_threshold_s"], self.n["search_every_s"])
            return frame == start or frame < here - near
        if self.database.marks.mark_of(here) & Mark.NEXT_NATURAL:
            return False
        apart = abs(frame - here)
        if self.database.marks.looping[i] and stop - start > 1:
            apart = min(apart, stop - start - 1 - apart)
        return apart > self.n["jump_threshold_s"]
