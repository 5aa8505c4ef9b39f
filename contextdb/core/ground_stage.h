/* ---- The ground below feet, and hips as high as the lowest of it. On flat ground nothing changes.
 *
 * A game is asked for the ground at one point a foot: where it is, or where its clip will put it down; without any foot where
 * the body is. */

static const cdbo_column_record cdbo_ground_columns[] = {
    {CDBO_HIPS, "hips", CDBO_ONE, 2, 0.0},
    {CDBO_FOOTINGS, "footings", CDBO_EACH_FOOT, CDBO_FOOTING, 0.0},
};

static inline int cdbo_is_all_zero(const double *numbers, size_t n)
{
    size_t i;
    for (i = 0; i < n; i++)
        if (numbers[i] != 0.0) return 0;
    return 1;
}

/* Write where each foot is without a lock, moved along the way for steps that are longer or shorter. */
static inline void cdbo_free_feet(cdbo_posed *one)
{
    const cdbo_rig *rig = &one->poses->rig;
    double more = *cdbo_column(one, CDBO_STRIDE) - 1.0, x, z, size, sine, cosine;
    size_t foot;
    cdbo_velocity(one, &x, &z);
    size = cdbo_flat_length(x, z);
    if (size < 1e-6) {
        cdbo_sin_cos(one->root[2], &sine, &cosine);
        x = cosine * one->travel[0] + sine * one->travel[1], z = cosine * one->travel[1] - sine * one->travel[0];
        size = cdbo_flat_length(x, z);
    }
    for (foot = 0; foot < rig->n_feet; foot++) {
        const int64_t *leg = rig->legs + 4 * foot;
        double *to = one->free + 3 * foot;
        if (leg[3] < 0) continue;
        cdbo_set3(to, 0, cdbo_get3(one->positions, (size_t)leg[3]));
        if (more != 0.0 && size >= 1e-6) {
            double way_x = x / size, way_z = z / size, along;
            cdbo_vector hip = cdbo_get3(one->positions, (size_t)leg[0]), ankle = cdbo_get3(one->positions, (size_t)leg[2]);
            along = more * (way_x * (0.5 * (ankle.x + to[0]) - hip.x) + way_z * (0.5 * (ankle.z + to[2]) - hip.z));
            to[0] += along * way_x, to[2] += along * way_z;
        }
    }
}

/* Whether legs may have to bend and a ground is felt; if they do, the joints are placed, and the feet. */
static inline void cdbo_stand_free(cdbo_posed *one)
{
    const cdbo_rig *rig = &one->poses->rig;
    one->is_flat = one->given->gives_ground == 0.0 && cdbo_is_all_zero(cdbo_was(one, CDBO_HIPS), 2) &&
        cdbo_is_all_zero(cdbo_was(one, CDBO_FOOTINGS), CDBO_FOOTING * rig->n_feet);
    one->bends = !one->is_flat || cdbo_set(one, CDBO_FOOT_LOCK) != 0.0 || *cdbo_column(one, CDBO_STRIDE) != 1.0 ||
        !cdbo_is_all_zero(cdbo_was(one, CDBO_LOWER), 2);
    if (!one->bends) return;
    cdbo_place(rig->parents, rig->n_joints, one->translations, one->rotations, one->root, one->positions, one->world);
    cdbo_free_feet(one);
}

/* How far a foot is through its swing in the clip, and where that puts it down (left and ahead of the body); without a ground it
 * is there. */
static inline void cdbo_step(const cdbo_posed *one, size_t foot, double step[3])
{
    step[0] = one->given->gives_ground == 0.0 ? 1.0 : 0.0, step[1] = step[2] = 0.0;
    if (one->given->gives_ground != 0.0 && one->frames && one->frames->steps)
        memcpy(step, one->frames->steps + 3 * (one->frames->n_feet * one->frame + foot), 3 * sizeof(double));
}

/* Write the points at which the ground is asked for, x and z: one for each foot with a leg, and NaN for the others; without any
 * foot the first is the body's. All are NaN where no ground is felt. */
static inline void cdbo_ask_points(cdbo_posed *one, double *points)
{
    const cdbo_rig *rig = &one->poses->rig;
    double turn = *cdbo_column(one, CDBO_TURN), stride = *cdbo_column(one, CDBO_STRIDE), sine, cosine, step[3];
    size_t foot, n_points = rig->n_feet > 0 ? rig->n_feet : 1, n = 0;
    for (foot = 0; foot < 2 * n_points; foot++) points[foot] = NAN;
    if (one->is_flat) return;
    cdbo_sin_cos(one->root[2] + turn, &sine, &cosine);
    for (foot = 0; foot < rig->n_feet; foot++) {
        const double *toe = one->free + 3 * foot, *was = cdbo_was(one, CDBO_FEET) + CDBO_FOOT * foot;
        double *to = points + 2 * foot;
        if (rig->legs[4 * foot] < 0) continue;
        n++;
        if (one->contacts[foot] || cdbo_is_far(toe, was)) {
            int is_held = was[CDBO_LOCKED] != 0.0 && !cdbo_is_far(toe, was);
            to[0] = is_held ? was[CDBO_POINT] : toe[0], to[1] = is_held ? was[CDBO_POINT + 1] : toe[2];
            continue;
        }
        cdbo_step(one, foot, step);
        to[0] = one->root[0] + stride * (cosine * step[1] + sine * step[2]);
        to[1] = one->root[1] + stride * (cosine * step[2] - sine * step[1]);
    }
    if (n == 0) points[0] = one->root[0], points[1] = one->root[1];
}

/* Footings and hips some time later, with the ground at the points. */
static inline void cdbo_feel_ground(cdbo_posed *one)
{
    static const double level[3] = {0.0, 0.0, 0.0};
    const cdbo_rig *rig = &one->poses->rig;
    double *hips = cdbo_column(one, CDBO_HIPS), lowest = 0.0, height, step[3];
    size_t foot, n = 0;
    int is_new = 1;
    for (foot = 0; foot < rig->n_feet; foot++) {
        const double *here = one->below ? one->below + 3 * foot : level;
        double *footing = cdbo_column(one, CDBO_FOOTINGS) + CDBO_FOOTING * foot;
        int is_far = cdbo_is_far(one->free + 3 * foot, cdbo_was(one, CDBO_FEET) + CDBO_FOOT * foot);
        if (rig->legs[4 * foot] < 0) continue;
        is_new = is_new && is_far;
        cdbo_step(one, foot, step);
        if (is_far) {
            cdbo_new_footing(footing, here);
            height = here[0];
        } else height = cdbo_feel(footing, here, one->contacts[foot] ? -1.0 : step[0], one->dt_s);
        lowest = n++ > 0 ? cdbo_least(lowest, height) : height;
    }
    if (n == 0 && one->below) lowest = one->below[0];
    if (is_new && n > 0) hips[0] = lowest, hips[1] = 0.0;
    else cdbo_come(hips, lowest, cdbo_damping(CDBO_HIPS_HALFLIFE_S), one->dt_s);
}

static inline void cdbo_run_ground(cdbo_posed *one)
{
    cdbo_keep(one, CDBO_HIPS, 2);
    cdbo_keep(one, CDBO_FOOTINGS, CDBO_FOOTING * one->poses->rig.n_feet);
    cdbo_stand_free(one);
    if (!one->is_flat) cdbo_feel_ground(one);
}

static const cdbo_stage cdbo_ground_stage = {"ground", cdbo_ground_columns, CDBO_COUNT(cdbo_ground_columns), NULL, 0, NULL,
    cdbo_run_ground};
