#include "json_take.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "complain.h"
#include "jumplink/wire.h"

/* --- the file ---------------------------------------------------------- */

/* All octets of a file: *text [*length], to be freed. */
static int read_octets(char **text, size_t *length, const char *file)
{
    FILE *stream = fopen(file, "r");
    size_t room = 0, used = 0, got;
    int error = 0;

    *text = NULL;
    if (stream == NULL)
        return complain(file, 0, NULL, "cannot open: %s", strerror(errno));
    do {
        char *larger = room - used < 4096
            ? realloc(*text, room = 2 * room + 65536) : *text;

        if (larger == NULL) {
            error = complain(file, 0, NULL, "out of memory");
            break;
        }
        *text = larger;
        got = fread(*text + used, 1, room - used, stream);
        used += got;
    } while (got > 0);
    if (error == 0 && ferror(stream))
        error = complain(file, 0, NULL, "cannot read: %s", strerror(errno));
    fclose(stream);
    *length = used;
    return error;
}

static jl_u32 fingerprint(const char *text, size_t length)
{
    jl_u32 crc = 0;
    size_t at;

    for (at = 0; at < length; at += 4096)       /* a piece fits any int */
        crc = jl_crc32(crc, (const unsigned char *)text + at,
                       (int)(length - at < 4096 ? length - at : 4096));
    return crc;
}

int json_read(json_t **root, jl_u32 *crc, const char *file)
{
    char *text;
    size_t length = 0;
    json_error_t where;
    int error = read_octets(&text, &length, file);

    *root = NULL;
    if (error == 0) {
        *crc = fingerprint(text, length);
        *root = json_loadb(text, length, JSON_REJECT_DUPLICATES
                           | JSON_DECODE_INT_AS_REAL, &where);
        if (*root == NULL) {
            char column[32];

            snprintf(column, sizeof column, "column %d", where.column);
            error = complain(file, where.line, column, "not JSON: %s",
                             where.text);
        } else if (!json_is_object(*root)) {
            error = complain(file, 0, NULL, "not a model: the top is not an "
                             "object { .. }");
            json_decref(*root);
            *root = NULL;
        }
    }
    free(text);
    return error;
}

/* --- keys -------------------------------------------------------------- */

int json_wrong(const struct json_at *at, const char *key,
               const char *format, ...)
{
    char name[200], what[1000];
    va_list arguments;

    snprintf(name, sizeof name, "%s%s%s", at->key,
             at->key[0] != '\0' && key != NULL ? "." : "",
             key != NULL ? key : "");
    va_start(arguments, format);
    vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    return complain(at->file, 0, name, "%s", what);
}

int json_has(const struct json_at *at, const char *key)
{
    return json_object_get(at->object, key) != NULL;
}

/* The value of a key, or NULL and a message. */
static const json_t *needed(const struct json_at *at, const char *key)
{
    const json_t *value = json_object_get(at->object, key);

    if (value == NULL)
        json_wrong(at, key, "missing");
    return value;
}

static const char *type_name(const json_t *value)
{
    switch (json_typeof(value)) {
    case JSON_OBJECT: return "an object";
    case JSON_ARRAY: return "an array";
    case JSON_STRING: return "a text";
    case JSON_INTEGER:
    case JSON_REAL: return "a number";
    case JSON_TRUE:
    case JSON_FALSE: return "true or false";
    case JSON_NULL: break;
    }
    return "null";
}

static int is_among(const char *key, const char *const *keys)
{
    for (; *keys != NULL; keys++)
        if (strcmp(*keys, key) == 0)
            return 1;
    return 0;
}

int json_only(const struct json_at *at, const char *const *keys)
{
    static const char *const texts[] = { "name", "note", NULL };
    const char *key;
    json_t *value;

    json_object_foreach(at->object, key, value) {
        if (is_among(key, texts)) {
            if (!json_is_string(value))
                return json_wrong(at, key, "must be a text, is %s",
                                  type_name(value));
        } else if (!is_among(key, keys)) {
            return json_wrong(at, key, "unknown key");
        }
    }
    return 0;
}

/* --- single values ----------------------------------------------------- */

int json_take_text(const char **value, const struct json_at *at,
                   const char *key)
{
    const json_t *found = needed(at, key);

    if (found == NULL)
        return -1;
    if (!json_is_string(found))
        return json_wrong(at, key, "must be a text, is %s", type_name(found));
    *value = json_string_value(found);
    return 0;
}

static int to_real(jl_real *value, const json_t *found,
                   const struct json_at *at, const char *key, jl_real limit)
{
    double v;

    if (!json_is_number(found))
        return json_wrong(at, key, "must be a number, is %s",
                          type_name(found));
    v = json_number_value(found);
    if (!(fabs(v) <= (double)limit))
        return json_wrong(at, key, "%g is too large", v);
    *value = (jl_real)v;
    return 0;
}

int json_take_real(jl_real *value, const struct json_at *at, const char *key)
{
    const json_t *found = needed(at, key);

    return found == NULL ? -1 : to_real(value, found, at, key, JL_REAL_MAX);
}

int json_take_count(int *value, const struct json_at *at, const char *key,
                    int low, int high)
{
    const json_t *found = needed(at, key);
    double v;

    if (found == NULL)
        return -1;
    if (!json_is_number(found))
        return json_wrong(at, key, "must be a whole number, is %s",
                          type_name(found));
    v = json_number_value(found);
    if (v < (double)low || v > (double)high || v < floor(v) || v > floor(v))
        return json_wrong(at, key,
                          "must be a whole number from %d to %d, is %.17g",
                          low, high, v);
    *value = (int)v;
    return 0;
}

/* --- arrays ------------------------------------------------------------ */

static int check_array(const json_t *found, const struct json_at *at,
                       const char *key, int n, const char *of)
{
    if (!json_is_array(found))
        return json_wrong(at, key, "must be an array of %d %s, is %s", n, of,
                          type_name(found));
    if (json_array_size(found) != (size_t)n)
        return json_wrong(at, key, "must have %d %s, has %zu", n, of,
                          json_array_size(found));
    return 0;
}

static int to_vector(jl_real *v, const json_t *found, const struct json_at *at,
                     const char *key, int n, jl_real limit)
{
    int i;

    if (check_array(found, at, key, n, "numbers") != 0)
        return -1;
    for (i = 0; i < n; i++) {
        char element[100];

        snprintf(element, sizeof element, "%s[%d]", key, i);
        if (to_real(&v[i], json_array_get(found, (size_t)i), at, element,
                    limit) != 0)
            return -1;
    }
    return 0;
}

int json_take_vector(jl_real *v, const struct json_at *at, const char *key,
                     int n, jl_real limit)
{
    const json_t *found = needed(at, key);

    return found == NULL ? -1 : to_vector(v, found, at, key, n, limit);
}

int json_take_matrix(jl_real *A, const struct json_at *at, const char *key,
                     int n, int m, jl_real limit)
{
    const json_t *found = needed(at, key);
    int i;

    if (found == NULL || check_array(found, at, key, n, "rows") != 0)
        return -1;
    for (i = 0; i < n; i++) {
        char row[80];

        snprintf(row, sizeof row, "%s[%d]", key, i);
        if (to_vector(A + i * m, json_array_get(found, (size_t)i), at, row, m,
                      limit) != 0)
            return -1;
    }
    return 0;
}

int json_take_list(int *count, const struct json_at *at, const char *key,
                   int low, int high)
{
    const json_t *found = needed(at, key);
    size_t size;

    if (found == NULL)
        return -1;
    if (!json_is_array(found))
        return json_wrong(at, key, "must be an array, is %s",
                          type_name(found));
    size = json_array_size(found);
    if (size < (size_t)low || size > (size_t)high)
        return json_wrong(at, key, "must have %d to %d entries, has %zu", low,
                          high, size);
    *count = (int)size;
    return 0;
}

static int check_object(const struct json_at *at)
{
    return json_is_object(at->object) ? 0
        : json_wrong(at, NULL, "must be an object, is %s",
                     type_name(at->object));
}

int json_member(struct json_at *member, const struct json_at *top,
                const char *key)
{
    if (needed(top, key) == NULL)
        return -1;
    member->file = top->file;
    member->object = json_object_get(top->object, key);
    snprintf(member->key, sizeof member->key, "%.40s", key);
    return check_object(member);
}

int json_entry(struct json_at *entry, const struct json_at *top,
               const char *key, int i)
{
    const json_t *array = json_object_get(top->object, key);

    entry->file = top->file;
    entry->object = json_array_get(array, (size_t)i);
    snprintf(entry->key, sizeof entry->key, "%.40s[%d]", key, i);
    return check_object(entry);
}
