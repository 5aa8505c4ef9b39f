/* ---- Characters of a bundle, for games.
 *
 *   cdbm_open_player      a controller of a bundle: what its characters share, checked; never changed, so threads may share it
 *   cdbm_state_size, cdbm_pose_size, cdbm_room_size   how much memory a character, a pose and a call take
 *   cdbm_begin            a character that has not done anything yet
 *   cdbm_update           body, path, search and pose, some time later
 *   cdbm_update_all       a crowd: each database is searched once for all
 *
 * A character is one flat block of numbers without an address in it: copied, it is another one that stands where the first does; put
 * back, it goes on from there. Equal blocks have equal futures, on every machine. Only opening takes memory (CDB_MALLOC); a call
 * works in room that it is given, which only one call uses at a time.
 *
 * A game gives the facts of each table, or its valid rows. A fact that is missing and that the character knows itself (its speed, the
 * direction of its stick, its turn, and those of what plays) it adds. */

#define CDBM_MOST_DATABASES 64
#define CDBM_MOST_TABLES 16
#define CDBM_MOST_RECENT 1000       /* so many assets may be remembered */
#define CDBM_MOST_BELOW 16          /* so many feet may feel a ground */

typedef struct cdbm_player {
    cdbm_controller controller;
    cdbm_clips clips[CDBM_MOST_DATABASES];
    cdbm_frames frames[CDBM_MOST_DATABASES];
    cdbm_table_ranges tables[CDBM_MOST_DATABASES]; /* the rows that name the ranges of each database, where it has a table */
    int64_t table_of[CDBM_MOST_DATABASES], bank_of[CDBM_MOST_DATABASES], database_of[CDBM_MOST_DATABASES]; /* in the bundle; -1: none */
    cdbm_events events[CDBM_MOST_DATABASES];
    const int64_t *pose_ranges[CDBM_MOST_DATABASES]; /* [R] the range of poses of each range */
    const double *warps[CDBM_MOST_DATABASES], *ends[CDBM_MOST_DATABASES]; /* [R, 2, 2] and [N, 3], for match nodes; or NULL */
    cdbm_tag_list tags[CDBM_MOST_DATABASES];
    cdbm_joint_clips joints[CDBM_MOST_DATABASES]; /* of databases behind those of the controller, which it does not search */
    cdbm_ways ways;
    cdbo_poses poses;
    cdbo_frames banks[CDBM_MOST_DATABASES];
    const cdbo_frames *bank_list[CDBM_MOST_DATABASES];
    const double *range_biases, *kind_biases;
    const uint8_t *allowed, *playable;
    size_t n_databases, n_ranges, n_kinds, n_frames; /* n_databases: with those that the controller does not search */
    double velocity_halflife_s, heading_halflife_s;
    int has_poses, has_costs;
    cdb_any *opened[CDBM_MOST_TABLES];
    cdb_row_play *plays;            /* of the rows of all tables, one after the other; NULL where none says */
    int64_t plays_at[CDBM_MOST_TABLES]; /* where those of each table begin; -1 where it says nothing */
    size_t n_tables, n_most_rows, n_longest; /* the longest range that a match node may enter */
    cdbm_bundle bundle;
    size_t number;                  /* of the controller */
} cdbm_player;

/* The ground at a place: its height, and by how much it rises along x and z. */
typedef void (*cdbm_ground)(void *user, double x, double z, double *ground);

typedef struct cdbm_input {
    cdbo_goal goal;                 /* the velocity that the stick asks for, m/s, and the heading, NaN: where the body goes */
    const cdbo_body *body;          /* where a game that moves bodies itself has this one now; or NULL */
    const double *positions, *headings; /* the path that a game plans, from now on, [n_path, 2] and [n_path]; or NULL */
    size_t n_path;
    double path_rate;
    const cdb_fact *const *facts;   /* of each table of the bundle the facts in the order of its schema, NULL: none is known; or NULL */
    cdb_unknown unknown;            /* what a missing fact does */
    cdb_fault *fault;               /* which fact was refused; or NULL */
    const uint64_t *const *rows;    /* in place of facts the valid rows of each table, NULL: all are valid; or NULL */
    const uint64_t *const *mirrored; /* and those with the facts as a mirror shows them; NULL: the same */
    cdbm_ground ground;             /* or NULL, where all is flat */
    void *user;                     /* what the ground is asked with */
    int force, interrupt;           /* search now; and leave what plays */
    const char *event;              /* a tag of the markup, "Contact.Left" and "Contact.Right" too, that is to begin; or NULL */
    double event_s;                 /* in so many seconds, 0 or more: to be given in each update until then */
    int is_copy;                    /* it plays what its owner does, on another machine: it neither asks tables nor searches */
    cdbm_one_off *one_off;          /* what it plays in place of that, and is moved by, see match.h; or NULL */
    const uint8_t *packet;          /* what cdbm_pack of the owner gave; of no bytes where nothing arrived */
    size_t n_packet;
} cdbm_input;

typedef struct cdbm_pose {          /* where an update writes; cdbm_lay_out gives it its places */
    cdbm_decision decision;
    double root[3];                 /* x, z and heading */
    double *rotations, *translations, *positions; /* [J, 4] and [J, 3] against parents, [J, 3] in the world */
    unsigned char *contacts;        /* [F] which feet are down */
    int is_jump;
} cdbm_pose;

/* ---- opening */

static inline void cdbm_close_player(cdbm_player *player)
{
    size_t i;
    for (i = 0; i < player->n_databases; i++) cdbm_free_levels(&player->frames[i]);
    for (i = 0; i < player->n_tables; i++) cdb_close_any(player->opened[i]);
    CDB_FREE(player->plays);
    player->controller.n_databases = player->n_databases = player->n_tables = 0, player->plays = NULL;
}

/* Open the tables, and put together how their rows play. */
static inline void cdbm_read_tables(cdbm_bundle *bundle, cdbm_player *player)
{
    size_t n_tables = cdbm_count(bundle, CDBM_P_TABLE), size, n = 0, i;
    if (n_tables > CDBM_MOST_TABLES) cdbm_refuse(bundle, "it has more tables than can be read");
    for (i = 0; !bundle->why && i < n_tables; i++) {
        const void *bytes = cdbm_find(bundle, CDBM_P_TABLE, i, 1, &size);
        cdb_any *any = player->opened[i] = cdb_open_any(bytes, size, NULL);
        if (!any || any->schema.n_conditions > CDB_MOST_FACTS) cdbm_refuse(bundle, "a table of the bundle cannot be opened");
        player->n_tables = i + 1, player->plays_at[i] = -1;
        if (!any) return;
        if (any->table.n_rows + 64 > player->n_most_rows) player->n_most_rows = any->table.n_rows + 64;
        player->has_costs |= any->table.soft != NULL;
        if (any->table.plays) player->plays_at[i] = (int64_t)n, n += any->table.n_rows + 1;
    }
    if (bundle->why || n == 0) return;
    player->plays = (cdb_row_play *)CDB_MALLOC(n * sizeof(cdb_row_play));
    if (!player->plays) cdbm_refuse(bundle, "there is not enough memory");
    for (i = 0; player->plays && i < n_tables; i++)
        if (player->plays_at[i] >= 0)
            memcpy(player->plays + player->plays_at[i], player->opened[i]->table.plays, (player->opened[i]->table.n_rows + 1) * sizeof(cdb_row_play));
}

/* The longest range that a one-off may play. */
static inline void cdbm_find_longest(cdbm_player *player, const cdbm_clips *clips)
{
    size_t r;
    for (r = 0; r < clips->n_ranges; r++) {
        size_t length = (size_t)(clips->stops[r] - clips->starts[r]);
        if (length > player->n_longest) player->n_longest = length;
    }
}

/* What match nodes know of a database, where there is any. */
static inline void cdbm_read_ends(cdbm_bundle *bundle, size_t number, size_t at, cdbm_player *player)
{
    const cdbm_clips *clips = &player->clips[at];
    size_t n;
    if (!cdbm_find(bundle, CDBM_P_ENDS, number, 1, &n)) return;
    player->ends[at] = CDBM_TAKE(double, CDBM_P_ENDS, 3 * clips->frames->n_frames);
    player->warps[at] = CDBM_TAKE(double, CDBM_P_WARPS, 4 * clips->n_ranges);
    if (!clips->root) cdbm_refuse(bundle, "a database for match nodes does not say where its clips go");
    cdbm_find_longest(player, clips);
}

/* The poses of a database. */
static inline void cdbm_read_poses(cdbm_bundle *bundle, cdbm_player *player, size_t i, const int64_t *entry)
{
    const cdbm_clips *clips = &player->clips[i];
    size_t number = (size_t)entry[0], r;
    cdbo_frames *bank;
    if (!player->has_poses || entry[1] < 0) {
        if (player->has_poses && clips->n_ranges > 0) cdbm_refuse(bundle, "a database has no poses");
        return;
    }
    player->pose_ranges[i] = CDBM_TAKE(int64_t, CDBM_P_POSE_RANGES, clips->n_ranges);
    bank = &player->banks[player->poses.n_banks];
    cdbm_read_bank(bundle, (size_t)entry[1], &player->poses.rig, bank);
    for (r = 0; !bundle->why && r < clips->n_ranges; r++)
        if (player->pose_ranges[i][r] < 0 || (uint64_t)player->pose_ranges[i][r] >= bank->n_ranges) cdbm_refuse(bundle, "a clip has no poses");
    player->bank_of[i] = (int64_t)player->poses.n_banks;
    player->bank_list[player->poses.n_banks++] = bank;
}

/* A database of the controller, or another one behind those. */
static inline void cdbm_read_entry(cdbm_bundle *bundle, cdbm_player *player, size_t i, const int64_t *entry)
{
    static const uint32_t rows[] = {CDBM_P_MIRRORED, CDBM_P_ROW_STARTS, CDBM_P_ROWS};
    cdbm_clips *clips = &player->clips[i];
    size_t number = (size_t)entry[0], n_rows = 0;
    int is_searched = i < player->controller.n_databases;
    cdbm_read_database(bundle, number, &player->frames[i], clips);
    player->database_of[i] = entry[0], player->table_of[i] = entry[2];
    if (bundle->why) return;
    if (!(clips->rate <= 1e6)) cdbm_refuse(bundle, "the rate of a database is none");
    if (entry[2] >= (int64_t)player->n_tables) cdbm_refuse(bundle, "a database has a table that is not there");
    else if (entry[2] >= 0) n_rows = player->opened[entry[2]]->table.n_rows;
    if (bundle->why) return;
    cdbm_read_tags(bundle, number, clips->n_kinds, &player->tags[i]);
    if (!is_searched) {
        cdbm_read_joint(bundle, number, clips, n_rows, &player->joints[i]);
        if (clips->root) cdbm_find_longest(player, clips);
    } else {
        if (i == 0) player->controller.n_features = clips->frames->n_features;
        if (clips->frames->n_features != player->controller.n_features) cdbm_refuse(bundle, "two databases have other features");
        clips->range_at = player->n_ranges, clips->kind_at = player->n_kinds, clips->frame_at = player->n_frames;
        player->n_ranges += clips->n_ranges, player->n_kinds += clips->n_kinds, player->n_frames += clips->frames->n_frames;
        cdbm_read_events(bundle, number, clips->frames->n_frames, &player->events[i]);
        if (entry[2] >= 0) {
            cdbm_read_rows_of(bundle, number, rows, clips->n_ranges, n_rows, &player->tables[i]);
            player->tables[i].plays = player->opened[entry[2]]->table.plays;
        }
        player->tables[i].at = clips->range_at;
        cdbm_read_ends(bundle, number, i, player);
    }
    cdbm_read_poses(bundle, player, i, entry);
}

static inline void cdbm_read_output(cdbm_bundle *bundle, size_t number, cdbm_player *player)
{
    const double *settings = CDBM_TAKE(double, CDBM_P_OUTPUT, CDBO_N_SETTINGS), *joints = CDBM_TAKE(double, CDBM_P_JOINTS, 2);
    if (bundle->why) return;
    memcpy(player->poses.settings, settings, sizeof player->poses.settings);
    player->poses.banks = player->bank_list;
    cdbm_read_rig(bundle, number, &player->poses.rig, joints);
    if (player->poses.rig.n_feet > CDBM_MOST_BELOW) cdbm_refuse(bundle, "a rig has more feet than can feel a ground");
}

/* Read a controller of a bundle, by its name, or the first where that is NULL; the player stays where it is while it is used. Gives why
 * it is refused, and NULL where it is not. */
static inline const char *cdbm_open_player(cdbm_player *player, const cdbm_bundle *from, const char *name)
{
    cdbm_bundle *bundle = &player->bundle;
    cdbm_controller *to = &player->controller;
    size_t number = 0, n_entries = 0, n_more = 0, n_settings = 0, i;
    const int64_t *entries, *more;
    const double *settings, *thresholds, *bars;
    const char *own;
    memset(player, 0, sizeof *player);
    *bundle = *from;
    while (name && (own = cdbm_text(bundle, CDBM_P_CONTROLLER_NAME, number, 0)) != NULL && strcmp(own, name) != 0) number++;
    player->number = number;
    if (!cdbm_text(bundle, CDBM_P_CONTROLLER_NAME, number, 0)) return "the bundle has no controller of that name";
    entries = CDBM_TAKE_ALL(int64_t, CDBM_P_ENTRIES, &n_entries);
    settings = CDBM_TAKE_ALL(double, CDBM_P_SETTINGS, &n_settings);
    more = (const int64_t *)cdbm_find(bundle, CDBM_P_MORE, number, 3 * sizeof(int64_t), &n_more);
    if (n_entries % 3 || n_entries == 0 || n_settings != 16) cdbm_refuse(bundle, "a controller is damaged");
    n_entries /= 3, n_more = more ? n_more : 0;
    if (n_entries > CDBM_MOST_DATABASES || n_more > CDBM_MOST_DATABASES - n_entries) cdbm_refuse(bundle, "a controller has more databases than can be read");
    if (bundle->why) return bundle->why;
    thresholds = CDBM_TAKE(double, CDBM_P_THRESHOLDS, n_entries), bars = CDBM_TAKE(double, CDBM_P_BARS, n_entries);
    to->n_played = cdbm_size_from(settings[0]), to->search_every_s = settings[1], to->jump_threshold_s = settings[2];
    to->history_s = settings[3], to->min_rate = settings[4], to->max_rate = settings[5], to->grace_s = settings[6];
    to->until_natural = settings[7] != 0.0, player->has_poses = settings[8] != 0.0;
    player->velocity_halflife_s = player->heading_halflife_s = settings[9], player->ways.rate = settings[10];
    to->settle_s = settings[11], to->asset_history_s = settings[12];
    to->varies = settings[13] != 0.0, to->n_recent = cdbm_size_from(settings[14]), to->vary_within = settings[15];
    for (i = 0; i < n_settings; i++)
        if (!(settings[i] >= 0.0 && (settings[i] <= 1e6 || i == 15))) cdbm_refuse(bundle, "a setting of a controller is none");
    if (to->n_played > 1024 || to->n_recent > CDBM_MOST_RECENT) cdbm_refuse(bundle, "a controller is damaged");
    cdbm_read_tables(bundle, player);
    if (player->has_poses && !bundle->why) cdbm_read_output(bundle, number, player);
    to->databases = player->clips, to->n_databases = bundle->why ? 0 : n_entries;
    for (i = 0; !bundle->why && i < n_entries + n_more; i++) {
        player->n_databases = i + 1;
        cdbm_read_entry(bundle, player, i, i < n_entries ? entries + 3 * i : more + 3 * (i - n_entries));
        if (i < n_entries) player->clips[i].threshold = thresholds[i], player->clips[i].bar = bars[i];
    }
    player->range_biases = CDBM_TAKE(double, CDBM_P_RANGE_BIASES, player->n_ranges);
    player->allowed = CDBM_TAKE(uint8_t, CDBM_P_ALLOWED, player->n_kinds), player->playable = CDBM_TAKE(uint8_t, CDBM_P_PLAYABLE, player->n_kinds);
    player->kind_biases = CDBM_TAKE(double, CDBM_P_KIND_BIASES, player->n_kinds);
    player->ways.steps = CDBM_TAKE_ALL(double, CDBM_P_STEPS, &player->ways.n_points);
    player->ways.features = (const cdbo_path_feature *)CDBM_TAKE(int64_t, CDBM_P_FEATURES, 3 * player->ways.n_points);
    player->ways.velocities = CDBM_TAKE_ALL(int64_t, CDBM_P_VELOCITIES, &player->ways.n_velocities);
    player->ways.n_features = to->n_features;
    if (!bundle->why && !cdbm_open_ways(&player->ways)) cdbm_refuse(bundle, "a feature of a path is not there");
    if (!bundle->why && cdbm_most_frames(&player->ways) > (size_t)1 << 20) cdbm_refuse(bundle, "a path is too long");
    if (!bundle->why && player->has_poses && !cdbo_poses_open(&player->poses)) cdbm_refuse(bundle, "the rig and its banks do not go together");
    if (bundle->why) cdbm_close_player(player);
    return bundle->why;
}

/* ---- memory */

/* How many numbers a character is: its walk, what it plays, what it displays, and its pose. */
static inline size_t cdbm_state_width(const cdbm_player *player)
{
    return cdbm_walk_width(&player->ways) + cdbm_width(&player->controller) + 3 + (player->has_poses ? player->poses.width : 0);
}

static inline size_t cdbm_state_size(const cdbm_player *player)
{
    return cdbm_state_width(player) * sizeof(double);
}

static inline double *cdbm_played_part(const cdbm_player *player, double *state)
{
    return state + cdbm_walk_width(&player->ways);
}

static inline cdbo_instant *cdbm_displayed(const cdbm_player *player, double *state)
{
    return (cdbo_instant *)(void *)(cdbm_played_part(player, state) + cdbm_width(&player->controller));
}

static inline double *cdbm_pose_part(const cdbm_player *player, double *state)
{
    return cdbm_played_part(player, state) + cdbm_width(&player->controller) + 3;
}

/* How many bytes a pose takes beside its cdbm_pose. */
static inline size_t cdbm_pose_size(const cdbm_player *player)
{
    return cdbm_rounded(10 * player->poses.rig.n_joints * sizeof(double)) + cdbm_rounded(player->poses.rig.n_feet + 1);
}

static inline void cdbm_lay_out(const cdbm_player *player, cdbm_pose *pose, void *memory)
{
    size_t n_joints = player->poses.rig.n_joints;
    memset(pose, 0, sizeof *pose);
    pose->rotations = (double *)memory, pose->translations = pose->rotations + 4 * n_joints;
    pose->positions = pose->translations + 3 * n_joints;
    pose->contacts = (unsigned char *)memory + cdbm_rounded(10 * n_joints * sizeof(double));
}

/* How many bytes the answer of a table takes. */
static inline size_t cdbm_answer_room(const cdbm_player *player)
{
    return 2 * (cdbm_rounded(player->n_most_rows / 8 + 8) + cdbm_rounded(player->n_most_rows * sizeof(double))) + 64;
}

/* How many bytes of room a call for so many characters takes. */
static inline size_t cdbm_room_size(const cdbm_player *player, size_t n)
{
    size_t n_features = player->controller.n_features, n_frames = cdbm_most_frames(&player->ways);
    size_t each = cdbm_rounded(cdbm_state_size(player)) + cdbm_rounded(n_features * sizeof(double)) + cdbm_rounded(sizeof(cdbm_moved))
        + cdbm_rounded(player->n_ranges) + 2 * cdbm_rounded(player->n_ranges * sizeof(double)) + 2 * cdbm_rounded(cdbm_width(&player->controller) * sizeof(double)) + 64
        + cdbm_rounded(player->controller.n_databases * (sizeof(cdbm_found) + 1)) + cdbm_rounded(sizeof(cdbm_decision))
        + cdbm_rounded(sizeof(cdbm_followed)) + cdbm_rounded(sizeof(double));
    return n * each + cdbm_rounded((4 * n_frames + 3 * n_features) * sizeof(double)) + cdbm_choice_room(&player->controller, n)
        + cdbm_rounded(player->n_frames * sizeof(double)) + cdbm_rounded(player->n_frames)
        + cdbm_rounded((player->has_poses ? cdbo_pose_room(&player->poses) : 0) * sizeof(double)) + cdbm_answer_room(player)
        + cdbm_path_room(player->n_longest) + 256;
}

/* A character that stands at a place and has not done anything yet. */
static inline void cdbm_begin(const cdbm_player *player, double *state, double x, double z, double heading)
{
    cdbm_state *played;
    cdbo_body body;
    memset(&body, 0, sizeof body);
    memset(state, 0, cdbm_state_size(player));
    body.position[0] = x, body.position[1] = z, body.heading = heading;
    body.velocity_halflife_s = player->velocity_halflife_s, body.heading_halflife_s = player->heading_halflife_s;
    cdbm_begin_walk(&player->ways, &body, state);
    played = (cdbm_state *)(void *)cdbm_played_part(player, state);
    played->play = cdbm_plain_play(), played->rate = 1.0, played->waiting_since_s = NAN, played->playing.database = CDBM_NO_DATABASE;
    cdbm_displayed(player, state)->bank = -1.0;
    if (player->has_poses) cdbo_poses_begin(&player->poses, cdbm_pose_part(player, state));
}

/* Let chance go by another seed than 0, where what plays varies: equal seeds vary equally. */
static inline void cdbm_seed(const cdbm_player *player, double *state, uint64_t seed)
{
    cdbm_state *played = (cdbm_state *)(void *)cdbm_played_part(player, state);
    played->seed = (double)(seed & 0x1FFFFFFFFFFFFF), played->n_drawn = 0.0;
}

/* Whether a block may be a character of this player: to be asked of one that comes from elsewhere. */
static inline int cdbm_is_state(const cdbm_player *player, const double *state)
{
    double *own = (double *)(uintptr_t)state;
    const cdbm_walk *walk = (const cdbm_walk *)(const void *)state;
    const cdbo_instant *displayed = cdbm_displayed(player, own);
    if (!(walk->n_trail >= 0.0 && walk->n_trail <= (double)player->ways.n_trail)) return 0;
    if (!cdbm_is_row(&player->controller, cdbm_played_part(player, own))) return 0;
    return !player->has_poses || displayed->bank < 0.0 || cdbo_is_moment(&player->poses, displayed->bank, displayed->range);
}

/* ---- an update */

typedef struct cdbm_many {          /* a crowd in an update, in room */
    double *states, *queries, *biases;
    int64_t *play_of;
    cdbm_moved *moved;
    cdbm_found *found;
    cdbm_decision *decisions;
    cdbm_followed *followed;
    uint8_t *ranges, *among, *urgent;
    double *wide;
} cdbm_many;

static inline int cdbm_take_many(const cdbm_player *player, size_t n, cdbm_many *many, cdbm_room *room)
{
    many->states = (double *)cdbm_part(room, n * cdbm_state_size(player));
    many->queries = (double *)cdbm_part(room, n * player->controller.n_features * sizeof(double));
    many->moved = (cdbm_moved *)cdbm_part(room, n * sizeof *many->moved);
    many->found = (cdbm_found *)cdbm_part(room, n * player->controller.n_databases * sizeof *many->found);
    many->decisions = (cdbm_decision *)cdbm_part(room, n * sizeof *many->decisions);
    many->ranges = (uint8_t *)cdbm_part(room, n * player->n_ranges), many->urgent = (uint8_t *)cdbm_part(room, n);
    many->biases = (double *)cdbm_part(room, n * player->n_ranges * sizeof(double));
    many->play_of = (int64_t *)cdbm_part(room, n * player->n_ranges * sizeof(int64_t));
    many->wide = (double *)cdbm_part(room, n * sizeof *many->wide);
    if (!many->biases || !many->play_of || !many->wide) return 0;
    many->among = (uint8_t *)cdbm_part(room, n * player->controller.n_databases);
    many->followed = (cdbm_followed *)cdbm_part(room, n * sizeof *many->followed);
    return many->followed && many->states && many->queries && many->moved && many->found && many->decisions && many->ranges && many->urgent && many->among;
}

/* ---- what the tables say */

/* What follows a letter in the texts of a part, where one of them begins with it and goes on with a name; NULL where none does. A text
 * of two parts has its second behind a '='. */
static inline const char *cdbm_said_of(const cdbm_player *player, uint32_t kind, size_t table, const char *name, char *letter)
{
    size_t n, at, length = strlen(name);
    const char *texts = (const char *)cdbm_find(&player->bundle, kind, table, 1, &n);
    if (!texts || n == 0 || texts[n - 1] != 0) return NULL;
    for (at = 0; at < n; at += strlen(texts + at) + 1) {
        const char *own = texts + at;
        if (own[0] == 0 || strncmp(own + 1, name, length) != 0 || (own[length + 1] != 0 && own[length + 1] != '=')) continue;
        *letter = own[0];
        return own + length + 1 + (own[length + 1] == '=');
    }
    return NULL;
}

/* Whether the frame that plays has a tag of that number in the bundle, or one below it. */
static inline int cdbm_has_tag(const cdbm_player *player, size_t database, int64_t frame, const char *number)
{
    const cdbm_clips *clips = &player->clips[database];
    size_t n, tag = 0, kind = (size_t)(clips->frames->kinds ? clips->frames->kinds[frame] : 0);
    const uint8_t *tags = (const uint8_t *)cdbm_find(&player->bundle, CDBM_P_FACT_TAGS, (size_t)player->database_of[database], 1, &n);
    for (; *number >= '0' && *number <= '9' && tag < 1 << 20; number++) tag = 10 * tag + (size_t)(*number - '0');
    return tags && tag * clips->n_kinds + kind < n && tags[tag * clips->n_kinds + kind];
}

/* A fact of what plays, by the letter that a bundle has for it, see contextdb/motion/characters/played.py. */
static inline double cdbm_fact_of(const cdbm_player *player, const cdbm_playing *playing, char letter, const char *more)
{
    int is_until = letter == 'L' || letter == 'R', is_foot = is_until || letter == 'l' || letter == 'r';
    const cdbm_clips *clips;
    size_t database, range, n;
    double speed, turn, until_s = CDBM_MOST_UNTIL_S;
    if (playing->database < 0.0) return is_until ? until_s : 0.0;
    database = (size_t)playing->database, range = (size_t)playing->range, clips = &player->clips[database];
    n = (size_t)(clips->stops[range] - clips->starts[range]);
    if (is_foot && player->has_poses) {
        const cdbo_frames *bank = player->bank_list[player->bank_of[database]];
        size_t own = (size_t)player->pose_ranges[database][range];
        until_s = cdbm_until_down_s(bank->contacts + (size_t)bank->starts[own] * bank->n_feet, (size_t)bank->n_steps[own] + 1, bank->n_feet,
            letter == 'R' || letter == 'r', bank->looping[own], bank->rate, playing->at_s);
    }
    if (is_foot) return is_until ? until_s : until_s == 0.0;
    if (letter == 'g') return cdbm_has_tag(player, database, (int64_t)playing->frame, more);
    if (letter == 'p') return cdbm_phase(n, clips->rate, playing->at_s);
    if (!clips->root) return 0.0;
    cdbm_going(clips->root + 3 * clips->starts[range], n, clips->rate, playing->at_s, &speed, &turn);
    return letter == 'v' ? speed : turn;
}

/* A fact that a game does not give and that the character knows itself: of its body, or of what plays until now. */
static inline void cdbm_add_own(const cdbm_player *player, size_t table, size_t at, const double *state, const cdbo_goal *goal, cdb_fact *fact)
{
    const cdb_condition *condition = &player->opened[table]->schema.conditions[at];
    const cdbm_state *played = (const cdbm_state *)(const void *)cdbm_played_part(player, (double *)(uintptr_t)state);
    const char *more;
    char letter = 0;
    double number;
    if (condition->expr || !cdbi_is_missing(condition, fact)) return;
    if (!(more = cdbm_said_of(player, CDBM_P_OWN_FACTS, table, condition->name, &letter))) return;
    if (letter == 's' || letter == 'd' || letter == 't') number = cdbm_own_fact((const cdbm_walk *)(const void *)state, goal, letter);
    else number = cdbm_fact_of(player, &played->playing, letter, more);
    if (cdbi_is_double(condition->type)) fact->number = number;
    else if (condition->type == CDB_BOOL) fact->whole = number != 0.0;
}

/* The facts as a mirror shows them; whether any is another. */
static inline int cdbm_mirror_facts(const cdbm_player *player, size_t table, const cdb_fact *facts, cdb_fact *to)
{
    const cdb_schema *schema = &player->opened[table]->schema;
    size_t i;
    int is_other = 0;
    memcpy(to, facts, schema->n_conditions * sizeof *to);
    for (i = 0; i < schema->n_conditions; i++) {
        const cdb_condition *condition = &schema->conditions[i];
        char letter = 0;
        const char *more = cdbm_said_of(player, CDBM_P_MIRROR, table, condition->name, &letter);
        int64_t left = facts[i].whole;
        if (!more || cdbi_is_missing(condition, &facts[i])) continue;
        is_other = 1;
        if (letter == 'p') {
            int other = cdb_condition_number(schema, more);
            if (other >= 0 && schema->conditions[other].type == condition->type) to[other] = facts[i];
        } else if (letter == 'v') { /* numbers of values, one after another */
            for (; left > 0 && *more; left--) while (*more && *more++ != ' ') {}
            for (to[i].whole = 0; *more >= '0' && *more <= '9' && to[i].whole < 1 << 20; more++) to[i].whole = 10 * to[i].whole + (*more - '0');
        } else if (condition->type == CDB_BOOL) to[i].whole = !facts[i].whole;
        else if (condition->type == CDB_INT) to[i].whole = -facts[i].whole;
        else to[i].number = 0.0 - facts[i].number;
    }
    return is_other;
}

typedef struct cdbm_answer {        /* of a table, as it is and with mirrored facts */
    const uint64_t *masks[2];
    const double *costs[2];
} cdbm_answer;

/* Ask a table; for what plays already, where `is_wide`, with cells that are widened. 1; 0 with too little room; -2 for a fact that is
 * refused. */
static inline int cdbm_ask_table(const cdbm_player *player, size_t table, const cdbm_input *input, const double *state, int is_wide,
    cdbm_answer *answer, cdbm_room *room)
{
    const cdb_any *any = player->opened[table];
    const cdb_schema *schema = &any->schema;
    cdb_fact own[CDB_MOST_FACTS], mirrored[CDB_MOST_FACTS], *facts = own;
    size_t n_words = any->table.n_words, n_rows = any->table.n_rows, i, side;
    for (i = 0; i < schema->n_conditions; i++) {
        own[i] = input->facts && input->facts[table] ? input->facts[table][i] : cdbi_missing(&schema->conditions[i]);
        cdbm_add_own(player, table, i, state, &input->goal, &own[i]);
    }
    for (side = 0; side < 2; side++) {
        uint64_t *mask = (uint64_t *)cdbm_part(room, n_words * sizeof(uint64_t));
        double *costs = any->table.soft ? (double *)cdbm_part(room, n_rows * sizeof(double)) : NULL;
        if (side == 1 && !cdbm_mirror_facts(player, table, own, mirrored)) {
            answer->masks[1] = answer->masks[0], answer->costs[1] = answer->costs[0];
            return 1;
        }
        if (side == 1) facts = mirrored;
        if (!mask || (any->table.soft && !costs)) return 0;
        if ((is_wide ? cdb_query_widened : cdb_query)(&any->table, any->columns, schema, facts, input->unknown, mask, n_words, input->fault) != CDB_OK)
            return -2;
        if (costs && (is_wide ? cdb_penalties_widened : cdb_penalties)(&any->table, any->columns, schema, facts, input->unknown, costs, n_rows,
                input->fault) != CDB_OK) return -2;
        answer->masks[side] = mask, answer->costs[side] = costs;
    }
    return 1;
}

/* Write which ranges the tables let play, what they add to their costs, and by which rows they play. 1; 0 with too little room; -2 for a
 * fact that is refused. */
static inline int cdbm_let_play(const cdbm_player *player, const cdbm_input *input, const double *state, uint8_t *ranges, double *biases,
    int64_t *play_of, cdbm_room room)
{
    size_t table, i, r;
    memset(ranges, 1, player->n_ranges);
    memcpy(biases, player->range_biases, player->n_ranges * sizeof(double));
    for (r = 0; r < player->n_ranges; r++) play_of[r] = -1;
    for (table = 0; table < player->n_tables; table++) {
        cdbm_answer answer = {{NULL, NULL}, {NULL, NULL}};
        cdbm_room left = room;
        for (i = 0; i < player->controller.n_databases; i++) {
            if (player->table_of[i] != (int64_t)table) continue;
            if (!answer.masks[0] && input->rows) {
                answer.masks[0] = input->rows[table];
                answer.masks[1] = input->mirrored && input->mirrored[table] ? input->mirrored[table] : answer.masks[0];
                if (!answer.masks[0]) continue;
            } else if (!answer.masks[0]) {
                int is_done = cdbm_ask_table(player, table, input, state, 0, &answer, &left);
                if (is_done != 1) return is_done;
            }
            cdbm_fill_ranges(&player->tables[i], answer.masks, answer.costs[0] ? answer.costs : NULL, player->range_biases, ranges, biases,
                player->plays_at[table] >= 0 ? play_of : NULL);
            if (player->plays_at[table] > 0)
                for (r = player->tables[i].at; r < player->tables[i].at + player->tables[i].n_ranges; r++)
                    if (play_of[r] >= 0) play_of[r] += player->plays_at[table];
        }
    }
    return 1;
}

/* Whether a condition of a table has a hysteresis. */
static inline int cdbm_is_widening(const cdb_any *any)
{
    size_t i;
    for (i = 0; i < any->schema.n_conditions; i++)
        if (any->columns[i].hysteresis > 0.0) return 1;
    return 0;
}

/* Write the bias of what would play on where its table, widened, lets that play and else does not; NAN otherwise. As cdbm_let_play. */
static inline int cdbm_let_play_on(const cdbm_player *player, const cdbm_input *input, const double *state, const cdbm_moved *moved,
    const uint8_t *ranges, double *wide, cdbm_room room)
{
    cdbm_answer answer = {{NULL, NULL}, {NULL, NULL}};
    cdbm_table_ranges one;
    size_t database, range, at;
    uint8_t is_valid = 0;
    double bias;
    int is_done;
    *wide = NAN;
    if (moved->to.database < 0.0 || input->rows) return 1;
    database = (size_t)moved->to.database, range = (size_t)moved->to.range;
    if (player->table_of[database] < 0) return 1;
    at = player->clips[database].range_at + range;
    if (ranges[at] || !cdbm_is_widening(player->opened[player->table_of[database]])) return 1;
    is_done = cdbm_ask_table(player, (size_t)player->table_of[database], input, state, 1, &answer, &room);
    if (is_done != 1) return is_done;
    one = player->tables[database];
    one.n_ranges = 1, one.at = 0, one.starts += range, one.mirrored += range;
    bias = player->range_biases[at];
    cdbm_fill_ranges(&one, answer.masks, answer.costs[0] ? answer.costs : NULL, player->range_biases + at, &is_valid, &bias, NULL);
    if (is_valid) *wide = bias;
    return 1;
}

/* The same for a copy: all may play, and what its owner plays does as that has it. -3 for what is no packet. */
static inline int cdbm_let_follow(const cdbm_player *player, const cdbm_input *input, cdbm_many *many, size_t i)
{
    cdbm_followed *followed = &many->followed[i];
    int64_t *play_of = many->play_of + i * player->n_ranges;
    size_t r;
    if (!cdbm_read_packet(&player->controller, input->packet, input->n_packet, &many->moved[i], followed)) return -3;
    memset(many->ranges + i * player->n_ranges, 1, player->n_ranges);
    memcpy(many->biases + i * player->n_ranges, player->range_biases, player->n_ranges * sizeof(double));
    for (r = 0; r < player->n_ranges; r++) play_of[r] = -1;
    if (followed->enters != 0.0) play_of[player->clips[(size_t)followed->database].range_at + (size_t)followed->range] = 0;
    many->urgent[i] = followed->enters != 0.0 ? CDBM_FORCE : 0;
    return 1;
}

/* Write the query of one: it is some time later, and wishes to take a path. 0 for a path without a frame. */
static inline int cdbm_query_of(const cdbm_player *player, const cdbm_input *input, double dt_s, const double *before, double *state,
    cdbm_moved *moved, double *query, cdbm_room room)
{
    const cdbm_ways *ways = &player->ways;
    size_t n_most = cdbm_most_frames(ways), n_behind, n = cdbm_n_behind(ways, ways->rate);
    double *positions = (double *)cdbm_part(&room, (4 * n_most + 3 * ways->n_features) * sizeof(double)), rate = ways->rate;
    double *headings, *lengths, *pose;
    float *narrow;
    if (!positions) return 0;
    headings = positions + 2 * n_most, lengths = headings + n_most, pose = lengths + n_most, narrow = (float *)(void *)(pose + ways->n_features);
    memcpy(cdbm_played_part(player, state), cdbm_played_part(player, (double *)(uintptr_t)before),
        (cdbm_state_width(player) - cdbm_walk_width(ways)) * sizeof(double));
    cdbm_move_on(ways, &player->controller, player->frames[0].offset, before, cdbm_played_part(player, state), &input->goal, input->body, dt_s,
        state, moved, pose);
    if (input->positions) {
        rate = input->path_rate, n_behind = rate > 0.0 ? cdbm_n_behind(ways, rate) : n_most;
        if (input->n_path == 0 || n_behind >= n_most) return 0;
        n = input->n_path < n_most - n_behind ? input->n_path : n_most - n_behind;
        memcpy(positions + 2 * n_behind, input->positions, 2 * n * sizeof(double));
        memcpy(headings + n_behind, input->headings, n * sizeof(double));
        n += n_behind;
    } else n = cdbm_n_wished(ways, state, &input->goal);
    cdbm_wish(ways, state, input->positions ? NULL : &input->goal, rate, n, positions, headings);
    cdbm_ask_path(ways, pose, rate, n, positions, headings, lengths, narrow, query);
    return 1;
}

/* What plays, as its bank has it. */
static inline cdbo_instant cdbm_instant_of(const cdbm_player *player, const cdbm_playing *playing)
{
    cdbo_instant at = {-1.0, 0.0, 0.0};
    if (playing->database < 0.0) return at;
    at.bank = (double)player->bank_of[(size_t)playing->database];
    at.range = (double)player->pose_ranges[(size_t)playing->database][(size_t)playing->range], at.at_s = playing->at_s;
    return at;
}

/* Whether a moment is of a database of the player, one that its controller does not search too. */
static inline int cdbm_is_there(const cdbm_player *player, const cdbm_playing *playing)
{
    cdbm_controller all = player->controller;
    all.n_databases = player->n_databases;
    return cdbm_is_playing(&all, playing);
}

/* Where a one-off brings the body in an update. 1; 0 with too little room; -5 for one of another bundle. */
static inline int cdbm_bring(const cdbm_player *player, const double *state, double dt_s, const cdbm_one_off *one, cdbo_body *body,
    cdbm_room room)
{
    cdbm_playing entered;
    cdbm_warped path;
    double place[3], was[2];
    size_t k;
    entered.database = one->database, entered.range = one->range, entered.frame = one->frame, entered.at_s = one->time_s;
    if (!(one->database >= 0.0) || !cdbm_is_there(player, &entered)) return -5;
    if (!player->ends[(size_t)one->database] && player->joints[(size_t)one->database].joint.n_roles == 0) return -5;
    entered.frame = one->last;
    if (!cdbm_is_there(player, &entered) || !(one->last >= one->frame && one->rate > 0.0)) return -5;
    if (!cdbm_path_of(&player->clips[(size_t)one->database], one, &path, room)) return 0;
    *body = ((const cdbm_walk *)(const void *)state)->body;
    memcpy(was, body->position, sizeof was);
    cdbm_place_at(&path, one->time_s + dt_s, place);
    cdbm_then(one->origin, place, place);
    body->heading = place[2];
    for (k = 0; k < 2; k++) {
        body->position[k] = place[k], body->acceleration[k] = 0.0;
        if (dt_s > 0.0) body->velocity[k] = (place[k] - was[k]) / dt_s;
    }
    return 1;
}

/* What it then shows, in place of what was decided. 0 with too little room. */
static inline int cdbm_decision_of(const cdbm_player *player, const cdbm_one_off *before, double dt_s, cdbm_decision *decision,
    cdbm_room room)
{
    const cdbm_clips *clips = &player->clips[(size_t)before->database];
    cdbm_one_off one = *before;
    cdbm_warped path;
    memset(decision, 0, sizeof *decision);
    if (!cdbm_path_of(clips, before, &path, room)) return 0;
    cdbm_advance(clips, &one, dt_s);
    decision->action = one.since_s == 0.0 ? CDBM_JUMPS : CDBM_PLAYS_ON;
    decision->playing = cdbm_playing_of(clips, &one), decision->before.database = CDBM_NO_DATABASE;
    decision->rate = one.rate, decision->play = one.play;
    cdbm_motion_of(&path, &one, decision->motion);
    return 1;
}

/* The pose of one, by what was decided. */
static inline void cdbm_pose_of(const cdbm_player *player, const cdbm_input *input, const cdbm_decision *decision, double dt_s,
    const double *before, double *state, cdbm_pose *pose, double *room)
{
    const cdbo_rig *rig = &player->poses.rig;
    const cdbm_walk *walk = (const cdbm_walk *)(const void *)state;
    cdbo_instant *displayed = cdbm_displayed(player, state);
    double points[2 * CDBM_MOST_BELOW], below[3 * CDBM_MOST_BELOW], place[3];
    size_t n_seams = 0, n_points = rig->n_feet > 0 ? rig->n_feet : 1, i;
    cdbo_play play;
    cdbo_given given;
    cdbo_seam seams[2];
    cdbo_posed one;
    memset(&one, 0, sizeof one);
    play = cdbm_pose_play(decision, cdbm_instant_of(player, &decision->playing), cdbm_instant_of(player, &decision->before), *displayed,
        input->ground != NULL);
    one.poses = &player->poses, one.before = cdbm_pose_part(player, (double *)(uintptr_t)before), one.row = cdbm_pose_part(player, state);
    cdbo_receive(&player->poses, one.before, &play, dt_s, &given, seams, &n_seams);
    place[0] = walk->body.position[0], place[1] = walk->body.position[1], place[2] = walk->body.heading;
    one.given = &given, one.place = place, one.root = pose->root, one.rotations = pose->rotations;
    one.translations = pose->translations, one.positions = pose->positions, one.contacts = pose->contacts;
    if (input->ground) {
        cdbo_pose_one(&one, seams, dt_s, room, CDBO_UP_TO_GROUND);
        cdbo_ask_points(&one, points);
        for (i = 0; i < n_points; i++) {
            below[3 * i] = below[3 * i + 1] = below[3 * i + 2] = 0.0;
            if (points[2 * i] == points[2 * i]) input->ground(input->user, points[2 * i], points[2 * i + 1], below + 3 * i);
        }
        one.below = below;
        cdbo_pose_one(&one, seams, dt_s, room, CDBO_FROM_GROUND);
    } else cdbo_pose_one(&one, seams, dt_s, room, CDBO_WHOLE);
    if (play.playing.bank >= 0.0) *displayed = play.playing;
    pose->is_jump = given.seam >= 0.0 && (decision->action == CDBM_JUMPS || (decision->action != CDBM_STARTS && given.is_ahead != 0.0));
}

/* Whether the clip alone moves the body, as the row of what plays or the settings say. */
static inline int cdbm_moves_body(const cdbm_player *player, const cdbm_decision *decision)
{
    double root = decision->play.root;
    return (root == root ? root : player->poses.settings[CDBO_ROOT]) == CDBO_BY_ANIMATION;
}

/* Whether some database has an event of a name; its name there, or NULL. */
static inline const char *cdbm_event_name(const cdbm_player *player, const char *name)
{
    const int64_t *begins;
    size_t d, n;
    for (d = 0; d < player->controller.n_databases; d++)
        if (cdbm_find_event(&player->bundle, (size_t)player->database_of[d], &player->events[d], name, &begins, &n)) return name;
    return NULL;
}

/* Whether one searches for an event; a copy does what its owner does. */
static inline int cdbm_seeks_event(const cdbm_input *input)
{
    return input->event != NULL && !input->is_copy;
}

/* Put an event into what one is given: how far it is from each frame, and which lead there. 0 with too little room. */
static inline int cdbm_give_event(const cdbm_player *player, const cdbm_input *input, const int64_t *play_of, cdbm_given *given, cdbm_room *room)
{
    double *to_event = (double *)cdbm_part(room, player->n_frames * sizeof(double));
    uint8_t *leads = (uint8_t *)cdbm_part(room, player->n_frames);
    const int64_t *begins;
    size_t d, f, n;
    if (!to_event || !leads) return 0;
    for (f = 0; f < player->n_frames; f++) to_event[f] = NAN, leads[f] = 0;
    for (d = 0; d < player->controller.n_databases; d++) {
        size_t at = player->clips[d].frame_at;
        if (cdbm_find_event(&player->bundle, (size_t)player->database_of[d], &player->events[d], input->event, &begins, &n))
            cdbm_lead_to(&player->controller, &player->clips[d], given->plays, play_of, given->playable, begins, n, input->event_s, to_event + at, leads + at);
    }
    given->flags = leads, given->to_event = to_event, given->event_s = input->event_s;
    return 1;
}

/* All of an update of one who searches for an event: among the frames that lead there, and at once where what plays does not. As
 * cdbm_choose. */
static inline int cdbm_decide_for_event(const cdbm_player *player, const cdbm_input *input, const cdbm_given *given, size_t i, const double *before,
    double *after, const cdbm_many *many, double *numbers, cdbm_room room)
{
    const cdbm_controller *controller = &player->controller;
    size_t width = cdbm_width(controller);
    cdbm_given own = *given;
    cdbm_moved *moved = &many->moved[i];
    int is_done;
    if (!cdbm_give_event(player, input, many->play_of + i * player->n_ranges, &own, &room)) return 0;
    if (moved->to.database >= 0.0 && !own.flags[player->clips[(size_t)moved->to.database].frame_at + (size_t)moved->to.frame])
        many->urgent[i] |= CDBM_FORCE;
    cdbm_ask(controller, &own, i, before + i * width, moved, after + i * width, &many->decisions[i], numbers);
    is_done = cdbm_choose(controller, &own, i, i + 1, after, many->moved, many->decisions, many->found, room);
    if (is_done != 1) return is_done;
    if (!cdbm_weigh(controller, &own, i, after + i * width, moved, &many->decisions[i], numbers, room)) return 0;
    cdbm_decide(controller, &own, i, before + i * width, moved, after + i * width, &many->decisions[i]);
    return 1;
}

/* Search for all who seek no event. As cdbm_choose. */
static inline int cdbm_choose_others(const cdbm_controller *controller, const cdbm_given *given, const cdbm_input *inputs, const double *after,
    const cdbm_many *many, cdbm_room room)
{
    size_t start, stop;
    int is_done = 1;
    for (start = 0; is_done == 1 && start < given->n; start = stop) {
        for (stop = start; stop < given->n && !cdbm_seeks_event(&inputs[stop]); stop++) {}
        is_done = cdbm_choose(controller, given, start, stop, after, many->moved, many->decisions, many->found, room);
        while (stop < given->n && cdbm_seeks_event(&inputs[stop])) stop++;
    }
    return is_done;
}

/* Update characters: `states` are their blocks, one after another. 1; 0 with too little room, or a path that is none; -1 where what is
 * asked for is no finite number; -2 for a fact that a table refuses; -3 for a packet that is none; -4 for an event that no
 * database has; -5 for a one-off that is none. Where it is not 1 all stand where they stood. */
static inline int cdbm_update_all(const cdbm_player *player, size_t n, double *states, double dt_s, const cdbm_input *inputs,
    cdbm_pose *poses, cdbm_room room)
{
    const cdbm_controller *controller = &player->controller;
    size_t width = cdbm_state_width(player), n_features = controller->n_features, played = cdbm_width(controller), i;
    double *before, *after, *numbers;
    cdbm_given given;
    cdbm_many many;
    cdbm_room left;
    int is_done = 1, is_any_wide = 0;
    if (!(dt_s >= 0.0 && dt_s <= 1e6) || !cdbm_take_many(player, n, &many, &room)) return dt_s >= 0.0 && dt_s <= 1e6 ? 0 : -1;
    memset(&given, 0, sizeof given);
    memset(many.among, 1, n * controller->n_databases);
    given.n = n, given.dt_s = dt_s, given.queries = many.queries, given.ranges = many.ranges, given.ranges_step = player->n_ranges;
    given.range_biases = many.biases, given.biases_step = given.plays_step = player->n_ranges;
    given.plays = player->plays, given.play_of = many.play_of, given.allowed = player->allowed, given.playable = player->playable;
    given.kind_biases = player->kind_biases, given.among = many.among, given.urgent = many.urgent;
    given.among_step = controller->n_databases;
    for (i = 0; i < n; i++) {
        if (inputs[i].event && !(inputs[i].event_s >= 0.0 && inputs[i].event_s <= 1e6)) return -1;
        if (inputs[i].event && !cdbm_event_name(player, inputs[i].event)) return -4;
        cdbm_input input = inputs[i];
        cdbo_body body;
        if (input.one_off) {
            if ((is_done = cdbm_bring(player, states + i * width, dt_s, input.one_off, &body, room)) != 1) return is_done;
            input.body = &body;
        }
        many.wide[i] = NAN;
        many.urgent[i] = (uint8_t)((inputs[i].force ? CDBM_FORCE : 0) | (inputs[i].interrupt ? CDBM_INTERRUPT : 0));
        if (!cdbm_query_of(player, &input, dt_s, states + i * width, many.states + i * width, &many.moved[i],
                many.queries + i * n_features, room)) return 0;
        is_done = inputs[i].is_copy ? cdbm_let_follow(player, &inputs[i], &many, i) : cdbm_let_play(player, &inputs[i], many.states + i * width, many.ranges + i * player->n_ranges,
            many.biases + i * player->n_ranges, many.play_of + i * player->n_ranges, room);
        if (is_done == 1 && !inputs[i].is_copy)
            is_done = cdbm_let_play_on(player, &inputs[i], many.states + i * width, &many.moved[i], many.ranges + i * player->n_ranges, &many.wide[i], room);
        if (is_done != 1) return is_done;
        is_any_wide |= many.wide[i] == many.wide[i];
    }
    if (is_any_wide) given.wide = many.wide;
    left = room;
    before = (double *)cdbm_part(&left, n * played * sizeof(double)), after = (double *)cdbm_part(&left, n * played * sizeof(double));
    numbers = (double *)cdbm_part(&left, n_features * sizeof(double));
    if (!before || !after || !numbers) return 0;
    for (i = 0; i < n; i++) {
        cdbm_given own = given;
        memcpy(before + i * played, cdbm_played_part(player, states + i * width), played * sizeof(double));
        if (cdbm_seeks_event(&inputs[i])) {
            is_done = cdbm_decide_for_event(player, &inputs[i], &given, i, before, after, &many, numbers, left);
            if (is_done != 1) return is_done;
            continue;
        }
        if (inputs[i].is_copy) own.plays = &many.followed[i].play;
        cdbm_ask(controller, &own, i, before + i * played, &many.moved[i], after + i * played, &many.decisions[i], numbers);
        if (!inputs[i].is_copy) continue;
        cdbm_take_followed(&many.followed[i], &many.decisions[i]);
        memset(many.among + i * controller->n_databases, 0, controller->n_databases); /* it searches none */
    }
    is_done = cdbm_choose_others(controller, &given, inputs, after, &many, left);
    if (is_done != 1) return is_done;
    for (i = 0; i < n; i++) {
        cdbm_given own = given;
        cdbm_room rest = left;
        if (inputs[i].is_copy && inputs[i].event && !cdbm_give_event(player, &inputs[i], many.play_of + i * player->n_ranges, &own, &rest)) return 0;
        if (inputs[i].is_copy) own.plays = &many.followed[i].play, own.flags = NULL;
        else if (!inputs[i].event && !cdbm_weigh(controller, &given, i, after + i * played, &many.moved[i], &many.decisions[i], numbers, left))
            return 0;
        if (!cdbm_seeks_event(&inputs[i]))
            cdbm_decide(controller, &own, i, before + i * played, &many.moved[i], after + i * played, &many.decisions[i]);
        memcpy(cdbm_played_part(player, many.states + i * width), after + i * played, played * sizeof(double));
        poses[i].decision = many.decisions[i];
    }
    for (i = 0; i < n; i++) {
        double *state = many.states + i * width, *own = states + i * width;
        const cdbm_walk *walk = (const cdbm_walk *)(const void *)state;
        const cdbm_decision *decision = &poses[i].decision;
        cdbm_decision shown;
        double place[3];
        place[0] = walk->body.position[0], place[1] = walk->body.position[1], place[2] = walk->body.heading;
        memcpy(poses[i].root, place, sizeof place);
        if (inputs[i].one_off && !cdbm_decision_of(player, inputs[i].one_off, dt_s, &shown, room)) return 0;
        if (inputs[i].one_off) decision = &shown;
        left = room;
        numbers = (double *)cdbm_part(&left, (player->has_poses ? cdbo_pose_room(&player->poses) : 0) * sizeof(double));
        if (!numbers) return 0;
        if (player->has_poses) cdbm_pose_of(player, &inputs[i], decision, dt_s, own, state, &poses[i], numbers);
        if (inputs[i].one_off) cdbm_settle(state, place, 0);
        else cdbm_settle(state, poses[i].root, player->has_poses && cdbm_moves_body(player, decision));
    }
    for (i = 0; i < n; i++)
        if (inputs[i].one_off) cdbm_advance(&player->clips[(size_t)inputs[i].one_off->database], inputs[i].one_off, dt_s);
    memcpy(states, many.states, n * width * sizeof(double));
    return 1;
}

static inline int cdbm_update(const cdbm_player *player, double *state, double dt_s, const cdbm_input *input, cdbm_pose *pose, cdbm_room room)
{
    return cdbm_update_all(player, 1, state, dt_s, input, pose, room);
}

/* What a copy on another machine must be told after an update: bytes, into room for CDBM_MOST_PACKET, and how many; none where nothing
 * plays. */
static inline size_t cdbm_pack(const cdbm_player *player, const double *state, uint8_t *packet)
{
    return cdbm_pack_row(&player->controller, state + cdbm_walk_width(&player->ways), packet);
}

/* ---- what is to be told */

/* The asset that plays; NULL for nothing. */
static inline const char *cdbm_asset(const cdbm_player *player, const cdbm_playing *playing)
{
    if (!cdbm_is_there(player, playing) || playing->database < 0.0) return NULL;
    return cdbm_text(&player->bundle, CDBM_P_ASSETS, (size_t)player->database_of[(size_t)playing->database], (size_t)playing->range);
}

/* The name of a joint. */
static inline const char *cdbm_joint_name(const cdbm_player *player, size_t joint)
{
    return cdbm_text(&player->bundle, CDBM_P_JOINT_NAMES, player->number, joint);
}

/* Why it searched, or what let it play on without. */
static inline const char *cdbm_reason(const cdbm_decision *decision)
{
    static const char *const causes[] = {"no search was due", "nothing played", "what played is no longer there", "the clip has ended",
        "its database is not one of the moment", "it was interrupted", "what played is no longer valid", "a search was asked for",
        "a search was due"};
    static const char *const held[] = {"", "it waits for a natural transition", "it plays on to its end", "the jump would cost too much",
        "it is valid by hysteresis"};
    size_t cause = (size_t)decision->cause, by = (size_t)decision->held;
    if (by > 0 && by < sizeof held / sizeof *held) return held[by];
    return cause < sizeof causes / sizeof *causes ? causes[cause] : "";
}

static inline const char *cdbm_action_name(const cdbm_decision *decision)
{
    static const char *const names[] = {"starts", "plays on", "jumps", "loops", "holds", "plays nothing"};
    size_t action = (size_t)decision->action;
    return action < sizeof names / sizeof *names ? names[action] : "";
}

/* What the markup says of the frame that plays: the flags of contextdb/motion/markup/marks.py. */
static inline unsigned cdbm_marks_of(const cdbm_player *player, const cdbm_playing *playing)
{
    if (!cdbm_is_there(player, playing) || playing->database < 0.0) return 0;
    return cdbm_mark_of(&player->clips[(size_t)playing->database], (int64_t)playing->frame);
}

/* Each joint in the world as a matrix of 4 columns: [J, 16]. */
static inline void cdbm_matrices(const cdbm_player *player, const cdbm_pose *pose, float *to)
{
    const cdbo_rig *rig = &player->poses.rig;
    size_t j, k, up;
    for (j = 0; j < rig->n_joints; j++) {
        cdbo_quaternion turn = cdbo_get4(pose->rotations, j);
        for (up = j; rig->parents[up] >= 0;) up = (size_t)rig->parents[up], turn = cdbo_then(cdbo_get4(pose->rotations, up), turn);
        turn = cdbo_then(cdbo_heading(pose->root[2]), turn);
        for (k = 0; k < 3; k++) {
            cdbo_vector axis = cdbo_rotated(turn, cdbo_xyz(k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0));
            float *column = to + 16 * j + 4 * k;
            column[0] = (float)axis.x, column[1] = (float)axis.y, column[2] = (float)axis.z, column[3] = 0.0f;
        }
        for (k = 0; k < 3; k++) to[16 * j + 12 + k] = (float)pose->positions[3 * j + k];
        to[16 * j + 15] = 1.0f;
    }
}
