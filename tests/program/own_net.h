/* A network of the test's own, where that is allowed; and a record that takes
 * long enough for something to happen on it. */
#ifndef TESTS_OWN_NET_H
#define TESTS_OWN_NET_H

#include "scratch.h"

#include <errno.h>

#include "private_net.h"

#define OWN_NET_URL "udpm://239.255.76.67:7667?ttl=0"

static int own_net;

static inline void own_net_enter(void)
{
    own_net = private_net_enter() == 0;
    if (!own_net)
        print_message("no private network is allowed here: %s\n",
                      strerror(errno));
}

#define needs_own_net() do { \
    if (!own_net) \
        skip(); \
} while (0)

#define ENDLESS_ROWS 50000

static inline const char *endless_record(const char *name)
{
    const char *path = scratch_path(name);
    FILE *stream = fopen(path, "w");
    int k;

    scratch_must(stream != NULL, path);
    fputs("t_s,z0,z1\n", stream);
    for (k = 0; k < ENDLESS_ROWS; k++)
        fprintf(stream, "%d,%d,%d\n", k, 10 * k, k % 7);
    scratch_must(fclose(stream) == 0, path);
    return path;
}

#endif
