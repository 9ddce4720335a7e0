/* Reals as octets: the IEEE 754 bits, the least significant octet first.
 * Copied, never computed with, so NaN keeps its bits and -0 its sign. */
#include <string.h>

#include "jumplink/wire.h"

JL_STATIC_ASSERT(CHAR_BIT == 8, octet_is_a_char);
JL_STATIC_ASSERT(sizeof(jl_real) == JL_REAL_OCTETS, real_is_ieee);

/* Compilers know the answer, and leave one memcpy of what is below. */
static int big_endian(void)
{
    const unsigned one = 1;
    unsigned char first;

    memcpy(&first, &one, 1);
    return first == 0;
}

static void turn(unsigned char *p)
{
    int i;

    for (i = 0; i < JL_REAL_OCTETS / 2; i++) {
        unsigned char octet = p[i];
        p[i] = p[JL_REAL_OCTETS - 1 - i];
        p[JL_REAL_OCTETS - 1 - i] = octet;
    }
}

/* Through pointers, since passing a signalling NaN by value may quiet it. */
static void put(unsigned char *p, const jl_real *v)
{
    memcpy(p, v, JL_REAL_OCTETS);
    if (big_endian())
        turn(p);
}

static void get(const unsigned char *p, jl_real *v)
{
    unsigned char octets[JL_REAL_OCTETS];

    memcpy(octets, p, JL_REAL_OCTETS);
    if (big_endian())
        turn(octets);
    memcpy(v, octets, JL_REAL_OCTETS);
}

void jl_put_real(unsigned char *p, jl_real v)
{
    put(p, &v);
}

jl_real jl_get_real(const unsigned char *p)
{
    jl_real v;

    get(p, &v);
    return v;
}

unsigned char *jl_put_reals(unsigned char *p, const jl_real *v, int n)
{
    int i;

    for (i = 0; i < n; i++, p += JL_REAL_OCTETS)
        put(p, v + i);
    return p;
}

const unsigned char *jl_get_reals(const unsigned char *p, jl_real *v, int n)
{
    int i;

    for (i = 0; i < n; i++, p += JL_REAL_OCTETS)
        get(p, v + i);
    return p;
}
