"""A recorded session as its page shows it: its poses made again, its searches repeated, its measures moment by moment."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from contextdb.errors import Fault, MotionError
from contextdb.motion.clips.bone_names import side_and_core
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.measuring import displayed, measure
from contextdb.motion.measuring.displayed import strips_of
from contextdb.motion.measuring.raw_clips import Clips, toe_of
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stream import Pose
from contextdb.motion.selection.decision import Action, Decision, Playing
from contextdb.motion.trace.cost_views import Ranked, cost_text
from contextdb.motion.trace.reasked import Reasked, why_not_asked
from contextdb.motion.trace.reasked_decision import ReaskedDecision
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.status import status_of
from contextdb.motion.trace.views import fact_text
from contextdb.report import session_data

MOST_CANDIDATES = 12
GHOST_S = 0.7
"""For how long the poses that could have played are included."""
MOST_GHOSTS = 3
"""Beside what plays: what would have played on, and two others."""
CHANGES = (Action.START, Action.JUMP)

Measured = Mapping[str, tuple[str, str]]


def view_of(
    name: str,
    trace: Trace,
    banks: Mapping[str, PoseBank],
    settings: PoseSettings,
    reasked: Reasked | None = None,
    measured: Measured | None = None,
    poses: Sequence[Pose] | None = None,
) -> session_data.SessionView:
    """A session as the page shows it.

    `banks` are the poses of its databases, by name, and `settings` how its poses are made; `poses` are those that were shown, one
    for each decision, such as on ground that is not flat (None: they are made again). `reasked` is the session searched again:
    without it the page shows no candidates. `measured` are measures by name: of the session, and of the raw clips. Raises
    MotionError where the session has no decision, or the banks have no poses of what it plays.
    """
    decisions = list(trace.brief())
    if not decisions:
        raise MotionError(Fault("the session has no decision.", "one with at least an update"))
    warped = list(measure.warped_poses(decisions, banks, settings))
    poses = [pose for pose, _ in warped] if poses is None else poses
    played = displayed.with_poses(displayed.of_decisions(decisions), displayed.of_poses(poses, 1.0)).with_contacts(Clips.of(banks))
    assert played.positions is not None, "was just made"
    assert played.roots is not None, "was just made"
    rig = next(iter(banks.values()))
    feet = [toe_of(rig.skeleton, foot) for foot in rig.feet]
    contacts = np.zeros((len(decisions), len(feet)), np.bool_) if played.contacts is None else played.contacts
    return session_data.SessionView(
        name=name,
        rate=played.rate,
        bones=rig.skeleton.names,
        parents=rig.skeleton.parents,
        feet=feet,
        sides=[side_and_core(bone)[0] for bone in rig.skeleton.names],
        positions=played.positions,
        roots=played.roots,
        bodies=None if played.bodies is None or np.isnan(played.bodies).any() else played.bodies,
        contacts=contacts,
        playing=[(None, 0.0) if d.playing is None else (d.playing.asset, d.playing.time_s) for d in decisions],
        flags=np.array([_flags(decision) for decision in decisions], np.uint8),
        strips={"cost": _costs(decisions), **strips_of(played)},
        moments=list(_moments(decisions, warped, banks, trace, reasked)),
        changes=[_change(decision) for decision in decisions if decision.action in CHANGES],
        measures=dict(measured or {}),
    )


def _flags(decision: Decision) -> int:
    playing = decision.playing
    flags = (
        session_data.SEARCHED * decision.searched
        + session_data.JUMPED * (decision.action in CHANGES)
        + session_data.FORCED * decision.is_forced
    )
    return flags + session_data.MIRRORED * (playing is not None and playing.mirrored)


def _costs(decisions: Sequence[Decision]) -> Floats:
    """What plays cost when it was last searched for."""
    costs = np.array([np.nan if each.cost is None else each.cost for each in decisions], np.float64)
    known = np.maximum.accumulate(np.where(np.isnan(costs), -1, np.arange(len(costs))))
    return np.where(known < 0, np.nan, costs[known])


def _change(decision: Decision) -> session_data.ChangeLine:
    action = "jumps, forced" if decision.is_forced else str(decision.action)
    asset = "" if decision.playing is None else _named(decision.playing.asset, decision.playing.mirrored)
    return session_data.ChangeLine(
        decision.time_s, (action, asset, "" if decision.cost is None else cost_text(decision.cost), decision.why)
    )


def _named(asset: str, mirrored: bool) -> str:
    return f"{asset} mirrored" if mirrored else asset


# ---- the moments at which something was searched


def _moments(
    decisions: Sequence[Decision],
    warped: Sequence[tuple[Pose, tuple[float, float]]],
    banks: Mapping[str, PoseBank],
    trace: Trace,
    reasked: Reasked | None,
) -> Iterator[session_data.Moment]:
    for i, decision in enumerate(decisions):
        if not decision.searched:
            continue
        is_change = decision.action in CHANGES
        moment = session_data.Moment(i, decision.why, is_change, decision.is_forced, _facts(decision), (), (), ())
        reasked_decision = _reasked_at(trace, reasked, i) if is_change else None
        if reasked_decision is not None and reasked is not None:
            pose, warp = warped[i]
            status = status_of(reasked_decision.decision, decisions[i - 1] if i else None, reasked.databases, warp)
            moment = replace(moment, status=tuple(status.lines()))
            yield _in_full(moment, reasked_decision, decision, _Ghosts(banks, pose.root[2]))
        else:
            yield moment


def _facts(decision: Decision) -> tuple[tuple[str, str], ...]:
    return tuple((name, fact_text(value)) for name, value in sorted((decision.context or {}).items()))


def _reasked_at(trace: Trace, reasked: Reasked | None, at: int) -> ReaskedDecision | None:
    """A decision searched again; None where that is impossible."""
    if reasked is None or why_not_asked(trace[at], trace.about, reasked.databases):
        return None
    return reasked[at]


def _in_full(moment: session_data.Moment, reasked: ReaskedDecision, decision: Decision, ghosts: _Ghosts) -> session_data.Moment:
    best = reasked.best_of_assets()
    ordered = sorted(best, key=lambda each: (each.row.left_out is not LeftOut.NO, each.row.cost))
    channels = tuple(ordered[0].row.channels) if ordered else ()
    shown_first = ordered[:MOST_CANDIDATES]
    return replace(
        moment,
        channels=(*channels, "biases"),
        candidates=[_candidate(each, channels) for each in sorted(shown_first, key=lambda each: each.row.cost)],
        ghosts=list(ghosts.of(decision, ordered)),
        assets=list(_assets(reasked, best)),
    )


def _candidate(each: Ranked, channels: Sequence[str]) -> session_data.Candidate:
    row = each.row
    parts = (*(row.channels.get(channel, 0.0) for channel in channels), sum(row.biases.values()))
    reason = "" if row.left_out is LeftOut.NO else row.left_out.text
    return session_data.Candidate(row.asset, row.time_s or 0.0, row.mirrored, row.cost, parts, reason, each.role == "chosen")


def _assets(reasked: ReaskedDecision, best: Sequence[Ranked]) -> Iterator[session_data.AssetCosts]:
    """The costs of every range that was searched, by asset."""
    for each in best:
        search = reasked.searched[each.database]
        own = slice(int(search.database.starts[each.row.range]), int(search.database.stops[each.row.range]))
        reason = "" if each.row.left_out is LeftOut.NO else each.row.left_out.text
        may_play = search.left_out[own] == LeftOut.NO
        permutation = "" if each.row.permutation_s is None else f" +{each.row.permutation_s:g} s"
        yield session_data.AssetCosts(_named(each.row.asset, each.row.mirrored) + permutation, search.costs[own], may_play, reason)


@dataclass(frozen=True, eq=False)
class _Ghosts:
    """Poses that could have played, turned like the body was."""

    banks: Mapping[str, PoseBank]
    heading: float

    def of(self, decision: Decision, ordered: Sequence[Ranked]) -> Iterator[session_data.Ghost]:
        """What would have played on, and the best of the other assets that could have been chosen."""
        if decision.before is not None:
            yield from self._ghost(decision.before, plays_on=True)
        taken = {each.asset for each in (decision.playing, decision.before) if each is not None}
        for each in ordered:
            if each.row.left_out is LeftOut.NO and each.row.asset not in taken:
                taken.add(each.row.asset)
                row = each.row
                playing = Playing(each.database, row.asset, row.range, row.frame, row.time_s or 0.0, row.mirrored)
                yield from self._ghost(playing, plays_on=False)
                if len(taken) > MOST_GHOSTS:
                    return

    def _ghost(self, playing: Playing, *, plays_on: bool) -> Iterator[session_data.Ghost]:
        bank = self.banks.get(playing.database)
        if bank is None:
            return
        number = bank.range_of(playing.asset, playing.mirrored)
        steps = np.arange(round(GHOST_S * bank.rate) + 1) / bank.rate
        times_s = np.minimum(playing.time_s + steps, bank.last_s(number)).tolist()
        positions = np.stack([bank.joints_at(number, time_s, self.heading) for time_s in times_s])
        yield session_data.Ghost(_named(playing.asset, playing.mirrored), positions, bank.rate, plays_on)
