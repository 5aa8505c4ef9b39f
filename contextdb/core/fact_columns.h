/* ---- Columns of facts: arrays of numbers, truths and texts, as numpy and Arrow have them, to classes, many at a time. */

typedef struct cdbi_facts {
    char type;                      /* c C s S i I l L f g: numbers, as Arrow calls them, l and L of 8 bytes; D: days;
                                       ? truths in bytes, b in bits; w: texts of `width` characters of 4 bytes each;
                                       texts in UTF-8 u with ends of 4 bytes, U of 8, v in views */
    const void *items;
    const unsigned char *valid;     /* a bit for each fact that is not missing; NULL where all are there */
    size_t first;                   /* the first fact is so far in `items` and `valid` */
    size_t n, width;
    const char *octets;             /* of u and U */
    const char *const *buffers;     /* of v */
} cdbi_facts;

/* The bounds of a column of numbers. The line is cut into equal cells, so many that no three bounds share one: the cell of a number
 * says how many bounds are below its cell, and two comparisons say the rest. Exact, because which cell a number is in never falls as
 * the number grows. Without cells the class is found by halving. */
typedef struct cdbi_bounds {
    const double *bounds;           /* ascending; with cells there are two NaN behind them */
    size_t n;
    const int32_t *before;          /* for each cell how many bounds lie in earlier ones */
    size_t n_cells;
    double low, scale;
} cdbi_bounds;

static inline int cdbi_is_there(const cdbi_facts *facts, size_t at)
{
    size_t bit = facts->first + at;
    return !facts->valid || (facts->valid[bit / 8] >> (bit % 8) & 1);
}

/* Some facts as doubles, NaN for a missing one; 0 where they are no numbers. */
static inline int cdbi_doubles(const cdbi_facts *facts, size_t start, size_t n, double *to)
{
    size_t at = facts->first + start, k;
#define CDBI_DOUBLES(letter, type) \
    case letter: \
        for (k = 0; k < n; k++) to[k] = (double)((const type *)facts->items)[at + k]; \
        break
    switch (facts->type) {
    CDBI_DOUBLES('c', int8_t);
    CDBI_DOUBLES('C', uint8_t);
    CDBI_DOUBLES('s', int16_t);
    CDBI_DOUBLES('S', uint16_t);
    CDBI_DOUBLES('i', int32_t);
    CDBI_DOUBLES('D', int32_t);
    CDBI_DOUBLES('I', uint32_t);
    CDBI_DOUBLES('l', int64_t);
    CDBI_DOUBLES('L', uint64_t);
    CDBI_DOUBLES('f', float);
    CDBI_DOUBLES('g', double);
    default: return 0;
    }
#undef CDBI_DOUBLES
    for (k = 0; facts->valid && k < n; k++)
        if (!cdbi_is_there(facts, start + k)) to[k] = cdb_missing_number();
    return 1;
}

/* Whether numbers are facts of a type; angles are wrapped. */
static inline int cdbi_are_facts(cdb_type type, double *numbers, size_t n)
{
    int is_wrong = 0;
    size_t k;
    if (type == CDB_ANGLE)
        for (k = 0; k < n; k++) {
            is_wrong |= cdbi_is_infinite(numbers[k]);
            if (numbers[k] < -180.0 || numbers[k] >= 180.0) numbers[k] = is_wrong ? 0.0 : cdbi_wrapped(numbers[k]);
        }
    else if (type != CDB_NUMBER)
        for (k = 0; k < n; k++) {
            double x = numbers[k];
            if (x > -9.2e18 && x < 9.2e18) is_wrong |= !((double)(int64_t)x == x);
            if (type == CDB_DATE) is_wrong |= x < (double)CDB_FIRST_DATE || x > (double)CDB_LAST_DATE;
        }
    return !is_wrong;
}

/* The class of each number as a code: `first` for the class below all bounds; `missing` for NaN. */
static inline void cdbi_number_codes(const cdbi_bounds *among, const double *numbers, size_t n, int32_t first, int32_t missing,
    int32_t *codes)
{
    const double *bounds = among->bounds;
    size_t k;
    if (among->n_cells > 0) {
        double last = (double)(among->n_cells - 1);
        for (k = 0; k < n; k++) {
            double cell = (numbers[k] - among->low) * among->scale;
            int32_t at;
            cell = cell > 0.0 ? cell : 0.0; /* a NaN too */
            at = among->before[(int32_t)(cell < last ? cell : last)];
            at += (bounds[at] <= numbers[k]) + (bounds[at + 1] <= numbers[k]);
            codes[k] = numbers[k] == numbers[k] ? first + at : missing;
        }
        return;
    }
    for (k = 0; k < n; k++) {
        size_t at = 0, left = among->n;
        while (left > 0) {
            size_t half = (left + 1) / 2;
            at += bounds[at + half - 1] <= numbers[k] ? half : 0;
            left -= half;
        }
        codes[k] = numbers[k] == numbers[k] ? first + (int32_t)at : missing;
    }
}

/* ---- The number of a text among some. Texts are compared as so many words of 8 octets as the longest of them needs, filled up with
 * 0. */

#define CDBI_MOST_NAME_WORDS 4194304

typedef struct cdbi_names {
    const char *const *texts;
    const uint32_t *numbers;        /* of each text; NULL: 0, 1, 2, ... */
    size_t n, n_words;              /* so many texts, of so many words each */
    size_t last;                    /* the last of the slots, a power of two of them, at least twice as many as texts */
    uint64_t *words;                /* [n, n_words], and behind them room for one more */
    uint32_t *slots;                /* the place of a text, from 1 on; 0 for none */
    uint32_t *lengths;
} cdbi_names;

/* A text of less than 8 * n_words octets as words. */
CDBI_HOT void cdbi_pack(const char *text, size_t length, uint64_t *words, size_t n_words)
{
    size_t n = length / 8, rest = length % 8, i;
    uint64_t word = 0;
    for (i = 0; i < n; i++) memcpy(&words[i], text + 8 * i, 8);
    if (rest >= 4) {
        uint32_t low, high;
        memcpy(&low, text + 8 * n, 4);
        memcpy(&high, text + length - 4, 4);
        word = low | (uint64_t)high << (8 * (rest - 4));
    } else if (rest > 0)
        word = (uint64_t)(unsigned char)text[8 * n] | (uint64_t)(unsigned char)text[8 * n + rest / 2] << (8 * (rest / 2))
            | (uint64_t)(unsigned char)text[length - 1] << (8 * (rest - 1));
    words[n] = word;
    for (i = n + 1; i < n_words; i++) words[i] = 0;
}

/* The same for a text of at most 12 octets in a view, whose rest may be anything. */
CDBI_HOT void cdbi_pack_inline(const char *text, size_t length, uint64_t *words, size_t n_words)
{
    uint64_t low;
    uint32_t high;
    size_t i;
    memcpy(&low, text, 8);
    memcpy(&high, text + 8, 4);
    words[0] = length < 8 ? low & (((uint64_t)1 << (8 * length)) - 1) : low;
    words[1] = length > 8 ? high & (((uint64_t)1 << (8 * (length - 8))) - 1) : 0;
    for (i = 2; i < n_words; i++) words[i] = 0;
}

/* Words of 0 change nothing. */
CDBI_HOT uint64_t cdbi_mixed(const uint64_t *words, size_t n_words)
{
    uint64_t hash = 0;
    size_t i;
    for (i = 0; i < n_words; i++) hash += (words[i] ^ words[i] >> 31) * (0x9E3779B97F4A7C15 * (2 * i + 1));
    return hash >> 32;
}

/* Measure some texts: how many words and slots they need; 0 where they are too many or too long. */
static inline int cdbi_measure_names(cdbi_names *names, const char *const *texts, const uint32_t *numbers, size_t n)
{
    size_t i;
    names->texts = texts;
    names->numbers = numbers;
    names->n = n;
    names->n_words = 2;
    for (i = 0; i < n; i++) {
        size_t length = strlen(texts[i]);
        if (length / 8 + 1 > names->n_words) names->n_words = length / 8 + 1;
    }
    for (names->last = 63; names->last < 8 * n;) names->last = 2 * names->last + 1;
    return names->n_words < CDBI_MOST_NAME_WORDS / (n + 1);
}

/* Put the texts into their slots, which are 0: `names` has room for all of them. */
static inline void cdbi_index_names(cdbi_names *names)
{
    size_t i;
    for (i = 0; i < names->n; i++) {
        uint64_t *words = names->words + i * names->n_words;
        size_t at;
        names->lengths[i] = (uint32_t)strlen(names->texts[i]);
        cdbi_pack(names->texts[i], names->lengths[i], words, names->n_words);
        at = (size_t)cdbi_mixed(words, names->n_words) & names->last;
        while (names->slots[at] != 0) at = (at + 1) & names->last;
        names->slots[at] = (uint32_t)i + 1;
    }
}

/* The number of the text in the words behind those of all names; -1 for one that is none of them. `n_words` is that of the names. */
CDBI_HOT int32_t cdbi_name_number(const cdbi_names *names, size_t n_words)
{
    const uint64_t *words = names->words + names->n * n_words, *own;
    size_t at = (size_t)cdbi_mixed(words, n_words) & names->last, i, j;
    for (; names->slots[at] != 0; at = (at + 1) & names->last) {
        uint64_t differs = 0;
        i = names->slots[at] - 1;
        own = names->words + i * n_words;
        for (j = 0; j < n_words; j++) differs |= own[j] ^ words[j];
        if (!differs) return (int32_t)i;
    }
    return -1;
}

/* The number of a text in UTF-8, where it is in a view or elsewhere; -1 for one that is none of them. */
CDBI_HOT int32_t cdbi_text_number(const cdbi_names *names, const char *text, size_t length, int is_inline, size_t n_words)
{
    int32_t at;
    if (length / 8 >= n_words) return -1;
    if (is_inline) cdbi_pack_inline(text, length, names->words + names->n * n_words, n_words);
    else cdbi_pack(text, length, names->words + names->n * n_words, n_words);
    at = cdbi_name_number(names, n_words);
    if (at < 0 || names->lengths[at] != length) return -1; /* one that ends with a NUL is none of them */
    return names->numbers ? (int32_t)names->numbers[at] : at;
}

/* A text of characters of 4 bytes, NULs behind it, as words: 0 where it has more octets than they hold. */
CDBI_HOT int cdbi_pack_wide(const uint32_t *text, size_t width, uint64_t *words, size_t n_words)
{
    size_t n = 0, i, j;
    for (i = 0; i < n_words; i++) words[i] = 0;
    while (width > 0 && text[width - 1] == 0) width--;
    for (i = 0; i < width; i++) {
        uint32_t c = text[i], size = c < 0x80 ? 1 : c < 0x800 ? 2 : c < 0x10000 ? 3 : 4;
        if ((n + size) / 8 >= n_words) return 0;
        for (j = 0; j < size; j++, n++) {
            uint32_t part = 6 * (size - 1 - (uint32_t)j);
            uint32_t octet = j ? 0x80 | (c >> part & 63) : size == 1 ? c : (0xF00 >> size & 0xFF) | (c >> part & 31);
            words[n / 8] |= (uint64_t)octet << (8 * (n % 8));
        }
    }
    return 1;
}

/* The same for 8 characters at a time, as long as all are ASCII; otherwise 0, and the words are anything. */
CDBI_HOT int cdbi_pack_ascii(const uint32_t *text, size_t width, uint64_t *words, size_t n_words)
{
    size_t i, j, n = width / 8 < n_words ? width / 8 : n_words;
    uint32_t all = 0;
    uint64_t word = 0;
    for (i = 0; i < n; i++) {
        const uint32_t *c = text + 8 * i;
        uint64_t low = c[0] | c[1] << 8 | c[2] << 16 | c[3] << 24, high = c[4] | c[5] << 8 | c[6] << 16 | c[7] << 24;
        all |= c[0] | c[1] | c[2] | c[3] | c[4] | c[5] | c[6] | c[7];
        words[i] = low | high << 32;
    }
    for (; i < n_words; i++) words[i] = 0;
    for (j = 8 * n; j < width && j < 8 * n_words; j++) {
        all |= text[j];
        word |= (uint64_t)text[j] << (8 * (j % 8));
    }
    if (n < n_words) words[n] = word;
    for (; j < width; j++) all |= text[j] ? 0x80 : 0;
    return all < 0x80;
}

CDBI_HOT int32_t cdbi_wide_text_number(const cdbi_names *names, const uint32_t *text, size_t width, size_t n_words)
{
    uint64_t *words = names->words + names->n * n_words;
    int32_t at;
    if (!cdbi_pack_ascii(text, width, words, n_words) && !cdbi_pack_wide(text, width, words, n_words)) return -1;
    at = cdbi_name_number(names, n_words);
    return at >= 0 && names->numbers ? (int32_t)names->numbers[at] : at;
}

/* Where a text of a column in UTF-8 is, and its length. */
CDBI_HOT const char *cdbi_text_at(const cdbi_facts *facts, size_t start, size_t *length)
{
    size_t at = facts->first + start;
    const int32_t *view;
    if (facts->type == 'u') {
        const int32_t *ends = (const int32_t *)facts->items + at;
        *length = (size_t)(ends[1] - ends[0]);
        return facts->octets + ends[0];
    }
    if (facts->type == 'U') {
        const int64_t *ends = (const int64_t *)facts->items + at;
        *length = (size_t)(ends[1] - ends[0]);
        return facts->octets + ends[0];
    }
    view = (const int32_t *)facts->items + 4 * at;
    *length = (size_t)view[0];
    return view[0] <= 12 ? (const char *)(view + 1) : facts->buffers[view[2]] + view[3];
}

#define CDBI_NO_FACT (-2)

/* The numbers of texts among `names` of `n_words` words each, CDBI_NO_FACT for one that is none of them. */
CDBI_HOT void cdbi_text_numbers(const cdbi_facts *facts, const cdbi_names *names, size_t start, size_t n, int32_t *to, size_t n_words)
{
    size_t k, length, at = facts->first + start;
    for (k = 0; k < n; k++) {
        if (facts->type == 'w')
            to[k] = cdbi_wide_text_number(names, (const uint32_t *)facts->items + (at + k) * facts->width, facts->width, n_words);
        else {
            const char *text = "";
            length = 0;
            if (cdbi_is_there(facts, start + k)) text = cdbi_text_at(facts, start + k, &length);
            to[k] = cdbi_text_number(names, text, length, facts->type == 'v' && length > 0 && length <= 12, n_words);
        }
        if (to[k] < 0) to[k] = CDBI_NO_FACT;
    }
}

/* The number of each value: a truth, or the number of a text; -1 for a missing one, CDBI_NO_FACT for a text that is none of `names`.
 * 0 where the facts are no values. */
static inline int cdbi_value_numbers(const cdbi_facts *facts, const cdbi_names *names, size_t start, size_t n, int32_t *to)
{
    size_t k, at = facts->first + start;
    if (facts->type == '?')
        for (k = 0; k < n; k++) to[k] = ((const unsigned char *)facts->items)[at + k] != 0;
    else if (facts->type == 'b' && at % 8 == 0)
        for (k = 0; k < n; k += 8) {
            unsigned octet = ((const unsigned char *)facts->items)[(at + k) / 8], bit, last = n - k < 8 ? (unsigned)(n - k) : 8;
            for (bit = 0; bit < last; bit++) to[k + bit] = (int32_t)(octet >> bit & 1);
        }
    else if (facts->type == 'b')
        for (k = 0; k < n; k++) to[k] = ((const unsigned char *)facts->items)[(at + k) / 8] >> ((at + k) % 8) & 1;
    else if (strchr("wuUv", facts->type) == NULL) return 0;
    else if (names->n_words == 2) cdbi_text_numbers(facts, names, start, n, to, 2); /* so the compiler knows it */
    else cdbi_text_numbers(facts, names, start, n, to, names->n_words);
    for (k = 0; facts->valid && k < n; k++)
        if (!cdbi_is_there(facts, start + k)) to[k] = -1;
    return 1;
}
