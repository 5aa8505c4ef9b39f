/* ---- Columns of facts from Python: lists, numpy's arrays, and what gives an Arrow stream, as polars' series do. Nothing is copied. A
 * column that holds a fact that is not plainly of its type is left to Python's careful way, whole. What a stream says of its own
 * buffers is believed, as it comes from this process.
 *
 * Source: The Arrow C data interface and C stream interface, arrow.apache.org/docs/format. */

typedef struct cdbp_arrow_schema {
    const char *format, *name, *metadata;
    int64_t flags, n_children;
    struct cdbp_arrow_schema **children, *dictionary;
    void (*release)(struct cdbp_arrow_schema *);
    void *private_data;
} cdbp_arrow_schema;
typedef struct cdbp_arrow_array {
    int64_t length, null_count, offset, n_buffers, n_children;
    const void **buffers;
    struct cdbp_arrow_array **children, *dictionary;
    void (*release)(struct cdbp_arrow_array *);
    void *private_data;
} cdbp_arrow_array;
typedef struct cdbp_arrow_stream {
    int (*get_schema)(struct cdbp_arrow_stream *, cdbp_arrow_schema *);
    int (*get_next)(struct cdbp_arrow_stream *, cdbp_arrow_array *);
    const char *(*get_last_error)(struct cdbp_arrow_stream *);
    void (*release)(struct cdbp_arrow_stream *);
    void *private_data;
} cdbp_arrow_stream;

typedef struct cdbp_coding {        /* how the facts of a condition become codes */
    const cdbp_table *own;
    size_t at;                      /* the number of the condition */
    cdbi_bounds bounds;
    cdbi_names names;
    int32_t first, missing;         /* the first code, and that of a missing fact; of tags -1, or 0 where they are ignored */
    int32_t *codes;                 /* [slots, n] */
    size_t n_slots, n, n_missing;
} cdbp_coding;

/* Numbers as codes, from context `start` on: CDBP_READ or CDBP_CAREFUL. The numbers are changed. */
static int cdbp_put_numbers(cdbp_coding *to, double *numbers, size_t start, size_t n)
{
    const int32_t *codes = to->codes + start, missing = to->missing;
    int32_t n_missing = 0;
    size_t k;
    if (!cdbi_are_facts(to->own->conditions[to->at].type, numbers, n)) return CDBP_CAREFUL;
    cdbi_number_codes(&to->bounds, numbers, n, to->first, missing, to->codes + start);
    for (k = 0; k < n; k++) n_missing += codes[k] == missing;
    to->n_missing += (size_t)n_missing;
    return CDBP_READ;
}

/* The numbers of values as codes. What is no value is the last class of a text column, and left to the careful way in others. */
static int cdbp_put_values(cdbp_coding *to, const int32_t *numbers, size_t start, size_t n)
{
    int32_t others = to->own->conditions[to->at].type == CDB_TEXT ? (int32_t)to->own->columns[to->at].texts.n : -1;
    int32_t least = 0, first = to->first, *codes = to->codes + start;
    size_t k, n_missing = 0;
    for (k = 0; k < n; k++) {
        codes[k] = first + numbers[k];
        least = numbers[k] < least ? numbers[k] : least;
    }
    if (least == 0) return CDBP_READ;
    for (k = 0; k < n; k++) {
        if (numbers[k] == CDBI_NO_FACT) codes[k] = first + others;
        if (numbers[k] == -1) codes[k] = to->missing;
        n_missing += numbers[k] == -1;
    }
    to->n_missing += n_missing;
    return least == CDBI_NO_FACT && others < 0 ? CDBP_CAREFUL : CDBP_READ;
}

/* An array of facts as codes. */
static int cdbp_put_facts(cdbp_coding *to, const cdbi_facts *facts, size_t start)
{
    cdb_type type = to->own->conditions[to->at].type;
    int is_number = cdbi_is_numeric(type), how = CDBP_READ;
    int is_truth = facts->type == '?' || facts->type == 'b';
    double numbers[CDBI_CONTEXTS];
    int32_t values[CDBI_CONTEXTS];
    size_t at, n;
    if (type == CDB_TAGS || is_truth != (type == CDB_BOOL)) return CDBP_CAREFUL;
    if (type == CDB_DATE ? facts->type != 'g' && facts->type != 'f' && facts->type != 'D' : facts->type == 'D') return CDBP_CAREFUL;
    for (at = 0; at < facts->n && how == CDBP_READ; at += n) {
        n = facts->n - at < CDBI_CONTEXTS ? facts->n - at : CDBI_CONTEXTS;
        if (is_number) how = cdbi_doubles(facts, at, n, numbers) ? cdbp_put_numbers(to, numbers, start + at, n) : CDBP_CAREFUL;
        else how = cdbi_value_numbers(facts, &to->names, at, n, values) ? cdbp_put_values(to, values, start + at, n) : CDBP_CAREFUL;
    }
    return how;
}

/* The tags of one fact as codes. */
static int cdbp_put_tags(cdbp_coding *to, cdbp_frame *frame, PyObject *value, size_t at)
{
    const cdb_condition *condition = &to->own->conditions[to->at];
    const cdb_column *column = &to->own->columns[to->at];
    int how = cdbp_read_fact(frame, &to->own->schema, to->own->readers, to->at, value, to->own->unusual);
    size_t slot;
    if (how > CDBP_MISSING) return how;
    to->n_missing += how == CDBP_MISSING;
    for (slot = 0; slot < to->n_slots; slot++) {
        int32_t answer = how == CDBP_MISSING ? 2 : (int32_t)cdbi_answer(column, condition, slot, &frame->facts[to->at]);
        to->codes[slot * to->n + at] = answer == 2 && to->missing == 0 ? 0 : to->first + (int32_t)(3 * slot) + answer;
    }
    cdbp_let_go(frame);
    return CDBP_READ;
}

#define CDBP_SEEN 256

typedef struct cdbp_seen {          /* texts of a tuple whose number is known: they stay while the tuple does */
    PyObject *value;
    int32_t number;
} cdbp_seen;

/* The number of a value of a bool or enum, or of a text: -1 for a missing one; CDBI_NO_FACT with or without an error. */
static int32_t cdbp_value(const cdbp_coding *to, cdbp_seen *seen, PyObject *value)
{
    const cdbp_reader *reader = &to->own->readers[to->at];
    int is_text = Py_TYPE(value) == &PyUnicode_Type;
    Py_ssize_t length;
    const char *text;
    long number;
    if (value == Py_None) return -1;
    if (to->own->conditions[to->at].type == CDB_BOOL && ((value == Py_True) | (value == Py_False))) return value == Py_True;
    if (is_text) {
        seen = &seen[((uintptr_t)value >> 4) % CDBP_SEEN];
        if (seen->value == value) return seen->number;
    }
    if (to->own->conditions[to->at].type != CDB_TEXT) {
        number = cdbp_number_of(reader, value);
        if (number < 0) return CDBI_NO_FACT;
    } else {
        text = PyUnicode_AsUTF8AndSize(value, &length);
        if (!text) return CDBI_NO_FACT;
        number = cdbi_text_number(&to->names, text, (size_t)length, 0, to->names.n_words);
        if (number < 0) number = (long)to->own->columns[to->at].texts.n;
    }
    if (is_text) {
        seen->value = value;
        seen->number = (int32_t)number;
    }
    return (int32_t)number;
}

/* The facts of a tuple as codes: CDBP_READ, CDBP_CAREFUL, or CDBP_RAISED with an error. */
static int cdbp_put_items(cdbp_coding *to, PyObject *items, cdbp_frame *frame)
{
    cdb_type type = to->own->conditions[to->at].type;
    int is_number = cdbi_is_numeric(type), how = CDBP_READ;
    cdbp_seen seen[CDBP_SEEN];
    double numbers[CDBI_CONTEXTS];
    int32_t values[CDBI_CONTEXTS];
    size_t at, n, k;
    memset(seen, 0, sizeof seen);
    for (at = 0; at < to->n && how == CDBP_READ; at += n) {
        n = to->n - at < CDBI_CONTEXTS ? to->n - at : CDBI_CONTEXTS;
        for (k = 0; k < n && how == CDBP_READ; k++) {
            PyObject *value = PyTuple_GetItem(items, (Py_ssize_t)(at + k));
            if (type == CDB_TAGS) how = cdbp_put_tags(to, frame, value, at + k);
            else if (!is_number) {
                values[k] = cdbp_value(to, seen, value);
                if (values[k] == CDBI_NO_FACT) how = CDBP_CAREFUL;
            } else if (Py_TYPE(value) == &PyFloat_Type) numbers[k] = PyFloat_AsDouble(value);
            else {
                how = cdbp_read_fact(frame, &to->own->schema, to->own->readers, to->at, value, to->own->unusual);
                if (how == CDBP_MISSING) numbers[k] = cdb_missing_number();
                else numbers[k] = cdbi_is_double(type) ? frame->facts[to->at].number : (double)frame->facts[to->at].whole;
                if (how == CDBP_MISSING) how = CDBP_READ;
            }
        }
        if (how != CDBP_READ || type == CDB_TAGS) continue;
        how = is_number ? cdbp_put_numbers(to, numbers, at, n) : cdbp_put_values(to, values, at, n);
    }
    return how == CDBP_CAREFUL && PyErr_Occurred() ? cdbp_raised(to->own->unusual) : how;
}

/* The facts of numpy's arrays: CDBP_CAREFUL for another array, without an error. */
static int cdbp_put_array(cdbp_coding *to, PyObject *array)
{
    static const char formats[] = "bBhHiIlLqQfd?";
    Py_buffer view;
    cdbi_facts facts;
    PyThreadState *thread;
    const char *format;
    int how;
    if (PyObject_GetBuffer(array, &view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) != 0) return CDBP_RAISED;
    memset(&facts, 0, sizeof facts);
    format = view.format ? view.format : "B";
    facts.items = view.buf;
    facts.n = view.ndim == 1 ? (size_t)view.shape[0] : 0;
    if (*format >= '0' && *format <= '9') {
        while (*format >= '0' && *format <= '9') format++;
        facts.type = format[0] == 'w' && !format[1] ? 'w' : 0;
        facts.width = (size_t)view.itemsize / sizeof(uint32_t);
    } else if (*format == 'w' && !format[1]) {
        facts.type = 'w';
        facts.width = 1;
    } else if (*format && !format[1] && strchr(formats, *format)) {
        int is_from_0 = *format < 'a', is_8 = view.itemsize == 8;
        if (*format == '?' || *format == 'f') facts.type = *format;
        else if (*format == 'd') facts.type = 'g';
        else facts.type = view.itemsize == 1 ? (is_from_0 ? 'C' : 'c') : view.itemsize == 2 ? (is_from_0 ? 'S' : 's')
            : is_8 ? (is_from_0 ? 'L' : 'l') : (is_from_0 ? 'I' : 'i');
    }
    if (facts.type == 0 || facts.n != to->n) how = CDBP_CAREFUL;
    else {
        thread = PyEval_SaveThread();
        how = cdbp_put_facts(to, &facts, 0);
        PyEval_RestoreThread(thread);
    }
    PyBuffer_Release(&view);
    return how;
}

/* One array of an Arrow stream as facts; 0 where the core cannot read it. */
static int cdbp_arrow_facts(const cdbp_arrow_array *array, const char *format, cdbi_facts *facts)
{
    static const char plain[] = "cCsSiIlLfgbD";
    memset(facts, 0, sizeof *facts);
    if (array->length < 0 || array->offset < 0 || array->n_buffers < 2) return 0;
    facts->n = (size_t)array->length;
    facts->first = (size_t)array->offset;
    facts->valid = array->null_count == 0 ? NULL : (const unsigned char *)array->buffers[0];
    facts->items = array->buffers[1];
    if (format[0] && !format[1] && strchr(plain, *format)) facts->type = *format;
    else if (strcmp(format, "vu") == 0) {
        facts->type = 'v';
        facts->buffers = (const char *const *)(array->buffers + 2);
    } else if ((strcmp(format, "u") == 0 || strcmp(format, "U") == 0) && array->n_buffers == 3) {
        facts->type = *format;
        facts->octets = (const char *)array->buffers[2];
    } else return 0;
    return facts->items != NULL || facts->n == 0;
}

/* The codes of an array of whole numbers that count the texts of a dictionary. */
static int cdbp_put_dictionary(cdbp_coding *to, const cdbi_facts *facts, const cdbp_arrow_array *dictionary, const char *format,
    size_t start)
{
    cdbi_facts texts;
    int32_t *numbers, values[CDBI_CONTEXTS];
    double places[CDBI_CONTEXTS];
    size_t at, n, k;
    int how = CDBP_READ;
    if (!cdbp_arrow_facts(dictionary, format, &texts) || !strchr("uUv", texts.type)) return CDBP_CAREFUL;
    numbers = (int32_t *)CDB_MALLOC((texts.n + 1) * sizeof *numbers);
    if (!numbers || !cdbi_value_numbers(&texts, &to->names, 0, texts.n, numbers)) how = CDBP_CAREFUL;
    for (at = 0; at < facts->n && how == CDBP_READ; at += n) {
        n = facts->n - at < CDBI_CONTEXTS ? facts->n - at : CDBI_CONTEXTS;
        if (!cdbi_doubles(facts, at, n, places)) how = CDBP_CAREFUL;
        for (k = 0; k < n && how == CDBP_READ; k++) {
            values[k] = cdbi_is_nan(places[k]) ? -1 : CDBI_NO_FACT;
            if (places[k] >= 0.0 && places[k] < (double)texts.n) values[k] = numbers[(size_t)places[k]];
        }
        if (how == CDBP_READ) how = cdbp_put_values(to, values, start + at, n);
    }
    CDB_FREE(numbers);
    return how;
}

/* The arrays of an Arrow stream, one behind the other: CDBP_READ or CDBP_CAREFUL. Needs no lock of Python's. */
static int cdbp_put_stream(cdbp_coding *to, cdbp_arrow_stream *stream)
{
    cdb_type type = to->own->conditions[to->at].type;
    int is_number = cdbi_is_numeric(type), how = CDBP_READ;
    cdbp_arrow_schema schema;
    cdbp_arrow_array array;
    const char *format;
    size_t start = 0;
    if (!stream->release || stream->get_schema(stream, &schema) != 0) return CDBP_CAREFUL;
    format = schema.format;
    if (strcmp(format, "tdD") == 0) format = "D";
    while (how == CDBP_READ) {
        cdbi_facts facts;
        if (stream->get_next(stream, &array) != 0) how = CDBP_CAREFUL;
        if (how != CDBP_READ || !array.release) break;
        if (!cdbp_arrow_facts(&array, format, &facts) || facts.n > to->n - start) how = CDBP_CAREFUL;
        else if (schema.dictionary)
            how = array.dictionary && !is_number && type != CDB_BOOL && type != CDB_TAGS
                ? cdbp_put_dictionary(to, &facts, array.dictionary, schema.dictionary->format, start) : CDBP_CAREFUL;
        else how = cdbp_put_facts(to, &facts, start);
        start += facts.n;
        array.release(&array);
    }
    schema.release(&schema);
    return how == CDBP_READ && start != to->n ? CDBP_CAREFUL : how;
}

/* What the codes of a column are made with, its bounds or its names: 0, or -1 with an error. */
static int cdbp_prepare_column(cdbp_coding *to, cdbp_arrays *arrays, PyObject *cells)
{
    const cdb_condition *condition = &to->own->conditions[to->at];
    const cdb_column *column = &to->own->columns[to->at];
    to->bounds.bounds = column->bounds;
    to->bounds.n = column->n_bounds;
    if (cells != Py_None) {
        PyObject *ended, *before;
        double low, scale;
        size_t n_ended, n_cells, i;
        int32_t most = 0, least = 0;
        if (cdbp_length(cells) < 0 || !PyArg_ParseTuple(cells, "OddO", &ended, &low, &scale, &before)) return -1;
        to->bounds.bounds = (const double *)cdbp_items(arrays, ended, 'f', sizeof(double), 1, 0, &n_ended);
        to->bounds.before = to->bounds.bounds ? (const int32_t *)cdbp_items(arrays, before, 'i', sizeof(int32_t), 1, 0, &n_cells) : NULL;
        if (!to->bounds.before) return -1;
        for (i = 0; i < n_cells; i++) {
            most = to->bounds.before[i] > most ? to->bounds.before[i] : most;
            least = to->bounds.before[i] < least ? to->bounds.before[i] : least;
        }
        if (n_ended != column->n_bounds + 2 || least < 0 || (size_t)most > column->n_bounds) {
            PyErr_SetString(PyExc_ValueError, "the cells are not those of the column's bounds");
            return -1;
        }
        to->bounds.n_cells = n_cells;
        to->bounds.low = low;
        to->bounds.scale = scale;
    }
    if (condition->type != CDB_TEXT && condition->type != CDB_ENUM) return 0;
    if (!(condition->type == CDB_TEXT ? cdbi_measure_names(&to->names, column->texts.texts, column->classes, column->texts.n)
                                      : cdbi_measure_names(&to->names, condition->values, NULL, condition->n_values)))
        return 0;
    to->names.words = (uint64_t *)PyMem_Calloc((to->names.n + 1) * (to->names.n_words + 1) + to->names.last / 2 + 2, sizeof(uint64_t));
    if (!to->names.words) {
        PyErr_NoMemory();
        return -1;
    }
    to->names.slots = (uint32_t *)(void *)(to->names.words + (to->names.n + 1) * to->names.n_words);
    to->names.lengths = to->names.slots + to->names.last + 1;
    cdbi_index_names(&to->names);
    return 0;
}

/* The facts of a list or tuple: as the functions above. */
static int cdbp_put_sequence(cdbp_coding *to, PyObject *sequence)
{
    PyObject *items = PySequence_Tuple(sequence); /* holds the facts, whatever becomes of the list */
    void *memory = items ? PyMem_Malloc(to->own->frame_bytes + 1) : NULL;
    cdbp_frame frame;
    int how = CDBP_RAISED;
    if (items && !memory) PyErr_NoMemory();
    if (memory) {
        cdbp_lay_out(to->own, memory, &frame);
        how = (size_t)PyTuple_Size(items) == to->n ? cdbp_put_items(to, items, &frame) : CDBP_CAREFUL;
        cdbp_let_go(&frame);
        PyMem_Free(memory);
    }
    if (items) Py_DecRef(items);
    return how;
}

/* read_column(table, at, column, first, is_ignored, cells, codes), see _core.pyi. */
static PyObject *cdbp_read_column(PyObject *module, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    cdbp_coding to;
    cdbp_arrays arrays;
    PyObject *given;
    size_t shape[2] = {0, 0};
    long long at, first;
    int is_ignored, how = CDBP_RAISED;
    (void)module;
    memset(&to, 0, sizeof to);
    arrays.n = 0;
    if (n_arguments != 7 || !cdbp_is_freed_by(Py_TYPE(arguments[0]), cdbp_table_free)) {
        PyErr_SetString(PyExc_TypeError, "read_column takes table, at, column, first, is_ignored, cells and codes");
        return NULL;
    }
    to.own = (const cdbp_table *)arguments[0];
    at = PyLong_AsLongLong(arguments[1]);
    first = PyErr_Occurred() ? -1 : PyLong_AsLongLong(arguments[3]);
    is_ignored = PyErr_Occurred() ? -1 : PyObject_IsTrue(arguments[4]);
    if (is_ignored < 0) return NULL;
    given = arguments[2];
    if (to.own->is_careful) return cdbp_new_ref(Py_None);
    if (!to.own->is_made || at < 0 || (uint64_t)at >= to.own->schema.n_conditions || to.own->columns[at].kind == 0 || first < 0
        || first > INT32_MAX / 2) {
        PyErr_SetString(PyExc_ValueError, "the table has no such column");
        return NULL;
    }
    to.at = (size_t)at;
    to.first = (int32_t)first;
    to.codes = (int32_t *)cdbp_items(&arrays, arguments[6], 'i', sizeof(int32_t), 2, 1, shape);
    if (to.codes) {
        const cdb_column *column = &to.own->columns[at];
        cdb_type type = to.own->conditions[at].type;
        int is_wide = column->kind == CDBI_WIDE, is_named = type == CDB_TEXT || type == CDB_ENUM;
        to.n_slots = column->kind == CDBI_SLOTS ? column->n_masks / 3 : 1;
        to.n = shape[1];
        to.missing = is_ignored ? (is_wide ? -1 : 0) : column->kind == CDBI_SLOTS ? -1
            : to.first + (int32_t)(is_wide ? column->n_bounds + 1 : column->n_masks - 1);
        if (shape[0] != to.n_slots) PyErr_SetString(PyExc_ValueError, "the codes have another shape than the column's");
        else if (cdbp_prepare_column(&to, &arrays, arguments[5]) == 0) {
            if ((to.own->conditions[at].expr && type == CDB_TAGS) || (is_named && !to.names.words)) how = CDBP_CAREFUL;
            else if (PyType_IsSubtype(Py_TYPE(given), &PyTuple_Type) || PyType_IsSubtype(Py_TYPE(given), &PyList_Type))
                how = cdbp_put_sequence(&to, given);
            else if (PyType_IsSubtype(Py_TYPE(given), &PyCapsule_Type)) {
                cdbp_arrow_stream *stream = (cdbp_arrow_stream *)PyCapsule_GetPointer(given, "arrow_array_stream");
                PyThreadState *thread = stream ? PyEval_SaveThread() : NULL;
                if (stream) how = cdbp_put_stream(&to, stream);
                if (thread) PyEval_RestoreThread(thread);
            } else how = cdbp_put_array(&to, given);
        }
    }
    PyMem_Free(to.names.words);
    cdbp_release(&arrays);
    if (how == CDBP_READ) return PyLong_FromSsize_t((Py_ssize_t)to.n_missing);
    return how == CDBP_CAREFUL ? cdbp_new_ref(Py_None) : NULL;
}
