/* Measurement records: CSV files with a header (columns: --help of filter). */
#ifndef SIM_DATA_FILE_H
#define SIM_DATA_FILE_H

#include <stdio.h>

#include "jumplink/base.h"

/* Which columns to take; NULL or 0 for the defaults. */
struct data_columns {
    const char *z;              /* "east_m,north_m"; default z0.. or z1..   */
    const char *time;           /* "t_s"; default t_s if there, else k      */
    const char *extra;          /* more to keep, e.g. a truth; or NULL      */
};

struct data_file {
    char *path;
    long rows;
    int m;                      /* measurements a row                       */
    int n_extra;
    char *time_name;            /* "k", "t_s", or what was chosen           */
    char **time_text;           /* [rows] as written in the file            */
    double *time;               /* [rows]                                   */
    jl_real *z;                 /* [rows,m]; NaN: missing                   */
    double *extra;              /* [rows,n_extra]; NaN: empty               */
    int *arrived;               /* [rows] column `arrived`, or NULL         */
    long *run;                  /* [rows] column `run`, or NULL             */
    long *line;                 /* [rows] line in the file, for messages    */
};

/* Read a record.  On error prints one line to standard error (file, line,
 * field, what is wrong) and returns -1, with *data empty; else 0. */
int data_read(struct data_file *data, const char *path,
              const struct data_columns *columns);
void data_free(struct data_file *data);

#endif
