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

static void stairs(void *user, double x, double z, double *ground)
{
    (void)user, (void)x;
    ground[0] = 0.12 * floor(z / 0.5), ground[1] = -0.0, ground[2] = -0.0;
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

/* What a match may be given beside its target, of 11 numbers: how each of three tags counts (0: not), and what it costs; a range whose asset
 * costs more, and how much; whether a third of the frames is left out; the frame that a stitch leads to, and what it may cost. */
typedef struct options {
    cdbm_tags tags;
    const char *lists[3][3];
    cdbm_named_cost costs[2][3], penalty;
    uint8_t *frames;
    double *after;
} options;

static const cdbm_tags *give_tags(const double *numbers, options *own)
{
    size_t counts[6] = {0, 0, 0, 0, 0, 0}, i;
    memset(own, 0, sizeof *own);
    for (i = 0; i < 3; i++) {
        size_t way = (size_t)numbers[i], *n = &counts[way];
        if (way >= 1 && way <= 3) own->lists[way - 1][(*n)++] = events[i];
        if (way < 4) continue;
        own->costs[way - 4][*n].name = events[i], own->costs[way - 4][(*n)++].cost = numbers[3 + i];
    }
    own->tags.include = own->lists[0], own->tags.n_include = counts[1], own->tags.every = own->lists[1], own->tags.n_every = counts[2];
    own->tags.exclude = own->lists[2], own->tags.n_exclude = counts[3], own->tags.prefer = own->costs[0], own->tags.n_prefer = counts[4];
    own->tags.avoid = own->costs[1], own->tags.n_avoid = counts[5];
    return counts[1] + counts[2] + counts[3] + counts[4] + counts[5] > 0 ? &own->tags : NULL;
}

static void give_options(const cdbm_player *player, const double *numbers, cdbm_match *match, options *own)
{
    const cdbm_frames *frames = &player->frames[match->database];
    size_t i;
    match->tags = give_tags(numbers, own);
    own->penalty.cost = numbers[7];
    own->penalty.name = numbers[6] < 0.0 ? NULL : cdbm_text(&player->bundle, CDBM_P_ASSETS, (size_t)player->database_of[match->database], (size_t)numbers[6]);
    if (own->penalty.name) match->penalties = &own->penalty, match->n_penalties = 1;
    own->frames = (uint8_t *)malloc(frames->n_frames + 1), own->after = (double *)malloc((frames->n_features + 1) * sizeof(double));
    if (!own->frames || !own->after) exit(1);
    for (i = 0; i < frames->n_frames; i++) own->frames[i] = i % 3 != 0;
    if (numbers[8] != 0.0) match->frames = own->frames;
    if (numbers[9] >= 0.0) cdbm_features(frames, (int64_t)numbers[9], own->after);
}

/* Enter one-offs: of each who enters, in which database, the target, the two weights and options. Copies are given what their owners have. */
static void enter(const cdbm_player *player, int64_t n_entries, const memory *own, const memory *copies, size_t n)
{
    for (; n_entries > 0; n_entries--) {
        const double *numbers = (const double *)take(8, 18), *state;
        size_t who = (size_t)numbers[0];
        cdbm_input *input = &own->inputs[who];
        cdbm_match match;
        options given;
        int is_done;
        memset(&match, 0, sizeof match);
        match.database = (size_t)numbers[1], match.position_weight = numbers[5], match.rotation_weight = numbers[6];
        memcpy(&match.target, numbers + 2, sizeof match.target);
        give_options(player, numbers + 7, &match, &given);
        state = own->states + who * cdbm_state_width(player);
        is_done = numbers[16] < 0.0 ? cdbm_enter(player, state, input, &match, &own->one_offs[who], own->room)
            : cdbm_stitch(player, state, input, &match, given.after, numbers[17], &own->one_offs[who], own->room);
        if (is_done != 1) exit(10);
        own->are_playing[who] = own->one_offs[who].range >= 0.0;
        free(given.frames);
        free(given.after);
    }
    memcpy(copies->one_offs, own->one_offs, n * sizeof *own->one_offs);
}

/* Let characters choose a clip together: whether they play it, the set, who takes part, what the table is asked (0: nothing, 1: facts, 2: facts with
 * offers for its roles, 3: its rows), how readily roles give way, casts, whether in a match range alone, and tags. Writes what they choose. */
static void meet(const cdbm_player *player, const memory *own, FILE *out)
{
    static const char *const names[] = {"rain", "Host.mood", "Guest.side", "Judge.awake"}, *const roles[] = {"Host", "Guest", "Judge"};
    const double *at_number = (const double *)take(8, (size_t)*(const int64_t *)take(8, 1));
    const cdb_any *any = player->opened[player->n_tables - 1];
    cdbm_actor actors[4];
    cdbm_table_input tables[CDBM_MOST_TABLES], *asked = &tables[player->n_tables - 1];
    cdb_actor offers[12];
    cdb_fact facts[13][4];
    cdbm_together together;
    cdbm_joint_hit hit;
    cdbm_room room;
    options given;
    double *queries = (double *)malloc(4 * sizeof(double) * player->controller.n_features), gives[2], chosen[6];
    int64_t casts[24];
    uint64_t rows;
    size_t who[4], i, k, way;
    int is_played = *at_number++ != 0.0;
    memset(&together, 0, sizeof together), memset(tables, 0, sizeof tables);
    together.set = (size_t)*at_number++, together.n_actors = (size_t)*at_number++, together.actors = actors, together.tables = tables;
    for (i = 0; i < together.n_actors; i++) {
        who[i] = (size_t)*at_number++;
        cdbm_take_part(player, own->states + who[i] * cdbm_state_width(player), queries + i * player->controller.n_features, &actors[i]);
    }
    way = (size_t)*at_number++;
    for (i = 0; i < 13; i++)
        for (k = 0; k < 4; k++) facts[i][k] = cdbi_missing(&any->schema.conditions[k]);
    if (way == 1 || way == 2) {
        facts[0][cdb_condition_number(&any->schema, names[0])].whole = (int64_t)*at_number++;
        asked->facts = facts[0];
    }
    if (way == 1) {
        for (k = 1; k < 4; k++) {
            cdb_fact *fact = &facts[0][cdb_condition_number(&any->schema, names[k])];
            if (k == 2) fact->number = *at_number++;
            else fact->whole = (int64_t)*at_number++;
        }
    } else if (way == 2) {
        asked->n_offers = (size_t)*at_number++, asked->offers = offers;
        for (i = 0; i < asked->n_offers; i++) {
            size_t role = (size_t)*at_number++;
            cdb_fact *fact = &facts[i + 1][cdb_condition_number(&any->schema, names[role + 1])];
            offers[i].role = cdb_role_number(&any->table, roles[role]), offers[i].id = (int64_t)*at_number++, offers[i].cost = cdb_missing_number();
            offers[i].facts = facts[i + 1];
            if (role == 1) fact->number = *at_number++;
            else fact->whole = (int64_t)*at_number++;
        }
    } else if (way == 3) rows = (uint64_t)*at_number++, asked->rows = &rows;
    if (*at_number++ != 0.0) together.gives = gives;
    gives[0] = *at_number++, gives[1] = *at_number++;
    if (*at_number++ != 0.0) together.casts = casts;
    together.n_casts = (size_t)*at_number++;
    for (i = 0; i < 2 * together.n_casts; i++) casts[i] = (int64_t)*at_number++;
    together.in_match_range = *at_number++ != 0.0, together.tags = give_tags(at_number, &given);
    room.left = cdbm_together_room(player, together.set, together.n_actors, asked->n_offers), room.at = (char *)malloc(room.left);
    if (!room.at || !queries || cdbm_choose_together(player, &together, &hit, room) != 1) exit(11);
    chosen[0] = (double)hit.range, chosen[1] = (double)hit.frame, chosen[2] = way == 3 ? -1.0 : (double)hit.row, chosen[3] = hit.cost;
    for (k = 0; k < 2; k++) chosen[4 + k] = hit.range < 0 ? -1.0 : (double)hit.cast[k];
    write_all(out, chosen, sizeof(double), 6);
    for (k = 0; is_played && hit.range >= 0 && k < hit.n_roles; k++) own->one_offs[who[hit.cast[k]]] = hit.one_offs[k], own->are_playing[who[hit.cast[k]]] = 1;
    free(queries);
    free(room.at);
}

/* An update: seconds, the ground (0 flat, 1 a slope, 2 stairs), how many enter a one-off, how often some meet, and for each its goal, the
 * number of its gait, a fact of the one table, the number of an event, -1 for none, and in how many seconds that is to happen. */
static void update(const cdbm_player *player, size_t n, const memory *own, const memory *copies, FILE *out)
{
    double *states = own->states;
    cdbm_pose *poses = own->poses;
    cdbm_input *inputs = own->inputs;
    cdbm_room room = own->room;
    double dt_s = *(const double *)take(8, 1);
    int64_t numbers[2], n_entries, n_meetings;
    const cdb_schema *schema = player->n_tables > 0 ? &player->opened[0]->schema : NULL;
    int gait = schema ? cdb_condition_number(schema, "gait") : -1;
    const cdb_fact **lists = (const cdb_fact **)calloc(n * (player->n_tables + 1), sizeof *lists);
    cdb_fact *facts = (cdb_fact *)calloc(n * 16, sizeof *facts);
    size_t i, k, width = cdbm_state_width(player), n_joints = player->poses.rig.n_joints;
    if (!lists || !facts || (schema && schema->n_conditions > 16)) exit(1);
    memcpy(numbers, take(8, 2), sizeof numbers);
    n_entries = numbers[1], n_meetings = *(const int64_t *)take(8, 1);
    for (i = 0; i < n; i++) {
        memset(&inputs[i], 0, sizeof inputs[i]);
        memcpy(&inputs[i].goal, take(8, 3), sizeof inputs[i].goal);
        inputs[i].ground = numbers[0] == 2 ? stairs : numbers[0] ? slope : NULL;
        for (k = 0; schema && k < schema->n_conditions; k++) facts[16 * i + k] = cdbi_missing(&schema->conditions[k]);
        memcpy(&numbers[1], take(8, 1), 8);
        if (gait >= 0) facts[16 * i + (size_t)gait].whole = numbers[1];
        memcpy(&numbers[1], take(8, 1), 8);
        memcpy(&inputs[i].event_s, take(8, 1), 8);
        if (numbers[1] >= 0) inputs[i].event = events[numbers[1]];
        lists[i * player->n_tables] = facts + 16 * i;
        inputs[i].facts = lists + i * player->n_tables;
    }
    for (; n_meetings > 0; n_meetings--) meet(player, own, out);
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

/* A character meets itself, and plays a part of what it finds. */
static int try_meeting(const cdbm_player *player, const double *state, int tick, cdbm_one_off *to)
{
    static const double ways[3][6] = {{0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, {3.0, 0.0, 0.0, 0.0, 0.0, 0.0}, {4.0, 5.0, 0.0, 1.0, 2.0, 0.0}};
    cdbm_table_input tables[CDBM_MOST_TABLES], *asked = player->n_tables > 0 ? &tables[player->n_tables - 1] : NULL;
    const cdb_any *any = asked ? player->opened[player->n_tables - 1] : NULL;
    cdb_fact *facts = (cdb_fact *)calloc(CDB_MOST_FACTS, sizeof *facts);
    cdb_actor offers[4];
    cdbm_actor actors[2];
    cdbm_together together;
    cdbm_joint_hit hit;
    cdbm_room room;
    options given;
    size_t i;
    int is_done = 0;
    double *queries[2];
    memset(&together, 0, sizeof together), memset(tables, 0, sizeof tables);
    for (i = 0; any && i < any->schema.n_conditions; i++) facts[i] = cdbi_missing(&any->schema.conditions[i]);
    for (i = 0; i < 4; i++) {
        offers[i].id = (int64_t)(i % 2), offers[i].cost = 1.0, offers[i].facts = facts;
        offers[i].role = any ? cdb_role_number(&any->table, i < 2 ? "Host" : "Guest") : -1;
    }
    for (i = 0; i < 2; i++) queries[i] = (double *)calloc(player->controller.n_features + 64, sizeof(double)), cdbm_take_part(player, state, queries[i], &actors[i]);
    actors[1].place[1] += 1.0;
    together.actors = actors, together.n_actors = 2, together.set = (size_t)tick % 2, together.unknown = CDB_UNKNOWN_ANY, together.tags = give_tags(ways[tick % 3], &given);
    if (asked && tick % 4 > 0) together.tables = tables, asked->facts = facts;
    if (asked && tick % 4 > 1) asked->offers = offers, asked->n_offers = 4;
    room.left = cdbm_together_room(player, together.set, 2, 4), room.at = (char *)malloc(room.left);
    for (i = 0; i < CDBM_MOST_DATABASES; i++)
        if (player->joints[i].joint.n_features > player->controller.n_features + 64) exit(1);
    if (facts && room.at && cdbm_choose_together(player, &together, &hit, room) == 1 && hit.range >= 0) *to = hit.one_offs[tick % 2], is_done = 1;
    for (i = 0; i < 2; i++) free(queries[i]);
    free(room.at);
    free(facts);
    return is_done;
}

static void try_out(const cdbm_player *player, double *state, cdbm_pose *pose, cdbm_room room, uint64_t *seed)
{
    cdbm_input input;
    uint8_t packet[CDBM_MOST_PACKET];
    static const double ways[5][11] = {{0}, {3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, -1.0, 0.0}, {4.0, 5.0, 0.0, 1.0, 2.0, 0.0, -1.0, 0.0, 1.0, 0.0, 3.0},
        {1.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.5, 0.0, -1.0, 0.0}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 9.0}};
    cdbm_match match = {0, {0.5, 2.0, 0.3}, 1.0, 1.0, NULL, NULL, NULL, 0, NULL}, tried;
    options given;
    cdbm_one_off one_off;
    const double *way;
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
            tried = match, way = ways[drawn(seed) % 5];
            give_options(player, way, &tried, &given);
            input.one_off = (way[9] < 0.0 ? cdbm_enter(player, state, &input, &tried, &one_off, room)
                : cdbm_stitch(player, state, &input, &tried, given.after, way[10], &one_off, room)) == 1 && one_off.range >= 0.0 ? &one_off : NULL;
            free(given.frames);
            free(given.after);
        }
        if ((tick == 5 || tick == 20 || tick == 35) && try_meeting(player, state, (int)(drawn(seed) % 12), &one_off)) input.one_off = &one_off;
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
