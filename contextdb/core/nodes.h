/* ---- One-offs: an animation that is entered once, plays to its end, and brings the body to a target on the way.
 *
 *   cdbm_warp       the path of an animation, warped so that it ends at a target
 *   cdbm_aim        what the way to a target adds to the cost of each frame: a match node's search is the database's own, with that
 *   cdbm_write_ends where each frame's animation brings the body by itself
 *   cdbm_shortest_part   the shortest part of an animation that leads from one pose to another
 *   cdbm_open_gate  whether something that costs so much may be entered
 *
 * A target, and every place here, is seen by the body as it stands when the animation is entered: metres to its left and ahead, radians
 * to the left. Within a window of time what is missing is blended in: its share goes from 0 to 1 by what the animation itself covers,
 * or turns, so that the warp stands still where feet do; evenly in time where it does too little of either. After that the body
 * follows the animation. See contextdb/motion/nodes/warping.py. */

#define CDBM_STANDING_MPS 0.05      /* what moves or turns more slowly stands */
#define CDBM_STANDING_RADPS 0.1
#define CDBM_LEAST_MOVED_M 0.1      /* an animation that covers or turns less in a window does not carry a warp: a few steps of it */
#define CDBM_LEAST_TURNED 0.15      /* would take all of it at once */
#define CDBM_MOST_TIMES 4.0         /* nor does one of which a warp would add more than so many times its own movement */

typedef struct cdbm_target { double left, ahead, turn; } cdbm_target; /* turn NaN: as the animation brings it about */
typedef struct cdbm_window { double from_s, to_s; } cdbm_window;

typedef struct cdbm_warped {        /* a path with n knots, straight from one to the next */
    size_t n;
    double *times_s, *own, *places, *shares; /* [n], [n, 3] as the animation has it, [n, 3] warped, [n, 2] how much of the warp */
} cdbm_warped;

enum { CDBM_BY_WAY, CDBM_BY_TURN, CDBM_BY_TIME };

static inline int cdbm_is_open(const cdbm_window *window)
{
    return window->to_s - window->from_s > CDBM_TOLERANCE_S;
}

/* How many knots a path of so many frames has at most. */
static inline size_t cdbm_most_knots(size_t n_frames)
{
    return n_frames + 4;
}

static inline int cdbm_take_warped(cdbm_warped *warped, size_t n_knots, cdbm_room *room)
{
    warped->times_s = (double *)cdbm_part(room, n_knots * sizeof(double));
    warped->own = (double *)cdbm_part(room, 3 * n_knots * sizeof(double));
    warped->places = (double *)cdbm_part(room, 3 * n_knots * sizeof(double));
    warped->shares = (double *)cdbm_part(room, 2 * n_knots * sizeof(double));
    return warped->times_s && warped->own && warped->places && warped->shares;
}

/* The row between two knots, or the first or last. */
static inline void cdbm_between_knots(const double *times_s, const double *rows, size_t n, size_t width, double time_s, double *to)
{
    size_t low = 0, high = n - 1, k;
    double share;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (times_s[middle] <= time_s) low = middle;
        else high = middle;
    }
    if (!(time_s > times_s[low])) high = low;
    else if (time_s >= times_s[high]) low = high;
    share = low == high ? 0.0 : (time_s - times_s[low]) / (times_s[high] - times_s[low]);
    for (k = 0; k < width; k++) {
        double one = rows[width * low + k];
        to[k] = low == high ? one : one + share * (rows[width * high + k] - one);
    }
}

/* The moments of some frames and those at which windows open and close, each once. */
static inline size_t cdbm_write_knots(const double *times_s, size_t n, const cdbm_window *windows, double *knots)
{
    size_t i, k;
    memcpy(knots, times_s, n * sizeof *knots);
    for (i = 0; i < 4; i++) {
        double own = i % 2 ? windows[i / 2].to_s : windows[i / 2].from_s;
        if (!cdbm_is_open(&windows[i / 2])) continue;
        for (k = n; k > 0 && knots[k - 1] > own; k--) {}
        if (k > 0 && knots[k - 1] == own) continue;
        memmove(knots + k + 1, knots + k, (n - k) * sizeof *knots);
        knots[k] = own, n++;
    }
    return n;
}

/* What the animation does from a knot to the next, in metres, radians or seconds; standing is 0. */
static inline double cdbm_done(const cdbm_warped *warped, size_t knot, int by)
{
    const double *from = warped->own + 3 * knot, *to = from + 3;
    double seconds = warped->times_s[knot + 1] - warped->times_s[knot], amount;
    if (by == CDBM_BY_TIME) return seconds;
    amount = by == CDBM_BY_WAY ? cdbo_flat_length(to[0] - from[0], to[1] - from[1]) : cdbo_size(to[2] - from[2]);
    return amount > (by == CDBM_BY_WAY ? CDBM_STANDING_MPS : CDBM_STANDING_RADPS) * seconds ? amount : 0.0;
}

/* Write the share of a warp at each knot: by what the animation does most like it, of which there is enough for what is missing. */
static inline void cdbm_write_shares(const cdbm_warped *warped, const cdbm_window *window, int by, double missing, double *shares)
{
    static const double least[] = {CDBM_LEAST_MOVED_M, CDBM_LEAST_TURNED, 0.0};
    int each[3], i = 0;
    double all = 0.0, passed = 0.0;
    size_t k;
    each[0] = by, each[1] = CDBM_BY_WAY + CDBM_BY_TURN - by, each[2] = CDBM_BY_TIME;
    for (k = 0; k < warped->n; k++) shares[2 * k] = 0.0;
    if (!cdbm_is_open(window)) return;
    for (i = 0;; i++) {
        for (all = 0.0, k = 0; k + 1 < warped->n; k++)
            if (warped->times_s[k] >= window->from_s && warped->times_s[k + 1] <= window->to_s) all += cdbm_done(warped, k, each[i]);
        if (i == 2 || all >= cdbo_most(least[each[i]], missing / CDBM_MOST_TIMES)) break;
    }
    for (k = 0; k + 1 < warped->n; k++) {
        if (warped->times_s[k] >= window->from_s && warped->times_s[k + 1] <= window->to_s) passed += cdbm_done(warped, k, each[i]);
        shares[2 * k + 2] = passed / all;
    }
}

static inline size_t cdbm_knot_at(const cdbm_warped *warped, double time_s)
{
    size_t k = 0;
    while (k + 1 < warped->n && warped->times_s[k] < time_s) k++;
    return k;
}

static inline void cdbm_seen(double x, double z, double heading, double *to)
{
    double sine, cosine;
    cdbo_sin_cos(heading, &sine, &cosine);
    to[0] = cosine * x - sine * z, to[1] = sine * x + cosine * z;
}

/* Warp a path [n, 3], x and z in metres and the heading, whose frames are at `times_s`, ascending from 0. `given` are the windows of
 * position and of rotation. Into room for cdbm_most_knots(n) knots; the path is unwrapped. */
static inline void cdbm_warp(const double *times_s, double *path, size_t n, const cdbm_window *given, const cdbm_target *target,
    cdbm_warped *to)
{
    double turn = 0.0, left = 0.0, ahead = 0.0, heading = path[2];
    cdbm_window windows[2];
    size_t k;
    int is_turned;
    for (k = 0; k < 2; k++) windows[k].from_s = given[k].from_s, windows[k].to_s = cdbo_least(given[k].to_s, times_s[n - 1]);
    is_turned = cdbm_is_open(&windows[1]) && target->turn == target->turn;
    cdbo_unwrap(path + 2, 3, n);
    to->n = cdbm_write_knots(times_s, n, windows, to->times_s);
    for (k = 0; k < to->n; k++) cdbm_between_knots(times_s, path, n, 3, to->times_s[k], to->own + 3 * k);
    if (is_turned) turn = cdbo_remainder(target->turn - (to->own[3 * cdbm_knot_at(to, windows[1].to_s) + 2] - heading));
    cdbm_write_shares(to, &windows[1], CDBM_BY_TURN, cdbo_size(turn), to->shares + 1);
    memset(to->places, 0, 3 * sizeof *to->places);
    for (k = 1; k < to->n; k++) {
        const double *own = to->own + 3 * k;
        double *place = to->places + 3 * k, step[2];
        cdbm_seen(own[0] - own[-3], own[1] - own[-2], heading - turn * (to->shares[2 * k + 1] + to->shares[2 * k - 1]) / 2.0, step);
        place[0] = place[-3] + step[0], place[1] = place[-2] + step[1];
        place[2] = own[2] - heading + turn * to->shares[2 * k + 1];
    }
    if (cdbm_is_open(&windows[0])) {
        const double *there = to->places + 3 * cdbm_knot_at(to, windows[0].to_s);
        left = target->left - there[0], ahead = target->ahead - there[1];
    }
    cdbm_write_shares(to, &windows[0], CDBM_BY_WAY, cdbo_flat_length(left, ahead), to->shares);
    for (k = 0; k < to->n; k++) to->places[3 * k] += to->shares[2 * k] * left, to->places[3 * k + 1] += to->shares[2 * k] * ahead;
}

/* Write what the distance to a target and the angle to its heading add to the cost of frames, from where each of them brings the body
 * by itself: [n, 3]. */
static inline void cdbm_aim(const double *ends, size_t n, const cdbm_target *target, const double *weights, double *distances,
    double *rotations)
{
    size_t i;
    for (i = 0; i < n; i++) {
        double left = ends[3 * i] - target->left, ahead = ends[3 * i + 1] - target->ahead;
        double angle = target->turn == target->turn ? cdbo_remainder(ends[3 * i + 2] - target->turn) : 0.0;
        distances[i] = weights[0] * (left * left + ahead * ahead), rotations[i] = weights[1] * (angle * angle);
    }
}

/* Whether a gate is open for what costs so much: one that was open closes at a higher bar. */
static inline int cdbm_open_gate(int was_open, double cost, double threshold, double close_above)
{
    return cost < (was_open ? close_above : threshold);
}

/* ---- as a character plays it */

typedef struct cdbm_one_off {       /* without an address in it: saved with its character */
    double database, range, frame, last, cost; /* where it is entered, and its last frame; range -1: nothing may play */
    double time_s, since_s, rate;   /* since the entry, now and before the last update; seconds of the clip in a second */
    cdbm_target target;
    double origin[3];               /* where the animation was at the entry */
    cdbm_window windows[2];
    cdb_row_play play;
} cdbm_one_off;

static inline double cdbm_duration_s(const cdbm_clips *clips, const cdbm_one_off *one)
{
    return (one->last - one->frame) / (clips->rate * one->rate);
}

/* The windows of position and rotation that are left to a frame of a range which plays on up to another one, in seconds since the frame;
 * one that ends before it begins has no time left. `warps` are the two spans of the range in which it may be warped, [2, 2] in seconds since
 * its start, NaN: as long as it is. */
static inline void cdbm_write_windows(const cdbm_clips *clips, size_t range, int64_t frame, int64_t last, const double *warps, cdbm_window *windows)
{
    double own_s = (double)(frame - clips->starts[range]) / clips->rate, last_s = (double)(last - frame) / clips->rate;
    size_t i;
    for (i = 0; i < 2; i++) {
        double from_s = warps[2 * i] - own_s, to_s = warps[2 * i + 1] - own_s;
        windows[i].from_s = from_s > 0.0 ? from_s : 0.0;
        windows[i].to_s = to_s < last_s ? to_s : last_s;
    }
}

/* Begin one at a frame of a database. */
static inline void cdbm_begin_one_off(const cdbm_clips *clips, size_t range, int64_t frame, const cdb_row_play *play,
    const double *warps, const cdbm_target *target, cdbm_one_off *one)
{
    int64_t last = cdbm_free_until(clips, frame + 1, clips->stops[range]) - 1;
    size_t i;
    one->range = (double)range, one->frame = (double)frame, one->last = (double)last, one->time_s = one->since_s = 0.0;
    one->play = *play, one->rate = play->min_rate == play->min_rate ? cdbo_within(1.0, play->min_rate, play->max_rate) : 1.0;
    cdbm_write_windows(clips, range, frame, last, warps, one->windows);
    for (i = 0; i < 2; i++) one->windows[i].from_s /= one->rate, one->windows[i].to_s /= one->rate;
    one->target = *target;
}

/* Forbid the frames of ranges but that at which their row says that they are entered. */
static inline void cdbm_forbid_others(const cdbm_clips *clips, const cdb_row_play *plays, const int64_t *play_of, double *biases)
{
    size_t r;
    int64_t i, entry;
    for (r = 0; plays && r < clips->n_ranges; r++) {
        double start_s = play_of[r] < 0 ? NAN : plays[play_of[r]].start_s;
        if (!(start_s == start_s) || clips->starts[r] == clips->stops[r]) continue;
        entry = cdbm_frame_at(clips, r, start_s);
        for (i = clips->starts[r]; i < clips->stops[r]; i++)
            if (i != entry) biases[i] = (double)INFINITY;
    }
}

/* ---- where animations end */

/* A path at a fractional row, at most at its last one: x and z, and the heading, of which `headings` has those that go on without jumps. */
static inline void cdbm_row_of_path(const float *root, const double *headings, double row, size_t last, double *to)
{
    size_t low = row < (double)last ? (size_t)row : last, high = low < last ? low + 1 : last, k;
    double share = cdbo_within(row - (double)low, 0.0, 1.0);
    for (k = 0; k < 2; k++) to[k] = (double)root[3 * low + k] * (1.0 - share) + (double)root[3 * high + k] * share;
    to[2] = headings[low] * (1.0 - share) + headings[high] * share;
}

/* Write where each frame's animation brings the body by itself, seen from the frame: [N, 3]. The place is that at the end of what is
 * left of the positional warp range, [R, 2, 2], the turn that at the end of the rotational one; where there is no time left, that at the end
 * of the animation. `headings` has room for the longest range. */
static inline void cdbm_write_ends(const cdbm_clips *clips, const double *warps, double *headings, double *ends)
{
    size_t r, n, i;
    memset(ends, 0, 3 * clips->frames->n_frames * sizeof *ends);
    for (r = 0; r < clips->n_ranges; r++) {
        int64_t start = clips->starts[r], until = start, f;
        const float *root = clips->root + 3 * start;
        n = (size_t)(clips->stops[r] - start);
        for (i = 0; i < n; i++) headings[i] = (double)root[3 * i + 2];
        cdbo_unwrap(headings, 1, n);
        for (f = start; f < clips->stops[r]; f++) {
            double there[2][3], row = (double)(f - start), *end = ends + 3 * f;
            const float *here = root + 3 * (f - start);
            cdbm_window windows[2];
            if (until <= f) until = cdbm_free_until(clips, f + 1, clips->stops[r]);
            cdbm_write_windows(clips, r, f, until - 1, warps + 4 * r, windows);
            for (i = 0; i < 2; i++) {
                double arrival_s = cdbm_is_open(&windows[i]) ? windows[i].to_s : (double)(until - 1 - f) / clips->rate;
                cdbm_row_of_path(root, headings, row + arrival_s * clips->rate, (size_t)(until - 1 - start), there[i]);
            }
            cdbm_seen(there[0][0] - (double)here[0], there[0][1] - (double)here[1], headings[f - start], end);
            end[2] = there[1][2] - headings[f - start];
        }
    }
}

/* ---- stitches */

typedef struct cdbm_stretch { int64_t first, last; double cost; } cdbm_stretch; /* first -1: there is none */

/* How many bytes of room the search for a part takes. */
static inline size_t cdbm_part_room(const cdbm_frames *frames)
{
    return 2 * cdbm_rounded(frames->n_features * sizeof(double)) + cdbm_rounded(frames->n_frames * sizeof(double));
}

/* Find the shortest part whose first frame, with its biases, and last frame cost at most so much together: the first for the query of what
 * is asked, the last for another one. It is a frame long at least; of parts that are equally short the one that costs least, on a tie
 * the earliest. 1; 0 with too little room; -1 for a query that cannot be compared. */
static inline int cdbm_shortest_part(const cdbm_clips *clips, const cdbm_question *asked, const double *after, double most_cost,
    cdbm_stretch *to, cdbm_room room)
{
    const cdbm_frames *frames = clips->frames;
    double *query = (double *)cdbm_part(&room, frames->n_features * sizeof(double));
    double *next = (double *)cdbm_part(&room, frames->n_features * sizeof(double));
    double *ends = (double *)cdbm_part(&room, frames->n_frames * sizeof(double));
    int64_t shortest = INT64_MAX, until = 0, n;
    size_t box, lane;
    to->first = to->last = -1, to->cost = (double)INFINITY;
    if (!query || !next || !ends) return 0;
    if (!cdbm_normalise_exactly(frames, asked->queries, query) || !cdbm_normalise_exactly(frames, after, next)) return -1;
    for (box = 0; box < frames->n_boxes; box++)
        for (lane = 0; lane < (size_t)frames->box_sizes[box]; lane++)
            ends[frames->box_starts[box] + (int64_t)lane] = cdbm_cost(frames, box, lane, next);
    for (box = 0; box < frames->n_boxes; box++) {
        size_t range = (size_t)frames->box_ranges[box];
        if (!asked->ranges[range]) continue;
        for (lane = 0; lane < (size_t)frames->box_sizes[box]; lane++) {
            int64_t frame = frames->box_starts[box] + (int64_t)lane;
            size_t kind = frames->kinds ? (size_t)frames->kinds[frame] : 0;
            double bias = asked->range_biases[range] + asked->kind_biases[kind], first;
            if (asked->frame_biases) bias += asked->frame_biases[frame];
            if (!asked->allowed[kind] || (asked->flags && !asked->flags[frame]) || bias == (double)INFINITY) continue;
            if (until <= frame || until > clips->stops[range]) until = cdbm_free_until(clips, frame + 1, clips->stops[range]);
            first = cdbm_cost(frames, box, lane, query) + bias;
            for (n = 1; n <= shortest && frame + n < until; n++) {
                double cost = first + ends[frame + n];
                if (!(cost <= most_cost)) continue;
                if (n < shortest || cost < to->cost) shortest = n, to->first = frame, to->last = frame + n, to->cost = cost;
                break;
            }
        }
    }
    return 1;
}

/* Begin one that plays a part as it is. */
static inline void cdbm_begin_part(const cdbm_clips *clips, size_t range, const cdbm_stretch *part, const cdb_row_play *play, cdbm_one_off *one)
{
    const float *here = clips->root + 3 * part->first, *there = clips->root + 3 * part->last;
    double no_warps[4] = {NAN, NAN, NAN, NAN}, way[2];
    cdbm_target target;
    cdbm_seen((double)there[0] - (double)here[0], (double)there[1] - (double)here[1], (double)here[2], way);
    target.left = way[0], target.ahead = way[1], target.turn = cdbo_remainder((double)there[2] - (double)here[2]);
    cdbm_begin_one_off(clips, range, part->first, play, no_warps, &target, one);
    memset(one->windows, 0, sizeof one->windows);
    one->last = (double)part->last, one->cost = part->cost;
}

/* How many bytes of room a path of so many frames takes. */
static inline size_t cdbm_path_room(size_t n_frames)
{
    return 13 * cdbm_most_knots(n_frames) * sizeof(double) + 6 * sizeof(double);
}

/* Its path from entry to end. 0 with too little room. */
static inline int cdbm_path_of(const cdbm_clips *clips, const cdbm_one_off *one, cdbm_warped *to, cdbm_room room)
{
    size_t first = (size_t)one->frame, n = (size_t)(one->last - one->frame) + 1, i, k;
    double *path = (double *)cdbm_part(&room, 3 * n * sizeof(double)), *times_s = (double *)cdbm_part(&room, n * sizeof(double));
    if (!path || !times_s || !cdbm_take_warped(to, cdbm_most_knots(n), &room)) return 0;
    for (i = 0; i < n; i++) {
        for (k = 0; k < 3; k++) path[3 * i + k] = (double)clips->root[3 * (first + i) + k];
        times_s[i] = (double)i / (clips->rate * one->rate);
    }
    cdbm_warp(times_s, path, n, one->windows, &one->target, to);
    return 1;
}

static inline void cdbm_place_at(const cdbm_warped *warped, double time_s, double *place)
{
    cdbm_between_knots(warped->times_s, warped->places, warped->n, 3, time_s, place);
}

/* Play on for some seconds; at the end it stays. */
static inline void cdbm_advance(const cdbm_clips *clips, cdbm_one_off *one, double dt_s)
{
    double duration_s = cdbm_duration_s(clips, one);
    one->since_s = one->time_s;
    one->time_s += dt_s;
    if (one->time_s > duration_s - CDBM_TOLERANCE_S) one->time_s = duration_s;
}

static inline int cdbm_is_done(const cdbm_clips *clips, const cdbm_one_off *one)
{
    return one->time_s >= cdbm_duration_s(clips, one);
}

/* What it shows. */
static inline cdbm_playing cdbm_playing_of(const cdbm_clips *clips, const cdbm_one_off *one)
{
    cdbm_playing playing;
    size_t range = (size_t)one->range;
    playing.database = one->database, playing.range = one->range;
    playing.at_s = (one->frame - (double)clips->starts[range]) / clips->rate + one->time_s * one->rate;
    playing.frame = (double)cdbm_frame_at(clips, range, playing.at_s);
    return playing;
}

/* How it moved the body in the last update, seen from where the body was before that. */
static inline void cdbm_motion_of(const cdbm_warped *warped, const cdbm_one_off *one, double *motion)
{
    double before[3], now[3];
    cdbm_place_at(warped, one->since_s, before);
    cdbm_place_at(warped, one->time_s, now);
    cdbm_seen(now[0] - before[0], now[1] - before[1], before[2], motion);
    motion[2] = now[2] - before[2];
}
