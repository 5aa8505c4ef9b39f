
/* ---- Files, for those who have no loader of their own */

#ifdef CDB_FILES

/* The bytes of a file, for cdb_open; give them to CDB_FREE behind cdb_close. NULL where it cannot be read. */
static inline void *cdb_read_file(const char *path, size_t *size, cdb_fault *fault)
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

#ifdef __cplusplus
}
#endif
