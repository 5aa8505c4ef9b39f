/* poses functions IN OUT   sine, cosine, arctangent, arccosine, exponential, remainder and logarithm of pairs of numbers
 * poses play IN OUT        all that the updates of a crowd write, on a slope; see test_same_bits.py for the file */
#include <stdio.h>
#include <stdlib.h>
#include "poses.h"

static char *at;

static void *take(size_t size, size_t n)
{
    void *taken = at;
    at += (size * n + 7) / 8 * 8;
    return taken;
}

static int64_t whole(void)
{
    return *(int64_t *)take(8, 1);
}

static void write_all(FILE *out, const void *items, size_t size, size_t n)
{
    if (fwrite(items, size, n, out) != n) exit(2);
}

static void functions(FILE *out)
{
    size_t n = (size_t)whole(), i;
    const double *pairs = (const double *)take(8, 2 * n);
    for (i = 0; i < n; i++) {
        double x = pairs[2 * i], y = pairs[2 * i + 1], made[7];
        cdbo_sin_cos(x, &made[0], &made[1]);
        made[2] = cdbo_atan2(y, x), made[3] = cdbo_acos(cdbo_within(y, -1.0, 1.0)), made[4] = cdbo_exp(y), made[5] = cdbo_remainder(x);
        made[6] = y > 1e-300 ? cdbo_log(y) : 0.0;
        write_all(out, made, sizeof(double), 7);
    }
}

static void read_settings(double *settings)
{
    int64_t n = whole(), i;
    for (i = 0; i < n; i++) {
        const char *name = (const char *)take(1, 32);
        double value = *(double *)take(8, 1);
        size_t stage, k;
        for (stage = 0; stage < CDBO_COUNT(CDBO_STAGES); stage++)
            for (k = 0; k < CDBO_STAGES[stage]->n_settings; k++)
                if (strcmp(CDBO_STAGES[stage]->settings[k].name, name) == 0) settings[CDBO_STAGES[stage]->settings[k].setting] = value;
    }
}

static void read_rig(cdbo_rig *rig)
{
    rig->n_joints = (size_t)whole(), rig->n_moving = (size_t)whole(), rig->n_feet = (size_t)whole(), rig->n_tops = (size_t)whole();
    rig->n_spine = (size_t)whole();
    rig->parents = (const int64_t *)take(8, rig->n_joints), rig->offsets = (const double *)take(8, 3 * rig->n_joints);
    rig->places = (const int64_t *)take(8, rig->n_joints), rig->legs = (const int64_t *)take(8, 4 * rig->n_feet);
    rig->hinges = (const double *)take(8, 3 * rig->n_feet), rig->tops = (const int64_t *)take(8, rig->n_tops);
    rig->spine = (const int64_t *)take(8, rig->n_spine), rig->left = (const double *)take(8, rig->n_spine);
    rig->most_accel = *(const double *)take(8, 1);
}

static void read_frames(cdbo_frames *of, const cdbo_rig *rig)
{
    size_t n;
    of->n_joints = rig->n_joints, of->n_moving = rig->n_moving, of->n_feet = rig->n_feet;
    n = of->n_frames = (size_t)whole(), of->n_ranges = (size_t)whole();
    of->rotations = (const float *)take(4, 4 * n * rig->n_joints), of->positions = (const float *)take(4, 3 * n * rig->n_moving);
    of->root = (const float *)take(4, 3 * n), of->ways = (const double *)take(8, 6 * n);
    of->contacts = (const unsigned char *)take(1, n * rig->n_feet), of->steps = (const double *)take(8, 3 * n * rig->n_feet);
    of->starts = (const int64_t *)take(8, of->n_ranges), of->n_steps = (const int64_t *)take(8, of->n_ranges);
    of->looping = (const unsigned char *)take(1, of->n_ranges), of->rate = *(const double *)take(8, 1);
}

/* One character in one update; the ground rises by 0.2 along z. */
static void update(cdbo_posed *one, const cdbo_seam *seams, double dt_s, double *room)
{
    size_t n_feet = one->poses->rig.n_feet, foot;
    double points[16], below[24];
    cdbo_pose_one(one, seams, dt_s, room, CDBO_UP_TO_GROUND);
    cdbo_ask_points(one, points);
    for (foot = 0; foot < n_feet; foot++)
        below[3 * foot] = 0.2 * points[2 * foot + 1], below[3 * foot + 1] = -0.0, below[3 * foot + 2] = 0.2;
    one->below = below;
    cdbo_pose_one(one, seams, dt_s, room, CDBO_FROM_GROUND);
}

static void play(FILE *out)
{
    cdbo_poses poses;
    cdbo_frames frames;
    const cdbo_frames *banks[1];
    int64_t n_ticks, tick;
    size_t n_joints;
    double *before, *row, *room, *rotations, *translations, *positions;
    memset(&poses, 0, sizeof poses);
    memset(&frames, 0, sizeof frames);
    banks[0] = &frames;
    read_settings(poses.settings);
    read_rig(&poses.rig);
    read_frames(&frames, &poses.rig);
    poses.banks = banks, poses.n_banks = 1;
    if (poses.rig.n_feet > 8 || !cdbo_are_frames(&frames) || !cdbo_poses_open(&poses)) exit(3);
    n_joints = poses.rig.n_joints;
    before = (double *)malloc(sizeof(double) * (2 * poses.width + cdbo_pose_room(&poses) + 10 * n_joints));
    if (!before) exit(4);
    row = before + poses.width, room = row + poses.width, rotations = room + cdbo_pose_room(&poses);
    translations = rotations + 4 * n_joints, positions = translations + 3 * n_joints;
    cdbo_poses_begin(&poses, before);
    n_ticks = whole();
    for (tick = 0; tick < n_ticks; tick++) {
        double dt_s = *(const double *)take(8, 1), root[3];
        size_t n_seams = (size_t)whole();
        unsigned char contacts[8] = {0};
        cdbo_posed one;
        memset(&one, 0, sizeof one);
        one.poses = &poses, one.before = before, one.row = row, one.root = root, one.rotations = rotations;
        one.translations = translations, one.positions = positions, one.contacts = contacts;
        one.given = (const cdbo_given *)take(8, sizeof(cdbo_given) / 8);
        one.place = (const double *)take(8, 3);
        update(&one, (const cdbo_seam *)take(8, 4 * n_seams), dt_s, room);
        write_all(out, row, sizeof(double), poses.width);
        write_all(out, root, sizeof(double), 3);
        write_all(out, rotations, sizeof(double), 10 * n_joints);
        memcpy(before, row, poses.width * sizeof(double));
    }
    free(before);
}

int main(int n, char **words)
{
    FILE *in = n == 4 ? fopen(words[2], "rb") : NULL, *out = n == 4 ? fopen(words[3], "wb") : NULL;
    char *bytes;
    long size;
    if (!in || !out || fseek(in, 0, SEEK_END) != 0 || (size = ftell(in)) < 0 || fseek(in, 0, SEEK_SET) != 0) return 1;
    bytes = at = (char *)malloc((size_t)size + 8);
    if (!bytes || fread(bytes, 1, (size_t)size, in) != (size_t)size) return 1;
    if (strcmp(words[1], "functions") == 0) functions(out);
    else play(out);
    free(bytes);
    return fclose(in) != 0 || fclose(out) != 0;
}
