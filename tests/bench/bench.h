/* What the programs of `make bench` share. */
#ifndef BENCH_H
#define BENCH_H

#include <stdio.h>

#include "jumplink/chan.h"
#include "out_file.h"

/* End the program with a line unless ok: a figure of a run that went wrong is
 * worth nothing. */
void bench_must(int ok, const char *what);

/* --- samples (bench_samples.c) ------------------------------------------- */

struct samples {
    double *us;                 /* sorted as far as asked for               */
    int count, room;
};

void samples_add(struct samples *s, double us);
double samples_least(struct samples *s);
double samples_median(struct samples *s);

/* --- results (bench_samples.c) ------------------------------------------- */

/* The file NAME in the folder that the program was given as its argument, or
 * build/bench. */
void bench_open(struct out_file *out, int argc, char **argv, const char *name);
void bench_close(struct out_file *out);

/* --- nodes on a port (bench_nodes.c) ------------------------------------- */

enum bench_port { ON_LOOP, ON_THREADS, ON_LCM };

extern const char *const bench_port_names[];

#define BENCH_SLOTS 2           /* as the program jumplink has them */
#define BENCH_WAIT_US 20000000L /* a message that takes so long never comes */

/* A network of this program's own for LCM.  Call it first.
 * Returns 1, or 0 after a line that says that there is none. */
int bench_network(void);

typedef void (*bench_body)(int node, jl_chan **to, jl_chan **from,
                           void *context);

/* Run body on n nodes with a channel from each to every other for messages up
 * to max_len octets; over LCM each is a process, and `here` the node whose
 * body runs in this one, so that what it leaves in *context is there. */
void bench_run(enum bench_port port, int n, int here, int max_len,
               bench_body body, void *context);

#endif
