/* The wall clock. */
#ifndef SIM_CLOCK_H
#define SIM_CLOCK_H

#include <time.h>

/* Microseconds of a clock that does not go back. */
static inline double clock_us(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

#endif
