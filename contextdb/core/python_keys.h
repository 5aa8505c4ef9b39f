/* ---- Keys for Python: see contextdb.telemetry.keys. */

/* A field: (word, shift, bits, first), of keys of so many words. */
static int cdbp_field(PyObject *about, size_t n_words, cdbi_field *field)
{
    Py_ssize_t word;
    int shift, n_bits, first;
    if (cdbp_length(about) < 0 || !PyArg_ParseTuple(about, "niii", &word, &shift, &n_bits, &first)) return -1;
    if (word < 0 || (size_t)word >= n_words || shift < 0 || n_bits < 1 || n_bits > 31 || shift + n_bits > 64) {
        PyErr_SetString(PyExc_ValueError, "a key has no such field");
        return -1;
    }
    field->word = (size_t)word;
    field->shift = (unsigned)shift;
    field->bits = ((uint64_t)1 << n_bits) - 1;
    field->first = first;
    return 0;
}

static PyObject *cdbp_done(cdbp_arrays *arrays)
{
    cdbp_release(arrays);
    return PyErr_Occurred() ? NULL : cdbp_new_ref(Py_None);
}

/* pack_codes(codes, field, words) */
static PyObject *cdbp_pack_codes(PyObject *module, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    cdbp_arrays arrays;
    cdbi_field field;
    const int32_t *codes;
    uint64_t *words;
    size_t n = 0, shape[2] = {0, 0};
    (void)module;
    arrays.n = 0;
    if (n_arguments != 3) {
        PyErr_SetString(PyExc_TypeError, "pack_codes takes codes, field and words");
        return NULL;
    }
    codes = (const int32_t *)cdbp_items(&arrays, arguments[0], 'i', sizeof(int32_t), 1, 0, &n);
    words = codes ? (uint64_t *)cdbp_items(&arrays, arguments[2], 'u', sizeof(uint64_t), 2, 1, shape) : NULL;
    if (words && n != shape[1]) PyErr_SetString(PyExc_ValueError, "there are other codes than keys");
    else if (words && cdbp_field(arguments[1], shape[0], &field) == 0) {
        PyThreadState *thread = PyEval_SaveThread();
        cdbi_pack_codes(codes, n, &field, words + field.word * n);
        PyEval_RestoreThread(thread);
    }
    return cdbp_done(&arrays);
}

/* Whether numbers are all below a limit, from 0 on. */
static int cdbp_are_below(const int32_t *numbers, size_t n, size_t limit)
{
    int is_wrong = 0;
    size_t k;
    for (k = 0; k < n; k++) is_wrong |= numbers[k] < 0 || (size_t)numbers[k] >= limit;
    if (is_wrong) PyErr_SetString(PyExc_ValueError, "a number is out of range");
    return !is_wrong;
}

/* unpack_codes(words, rows, fields, codes) */
static PyObject *cdbp_unpack_codes(PyObject *module, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    cdbp_arrays arrays;
    const uint64_t *words;
    const int32_t *rows;
    int32_t *codes = NULL;
    size_t shape[2] = {0, 0}, n_rows = 0, to[2] = {0, 0}, i;
    (void)module;
    arrays.n = 0;
    if (n_arguments != 4 || cdbp_length(arguments[2]) < 0) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_TypeError, "unpack_codes takes words, rows, fields and codes");
        return NULL;
    }
    words = (const uint64_t *)cdbp_items(&arrays, arguments[0], 'u', sizeof(uint64_t), 2, 0, shape);
    rows = words ? (const int32_t *)cdbp_items(&arrays, arguments[1], 'i', sizeof(int32_t), 1, 0, &n_rows) : NULL;
    codes = rows ? (int32_t *)cdbp_items(&arrays, arguments[3], 'i', sizeof(int32_t), 2, 1, to) : NULL;
    if (codes && (to[0] != (size_t)PyTuple_Size(arguments[2]) || to[1] != n_rows))
        PyErr_SetString(PyExc_ValueError, "the codes have another shape than fields and rows");
    else if (codes && cdbp_are_below(rows, n_rows, shape[1]))
        for (i = 0; i < to[0]; i++) {
            cdbi_field field;
            if (cdbp_field(PyTuple_GetItem(arguments[2], (Py_ssize_t)i), shape[0], &field) != 0) break;
            cdbi_unpack_codes(words + field.word * shape[1], rows, n_rows, &field, codes + i * n_rows);
        }
    return cdbp_done(&arrays);
}

/* hash_keys(words, hashes) */
static PyObject *cdbp_hash_keys(PyObject *module, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    cdbp_arrays arrays;
    const uint64_t *words;
    uint64_t *hashes;
    size_t shape[2] = {0, 0}, n = 0;
    (void)module;
    arrays.n = 0;
    if (n_arguments != 2) {
        PyErr_SetString(PyExc_TypeError, "hash_keys takes words and hashes");
        return NULL;
    }
    words = (const uint64_t *)cdbp_items(&arrays, arguments[0], 'u', sizeof(uint64_t), 2, 0, shape);
    hashes = words ? (uint64_t *)cdbp_items(&arrays, arguments[1], 'u', sizeof(uint64_t), 1, 1, &n) : NULL;
    if (hashes && n != shape[1]) PyErr_SetString(PyExc_ValueError, "there are other hashes than keys");
    else if (hashes) {
        PyThreadState *thread = PyEval_SaveThread();
        cdbi_hash_keys(words, shape[0], n, hashes);
        PyEval_RestoreThread(thread);
    }
    return cdbp_done(&arrays);
}

/* group_keys(words, hashes, moments, first, sums): how many distinct keys there are. */
static PyObject *cdbp_group_keys(PyObject *module, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    cdbp_arrays arrays;
    const uint64_t *words, *hashes;
    const int64_t *moments;
    int32_t *first, *table = NULL;
    int64_t *sums;
    size_t shape[2] = {0, 0}, n[4] = {0, 0, 0, 0}, last = 1, n_groups = 0;
    (void)module;
    arrays.n = 0;
    if (n_arguments != 5) {
        PyErr_SetString(PyExc_TypeError, "group_keys takes words, hashes, moments, first and sums");
        return NULL;
    }
    words = (const uint64_t *)cdbp_items(&arrays, arguments[0], 'u', sizeof(uint64_t), 2, 0, shape);
    hashes = words ? (const uint64_t *)cdbp_items(&arrays, arguments[1], 'u', sizeof(uint64_t), 1, 0, &n[0]) : NULL;
    moments = hashes ? (const int64_t *)cdbp_items(&arrays, arguments[2], 'i', sizeof(int64_t), 1, 0, &n[1]) : NULL;
    first = moments ? (int32_t *)cdbp_items(&arrays, arguments[3], 'i', sizeof(int32_t), 1, 1, &n[2]) : NULL;
    sums = first ? (int64_t *)cdbp_items(&arrays, arguments[4], 'i', sizeof(int64_t), 1, 1, &n[3]) : NULL;
    if (sums && (n[0] != shape[1] || n[1] != n[0] || n[2] != n[0] || n[3] != n[0] || n[0] >= INT32_MAX / 4))
        PyErr_SetString(PyExc_ValueError, "the arrays are not as long as there are keys");
    else if (sums) {
        while (last <= 2 * n[0]) last *= 2;
        table = (int32_t *)PyMem_Calloc(last, sizeof *table);
        if (!table) PyErr_NoMemory();
    }
    if (table) {
        PyThreadState *thread = PyEval_SaveThread();
        n_groups = cdbi_group_keys(words, shape[0], n[0], hashes, moments, table, last - 1, first, sums);
        PyEval_RestoreThread(thread);
    }
    PyMem_Free(table);
    cdbp_release(&arrays);
    return PyErr_Occurred() ? NULL : PyLong_FromSsize_t((Py_ssize_t)n_groups);
}

/* list_rows(masks, rows): `rows` has exactly the room that is needed. */
static PyObject *cdbp_list_rows(PyObject *module, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    cdbp_arrays arrays;
    const uint64_t *masks;
    int64_t *rows;
    size_t shape[2] = {0, 0}, n = 0, held = 0, i;
    (void)module;
    arrays.n = 0;
    if (n_arguments != 2) {
        PyErr_SetString(PyExc_TypeError, "list_rows takes masks and rows");
        return NULL;
    }
    masks = (const uint64_t *)cdbp_items(&arrays, arguments[0], 'u', sizeof(uint64_t), 2, 0, shape);
    rows = masks ? (int64_t *)cdbp_items(&arrays, arguments[1], 'i', sizeof(int64_t), 1, 1, &n) : NULL;
    for (i = 0; rows && i < shape[0] * shape[1]; i++) held += (size_t)cdbi_count_bits(masks[i]);
    if (rows && held != n) PyErr_SetString(PyExc_ValueError, "there are other rows than the masks hold");
    else if (rows) cdbi_rows_of_masks(masks, shape[0], shape[1], rows);
    return cdbp_done(&arrays);
}
