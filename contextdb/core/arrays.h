
/* ---- Arrays: type, shape and place of each must be those that its reader takes for granted. */

/* An array of the file, as its header tells it. */
typedef struct cdbi_array {
    const unsigned char *at;
    size_t n_bytes;
    size_t shape[3];
    size_t n_dimensions;
    char dtype[8];
} cdbi_array;

/* Read an entry such as {"dtype": "U64", "shape": [3, 16], "data_offsets": [0, 384]}; its bytes lie within the file. */
static inline cdbi_array cdbi_read_array(const cdb_table *table, cdbi_json *entry)
{
    cdbi_array array;
    cdbi_json dtype = cdbi_member(entry, "dtype"), shape = cdbi_member(entry, "shape"), offsets = cdbi_member(entry,
        "data_offsets");
    size_t n = 0;
    uint64_t start, stop;
    memset(&array, 0, sizeof array);
    cdbi_text(&dtype, array.dtype, sizeof array.dtype);
    cdbi_take(&shape, '[');
    while (cdbi_next(&shape, ']', &n)) {
        uint64_t size = cdbi_whole(&shape);
        if (n > 3 || size > table->data_size) cdbi_fail(&shape, "an array has a shape that no file can have");
        else array.shape[n - 1] = (size_t)size;
    }
    array.n_dimensions = n;
    cdbi_take(&offsets, '[');
    start = cdbi_whole(&offsets);
    cdbi_take(&offsets, ',');
    stop = cdbi_whole(&offsets);
    cdbi_take(&offsets, ']');
    if (start > stop || stop > table->data_size) cdbi_fail(&offsets, "an array does not lie within the file");
    if (dtype.why || shape.why || offsets.why) cdbi_fail(entry, dtype.why ? dtype.why : shape.why ? shape.why : offsets.why);
    else {
        array.at = table->data + start;
        array.n_bytes = (size_t)(stop - start);
        cdbi_skip(entry, 0);
    }
    return array;
}

/* Whether an array holds numbers of a kind in so many dimensions, the last of which is `width`, and has their bytes. */
static inline int cdbi_fits(const cdbi_array *array, const char *dtype, size_t n_dimensions, size_t width)
{
    size_t size = strcmp(dtype, "I32") == 0 ? 4 : strcmp(dtype, "BOOL") == 0 || strcmp(dtype, "U8") == 0 ? 1 : 8;
    size_t n = array->n_bytes / size, i;
    if (strcmp(array->dtype, dtype) != 0 || array->n_dimensions != n_dimensions || array->n_bytes % size != 0) return 0;
    if (array->shape[n_dimensions - 1] != width || ((uintptr_t)array->at & (size - 1)) != 0) return 0;
    for (i = 0; i < n_dimensions; i++)
        if (array->shape[i] == 0) return n == 0;
    for (i = 0; i < n_dimensions; i++) {
        if (n % array->shape[i] != 0) return 0;
        n /= array->shape[i];
    }
    return n == 1;
}

static inline const uint64_t *cdbi_words(const cdbi_array *array)
{
    return (const uint64_t *)(const void *)array->at;
}

/* Take an array for the column that its key, such as "003.masks", is about; 0 where it does not fit. */
static inline int cdbi_take_part(cdb_column *column, const char *part, const cdbi_array *array, size_t n_words)
{
    if (strcmp(part, "masks") == 0) {
        column->masks = cdbi_words(array);
        column->n_masks = array->shape[0];
        return cdbi_fits(array, "U64", 2, n_words);
    }
    if (strcmp(part, "bounds") == 0) {
        column->bounds = (const double *)(const void *)array->at;
        column->n_bounds = array->shape[0];
        return cdbi_fits(array, "F64", 1, array->shape[0]);
    }
    if (strcmp(part, "any_mask") == 0) {
        column->any_mask = cdbi_words(array);
        return cdbi_fits(array, "U64", 1, n_words);
    }
    if (strcmp(part, "low") != 0 && strcmp(part, "high") != 0) return 1;
    if ((column->low || column->high) && (column->n_layers != array->shape[0] || column->n_digits != array->shape[1])) return 0;
    column->n_layers = array->shape[0];
    column->n_digits = array->shape[1];
    if (part[0] == 'l') column->low = cdbi_words(array);
    else column->high = cdbi_words(array);
    return cdbi_fits(array, "U64", 3, n_words);
}

/* The column whose part a key names, and the part behind "CCC."; n_conditions where the key is about no column. */
static inline size_t cdbi_column_of(const cdbi_opening *opening, const char *key, const char **part)
{
    size_t number = 0, i;
    const char *at = key;
    for (; *at >= '0' && *at <= '9' && at < key + 9; at++) number = number * 10 + (size_t)(*at - '0');
    if (at < key + 3 || *at != '.') return opening->schema->n_conditions;
    *part = at + 1;
    for (i = 0; i < opening->schema->n_conditions; i++) {
        size_t place = (number + i) % opening->schema->n_conditions;
        if (opening->columns[place].kind != 0 && opening->columns[place].file_index == number) return place;
    }
    return i;
}

static inline int cdbi_is_growth(const char *part)
{
    return strcmp(part, "per") == 0 || strcmp(part, "starts") == 0 || strcmp(part, "ends") == 0 || strcmp(part, "which") == 0;
}

/* Take an array of how penalties grow; 0 where it does not fit. */
static inline int cdbi_take_growth(cdbi_soft *soft, const char *part, const cdbi_array *array, size_t n_soft)
{
    if (strcmp(part, "per") == 0) {
        soft->per = (const double *)(const void *)array->at, soft->n_cells = array->shape[0];
        return cdbi_fits(array, "F64", 1, array->shape[0]);
    }
    if (strcmp(part, "starts") == 0) {
        soft->starts = (const int64_t *)(const void *)array->at, soft->n_starts = array->shape[0];
        return cdbi_fits(array, "I64", 1, array->shape[0]);
    }
    if (strcmp(part, "ends") == 0) {
        soft->ends = (const double *)(const void *)array->at, soft->n_spans = array->shape[0];
        return cdbi_fits(array, "F64", 2, 2);
    }
    soft->which = (const int32_t *)(const void *)array->at;
    return cdbi_fits(array, "I32", 1, n_soft);
}

/* Whether the parts of a growth go together. */
static inline int cdbi_is_sound_growth(const cdbi_soft *soft, size_t n_soft)
{
    size_t i;
    if (!soft->per) return 1;
    if (!soft->starts || !soft->ends || !soft->which || soft->n_starts != soft->n_cells + 1 || soft->starts[0] != 0) return 0;
    for (i = 0; i < soft->n_cells; i++) {
        if (soft->starts[i + 1] < soft->starts[i] || (uint64_t)soft->starts[i + 1] > soft->n_spans) return 0;
        if (soft->per[i] == soft->per[i] && soft->starts[i + 1] == soft->starts[i]) return 0;
    }
    for (i = 0; i < n_soft; i++)
        if (soft->which[i] < 0 || (size_t)soft->which[i] >= soft->n_cells) return 0;
    return 1;
}

/* Take an array for a condition's column or its soft cells; 0 where it does not fit. */
static inline int cdbi_take_condition(cdbi_opening *opening, size_t at, const char *part, const cdbi_array *array)
{
    cdb_table *table = opening->table;
    size_t n_soft = table->n_depths * table->n_rows;
    if (strcmp(part, "hysteresis") == 0) {
        if (!cdbi_fits(array, "F64", 1, 1) || array->shape[0] != 1 || !cdbi_is_numeric(opening->schema->conditions[at].type)) return 0;
        opening->columns[at].hysteresis = *(const double *)(const void *)array->at;
        if (table->soft) table->soft[at].column.hysteresis = opening->columns[at].hysteresis;
        return 1;
    }
    if (strncmp(part, "soft.", 5) != 0) return cdbi_take_part(&opening->columns[at], part, array, table->n_words);
    if (!table->soft || table->soft[at].column.kind == 0) return 1;
    if (cdbi_is_growth(part + 5)) return cdbi_take_growth(&table->soft[at], part + 5, array, n_soft);
    if (strcmp(part + 5, "penalties") != 0) return cdbi_take_part(&table->soft[at].column, part + 5, array, (n_soft + 63) / 64);
    table->soft[at].penalties = (const double *)(const void *)array->at;
    return cdbi_fits(array, "F64", 1, n_soft);
}

/* The texts of an array that is a list of texts in JSON. */
static inline cdbi_list cdbi_take_texts(cdbi_opening *opening, const cdbi_array *array, const char *key)
{
    const char *start = (const char *)array->at;
    cdbi_json json;
    cdbi_list list;
    json.at = start;
    json.end = start + array->n_bytes;
    json.why = NULL;
    list = cdbi_texts(opening, &json);
    cdbi_peek(&json);
    if (json.why || json.at != json.end || strcmp(array->dtype, "U8") != 0)
        cdbi_refuse(opening, CDB_BAD_FILE, "a list of texts cannot be read", -1, key);
    return list;
}

/* Take a part of the programs; 0 where it does not fit. */
static inline int cdbi_take_program(cdbi_opening *opening, const char *key, const cdbi_array *array)
{
    static const char *const parts[] = {"texts", "facts", "types", "numbers", "code", "starts", "derived", "of_row"};
    cdbi_programs *programs = &opening->table->programs;
    const void *at = array->at;
    size_t n = array->shape[0], part = 0;
    while (part < 8 && strcmp(key + strlen("programs."), parts[part]) != 0) part++;
    programs->parts |= part < 8 ? 1U << part : 0;
    switch (part) {
    case 0: programs->texts = cdbi_take_texts(opening, array, key); return 1;
    case 1: programs->facts = cdbi_take_texts(opening, array, key); return 1;
    case 2: programs->types = cdbi_take_texts(opening, array, key); return 1;
    case 3:
        programs->numbers = (const double *)at;
        programs->n_numbers = n;
        return cdbi_fits(array, "F64", 1, n);
    case 4:
        programs->code = (const int32_t *)at;
        programs->n_code = n;
        return cdbi_fits(array, "I32", 2, 4);
    case 5:
        programs->starts = (const int64_t *)at;
        programs->n_starts = n;
        return cdbi_fits(array, "I64", 1, n);
    case 6:
        programs->derived = (const int64_t *)at;
        programs->n_derived = n;
        return cdbi_fits(array, "I64", 1, n);
    case 7:
        programs->of_row = (const int32_t *)at;
        programs->n_of_row = n;
        return cdbi_fits(array, "I32", 1, n);
    default: return 1;
    }
}

/* Take an array that picks look at, of one of the levels; 0 where it does not fit. */
static inline int cdbi_take_level(cdbi_level *level, const char *part, const cdbi_array *array)
{
    const void *at = array->at;
    size_t n = array->shape[0];
    int is_level = 1, fits = 1;
    if (strcmp(part, "ranks") == 0) {
        level->ranks = (const double *)at;
        fits = cdbi_fits(array, "F64", 1, n);
    } else if (strcmp(part, "row_weights") == 0) {
        level->row_weights = (const double *)at;
        fits = cdbi_fits(array, "F64", 1, n);
    } else if (strcmp(part, "once") == 0) {
        level->once = (const unsigned char *)at;
        fits = cdbi_fits(array, "BOOL", 1, n);
    } else if (strcmp(part, "cooldown_s") == 0) {
        level->cooldown_s = (const double *)at;
        fits = cdbi_fits(array, "F64", 1, n);
    } else if (strcmp(part, "cooldown_turns") == 0) {
        level->cooldown_turns = (const int64_t *)at;
        fits = cdbi_fits(array, "I64", 1, n);
    } else is_level = 0;
    if (!is_level) return 1;
    if (level->n_rows == CDBI_NOT_SAID) level->n_rows = n;
    return fits && level->n_rows == n;
}

/* Take an array of the ways through tables inside tables; 0 where it does not fit. */
static inline int cdbi_take_way(cdbi_opening *opening, const char *key, const cdbi_array *array)
{
    cdb_table *table = opening->table;
    const char *part = key + strlen("ways.");
    size_t number = 0;
    if (strcmp(part, "leaves") == 0) {
        cdbi_list leaves = cdbi_take_texts(opening, array, key);
        table->leaves = leaves.texts;
        return leaves.n == table->n_rows;
    }
    if (strcmp(part, "numbers") == 0 || strcmp(part, "rows") == 0) {
        if (part[0] == 'n') table->way_numbers = (const int32_t *)(const void *)array->at;
        else table->way_rows = (const int32_t *)(const void *)array->at;
        return cdbi_fits(array, "I32", 2, table->n_rows) && array->shape[0] == table->n_depths;
    }
    for (; *part >= '0' && *part <= '9' && number < 100000; part++) number = number * 10 + (size_t)(*part - '0');
    if (*part != '.' || !opening->has_ways || number >= table->n_levels) return 1;
    return cdbi_take_level(&table->levels[number], part + 1, array);
}

/* Take a part of the columns of slots, "slots.001.codes"; 0 where it does not fit. */
static inline int cdbi_take_slots(cdbi_opening *opening, const char *key, const cdbi_array *array)
{
    const char *part = key + strlen("slots.");
    int number = 0, i;
    for (; *part >= '0' && *part <= '9' && number < 1000; part++) number = number * 10 + (*part - '0');
    for (i = 0; i < 2; i++) {
        cdbi_slots *slots = &opening->slots[i];
        if (slots->number != number + 1) continue;
        if (strcmp(part, ".texts") == 0) slots->texts = cdbi_take_texts(opening, array, key);
        if (strcmp(part, ".codes") != 0) return 1;
        slots->codes = (const int32_t *)(const void *)array->at;
        return cdbi_fits(array, "I32", 1, opening->table->n_rows);
    }
    return 1;
}

/* Take every array that is asked for. */
static inline void cdbi_arrays(cdbi_opening *opening, cdbi_json header)
{
    cdb_table *table = opening->table;
    size_t n = 0;
    char key[CDBI_KEY];
    const char *part = NULL;
    cdbi_take(&header, '{');
    while (opening->status == CDB_OK && cdbi_next(&header, '}', &n)) {
        cdbi_array array;
        size_t at;
        int fits = 1;
        cdbi_key(&header, key);
        if (strcmp(key, "__metadata__") == 0) {
            cdbi_skip(&header, 0);
            continue;
        }
        array = cdbi_read_array(table, &header);
        if (header.why) break;
        at = cdbi_column_of(opening, key, &part);
        if (at < opening->schema->n_conditions) fits = cdbi_take_condition(opening, at, part, &array);
        else if (strncmp(key, "programs.", strlen("programs.")) == 0) fits = cdbi_take_program(opening, key, &array);
        else if (strncmp(key, "ways.", strlen("ways.")) == 0) fits = cdbi_take_way(opening, key, &array);
        else if (strncmp(key, "slots.", strlen("slots.")) == 0) fits = cdbi_take_slots(opening, key, &array);
        else if (strcmp(key, "assets") == 0 && !table->assets) {
            cdbi_list assets = cdbi_take_texts(opening, &array, key);
            table->assets = assets.texts;
            fits = assets.n == table->n_rows;
        } else if (strcmp(key, "enabled") == 0) {
            table->enabled = cdbi_words(&array);
            fits = cdbi_fits(&array, "U64", 1, table->n_words);
        } else if (strcmp(key, "row_weights") == 0) {
            table->row_weights = (const double *)(const void *)array.at;
            fits = cdbi_fits(&array, "F64", 1, table->n_rows);
        }
        if (fits && !opening->has_ways) fits = cdbi_take_level(&table->levels[0], key, &array);
        if (!fits) cdbi_refuse(opening, CDB_BAD_FILE, "an array has another type, shape or place than it must have", -1, key);
    }
    if (header.why) cdbi_refuse(opening, CDB_BAD_FILE, header.why, -1, "");
}

/* Whether a wide column has masks for the digits of all its classes. */
static inline int cdbi_is_wide(const cdb_column *column)
{
    size_t n_fine = (size_t)1 << column->shift;
    if (!column->low || !column->high || !column->any_mask || column->n_digits < n_fine || (column->n_digits - n_fine) % 2 != 0)
        return 0;
    return (column->n_bounds >> column->shift) < (column->n_digits - n_fine) / 2;
}

/* Whether a column has all its arrays, as long as each other, and its bounds ascend. */
static inline int cdbi_is_whole(const cdb_column *column, cdb_type type)
{
    size_t i;
    if (column->kind == CDBI_VALUE) return column->masks && column->n_masks == column->texts.n + (type == CDB_TEXT) + 1;
    if (column->kind == CDBI_SLOTS)
        return column->masks && column->n_masks % 3 == 0 && column->n_masks / 3 == column->texts.n + column->n_negated;
    if (!column->bounds) return 0;
    for (i = 0; i < column->n_bounds; i++)
        if (cdbi_is_nan(column->bounds[i]) || (i > 0 && cdbi_place(column->bounds[i - 1]) >= cdbi_place(column->bounds[i])))
            return 0;
    if (column->kind == CDBI_FLAT) return column->masks && column->n_masks == column->n_bounds + 2;
    return cdbi_is_wide(column);
}

/* Check a column, and find the places of its bounds. */
static inline void cdbi_check_column(cdbi_opening *opening, cdb_column *column, size_t at)
{
    size_t i;
    if (column->kind == 0) return;
    if (!cdbi_is_whole(column, opening->schema->conditions[at].type)) {
        cdbi_refuse(opening, CDB_BAD_FILE, "its arrays are not there, do not go together, or do not ascend", (int)at,
            cdbi_name(opening, at));
        return;
    }
    column->places = (uint64_t *)cdbi_memory(opening, column->n_bounds, sizeof(uint64_t));
    for (i = 0; column->places && i < column->n_bounds; i++) column->places[i] = cdbi_place(column->bounds[i]);
}

/* Whether every column has what its kind needs, and no row beyond the last is enabled. */
static inline void cdbi_check_columns(cdbi_opening *opening)
{
    const cdb_table *table = opening->table;
    size_t i;
    if (table->n_rows % 64 != 0 && table->enabled[table->n_words - 1] >> (table->n_rows % 64) != 0)
        cdbi_refuse(opening, CDB_BAD_FILE, "rows are enabled that are not there", -1, "enabled");
    for (i = 0; i < opening->schema->n_conditions && opening->status == CDB_OK; i++) {
        cdbi_check_column(opening, &opening->columns[i], i);
        if (!table->soft || table->soft[i].column.kind == 0 || opening->status != CDB_OK) continue;
        if (!table->soft[i].penalties) cdbi_refuse(opening, CDB_BAD_FILE, "its penalties are not there", (int)i, cdbi_name(opening, i));
        else if (!cdbi_is_sound_growth(&table->soft[i], table->n_depths * table->n_rows))
            cdbi_refuse(opening, CDB_BAD_FILE, "how its penalties grow does not go together", (int)i, cdbi_name(opening, i));
        else cdbi_check_column(opening, &table->soft[i].column, i);
    }
}

/* Whether every part of the table is there. */
static inline void cdbi_check(cdbi_opening *opening)
{
    const cdb_table *table = opening->table;
    if (!table->enabled || !table->row_weights || (table->n_rows > 0 && !table->assets))
        cdbi_refuse(opening, CDB_BAD_FILE, "the file lacks a part", -1, "");
    else cdbi_check_columns(opening);
}
