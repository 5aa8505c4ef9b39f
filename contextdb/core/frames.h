/* ---- A bank of poses: the frames of clips, one range each, and what a moment between two frames is.
 *
 * J joints, M of them with positions of their own, F feet. Rotations are of each joint against its parent. */

typedef struct cdbo_frames {
    const float *rotations;      /* [n_frames, J, 4] */
    const float *positions;      /* [n_frames, M, 3] */
    const float *root;           /* [n_frames, 3]: x, z and heading */
    const double *ways;          /* [n_frames, 6]: root; speed to the left and ahead of its mean facing, and its turn from that */
    const unsigned char *contacts; /* [n_frames, F]: which feet are down */
    const double *steps;         /* [n_frames, F, 3]: share of the swing, where the foot comes down; NULL: no ground is felt */
    const int64_t *starts, *n_steps; /* [n_ranges]: the first frame, and the steps from there to the last */
    const unsigned char *looping; /* [n_ranges] */
    size_t n_frames, n_ranges, n_joints, n_moving, n_feet;
    double rate; /* frames a second */
} cdbo_frames;

/* The two frames about a moment, and the share of the second. */
typedef struct cdbo_between {
    size_t low, high;
    double share;
} cdbo_between;

/* Whether all ranges lie within the frames. */
static inline int cdbo_are_frames(const cdbo_frames *of)
{
    size_t i;
    for (i = 0; i < of->n_ranges; i++)
        if (of->starts[i] < 0 || of->n_steps[i] < 0 || (uint64_t)of->starts[i] >= of->n_frames ||
            (uint64_t)of->n_steps[i] >= of->n_frames - (uint64_t)of->starts[i])
            return 0;
    return of->rate > 0.0 && of->rate <= DBL_MAX;
}

/* The frames about a second of a range: its first before it begins, its last behind its end; a loop goes on. */
static inline cdbo_between cdbo_frames_at(const cdbo_frames *of, size_t range, double at_s)
{
    double frame = at_s * of->rate, n_steps = (double)of->n_steps[range], rest;
    size_t start = (size_t)of->starts[range], last = (size_t)of->n_steps[range], low;
    cdbo_between between;
    if (of->looping[range] && last > 0 && !(frame >= 0.0 && frame <= n_steps)) {
        rest = cdbo_rest(cdbo_size(frame), n_steps);
        frame = frame < 0.0 && rest > 0.0 ? n_steps - rest : rest;
    }
    if (!(frame > 0.0)) frame = 0.0;
    frame = cdbo_least(frame, n_steps);
    low = (size_t)frame;
    if (low >= last) low = last > 0 ? last - 1 : 0;
    between.low = start + low;
    between.high = start + (low < last ? low + 1 : last);
    between.share = frame - (double)low;
    return between;
}

static inline cdbo_quaternion cdbo_float4(const float *rows, size_t j)
{
    return cdbo_wxyz((double)rows[4 * j], (double)rows[4 * j + 1], (double)rows[4 * j + 2], (double)rows[4 * j + 3]);
}

static inline cdbo_vector cdbo_float3(const float *rows, size_t j)
{
    return cdbo_xyz((double)rows[3 * j], (double)rows[3 * j + 1], (double)rows[3 * j + 2]);
}

/* The pose between two frames: rotations [J, 4] on the shorter way, positions [M, 3] on the straight line. */
static inline void cdbo_sample(const cdbo_frames *of, cdbo_between at, double *rotations, double *positions)
{
    const float *first = of->rotations + 4 * of->n_joints * at.low, *second = of->rotations + 4 * of->n_joints * at.high;
    const float *from = of->positions + 3 * of->n_moving * at.low, *to = of->positions + 3 * of->n_moving * at.high;
    double one = 1.0 - at.share;
    size_t j;
    for (j = 0; j < of->n_joints; j++) {
        cdbo_quaternion a = cdbo_float4(first, j), b = cdbo_float4(second, j);
        double dot = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z, two = dot < 0.0 ? -at.share : at.share;
        double w = one * a.w + two * b.w, x = one * a.x + two * b.x, y = one * a.y + two * b.y, z = one * a.z + two * b.z;
        double size = sqrt(w * w + x * x + y * y + z * z);
        cdbo_set4(rotations, j, cdbo_wxyz(w / size, x / size, y / size, z / size));
    }
    for (j = 0; j < 3 * of->n_moving; j++) positions[j] = one * (double)from[j] + at.share * (double)to[j];
}

/* How fast the joints turn (in their parents' frames) and move from one frame to the next: [J, 3] and [M, 3]. */
static inline void cdbo_slopes(const cdbo_frames *of, cdbo_between at, double *spins, double *velocities)
{
    const float *first = of->rotations + 4 * of->n_joints * at.low, *second = of->rotations + 4 * of->n_joints * at.high;
    const float *from = of->positions + 3 * of->n_moving * at.low, *to = of->positions + 3 * of->n_moving * at.high;
    size_t j;
    for (j = 0; j < of->n_joints; j++)
        cdbo_set3(spins, j, cdbo_times(of->rate, cdbo_turn(cdbo_then(cdbo_float4(second, j), cdbo_back(cdbo_float4(first, j))))));
    for (j = 0; j < 3 * of->n_moving; j++) velocities[j] = of->rate * ((double)to[j] - (double)from[j]);
}

/* How fast the body moves between two frames: to its left and ahead, and its turning. */
static inline cdbo_vector cdbo_root_velocity(const cdbo_frames *of, cdbo_between at)
{
    cdbo_vector from = cdbo_float3(of->root, at.low), to = cdbo_float3(of->root, at.high);
    double x = (to.x - from.x) * of->rate, z = (to.y - from.y) * of->rate, turn = to.z - from.z, sine, cosine;
    cdbo_sin_cos(from.z + at.share * turn, &sine, &cosine);
    return cdbo_xyz(cosine * x - sine * z, sine * x + cosine * z, turn * of->rate);
}
