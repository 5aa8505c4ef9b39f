/* What is used of Godot 3's interface for libraries (GDNative).
 *
 * Godot hands a library its functions in one table. The few that are used here are declared by their places in it, which are those of
 * all versions 3.x, so Godot's headers are not needed. */

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct variant { uint64_t words[3]; } variant;          /* Godot's values, as large as they are */
typedef struct handle { void *data; } handle;                   /* a String, a CharString, an Array, a Dictionary */
typedef void (*function)(void);

typedef struct api { unsigned type, major, minor; const void *next; unsigned n_extensions; const struct api *const *extensions; function functions[722]; } api;
typedef struct scripts { unsigned type, major, minor; const void *next; function register_class, register_tool_class, register_method; } scripts;
typedef struct options { unsigned char in_editor; uint64_t hashes[3]; function reports[2]; void *library; const api *core; const void *path; } options;
typedef struct creating { void *(*create)(void *, void *); void *data; void (*release)(void *); } creating;
typedef struct destroying { void (*destroy)(void *, void *, void *); void *data; void (*release)(void *); } destroying;
typedef struct method { variant (*call)(void *, void *, void *, int, variant **); void *data; void (*release)(void *); } method;
typedef struct attributes { int remote; } attributes;

static const api *godot;
static const scripts *native;

enum { NIL, BOOL, INT, REAL, STRING, ARRAY = 19 };
#define VARIANT_NEW(place, type) ((void (*)(variant *, type))godot->functions[place])
#define VARIANT_AS(place, type) ((type (*)(const variant *))godot->functions[place])
#define variant_type VARIANT_AS(507, int)
#define as_int VARIANT_AS(539, int64_t)
#define as_real VARIANT_AS(540, double)
#define as_string VARIANT_AS(541, handle)
#define as_dictionary VARIANT_AS(555, handle)
#define as_array VARIANT_AS(556, handle)
#define ON_HANDLE(place) ((void (*)(handle *))godot->functions[place])
#define variant_destroy ((void (*)(variant *))godot->functions[570])
#define array_new ON_HANDLE(323)
#define array_get ((variant (*)(const handle *, int))godot->functions[333])
#define array_append ((void (*)(handle *, const variant *))godot->functions[336])
#define array_size ((int (*)(const handle *))godot->functions[356])
#define array_destroy ON_HANDLE(361)
#define dictionary_destroy ON_HANDLE(364)
#define dictionary_keys ((handle (*)(const handle *))godot->functions[372])
#define dictionary_get ((variant (*)(const handle *, const variant *))godot->functions[374])
#define char_data ((const char *(*)(const handle *))godot->functions[572])
#define char_destroy ON_HANDLE(573)
#define string_new ON_HANDLE(574)
#define string_utf8 ((handle (*)(const handle *))godot->functions[678])
#define string_parse ((unsigned char (*)(handle *, const char *))godot->functions[679])
#define string_destroy ON_HANDLE(721)

static variant of_int(int64_t value)
{
    variant made;
    VARIANT_NEW(512, int64_t)(&made, value);
    return made;
}

static variant of_real(double value)
{
    variant made;
    VARIANT_NEW(513, double)(&made, value);
    return made;
}

static variant of_text(const char *text)
{
    variant made;
    handle string;
    string_new(&string);
    string_parse(&string, text);
    VARIANT_NEW(514, const handle *)(&made, &string);
    string_destroy(&string);
    return made;
}

/* The text of a value, for free(). */
static char *text_of(const variant *value)
{
    handle string = as_string(value), octets = string_utf8(&string);
    size_t length = strlen(char_data(&octets)) + 1;
    char *text = (char *)malloc(length);
    if (text) memcpy(text, char_data(&octets), length);
    char_destroy(&octets);
    string_destroy(&string);
    return text;
}

/* An array as a value; it is given away. */
static variant of_array(handle *array)
{
    variant made;
    VARIANT_NEW(529, const handle *)(&made, array);
    array_destroy(array);
    return made;
}

static void append(handle *array, variant value)
{
    array_append(array, &value);
    variant_destroy(&value);
}

static variant of_reals(const double *numbers, size_t n)
{
    handle array;
    size_t i;
    array_new(&array);
    for (i = 0; i < n; i++) append(&array, of_real(numbers[i]));
    return of_array(&array);
}

typedef struct class_method { const char *name; variant (*call)(void *, void *, void *, int, variant **); } class_method;

/* Tell Godot of a class that is a Reference. */
static void register_class(void *library, const char *name, void *(*create)(void *, void *), void (*destroy)(void *, void *, void *),
    const class_method *methods, size_t n_methods)
{
    creating made = {create, NULL, NULL};
    destroying gone = {destroy, NULL, NULL};
    attributes none = {0};
    size_t i;
    ((void (*)(void *, const char *, const char *, creating, destroying))native->register_class)(library, name, "Reference", made, gone);
    for (i = 0; i < n_methods; i++) {
        method one = {methods[i].call, NULL, NULL};
        ((void (*)(void *, const char *, const char *, attributes, method))native->register_method)(library, name, methods[i].name, none, one);
    }
}
