/* ---- Choosing among the valid rows of many contexts, by the policies of tables that are in each other, and what characters picked.
 *
 * D = depths of tables inside tables (1 without), n rows, W words a mask, C characters, k assets that are remembered. Of the valid rows
 * those that rest go out, then those that a policy does not prefer, then those whose asset was picked lately, the latest first; chance
 * decides by weight between the others, depth by depth. A choice needs room for n rows; games, which have none, pick with pick.h. */

typedef struct cdbi_choices {       /* what of a table decides between its rows */
    size_t n_rows, n_words, n_depths;
    const int64_t *taken;           /* [D, n] the row that each row's way takes; -1 below its end */
    const int64_t *groups;          /* [D, n] a number for what the way is above each depth, ascending */
    const double *ranks, *weights;  /* [D, n] higher first, within a group; how often a row is picked among equals */
    const unsigned char *is_unique, *is_cheapest; /* [D, n] under which policy the row is taken */
    const uint64_t *pickable;       /* [W] no weight of the way is 0 where chance decides */
    const uint64_t *levels;         /* [n_levels, W] the rows of each rank, the highest first; none where they are many */
    size_t n_levels;
    const double *shares;           /* [n] each weight over the highest; NULL where there are depths */
    const uint64_t *heaviest;       /* [W] the rows of the highest weight */
    int is_even;                    /* without depths, and all rows have one weight */
    int remembers;                  /* chance decides somewhere: assets that were picked lately are left out */
    const int64_t *assets;          /* [n] the number of each row's asset */
    const int64_t *asset_rows;      /* the rows of asset a are asset_rows[asset_starts[a]] up to asset_rows[asset_starts[a + 1]] */
    const int64_t *asset_starts;
    size_t n_assets;
    const int64_t *limit_of;        /* [D, n] the number of the rest of each row that is taken, or -1 */
    const int64_t *limit_rows, *limit_starts; /* the rows that go out while it rests, as those of assets */
    const unsigned char *once;
    const double *cooldown_s;
    const int64_t *cooldown_turns;
    const int64_t *columns;         /* [n_limits] the number of each rest in the memory of characters */
    size_t n_limits;
    const int64_t *limit_of_column; /* [n_columns] the rest of a number in this version of the table, or -1 */
    size_t n_columns;
} cdbi_choices;

typedef struct cdbi_picked {        /* what characters have picked */
    int64_t *turns;                 /* [C] how often each has picked */
    int64_t *recent;                /* [C, k] the last assets, the latest first; -1 for none */
    int64_t *rests;                 /* [C, r] the rows that rest, by their numbers; -1 for none */
    int64_t *rest_turns;            /* [C, r] when they were picked */
    double *rest_s;
    size_t n_characters, memory, n_rests;
} cdbi_picked;

typedef struct cdbi_turn {          /* one turn of one character */
    const cdbi_choices *choices;
    const cdbi_picked *picked;
    uint64_t seed;
    int64_t who;
    size_t slot;
    double time_s;
    const double *costs;            /* of valid row i of the context at depth d costs[d * n_costs + i]; NULL where none is needed */
    size_t n_costs;
    uint64_t *awake, *rows;         /* [W] room */
    int64_t *list, *places;         /* [n] room: rows, and the place of each among the valid ones */
    double *sums;                   /* [n] room */
} cdbi_turn;

/* Whether a rest that a character remembers is not over. */
static inline int cdbi_is_resting(const cdbi_choices *choices, const cdbi_picked *picked, size_t slot, size_t at, double time_s)
{
    size_t place = slot * picked->n_rests + at;
    int64_t column = picked->rests[place], limit;
    if (column < 0 || (uint64_t)column >= choices->n_columns) return 0;
    limit = choices->limit_of_column[column];
    if (limit < 0) return 0;
    if (choices->once[limit] || picked->turns[slot] - picked->rest_turns[place] <= choices->cooldown_turns[limit]) return 1;
    return choices->cooldown_s[limit] > 0.0 && time_s < picked->rest_s[place] + choices->cooldown_s[limit];
}

static inline int cdbi_is_any_row(const uint64_t *rows, size_t n_words)
{
    uint64_t some = 0;
    size_t w;
    for (w = 0; w < n_words; w++) some |= rows[w];
    return some != 0;
}

/* Take the rows that rest out of the valid ones. */
static inline void cdbi_wake(const cdbi_turn *turn, const uint64_t *valid)
{
    const cdbi_choices *choices = turn->choices;
    size_t at;
    int64_t i;
    memcpy(turn->awake, valid, choices->n_words * sizeof *valid);
    for (at = 0; choices->n_limits > 0 && at < turn->picked->n_rests; at++) {
        int64_t limit;
        if (!cdbi_is_resting(choices, turn->picked, turn->slot, at, turn->time_s)) continue;
        limit = choices->limit_of_column[turn->picked->rests[turn->slot * turn->picked->n_rests + at]];
        for (i = choices->limit_starts[limit]; i < choices->limit_starts[limit + 1]; i++)
            turn->awake[choices->limit_rows[i] / 64] &= ~((uint64_t)1 << (choices->limit_rows[i] % 64));
    }
}

/* List the rows of a mask; `places` gets the place of each among the valid ones. Gives how many there are. */
static inline size_t cdbi_list_mask(const uint64_t *rows, const uint64_t *valid, size_t n_words, int64_t *list, int64_t *places)
{
    size_t w, n = 0;
    int64_t before = 0;
    for (w = 0; w < n_words; w++) {
        uint64_t word = rows[w];
        for (; word; word &= word - 1, n++) {
            size_t bit = cdbi_first_bit(word);
            list[n] = (int64_t)(w * 64 + bit);
            if (places) places[n] = before + (int64_t)cdbi_count_bits(valid[w] & (((uint64_t)1 << bit) - 1));
        }
        if (places) before += (int64_t)cdbi_count_bits(valid[w]);
    }
    return n;
}

/* Of rows `from` up to `to` of the list, which are of one table, those that its policy prefers, to `to_keep` on; -1 where it allows one and
 * there are several. */
static inline int64_t cdbi_prefer(const cdbi_turn *turn, size_t depth, size_t from, size_t to, size_t to_keep)
{
    const cdbi_choices *choices = turn->choices;
    const double *ranks = choices->ranks + depth * choices->n_rows;
    const int64_t *taken = choices->taken + depth * choices->n_rows;
    const int64_t *list = turn->list;
    double best = ranks[list[from]];
    size_t i, n = to_keep, first = to_keep;
    if (choices->is_unique[depth * choices->n_rows + (size_t)list[from]])
        for (i = from; i < to; i++)
            if (taken[list[i]] != taken[list[from]]) return -1;
    for (i = from; i < to; i++)
        if (ranks[list[i]] > best) best = ranks[list[i]];
    for (i = from; i < to; i++)
        if (ranks[list[i]] == best) {
            if (turn->costs) turn->places[n] = turn->places[i];
            turn->list[n++] = list[i];
        }
    if (turn->costs && n - first > 1 && choices->is_cheapest[depth * choices->n_rows + (size_t)turn->list[first]]) {
        const double *costs = turn->costs + depth * turn->n_costs;
        double least = costs[turn->places[first]];
        size_t stop = n;
        for (i = first; i < stop; i++)
            if (costs[turn->places[i]] < least) least = costs[turn->places[i]];
        for (n = first, i = first; i < stop; i++)
            if (costs[turn->places[i]] == least) {
                turn->places[n] = turn->places[i];
                turn->list[n++] = turn->list[i];
            }
    }
    return (int64_t)n;
}

/* Of the rows of the mask those that the policies may pick, in the mask; -1, or the depth at which one is refused: the rows of its table
 * are then list[0] up to list[*n_refused]. */
static inline int64_t cdbi_allow(const cdbi_turn *turn, const uint64_t *valid, size_t *n_refused)
{
    const cdbi_choices *choices = turn->choices;
    size_t n_words = choices->n_words, depth, i, n, level, w;
    if (choices->n_levels > 0 && !turn->costs) {
        for (level = 0; level < choices->n_levels; level++) {
            uint64_t some = 0;
            for (w = 0; w < n_words; w++) some |= turn->rows[w] & choices->levels[level * n_words + w];
            if (!some) continue;
            for (w = 0; w < n_words; w++) turn->rows[w] &= choices->levels[level * n_words + w];
            break;
        }
        return -1;
    }
    n = cdbi_list_mask(turn->rows, valid, n_words, turn->list, turn->costs ? turn->places : NULL);
    for (depth = 0; depth < choices->n_depths; depth++) {
        const int64_t *groups = choices->groups + depth * choices->n_rows;
        size_t from, to, to_keep = 0;
        for (from = 0; from < n; from = to) {
            int64_t next;
            for (to = from + 1; to < n && groups[turn->list[to]] == groups[turn->list[from]]; to++) {}
            next = cdbi_prefer(turn, depth, from, to, to_keep);
            if (next < 0) {
                for (i = from; i < to; i++) turn->list[i - from] = turn->list[i];
                *n_refused = to - from;
                return (int64_t)depth;
            }
            to_keep = (size_t)next;
        }
        n = to_keep;
    }
    memset(turn->rows, 0, n_words * sizeof *turn->rows);
    for (i = 0; i < n; i++) turn->rows[turn->list[i] / 64] |= (uint64_t)1 << (turn->list[i] % 64);
    return -1;
}

/* Leave the rows out of the mask whose asset was picked lately, as long as others are left. */
static inline void cdbi_refresh(const cdbi_turn *turn)
{
    const cdbi_choices *choices = turn->choices;
    const cdbi_picked *picked = turn->picked;
    size_t place;
    int64_t i;
    for (place = 0; place < picked->memory; place++) {
        int64_t asset = picked->recent[turn->slot * picked->memory + place], is_cut = 0;
        if (asset < 0 || (uint64_t)asset >= choices->n_assets) continue;
        for (i = choices->asset_starts[asset]; i < choices->asset_starts[asset + 1]; i++) {
            uint64_t *word = &turn->rows[choices->asset_rows[i] / 64], bit = (uint64_t)1 << (choices->asset_rows[i] % 64);
            turn->list[i - choices->asset_starts[asset]] = (*word & bit) != 0;
            is_cut |= (*word & bit) != 0;
            *word &= ~bit;
        }
        if (!is_cut || cdbi_is_any_row(turn->rows, choices->n_words)) continue;
        for (i = choices->asset_starts[asset]; i < choices->asset_starts[asset + 1]; i++)
            if (turn->list[i - choices->asset_starts[asset]])
                turn->rows[choices->asset_rows[i] / 64] |= (uint64_t)1 << (choices->asset_rows[i] % 64);
    }
}

static inline double cdbi_turn_chance(const cdbi_turn *turn, size_t depth)
{
    cdb_picker picker = cdb_new_picker(turn->seed, turn->who, 0);
    picker.turn = turn->picked->turns[turn->slot];
    return cdbi_chance(&picker, depth);
}

/* Where chance hits running sums of n weights. */
static inline size_t cdbi_hit(const double *sums, size_t n, double chance)
{
    double wanted = chance * sums[n - 1];
    size_t low = 0, high = n;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (sums[middle] <= wanted) low = middle + 1;
        else high = middle;
    }
    return low < n ? low : n - 1;
}

/* Make running sums of n weights, each over the highest of them. */
static inline void cdbi_sum_up(double *weights, size_t n)
{
    double most = weights[0], sum = 0.0;
    size_t i;
    for (i = 1; i < n; i++)
        if (weights[i] > most) most = weights[i];
    for (i = 0; i < n; i++) {
        sum += weights[i] / most;
        weights[i] = sum;
    }
}

/* One of the rows of a mask with a row of the highest weight: the running sums are those of the shares. */
static inline int64_t cdbi_draw_by_shares(const cdbi_turn *turn)
{
    const double *shares = turn->choices->shares;
    double sum = 0.0;
    size_t w, n = 0;
    for (w = 0; w < turn->choices->n_words; w++) {
        uint64_t word = turn->rows[w];
        for (; word; word &= word - 1, n++) {
            turn->list[n] = (int64_t)(w * 64 + cdbi_first_bit(word));
            sum += shares[turn->list[n]];
            turn->sums[n] = sum;
        }
    }
    return turn->list[n > 1 ? cdbi_hit(turn->sums, n, cdbi_turn_chance(turn, 0)) : 0];
}

/* One of the rows of the mask: at each depth by the weights of that table's rows. -1 where there is none. */
static inline int64_t cdbi_draw(const cdbi_turn *turn)
{
    const cdbi_choices *choices = turn->choices;
    size_t depth, n, from = 0, to, i, w;
    if (choices->is_even) {
        int64_t count = cdb_count(turn->rows, choices->n_words), wanted;
        if (count == 0) return -1;
        wanted = count == 1 ? 0 : (int64_t)(cdbi_turn_chance(turn, 0) * (double)count);
        if (wanted > count - 1) wanted = count - 1;
        for (w = 0;; w++) {
            int64_t own = (int64_t)cdbi_count_bits(turn->rows[w]);
            uint64_t word = turn->rows[w];
            if (wanted >= own) {
                wanted -= own;
                continue;
            }
            for (; wanted > 0; wanted--) word &= word - 1;
            return (int64_t)(w * 64 + cdbi_first_bit(word));
        }
    }
    for (w = 0; choices->shares && w < choices->n_words; w++)
        if (turn->rows[w] & choices->heaviest[w]) return cdbi_draw_by_shares(turn);
    n = cdbi_list_mask(turn->rows, NULL, choices->n_words, turn->list, NULL);
    if (n == 0) return -1;
    to = n;
    for (depth = 0; depth < choices->n_depths && to - from > 1; depth++) {
        const int64_t *taken = choices->taken + depth * choices->n_rows;
        const double *weights = choices->weights + depth * choices->n_rows;
        size_t n_parts = 0, part, at;
        for (i = from; i < to; i++)
            if (i == from || taken[turn->list[i]] != taken[turn->list[i - 1]]) turn->sums[n_parts++] = weights[turn->list[i]];
        if (n_parts < 2) continue;
        cdbi_sum_up(turn->sums, n_parts);
        part = cdbi_hit(turn->sums, n_parts, cdbi_turn_chance(turn, depth));
        for (at = 0, i = from; i < to && at <= part; i++) {
            if (i > from && taken[turn->list[i]] != taken[turn->list[i - 1]]) at++;
            if (at == part && (i == from || taken[turn->list[i]] != taken[turn->list[i - 1]])) n = i;
            if (at > part) break;
        }
        from = n;
        to = i;
    }
    return turn->list[from];
}

/* The row that a character picks of valid ones, -1 for none; -2 where a policy refuses several rows: `*depth` is then that of its table,
 * and its rows are list[0] up to list[*n_refused]. `stages`, where it is given, gets the masks of the rows that do not rest, that the
 * policies may pick, and that were picked least lately: [3, W]. */
static inline int64_t cdbi_choose(const cdbi_turn *turn, const uint64_t *valid, uint64_t *stages, int64_t *depth, size_t *n_refused)
{
    const cdbi_choices *choices = turn->choices;
    size_t n_words = choices->n_words, w;
    cdbi_wake(turn, valid);
    for (w = 0; w < n_words; w++) turn->rows[w] = turn->awake[w] & choices->pickable[w];
    *depth = cdbi_allow(turn, valid, n_refused);
    if (*depth >= 0) return -2;
    if (stages) memcpy(stages, turn->awake, n_words * sizeof *stages);
    if (stages) memcpy(stages + n_words, turn->rows, n_words * sizeof *stages);
    if (choices->remembers) cdbi_refresh(turn);
    if (stages) memcpy(stages + 2 * n_words, turn->rows, n_words * sizeof *stages);
    return cdbi_draw(turn);
}

/* ---- Remembering */

/* Forget the rests of a character that are over. */
static inline void cdbi_forget_ended(const cdbi_choices *choices, cdbi_picked *picked, size_t slot, double time_s)
{
    size_t at;
    for (at = 0; at < picked->n_rests; at++) {
        int64_t *column = &picked->rests[slot * picked->n_rests + at];
        if (*column >= 0 && (uint64_t)*column < choices->n_columns && choices->limit_of_column[*column] >= 0
            && !cdbi_is_resting(choices, picked, slot, at, time_s))
            *column = -1;
    }
}

/* The place of a row that rests in the memory of a character, or a free one; n_rests where there is none. */
static inline size_t cdbi_rest_place(const cdbi_picked *picked, size_t slot, int64_t column)
{
    const int64_t *own = picked->rests + slot * picked->n_rests;
    size_t at, place = picked->n_rests;
    for (at = picked->n_rests; at > 0; at--) {
        if (own[at - 1] == column) return at - 1;
        if (own[at - 1] < 0) place = at - 1;
    }
    return place;
}

/* How many rests more than it has free places a character must remember with a row. */
static inline size_t cdbi_missing_places(const cdbi_choices *choices, const cdbi_picked *picked, size_t slot, int64_t row)
{
    size_t depth, needed = 0, n_free = 0, at;
    for (at = 0; at < picked->n_rests; at++) n_free += picked->rests[slot * picked->n_rests + at] < 0;
    for (depth = 0; depth < choices->n_depths; depth++) needed += choices->limit_of[depth * choices->n_rows + (size_t)row] >= 0;
    return needed > n_free ? needed - n_free : 0;
}

/* Remember the row that a character picked in this turn, -1 for none: there is room for its rests. */
static inline void cdbi_remember(const cdbi_choices *choices, cdbi_picked *picked, size_t slot, int64_t row, double time_s)
{
    int64_t *recent = picked->recent + slot * picked->memory;
    size_t depth, i;
    if (row >= 0 && picked->memory > 0) {
        for (i = picked->memory - 1; i > 0; i--) recent[i] = recent[i - 1];
        recent[0] = choices->assets[row];
    }
    for (depth = 0; row >= 0 && choices->n_limits > 0 && depth < choices->n_depths; depth++) {
        int64_t limit = choices->limit_of[depth * choices->n_rows + (size_t)row];
        size_t at;
        if (limit < 0) continue;
        at = slot * picked->n_rests + cdbi_rest_place(picked, slot, choices->columns[limit]);
        picked->rests[at] = choices->columns[limit];
        picked->rest_turns[at] = picked->turns[slot];
        picked->rest_s[at] = time_s;
    }
    picked->turns[slot]++;
}
