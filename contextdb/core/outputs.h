
/* ---- Outputs: what the rows give the game besides their assets */

/* The array of an output's part: "outputs.007.values". */
static inline cdbi_array cdbi_output_array(const cdbi_opening *opening, cdbi_json header, size_t number, const char *part,
    const char **why)
{
    char key[64], digits[24];
    size_t n = 0, length = strlen("outputs.");
    cdbi_json entry;
    cdbi_array array;
    memcpy(key, "outputs.", length);
    while (number > 0 || n < 3) {
        digits[n++] = (char)('0' + number % 10);
        number /= 10;
    }
    while (n > 0) key[length++] = digits[--n];
    key[length++] = '.';
    memcpy(key + length, part, strlen(part) + 1);
    entry = cdbi_member(&header, key);
    array = cdbi_read_array(opening->table, &entry);
    if (entry.why) *why = entry.why;
    return array;
}

/* Take the values of an output; what is wrong with them, or NULL. */
static inline const char *cdbi_take_output(cdbi_opening *opening, const cdbi_json *header, size_t number,
    const cdb_output_wanted *wanted, cdb_output *output)
{
    size_t n = opening->table->n_rows + 1, i;
    const char *why = NULL;
    int is_text = wanted->type == CDB_OUT_ENUM || wanted->type == CDB_OUT_TEXT, fits;
    cdbi_array array = cdbi_output_array(opening, *header, number, is_text ? "codes" : "values", &why), texts;
    const void *at = array.at;
    if (why) return why;
    output->size = wanted->size;
    fits = array.shape[0] == n;
    switch (wanted->type) {
    case CDB_OUT_BOOL:
        output->bools = array.at;
        fits = fits && cdbi_fits(&array, "U8", 1, n);
        break;
    case CDB_OUT_INT:
        output->ints = (const int64_t *)at;
        fits = fits && cdbi_fits(&array, "I64", 1, n);
        break;
    case CDB_OUT_NUMBER:
        output->numbers = (const double *)at;
        fits = fits && cdbi_fits(&array, "F64", 1, n);
        break;
    case CDB_OUT_NUMBERS:
        output->numbers = (const double *)at;
        fits = fits && cdbi_fits(&array, "F64", 2, wanted->size);
        break;
    default:
        output->codes = (const int32_t *)at;
        fits = fits && cdbi_fits(&array, "I32", 1, n);
        texts = cdbi_output_array(opening, *header, number, "texts", &why);
        if (why) return why;
        output->texts = cdbi_take_texts(opening, &texts, wanted->name);
        for (i = 0; fits && i < n; i++) fits = output->codes[i] >= 0 && (size_t)output->codes[i] < output->texts.n;
        for (i = 0; wanted->type == CDB_OUT_ENUM && fits && opening->status == CDB_OK && i < wanted->n_values; i++)
            if (i + 1 >= output->texts.n || strcmp(output->texts.texts[i], wanted->values[i]) != 0)
                cdbi_refuse(opening, CDB_OTHER_TABLE, "the values of an output are others than those of this header", -1,
                    wanted->name);
    }
    return fits ? NULL : "the values of an output have another type, shape or place than they must have";
}

/* Take how the rows play, where the file says. */
static inline void cdbi_plays(cdbi_opening *opening, const cdbi_json *header)
{
    cdbi_json entry = cdbi_member(header, "outputs.plays");
    cdbi_array array;
    if (entry.why) return;
    array = cdbi_read_array(opening->table, &entry);
    if (entry.why || !cdbi_fits(&array, "F64", 2, sizeof(cdb_row_play) / sizeof(double)) || array.shape[0] != opening->table->n_rows + 1)
        cdbi_refuse(opening, CDB_BAD_FILE, "how rows play has another type, shape or place than it must have", -1, "outputs.plays");
    else opening->table->plays = (const cdb_row_play *)(const void *)array.at;
}

/* Find the outputs that the header reads among those that the file declares. */
static inline void cdbi_outputs(cdbi_opening *opening, const cdbi_json *header)
{
    const cdb_schema *schema = opening->schema;
    cdb_table *table = opening->table;
    size_t i, n;
    if (schema->n_outputs == 0) return;
    table->outputs = (cdb_output *)cdbi_memory(opening, schema->n_outputs, sizeof *table->outputs);
    for (i = 0; table->outputs && i < schema->n_outputs && opening->status == CDB_OK; i++) {
        const cdb_output_wanted *wanted = &schema->outputs[i];
        const char *why = "the table has no such output";
        cdb_status status = CDB_OTHER_TABLE;
        cdbi_json entry = cdbi_member(header, "outputs.declared"), json;
        cdbi_array array = cdbi_read_array(table, &entry);
        json.at = (const char *)array.at;
        json.end = json.at ? json.at + array.n_bytes : NULL;
        json.why = entry.why;
        if (!entry.why) cdbi_take(&json, '[');
        for (n = 0; !entry.why && cdbi_next(&json, ']', &n); cdbi_skip(&json, 0)) {
            cdbi_json name = cdbi_member(&json, "name"), type = cdbi_member(&json, "type"), size = cdbi_member(&json, "size");
            if (!cdbi_is(&name, wanted->name)) continue;
            why = "an output has another type, or another size, than this header reads";
            if (!cdbi_is(&type, cdbi_output_type_name(wanted->type))) break;
            if (wanted->type == CDB_OUT_NUMBERS && cdbi_whole(&size) != wanted->size) break;
            why = cdbi_take_output(opening, header, n - 1, wanted, &table->outputs[i]);
            status = CDB_BAD_FILE;
            break;
        }
        if (why) cdbi_refuse(opening, status, why, -1, wanted->name);
    }
}

static inline size_t cdbi_output_row(const cdb_table *table, int64_t row)
{
    return row >= 0 && (uint64_t)row < table->n_rows ? (size_t)row : table->n_rows;
}

/* How a row plays, by its reserved outputs; NULL where the table has none. -1 reads what plays where no row is picked. */
static inline const cdb_row_play *cdb_play_of(const cdb_table *table, int64_t row)
{
    return table->plays ? &table->plays[cdbi_output_row(table, row)] : NULL;
}

/* The value of an output in a row; -1, as of a pick without a row, reads what there is then: the fallback's, else the default. */
CDB_API int cdb_output_bool(const cdb_table *table, size_t output, int64_t row)
{
    return table->outputs[output].bools[cdbi_output_row(table, row)] != 0;
}

CDB_API int64_t cdb_output_int(const cdb_table *table, size_t output, int64_t row)
{
    return table->outputs[output].ints[cdbi_output_row(table, row)];
}

CDB_API double cdb_output_number(const cdb_table *table, size_t output, int64_t row)
{
    return table->outputs[output].numbers[cdbi_output_row(table, row)];
}

/* The text of a text or an enum. */
CDB_API const char *cdb_output_text(const cdb_table *table, size_t output, int64_t row)
{
    return table->outputs[output].texts.texts[table->outputs[output].codes[cdbi_output_row(table, row)]];
}

/* The number of an enum's value; CDB_MISSING where it has none. */
CDB_API int cdb_output_enum(const cdb_table *table, size_t output, int64_t row)
{
    return *cdb_output_text(table, output, row) ? (int)table->outputs[output].codes[cdbi_output_row(table, row)] : CDB_MISSING;
}

/* The first of the numbers of an output of several. */
CDB_API const double *cdb_output_numbers(const cdb_table *table, size_t output, int64_t row)
{
    return table->outputs[output].numbers + cdbi_output_row(table, row) * table->outputs[output].size;
}
