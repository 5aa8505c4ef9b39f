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

/* What an update of some characters begins with. */
typedef struct cdbp_onward {
    size_t n;
    double dt_s;
    const double *before, *rows, *poses;
    const cdbo_goal *goals;
    double goal[3];        /* that of one */
    const cdbo_body *bodies;
    double *after, *queries, *places;
    cdbm_moved *moved;
} cdbp_onward;

/* The goals of an array, or that of one in a tuple. */
static const cdbo_goal *cdbp_take_goals(cdbp_arrays *a, PyObject *given, size_t n, double *one)
{
    size_t s[3];
    if (!PyType_IsSubtype(Py_TYPE(given), &PyTuple_Type)) return (const cdbo_goal *)cdbp_numbers(a, given, s, 2, n, 3, 0);
    return n == 1 && PyArg_ParseTuple(given, "ddd", one, one + 1, one + 2) ? (const cdbo_goal *)(void *)one : NULL;
}

static int cdbp_take_onward(const cdbm_ways *ways, const cdbm_controller *controller, cdbp_arrays *a, PyObject *const *in, cdbp_onward *to)
{
    size_t s[3], n = CDBP_ANY;
    memset(to, 0, sizeof *to);
    to->dt_s = PyFloat_AsDouble(in[3]);
    if (PyErr_Occurred() || !(to->before = cdbp_walks(ways, a, in[0], 0, &n))) return 0;
    to->n = n;
    return (to->goals = cdbp_take_goals(a, in[1], n, to->goal)) != NULL
        && (in[2] == Py_None || (to->bodies = (const cdbo_body *)cdbp_numbers(a, in[2], s, 2, n, 10, 0)))
        && (to->rows = cdbp_numbers(a, in[4], s, 2, n, cdbm_width(controller), 0)) && cdbp_are_rows(controller, to->rows, n)
        && (in[5] == Py_None || (to->poses = cdbp_numbers(a, in[5], s, 2, n, ways->n_features, 0)))
        && (to->after = cdbp_walks(ways, a, in[6], 1, &n))
        && (to->moved = (cdbm_moved *)cdbp_to_numbers(a, in[7], s, 2, n, sizeof *to->moved / sizeof(double), 0))
        && (to->queries = cdbp_to_numbers(a, in[8], s, 2, n, ways->n_features, 0))
        && (to->places = cdbp_to_numbers(a, in[9], s, 2, n, 3, 0));
}

/* One of them: `room` has numbers for its path and three times its features. */
static void cdbp_go_onward(const cdbm_ways *ways, const cdbm_controller *controller, const double *mean, const cdbp_onward *to, size_t i,
    double *room)
{
    size_t n_features = ways->n_features, width = cdbm_walk_width(ways), n_frames;
    const cdbo_goal *goal = &to->goals[i];
    const cdbo_body *body = to->bodies && to->bodies[i].heading == to->bodies[i].heading ? &to->bodies[i] : NULL;
    double *walk = to->after + i * width, *pose = room, *positions, *headings, *lengths;
    const cdbm_walk *now = (const cdbm_walk *)(const void *)walk;
    float *narrow;
    cdbm_move_on(ways, controller, mean, to->before + i * width, to->rows + i * cdbm_width(controller), goal, body, to->dt_s, walk, &to->moved[i], pose);
    if (to->poses && to->poses[i * n_features] == to->poses[i * n_features]) memcpy(pose, to->poses + i * n_features, n_features * sizeof *pose);
    n_frames = cdbm_n_wished(ways, walk, goal);
    positions = pose + n_features, headings = positions + 2 * n_frames, lengths = headings + n_frames;
    narrow = (float *)(void *)(lengths + n_frames);
    cdbm_wish(ways, walk, goal, ways->rate, n_frames, positions, headings);
    cdbm_ask_path(ways, pose, ways->rate, n_frames, positions, headings, lengths, narrow, to->queries + i * n_features);
    to->places[3 * i] = now->body.position[0], to->places[3 * i + 1] = now->body.position[1], to->places[3 * i + 2] = now->body.heading;
}

/* What each knows of itself: (speed, direction of its stick, turn). */
static PyObject *cdbp_own_facts(const cdbm_ways *ways, const cdbp_onward *to)
{
    PyObject *facts = PyTuple_New((Py_ssize_t)to->n);
    size_t i;
    for (i = 0; facts && i < to->n; i++) {
        const cdbm_walk *now = (const cdbm_walk *)(const void *)(to->after + i * cdbm_walk_width(ways));
        const cdbo_goal *goal = &to->goals[i];
        PyObject *own = Py_BuildValue("(ddd)", cdbm_own_fact(now, goal, 's'), cdbm_own_fact(now, goal, 'd'), cdbm_own_fact(now, goal, 't'));
        if (own) PyTuple_SetItem(facts, (Py_ssize_t)i, own);
        else cdbp_clear(&facts);
    }
    return facts;
}

/* ways.go_on(controllers, walks, goals, bodies or None, seconds, rows, poses or None, after, moved, queries, places): characters some
 * time later, what they play, and the queries that ask for the paths that they wish to take; where their bodies are. Gives of each its
 * speed, the direction of its stick, and its turn. The goals are an array, or that of one a tuple; a body that is NaN follows its goal, a
 * pose that is NaN is that of what plays. */
static PyObject *cdbp_ways_go_on(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_ways *ways = cdbp_made_ways(self);
    const cdbm_controller *controller = NULL;
    cdbp_arrays a;
    cdbp_onward to;
    double *room = NULL, *mean;
    PyObject *facts = NULL;
    size_t d, i;
    a.n = 0;
    if (ways && n == 11 && cdbp_is_freed_by(Py_TYPE(in[0]), cdbp_controller_free) && ((cdbp_controller *)in[0])->is_made)
        controller = &((cdbp_controller *)in[0])->controller;
    if (controller && cdbp_take_onward(ways, controller, &a, in + 1, &to)
        && (controller->n_features == 0 || controller->n_features == ways->n_features)) {
        room = (double *)PyMem_Malloc((4 * cdbm_most_frames(ways) + 3 * ways->n_features + 1) * sizeof(double));
    }
    if (room) {
        mean = room, memset(mean, 0, ways->n_features * sizeof *mean);
        for (d = controller->n_databases; d-- > 0;)
            if (controller->databases[d].frames) memcpy(mean, controller->databases[d].frames->offset, ways->n_features * sizeof *mean);
        for (i = 0; i < to.n; i++) cdbp_go_onward(ways, controller, mean, &to, i, room + ways->n_features);
        PyMem_Free(room);
        facts = cdbp_own_facts(ways, &to);
    }
    if (!facts) return cdbp_given_back(&a, 0, "go_on takes controllers of the same features, walks, goals, bodies, seconds, rows, poses and arrays");
    cdbp_release(&a);
    return facts;
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

/* ways.settle(walks, roots, moves_body): poses are displayed at roots; and whether the clip moved the body of each. */
static PyObject *cdbp_ways_settle(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_ways *ways = cdbp_made_ways(self);
    cdbp_arrays a;
    double *rows = NULL;
    const double *roots;
    const uint8_t *moves_body;
    size_t s[3], n_rows = CDBP_ANY, i;
    int is_done = 0;
    a.n = 0;
    if (ways && n == 3 && (rows = cdbp_walks(ways, &a, in[0], 1, &n_rows)) && (roots = cdbp_numbers(&a, in[1], s, 2, n_rows, 3, 0))
        && (moves_body = (const uint8_t *)cdbp_shaped(&a, in[2], 'b', 1, 0, s, 1, n_rows, 0, 0))) {
        for (i = 0; i < n_rows; i++) cdbm_settle(rows + i * cdbm_walk_width(ways), roots + 3 * i, moves_body[i]);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "settle takes walks, roots and a flag for each");
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
    {"go_on", CDBP_CALL(cdbp_ways_go_on), METH_FASTCALL, "Write walks as they are some time later, and queries."},
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
