
/* ---- For languages that call C and know none of its structures */

typedef enum cdb_size { CDB_N_CONDITIONS, CDB_N_ROWS, CDB_N_WORDS, CDB_LIVE_BYTES, CDB_PICKER_BYTES, CDB_N_LIMITED, CDB_N_OUTPUTS } cdb_size;

/* How many there are of something, or how many bytes it takes. */
CDB_API size_t cdb_any_size(const cdb_any *any, int what)
{
    switch (what) {
    case CDB_N_CONDITIONS: return any->schema.n_conditions;
    case CDB_N_ROWS: return any->table.n_rows;
    case CDB_N_WORDS: return any->table.n_words;
    case CDB_LIVE_BYTES: return cdb_live_bytes(&any->schema);
    case CDB_PICKER_BYTES: return sizeof(cdb_picker);
    case CDB_N_LIMITED: return any->table.n_limited;
    default: return what == CDB_N_OUTPUTS ? any->schema.n_outputs : 0;
    }
}

/* The name of a condition and its type, -1 for one that is computed; NULL for a number of none. */
CDB_API const char *cdb_any_condition(const cdb_any *any, int at, int *type)
{
    if (at < 0 || (size_t)at >= any->schema.n_conditions) return NULL;
    *type = any->schema.conditions[at].expr ? -1 : (int)any->schema.conditions[at].type;
    return any->schema.conditions[at].name;
}

/* Begin a picker in memory of CDB_PICKER_BYTES, with `n_rests` rests, all 0. */
CDB_API void cdb_start_picker(cdb_picker *picker, uint64_t seed, int64_t who, size_t memory, cdb_rest *rests, size_t n_rests)
{
    *picker = cdb_new_picker(seed, who, memory);
    picker->rests = rests;
    picker->n_rests = n_rests;
}
