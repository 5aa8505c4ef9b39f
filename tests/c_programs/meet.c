/* meet BUNDLE   two characters of the first controller walk, play a clip together, and walk on. Prints what it costs, and of each update
 *               what is displayed of both, and where they are. */
#define CDB_FILES
#include <stdio.h>
#include "contextdb_motion.h"

static void set_fact(cdbm_crowd *crowd, size_t i, const char *name, const char *text)
{
    size_t t;
    for (t = 0; t < cdbm_crowd_size(crowd, CDBM_N_TABLES); t++) {
        int at = cdb_condition_number(&cdbm_crowd_table(crowd, t)->schema, name);
        if (at >= 0) cdb_set_text(cdbm_crowd_live(crowd, i, t), at, text);
    }
}

/* What is refused: no such set, an actor cast twice, a tag that no markup knows, too little room. */
static int are_refused(const cdbm_crowd *crowd)
{
    static const int64_t casts[] = {0, 1, 1, 1};
    static const char *const unknown[] = {"Unknown"};
    const cdbm_player *player = &crowd->player;
    cdbm_together together;
    cdbm_joint_hit hit;
    cdbm_actor actors[2];
    cdbm_tags tags;
    double queries[2][64];
    cdbm_room room = crowd->room;
    size_t i;
    memset(&together, 0, sizeof together), memset(&tags, 0, sizeof tags);
    if (player->controller.n_features > 64) return 0;
    for (i = 0; i < 2; i++) cdbm_take_part(player, crowd->states + i * cdbm_state_width(player), queries[i], &actors[i]);
    together.actors = actors, together.n_actors = 2, together.set = 7;
    if (cdbm_choose_together(player, &together, &hit, room) != -1) return 0;
    together.set = (size_t)cdbm_set_number(player, "greetings"), together.casts = casts, together.n_casts = 2;
    if (cdbm_choose_together(player, &together, &hit, room) != -1) return 0;
    together.n_casts = 1;
    if (cdbm_choose_together(player, &together, &hit, room) != 1 || hit.cast[0] != 0 || hit.cast[1] != 1 || hit.row != -1) return 0;
    tags.include = unknown, tags.n_include = 1, together.tags = &tags;
    if (cdbm_choose_together(player, &together, &hit, room) != -3) return 0;
    room.left = 1000, together.tags = NULL;
    return cdbm_choose_together(player, &together, &hit, room) == 0;
}

int main(int n_words, char **words)
{
    static const size_t both[] = {0, 1}, twice[] = {1, 1}, others[] = {0, 7};
    size_t size, i, k;
    const char *why;
    void *bytes = cdb_read_file(words[n_words - 1], &size, NULL);
    cdbm_crowd *crowd = cdbm_open_crowd(bytes, size, NULL, 2, CDB_UNKNOWN_ANY, &why);
    double cost;
    if (!crowd) return puts(why), 1;
    cdbm_place_one(crowd, 1, 0.3, 4.5, 3.0);
    for (i = 0; i < 2; i++) {
        cdbm_steer_one(crowd, i, 0.0, i ? -1.3 : 1.3, NAN);
        set_fact(crowd, i, "gait", "Walk"), set_fact(crowd, i, "style", "normal"), set_fact(crowd, i, "Host.mood", i ? "glad" : "cross"), set_fact(crowd, i, "Guest.hand", "free");
    }
    for (i = 0; i < 30; i++)
        if (cdbm_update_crowd(crowd, 1.0 / 30.0, NULL)) return 2;
    if (cdbm_meet_ones(crowd, "no such", both, 2, 1e9) <= 1e9 || cdbm_meet_ones(crowd, "greetings", twice, 2, 1e9) <= 1e9) return 3;
    if (cdbm_meet_ones(crowd, "greetings", others, 2, 1e9) <= 1e9 || cdbm_meet_ones(crowd, "greetings", both, 9, 1e9) <= 1e9) return 4;
    if (!are_refused(crowd)) return 8;
    cost = cdbm_meet_ones(crowd, "greetings", both, 2, 0.0); /* dearer than that: it is not played */
    if (!(cost > 0.0) || crowd->inputs[0].one_off || cdbm_meet_ones(crowd, "greetings", both, 2, cost) != cost) return 5;
    printf("%.17g\n", cost);
    for (i = 0; crowd->inputs[0].one_off && !cdbm_is_over(&crowd->player, crowd->inputs[0].one_off); i++) {
        if (cdbm_update_crowd(crowd, 1.0 / 30.0, NULL)) return 6;
        for (k = 0; k < 2; k++) {
            const double *root = cdbm_crowd_numbers(crowd, k, CDBM_ROOT_NUMBERS);
            printf("%s %.17g %.17g %.17g ", cdbm_crowd_text(crowd, k, CDBM_ASSET_TEXT), root[0], root[1], root[2]);
        }
        puts("");
    }
    if (cdbm_update_crowd(crowd, 1.0 / 30.0, NULL) || crowd->inputs[0].one_off || crowd->inputs[1].one_off) return 7;
    cdbm_close_crowd(crowd);
    CDB_FREE(bytes);
    return 0;
}
