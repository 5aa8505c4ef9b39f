/* A game that publishes poses: posing GAME FRAMES. It prints its name, and ends after so many frames with a listener. */

#include "cdb_link.h"
#include <math.h>

static cdbl_link link_of_game;

int main(int n, char **given)
{
    static const char *const names[] = {"Hips", "Head"};
    static const int64_t parents[] = {-1, 0};
    double root[3] = {0.0, 1.5, -0.25}, rotations[8] = {1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5}, translations[6] = {0.0, 0.9, 0.0, 0.0, 0.7, 1.0 / 3.0};
    cdbl_bones bones = {names, parents, 2, 0};
    int i = 0;
    if (n != 3 || !cdbl_open(&link_of_game, given[1])) return 2;
    printf("%s\n", link_of_game.game);
    fflush(stdout);
    while (i < atoi(given[2])) {
        struct timespec rest = {0, 2000000};
        nanosleep(&rest, NULL);
        if (cdbl_listeners(&link_of_game) == 0) continue;
        root[0] = i++;
        rotations[4] = i == 3 ? NAN : 0.5;
        cdbl_pose(&link_of_game, "player", &bones, i > 1 ? "walk" : NULL, root, rotations, translations);
    }
    cdbl_close(&link_of_game);
    return 0;
}
