"""Motion matching over the valid assets: clips, features, exact search, priority databases.

    BVH clips ─► features_of ─► MotionDatabase ─► search(query, valid) ─► Hit
                                Selector: priority databases in order ─► Choice

A table's query says which assets are valid; this finds the best frame among theirs. It takes masks and names, never a table.
Metres, seconds, y up; angles are positive to the left. Only numpy is needed.
"""

from contextdb.motion.clips import Clip, load_bvh, load_clips, parse_bvh, write_bvh
from contextdb.motion.config import DatabaseSettings, MotionConfig, SelectorSettings
from contextdb.motion.database import Hit, MotionDatabase, build_databases
from contextdb.motion.extraction import features_of, query_from, with_path
from contextdb.motion.features import Channel, FeatureSchema
from contextdb.motion.feet import Footfalls, footfalls
from contextdb.motion.made import RECIPES, Description, MadeClip, descriptions, made_clips, make_clip, write_made_clips
from contextdb.motion.normalisation import Normalisation
from contextdb.motion.poses import LocalPoses, Poses, forward_kinematics, local_poses, poses_of, resampled
from contextdb.motion.selector import Choice, Entry, Reason, Search, Selector, Status
from contextdb.motion.skeleton import Skeleton
from contextdb.motion.trajectory import Trajectory, root_trajectory, steady_path

__all__ = [
    "RECIPES",
    "Channel",
    "Choice",
    "Clip",
    "DatabaseSettings",
    "Description",
    "Entry",
    "FeatureSchema",
    "Footfalls",
    "Hit",
    "LocalPoses",
    "MadeClip",
    "MotionConfig",
    "MotionDatabase",
    "Normalisation",
    "Poses",
    "Reason",
    "Search",
    "Selector",
    "SelectorSettings",
    "Skeleton",
    "Status",
    "Trajectory",
    "build_databases",
    "descriptions",
    "features_of",
    "footfalls",
    "forward_kinematics",
    "load_bvh",
    "load_clips",
    "local_poses",
    "made_clips",
    "make_clip",
    "parse_bvh",
    "poses_of",
    "query_from",
    "resampled",
    "root_trajectory",
    "steady_path",
    "with_path",
    "write_bvh",
    "write_made_clips",
]
