
/* ---- Single rows: whether a cell accepts its fact, what a row costs, and why it is not valid */

/* One word of the rows in which a column accepts a fact. */
static inline uint64_t cdbi_accepted(const cdb_column *column, const cdb_condition *condition, const cdb_fact *fact,
    cdb_unknown unknown, size_t word, size_t n_words)
{
    size_t slot, n_slots = column->n_masks / 3;
    uint64_t bits = ~(uint64_t)0;
    int is_missing = cdbi_is_missing(condition, fact);
    if (column->kind == 0 || (is_missing && unknown == CDB_UNKNOWN_ANY)) return bits;
    if (column->kind == CDBI_SLOTS)
        for (slot = 0; slot < n_slots; slot++)
            bits &= column->masks[(3 * slot + (is_missing ? 2 : cdbi_answer(column, condition, slot, fact))) * n_words + word];
    else if (column->kind == CDBI_WIDE && is_missing) bits = column->any_mask[word];
    else if (column->kind == CDBI_WIDE) cdbi_and_wide(&bits, column, cdbi_number(condition, fact), word, word + 1, n_words);
    else bits = cdbi_mask(column, condition, fact, is_missing, n_words)[word];
    return bits;
}

/* Whether a column accepts a fact in one row; a row of soft cells has one number for each depth. */
static inline int cdbi_accepts(const cdb_column *column, const cdb_condition *condition, const cdb_fact *fact, cdb_unknown unknown,
    size_t row, size_t n_words)
{
    return (int)(cdbi_accepted(column, condition, fact, unknown, row / 64, n_words) >> row % 64 & 1);
}

/* Refuse facts that are wrong or missing, and compute those that are derived. */
static inline cdb_status cdbi_ready(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact **facts, cdb_fact *own, cdb_unknown unknown, cdb_fault *fault)
{
    size_t i;
    cdb_status status = cdbi_derived(table, schema, facts, own, unknown, fault);
    for (i = 0; i < schema->n_conditions && status == CDB_OK; i++) {
        const cdb_fact *fact = &(*facts)[i];
        if (columns[i].kind == 0) continue;
        if (!cdbi_is_missing(&schema->conditions[i], fact)) {
            if (cdbi_is_wrong(&schema->conditions[i], fact)) status = cdbi_fact_fault(fault, CDB_WRONG_FACT, schema, i);
        } else if (unknown == CDB_UNKNOWN_ERROR) status = cdbi_missing_fault(fault, table, schema, *facts, i);
    }
    return status;
}

/* How far numbers from `low` to `high` are from a span. */
static inline double cdbi_gap(double low, double high, const double *span)
{
    return span[0] > high ? span[0] - high : low > span[1] ? low - span[1] : 0.0;
}

/* What a soft cell that does not accept its fact, or what is near it, costs: its penalty, or so many as that is away from it. */
static inline double cdbi_grown(const cdbi_soft *soft, const cdb_condition *condition, const cdb_fact *fact, int is_wide, size_t row)
{
    double penalty = soft->penalties[row], least, gap, spans[2][2];
    size_t n = 1, i;
    int64_t k;
    int turn, is_circular = condition->type == CDB_ANGLE;
    size_t cell = soft->per ? (size_t)soft->which[row] : 0;
    if (!soft->per || !(soft->per[cell] == soft->per[cell]) || cdbi_is_missing(condition, fact)) return penalty;
    if (!(penalty > 0.0)) return 0.0;
    spans[0][0] = spans[0][1] = cdbi_number(condition, fact);
    if (cdbi_is_widened(&soft->column, is_wide)) n = cdbi_near(&soft->column, condition, fact, spans);
    least = cdbi_gap(spans[0][0], spans[0][1], soft->ends + 2 * soft->starts[cell]);
    for (i = 0; i < n; i++)
        for (k = soft->starts[cell]; k < soft->starts[cell + 1]; k++)
            for (turn = is_circular ? -1 : 0; turn <= is_circular; turn++) {
                gap = cdbi_gap(spans[i][0] + 360.0 * (double)turn, spans[i][1] + 360.0 * (double)turn, soft->ends + 2 * k);
                if (gap < least) least = gap;
            }
    return penalty * (least / soft->per[cell]);
}

/* What the soft cells of one row cost at one depth of tables inside tables. */
static inline double cdbi_cost(const cdb_table *table, const cdb_schema *schema, const cdb_fact *facts, cdb_unknown unknown, int is_wide,
    size_t depth, size_t row)
{
    size_t i, at = depth * table->n_rows + row, n_words = (table->n_depths * table->n_rows + 63) / 64;
    double cost = 0.0;
    for (i = 0; table->soft && i < schema->n_conditions; i++) {
        const cdb_column *column = &table->soft[i].column;
        uint64_t bits = ~(uint64_t)0;
        if (column->kind == 0) continue;
        if (!cdbi_is_widened(column, is_wide) || cdbi_is_missing(&schema->conditions[i], &facts[i]))
            bits = cdbi_accepted(column, &schema->conditions[i], &facts[i], unknown, at / 64, n_words);
        else cdbi_and_near(&bits, column, &schema->conditions[i], &facts[i], at / 64, at / 64 + 1, n_words);
        if (!(bits >> at % 64 & 1)) cost = cdbi_sum(cost, cdbi_grown(&table->soft[i], &schema->conditions[i], &facts[i], is_wide, at));
    }
    return cost;
}

static inline cdb_status cdbi_penalties(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact *facts, cdb_unknown unknown, int is_wide, double *penalties, size_t room, cdb_fault *fault)
{
    cdb_fact own[CDB_MOST_FACTS];
    size_t row, depth;
    cdb_status status;
    for (row = 0; row < room; row++) penalties[row] = 0.0;
    if (room < table->n_rows)
        return cdbi_fault(fault, CDB_TOO_SHORT, "the array for the penalties is shorter than the table", -1, "");
    status = table->soft ? cdbi_ready(table, columns, schema, &facts, own, unknown, fault) : CDB_OK;
    if (status != CDB_OK) return status;
    for (row = 0; table->soft && row < table->n_rows; row++)
        for (depth = 0; depth < table->n_depths; depth++)
            penalties[row] = cdbi_sum(penalties[row], cdbi_cost(table, schema, facts, unknown, is_wide, depth, row));
    return cdbi_fault(fault, CDB_OK, "", -1, "");
}

/* What the soft cells of every row that do not accept their facts cost: `penalties` has room for so many numbers. */
CDB_API cdb_status cdb_penalties(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact *facts, cdb_unknown unknown, double *penalties, size_t room, cdb_fault *fault)
{
    return cdbi_penalties(table, columns, schema, facts, unknown, 0, penalties, room, fault);
}

/* The same for cdb_query_widened. */
CDB_API cdb_status cdb_penalties_widened(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact *facts, cdb_unknown unknown, double *penalties, size_t room, cdb_fault *fault)
{
    return cdbi_penalties(table, columns, schema, facts, unknown, 1, penalties, room, fault);
}

#define CDB_RULE (-1)               /* not a cell fails but the row's rule */
#define CDB_DISABLED (-2)           /* the row is disabled */

/* Why a row is not valid: the numbers of the conditions whose cells fail, CDB_RULE and CDB_DISABLED, as many as have room in
 * `reasons`; *n is their whole number, 0 for a valid row. With CDB_UNKNOWN_ERROR a row that an open rule alone keeps from being
 * valid is a fault, as in a query. */
CDB_API cdb_status cdb_why_not(const cdb_table *table, const cdb_column *columns, const cdb_schema *schema,
    const cdb_fact *facts, cdb_unknown unknown, int64_t row, int *reasons, size_t room, size_t *n, cdb_fault *fault)
{
    cdb_fact own[CDB_MOST_FACTS];
    size_t i;
    int truth, is_open;
    cdb_status status;
    *n = 0;
    if (row < 0 || (uint64_t)row >= table->n_rows) return cdbi_fault(fault, CDB_TOO_SHORT, "the table has no such row", -1, "");
    status = cdbi_ready(table, columns, schema, &facts, own, unknown, fault);
    if (status != CDB_OK) return status;
    truth = cdbi_rule(table, schema, facts, (size_t)row);
    is_open = truth < 0 && unknown == CDB_UNKNOWN_ERROR;
    for (i = 0; i < schema->n_conditions + 2; i++) {
        int reason = (int)i;
        if (i < schema->n_conditions) {
            if (cdbi_accepts(&columns[i], &schema->conditions[i], &facts[i], unknown, (size_t)row, table->n_words)) continue;
        } else if (i == schema->n_conditions) {
            if (!cdbi_is_out(truth, unknown)) continue;
            reason = CDB_RULE;
        } else {
            if (table->enabled[row / 64] >> row % 64 & 1) continue;
            reason = CDB_DISABLED;
        }
        if (*n < room) reasons[*n] = reason;
        *n += 1;
        is_open = is_open && reason == CDB_RULE;
    }
    if (*n == 0 || !is_open) return cdbi_fault(fault, CDB_OK, "", -1, "");
    *n = 0;
    return cdbi_open_rule(fault, table, (size_t)row);
}
