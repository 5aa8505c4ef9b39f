/* ---- Joint choices: a clip of several roles, chosen and cast once for characters as they stand, who then play it, each with its root
 * aligned. See contextdb/motion/joint/searcher.py and contextdb/motion/nodes/joint_node.py.
 *
 *   cdbm_set_number       joint databases that are searched together, by their name, or that of one database
 *   cdbm_take_part        a character as one who may take part
 *   cdbm_choose_together  clip, frame and cast of lowest cost, and a one-off for each role; nobody plays it yet
 *   cdbm_for_player       a one-off for a character of another player of the same bundle
 *
 * Each of the cast plays the one-off of its role as any other: as `one_off` of the inputs of each update until cdbm_is_over.
 *
 * A actors, K roles, F features. Several databases are searched in order; one under its threshold wins outright. On a tie the earlier
 * database wins, then the lowest frame, then the first cast. */

#ifndef CDBM_CASTS_AT_ONCE
#define CDBM_CASTS_AT_ONCE 32       /* so many casts are compared together, so that the room stays small */
#endif

typedef struct cdbm_actor {         /* somebody who may take part */
    const double *query;            /* [F] the pose and path, in the units of the schema of the databases */
    double place[3];                /* x, z and heading */
} cdbm_actor;

typedef struct cdbm_table_input {         /* what a table of the bundle is asked with */
    const cdb_fact *facts;          /* in the order of its schema, those of roles that are cast missing; NULL: as `rows` say */
    const cdb_actor *offers;        /* who is offered for its roles: the id is the number of the actor; or NULL: the clips alone are asked for */
    size_t n_offers;                /* at most CDB_MOST_ACTORS */
    const uint64_t *rows;           /* its valid rows, whoever plays; NULL: all */
} cdbm_table_input;

typedef struct cdbm_together {      /* what is asked for */
    size_t set;                     /* cdbm_set_number */
    const cdbm_actor *actors;
    size_t n_actors;
    const cdbm_table_input *tables;       /* [tables of the bundle], or NULL: all clips may play */
    const int64_t *casts;           /* [n_casts, K] these alone, as numbers of actors; NULL: all that the tables let, or all there are */
    size_t n_casts;
    const double *gives;            /* [K] how readily each role gives way when the clip is put down, 0 not at all; NULL: all alike */
    const cdbm_tags *tags;          /* of the frames of all roles; or NULL */
    int in_match_range;             /* whether only frames of a match range may be chosen */
    cdb_unknown unknown;            /* what a missing fact does */
    cdb_fault *fault;               /* which fact was refused; or NULL */
} cdbm_together;

typedef struct cdbm_joint_hit {
    size_t database;                /* among those of the player */
    int64_t range, frame, row;      /* the joint range, -1: nothing may play; the frame since its start; a row that lets the cast play, -1: no table */
    double cost;
    size_t n_roles;
    int64_t cast[CDB_MOST_ROLES];   /* the actor of each role */
    double places[CDB_MOST_ROLES][3]; /* where in the world the clip has each of them at this frame */
    cdbm_one_off one_offs[CDB_MOST_ROLES];
} cdbm_joint_hit;

/* ---- sets */

/* The number of some joint databases of a bundle by their name; -1 for none. */
static inline int cdbm_set_number(const cdbm_player *player, const char *name)
{
    const char *own;
    size_t i;
    for (i = 0; (own = cdbm_text(&player->bundle, CDBM_P_SET, i, 0)) != NULL; i++)
        if (strcmp(own, name) == 0) return (int)i;
    return -1;
}

/* The databases of a set as numbers of the player, in their order, and their thresholds; how many, 0 where one is not there. */
static inline size_t cdbm_databases_of(const cdbm_player *player, size_t set, size_t *databases, double *thresholds)
{
    size_t n, n_thresholds, i, d;
    const int64_t *numbers = (const int64_t *)cdbm_find(&player->bundle, CDBM_P_SET_DATABASES, set, sizeof(int64_t), &n);
    const double *own = (const double *)cdbm_find(&player->bundle, CDBM_P_SET_THRESHOLDS, set, sizeof(double), &n_thresholds);
    if (!numbers || !own || n != n_thresholds || n > CDBM_MOST_DATABASES) return 0;
    for (i = 0; i < n; i++) {
        for (d = player->controller.n_databases; d < player->n_databases && player->database_of[d] != numbers[i]; d++) {}
        if (d == player->n_databases || player->joints[d].joint.n_roles == 0) return 0;
        databases[i] = d, thresholds[i] = own[i];
        if (player->joints[d].joint.n_roles != player->joints[databases[0]].joint.n_roles) return 0;
        if (player->frames[d].n_features != player->frames[databases[0]].n_features) return 0;
    }
    return n;
}

/* The name of a role of a set; NULL for none. */
static inline const char *cdbm_role_name(const cdbm_player *player, size_t set, size_t role)
{
    size_t databases[CDBM_MOST_DATABASES];
    double thresholds[CDBM_MOST_DATABASES];
    if (cdbm_databases_of(player, set, databases, thresholds) == 0) return NULL;
    return cdbm_text(&player->bundle, CDBM_P_ROLES, (size_t)player->database_of[databases[0]], role);
}

/* A character as it stands, for databases with the features of its controller: into room for these. */
static inline void cdbm_take_part(const cdbm_player *player, const double *state, double *query, cdbm_actor *to)
{
    cdbm_moved moved;
    cdbm_move(&player->controller, cdbm_played_part(player, (double *)(uintptr_t)state), 0.0, &moved);
    if (moved.to.database < 0.0) cdbm_rest_pose(&player->ways, state, player->frames[0].offset, query);
    else cdbm_features(player->clips[(size_t)moved.to.database].frames, (int64_t)moved.to.frame, query);
    to->query = query;
    cdbm_place_of(state, to->place);
}

/* ---- what tables say */

typedef struct cdbm_cast_rows {     /* the answer of a table for casts, as it is or with mirrored facts; in room */
    const cdb_any *any;             /* NULL: no table is asked, all may play */
    const cdb_actor *offers;
    size_t n_offers;
    int has_casts;                  /* whether actors are offered */
    uint64_t *rows, *masks, *left, *left_masks; /* [W], [offers, W], and room for as much */
    double *costs, *own;            /* [rows] what soft cells cost whoever plays, and [offers, rows]; NULL where none are soft */
    int roles[CDB_MOST_ROLES];      /* the numbers of the roles of the clips in the table, -1 for none */
    int others[CDB_MOST_ROLES];     /* other roles that actors are offered for */
    size_t n_others;
} cdbm_cast_rows;

/* How many bytes of room such an answer takes. */
static inline size_t cdbm_cast_room(const cdbm_player *player, size_t n_offers)
{
    size_t n_words = player->n_most_rows / 64 + 2, n_rows = player->n_most_rows, facts = 0, t;
    for (t = 0; t < player->n_tables; t++)
        if (player->opened[t]->schema.n_conditions * sizeof(cdb_fact) > facts) facts = player->opened[t]->schema.n_conditions * sizeof(cdb_fact);
    return 2 * cdbm_rounded(n_words * 8) + 2 * cdbm_rounded(n_offers * n_words * 8) + cdbm_rounded(n_rows * sizeof(double))
        + cdbm_rounded(n_offers * n_rows * sizeof(double)) + cdbm_rounded((n_offers + 1) * facts) + cdbm_rounded(n_offers * sizeof(cdb_actor));
}

/* What the soft cells of each row cost with the facts of a role, or with those of no role that is cast. */
static inline void cdbm_soft_costs(const cdb_any *any, const cdb_fact *facts, cdb_unknown unknown, const int *roles, size_t n_roles, int is_without, double *costs)
{
    const cdb_table *table = &any->table;
    const cdb_schema *schema = &any->schema;
    size_t n_words = (table->n_depths * table->n_rows + 63) / 64, i, row, depth, k;
    memset(costs, 0, table->n_rows * sizeof *costs);
    for (i = 0; i < schema->n_conditions; i++) {
        int is_of = 0;
        for (k = 0; k < n_roles; k++) {
            const char *name = roles[k] < 0 ? "" : table->roles[roles[k]].name;
            is_of |= cdbi_is_of_role(schema->conditions[i].name, name, strlen(name));
        }
        if (table->soft[i].column.kind == 0 || is_of == is_without) continue;
        for (row = 0; row < table->n_rows; row++) {
            double own = 0.0;
            for (depth = 0; depth < table->n_depths; depth++) {
                size_t at = depth * table->n_rows + row;
                if (!cdbi_accepts(&table->soft[i].column, &schema->conditions[i], &facts[i], unknown, at, n_words))
                    own += cdbi_grown(&table->soft[i], &schema->conditions[i], &facts[i], 0, at);
            }
            costs[row] += own;
        }
    }
}

/* Ask a table, with facts as they are or as a mirror shows them. 1; 0 with too little room; -2 for a fact that is refused. */
static inline int cdbm_ask_for_casts(const cdbm_player *player, size_t table, const cdbm_together *together, const char *const *roles,
    size_t n_roles, int is_mirrored, cdbm_cast_rows *to, cdbm_room *room)
{
    const cdbm_table_input *asked = &together->tables[table];
    const cdb_any *any = player->opened[table];
    const cdb_schema *schema = &any->schema;
    size_t n_words = any->table.n_words, n_rows = any->table.n_rows, n = asked->facts && asked->offers ? asked->n_offers : 0, i, k;
    cdb_fact *facts = (cdb_fact *)cdbm_part(room, (n + 1) * schema->n_conditions * sizeof(cdb_fact)), own[CDB_MOST_FACTS];
    cdb_actor *offers = (cdb_actor *)cdbm_part(room, n * sizeof(cdb_actor));
    const cdb_fact *derived = facts;
    int cast[CDB_MOST_ROLES], n_cast = 0;
    memset(to, 0, sizeof *to);
    to->rows = (uint64_t *)cdbm_part(room, n_words * 8), to->left = (uint64_t *)cdbm_part(room, n_words * 8);
    to->masks = (uint64_t *)cdbm_part(room, n * n_words * 8), to->left_masks = (uint64_t *)cdbm_part(room, n * n_words * 8);
    if (!facts || !offers || !to->rows || !to->left || !to->masks || !to->left_masks) return 0;
    to->any = any, to->offers = offers, to->n_offers = n, to->has_casts = asked->facts && asked->offers;
    if (!asked->facts) {
        if (asked->rows) memcpy(to->rows, asked->rows, n_words * 8);
        else memset(to->rows, 255, n_words * 8);
        return 1;
    }
    if (n > CDB_MOST_ACTORS) return -1;
    memcpy(facts, asked->facts, schema->n_conditions * sizeof *facts);
    if (is_mirrored) cdbm_mirror_facts(player, table, asked->facts, facts);
    for (i = 0; i < n; i++) {
        offers[i] = asked->offers[i], offers[i].facts = facts + (i + 1) * schema->n_conditions;
        if (offers[i].id < 0 || (uint64_t)offers[i].id >= together->n_actors) return -1;
        if (is_mirrored) cdbm_mirror_facts(player, table, asked->offers[i].facts, facts + (i + 1) * schema->n_conditions);
        else memcpy(facts + (i + 1) * schema->n_conditions, asked->offers[i].facts, schema->n_conditions * sizeof *facts);
    }
    if (any->table.soft && (!(to->costs = (double *)cdbm_part(room, n_rows * sizeof(double))) || !(to->own = (double *)cdbm_part(room, n * n_rows * sizeof(double))))) return 0;
    if (!to->has_casts) {
        if (cdb_query(&any->table, any->columns, schema, facts, together->unknown, to->rows, n_words, together->fault) != CDB_OK) return -2;
        if (to->costs && cdb_penalties(&any->table, any->columns, schema, facts, together->unknown, to->costs, n_rows, together->fault) != CDB_OK) return -2;
        return 1;
    }
    if (cdb_cast(&any->table, any->columns, schema, facts, together->unknown, offers, n, to->masks, to->rows, n_words, together->fault) != CDB_OK) return -2;
    for (k = 0; k < n_roles; k++) to->roles[k] = cdb_role_number(&any->table, roles[k]);
    for (i = 0; i < n; i++) {
        for (k = 0; k < n_roles && to->roles[k] != offers[i].role; k++) {}
        if (k < n_roles) continue;
        for (k = 0; k < to->n_others && to->others[k] != offers[i].role; k++) {}
        if (k == to->n_others && k < CDB_MOST_ROLES) to->others[to->n_others++] = offers[i].role;
    }
    if (!to->costs) return 1;
    if (cdbi_find_cast(&any->table, schema, facts, offers, n, cast, &n_cast, together->fault) != CDB_OK) return -2;
    if (cdbi_derived(&any->table, schema, &derived, own, together->unknown, together->fault) != CDB_OK) return -2;
    cdbm_soft_costs(any, derived, together->unknown, cast, (size_t)n_cast, 1, to->costs);
    for (i = 0; i < n; i++) cdbm_soft_costs(any, offers[i].facts, together->unknown, &offers[i].role, 1, 0, to->own + i * n_rows);
    return 1;
}

/* The offer of an actor for a role; -1 for none. */
static inline int64_t cdbm_offer_of(const cdbm_cast_rows *of, int role, int64_t actor)
{
    size_t i;
    for (i = 0; i < of->n_offers; i++)
        if (of->offers[i].role == role && of->offers[i].id == actor) return (int64_t)i;
    return -1;
}

/* Write the rows that let a cast play into `left`; whether there is one. */
static inline int cdbm_left_rows(const cdbm_cast_rows *of, const int64_t *cast, size_t n_roles)
{
    size_t n_words, w, k, i, n_left = 0;
    cdb_actor left[CDB_MOST_ACTORS];
    unsigned char is_in[256];
    uint64_t any = 0;
    if (!of->any) return 1;
    n_words = of->any->table.n_words;
    memcpy(of->left, of->rows, n_words * 8);
    for (k = 0; of->has_casts && k < n_roles; k++) {
        int64_t offer = cdbm_offer_of(of, of->roles[k], cast[k]);
        if (offer < 0) return 0;
        for (w = 0; w < n_words; w++) of->left[w] &= of->masks[(size_t)offer * n_words + w];
    }
    if (of->n_others > 0) { /* nobody may be left for another role that a row needs */
        for (i = 0; i < of->n_offers; i++) {
            for (k = 0; k < n_roles && of->roles[k] != of->offers[i].role && cast[k] != of->offers[i].id; k++) {}
            if (k < n_roles) continue;
            memcpy(of->left_masks + n_left * n_words, of->masks + i * n_words, n_words * 8);
            left[n_left++] = of->offers[i];
        }
        memset(is_in, 0, sizeof is_in);
        cdbi_and_castable(of->left, &of->any->table, left, n_left, of->left_masks, of->others, of->n_others, is_in);
    }
    for (w = 0; w < n_words; w++) any |= of->left[w];
    return any != 0;
}

/* What a row costs with a cast. */
static inline double cdbm_row_cost(const cdbm_cast_rows *of, const int64_t *cast, size_t n_roles, size_t row)
{
    size_t n_rows = of->any->table.n_rows, k;
    double own = 0.0;
    if (!of->costs) return 0.0;
    for (k = 0; of->has_casts && k < n_roles; k++) own += of->own[(size_t)cdbm_offer_of(of, of->roles[k], cast[k]) * n_rows + row];
    return of->has_casts ? of->costs[row] + own : of->costs[row];
}

/* The row that costs least of those in `left` that name a range, the first of several, -1 for none; and what it costs. */
static inline int64_t cdbm_cheapest_row(const cdbm_cast_rows *of, const cdbm_table_ranges *rows, size_t range, const int64_t *cast, size_t n_roles, double *least)
{
    int64_t k, chosen = -1;
    *least = (double)INFINITY;
    for (k = rows->starts[range]; k < rows->starts[range + 1]; k++) {
        int64_t row = rows->rows[k];
        double cost;
        if (!(of->left[row / 64] >> (row % 64) & 1)) continue;
        cost = cdbm_row_cost(of, cast, n_roles, (size_t)row);
        if (chosen < 0 || cost < *least) chosen = row, *least = cost;
    }
    return chosen;
}

/* ---- casts, one after another */

typedef struct cdbm_casting {
    const cdbm_together *together;
    const cdbm_cast_rows *of;
    size_t n_roles, counts[CDB_MOST_ROLES], at[CDB_MOST_ROLES]; /* how many each role may be given to, and which of them it is */
    int64_t cast[CDB_MOST_ROLES];
    int is_begun;
} cdbm_casting;

static inline void cdbm_begin_casting(const cdbm_together *together, const cdbm_cast_rows *of, size_t n_roles, cdbm_casting *to)
{
    size_t k, i;
    memset(to, 0, sizeof *to);
    to->together = together, to->of = of, to->n_roles = n_roles;
    for (k = 0; k < n_roles; k++) {
        to->counts[k] = of->has_casts ? 0 : together->n_actors;
        for (i = 0; of->has_casts && i < of->n_offers; i++) to->counts[k] += of->offers[i].role == of->roles[k];
    }
}

/* The actor that a role is given to, of those that may have it; -1 for one that is offered for it twice. */
static inline int64_t cdbm_actor_at(const cdbm_cast_rows *of, size_t role, size_t at)
{
    size_t i, n = 0;
    if (!of->has_casts) return (int64_t)at;
    for (i = 0; i < of->n_offers; i++)
        if (of->offers[i].role == of->roles[role] && n++ == at) return cdbi_is_first(of->offers, i) ? of->offers[i].id : -1;
    return -1;
}

/* Whether a cast is one of those that are asked for. */
static inline int cdbm_is_listed(const cdbm_together *together, const int64_t *cast, size_t n_roles)
{
    size_t i;
    for (i = 0; i < together->n_casts; i++)
        if (memcmp(together->casts + i * n_roles, cast, n_roles * sizeof *cast) == 0) return 1;
    return together->casts == NULL;
}

/* The next way to give each role one of its actors, none of them two; 0 behind the last. In the order in which they are listed; else in
 * that of the actors of the first role, then of the second. */
static inline int cdbm_next_cast(cdbm_casting *to)
{
    const cdbm_together *together = to->together;
    size_t k = to->is_begun ? to->n_roles - 1 : 0, i;
    if (together->casts && !to->of->has_casts) {
        if (to->at[0] == together->n_casts) return 0;
        memcpy(to->cast, together->casts + to->n_roles * to->at[0]++, to->n_roles * sizeof *to->cast);
        return 1;
    }
    if (to->is_begun) to->at[k]++;
    to->is_begun = 1;
    for (;;) {
        if (to->at[k] >= to->counts[k]) { /* the role before it goes on */
            if (k == 0) return 0;
            to->at[--k]++;
            continue;
        }
        to->cast[k] = cdbm_actor_at(to->of, k, to->at[k]);
        for (i = 0; i < k && to->cast[i] != to->cast[k]; i++) {}
        if (to->cast[k] < 0 || i < k) to->at[k]++;
        else if (k + 1 < to->n_roles) to->at[++k] = 0;
        else if (cdbm_is_listed(together, to->cast, to->n_roles)) return 1;
        else to->at[k]++;
    }
}

/* ---- the search */

/* How many bytes of room a choice of a set takes, among so many actors, with so many offers of a table. */
static inline size_t cdbm_together_room(const cdbm_player *player, size_t set, size_t n_actors, size_t n_offers)
{
    size_t databases[CDBM_MOST_DATABASES], n, i, most = 0;
    double thresholds[CDBM_MOST_DATABASES];
    n = cdbm_databases_of(player, set, databases, thresholds);
    for (i = 0; i < n; i++) {
        const cdbm_joint *joint = &player->joints[databases[i]].joint;
        size_t n_kinds = player->clips[databases[i]].n_kinds, own = cdbm_joint_room(joint, n_actors, CDBM_CASTS_AT_ONCE);
        own += cdbm_rounded(n_actors * joint->n_features * sizeof(double)) + cdbm_rounded(n_actors * n_actors * 4 * sizeof(double));
        own += cdbm_rounded(joint->n_boxes * CDBM_FRAMES * sizeof(double)) + 2 * cdbm_rounded(n_kinds * sizeof(double)) + 3 * cdbm_rounded(2 * n_kinds);
        own += cdbm_rounded(CDBM_CASTS_AT_ONCE * joint->n_roles * sizeof(int64_t)) + cdbm_rounded(CDBM_CASTS_AT_ONCE * joint->n_ranges * sizeof(double));
        if (own > most) most = own;
    }
    return most + 2 * cdbm_cast_room(player, n_offers) + 64;
}

/* Write the bias of each joint frame, the mean of those of its roles; infinite where one of these may not be chosen: [B, 8]. */
static inline void cdbm_write_joint_biases(const cdbm_clips *clips, const cdbm_joint_clips *of, const uint8_t *allowed, const double *kind_biases, double *to)
{
    const cdbm_frames *frames = clips->frames;
    const cdbm_joint *joint = &of->joint;
    size_t box, lane, k;
    for (box = 0; box < joint->n_boxes; box++)
        for (lane = 0; lane < CDBM_FRAMES; lane++, to++) {
            *to = 0.0;
            for (k = 0; k < joint->n_roles; k++) {
                size_t own = (size_t)joint->boxes[box * joint->n_roles + k], kind;
                int64_t frame = frames->box_starts[own] + (int64_t)lane;
                int is_there = lane < (size_t)frames->box_sizes[own];
                kind = is_there && frames->kinds ? (size_t)frames->kinds[frame] : 0;
                *to += is_there && allowed[kind] ? of->range_biases[frames->box_ranges[own]] + kind_biases[kind] : (double)INFINITY;
            }
            *to /= (double)joint->n_roles;
        }
}

typedef struct cdbm_gathering {     /* a search of one joint database, in room */
    cdbm_meeting meeting;
    double *queries, *seen, *frame_biases, *range_biases;
    int64_t *casts;
    cdbm_cast_rows sides[2];        /* as it is, and in a mirror */
    int has_mirrored;               /* whether the second is another one */
    double best;
    int64_t frame, number, best_cast[CDB_MOST_ROLES]; /* number: of the best cast among those that are compared */
} cdbm_gathering;

/* Put together what is compared. As cdbm_choose_together. */
static inline int cdbm_gather(const cdbm_player *player, size_t d, const cdbm_together *together, cdbm_gathering *to, cdbm_room *room)
{
    const cdbm_clips *clips = &player->clips[d];
    const cdbm_joint_clips *own = &player->joints[d];
    const cdbm_joint *joint = &own->joint;
    size_t n = together->n_actors, n_features = joint->n_features, i, k;
    uint8_t *allowed = (uint8_t *)cdbm_part(room, clips->n_kinds);
    double *kind_biases = (double *)cdbm_part(room, clips->n_kinds * sizeof(double));
    const char *roles[CDB_MOST_ROLES];
    int64_t table = player->table_of[d];
    int is_done;
    memset(to, 0, sizeof *to);
    to->queries = (double *)cdbm_part(room, n * n_features * sizeof(double)), to->seen = (double *)cdbm_part(room, 4 * n * n * sizeof(double));
    to->frame_biases = (double *)cdbm_part(room, joint->n_boxes * CDBM_FRAMES * sizeof(double));
    to->range_biases = (double *)cdbm_part(room, CDBM_CASTS_AT_ONCE * joint->n_ranges * sizeof(double));
    to->casts = (int64_t *)cdbm_part(room, CDBM_CASTS_AT_ONCE * joint->n_roles * sizeof(int64_t));
    if (!allowed || !kind_biases || !to->queries || !to->seen || !to->frame_biases || !to->range_biases || !to->casts) return 0;
    for (i = 0; i < n; i++) {
        if (!cdbm_normalise_exactly(clips->frames, together->actors[i].query, to->queries + i * n_features)) return -1;
        for (k = 0; k < n; k++) cdbm_see_other(together->actors[i].place, together->actors[k].place, to->seen + 4 * (i * n + k));
    }
    for (k = 0; k < clips->n_kinds; k++) allowed[k] = own->allowed[k] && (!together->in_match_range || clips->marks[k] & CDBM_IN_MATCH_RANGE);
    memcpy(kind_biases, own->kind_biases, clips->n_kinds * sizeof *kind_biases);
    is_done = cdbm_let_kinds(&player->tags[d], together->tags, allowed, kind_biases, *room);
    if (is_done != 1) return is_done;
    cdbm_write_joint_biases(clips, own, allowed, kind_biases, to->frame_biases);
    to->meeting.n_actors = n, to->meeting.queries = to->queries, to->meeting.seen = to->seen, to->meeting.casts = to->casts;
    to->meeting.range_biases = to->range_biases, to->meeting.frame_biases = to->frame_biases;
    to->best = (double)INFINITY, to->frame = -1;
    if (!together->tables || table < 0 || (!together->tables[table].facts && !together->tables[table].rows)) return 1;
    for (k = 0; k < joint->n_roles; k++)
        if (!(roles[k] = cdbm_text(&player->bundle, CDBM_P_ROLES, (size_t)player->database_of[d], k))) return -1;
    for (i = 0; together->tables[table].facts && i < joint->n_ranges; i++) to->has_mirrored |= own->rows.mirrored[i];
    for (i = 0; i < (to->has_mirrored ? 2U : 1U); i++) {
        is_done = cdbm_ask_for_casts(player, (size_t)table, together, roles, joint->n_roles, i == 1, &to->sides[i], room);
        if (is_done != 1) return is_done;
    }
    return 1;
}

/* Write what a cast costs beside in each joint range, infinite where it may not play. */
static inline void cdbm_write_cast_biases(const cdbm_joint_clips *own, const cdbm_gathering *of, const int64_t *cast, double *to)
{
    size_t j;
    for (j = 0; j < own->joint.n_ranges; j++) {
        to[j] = 0.0;
        if (of->sides[0].any) cdbm_cheapest_row(&of->sides[of->has_mirrored && own->rows.mirrored[j]], &own->rows, j, cast, own->joint.n_roles, &to[j]);
    }
}

/* Search some casts; 0 with too little room. */
static inline int cdbm_search_casts(const cdbm_joint_clips *own, cdbm_gathering *of, size_t n, cdbm_room room)
{
    of->meeting.n_casts = n, of->meeting.bests = &of->best, of->meeting.frames = &of->frame, of->meeting.casts_of = &of->number;
    of->number = -1;
    if (n > 0 && !cdbm_search_joint(&own->joint, &of->meeting, room)) return 0;
    if (of->number >= 0) memcpy(of->best_cast, of->casts + (size_t)of->number * own->joint.n_roles, own->joint.n_roles * sizeof *of->casts);
    return 1;
}

/* Search all casts: those that may play as they are, then those that may in a mirror alone. */
static inline int cdbm_search_all_casts(const cdbm_joint_clips *own, const cdbm_together *together, cdbm_gathering *of, cdbm_room room)
{
    size_t n_roles = own->joint.n_roles, n = 0, pass;
    cdbm_casting casting;
    for (pass = 0; pass < (of->has_mirrored ? 2U : 1U); pass++) {
        cdbm_begin_casting(together, &of->sides[0], n_roles, &casting);
        while (cdbm_next_cast(&casting)) {
            int is_plain = cdbm_left_rows(&of->sides[0], casting.cast, n_roles);
            int is_mirrored = of->has_mirrored && cdbm_left_rows(&of->sides[1], casting.cast, n_roles);
            if (pass == 0 ? !is_plain : is_plain || !is_mirrored) continue;
            memcpy(of->casts + n * n_roles, casting.cast, n_roles * sizeof *of->casts);
            cdbm_write_cast_biases(own, of, casting.cast, of->range_biases + n * own->joint.n_ranges);
            if (++n < CDBM_CASTS_AT_ONCE) continue;
            if (!cdbm_search_casts(own, of, n, room)) return 0;
            n = 0;
        }
    }
    return cdbm_search_casts(own, of, n, room);
}

/* What a search chose, as the cast plays it. 0 for a frame that is none. */
static inline int cdbm_put_down(const cdbm_player *player, size_t d, const cdbm_together *together, const cdbm_gathering *of, cdbm_joint_hit *to)
{
    const cdbm_clips *clips = &player->clips[d];
    const cdbm_joint_clips *own = &player->joints[d];
    double recorded[3 * CDB_MOST_ROLES], places[3 * CDB_MOST_ROLES], gives[CDB_MOST_ROLES], least;
    size_t n = own->joint.n_roles, k, i, j;
    int64_t frame = of->frame;
    for (j = 0; j < own->joint.n_ranges; j++) {
        int64_t range = own->role_ranges[j * n], length = clips->stops[range] - clips->starts[range];
        if (frame < length) break;
        frame -= length;
    }
    if (frame < 0 || j == own->joint.n_ranges) return 0;
    to->database = d, to->n_roles = n, to->range = (int64_t)j, to->frame = frame, to->row = -1, to->cost = of->best;
    memcpy(to->cast, of->best_cast, sizeof to->cast);
    if (of->sides[0].any) {
        const cdbm_cast_rows *side = &of->sides[of->has_mirrored && own->rows.mirrored[j]];
        cdbm_left_rows(side, to->cast, n);
        to->row = cdbm_cheapest_row(side, &own->rows, j, to->cast, n, &least);
    }
    for (k = 0; k < n; k++) {
        const float *root = clips->root + 3 * (clips->starts[own->role_ranges[j * n + k]] + frame);
        for (i = 0; i < 3; i++) recorded[3 * k + i] = (double)root[i];
        memcpy(places + 3 * k, together->actors[to->cast[k]].place, 3 * sizeof(double));
        gives[k] = together->gives ? together->gives[k] : 1.0;
    }
    cdbm_align(recorded, places, gives, n, to->places[0]);
    cdbm_begin_roles(clips, own->role_ranges + j * n, n, frame, own->warps, to->places[0], places, to->one_offs);
    for (k = 0; k < n; k++) to->one_offs[k].database = (double)d, to->one_offs[k].cost = to->cost;
    return 1;
}

/* Whether the numbers of a choice may be asked for. */
static inline int cdbm_may_choose(const cdbm_together *together, size_t n_roles)
{
    size_t i, k, j;
    for (i = 0; i < together->n_actors; i++)
        for (k = 0; k < 3; k++)
            if (!(cdbo_size(together->actors[i].place[k]) <= 1e6)) return 0;
    for (k = 0; together->gives && k < n_roles; k++)
        if (!(together->gives[k] >= 0.0 && together->gives[k] <= 1e6)) return 0;
    for (i = 0; together->casts && i < together->n_casts; i++)
        for (k = 0; k < n_roles; k++) {
            const int64_t *cast = together->casts + i * n_roles;
            if (cast[k] < 0 || (uint64_t)cast[k] >= together->n_actors) return 0;
            for (j = 0; j < k; j++)
                if (cast[j] == cast[k]) return 0;
        }
    return 1;
}

/* Choose clip, frame and cast. 1, and the hit, whose range is -1 and whose cost is infinite where nothing may play; 0 with too little
 * room, see cdbm_together_room; -1 where a number is none, or there is no such set; -2 for a fact that is refused, or a table that cannot
 * be cast in C; -3 for a tag that the markup does not know. */
static inline int cdbm_choose_together(const cdbm_player *player, const cdbm_together *together, cdbm_joint_hit *to, cdbm_room room)
{
    size_t databases[CDBM_MOST_DATABASES], n, i;
    double thresholds[CDBM_MOST_DATABASES];
    cdbm_gathering gathering;
    memset(to, 0, sizeof *to);
    to->range = to->frame = to->row = -1, to->cost = (double)INFINITY;
    n = cdbm_databases_of(player, together->set, databases, thresholds);
    if (n == 0 || !cdbm_may_choose(together, player->joints[databases[0]].joint.n_roles)) return -1;
    for (i = 0; i < n; i++) {
        const cdbm_joint_clips *own = &player->joints[databases[i]];
        cdbm_room left = room;
        int is_done = cdbm_gather(player, databases[i], together, &gathering, &left);
        if (is_done != 1) return is_done;
        if (!cdbm_search_all_casts(own, together, &gathering, left)) return 0;
        if (gathering.best < to->cost && !cdbm_put_down(player, databases[i], together, &gathering, to)) return -1;
        if (gathering.best < thresholds[i]) break;
    }
    return 1;
}

/* Let a one-off be of another player of the same bundle, which has the poses of its database; 0 where that has not. */
static inline int cdbm_for_player(const cdbm_player *from, const cdbm_player *to, cdbm_one_off *one)
{
    size_t d;
    for (d = 0; d < to->n_databases; d++)
        if (one->database >= 0.0 && one->database < (double)from->n_databases && to->database_of[d] == from->database_of[(size_t)one->database]) {
            one->database = (double)d;
            return 1;
        }
    return 0;
}
