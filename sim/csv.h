/* CSV files with a header, row by row: fields between commas, spaces around
 * them dropped, "quotes" (within a line) undone; CRLF and a byte order mark are
 * no trouble. */
#ifndef SIM_CSV_H
#define SIM_CSV_H

#include <stdio.h>

struct csv {
    const char *path;
    FILE *stream;
    long line;                  /* of the fields, counted from 1            */
    int columns;
    char **name;                /* [columns] of the header                  */
    char **field;               /* [columns] of the row; until the next one */
    char *header, *text;        /* what name and field point into           */
    size_t size;
};

/* Open and read the header.  Returns 0; or -1 with one line on standard error,
 * and nothing to close.  path must outlive *csv. */
int csv_open(struct csv *csv, const char *path);

/* Read a row into field.  Returns 1; 0 at the end; or -1 with one line on
 * standard error. */
int csv_row(struct csv *csv);

/* The column of that name, or -1. */
int csv_find(const struct csv *csv, const char *name);

void csv_close(struct csv *csv);

#endif
