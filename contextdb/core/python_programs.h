/* ---- Expressions for Python: one program by itself, computed with the facts of a context; see contextdb.expressions.programs. */

#define CDBP_MOST_NAMED 64          /* facts of one expression, */
#define CDBP_MOST_TAGS 256          /* and undeclared tags of them together: Python computes what has more */

typedef struct cdbp_program {
    PyObject ob_base;
    Py_buffer code, numbers;
    PyObject *texts;                /* a tuple, which owns what the program names */
    const char **listed;
    cdb_condition conditions[CDBP_MOST_NAMED];
    size_t places[CDBP_MOST_NAMED];
    int64_t starts[2];
    cdb_schema schema;
    cdbi_programs programs;
    char types[CDBP_MOST_NAMED + 2]; /* of the facts, and of what it leaves */
    int is_made;
} cdbp_program;

/* Take the types, as "nt:w" has them: those of facts, and that of the value. */
static int cdbp_take_types(cdbp_program *own, const char *types)
{
    static const char letters[] = {CDBI_NUMBERS, CDBI_TRUTHS, CDBI_WORDS, CDBI_TAG_SETS, 0};
    static const cdb_type kinds[] = {CDB_NUMBER, CDB_BOOL, CDB_TEXT, CDB_TAGS};
    size_t n = strcspn(types, ":"), i;
    if (n > CDBP_MOST_NAMED || strlen(types) != n + 2 || !strchr(letters, types[n + 1])) return 0;
    for (i = 0; i < n; i++) {
        const char *letter = strchr(letters, types[i]);
        if (!letter) return 0;
        own->conditions[i].name = "";
        own->conditions[i].type = kinds[letter - letters];
        own->places[i] = i;
        own->types[i] = types[i];
    }
    own->types[n] = types[n + 1];
    own->schema.conditions = own->conditions;
    own->schema.n_conditions = own->programs.facts.n = n;
    own->programs.places = own->places;
    return 1;
}

/* Program(code, numbers, texts, types). Raises ValueError for what C cannot compute. */
static int cdbp_program_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_program *own = (cdbp_program *)self;
    cdbi_programs *programs = &own->programs;
    PyObject *code, *numbers, *texts;
    const char *types;
    Py_ssize_t n, i;
    (void)named;
    if (own->texts || !PyArg_ParseTuple(arguments, "OOOs", &code, &numbers, &texts, &types)) {
        if (own->texts) PyErr_SetString(PyExc_TypeError, "it is made once");
        return -1;
    }
    n = PyTuple_Size(texts);
    if (n < 0) return -1;
    own->texts = cdbp_new_ref(texts);
    own->listed = (const char **)PyMem_Calloc((size_t)n + 1, sizeof *own->listed);
    if (!own->listed) {
        PyErr_NoMemory();
        return -1;
    }
    for (i = 0; i < n; i++)
        if (!(own->listed[i] = cdbp_c_text(PyTuple_GetItem(texts, i)))) return -1;
    if (cdbp_take(&own->code, code, 'i', sizeof(int32_t), 2, 0) != 0) return -1;
    if (cdbp_take(&own->numbers, numbers, 'f', sizeof(double), 1, 0) != 0) return -1;
    programs->code = (const int32_t *)own->code.buf;
    programs->numbers = (const double *)own->numbers.buf;
    programs->n_numbers = (size_t)own->numbers.shape[0];
    programs->texts.texts = own->listed;
    programs->texts.n = (size_t)n;
    programs->starts = own->starts;
    own->starts[1] = (int64_t)own->code.shape[0];
    if (own->code.shape[1] != 4 || !cdbp_take_types(own, types)
        || !cdbi_program_fits(programs, &own->schema, 0, own->types[programs->facts.n])) {
        PyErr_SetString(PyExc_ValueError, "this is no program that can be computed");
        return -1;
    }
    own->is_made = 1;
    return 0;
}

static void cdbp_program_free(PyObject *self)
{
    cdbp_program *own = (cdbp_program *)self;
    if (own->code.obj) PyBuffer_Release(&own->code);
    if (own->numbers.obj) PyBuffer_Release(&own->numbers);
    PyMem_Free((void *)own->listed);
    cdbp_clear(&own->texts);
    cdbp_free(self);
}

/* One fact; -1 with an error. */
static int cdbp_value_fact(char type, PyObject *value, const char **tags, size_t *n_tags, cdb_fact *fact)
{
    PyObject *each, *tag;
    size_t first = *n_tags;
    memset(fact, 0, sizeof *fact);
    if (type == CDBI_NUMBERS) fact->number = PyFloat_AsDouble(value);
    else if (type == CDBI_TRUTHS) fact->whole = value == Py_None ? CDB_MISSING : PyObject_IsTrue(value);
    else if (type == CDBI_WORDS) fact->text = value == Py_None ? NULL : cdbp_c_text(value);
    else if (value == Py_None) fact->texts.count = CDB_MISSING;
    else if ((each = PyObject_GetIter(value)) != NULL) {
        while (!PyErr_Occurred() && (tag = PyIter_Next(each)) != NULL) {
            if (*n_tags == CDBP_MOST_TAGS) PyErr_SetString(PyExc_ValueError, "there are more tags than C takes");
            else tags[(*n_tags)++] = cdbp_c_text(tag);
            Py_DecRef(tag);             /* the set has it */
        }
        Py_DecRef(each);
        fact->texts.texts = tags + first;
        fact->texts.count = (int64_t)(*n_tags - first);
    }
    return PyErr_Occurred() ? -1 : 0;
}

/* program.run(values): the value for the facts of one context, a tuple. */
static PyObject *cdbp_program_run(PyObject *self, PyObject *values)
{
    cdbp_program *own = (cdbp_program *)self;
    cdb_fact facts[CDBP_MOST_NAMED];
    const char *tags[CDBP_MOST_TAGS];
    size_t n_tags = 0, n = own->programs.facts.n, i;
    cdbi_value value;
    if (!own->is_made || PyTuple_Size(values) != (Py_ssize_t)n) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_TypeError, "run takes a tuple of the facts that the program names");
        return NULL;
    }
    for (i = 0; i < n; i++)
        if (cdbp_value_fact(own->types[i], PyTuple_GetItem(values, (Py_ssize_t)i), tags, &n_tags, &facts[i]) != 0) return NULL;
    value = cdbi_run(&own->programs, &own->schema, facts, 0);
    switch (own->types[n]) {
    case CDBI_NUMBERS: return PyFloat_FromDouble(value.number);
    case CDBI_TRUTHS: return cdbp_new_ref(value.truth < 0 ? Py_None : value.truth ? Py_True : Py_False);
    case CDBI_WORDS: return value.text ? Py_BuildValue("s", value.text) : cdbp_new_ref(Py_None);
    default: return cdbp_new_ref(value.tags.fact ? PyTuple_GetItem(values, value.tags.fact - facts) : Py_None);
    }
}

static PyMethodDef cdbp_program_methods[] = {
    {"run", cdbp_program_run, METH_O, "The value in one context."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot cdbp_program_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_program_init)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_program_free)},
    {Py_tp_methods, cdbp_program_methods},
    {0, NULL},
};
static PyType_Spec cdbp_program_spec = {"contextdb.core._core.Program", (int)sizeof(cdbp_program), 0, Py_TPFLAGS_DEFAULT,
    cdbp_program_slots};
