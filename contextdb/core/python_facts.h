/* ---- Facts for Python: the values of a dict as the core's facts. A fact that is not plainly of its type, or that is a set of
 * values, is left to Python's careful way, which answers it or says what is wrong with it. */

enum { CDBP_READ, CDBP_MISSING, CDBP_CAREFUL, CDBP_RAISED };

#define CDBP_TEXTS 64               /* undeclared tags of one fact; more are left to the careful way */
#define CDBP_KNOWN 1024             /* the most places for the values of a condition that are known by their object */
#define CDBP_EXACT 9007199254740992 /* below this every whole number is a double */

typedef struct cdbp_known {         /* a value by its object, so that it need not be hashed; it owns the object */
    PyObject *value;                /* or NULL */
    long number;
} cdbp_known;

typedef struct cdbp_reader {        /* how the fact of a condition is read; references are those of the table's `held` */
    PyObject *numbers;              /* dict: the number of each value of an enum or bool, or of each declared tag; or NULL */
    PyObject *read;                 /* makes a plain fact of another one, or raises; or NULL */
    cdbp_known *known;              /* of an enum: values, each at the place of its object; else NULL */
    unsigned shift;
    size_t n_known;
    size_t at_words, at_texts;      /* where the tags of its fact are in the arrays of a frame */
} cdbp_reader;

typedef struct cdbp_frame {         /* the facts of one question, in the order of the schema, and what they point to */
    cdb_fact *facts;
    uint64_t *words;
    const char **texts;
    PyObject **held;
    size_t n_held;
} cdbp_frame;

static void cdbp_let_go(cdbp_frame *frame)
{
    while (frame->n_held > 0) Py_DecRef(frame->held[--frame->n_held]);
}

typedef struct cdbp_walk {          /* through a dict, beside the conditions: as a rule its names are in their order */
    PyObject *dict;
    Py_ssize_t at;                  /* the next entry; -1 once another name was met */
} cdbp_walk;

/* What the dict has for a name, or NULL. Without the lock of all threads another one could take it out, so it is a reference. */
static PyObject *cdbp_look_up(cdbp_walk *walk, PyObject *name)
{
    PyObject *value = NULL;
#ifdef Py_GIL_DISABLED
    return PyDict_GetItemRef(walk->dict, name, &value) < 0 ? NULL : value;
#else
    PyObject *next;
    if (walk->at >= 0 && PyDict_Next(walk->dict, &walk->at, &next, &value) && next == name) return value;
    walk->at = -1;
    return PyDict_GetItemWithError(walk->dict, name);
#endif
}

static void cdbp_looked_up(PyObject *value)
{
#ifdef Py_GIL_DISABLED
    Py_DecRef(value);
#else
    (void)value;
#endif
}

/* What an exception of a look-up means: one of `unusual` leaves the fact to the careful way. */
static int cdbp_raised(PyObject *unusual)
{
    if (!PyErr_Occurred()) return CDBP_CAREFUL;
    if (!PyErr_ExceptionMatches(unusual)) return CDBP_RAISED;
    PyErr_Clear();
    return CDBP_CAREFUL;
}

/* The place of an object among so many. */
static size_t cdbp_known_at(PyObject *value, unsigned shift)
{
    return (size_t)((uint64_t)(uintptr_t)value * 0x9E3779B97F4A7C15U >> shift);
}

/* The number of a value that is known by its object; else -1. */
CDBI_HOT long cdbp_known_number(const cdbp_known *known, unsigned shift, PyObject *value)
{
    known += cdbp_known_at(value, shift);
    return known->value == value ? known->number : -1;
}

/* Know a text by its object from now on, in place of the one that is known there. */
static void cdbp_know(const cdbp_reader *reader, PyObject *value, long number)
{
    cdbp_known *known = &reader->known[cdbp_known_at(value, reader->shift)];
    PyObject *old = known->value;
    known->value = cdbp_new_ref(value);
    known->number = number;
    if (old) Py_DecRef(old);
}

/* The number of a value: -1 for one that has none, or with an exception. */
static long cdbp_number_of(const cdbp_reader *reader, PyObject *value)
{
    PyObject *found;
    long number;
    Py_IncRef(value);
    found = PyDict_GetItemWithError(reader->numbers, value); /* nobody changes this dict */
    number = found ? PyLong_AsLong(found) : -1;
#ifndef Py_GIL_DISABLED
    if (reader->known && number >= 0 && Py_TYPE(value) == &PyUnicode_Type) cdbp_know(reader, value, number);
#endif
    Py_DecRef(value);
    return number;
}

/* A plain number: exactly a float or an int, or a float of another class. */
static int cdbp_double(PyObject *value, double *number)
{
    if (Py_TYPE(value) == &PyFloat_Type) *number = PyFloat_AsDouble(value);
    else if (Py_TYPE(value) == &PyLong_Type) {
        *number = PyLong_AsDouble(value);
        if (*number == -1.0 && PyErr_Occurred()) { /* past all doubles */
            PyErr_Clear();
            return CDBP_CAREFUL;
        }
    } else return CDBP_CAREFUL;
    return cdbi_is_nan(*number) ? CDBP_MISSING : CDBP_READ;
}

static int cdbp_whole(PyObject *value, int64_t *whole)
{
    if (Py_TYPE(value) == &PyLong_Type) {
        *whole = PyLong_AsLongLong(value);
        if (*whole == -1 && PyErr_Occurred()) {
            PyErr_Clear();
            return CDBP_CAREFUL;
        }
        if (*whole == CDB_MISSING_INT) return CDBP_CAREFUL;
    } else if (Py_TYPE(value) == &PyFloat_Type) {
        double number = PyFloat_AsDouble(value);
        if (cdbi_is_nan(number)) return CDBP_MISSING;
        if (!(number > -(double)CDBP_EXACT && number < (double)CDBP_EXACT) || cdbi_floor(number) != number) return CDBP_CAREFUL;
        *whole = (int64_t)number;
    } else return CDBP_CAREFUL;
    return CDBP_READ;
}

/* A text that C can hold; it stays while the frame holds its object. */
static int cdbp_text(cdbp_frame *frame, PyObject *value, const char **text)
{
    Py_ssize_t length;
    *text = PyUnicode_AsUTF8AndSize(value, &length);
    if (!*text || strlen(*text) != (size_t)length) return CDBP_CAREFUL;
    frame->held[frame->n_held++] = cdbp_new_ref(value);
    return CDBP_READ;
}

/* The tags of a set, frozenset, list or tuple. */
static int cdbp_tags(cdbp_frame *frame, const cdb_condition *condition, const cdbp_reader *reader, PyObject *value, cdb_fact *fact)
{
    uint64_t *words = frame->words + reader->at_words;
    const char **texts = frame->texts + reader->at_texts;
    PyObject *each, *tag;
    size_t n = 0;
    int how = CDBP_READ;
    if (Py_TYPE(value) != &PySet_Type && Py_TYPE(value) != &PyFrozenSet_Type && Py_TYPE(value) != &PyList_Type
        && Py_TYPE(value) != &PyTuple_Type)
        return CDBP_CAREFUL;
    each = PyObject_GetIter(value);
    if (!each) return CDBP_CAREFUL;
    if (condition->n_values > 0) memset(words, 0, cdbi_tag_words(condition) * sizeof *words);
    while (how == CDBP_READ && (tag = PyIter_Next(each)) != NULL) {
        if (Py_TYPE(tag) != &PyUnicode_Type) how = CDBP_CAREFUL;
        else if (condition->n_values > 0) {
            long number = cdbp_number_of(reader, tag);
            if (number < 0) how = CDBP_CAREFUL;
            else cdb_add_tag(words, (size_t)number);
        } else if (n == CDBP_TEXTS) how = CDBP_CAREFUL;
        else how = cdbp_text(frame, tag, &texts[n++]);
        Py_DecRef(tag);
    }
    Py_DecRef(each);
    if (PyErr_Occurred()) how = CDBP_CAREFUL;
    if (condition->n_values > 0) {
        words[0] |= 1;
        fact->tags = words;
    } else {
        fact->texts.texts = texts;
        fact->texts.count = (int64_t)n;
    }
    return how;
}

/* One fact that is plainly of its type. An exception that is still set belongs to CDBP_CAREFUL. */
static int cdbp_plain(cdbp_frame *frame, const cdb_condition *condition, const cdbp_reader *reader, PyObject *value, cdb_fact *fact)
{
    switch (condition->type) {
    case CDB_NUMBER:
    case CDB_ANGLE: return cdbp_double(value, &fact->number);
    case CDB_INT: return cdbp_whole(value, &fact->whole);
    case CDB_DATE: return Py_TYPE(value) == &PyLong_Type ? CDBP_CAREFUL : cdbp_whole(value, &fact->whole);
    case CDB_BOOL:
    case CDB_ENUM: {
        long number = value == Py_True ? 1 : value == Py_False ? 0 : -1;
        if (condition->type == CDB_ENUM) number = cdbp_known_number(reader->known, reader->shift, value);
        if (number < 0) number = cdbp_number_of(reader, value);
        fact->whole = number;
        return number < 0 ? CDBP_CAREFUL : CDBP_READ;
    }
    case CDB_TEXT: return cdbp_text(frame, value, &fact->text);
    case CDB_TAGS: return cdbp_tags(frame, condition, reader, value, fact);
    }
    return CDBP_CAREFUL;
}

/* Read the fact of condition `at` that is given. Where it is not plain, `read` makes a plain one of it. */
static int cdbp_read_fact(cdbp_frame *frame, const cdb_schema *schema, const cdbp_reader *readers, size_t at, PyObject *value,
    PyObject *unusual)
{
    const cdb_condition *condition = &schema->conditions[at];
    PyObject *plain;
    int how;
    if (value == Py_None) return CDBP_MISSING;
    how = cdbp_plain(frame, condition, &readers[at], value, &frame->facts[at]);
    if (how != CDBP_CAREFUL) return how;
    if (PyErr_Occurred() || !readers[at].read) return cdbp_raised(unusual);
    Py_IncRef(value);
    plain = PyObject_CallFunctionObjArgs(readers[at].read, value, NULL);
    Py_DecRef(value);
    if (!plain) return cdbp_raised(unusual);
    how = plain == Py_None ? CDBP_MISSING : cdbp_plain(frame, condition, &readers[at], plain, &frame->facts[at]);
    Py_DecRef(plain);
    return how == CDBP_CAREFUL ? cdbp_raised(unusual) : how;
}
