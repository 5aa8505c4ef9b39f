/* ---- Legs: bent so that a foot comes to a place, and hips as low as that needs. A leg is four joints: hip, knee, ankle and what
 * stands, which is the toe or the ankle.
 *
 * Source: orangeduck/Motion-Matching, ik_two_bone; the damping of the knee from Forsyth, "How a Character Should Walk". */

#define CDBO_STRAIGHT 2.96705972839036091 /* a knee straighter than 170 degrees is damped */
#define CDBO_MOST_LOWER_M 0.25            /* the hips go down by no more than this for a foot out of reach */
#define CDBO_HIPS_HALFLIFE_S 0.1          /* how fast hips and feet come to the height of the ground */

/* Bend a leg so that its ankle comes to a target; the foot keeps its rotation in the world.
 *
 * positions and world place the joints; the leg's rotations against their parents are written. A knee that would be straighter than
 * `straight` (radians), and than it is, goes only a quarter of what is over: it never slams. What a knee bends more than it does
 * already it bends to where `ahead` is: the way a nearly stretched leg is bent to says nothing. */
static inline void cdbo_bend_leg(const int64_t *parents, const double *positions, const double *world, const int64_t *leg,
    cdbo_vector target, cdbo_vector ahead, double straight, double *rotations)
{
    size_t hip = (size_t)leg[0], knee = (size_t)leg[1], ankle = (size_t)leg[2];
    cdbo_vector a = cdbo_get3(positions, hip), b = cdbo_get3(positions, knee), c = cdbo_get3(positions, ankle);
    cdbo_vector thigh = cdbo_from(a, b), shin = cdbo_from(b, c), way = cdbo_from(a, target), axis = cdbo_cross(thigh, shin);
    double upper = cdbo_length(thigh), lower = cdbo_length(shin), far, now, bent, limit, size;
    cdbo_quaternion back, bend, swing, new_hip, new_knee;
    if (upper < 1e-9 || lower < 1e-9) return;
    far = cdbo_least(cdbo_most(cdbo_length(way), cdbo_size(upper - lower) + 1e-9), upper + lower);
    size = cdbo_length(axis);
    now = CDBO_PI - cdbo_atan2(size, cdbo_dot(thigh, shin));
    bent = cdbo_acos(cdbo_within((upper * upper + lower * lower - far * far) / (2.0 * upper * lower), -1.0, 1.0));
    limit = cdbo_most(straight, now);
    if (bent > limit) bent = limit + 0.25 * (bent - limit);
    if (size > 1e-6 * upper * lower) {
        axis = cdbo_xyz(axis.x / size, axis.y / size, axis.z / size);
        back = cdbo_about(axis, now - CDBO_PI);
    } else { /* stretched: bent to no side of its own */
        back = cdbo_arc(shin, thigh);
        now = CDBO_PI;
        axis = cdbo_xyz(0.0, 0.0, 0.0);
    }
    if (bent < now) {
        cdbo_vector hinge = cdbo_cross(thigh, cdbo_cross(cdbo_cross(cdbo_from(c, a), ahead), thigh));
        double width = cdbo_length(hinge), share = width > 1e-12 ? (now - bent) / width : 0.0;
        axis = cdbo_add(cdbo_times(CDBO_PI - now, axis), cdbo_times(share, hinge));
    }
    size = cdbo_length(axis);
    if (size < 1e-12) return;
    bend = cdbo_then(cdbo_about(cdbo_xyz(axis.x / size, axis.y / size, axis.z / size), CDBO_PI - bent), back);
    swing = cdbo_arc(cdbo_add(thigh, cdbo_rotated(bend, shin)), way);
    new_hip = cdbo_then(swing, cdbo_get4(world, hip));
    new_knee = cdbo_then(swing, cdbo_then(bend, cdbo_get4(world, knee)));
    cdbo_set4(rotations, hip, cdbo_then(cdbo_back(cdbo_get4(world, (size_t)parents[leg[0]])), new_hip));
    cdbo_set4(rotations, knee, cdbo_then(cdbo_back(new_hip), new_knee));
    cdbo_set4(rotations, ankle, cdbo_then(cdbo_back(new_knee), cdbo_get4(world, ankle)));
}

/* The rotation of what is level to a ground that rises along x and z. */
static inline cdbo_quaternion cdbo_tilt(double along_x, double along_z)
{
    return cdbo_arc(cdbo_xyz(0.0, 1.0, 0.0), cdbo_xyz(-along_x, 1.0, -along_z));
}

/* By how much hips that are raised are too high for a leg to bring what stands to a place on a ground, 0 where they are not.
 *
 * A leg reaches as far as it does now; and farther the harder, up to where its knee is straight: it does not come there at once. */
static inline double cdbo_too_high(const double *positions, const int64_t *leg, cdbo_vector place, double along_x, double along_z,
    double raised)
{
    cdbo_vector a = cdbo_get3(positions, (size_t)leg[0]), b = cdbo_get3(positions, (size_t)leg[1]);
    cdbo_vector c = cdbo_get3(positions, (size_t)leg[2]), toe = cdbo_get3(positions, (size_t)leg[3]);
    cdbo_vector way = cdbo_rotated(cdbo_tilt(along_x, along_z), cdbo_from(c, toe));
    double upper = cdbo_length(cdbo_from(a, b)), lower = cdbo_length(cdbo_from(b, c)), now = cdbo_length(cdbo_from(a, c));
    double sine, cosine, room, x, y, z, over, reach, rest;
    cdbo_sin_cos(CDBO_STRAIGHT, &sine, &cosine);
    room = sqrt(upper * upper + lower * lower - 2.0 * upper * lower * cosine) - now;
    x = place.x - way.x - a.x, y = a.y + raised - place.y + way.y, z = place.z - way.z - a.z;
    over = sqrt(x * x + y * y + z * z) - now;
    if (over <= 0.0) return 0.0;
    reach = room > 0.0 ? now + over * room / sqrt(room * room + over * over) : now;
    rest = reach * reach - x * x - z * z;
    return y - sqrt(rest > 0.0 ? rest : 0.0);
}

/* Bend a leg so that what stands comes to a place, its foot turned by the slope of the ground: written in world, too. */
static inline void cdbo_stand_leg(const int64_t *parents, const double *positions, double *world, const int64_t *leg,
    const double *hinge, cdbo_vector place, double along_x, double along_z, double *rotations)
{
    size_t ankle = (size_t)leg[2];
    cdbo_quaternion tilt = cdbo_tilt(along_x, along_z);
    cdbo_vector hip = cdbo_get3(positions, (size_t)leg[0]), c = cdbo_get3(positions, ankle), ahead, way;
    cdbo_set4(world, ankle, cdbo_then(tilt, cdbo_get4(world, ankle)));
    way = cdbo_rotated(tilt, cdbo_from(c, cdbo_get3(positions, (size_t)leg[3])));
    ahead = cdbo_cross(cdbo_rotated(cdbo_get4(world, (size_t)leg[0]), cdbo_get3(hinge, 0)), cdbo_from(c, hip));
    cdbo_bend_leg(parents, positions, world, leg, cdbo_from(way, place), ahead, CDBO_STRAIGHT, rotations);
}

/* How low hips are, and the change of that, some time later: as low as legs need them now, and back up by and by. */
static inline void cdbo_lower(double *lower, double need, double dt_s)
{
    cdbo_come(lower, need, cdbo_damping(CDBO_HIPS_HALFLIFE_S), dt_s);
    if (lower[0] < need) {
        lower[0] = need;
        lower[1] = cdbo_most(lower[1], 0.0);
    }
}
