#define CDB_FILES
#include "tables.h"

int main(void)
{
    cdb_fault fault;
    size_t size;
    void *bytes = cdb_read_file("contested_catch.safetensors", &size, &fault);
    cdb_contested_catch table;
    if (!bytes || cdb_contested_catch_open(&table, bytes, size, &fault) != CDB_OK) {
        printf("%s: %s\n", fault.name, fault.reason);
        CDB_FREE(bytes);
        return 1;
    }

    cdb_contested_catch_facts facts = cdb_contested_catch_missing();
    facts.MidAir_Catch_Direction = CDB_MID_AIR_CATCH_DIRECTION_GOING_DOWN;
    facts.Defender_DepthChart = CDB_DEFENDER_DEPTH_CHART_FS;
    facts.Defender_MidAir_Contesting = 1;
    facts.Defender_CatchingAnim = 0;
    facts.Defender_Catching = 0;

    uint64_t rows[16]; /* 1,024 rows; a longer table is refused, not written beyond */
    if (cdb_contested_catch_query(&table, &facts, CDB_UNKNOWN_ERROR, rows, 16, &fault) != CDB_OK)
        printf("%s: %s\n", fault.name, fault.reason);

    facts.Defender_FacingBall = 1;
    cdb_contested_catch_query(&table, &facts, CDB_UNKNOWN_ERROR, rows, 16, &fault);
    for (int64_t row = cdb_next_row(rows, 16, -1); row >= 0; row = cdb_next_row(rows, 16, row))
        printf("%s\n", cdb_asset(&table.table, row));

    cdb_picker picker = cdb_new_picker(1, 0, 1); /* the memory of one character: seed, its number, picks that are not repeated */
    int64_t row;
    cdb_contested_catch_pick(&table, &facts, CDB_UNKNOWN_ERROR, rows, 16, 0.0, &picker, &row, &fault);
    printf("picked: %s\n", cdb_asset_of(&table.table, row));

    cdb_contested_catch_close(&table);
    CDB_FREE(bytes);
    return 0;
}
