/* ---- Walks for Python: see walk.h. */

typedef struct cdbp_ways {
    PyObject ob_base;
    cdbm_ways ways;
    cdbp_arrays arrays;
    int is_made;
} cdbp_ways;

/* Ways(steps, features, velocities, n_features, rate) */
static int cdbp_ways_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_ways *own = (cdbp_ways *)self;
    cdbm_ways *ways = &own->ways;
    PyObject *in[3];
    long long n_features;
    size_t s[3];
    (void)named;
    if (own->is_made || own->arrays.n > 0) {
        PyErr_SetString(PyExc_TypeError, "Ways are made once");
        return -1;
    }
    if (!PyArg_ParseTuple(arguments, "OOOLd", &in[0], &in[1], &in[2], &n_features, &ways->rate)) return -1;
    if (!(ways->steps = cdbp_numbers(&own->arrays, in[0], s, 1, CDBP_ANY, 0, 0))) return -1;
    ways->n_points = s[0];
    if (!(ways->features = (const cdbo_path_feature *)cdbp_int64s(&own->arrays, in[1], s, 2, ways->n_points, 3))) return -1;
    if (!(ways->velocities = cdbp_int64s(&own->arrays, in[2], s, 1, CDBP_ANY, 0))) return -1;
    ways->n_velocities = s[0], ways->n_features = (size_t)n_features;
    own->is_made = n_features >= 0 && cdbm_open_ways(ways);
    if (!own->is_made) PyErr_SetString(PyExc_ValueError, "a feature of a path is not among the features, or the rate is not above 0");
    return own->is_made ? 0 : -1;
}

static void cdbp_ways_free(PyObject *self)
{
    cdbp_release(&((cdbp_ways *)self)->arrays);
    cdbp_free(self);
}

static const cdbm_ways *cdbp_made_ways(PyObject *self)
{
    if (((cdbp_ways *)self)->is_made) return &((cdbp_ways *)self)->ways;
    PyErr_SetString(PyExc_ValueError, "the ways were not made");
    return NULL;
}

/* The walks of an array, in which nothing points elsewhere. */
static double *cdbp_walks(const cdbm_ways *ways, cdbp_arrays *a, PyObject *array, int is_written, size_t *n)
{
    size_t s[3], width = cdbm_walk_width(ways), i;
    double *rows = (double *)cdbp_shaped(a, array, 'f', sizeof(double), is_written, s, 2, *n, width, 0);
    if (!rows) return NULL;
    *n = s[0];
    for (i = 0; !is_written && i < *n; i++) {
        double n_trail = ((const cdbm_walk *)(const void *)(rows + i * width))->n_trail;
        if (!(n_trail >= 0.0 && n_trail <= (double)ways->n_trail)) return NULL;
    }
    return rows;
}

/* ways.move(before, goals, bodies or None, seconds, after): each some time later; a body that is NaN follows its goal. */
static PyObject *cdbp_ways_move(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_ways *ways = cdbp_made_ways(self);
    cdbp_arrays a;
    const double *before = NULL;
    const cdbo_goal *goals;
    const cdbo_body *bodies = NULL;
    double *after, dt_s = ways && n == 5 ? PyFloat_AsDouble(in[3]) : 0.0;
    size_t s[3], n_rows = CDBP_ANY, width = ways ? cdbm_walk_width(ways) : 0, i;
    int is_done = 0;
    a.n = 0;
    if (ways && n == 5 && !PyErr_Occurred() && (before = cdbp_walks(ways, &a, in[0], 0, &n_rows))
        && (goals = (const cdbo_goal *)cdbp_numbers(&a, in[1], s, 2, n_rows, 3, 0))
        && (in[2] == Py_None || (bodies = (const cdbo_body *)cdbp_numbers(&a, in[2], s, 2, n_rows, 10, 0)))
        && (after = cdbp_walks(ways, &a, in[4], 1, &n_rows))) {
        for (i = 0; i < n_rows; i++) {
            const cdbo_body *moved = bodies && bodies[i].heading == bodies[i].heading ? &bodies[i] : NULL;
            cdbm_walk_on(ways, before + i * width, &goals[i], moved, dt_s, after + i * width);
        }
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "move takes walks, goals, bodies, seconds and an array");
}

/* ways.n_frames(walks, goals): how many frames the longest of their paths has. */
static PyObject *cdbp_ways_n_frames(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_ways *ways = cdbp_made_ways(self);
    cdbp_arrays a;
    const double *rows = NULL;
    const cdbo_goal *goals = NULL;
    size_t s[3], n_rows = CDBP_ANY, most = 0, i;
    a.n = 0;
    if (ways && n == 2 && (rows = cdbp_walks(ways, &a, in[0], 0, &n_rows)))
        goals = (const cdbo_goal *)cdbp_numbers(&a, in[1], s, 2, n_rows, 3, 0);
    for (i = 0; goals && i < n_rows; i++) {
        size_t own = cdbm_n_wished(ways, rows + i * cdbm_walk_width(ways), &goals[i]);
        if (own > most) most = own;
    }
    if (!goals) return cdbp_given_back(&a, 0, "n_frames takes walks and goals");
    cdbp_release(&a);
    return PyLong_FromLongLong((long long)most);
}

/* ways.ask(walks, goals or None, rate, poses, positions, headings, queries): the path that each wishes to take, and the query that asks
 * for it. Without goals the frames from now on are there. */
static PyObject *cdbp_ways_ask(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_ways *ways = cdbp_made_ways(self);
    cdbp_arrays a;
    const double *rows = NULL, *poses;
    const cdbo_goal *goals = NULL;
    double *positions, *headings, *queries, *room = NULL, rate = ways && n == 7 ? PyFloat_AsDouble(in[2]) : 0.0;
    size_t s[3], n_rows = CDBP_ANY, n_frames = 0, i;
    int is_done = 0;
    a.n = 0;
    if (ways && n == 7 && !PyErr_Occurred() && rate > 0.0 && (rows = cdbp_walks(ways, &a, in[0], 0, &n_rows))
        && (in[1] == Py_None || (goals = (const cdbo_goal *)cdbp_numbers(&a, in[1], s, 2, n_rows, 3, 0)))
        && (poses = cdbp_numbers(&a, in[3], s, 2, n_rows, ways->n_features, 0))
        && (headings = cdbp_to_numbers(&a, in[5], s, 2, n_rows, CDBP_ANY, 0)) && ((n_frames = s[1]), 1)
        && (positions = cdbp_to_numbers(&a, in[4], s, 3, n_rows, n_frames, 2))
        && (queries = cdbp_to_numbers(&a, in[6], s, 2, n_rows, ways->n_features, 0)) && n_frames > cdbm_n_behind(ways, rate)
        && (room = (double *)PyMem_Malloc((n_frames + ways->n_features) * sizeof(double)))) {
        is_done = 1;
        for (i = 0; i < n_rows; i++) {
            const double *row = rows + i * cdbm_walk_width(ways);
            size_t own = goals ? cdbm_n_wished(ways, row, &goals[i]) : n_frames;
            if (own > n_frames) own = n_frames;
            cdbm_wish(ways, row, goals ? &goals[i] : NULL, rate, n_frames, positions + 2 * n_frames * i, headings + n_frames * i);
            cdbm_ask_path(ways, poses + ways->n_features * i, rate, own, positions + 2 * n_frames * i, headings + n_frames * i, room,
                (float *)(void *)(room + n_frames), queries + ways->n_features * i);
        }
        PyMem_Free(room);
    }
    return cdbp_given_back(&a, is_done, "ask takes walks, goals, a rate, poses and arrays that hold the present");
}

/* ways.rest(walks, mean, poses): the poses of characters that play nothing. */
static PyObject *cdbp_ways_rest(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_ways *ways = cdbp_made_ways(self);
    cdbp_arrays a;
    const double *rows = NULL, *mean;
    double *poses;
    size_t s[3], n_rows = CDBP_ANY, i;
    int is_done = 0;
    a.n = 0;
    if (ways && n == 3 && (rows = cdbp_walks(ways, &a, in[0], 0, &n_rows))
        && (mean = cdbp_numbers(&a, in[1], s, 1, ways->n_features, 0, 0))
        && (poses = cdbp_to_numbers(&a, in[2], s, 2, n_rows, ways->n_features, 0))) {
        for (i = 0; i < n_rows; i++) cdbm_rest_pose(ways, rows + i * cdbm_walk_width(ways), mean, poses + i * ways->n_features);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "rest takes walks, a pose and an array");
}

/* ways.settle(walks, roots, moves_body): poses are displayed at roots; NaN for none. */
static PyObject *cdbp_ways_settle(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_ways *ways = cdbp_made_ways(self);
    cdbp_arrays a;
    double *rows = NULL;
    const double *roots;
    int64_t moves_body = 0;
    size_t s[3], n_rows = CDBP_ANY, i;
    int is_done = 0;
    a.n = 0;
    if (ways && n == 3 && cdbp_int_of(in[2], &moves_body) && (rows = cdbp_walks(ways, &a, in[0], 1, &n_rows))
        && (roots = cdbp_numbers(&a, in[1], s, 2, n_rows, 3, 0))) {
        for (i = 0; i < n_rows; i++) cdbm_settle(rows + i * cdbm_walk_width(ways), roots + 3 * i, moves_body != 0);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "settle takes walks, roots and a number");
}

static PyObject *cdbp_ways_width(PyObject *self, void *unused)
{
    (void)unused;
    return PyLong_FromLongLong((long long)cdbm_walk_width(&((cdbp_ways *)self)->ways));
}

static PyObject *cdbp_ways_n_behind(PyObject *self, PyObject *rate)
{
    const cdbm_ways *ways = cdbp_made_ways(self);
    double hertz = PyFloat_AsDouble(rate);
    if (!ways || PyErr_Occurred()) return NULL;
    return PyLong_FromLongLong((long long)cdbm_n_behind(ways, hertz));
}

/* direction_of(x, z, heading): where a stick points against the way a body faces, degrees. */
static PyObject *cdbp_direction_of(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    double numbers[3] = {0.0, 0.0, 0.0};
    Py_ssize_t i;
    (void)module;
    for (i = 0; i < n && i < 3; i++)
        if (!cdbp_float_of(in[i], &numbers[i])) return NULL;
    return PyFloat_FromDouble(cdbm_direction(numbers, numbers[2]));
}

static PyMethodDef cdbp_ways_methods[] = {
    {"move", CDBP_CALL(cdbp_ways_move), METH_FASTCALL, "Write walks as they are some time later."},
    {"n_frames", CDBP_CALL(cdbp_ways_n_frames), METH_FASTCALL, "How many frames the longest path has."},
    {"n_behind", cdbp_ways_n_behind, METH_O, "How many frames of a path lie behind now."},
    {"ask", CDBP_CALL(cdbp_ways_ask), METH_FASTCALL, "Write the paths that are wished for, and queries."},
    {"rest", CDBP_CALL(cdbp_ways_rest), METH_FASTCALL, "Write the poses of characters that play nothing."},
    {"settle", CDBP_CALL(cdbp_ways_settle), METH_FASTCALL, "Put walks where poses are displayed."},
    {NULL, NULL, 0, NULL},
};
static PyGetSetDef cdbp_ways_members[] = {
    {"width", cdbp_ways_width, NULL, "How many numbers a walk has.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};
static PyType_Slot cdbp_ways_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_ways_init)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_ways_free)},
    {Py_tp_methods, cdbp_ways_methods},
    {Py_tp_getset, cdbp_ways_members},
    {0, NULL},
};
static PyType_Spec cdbp_ways_spec = {"contextdb.core._core.Ways", (int)sizeof(cdbp_ways), 0, Py_TPFLAGS_DEFAULT, cdbp_ways_slots};

#define CDBP_WALK_FUNCTIONS \
    {"direction_of", CDBP_CALL(cdbp_direction_of), METH_FASTCALL, "Where a stick points against the way a body faces."},
