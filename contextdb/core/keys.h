/* ---- Keys: the codes of many contexts packed into a few words each, their hashes, and the distinct ones among them. N contexts, K words
 * a key; word i of all keys lies together. */

typedef struct cdbi_field {         /* a few bits of one word of a key */
    size_t word;
    unsigned shift;
    uint64_t bits;
    int32_t first;                  /* what is taken off a code before it is packed */
} cdbi_field;

/* Put codes into a field that is 0. */
static inline void cdbi_pack_codes(const int32_t *codes, size_t n, const cdbi_field *field, uint64_t *word)
{
    size_t k;
    for (k = 0; k < n; k++) word[k] |= ((uint64_t)(uint32_t)(codes[k] - field->first) & field->bits) << field->shift;
}

/* Take codes out of a field, those of the contexts `rows`. */
static inline void cdbi_unpack_codes(const uint64_t *word, const int32_t *rows, size_t n, const cdbi_field *field, int32_t *codes)
{
    size_t k;
    for (k = 0; k < n; k++) codes[k] = field->first + (int32_t)(word[rows[k]] >> field->shift & field->bits);
}

/* A hash of each key, the same on every machine. */
static inline void cdbi_hash_keys(const uint64_t *words, size_t n_words, size_t n, uint64_t *hashes)
{
    size_t i, k, start;
    memset(hashes, 0, n * sizeof *hashes);
    for (start = 0; start < n; start += 256)
        for (i = 0; i < n_words; i++) {
            const uint64_t *word = words + i * n;
            for (k = start; k < n && k < start + 256; k++) {
                uint64_t h = (hashes[k] ^ word[k]) + 0x9E3779B97F4A7C15;
                h = (h ^ h >> 30) * 0xBF58476D1CE4E5B9;
                h = (h ^ h >> 27) * 0x94D049BB133111EB;
                hashes[k] = h ^ h >> 31;
            }
        }
}

/* The first context of each distinct key, in their order, and the sum of its moments; gives how many there are. Contexts without a moment
 * are left out. `table` are `last` + 1 numbers, a power of two above N, all 0. */
static inline size_t cdbi_group_keys(const uint64_t *words, size_t n_words, size_t n, const uint64_t *hashes, const int64_t *moments,
    int32_t *table, size_t last, int32_t *first, int64_t *sums)
{
    size_t n_groups = 0, k, w;
    for (k = 0; k < n; k++) {
        size_t at = (size_t)hashes[k] & last;
        if (moments[k] == 0) continue;
        for (; table[at] != 0; at = (at + 1) & last) {
            size_t other = (size_t)first[table[at] - 1];
            if (hashes[other] != hashes[k]) continue;
            for (w = 0; w < n_words && words[w * n + other] == words[w * n + k]; w++) {}
            if (w == n_words) break;
        }
        if (table[at] != 0) {
            sums[table[at] - 1] += moments[k];
            continue;
        }
        first[n_groups] = (int32_t)k;
        sums[n_groups++] = moments[k];
        table[at] = (int32_t)n_groups;
    }
    return n_groups;
}

/* The rows of masks, one mask after the other: `rows` has room for all of them. */
static inline void cdbi_rows_of_masks(const uint64_t *masks, size_t n, size_t n_words, int64_t *rows)
{
    size_t k, w;
    for (k = 0; k < n; k++)
        for (w = 0; w < n_words; w++) {
            uint64_t word = masks[k * n_words + w];
            for (; word; word &= word - 1) *rows++ = (int64_t)(w * 64 + cdbi_first_bit(word));
        }
}
