/* ---- A character over the ground: the body that the game has, where the animation is, and the path that a search is asked for.
 *
 * The animation is rarely where the game has the body. A search that knows only the body's path never learns of that; told where the
 * root really is, it prefers frames that lead back. So the path begins at the root of the last pose, and what lies between it and the
 * body's path decays as a critically damped spring does, without a step in place or velocity. What lies behind is where it was.
 *
 *   cdbm_walk_on   the body some time later, and what lies behind
 *   cdbm_wish      the path from where the animation is
 *   cdbm_ask_path  the query: the features of a pose, and of that path
 *   cdbm_settle    where the animation is, once a pose is displayed
 *
 * A walk is a row of numbers: a cdbm_walk, and behind it the places where the animation was. */

#define CDBM_RETURN_HALFLIFE_S 0.27 /* as fast as a body follows a stick */
#define CDBM_MOST_TURN (0.25 * CDBO_PI) /* a character that faces farther away counts as so far: few clips turn more at once, and where
                                         * none does, a path that asks for all of it makes the search jump to and fro */
#define CDBM_SETTLED_HALFLIVES 15.0 /* after so many half-lives a body goes straight on, and so does a path beyond its end */
#define CDBM_MOST_HALFLIFE_S 1.0    /* a half-life that is longer counts as this here */
#define CDBM_LEAST_BACK_S 2.0
#define CDBM_TRAIL_HZ 64.0          /* places that are nearer to each other in time are not remembered */

typedef struct cdbm_ways {          /* how far paths are looked at */
    const double *steps;            /* [n_points] seconds or metres */
    const cdbo_path_feature *features;
    const int64_t *velocities;      /* the features at which the velocities of joints begin that move as the body does */
    size_t n_points, n_velocities, n_features, n_trail;
    double rate, ahead_s, metres, back_s; /* metres below 0: no point is some metres away */
} cdbm_ways;

typedef struct cdbm_trail { double ago_s, place[3]; } cdbm_trail;

typedef struct cdbm_walk {
    cdbo_body body;
    double apart[3];                /* where the animation is, as the body sees it: to its left, ahead, and turned */
    double n_trail;                 /* behind the walk, the oldest first */
} cdbm_walk;

/* Whether the features are there; and how far they look. */
static inline int cdbm_open_ways(cdbm_ways *ways)
{
    size_t i;
    ways->ahead_s = ways->back_s = 0.0, ways->metres = -1.0;
    if (!cdbo_are_features(ways->features, ways->n_points, ways->n_features) || !(ways->rate > 0.0 && ways->rate <= 1e6)) return 0;
    for (i = 0; i < ways->n_velocities; i++)
        if (ways->velocities[i] < 0 || ways->n_features < 3 || (uint64_t)ways->velocities[i] > ways->n_features - 3) return 0;
    for (i = 0; i < ways->n_points; i++) {
        double step = ways->steps[i];
        if (!(cdbo_size(step) <= 3600.0)) return 0;
        if (ways->features[i].is_along) ways->metres = cdbo_most(ways->metres, step);
        else ways->ahead_s = cdbo_most(ways->ahead_s, step), ways->back_s = cdbo_most(ways->back_s, -step);
    }
    for (i = 0; i < ways->n_points; i++)
        if (ways->features[i].is_along && ways->steps[i] < 0.0) ways->back_s = cdbo_most(ways->back_s, CDBM_LEAST_BACK_S);
    ways->n_trail = ways->back_s > 0.0 ? (size_t)(ways->back_s * CDBM_TRAIL_HZ) + 4 : 0;
    return 1;
}

static inline size_t cdbm_walk_width(const cdbm_ways *ways)
{
    return (sizeof(cdbm_walk) + ways->n_trail * sizeof(cdbm_trail)) / sizeof(double);
}

static inline cdbm_trail *cdbm_trail_of(double *row)
{
    return (cdbm_trail *)(void *)(row + sizeof(cdbm_walk) / sizeof(double));
}

/* A walk that begins with a body. */
static inline void cdbm_begin_walk(const cdbm_ways *ways, const cdbo_body *body, double *row)
{
    memset(row, 0, cdbm_walk_width(ways) * sizeof(double));
    ((cdbm_walk *)(void *)row)->body = *body;
}

/* Where the animation is. */
static inline void cdbm_place_of(const double *row, double *place)
{
    const cdbm_walk *walk = (const cdbm_walk *)(const void *)row;
    double body[3];
    body[0] = walk->body.position[0], body[1] = walk->body.position[1], body[2] = walk->body.heading;
    cdbm_then(body, walk->apart, place);
}

/* Take a place into a trail after some seconds: of the places behind the farthest that is looked at one is kept. */
static inline void cdbm_remember_place(const cdbm_ways *ways, double *row, double dt_s, const double *place)
{
    cdbm_walk *walk = (cdbm_walk *)(void *)row;
    cdbm_trail *trail = cdbm_trail_of(row);
    size_t n = (size_t)walk->n_trail, n_old = 0, i;
    if (ways->n_trail == 0) return;
    for (i = 0; i < n; i++) trail[i].ago_s += dt_s;
    if (n > 1 && trail[n - 2].ago_s - trail[n - 1].ago_s < 1.0 / CDBM_TRAIL_HZ) n--;
    while (n_old + 1 < n && trail[n_old + 1].ago_s > ways->back_s) n_old++;
    if (n - n_old == ways->n_trail) n_old++;
    memmove(trail, trail + n_old, (n - n_old) * sizeof *trail);
    n -= n_old;
    trail[n].ago_s = 0.0;
    memcpy(trail[n].place, place, sizeof trail[n].place);
    memset(trail + n + 1, 0, (ways->n_trail - n - 1) * sizeof *trail);
    walk->n_trail = (double)(n + 1);
}

/* A character some time later, that follows a goal, or whose body the game has moved. */
static inline void cdbm_walk_on(const cdbm_ways *ways, const double *before, const cdbo_goal *goal, const cdbo_body *moved, double dt_s,
    double *after)
{
    double place[3];
    memcpy(after, before, cdbm_walk_width(ways) * sizeof(double));
    if (moved) ((cdbm_walk *)(void *)after)->body = *moved;
    else cdbo_move(&((const cdbm_walk *)(const void *)before)->body, goal, dt_s, &((cdbm_walk *)(void *)after)->body);
    cdbm_place_of(after, place);
    cdbm_remember_place(ways, after, dt_s, place);
}

/* Where the animation is from now on: a pose is displayed at a root. Where the clip alone moves the body, that is there too. */
static inline void cdbm_settle(double *row, const double *root, int moves_body)
{
    cdbm_walk *walk = (cdbm_walk *)(void *)row;
    double x = root[0] - walk->body.position[0], z = root[1] - walk->body.position[1], sine, cosine;
    memset(walk->apart, 0, sizeof walk->apart);
    if (moves_body) {
        walk->body.position[0] = root[0], walk->body.position[1] = root[1], walk->body.heading = root[2];
        return;
    }
    cdbo_sin_cos(walk->body.heading, &sine, &cosine);
    walk->apart[0] = cosine * x - sine * z, walk->apart[1] = sine * x + cosine * z;
    walk->apart[2] = cdbo_remainder(root[2] - walk->body.heading);
}

/* ---- the path */

static inline size_t cdbm_frames_in(double seconds, double rate)
{
    double frames = ceil(seconds * rate);
    return frames > 0.0 ? (size_t)cdbo_least(frames, 1e8) : 0;
}

/* How many frames of a path lie behind now. */
static inline size_t cdbm_n_behind(const cdbm_ways *ways, double rate)
{
    return ways->back_s > 0.0 ? cdbm_frames_in(ways->back_s - 1e-9 / rate, rate) : 0;
}

/* How many frames from now on a search must know. */
static inline size_t cdbm_n_ahead(const cdbm_ways *ways, double halflife_s, double speed)
{
    double needed = ways->ahead_s, settled = CDBM_SETTLED_HALFLIVES * cdbo_least(halflife_s, CDBM_MOST_HALFLIFE_S);
    if (ways->metres >= 0.0) needed = cdbo_most(needed, speed > 0.0 ? cdbo_least(settled, ways->metres / speed) : settled);
    return 1 + cdbm_frames_in(needed + 1.0 / ways->rate, ways->rate);
}

static inline size_t cdbm_most_frames(const cdbm_ways *ways)
{
    return cdbm_n_behind(ways, ways->rate) + cdbm_n_ahead(ways, CDBM_MOST_HALFLIFE_S, 0.0);
}

static inline size_t cdbm_n_wished(const cdbm_ways *ways, const double *row, const cdbo_goal *goal)
{
    const cdbo_body *body = &((const cdbm_walk *)(const void *)row)->body;
    return cdbm_n_behind(ways, ways->rate)
        + cdbm_n_ahead(ways, body->velocity_halflife_s, cdbo_flat_length(goal->velocity[0], goal->velocity[1]));
}

/* Where the animation was some seconds ago, between two of the places that are remembered. */
static inline void cdbm_place_ago(const cdbm_trail *trail, size_t n, double ago_s, double *place)
{
    size_t i = 1;
    double span, share;
    while (i + 1 < n && trail[i].ago_s > ago_s) i++;
    span = trail[i - 1].ago_s - trail[i].ago_s;
    share = span > 0.0 ? (trail[i - 1].ago_s - ago_s) / span : 1.0;
    place[0] = trail[i - 1].place[0] + share * (trail[i].place[0] - trail[i - 1].place[0]);
    place[1] = trail[i - 1].place[1] + share * (trail[i].place[1] - trail[i - 1].place[1]);
    place[2] = trail[i - 1].place[2] + share * cdbo_remainder(trail[i].place[2] - trail[i - 1].place[2]);
}

/* The frames behind now: where the animation was, and before that as straight as it went first. */
static inline void cdbm_look_back(const cdbm_ways *ways, const double *row, double rate, size_t now, double *positions, double *headings)
{
    const cdbm_trail *trail = cdbm_trail_of((double *)(uintptr_t)row);
    size_t n = (size_t)((const cdbm_walk *)(const void *)row)->n_trail, known = now, i;
    double place[3];
    (void)ways;
    for (i = now; n > 1 && i-- > 0;) {
        double ago_s = (double)(now - i) / rate;
        if (ago_s > trail[0].ago_s + 1e-9) break;
        cdbm_place_ago(trail, n, ago_s, place);
        positions[2 * i] = place[0], positions[2 * i + 1] = place[1], headings[i] = place[2], known = i;
    }
    for (i = 0; i < known; i++) {
        double n_back = (double)(known - i), *from = positions + 2 * known;
        positions[2 * i] = from[0] - n_back * (from[2] - from[0]), positions[2 * i + 1] = from[1] - n_back * (from[3] - from[1]);
        headings[i] = headings[known];
    }
}

/* Let a path [n] begin at a place and come back to itself, with half of the way between them gone in about a half-life; gives 0 where
 * it begins there anyway. */
static inline int cdbm_return(const double *place, double rate, double halflife_s, size_t n, double *positions, double *headings)
{
    double y = cdbo_damping(halflife_s), x = place[0] - positions[0], z = place[1] - positions[1];
    double turned = cdbo_within(cdbo_remainder(place[2] - headings[0]), -CDBM_MOST_TURN, CDBM_MOST_TURN);
    size_t i;
    if (x == 0.0 && z == 0.0 && turned == 0.0) return 0;
    for (i = 0; i < n; i++) {
        double t = y * (double)i / rate, left = (1.0 + t) * cdbo_exp(-t);
        positions[2 * i] += left * x, positions[2 * i + 1] += left * z, headings[i] += left * turned;
    }
    return 1;
}

/* Write the path that a character wishes to take from where the animation is, of n frames: positions [n, 2] and headings [n]. The
 * frames from `now` on are there already where the game plans them (`goal` is NULL). */
static inline void cdbm_wish(const cdbm_ways *ways, const double *row, const cdbo_goal *goal, double rate, size_t n, double *positions,
    double *headings)
{
    const cdbo_body *body = &((const cdbm_walk *)(const void *)row)->body;
    size_t now = cdbm_n_behind(ways, rate);
    double *at = positions + 2 * now, place[3];
    if (goal) {
        at[0] = body->position[0], at[1] = body->position[1], headings[now] = body->heading;
        cdbo_steer(body, goal, rate, 1, n - now, at, headings + now);
    }
    cdbm_place_of(row, place);
    cdbm_return(place, rate, CDBM_RETURN_HALFLIFE_S, n - now, at, headings + now);
    if (now == 0) return;
    cdbm_look_back(ways, row, rate, now, positions, headings);
    cdbo_unwrap(headings, 1, n);
}

/* Write a query: the features of a pose, rounded as a database's are, and those of a path of n frames. `lengths` has room for n
 * numbers, `narrow` for the features. */
static inline void cdbm_ask_path(const cdbm_ways *ways, const double *pose, double rate, size_t n, const double *positions,
    const double *headings, double *lengths, float *narrow, double *query)
{
    cdbo_path path;
    size_t i;
    path.positions = positions, path.headings = headings, path.lengths = lengths, path.n_frames = n, path.rate = rate;
    path.now = cdbm_n_behind(ways, rate);
    if (ways->metres >= 0.0 || ways->back_s > 0.0) cdbo_path_lengths(&path, lengths);
    for (i = 0; i < ways->n_features; i++) narrow[i] = (float)pose[i];
    for (i = 0; i < ways->n_points; i++) cdbo_write_feature(&path, &ways->features[i], ways->steps[i], narrow);
    for (i = 0; i < ways->n_features; i++) query[i] = (double)narrow[i];
}

/* The pose of a character that plays nothing: the mean of all frames, moving as the body does. */
static inline void cdbm_rest_pose(const cdbm_ways *ways, const double *row, const double *mean, double *pose)
{
    const cdbo_body *body = &((const cdbm_walk *)(const void *)row)->body;
    double sine, cosine;
    size_t i;
    memcpy(pose, mean, ways->n_features * sizeof(double));
    cdbo_sin_cos(body->heading, &sine, &cosine);
    for (i = 0; i < ways->n_velocities; i++) {
        double *to = pose + ways->velocities[i];
        to[0] = cosine * body->velocity[0] - sine * body->velocity[1], to[1] = 0.0;
        to[2] = sine * body->velocity[0] + cosine * body->velocity[1];
    }
}

/* A character some time later: its walk, what plays, and the features of its pose, which are those of what plays, or at rest. `mean` is
 * the pose of rest. */
static inline void cdbm_move_on(const cdbm_ways *ways, const cdbm_controller *controller, const double *mean, const double *before,
    const double *played, const cdbo_goal *goal, const cdbo_body *body, double dt_s, double *walk, cdbm_moved *moved, double *pose)
{
    cdbm_walk_on(ways, before, goal, body, dt_s, walk);
    cdbm_move(controller, played, dt_s, moved);
    if (moved->to.database < 0.0) cdbm_rest_pose(ways, walk, mean, pose);
    else cdbm_features(controller->databases[(size_t)moved->to.database].frames, (int64_t)moved->to.frame, pose);
}

/* ---- what a character knows of itself, for its tables */

/* Where a stick points against the way a body faces: degrees, positive to the left; 0 at rest. */
static inline double cdbm_direction(const double *stick, double heading)
{
    if (stick[0] == 0.0 && stick[1] == 0.0) return 0.0;
    return cdbo_remainder(cdbo_atan2(stick[0], stick[1]) - heading) * (180.0 / CDBO_PI);
}

/* How fast the body goes, m/s; where the stick points; and how fast the body turns, degrees a second. */
static inline double cdbm_own_fact(const cdbm_walk *walk, const cdbo_goal *goal, char letter)
{
    if (letter == 's') return cdbo_flat_length(walk->body.velocity[0], walk->body.velocity[1]);
    return letter == 'd' ? cdbm_direction(goal->velocity, walk->body.heading) : walk->body.turn_rate * (180.0 / CDBO_PI);
}
