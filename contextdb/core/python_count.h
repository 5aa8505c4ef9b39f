/* ---- Coverage for Python: boxes that are counted and searched, and contexts that are looked up in masks. Other threads run meanwhile;
 * now and then `look` is called with the work that is done so far, and signals are handled: what either raises ends the call. */

#define CDBP_MOST_WORK ((int64_t)1 << 60)

typedef struct cdbp_boxes {
    PyObject ob_base;
    cdbp_arrays arrays;
    cdbc_boxes boxes;
    size_t n_classes;
    int is_made;
} cdbp_boxes;

typedef struct cdbp_looker {
    PyObject *function;             /* or None */
    PyThreadState *thread;          /* of the call, while it does not have Python */
} cdbp_looker;

static int cdbp_look(void *looker, int64_t done)
{
    cdbp_looker *own = (cdbp_looker *)looker;
    PyObject *number, *answer;
    int stops;
    PyEval_RestoreThread(own->thread);
    stops = PyErr_CheckSignals() != 0;
    if (!stops && own->function != Py_None) {
        number = PyLong_FromLongLong(done);
        answer = number ? PyObject_CallFunctionObjArgs(own->function, number, NULL) : NULL;
        if (number) Py_DecRef(number);
        if (answer) Py_DecRef(answer);
        stops = !answer;
    }
    own->thread = PyEval_SaveThread();
    return stops;
}

static PyObject *cdbp_no_boxes(void)
{
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "boxes, weights and numbers do not go together");
    return NULL;
}

/* Boxes(cells, runs, first, hashes, edges) */
static int cdbp_boxes_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_boxes *own = (cdbp_boxes *)self;
    cdbc_boxes *boxes = &own->boxes;
    PyObject *given[5];
    size_t cells[2] = {0, 0}, runs[2] = {0, 0}, first = 0, hashes[2] = {0, 0}, edges = 0;
    int32_t *factor_of;
    (void)named;
    if (own->is_made || !PyArg_ParseTuple(arguments, "OOOOO", given, given + 1, given + 2, given + 3, given + 4)) {
        cdbp_no_boxes();
        return -1;
    }
    cdbp_release(&own->arrays);
    boxes->cells = (const int32_t *)cdbp_items(&own->arrays, given[0], 'i', 4, 2, 0, cells);
    if (boxes->cells) boxes->runs = (const int32_t *)cdbp_items(&own->arrays, given[1], 'i', 4, 2, 0, runs);
    if (boxes->runs) boxes->first = (const int64_t *)cdbp_items(&own->arrays, given[2], 'i', 8, 1, 0, &first);
    if (boxes->first) boxes->hashes = (const uint64_t *)cdbp_items(&own->arrays, given[3], 'u', 8, 2, 0, hashes);
    if (boxes->hashes) boxes->edges = (const int64_t *)cdbp_items(&own->arrays, given[4], 'i', 8, 1, 0, &edges);
    if (!boxes->edges) return -1;
    boxes->n_boxes = cells[0];
    boxes->n_factors = cells[1];
    boxes->n_runs = runs[0];
    boxes->n_cells = hashes[0];
    if (first != hashes[0] + 1 || edges != cells[1] + 1 || runs[1] != 2 || hashes[1] != 2 || boxes->edges[cells[1]] < 0) {
        cdbp_no_boxes();
        return -1;
    }
    own->n_classes = (size_t)boxes->edges[cells[1]];
    factor_of = (int32_t *)PyMem_Malloc((boxes->n_cells + 1) * sizeof(int32_t));
    if (!factor_of) PyErr_NoMemory();
    else own->is_made = cdbc_are_boxes(boxes, own->n_classes, factor_of);
    if (factor_of) PyMem_Free(factor_of);
    if (!own->is_made) cdbp_no_boxes();
    return own->is_made ? 0 : -1;
}

static void cdbp_boxes_free(PyObject *self)
{
    cdbp_release(&((cdbp_boxes *)self)->arrays);
    cdbp_free(self);
}

/* The weights of all classes: numbers from 0 up. */
static const double *cdbp_weights(const cdbp_boxes *own, cdbp_arrays *arrays, PyObject *array)
{
    size_t n, k;
    const double *weights = own->is_made ? (const double *)cdbp_items(arrays, array, 'f', 8, 1, 0, &n) : NULL;
    for (k = 0; weights && n == own->n_classes && k < n && weights[k] >= 0.0 && weights[k] <= 1e300; k++) {}
    return weights && n == own->n_classes && k == n ? weights : NULL;
}

/* The chosen boxes, by number, ascending. */
static const int32_t *cdbp_chosen(const cdbp_boxes *own, cdbp_arrays *arrays, PyObject *array, size_t *n)
{
    const int32_t *chosen = (const int32_t *)cdbp_items(arrays, array, 'i', 4, 1, 0, n);
    int64_t before = -1;
    size_t i;
    for (i = 0; chosen && i < *n; before = chosen[i++])
        if (chosen[i] <= before || (size_t)chosen[i] >= own->boxes.n_boxes) return NULL;
    return chosen;
}

static int cdbp_take_work(PyObject *number, int64_t *work)
{
    *work = PyLong_AsLongLong(number);
    return *work >= 0 && *work <= CDBP_MOST_WORK;
}

/* Begin a count without Python. */
static void cdbp_begin(cdbc_count *count, cdbp_looker *looker, PyObject *function)
{
    memset(count, 0, sizeof *count);
    looker->function = function;
    count->watch.look = cdbp_look;
    count->watch.looker = looker;
    looker->thread = PyEval_SaveThread();
}

/* Give the arrays back; the answer where the count was neither stopped nor short of memory. */
static PyObject *cdbp_answered(cdbp_arrays *arrays, const cdbc_count *count, PyObject *answer)
{
    cdbp_release(arrays);
    if (count && (count->watch.is_stopped || count->watch.has_no_memory)) {
        if (answer) Py_DecRef(answer);
        return count->watch.is_stopped ? NULL : PyErr_NoMemory();
    }
    return answer;
}

/* boxes.uncovered(weights, first_work, work, look) */
static PyObject *cdbp_uncovered(PyObject *self, PyObject *const *arguments, Py_ssize_t n)
{
    const cdbp_boxes *own = (const cdbp_boxes *)self;
    cdbp_arrays arrays;
    cdbp_looker looker;
    cdbc_count count;
    const double *weights;
    int64_t first_work, work;
    double low, high;
    arrays.n = 0;
    weights = n == 4 ? cdbp_weights(own, &arrays, arguments[0]) : NULL;
    if (!weights || !cdbp_take_work(arguments[1], &first_work) || !cdbp_take_work(arguments[2], &work))
        return cdbp_answered(&arrays, NULL, cdbp_no_boxes());
    cdbp_begin(&count, &looker, arguments[3]);
    cdbc_uncovered(&count, &own->boxes, weights, first_work, work, &low, &high);
    PyEval_RestoreThread(looker.thread);
    return cdbp_answered(&arrays, &count,
        count.watch.is_stopped ? NULL : Py_BuildValue("(ddLi)", low, high, (long long)count.work, (int)(count.n_cut > 0)));
}

/* boxes.leaves_open(chosen, weights, done, work, look) */
static PyObject *cdbp_leaves_open(PyObject *self, PyObject *const *arguments, Py_ssize_t n)
{
    const cdbp_boxes *own = (const cdbp_boxes *)self;
    cdbp_arrays arrays;
    cdbp_looker looker;
    cdbc_count count;
    const int32_t *chosen;
    const double *weights;
    int64_t done, work;
    size_t n_chosen;
    int is_open;
    arrays.n = 0;
    chosen = n == 5 ? cdbp_chosen(own, &arrays, arguments[0], &n_chosen) : NULL;
    weights = chosen ? cdbp_weights(own, &arrays, arguments[1]) : NULL;
    if (!weights || !cdbp_take_work(arguments[2], &done) || !cdbp_take_work(arguments[3], &work))
        return cdbp_answered(&arrays, NULL, cdbp_no_boxes());
    cdbp_begin(&count, &looker, arguments[4]);
    count.work = done;
    cdbc_leaves_open(&count, &own->boxes, chosen, n_chosen, weights, work, &is_open);
    PyEval_RestoreThread(looker.thread);
    return cdbp_answered(&arrays, &count,
        count.watch.is_stopped ? NULL : Py_BuildValue("(iiL)", is_open, (int)(count.n_cut > 0), (long long)count.work));
}

/* boxes.first_holders(chosen, weights, alike, holders, look) */
static PyObject *cdbp_first_holders(PyObject *self, PyObject *const *arguments, Py_ssize_t n)
{
    const cdbp_boxes *own = (const cdbp_boxes *)self;
    cdbp_arrays arrays;
    cdbp_looker looker;
    cdbc_count count;
    const int32_t *chosen;
    const double *weights;
    const int64_t *alike;
    int64_t *holders;
    size_t n_chosen, n_alike = 0, n_holders = 0;
    arrays.n = 0;
    chosen = n == 5 ? cdbp_chosen(own, &arrays, arguments[0], &n_chosen) : NULL;
    weights = chosen ? cdbp_weights(own, &arrays, arguments[1]) : NULL;
    alike = weights ? (const int64_t *)cdbp_items(&arrays, arguments[2], 'i', 8, 1, 0, &n_alike) : NULL;
    holders = alike ? (int64_t *)cdbp_items(&arrays, arguments[3], 'i', 8, 1, 1, &n_holders) : NULL;
    if (!holders || n_alike != n_chosen || n_holders != n_chosen) return cdbp_answered(&arrays, NULL, cdbp_no_boxes());
    cdbp_begin(&count, &looker, arguments[4]);
    cdbc_first_holders(&count, &own->boxes, chosen, n_chosen, weights, alike, holders);
    PyEval_RestoreThread(looker.thread);
    return cdbp_answered(&arrays, &count, cdbp_new_ref(Py_None));
}

/* ---- Contexts that are looked up */

typedef struct cdbp_lookup {        /* contexts of one class of each factor, and for each class the mask of the boxes that accept it */
    const int32_t *codes;           /* [n][n_factors] */
    const int64_t *starts;          /* [n_factors]: where the masks of each factor begin */
    const uint64_t *masks;
    const double *weights;          /* [n], or NULL: 1 each */
    int64_t *counts, *firsts;       /* [n] */
    double *hits;                   /* [n_boxes] */
    size_t n, n_factors, n_masks, n_words, n_boxes;
} cdbp_lookup;

/* Whether the classes of contexts are among the masks. */
static int cdbp_are_classes(const cdbp_lookup *own)
{
    size_t i, f;
    for (f = 0; f < own->n_factors; f++)
        if (own->starts[f] < 0 || (uint64_t)own->starts[f] > own->n_masks) return 0;
    for (i = 0; i < own->n; i++)
        for (f = 0; f < own->n_factors; f++) {
            int32_t code = own->codes[i * own->n_factors + f];
            if (code < 0 || (size_t)own->starts[f] + (size_t)code >= own->n_masks) return 0;
        }
    return 1;
}

/* Count the boxes that hold each context, name the first, and add up what the contexts of each box weigh, in their order. `rows` is room for a mask,
 * `every` one of all boxes, `masks` room for one for each factor. */
static void cdbp_count_each(const cdbp_lookup *own, uint64_t *rows, const uint64_t *every, const uint64_t **masks)
{
    size_t i, f, w;
    for (i = 0; i < own->n; i++) {
        double weight = own->weights ? own->weights[i] : 1.0;
        for (f = 0; f < own->n_factors; f++)
            masks[f] = own->masks + (size_t)(own->starts[f] + own->codes[i * own->n_factors + f]) * own->n_words;
        cdbp_and(rows, every, masks, own->n_factors, own->n_words);
        own->counts[i] = cdb_count(rows, own->n_words);
        own->firsts[i] = cdb_next_row(rows, own->n_words, -1);
        for (w = 0; w < own->n_words; w++) {
            uint64_t rest = rows[w];
            while (rest) own->hits[w * 64 + cdbc_take_bit(&rest)] += weight;
        }
    }
}

/* count_holders(codes, starts, masks, weights or None, counts, firsts, hits) */
static PyObject *cdbp_count_holders(PyObject *module, PyObject *const *arguments, Py_ssize_t n)
{
    cdbp_arrays arrays;
    cdbp_lookup own;
    PyThreadState *thread;
    uint64_t *memory;
    size_t codes[2] = {0, 0}, n_starts = 0, masks[2] = {0, 0}, n_weights, n_counts = 0, n_firsts = 0, w;
    int are_classes;
    (void)module;
    arrays.n = 0;
    memset(&own, 0, sizeof own);
    if (n == 7) own.codes = (const int32_t *)cdbp_items(&arrays, arguments[0], 'i', 4, 2, 0, codes);
    if (own.codes) own.starts = (const int64_t *)cdbp_items(&arrays, arguments[1], 'i', 8, 1, 0, &n_starts);
    if (own.starts) own.masks = (const uint64_t *)cdbp_items(&arrays, arguments[2], 'u', 8, 2, 0, masks);
    n_weights = codes[0];
    if (own.masks && arguments[3] != Py_None)
        own.weights = (const double *)cdbp_items(&arrays, arguments[3], 'f', 8, 1, 0, &n_weights);
    if (own.masks && (own.weights || arguments[3] == Py_None))
        own.counts = (int64_t *)cdbp_items(&arrays, arguments[4], 'i', 8, 1, 1, &n_counts);
    if (own.counts) own.firsts = (int64_t *)cdbp_items(&arrays, arguments[5], 'i', 8, 1, 1, &n_firsts);
    if (own.firsts) own.hits = (double *)cdbp_items(&arrays, arguments[6], 'f', 8, 1, 1, &own.n_boxes);
    own.n = codes[0];
    own.n_factors = codes[1];
    own.n_masks = masks[0];
    own.n_words = cdbc_words_of(own.n_boxes);
    if (!own.hits || n_starts != codes[1] || n_weights != own.n || n_counts != own.n || n_firsts != own.n
        || (n_starts && masks[1] != own.n_words))
        return cdbp_answered(&arrays, NULL, cdbp_no_boxes());
    memory = (uint64_t *)PyMem_Malloc(2 * own.n_words * sizeof(uint64_t) + (own.n_factors + 1) * sizeof(uint64_t *));
    if (!memory) return cdbp_answered(&arrays, NULL, PyErr_NoMemory());
    for (w = 0; w < own.n_words; w++) memory[w] = cdbc_boxes_in(own.n_boxes, w);
    thread = PyEval_SaveThread();
    are_classes = cdbp_are_classes(&own);
    if (are_classes) cdbp_count_each(&own, memory + own.n_words, memory, (const uint64_t **)(void *)(memory + 2 * own.n_words));
    PyEval_RestoreThread(thread);
    PyMem_Free(memory);
    return cdbp_answered(&arrays, NULL, are_classes ? cdbp_new_ref(Py_None) : cdbp_no_boxes());
}

static PyMethodDef cdbp_boxes_methods[] = {
    {"uncovered", CDBP_CALL(cdbp_uncovered), METH_FASTCALL, "Bounds of the share of contexts that no box holds."},
    {"leaves_open", CDBP_CALL(cdbp_leaves_open), METH_FASTCALL, "Whether a context of some weight is in none of some boxes."},
    {"first_holders", CDBP_CALL(cdbp_first_holders), METH_FASTCALL, "Write the first of some boxes that holds each of them."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot cdbp_boxes_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_boxes_init)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_boxes_free)},
    {Py_tp_methods, cdbp_boxes_methods},
    {0, NULL},
};
static PyType_Spec cdbp_boxes_spec = {"contextdb.core._core.Boxes", (int)sizeof(cdbp_boxes), 0, Py_TPFLAGS_DEFAULT, cdbp_boxes_slots};

#define CDBP_COUNT_FUNCTIONS {"count_holders", CDBP_CALL(cdbp_count_holders), METH_FASTCALL, \
    "Write how many boxes hold each context, and add up what the contexts of each box weigh."},
