/* Facts that GDScript sets: a Dictionary by name. What it leaves out stays as it was, null is not known. */

typedef struct facts {
    cdb_live *live;
    char **held;                    /* of each condition the text that its fact is, or the block of its tags */
} facts;

static void drop_facts(facts *own)
{
    size_t i;
    for (i = 0; own->held && i < own->live->schema->n_conditions; i++) free(own->held[i]);
    free(own->held);
    memset(own, 0, sizeof *own);
}

static int begin_facts(facts *own, cdb_live *live)
{
    own->live = live;
    own->held = (char **)calloc(live->schema->n_conditions + 1, sizeof(char *));
    return own->held != NULL;
}

typedef char sentence[2 * CDB_NAME_BYTES + 64]; /* what is wrong, or "" */

static void say(char *to, const char *name, const char *reason)
{
    snprintf(to, sizeof(sentence), "%s%s%s", name, *name ? ": " : "", reason);
}

/* Set a tag fact. Where none are declared the names are kept. */
static cdb_status set_tags(facts *own, int at, const variant *value)
{
    handle array = as_array(value);
    int n = array_size(&array), i;
    char **names = (char **)calloc((size_t)n + 1, sizeof *names), *block;
    size_t room = ((size_t)n + 1) * sizeof *names;
    cdb_status status;
    for (i = 0; names && i < n; i++) {
        variant tag = array_get(&array, i);
        names[i] = text_of(&tag);
        room += names[i] ? strlen(names[i]) + 1 : 0;
        variant_destroy(&tag);
    }
    array_destroy(&array);
    block = (char *)malloc(room);
    if (names && block) {
        const char **listed = (const char **)(void *)block;
        char *to = block + ((size_t)n + 1) * sizeof *names;
        for (i = 0; i < n; i++) {
            listed[i] = strcpy(to, names[i] ? names[i] : "");
            to += strlen(to) + 1;
        }
        status = cdb_set_tags(own->live, at, listed, (size_t)n);
    } else status = CDB_NO_MEMORY;
    for (i = 0; names && i < n; i++) free(names[i]);
    free(names);
    if (status != CDB_OK) free(block);
    else {
        free(own->held[at]);
        own->held[at] = block;
    }
    return status;
}

static cdb_status set(facts *own, int at, const variant *value)
{
    char *text;
    cdb_status status;
    switch (variant_type(value)) {
    case NIL: return cdb_set_missing(own->live, at);
    case BOOL:
    case INT: return cdb_set_whole(own->live, at, as_int(value));
    case REAL: return cdb_set_number(own->live, at, as_real(value));
    case ARRAY: return set_tags(own, at, value);
    case STRING:
        text = text_of(value);
        status = text ? cdb_set_text(own->live, at, text) : CDB_NO_MEMORY;
        if (status != CDB_OK) free(text);
        else {
            free(own->held[at]);
            own->held[at] = text;
        }
        return status;
    default: return CDB_WRONG_FACT;
    }
}

/* Set the facts of a Dictionary; those that the table does not ask for are passed over. */
static int set_all(facts *own, const variant *given, char *why)
{
    handle dictionary = as_dictionary(given), keys = dictionary_keys(&dictionary);
    int n = array_size(&keys), i, is_right = 1;
    for (i = 0; i < n && is_right; i++) {
        variant key = array_get(&keys, i), value = dictionary_get(&dictionary, &key);
        char *name = text_of(&key);
        int at = name ? cdb_condition_number(own->live->schema, name) : -1;
        is_right = at < 0 || set(own, at, &value) == CDB_OK;
        if (!is_right) say(why, name, "the fact is not one that the condition can have");
        free(name);
        variant_destroy(&value);
        variant_destroy(&key);
    }
    array_destroy(&keys);
    dictionary_destroy(&dictionary);
    return is_right;
}

#define METHOD(name) static variant name(void *object, void *data, void *user, int n, variant **arguments)
#define BEGIN(type, n_arguments) \
    type *own = (type *)user; \
    (void)object; (void)data; (void)arguments; \
    own->problem[0] = 0; \
    if (n != (n_arguments)) say(own->problem, "", "the method takes another number of arguments")
