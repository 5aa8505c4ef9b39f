from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

class Shared:
    """What the answers of one table share: the numbers of its rows, and what makes an array of the bytes of some."""

    def __init__(self, row_numbers: NDArray[np.int64], as_rows: Callable[[bytes], NDArray[np.int64]]) -> None: ...
    @property
    def row_numbers(self) -> NDArray[np.int64]: ...

class Answer:
    """The rows of one answer, as one integer and as row numbers; its length is their number."""

    bits: int
    def __init__(self, bits: int, table: Any) -> None: ...
    @property
    def _table(self) -> Any: ...
    @property
    def indices(self) -> NDArray[np.int64]: ...
    def __len__(self) -> int: ...
    def __bool__(self) -> bool: ...

class Table:
    """A compiled table that answers contexts.

    A condition is (name, type, expr or None, values, numbers or None, read or None, column or None, soft or None). `values` are
    those of an enum from 0, of declared tags from 1, behind ""; `numbers` is the number of each; `read` makes a plain fact of
    another one. A column is (kind, shift, arrays, texts, negated), its arrays (masks,), (bounds, masks) or (bounds, low, high,
    any_mask), as in `contextdb.compiled.classes`; `soft` is (column, penalties), with the rows of each depth one after the other.
    Programs are (texts, facts, types, numbers, code, starts, derived, of_row), as in `contextdb.expressions.programs`. Raises
    ValueError where parts do not go together, or a text cannot be one of C. Of a table with such texts `enabled` is None and
    `conditions` are names alone: the careful way then answers everything.
    """

    def __init__(
        self,
        answers: type[Answer],
        shared: Shared,
        unusual: tuple[type[Exception], ...],
        n_rows: int,
        enabled: NDArray[np.uint64] | None,
        conditions: tuple[tuple[Any, ...] | str, ...],
        programs: tuple[Any, ...] | None,
    ) -> None: ...
    def query(self, context: Mapping[str, object], unknown: int = 0, /) -> Any:
        """The answer, of the class `answers`; a missing fact is an error (0), ignored (1) or accepted by Any alone (2). None where
        the careful way must decide: a fact that is not plainly of its type, a set of values, a missing fact that may be a slip."""
    def accepting(self, context: Mapping[str, object], unknown: int, words: NDArray[np.uint64], /) -> bool:
        """Put into uint64 [n, W] for the first n conditions the rows whose cell accepts the fact. False where the careful way must
        decide."""
    def penalties(self, context: Mapping[str, object], unknown: int, costs: NDArray[np.float64], /) -> bool:
        """Add to the costs [n_depths, n_rows], which are 0, the penalties of the soft cells that do not match. False where the
        careful way must decide: the costs are then still 0."""
    is_watched: bool
    """Whether somebody learns of questions: functions of `query_or` then pass all on."""
    def query_or(self, otherwise: Callable[..., Any], /) -> Callable[..., Any]:
        """A function that answers a dict alone as `query` does. All that it cannot answer, and other arguments, it passes on."""

class Live:
    """Facts that are kept between questions; all are missing at first."""

    def __init__(self, table: Table, unknown: int, keeps_last: bool) -> None: ...
    @property
    def _facts(self) -> dict[str, object]: ...
    def __setitem__(self, name: str, value: object) -> None:
        """Set a fact; None makes it missing. One that is not plain, or has another name, is given to `_set_carefully`."""
    def __delitem__(self, name: str) -> None: ...
    def _set_odd(self, name: str, value: object, /) -> None:
        """Keep a fact that the core cannot hold, such as a set of values: until it is set again, the careful way answers."""
    _is_led: bool
    """Whether `matches` is left to `_matches`: more hangs on an answer than the facts."""
    def matches(self) -> Any:
        """The answer to the facts as they are now, by `_ask`, else by `_matches`."""
    def _ask(self) -> Any:
        """The answer to the facts as they are now, None where the careful way must decide; with `keeps_last` the same object as
        before while the rows stay the same."""

class Boxes:
    """Boxes of contexts: of each factor a box accepts a set of its classes, which is a cell. Other threads run while it works.

    `cells` int32 [boxes, factors] are numbers of cells, -1 accepts everything. A cell accepts the classes from `runs` int32 [., 2]
    up to, not including, the second, of those from `first` int64 [cells + 1] on; `hashes` uint64 [cells, 2] tell cells apart. The
    classes of each factor begin at `edges` int64 [factors + 1]. Weights are float64 [classes of all factors]. Every now and then
    `look`, where it is not None, is called with the steps that are done; what it raises ends the call. Raises ValueError where
    parts do not go together.
    """

    def __init__(
        self,
        cells: NDArray[np.int32],
        runs: NDArray[np.int32],
        first: NDArray[np.int64],
        hashes: NDArray[np.uint64],
        edges: NDArray[np.int64],
    ) -> None: ...
    def uncovered(
        self, weights: NDArray[np.float64], first_work: int, work: int, look: Callable[[int], object] | None, /
    ) -> tuple[float, float, int, int]:
        """Bounds of the share of contexts that no box holds, the steps done, and whether some part was cut short. Steps up to
        `first_work` go to the exact share, the rest to better bounds where they do not do. Sums of whole weights are exact."""
    def leaves_open(
        self, chosen: NDArray[np.int32], weights: NDArray[np.float64], done: int, work: int, look: Callable[[int], object] | None, /
    ) -> tuple[int, int, int]:
        """Whether a context, of classes of some weight, is in none of the chosen boxes, which ascend; "no" where that was cut
        short, whether it was, and the steps: with `done` of `work` before."""
    def first_holders(
        self,
        chosen: NDArray[np.int32],
        weights: NDArray[np.float64],
        alike: NDArray[np.int64],
        holders: NDArray[np.int64],
        look: Callable[[int], object] | None,
        /,
    ) -> None:
        """Write to `holders` for each chosen box the place of the first that holds it whole and is not like it, else -1; `alike`
        names the first box like each. `look` gets the number of boxes that are done."""

def direction_of(x: float, z: float, heading: float, /) -> float:
    """Where a stick points against the way a body faces, degrees."""

def until_down_s(contacts: NDArray[np.bool_], foot: int, is_looping: bool, rate: float, at_s: float, /) -> float:
    """Seconds until a foot is down, by the contacts of all frames and feet of a clip."""

def going(path: NDArray[np.float32], rate: float, at_s: float, /) -> tuple[float, float]:
    """How fast a clip goes, m/s, and turns, degrees a second, about a second of it."""

def phase(n_frames: int, rate: float, at_s: float, /) -> float:
    """The share of a clip that has played at a second of it."""

def motion_then(
    left: float, ahead: float, turn: float, then_left: float, then_ahead: float, then_turn: float, /
) -> tuple[float, float, float]:
    """A movement over the ground, and another one after it."""

def motion_from(
    left: float, ahead: float, turn: float, to_left: float, to_ahead: float, to_turn: float, /
) -> tuple[float, float, float]:
    """The movement that leads from one place of a body to another one."""

def warp(
    times: NDArray[np.float64],
    path: NDArray[np.float64],
    windows: NDArray[np.float64],
    target: NDArray[np.float64],
    knots: NDArray[np.float64],
    own: NDArray[np.float64],
    places: NDArray[np.float64],
    shares: NDArray[np.float64],
    /,
) -> int:
    """Write a path that is warped to a target, into arrays for four more knots than it has frames; how many it has. The path is
    unwrapped."""

def row_at(times: NDArray[np.float64], rows: NDArray[np.float64], time_s: float, to: NDArray[np.float64], /) -> None:
    """Write the row between two times."""

def see_others(places: NDArray[np.float64], others: NDArray[np.float64], seen: NDArray[np.float64], /) -> None:
    """Write what bodies at places [n, 3] see of others, in the units of costs: [n, 4]."""

def align(
    recorded: NDArray[np.float64], places: NDArray[np.float64], gives: NDArray[np.float64], put: NDArray[np.float64], /
) -> None:
    """Write where a clip that was recorded at places [K, 3] has its actors when it is put down best for others [K, 3]."""

def begin_roles(
    controllers: Controllers,
    ranges: NDArray[np.int64],
    frame: int,
    warps: NDArray[np.float64],
    put: NDArray[np.float64],
    starts: NDArray[np.float64],
    targets: NDArray[np.float64],
    /,
) -> tuple[int, float, float]:
    """The last frame of the first role of a joint clip that is entered at a frame, and from when to when its actors are brought
    together; writes where each, as he sees it, is to be then: [K, 3]."""

def write_ends(controllers: Controllers, warps: NDArray[np.float64], ends: NDArray[np.float64], /) -> None:
    """Write where each frame's animation brings the body by itself, float64 [N, 3], by the warp ranges [R, 2, 2]; of the one
    database of the controllers, as all of these."""

def begin_one_off(
    controllers: Controllers,
    at: int,
    frame: int,
    last: int,
    play: NDArray[np.float64] | None,
    warps: NDArray[np.float64],
    target: NDArray[np.float64],
    windows: NDArray[np.float64],
    /,
) -> tuple[int, float]:
    """The last frame and the play rate of the range `at` that is entered at a frame, as its row says that it plays [8]; writes its
    warp windows [2, 2]. With a last frame, else -1, it plays up to there as it is, and its target is written."""

def forbid_others(
    controllers: Controllers, plays: NDArray[np.float64], play_of: NDArray[np.int64], biases: NDArray[np.float64], /
) -> None:
    """Make the biases of frames [N] infinite but for those at which rows say that they are entered; `play_of` [R] is the row of
    each range, -1 for none."""

def shortest_part(controllers: Controllers, *question: NDArray[Any] | float | None) -> tuple[int, int, float] | None:
    """shortest_part(controllers, query, ranges, range_biases, allowed, kind_biases, playable, flags, frame_biases, after,
    most_cost): the first and the last frame, -1 for none, of the shortest part that joins two poses, and its cost; None for a
    query that cannot be compared."""

def filter_kinds(*arguments: bytes | NDArray[Any]) -> bool:
    """filter_kinds(known, flags, include, every, exclude, prefer, prefer_costs, avoid, avoid_costs, passes, added): which kinds of
    frames [K] tags let pass, and what they add to their costs, into the last two; whether the markup knows all of them. Tags are
    texts one after another, each ended by 0; `flags` bool [K, T] are those that kinds have."""

def aim(
    ends: NDArray[np.float64],
    target: NDArray[np.float64],
    weights: NDArray[np.float64],
    distances: NDArray[np.float64],
    rotations: NDArray[np.float64],
    /,
) -> None:
    """Write what a target adds to the costs of frames, from where each brings the body by itself."""

def count_holders(
    codes: NDArray[np.int32],
    starts: NDArray[np.int64],
    masks: NDArray[np.uint64],
    weights: NDArray[np.float64] | None,
    counts: NDArray[np.int64],
    firsts: NDArray[np.int64],
    hits: NDArray[np.float64],
    /,
) -> None:
    """Write how many boxes hold each context, [N], and the first, else -1, [N]; add to `hits`, [boxes], what the contexts that each
    box holds weigh, in their order; 1 each without weights. `codes` are [N, factors] classes; mask starts[f] + class holds the
    boxes that accept it."""

class PoseFrames:
    """The frames of a pose bank; see frames.h. Raises ValueError where arrays do not go together."""

    def __init__(
        self,
        rotations: NDArray[np.float32],
        positions: NDArray[np.float32],
        root: NDArray[np.float32],
        ways: NDArray[np.float64],
        contacts: NDArray[np.bool_],
        steps: NDArray[np.float64] | None,
        starts: NDArray[np.int64],
        n_steps: NDArray[np.int64],
        looping: NDArray[np.bool_],
        rate: float,
    ) -> None: ...
    def sample(
        self,
        range_number: int,
        time_s: float,
        rotations: NDArray[np.float64],
        positions: NDArray[np.float64],
        spins: NDArray[np.float64],
        velocities: NDArray[np.float64],
        numbers: NDArray[np.float64],
        /,
    ) -> None:
        """Write a moment of a range; `numbers` [6]: the two frames about it, the share of the second, the root's velocity."""
    def accelerations(
        self,
        range_number: int,
        parents: NDArray[np.int64],
        offsets: NDArray[np.float64],
        places: NDArray[np.int64],
        step: int,
        to: NDArray[np.float64],
        /,
    ) -> None:
        """Write how much the joint that accelerates most does so in each frame of a range, over steps of some frames."""

class Program:
    """An expression as a program; see python_programs.h. Raises ValueError for one that C cannot compute."""

    def __init__(self, code: NDArray[np.int32], numbers: NDArray[np.float64], texts: tuple[str, ...], types: str) -> None: ...
    def run(self, values: tuple[object, ...]) -> float | bool | str | frozenset[str] | None: ...

class Ways:
    """How far the paths of characters are looked at; see walk.h. Raises ValueError where a feature is not there."""

    def __init__(
        self, steps: NDArray[np.float64], features: NDArray[np.int64], velocities: NDArray[np.int64], n_features: int, rate: float
    ) -> None: ...
    @property
    def width(self) -> int: ...
    def go_on(
        self,
        controllers: Controllers,
        before: NDArray[np.float64],
        goals: NDArray[np.float64] | tuple[float, float, float],
        bodies: NDArray[np.float64] | None,
        dt_s: float,
        rows: NDArray[np.float64],
        poses: NDArray[np.float64] | None,
        after: NDArray[np.float64],
        moved: NDArray[np.float64],
        queries: NDArray[np.float64],
        places: NDArray[np.float64],
        /,
    ) -> tuple[tuple[float, float, float], ...]:
        """Write walks as they are some time later, what plays, the queries that ask for the paths that are wished for, and where
        bodies are. Gives of each its speed, the direction of its stick and its turn. The goal of one may be a tuple; a body that is
        NaN follows its goal, a pose that is NaN is that of what plays."""
    def n_frames(self, walks: NDArray[np.float64], goals: NDArray[np.float64], /) -> int:
        """How many frames the longest of their paths has."""
    def n_behind(self, rate: float, /) -> int:
        """How many frames of a path lie behind now."""
    def ask(
        self,
        walks: NDArray[np.float64],
        goals: NDArray[np.float64] | None,
        rate: float,
        poses: NDArray[np.float64],
        positions: NDArray[np.float64],
        headings: NDArray[np.float64],
        queries: NDArray[np.float64],
        /,
    ) -> None:
        """Write the paths that are wished for, and queries; without goals the frames from now on are there."""
    def rest(self, walks: NDArray[np.float64], mean: NDArray[np.float64], poses: NDArray[np.float64], /) -> None:
        """Write the poses of characters that play nothing."""
    def settle(self, walks: NDArray[np.float64], roots: NDArray[np.float64], moves_body: NDArray[np.bool_], /) -> None:
        """Put walks where poses are displayed."""

class Poses:
    """The stages of the poses of a rig; see pose.h. Raises ValueError where the rig and its banks do not go together."""

    def __init__(
        self,
        parents: NDArray[np.int64],
        offsets: NDArray[np.float64],
        places: NDArray[np.int64],
        legs: NDArray[np.int64],
        hinges: NDArray[np.float64],
        tops: NDArray[np.int64],
        spine: NDArray[np.int64],
        left: NDArray[np.float64],
        most_accel: float,
        n_moving: int,
        settings: dict[str, float],
        banks: tuple[PoseFrames, ...],
    ) -> None: ...
    @property
    def width(self) -> int: ...
    def begin(self, row: NDArray[np.float64], /) -> None:
        """Write the row of a character that has not displayed anything yet."""
    def update(
        self,
        before: NDArray[np.float64],
        plays: NDArray[np.float64],
        places: NDArray[np.float64] | None,
        dt_s: float,
        grounds: object,
        after: NDArray[np.float64],
        displayed: NDArray[np.float64],
        roots: NDArray[np.float64],
        made: NDArray[np.float64],
        contacts: NDArray[np.bool_],
        moves_body: NDArray[np.bool_],
        ask: Callable[..., Any],
        /,
    ) -> bool:
        """Put characters through all stages by what was decided; gives whether all play something. `ask` gives what is below: of
        one of a tuple of grounds, x and z; or of a ground for all and a tuple of (x, z), for each of them. `made` is what happened
        to each, the moments at seams, two for each, rotations, translations and positions, one array after the other."""

def risen(answer: object, steepest: float, /) -> tuple[float, float, float] | None:
    """A ground's answer (height, (nx, ny, nz)) as its height and by how much it rises along x and z; None for one that is about as
    steep, that points down, or that is not made of floats in tuples."""

def pose_columns() -> dict[str, int]:
    """Where each single number of a character's row is, by its name."""

def place_joints(
    parents: NDArray[np.int64],
    translations: NDArray[np.float64],
    rotations: NDArray[np.float64],
    root: NDArray[np.float64],
    positions: NDArray[np.float64],
    world: NDArray[np.float64],
    /,
) -> None:
    """Write where the joints of a pose are in the world, and their rotations there."""

def bend_legs(
    parents: NDArray[np.int64],
    positions: NDArray[np.float64],
    world: NDArray[np.float64],
    leg: NDArray[np.int64],
    targets: NDArray[np.float64],
    ahead: NDArray[np.float64],
    straight: float,
    rotations: NDArray[np.float64],
    /,
) -> None:
    """Write the rotations of a leg (hip, knee, ankle) whose ankle comes to its target in each of some poses."""

def lower_hips(
    positions: NDArray[np.float64],
    legs: NDArray[np.int64],
    places: NDArray[np.float64],
    footings: NDArray[np.float64],
    raised: float,
    lower: NDArray[np.float64],
    dt_s: float,
    /,
) -> None:
    """Write how low hips are so that legs reach their places, and the change of that, some time later."""

def stand_legs(
    parents: NDArray[np.int64],
    positions: NDArray[np.float64],
    world: NDArray[np.float64],
    legs: NDArray[np.int64],
    hinges: NDArray[np.float64],
    places: NDArray[np.float64],
    footings: NDArray[np.float64],
    rotations: NDArray[np.float64],
    /,
) -> None:
    """Write the rotations of legs whose feet come to their places, as steep as the ground there."""

def feel_ground(
    footings: NDArray[np.float64],
    hips: NDArray[np.float64],
    below: NDArray[np.float64],
    shares: NDArray[np.float64],
    is_new: bool,
    dt_s: float,
    /,
) -> None:
    """Write the ground below feet, and the height of the hips and its change, some time later; see ground.h."""

def move_bodies(bodies: NDArray[np.float64], goals: NDArray[np.float64], dt_s: float, moved: NDArray[np.float64], /) -> None:
    """Write bodies [Q, 10] as they are some time later; see paths.h. Goals [Q, 3] are velocities and headings, NaN for where a body
    goes."""

def steer_paths(
    bodies: NDArray[np.float64],
    goals: NDArray[np.float64],
    rate: float,
    n_past: int,
    positions: NDArray[np.float64],
    headings: NDArray[np.float64],
    /,
) -> None:
    """Write the frames of paths behind the first `n_past`, of which the last is the body now."""

def write_paths(
    positions: NDArray[np.float64],
    headings: NDArray[np.float64],
    now: int,
    rate: float,
    steps: NDArray[np.float64],
    features: NDArray[np.int64],
    queries: NDArray[np.float32],
    /,
) -> None:
    """Write what queries say of the points of paths: `steps` [P] away, `features` [P, 3] as in paths.h."""

class Frames:
    """The arrays of a motion database, which it holds, checked; see `contextdb.motion.search.layout` for what they are.

    Frames(blocks, order, rank, box_starts, box_sizes, box_ranges, box_kinds, range_boxes, kinds, n_frames, n_kinds, offset, scale,
    channels, weights, roots). `box_kinds` int32 [B] is the kind of all frames of a box, or -1; `kinds` int32 [N] is None where all
    are 0; `channels` int64 [C + 1] is where channels begin, and the end of the last; `weights` float64 [C] are those of channels,
    `roots` float64 [F] the root of that of each feature. Raises ValueError where they do not go together.
    """

    def __init__(self, *arguments: NDArray[Any] | int | None) -> None: ...
    @property
    def n_bytes(self) -> int:
        """The bytes that it takes beside the arrays."""
    def levels(
        self,
        step: NDArray[np.float64],
        group_lows: NDArray[np.int16],
        group_highs: NDArray[np.int16],
        cluster_lows: NDArray[np.int16],
        cluster_highs: NDArray[np.int16],
        /,
    ) -> None:
        """Write its bounds, for those who keep them."""
    def search(self, *arguments: NDArray[Any] | float | None) -> int:
        """search(query, ranges, range_biases, allowed, kind_biases, playable, flags, frame_biases, skips, current, continuing,
        within, totals, best_frames): the lowest total that is not above `within`, and its frame (-1 for none), into the last two,
        of length 1, or one for each range. Gives the range of the best; -1 for none, -2 for a query that cannot be compared.
        `flags`, `frame_biases` and `skips` may be None."""
    def search_many(self, *arguments: NDArray[Any] | float | None) -> None:
        """search_many(queries, ranges, range_biases, allowed, kind_biases, playable, flags, frame_biases, skips, skip_stops,
        currents, continuing, start, stop, totals, best_frames, best_ranges): the same for queries `start` to `stop` - 1, into the
        last three; `ranges` and `range_biases` have a row for each query, or one for all. Several threads may run it at once."""

class Controllers:
    """The databases of a selector and the settings of controllers; see controller.h and `contextdb.motion.selection.chooser`."""

    def __init__(
        self,
        databases: tuple[tuple[Any, ...], ...],
        n_played: int,
        search_every_s: float,
        jump_threshold_s: float,
        history_s: float,
        min_rate: float,
        max_rate: float,
        grace_s: float,
        settle_s: float,
        asset_history_s: float,
        until_natural: bool,
        varies: bool,
        vary_within: float,
        n_recent: int,
    ) -> None: ...
    @property
    def width(self) -> int:
        """How many numbers the row of a character has."""
    def move(
        self, rows: NDArray[np.float64], dt_s: float, moved: NDArray[np.float64], features: NDArray[np.float64] | None, /
    ) -> None:
        """Write what plays some time later, [Q, 16], and the features of its frames, [Q, F]."""
    def update(self, parts: int, start: int, stop: int, *arrays: NDArray[Any] | float | None) -> bool:
        """update(parts, start, stop, before, moved, queries, dt_s, ranges, range_biases, allowed, playable, kind_biases, flags,
        frame_biases, among, urgent, plays, play_of, wide, to_event, event_s, after, decisions, found): 1 asks, 2
        chooses, 4 decides, for characters `start` to `stop` - 1, into the last three.
        Whether all queries can be compared. Several threads may run it at once."""
    def pack(self, row: NDArray[np.float64], /) -> bytes: ...
    def read_packet(self, packet: bytes, moved: NDArray[np.float64], followed: NDArray[np.float64], /) -> bool: ...
    def skips(
        self,
        row: NDArray[np.float64],
        moved: NDArray[np.float64],
        decision: NDArray[np.float64],
        database: int,
        spans: NDArray[np.int64],
        whys: NDArray[np.uint8],
        plays: NDArray[np.float64] | None,
        play_of: NDArray[np.int64] | None,
        /,
    ) -> int:
        """Write the spans of frames that a search leaves out, and why; gives how many."""

def fill_ranges(*arguments: NDArray[Any] | int | None) -> None:
    """fill_ranges(starts, rows, mirrored, at, masks, in_mirror, costs, costs_in_mirror, own_biases, ranges, biases, plays, chosen):
    which ranges each of some answers lets play, into columns from `at` on, and by which row; `rows` from `starts[r]` on are those
    of range r."""

def fill_plays(
    decisions: NDArray[np.float64],
    starts: NDArray[np.int64],
    banks: NDArray[np.int64],
    ranges: NDArray[np.int64],
    displayed: NDArray[np.float64],
    grounds: object,
    plays: NDArray[np.float64],
    /,
) -> bool:
    """Write what poses are made of, by what was decided; gives whether the banks have all that plays. `banks` is that of each
    database, `ranges` from `starts[d]` on the range there of each of its ranges, below 0 for none; `grounds` is for all, a tuple
    for each."""

def search_joint(*arguments: NDArray[Any]) -> None:
    """search_joint(blocks, rank, boxes, lows, highs, channels, weights, ranges, firsts, relative, relative_lows, relative_highs,
    pairs, relative_weights, queries, seen, casts, range_biases, frame_biases, bests, best_frames, best_casts): lowers the best
    total, of length 1, or that of each cast in each range, to those of these casts, and sets its frame and its cast. The arrays are
    those of `contextdb.motion.joint`. Raises ValueError where they do not go together."""

class Batch:
    """What answers many contexts of one table by their codes, see `contextdb.compiled.codes`.

    `plain` are slots (first code, whether facts of it are looked up together with others, masks uint64 [n, W]), the last mask that
    of a missing fact; `wide` columns (number of bounds, shift, low, high, any_mask), as `contextdb.compiled.classes` has them.
    """

    def __init__(
        self, n_rows: int, enabled: NDArray[np.uint64], plain: tuple[tuple[Any, ...], ...], wide: tuple[tuple[Any, ...], ...]
    ) -> None: ...
    def answer(
        self,
        codes: NDArray[np.int32],
        start: int,
        stop: int,
        counts: NDArray[np.int64] | None,
        hits: NDArray[np.int64] | None,
        weights: NDArray[np.int64] | None,
        masks: NDArray[np.uint64] | None,
        /,
    ) -> bool:
        """Answer contexts by codes int32 [P, N]: how many rows are valid in each, int64 [N]; what the contexts weigh in which each
        row is valid, added to int64 [64 W]; weights int64 [N], None for 1 each; their rows uint64 [N, W]. False where a code is
        none of its slot."""

def read_column(
    table: Table, at: int, column: Any, first: int, is_ignored: bool, cells: tuple[Any, ...] | None, codes: NDArray[np.int32], /
) -> int | None:
    """Put the codes of the facts of condition `at` into int32 [slots, N], `first` that of its first mask; gives how many facts are
    missing. A column is a list or tuple, an array of numpy's, or a capsule with an Arrow stream. None where the careful way must
    read it: a fact is not plainly of its type. `cells` are those of `contextdb.compiled.classes`, for numbers."""

Field = tuple[int, int, int, int]

"""A field of keys: its word, its first bit, how many bits it has, and the code that is 0 in it."""

def pack_codes(codes: NDArray[np.int32], field: Field, words: NDArray[np.uint64], /) -> None:
    """Put codes int32 [N] into a field, which is 0, of keys uint64 [K, N]."""

def turn_rows(codes: NDArray[np.int32], cells: NDArray[np.int64], numbers: NDArray[np.int64], masks: NDArray[np.uint64], /) -> None:
    """For each pair of a cell and the number of a mask, turn over in this mask, uint64 [masks, W], the bits of the rows that hold
    the cell by their codes, int32 [n_rows]."""

def unpack_codes(
    words: NDArray[np.uint64], rows: NDArray[np.int32], fields: tuple[Field, ...], codes: NDArray[np.int32], /
) -> None:
    """Take the codes int32 [fields, M] of the keys `rows` int32 [M] out of uint64 [K, N]."""

def hash_keys(words: NDArray[np.uint64], hashes: NDArray[np.uint64], /) -> None:
    """A hash uint64 [N] of each key uint64 [K, N], the same on every machine."""

def group_keys(
    words: NDArray[np.uint64],
    hashes: NDArray[np.uint64],
    moments: NDArray[np.int64],
    first: NDArray[np.int32],
    sums: NDArray[np.int64],
    /,
) -> int:
    """How many distinct keys have moments; the first context of each into int32 [N], the sum of its moments into int64 [N]."""

def list_rows(masks: NDArray[np.uint64], rows: NDArray[np.int64], /) -> None:
    """The rows of masks uint64 [N, W], one mask after the other, into int64 of as many."""

Picked = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]

"""What characters have picked: turns [C], recent [C, k], rests, rest_turns and rest_s [C, r], see `contextdb.compiled.picked`."""

class Choices:
    """What of a table decides between its rows, for one picker. `arrays` are, D depths, n rows, L rows that rest: taken, groups,
    ranks, weights, is_unique, is_cheapest [D, n], pickable [W], levels [ranks, W], assets [n], their rows and where those of each
    begin, limit_of [D, n], the rows of each limit and where they begin, once, cooldown_s, cooldown_turns, columns [L],
    limit_of_column, each weight over the highest [n], the rows that have it [W]."""

    def __init__(self, n_rows: int, remembers: bool, is_even: bool, arrays: tuple[NDArray[Any], ...]) -> None: ...
    def pick(
        self,
        masks: NDArray[np.uint64],
        who: NDArray[np.int64],
        slots: NDArray[np.int64],
        seed: int,
        time_s: float,
        picked: Picked,
        costs: NDArray[np.float64] | None,
        rows: NDArray[np.int64],
        stages: NDArray[np.uint64] | None,
        /,
    ) -> tuple[int, ...] | None:
        """The row of each of many characters, whose memories are in `slots`, into int64 [N], -1 for none; nothing is remembered.
        `costs` float64 [D, pairs] are those of all valid rows, context by context. `stages` uint64 [3, W], for one: the rows that
        do not rest, of these that may be picked, of these that were picked least lately. Where a policy refuses several rows: the
        context, the depth, and the rows of that table."""
    def remember(self, slots: NDArray[np.int64], rows: NDArray[np.int64], time_s: float, picked: Picked, /) -> int:
        """Remember the picks of characters, and forget the rests that are over. Gives how many more rests one of them must be able
        to remember; nothing is remembered where there are some."""
