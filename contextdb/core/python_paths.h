/* ---- Paths for Python: bodies that follow sticks, and what queries say of their paths. */

/* move_bodies(bodies, goals, seconds, moved): each body some time later. */
static PyObject *cdbp_move_bodies(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const cdbo_body *bodies;
    const cdbo_goal *goals;
    cdbo_body *moved;
    double dt_s = n == 4 ? PyFloat_AsDouble(in[2]) : 0.0;
    size_t s[3], n_bodies = 0, i;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 4 && !PyErr_Occurred() && (bodies = (const cdbo_body *)cdbp_numbers(&a, in[0], s, 2, CDBP_ANY, 10, 0))
        && ((n_bodies = s[0]), 1)
        && (goals = (const cdbo_goal *)cdbp_numbers(&a, in[1], s, 2, n_bodies, 3, 0))
        && (moved = (cdbo_body *)cdbp_to_numbers(&a, in[3], s, 2, n_bodies, 10, 0))) {
        for (i = 0; i < n_bodies; i++) cdbo_move(&bodies[i], &goals[i], dt_s, &moved[i]);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "move_bodies takes three arrays, and seconds");
}

/* steer_paths(bodies, goals, rate, n_past, positions, headings): the frames of each path behind its first, which are there
 * already. */
static PyObject *cdbp_steer_paths(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const cdbo_body *bodies;
    const cdbo_goal *goals;
    double *positions, *headings, rate = n == 6 ? PyFloat_AsDouble(in[2]) : 0.0;
    long long n_past = n == 6 && !PyErr_Occurred() ? PyLong_AsLongLong(in[3]) : -1;
    size_t s[3], n_bodies = 0, n_frames = 0, i;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n_past > 0 && (bodies = (const cdbo_body *)cdbp_numbers(&a, in[0], s, 2, CDBP_ANY, 10, 0)) && ((n_bodies = s[0]), 1)
        && (goals = (const cdbo_goal *)cdbp_numbers(&a, in[1], s, 2, n_bodies, 3, 0))
        && (headings = cdbp_to_numbers(&a, in[5], s, 2, n_bodies, CDBP_ANY, 0)) && ((n_frames = s[1]), 1)
        && (positions = cdbp_to_numbers(&a, in[4], s, 3, n_bodies, n_frames, 2))) {
        for (i = 0; i < n_bodies; i++)
            cdbo_steer(&bodies[i], &goals[i], rate, (size_t)n_past, n_frames, positions + 2 * n_frames * i,
                headings + n_frames * i);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "steer_paths takes four arrays, a rate, and a number of frames from 1");
}

/* write_paths(positions, headings, now, rate, steps, features, queries): what queries [Q, N] say of the paths [Q, F, 2] of their
 * bodies. */
static PyObject *cdbp_write_paths(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    cdbo_path path;
    const double *positions, *headings, *steps;
    const cdbo_path_feature *features;
    float *queries;
    double *lengths = NULL, rate = n == 7 ? PyFloat_AsDouble(in[3]) : 0.0;
    long long now = n == 7 && !PyErr_Occurred() ? PyLong_AsLongLong(in[2]) : -1;
    size_t s[3], n_paths = 0, n_frames = 0, n_points = 0, n_features = 0, i, k;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (now >= 0 && (headings = cdbp_numbers(&a, in[1], s, 2, CDBP_ANY, CDBP_ANY, 0)) && ((n_paths = s[0]), (n_frames = s[1]), 1)
        && (uint64_t)now < n_frames && (positions = cdbp_numbers(&a, in[0], s, 3, n_paths, n_frames, 2))
        && (steps = cdbp_numbers(&a, in[4], s, 1, CDBP_ANY, 0, 0)) && ((n_points = s[0]), 1)
        && (features = (const cdbo_path_feature *)cdbp_int64s(&a, in[5], s, 2, n_points, 3))
        && (queries = (float *)cdbp_shaped(&a, in[6], 'f', sizeof(float), 1, s, 2, n_paths, CDBP_ANY, 0))
        && ((n_features = s[1]), 1)
        && cdbo_are_features(features, n_points, n_features)
        && (lengths = (double *)PyMem_Malloc(n_frames * sizeof(double)))) {
        path.n_frames = n_frames, path.now = (size_t)now, path.rate = rate, path.lengths = lengths;
        for (i = 0; i < n_paths; i++) {
            path.positions = positions + 2 * n_frames * i, path.headings = headings + n_frames * i;
            cdbo_path_lengths(&path, lengths);
            for (k = 0; k < n_points; k++) cdbo_write_feature(&path, &features[k], steps[k], queries + n_features * i);
        }
        PyMem_Free(lengths);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "write_paths takes a frame and columns that are there, a rate, and five arrays");
}

#define CDBP_PATH_FUNCTIONS \
    {"move_bodies", CDBP_CALL(cdbp_move_bodies), METH_FASTCALL, "Write bodies as they are some time later."}, \
    {"steer_paths", CDBP_CALL(cdbp_steer_paths), METH_FASTCALL, "Write where bodies will be, frame by frame."}, \
    {"write_paths", CDBP_CALL(cdbp_write_paths), METH_FASTCALL, "Write what queries say of paths."},
