/* ContextCharacters: characters of one bundle, updated in one call. They are counted from 0.
 *
 *   open(path, controller, n) -> ""       or why the bundle is refused; [controllers.CONTROLLER]
 *   place(i, x, z, heading)               stand there, with nothing played yet
 *   steer(i, x, z, facing, facts)         the velocity that the stick asks for, m/s; a heading or null; a Dictionary for the tables
 *   update(dt) -> ""                      or what was wrong: then all stand where they stood
 *   publish(game) -> name                 of the link by which each update is published from now on; "" where there can be none
 *   asset(i), why(i) -> text              what plays, and what it did and why
 *   root(i) -> [x, z, heading]            of the pose
 *   rotations(i) -> [w, x, y, z, ...]     of the joints against their parents
 *   positions(i) -> [x, y, z, ...]        of the joints in the world
 *   joints() -> [name, ...], parents() -> [number, ...]
 *   problem() -> text                     what was wrong with the last call, or "" */

typedef struct characters {
    void *bytes;
    cdbm_crowd *crowd;
    facts *facts;                   /* [n, tables] */
    publishing *published;          /* or NULL */
    sentence problem;
} characters;

static void drop_characters(characters *own)
{
    size_t n = own->crowd ? cdbm_crowd_size(own->crowd, CDBM_N_CHARACTERS) * cdbm_crowd_size(own->crowd, CDBM_N_TABLES) : 0, i;
    for (i = 0; own->facts && i < n; i++) drop_facts(&own->facts[i]);
    free(own->facts);
    stop_publishing(own->published);
    cdbm_close_crowd(own->crowd);
    CDB_FREE(own->bytes);
    memset(own, 0, sizeof *own);
}

/* Why n characters of a bundle that was read cannot be opened, or NULL. */
static const char *open_crowd(characters *own, size_t size, const char *controller, int64_t n)
{
    const char *why;
    size_t n_tables, i;
    own->crowd = cdbm_open_crowd(own->bytes, size, controller, n > 0 ? (size_t)n : 0, CDB_UNKNOWN_ERROR, &why);
    if (!own->crowd) return why;
    n_tables = cdbm_crowd_size(own->crowd, CDBM_N_TABLES);
    own->facts = (facts *)calloc((size_t)n * n_tables + 1, sizeof *own->facts);
    for (i = 0; own->facts && i < (size_t)n * n_tables; i++)
        if (!begin_facts(&own->facts[i], cdbm_crowd_live(own->crowd, i / n_tables, i % n_tables))) return "there is not enough memory";
    return own->facts ? NULL : "there is not enough memory";
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
        const char *why = open_crowd(own, size, controller, as_int(arguments[2]));
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

/* The number of the character that a method is called for, the first of its arguments; with a problem where there is none. */
static size_t number_of(characters *own, variant **arguments)
{
    int64_t i = own->problem[0] ? -1 : as_int(arguments[0]);
    if (!own->problem[0] && !own->crowd) say(own->problem, "", "no bundle is open");
    if (!own->problem[0] && (i < 0 || (uint64_t)i >= cdbm_crowd_size(own->crowd, CDBM_N_CHARACTERS)))
        say(own->problem, "", "there is no character of that number");
    return own->problem[0] ? 0 : (size_t)i;
}

METHOD(place)
{
    size_t i;
    BEGIN(characters, 4);
    i = number_of(own, arguments);
    if (!own->problem[0]) cdbm_place_one(own->crowd, i, as_real(arguments[1]), as_real(arguments[2]), as_real(arguments[3]));
    return of_text(own->problem);
}

METHOD(steer)
{
    size_t i, table, n_tables;
    BEGIN(characters, 5);
    i = number_of(own, arguments);
    if (own->problem[0]) return of_text(own->problem);
    n_tables = cdbm_crowd_size(own->crowd, CDBM_N_TABLES);
    cdbm_steer_one(own->crowd, i, as_real(arguments[1]), as_real(arguments[2]),
        variant_type(arguments[3]) == NIL ? (double)NAN : as_real(arguments[3]));
    for (table = 0; table < n_tables && !own->problem[0]; table++)
        set_all(&own->facts[i * n_tables + table], arguments[4], own->problem);
    return of_text(own->problem);
}

METHOD(update)
{
    cdb_fault fault;
    const char *why;
    BEGIN(characters, 1);
    if (!own->crowd) say(own->problem, "", "no bundle is open");
    if (own->problem[0]) return of_text(own->problem);
    why = cdbm_update_crowd(own->crowd, as_real(arguments[0]), &fault);
    if (why) say(own->problem, fault.name, why);
    else if (own->published) publish_poses(own->published, own->crowd);
    return of_text(own->problem);
}

METHOD(publish)
{
    char *game;
    BEGIN(characters, 1);
    if (!own->crowd) say(own->problem, "", "no bundle is open");
    if (own->problem[0]) return of_text("");
    stop_publishing(own->published);
    game = text_of(arguments[0]);
    own->published = game ? begin_publishing(own->crowd, game) : NULL;
    free(game);
    return of_text(own->published ? own->published->link.game : "");
}

METHOD(asset_of)
{
    size_t i;
    BEGIN(characters, 1);
    i = number_of(own, arguments);
    return of_text(own->problem[0] ? "" : cdbm_crowd_text(own->crowd, i, CDBM_ASSET_TEXT));
}

METHOD(why)
{
    size_t i;
    char text[128] = "";
    BEGIN(characters, 1);
    i = number_of(own, arguments);
    if (!own->problem[0])
        snprintf(text, sizeof text, "%s: %s", cdbm_crowd_text(own->crowd, i, CDBM_ACTION_TEXT), cdbm_crowd_text(own->crowd, i, CDBM_REASON_TEXT));
    return of_text(text);
}

/* So many numbers of a character, and so many more for each joint. */
static variant numbers(characters *own, variant **arguments, int what, size_t n, size_t n_each)
{
    size_t i = number_of(own, arguments);
    if (own->problem[0]) return of_reals(NULL, 0);
    return of_reals(cdbm_crowd_numbers(own->crowd, i, what), n + n_each * cdbm_crowd_size(own->crowd, CDBM_N_JOINTS));
}

METHOD(root)
{
    BEGIN(characters, 1);
    return numbers(own, arguments, CDBM_ROOT_NUMBERS, 3, 0);
}

METHOD(rotations)
{
    BEGIN(characters, 1);
    return numbers(own, arguments, CDBM_ROTATION_NUMBERS, 0, 4);
}

METHOD(positions)
{
    BEGIN(characters, 1);
    return numbers(own, arguments, CDBM_POSITION_NUMBERS, 0, 3);
}

METHOD(joints)
{
    size_t j;
    handle array;
    BEGIN(characters, 0);
    array_new(&array);
    for (j = 0; own->crowd && j < cdbm_crowd_size(own->crowd, CDBM_N_JOINTS); j++)
        append(&array, of_text(cdbm_crowd_text(own->crowd, j, CDBM_JOINT_TEXT)));
    return of_array(&array);
}

METHOD(parents)
{
    size_t j;
    handle array;
    BEGIN(characters, 0);
    array_new(&array);
    for (j = 0; own->crowd && j < cdbm_crowd_size(own->crowd, CDBM_N_JOINTS); j++) append(&array, of_int(cdbm_crowd_parent(own->crowd, j)));
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
        {"open", open_characters}, {"place", place}, {"steer", steer}, {"update", update}, {"publish", publish}, {"asset", asset_of}, {"why", why}, {"root", root},
        {"rotations", rotations}, {"positions", positions}, {"joints", joints}, {"parents", parents}, {"problem", problem_of_characters}};
    register_class(library, "ContextCharacters", create_characters, destroy_characters, methods, sizeof methods / sizeof *methods);
}
