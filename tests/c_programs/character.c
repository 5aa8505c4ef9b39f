/* character BUNDLE IN OUT   characters of the first controller, by what a file gives in each update: their states and poses, and what
 *                           they pack. Copies of them that are given this alone must play the same.
 * character BUNDLE N        N times opened with something damaged; what is not refused is played. Prints how often it was refused. */
#include <stdio.h>
#include <stdlib.h>
#include "contextdb_motion.h"

static const char *at;
static const char *const events[] = {"Contact.Left", "Contact.Right", "Hit"};

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

typedef struct memory {
    double *states;
    cdbm_pose *poses;
    cdbm_input *inputs;
    char *of_poses;
    cdbm_one_off *one_offs;
    int *are_playing;
    cdbm_room room;
} memory;

/* Let copies play what these pack, with the bodies where they have them. */
static void follow(const cdbm_player *player, size_t n, double dt_s, const memory *own, const memory *copies, FILE *out)
{
    size_t i, width = cdbm_state_width(player), n_joints = player->poses.rig.n_joints;
    uint8_t *packets = (uint8_t *)malloc(n * CDBM_MOST_PACKET);
    if (!packets) exit(1);
    for (i = 0; i < n; i++) {
        uint8_t *packet = packets + i * CDBM_MOST_PACKET, n_bytes = (uint8_t)cdbm_pack(player, own->states + i * width, packet);
        copies->inputs[i] = own->inputs[i];
        if (own->inputs[i].one_off) copies->inputs[i].one_off = &copies->one_offs[i];
        copies->inputs[i].facts = NULL, copies->inputs[i].is_copy = 1, copies->inputs[i].packet = packet, copies->inputs[i].n_packet = n_bytes;
        if (!cdbm_moves_body(player, &own->poses[i].decision))
            copies->inputs[i].body = (const cdbo_body *)(const void *)(own->states + i * width);
        write_all(out, &n_bytes, 1, 1);
        write_all(out, packet, 1, n_bytes);
    }
    if (cdbm_update_all(player, n, copies->states, dt_s, copies->inputs, copies->poses, copies->room) != 1) exit(8);
    for (i = 0; i < n; i++)
        if (memcmp(copies->poses[i].rotations, own->poses[i].rotations, 10 * n_joints * sizeof(double)) != 0) exit(9);
    free(packets);
}

/* Enter one-offs: of each who enters, in which database, the target and the two weights. Copies are given what their owners have. */
static void enter(const cdbm_player *player, int64_t n_entries, const memory *own, const memory *copies, size_t n)
{
    for (; n_entries > 0; n_entries--) {
        const double *numbers = (const double *)take(8, 7);
        size_t who = (size_t)numbers[0];
        cdbm_match match = {0, {0.0, 0.0, 0.0}, 0.0, 0.0, NULL};
        match.database = (size_t)numbers[1], match.position_weight = numbers[5], match.rotation_weight = numbers[6];
        memcpy(&match.target, numbers + 2, sizeof match.target);
        if (cdbm_enter(player, own->states + who * cdbm_state_width(player), &own->inputs[who], &match, &own->one_offs[who], own->room) != 1) exit(10);
        own->are_playing[who] = own->one_offs[who].range >= 0.0;
    }
    memcpy(copies->one_offs, own->one_offs, n * sizeof *own->one_offs);
}

/* An update: seconds, whether there is a ground, how many enter a one-off, and for each its goal, the number of its gait, a fact of the
 * one table, the number of an event, -1 for none, and in how many seconds that is to happen. */
static void update(const cdbm_player *player, size_t n, const memory *own, const memory *copies, FILE *out)
{
    double *states = own->states;
    cdbm_pose *poses = own->poses;
    cdbm_input *inputs = own->inputs;
    cdbm_room room = own->room;
    double dt_s = *(const double *)take(8, 1);
    int64_t numbers[2], n_entries;
    const cdb_schema *schema = player->n_tables > 0 ? &player->opened[0]->schema : NULL;
    int gait = schema ? cdb_condition_number(schema, "gait") : -1;
    const cdb_fact **lists = (const cdb_fact **)calloc(n, sizeof *lists);
    cdb_fact *facts = (cdb_fact *)calloc(n * 16, sizeof *facts);
    size_t i, k, width = cdbm_state_width(player), n_joints = player->poses.rig.n_joints;
    if (!lists || !facts || (schema && schema->n_conditions > 16)) exit(1);
    memcpy(numbers, take(8, 2), sizeof numbers);
    n_entries = numbers[1];
    for (i = 0; i < n; i++) {
        memset(&inputs[i], 0, sizeof inputs[i]);
        memcpy(&inputs[i].goal, take(8, 3), sizeof inputs[i].goal);
        if (numbers[0]) inputs[i].ground = slope;
        for (k = 0; schema && k < schema->n_conditions; k++) facts[16 * i + k] = cdbi_missing(&schema->conditions[k]);
        memcpy(&numbers[1], take(8, 1), 8);
        if (gait >= 0) facts[16 * i + (size_t)gait].whole = numbers[1];
        memcpy(&numbers[1], take(8, 1), 8);
        memcpy(&inputs[i].event_s, take(8, 1), 8);
        if (numbers[1] >= 0) inputs[i].event = events[numbers[1]];
        lists[i] = facts + 16 * i;
        inputs[i].facts = lists + i;
    }
    enter(player, n_entries, own, copies, n);
    for (i = 0; i < n; i++)
        if (own->are_playing[i]) inputs[i].one_off = &own->one_offs[i];
    if (cdbm_update_all(player, n, states, dt_s, inputs, poses, room) != 1) exit(5);
    write_all(out, states, sizeof(double), n * width);
    for (i = 0; i < n; i++) {
        write_all(out, &poses[i].decision, sizeof(cdbm_decision), 1);
        write_all(out, poses[i].root, sizeof(double), 3);
        write_all(out, poses[i].rotations, sizeof(double), 10 * n_joints);
    }
    follow(player, n, dt_s, own, copies, out);
    for (i = 0; i < n; i++)
        if (own->are_playing[i]) own->are_playing[i] = !cdbm_is_over(player, &own->one_offs[i]);
    free(lists);
    free(facts);
}

static uint64_t drawn(uint64_t *seed)
{
    uint64_t z = *seed += 0x9E3779B97F4A7C15;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
}

static void try_out(const cdbm_player *player, double *state, cdbm_pose *pose, cdbm_room room, uint64_t *seed)
{
    cdbm_input input;
    uint8_t packet[CDBM_MOST_PACKET];
    cdbm_match match = {0, {0.5, 2.0, 0.3}, 1.0, 1.0, NULL};
    cdbm_one_off one_off;
    float *matrices = (float *)malloc(16 * sizeof(float) * player->poses.rig.n_joints + 1);
    int tick;
    memset(&input, 0, sizeof input);
    input.goal.facing = NAN;
    input.unknown = CDB_UNKNOWN_ANY;
    for (tick = 0; tick < 40; tick++) {
        input.goal.velocity[1] = tick < 20 ? 1.2 : -2.0;
        if (tick > 10) input.ground = slope;
        if (tick == 15 || tick == 25) {
            match.target.ahead = tick, match.database = drawn(seed) % player->controller.n_databases;
            input.one_off = cdbm_enter(player, state, &input, &match, &one_off, room) == 1 && one_off.range >= 0.0 ? &one_off : NULL;
        }
        if (input.one_off && cdbm_is_over(player, input.one_off)) input.one_off = NULL;
        input.n_packet = cdbm_pack(player, state, packet), input.packet = packet;
        if (input.n_packet > 0 && tick % 2) packet[drawn(seed) % input.n_packet] = (uint8_t)drawn(seed);
        input.is_copy = tick > 30;
        input.event = tick % 7 > 3 ? events[tick % 2] : NULL, input.event_s = 0.3;
        if (cdbm_update(player, state, 1.0 / 30.0, &input, pose, room) != 1 && !input.is_copy) break;
        if (!cdbm_asset(player, &pose->decision.playing) && pose->decision.playing.database >= 0.0) break;
        if (player->has_poses) cdbm_matrices(player, pose, matrices);
    }
    free(matrices);
}

static memory taken(const cdbm_player *player, size_t n)
{
    memory own;
    size_t i;
    own.room.left = cdbm_room_size(player, n);
    if (cdbm_enter_room(player) > own.room.left) own.room.left = cdbm_enter_room(player);
    own.one_offs = (cdbm_one_off *)calloc(n, sizeof *own.one_offs);
    own.are_playing = (int *)calloc(n, sizeof *own.are_playing);
    own.room.at = (char *)malloc(own.room.left);
    own.states = (double *)malloc(n * cdbm_state_size(player));
    own.poses = (cdbm_pose *)malloc(n * sizeof *own.poses);
    own.inputs = (cdbm_input *)malloc(n * sizeof *own.inputs);
    own.of_poses = (char *)malloc(n * cdbm_pose_size(player));
    if (!own.room.at || !own.states || !own.poses || !own.inputs || !own.of_poses || !own.one_offs || !own.are_playing) exit(1);
    for (i = 0; i < n; i++) {
        cdbm_lay_out(player, &own.poses[i], own.of_poses + i * cdbm_pose_size(player));
        cdbm_begin(player, own.states + i * cdbm_state_width(player), 0.0, 0.0, 0.0);
        if (!cdbm_is_state(player, own.states + i * cdbm_state_width(player))) exit(7);
    }
    return own;
}

static void give_back(memory *own)
{
    free(own->of_poses);
    free(own->one_offs);
    free(own->are_playing);
    free(own->inputs);
    free(own->poses);
    free(own->states);
    free(own->room.at);
}

static void play(const cdbm_player *player, const char *from, const char *to)
{
    size_t size, n, i;
    char *input = read_all(from, &size);
    FILE *out = fopen(to, "wb");
    int64_t n_ticks, tick;
    memory own, copies;
    at = input;
    n = (size_t)*(const int64_t *)take(8, 1), n_ticks = *(const int64_t *)take(8, 1);
    own = taken(player, n), copies = taken(player, n);
    for (i = 0; i < n; i++) cdbm_seed(player, own.states + i * cdbm_state_width(player), *(const uint64_t *)take(8, 1));
    if (!out || !cdbm_has_digest(&player->bundle)) exit(6);
    for (tick = 0; tick < n_ticks; tick++) update(player, n, &own, &copies, out);
    fclose(out);
    give_back(&own);
    give_back(&copies);
    free(input);
}

/* Write other numbers into some places, as often into the directory and into small parts as into the large ones. */
static void damage(unsigned char *bytes, size_t size, uint64_t *seed)
{
    static const int64_t odd[] = {-1, 0, 1, 255, INT64_MAX, INT64_MIN, 1 << 20};
    cdbm_bundle bundle;
    size_t n = 1 + (size_t)(drawn(seed) % 3), at_byte;
    cdbm_open_bundle(&bundle, bytes, size);
    for (; n > 0; n--) {
        if (drawn(seed) % 4 == 0 || bundle.n_parts == 0) at_byte = (size_t)(drawn(seed) % (64 + 24 * (bundle.n_parts + 1)));
        else {
            const cdbm_part_entry *part = &bundle.parts[drawn(seed) % bundle.n_parts];
            if (part->n_bytes == 0) continue;
            at_byte = (size_t)(part->at + drawn(seed) % part->n_bytes);
        }
        if (at_byte > size - 8 || drawn(seed) % 2) /* what says where a part is may be damaged by now */
            bytes[at_byte % size] = (unsigned char)drawn(seed);
        else memcpy(bytes + at_byte / 8 * 8, &odd[drawn(seed) % 7], 8);
    }
}

static void try_damaged(const char *bytes, size_t size, long n_times)
{
    unsigned char *copy;
    cdbm_player *player = (cdbm_player *)malloc(sizeof *player);
    cdbm_bundle bundle;
    uint64_t seed = (uint64_t)n_times;
    long n_refused = 0, i;
    for (i = 0; player && i < n_times; i++) {
        size_t own_size = drawn(&seed) % 10 ? size : (size_t)(drawn(&seed) % size);
        const char *why;
        copy = (unsigned char *)malloc(own_size + 1);
        if (!copy) exit(1);
        memcpy(copy, bytes, own_size);
        if (own_size == size) damage(copy, size, &seed);
        why = cdbm_open_bundle(&bundle, copy, own_size);
        if (!why) why = cdbm_open_player(player, &bundle, NULL);
        if (!why) {
            memory own = taken(player, 1);
            try_out(player, own.states, own.poses, own.room, &seed);
            give_back(&own);
            cdbm_close_player(player);
        } else n_refused++;
        free(copy);
    }
    printf("%ld\n", n_refused);
    free(player);
}

int main(int n_words, char **words)
{
    size_t size;
    char *bytes = read_all(words[1], &size);
    cdbm_player *player = (cdbm_player *)malloc(sizeof *player);
    cdbm_bundle bundle;
    if (!player) return 1;
    if (n_words == 3) try_damaged(bytes, size, atol(words[2]));
    else {
        const char *why = cdbm_open_bundle(&bundle, bytes, size);
        if (!why) why = cdbm_open_player(player, &bundle, NULL);
        if (why) puts(why);
        else {
            play(player, words[2], words[3]);
            cdbm_close_player(player);
        }
    }
    free(player);
    free(bytes);
    return 0;
}
