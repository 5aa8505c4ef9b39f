/* ---- Live contexts for Python: facts that are kept between questions. Setting one reads it; a question answers all of them. While
 * a fact is one that the core cannot hold, such as a set of values, the careful way answers. */

#define CDBP_NONE ((size_t)-1)

typedef struct cdbp_live {
    PyObject ob_base;
    PyObject *table;                /* a Table; NULL before it is made, as all that follows */
    PyObject **given;               /* for each condition its fact as it was set, None where it is missing; NULL for a derived one */
    PyObject *odd;                  /* dict: the names of facts that the core cannot hold */
    PyObject *last;                 /* the last answer, or NULL */
    PyObject **own;                 /* for each condition what its fact points into, or NULL */
    const uint64_t **masks;         /* for each condition the mask of its fact, or NULL where a query must find it */
    const uint64_t **groups;        /* for each group of columns the mask of its facts, while none of them is missing */
    size_t *classes;                /* of each fact in its group */
    size_t n_missing;               /* facts that are missing or wrong: their class is CDBP_NONE */
    cdbp_frame now, read;           /* the facts; and room to read one */
    void *memory;
    cdb_unknown unknown;
    int is_led;                     /* more hangs on an answer than the facts: Python asks */
    int keeps_last;                 /* an answer with the same rows is the same object */
    int has_masks;                  /* all that a question needs are the masks: no programs, no columns put together */
} cdbp_live;

static const cdbp_table *cdbp_table_of(const cdbp_live *live)
{
    return (const cdbp_table *)live->table;
}

/* Move the mask of a condition's group to another class of its fact; CDBP_NONE for a fact that is missing or wrong. */
static void cdbp_move(cdbp_live *live, size_t at, size_t found)
{
    const cdbp_step *step = &cdbp_table_of(live)->steps[at];
    size_t old = live->classes[at];
    if (old == CDBP_NONE) live->n_missing--;
    else live->groups[step->group] -= old * step->stride;
    if (found == CDBP_NONE) live->n_missing++;
    else live->groups[step->group] += found * step->stride;
    live->classes[at] = found;
}

/* Keep the mask of a fact that was set: NULL where a missing one is an error, or a fact is wrong, so that a query says so. */
static void cdbp_find_mask(cdbp_live *live, size_t at, int is_missing)
{
    const cdbp_table *own = cdbp_table_of(live);
    const cdb_column *column = &own->columns[at];
    const cdb_fact *fact = &live->now.facts[at];
    size_t found = CDBP_NONE;
    live->masks[at] = NULL;
    if (!live->has_masks) return;
    if (is_missing) {
        if (live->unknown == CDB_UNKNOWN_ANY) live->masks[at] = own->table.enabled;
        else if (live->unknown == CDB_UNKNOWN_NEVER) live->masks[at] = column->masks + (column->n_masks - 1) * own->table.n_words;
    } else if (!cdbi_is_wrong(&own->conditions[at], fact)) {
        found = cdbi_class_of(column, &own->conditions[at], fact);
        live->masks[at] = column->masks + found * own->table.n_words;
    }
    if (own->has_masks) cdbp_move(live, at, found);
}

/* The rows for the facts as they are now. */
static cdb_status cdbp_live_rows(cdbp_live *live, uint64_t *rows)
{
    const cdbp_table *own = cdbp_table_of(live);
    size_t i, n = own->schema.n_conditions;
    cdb_fault fault;
    if (live->has_masks && own->has_masks && live->n_missing == 0) {
        cdbp_and(rows, own->table.enabled, live->groups, own->n_groups, own->table.n_words);
        return CDB_OK;
    }
    for (i = 0; live->has_masks && i < n && live->masks[i]; i++) {}
    if (!live->has_masks || i < n)
        return cdbi_query(&own->table, own->columns, &own->schema, live->now.facts, live->now.facts, live->unknown, rows,
            own->table.n_words, &fault);
    cdbp_and(rows, own->table.enabled, live->masks, n, own->table.n_words);
    return CDB_OK;
}

/* Live(table, unknown, keeps_last): all facts are missing. */
static int cdbp_live_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_live *live = (cdbp_live *)self;
    const cdbp_table *own;
    PyObject *table;
    size_t n, i;
    int unknown, keeps_last;
    (void)named;
    if (!PyArg_ParseTuple(arguments, "Oip", &table, &unknown, &keeps_last)) return -1;
    own = (const cdbp_table *)table;
    if (live->table || !cdbp_is_freed_by(Py_TYPE(table), cdbp_table_free) || !own->is_made || unknown < CDB_UNKNOWN_ERROR
        || unknown > CDB_UNKNOWN_NEVER) {
        PyErr_SetString(PyExc_TypeError, "a live context is made once, of a table, and of what a missing fact does: 0, 1 or 2");
        return -1;
    }
    n = own->schema.n_conditions;
    live->odd = PyDict_New();
    live->memory = PyMem_Calloc(2 * own->frame_bytes + (n + 1) * 5 * sizeof(PyObject *), 1);
    if (!live->odd || !live->memory) {
        if (!PyErr_Occurred()) PyErr_NoMemory();
        return -1;
    }
    live->table = cdbp_new_ref(table);
    live->unknown = (cdb_unknown)unknown;
    live->keeps_last = keeps_last;
    cdbp_lay_out(own, live->memory, &live->now);
    cdbp_lay_out(own, (char *)live->memory + own->frame_bytes, &live->read);
    live->own = (PyObject **)(void *)((char *)live->memory + 2 * own->frame_bytes);
    live->masks = (const uint64_t **)(void *)(live->own + n + 1);
    live->groups = live->masks + n + 1;
    live->classes = (size_t *)(void *)(live->groups + n + 1);
    live->given = (PyObject **)(void *)(live->classes + n + 1);
    live->n_missing = n;
    for (i = 0; i < own->n_groups; i++) live->groups[i] = own->groups[i];
    for (i = 0; i < n; i++) live->classes[i] = CDBP_NONE;
    live->has_masks = !own->table.has_programs && !own->is_careful;
    for (i = 0; i < n; i++) {
        if (own->columns[i].kind != CDBI_VALUE && own->columns[i].kind != CDBI_FLAT) live->has_masks = 0;
        if (own->conditions[i].expr) continue;
        cdbp_set_missing(&own->conditions[i], &live->now.facts[i]);
        live->given[i] = cdbp_new_ref(Py_None);
        cdbp_find_mask(live, i, 1);
    }
    return 0;
}

static int cdbp_live_traverse(PyObject *self, visitproc visit, void *arg)
{
    const cdbp_live *live = (const cdbp_live *)self;
    size_t i;
    CDBP_VISIT(Py_TYPE(self))
    CDBP_VISIT(live->table)
    for (i = 0; live->given && live->table && i < cdbp_table_of(live)->schema.n_conditions; i++) CDBP_VISIT(live->given[i])
    CDBP_VISIT(live->odd)
    CDBP_VISIT(live->last)
    return 0; /* `own` has texts, which lead nowhere */
}

static int cdbp_live_clear(PyObject *self)
{
    cdbp_live *live = (cdbp_live *)self;
    size_t i;
    for (i = 0; live->given && live->table && i < cdbp_table_of(live)->schema.n_conditions; i++) {
        cdbp_clear(&live->own[i]);
        cdbp_clear(&live->given[i]);
    }
    cdbp_clear(&live->last);
    cdbp_clear(&live->odd);
    cdbp_clear(&live->table);
    return 0;
}

static void cdbp_live_free(PyObject *self)
{
    PyObject_GC_UnTrack(self);
    cdbp_live_clear(self);
    PyMem_Free(((cdbp_live *)self)->memory);
    cdbp_free(self);
}

/* The place of a name among the conditions whose facts are given; -1 for another name. */
static long cdbp_place(const cdbp_live *live, PyObject *name)
{
    PyObject *place = PyDict_GetItemWithError(cdbp_table_of(live)->places, name); /* nobody changes this dict */
    return place ? PyLong_AsLong(place) : -1;
}

/* What a fact that was read points into: one text, or a tuple of texts. A new reference, which the frame no longer has. */
static PyObject *cdbp_taken(cdbp_frame *frame)
{
    PyObject *texts;
    if (frame->n_held == 1) return frame->held[--frame->n_held];
    texts = PyTuple_New((Py_ssize_t)frame->n_held);
    while (texts && frame->n_held > 0) {
        frame->n_held--;
        PyTuple_SetItem(texts, (Py_ssize_t)frame->n_held, frame->held[frame->n_held]);
    }
    return texts;
}

/* Keep the fact of a condition that was read, or one that is missing: 0, or -1 with an error. What it replaces is given back at the
 * end, since that may run other code. */
static int cdbp_keep(cdbp_live *live, size_t at, int is_missing, PyObject *value)
{
    const cdbp_table *own = cdbp_table_of(live);
    const cdb_condition *condition = &own->conditions[at];
    const cdbp_reader *reader = &own->readers[at];
    cdb_fact *fact = &live->now.facts[at];
    PyObject *old = live->own[at], *before = live->given[at], *taken = NULL;
    if (!is_missing && live->read.n_held > 0 && !(taken = cdbp_taken(&live->read))) return -1;
    if (is_missing) cdbp_set_missing(condition, fact);
    else {
        *fact = live->read.facts[at];
        if (condition->type == CDB_TAGS && condition->n_values > 0) {
            uint64_t *words = live->now.words + reader->at_words;
            memcpy(words, live->read.words + reader->at_words, cdbi_tag_words(condition) * sizeof *words);
            fact->tags = words;
        } else if (condition->type == CDB_TAGS) {
            const char **texts = live->now.texts + reader->at_texts;
            memcpy(texts, live->read.texts + reader->at_texts, (size_t)fact->texts.count * sizeof *texts);
            fact->texts.texts = texts;
        }
    }
    cdbp_find_mask(live, at, is_missing);
    live->own[at] = taken;
    live->given[at] = cdbp_new_ref(value);
    if (old) Py_DecRef(old);
    if (before) Py_DecRef(before);
    return 0;
}

/* Read a fact and keep it: CDBP_READ; CDBP_CAREFUL where Python must decide, and nothing has changed; CDBP_RAISED with an error. */
static int cdbp_set(cdbp_live *live, long at, PyObject *value)
{
    const cdbp_table *own = cdbp_table_of(live);
    int how;
    if (own->is_careful) return CDBP_CAREFUL;
    live->read.n_held = 0;
    how = cdbp_read_fact(&live->read, &own->schema, own->readers, (size_t)at, value, own->unusual);
    if (how <= CDBP_MISSING) {
        PyObject *name = own->names[at];
        int status = cdbp_keep(live, (size_t)at, how == CDBP_MISSING, value);
        if (status == 0 && PyDict_Size(live->odd) > 0 && PyDict_GetItemWithError(live->odd, name))
            status = PyDict_DelItem(live->odd, name);
        how = status == 0 ? CDBP_READ : CDBP_RAISED;
    }
    cdbp_let_go(&live->read);
    return how;
}

/* live[name] = value, and del live[name], which makes it missing. */
static int cdbp_live_set(PyObject *self, PyObject *name, PyObject *value)
{
    cdbp_live *live = (cdbp_live *)self;
    PyObject *done;
    long at;
    int how = CDBP_CAREFUL;
    if (!live->table) {
        PyErr_SetString(PyExc_ValueError, "the live context was not made");
        return -1;
    }
    if (!value) value = Py_None;
    CDBP_LOCK(self)
    at = cdbp_place(live, name);
    if (at >= 0) how = cdbp_set(live, at, value);
    CDBP_UNLOCK()
    if (how == CDBP_RAISED || PyErr_Occurred()) return -1;
    if (how == CDBP_READ) return 0;
    done = PyObject_CallMethod(self, "_set_carefully", "OO", name, value);
    if (!done) return -1;
    Py_DecRef(done);
    return 0;
}

/* live._set_odd(name, value): a fact that the core cannot hold; until it is set again, the careful way answers. */
static PyObject *cdbp_live_set_odd(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    cdbp_live *live = (cdbp_live *)self;
    long at = n_arguments == 2 && live->table ? cdbp_place(live, arguments[0]) : -1;
    int status = -1;
    if (at < 0) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_TypeError, "_set_odd takes the name of a fact, and its value");
        return NULL;
    }
    CDBP_LOCK(self)
    if (cdbp_keep(live, (size_t)at, 1, arguments[1]) == 0)
        status = PyDict_SetItem(live->odd, cdbp_table_of(live)->names[at], Py_None);
    CDBP_UNLOCK()
    return status == 0 ? cdbp_new_ref(Py_None) : NULL;
}

/* The answer to the facts as they are now; NULL with an error, or without one where the careful way must decide. */
static PyObject *cdbp_live_answer(cdbp_live *live)
{
    const cdbp_table *own = cdbp_table_of(live);
    const cdbp_answer *last = (const cdbp_answer *)live->last;
    size_t n_words = own->table.n_words;
    cdbp_answer *answer;
    if (own->is_careful || PyDict_Size(live->odd) > 0) return NULL;
    answer = cdbp_new_answer(own->answers, own->shared, n_words);
    if (!answer) return NULL;
    if (cdbp_live_rows(live, answer->words)) {
        Py_DecRef((PyObject *)answer);
        return NULL;
    }
    if (!live->keeps_last) return (PyObject *)answer;
    if (last && last->words && (size_t)last->n_words == n_words
        && memcmp(last->words, answer->words, n_words * sizeof(uint64_t)) == 0) {
        Py_DecRef((PyObject *)answer);
        return cdbp_new_ref(live->last);
    }
    cdbp_clear(&live->last);
    live->last = cdbp_new_ref((PyObject *)answer);
    return (PyObject *)answer;
}

/* live._ask(): the answer, or None where the careful way must decide. */
static PyObject *cdbp_live_ask(PyObject *self, PyObject *unused)
{
    cdbp_live *live = (cdbp_live *)self;
    PyObject *answer = NULL;
    (void)unused;
    if (!live->table || !cdbp_table_of(live)->is_made) PyErr_SetString(PyExc_ValueError, "the live context was not made");
    else {
        CDBP_LOCK(self)
        answer = cdbp_live_answer(live);
        CDBP_UNLOCK()
    }
    if (!answer && !PyErr_Occurred()) return cdbp_new_ref(Py_None);
    return answer;
}

/* live.matches(): as `_ask`; `_matches` answers where the careful way must decide, or Python leads. */
static PyObject *cdbp_live_matches(PyObject *self, PyObject *unused)
{
    if (!((const cdbp_live *)self)->is_led) {
        PyObject *answer = cdbp_live_ask(self, unused);
        if (answer != Py_None) return answer;
        Py_DecRef(answer);
    }
    return PyObject_CallMethod(self, "_matches", NULL);
}

static PyObject *cdbp_live_is_led(PyObject *self, void *unused)
{
    (void)unused;
    return cdbp_new_ref(((const cdbp_live *)self)->is_led ? Py_True : Py_False);
}

static int cdbp_live_set_led(PyObject *self, PyObject *is_led, void *unused)
{
    (void)unused;
    ((cdbp_live *)self)->is_led = is_led == Py_True;
    return 0;
}

static PyObject *cdbp_live_facts(PyObject *self, void *unused)
{
    const cdbp_live *live = (const cdbp_live *)self;
    PyObject *facts = live->given && live->table ? PyDict_New() : NULL;
    size_t i;
    (void)unused;
    if (!live->given || !live->table) PyErr_SetString(PyExc_ValueError, "the live context was not made");
    CDBP_LOCK(self)
    for (i = 0; facts && i < cdbp_table_of(live)->schema.n_conditions; i++)
        if (live->given[i] && PyDict_SetItem(facts, cdbp_table_of(live)->names[i], live->given[i]) != 0) cdbp_clear(&facts);
    CDBP_UNLOCK()
    return facts;
}

static PyMethodDef cdbp_live_methods[] = {
    {"matches", cdbp_live_matches, METH_NOARGS,
        "matches($self)\n--\n\nThe valid rows now; the same object as before while they stay the same, in a table without soft cells and\n"
        "without conditions whose facts change in a mirror or that have a hysteresis. Raises ContextError where facts are missing\n"
        "and the context was made with unknown=\"error\"."},
    {"_ask", cdbp_live_ask, METH_NOARGS, "The answer to the facts as they are now, or None where the careful way must decide."},
    {"_set_odd", (PyCFunction)(void (*)(void))cdbp_live_set_odd, METH_FASTCALL,
        "Keep a fact that the core cannot hold: until it is set again, the careful way answers."},
    {NULL, NULL, 0, NULL},
};
static PyGetSetDef cdbp_live_members[] = {
    {"_is_led", cdbp_live_is_led, cdbp_live_set_led, "Whether `matches` is left to `_matches`.", NULL},
    {"_facts", cdbp_live_facts, NULL, "A dict of each fact as it was set, None where it is missing.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};
static PyType_Slot cdbp_live_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_live_init)},
    {Py_tp_traverse, CDBP_SLOT(cdbp_live_traverse)},
    {Py_tp_clear, CDBP_SLOT(cdbp_live_clear)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_live_free)},
    {Py_tp_methods, cdbp_live_methods},
    {Py_tp_getset, cdbp_live_members},
    {Py_mp_ass_subscript, CDBP_SLOT(cdbp_live_set)},
    {0, NULL},
};
static PyType_Spec cdbp_live_spec = {"contextdb.core._core.Live", (int)sizeof(cdbp_live), 0,
    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_GC, cdbp_live_slots};
