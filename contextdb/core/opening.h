
/* ---- Opening: what the header of the file says is held against what stands in the file, once. First, faults and memory. */

#define CDBI_VALUE 1
#define CDBI_FLAT 2
#define CDBI_WIDE 3
#define CDBI_SLOTS 4
#define CDBI_NOT_SAID ((size_t)-1)
#define CDBI_DEPTHS 64

static inline cdb_status cdbi_fault(cdb_fault *fault, cdb_status status, const char *reason, int condition, const char *name)
{
    if (fault) {
        size_t length = strlen(name);
        if (length >= CDB_NAME_BYTES) length = CDB_NAME_BYTES - 1;
        fault->status = status;
        fault->reason = reason;
        fault->condition = condition;
        memcpy(fault->name, name, length);
        fault->name[length] = 0;
    }
    return status;
}

typedef struct cdbi_slots {         /* the column that names roles that rows need, or may have */
    int number;                     /* among the columns of slots, from 1; 0 where there is none */
    const int32_t *codes;
    cdbi_list texts;
} cdbi_slots;

typedef struct cdbi_opening {
    cdb_table *table;
    cdb_column *columns;
    const cdb_schema *schema;
    cdb_fault *fault;
    cdb_status status;
    cdb_strange strange;
    int has_ways;                   /* the table has tables inside */
    int has_programs;               /* the table has rules or derived facts */
    cdbi_slots slots[2];            /* mandatory, optional */
    struct cdb_any *any;            /* what gets the schema out of the file; NULL where the caller has one */
} cdbi_opening;

/* Keep the first fault of an opening. */
static inline void cdbi_refuse(cdbi_opening *opening, cdb_status status, const char *reason, int condition, const char *name)
{
    if (opening->status == CDB_OK) opening->status = cdbi_fault(opening->fault, status, reason, condition, name);
}

static inline const char *cdbi_name(const cdbi_opening *opening, size_t at)
{
    return opening->schema->conditions[at].name;
}

/* Memory for `n` things of `size` bytes, all 0, that lives as long as the table. */
static inline void *cdbi_memory(cdbi_opening *opening, size_t n, size_t size)
{
    void **block = NULL;
    if (n < ((size_t)-1 - 16) / size) block = (void **)CDB_MALLOC(16 + n * size);
    if (!block) {
        cdbi_refuse(opening, CDB_NO_MEMORY, "there is not enough memory", -1, "");
        return NULL;
    }
    block[0] = opening->table->blocks;
    opening->table->blocks = block;
    return memset((char *)block + 16, 0, n * size);
}

CDB_API void cdb_close(cdb_table *table)
{
    void **block = (void **)table->blocks;
    while (block) {
        void **next = (void **)block[0];
        CDB_FREE(block);
        block = next;
    }
    memset(table, 0, sizeof *table);
}

/* The texts of a list of texts, each ended by 0. */
static inline cdbi_list cdbi_texts(cdbi_opening *opening, cdbi_json *json)
{
    cdbi_list list = {NULL, 0, NULL};
    size_t count = cdbi_count(json), n = 0;
    size_t room = count + (size_t)(json->end - json->at);
    char *to;
    if (count == 0) {
        cdbi_skip(json, 0);
        return list;
    }
    {
        cdbi_json whole = *json; /* a list of few texts in a long header takes no more room than its own characters */
        cdbi_skip(&whole, 0);
        if (whole.why == NULL) room = count + (size_t)(whole.at - json->at);
    }
    list.texts = (const char **)cdbi_memory(opening, count, sizeof *list.texts);
    to = list.texts ? (char *)cdbi_memory(opening, room, 1) : NULL;
    if (!to) {
        cdbi_fail(json, "there is not enough memory");
        return list;
    }
    cdbi_take(json, '[');
    while (cdbi_next(json, ']', &n) && n <= count) {
        list.texts[n - 1] = to;
        to += cdbi_text(json, to, room) + 1;
    }
    list.n = json->why ? 0 : count;
    return list;
}
