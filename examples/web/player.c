/* What the page calls: characters of one bundle, and the rows and cells of its first table. */
#include <stdlib.h>
#include "contextdb_motion.h"

#define EXPORT(name) __attribute__((export_name(name)))
#define MOST 64
#define MOST_CONDITIONS 32

static cdbm_bundle bundle;
static cdbm_player player;
static cdbm_room room;
static double *states;
static cdbm_pose poses[MOST];
static cdbm_input inputs[MOST];
static cdb_fact facts[MOST][MOST_CONDITIONS];
static const cdb_fact *lists[MOST][CDBM_MOST_TABLES];
static cdb_fault fault;
static uint64_t rows[64];
static int reasons[MOST_CONDITIONS];
static char name_text[64];

static const cdb_any *table(void)
{
    return player.opened[0];
}

EXPORT("alloc") void *alloc_bytes(size_t n)
{
    return malloc(n);
}

/* Open a bundle for so many characters; why it is refused, NULL where it is not. */
EXPORT("open") const char *open_player(const void *bytes, size_t size, int n)
{
    const char *why = cdbm_open_bundle(&bundle, bytes, size);
    int i;
    if (!why) why = cdbm_open_player(&player, &bundle, NULL);
    if (why) return why;
    if (n > MOST || player.n_tables == 0 || table()->schema.n_conditions > MOST_CONDITIONS || table()->table.n_words > 64) return "too much";
    room.left = cdbm_room_size(&player, (size_t)n), room.at = (char *)malloc(room.left);
    states = (double *)malloc((size_t)n * cdbm_state_size(&player));
    if (!room.at || !states) return "there is not enough memory";
    for (i = 0; i < n; i++) {
        char *memory = (char *)malloc(cdbm_pose_size(&player));
        if (!memory) return "there is not enough memory";
        cdbm_lay_out(&player, &poses[i], memory);
        lists[i][0] = facts[i], inputs[i].facts = lists[i], inputs[i].goal.facing = NAN, inputs[i].fault = &fault;
        inputs[i].unknown = CDB_UNKNOWN_ANY;
        for (size_t k = 0; k < table()->schema.n_conditions; k++) facts[i][k] = cdbi_missing(&table()->schema.conditions[k]);
    }
    return NULL;
}

EXPORT("begin") void begin(int i, double x, double z, double heading)
{
    cdbm_begin(&player, states + (size_t)i * cdbm_state_width(&player), x, z, heading);
}

EXPORT("steer") void steer(int i, double x, double z)
{
    inputs[i].goal.velocity[0] = x, inputs[i].goal.velocity[1] = z;
}

EXPORT("set_fact") void set_fact(int i, int condition, double number)
{
    const cdb_condition *own = &table()->schema.conditions[condition];
    if (own->type == CDB_NUMBER || own->type == CDB_ANGLE) facts[i][condition].number = number;
    else facts[i][condition].whole = (int64_t)number;
}

EXPORT("update") int update(int n, double dt_s)
{
    return cdbm_update_all(&player, (size_t)n, states, dt_s, inputs, poses, room);
}

EXPORT("n_joints") int n_joints(void)
{
    return (int)player.poses.rig.n_joints;
}

EXPORT("parent") int parent(int joint)
{
    return (int)player.poses.rig.parents[joint];
}

EXPORT("positions") const double *positions(int i)
{
    return poses[i].positions;
}

EXPORT("rotations") const double *rotations(int i)
{
    return poses[i].rotations;
}

EXPORT("root") const double *root(int i)
{
    return poses[i].root;
}

EXPORT("state") const double *state_of(int i)
{
    return states + (size_t)i * cdbm_state_width(&player);
}

EXPORT("state_bytes") size_t state_bytes(void)
{
    return cdbm_state_size(&player);
}

EXPORT("asset") const char *asset(int i)
{
    return cdbm_asset(&player, &poses[i].decision.playing);
}

EXPORT("time_s") double time_s(int i)
{
    return poses[i].decision.playing.at_s;
}

EXPORT("cost") double cost(int i)
{
    return poses[i].decision.cost;
}

EXPORT("action") const char *action(int i)
{
    return cdbm_action_name(&poses[i].decision);
}

EXPORT("reason") const char *reason(int i)
{
    return cdbm_reason(&poses[i].decision);
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

/* Ask the table with the facts of a character. */
EXPORT("ask") int ask(int i)
{
    const cdbm_walk *walk = (const cdbm_walk *)(const void *)state_of(i);
    cdb_fact own[MOST_CONDITIONS];
    for (size_t k = 0; k < table()->schema.n_conditions; k++) {
        own[k] = facts[i][k];
        cdbm_add_own(&player, 0, k, walk, &inputs[i].goal, &own[k]);
    }
    return cdb_query(&table()->table, table()->columns, &table()->schema, own, CDB_UNKNOWN_ANY, rows, 64, &fault);
}

EXPORT("is_valid") int is_valid(int row)
{
    return (int)(rows[row / 64] >> (row % 64) & 1);
}

/* The conditions that keep a row from being valid: how many, and which. */
EXPORT("why_not") int why_not(int i, int row)
{
    const cdbm_walk *walk = (const cdbm_walk *)(const void *)state_of(i);
    cdb_fact own[MOST_CONDITIONS];
    size_t n = 0;
    for (size_t k = 0; k < table()->schema.n_conditions; k++) {
        own[k] = facts[i][k];
        cdbm_add_own(&player, 0, k, walk, &inputs[i].goal, &own[k]);
    }
    if (cdb_why_not(&table()->table, table()->columns, &table()->schema, own, CDB_UNKNOWN_ANY, row, reasons, MOST_CONDITIONS, &n, &fault) != CDB_OK)
        return 0;
    return (int)n;
}

EXPORT("why_not_condition") int why_not_condition(int number)
{
    return reasons[number];
}

EXPORT("fact_number") double fact_number(int i, int at)
{
    const cdb_condition *own = &table()->schema.conditions[at];
    cdb_fact fact = facts[i][at];
    cdbm_add_own(&player, 0, (size_t)at, (const cdbm_walk *)(const void *)state_of(i), &inputs[i].goal, &fact);
    return own->type == CDB_NUMBER || own->type == CDB_ANGLE ? fact.number : (double)fact.whole;
}

EXPORT("joint_name") const char *joint_name(int joint)
{
    const char *name = cdbm_joint_name(&player, (size_t)joint);
    return name ? name : name_text;
}
