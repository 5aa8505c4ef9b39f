
/* ---- JSON: a place in a text, moved over what is read. After the first fault nothing more is read. */

#define CDBI_DEPTH 32
#define CDBI_KEY 24

typedef struct cdbi_json {
    const char *at, *end;
    const char *why;                /* NULL while all is well */
} cdbi_json;

static inline void cdbi_fail(cdbi_json *json, const char *why)
{
    if (!json->why) json->why = why;
    json->at = json->end;
}

/* The next character that is no space, or 0 at the end. */
static inline int cdbi_peek(cdbi_json *json)
{
    while (json->at < json->end && (*json->at == ' ' || *json->at == '\t' || *json->at == '\n' || *json->at == '\r')) json->at++;
    return json->at < json->end ? (unsigned char)*json->at : 0;
}

static inline int cdbi_take(cdbi_json *json, char character)
{
    if (cdbi_peek(json) == (unsigned char)character) {
        json->at++;
        return 1;
    }
    cdbi_fail(json, "a part of the header is not as it should be");
    return 0;
}

static inline uint32_t cdbi_hex(cdbi_json *json)
{
    uint32_t value = 0;
    int i;
    if (json->end - json->at < 4) {
        cdbi_fail(json, "a text of the header does not end");
        return 0;
    }
    for (i = 0; i < 4; i++) {
        char c = *json->at++;
        if (c >= '0' && c <= '9') value = value * 16 + (uint32_t)(c - '0');
        else if (c >= 'a' && c <= 'f') value = value * 16 + (uint32_t)(c - 'a') + 10;
        else if (c >= 'A' && c <= 'F') value = value * 16 + (uint32_t)(c - 'A') + 10;
        else cdbi_fail(json, "a text of the header holds an escape that is none");
        if (json->why) return 0;
    }
    return value;
}

static inline int cdbi_utf8(uint32_t code, char out[4])
{
    if (code < 0x80) {
        out[0] = (char)code;
        return 1;
    }
    if (code < 0x800) {
        out[0] = (char)(0xC0 | (code >> 6));
        out[1] = (char)(0x80 | (code & 63));
        return 2;
    }
    if (code < 0x10000) {
        out[0] = (char)(0xE0 | (code >> 12));
        out[1] = (char)(0x80 | ((code >> 6) & 63));
        out[2] = (char)(0x80 | (code & 63));
        return 3;
    }
    out[0] = (char)(0xF0 | (code >> 18));
    out[1] = (char)(0x80 | ((code >> 12) & 63));
    out[2] = (char)(0x80 | ((code >> 6) & 63));
    out[3] = (char)(0x80 | (code & 63));
    return 4;
}

/* The escape \uXXXX behind "\u"; two that are one character beyond 16 bits are read together. */
static inline uint32_t cdbi_unicode(cdbi_json *json)
{
    uint32_t code = cdbi_hex(json);
    if (code >= 0xD800 && code < 0xDC00 && json->end - json->at >= 6 && json->at[0] == '\\' && json->at[1] == 'u') {
        const char *before = json->at;
        uint32_t low;
        json->at += 2;
        low = cdbi_hex(json);
        if (low >= 0xDC00 && low < 0xE000) return 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        if (!json->why) json->at = before;
    }
    return code;
}

/* The bytes of the next character inside a text, 1 to 4; 0 at its closing quote, which is passed, or at a fault. */
static inline int cdbi_character(cdbi_json *json, char out[4])
{
    static const char escapes[] = "\"\\/bfnrt", meant[] = "\"\\/\b\f\n\r\t";
    const char *found;
    uint32_t code;
    if (json->at >= json->end) {
        cdbi_fail(json, "a text of the header does not end");
        return 0;
    }
    out[0] = *json->at++;
    if (out[0] == '"') return 0;
    if (out[0] == 0) {
        cdbi_fail(json, "a name holds a NUL character, which no text of C can");
        return 0;
    }
    if (out[0] != '\\') return 1;
    if (json->at >= json->end) {
        cdbi_fail(json, "a text of the header does not end");
        return 0;
    }
    if (*json->at == 'u') {
        json->at++;
        code = cdbi_unicode(json);
        if (code == 0) cdbi_fail(json, "a name holds a NUL character, which no text of C can");
        return json->why ? 0 : cdbi_utf8(code, out);
    }
    found = *json->at ? strchr(escapes, *json->at) : NULL;
    if (!found) {
        cdbi_fail(json, "a text of the header holds an escape that is none");
        return 0;
    }
    json->at++;
    out[0] = meant[found - escapes];
    return 1;
}

/* Read a text into `to`, which has room for `size` bytes, 0 at its end included; what is more is left away. Gives its length. */
static inline size_t cdbi_text(cdbi_json *json, char *to, size_t size)
{
    size_t length = 0;
    char bytes[4];
    int n;
    if (cdbi_take(json, '"'))
        while ((n = cdbi_character(json, bytes)) > 0) {
            if (to && length + (size_t)n < size) memcpy(to + length, bytes, (size_t)n);
            else if (to && length < size) size = length + 1;
            length += (size_t)n;
        }
    if (to && size) to[length < size ? length : size - 1] = 0;
    return length;
}

/* Whether the next text is this one. */
static inline int cdbi_is(cdbi_json *json, const char *text)
{
    char bytes[4];
    int n, i, same = 1;
    if (!cdbi_take(json, '"')) return 0;
    while ((n = cdbi_character(json, bytes)) > 0)
        for (i = 0; i < n; i++) {
            if (*text != bytes[i]) same = 0;
            if (*text) text++;
        }
    return same && *text == 0 && !json->why;
}

static inline uint64_t cdbi_whole(cdbi_json *json)
{
    uint64_t value = 0;
    int c = cdbi_peek(json), n = 0;
    for (; c >= '0' && c <= '9' && n < 18; n++) {
        value = value * 10 + (uint64_t)(c - '0');
        json->at++;
        c = json->at < json->end ? (unsigned char)*json->at : 0;
    }
    if (n == 0 || (c >= '0' && c <= '9') || c == '.' || c == 'e' || c == 'E') cdbi_fail(json, "a count of the header is none");
    return json->why ? 0 : value;
}

/* Go to the next element of a list or object: before the first one *n is 0. Gives 0 behind the closing mark, or at a fault. */
static inline int cdbi_next(cdbi_json *json, char closing, size_t *n)
{
    if (cdbi_peek(json) == (unsigned char)closing) {
        json->at++;
        return 0;
    }
    if (*n > 0 && !cdbi_take(json, ',')) return 0;
    if (cdbi_peek(json) == 0) cdbi_fail(json, "the header is not whole");
    *n += 1;
    return json->why == NULL;
}

/* The next key of an object, and the colon behind it; one that is too long to be ours is "". */
static inline void cdbi_key(cdbi_json *json, char key[CDBI_KEY])
{
    if (cdbi_text(json, key, CDBI_KEY) >= CDBI_KEY) key[0] = 0;
    cdbi_take(json, ':');
}

static inline void cdbi_skip(cdbi_json *json, int depth)
{
    size_t n = 0;
    int c = cdbi_peek(json);
    char key[CDBI_KEY];
    if (depth > CDBI_DEPTH) cdbi_fail(json, "the header is nested too deep");
    else if (c == '"') cdbi_text(json, NULL, 0);
    else if (c == '{' || c == '[') {
        json->at++;
        while (cdbi_next(json, c == '{' ? '}' : ']', &n)) {
            if (c == '{') cdbi_key(json, key);
            cdbi_skip(json, depth + 1);
        }
    } else {
        const char *start = json->at;
        while (json->at < json->end && strchr("+-.0123456789Eaeflnrstu", *json->at) && *json->at) json->at++;
        if (json->at == start) cdbi_fail(json, "a part of the header is not as it should be");
    }
}

/* The value of a key of the object that begins here; `json` itself stays where it is. Without the key, one that has failed. */
static inline cdbi_json cdbi_member(const cdbi_json *json, const char *wanted)
{
    cdbi_json found = *json;
    size_t n = 0;
    char key[CDBI_KEY];
    if (cdbi_take(&found, '{'))
        while (cdbi_next(&found, '}', &n)) {
            cdbi_key(&found, key);
            if (!found.why && strcmp(key, wanted) == 0) return found;
            cdbi_skip(&found, 0);
        }
    cdbi_fail(&found, "the header lacks a part");
    return found;
}

/* How many elements the list has that begins here; `json` itself stays where it is. */
static inline size_t cdbi_count(const cdbi_json *json)
{
    cdbi_json list = *json;
    size_t n = 0;
    if (cdbi_take(&list, '['))
        while (cdbi_next(&list, ']', &n)) cdbi_skip(&list, 0);
    return list.why ? 0 : n;
}
