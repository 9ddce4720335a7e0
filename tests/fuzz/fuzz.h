/* Fuzz targets: each takes any octets and finds out whether the code keeps its
 * promises on them.  libFuzzer looks for such octets (make fuzz), test_fuzz.c
 * tries those in the corpus and many like them. */
#ifndef FUZZ_H
#define FUZZ_H

#include <stddef.h>
#include <stdio.h>

#include "jumplink/base.h"

/* Each returns 0, or does not return. */
int fuzz_wire(const unsigned char *data, size_t size);
int fuzz_link(const unsigned char *data, size_t size);
int fuzz_par(const unsigned char *data, size_t size);

/* A promise: if the condition is false, say so and abort. */
#define FUZZ_HOLDS(condition) \
    ((condition) ? (void)0 : fuzz_fail(__FILE__, __LINE__, #condition))

void fuzz_fail(const char *file, int line, const char *what);

/* The input as a script, read from front to back; behind its end are zeros, so
 * that every input is a whole script. */
typedef struct fuzz_script {
    const unsigned char *at;
    size_t left;
} fuzz_script;

unsigned fuzz_octet(fuzz_script *script);
unsigned fuzz_u16(fuzz_script *script);
jl_u32 fuzz_u32(fuzz_script *script);
void fuzz_octets(fuzz_script *script, unsigned char *p, int n);

/* A corpus is a text: an input a line, in hexadecimal; lines that begin with #
 * are comments.  Reads the next one into octets [cap]; returns its length, -1:
 * there is none, -2: what is there is no input. */
int fuzz_read(FILE *stream, unsigned char *octets, int cap);

#endif
