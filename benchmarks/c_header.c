/* Times the C header: c_header ARTEFACT FACTS ROWS ROUNDS.
 *
 * FACTS: an array of cdb_game_facts, as it lies in memory. ROWS: the number of each context and each of its valid rows, pairs of
 * int64, are written there. Prints the nanoseconds of opening, then a line a round: nanoseconds a query, and a query whose rows are
 * met. */

#define CDB_FILES
#include "game.h"
#include <time.h>

static double now_ns(void)
{
    struct timespec time;
    timespec_get(&time, TIME_UTC);
    return (double)time.tv_sec * 1e9 + (double)time.tv_nsec;
}

int main(int argc, char **argv)
{
    static uint64_t rows[4096];
    cdb_fault fault;
    cdb_game game;
    size_t size, facts_size, n, i, n_words;
    void *bytes = cdb_read_file(argv[1], &size, &fault);
    cdb_game_facts *facts = (cdb_game_facts *)cdb_read_file(argv[2], &facts_size, &fault);
    FILE *out = argc == 5 ? fopen(argv[3], "wb") : NULL;
    double start = now_ns();
    int64_t row, met = 0;
    int round;
    if (!bytes || !facts || !out || cdb_game_open(&game, bytes, size, &fault) != CDB_OK) return 1;
    printf("%.1f\n", now_ns() - start);
    n = facts_size / sizeof *facts;
    n_words = game.table.n_words;
    for (i = 0; i < n; i++) {
        if (cdb_game_query(&game, &facts[i], CDB_UNKNOWN_ERROR, rows, n_words, &fault) != CDB_OK) return 1;
        for (row = cdb_next_row(rows, n_words, -1); row >= 0; row = cdb_next_row(rows, n_words, row)) {
            int64_t pair[2] = {(int64_t)i, row};
            fwrite(pair, sizeof pair, 1, out);
        }
    }
    for (round = 0; round < atoi(argv[4]); round++) {
        double masks_ns, rows_ns;
        start = now_ns();
        for (i = 0; i < n; i++) {
            cdb_game_query(&game, &facts[i], CDB_UNKNOWN_ERROR, rows, n_words, NULL);
            met += (int64_t)rows[0];
        }
        masks_ns = now_ns() - start;
        start = now_ns();
        for (i = 0; i < n; i++) {
            cdb_game_query(&game, &facts[i], CDB_UNKNOWN_ERROR, rows, n_words, NULL);
            for (row = cdb_next_row(rows, n_words, -1); row >= 0; row = cdb_next_row(rows, n_words, row)) met += row;
        }
        rows_ns = now_ns() - start;
        printf("%.1f %.1f\n", masks_ns / (double)n, rows_ns / (double)n);
    }
    cdb_game_close(&game);
    CDB_FREE(bytes);
    CDB_FREE(facts);
    return fclose(out) != 0 || met == 1; /* what was met is used, so that no compiler leaves the work away */
}
