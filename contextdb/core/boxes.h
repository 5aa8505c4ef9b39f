/* ---- Boxes of contexts for coverage, and parts of them as bits. A box accepts of each of many factors a set of classes.
 *
 * Bit i % 64 of word i / 64 is box i of a part, whose m boxes take W = m / 64 words, rounded up. A part knows only the factors that
 * some of its boxes restrict; classes of weight 0 do not count. Where weights are whole numbers, sums of them are exact in whatever
 * order. Long loops look up from time to time, when somebody may stop them. */

#define CDBC_ALL (~(uint64_t)0)
#ifndef CDBC_TICKS
#define CDBC_TICKS ((size_t)1 << 21) /* words of bits between two looks: some milliseconds; a test looks more often */
#endif

typedef struct cdbc_boxes {
    const int32_t *cells;           /* [n_boxes][n_factors]: the number of a cell, or -1, which accepts everything */
    const int32_t *runs;            /* [n_runs][2]: a cell accepts the classes from the one number up to the other */
    const int64_t *first;           /* [n_cells + 1]: where the runs of each cell begin */
    const uint64_t *hashes;         /* [n_cells][2] */
    const int64_t *edges;           /* [n_factors + 1]: where the weights of each factor begin */
    size_t n_boxes, n_factors, n_cells, n_runs;
    size_t most_classes;            /* of one factor */
} cdbc_boxes;

typedef struct cdbc_watch {
    int (*look)(void *, int64_t);   /* is given what is done so far, and answers whether to stop */
    void *looker;
    size_t ticks;
    int is_stopped, has_no_memory;
} cdbc_watch;

typedef struct cdbc_block {         /* begins as zeros */
    char *memory;
    size_t bytes;
    int is_too_large;
} cdbc_block;

typedef struct cdbc_part {
    size_t n_words, n_boxes, n_factors;
    uint64_t *limits;               /* [L][W]: the boxes that restrict each factor */
    uint64_t *groups;               /* [G][W]: for each group of classes that the boxes cannot tell apart those that accept it */
    uint64_t *wider, *meets;        /* [S][W]: for each side of a box those that accept all that it accepts, and some of it */
    uint64_t *marks;                /* [S][2]: its hashes */
    double *masses, *sizes;         /* [G], [S]: what a group weighs; the share of the factor that a side accepts */
    int32_t *starts;                /* [L + 1]: where the groups of each factor begin */
    int32_t *factors;               /* [L]: its number */
    int32_t *sides;                 /* [L][m]: the number of the side of each box, or -1: it accepts everything */
    int32_t *boxes;                 /* [m]: the number of each box */
} cdbc_part;

typedef struct cdbc_stretch {       /* classes one after the other that the same boxes accept */
    int32_t group;                  /* or -1: they weigh nothing */
    double mass;
} cdbc_stretch;

typedef struct cdbc_desk {          /* what is needed while a part is made */
    const cdbc_boxes *boxes;
    cdbc_watch *watch;
    int64_t done;                   /* the work, for those who look */
    uint64_t *turns, *present;      /* [most classes + 1][W], 0 between two parts; [W] */
    cdbc_stretch *stretches;        /* [most classes] of a factor */
    int32_t *stretch_of;            /* [most classes + 1]: that of each class */
    int32_t *slots;                 /* [4 * most classes + 4]: groups by the hash of their boxes, or -1 */
    int32_t *side_of;               /* [n_cells], -1 between two parts */
    void *memory;
} cdbc_desk;

static inline uint64_t cdbc_mixed(uint64_t x)
{
    x ^= x >> 33;
    x *= 0xFF51AFD7ED558CCD;
    x ^= x >> 33;
    x *= 0xC4CEB9FE1A85EC53;
    return x ^ (x >> 33);
}

static inline size_t cdbc_words_of(size_t n_boxes)
{
    return n_boxes / 64 + (n_boxes % 64 != 0);
}

/* The bits of word w that are boxes. */
static inline uint64_t cdbc_boxes_in(size_t n_boxes, size_t w)
{
    return n_boxes - w * 64 >= 64 ? CDBC_ALL : ((uint64_t)1 << n_boxes % 64) - 1;
}

static inline int cdbc_has_bit(const uint64_t *words, size_t i)
{
    return (int)(words[i / 64] >> i % 64 & 1);
}

/* Take the lowest bit of a word off, and answer its number. */
static inline size_t cdbc_take_bit(uint64_t *word)
{
    size_t bit = cdbi_first_bit(*word);
    *word &= *word - 1;
    return bit;
}

static inline void cdbc_tick(cdbc_watch *watch, size_t n_words, int64_t done)
{
    watch->ticks += n_words;
    if (watch->ticks < CDBC_TICKS || watch->is_stopped) return;
    watch->ticks = 0;
    if (watch->look(watch->looker, done) != 0) watch->is_stopped = 1;
}

static inline int cdbc_is_over(const cdbc_watch *watch)
{
    return watch->is_stopped || watch->has_no_memory;
}

/* The next n * each items of a block of memory, from a multiple of 8 bytes on. A block is laid out twice, while `cdbc_take_block` says
 * so: first its bytes are counted, and all arrays are NULL, then they get their places. */
static inline void *cdbc_array(cdbc_block *block, size_t n, size_t each, size_t size)
{
    size_t at = block->bytes;
    if (n > 0 && each > 0 && each > (SIZE_MAX / 2 - at) / size / n) block->is_too_large = 1;
    else block->bytes += (n * each * size + 7) / 8 * 8;
    return block->memory ? block->memory + at : NULL;
}

static inline int cdbc_take_block(cdbc_watch *watch, cdbc_block *block)
{
    if (block->memory) return 0;
    block->memory = block->is_too_large ? NULL : (char *)CDB_MALLOC(block->bytes ? block->bytes : 1);
    block->bytes = 0;
    if (!block->memory) watch->has_no_memory = 1;
    return block->memory != NULL;
}

static inline size_t cdbc_n_classes(const cdbc_boxes *boxes, size_t factor)
{
    return (size_t)(boxes->edges[factor + 1] - boxes->edges[factor]);
}

/* ---- Taking boxes over */

static inline int cdbc_is_cell(const cdbc_boxes *boxes, size_t cell, size_t n_classes)
{
    int64_t i, from = 0;
    for (i = boxes->first[cell]; i < boxes->first[cell + 1]; i++) {
        if (boxes->runs[2 * i] < from || boxes->runs[2 * i + 1] < boxes->runs[2 * i]) return 0;
        from = boxes->runs[2 * i + 1];
    }
    return (size_t)from <= n_classes;
}

static inline int cdbc_are_steps(const int64_t *steps, size_t n, size_t last)
{
    size_t i;
    if (steps[0] != 0 || steps[n] < 0 || (uint64_t)steps[n] != last) return 0;
    for (i = 0; i < n; i++)
        if (steps[i + 1] < steps[i]) return 0;
    return 1;
}

/* Whether boxes over so many classes can be worked with; `factor_of` has room for a number for each cell. */
static inline int cdbc_are_boxes(cdbc_boxes *boxes, size_t n_classes, int32_t *factor_of)
{
    size_t i, f;
    if (boxes->n_boxes > INT32_MAX - 64 || boxes->n_factors > INT32_MAX - 1 || boxes->n_cells > INT32_MAX - 1
        || n_classes > INT32_MAX - 2 || !cdbc_are_steps(boxes->edges, boxes->n_factors, n_classes)
        || !cdbc_are_steps(boxes->first, boxes->n_cells, boxes->n_runs)) return 0;
    boxes->most_classes = 0;
    for (f = 0; f < boxes->n_factors; f++)
        if (cdbc_n_classes(boxes, f) > boxes->most_classes) boxes->most_classes = cdbc_n_classes(boxes, f);
    for (i = 0; i < boxes->n_cells; i++) factor_of[i] = -1;
    for (i = 0; i < boxes->n_boxes; i++)
        for (f = 0; f < boxes->n_factors; f++) {
            int32_t cell = boxes->cells[i * boxes->n_factors + f];
            if (cell == -1) continue;
            if (cell < 0 || (size_t)cell >= boxes->n_cells) return 0;
            if (factor_of[cell] < 0 && cdbc_is_cell(boxes, (size_t)cell, cdbc_n_classes(boxes, f))) factor_of[cell] = (int32_t)f;
            if (factor_of[cell] != (int32_t)f) return 0;
        }
    return 1;
}

/* ---- Making parts */

/* Make room to make parts of up to so many boxes. */
static inline int cdbc_set_desk(cdbc_desk *desk, const cdbc_boxes *boxes, size_t n_boxes, cdbc_watch *watch)
{
    size_t n_words = cdbc_words_of(n_boxes), most = boxes->most_classes, i;
    cdbc_block block = {NULL, 0, 0};
    desk->boxes = boxes;
    desk->watch = watch;
    do {
        desk->turns = (uint64_t *)cdbc_array(&block, most + 1, n_words, sizeof(uint64_t));
        desk->present = (uint64_t *)cdbc_array(&block, n_words, 1, sizeof(uint64_t));
        desk->stretches = (cdbc_stretch *)cdbc_array(&block, most, 1, sizeof(cdbc_stretch));
        desk->stretch_of = (int32_t *)cdbc_array(&block, most + 1, 1, sizeof(int32_t));
        desk->slots = (int32_t *)cdbc_array(&block, most + 1, 4, sizeof(int32_t));
        desk->side_of = (int32_t *)cdbc_array(&block, boxes->n_cells, 1, sizeof(int32_t));
    } while (cdbc_take_block(watch, &block));
    desk->memory = block.memory;
    if (!desk->memory) return 0;
    memset(desk->turns, 0, (most + 1) * n_words * sizeof(uint64_t));
    for (i = 0; i < boxes->n_cells; i++) desk->side_of[i] = -1;
    return 1;
}

/* How many groups of classes the boxes of a part can tell apart, at most. */
static inline size_t cdbc_most_groups(const cdbc_boxes *boxes, const int32_t *chosen, size_t n_boxes, size_t factor)
{
    size_t i, n = 1, most = cdbc_n_classes(boxes, factor);
    for (i = 0; i < n_boxes && n < most; i++) {
        int32_t cell = boxes->cells[(size_t)chosen[i] * boxes->n_factors + factor];
        if (cell >= 0) n += 2 * (size_t)(boxes->first[cell + 1] - boxes->first[cell]);
    }
    return n < most ? n : most;
}

/* Room for a part of some boxes and factors. */
static inline cdbc_part *cdbc_empty_part(const cdbc_desk *desk, const int32_t *chosen, size_t n_boxes, const int32_t *factors, size_t n)
{
    size_t n_words = cdbc_words_of(n_boxes), n_groups = 0, n_sides = desk->boxes->n_cells, x;
    cdbc_block block = {NULL, 0, 0};
    cdbc_part own, *part;
    for (x = 0; x < n; x++) n_groups += cdbc_most_groups(desk->boxes, chosen, n_boxes, (size_t)factors[x]);
    if (n == 0 || n_sides / n >= n_boxes) n_sides = n * n_boxes;
    own.n_words = n_words;
    own.n_boxes = n_boxes;
    own.n_factors = 0;
    do {
        part = (cdbc_part *)cdbc_array(&block, 1, 1, sizeof own);
        own.limits = (uint64_t *)cdbc_array(&block, n, n_words, sizeof(uint64_t));
        own.groups = (uint64_t *)cdbc_array(&block, n_groups, n_words, sizeof(uint64_t));
        own.wider = (uint64_t *)cdbc_array(&block, n_sides, n_words, sizeof(uint64_t));
        own.meets = (uint64_t *)cdbc_array(&block, n_sides, n_words, sizeof(uint64_t));
        own.marks = (uint64_t *)cdbc_array(&block, n_sides, 2, sizeof(uint64_t));
        own.masses = (double *)cdbc_array(&block, n_groups, 1, sizeof(double));
        own.sizes = (double *)cdbc_array(&block, n_sides, 1, sizeof(double));
        own.starts = (int32_t *)cdbc_array(&block, n + 1, 1, sizeof(int32_t));
        own.factors = (int32_t *)cdbc_array(&block, n, 1, sizeof(int32_t));
        own.sides = (int32_t *)cdbc_array(&block, n, n_boxes, sizeof(int32_t));
        own.boxes = (int32_t *)cdbc_array(&block, n_boxes, 1, sizeof(int32_t));
    } while (cdbc_take_block(desk->watch, &block));
    if (!part) return NULL;
    *part = own;
    memcpy(part->boxes, chosen, n_boxes * sizeof(int32_t));
    part->starts[0] = 0;
    return part;
}

static inline uint64_t cdbc_key_of(size_t box)
{
    return cdbc_mixed(box + 1);
}

/* Write down where boxes begin and end to accept the classes of a factor, and which accept everything; answer the hash of these. */
static inline uint64_t cdbc_find_turns(const cdbc_desk *desk, const cdbc_part *part, size_t factor)
{
    const cdbc_boxes *boxes = desk->boxes;
    size_t n_words = part->n_words, i;
    uint64_t key = 0;
    int64_t r;
    memset(desk->present, 0, n_words * sizeof(uint64_t));
    for (i = 0; i < part->n_boxes; i++) {
        int32_t cell = boxes->cells[(size_t)part->boxes[i] * boxes->n_factors + factor];
        uint64_t bit = (uint64_t)1 << i % 64;
        if (cell < 0) {
            desk->present[i / 64] |= bit;
            key ^= cdbc_key_of(i);
        } else
            for (r = boxes->first[cell]; r < boxes->first[cell + 1]; r++) {
                desk->turns[(size_t)boxes->runs[2 * r] * n_words + i / 64] ^= bit;
                desk->turns[(size_t)boxes->runs[2 * r + 1] * n_words + i / 64] ^= bit;
            }
    }
    return key;
}

/* Turn to the next class: change who is present, and the hash. Answers whether anything changed. */
static inline int cdbc_turn(const cdbc_desk *desk, size_t n_words, size_t k, uint64_t *key)
{
    uint64_t *turn = desk->turns + k * n_words, some = 0;
    size_t w;
    for (w = 0; w < n_words; w++) {
        uint64_t rest = turn[w];
        if (!rest) continue;
        some = 1;
        desk->present[w] ^= rest;
        turn[w] = 0;
        while (rest) *key ^= cdbc_key_of(w * 64 + cdbc_take_bit(&rest));
    }
    return some != 0;
}

/* Which group the boxes that are present make: one from `start` on, a new one where it is not among them. */
static inline size_t cdbc_group_of(const cdbc_desk *desk, cdbc_part *part, size_t start, size_t *stop, uint64_t key, size_t last)
{
    size_t n_words = part->n_words, at = (size_t)key & last;
    for (; desk->slots[at] >= 0; at = (at + 1) & last)
        if (memcmp(part->groups + (start + (size_t)desk->slots[at]) * n_words, desk->present, n_words * sizeof(uint64_t)) == 0)
            return start + (size_t)desk->slots[at];
    desk->slots[at] = (int32_t)(*stop - start);
    memcpy(part->groups + *stop * n_words, desk->present, n_words * sizeof(uint64_t));
    part->masses[*stop] = 0.0;
    return (*stop)++;
}

/* Write the groups of classes of a factor from `start` on, at most so many, and answer where they end. */
static inline size_t cdbc_add_groups(const cdbc_desk *desk, cdbc_part *part, size_t factor, const double *weights, size_t start,
    size_t most)
{
    size_t n_words = part->n_words, n_classes = cdbc_n_classes(desk->boxes, factor), stop = start, n_slots = 1, n = 0, k;
    uint64_t key = cdbc_find_turns(desk, part, factor);
    cdbc_stretch *stretch = NULL;
    while (n_slots < 2 * most) n_slots *= 2;
    for (k = 0; k < n_slots; k++) desk->slots[k] = -1;
    weights += desk->boxes->edges[factor];
    for (k = 0; k < n_classes; k++) {
        if (cdbc_turn(desk, n_words, k, &key) || !stretch) {
            stretch = &desk->stretches[n++];
            stretch->group = -1;
            stretch->mass = 0.0;
        }
        desk->stretch_of[k] = (int32_t)(n - 1);
        if (weights[k] == 0.0) continue;
        if (stretch->group < 0) {
            stretch->group = (int32_t)cdbc_group_of(desk, part, start, &stop, key, n_slots - 1);
            cdbc_tick(desk->watch, n_words + 8, desk->done);
        }
        stretch->mass += weights[k];
        part->masses[stretch->group] += weights[k];
    }
    desk->stretch_of[n_classes] = (int32_t)n;
    memset(desk->turns + n_classes * n_words, 0, n_words * sizeof(uint64_t));
    return stop;
}

/* Write which boxes do not accept every group, and answer whether there are any. */
static inline int cdbc_set_limits(cdbc_part *part, uint64_t *limits, size_t start, size_t stop)
{
    size_t n_words = part->n_words, g, w;
    uint64_t some = 0;
    for (w = 0; w < n_words; w++) limits[w] = CDBC_ALL;
    for (g = start; g < stop; g++)
        for (w = 0; w < n_words; w++) limits[w] &= part->groups[g * n_words + w];
    for (w = 0; w < n_words; w++) some |= limits[w] = ~limits[w] & cdbc_boxes_in(part->n_boxes, w);
    return some != 0;
}

/* Write the size of a side, which is that of a cell, and the boxes that accept all of it, and some of it. */
static inline void cdbc_add_side(const cdbc_desk *desk, cdbc_part *part, size_t cell, size_t side, double total)
{
    const cdbc_boxes *boxes = desk->boxes;
    size_t n_words = part->n_words, w;
    uint64_t *wider = part->wider + side * n_words, *meets = part->meets + side * n_words;
    double size = 0.0;
    int64_t r;
    for (w = 0; w < n_words; w++) {
        wider[w] = CDBC_ALL;
        meets[w] = 0;
    }
    for (r = boxes->first[cell]; r < boxes->first[cell + 1]; r++) {
        int32_t at = desk->stretch_of[boxes->runs[2 * r]], stop = desk->stretch_of[boxes->runs[2 * r + 1]];
        cdbc_tick(desk->watch, (size_t)(stop - at + 1) * n_words, desk->done);
        for (; at < stop; at++) {
            const cdbc_stretch *stretch = &desk->stretches[at];
            const uint64_t *group = part->groups + (stretch->group < 0 ? 0 : (size_t)stretch->group * n_words);
            if (stretch->group < 0) continue;
            size += stretch->mass;
            for (w = 0; w < n_words; w++) {
                wider[w] &= group[w];
                meets[w] |= group[w];
            }
        }
    }
    part->sizes[side] = size / total;
}

/* Number the different cells of the boxes that restrict a factor, from n_sides on, and answer how many there are by then. */
static inline size_t cdbc_add_sides(const cdbc_desk *desk, cdbc_part *part, size_t factor, uint64_t salt, size_t stop, size_t n_sides)
{
    const cdbc_boxes *boxes = desk->boxes;
    const uint64_t *limits = part->limits + part->n_factors * part->n_words;
    int32_t *sides = part->sides + part->n_factors * part->n_boxes;
    size_t i, g;
    double total = 0.0;
    for (g = (size_t)part->starts[part->n_factors]; g < stop; g++) total += part->masses[g];
    for (i = 0; i < part->n_boxes; i++) {
        int32_t cell = boxes->cells[(size_t)part->boxes[i] * boxes->n_factors + factor];
        sides[i] = -1;
        if (!cdbc_has_bit(limits, i)) continue;
        if (desk->side_of[cell] < 0) {
            cdbc_add_side(desk, part, (size_t)cell, n_sides, total);
            part->marks[2 * n_sides] = cdbc_mixed(boxes->hashes[2 * cell] ^ salt);
            part->marks[2 * n_sides + 1] = cdbc_mixed(boxes->hashes[2 * cell + 1] + salt);
            desk->side_of[cell] = (int32_t)n_sides++;
        }
        sides[i] = desk->side_of[cell];
    }
    for (i = 0; i < part->n_boxes; i++)
        if (sides[i] >= 0) desk->side_of[boxes->cells[(size_t)part->boxes[i] * boxes->n_factors + factor]] = -1;
    return n_sides;
}

/* The part of some boxes over some factors, which the caller frees; NULL where it was stopped, or memory is missing. `salts` tell
 * factors apart whose classes were weighed otherwise. */
static inline cdbc_part *cdbc_part_of(const cdbc_desk *desk, const int32_t *chosen, size_t n_boxes, const int32_t *factors, size_t n,
    const double *weights, const uint64_t *salts)
{
    cdbc_part *part = cdbc_empty_part(desk, chosen, n_boxes, factors, n);
    size_t n_sides = 0, x;
    for (x = 0; part && x < n && !cdbc_is_over(desk->watch); x++) {
        size_t factor = (size_t)factors[x], start = (size_t)part->starts[part->n_factors];
        size_t most = cdbc_most_groups(desk->boxes, chosen, n_boxes, factor);
        size_t stop = cdbc_add_groups(desk, part, factor, weights, start, most);
        cdbc_tick(desk->watch, n_boxes + (cdbc_n_classes(desk->boxes, factor) + stop - start) * part->n_words, desk->done);
        if (!cdbc_set_limits(part, part->limits + part->n_factors * part->n_words, start, stop)) continue;
        n_sides = cdbc_add_sides(desk, part, factor, salts[factor], stop, n_sides);
        part->factors[part->n_factors++] = (int32_t)factor;
        part->starts[part->n_factors] = (int32_t)stop;
    }
    if (part && cdbc_is_over(desk->watch)) {
        CDB_FREE(part);
        return NULL;
    }
    return part;
}
