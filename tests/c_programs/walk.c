#define CDB_FILES
#include <stdio.h>
#include "contextdb_motion.h"

int main(void)
{
    const char *why = NULL, *before = "";
    cdb_fault fault;
    size_t size;
    void *bytes = cdb_read_file("game.motion", &size, &fault);
    cdbm_crowd *crowd = bytes ? cdbm_open_crowd(bytes, size, "player", 1, CDB_UNKNOWN_ERROR, &why) : NULL; /* 1 character */
    if (!crowd) {
        printf("%s\n", bytes ? why : fault.reason);
        return 1;
    }
    cdb_live *facts = cdbm_crowd_live(crowd, 0, 0); /* of character 0, for the first table of the bundle */
    int gait = cdb_condition_number(facts->schema, "gait");
    cdb_set_text(facts, cdb_condition_number(facts->schema, "style"), "normal");

    for (int tick = 0; tick < 240; tick++) { /* four seconds */
        int is_walking = tick >= 60 && tick < 180;
        cdb_set_text(facts, gait, is_walking ? "Walk" : "Idle");
        cdbm_steer_one(crowd, 0, 0.0, is_walking ? 1.3 : 0.0, NAN); /* m/s to the left and ahead; it faces where it goes */
        why = cdbm_update_crowd(crowd, 1.0 / 60.0, &fault);
        if (why) {
            printf("%s %s\n", fault.name, why);
            return 1;
        }
        const char *asset = cdbm_crowd_text(crowd, 0, CDBM_ASSET_TEXT);
        const double *root = cdbm_crowd_numbers(crowd, 0, CDBM_ROOT_NUMBERS); /* x, z and heading */
        if (asset != before) printf("%.2f s: %s, %.2f m ahead\n", tick / 60.0, asset, root[1]);
        before = asset;
    }
    cdbm_close_crowd(crowd);
    CDB_FREE(bytes);
    return 0;
}
