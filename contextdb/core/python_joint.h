/* ---- The joint search for Python: one function over arrays. */

/* search_joint(blocks, rank, boxes, lows, highs, channels, weights, ranges, firsts, relative, relative_lows, relative_highs, pairs,
 * relative_weights, queries, seen, casts, range_biases, frame_biases, bests, best_frames, best_casts) */
static PyObject *cdbp_search_joint(PyObject *self, PyObject *const *arguments, Py_ssize_t n_arguments)
{
    cdbp_arrays arrays;
    cdbm_joint joint;
    cdbm_meeting asked;
    size_t shape[4], n_slots;
    PyThreadState *state;
    cdbm_room room;
    void *memory;
    int is_done;
    (void)self;
    arrays.n = 0;
    if (n_arguments != 22) {
        PyErr_SetString(PyExc_TypeError, "search_joint takes 22 arguments");
        return NULL;
    }
    if (!(joint.blocks = (const float *)cdbp_items(&arrays, arguments[0], 'f', 4, 3, 0, shape))) goto failed;
    joint.n_own = shape[0];
    joint.n_features = shape[1];
    if (shape[2] != CDBM_FRAMES) goto wrong;
    if (!(joint.rank = (const int64_t *)cdbp_row_of(&arrays, arguments[1], 'i', 8, joint.n_features))) goto failed;
    if (!(joint.boxes = (const int64_t *)cdbp_items(&arrays, arguments[2], 'i', 8, 2, 0, shape))) goto failed;
    joint.n_boxes = shape[0];
    joint.n_roles = shape[1];
    shape[0] = joint.n_roles;
    shape[1] = joint.n_features;
    shape[2] = joint.n_boxes;
    if (!(joint.lows = (const float *)cdbp_exactly(&arrays, arguments[3], 'f', 4, 3, shape))) goto failed;
    if (!(joint.highs = (const float *)cdbp_exactly(&arrays, arguments[4], 'f', 4, 3, shape))) goto failed;
    if (!(joint.weights = (const double *)cdbp_items(&arrays, arguments[6], 'f', 8, 1, 0, &joint.n_channels))) goto failed;
    if (!(joint.channels = (const int64_t *)cdbp_row_of(&arrays, arguments[5], 'i', 8, joint.n_channels + 1))) goto failed;
    if (!(joint.ranges = (const int64_t *)cdbp_row_of(&arrays, arguments[7], 'i', 8, joint.n_boxes))) goto failed;
    if (!(joint.firsts = (const int64_t *)cdbp_row_of(&arrays, arguments[8], 'i', 8, joint.n_boxes))) goto failed;
    if (!(joint.pairs = (const int64_t *)cdbp_items(&arrays, arguments[12], 'i', 8, 2, 0, shape))) goto failed;
    joint.n_pairs = shape[0];
    if (shape[1] != 2) goto wrong;
    shape[0] = joint.n_boxes;
    shape[1] = joint.n_pairs;
    shape[2] = 4;
    shape[3] = CDBM_FRAMES;
    if (!(joint.relative = (const float *)cdbp_exactly(&arrays, arguments[9], 'f', 4, 4, shape))) goto failed;
    shape[0] = joint.n_pairs;
    shape[1] = 4;
    shape[2] = joint.n_boxes;
    if (!(joint.relative_lows = (const float *)cdbp_exactly(&arrays, arguments[10], 'f', 4, 3, shape))) goto failed;
    if (!(joint.relative_highs = (const float *)cdbp_exactly(&arrays, arguments[11], 'f', 4, 3, shape))) goto failed;
    if (!(joint.relative_weights = (const double *)cdbp_row_of(&arrays, arguments[13], 'f', 8, 2))) goto failed;
    if (!(asked.queries = (const double *)cdbp_items(&arrays, arguments[14], 'f', 8, 2, 0, shape))) goto failed;
    asked.n_actors = shape[0];
    if (shape[1] != joint.n_features) goto wrong;
    shape[1] = asked.n_actors;
    shape[2] = 4;
    if (!(asked.seen = (const double *)cdbp_exactly(&arrays, arguments[15], 'f', 8, 3, shape))) goto failed;
    if (!(asked.casts = (const int64_t *)cdbp_items(&arrays, arguments[16], 'i', 8, 2, 0, shape))) goto failed;
    asked.n_casts = shape[0];
    if (shape[1] != joint.n_roles) goto wrong;
    if (!(asked.range_biases = (const double *)cdbp_items(&arrays, arguments[17], 'f', 8, 2, 0, shape))) goto failed;
    joint.n_ranges = shape[1];
    if (shape[0] != asked.n_casts) goto wrong;
    shape[0] = joint.n_boxes;
    shape[1] = CDBM_FRAMES;
    if (!(asked.frame_biases = (const double *)cdbp_exactly(&arrays, arguments[18], 'f', 8, 2, shape))) goto failed;
    if (!(asked.bests = (double *)cdbp_items(&arrays, arguments[19], 'f', 8, 1, 1, &n_slots))) goto failed;
    if (!(asked.frames = (int64_t *)cdbp_items(&arrays, arguments[20], 'i', 8, 1, 1, shape))) goto failed;
    if (!(asked.casts_of = (int64_t *)cdbp_items(&arrays, arguments[21], 'i', 8, 1, 1, shape + 1))) goto failed;
    asked.is_each = n_slots != 1;
    if (shape[0] != n_slots || shape[1] != n_slots || (asked.is_each && n_slots != asked.n_casts * joint.n_ranges)) goto wrong;
    if (!cdbm_is_joint_whole(&joint) || !cdbm_are_below(asked.casts, asked.n_casts * joint.n_roles, asked.n_actors)) goto wrong;
    room.left = cdbm_joint_room(&joint, asked.n_actors, asked.n_casts);
    is_done = (memory = room.at = (char *)PyMem_Malloc(room.left + 1)) != NULL;
    state = PyEval_SaveThread();
    is_done = is_done && cdbm_search_joint(&joint, &asked, room);
    PyEval_RestoreThread(state);
    PyMem_Free(memory);
    cdbp_release(&arrays);
    return is_done ? cdbp_new_ref(Py_None) : PyErr_NoMemory();
wrong:
    PyErr_SetString(PyExc_ValueError, "the arrays of a joint search do not go together");
failed:
    cdbp_release(&arrays);
    return NULL;
}

#define CDBP_JOINT_FUNCTIONS {"search_joint", CDBP_CALL(cdbp_search_joint), METH_FASTCALL, "The best joint frame and cast of all, or of each."},
