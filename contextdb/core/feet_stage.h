/* ---- Feet: steps as long as the way asks for, and feet that stay where they came down.
 *
 * Lock: when what stands of a foot comes down (the toe, where it has one) its place over the ground is fixed, and its height comes
 * to that of the clip; the rest of the foot rolls about it as in the clip. It is let go when it goes up in the clip; then what lies
 * between the two decays as a spring, and it goes up with the clip's own velocity.
 *
 * On the ground a foot is let go when it would be farther from the clip's place than the radius, or would need hips that are lower
 * than legs may pull them: it is lifted and put down at its clip's place, a step. So is a foot of a body that stands, one after the
 * other, once all have stood for a while: hips come to be over them as in the clip.
 *
 * The hips go down so that legs reach, stretched no more than in the clip or than a knee of 170 degrees: the nearer a leg is to
 * that, the more of the way is theirs, so that no knee stops at once. The place of a foot is that of the toe where it has one, else
 * of the ankle. The hip and knee turn so that the foot gets there, and the foot keeps its rotation but for the slope. What a knee
 * bends more than in the clip it bends about the axis that it has on the mean of the clips, as that of a knee that is nearly
 * straight may point anywhere. A leg cannot become longer: a place out of its reach is not reached.
 *
 * Contacts are those of the clip, as those of the displayed pose would hide the worst slides.
 *
 * Source: orangeduck/Motion-Matching, contact_update and ik_two_bone; stride warping of Unreal's Animation Warping; feet and
 * hips from Forsyth, "How a Character Should Walk". */

#define CDBO_STEP_S (1.0 / 30.0) /* accelerations are those over steps of this length */
#define CDBO_LIFTED_S 0.3 /* a foot that has to be let go on the ground steps for so long, and so high */
#define CDBO_LIFTED_M 0.05
#define CDBO_REACH_M 0.08 /* legs pull hips down by no more: before, their feet step */
#define CDBO_REST_S 0.3   /* a body that has stood for so long steps with each foot that is farther off */
#define CDBO_REST_M 0.025

static const cdbo_column_record cdbo_feet_columns[] = {
    {CDBO_LOWER, "lower", CDBO_ONE, 2, 0.0},
    {CDBO_FEET, "feet", CDBO_EACH_FOOT, CDBO_FOOT, 0.0},
};
static const cdbo_setting_record cdbo_feet_settings[] = {
    {CDBO_FOOT_LOCK, "foot_lock", CDBO_AS_IT_IS},
    {CDBO_FOOT_HALFLIFE, "foot_halflife_s", CDBO_DAMPING},
    {CDBO_FOOT_RADIUS, "foot_radius_m", CDBO_AS_IT_IS},
};

/* Write a foot whose offset is written already: displayed so far from a place. */
static inline void cdbo_show_foot(double *to, cdbo_vector place, cdbo_vector toe)
{
    double sine, cosine;
    to[CDBO_SEEN] = 1.0;
    cdbo_set3(to + CDBO_FREE, 0, toe);
    cdbo_sin_cos(CDBO_PI * to[CDBO_LIFTED] / CDBO_LIFTED_S, &sine, &cosine);
    place.y += CDBO_LIFTED_M * sine * sine;
    cdbo_set3(to + CDBO_DISPLAYED, 0, cdbo_add(place, cdbo_get3(to + CDBO_FOOT_OFFSET, 0)));
}

static inline void cdbo_lock(double *to, double x, double z, double height, cdbo_vector toe)
{
    to[CDBO_DOWN] = to[CDBO_LOCKED] = 1.0, to[CDBO_POINT] = x, to[CDBO_POINT + 1] = z;
    cdbo_show_foot(to, cdbo_xyz(x, height, z), toe);
}

static inline void cdbo_free(double *to, int is_down, cdbo_vector toe)
{
    to[CDBO_DOWN] = is_down ? 1.0 : 0.0, to[CDBO_LOCKED] = to[CDBO_POINT] = to[CDBO_POINT + 1] = to[CDBO_STOOD] = 0.0;
    cdbo_show_foot(to, toe, toe);
}

/* Lock a foot at a place, where it comes to rest: at once, but for what it is too fast to lose in a step as joints lose it in
 * the clips. */
static inline void cdbo_stop(const double *was, double x, double z, double height, cdbo_vector toe, double y, double most_accel,
    double dt_s, double *to)
{
    double *offset = to + CDBO_FOOT_OFFSET, *speed = to + CDBO_FOOT_SPEED;
    double left = x - was[CDBO_DISPLAYED], ahead = z - was[CDBO_DISPLAYED + 2], way = cdbo_flat_length(left, ahead);
    double over = dt_s > 0.0 ? way / dt_s - CDBO_STEP_S * most_accel : 0.0;
    offset[0] = offset[2] = speed[0] = speed[1] = speed[2] = 0.0;
    if (over > 0.0) {
        over *= y * CDBO_STEP_S / (1.0 - cdbo_exp(-y * CDBO_STEP_S)) / way;
        speed[0] = over * left, speed[2] = over * ahead;
        offset[0] = -over * left / y, offset[2] = -over * ahead / y;
        x += over * left / y, z += over * ahead / y;
    }
    cdbo_lock(to, x, z, height, toe);
}

/* Where a locked foot would be displayed after an update. */
static inline cdbo_vector cdbo_locked_place(const double *was, double height, double y, double dt_s, double *to)
{
    cdbo_decay(3, was + CDBO_FOOT_OFFSET, was + CDBO_FOOT_SPEED, y, dt_s, to + CDBO_FOOT_OFFSET, to + CDBO_FOOT_SPEED);
    return cdbo_add(cdbo_xyz(was[CDBO_POINT], height, was[CDBO_POINT + 1]), cdbo_get3(to + CDBO_FOOT_OFFSET, 0));
}

/* Write the foot after this update, whose toe is at a place without a lock and has a height in the clip. */
static inline void cdbo_move_foot(const double *was, cdbo_vector toe, double height, int is_down, int must_go, double y,
    double most_accel, double dt_s, double *to)
{
    double *offset = to + CDBO_FOOT_OFFSET, *speed = to + CDBO_FOOT_SPEED;
    cdbo_vector moved = cdbo_from(cdbo_get3(was + CDBO_FREE, 0), toe), apart;
    size_t i;
    memset(to, 0, CDBO_FOOT * sizeof(double));
    if (was[CDBO_SEEN] == 0.0 || cdbo_length(moved) > CDBO_FAR_M) {
        if (!is_down) {
            cdbo_free(to, 0, toe);
            return;
        }
        offset[1] = toe.y - height;
        cdbo_lock(to, toe.x, toe.z, height, toe);
        return;
    }
    to[CDBO_LIFTED] = cdbo_most(was[CDBO_LIFTED] - dt_s, 0.0);
    if (was[CDBO_LOCKED] != 0.0 && !is_down) {
        for (i = 0; i < 3; i++) offset[i] = was[CDBO_DISPLAYED + i] - was[CDBO_FREE + i];
        cdbo_decay(3, offset, speed, y, dt_s, offset, speed);
        cdbo_free(to, 0, toe);
        return;
    }
    if (was[CDBO_LOCKED] != 0.0) {
        apart = cdbo_locked_place(was, height, y, dt_s, to);
        to[CDBO_STOOD] = was[CDBO_STOOD] + dt_s;
        if (!must_go) {
            cdbo_lock(to, was[CDBO_POINT], was[CDBO_POINT + 1], height, toe);
            return;
        }
        cdbo_set3(offset, 0, cdbo_from(toe, apart));
        if (dt_s > 0.0) speed[0] -= moved.x / dt_s, speed[1] -= moved.y / dt_s, speed[2] -= moved.z / dt_s;
        to[CDBO_LIFTED] = CDBO_LIFTED_S;
        cdbo_free(to, 1, toe);
        return;
    }
    cdbo_decay(3, was + CDBO_FOOT_OFFSET, was + CDBO_FOOT_SPEED, y, dt_s, offset, speed);
    if (is_down && to[CDBO_LIFTED] == 0.0) {
        offset[1] = toe.y + offset[1] - height;
        cdbo_stop(was, toe.x + offset[0], toe.z + offset[2], height, toe, y, most_accel, dt_s, to);
        return;
    }
    cdbo_free(to, is_down, toe);
}

/* How far over the ground a locked foot is from where it is without a lock. */
static inline double cdbo_foot_apart(const cdbo_posed *one, size_t foot)
{
    const double *was = cdbo_was(one, CDBO_FEET) + CDBO_FOOT * foot, *toe = one->free + 3 * foot;
    return cdbo_flat_length(was[CDBO_POINT] - toe[0], was[CDBO_POINT + 1] - toe[2]);
}

/* The foot that steps to where its clip has it, as the body stands: the farthest, once all have stood for a while; none is -1. */
static inline int64_t cdbo_restless_foot(const cdbo_posed *one)
{
    const cdbo_rig *rig = &one->poses->rig;
    double x, z, farthest = CDBO_REST_M;
    int64_t foot, restless = -1;
    cdbo_velocity(one, &x, &z);
    if (cdbo_flat_length(x, z) >= CDBO_LEAST_MPS || cdbo_flat_length(one->travel[0], one->travel[1]) >= CDBO_LEAST_MPS) return -1;
    for (foot = 0; foot < (int64_t)rig->n_feet; foot++) {
        const double *was = cdbo_was(one, CDBO_FEET) + CDBO_FOOT * foot;
        double apart = cdbo_foot_apart(one, (size_t)foot);
        if (rig->legs[4 * foot] < 0) continue;
        if (was[CDBO_LOCKED] == 0.0 || was[CDBO_STOOD] < CDBO_REST_S) return -1;
        if (apart > farthest) farthest = apart, restless = foot;
    }
    return restless;
}

/* Move each foot on; gives by how much the hips are too high for them. */
static inline double cdbo_move_feet(cdbo_posed *one)
{
    const cdbo_rig *rig = &one->poses->rig;
    const double *footing = cdbo_column(one, CDBO_FOOTINGS);
    double raised = *cdbo_column(one, CDBO_HIPS), most = 0.0, y = cdbo_set(one, CDBO_FOOT_HALFLIFE);
    int64_t restless = cdbo_restless_foot(one);
    size_t foot;
    for (foot = 0; foot < rig->n_feet; foot++, footing += CDBO_FOOTING) {
        const int64_t *leg = rig->legs + 4 * foot;
        const double *was = cdbo_was(one, CDBO_FEET) + CDBO_FOOT * foot;
        double *to = cdbo_column(one, CDBO_FEET) + CDBO_FOOT * foot, down;
        cdbo_vector toe = cdbo_get3(one->free, foot);
        if (leg[3] < 0) continue;
        toe.y += footing[0];
        if (cdbo_set(one, CDBO_FOOT_LOCK) != 0.0) {
            double height = footing[0] + cdbo_height(rig, cdbo_column(one, CDBO_POSITIONS), cdbo_column(one, CDBO_ROTATIONS), leg[3]);
            int must_go = (int64_t)foot == restless || cdbo_foot_apart(one, foot) > cdbo_set(one, CDBO_FOOT_RADIUS);
            if (!must_go && was[CDBO_LOCKED] != 0.0) {
                down = cdbo_too_high(one->positions, leg, cdbo_locked_place(was, height, y, one->dt_s, to), footing[1], footing[2], raised);
                must_go = down > CDBO_REACH_M;
            }
            cdbo_move_foot(was, toe, height, one->contacts[foot], must_go, y, rig->most_accel, one->dt_s, to);
        } else {
            memset(to, 0, CDBO_FOOT * sizeof(double));
            cdbo_free(to, 0, toe);
        }
        down = cdbo_too_high(one->positions, leg, cdbo_get3(to + CDBO_DISPLAYED, 0), footing[1], footing[2], raised);
        most = cdbo_most(most, cdbo_least(down, to[CDBO_LOCKED] != 0.0 ? CDBO_MOST_LOWER_M : CDBO_REACH_M));
    }
    return most;
}

/* Bend each leg whose foot is not where it should be, or on a ground that is not level. */
static inline void cdbo_bend_legs(cdbo_posed *one)
{
    const cdbo_rig *rig = &one->poses->rig;
    const double *footing = cdbo_column(one, CDBO_FOOTINGS);
    size_t foot;
    for (foot = 0; foot < rig->n_feet; foot++, footing += CDBO_FOOTING) {
        const int64_t *leg = rig->legs + 4 * foot;
        cdbo_vector place = cdbo_get3(cdbo_column(one, CDBO_FEET) + CDBO_FOOT * foot + CDBO_DISPLAYED, 0), toe;
        if (leg[3] < 0) continue;
        toe = cdbo_get3(one->positions, (size_t)leg[3]);
        if (place.x != toe.x || place.y != toe.y || place.z != toe.z || !cdbo_is_all_zero(footing, 3))
            cdbo_stand_leg(rig->parents, one->positions, one->world, leg, rig->hinges + 3 * foot, place, footing[1], footing[2],
                one->rotations);
    }
}

static inline void cdbo_run_feet(cdbo_posed *one)
{
    const cdbo_rig *rig = &one->poses->rig;
    double *lower = cdbo_column(one, CDBO_LOWER), height;
    size_t i;
    cdbo_keep(one, CDBO_LOWER, 2);
    cdbo_keep(one, CDBO_FEET, CDBO_FOOT * rig->n_feet);
    if (!one->bends) return;
    cdbo_lower(lower, cdbo_move_feet(one), one->dt_s);
    height = *cdbo_column(one, CDBO_HIPS) - lower[0];
    if (height != 0.0) {
        for (i = 0; i < rig->n_tops; i++) one->translations[3 * rig->tops[i] + 1] += height;
        for (i = 0; i < rig->n_joints; i++) one->positions[3 * i + 1] += height;
    }
    cdbo_bend_legs(one);
}

static const cdbo_stage cdbo_feet_stage = {"feet", cdbo_feet_columns, CDBO_COUNT(cdbo_feet_columns), cdbo_feet_settings,
    CDBO_COUNT(cdbo_feet_settings), NULL, cdbo_run_feet};
