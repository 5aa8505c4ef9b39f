
/* Which columns of slots there are. */
static inline void cdbi_find_slots(cdbi_opening *opening, const cdbi_json *about)
{
    static const char *const names[] = {"Mandatory_Slots", "Optional_Slots"};
    cdbi_json slots = cdbi_member(about, "slots"), name;
    size_t n = 0;
    int i;
    if (slots.why) return;
    for (cdbi_take(&slots, '['); cdbi_next(&slots, ']', &n); cdbi_skip(&slots, 0))
        for (i = 0; i < 2; i++) {
            name = slots;
            if (n < 100 && cdbi_is(&name, names[i])) opening->slots[i].number = (int)n;
        }
}

/* What the text `about` says: the number of rows, the conditions, and how each column is kept. */
static inline void cdbi_about(cdbi_opening *opening, const cdbi_json *about, size_t depths)
{
    const char *why;
    cdbi_json rows = cdbi_member(about, "rows");
    uint64_t n_rows = cdbi_whole(&rows);
    if (rows.why || n_rows > opening->table->data_size) {
        cdbi_refuse(opening, CDB_BAD_FILE, rows.why ? rows.why : "the file is too short for its rows", -1, "about");
        return;
    }
    opening->table->n_rows = (size_t)n_rows;
    opening->table->n_words = (size_t)((n_rows + 63) / 64);
    cdbi_refuse_unknown(opening, *about);
    cdbi_find_slots(opening, about);
    why = opening->status == CDB_OK ? cdbi_columns(opening, about) : NULL;
    if (!why && opening->status == CDB_OK) why = cdbi_read_levels(opening, about, depths);
    if (why) cdbi_refuse(opening, CDB_BAD_FILE, why, -1, "about");
}

/* How many tables are in each other, out of the shape of ways.numbers; 0 where there is none. */
static inline size_t cdbi_depths(const cdbi_json *header)
{
    cdbi_json ways = cdbi_member(header, "ways.numbers"), shape = cdbi_member(&ways, "shape");
    uint64_t depths;
    if (ways.why || shape.why || !cdbi_take(&shape, '[')) return 0;
    depths = cdbi_whole(&shape);
    return depths > CDBI_DEPTHS ? CDBI_DEPTHS + 1 : (size_t)depths;
}

/* Read the header's texts, then its arrays. `about` is JSON inside a text of JSON: it is unfolded into memory of its own first. */
static inline void cdbi_read(cdbi_opening *opening, const cdbi_json *header)
{
    cdbi_json metadata = cdbi_member(header, "__metadata__"), layout = cdbi_member(&metadata, "contextdb"),
        about = cdbi_member(&metadata, "about"), whole;
    char version[8];
    size_t room;
    char *text;
    cdbi_text(&layout, version, sizeof version);
    if (layout.why || about.why) {
        cdbi_refuse(opening, CDB_BAD_FILE, metadata.why ? metadata.why : "not a file that contextdb compiled", -1, "");
        return;
    }
    if (strcmp(version, "4") != 0) cdbi_refuse(opening, CDB_BAD_FILE, "the layout of the file is not 4, which this header reads", -1, "");
    whole = about;
    cdbi_skip(&whole, 0);
    room = (size_t)(whole.at - about.at) + 1;
    if (whole.why) cdbi_refuse(opening, CDB_BAD_FILE, whole.why, -1, "about");
    if (opening->status != CDB_OK) return;
    text = (char *)CDB_MALLOC(room);
    if (!text) {
        cdbi_refuse(opening, CDB_NO_MEMORY, "there is not enough memory", -1, "");
        return;
    }
    whole.at = text;
    whole.end = text + cdbi_text(&about, text, room);
    if (opening->any) cdbi_read_schema(opening, opening->any, header, &whole);
    if (opening->status == CDB_OK) cdbi_about(opening, &whole, cdbi_depths(header));
    CDB_FREE(text);
    if (opening->status == CDB_OK) cdbi_arrays(opening, *header);
    if (opening->status == CDB_OK) cdbi_check(opening);
    if (opening->status == CDB_OK) cdbi_link(opening);
    if (opening->status == CDB_OK) cdbi_levels(opening);
    if (opening->status == CDB_OK) cdbi_outputs(opening, header);
    if (opening->status == CDB_OK) cdbi_make_roles(opening);
    if (opening->status == CDB_OK) cdbi_plays(opening, header);
}

static inline cdb_status cdbi_open(cdb_table *table, cdb_column *columns, const cdb_schema *schema, const void *bytes, size_t size,
    cdb_strange strange, cdb_any *any, cdb_fault *fault)
{
    const unsigned char *start = (const unsigned char *)bytes;
    cdbi_opening opening;
    cdbi_json header;
    uint64_t length = 0;
    int i;
    memset(table, 0, sizeof *table);
    memset(&opening, 0, sizeof opening);
    opening.table = table;
    opening.columns = columns;
    opening.schema = schema;
    opening.fault = fault;
    opening.strange = strange;
    opening.any = any;
    opening.status = cdbi_fault(fault, CDB_OK, "", -1, "");
    for (i = 0; size >= 8 && i < 8; i++) length |= (uint64_t)start[i] << (8 * i);
    if (size < 8 || length > size - 8) return cdbi_fault(fault, CDB_BAD_FILE, "the file is too short for its header", -1, "");
    if (((uintptr_t)bytes & 7) != 0)
        return cdbi_fault(fault, CDB_BAD_FILE, "the memory does not begin on an address that 8 divides", -1, "");
    table->data = start + 8 + length;
    table->data_size = size - 8 - (size_t)length;
    header.at = (const char *)start + 8;
    header.end = header.at + length;
    header.why = NULL;
    cdbi_read(&opening, &header);
    if (opening.status != CDB_OK) cdb_close(table);
    return opening.status;
}

/* Open an artefact from memory that stays where it is, unchanged, until cdb_close. It begins on an address that 8 divides, as the
 * memory of malloc and of a mapped file does. `columns` has room for n_conditions. Where it is refused the table is closed. */
CDB_API cdb_status cdb_open(cdb_table *table, cdb_column *columns, const cdb_schema *schema, const void *bytes, size_t size,
    cdb_strange strange, cdb_fault *fault)
{
    memset(columns, 0, schema->n_conditions * sizeof *columns);
    return cdbi_open(table, columns, schema, bytes, size, strange, NULL, fault);
}

/* Open an artefact of any schema, which it has itself. NULL where it is refused. */
CDB_API cdb_any *cdb_open_any(const void *bytes, size_t size, cdb_fault *fault)
{
    cdb_any *any = (cdb_any *)CDB_MALLOC(sizeof *any);
    if (!any) {
        cdbi_fault(fault, CDB_NO_MEMORY, "there is not enough memory", -1, "");
        return NULL;
    }
    memset(any, 0, sizeof *any);
    if (cdbi_open(&any->table, NULL, &any->schema, bytes, size, CDB_STRANGE_REFUSED, any, fault) == CDB_OK) return any;
    CDB_FREE(any);
    return NULL;
}

CDB_API void cdb_close_any(cdb_any *any)
{
    if (any) cdb_close(&any->table);
    CDB_FREE(any);
}
