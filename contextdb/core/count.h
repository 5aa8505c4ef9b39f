/* ---- Counting contexts for coverage: which share of all contexts no box holds, and whether any is left.
 *
 * A part with some of its boxes open is solved in one of four ways. Boxes that share no factor are independent: their shares
 * multiply. Where boxes are small, one box after the other is taken, the largest first, and what it alone holds is the share that
 * the boxes before it leave open within it. Else one factor is fixed, to each group of classes in turn. A part of few boxes is made
 * again, in fewer words. Parts that are alike, by 128-bit hashes of what is left of their boxes, are worked out once. The search for
 * any context fixes factors until one is found. What is open lies on a stack of its own, so that C's is not needed.
 *
 * Work is counted in steps, never in time: the same boxes give the same numbers everywhere. All sums have a fixed order.
 *
 * Source: counting by decomposition and caching as in #DPLL (Bacchus, Dalmao and Pitassi, "Algorithms and complexity results for
 * #SAT and Bayesian inference", FOCS 2003), with boxes of many-valued factors for clauses; one box after the other is how sums of
 * disjoint products are formed (Abraham, "An improved algorithm for network reliability", IEEE Transactions on Reliability 28, 1979). */

#define CDBC_PROBES 4
#define CDBC_MOST_KNOWN ((size_t)1 << 20) /* so many parts are remembered at most; 32 bytes each */
#define CDBC_PER_NODE 16
#define CDBC_FEW 6                  /* boxes are taken one after the other from so many on: where they are small, */
#define CDBC_MANY 16                /* and where they are not */
#define CDBC_SMALL_SUM 0.9          /* boxes whose measures sum to no more are small: no rounding can make the share that is left 0 */
#define CDBC_DENSE 16               /* a part is made again when it has so many boxes a word, or fewer */
#define CDBC_MOST_DEPTH 1000
#define CDBC_ROOM 4                 /* a part that lies less above the deepest level is cut short */
#define CDBC_LEAST_DEPTH 160        /* boxes are taken one after the other so deep; where factors are few further down */
#define CDBC_SAME 1e-11             /* bounds that differ by less come from rounding */
#define CDBC_EPSILON 2.3e-16
#define CDBC_LAST_FACTOR 1e9        /* a search fixes a factor first that is the last one of some box */

typedef struct cdbc_known {         /* bounds of a part that was worked out; the first key is not 0 */
    uint64_t keys[2];
    double low, high;
} cdbc_known;

typedef struct cdbc_item {          /* a box or a group to be tried, and its share */
    uint64_t key;
    double share;
    int32_t of;
} cdbc_item;

typedef enum cdbc_way { CDBC_NEW, CDBC_SOLVED, CDBC_PRODUCT, CDBC_ONE_BY_ONE, CDBC_AGAIN, CDBC_FIXED } cdbc_way;

typedef struct cdbc_node {          /* a part with some of its boxes open */
    struct cdbc_node *parent;
    cdbc_part *own;                 /* its part, where that is its own, else NULL */
    const cdbc_part *part;
    const double *weights;
    const uint64_t *salts;
    uint64_t *opened, *kept;        /* [W]: the open boxes; of a product the first of the two sets */
    int32_t *listed;                /* [n]: the factors that some open box restricts */
    size_t n, m, depth;             /* m: the open boxes */
    cdbc_way way;
    size_t slot;                    /* where its bounds are remembered, by which keys */
    uint64_t keys[2];
    double low, high;               /* bounds that are known; of a search 0, and where some context is left 1 */
    double sum_low, sum_high;       /* what came out of those that were tried */
    cdbc_item *items;               /* what is tried: boxes, or groups */
    size_t n_items, at, n_zeros;    /* of the groups that were tried, the first items, n_zeros left nothing open */
    int64_t limit;                  /* of the work, outside the present item */
    uint64_t *before, *salted;      /* [W], [F]: the boxes that were taken; the salts within the present one */
    double *inside;                 /* the weights within it */
    void *memory;                   /* of the items and the last three */
} cdbc_node;

typedef struct cdbc_count {
    const cdbc_boxes *boxes;
    cdbc_watch watch;
    cdbc_desk desk;
    int64_t work, limit, n_cut;     /* steps done and allowed, parts that were cut short */
    int is_shared;                  /* whether every box gets its share of the steps that are left, where else the first may take them */
    int is_search;                  /* whether any context is enough */
    size_t most_depth, alone_depth;
    cdbc_part *part;
    cdbc_known *known;              /* [last_known + 1], a power of two */
    size_t last_known;
    uint64_t *once, *twice;         /* [W]: the boxes that restrict a factor, and two */
    uint64_t *hashes;               /* [m][2] */
    double *volumes;                /* [m] */
    double *logs;                   /* [most classes + 2]: logarithms that were needed, else 0 */
    int32_t *numbers, *factors;     /* [m], [F]: what a part is to be made of */
    const double *weights;
    uint64_t *salts;                /* [F] zeros */
    void *memory;
} cdbc_count;

static inline size_t cdbc_count_all(const uint64_t *words, size_t n_words)
{
    size_t n = 0, w;
    for (w = 0; w < n_words; w++) n += (size_t)cdbi_count_bits(words[w]);
    return n;
}

/* The logarithm to base 2 of a whole number from 1 up, bit by bit: libraries round it otherwise. */
static inline double cdbc_log2(uint64_t number)
{
    uint64_t x = number, bits = 63;
    int i;
    for (; !(x >> 63); bits--) x <<= 1;
    for (i = 0; i < 58; i++) {      /* x in units of 2^-63 is from 1 to 2; squared, its logarithm is twice as large */
        uint64_t high = x >> 32, low = x & 0xFFFFFFFF, middle = high * low;
        uint64_t sum = low * low + (middle << 33), top = high * high + (middle >> 31) + (sum < low * low);
        bits = bits << 1 | top >> 63;
        x = top >> 63 ? top : top << 1 | sum >> 63;
    }
    return (double)bits / 288230376151711744.0;
}

/* Sort items by key, equal ones in their order; `other` has room for as many. */
static inline void cdbc_sort(cdbc_item *items, cdbc_item *other, size_t n)
{
    cdbc_item *from = items, *to = other, *next;
    size_t width, start;
    for (width = 1; width < n; width *= 2) {
        for (start = 0; start < n; start += 2 * width) {
            size_t middle = n - start < width ? n : start + width, stop = n - middle < width ? n : middle + width;
            size_t a = start, b = middle, at;
            for (at = start; at < stop; at++) to[at] = b == stop || (a < middle && from[a].key <= from[b].key) ? from[a++] : from[b++];
        }
        next = from;
        from = to;
        to = next;
    }
    if (from != items) memcpy(items, from, n * sizeof(cdbc_item));
}

/* ---- What is open of a part */

/* List the factors that open boxes restrict, and which boxes restrict one, and two; 0 where a box restricts none. */
static inline int cdbc_list_factors(cdbc_count *count, cdbc_node *node)
{
    size_t n_words = node->part->n_words, n = 0, x, w;
    memset(count->once, 0, n_words * sizeof(uint64_t));
    memset(count->twice, 0, n_words * sizeof(uint64_t));
    for (x = 0; x < node->n; x++) {
        const uint64_t *limits = node->part->limits + (size_t)node->listed[x] * n_words;
        uint64_t some = 0;
        for (w = 0; w < n_words; w++) {
            uint64_t limited = limits[w] & node->opened[w];
            some |= limited;
            count->twice[w] |= count->once[w] & limited;
            count->once[w] |= limited;
        }
        if (some) node->listed[n++] = node->listed[x];
    }
    node->n = n;
    for (w = 0; w < n_words; w++)
        if (node->opened[w] & ~count->once[w]) return 0;
    return 1;
}

/* Whether an open box lies within others; `over` is room for a set. */
static inline int cdbc_is_inner(const cdbc_node *node, size_t i, uint64_t *over)
{
    const cdbc_part *part = node->part;
    size_t n_words = part->n_words, x, w;
    memcpy(over, node->opened, n_words * sizeof(uint64_t));
    over[i / 64] ^= (uint64_t)1 << i % 64;
    for (x = 0; x < node->n; x++) {
        size_t factor = (size_t)node->listed[x];
        int32_t side = part->sides[factor * part->n_boxes + i];
        const uint64_t *words = side < 0 ? part->limits + factor * n_words : part->wider + (size_t)side * n_words;
        uint64_t some = 0, flip = side < 0 ? CDBC_ALL : 0;
        for (w = 0; w < n_words; w++) some |= over[w] &= words[w] ^ flip;
        if (!some) return 0;
    }
    return 1;
}

/* Close the boxes that lie within others, and list the factors again; of equal boxes the last stays open. */
static inline void cdbc_drop_inner(cdbc_count *count, cdbc_node *node)
{
    size_t n_words = node->part->n_words, w, n_dropped = 0;
    for (w = 0; w < n_words && !cdbc_is_over(&count->watch); w++) {
        uint64_t rest = node->opened[w];
        cdbc_tick(&count->watch, node->n * n_words * 16, count->work);
        while (rest) {
            size_t bit = cdbc_take_bit(&rest);
            if (!cdbc_is_inner(node, w * 64 + bit, count->once)) continue;
            node->opened[w] ^= (uint64_t)1 << bit;
            n_dropped++;
        }
    }
    if (n_dropped > 0) cdbc_list_factors(count, node);
    node->m -= n_dropped;
}

/* Hashes of what is left of the open boxes, together; the sum of their measures, and the largest. */
static inline void cdbc_measure(cdbc_count *count, const cdbc_node *node, uint64_t keys[2], double *total, double *largest)
{
    const cdbc_part *part = node->part;
    uint64_t *hashes = count->hashes, rest;
    double *volumes = count->volumes;
    size_t n_words = part->n_words, i, x, w;
    for (w = 0; w < n_words; w++)
        for (rest = node->opened[w]; rest;) {
            i = w * 64 + cdbc_take_bit(&rest);
            hashes[2 * i] = hashes[2 * i + 1] = 0;
            volumes[i] = 1.0;
        }
    for (x = 0; x < node->n; x++) {
        size_t factor = (size_t)node->listed[x];
        for (w = 0; w < n_words; w++)
            for (rest = part->limits[factor * n_words + w] & node->opened[w]; rest;) {
                size_t side;
                i = w * 64 + cdbc_take_bit(&rest);
                side = (size_t)part->sides[factor * part->n_boxes + i];
                hashes[2 * i] ^= part->marks[2 * side];
                hashes[2 * i + 1] ^= part->marks[2 * side + 1];
                volumes[i] *= part->sizes[side];
            }
    }
    keys[0] = keys[1] = 0;
    *total = *largest = 0.0;
    for (w = 0; w < n_words; w++)
        for (rest = node->opened[w]; rest;) {
            i = w * 64 + cdbc_take_bit(&rest);
            keys[0] += cdbc_mixed(hashes[2 * i]);
            keys[1] += cdbc_mixed(hashes[2 * i + 1] ^ 0x9E3779B97F4A7C15);
            *total += volumes[i];
            if (volumes[i] > *largest) *largest = volumes[i];
        }
    keys[0] |= 1;
}

/* Keep the open boxes that hang together with the first factor's; answer whether there are others. */
static inline int cdbc_split(cdbc_node *node)
{
    size_t n_words = node->part->n_words, x, w;
    const uint64_t *limits = node->part->limits, *opened = node->opened;
    int grows = 1;
    for (w = 0; w < n_words; w++) node->kept[w] = limits[(size_t)node->listed[0] * n_words + w] & opened[w];
    while (grows) {
        grows = 0;
        for (x = 1; x < node->n; x++) {
            const uint64_t *own = limits + (size_t)node->listed[x] * n_words;
            uint64_t inside = 0, outside = 0;
            for (w = 0; w < n_words; w++) {
                inside |= own[w] & opened[w] & node->kept[w];
                outside |= own[w] & opened[w] & ~node->kept[w];
            }
            if (!inside || !outside) continue;
            grows = 1;
            for (w = 0; w < n_words; w++) node->kept[w] |= own[w] & opened[w];
        }
    }
    return memcmp(node->kept, opened, n_words * sizeof(uint64_t)) != 0;
}

/* Where a part is remembered, or may be, and whether it is. */
static inline int cdbc_find_known(const cdbc_count *count, const uint64_t keys[2], size_t *slot)
{
    size_t last = count->last_known, home = (size_t)(keys[0] >> 1) & last, at = home, i;
    *slot = home;
    for (i = 0; i < CDBC_PROBES; i++) {
        const cdbc_known *known = &count->known[at];
        if (known->keys[0] == keys[0] && known->keys[1] == keys[1]) {
            *slot = at;
            return 1;
        }
        if (known->keys[0] == 0) {
            *slot = at;
            return 0;
        }
        at = (at + 1) & last;
    }
    return 0;
}

/* ---- The factor that is fixed */

/* The place of the factor that most boxes restrict, fewer where it has more groups; in a search one that is the last of a box. */
static inline size_t cdbc_best_factor(cdbc_count *count, const cdbc_node *node)
{
    const cdbc_part *part = node->part;
    size_t n_words = part->n_words, best = 0, x, w;
    double most = -1.0;
    for (x = 0; x < node->n; x++) {
        size_t factor = (size_t)node->listed[x], n_limited = 0, n_groups = (size_t)(part->starts[factor + 1] - part->starts[factor]);
        uint64_t last = 0;
        double score;
        for (w = 0; w < n_words; w++) {
            uint64_t limited = part->limits[factor * n_words + w] & node->opened[w];
            n_limited += (size_t)cdbi_count_bits(limited);
            last |= limited & ~count->twice[w];
        }
        if (n_limited + 1 < n_groups) n_groups = n_limited + 1;
        if (count->logs[n_groups] == 0.0) count->logs[n_groups] = cdbc_log2(1 + n_groups);
        score = (double)n_limited / count->logs[n_groups] + (count->is_search && last ? CDBC_LAST_FACTOR : 0.0);
        if (score > most) {
            best = x;
            most = score;
        }
    }
    return best;
}

/* The item among those of a factor that the open boxes cannot tell from a group, by the slots of their hashes; n_items where there is
 * none, which gets a slot. */
static inline size_t cdbc_same_item(const cdbc_node *node, const uint64_t *group, int32_t *slots, size_t last)
{
    const cdbc_part *part = node->part;
    uint64_t key = 0, differs = 1;
    size_t at, w;
    for (w = 0; w < part->n_words; w++) key = cdbc_mixed(key ^ (group[w] & node->opened[w]));
    for (at = (size_t)key & last; slots[at] >= 0; at = (at + 1) & last) {
        const uint64_t *other = part->groups + (size_t)node->items[slots[at]].of * part->n_words;
        for (differs = 0, w = 0; w < part->n_words && !differs; w++) differs = (group[w] ^ other[w]) & node->opened[w];
        if (!differs) return (size_t)slots[at];
    }
    slots[at] = (int32_t)node->n_items;
    return node->n_items;
}

/* Strike the best factor off, and list its groups as the open boxes tell them apart, those that fewest accept first, but for those
 * that leave nothing open. Answers how many. */
static inline size_t cdbc_choose(cdbc_count *count, cdbc_node *node)
{
    const cdbc_part *part = node->part;
    size_t best = cdbc_best_factor(count, node), factor = (size_t)node->listed[best], n_words = part->n_words, g, w;
    size_t start = (size_t)part->starts[factor], stop = (size_t)part->starts[factor + 1], n_slots = 1;
    cdbc_block block = {NULL, 0, 0};
    int32_t *slots;
    double total = 0.0;
    node->n--;                      /* the others stay in their order, in which sizes are multiplied */
    memmove(node->listed + best, node->listed + best + 1, (node->n - best) * sizeof(int32_t));
    while (n_slots < 2 * (stop - start)) n_slots *= 2;
    do {
        node->items = (cdbc_item *)cdbc_array(&block, stop - start, 2, sizeof(cdbc_item));
        slots = (int32_t *)cdbc_array(&block, n_slots, 1, sizeof(int32_t));
    } while (cdbc_take_block(&count->watch, &block));
    node->memory = block.memory;
    if (!node->memory) return 0;
    for (g = 0; g < n_slots; g++) slots[g] = -1;
    for (w = 0; w < n_words; w++)   /* boxes that restrict only this factor */
        count->once[w] = part->limits[factor * n_words + w] & node->opened[w] & ~count->twice[w];
    for (g = start; g < stop; g++) {
        const uint64_t *group = part->groups + g * n_words;
        uint64_t covered = 0;
        size_t at;
        total += part->masses[g];
        for (w = 0; w < n_words; w++) covered |= group[w] & count->once[w];
        if (covered) continue;
        at = cdbc_same_item(node, group, slots, n_slots - 1);
        if (at == node->n_items) {
            cdbc_item item = {0, 0.0, (int32_t)g};
            for (w = 0; w < n_words; w++) item.key += cdbi_count_bits(group[w] & node->opened[w]);
            node->items[node->n_items++] = item;
        }
        node->items[at].share += part->masses[g];
    }
    cdbc_tick(&count->watch, 4 * (stop - start) * n_words, count->work);
    for (g = 0; g < node->n_items; g++) node->items[g].share /= total;
    cdbc_sort(node->items, node->items + (stop - start), node->n_items);
    return node->n_items;
}

/* Whether the open boxes that accept a group are all that accept one that left nothing open, and more. */
static inline int cdbc_holds_zero(const cdbc_node *node, const uint64_t *group)
{
    size_t n_words = node->part->n_words, i, w;
    for (i = 0; i < node->n_zeros; i++) {
        const uint64_t *zero = node->part->groups + (size_t)node->items[i].of * n_words;
        uint64_t missing = 0;
        for (w = 0; w < n_words && !missing; w++) missing = zero[w] & ~group[w] & node->opened[w];
        if (!missing) return 1;
    }
    return 0;
}

/* ---- One box after the other */

/* List the open boxes, the largest first; of equal ones the first comes first. */
static inline void cdbc_list_boxes(cdbc_count *count, cdbc_node *node)
{
    size_t n_words = node->part->n_words, n_factors = count->boxes->n_factors, w;
    cdbc_block block = {NULL, 0, 0};
    uint64_t rest;
    do {
        node->items = (cdbc_item *)cdbc_array(&block, node->m, 2, sizeof(cdbc_item));
        node->before = (uint64_t *)cdbc_array(&block, n_words, 1, sizeof(uint64_t));
        node->salted = (uint64_t *)cdbc_array(&block, n_factors, 1, sizeof(uint64_t));
        node->inside = (double *)cdbc_array(&block, (size_t)count->boxes->edges[n_factors], 1, sizeof(double));
    } while (cdbc_take_block(&count->watch, &block));
    node->memory = block.memory;
    if (!node->memory) return;
    memset(node->before, 0, n_words * sizeof(uint64_t));
    for (w = 0; w < n_words; w++)
        for (rest = node->opened[w]; rest;) {
            size_t i = w * 64 + cdbc_take_bit(&rest);
            cdbc_item item = {0, 0.0, (int32_t)i};
            item.share = count->volumes[i];
            item.key = ~cdbi_bits(item.share);
            node->items[node->n_items++] = item;
        }
    cdbc_sort(node->items, node->items + node->m, node->m);
}

/* Write the numbers of some boxes of a part, and answer how many they are. */
static inline size_t cdbc_write_numbers(cdbc_count *count, const cdbc_part *part, const uint64_t *words)
{
    size_t n = 0, w;
    uint64_t rest;
    for (w = 0; w < part->n_words; w++)
        for (rest = words[w]; rest;) count->numbers[n++] = part->boxes[w * 64 + cdbc_take_bit(&rest)];
    return n;
}

/* Write the numbers of the boxes that were taken and share a context with box i; answer how many they are. */
static inline size_t cdbc_met_before(cdbc_count *count, const cdbc_node *node, size_t i)
{
    const cdbc_part *part = node->part;
    size_t n_words = part->n_words, x, w;
    uint64_t *met = count->twice;
    memcpy(met, node->before, n_words * sizeof(uint64_t));
    cdbc_tick(&count->watch, node->n * n_words, count->work);
    for (x = 0; x < node->n; x++) {
        int32_t side = part->sides[(size_t)node->listed[x] * part->n_boxes + i];
        if (side < 0) continue;
        for (w = 0; w < n_words; w++) met[w] &= part->meets[(size_t)side * n_words + w];
    }
    return cdbc_write_numbers(count, part, met);
}

/* Write the weights of classes within box i, and the salts of the factors that it restricts; of others only what is needed. */
static inline void cdbc_go_inside(cdbc_count *count, cdbc_node *node, size_t i)
{
    const cdbc_boxes *boxes = count->boxes;
    const cdbc_part *part = node->part;
    size_t x;
    for (x = 0; x < node->n; x++) {
        size_t own = (size_t)node->listed[x], factor = (size_t)part->factors[own], n = cdbc_n_classes(boxes, factor), k = 0;
        double *inside = node->inside + boxes->edges[factor];
        int32_t cell = boxes->cells[(size_t)part->boxes[i] * boxes->n_factors + factor];
        int64_t r;
        memcpy(inside, node->weights + boxes->edges[factor], n * sizeof(double));
        node->salted[factor] = node->salts[factor];
        if (part->sides[own * part->n_boxes + i] < 0) continue;
        for (r = boxes->first[cell]; r < boxes->first[cell + 1]; r++) {
            for (; k < (size_t)boxes->runs[2 * r]; k++) inside[k] = 0.0;
            k = (size_t)boxes->runs[2 * r + 1];
        }
        for (; k < n; k++) inside[k] = 0.0;
        node->salted[factor] += cdbc_mixed(boxes->hashes[2 * cell]);
    }
}

/* ---- Nodes */

/* A node of some factors of a part, whose open boxes the caller writes; NULL without memory. */
static inline cdbc_node *cdbc_new_node(cdbc_count *count, cdbc_node *parent, const cdbc_part *part, const int32_t *listed, size_t n)
{
    cdbc_block block = {NULL, 0, 0};
    cdbc_node *node, own;
    memset(&own, 0, sizeof own);
    do {
        node = (cdbc_node *)cdbc_array(&block, 1, 1, sizeof own);
        own.opened = (uint64_t *)cdbc_array(&block, part->n_words, 1, sizeof(uint64_t));
        own.kept = (uint64_t *)cdbc_array(&block, part->n_words, 1, sizeof(uint64_t));
        own.listed = (int32_t *)cdbc_array(&block, n, 1, sizeof(int32_t));
    } while (cdbc_take_block(&count->watch, &block));
    if (!node) return NULL;
    *node = own;
    node->parent = parent;
    node->part = part;
    node->n = n;
    if (listed) memcpy(node->listed, listed, n * sizeof(int32_t));
    if (parent) {
        node->weights = parent->weights;
        node->salts = parent->salts;
        node->depth = parent->depth + 1;
    }
    return node;
}

/* Open all boxes of a node's part, and list all its factors. */
static inline void cdbc_open_all(cdbc_node *node)
{
    size_t x, w;
    for (w = 0; w < node->part->n_words; w++) node->opened[w] = cdbc_boxes_in(node->part->n_boxes, w);
    for (x = 0; x < node->part->n_factors; x++) node->listed[x] = (int32_t)x;
}

/* A node of some boxes, by number, over its parent's factors, in as few words as they need. */
static inline cdbc_node *cdbc_less_node(cdbc_count *count, cdbc_node *parent, size_t n_boxes, const double *weights, const uint64_t *salts)
{
    cdbc_part *part;
    cdbc_node *node;
    size_t x;
    for (x = 0; x < parent->n; x++) count->factors[x] = parent->part->factors[parent->listed[x]];
    count->desk.done = count->work;
    part = cdbc_part_of(&count->desk, count->numbers, n_boxes, count->factors, parent->n, weights, salts);
    node = part ? cdbc_new_node(count, parent, part, NULL, part->n_factors) : NULL;
    if (!node) {
        CDB_FREE(part);
        return NULL;
    }
    cdbc_open_all(node);
    node->own = part;
    node->weights = weights;
    node->salts = salts;
    node->depth = parent->depth + 2;
    return node;
}

static inline cdbc_node *cdbc_free_node(cdbc_node *node)
{
    cdbc_node *parent = node->parent;
    CDB_FREE(node->own);
    CDB_FREE(node->memory);
    CDB_FREE(node);
    return parent;
}

static inline void cdbc_settle(cdbc_node *node, double low, double high)
{
    node->way = CDBC_SOLVED;
    node->low = low;
    node->high = high;
}

/* List the factors of a new node, and count its boxes; 0 where that settles it. */
static inline int cdbc_has_some(cdbc_count *count, cdbc_node *node)
{
    size_t n_words = node->part->n_words;
    count->work += 2 + (int64_t)(node->n * n_words >> 4);
    cdbc_tick(&count->watch, 16 + 4 * node->n * n_words, count->work);
    if (!cdbc_list_factors(count, node)) {
        cdbc_settle(node, 0.0, 0.0);
        return 0;
    }
    node->m = cdbc_count_all(node->opened, n_words);
    if (node->m > (size_t)count->is_search) return 1;
    cdbc_settle(node, 1.0, 1.0);
    return 0;
}

/* Find bounds by the boxes' measures, and by what is remembered; 0 where that settles it. */
static inline int cdbc_find_bounds(cdbc_count *count, cdbc_node *node, double *total)
{
    double largest;
    if (node->m > 1) cdbc_drop_inner(count, node);
    cdbc_measure(count, node, node->keys, total, &largest);
    count->work += (int64_t)(node->m * node->part->n_words >> 2);
    node->low = *total < 1.0 ? 1.0 - *total : 0.0;
    node->high = 1.0 - largest;
    if (node->m == 1) node->low = node->high;
    else if (cdbc_find_known(count, node->keys, &node->slot)) {
        const cdbc_known *known = &count->known[node->slot];
        if (known->low > node->low) node->low = known->low;
        if (known->high < node->high) node->high = known->high;
        if (node->high - node->low > CDBC_SAME) return 1;
        if (node->high < node->low) node->low = node->high;
    } else return 1;
    node->way = CDBC_SOLVED;
    return 0;
}

/* Look what is left of a new node, and choose how it is solved. */
static inline void cdbc_enter(cdbc_count *count, cdbc_node *node)
{
    size_t n_words = node->part->n_words;
    int is_thin, is_search = count->is_search;
    double total = 0.0;
    if (!cdbc_has_some(count, node) || (!is_search && !cdbc_find_bounds(count, node, &total))) return;
    if (count->work >= count->limit || node->depth + CDBC_ROOM >= count->most_depth) {
        count->n_cut++;
        node->way = CDBC_SOLVED;
        return;
    }
    is_thin = n_words > 1 && node->m <= CDBC_DENSE * n_words;
    if (is_search && is_thin) {
        node->way = CDBC_AGAIN;
        count->work += (int64_t)(node->m * node->n >> 3);
        return;
    }
    if (is_search && n_words <= 2) {
        count->work += (int64_t)(node->m * n_words >> 2);
        cdbc_drop_inner(count, node);
    }
    if (cdbc_split(node)) {
        node->way = CDBC_PRODUCT;
        node->sum_low = node->sum_high = 1.0;
        return;
    }
    if (!is_search) count->work += CDBC_PER_NODE + (int64_t)(node->m >> 1);
    if (!is_search && node->m >= (size_t)(total <= CDBC_SMALL_SUM ? CDBC_FEW : CDBC_MANY) && node->depth < count->alone_depth) {
        node->way = CDBC_ONE_BY_ONE;
        cdbc_list_boxes(count, node);
    } else if (is_thin) {
        node->way = CDBC_AGAIN;
        count->work += (int64_t)(node->m * node->n >> 2);
    } else {
        node->way = CDBC_FIXED;
        count->work += (int64_t)(cdbc_choose(count, node) * n_words >> 2);
    }
}

/* The next node of a product: the boxes that were kept, then the others. */
static inline cdbc_node *cdbc_next_factor(cdbc_count *count, cdbc_node *node)
{
    cdbc_node *child = node->at < 2 ? cdbc_new_node(count, node, node->part, node->listed, node->n) : NULL;
    size_t w;
    if (!child) return NULL;
    for (w = 0; w < node->part->n_words; w++) child->opened[w] = node->at == 0 ? node->kept[w] : node->opened[w] & ~node->kept[w];
    return child;
}

/* The next node of a factor that is fixed: the boxes that accept its next group. */
static inline cdbc_node *cdbc_next_group(cdbc_count *count, cdbc_node *node)
{
    size_t n_words = node->part->n_words, w;
    for (; node->at < node->n_items; node->at++) {
        const uint64_t *group = node->part->groups + (size_t)node->items[node->at].of * n_words;
        cdbc_node *child;
        cdbc_tick(&count->watch, 1 + node->n_zeros, count->work);
        if (cdbc_holds_zero(node, group)) continue;
        child = cdbc_new_node(count, node, node->part, node->listed, node->n);
        if (!child) return NULL;
        for (w = 0; w < n_words; w++) child->opened[w] = group[w] & node->opened[w];
        return child;
    }
    return NULL;
}

/* The next node of boxes that are taken one after the other: those before the next one, within it. Where they are all taken, the
 * sums are what they leave. */
static inline cdbc_node *cdbc_next_box(cdbc_count *count, cdbc_node *node)
{
    double most = (double)node->m * CDBC_EPSILON, low;
    for (; node->at < node->n_items; node->at++) {
        size_t i = (size_t)node->items[node->at].of, n_met;
        int is_over = count->work >= count->limit;
        if (is_over || 1.0 - node->sum_low <= most) {
            double others = 0.0;
            for (count->n_cut += is_over; node->at < node->n_items; node->at++) others += node->items[node->at].share;
            node->sum_high = node->sum_high + others < 1.0 ? node->sum_high + others : 1.0;
            break;
        }
        n_met = cdbc_met_before(count, node, i);
        node->before[i / 64] |= (uint64_t)1 << i % 64;
        count->work += 2 + (int64_t)((node->m >> 5) + (node->n * node->part->n_words >> 5));
        if (n_met > 0) {
            cdbc_node *child;
            cdbc_go_inside(count, node, i);
            child = cdbc_less_node(count, node, n_met, node->inside, node->salted);
            count->work += (int64_t)(n_met * node->n >> 1);
            node->limit = count->limit;
            if (count->is_shared) {
                int64_t share = 2 * (count->limit - count->work) / (int64_t)(node->m - node->at);
                if (count->work + share < count->limit) count->limit = count->work + share;
            }
            return child;
        }
        node->sum_low += node->items[node->at].share;
        node->sum_high += node->items[node->at].share;
    }
    low = 1.0 - node->sum_high;
    node->sum_high = 1.0 - node->sum_low;
    node->sum_low = low;
    if (low < 1e-3) {
        node->sum_low = low > most ? low - most : 0.0;
        node->sum_high = (node->sum_high > 0.0 ? node->sum_high : 0.0) + most;
    }
    return NULL;
}

/* The node that has to be solved next for another one; NULL where there is none. */
static inline cdbc_node *cdbc_next_node(cdbc_count *count, cdbc_node *node)
{
    switch (node->way) {
    case CDBC_PRODUCT: return cdbc_next_factor(count, node);
    case CDBC_ONE_BY_ONE: return cdbc_next_box(count, node);
    case CDBC_FIXED: return cdbc_next_group(count, node);
    case CDBC_AGAIN:
        if (node->at > 0) return NULL;
        return cdbc_less_node(count, node, cdbc_write_numbers(count, node->part, node->opened), node->weights, node->salts);
    default: return NULL;
    }
}

/* Take the bounds of the node that was asked for last. */
static inline void cdbc_take(cdbc_count *count, cdbc_node *node, double low, double high)
{
    const cdbc_item *item = node->items ? &node->items[node->at] : NULL;
    node->at++;
    if (node->way == CDBC_PRODUCT) {
        node->sum_low *= low;
        node->sum_high *= high;
        if (high == 0.0) node->at = 2;
    } else if (!item) {
        node->sum_low = low;
        node->sum_high = high;
    } else {
        node->sum_low += item->share * low;
        node->sum_high += item->share * high;
        if (node->way == CDBC_ONE_BY_ONE) count->limit = node->limit;
        else if (count->is_search && (high > 0.0 || count->n_cut > 0)) node->at = node->n_items;
        else if (high == 0.0) node->items[node->n_zeros++].of = item->of;
    }
}

/* Settle a node whose parts are all solved, and remember it. */
static inline void cdbc_finish(cdbc_count *count, cdbc_node *node)
{
    if (count->is_search) cdbc_settle(node, 0.0, node->sum_high > 0.0 ? 1.0 : 0.0);
    else if (node->way == CDBC_PRODUCT) cdbc_settle(node, node->sum_high == 0.0 ? 0.0 : node->sum_low, node->sum_high);
    else {
        double low = node->sum_low > node->low ? node->sum_low : node->low;
        double high = node->sum_high < node->high ? node->sum_high : node->high;
        cdbc_known known = {{node->keys[0], node->keys[1]}, low < high ? low : high, high};
        count->known[node->slot] = known;
        cdbc_settle(node, known.low, known.high);
    }
}

/* Bounds of the share of contexts that no open box of a node holds; apart by roundings at most where nothing was cut short. The
 * node is freed. Answers 0 where it was stopped, or memory is missing. */
static inline int cdbc_solve(cdbc_count *count, cdbc_node *node, double *low, double *high)
{
    while (node) {
        cdbc_node *next;
        if (node->way == CDBC_NEW) cdbc_enter(count, node);
        next = cdbc_is_over(&count->watch) ? NULL : cdbc_next_node(count, node);
        if (next) {
            node = next;
            continue;
        }
        if (cdbc_is_over(&count->watch)) break;
        if (node->way != CDBC_SOLVED) cdbc_finish(count, node);
        *low = node->low;
        *high = node->high;
        node = cdbc_free_node(node);
        if (node) cdbc_take(count, node, *low, *high);
    }
    while (node) node = cdbc_free_node(node);
    return !cdbc_is_over(&count->watch);
}

/* ---- What is asked */

/* Make ready to count the contexts of some boxes, or of all, weighed as given; 0 where it was stopped, or memory is missing. */
static inline int cdbc_start(cdbc_count *count, const cdbc_boxes *boxes, const int32_t *chosen, size_t n_boxes, const double *weights)
{
    size_t n_words = cdbc_words_of(n_boxes), x;
    cdbc_block block = {NULL, 0, 0};
    count->boxes = boxes;
    if (!cdbc_set_desk(&count->desk, boxes, n_boxes, &count->watch)) return 0;
    do {
        count->once = (uint64_t *)cdbc_array(&block, n_words, 1, sizeof(uint64_t));
        count->twice = (uint64_t *)cdbc_array(&block, n_words, 1, sizeof(uint64_t));
        count->hashes = (uint64_t *)cdbc_array(&block, n_boxes, 2, sizeof(uint64_t));
        count->volumes = (double *)cdbc_array(&block, n_boxes, 1, sizeof(double));
        count->logs = (double *)cdbc_array(&block, boxes->most_classes + 2, 1, sizeof(double));
        count->salts = (uint64_t *)cdbc_array(&block, boxes->n_factors, 1, sizeof(uint64_t));
        count->numbers = (int32_t *)cdbc_array(&block, n_boxes, 1, sizeof(int32_t));
        count->factors = (int32_t *)cdbc_array(&block, boxes->n_factors, 1, sizeof(int32_t));
    } while (cdbc_take_block(&count->watch, &block));
    count->memory = block.memory;
    if (!count->memory) return 0;
    memset(count->salts, 0, boxes->n_factors * sizeof(uint64_t));
    for (x = 0; x < boxes->most_classes + 2; x++) count->logs[x] = 0.0;
    for (x = 0; x < boxes->n_factors; x++) count->factors[x] = (int32_t)x;
    for (x = 0; x < n_boxes; x++) count->numbers[x] = chosen ? chosen[x] : (int32_t)x;
    count->weights = weights;
    count->desk.done = count->work;
    count->part = cdbc_part_of(&count->desk, count->numbers, n_boxes, count->factors, boxes->n_factors, weights, count->salts);
    if (!count->part) return 0;
    count->most_depth = 6 * count->part->n_factors + CDBC_LEAST_DEPTH;
    if (count->most_depth > CDBC_MOST_DEPTH) count->most_depth = CDBC_MOST_DEPTH;
    count->alone_depth = count->most_depth > 4 * count->part->n_factors + CDBC_LEAST_DEPTH
        ? count->most_depth - 4 * count->part->n_factors : CDBC_LEAST_DEPTH;
    return 1;
}

/* Solve the whole of it. */
static inline int cdbc_run(cdbc_count *count, double *low, double *high)
{
    const cdbc_part *part = count->part;
    cdbc_node *node = cdbc_new_node(count, NULL, part, NULL, part->n_factors);
    count->n_cut = 0;
    if (!node) return 0;
    cdbc_open_all(node);
    node->weights = count->weights;
    node->salts = count->salts;
    return cdbc_solve(count, node, low, high);
}

static inline void cdbc_end(cdbc_count *count)
{
    CDB_FREE(count->desk.memory);
    CDB_FREE(count->memory);
    CDB_FREE(count->part);
    free(count->known);
}

/* Bounds of the share of contexts that no box holds, within so many steps, and whether some part of it was cut short. Steps up to
 * `first_limit` go to the exact share; where they do not do, the rest goes to better bounds. Answers 0 where it was stopped, or memory
 * is missing; `count` begins as zeros but for its watch. */
static inline int cdbc_uncovered(cdbc_count *count, const cdbc_boxes *boxes, const double *weights, int64_t first_limit, int64_t limit,
    double *low, double *high)
{
    double own_low = 0.0, own_high = 1.0;
    int is_done = cdbc_start(count, boxes, NULL, boxes->n_boxes, weights);
    size_t n_known = 64;
    while (n_known < CDBC_MOST_KNOWN && n_known < (uint64_t)limit / (CDBC_PER_NODE / 2)) n_known *= 2;
    count->last_known = n_known - 1;
    count->known = is_done ? (cdbc_known *)calloc(n_known, sizeof(cdbc_known)) : NULL;
    if (is_done && !count->known) count->watch.has_no_memory = 1;
    *low = 0.0;
    *high = 1.0;
    for (count->limit = first_limit; is_done && count->known; count->limit = limit, count->is_shared = 1) {
        is_done = cdbc_run(count, &own_low, &own_high);
        if (own_low > *low) *low = own_low;
        if (own_high < *high) *high = own_high;
        if (count->is_shared || count->n_cut == 0 || count->work >= limit) break;
    }
    cdbc_end(count);
    return is_done && !cdbc_is_over(&count->watch);
}

/* Whether a context, of classes of some weight, is in none of the chosen boxes; "no" where that was cut short. */
static inline int cdbc_leaves_open(cdbc_count *count, const cdbc_boxes *boxes, const int32_t *chosen, size_t n_chosen, const double *weights,
    int64_t limit, int *is_open)
{
    double low = 0.0, high = 0.0;
    int is_done = cdbc_start(count, boxes, chosen, n_chosen, weights);
    count->is_search = 1;
    count->limit = limit;
    is_done = is_done && cdbc_run(count, &low, &high);
    *is_open = high > 0.0;
    cdbc_end(count);
    return is_done;
}

/* Write for each of the chosen boxes, by place, the first one that holds it whole and is not like it, else -1; `alike` names the first
 * that is like each. Answers 0 where it was stopped, or memory is missing. */
static inline int cdbc_first_holders(cdbc_count *count, const cdbc_boxes *boxes, const int32_t *chosen, size_t n_chosen, const double *weights,
    const int64_t *alike, int64_t *holders)
{
    cdbc_node *node = cdbc_start(count, boxes, chosen, n_chosen, weights)
        ? cdbc_new_node(count, NULL, count->part, NULL, count->part->n_factors) : NULL;
    size_t n_words = cdbc_words_of(n_chosen), i, w;
    if (node) cdbc_open_all(node);
    for (i = 0; node && i < n_chosen && !cdbc_is_over(&count->watch); i++) {
        int is_inner = cdbc_is_inner(node, i, count->once);
        cdbc_tick(&count->watch, node->n * n_words, (int64_t)i);
        holders[i] = -1;
        for (w = 0; is_inner && w < n_words && holders[i] < 0; w++) {
            uint64_t rest = count->once[w];
            while (rest && holders[i] < 0) {
                size_t j = w * 64 + cdbc_take_bit(&rest);
                if (alike[j] != alike[i]) holders[i] = (int64_t)j;
            }
        }
    }
    if (node) cdbc_free_node(node);
    cdbc_end(count);
    return !cdbc_is_over(&count->watch);
}
