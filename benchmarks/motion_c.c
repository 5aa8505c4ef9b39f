/* motion_c BUNDLE N TICKS   what opening a bundle, an update of one character and one of N at once take, in microseconds. */
#define _POSIX_C_SOURCE 200809L
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include "contextdb_motion.h"

static double now_us(void)
{
    return (double)clock() / CLOCKS_PER_SEC * 1e6; /* of this process alone */
}

static void slope(void *user, double x, double z, double *ground)
{
    (void)user, (void)x;
    ground[0] = 0.1 * z, ground[1] = 0.0, ground[2] = 0.1;
}

static void run(const cdbm_player *player, size_t n, int n_ticks)
{
    cdbm_room room;
    double *states = (double *)malloc(n * cdbm_state_size(player)), began;
    cdbm_pose *poses = (cdbm_pose *)malloc(n * sizeof *poses);
    cdbm_input *inputs = (cdbm_input *)calloc(n, sizeof *inputs);
    char *memory = (char *)malloc(n * cdbm_pose_size(player));
    size_t i;
    int tick;
    room.left = cdbm_room_size(player, n), room.at = (char *)malloc(room.left);
    if (!states || !poses || !inputs || !memory || !room.at) exit(1);
    for (i = 0; i < n; i++) {
        cdbm_lay_out(player, &poses[i], memory + i * cdbm_pose_size(player));
        cdbm_begin(player, states + i * cdbm_state_width(player), 0.0, 0.0, (double)i);
        inputs[i].goal.facing = NAN, inputs[i].ground = slope, inputs[i].unknown = CDB_UNKNOWN_ANY;
    }
    for (began = now_us(), tick = 0; tick < n_ticks; tick++) {
        for (i = 0; i < n; i++) cdbo_sin_cos(0.02 * tick + (double)i, &inputs[i].goal.velocity[0], &inputs[i].goal.velocity[1]);
        if (cdbm_update_all(player, n, states, 1.0 / 60.0, inputs, poses, room) != 1) exit(1);
    }
    printf("an update of %zu: %.2f us each\n", n, (now_us() - began) / n_ticks / (double)n);
    free(room.at), free(memory), free(inputs), free(poses), free(states);
}

int main(int n_words, char **words)
{
    static cdbm_player player;
    cdbm_bundle bundle;
    struct stat file;
    void *bytes;
    size_t n_frames = 0, i;
    double began;
    const char *why;
    int handle = n_words == 4 ? open(words[1], O_RDONLY) : -1;
    if (handle < 0 || fstat(handle, &file) != 0) return 1;
    began = now_us();
    bytes = mmap(NULL, (size_t)file.st_size, PROT_READ, MAP_PRIVATE, handle, 0);
    if (bytes == MAP_FAILED) return 1;
    why = cdbm_open_bundle(&bundle, bytes, (size_t)file.st_size);
    if (!why) why = cdbm_open_player(&player, &bundle, NULL);
    if (why) return puts(why), 1;
    began = now_us() - began;
    for (i = 0; i < player.controller.n_databases; i++) n_frames += player.frames[i].n_frames;
    printf("mapped and opened in %.0f us: %zu frames in %zu databases, %.1f MB; a character is %zu bytes, its pose %zu\n", began, n_frames,
        player.controller.n_databases, (double)file.st_size / 1e6, cdbm_state_size(&player), cdbm_pose_size(&player));
    run(&player, 1, atoi(words[3]));
    run(&player, (size_t)atoi(words[2]), atoi(words[3]) / 100 + 1);
    cdbm_close_player(&player);
    munmap(bytes, (size_t)file.st_size);
    close(handle);
    return 0;
}
