/* ---- The joint search: the best joint frame and cast of all that may be.
 *
 * What a cast costs in a box of 8 joint frames is at least the sum of what its actors' queries cost against the bounds of the box in each
 * role, of what the places and facings of its actors cost against theirs, and of the least bias. Boxes are looked at in the order of
 * the least of these bounds over casts, until it is above the best total; within a box only casts whose bound is not above it. What an
 * actor costs in a role is computed once a box, whatever casts share him. Bounds and costs are float64, bounds lowered by what rounding
 * may add, so that no tie is lost.
 *
 * A actors, C casts, J joint ranges, K roles, P ordered pairs of roles, B joint boxes, F features of a role; 8 lanes. The arrays are
 * those of contextdb/motion/joint/boxes.py. */

#define CDBM_ROUNDED 1e-12          /* more than rounding can add to a bound, of its size */
#define CDBM_JOINT_TILE 64          /* so many boxes are bounded at a time, so that they stay in the processor's cache */

typedef struct cdbm_joint {         /* a joint database: what all its searches read */
    size_t n_boxes, n_roles, n_pairs, n_features, n_channels, n_ranges, n_own;
    const float *blocks;            /* [n_own][F][8] the boxes of the motion database */
    const int64_t *rank;            /* [F] where each feature is in these */
    const int64_t *boxes;           /* [B][K] that of each role */
    const float *lows, *highs;      /* [K][F][B] its bounds */
    const int64_t *channels;        /* [n_channels + 1] */
    const double *weights;          /* [n_channels] */
    const int64_t *ranges, *firsts; /* [B] the joint range, and the first joint frame */
    const float *relative;          /* [B][P][4][8] what roles see of each other */
    const float *relative_lows, *relative_highs; /* [P][4][B] */
    const int64_t *pairs;           /* [P][2] */
    const double *relative_weights; /* [2] */
} cdbm_joint;

typedef struct cdbm_meeting {       /* one search of it */
    size_t n_actors, n_casts;
    const double *queries;          /* [A][F] */
    const double *seen;             /* [A][A][4] what each sees of each other */
    const int64_t *casts;           /* [C][K] */
    const double *range_biases;     /* [C][J] infinite where a cast may not play */
    const double *frame_biases;     /* [B][8] */
    int is_each;                    /* the best of each cast in each range is searched */
    double *bests;                  /* [1] or [C][J] the lowest totals, and their frames and casts; what is there already stays where */
    int64_t *frames, *casts_of;     /* nothing is better */
} cdbm_meeting;

typedef struct cdbm_joint_memory {
    double *own;                    /* [A][K][B] what each actor costs at least in each role */
    double *bounds, *least;         /* [C][B], [B] what each cast costs at least, and the least of all */
    double *near;                   /* [P][A][A][TILE] */
    double *costs;                  /* [A][K][8] */
    unsigned char *plays, *is_near, *is_known; /* [A][K], [P][A][A], [A][K] */
    size_t *heap;                   /* [B] */
} cdbm_joint_memory;

/* The weighted square of how far a number is from an interval. */
CDBM_INLINE double cdbm_outside(double number, double low, double high, double weight)
{
    double nearest = number > low ? number : low, apart;
    nearest = nearest < high ? nearest : high;
    apart = number - nearest;
    return weight * (apart * apart);
}

/* What the pose and path of each actor cost at least in each role that a cast gives him. */
CDBM_INLINE void cdbm_own_bounds(const cdbm_joint *joint, const cdbm_meeting *asked, const cdbm_joint_memory *memory)
{
    size_t actor, role, c, box, n = joint->n_boxes;
    for (actor = 0; actor < asked->n_actors; actor++)
        for (role = 0; role < joint->n_roles; role++) {
            double *bounds = memory->own + (actor * joint->n_roles + role) * n;
            if (!memory->plays[actor * joint->n_roles + role]) continue;
            memset(bounds, 0, n * sizeof *bounds);
            for (c = 0; c < joint->n_channels; c++) {
                int64_t f;
                for (f = joint->channels[c]; f < joint->channels[c + 1]; f++) {
                    const float *low = joint->lows + (role * joint->n_features + (size_t)f) * n;
                    const float *high = joint->highs + (role * joint->n_features + (size_t)f) * n;
                    double number = asked->queries[actor * joint->n_features + (size_t)f], weight = joint->weights[c];
                    for (box = 0; box < n; box++) bounds[box] += cdbm_outside(number, (double)low[box], (double)high[box], weight);
                }
            }
        }
}

/* What one actor sees of another costs at least in some boxes, where a cast has them so. */
CDBM_INLINE void cdbm_near_bounds(const cdbm_joint *joint, const cdbm_meeting *asked, const cdbm_joint_memory *memory, size_t start,
    size_t stop)
{
    size_t n_actors = asked->n_actors, c, p, i, at;
    memset(memory->is_near, 0, joint->n_pairs * n_actors * n_actors);
    for (c = 0; c < asked->n_casts; c++)
        for (p = 0; p < joint->n_pairs; p++) {
            const int64_t *cast = asked->casts + c * joint->n_roles, *pair = joint->pairs + 2 * p;
            size_t both = (size_t)cast[pair[0]] * n_actors + (size_t)cast[pair[1]], place = p * n_actors * n_actors + both;
            double *total = memory->near + place * CDBM_JOINT_TILE;
            if (memory->is_near[place]) continue;
            memory->is_near[place] = 1;
            memset(total, 0, CDBM_JOINT_TILE * sizeof *total);
            for (i = 0; i < 4; i++) {
                const float *low = joint->relative_lows + (4 * p + i) * joint->n_boxes + start;
                const float *high = joint->relative_highs + (4 * p + i) * joint->n_boxes + start;
                double number = asked->seen[4 * both + i], weight = joint->relative_weights[i / 2];
                for (at = 0; at < stop - start; at++) total[at] += cdbm_outside(number, (double)low[at], (double)high[at], weight);
            }
        }
}

/* What each cast costs at least in some boxes, infinity where it may not play, and the least of all casts. */
CDBM_INLINE void cdbm_cast_bounds(const cdbm_joint *joint, const cdbm_meeting *asked, const cdbm_joint_memory *memory, size_t start,
    size_t stop)
{
    size_t n_actors = asked->n_actors, n_roles = joint->n_roles, c, k, p, box;
    double biases[CDBM_JOINT_TILE];
    for (box = start; box < stop; box++)
        biases[box - start] = cdbm_least_of(asked->frame_biases + CDBM_FRAMES * box, CDBM_FRAMES);
    for (c = 0; c < asked->n_casts; c++) {
        const int64_t *cast = asked->casts + c * n_roles;
        double *bounds = memory->bounds + c * joint->n_boxes;
        for (box = start; box < stop; box++) bounds[box] = 0.0;
        for (k = 0; k < n_roles; k++) {
            const double *own = memory->own + ((size_t)cast[k] * n_roles + k) * joint->n_boxes;
            for (box = start; box < stop; box++) bounds[box] += own[box];
        }
        for (p = 0; p < joint->n_pairs; p++) {
            const int64_t *pair = joint->pairs + 2 * p;
            size_t place = (p * n_actors + (size_t)cast[pair[0]]) * n_actors + (size_t)cast[pair[1]];
            const double *near = memory->near + place * CDBM_JOINT_TILE;
            for (box = start; box < stop; box++) bounds[box] += near[box - start];
        }
        for (box = start; box < stop; box++) {
            double bias = biases[box - start] + asked->range_biases[c * joint->n_ranges + (size_t)joint->ranges[box]];
            double lowered = bounds[box] * (1.0 - CDBM_ROUNDED) + bias;
            bounds[box] = bias < (double)INFINITY ? lowered - CDBM_ROUNDED * (cdbm_size_of(lowered) + cdbm_size_of(bias)) : (double)INFINITY;
            if (bounds[box] < memory->least[box]) memory->least[box] = bounds[box];
        }
    }
}

/* What the pose and path of an actor cost in each lane of a box, in the order of contextdb/motion/search/cost.py. */
CDBM_INLINE void cdbm_own_costs(const cdbm_joint *joint, const cdbm_meeting *asked, size_t box, size_t role, size_t actor, double *totals)
{
    const float *block = joint->blocks + (size_t)joint->boxes[box * joint->n_roles + role] * joint->n_features * CDBM_FRAMES;
    const double *query = asked->queries + actor * joint->n_features;
    size_t c, lane;
    memset(totals, 0, CDBM_FRAMES * sizeof *totals);
    for (c = 0; c < joint->n_channels; c++) {
        double squares[CDBM_FRAMES] = {0.0};
        int64_t f;
        for (f = joint->channels[c]; f < joint->channels[c + 1]; f++) {
            const float *values = block + joint->rank[f] * CDBM_FRAMES;
            for (lane = 0; lane < CDBM_FRAMES; lane++) {
                double apart = (double)values[lane] - query[f];
                squares[lane] += apart * apart;
            }
        }
        for (lane = 0; lane < CDBM_FRAMES; lane++) totals[lane] += joint->weights[c] * squares[lane];
    }
}

/* What a cast costs in each lane of a box, without bias. */
CDBM_INLINE void cdbm_cast_costs(const cdbm_joint *joint, const cdbm_meeting *asked, const cdbm_joint_memory *memory, size_t box, size_t c,
    double *totals)
{
    const int64_t *cast = asked->casts + c * joint->n_roles;
    size_t k, p, part, lane;
    memset(totals, 0, CDBM_FRAMES * sizeof *totals);
    for (k = 0; k < joint->n_roles; k++) {
        size_t at = (size_t)cast[k] * joint->n_roles + k;
        double *own = memory->costs + at * CDBM_FRAMES;
        if (!memory->is_known[at]) cdbm_own_costs(joint, asked, box, k, (size_t)cast[k], own);
        memory->is_known[at] = 1;
        for (lane = 0; lane < CDBM_FRAMES; lane++) totals[lane] += own[lane];
    }
    for (p = 0; p < joint->n_pairs; p++) {
        const int64_t *pair = joint->pairs + 2 * p;
        const double *seen = asked->seen + 4 * ((size_t)cast[pair[0]] * asked->n_actors + (size_t)cast[pair[1]]);
        for (part = 0; part < 2; part++) {
            const float *one = joint->relative + ((box * joint->n_pairs + p) * 4 + 2 * part) * CDBM_FRAMES, *other = one + CDBM_FRAMES;
            for (lane = 0; lane < CDBM_FRAMES; lane++) {
                double first = (double)one[lane] - seen[2 * part], second = (double)other[lane] - seen[2 * part + 1];
                totals[lane] += joint->relative_weights[part] * (first * first + second * second);
            }
        }
    }
}

/* Search the casts that may be the best in a box. */
CDBM_INLINE void cdbm_search_joint_box(const cdbm_joint *joint, cdbm_meeting *asked, const cdbm_joint_memory *memory, size_t box)
{
    size_t range = (size_t)joint->ranges[box], c, lane;
    memset(memory->is_known, 0, asked->n_actors * joint->n_roles);
    for (c = 0; c < asked->n_casts; c++) {
        size_t slot = asked->is_each ? c * joint->n_ranges + range : 0;
        double bound = memory->bounds[c * joint->n_boxes + box], bias = asked->range_biases[c * joint->n_ranges + range];
        double totals[CDBM_FRAMES];
        if (bound > asked->bests[slot] || bound == (double)INFINITY) continue;
        CDBM_COUNT(casts);
        cdbm_cast_costs(joint, asked, memory, box, c, totals);
        for (lane = 0; lane < CDBM_FRAMES; lane++) {
            double total = totals[lane] + (bias + asked->frame_biases[box * CDBM_FRAMES + lane]), *best = &asked->bests[slot];
            int64_t frame = joint->firsts[box] + (int64_t)lane, *best_frame = &asked->frames[slot];
            if (total > *best || !(total < (double)INFINITY)) continue;
            if (total == *best && (frame > *best_frame || (frame == *best_frame && (int64_t)c >= asked->casts_of[slot]))) continue;
            *best = total;
            *best_frame = frame;
            asked->casts_of[slot] = (int64_t)c;
        }
    }
}

/* Let a box of a heap sink until none below it costs less. */
CDBM_INLINE void cdbm_sink(size_t *heap, size_t n, size_t at, const double *least)
{
    for (;;) {
        size_t below = 2 * at + 1, box = heap[at];
        if (below >= n) return;
        if (below + 1 < n && least[heap[below + 1]] < least[heap[below]]) below++;
        if (!(least[heap[below]] < least[box])) return;
        heap[at] = heap[below];
        heap[below] = box;
        at = below;
    }
}

CDBM_INLINE void cdbm_search_joint_in(const cdbm_joint *joint, cdbm_meeting *asked, const cdbm_joint_memory *memory)
{
    size_t n = joint->n_boxes, c, k, box;
    memset(memory->plays, 0, asked->n_actors * joint->n_roles);
    for (c = 0; c < asked->n_casts; c++)
        for (k = 0; k < joint->n_roles; k++) memory->plays[(size_t)asked->casts[c * joint->n_roles + k] * joint->n_roles + k] = 1;
    cdbm_own_bounds(joint, asked, memory);
    for (box = 0; box < n; box++) {
        memory->least[box] = (double)INFINITY;
        memory->heap[box] = box;
    }
    for (box = 0; box < n; box += CDBM_JOINT_TILE) {
        size_t stop = n - box > CDBM_JOINT_TILE ? box + CDBM_JOINT_TILE : n;
        cdbm_near_bounds(joint, asked, memory, box, stop);
        cdbm_cast_bounds(joint, asked, memory, box, stop);
    }
    for (box = n / 2; box-- > 0;) cdbm_sink(memory->heap, n, box, memory->least);
    while (n > 0 && memory->least[memory->heap[0]] < (double)INFINITY
        && (asked->is_each || memory->least[memory->heap[0]] <= asked->bests[0])) {
        CDBM_COUNT(joint_boxes);
        cdbm_search_joint_box(joint, asked, memory, memory->heap[0]);
        memory->heap[0] = memory->heap[--n];
        cdbm_sink(memory->heap, n, 0, memory->least);
    }
}

static void cdbm_search_joint_now(const cdbm_joint *joint, cdbm_meeting *asked, const cdbm_joint_memory *memory)
{
    cdbm_search_joint_in(joint, asked, memory);
}

#ifdef CDBM_WIDE
CDBM_WIDE static void cdbm_search_joint_wide(const cdbm_joint *joint, cdbm_meeting *asked, const cdbm_joint_memory *memory)
{
    cdbm_search_joint_in(joint, asked, memory);
}
#endif

/* How many bytes of room a search takes for so many actors and casts. */
static inline size_t cdbm_joint_room(const cdbm_joint *joint, size_t n_actors, size_t n_casts)
{
    size_t n_plays = n_actors * joint->n_roles, n_both = joint->n_pairs * n_actors * n_actors, n = joint->n_boxes * sizeof(double);
    return cdbm_rounded(n_plays * n) + cdbm_rounded(n_casts * n) + cdbm_rounded(n) + cdbm_rounded(n_both * CDBM_JOINT_TILE * sizeof(double))
        + cdbm_rounded(n_plays * CDBM_FRAMES * sizeof(double)) + 2 * cdbm_rounded(n_plays) + cdbm_rounded(n_both)
        + cdbm_rounded(joint->n_boxes * sizeof(size_t));
}

/* Lower the best totals of a meeting to those of its casts; 0 with too little room. On a tie the lowest frame wins, then the first
 * cast; casts before these, whose bests are there already, win over them. */
static inline int cdbm_search_joint(const cdbm_joint *joint, cdbm_meeting *asked, cdbm_room room)
{
    size_t n_plays = asked->n_actors * joint->n_roles, n_both = joint->n_pairs * asked->n_actors * asked->n_actors;
    cdbm_joint_memory memory;
    memory.own = (double *)cdbm_part(&room, n_plays * joint->n_boxes * sizeof(double));
    memory.bounds = (double *)cdbm_part(&room, asked->n_casts * joint->n_boxes * sizeof(double));
    memory.least = (double *)cdbm_part(&room, joint->n_boxes * sizeof(double));
    memory.near = (double *)cdbm_part(&room, n_both * CDBM_JOINT_TILE * sizeof(double));
    memory.costs = (double *)cdbm_part(&room, n_plays * CDBM_FRAMES * sizeof(double));
    memory.plays = (unsigned char *)cdbm_part(&room, n_plays), memory.is_known = (unsigned char *)cdbm_part(&room, n_plays);
    memory.is_near = (unsigned char *)cdbm_part(&room, n_both);
    memory.heap = (size_t *)cdbm_part(&room, joint->n_boxes * sizeof(size_t));
    if (!memory.own || !memory.bounds || !memory.least || !memory.near || !memory.costs || !memory.plays || !memory.is_near
        || !memory.is_known || !memory.heap) return 0;
#ifdef CDBM_WIDE
    if (cdbm_best_lanes().bounds == cdbm_bounds_wide) {
        cdbm_search_joint_wide(joint, asked, &memory);
        return 1;
    }
#endif
    cdbm_search_joint_now(joint, asked, &memory);
    return 1;
}

/* Whether each number of rows of numbers is at least 0 and below `end`. */
static int cdbm_are_below(const int64_t *numbers, size_t n, size_t end)
{
    size_t i;
    for (i = 0; i < n; i++)
        if (numbers[i] < 0 || (uint64_t)numbers[i] >= end) return 0;
    return 1;
}

/* Whether all that a joint search reads by numbers is there, but for its casts, which are numbers of actors. */
static inline int cdbm_is_joint_whole(const cdbm_joint *joint)
{
    size_t i;
    for (i = 0; i <= joint->n_channels; i++) {
        if (joint->channels[i] < (i ? joint->channels[i - 1] : 0)) return 0;
        if ((uint64_t)joint->channels[i] > joint->n_features) return 0;
    }
    return cdbm_are_below(joint->rank, joint->n_features, joint->n_features)
        && cdbm_are_below(joint->boxes, joint->n_boxes * joint->n_roles, joint->n_own)
        && cdbm_are_below(joint->ranges, joint->n_boxes, joint->n_ranges)
        && cdbm_are_below(joint->pairs, 2 * joint->n_pairs, joint->n_roles);
}
