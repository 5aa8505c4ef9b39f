/* ---- The search: of all frames that may play now the one of lowest cost, for one query or for many.
 *
 * A box is skipped when its bound plus its least bias is above the best total so far; without that term biases would
 * make pruning unsound. What passes is scored in float64, channel by channel, in the order of contextdb/motion/search/cost.py, so that
 * both give the same cost to the last bit. On a tie the frame that plays wins, then the lowest, whatever is looked at first.
 *
 * Of a cluster's groups, and of a group's boxes, the nearest is looked at first, as it spares most of the others. A tile of queries
 * goes through the clusters together, so that what is read of them stays in the processor's cache.
 *
 * The seeding by the current frame as in orangeduck/Motion-Matching, database.h; the least biases and the masks are ours. */

#define CDBM_TILE 512                /* so many queries at most go through the frames together */
#define CDBM_GREATEST 3.4028234663852886e38 /* the largest float32: a query beyond it is refused */
#define CDBM_NOTHING (-1)
#define CDBM_REFUSED (-2)
#ifndef CDBM_COUNT
#define CDBM_COUNT(what) ((void)0)  /* a test counts the clusters, groups, boxes and frames that are looked at */
#endif

typedef struct cdbm_question {      /* what some searches compare, and what they may choose from */
    size_t n_queries;
    const double *queries;          /* [n_queries][F] as the caller gives them */
    const uint8_t *ranges;          /* [n_queries][R], or [1][R] the same for all: those that may play */
    int is_one_mask;
    const double *range_biases;     /* [n_queries][R], or [1][R] */
    int are_same_biases;
    const uint8_t *allowed, *playable; /* [K] the kinds of frames that may be chosen; that may play on */
    const double *kind_biases;      /* [K] */
    const uint8_t *flags;           /* [N] the frames that may be chosen, or NULL for all */
    const double *frame_biases;     /* [N], or NULL */
    const int64_t *skips;           /* [..][2] frames that are left out */
    const int64_t *skip_stops;      /* [n_queries + 1] where those of each query begin among them, and end; NULL: nobody has any */
    const int64_t *currents;        /* [n_queries] the frame that would play on, or -1 */
    double continuing;              /* what is added to its cost alone */
    double within;                  /* totals above this are left out */
    int is_each;                    /* the best of each range is searched, for one query */
} cdbm_question;

typedef struct cdbm_hits {          /* for each query, or for each range of one */
    double *totals;
    int64_t *frames;                /* -1 for none */
    int64_t *ranges;                /* [n_queries] CDBM_NOTHING; CDBM_REFUSED for a query that cannot be compared */
} cdbm_hits;

typedef struct cdbm_query {         /* one query while it is searched */
    const double *query;            /* [F] normalised */
    const float *narrow;            /* [F] the same at the places of the layout */
    const int16_t *levels;          /* [P][2] its levels there */
    const uint8_t *ranges;          /* [R] those that may play */
    const double *range_biases;
    const int64_t *skips;
    size_t n_skips;
    double least;                   /* the least bias of a frame that may play */
    double budget;                  /* what a frame of least bias may cost at most */
    int32_t limit;                  /* the greatest bound that is within it */
    double size;                    /* the weighted square of the query */
    int64_t playing;                /* the frame that plays on, -1 for none */
    double *bests;
    int64_t *frames, *range;
} cdbm_query;

typedef struct cdbm_search {        /* a tile of queries while they are searched */
    const cdbm_frames *frames;
    const cdbm_question *asked;
    double least_kind, least_frame, least_range;
} cdbm_search;

static double cdbm_size_of(double number)
{
    return number < 0.0 ? -number : number;
}

/* What the squares of a frame with this bias may cost at most; widened by what the sum with the bias may round away. */
static double cdbm_budget(double best, double bias)
{
    if (bias == (double)INFINITY) return -1.0;
    return best < (double)INFINITY ? best - bias + 1e-15 * (cdbm_size_of(best) + cdbm_size_of(bias)) : (double)INFINITY;
}

static double cdbm_least_of(const double *numbers, size_t n)
{
    double least = (double)INFINITY;
    size_t i;
    for (i = 0; i < n; i++) least = numbers[i] < least ? numbers[i] : least;
    return least;
}

/* The box of a frame, or -1 for one in no range. */
static int64_t cdbm_box_of(const cdbm_frames *frames, int64_t frame)
{
    size_t low = 0, high = frames->n_boxes;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (frames->box_starts[middle] <= frame) low = middle + 1;
        else high = middle;
    }
    return low > 0 && frame < frames->box_starts[low - 1] + frames->box_sizes[low - 1] ? (int64_t)low - 1 : -1;
}

/* A frame's cost without bias, in float64. */
static double cdbm_cost(const cdbm_frames *frames, size_t box, size_t lane, const double *query)
{
    const float *block = frames->blocks + box * frames->n_features * CDBM_FRAMES + lane;
    double total = 0.0;
    size_t c;
    for (c = 0; c < frames->n_channels; c++) {
        double squares = 0.0;
        int64_t f;
        for (f = frames->channels[c]; f < frames->channels[c + 1]; f++) {
            double apart = (double)block[frames->rank[f] * CDBM_FRAMES] - query[f];
            squares += apart * apart;
        }
        total += frames->weights[c] * squares;
    }
    return total;
}

/* What is added to the cost of a frame of a box, but for the continuing bias. */
static double cdbm_bias(const cdbm_search *search, const cdbm_query *query, size_t box, int64_t frame)
{
    const cdbm_frames *frames = search->frames;
    double bias = query->range_biases[frames->box_ranges[box]] + search->asked->kind_biases[frames->kinds ? frames->kinds[frame] : 0];
    return search->asked->frame_biases ? bias + search->asked->frame_biases[frame] : bias;
}

/* Whether a frame that is not the one that plays may be chosen, if its range may play. */
static int cdbm_is_allowed(const cdbm_search *search, const cdbm_query *query, int64_t frame)
{
    const cdbm_question *asked = search->asked;
    size_t i;
    if (frame == query->playing || (asked->flags && !asked->flags[frame])) return 0;
    if (!asked->allowed[search->frames->kinds ? search->frames->kinds[frame] : 0]) return 0;
    for (i = 0; i < query->n_skips; i++)
        if (query->skips[2 * i] <= frame && frame < query->skips[2 * i + 1]) return 0;
    return 1;
}

/* What is compared with bounds when the best total is this one. */
static void cdbm_set_budget(const cdbm_frames *frames, cdbm_query *query, double best)
{
    query->budget = cdbm_budget(best, query->least);
    query->limit = cdbm_limit(frames, query->budget);
}

/* Keep a total if it is the best. */
static void cdbm_keep(const cdbm_search *search, cdbm_query *query, double total, int64_t frame, int32_t range)
{
    size_t slot = search->asked->is_each ? (size_t)range : 0;
    double *best = &query->bests[slot];
    int64_t *best_frame = &query->frames[slot];
    if (!(total <= *best) || total == (double)INFINITY) return;
    if (total == *best && *best_frame >= 0 && (*best_frame == query->playing || *best_frame < frame)) return;
    *best = total;
    *best_frame = frame;
    *query->range = range;
    if (!search->asked->is_each) cdbm_set_budget(search->frames, query, total);
}

/* The lane of the least total among those of a mask that is not 0. */
static size_t cdbm_cheapest(uint32_t mask, const float *totals)
{
    size_t least = cdbm_lowest(mask);
    for (mask &= mask - 1; mask; mask &= mask - 1)
        if (totals[cdbm_lowest(mask)] < totals[least]) least = cdbm_lowest(mask);
    return least;
}

/* Search a box, which has this bound; of its frames that which is about the cheapest first, as it spares most others. */
static void cdbm_search_box(const cdbm_search *search, cdbm_query *query, size_t number, int32_t bound)
{
    const cdbm_frames *frames = search->frames;
    const cdbm_question *asked = search->asked;
    const cdbm_box box = frames->boxes[number];
    double *best = &query->bests[asked->is_each ? box.range : 0];
    double least = query->range_biases[box.range] + (box.kind >= 0 ? asked->kind_biases[box.kind] : search->least_kind), known = *best;
    float totals[CDBM_FRAMES], limit;
    uint32_t mask;
    if (box.kind >= 0 && !asked->allowed[box.kind]) return;
    if (asked->frame_biases) least += cdbm_least_of(asked->frame_biases + box.start, (size_t)box.size);
    if (bound > cdbm_limit(frames, cdbm_budget(known, least))) return;
    CDBM_COUNT(boxes);
    limit = cdbm_narrow_limit(frames, cdbm_budget(known, least), query->size);
    mask = frames->lanes.costs(frames->blocks + number * frames->n_features * CDBM_FRAMES, query->narrow, frames->narrow_weights,
        frames->n_features, limit, totals) & ((1U << box.size) - 1);
    while (mask) {
        size_t lane = cdbm_cheapest(mask, totals);
        int64_t frame = box.start + (int64_t)lane;
        mask &= ~(1U << lane);
        if (*best < known) limit = cdbm_narrow_limit(frames, cdbm_budget(known = *best, least), query->size);
        if (totals[lane] > limit || !cdbm_is_allowed(search, query, frame)) continue;
        CDBM_COUNT(frames);
        cdbm_keep(search, query, cdbm_cost(frames, number, lane, query->query) + cdbm_bias(search, query, number, frame), frame, box.range);
    }
}

/* Search the boxes of a group that may play, the nearest first. */
static void cdbm_search_group(const cdbm_search *search, cdbm_query *query, size_t group, uint32_t open)
{
    const cdbm_frames *frames = search->frames;
    size_t at = group * frames->n_pairs * 2 * CDBM_LANES;
    int32_t bounds[CDBM_LANES];
    uint32_t mask, lane;
    CDBM_COUNT(groups);
    mask = open & frames->lanes.bounds(frames->groups.lows + at, frames->groups.highs + at, query->levels, frames->n_pairs,
        query->limit, bounds);
    if (!mask) return;
    for (lane = cdbm_least_lane(mask, bounds);; lane = cdbm_lowest(mask)) {
        mask &= ~(1U << lane);
        if (bounds[lane] <= query->limit) cdbm_search_box(search, query, group * CDBM_LANES + lane, bounds[lane]);
        if (!mask) return;
    }
}

/* Whether some of the ranges `first` to `last` may play; where there is more to read at once, so may some next to them. */
CDBM_INLINE int cdbm_is_any(const uint8_t *ranges, size_t n_ranges, size_t first, size_t last)
{
    uint64_t any = 0, eight;
    for (; first <= last; first += first + sizeof eight <= n_ranges ? sizeof eight : 1) {
        eight = ranges[first];
        if (first + sizeof eight <= n_ranges) memcpy(&eight, ranges + first, sizeof eight);
        any |= eight;
    }
    return any != 0;
}

/* The boxes of each of a cluster's groups whose ranges may play; gives the groups that have such boxes. A bit each. */
CDBM_INLINE uint32_t cdbm_open(const cdbm_frames *frames, const uint8_t *ranges, size_t cluster, uint16_t *open)
{
    const cdbm_run *run = frames->runs + frames->cluster_runs[cluster], *end = frames->runs + frames->cluster_runs[cluster + 1];
    uint32_t groups = 0, lane;
    memset(open, 0, CDBM_LANES * sizeof *open);
    for (; run < end; run++) open[run->group] = (uint16_t)(open[run->group] | (run->boxes & (0U - (ranges[run->range] != 0))));
    for (lane = 0; lane < CDBM_LANES; lane++) groups |= (open[lane] ? 1U : 0U) << lane;
    return groups;
}

/* Search the groups of a cluster that may play, the nearest first. */
static void cdbm_search_cluster(const cdbm_search *search, cdbm_query *query, size_t cluster)
{
    const cdbm_frames *frames = search->frames;
    size_t at = cluster * frames->n_pairs * 2 * CDBM_LANES, first = cluster * CDBM_LANES;
    const int32_t *ranges = frames->cluster_ranges + 2 * cluster;
    int32_t bounds[CDBM_LANES];
    uint16_t open[CDBM_LANES];
    uint32_t mask, lane;
    if (!cdbm_is_any(query->ranges, frames->n_ranges, (size_t)ranges[0], (size_t)ranges[1])) return;
    if (!(mask = cdbm_open(frames, query->ranges, cluster, open))) return;
    CDBM_COUNT(clusters);
    mask &= frames->lanes.bounds(frames->clusters.lows + at, frames->clusters.highs + at, query->levels, frames->n_pairs, query->limit,
        bounds);
    if (!mask) return;
    for (lane = cdbm_least_lane(mask, bounds);; lane = cdbm_lowest(mask)) {
        mask &= ~(1U << lane);
        if (bounds[lane] <= query->limit) cdbm_search_group(search, query, first + lane, open[lane]);
        if (!mask) return;
    }
}

/* The least bias of the ranges that may play. */
static double cdbm_least_range(const cdbm_frames *frames, const uint8_t *ranges, const double *biases)
{
    double least = (double)INFINITY;
    size_t i;
    for (i = 0; i < frames->n_ranges; i++) {
        uint64_t eight = 1;
        if (i + 8 <= frames->n_ranges) memcpy(&eight, ranges + i, sizeof eight);
        if (!eight) i += 7;
        else if (ranges[i] && biases[i] < least) least = biases[i];
    }
    return least;
}

/* Normalise a query in float64; 0 when a number is NaN or too large to be compared. */
static int cdbm_normalise_exactly(const cdbm_frames *frames, const double *raw, double *query)
{
    size_t f;
    for (f = 0; f < frames->n_features; f++) {
        query[f] = (raw[f] - frames->offset[f]) / frames->scale[f];
        if (!(cdbm_size_of(query[f]) <= CDBM_GREATEST && cdbm_size_of(raw[f]) <= CDBM_GREATEST)) return 0;
    }
    return 1;
}

/* The same, and at the places of the layout in float32 and in levels. Gives its weighted square, or -1. */
static double cdbm_normalise(const cdbm_frames *frames, const double *raw, double *query, float *narrow, int16_t *levels)
{
    double size = 0.0;
    size_t f;
    if (!cdbm_normalise_exactly(frames, raw, query)) return -1.0;
    if (frames->n_pairs) levels[2 * frames->n_pairs - 1] = 0;
    for (f = 0; f < frames->n_features; f++) {
        double number = query[frames->order[f]];
        narrow[f] = (float)number;
        levels[f] = cdbm_level_of(frames, number, f);
        size += (double)frames->narrow_weights[f] * number * number;
    }
    return size;
}

/* Score the frame that would play on, if it may. */
static void cdbm_play_on(const cdbm_search *search, cdbm_query *query, int64_t current)
{
    const cdbm_frames *frames = search->frames;
    const cdbm_question *asked = search->asked;
    int64_t box = current >= 0 ? cdbm_box_of(frames, current) : -1;
    double total;
    if (box < 0 || !query->ranges[frames->boxes[box].range]) return;
    if (!asked->playable[frames->kinds ? frames->kinds[current] : 0] || (asked->flags && !asked->flags[current])) return;
    query->playing = current;
    total = cdbm_cost(frames, (size_t)box, (size_t)(current - frames->box_starts[box]), query->query)
        + (cdbm_bias(search, query, (size_t)box, current) + asked->continuing);
    cdbm_keep(search, query, total, current, frames->box_ranges[box]);
}

/* Search for a tile of queries, each prepared. */
static void cdbm_search_tile(const cdbm_search *search, cdbm_query *queries, size_t n)
{
    size_t i, at;
    for (at = 0; at < search->frames->n_clusters; at++)
        for (i = 0; i < n; i++) cdbm_search_cluster(search, &queries[i], at);
}

typedef struct cdbm_memory {        /* what a tile of n queries is searched with */
    cdbm_query *queries;
    double *normalised;
    float *narrow;
    int16_t *levels;
} cdbm_memory;

/* How many bytes of room a search for so many queries takes. */
static inline size_t cdbm_search_room(const cdbm_frames *frames, size_t n)
{
    size_t n_queries = n < CDBM_TILE ? n : CDBM_TILE, n_features = n_queries * frames->n_features;
    return cdbm_rounded(n_queries * sizeof(cdbm_query)) + cdbm_rounded(n_features * sizeof(double))
        + cdbm_rounded(n_features * sizeof(float)) + cdbm_rounded(n_queries * 2 * frames->n_pairs * sizeof(int16_t));
}

/* Memory for tiles of n queries; 0 where there is too little. */
static int cdbm_take(cdbm_memory *memory, const cdbm_frames *frames, size_t n, cdbm_room room)
{
    memory->queries = (cdbm_query *)cdbm_part(&room, n * sizeof(cdbm_query));
    memory->normalised = (double *)cdbm_part(&room, n * frames->n_features * sizeof(double));
    memory->narrow = (float *)cdbm_part(&room, n * frames->n_features * sizeof(float));
    memory->levels = (int16_t *)cdbm_part(&room, n * 2 * frames->n_pairs * sizeof(int16_t));
    return memory->queries && memory->normalised && memory->narrow && memory->levels;
}

/* Prepare query `number` of a question as the i-th of a tile; its hits are those of nothing. Whether it can be compared. */
static int cdbm_prepare(const cdbm_search *search, cdbm_memory *memory, const cdbm_hits *hits, size_t number, size_t i)
{
    const cdbm_frames *frames = search->frames;
    const cdbm_question *asked = search->asked;
    size_t n_slots = asked->is_each ? frames->n_ranges : 1, n_features = frames->n_features, at;
    double *normalised = memory->normalised + i * n_features;
    float *narrow = memory->narrow + i * n_features;
    int16_t *levels = memory->levels + i * 2 * frames->n_pairs;
    cdbm_query *query = &memory->queries[i];
    query->query = normalised;
    query->narrow = narrow;
    query->levels = levels;
    query->ranges = asked->ranges + (asked->is_one_mask ? 0 : number * frames->n_ranges);
    query->range_biases = asked->range_biases + (asked->are_same_biases ? 0 : number * frames->n_ranges);
    query->skips = asked->skip_stops ? asked->skips + 2 * asked->skip_stops[number] : NULL;
    query->n_skips = asked->skip_stops ? (size_t)(asked->skip_stops[number + 1] - asked->skip_stops[number]) : 0;
    query->playing = -1;
    query->bests = hits->totals + number;
    query->frames = hits->frames + number;
    query->range = hits->ranges + number;
    for (at = 0; at < n_slots; at++) {
        query->bests[at] = asked->within;
        query->frames[at] = -1;
    }
    *query->range = CDBM_REFUSED;
    query->size = cdbm_normalise(frames, asked->queries + number * n_features, normalised, narrow, levels);
    if (query->size < 0.0) return 0;
    *query->range = CDBM_NOTHING;
    query->least = search->least_kind + search->least_frame
        + (asked->are_same_biases ? search->least_range : cdbm_least_range(frames, query->ranges, query->range_biases));
    cdbm_set_budget(frames, query, asked->within);
    cdbm_play_on(search, query, asked->currents[number]);
    return 1;
}

/* Search for queries `start` to `stop` - 1 of a question. Each hit has the lowest total that is not above `within`, its frame and its
 * range; `within` and -1 where there is none. 0 where there is too little room, see cdbm_search_room. */
static inline int cdbm_search_frames(const cdbm_frames *frames, const cdbm_question *asked, size_t start, size_t stop, cdbm_hits *hits,
    cdbm_room room)
{
    cdbm_search search = {frames, asked, (double)INFINITY, 0.0, 0.0};
    cdbm_memory memory;
    size_t n = stop - start < CDBM_TILE ? stop - start : CDBM_TILE, i;
    if (!cdbm_take(&memory, frames, n, room)) return 0;
    for (i = 0; i < frames->n_kinds; i++)
        if (asked->allowed[i] && asked->kind_biases[i] < search.least_kind) search.least_kind = asked->kind_biases[i];
    if (asked->frame_biases) search.least_frame = cdbm_least_of(asked->frame_biases, frames->n_frames);
    if (asked->are_same_biases && asked->is_one_mask) search.least_range = cdbm_least_range(frames, asked->ranges, asked->range_biases);
    else if (asked->are_same_biases) search.least_range = cdbm_least_of(asked->range_biases, frames->n_ranges);
    while (start < stop) {
        for (i = 0; i < n && start < stop; start++) i += (size_t)cdbm_prepare(&search, &memory, hits, start, i);
        cdbm_search_tile(&search, memory.queries, i);
    }
    return 1;
}
