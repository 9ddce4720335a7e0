/* Output that is there whole or not at all: written to a temporary name beside
 * the target, and renamed when all went well. */
#ifndef SIM_OUT_FILE_H
#define SIM_OUT_FILE_H

#include <stdio.h>

struct out_file {
    FILE *stream;               /* write here                               */
    char *path;                 /* NULL: standard output                    */
    char *temporary;
};

/* Open for writing; path NULL or "-" is standard output.
 * Returns 0, or -1 with one line on standard error. */
int out_open(struct out_file *out, const char *path);

/* The same, in a folder. */
int out_open_in(struct out_file *out, const char *folder, const char *name);

/* Finish: keep != 0 flushes, checks for write errors and renames; keep == 0
 * removes the temporary file.  Returns 0, or -1 with one line on standard
 * error (then nothing is left at path that was not there before). */
int out_close(struct out_file *out, int keep);

/* Have a folder, and those that it is in.  Returns 0, or -1 after a message. */
int out_folder(const char *path);

#endif
