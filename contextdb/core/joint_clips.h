/* ---- Clips of several characters in a bundle: a joint database is a database of which some ranges belong together. See joint.h and
 * contextdb/motion/joint/database.py.
 *
 * J joint ranges, K roles, B joint boxes, P ordered pairs of roles; R ranges and K' kinds of the database itself. */

typedef struct cdbm_joint_clips {
    cdbm_joint joint;               /* without roles where the database is none of several */
    const int64_t *role_ranges;     /* [J, K] the range of each role */
    const double *warps;            /* [R, 2, 2] */
    const double *range_biases, *kind_biases; /* [R], [K'] */
    const uint8_t *allowed;         /* [K'] */
    cdbm_table_ranges rows;         /* of the J ranges, where the database has a table */
} cdbm_joint_clips;

/* Which rows of a table name some ranges, by three parts from a kind on. */
static inline void cdbm_read_rows_of(cdbm_bundle *bundle, size_t number, const uint32_t *kinds, size_t n_ranges, size_t n_table_rows, cdbm_table_ranges *of)
{
    size_t n_rows = 0, i;
    memset(of, 0, sizeof *of);
    of->n_ranges = n_ranges;
    of->mirrored = CDBM_TAKE(uint8_t, kinds[0], n_ranges);
    of->starts = CDBM_TAKE(int64_t, kinds[1], n_ranges + 1), of->rows = CDBM_TAKE_ALL(int64_t, kinds[2], &n_rows);
    if (bundle->why) return;
    if (of->starts[0] != 0 || (uint64_t)of->starts[n_ranges] != n_rows) cdbm_refuse(bundle, "the rows of a table do not go together");
    for (i = 0; i < n_ranges; i++)
        if (of->starts[i] > of->starts[i + 1] || of->starts[i] < 0 || of->mirrored[i] > 1)
            cdbm_refuse(bundle, "the rows of a table do not go together");
    for (i = 0; i < n_rows; i++)
        if (of->rows[i] < 0 || (uint64_t)of->rows[i] >= n_table_rows) cdbm_refuse(bundle, "a row of a table is not there");
}

/* Whether the ranges of the roles are there and as long as each other, and each box is the same frames of each role's range. */
static inline int cdbm_are_roles(const cdbm_clips *clips, const cdbm_joint_clips *of)
{
    const cdbm_joint *joint = &of->joint;
    const cdbm_frames *frames = clips->frames;
    size_t n = joint->n_roles, i, k;
    if (!cdbm_are_below(of->role_ranges, joint->n_ranges * n, clips->n_ranges) || !cdbm_is_joint_whole(joint)) return 0;
    for (i = 0; i < joint->n_ranges; i++)
        for (k = 1; k < n; k++) {
            size_t one = (size_t)of->role_ranges[i * n], other = (size_t)of->role_ranges[i * n + k];
            if (clips->stops[one] - clips->starts[one] != clips->stops[other] - clips->starts[other]) return 0;
        }
    for (i = 0; i < joint->n_boxes; i++)
        for (k = 0; k < n; k++) {
            size_t own = (size_t)joint->boxes[i * n + k], first = (size_t)joint->boxes[i * n], range = (size_t)of->role_ranges[(size_t)joint->ranges[i] * n + k];
            size_t first_range = (size_t)of->role_ranges[(size_t)joint->ranges[i] * n];
            if ((size_t)frames->box_ranges[own] != range || frames->box_sizes[own] != frames->box_sizes[first]) return 0;
            if (frames->box_starts[own] - clips->starts[range] != frames->box_starts[first] - clips->starts[first_range]) return 0;
        }
    return 1;
}

/* Read what makes a database that was read a joint one; nothing where it is none. */
static inline void cdbm_read_joint(cdbm_bundle *bundle, size_t number, const cdbm_clips *clips, size_t n_table_rows, cdbm_joint_clips *of)
{
    static const uint32_t rows[] = {CDBM_P_JOINT_MIRRORED, CDBM_P_JOINT_ROW_STARTS, CDBM_P_JOINT_ROWS};
    const cdbm_frames *frames = clips->frames;
    cdbm_joint *joint = &of->joint;
    size_t n, n_roles = 0, n_seen, i;
    const char *roles = (const char *)cdbm_find(bundle, CDBM_P_ROLES, number, 1, &n);
    memset(of, 0, sizeof *of);
    if (bundle->why || !roles) return;
    for (i = 0; i < n; i++) n_roles += roles[i] == 0;
    if (n_roles < 2 || n_roles > CDB_MOST_ROLES || roles[n - 1] != 0) cdbm_refuse(bundle, "a joint clip has too few roles, or too many");
    if (!clips->root) cdbm_refuse(bundle, "a database of joint clips does not say where they go");
    of->role_ranges = CDBM_TAKE_ALL(int64_t, CDBM_P_ROLE_RANGES, &n);
    joint->ranges = CDBM_TAKE_ALL(int64_t, CDBM_P_JOINT_RANGES, &joint->n_boxes);
    if (bundle->why) return;
    joint->n_roles = n_roles, joint->n_pairs = n_roles * (n_roles - 1), joint->n_ranges = n / n_roles;
    joint->n_features = frames->n_features, joint->n_channels = frames->n_channels, joint->n_own = frames->n_boxes;
    joint->blocks = frames->blocks, joint->rank = frames->rank, joint->channels = frames->channels;
    n = joint->n_boxes, n_seen = joint->n_pairs * 4;
    joint->boxes = CDBM_TAKE(int64_t, CDBM_P_JOINT_BOXES, n * n_roles), joint->firsts = CDBM_TAKE(int64_t, CDBM_P_JOINT_FIRSTS, n);
    joint->lows = CDBM_TAKE(float, CDBM_P_JOINT_LOWS, n_roles * joint->n_features * n);
    joint->highs = CDBM_TAKE(float, CDBM_P_JOINT_HIGHS, n_roles * joint->n_features * n);
    joint->relative = CDBM_TAKE(float, CDBM_P_SEEN, n * n_seen * CDBM_FRAMES);
    joint->relative_lows = CDBM_TAKE(float, CDBM_P_SEEN_LOWS, n_seen * n), joint->relative_highs = CDBM_TAKE(float, CDBM_P_SEEN_HIGHS, n_seen * n);
    joint->pairs = CDBM_TAKE(int64_t, CDBM_P_PAIRS, 2 * joint->n_pairs), joint->weights = CDBM_TAKE(double, CDBM_P_JOINT_WEIGHTS, joint->n_channels);
    joint->relative_weights = CDBM_TAKE(double, CDBM_P_SEEN_WEIGHTS, 2);
    of->range_biases = CDBM_TAKE(double, CDBM_P_JOINT_BIASES, clips->n_ranges);
    of->kind_biases = CDBM_TAKE(double, CDBM_P_JOINT_KIND_BIASES, clips->n_kinds), of->allowed = CDBM_TAKE(uint8_t, CDBM_P_JOINT_ALLOWED, clips->n_kinds);
    of->warps = CDBM_TAKE(double, CDBM_P_JOINT_WARPS, 4 * clips->n_ranges);
    if (n_table_rows > 0) cdbm_read_rows_of(bundle, number, rows, joint->n_ranges, n_table_rows, &of->rows);
    else of->rows.mirrored = CDBM_TAKE(uint8_t, CDBM_P_JOINT_MIRRORED, joint->n_ranges);
    if (!bundle->why && !cdbm_are_roles(clips, of)) cdbm_refuse(bundle, "the clips of several characters do not go together");
}
