
/* ---- Asking */

#define CDBI_MASKS 64
#define CDBI_BLOCK 16
#define CDBI_JOINED 8
#ifndef CDBI_TOUCH
#define CDBI_TOUCH(n_words) ((void)0) /* a test counts the words of masks that are read */
#endif

/* How many of some places are not above that of a number. */
CDBI_HOT size_t cdbi_class_at(const uint64_t *places, size_t n, double number)
{
    const uint64_t *from = places;
    uint64_t place = cdbi_place(number);
    if (place == CDBI_MINUS_ZERO) place++;
    while (n > 1) {
        size_t half = n / 2;
        from = from[half - 1] <= place ? from + half : from;
        n -= half;
    }
    return (size_t)(from - places) + (n == 1 && *from <= place);
}

/* How many bounds are not above a number. */
CDBI_HOT size_t cdbi_class(const cdb_column *column, double number)
{
    return cdbi_class_at(column->places, column->n_bounds, number);
}

static inline size_t cdbi_text_class(const cdb_column *column, const char *text)
{
    size_t low = 0, high = column->texts.n;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        int order = strcmp(column->texts.texts[middle], text);
        if (order == 0) return column->classes[middle];
        if (order < 0) low = middle + 1;
        else high = middle;
    }
    return column->texts.n;
}

/* Whether the fact has all that a part needs and nothing that it bans. */
static inline int cdbi_is_in(const cdb_condition *condition, const cdbi_part *part, const cdb_fact *fact)
{
    size_t i;
    for (i = 0; i < part->needs.n; i++)
        if (!cdbi_has(condition, &part->needs, i, fact)) return 0;
    for (i = 0; i < part->bans.n; i++)
        if (cdbi_has(condition, &part->bans, i, fact)) return 0;
    return 1;
}

/* What is within the hysteresis of a column of a fact, which is there: spans with both ends inside, one or, of angles, two. Without a
 * hysteresis the fact alone. */
static inline size_t cdbi_near(const cdb_column *column, const cdb_condition *condition, const cdb_fact *fact, double spans[2][2])
{
    double number = cdbi_number(condition, fact), reach = cdbi_negative(column->hysteresis), turn, part, rounded;
    spans[0][0] = cdbi_sum(number, reach), spans[0][1] = cdbi_sum(number, column->hysteresis);
    if (condition->type != CDB_ANGLE || !cdbi_is_less(0.0, column->hysteresis)) return 1;
    turn = cdbi_sum(spans[0][1], cdbi_negative(spans[0][0]));
    part = cdbi_sum(turn, cdbi_negative(spans[0][1])); /* what the difference was rounded by */
    rounded = cdbi_sum(cdbi_sum(spans[0][1], cdbi_negative(cdbi_sum(turn, cdbi_negative(part)))), cdbi_negative(cdbi_sum(spans[0][0], part)));
    if (cdbi_is_less(360.0, turn) || (!cdbi_is_less(turn, 360.0) && !cdbi_is_less(rounded, 0.0))) {
        spans[0][0] = -180.0, spans[0][1] = 179.99999999999997;
        return 1;
    }
    spans[0][0] = cdbi_wrapped(spans[0][0]), spans[0][1] = cdbi_wrapped(spans[0][1]);
    if (!cdbi_is_less(spans[0][1], spans[0][0])) return 1;
    spans[1][0] = -180.0, spans[1][1] = spans[0][1], spans[0][1] = 179.99999999999997;
    return 2;
}

/* The answer of a slot of a tags column: does the fact have its tag, or does its cell, which begins with "not", hold? */
static inline size_t cdbi_answer(const cdb_column *column, const cdb_condition *condition, size_t slot, const cdb_fact *fact)
{
    const cdbi_slot *negated;
    size_t i;
    if (slot < column->texts.n) return (size_t)cdbi_has(condition, &column->texts, slot, fact);
    negated = &column->negated[slot - column->texts.n];
    for (i = 0; i < negated->n; i++)
        if (cdbi_is_in(condition, &negated->parts[i], fact) == negated->parts[i].is_complement) return 0;
    return 1;
}

/* The class of a fact that is there, for a column that keeps a mask for each class. */
CDBI_HOT size_t cdbi_class_of(const cdb_column *column, const cdb_condition *condition, const cdb_fact *fact)
{
    if (column->kind == CDBI_FLAT) return cdbi_class(column, cdbi_number(condition, fact));
    return condition->type == CDB_TEXT ? cdbi_text_class(column, fact->text) : (size_t)fact->whole;
}

/* The mask of a fact, or of a missing one that only Any accepts; NULL for a column that keeps none for each class. */
CDBI_HOT const uint64_t *cdbi_mask(const cdb_column *column, const cdb_condition *condition, const cdb_fact *fact,
    int is_missing, size_t n_words)
{
    if (column->kind != CDBI_VALUE && column->kind != CDBI_FLAT) return NULL;
    return column->masks + (is_missing ? column->n_masks - 1 : cdbi_class_of(column, condition, fact)) * n_words;
}

/* So many words of rows = from & all masks. Masks are joined eight at a time: as a rule few of them leave no row of a block, and the
 * others need not be read. */
CDBI_HOT void cdbi_and_block(uint64_t *rows, const uint64_t *from, const uint64_t *const *masks, size_t n_masks, size_t at,
    size_t n_words)
{
    uint64_t left[CDBI_BLOCK], some = 1;
    size_t i = 0, j;
    for (j = 0; j < n_words; j++) left[j] = from[at + j];
    for (; i + CDBI_JOINED <= n_masks && some; i += CDBI_JOINED) {
        const uint64_t *a = masks[i] + at, *b = masks[i + 1] + at, *c = masks[i + 2] + at, *d = masks[i + 3] + at,
                       *e = masks[i + 4] + at, *f = masks[i + 5] + at, *g = masks[i + 6] + at, *h = masks[i + 7] + at;
        CDBI_TOUCH(CDBI_JOINED * n_words);
        for (some = 0, j = 0; j < n_words; j++) {
            left[j] &= ((a[j] & b[j]) & (c[j] & d[j])) & ((e[j] & f[j]) & (g[j] & h[j]));
            some |= left[j];
        }
    }
    for (; i < n_masks && some; i++) {
        CDBI_TOUCH(n_words);
        for (j = 0; j < n_words; j++) left[j] &= masks[i][at + j];
        for (some = 0, j = 0; j < n_words; j++) some |= left[j];
    }
    for (j = 0; j < n_words; j++) rows[at + j] = left[j];
}

CDBI_HOT void cdbi_and(uint64_t *rows, const uint64_t *from, const uint64_t *const *masks, size_t n_masks, size_t n_words)
{
    size_t at = 0;
    for (; at + CDBI_BLOCK <= n_words; at += CDBI_BLOCK) cdbi_and_block(rows, from, masks, n_masks, at, CDBI_BLOCK);
    for (; at + 4 <= n_words; at += 4) cdbi_and_block(rows, from, masks, n_masks, at, 4);
    for (; at < n_words; at++) cdbi_and_block(rows, from, masks, n_masks, at, 1);
}

/* rows &= some words of a class's mask of a wide column, put together from the two digits of the class; rows[0] is word `from`. */
CDBI_HOT void cdbi_and_wide_class(uint64_t *rows, const cdb_column *column, size_t number, size_t from, size_t to, size_t n_words)
{
    size_t n_fine = (size_t)1 << column->shift, n_coarse = (column->n_digits - n_fine) / 2;
    size_t after = (number >> column->shift) * n_words, same = after + n_coarse * n_words;
    size_t fine = (2 * n_coarse + (number & (n_fine - 1))) * n_words, layer, at, step = column->n_digits * n_words;
    for (at = from; at < to; at++) {
        uint64_t some = 0;
        for (layer = 0; layer < column->n_layers && rows[at - from]; layer++) {
            const uint64_t *low = column->low + layer * step + at, *high = column->high + layer * step + at;
            CDBI_TOUCH(6);
            some |= (low[after] | (low[same] & low[fine])) & (high[after] | (high[same] & high[fine]));
        }
        rows[at - from] &= some;
    }
}

CDBI_HOT void cdbi_and_wide(uint64_t *rows, const cdb_column *column, double number, size_t from, size_t to, size_t n_words)
{
    cdbi_and_wide_class(rows, column, cdbi_class(column, number), from, to, n_words);
}

/* Some words of rows &= those whose cells of a column of numbers accept anything within its hysteresis of a fact; rows[0] is word
 * `from`. */
static inline void cdbi_and_near(uint64_t *rows, const cdb_column *column, const cdb_condition *condition, const cdb_fact *fact, size_t from,
    size_t to, size_t n_words)
{
    double spans[2][2];
    size_t n = cdbi_near(column, condition, fact, spans), at, i, k, last;
    for (at = from; at < to; at++) {
        uint64_t all = rows[at - from], some = 0;
        for (i = 0; i < n; i++)
            for (k = cdbi_class(column, spans[i][0]), last = cdbi_class(column, spans[i][1]); k <= last && some != all; k++) {
                uint64_t own = all;
                if (column->kind == CDBI_WIDE) cdbi_and_wide_class(&own, column, k, at, at + 1, n_words);
                else own &= column->masks[k * n_words + at];
                some |= own;
            }
        rows[at - from] = some;
    }
}

static inline int cdbi_is_widened(const cdb_column *column, int is_wide)
{
    return is_wide && cdbi_is_less(0.0, column->hysteresis);
}

static inline void cdbi_and_slots(uint64_t *rows, const cdb_column *column, const cdb_condition *condition, const cdb_fact *fact,
    size_t n_words)
{
    size_t slot, n_slots = column->n_masks / 3;
    int is_missing = cdbi_is_missing(condition, fact);
    for (slot = 0; slot < n_slots; slot++) {
        const uint64_t *mask = column->masks + (3 * slot + (is_missing ? 2 : cdbi_answer(column, condition, slot, fact))) * n_words;
        cdbi_and(rows, rows, &mask, 1, n_words);
    }
}

/* Wide columns, columns of tags, and widened ones, for the rows that the others left. */
static inline void cdbi_and_others(uint64_t *rows, const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact *facts, cdb_unknown unknown, int is_wide)
{
    size_t i;
    for (i = 0; i < schema->n_conditions; i++) {
        int is_missing, is_widened = cdbi_is_widened(&columns[i], is_wide);
        if (columns[i].kind != CDBI_WIDE && columns[i].kind != CDBI_SLOTS && !(columns[i].kind == CDBI_FLAT && is_widened)) continue;
        is_missing = cdbi_is_missing(&schema->conditions[i], &facts[i]);
        if (is_missing && unknown == CDB_UNKNOWN_ANY) continue;
        if (columns[i].kind == CDBI_SLOTS) cdbi_and_slots(rows, &columns[i], &schema->conditions[i], &facts[i], table->n_words);
        else if (is_missing && columns[i].kind == CDBI_FLAT) continue; /* its mask was one of the others */
        else if (is_missing) cdbi_and(rows, rows, &columns[i].any_mask, 1, table->n_words);
        else if (is_widened) cdbi_and_near(rows, &columns[i], &schema->conditions[i], &facts[i], 0, table->n_words, table->n_words);
        else cdbi_and_wide(rows, &columns[i], cdbi_number(&schema->conditions[i], &facts[i]), 0, table->n_words, table->n_words);
    }
}

/* The rows whose every cell accepts its fact and whose rule holds, one bit a row, in `rows`, which has room for `room` words; words
 * behind those of the table become 0. Facts are in the order of the schema; those of derived conditions are computed here, into
 * `own`. Where `is_wide`, cells are widened by the hysteresis of their conditions, but rules are not. On a fault no row is valid. */
static inline cdb_status cdbi_query_as(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema, const cdb_fact *facts,
    cdb_fact *own, cdb_unknown unknown, int is_wide, uint64_t *rows, size_t room, cdb_fault *fault)
{
    const uint64_t *masks[CDBI_MASKS], *mask, *from = table->enabled;
    size_t n = 0, i, n_words = table->n_words;
    int has_others = 0, is_missing;
    cdb_status status;
    masks[0] = NULL;
    memset(rows, 0, room * sizeof *rows);
    if (room < n_words)
        return cdbi_fault(fault, CDB_TOO_SHORT, "the array for the rows is shorter than a mask of the table", -1, "");
    status = cdbi_derived(table, schema, &facts, own, unknown, fault);
    if (status != CDB_OK) return status;
    for (i = 0; i < schema->n_conditions; i++) {
        if (columns[i].kind == 0) continue;
        is_missing = cdbi_is_missing(&schema->conditions[i], &facts[i]);
        if (is_missing && unknown == CDB_UNKNOWN_ANY) continue;
        if (is_missing ? unknown == CDB_UNKNOWN_ERROR : cdbi_is_wrong(&schema->conditions[i], &facts[i])) break;
        mask = !is_missing && cdbi_is_widened(&columns[i], is_wide) ? NULL
            : cdbi_mask(&columns[i], &schema->conditions[i], &facts[i], is_missing, n_words);
        if (!mask) has_others = 1;
        else masks[n++] = mask;
        if (n == CDBI_MASKS) {
            cdbi_and(rows, from, masks, n, n_words);
            from = rows;
            n = 0;
        }
    }
    if (i == schema->n_conditions) {
        cdbi_and(rows, from, masks, n, n_words);
        if (has_others) cdbi_and_others(rows, table, columns, schema, facts, unknown, is_wide);
        status = table->has_programs ? cdbi_and_rules(rows, table, schema, facts, unknown, fault) : CDB_OK;
        if (status == CDB_OK) return cdbi_fault(fault, CDB_OK, "", -1, "");
    } else if (cdbi_is_missing(&schema->conditions[i], &facts[i])) status = cdbi_missing_fault(fault, table, schema, facts, i);
    else status = cdbi_fact_fault(fault, CDB_WRONG_FACT, schema, i);
    memset(rows, 0, n_words * sizeof *rows);
    return status;
}

/* See cdbi_query_as. */
static inline cdb_status cdbi_query(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema, const cdb_fact *facts,
    cdb_fact *own, cdb_unknown unknown, uint64_t *rows, size_t room, cdb_fault *fault)
{
    return cdbi_query_as(table, columns, schema, facts, own, unknown, 0, rows, room, fault);
}

/* The valid rows for some facts, which stay as they are: those of derived conditions are passed over. See cdbi_query_as. */
CDB_API cdb_status cdb_query(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema, const cdb_fact *facts,
    cdb_unknown unknown, uint64_t *rows, size_t room, cdb_fault *fault)
{
    cdb_fact own[CDB_MOST_FACTS];
    return cdbi_query(table, columns, schema, facts, own, unknown, rows, room, fault);
}

/* The same where what plays already is concerned: a row is valid too where its facts are within the hysteresis of their conditions beyond
 * its cells. */
CDB_API cdb_status cdb_query_widened(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact *facts, cdb_unknown unknown, uint64_t *rows, size_t room, cdb_fault *fault)
{
    cdb_fact own[CDB_MOST_FACTS];
    return cdbi_query_as(table, columns, schema, facts, own, unknown, 1, rows, room, fault);
}

/* The same as cdb_query for `n` contexts, whose facts stand one after another, as do their rows, n_words for each. Of a context with a fault no
 * row is valid, the others are answered; gives the first fault, with the number of its context in *context. */
CDB_API cdb_status cdb_query_many(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact *facts, size_t n, cdb_unknown unknown, uint64_t *rows, size_t *context, cdb_fault *fault)
{
    cdb_fact own[CDB_MOST_FACTS];
    cdb_status first = cdbi_fault(fault, CDB_OK, "", -1, "");
    size_t i;
    for (i = 0; i < n; i++) {
        cdb_status status = cdbi_query(table, columns, schema, facts + i * schema->n_conditions, own, unknown, rows + i * table->n_words,
            table->n_words, first == CDB_OK ? fault : NULL);
        if (first == CDB_OK && status != CDB_OK) *context = i;
        if (first == CDB_OK) first = status;
    }
    return first;
}

/* ---- Answers */

CDB_API int64_t cdb_count(const uint64_t *rows, size_t n_words)
{
    uint64_t count = 0;
    size_t i;
    for (i = 0; i < n_words; i++) count += cdbi_count_bits(rows[i]);
    return (int64_t)count;
}

/* The next valid row behind `row`; -1 behind the last. The first one: behind -1. */
CDB_API int64_t cdb_next_row(const uint64_t *rows, size_t n_words, int64_t row)
{
    size_t at = (size_t)((row + 1) / 64);
    uint64_t word = at < n_words ? rows[at] & (~(uint64_t)0 << ((row + 1) % 64)) : 0;
    while (word == 0) {
        if (++at >= n_words) return -1;
        word = rows[at];
    }
    return (int64_t)(at * 64 + cdbi_first_bit(word));
}

/* The number of a row's asset, from 0 up to, not including, n_assets; -1 for a row that is not there. It holds for this version of
 * the table; the key of an asset, asset_keys[row], is a hash of its name, which holds for all. */
CDB_API int32_t cdb_asset_number(const cdb_table *table, int64_t row)
{
    return row >= 0 && (uint64_t)row < table->n_rows ? table->asset_numbers[row] : -1;
}

/* The name of a row's asset, in UTF-8; NULL for a row that is not there. */
CDB_API const char *cdb_asset(const cdb_table *table, int64_t row)
{
    return row >= 0 && (uint64_t)row < table->n_rows ? table->assets[row] : NULL;
}

/* ---- Facts that are missing, and lists of facts */

/* A date of the calendar as whole days since 1970-01-01: cdb_date(2026, 1, 31). */
CDB_API int64_t cdb_date(int year, int month, int day)
{
    int64_t since_march = month > 2 ? month - 3 : month + 9, y = (int64_t)year - (month <= 2);
    int64_t era = (y >= 0 ? y : y - 399) / 400, of_era = y - era * 400;
    return era * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + (153 * since_march + 2) / 5 + day - 1 - 719468;
}

/* Put a tag into a set of declared tags, which is then known. */
CDB_API void cdb_add_tag(uint64_t *words, size_t tag)
{
    words[0] |= 1;
    words[tag / 64] |= (uint64_t)1 << (tag % 64);
}
