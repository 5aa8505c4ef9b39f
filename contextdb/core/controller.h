/* ---- What a character plays: whether it searches at an update, what it leaves out, and what comes of it.
 *
 *   cdbm_move      what plays, some time later, before any search
 *   cdbm_ask       why it searches now, or what lets it play on without
 *   cdbm_choose    the best frame, from the databases in their order
 *   cdbm_weigh     what it costs to play on, and whether another frame is to play that is about as good as the best
 *   cdbm_decide    what plays then, and where the character is for the next update
 *
 * Between two updates a character is a row of numbers: a cdbm_state, and behind it what it has played lately, and the assets that
 * variation remembers. Nothing is changed in
 * place: an update writes a new row, so that old ones stay good for a rollback. All records hold doubles alone, as they come in
 * arrays; where a number is one of several things it is the number of its word, see contextdb/motion/selection.
 *
 * Source: the settings of Unreal's motion matching node (throttle, jump threshold, reselect history, continuing pose, interrupt);
 * DoNotChoose, NextNaturalOnly, priority databases and root motion weight of EA's talk. */

#define CDBM_TOLERANCE_S 1e-6 /* times that are nearer than this are the same: sums of time steps are rounded */
#define CDBM_RATE_SHARE 0.36  /* so much of a missing speed is made up for by the play rate, in logarithms */
#define CDBM_RATE_HALFLIFE_S 0.2
#define CDBM_MOST_SEED 9007199254740992.0 /* 2 to the 53rd */
#define CDBM_LEAST_MPS 0.2    /* a clip or character that is slower stands: nothing is made up for */

typedef enum cdbm_cause { CDBM_NOT_DUE, CDBM_NOTHING_PLAYS, CDBM_LOST, CDBM_ENDED, CDBM_NOT_AMONG, CDBM_INTERRUPTED, CDBM_NOT_VALID,
    CDBM_FORCED, CDBM_DUE } cdbm_cause;
typedef enum cdbm_held { CDBM_NOT_HELD, CDBM_BY_NATURE, CDBM_TO_ITS_END, CDBM_BY_BAR, CDBM_BY_HYSTERESIS } cdbm_held;
typedef enum cdbm_action { CDBM_STARTS, CDBM_PLAYS_ON, CDBM_JUMPS, CDBM_LOOPS, CDBM_HOLDS, CDBM_PLAYS_NOTHING } cdbm_action;
typedef enum cdbm_standing { CDBM_IS_VALID, CDBM_IS_WIDENED, CDBM_IS_NOT_VALID } cdbm_standing;
typedef enum cdbm_why { CDBM_WHY_NOT_VALID = 1, CDBM_WHY_NATURE = 4, CDBM_WHY_JUMP = 8, CDBM_WHY_HISTORY = 9, CDBM_WHY_START = 12, CDBM_WHY_ASSET = 13 }
    cdbm_why;
enum { CDBM_EXCLUDED = 1, CDBM_NEXT_NATURAL = 8, CDBM_IN_MATCH_RANGE = 32 }; /* flags of a kind of frames */
enum { CDBM_FORCE = 1, CDBM_INTERRUPT = 2 };
enum { CDBM_NO_DATABASE = -1, CDBM_GONE = -2, CDBM_GO_ON = -2 };

typedef struct cdbm_clips {   /* a database, as a controller sees it; without frames where it is not loaded */
    const cdbm_frames *frames;
    const int64_t *starts, *stops;   /* [R] */
    const int64_t *assets;           /* [R] the first range of the same asset */
    const double *keys;              /* [R] a number of its asset, the same in all databases; NULL where nothing varies */
    const uint8_t *looping;          /* [R] */
    const float *root;               /* [N, 3]: x, z and heading; NULL where it does not know */
    const uint8_t *marks;            /* [K] flags of each kind of frames */
    const double *root_weights;      /* [K] */
    size_t n_ranges, n_kinds, n_permutations;
    double settle;                   /* added to the cost of what was entered just now */
    double rate, threshold, bar, continuing; /* frames a second; the cost below which it wins outright; what a forced jump may cost */
    size_t pace, n_pace;             /* the features that say how fast a path goes, none where n_pace is 0 */
    double pace_s;
    size_t range_at, kind_at, frame_at; /* where its ranges, kinds and frames are among those of all */
} cdbm_clips;

typedef struct cdbm_controller { /* what characters share */
    const cdbm_clips *databases;
    size_t n_databases, n_features, n_played; /* n_played: so much of what was played is remembered at most */
    double search_every_s, jump_threshold_s, history_s, min_rate, max_rate, grace_s, settle_s, asset_history_s;
    double vary_within;              /* frames that cost at most so much more than the best are as good as it */
    size_t n_recent;                 /* so many of the last assets are not chosen while another is as good */
    int until_natural, varies;
} cdbm_controller;

typedef struct cdbm_playing { double database, range, frame, at_s; } cdbm_playing;
typedef struct cdbm_played { double database, start, stop, time_s; } cdbm_played; /* of permutations the frames of the first */

typedef struct cdbm_state {
    double tick, time_s, since_search_s, rate, waiting_since_s; /* NaN: no jump waits */
    cdbm_playing playing;
    double n_played;             /* behind the state; behind those the keys of the last assets, the latest first, 0 for none */
    cdb_row_play play;           /* how the row of what plays says that it does */
    double entered_s;            /* when it was entered */
    double seed, n_drawn;        /* of chance, whole numbers below CDBM_MOST_SEED; how often it has decided */
} cdbm_state;

typedef struct cdbm_moved {
    cdbm_playing to;             /* no database: nothing plays, or it is gone */
    double n_loops, is_ended;
    double motion[3];            /* how the clip moved the body: to its left and ahead, and its turn */
    double n_spans, spans[3][2]; /* the frames that were passed */
} cdbm_moved;

typedef struct cdbm_decision {
    double tick, time_s, action, cause, held, standing;
    cdbm_playing playing, before;
    double cost, continuing_cost;  /* NaN for none */
    double winner, is_under;       /* the database of the choice; whether it won by its threshold */
    double chosen[4];              /* database, range, frame and cost of what is to be played; CDBM_GO_ON: what plays */
    double motion[3], root_weight, rate;
    double due_s, waited_s, current, dt_s;
    cdb_row_play play;             /* of what plays */
} cdbm_decision;

typedef struct cdbm_found { double range, frame, cost; } cdbm_found; /* of a database; frame -1: nothing; -2: not searched */

typedef struct cdbm_given {      /* what some characters may choose from; of all databases, one after the other */
    size_t n;
    double dt_s;
    const double *queries;       /* [n, F] */
    const uint8_t *ranges;       /* [n or 1, R]: those that may play */
    const double *range_biases;  /* [n or 1, R] */
    size_t ranges_step, biases_step, among_step; /* 0: one for all */
    const uint8_t *allowed, *playable; /* [K] */
    const double *kind_biases;   /* [K] */
    const uint8_t *flags;        /* [N] or NULL */
    const double *frame_biases;  /* [N] or NULL */
    const uint8_t *among;        /* [n or 1, D]: the databases of the moment */
    const uint8_t *urgent;       /* [n] CDBM_FORCE, CDBM_INTERRUPT */
    const cdb_row_play *plays;   /* how rows play; NULL: no row says */
    const int64_t *play_of;      /* [n or 1, R] which of them is that of each range, -1 for none */
    size_t plays_step;
    const double *to_event;      /* [N] seconds of its clip from each frame to the event that is asked for; or NULL */
    double event_s;              /* when that is to happen */
    const double *wide;          /* [n] the bias of what plays by hysteresis, NaN where that does not hold; or NULL */
} cdbm_given;

/* ---- what can be played */

/* Whether all ranges, and all that is said of them, are there. */
static inline int cdbm_are_clips(const cdbm_clips *clips, size_t n_features)
{
    size_t i;
    if (clips->n_kinds < clips->frames->n_kinds || clips->frames->n_features != n_features || !(clips->rate > 0.0)) return 0;
    if (clips->n_permutations < 1 || clips->n_ranges % clips->n_permutations || clips->n_pace > 2) return 0;
    if (clips->n_pace && (clips->pace > n_features || clips->n_pace > n_features - clips->pace)) return 0;
    for (i = 0; i < clips->n_ranges; i++) {
        if (clips->starts[i] < 0 || clips->stops[i] < clips->starts[i] || (uint64_t)clips->stops[i] > clips->frames->n_frames) return 0;
        if (clips->assets[i] < 0 || (uint64_t)clips->assets[i] > i) return 0;
        if (i % clips->n_permutations && clips->stops[i] - clips->starts[i] != clips->stops[i - 1] - clips->starts[i - 1]) return 0;
    }
    return 1;
}

/* Whether what plays is of a database that is there, or none plays. */
static inline int cdbm_is_playing(const cdbm_controller *controller, const cdbm_playing *playing)
{
    const cdbm_clips *clips;
    if (playing->database < 0.0) return 1;
    if (!(playing->database < (double)controller->n_databases)) return 0;
    clips = &controller->databases[(size_t)playing->database];
    if (!clips->frames || !(playing->range >= 0.0 && playing->range < (double)clips->n_ranges) || playing->at_s != playing->at_s) return 0;
    return (double)clips->starts[(size_t)playing->range] <= playing->frame && playing->frame < (double)clips->stops[(size_t)playing->range];
}

/* ---- movements over the ground */

static inline void cdbm_then(const double *first, const double *then, double *to)
{
    double sine, cosine, left = then[0], ahead = then[1], turn = then[2];
    cdbo_sin_cos(first[2], &sine, &cosine);
    to[0] = first[0] + cosine * left + sine * ahead;
    to[1] = first[1] - sine * left + cosine * ahead;
    to[2] = first[2] + turn;
}

static inline void cdbm_repeat(const double *motion, int64_t times, double *to)
{
    double half[3];
    to[0] = to[1] = to[2] = 0.0;
    if (times <= 0) return;
    cdbm_repeat(motion, times / 2, half);
    cdbm_then(half, half, to);
    if (times % 2) cdbm_then(to, motion, to);
}

static inline void cdbm_path_place(const float *path, size_t n_frames, double frame, double *to)
{
    size_t low = frame > 0.0 ? (frame < (double)(n_frames - 1) ? (size_t)frame : n_frames - 1) : 0, high, i;
    double share = cdbo_within(frame - (double)low, 0.0, 1.0);
    high = low + 1 < n_frames ? low + 1 : low;
    for (i = 0; i < 3; i++) to[i] = (double)path[3 * low + i] + share * ((double)path[3 * high + i] - (double)path[3 * low + i]);
}

/* How a path [n, 3] moves a body from one frame to another; both may be fractions. */
static inline void cdbm_motion_between(const float *path, size_t n_frames, double from, double to, double *motion)
{
    double here[3], there[3], sine, cosine, x, z;
    cdbm_path_place(path, n_frames, from, here);
    cdbm_path_place(path, n_frames, to, there);
    x = there[0] - here[0], z = there[1] - here[1];
    cdbo_sin_cos(here[2], &sine, &cosine);
    motion[0] = cosine * x - sine * z, motion[1] = sine * x + cosine * z, motion[2] = there[2] - here[2];
}

/* ---- playing on */

static inline uint8_t cdbm_mark_of(const cdbm_clips *clips, int64_t frame)
{
    return clips->marks[clips->frames->kinds ? clips->frames->kinds[frame] : 0];
}

static inline double cdbm_last_s(const cdbm_clips *clips, size_t range)
{
    return (double)(clips->stops[range] - clips->starts[range] - 1) / clips->rate;
}

/* Whether a range loops: as its row says, or else its marks. */
static inline int cdbm_is_looping(const cdbm_clips *clips, size_t range, const cdb_row_play *play)
{
    int loops = play->loop == play->loop ? play->loop != 0.0 : clips->looping[range];
    return loops && clips->stops[range] - clips->starts[range] > 1;
}

static inline cdb_row_play cdbm_plain_play(void)
{
    cdb_row_play made;
    made.blend_s = made.start_s = made.min_rate = made.max_rate = made.mirror = made.loop = made.root = made.until = NAN;
    return made;
}

/* How a range of a database is to play for character i. */
static inline cdb_row_play cdbm_play_of(const cdbm_given *given, size_t i, const cdbm_clips *clips, size_t range)
{
    int64_t own = given->plays ? given->play_of[i * given->plays_step + clips->range_at + range] : -1;
    return own < 0 ? cdbm_plain_play() : given->plays[own];
}

/* The frame of a range that is nearest to a moment, the later of two that are equally near. */
static inline int64_t cdbm_frame_at(const cdbm_clips *clips, size_t range, double at_s)
{
    double nearest = floor((at_s + CDBM_TOLERANCE_S) * clips->rate + 0.5);
    int64_t start = clips->starts[range], last = clips->stops[range] - 1;
    return !(nearest > 0.0) ? start : nearest < (double)(last - start) ? start + (int64_t)nearest : last;
}

/* The first of some frames that may not be played on to; `stop` where all may. */
static inline int64_t cdbm_free_until(const cdbm_clips *clips, int64_t first, int64_t stop)
{
    while (first < stop && !(cdbm_mark_of(clips, first) & CDBM_EXCLUDED)) first++;
    return first;
}

/* From one moment of a range to a later one, over the frames from `first` on, or until one that is excluded: adds to a move. */
static inline void cdbm_leg(const cdbm_clips *clips, size_t range, double from_s, double to_s, int64_t first, cdbm_moved *move)
{
    int64_t start = clips->starts[range], stop = cdbm_frame_at(clips, range, to_s) + 1, until;
    if (stop < first) stop = first;
    until = cdbm_free_until(clips, first, stop);
    if (until < stop) to_s = cdbo_most(from_s, (double)(until - 1 - start) / clips->rate);
    move->to.at_s = to_s, move->to.frame = (double)(until - 1), move->is_ended = until < stop;
    if (until > first) {
        double *span = move->spans[(size_t)move->n_spans++];
        span[0] = (double)first, span[1] = (double)until;
    }
    move->motion[0] = move->motion[1] = move->motion[2] = 0.0;
    if (clips->root)
        cdbm_motion_between(clips->root + 3 * start, (size_t)(clips->stops[range] - start), from_s * clips->rate, to_s * clips->rate,
            move->motion);
}

/* From the end of a looping range over it some times, and on to a moment. */
static inline void cdbm_loop(const cdbm_clips *clips, size_t range, double wanted_s, cdbm_moved *move)
{
    double last_s = cdbm_last_s(clips, range), motion[3], more[3];
    int64_t start = clips->starts[range];
    double n_loops = ceil((wanted_s - CDBM_TOLERANCE_S) / last_s) - 1.0;
    memcpy(motion, move->motion, sizeof motion);
    move->n_loops = n_loops;
    if (n_loops > 1.0) {
        cdbm_leg(clips, range, 0.0, last_s, start, move);
        if (move->is_ended != 0.0) {
            move->n_loops = 1.0;
            cdbm_then(motion, move->motion, move->motion);
            return;
        }
        cdbm_repeat(move->motion, (int64_t)n_loops - 1, more);
        cdbm_then(motion, more, motion);
    }
    cdbm_leg(clips, range, 0.0, cdbo_least(wanted_s - n_loops * last_s, last_s), start, move);
    cdbm_then(motion, move->motion, move->motion);
}

/* What plays, some seconds of its clip later. */
static inline void cdbm_play(const cdbm_controller *controller, const cdbm_playing *playing, const cdb_row_play *play, double passed_s,
    cdbm_moved *move)
{
    const cdbm_clips *clips;
    size_t range = (size_t)playing->range;
    double at_s, last_s, wanted_s;
    memset(move, 0, sizeof *move);
    move->to = *playing;
    if (playing->database < 0.0) return;
    clips = &controller->databases[(size_t)playing->database];
    last_s = cdbm_last_s(clips, range), at_s = cdbo_least(playing->at_s, last_s), wanted_s = at_s + passed_s;
    cdbm_leg(clips, range, at_s, cdbo_least(wanted_s, last_s), cdbm_frame_at(clips, range, at_s) + 1, move);
    if (wanted_s <= last_s + CDBM_TOLERANCE_S) return;
    if (move->is_ended == 0.0 && cdbm_is_looping(clips, range, play) && !(cdbm_mark_of(clips, clips->starts[range]) & CDBM_EXCLUDED))
        cdbm_loop(clips, range, wanted_s, move);
    else move->is_ended = 1.0;
}

static inline void cdbm_move(const cdbm_controller *controller, const double *row, double dt_s, cdbm_moved *move)
{
    const cdbm_state *state = (const cdbm_state *)row;
    cdbm_play(controller, &state->playing, &state->play, dt_s * state->rate, move);
}

/* The features of a frame that is in a range, in the schema's units. */
static inline double cdbm_feature(const cdbm_frames *frames, int64_t box, int64_t frame, size_t f)
{
    const float *block = frames->blocks + (size_t)box * frames->n_features * CDBM_FRAMES + (size_t)(frame - frames->box_starts[box]);
    return (double)block[frames->rank[f] * CDBM_FRAMES] * frames->scale[f] + frames->offset[f];
}

static inline void cdbm_features(const cdbm_frames *frames, int64_t frame, double *to)
{
    int64_t box = cdbm_box_of(frames, frame);
    size_t f;
    for (f = 0; f < frames->n_features; f++) to[f] = box < 0 ? 0.0 : cdbm_feature(frames, box, frame, f);
}

/* ---- what was played lately, and what is left out for it */

static inline size_t cdbm_width(const cdbm_controller *controller)
{
    return (sizeof(cdbm_state) + controller->n_played * sizeof(cdbm_played)) / sizeof(double) + controller->n_recent;
}

static inline cdbm_played *cdbm_played_of(double *row)
{
    return (cdbm_played *)(row + sizeof(cdbm_state) / sizeof(double));
}

static inline double *cdbm_recent_of(const cdbm_controller *controller, double *row)
{
    return (double *)(cdbm_played_of(row) + controller->n_played);
}

/* Whether a row is that of a character with these databases. */
static inline int cdbm_is_row(const cdbm_controller *controller, const double *row)
{
    const cdbm_state *state = (const cdbm_state *)row;
    if (!(state->seed >= 0.0 && state->seed < CDBM_MOST_SEED && state->n_drawn >= 0.0 && state->n_drawn < CDBM_MOST_SEED)) return 0;
    return cdbm_is_playing(controller, &state->playing) && state->n_played >= 0.0 && state->n_played <= (double)controller->n_played;
}

/* How far a range is from the first permutation of its clip, in frames. */
static inline int64_t cdbm_from_first(const cdbm_clips *clips, size_t range)
{
    return (int64_t)(range % clips->n_permutations) * (clips->stops[range] - clips->starts[range]);
}

/* The asset of a span that was played, as the number of its first range; -1 for one that is no longer there. */
static inline int64_t cdbm_asset_of(const cdbm_controller *controller, const cdbm_played *played)
{
    int is_known = played->database >= 0.0 && played->database < (double)controller->n_databases;
    const cdbm_clips *clips = is_known ? &controller->databases[(size_t)played->database] : NULL;
    int64_t box = clips && clips->frames ? cdbm_box_of(clips->frames, (int64_t)played->start) : -1;
    return box < 0 ? -1 : clips->assets[clips->frames->box_ranges[box]];
}

/* Whether some seconds since a span was played are over. */
static inline int cdbm_is_past(const cdbm_state *state, const cdbm_played *played, double seconds)
{
    return played->time_s <= state->time_s - seconds + CDBM_TOLERANCE_S;
}

/* The asset of the span of that number, where it bars that asset and no later one does; else -1. */
static inline int64_t cdbm_barred(const cdbm_controller *controller, const double *row, size_t number)
{
    const cdbm_state *state = (const cdbm_state *)row;
    const cdbm_played *played = cdbm_played_of((double *)(uintptr_t)row);
    int64_t asset;
    size_t i;
    if (cdbm_is_past(state, &played[number], controller->asset_history_s)) return -1;
    asset = cdbm_asset_of(controller, &played[number]);
    for (i = number + 1; asset >= 0 && i < (size_t)state->n_played; i++)
        if (played[i].database == played[number].database && cdbm_asset_of(controller, &played[i]) == asset) asset = -1;
    return asset;
}

/* Forget what was played too long ago, and remember a span that is played now. */
static inline void cdbm_remember(const cdbm_controller *controller, double *row, size_t range, const double *span)
{
    cdbm_state *state = (cdbm_state *)row;
    cdbm_played *played = cdbm_played_of(row);
    size_t n = (size_t)state->n_played, n_kept = 0, i;
    for (i = 0; i < n; i++) /* a span moves down over those that are forgotten: none behind it is looked at in its old place */
        if (!cdbm_is_past(state, &played[i], controller->history_s) || cdbm_barred(controller, row, i) >= 0) played[n_kept++] = played[i];
    if (span && n_kept == n && n == controller->n_played && n > 0) memmove(played, played + 1, --n_kept * sizeof *played);
    memset(played + n_kept, 0, (n - n_kept) * sizeof *played);
    n = n_kept;
    if (span && n < controller->n_played) {
        double shift = (double)cdbm_from_first(&controller->databases[(size_t)state->playing.database], range);
        played[n].database = state->playing.database, played[n].time_s = state->time_s;
        played[n].start = span[0] - shift, played[n].stop = span[1] - shift;
        n++;
    }
    state->n_played = (double)n;
}

typedef struct cdbm_skips { /* frames that a search leaves out: [n, 2], and why */
    int64_t *spans;
    uint8_t *whys;          /* or NULL */
    size_t n;
} cdbm_skips;

/* So many spans a search leaves out at most. */
static inline size_t cdbm_most_skips(const cdbm_controller *controller, const cdbm_clips *clips)
{
    return (controller->n_played + 4) * clips->n_permutations + 3 * clips->n_ranges + 1;
}

static inline void cdbm_skip(cdbm_skips *skips, int64_t start, int64_t stop, cdbm_why why)
{
    skips->spans[2 * skips->n] = start, skips->spans[2 * skips->n + 1] = stop;
    if (skips->whys) skips->whys[skips->n] = (uint8_t)why;
    skips->n++;
}

/* The same frames in every permutation of a clip. */
static inline void cdbm_skip_all(cdbm_skips *skips, const cdbm_clips *clips, size_t range, int64_t start, int64_t stop, cdbm_why why)
{
    int64_t length = clips->stops[range] - clips->starts[range], first = cdbm_from_first(clips, range), i;
    for (i = 0; i < (int64_t)clips->n_permutations; i++) cdbm_skip(skips, start - first + i * length, stop - first + i * length, why);
}

/* What was played lately of a database: in order, spans that touch as one. */
static inline void cdbm_skip_played(const cdbm_controller *controller, const double *row, size_t database, cdbm_skips *skips)
{
    const cdbm_clips *clips = &controller->databases[database];
    const cdbm_played *played = cdbm_played_of((double *)(uintptr_t)row);
    size_t n_played = (size_t)((const cdbm_state *)row)->n_played, first = skips->n, n, i, k;
    for (i = 0; i < n_played; i++) {
        int64_t start = (int64_t)played[i].start, stop = (int64_t)played[i].stop;
        int64_t *last = skips->n > first ? skips->spans + 2 * skips->n - 2 : NULL;
        if (played[i].database != (double)database || cdbm_is_past((const cdbm_state *)row, &played[i], controller->history_s)) continue;
        if (last && last[0] <= start && start <= last[1]) { /* it played on, as mostly */
            if (stop > last[1]) last[1] = stop;
            continue;
        }
        for (k = skips->n; k > first && skips->spans[2 * k - 2] > start; k--)
            memcpy(skips->spans + 2 * k, skips->spans + 2 * k - 2, 2 * sizeof(int64_t));
        skips->spans[2 * k] = start, skips->spans[2 * k + 1] = stop;
        skips->n++;
    }
    for (n = first, i = first; i < skips->n; i++) {
        const int64_t *own = skips->spans + 2 * i;
        int64_t *last = n > first ? skips->spans + 2 * n - 2 : NULL;
        if (last && own[0] <= last[1]) last[1] = own[1] > last[1] ? own[1] : last[1];
        else memmove(skips->spans + 2 * n, own, 2 * sizeof(int64_t)), n++;
    }
    skips->n = n;
    if (skips->whys) memset(skips->whys + first, CDBM_WHY_HISTORY, n - first);
    if (clips->n_permutations == 1) return;
    for (k = n; k-- > first;) { /* from behind: each makes room for its others */
        int64_t span[2], box;
        cdbm_skips others = *skips;
        memcpy(span, skips->spans + 2 * k, sizeof span);
        box = cdbm_box_of(clips->frames, span[0]);
        others.n = skips->n - 1;
        memmove(skips->spans + 2 * k, skips->spans + 2 * k + 2, 2 * (skips->n - k - 1) * sizeof(int64_t));
        if (box >= 0) cdbm_skip_all(&others, clips, (size_t)clips->frames->box_ranges[box], span[0], span[1], CDBM_WHY_HISTORY);
        skips->n = others.n;
    }
}

/* All frames of the assets that were played lately. */
static inline void cdbm_skip_assets(const cdbm_controller *controller, const double *row, size_t database, cdbm_skips *skips)
{
    const cdbm_clips *clips = &controller->databases[database];
    const cdbm_played *played = cdbm_played_of((double *)(uintptr_t)row);
    size_t n = controller->asset_history_s > 0.0 ? (size_t)((const cdbm_state *)row)->n_played : 0, i, range;
    for (i = 0; i < n; i++) {
        int64_t asset = played[i].database == (double)database ? cdbm_barred(controller, row, i) : -1;
        for (range = asset < 0 ? clips->n_ranges : (size_t)asset; range < clips->n_ranges; range++)
            if (clips->assets[range] == asset) cdbm_skip(skips, clips->starts[range], clips->stops[range], CDBM_WHY_ASSET);
    }
}

/* What is left out because of the frame that would play on. */
static inline void cdbm_skip_near(const cdbm_controller *controller, const cdb_row_play *play, const cdbm_moved *move, cdbm_skips *skips)
{
    const cdbm_clips *clips = &controller->databases[(size_t)move->to.database];
    size_t range = (size_t)move->to.range;
    int64_t start = clips->starts[range], stop = clips->stops[range], frame = (int64_t)move->to.frame, near, first, last, n_loop;
    double threshold_s = controller->jump_threshold_s;
    if (move->is_ended != 0.0) threshold_s = cdbo_most(threshold_s, controller->search_every_s);
    near = (int64_t)cdbo_least((threshold_s + CDBM_TOLERANCE_S) * clips->rate, 1e9);
    first = frame - near, last = frame + near + 1;
    if (move->is_ended != 0.0) { /* those after which it would end again at once; never the first, or a short clip could not repeat */
        cdbm_skip_all(skips, clips, range, first > start + 1 ? first : start + 1, stop, CDBM_WHY_JUMP);
        return;
    }
    if (cdbm_mark_of(clips, frame) & CDBM_NEXT_NATURAL) cdbm_skip_all(skips, clips, range, start, stop, CDBM_WHY_NATURE);
    cdbm_skip_all(skips, clips, range, first > start ? first : start, last < stop ? last : stop, CDBM_WHY_JUMP);
    if (!cdbm_is_looping(clips, range, play)) return;
    n_loop = stop - start - 1;
    if (first <= start) cdbm_skip_all(skips, clips, range, first + n_loop > start ? first + n_loop : start, stop, CDBM_WHY_JUMP);
    if (last > start + n_loop) cdbm_skip_all(skips, clips, range, start, last - n_loop < stop ? last - n_loop : stop, CDBM_WHY_JUMP);
}

/* Of ranges whose row says at which second they are entered: all other frames. */
static inline void cdbm_skip_starts(const cdbm_given *given, size_t i, const cdbm_clips *clips, cdbm_skips *skips)
{
    size_t range;
    for (range = 0; given->plays && range < clips->n_ranges; range++) {
        int64_t own = given->play_of[i * given->plays_step + clips->range_at + range], entry;
        if (own < 0 || !(given->plays[own].start_s == given->plays[own].start_s)) continue;
        entry = cdbm_frame_at(clips, range, given->plays[own].start_s);
        if (entry > clips->starts[range]) cdbm_skip(skips, clips->starts[range], entry, CDBM_WHY_START);
        if (entry + 1 < clips->stops[range]) cdbm_skip(skips, entry + 1, clips->stops[range], CDBM_WHY_START);
    }
}

/* All that a search of character i leaves out of a database. */
static inline void cdbm_list_skips(const cdbm_controller *controller, const cdbm_given *given, size_t i, const double *row, const cdbm_moved *move,
    const cdbm_decision *decision, size_t database, cdbm_skips *skips)
{
    const cdbm_clips *clips = &controller->databases[database];
    skips->n = 0;
    if (move->to.database == (double)database) {
        size_t range = (size_t)move->to.range;
        if (decision->current >= 0.0 && decision->standing == CDBM_IS_WIDENED)
            cdbm_skip(skips, clips->starts[range], clips->stops[range], CDBM_WHY_NOT_VALID);
        cdbm_skip_near(controller, &((const cdbm_state *)row)->play, move, skips);
    }
    cdbm_skip_played(controller, row, database, skips);
    cdbm_skip_assets(controller, row, database, skips);
    cdbm_skip_starts(given, i, clips, skips);
}

/* ---- why to search */

static inline int cdbm_may_play(const cdbm_given *given, size_t i, const cdbm_clips *clips, size_t range)
{
    return given->ranges[i * given->ranges_step + clips->range_at + range];
}

static inline double cdbm_range_bias(const cdbm_given *given, size_t i, const cdbm_clips *clips, size_t range)
{
    return given->range_biases[i * given->biases_step + clips->range_at + range];
}

static inline int cdbm_is_flagged(const cdbm_given *given, const cdbm_clips *clips, int64_t frame)
{
    return !given->flags || given->flags[clips->frame_at + (size_t)frame];
}

/* A frame's cost for a query as it is given; `room` has as many numbers. Infinite for a frame of no range. */
static inline double cdbm_cost_of(const cdbm_clips *clips, int64_t frame, const double *query, double *room)
{
    const cdbm_frames *frames = clips->frames;
    int64_t box = cdbm_box_of(frames, frame);
    size_t f;
    if (box < 0) return (double)INFINITY;
    for (f = 0; f < frames->n_features; f++) room[f] = (query[f] - frames->offset[f]) / frames->scale[f];
    return cdbm_cost(frames, (size_t)box, (size_t)(frame - frames->box_starts[box]), room);
}

/* Put what plays into the permutation of its clip that costs least to play on in; on a tie that which plays. */
static inline void cdbm_permute(const cdbm_controller *controller, const cdbm_given *given, size_t i, cdbm_moved *move, double *room)
{
    const cdbm_clips *clips = &controller->databases[(size_t)move->to.database];
    size_t own = (size_t)move->to.range, first = own - own % clips->n_permutations, best = own, k;
    int64_t length = clips->stops[own] - clips->starts[own], frame = (int64_t)move->to.frame - cdbm_from_first(clips, own);
    double least = (double)INFINITY;
    int is_any = 0;
    for (k = 0; k < clips->n_permutations; k++) {
        int64_t at = frame + (int64_t)k * length;
        double cost = cdbm_cost_of(clips, at, given->queries + i * controller->n_features, room)
            + cdbm_range_bias(given, i, clips, first + k);
        if (given->frame_biases) cost += given->frame_biases[clips->frame_at + (size_t)at];
        if (!cdbm_is_flagged(given, clips, at)) cost = (double)INFINITY;
        if (cdbm_may_play(given, i, clips, own) && !cdbm_may_play(given, i, clips, first + k)) cost = (double)INFINITY;
        if (!is_any || cost < least || (cost == least && first + k == own)) least = cost, best = first + k, is_any = 1;
    }
    move->to.range = (double)best, move->to.frame = (double)(frame + (int64_t)(best - first) * length);
}

static inline cdbm_cause cdbm_cause_of(const cdbm_controller *controller, const cdbm_given *given, size_t i, const cdbm_state *state,
    const cdbm_moved *move, cdbm_standing standing)
{
    if (move->to.database < 0.0) return state->playing.database == CDBM_NO_DATABASE ? CDBM_NOTHING_PLAYS : CDBM_LOST;
    if (move->is_ended != 0.0) return CDBM_ENDED;
    if (!given->among[i * given->among_step + (size_t)move->to.database]) return CDBM_NOT_AMONG;
    if (given->urgent[i] & CDBM_INTERRUPT) return CDBM_INTERRUPTED;
    if (standing == CDBM_IS_NOT_VALID) return CDBM_NOT_VALID;
    if (given->urgent[i] & CDBM_FORCE) return CDBM_FORCED;
    return controller->search_every_s - state->since_search_s - given->dt_s <= CDBM_TOLERANCE_S ? CDBM_DUE : CDBM_NOT_DUE;
}

/* What lets play on what is not valid, or valid by hysteresis alone, without a search. */
static inline cdbm_held cdbm_held_by(const cdbm_controller *controller, const cdb_row_play *play, const cdbm_moved *move, cdbm_cause cause,
    cdbm_standing standing)
{
    const cdbm_clips *clips;
    int is_looping;
    if (cause == CDBM_NOT_DUE && standing == CDBM_IS_WIDENED) return CDBM_BY_HYSTERESIS;
    if (cause != CDBM_NOT_VALID) return CDBM_NOT_HELD;
    clips = &controller->databases[(size_t)move->to.database];
    if ((cdbm_mark_of(clips, (int64_t)move->to.frame) & CDBM_NEXT_NATURAL) && move->n_loops == 0.0) return CDBM_BY_NATURE;
    is_looping = cdbm_is_looping(clips, (size_t)move->to.range, play);
    if (play->until == CDB_UNTIL_NATURAL) return !is_looping || move->n_loops == 0.0 ? CDBM_TO_ITS_END : CDBM_NOT_HELD;
    return controller->until_natural && play->until != CDB_UNTIL_ANY && !is_looping ? CDBM_TO_ITS_END : CDBM_NOT_HELD;
}

/* The first half of an update: why character i of some searches, and its next row as far as it is known. `room` has a number for
 * each feature. */
static inline void cdbm_ask(const cdbm_controller *controller, const cdbm_given *given, size_t i, const double *before, cdbm_moved *move,
    double *after, cdbm_decision *decision, double *room)
{
    const cdbm_state *state = (const cdbm_state *)before;
    cdbm_state *next = (cdbm_state *)after;
    cdbm_standing standing = CDBM_IS_NOT_VALID;
    cdbm_cause cause;
    size_t k;
    memcpy(after, before, cdbm_width(controller) * sizeof(double));
    memset(decision, 0, sizeof *decision);
    next->time_s = state->time_s + given->dt_s;
    cdbm_remember(controller, after, 0, NULL);
    if (move->to.database >= 0.0) {
        const cdbm_clips *clips = &controller->databases[(size_t)move->to.database];
        for (k = 0; k < (size_t)move->n_spans; k++) cdbm_remember(controller, after, (size_t)move->to.range, move->spans[k]);
        if (cdbm_may_play(given, i, clips, (size_t)move->to.range)) standing = CDBM_IS_VALID;
        else if (given->wide && given->wide[i] == given->wide[i]) standing = CDBM_IS_WIDENED;
    }
    cause = cdbm_cause_of(controller, given, i, state, move, standing);
    decision->held = cdbm_held_by(controller, &state->play, move, cause, standing);
    if (decision->held != CDBM_NOT_HELD) cause = CDBM_NOT_DUE;
    if (cause != CDBM_NOT_DUE && move->to.database >= 0.0 && controller->databases[(size_t)move->to.database].n_permutations > 1)
        cdbm_permute(controller, given, i, move, room);
    decision->tick = state->tick, decision->time_s = next->time_s, decision->dt_s = given->dt_s;
    decision->cause = cause, decision->standing = standing, decision->action = CDBM_PLAYS_NOTHING;
    decision->before = move->to.database < 0.0 ? state->playing : move->to;
    decision->current = cause == CDBM_FORCED || cause == CDBM_DUE ? move->to.frame : -1.0;
    decision->due_s = controller->search_every_s - state->since_search_s - given->dt_s;
    decision->waited_s = state->waiting_since_s == state->waiting_since_s ? next->time_s - state->waiting_since_s : 0.0;
    decision->winner = decision->chosen[0] = CDBM_NO_DATABASE;
    decision->cost = decision->continuing_cost = NAN;
    decision->play = state->play;
}

/* ---- the choice */

/* Take what a database has found into a choice: the lowest cost wins, on a tie the earlier database. Whether it stops there. */
static inline int cdbm_take_found(const cdbm_controller *controller, size_t database, const cdbm_found *found, cdbm_decision *decision)
{
    int is_under = found->cost < controller->databases[database].threshold;
    if (found->frame >= 0.0 && (decision->winner < 0.0 || found->cost < decision->chosen[3])) {
        decision->winner = decision->chosen[0] = (double)database;
        decision->chosen[1] = found->range, decision->chosen[2] = found->frame, decision->chosen[3] = found->cost;
        decision->is_under = is_under;
    }
    return is_under;
}

typedef struct cdbm_choosing { /* some characters, while a database is searched for them */
    size_t *numbers;
    double *queries, *biases, *totals;
    uint8_t *ranges, *stopped;
    int64_t *skips, *skip_stops, *currents, *frames, *found;
} cdbm_choosing;

/* The most ranges of a database, and the most spans that a search of one leaves out, and how much room that takes. */
static inline void cdbm_measure_choosing(const cdbm_controller *controller, size_t n, size_t *n_ranges, size_t *n_skips, size_t *n_bytes)
{
    size_t d;
    *n_ranges = *n_skips = 1, *n_bytes = 0;
    for (d = 0; d < controller->n_databases; d++) {
        const cdbm_clips *clips = &controller->databases[d];
        if (!clips->frames) continue;
        if (clips->n_ranges > *n_ranges) *n_ranges = clips->n_ranges;
        if (cdbm_most_skips(controller, clips) > *n_skips) *n_skips = cdbm_most_skips(controller, clips);
        if (cdbm_search_room(clips->frames, n) > *n_bytes) *n_bytes = cdbm_search_room(clips->frames, n);
    }
}

/* How many bytes of room a choice for so many characters takes. */
static inline size_t cdbm_choice_room(const cdbm_controller *controller, size_t n)
{
    size_t n_ranges, n_skips, n_bytes;
    if (n > CDBM_TILE) n = CDBM_TILE;
    cdbm_measure_choosing(controller, n, &n_ranges, &n_skips, &n_bytes);
    return n_bytes + (controller->varies ? 2 * cdbm_rounded(n_ranges * sizeof(double)) : 0) + cdbm_rounded(n * sizeof(size_t))
        + cdbm_rounded(n * (controller->n_features + n_ranges + 1) * sizeof(double))
        + cdbm_rounded(n * (n_ranges + 1)) + cdbm_rounded((n * (2 * n_skips + 4) + 1) * sizeof(int64_t));
}

static inline int cdbm_take_choosing(const cdbm_controller *controller, cdbm_choosing *own, size_t n, cdbm_room *room)
{
    size_t n_ranges, n_skips, n_bytes;
    cdbm_measure_choosing(controller, n, &n_ranges, &n_skips, &n_bytes);
    memset(own, 0, sizeof *own);
    own->numbers = (size_t *)cdbm_part(room, n * sizeof(size_t));
    own->queries = (double *)cdbm_part(room, n * (controller->n_features + n_ranges + 1) * sizeof(double));
    own->ranges = (uint8_t *)cdbm_part(room, n * (n_ranges + 1));
    own->skips = (int64_t *)cdbm_part(room, (n * (2 * n_skips + 4) + 1) * sizeof(int64_t));
    if (!own->numbers || !own->queries || !own->ranges || !own->skips) return 0;
    own->biases = own->queries + n * controller->n_features, own->totals = own->biases + n * n_ranges;
    own->stopped = own->ranges + n * n_ranges;
    own->skip_stops = own->skips + n * 2 * n_skips, own->currents = own->skip_stops + n + 1;
    own->frames = own->currents + n, own->found = own->frames + n;
    memset(own->stopped, 0, n);
    return 1;
}

/* Whether one mask, and one list of biases of ranges, is that of all. */
static inline int cdbm_is_one_mask(const cdbm_given *given)
{
    return given->ranges_step == 0 && !given->wide;
}

static inline int cdbm_are_same_biases(const cdbm_given *given)
{
    return given->biases_step == 0 && !given->wide;
}

/* Put what one character asks of a database behind the others. */
static inline void cdbm_put_question(const cdbm_controller *controller, const cdbm_given *given, size_t i, const double *after,
    const cdbm_moved *move, const cdbm_decision *decision, size_t database, cdbm_choosing *room, size_t at)
{
    const cdbm_clips *clips = &controller->databases[database];
    size_t n_features = controller->n_features, n_ranges = clips->n_ranges;
    int is_own = decision->current >= 0.0 && move->to.database == (double)database;
    cdbm_skips skips = {NULL, NULL, 0};
    skips.spans = room->skips + 2 * room->skip_stops[at];
    cdbm_list_skips(controller, given, i, after, move, decision, database, &skips);
    room->skip_stops[at + 1] = room->skip_stops[at] + (int64_t)skips.n;
    room->currents[at] = is_own ? (int64_t)decision->current : -1;
    memcpy(room->queries + at * n_features, given->queries + i * n_features, n_features * sizeof(double));
    if (!cdbm_is_one_mask(given)) memcpy(room->ranges + at * n_ranges, given->ranges + i * given->ranges_step + clips->range_at, n_ranges);
    if (!cdbm_are_same_biases(given))
        memcpy(room->biases + at * n_ranges, given->range_biases + i * given->biases_step + clips->range_at, n_ranges * sizeof(double));
    if (is_own && decision->standing == CDBM_IS_WIDENED)
        room->ranges[at * n_ranges + (size_t)move->to.range] = 1, room->biases[at * n_ranges + (size_t)move->to.range] = given->wide[i];
}

/* What so many characters ask of a database. */
static inline cdbm_question cdbm_question_of(const cdbm_given *given, const cdbm_clips *clips, const cdbm_choosing *room, size_t n)
{
    cdbm_question asked;
    memset(&asked, 0, sizeof asked);
    asked.n_queries = n, asked.queries = room->queries, asked.within = (double)INFINITY, asked.continuing = clips->continuing;
    asked.is_one_mask = cdbm_is_one_mask(given), asked.are_same_biases = cdbm_are_same_biases(given);
    asked.ranges = asked.is_one_mask ? given->ranges + clips->range_at : room->ranges;
    asked.range_biases = asked.are_same_biases ? given->range_biases + clips->range_at : room->biases;
    asked.allowed = given->allowed + clips->kind_at, asked.playable = given->playable + clips->kind_at;
    asked.kind_biases = given->kind_biases + clips->kind_at;
    asked.flags = given->flags ? given->flags + clips->frame_at : NULL;
    asked.frame_biases = given->frame_biases ? given->frame_biases + clips->frame_at : NULL;
    asked.skips = room->skips, asked.skip_stops = room->skip_stops, asked.currents = room->currents;
    return asked;
}

/* Search a database for all of some characters whom none before it has satisfied. 0 where there is too little room, -1 for a query that
 * cannot be compared. */
static inline int cdbm_search_database(const cdbm_controller *controller, const cdbm_given *given, size_t start, size_t stop,
    const double *after, const cdbm_moved *moves, cdbm_decision *decisions, cdbm_found *found, size_t database, cdbm_choosing *room, cdbm_room left)
{
    const cdbm_clips *clips = &controller->databases[database];
    size_t n = 0, i, k, width = cdbm_width(controller), n_databases = controller->n_databases;
    cdbm_question asked;
    cdbm_hits hits;
    room->skip_stops[0] = 0;
    for (i = start; i < stop; i++) {
        found[i * n_databases + database].frame = -2.0, found[i * n_databases + database].cost = (double)INFINITY;
        if (!clips->frames || decisions[i].cause == CDBM_NOT_DUE || room->stopped[i - start]) continue;
        if (!given->among[i * given->among_step + database]) continue;
        cdbm_put_question(controller, given, i, after + i * width, &moves[i], &decisions[i], database, room, n);
        room->numbers[n++] = i;
    }
    if (n == 0) return 1;
    asked = cdbm_question_of(given, clips, room, n);
    hits.totals = room->totals, hits.frames = room->frames, hits.ranges = room->found;
    if (!cdbm_search_frames(clips->frames, &asked, 0, n, &hits, left)) return 0;
    for (k = 0; k < n; k++) {
        cdbm_found *own = &found[room->numbers[k] * n_databases + database];
        if (hits.ranges[k] == CDBM_REFUSED) return -1;
        own->range = (double)hits.ranges[k], own->frame = (double)hits.frames[k], own->cost = hits.totals[k];
        room->stopped[room->numbers[k] - start] = (uint8_t)cdbm_take_found(controller, database, own, &decisions[room->numbers[k]]);
    }
    return 1;
}

/* Search for those of characters `start` to `stop` - 1 who want to. 0 where there is too little room (see cdbm_choice_room), -1
 * for a query that cannot be compared. Several threads may do so for different ones, each with room of its own. */
static inline int cdbm_choose(const cdbm_controller *controller, const cdbm_given *given, size_t start, size_t stop, const double *after,
    const cdbm_moved *moves, cdbm_decision *decisions, cdbm_found *found, cdbm_room room)
{
    cdbm_choosing own;
    size_t d, end, n = stop - start < CDBM_TILE ? stop - start : CDBM_TILE;
    int is_done = 1;
    for (; is_done == 1 && start < stop; start = end) {
        cdbm_room left = room;
        int any = 0;
        size_t i;
        end = stop - start < n ? stop : start + n;
        for (i = start; i < end; i++) any |= decisions[i].cause != CDBM_NOT_DUE;
        if (!any) continue;
        is_done = cdbm_take_choosing(controller, &own, end - start, &left);
        for (d = 0; is_done == 1 && d < controller->n_databases; d++)
            is_done = cdbm_search_database(controller, given, start, end, after, moves, decisions, found, d, &own, left);
    }
    return is_done;
}

/* ---- what comes of it */

/* What it costs to play on, the continuing bias in it; NaN where that is not allowed. */
static inline double cdbm_continuing_cost(const cdbm_controller *controller, const cdbm_given *given, size_t i,
    const cdbm_playing *playing, double wide, double *room)
{
    const cdbm_clips *clips = &controller->databases[(size_t)playing->database];
    int64_t frame = (int64_t)playing->frame;
    size_t range = (size_t)playing->range, kind = clips->kind_at + (size_t)(clips->frames->kinds ? clips->frames->kinds[frame] : 0);
    double bias, total;
    if (wide != wide && !cdbm_may_play(given, i, clips, range)) return NAN;
    if (!cdbm_is_flagged(given, clips, frame) || !given->playable[kind]) return NAN;
    bias = (wide == wide ? wide : cdbm_range_bias(given, i, clips, range)) + given->kind_biases[kind];
    if (given->frame_biases) bias += given->frame_biases[clips->frame_at + (size_t)frame];
    total = cdbm_cost_of(clips, frame, given->queries + i * controller->n_features, room) + (bias + clips->continuing);
    return total < (double)INFINITY ? total : NAN;
}

/* How fast a path goes by the features of a query or of a frame, m/s. */
static inline double cdbm_pace(const cdbm_clips *clips, const double *features)
{
    return (clips->n_pace == 1 ? cdbo_size(features[0]) : cdbo_flat_length(features[0], features[1])) / clips->pace_s;
}

/* Seconds of its clip from what plays to the event that is asked for; NaN where it does not lead there, or none is. */
static inline double cdbm_to_event(const cdbm_given *given, const cdbm_clips *clips, const cdbm_playing *playing)
{
    double into_s = playing->at_s - (playing->frame - (double)clips->starts[(size_t)playing->range]) / clips->rate;
    return given->to_event ? given->to_event[clips->frame_at + (size_t)playing->frame] - into_s : NAN;
}

/* At what rate a frame is to play, within the limits of its row or of the settings: so that an event happens when it is to, or so
 * that it goes about as fast as a query asks. */
static inline double cdbm_play_rate(const cdbm_controller *controller, const cdbm_given *given, const cdbm_playing *playing,
    const cdb_row_play *play, const double *query)
{
    const cdbm_clips *clips = &controller->databases[(size_t)playing->database];
    int is_said = play->min_rate == play->min_rate;
    double least = is_said ? play->min_rate : controller->min_rate, most = is_said ? play->max_rate : controller->max_rate;
    double wanted, own, features[2], one = cdbo_within(1.0, least, most), to_event = cdbm_to_event(given, clips, playing);
    int64_t box;
    size_t f;
    if (to_event == to_event) return given->event_s > 0.0 ? cdbo_within(to_event / given->event_s, least, most) : one;
    if (clips->n_pace == 0 || least == most) return one;
    box = cdbm_box_of(clips->frames, (int64_t)playing->frame);
    if (box < 0) return one;
    for (f = 0; f < clips->n_pace; f++) features[f] = cdbm_feature(clips->frames, box, (int64_t)playing->frame, clips->pace + f);
    wanted = cdbm_pace(clips, query + clips->pace), own = cdbm_pace(clips, features);
    if (!(wanted >= CDBM_LEAST_MPS && own >= CDBM_LEAST_MPS)) return one;
    return cdbo_within(cdbo_exp(CDBM_RATE_SHARE * cdbo_log(wanted / own)), least, most);
}

/* Play what was chosen, unless its cost is over the bar and may wait. */
static inline void cdbm_jump(const cdbm_controller *controller, const cdbm_given *given, size_t i, cdbm_decision *decision, int is_start)
{
    const cdbm_clips *clips = &controller->databases[(size_t)decision->chosen[0]];
    double cost = decision->chosen[3];
    if (decision->cause == CDBM_NOT_VALID && cost > clips->bar && controller->grace_s - decision->waited_s > CDBM_TOLERANCE_S) {
        decision->held = CDBM_BY_BAR;
        decision->continuing_cost = NAN;
        return;
    }
    decision->action = is_start ? CDBM_STARTS : CDBM_JUMPS;
    decision->playing.database = decision->chosen[0], decision->playing.range = decision->chosen[1];
    decision->playing.frame = decision->chosen[2];
    decision->playing.at_s = (decision->chosen[2] - (double)clips->starts[(size_t)decision->chosen[1]]) / clips->rate;
    decision->cost = cost;
    decision->play = cdbm_play_of(given, i, clips, (size_t)decision->chosen[1]);
}

/* ---- variation */

/* A number below n, each equally likely, by seed and turn alone: SplitMix64. */
static inline size_t cdbm_drawn(const cdbm_state *state, size_t n)
{
    uint64_t z = (uint64_t)state->seed + ((uint64_t)state->n_drawn + 1) * 0x9E3779B97F4A7C15;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    z ^= z >> 31;
    return (size_t)((z >> 32) * n >> 32);
}

/* Whether variation remembers the asset of a range. */
static inline int cdbm_is_recent(const cdbm_controller *controller, const double *row, const cdbm_clips *clips, size_t range)
{
    const double *recent = cdbm_recent_of(controller, (double *)(uintptr_t)row);
    size_t i;
    for (i = 0; i < controller->n_recent; i++)
        if (recent[i] == clips->keys[range]) return 1;
    return 0;
}

static inline void cdbm_remember_asset(const cdbm_controller *controller, double *row, const cdbm_clips *clips, size_t range)
{
    double *recent = cdbm_recent_of(controller, row);
    if (controller->n_recent == 0) return;
    memmove(recent + 1, recent, (controller->n_recent - 1) * sizeof *recent);
    recent[0] = clips->keys[range];
}

/* One of the best frames of ranges, -1 where a range has none: of assets that are not remembered, or of all where there are no others.
 * Its range; n_ranges where there is no frame. */
static inline size_t cdbm_pick_tie(const cdbm_controller *controller, double *row, const cdbm_clips *clips, const int64_t *frames)
{
    cdbm_state *state = (cdbm_state *)row;
    size_t n_all = 0, n_fresh = 0, left, r;
    for (r = 0; r < clips->n_ranges; r++)
        if (frames[r] >= 0) n_all++, n_fresh += !cdbm_is_recent(controller, row, clips, r);
    if (n_all == 0) return clips->n_ranges;
    left = cdbm_drawn(state, n_fresh ? n_fresh : n_all);
    state->n_drawn += 1.0;
    for (r = 0; r < clips->n_ranges; r++)
        if (frames[r] >= 0 && (n_fresh == 0 || !cdbm_is_recent(controller, row, clips, r)) && left-- == 0) break;
    return r;
}

/* Exchange what was chosen for another frame that is about as good; to play on comes before all of them. 0 where there is too little
 * room. */
static inline int cdbm_vary(const cdbm_controller *controller, const cdbm_given *given, size_t i, double *after, const cdbm_moved *move,
    cdbm_decision *decision, cdbm_room room)
{
    const cdbm_clips *clips;
    double within = decision->chosen[3] + controller->vary_within;
    int is_under = decision->is_under != 0.0;
    cdbm_choosing own;
    cdbm_question asked;
    cdbm_hits hits;
    size_t database, r;
    if (decision->cause == CDBM_NOT_DUE || decision->winner < 0.0) return 1;
    if ((!is_under || move->to.database == decision->winner) && decision->continuing_cost <= within) {
        decision->chosen[0] = CDBM_GO_ON;
        return 1;
    }
    database = (size_t)decision->winner, clips = &controller->databases[database];
    if (!cdbm_take_choosing(controller, &own, 1, &room)) return 0;
    hits.totals = (double *)cdbm_part(&room, clips->n_ranges * sizeof(double));
    hits.frames = (int64_t *)cdbm_part(&room, clips->n_ranges * sizeof(int64_t)), hits.ranges = own.found;
    if (!hits.totals || !hits.frames) return 0;
    own.skip_stops[0] = 0;
    cdbm_put_question(controller, given, i, after, move, decision, database, &own, 0);
    asked = cdbm_question_of(given, clips, &own, 1);
    asked.within = within, asked.is_each = 1;
    if (!cdbm_search_frames(clips->frames, &asked, 0, 1, &hits, room)) return 0;
    for (r = 0; is_under && r < clips->n_ranges; r++)
        if (!(hits.totals[r] < clips->threshold)) hits.frames[r] = -1;
    r = hits.ranges[0] == CDBM_REFUSED ? clips->n_ranges : cdbm_pick_tie(controller, after, clips, hits.frames);
    if (r == clips->n_ranges) return 1;
    decision->chosen[1] = (double)r, decision->chosen[2] = (double)hits.frames[r], decision->chosen[3] = hits.totals[r];
    return 1;
}

/* What it costs to play on, where that takes part in the search; and what is to play in place of the best, where that varies. 0 where
 * there is too little room; `numbers` has one for each feature. */
static inline int cdbm_weigh(const cdbm_controller *controller, const cdbm_given *given, size_t i, double *after, const cdbm_moved *move,
    cdbm_decision *decision, double *numbers, cdbm_room room)
{
    int is_wide = decision->standing == CDBM_IS_WIDENED;
    if (decision->winner >= 0.0 && decision->current >= 0.0)
        decision->continuing_cost = cdbm_continuing_cost(controller, given, i, &move->to, is_wide ? given->wide[i] : NAN, numbers);
    return !controller->varies || cdbm_vary(controller, given, i, after, move, decision, room);
}

/* Whether what plays was entered so lately that it plays on though something else costs a little less; not where it is to stand. */
static inline int cdbm_settles(const cdbm_controller *controller, const cdbm_state *state, const cdbm_moved *move,
    const cdbm_decision *decision, const double *query)
{
    const cdbm_clips *clips = move->to.database < 0.0 ? NULL : &controller->databases[(size_t)move->to.database];
    double stayed_s = decision->time_s - state->entered_s, left = 1.0 - stayed_s / controller->settle_s;
    double settle = clips ? clips->settle : 0.0;
    if (!(decision->chosen[0] >= 0.0) || !(decision->continuing_cost == decision->continuing_cost) || settle == 0.0 || !(left > 0.0)) return 0;
    if (controller->databases[(size_t)decision->chosen[0]].looping[(size_t)decision->chosen[1]]
        && !clips->looping[(size_t)move->to.range]) return 0; /* a loop may stay for good */
    if (clips->n_pace && cdbm_pace(clips, query + clips->pace) < CDBM_LEAST_MPS) return 0;
    if (decision->is_under != 0.0 && decision->winner != move->to.database) return 0; /* a priority database wins outright */
    return decision->continuing_cost + settle * left <= decision->chosen[3];
}

/* Put a decision into the next row. */
static inline void cdbm_go_on(const cdbm_controller *controller, const cdbm_state *state, double *after, const cdbm_decision *decision)
{
    cdbm_state *next = (cdbm_state *)after;
    int is_new = decision->action == CDBM_STARTS || decision->action == CDBM_JUMPS;
    next->tick = state->tick + 1.0;
    next->since_search_s = decision->cause != CDBM_NOT_DUE ? 0.0 : state->since_search_s + decision->dt_s;
    next->playing = decision->playing;
    if (is_new) {
        double span[2];
        span[0] = decision->playing.frame, span[1] = decision->playing.frame + 1.0;
        cdbm_remember(controller, after, (size_t)decision->playing.range, span);
        cdbm_remember_asset(controller, after, &controller->databases[(size_t)decision->playing.database], (size_t)decision->playing.range);
        next->entered_s = next->time_s;
    }
    if (decision->held == CDBM_NOT_HELD || decision->held == CDBM_BY_HYSTERESIS) next->waiting_since_s = NAN;
    else if (decision->held == CDBM_BY_BAR && !(next->waiting_since_s == next->waiting_since_s)) next->waiting_since_s = next->time_s;
    next->rate = decision->rate, next->play = decision->play;
}

/* The second half of an update: what plays now. */
static inline void cdbm_decide(const cdbm_controller *controller, const cdbm_given *given, size_t i, const double *before,
    const cdbm_moved *move, double *after, cdbm_decision *decision)
{
    const cdbm_state *state = (const cdbm_state *)before;
    const double *query = given->queries + i * controller->n_features;
    int is_there = move->to.database >= 0.0, is_searched = decision->cause != CDBM_NOT_DUE;
    int goes_on = decision->chosen[0] == CDBM_GO_ON || (decision->current >= 0.0 && decision->chosen[0] == move->to.database
        && decision->chosen[2] == decision->current) || cdbm_settles(controller, state, move, decision, query);
    double wanted;
    decision->playing = move->to;
    decision->action = move->n_loops != 0.0 ? CDBM_LOOPS : CDBM_PLAYS_ON;
    if (!is_there) decision->playing.database = CDBM_NO_DATABASE, decision->action = CDBM_PLAYS_NOTHING;
    if (is_searched && decision->winner < 0.0) {
        if (is_there && decision->cause == CDBM_ENDED) decision->action = CDBM_HOLDS;
    } else if (is_searched && goes_on) {
        decision->cost = decision->continuing_cost;
        if (decision->standing == CDBM_IS_WIDENED) decision->held = CDBM_BY_HYSTERESIS;
    } else if (is_searched) cdbm_jump(controller, given, i, decision, state->playing.database == CDBM_NO_DATABASE);
    memcpy(decision->motion, move->motion, sizeof decision->motion);
    decision->root_weight = decision->rate = 1.0;
    if (decision->playing.database >= 0.0) {
        const cdbm_clips *clips = &controller->databases[(size_t)decision->playing.database];
        decision->root_weight = clips->root_weights[clips->frames->kinds ? clips->frames->kinds[(int64_t)decision->playing.frame] : 0];
        wanted = decision->action == CDBM_HOLDS ? 1.0 : cdbm_play_rate(controller, given, &decision->playing, &decision->play, query);
        decision->rate = wanted;
        if ((decision->action == CDBM_PLAYS_ON || decision->action == CDBM_LOOPS)
            && !(cdbm_to_event(given, clips, &decision->playing) == cdbm_to_event(given, clips, &decision->playing)))
            decision->rate += (state->rate - wanted) * cdbo_exp(-CDBO_LN2 * given->dt_s / CDBM_RATE_HALFLIFE_S);
    }
    cdbm_go_on(controller, state, after, decision);
}

/* ---- from the rows of a table to the ranges of a database */

typedef struct cdbm_table_ranges { /* which rows of a table name the asset of each range */
    const int64_t *starts;         /* [R + 1] */
    const int64_t *rows;
    const uint8_t *mirrored;       /* [R]: those that go by the answer with mirrored facts */
    const cdb_row_play *plays;     /* how each row plays, NULL where none says */
    size_t n_ranges, at;           /* at: where the first is among all */
} cdbm_table_ranges;

/* Whether a row lets its clip play as it is, or mirrored. */
static inline int cdbm_may_mirror(const cdbm_table_ranges *of, int64_t row, int is_mirrored)
{
    return !of->plays || !(of->plays[row].mirror == (is_mirrored ? CDB_NEVER_MIRRORED : CDB_ALWAYS_MIRRORED));
}

/* Write which ranges the rows of an answer, and of that in a mirror, let play; their biases, with what the cheapest row of each
 * costs where `costs` are given; and by which row each plays, the first or the cheapest, where `chosen` is given. */
static inline void cdbm_fill_ranges(const cdbm_table_ranges *of, const uint64_t *const *masks, const double *const *costs,
    const double *own, uint8_t *ranges, double *biases, int64_t *chosen)
{
    size_t r;
    for (r = 0; r < of->n_ranges; r++) {
        const uint64_t *mask = masks[of->mirrored[r]];
        const double *cost = costs ? costs[of->mirrored[r]] : NULL;
        double least = (double)INFINITY;
        uint8_t is_valid = 0;
        int64_t k, first = -1;
        for (k = of->starts[r]; k < of->starts[r + 1] && (cost || !is_valid); k++) {
            int64_t row = of->rows[k];
            if (!(mask[row / 64] >> (row % 64) & 1) || !cdbm_may_mirror(of, row, of->mirrored[r])) continue;
            if (!is_valid || (cost && cost[row] < least)) first = row;
            is_valid = 1;
            if (cost && cost[row] < least) least = cost[row];
        }
        if (chosen) chosen[of->at + r] = first;
        ranges[of->at + r] = is_valid;
        if (cost) biases[of->at + r] = own[of->at + r] + (is_valid ? least : 0.0);
    }
}

/* ---- what was decided, for poses */

/* What poses are made of, by a decision and the moments of banks that it names. */
static inline cdbo_play cdbm_pose_play(const cdbm_decision *decision, cdbo_instant playing, cdbo_instant before, cdbo_instant displayed,
    int gives_ground)
{
    cdbo_play play;
    play.playing = playing, play.before = before, play.displayed = displayed;
    play.action = decision->action, play.rate = decision->rate, play.weight = decision->root_weight;
    play.gives_ground = gives_ground ? 1.0 : 0.0;
    memcpy(play.motion, decision->motion, sizeof play.motion);
    play.blend_s = decision->play.blend_s, play.root = decision->play.root;
    return play;
}
