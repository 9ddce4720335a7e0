/* What the tests check numbers with.  (cmocka 1.1.5's float asserts cut doubles
 * to float and accept NaN.) */
#ifndef TESTS_CLOSE_H
#define TESTS_CLOSE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Both finite, and no further apart than tolerance. */
#define assert_close(a, b, tolerance) \
    assert_close_at((double)(a), (double)(b), (double)(tolerance), \
                    #a, __FILE__, __LINE__)

static inline void assert_close_at(double a, double b, double tolerance,
                                   const char *what, const char *file,
                                   int line)
{
    if (isfinite(a) && isfinite(b) && fabs(a - b) <= tolerance)
        return;
    print_error("%s = %.17g, expected %.17g within %.3g\n", what, a, b,
                tolerance);
    _fail(file, line);
}

/* The same bits: n objects of size octets. */
#define assert_same_bits(a, b, octets) \
    assert_memory_equal((a), (b), (octets))

#endif
