/* Reads the outputs of every row of a table, and watches its file: watch ARTEFACT OTHER. OTHER is what the file is replaced by. */

#define CDB_FILES
#define CDB_WATCH
#include "tables.h"

static void told(const cdb_moves *moves, int64_t row)
{
    const double *line = cdb_moves_out_offset(moves, row);
    printf("%d %d %.17g %s %d %s %.17g %.17g\n", cdb_moves_out_loud(moves, row), (int)cdb_moves_out_damage(moves, row),
        cdb_moves_out_blend(moves, row), cdb_moves_out_line(moves, row), (int)cdb_moves_out_mood(moves, row),
        cdb_output_text(&moves->table, 4, row), line[0], line[1]);
}

static int replaced(const char *path, const char *other)
{
    size_t size;
    cdb_fault fault;
    void *bytes = cdb_read_file(other, &size, &fault);
    FILE *file = bytes ? fopen(path, "wb") : NULL;
    int is_well = file && fwrite(bytes, 1, size, file) == size;
    if (file && fclose(file) != 0) is_well = 0;
    CDB_FREE(bytes);
    return is_well;
}

int main(int argc, char **argv)
{
    cdb_fault fault;
    cdb_moves_watch watch;
    int64_t row;
    if (argc != 4) return 2;
    cdb_moves_watch_file(&watch, argv[1], CDB_STRANGE_REFUSED);
    if (cdb_moves_watch_poll(&watch, &fault) != CDB_OK || !watch.now || watch.old) return 3;
    for (row = -1; (uint64_t)(row + 1) <= watch.now->table.n_rows; row++) told(watch.now, row);
    printf("jump is row %d\n", (int)cdb_next_row_of(&watch.now->table, "jump", -1));
    if (cdb_next_row_of(&watch.now->table, "jump", 2) != -1 || cdb_next_row_of(&watch.now->table, "none", -1) != -1) return 9;
    if (cdb_moves_watch_poll(&watch, &fault) != CDB_OK || watch.old) return 4; /* nothing new */
    if (!replaced(argv[1], argv[2]) || cdb_moves_watch_poll(&watch, &fault) != CDB_OK || !watch.old) return 5;
    printf("%d rows after %d\n", (int)watch.now->table.n_rows, (int)watch.old->table.n_rows);
    if (!replaced(argv[1], argv[3]) || cdb_moves_watch_poll(&watch, &fault) != CDB_OK) return 6; /* not before it is released */
    cdb_moves_watch_release(&watch);
    if (cdb_moves_watch_poll(&watch, &fault) != CDB_BAD_FILE || watch.old || watch.now->table.n_rows == 0) return 7;
    printf("%s\n", fault.reason);
    if (cdb_moves_watch_poll(&watch, &fault) != CDB_OK) return 8; /* told once */
    cdb_moves_watch_close(&watch);
    return 0;
}
