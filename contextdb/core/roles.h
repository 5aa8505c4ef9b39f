
/* ---- Roles: what an artefact says of who plays a part in a row */

/* Whether a condition is a fact of a role: its name begins with that of the role and a dot, its first one. */
static inline int cdbi_is_of_role(const char *name, const char *role, size_t length)
{
    const char *dot = strchr(name, '.');
    return dot && dot[1] && (size_t)(dot - name) == length && strncmp(name, role, length) == 0;
}

static inline int cdbi_is_between(char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r') || c == ',' || c == ';' || c == '|';
}

/* The next word of a cell of slots, into `word`, which has room for the whole cell: words are apart by spaces, commas, semicolons or
 * bars; one in double quotes may have them, and a quote that is doubled. Gives where to go on, NULL behind the last. */
static inline const char *cdbi_slot_word(const char *at, char *word)
{
    while (cdbi_is_between(*at) || *at == '"') {
        const char *end = at + 1, *last = NULL;
        char *to = word, *to_last = word;
        if (*at++ != '"') continue;
        for (; *end && (*end != '"' || end[1] == '"'); end += 1 + (*end == '"')) {
            if (*end == '"') {
                last = end;
                to_last = to;
            }
            *to++ = *end;
        }
        if (!*end && last) { /* never closed: its last doubled quote closes it, and opens another word */
            end = last;
            to = to_last;
        }
        if (!*end) continue;
        *to = 0;
        return end + 1;
    }
    if (!*at) return NULL;
    while (*at && *at != '"' && !cdbi_is_between(*at)) *word++ = *at++;
    *word = 0;
    return at;
}

/* The number of a role, made where it is new and there is room; n_roles where there is none. */
static inline size_t cdbi_role_at(cdbi_opening *opening, const char *name, size_t length, size_t room)
{
    cdb_table *table = opening->table;
    size_t i;
    char *own;
    cdb_role *role;
    for (i = 0; i < table->n_roles; i++)
        if (strncmp(table->roles[i].name, name, length) == 0 && table->roles[i].name[length] == 0) return i;
    if (length == 0 || i == room) return table->n_roles;
    role = &table->roles[i];
    own = (char *)cdbi_memory(opening, length + 1, 1);
    role->required = (uint64_t *)cdbi_memory(opening, table->n_words, sizeof(uint64_t));
    role->optional = (uint64_t *)cdbi_memory(opening, table->n_words, sizeof(uint64_t));
    if (!own || !role->required || !role->optional) return table->n_roles;
    memcpy(own, name, length);
    role->name = own;
    return table->n_roles++;
}

/* Put the rows whose slots name a role into its masks. */
static inline void cdbi_read_slots(cdbi_opening *opening, int is_optional, size_t room)
{
    cdb_table *table = opening->table;
    const cdbi_slots *slots = &opening->slots[is_optional];
    size_t i, row, longest = 1;
    char *word;
    for (i = 0; i < slots->texts.n; i++)
        if (strlen(slots->texts.texts[i]) >= longest) longest = strlen(slots->texts.texts[i]) + 1;
    word = slots->codes ? (char *)cdbi_memory(opening, longest, 1) : NULL;
    for (row = 0; word && row < table->n_rows && opening->status == CDB_OK; row++) {
        const char *at = slots->codes[row] >= 0 && (size_t)slots->codes[row] < slots->texts.n ? slots->texts.texts[slots->codes[row]] : "";
        while ((at = cdbi_slot_word(at, word)) != NULL) {
            size_t role = cdbi_role_at(opening, word, strlen(word), room);
            uint64_t bit = (uint64_t)1 << (row % 64);
            if (role == table->n_roles) continue;
            if (!is_optional) table->roles[role].required[row / 64] |= bit;
            else if (!(table->roles[role].required[row / 64] & bit)) table->roles[role].optional[row / 64] |= bit;
        }
    }
}

/* A fact of a condition that is not known. */
static inline cdb_fact cdbi_missing(const cdb_condition *condition)
{
    cdb_fact fact;
    memset(&fact, 0, sizeof fact);
    if (condition->type == CDB_NUMBER || condition->type == CDB_ANGLE || (condition->type == CDB_INT && condition->expr))
        fact.number = cdb_missing_number();
    else if (condition->type == CDB_INT || condition->type == CDB_DATE) fact.whole = CDB_MISSING_INT;
    else if (condition->type == CDB_TAGS && condition->n_values == 0) fact.texts.count = CDB_MISSING;
    else if (condition->type == CDB_BOOL || condition->type == CDB_ENUM) fact.whole = CDB_MISSING;
    return fact;
}

/* The roles of conditions, then those that slots alone name; which rows need each, and which may have it. */
static inline void cdbi_make_roles(cdbi_opening *opening)
{
    cdb_table *table = opening->table;
    const cdb_schema *schema = opening->schema;
    size_t room = schema->n_conditions + opening->slots[0].texts.n + opening->slots[1].texts.n + CDB_MOST_ROLES, i, w;
    table->roles = (cdb_role *)cdbi_memory(opening, room, sizeof *table->roles);
    for (i = 0; table->roles && i < schema->n_conditions && opening->status == CDB_OK; i++) {
        const char *dot = strchr(schema->conditions[i].name, '.');
        if (dot && dot[1]) cdbi_role_at(opening, schema->conditions[i].name, (size_t)(dot - schema->conditions[i].name), room);
    }
    if (opening->status == CDB_OK) cdbi_read_slots(opening, 0, room);
    if (opening->status == CDB_OK) cdbi_read_slots(opening, 1, room);
    for (i = 0; i < schema->n_conditions && opening->status == CDB_OK; i++) {
        const cdb_condition *condition = &schema->conditions[i];
        const char *dot = strchr(condition->name, '.');
        size_t number = dot && dot[1] ? cdbi_role_at(opening, condition->name, (size_t)(dot - condition->name), room) : table->n_roles;
        cdb_role *role = &table->roles[number];
        cdb_fact missing = cdbi_missing(condition);
        if (number == table->n_roles) continue;
        role->is_computed |= condition->expr != NULL || (table->programs.is_needed && table->programs.is_needed[i])
            || (table->by_cost && table->soft && table->soft[i].column.kind != 0);
        for (w = 0; opening->columns[i].kind != 0 && w < table->n_words; w++)
            role->required[w] |= ~cdbi_accepted(&opening->columns[i], condition, &missing, CDB_UNKNOWN_NEVER, w, table->n_words)
                & ~role->optional[w];
    }
    for (i = 0; i < table->n_roles && table->n_rows % 64 != 0; i++)
        table->roles[i].required[table->n_words - 1] &= ((uint64_t)1 << (table->n_rows % 64)) - 1;
}

/* The number of a role, -1 for a name that is none's. */
CDB_API int cdb_role_number(const cdb_table *table, const char *name)
{
    size_t i;
    for (i = 0; i < table->n_roles; i++)
        if (strcmp(table->roles[i].name, name) == 0) return (int)i;
    return -1;
}
