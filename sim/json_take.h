/* Values out of a JSON file, each checked for its type, shape and range; what
 * is wrong is named by its key: "modes[1].R[0][1]". */
#ifndef SIM_JSON_TAKE_H
#define SIM_JSON_TAKE_H

#include <jansson.h>

#include "jumplink/base.h"

/* An object of the file, and where it is. */
struct json_at {
    const char *file;
    json_t *object;
    char key[64];               /* "" or "modes[1]"                         */
};

/* All functions return 0; or -1 with one line on standard error. */

/* Parse a file whose top is an object; *crc = CRC-32 of its octets.  The caller
 * gives *root back with json_decref. */
int json_read(json_t **root, jl_u32 *crc, const char *file);

/* Say what is wrong with a key of an object (or with the object: key NULL). */
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
int json_wrong(const struct json_at *at, const char *key,
               const char *format, ...);

int json_has(const struct json_at *at, const char *key);

/* Every key of the object is among `keys`, which end with NULL, or is `name` or
 * `note`, with a text. */
int json_only(const struct json_at *at, const char *const *keys);

/* A text; *value is the file's and lives as long as its root. */
int json_take_text(const char **value, const struct json_at *at,
                   const char *key);

/* A whole number from low to high. */
int json_take_count(int *value, const struct json_at *at, const char *key,
                    int low, int high);

/* A number that jl_real can hold. */
int json_take_real(jl_real *value, const struct json_at *at, const char *key);

/* An array of n numbers no larger than limit. */
int json_take_vector(jl_real *v, const struct json_at *at, const char *key,
                     int n, jl_real limit);

/* An array of n rows of m numbers no larger than limit. */
int json_take_matrix(jl_real *A, const struct json_at *at, const char *key,
                     int n, int m, jl_real limit);

/* An array of low to high objects: how many. */
int json_take_list(int *count, const struct json_at *at, const char *key,
                   int low, int high);

/* The object of a key at the top of the file. */
int json_member(struct json_at *member, const struct json_at *top,
                const char *key);

/* Entry i of such an array at the top of the file. */
int json_entry(struct json_at *entry, const struct json_at *top,
               const char *key, int i);

#endif
