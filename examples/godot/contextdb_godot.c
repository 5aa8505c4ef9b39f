/* A Godot 3 class ContextTable on the header of contextdb, by GDNative: one library for all tables, also for those of tomorrow.
 *
 *   open(path, seed) -> ""           or why the compiled file is refused
 *   query(facts) -> [row, ...]       facts: a Dictionary by name; what it leaves out stays as it was, null is not known
 *   pick(time_s) -> row              one of the rows of the last query by the table's policy; -1 for none
 *   asset(row) -> text               of a row, or the fallback for -1
 *   digest() -> number               equal on two machines that picked the same
 *   problem() -> text                what was wrong with the last query or pick, or ""
 *
 * Godot hands a library its functions in one table. The few that are used here are declared by their places in it, which are those of
 * all versions 3.x, so Godot's headers are not needed. One character has one ContextTable. */

#define CDB_FILES
#include <stdio.h>
#include <stdlib.h>
#include "tables.h"

typedef struct variant { uint64_t words[3]; } variant;          /* Godot's values, as large as they are */
typedef struct handle { void *data; } handle;                   /* a String, a CharString, an Array, a Dictionary */
typedef void (*function)(void);

typedef struct api { unsigned type, major, minor; const void *next; unsigned n_extensions; const struct api *const *extensions; function functions[722]; } api;
typedef struct scripts { unsigned type, major, minor; const void *next; function register_class, register_tool_class, register_method; } scripts;
typedef struct options { unsigned char in_editor; uint64_t hashes[3]; function reports[2]; void *library; const api *core; const void *path; } options;
typedef struct creating { void *(*create)(void *, void *); void *data; void (*release)(void *); } creating;
typedef struct destroying { void (*destroy)(void *, void *, void *); void *data; void (*release)(void *); } destroying;
typedef struct method { variant (*call)(void *, void *, void *, int, variant **); void *data; void (*release)(void *); } method;
typedef struct attributes { int remote; } attributes;

static const api *godot;
static const scripts *native;

enum { NIL, BOOL, INT, REAL, STRING, ARRAY = 19 };
#define VARIANT_NEW(place, type) ((void (*)(variant *, type))godot->functions[place])
#define VARIANT_AS(place, type) ((type (*)(const variant *))godot->functions[place])
#define variant_type VARIANT_AS(507, int)
#define as_int VARIANT_AS(539, int64_t)
#define as_real VARIANT_AS(540, double)
#define as_string VARIANT_AS(541, handle)
#define as_dictionary VARIANT_AS(555, handle)
#define as_array VARIANT_AS(556, handle)
#define ON_HANDLE(place) ((void (*)(handle *))godot->functions[place])
#define variant_destroy ((void (*)(variant *))godot->functions[570])
#define array_new ON_HANDLE(323)
#define array_get ((variant (*)(const handle *, int))godot->functions[333])
#define array_append ((void (*)(handle *, const variant *))godot->functions[336])
#define array_size ((int (*)(const handle *))godot->functions[356])
#define array_destroy ON_HANDLE(361)
#define dictionary_destroy ON_HANDLE(364)
#define dictionary_keys ((handle (*)(const handle *))godot->functions[372])
#define dictionary_get ((variant (*)(const handle *, const variant *))godot->functions[374])
#define char_data ((const char *(*)(const handle *))godot->functions[572])
#define char_destroy ON_HANDLE(573)
#define string_new ON_HANDLE(574)
#define string_utf8 ((handle (*)(const handle *))godot->functions[678])
#define string_parse ((unsigned char (*)(handle *, const char *))godot->functions[679])
#define string_destroy ON_HANDLE(721)

typedef struct context_table {
    void *bytes;
    cdb_any *any;
    cdb_live *live;
    char **held;                    /* of each condition the text that its fact is, or the block of its tags */
    uint64_t *rows;
    cdb_picker picker;
    cdb_rest *rests;
    char problem[2 * CDB_NAME_BYTES + 64];
} context_table;

static variant of_int(int64_t value)
{
    variant made;
    VARIANT_NEW(512, int64_t)(&made, value);
    return made;
}

static variant of_text(const char *text)
{
    variant made;
    handle string;
    string_new(&string);
    string_parse(&string, text);
    VARIANT_NEW(514, const handle *)(&made, &string);
    string_destroy(&string);
    return made;
}

/* The text of a value, for free(). */
static char *text_of(const variant *value)
{
    handle string = as_string(value), octets = string_utf8(&string);
    size_t length = strlen(char_data(&octets)) + 1;
    char *text = (char *)malloc(length);
    if (text) memcpy(text, char_data(&octets), length);
    char_destroy(&octets);
    string_destroy(&string);
    return text;
}

static void say(context_table *own, const char *name, const char *reason)
{
    snprintf(own->problem, sizeof own->problem, "%s%s%s", name, *name ? ": " : "", reason);
}

static void drop(context_table *own)
{
    size_t i;
    for (i = 0; own->held && i < own->any->schema.n_conditions; i++) free(own->held[i]);
    free(own->held);
    free(own->live);
    free(own->rows);
    free(own->rests);
    cdb_close_any(own->any);
    CDB_FREE(own->bytes);
    memset(own, 0, sizeof *own);
}

/* Set a tag fact. Where none are declared the names are kept. */
static cdb_status set_tags(context_table *own, int at, const variant *value)
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

static cdb_status set(context_table *own, int at, const variant *value)
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
static int set_all(context_table *own, const variant *facts)
{
    handle dictionary = as_dictionary(facts), keys = dictionary_keys(&dictionary);
    int n = array_size(&keys), i, is_right = 1;
    for (i = 0; i < n && is_right; i++) {
        variant key = array_get(&keys, i), value = dictionary_get(&dictionary, &key);
        char *name = text_of(&key);
        int at = name ? cdb_condition_number(&own->any->schema, name) : -1;
        is_right = at < 0 || set(own, at, &value) == CDB_OK;
        if (!is_right) say(own, name, "the fact is not one that the condition can have");
        free(name);
        variant_destroy(&value);
        variant_destroy(&key);
    }
    array_destroy(&keys);
    dictionary_destroy(&dictionary);
    return is_right;
}

#define METHOD(name) static variant name(void *object, void *data, void *user, int n, variant **arguments)
#define BEGIN(n_arguments) \
    context_table *own = (context_table *)user; \
    (void)object; (void)data; \
    own->problem[0] = 0; \
    if (n != (n_arguments)) say(own, "", "the method takes another number of arguments")

METHOD(open_table)
{
    cdb_fault fault;
    size_t size = 0;
    char *path;
    BEGIN(2);
    if (own->problem[0]) return of_text(own->problem);
    drop(own);
    path = text_of(arguments[0]);
    own->bytes = path ? cdb_read_file(path, &size, &fault) : NULL;
    free(path);
    own->any = own->bytes ? cdb_open_any(own->bytes, size, &fault) : NULL;
    if (!own->any) {
        say(own, fault.name, fault.reason);
        return of_text(own->problem);
    }
    own->live = (cdb_live *)malloc(cdb_live_bytes(&own->any->schema));
    own->rows = (uint64_t *)calloc(own->any->table.n_words + 1, sizeof(uint64_t));
    own->held = (char **)calloc(own->any->schema.n_conditions + 1, sizeof(char *));
    own->rests = (cdb_rest *)calloc(own->any->table.n_limited + 1, sizeof(cdb_rest));
    if (!own->live || !own->rows || !own->held || !own->rests) {
        drop(own);
        return of_text("there is not enough memory");
    }
    cdb_live_of(own->any, CDB_UNKNOWN_ERROR, own->live);
    own->picker = cdb_new_picker((uint64_t)as_int(arguments[1]), 0, 1);
    own->picker.rests = own->rests;
    own->picker.n_rests = own->any->table.n_limited;
    return of_text("");
}

METHOD(query)
{
    cdb_fault fault;
    handle array;
    variant made;
    int64_t row;
    BEGIN(1);
    array_new(&array);
    if (!own->any) say(own, "", "no table is open");
    else if (!own->problem[0] && set_all(own, arguments[0])) {
        if (cdb_live_query(own->live, own->rows, own->any->table.n_words, &fault) != CDB_OK) say(own, fault.name, fault.reason);
        for (row = -1; (row = cdb_next_row(own->rows, own->any->table.n_words, row)) >= 0;) {
            variant number = of_int(row);
            array_append(&array, &number);
            variant_destroy(&number);
        }
    }
    VARIANT_NEW(529, const handle *)(&made, &array);
    array_destroy(&array);
    return made;
}

METHOD(pick)
{
    cdb_fault fault;
    int64_t row = -1;
    BEGIN(1);
    if (!own->any) say(own, "", "no table is open");
    else if (!own->problem[0]
        && cdb_live_pick(own->live, own->rows, own->any->table.n_words, as_real(arguments[0]), &own->picker, &row, &fault) != CDB_OK)
        say(own, fault.name, fault.reason);
    return of_int(row);
}

METHOD(asset)
{
    const char *name = NULL;
    BEGIN(1);
    if (own->any && !own->problem[0]) name = cdb_asset_of(&own->any->table, as_int(arguments[0]));
    return of_text(name ? name : "");
}

METHOD(digest)
{
    BEGIN(0);
    (void)arguments;
    return of_int((int64_t)cdb_digest(&own->picker));
}

METHOD(problem)
{
    (void)object; (void)data; (void)n; (void)arguments;
    return of_text(((context_table *)user)->problem);
}

static void *create(void *object, void *data)
{
    (void)object; (void)data;
    return calloc(1, sizeof(context_table));
}

static void destroy(void *object, void *data, void *user)
{
    (void)object; (void)data;
    drop((context_table *)user);
    free(user);
}

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

EXPORTED void godot_gdnative_init(options *given);
EXPORTED void godot_gdnative_terminate(void *given);
EXPORTED void godot_nativescript_init(void *library);

void godot_gdnative_init(options *given)
{
    unsigned i;
    godot = given->core;
    for (i = 0; i < godot->n_extensions; i++)
        if (godot->extensions[i]->type == 1) native = (const scripts *)(const void *)godot->extensions[i];
}

void godot_gdnative_terminate(void *given)
{
    (void)given;
}

void godot_nativescript_init(void *library)
{
    static const struct { const char *name; variant (*call)(void *, void *, void *, int, variant **); } methods[] = {
        {"open", open_table}, {"query", query}, {"pick", pick}, {"asset", asset}, {"digest", digest}, {"problem", problem}};
    creating made = {create, NULL, NULL};
    destroying gone = {destroy, NULL, NULL};
    attributes none = {0};
    size_t i;
    ((void (*)(void *, const char *, const char *, creating, destroying))native->register_class)(library, "ContextTable", "Reference", made, gone);
    for (i = 0; i < sizeof methods / sizeof *methods; i++) {
        method one = {methods[i].call, NULL, NULL};
        ((void (*)(void *, const char *, const char *, attributes, method))native->register_method)(library, "ContextTable", methods[i].name, none, one);
    }
}
