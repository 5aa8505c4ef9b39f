
/* ---- Levels: what picks look at, in the table and in those inside it */

static inline int cdbi_choose_of(const cdbi_json *json)
{
    static const char *const words[] = {"chance", "top", "refuse"};
    int i;
    for (i = 0; i < 3; i++) {
        cdbi_json choose = *json;
        if (cdbi_is(&choose, words[i])) return i;
    }
    return -1;
}

/* A text of `about` that lives as long as the table. */
static inline const char *cdbi_kept_text(cdbi_opening *opening, const cdbi_json *json)
{
    cdbi_json text = *json;
    size_t room;
    char *to;
    cdbi_skip(&text, 0);
    room = (size_t)(text.at - json->at) + 1;
    to = text.why ? NULL : (char *)cdbi_memory(opening, room, 1);
    text = *json;
    if (to) cdbi_text(&text, to, room);
    return to;
}

/* One level: what decides and its name, where each of its arrays is still to be found. */
static inline const char *cdbi_read_level(cdbi_opening *opening, const cdbi_json *about, cdbi_level *level)
{
    cdbi_json name = cdbi_member(about, "name"), choose = cdbi_member(about, "choose"), by_cost = cdbi_member(about, "by_cost");
    int number;
    if (name.why || choose.why || by_cost.why) return name.why ? name.why : choose.why ? choose.why : by_cost.why;
    number = cdbi_choose_of(&choose);
    if (number < 0) cdbi_refuse(opening, CDB_OTHER_TABLE, "a table picks in a way that this header does not know", -1, "choose");
    level->choose = (cdb_choose)(number < 0 ? 0 : number);
    level->by_cost = cdbi_peek(&by_cost) == 't';
    level->n_rows = CDBI_NOT_SAID;
    level->name = cdbi_kept_text(opening, &name);
    return NULL;
}

/* Fallback and levels, out of `about`; `depths` are the first number of the shape of ways.numbers, where there are ways. */
static inline const char *cdbi_read_levels(cdbi_opening *opening, const cdbi_json *about, size_t depths)
{
    cdb_table *table = opening->table;
    cdbi_json fallback = cdbi_member(about, "fallback"), ways = cdbi_member(about, "ways");
    size_t n = 0;
    const char *why = NULL;
    opening->has_ways = ways.why == NULL && depths > 0;
    if (ways.why == NULL && depths == 0 && cdbi_count(&ways) > 0) return "the ways through tables inside tables are not there";
    if (fallback.why) return fallback.why;
    if (cdbi_peek(&fallback) == '"') table->fallback = cdbi_kept_text(opening, &fallback);
    table->n_levels = opening->has_ways ? cdbi_count(&ways) : 1;
    table->n_depths = opening->has_ways ? depths : 1;
    if (table->n_depths > CDBI_DEPTHS || table->n_levels == 0) return "tables are inside tables deeper than they can be";
    table->levels = (cdbi_level *)cdbi_memory(opening, table->n_levels, sizeof *table->levels);
    if (!table->levels) return NULL;
    if (!opening->has_ways) why = cdbi_read_level(opening, about, table->levels);
    else if (cdbi_take(&ways, '['))
        while (!why && cdbi_next(&ways, ']', &n) && n <= table->n_levels) {
            why = cdbi_read_level(opening, &ways, &table->levels[n - 1]);
            cdbi_skip(&ways, 0);
        }
    for (n = 0; n < table->n_levels; n++) {
        table->has_chance |= table->levels[n].choose == CDB_CHANCE;
        table->by_cost |= table->levels[n].by_cost;
    }
    return why;
}

static inline uint64_t cdbi_hash(uint64_t hash, const char *text)
{
    for (; *text; text++) hash = (hash ^ (unsigned char)*text) * 0x100000001B3; /* FNV-1a */
    return (hash ^ 0xFF) * 0x100000001B3;
}

#define CDBI_HASH 0xCBF29CE484222325U

/* The hash of what a table says in a row: an asset, or the table inside it. */
static inline uint64_t cdbi_said(const cdb_table *table, size_t depth, size_t row)
{
    int32_t inner = table->way_numbers && depth + 1 < table->n_depths ? table->way_numbers[(depth + 1) * table->n_rows + row] : -1;
    if (inner >= 0) return cdbi_hash(cdbi_hash(CDBI_HASH, "@"), table->levels[inner].name);
    return cdbi_hash(CDBI_HASH, table->way_numbers ? table->leaves[row] : table->assets[row]);
}

/* Whether every way passes levels that are there, and rows that they have. */
static inline int cdbi_are_ways(const cdb_table *table)
{
    size_t row, depth, i, at;
    for (i = 0; i < table->n_levels; i++)
        if (!table->levels[i].ranks || !table->levels[i].row_weights || !table->levels[i].name) return 0;
    if (!table->way_numbers && !table->way_rows) return table->levels[0].n_rows == table->n_rows;
    if (!table->way_numbers || !table->way_rows || (table->n_rows > 0 && !table->leaves)) return 0;
    for (row = 0; row < table->n_rows; row++) {
        if (table->way_numbers[row] < 0) return 0;
        for (depth = 0; depth < table->n_depths; depth++) {
            at = depth * table->n_rows + row;
            if (table->way_numbers[at] < 0) break;
            if ((size_t)table->way_numbers[at] >= table->n_levels || table->way_rows[at] < 0) return 0;
            if ((size_t)table->way_rows[at] >= table->levels[table->way_numbers[at]].n_rows) return 0;
        }
    }
    return 1;
}

/* A hash for each row of a level that rests: of the level's name, of what the row says, and of how many rows before it say the
 * same. `said` has room for one hash for each row of the level. */
static inline void cdbi_key_rows(cdbi_opening *opening, size_t number, uint64_t *said)
{
    cdb_table *table = opening->table;
    cdbi_level *level = &table->levels[number];
    size_t depth, row, i, before;
    level->keys = (uint64_t *)cdbi_memory(opening, level->n_rows, sizeof(uint64_t));
    memset(said, 0, level->n_rows * sizeof *said);
    for (depth = 0; level->keys && depth < table->n_depths; depth++)
        for (row = 0; row < table->n_rows; row++) {
            if (!table->way_numbers) said[row] = cdbi_said(table, 0, row);
            else if ((size_t)table->way_numbers[depth * table->n_rows + row] == number)
                said[table->way_rows[depth * table->n_rows + row]] = cdbi_said(table, depth, row);
        }
    for (row = 0; level->keys && row < level->n_rows; row++) {
        if (!((level->once && level->once[row]) || (level->cooldown_turns && level->cooldown_turns[row] > 0)
                || (level->cooldown_s && level->cooldown_s[row] > 0)))
            continue;
        for (before = 0, i = 0; i < row; i++) before += said[i] == said[row];
        level->keys[row] = cdbi_hash(said[row] ^ (uint64_t)before, level->name) | 1;
        table->n_limited++;
    }
}

/* Number the assets, by a table of hashes. */
static inline void cdbi_number_assets(cdbi_opening *opening)
{
    cdb_table *table = opening->table;
    size_t room = 4, row, at;
    int32_t *firsts;
    while (room < 2 * table->n_rows) room *= 2;
    table->asset_numbers = (int32_t *)cdbi_memory(opening, table->n_rows, sizeof(int32_t));
    firsts = table->asset_numbers ? (int32_t *)CDB_MALLOC(room * sizeof(int32_t)) : NULL;
    if (!firsts) {
        cdbi_refuse(opening, CDB_NO_MEMORY, "there is not enough memory", -1, "");
        return;
    }
    memset(firsts, -1, room * sizeof(int32_t));
    for (row = 0; row < table->n_rows; row++) {
        at = (size_t)table->asset_keys[row] & (room - 1);
        while (firsts[at] >= 0 && strcmp(table->assets[firsts[at]], table->assets[row]) != 0) at = (at + 1) & (room - 1);
        table->asset_numbers[row] = firsts[at] >= 0 ? table->asset_numbers[firsts[at]] : (int32_t)table->n_assets++;
        if (firsts[at] < 0) firsts[at] = (int32_t)row;
    }
    CDB_FREE(firsts);
}

/* Check what picks look at, and work out the hashes by which pickers know assets and rows. */
static inline void cdbi_levels(cdbi_opening *opening)
{
    cdb_table *table = opening->table;
    size_t row, i, most = 0;
    uint64_t *said = NULL;
    if (!cdbi_are_ways(table)) {
        cdbi_refuse(opening, CDB_BAD_FILE, "what picks need is not there or does not go together", -1, "ways");
        return;
    }
    table->asset_keys = (uint64_t *)cdbi_memory(opening, table->n_rows, sizeof(uint64_t));
    for (row = 0; table->asset_keys && row < table->n_rows; row++)
        table->asset_keys[row] = cdbi_hash(CDBI_HASH, table->assets[row]) | 1;
    if (table->asset_keys) cdbi_number_assets(opening);
    for (i = 0; i < table->n_levels; i++)
        if (table->levels[i].n_rows > most) most = table->levels[i].n_rows;
    for (i = 0; i < table->n_levels && opening->status == CDB_OK; i++) {
        const cdbi_level *level = &table->levels[i];
        if (!level->once && !level->cooldown_s && !level->cooldown_turns) continue;
        if (!said) said = (uint64_t *)cdbi_memory(opening, most, sizeof(uint64_t));
        if (said) cdbi_key_rows(opening, i, said);
    }
}
