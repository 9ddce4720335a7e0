/* A filter over a record: on one processor, or spread over PEs. */
#ifndef SIM_RUN_H
#define SIM_RUN_H

#include "estimates.h"
#include "feed.h"
#include "jumplink/chan.h"
#include "options.h"

/* What went over the channels of a run, all PEs and the host together. */
struct traffic {
    unsigned long messages;
    unsigned long octets;
    unsigned long resent;       /* datagrams sent again                     */
    unsigned long refused;      /* datagrams of strangers, dropped          */
};

/* Each runs the filter over all rows of the record into *e.  On failure prints
 * one line (which row, what) and returns the program's exit status, 1; what
 * was estimated before is in *e.  Otherwise returns 0. */
int run_serial(struct estimates *e, const struct model *model,
               const struct data_file *data, const struct options *options);
int run_inside(struct estimates *e, struct traffic *traffic,
               const struct model *model, const struct data_file *data,
               const struct options *options);
int run_lcm(struct estimates *e, struct traffic *traffic,
            const struct model *model, const struct data_file *data,
            const struct options *options);

int run_by_hand(struct estimates *e, struct traffic *traffic,
                const struct model *model, const struct data_file *data,
                const struct options *options);

/* One of these, as the options say. */
int run(struct estimates *e, struct traffic *traffic,
        const struct model *model, const struct data_file *data,
        const struct options *options);

/* --- the two sides of a parallel run, for any port ----------------------- */

/* What PEs and host must agree about, in one number. */
jl_u32 run_fingerprint(const struct model *model,
                       const struct options *options);

/* Octets of the longest message of the model, and of channels that hold it. */
int run_max_len(const struct model *model);

/* How long a PE waits for a message: longer than until another counts as silent
 * (lcm_net.c; unless the timeout is below that one's least), for silence tells
 * more surely who is dead. */
long run_message_us(const struct options *options);

/* Messages that channels between PEs must hold, for none to wait. */
int run_slots(const struct options *options);

/* PE pe's part, until the host says stop; to and from have options->pes + 1
 * entries, of which the last is the host's.  Returns JL_OK, or a code of base.h
 * after a line that says why. */
int run_pe(int pe, const struct model *model, const struct options *options,
           jl_chan **to, jl_chan **from);

/* The host's part.  `alive`, or NULL, is asked now and then: 0 ends the run. */
struct run_host {
    jl_chan *to, *from;
    int (*alive)(void *context);
    void *context;
    int failed_pe;              /* the PE that PE0 gave up; -1: none        */
};

/* Besides the codes of base.h: a signal ended the run (interrupt.h). */
#define RUN_INTERRUPTED 2

/* Returns JL_OK; or, with a step that failed in *row, its code; or the error of
 * a channel or RUN_INTERRUPTED, with the row it happened at, or -1: at the
 * start. */
int run_host(struct estimates *e, long *row, struct run_host *host,
             const struct model *model, const struct data_file *data,
             const struct options *options);

/* Say in one line why run_host or a serial step failed; of a PE with whom the
 * run cannot go on, its name.  Returns 1. */
int run_failed(const struct data_file *data, long row, int status,
               int failed_pe);

/* 1 if the status comes from a channel and not from the filter. */
int run_is_channels(int status);

/* Check that the model's kind and the options go together, and leave it only the
 * mode that the kf of options works on.
 * Returns 0, or 2 after a message. */
int run_pick_mode(struct model *model, const struct options *options);

#endif
