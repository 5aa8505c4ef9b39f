"""What is measured, moment by moment: for a timeline. NaN where a moment has no value."""

from __future__ import annotations

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring import formulas
from contextdb.motion.measuring.shown import Shown


def strips_of(it: Shown) -> dict[str, Floats]:
    """Of each measure that there is its value at each moment: float64 [T].

    "skate": the speed of the fastest planted foot, cm/s; "accel": the largest acceleration of a joint, m/s²; "error": how far the
    root is from the game's body, m.
    """
    found: dict[str, Floats] = {}
    if it.positions is not None and len(it.times_s) > 1:
        found["accel"] = _accelerations(it.positions, it.times_s)
        if it.feet is not None and it.contacts is not None:
            found["skate"] = _skate(it.positions[:, it.feet], it)
    if it.roots is not None and it.bodies is not None:
        found["error"] = formulas.apart(it.roots, it.bodies)[0]
    return found


def _accelerations(positions: Floats, times_s: Floats) -> Floats:
    step = formulas.step_of(times_s)
    found = np.full(len(times_s), np.nan)
    largest = formulas.accelerations(positions, times_s, step)
    if len(largest):
        found[step:-step] = largest.max(axis=1)
    return found


def _skate(feet: Floats, it: Shown) -> Floats:
    assert it.contacts is not None, "was looked at before"
    slides = formulas.Slides.of(feet, it.times_s, it.contacts, formulas.floor_of(feet))
    found = np.full(len(it.times_s), np.nan)
    found[len(found) - len(slides.seconds) :] = np.where(slides.planted, 100.0 * slides.speeds, 0.0).max(axis=1)
    return found
