/* ---- Poses for Python: banks of frames, the poses of a rig, and the parts that are used by themselves. Arrays are numpy's,
 * without a copy; a bank, and the poses of a rig, hold theirs for as long as they live. */

#define CDBP_ANY SIZE_MAX
#define CDBP_MANY 8 /* so many characters let other threads run meanwhile */

/* The items of an array whose dimensions are known, but for those that are CDBP_ANY; NULL with an error for another one. */
static void *cdbp_shaped(cdbp_arrays *arrays, PyObject *array, char kind, size_t size, int is_written, size_t *shape,
    int n_dimensions, size_t first, size_t second, size_t third)
{
    const size_t needed[3] = {first, second, third};
    void *items = cdbp_items(arrays, array, kind, size, n_dimensions, is_written, shape);
    int i;
    for (i = 0; items && i < n_dimensions; i++)
        if (needed[i] != CDBP_ANY && needed[i] != shape[i]) {
            PyErr_Format(PyExc_ValueError, "array %zu has the length %zu where %zu is needed", arrays->n, shape[i], needed[i]);
            return NULL;
        }
    return items;
}

static const double *cdbp_numbers(cdbp_arrays *arrays, PyObject *array, size_t *shape, int n_dimensions, size_t a, size_t b,
    size_t c)
{
    return (const double *)cdbp_shaped(arrays, array, 'f', sizeof(double), 0, shape, n_dimensions, a, b, c);
}

static double *cdbp_to_numbers(cdbp_arrays *arrays, PyObject *array, size_t *shape, int n_dimensions, size_t a, size_t b, size_t c)
{
    return (double *)cdbp_shaped(arrays, array, 'f', sizeof(double), 1, shape, n_dimensions, a, b, c);
}

static const int64_t *cdbp_int64s(cdbp_arrays *arrays, PyObject *array, size_t *shape, int n_dimensions, size_t a, size_t b)
{
    return (const int64_t *)cdbp_shaped(arrays, array, 'i', sizeof(int64_t), 0, shape, n_dimensions, a, b, 0);
}

/* A new reference to None after the arrays of a call were given back, or NULL with the error that is set, or this one. */
static PyObject *cdbp_given_back(cdbp_arrays *arrays, int is_done, const char *otherwise)
{
    cdbp_release(arrays);
    if (is_done) return cdbp_new_ref(Py_None);
    if (!PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, otherwise);
    return NULL;
}

/* ---- a bank */

typedef struct cdbp_pose_frames {
    PyObject ob_base;
    cdbp_arrays arrays;
    cdbo_frames frames;
    int is_made;
} cdbp_pose_frames;

/* PoseFrames(rotations, positions, root, ways, contacts, steps or None, starts, n_steps, looping, rate) */
static int cdbp_pose_frames_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_pose_frames *own = (cdbp_pose_frames *)self;
    cdbo_frames *to = &own->frames;
    cdbp_arrays *a = &own->arrays;
    PyObject *in[9];
    size_t s[3];
    (void)named;
    if (own->is_made || a->n > 0) {
        PyErr_SetString(PyExc_TypeError, "it is made once");
        return -1;
    }
    if (!PyArg_ParseTuple(arguments, "OOOOOOOOOd", &in[0], &in[1], &in[2], &in[3], &in[4], &in[5], &in[6], &in[7], &in[8],
        &to->rate))
        return -1;
    if (!(to->rotations = (const float *)cdbp_shaped(a, in[0], 'f', 4, 0, s, 3, CDBP_ANY, CDBP_ANY, 4))) return -1;
    to->n_frames = s[0], to->n_joints = s[1];
    if (!(to->positions = (const float *)cdbp_shaped(a, in[1], 'f', 4, 0, s, 3, to->n_frames, CDBP_ANY, 3))) return -1;
    to->n_moving = s[1];
    if (!(to->root = (const float *)cdbp_shaped(a, in[2], 'f', 4, 0, s, 2, to->n_frames, 3, 0))) return -1;
    if (!(to->ways = cdbp_numbers(a, in[3], s, 2, to->n_frames, 6, 0))) return -1;
    if (!(to->contacts = (const unsigned char *)cdbp_shaped(a, in[4], 'b', 1, 0, s, 2, to->n_frames, CDBP_ANY, 0))) return -1;
    to->n_feet = s[1];
    if (in[5] != Py_None && !(to->steps = cdbp_numbers(a, in[5], s, 3, to->n_frames, to->n_feet, 3))) return -1;
    if (!(to->starts = cdbp_int64s(a, in[6], s, 1, CDBP_ANY, 0))) return -1;
    to->n_ranges = s[0];
    if (!(to->n_steps = cdbp_int64s(a, in[7], s, 1, to->n_ranges, 0))) return -1;
    if (!(to->looping = (const unsigned char *)cdbp_shaped(a, in[8], 'b', 1, 0, s, 1, to->n_ranges, 0, 0))) return -1;
    own->is_made = cdbo_are_frames(to);
    if (!own->is_made) PyErr_SetString(PyExc_ValueError, "a range does not lie within the frames, or the rate is not above 0");
    return own->is_made ? 0 : -1;
}

static void cdbp_pose_frames_free(PyObject *self)
{
    cdbp_release(&((cdbp_pose_frames *)self)->arrays);
    cdbp_free(self);
}

/* The frames of a bank; NULL with an error for another object. */
static const cdbo_frames *cdbp_pose_frames_of(PyObject *object)
{
    const cdbp_pose_frames *own = (const cdbp_pose_frames *)object;
    if (cdbp_is_freed_by(Py_TYPE(object), cdbp_pose_frames_free) && own->is_made) return &own->frames;
    PyErr_SetString(PyExc_TypeError, "it is no PoseFrames");
    return NULL;
}

/* frames.sample(range, second, rotations, positions, spins, speeds, numbers): the moment, and in numbers [6] the two frames
 * about it, the share of the second, and the velocity of the root. */
static PyObject *cdbp_pose_sample(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbo_frames *of = cdbp_pose_frames_of(self);
    cdbp_arrays a;
    long long range = of && n == 7 ? PyLong_AsLongLong(in[0]) : -1;
    double at_s = of && n == 7 ? PyFloat_AsDouble(in[1]) : 0.0, *rotations, *positions, *spins, *speeds, *numbers;
    int is_done = 0;
    size_t s[3];
    a.n = 0;
    if (!PyErr_Occurred() && range >= 0 && (uint64_t)range < of->n_ranges
        && (rotations = cdbp_to_numbers(&a, in[2], s, 2, of->n_joints, 4, 0))
        && (positions = cdbp_to_numbers(&a, in[3], s, 2, of->n_moving, 3, 0))
        && (spins = cdbp_to_numbers(&a, in[4], s, 2, of->n_joints, 3, 0))
        && (speeds = cdbp_to_numbers(&a, in[5], s, 2, of->n_moving, 3, 0))
        && (numbers = cdbp_to_numbers(&a, in[6], s, 1, 6, 0, 0))) {
        cdbo_between at = cdbo_frames_at(of, (size_t)range, at_s);
        cdbo_sample(of, at, rotations, positions);
        cdbo_slopes(of, at, spins, speeds);
        numbers[0] = (double)at.low, numbers[1] = (double)at.high, numbers[2] = at.share;
        cdbo_set3(numbers + 3, 0, cdbo_root_velocity(of, at));
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "sample takes a range, a second, and five arrays");
}

/* frames.accelerations(range, parents, offsets, places, step, to): of the joint that accelerates most, over steps of so many
 * frames. */
static PyObject *cdbp_pose_accelerations(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbo_frames *of = cdbp_pose_frames_of(self);
    cdbp_arrays a;
    cdbo_rig rig;
    long long range = of && n == 6 ? PyLong_AsLongLong(in[0]) : -1, step = of && n == 6 ? PyLong_AsLongLong(in[4]) : -1;
    double *to, *room = NULL;
    size_t s[3], n_frames;
    int is_done = 0;
    a.n = 0;
    memset(&rig, 0, sizeof rig);
    if (!PyErr_Occurred() && range >= 0 && step > 0 && (uint64_t)range < of->n_ranges) {
        rig.n_joints = of->n_joints, rig.n_moving = of->n_moving;
        n_frames = (size_t)of->n_steps[range] + 1;
        if ((uint64_t)step * 2 < n_frames && (rig.parents = cdbp_int64s(&a, in[1], s, 1, rig.n_joints, 0))
            && (rig.offsets = cdbp_numbers(&a, in[2], s, 2, rig.n_joints, 3, 0))
            && (rig.places = cdbp_int64s(&a, in[3], s, 1, rig.n_joints, 0))
            && (to = cdbp_to_numbers(&a, in[5], s, 1, n_frames - 2 * (size_t)step, 0, 0)) && cdbo_is_rig(&rig)
            && (room = (double *)PyMem_Malloc(cdbo_acceleration_room(of, (size_t)range) * sizeof(double)))) {
            cdbo_accelerations(of, (size_t)range, &rig, (size_t)step, room, to);
            is_done = 1;
        }
        PyMem_Free(room);
    }
    return cdbp_given_back(&a, is_done, "accelerations takes a range, a rig's parents, offsets and places, a step, and an array");
}

static PyMethodDef cdbp_pose_frames_methods[] = {
    {"sample", CDBP_CALL(cdbp_pose_sample), METH_FASTCALL, "Write a moment of a range, between its frames too."},
    {"accelerations", CDBP_CALL(cdbp_pose_accelerations), METH_FASTCALL,
        "Write how much the joint that accelerates most does so in each frame."},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot cdbp_pose_frames_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_pose_frames_init)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_pose_frames_free)},
    {Py_tp_methods, cdbp_pose_frames_methods},
    {0, NULL},
};
static PyType_Spec cdbp_pose_frames_spec = {"contextdb.core._core.PoseFrames", (int)sizeof(cdbp_pose_frames), 0,
    Py_TPFLAGS_DEFAULT, cdbp_pose_frames_slots};

/* ---- the poses of a rig */

typedef struct cdbp_poses {
    PyObject ob_base;
    cdbp_arrays arrays;
    PyObject *banks; /* a tuple of PoseFrames */
    const cdbo_frames **frames;
    cdbo_poses poses;
    int is_made;
} cdbp_poses;

/* Read the numbers of all settings of all stages. */
static int cdbp_read_settings(PyObject *settings, double *to)
{
    size_t i, k;
    for (i = 0; i < CDBO_COUNT(CDBO_STAGES); i++)
        for (k = 0; k < CDBO_STAGES[i]->n_settings; k++) {
            const cdbo_setting_record *record = &CDBO_STAGES[i]->settings[k];
            PyObject *value = PyDict_GetItemString(settings, record->name);
            if (!value) {
                PyErr_Format(PyExc_ValueError, "the setting %s of the stage %s is missing", record->name, CDBO_STAGES[i]->name);
                return -1;
            }
            to[record->setting] = PyFloat_AsDouble(value);
            if (PyErr_Occurred()) return -1;
        }
    return 0;
}

static int cdbp_read_banks(cdbp_poses *own, PyObject *banks)
{
    Py_ssize_t n = PyTuple_Size(banks), i;
    if (n < 0 || !(own->frames = (const cdbo_frames **)PyMem_Calloc((size_t)n + 1, sizeof(cdbo_frames *)))) return -1;
    own->banks = cdbp_new_ref(banks);
    for (i = 0; i < n; i++)
        if (!(own->frames[i] = cdbp_pose_frames_of(PyTuple_GetItem(banks, i)))) return -1;
    own->poses.banks = own->frames;
    own->poses.n_banks = (size_t)n;
    return 0;
}

/* Poses(parents, offsets, places, legs, hinges, tops, spine, left, most_accel, n_moving, settings, banks) */
static int cdbp_poses_init(PyObject *self, PyObject *arguments, PyObject *named)
{
    cdbp_poses *own = (cdbp_poses *)self;
    cdbo_rig *rig = &own->poses.rig;
    cdbp_arrays *a = &own->arrays;
    PyObject *in[8], *settings, *banks;
    long long n_moving;
    size_t s[3];
    (void)named;
    if (own->is_made || own->banks || a->n > 0) {
        PyErr_SetString(PyExc_TypeError, "it is made once");
        return -1;
    }
    if (!PyArg_ParseTuple(arguments, "OOOOOOOOdLO!O!", &in[0], &in[1], &in[2], &in[3], &in[4], &in[5], &in[6], &in[7],
        &rig->most_accel, &n_moving, &PyDict_Type, &settings, &PyTuple_Type, &banks))
        return -1;
    rig->n_moving = (size_t)n_moving;
    if (!(rig->parents = cdbp_int64s(a, in[0], s, 1, CDBP_ANY, 0))) return -1;
    rig->n_joints = s[0];
    if (!(rig->offsets = cdbp_numbers(a, in[1], s, 2, rig->n_joints, 3, 0))) return -1;
    if (!(rig->places = cdbp_int64s(a, in[2], s, 1, rig->n_joints, 0))) return -1;
    if (!(rig->legs = cdbp_int64s(a, in[3], s, 2, CDBP_ANY, 4))) return -1;
    rig->n_feet = s[0];
    if (!(rig->hinges = cdbp_numbers(a, in[4], s, 2, rig->n_feet, 3, 0))) return -1;
    if (!(rig->tops = cdbp_int64s(a, in[5], s, 1, CDBP_ANY, 0))) return -1;
    rig->n_tops = s[0];
    if (!(rig->spine = cdbp_int64s(a, in[6], s, 1, CDBP_ANY, 0))) return -1;
    rig->n_spine = s[0];
    if (!(rig->left = cdbp_numbers(a, in[7], s, 1, rig->n_spine, 0, 0))) return -1;
    if (cdbp_read_settings(settings, own->poses.settings) != 0 || cdbp_read_banks(own, banks) != 0) return -1;
    own->is_made = cdbo_poses_open(&own->poses);
    if (!own->is_made) PyErr_SetString(PyExc_ValueError, "the rig and its banks do not go together");
    return own->is_made ? 0 : -1;
}

static void cdbp_poses_free(PyObject *self)
{
    cdbp_poses *own = (cdbp_poses *)self;
    cdbp_release(&own->arrays);
    PyMem_Free((void *)own->frames);
    cdbp_clear(&own->banks);
    cdbp_free(self);
}

static const cdbo_poses *cdbp_made_poses(PyObject *self)
{
    if (((cdbp_poses *)self)->is_made) return &((cdbp_poses *)self)->poses;
    PyErr_SetString(PyExc_ValueError, "the poses were not made");
    return NULL;
}

static PyObject *cdbp_poses_begun(PyObject *self, PyObject *row)
{
    const cdbo_poses *poses = cdbp_made_poses(self);
    cdbp_arrays a;
    double *to;
    size_t s[3];
    a.n = 0;
    to = poses ? cdbp_to_numbers(&a, row, s, 1, poses->width, 0, 0) : NULL;
    if (to) cdbo_poses_begin(poses, to);
    return cdbp_given_back(&a, to != NULL, "begin takes a row");
}

/* What an update reads and writes, of N characters. */
typedef struct cdbp_pose_update {
    size_t n, n_points;
    double dt_s;
    const double *before, *places;
    const cdbo_play *plays;
    cdbo_given *given;
    cdbo_seam *seams;
    cdbo_instant *displayed;
    double *after, *roots, *rotations, *translations, *positions, *points, *below;
    unsigned char *contacts, *moves_body;
} cdbp_pose_update;

/* Whether a moment is one of the banks, or nothing. */
static int cdbp_is_moment(const cdbo_poses *poses, const cdbo_instant *moment)
{
    return moment->bank < 0.0 || cdbo_is_moment(poses, moment->bank, moment->range);
}

/* Take the arrays of an update, in the order of `cdbp_poses_update`. */
static int cdbp_take_update(const cdbo_poses *poses, cdbp_arrays *a, PyObject *const *in, cdbp_pose_update *to)
{
    size_t s[3], n, i, n_joints = poses->rig.n_joints, n_given = sizeof(cdbo_given) / sizeof(double), n_seam = sizeof(cdbo_seam) / sizeof(double);
    double *made;
    memset(to, 0, sizeof *to);
    to->dt_s = PyFloat_AsDouble(in[3]);
    if (PyErr_Occurred() || !(to->before = cdbp_numbers(a, in[0], s, 2, CDBP_ANY, poses->width, 0))) return -1;
    n = to->n = s[0], to->n_points = poses->rig.n_feet > 0 ? poses->rig.n_feet : 1;
    if (!(to->plays = (const cdbo_play *)cdbp_numbers(a, in[1], s, 2, n, sizeof(cdbo_play) / sizeof(double), 0))) return -1;
    if (in[2] != Py_None && !(to->places = cdbp_numbers(a, in[2], s, 2, n, 3, 0))) return -1;
    if (!(to->after = cdbp_to_numbers(a, in[5], s, 2, n, poses->width, 0))) return -1;
    if (!(to->displayed = (cdbo_instant *)cdbp_to_numbers(a, in[6], s, 2, n, 3, 0))) return -1;
    if (!(to->roots = cdbp_to_numbers(a, in[7], s, 2, n, 3, 0))) return -1;
    if (!(made = cdbp_to_numbers(a, in[8], s, 1, n * (n_given + 2 * n_seam + 10 * n_joints), 0, 0))) return -1;
    if (!(to->contacts = (unsigned char *)cdbp_shaped(a, in[9], 'b', 1, 1, s, 2, n, poses->rig.n_feet, 0))) return -1;
    if (!(to->moves_body = (unsigned char *)cdbp_shaped(a, in[10], 'b', 1, 1, s, 1, n, 0, 0))) return -1;
    to->given = (cdbo_given *)(void *)made, to->seams = (cdbo_seam *)(void *)(made + n_given * n);
    to->rotations = made + (n_given + 2 * n_seam) * n, to->translations = to->rotations + 4 * n_joints * n;
    to->positions = to->translations + 3 * n_joints * n;
    for (i = 0; i < n; i++)
        if (!cdbp_is_moment(poses, &to->plays[i].playing) || !cdbp_is_moment(poses, &to->plays[i].before)
            || !cdbp_is_moment(poses, &to->plays[i].displayed)) {
            PyErr_SetString(PyExc_ValueError, "an update was given a moment that is in no bank");
            return -1;
        }
    return 0;
}

/* From what was decided to what happens to the poses; whether all play something. */
static int cdbp_receive_all(const cdbo_poses *poses, const cdbp_pose_update *to)
{
    size_t i, n_seams = 0;
    int is_whole = 1;
    for (i = 0; i < to->n; i++) {
        const cdbo_play *play = &to->plays[i];
        int is_playing = play->playing.bank >= 0.0;
        double root = play->root == play->root ? play->root : poses->settings[CDBO_ROOT];
        cdbo_receive(poses, to->before + i * poses->width, play, to->dt_s, &to->given[i], to->seams, &n_seams);
        to->displayed[i] = is_playing ? play->playing : play->displayed;
        to->moves_body[i] = root == CDBO_BY_ANIMATION;
        is_whole = is_whole && is_playing;
    }
    return is_whole;
}

/* Put all through some stages, beside other threads where they are many. */
static void cdbp_run_update(const cdbo_poses *poses, const cdbp_pose_update *to, cdbo_part part, double *room)
{
    size_t i, n_joints = poses->rig.n_joints, n_feet = poses->rig.n_feet;
    PyThreadState *state = to->n >= CDBP_MANY ? PyEval_SaveThread() : NULL;
    for (i = 0; i < to->n; i++) {
        const double *place = to->places ? to->places + 3 * i : NULL;
        cdbo_posed one;
        memset(&one, 0, sizeof one);
        one.poses = poses;
        one.given = &to->given[i];
        one.place = place && place[0] == place[0] ? place : NULL;
        one.before = to->before + poses->width * i;
        one.row = to->after + poses->width * i;
        one.root = to->roots + 3 * i;
        one.rotations = to->rotations + 4 * n_joints * i;
        one.translations = to->translations + 3 * n_joints * i;
        one.positions = to->positions + 3 * n_joints * i;
        one.contacts = to->contacts + n_feet * i;
        one.below = part == CDBO_FROM_GROUND ? to->below + 3 * to->n_points * i : NULL;
        cdbo_pose_one(&one, to->seams, to->dt_s, room, part);
        if (part == CDBO_UP_TO_GROUND) cdbo_ask_points(&one, to->points + 2 * to->n_points * i);
    }
    if (state) PyEval_RestoreThread(state);
}

/* Take the ground below one point, (height, rise along x, rise along z), and give it back. 0 with an error. */
static int cdbp_take_below(PyObject *answer, double *below)
{
    int is_right = answer && PyType_IsSubtype(Py_TYPE(answer), &PyTuple_Type) && PyArg_ParseTuple(answer, "ddd", below, below + 1, below + 2);
    if (answer) Py_DecRef(answer);
    if (!is_right && !PyErr_Occurred()) PyErr_SetString(PyExc_ValueError, "there is not one height and rise for each point");
    return is_right;
}

/* Ask for the ground at the points of those who stand on one. `grounds` is a tuple of that of each, and `ask` gives what is below of a
 * ground, x and z; or it is one for all, and `ask` gives as many of it and a list of (x, z). 0 with an error. */
static int cdbp_ask_ground(const cdbp_pose_update *to, PyObject *grounds, PyObject *ask)
{
    size_t n_all = to->n * to->n_points, n = 0, k;
    int is_for_each = PyType_IsSubtype(Py_TYPE(grounds), &PyTuple_Type), is_right = 1;
    PyObject *points, *answers = NULL, *each = NULL;
    memset(to->below, 0, 3 * n_all * sizeof(double));
    for (k = 0; k < n_all; k++) {
        if (to->given[k / to->n_points].gives_ground == 0.0) to->points[2 * k] = NAN;
        n += to->points[2 * k] == to->points[2 * k];
    }
    points = is_for_each ? NULL : PyTuple_New((Py_ssize_t)n);
    for (k = n = 0; is_right && k < n_all; k++) {
        const double *point = to->points + 2 * k;
        PyObject *own = NULL;
        if (point[0] != point[0]) continue;
        if (is_for_each) {
            PyObject *ground = PyTuple_GetItem(grounds, (Py_ssize_t)(k / to->n_points));
            PyObject *x = ground ? PyFloat_FromDouble(point[0]) : NULL, *z = x ? PyFloat_FromDouble(point[1]) : NULL;
            own = z ? PyObject_CallFunctionObjArgs(ask, ground, x, z, NULL) : NULL;
            if (x) Py_DecRef(x);
            if (z) Py_DecRef(z);
            is_right = own && cdbp_take_below(own, to->below + 3 * k);
        } else if (points && (own = Py_BuildValue("(dd)", point[0], point[1]))) PyTuple_SetItem(points, (Py_ssize_t)n++, own);
        else is_right = 0;
    }
    if (is_for_each) return is_right;
    if (points && is_right) answers = PyObject_CallFunctionObjArgs(ask, grounds, points, NULL);
    if (points) Py_DecRef(points);
    each = answers ? PyObject_GetIter(answers) : NULL;
    if (answers) Py_DecRef(answers);
    for (k = 0; each && is_right && k < n_all; k++)
        if (to->points[2 * k] == to->points[2 * k]) is_right = cdbp_take_below(PyIter_Next(each), to->below + 3 * k);
    is_right = is_right && each;
    if (each) Py_DecRef(each);
    return is_right;
}

/* poses.update(before, plays, places or None, seconds, grounds or None, after, displayed, roots, made, contacts, moves_body, ask): put
 * characters through all stages, by what was decided, and ask for the ground on the way; whether all play something. `made` is what
 * happened to them, the moments at seams, two for each, and their rotations, translations and positions. */
static PyObject *cdbp_poses_update(PyObject *self, PyObject *const *in, Py_ssize_t n)
{
    const cdbo_poses *poses = cdbp_made_poses(self);
    cdbp_arrays a;
    cdbp_pose_update to;
    double *room = NULL;
    int is_whole = 0, is_done = 0;
    a.n = 0;
    if (poses && n == 12 && cdbp_take_update(poses, &a, in, &to) == 0) {
        size_t n_room = cdbo_pose_room(poses), n_all = in[4] == Py_None ? 0 : to.n * to.n_points;
        room = (double *)PyMem_Malloc((n_room + 5 * n_all + 1) * sizeof(double));
        if (!room) PyErr_NoMemory();
        else {
            is_whole = cdbp_receive_all(poses, &to);
            to.points = room + n_room, to.below = to.points + 2 * n_all;
            cdbp_run_update(poses, &to, in[4] == Py_None ? CDBO_WHOLE : CDBO_UP_TO_GROUND, room);
            is_done = in[4] == Py_None || cdbp_ask_ground(&to, in[4], in[11]);
            if (is_done && in[4] != Py_None) cdbp_run_update(poses, &to, CDBO_FROM_GROUND, room);
        }
        PyMem_Free(room);
    }
    if (!is_done) return cdbp_given_back(&a, 0, "update takes 12 arguments");
    cdbp_release(&a);
    return cdbp_new_ref(is_whole ? Py_True : Py_False);
}

static PyObject *cdbp_poses_width(PyObject *self, void *unused)
{
    (void)unused;
    return PyLong_FromLongLong((long long)((cdbp_poses *)self)->poses.width);
}

static PyMethodDef cdbp_poses_methods[] = {
    {"begin", cdbp_poses_begun, METH_O, "Write the row of a character that has not displayed anything yet."},
    {"update", CDBP_CALL(cdbp_poses_update), METH_FASTCALL, "Put characters through the stages."},
    {NULL, NULL, 0, NULL},
};
static PyGetSetDef cdbp_poses_members[] = {
    {"width", cdbp_poses_width, NULL, "How many numbers the row of a character has.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};
static PyType_Slot cdbp_poses_slots[] = {
    {Py_tp_init, CDBP_SLOT(cdbp_poses_init)},
    {Py_tp_dealloc, CDBP_SLOT(cdbp_poses_free)},
    {Py_tp_methods, cdbp_poses_methods},
    {Py_tp_getset, cdbp_poses_members},
    {0, NULL},
};
static PyType_Spec cdbp_poses_spec = {"contextdb.core._core.Poses", (int)sizeof(cdbp_poses), 0, Py_TPFLAGS_DEFAULT,
    cdbp_poses_slots};
