/* ---- Batches for Python: the masks of a table for many contexts at once, over arrays that Python owns and that the batch holds. */

typedef struct cdbp_batch {
    PyObject ob_base;
    cdbi_batch batch;
    cdb_column *wide;
    uint64_t **made;                /* the leaves of each group of several slots */
    Py_buffer *views;
    size_t n_views;
    int is_made;
} cdbp_batch;

/* The masks of an array in so many dimensions, the last of which is the words of a mask; NULL with an error. */
static const uint64_t *cdbp_batch_masks(cdbp_batch *own, PyObject *array, int n_dimensions, const Py_ssize_t **shape)
{
    Py_buffer *view = &own->views[own->n_views];
    if (cdbp_take(view, array, 'u', sizeof(uint64_t), n_dimensions, 0) != 0) return NULL;
    own->n_views++;
    *shape = view->shape;
    if ((size_t)view->shape[n_dimensions - 1] == own->batch.n_words) return (const uint64_t *)view->buf;
    PyErr_SetString(PyExc_ValueError, "an array has another shape than it must have");
    return NULL;
}

/* A slot: (first, is_joined, masks). */
static int cdbp_plain_place(cdbp_batch *own, PyObject *about, cdbi_code_slot *place)
{
    PyObject *masks;
    const Py_ssize_t *shape;
    int first, is_joined;
    if (cdbp_length(about) < 0 || !PyArg_ParseTuple(about, "ipO", &first, &is_joined, &masks)) return -1;
    place->masks = cdbp_batch_masks(own, masks, 2, &shape);
    if (!place->masks) return -1;
    if (first < 1 || shape[0] < 1 || shape[0] > INT32_MAX - first) {
        PyErr_SetString(PyExc_ValueError, "a slot has codes that are none");
        return -1;
    }
    place->first = first;
    place->n_masks = (uint32_t)shape[0];
    place->n_classes = is_joined ? place->n_masks - 1 : 0;
    return 0;
}

/* A wide column: (n_bounds, shift, low, high, any_mask). */
static int cdbp_wide_place(cdbp_batch *own, PyObject *about, cdb_column *column, cdbi_code_slot *place)
{
    PyObject *low, *high, *any_mask;
    const Py_ssize_t *shape, *other, *single;
    Py_ssize_t n_bounds;
    int shift;
    if (cdbp_length(about) < 0 || !PyArg_ParseTuple(about, "niOOO", &n_bounds, &shift, &low, &high, &any_mask)) return -1;
    column->low = cdbp_batch_masks(own, low, 3, &shape);
    column->high = column->low ? cdbp_batch_masks(own, high, 3, &other) : NULL;
    column->any_mask = column->high ? cdbp_batch_masks(own, any_mask, 1, &single) : NULL;
    if (!column->any_mask) return -1;
    column->kind = CDBI_WIDE;
    column->n_bounds = (size_t)n_bounds;
    column->shift = (unsigned)shift;
    column->n_layers = (size_t)shape[0];
    column->n_digits = (size_t)shape[1];
    if (n_bounds < 0 || n_bounds > INT32_MAX - 2 || shift < 0 || shift > 30 || shape[0] != other[0] || shape[1] != other[1]
        || !cdbi_is_wide(column)) {
        PyErr_SetString(PyExc_ValueError, "a wide column has parts that do not go together");
        return -1;
    }
    place->wide = column;
    place->n_masks = (uint32_t)n_bounds + 2;
    return 0;
}

/* The leaves of all groups: 0, or -1 with an error. Those of a slot alone are its own masks. */
static int cdbp_make_leaves(cdbp_batch *own)
{
    cdbi_batch *batch = &own->batch;
    size_t g;
    for (g = 0; g < batch->n_groups; g++) {
        size_t n = cdbi_count_leaves(batch, g) * batch->n_words;
        int is_alone = batch->edges[g + 1] - batch->edges[g] == 1;
        batch->leaves[g] = batch->places[batch->members[batch->edges[g]]].masks;
        if (is_alone) continue;
        batch->leaves[g] = own->made[g] = (uint64_t *)PyMem_Malloc((n + 1) * sizeof(uint64_t));
        if (!own->made[g]) {
            PyErr_NoMemory();
            return -1;
        }
        cdbi_make_leaves(batch, g, own->made[g]);
    }
    return 0;
}

/* Batch(n_rows, enabled, plain, wide), see _core.pyi. */
static int cdbp_batch_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_batch *own = (cdbp_batch *)self;
    cdbi_batch *batch = &own->batch;
    PyObject *enabled, *plain, *wide;
    const Py_ssize_t *shape;
    Py_ssize_t n_rows, n_plain, n_wide, i;
    size_t n;
    (void)named;
    if (!PyArg_ParseTuple(arguments, "nOOO", &n_rows, &enabled, &plain, &wide)) return -1;
    n_plain = cdbp_length(plain);
    n_wide = n_plain < 0 ? -1 : cdbp_length(wide);
    if (n_wide < 0) return -1;
    if (own->views || n_rows < 0) {
        PyErr_SetString(PyExc_TypeError, "a batch is made once, of the rows and masks of a table");
        return -1;
    }
    n = (size_t)(n_plain + n_wide) + 1;
    batch->n_rows = (size_t)n_rows;
    batch->n_words = ((size_t)n_rows + 63) / 64;
    own->views = (Py_buffer *)PyMem_Calloc(3 * n, sizeof *own->views);
    own->wide = (cdb_column *)PyMem_Calloc(n, sizeof *own->wide);
    batch->places = (cdbi_code_slot *)PyMem_Calloc(n, sizeof *batch->places);
    batch->members = (size_t *)PyMem_Calloc(2 * n, sizeof *batch->members);
    batch->leaves = (const uint64_t **)PyMem_Calloc(n, sizeof *batch->leaves);
    own->made = (uint64_t **)PyMem_Calloc(n, sizeof *own->made);
    if (!own->made || !own->views || !own->wide || !batch->places || !batch->members || !batch->leaves) {
        PyErr_NoMemory();
        return -1;
    }
    batch->edges = batch->members + n;
    batch->enabled = cdbp_batch_masks(own, enabled, 1, &shape);
    if (!batch->enabled) return -1;
    for (i = 0; i < n_plain; i++, batch->n_places++)
        if (cdbp_plain_place(own, PyTuple_GetItem(plain, i), &batch->places[batch->n_places]) != 0) return -1;
    for (i = 0; i < n_wide; i++, batch->n_places++)
        if (cdbp_wide_place(own, PyTuple_GetItem(wide, i), &own->wide[i], &batch->places[batch->n_places]) != 0) return -1;
    cdbi_join_places(batch);
    if (cdbp_make_leaves(own) != 0) return -1;
    own->is_made = 1;
    return 0;
}

static void cdbp_batch_free(PyObject *self)
{
    cdbp_batch *own = (cdbp_batch *)self;
    size_t g;
    for (g = 0; own->made && g < own->batch.n_groups; g++) PyMem_Free(own->made[g]);
    PyMem_Free(own->made);
    while (own->n_views > 0) PyBuffer_Release(&own->views[--own->n_views]);
    PyMem_Free(own->views);
    PyMem_Free(own->wide);
    PyMem_Free(own->batch.places);
    PyMem_Free(own->batch.members);
    PyMem_Free((void *)own->batch.leaves);
    cdbp_free(self);
}

#ifdef CDBP_HAS_AVX2
CDBP_HAS_AVX2 static int cdbp_answer_batch_in_wide_registers(const cdbi_batch *batch, const int32_t *codes, size_t n_contexts,
    size_t start, size_t stop, const cdbi_sums *sums, int32_t *room, const uint64_t **masks, uint64_t *rows)
{
    return cdbi_answer_batch(batch, codes, n_contexts, start, stop, sums, room, masks, rows);
}
#else
#define cdbp_answer_batch_in_wide_registers cdbi_answer_batch
#endif

/* An array of a call, or None: 0 with its items or NULL, or -1 with an error. Its first dimension is `n` long at least. */
static int cdbp_maybe(cdbp_arrays *arrays, PyObject *array, char kind, int n_dimensions, size_t n, size_t width, void **items)
{
    size_t shape[2] = {0, 0};
    *items = NULL;
    if (array == Py_None) return 0;
    *items = cdbp_items(arrays, array, kind, 8, n_dimensions, 1, shape);
    if (!*items) return -1;
    if (shape[0] >= n && (n_dimensions == 1 || shape[1] == width)) return 0;
    PyErr_SetString(PyExc_ValueError, "an array has another shape than it must have");
    return -1;
}

/* batch.answer(codes, start, stop, counts, hits, weights, masks): see _core.pyi. */
static PyObject *cdbp_batch_answer(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    const cdbp_batch *own = (const cdbp_batch *)self;
    const cdbi_batch *batch = &own->batch;
    cdbp_arrays arrays;
    cdbi_sums sums;
    size_t shape[2] = {0, 0}, n_words = batch->n_words;
    long long start, stop;
    int32_t *codes;
    int is_right = -1;
    void *counts, *hits, *weights, *masks, *room = NULL;
    arrays.n = 0;
    if (n_arguments != 7 || !own->is_made) {
        PyErr_SetString(PyExc_TypeError, "answer takes codes, start, stop, counts, hits, weights and masks");
        return NULL;
    }
    start = PyLong_AsLongLong(arguments[1]);
    stop = PyErr_Occurred() ? -1 : PyLong_AsLongLong(arguments[2]);
    if (PyErr_Occurred()) return NULL;
    codes = (int32_t *)cdbp_items(&arrays, arguments[0], 'i', sizeof(int32_t), 2, 0, shape);
    if (codes && (shape[0] != batch->n_places || start < 0 || stop < start || (size_t)stop > shape[1]))
        PyErr_SetString(PyExc_ValueError, "the codes have another shape than the table's");
    else if (codes && cdbp_maybe(&arrays, arguments[3], 'i', 1, shape[1], 0, &counts) == 0
        && cdbp_maybe(&arrays, arguments[4], 'i', 1, 64 * n_words, 0, &hits) == 0
        && cdbp_maybe(&arrays, arguments[5], 'i', 1, shape[1], 0, &weights) == 0
        && cdbp_maybe(&arrays, arguments[6], 'u', 2, shape[1], n_words, &masks) == 0) {
        sums.counts = (int64_t *)counts;
        sums.hits = (int64_t *)hits;
        sums.weights = (const int64_t *)weights;
        sums.masks = (uint64_t *)masks;
        room = PyMem_Malloc((batch->n_places * (CDBI_CONTEXTS + 1) + n_words + 1) * 8
            + (batch->n_groups + 1) * CDBI_CONTEXTS * sizeof(int32_t));
        if (!room) PyErr_NoMemory();
    }
    if (room) {
        const uint64_t **own_masks = (const uint64_t **)room;
        uint64_t *rows = (uint64_t *)room + batch->n_places * (CDBI_CONTEXTS + 1);
        int32_t *leaves = (int32_t *)(void *)(rows + n_words + 1);
        PyThreadState *thread = PyEval_SaveThread();
        is_right = CDBP_HAS_WIDE_REGISTERS
            ? cdbp_answer_batch_in_wide_registers(batch, codes, shape[1], (size_t)start, (size_t)stop, &sums, leaves, own_masks, rows)
            : cdbi_answer_batch(batch, codes, shape[1], (size_t)start, (size_t)stop, &sums, leaves, own_masks, rows);
        PyEval_RestoreThread(thread);
        PyMem_Free(room);
    }
    cdbp_release(&arrays);
    return is_right < 0 ? NULL : cdbp_new_ref(is_right ? Py_True : Py_False);
}

static PyMethodDef cdbp_batch_methods[] = {
    {"answer", CDBP_CALL(cdbp_batch_answer), METH_FASTCALL,
        "Answer some contexts by their codes; False where a code is none of its slot."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot cdbp_batch_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_batch_init)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_batch_free)},
    {Py_tp_methods, cdbp_batch_methods},
    {0, NULL},
};
static PyType_Spec cdbp_batch_spec = {"contextdb.core._core.Batch", (int)sizeof(cdbp_batch), 0, Py_TPFLAGS_DEFAULT, cdbp_batch_slots};
