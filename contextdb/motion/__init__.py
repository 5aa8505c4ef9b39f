"""Motion matching over the valid assets: clips, features, exact search, priority databases, characters.

    BVH clips ─► features ─► MotionDatabase ─► search(query, valid) ─► Hit
    markup ───────────────────────┘   Selector: priority databases in order ─► Choice
                                      Controller: one character in time ─► Decision ─► Trace
                                      MatchNode, MatchGate: one-offs that end at a target

A table's query says which assets are valid; this finds the best frame among theirs. It takes masks and names, never a table.
Metres, seconds, y up; angles are positive to the left. numba makes the search fast and is loaded by the first one.
"""

from contextdb.motion.building import Built, build, build_all, open_or_build, saved_path
from contextdb.motion.candidates import Candidate, Candidates
from contextdb.motion.channels import Channel
from contextdb.motion.choice import Choice, Reason, Search, Status
from contextdb.motion.clips import Clip, load_bvh, load_clips, parse_bvh, write_bvh
from contextdb.motion.config import MotionConfig, SelectorSettings
from contextdb.motion.controller import Controller
from contextdb.motion.controller_settings import ControllerSettings
from contextdb.motion.controller_state import ControllerState
from contextdb.motion.database import Hit, MotionDatabase, build_databases
from contextdb.motion.database_settings import DatabaseSettings
from contextdb.motion.decision import Action, Decision, Playing, Recorder
from contextdb.motion.extraction import ClipFeatures, clip_features, features_of, query_from, with_path
from contextdb.motion.features import CustomFunction, FeatureSchema
from contextdb.motion.feet import Footfalls, footfalls
from contextdb.motion.filters import Biases
from contextdb.motion.left_out import LeftOut, Skip
from contextdb.motion.made import RECIPES, Description, MadeClip, descriptions, made_clips, make_clip, write_made_clips
from contextdb.motion.marks import ANY_TAGS, Mark, Marks, TagFilter
from contextdb.motion.markup import Markup
from contextdb.motion.match_gate import GateLook, MatchGate
from contextdb.motion.match_node import MatchCosts, MatchNode, MatchPlay
from contextdb.motion.mirror import mirrored, mirrored_path, partners_of
from contextdb.motion.normalisation import Normalisation
from contextdb.motion.pose_match import best_start, pose_schema
from contextdb.motion.poses import LocalPoses, Poses, forward_kinematics, local_poses, poses_of, resampled
from contextdb.motion.reserved import ReservedTag
from contextdb.motion.root_motion import RootMotion
from contextdb.motion.selector import Entry, Selector
from contextdb.motion.skeleton import Skeleton
from contextdb.motion.spans import Span
from contextdb.motion.steering import Steered, steered_path
from contextdb.motion.stored import inputs_of, open_database, save_database
from contextdb.motion.trace import Trace
from contextdb.motion.trajectory import Trajectory, root_trajectory, steady_path
from contextdb.motion.variation import Variation
from contextdb.motion.warping import Target, WarpShare

__all__ = [
    "ANY_TAGS",
    "RECIPES",
    "Action",
    "Biases",
    "Built",
    "Candidate",
    "Candidates",
    "Channel",
    "Choice",
    "Clip",
    "ClipFeatures",
    "Controller",
    "ControllerSettings",
    "ControllerState",
    "CustomFunction",
    "DatabaseSettings",
    "Decision",
    "Description",
    "Entry",
    "FeatureSchema",
    "Footfalls",
    "GateLook",
    "Hit",
    "LeftOut",
    "LocalPoses",
    "MadeClip",
    "Mark",
    "Marks",
    "Markup",
    "MatchCosts",
    "MatchGate",
    "MatchNode",
    "MatchPlay",
    "MotionConfig",
    "MotionDatabase",
    "Normalisation",
    "Playing",
    "Poses",
    "Reason",
    "Recorder",
    "ReservedTag",
    "RootMotion",
    "Search",
    "Selector",
    "SelectorSettings",
    "Skeleton",
    "Skip",
    "Span",
    "Status",
    "Steered",
    "TagFilter",
    "Target",
    "Trace",
    "Trajectory",
    "Variation",
    "WarpShare",
    "best_start",
    "build",
    "build_all",
    "build_databases",
    "clip_features",
    "descriptions",
    "features_of",
    "footfalls",
    "forward_kinematics",
    "inputs_of",
    "load_bvh",
    "load_clips",
    "local_poses",
    "made_clips",
    "make_clip",
    "mirrored",
    "mirrored_path",
    "open_database",
    "open_or_build",
    "parse_bvh",
    "partners_of",
    "pose_schema",
    "poses_of",
    "query_from",
    "resampled",
    "root_trajectory",
    "save_database",
    "saved_path",
    "steady_path",
    "steered_path",
    "with_path",
    "write_bvh",
    "write_made_clips",
]
