
/* ---- The schema of a table out of its artefact, for programs that were built before the table was made */

/* A table of any schema. It begins with its table: what takes a cdb_table takes its address. */
typedef struct cdb_any {
    cdb_table table;
    cdb_schema schema;
    cdb_column *columns;
} cdb_any;

/* The declared tags of a condition from number 1 on, with those above each. */
static inline void cdbi_list_tags(cdbi_opening *opening, cdbi_list *list)
{
    size_t room = 1, n = 1, i, j;
    const char *at;
    char *tag;
    cdbi_list tags = *list;
    for (i = 0; i < tags.n; i++)
        for (room++, at = tags.texts[i]; *at; at++) room += *at == '.';
    list->texts = (const char **)cdbi_memory(opening, room, sizeof *list->texts);
    list->n = 0;
    if (!list->texts) return;
    list->texts[0] = "";
    for (i = 0; i < tags.n; i++)
        for (at = tags.texts[i]; at && *at;) {
            const char *dot = strchr(at, '.');
            size_t length = dot ? (size_t)(dot - tags.texts[i]) : strlen(tags.texts[i]);
            for (j = 1; j < n && (strncmp(list->texts[j], tags.texts[i], length) != 0 || list->texts[j][length]); j++) {}
            if (j == n && (tag = (char *)cdbi_memory(opening, length + 1, 1)) != NULL) list->texts[n++] = (char *)memcpy(tag, tags.texts[i], length);
            at = dot ? dot + 1 : NULL;
        }
    list->n = n;
}

/* One condition of the file, at the end of those of the schema, where it is not among them already. */
static inline const char *cdbi_add_condition(cdbi_opening *opening, cdb_schema *schema, cdb_condition *conditions, const cdbi_json *about)
{
    cdb_condition *condition = &conditions[schema->n_conditions];
    cdbi_json name = cdbi_member(about, "name"), type = cdbi_member(about, "type"), expr = cdbi_member(about, "expr"),
        values = cdbi_member(about, "values"), is_type;
    cdbi_list listed = {NULL, 0, NULL};
    size_t i;
    if (name.why || type.why || expr.why || values.why) return "a condition lacks a part";
    condition->name = cdbi_kept_text(opening, &name);
    if (!condition->name) return "a condition has no name";
    for (i = 0; i < schema->n_conditions; i++)
        if (strcmp(conditions[i].name, condition->name) == 0) return NULL;
    for (i = 0; i <= CDB_TAGS; i++) {
        is_type = type;
        if (cdbi_is(&is_type, cdbi_type_name((cdb_type)i))) break;
    }
    if (i > CDB_TAGS) return "a condition has a type that is none";
    condition->type = (cdb_type)i;
    condition->expr = cdbi_peek(&expr) == '"' ? cdbi_kept_text(opening, &expr) : NULL;
    if ((condition->type == CDB_ENUM || condition->type == CDB_TAGS) && cdbi_peek(&values) == '[') {
        listed = cdbi_texts(opening, &values);
        if (values.why) return values.why;
        if (condition->type == CDB_TAGS && listed.n > 0) cdbi_list_tags(opening, &listed);
    }
    condition->values = listed.texts;
    condition->n_values = listed.n;
    schema->n_conditions++;
    return NULL;
}

/* The outputs that the file declares. */
static inline const char *cdbi_add_outputs(cdbi_opening *opening, cdb_schema *schema, const cdbi_json *header)
{
    cdbi_json entry = cdbi_member(header, "outputs.declared"), json;
    cdbi_array array;
    cdb_output_wanted *outputs;
    size_t n = 0, count, type;
    if (entry.why) return NULL;
    array = cdbi_read_array(opening->table, &entry);
    json.at = (const char *)array.at;
    json.end = json.at ? json.at + array.n_bytes : NULL;
    json.why = entry.why;
    if (entry.why) return entry.why;
    count = cdbi_count(&json);
    outputs = (cdb_output_wanted *)cdbi_memory(opening, count, sizeof *outputs);
    if (!outputs || !cdbi_take(&json, '[')) return json.why;
    for (; cdbi_next(&json, ']', &n) && n <= count; cdbi_skip(&json, 0), schema->n_outputs++) {
        cdb_output_wanted *output = &outputs[n - 1];
        cdbi_json name = cdbi_member(&json, "name"), size = cdbi_member(&json, "size"), values = cdbi_member(&json, "values"), kind;
        for (type = 0; type < 6; type++) {
            kind = cdbi_member(&json, "type");
            if (cdbi_is(&kind, cdbi_output_type_name((cdb_output_type)type))) break;
        }
        if (name.why || type == 6) return "an output has a type that is none";
        output->name = cdbi_kept_text(opening, &name);
        output->type = (cdb_output_type)type;
        output->size = output->type == CDB_OUT_NUMBERS ? (size_t)cdbi_whole(&size) : 1;
        if (output->type == CDB_OUT_ENUM) {
            cdbi_list listed = cdbi_texts(opening, &values);
            output->values = listed.texts;
            output->n_values = listed.n;
        }
        if (!output->name || output->size == 0 || values.why) return "an output lacks a part";
    }
    schema->outputs = outputs;
    return json.why;
}

/* Make the schema of the conditions of columns, of those that derived facts are computed from, and of those that rules name. */
static inline void cdbi_read_schema(cdbi_opening *opening, cdb_any *any, const cdbi_json *header, const cdbi_json *about)
{
    cdbi_json lists[3];
    cdb_condition *conditions;
    const char *why = NULL;
    size_t n = 0, i;
    lists[0] = cdbi_member(about, "conditions");
    lists[1] = cdbi_member(about, "computed_from");
    lists[2] = cdbi_member(about, "when");
    if (!lists[2].why) lists[2] = cdbi_member(&lists[2], "conditions");
    for (i = 0; i < 3; i++) n += lists[i].why ? 0 : cdbi_count(&lists[i]);
    conditions = (cdb_condition *)cdbi_memory(opening, n + 1, sizeof *conditions);
    any->columns = conditions ? (cdb_column *)cdbi_memory(opening, n + 1, sizeof *any->columns) : NULL;
    if (!any->columns) return;
    for (i = 0; i < 3 && !why; i++) {
        size_t at = 0;
        if (lists[i].why) continue;
        for (cdbi_take(&lists[i], '['); !why && cdbi_next(&lists[i], ']', &at) && any->schema.n_conditions < n; cdbi_skip(&lists[i], 0))
            why = cdbi_add_condition(opening, &any->schema, conditions, &lists[i]);
        if (!why) why = lists[i].why;
    }
    any->schema.conditions = conditions;
    if (!why) why = cdbi_add_outputs(opening, &any->schema, header);
    if (why) cdbi_refuse(opening, CDB_BAD_FILE, why, -1, "about");
    opening->columns = any->columns;
}

/* The number of a condition, -1 for a name that is none's; of an output. */
CDB_API int cdb_condition_number(const cdb_schema *schema, const char *name)
{
    size_t i;
    for (i = 0; i < schema->n_conditions; i++)
        if (strcmp(schema->conditions[i].name, name) == 0) return (int)i;
    return -1;
}

CDB_API int cdb_output_number_of(const cdb_schema *schema, const char *name)
{
    size_t i;
    for (i = 0; i < schema->n_outputs; i++)
        if (strcmp(schema->outputs[i].name, name) == 0) return (int)i;
    return -1;
}
