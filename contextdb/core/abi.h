/* The names of Python's stable ABI (3.11 and later) that the core uses, so that it compiles where Python.h is missing. A build of
 * free-threaded Python, which has no stable ABI, defines CDBP_HEADERS and takes its types from Python.h; the functions below are
 * then compared with the real ones by the compiler. */

#ifdef CDBP_HEADERS
#include <Python.h>
#include <structmember.h>
#define CDBP_OBJECT Py_T_OBJECT_EX
#ifndef Py_T_OBJECT_EX
#define Py_T_OBJECT_EX T_OBJECT_EX
#endif
#else

#include <stddef.h>
#include <stdint.h>

typedef intptr_t Py_ssize_t;
typedef struct _typeobject PyTypeObject;
typedef struct _ts PyThreadState;
typedef struct _object {
    Py_ssize_t ob_refcnt;
    PyTypeObject *ob_type;
} PyObject;

typedef PyObject *(*PyCFunction)(PyObject *, PyObject *);
typedef int (*visitproc)(PyObject *, void *);
typedef struct PyMethodDef {
    const char *ml_name;
    PyCFunction ml_meth;
    int ml_flags;
    const char *ml_doc;
} PyMethodDef;
typedef struct PyGetSetDef {
    const char *name;
    PyObject *(*get)(PyObject *, void *);
    int (*set)(PyObject *, PyObject *, void *);
    const char *doc;
    void *closure;
} PyGetSetDef;
typedef struct PyMemberDef {
    const char *name;
    int type;
    Py_ssize_t offset;
    int flags;
    const char *doc;
} PyMemberDef;
typedef struct PyType_Slot {
    int slot;
    void *pfunc;
} PyType_Slot;
typedef struct PyType_Spec {
    const char *name;
    int basicsize, itemsize;
    unsigned int flags;
    PyType_Slot *slots;
} PyType_Spec;
typedef struct PyModuleDef_Slot {
    int slot;
    void *value;
} PyModuleDef_Slot;
typedef struct PyModuleDef {
    PyObject ob_base;
    PyObject *(*m_init)(void);
    Py_ssize_t m_index;
    PyObject *m_copy;
    const char *m_name, *m_doc;
    Py_ssize_t m_size;
    PyMethodDef *m_methods;
    PyModuleDef_Slot *m_slots;
    void *m_traverse, *m_clear, *m_free;
} PyModuleDef;
typedef struct Py_buffer {
    void *buf;
    PyObject *obj;
    Py_ssize_t len, itemsize;
    int readonly, ndim;
    char *format;
    Py_ssize_t *shape, *strides, *suboffsets;
    void *internal;
} Py_buffer;

#define PyModuleDef_HEAD_INIT {1, NULL}, NULL, 0, NULL
#define Py_TYPE(object) ((object)->ob_type)
#define METH_VARARGS 0x01
#define METH_NOARGS 0x04
#define METH_O 0x08
#define METH_FASTCALL 0x80
#define METH_KEYWORDS 0x02
#define PyBUF_WRITABLE 0x01
#define PyBUF_FORMAT 0x04
#define PyBUF_C_CONTIGUOUS 0x38
#define Py_TPFLAGS_DEFAULT 0
#define Py_TPFLAGS_BASETYPE (1U << 10)
#define Py_TPFLAGS_HAVE_GC (1U << 14)
#define Py_mp_ass_subscript 3
#define Py_nb_bool 9
#define Py_sq_length 45
#define Py_tp_base 48
#define Py_tp_clear 51
#define Py_tp_dealloc 52
#define Py_tp_init 60
#define Py_tp_methods 64
#define Py_tp_new 65
#define Py_tp_traverse 71
#define Py_tp_members 72
#define Py_tp_getset 73
#define Py_tp_free 74
#define Py_mod_exec 2
#define Py_T_OBJECT_EX 16

#ifdef _WIN32
#define CDBP_DATA extern __declspec(dllimport)
#define PyMODINIT_FUNC __declspec(dllexport) PyObject *
#elif defined(__GNUC__)
#define CDBP_DATA extern
#define PyMODINIT_FUNC __attribute__((visibility("default"))) PyObject *
#else
#define CDBP_DATA extern
#define PyMODINIT_FUNC PyObject *
#endif

CDBP_DATA PyObject _Py_NoneStruct, _Py_TrueStruct, _Py_FalseStruct;
CDBP_DATA PyTypeObject PyDict_Type, PyFloat_Type, PyFrozenSet_Type, PyList_Type, PyLong_Type, PySet_Type, PyTuple_Type, PyType_Type;
CDBP_DATA PyTypeObject PyCapsule_Type, PyUnicode_Type;
CDBP_DATA PyObject *PyExc_TypeError, *PyExc_ValueError;
#define Py_None (&_Py_NoneStruct)
#define Py_True (&_Py_TrueStruct)
#define Py_False (&_Py_FalseStruct)
#endif

#if !defined(CDBP_HEADERS) || !defined(_WIN32)
/* References, errors, memory */
void Py_IncRef(PyObject *);
void Py_DecRef(PyObject *);
int PyErr_CheckSignals(void);
void PyErr_Clear(void);
int PyErr_ExceptionMatches(PyObject *);
PyObject *PyErr_Format(PyObject *, const char *, ...);
PyObject *PyErr_NoMemory(void);
PyObject *PyErr_Occurred(void);
void PyErr_SetString(PyObject *, const char *);
void *PyMem_Calloc(size_t, size_t);
void *PyMem_Malloc(size_t);
void PyMem_Free(void *);
/* Threads */
PyThreadState *PyEval_SaveThread(void);
void PyEval_RestoreThread(PyThreadState *);
/* Objects */
PyObject *PyCMethod_New(PyMethodDef *, PyObject *, PyObject *, PyTypeObject *);
PyObject *PyObject_Call(PyObject *, PyObject *, PyObject *);
PyObject *PyObject_CallFunctionObjArgs(PyObject *, ...);
PyObject *PyObject_CallMethod(PyObject *, const char *, const char *, ...);
PyObject *PyObject_GetItem(PyObject *, PyObject *);
PyObject *PyObject_GetIter(PyObject *);
PyObject *PyIter_Next(PyObject *);
int PyObject_IsTrue(PyObject *);
void PyObject_GC_UnTrack(void *);
int PyObject_GetBuffer(PyObject *, Py_buffer *, int);
void PyBuffer_Release(Py_buffer *);
PyObject *PySlice_New(PyObject *, PyObject *, PyObject *);
/* Values */
PyObject *Py_BuildValue(const char *, ...);
PyObject *PyBytes_FromStringAndSize(const char *, Py_ssize_t);
char *PyBytes_AsString(PyObject *);
int PyBytes_AsStringAndSize(PyObject *, char **, Py_ssize_t *);
int PyDict_DelItem(PyObject *, PyObject *);
PyObject *PyDict_New(void);
PyObject *PyDict_GetItemString(PyObject *, const char *);
PyObject *PyDict_GetItemWithError(PyObject *, PyObject *);
int PyDict_Next(PyObject *, Py_ssize_t *, PyObject **, PyObject **);
int PyDict_SetItem(PyObject *, PyObject *, PyObject *);
int PyDict_SetItemString(PyObject *, const char *, PyObject *);
Py_ssize_t PyObject_Length(PyObject *);
Py_ssize_t PyDict_Size(PyObject *);
double PyFloat_AsDouble(PyObject *);
PyObject *PyFloat_FromDouble(double);
double PyLong_AsDouble(PyObject *);
long PyLong_AsLong(PyObject *);
long long PyLong_AsLongLong(PyObject *);
PyObject *PyLong_FromLongLong(long long);
PyObject *PyLong_FromSsize_t(Py_ssize_t);
PyObject *PyLong_FromUnsignedLongLong(unsigned long long);
PyObject *PySequence_Tuple(PyObject *);
PyObject *PyTuple_GetItem(PyObject *, Py_ssize_t);
PyObject *PyTuple_New(Py_ssize_t);
int PyTuple_SetItem(PyObject *, Py_ssize_t, PyObject *);
Py_ssize_t PyTuple_Size(PyObject *);
int PyUnicode_Compare(PyObject *, PyObject *);
const char *PyUnicode_AsUTF8AndSize(PyObject *, Py_ssize_t *);
/* Types and modules */
int PyArg_ParseTuple(PyObject *, const char *, ...);
void *PyCapsule_GetPointer(PyObject *, const char *);
int PyModule_AddObjectRef(PyObject *, const char *, PyObject *);
PyObject *PyModuleDef_Init(PyModuleDef *);
PyObject *PyType_FromModuleAndSpec(PyObject *, PyType_Spec *, PyObject *);
PyObject *PyType_GenericAlloc(PyTypeObject *, Py_ssize_t);
void *PyType_GetSlot(PyTypeObject *, int);
int PyType_IsSubtype(PyTypeObject *, PyTypeObject *);
#endif
