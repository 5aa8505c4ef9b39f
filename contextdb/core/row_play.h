
#ifndef CDB_ROW_PLAY
#define CDB_ROW_PLAY
/* ---- How the animation of a row plays: what the outputs with a reserved name say. NaN: as the settings of the game say. */

typedef enum cdb_mirror { CDB_AS_ASKED, CDB_ALWAYS_MIRRORED, CDB_NEVER_MIRRORED } cdb_mirror;
typedef enum cdb_root { CDB_ROOT_ANIMATION, CDB_ROOT_CODE, CDB_ROOT_MIXED, CDB_ROOT_PATH } cdb_root;
typedef enum cdb_until { CDB_UNTIL_NATURAL, CDB_UNTIL_ANY } cdb_until;

typedef struct cdb_row_play {   /* doubles alone, as in the file; of a word its number */
    double blend_s, start_s;    /* seconds until a jump to it is hidden, and where in its clip it begins */
    double min_rate, max_rate;  /* how fast it plays, or the limits within which it may */
    double mirror, loop, root, until;
} cdb_row_play;
#endif
