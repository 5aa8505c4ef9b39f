/* ---- Many contexts of one table at once: from the codes of their facts to their rows, counts and hits. A code is the number of a
 * mask, counted through all columns from 1 on; 0 is a fact that is ignored, the mask of every row. A wide column's code is the class
 * of its fact and stands behind all others: its mask is put together; -1 is ignored.
 *
 * Columns with few classes are joined, so that one look-up finds the rows of several facts: a group of columns with K1, K2, ... classes
 * has K1 x K2 x ... leaves, one for each joint class, and the mask of a leaf is the AND of theirs.
 *
 * Source: the first phase of recursive flow classification, Gupta and McKeown, SIGCOMM 1999. */

#define CDBI_CONTEXTS 128           /* contexts whose codes are gone through together: they stay in the nearest cache */
#define CDBI_MOST_LEAVES 128        /* beyond so many, or so many bytes, the caches hold less than the joining saves */
#define CDBI_MOST_LEAF_BYTES 262144
#define CDBI_SHORT 64              /* words of masks that are short */

typedef struct cdbi_code_slot {         /* what the codes of one slot say */
    const uint64_t *masks;          /* that of code `first`; NULL for a wide column */
    const cdb_column *wide;         /* that column */
    int32_t first;
    uint32_t n_masks;               /* for a wide column so many classes, the last that of a missing fact */
    uint32_t n_classes;             /* the masks of facts that are not missing; 0 for a slot that is not joined */
} cdbi_code_slot;

typedef struct cdbi_batch {
    size_t n_rows, n_words;
    const uint64_t *enabled;
    cdbi_code_slot *places;
    size_t n_places;
    size_t *members, *edges;        /* group g joins the slots members[edges[g]] up to, not including, members[edges[g + 1]]; behind the
                                       last group are the plain slots that are not joined, up to n_plain */
    const uint64_t **leaves;        /* the masks of each group's; of a slot alone its own */
    size_t n_groups, n_plain;
} cdbi_batch;

typedef struct cdbi_sums {          /* what a batch fills; NULL for what is not wanted */
    int64_t *counts;                /* [N]: how many rows are valid */
    int64_t *hits;                  /* [64 W]: the weights of the contexts in which each row is valid */
    const int64_t *weights;         /* [N]; NULL: 1 for each context */
    uint64_t *masks;                /* [N, W] */
} cdbi_sums;

/* Join the slots, those with the fewest classes first; `members` and `edges` have room for all of them and one more. */
static inline void cdbi_join_places(cdbi_batch *batch)
{
    size_t i, j, n = 0, n_leaves = 0;
    for (i = 0; i < batch->n_places; i++) {
        if (batch->places[i].n_classes == 0) continue;
        for (j = n++; j > 0 && batch->places[batch->members[j - 1]].n_classes > batch->places[i].n_classes; j--)
            batch->members[j] = batch->members[j - 1];
        batch->members[j] = i;
    }
    batch->n_groups = 0;
    for (i = 0; i < n; i++) {
        size_t joint = n_leaves * batch->places[batch->members[i]].n_classes;
        if (i == 0 || joint > CDBI_MOST_LEAVES || joint * batch->n_rows / 8 > CDBI_MOST_LEAF_BYTES) {
            batch->edges[batch->n_groups++] = i;
            joint = batch->places[batch->members[i]].n_classes;
        }
        n_leaves = joint;
    }
    batch->edges[batch->n_groups] = n;
    for (i = 0; i < batch->n_places; i++)
        if (batch->places[i].n_classes == 0 && batch->places[i].masks) batch->members[n++] = i;
    batch->n_plain = n;
}

/* How many leaves a group has. */
static inline size_t cdbi_count_leaves(const cdbi_batch *batch, size_t group)
{
    size_t i, n = 1;
    for (i = batch->edges[group]; i < batch->edges[group + 1]; i++) n *= batch->places[batch->members[i]].n_classes;
    return n;
}

/* Put the masks of the leaves of a group together. */
static inline void cdbi_make_leaves(const cdbi_batch *batch, size_t group, uint64_t *leaves)
{
    size_t n = cdbi_count_leaves(batch, group), leaf, i, w, n_words = batch->n_words;
    for (leaf = 0; leaf < n; leaf++) {
        size_t rest = leaf, of_rest = n;
        for (i = batch->edges[group]; i < batch->edges[group + 1]; i++) {
            const cdbi_code_slot *place = &batch->places[batch->members[i]];
            const uint64_t *mask;
            of_rest /= place->n_classes;
            mask = place->masks + rest / of_rest * n_words;
            rest %= of_rest;
            for (w = 0; w < n_words; w++)
                leaves[leaf * n_words + w] = i == batch->edges[group] ? mask[w] : leaves[leaf * n_words + w] & mask[w];
        }
    }
}

/* Whether a slot has a mask for each of some codes. */
CDBI_HOT int cdbi_are_codes(const cdbi_code_slot *place, const int32_t *codes, size_t n)
{
    uint32_t is_wrong = 0;
    size_t k;
    if (!place->masks)
        for (k = 0; k < n; k++) is_wrong |= (uint32_t)(codes[k] < -1) | (uint32_t)(codes[k] >= (int32_t)place->n_masks);
    else
        for (k = 0; k < n; k++)
            is_wrong |= (uint32_t)(codes[k] != 0) & (uint32_t)((uint32_t)(codes[k] - place->first) >= place->n_masks);
    return !is_wrong;
}

/* The leaf of a group for each of some contexts, whose codes of slot j begin at codes[j * n_contexts]; -1 where a fact is missing or
 * ignored. */
CDBI_HOT void cdbi_find_leaves(const cdbi_batch *batch, size_t group, const int32_t *codes, size_t n_contexts, size_t n, int32_t *leaves)
{
    size_t i, k;
    for (k = 0; k < n; k++) leaves[k] = 0;
    for (i = batch->edges[group]; i < batch->edges[group + 1]; i++) {
        const cdbi_code_slot *place = &batch->places[batch->members[i]];
        const int32_t *own = codes + batch->members[i] * n_contexts, n_classes = (int32_t)place->n_classes, first = place->first;
        for (k = 0; k < n; k++) {
            int32_t at = own[k] - first, leaf = leaves[k] * n_classes + at;
            leaves[k] = ((leaves[k] < 0) | (at < 0) | (at >= n_classes)) ? -1 : leaf;
        }
    }
}

/* The masks of one context, `leaves` its leaf in each group; those of wide columns are left out. Gives how many there are. */
CDBI_HOT size_t cdbi_gather(const cdbi_batch *batch, const int32_t *codes, size_t n_contexts, const int32_t *leaves,
    const uint64_t **masks)
{
    size_t n = 0, g, i;
    for (g = 0; g < batch->n_groups; g++) {
        int32_t leaf = leaves[g * CDBI_CONTEXTS];
        if (leaf >= 0) masks[n++] = batch->leaves[g] + (size_t)leaf * batch->n_words;
        for (i = batch->edges[g]; leaf < 0 && i < batch->edges[g + 1]; i++) {
            const cdbi_code_slot *place = &batch->places[batch->members[i]];
            int32_t code = codes[batch->members[i] * n_contexts];
            if (code != 0) masks[n++] = place->masks + (size_t)(code - place->first) * batch->n_words;
        }
    }
    for (i = batch->edges[batch->n_groups]; i < batch->n_plain; i++) {
        const cdbi_code_slot *place = &batch->places[batch->members[i]];
        int32_t code = codes[batch->members[i] * n_contexts];
        masks[n] = place->masks + (size_t)(code ? code - place->first : 0) * batch->n_words;
        n += code != 0;
    }
    return n;
}

/* So many words of rows = from & all masks, all of which are read. */
CDBI_HOT void cdbi_and_all(uint64_t *rows, const uint64_t *from, const uint64_t *const *masks, size_t n_masks, size_t at, size_t n_words)
{
    uint64_t left[CDBI_BLOCK];
    size_t i, j;
    for (j = 0; j < n_words; j++) left[j] = from[at + j];
    for (i = 0; i + 4 <= n_masks; i += 4) {
        const uint64_t *a = masks[i] + at, *b = masks[i + 1] + at, *c = masks[i + 2] + at, *d = masks[i + 3] + at;
        for (j = 0; j < n_words; j++) left[j] &= (a[j] & b[j]) & (c[j] & d[j]);
    }
    for (; i < n_masks; i++)
        for (j = 0; j < n_words; j++) left[j] &= masks[i][at + j];
    for (j = 0; j < n_words; j++) rows[at + j] = left[j];
}

/* cdbi_and of short masks: to read them all is sooner done than to look which rows are left. */
CDBI_HOT void cdbi_and_short(uint64_t *rows, const uint64_t *from, const uint64_t *const *masks, size_t n_masks, size_t n_words)
{
    size_t at = 0;
    for (; at + CDBI_BLOCK <= n_words; at += CDBI_BLOCK) cdbi_and_all(rows, from, masks, n_masks, at, CDBI_BLOCK);
    for (; at + 4 <= n_words; at += 4) cdbi_and_all(rows, from, masks, n_masks, at, 4);
    for (; at < n_words; at++) cdbi_and_all(rows, from, masks, n_masks, at, 1);
}

/* The same for contexts whose every leaf is there: `masks` gets `stride` for each, and those of a fact that is ignored are all rows. */
CDBI_HOT void cdbi_gather_block(const cdbi_batch *batch, const int32_t *codes, size_t n_contexts, size_t n, const int32_t *leaves,
    const uint64_t **masks, size_t stride)
{
    size_t n_words = batch->n_words, g, i, k;
    for (g = 0; g < batch->n_groups; g++) {
        const uint64_t *first = batch->leaves[g];
        for (k = 0; k < n; k++) {
            int32_t leaf = leaves[g * CDBI_CONTEXTS + k];
            masks[k * stride + g] = first + (size_t)(leaf < 0 ? 0 : leaf) * n_words;
        }
    }
    for (i = batch->edges[g]; i < batch->n_plain; i++, g++) {
        const cdbi_code_slot *place = &batch->places[batch->members[i]];
        const uint64_t *first = place->masks, *all = batch->enabled;
        const int32_t *own = codes + batch->members[i] * n_contexts;
        int32_t before = place->first;
        for (k = 0; k < n; k++) masks[k * stride + g] = own[k] ? first + (size_t)(own[k] - before) * n_words : all;
    }
}

/* AND one wide column's mask of a code: -1 is a fact that is ignored, the last class a missing one. */
CDBI_HOT void cdbi_and_wide_code(uint64_t *rows, const cdb_column *column, int32_t code, size_t n_words)
{
    if (code < 0) return;
    if ((size_t)code > column->n_bounds) cdbi_and(rows, rows, &column->any_mask, 1, n_words);
    else cdbi_and_wide_class(rows, column, (size_t)code, 0, n_words, n_words);
}

/* Add the rows of one context to the sums. */
CDBI_HOT void cdbi_add_rows(const uint64_t *rows, size_t n_words, int64_t weight, int64_t *count, int64_t *hits)
{
    int64_t n = 0;
    size_t w;
    for (w = 0; w < n_words; w++) {
        uint64_t word = rows[w];
        if (w + 4 <= n_words && !(word | rows[w + 1] | rows[w + 2] | rows[w + 3])) {
            w += 3;
            continue;
        }
        for (; word; word &= word - 1, n++) hits[w * 64 + cdbi_first_bit(word)] += weight;
    }
    if (count) *count = n;
}

/* Answer the contexts `start` up to, not including, `stop`, of N whose codes of slot j begin at codes[j * N]. `room` has space for
 * CDBI_CONTEXTS numbers a group and once more, `masks` for a mask a slot and context of a block, and once more, `rows` for W
 * words. 0 where a code is none of its slot. */
CDBI_HOT int cdbi_answer_batch(const cdbi_batch *batch, const int32_t *codes, size_t n_contexts, size_t start, size_t stop,
    const cdbi_sums *sums, int32_t *room, const uint64_t **masks, uint64_t *rows)
{
    size_t n_words = batch->n_words, stride = batch->n_groups + batch->n_plain - batch->edges[batch->n_groups], first, i, k;
    const uint64_t **others = masks + stride * CDBI_CONTEXTS;
    int32_t *is_whole = room + batch->n_groups * CDBI_CONTEXTS;
    for (first = start; first < stop; first += CDBI_CONTEXTS) {
        size_t n = stop - first < CDBI_CONTEXTS ? stop - first : CDBI_CONTEXTS;
        for (i = 0; i < batch->n_places; i++)
            if (!cdbi_are_codes(&batch->places[i], codes + i * n_contexts + first, n)) return 0;
        for (i = 0; i < batch->n_groups; i++) cdbi_find_leaves(batch, i, codes + first, n_contexts, n, room + i * CDBI_CONTEXTS);
        for (k = 0; k < n; k++) is_whole[k] = 0;
        for (i = 0; i < batch->n_groups; i++)
            for (k = 0; k < n; k++) is_whole[k] |= room[i * CDBI_CONTEXTS + k];
        cdbi_gather_block(batch, codes + first, n_contexts, n, room, masks, stride);
        for (k = 0; k < n; k++) {
            uint64_t *to = sums->masks ? sums->masks + (first + k) * n_words : rows;
            if (is_whole[k] >= 0 && n_words <= CDBI_SHORT) cdbi_and_short(to, batch->enabled, masks + k * stride, stride, n_words);
            else if (is_whole[k] >= 0) cdbi_and(to, batch->enabled, masks + k * stride, stride, n_words);
            else cdbi_and(to, batch->enabled, others, cdbi_gather(batch, codes + first + k, n_contexts, room + k, others), n_words);
            for (i = batch->n_places; i > 0 && !batch->places[i - 1].masks; i--)
                cdbi_and_wide_code(to, batch->places[i - 1].wide, codes[(i - 1) * n_contexts + first + k], n_words);
            if (sums->hits)
                cdbi_add_rows(to, n_words, sums->weights ? sums->weights[first + k] : 1, sums->counts ? &sums->counts[first + k] : NULL,
                    sums->hits);
        }
    }
    return 1;
}
