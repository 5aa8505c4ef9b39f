"""Decisions as a controller makes them, written down: which clip plays from when, for how many ticks."""

from functools import cache

from made_once import make_clip

from contextdb.motion import Action, Decision, FeatureSchema, MotionDatabase, PoseBank
from contextdb.motion.markup.markup import Markup
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.playhead import Playhead

RATE = 30.0
NAMES = ("idle", "walk", "run", "walk_turn_left_90", "start_walk", "jog")
LOOPS = Markup.parse("asset,tag,from,to,value\n" + "".join(f"{name},Looping,,,\n" for name in ("idle", "walk", "run", "jog")))
SCHEMA = FeatureSchema.from_dict(
    "loco", {"rate": RATE, "channels": [{"type": "position", "bone": "LeftFoot"}], "mirror": [["Left*", "Right*"]]}
)


@cache
def clips():
    return tuple(make_clip(name).clip for name in NAMES)


@cache
def bank():
    return PoseBank.build(clips(), SCHEMA, mirror=True, markup=LOOPS)


@cache
def database():
    return MotionDatabase.build(clips(), SCHEMA, mirror=True, markup=LOOPS)


def range_of(asset, mirrored=False):
    pairs = zip(database().assets, database().mirrored.tolist(), strict=True)
    return next(i for i, pair in enumerate(pairs) if pair == (asset, mirrored))


def playing_at(asset, time_s, mirrored=False):
    head = Playhead.of(database(), range_of(asset, mirrored), RATE)
    return Playing("loco", asset, head.range, head.frame_at(time_s), time_s, mirrored)


def decisions(segments, dt):
    """One decision a tick; a segment is (asset, from second, ticks) or (asset, from second, ticks, mirrored)."""
    tick, playing = 0, None
    for asset, from_s, n_ticks, *mirrored in segments:
        for i in range(n_ticks):
            before, move = None, None
            if playing is not None:
                head = Playhead.of(database(), playing.range, RATE)
                move = head.moved(playing.time_s, dt)
                before = playing_at(playing.asset, move.time_s, playing.mirrored)
            action = Action.CONTINUE if move is None or not move.is_ended else Action.HOLD
            if move is not None and move.n_loops:
                action = Action.LOOP
            if i == 0:
                action = Action.START if playing is None else Action.JUMP
            playing = playing_at(asset, from_s, *mirrored) if i == 0 else before
            motion = {} if move is None else {"root_motion": move.motion}
            yield Decision(tick, tick * dt, action, "", i == 0, playing, before, **motion)
            tick += 1
