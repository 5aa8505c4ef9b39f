/* ---- Controllers for Python: the databases of a selector with the settings of controllers, and the updates of characters. */

typedef struct cdbp_controller {
    PyObject ob_base;
    cdbm_controller controller;
    cdbm_clips *databases;
    PyObject *parts;      /* the frames of the databases, which live as long */
    cdbp_arrays *arrays;  /* of each database */
    size_t n_ranges, n_kinds, n_frames, n_arrays;
    int is_made;
} cdbp_controller;

/* One database: (frames, starts, stops, assets, keys or None, looping, root or None, marks, root_weights, rate, threshold, bar, continuing, settle, permutations,
 * pace, n_pace, pace_s). */
static int cdbp_take_clips(cdbp_controller *own, PyObject *part, cdbm_clips *to, cdbp_arrays *a)
{
    PyObject *frames, *in[8];
    long long n_permutations, pace, n_pace;
    size_t s[3];
    if (!PyArg_ParseTuple(part, "OOOOOOOOOdddddLLLd", &frames, &in[0], &in[1], &in[2], &in[7], &in[3], &in[4], &in[5], &in[6], &to->rate,
        &to->threshold, &to->bar, &to->continuing, &to->settle, &n_permutations, &pace, &n_pace, &to->pace_s)) return -1;
    to->range_at = own->n_ranges, to->kind_at = own->n_kinds, to->frame_at = own->n_frames;
    if (frames == Py_None) return 0;
    if (!cdbp_is_freed_by(Py_TYPE(frames), cdbp_frames_free) || !((cdbp_frames *)frames)->is_made) {
        PyErr_SetString(PyExc_TypeError, "a database has no Frames");
        return -1;
    }
    to->frames = &((cdbp_frames *)frames)->frames;
    to->n_ranges = to->frames->n_ranges, to->n_permutations = (size_t)n_permutations, to->pace = (size_t)pace, to->n_pace = (size_t)n_pace;
    if (!(to->starts = cdbp_int64s(a, in[0], s, 1, to->n_ranges, 0)) || !(to->stops = cdbp_int64s(a, in[1], s, 1, to->n_ranges, 0)))
        return -1;
    if (!(to->assets = cdbp_int64s(a, in[2], s, 1, to->n_ranges, 0))) return -1;
    if (in[7] != Py_None && !(to->keys = cdbp_numbers(a, in[7], s, 1, to->n_ranges, 0, 0))) return -1;
    if (!(to->looping = (const uint8_t *)cdbp_shaped(a, in[3], 'b', 1, 0, s, 1, to->n_ranges, 0, 0))) return -1;
    if (in[4] != Py_None && !(to->root = (const float *)cdbp_shaped(a, in[4], 'f', 4, 0, s, 2, to->frames->n_frames, 3, 0))) return -1;
    if (!(to->marks = (const uint8_t *)cdbp_shaped(a, in[5], 'u', 1, 0, s, 1, CDBP_ANY, 0, 0))) return -1;
    to->n_kinds = s[0];
    if (!(to->root_weights = cdbp_numbers(a, in[6], s, 1, to->n_kinds, 0, 0))) return -1;
    own->n_ranges += to->n_ranges, own->n_kinds += to->n_kinds, own->n_frames += to->frames->n_frames;
    own->controller.n_features = to->frames->n_features;
    return 0;
}

/* Controllers(databases, n_played, search_every_s, jump_threshold_s, history_s, min_rate, max_rate, grace_s, settle_s, asset_history_s,
 * until_natural, varies, vary_within, n_recent) */
static int cdbp_controller_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_controller *own = (cdbp_controller *)self;
    cdbm_controller *to = &own->controller;
    PyObject *parts;
    long long n_played, n_recent;
    Py_ssize_t n, i;
    int is_right = 1;
    (void)named;
    if (own->parts || !PyArg_ParseTuple(arguments, "OLddddddddppdL", &parts, &n_played, &to->search_every_s, &to->jump_threshold_s,
        &to->history_s, &to->min_rate, &to->max_rate, &to->grace_s, &to->settle_s, &to->asset_history_s, &to->until_natural,
        &to->varies, &to->vary_within, &n_recent)) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_TypeError, "Controllers are made once");
        return -1;
    }
    n = PyTuple_Size(parts);
    if (n < 0) return -1;
    own->parts = cdbp_new_ref(parts);
    own->databases = (cdbm_clips *)PyMem_Calloc((size_t)n + 1, sizeof *own->databases);
    own->arrays = (cdbp_arrays *)PyMem_Calloc((size_t)n + 1, sizeof *own->arrays);
    if (!own->databases || !own->arrays) {
        PyErr_NoMemory();
        return -1;
    }
    to->databases = own->databases, to->n_databases = own->n_arrays = (size_t)n, to->n_played = (size_t)n_played, to->n_recent = (size_t)n_recent;
    for (i = 0; i < n; i++)
        if (cdbp_take_clips(own, PyTuple_GetItem(parts, i), &own->databases[i], &own->arrays[i]) != 0) return -1;
    for (i = 0; i < n; i++)
        is_right = is_right && (!to->databases[i].frames || (cdbm_are_clips(&to->databases[i], to->n_features) && (!n_recent || to->databases[i].keys)));
    own->is_made = is_right && n_played >= 0 && n_recent >= 0;
    if (!own->is_made) PyErr_SetString(PyExc_ValueError, "the parts of the databases do not go together");
    return own->is_made ? 0 : -1;
}

static void cdbp_controller_free(PyObject *self)
{
    cdbp_controller *own = (cdbp_controller *)self;
    size_t i;
    for (i = 0; own->arrays && i < own->n_arrays; i++) cdbp_release(&own->arrays[i]);
    PyMem_Free(own->arrays);
    PyMem_Free(own->databases);
    if (own->parts) Py_DecRef(own->parts);
    cdbp_free(self);
}

/* Whether rows are those of characters of these databases. */
static int cdbp_are_rows(const cdbm_controller *controller, const double *rows, size_t n)
{
    size_t i, width = cdbm_width(controller);
    for (i = 0; i < n; i++)
        if (!cdbm_is_row(controller, rows + i * width)) return 0;
    return 1;
}

/* controllers.move(rows, seconds, moved, poses or None): what plays, some time later; and the features of its frame. */
static PyObject *cdbp_controller_move(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbp_controller *own = (const cdbp_controller *)self;
    const cdbm_controller *controller = &own->controller;
    cdbp_arrays a;
    const double *rows;
    double *poses = NULL, dt_s = n == 4 ? PyFloat_AsDouble(in[1]) : 0.0;
    cdbm_moved *moved;
    size_t s[3], n_rows = 0, width = cdbm_width(controller), i;
    int is_done = 0;
    a.n = 0;
    if (own->is_made && n == 4 && !PyErr_Occurred() && (rows = cdbp_numbers(&a, in[0], s, 2, CDBP_ANY, width, 0)) && ((n_rows = s[0]), 1)
        && (moved = (cdbm_moved *)cdbp_to_numbers(&a, in[2], s, 2, n_rows, sizeof *moved / sizeof(double), 0))
        && (in[3] == Py_None || (poses = cdbp_to_numbers(&a, in[3], s, 2, n_rows, controller->n_features, 0)))
        && cdbp_are_rows(controller, rows, n_rows)) {
        for (i = 0; i < n_rows; i++) {
            cdbm_move(controller, rows + i * width, dt_s, &moved[i]);
            if (poses && moved[i].to.database >= 0.0)
                cdbm_features(controller->databases[(size_t)moved[i].to.database].frames, (int64_t)moved[i].to.frame,
                    poses + i * controller->n_features);
        }
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "move takes rows of these controllers, seconds, and arrays for what has moved");
}

typedef struct cdbp_update {   /* the arguments of an update */
    cdbm_given given;
    const double *before;
    double *after;
    cdbm_moved *moved;
    cdbm_decision *decisions;
    cdbm_found *found;
} cdbp_update;

/* A bool or float array with a row for each, or one for all; `step` is how far its rows are apart. */
static const void *cdbp_for_each(cdbp_arrays *a, PyObject *array, char kind, size_t size, size_t n, size_t width, size_t *step)
{
    size_t s[3];
    const void *items = cdbp_shaped(a, array, kind, size, 0, s, 2, CDBP_ANY, width, 0);
    if (items && s[0] != 1 && s[0] != n) {
        PyErr_SetString(PyExc_ValueError, "there is not one row for each character, or one for all");
        return NULL;
    }
    *step = items && s[0] == 1 ? 0 : width;
    return items;
}

/* How rows play and which of them each range has: both or none. */
static int cdbp_take_plays(const cdbp_controller *own, cdbp_arrays *a, PyObject *const *in, cdbm_given *given)
{
    size_t s[3], n_plays, i;
    if (in[0] == Py_None) return 0;
    if (!(given->plays = (const cdb_row_play *)cdbp_numbers(a, in[0], s, 2, CDBP_ANY, sizeof(cdb_row_play) / sizeof(double), 0))) return -1;
    n_plays = s[0];
    if (!(given->play_of = (const int64_t *)cdbp_for_each(a, in[1], 'i', 8, given->n, own->n_ranges, &given->plays_step))) return -1;
    for (i = 0; i < (given->plays_step ? given->n : 1) * own->n_ranges; i++)
        if (given->play_of[i] >= (int64_t)n_plays) {
            PyErr_SetString(PyExc_ValueError, "a range has no such row");
            return -1;
        }
    return 0;
}

/* before, moved, queries, seconds, ranges, range_biases, allowed, playable, kind_biases, flags, frame_biases, among, urgent, plays, play_of, wide,
 * to_event, event_s, after, decisions, found */
static int cdbp_take_given(const cdbp_controller *own, cdbp_arrays *a, PyObject *const *in, cdbp_update *to)
{
    const cdbm_controller *controller = &own->controller;
    cdbm_given *given = &to->given;
    size_t s[3], n, width = cdbm_width(controller), n_databases = controller->n_databases;
    memset(to, 0, sizeof *to);
    given->dt_s = PyFloat_AsDouble(in[3]);
    if (PyErr_Occurred() || !(to->before = cdbp_numbers(a, in[0], s, 2, CDBP_ANY, width, 0))) return -1;
    n = given->n = s[0];
    if (!(to->moved = (cdbm_moved *)cdbp_to_numbers(a, in[1], s, 2, n, sizeof(cdbm_moved) / sizeof(double), 0))) return -1;
    if (!(given->queries = cdbp_numbers(a, in[2], s, 2, n, controller->n_features, 0))) return -1;
    if (!(given->ranges = (const uint8_t *)cdbp_for_each(a, in[4], 'b', 1, n, own->n_ranges, &given->ranges_step))) return -1;
    if (!(given->range_biases = (const double *)cdbp_for_each(a, in[5], 'f', 8, n, own->n_ranges, &given->biases_step))) return -1;
    if (!(given->allowed = (const uint8_t *)cdbp_shaped(a, in[6], 'b', 1, 0, s, 1, own->n_kinds, 0, 0))) return -1;
    if (!(given->playable = (const uint8_t *)cdbp_shaped(a, in[7], 'b', 1, 0, s, 1, own->n_kinds, 0, 0))) return -1;
    if (!(given->kind_biases = cdbp_numbers(a, in[8], s, 1, own->n_kinds, 0, 0))) return -1;
    if (in[9] != Py_None && !(given->flags = (const uint8_t *)cdbp_shaped(a, in[9], 'b', 1, 0, s, 1, own->n_frames, 0, 0))) return -1;
    if (in[10] != Py_None && !(given->frame_biases = cdbp_numbers(a, in[10], s, 1, own->n_frames, 0, 0))) return -1;
    if (!(given->among = (const uint8_t *)cdbp_for_each(a, in[11], 'b', 1, n, n_databases, &given->among_step))) return -1;
    if (!(given->urgent = (const uint8_t *)cdbp_shaped(a, in[12], 'u', 1, 0, s, 1, n, 0, 0))) return -1;
    if (cdbp_take_plays(own, a, in + 13, given) != 0) return -1;
    if (in[15] != Py_None && !(given->wide = cdbp_numbers(a, in[15], s, 1, n, 0, 0))) return -1;
    if (in[16] != Py_None && !(given->to_event = cdbp_numbers(a, in[16], s, 1, own->n_frames, 0, 0))) return -1;
    given->event_s = PyFloat_AsDouble(in[17]);
    if (PyErr_Occurred()) return -1;
    if (!(to->after = cdbp_to_numbers(a, in[18], s, 2, n, width, 0))) return -1;
    if (!(to->decisions = (cdbm_decision *)cdbp_to_numbers(a, in[19], s, 2, n, sizeof(cdbm_decision) / sizeof(double), 0))) return -1;
    if (!(to->found = (cdbm_found *)cdbp_to_numbers(a, in[20], s, 3, n, n_databases, 3))) return -1;
    return 0;
}

static int cdbp_are_moved(const cdbm_controller *controller, const cdbp_update *to)
{
    size_t i;
    for (i = 0; i < to->given.n; i++) {
        const cdbm_moved *moved = &to->moved[i];
        if (!cdbm_is_playing(controller, &moved->to) || !(moved->n_spans >= 0.0 && moved->n_spans <= 3.0)) return 0;
    }
    return cdbp_are_rows(controller, to->before, to->given.n);
}

enum { CDBP_ASK = 1, CDBP_CHOOSE = 2, CDBP_DECIDE = 4 };

/* Whether what was chosen meanwhile is a frame of a database that is there. */
static int cdbp_are_chosen(const cdbm_controller *controller, const cdbp_update *to)
{
    size_t i;
    for (i = 0; i < to->given.n; i++) {
        cdbm_playing chosen = {0.0, 0.0, 0.0, 0.0};
        chosen.database = to->decisions[i].chosen[0], chosen.range = to->decisions[i].chosen[1], chosen.frame = to->decisions[i].chosen[2];
        if (!cdbm_is_playing(controller, &chosen)) return 0;
        if (chosen.database == CDBM_GO_ON && to->moved[i].to.database < 0.0) return 0;
    }
    return cdbp_are_rows(controller, to->after, to->given.n);
}

/* The steps of an update that `parts` says, for characters `start` to `stop` - 1: 1, 0 without memory, -1 for a query that cannot be
 * compared. */
static int cdbp_run_controller(const cdbm_controller *controller, const cdbp_update *to, int parts, size_t start, size_t stop,
    cdbm_room left)
{
    size_t width = cdbm_width(controller), i;
    double *room = (double *)cdbm_part(&left, controller->n_features * sizeof(double));
    if (!room) return 0;
    for (i = start; parts & CDBP_ASK && i < stop; i++)
        cdbm_ask(controller, &to->given, i, to->before + i * width, &to->moved[i], to->after + i * width, &to->decisions[i], room);
    if (parts & CDBP_CHOOSE) {
        int is_done = cdbm_choose(controller, &to->given, start, stop, to->after, to->moved, to->decisions, to->found, left);
        if (is_done != 1) return is_done;
        for (i = start; i < stop; i++)
            if (!cdbm_weigh(controller, &to->given, i, to->after + i * width, &to->moved[i], &to->decisions[i], room, left)) return 0;
    }
    for (i = start; parts & CDBP_DECIDE && i < stop; i++)
        cdbm_decide(controller, &to->given, i, to->before + i * width, &to->moved[i], to->after + i * width, &to->decisions[i]);
    return 1;
}

/* controllers.update(parts, start, stop, before, moved, ...): whether each query can be compared. */
static PyObject *cdbp_controller_update(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbp_controller *own = (const cdbp_controller *)self;
    cdbp_arrays a;
    cdbp_update to;
    int64_t parts, start, stop;
    int is_done = -2;
    a.n = 0;
    if (own->is_made && n == 24 && cdbp_int_of(in[0], &parts) && cdbp_int_of(in[1], &start) && cdbp_int_of(in[2], &stop)
        && cdbp_take_given(own, &a, in + 3, &to) == 0 && start >= 0 && start <= stop && (uint64_t)stop <= to.given.n
        && cdbp_are_moved(&own->controller, &to) && (parts & CDBP_ASK || cdbp_are_chosen(&own->controller, &to))) {
        size_t n_bytes = cdbm_choice_room(&own->controller, (size_t)(stop - start))
            + cdbm_rounded(own->controller.n_features * sizeof(double));
        cdbm_room room = {(char *)PyMem_Malloc(n_bytes + 1), n_bytes};
        PyThreadState *state = room.at ? PyEval_SaveThread() : NULL;
        is_done = room.at ? cdbp_run_controller(&own->controller, &to, (int)parts, (size_t)start, (size_t)stop, room) : 0;
        if (state) PyEval_RestoreThread(state);
        PyMem_Free(room.at);
    }
    cdbp_release(&a);
    if (is_done == 0) return PyErr_NoMemory();
    if (is_done != -2) return cdbp_new_ref(is_done == 1 ? Py_True : Py_False);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "update takes parts, two numbers, and rows and arrays that go together");
    return NULL;
}

/* controllers.skips(row, moved, decision, database, spans, whys, plays, play_of): how many spans of frames its search leaves out, and which. */
static PyObject *cdbp_controller_skips(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbp_controller *own = (const cdbp_controller *)self;
    const cdbm_controller *controller = &own->controller;
    cdbp_arrays a;
    cdbm_skips skips = {NULL, NULL, 0};
    cdbm_given given;
    const double *row, *moved, *decision;
    int64_t database = -1;
    size_t s[3];
    a.n = 0;
    memset(&given, 0, sizeof given);
    given.n = 1;
    if (own->is_made && n == 8 && cdbp_int_of(in[3], &database) && database >= 0 && (uint64_t)database < controller->n_databases
        && controller->databases[database].frames && (row = cdbp_numbers(&a, in[0], s, 2, 1, cdbm_width(controller), 0))
        && (moved = cdbp_numbers(&a, in[1], s, 2, 1, sizeof(cdbm_moved) / sizeof(double), 0))
        && (decision = cdbp_numbers(&a, in[2], s, 2, 1, sizeof(cdbm_decision) / sizeof(double), 0))
        && (skips.spans = (int64_t *)cdbp_shaped(&a, in[4], 'i', 8, 1, s, 2, cdbm_most_skips(controller, &controller->databases[database]), 2, 0))
        && (skips.whys = (uint8_t *)cdbp_shaped(&a, in[5], 'u', 1, 1, s, 1, s[0], 0, 0))
        && cdbp_take_plays(own, &a, in + 6, &given) == 0
        && cdbp_are_rows(controller, row, 1) && cdbm_is_playing(controller, &((const cdbm_moved *)moved)->to)) {
        cdbm_list_skips(controller, &given, 0, row, (const cdbm_moved *)moved, (const cdbm_decision *)decision, (size_t)database, &skips);
        cdbp_release(&a);
        return PyLong_FromLongLong((long long)skips.n);
    }
    cdbp_release(&a);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "skips takes a row, what has moved, a decision, a database and two arrays");
    return NULL;
}

/* controllers.pack(row): the packet that says what plays; see follow.h. */
static PyObject *cdbp_controller_pack(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbp_controller *own = (const cdbp_controller *)self;
    uint8_t packet[CDBM_MOST_PACKET];
    cdbp_arrays a;
    const double *row;
    size_t s[3], n_bytes = 0;
    int is_done = 0;
    a.n = 0;
    if (own->is_made && n == 1 && (row = cdbp_numbers(&a, in[0], s, 2, 1, cdbm_width(&own->controller), 0))
        && cdbp_are_rows(&own->controller, row, 1)) n_bytes = cdbm_pack_row(&own->controller, row, packet), is_done = 1;
    cdbp_release(&a);
    if (is_done) return PyBytes_FromStringAndSize((const char *)packet, (Py_ssize_t)n_bytes);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "pack takes a row of these controllers");
    return NULL;
}

/* controllers.read_packet(packet, moved, followed): what a packet says, to one who would play on as it has moved; whether it is one. */
static PyObject *cdbp_controller_read_packet(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbp_controller *own = (const cdbp_controller *)self;
    cdbp_arrays a;
    char *packet;
    const cdbm_moved *moved;
    cdbm_followed *to;
    Py_ssize_t n_bytes;
    size_t s[3];
    int is_read = -1;
    a.n = 0;
    if (own->is_made && n == 3 && PyBytes_AsStringAndSize(in[0], &packet, &n_bytes) == 0
        && (moved = (const cdbm_moved *)cdbp_numbers(&a, in[1], s, 2, 1, sizeof *moved / sizeof(double), 0))
        && (to = (cdbm_followed *)cdbp_to_numbers(&a, in[2], s, 1, sizeof *to / sizeof(double), 0, 0)))
        is_read = cdbm_read_packet(&own->controller, (const uint8_t *)packet, (size_t)n_bytes, moved, to);
    cdbp_release(&a);
    if (is_read >= 0) return cdbp_new_ref(is_read ? Py_True : Py_False);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "read_packet takes bytes, what has moved, and an array");
    return NULL;
}

static PyObject *cdbp_controller_width(PyObject *self, void *unused)
{
    (void)unused;
    return PyLong_FromLongLong((long long)cdbm_width(&((cdbp_controller *)self)->controller));
}

static PyMethodDef cdbp_controller_methods[] = {
    {"move", CDBP_CALL(cdbp_controller_move), METH_FASTCALL, "Write what plays some time later."},
    {"update", CDBP_CALL(cdbp_controller_update), METH_FASTCALL, "Update characters: ask, choose and decide."},
    {"pack", CDBP_CALL(cdbp_controller_pack), METH_FASTCALL, "The packet that says what plays."},
    {"read_packet", CDBP_CALL(cdbp_controller_read_packet), METH_FASTCALL, "Write what a packet says."},
    {"skips", CDBP_CALL(cdbp_controller_skips), METH_FASTCALL, "Write what a search leaves out."},
    {NULL, NULL, 0, NULL},
};
static PyGetSetDef cdbp_controller_members[] = {
    {"width", cdbp_controller_width, NULL, "How many numbers the row of a character has.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};
static PyType_Slot cdbp_controller_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_controller_init)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_controller_free)},
    {Py_tp_methods, cdbp_controller_methods},
    {Py_tp_getset, cdbp_controller_members},
    {0, NULL},
};
static PyType_Spec cdbp_controller_spec = {"contextdb.core._core.Controllers", (int)sizeof(cdbp_controller), 0, Py_TPFLAGS_DEFAULT,
    cdbp_controller_slots};

/* fill_ranges(starts, rows, mirrored, at, masks, in_mirror, costs or None, costs_in_mirror or None, own, ranges, biases or None, plays or
 * None, chosen or None): which ranges each of some answers lets play, into columns from `at` on; and by which row. */
static PyObject *cdbp_fill_ranges(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    cdbm_table_ranges of;
    const uint64_t *masks[2];
    const double *costs[2] = {NULL, NULL}, *own;
    uint8_t *ranges;
    double *biases = NULL;
    int64_t at = -1, *chosen = NULL;
    size_t s[3], n_answers = 0, n_words = 0, n_all = 0, n_rows = 0, n_costs = 0, n_plays = 0, i, k;
    int is_done = 0;
    (void)module;
    a.n = 0;
    of.plays = NULL;
    if (n == 13 && cdbp_int_of(in[3], &at) && at >= 0 && (of.starts = cdbp_int64s(&a, in[0], s, 1, CDBP_ANY, 0)) && s[0] > 0
        && ((of.n_ranges = s[0] - 1), 1) && (of.rows = cdbp_int64s(&a, in[1], s, 1, CDBP_ANY, 0)) && ((n_rows = s[0]), 1)
        && (of.mirrored = (const uint8_t *)cdbp_shaped(&a, in[2], 'b', 1, 0, s, 1, of.n_ranges, 0, 0))
        && (masks[0] = (const uint64_t *)cdbp_shaped(&a, in[4], 'u', 8, 0, s, 2, CDBP_ANY, CDBP_ANY, 0))
        && ((n_answers = s[0]), (n_words = s[1]), 1)
        && (masks[1] = (const uint64_t *)cdbp_shaped(&a, in[5], 'u', 8, 0, s, 2, n_answers, n_words, 0))
        && (ranges = (uint8_t *)cdbp_shaped(&a, in[9], 'b', 1, 1, s, 2, n_answers, CDBP_ANY, 0)) && ((n_all = s[1]), 1)
        && (uint64_t)at <= n_all && of.n_ranges <= n_all - (size_t)at && (own = cdbp_numbers(&a, in[8], s, 1, n_all, 0, 0))
        && (in[6] == Py_None || ((costs[0] = cdbp_numbers(&a, in[6], s, 2, n_answers, CDBP_ANY, 0)) && ((n_costs = s[1]), 1)
            && (costs[1] = cdbp_numbers(&a, in[7], s, 2, n_answers, n_costs, 0))
            && (biases = cdbp_to_numbers(&a, in[10], s, 2, n_answers, n_all, 0))))
        && (in[11] == Py_None || ((of.plays = (const cdb_row_play *)cdbp_numbers(&a, in[11], s, 2, CDBP_ANY, sizeof(cdb_row_play) / sizeof(double), 0))
            && ((n_plays = s[0]), 1) && (chosen = (int64_t *)cdbp_shaped(&a, in[12], 'i', 8, 1, s, 2, n_answers, n_all, 0))))) {
        of.at = (size_t)at;
        is_done = of.starts[0] == 0 && (uint64_t)of.starts[of.n_ranges] == n_rows;
        for (i = 0; i < of.n_ranges; i++) is_done = is_done && of.starts[i] <= of.starts[i + 1];
        for (k = 0; k < n_rows; k++)
            is_done = is_done && of.rows[k] >= 0 && (uint64_t)of.rows[k] < 64 * n_words && (!biases || (uint64_t)of.rows[k] < n_costs)
                && (!of.plays || (uint64_t)of.rows[k] < n_plays);
        for (i = 0; is_done && i < n_answers; i++) {
            const uint64_t *own_masks[2];
            const double *own_costs[2];
            for (k = 0; k < 2; k++) own_masks[k] = masks[k] + i * n_words, own_costs[k] = biases ? costs[k] + i * n_costs : NULL;
            cdbm_fill_ranges(&of, own_masks, biases ? own_costs : NULL, own, ranges + i * n_all, biases ? biases + i * n_all : NULL,
                chosen ? chosen + i * n_all : NULL);
        }
    }
    return cdbp_given_back(&a, is_done, "fill_ranges takes rows of a table, and masks and arrays that go together");
}

/* What plays, as its bank has it; 0 where no bank has it, or where its database is gone. */
static int cdbp_instant_of(const cdbm_playing *playing, const int64_t *starts, size_t n, const int64_t *banks, const int64_t *ranges,
    cdbo_instant *to)
{
    size_t d = (size_t)playing->database;
    to->bank = -1.0, to->range = 0.0, to->at_s = 0.0;
    if (!(playing->database >= 0.0)) return playing->database != CDBM_GONE;
    if (d >= n || !(playing->range >= 0.0 && playing->range < (double)(starts[d + 1] - starts[d]))) return 0;
    to->bank = (double)banks[d], to->range = (double)ranges[starts[d] + (int64_t)playing->range], to->at_s = playing->at_s;
    return to->bank >= 0.0 && to->range >= 0.0;
}

/* fill_plays(decisions, starts, banks, ranges, displayed, grounds, plays): what poses are made of, by what was decided; whether the banks
 * have all that plays. `banks` is that of each database, `ranges` the range there of each of its ranges, below 0 for none; `grounds` a
 * ground for all, or a tuple of those of each, None for none. */
static PyObject *cdbp_fill_plays(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const cdbm_decision *decisions;
    const int64_t *starts, *banks, *ranges = NULL;
    const cdbo_instant *displayed = NULL;
    cdbo_play *plays = NULL;
    size_t s[3], n_rows = 0, n_banks = 0, n_ranges = 0, i;
    int is_right = 0, is_whole = 1, is_for_each = n == 7 && PyType_IsSubtype(Py_TYPE(in[5]), &PyTuple_Type);
    (void)module;
    a.n = 0;
    if (n == 7 && (decisions = (const cdbm_decision *)cdbp_numbers(&a, in[0], s, 2, CDBP_ANY, sizeof *decisions / sizeof(double), 0))
        && ((n_rows = s[0]), 1) && (banks = cdbp_int64s(&a, in[2], s, 1, CDBP_ANY, 0)) && ((n_banks = s[0]), 1)
        && (starts = cdbp_int64s(&a, in[1], s, 1, n_banks + 1, 0)) && (ranges = cdbp_int64s(&a, in[3], s, 1, CDBP_ANY, 0))
        && ((n_ranges = s[0]), 1) && (displayed = (const cdbo_instant *)cdbp_numbers(&a, in[4], s, 2, n_rows, 3, 0))
        && (!is_for_each || PyTuple_Size(in[5]) == (Py_ssize_t)n_rows)
        && (plays = (cdbo_play *)cdbp_to_numbers(&a, in[6], s, 2, n_rows, sizeof *plays / sizeof(double), 0))) {
        is_right = starts[0] == 0 && (uint64_t)starts[n_banks] == n_ranges;
        for (i = 0; i < n_banks; i++) is_right = is_right && starts[i] <= starts[i + 1];
        for (i = 0; is_right && i < n_rows; i++) {
            cdbo_instant playing, before;
            is_whole &= cdbp_instant_of(&decisions[i].playing, starts, n_banks, banks, ranges, &playing);
            is_whole &= cdbp_instant_of(&decisions[i].before, starts, n_banks, banks, ranges, &before);
            plays[i] = cdbm_pose_play(&decisions[i], playing, before, displayed[i],
                (is_for_each ? PyTuple_GetItem(in[5], (Py_ssize_t)i) : in[5]) != Py_None);
        }
    }
    if (!is_right) return cdbp_given_back(&a, 0, "fill_plays takes decisions, banks and ranges of databases, and arrays that go together");
    cdbp_release(&a);
    return cdbp_new_ref(is_whole ? Py_True : Py_False);
}

#define CDBP_CONTROLLER_FUNCTIONS \
    {"fill_plays", CDBP_CALL(cdbp_fill_plays), METH_FASTCALL, "Write what poses are made of, by what was decided."}, \
    {"fill_ranges", CDBP_CALL(cdbp_fill_ranges), METH_FASTCALL, "Write which ranges some answers of a table let play."},
