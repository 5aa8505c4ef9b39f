/* ---- Inertialization: where what plays jumps, the difference to what was displayed stays as an offset, and decays.
 *
 * Only the animation that plays is sampled. At a seam the offset is chosen so that the pose and its velocity are what they were; a
 * seam within a decay takes what is left of it along. The offset is a turn of each joint in its parent's frame and a shift of each
 * joint with a position of its own, and both decay as critically damped springs of one half-life.
 *
 * Source: D. Bollo, "Inertialization", GDC 2018; D. Holden, "Spring-It-On", 2021; orangeduck/Motion-Matching, controller.cpp. */

#define CDBO_FADED 6.638352 /* a critically damped spring has a hundredth left when damping x time is so much */

static const cdbo_column_record cdbo_spring_columns[] = {
    {CDBO_FADE, "fade", CDBO_ONE, 1, 0.0},
    {CDBO_TURNS, "turns", CDBO_EACH_JOINT, 3, 0.0},
    {CDBO_SPINS, "spins", CDBO_EACH_JOINT, 3, 0.0},
    {CDBO_SHIFTS, "shifts", CDBO_EACH_MOVING, 3, 0.0},
    {CDBO_SPEEDS, "speeds", CDBO_EACH_MOVING, 3, 0.0},
};
static const cdbo_setting_record cdbo_spring_settings[] = {
    {CDBO_BLEND, "blend", CDBO_AS_IT_IS},
    {CDBO_HALFLIFE, "halflife_s", CDBO_DAMPING},
};

/* How many numbers two poses at a seam are: rotations and spins of J joints, positions and speeds of M. */
static inline size_t cdbo_seam_room(const cdbo_rig *rig)
{
    return 2 * (7 * rig->n_joints + 6 * rig->n_moving);
}

typedef struct cdbo_moment {
    double *rotations, *spins, *positions, *speeds;
} cdbo_moment;

/* A moment at a seam. One behind the end of its clip goes on as the clip did there, unless it stands: what runs out within an
 * update does not stop for the rest of it. */
static inline cdbo_moment cdbo_moment_at(const cdbo_posed *one, size_t which)
{
    const cdbo_rig *rig = &one->poses->rig;
    const cdbo_seam *seam = one->seams + which;
    const cdbo_frames *frames = one->poses->banks[(size_t)seam->bank];
    size_t range = (size_t)seam->range, n_turns = 3 * rig->n_joints, n_shifts = 3 * rig->n_moving, i;
    cdbo_between at = cdbo_frames_at(frames, range, seam->at_s);
    double past = 0.0;
    cdbo_moment made;
    made.rotations = one->seam_poses + which * (cdbo_seam_room(rig) / 2);
    made.spins = made.rotations + 4 * rig->n_joints;
    made.positions = made.spins + n_turns;
    made.speeds = made.positions + n_shifts;
    cdbo_sample(frames, at, made.rotations, made.positions);
    cdbo_slopes(frames, at, made.spins, made.speeds);
    if (!frames->looping[range] && seam->rate != 0.0) past = seam->at_s - (double)frames->n_steps[range] / frames->rate;
    if (past > 0.0) {
        for (i = 0; i < rig->n_joints; i++)
            cdbo_set4(made.rotations, i,
                cdbo_then(cdbo_rotation(cdbo_times(past, cdbo_get3(made.spins, i))), cdbo_get4(made.rotations, i)));
        for (i = 0; i < n_shifts; i++) made.positions[i] += past * made.speeds[i];
    }
    for (i = 0; i < n_turns; i++) made.spins[i] *= seam->rate;
    for (i = 0; i < n_shifts; i++) made.speeds[i] *= seam->rate;
    return made;
}

/* The offset of a joint that keeps the displayed rotation and its spin, where another animation begins to play under it. */
static inline void cdbo_leave(cdbo_moment left, cdbo_moment entered, size_t j, double *turns, double *spins)
{
    cdbo_vector turn = cdbo_get3(turns, j), own = cdbo_spin_of(turn, cdbo_get3(spins, j));
    cdbo_quaternion offset = cdbo_rotation(turn);
    cdbo_vector carried = cdbo_rotated(offset, cdbo_get3(left.spins, j)), under, remaining;
    cdbo_quaternion rest = cdbo_then(cdbo_then(offset, cdbo_get4(left.rotations, j)), cdbo_back(cdbo_get4(entered.rotations, j)));
    remaining = cdbo_turn(rest);
    under = cdbo_rotated(rest, cdbo_get3(entered.spins, j));
    cdbo_set3(turns, j, remaining);
    cdbo_set3(spins, j, cdbo_speed_of(remaining, cdbo_from(under, cdbo_add(own, carried))));
}

/* The damping until now; and from now on, which a seam may change: that of the row that is entered, or else of the settings. */
static inline double cdbo_fade(const cdbo_posed *one)
{
    double fade = *cdbo_was(one, CDBO_FADE);
    return fade > 0.0 ? fade : cdbo_set(one, CDBO_HALFLIFE);
}

static inline void cdbo_set_fade(cdbo_posed *one)
{
    double blend_s = one->given->blend_s;
    cdbo_keep(one, CDBO_FADE, 1);
    if (one->seams) *cdbo_column(one, CDBO_FADE) = blend_s > 0.0 ? CDBO_FADED / blend_s : 0.0;
}

/* Whether what plays is entered by a cut. */
static inline int cdbo_is_cut(const cdbo_posed *one)
{
    return one->seams && one->given->blend_s == 0.0;
}

static inline void cdbo_run_spring(cdbo_posed *one)
{
    const cdbo_rig *rig = &one->poses->rig;
    double *turns = cdbo_column(one, CDBO_TURNS), *spins = cdbo_column(one, CDBO_SPINS);
    double *shifts = cdbo_column(one, CDBO_SHIFTS), *speeds = cdbo_column(one, CDBO_SPEEDS), y = cdbo_fade(one);
    size_t j, i;
    cdbo_set_fade(one);
    cdbo_decay(3 * rig->n_joints, cdbo_was(one, CDBO_TURNS), cdbo_was(one, CDBO_SPINS), y, one->dt_s, turns, spins);
    cdbo_decay(3 * rig->n_moving, cdbo_was(one, CDBO_SHIFTS), cdbo_was(one, CDBO_SPEEDS), y, one->dt_s, shifts, speeds);
    if (cdbo_is_cut(one)) {
        memset(turns, 0, 3 * rig->n_joints * sizeof(double)), memset(spins, 0, 3 * rig->n_joints * sizeof(double));
        memset(shifts, 0, 3 * rig->n_moving * sizeof(double)), memset(speeds, 0, 3 * rig->n_moving * sizeof(double));
    } else if (one->seams) {
        cdbo_moment left = cdbo_moment_at(one, 0), entered = cdbo_moment_at(one, 1);
        for (j = 0; j < rig->n_joints; j++) cdbo_leave(left, entered, j, turns, spins);
        for (i = 0; i < 3 * rig->n_moving; i++) {
            shifts[i] = shifts[i] + left.positions[i] - entered.positions[i];
            speeds[i] = speeds[i] + left.speeds[i] - entered.speeds[i];
        }
    }
    for (j = 0; j < rig->n_joints; j++)
        cdbo_set4(one->rotations, j, cdbo_then(cdbo_rotation(cdbo_get3(turns, j)), cdbo_get4(one->rotations, j)));
    for (j = 0; j < rig->n_joints; j++)
        if (rig->places[j] >= 0)
            cdbo_set3(one->translations, j, cdbo_add(cdbo_get3(one->translations, j), cdbo_get3(shifts, (size_t)rig->places[j])));
}

static inline int cdbo_is_spring_on(const double *settings)
{
    return settings[CDBO_BLEND] == CDBO_BY_SPRING;
}

static const cdbo_stage cdbo_spring_stage = {"spring", cdbo_spring_columns, CDBO_COUNT(cdbo_spring_columns), cdbo_spring_settings,
    CDBO_COUNT(cdbo_spring_settings), cdbo_is_spring_on, cdbo_run_spring};
