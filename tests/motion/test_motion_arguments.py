"""Wrong arguments: no public call of `contextdb.motion` ends in an error that does not say what was wrong."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from strategies import some

from contextdb import motion
from contextdb.errors import ContextDBError
from contextdb.motion.characters.paths import path_ahead, path_from
from contextdb.motion.clips.clip import parse_bvh
from contextdb.motion.clips.doubts import doubts_of
from contextdb.motion.clips.feet import footfalls
from contextdb.motion.clips.many_steered import ManySteered, steered_paths
from contextdb.motion.clips.mirror import mirrored_path, partners_of
from contextdb.motion.clips.poses import forward_kinematics, local_poses
from contextdb.motion.clips.steering import steered_path
from contextdb.motion.features.extraction import clip_features, clip_permutations, features_of
from contextdb.motion.features.path_features import with_paths
from contextdb.motion.made.joint import make_joint_clip, write_joint_clips
from contextdb.motion.made.recipes import descriptions, make_clip
from contextdb.motion.measuring.wanted import ClipContexts
from contextdb.motion.nodes.pose_match import pose_schema
from contextdb.motion.output.track import clip_of_poses, pose_arrays
from contextdb.motion.search.database import build_databases
from contextdb.motion.search.filters import Biases
from contextdb.motion.storage.building import build_all, saved_path
from contextdb.motion.storage.pose_files import open_poses, poses_path, save_poses
from contextdb.motion.storage.stored import inputs_of, open_database, save_database
from contextdb.motion.storage.written_poses import write_arrays
from contextdb.motion.walking.baked import baked_cycle
from contextdb.motion.walking.blending import Gait
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.stances import Stances
from contextdb.motion.walking.transitions import Transitions
from contextdb.motion.walking.walked import walked_clips
from contextdb.motion.walking.walker import Walker


class Odd:
    """Something that no function expects."""


WRONG: list[object] = [
    None, True, 0, -1, 1, 99, 2**70, 1.5, -0.5, float("nan"), float("inf"), "", "x", "a\0b", "\ud800", b"x", [], [5], ["x"],
    [[]], [None], {}, {5: 5}, {"x": 5}, {"x": [5]}, (1, 2), (1, 2, 3), ("x", "y"), {1}, np.zeros((2, 2)), np.arange(3), np.zeros(0),
    Odd(), Odd, Path("none"),
]  # fmt: skip
CLIP = make_clip("idle").clip
LOCAL, POSES = local_poses(CLIP), motion.poses_of(CLIP, 30.0)
PATH = motion.root_trajectory(POSES)
CHANNELS = [{"type": "trajectory", "what": "position", "at": [0.2]}, {"type": "position", "bone": "Hips"}]
SCHEMA = motion.FeatureSchema.from_dict("pose", {"rate": 30, "channels": CHANNELS})
PARTS = [clip_features(CLIP, SCHEMA)]
DATABASE = motion.MotionDatabase.from_features(np.eye(4, 2), [0, 2], [2, 4], ["a", "b"])
SELECTOR = motion.Selector([motion.Entry("only", DATABASE)])
QUERY = [0.0, 1.0]
RECORDED = motion.Trace(2)
motion.Controller(SELECTOR, recorder=RECORDED).update(0.1, QUERY)
REASKED = RECORDED.reasked()
STEERED = [motion.Steered()]
MANY_STEERED = ManySteered.of(STEERED)
CONFIG = motion.MotionConfig()
FALLS = footfalls(CLIP)
LIVE = motion.LivePose(motion.poses_of(CLIP).positions[0], local_poses(CLIP).rotations[0])
HISTORY = motion.PoseHistory(CLIP.skeleton)
NODE = motion.MatchNode(motion.MotionDatabase.build([CLIP], SCHEMA))
PLAY = NODE.enter(NODE.database.raw(0), motion.Target(0, 1))
BANK = motion.PoseBank.build([CLIP], SCHEMA)
BUILT = motion.MotionDatabase.build([CLIP], SCHEMA)
DECISION = motion.Controller(motion.Selector([motion.Entry("only", BUILT)])).update(0.0, BUILT.raw(0))
BY_CLIP = motion.PoseSettings(root="animation")
POSED = [motion.PoseStream(BANK, BY_CLIP).update(DECISION, 0.1)]
PLAYER = motion.Character(motion.Controller(motion.Selector([motion.Entry("only", BUILT)])), SCHEMA, None, motion.PoseStream(BANK))
WALKED = Cycle.of(make_clip("walk").clip)
WALKS = [Gait("walk", [WALKED])]
STANCES = WALKED.stances
JOINT = motion.JointDatabase.of(motion.MotionDatabase.build(make_joint_clip("greet_walk").values(), SCHEMA), ("Host", "Guest"))
TOGETHER = motion.JointSearcher(JOINT)
POSED_TWO = {5: JOINT.database.raw(0), 6: JOINT.database.raw(0)}
PLACED_TWO = {5: (0.0, 0.0, 0.0), 6: (0.0, 1.0, 3.0)}
MET = motion.JointNode(TOGETHER).enter(POSED_TWO, PLACED_TWO)
Call = Callable[[object], object]
CALLS: dict[str, Call] = {
    "describe(clips)": lambda x: motion.describe(x),
    "describe(clips), one": lambda x: motion.describe([x]),
    "describe(mirrored)": lambda x: motion.describe([CLIP], mirrored=x),
    "describe(progress)": lambda x: x is Odd or motion.describe([CLIP], progress=x),
    "prepare(clips)": lambda x: motion.prepare(x),
    "prepare(clips), one": lambda x: motion.prepare([x]),
    "prepare(markup)": lambda x: motion.prepare([CLIP], x),
    "prepare(kinds)": lambda x: motion.prepare([CLIP], kinds=x),
    "prepare(kinds), one": lambda x: motion.prepare([CLIP], kinds=[x]),
    "prepare(progress)": lambda x: x is Odd or motion.prepare([CLIP], progress=x),
    "load_bvh(path)": lambda x: motion.load_bvh(x),
    "load_bvh(metres_per_unit)": lambda x: parse_bvh("", "a", metres_per_unit=x),
    "load_clips(paths)": lambda x: motion.load_clips(x),
    "load_clips(paths), one": lambda x: motion.load_clips([x]),
    "parse_bvh(text)": lambda x: parse_bvh(x, "a"),
    "write_bvh(clip)": lambda x: motion.write_bvh(x, "/nowhere/x.bvh"),
    "write_bvh(target)": lambda x: isinstance(x, (str, Path)) or motion.write_bvh(CLIP, x),
    "write_bvh(digits)": lambda x: motion.write_bvh(CLIP, "/nowhere/x.bvh", digits=x),
    "poses_of(clip)": lambda x: motion.poses_of(x),
    "poses_of(rate)": lambda x: motion.poses_of(CLIP, x),
    "local_poses(clip)": lambda x: local_poses(x),
    "resampled(local)": lambda x: motion.resampled(x, 30.0),
    "resampled(rate)": lambda x: motion.resampled(LOCAL, x),
    "forward_kinematics(local)": lambda x: forward_kinematics(x),
    "root_trajectory(poses)": lambda x: motion.root_trajectory(x),
    "root_trajectory(root)": lambda x: motion.root_trajectory(POSES, x),
    "root_trajectory(facing)": lambda x: motion.root_trajectory(POSES, facing=x),
    "root_trajectory(facing_smooth_s)": lambda x: motion.root_trajectory(POSES, facing_smooth_s=x),
    "footfalls(clip)": lambda x: footfalls(x),
    "footfalls(feet)": lambda x: footfalls(CLIP, x),
    "footfalls(slowest_mps)": lambda x: footfalls(CLIP, slowest_mps=x),
    "mirrored(moved)": lambda x: motion.mirrored(x, [("LeftFoot", "RightFoot")]),
    "mirrored(pairs)": lambda x: motion.mirrored(POSES, x),
    "mirrored_path(path)": lambda x: mirrored_path(x),
    "partners_of(skeleton)": lambda x: partners_of(x, []),
    "partners_of(pairs)": lambda x: partners_of(CLIP.skeleton, x),
    "doubts_of(clips)": lambda x: doubts_of(x),
    "doubts_of(clips), one": lambda x: doubts_of([x]),
    "make_clip(name)": lambda x: make_clip(x),
    "write_made_clips(folder)": lambda x: isinstance(x, (str, Path)) or motion.write_made_clips(x),
    "descriptions(clips)": lambda x: x is None or descriptions(x),
    "descriptions(clips), one": lambda x: descriptions([x]),
    "clip_features(clip)": lambda x: clip_features(x, SCHEMA),
    "clip_features(schema)": lambda x: clip_features(CLIP, x),
    "clip_permutations(clip)": lambda x: clip_permutations(x, SCHEMA),
    "clip_permutations(schema)": lambda x: clip_permutations(CLIP, x),
    "query_from(permutation)": lambda x: motion.query_from(SCHEMA, CLIP, 0, permutation=x),
    "features_of(clip)": lambda x: features_of(x, SCHEMA),
    "features_of(schema)": lambda x: features_of(CLIP, x),
    "query_from(schema)": lambda x: motion.query_from(x, CLIP),
    "query_from(clip)": lambda x: motion.query_from(SCHEMA, x),
    "query_from(frame)": lambda x: motion.query_from(SCHEMA, CLIP, x),
    "query_from_pose(schema)": lambda x: motion.query_from_pose(x, LIVE, HISTORY),
    "query_from_pose(pose)": lambda x: motion.query_from_pose(SCHEMA, x, HISTORY),
    "query_from_pose(history)": lambda x: motion.query_from_pose(SCHEMA, LIVE, x),
    "PoseHistory(skeleton)": lambda x: motion.PoseHistory(x),
    "PoseHistory(rate)": lambda x: motion.PoseHistory(CLIP.skeleton, x),
    "PoseHistory(seconds)": lambda x: motion.PoseHistory(CLIP.skeleton, 30.0, x),
    "PoseHistory.add(pose)": lambda x: HISTORY.add(x),
    "query_from(wanted)": lambda x: motion.query_from(SCHEMA, CLIP, 0, x),
    "with_path(schema)": lambda x: motion.with_path(x, PARTS[0].features[0], PATH),
    "with_path(query)": lambda x: motion.with_path(SCHEMA, x, PATH),
    "with_path(wanted)": lambda x: motion.with_path(SCHEMA, PARTS[0].features[0], x),
    "steady_path(speed_mps)": lambda x: motion.steady_path(x),
    "steady_path(turn_dps)": lambda x: motion.steady_path(1.0, x),
    "steady_path(strafe_deg)": lambda x: motion.steady_path(1.0, strafe_deg=x),
    "steady_path(reach_s)": lambda x: motion.steady_path(1.0, reach_s=x),
    "steady_path(rate)": lambda x: motion.steady_path(1.0, rate=x),
    "steered_path(past)": lambda x: steered_path(x, (0.0, 1.0)),
    "steered_path(past), one": lambda x: steered_path([x], (0.0, 1.0)),
    "steered_path(wanted)": lambda x: steered_path(STEERED, x),
    "steered_path(facing)": lambda x: steered_path(STEERED, (0.0, 1.0), x),
    "steered_path(reach_s)": lambda x: steered_path(STEERED, (0.0, 1.0), reach_s=x),
    "steered_paths(past)": lambda x: steered_paths(x, [(0.0, 1.0)]),
    "steered_paths(past), one": lambda x: steered_paths([x], [(0.0, 1.0)]),
    "steered_paths(wanted)": lambda x: steered_paths([MANY_STEERED], x),
    "steered_paths(facing)": lambda x: steered_paths([MANY_STEERED], [(0.0, 1.0)], x),
    "steered_paths(reach_s)": lambda x: steered_paths([MANY_STEERED], [(0.0, 1.0)], reach_s=x),
    "steered_paths(rate)": lambda x: steered_paths([MANY_STEERED], [(0.0, 1.0)], rate=x),
    "with_paths(schema)": lambda x: with_paths(x, PARTS[0].features[:1], [PATH]),
    "with_paths(queries)": lambda x: with_paths(SCHEMA, x, [PATH]),
    "with_paths(wanted)": lambda x: with_paths(SCHEMA, PARTS[0].features[:1], x),
    "with_paths(wanted), one": lambda x: with_paths(SCHEMA, PARTS[0].features[:1], [x]),
    "steered_path(rate)": lambda x: steered_path(STEERED, (0.0, 1.0), rate=x),
    "build(config)": lambda x: motion.build(x, "none"),
    "build(folder)": lambda x: motion.build(CONFIG, x),
    "build(assets)": lambda x: motion.build(CONFIG, "none", x),
    "build(names)": lambda x: motion.build(CONFIG, "none", names=x),
    "build_all(config)": lambda x: build_all(x, "none"),
    "open_or_build(config)": lambda x: motion.open_or_build(x, "none"),
    "open_or_build(folder)": lambda x: motion.open_or_build(CONFIG, x),
    "open_or_build(names)": lambda x: motion.open_or_build(CONFIG, "none", names=x),
    "build_databases(sets)": lambda x: build_databases(x, SCHEMA),
    "build_databases(sets), one": lambda x: build_databases({"a": [x]}, SCHEMA),
    "build_databases(schema)": lambda x: build_databases({"a": [CLIP]}, x),
    "save_database(database)": lambda x: save_database(x, "/nowhere/x.safetensors"),
    "save_database(path)": lambda x: isinstance(x, (str, Path)) or save_database(DATABASE, x),
    "open_database(path)": lambda x: open_database(x),
    "saved_path(folder)": lambda x: saved_path(x, "loco"),
    "saved_path(name)": lambda x: saved_path(Path("none"), x),
    "inputs_of(path)": lambda x: inputs_of(x),
    "MotionDatabase.build(clips)": lambda x: motion.MotionDatabase.build(x, SCHEMA),
    "MotionDatabase.build(clips), one": lambda x: motion.MotionDatabase.build([x], SCHEMA),
    "MotionDatabase.build(schema)": lambda x: motion.MotionDatabase.build([CLIP], x),
    "MotionDatabase.build(mirror)": lambda x: motion.MotionDatabase.build([CLIP], SCHEMA, mirror=x),
    "MotionDatabase.build(biases)": lambda x: motion.MotionDatabase.build([CLIP], SCHEMA, biases=x),
    "MotionDatabase.build(end_s)": lambda x: motion.MotionDatabase.build([CLIP], SCHEMA, end_s=x),
    "from_features(features)": lambda x: motion.MotionDatabase.from_features(x, [0], [2], ["a"]),
    "from_features(starts)": lambda x: motion.MotionDatabase.from_features(np.eye(4, 2), x, [2], ["a"]),
    "from_features(stops)": lambda x: motion.MotionDatabase.from_features(np.eye(4, 2), [0], x, ["a"]),
    "from_features(assets)": lambda x: motion.MotionDatabase.from_features(np.eye(4, 2), [0], [2], x),
    "from_features(assets), one": lambda x: motion.MotionDatabase.from_features(np.eye(4, 2), [0], [2], [x]),
    "search(query)": lambda x: DATABASE.search(x),
    "search(valid)": lambda x: DATABASE.search(QUERY, x),
    "search(tags)": lambda x: DATABASE.search(QUERY, tags=x),
    "search(current)": lambda x: DATABASE.search(QUERY, current=x),
    "search(bias)": lambda x: DATABASE.search(QUERY, bias=x),
    "search(skip)": lambda x: DATABASE.search(QUERY, skip=x),
    "search(skip), one": lambda x: DATABASE.search(QUERY, skip=[x]),
    "search(penalties)": lambda x: DATABASE.search(QUERY, penalties=x),
    "search_many(queries)": lambda x: DATABASE.search_many(x),
    "search_many(valid)": lambda x: DATABASE.search_many([QUERY], x),
    "search_many(current)": lambda x: DATABASE.search_many([QUERY], current=x),
    "search_many(tags)": lambda x: DATABASE.search_many([QUERY], tags=x),
    "best_of_ranges(within)": lambda x: DATABASE.best_of_ranges(QUERY, x),
    "candidates(query)": lambda x: DATABASE.candidates(x),
    "candidates(k)": lambda x: DATABASE.candidates(QUERY, x),
    "MotionDatabase.time_s(hit)": lambda x: BUILT.time_s(x),
    "MotionDatabase.frame_at(range_number)": lambda x: BUILT.frame_at(x, 0.0),
    "MotionDatabase.frame_at(time_s)": lambda x: BUILT.frame_at(0, x),
    "MotionDatabase.range_of(frame)": lambda x: DATABASE.range_of(x),
    "MotionDatabase.channel_costs(frame)": lambda x: DATABASE.channel_costs(x, QUERY),
    "MotionDatabase.normalised(query)": lambda x: DATABASE.normalised(x),
    "MotionDatabase.with_weights(weights)": lambda x: DATABASE.with_weights(x),
    "MotionDatabase.filter(valid)": lambda x: DATABASE.filter(x),
    "MotionDatabase.ranges_of(valid)": lambda x: DATABASE.ranges_of(x),
    "Selector(entries)": lambda x: motion.Selector(x),
    "Selector(entries), one": lambda x: motion.Selector([x]),
    "Selector.search(valid)": lambda x: SELECTOR.search(QUERY, x),
    "Selector.search(bias)": lambda x: SELECTOR.search(QUERY, bias=x),
    "Selector.search(among)": lambda x: SELECTOR.search(QUERY, among=x),
    "Controller(selector)": lambda x: motion.Controller(x),
    "Controller(settings)": lambda x: motion.Controller(SELECTOR, x),
    "Controller.update(dt_s)": lambda x: motion.Controller(SELECTOR).update(x, QUERY),
    "Controller.update(query)": lambda x: motion.Controller(SELECTOR).update(0.1, x),
    "Controller.update(valid)": lambda x: motion.Controller(SELECTOR).update(0.1, QUERY, x),
    "Controller.restore(state)": lambda x: motion.Controller(SELECTOR).restore(x),
    "Markup.load(path)": lambda x: motion.Markup.load(x),
    "Trace.load(path)": lambda x: motion.Trace.load(x),
    "best_start(database)": lambda x: motion.best_start(x, QUERY),
    "best_start(query)": lambda x: motion.best_start(DATABASE, x),
    "best_start(assets)": lambda x: motion.best_start(DATABASE, QUERY, x),
    "pose_schema(skeleton)": lambda x: pose_schema(x),
    "pose_schema(bones)": lambda x: pose_schema(CLIP.skeleton, x),
    "pose_schema(rate)": lambda x: pose_schema(CLIP.skeleton, rate=x),
    "ControllerSettings(variation)": lambda x: motion.ControllerSettings(variation=x),
    "TagFilter(include)": lambda x: motion.TagFilter(x),
    "TagFilter(prefer)": lambda x: motion.TagFilter(prefer=x),
    "Trace(n_candidates)": lambda x: motion.Trace(x),
    "Trace(databases)": lambda x: motion.Trace(1, x),
    "Trace.from_bytes(raw)": lambda x: motion.Trace.from_bytes(x),
    "Trace.save(path)": lambda x: isinstance(x, (str, Path)) or motion.Trace().save(x),
    "Trace.record(decision)": lambda x: motion.Trace().record(x),
    "Trace.columns(names)": lambda x: RECORDED.columns(x),
    "Trace.columns(names), one": lambda x: RECORDED.columns([x]),
    "Trace.events(index)": lambda x: RECORDED.events(x),
    "PoseStream.is_like(other)": lambda x: motion.PoseStream(BANK).is_like(x),
    "Trace[]": lambda x: motion.Trace()[x],
    "Trace.use(databases)": lambda x: motion.Trace().use(x),
    "Trace.reasked(project)": lambda x: x is None or motion.Trace().reasked(x),
    "Trace.reasked(weights)": lambda x: x is None or motion.Trace(1, {"a": DATABASE}).reasked(weights=x),
    "Trace.reasked(thresholds)": lambda x: x is None or motion.Trace().reasked(thresholds=x),
    "Trace.reasked(biases)": lambda x: x is None or motion.Trace().reasked(biases=x),
    "Trace.reasked(tables)": lambda x: x is None or motion.Trace().reasked(tables=x),
    "Reasked[]": lambda x: REASKED[x],
    "Reasked.why_not(index)": lambda x: REASKED.why_not(x, "a"),
    "Reasked.why_not(asset)": lambda x: REASKED.why_not(0, x),
    "ReaskedDecision.best_of_assets(text)": lambda x: REASKED[0].best_of_assets(x),
    "ReaskedDecision.rank(asset)": lambda x: REASKED[0].rank(x),
    "ReaskedDecision.with_weights(weights)": lambda x: REASKED[0].with_weights(x),
    "Trace.what_if(project)": lambda x: x is None or RECORDED.what_if(x),
    "Trace.what_if(weights)": lambda x: x is None or RECORDED.what_if(weights=x),
    "Trace.diff(other)": lambda x: motion.Trace().diff(x),
    "MatchNode(database)": lambda x: motion.MatchNode(x),
    "MatchNode(position_weight)": lambda x: motion.MatchNode(DATABASE, position_weight=x),
    "JointDatabase.of(database)": lambda x: motion.JointDatabase.of(x, ["Host", "Guest"]),
    "JointDatabase.of(roles)": lambda x: motion.JointDatabase.of(JOINT.database, x),
    "JointDatabase.of(place_weight)": lambda x: motion.JointDatabase.of(JOINT.database, JOINT.roles, place_weight=x),
    "JointDatabase.with_weights(weights)": lambda x: JOINT.with_weights(x),
    "JointDatabase.with_weights(facing_weight)": lambda x: JOINT.with_weights(facing_weight=x),
    "JointSearcher(databases)": lambda x: motion.JointSearcher(x),
    "JointSearcher(databases), one": lambda x: motion.JointSearcher({"joint": x}),
    "JointSearcher(thresholds)": lambda x: motion.JointSearcher(JOINT, x),
    "JointSearcher(thresholds), one": lambda x: motion.JointSearcher(JOINT, {"joint": x}),
    "JointSearcher.search(queries)": lambda x: TOGETHER.search(x, PLACED_TWO),
    "JointSearcher.search(queries), one": lambda x: TOGETHER.search(POSED_TWO | {6: x}, PLACED_TWO),
    "JointSearcher.search(places)": lambda x: TOGETHER.search(POSED_TWO, x),
    "JointSearcher.search(places), one": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO | {6: x}),
    "JointSearcher.search(valid)": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, valid=x),
    "JointSearcher.search(casts)": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, casts=x),
    "JointSearcher.search(casts), one": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, casts=[x]),
    "JointSearcher.search(casts), actor": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, casts=[{"Host": x, "Guest": 5}]),
    "JointSearcher.search(tags)": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, tags=x),
    "JointSearcher.search(in_match_range)": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, in_match_range=x),
    "JointSearcher.search(bias)": lambda x: x is None or TOGETHER.search(POSED_TWO, PLACED_TWO, bias=x),
    "JointSearcher.search(skip)": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, skip=x),
    "JointSearcher.search(gives)": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, gives=x),
    "JointSearcher.search(gives), one": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, gives={"Host": x}),
    "JointSearcher.candidates(k)": lambda x: TOGETHER.candidates(POSED_TWO, PLACED_TWO, x),
    "JointNode(searcher)": lambda x: motion.JointNode(x),
    "JointNode.play(hit)": lambda x: motion.JointNode(TOGETHER).play(x, PLACED_TWO),
    "JointNode.play(places)": lambda x: motion.JointNode(TOGETHER).play(MET.hit, x),
    "JointPlay.advance(dt_s)": lambda x: MET.advance(x),
    "JointPlay.at(time_s)": lambda x: MET.at(x),
    "JointPlay.decision(role)": lambda x: MET.decision(x),
    "JointPlay.decision(tick)": lambda x: MET.decision("Host", tick=x),
    "JointPlay.decision(time_s)": lambda x: x is None or MET.decision("Host", time_s=x),
    "JointPlay.decision(database)": lambda x: isinstance(x, str) or MET.decision("Host", x),
    "make_joint_clip(name)": lambda x: make_joint_clip(x),
    "write_made_clips(of_game)": lambda x: x is False or motion.write_made_clips("nowhere", of_game=x),
    "write_joint_clips(folder)": lambda x: isinstance(x, (str, Path)) or write_joint_clips(x),
    "MatchGate(over)": lambda x: motion.MatchGate(x, 1.0),
    "MatchGate(threshold)": lambda x: motion.MatchGate(DATABASE, x),
    "MatchGate.update(query)": lambda x: motion.MatchGate(DATABASE, 1.0).update(x),
    "MatchNode.enter(query)": lambda x: NODE.enter(x, motion.Target(0, 1)),
    "MatchPlay.decision(database)": lambda x: isinstance(x, str) or PLAY.decision(x),
    "MatchNode.enter(target)": lambda x: NODE.enter([0.0] * SCHEMA.n_features, x),
    "Target(left_m)": lambda x: motion.Target(x, 1.0),
    "Markup.parse(text)": lambda x: motion.Markup.parse(x),
    "Markup(spans)": lambda x: motion.Markup(x),
    "Span(asset)": lambda x: motion.Span(x, "t"),
    "Entry(database)": lambda x: motion.Selector([motion.Entry("a", x)]),
    "Entry(name)": lambda x: motion.Selector([motion.Entry(x, DATABASE)]),
    "Entry(threshold)": lambda x: motion.Selector([motion.Entry("a", DATABASE, x)]),
    "Biases(base)": lambda x: Biases(x),
    "Clip(name)": lambda x: motion.Clip(x, CLIP.skeleton, 0.1, CLIP.values),
    "Clip(skeleton)": lambda x: motion.Clip("a", x, 0.1, CLIP.values),
    "Clip(frame_time_s)": lambda x: motion.Clip("a", CLIP.skeleton, x, CLIP.values),
    "Clip(values)": lambda x: motion.Clip("a", CLIP.skeleton, 0.1, x),
    "FeatureSchema.from_dict(mapping)": lambda x: motion.FeatureSchema.from_dict("a", x),
    "FeatureSchema.from_dict(name)": lambda x: motion.FeatureSchema.from_dict(x, {"rate": 30, "channels": CHANNELS}),
    "MotionConfig.from_dict()": lambda x: motion.MotionConfig.from_dict(x),
    "PoseSettings.from_dict()": lambda x: motion.PoseSettings.from_dict(x),
    "MotionConfig.database()": lambda x: CONFIG.database(x),
    "MotionConfig.selector()": lambda x: CONFIG.selector(x, {}),
    "MotionConfig.controller()": lambda x: CONFIG.controller(x, {}),
    "Footfalls.is_down(foot)": lambda x: FALLS.is_down(x, 0.1),
    "MotionDatabase.channel_costs()": lambda x: DATABASE.channel_costs(x, QUERY),
    "PoseBank.build(clips)": lambda x: motion.PoseBank.build(x, SCHEMA),
    "PoseBank.build(clips), one": lambda x: motion.PoseBank.build([x], SCHEMA),
    "PoseBank.build(schema)": lambda x: motion.PoseBank.build([CLIP], x),
    "PoseBank.sample(asset)": lambda x: BANK.sample(x, 0.0),
    "PoseBank.sample(time_s)": lambda x: BANK.sample("idle", x),
    "save_poses(bank)": lambda x: save_poses(x, "/nowhere/x.poses.safetensors"),
    "save_poses(path)": lambda x: isinstance(x, (str, Path)) or save_poses(BANK, x),
    "open_poses(path)": lambda x: open_poses(x),
    "open_or_build_poses(config)": lambda x: motion.open_or_build_poses(x, "/nowhere"),
    "open_or_build_poses(folder)": lambda x: motion.open_or_build_poses(CONFIG, x),
    "poses_path(folder)": lambda x: poses_path(x, "a"),
    "poses_path(name)": lambda x: poses_path("/nowhere", x),
    "PoseStream(banks)": lambda x: motion.PoseStream(x),
    "PoseStream(settings)": lambda x: motion.PoseStream(BANK, x),
    "PoseStream.update(decision)": lambda x: motion.PoseStream(BANK, BY_CLIP).update(x, 0.1),
    "PoseStream.update(dt)": lambda x: motion.PoseStream(BANK, BY_CLIP).update(DECISION, x),
    "PoseStream.update(body)": lambda x: x is None or motion.PoseStream(BANK).update(DECISION, 0.1, x),
    "PoseStream.update(ground)": lambda x: (
        x is None or callable(x) or motion.PoseStream(BANK, BY_CLIP).update(DECISION, 0.1, None, x)
    ),
    "PoseStream.restore(state)": lambda x: motion.PoseStream(BANK).restore(x),
    "PoseStreams(streams)": lambda x: motion.PoseStreams(x),
    "PoseStreams(streams), one": lambda x: motion.PoseStreams([x]),
    "PoseStreams.update(decisions)": lambda x: motion.PoseStreams([motion.PoseStream(BANK, BY_CLIP)]).update(x, 0.1),
    "PoseStreams.update(dt)": lambda x: motion.PoseStreams([motion.PoseStream(BANK, BY_CLIP)]).update([DECISION], x),
    "PoseStreams.update(bodies)": lambda x: x is None or motion.PoseStreams([motion.PoseStream(BANK)]).update([DECISION], 0.1, x),
    "PoseStreams.update(ground)": lambda x: (
        x is None or callable(x) or motion.PoseStreams([motion.PoseStream(BANK, BY_CLIP)]).update([DECISION], 0.1, None, x)
    ),
    "PoseStreams.restore(states)": lambda x: motion.PoseStreams([motion.PoseStream(BANK)]).restore(x),
    "clip_of_poses(poses)": lambda x: clip_of_poses(x, BANK, 30.0),
    "clip_of_poses(poses), one": lambda x: clip_of_poses([x], BANK, 30.0),
    "clip_of_poses(bank)": lambda x: clip_of_poses(POSED, x, 30.0),
    "clip_of_poses(rate)": lambda x: clip_of_poses(POSED, BANK, x),
    "pose_arrays(poses)": lambda x: pose_arrays(x, BANK, 30.0),
    "pose_arrays(bank)": lambda x: pose_arrays(POSED, x, 30.0),
    "pose_arrays(rate)": lambda x: pose_arrays(POSED, BANK, x),
    "write_arrays(arrays)": lambda x: write_arrays(x, "/nowhere/x.npz"),
    "write_arrays(path)": lambda x: write_arrays({}, x),
    "write_poses(poses)": lambda x: motion.write_poses(x, BANK, "/nowhere/x.bvh", 30.0),
    "write_poses(path)": lambda x: isinstance(x, (str, Path)) or motion.write_poses(POSED, BANK, x, 30.0),
    "MotionDatabase.raw_many(frames)": lambda x: DATABASE.raw_many(x),
    "MotionDatabase.raw_many(frames), one": lambda x: DATABASE.raw_many([x]),
    "Selector.search_many(queries)": lambda x: SELECTOR.search_many(x),
    "Selector.search_many(valid)": lambda x: SELECTOR.search_many([QUERY], x),
    "Selector.search_many(current)": lambda x: SELECTOR.search_many([QUERY], current=x),
    "Selector.search_many(tags)": lambda x: SELECTOR.search_many([QUERY], tags=x),
    "ControllerGroup(controllers)": lambda x: motion.ControllerGroup(x),
    "ControllerGroup(controllers), one": lambda x: motion.ControllerGroup([x]),
    "ManySteered.of(bodies)": lambda x: ManySteered.of(x),
    "ManySteered.of(bodies), one": lambda x: ManySteered.of([x]),
    "ManySteered.moved(dt_s)": lambda x: MANY_STEERED.moved(x, [(0.0, 1.0)]),
    "ManySteered.moved(wanted)": lambda x: MANY_STEERED.moved(0.1, x),
    "MotionDatabase.raw()": lambda x: DATABASE.raw(x),
    "MotionDatabase.range_of()": lambda x: DATABASE.range_of(x),
    "MotionDatabase.frame_at()": lambda x: DATABASE.frame_at(x, 0.1),
    "MotionDatabase.with_weights()": lambda x: DATABASE.with_weights(x),
    "MotionDatabase.normalised()": lambda x: DATABASE.normalised(x),
    "Selector.candidates(k)": lambda x: SELECTOR.candidates(QUERY, x),
    "Selector.search(skip)": lambda x: SELECTOR.search(QUERY, skip=x),
    "Selector.search(penalties)": lambda x: SELECTOR.search(QUERY, penalties=x),
    "Selector.search(tags)": lambda x: SELECTOR.search(QUERY, tags=x),
    "Selector.search(current)": lambda x: SELECTOR.search(QUERY, current=x),
    "Selector.with_database(name)": lambda x: SELECTOR.with_database(x, DATABASE),
    "Selector.with_database(database)": lambda x: SELECTOR.with_database("only", x),
    "Controller.upcoming(dt_s)": lambda x: motion.Controller(SELECTOR).upcoming(x),
    "coverage(databases)": lambda x: motion.coverage(x),
    "coverage(databases), one": lambda x: motion.coverage({"x": x}),
    "coverage(contexts)": lambda x: motion.coverage({"x": BUILT}, x),
    "coverage(contexts), one": lambda x: motion.coverage({"x": BUILT}, [x]),
    "coverage(table)": lambda x: motion.coverage({"x": BUILT}, table=x),
    "coverage(never_valid)": lambda x: motion.coverage({"x": BUILT}, never_valid=x),
    "coverage(pattern)": lambda x: motion.coverage({"x": BUILT}, pattern=x),
    "coverage(near_cost)": lambda x: motion.coverage({"x": BUILT}, near_cost=x),
    "ClipContexts(assets)": lambda x: motion.coverage({"x": BUILT}, [ClipContexts(x, frozenset())]),
    "ClipContexts(mirrored)": lambda x: motion.coverage({"x": BUILT}, [ClipContexts(frozenset(["idle"]), x)]),
    "ClipContexts(share)": lambda x: motion.coverage({"x": BUILT}, [ClipContexts(frozenset(["idle"]), frozenset(), x)]),
    "ClipContexts(asked)": lambda x: motion.coverage({"x": BUILT}, [ClipContexts(frozenset(["idle"]), frozenset(), asked=x)]),
    "ClipContexts(asked), spans": lambda x: ClipContexts(frozenset(), frozenset(), asked={"speed": x}),
    "ClipContexts(asked), span": lambda x: ClipContexts(frozenset(), frozenset(), asked={"speed": [x]}),
    "measure(session_or_poses)": lambda x: motion.measure(x, BANK),
    "measure(banks)": lambda x: motion.measure(POSED, x, rate=30.0),
    "measure(poses)": lambda x: motion.measure(motion.Trace(), BANK, poses=x),
    "measure(databases)": lambda x: motion.measure(POSED, BANK, databases=x, rate=30.0),
    "measure(settings)": lambda x: motion.measure(POSED, BANK, settings=x, rate=30.0),
    "measure(rate)": lambda x: motion.measure(POSED, BANK, rate=x),
    "measure(bodies)": lambda x: motion.measure(POSED, BANK, bodies=x, rate=30.0),
    "measure(wanted)": lambda x: motion.measure(POSED, BANK, wanted=x, rate=30.0),
    "Controller.update(tags)": lambda x: motion.Controller(SELECTOR).update(0.1, QUERY, tags=x),
    "Controller.update(body)": lambda x: motion.Controller(SELECTOR).update(0.1, QUERY, body=x),
    "Controller.update(context)": lambda x: motion.Controller(SELECTOR).update(0.1, QUERY, context=x),
    "Controller.update(bias)": lambda x: motion.Controller(SELECTOR).update(0.1, QUERY, bias=x),
    "Controller.update(among)": lambda x: motion.Controller(SELECTOR).update(0.1, QUERY, among=x),
    "Controller.update(penalties)": lambda x: motion.Controller(SELECTOR).update(0.1, QUERY, penalties=x),
    "Steered.moved(dt_s)": lambda x: motion.Steered().moved(x, (0.0, 1.0)),
    "Steered.moved(wanted)": lambda x: motion.Steered().moved(0.1, x),
    "Steered(position)": lambda x: motion.Steered(x),
    "Character(controller)": lambda x: motion.Character(x, SCHEMA),
    "Character(schema)": lambda x: motion.Character(PLAYER.controller, x),
    "Character(tables)": lambda x: motion.Character(PLAYER.controller, SCHEMA, x),
    "Character(stream)": lambda x: motion.Character(PLAYER.controller, SCHEMA, None, x),
    "Character(body)": lambda x: motion.Character(PLAYER.controller, SCHEMA, None, None, x),
    "Character(own_facts)": lambda x: motion.Character(PLAYER.controller, SCHEMA, own_facts=x),
    "Character(pose)": lambda x: motion.Character(PLAYER.controller, SCHEMA, pose=x),
    "Character(ground)": lambda x: motion.Character(PLAYER.controller, SCHEMA, ground=x),
    "Character(unknown)": lambda x: motion.Character(PLAYER.controller, SCHEMA, unknown=x),
    "Character.of(project)": lambda x: motion.Character.of(x, "player"),
    "Character.record(n_candidates)": lambda x: PLAYER.copy().record(x),
    "Character.record(most)": lambda x: PLAYER.copy().record(most=x),
    "Character.sees(x_m)": lambda x: PLAYER.sees(x, 0.0),
    "Character.sees(heading_rad)": lambda x: x is None or PLAYER.sees(0.0, 0.0, x),
    "MotionProject.of(project)": lambda x: motion.MotionProject.of(x),
    "MotionProject.character(name)": lambda x: motion.MotionProject(CONFIG, {}, {}).character(x),
    "OneOff(character)": lambda x: motion.OneOff(x, PLAY, "all"),
    "OneOff(play)": lambda x: motion.OneOff(PLAYER, x, "all"),
    "OneOff(database)": lambda x: isinstance(x, str) or motion.OneOff(PLAYER, PLAY, x),
    "OneOff.update(dt)": lambda x: motion.OneOff(PLAYER.copy(), PLAY, "only").update(x),
    "path_ahead(database)": lambda x: path_ahead(x, DECISION.playing, (0, 0, 0)),
    "path_ahead(playing)": lambda x: path_ahead(BUILT, x, (0, 0, 0)),
    "path_ahead(root)": lambda x: path_ahead(BUILT, DECISION.playing, x),
    "path_ahead(seconds)": lambda x: path_ahead(BUILT, DECISION.playing, (0, 0, 0), x),
    "Character.body": lambda x: setattr(PLAYER.copy(), "body", x),
    "Character.restore(state)": lambda x: PLAYER.restore(x),
    "Character.update(dt)": lambda x: PLAYER.copy().update(x),
    "Character.update(stick)": lambda x: PLAYER.copy().update(0.1, x),
    "Character.update(facts)": lambda x: PLAYER.copy().update(0.1, facts=x),
    "Character.update(facing)": lambda x: PLAYER.copy().update(0.1, facing=x),
    "Character.update(body)": lambda x: PLAYER.copy().update(0.1, body=x),
    "Character.update(path)": lambda x: PLAYER.copy().update(0.1, path=x),
    "Character.update(tags)": lambda x: PLAYER.copy().update(0.1, tags=x),
    "Character.update(valid)": lambda x: PLAYER.copy().update(0.1, valid=x),
    "Readout.update(updated)": lambda x: motion.Readout().update(x, 0),  # type: ignore[arg-type]
    "Readout.update(table)": lambda x: motion.Readout().update(PLAYER.copy().update(0.1), x),
    "Readout.update(shown)": lambda x: motion.Readout().update(PLAYER.copy().update(0.1), 0, x),  # type: ignore[arg-type]
    "path_from(root)": lambda x: path_from(x, PATH),
    "path_from(path)": lambda x: path_from((0.0, 0.0, 0.0), x),
    "path_from(halflife_s)": lambda x: path_from((0.0, 0.0, 1.0), PATH, halflife_s=x),
    "Crowd(characters)": lambda x: motion.Crowd(x),
    "Crowd(characters), one": lambda x: motion.Crowd([x]),
    "Crowd.add(character)": lambda x: motion.Crowd().add(x),
    "Crowd.remove(character)": lambda x: motion.Crowd().remove(x),
    "Crowd.restore(states)": lambda x: motion.Crowd([PLAYER.copy()]).restore(x),
    "Crowd.update(dt)": lambda x: motion.Crowd([PLAYER.copy()]).update(x, [(0.0, 1.0)]),
    "Crowd.update(sticks)": lambda x: motion.Crowd([PLAYER.copy()]).update(0.1, x),
    "Crowd.update(facts)": lambda x: motion.Crowd([PLAYER.copy()]).update(0.1, [(0.0, 1.0)], x),
    "Crowd.update(facing)": lambda x: motion.Crowd([PLAYER.copy()]).update(0.1, [(0.0, 1.0)], facing=x),
    "Marks.left_out(tags)": lambda x: DATABASE.marks.left_out(x),
    "Marks.tag_biases(tags)": lambda x: DATABASE.marks.tag_biases(x),
    "Cycle.of(clip)": lambda x: Cycle.of(x),
    "Cycle.of(feet)": lambda x: Cycle.of(make_clip("walk").clip, feet=x),
    "Cycle.of(footfalls)": lambda x: Cycle.of(CLIP, footfalls=x),
    "Cycle.of(stances)": lambda x: Cycle.of(CLIP, stances=x),
    "Cycle.of(most_m)": lambda x: Cycle.of(CLIP, most_m=x),
    "Cycle.of(most_deg)": lambda x: Cycle.of(CLIP, most_deg=x),
    "Cycle.at(phase)": lambda x: WALKED.at(x),
    "Cycle.toes_at(phase)": lambda x: WALKED.toes_at(x),
    "Stances(down)": lambda x: Stances(x, (0.0, 0.5)),
    "Stances(holds)": lambda x: Stances((0.0, 0.5), (0.5, 0.0), x),
    "Stances.of_curves(curves)": lambda x: Stances.of_curves(x),
    "Stances.is_down(foot)": lambda x: STANCES.is_down(x, 0.0),
    "Stances.is_down(phase)": lambda x: STANCES.is_down(0, x),
    "Stances.until_change(foot)": lambda x: STANCES.until_change(x, 0.0),
    "Stances.share_of_state(phase)": lambda x: STANCES.share_of_state(0, x),
    "Gait(name)": lambda x: Gait(x, [WALKED]),
    "Gait(steady)": lambda x: Gait("walk", x),
    "Gait(steady), one": lambda x: Gait("walk", [x]),
    "Gait(speeding_up)": lambda x: Gait("walk", [WALKED], x),
    "Gait.weights(speed_mps)": lambda x: WALKS[0].weights(x),
    "Gait.weights(acceleration)": lambda x: WALKS[0].weights(1.0, x),
    "retargeted(clip)": lambda x: motion.retargeted(x, CLIP.skeleton),
    "retargeted(rig)": lambda x: motion.retargeted(CLIP, x),
    "retargeted(metres_per_unit)": lambda x: motion.retargeted(CLIP, CLIP.skeleton, metres_per_unit=x),
    "retargeted(names)": lambda x: motion.retargeted(CLIP, CLIP.skeleton, names=x),
    "baked_cycle(cycle)": lambda x: baked_cycle(x),
    "baked_cycle(n_moments)": lambda x: baked_cycle(WALKED, x),
    "baked_cycle(points)": lambda x: baked_cycle(WALKED, 4, x, [[1.0]]),
    "baked_cycle(weights)": lambda x: baked_cycle(WALKED, 4, [[0.0, 0.0, 0.0]], x),
    "walked_clips(gaits)": lambda x: walked_clips(x, [1.3]),
    "walked_clips(speeds_mps)": lambda x: walked_clips(WALKS, x),
    "walked_clips(turns_dps)": lambda x: walked_clips(WALKS, [1.3], x),
    "walked_clips(rate)": lambda x: walked_clips(WALKS, [1.3], rate=x),
    "walked_clips(settings)": lambda x: walked_clips(WALKS, [1.3], settings=x),
    "Walker(gaits)": lambda x: Walker(x),
    "Walker(settings)": lambda x: Walker(WALKS, x),
    "Walker(phase)": lambda x: Walker(WALKS, phase=x),
    "Walker.update(dt)": lambda x: Walker(WALKS).update(x, (0.0, 0.0, 0.0)),
    "Walker.update(body)": lambda x: Walker(WALKS).update(0.1, x),
    "Walker.update(ground)": lambda x: callable(x) or Walker(WALKS).update(0.1, (0.0, 0.0, 0.0), x),
    "Walker.update(adjust)": lambda x: callable(x) or Walker(WALKS).update(0.1, (0.0, 0.0, 0.0), None, x),
    "Walker.restore(state)": lambda x: Walker(WALKS).restore(x),
    "Transitions(clips)": lambda x: Transitions(x),
    "Transitions(patterns)": lambda x: Transitions([], x),
    "Transitions.find(from_state)": lambda x: Transitions([]).find(x, "walk"),
    "Transitions.missing(states)": lambda x: Transitions([]).missing(x),
}


@pytest.mark.parametrize("name", some(CALLS))
def test_a_wrong_argument_ends_in_an_error_that_says_what_was_wrong(name: str):
    told = {}
    for value in WRONG:
        with contextlib.suppress(ContextDBError):
            try:
                CALLS[name](value)
            except Exception as error:
                if not isinstance(error, ContextDBError):
                    told[repr(value)] = f"{type(error).__name__}: {error}"
    assert told == {}


def test_every_public_call_is_asked_with_wrong_arguments():
    api = (Path(__file__).parent.parent.parent / "docs" / "api.md").read_text(encoding="utf-8")
    calls = re.findall(r"`motion\.(?:\w+\.)*(\w+)\(\w", api)
    assert len(calls) > 40
    assert [name for name in calls if not any(f"{name}(" in call for call in CALLS)] == []
