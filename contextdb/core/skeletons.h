/* ---- A rig, and forward kinematics: each joint placed in the world, its parent before it. */

typedef struct cdbo_rig {
    size_t n_joints, n_moving, n_feet, n_tops, n_spine;
    const int64_t *parents;   /* [J]: of each joint one before it, -1 for none */
    const double *offsets;    /* [J, 3]: of each joint from its parent where it has no position of its own */
    const int64_t *places;    /* [J]: which row of positions [M, 3] is each joint's, -1 where it keeps its offset */
    const int64_t *legs;      /* [F, 4]: hip, knee, ankle and what stands, all -1 for a foot without a leg */
    const double *hinges;     /* [F, 3]: the axis that each knee bends about, against its hip */
    const int64_t *tops;      /* the joints that hang on the root */
    const int64_t *spine;     /* the joints from the hips to the chest; none of a rig that is not aligned */
    const double *left;       /* after each of them, the share of the turn that is left */
    double most_accel;        /* what joints may be accelerated by over what the clips do, m/s2 */
} cdbo_rig;

/* Whether some joints are of so many. */
static inline int cdbo_are_joints(const int64_t *joints, size_t n, size_t n_joints)
{
    size_t i;
    for (i = 0; i < n; i++)
        if (joints[i] < 0 || (uint64_t)joints[i] >= n_joints) return 0;
    return 1;
}

/* Whether each joint comes behind its parent. */
static inline int cdbo_are_parents(const int64_t *parents, size_t n_joints)
{
    size_t j;
    for (j = 0; j < n_joints; j++)
        if (parents[j] < -1 || parents[j] >= (int64_t)j) return 0;
    return 1;
}

/* Whether each foot has no leg, or one of joints that are there, whose hip has a parent. */
static inline int cdbo_are_legs(const int64_t *legs, size_t n_feet, const int64_t *parents, size_t n_joints)
{
    size_t foot;
    for (foot = 0; foot < n_feet; foot++) {
        const int64_t *leg = legs + 4 * foot;
        if (leg[0] == -1 && leg[1] == -1 && leg[2] == -1 && leg[3] == -1) continue;
        if (!cdbo_are_joints(leg, 4, n_joints) || parents[leg[0]] < 0) return 0;
    }
    return 1;
}

/* Whether a rig's joints are all its own. */
static inline int cdbo_is_rig(const cdbo_rig *rig)
{
    size_t j;
    for (j = 0; j < rig->n_joints; j++)
        if (rig->places[j] < -1 || rig->places[j] >= (int64_t)rig->n_moving) return 0;
    return rig->n_joints > 0 && cdbo_are_parents(rig->parents, rig->n_joints)
        && cdbo_are_legs(rig->legs, rig->n_feet, rig->parents, rig->n_joints)
        && cdbo_are_joints(rig->tops, rig->n_tops, rig->n_joints) && cdbo_are_joints(rig->spine, rig->n_spine, rig->n_joints);
}

/* Place a pose whose first joint is against the root (x, z, heading): joints and their rotations in the world, [J, 3] and [J,
 * 4]. */
static inline void cdbo_place(const int64_t *parents, size_t n_joints, const double *translations, const double *rotations,
    const double *root, double *positions, double *world)
{
    cdbo_quaternion facing = cdbo_heading(root[2]);
    size_t j;
    for (j = 0; j < n_joints; j++) {
        cdbo_quaternion above = parents[j] < 0 ? facing : cdbo_get4(world, (size_t)parents[j]);
        cdbo_vector start = parents[j] < 0 ? cdbo_xyz(root[0], 0.0, root[1]) : cdbo_get3(positions, (size_t)parents[j]);
        cdbo_set3(positions, j, cdbo_add(start, cdbo_rotated(above, cdbo_get3(translations, j))));
        cdbo_set4(world, j, cdbo_then(above, cdbo_get4(rotations, j)));
    }
}

/* Where a joint of a pose is against its parent, of positions [M, 3]. */
static inline cdbo_vector cdbo_translation(const cdbo_rig *rig, const double *positions, size_t joint)
{
    return rig->places[joint] < 0 ? cdbo_get3(rig->offsets, joint) : cdbo_get3(positions, (size_t)rig->places[joint]);
}

/* How high a joint of a pose is over the root. */
static inline double cdbo_height(const cdbo_rig *rig, const double *positions, const double *rotations, int64_t joint)
{
    cdbo_vector place = cdbo_xyz(0.0, 0.0, 0.0);
    while (joint >= 0) {
        place = cdbo_add(place, cdbo_translation(rig, positions, (size_t)joint));
        joint = rig->parents[joint];
        if (joint >= 0) place = cdbo_rotated(cdbo_get4(rotations, (size_t)joint), place);
    }
    return place.y;
}

/* ---- how much joints accelerate in clips */

/* The acceleration of the joint that accelerates most, of three moments. */
static inline double cdbo_sharpest(const double *before, const double *now, const double *after, size_t n_joints, double dt_s)
{
    double most = 0.0;
    size_t j;
    for (j = 0; j < n_joints; j++) {
        cdbo_vector a = cdbo_from(cdbo_get3(now, j), cdbo_get3(after, j)), b = cdbo_from(cdbo_get3(before, j), cdbo_get3(now, j));
        cdbo_vector change = cdbo_from(b, a);
        most = cdbo_most(most, cdbo_dot(change, change));
    }
    return sqrt(most) / (dt_s * dt_s);
}

static inline size_t cdbo_acceleration_room(const cdbo_frames *of, size_t range)
{
    return 3 * of->n_joints * ((size_t)of->n_steps[range] + 1) + 14 * of->n_joints;
}

/* Write how much the joint that accelerates most does so in each frame of a range, over steps of some frames: [n_steps + 1 - 2
 * step]. */
static inline void cdbo_accelerations(const cdbo_frames *of, size_t range, const cdbo_rig *rig, size_t step, double *room,
    double *to)
{
    size_t n = (size_t)of->n_steps[range] + 1, n_joints = of->n_joints, i, j;
    double *placed = room, *turns = room + 3 * n_joints * n, *world = turns + 4 * n_joints, *moved = world + 4 * n_joints;
    double *positions = moved + 3 * n_joints, root[3];
    for (i = 0; i < n; i++) {
        size_t frame = (size_t)of->starts[range] + i;
        for (j = 0; j < 4 * n_joints; j++) turns[j] = (double)of->rotations[4 * n_joints * frame + j];
        for (j = 0; j < 3 * of->n_moving; j++) positions[j] = (double)of->positions[3 * of->n_moving * frame + j];
        for (j = 0; j < n_joints; j++) cdbo_set3(moved, j, cdbo_translation(rig, positions, j));
        cdbo_set3(root, 0, cdbo_float3(of->root, frame));
        cdbo_place(rig->parents, n_joints, moved, turns, root, placed + 3 * n_joints * i, world);
    }
    for (i = 0; i + 2 * step < n; i++)
        to[i] = cdbo_sharpest(placed + 3 * n_joints * i, placed + 3 * n_joints * (i + step), placed + 3 * n_joints * (i + 2 * step),
            n_joints, (double)step / of->rate);
}
