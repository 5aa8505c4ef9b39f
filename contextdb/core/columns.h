
/* ---- Columns: how the text `about` says that each condition is kept. */

/* Whether a text is `tag` or a tag under it. */
static inline int cdbi_covers(const char *tag, const char *text)
{
    size_t length = strlen(tag);
    return strncmp(text, tag, length) == 0 && (text[length] == 0 || text[length] == '.');
}

static inline size_t cdbi_tag_words(const cdb_condition *condition)
{
    return (condition->n_values + 63) / 64;
}

/* Work out for each tag of a list which of the declared ones cover it. */
static inline void cdbi_set_bits(cdbi_opening *opening, const cdb_condition *condition, cdbi_list *list)
{
    size_t width = cdbi_tag_words(condition), i, j;
    if (list->n == 0 || width == 0 || opening->status != CDB_OK) return;
    list->bits = list->n <= (size_t)-1 / width ? (uint64_t *)cdbi_memory(opening, list->n * width, sizeof(uint64_t)) : NULL;
    for (i = 0; list->bits && i < list->n; i++)
        for (j = 1; j < condition->n_values; j++)
            if (cdbi_covers(list->texts[i], condition->values[j])) list->bits[i * width + j / 64] |= (uint64_t)1 << (j % 64);
}

static inline void cdbi_swap(cdbi_list *list, uint32_t *classes, size_t one, size_t other)
{
    const char *text = list->texts[one];
    uint32_t number = classes[one];
    list->texts[one] = list->texts[other];
    list->texts[other] = text;
    classes[one] = classes[other];
    classes[other] = number;
}

/* Bring the values of a text column into ascending order, so that a fact is found by halving. A heap: no recursion, no memory. */
static inline void cdbi_sort(cdbi_list *list, uint32_t *classes)
{
    size_t start = list->n / 2, end = list->n, at, child;
    while (end > 1) {
        if (start > 0) start--;
        else cdbi_swap(list, classes, 0, --end);
        for (at = start; (child = 2 * at + 1) < end; at = child) {
            if (child + 1 < end && strcmp(list->texts[child], list->texts[child + 1]) < 0) child++;
            if (strcmp(list->texts[at], list->texts[child]) >= 0) break;
            cdbi_swap(list, classes, at, child);
        }
    }
}

/* The values of a bool or enum column must be those that this header was made for; those of a text column are kept. */
static inline void cdbi_values(cdbi_opening *opening, cdb_column *column, size_t at, cdbi_json *json)
{
    const cdb_condition *condition = &opening->schema->conditions[at];
    size_t n = 0, i;
    int is_same = 1;
    if (condition->type == CDB_TEXT) {
        column->texts = cdbi_texts(opening, json);
        column->classes = (uint32_t *)cdbi_memory(opening, column->texts.n, sizeof(uint32_t));
        for (i = 0; column->classes && i < column->texts.n; i++) column->classes[i] = (uint32_t)i;
        if (column->classes && opening->status == CDB_OK) cdbi_sort(&column->texts, column->classes);
        return;
    }
    cdbi_take(json, '[');
    while (cdbi_next(json, ']', &n)) {
        if (condition->type == CDB_ENUM && cdbi_peek(json) == '"') {
            if (n > condition->n_values) cdbi_skip(json, 0);
            else if (!cdbi_is(json, condition->values[n - 1])) is_same = 0;
        } else {
            if (n > 2 || condition->type != CDB_BOOL || cdbi_peek(json) != (n == 1 ? 'f' : 't')) is_same = 0; /* false, true */
            cdbi_skip(json, 0);
        }
    }
    column->texts.n = n;
    if (n < (condition->type == CDB_BOOL ? 2 : condition->n_values)) is_same = 0;
    if (json->why == NULL && !is_same)
        cdbi_refuse(opening, CDB_OTHER_TABLE, "its values are others than those of this header", (int)at, condition->name);
}

/* One part: the lists `needs` and `bans`, and behind them whether it is the complement, where that is said. */
static inline void cdbi_read_part(cdbi_opening *opening, size_t at, cdbi_json *json, cdbi_part *part)
{
    const cdb_condition *condition = &opening->schema->conditions[at];
    cdbi_take(json, '[');
    part->needs = cdbi_texts(opening, json);
    cdbi_take(json, ',');
    part->bans = cdbi_texts(opening, json);
    part->is_complement = 1;
    if (cdbi_peek(json) == ',') {
        json->at++;
        part->is_complement = cdbi_peek(json) == 't';
        cdbi_skip(json, 0);
    }
    cdbi_take(json, ']');
    if (json->why) return;
    cdbi_set_bits(opening, condition, &part->needs);
    cdbi_set_bits(opening, condition, &part->bans);
}

/* Whether a slot is a list of parts, [[[...], [...], true], ...], and not one part alone, [[...], [...]]. */
static inline int cdbi_has_parts(cdbi_json json)
{
    return cdbi_take(&json, '[') && cdbi_take(&json, '[') && cdbi_peek(&json) == '[';
}

static inline void cdbi_read_slot(cdbi_opening *opening, size_t at, cdbi_json *json, cdbi_slot *slot)
{
    int has_parts = cdbi_has_parts(*json);
    size_t count = has_parts ? cdbi_count(json) : 1, n = 0;
    slot->parts = (cdbi_part *)cdbi_memory(opening, count, sizeof(cdbi_part));
    if (!slot->parts) return;
    slot->n = count;
    if (!has_parts) cdbi_read_part(opening, at, json, slot->parts);
    else if (cdbi_take(json, '['))
        while (cdbi_next(json, ']', &n) && n <= count && opening->status == CDB_OK)
            cdbi_read_part(opening, at, json, &slot->parts[n - 1]);
}

static inline void cdbi_negated(cdbi_opening *opening, cdb_column *column, size_t at, cdbi_json *json)
{
    size_t count = cdbi_count(json), n = 0;
    column->negated = (cdbi_slot *)cdbi_memory(opening, count, sizeof(cdbi_slot));
    if (!column->negated) return;
    cdbi_take(json, '[');
    while (cdbi_next(json, ']', &n) && n <= count && opening->status == CDB_OK)
        cdbi_read_slot(opening, at, json, &column->negated[n - 1]);
    column->n_negated = count;
}

static inline int cdbi_kind(const cdbi_json *about)
{
    static const char *const kinds[] = {"value", "number", "wide", "tags"};
    int i;
    for (i = 0; i < 4; i++) {
        cdbi_json kind = cdbi_member(about, "kind");
        if (cdbi_is(&kind, kinds[i])) return i + 1;
    }
    return 0;
}

/* How a column is kept: an object such as {"kind": "number"}. */
static inline const char *cdbi_column(cdbi_opening *opening, cdb_column *column, size_t at, const cdbi_json *about)
{
    cdb_type type = opening->schema->conditions[at].type;
    int kind = cdbi_kind(about), is_number = cdbi_is_numeric(type);
    cdbi_json one = {NULL, NULL, NULL}, other = {NULL, NULL, NULL};
    column->kind = kind;
    if (kind == 0 || is_number != (kind == CDBI_FLAT || kind == CDBI_WIDE) || (type == CDB_TAGS) != (kind == CDBI_SLOTS))
        return "a column is kept in a way that its type is not";
    if (kind == CDBI_VALUE) {
        one = cdbi_member(about, "values");
        cdbi_values(opening, column, at, &one);
        other = cdbi_member(about, "has_others");
        if (cdbi_peek(&other) != (type == CDB_TEXT ? 't' : 'f'))
            cdbi_fail(&other, "a column is kept in a way that its type is not");
    } else if (kind == CDBI_WIDE) {
        uint64_t shift;
        one = cdbi_member(about, "shift");
        shift = cdbi_whole(&one);
        if (shift > 30) cdbi_fail(&one, "a column has a shift that is none");
        else column->shift = (unsigned)shift;
    } else if (kind == CDBI_SLOTS) {
        one = cdbi_member(about, "tags");
        column->texts = cdbi_texts(opening, &one);
        cdbi_set_bits(opening, &opening->schema->conditions[at], &column->texts);
        other = cdbi_member(about, "negated");
        cdbi_negated(opening, column, at, &other);
    }
    return one.why ? one.why : other.why;
}

/* Which condition of the schema this one of the file is, its type the same; n_conditions where it is none. */
static inline size_t cdbi_condition(cdbi_opening *opening, const cdbi_json *about, size_t file_index)
{
    const cdb_schema *schema = opening->schema;
    size_t i, at = 0;
    int is_derived;
    char name[CDB_NAME_BYTES];
    cdbi_json value = cdbi_member(about, "name");
    for (i = 0; i < schema->n_conditions; i++) {
        at = (file_index + i) % schema->n_conditions; /* as a rule they stand in the same order */
        value = cdbi_member(about, "name");
        if (cdbi_is(&value, schema->conditions[at].name)) break;
        if (value.why) break;
    }
    if (value.why) {
        cdbi_refuse(opening, CDB_BAD_FILE, value.why, -1, "about");
        return schema->n_conditions;
    }
    if (i == schema->n_conditions && opening->strange == CDB_STRANGE_ANY) return i;
    if (i == schema->n_conditions) {
        value = cdbi_member(about, "name");
        cdbi_text(&value, name, sizeof name);
        cdbi_refuse(opening, CDB_OTHER_TABLE, "the table asks for a condition that this header does not know", -1, name);
        return schema->n_conditions;
    }
    value = cdbi_member(about, "type");
    if (!cdbi_is(&value, cdbi_type_name(schema->conditions[at].type))) {
        cdbi_refuse(opening, CDB_OTHER_TABLE, "its type is another than that of this header", (int)at, schema->conditions[at].name);
        return schema->n_conditions;
    }
    value = cdbi_member(about, "expr");
    is_derived = cdbi_peek(&value) == '"';
    if (is_derived != (schema->conditions[at].expr != NULL)) {
        cdbi_refuse(opening, CDB_OTHER_TABLE, is_derived ? "it is derived, and this header takes it from the game"
            : "it is given, and this header computes it", (int)at, schema->conditions[at].name);
        return schema->n_conditions;
    }
    return at;
}

/* The soft cells of a column, where it has some: `soft` is null, or an object as for a column. */
static inline const char *cdbi_soft_column(cdbi_opening *opening, size_t at, const cdbi_json *about)
{
    cdb_table *table = opening->table;
    cdbi_json soft = cdbi_member(about, "soft");
    if (soft.why || cdbi_peek(&soft) != '{') return soft.why;
    if (!table->soft) table->soft = (cdbi_soft *)cdbi_memory(opening, opening->schema->n_conditions, sizeof *table->soft);
    return table->soft ? cdbi_column(opening, &table->soft[at].column, at, &soft) : NULL;
}

/* The conditions and the columns of `about`: two lists that go side by side. */
static inline const char *cdbi_columns(cdbi_opening *opening, const cdbi_json *about)
{
    cdbi_json conditions = cdbi_member(about, "conditions"), columns = cdbi_member(about, "columns");
    size_t n = 0, m = 0, at;
    const char *why = NULL;
    cdbi_take(&conditions, '[');
    cdbi_take(&columns, '[');
    while (cdbi_next(&conditions, ']', &n)) {
        cdbi_json masks;
        at = cdbi_condition(opening, &conditions, n - 1);
        if (opening->status != CDB_OK) return NULL;
        if (!cdbi_next(&columns, ']', &m)) break;
        if (at == opening->schema->n_conditions) {
            opening->table->n_strange++;
            cdbi_skip(&conditions, 0);
            cdbi_skip(&columns, 0);
            continue;
        }
        if (opening->columns[at].kind != 0) return "two conditions have one name";
        masks = cdbi_member(&columns, "masks");
        why = masks.why ? masks.why : cdbi_column(opening, &opening->columns[at], at, &masks);
        if (why || opening->status != CDB_OK) return why;
        why = cdbi_soft_column(opening, at, &columns);
        if (why || opening->status != CDB_OK) return why;
        opening->columns[at].file_index = n - 1;
        cdbi_skip(&conditions, 0);
        cdbi_skip(&columns, 0);
    }
    if (conditions.why || columns.why) return conditions.why ? conditions.why : columns.why;
    return n != m || cdbi_next(&columns, ']', &m) ? "there are not as many columns as conditions" : NULL;
}

/* A part that this header does not know could mean that an answer is another one: such a table is refused. */
static inline void cdbi_refuse_unknown(cdbi_opening *opening, cdbi_json about)
{
    static const char *const known[] = {"name", "rows", "policy", "choose", "by_cost", "fallback", "conditions", "columns", "slots", "computed_from",
        "ways", "when"};
    size_t n = 0, i;
    char key[CDBI_KEY];
    cdbi_take(&about, '{');
    while (cdbi_next(&about, '}', &n)) {
        cdbi_key(&about, key);
        for (i = 0; i < sizeof known / sizeof *known && strcmp(key, known[i]) != 0; i++) {}
        if (about.why) break;
        if (strcmp(key, "when") == 0 || strcmp(key, "computed_from") == 0) opening->has_programs = 1;
        if (i == sizeof known / sizeof *known)
            cdbi_refuse(opening, CDB_OTHER_TABLE, "the table holds something that this header cannot answer for", -1, key);
        cdbi_skip(&about, 0);
    }
    if (about.why) cdbi_refuse(opening, CDB_BAD_FILE, about.why, -1, "about");
}
