
/* ---- Pickers as bytes, for saved games and the network, and a digest by which two machines compare what they picked
 *
 * Whole numbers of 8 bytes, little-endian: 1 (the layout), seed, character, turn, memory, the assets remembered, the number of rests,
 * and for each its row, its turn, and its time. Equal pickers give equal bytes where their rests came in the same order. */

#define CDBI_PICKER_WORDS 6

static inline size_t cdbi_count_rests(const cdb_picker *picker)
{
    size_t i, n = 0;
    for (i = 0; i < picker->n_rests; i++) n += picker->rests[i].key != 0;
    return n;
}

/* How many bytes a picker takes now. */
CDB_API size_t cdb_picker_bytes(const cdb_picker *picker)
{
    return 8 * (CDBI_PICKER_WORDS + picker->memory + 3 * cdbi_count_rests(picker));
}

/* Write a picker into `bytes`, which has room for cdb_picker_bytes. */
CDB_API void cdb_pack_picker(const cdb_picker *picker, void *bytes)
{
    unsigned char *to = (unsigned char *)bytes;
    uint64_t head[5];
    size_t i, n;
    head[0] = 1;
    head[1] = picker->seed;
    head[2] = (uint64_t)picker->who;
    head[3] = (uint64_t)picker->turn;
    head[4] = picker->memory;
    memcpy(to, head, sizeof head);
    memcpy(to + sizeof head, picker->recent, 8 * picker->memory);
    to += sizeof head + 8 * picker->memory;
    head[0] = n = cdbi_count_rests(picker);
    memcpy(to, head, 8);
    for (to += 8, i = 0; i < picker->n_rests; i++)
        if (picker->rests[i].key != 0) {
            memcpy(to, &picker->rests[i].key, 8);
            memcpy(to + 8, &picker->rests[i].turn, 8);
            memcpy(to + 16, &picker->rests[i].time_s, 8);
            to += 24;
        }
}

/* Read a picker that was written, with the array of rests that it shall have. CDB_BAD_FILE for bytes that are none, CDB_TOO_SHORT
 * where they need more rests; the picker then stays as it is. */
CDB_API cdb_status cdb_unpack_picker(cdb_picker *picker, const void *bytes, size_t size, cdb_rest *rests, size_t n_rests)
{
    const unsigned char *from = (const unsigned char *)bytes, *at;
    uint64_t head[5], n = 0, i, key;
    if (size < 8 * CDBI_PICKER_WORDS || size % 8 != 0) return CDB_BAD_FILE;
    memcpy(head, from, sizeof head);
    if (head[0] != 1 || head[4] > CDB_MEMORY || size < 8 * (CDBI_PICKER_WORDS + head[4])) return CDB_BAD_FILE;
    at = from + sizeof head + 8 * head[4];
    memcpy(&n, at, 8);
    if (n != (size - 8 * (CDBI_PICKER_WORDS + head[4])) / 24 || size != 8 * (CDBI_PICKER_WORDS + head[4] + 3 * n)) return CDB_BAD_FILE;
    for (i = 0; i < n; i++) {
        memcpy(&key, at + 8 + 24 * i, 8);
        if (key == 0) return CDB_BAD_FILE;
    }
    if (n > n_rests) return CDB_TOO_SHORT;
    *picker = cdb_new_picker(head[1], (int64_t)head[2], (size_t)head[4]);
    picker->turn = (int64_t)head[3];
    memcpy(picker->recent, from + sizeof head, 8 * (size_t)head[4]);
    picker->rests = rests;
    picker->n_rests = n_rests;
    if (n_rests) memset(rests, 0, n_rests * sizeof *rests);
    for (i = 0; i < n; i++) {
        cdb_rest rest, *place;
        memcpy(&rest.key, at + 8 + 24 * i, 8);
        memcpy(&rest.turn, at + 16 + 24 * i, 8);
        memcpy(&rest.time_s, at + 24 + 24 * i, 8);
        place = cdbi_find_rest(picker, rest.key);
        if (place) *place = rest;
    }
    return CDB_OK;
}

/* A digest of what a character picked; that of several characters is the sum of theirs. Two machines whose digests differ do not play
 * the same. Python's Picker.digest() gives the same number. */
CDB_API uint64_t cdb_digest(const cdb_picker *picker)
{
    const uint64_t parts[3] = {picker->seed, (uint64_t)picker->who, (uint64_t)picker->turn};
    uint64_t digest = CDBI_HASH;
    size_t i;
    for (i = 0; i < 3 + picker->memory; i++) {
        digest = (digest ^ (i < 3 ? parts[i] : picker->recent[i - 3])) * 0x9E3779B97F4A7C15;
        digest ^= digest >> 32;
    }
    return digest;
}
