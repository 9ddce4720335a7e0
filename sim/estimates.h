/* What a run gives, row by row, and the file it goes to. */
#ifndef SIM_ESTIMATES_H
#define SIM_ESTIMATES_H

#include <stdio.h>

#include "data_file.h"
#include "jumplink/par.h"
#include "mekf_filter.h"
#include "model_file.h"

struct diagnostics;

struct estimates {
    long rows, room;            /* of rows there is memory for `room`       */
    long done;                  /* behind the last with an estimate         */
    long judged, rejected;      /* measurements, and those the gate rejected */
    int n, M;
    const struct mekf_setup *mekf;      /* of kind mekf: its n columns, and
                                           no mu, no loglik; or NULL        */
    jl_real *x;                 /* [rows,n]; NaN in rows without estimate   */
    int has_P;                  /* 0 of kinds cgimm and mekf                */
    jl_real *P;                 /* [rows,n,n] or NULL                       */
    jl_real *mu;                /* [rows,M]; NULL of kind mekf, whose M is 0 */
    jl_real *loglik;            /* [rows]                                   */
    struct diagnostics *diagnostics;    /* more columns; or NULL            */
    double *us;                 /* [rows] wall clock of the step; NaN in a
                                   row without one (the start is none)      */
};

/* Returns 0, or -1 after a message if there is no memory. */
int estimates_open(struct estimates *e, const struct data_file *data,
                   const struct model *model);
/* Have at least this many rows, the new ones NaN, for a record that grows.
 * Returns 0, or -1 if there is no memory. */
int estimates_grow(struct estimates *e, long rows);
void estimates_close(struct estimates *e);

/* Take down a row, the time it took, and, by its verdict, the measurement. */
void estimates_note(struct estimates *e, long row, const jl_estimate *estimate,
                    double us);

/* 1 if all numbers of both have the same bits (times apart). */
int estimates_same(const struct estimates *a, const struct estimates *b);

/* The largest difference of a state in its sigma, sqrt(P) of b; NaN where only
 * one of them has an estimate, and without P. */
double estimates_apart(const struct estimates *a, const struct estimates *b);

/* Median and 99th percentile of the time per step; number of steps. */
long estimates_times(const struct estimates *e, double *median_us,
                     double *p99_us);

/* As CSV: time (and run), x, P upper triangle, mu, loglik, and diagnostics, P
 * and these if they are there, or the columns of kind mekf; all rows, or, when `partial`, those that were
 * done and a last line that says so. */
void estimates_write(const struct estimates *e, const struct data_file *data,
                     int partial, FILE *out);

/* All of them to path (NULL: standard output); a PATH.partial of an earlier run
 * goes.  Returns 0, or -1 after a message. */
int estimates_save(const struct estimates *e, const struct data_file *data,
                   const char *path);

/* What a run that failed has done so far, to PATH.partial (or standard output,
 * if path is NULL), and a word on standard error; nothing if it has done
 * nothing.  What is at path stays as it is.  Returns 0, or -1 after a
 * message. */
int estimates_save_partial(const struct estimates *e,
                           const struct data_file *data, const char *path);

#endif
