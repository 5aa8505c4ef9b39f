/* Casts actors for the roles of any table: cast TABLE QUESTIONS. A question is lines of words apart by tabs: "f NAME VALUE" a fact,
 * "a ROLE ID COST" an actor (COST "-" without a preference), "x NAME VALUE" a fact of the actor before, "go UNKNOWN" the end. Prints
 * the status, the rows, and for each row who plays each role; with "time" behind it, how long a cast and its castings take. */

#define CDB_FILES
#include <stdio.h>
#include <time.h>
#include "tables.h"

static int set(cdb_live *live, const char *name, const char *value)
{
    int at = cdb_condition_number(live->schema, name);
    cdb_type type = at < 0 ? CDB_TEXT : live->schema->conditions[at].type;
    const char *none[1];
    if (type == CDB_TAGS) {
        none[0] = value;
        return cdb_set_tags(live, at, none, value[0] != 0) == CDB_OK;
    }
    return (type == CDB_ENUM || type == CDB_TEXT ? cdb_set_text(live, at, value) : cdb_set_number(live, at, atof(value))) == CDB_OK;
}

static char *word(char **at)
{
    char *from = *at, *end = from + strcspn(from, "\t\n");
    *at = *end ? end + 1 : end;
    *end = 0;
    return from;
}

int main(int argc, char **argv)
{
    static cdb_live *lives[CDB_MOST_ACTORS + 1];
    static cdb_actor actors[CDB_MOST_ACTORS + 1];
    static char texts[64][64], line[1000];
    size_t size, n = 0, i, n_texts = 0;
    cdb_fault fault;
    void *bytes = argc > 2 ? cdb_read_file(argv[1], &size, &fault) : NULL;
    cdb_any *any = bytes ? cdb_open_any(bytes, size, &fault) : NULL;
    FILE *questions = argc > 2 ? fopen(argv[2], "r") : NULL;
    uint64_t *rows, *masks;
    int *playing;
    if (!any || !questions) return 2;
    rows = (uint64_t *)malloc(any->table.n_words * 8 + 8);
    masks = (uint64_t *)malloc(CDB_MOST_ACTORS * any->table.n_words * 8 + 8);
    playing = (int *)malloc(any->table.n_roles * sizeof(int) + 1);
    for (i = 0; i <= CDB_MOST_ACTORS; i++) lives[i] = cdb_live_of(any, CDB_UNKNOWN_ERROR, malloc(cdb_live_bytes(&any->schema)));
    while (fgets(line, sizeof line, questions)) {
        char *at = line, kind = line[0];
        word(&at);
        if (kind == 'a') {
            const char *cost;
            actors[n].role = cdb_role_number(&any->table, word(&at));
            actors[n].id = atoi(word(&at));
            cost = word(&at);
            actors[n].cost = cost[0] == '-' && !cost[1] ? cdb_missing_number() : atof(cost);
            n++;
            actors[n - 1].facts = lives[n]->facts;
        } else if (kind == 'f' || kind == 'x') {
            char *name = word(&at), *value = strcpy(texts[n_texts++ % 64], word(&at));
            if (!set(lives[kind == 'f' ? 0 : n], name, value)) return 3;
        } else {
            cdb_unknown unknown = (cdb_unknown)atoi(word(&at));
            cdb_status status = cdb_cast(&any->table, any->columns, &any->schema, lives[0]->facts, unknown, actors, n, masks, rows,
                any->table.n_words, &fault);
            int64_t row;
            printf("%d", (int)status);
            for (row = -1; (row = cdb_next_row(rows, any->table.n_words, row)) >= 0;) {
                int n_playing = cdb_casting(&any->table, actors, n, masks, row, playing);
                printf(" %d:%d", (int)row, n_playing);
                for (i = 0; i < any->table.n_roles; i++)
                    if (playing[i] >= 0) printf(",%s=%d", any->table.roles[i].name, playing[i]);
            }
            printf("\n");
            if (argc > 3) {
                clock_t start = clock();
                for (i = 0; i < 20000; i++) {
                    cdb_cast(&any->table, any->columns, &any->schema, lives[0]->facts, unknown, actors, n, masks, rows, any->table.n_words, &fault);
                    row = cdb_next_row(rows, any->table.n_words, -1);
                    if (row >= 0) cdb_casting(&any->table, actors, n, masks, row, playing);
                }
                printf("%.2f us\n", (double)(clock() - start) / CLOCKS_PER_SEC / 20000 * 1e6);
            }
            for (i = 0; i <= n; i++) cdb_live_of(any, CDB_UNKNOWN_ERROR, lives[i]);
            n = 0;
        }
    }
    fclose(questions);
    for (i = 0; i <= CDB_MOST_ACTORS; i++) free(lives[i]);
    free(rows);
    free(masks);
    free(playing);
    cdb_close_any(any);
    CDB_FREE(bytes);
    return 0;
}
