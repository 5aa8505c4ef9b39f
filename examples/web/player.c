/* What the page calls: characters of one bundle, and the rows and cells of its first table. */
#include <stdlib.h>
#include "contextdb_motion.h"

#define EXPORT(name) __attribute__((export_name(name)))
#define MOST_CONDITIONS 32

static cdbm_crowd *crowd;
static cdb_fault fault;
static uint64_t rows[64];
static int reasons[MOST_CONDITIONS];

static const cdb_any *table(void)
{
    return cdbm_crowd_table(crowd, 0);
}

EXPORT("alloc") void *alloc_bytes(size_t n)
{
    return malloc(n);
}

/* Open a bundle for so many characters; why it is refused, NULL where it is not. */
EXPORT("open") const char *open_player(const void *bytes, size_t size, int n)
{
    const char *why;
    crowd = cdbm_open_crowd(bytes, size, NULL, (size_t)n, CDB_UNKNOWN_ANY, &why);
    if (crowd && (!table() || table()->schema.n_conditions > MOST_CONDITIONS || table()->table.n_words > 64)) why = "too much";
    return why;
}

EXPORT("begin") void begin(int i, double x, double z, double heading)
{
    cdbm_place_one(crowd, (size_t)i, x, z, heading);
}

EXPORT("steer") void steer(int i, double x, double z)
{
    cdbm_steer_one(crowd, (size_t)i, x, z, NAN);
}

EXPORT("set_fact") void set_fact(int i, int condition, double number)
{
    cdb_set_number(cdbm_crowd_live(crowd, (size_t)i, 0), condition, number);
}

/* Update the first n. */
EXPORT("update") int update(int n, double dt_s)
{
    return cdbm_update_all(&crowd->player, (size_t)n, crowd->states, dt_s, crowd->inputs, crowd->poses, crowd->room);
}

EXPORT("n_joints") int n_joints(void)
{
    return (int)cdbm_crowd_size(crowd, CDBM_N_JOINTS);
}

EXPORT("parent") int parent(int joint)
{
    return cdbm_crowd_parent(crowd, (size_t)joint);
}

EXPORT("positions") const double *positions(int i)
{
    return cdbm_crowd_numbers(crowd, (size_t)i, CDBM_POSITION_NUMBERS);
}

EXPORT("rotations") const double *rotations(int i)
{
    return cdbm_crowd_numbers(crowd, (size_t)i, CDBM_ROTATION_NUMBERS);
}

EXPORT("root") const double *root(int i)
{
    return cdbm_crowd_numbers(crowd, (size_t)i, CDBM_ROOT_NUMBERS);
}

EXPORT("state") const double *state_of(int i)
{
    return cdbm_crowd_numbers(crowd, (size_t)i, CDBM_STATE_NUMBERS);
}

EXPORT("state_bytes") size_t state_bytes(void)
{
    return cdbm_crowd_size(crowd, CDBM_STATE_BYTES);
}

EXPORT("asset") const char *asset(int i)
{
    return cdbm_crowd_text(crowd, (size_t)i, CDBM_ASSET_TEXT);
}

EXPORT("time_s") double time_s(int i)
{
    return crowd->poses[i].decision.playing.at_s;
}

EXPORT("action") const char *action(int i)
{
    return cdbm_crowd_text(crowd, (size_t)i, CDBM_ACTION_TEXT);
}

EXPORT("reason") const char *reason(int i)
{
    return cdbm_crowd_text(crowd, (size_t)i, CDBM_REASON_TEXT);
}

/* ---- the table */

EXPORT("n_rows") int n_rows(void)
{
    return (int)table()->table.n_rows;
}

EXPORT("row_asset") const char *row_asset(int row)
{
    return table()->table.assets[row];
}

EXPORT("n_conditions") int n_conditions(void)
{
    return (int)table()->schema.n_conditions;
}

EXPORT("condition") const char *condition(int at)
{
    return table()->schema.conditions[at].name;
}

/* How many classes of facts a column tells apart; 0 where they are not kept one by one. */
EXPORT("n_classes") int n_classes(int at)
{
    const cdb_column *column = &table()->columns[at];
    return column->kind == CDBI_VALUE || column->kind == CDBI_FLAT ? (int)column->n_masks - 1 : 0;
}

/* What a class is: the name of a value, or "" for numbers between two bounds. */
EXPORT("class_name") const char *class_name(int at, int number)
{
    const cdb_condition *own = &table()->schema.conditions[at];
    return (size_t)number < own->n_values ? own->values[number] : "";
}

/* A bound between a class of numbers and the next. */
EXPORT("bound") double bound(int at, int number)
{
    const cdb_column *column = &table()->columns[at];
    return (size_t)number < column->n_bounds ? column->bounds[number] : NAN;
}

static uint64_t *word_of(int row, int at, int number)
{
    const cdb_column *column = &table()->columns[at];
    return (uint64_t *)(uintptr_t)(column->masks + (size_t)number * table()->table.n_words + (size_t)row / 64);
}

EXPORT("accepts") int accepts(int row, int at, int number)
{
    return (int)(*word_of(row, at, number) >> (row % 64) & 1);
}

/* Let a cell accept a class of facts, or not: the bit of the row in the class's mask, which lies in the bundle's own bytes. */
EXPORT("accept") void accept(int row, int at, int number, int is_accepted)
{
    uint64_t bit = (uint64_t)1 << (row % 64), *word = word_of(row, at, number);
    *word = is_accepted ? *word | bit : *word & ~bit;
}

/* The facts of a character, with those that it knows itself. */
static const cdb_fact *facts_of(int i)
{
    static cdb_fact own[MOST_CONDITIONS];
    for (size_t k = 0; k < table()->schema.n_conditions; k++) {
        own[k] = cdbm_crowd_live(crowd, (size_t)i, 0)->facts[k];
        cdbm_add_own(&crowd->player, 0, k, state_of(i), &crowd->inputs[i].goal, &own[k]);
    }
    return own;
}

/* Ask the table with the facts of a character. */
EXPORT("ask") int ask(int i)
{
    return cdb_query(&table()->table, table()->columns, &table()->schema, facts_of(i), CDB_UNKNOWN_ANY, rows, 64, &fault);
}

EXPORT("is_valid") int is_valid(int row)
{
    return (int)(rows[row / 64] >> (row % 64) & 1);
}

/* The conditions that keep a row from being valid: how many, and which. */
EXPORT("why_not") int why_not(int i, int row)
{
    size_t n = 0;
    if (cdb_why_not(&table()->table, table()->columns, &table()->schema, facts_of(i), CDB_UNKNOWN_ANY, row, reasons, MOST_CONDITIONS, &n, &fault)
        != CDB_OK) return 0;
    return (int)n;
}

EXPORT("why_not_condition") int why_not_condition(int number)
{
    return reasons[number];
}

EXPORT("fact_number") double fact_number(int i, int at)
{
    const cdb_condition *own = &table()->schema.conditions[at];
    const cdb_fact *fact = &facts_of(i)[at];
    return own->type == CDB_NUMBER || own->type == CDB_ANGLE ? fact->number : (double)fact->whole;
}
