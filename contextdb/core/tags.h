/* ---- Tags of the markup: which kinds of frames a search may choose, and what it costs to choose them.
 *
 * A tag covers those below it: Move covers Move.Run. See contextdb/motion/markup/tag_filter.py. */

#define CDBM_MOST_COST 1e30         /* of a soft tag */

typedef struct cdbm_named_cost { const char *name; double cost; } cdbm_named_cost; /* what frames with a tag, or of an asset, cost more */

typedef struct cdbm_tags {
    const char *const *include, *const *every, *const *exclude; /* a frame has one of these at least, all of these, none of these */
    size_t n_include, n_every, n_exclude;
    const cdbm_named_cost *prefer, *avoid; /* what a frame costs more without a tag; and with it */
    size_t n_prefer, n_avoid;
} cdbm_tags;

typedef struct cdbm_tag_list {      /* those that the markup of a database knows */
    const char *names;              /* [n] one after another, each ended by 0 */
    const uint8_t *flags;           /* [K, n] which kinds of frames have them */
    size_t n, n_kinds;
} cdbm_tag_list;

static inline int cdbm_covers(const char *tag, const char *other)
{
    size_t n = strlen(tag);
    return strncmp(tag, other, n) == 0 && (other[n] == 0 || other[n] == '.');
}

/* Which kinds have a tag, or one below it: [K]. 0 for a tag that the markup does not know. */
static inline int cdbm_have_tag(const cdbm_tag_list *known, const char *tag, uint8_t *to)
{
    const char *name = known->names;
    size_t t, k;
    int is_known = 0;
    memset(to, 0, known->n_kinds);
    for (t = 0; t < known->n; t++, name += strlen(name) + 1) {
        if (!cdbm_covers(tag, name)) continue;
        is_known = 1;
        for (k = 0; k < known->n_kinds; k++) to[k] = (uint8_t)(to[k] | known->flags[k * known->n + t]);
    }
    return is_known;
}

/* Write which kinds have one of some tags at least, or lack one; 0 for a tag that the markup does not know. */
static inline int cdbm_have_any(const cdbm_tag_list *known, const char *const *tags, size_t n, int is_lacking, uint8_t *any, uint8_t *own)
{
    size_t i, k;
    memset(any, 0, known->n_kinds);
    for (i = 0; i < n; i++) {
        if (!cdbm_have_tag(known, tags[i], own)) return 0;
        for (k = 0; k < known->n_kinds; k++) any[k] = (uint8_t)(any[k] | ((own[k] != 0) != is_lacking));
    }
    return 1;
}

/* Add what soft tags cost frames of each kind: those with the tag, or those without. */
static inline int cdbm_add_costs(const cdbm_tag_list *known, const cdbm_named_cost *costs, size_t n, int is_lacking, double *added, uint8_t *own)
{
    size_t i, k;
    for (i = 0; i < n; i++) {
        if (!cdbm_have_tag(known, costs[i].name, own)) return 0;
        for (k = 0; k < known->n_kinds; k++) added[k] += (own[k] != 0) != is_lacking ? costs[i].cost : 0.0;
    }
    return 1;
}

/* Write which kinds of frames a filter lets pass, and what it adds to their costs: [K] each; `own` has room for twice K flags. 0 for a
 * tag that the markup does not know. */
static inline int cdbm_filter_kinds(const cdbm_tag_list *known, const cdbm_tags *tags, uint8_t *passes, double *added, uint8_t *own)
{
    uint8_t *any = own + known->n_kinds;
    size_t k;
    for (k = 0; k < known->n_kinds; k++) passes[k] = 1, added[k] = 0.0;
    if (!cdbm_have_any(known, tags->include, tags->n_include, 0, any, own)) return 0;
    for (k = 0; tags->n_include > 0 && k < known->n_kinds; k++) passes[k] = any[k];
    if (!cdbm_have_any(known, tags->every, tags->n_every, 1, any, own)) return 0;
    for (k = 0; k < known->n_kinds; k++) passes[k] = passes[k] && !any[k];
    if (!cdbm_have_any(known, tags->exclude, tags->n_exclude, 0, any, own)) return 0;
    for (k = 0; k < known->n_kinds; k++) passes[k] = passes[k] && !any[k];
    return cdbm_add_costs(known, tags->prefer, tags->n_prefer, 1, added, own)
        && cdbm_add_costs(known, tags->avoid, tags->n_avoid, 0, added, own);
}

/* Whether all costs are from one to another. */
static inline int cdbm_are_costs(const cdbm_named_cost *costs, size_t n, double least, double most)
{
    size_t i;
    for (i = 0; i < n; i++)
        if (!(costs[i].cost >= least && costs[i].cost <= most)) return 0;
    return 1;
}
