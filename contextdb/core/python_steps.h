/* ---- Steps: how a question comes from the facts of a dict to the masks that it joins. All that it needs of a condition as a rule is
 * in one step, so that little memory is read. Columns of few classes are joined in groups, which have the mask of each of their joint
 * classes: one mask answers for several facts.
 *
 * Source: the first phase of recursive flow classification, Gupta and McKeown, SIGCOMM 1999. */

#define CDBP_LEAVES 64               /* the most joint classes of a group */
#define CDBP_GROUP_BYTES (256 << 10) /* the most bytes of their masks: beyond, caches hold less than the joining saves */

enum { CDBP_BY_FACT, CDBP_BY_TRUTH, CDBP_BY_VALUE, CDBP_BY_NUMBER };

typedef struct cdbp_step {
    PyObject *name, *alias;         /* an equal text that was met in a dict, as one that is read from JSON; or NULL */
    const cdbp_known *known;        /* by value: see cdbp_reader */
    const uint64_t *places;         /* by number: see cdb_column */
    size_t n_places;
    size_t stride;                  /* words from one class to the next in the masks of its group */
    uint32_t group;
    uint16_t shift, how;
} cdbp_step;

/* The classes of a column that can be joined with others: those of declared values; 0 for another column. */
static size_t cdbp_n_joint(const cdb_condition *condition, const cdb_column *column)
{
    return column->kind == CDBI_VALUE && condition->type != CDB_TEXT ? column->texts.n : 0;
}

/* What one condition needs by itself. */
static void cdbp_set_step(cdbp_step *step, PyObject *name, const cdb_condition *condition, const cdb_column *column,
    const cdbp_reader *reader)
{
    step->name = name;
    step->how = CDBP_BY_FACT;
    if (condition->type == CDB_BOOL) step->how = CDBP_BY_TRUTH;
    else if (condition->type == CDB_ENUM) {
        step->how = CDBP_BY_VALUE;
        step->known = reader->known;
        step->shift = (uint16_t)reader->shift;
    } else if (condition->type == CDB_NUMBER && column->kind == CDBI_FLAT) {
        step->how = CDBP_BY_NUMBER;
        step->places = column->places;
        step->n_places = column->n_bounds;
    }
}

typedef struct cdbp_group {         /* columns that are joined, while their steps are made */
    size_t n_leaves, n_columns;
    uint64_t *joint;
} cdbp_group;

/* Whether a group has room for a column of so many classes. */
static int cdbp_has_room(const cdbp_group *group, size_t n_classes, size_t n_words)
{
    size_t n_leaves = group->n_leaves * n_classes;
    return n_leaves > 0 && n_leaves <= CDBP_LEAVES && n_leaves * n_words * sizeof(uint64_t) <= CDBP_GROUP_BYTES;
}

/* Join a column with those before it: `joint` has n masks, and room for those with each of its classes. */
static void cdbp_join(uint64_t *joint, size_t n, const cdb_column *column, size_t n_words)
{
    size_t class = column->texts.n, leaf, i;
    while (class-- > 0)
        for (leaf = 0; leaf < n; leaf++)
            for (i = 0; i < n_words; i++)
                joint[(class * n + leaf) * n_words + i] = joint[leaf * n_words + i] & column->masks[class * n_words + i];
}

/* What the dict of a walk has for a step's condition, or NULL: as cdbp_look_up. */
CDBI_HOT PyObject *cdbp_fact_of(cdbp_step *step, cdbp_walk *walk)
{
#ifndef Py_GIL_DISABLED
    PyObject *next, *value;
    Py_ssize_t at = walk->at;
    if (at >= 0 && PyDict_Next(walk->dict, &at, &next, &value)) {
        if (next != step->name && next != step->alias && !step->alias && Py_TYPE(next) == &PyUnicode_Type
            && PyUnicode_Compare(next, step->name) == 0)
            step->alias = cdbp_new_ref(next);
        if (next == step->name || next == step->alias) {
            walk->at = at;
            return value;
        }
    }
#endif
    return cdbp_look_up(walk, step->name);
}

/* The class of an exact float; -1 for another fact, or one that is missing. */
CDBI_HOT int64_t cdbp_class_of_float(const cdbp_step *step, PyObject *value)
{
    double number;
    if (Py_TYPE(value) != &PyFloat_Type) return -1;
    number = PyFloat_AsDouble(value);
    return cdbi_is_nan(number) ? -1 : (int64_t)cdbi_class_at(step->places, step->n_places, number);
}

/* The class of a fact that is plainly one of a step's; -1 for all others. */
CDBI_HOT int64_t cdbp_class_of(const cdbp_step *step, PyObject *value)
{
    switch (step->how) {
    case CDBP_BY_TRUTH: return value == Py_True ? 1 : value == Py_False ? 0 : -1;
    case CDBP_BY_VALUE: return cdbp_known_number(step->known, step->shift, value);
    case CDBP_BY_NUMBER: return cdbp_class_of_float(step, value);
    default: return -1;
    }
}
