/* Asks artefacts of any table without a face of its own: ask IN OUT.
 *
 * IN: a schema, what strange conditions do, the memory of the character that picks, -1 for none, some artefacts and some contexts, as whole numbers of 8 bytes, little-endian, and texts: their length without the 0
 * at their end, then their bytes. OUT: for each artefact the status of opening it; where that is 0, for each context the status,
 * the number of words, and the words of the answer. Artefacts lie in blocks of just their size, so that a sanitizer sees what is
 * read beyond. */

#include "tables.h"

#include <stdio.h>

static char *at;

static int64_t whole(void)
{
    int64_t value;
    memcpy(&value, at, 8);
    at += 8;
    return value;
}

static const char *text(void)
{
    int64_t length = whole();
    const char *found = at;
    if (length < 0) return NULL;
    at += length + 1;
    return found;
}

static const char **texts(int64_t n)
{
    const char **list = (const char **)calloc((size_t)n + 1, sizeof *list);
    int64_t i;
    for (i = 0; i < n; i++) list[i] = text();
    return list;
}

static cdb_fact fact(const cdb_condition *condition)
{
    cdb_fact found;
    memset(&found, 0, sizeof found);
    if (condition->expr) return found; /* it is computed */
    if (condition->type == CDB_TEXT) found.text = text();
    else if (condition->type == CDB_TAGS && condition->n_values > 0) {
        size_t size = (condition->n_values + 63) / 64 * 8;
        uint64_t *words = (uint64_t *)malloc(size);
        memcpy(words, at, size);
        at += size;
        found.tags = words;
    } else if (condition->type == CDB_TAGS) {
        found.texts.count = whole();
        found.texts.texts = texts(found.texts.count < 0 ? 0 : found.texts.count);
    } else {
        memcpy(&found, at, 8);
        at += 8;
    }
    return found;
}

static void put(FILE *out, int64_t value)
{
    fwrite(&value, 8, 1, out);
}

/* The same table with the schema of the file, and facts that are kept; NULL where it was not opened so. */
static cdb_any *any;
static cdb_live *lives[3];

/* Set a fact by its name, in the way that its type has. */
static cdb_status set(cdb_live *live, const cdb_condition *condition, const cdb_fact *given)
{
    const char *names[64];
    int number = cdb_condition_number(live->schema, condition->name);
    size_t i, n = 0;
    if (condition->expr || number < 0) return CDB_OK; /* it is computed, or the file does not ask for it */
    if (cdbi_is_missing(condition, given)) return cdb_set_missing(live, number);
    switch (condition->type) {
    case CDB_NUMBER:
    case CDB_ANGLE: return cdb_set_number(live, number, given->number);
    case CDB_ENUM: return given->whole < 0 || (uint64_t)given->whole >= condition->n_values ? CDB_WRONG_FACT : cdb_set_text(live, number, condition->values[given->whole]);
    case CDB_TEXT: return cdb_set_text(live, number, given->text);
    case CDB_TAGS:
        if (condition->n_values == 0) return cdb_set_tags(live, number, given->texts.texts, (size_t)given->texts.count);
        for (i = 1; i < condition->n_values; i++)
            if (given->tags[i / 64] >> (i % 64) & 1 && n < 64) names[n++] = condition->values[i];
        return cdb_set_tags(live, number, names, n);
    default: return cdb_set_whole(live, number, given->whole);
    }
}

/* Whether a query with the facts set in another way gives the same. */
static int is_same(const cdb_schema *schema, const cdb_fact *facts, cdb_unknown unknown, cdb_status status, const uint64_t *rows)
{
    cdb_live *live = any ? lives[unknown] : NULL;
    uint64_t *own = live ? (uint64_t *)malloc(any->table.n_words * 8 + 16) : NULL;
    size_t i;
    int is_right = 1;
    for (i = 0; live && i < schema->n_conditions; i++)
        if (set(live, &schema->conditions[i], &facts[i]) != CDB_OK) live = NULL; /* as some facts of the tests are */
    if (live) {
        is_right = cdb_live_query(live, own, any->table.n_words + 1, NULL) == status;
        is_right = is_right && memcmp(own, rows, any->table.n_words * 8) == 0 && own[any->table.n_words] == 0;
    }
    free(own);
    return is_right;
}

/* Whether a picker that went through bytes picks the same row, and is the same after that. */
static int picks_same(cdb_unknown unknown, const uint64_t *rows, double time_s, const cdb_picker *before, const cdb_picker *after,
    cdb_status status, int64_t picked)
{
    size_t size = cdb_picker_bytes(before), i;
    unsigned char *bytes = (unsigned char *)malloc(size);
    cdb_rest rests[64];
    cdb_picker copy;
    int64_t row;
    int is_right = 1;
    if (!any || any->table.by_cost) { /* the live facts may be those of another context */
        free(bytes);
        return 1;
    }
    cdb_pack_picker(before, bytes);
    for (i = 0; i < size; i++) is_right = is_right && cdb_unpack_picker(&copy, bytes, i, rests, 64) == CDB_BAD_FILE;
    is_right = is_right && cdb_unpack_picker(&copy, bytes, size, rests, 64) == CDB_OK;
    is_right = is_right && cdb_live_pick(lives[unknown], rows, any->table.n_words, time_s, &copy, &row, NULL) == status;
    is_right = is_right && row == picked && cdb_digest(&copy) == cdb_digest(after);
    free(bytes);
    return is_right;
}

/* Offer somebody for every role, and cast all rows. */
static void cast_all(uint64_t *rows)
{
    cdb_actor actors[CDB_MOST_ACTORS];
    size_t n = any->table.n_roles < CDB_MOST_ACTORS ? any->table.n_roles : CDB_MOST_ACTORS, i;
    uint64_t *masks = (uint64_t *)malloc((n * any->table.n_words + 1) * 8);
    int *playing = (int *)malloc((any->table.n_roles + 1) * sizeof(int));
    cdb_live *nobody = cdb_live_of(any, CDB_UNKNOWN_NEVER, malloc(cdb_live_bytes(&any->schema)));
    int64_t row;
    for (i = 0; i < n; i++) {
        actors[i].role = (int)i;
        actors[i].id = (int64_t)i / 2;
        actors[i].cost = cdb_missing_number();
        actors[i].facts = nobody->facts;
    }
    cdb_cast(&any->table, any->columns, &any->schema, nobody->facts, CDB_UNKNOWN_ANY, actors, n, masks, rows, any->table.n_words, NULL);
    for (row = -1; (row = cdb_next_row(rows, any->table.n_words, row)) >= 0;) cdb_casting(&any->table, actors, n, masks, row, playing);
    free(nobody);
    free(playing);
    free(masks);
}

/* One answer: rows met one after another must be those that are counted, and their assets must be there to read. */
static void answer(FILE *out, const cdb_table *table, const cdb_column *columns, const cdb_schema *schema, cdb_fact *facts,
    cdb_unknown unknown)
{
    uint64_t *rows = (uint64_t *)malloc(table->n_words * 8 + 8);
    cdb_fault fault;
    cdb_status status = cdb_query(table, columns, schema, facts, unknown, rows, table->n_words, &fault);
    int64_t row, n = 0;
    for (row = cdb_next_row(rows, table->n_words, -1); row >= 0; row = cdb_next_row(rows, table->n_words, row))
        n += strlen(cdb_asset(table, row)) < 100000;
    put(out, n == cdb_count(rows, table->n_words) && is_same(schema, facts, unknown, status, rows) ? (int64_t)status : -1);
    put(out, (int64_t)table->n_words);
    fwrite(rows, 8, table->n_words, out);
    free(rows);
}

/* The outputs of a row, or of none: whole numbers, doubles, and texts as their hash. */
static void read_outputs(FILE *out, const cdb_table *table, const cdb_schema *schema, int64_t row)
{
    size_t i, j;
    for (i = 0; i < schema->n_outputs; i++)
        switch (schema->outputs[i].type) {
        case CDB_OUT_BOOL: put(out, cdb_output_bool(table, i, row)); break;
        case CDB_OUT_INT: put(out, cdb_output_int(table, i, row)); break;
        case CDB_OUT_NUMBER:
        case CDB_OUT_NUMBERS:
            for (j = 0; j < schema->outputs[i].size; j++) fwrite(cdb_output_numbers(table, i, row) + j, 8, 1, out);
            break;
        default: put(out, (int64_t)cdbi_hash(CDBI_HASH, cdb_output_text(table, i, row)));
        }
}

/* More of a context: what soft cells cost, what plays on and what that costs, what a character picks, and for each row why it is not valid, a bit for each condition,
 * bit 62 for its rule, bit 61 where it is disabled. */
static void more(FILE *out, const cdb_table *table, const cdb_column *columns, const cdb_schema *schema, cdb_fact *facts,
    cdb_unknown unknown, double time_s, cdb_picker *picker)
{
    uint64_t *rows = (uint64_t *)malloc(table->n_words * 8 + 8), *widened = (uint64_t *)malloc(table->n_words * 8 + 8);
    double *penalties = (double *)malloc(table->n_rows * 8 + 8);
    cdb_status status = cdb_query(table, columns, schema, facts, unknown, rows, table->n_words, NULL);
    cdb_fault fault;
    int64_t row, picked = -1;
    put(out, (int64_t)table->n_rows);
    put(out, (int64_t)cdb_penalties(table, columns, schema, facts, unknown, penalties, table->n_rows, &fault));
    fwrite(penalties, 8, table->n_rows, out);
    put(out, (int64_t)cdb_query_widened(table, columns, schema, facts, unknown, widened, table->n_words, &fault));
    fwrite(widened, 8, table->n_words, out);
    put(out, (int64_t)cdb_penalties_widened(table, columns, schema, facts, unknown, penalties, table->n_rows, &fault));
    fwrite(penalties, 8, table->n_rows, out);
    if (status == CDB_OK) {
        cdb_rest rests[64];
        cdb_picker before = *picker;
        memcpy(rests, picker->rests, sizeof rests);
        before.rests = rests;
        status = cdb_pick(table, columns, schema, facts, unknown, rows, table->n_words, time_s, picker, &picked, &fault);
        if (!picks_same(unknown, rows, time_s, &before, picker, status, picked)) status = (cdb_status)99;
    }
    put(out, (int64_t)status);
    put(out, picked);
    put(out, (int64_t)cdb_digest(picker));
    read_outputs(out, table, schema, picked);
    for (row = 0; (uint64_t)row < table->n_rows; row++) {
        int reasons[63];
        size_t n, i;
        uint64_t bits = 0;
        status = cdb_why_not(table, columns, schema, facts, unknown, row, reasons, 63, &n, &fault);
        for (i = 0; i < n && i < 63; i++)
            bits |= (uint64_t)1 << (reasons[i] == CDB_RULE ? 62 : reasons[i] == CDB_DISABLED ? 61 : reasons[i] % 60);
        put(out, status == CDB_OK ? (int64_t)bits : -1);
    }
    free(rows);
    free(widened);
    free(penalties);
}

int main(int argc, char **argv)
{
    FILE *in = argc == 3 ? fopen(argv[1], "rb") : NULL, *out = argc == 3 ? fopen(argv[2], "wb") : NULL;
    static cdb_condition *conditions; /* static: what they hold to the end is no leak */
    static cdb_column *columns;
    static cdb_output_wanted *outputs;
    static cdb_schema schema;
    static cdb_unknown *unknown;
    static cdb_fact *facts;
    static char *input;
    char *artefacts;
    cdb_strange strange;
    int64_t memory, n_artefacts, n_contexts, n, i, j;
    long size;
    if (!in || !out || fseek(in, 0, SEEK_END) != 0 || (size = ftell(in)) < 0) return 2;
    rewind(in);
    at = input = (char *)malloc((size_t)size + 1);
    if (!at || fread(at, 1, (size_t)size, in) != (size_t)size) return 2;
    n = whole();
    conditions = (cdb_condition *)calloc((size_t)n + 1, sizeof *conditions);
    columns = (cdb_column *)calloc((size_t)n + 1, sizeof *columns);
    for (i = 0; i < n; i++) {
        conditions[i].name = text();
        conditions[i].type = (cdb_type)whole();
        conditions[i].expr = text();
        conditions[i].n_values = (size_t)whole();
        conditions[i].values = texts((int64_t)conditions[i].n_values);
    }
    schema.conditions = conditions;
    schema.n_conditions = (size_t)n;
    outputs = (cdb_output_wanted *)calloc((size_t)(n = whole()) + 1, sizeof *outputs);
    for (i = 0; i < n; i++) {
        outputs[i].name = text();
        outputs[i].type = (cdb_output_type)whole();
        outputs[i].size = (size_t)whole();
    }
    schema.outputs = outputs;
    schema.n_outputs = (size_t)n;
    n = (int64_t)schema.n_conditions;
    strange = (cdb_strange)whole();
    memory = whole();
    n_artefacts = whole();
    artefacts = at;
    for (i = 0; i < n_artefacts; i++) text();
    n_contexts = whole();
    unknown = (cdb_unknown *)calloc((size_t)n_contexts + 1, sizeof *unknown);
    facts = (cdb_fact *)calloc((size_t)(n_contexts * n) + 1, sizeof *facts);
    for (i = 0; i < n_contexts; i++) {
        unknown[i] = (cdb_unknown)whole();
        for (j = 0; j < n; j++) facts[i * n + j] = fact(&conditions[j]);
    }
    at = artefacts;
    for (i = 0; i < n_artefacts; i++) {
        int64_t length = whole();
        void *bytes = malloc((size_t)length + !length);
        cdb_table table;
        cdb_fault fault;
        cdb_picker picker = cdb_new_picker(7, 3, memory < 0 ? 0 : (size_t)memory);
        cdb_rest rests[64];
        memset(rests, 0, sizeof rests);
        picker.rests = rests;
        picker.n_rests = sizeof rests / sizeof *rests;
        memcpy(bytes, at, (size_t)length);
        at += length + 1;
        put(out, (int64_t)cdb_open(&table, columns, &schema, bytes, (size_t)length, strange, &fault));
        any = cdb_open_any(bytes, (size_t)length, NULL);
        if (i == 0 && fault.status == CDB_OK && table.n_strange == 0 && strange == CDB_STRANGE_REFUSED && !any) return 3;
        for (j = 0; any && j < 3; j++) lives[j] = cdb_live_of(any, (cdb_unknown)j, malloc(cdb_live_bytes(&any->schema)));
        if ((i > 0 || strange != CDB_STRANGE_REFUSED) && any && fault.status == CDB_OK) { /* one that may be damaged: what it answers is not compared */
            uint64_t *rows = (uint64_t *)malloc(any->table.n_words * 8 + 8);
            for (j = 0; j < n_contexts * n; j++) set(lives[unknown[j / n]], &conditions[j % n], &facts[j]);
            for (j = 0; j < 3; j++) cdb_live_query(lives[j], rows, any->table.n_words, NULL);
            cast_all(rows);
            for (j = 0; j < 3; j++) free(lives[j]);
            free(rows);
            cdb_close_any(any);
            any = NULL;
        }
        if (fault.status == CDB_OK)
            for (j = 0; j < n_contexts; j++) {
                answer(out, &table, columns, &schema, facts + j * n, unknown[j]);
                if (memory >= 0) more(out, &table, columns, &schema, facts + j * n, unknown[j], 0.5 * (double)j, &picker);
            }
        for (j = 0; any && j < 3; j++) free(lives[j]);
        cdb_close_any(any);
        cdb_close(&table);
        free(bytes);
    }
    return fclose(out) != 0;
}
