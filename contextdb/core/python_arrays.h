/* ---- Arrays for Python: what a function of the extension takes and fills, numpy's arrays without a copy. Each is checked where it
 * comes in; it is in use until `cdbp_release`. */

#define CDBP_MOST_ARRAYS 64
#define CDBP_CALL(function) ((PyCFunction)(void (*)(void))(function))

typedef struct cdbp_arrays {
    Py_buffer views[CDBP_MOST_ARRAYS];
    size_t n;
} cdbp_arrays;

/* Whether a format of one item means what `kind` says: 'i' whole numbers, 'u' whole numbers from 0, 'f' floats, 'b' True and False. */
static int cdbp_is_kind(const char *format, char kind)
{
    static const char whole[] = "bhilq", from_0[] = "BHILQ";
    if (*format == '=' || *format == '<' || *format == '@') format++;
    if (!*format || format[1]) return 0;
    if (kind == 'i') return strchr(whole, *format) != NULL;
    if (kind == 'u') return strchr(from_0, *format) != NULL;
    return kind == 'f' ? *format == 'f' || *format == 'd' : kind == 'b' && *format == '?';
}

/* Take the items of an array of numbers of `size` bytes each in so many dimensions, without gaps: 0, or -1 with an error for another
 * one, which then is not taken. */
static int cdbp_take(Py_buffer *view, PyObject *array, char kind, size_t size, int n_dimensions, int is_written)
{
    static uint64_t nothing;
    int flags = PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (is_written ? PyBUF_WRITABLE : 0);
    if (PyObject_GetBuffer(array, view, flags) != 0) return -1;
    if ((size_t)view->itemsize != size || ((uintptr_t)view->buf & (size - 1)) != 0 || view->ndim != n_dimensions ||
        !cdbp_is_kind(view->format, kind)) {
        PyBuffer_Release(view);
        PyErr_SetString(PyExc_ValueError, "an array has another type, shape or place than it must have");
        return -1;
    }
    if (!view->len) view->buf = &nothing;
    return 0;
}

/* The same for an array of a call; NULL with an error. `shape` gets the length of each dimension. */
static void *cdbp_items(cdbp_arrays *arrays, PyObject *array, char kind, size_t size, int n_dimensions, int is_written, size_t *shape)
{
    Py_buffer *view = &arrays->views[arrays->n];
    int i;
    if (arrays->n == CDBP_MOST_ARRAYS) {
        PyErr_SetString(PyExc_ValueError, "a call has more arrays than it can have");
        return NULL;
    }
    if (cdbp_take(view, array, kind, size, n_dimensions, is_written) != 0) return NULL;
    arrays->n++;
    for (i = 0; i < n_dimensions; i++) shape[i] = (size_t)view->shape[i];
    return view->buf;
}

/* Give all arrays of a call back. */
static void cdbp_release(cdbp_arrays *arrays)
{
    while (arrays->n > 0) PyBuffer_Release(&arrays->views[--arrays->n]);
}
