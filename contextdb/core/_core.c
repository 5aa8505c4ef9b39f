/* The core for Python: the extension contextdb.core._core. It keeps no state between calls but what its objects own. Facts are read
 * and rows handed out here; all answers are those of core.h, which games compile too. */

#ifdef CDBP_HEADERS
#include "abi.h"
#endif
#include "core.h"
#include "boxes.h"
#include "count.h"
#include "poses.h"
#include "motion.h"
#include "abi.h"
#include "python_arrays.h"
#include "python_answers.h"
#include "python_facts.h"
#include "python_steps.h"
#include "python_table.h"
#include "python_live.h"
#include "python_programs.h"
#include "python_count.h"
#include "python_poses.h"
#include "python_legs.h"
#include "python_paths.h"
#include "python_search.h"
#include "python_joint.h"
#include "python_controller.h"
#include "python_walk.h"
#include "python_nodes.h"
#include "batch.h"
#include "python_batch.h"
#include "fact_columns.h"
#include "python_columns.h"
#include "choose.h"
#include "python_choose.h"
#include "keys.h"
#include "python_keys.h"
#include "python_masks.h"

/* Make the types, and put them into the module. */
static int cdbp_exec(PyObject *module)
{
    static PyType_Spec *const specs[] = {&cdbp_shared_spec, &cdbp_answer_spec, &cdbp_table_spec, &cdbp_live_spec, &cdbp_boxes_spec, &cdbp_pose_frames_spec, &cdbp_poses_spec, &cdbp_frames_spec, &cdbp_batch_spec, &cdbp_choices_spec, &cdbp_controller_spec, &cdbp_ways_spec, &cdbp_program_spec};
    static const char *const names[] = {"Shared", "Answer", "Table", "Live", "Boxes", "PoseFrames", "Poses", "Frames", "Batch", "Choices", "Controllers", "Ways", "Program"};
    size_t i;
    for (i = 0; i < sizeof specs / sizeof *specs; i++) {
        PyObject *type = PyType_FromModuleAndSpec(module, specs[i], NULL);
        int status = type ? PyModule_AddObjectRef(module, names[i], type) : -1;
        if (type) Py_DecRef(type);
        if (status != 0) return -1;
    }
    return 0;
}

/* The functions of the module: those of each part, as its header lists them. */
static PyMethodDef cdbp_functions[] = {
    CDBP_COUNT_FUNCTIONS
    CDBP_POSE_FUNCTIONS
    CDBP_PATH_FUNCTIONS
    CDBP_JOINT_FUNCTIONS
    CDBP_CONTROLLER_FUNCTIONS
    CDBP_WALK_FUNCTIONS
    CDBP_NODE_FUNCTIONS
    {"group_keys", CDBP_CALL(cdbp_group_keys), METH_FASTCALL, "The distinct keys of many contexts; see contextdb.telemetry.keys."},
    {"hash_keys", CDBP_CALL(cdbp_hash_keys), METH_FASTCALL, "A hash of each key."},
    {"list_rows", CDBP_CALL(cdbp_list_rows), METH_FASTCALL, "The rows of masks, one mask after the other."},
    {"pack_codes", CDBP_CALL(cdbp_pack_codes), METH_FASTCALL, "Put codes into a field of keys."},
    {"turn_rows", CDBP_CALL(cdbp_turn_rows_of), METH_FASTCALL, "Turn over the bits of rows in the masks of their cells."},
    {"unpack_codes", CDBP_CALL(cdbp_unpack_codes), METH_FASTCALL, "Take codes out of the fields of keys."},
    {"read_column", CDBP_CALL(cdbp_read_column), METH_FASTCALL, "The codes of a column of facts; see contextdb.compiled.batch."},
    {NULL, NULL, 0, NULL},
};
static PyModuleDef_Slot cdbp_slots[] = {
    {Py_mod_exec, CDBP_SLOT(cdbp_exec)},
#ifdef Py_mod_gil
    {Py_mod_gil, Py_MOD_GIL_NOT_USED},
#endif
    {0, NULL},
};
static PyModuleDef cdbp_module = {PyModuleDef_HEAD_INIT, "contextdb.core._core", "The core in C.", 0, cdbp_functions, cdbp_slots, NULL, NULL,
    NULL};

PyMODINIT_FUNC PyInit__core(void)
{
    return PyModuleDef_Init(&cdbp_module);
}
