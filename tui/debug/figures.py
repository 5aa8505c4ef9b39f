"""Figures to draw: poses and paths in the body's own frame, from the moment, the databases and the pose banks.

J joints. Points are left, up, ahead, in metres, with the body at the origin.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.channels import Channel
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Playing
from contextdb.motion.trace.cost_views import PATH

from .recording import Displayed, Moment, Recording

AHEAD_S = 1.0
"""So long paths are."""
MOST_CANDIDATES = 12
"""So many paths of candidates are drawn."""


@dataclass(frozen=True, eq=False)
class Figure:
    """What the body does at a moment: bones as pairs of points [n, 2, 3], and paths [m, 3]; empty where it is not known.

    `asset` is the pose of the asset under the cursor.
    """

    chosen: Floats
    plays_on: Floats
    asset: Floats
    wanted: Floats
    got: Floats
    candidates: tuple[Floats, ...]
    place: tuple[float, float, float]
    """Where the body is in the world."""


NO_BONES = np.zeros((0, 2, 3))
NO_PATH = np.zeros((0, 3))


def figure_of(
    recording: Recording, banks: Mapping[str, PoseBank], moment: Moment, asset: tuple[str, str, bool, float] | None
) -> Figure:
    """What is drawn of a moment.

    Parameters
    ----------
    banks : mapping of database name to PoseBank
        May lack some, or all.
    asset : (database, asset, mirrored, seconds in it), optional
        Whose pose is drawn too.
    """
    decision, line = moment.decision, recording.line
    return Figure(
        chosen=_bones_of(banks, decision.playing)
        if recording.displayed is None
        else _displayed_points(recording.displayed, moment.index),
        plays_on=_bones_of(banks, decision.before) if line.jumped[moment.index] else NO_BONES,
        asset=NO_BONES if asset is None else _bones(banks, *asset),
        wanted=wanted_path(moment),
        got=_got(recording, moment.index),
        candidates=tuple(_paths(moment)),
        place=(float(line.roots[moment.index, 0]), float(line.roots[moment.index, 1]), float(line.roots[moment.index, 2])),
    )


def _bones_of(banks: Mapping[str, PoseBank], playing: Playing | None) -> Floats:
    return NO_BONES if playing is None else _bones(banks, playing.database, playing.asset, playing.mirrored, playing.time_s)


def _displayed_points(displayed: Displayed, index: int) -> Floats:
    """The bones of the pose that was displayed at an update."""
    x, z, heading = displayed.roots[index].tolist()
    at = displayed.positions[index].astype(np.float64)
    across, along = at[:, 0] - x, at[:, 2] - z
    sin, cos = np.sin(heading), np.cos(heading)
    return bones_between(np.stack((cos * across - sin * along, at[:, 1], sin * across + cos * along), axis=1), displayed.parents)


def bones_between(positions: Floats, parents: Ints) -> Floats:
    """Joints [J, 3] as bones; a joint that stays on the ground is none."""
    children = np.flatnonzero(parents >= 0)
    starts = positions[parents[children]]
    is_root = np.linalg.norm(starts, axis=1) < 1e-6
    return np.asarray(np.stack((starts, positions[children]), axis=1)[~is_root])


def _bones(banks: Mapping[str, PoseBank], database: str, asset: str, mirrored: bool, time_s: float) -> Floats:
    """The bones of a pose of a clip [J - 1, 2, 3]."""
    bank = banks.get(database)
    if bank is None:
        return NO_BONES
    return bones_between(bank.joints_at(bank.range_of(asset, mirrored), time_s), bank.skeleton.parents)


def wanted_path(moment: Moment) -> Floats:
    """The path that the query asks for."""
    decision = moment.searched
    if decision is None or decision.query is None or moment.repeated is None:
        return NO_PATH
    for search in moment.repeated.searches.values():
        points = _path_points(search.database, decision.query)
        if len(points):
            return points
    return NO_PATH


def _path_points(database: MotionDatabase, query: Floats) -> Floats:
    """The points of the channels of positions on the path, in order of time, the body's own place first."""
    points = [(0.0, 0.0, 0.0, 0.0)]
    schema = database.schema
    if schema is None:
        return NO_PATH
    for channel in schema.channels:
        if _is_place(channel):
            values = query[schema.slices[channel.name]].reshape(-1, 2)
            points += [(at, left, 0.0, ahead) for at, (left, ahead) in zip(channel.at, values.tolist(), strict=True)]
    return np.array(sorted(points))[:, 1:] if len(points) > 1 else NO_PATH


def _is_place(channel: Channel) -> bool:
    return channel.name.startswith(f"{PATH}position") and bool(channel.at)


def _got(recording: Recording, index: int) -> Floats:
    """Where the body went, from a second before to a second after."""
    line = recording.line
    n = round(AHEAD_S * line.rate)
    roots = line.roots[max(0, index - n) : index + n + 1]
    return in_body(roots[:, 0], roots[:, 1], line.roots[index])


def _paths(moment: Moment) -> Iterator[Floats]:
    """Where the cheapest frames that may play would lead: those of the candidates of a search."""
    if moment.turned is None:
        return
    rows = [row for row in moment.landscape.ordered("best") if row.may_play][:MOST_CANDIDATES]
    for row in rows:
        database = moment.landscape.searches[row.database].database
        if database.root is None:
            continue
        rate = 30.0 if database.schema is None else database.schema.rate
        stop = min(row.frame + round(AHEAD_S * rate) + 1, int(database.stops[row.range]))
        root = np.asarray(database.root[row.frame : stop], np.float64)
        yield in_body(root[:, 0], root[:, 1], root[0])


def in_body(x: Floats, z: Floats, place: Floats) -> Floats:
    """Points on the ground, seen from a body at a place."""
    sin, cos = np.sin(place[2]), np.cos(place[2])
    x, z = x - place[0], z - place[1]
    return np.stack((cos * x - sin * z, np.zeros(len(x)), sin * x + cos * z), axis=1)


def grid(place: tuple[float, float, float], half_m: float = 2.0) -> tuple[Floats, Floats]:
    """The lines of a grid of whole metres on the ground about a body: where they start and where they stop [n, 3]."""
    x0, z0 = np.floor(place[0]), np.floor(place[1])
    steps = np.arange(-half_m, half_m + 1.5)
    low, high = -half_m, half_m + 1.0
    across = [((x0 + low, z0 + s), (x0 + high, z0 + s)) for s in steps]
    along = [((x0 + s, z0 + low), (x0 + s, z0 + high)) for s in steps]
    points = np.array(across + along)
    ends = [in_body(points[:, i, 0], points[:, i, 1], np.array(place)) for i in (0, 1)]
    return ends[0], ends[1]
