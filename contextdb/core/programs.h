
/* ---- Programs: rules of rows and derived facts, computed by a small stack machine without jumps. Opening follows each program once
 * with the types of its values alone; what is asked later can therefore neither leave the stack nor meet a value of another type. */

#define CDBI_STACK 256
#define CDBI_NUMBERS 'n'
#define CDBI_TRUTHS 't'
#define CDBI_WORDS 'w'
#define CDBI_TAG_SETS 's'

enum {
    CDBI_PUT_NUMBER, CDBI_PUT_TEXT, CDBI_PUT_TRUTH, CDBI_PUT_FACT, CDBI_ADD, CDBI_SUBTRACT, CDBI_MULTIPLY, CDBI_DIVIDE,
    CDBI_FLOOR_DIVIDE, CDBI_REMAINDER, CDBI_NEGATE, CDBI_ABSOLUTE, CDBI_LENGTH, CDBI_ROOT, CDBI_FLOOR, CDBI_CEILING, CDBI_ROUND,
    CDBI_HEADING, CDBI_WRAP, CDBI_POWER, CDBI_LOWEST, CDBI_HIGHEST, CDBI_SETTLE, CDBI_COMPARE_NUMBERS, CDBI_COMPARE_TEXTS,
    CDBI_COMPARE_TRUTHS, CDBI_IN_SPANS, CDBI_IN_TEXTS, CDBI_IN_TRUTHS, CDBI_HAS_TAGS, CDBI_AND, CDBI_OR, CDBI_NOT, CDBI_IF,
    CDBI_OPS
};

typedef union cdbi_value {
    double number;                  /* NaN: missing; never -0 */
    int truth;                      /* 0, 1, or CDB_MISSING */
    const char *text;               /* NULL: missing */
    cdbi_tags tags;                 /* without a fact: missing */
} cdbi_value;

/* What each instruction takes, the top of the stack last, and what it leaves. */
static inline const char *cdbi_shape(int32_t op)
{
    static const char *const shapes[CDBI_OPS] = {":n", ":w", ":t", ":", "nn:n", "nn:n", "nn:n", "nn:n", "nn:n", "nn:n", "n:n",
        "n:n", "nn:n", "n:n", "n:n", "n:n", "n:n", "nn:n", "n:n", "n:n", "nn:n", "nn:n", "n:n", "nn:t", "ww:t", "tt:t", "n:t",
        "w:t", "t:t", "s:t", "tt:t", "tt:t", "t:t", "t:"};
    return op >= 0 && op < CDBI_OPS ? shapes[op] : NULL;
}

static inline char cdbi_value_type(cdb_type type)
{
    if (type == CDB_BOOL) return CDBI_TRUTHS;
    if (type == CDB_TAGS) return CDBI_TAG_SETS;
    return type == CDB_ENUM || type == CDB_TEXT ? CDBI_WORDS : CDBI_NUMBERS;
}

/* ---- Checking */

typedef struct cdbi_check_stack {
    char types[CDBI_STACK];
    size_t n;
} cdbi_check_stack;

static inline int cdbi_pop(cdbi_check_stack *stack, char type)
{
    return stack->n > 0 && stack->types[--stack->n] == type;
}

static inline int cdbi_push(cdbi_check_stack *stack, char type)
{
    if (stack->n == CDBI_STACK) return 0;
    stack->types[stack->n++] = type;
    return 1;
}

/* Whether the operands of an instruction name what is there. */
static inline int cdbi_operands_fit(const cdbi_programs *programs, const int32_t *step)
{
    int64_t a = step[1], b = step[2], c = step[3];
    if (a < 0 || b < 0 || c < 0) return 0;
    switch (step[0]) {
    case CDBI_PUT_NUMBER: return (uint64_t)a < programs->n_numbers;
    case CDBI_PUT_TEXT: return (uint64_t)a < programs->texts.n;
    case CDBI_PUT_TRUTH: return a <= 1;
    case CDBI_PUT_FACT: return (uint64_t)a < programs->facts.n;
    case CDBI_POWER: return a <= 64;
    case CDBI_COMPARE_NUMBERS: return a <= 5 && b <= 7 && c <= 3;
    case CDBI_COMPARE_TEXTS:
    case CDBI_COMPARE_TRUTHS: return a <= 1 && c <= 3;
    case CDBI_IN_SPANS: return (uint64_t)(a + 2 * b) <= programs->n_numbers;
    case CDBI_IN_TEXTS: return (uint64_t)(a + b) <= programs->texts.n && c <= 1;
    case CDBI_IN_TRUTHS: return a <= 3;
    case CDBI_HAS_TAGS: return (uint64_t)(a + b + c / 2) <= programs->texts.n;
    case CDBI_IF: return a <= 3;
    default: return 1;
    }
}

static inline int cdbi_step_fits(const cdbi_programs *programs, const cdb_schema *schema, const int32_t *step,
    cdbi_check_stack *stack)
{
    static const char types[] = {CDBI_NUMBERS, CDBI_TRUTHS, CDBI_WORDS, CDBI_TAG_SETS};
    const char *shape = cdbi_shape(step[0]), *leaves = shape ? strchr(shape, ':') : NULL, *at;
    if (!leaves || !cdbi_operands_fit(programs, step)) return 0;
    if (step[0] == CDBI_PUT_FACT) {
        size_t place = programs->places[step[1]];
        return cdbi_push(stack, cdbi_value_type(schema->conditions[place].type));
    }
    if (step[0] == CDBI_IF && !(cdbi_pop(stack, types[step[1]]) && cdbi_pop(stack, types[step[1]]))) return 0;
    for (at = leaves; at > shape; at--)
        if (!cdbi_pop(stack, at[-1])) return 0;
    if (step[0] == CDBI_IF) return cdbi_push(stack, types[step[1]]);
    if (step[0] >= CDBI_COMPARE_NUMBERS && step[0] <= CDBI_COMPARE_TRUTHS) {
        if (step[3] & 2 && !cdbi_pop(stack, CDBI_TRUTHS)) return 0;
        return cdbi_push(stack, CDBI_TRUTHS) && (!(step[3] & 1) || cdbi_push(stack, shape[1]));
    }
    return cdbi_push(stack, leaves[1]);
}

/* Whether a program leaves one value of a type, out of facts that are given or computed before it. */
static inline int cdbi_program_fits(const cdbi_programs *programs, const cdb_schema *schema, size_t program, char type)
{
    const int32_t *step = programs->code + 4 * programs->starts[program], *end = programs->code + 4 * programs->starts[program + 1];
    cdbi_check_stack stack;
    stack.n = 0;
    for (; step < end; step += 4)
        if (!cdbi_step_fits(programs, schema, step, &stack)) return 0;
    return stack.n == 1 && stack.types[0] == type;
}

/* Whether a program names a fact, by number one of some. */
static inline int cdbi_names_other(const cdbi_programs *programs, const unsigned char *is_other, size_t program)
{
    const int32_t *step = programs->code + 4 * programs->starts[program], *end = programs->code + 4 * programs->starts[program + 1];
    for (; step < end; step += 4)
        if (step[0] == CDBI_PUT_FACT && step[1] >= 0 && (uint64_t)step[1] < programs->facts.n && is_other[step[1]]) return 1;
    return 0;
}

/* ---- Computing */

/* The case of a fact that is taken from another one: tags are not copied. */
static inline cdbi_tags cdbi_tags_of(const cdb_condition *condition, const cdb_fact *fact)
{
    cdbi_tags tags;
    if (condition->expr) return fact->same;
    tags.condition = condition;
    tags.fact = cdbi_is_missing(condition, fact) ? NULL : fact;
    return tags;
}

static inline cdbi_value cdbi_fact_value(const cdb_condition *condition, const cdb_fact *fact)
{
    cdbi_value value;
    switch (condition->type) {
    case CDB_BOOL: value.truth = (int)fact->whole; break;
    case CDB_ENUM:
        if (condition->expr) value.text = fact->derived.text;
        else value.text = fact->whole < 0 ? NULL : condition->values[fact->whole];
        break;
    case CDB_TEXT: value.text = fact->text; break;
    case CDB_TAGS: value.tags = cdbi_tags_of(condition, fact); break;
    default:
        if (cdbi_is_missing(condition, fact)) value.number = cdb_missing_number();
        else value.number = cdbi_plain(cdbi_number(condition, fact));
    }
    return value;
}

static inline int cdbi_compare(const int32_t *step, const cdbi_value *left, const cdbi_value *right)
{
    double a, b;
    uint64_t one, other;
    if (step[0] == CDBI_COMPARE_TEXTS) {
        if (!left->text || !right->text) return CDB_MISSING;
        return (strcmp(left->text, right->text) == 0) != step[1];
    }
    if (step[0] == CDBI_COMPARE_TRUTHS) {
        if (left->truth < 0 || right->truth < 0) return CDB_MISSING;
        return (left->truth == right->truth) != step[1];
    }
    a = left->number;
    b = right->number;
    if (cdbi_is_nan(a) || cdbi_is_nan(b)) return CDB_MISSING;
    if (step[2] & 1 && !cdbi_is_infinite(a)) a = cdbi_plain(cdbi_wrapped(a));
    if (step[2] & 1 && !cdbi_is_infinite(b)) b = cdbi_plain(cdbi_wrapped(b));
    if (step[2] & 2 && cdbi_place(a) == cdbi_place(-180.0)) a = 180.0;
    if (step[2] & 4 && cdbi_place(b) == cdbi_place(-180.0)) b = 180.0;
    one = cdbi_place(a);
    other = cdbi_place(b);
    switch (step[1]) {
    case 0: return one == other;
    case 1: return one != other;
    case 2: return one < other;
    case 3: return one <= other;
    case 4: return one > other;
    default: return one >= other;
    }
}

static inline int cdbi_in_spans(double number, const double *ends, int32_t n)
{
    uint64_t place = cdbi_place(number);
    int32_t i;
    if (cdbi_is_nan(number)) return CDB_MISSING;
    for (i = 0; i < n; i++)
        if (cdbi_place(cdbi_plain(ends[2 * i])) <= place && place <= cdbi_place(cdbi_plain(ends[2 * i + 1]))) return 1;
    return 0;
}

static inline int cdbi_in_texts(const char *text, const char *const *texts, int32_t n, int is_complement)
{
    int32_t i;
    if (!text) return CDB_MISSING;
    for (i = 0; i < n; i++)
        if (strcmp(texts[i], text) == 0) return !is_complement;
    return is_complement;
}

static inline int cdbi_has_tags(const cdbi_tags *tags, const char *const *texts, int32_t n_needs, int32_t rest)
{
    int32_t i;
    if (!tags->fact) return CDB_MISSING;
    for (i = 0; i < n_needs + rest / 2; i++)
        if (cdbi_has_tag(tags->condition, tags->fact, texts[i]) != (i < n_needs)) return rest & 1;
    return !(rest & 1);
}

/* Of two truths what `and` makes of them, or `or`: one that decides alone, else a missing one. */
static inline int cdbi_joined(int one, int other, int decides)
{
    if (one == decides || other == decides) return decides;
    return one < 0 || other < 0 ? CDB_MISSING : !decides;
}

static inline double cdbi_computed(int32_t op, double a, double b)
{
    switch (op) {
    case CDBI_ADD: return cdbi_sum(a, b);
    case CDBI_SUBTRACT: return cdbi_sum(a, cdbi_negative(b));
    case CDBI_MULTIPLY: return cdbi_product(a, b);
    case CDBI_DIVIDE: return cdbi_ratio(a, b);
    case CDBI_FLOOR_DIVIDE: return cdbi_floor_ratio(a, b);
    case CDBI_REMAINDER: return cdbi_remainder(a, b);
    case CDBI_LENGTH: return cdbi_length(a, b);
    case CDBI_HEADING: return cdbi_heading(a, b);
    case CDBI_NEGATE: return cdbi_negative(b);
    case CDBI_ABSOLUTE: return cdbi_without_sign(b);
    case CDBI_ROOT: return cdbi_root(b);
    case CDBI_FLOOR: return cdbi_floor(b);
    case CDBI_CEILING: return cdbi_negative(cdbi_floor(cdbi_negative(b)));
    case CDBI_ROUND: return cdbi_round(b);
    case CDBI_WRAP: return cdbi_is_nan(b) || cdbi_is_infinite(b) ? b : cdbi_wrapped(b);
    default: return b;
    }
}

/* The value of a program that has been checked; `facts` are in the order of the schema. */
static inline cdbi_value cdbi_run(const cdbi_programs *programs, const cdb_schema *schema, const cdb_fact *facts, size_t program)
{
    cdbi_value stack[CDBI_STACK], *top = stack; /* the next free place */
    const int32_t *step = programs->code + 4 * programs->starts[program], *end = programs->code + 4 * programs->starts[program + 1];
    for (; step < end; step += 4) {
        int32_t op = step[0];
        int truth;
        switch (op) {
        case CDBI_PUT_NUMBER: (top++)->number = cdbi_plain(programs->numbers[step[1]]); break;
        case CDBI_PUT_TEXT: (top++)->text = programs->texts.texts[step[1]]; break;
        case CDBI_PUT_TRUTH: (top++)->truth = step[1]; break;
        case CDBI_PUT_FACT: {
            size_t place = programs->places[step[1]];
            *top++ = cdbi_fact_value(&schema->conditions[place], &facts[place]);
            break;
        }
        case CDBI_POWER: top[-1].number = cdbi_settled(cdbi_power(top[-1].number, step[1])); break;
        case CDBI_LOWEST:
        case CDBI_HIGHEST:
            top--;
            top[-1].number = cdbi_lowest(top[-1].number, top[0].number, op == CDBI_HIGHEST);
            break;
        case CDBI_COMPARE_NUMBERS:
        case CDBI_COMPARE_TEXTS:
        case CDBI_COMPARE_TRUTHS:
            top -= 2;
            truth = cdbi_compare(step, &top[0], &top[1]);
            if (step[3] & 2) {
                top--;
                truth = cdbi_joined(top[0].truth, truth, 0);
                if (step[3] & 1) top[1] = top[2];
            }
            top[0].truth = truth;
            top += 1 + (step[3] & 1);
            break;
        case CDBI_IN_SPANS: top[-1].truth = cdbi_in_spans(top[-1].number, programs->numbers + step[1], step[2]); break;
        case CDBI_IN_TEXTS:
            top[-1].truth = cdbi_in_texts(top[-1].text, programs->texts.texts + step[1], step[2], step[3]);
            break;
        case CDBI_IN_TRUTHS:
            if (top[-1].truth >= 0) top[-1].truth = step[1] >> top[-1].truth & 1;
            break;
        case CDBI_HAS_TAGS:
            truth = cdbi_has_tags(&top[-1].tags, programs->texts.texts + step[1], step[2], step[3]);
            top[-1].truth = truth;
            break;
        case CDBI_AND:
        case CDBI_OR:
            top--;
            top[-1].truth = cdbi_joined(top[-1].truth, top[0].truth, op == CDBI_OR);
            break;
        case CDBI_NOT:
            if (top[-1].truth >= 0) top[-1].truth = !top[-1].truth;
            break;
        case CDBI_IF:
            top -= 2;
            truth = top[-1].truth;
            if (truth >= 0) top[-1] = truth ? top[0] : top[1];
            else {
                memset(&top[-1], 0, sizeof top[-1]); /* a missing text, missing tags */
                if (step[1] == 0) top[-1].number = cdb_missing_number();
                if (step[1] == 1) top[-1].truth = CDB_MISSING;
            }
            break;
        default: /* a function of one number or of two */
            if (cdbi_shape(op)[1] == ':') top[-1].number = cdbi_settled(cdbi_computed(op, 0.0, top[-1].number));
            else {
                top--;
                top[-1].number = cdbi_settled(cdbi_computed(op, top[-1].number, top[0].number));
            }
        }
    }
    return stack[0];
}

/* ---- Derived facts */

/* Keep a value as the fact of a derived condition: an angle wrapped, a date within the calendar. */
static inline void cdbi_keep(const cdb_condition *condition, cdbi_value value, cdb_fact *fact)
{
    memset(fact, 0, sizeof *fact);
    switch (condition->type) {
    case CDB_BOOL: fact->whole = value.truth; break;
    case CDB_ENUM:
        fact->derived.text = value.text;
        fact->derived.whole = value.text ? (int64_t)cdbi_value_number(condition, value.text) : CDB_MISSING;
        break;
    case CDB_TEXT: fact->text = value.text; break;
    case CDB_TAGS: fact->same = value.tags; break;
    case CDB_ANGLE:
        fact->number = cdbi_is_infinite(value.number) ? cdb_missing_number() : value.number;
        if (!cdbi_is_nan(fact->number)) fact->number = cdbi_plain(cdbi_wrapped(fact->number));
        break;
    case CDB_DATE:
        fact->whole = CDB_MISSING_INT;
        if (!cdbi_is_less(value.number, CDB_FIRST_DATE) && !cdbi_is_less(CDB_LAST_DATE, value.number))
            fact->whole = (int64_t)value.number;
        break;
    default: fact->number = value.number;
    }
}

/* The given fact for want of which a fact is missing, or a derived one that cannot be computed though no fact is missing. What a
 * derived fact needs is computed before it, so one way back through the programs is enough. */
static inline size_t cdbi_lacking(const cdb_table *table, const cdb_schema *schema, const cdb_fact *facts, size_t at)
{
    const cdbi_programs *programs = &table->programs;
    size_t i = programs->n_derived, next, place;
    const int32_t *step, *end;
    while (schema->conditions[at].expr) {
        while (i > 0 && programs->places[programs->derived[i - 1]] != at) i--;
        if (i == 0) return at;
        step = programs->code + 4 * programs->starts[i - 1];
        end = programs->code + 4 * programs->starts[i];
        for (next = at; step < end; step += 4) {
            place = step[0] == CDBI_PUT_FACT ? programs->places[step[1]] : at;
            if (place == at || !cdbi_is_missing(&schema->conditions[place], &facts[place])) continue;
            if (!schema->conditions[place].expr) return place;
            next = place;
        }
        if (next == at) return at;
        at = next;
    }
    return at;
}

static inline cdb_status cdbi_missing_fault(cdb_fault *fault, const cdb_table *table, const cdb_schema *schema,
    const cdb_fact *facts, size_t at)
{
    size_t lacking = cdbi_lacking(table, schema, facts, at);
    if (!schema->conditions[lacking].expr) return cdbi_fact_fault(fault, CDB_MISSING_FACT, schema, lacking);
    return cdbi_fault(fault, CDB_MISSING_FACT, "the fact has no finite value with those that it is computed from", (int)lacking,
        schema->conditions[lacking].name);
}

/* Compute the derived facts, and refuse facts that programs need and that are wrong or missing. */
static inline cdb_status cdbi_derive(const cdb_table *table, const cdb_schema *schema, cdb_fact *facts, cdb_unknown unknown,
    cdb_fault *fault)
{
    const cdbi_programs *programs = &table->programs;
    size_t i, place;
    for (i = 0; i < schema->n_conditions; i++)
        if (programs->is_needed[i] && !schema->conditions[i].expr && !cdbi_is_missing(&schema->conditions[i], &facts[i])
            && cdbi_is_wrong(&schema->conditions[i], &facts[i]))
            return cdbi_fact_fault(fault, CDB_WRONG_FACT, schema, i);
    for (i = 0; i < programs->n_derived; i++) {
        if (programs->is_dropped[i]) continue;
        place = programs->places[programs->derived[i]];
        cdbi_keep(&schema->conditions[place], cdbi_run(programs, schema, facts, i), &facts[place]);
    }
    for (i = 0; i < schema->n_conditions; i++) {
        if (!programs->is_needed[i]) continue;
        if (!cdbi_is_missing(&schema->conditions[i], &facts[i])) {
            if (cdbi_is_wrong(&schema->conditions[i], &facts[i])) return cdbi_fact_fault(fault, CDB_WRONG_FACT, schema, i);
        } else if (unknown == CDB_UNKNOWN_ERROR) return cdbi_missing_fault(fault, table, schema, facts, i);
    }
    return CDB_OK;
}

/* The same, computed into `own`, which *facts then is; it has room for CDB_MOST_FACTS, or is where the facts are. */
CDBI_HOT cdb_status cdbi_derived(const cdb_table *table, const cdb_schema *schema, const cdb_fact **facts, cdb_fact *own,
    cdb_unknown unknown, cdb_fault *fault)
{
    if (!table->has_programs) return CDB_OK;
    if (own != *facts) {
        if (schema->n_conditions > CDB_MOST_FACTS)
            return cdbi_fault(fault, CDB_TOO_SHORT, "the table has more conditions than CDB_MOST_FACTS", -1, "");
        memcpy(own, *facts, schema->n_conditions * sizeof *own);
        *facts = own;
    }
    return cdbi_derive(table, schema, own, unknown, fault);
}

/* ---- Rules */

/* Whether a row's rule holds: 1 where it has none, CDB_MISSING where it is open. */
static inline int cdbi_rule(const cdb_table *table, const cdb_schema *schema, const cdb_fact *facts, size_t row)
{
    const cdbi_programs *programs = &table->programs;
    size_t program;
    if (!programs->n_of_row || programs->of_row[row] < 0) return 1;
    program = programs->n_derived + (size_t)programs->of_row[row];
    return programs->is_dropped[program] ? 1 : cdbi_run(programs, schema, facts, program).truth;
}

static inline cdb_status cdbi_open_rule(cdb_fault *fault, const cdb_table *table, size_t row)
{
    return cdbi_fault(fault, CDB_MISSING_FACT, "the rule of a row has no finite value with these facts", -1,
        table->assets ? table->assets[row] : "");
}

static inline int cdbi_is_out(int truth, cdb_unknown unknown)
{
    return truth == 0 || (truth < 0 && unknown != CDB_UNKNOWN_ANY);
}

/* Take the rows whose rule does not hold out of `rows`. Each rule is computed once, or, where fewer rows are left, for each row. */
static inline cdb_status cdbi_and_rules(uint64_t *rows, const cdb_table *table, const cdb_schema *schema, const cdb_fact *facts,
    cdb_unknown unknown, cdb_fault *fault)
{
    const cdbi_programs *programs = &table->programs;
    size_t n_rules = programs->n_programs - programs->n_derived, n_left = 0, i, word;
    if (programs->n_of_row == 0) return CDB_OK;
    for (word = 0; word < table->n_words; word++) n_left += (size_t)cdbi_count_bits(rows[word] & programs->ruled[word]);
    if (n_left == 0) return CDB_OK;
    if (n_left <= n_rules) {
        for (word = 0; word < table->n_words; word++) {
            uint64_t left = rows[word] & programs->ruled[word];
            for (; left; left &= left - 1) {
                size_t row = word * 64 + cdbi_first_bit(left);
                int truth = cdbi_rule(table, schema, facts, row);
                if (truth < 0 && unknown == CDB_UNKNOWN_ERROR) return cdbi_open_rule(fault, table, row);
                if (cdbi_is_out(truth, unknown)) rows[word] &= ~((uint64_t)1 << row % 64);
            }
        }
        return CDB_OK;
    }
    for (i = 0; i < n_rules; i++) {
        size_t at = programs->row_starts[i], end = programs->row_starts[i + 1], row;
        int truth;
        while (at < end && !(rows[programs->rows[at] / 64] >> programs->rows[at] % 64 & 1)) at++;
        if (at == end) continue;
        truth = cdbi_rule(table, schema, facts, programs->rows[at]);
        if (truth < 0 && unknown == CDB_UNKNOWN_ERROR) return cdbi_open_rule(fault, table, programs->rows[at]);
        for (; cdbi_is_out(truth, unknown) && at < end; at++) {
            row = programs->rows[at];
            rows[row / 64] &= ~((uint64_t)1 << row % 64);
        }
    }
    return CDB_OK;
}
