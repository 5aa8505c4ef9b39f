/* ---- Parts of poses for Python, by themselves: columns, placing, legs and the ground below them. */

/* pose_columns(): where each single number of a row is, by its name. */
static PyObject *cdbp_pose_columns(PyObject *module, PyObject *unused)
{
    PyObject *columns = PyDict_New();
    cdbo_poses poses;
    size_t i, k;
    (void)module, (void)unused;
    memset(&poses, 0, sizeof poses);
    cdbo_place_single(&poses);
    for (i = 0; columns && i < CDBO_COUNT(CDBO_STAGES); i++)
        for (k = 0; columns && k < CDBO_STAGES[i]->n_columns; k++) {
            const cdbo_column_record *column = &CDBO_STAGES[i]->columns[k];
            PyObject *at = column->each == CDBO_ONE ? PyLong_FromLongLong((long long)poses.at[column->column]) : NULL;
            if (at && PyDict_SetItemString(columns, column->name, at) != 0) cdbp_clear(&columns);
            if (at) Py_DecRef(at);
        }
    return columns;
}

/* place_joints(parents, translations, rotations, root, positions, world): joints in the world. */
static PyObject *cdbp_place_joints(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const int64_t *parents;
    const double *translations, *rotations, *root;
    double *positions, *world;
    size_t s[3], n_joints = 0;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 6 && (parents = cdbp_int64s(&a, in[0], s, 1, CDBP_ANY, 0)) && ((n_joints = s[0]), 1)
        && (translations = cdbp_numbers(&a, in[1], s, 2, n_joints, 3, 0))
        && (rotations = cdbp_numbers(&a, in[2], s, 2, n_joints, 4, 0))
        && (root = cdbp_numbers(&a, in[3], s, 1, 3, 0, 0)) && (positions = cdbp_to_numbers(&a, in[4], s, 2, n_joints, 3, 0))
        && (world = cdbp_to_numbers(&a, in[5], s, 2, n_joints, 4, 0)) && cdbo_are_parents(parents, n_joints)) {
        cdbo_place(parents, n_joints, translations, rotations, root, positions, world);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "place_joints takes parents before their joints, and five arrays");
}

/* bend_legs(parents, positions, world, leg, targets, ahead, rotations): of each of N poses the ankle comes to its target. */
static PyObject *cdbp_bend_legs(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const int64_t *parents, *leg;
    const double *positions, *world, *targets, *ahead;
    double *rotations, straight = n == 8 ? PyFloat_AsDouble(in[6]) : 0.0;
    size_t s[3], n_joints = 0, n_poses = 0, i;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 8 && !PyErr_Occurred() && (parents = cdbp_int64s(&a, in[0], s, 1, CDBP_ANY, 0)) && ((n_joints = s[0]), 1)
        && (positions = cdbp_numbers(&a, in[1], s, 3, CDBP_ANY, n_joints, 3)) && ((n_poses = s[0]), 1)
        && (world = cdbp_numbers(&a, in[2], s, 3, n_poses, n_joints, 4)) && (leg = cdbp_int64s(&a, in[3], s, 1, 3, 0))
        && (targets = cdbp_numbers(&a, in[4], s, 2, n_poses, 3, 0)) && (ahead = cdbp_numbers(&a, in[5], s, 2, n_poses, 3, 0))
        && (rotations = cdbp_to_numbers(&a, in[7], s, 3, n_poses, n_joints, 4)) && cdbo_are_joints(leg, 3, n_joints)
        && cdbo_are_parents(parents, n_joints) && parents[leg[0]] >= 0) {
        for (i = 0; i < n_poses; i++)
            cdbo_bend_leg(parents, positions + 3 * n_joints * i, world + 4 * n_joints * i, leg, cdbo_get3(targets, i),
                cdbo_get3(ahead, i), straight, rotations + 4 * n_joints * i);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "bend_legs takes the joints of a leg, an angle, and six arrays");
}

/* lower_hips(positions, legs, places, footings, raised, lower, seconds): how low hips are, and the change of that, some time
 * later. */
static PyObject *cdbp_lower_hips(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const int64_t *legs;
    const double *positions, *places, *footings;
    double *lower, most = 0.0, raised = n == 7 ? PyFloat_AsDouble(in[4]) : 0.0, dt_s = n == 7 ? PyFloat_AsDouble(in[6]) : 0.0;
    size_t s[3], n_joints = 0, n_feet = 0, foot;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 7 && !PyErr_Occurred() && (positions = cdbp_numbers(&a, in[0], s, 2, CDBP_ANY, 3, 0)) && ((n_joints = s[0]), 1)
        && (legs = cdbp_int64s(&a, in[1], s, 2, CDBP_ANY, 4)) && ((n_feet = s[0]), 1)
        && (places = cdbp_numbers(&a, in[2], s, 2, n_feet, 3, 0))
        && (footings = cdbp_numbers(&a, in[3], s, 2, n_feet, CDBO_FOOTING, 0))
        && (lower = cdbp_to_numbers(&a, in[5], s, 1, 2, 0, 0))) {
        is_done = 1;
        for (foot = 0; foot < n_feet; foot++) {
            const double *footing = footings + CDBO_FOOTING * foot;
            if (legs[4 * foot] < 0) continue;
            is_done = is_done && cdbo_are_joints(legs + 4 * foot, 4, n_joints);
            if (is_done)
                most = cdbo_most(most,
                    cdbo_too_high(positions, legs + 4 * foot, cdbo_get3(places, foot), footing[1], footing[2], raised));
        }
        if (is_done) cdbo_lower(lower, cdbo_least(most, CDBO_MOST_LOWER_M), dt_s);
    }
    return cdbp_given_back(&a, is_done, "lower_hips takes the joints of legs, two numbers, and four arrays");
}

/* stand_legs(parents, positions, world, legs, hinges, places, footings, rotations): each foot comes to its place, as steep as
 * its ground. */
static PyObject *cdbp_stand_legs(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const int64_t *parents, *legs;
    const double *positions, *hinges, *places, *footings;
    double *world, *rotations;
    size_t s[3], n_joints = 0, n_feet = 0, foot;
    int is_done = 0;
    (void)module;
    a.n = 0;
    if (n == 8 && (parents = cdbp_int64s(&a, in[0], s, 1, CDBP_ANY, 0)) && ((n_joints = s[0]), 1)
        && (positions = cdbp_numbers(&a, in[1], s, 2, n_joints, 3, 0)) && (world = cdbp_to_numbers(&a, in[2], s, 2, n_joints, 4, 0))
        && (legs = cdbp_int64s(&a, in[3], s, 2, CDBP_ANY, 4)) && ((n_feet = s[0]), 1)
        && (hinges = cdbp_numbers(&a, in[4], s, 2, n_feet, 3, 0)) && (places = cdbp_numbers(&a, in[5], s, 2, n_feet, 3, 0))
        && (footings = cdbp_numbers(&a, in[6], s, 2, n_feet, CDBO_FOOTING, 0))
        && (rotations = cdbp_to_numbers(&a, in[7], s, 2, n_joints, 4, 0))
        && cdbo_are_parents(parents, n_joints) && cdbo_are_legs(legs, n_feet, parents, n_joints)) {
        for (foot = 0; foot < n_feet; foot++) {
            const double *footing = footings + CDBO_FOOTING * foot;
            if (legs[4 * foot] >= 0)
                cdbo_stand_leg(parents, positions, world, legs + 4 * foot, hinges + 3 * foot, cdbo_get3(places, foot), footing[1],
                    footing[2], rotations);
        }
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "stand_legs takes the joints of legs, and seven arrays");
}

/* feel_ground(footings, hips, below, shares, is_new, seconds): feet on the ground that is below them, those that are down with a
 * share of their swing below 0, and the hips that go by the lowest, at once where they are new. */
static PyObject *cdbp_pose_ground(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    cdbp_arrays a;
    const double *below, *shares;
    double *footings, *hips, lowest = 0.0, height, dt_s = n == 6 ? PyFloat_AsDouble(in[5]) : 0.0;
    size_t s[3], n_feet = 0, foot;
    int is_done = 0, is_new = n == 6 ? PyObject_IsTrue(in[4]) : 0;
    (void)module;
    a.n = 0;
    if (n == 6 && !PyErr_Occurred() && (footings = cdbp_to_numbers(&a, in[0], s, 2, CDBP_ANY, CDBO_FOOTING, 0))
        && ((n_feet = s[0]), 1)
        && (hips = cdbp_to_numbers(&a, in[1], s, 1, 2, 0, 0)) && (below = cdbp_numbers(&a, in[2], s, 2, n_feet, 3, 0))
        && (shares = cdbp_numbers(&a, in[3], s, 1, n_feet, 0, 0))) {
        for (foot = 0; foot < n_feet; foot++) {
            height = cdbo_feel(footings + CDBO_FOOTING * foot, below + 3 * foot, shares[foot], dt_s);
            lowest = foot > 0 ? cdbo_least(lowest, height) : height;
        }
        if (is_new) hips[0] = lowest, hips[1] = 0.0;
        else cdbo_come(hips, lowest, cdbo_damping(CDBO_HIPS_HALFLIFE_S), dt_s);
        is_done = 1;
    }
    return cdbp_given_back(&a, is_done, "feel_ground takes four arrays, whether a body is new, and seconds");
}

/* risen(answer, steepest): a ground's answer (height, (nx, ny, nz)) as its height and by how much it rises along x and z; None for one that
 * is steeper, that points down, or that is made of anything but floats. */
static PyObject *cdbp_risen(PyObject *module, PyObject *const *in, Py_ssize_t n)
{
    double numbers[4] = {0.0, 0.0, 0.0, 0.0}, steepest = n == 2 ? PyFloat_AsDouble(in[1]) : 0.0, along[2];
    PyObject *normal = n == 2 && Py_TYPE(in[0]) == &PyTuple_Type && PyTuple_Size(in[0]) == 2 ? PyTuple_GetItem(in[0], 1) : NULL;
    Py_ssize_t i;
    (void)module;
    if (PyErr_Occurred()) return NULL;
    if (!normal || Py_TYPE(normal) != &PyTuple_Type || PyTuple_Size(normal) != 3) return cdbp_new_ref(Py_None);
    for (i = 0; i < 4; i++) {
        PyObject *own = i ? PyTuple_GetItem(normal, i - 1) : PyTuple_GetItem(in[0], 0);
        if (Py_TYPE(own) != &PyFloat_Type) return cdbp_new_ref(Py_None);
        numbers[i] = PyFloat_AsDouble(own);
    }
    if (!(numbers[2] > 0.0 && fabs(numbers[0]) <= DBL_MAX)) return cdbp_new_ref(Py_None);
    along[0] = -numbers[1] / numbers[2], along[1] = -numbers[3] / numbers[2];
    if (!(along[0] * along[0] + along[1] * along[1] <= 0.99 * steepest * steepest)) return cdbp_new_ref(Py_None);
    return Py_BuildValue("(ddd)", numbers[0], along[0], along[1]);
}

#define CDBP_POSE_FUNCTIONS \
    {"risen", CDBP_CALL(cdbp_risen), METH_FASTCALL, "The height of a ground, and how it rises along x and z."}, \
    {"pose_columns", cdbp_pose_columns, METH_NOARGS, "Where each single number of a character's row is, by its name."}, \
    {"place_joints", CDBP_CALL(cdbp_place_joints), METH_FASTCALL, "Place the joints of a pose in the world."}, \
    {"bend_legs", CDBP_CALL(cdbp_bend_legs), METH_FASTCALL, "Bend a leg in each of some poses: its ankle comes to a target."}, \
    {"lower_hips", CDBP_CALL(cdbp_lower_hips), METH_FASTCALL, "Write how low hips are for their legs, some time later."}, \
    {"stand_legs", CDBP_CALL(cdbp_stand_legs), METH_FASTCALL, "Bend legs so that feet come to their places."}, \
    {"feel_ground", CDBP_CALL(cdbp_pose_ground), METH_FASTCALL, "Write the ground below feet, and the hips, some time later."},
