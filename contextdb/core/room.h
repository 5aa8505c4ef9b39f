/* ---- Room: a block of memory that a call is given, handed out part by part. Nothing in it outlives the call. */

typedef struct cdbm_room {
    char *at;
    size_t left;
} cdbm_room;

/* How many bytes so many take: all parts begin where any number may. */
static inline size_t cdbm_rounded(size_t n_bytes)
{
    return (n_bytes + 15) & ~(size_t)15;
}

/* The next part of so many bytes; NULL where there is too little. */
static inline void *cdbm_part(cdbm_room *room, size_t n_bytes)
{
    char *part = room->at;
    if (cdbm_rounded(n_bytes) > room->left) return NULL;
    room->at += cdbm_rounded(n_bytes), room->left -= cdbm_rounded(n_bytes);
    return part;
}
