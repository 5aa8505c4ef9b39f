/* ---- Masks for Python: those of a column, made of its cells; see contextdb.compiled.classes. */

/* For each row turn over its bit in the masks of its cell. `first` has for each cell the place of its first mask in `numbers`, `next`
 * for each of them that of the cell's next one; n_numbers where there is none. */
static void cdbp_turn_rows(const int32_t *codes, size_t n_rows, const size_t *first, size_t n_cells, const size_t *next,
    const int64_t *numbers, size_t n_numbers, uint64_t *masks, size_t n_words)
{
    size_t row, at;
    for (row = 0; row < n_rows; row++) {
        if (codes[row] < 0 || (size_t)codes[row] >= n_cells) continue;
        for (at = first[codes[row]]; at < n_numbers; at = next[at])
            masks[(size_t)numbers[at] * n_words + row / 64] ^= (uint64_t)1 << row % 64;
    }
}

/* How many cells there are, the last one being one that has a mask; 0 with an error where a cell or a mask is none. */
static size_t cdbp_n_cells(const int64_t *cells, const int64_t *numbers, size_t n, size_t n_masks)
{
    size_t most = 0, i;
    for (i = 0; i < n; i++) {
        if (cells[i] < 0 || cells[i] > INT32_MAX || numbers[i] < 0 || (size_t)numbers[i] >= n_masks) {
            PyErr_SetString(PyExc_ValueError, "a number is out of range");
            return 0;
        }
        if ((size_t)cells[i] >= most) most = (size_t)cells[i] + 1;
    }
    return most;
}

/* turn_rows(codes, cells, numbers, masks) */
static PyObject *cdbp_turn_rows_of(PyObject *module, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    cdbp_arrays arrays = {.n = 0};
    const int32_t *codes;
    const int64_t *cells, *numbers;
    uint64_t *masks;
    size_t n_rows = 0, n = 0, n_numbers = 0, shape[2] = {0, 0}, n_cells, *first, i;
    (void)module;
    if (n_arguments != 4) {
        PyErr_SetString(PyExc_TypeError, "turn_rows takes codes, cells, numbers and masks");
        return NULL;
    }
    codes = (const int32_t *)cdbp_items(&arrays, arguments[0], 'i', sizeof(int32_t), 1, 0, &n_rows);
    cells = codes ? (const int64_t *)cdbp_items(&arrays, arguments[1], 'i', sizeof(int64_t), 1, 0, &n) : NULL;
    numbers = cells ? (const int64_t *)cdbp_items(&arrays, arguments[2], 'i', sizeof(int64_t), 1, 0, &n_numbers) : NULL;
    masks = numbers ? (uint64_t *)cdbp_items(&arrays, arguments[3], 'u', sizeof(uint64_t), 2, 1, shape) : NULL;
    if (masks && (n != n_numbers || shape[1] != (n_rows + 63) / 64))
        PyErr_SetString(PyExc_ValueError, "an array has another shape than it must have");
    else if (masks && (n_cells = cdbp_n_cells(cells, numbers, n, shape[0])) > 0) {
        first = (size_t *)PyMem_Malloc((n_cells + n) * sizeof *first);
        if (!first) PyErr_NoMemory();
        else {
            PyThreadState *thread = PyEval_SaveThread();
            for (i = 0; i < n_cells; i++) first[i] = n;
            for (i = 0; i < n; i++) {
                first[n_cells + i] = first[cells[i]];
                first[cells[i]] = i;
            }
            cdbp_turn_rows(codes, n_rows, first, n_cells, first + n_cells, numbers, n, masks, shape[1]);
            PyEval_RestoreThread(thread);
            PyMem_Free(first);
        }
    }
    return cdbp_done(&arrays);
}
