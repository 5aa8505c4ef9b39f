"""A session as a recording for the Rerun viewer: the skeleton, the body and its feet in space, costs and measures as curves, and
why it jumped as a log, on one timeline `time`. Needs rerun-sdk, from the extra `rerun`.

    character/skeleton    the bones, in metres, y up         character/feet    those that are down
    game/body             where the game has the body        plays             what plays, and why, at each change
    measures/NAME         cost, acceleration, skate, …

Source: the Python SDK of rerun.io.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contextdb.errors import Fault, MotionError
from contextdb.report.session_data import SessionView

BONE, FOOT, BODY = (124, 192, 138), (240, 178, 80), (106, 160, 216)
FOOT_M, BODY_M = 0.04, 0.06


def require_rerun() -> None:
    """Raise MotionError where rerun-sdk is not installed."""
    try:
        import rerun  # noqa: F401
    except ImportError:
        fault = "a recording for Rerun cannot be written: rerun-sdk is not installed."
        raise MotionError(
            Fault(fault, "--html and --trace, which need nothing more", 'to install it: pip install "contextdb[rerun]"')
        ) from None


def render(view: SessionView, times_s: Sequence[float]) -> bytes:
    """The bytes of a `.rrd` file, of a session and the second of each of its moments."""
    require_rerun()
    import rerun

    recording = rerun.RecordingStream("contextdb", recording_id=view.name)
    stream = recording.binary_stream()
    recording.log("/", rerun.ViewCoordinates.RIGHT_HAND_Y_UP, static=True)
    bones = np.array([(parent, joint) for joint, parent in enumerate(view.parents) if parent >= 0])
    for i, time_s in enumerate(times_s):
        recording.set_time("time", duration=time_s)
        positions = view.positions[i]
        recording.log("character/skeleton", rerun.LineStrips3D(positions[bones], colors=BONE))
        recording.log("character/feet", rerun.Points3D(positions[list(view.feet)][view.contacts[i]], colors=FOOT, radii=FOOT_M))
        if view.bodies is not None:
            x, z, _ = view.bodies[i]
            recording.log("game/body", rerun.Points3D([(x, 0.0, z)], colors=BODY, radii=BODY_M))
        for name, values in view.strips.items():
            if np.isfinite(values[i]):
                recording.log(f"measures/{name}", rerun.Scalars(float(values[i])))
    for change in view.changes:
        recording.set_time("time", duration=change.time_s)
        level = rerun.TextLogLevel.WARN if "forced" in change.texts[0] else rerun.TextLogLevel.INFO
        recording.log("plays", rerun.TextLog(" · ".join(text for text in change.texts if text), level=level))
    recording.flush()
    return bytes(stream.read() or b"")
