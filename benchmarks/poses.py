"""What a pose costs, stage by stage: microseconds of one core a character and frame.

    python benchmarks/poses.py              on the made clips, in a few seconds

A controller follows a stick over all made clips for a minute; its decisions are then played by streams with more and more stages,
in turn, round by round. A figure is the median of the rounds. The controller's own cost stands beside them, its path and its query
not in it, and what a pose costs each of a thousand characters, one by one and together. Then whole updates, path, query, search and
pose in them: of one character, and of a crowd of a thousand; as every third update searches, these are means of such threes.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import timing
from benchmarks.sections import print_aligned
from contextdb import motion
from contextdb.motion import (
    Character,
    Controller,
    Crowd,
    Decision,
    Entry,
    FeatureSchema,
    MotionDatabase,
    PoseBank,
    PoseSettings,
    PoseStream,
    PoseStreams,
    Selector,
    Steered,
)
from contextdb.motion.clips.steering import steered_path
from contextdb.motion.made.recipes import made_clips
from contextdb.motion.output.ground import Ground

RATE, SECONDS, ROUNDS = 30.0, 60, 15
CHANNELS = [
    {"type": "position", "bone": "LeftFoot"},
    {"type": "position", "bone": "RightFoot"},
    {"type": "velocity", "bone": "Hips"},
    {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
]
EVEN = PoseSettings(path_alignment=False, min_stride=1.0, max_stride=1.0)
STAGES = {
    "clip": PoseSettings(root="animation", blend="none", foot_lock=False),
    "root mixed": replace(EVEN, blend="none", foot_lock=False),
    "and spring": replace(EVEN, foot_lock=False),
    "and alignment": PoseSettings(foot_lock=False, min_stride=1.0, max_stride=1.0),
    "and stride": PoseSettings(foot_lock=False),
    "and foot lock": PoseSettings(),
    "and ground": PoseSettings(),
}
CROWD = 1000


def main() -> None:
    """Measure and print."""
    schema = FeatureSchema.from_dict("loco", {"rate": RATE, "channels": CHANNELS})
    clips = [made.clip for made in made_clips()]
    bank = PoseBank.build(clips, schema)
    controller_us: list[float] = []
    database = MotionDatabase.build(clips, schema)
    played = decisions(database, schema, controller_us)
    print(", ".join(f"{name} {value}" for name, value in timing.machine().items()))
    print(f"{len(played):,} frames, {bank.n_joints} joints, median of {ROUNDS} rounds\n")
    times: dict[str, list[float]] = {name: [] for name in STAGES}
    for i in range(ROUNDS + 1):
        for name, settings in STAGES.items():
            us = microseconds(bank, settings, played, stairs if name == "and ground" else None)
            if i:  # the first round compiles
                times[name].append(us)
    rows = [(name, f"{statistics.median(each):.1f}", f"{min(each):.1f}") for name, each in times.items()]
    rows.append(("controller, on the mean", f"{statistics.mean(controller_us[100:]):.1f}", ""))
    for together, what in ((False, "one by one"), (True, "together")):
        crowd = crowd_microseconds(bank, played, together=together)
        rows.append((f"all but ground, {CROWD:,} streams {what}", f"{statistics.median(crowd):.1f}", f"{min(crowd):.1f}"))
    selector = Selector([Entry("loco", database)])
    for n, poses, what in ((1, True, ""), (CROWD, False, " without poses"), (CROWD, True, "")):
        whole = update_microseconds(motion.Character(Controller(selector), schema, None, PoseStream(bank) if poses else None), n)
        name = "a character's update" if n == 1 else f"a crowd's update, each of {n:,}{what}"
        rows.append((name, f"{statistics.median(whole):.1f}", f"{min(whole):.1f}"))
    print_aligned([("stages", "us", "least"), *rows])


def stairs(x: float, z: float) -> tuple[float, tuple[float, float, float]]:
    """Steps of half a metre along z."""
    return 0.12 * math.floor(z / 0.5), (0.0, 1.0, 0.0)


def decisions(database: MotionDatabase, schema: FeatureSchema, times_us: list[float]) -> list[tuple[Decision, Steered]]:
    """A minute of a character that turns every three seconds, and where the game has its body."""
    controller, body = Controller(Selector([Entry("loco", database)])), Steered()
    past, found = [body], []
    pose = database.raw(0)
    for tick in range(int(RATE * SECONDS)):
        angle = 1.2 * (tick // 90)
        stick = (1.3 * math.sin(angle), 1.3 * math.cos(angle))
        body = body.moved(1.0 / RATE, stick)
        past = [*past, body][-31:]
        ahead = controller.upcoming(1.0 / RATE)
        pose = pose if ahead is None else database.raw(ahead.frame)
        query = motion.with_path(schema, pose, steered_path(past, stick))
        began = time.process_time()
        decision = controller.update(1.0 / RATE, query)
        times_us.append((time.process_time() - began) * 1e6)
        found.append((decision, body))
    return found


def crowd_microseconds(bank: PoseBank, played: Sequence[tuple[Decision, Steered]], *, together: bool) -> list[float]:
    """Of processor time, a character, in each of twenty frames of a crowd: of streams one by one, or together."""
    streams, found = PoseStreams([motion.PoseStream(bank) for _ in range(CROWD)]), []
    for frame in range(20):
        now = [played[(i + frame) % len(played)] for i in range(CROWD)]
        decided, bodies = [decision for decision, _ in now], [body for _, body in now]
        began = time.process_time()
        if together:
            streams.update(decided, 1.0 / RATE, bodies)
        else:
            for stream, decision, body in zip(streams, decided, bodies, strict=True):
                stream.update(decision, 1.0 / RATE, body)
        found.append((time.process_time() - began) / CROWD * 1e6)
    return found[1:]


def update_microseconds(first: Character, n: int) -> list[float]:
    """Of processor time, a character, in updates of a crowd of so many, or of one alone; of each three updates the mean."""
    crowd = Crowd([first.copy() for _ in range(n)])
    speeds, ways = 0.3 + np.arange(n) % 37 / 10.0, np.arange(n) % 61 / 10.0
    sticks = np.column_stack((speeds * np.sin(ways), speeds * np.cos(ways)))
    found = []
    for _ in range(200 if n == 1 else 25):
        began = time.process_time()
        for _ in range(3):
            if n == 1:
                crowd[0].update(1.0 / RATE, (float(sticks[0, 0]), float(sticks[0, 1])))
            else:
                crowd.update(1.0 / RATE, sticks)
        found.append((time.process_time() - began) / (3 * n) * 1e6)
    return found[2:]


def microseconds(
    bank: PoseBank, settings: PoseSettings, played: Sequence[tuple[Decision, Steered]], ground: Ground | None = None
) -> float:
    """Of processor time, a frame."""
    stream = motion.PoseStream(bank, settings)
    began = time.process_time()
    for decision, body in played:
        stream.update(decision, 1.0 / RATE, body, ground)
    return (time.process_time() - began) / len(played) * 1e6


if __name__ == "__main__":
    main()
