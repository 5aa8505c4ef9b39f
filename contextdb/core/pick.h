
/* ---- Picking one of the valid rows, by the policy of the table, and of each table inside it
 *
 * The memory of a character is a cdb_picker, the caller's own: copied, it goes on as two; saved and read, it goes on later. It knows
 * assets and rows by hashes of their names, so it goes on with the next version of the table. The picks are those that
 * `compiled.picker(seed, memory)` of Python gives for the same seed, character and answers. */

#ifndef CDB_MEMORY
#define CDB_MEMORY 8                /* so many of the last assets can be remembered */
#endif

typedef struct cdb_rest {           /* a row that was picked and that rests: all 0 where there is none */
    uint64_t key;
    int64_t turn;
    double time_s;
} cdb_rest;

typedef struct cdb_picker {
    uint64_t seed;
    int64_t who;                    /* the number of the character */
    int64_t turn;                   /* how often it has picked */
    size_t memory;                  /* how many of the last assets are not picked again while there is another choice */
    uint64_t recent[CDB_MEMORY];    /* the last assets, the latest first; 0 for none */
    cdb_rest *rests;                /* your array, for tables with rows that rest (once, cooldowns); all 0 at first */
    size_t n_rests;                 /* at least as many as the table has of them, n_limited */
} cdb_picker;

/* A character that has picked nothing yet, and whose rows do not rest: give `rests` and `n_rests` where they do. */
CDB_API cdb_picker cdb_new_picker(uint64_t seed, int64_t who, size_t memory)
{
    cdb_picker picker;
    memset(&picker, 0, sizeof picker);
    picker.seed = seed;
    picker.who = who;
    picker.memory = memory < CDB_MEMORY ? memory : CDB_MEMORY;
    return picker;
}

/* A number in [0, 1) that depends on seed, character, turn and depth alone: SplitMix64. */
static inline double cdbi_chance(const cdb_picker *picker, size_t depth)
{
    const uint64_t parts[3] = {(uint64_t)picker->who, (uint64_t)picker->turn, (uint64_t)depth};
    uint64_t z = picker->seed;
    int i;
    for (i = 0; i < 3; i++) {
        z += (parts[i] + 1) * 0x9E3779B97F4A7C15;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
        z ^= z >> 31;
    }
    return cdbi_product((double)(z >> 11), 1.1102230246251565e-16);
}

typedef struct cdbi_pick {
    const cdb_table *table;
    const cdb_schema *schema;
    const cdb_fact *facts;
    const uint64_t *rows;
    const cdb_picker *picker;
    cdb_unknown unknown;
    double time_s;
    int is_refused;                 /* several rows of a table that allows one */
} cdbi_pick;

static inline int64_t cdbi_number_at(const cdb_table *table, size_t depth, size_t row)
{
    if (depth >= table->n_depths) return -1;
    return table->way_numbers ? table->way_numbers[depth * table->n_rows + row] : 0;
}

static inline const cdbi_level *cdbi_level_at(const cdb_table *table, size_t depth, size_t row)
{
    return &table->levels[cdbi_number_at(table, depth, row)];
}

static inline size_t cdbi_taken(const cdb_table *table, size_t depth, size_t row)
{
    return table->way_rows ? (size_t)table->way_rows[depth * table->n_rows + row] : row;
}

/* Where a row that rests is in the memory of a picker, or would be; NULL where there is no room. */
static inline cdb_rest *cdbi_find_rest(const cdb_picker *picker, uint64_t key)
{
    size_t i, at;
    for (i = 0; i < picker->n_rests; i++) {
        at = (size_t)((key + i) % picker->n_rests);
        if (picker->rests[at].key == key || picker->rests[at].key == 0) return &picker->rests[at];
    }
    return NULL;
}

static inline int cdbi_rests(const cdbi_pick *pick, const cdbi_level *level, size_t at)
{
    const cdb_rest *rest;
    if (!level->keys || level->keys[at] == 0) return 0;
    rest = cdbi_find_rest(pick->picker, level->keys[at]);
    if (!rest || rest->key == 0) return 0;
    if (level->once && level->once[at]) return 1;
    if (level->cooldown_turns && pick->picker->turn - rest->turn <= level->cooldown_turns[at]) return 1;
    if (!level->cooldown_s || !cdbi_is_less(0.0, level->cooldown_s[at])) return 0;
    return pick->time_s < cdbi_sum(rest->time_s, level->cooldown_s[at]);
}

/* Whether a row has a weight wherever chance decides, and does not rest. */
static inline int cdbi_is_usable(const cdbi_pick *pick, size_t row)
{
    size_t depth;
    for (depth = 0; cdbi_number_at(pick->table, depth, row) >= 0; depth++) {
        const cdbi_level *level = cdbi_level_at(pick->table, depth, row);
        size_t at = cdbi_taken(pick->table, depth, row);
        if (level->choose == CDB_CHANCE && !cdbi_is_less(0.0, level->row_weights[at])) return 0;
        if (cdbi_rests(pick, level, at)) return 0;
    }
    return 1;
}

/* The next usable valid row from `row` on; `to` where there is none before it. */
static inline size_t cdbi_next_usable(const cdbi_pick *pick, size_t row, size_t to)
{
    while (row < to) {
        int64_t next = cdb_next_row(pick->rows, pick->table->n_words, (int64_t)row - 1);
        if (next < 0 || (size_t)next >= to) return to;
        row = (size_t)next;
        if (cdbi_is_usable(pick, row)) return row;
        row++;
    }
    return to;
}

/* Where the rows end that take the same row at a depth. */
static inline size_t cdbi_part_end(const cdb_table *table, size_t depth, size_t row, size_t to)
{
    size_t taken = cdbi_taken(table, depth, row);
    if (!table->way_rows) return row + 1;
    while (row < to && cdbi_taken(table, depth, row) == taken) row++;
    return row;
}

/* Whether the policy of a depth prefers a row to another one: 1; the other one: -1; neither: 0. */
static inline int cdbi_order(const cdbi_pick *pick, size_t depth, size_t row, size_t other)
{
    const cdbi_level *level = cdbi_level_at(pick->table, depth, row);
    size_t one = cdbi_taken(pick->table, depth, row), two = cdbi_taken(pick->table, depth, other);
    double a = level->ranks[one], b = level->ranks[two];
    if (one == two) return 0;
    if (cdbi_place(a) != cdbi_place(b)) return cdbi_place(a) > cdbi_place(b) ? 1 : -1;
    if (!level->by_cost) return 0;
    b = cdbi_cost(pick->table, pick->schema, pick->facts, pick->unknown, 0, depth, row);
    a = cdbi_cost(pick->table, pick->schema, pick->facts, pick->unknown, 0, depth, other);
    return cdbi_place(a) == cdbi_place(b) ? 0 : cdbi_place(a) > cdbi_place(b) ? 1 : -1;
}

/* A row that the policy of a depth prefers to none of the others between `from` and `to`; `to` where none is usable. */
static inline size_t cdbi_best(cdbi_pick *pick, size_t depth, size_t from, size_t to)
{
    size_t row = cdbi_next_usable(pick, from, to), best = row, n_parts = 0;
    int is_unique = row < to && cdbi_level_at(pick->table, depth, row)->choose == CDB_REFUSE;
    while (row < to) {
        n_parts++;
        if (row != best && cdbi_order(pick, depth, row, best) > 0) best = row;
        row = cdbi_next_usable(pick, cdbi_part_end(pick->table, depth, row, to), to);
    }
    if (is_unique && n_parts > 1) pick->is_refused = 1;
    return best;
}

/* How many picks ago the asset of a row was picked, from 0; `memory` where that is not remembered. */
static inline size_t cdbi_age(const cdbi_pick *pick, size_t row)
{
    size_t age = 0;
    if (!pick->table->has_chance) return 0;
    while (age < pick->picker->memory && pick->picker->recent[age] != pick->table->asset_keys[row]) age++;
    return age;
}

/* Of the rows between `from` and `to` that the policies may pick how long ago the asset was picked that was so least lately, plus 1;
 * 0 where there is none. */
static inline size_t cdbi_oldest(cdbi_pick *pick, size_t depth, size_t from, size_t to)
{
    size_t best = cdbi_best(pick, depth, from, to), row = best < to ? cdbi_next_usable(pick, from, to) : to, oldest = 0;
    while (row < to) {
        size_t end = cdbi_part_end(pick->table, depth, row, to), age = 0;
        if (cdbi_order(pick, depth, row, best) == 0)
            age = cdbi_number_at(pick->table, depth + 1, row) < 0 ? cdbi_age(pick, row) + 1 : cdbi_oldest(pick, depth + 1, row, end);
        if (age > oldest) oldest = age;
        row = cdbi_next_usable(pick, end, to);
    }
    return oldest;
}

/* The next part between `row` and `to` that may be picked, where chance decides between such parts. */
static inline size_t cdbi_next_part(cdbi_pick *pick, size_t depth, size_t row, size_t to, size_t best, size_t oldest)
{
    for (row = cdbi_next_usable(pick, row, to); row < to;) {
        size_t end = cdbi_part_end(pick->table, depth, row, to);
        if (cdbi_order(pick, depth, row, best) == 0) {
            int is_leaf = cdbi_number_at(pick->table, depth + 1, row) < 0;
            if ((is_leaf ? cdbi_age(pick, row) + 1 : cdbi_oldest(pick, depth + 1, row, end)) == oldest) return row;
        }
        row = cdbi_next_usable(pick, end, to);
    }
    return to;
}

/* One of the rows between `from` and `to`: at each depth by the weights of that table's rows. */
static inline size_t cdbi_drawn(cdbi_pick *pick, size_t oldest)
{
    size_t depth = 0, from = 0, to = pick->table->n_rows;
    for (;;) {
        size_t best = cdbi_best(pick, depth, from, to), row = cdbi_next_part(pick, depth, from, to, best, oldest), first = row, end, n = 0;
        double most = 0.0, total = 0.0, sum = 0.0, weight;
        const cdbi_level *level = cdbi_level_at(pick->table, depth, first);
        int is_weighted = level->choose == CDB_CHANCE;
        for (; row < to; n++) {
            weight = is_weighted ? level->row_weights[cdbi_taken(pick->table, depth, row)] : 1.0;
            if (n == 0 || cdbi_is_less(most, weight)) most = weight;
            row = cdbi_next_part(pick, depth, cdbi_part_end(pick->table, depth, row, to), to, best, oldest);
        }
        if (n > 1) {
            int pass;
            for (pass = 0; pass < 2; pass++) {
                size_t next = first;
                sum = 0.0;
                while (next < to) {
                    row = next;
                    weight = is_weighted ? level->row_weights[cdbi_taken(pick->table, depth, row)] : 1.0;
                    sum = cdbi_sum(sum, cdbi_ratio(weight, most));
                    if (pass == 1 && cdbi_is_less(cdbi_product(cdbi_chance(pick->picker, depth), total), sum)) break;
                    next = cdbi_next_part(pick, depth, cdbi_part_end(pick->table, depth, row, to), to, best, oldest);
                }
                total = sum;
            }
            first = row;
        }
        end = cdbi_part_end(pick->table, depth, first, to);
        if (cdbi_number_at(pick->table, depth + 1, first) < 0) return first;
        depth++;
        from = first;
        to = end;
    }
}

/* The row that is picked, -1 for none, through any depths of tables. */
static inline int64_t cdbi_pick_of_many(cdbi_pick *pick)
{
    size_t oldest = cdbi_oldest(pick, 0, 0, pick->table->n_rows);
    return oldest > 0 && !pick->is_refused ? (int64_t)cdbi_drawn(pick, oldest) : -1;
}

#define CDBI_FEW 64                 /* rows of the highest rank that are listed */
#define CDBI_TOO_MANY (-2)

/* Of some rows one by their weights: see cdbi_drawn, which does the same without a list. */
static inline size_t cdbi_drawn_of(const cdbi_pick *pick, const cdbi_level *level, const size_t *list, size_t n)
{
    double weights[CDBI_FEW], sums[CDBI_FEW], most = 0.0, sum = 0.0, wanted;
    size_t i;
    for (i = 0; i < n; i++) {
        weights[i] = level->choose == CDB_CHANCE ? level->row_weights[list[i]] : 1.0;
        if (i == 0 || cdbi_is_less(most, weights[i])) most = weights[i];
    }
    for (i = 0; i < n; i++) sums[i] = sum = cdbi_sum(sum, cdbi_ratio(weights[i], most));
    wanted = cdbi_product(cdbi_chance(pick->picker, 0), sum);
    for (i = 0; i + 1 < n && !cdbi_is_less(wanted, sums[i]); i++) {}
    return list[i];
}

/* The same for a table without tables inside, in one walk; CDBI_TOO_MANY where the list of the best rows is too short. */
static inline int64_t cdbi_pick_of_few(cdbi_pick *pick)
{
    const cdb_table *table = pick->table;
    const cdbi_level *level = &table->levels[0];
    size_t list[CDBI_FEW], ages[CDBI_FEW], n = 0, n_parts = 0, oldest = 0, w, i;
    uint64_t best = 0, best_cost = 0;
    for (w = 0; w < table->n_words; w++) {
        uint64_t word = pick->rows[w];
        for (; word; word &= word - 1) {
            size_t row = w * 64 + cdbi_first_bit(word);
            uint64_t rank = cdbi_place(level->ranks[row]), cost = 0;
            if (level->choose == CDB_CHANCE && !cdbi_is_less(0.0, level->row_weights[row])) continue;
            if (level->keys && cdbi_rests(pick, level, row)) continue;
            n_parts++;
            if (n > 0 && rank < best) continue;
            if (level->by_cost) cost = cdbi_place(cdbi_cost(table, pick->schema, pick->facts, pick->unknown, 0, 0, row));
            if (n > 0 && rank == best && cost > best_cost) continue;
            if (rank != best || cost != best_cost) n = 0;
            if (n == CDBI_FEW) return CDBI_TOO_MANY;
            best = rank;
            best_cost = cost;
            list[n++] = row;
        }
    }
    pick->is_refused = level->choose == CDB_REFUSE && n_parts > 1;
    if (n == 0 || pick->is_refused) return -1;
    if (n == 1) return (int64_t)list[0];
    for (i = 0; i < n; i++) {
        ages[i] = cdbi_age(pick, list[i]);
        if (ages[i] > oldest) oldest = ages[i];
    }
    for (w = 0, i = 0; i < n; i++)
        if (ages[i] == oldest) list[w++] = list[i];
    return (int64_t)(w == 1 ? list[0] : cdbi_drawn_of(pick, level, list, w));
}

/* Let a row rest that was picked; 0 where the picker has no room to remember it. */
static inline int cdbi_let_rest(const cdb_table *table, cdb_picker *picker, size_t row, double time_s, int is_trial)
{
    size_t depth;
    for (depth = 0; cdbi_number_at(table, depth, row) >= 0; depth++) {
        const cdbi_level *level = cdbi_level_at(table, depth, row);
        uint64_t key = level->keys ? level->keys[cdbi_taken(table, depth, row)] : 0;
        cdb_rest *rest = key ? cdbi_find_rest(picker, key) : NULL;
        if (key && !rest) return 0;
        if (!key || is_trial) continue;
        rest->key = key;
        rest->turn = picker->turn;
        rest->time_s = time_s;
    }
    return 1;
}

/* Pick one of the valid rows that a query gave: *row, or -1 where none can be picked and the fallback is in force (cdb_asset_of).
 * `facts` are needed for the policy "cheapest" alone; `time_s` is the time of the game, for rows that rest for seconds. Each call is
 * a turn of the character, with and without a row; one that gives a fault is none. */
CDB_API cdb_status cdb_pick(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact *facts, cdb_unknown unknown, const uint64_t *rows, size_t room, double time_s, cdb_picker *picker, int64_t *row,
    cdb_fault *fault)
{
    cdbi_pick pick;
    cdb_fact own[CDB_MOST_FACTS];
    size_t i;
    int64_t picked;
    cdb_status status = CDB_OK;
    *row = -1;
    if (room < table->n_words)
        return cdbi_fault(fault, CDB_TOO_SHORT, "the array for the rows is shorter than a mask of the table", -1, "");
    if (table->soft && table->by_cost) status = cdbi_ready(table, columns, schema, &facts, own, unknown, fault);
    if (status != CDB_OK) return status;
    pick.table = table;
    pick.schema = schema;
    pick.facts = facts;
    pick.rows = rows;
    pick.picker = picker;
    pick.unknown = unknown;
    pick.time_s = time_s;
    pick.is_refused = 0;
    picked = table->way_rows ? CDBI_TOO_MANY : cdbi_pick_of_few(&pick);
    if (picked == CDBI_TOO_MANY) picked = cdbi_pick_of_many(&pick);
    if (pick.is_refused)
        return cdbi_fault(fault, CDB_NOT_UNIQUE, "several rows are valid at once, and the policy of their table is \"unique\"", -1, "");
    if (picked >= 0) {
        if (!cdbi_let_rest(table, picker, (size_t)picked, time_s, 1))
            return cdbi_fault(fault, CDB_TOO_SHORT, "the picker has no room for another row that rests", -1, table->assets[picked]);
        cdbi_let_rest(table, picker, (size_t)picked, time_s, 0);
        for (i = picker->memory; i > 1; i--) picker->recent[i - 1] = picker->recent[i - 2];
        if (picker->memory > 0) picker->recent[0] = table->asset_keys[picked];
        *row = picked;
    }
    picker->turn++;
    return cdbi_fault(fault, CDB_OK, "", -1, "");
}

/* The asset of a row that was picked, or the fallback of the table for -1; NULL where it has none. */
CDB_API const char *cdb_asset_of(const cdb_table *table, int64_t picked)
{
    return picked < 0 ? table->fallback : cdb_asset(table, picked);
}

/* The next row behind `row` that has this asset, with the path that it has in a table inside the table; -1 behind the last. */
CDB_API int64_t cdb_next_row_of(const cdb_table *table, const char *asset, int64_t row)
{
    for (row++; row >= 0 && (uint64_t)row < table->n_rows; row++)
        if (strcmp(table->assets[row], asset) == 0) return row;
    return -1;
}
