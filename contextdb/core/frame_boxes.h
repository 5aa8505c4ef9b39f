/* ---- Boxes: the frames of a database as searches read them, and the bounds of boxes in whole numbers.
 *
 * F features, P pairs of them, C channels, R ranges, K kinds, N frames, B boxes, G groups. A box is up to 8 frames of one range, one
 * after another, a group 16 boxes, a cluster 16 groups. The arrays are those of contextdb/motion/search/layout.py.
 *
 * A level is a feature's number in steps of one size for all features, as they count in the cost. Levels keep the order of numbers, so
 * what lies between two numbers lies between their levels; the difference of two levels is less than one more than that of the numbers
 * in steps, which is why bounds are one level lower and higher than they are.
 *
 * Bounds of boxes of 16 and 64 frames as in orangeduck/Motion-Matching, database.h; the lanes and levels are ours. */

#include <math.h>

#define CDBM_SPREADS 9.0            /* so many times the usual spread of a feature are told apart; numbers beyond count as nearer */
#define CDBM_UNIT 6e-8              /* the greatest relative rounding error of one float32 operation */

typedef struct cdbm_level {         /* bounds of 16 at a time: [rows][P][16][2], P pairs of features */
    int16_t *lows, *highs;
} cdbm_level;

typedef struct cdbm_box {           /* what is read of a box that is scored, next to each other */
    int64_t start;
    int32_t size, range, kind;
} cdbm_box;

typedef struct cdbm_run {           /* boxes of a group, one after another, that are of one range: a bit each */
    int32_t range;
    uint16_t group, boxes;          /* the group's place in its cluster */
} cdbm_run;

typedef struct cdbm_frames {        /* a database: what all its searches read */
    size_t n_frames, n_features, n_boxes, n_ranges, n_channels;
    size_t n_kinds;                 /* one more than the greatest kind of a frame */
    const float *blocks;            /* [B][F][8] */
    const int64_t *order, *rank;    /* [F] which feature is at each place of these, and where each is */
    const int64_t *box_starts;      /* [B] ascending */
    const int32_t *box_sizes, *box_ranges, *box_kinds; /* [B] the kind of all its frames, -1 where they are of several */
    const int64_t *range_boxes;     /* [R][2] from the first up to, not including, the second */
    const int32_t *kinds;           /* [N], or NULL where all are 0 */
    const double *offset, *scale;   /* [F] */
    const int64_t *channels;        /* [C + 1] the features at which channels begin, and the end of the last */
    const double *weights;          /* [C] */
    const double *roots;            /* [F] the root of the weight of each feature */
    /* What follows is made of it by cdbm_make_levels. */
    size_t n_groups, n_clusters, n_pairs;
    double step, unit;              /* levels in one, of a feature whose weight is 1, and their square */
    int are_given;                  /* whether the bounds lie in memory of others */
    cdbm_box *boxes;                /* [B] */
    cdbm_run *runs;                 /* of all boxes */
    size_t *cluster_runs;           /* [n_clusters + 1] the first of each cluster */
    int32_t *cluster_ranges;        /* [n_clusters][2] the lowest and the highest range of each cluster's boxes */
    double *steps;                  /* [F] levels in one, of the feature at each place */
    float *narrow_weights;          /* [F] its weight */
    int16_t most;                   /* the greatest level */
    cdbm_level groups, clusters;    /* of the boxes of each group; of the groups of each cluster */
    cdbm_lanes lanes;
} cdbm_frames;

/* Whether all that a search reads by numbers of a database is there: to be asked once. */
static inline int cdbm_is_whole(const cdbm_frames *frames)
{
    int64_t end = 0;
    size_t i, n_boxes = 0;
    for (i = 0; i < frames->n_features; i++) {
        if (frames->order[i] < 0 || (uint64_t)frames->order[i] >= frames->n_features) return 0;
        if (frames->rank[i] < 0 || (uint64_t)frames->rank[i] >= frames->n_features) return 0;
    }
    for (i = 0; i <= frames->n_channels; i++) {
        if (frames->channels[i] < (i ? frames->channels[i - 1] : 0)) return 0;
        if ((uint64_t)frames->channels[i] > frames->n_features) return 0;
    }
    for (i = 0; i < frames->n_boxes; i++) {
        if (frames->box_sizes[i] < 1 || frames->box_sizes[i] > CDBM_FRAMES || frames->box_starts[i] < end) return 0;
        if (frames->box_starts[i] > (int64_t)frames->n_frames - frames->box_sizes[i]) return 0;
        end = frames->box_starts[i] + frames->box_sizes[i];
        if (frames->box_ranges[i] < 0 || (size_t)frames->box_ranges[i] >= frames->n_ranges) return 0;
        if (frames->box_kinds[i] < -1 || (frames->box_kinds[i] >= 0 && (size_t)frames->box_kinds[i] >= frames->n_kinds)) return 0;
    }
    for (i = 0; i < frames->n_ranges; i++) {
        int64_t first = frames->range_boxes[2 * i], stop = frames->range_boxes[2 * i + 1], box;
        if (first < 0 || stop < first || (uint64_t)stop > frames->n_boxes) return 0;
        for (box = first; box < stop; box++)
            if ((size_t)frames->box_ranges[box] != i) return 0;
        n_boxes += (size_t)(stop - first);
    }
    for (i = 0; frames->kinds && i < frames->n_frames; i++)
        if (frames->kinds[i] < 0 || (size_t)frames->kinds[i] >= frames->n_kinds) return 0;
    return n_boxes == frames->n_boxes;
}

/* The level of a number. */
static int16_t cdbm_level_of(const cdbm_frames *frames, double number, size_t place)
{
    double level = number * frames->steps[place];
    if (!(level < frames->most)) return frames->most;
    return level > -frames->most ? (int16_t)level : (int16_t)-frames->most;
}

/* The greatest bound of what costs at most `budget`; -1 where nothing does. Levels are rounded by less than the share and the one that
 * are added. */
static int32_t cdbm_limit(const cdbm_frames *frames, double budget)
{
    double bound = budget * frames->unit * (1.0 + 1e-9) + 1.0;
    if (budget < 0.0) return -1;
    return bound < 2147483647.0 ? (int32_t)bound : 2147483647;
}

/* The float32 below which a sum of squares may be when it is at most `budget` in float64; -1 when none can be. `size` is the weighted
 * square of the query: what rounding it to float32 may add grows with it. */
static float cdbm_narrow_limit(const cdbm_frames *frames, double budget, double size)
{
    double widened;
    if (budget < 0.0) return -1.0f;
    widened = budget * (1.0 + (3.0 * (double)frames->n_features + 16.0) * CDBM_UNIT) + (budget + size) * 4.0 * CDBM_UNIT + 1e-30;
    return widened < 3e38 ? (float)widened : (float)INFINITY;
}

/* The greatest level at which no sum of squares is too large. */
static void cdbm_find_most(cdbm_frames *frames)
{
    for (frames->most = 16000; frames->most > 0; frames->most--) {
        double widest = 2.0 * frames->most + 2.0;
        if (2.0 * (double)frames->n_pairs * widest * widest < 2147483647.0) break;
    }
}

/* How many levels one is, from the spread of one frame of each box. */
static double cdbm_measure(const cdbm_frames *frames)
{
    double all = 0.0, n = (double)frames->n_boxes, step, n_features = (double)(frames->n_features ? frames->n_features : 1);
    size_t f, i;
    for (f = 0; f < frames->n_features; f++) {
        double root = frames->roots[frames->order[f]], sum = 0.0, squares = 0.0;
        for (i = 0; i < frames->n_boxes; i++) {
            double number = root * (double)frames->blocks[(i * frames->n_features + f) * CDBM_FRAMES];
            sum += number;
            squares += number * number;
        }
        if (frames->n_boxes) all += (squares - sum * sum / n) / n;
    }
    all *= CDBM_SPREADS * CDBM_SPREADS / n_features / ((double)frames->most * (double)frames->most + 1.0);
    step = all > 1e-100 && all < 1e100 ? 1.0 : 0.0; /* where bounds are of no use, all are 0 */
    while (all * step * step > 1.0) step *= 0.875;
    while (all * step * step < 0.75 && step > 0.0) step *= 1.125;
    return step;
}

static void cdbm_set_step(cdbm_frames *frames, double step)
{
    size_t f;
    frames->step = step, frames->unit = step * step;
    for (f = 0; f < frames->n_features; f++) {
        double root = frames->roots[frames->order[f]], steps = step * root;
        frames->steps[f] = steps < 1e200 ? steps : 1e200;
        frames->narrow_weights[f] = (float)(root * root);
    }
}

static void cdbm_free_levels(cdbm_frames *frames)
{
    CDB_FREE(frames->boxes);
    CDB_FREE(frames->runs);
    CDB_FREE(frames->cluster_runs);
    CDB_FREE(frames->cluster_ranges);
    CDB_FREE(frames->steps);
    CDB_FREE(frames->narrow_weights);
    if (frames->are_given) return;
    CDB_FREE(frames->groups.lows);
    CDB_FREE(frames->groups.highs);
    CDB_FREE(frames->clusters.lows);
    CDB_FREE(frames->clusters.highs);
}

/* Bounds of so many rows of 16; the lows are as high, and the highs as low, as none is. 0 where memory is missing. */
static int cdbm_take_level(cdbm_level *level, size_t n_rows, const cdbm_frames *frames)
{
    size_t n = n_rows * frames->n_pairs * 2 * CDBM_LANES, i;
    level->lows = (int16_t *)CDB_MALLOC(n * sizeof(int16_t) + 1);
    level->highs = (int16_t *)CDB_MALLOC(n * sizeof(int16_t) + 1);
    for (i = 0; level->lows && level->highs && i < n; i++) {
        int is_there = 2 * (i / (2 * CDBM_LANES) % frames->n_pairs) + i % 2 < frames->n_features;
        level->lows[i] = is_there ? INT16_MAX : 0;
        level->highs[i] = is_there ? INT16_MIN : 0;
    }
    return level->lows && level->highs;
}

/* Widen the bounds of a lane of 16 at a place. */
static void cdbm_widen(cdbm_level *level, size_t n_pairs, size_t lane, size_t place, int16_t low, int16_t high)
{
    size_t at = ((lane / CDBM_LANES * n_pairs + place / 2) * CDBM_LANES + lane % CDBM_LANES) * 2 + place % 2;
    if (low < level->lows[at]) level->lows[at] = low;
    if (high > level->highs[at]) level->highs[at] = high;
}

/* Put next to each other what is read of the boxes, and say of which ranges those of each group and cluster are. */
static void cdbm_gather_boxes(cdbm_frames *frames)
{
    size_t box, n_runs = 0;
    for (box = 0; box < frames->n_boxes; box++) {
        cdbm_box own = {frames->box_starts[box], frames->box_sizes[box], frames->box_ranges[box], frames->box_kinds[box]};
        int32_t *ranges = frames->cluster_ranges + 2 * (box / CDBM_LANES / CDBM_LANES);
        size_t lane = box % CDBM_LANES;
        frames->boxes[box] = own;
        if (box % (CDBM_LANES * CDBM_LANES) == 0) {
            frames->cluster_runs[box / CDBM_LANES / CDBM_LANES] = n_runs;
            ranges[0] = ranges[1] = own.range;
        }
        if (lane == 0 || own.range != frames->runs[n_runs - 1].range) {
            cdbm_run run = {own.range, (uint16_t)(box / CDBM_LANES % CDBM_LANES), 0};
            frames->runs[n_runs++] = run;
        }
        frames->runs[n_runs - 1].boxes = (uint16_t)(frames->runs[n_runs - 1].boxes | 1U << lane);
        if (own.range < ranges[0]) ranges[0] = own.range;
        if (own.range > ranges[1]) ranges[1] = own.range;
    }
    frames->cluster_runs[frames->n_clusters] = n_runs;
}

/* Memory for what is made of a checked database but for its bounds; 0 where it is missing. */
static int cdbm_take_boxes(cdbm_frames *frames)
{
    size_t n_features = frames->n_features;
    frames->n_groups = (frames->n_boxes + CDBM_LANES - 1) / CDBM_LANES;
    frames->n_clusters = (frames->n_groups + CDBM_LANES - 1) / CDBM_LANES;
    frames->n_pairs = (n_features + 1) / 2;
    frames->lanes = cdbm_best_lanes();
    frames->boxes = (cdbm_box *)CDB_MALLOC(frames->n_boxes * sizeof *frames->boxes + 1);
    frames->steps = (double *)CDB_MALLOC(n_features * sizeof(double) + 1);
    frames->narrow_weights = (float *)CDB_MALLOC(n_features * sizeof(float) + 1);
    frames->runs = (cdbm_run *)CDB_MALLOC((frames->n_groups + frames->n_ranges) * sizeof *frames->runs + 1);
    frames->cluster_runs = (size_t *)CDB_MALLOC((frames->n_clusters + 1) * sizeof *frames->cluster_runs);
    frames->cluster_ranges = (int32_t *)CDB_MALLOC(frames->n_clusters * 2 * sizeof *frames->cluster_ranges + 1);
    if (!frames->boxes || !frames->runs || !frames->cluster_runs || !frames->cluster_ranges) return 0;
    cdbm_gather_boxes(frames);
    cdbm_find_most(frames);
    return frames->steps && frames->narrow_weights;
}

/* How many numbers the lows of the groups, or of the clusters, are. */
static inline size_t cdbm_level_size(const cdbm_frames *frames, size_t n)
{
    return n * frames->n_pairs * 2 * CDBM_LANES;
}

static int cdbm_are_levels(const cdbm_frames *frames, const int16_t *levels, size_t n)
{
    int16_t least = 0, most = 0;
    size_t i;
    for (i = 0; i < n; i++) least = levels[i] < least ? levels[i] : least, most = levels[i] > most ? levels[i] : most;
    return least >= -frames->most - 1 && most <= frames->most + 1;
}

/* Take over bounds that were made before: lows and highs of groups and of clusters, for whom there is room (cdbm_level_size). They stay
 * where they are. 0 where they are none, or memory is missing. */
static inline int cdbm_use_levels(cdbm_frames *frames, double step, const int16_t *const *levels, const size_t *sizes)
{
    size_t i;
    if (!cdbm_take_boxes(frames) || !(step >= 0.0 && step < 1e100)) return 0;
    frames->are_given = 1;
    cdbm_set_step(frames, step);
    for (i = 0; i < 4; i++) {
        size_t n = cdbm_level_size(frames, i < 2 ? frames->n_groups : frames->n_clusters);
        if (!levels[i] || sizes[i] != n || !cdbm_are_levels(frames, levels[i], n)) return 0;
    }
    frames->groups.lows = (int16_t *)(uintptr_t)levels[0], frames->groups.highs = (int16_t *)(uintptr_t)levels[1];
    frames->clusters.lows = (int16_t *)(uintptr_t)levels[2], frames->clusters.highs = (int16_t *)(uintptr_t)levels[3];
    return 1;
}

/* Make the bounds of a checked database; 0 where memory is missing. They are given back by cdbm_free_levels, made or not. */
static inline int cdbm_make_levels(cdbm_frames *frames)
{
    size_t n_features = frames->n_features, box, f, lane, i;
    if (!cdbm_take_boxes(frames) || !cdbm_take_level(&frames->groups, frames->n_groups, frames)) return 0;
    if (!cdbm_take_level(&frames->clusters, frames->n_clusters, frames)) return 0;
    cdbm_set_step(frames, cdbm_measure(frames));
    for (box = 0; box < frames->n_boxes; box++)
        for (f = 0; f < n_features; f++) {
            const float *own = frames->blocks + (box * n_features + f) * CDBM_FRAMES;
            float low = own[0], high = own[0];
            int16_t lowest, highest;
            for (lane = 1; lane < CDBM_FRAMES; lane++) {
                low = own[lane] < low ? own[lane] : low;
                high = own[lane] > high ? own[lane] : high;
            }
            lowest = (int16_t)(cdbm_level_of(frames, (double)low, f) - 1);
            highest = (int16_t)(cdbm_level_of(frames, (double)high, f) + 1);
            cdbm_widen(&frames->groups, frames->n_pairs, box, f, lowest, highest);
            cdbm_widen(&frames->clusters, frames->n_pairs, box / CDBM_LANES, f, lowest, highest);
        }
    /* Lanes without a box: bounds that no query is far from, so that no difference is too large; they are never looked at. */
    for (i = 0; i < frames->n_groups * frames->n_pairs * 2 * CDBM_LANES; i++)
        if (frames->groups.lows[i] > frames->groups.highs[i]) frames->groups.lows[i] = frames->groups.highs[i] = 0;
    for (i = 0; i < frames->n_clusters * frames->n_pairs * 2 * CDBM_LANES; i++)
        if (frames->clusters.lows[i] > frames->clusters.highs[i]) frames->clusters.lows[i] = frames->clusters.highs[i] = 0;
    return 1;
}
