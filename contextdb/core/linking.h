
/* ---- Linking: the programs of a file are checked, and what they name is looked up in the schema. */

/* Where each fact is in the schema, and whether its type is the same. */
static inline void cdbi_find_facts(cdbi_opening *opening, unsigned char *is_known)
{
    cdbi_programs *programs = &opening->table->programs;
    const cdb_schema *schema = opening->schema;
    size_t i, at;
    for (i = 0; i < programs->facts.n && opening->status == CDB_OK; i++) {
        const char *name = programs->facts.texts[i];
        for (at = 0; at < schema->n_conditions && strcmp(schema->conditions[at].name, name) != 0; at++) {}
        programs->places[i] = at;
        if (at == schema->n_conditions) {
            if (opening->strange == CDB_STRANGE_REFUSED)
                cdbi_refuse(opening, CDB_OTHER_TABLE, "a rule or a derived fact needs a condition that this header does not know",
                    -1, name);
        } else if (is_known[at])
            cdbi_refuse(opening, CDB_BAD_FILE, "two facts have one name", (int)at, name);
        else if (strcmp(cdbi_type_name(schema->conditions[at].type), programs->types.texts[i]) != 0)
            cdbi_refuse(opening, CDB_OTHER_TABLE, "its type is another than that of this header", (int)at, name);
        else is_known[at] = 1;
    }
}

/* Whether the numbers of programs go together. */
static inline int cdbi_is_linked(const cdb_table *table)
{
    const cdbi_programs *programs = &table->programs;
    size_t i;
    if (programs->parts != CDBI_PROGRAM_PARTS || programs->n_starts == 0 || programs->n_starts - 1 < programs->n_derived) return 0;
    if (programs->facts.n != programs->types.n || programs->starts[0] != 0) return 0;
    for (i = 1; i < programs->n_starts; i++)
        if (programs->starts[i] <= programs->starts[i - 1]) return 0;
    if ((uint64_t)programs->starts[programs->n_starts - 1] != programs->n_code) return 0;
    for (i = 0; i < programs->n_derived; i++)
        if ((uint64_t)programs->derived[i] >= programs->facts.n) return 0;
    if (programs->n_of_row != 0 && programs->n_of_row != table->n_rows) return 0;
    for (i = 0; i < programs->n_of_row; i++)
        if (programs->of_row[i] < -1 || programs->of_row[i] >= (int64_t)(programs->n_starts - 1 - programs->n_derived)) return 0;
    return 1;
}

/* Check each program; drop those that need a condition that this header does not know, and what they would compute with them.
 * `is_strange` and `is_later` are about facts by number. */
static inline void cdbi_check_programs(cdbi_opening *opening, unsigned char *is_strange, unsigned char *is_later)
{
    cdbi_programs *programs = &opening->table->programs;
    const cdb_schema *schema = opening->schema;
    size_t i, place, fact;
    for (i = 0; i < programs->n_programs && opening->status == CDB_OK; i++) {
        int is_derived = i < programs->n_derived;
        const int32_t *step = programs->code + 4 * programs->starts[i], *end = programs->code + 4 * programs->starts[i + 1];
        char type = CDBI_TRUTHS;
        if (cdbi_names_other(programs, is_later, i)) {
            cdbi_refuse(opening, CDB_BAD_FILE, "a fact is needed before it is computed", -1, "programs");
            return;
        }
        fact = is_derived ? (size_t)programs->derived[i] : 0;
        place = is_derived ? programs->places[fact] : 0;
        if (is_derived) is_later[fact] = 0;
        programs->is_dropped[i] = (unsigned char)cdbi_names_other(programs, is_strange, i);
        if (is_derived && place == schema->n_conditions) programs->is_dropped[i] = 1;
        if (programs->is_dropped[i]) {
            if (is_derived) is_strange[fact] = 1;
            if (is_derived && place < schema->n_conditions) {
                opening->columns[place].kind = 0;
                if (opening->table->soft) opening->table->soft[place].column.kind = 0;
            }
            continue;
        }
        if (is_derived) type = cdbi_value_type(schema->conditions[place].type);
        if (!cdbi_program_fits(programs, schema, i, type)) {
            cdbi_refuse(opening, CDB_BAD_FILE, "a rule or a derived fact cannot be computed", -1, "programs");
            return;
        }
        for (; step < end; step += 4)
            if (step[0] == CDBI_PUT_FACT)
                programs->is_needed[programs->places[step[1]]] |= !is_derived || !schema->conditions[programs->places[step[1]]].expr;
    }
}

/* The rows of each rule, one rule after another, and all of them as a mask. */
static inline void cdbi_list_rows(cdbi_opening *opening)
{
    cdb_table *table = opening->table;
    cdbi_programs *programs = &table->programs;
    size_t n_rules = programs->n_programs - programs->n_derived, row, i;
    programs->row_starts = (size_t *)cdbi_memory(opening, n_rules + 2, sizeof(size_t));
    programs->rows = (size_t *)cdbi_memory(opening, programs->n_of_row + 1, sizeof(size_t));
    programs->ruled = (uint64_t *)cdbi_memory(opening, table->n_words + 1, sizeof(uint64_t));
    if (!programs->row_starts || !programs->rows || !programs->ruled) return;
    for (row = 0; row < programs->n_of_row; row++) {
        int32_t rule = programs->of_row[row];
        if (rule < 0 || programs->is_dropped[programs->n_derived + (size_t)rule]) continue;
        programs->row_starts[rule + 2]++;
        programs->ruled[row / 64] |= (uint64_t)1 << row % 64;
    }
    for (i = 2; i < n_rules + 2; i++) programs->row_starts[i] += programs->row_starts[i - 1];
    for (row = 0; row < programs->n_of_row; row++)
        if (programs->ruled[row / 64] >> row % 64 & 1) programs->rows[programs->row_starts[programs->of_row[row] + 1]++] = row;
}

static inline void cdbi_link(cdbi_opening *opening)
{
    cdbi_programs *programs = &opening->table->programs;
    const cdb_schema *schema = opening->schema;
    unsigned char *is_known, *is_computed, *is_later;
    size_t i;
    if (programs->parts == 0 && opening->has_programs) {
        cdbi_refuse(opening, CDB_OTHER_TABLE, "its rules or derived facts are not there for C: compile the table again", -1, "");
        return;
    }
    if (programs->parts == 0) return;
    if (!cdbi_is_linked(opening->table)) {
        cdbi_refuse(opening, CDB_BAD_FILE, "its rules or derived facts do not go together", -1, "programs");
        return;
    }
    programs->n_programs = programs->n_starts - 1;
    opening->table->has_programs = 1;
    programs->places = (size_t *)cdbi_memory(opening, programs->facts.n + 1, sizeof(size_t));
    programs->is_dropped = (unsigned char *)cdbi_memory(opening, programs->n_programs + 1, 1);
    programs->is_needed = (unsigned char *)cdbi_memory(opening, schema->n_conditions + 1, 1);
    is_known = (unsigned char *)cdbi_memory(opening, schema->n_conditions + 1, 1);
    is_computed = (unsigned char *)cdbi_memory(opening, programs->facts.n + 1, 1);
    is_later = (unsigned char *)cdbi_memory(opening, programs->facts.n + 1, 1);
    if (opening->status != CDB_OK) return;
    cdbi_find_facts(opening, is_known);
    for (i = 0; i < programs->n_derived && opening->status == CDB_OK; i++) {
        if (is_computed[programs->derived[i]]) cdbi_refuse(opening, CDB_BAD_FILE, "a fact is computed twice", -1, "programs");
        is_computed[programs->derived[i]] = is_later[programs->derived[i]] = 1;
    }
    for (i = 0; i < programs->facts.n && opening->status == CDB_OK; i++) {
        size_t at = programs->places[i];
        if (at < schema->n_conditions && (schema->conditions[at].expr != NULL) != is_computed[i])
            cdbi_refuse(opening, CDB_OTHER_TABLE, is_computed[i] ? "it is derived, and this header takes it from the game"
                : "it is given, and this header computes it", (int)at, schema->conditions[at].name);
        if (at < schema->n_conditions) is_known[at] = 1;
        is_computed[i] = at == schema->n_conditions; /* from here on: whether it is strange */
    }
    if (opening->status == CDB_OK) cdbi_check_programs(opening, is_computed, is_later);
    for (i = 0; i < schema->n_conditions && opening->status == CDB_OK; i++)
        if (opening->columns[i].kind != 0 && schema->conditions[i].expr && !is_known[i])
            cdbi_refuse(opening, CDB_BAD_FILE, "nothing computes it", (int)i, schema->conditions[i].name);
    if (opening->status == CDB_OK) cdbi_list_rows(opening);
}
