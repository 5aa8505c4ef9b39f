"""Wrong arguments: no public call of `contextdb.motion` ends in an error that does not say what was wrong."""

import contextlib
import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from strategies import some

from contextdb import motion
from contextdb.errors import ContextDBError
from contextdb.motion.characters.paths import path_ahead
from contextdb.motion.clips.clip import parse_bvh
from contextdb.motion.clips.doubts import doubts_of
from contextdb.motion.clips.feet import footfalls
from contextdb.motion.clips.mirror import partners_of
from contextdb.motion.clips.poses import forward_kinematics, local_poses
from contextdb.motion.clips.steering import steered_path
from contextdb.motion.features.extraction import clip_features, clip_permutations, features_of
from contextdb.motion.features.path_features import with_paths
from contextdb.motion.made.game import make_joint_clip, write_joint_clips
from contextdb.motion.made.recipes import descriptions, make_clip
from contextdb.motion.measuring.moves import ClipContexts
from contextdb.motion.nodes.pose_match import pose_schema
from contextdb.motion.output.track import clip_of_poses, pose_arrays
from contextdb.motion.search.database import build_databases
from contextdb.motion.search.filters import Biases
from contextdb.motion.storage.building import build_all, saved_path
from contextdb.motion.storage.pose_files import open_poses, poses_path, save_poses
from contextdb.motion.storage.stored import inputs_of, open_database, save_database
from contextdb.motion.storage.written_poses import write_arrays
from contextdb.motion.walking.blending import Gait
from contextdb.motion.walking.cycle import Cycle
from contextdb.motion.walking.stances import Stances
from contextdb.motion.walking.transitions import Transitions
from contextdb.motion.walking.walked import baked_cycle, walked_clips
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
CALLS = [
    lambda: partial(PLAYER.copy().update, 0.1),
    lambda: partial(PLAYER.copy().unpack, b"", 0.1),
    lambda: partial(TOGETHER.search, POSED_TWO, PLACED_TWO),
    lambda: partial(motion.describe, [CLIP]),
    lambda: partial(motion.prepare, [CLIP]),
    lambda: partial(parse_bvh, "", "a"),
    lambda: partial(motion.write_bvh, CLIP, "/nowhere/x.bvh"),
    lambda: partial(motion.poses_of, CLIP),
    lambda: partial(motion.resampled, LOCAL, 30.0),
    lambda: partial(motion.root_trajectory, POSES),
    lambda: partial(footfalls, CLIP),
    lambda: partial(motion.mirrored, POSES, [("LeftFoot", "RightFoot")]),
    lambda: partial(partners_of, CLIP.skeleton, []),
    lambda: partial(clip_features, CLIP, SCHEMA),
    lambda: partial(clip_permutations, CLIP, SCHEMA),
    lambda: partial(motion.query_from, SCHEMA, CLIP, 0),
    lambda: partial(features_of, CLIP, SCHEMA),
    lambda: partial(motion.query_from_pose, SCHEMA, LIVE, HISTORY),
    lambda: partial(motion.PoseHistory, CLIP.skeleton, 30.0),
    lambda: partial(motion.with_path, SCHEMA, PARTS[0].features[0], PATH),
    lambda: partial(motion.steady_path, 1.0),
    lambda: partial(steered_path, STEERED, (0.0, 1.0)),
    lambda: partial(with_paths, SCHEMA, PARTS[0].features[:1], [PATH]),
    lambda: partial(motion.build, CONFIG, "none"),
    lambda: partial(build_all, folder="none"),
    lambda: partial(motion.open_or_build, CONFIG, "none"),
    lambda: partial(build_databases, {"a": [CLIP]}, SCHEMA),
    lambda: partial(save_database, DATABASE, "/nowhere/x.safetensors"),
    lambda: partial(saved_path, Path("none"), "loco"),
    lambda: partial(motion.MotionDatabase.build, [CLIP], SCHEMA),
    lambda: partial(motion.MotionDatabase.from_features, np.eye(4, 2), [0], [2], ["a"]),
    lambda: partial(DATABASE.search, QUERY),
    lambda: partial(DATABASE.search_many, [QUERY]),
    lambda: partial(DATABASE.best_of_ranges, QUERY),
    lambda: partial(DATABASE.candidates, QUERY),
    lambda: partial(BUILT.frame_at, 0, 0.0),
    lambda: partial(DATABASE.channel_costs, query=QUERY),
    lambda: partial(SELECTOR.search, QUERY),
    lambda: partial(motion.Controller, SELECTOR),
    lambda: partial(motion.Controller(SELECTOR).update, 0.1, QUERY),
    lambda: partial(motion.best_start, DATABASE, QUERY),
    lambda: partial(pose_schema, CLIP.skeleton),
    lambda: partial(motion.Trace, 1),
    lambda: partial(REASKED.why_not, 0, "a"),
    lambda: partial(motion.MatchNode, DATABASE),
    lambda: partial(motion.JointDatabase.of, JOINT.database, ["Host", "Guest"]),
    lambda: partial(motion.JointSearcher, JOINT),
    lambda: partial(TOGETHER.candidates, POSED_TWO, PLACED_TWO),
    lambda: partial(motion.JointNode(TOGETHER).play, MET.hit, PLACED_TWO),
    lambda: partial(MET.decision, "Host"),
    lambda: partial(motion.MatchGate, DATABASE, 1.0),
    lambda: partial(motion.MatchGate(DATABASE, 1.0).update),
    lambda: partial(NODE.enter, [0.0] * SCHEMA.n_features, motion.Target(0, 1)),
    lambda: partial(NODE.stitch, NODE.database.raw(0), NODE.database.raw(20), 1.0),
    lambda: partial(motion.Target, ahead_m=1.0),
    lambda: partial(motion.Span, tag="t"),
    lambda: partial(motion.Clip, "a", CLIP.skeleton, 0.1, CLIP.values),
    lambda: partial(motion.FeatureSchema.from_dict, "a", {"rate": 30, "channels": CHANNELS}),
    lambda: partial(CONFIG.selector, databases={}),
    lambda: partial(CONFIG.controller, databases={}),
    lambda: partial(FALLS.is_down, time_s=0.1),
    lambda: partial(motion.PoseBank.build, [CLIP], SCHEMA),
    lambda: partial(BANK.sample, "idle", 0.0),
    lambda: partial(save_poses, BANK, "/nowhere/x.poses.safetensors"),
    lambda: partial(motion.open_or_build_poses, CONFIG, "/nowhere"),
    lambda: partial(poses_path, "/nowhere", "a"),
    lambda: partial(motion.PoseStream, BANK),
    lambda: partial(motion.PoseStream(BANK, BY_CLIP).update, DECISION, 0.1, None),
    lambda: partial(motion.PoseStream(BANK).update, DECISION, 0.1),
    lambda: partial(motion.PoseStreams([motion.PoseStream(BANK, BY_CLIP)]).update, [DECISION], 0.1, None),
    lambda: partial(motion.PoseStreams([motion.PoseStream(BANK)]).update, [DECISION], 0.1),
    lambda: partial(clip_of_poses, POSED, BANK, 30.0),
    lambda: partial(pose_arrays, POSED, BANK, 30.0),
    lambda: partial(write_arrays, {}, "/nowhere/x.npz"),
    lambda: partial(motion.write_poses, POSED, BANK, "/nowhere/x.bvh", 30.0),
    lambda: partial(SELECTOR.search_many, [QUERY]),
    lambda: partial(DATABASE.frame_at, time_s=0.1),
    lambda: partial(SELECTOR.candidates, QUERY),
    lambda: partial(SELECTOR.with_database, "only", DATABASE),
    lambda: partial(motion.coverage, {"x": BUILT}),
    lambda: partial(motion.measure, POSED, BANK, rate=30.0),
    lambda: partial(motion.Steered().moved, 0.1, (0.0, 1.0)),
    lambda: partial(motion.Character, PLAYER.controller, SCHEMA, None, None),
    lambda: partial(motion.Character.of, name="player"),
    lambda: partial(PLAYER.sees, 0.0, 0.0),
    lambda: partial(motion.MotionProject(CONFIG, {}, {}).character),
    lambda: partial(motion.OneOff, PLAYER, PLAY, "all"),
    lambda: partial(motion.OneOff(PLAYER.copy(), PLAY, "only").update),
    lambda: partial(path_ahead, BUILT, DECISION.playing, (0, 0, 0)),
    lambda: partial(motion.Readout().update, PLAYER.copy().update(0.1), 0),
    lambda: partial(motion.Crowd([PLAYER.copy()]).update, 0.1, [(0.0, 1.0)]),
    lambda: partial(Cycle.of, make_clip("walk").clip),
    lambda: partial(Stances, (0.0, 0.5), (0.0, 0.5)),
    lambda: partial(STANCES.is_down, 0, 0.0),
    lambda: partial(STANCES.until_change, phase=0.0),
    lambda: partial(STANCES.share_of_state, 0),
    lambda: partial(Gait, "walk", [WALKED]),
    lambda: partial(WALKS[0].weights, 1.0),
    lambda: partial(motion.retargeted, CLIP, CLIP.skeleton),
    lambda: partial(baked_cycle, WALKED, 4, [[0.0, 0.0, 0.0]], [[1.0]]),
    lambda: partial(walked_clips, WALKS, [1.3]),
    lambda: partial(Walker, WALKS),
    lambda: partial(Walker(WALKS).update, 0.1, (0.0, 0.0, 0.0), None),
    lambda: partial(Transitions, []),
    lambda: partial(Transitions([]).find, to_state="walk"),
]
OTHERS: dict[str, Call] = {
    "build_databases(sets), one": lambda x: build_databases({"a": [x]}, SCHEMA),
    "Trace[]": lambda x: motion.Trace()[x],
    "Reasked[]": lambda x: REASKED[x],
    "JointSearcher(databases), one": lambda x: motion.JointSearcher({"joint": x}),
    "JointSearcher(thresholds), one": lambda x: motion.JointSearcher(JOINT, {"joint": x}),
    "JointSearcher.search(queries), one": lambda x: TOGETHER.search(POSED_TWO | {6: x}, PLACED_TWO),
    "JointSearcher.search(places), one": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO | {6: x}),
    "JointSearcher.search(casts), actor": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, casts=[{"Host": x, "Guest": 5}]),
    "JointSearcher.search(gives), one": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, gives={"Host": x}),
    "Entry(database)": lambda x: motion.Selector([motion.Entry("a", x)]),
    "Entry(name)": lambda x: motion.Selector([motion.Entry(x, DATABASE)]),
    "Entry(threshold)": lambda x: motion.Selector([motion.Entry("a", DATABASE, x)]),
    "coverage(databases), one": lambda x: motion.coverage({"x": x}),
    "ClipContexts(assets)": lambda x: motion.coverage({"x": BUILT}, [ClipContexts(x, frozenset())]),
    "ClipContexts(mirrored)": lambda x: motion.coverage({"x": BUILT}, [ClipContexts(frozenset(["idle"]), x)]),
    "ClipContexts(share)": lambda x: motion.coverage({"x": BUILT}, [ClipContexts(frozenset(["idle"]), frozenset(), x)]),
    "ClipContexts(asked)": lambda x: motion.coverage({"x": BUILT}, [ClipContexts(frozenset(["idle"]), frozenset(), asked=x)]),
    "ClipContexts(asked), spans": lambda x: ClipContexts(frozenset(), frozenset(), asked={"speed": x}),
    "ClipContexts(asked), span": lambda x: ClipContexts(frozenset(), frozenset(), asked={"speed": [x]}),
    "Character.body": lambda x: setattr(PLAYER.copy(), "body", x),
    "Trace.reasked(project)": lambda x: x is None or motion.Trace().reasked(x),
    "Trace.reasked(thresholds)": lambda x: x is None or motion.Trace().reasked(thresholds=x),
    "Trace.reasked(biases)": lambda x: x is None or motion.Trace().reasked(biases=x),
    "Trace.reasked(tables)": lambda x: x is None or motion.Trace().reasked(tables=x),
    "Trace.reasked(weights)": lambda x: x is None or motion.Trace(1, {"a": DATABASE}).reasked(weights=x),
    "Trace.what_if(project)": lambda x: x is None or RECORDED.what_if(x),
    "Trace.what_if(weights)": lambda x: x is None or RECORDED.what_if(weights=x),
    "JointSearcher.search(casts), one": lambda x: TOGETHER.search(POSED_TWO, PLACED_TWO, casts=[x]),
}


FUNCTIONS = ("progress", "ground", "adjust")
"""Arguments that are functions: what goes wrong in one that the caller gave is not ours to tell."""
OF_OURS = ("file", "inputs", "saved")
"""What only our own commands give."""
LEFT_OUT = [
    "Clip.up", "coverage.progress", "pose_schema.mirror", "MotionDatabase.build.normalisation", "MotionDatabase.build.markup",
    "MotionDatabase.search.in_match_range", "MotionDatabase.search_many.current", "Marks.left_out.in_match_range",
]  # fmt: skip
"""Those of which an error of Python's still says what is wrong."""


def errors_of(call: Call, values: Sequence[object] = WRONG) -> dict[str, str]:
    """What a call with each of the wrong values, and a list of it, ends in, other than an error of ours."""
    told = {}
    for value in (*values, *([value] for value in values)):
        with contextlib.suppress(ContextDBError):
            try:
                call(value)
            except Exception as error:
                if not isinstance(error, ContextDBError):
                    told[repr(value)] = f"{type(error).__name__}: {error}"
    return told


def checked(valid: partial[object]) -> Iterator[tuple[str, list[object]]]:
    """The arguments of a call whose others are given, and the wrong values for each."""
    parameters = inspect.signature(valid.func).parameters.values()
    given = inspect.signature(valid.func).bind_partial(*valid.args, **valid.keywords).arguments
    plain = [each for each in parameters if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)]
    missing = {each.name for each in plain if each.default is each.empty} - given.keys()
    for each in plain:
        is_ours = each.name in OF_OURS or f"{valid.func.__qualname__}.{each.name}" in LEFT_OUT
        if missing <= {each.name} and not is_ours:
            yield each.name, [value for value in WRONG if not is_apart(value, each)]


def is_apart(value: object, parameter: inspect.Parameter) -> bool:
    """A function where one is asked for, and an array in place of a switch, of which Python itself says what is wrong."""
    is_switch = parameter.annotation in (bool, "bool")
    return (callable(value) and parameter.name in FUNCTIONS) or (isinstance(value, np.ndarray) and is_switch)


API = (Path(__file__).parent.parent.parent / "docs" / "api.md").read_text(encoding="utf-8")
OF_OTHERS = {
    "Action", "Sequence.count", "Sequence.index", "Controller.put_back", "Controller.upcoming_features", "MotionConfig.output_of",
    "MotionConfig.with_functions", "PoseHistory.plan", "Reasked.of", "Selector.check_names", "Steered.of_numbers",
}  # fmt: skip
"""What Python gives, and what only other modules of ours call."""


def alone() -> Iterator[Callable[..., object]]:
    """The public functions, classes and class methods, and some of ours, that one argument is enough for."""
    yield from (local_poses, forward_kinematics, doubts_of, make_clip, descriptions, make_joint_clip, write_joint_clips)
    yield from (open_database, open_poses, inputs_of, Biases, Stances.of_curves)
    for public in map(vars(motion).__getitem__, motion.__all__):
        own = vars(public) if inspect.isclass(public) else {}
        yield from (getattr(public, name) for name in own if name[0] != "_" and isinstance(own[name], classmethod))
        if callable(public):
            yield public


THINGS: list[Callable[[], object]] = [
    lambda: DATABASE, lambda: BUILT, lambda: DATABASE.marks, lambda: motion.Trace(), lambda: RECORDED, lambda: REASKED,
    lambda: REASKED[0], lambda: SELECTOR, lambda: motion.Controller(SELECTOR), lambda: JOINT, lambda: TOGETHER, lambda: MET,
    lambda: PLAY, lambda: CONFIG, lambda: motion.PoseStream(BANK), lambda: motion.PoseStreams([motion.PoseStream(BANK)]),
    lambda: PLAYER.copy(), lambda: motion.Crowd(), lambda: motion.Crowd([PLAYER.copy()]), lambda: WALKED, lambda: Walker(WALKS),
    lambda: Transitions([]), lambda: motion.PoseHistory(CLIP.skeleton), lambda: motion.MatchGate(DATABASE, 1.0),
]  # fmt: skip
"""What has methods that one argument is enough for."""


def method(make: Callable[[], object], name: str) -> partial[object]:
    return partial(getattr(make(), name))


for each in dict.fromkeys(alone()):
    CALLS.append(partial(partial, each))
for make in THINGS:
    kind = type(make())
    CALLS += [partial(method, make, name) for name in dir(kind) if name[0] != "_" and inspect.isfunction(getattr(kind, name))]
CALLS = [make for make in CALLS if make().func.__qualname__ not in OF_OTHERS and any(checked(make()))]


@pytest.mark.parametrize("make", some(CALLS, 4), ids=lambda make: make().func.__qualname__)
def test_a_wrong_argument_ends_in_an_error_that_says_what_was_wrong(
    make: Callable[[], partial[object]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)  # a few write to the path that they are given
    for name, values in checked(make()):

        def call(value: object, name: str = name) -> None:
            valid = make()
            bound = inspect.signature(valid.func).bind_partial(*valid.args, **valid.keywords)
            bound.arguments[name] = value
            valid.func(*bound.args, **bound.kwargs)

        assert errors_of(call, values) == {}, name


@pytest.mark.parametrize("name", some(OTHERS))
def test_a_wrong_part_of_an_argument_ends_in_such_an_error_too(name: str):
    assert errors_of(OTHERS[name]) == {}


def test_every_public_call_is_asked_with_wrong_arguments():
    calls = re.findall(r"`motion\.(?:\w+\.)*(\w+)\(\w", API)
    assert len(calls) > 40
    asked = {make().func.__name__ for make in CALLS} | {make().func.__qualname__.partition(".")[0] for make in CALLS}
    assert [name for name in calls if name not in asked and not any(f"{name}(" in call for call in OTHERS)] == []
