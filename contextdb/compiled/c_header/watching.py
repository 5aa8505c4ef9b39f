"""The part of a table's face that watches its file, with BASE where the name of the table stands."""

WATCH = """\
#ifdef CDB_WATCH
/* A compiled file that may be replaced while the game runs. Ask `now`, which is NULL until a file could be opened. */
typedef struct BASE_watch {
    cdb_watch file;
    BASE tables[2];
    void *bytes[2];
    BASE *now, *old; /* old: the table that was replaced, still to be asked, until it is released */
    cdb_strange strange;
} BASE_watch;

/* A watch of a file; nothing is read yet. The path stays where it is. */
static inline void BASE_watch_file(BASE_watch *watch, const char *path, cdb_strange strange)
{
    memset(watch, 0, sizeof *watch);
    watch->file.path = path;
    watch->strange = strange;
}

/* Look whether there is another file, and if so open it and exchange `now`; nothing is looked for while `old` is not released.
 * Where the new file is refused `now` stays as it is, and the fault is told once. */
static inline cdb_status BASE_watch_poll(BASE_watch *watch, cdb_fault *fault)
{
    size_t size, free_one = watch->now == &watch->tables[0];
    cdb_fault own;
    void *bytes;
    if (!fault) fault = &own;
    if (watch->old) return cdbi_fault(fault, CDB_OK, "", -1, "");
    bytes = cdb_read_changed(&watch->file, &size, fault);
    if (!bytes) return fault->status;
    if (BASE_open_with(&watch->tables[free_one], bytes, size, watch->strange, fault) != CDB_OK) {
        CDB_FREE(bytes);
        return fault->status;
    }
    watch->bytes[free_one] = bytes;
    watch->old = watch->now;
    watch->now = &watch->tables[free_one];
    return CDB_OK;
}

/* Give back the table that was replaced; nobody asks it any more. */
static inline void BASE_watch_release(BASE_watch *watch)
{
    size_t one = watch->old == &watch->tables[1];
    if (!watch->old) return;
    BASE_close(watch->old);
    CDB_FREE(watch->bytes[one]);
    watch->bytes[one] = NULL;
    watch->old = NULL;
}

static inline void BASE_watch_close(BASE_watch *watch)
{
    BASE_watch_release(watch);
    watch->old = watch->now;
    watch->now = NULL;
    BASE_watch_release(watch);
}
#endif
"""
