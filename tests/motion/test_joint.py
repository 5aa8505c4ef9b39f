"""Several characters at once: clip, frame and cast against trying all of them, and what was found played so that bodies meet."""

import math
import tomllib
from dataclasses import replace
from itertools import permutations
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run
from strategies import examples

import contextdb as cdb
from contextdb.errors import MotionError, QueryError, SchemaError
from contextdb.motion import (
    JointDatabase,
    JointNode,
    JointSearcher,
    Markup,
    MotionConfig,
    MotionDatabase,
    PoseBank,
    PoseSettings,
    PoseStream,
    RootMotion,
    Steered,
    Trace,
    build,
    poses_of,
    write_bvh,
)
from contextdb.motion.joint import searcher as searching
from contextdb.motion.joint.alignment import aligned
from contextdb.motion.made.game import HOLD_S, JOINT_RECIPES, JOINT_ROLES, make_joint_clip, write_joint_clips
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.markup.marks import Mark, Marks
from contextdb.motion.nodes.pose_match import pose_schema
from contextdb.motion.search.filters import Biases
from contextdb.motion.selection.decision import Together
from contextdb.motion.selection.root_motion import between
from contextdb.motion.trace.reasked import why_not_asked
from contextdb.schema.settings import TableSettings

ROLES = ("Tackler", "Carrier", "Judge")
CAST = [{"Host": 7, "Guest": 3}]
CLIPS = [clip for name in JOINT_RECIPES for clip in make_joint_clip(name).values()]
CONTACTS = {name: make_joint_clip(name)["Host"].duration_s - HOLD_S for name in JOINT_RECIPES}
SCHEMA = replace(pose_schema(CLIPS[0].skeleton), mirror=(("Left*", "Right*"),))
MARKUP = Markup.parse("asset,tag,from,to,value\n" + "".join(f"{name}.*,WarpPosition,0,{s:.6f},\n" for name, s in CONTACTS.items()))


@pytest.fixture(scope="module")
def greetings():
    """The made joint clips, with their contacts, also mirrored."""
    return JointDatabase.of(MotionDatabase.build(CLIPS, SCHEMA, markup=MARKUP, mirror=True), JOINT_ROLES)


def recorded(joint, at, frame, actors=(7, 3)):
    """Queries and places of actors who are just as in a joint frame."""
    frames = joint.database.starts[joint.ranges[at]] + frame
    queries = {actor: joint.database.raw(int(number)) for actor, number in zip(actors, frames, strict=True)}
    return queries, {actor: tuple(joint.database.root[number].tolist()) for actor, number in zip(actors, frames, strict=True)}


def seen(places, roles=JOINT_ROLES):
    """The second role's place as the first sees it."""
    return between(*(RootMotion(*places[role]) for role in roles))


# ---- the search, against trying everything


@st.composite
def joint_moments(draw):
    """A joint database of some short clips, and everything a search is given."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n_roles, n_clips, n_features = draw(st.integers(2, 3)), draw(st.integers(1, 4)), draw(st.integers(1, 3))
    lengths = rng.integers(1, 40, n_clips).repeat(n_roles)
    stops = np.cumsum(lengths)
    total = int(stops[-1])
    names = [f"c{i // n_roles}.{ROLES[i % n_roles]}" for i in range(n_clips * n_roles)]
    database = MotionDatabase.from_features(rng.integers(-4, 5, (total, n_features)) / 2.0, stops - lengths, stops, names)
    marks = Marks.none(total, len(names))
    kinds = (rng.random(total) < draw(st.sampled_from([0.0, 0.3]))).astype(np.uint16)
    said = {"kind_marks": np.array([Mark.MATCH_RANGE, Mark.MATCH_RANGE | Mark.DO_NOT_CHOOSE], np.uint8), "kinds": kinds}
    said |= {"kind_tags": np.zeros((2, 0), np.bool_), "kind_biases": np.array([0.25, 0.0]), "kind_root_weights": np.ones(2)}
    root = np.column_stack((rng.integers(-4, 5, (total, 2)) / 2.0, rng.integers(-3, 4, total) * np.pi / 4)).astype(np.float32)
    database = replace(database, root=root, marks=replace(marks, **said), biases=Biases(0.5))
    joint = JointDatabase.of(database, ROLES[:n_roles], place_weight=draw(st.sampled_from([0.0, 1.0, 3.0])))
    actors = range(draw(st.integers(n_roles - 1, n_roles + 2)))
    queries = {actor: rng.integers(-4, 5, n_features) / 2.0 for actor in actors}
    places = {actor: (*(rng.integers(-4, 5, 2) / 2.0).tolist(), float(rng.uniform(-4, 4))) for actor in actors}
    every = [dict(zip(joint.roles, each, strict=True)) for each in permutations(actors, n_roles)]
    casts = None if draw(st.booleans()) else [cast for cast in every if rng.random() < 0.5]
    bias = rng.integers(-2, 3, total) / 4.0 if draw(st.booleans()) else None
    first = int(rng.integers(0, total))
    skip = [Skip(first, first + int(rng.integers(1, 9)), LeftOut.HISTORY)] if draw(st.booleans()) else []
    options = {"valid": rng.random(n_clips) < 0.8, "casts": casts, "bias": bias, "skip": skip}
    return joint, queries, places, options, every, draw(st.sampled_from([2, 512]))


def tried(joint, queries, places, cast, at, frame, bias, skip):
    """The cost of one cast in one joint frame, by the definition in the docstring; None where a frame may not be chosen."""
    database, n_roles = joint.database, len(joint.roles)
    frames = {role: int(database.starts[joint.ranges[at, k]]) + frame for k, role in enumerate(joint.roles)}
    if any(database.marks.kinds[number] for number in frames.values()):
        return None
    if any(each.start <= number < each.stop for number in frames.values() for each in skip):
        return None
    features, total = database.features, 0.0
    for role, number in frames.items():
        total += float(((features[number] - queries[cast[role]]) ** 2).sum())
    for one, other in permutations(joint.roles, 2):
        apart = [between(RootMotion(*p[one]), RootMotion(*p[other])) for p in (
            {role: database.root[number].tolist() for role, number in frames.items()},
            {role: places[actor] for role, actor in cast.items()},
        )]  # fmt: skip
        metres = math.hypot(apart[0].left_m - apart[1].left_m, apart[0].ahead_m - apart[1].ahead_m)
        chord = 2.0 * math.sin((apart[0].turn_rad - apart[1].turn_rad) / 2.0)
        total += joint.place_weight * (metres / 0.5) ** 2 + joint.facing_weight * (chord / 0.5) ** 2
    sizes = n_roles * database.n_features + n_roles * (n_roles - 1) * 2 * (joint.place_weight + joint.facing_weight)
    return total / sizes + 0.75 + (0.0 if bias is None else float(np.mean([bias[number] for number in frames.values()])))


@examples(0.5)
@given(joint_moments())
def test_the_search_finds_what_trying_every_cast_clip_and_frame_finds(moment):
    joint, queries, places, options, every, at_once = moment
    valid, casts, bias, skip = options.values()
    with mock.patch.object(searching, "CASTS_AT_ONCE", at_once):
        found = JointSearcher(joint).search(queries, places, **options)
    expected = [
        tried(joint, queries, places, cast, at, frame, bias, skip)
        for cast in (every if casts is None else casts)
        for at in np.flatnonzero(valid).tolist()
        for frame in range(joint.lengths[at])
    ]
    best = min((total for total in expected if total is not None), default=math.inf)
    assert found.cost == pytest.approx(best, rel=1e-5)  # places are kept as float32
    if found:
        assert valid[found.range]
        assert found.cost == pytest.approx(
            tried(joint, queries, places, found.cast, found.range, found.frame, bias, skip), rel=1e-5
        )
        parts = [cost for role in found.costs.values() for cost in role.values()]
        assert math.fsum([*parts, found.bias]) == pytest.approx(found.cost, rel=1e-9)
    best_of_each = JointSearcher(joint).candidates(queries, places, 1, **options)
    assert [(each.cost, each.frame, each.cast) for each in best_of_each] == [(found.cost, found.frame, found.cast)] * bool(found)


@pytest.mark.parametrize("at", [0, 1, 4])
def test_actors_who_are_as_recorded_cost_nothing_wherever_in_the_world_they_are(greetings, at):
    queries, places = recorded(greetings, at, 40)
    away = RootMotion(30.0, -12.0, 2.0)
    moved = {actor: away.then(RootMotion(*place)) for actor, place in places.items()}
    places = {actor: (place.left_m, place.ahead_m, place.turn_rad) for actor, place in moved.items()}
    found = JointSearcher(greetings).search(queries, places)
    assert (found.asset, found.mirrored, found.frame) == (greetings.assets[at], bool(greetings.mirrored[at]), 40)
    assert found.cast == {"Host": 7, "Guest": 3}
    assert found.cost == pytest.approx(0.0, abs=1e-9)
    for way in found.alignment.values():
        assert (way.left_m, way.ahead_m, way.turn_rad) == pytest.approx((0.0, 0.0, 0.0), abs=1e-5)


def test_a_place_may_be_a_steered_body(greetings):
    queries, places = recorded(greetings, 0, 40)
    steered = {actor: Steered(position=(x, z), heading=heading) for actor, (x, z, heading) in places.items()}
    assert JointSearcher(greetings).search(queries, steered).cost == JointSearcher(greetings).search(queries, places).cost


# ---- with a table


@pytest.fixture(scope="module")
def table():
    """Rows for the greetings, with what each role asks."""
    conditions = {
        "Host.mood": {"type": "enum", "values": ["glad", "cross"]},
        "Guest.side": {"type": "number", "mirror": "negate"},
    }
    columns = {
        "Asset Name": ["greet_run", "greet_walk", "greet_walk"],
        "Host.mood": ["glad", "cross", "glad"],
        "Guest.side": ["Any", "<0", ">0"],
    }
    return cdb.Table.from_columns(columns, conditions, TableSettings(name="greetings")).compile()


def asked(table, moods, sides):
    hosts = [{"id": actor, "mood": mood} for actor, mood in moods.items()]
    return table.query({}, actors={"Host": hosts, "Guest": [{"id": actor, "side": side} for actor, side in sides.items()]})


def test_only_casts_that_the_cells_of_a_row_accept_are_tried(greetings, table):
    queries, places = recorded(greetings, list(greetings.assets).index("greet_walk"), 40)
    found = JointSearcher(greetings).search(queries, places, valid=asked(table, {7: "cross", 3: "glad"}, {3: -1.0, 7: -1.0}))
    assert (found.asset, found.row, found.cast, found.mirrored) == ("greet_walk", 1, {"Host": 7, "Guest": 3}, False)
    found = JointSearcher(greetings).search(queries, places, valid=asked(table, {7: "cross"}, {3: 1.0}))
    assert found.mirrored, "as it is, row 1 wants the guest on the other side"
    assert not JointSearcher(greetings).search(queries, places, valid=asked(table, {}, {3: 1.0}))


def test_each_listed_cast_is_tried_where_an_answer_has_no_actors(greetings, table):
    queries, places = recorded(greetings, 0, 40)
    answer = table.query({"Host.mood": "glad", "Guest.side": 0.0})
    found = JointSearcher(greetings).search(queries, places, valid=answer, casts=[{"Host": 3, "Guest": 7}])
    assert (found.asset, found.row, found.cast) == ("greet_run", 0, {"Host": 3, "Guest": 7})


def test_a_soft_cell_costs_those_casts_alone_that_do_not_fit_it(greetings):
    conditions = {"Host.mood": {"type": "enum", "values": ["glad", "cross"]}, "Guest.mood": {"type": "enum", "values": ["glad"]}}
    columns = {
        "Asset Name": ["greet_run", "greet_run"],
        "Host.mood": ["glad ~0.5", "cross ~0.25"],
        "Guest.mood": ["glad", "Any"],
        "Mandatory_Slots": ["Host", "Host"],
    }
    table = cdb.Table.from_columns(columns, conditions, TableSettings(name="soft", outputs=("Mandatory_Slots",))).compile()
    people = [{"id": 3, "mood": "cross"}, {"id": 7, "mood": "glad"}]
    matches = table.query({}, actors={"Host": people, "Guest": people[1:]})
    queries, places = recorded(greetings, 0, 40)
    found = JointSearcher(greetings).search(queries, places, valid=matches)
    assert (found.row, found.cast, found.bias) == (1, {"Host": 3, "Guest": 7}, 0.0)
    matches = table.query({}, actors={"Host": people[1:], "Guest": [{"id": 3, "mood": "glad"}]})
    found = JointSearcher(greetings).search(queries, places, valid=matches)
    assert (found.row, found.cast, found.bias) == (0, {"Host": 7, "Guest": 3}, 0.0)
    found = JointSearcher(greetings).search(queries, places, valid=matches.only([1]))
    assert (found.row, found.bias) == (1, 0.25)


# ---- several databases, candidates, explanation


def test_a_priority_database_under_its_threshold_wins_outright(greetings):
    queries, places = recorded(greetings, 0, 40)
    others = JointDatabase.of(MotionDatabase.build(CLIPS[2:4], SCHEMA, normalisation=greetings.database.normalisation), JOINT_ROLES)
    for threshold, winner in ((1e9, "tired"), (1e-9, "all")):
        found = JointSearcher({"tired": others, "all": greetings}, {"tired": threshold}).search(queries, places)
        assert found.database == winner
    assert found.why.endswith("all has the lowest cost and wins.")


def test_an_explanation_names_roles_channels_and_what_is_to_be_made_up(greetings):
    queries, places = recorded(greetings, 0, 40)
    places[3] = (places[3][0] + 1.0, *places[3][1:])
    found = JointSearcher(greetings).search(queries, places, gives={"Host": 0.0}, casts=CAST)
    told = found.explain().splitlines()
    assert told[1].startswith("  Host is 7: cost ")
    assert "Guest place" in told[1]
    assert told[2] == "    to make up: 0.00 m left, 0.00 m ahead, 0° left"


def test_biases_and_skips_are_of_one_database_or_by_its_name(greetings):
    queries, places = recorded(greetings, 0, 40)
    searcher = JointSearcher({"all": greetings})
    bias = np.zeros(greetings.database.n_frames)
    bias[greetings.frames[0, greetings.frame_ranges == 0]] = 2.0  # of one role: half of it counts
    told = searcher.search(queries, places, casts=CAST, bias=bias)
    assert told.range != 0
    assert searcher.search(queries, places, casts=CAST, bias={"all": bias}).range == told.range
    assert searcher.search(queries, places, casts=CAST, bias={}).range == 0
    first = int(greetings.frames[1, 40])
    assert searcher.search(queries, places, casts=CAST, skip=[Skip(first, first + 1, LeftOut.HISTORY)]).frame != 40
    with pytest.raises(QueryError, match='Did you mean "all"'):
        searcher.search(queries, places, skip={"al": []})


# ---- alignment


@examples(0.5)
@given(st.integers(0, 2**32 - 1), st.integers(2, 4))
def test_no_other_place_of_the_clip_leaves_less_to_make_up(seed, n_roles):
    rng = np.random.default_rng(seed)
    own, places = rng.normal(size=(2, n_roles, 3))
    gives = rng.uniform(0.2, 3.0, n_roles)

    def missing(put):
        return ((((put - places)[:, :2] ** 2).sum(axis=1) + 2.0 - 2.0 * np.cos(put[:, 2] - places[:, 2])) / gives).sum()

    best = aligned(own, places, gives)
    for turn, x, z in rng.normal(scale=0.1, size=(8, 3)):
        way = RootMotion(x, z, turn)
        shifted = [way.then(RootMotion(*place)) for place in best.tolist()]
        assert missing(best) <= missing(np.array([(p.left_m, p.ahead_m, p.turn_rad) for p in shifted])) + 1e-9


def test_a_role_that_does_not_give_way_stays_where_it_is(greetings):
    queries, places = recorded(greetings, 0, 40)
    places[3] = (places[3][0] + 0.5, places[3][1] - 0.2, places[3][2] + 0.3)
    found = JointSearcher(greetings).search(queries, places, gives={"Guest": 0.0}, casts=CAST)
    assert found.places["Guest"] == pytest.approx(places[3])


# ---- the node


def entered(joint, frame=60, options=None, shift=(0.3, -0.4, 0.5)):
    queries, places = recorded(joint, 0, frame)
    places[3] = tuple(np.add(places[3], shift).tolist())
    return JointNode(JointSearcher(joint)).enter(queries, places, **(options or {})), places


@pytest.mark.parametrize("frame", [60, 144])
def test_at_the_contact_and_from_there_on_the_actors_are_to_each_other_as_recorded(greetings, frame):
    play, places = entered(greetings, frame)
    assert play.at(0.0)["Guest"] == pytest.approx(places[play.hit.cast["Guest"]])
    rate, root = SCHEMA.rate, greetings.database.root
    for time_s in (play.contact_s, (play.contact_s + play.duration_s) / 2.0, play.duration_s):
        rows = [play.hit.frames[role] + time_s * rate for role in JOINT_ROLES]
        own = {
            role: [float(np.interp(row, np.arange(len(root)), column)) for column in root.T]
            for role, row in zip(JOINT_ROLES, rows, strict=True)
        }
        found, expected = seen(play.at(time_s)), seen(own)
        assert (found.left_m, found.ahead_m) == pytest.approx((expected.left_m, expected.ahead_m), abs=1e-5)
        assert math.remainder(found.turn_rad - expected.turn_rad, math.tau) == pytest.approx(0.0, abs=1e-5)


def test_the_contact_is_where_the_markup_has_it_and_the_end_where_that_is_past(greetings):
    play, _ = entered(greetings)
    assert play.contact_s == pytest.approx(CONTACTS[play.hit.asset] - play.hit.time_s, abs=1e-5)
    late, _ = entered(greetings, 146, {"casts": CAST})
    assert late.contact_s == late.duration_s < 0.2
    bare = JointDatabase.of(MotionDatabase.build(CLIPS, SCHEMA), JOINT_ROLES)
    play, _ = entered(bare)
    assert play.contact_s == play.duration_s


def test_all_roles_are_in_step_and_end_together(greetings):
    play, _ = entered(greetings)
    first = {role: greetings.database.starts[greetings.ranges[play.hit.range, k]] for k, role in enumerate(JOINT_ROLES)}
    while not play.is_done:
        where = play.advance(0.21)
        assert where == play.at(play.time_s)
        assert len({play.frames[role] - first[role] for role in JOINT_ROLES}) == 1
        assert len({play.decision(role).playing.time_s for role in JOINT_ROLES}) == 1
    assert play.time_s == play.duration_s


def test_the_play_ends_before_a_frame_that_is_excluded_for_one_role():
    markup = Markup.parse("asset,tag,from,to,value\ngreet_walk.Guest,Excluded,4,9,\n")
    joint = JointDatabase.of(MotionDatabase.build(CLIPS, SCHEMA, markup=markup), JOINT_ROLES)
    play, _ = entered(joint, options={"valid": np.array(joint.assets) == "greet_walk"})
    assert play.hit.time_s + play.duration_s == pytest.approx(4.0 - 1 / SCHEMA.rate)


def test_the_hands_of_two_streams_meet_at_the_contact(greetings):
    play = entered(greetings, 90, {"casts": CAST})[0]
    bank = PoseBank.build(CLIPS, SCHEMA, mirror=True, markup=MARKUP)
    streams = {role: PoseStream(bank, PoseSettings(root="code", foot_lock=False)) for role in JOINT_ROLES}
    hands, step = {}, 1.0 / SCHEMA.rate
    while play.time_s < play.contact_s - 1e-9:
        for role, place in play.advance(step).items():
            pose = streams[role].update(play.decision(role), step, place)
            hands[role] = pose.positions[bank.skeleton.index("RightHand")]
    assert np.linalg.norm(hands["Host"] - hands["Guest"]) < 0.01


@pytest.fixture(scope="module")
def session(greetings, tmp_path_factory):
    """A recorded play of the host, and the file it was saved in."""
    searcher = JointSearcher(greetings)
    trace = Trace(databases=searcher.selector.databases)
    play = entered(greetings, 60, {"casts": CAST})[0]
    for tick in range(1, 31):
        play.advance(1 / 30)
        trace.record(play.decision("Host", tick=tick, time_s=5.0 + tick / 30))
    file = tmp_path_factory.mktemp("session") / "host.parquet"
    trace.save(file)
    return play, file


def test_a_session_keeps_clip_frame_cast_and_the_costs_of_all_roles(session):
    play, file = session
    first, *others = Trace.load(file)
    assert (first.tick, first.action, first.searched, first.cost) == (1, "jumps", True, play.hit.cost)
    assert first.together == Together(
        "Host", play.hit.asset, play.hit.time_s, {"Host": "7", "Guest": "3"}, play.hit.costs, play.hit.bias
    )
    assert first.playing.database == "joint"
    assert all(each.together is None and not each.searched for each in others)


def test_replay_shows_a_joint_choice_in_a_sentence_and_in_its_parts(session):
    play, file = session
    sentence = "7 as Host (0.0505) and 3 as Guest (0.8108) enter greet_tired together at 2.13 s, at cost 0.8613."
    assert play.hit.sentence == sentence
    shown = run("motion", "replay", str(file), "--at", "1")
    assert sentence in " ".join(shown.out.split())
    assert "together    Host is 7:" in shown.out
    assert "no candidates are listed" not in shown.out
    assert "several characters at once" in why_not_asked(Trace.load(file)[0], {}, {})
    assert "joint" in run("motion", "replay", str(file)).out
    document = run("motion", "replay", str(file), "--at", "1", "--json").json
    assert document["together"]["cast"] == {"Host": "7", "Guest": "3"}
    assert "together" not in run("motion", "replay", str(file), "--at", "2", "--json").json


# ---- clips, settings, faults


@pytest.mark.parametrize("name", JOINT_RECIPES)
def test_the_hands_of_a_made_greeting_meet_at_its_contact(name):
    host, guest = (poses_of(clip) for clip in make_joint_clip(name).values())
    hand, contact = host.skeleton.index("RightHand"), round(CONTACTS[name] * host.rate)
    assert host.n_frames == guest.n_frames
    assert np.linalg.norm(host.positions[contact, hand] - guest.positions[contact, hand]) < 1e-9
    assert np.linalg.norm(host.positions[0, hand] - guest.positions[0, hand]) > 2.0


TOML = """
[tables.greetings]
[features.pose]
rate = 30.0
channels = [{ type = "position", bone = "LeftFoot" }]
[databases.greetings]
table = "greetings"
clips = "clips/*.bvh"
features = "pose"
roles = ["Host", "Guest"]
"""


def settings_dict(**keys):
    sections = tomllib.loads(TOML)
    sections["databases"]["greetings"] |= keys
    return {name: sections[name] for name in ("features", "databases")}


def settings(**keys):
    return MotionConfig.from_dict(settings_dict(**keys))


def test_a_database_of_joint_clips_is_built_of_the_assets_of_its_table(tmp_path):
    (tmp_path / "clips").mkdir()
    write_joint_clips(tmp_path / "clips")
    config = settings(place_weight=2.0)
    built = build(config, tmp_path, {"greetings": ["greet_run", "greet_walk"]})
    searcher = config.joint_searcher("greetings", built)
    joint = searcher.databases["greetings"]
    assert (sorted(joint.assets), joint.place_weight) == (["greet_run", "greet_walk"], 2.0)
    (tmp_path / "clips" / "greet_run.Guest.bvh").unlink()
    with pytest.raises(MotionError, match=r'joint asset "greet_run" has no clip for "Guest"'):
        build(config, tmp_path, {"greetings": ["greet_run"]})


def test_an_asset_is_mirrored_for_all_its_roles_or_none():
    with pytest.raises(MotionError, match="is mirrored for some of its roles alone"):
        JointDatabase.of(MotionDatabase.build(CLIPS[:2], SCHEMA, mirror=[CLIPS[0].name]), JOINT_ROLES)


@pytest.mark.parametrize("roles", [["Host"], ["Host", "Host"], ["a.b", "c"], "Host", [1, 2]])
def test_roles_that_cannot_be_are_refused(roles):
    with pytest.raises(SchemaError, match="these are not roles of clips that play together"):
        settings(roles=roles)


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (["a.Host", "a.Gast"], 'the clip "a.Gast" is of no role.'),
        (["a.Host", "b.Host"], 'the joint asset "a" has no clip for "Guest".'),
        (["a.Host", "a.Guest"], 'the clips of the joint asset "a" differ in length: Host 2 frames, Guest 3 frames.'),
    ],
)
def test_clips_that_do_not_belong_together_are_told(names, told):
    plain = MotionDatabase.from_features(np.zeros((5, 1)), [0, 2], [2, 5], names)
    with pytest.raises(MotionError) as error:
        JointDatabase.of(replace(plain, root=np.zeros((5, 3), np.float32)), JOINT_ROLES)
    assert told in str(error.value)


@pytest.mark.parametrize(
    ("queries", "places", "told"),
    [
        ({7: None}, {}, "actor 7: "),
        ({}, {}, "there is no query for the actor 7."),
        (None, {7: (0, 0, 0)}, "there is no place for the actor 3."),
        (None, {7: (0, 0), 3: (0, 0, 0)}, "the place of the actor 7 is (0, 0)."),
        (None, {7: (0, 0, math.nan), 3: (0, 0, 0)}, "the place of the actor 7 is (0, 0, nan)."),
    ],
)
def test_an_actor_whose_query_or_place_is_missing_or_wrong_is_named(greetings, queries, places, told):
    given = recorded(greetings, 0, 40)[0] if queries is None else queries
    with pytest.raises(QueryError) as error:
        JointSearcher(greetings).search(given, places, casts=CAST)
    assert told in str(error.value)


def test_answers_for_many_contexts_are_refused(greetings, table):
    queries, places = recorded(greetings, 0, 40)
    many = table.query_many({"Host.mood": ["glad", "cross"], "Guest.side": [0.0, 0.0]})
    with pytest.raises(QueryError, match="valid holds the answers for many contexts"):
        JointSearcher(greetings).search(queries, places, valid=many)


def test_an_actor_of_a_query_needs_an_id(greetings, table):
    queries, places = recorded(greetings, 0, 40)
    answer = table.query({}, actors={"Host": [{"mood": "glad"}], "Guest": [{"id": 3, "side": 1.0}]})
    with pytest.raises(QueryError, match='an actor offered for "Host" has no id'):
        JointSearcher(greetings).search(queries, places, valid=answer)


def test_check_tells_every_fault_of_joint_clips_and_counts_their_asset_as_having_a_clip(tmp_path):
    (tmp_path / "clips").mkdir()
    write_joint_clips(tmp_path / "clips")
    (tmp_path / "greetings.csv").write_text("Asset\ngreet_run\ngreet_walk\ngreet_tired\n", encoding="utf-8")
    (tmp_path / "contextdb.toml").write_text(TOML, encoding="utf-8")
    assert run("motion", "check", str(tmp_path)).out == "1 database and 6 clips checked: nothing found.\n"
    host = make_joint_clip("greet_walk")["Host"]
    write_bvh(replace(host, values=host.values[1:]), tmp_path / "clips" / "greet_walk.Host.bvh")
    (tmp_path / "clips" / "greet_run.Guest.bvh").unlink()
    found = run("motion", "check", str(tmp_path), "--json").json["findings"]
    assert {each["rule"] for each in found} == {"roles"}
    assert ["greet_run" in each["message"] for each in found] == [True, False]
    assert "differ in length: Host 148 frames, Guest 149 frames" in found[1]["message"]


def test_what_chooses_for_one_character_says_that_joint_clips_are_not_for_it(tmp_path):
    config = MotionConfig.from_dict(settings_dict() | {"selectors": {"player": {"order": [{"database": "greetings"}]}}})
    with pytest.raises(SchemaError, match=r'has the database "greetings" of clips that are cast and chosen together'):
        config.selector("player", {})
    assert config.joint_searcher("player", {"greetings": MotionDatabase.build(CLIPS, SCHEMA)}).roles == JOINT_ROLES
    (tmp_path / "clips").mkdir()
    write_joint_clips(tmp_path / "clips")
    (tmp_path / "greetings.csv").write_text("Asset,wet\ngreet_run,True\n", encoding="utf-8")
    (tmp_path / "contextdb.toml").write_text(TOML + '[conditions.wet]\ntype = "bool"\n', encoding="utf-8")
    result = run("motion", "search", str(tmp_path), "greetings", "wet=True", "--query", "greet_run.Host@1")
    assert "[databases.greetings] has roles: its clips are cast and chosen together" in result.err
