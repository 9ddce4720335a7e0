/* The contract of chan.h, point by point, for any port.
 *
 * A test program describes its port by a fixture and runs every case of
 * conform_cases on it.  The bodies of a case may run in other threads or
 * processes, where cmocka's asserts cannot be used: they use EXPECT, and the
 * fixture's run sees to it that a failure anywhere fails the test.
 */
#ifndef CONFORM_H
#define CONFORM_H

#include "jumplink/chan.h"

/* Long enough never to pass in a case that succeeds; short enough to wait. */
#define LONG_US 8000000L
#define SHORT_US 3000L
#define SETTLE_US 200000L      /* others have surely got where they wait */

#define CONFORM_PES 5           /* at most */

typedef void (*conform_body)(int pe);

typedef struct conform_port {
    int max_len;
    int slots;
    int step;                   /* try every step-th length                 */
    int rounds;                 /* ... and so many rounds of traffic        */
    jl_chan *(*tx)(int from, int to);   /* for the PE that calls            */
    jl_chan *(*rx)(int from, int to);
    /* Run body(0) .. body(n-1), n <= CONFORM_PES, each on a PE of its own.
     * Returns 0 if all went well and nobody called conform_fail. */
    int (*run)(int n, conform_body body);
} conform_port;

typedef struct conform_case {
    const char *name;
    int n;
    conform_body body;
} conform_case;

/* The port under test, set before any case is run. */
extern const conform_port *port;

extern const conform_case conform_cases[];      /* up to name == NULL */

/* Note a failure; the number of those noted in this process. */
void conform_fail(const char *file, int line, const char *what, long value);
int conform_failures(void);

/* In a body: go on only if (a op b). */
#define EXPECT(a, op, b) \
    do { \
        long expect_value = (long)(a); \
        if (!(expect_value op (long)(b))) { \
            conform_fail(__FILE__, __LINE__, #a " " #op " " #b, \
                         expect_value); \
            return; \
        } \
    } while (0)

/* A message whose octets are all determined by its number, and its check. */
void conform_fill(unsigned char *msg, int len, unsigned number);
int conform_same(const unsigned char *msg, int len, unsigned number);

/* Random numbers, the same on every PE and every run. */
unsigned conform_random(unsigned *state);

#endif
