/* ContextCharacters: characters of one bundle, updated in one call. They are counted from 0.
 *
 *   open(path, controller, n) -> ""       or why the bundle is refused; [controllers.CONTROLLER]
 *   place(i, x, z, heading)               stand there, with nothing played yet
 *   steer(i, x, z, facing, facts)         the velocity that the stick asks for, m/s; a heading or null; a Dictionary for the tables
 *   update(dt) -> ""                      or what was wrong: then all stand where they stood
 *   asset(i), why(i) -> text              what plays, and what it did and why
 *   root(i) -> [x, z, heading]            of the pose
 *   rotations(i) -> [x, y, z, w, ...]     of the joints against their parents
 *   positions(i) -> [x, y, z, ...]        of the joints in the world
 *   joints() -> [name, ...], parents() -> [number, ...]
 *   problem() -> text                     what was wrong with the last call, or "" */

typedef struct characters {
    void *bytes;
    cdbm_player *player;
    size_t n;
    double *states;
    cdbm_pose *poses;
    cdbm_input *inputs;
    char *of_poses;
    cdbm_room room;
    facts *facts;                   /* [n, tables] */
    const cdb_fact **lists;         /* [n, tables] */
    cdb_fault fault;
    sentence problem;
} characters;

static void drop_characters(characters *own)
{
    size_t i;
    for (i = 0; own->facts && i < own->n * own->player->n_tables; i++) drop_facts(&own->facts[i]);
    if (own->player) cdbm_close_player(own->player);
    free(own->player), free(own->states), free(own->poses), free(own->inputs), free(own->of_poses), free(own->room.at);
    free(own->facts), free(own->lists);
    CDB_FREE(own->bytes);
    memset(own, 0, sizeof *own);
}

/* Take memory for n characters, and let each begin. */
static int begin_characters(characters *own, size_t n)
{
    const cdbm_player *player = own->player;
    size_t n_tables = player->n_tables, i;
    own->states = (double *)calloc(n, cdbm_state_size(player)), own->poses = (cdbm_pose *)calloc(n, sizeof *own->poses);
    own->inputs = (cdbm_input *)calloc(n, sizeof *own->inputs), own->of_poses = (char *)calloc(n, cdbm_pose_size(player));
    own->room.left = cdbm_room_size(player, n), own->room.at = (char *)malloc(own->room.left);
    own->lists = (const cdb_fact **)calloc(n * n_tables + 1, sizeof *own->lists);
    own->facts = (facts *)calloc(n * n_tables + 1, sizeof *own->facts);
    if (!own->states || !own->poses || !own->inputs || !own->of_poses || !own->room.at || !own->lists || !own->facts) return 0;
    own->n = n;
    for (i = 0; i < n * n_tables; i++) {
        if (!begin_facts(&own->facts[i], player->opened[i % n_tables], CDB_UNKNOWN_ERROR)) return 0;
        own->lists[i] = own->facts[i].live->facts;
    }
    for (i = 0; i < n; i++) {
        own->inputs[i].goal.facing = NAN, own->inputs[i].facts = own->lists + i * n_tables, own->inputs[i].fault = &own->fault;
        cdbm_lay_out(player, &own->poses[i], own->of_poses + i * cdbm_pose_size(player));
        cdbm_begin(player, own->states + i * cdbm_state_width(player), 0.0, 0.0, 0.0);
    }
    return 1;
}

/* Why n characters of a bundle that was read cannot be opened, or NULL. */
static const char *open_bundle(characters *own, size_t size, const char *controller, int64_t n)
{
    cdbm_bundle bundle;
    const char *why = cdbm_open_bundle(&bundle, own->bytes, size);
    own->player = why ? NULL : (cdbm_player *)calloc(1, sizeof *own->player);
    if (own->player) why = cdbm_open_player(own->player, &bundle, controller);
    if (why) return why;
    if (n < 1 || n > 100000) return "the number of characters is not from 1 to 100000";
    return own->player && begin_characters(own, (size_t)n) ? NULL : "there is not enough memory";
}

METHOD(open_characters)
{
    cdb_fault fault;
    size_t size = 0;
    char *path, *controller;
    BEGIN(characters, 3);
    if (own->problem[0]) return of_text(own->problem);
    drop_characters(own);
    path = text_of(arguments[0]), controller = text_of(arguments[1]);
    own->bytes = path ? cdb_read_file(path, &size, &fault) : NULL;
    if (!own->bytes) say(own->problem, fault.name, fault.reason);
    else {
        const char *why = open_bundle(own, size, controller, as_int(arguments[2]));
        if (why) say(own->problem, "", why);
    }
    free(path), free(controller);
    if (own->problem[0]) {
        variant refusal = of_text(own->problem);
        drop_characters(own);
        return refusal;
    }
    return of_text("");
}

/* The number of the character that a method is called for, the first of its arguments; -1, with a problem, for none. */
static int64_t number_of(characters *own, variant **arguments)
{
    int64_t i = own->problem[0] ? -1 : as_int(arguments[0]);
    if (!own->problem[0] && (i < 0 || (uint64_t)i >= own->n)) say(own->problem, "", own->n ? "there is no character of that number" : "no bundle is open");
    return own->problem[0] ? -1 : i;
}

METHOD(place)
{
    int64_t i;
    BEGIN(characters, 4);
    i = number_of(own, arguments);
    if (i >= 0)
        cdbm_begin(own->player, own->states + (size_t)i * cdbm_state_width(own->player), as_real(arguments[1]), as_real(arguments[2]),
            as_real(arguments[3]));
    return of_text(own->problem);
}

METHOD(steer)
{
    int64_t i;
    size_t table;
    BEGIN(characters, 5);
    i = number_of(own, arguments);
    if (i < 0) return of_text(own->problem);
    own->inputs[i].goal.velocity[0] = as_real(arguments[1]), own->inputs[i].goal.velocity[1] = as_real(arguments[2]);
    own->inputs[i].goal.facing = variant_type(arguments[3]) == NIL ? (double)NAN : as_real(arguments[3]);
    for (table = 0; table < own->player->n_tables && !own->problem[0]; table++)
        set_all(&own->facts[(size_t)i * own->player->n_tables + table], arguments[4], own->problem);
    return of_text(own->problem);
}

METHOD(update)
{
    int is_done;
    BEGIN(characters, 1);
    if (!own->n) say(own->problem, "", "no bundle is open");
    if (own->problem[0]) return of_text(own->problem);
    is_done = cdbm_update_all(own->player, own->n, own->states, as_real(arguments[0]), own->inputs, own->poses, own->room);
    if (is_done == -2) say(own->problem, own->fault.name, own->fault.reason);
    else if (is_done != 1) say(own->problem, "", "a number is none");
    return of_text(own->problem);
}

METHOD(asset_of)
{
    int64_t i;
    const char *name;
    BEGIN(characters, 1);
    i = number_of(own, arguments);
    name = i < 0 ? NULL : cdbm_asset(own->player, &own->poses[i].decision.playing);
    return of_text(name ? name : "");
}

METHOD(why)
{
    int64_t i;
    char text[128] = "";
    BEGIN(characters, 1);
    i = number_of(own, arguments);
    if (i >= 0) snprintf(text, sizeof text, "%s: %s", cdbm_action_name(&own->poses[i].decision), cdbm_reason(&own->poses[i].decision));
    return of_text(text);
}

METHOD(root)
{
    int64_t i;
    BEGIN(characters, 1);
    i = number_of(own, arguments);
    return of_reals(i < 0 ? NULL : own->poses[i].root, i < 0 ? 0 : 3);
}

METHOD(rotations)
{
    int64_t i;
    BEGIN(characters, 1);
    i = number_of(own, arguments);
    return of_reals(i < 0 ? NULL : own->poses[i].rotations, i < 0 ? 0 : 4 * own->player->poses.rig.n_joints);
}

METHOD(positions)
{
    int64_t i;
    BEGIN(characters, 1);
    i = number_of(own, arguments);
    return of_reals(i < 0 ? NULL : own->poses[i].positions, i < 0 ? 0 : 3 * own->player->poses.rig.n_joints);
}

METHOD(joints)
{
    size_t j;
    handle array;
    BEGIN(characters, 0);
    array_new(&array);
    for (j = 0; own->player && j < own->player->poses.rig.n_joints; j++) {
        const char *name = cdbm_joint_name(own->player, j);
        append(&array, of_text(name ? name : ""));
    }
    return of_array(&array);
}

METHOD(parents)
{
    size_t j;
    handle array;
    BEGIN(characters, 0);
    array_new(&array);
    for (j = 0; own->player && j < own->player->poses.rig.n_joints; j++) append(&array, of_int(own->player->poses.rig.parents[j]));
    return of_array(&array);
}

METHOD(problem_of_characters)
{
    (void)object; (void)data; (void)n; (void)arguments;
    return of_text(((characters *)user)->problem);
}

static void *create_characters(void *object, void *data)
{
    (void)object; (void)data;
    return calloc(1, sizeof(characters));
}

static void destroy_characters(void *object, void *data, void *user)
{
    (void)object; (void)data;
    drop_characters((characters *)user);
    free(user);
}

static void register_characters(void *library)
{
    static const class_method methods[] = {
        {"open", open_characters}, {"place", place}, {"steer", steer}, {"update", update}, {"asset", asset_of}, {"why", why}, {"root", root},
        {"rotations", rotations}, {"positions", positions}, {"joints", joints}, {"parents", parents}, {"problem", problem_of_characters}};
    register_class(library, "ContextCharacters", create_characters, destroy_characters, methods, sizeof methods / sizeof *methods);
}
