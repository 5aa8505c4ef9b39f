/* ---- Path alignment: a body whose clip goes another way than the game wants turns its hips and legs to that way, and keeps its
 * chest.
 *
 *     turn     the angle from where the clip goes to where the game goes, at most the limit; none beyond 90 degrees
 *     hips     turned by it; each joint of the spine turns a part of it back, so that the chest faces as it did
 *     root     what the clip moves it goes the new way too, see root_stage.h
 *
 * Without it feet slide by 2 v sin(turn / 2). The turn comes to its angle as a critically damped spring does, without a step in its
 * speed. Where the clip goes is a mean over a second, for a body sways with each step.
 *
 * The same stage says how much longer or shorter the steps are to be: the game's speed over the clip's, within limits, as far as
 * the play rate has not made up for it. The feet bend the legs to that.
 *
 * Source: orientation and stride warping of Unreal's Animation Warping; the alignment of strafes in Remedy's talk. */

#define CDBO_LEAST_MPS 0.2 /* what goes slower goes nowhere: neither turn nor stride are wanted of it */

static const cdbo_column_record cdbo_alignment_columns[] = {
    {CDBO_TURN, "turn", CDBO_ONE, 2, 0.0},
    {CDBO_STRIDE, "stride", CDBO_ONE, 2, 1.0},
};
static const cdbo_setting_record cdbo_alignment_settings[] = {
    {CDBO_PATH_ALIGNMENT, "path_alignment", CDBO_AS_IT_IS},
    {CDBO_ALIGNMENT_LIMIT, "alignment_limit_deg", CDBO_RADIANS},
    {CDBO_ALIGNMENT_HALFLIFE, "alignment_halflife_s", CDBO_DAMPING},
    {CDBO_MIN_STRIDE, "min_stride", CDBO_AS_IT_IS},
    {CDBO_MAX_STRIDE, "max_stride", CDBO_AS_IT_IS},
};

/* The turn and the stride that the game's velocity asks for; 0 and 1 where the clip stands. Where the game's body stands and the clip
 * does not, as none that stands is valid, steps become steps on the spot: hips stay over the feet. */
static inline void cdbo_warp_goal(const cdbo_posed *one, double *turn, double *stride)
{
    double left = one->given->rate * one->travel[0], ahead = one->given->rate * one->travel[1], own, game, x, z, limit, angle, least;
    double sway = one->travel[2] * cdbo_rotation_share(one);
    *turn = 0.0, *stride = 1.0;
    if (one->mode == CDBO_BY_ANIMATION) return;
    cdbo_velocity(one, &x, &z);
    own = cdbo_flat_length(left, ahead), game = cdbo_flat_length(x, z);
    if (own < CDBO_LEAST_MPS || *cdbo_column(one, CDBO_HAS_VELOCITY) == 0.0) return;
    if (game >= CDBO_LEAST_MPS) {
        angle = cdbo_remainder(cdbo_atan2(x, z) - (one->root[2] - sway) - cdbo_atan2(left, ahead));
        if (cdbo_size(angle) > 0.5 * CDBO_PI) return;
        limit = cdbo_set(one, CDBO_PATH_ALIGNMENT) != 0.0 ? cdbo_set(one, CDBO_ALIGNMENT_LIMIT) : 0.0;
        *turn = cdbo_within(angle, -limit, limit);
    }
    if (one->mode == CDBO_BY_PATH) return;
    least = cdbo_set(one, CDBO_MIN_STRIDE);
    if (least < 1.0) least *= cdbo_least(game / CDBO_LEAST_MPS, 1.0);
    *stride = cdbo_within(game / own, least, cdbo_set(one, CDBO_MAX_STRIDE));
}

/* Turn the joints that hang on the root about the vertical, and joint by joint of the spine, which hang on each other, a part of
 * it back. */
static inline void cdbo_turn_hips(const cdbo_rig *rig, double turn, double *rotations, double *translations)
{
    cdbo_quaternion whole = cdbo_heading(turn), above = cdbo_wxyz(1.0, 0.0, 0.0, 0.0), under;
    int64_t joint;
    size_t k;
    for (joint = rig->parents[rig->spine[0]]; joint >= 0; joint = rig->parents[joint])
        above = cdbo_then(cdbo_get4(rotations, (size_t)joint), above);
    for (k = 0; k < rig->n_tops; k++) {
        size_t top = (size_t)rig->tops[k];
        cdbo_set4(rotations, top, cdbo_then(whole, cdbo_get4(rotations, top)));
        cdbo_set3(translations, top, cdbo_rotated(whole, cdbo_get3(translations, top)));
    }
    under = cdbo_then(whole, above);
    for (k = 0; k < rig->n_spine; k++) {
        cdbo_quaternion turned;
        above = cdbo_then(above, cdbo_get4(rotations, (size_t)rig->spine[k]));
        turned = cdbo_then(cdbo_heading(turn * rig->left[k]), above);
        cdbo_set4(rotations, (size_t)rig->spine[k], cdbo_then(cdbo_back(under), turned));
        under = turned;
    }
}

static inline void cdbo_run_alignment(cdbo_posed *one)
{
    double *turn = cdbo_column(one, CDBO_TURN), *stride = cdbo_column(one, CDBO_STRIDE), to_turn, to_stride, y;
    int warps = cdbo_set(one, CDBO_MIN_STRIDE) < 1.0 || cdbo_set(one, CDBO_MAX_STRIDE) > 1.0;
    int bends = warps || cdbo_set(one, CDBO_PATH_ALIGNMENT) != 0.0;
    turn[0] = turn[1] = stride[1] = 0.0, stride[0] = 1.0;
    if (!bends || one->poses->rig.n_spine == 0) return;
    if (one->mode == CDBO_BY_ANIMATION && cdbo_was(one, CDBO_TURN)[0] == 0.0 && cdbo_was(one, CDBO_STRIDE)[0] == 1.0) return;
    cdbo_warp_goal(one, &to_turn, &to_stride);
    cdbo_keep(one, CDBO_TURN, 2);
    cdbo_keep(one, CDBO_STRIDE, 2);
    y = cdbo_set(one, CDBO_ALIGNMENT_HALFLIFE);
    cdbo_come(turn, to_turn, y, one->dt_s);
    cdbo_come(stride, to_stride, y, one->dt_s);
    if (turn[0] != 0.0) cdbo_turn_hips(&one->poses->rig, turn[0], one->rotations, one->translations);
}

static const cdbo_stage cdbo_alignment_stage = {"alignment", cdbo_alignment_columns, CDBO_COUNT(cdbo_alignment_columns),
    cdbo_alignment_settings, CDBO_COUNT(cdbo_alignment_settings), NULL, cdbo_run_alignment};
