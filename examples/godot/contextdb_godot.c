/* The library of contextdb for Godot 3, by GDNative: one for all tables and bundles, also for those of tomorrow. Two classes:
 *
 *   ContextTable         asks a compiled table; one character has one
 *       open(path, seed) -> ""           or why the compiled file is refused
 *       query(facts) -> [row, ...]       facts: a Dictionary by name; what it leaves out stays as it was, null is not known
 *       pick(time_s) -> row              one of the rows of the last query by the table's policy; -1 for none
 *       asset(row) -> text               of a row, or the fallback for -1
 *       digest() -> number               equal on two machines that picked the same
 *       problem() -> text                what was wrong with the last query or pick, or ""
 *
 *   ContextCharacters    plays characters of a bundle: see context_characters.h */

#define CDB_FILES
#include "cdb_link.h"
#include <stdio.h>
#include "contextdb_motion.h"
#include "godot.h"
#include "context_facts.h"
#include "context_link.h"
#include "context_characters.h"

typedef struct context_table {
    void *bytes;
    cdb_any *any;
    cdb_live *live;
    facts facts;
    uint64_t *rows;
    cdb_picker picker;
    cdb_rest *rests;
    sentence problem;
} context_table;

static void drop_table(context_table *own)
{
    drop_facts(&own->facts);
    free(own->live);
    free(own->rows);
    free(own->rests);
    cdb_close_any(own->any);
    CDB_FREE(own->bytes);
    memset(own, 0, sizeof *own);
}

METHOD(open_table)
{
    cdb_fault fault;
    size_t size = 0;
    char *path;
    BEGIN(context_table, 2);
    if (own->problem[0]) return of_text(own->problem);
    drop_table(own);
    path = text_of(arguments[0]);
    own->bytes = path ? cdb_read_file(path, &size, &fault) : NULL;
    free(path);
    own->any = own->bytes ? cdb_open_any(own->bytes, size, &fault) : NULL;
    if (!own->any) {
        say(own->problem, fault.name, fault.reason);
        return of_text(own->problem);
    }
    own->rows = (uint64_t *)calloc(own->any->table.n_words + 1, sizeof(uint64_t));
    own->rests = (cdb_rest *)calloc(own->any->table.n_limited + 1, sizeof(cdb_rest));
    own->live = (cdb_live *)malloc(cdb_live_bytes(&own->any->schema));
    if (!own->rows || !own->rests || !own->live || !begin_facts(&own->facts, cdb_live_of(own->any, CDB_UNKNOWN_ERROR, own->live))) {
        drop_table(own);
        return of_text("there is not enough memory");
    }
    own->picker = cdb_new_picker((uint64_t)as_int(arguments[1]), 0, 1);
    own->picker.rests = own->rests;
    own->picker.n_rests = own->any->table.n_limited;
    return of_text("");
}

METHOD(query)
{
    cdb_fault fault;
    handle array;
    int64_t row;
    BEGIN(context_table, 1);
    array_new(&array);
    if (!own->any) say(own->problem, "", "no table is open");
    else if (!own->problem[0] && set_all(&own->facts, arguments[0], own->problem)) {
        if (cdb_live_query(own->live, own->rows, own->any->table.n_words, &fault) != CDB_OK) say(own->problem, fault.name, fault.reason);
        for (row = -1; (row = cdb_next_row(own->rows, own->any->table.n_words, row)) >= 0;) append(&array, of_int(row));
    }
    return of_array(&array);
}

METHOD(pick)
{
    cdb_fault fault;
    int64_t row = -1;
    BEGIN(context_table, 1);
    if (!own->any) say(own->problem, "", "no table is open");
    else if (!own->problem[0]
        && cdb_live_pick(own->live, own->rows, own->any->table.n_words, as_real(arguments[0]), &own->picker, &row, &fault) != CDB_OK)
        say(own->problem, fault.name, fault.reason);
    return of_int(row);
}

METHOD(asset)
{
    const char *name = NULL;
    BEGIN(context_table, 1);
    if (own->any && !own->problem[0]) name = cdb_asset_of(&own->any->table, as_int(arguments[0]));
    return of_text(name ? name : "");
}

METHOD(digest)
{
    BEGIN(context_table, 0);
    return of_int((int64_t)cdb_digest(&own->picker));
}

METHOD(problem)
{
    (void)object; (void)data; (void)n; (void)arguments;
    return of_text(((context_table *)user)->problem);
}

static void *create_table(void *object, void *data)
{
    (void)object; (void)data;
    return calloc(1, sizeof(context_table));
}

static void destroy_table(void *object, void *data, void *user)
{
    (void)object; (void)data;
    drop_table((context_table *)user);
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
    static const class_method methods[] = {
        {"open", open_table}, {"query", query}, {"pick", pick}, {"asset", asset}, {"digest", digest}, {"problem", problem}};
    register_class(library, "ContextTable", create_table, destroy_table, methods, sizeof methods / sizeof *methods);
    register_characters(library);
}
