/* ---- Clips of several characters: what their actors see of each other, where in the world one is put down, and how each actor plays it.
 *
 *   cdbm_see_other    one place as another body sees it, in the units of costs
 *   cdbm_align        where a clip has each actor, when it is put down so that they have the least to make up for
 *   cdbm_begin_roles  a one-off for each role: all are in step, and to each other as they were recorded from the contact on
 *
 * Places are x, z and heading. K roles. See contextdb/motion/joint/alignment.py and contextdb/motion/nodes/joint_node.py. */

#define CDBM_UNIT_M 0.5             /* so many metres count as much as the usual spread of a feature */
#define CDBM_UNIT_FACING 0.5

static inline void cdbm_see_other(const double *place, const double *other, double *to)
{
    double sine, cosine;
    cdbm_seen(other[0] - place[0], other[1] - place[1], place[2], to);
    cdbo_sin_cos(other[2] - place[2], &sine, &cosine);
    to[0] /= CDBM_UNIT_M, to[1] /= CDBM_UNIT_M, to[2] = sine / CDBM_UNIT_FACING, to[3] = cosine / CDBM_UNIT_FACING;
}

/* How much a role counts when a clip is put down: the less it gives way the more, and alone where it does not. Where none does, all are
 * alike. Not yet shares of one. */
static inline double cdbm_firmness(const double *gives, size_t n, size_t role)
{
    size_t k, n_still = 0;
    for (k = 0; k < n; k++) n_still += gives[k] == 0.0;
    if (n_still == n) return 1.0;
    return n_still > 0 ? (gives[role] == 0.0 ? 1.0 : 0.0) : 1.0 / gives[role];
}

/* Write where a clip that was recorded at some places [K, 3] has each actor, when it is put down best for actors at others: [K, 3].
 * `gives` [K] is how readily each role gives way. */
static inline void cdbm_align(const double *recorded, const double *places, const double *gives, size_t n, double *to)
{
    double all = 0.0, centre[2] = {0.0, 0.0}, was[2] = {0.0, 0.0}, sine = 0.0, cosine = 0.0, turn;
    size_t k, i;
    for (k = 0; k < n; k++) all += cdbm_firmness(gives, n, k);
    for (k = 0; k < n; k++) {
        double weight = cdbm_firmness(gives, n, k) / all;
        for (i = 0; i < 2; i++) centre[i] += weight * places[3 * k + i], was[i] += weight * recorded[3 * k + i];
    }
    for (k = 0; k < n; k++) {
        double weight = cdbm_firmness(gives, n, k) / all, turned[2];
        double x = places[3 * k] - centre[0], z = places[3 * k + 1] - centre[1], own_x = recorded[3 * k] - was[0], own_z = recorded[3 * k + 1] - was[1];
        cdbo_sin_cos(places[3 * k + 2] - recorded[3 * k + 2], &turned[0], &turned[1]);
        sine += weight * (own_z * x - own_x * z + turned[0]);
        cosine += weight * (own_x * x + own_z * z + turned[1]);
    }
    turn = cdbo_atan2(sine, cosine);
    for (k = 0; k < n; k++) {
        cdbm_seen(recorded[3 * k] - was[0], recorded[3 * k + 1] - was[1], -turn, to + 3 * k);
        to[3 * k] += centre[0], to[3 * k + 1] += centre[1], to[3 * k + 2] = recorded[3 * k + 2] + turn;
    }
}

/* The contact is the earliest end of a warp range of any role, and the actors are brought together from the earliest beginning of these
 * on; up to the last frame where there is no contact ahead. Seconds since the entry. */
static inline cdbm_window cdbm_window_of_roles(const cdbm_clips *clips, const int64_t *ranges, size_t n, int64_t frame, double last_s, const double *warps)
{
    double own_s = (double)frame / clips->rate;
    cdbm_window window = {(double)INFINITY, (double)INFINITY};
    size_t k, i;
    for (k = 0; k < n; k++)
        for (i = 0; i < 2; i++) {
            const double *span = warps + 4 * (size_t)ranges[k] + 2 * i;
            if (span[0] - own_s < window.from_s) window.from_s = span[0] - own_s;
            if (span[1] - own_s < window.to_s) window.to_s = span[1] - own_s;
        }
    if (window.to_s == (double)INFINITY || window.to_s <= CDBM_TOLERANCE_S) window.from_s = 0.0, window.to_s = last_s;
    window.to_s = cdbo_least(window.to_s, last_s);
    window.from_s = cdbo_least(cdbo_most(0.0, window.from_s), window.to_s);
    return window;
}

/* Where a role's actor, who starts at a place, is to be at the contact, which is some frames on: as the clip has him there, put down so that
 * he would start at `put`. */
static inline cdbm_target cdbm_contact_of(const float *root, double frames, size_t last, const double *put, const double *start)
{
    size_t low = frames < (double)last ? (size_t)frames : last, high = low < last ? low + 1 : last, i;
    double share = frames - (double)low, here[3], there[3], motion[3];
    cdbm_target target;
    for (i = 0; i < 3; i++) {
        double step = (double)root[3 * high + i] - (double)root[3 * low + i];
        here[i] = (double)root[i], there[i] = (double)root[3 * low + i] + share * (i < 2 ? step : cdbo_remainder(step));
    }
    cdbm_seen(there[0] - here[0], there[1] - here[1], here[2], motion);
    motion[2] = there[2] - here[2];
    cdbm_then(put, motion, there);
    cdbm_seen(there[0] - start[0], there[1] - start[1], start[2], motion);
    target.left = motion[0], target.ahead = motion[1], target.turn = cdbo_remainder(there[2] - start[2]);
    return target;
}

/* Begin a clip some frames after its start, in the range of each role: with the places to which it is put down and those of its actors,
 * [K, 3] each. `warps` are those of all ranges. It ends before the first frame that is excluded in any role. */
static inline void cdbm_begin_roles(const cdbm_clips *clips, const int64_t *ranges, size_t n, int64_t frame, const double *warps,
    const double *put, const double *starts, cdbm_one_off *to)
{
    int64_t n_more = INT64_MAX;
    cdbm_window window;
    size_t k;
    for (k = 0; k < n; k++) {
        int64_t first = clips->starts[ranges[k]] + frame, own = cdbm_free_until(clips, first + 1, clips->stops[ranges[k]]) - 1 - first;
        if (own < n_more) n_more = own;
    }
    window = cdbm_window_of_roles(clips, ranges, n, frame, (double)n_more / clips->rate, warps);
    for (k = 0; k < n; k++) {
        int64_t first = clips->starts[ranges[k]] + frame;
        memset(&to[k], 0, sizeof to[k]);
        to[k].range = (double)ranges[k], to[k].frame = (double)first, to[k].last = (double)(first + n_more), to[k].rate = 1.0;
        to[k].play = cdbm_plain_play(), to[k].windows[0] = to[k].windows[1] = window;
        memcpy(to[k].origin, starts + 3 * k, sizeof to[k].origin);
        to[k].target = cdbm_contact_of(clips->root + 3 * first, window.to_s * clips->rate, (size_t)n_more, put + 3 * k, starts + 3 * k);
    }
}
