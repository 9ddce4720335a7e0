/* Two nodes that send each other numbered messages through faults, and the
 * table of what that took. */
#ifndef PAIR_H
#define PAIR_H

#include "fault.h"
#include "jumplink/chan.h"
#include "jumplink/link.h"

#define PAIR_MAX_LEN (2 * JL_FRAME_PAYLOAD + 100)

/* The fault sets: each fault alone and all together, at 10% and at 30%. */
#define PAIR_SETS 14
extern const fault_set pair_sets[PAIR_SETS];

/* Messages in all.  Links know no numbers, so float adds nothing; and sanitizers
 * are slow. */
#if JL_REAL_FLOAT || defined(__SANITIZE_ADDRESS__) \
    || defined(__SANITIZE_THREAD__)
#define PAIR_ALL 100000L
#else
#define PAIR_ALL 1000000L
#endif

/* How many of them a set gets: more where they are fast. */
long pair_messages(int set);

/* What happened in a run of one set, both nodes together. */
struct pair_result {
    long messages;              /* received, as sent                        */
    double seconds;             /* of the port's clock                      */
    unsigned long sent, resent; /* datagrams that carry pieces              */
    unsigned long put;          /* datagrams of any kind                    */
    unsigned long befell[FAULT_KINDS];
};

/* Node 0's or 1's part: send n messages, receive n, each of a length and of
 * octets determined by its number.
 * Returns 0, or 1 after lines that say what came instead; also if what did not
 * come did so soon after: then it is not the link that failed, but the machine
 * or a process stood still. */
int pair_body(int node, long n, jl_chan *to, jl_chan *from);

/* Why nothing came, as far as a node knows: its link (by the names of link.h)
 * and its faults (fault.h), on stderr.  The time is the link's. */
void pair_explain(int node, const jl_link *link, const fault *f, jl_u32 now);

/* Add what one node counted. */
void pair_add(struct pair_result *result, const jl_link_count *count,
              const fault *f);

/* The faults of the set happened, and no other. */
int pair_faults_were_real(const fault_set *set,
                          const struct pair_result *result);

void pair_print_head(const char *port);
void pair_print(const fault_set *set, const struct pair_result *result);

#endif
