
/* ---- Casting: the rows whose needed roles can be filled by distinct actors, and who plays what in a row
 *
 * Each actor that is offered for a role has a mask of the rows whose cells on that role accept it. By Hall's theorem the needed roles
 * of a row can be filled when every set of k of them is fitted by at least k actors together; that is counted for 64 rows at once. */

typedef struct cdb_actor {          /* somebody who is offered for a role */
    int role;                       /* cdb_role_number */
    int64_t id;                     /* who it is: an actor that is offered for several roles plays one of them */
    double cost;                    /* the lower the better; NaN: without a preference, after all others */
    const cdb_fact *facts;          /* in the order of the schema; those of the role are read. `facts` of a cdb_live */
} cdb_actor;

typedef struct cdbi_casting {
    const cdb_table *table;
    const cdb_actor *actors;
    size_t n_actors;
    const uint64_t *masks;
    size_t row;
    int parts[CDB_MOST_ROLES];      /* the roles that the row needs, then those that it may have */
    size_t n_parts, n_needed;
    int chosen[CDB_MOST_ROLES], best[CDB_MOST_ROLES]; /* an actor for each, -1 for nobody */
    int n_filled, n_best;           /* -1: nothing was found yet */
    size_t n_unwanted;              /* of the best one: those without a preference, and the sum of costs */
    double cost;
} cdbi_casting;

/* Whether an actor is the first of its id that is offered for its role. */
static inline int cdbi_is_first(const cdb_actor *actors, size_t at)
{
    size_t i;
    for (i = 0; i < at; i++)
        if (actors[i].id == actors[at].id && actors[i].role == actors[at].role) return 0;
    return 1;
}

/* The rows of a word in which so many distinct actors fit the roles of a set at least; `next` is for each actor the next offer of the
 * same one, `is_head` whether it is the first of them. */
static inline uint64_t cdbi_fitted(const cdb_table *table, const cdb_actor *actors, size_t n_actors, const uint64_t *masks,
    const unsigned char *next, const unsigned char *is_head, const unsigned char *is_in, size_t k, size_t word)
{
    uint64_t counts[CDB_MOST_ROLES], some;
    size_t i, j;
    memset(counts, 0, sizeof counts);
    for (i = 0; i < n_actors; i++) {
        if (!is_head[i]) continue;
        for (some = 0, j = i; j < n_actors; j = next[j])
            if (is_in[actors[j].role]) some |= masks[j * table->n_words + word];
        for (j = k - 1; j > 0; j--) counts[j] |= counts[j - 1] & some;
        counts[0] |= some;
    }
    return counts[k - 1];
}

/* Take the rows out whose needed roles cannot be filled. */
static inline void cdbi_and_castable(uint64_t *rows, const cdb_table *table, const cdb_actor *actors, size_t n_actors,
    const uint64_t *masks, const int *cast, size_t n_cast, unsigned char *is_in)
{
    unsigned char next[CDB_MOST_ACTORS], is_head[CDB_MOST_ACTORS];
    size_t set, i, word, k;
    for (i = n_actors; i > 0; i--) {
        for (k = i; k < n_actors && actors[k].id != actors[i - 1].id; k++) {}
        next[i - 1] = (unsigned char)k;
        is_head[i - 1] = 1;
        if (k < n_actors) is_head[k] = 0;
    }
    for (set = 1; set < (size_t)1 << n_cast; set++) {
        for (k = 0, i = 0; i < n_cast; i++) {
            is_in[cast[i]] = (unsigned char)(set >> i & 1);
            k += set >> i & 1;
        }
        for (word = 0; word < table->n_words; word++) {
            uint64_t needed = rows[word];
            for (i = 0; i < n_cast; i++)
                if (is_in[cast[i]]) needed &= table->roles[cast[i]].required[word];
            if (needed) rows[word] &= ~needed | cdbi_fitted(table, actors, n_actors, masks, next, is_head, is_in, k, word);
        }
    }
}

/* Take the rows out whose cell does not accept a fact. */
static inline cdb_status cdbi_and_fact(uint64_t *rows, const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact *facts, size_t at, cdb_unknown unknown, cdb_fault *fault)
{
    const cdb_condition *condition = &schema->conditions[at];
    size_t w;
    if (columns[at].kind == 0) return CDB_OK;
    if (!cdbi_is_missing(condition, &facts[at])) {
        if (cdbi_is_wrong(condition, &facts[at])) return cdbi_fact_fault(fault, CDB_WRONG_FACT, schema, at);
    } else if (unknown == CDB_UNKNOWN_ERROR) return cdbi_missing_fault(fault, table, schema, facts, at);
    for (w = 0; w < table->n_words; w++) rows[w] &= cdbi_accepted(&columns[at], condition, &facts[at], unknown, w, table->n_words);
    return CDB_OK;
}

/* The roles that are cast: those with actors, and those with facts none of which is given. */
static inline cdb_status cdbi_find_cast(const cdb_table *table, const cdb_schema *schema, const cdb_fact *facts,
    const cdb_actor *actors, size_t n_actors, int *cast, int *n_cast, cdb_fault *fault)
{
    int n = 0, role;
    size_t i;
    for (role = 0; (size_t)role < table->n_roles; role++) {
        const char *name = table->roles[role].name;
        int is_offered = 0, is_given = 0, has_facts = 0;
        for (i = 0; i < n_actors; i++) is_offered |= actors[i].role == role;
        for (i = 0; i < schema->n_conditions; i++) {
            if (!cdbi_is_of_role(schema->conditions[i].name, name, strlen(name))) continue;
            has_facts = 1;
            is_given |= !schema->conditions[i].expr && !cdbi_is_missing(&schema->conditions[i], &facts[i]);
        }
        if (is_given && is_offered)
            return cdbi_fault(fault, CDB_WRONG_FACT, "a fact of the role is given, and actors are offered for it", -1, name);
        if (is_given || (!has_facts && !is_offered)) continue; /* plain facts; or a slot that the game knows nothing of */
        if (table->roles[role].is_computed || n == CDB_MOST_ROLES)
            return cdbi_fault(fault, CDB_OTHER_TABLE, n == CDB_MOST_ROLES ? "the table has more roles than can be cast here"
                : "a rule, a derived fact or a cost needs facts of the role, which is not cast here", -1, name);
        cast[n++] = role;
    }
    *n_cast = n;
    return CDB_OK;
}

/* The valid rows for a context and actors: `facts` are those of no role, and of roles that are not cast; `masks` has room for
 * n_actors times n_words, and is kept for cdb_casting; at most CDB_MOST_ACTORS actors. Pick from `rows` with CDB_UNKNOWN_ANY. */
CDB_API cdb_status cdb_cast(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema, const cdb_fact *facts,
    cdb_unknown unknown, const cdb_actor *actors, size_t n_actors, uint64_t *masks, uint64_t *rows, size_t room, cdb_fault *fault)
{
    cdb_fact own[CDB_MOST_FACTS];
    unsigned char is_in[256];
    int cast[CDB_MOST_ROLES], n_cast = 0, role;
    size_t i, j, n_words = table->n_words;
    cdb_status status = CDB_OK;
    memset(rows, 0, room * sizeof *rows);
    if (room < n_words) return cdbi_fault(fault, CDB_TOO_SHORT, "the array for the rows is shorter than a mask of the table", -1, "");
    if (table->n_roles > sizeof is_in) return cdbi_fault(fault, CDB_OTHER_TABLE, "the table has more roles than can be cast here", -1, "");
    for (i = 0; i < n_actors; i++)
        if (actors[i].role < 0 || (size_t)actors[i].role >= table->n_roles || n_actors > CDB_MOST_ACTORS)
            return cdbi_fault(fault, CDB_WRONG_FACT, "an actor is offered for no role of the table, or they are too many", -1, "");
    status = cdbi_find_cast(table, schema, facts, actors, n_actors, cast, &n_cast, fault);
    if (status != CDB_OK) return status;
    memset(is_in, 0, sizeof is_in);
    for (i = 0; i < (size_t)n_cast; i++) is_in[cast[i]] = 1;
    status = cdbi_derived(table, schema, &facts, own, unknown, fault);
    if (status == CDB_OK) memcpy(rows, table->enabled, n_words * sizeof *rows);
    for (i = 0; i < n_actors && status == CDB_OK; i++) {
        uint64_t *mask = masks + i * n_words;
        const char *name = table->roles[actors[i].role].name;
        memcpy(mask, table->enabled, cdbi_is_first(actors, i) ? n_words * sizeof *mask : 0);
        if (!cdbi_is_first(actors, i)) memset(mask, 0, n_words * sizeof *mask);
        for (j = 0; j < schema->n_conditions && status == CDB_OK; j++)
            if (cdbi_is_of_role(schema->conditions[j].name, name, strlen(name)))
                status = cdbi_and_fact(mask, table, columns, schema, actors[i].facts, j, unknown, fault);
    }
    for (j = 0; j < schema->n_conditions && status == CDB_OK; j++) {
        for (role = 0; (size_t)role < table->n_roles; role++)
            if (is_in[role] && cdbi_is_of_role(schema->conditions[j].name, table->roles[role].name, strlen(table->roles[role].name))) break;
        if ((size_t)role == table->n_roles) status = cdbi_and_fact(rows, table, columns, schema, facts, j, unknown, fault);
    }
    if (status == CDB_OK) cdbi_and_castable(rows, table, actors, n_actors, masks, cast, (size_t)n_cast, is_in);
    if (status == CDB_OK && table->has_programs) status = cdbi_and_rules(rows, table, schema, facts, unknown, fault);
    if (status == CDB_OK) return cdbi_fault(fault, CDB_OK, "", -1, "");
    memset(rows, 0, n_words * sizeof *rows);
    return status;
}

/* Keep the casting that was put together, where it is better than the best: more roles filled, then fewer actors without a
 * preference, then less cost, then as they are offered. */
static inline void cdbi_keep_best(cdbi_casting *casting)
{
    size_t i, n_unwanted = 0;
    double cost = 0.0;
    int order = 0;
    for (i = 0; i < casting->n_parts; i++) {
        if (casting->chosen[i] < 0) continue;
        if (cdbi_is_nan(casting->actors[casting->chosen[i]].cost)) n_unwanted++;
        else cost = cdbi_sum(cost, casting->actors[casting->chosen[i]].cost);
    }
    if (casting->n_filled < casting->n_best) return;
    if (casting->n_filled == casting->n_best) {
        if (n_unwanted != casting->n_unwanted) order = n_unwanted < casting->n_unwanted ? 1 : -1;
        else if (cdbi_is_less(cost, casting->cost) || cdbi_is_less(casting->cost, cost)) order = cdbi_is_less(cost, casting->cost) ? 1 : -1;
        for (i = 0; order == 0 && i < casting->n_parts; i++)
            if (casting->chosen[i] != casting->best[i])
                order = casting->best[i] < 0 || (casting->chosen[i] >= 0 && casting->chosen[i] < casting->best[i]) ? 1 : -1;
        if (order <= 0) return;
    }
    memcpy(casting->best, casting->chosen, sizeof casting->best);
    casting->n_best = casting->n_filled;
    casting->n_unwanted = n_unwanted;
    casting->cost = cost;
}

/* Whether one actor is preferred to another one for a role. */
static inline int cdbi_is_preferred(const cdb_actor *actors, size_t one, size_t other)
{
    int is_plain = !cdbi_is_nan(actors[one].cost), other_is = !cdbi_is_nan(actors[other].cost);
    if (is_plain != other_is) return is_plain;
    if (is_plain && cdbi_is_less(actors[one].cost, actors[other].cost)) return 1;
    return !(is_plain && cdbi_is_less(actors[other].cost, actors[one].cost)) && one < other;
}

/* Give the roles from one on to actors. Of each role only as many actors as there are roles can matter: one of its best is free. */
static inline void cdbi_give_roles(cdbi_casting *casting, size_t part)
{
    size_t i, j, n_words = casting->table->n_words, n_better;
    if (part == casting->n_parts) {
        cdbi_keep_best(casting);
        return;
    }
    for (i = 0; i < casting->n_actors; i++) {
        if (casting->actors[i].role != casting->parts[part]) continue;
        if (!(casting->masks[i * n_words + casting->row / 64] >> casting->row % 64 & 1)) continue;
        for (n_better = 0, j = 0; j < casting->n_actors; j++)
            n_better += casting->actors[j].role == casting->parts[part] && cdbi_is_preferred(casting->actors, j, i)
                && (casting->masks[j * n_words + casting->row / 64] >> casting->row % 64 & 1);
        for (j = 0; j < part && (casting->chosen[j] < 0 || casting->actors[casting->chosen[j]].id != casting->actors[i].id); j++) {}
        if (j < part || n_better >= casting->n_parts) continue;
        casting->chosen[part] = (int)i;
        casting->n_filled++;
        cdbi_give_roles(casting, part + 1);
        casting->n_filled--;
    }
    if (part < casting->n_needed) return;
    casting->chosen[part] = -1;
    cdbi_give_roles(casting, part + 1);
}

/* Who plays what in a valid row: for each role of the table the number of an actor, -1 for nobody; how many play. -1 where the needed
 * roles cannot be filled. `actors` and `masks` are those of cdb_cast. */
CDB_API int cdb_casting(const cdb_table *table, const cdb_actor *actors, size_t n_actors, const uint64_t *masks, int64_t row, int *playing)
{
    cdbi_casting casting;
    size_t role, i, pass;
    memset(&casting, 0, sizeof casting);
    for (role = 0; role < table->n_roles; role++) playing[role] = -1;
    if (row < 0 || (uint64_t)row >= table->n_rows) return -1;
    casting.table = table;
    casting.actors = actors;
    casting.n_actors = n_actors;
    casting.masks = masks;
    casting.row = (size_t)row;
    casting.n_best = -1;
    for (pass = 0; pass < 2; pass++)
        for (role = 0; role < table->n_roles; role++) {
            const uint64_t *rows = pass == 0 ? table->roles[role].required : table->roles[role].optional;
            for (i = 0; i < n_actors && actors[i].role != (int)role; i++) {}
            if (i == n_actors || !(rows[row / 64] >> (row % 64) & 1) || casting.n_parts == CDB_MOST_ROLES) continue;
            casting.parts[casting.n_parts++] = (int)role;
            casting.n_needed += pass == 0;
        }
    cdbi_give_roles(&casting, 0);
    for (i = 0; casting.n_best > 0 && i < casting.n_parts; i++) playing[casting.parts[i]] = casting.best[i];
    return casting.n_best;
}
