/* enter BUNDLE   a character of the first controller walks, plays a one-off to a place, and walks on. Prints what it costs, what is
 *                displayed in each update while it plays, and how far from the place its body then is. */
#define CDB_FILES
#include <stdio.h>
#include "contextdb_motion.h"

int main(int n_words, char **words)
{
    size_t size, i;
    const char *why;
    void *bytes = cdb_read_file(words[n_words - 1], &size, NULL);
    cdbm_crowd *crowd = cdbm_open_crowd(bytes, size, NULL, 2, CDB_UNKNOWN_ANY, &why);
    const double *state = crowd ? cdbm_crowd_numbers(crowd, 1, CDBM_STATE_NUMBERS) : NULL;
    static const char *const unknown[] = {"Unknown"};
    cdbm_tags tags;
    cdbm_match match;
    cdbm_one_off one;
    double x, z, cost;
    if (!crowd) return puts(why), 1;
    if (state[cdbm_walk_width(&crowd->player.ways) + 19] != 1.0 || cdbm_seed_one(crowd, 2, 7) || !cdbm_seed_one(crowd, 1, 7)) return 8;
    if (state[cdbm_walk_width(&crowd->player.ways) + 19] != 7.0) return 9;
    cdbm_steer_one(crowd, 1, 0.0, 1.3, NAN);
    for (i = 0; i < 30; i++)
        if (cdbm_update_crowd(crowd, 1.0 / 30.0, NULL)) return 2;
    x = state[0] + 0.3, z = state[1] + 2.0;
    memset(&tags, 0, sizeof tags), memset(&match, 0, sizeof match);
    tags.include = unknown, tags.n_include = 1, match.tags = &tags, match.database = (size_t)cdbm_database_number(&crowd->player, "all");
    if (cdbm_enter(&crowd->player, state, &crowd->inputs[1], &match, &one, crowd->room) != -3) return 8;
    if (cdbm_enter_one(crowd, 1, "no such", x, z, NAN, 1e9) <= 1e9 || cdbm_enter_one(crowd, 2, "all", x, z, NAN, 1e9) <= 1e9) return 3;
    cost = cdbm_enter_one(crowd, 1, "all", x, z, NAN, 0.0); /* dearer than that: it is not played */
    if (!(cost > 0.0) || crowd->inputs[1].one_off) return 4;
    if (cdbm_enter_one(crowd, 1, "all", x, z, NAN, cost) != cost) return 5;
    printf("%.17g\n", cost);
    for (i = 0; crowd->inputs[1].one_off && !cdbm_is_over(&crowd->player, crowd->inputs[1].one_off); i++) {
        if (cdbm_update_crowd(crowd, 1.0 / 30.0, NULL)) return 6;
        printf("%s\n", cdbm_crowd_text(crowd, 1, CDBM_ASSET_TEXT));
    }
    printf("%.17g %.17g\n", state[0] - x, state[1] - z);
    if (cdbm_update_crowd(crowd, 1.0 / 30.0, NULL) || crowd->inputs[1].one_off) return 7;
    cdbm_close_crowd(crowd);
    CDB_FREE(bytes);
    return 0;
}
