/* ---- Searches for Python: the arrays of a motion database, held and checked once, and the questions that are put to it. */

typedef struct cdbp_frames {
    PyObject ob_base;
    cdbm_frames frames;
    cdbp_arrays arrays;
    int is_made;
} cdbp_frames;

/* The items of an array that has exactly the lengths of `shape`; NULL with an error for another one. */
static const void *cdbp_exactly(cdbp_arrays *arrays, PyObject *array, char kind, size_t size, int n_dimensions, const size_t *shape)
{
    size_t found[4];
    const void *items = cdbp_items(arrays, array, kind, size, n_dimensions, 0, found);
    if (!items || memcmp(found, shape, (size_t)n_dimensions * sizeof *found) == 0) return items;
    PyErr_Format(PyExc_ValueError, "array %zu has another shape than it must have", arrays->n);
    return NULL;
}

/* One row of so many numbers. */
static const void *cdbp_row_of(cdbp_arrays *arrays, PyObject *array, char kind, size_t size, size_t n)
{
    return cdbp_exactly(arrays, array, kind, size, 1, &n);
}

/* Frames(blocks, order, rank, box_starts, box_sizes, box_ranges, box_kinds, range_boxes, kinds, n_frames, n_kinds, offset, scale,
 * channels, weights, roots) */
static int cdbp_frames_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_frames *own = (cdbp_frames *)self;
    cdbp_arrays *arrays = &own->arrays;
    cdbm_frames *frames = &own->frames;
    PyObject *blocks, *order, *rank, *starts, *of_boxes[3], *range_boxes, *kinds, *offset, *scale, *channels, *weights, *roots;
    size_t shape[3] = {0, 0, 0}, two[2] = {0, 0};
    long long n_kinds, n_frames;
    if (own->is_made || arrays->n || (named && PyDict_Size(named))) {
        PyErr_SetString(PyExc_TypeError, "Frames are made once, of arrays by their places");
        return -1;
    }
    if (!PyArg_ParseTuple(arguments, "OOOOOOOOOLLOOOOO", &blocks, &order, &rank, &starts, &of_boxes[0], &of_boxes[1], &of_boxes[2],
            &range_boxes, &kinds, &n_frames, &n_kinds, &offset, &scale, &channels, &weights, &roots)) return -1;
    if (!(frames->blocks = (const float *)cdbp_items(arrays, blocks, 'f', sizeof(float), 3, 0, shape))) return -1;
    if (shape[2] != CDBM_FRAMES || n_frames < 0 || n_kinds < 1) goto wrong;
    frames->n_boxes = shape[0];
    frames->n_features = shape[1];
    frames->n_frames = (size_t)n_frames;
    frames->n_kinds = (size_t)n_kinds;
    if (!(frames->order = (const int64_t *)cdbp_row_of(arrays, order, 'i', 8, frames->n_features))) return -1;
    if (!(frames->rank = (const int64_t *)cdbp_row_of(arrays, rank, 'i', 8, frames->n_features))) return -1;
    if (!(frames->box_starts = (const int64_t *)cdbp_row_of(arrays, starts, 'i', 8, frames->n_boxes))) return -1;
    if (!(frames->box_sizes = (const int32_t *)cdbp_row_of(arrays, of_boxes[0], 'i', 4, frames->n_boxes))) return -1;
    if (!(frames->box_ranges = (const int32_t *)cdbp_row_of(arrays, of_boxes[1], 'i', 4, frames->n_boxes))) return -1;
    if (!(frames->box_kinds = (const int32_t *)cdbp_row_of(arrays, of_boxes[2], 'i', 4, frames->n_boxes))) return -1;
    if (!(frames->range_boxes = (const int64_t *)cdbp_items(arrays, range_boxes, 'i', 8, 2, 0, two))) return -1;
    frames->n_ranges = two[0];
    if (kinds != Py_None && !(frames->kinds = (const int32_t *)cdbp_row_of(arrays, kinds, 'i', 4, frames->n_frames))) return -1;
    if (!(frames->offset = (const double *)cdbp_row_of(arrays, offset, 'f', 8, frames->n_features))) return -1;
    if (!(frames->scale = (const double *)cdbp_row_of(arrays, scale, 'f', 8, frames->n_features))) return -1;
    if (!(frames->weights = (const double *)cdbp_items(arrays, weights, 'f', 8, 1, 0, &frames->n_channels))) return -1;
    if (!(frames->channels = (const int64_t *)cdbp_row_of(arrays, channels, 'i', 8, frames->n_channels + 1))) return -1;
    if (!(frames->roots = (const double *)cdbp_row_of(arrays, roots, 'f', 8, frames->n_features))) return -1;
    if (two[1] != 2 || !cdbm_is_whole(frames)) goto wrong;
    if (!cdbm_make_levels(frames)) {
        PyErr_NoMemory();
        return -1;
    }
    own->is_made = 1;
    return 0;
wrong:
    PyErr_SetString(PyExc_ValueError, "the boxes, ranges, channels or kinds of the frames do not go together");
    return -1;
}

static void cdbp_frames_free(PyObject *self)
{
    cdbm_free_levels(&((cdbp_frames *)self)->frames);
    cdbp_release(&((cdbp_frames *)self)->arrays);
    cdbp_free(self);
}

/* What every question has, from the arguments query or queries, ranges, range_biases, allowed, kind_biases, playable, flags,
 * frame_biases, in this order; for so many queries, or one where `n` is 0. 0 where they do not go together, with an error. */
static int cdbp_question(const cdbp_frames *own, cdbp_arrays *arrays, PyObject *const *arguments, size_t n, cdbm_question *asked)
{
    const cdbm_frames *frames = &own->frames;
    size_t shape[2], n_dimensions = n ? 2 : 1, place = n ? 1 : 0;
    if (!own->is_made) {
        PyErr_SetString(PyExc_ValueError, "these frames were not made");
        return 0;
    }
    memset(asked, 0, sizeof *asked);
    asked->n_queries = n ? n : 1;
    asked->within = (double)INFINITY;
    shape[0] = n;
    shape[place] = frames->n_features;
    asked->queries = (const double *)cdbp_exactly(arrays, arguments[0], 'f', 8, (int)n_dimensions, shape);
    if (!asked->queries) return 0;
    asked->ranges = (const uint8_t *)cdbp_items(arrays, arguments[1], 'b', 1, (int)n_dimensions, 0, shape);
    if (!asked->ranges) return 0;
    asked->is_one_mask = !n || shape[0] == 1;
    if (shape[place] != frames->n_ranges || (n && shape[0] != 1 && shape[0] != n)) goto wrong;
    asked->range_biases = (const double *)cdbp_items(arrays, arguments[2], 'f', 8, (int)n_dimensions, 0, shape);
    if (!asked->range_biases) return 0;
    asked->are_same_biases = !n || shape[0] == 1;
    if (shape[place] != frames->n_ranges || (n && shape[0] != 1 && shape[0] != n)) goto wrong;
    asked->allowed = (const uint8_t *)cdbp_items(arrays, arguments[3], 'b', 1, 1, 0, shape);
    if (!asked->allowed) return 0;
    if (shape[0] < frames->n_kinds) goto wrong;
    asked->kind_biases = (const double *)cdbp_row_of(arrays, arguments[4], 'f', 8, shape[0]);
    if (!asked->kind_biases) return 0;
    asked->playable = (const uint8_t *)cdbp_row_of(arrays, arguments[5], 'b', 1, shape[0]);
    if (!asked->playable) return 0;
    if (arguments[6] != Py_None && !(asked->flags = (const uint8_t *)cdbp_row_of(arrays, arguments[6], 'b', 1, frames->n_frames))) return 0;
    if (arguments[7] != Py_None && !(asked->frame_biases = (const double *)cdbp_row_of(arrays, arguments[7], 'f', 8, frames->n_frames)))
        return 0;
    return 1;
wrong:
    PyErr_SetString(PyExc_ValueError, "the masks, biases or kinds of a search do not go together");
    return 0;
}

/* Search without the lock of Python; 0 with an error where memory is missing. */
static int cdbp_search_now(const cdbm_frames *frames, const cdbm_question *asked, size_t start, size_t stop, cdbm_hits *hits)
{
    size_t n_bytes = cdbm_search_room(frames, stop - start);
    cdbm_room room = {(char *)PyMem_Malloc(n_bytes + 1), n_bytes};
    PyThreadState *state;
    int is_done = 0;
    if (room.at) {
        state = PyEval_SaveThread();
        is_done = cdbm_search_frames(frames, asked, start, stop, hits, room);
        PyEval_RestoreThread(state);
    }
    PyMem_Free(room.at);
    if (!is_done) PyErr_NoMemory();
    return is_done;
}

/* A number of an argument, finite or not; 0 with an error for what is none. */
static int cdbp_float_of(PyObject *argument, double *number)
{
    *number = PyFloat_AsDouble(argument);
    return *number != -1.0 || !PyErr_Occurred();
}

static int cdbp_int_of(PyObject *argument, int64_t *number)
{
    *number = PyLong_AsLongLong(argument);
    return *number != -1 || !PyErr_Occurred();
}

/* frames.search(query, ranges, range_biases, allowed, kind_biases, playable, flags, frame_biases, skips, current, continuing, within,
 * totals, best_frames): fills `totals` and `best_frames`, one for all, or one for each range; gives the range of the best. */
static PyObject *cdbp_frames_search(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    const cdbp_frames *own = (const cdbp_frames *)self;
    cdbp_arrays arrays;
    cdbm_question asked;
    cdbm_hits hits;
    int64_t current, skip_stops[2] = {0, 0}, range = CDBM_NOTHING;
    size_t shape[2];
    PyObject *given = NULL;
    arrays.n = 0;
    if (n_arguments != 14) {
        PyErr_SetString(PyExc_TypeError, "search takes 14 arguments");
        return NULL;
    }
    if (!cdbp_question(own, &arrays, arguments, 0, &asked)) goto done;
    if (!cdbp_int_of(arguments[9], &current) || !cdbp_float_of(arguments[10], &asked.continuing)) goto done;
    if (!cdbp_float_of(arguments[11], &asked.within)) goto done;
    asked.currents = &current;
    if (arguments[8] != Py_None) {
        asked.skips = (const int64_t *)cdbp_items(&arrays, arguments[8], 'i', 8, 2, 0, shape);
        if (!asked.skips) goto done;
        if (shape[1] != 2) {
            PyErr_SetString(PyExc_ValueError, "the skips are no spans");
            goto done;
        }
        skip_stops[1] = (int64_t)shape[0];
        asked.skip_stops = skip_stops;
    }
    hits.totals = (double *)cdbp_items(&arrays, arguments[12], 'f', 8, 1, 1, shape);
    if (hits.totals) hits.frames = (int64_t *)cdbp_items(&arrays, arguments[13], 'i', 8, 1, 1, shape + 1);
    else goto done;
    if (!hits.frames) goto done;
    asked.is_each = shape[0] != 1;
    if (shape[0] != shape[1] || (asked.is_each && shape[0] != own->frames.n_ranges)) {
        PyErr_SetString(PyExc_ValueError, "there is not one best for all, or for each range");
        goto done;
    }
    hits.ranges = &range;
    if (cdbp_search_now(&own->frames, &asked, 0, 1, &hits)) given = PyLong_FromLongLong(range);
done:
    cdbp_release(&arrays);
    return given;
}

/* frames.search_many(queries, ranges, range_biases, allowed, kind_biases, playable, flags, frame_biases, skips, skip_stops, currents,
 * continuing, start, stop, totals, best_frames, best_ranges): fills the last three for queries `start` to `stop` - 1. */
static PyObject *cdbp_frames_search_many(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    const cdbp_frames *own = (const cdbp_frames *)self;
    cdbp_arrays arrays;
    cdbm_question asked;
    cdbm_hits hits;
    int64_t start, stop;
    size_t shape[2], n, i, n_skips;
    PyObject *given = NULL;
    arrays.n = 0;
    if (n_arguments != 17) {
        PyErr_SetString(PyExc_TypeError, "search_many takes 17 arguments");
        return NULL;
    }
    hits.totals = (double *)cdbp_items(&arrays, arguments[14], 'f', 8, 1, 1, &n);
    if (!hits.totals) goto done;
    if (n == 0) {
        given = cdbp_new_ref(Py_None);
        goto done;
    }
    if (!cdbp_question(own, &arrays, arguments, n, &asked)) goto done;
    hits.frames = (int64_t *)cdbp_items(&arrays, arguments[15], 'i', 8, 1, 1, shape);
    if (!hits.frames || shape[0] != n) goto wrong;
    hits.ranges = (int64_t *)cdbp_items(&arrays, arguments[16], 'i', 8, 1, 1, shape);
    if (!hits.ranges || shape[0] != n) goto wrong;
    asked.currents = (const int64_t *)cdbp_row_of(&arrays, arguments[10], 'i', 8, n);
    if (!asked.currents || !cdbp_float_of(arguments[11], &asked.continuing)) goto done;
    if (!cdbp_int_of(arguments[12], &start) || !cdbp_int_of(arguments[13], &stop)) goto done;
    if (start < 0 || stop < start || (uint64_t)stop > n) goto wrong;
    if (arguments[8] != Py_None) {
        asked.skips = (const int64_t *)cdbp_items(&arrays, arguments[8], 'i', 8, 2, 0, shape);
        if (!asked.skips || shape[1] != 2) goto wrong;
        n_skips = shape[0];
        asked.skip_stops = (const int64_t *)cdbp_row_of(&arrays, arguments[9], 'i', 8, n + 1);
        if (!asked.skip_stops) goto done;
        for (i = 0; i <= n; i++)
            if (asked.skip_stops[i] < (i ? asked.skip_stops[i - 1] : 0) || (uint64_t)asked.skip_stops[i] > n_skips) goto wrong;
    }
    if (cdbp_search_now(&own->frames, &asked, (size_t)start, (size_t)stop, &hits)) given = cdbp_new_ref(Py_None);
    goto done;
wrong:
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "the arrays of searches do not go together");
done:
    cdbp_release(&arrays);
    return given;
}

/* The bytes of the bounds. */
/* frames.levels(step, group_lows, group_highs, cluster_lows, cluster_highs): its bounds, for those who keep them. */
static PyObject *cdbp_frames_levels(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbp_frames *own = (const cdbp_frames *)self;
    const cdbm_frames *frames = &own->frames;
    const int16_t *from[4];
    cdbp_arrays a;
    double *step = NULL;
    size_t s[3], i = 0;
    a.n = 0;
    from[0] = frames->groups.lows, from[1] = frames->groups.highs, from[2] = frames->clusters.lows, from[3] = frames->clusters.highs;
    if (own->is_made && n == 5 && (step = cdbp_to_numbers(&a, in[0], s, 1, 1, 0, 0)))
        for (*step = frames->step; i < 4; i++) {
            size_t size = cdbm_level_size(frames, i < 2 ? frames->n_groups : frames->n_clusters);
            int16_t *to = (int16_t *)cdbp_shaped(&a, in[i + 1], 'i', 2, 1, s, 1, size, 0, 0);
            if (!to) break;
            memcpy(to, from[i], size * sizeof *to);
        }
    return cdbp_given_back(&a, i == 4, "levels takes five arrays of the right lengths");
}

static PyObject *cdbp_frames_n_bytes(PyObject *self, void *unused)
{
    const cdbm_frames *frames = &((const cdbp_frames *)self)->frames;
    (void)unused;
    return PyLong_FromSsize_t((Py_ssize_t)((frames->n_groups + frames->n_clusters) * frames->n_pairs * 4 * CDBM_LANES * sizeof(int16_t)));
}

static PyGetSetDef cdbp_frames_members[] = {
    {"n_bytes", cdbp_frames_n_bytes, NULL, "The bytes that it takes beside the arrays.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};
static PyMethodDef cdbp_frames_methods[] = {
    {"levels", CDBP_CALL(cdbp_frames_levels), METH_FASTCALL, "Write its bounds."},
    {"search", CDBP_CALL(cdbp_frames_search), METH_FASTCALL, "The best frame of all, or of each range."},
    {"search_many", CDBP_CALL(cdbp_frames_search_many), METH_FASTCALL, "The best frame for each of some queries."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot cdbp_frames_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_frames_init)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_frames_free)},
    {Py_tp_methods, cdbp_frames_methods},
    {Py_tp_getset, cdbp_frames_members},
    {0, NULL},
};
static PyType_Spec cdbp_frames_spec = {"contextdb.core._core.Frames", (int)sizeof(cdbp_frames), 0, Py_TPFLAGS_DEFAULT,
    cdbp_frames_slots};
