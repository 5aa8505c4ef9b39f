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

/* The one database of controllers that a match node has, which knows where its clips go; NULL with an error for others. */
static const cdbm_clips *cdbp_node_clips(PyObject *controllers)
{
    const cdbp_controller *own = (const cdbp_controller *)controllers;
    if (cdbp_is_freed_by(Py_TYPE(controllers), cdbp_controller_free) && own->is_made && own->controller.n_databases == 1
        && own->databases[0].frames && own->databases[0].root) return &own->databases[0];
    PyErr_SetString(PyExc_TypeError, "a match node has controllers of one database with root motion");
    return NULL;
}

/* Whether a frame lies in a range. */
static int cdbp_is_in_range(const cdbm_clips *clips, int64_t range, int64_t frame)
{
    return range >= 0 && (uint64_t)range < clips->n_ranges && clips->starts[range] <= frame && frame < clips->stops[range];
}

/* write_ends(controllers, warps, ends) */
static PyObject *cdbp_write_ends(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_clips *clips = n == 3 ? cdbp_node_clips(in[0]) : NULL;
    cdbp_arrays a;
    const double *warps;
    double *ends, *headings = NULL;
    size_t s[3];
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (clips && (warps = cdbp_numbers(&a, in[1], s, 3, clips->n_ranges, 2, 2)) && (ends = cdbp_to_numbers(&a, in[2], s, 2, clips->frames->n_frames, 3, 0))) {
        headings = (double *)PyMem_Malloc((clips->frames->n_frames + 1) * sizeof(double));
        if (headings) cdbm_write_ends(clips, warps, headings, ends);
        else PyErr_NoMemory();
        is_done = headings != NULL;
        PyMem_Free(headings);
    }
    return cdbp_given_back(&a, is_done, "write_ends takes controllers, warps and an array");
}

/* begin_one_off(controllers, range, frame, last or -1, play or None, warps, target, windows): its last frame and its play rate. With a last
 * frame it plays up to there as it is, and the target is written. */
static PyObject *cdbp_begin_one_off(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_clips *clips = n == 8 ? cdbp_node_clips(in[0]) : NULL;
    cdb_row_play play = cdbm_plain_play();
    cdbm_stretch part = {0, -1, 0.0};
    cdbp_arrays a;
    const double *numbers, *warps;
    double *target, *windows;
    cdbm_one_off one;
    int64_t range;
    size_t s[3];
    int is_done = 0;
    (void)module;
    a.n = 0;
    memset(&one, 0, sizeof one);
    if (clips && cdbp_int_of(in[1], &range) && cdbp_int_of(in[2], &part.first) && cdbp_int_of(in[3], &part.last)
        && cdbp_is_in_range(clips, range, part.first) && (part.last < 0 || cdbp_is_in_range(clips, range, part.last))
        && (in[4] == Py_None || ((numbers = cdbp_numbers(&a, in[4], s, 1, sizeof play / sizeof(double), 0, 0)) && memcpy(&play, numbers, sizeof play)))
        && (warps = cdbp_numbers(&a, in[5], s, 2, 2, 2, 0)) && (target = cdbp_to_numbers(&a, in[6], s, 1, 3, 0, 0))
        && (windows = cdbp_to_numbers(&a, in[7], s, 2, 2, 2, 0))) {
        if (part.last < 0) cdbm_begin_one_off(clips, (size_t)range, part.first, &play, warps, (const cdbm_target *)target, &one);
        else cdbm_begin_part(clips, (size_t)range, &part, &play, &one);
        memcpy(target, &one.target, sizeof one.target);
        memcpy(windows, one.windows, sizeof one.windows);
        is_done = 1;
    }
    cdbp_release(&a);
    if (is_done) return Py_BuildValue("(Ld)", (long long)one.last, one.rate);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "begin_one_off takes controllers, a range, frames in it, a play, and three arrays");
    return NULL;
}

/* forbid_others(controllers, plays, play_of, biases): forbid all frames but those at which rows say that they are entered. */
static PyObject *cdbp_forbid_others(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_clips *clips = n == 4 ? cdbp_node_clips(in[0]) : NULL;
    const cdb_row_play *plays;
    const int64_t *play_of;
    cdbp_arrays a;
    double *biases;
    size_t s[3], n_plays = 0, r;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (clips && (plays = (const cdb_row_play *)cdbp_numbers(&a, in[1], s, 2, CDBP_ANY, sizeof *plays / sizeof(double), 0)) && ((n_plays = s[0]), 1)
        && (play_of = cdbp_int64s(&a, in[2], s, 1, clips->n_ranges, 0)) && (biases = cdbp_to_numbers(&a, in[3], s, 1, clips->frames->n_frames, 0, 0))) {
        is_done = 1;
        for (r = 0; r < clips->n_ranges; r++) is_done = is_done && play_of[r] < (int64_t)n_plays;
        if (is_done) cdbm_forbid_others(clips, plays, play_of, biases);
    }
    return cdbp_given_back(&a, is_done, "forbid_others takes controllers, plays, those of ranges, and an array");
}

/* shortest_part(controllers, query, ranges, range_biases, allowed, kind_biases, playable, flags, frame_biases, after, most_cost): the first and the
 * last frame of the shortest part, -1 for none, and its cost; None for a query that cannot be compared. */
static PyObject *cdbp_shortest_part(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_clips *clips = n == 11 ? cdbp_node_clips(in[0]) : NULL;
    const cdbp_frames *frames = clips ? (const cdbp_frames *)PyTuple_GetItem(PyTuple_GetItem(((cdbp_controller *)in[0])->parts, 0), 0) : NULL;
    cdbp_arrays a;
    cdbm_question asked;
    cdbm_stretch part;
    const double *after;
    double most_cost;
    size_t s[3];
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (frames && cdbp_question(frames, &a, in + 1, 0, &asked) && (after = cdbp_numbers(&a, in[9], s, 1, clips->frames->n_features, 0, 0))
        && cdbp_float_of(in[10], &most_cost)) {
        size_t n_bytes = cdbm_part_room(clips->frames);
        cdbm_room room = {(char *)PyMem_Malloc(n_bytes + 1), n_bytes};
        is_done = room.at ? cdbm_shortest_part(clips, &asked, after, most_cost, &part, room) : 0;
        PyMem_Free(room.at);
        if (is_done == 0) PyErr_NoMemory();
    }
    cdbp_release(&a);
    if (is_done == 1) return Py_BuildValue("(LLd)", (long long)part.first, (long long)part.last, part.cost);
    if (is_done == -1) return cdbp_new_ref(Py_None);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "shortest_part takes controllers, a question, another query and a cost");
    return NULL;
}

/* ---- tags */

/* Texts one after another, each ended by 0, from bytes: pointers to them, which are to be freed, and how many. */
static const char **cdbp_listed(PyObject *bytes, size_t *n)
{
    char *text;
    Py_ssize_t n_bytes, i;
    const char **to;
    *n = 0;
    if (PyBytes_AsStringAndSize(bytes, &text, &n_bytes) != 0) return NULL;
    if (!(to = (const char **)PyMem_Calloc((size_t)n_bytes + 1, sizeof *to))) PyErr_NoMemory();
    for (i = 0; to && i < n_bytes; i++)
        if (i == 0 || text[i - 1] == 0) to[(*n)++] = text + i;
    return to;
}

/* The same with costs. */
static cdbm_named_cost *cdbp_listed_costs(cdbp_arrays *a, PyObject *bytes, PyObject *costs, size_t *n)
{
    const char **names = cdbp_listed(bytes, n);
    const double *numbers;
    size_t s[3], i;
    cdbm_named_cost *to = NULL;
    if (names && (numbers = cdbp_numbers(a, costs, s, 1, *n, 0, 0)) && !(to = (cdbm_named_cost *)PyMem_Calloc(*n + 1, sizeof *to))) PyErr_NoMemory();
    for (i = 0; to && i < *n; i++) to[i].name = names[i], to[i].cost = numbers[i];
    PyMem_Free((void *)names);
    return to;
}

/* filter_kinds(known, flags, include, every, exclude, prefer, costs, avoid, costs, passes, added): whether the markup knows all tags. */
static PyObject *cdbp_filter_kinds(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    cdbm_tag_list known;
    cdbm_tags tags;
    const char **lists[4] = {NULL, NULL, NULL, NULL};
    cdbm_named_cost *prefer = NULL, *avoid = NULL;
    uint8_t *passes, *own = NULL;
    double *added;
    size_t s[3], i;
    int is_known = -1;
    (void)module;
    a.n = 0;
    memset(&tags, 0, sizeof tags);
    if (n == 11 && (lists[0] = cdbp_listed(in[0], &known.n)) && (known.names = PyBytes_AsString(in[0]))
        && (known.flags = (const uint8_t *)cdbp_shaped(&a, in[1], 'b', 1, 0, s, 2, CDBP_ANY, known.n, 0)) && ((known.n_kinds = s[0]), 1)
        && (lists[1] = cdbp_listed(in[2], &tags.n_include)) && (lists[2] = cdbp_listed(in[3], &tags.n_every))
        && (lists[3] = cdbp_listed(in[4], &tags.n_exclude)) && (prefer = cdbp_listed_costs(&a, in[5], in[6], &tags.n_prefer))
        && (avoid = cdbp_listed_costs(&a, in[7], in[8], &tags.n_avoid))
        && (passes = (uint8_t *)cdbp_shaped(&a, in[9], 'b', 1, 1, s, 1, known.n_kinds, 0, 0))
        && (added = cdbp_to_numbers(&a, in[10], s, 1, known.n_kinds, 0, 0)) && (own = (uint8_t *)PyMem_Malloc(2 * known.n_kinds + 1))) {
        tags.include = lists[1], tags.every = lists[2], tags.exclude = lists[3], tags.prefer = prefer, tags.avoid = avoid;
        is_known = cdbm_filter_kinds(&known, &tags, passes, added, own);
    }
    for (i = 0; i < 4; i++) PyMem_Free((void *)lists[i]);
    PyMem_Free(prefer);
    PyMem_Free(avoid);
    PyMem_Free(own);
    cdbp_release(&a);
    if (is_known >= 0) return cdbp_new_ref(is_known ? Py_True : Py_False);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "filter_kinds takes tags as bytes, flags, lists of tags with costs, and two arrays");
    return NULL;
}

/* ---- clips of several characters: see meeting.h */

/* see_others(places, others, seen): each place as another body sees it. */
static PyObject *cdbp_see_others(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const double *places, *others;
    double *seen;
    size_t s[3], n_rows = 0, i;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 3 && (places = cdbp_numbers(&a, in[0], s, 2, CDBP_ANY, 3, 0)) && ((n_rows = s[0]), 1) && (others = cdbp_numbers(&a, in[1], s, 2, n_rows, 3, 0))
        && (seen = cdbp_to_numbers(&a, in[2], s, 2, n_rows, 4, 0))) {
        for (i = 0; i < n_rows; i++) cdbm_see_other(places + 3 * i, others + 3 * i, seen + 4 * i);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "see_others takes two arrays of places, and one for what is seen");
}

/* align(recorded, places, gives, put) */
static PyObject *cdbp_align(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const double *recorded, *places, *gives;
    double *put;
    size_t s[3], n_roles = 0;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 4 && (recorded = cdbp_numbers(&a, in[0], s, 2, CDBP_ANY, 3, 0)) && ((n_roles = s[0]), 1) && (places = cdbp_numbers(&a, in[1], s, 2, n_roles, 3, 0))
        && (gives = cdbp_numbers(&a, in[2], s, 1, n_roles, 0, 0)) && (put = cdbp_to_numbers(&a, in[3], s, 2, n_roles, 3, 0))) {
        cdbm_align(recorded, places, gives, n_roles, put);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "align takes two arrays of places, numbers, and an array for places");
}

/* begin_roles(controllers, ranges, frame, warps, put, starts, targets): the last frame of the first role, and from when to when the actors
 * are brought together. */
static PyObject *cdbp_begin_roles(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    const cdbm_clips *clips = n == 7 ? cdbp_node_clips(in[0]) : NULL;
    cdbp_arrays a;
    const int64_t *ranges;
    const double *warps, *put, *starts;
    double *targets;
    cdbm_one_off *roles = NULL, first;
    int64_t frame;
    size_t s[3], n_roles = 0, k;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (clips && (ranges = cdbp_int64s(&a, in[1], s, 1, CDBP_ANY, 0)) && (n_roles = s[0]) > 0 && cdbp_int_of(in[2], &frame)
        && (warps = cdbp_numbers(&a, in[3], s, 3, clips->n_ranges, 2, 2)) && (put = cdbp_numbers(&a, in[4], s, 2, n_roles, 3, 0))
        && (starts = cdbp_numbers(&a, in[5], s, 2, n_roles, 3, 0)) && (targets = cdbp_to_numbers(&a, in[6], s, 2, n_roles, 3, 0))) {
        is_done = cdbm_are_below(ranges, n_roles, clips->n_ranges) && frame >= 0 && frame < (int64_t)clips->frames->n_frames;
        for (k = 0; is_done && k < n_roles; k++) is_done = cdbp_is_in_range(clips, ranges[k], clips->starts[ranges[k]] + frame);
        if (is_done && !(roles = (cdbm_one_off *)PyMem_Calloc(n_roles, sizeof *roles))) is_done = PyErr_NoMemory() != NULL;
    }
    if (is_done) {
        cdbm_begin_roles(clips, ranges, n_roles, frame, warps, put, starts, roles);
        for (k = 0; k < n_roles; k++) memcpy(targets + 3 * k, &roles[k].target, 3 * sizeof(double));
        first = roles[0];
    }
    PyMem_Free(roles);
    cdbp_release(&a);
    if (is_done) return Py_BuildValue("(Ldd)", (long long)first.last, first.windows[0].from_s, first.windows[0].to_s);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "begin_roles takes controllers, ranges, a frame, warps, and three arrays of places");
    return NULL;
}

#define CDBP_NODE_FUNCTIONS \
    {"see_others", CDBP_CALL(cdbp_see_others), METH_FASTCALL, "Write what bodies see of each other."}, \
    {"align", CDBP_CALL(cdbp_align), METH_FASTCALL, "Write where a clip has its actors, put down best."}, \
    {"begin_roles", CDBP_CALL(cdbp_begin_roles), METH_FASTCALL, "How the actors of a clip come to be as recorded."}, \
    {"write_ends", CDBP_CALL(cdbp_write_ends), METH_FASTCALL, "Write where each frame's animation ends."}, \
    {"begin_one_off", CDBP_CALL(cdbp_begin_one_off), METH_FASTCALL, "How far a one-off plays, and how fast."}, \
    {"forbid_others", CDBP_CALL(cdbp_forbid_others), METH_FASTCALL, "Forbid all frames but those that rows name."}, \
    {"shortest_part", CDBP_CALL(cdbp_shortest_part), METH_FASTCALL, "The shortest part that joins two poses."}, \
    {"filter_kinds", CDBP_CALL(cdbp_filter_kinds), METH_FASTCALL, "Which kinds of frames tags let pass."}, \
    {"warp", CDBP_CALL(cdbp_warp), METH_FASTCALL, "Write a path that is warped to a target."}, \
    {"row_at", CDBP_CALL(cdbp_row_at), METH_FASTCALL, "Write the row between two times."}, \
    {"aim", CDBP_CALL(cdbp_aim), METH_FASTCALL, "Write what a target adds to the costs of frames."}, \
    {"until_down_s", CDBP_CALL(cdbp_until_down_s), METH_FASTCALL, "Seconds until a foot is down."}, \
    {"going", CDBP_CALL(cdbp_going), METH_FASTCALL, "How fast a clip goes and turns."}, \
    {"phase", CDBP_CALL(cdbp_phase), METH_FASTCALL, "The share of a clip that has played."}, \
    {"motion_then", CDBP_CALL(cdbp_motion_then), METH_FASTCALL, "A movement, and another one after it."}, \
    {"motion_from", CDBP_CALL(cdbp_motion_from), METH_FASTCALL, "The movement from one place to another."},
