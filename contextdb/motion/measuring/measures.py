"""The measures of one session: data alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields


@dataclass(frozen=True)
class Measures:
    """The measures of one session. None: `missing` says why, by the name of the measure.

    Attributes
    ----------
    seconds, updates : float, int
        How long it is, and how many moments.
    jumps, jumps_per_s : int, float
    forced_jumps, forced_cost : int, float
        How many jumps had to be because nothing could play on, and what the dearest of them cost.
    jump_cm, jump_worst_cm : float
        How far joints are from where they would have been if what played had played on, against the body: the mean over joints and
        jumps, and the 95 % quantile of the farthest joint.
    jump_mps : float
        The same of velocities: the mean step of a joint's velocity, m/s.
    skate_cm_s, skate_raw_cm_s, skate_played_cm_s : float
        The mean speed over the ground of feet that are down in the clip that plays and are not lifted to another place; that of
        all clips as they are; and that of the frames that played, as their clips have them.
    skate_m_min, skate_raw_m_min : float
        How far feet that are down in the clip slide in a minute, both together.
    skate_weighted_cm_s, skate_weighted_raw_cm_s : float
        The mean of speed x (2 - 2^(h / H)) over feet at a height h below H = 2.5 cm, contacts aside.
    skate_ratio, skate_ratio_raw : float
        The share of time in which a foot below 5 cm is faster than 0.5 m/s, at once and in the mean over 1/6 s.
    skate_worst_cm_s : float
        The same of planted feet in the worst second.
    skate_toe_cm_s, skate_toe_raw_cm_s, skate_toe_worst_cm_s : float
        The mean speed over the ground of what stands of a foot, where it is lower than 3 cm over its floor and slower than 0.5 m/s
        in the source frame: independent of contacts; that of all clips, and in the worst second.
    penetration_cm, penetration_raw_cm : float
        How deep what stands of a foot is at most below the floor of its clip.
    knee_limit_share, knee_limit_raw_share : float
        The share of moments with a knee straighter than 178 degrees.
    hip_dip_cm : float
        How much lower than in the source frame hips are at most.
    hips_off_feet_cm, lean_deg, lean_raw_deg : float
        From two seconds after each stop on: how far hips are at most, over the ground, from where the source frame has them over
        its feet, on the mean of a second; how far the spine leans at most; and in the source frames.
    accel_p99, accel_raw_p99, accel_worst : float
        99 % of the accelerations of joints are lower, m/s², over steps of 1/30 s; those of all clips, and in the worst second.
    snap_share : float
        The share of moments at which a joint's acceleration is above what 99.9 % of the clips' frames have; 0.001 is as the clips.
    path_rms_m, path_p95_m, heading_rms_deg, heading_p95_deg : float
        How far the character is from where the game has the body.
    reach_s, reach_direction_s, reach_speed_s, reach_stop_s : float
        How long it takes until a new velocity is reached that the stick, or else the body, has: in the mean, and of each kind.
    n_changes, n_missed : int
        How many such changes there are, and how many are not reached before the next; these count with the time until that.
    stay_s : float
        How long an animation plays until a jump, in the mean.
    frames_used_share, assets_used_share : float
        How much of the databases is ever played.
    assets_never_used : tuple of str
    frames_unusable_share : float
        How much of the databases can never play, by their markup.
    missing : mapping of str to str
    """

    seconds: float
    updates: int
    jumps: int
    jumps_per_s: float | None = None
    forced_jumps: int = 0
    forced_cost: float | None = None
    jump_cm: float | None = None
    jump_worst_cm: float | None = None
    jump_mps: float | None = None
    skate_cm_s: float | None = None
    skate_raw_cm_s: float | None = None
    skate_played_cm_s: float | None = None
    skate_m_min: float | None = None
    skate_raw_m_min: float | None = None
    skate_weighted_cm_s: float | None = None
    skate_weighted_raw_cm_s: float | None = None
    skate_ratio: float | None = None
    skate_ratio_raw: float | None = None
    skate_worst_cm_s: float | None = None
    skate_toe_cm_s: float | None = None
    skate_toe_raw_cm_s: float | None = None
    skate_toe_worst_cm_s: float | None = None
    penetration_cm: float | None = None
    penetration_raw_cm: float | None = None
    knee_limit_share: float | None = None
    knee_limit_raw_share: float | None = None
    hip_dip_cm: float | None = None
    hips_off_feet_cm: float | None = None
    lean_deg: float | None = None
    lean_raw_deg: float | None = None
    accel_worst: float | None = None
    accel_p99: float | None = None
    accel_raw_p99: float | None = None
    snap_share: float | None = None
    path_rms_m: float | None = None
    path_p95_m: float | None = None
    heading_rms_deg: float | None = None
    heading_p95_deg: float | None = None
    reach_s: float | None = None
    reach_direction_s: float | None = None
    reach_speed_s: float | None = None
    reach_stop_s: float | None = None
    n_changes: int | None = None
    n_missed: int | None = None
    stay_s: float | None = None
    frames_used_share: float | None = None
    assets_used_share: float | None = None
    assets_never_used: tuple[str, ...] | None = None
    frames_unusable_share: float | None = None
    missing: Mapping[str, str] = field(default_factory=dict)

    def to_json(self) -> dict[str, object]:
        """The measures as JSON has them."""
        document = {each.name: getattr(self, each.name) for each in fields(self)}
        never = self.assets_never_used
        return {**document, "assets_never_used": None if never is None else list(never), "missing": dict(self.missing)}
