/* ---- Answers for Python: the rows that a query gave, as words, as one integer, and as an array of row numbers. What is worked out
 * of the words is kept in the answer, which owns all its members. */

#ifdef Py_GIL_DISABLED
#define CDBP_LOCK(object) Py_BEGIN_CRITICAL_SECTION(object)
#define CDBP_UNLOCK() Py_END_CRITICAL_SECTION()
#else
#define CDBP_LOCK(object) {
#define CDBP_UNLOCK() }
#endif

#ifdef __GNUC__                     /* C99 has no object pointer that holds a function; every system that Python runs on has */
#define CDBP_SLOT(function) __extension__(void *)(function)
#else
#define CDBP_SLOT(function) (void *)(function)
#endif

#define CDBP_VISIT(object) if (object) { int stop = visit((PyObject *)(object), arg); if (stop) return stop; }

/* Give a reference back, and forget it. */
static void cdbp_clear(PyObject **at)
{
    PyObject *object = *at;
    *at = NULL;
    if (object) Py_DecRef(object);
}

static PyObject *cdbp_new_ref(PyObject *object)
{
    Py_IncRef(object);
    return object;
}

/* Free an object of a type of this module, whose members have been given back. */
static void cdbp_free(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    void (*release)(void *);
    *(void **)&release = PyType_GetSlot(type, Py_tp_free);
    release(self);
    Py_DecRef((PyObject *)type);
}

#define CDBP_ROOM 256               /* row numbers; integers up to here are never made, they are there */
#define CDBP_FEW_ROWS 64            /* an answer of more has an array of its own */

/* What the answers of one table share. Python's class of it has more. */
typedef struct cdbp_shared {
    PyObject ob_base;
    PyObject *row_numbers;          /* int64 array [n_rows]: 0, 1, 2, ... */
    PyObject *as_rows;              /* makes an array of the bytes of row numbers */
    PyObject *room;                 /* int64 array [CDBP_ROOM], of which answers with few rows have parts; or NULL */
    char *room_bytes;
    int64_t n_taken;                /* of the room */
    PyObject **single;              /* [n_rows + 1] views of row_numbers that were made: one row each, then none; or NULL */
    Py_ssize_t n_rows;
} cdbp_shared;

static int cdbp_shared_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_shared *shared = (cdbp_shared *)self;
    PyObject *numbers, *as_rows;
    (void)named;
    if (!PyArg_ParseTuple(arguments, "OO", &numbers, &as_rows)) return -1;
    if (shared->row_numbers) {
        PyErr_SetString(PyExc_TypeError, "it is made once");
        return -1;
    }
    shared->n_rows = PyObject_Length(numbers);
    if (shared->n_rows < 0) return -1;
    shared->single = (PyObject **)PyMem_Calloc((size_t)shared->n_rows + 1, sizeof(PyObject *));
    if (!shared->single) {
        PyErr_NoMemory();
        return -1;
    }
    shared->row_numbers = cdbp_new_ref(numbers);
    shared->as_rows = cdbp_new_ref(as_rows);
    return 0;
}

static int cdbp_shared_traverse(PyObject *self, visitproc visit, void *arg)
{
    CDBP_VISIT(Py_TYPE(self))
    CDBP_VISIT(((cdbp_shared *)self)->row_numbers)
    CDBP_VISIT(((cdbp_shared *)self)->as_rows)
    return 0; /* `single` and `room` are arrays of numbers, which lead nowhere */
}

static int cdbp_shared_clear(PyObject *self)
{
    cdbp_shared *shared = (cdbp_shared *)self;
    Py_ssize_t i;
    for (i = 0; shared->single && i <= shared->n_rows; i++) cdbp_clear(&shared->single[i]);
    cdbp_clear(&shared->row_numbers);
    cdbp_clear(&shared->as_rows);
    cdbp_clear(&shared->room);
    return 0;
}

static void cdbp_shared_free(PyObject *self)
{
    PyObject_GC_UnTrack(self);
    cdbp_shared_clear(self);
    PyMem_Free(((cdbp_shared *)self)->single);
    cdbp_free(self);
}

static PyObject *cdbp_shared_numbers(PyObject *self, void *unused)
{
    PyObject *numbers = ((cdbp_shared *)self)->row_numbers;
    (void)unused;
    if (!numbers) PyErr_SetString(PyExc_ValueError, "it was not made");
    else Py_IncRef(numbers);
    return numbers;
}

static PyGetSetDef cdbp_shared_members[] = {
    {"row_numbers", cdbp_shared_numbers, NULL, "0 up to the number of rows: int64 [n_rows], read-only.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};
static PyType_Slot cdbp_shared_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_shared_init)},
    {Py_tp_traverse, CDBP_SLOT(cdbp_shared_traverse)},
    {Py_tp_clear, CDBP_SLOT(cdbp_shared_clear)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_shared_free)},
    {Py_tp_getset, cdbp_shared_members},
    {0, NULL},
};
static PyType_Spec cdbp_shared_spec = {"contextdb.core._core.Shared", (int)sizeof(cdbp_shared), 0,
    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_GC, cdbp_shared_slots};

/* Whether a type, or one that it is made of, is freed by a function: so types of this module are known without being kept. */
static int cdbp_is_freed_by(PyTypeObject *type, void (*release)(PyObject *))
{
    void *wanted;
    memcpy(&wanted, &release, sizeof wanted);
    for (; type; type = (PyTypeObject *)PyType_GetSlot(type, Py_tp_base))
        if (PyType_GetSlot(type, Py_tp_dealloc) == wanted) return 1;
    return 0;
}

static int cdbp_is_shared(PyObject *object)
{
    return cdbp_is_freed_by(Py_TYPE(object), cdbp_shared_free) && ((cdbp_shared *)object)->row_numbers != NULL;
}

#define CDBP_FEW_WORDS 16

/* The rows of one answer: `words` or `bits`, or both. */
typedef struct cdbp_answer {
    PyObject ob_base;
    PyObject *table;                /* what the answers of its table share: a Shared */
    PyObject *rows;                 /* the array of row numbers, once it was asked for; else NULL */
    PyObject *bits;                 /* the integer, once it was asked for or given; else NULL */
    uint64_t *words;                /* n_words; NULL where the answer was made of an integer */
    Py_ssize_t n_words;
    uint64_t few[CDBP_FEW_WORDS];   /* where `words` are, if they are few: no memory is taken for them */
} cdbp_answer;

static void cdbp_drop_words(cdbp_answer *answer)
{
    if (answer->words != answer->few) PyMem_Free(answer->words);
    answer->words = NULL;
    answer->n_words = 0;
}

/* Room for the words of an answer that has none: 0, or -1 with an error. */
static int cdbp_take_words(cdbp_answer *answer, size_t n_words)
{
    answer->words = n_words <= CDBP_FEW_WORDS ? answer->few : (uint64_t *)PyMem_Malloc(n_words * sizeof(uint64_t));
    if (!answer->words) PyErr_NoMemory();
    else answer->n_words = (Py_ssize_t)n_words;
    return answer->words ? 0 : -1;
}

static int cdbp_answer_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_answer *answer = (cdbp_answer *)self;
    PyObject *bits, *table;
    (void)named;
    if (!PyArg_ParseTuple(arguments, "OO", &bits, &table)) return -1;
    if (!cdbp_is_shared(table) || !PyType_IsSubtype(Py_TYPE(bits), &PyLong_Type)) {
        PyErr_SetString(PyExc_TypeError, "an answer is made of an integer and what the answers of its table share");
        return -1;
    }
    cdbp_clear(&answer->rows);
    cdbp_clear(&answer->bits);
    cdbp_clear(&answer->table);
    cdbp_drop_words(answer);
    answer->bits = cdbp_new_ref(bits);
    answer->table = cdbp_new_ref(table);
    return 0;
}

static int cdbp_answer_traverse(PyObject *self, visitproc visit, void *arg)
{
    CDBP_VISIT(Py_TYPE(self))
    CDBP_VISIT(((cdbp_answer *)self)->table)
    CDBP_VISIT(((cdbp_answer *)self)->rows)
    return 0;
}

static int cdbp_answer_clear(PyObject *self)
{
    cdbp_clear(&((cdbp_answer *)self)->table);
    cdbp_clear(&((cdbp_answer *)self)->rows);
    cdbp_clear(&((cdbp_answer *)self)->bits);
    return 0;
}

static void cdbp_answer_free(PyObject *self)
{
    PyObject_GC_UnTrack(self);
    cdbp_answer_clear(self);
    cdbp_drop_words((cdbp_answer *)self);
    cdbp_free(self);
}

static int cdbp_is_answers(PyObject *type)
{
    return PyType_IsSubtype(Py_TYPE(type), &PyType_Type) && cdbp_is_freed_by((PyTypeObject *)type, cdbp_answer_free);
}

/* An answer of a table with room for its rows, which are still to be written; a new reference. */
static cdbp_answer *cdbp_new_answer(PyTypeObject *type, PyObject *table, size_t n_words)
{
    cdbp_answer *answer = (cdbp_answer *)PyType_GenericAlloc(type, 0);
    if (!answer) return NULL;
    answer->table = cdbp_new_ref(table);
    if (cdbp_take_words(answer, n_words) == 0) return answer;
    Py_DecRef((PyObject *)answer);
    return NULL;
}

/* The integer of some words: a new reference. */
static PyObject *cdbp_integer(const uint64_t *words, Py_ssize_t n_words)
{
    PyObject *octets, *integer;
    while (n_words > 1 && words[n_words - 1] == 0) n_words--;
    if (n_words <= 1) return PyLong_FromUnsignedLongLong(n_words ? words[0] : 0);
    octets = PyBytes_FromStringAndSize((const char *)words, n_words * (Py_ssize_t)sizeof(uint64_t));
    if (!octets) return NULL;
    integer = PyObject_CallMethod((PyObject *)&PyLong_Type, "from_bytes", "Os", octets, "little");
    Py_DecRef(octets);
    return integer;
}

static PyObject *cdbp_answer_bits(PyObject *self, void *unused)
{
    cdbp_answer *answer = (cdbp_answer *)self;
    PyObject *bits;
    (void)unused;
    CDBP_LOCK(self)
    if (!answer->bits && answer->words) answer->bits = cdbp_integer(answer->words, answer->n_words);
    else if (!answer->bits) PyErr_SetString(PyExc_ValueError, "the answer was not made");
    bits = answer->bits;
    if (bits) Py_IncRef(bits);
    CDBP_UNLOCK()
    return bits;
}

static int cdbp_answer_set_bits(PyObject *self, PyObject *bits, void *unused)
{
    cdbp_answer *answer = (cdbp_answer *)self;
    PyObject *old_bits, *old_rows;
    (void)unused;
    if (!bits || !PyType_IsSubtype(Py_TYPE(bits), &PyLong_Type)) {
        PyErr_SetString(PyExc_TypeError, "bits is an integer");
        return -1;
    }
    CDBP_LOCK(self)
    old_bits = answer->bits;
    old_rows = answer->rows;
    answer->bits = cdbp_new_ref(bits);
    answer->rows = NULL;
    cdbp_drop_words(answer);
    CDBP_UNLOCK()
    cdbp_clear(&old_bits);
    cdbp_clear(&old_rows);
    return 0;
}

/* The words of an answer that was made of an integer: 0, or -1 with an error. */
static int cdbp_answer_unfold(cdbp_answer *answer)
{
    PyObject *length, *octets;
    size_t n_bits, n_words;
    char *from;
    if (answer->words) return 0;
    length = answer->bits ? PyObject_CallMethod(answer->bits, "bit_length", NULL) : NULL;
    if (!length) {
        if (!answer->bits) PyErr_SetString(PyExc_ValueError, "the answer was not made");
        return -1;
    }
    n_bits = (size_t)PyLong_AsLongLong(length);
    Py_DecRef(length);
    n_words = n_bits / 64 + 1;
    octets = PyObject_CallMethod(answer->bits, "to_bytes", "ns", (Py_ssize_t)(n_words * sizeof(uint64_t)), "little");
    if (!octets) return -1;
    from = PyBytes_AsString(octets);
    if (from && cdbp_take_words(answer, n_words) == 0) memcpy(answer->words, from, n_words * sizeof(uint64_t));
    Py_DecRef(octets);
    return answer->words ? 0 : -1;
}

/* Part of an array of row numbers: a new reference. */
static PyObject *cdbp_part(PyObject *numbers, int64_t start, int64_t stop)
{
    PyObject *from = PyLong_FromLongLong(start), *to = PyLong_FromLongLong(stop), *slice = NULL, *part = NULL;
    if (from && to) slice = PySlice_New(from, to, NULL);
    if (slice) part = PyObject_GetItem(numbers, slice);
    if (slice) Py_DecRef(slice);
    if (from) Py_DecRef(from);
    if (to) Py_DecRef(to);
    return part;
}

/* The array of one row, or of none for row -1, made once for all answers: a new reference. */
static PyObject *cdbp_single(PyObject *self, int64_t row)
{
    cdbp_shared *shared = (cdbp_shared *)self;
    PyObject **at, *part;
    if (row >= shared->n_rows) {
        PyErr_SetString(PyExc_ValueError, "the table has no such row");
        return NULL;
    }
    at = &shared->single[row < 0 ? shared->n_rows : row];
    CDBP_LOCK(self)
    part = *at ? cdbp_new_ref(*at) : cdbp_part(shared->row_numbers, row < 0 ? 0 : row, row + 1);
    if (part && !*at) *at = cdbp_new_ref(part);
    CDBP_UNLOCK()
    return part;
}

/* An array of so many row numbers, and where they are to be written: a new reference. */
static PyObject *cdbp_new_rows(const cdbp_shared *shared, int64_t n, char **to)
{
    PyObject *octets = PyBytes_FromStringAndSize(NULL, (Py_ssize_t)((size_t)n * sizeof(int64_t))), *rows = NULL;
    *to = octets ? PyBytes_AsString(octets) : NULL;
    if (*to) rows = PyObject_CallFunctionObjArgs(shared->as_rows, octets, NULL);
    if (octets) Py_DecRef(octets);
    return rows;
}

/* Make a new room: 0, or -1 with an error. Other threads may come between where Python is called, and make one too. */
static int cdbp_make_room(cdbp_shared *shared)
{
    char *bytes;
    PyObject *room = cdbp_new_rows(shared, CDBP_ROOM, &bytes), *old = shared->room;
    if (!room) return -1;
    shared->room = room;
    shared->room_bytes = bytes;
    shared->n_taken = 0;
    if (old) Py_DecRef(old);
    return 0;
}

/* The array of a few row numbers, as part of a longer one: a new reference. What is written was no answer's part before. */
static PyObject *cdbp_few(PyObject *self, const int64_t *rows, int64_t n)
{
    cdbp_shared *shared = (cdbp_shared *)self;
    PyObject *room, *part = NULL;
    int status = 0;
    CDBP_LOCK(self)
    while (status == 0 && (!shared->room || shared->n_taken + n > CDBP_ROOM)) status = cdbp_make_room(shared);
    if (status == 0) {
        int64_t start = shared->n_taken;
        shared->n_taken += n;
        memcpy(shared->room_bytes + (size_t)start * sizeof *rows, rows, (size_t)n * sizeof *rows);
        room = cdbp_new_ref(shared->room);
        part = cdbp_part(room, start, start + n);
        Py_DecRef(room);
    }
    CDBP_UNLOCK()
    return part;
}

/* The numbers of the first valid rows, as many as have room in `numbers`, ascending; gives how many rows are valid. */
static int64_t cdbp_first_rows(const uint64_t *rows, size_t n_words, int64_t *numbers, size_t room)
{
    size_t at = 0, n = 0;
    for (;; at++) {
        uint64_t word;
        while (at + 4 <= n_words && (rows[at] | rows[at + 1] | rows[at + 2] | rows[at + 3]) == 0) at += 4;
        if (at >= n_words) return (int64_t)n;
        for (word = rows[at]; word && n < room; word &= word - 1) numbers[n++] = (int64_t)(at * 64 + cdbi_first_bit(word));
        if (word) return (int64_t)n + (int64_t)cdbi_count_bits(word) + cdb_count(rows + at + 1, n_words - at - 1);
    }
}

/* The array of row numbers: a new reference. */
static PyObject *cdbp_answer_made_rows(cdbp_answer *answer)
{
    size_t n_words = (size_t)answer->n_words;
    int64_t few[CDBP_FEW_ROWS], row = -1, n = cdbp_first_rows(answer->words, n_words, few, CDBP_FEW_ROWS), i;
    PyObject *rows;
    char *to;
    if (n < 2) return cdbp_single(answer->table, n == 0 ? -1 : few[0]);
    if (n <= CDBP_FEW_ROWS) return cdbp_few(answer->table, few, n);
    rows = cdbp_new_rows((const cdbp_shared *)answer->table, n, &to);
    for (i = 0; rows && i < n; i++, to += sizeof row) {
        row = cdb_next_row(answer->words, n_words, row);
        memcpy(to, &row, sizeof row);
    }
    return rows;
}

static PyObject *cdbp_answer_rows(PyObject *self, void *unused)
{
    cdbp_answer *answer = (cdbp_answer *)self;
    PyObject *rows;
    (void)unused;
    CDBP_LOCK(self)
    if (answer->rows) rows = cdbp_new_ref(answer->rows);
    else rows = cdbp_answer_unfold(answer) == 0 ? cdbp_answer_made_rows(answer) : NULL;
    if (rows && !answer->rows) answer->rows = cdbp_new_ref(rows);
    CDBP_UNLOCK()
    return rows;
}

static Py_ssize_t cdbp_answer_length(PyObject *self)
{
    cdbp_answer *answer = (cdbp_answer *)self;
    Py_ssize_t n;
    CDBP_LOCK(self)
    n = cdbp_answer_unfold(answer) == 0 ? (Py_ssize_t)cdb_count(answer->words, (size_t)answer->n_words) : -1;
    CDBP_UNLOCK()
    return n;
}

static int cdbp_answer_is_any(PyObject *self)
{
    cdbp_answer *answer = (cdbp_answer *)self;
    int is_any;
    CDBP_LOCK(self)
    is_any = cdbp_answer_unfold(answer);
    if (is_any == 0) is_any = cdb_next_row(answer->words, (size_t)answer->n_words, -1) >= 0;
    CDBP_UNLOCK()
    return is_any;
}

static PyObject *cdbp_answer_table(PyObject *self, void *unused)
{
    PyObject *table = ((cdbp_answer *)self)->table;
    (void)unused;
    if (!table) PyErr_SetString(PyExc_ValueError, "the answer was not made");
    else Py_IncRef(table);
    return table;
}

static PyGetSetDef cdbp_answer_members[] = {
    {"_table", cdbp_answer_table, NULL, "What the answers of its table share.", NULL},
    {"bits", cdbp_answer_bits, cdbp_answer_set_bits, "The rows as one Python integer, row r as bit r.", NULL},
    {"indices", cdbp_answer_rows, NULL, "Row numbers, ascending: int64 [count], read-only.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};
static PyType_Slot cdbp_answer_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_answer_init)},
    {Py_tp_traverse, CDBP_SLOT(cdbp_answer_traverse)},
    {Py_tp_clear, CDBP_SLOT(cdbp_answer_clear)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_answer_free)},
    {Py_tp_getset, cdbp_answer_members},
    {Py_sq_length, CDBP_SLOT(cdbp_answer_length)},
    {Py_nb_bool, CDBP_SLOT(cdbp_answer_is_any)},
    {0, NULL},
};
static PyType_Spec cdbp_answer_spec = {"contextdb.core._core.Answer", (int)sizeof(cdbp_answer), 0,
    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_GC, cdbp_answer_slots};
