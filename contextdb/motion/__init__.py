"""Motion matching over the valid assets: clips, features, exact search, priority databases, characters.

    clips ─────► features ─► MotionDatabase ─► search(query, valid) ─► Hit
    markup ───────────────────────┘   Selector: priority databases in order ─► Choice
                                      Controller: one character in time ─► Decision ─► Trace
                                      PoseStream: its decisions as poses, from a PoseBank ─► Pose
                                      ControllerGroup, PoseStreams: a crowd of either, worked out together
                                      Character, Crowd: stick, body, facts, table and all of this in one update
                                      MatchNode, MatchGate: one-offs that end at a target
                                      JointSearcher, JointNode: clips of several characters, cast and played as one

A table's query says which assets are valid; this finds the best frame among theirs. It takes masks and names, never a table.
Metres, seconds, y up; angles are positive to the left.
"""

from contextdb.errors import ClipError, MotionError, QueryError
from contextdb.motion.characters.character import Character
from contextdb.motion.characters.crowd import Crowd
from contextdb.motion.characters.motion_project import MotionProject
from contextdb.motion.characters.one_off import OneOff
from contextdb.motion.characters.readout import Readout
from contextdb.motion.characters.table_player import TablePlayer
from contextdb.motion.characters.updates import Updated
from contextdb.motion.clips.clip import Clip, load_bvh, write_bvh
from contextdb.motion.clips.mirror import mirrored
from contextdb.motion.clips.poses import poses_of, resampled
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.source import load_clips
from contextdb.motion.clips.steering import Steered
from contextdb.motion.clips.trajectory import Trajectory, root_trajectory, steady_path
from contextdb.motion.features.channels import Channel
from contextdb.motion.features.extraction import query_from, with_path
from contextdb.motion.features.live_query import LivePose, PoseHistory, query_from_pose
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.joint.database import JointDatabase
from contextdb.motion.joint.searcher import JointSearcher
from contextdb.motion.made.game import write_made_clips
from contextdb.motion.markup.marks import TagFilter
from contextdb.motion.markup.markup import Markup
from contextdb.motion.markup.span_faults import Span
from contextdb.motion.measuring.coverage import coverage
from contextdb.motion.measuring.measure import measure
from contextdb.motion.measuring.measures import Measures
from contextdb.motion.nodes.joint_node import JointNode
from contextdb.motion.nodes.match_gate import MatchGate
from contextdb.motion.nodes.match_node import MatchNode
from contextdb.motion.nodes.pose_match import best_start
from contextdb.motion.nodes.warping import Target
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.pose import Pose
from contextdb.motion.output.retargeting import retargeted
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stream import PoseStream
from contextdb.motion.output.streams import PoseStreams
from contextdb.motion.preparing.describing import describe
from contextdb.motion.preparing.proposals import prepare
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.hit import Hit
from contextdb.motion.selection.choice import Choice
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_group import ControllerGroup
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action, Decision
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.selector import Entry, Selector
from contextdb.motion.selection.variation import Variation
from contextdb.motion.storage.building import build, open_or_build
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.pose_files import open_or_build_poses
from contextdb.motion.storage.written_poses import write_poses
from contextdb.motion.trace.session import Trace

__all__ = ["ClipError", "MotionError", "QueryError"]
__all__ += ["Clip", "Skeleton", "Steered", "Trajectory", "load_bvh", "load_clips", "mirrored", "poses_of", "resampled"]
__all__ += ["retargeted", "root_trajectory", "steady_path", "write_bvh", "write_made_clips"]
__all__ += ["Channel", "FeatureSchema", "LivePose", "Markup", "PoseHistory", "Span", "TagFilter", "query_from"]
__all__ += ["query_from_pose", "with_path"]
__all__ += ["Action", "Choice", "Controller", "ControllerGroup", "ControllerSettings", "Decision", "Entry", "Hit"]
__all__ += ["JointDatabase", "JointSearcher", "MotionDatabase", "RootMotion", "Selector", "Variation"]
__all__ += ["JointNode", "MatchGate", "MatchNode", "Pose", "PoseBank", "PoseSettings", "PoseStream", "PoseStreams", "Target"]
__all__ += ["MotionConfig", "best_start", "build", "open_or_build", "open_or_build_poses", "write_poses"]
__all__ += ["Measures", "Trace", "coverage", "describe", "measure", "prepare"]
__all__ += ["Character", "Crowd", "MotionProject", "OneOff", "Readout", "TablePlayer", "Updated"]
