/* ---- Bodies that follow sticks, and paths over the ground: where bodies will be, and what a query says of a path.
 *
 * The velocity nears the one that the stick asks for as a critically damped spring does, and so does the facing. Positions are
 * exact: a step of 0.2 s leads to where twenty of 0.01 s lead.
 *
 * Source: D. Holden, "Spring-It-On", 2021; orangeduck/Motion-Matching, controller.cpp. */

#define CDBO_KEEPS_FACING_MPS 0.1 /* asked to go slower than this, a body keeps its facing */
#define CDBO_STANDS_MPS 0.05      /* a path that is slower at its end goes no further */
#define CDBO_NO_WAY_MPS 0.3       /* a body that is slower moves in no clear direction */

typedef struct cdbo_body {
    double position[2], velocity[2], acceleration[2], heading, turn_rate; /* m, m/s, m/s2, radians and radians a second */
    double velocity_halflife_s, heading_halflife_s;
} cdbo_body;

typedef struct cdbo_goal {
    double velocity[2], facing; /* NaN: where the body goes */
} cdbo_goal;

/* The heading that a body comes to. */
static inline double cdbo_facing(const cdbo_body *body, const cdbo_goal *goal)
{
    if (goal->facing == goal->facing) return goal->facing;
    if (!(cdbo_flat_length(goal->velocity[0], goal->velocity[1]) >= CDBO_KEEPS_FACING_MPS)) return body->heading;
    return cdbo_atan2(goal->velocity[0], goal->velocity[1]);
}

/* A body some time later, while the stick stays as it is. */
static inline void cdbo_move(const cdbo_body *body, const cdbo_goal *goal, double t, cdbo_body *to)
{
    double y = cdbo_damping(body->velocity_halflife_s), left = cdbo_exp(-y * t), facing = cdbo_facing(body, goal), apart, drift;
    size_t i;
    *to = *body;
    for (i = 0; i < 2; i++) {
        apart = body->velocity[i] - goal->velocity[i];
        drift = body->acceleration[i] + apart * y;
        to->position[i] = left * (-drift / (y * y) - (apart + drift * t) / y);
        to->position[i] += drift / (y * y) + apart / y + goal->velocity[i] * t + body->position[i];
        to->velocity[i] = left * (apart + drift * t) + goal->velocity[i];
        to->acceleration[i] = left * (body->acceleration[i] - drift * y * t);
    }
    y = cdbo_damping(body->heading_halflife_s), left = cdbo_exp(-y * t);
    apart = -cdbo_remainder(facing - body->heading);
    drift = body->turn_rate + apart * y;
    to->heading = body->heading - apart + left * (apart + drift * t);
    to->turn_rate = left * (body->turn_rate - drift * y * t);
}

/* Make headings, every so many numbers, go on without a jump by a whole turn. */
static inline void cdbo_unwrap(double *headings, size_t every, size_t n)
{
    double before = n > 0 ? headings[0] : 0.0, turns = 0.0;
    size_t i;
    for (i = every; i < every * n; i += every) {
        double step = headings[i] - before;
        before = headings[i];
        if (cdbo_size(step) >= CDBO_PI) turns += cdbo_remainder(step) - step;
        headings[i] += turns;
    }
}

/* Write the frames of a path behind its first `n_past`, of which the last is the body now: positions [n, 2] and headings [n]. */
static inline void cdbo_steer(const cdbo_body *body, const cdbo_goal *goal, double rate, size_t n_past, size_t n, double *positions,
    double *headings)
{
    cdbo_goal fixed = *goal;
    cdbo_body moved;
    size_t i;
    fixed.facing = cdbo_facing(body, goal);
    for (i = n_past; i < n; i++) {
        cdbo_move(body, &fixed, (double)(i - n_past + 1) / rate, &moved);
        positions[2 * i] = moved.position[0], positions[2 * i + 1] = moved.position[1], headings[i] = moved.heading;
    }
    cdbo_unwrap(headings, 1, n);
}

/* ---- points of a path */

typedef struct cdbo_path {
    const double *positions, *headings; /* [n_frames, 2], [n_frames] */
    const double *lengths;              /* [n_frames]: metres along it; NULL where no point is some metres away */
    size_t n_frames, now;
    double rate;
} cdbo_path;

typedef struct cdbo_point {
    double x, z, heading, velocity_x, velocity_z;
} cdbo_point;

/* Metres a second at a frame: central differences, one-sided at the ends. */
static inline void cdbo_path_velocity(const cdbo_path *path, size_t frame, double *x, double *z)
{
    size_t low = frame > 0 ? frame - 1 : 0, high = frame + 1 < path->n_frames ? frame + 1 : path->n_frames - 1;
    double seconds = (double)(high > low ? high - low : 1) * (1.0 / path->rate);
    *x = (path->positions[2 * high] - path->positions[2 * low]) / seconds;
    *z = (path->positions[2 * high + 1] - path->positions[2 * low + 1]) / seconds;
}

/* A path at a moment in frames; beyond its ends it goes straight on at its last velocity and heading. */
static inline cdbo_point cdbo_path_at(const cdbo_path *path, double frame)
{
    double last = (double)(path->n_frames - 1), inside = cdbo_within(frame, 0.0, last), share, rest, beyond_s, x[2], z[2];
    size_t before = inside > 0.0 && inside <= last ? (size_t)inside : 0, after;
    const double *from, *to;
    cdbo_point point;
    if (before + 1 >= path->n_frames) before = path->n_frames > 1 ? path->n_frames - 2 : 0;
    after = before + 1 < path->n_frames ? before + 1 : before;
    share = inside - (double)before, rest = 1.0 - share, beyond_s = (frame - inside) / path->rate;
    from = path->positions + 2 * before, to = path->positions + 2 * after;
    cdbo_path_velocity(path, before, &x[0], &z[0]);
    cdbo_path_velocity(path, after, &x[1], &z[1]);
    point.velocity_x = x[0] * rest + x[1] * share, point.velocity_z = z[0] * rest + z[1] * share;
    point.x = from[0] * rest + to[0] * share + point.velocity_x * beyond_s;
    point.z = from[1] * rest + to[1] * share + point.velocity_z * beyond_s;
    point.heading = path->headings[before] * rest + path->headings[after] * share;
    return point;
}

/* Metres along a path from its first frame: [n_frames]. */
static inline void cdbo_path_lengths(const cdbo_path *path, double *lengths)
{
    size_t i;
    lengths[0] = 0.0;
    for (i = 1; i < path->n_frames; i++) {
        const double *to = path->positions + 2 * i;
        lengths[i] = lengths[i - 1] + cdbo_flat_length(to[0] - to[-2], to[1] - to[-1]);
    }
}

/* Where a path has some length, in frames between its first and its last. */
static inline double cdbo_frame_of_length(const cdbo_path *path, double length)
{
    size_t last = path->n_frames - 1, low = 0, high = path->n_frames; /* the first frame that is farther is in (low, high] */
    double step, share;
    if (length >= path->lengths[last]) return (double)last;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (path->lengths[middle] <= length) low = middle + 1;
        else high = middle;
    }
    low = low > 0 ? low - 1 : 0;
    if (low >= last) low = last > 0 ? last - 1 : 0;
    step = path->lengths[low + 1 <= last ? low + 1 : last] - path->lengths[low];
    share = step > 0.0 ? (length - path->lengths[low]) / step : 0.0;
    return (double)low + cdbo_within(share, 0.0, 1.0);
}

/* How many frames beyond one of its ends a path is some metres further; none where it stands there. */
static inline double cdbo_frames_beyond(const cdbo_path *path, size_t end, double metres)
{
    double x, z, speed;
    cdbo_path_velocity(path, end, &x, &z);
    speed = cdbo_flat_length(x, z);
    return speed > CDBO_STANDS_MPS ? metres * path->rate / speed : 0.0;
}

/* A path some metres further along than its present, or back. */
static inline cdbo_point cdbo_path_along(const cdbo_path *path, double metres)
{
    size_t last = path->n_frames - 1;
    double length = path->lengths[path->now] + metres, frame = (double)path->now;
    if (metres != 0.0) /* where a body stands, many frames have one length */
        frame = cdbo_frame_of_length(path, length);
    frame += cdbo_frames_beyond(path, last, cdbo_most(length - path->lengths[last], 0.0));
    return cdbo_path_at(path, frame + cdbo_frames_beyond(path, 0, cdbo_least(length, 0.0)));
}

/* ---- what a query says of a point: the numbers of these are those of the words in [features.NAME] */

typedef enum cdbo_what { CDBO_PLACE, CDBO_DIRECTION, CDBO_WAY_SPEED, CDBO_PACE, CDBO_FACING_TO_WAY } cdbo_what;

typedef struct cdbo_path_feature { /* a point of a channel: whether it is metres away, not seconds; what; its first column */
    int64_t is_along, what, column;
} cdbo_path_feature;

/* How many features one of these is. */
static inline size_t cdbo_feature_size(const cdbo_path_feature *feature)
{
    return feature->what == CDBO_PACE ? 1 : 2;
}

/* Whether all features are of a query of so many. */
static inline int cdbo_are_features(const cdbo_path_feature *features, size_t n, size_t n_features)
{
    size_t i;
    for (i = 0; i < n; i++) {
        size_t size = cdbo_feature_size(&features[i]);
        if (features[i].what < CDBO_PLACE || features[i].what > CDBO_FACING_TO_WAY || features[i].column < 0) return 0;
        if (n_features < size || (uint64_t)features[i].column > n_features - size) return 0;
    }
    return 1;
}

/* A vector over the ground as metres to the left and ahead of a body with a heading. */
static inline void cdbo_seen(double x, double z, double heading, float *to)
{
    double sine, cosine;
    cdbo_sin_cos(heading, &sine, &cosine);
    to[0] = (float)(cosine * x - sine * z), to[1] = (float)(sine * x + cosine * z);
}

static inline void cdbo_write_feature(const cdbo_path *path, const cdbo_path_feature *feature, double step, float *query)
{
    const double *origin = path->positions + 2 * path->now;
    double heading = path->headings[path->now], sine, cosine, speed;
    cdbo_point point = feature->is_along ? cdbo_path_along(path, step) : cdbo_path_at(path, (double)path->now + step * path->rate);
    float *to = query + feature->column;
    switch (feature->what) {
    case CDBO_PLACE: cdbo_seen(point.x - origin[0], point.z - origin[1], heading, to); break;
    case CDBO_DIRECTION:
        cdbo_sin_cos(point.heading - heading, &sine, &cosine);
        to[0] = (float)sine, to[1] = (float)cosine;
        break;
    case CDBO_WAY_SPEED: cdbo_seen(point.velocity_x, point.velocity_z, heading, to); break;
    case CDBO_PACE: to[0] = (float)cdbo_flat_length(point.velocity_x, point.velocity_z); break;
    default: /* the facing as seen by one who looks where the body moves; it shrinks evenly to 0 at rest */
        speed = cdbo_most(cdbo_flat_length(point.velocity_x, point.velocity_z), CDBO_NO_WAY_MPS);
        cdbo_seen(point.velocity_x / speed, point.velocity_z / speed, point.heading, to);
        to[0] = -to[0];
    }
}
