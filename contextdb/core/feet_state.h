/* ---- What a foot is between two updates: so many numbers, whose places these are. */

enum {
    CDBO_SEEN = 0,        /* whether it was seen, is down in the clip, and is locked */
    CDBO_DOWN = 1,
    CDBO_LOCKED = 2,
    CDBO_POINT = 3,       /* where it is locked over the ground: x and z */
    CDBO_FOOT_OFFSET = 5, /* the offset to that, or to where the foot is without a lock, and its change a second */
    CDBO_FOOT_SPEED = 8,
    CDBO_FREE = 11,       /* where it is without a lock */
    CDBO_DISPLAYED = 14,  /* and where it is displayed */
    CDBO_LIFTED = 17,     /* for how many seconds it is still lifted, as it had to be let go on the ground */
    CDBO_STOOD = 18,      /* for how many it is locked */
    CDBO_FOOT = 19
};

#define CDBO_FAR_M 1.0 /* a foot farther from its clip's place is of a character that was put elsewhere: it goes there at once */

/* Whether a foot is of a character that was put elsewhere. */
static inline int cdbo_is_far(const double *toe, const double *foot)
{
    return foot[CDBO_SEEN] == 0.0 || cdbo_flat_length(toe[0] - foot[CDBO_FREE], toe[2] - foot[CDBO_FREE + 2]) > CDBO_FAR_M;
}
