"""Motion matching over the valid assets: clips, features, exact search, priority databases, characters.

    BVH clips ─► features ─► MotionDatabase ─► search(query, valid) ─► Hit
    markup ───────────────────────┘   Selector: priority databases in order ─► Choice
                                      Controller: one character in time ─► Decision ─► Trace
                                      PoseStream: its decisions as poses, from a PoseBank ─► Pose
                                      ControllerGroup, PoseStreams: a crowd of either, worked out together
                                      Character, Crowd: stick, body, facts, table and all of this in one update
                                      MatchNode, MatchGate: one-offs that end at a target
                                      JointSearcher, JointNode: clips of several characters, cast and played as one

A table's query says which assets are valid; this finds the best frame among theirs. It takes masks and names, never a table.
Metres, seconds, y up; angles are positive to the left. numba makes the search fast and is loaded by the first one.
"""

from contextdb.errors import ClipError, MotionError, QueryError
from contextdb.motion.characters.character import Character
from contextdb.motion.characters.crowd import Crowd
from contextdb.motion.characters.facts import FACTS, Moment
from contextdb.motion.characters.motion_project import MotionProject
from contextdb.motion.characters.one_off import OneOff
from contextdb.motion.characters.paths import path_ahead, path_from
from contextdb.motion.characters.readout import Readout
from contextdb.motion.characters.updates import CharacterState, Updated
from contextdb.motion.clips.clip import Clip, load_bvh, load_clips, parse_bvh, write_bvh
from contextdb.motion.clips.doubts import ClipFinding, doubts_of
from contextdb.motion.clips.feet import Footfalls, footfalls
from contextdb.motion.clips.many_paths import ManyTrajectories
from contextdb.motion.clips.many_steered import ManySteered, steered_paths
from contextdb.motion.clips.mirror import mirrored, mirrored_path, partners_of
from contextdb.motion.clips.poses import LocalPoses, Poses, forward_kinematics, local_poses, poses_of, resampled
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.steering import Steered, steered_path
from contextdb.motion.clips.trajectory import Trajectory, root_trajectory, steady_path
from contextdb.motion.features.channels import Channel
from contextdb.motion.features.extraction import ClipFeatures, clip_features, clip_permutations, features_of, query_from, with_path
from contextdb.motion.features.live_query import LivePose, PoseHistory, query_from_pose
from contextdb.motion.features.many_queries import with_paths
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.features.permutations import Permutations
from contextdb.motion.features.schema import CustomFunction, FeatureSchema
from contextdb.motion.joint.database import JointDatabase
from contextdb.motion.joint.hit import JointHit
from contextdb.motion.joint.searcher import JointSearcher
from contextdb.motion.made.game import write_game_clips
from contextdb.motion.made.joint import JOINT_RECIPES, make_joint_clip, write_joint_clips
from contextdb.motion.made.recipes import (
    ABOUT_TURNS,
    RECIPES,
    Description,
    MadeClip,
    descriptions,
    made_clips,
    make_clip,
    write_made_clips,
)
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.markup.marks import ANY_TAGS, Mark, Marks, TagFilter
from contextdb.motion.markup.markup import Markup
from contextdb.motion.markup.reserved import ReservedTag
from contextdb.motion.markup.spans import Span
from contextdb.motion.measuring.coverage import ClipFrames, ContextCoverage, MotionCoverage, ToCapture, coverage
from contextdb.motion.measuring.measure import measure
from contextdb.motion.measuring.measures import Measures
from contextdb.motion.measuring.near_clips import Near
from contextdb.motion.measuring.transition_names import TransitionCoverage
from contextdb.motion.measuring.wanted import ClipContexts
from contextdb.motion.nodes.joint_node import JointNode, JointPlay
from contextdb.motion.nodes.match_gate import GateLook, MatchGate
from contextdb.motion.nodes.match_node import MatchCosts, MatchNode, MatchPlay
from contextdb.motion.nodes.pose_match import best_start, pose_schema
from contextdb.motion.nodes.warping import Target, WarpShare
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.pose import CrowdPoses, Pose
from contextdb.motion.output.retargeting import retargeted
from contextdb.motion.output.samples import Sample
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.stream import PoseState, PoseStream
from contextdb.motion.output.streams import PoseStreams
from contextdb.motion.output.track import clip_of_poses, pose_arrays
from contextdb.motion.preparing.clip_facts import ClipFacts, Spread
from contextdb.motion.preparing.describing import Described, describe
from contextdb.motion.preparing.proposal import Proposal
from contextdb.motion.preparing.proposals import prepare
from contextdb.motion.search.candidates import Candidate, Candidates
from contextdb.motion.search.database import MotionDatabase, build_databases
from contextdb.motion.search.filters import Biases
from contextdb.motion.search.hit import Hit
from contextdb.motion.selection.choice import Choice, Reason, Search, Status
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_group import ControllerGroup
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.controller_state import ControllerState
from contextdb.motion.selection.decision import Action, Decision, Playing, Recorder, Together
from contextdb.motion.selection.inputs import Inputs
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.selector import Entry, Selector
from contextdb.motion.selection.variation import Variation
from contextdb.motion.storage.building import Built, build, build_all, open_or_build, saved_path
from contextdb.motion.storage.config import MotionConfig, SelectorSettings
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.motion.storage.pose_files import open_or_build_poses, open_poses, poses_path, save_poses
from contextdb.motion.storage.stored import inputs_of, open_database, save_database
from contextdb.motion.storage.written_poses import write_arrays, write_poses
from contextdb.motion.trace.reasked import Reasked
from contextdb.motion.trace.reasked_decision import ReaskedDecision
from contextdb.motion.trace.reasked_search import ReaskedSearch
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.session_diff import Parting, SessionDiff
from contextdb.motion.trace.stats import SessionStats
from contextdb.motion.trace.what_if import ChangedChoice, WhatIf
from contextdb.motion.trace.why_not import WhyNot
from contextdb.motion.trace.winning_changes import Change, ChangePart
from contextdb.motion.walking.baked import baked_cycle
from contextdb.motion.walking.blending import Gait
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.footsteps import Footstep
from contextdb.motion.walking.stances import Stances
from contextdb.motion.walking.transitions import Missing, Transitions
from contextdb.motion.walking.walked import walked_clips
from contextdb.motion.walking.walker import Walker, WalkSettings, WalkState

__all__ = ["ClipError", "MotionError", "QueryError"]
__all__ += ["Clip", "ClipFinding", "Footfalls", "LocalPoses", "ManySteered", "ManyTrajectories", "Poses", "Skeleton", "Steered"]
__all__ += ["Trajectory", "doubts_of", "footfalls", "forward_kinematics", "load_bvh", "load_clips", "local_poses", "mirrored"]
__all__ += ["mirrored_path", "parse_bvh", "partners_of", "poses_of", "resampled", "root_trajectory", "steady_path"]
__all__ += ["steered_path", "steered_paths", "write_bvh"]
__all__ += ["ANY_TAGS", "LeftOut", "Mark", "Marks", "Markup", "ReservedTag", "Skip", "Span", "TagFilter"]
__all__ += ["Channel", "ClipFeatures", "CustomFunction", "FeatureSchema", "LivePose", "Normalisation", "Permutations"]
__all__ += ["PoseHistory", "clip_features", "clip_permutations", "features_of", "query_from", "query_from_pose", "with_path"]
__all__ += ["with_paths"]
__all__ += ["ABOUT_TURNS", "JOINT_RECIPES", "RECIPES", "Description", "MadeClip", "descriptions", "made_clips", "make_clip"]
__all__ += ["make_joint_clip", "write_game_clips", "write_joint_clips", "write_made_clips"]
__all__ += ["Biases", "Candidate", "Candidates", "Hit", "MotionDatabase", "build_databases"]
__all__ += ["JointDatabase", "JointHit", "JointSearcher"]
__all__ += ["Action", "Choice", "Controller", "ControllerGroup", "ControllerSettings", "ControllerState", "Decision", "Entry"]
__all__ += ["Inputs", "Playing", "Reason", "Recorder", "RootMotion", "Search", "Selector", "Status", "Together", "Variation"]
__all__ += ["GateLook", "JointNode", "JointPlay", "MatchCosts", "MatchGate", "MatchNode", "MatchPlay", "Target", "WarpShare"]
__all__ += ["best_start", "pose_schema"]
__all__ += ["CrowdPoses", "Pose", "PoseBank", "PoseSettings", "PoseState", "PoseStream", "PoseStreams", "Sample", "clip_of_poses"]
__all__ += ["pose_arrays", "retargeted"]
__all__ += ["Cycle", "Footstep", "Gait", "Missing", "Stances", "Transitions", "WalkSettings", "WalkState", "Walker"]
__all__ += ["baked_cycle", "walked_clips"]
__all__ += ["Built", "DatabaseSettings", "MotionConfig", "SelectorSettings", "build", "build_all", "inputs_of", "open_database"]
__all__ += ["open_or_build", "open_or_build_poses", "open_poses", "poses_path", "save_database", "save_poses", "saved_path"]
__all__ += ["write_arrays", "write_poses"]
__all__ += ["Change", "ChangePart", "ChangedChoice", "Parting", "Reasked", "ReaskedDecision", "ReaskedSearch", "SessionDiff"]
__all__ += ["SessionStats", "Trace", "WhatIf", "WhyNot"]
__all__ += ["ClipContexts", "ClipFrames", "ContextCoverage", "Measures", "MotionCoverage", "Near", "ToCapture"]
__all__ += ["TransitionCoverage", "coverage", "measure"]
__all__ += ["ClipFacts", "Described", "Proposal", "Spread", "describe", "prepare"]
__all__ += ["FACTS", "Character", "CharacterState", "Crowd", "Moment", "MotionProject", "OneOff", "Readout", "Updated"]
__all__ += ["path_ahead", "path_from"]
