/* A game that publishes what it asks: linked ARTEFACT GAME FRAMES. It prints its name, and ends after so many frames with a listener. */

#include "cdb_link.h"

static unsigned char bytes[1 << 20];
static cdbl_link link_of_game;
static cdb_game game;

int main(int n, char **given)
{
    cdb_game_facts facts = cdb_game_missing();
    uint64_t rows[4];
    cdb_fault fault;
    size_t size;
    int frames, i = 0;
    FILE *file = n == 4 ? fopen(given[1], "rb") : NULL;
    if (file == NULL) return 2;
    size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    if (cdb_game_open(&game, bytes, size, &fault) != CDB_OK) return 3;
    if (!cdbl_open(&link_of_game, given[2])) return 4;
    printf("%s\n", link_of_game.game);
    fflush(stdout);
    frames = atoi(given[3]);
    while (i < frames) {
        struct timespec rest = {0, 2000000};
        nanosleep(&rest, NULL);
        if (cdbl_listeners(&link_of_game) == 0) continue;
        facts.ok = i % 2;
        facts.n = i;
        facts.speed = i / 2.0;
        facts.heading = -90.0;
        facts.day = cdb_date(2024, 2, 29);
        facts.state = CDB_STATE_B;
        facts.word = "say \"no\"\n\xC3\xA9\xFF";
        facts.moves = cdb_moves_none();
        cdb_moves_add(&facts.moves, CDB_MOVES_MOVE_RUN);
        if (cdb_game_query(&game, &facts, CDB_UNKNOWN_ERROR, rows, 4, &fault) != CDB_OK) return 5;
        cdbl_game_tell(&link_of_game, "player", &game, &facts, rows, cdb_next_row(rows, 4, -1));
        i++;
    }
    cdbl_close(&link_of_game);
    cdb_game_close(&game);
    return 0;
}
