/* CRC-32 four bits at a time: a table of 16 words suits a small board, and a
 * frame costs a few microseconds on a PC. */
#include "jumplink/wire.h"

#define ALL_BITS ((jl_u32)0xFFFFFFFFUL)

/* The remainder of each value of four bits. */
static const jl_u32 table[16] = {
    0x00000000UL, 0x1DB71064UL, 0x3B6E20C8UL, 0x26D930ACUL,
    0x76DC4190UL, 0x6B6B51F4UL, 0x4DB26158UL, 0x5005713CUL,
    0xEDB88320UL, 0xF00F9344UL, 0xD6D6A3E8UL, 0xCB61B38CUL,
    0x9B64C2B0UL, 0x86D3D2D4UL, 0xA00AE278UL, 0xBDBDF21CUL
};

jl_u32 jl_crc32(jl_u32 crc, const unsigned char *p, int len)
{
    int i;

    crc = ~crc & ALL_BITS;
    for (i = 0; i < len; i++) {
        crc ^= p[i];
        crc = crc >> 4 ^ table[crc & 15];
        crc = crc >> 4 ^ table[crc & 15];
    }
    return ~crc & ALL_BITS;
}
