"""Decisions and poses as the live link of a game publishes them: plain JSON, and for who debugs a row of a recorded session.

The link is handed this module; neither imports the other.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from weakref import WeakKeyDictionary

from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.pose import Pose
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.choice import Choice
from contextdb.motion.selection.decision import Decision
from contextdb.motion.selection.worked_out import WorkedOut
from contextdb.motion.trace.cost_views import as_plain, decision_json
from contextdb.motion.trace.filter_rows import fingerprint, markup_digest
from contextdb.motion.trace.rows import row_of

_digests: WeakKeyDictionary[MotionDatabase, dict[str, str]] = WeakKeyDictionary()


def is_decision(value: object) -> bool:
    """Whether a value can be published: the Decision of a controller, or the Choice of a selector."""
    return isinstance(value, (Decision, Choice))


def plain(decision: object) -> object:
    """A decision as `contextdb motion replay --json` writes it; the choice of a selector as a decision with nothing but that."""
    return decision_json(decision) if isinstance(decision, Decision) else {"choice": as_plain(decision)}


def row(decision: object) -> str | None:
    """A decision as a row of a recorded session, in Python's JSON: what is infinite is `Infinity`. None for a selector's choice."""
    return json.dumps(row_of(decision, lambda *_: ()), separators=(",", ":")) if isinstance(decision, Decision) else None


def digests(decision: object) -> Mapping[str, Mapping[str, str]]:
    """What tells whether a listener has the databases that a decision was made with, computed once for each; none where the
    decision does not name them."""
    candidates = decision.candidates if isinstance(decision, Decision) else None
    databases = candidates.databases if isinstance(candidates, WorkedOut) else {}
    for database in databases.values():
        if database not in _digests:
            _digests[database] = {"digest": fingerprint(database), "markup": markup_digest(database)}
    return {name: _digests[database] for name, database in databases.items()}


def is_pose(pose: object, rig: object) -> bool:
    """Whether it is a pose of a rig."""
    return isinstance(pose, Pose) and isinstance(rig, PoseBank) and len(pose.rotations) == rig.n_joints


def bones(rig: object) -> dict[str, object]:
    """What poses of a rig have in common: names, parents (-1: none), offsets from them in metres, and which joints move against
    their parents."""
    assert isinstance(rig, PoseBank), "see is_pose"
    parents, offsets, _ = rig.joints
    return {
        "names": list(rig.skeleton.names),
        "parents": parents.tolist(),
        "offsets": offsets.round(5).tolist(),
        "moving": rig.moving.tolist(),
    }


def pose(pose: object, rig: object) -> dict[str, object]:
    """A pose: what plays, the root, the turn of each joint against its parent (w, x, y, z), and where those are that move."""
    assert isinstance(pose, Pose), "see is_pose"
    assert isinstance(rig, PoseBank), "see is_pose"
    return {
        "asset": None if pose.playing is None else pose.playing.asset,
        "root": [round(number, 5) for number in pose.root],
        "rotations": pose.rotations.round(5).tolist(),
        "translations": pose.translations[rig.moving].round(5).tolist(),
    }
