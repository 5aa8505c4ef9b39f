
/* ---- Files, for those who have no loader of their own */

#ifdef CDB_FILES

/* The bytes of a file, for cdb_open; give them to CDB_FREE behind cdb_close. NULL where it cannot be read. */
CDB_API void *cdb_read_file(const char *path, size_t *size, cdb_fault *fault)
{
    FILE *file = NULL;
    void *bytes = NULL;
    long length = -1;
    *size = 0;
#ifdef _MSC_VER
    if (fopen_s(&file, path, "rb") != 0) file = NULL;
#else
    file = fopen(path, "rb");
#endif
    if (file && fseek(file, 0, SEEK_END) == 0) length = ftell(file);
    if (length >= 0 && length < INT32_MAX && fseek(file, 0, SEEK_SET) == 0) {
        bytes = CDB_MALLOC((size_t)length + 8); /* a file of 0 bytes has a block too */
        if (bytes && fread(bytes, 1, (size_t)length, file) != (size_t)length) {
            CDB_FREE(bytes);
            bytes = NULL;
        }
    }
    if (file) fclose(file);
    if (bytes) *size = (size_t)length;
    cdbi_fault(fault, bytes ? CDB_OK : CDB_CANNOT_READ, bytes ? "" : "the file cannot be read", -1, path);
    return bytes;
}
#endif

#ifdef CDB_WATCH /* define it beside CDB_FILES before this header is included, to have watches */

typedef struct cdb_watch {          /* a file that may be replaced while the game runs */
    const char *path;
    int64_t stamp[4];
    int was_there;
} cdb_watch;

static inline int cdbi_stamp(const char *path, int64_t stamp[4])
{
#ifdef _MSC_VER
    struct _stat64 found;
    if (_stat64(path, &found) != 0) return 0;
#else
    struct stat found;
    if (stat(path, &found) != 0) return 0;
#endif
    stamp[0] = (int64_t)found.st_size;
    stamp[1] = (int64_t)found.st_mtime;
    stamp[2] = (int64_t)found.st_ino;
#if defined(st_mtime) && !defined(__APPLE__) && !defined(_MSC_VER)
    stamp[3] = (int64_t)found.st_mtim.tv_nsec;
#else
    stamp[3] = 0;
#endif
    return 1;
}

/* The bytes of the file where it is another one than the last time it was looked at; else NULL. Give them to CDB_FREE. */
CDB_API void *cdb_read_changed(cdb_watch *watch, size_t *size, cdb_fault *fault)
{
    int64_t stamp[4] = {0, 0, 0, 0};
    int is_there = cdbi_stamp(watch->path, stamp);
    *size = 0;
    cdbi_fault(fault, CDB_OK, "", -1, "");
    if (is_there == watch->was_there && memcmp(stamp, watch->stamp, sizeof stamp) == 0) return NULL;
    watch->was_there = is_there;
    memcpy(watch->stamp, stamp, sizeof stamp);
    return is_there ? cdb_read_file(watch->path, size, fault) : NULL;
}
#endif

#ifdef __cplusplus
}
#endif
