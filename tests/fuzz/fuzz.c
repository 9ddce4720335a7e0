#include "fuzz.h"

#include <ctype.h>
#include <stdlib.h>

#include "jumplink/wire.h"

void fuzz_fail(const char *file, int line, const char *what)
{
    fprintf(stderr, "%s:%d: does not hold: %s\n", file, line, what);
    abort();
}

unsigned fuzz_octet(fuzz_script *script)
{
    if (script->left == 0)
        return 0;
    script->left--;
    return *script->at++;
}

void fuzz_octets(fuzz_script *script, unsigned char *p, int n)
{
    int i;

    for (i = 0; i < n; i++)
        p[i] = (unsigned char)fuzz_octet(script);
}

unsigned fuzz_u16(fuzz_script *script)
{
    unsigned char octets[2];

    fuzz_octets(script, octets, 2);
    return jl_get_u16(octets);
}

jl_u32 fuzz_u32(fuzz_script *script)
{
    unsigned char octets[4];

    fuzz_octets(script, octets, 4);
    return jl_get_u32(octets);
}

int fuzz_read(FILE *stream, unsigned char *octets, int cap)
{
    int c, n = 0;
    unsigned octet;

    while ((c = fgetc(stream)) == '#')
        while (c != '\n' && c != EOF)
            c = fgetc(stream);
    if (c == EOF)
        return -1;
    for (; c != '\n'; c = fgetc(stream)) {
        if (!isxdigit(c) || n == cap || ungetc(c, stream) == EOF ||
            fscanf(stream, "%2x", &octet) != 1)
            return -2;
        octets[n++] = (unsigned char)octet;
    }
    return n;
}
