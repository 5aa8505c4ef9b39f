"""What a pose costs, stage by stage: microseconds of one core a character and frame.

    python benchmarks/poses.py              on the made clips, in a few seconds

A controller follows a stick over all made clips for a minute; its decisions are then played by streams with more and more stages,
in turn, round by round. A figure is the median of the rounds.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Sequence
from pathlib import Path

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import timing
from benchmarks.sections import print_aligned
from contextdb import motion
from contextdb.motion import Controller, Decision, Entry, FeatureSchema, MotionDatabase, PoseBank, PoseSettings, Selector, Steered

RATE, SECONDS, ROUNDS = 30.0, 60, 15
CHANNELS = [
    {"type": "position", "bone": "LeftFoot"},
    {"type": "position", "bone": "RightFoot"},
    {"type": "velocity", "bone": "Hips"},
    {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0]},
]
STAGES = {
    "clip": PoseSettings(root="animation", blend="none", foot_lock=False),
    "root mixed": PoseSettings(blend="none", foot_lock=False),
    "and spring": PoseSettings(foot_lock=False),
    "and foot lock": PoseSettings(),
    "dead blending and foot lock": PoseSettings(blend="dead"),
}


def main() -> None:
    """Measure and print."""
    schema = FeatureSchema.from_dict("loco", {"rate": RATE, "channels": CHANNELS})
    clips = [made.clip for made in motion.made_clips()]
    bank = PoseBank.build(clips, schema)
    played = decisions(MotionDatabase.build(clips, schema), schema)
    print(", ".join(f"{name} {value}" for name, value in timing.machine().items()))
    print(f"{len(played):,} frames, {bank.n_joints} joints, median of {ROUNDS} rounds\n")
    times: dict[str, list[float]] = {name: [] for name in STAGES}
    for i in range(ROUNDS + 1):
        for name, settings in STAGES.items():
            us = microseconds(bank, settings, played)
            if i:  # the first round compiles
                times[name].append(us)
    rows = [(name, f"{statistics.median(each):.1f}", f"{min(each):.1f}") for name, each in times.items()]
    print_aligned([("stages", "us", "least"), *rows])


def decisions(database: MotionDatabase, schema: FeatureSchema) -> list[tuple[Decision, Steered]]:
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
        query = motion.with_path(schema, pose, motion.steered_path(past, stick))
        found.append((controller.update(1.0 / RATE, query), body))
    return found


def microseconds(bank: PoseBank, settings: PoseSettings, played: Sequence[tuple[Decision, Steered]]) -> float:
    """Of processor time, a frame."""
    stream = motion.PoseStream(bank, settings)
    began = time.process_time()
    for decision, body in played:
        stream.update(decision, 1.0 / RATE, body)
    return (time.process_time() - began) / len(played) * 1e6


if __name__ == "__main__":
    main()
