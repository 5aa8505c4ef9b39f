/* A compiled table (a .safetensors artefact of contextdb), read in C99 or C++ without a library.
 *
 *   cdb_open    takes the bytes of an artefact, checks all that will ever be read of them, and keeps pointers into them
 *   cdb_query   the rows that are valid for some facts, one bit a row; takes no memory
 *   cdb_pick    one of these rows, by the policy of the table; its memory is yours
 *   cdb_close   gives back what cdb_open took
 *   cdb_open_any, cdb_live_of    a table whose schema is not known before, and facts that are set by number or name
 *
 * The faces of single tables, further down, call these with types of their own. Bit r % 64 of word r / 64 is row r. A table that is
 * open is never changed and may be asked from several threads. The layout of the file is told in docs/format.md of contextdb.
 */

#if defined(__BYTE_ORDER__) && defined(__ORDER_LITTLE_ENDIAN__)
#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "artefacts of contextdb are little-endian, and so must the machine be that maps them"
#endif
#elif defined(__BIG_ENDIAN__) || defined(__ARMEB__) || defined(__AARCH64EB__) || defined(__MIPSEB__) || defined(_M_PPC)
#error "artefacts of contextdb are little-endian, and so must the machine be that maps them"
#endif

#include <stddef.h>
#include <stdint.h>
#include <string.h>
#ifdef CDB_WATCH
#include <sys/types.h>
#include <sys/stat.h>
#endif
#ifdef CDB_FILES /* define it before this header is included, to have cdb_read_file */
#include <stdio.h>
#endif

#ifndef CDB_MALLOC /* define both to bring your own; cdb_open calls the one, cdb_close the other, nothing else does */
#include <stdlib.h>
#define CDB_MALLOC(size) malloc(size)
#define CDB_FREE(block) free(block)
#endif

#ifndef CDB_API                     /* as a rule every file that includes this has its own functions */
#define CDB_API static inline
#define CDBI_HAS_BODIES 1
#elif defined(CDB_IMPLEMENTATION)   /* with a CDB_API of yours, that exports or is nothing, one file has those of all, and defines this */
#define CDBI_HAS_BODIES 1
#else
#define CDBI_HAS_BODIES 0
#endif

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)               /* what a query does for each fact is worth its place wherever it is called */
#define CDBI_HOT static inline __attribute__((always_inline))
#else
#define CDBI_HOT static inline
#endif

typedef char cdbi_doubles_have_8_bytes[sizeof(double) == 8 ? 1 : -1];

#define CDB_FALSE 0
#define CDB_TRUE 1
#define CDB_MISSING (-1)            /* a bool, an enum or a list of tags that is not known */
#define CDB_MISSING_INT INT64_MIN   /* an int or a date that is not known; a number or an angle: NaN; a text: NULL */

#ifndef CDB_MOST_FACTS
#define CDB_MOST_FACTS 512          /* conditions of a table with rules or derived facts, which takes 16 bytes of stack for each */
#endif

#define CDB_FIRST_DATE (-719162)    /* 0001-01-01 */
#define CDB_LAST_DATE 2932896       /* 9999-12-31 */

typedef enum cdb_type { CDB_BOOL, CDB_INT, CDB_NUMBER, CDB_ANGLE, CDB_DATE, CDB_ENUM, CDB_TEXT, CDB_TAGS } cdb_type;

static inline const char *cdbi_type_name(cdb_type type)
{
    static const char *const names[] = {"bool", "int", "number", "angle", "date", "enum", "text", "tags"};
    return names[type];
}

/* Whether facts of a type that are given are doubles. */
static inline int cdbi_is_double(cdb_type type) { return type == CDB_NUMBER || type == CDB_ANGLE; }

/* Whether the cells of a type are sets of numbers. */
static inline int cdbi_is_numeric(cdb_type type) { return cdbi_is_double(type) || type == CDB_INT || type == CDB_DATE; }

typedef enum cdb_unknown {          /* what a missing fact does */
    CDB_UNKNOWN_ERROR,              /* the query fails and names it */
    CDB_UNKNOWN_ANY,                /* its condition is passed over */
    CDB_UNKNOWN_NEVER               /* only cells that are Any accept it */
} cdb_unknown;

typedef enum cdb_strange {          /* what a condition of the file does that this header does not know */
    CDB_STRANGE_REFUSED,            /* the file is refused */
    CDB_STRANGE_ANY                 /* its cells are Any; a derived fact, and a rule, that needs it accepts everything */
} cdb_strange;

typedef enum cdb_status {
    CDB_OK,
    CDB_CANNOT_READ,                /* the file is not there, or the system refuses */
    CDB_NO_MEMORY,
    CDB_BAD_FILE,                   /* truncated, damaged, of another layout, or no artefact at all */
    CDB_OTHER_TABLE,                /* an artefact, but not one that this header, or any in C, can answer for */
    CDB_MISSING_FACT,
    CDB_WRONG_FACT,
    CDB_TOO_SHORT,                  /* an array of the caller has fewer words than are needed */
    CDB_NOT_UNIQUE                  /* several rows are valid, and the policy allows one */
} cdb_status;

typedef enum cdb_choose { CDB_CHANCE, CDB_TOP, CDB_REFUSE } cdb_choose; /* what decides among the rows of the highest rank */

#define CDB_NAME_BYTES 96

typedef struct cdb_fault {
    cdb_status status;
    const char *reason;             /* never NULL, never to be freed */
    int condition;                  /* the number of the condition concerned, or -1 */
    char name[CDB_NAME_BYTES];      /* what is concerned: a condition, a part of the file; or "" */
} cdb_fault;

typedef struct cdb_texts {          /* a fact of a condition of tags whose names are not declared */
    const char *const *texts;
    int64_t count;                  /* CDB_MISSING where the tags are not known */
} cdb_texts;

typedef struct cdbi_tags {          /* a derived fact of tags: the fact of another condition */
    const struct cdb_condition *condition;
    const union cdb_fact *fact;     /* NULL: not known */
} cdbi_tags;

typedef union cdb_fact {
    int64_t whole;                  /* bool, int, enum (the number of its value), date (days since 1970-01-01: see cdb_date) */
    double number;                  /* number, angle (degrees) */
    const char *text;               /* text, in UTF-8 */
    const uint64_t *tags;           /* declared tags: bit 0 says that they are known, bit i that tag i of the schema is there */
    cdb_texts texts;                /* other tags */
    cdbi_tags same;                 /* derived tags; a derived int is a `number` */
    struct {
        int64_t whole;
        const char *text;           /* of any text, also one that is not declared: other facts may be computed from it */
    } derived;                      /* a derived enum */
} cdb_fact;

typedef struct cdb_condition {
    const char *name;
    cdb_type type;
    const char *expr;               /* how the tables derived it from other facts when the header was written, or NULL */
    const char *const *values;      /* of an enum, from 0; of tags, from 1: values[0] is then "" */
    size_t n_values;                /* 0 where none are declared */
} cdb_condition;

typedef enum cdb_output_type { CDB_OUT_BOOL, CDB_OUT_INT, CDB_OUT_NUMBER, CDB_OUT_ENUM, CDB_OUT_TEXT, CDB_OUT_NUMBERS } cdb_output_type;

static inline const char *cdbi_output_type_name(cdb_output_type type)
{
    static const char *const names[] = {"bool", "int", "number", "enum", "text", "numbers"};
    return names[type];
}

typedef struct cdb_output_wanted {  /* an output that the header reads */
    const char *name;
    cdb_output_type type;
    size_t size;                    /* numbers in one value; 1 where it is one */
    const char *const *values;      /* of an enum */
    size_t n_values;
} cdb_output_wanted;

typedef struct cdb_schema {
    const cdb_condition *conditions;
    size_t n_conditions;
    const cdb_output_wanted *outputs;
    size_t n_outputs;
} cdb_schema;

/* What follows is filled by cdb_open; read it, and do not write. */

typedef struct cdbi_list {
    const char **texts;
    size_t n;
    uint64_t *bits;                 /* for each text, which declared tags cover it */
} cdbi_list;

typedef struct cdbi_part {          /* all of `needs` and none of `bans`, or the complement of that */
    cdbi_list needs, bans;
    int is_complement;
} cdbi_part;

typedef struct cdbi_slot {          /* sets of tags that are in every part */
    cdbi_part *parts;
    size_t n;
} cdbi_slot;

typedef struct cdb_column {
    int kind;                       /* 0: the table has no such column, and asks for no such fact */
    size_t file_index;
    const uint64_t *masks;
    size_t n_masks;
    const double *bounds;
    uint64_t *places;               /* those of the bounds, in which a number is looked for: see cdbi_place */
    size_t n_bounds;
    const uint64_t *low, *high, *any_mask;
    size_t n_layers, n_digits;
    unsigned shift;
    cdbi_list texts;                /* the values of a text column, ascending; or the tags that have a slot */
    uint32_t *classes;              /* the class of each of these values */
    cdbi_slot *negated;             /* the slots behind those of single tags */
    size_t n_negated;
    double hysteresis;              /* how far beyond its cells a fact may be for a row that plays already; 0: not at all */
} cdb_column;

#define CDBI_PROGRAM_PARTS 0xFFU

typedef struct cdbi_programs {      /* the rules of rows and the derived facts */
    const int32_t *code;            /* instructions of four numbers */
    size_t n_code;
    const double *numbers;
    size_t n_numbers;
    cdbi_list texts, facts, types;
    const int64_t *starts;          /* where each program begins in `code`; derived facts first */
    size_t n_starts, n_programs;
    const int64_t *derived;         /* which of `facts` each of the first programs computes */
    size_t n_derived;
    const int32_t *of_row;          /* the rule of each row, or -1 */
    size_t n_of_row;
    size_t *places;                 /* where each of `facts` is in the schema; n_conditions: nowhere */
    unsigned char *is_dropped;      /* programs that need a condition that this header does not know */
    unsigned char *is_needed;       /* of each condition of the schema: a rule names it, or a derived fact names it and it is given */
    unsigned parts;                 /* which of its arrays the file has, a bit each: all or none */
    uint64_t *ruled;                /* the rows that have a rule */
    size_t *rows, *row_starts;      /* the rows of each rule */
} cdbi_programs;

typedef struct cdbi_level {         /* what picks look at in a table, the outer one or one inside it */
    cdb_choose choose;
    int by_cost;                    /* of the highest rank those are left whose soft cells cost least */
    size_t n_rows;
    const double *ranks;            /* higher first */
    const double *row_weights;
    const unsigned char *once;      /* NULL where the table has none, as those below */
    const double *cooldown_s;
    const int64_t *cooldown_turns;
    uint64_t *keys;                 /* of each row that rests after it was picked a hash; 0 of another */
    const char *name;
} cdbi_level;

typedef struct cdb_output {         /* n_rows + 1 values: the last is what there is without a row */
    const unsigned char *bools;
    const int64_t *ints;
    const double *numbers;          /* of numbers: value r begins at r * size */
    const int32_t *codes;           /* of enum and text: which of `texts` */
    cdbi_list texts;
    size_t size;
} cdb_output;

typedef struct cdbi_soft {          /* the soft cells of a condition, a row for each row of each depth */
    cdb_column column;
    const double *penalties;
    const double *per, *ends;       /* how penalties grow, NULL where none does: of each distinct cell the distance that one is for, */
    const int64_t *starts;          /* NaN for any; its spans, two ends each, from which to which; */
    const int32_t *which;           /* and the cell of each row */
    size_t n_cells, n_spans, n_starts;
} cdbi_soft;

#define CDB_MOST_ROLES 8            /* roles that can be cast at once, */
#define CDB_MOST_ACTORS 64          /* and actors */

typedef struct cdb_role {           /* a part that actors play: see cdb_cast */
    const char *name;
    uint64_t *required, *optional;  /* the rows that cannot do without it, and those in which somebody plays it who fits */
    int is_computed;                /* a rule, a derived fact, or a cost that decides picks needs facts of it */
} cdb_role;

typedef struct cdb_table {
    size_t n_rows;
    size_t n_words;                 /* words of a mask: n_rows / 64, rounded up */
    int has_programs;               /* rules or derived facts are to be computed */
    const uint64_t *enabled;
    size_t n_strange;               /* columns of conditions that this header does not know, which are Any */
    const double *row_weights;      /* one for each row; 1 where the table has none */
    const char **assets;
    const char *fallback;           /* the asset where no row can be picked, or NULL */
    cdb_output *outputs;            /* those of the schema, in its order */
    const cdb_row_play *plays;      /* how each row plays, and behind them what plays without one; NULL where no output says */
    size_t n_limited;               /* rows that rest after they were picked, of all tables */
    cdbi_soft *soft;                /* one for each condition, or NULL where no cell is soft */
    size_t n_depths;                /* 1, or how many tables are in each other */
    cdbi_level *levels;
    size_t n_levels;
    const int32_t *way_numbers, *way_rows; /* for each depth and row which of the levels, and which row of it; NULL without */
    const char **leaves;
    int has_chance, by_cost;        /* whether chance, or what soft cells cost, decides at some level */
    uint64_t *asset_keys;           /* a hash of each asset */
    int32_t *asset_numbers;         /* of each row its asset, from 0 in the order in which they come first */
    size_t n_assets;
    cdb_role *roles;
    size_t n_roles;
    cdbi_programs programs;
    void *blocks;                   /* the memory that was taken */
    const unsigned char *data;
    size_t data_size;
} cdb_table;
