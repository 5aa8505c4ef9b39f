
/* ---- Facts that a character keeps: set what changed, by number or name, then query. It is a block of memory of the caller's, of
 * cdb_live_bytes; nothing is taken, and nothing is to be given back. A text that is set stays where it is while it is set. */

typedef struct cdb_live {
    const cdb_table *table;
    const cdb_column *columns;
    const cdb_schema *schema;
    cdb_unknown unknown;
    size_t n_open;                  /* conditions whose mask a query must find */
    cdb_fact *facts;
    const uint64_t **masks;         /* of each condition that of its fact; NULL where a query must find it */
    uint64_t *words;                /* of declared tags */
    size_t *at_words;
} cdb_live;

CDB_API size_t cdb_live_bytes(const cdb_schema *schema)
{
    size_t n = schema->n_conditions, i, n_words = 0;
    for (i = 0; i < n; i++) n_words += schema->conditions[i].type == CDB_TAGS ? cdbi_tag_words(&schema->conditions[i]) : 0;
    return sizeof(cdb_live) + n * (sizeof(cdb_fact) + sizeof(uint64_t *) + sizeof(size_t)) + n_words * sizeof(uint64_t);
}

/* Keep the mask of a fact that was set. */
static inline void cdbi_keep_mask(cdb_live *live, size_t at)
{
    const cdb_condition *condition = &live->schema->conditions[at];
    const cdb_column *column = &live->columns[at];
    int is_missing = cdbi_is_missing(condition, &live->facts[at]);
    const uint64_t *mask = NULL;
    if (column->kind == 0 || (is_missing && live->unknown == CDB_UNKNOWN_ANY)) mask = live->table->enabled;
    else if (is_missing ? live->unknown == CDB_UNKNOWN_NEVER : !cdbi_is_wrong(condition, &live->facts[at]))
        mask = cdbi_mask(column, condition, &live->facts[at], is_missing, live->table->n_words);
    live->n_open += (live->masks[at] != NULL) - (size_t)(mask != NULL);
    live->masks[at] = mask;
}

/* Whether a number is that of a fact that is given. */
static inline int cdbi_is_given(const cdb_live *live, int at)
{
    return at >= 0 && (size_t)at < live->schema->n_conditions && !live->schema->conditions[at].expr;
}

/* Make a fact missing. Other numbers than those of given facts are CDB_WRONG_FACT, here and below. */
CDB_API cdb_status cdb_set_missing(cdb_live *live, int at)
{
    if (!cdbi_is_given(live, at)) return CDB_WRONG_FACT;
    live->facts[at] = cdbi_missing(&live->schema->conditions[at]);
    cdbi_keep_mask(live, (size_t)at);
    return CDB_OK;
}

/* The facts of a character, all missing, in memory of cdb_live_bytes that begins on an address that 8 divides. */
CDB_API cdb_live *cdb_new_live(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema, cdb_unknown unknown,
    void *memory)
{
    cdb_live *live = (cdb_live *)memory;
    size_t n = schema->n_conditions, i, n_words = 0;
    memset(memory, 0, cdb_live_bytes(schema));
    live->table = table;
    live->columns = columns;
    live->schema = schema;
    live->unknown = unknown;
    live->facts = (cdb_fact *)(void *)(live + 1);
    live->words = (uint64_t *)(void *)(live->facts + n);
    for (i = 0; i < n; i++) n_words += schema->conditions[i].type == CDB_TAGS ? cdbi_tag_words(&schema->conditions[i]) : 0;
    live->masks = (const uint64_t **)(void *)(live->words + n_words);
    live->at_words = (size_t *)(void *)(live->masks + n);
    for (n_words = 0, i = 0; i < n; i++) {
        live->at_words[i] = n_words;
        n_words += schema->conditions[i].type == CDB_TAGS ? cdbi_tag_words(&schema->conditions[i]) : 0;
        live->n_open++;
        if (cdb_set_missing(live, (int)i) != CDB_OK) cdbi_keep_mask(live, i);
    }
    return live;
}

/* Facts of any schema. */
CDB_API cdb_live *cdb_live_of(const cdb_any *any, cdb_unknown unknown, void *memory)
{
    return cdb_new_live(&any->table, any->columns, &any->schema, unknown, memory);
}

/* Set a bool, an int, an enum by the number of its value, a date by its days, or a number. */
CDB_API cdb_status cdb_set_whole(cdb_live *live, int at, int64_t value)
{
    cdb_fact fact;
    cdb_type type;
    if (!cdbi_is_given(live, at)) return CDB_WRONG_FACT;
    type = live->schema->conditions[at].type;
    memset(&fact, 0, sizeof fact);
    if (cdbi_is_double(type)) fact.number = (double)value;
    else fact.whole = value;
    if (type == CDB_TEXT || type == CDB_TAGS) return CDB_WRONG_FACT;
    if (!cdbi_is_missing(&live->schema->conditions[at], &fact) && cdbi_is_wrong(&live->schema->conditions[at], &fact)) return CDB_WRONG_FACT;
    live->facts[at] = fact;
    cdbi_keep_mask(live, (size_t)at);
    return CDB_OK;
}

/* Set a number or an angle; what is whole goes for the other types too. NaN is missing. */
CDB_API cdb_status cdb_set_number(cdb_live *live, int at, double value)
{
    cdb_type type;
    if (!cdbi_is_given(live, at)) return CDB_WRONG_FACT;
    if (cdbi_is_nan(value)) return cdb_set_missing(live, at);
    type = live->schema->conditions[at].type;
    if (!cdbi_is_double(type)) {
        if (!cdbi_is_less(-9007199254740993.0, value) || !cdbi_is_less(value, 9007199254740993.0)) return CDB_WRONG_FACT;
        return cdbi_place((double)(int64_t)value) == cdbi_place(cdbi_sum(value, 0.0)) ? cdb_set_whole(live, at, (int64_t)value) : CDB_WRONG_FACT;
    }
    if (type == CDB_ANGLE && cdbi_is_infinite(value)) return CDB_WRONG_FACT;
    live->facts[at].number = value;
    cdbi_keep_mask(live, (size_t)at);
    return CDB_OK;
}

/* So many digits as a number; -1 where one of them is none. */
static inline int cdbi_digits(const char *text, size_t n)
{
    int value = 0;
    size_t i;
    for (i = 0; i < n; i++) {
        if (text[i] < '0' || text[i] > '9') return -1;
        value = value * 10 + (text[i] - '0');
    }
    return value;
}

/* Set a text, an enum by the name of its value, or a date: "2026-01-31". NULL is missing. */
CDB_API cdb_status cdb_set_text(cdb_live *live, int at, const char *value)
{
    const cdb_condition *condition;
    size_t number;
    if (!cdbi_is_given(live, at)) return CDB_WRONG_FACT;
    if (!value) return cdb_set_missing(live, at);
    condition = &live->schema->conditions[at];
    if (condition->type == CDB_ENUM) {
        number = cdbi_value_number(condition, value);
        return number < condition->n_values ? cdb_set_whole(live, at, (int64_t)number) : CDB_WRONG_FACT;
    }
    if (condition->type == CDB_DATE) {
        int year, month, day;
        if (strlen(value) != 10 || value[4] != '-' || value[7] != '-') return CDB_WRONG_FACT;
        year = cdbi_digits(value, 4);
        month = cdbi_digits(value + 5, 2);
        day = cdbi_digits(value + 8, 2);
        if (year < 1 || month < 1 || month > 12 || day < 1 || day > 31) return CDB_WRONG_FACT;
        if (day > 28 && cdb_date(year, month, day) >= cdb_date(year + month / 12, month % 12 + 1, 1)) return CDB_WRONG_FACT;
        return cdb_set_whole(live, at, cdb_date(year, month, day));
    }
    if (condition->type != CDB_TEXT) return CDB_WRONG_FACT;
    live->facts[at].text = value;
    cdbi_keep_mask(live, (size_t)at);
    return CDB_OK;
}

/* Set tags by their names. The list of those of a condition that declares none stays where it is while it is set. */
CDB_API cdb_status cdb_set_tags(cdb_live *live, int at, const char *const *tags, size_t n)
{
    const cdb_condition *condition;
    uint64_t *words;
    size_t i;
    if (!cdbi_is_given(live, at)) return CDB_WRONG_FACT;
    condition = &live->schema->conditions[at];
    if (condition->type != CDB_TAGS) return CDB_WRONG_FACT;
    for (i = 0; condition->n_values > 0 && i < n; i++)
        if (!tags[i][0] || cdbi_value_number(condition, tags[i]) == condition->n_values) return CDB_WRONG_FACT;
    if (condition->n_values > 0) {
        words = live->words + live->at_words[at];
        memset(words, 0, cdbi_tag_words(condition) * sizeof *words);
        words[0] = 1;
        for (i = 0; i < n; i++) cdb_add_tag(words, cdbi_value_number(condition, tags[i]));
        live->facts[at].tags = words;
    } else {
        live->facts[at].texts.texts = tags;
        live->facts[at].texts.count = (int64_t)n;
    }
    cdbi_keep_mask(live, (size_t)at);
    return CDB_OK;
}

/* The valid rows for the facts as they are now: see cdb_query. */
CDB_API cdb_status cdb_live_query(cdb_live *live, uint64_t *rows, size_t room, cdb_fault *fault)
{
    const cdb_table *table = live->table;
    if (live->n_open > 0 || table->has_programs || room < table->n_words)
        return cdbi_query(table, live->columns, live->schema, live->facts, live->facts, live->unknown, rows, room, fault);
    cdbi_and(rows, table->enabled, live->masks, live->schema->n_conditions, table->n_words);
    memset(rows + table->n_words, 0, (room - table->n_words) * sizeof *rows);
    return cdbi_fault(fault, CDB_OK, "", -1, "");
}

/* One of these rows: see cdb_pick. */
CDB_API cdb_status cdb_live_pick(const cdb_live *live, const uint64_t *rows, size_t room, double time_s, cdb_picker *picker,
    int64_t *row, cdb_fault *fault)
{
    return cdb_pick(live->table, live->columns, live->schema, live->facts, live->unknown, rows, room, time_s, picker, row, fault);
}

/* Why a row is not valid: see cdb_why_not. */
CDB_API cdb_status cdb_live_why_not(const cdb_live *live, int64_t row, int *reasons, size_t room, size_t *n, cdb_fault *fault)
{
    return cdb_why_not(live->table, live->columns, live->schema, live->facts, live->unknown, row, reasons, room, n, fault);
}
