/* character BUNDLE IN OUT   characters of the first controller, by what a file gives in each update: their states and poses.
 * character BUNDLE          whether it is opened; why it is not is printed. Then some updates with whatever is in it. */
#include <stdio.h>
#include <stdlib.h>
#include "contextdb_motion.h"

static const char *at;

static const void *take(size_t size, size_t n)
{
    const void *taken = at;
    at += (size * n + 7) / 8 * 8;
    return taken;
}

static char *read_all(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    char *bytes = NULL;
    long length;
    if (file && fseek(file, 0, SEEK_END) == 0 && (length = ftell(file)) >= 0 && fseek(file, 0, SEEK_SET) == 0) {
        *size = (size_t)length;
        bytes = (char *)malloc(*size + 16);
        if (bytes && fread(bytes, 1, *size, file) != *size) exit(1);
    }
    if (file) fclose(file);
    if (!bytes) exit(1);
    return bytes;
}

static void slope(void *user, double x, double z, double *ground)
{
    (void)user, (void)x;
    ground[0] = 0.2 * z, ground[1] = -0.0, ground[2] = 0.2;
}

static void write_all(FILE *out, const void *items, size_t size, size_t n)
{
    if (fwrite(items, size, n, out) != n) exit(2);
}

/* An update: seconds, whether there is a ground, and for each its goal, and the words of the rows of a table. */
static void update(const cdbm_player *player, size_t n, double *states, cdbm_pose *poses, cdbm_input *inputs, cdbm_room room, FILE *out)
{
    double dt_s = *(const double *)take(8, 1);
    int64_t numbers[2];
    const uint64_t **rows = (const uint64_t **)calloc(2 * n + 1, sizeof *rows);
    size_t i, width = cdbm_state_width(player), n_joints = player->poses.rig.n_joints;
    memcpy(numbers, take(8, 2), sizeof numbers);
    for (i = 0; i < n; i++) {
        memset(&inputs[i], 0, sizeof inputs[i]);
        memcpy(&inputs[i].goal, take(8, 3), sizeof inputs[i].goal);
        if (numbers[0]) inputs[i].ground = slope;
        rows[2 * i] = (const uint64_t *)take(8, (size_t)numbers[1]), rows[2 * i + 1] = (const uint64_t *)take(8, (size_t)numbers[1]);
        if (numbers[1]) inputs[i].rows = rows + 2 * i, inputs[i].mirrored = rows + 2 * i + 1;
    }
    if (cdbm_update_all(player, n, states, dt_s, inputs, poses, room) != 1) exit(5);
    write_all(out, states, sizeof(double), n * width);
    for (i = 0; i < n; i++) {
        write_all(out, &poses[i].decision, sizeof(cdbm_decision), 1);
        write_all(out, poses[i].root, sizeof(double), 3);
        write_all(out, poses[i].rotations, sizeof(double), 10 * n_joints);
    }
    free(rows);
}

static void try_out(const cdbm_player *player, double *state, cdbm_pose *pose, cdbm_room room)
{
    cdbm_input input;
    float *matrices = (float *)malloc(16 * sizeof(float) * player->poses.rig.n_joints + 1);
    int tick;
    memset(&input, 0, sizeof input);
    input.goal.facing = NAN;
    for (tick = 0; tick < 40; tick++) {
        input.goal.velocity[1] = tick < 20 ? 1.2 : -2.0;
        if (tick > 10) input.ground = slope;
        if (cdbm_update(player, state, 1.0 / 30.0, &input, pose, room) != 1) break;
        if (!cdbm_asset(player, &pose->decision.playing) && pose->decision.playing.database >= 0.0) break;
        if (player->has_poses) cdbm_matrices(player, pose, matrices);
    }
    free(matrices);
}

int main(int n_words, char **words)
{
    size_t size, n = 1, i;
    char *bytes = read_all(words[1], &size);
    cdbm_player *player = (cdbm_player *)malloc(sizeof *player);
    cdbm_bundle bundle;
    cdbm_room room;
    const char *why = cdbm_open_bundle(&bundle, bytes, size);
    char *room_at, *input = NULL;
    double *states;
    cdbm_pose *poses;
    cdbm_input *inputs;
    char *memory;
    if (!player) return 1;
    if (!why) why = cdbm_open_player(player, &bundle, NULL);
    if (why) {
        puts(why);
        free(player);
        free(bytes);
        return 0;
    }
    if (n_words == 4) {
        input = read_all(words[2], &size);
        at = input;
        n = (size_t)*(const int64_t *)take(8, 1);
        if (!cdbm_has_digest(&bundle)) return 6;
    }
    room.left = cdbm_room_size(player, n);
    room.at = room_at = (char *)malloc(room.left);
    states = (double *)malloc(n * cdbm_state_size(player));
    poses = (cdbm_pose *)malloc(n * sizeof *poses);
    inputs = (cdbm_input *)malloc(n * sizeof *inputs);
    memory = (char *)malloc(n * cdbm_pose_size(player));
    if (!room.at || !states || !poses || !inputs || !memory) return 1;
    for (i = 0; i < n; i++) {
        cdbm_lay_out(player, &poses[i], memory + i * cdbm_pose_size(player));
        cdbm_begin(player, states + i * cdbm_state_width(player), 0.0, 0.0, 0.0);
        if (!cdbm_is_state(player, states + i * cdbm_state_width(player))) return 7;
    }
    if (n_words == 4) {
        FILE *out = fopen(words[3], "wb");
        int64_t n_ticks = *(const int64_t *)take(8, 1), tick;
        if (!out) return 1;
        for (tick = 0; tick < n_ticks; tick++) update(player, n, states, poses, inputs, room, out);
        fclose(out);
    } else try_out(player, states, poses, room);
    free(memory);
    free(inputs);
    free(poses);
    free(states);
    free(room_at);
    cdbm_close_player(player);
    free(player);
    free(input);
    free(bytes);
    return 0;
}
