/* ---- Tables for Python: the parts of a compiled table as the core has them, over arrays and texts that Python owns and that the
 * table holds. All of them are checked when it is made, by the checks that an artefact passes when it is opened. */

typedef struct cdbp_table {
    PyObject ob_base;
    cdb_table table;
    cdb_schema schema;
    cdb_column *columns;            /* one for each condition of the schema */
    cdb_condition *conditions;
    cdbp_reader *readers;
    PyObject **names;               /* of each condition; beside each other, as a question goes through them */
    cdbp_step *steps;               /* one for each condition, where has_masks */
    const uint64_t **groups;        /* the masks of the first class of each group of columns */
    size_t n_groups;
    Py_buffer *views;
    size_t n_views;
    size_t n_words, n_texts, n_held, frame_bytes;
    int is_made;
    int has_masks;                  /* there are rows, all facts are given, each column is asked: no rules, no derived facts */
    int has_others;                 /* some columns keep no mask for each class */
    int is_watched;                 /* somebody learns of its questions: Python asks them */
    int is_careful;                 /* a text of it is one that C cannot hold: the careful way answers everything */
    PyTypeObject *answers;          /* the class of answers: a subclass of Answer */
    PyObject *shared, *unusual, *held;
    PyObject *places;               /* dict: the place of each condition that is not derived, by name */
} cdbp_table;

typedef struct cdbp_making {        /* a table while it is made */
    cdbp_table *own;
    cdbi_opening opening;
    size_t views_room;
} cdbp_making;

/* The length of a tuple; -1 with an error for what is none. */
static Py_ssize_t cdbp_length(PyObject *tuple)
{
    if (tuple && Py_TYPE(tuple) == &PyTuple_Type) return PyTuple_Size(tuple);
    if (tuple) PyErr_SetString(PyExc_TypeError, "a part of a table is no tuple");
    return -1;
}

/* A text of Python's as C has it; NULL with an error for one that C cannot hold. */
static const char *cdbp_c_text(PyObject *text)
{
    Py_ssize_t length;
    const char *found = PyUnicode_AsUTF8AndSize(text, &length);
    if (found && strlen(found) != (size_t)length) {
        PyErr_SetString(PyExc_ValueError, "a text holds a NUL character");
        return NULL;
    }
    return found;
}

/* An array of numbers of `size` bytes each in so many dimensions, without gaps, as long as the table holds it; NULL with an error
 * for another. `shape` is that of the array. */
static const void *cdbp_array(cdbp_making *making, PyObject *array, size_t size, int n_dimensions, const Py_ssize_t **shape)
{
    static const uint64_t nothing = 0;
    Py_buffer *view = &making->own->views[making->own->n_views];
    if (making->own->n_views == making->views_room) {
        PyErr_SetString(PyExc_ValueError, "a table has more arrays than it can have");
        return NULL;
    }
    if (PyObject_GetBuffer(array, view, PyBUF_C_CONTIGUOUS) != 0) return NULL;
    making->own->n_views++;
    if ((size_t)view->itemsize != size || ((uintptr_t)view->buf & (size - 1)) != 0 || view->ndim != n_dimensions) {
        PyErr_SetString(PyExc_ValueError, "an array has another type, shape or place than it must have");
        return NULL;
    }
    *shape = view->shape;
    return view->len ? view->buf : &nothing;
}

/* The same for one row of numbers, `*n` of them. */
static const void *cdbp_row(cdbp_making *making, PyObject *array, size_t size, size_t *n)
{
    const Py_ssize_t *shape;
    const void *at = cdbp_array(making, array, size, 1, &shape);
    *n = at ? (size_t)shape[0] : 0;
    return at;
}

/* The same for masks of `n_words` words, the last dimension of the array. */
static const uint64_t *cdbp_masks(cdbp_making *making, PyObject *array, size_t n_words, int n_dimensions, const Py_ssize_t **shape)
{
    const uint64_t *words = (const uint64_t *)cdbp_array(making, array, sizeof(uint64_t), n_dimensions, shape);
    if (!words || (size_t)(*shape)[n_dimensions - 1] == n_words) return words;
    PyErr_SetString(PyExc_ValueError, "an array has another shape than it must have");
    return NULL;
}

/* The texts of a tuple: 0, or -1 with an error. */
static int cdbp_texts(cdbp_making *making, PyObject *tuple, cdbi_list *list)
{
    Py_ssize_t n = cdbp_length(tuple), i;
    list->n = 0;
    if (n < 0) return -1;
    list->texts = (const char **)cdbi_memory(&making->opening, (size_t)n, sizeof *list->texts);
    for (i = 0; list->texts && i < n; i++) {
        list->texts[i] = cdbp_c_text(PyTuple_GetItem(tuple, i));
        if (!list->texts[i]) return -1;
    }
    list->n = list->texts ? (size_t)n : 0;
    return list->texts ? 0 : -1;
}

/* The values of a text column, ascending, with the class of each. */
static int cdbp_text_values(cdbp_making *making, PyObject *values, cdb_column *column)
{
    size_t i;
    if (cdbp_texts(making, values, &column->texts) != 0) return -1;
    column->classes = (uint32_t *)cdbi_memory(&making->opening, column->texts.n, sizeof(uint32_t));
    if (!column->classes) return -1;
    for (i = 0; i < column->texts.n; i++) column->classes[i] = (uint32_t)i;
    cdbi_sort(&column->texts, column->classes);
    return 0;
}

/* The slots of cells that begin with "not": a tuple of slots, each a tuple of parts (needs, bans, is_complement). */
static int cdbp_negated(cdbp_making *making, const cdb_condition *condition, PyObject *slots, cdb_column *column)
{
    Py_ssize_t n = cdbp_length(slots), i, j;
    if (n < 0) return -1;
    column->negated = (cdbi_slot *)cdbi_memory(&making->opening, (size_t)n, sizeof(cdbi_slot));
    if (!column->negated) return -1;
    for (i = 0; i < n; i++) {
        PyObject *parts = PyTuple_GetItem(slots, i);
        cdbi_slot *slot = &column->negated[i];
        Py_ssize_t n_parts = cdbp_length(parts);
        if (n_parts < 0) return -1;
        slot->parts = (cdbi_part *)cdbi_memory(&making->opening, (size_t)n_parts, sizeof(cdbi_part));
        if (!slot->parts) return -1;
        slot->n = (size_t)n_parts;
        for (j = 0; j < n_parts; j++) {
            PyObject *needs, *bans, *about = PyTuple_GetItem(parts, j);
            cdbi_part *part = &slot->parts[j];
            if (cdbp_length(about) < 0 || !PyArg_ParseTuple(about, "OOp", &needs, &bans, &part->is_complement)) return -1;
            if (cdbp_texts(making, needs, &part->needs) != 0 || cdbp_texts(making, bans, &part->bans) != 0) return -1;
            cdbi_set_bits(&making->opening, condition, &part->needs);
            cdbi_set_bits(&making->opening, condition, &part->bans);
        }
    }
    column->n_negated = (size_t)n;
    return 0;
}

/* One column: a tuple (kind, shift, arrays, texts, negated); its arrays are masks, or bounds and masks, or bounds, low, high and
 * any_mask. 0, or -1 with an error. */
static int cdbp_column(cdbp_making *making, const cdb_condition *condition, PyObject *about, size_t n_words, cdb_column *column)
{
    PyObject *arrays, *texts, *negated, *one, *two = NULL, *three = NULL, *four = NULL;
    const Py_ssize_t *shape, *other;
    int kind, shift, is_number = cdbi_is_numeric(condition->type);
    if (cdbp_length(about) < 0 || !PyArg_ParseTuple(about, "iiOOO", &kind, &shift, &arrays, &texts, &negated)) return -1;
    if (cdbp_length(arrays) < 0 || !PyArg_ParseTuple(arrays, "O|OOO", &one, &two, &three, &four)) return -1;
    if (is_number != (kind == CDBI_FLAT || kind == CDBI_WIDE) || (condition->type == CDB_TAGS) != (kind == CDBI_SLOTS) || shift < 0
        || shift > 30 || (kind == CDBI_FLAT && !two) || (kind == CDBI_WIDE && !four)) {
        PyErr_SetString(PyExc_ValueError, "a column is kept in a way that its type is not");
        return -1;
    }
    column->kind = kind;
    column->shift = (unsigned)shift;
    if (is_number && !(column->bounds = (const double *)cdbp_row(making, one, sizeof(double), &column->n_bounds))) return -1;
    if (kind == CDBI_WIDE) {
        column->low = cdbp_masks(making, two, n_words, 3, &shape);
        column->high = column->low ? cdbp_masks(making, three, n_words, 3, &other) : NULL;
        column->any_mask = column->high ? cdbp_masks(making, four, n_words, 1, &shape) : NULL;
        if (!column->any_mask) return -1;
        shape = making->own->views[making->own->n_views - 3].shape;
        column->n_layers = (size_t)shape[0];
        column->n_digits = (size_t)shape[1];
        if (shape[0] == other[0] && shape[1] == other[1]) return 0;
        PyErr_SetString(PyExc_ValueError, "an array has another shape than it must have");
        return -1;
    }
    column->masks = cdbp_masks(making, is_number ? two : one, n_words, 2, &shape);
    if (!column->masks) return -1;
    column->n_masks = (size_t)shape[0];
    if (condition->type == CDB_BOOL || condition->type == CDB_ENUM) {
        column->texts.n = condition->type == CDB_BOOL ? 2 : condition->n_values;
        return 0;
    }
    if (condition->type == CDB_TEXT) return cdbp_text_values(making, texts, column);
    if (condition->type != CDB_TAGS) return 0;
    if (cdbp_texts(making, texts, &column->texts) != 0) return -1;
    cdbi_set_bits(&making->opening, condition, &column->texts);
    return cdbp_negated(making, condition, negated, column);
}

/* Know the values of an enum by their objects. Equal ones that are other objects are looked up, and then known too. */
static int cdbp_know_values(cdbp_making *making, cdbp_reader *reader, PyObject *values, size_t n)
{
    size_t room = 2, i;
    for (reader->shift = 63; room < 8 * n && room < CDBP_KNOWN; room *= 2) reader->shift--;
    reader->known = (cdbp_known *)cdbi_memory(&making->opening, room, sizeof(cdbp_known));
    if (!reader->known) return -1;
    reader->n_known = room;
    for (i = 0; i < n; i++) cdbp_know(reader, PyTuple_GetItem(values, (Py_ssize_t)i), (long)i);
    return 0;
}

/* How the penalties of soft cells grow: (per, starts, ends, which), all flat. */
static int cdbp_growth(cdbp_making *making, PyObject *const *in, cdbi_soft *soft, size_t n_soft)
{
    size_t n_ends, n_which;
    soft->per = (const double *)cdbp_row(making, in[0], sizeof(double), &soft->n_cells);
    soft->starts = (const int64_t *)cdbp_row(making, in[1], sizeof(int64_t), &soft->n_starts);
    soft->ends = (const double *)cdbp_row(making, in[2], sizeof(double), &n_ends);
    soft->which = (const int32_t *)cdbp_row(making, in[3], sizeof(int32_t), &n_which);
    if (PyErr_Occurred()) return -1;
    soft->n_spans = n_ends / 2;
    if (n_which == n_soft && cdbi_is_sound_growth(soft, n_soft)) return 0;
    PyErr_SetString(PyExc_ValueError, "how penalties grow does not go together");
    return -1;
}

/* The soft cells of a condition: a tuple (column, penalties), with how they grow behind. The column has the rows of each depth, one
 * after the other. */
static int cdbp_soft(cdbp_making *making, PyObject *about, size_t at)
{
    cdb_table *table = &making->own->table;
    PyObject *column, *penalties, *growth[4] = {NULL, NULL, NULL, NULL};
    cdbi_soft *soft;
    size_t n = 0;
    if (cdbp_length(about) < 0
        || !PyArg_ParseTuple(about, "OO|OOOO", &column, &penalties, &growth[0], &growth[1], &growth[2], &growth[3])) return -1;
    if (!table->soft) table->soft = (cdbi_soft *)cdbi_memory(&making->opening, making->own->schema.n_conditions, sizeof *soft);
    if (!table->soft) return -1;
    soft = &table->soft[at];
    soft->penalties = (const double *)cdbp_row(making, penalties, sizeof(double), &n);
    if (!soft->penalties) return -1;
    if (table->n_depths == 0) table->n_depths = n / table->n_rows;
    if (growth[3] && cdbp_growth(making, growth, soft, n) != 0) return -1;
    if (table->n_depths > 0 && n == table->n_depths * table->n_rows)
        return cdbp_column(making, &making->own->conditions[at], column, (n + 63) / 64, &soft->column);
    PyErr_SetString(PyExc_ValueError, "soft cells have no penalty for each row of each depth");
    return -1;
}

/* One condition: a tuple (name, type, expr, values, numbers, read, column, soft); all from expr on but values may be None. */
static int cdbp_condition(cdbp_making *making, PyObject *about, size_t at)
{
    cdbp_table *own = making->own;
    cdb_condition *condition = &own->conditions[at];
    cdbp_reader *reader = &own->readers[at];
    PyObject *expr, *values, *column, *soft;
    cdbi_list listed;
    int type;
    if (cdbp_length(about) < 0
        || !PyArg_ParseTuple(about, "OiOOOOOO", &own->names[at], &type, &expr, &values, &reader->numbers, &reader->read, &column,
            &soft))
        return -1;
    if (type < CDB_BOOL || type > CDB_TAGS) {
        PyErr_SetString(PyExc_ValueError, "there is no such type of conditions");
        return -1;
    }
    condition->type = (cdb_type)type;
    condition->name = cdbp_c_text(own->names[at]);
    condition->expr = expr == Py_None ? NULL : cdbp_c_text(expr);
    if (!condition->name || (expr != Py_None && !condition->expr) || cdbp_texts(making, values, &listed) != 0) return -1;
    condition->values = listed.texts;
    condition->n_values = listed.n;
    if (reader->read == Py_None) reader->read = NULL;
    if (reader->numbers == Py_None) reader->numbers = NULL;
    if (reader->numbers && Py_TYPE(reader->numbers) != &PyDict_Type) reader->numbers = NULL;
    if (!reader->numbers && (type == CDB_BOOL || type == CDB_ENUM || (type == CDB_TAGS && listed.n > 0))) {
        PyErr_SetString(PyExc_ValueError, "the values of a condition have no numbers");
        return -1;
    }
    if (type == CDB_ENUM && cdbp_know_values(making, reader, values, listed.n) != 0) return -1;
    if (!condition->expr) {
        reader->at_words = own->n_words;
        reader->at_texts = own->n_texts;
        if (type == CDB_TEXT) own->n_held++;
        if (type == CDB_TAGS && listed.n == 0) {
            own->n_texts += CDBP_TEXTS;
            own->n_held += 2 * CDBP_TEXTS;
        }
        if (type == CDB_TAGS) own->n_words += cdbi_tag_words(condition);
    }
    if (column != Py_None && cdbp_column(making, condition, column, own->table.n_words, &own->columns[at]) != 0) return -1;
    return soft == Py_None || own->table.n_rows == 0 ? 0 : cdbp_soft(making, soft, at);
}

/* The rules and derived facts: a tuple (texts, facts, types, numbers, code, starts, derived, of_row). */
static int cdbp_programs(cdbp_making *making, PyObject *about)
{
    cdbi_programs *programs = &making->own->table.programs;
    PyObject *texts, *facts, *types, *numbers, *code, *starts, *derived, *of_row;
    const Py_ssize_t *shape;
    if (cdbp_length(about) < 0
        || !PyArg_ParseTuple(about, "OOOOOOOO", &texts, &facts, &types, &numbers, &code, &starts, &derived, &of_row))
        return -1;
    if (cdbp_texts(making, texts, &programs->texts) != 0 || cdbp_texts(making, facts, &programs->facts) != 0
        || cdbp_texts(making, types, &programs->types) != 0)
        return -1;
    programs->numbers = (const double *)cdbp_row(making, numbers, sizeof(double), &programs->n_numbers);
    programs->code = programs->numbers ? (const int32_t *)cdbp_array(making, code, sizeof(int32_t), 2, &shape) : NULL;
    if (!programs->code) return -1;
    programs->n_code = (size_t)shape[0];
    if (shape[1] != 4) {
        PyErr_SetString(PyExc_ValueError, "an array has another shape than it must have");
        return -1;
    }
    programs->starts = (const int64_t *)cdbp_row(making, starts, sizeof(int64_t), &programs->n_starts);
    programs->derived = programs->starts ? (const int64_t *)cdbp_row(making, derived, sizeof(int64_t), &programs->n_derived) : NULL;
    programs->of_row = programs->derived ? (const int32_t *)cdbp_row(making, of_row, sizeof(int32_t), &programs->n_of_row) : NULL;
    if (!programs->of_row) return -1;
    programs->parts = CDBI_PROGRAM_PARTS;
    making->opening.has_programs = 1;
    return 0;
}

/* A table that answers nothing by itself: of each condition it has the name alone. */
static void cdbp_names(cdbp_making *making, PyObject *names)
{
    cdbp_table *own = making->own;
    size_t i;
    for (i = 0; i < own->schema.n_conditions; i++) {
        own->names[i] = PyTuple_GetItem(names, (Py_ssize_t)i);
        own->conditions[i].name = "";
        own->conditions[i].type = CDB_NUMBER;
    }
    own->is_careful = 1;
}

static int cdbp_table_made(cdbp_making *making, PyObject *enabled, PyObject *conditions, PyObject *programs)
{
    cdbp_table *own = making->own;
    size_t n = own->schema.n_conditions, i;
    const Py_ssize_t *shape;
    cdb_fault fault;
    making->opening.table = &own->table;
    making->opening.schema = &own->schema;
    making->opening.fault = &fault;
    making->opening.strange = CDB_STRANGE_REFUSED;
    making->opening.status = cdbi_fault(&fault, CDB_OK, "", -1, "");
    own->columns = (cdb_column *)cdbi_memory(&making->opening, n + 1, sizeof(cdb_column));
    own->conditions = (cdb_condition *)cdbi_memory(&making->opening, n + 1, sizeof(cdb_condition));
    own->readers = (cdbp_reader *)cdbi_memory(&making->opening, n + 1, sizeof(cdbp_reader));
    own->names = (PyObject **)cdbi_memory(&making->opening, n + 1, sizeof(PyObject *));
    making->views_room = 16 * n + 16;
    own->views = (Py_buffer *)cdbi_memory(&making->opening, making->views_room, sizeof(Py_buffer));
    if (making->opening.status == CDB_OK) {
        making->opening.columns = own->columns;
        own->schema.conditions = own->conditions;
        if (enabled == Py_None) {
            cdbp_names(making, conditions);
            return 0;
        }
        own->table.enabled = cdbp_masks(making, enabled, own->table.n_words, 1, &shape);
        if (!own->table.enabled) return -1;
    }
    for (i = 0; i < n && making->opening.status == CDB_OK; i++)
        if (cdbp_condition(making, PyTuple_GetItem(conditions, (Py_ssize_t)i), i) != 0)
            if (making->opening.status == CDB_OK) return -1;
    if (making->opening.status == CDB_OK && programs != Py_None && cdbp_programs(making, programs) != 0) return -1;
    if (making->opening.status == CDB_OK) cdbi_check_columns(&making->opening);
    if (making->opening.status == CDB_OK) cdbi_link(&making->opening);
    if (making->opening.status == CDB_OK) return 0;
    if (making->opening.status == CDB_NO_MEMORY) PyErr_NoMemory();
    else PyErr_Format(PyExc_ValueError, "%s: %s", fault.name, fault.reason);
    return -1;
}

/* The place of each condition that is not derived: 0, or -1 with an error. */
static int cdbp_find_places(cdbp_table *own)
{
    size_t i;
    own->places = PyDict_New();
    for (i = 0; own->places && i < own->schema.n_conditions; i++) {
        PyObject *place = own->conditions[i].expr ? NULL : PyLong_FromSsize_t((Py_ssize_t)i);
        int status = place ? PyDict_SetItem(own->places, own->names[i], place) : own->conditions[i].expr ? 0 : -1;
        if (place) Py_DecRef(place);
        if (status != 0) return -1;
    }
    return own->places ? 0 : -1;
}

/* Put a column of few classes into a group: the last one where it has room, else a new one. */
static void cdbp_group_column(cdbp_table *own, size_t at, cdbp_group *groups)
{
    size_t n_classes = cdbp_n_joint(&own->conditions[at], &own->columns[at]);
    cdbp_step *step = &own->steps[at];
    if (own->n_groups == 0 || !cdbp_has_room(&groups[own->n_groups - 1], n_classes, own->table.n_words))
        groups[own->n_groups++].n_leaves = 1;
    step->group = (uint32_t)(own->n_groups - 1);
    step->stride = groups[step->group].n_leaves * own->table.n_words;
    groups[step->group].n_leaves *= n_classes;
    groups[step->group].n_columns++;
}

/* Add the masks of a column to those of its group; a group of one column has the masks of that. */
static void cdbp_fill_group(cdbp_making *making, size_t at, cdbp_group *groups)
{
    cdbp_table *own = making->own;
    const cdb_column *column = &own->columns[at];
    cdbp_group *group = &groups[own->steps[at].group];
    size_t n_words = own->table.n_words;
    own->groups[own->steps[at].group] = column->masks;
    if (group->n_columns < 2) return;
    if (!group->joint) {
        group->joint = (uint64_t *)cdbi_memory(&making->opening, group->n_leaves * n_words, sizeof(uint64_t));
        if (group->joint) memcpy(group->joint, own->table.enabled, n_words * sizeof(uint64_t));
    }
    if (!group->joint) return;
    cdbp_join(group->joint, own->steps[at].stride / n_words, column, n_words);
    own->groups[own->steps[at].group] = group->joint;
}

/* The steps of a table whose every column has a given fact: 0, or -1 with an error. Columns with the fewest classes are joined first. */
static int cdbp_make_steps(cdbp_making *making)
{
    cdbp_table *own = making->own;
    size_t n = own->schema.n_conditions, n_classes, i;
    cdbp_group *groups = (cdbp_group *)cdbi_memory(&making->opening, n + 1, sizeof(cdbp_group));
    own->steps = (cdbp_step *)cdbi_memory(&making->opening, n + 1, sizeof(cdbp_step));
    own->groups = (const uint64_t **)cdbi_memory(&making->opening, n + 1, sizeof(uint64_t *));
    for (i = 0; own->groups && i < n; i++)
        cdbp_set_step(&own->steps[i], own->names[i], &own->conditions[i], &own->columns[i], &own->readers[i]);
    for (n_classes = 1; own->groups && n_classes <= CDBP_LEAVES; n_classes++)
        for (i = 0; i < n; i++)
            if (cdbp_n_joint(&own->conditions[i], &own->columns[i]) == n_classes) cdbp_group_column(own, i, groups);
    for (n_classes = 1; own->groups && n_classes <= CDBP_LEAVES; n_classes++)
        for (i = 0; i < n; i++)
            if (cdbp_n_joint(&own->conditions[i], &own->columns[i]) == n_classes) cdbp_fill_group(making, i, groups);
    for (i = 0; own->groups && i < n; i++) {
        if (own->columns[i].kind != CDBI_VALUE && own->columns[i].kind != CDBI_FLAT) own->has_others = 1;
        else if (own->steps[i].stride == 0) {
            own->steps[i].stride = own->table.n_words;
            own->steps[i].group = (uint32_t)own->n_groups;
            own->groups[own->n_groups++] = own->columns[i].masks;
        }
    }
    if (own->n_groups > CDBI_MASKS) own->has_masks = 0;
    if (making->opening.status == CDB_OK) return 0;
    PyErr_NoMemory();
    return -1;
}

/* Table(answers, shared, unusual, n_rows, enabled, conditions, programs), see _core.pyi. */
static int cdbp_table_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_table *own = (cdbp_table *)self;
    cdbp_making making;
    PyObject *answers, *shared, *unusual, *enabled, *conditions, *programs;
    Py_ssize_t n_rows, n;
    size_t i;
    (void)named;
    if (!PyArg_ParseTuple(arguments, "OOOnOOO", &answers, &shared, &unusual, &n_rows, &enabled, &conditions, &programs)) return -1;
    n = cdbp_length(conditions);
    if (n < 0) return -1;
    if (own->held || n_rows < 0 || !cdbp_is_shared(shared) || !cdbp_is_answers(answers)) {
        PyErr_SetString(PyExc_TypeError, "a table is made once, of a class of answers, what they share, and its rows");
        return -1;
    }
    own->held = cdbp_new_ref(arguments);
    own->answers = (PyTypeObject *)answers;
    own->shared = shared;
    own->unusual = unusual;
    own->table.n_rows = (size_t)n_rows;
    own->table.n_words = ((size_t)n_rows + 63) / 64;
    own->schema.n_conditions = (size_t)n;
    memset(&making, 0, sizeof making);
    making.own = own;
    if (cdbp_table_made(&making, enabled, conditions, programs) != 0 || cdbp_find_places(own) != 0) return -1;
    own->frame_bytes = ((size_t)n + 1) * sizeof(cdb_fact) + (own->n_words + own->n_texts + own->n_held) * sizeof(uint64_t);
    own->has_masks = !own->table.has_programs && !own->is_careful && n_rows > 0;
    for (i = 0; i < (size_t)n; i++)
        if (own->columns[i].kind == 0 || own->conditions[i].expr) own->has_masks = 0;
    if (own->has_masks && cdbp_make_steps(&making) != 0) return -1;
    own->is_made = 1;
    return 0;
}

static int cdbp_table_traverse(PyObject *self, visitproc visit, void *arg)
{
    cdbp_table *own = (cdbp_table *)self;
    size_t i;
    CDBP_VISIT(Py_TYPE(self))
    CDBP_VISIT(own->held)
    CDBP_VISIT(own->places)
    for (i = 0; i < own->n_views; i++) CDBP_VISIT(own->views[i].obj)
    return 0;
}

/* Nothing points into what is given back here but the table itself, which answers nothing from then on. */
static int cdbp_table_clear(PyObject *self)
{
    cdbp_table *own = (cdbp_table *)self;
    size_t i, j;
    own->is_made = 0;
    while (own->n_views > 0) PyBuffer_Release(&own->views[--own->n_views]);
    for (i = 0; own->readers && i < own->schema.n_conditions; i++)
        for (j = 0; j < own->readers[i].n_known; j++) cdbp_clear(&own->readers[i].known[j].value);
    for (i = 0; own->steps && i < own->schema.n_conditions; i++) cdbp_clear(&own->steps[i].alias);
    cdbp_clear(&own->places);
    cdbp_clear(&own->held);
    return 0;
}

static void cdbp_table_free(PyObject *self)
{
    PyObject_GC_UnTrack(self);
    cdbp_table_clear(self);
    cdb_close(&((cdbp_table *)self)->table);
    cdbp_free(self);
}

/* Lay a frame out in memory of `frame_bytes`. */
static void cdbp_lay_out(const cdbp_table *own, void *memory, cdbp_frame *frame)
{
    frame->facts = (cdb_fact *)memory;
    frame->words = (uint64_t *)(void *)(frame->facts + own->schema.n_conditions + 1);
    frame->texts = (const char **)(void *)(frame->words + own->n_words);
    frame->held = (PyObject **)(void *)(frame->texts + own->n_texts);
    frame->n_held = 0;
}

/* The facts of a dict, in the order of the schema. `*n_there` counts the given names that the dict has. */
static int cdbp_read_facts(const cdbp_table *own, PyObject *context, cdbp_frame *frame, Py_ssize_t *n_there, int *is_missing)
{
    size_t i, n = own->schema.n_conditions;
    cdbp_walk walk;
    walk.dict = context;
    walk.at = 0;
    *n_there = 0;
    *is_missing = 0;
    for (i = 0; i < n; i++) {
        int how = CDBP_MISSING;
        PyObject *value = cdbp_look_up(&walk, own->names[i]);
        if (value) {
            *n_there += 1;
            if (own->conditions[i].expr) how = value == Py_None ? CDBP_MISSING : CDBP_CAREFUL;
            else how = cdbp_read_fact(frame, &own->schema, own->readers, i, value, own->unusual);
            cdbp_looked_up(value);
        } else if (PyErr_Occurred()) how = cdbp_raised(own->unusual);
        if (how > CDBP_MISSING) return how;
        if (how == CDBP_MISSING) {
            frame->facts[i] = cdbi_missing(&own->conditions[i]);
            if (!own->conditions[i].expr) *is_missing = 1;
        }
    }
    return CDBP_READ;
}

#if defined(__GNUC__) && defined(__x86_64__) && !defined(CDBP_NARROW)
#define CDBP_HAS_AVX2 __attribute__((target("avx2")))
CDBP_HAS_AVX2 static void cdbp_and_in_wide_registers(uint64_t *rows, const uint64_t *from,
    const uint64_t *const *masks, size_t n_masks, size_t n_words)
{
    cdbi_and(rows, from, masks, n_masks, n_words);
}
#define CDBP_HAS_WIDE_REGISTERS __builtin_cpu_supports("avx2")
#else
#define cdbp_and_in_wide_registers cdbi_and
#define CDBP_HAS_WIDE_REGISTERS 0
#endif

/* cdbi_and, in registers as wide as this machine has. */
static void cdbp_and(uint64_t *rows, const uint64_t *from, const uint64_t *const *masks, size_t n_masks, size_t n_words)
{
    if (CDBP_HAS_WIDE_REGISTERS) cdbp_and_in_wide_registers(rows, from, masks, n_masks, n_words);
    else cdbi_and(rows, from, masks, n_masks, n_words);
}

/* The mask of the facts of each group. Columns without one mask for each fact are left out. */
static int cdbp_find_masks(const cdbp_table *own, PyObject *context, cdbp_frame *frame, const uint64_t **masks)
{
    size_t i, n = own->schema.n_conditions;
    cdbp_walk walk;
    walk.dict = context;
    walk.at = 0;
    memcpy(masks, own->groups, own->n_groups * sizeof *masks);
    for (i = 0; i < n; i++) {
        cdbp_step *step = &own->steps[i];
        PyObject *value = cdbp_fact_of(step, &walk);
        int64_t found;
        if (!value) return cdbp_raised(own->unusual);
        found = cdbp_class_of(step, value);
        if (found < 0) {
            const cdb_condition *condition = &own->conditions[i];
            int how = cdbp_read_fact(frame, &own->schema, own->readers, i, value, own->unusual);
            if (how != CDBP_READ || cdbi_is_wrong(condition, &frame->facts[i])) {
                cdbp_looked_up(value);
                return how == CDBP_RAISED ? how : CDBP_CAREFUL;
            }
            if (step->stride > 0) found = (int64_t)cdbi_class_of(&own->columns[i], condition, &frame->facts[i]);
        }
        cdbp_looked_up(value);
        if (step->stride > 0) masks[step->group] += (size_t)found * step->stride;
    }
    return CDBP_READ;
}

/* The answer to a dict that has all facts: as cdbp_ask gives it, without asking each fact again whether it is missing or wrong. */
static PyObject *cdbp_ask_straight(const cdbp_table *own, PyObject *context, void *memory)
{
    const uint64_t *masks[CDBI_MASKS];
    cdbp_answer *answer = NULL;
    cdbp_frame frame;
    cdbp_lay_out(own, memory, &frame);
    if (cdbp_find_masks(own, context, &frame, masks) == CDBP_READ) {
        answer = cdbp_new_answer(own->answers, own->shared, own->table.n_words);
        if (answer) cdbp_and(answer->words, own->table.enabled, masks, own->n_groups, own->table.n_words);
        if (answer && own->has_others)
            cdbi_and_others(answer->words, &own->table, own->columns, &own->schema, frame.facts, CDB_UNKNOWN_ERROR, 0);
    }
    cdbp_let_go(&frame);
    return (PyObject *)answer;
}

/* Those of a mapping's facts that the table asks for, as a dict: a new reference, or NULL with an error. */
static PyObject *cdbp_as_dict(const cdbp_table *own, PyObject *context)
{
    PyObject *facts = PyDict_New(), *value;
    size_t i;
    for (i = 0; facts && i < own->schema.n_conditions; i++) {
        if (own->conditions[i].expr) continue;
        value = PyObject_GetItem(context, own->names[i]);
        if (!value || PyDict_SetItem(facts, own->names[i], value) != 0) cdbp_clear(&facts);
        if (value) Py_DecRef(value);
    }
    return facts;
}

/* The same, but for facts that are missing, where that is an error or may be a slip: those are left to the careful way. */
static int cdbp_read_all(const cdbp_table *own, PyObject *context, cdb_unknown unknown, cdbp_frame *frame)
{
    Py_ssize_t n_there;
    int is_missing, how = cdbp_read_facts(own, context, frame, &n_there, &is_missing);
    if (how != CDBP_READ || !is_missing) return how;
    return unknown == CDB_UNKNOWN_ERROR || n_there != PyDict_Size(context) ? CDBP_CAREFUL : CDBP_READ;
}

/* The answer to the facts of a dict: a new reference; NULL with an error, or without one where the careful way must decide. */
static PyObject *cdbp_ask(const cdbp_table *own, PyObject *context, cdb_unknown unknown, void *memory)
{
    cdbp_answer *answer = NULL;
    cdbp_frame frame;
    cdb_fault fault;
    cdbp_lay_out(own, memory, &frame);
    if (cdbp_read_all(own, context, unknown, &frame) == CDBP_READ) answer = cdbp_new_answer(own->answers, own->shared, own->table.n_words);
    if (answer
        && cdbi_query(&own->table, own->columns, &own->schema, frame.facts, frame.facts, unknown, answer->words, own->table.n_words, &fault)) {
        Py_DecRef((PyObject *)answer);
        answer = NULL;
    }
    cdbp_let_go(&frame);
    return (PyObject *)answer;
}

#define CDBP_STACK 4096

/* table.query(context, unknown=0): the answer, or None where the careful way must decide. */
static PyObject *cdbp_table_query(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    const cdbp_table *own = (const cdbp_table *)self;
    uint64_t stack[CDBP_STACK / 8];
    void *memory = stack;
    PyObject *context, *answer, *facts = NULL;
    long unknown = n_arguments == 2 ? PyLong_AsLong(arguments[1]) : 0;
    if (n_arguments < 1 || n_arguments > 2 || unknown < CDB_UNKNOWN_ERROR || unknown > CDB_UNKNOWN_NEVER || !own->is_made) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_TypeError, "query takes a context, and what a missing fact does: 0, 1 or 2");
        return NULL;
    }
    if (own->is_careful) return cdbp_new_ref(Py_None);
    context = arguments[0];
    if (Py_TYPE(context) != &PyDict_Type) {
        context = facts = cdbp_as_dict(own, context);
        if (!facts) return cdbp_raised(own->unusual) == CDBP_CAREFUL ? cdbp_new_ref(Py_None) : NULL;
    }
    if (own->frame_bytes > CDBP_STACK) memory = PyMem_Malloc(own->frame_bytes);
    if (!memory) return PyErr_NoMemory();
    answer = own->has_masks && unknown == CDB_UNKNOWN_ERROR ? cdbp_ask_straight(own, context, memory)
        : cdbp_ask(own, context, (cdb_unknown)unknown, memory);
    if (memory != stack) PyMem_Free(memory);
    if (facts) Py_DecRef(facts);
    if (!answer && !PyErr_Occurred()) return cdbp_new_ref(Py_None);
    return answer;
}

/* Add to the costs of each row of each depth those of the soft cells of one condition that do not accept its fact. */
static void cdbp_add_costs(const cdbp_table *own, size_t at, const cdb_fact *fact, cdb_unknown unknown, double *costs)
{
    const cdbi_soft *soft = &own->table.soft[at];
    const cdb_condition *condition = &own->conditions[at];
    size_t n = own->table.n_depths * own->table.n_rows, n_words = (n + 63) / 64, word, row;
    int is_missing = cdbi_is_missing(condition, fact);
    const uint64_t *mask = cdbi_mask(&soft->column, condition, fact, is_missing, n_words);
    if (soft->column.kind == 0 || (is_missing && unknown == CDB_UNKNOWN_ANY)) return;
    for (word = 0; word < n_words; word++) {
        uint64_t failing = ~(mask ? mask[word] : cdbi_accepted(&soft->column, condition, fact, unknown, word, n_words));
        for (; failing; failing &= failing - 1) {
            row = word * 64 + cdbi_first_bit(failing);
            if (row < n) costs[row] = cdbi_sum(costs[row], cdbi_grown(soft, condition, fact, 0, row));
        }
    }
}

/* The rows whose cells of one condition accept its fact; a fact that is missing and passed over is accepted by all. */
static void cdbp_put_accepted(const cdbp_table *own, size_t at, const cdb_fact *fact, cdb_unknown unknown, uint64_t *words)
{
    const cdb_condition *condition = &own->conditions[at];
    size_t n_words = own->table.n_words, word;
    int is_missing = cdbi_is_missing(condition, fact);
    const uint64_t *mask = cdbi_mask(&own->columns[at], condition, fact, is_missing, n_words);
    if (mask && !(is_missing && unknown == CDB_UNKNOWN_ANY)) memcpy(words, mask, n_words * sizeof *words);
    else {
        for (word = 0; word < n_words; word++) words[word] = cdbi_accepted(&own->columns[at], condition, fact, unknown, word, n_words);
        if (own->table.n_rows % 64) words[n_words - 1] &= ~(uint64_t)0 >> (64 - own->table.n_rows % 64);
    }
}

/* Read the facts of a context and call `put` for each condition: 1; 0 where the careful way must decide; -1 with an error. */
static int cdbp_put_each(const cdbp_table *own, PyObject *context, cdb_unknown unknown, void *items, size_t n,
    void (*put)(const cdbp_table *, size_t, const cdb_fact *, cdb_unknown, void *))
{
    void *memory = PyMem_Malloc(own->frame_bytes);
    const cdb_fact *facts;
    cdbp_frame frame;
    cdb_fault fault;
    size_t i;
    int how;
    if (!memory) PyErr_NoMemory();
    if (!memory) return -1;
    cdbp_lay_out(own, memory, &frame);
    how = cdbp_read_all(own, context, unknown, &frame);
    facts = frame.facts;
    if (how == CDBP_READ && cdbi_ready(&own->table, own->columns, &own->schema, &facts, frame.facts, unknown, &fault) != CDB_OK)
        how = CDBP_CAREFUL;
    for (i = 0; how == CDBP_READ && i < n; i++) put(own, i, &frame.facts[i], unknown, items);
    cdbp_let_go(&frame);
    PyMem_Free(memory);
    return PyErr_Occurred() ? -1 : how == CDBP_READ;
}

static void cdbp_put_costs(const cdbp_table *own, size_t at, const cdb_fact *fact, cdb_unknown unknown, void *costs)
{
    cdbp_add_costs(own, at, fact, unknown, (double *)costs);
}

static void cdbp_put_words(const cdbp_table *own, size_t at, const cdb_fact *fact, cdb_unknown unknown, void *words)
{
    cdbp_put_accepted(own, at, fact, unknown, (uint64_t *)words + at * own->table.n_words);
}

/* table.penalties(context, unknown, costs) and table.accepting(context, unknown, words): fill an array; False where the careful way
 * must decide. */
static PyObject *cdbp_table_fill(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments, int is_costs)
{
    const cdbp_table *own = (const cdbp_table *)self;
    cdbp_arrays arrays = {.n = 0};
    size_t shape[2], n = own->schema.n_conditions;
    void *items;
    int how = 0;
    long unknown = n_arguments == 3 ? PyLong_AsLong(arguments[1]) : -1;
    if (unknown < CDB_UNKNOWN_ERROR || unknown > CDB_UNKNOWN_NEVER || !own->is_made) {
        if (!PyErr_Occurred()) PyErr_SetString(PyExc_TypeError, "it takes a context, 0, 1 or 2, and an array");
        return NULL;
    }
    if (own->is_careful || (is_costs && !own->table.soft) || Py_TYPE(arguments[0]) != &PyDict_Type) return cdbp_new_ref(Py_False);
    items = cdbp_items(&arrays, arguments[2], is_costs ? 'f' : 'u', sizeof(uint64_t), 2, 1, shape);
    if (!items) return NULL;
    if (is_costs ? shape[0] != own->table.n_depths || shape[1] != own->table.n_rows : shape[0] > n || shape[1] != own->table.n_words)
        PyErr_SetString(PyExc_ValueError, "an array has another shape than it must have");
    else
        how = cdbp_put_each(own, arguments[0], (cdb_unknown)unknown, items, is_costs ? n : shape[0],
            is_costs ? cdbp_put_costs : cdbp_put_words);
    cdbp_release(&arrays);
    return PyErr_Occurred() ? NULL : cdbp_new_ref(how ? Py_True : Py_False);
}

static PyObject *cdbp_table_penalties(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    return cdbp_table_fill(self, arguments, n_arguments, 1);
}

static PyObject *cdbp_table_accepting(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    return cdbp_table_fill(self, arguments, n_arguments, 0);
}

/* The function that `query_or` makes; `self` is (table, otherwise). */
static PyObject *cdbp_query_or(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments, PyObject *names)
{
    PyObject *table = PyTuple_GetItem(self, 0), *answer, *given, *named;
    const cdbp_table *own = (const cdbp_table *)table;
    Py_ssize_t n_names = names ? PyTuple_Size(names) : 0, i;
    if (n_arguments == 1 && n_names == 0 && own->is_made && !own->is_watched && Py_TYPE(arguments[0]) == &PyDict_Type) {
        answer = cdbp_table_query(table, arguments, 1);
        if (answer != Py_None) return answer;
        Py_DecRef(answer);
    }
    given = PyTuple_New(n_arguments);
    named = PyDict_New();
    for (i = 0; given && i < n_arguments; i++) PyTuple_SetItem(given, i, cdbp_new_ref(arguments[i]));
    for (i = 0; named && i < n_names; i++)
        if (PyDict_SetItem(named, PyTuple_GetItem(names, i), arguments[n_arguments + i]) != 0) cdbp_clear(&named);
    answer = given && named ? PyObject_Call(PyTuple_GetItem(self, 1), given, named) : NULL;
    if (given) Py_DecRef(given);
    if (named) Py_DecRef(named);
    return answer;
}

static PyMethodDef cdbp_query_or_method = {"query", (PyCFunction)(void (*)(void))cdbp_query_or, METH_FASTCALL | METH_KEYWORDS,
    "query(context, *, unknown='error', actors=None, prefer=None)\n--\n\nThe valid rows for a context: see CompiledTable.query."};

/* table.query_or(otherwise): a function that answers a context as `query`; whatever it cannot answer goes to `otherwise`. */
static PyObject *cdbp_table_query_or(PyObject *self, PyObject *otherwise)
{
    PyObject *both = PyTuple_New(2), *function;
    if (!both) return NULL;
    PyTuple_SetItem(both, 0, cdbp_new_ref(self));
    PyTuple_SetItem(both, 1, cdbp_new_ref(otherwise));
    function = PyCMethod_New(&cdbp_query_or_method, both, NULL, NULL);
    Py_DecRef(both);
    return function;
}

static PyObject *cdbp_table_is_watched(PyObject *self, void *unused)
{
    (void)unused;
    return cdbp_new_ref(((const cdbp_table *)self)->is_watched ? Py_True : Py_False);
}

static int cdbp_table_set_watched(PyObject *self, PyObject *is_watched, void *unused)
{
    (void)unused;
    ((cdbp_table *)self)->is_watched = is_watched == Py_True;
    return 0;
}

static PyGetSetDef cdbp_table_members[] = {
    {"is_watched", cdbp_table_is_watched, cdbp_table_set_watched,
        "Whether somebody learns of questions: functions of `query_or` then pass all on.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};
static PyMethodDef cdbp_table_methods[] = {
    {"query_or", cdbp_table_query_or, METH_O,
        "A function that answers a context as `query` does; what it cannot answer it passes on to another one."},
    {"accepting", CDBP_CALL(cdbp_table_accepting), METH_FASTCALL,
        "Put the rows whose cell of each condition accepts its fact into masks; False where the careful way must decide."},
    {"penalties", CDBP_CALL(cdbp_table_penalties), METH_FASTCALL,
        "Add what soft cells cost to an array of 0; False where the careful way must decide."},
    {"query", (PyCFunction)(void (*)(void))cdbp_table_query, METH_FASTCALL,
        "The answer to a context, or None where the careful way must decide."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot cdbp_table_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_table_init)},
    {Py_tp_traverse, CDBP_SLOT(cdbp_table_traverse)},
    {Py_tp_clear, CDBP_SLOT(cdbp_table_clear)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_table_free)},
    {Py_tp_methods, cdbp_table_methods},
    {Py_tp_getset, cdbp_table_members},
    {0, NULL},
};
static PyType_Spec cdbp_table_spec = {"contextdb.core._core.Table", (int)sizeof(cdbp_table), 0,
    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC, cdbp_table_slots};
