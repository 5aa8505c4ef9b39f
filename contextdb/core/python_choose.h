/* ---- Choices for Python: what of a table decides between its rows, as a picker knows it, over arrays that Python owns. */

enum {
    CDBP_TAKEN, CDBP_GROUPS, CDBP_RANKS, CDBP_WEIGHTS, CDBP_UNIQUE, CDBP_CHEAPEST, CDBP_PICKABLE, CDBP_LEVELS, CDBP_ASSETS,
    CDBP_ASSET_ROWS, CDBP_ASSET_STARTS, CDBP_LIMIT_OF, CDBP_LIMIT_ROWS, CDBP_LIMIT_STARTS, CDBP_ONCE, CDBP_SECONDS, CDBP_TURNS, CDBP_COLUMNS,
    CDBP_LIMIT_OF_COLUMN, CDBP_SHARES, CDBP_HEAVIEST, CDBP_CHOICE_ARRAYS
};

typedef struct cdbp_choices {
    PyObject ob_base;
    cdbi_choices choices;
    Py_buffer views[CDBP_CHOICE_ARRAYS];
    size_t n_views;
    int is_made;
} cdbp_choices;

static int cdbp_are_within(const int64_t *numbers, size_t n, int64_t least, size_t limit)
{
    size_t i;
    for (i = 0; i < n; i++)
        if (numbers[i] < least || (numbers[i] >= 0 && (uint64_t)numbers[i] >= limit)) return 0;
    return 1;
}

/* Whether runs of rows begin at 0, ascend, and end with the rows. */
static int cdbp_are_starts(const int64_t *starts, size_t n_starts, size_t n)
{
    size_t i;
    if (n_starts == 0 || starts[0] != 0 || (uint64_t)starts[n_starts - 1] != n) return 0;
    for (i = 1; i < n_starts; i++)
        if (starts[i] < starts[i - 1]) return 0;
    return 1;
}

/* Whether the arrays go together; `shapes` are theirs. */
static int cdbp_are_choices(const cdbi_choices *choices, size_t shapes[][2])
{
    size_t n = choices->n_rows, d = choices->n_depths, n_limits = choices->n_limits, i;
    for (i = CDBP_TAKEN; i <= CDBP_CHEAPEST; i++)
        if (shapes[i][0] != d || shapes[i][1] != n) return 0;
    if (d < 1 || shapes[CDBP_PICKABLE][0] != choices->n_words || shapes[CDBP_LEVELS][1] != choices->n_words) return 0;
    if (n % 64 != 0 && choices->pickable[choices->n_words - 1] >> (n % 64) != 0) return 0;
    if (shapes[CDBP_ASSETS][0] != n || shapes[CDBP_ASSET_ROWS][0] != n || shapes[CDBP_LIMIT_OF][0] != d || shapes[CDBP_LIMIT_OF][1] != n)
        return 0;
    for (i = CDBP_ONCE; i <= CDBP_COLUMNS; i++)
        if (shapes[i][0] != n_limits) return 0;
    if ((choices->n_levels > 0 || choices->is_even || choices->shares) && d != 1) return 0;
    if (shapes[CDBP_HEAVIEST][0] != choices->n_words || (choices->shares && shapes[CDBP_SHARES][0] != n)) return 0;
    return cdbp_are_within(choices->assets, n, 0, choices->n_assets) && cdbp_are_within(choices->asset_rows, n, 0, n)
        && cdbp_are_starts(choices->asset_starts, shapes[CDBP_ASSET_STARTS][0], n)
        && cdbp_are_within(choices->limit_of, d * n, -1, n_limits)
        && cdbp_are_within(choices->limit_rows, shapes[CDBP_LIMIT_ROWS][0], 0, n)
        && cdbp_are_starts(choices->limit_starts, shapes[CDBP_LIMIT_STARTS][0], shapes[CDBP_LIMIT_ROWS][0])
        && shapes[CDBP_LIMIT_STARTS][0] == n_limits + 1 && cdbp_are_within(choices->columns, n_limits, 0, choices->n_columns)
        && cdbp_are_within(choices->limit_of_column, choices->n_columns, -1, n_limits);
}

/* Choices(n_rows, remembers, is_even, arrays), see _core.pyi. */
static int cdbp_choices_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    static const char kinds[] = "iiffbbuuiiiiiibfiiifu";
    static const int dimensions[] = {2, 2, 2, 2, 2, 2, 1, 2, 1, 1, 1, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    cdbp_choices *own = (cdbp_choices *)self;
    cdbi_choices *choices = &own->choices;
    void *items[CDBP_CHOICE_ARRAYS];
    size_t shapes[CDBP_CHOICE_ARRAYS][2], i;
    PyObject *arrays;
    Py_ssize_t n_rows;
    (void)named;
    if (!PyArg_ParseTuple(arguments, "nppO", &n_rows, &choices->remembers, &choices->is_even, &arrays)) return -1;
    if (own->n_views > 0 || n_rows < 0 || cdbp_length(arrays) != CDBP_CHOICE_ARRAYS) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_TypeError, "choices are made once, of the arrays of a table");
        return -1;
    }
    memset(shapes, 0, sizeof shapes);
    for (i = 0; i < CDBP_CHOICE_ARRAYS; i++) {
        PyObject *array = PyTuple_GetItem(arrays, (Py_ssize_t)i);
        int at;
        if (cdbp_take(&own->views[i], array, kinds[i], kinds[i] == 'b' ? 1 : 8, dimensions[i], 0) != 0) return -1;
        own->n_views++;
        items[i] = own->views[i].buf;
        for (at = 0; at < dimensions[i]; at++) shapes[i][at] = (size_t)own->views[i].shape[at];
    }
    choices->n_rows = (size_t)n_rows;
    choices->n_words = ((size_t)n_rows + 63) / 64;
    choices->n_depths = shapes[CDBP_TAKEN][0];
    choices->taken = (const int64_t *)items[CDBP_TAKEN];
    choices->groups = (const int64_t *)items[CDBP_GROUPS];
    choices->ranks = (const double *)items[CDBP_RANKS];
    choices->weights = (const double *)items[CDBP_WEIGHTS];
    choices->is_unique = (const unsigned char *)items[CDBP_UNIQUE];
    choices->is_cheapest = (const unsigned char *)items[CDBP_CHEAPEST];
    choices->pickable = (const uint64_t *)items[CDBP_PICKABLE];
    choices->levels = (const uint64_t *)items[CDBP_LEVELS];
    choices->n_levels = shapes[CDBP_LEVELS][0];
    choices->assets = (const int64_t *)items[CDBP_ASSETS];
    choices->asset_rows = (const int64_t *)items[CDBP_ASSET_ROWS];
    choices->asset_starts = (const int64_t *)items[CDBP_ASSET_STARTS];
    choices->n_assets = shapes[CDBP_ASSET_STARTS][0] ? shapes[CDBP_ASSET_STARTS][0] - 1 : 0;
    choices->limit_of = (const int64_t *)items[CDBP_LIMIT_OF];
    choices->limit_rows = (const int64_t *)items[CDBP_LIMIT_ROWS];
    choices->limit_starts = (const int64_t *)items[CDBP_LIMIT_STARTS];
    choices->once = (const unsigned char *)items[CDBP_ONCE];
    choices->cooldown_s = (const double *)items[CDBP_SECONDS];
    choices->cooldown_turns = (const int64_t *)items[CDBP_TURNS];
    choices->columns = (const int64_t *)items[CDBP_COLUMNS];
    choices->n_limits = shapes[CDBP_ONCE][0];
    choices->limit_of_column = (const int64_t *)items[CDBP_LIMIT_OF_COLUMN];
    choices->n_columns = shapes[CDBP_LIMIT_OF_COLUMN][0];
    choices->shares = shapes[CDBP_SHARES][0] ? (const double *)items[CDBP_SHARES] : NULL;
    choices->heaviest = (const uint64_t *)items[CDBP_HEAVIEST];
    own->is_made = cdbp_are_choices(choices, shapes);
    if (!own->is_made) PyErr_SetString(PyExc_ValueError, "the arrays of a table's choices do not go together");
    return own->is_made ? 0 : -1;
}

static void cdbp_choices_free(PyObject *self)
{
    cdbp_choices *own = (cdbp_choices *)self;
    while (own->n_views > 0) PyBuffer_Release(&own->views[--own->n_views]);
    cdbp_free(self);
}

/* What characters have picked: (turns, recent, rests, rest_turns, rest_s). 0, or -1 with an error. */
static int cdbp_picked(cdbp_arrays *arrays, PyObject *about, cdbi_picked *picked)
{
    PyObject *turns, *recent, *rests, *rest_turns, *rest_s;
    size_t shapes[5][2];
    if (cdbp_length(about) < 0 || !PyArg_ParseTuple(about, "OOOOO", &turns, &recent, &rests, &rest_turns, &rest_s)) return -1;
    memset(shapes, 0, sizeof shapes);
    picked->turns = (int64_t *)cdbp_items(arrays, turns, 'i', 8, 1, 1, shapes[0]);
    picked->recent = picked->turns ? (int64_t *)cdbp_items(arrays, recent, 'i', 8, 2, 1, shapes[1]) : NULL;
    picked->rests = picked->recent ? (int64_t *)cdbp_items(arrays, rests, 'i', 8, 2, 1, shapes[2]) : NULL;
    picked->rest_turns = picked->rests ? (int64_t *)cdbp_items(arrays, rest_turns, 'i', 8, 2, 1, shapes[3]) : NULL;
    picked->rest_s = picked->rest_turns ? (double *)cdbp_items(arrays, rest_s, 'f', 8, 2, 1, shapes[4]) : NULL;
    if (!picked->rest_s) return -1;
    picked->n_characters = shapes[0][0];
    picked->memory = shapes[1][1];
    picked->n_rests = shapes[2][1];
    if (shapes[1][0] == shapes[0][0] && shapes[2][0] == shapes[0][0] && memcmp(shapes[2], shapes[3], sizeof shapes[2]) == 0
        && memcmp(shapes[2], shapes[4], sizeof shapes[2]) == 0)
        return 0;
    PyErr_SetString(PyExc_ValueError, "the memories of characters do not go together");
    return -1;
}

/* The rows that a policy refuses: (context, depth, rows...). */
static PyObject *cdbp_refusal(size_t context, int64_t depth, const int64_t *rows, size_t n)
{
    PyObject *tuple = PyTuple_New((Py_ssize_t)n + 2);
    size_t i;
    for (i = 0; tuple && i < n + 2; i++) {
        PyObject *number = PyLong_FromLongLong(i == 0 ? (long long)context : i == 1 ? (long long)depth : (long long)rows[i - 2]);
        if (number) PyTuple_SetItem(tuple, (Py_ssize_t)i, number);
        else cdbp_clear(&tuple);
    }
    return tuple;
}

/* choices.pick(masks, who, slots, seed, time_s, picked, costs, rows, stages): see _core.pyi. */
static PyObject *cdbp_choices_pick(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    const cdbp_choices *own = (const cdbp_choices *)self;
    const cdbi_choices *choices = &own->choices;
    cdbp_arrays arrays;
    cdbi_picked picked;
    cdbi_turn turn;
    const uint64_t *masks;
    const int64_t *who = NULL, *slots = NULL;
    int64_t *rows = NULL, depth = -1;
    void *costs = NULL, *stages = NULL, *room = NULL;
    size_t shape[2] = {0, 0}, sizes[4] = {0, 0, 0, 0}, n_words = choices->n_words, n_refused = 0, k = 0, held = 0, i;
    PyObject *refusal = NULL;
    arrays.n = 0;
    memset(&turn, 0, sizeof turn);
    if (n_arguments != 9 || !own->is_made) {
        PyErr_SetString(PyExc_TypeError, "pick takes masks, who, slots, seed, time_s, picked, costs, rows and stages");
        return NULL;
    }
    turn.seed = (uint64_t)PyLong_AsLongLong(arguments[3]);
    if (!PyErr_Occurred()) turn.time_s = PyFloat_AsDouble(arguments[4]);
    if (PyErr_Occurred()) return NULL;
    masks = (const uint64_t *)cdbp_items(&arrays, arguments[0], 'u', 8, 2, 0, shape);
    if (masks) who = (const int64_t *)cdbp_items(&arrays, arguments[1], 'i', 8, 1, 0, &sizes[0]);
    if (who) slots = (const int64_t *)cdbp_items(&arrays, arguments[2], 'i', 8, 1, 0, &sizes[1]);
    if (slots) rows = (int64_t *)cdbp_items(&arrays, arguments[7], 'i', 8, 1, 1, &sizes[2]);
    if (rows && cdbp_picked(&arrays, arguments[5], &picked) == 0
        && cdbp_maybe(&arrays, arguments[8], 'u', 2, 3, n_words, &stages) == 0) {
        if (arguments[6] != Py_None) {
            size_t pairs[2] = {0, 0};
            costs = cdbp_items(&arrays, arguments[6], 'f', 8, 2, 0, pairs);
            for (i = 0; costs && i < shape[0] * shape[1]; i++) held += (size_t)cdbi_count_bits(masks[i]);
            if (costs && (pairs[0] != choices->n_depths || pairs[1] != held))
                PyErr_SetString(PyExc_ValueError, "there are other costs than valid rows");
            turn.n_costs = pairs[1];
        }
        if (shape[1] != n_words || sizes[0] != shape[0] || sizes[1] != shape[0] || sizes[2] != shape[0]
            || !cdbp_are_within(slots, shape[0], 0, picked.n_characters) || (stages && shape[0] != 1))
            PyErr_SetString(PyExc_ValueError, "the arrays of a pick do not go together");
        if (!PyErr_Occurred()) room = PyMem_Malloc((2 * n_words + 3 * choices->n_rows + 3) * 8);
        if (!room && !PyErr_Occurred()) PyErr_NoMemory();
    }
    if (room) {
        PyThreadState *thread;
        turn.choices = choices;
        turn.picked = &picked;
        turn.awake = (uint64_t *)room;
        turn.rows = turn.awake + n_words;
        turn.list = (int64_t *)(void *)(turn.rows + n_words + 1);
        turn.places = turn.list + choices->n_rows + 1;
        turn.sums = (double *)(void *)(turn.places + choices->n_rows);
        turn.costs = (const double *)costs;
        thread = PyEval_SaveThread();
        for (; k < shape[0]; k++) {
            const uint64_t *valid = masks + k * n_words;
            turn.who = who[k];
            turn.slot = (size_t)slots[k];
            rows[k] = cdbi_choose(&turn, valid, (uint64_t *)stages, &depth, &n_refused);
            if (rows[k] == -2) break;
            if (turn.costs) turn.costs += cdb_count(valid, n_words);
        }
        PyEval_RestoreThread(thread);
        if (k < shape[0]) refusal = cdbp_refusal(k, depth, turn.list, n_refused);
        PyMem_Free(room);
    }
    cdbp_release(&arrays);
    if (refusal) return refusal;
    return PyErr_Occurred() ? NULL : cdbp_new_ref(Py_None);
}

/* choices.remember(slots, rows, time_s, picked): how many more places for rests a character needs; nothing is remembered unless 0. */
static PyObject *cdbp_choices_remember(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    const cdbp_choices *own = (const cdbp_choices *)self;
    const cdbi_choices *choices = &own->choices;
    cdbp_arrays arrays;
    cdbi_picked picked;
    const int64_t *slots, *rows = NULL;
    size_t n[2] = {0, 0}, k, missing = 0;
    double time_s;
    arrays.n = 0;
    if (n_arguments != 4 || !own->is_made) {
        PyErr_SetString(PyExc_TypeError, "remember takes slots, rows, time_s and picked");
        return NULL;
    }
    time_s = PyFloat_AsDouble(arguments[2]);
    if (PyErr_Occurred()) return NULL;
    slots = (const int64_t *)cdbp_items(&arrays, arguments[0], 'i', 8, 1, 0, &n[0]);
    if (slots) rows = (const int64_t *)cdbp_items(&arrays, arguments[1], 'i', 8, 1, 0, &n[1]);
    if (rows && cdbp_picked(&arrays, arguments[3], &picked) == 0) {
        if (n[0] != n[1] || !cdbp_are_within(slots, n[0], 0, picked.n_characters) || !cdbp_are_within(rows, n[0], -1, choices->n_rows))
            PyErr_SetString(PyExc_ValueError, "the arrays of picks do not go together");
        else {
            PyThreadState *thread = PyEval_SaveThread();
            for (k = 0; choices->n_limits > 0 && k < n[0]; k++) {
                size_t more = 0;
                cdbi_forget_ended(choices, &picked, (size_t)slots[k], time_s);
                if (rows[k] >= 0) more = cdbi_missing_places(choices, &picked, (size_t)slots[k], rows[k]);
                if (more > missing) missing = more;
            }
            for (k = 0; missing == 0 && k < n[0]; k++) cdbi_remember(choices, &picked, (size_t)slots[k], rows[k], time_s);
            PyEval_RestoreThread(thread);
        }
    }
    cdbp_release(&arrays);
    return PyErr_Occurred() ? NULL : PyLong_FromSsize_t((Py_ssize_t)missing);
}

static PyMethodDef cdbp_choices_methods[] = {
    {"pick", CDBP_CALL(cdbp_choices_pick), METH_FASTCALL, "Pick a row for each of many characters."},
    {"remember", CDBP_CALL(cdbp_choices_remember), METH_FASTCALL, "Remember what characters picked."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot cdbp_choices_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_choices_init)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_choices_free)},
    {Py_tp_methods, cdbp_choices_methods},
    {0, NULL},
};
static PyType_Spec cdbp_choices_spec = {"contextdb.core._core.Choices", (int)sizeof(cdbp_choices), 0, Py_TPFLAGS_DEFAULT,
    cdbp_choices_slots};
