
/* ---- Characters for languages that call C and know none of its structures: some of one bundle, counted from 0.
 *
 *   cdbm_open_crowd      characters of a controller, who stand at the origin; with all the memory that they need
 *   cdbm_crowd_size      how many there are of something
 *   cdbm_crowd_table, cdbm_crowd_live   a table of the bundle, and a character's facts for it: set them by cdb_set_number and the others
 *   cdbm_place_one, cdbm_steer_one      put one somewhere, with nothing played yet; and what its stick asks for
 *   cdbm_seed_one        let chance decide otherwise for one
 *   cdbm_event_one       what is to happen, and in how many seconds
 *   cdbm_restore_one     put one where it stood
 *   cdbm_enter_one       play a one-off that a match node chooses for a target
 *   cdbm_meet_ones       play a clip of several roles that some of them are cast for
 *   cdbm_update_crowd    all of them
 *   cdbm_crowd_numbers, cdbm_crowd_text what came of it
 *
 * What one was given stays as it was until it is given anew. */

typedef enum cdbm_crowd_what {
    CDBM_N_CHARACTERS, CDBM_N_JOINTS, CDBM_N_TABLES, CDBM_STATE_BYTES,      /* sizes */
    CDBM_ROOT_NUMBERS, CDBM_ROTATION_NUMBERS, CDBM_TRANSLATION_NUMBERS, CDBM_POSITION_NUMBERS, CDBM_STATE_NUMBERS, /* as in cdbm_pose */
    CDBM_ASSET_TEXT, CDBM_ACTION_TEXT, CDBM_REASON_TEXT, CDBM_JOINT_TEXT    /* of CDBM_JOINT_TEXT the number is that of a joint */
} cdbm_crowd_what;

typedef struct cdbm_crowd {
    cdbm_player player;
    size_t n;
    double *states;
    cdbm_pose *poses;
    cdbm_input *inputs;
    cdbm_one_off *one_offs;
    cdb_live **lives;               /* [n, tables] */
    const cdb_fact **lists;         /* [n, tables] */
    cdbm_room room;
    void *memory;
    cdb_fault fault;
} cdbm_crowd;

#define CDBM_MOST_MEETING 8         /* so many characters of a crowd may be asked to play a clip together */

/* How many bytes of room a meeting of so many takes. */
static inline size_t cdbm_meeting_room(const cdbm_player *player, size_t n)
{
    size_t each = cdbm_rounded(player->controller.n_features * sizeof(double)) + sizeof(cdbm_actor), most = 0, set, t;
    for (set = 0; cdbm_text(&player->bundle, CDBM_P_SET, set, 0); set++) {
        size_t own = cdbm_together_room(player, set, n, n * CDB_MOST_ROLES);
        if (own > most) most = own;
    }
    most += n * each + n * CDB_MOST_ROLES * sizeof(cdb_actor) * player->n_tables + 64;
    for (t = 0; t < player->n_tables; t++) most += cdbm_rounded(player->opened[t]->schema.n_conditions * sizeof(cdb_fact)) + 16;
    return most;
}

static inline size_t cdbm_crowd_room(const cdbm_player *player, size_t n)
{
    size_t rooms[3], most = 0, i;
    rooms[0] = cdbm_enter_room(player), rooms[1] = cdbm_room_size(player, n);
    rooms[2] = cdbm_meeting_room(player, n < CDBM_MOST_MEETING ? n : CDBM_MOST_MEETING);
    for (i = 0; i < 3; i++)
        if (rooms[i] > most) most = rooms[i];
    return most;
}

/* Take all that n characters need out of room; 0 where there is too little. */
static inline int cdbm_take_crowd(cdbm_crowd *crowd, size_t n, cdb_unknown unknown, cdbm_room *room)
{
    const cdbm_player *player = &crowd->player;
    size_t n_tables = player->n_tables, i, t;
    char *of_poses;
    crowd->states = (double *)cdbm_part(room, n * cdbm_state_size(player));
    crowd->poses = (cdbm_pose *)cdbm_part(room, n * sizeof *crowd->poses);
    crowd->inputs = (cdbm_input *)cdbm_part(room, n * sizeof *crowd->inputs);
    crowd->one_offs = (cdbm_one_off *)cdbm_part(room, n * sizeof *crowd->one_offs);
    crowd->lives = (cdb_live **)cdbm_part(room, n * n_tables * sizeof *crowd->lives);
    crowd->lists = (const cdb_fact **)cdbm_part(room, n * n_tables * sizeof *crowd->lists);
    of_poses = (char *)cdbm_part(room, n * cdbm_pose_size(player));
    crowd->room.left = cdbm_crowd_room(player, n), crowd->room.at = (char *)cdbm_part(room, crowd->room.left);
    if (!crowd->states || !crowd->poses || !crowd->inputs || !crowd->one_offs || !crowd->lives || !crowd->lists || !of_poses || !crowd->room.at) return 0;
    for (i = 0; i < n; i++) {
        cdbm_lay_out(player, &crowd->poses[i], of_poses + i * cdbm_pose_size(player));
        cdbm_begin(player, crowd->states + i * cdbm_state_width(player), 0.0, 0.0, 0.0);
        cdbm_seed(player, crowd->states + i * cdbm_state_width(player), i);
        memset(&crowd->inputs[i], 0, sizeof crowd->inputs[i]);
        crowd->inputs[i].goal.facing = NAN, crowd->inputs[i].unknown = unknown, crowd->inputs[i].fault = &crowd->fault;
        crowd->inputs[i].facts = crowd->lists + i * n_tables;
        for (t = 0; t < n_tables; t++) {
            void *memory = cdbm_part(room, cdb_live_bytes(&player->opened[t]->schema));
            if (!memory) return 0;
            crowd->lives[i * n_tables + t] = cdb_live_of(player->opened[t], unknown, memory);
            crowd->lists[i * n_tables + t] = crowd->lives[i * n_tables + t]->facts;
        }
    }
    crowd->n = n;
    return 1;
}

static inline size_t cdbm_crowd_bytes(const cdbm_player *player, size_t n)
{
    size_t each = cdbm_rounded(cdbm_state_size(player)) + cdbm_rounded(cdbm_pose_size(player)) + sizeof(cdbm_pose) + sizeof(cdbm_input)
        + sizeof(cdbm_one_off), t;
    for (t = 0; t < player->n_tables; t++) each += cdbm_rounded(cdb_live_bytes(&player->opened[t]->schema)) + 2 * sizeof(void *);
    return n * each + cdbm_rounded(cdbm_crowd_room(player, n)) + 80;
}

CDB_API void cdbm_close_crowd(cdbm_crowd *crowd)
{
    if (!crowd) return;
    cdbm_close_player(&crowd->player);
    CDB_FREE(crowd->memory);
    CDB_FREE(crowd);
}

/* Characters of a controller of a bundle, by its name, or of the first where that is NULL; `unknown` is what missing facts do, see
 * cdb_unknown. NULL where it is refused, with the reason. The bytes stay where they are, on an address that 16 divides. */
CDB_API cdbm_crowd *cdbm_open_crowd(const void *bytes, size_t size, const char *controller, size_t n, int unknown, const char **why)
{
    cdbm_bundle bundle;
    cdbm_room room;
    cdbm_crowd *crowd;
    *why = cdbm_open_bundle(&bundle, bytes, size);
    if (!*why && (n < 1 || n > (size_t)1 << 20)) *why = "there are too many characters, or none";
    if (*why) return NULL;
    *why = "there is not enough memory";
    crowd = (cdbm_crowd *)CDB_MALLOC(sizeof *crowd);
    if (!crowd) return NULL;
    memset(crowd, 0, sizeof *crowd);
    *why = cdbm_open_player(&crowd->player, &bundle, controller);
    if (!*why) {
        room.left = cdbm_crowd_bytes(&crowd->player, n), room.at = (char *)(crowd->memory = CDB_MALLOC(room.left));
        if (room.at && cdbm_take_crowd(crowd, n, (cdb_unknown)unknown, &room)) return crowd;
        *why = "there is not enough memory";
    }
    cdbm_close_crowd(crowd);
    return NULL;
}

CDB_API size_t cdbm_crowd_size(const cdbm_crowd *crowd, int what)
{
    switch (what) {
    case CDBM_N_CHARACTERS: return crowd->n;
    case CDBM_N_JOINTS: return crowd->player.poses.rig.n_joints;
    case CDBM_N_TABLES: return crowd->player.n_tables;
    default: return what == CDBM_STATE_BYTES ? cdbm_state_size(&crowd->player) : 0;
    }
}

/* The joint that one is moved by; -1 for the root, and for none. */
CDB_API int cdbm_crowd_parent(const cdbm_crowd *crowd, size_t joint)
{
    return joint < crowd->player.poses.rig.n_joints ? (int)crowd->player.poses.rig.parents[joint] : -1;
}

/* A table of the bundle; NULL for none. */
CDB_API const cdb_any *cdbm_crowd_table(const cdbm_crowd *crowd, size_t table)
{
    return table < crowd->player.n_tables ? crowd->player.opened[table] : NULL;
}

/* The facts of a character for a table; NULL for none. */
CDB_API cdb_live *cdbm_crowd_live(const cdbm_crowd *crowd, size_t i, size_t table)
{
    return i < crowd->n && table < crowd->player.n_tables ? crowd->lives[i * crowd->player.n_tables + table] : NULL;
}

/* Put a character somewhere, with nothing played yet; chance goes by its number as a seed. 0 where there is none of that number. */
CDB_API int cdbm_place_one(cdbm_crowd *crowd, size_t i, double x, double z, double heading)
{
    if (i >= crowd->n) return 0;
    cdbm_begin(&crowd->player, crowd->states + i * cdbm_state_width(&crowd->player), x, z, heading);
    cdbm_seed(&crowd->player, crowd->states + i * cdbm_state_width(&crowd->player), i);
    crowd->inputs[i].one_off = NULL;
    return 1;
}

/* Let chance go by another seed for a character that was put in its place, see cdbm_seed. 0 where there is none of that number. */
CDB_API int cdbm_seed_one(cdbm_crowd *crowd, size_t i, uint64_t seed)
{
    if (i >= crowd->n) return 0;
    cdbm_seed(&crowd->player, crowd->states + i * cdbm_state_width(&crowd->player), seed);
    return 1;
}

/* Let a character play a one-off from the next update on: the animation of a database that costs least for its pose, its facts and a
 * place in the world where it is to bring the body; heading NaN: as the animation brings it about. Gives what it costs: it plays where
 * that is at most `most`. Infinite where nothing may play, NaN where there is no such character or database, or a fact is refused. */
CDB_API double cdbm_enter_one(cdbm_crowd *crowd, size_t i, const char *database, double x, double z, double heading, double most)
{
    int number = cdbm_database_number(&crowd->player, database);
    cdbm_one_off one;
    cdbm_match match;
    double *state;
    if (i >= crowd->n || number < 0) return NAN;
    state = crowd->states + i * cdbm_state_width(&crowd->player);
    memset(&match, 0, sizeof match);
    match.database = (size_t)number, match.target = cdbm_seen_at(state, x, z, heading);
    match.position_weight = match.rotation_weight = 1.0;
    if (cdbm_enter(&crowd->player, state, &crowd->inputs[i], &match, &one, crowd->room) != 1) return NAN;
    if (one.range >= 0.0 && one.cost <= most) crowd->one_offs[i] = one, crowd->inputs[i].one_off = &crowd->one_offs[i];
    return one.cost;
}

/* Ask a table with the facts of some characters: each is offered for each of some roles; facts of no role are those of the first. 0 with
 * too little room. */
static inline int cdbm_ask_of_all(const cdbm_crowd *crowd, size_t table, size_t set, const size_t *who, size_t n, cdbm_table_input *to, cdbm_room *room)
{
    const cdb_any *any = crowd->player.opened[table];
    const cdb_schema *schema = &any->schema;
    size_t n_tables = crowd->player.n_tables, i, k;
    cdb_fact *facts = (cdb_fact *)cdbm_part(room, schema->n_conditions * sizeof *facts);
    cdb_actor *offers = (cdb_actor *)cdbm_part(room, n * CDB_MOST_ROLES * sizeof *offers);
    const char *role;
    if (!facts || !offers) return 0;
    memcpy(facts, crowd->lists[who[0] * n_tables + table], schema->n_conditions * sizeof *facts);
    to->facts = facts, to->offers = offers, to->n_offers = 0;
    for (k = 0; (role = cdbm_role_name(&crowd->player, set, k)) != NULL; k++) {
        int number = cdb_role_number(&any->table, role);
        for (i = 0; i < schema->n_conditions; i++)
            if (cdbi_is_of_role(schema->conditions[i].name, role, strlen(role))) facts[i] = cdbi_missing(&schema->conditions[i]);
        for (i = 0; number >= 0 && i < n; i++) {
            cdb_actor *offer = &offers[to->n_offers++];
            offer->role = number, offer->id = (int64_t)i, offer->cost = cdb_missing_number(), offer->facts = crowd->lists[who[i] * n_tables + table];
        }
    }
    return 1;
}

/* Let some characters, at most CDBM_MOST_MEETING, play a clip of several roles together from the next update on: of the joint databases of
 * a name the clip, frame and cast that cost least, of those that the facts of each for its roles let. Gives what it costs: they play
 * where that is at most `most`; who is not cast goes on. Infinite where nothing may play, NaN where there is no such set, a
 * character is none or there twice, or a fact is refused. Of databases with the features of the controller. */
CDB_API double cdbm_meet_ones(cdbm_crowd *crowd, const char *name, const size_t *who, size_t n, double most)
{
    const cdbm_player *player = &crowd->player;
    size_t databases[CDBM_MOST_DATABASES], n_databases, n_features = player->controller.n_features, i, k;
    double thresholds[CDBM_MOST_DATABASES];
    int set = cdbm_set_number(player, name);
    cdbm_table_input tables[CDBM_MOST_TABLES];
    cdbm_room room = crowd->room;
    cdbm_together together;
    cdbm_joint_hit hit;
    cdbm_actor *actors = (cdbm_actor *)cdbm_part(&room, n < CDBM_MOST_MEETING ? n * sizeof *actors : CDBM_MOST_MEETING * sizeof *actors);
    n_databases = set < 0 ? 0 : cdbm_databases_of(player, (size_t)set, databases, thresholds);
    if (n_databases == 0 || n < 1 || n > CDBM_MOST_MEETING || !actors || player->frames[databases[0]].n_features != n_features) return NAN;
    memset(&together, 0, sizeof together), memset(tables, 0, sizeof tables);
    for (i = 0; i < n; i++) {
        double *query = (double *)cdbm_part(&room, n_features * sizeof *query);
        for (k = 0; k < i && who[k] != who[i]; k++) {}
        if (who[i] >= crowd->n || k < i || !query) return NAN;
        cdbm_take_part(player, crowd->states + who[i] * cdbm_state_width(player), query, &actors[i]);
    }
    for (i = 0; i < n_databases; i++) {
        int64_t table = player->table_of[databases[i]];
        if (table >= 0 && !tables[table].facts && !cdbm_ask_of_all(crowd, (size_t)table, (size_t)set, who, n, &tables[table], &room)) return NAN;
    }
    together.set = (size_t)set, together.actors = actors, together.n_actors = n, together.tables = tables;
    together.unknown = crowd->inputs[who[0]].unknown, together.fault = &crowd->fault;
    if (cdbm_choose_together(player, &together, &hit, room) != 1) return NAN;
    for (k = 0; hit.range >= 0 && hit.cost <= most && k < hit.n_roles; k++) {
        size_t one = who[hit.cast[k]];
        crowd->one_offs[one] = hit.one_offs[k], crowd->inputs[one].one_off = &crowd->one_offs[one];
    }
    return hit.cost;
}

/* Let a character go on from a state, as its CDBM_STATE_NUMBERS were once, here or elsewhere. 0 where it is none of such a character. */
CDB_API int cdbm_restore_one(cdbm_crowd *crowd, size_t i, const double *state)
{
    if (i >= crowd->n || !cdbm_is_state(&crowd->player, state)) return 0;
    memcpy(crowd->states + i * cdbm_state_width(&crowd->player), state, cdbm_state_size(&crowd->player));
    crowd->inputs[i].one_off = NULL;
    return 1;
}

/* The velocity that a stick asks for, m/s, and the heading, NaN: where the body goes. 0 where there is no character of that number. */
CDB_API int cdbm_steer_one(cdbm_crowd *crowd, size_t i, double x, double z, double facing)
{
    if (i >= crowd->n) return 0;
    crowd->inputs[i].goal.velocity[0] = x, crowd->inputs[i].goal.velocity[1] = z, crowd->inputs[i].goal.facing = facing;
    return 1;
}

/* A tag of the markup that is to begin, and in how many seconds: to be given before each update until then, and NULL behind it. The text
 * stays where it is while it is asked for. 0 where there is no character of that number, or no database has such an event. */
CDB_API int cdbm_event_one(cdbm_crowd *crowd, size_t i, const char *event, double in_s)
{
    if (i >= crowd->n || (event && !cdbm_event_name(&crowd->player, event))) return 0;
    crowd->inputs[i].event = event, crowd->inputs[i].event_s = in_s;
    return 1;
}

/* Update all; why they stand where they stood, or NULL. A fault names the fact that a table refused, and is else without a name. */
CDB_API const char *cdbm_update_crowd(cdbm_crowd *crowd, double dt_s, cdb_fault *fault)
{
    size_t i;
    int is_done;
    memset(&crowd->fault, 0, sizeof crowd->fault);
    for (i = 0; i < crowd->n; i++) /* one that is over was displayed to its end */
        if (crowd->inputs[i].one_off && cdbm_is_over(&crowd->player, crowd->inputs[i].one_off)) crowd->inputs[i].one_off = NULL;
    is_done = cdbm_update_all(&crowd->player, crowd->n, crowd->states, dt_s, crowd->inputs, crowd->poses, crowd->room);
    if (fault) *fault = crowd->fault;
    if (is_done == 1) return NULL;
    return is_done == -2 ? crowd->fault.reason : "a time or what is asked for is no finite number";
}

/* The numbers of a character: those of its pose, as in cdbm_pose, or its state. NULL for none. */
CDB_API const double *cdbm_crowd_numbers(const cdbm_crowd *crowd, size_t i, int what)
{
    if (i >= crowd->n) return NULL;
    switch (what) {
    case CDBM_ROOT_NUMBERS: return crowd->poses[i].root;
    case CDBM_ROTATION_NUMBERS: return crowd->poses[i].rotations;
    case CDBM_TRANSLATION_NUMBERS: return crowd->poses[i].translations;
    case CDBM_POSITION_NUMBERS: return crowd->poses[i].positions;
    default: return what == CDBM_STATE_NUMBERS ? crowd->states + i * cdbm_state_width(&crowd->player) : NULL;
    }
}

/* What is displayed, what the character did below and why, or the name of a joint; "" for none. */
CDB_API const char *cdbm_crowd_text(const cdbm_crowd *crowd, size_t i, int what)
{
    const char *text = NULL;
    if (what == CDBM_JOINT_TEXT) text = i < crowd->player.poses.rig.n_joints ? cdbm_joint_name(&crowd->player, i) : NULL;
    else if (i >= crowd->n) return "";
    else if (what == CDBM_ASSET_TEXT && crowd->inputs[i].one_off) {
        cdbm_playing playing = cdbm_playing_of(&crowd->player.clips[(size_t)crowd->one_offs[i].database], &crowd->one_offs[i]);
        text = cdbm_asset(&crowd->player, &playing);
    } else if (what == CDBM_ASSET_TEXT) text = cdbm_asset(&crowd->player, &crowd->poses[i].decision.playing);
    else if (what == CDBM_ACTION_TEXT) text = cdbm_action_name(&crowd->poses[i].decision);
    else if (what == CDBM_REASON_TEXT) text = cdbm_reason(&crowd->poses[i].decision);
    return text ? text : "";
}
