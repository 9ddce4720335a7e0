/* What links must do over a bad carrier, for any port that is one. */
#ifndef LINKED_SUITE_H
#define LINKED_SUITE_H

#include "linked.h"

/* The port, as its header has it; `carrier` is what make returns. */
typedef struct linked_port {
    const char *name;
    jl_u32 rto_us;
    void *(*make)(int n, int max_len, int slots);
    void (*free)(void *carrier);
    jl_chan *(*tx)(void *carrier, int from, int to);
    jl_chan *(*rx)(void *carrier, int from, int to);
    int (*run)(void *carrier, void (*body)(int pe, void *context),
               void *context);
    jl_u32 (*now)(void *carrier);
} linked_port;

/* A million messages, over all fault sets: each comes once, in order, as it
 * was.  Prints a table. */
void linked_suite_million(const linked_port *over);

/* The channel contract, under each fault set. */
void linked_suite_conforms(const linked_port *over);

/* The parallel filter, an IMM and a constant-gain IMM, gives the serial bits,
 * under each fault set. */
void linked_suite_gives_serial_bits(const linked_port *over);

#endif
