/* ---- One-offs for Python: see nodes.h. */

/* warp(times, path, windows, target, knots, own, places, shares): how many knots a path has, into arrays for four more than it has frames;
 * the path is unwrapped. */
static PyObject *cdbp_warp(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    cdbm_warped to;
    const double *times_s, *windows, *target;
    double *path;
    size_t s[3], n_frames = 0, n_knots = 0;
    int is_done = 0;
    (void)module;
    a.n = 0;
    memset(&to, 0, sizeof to);
    if (n == 8 && (times_s = cdbp_numbers(&a, in[0], s, 1, CDBP_ANY, 0, 0)) && (n_frames = s[0]) > 0
        && ((n_knots = cdbm_most_knots(n_frames)), (path = cdbp_to_numbers(&a, in[1], s, 2, n_frames, 3, 0)))
        && (windows = cdbp_numbers(&a, in[2], s, 2, 2, 2, 0)) && (target = cdbp_numbers(&a, in[3], s, 1, 3, 0, 0))
        && (to.times_s = cdbp_to_numbers(&a, in[4], s, 1, n_knots, 0, 0)) && (to.own = cdbp_to_numbers(&a, in[5], s, 2, n_knots, 3, 0))
        && (to.places = cdbp_to_numbers(&a, in[6], s, 2, n_knots, 3, 0)) && (to.shares = cdbp_to_numbers(&a, in[7], s, 2, n_knots, 2, 0))) {
        cdbm_warp(times_s, path, n_frames, (const cdbm_window *)windows, (const cdbm_target *)target, &to);
        is_done = 1;
    }
    cdbp_release(&a);
    if (is_done) return PyLong_FromLongLong((long long)to.n);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "warp takes times, a path, windows, a target, and four arrays");
    return NULL;
}

/* row_at(times, rows, time, to): the numbers of rows [K, n] between two of their times. */
static PyObject *cdbp_row_at(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const double *times_s, *rows;
    double *to, time_s = 0.0;
    size_t s[3], n_rows = 0, width = 0;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 4 && cdbp_float_of(in[2], &time_s) && (times_s = cdbp_numbers(&a, in[0], s, 1, CDBP_ANY, 0, 0)) && (n_rows = s[0]) > 0
        && (rows = cdbp_numbers(&a, in[1], s, 2, n_rows, CDBP_ANY, 0)) && ((width = s[1]), (to = cdbp_to_numbers(&a, in[3], s, 1, width, 0, 0)))) {
        cdbm_between_knots(times_s, rows, n_rows, width, time_s, to);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "row_at takes times, rows, a time and an array");
}

/* aim(ends, target, weights, distances, rotations) */
static PyObject *cdbp_aim(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const double *ends, *target, *weights;
    double *distances, *rotations;
    size_t s[3], n_frames = 0;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 5 && (ends = cdbp_numbers(&a, in[0], s, 2, CDBP_ANY, 3, 0)) && ((n_frames = s[0]), 1)
        && (target = cdbp_numbers(&a, in[1], s, 1, 3, 0, 0)) && (weights = cdbp_numbers(&a, in[2], s, 1, 2, 0, 0))
        && (distances = cdbp_to_numbers(&a, in[3], s, 1, n_frames, 0, 0)) && (rotations = cdbp_to_numbers(&a, in[4], s, 1, n_frames, 0, 0))) {
        cdbm_aim(ends, n_frames, (const cdbm_target *)target, weights, distances, rotations);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "aim takes ends, a target, two weights and two arrays");
}

/* The six numbers of two movements over the ground. */
static int cdbp_two_motions(PyObject *const *in, Py_ssize_t n, double *numbers)
{
    Py_ssize_t i;
    for (i = 0; n == 6 && i < 6; i++)
        if (!cdbp_float_of(in[i], &numbers[i])) return 0;
    if (n != 6) PyErr_SetString(PyExc_TypeError, "two movements are six numbers");
    return n == 6;
}

/* until_down_s(contacts, foot, is_looping, rate, at_s): see played.h. */
static PyObject *cdbp_until_down_s(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const uint8_t *contacts;
    double rate, at_s, until_s = -1.0;
    int64_t foot;
    size_t s[3];
    (void)module;
    a.n = 0;
    if (n == 5 && (contacts = (const uint8_t *)cdbp_shaped(&a, in[0], 'b', 1, 0, s, 2, CDBP_ANY, CDBP_ANY, 0)) && cdbp_int_of(in[1], &foot)
        && cdbp_float_of(in[3], &rate) && cdbp_float_of(in[4], &at_s) && s[0] > 0 && foot >= 0)
        until_s = cdbm_until_down_s(contacts, s[0], s[1], (size_t)foot, in[2] == Py_True, rate, at_s);
    cdbp_release(&a);
    if (until_s >= 0.0) return PyFloat_FromDouble(until_s);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "until_down_s takes the contacts of a clip, a foot and two numbers");
    return NULL;
}

/* going(path, rate, at_s): how fast a clip goes, m/s, and turns, degrees a second. */
static PyObject *cdbp_going(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const float *path;
    double rate, at_s, speed, turn;
    size_t s[3];
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 3 && (path = (const float *)cdbp_shaped(&a, in[0], 'f', 4, 0, s, 2, CDBP_ANY, 3, 0)) && cdbp_float_of(in[1], &rate)
        && cdbp_float_of(in[2], &at_s) && s[0] > 0 && rate > 0.0) is_done = 1, cdbm_going(path, s[0], rate, at_s, &speed, &turn);
    cdbp_release(&a);
    if (is_done) return Py_BuildValue("dd", speed, turn);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "going takes the path of a clip and two numbers");
    return NULL;
}

/* phase(n_frames, rate, at_s): the share of a clip that has played. */
static PyObject *cdbp_phase(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    int64_t n_frames;
    double rate, at_s;
    (void)module;
    if (n == 3 && cdbp_int_of(in[0], &n_frames) && cdbp_float_of(in[1], &rate) && cdbp_float_of(in[2], &at_s) && n_frames > 0)
        return PyFloat_FromDouble(cdbm_phase((size_t)n_frames, rate, at_s));
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "phase takes three numbers");
    return NULL;
}

/* motion_then(left, ahead, turn, left, ahead, turn): a movement over the ground, and another one after it. */
static PyObject *cdbp_motion_then(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    double two[6], to[3];
    (void)module;
    if (!cdbp_two_motions(in, n, two)) return NULL;
    cdbm_then(two, two + 3, to);
    return Py_BuildValue("(ddd)", to[0], to[1], to[2]);
}

/* motion_from(left, ahead, turn, left, ahead, turn): the movement that leads from one place to another. */
static PyObject *cdbp_motion_from(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    double two[6], to[2];
    (void)module;
    if (!cdbp_two_motions(in, n, two)) return NULL;
    cdbm_seen(two[3] - two[0], two[4] - two[1], two[2], to);
    return Py_BuildValue("(ddd)", to[0], to[1], two[5] - two[2]);
}

#define CDBP_NODE_FUNCTIONS \
    {"warp", CDBP_CALL(cdbp_warp), METH_FASTCALL, "Write a path that is warped to a target."}, \
    {"row_at", CDBP_CALL(cdbp_row_at), METH_FASTCALL, "Write the row between two times."}, \
    {"aim", CDBP_CALL(cdbp_aim), METH_FASTCALL, "Write what a target adds to the costs of frames."}, \
    {"until_down_s", CDBP_CALL(cdbp_until_down_s), METH_FASTCALL, "Seconds until a foot is down."}, \
    {"going", CDBP_CALL(cdbp_going), METH_FASTCALL, "How fast a clip goes and turns."}, \
    {"phase", CDBP_CALL(cdbp_phase), METH_FASTCALL, "The share of a clip that has played."}, \
    {"motion_then", CDBP_CALL(cdbp_motion_then), METH_FASTCALL, "A movement, and another one after it."}, \
    {"motion_from", CDBP_CALL(cdbp_motion_from), METH_FASTCALL, "The movement from one place to another."},
