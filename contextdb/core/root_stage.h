/* ---- Where the body is: moved by the animation, by the game, or by both, and without a step in its velocity where what plays
 * jumps.
 *
 * Movement of the animation goes the way that the body is aligned to, in steps as long as its legs make.
 *
 * By both, a share of the movement is the animation's and the rest the game's. What then lies between the character and the game's
 * body is made up for by and by, by at most half as far as the character moves itself, so that nobody slides while standing; and
 * never is it farther away than the clamp. The heading may be pulled by more with each metre that is walked: a clip that goes
 * straight on is steered along a curve, and turns on the feet that are locked.
 *
 * Along a path, the way is the game's, and how fast it is gone is the animation's: what lies to the side of the way is made up for,
 * what lies along it is not. The game then goes on from the pose's root.
 *
 * A jump moves nobody, but it changes the velocity of what plays. The difference decays as the offsets of joints do: the body runs
 * on or falls back a little, and comes to the path of what plays. Where the row of what plays says by what the root is moved, and that
 * is not what moved it before, the root goes on from where it would have been, and comes to its new place in the same way.
 *
 * Source: Root Motion Weight in EA's talk; speed from the animation along a path from code in Remedy's; the adjustment and the
 * clamp of orangeduck/Motion-Matching, controller.cpp. */

#define CDBO_MOST_PULL 0.5     /* the pull is at most this share of the character's own movement */
#define CDBO_TURN_PER_M 6.0    /* and turns by so many radians a metre of way: who walks is steered, who stands is not turned */
#define CDBO_STANDING_MPS 0.1  /* what goes slower stands */

static const cdbo_column_record cdbo_root_columns[] = {
    {CDBO_MODE, "mode", CDBO_ONE, 1, 0.0},
    {CDBO_HAS_BODY, "has_body", CDBO_ONE, 1, 0.0},
    {CDBO_BODY, "body", CDBO_ONE, 3, 0.0},
    {CDBO_HAS_VELOCITY, "has_velocity", CDBO_ONE, 1, 0.0},
    {CDBO_VELOCITY, "velocity", CDBO_ONE, 2, 0.0},
    {CDBO_BASE, "base", CDBO_ONE, 3, 0.0},
    {CDBO_OFFSET, "offset", CDBO_ONE, 3, 0.0},
    {CDBO_OFFSET_SPEED, "offset_speed", CDBO_ONE, 3, 0.0},
};
static const cdbo_setting_record cdbo_root_settings[] = {
    {CDBO_ROOT, "root", CDBO_AS_IT_IS},
    {CDBO_POSITION_WEIGHT, "position_weight", CDBO_AS_IT_IS},
    {CDBO_ROTATION_WEIGHT, "rotation_weight", CDBO_AS_IT_IS},
    {CDBO_POSITION_PULL, "position_pull_s", CDBO_AS_IT_IS},
    {CDBO_ROTATION_PULL, "rotation_pull_s", CDBO_AS_IT_IS},
    {CDBO_POSITION_CLAMP, "position_clamp_m", CDBO_AS_IT_IS},
    {CDBO_ROTATION_CLAMP, "rotation_clamp_deg", CDBO_RADIANS},
};

/* A place, or how it changes: x and z, or left and ahead; and a heading, or a turn. */
typedef struct cdbo_place3 {
    double x, z, heading;
} cdbo_place3;

static inline cdbo_place3 cdbo_xzh(double x, double z, double heading)
{
    cdbo_place3 made;
    made.x = x, made.z = z, made.heading = heading;
    return made;
}

static inline cdbo_place3 cdbo_place_at(const double *numbers)
{
    return cdbo_xzh(numbers[0], numbers[1], numbers[2]);
}

static inline void cdbo_set_place(double *numbers, cdbo_place3 place)
{
    numbers[0] = place.x, numbers[1] = place.z, numbers[2] = place.heading;
}

static inline cdbo_place3 cdbo_place_sum(cdbo_place3 a, cdbo_place3 b)
{
    return cdbo_xzh(a.x + b.x, a.z + b.z, a.heading + b.heading);
}

/* How much of the turning is the animation's, and of the movement. */
static inline double cdbo_rotation_share(const cdbo_posed *one)
{
    double root = one->mode;
    if (root == CDBO_BY_BOTH) return one->given->weight * cdbo_set(one, CDBO_ROTATION_WEIGHT);
    return root == CDBO_BY_ANIMATION ? 1.0 : 0.0;
}

static inline double cdbo_position_share(const cdbo_posed *one)
{
    double root = one->mode;
    if (root == CDBO_BY_BOTH) return one->given->weight * cdbo_set(one, CDBO_POSITION_WEIGHT);
    return root == CDBO_BY_CODE ? 0.0 : 1.0;
}

/* Write where the game has the body, and how fast it moves it: by how far it came since the last update, as a session knows no
 * more. */
static inline void cdbo_move_body(cdbo_posed *one)
{
    const double *was = cdbo_was(one, CDBO_BODY), *body = one->place ? one->place : was;
    int had_body = *cdbo_was(one, CDBO_HAS_BODY) != 0.0, is_moved = one->place && had_body && one->dt_s > 0.0;
    size_t i;
    *cdbo_column(one, CDBO_HAS_BODY) = one->place || had_body ? 1.0 : 0.0;
    for (i = 0; i < 3; i++) cdbo_column(one, CDBO_BODY)[i] = body[i];
    *cdbo_column(one, CDBO_HAS_VELOCITY) = is_moved ? 1.0 : *cdbo_was(one, CDBO_HAS_VELOCITY);
    for (i = 0; i < 2; i++)
        cdbo_column(one, CDBO_VELOCITY)[i] = is_moved ? (body[i] - was[i]) / one->dt_s : cdbo_was(one, CDBO_VELOCITY)[i];
}

/* How fast the game's body goes, 0 and 0 where that is not known. */
static inline void cdbo_velocity(const cdbo_posed *one, double *x, double *z)
{
    int is_known = *cdbo_column(one, CDBO_HAS_VELOCITY) != 0.0;
    *x = is_known ? cdbo_column(one, CDBO_VELOCITY)[0] : 0.0;
    *z = is_known ? cdbo_column(one, CDBO_VELOCITY)[1] : 0.0;
}

/* A movement of what plays, turned and stretched as the legs were. */
static inline cdbo_place3 cdbo_bent(const cdbo_posed *one, cdbo_place3 motion)
{
    double turn = *cdbo_was(one, CDBO_TURN), stride = *cdbo_was(one, CDBO_STRIDE), sine, cosine;
    if (turn == 0.0 && stride == 1.0) return motion;
    cdbo_sin_cos(turn, &sine, &cosine);
    sine *= stride, cosine *= stride;
    return cdbo_xzh(cosine * motion.x + sine * motion.z, cosine * motion.z - sine * motion.x, motion.heading);
}

/* A place after a share of a movement in its own frame. */
static inline cdbo_place3 cdbo_after(cdbo_place3 base, cdbo_place3 motion, double moved, double turned)
{
    double left = moved * motion.x, ahead = moved * motion.z, sine, cosine;
    cdbo_sin_cos(base.heading, &sine, &cosine);
    return cdbo_xzh(base.x + cosine * left + sine * ahead, base.z - sine * left + cosine * ahead,
        base.heading + turned * motion.heading);
}

/* Whether the game goes a way that the root keeps to, and which; none where it stands. */
static inline int cdbo_way(const cdbo_posed *one, double *x, double *z)
{
    double size;
    cdbo_velocity(one, x, z);
    if (one->mode != CDBO_BY_PATH) return 0;
    size = cdbo_flat_length(*x, *z);
    if (!(size > CDBO_STANDING_MPS)) return 0;
    *x /= size, *z /= size;
    return 1;
}

/* The game's body; on a way, moved along it to beside a place. */
static inline cdbo_place3 cdbo_beside(const cdbo_posed *one, double x, double z)
{
    cdbo_place3 body = cdbo_place_at(cdbo_column(one, CDBO_BODY));
    double way_x, way_z, along;
    if (!cdbo_way(one, &way_x, &way_z)) return body;
    along = (x - body.x) * way_x + (z - body.z) * way_z;
    return cdbo_xzh(body.x + along * way_x, body.z + along * way_z, body.heading);
}

/* The share of a difference that is gone after some time; none where no half-life is set. */
static inline double cdbo_made_up(double halflife_s, double dt_s)
{
    return halflife_s > 0.0 ? 1.0 - cdbo_exp(-CDBO_LN2 * dt_s / halflife_s) : 0.0;
}

/* The base nearer to the game's body, by what it moved and turned itself at most. */
static inline cdbo_place3 cdbo_pulled(const cdbo_posed *one, cdbo_place3 base, double moved, double turned)
{
    cdbo_place3 body = cdbo_beside(one, base.x, base.z);
    double x = body.x - base.x, z = body.z - base.z, heading = cdbo_remainder(body.heading - base.heading);
    double apart = cdbo_flat_length(x, z), share = 0.0, turn;
    if (apart > 0.0)
        share = cdbo_least(cdbo_made_up(cdbo_set(one, CDBO_POSITION_PULL), one->dt_s), CDBO_MOST_PULL * moved / apart);
    turn = cdbo_least(cdbo_made_up(cdbo_set(one, CDBO_ROTATION_PULL), one->dt_s) * cdbo_size(heading), CDBO_MOST_PULL * turned);
    return cdbo_xzh(base.x + share * x, base.z + share * z, base.heading + cdbo_signed(turn, heading));
}

/* The base after this update's movement and the pull to the game's body. */
static inline cdbo_place3 cdbo_moved(const cdbo_posed *one, cdbo_place3 motion, double moved, double turned)
{
    cdbo_place3 body = cdbo_place_at(cdbo_column(one, CDBO_BODY)), base = body, last = body, after;
    double root = one->mode, x, z, far_m, own_m;
    if (*cdbo_was(one, CDBO_BEGUN) != 0.0) base = cdbo_place_at(cdbo_was(one, CDBO_BASE));
    else if (!one->place) base = cdbo_place_at(cdbo_column(one, CDBO_CLIP_ROOT));
    after = cdbo_after(base, cdbo_bent(one, motion), moved, turned);
    if (!one->place || root == CDBO_BY_ANIMATION) return after;
    if (root == CDBO_BY_CODE) return body;
    if (*cdbo_was(one, CDBO_HAS_BODY) != 0.0) last = cdbo_place_at(cdbo_was(one, CDBO_BODY));
    if (cdbo_way(one, &x, &z)) {
        far_m = cdbo_flat_length(after.x - base.x, after.z - base.z);
        after.x = base.x + far_m * x, after.z = base.z + far_m * z;
    }
    after.x += (1.0 - moved) * (body.x - last.x);
    after.z += (1.0 - moved) * (body.z - last.z);
    after.heading += (1.0 - turned) * cdbo_remainder(body.heading - last.heading);
    own_m = cdbo_flat_length(after.x - base.x, after.z - base.z);
    return cdbo_pulled(one, after, own_m, cdbo_size(after.heading - base.heading) + CDBO_TURN_PER_M * own_m);
}

/* The base from which the displayed root is within the clamp: of the body, or of its way along a path. */
static inline cdbo_place3 cdbo_clamped(const cdbo_posed *one, cdbo_place3 base, cdbo_place3 offset)
{
    cdbo_place3 displayed = cdbo_place_sum(base, offset), body = cdbo_beside(one, displayed.x, displayed.z);
    double x = displayed.x - body.x, z = displayed.z - body.z, turn = cdbo_remainder(displayed.heading - body.heading);
    double apart = cdbo_flat_length(x, z), most = cdbo_set(one, CDBO_POSITION_CLAMP), limit = cdbo_set(one, CDBO_ROTATION_CLAMP);
    double share = apart > most ? most / apart - 1.0 : 0.0, over = turn - cdbo_within(turn, -limit, limit);
    return cdbo_xzh(base.x + share * x, base.z + share * z, base.heading - over);
}

/* The change of velocity at a seam goes into the offset, in the world. */
static inline void cdbo_change(const cdbo_posed *one, cdbo_place3 base, cdbo_place3 motion, double moved, double turned)
{
    double *offset = cdbo_column(one, CDBO_OFFSET), *speed = cdbo_column(one, CDBO_OFFSET_SPEED), dt_s = one->dt_s;
    cdbo_vector entered = one->entered;
    cdbo_place3 step;
    int is_ahead = one->given->is_ahead != 0.0;
    if (is_ahead && dt_s > 0.0) entered = cdbo_xyz(motion.x / dt_s, motion.z / dt_s, motion.heading / dt_s);
    step = cdbo_bent(one, cdbo_xzh(one->left.x - entered.x, one->left.y - entered.y, 0.0));
    step = cdbo_after(cdbo_xzh(0.0, 0.0, base.heading), step, moved, 0.0);
    step.heading = turned * (one->left.z - entered.z);
    cdbo_set_place(speed, cdbo_place_sum(cdbo_place_at(speed), step));
    if (is_ahead)
        cdbo_set_place(offset, cdbo_place_sum(cdbo_place_at(offset), cdbo_xzh(step.x * dt_s, step.z * dt_s, step.heading * dt_s)));
}

static inline void cdbo_run_root(cdbo_posed *one)
{
    double moved = cdbo_position_share(one), turned = cdbo_rotation_share(one), root = one->mode;
    double lost_s = one->seams ? one->given->lost_s : 0.0;
    int is_on = *cdbo_was(one, CDBO_BEGUN) != 0.0;
    double mode = *cdbo_was(one, CDBO_MODE) - 1.0;
    cdbo_place3 kept;
    cdbo_place3 motion = cdbo_xzh(0.0, 0.0, 0.0), base, offset;
    if (is_on) motion = cdbo_place_at(one->given->motion);
    if (lost_s > 0.0) motion = cdbo_place_sum(motion, cdbo_xzh(lost_s * one->left.x, lost_s * one->left.y, lost_s * one->left.z));
    cdbo_move_body(one);
    *cdbo_column(one, CDBO_MODE) = one->mode + 1.0;
    base = cdbo_moved(one, motion, moved, turned);
    cdbo_keep(one, CDBO_OFFSET, 3);
    cdbo_keep(one, CDBO_OFFSET_SPEED, 3);
    if (cdbo_set(one, CDBO_BLEND) == CDBO_BY_SPRING) {
        cdbo_decay(3, cdbo_was(one, CDBO_OFFSET), cdbo_was(one, CDBO_OFFSET_SPEED), cdbo_fade(one), one->dt_s,
            cdbo_column(one, CDBO_OFFSET), cdbo_column(one, CDBO_OFFSET_SPEED));
        if (one->seams && !cdbo_is_cut(one)) cdbo_change(one, base, motion, moved, turned);
        if (is_on && mode >= 0.0 && mode != root && !cdbo_is_cut(one)) {
            one->mode = mode, kept = cdbo_moved(one, motion, cdbo_position_share(one), cdbo_rotation_share(one)), one->mode = root;
            offset = cdbo_place_sum(cdbo_place_at(cdbo_column(one, CDBO_OFFSET)), kept);
            cdbo_set_place(cdbo_column(one, CDBO_OFFSET),
                cdbo_xzh(offset.x - base.x, offset.z - base.z, cdbo_remainder(offset.heading - base.heading)));
        }
    }
    offset = cdbo_place_at(cdbo_column(one, CDBO_OFFSET));
    if ((root == CDBO_BY_BOTH || root == CDBO_BY_PATH) && one->place) base = cdbo_clamped(one, base, offset);
    cdbo_set_place(cdbo_column(one, CDBO_BASE), base);
    cdbo_set_place(one->root, cdbo_place_sum(base, offset));
}

static const cdbo_stage cdbo_root_stage = {"root", cdbo_root_columns, CDBO_COUNT(cdbo_root_columns), cdbo_root_settings,
    CDBO_COUNT(cdbo_root_settings), NULL, cdbo_run_root};
