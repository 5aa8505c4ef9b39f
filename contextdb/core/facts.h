
/* ---- Facts */

static inline size_t cdbi_first_bit(uint64_t word)
{
#if defined(__GNUC__)
    return (size_t)__builtin_ctzll(word);
#else
    size_t bit = 0, step;
    for (step = 32; step > 0; step /= 2)
        if ((word & (((uint64_t)1 << step) - 1)) == 0) {
            word >>= step;
            bit += step;
        }
    return bit;
#endif
}

static inline uint64_t cdbi_count_bits(uint64_t word)
{
    word -= (word >> 1) & 0x5555555555555555;
    word = (word & 0x3333333333333333) + ((word >> 2) & 0x3333333333333333);
    word = (word + (word >> 4)) & 0x0F0F0F0F0F0F0F0F;
    return (word * 0x0101010101010101) >> 56;
}

CDBI_HOT int cdbi_is_missing(const cdb_condition *condition, const cdb_fact *fact)
{
    switch (condition->type) {
    case CDB_BOOL:
    case CDB_ENUM: return fact->whole == CDB_MISSING;
    case CDB_INT: return condition->expr ? cdbi_is_nan(fact->number) : fact->whole == CDB_MISSING_INT;
    case CDB_DATE: return fact->whole == CDB_MISSING_INT;
    case CDB_NUMBER:
    case CDB_ANGLE: return cdbi_is_nan(fact->number);
    case CDB_TEXT: return fact->text == NULL;
    case CDB_TAGS: break;
    }
    if (condition->expr) return fact->same.fact == NULL;
    return condition->n_values > 0 ? fact->tags == NULL || (fact->tags[0] & 1) == 0 : fact->texts.count < 0;
}

/* A fact of a condition that is not known. */
static inline cdb_fact cdbi_missing(const cdb_condition *condition)
{
    cdb_fact fact;
    memset(&fact, 0, sizeof fact);
    if (cdbi_is_double(condition->type) || (condition->type == CDB_INT && condition->expr))
        fact.number = cdb_missing_number();
    else if (cdbi_is_numeric(condition->type)) fact.whole = CDB_MISSING_INT;
    else if (condition->type == CDB_TAGS && condition->n_values == 0) fact.texts.count = CDB_MISSING;
    else if (condition->type == CDB_BOOL || condition->type == CDB_ENUM) fact.whole = CDB_MISSING;
    return fact;
}

CDBI_HOT double cdbi_number(const cdb_condition *condition, const cdb_fact *fact)
{
    if (condition->type == CDB_DATE || (condition->type == CDB_INT && !condition->expr)) return (double)fact->whole;
    return condition->type == CDB_ANGLE ? cdbi_wrapped(fact->number) : fact->number;
}

/* Whether a fact of given tags has a tag, itself or through one under it. */
static inline int cdbi_has_tag(const cdb_condition *condition, const cdb_fact *fact, const char *tag)
{
    size_t i;
    int64_t j;
    for (i = 1; i < condition->n_values; i++)
        if (fact->tags[i / 64] >> (i % 64) & 1 && cdbi_covers(tag, condition->values[i])) return 1;
    for (j = 0; condition->n_values == 0 && j < fact->texts.count; j++)
        if (cdbi_covers(tag, fact->texts.texts[j])) return 1;
    return 0;
}

/* The number of a declared value; n_values for a text that is none. */
static inline size_t cdbi_value_number(const cdb_condition *condition, const char *text)
{
    size_t i = 0;
    while (i < condition->n_values && strcmp(condition->values[i], text) != 0) i++;
    return i;
}

/* Whether a condition declares all tags of a fact of another one, or declares none at all. */
static inline int cdbi_are_declared(const cdb_condition *condition, const cdbi_tags *tags)
{
    size_t i, n = tags->condition->n_values;
    int64_t j;
    if (condition->n_values == 0) return 1;
    for (i = 1; i < n; i++)
        if (tags->fact->tags[i / 64] >> (i % 64) & 1
            && cdbi_value_number(condition, tags->condition->values[i]) == condition->n_values)
            return 0;
    for (j = 0; n == 0 && j < tags->fact->texts.count; j++)
        if (cdbi_value_number(condition, tags->fact->texts.texts[j]) == condition->n_values) return 0;
    return 1;
}

/* Whether a fact is none that the condition can have. */
CDBI_HOT int cdbi_is_wrong(const cdb_condition *condition, const cdb_fact *fact)
{
    switch (condition->type) {
    case CDB_BOOL: return fact->whole < 0 || fact->whole > 1;
    case CDB_ENUM: return fact->whole < 0 || (uint64_t)fact->whole >= condition->n_values;
    case CDB_DATE: return fact->whole < CDB_FIRST_DATE || fact->whole > CDB_LAST_DATE;
    case CDB_ANGLE: return cdbi_is_infinite(fact->number);
    case CDB_TAGS: return condition->expr && !cdbi_are_declared(condition, &fact->same);
    default: return 0;
    }
}

static inline int cdbi_has(const cdb_condition *condition, const cdbi_list *list, size_t at, const cdb_fact *fact)
{
    size_t width = cdbi_tag_words(condition), i;
    int64_t j;
    if (condition->expr) return cdbi_has_tag(fact->same.condition, fact->same.fact, list->texts[at]);
    if (width > 0) {
        for (i = 0; i < width; i++)
            if (list->bits[at * width + i] & fact->tags[i]) return 1;
        return 0;
    }
    for (j = 0; j < fact->texts.count; j++)
        if (cdbi_covers(list->texts[at], fact->texts.texts[j])) return 1;
    return 0;
}

static inline cdb_status cdbi_fact_fault(cdb_fault *fault, cdb_status status, const cdb_schema *schema, size_t at)
{
    const char *reason = status == CDB_MISSING_FACT ? "the fact is missing" : "the fact is not one that the condition can have";
    return cdbi_fault(fault, status, reason, (int)at, schema->conditions[at].name);
}
