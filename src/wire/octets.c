/* Unsigned integers as octets, the least significant first. */
#include "jumplink/wire.h"

void jl_put_u16(unsigned char *p, unsigned v)
{
    p[0] = (unsigned char)(v & 255);
    p[1] = (unsigned char)(v >> 8 & 255);
}

void jl_put_u32(unsigned char *p, jl_u32 v)
{
    jl_put_u16(p, (unsigned)(v & 65535));
    jl_put_u16(p + 2, (unsigned)(v >> 16 & 65535));
}

unsigned jl_get_u16(const unsigned char *p)
{
    return p[0] + 256u * p[1];
}

jl_u32 jl_get_u32(const unsigned char *p)
{
    return jl_get_u16(p) | (jl_u32)jl_get_u16(p + 2) << 16;
}
