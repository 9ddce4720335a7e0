/* Frames: what is encoded is decoded to the same, what is decoded encodes to
 * the same octets, and what is damaged is refused. */
#include "fuzz.h"

#include <stdlib.h>
#include <string.h>

#include "jumplink/wire.h"

/* --- octets that may be a frame ------------------------------------------ */

/* Repair what `what` says of octets that are no frame, and the checksum, so
 * that the input gets past the first refusals (offsets: WIRE.md). */
static void repair(unsigned char *octets, int len, unsigned what)
{
    int end = len - JL_FRAME_TRAILER;

    if (end < JL_FRAME_HEADER)
        return;
    if (what & 1)
        memcpy(octets, "\x4a\x4c\x01", 3);
    if (what & 2)
        jl_put_u16(octets + 24, (unsigned)(end - JL_FRAME_HEADER) & 65535);
    if (what & 4)
        octets[7] = 0;
    if (what & 8)
        memset(octets + 26, 0, 6);
    if (what & 16)
        octets[4] = what & 128 ? 4 : 8;
    if (what & 32)
        octets[3] = (unsigned char)(1 + octets[3] % 7);
    if (what & 64)
        jl_put_u32(octets + end, jl_crc32(0, octets, end));
}

static void decode_encode(const unsigned char *octets, int len, int number)
{
    unsigned char again[JL_FRAME_MAX];
    jl_frame frame, before;
    int status;

    memset(&frame, 0x5a, sizeof frame);
    before = frame;
    status = jl_frame_decode(&frame, octets, len, number);
    if (status != JL_OK) {
        FUZZ_HOLDS(status == JL_ELENGTH || status == JL_EMSG ||
                   (status <= JL_EMAGIC && status >= JL_ECRC));
        FUZZ_HOLDS(memcmp(&frame, &before, sizeof frame) == 0);
        return;
    }
    FUZZ_HOLDS(frame.number == number);
    FUZZ_HOLDS(frame.payload == octets + JL_FRAME_HEADER);
    FUZZ_HOLDS(frame.len == len - JL_FRAME_HEADER - JL_FRAME_TRAILER);
    FUZZ_HOLDS(jl_frame_encode(again, sizeof again, &frame) == len);
    FUZZ_HOLDS(memcmp(again, octets, (size_t)len) == 0);
    FUZZ_HOLDS(jl_frame_decode(&frame, octets, len, 12 - number) ==
               JL_ENUMBER);
}

/* In memory of its own, so that a read beyond its end is seen. */
static void decode(fuzz_script script)
{
    unsigned what = fuzz_octet(&script);
    int len = (int)script.left;
    unsigned char *octets = malloc(script.left + 1);

    fuzz_octets(&script, octets, len);
    repair(octets, len, what);
    octets = realloc(octets, (size_t)len + (len == 0));
    decode_encode(octets, len, what & 128 ? 4 : 8);
    free(octets);
}

/* --- fields that may make a frame ---------------------------------------- */

static int same_fields(const jl_frame *a, const jl_frame *b)
{
    return a->kind == b->kind && a->number == b->number &&
           a->from == b->from && a->to == b->to && a->session == b->session &&
           a->peer == b->peer && a->seq == b->seq && a->ack == b->ack &&
           a->len == b->len &&
           (a->len == 0 ||
            memcmp(a->payload, b->payload, (size_t)a->len) == 0);
}

static int has_sense(const jl_frame *f)
{
    int carries = f->kind == JL_FRAME_DATA || f->kind == JL_FRAME_LAST;

    return f->kind >= JL_FRAME_HELLO && f->kind <= JL_FRAME_ALIVE &&
           (f->number == 8 || f->number == 4) &&
           f->from >= 0 && f->from <= 255 && f->to >= 0 && f->to <= 255 &&
           f->session != 0 && f->len >= 0 &&
           f->len <= (carries ? JL_FRAME_PAYLOAD : 0);
}

/* All bursts up to 32 bits are found, and every cut. */
static void damage(unsigned char *octets, int len, fuzz_script *script)
{
    int at = (int)(fuzz_u16(script) % (unsigned)(len - 3));
    jl_u32 burst = fuzz_u32(script);
    int cut = (int)(fuzz_u16(script) % (unsigned)len);
    jl_frame frame;

    FUZZ_HOLDS(jl_frame_decode(&frame, octets, cut, octets[4]) != JL_OK);
    jl_put_u32(octets + at, jl_get_u32(octets + at) ^ burst);
    FUZZ_HOLDS((jl_frame_decode(&frame, octets, len, 8) == JL_OK ||
                jl_frame_decode(&frame, octets, len, 4) == JL_OK) ==
               (burst == 0));
}

static void encode(fuzz_script script)
{
    static unsigned char payload[JL_FRAME_PAYLOAD];
    unsigned char *octets;
    jl_frame frame, again;
    int len, wild;

    memset(&frame, 0, sizeof frame);
    frame.kind = (int)fuzz_octet(&script) - 1;
    frame.number = (int)fuzz_octet(&script) % 10;
    frame.from = (int)fuzz_octet(&script);
    frame.to = (int)fuzz_octet(&script);
    wild = (int)fuzz_octet(&script);
    if (wild & 1)
        frame.from -= 200;
    if (wild & 2)
        frame.to += 200;
    frame.session = fuzz_u32(&script);
    frame.peer = fuzz_u32(&script);
    frame.seq = fuzz_u32(&script);
    frame.ack = fuzz_u32(&script);
    frame.len = (int)fuzz_u16(&script) % (JL_FRAME_PAYLOAD + 3) - 1;
    frame.payload = payload;
    fuzz_octets(&script, payload, JL_FRAME_PAYLOAD);

    len = has_sense(&frame)
        ? JL_FRAME_HEADER + frame.len + JL_FRAME_TRAILER : JL_FRAME_MAX;
    octets = malloc((size_t)len);
    if (has_sense(&frame)) {
        FUZZ_HOLDS(jl_frame_encode(octets, len - 1, &frame) == JL_ENOMEM);
        FUZZ_HOLDS(jl_frame_encode(octets, len, &frame) == len);
        FUZZ_HOLDS(jl_frame_decode(&again, octets, len, frame.number) ==
                   JL_OK);
        FUZZ_HOLDS(same_fields(&frame, &again));
        damage(octets, len, &script);
    } else {
        FUZZ_HOLDS(jl_frame_encode(octets, len, &frame) == JL_EDIM);
    }
    free(octets);
}

/* --- numbers and checksums ----------------------------------------------- */

static void numbers(fuzz_script script)
{
    unsigned char octets[4 * JL_REAL_OCTETS], again[sizeof octets];
    jl_real v[4], one;
    int cut = (int)fuzz_octet(&script) % (int)(sizeof octets + 1);

    fuzz_octets(&script, octets, sizeof octets);
    jl_put_u16(again, jl_get_u16(octets));
    FUZZ_HOLDS(memcmp(again, octets, 2) == 0);
    jl_put_u32(again, jl_get_u32(octets));
    FUZZ_HOLDS(memcmp(again, octets, 4) == 0);
    FUZZ_HOLDS(jl_get_reals(octets, v, 4) == octets + sizeof octets);
    FUZZ_HOLDS(jl_put_reals(again, v, 4) == again + sizeof again);
    FUZZ_HOLDS(memcmp(again, octets, sizeof octets) == 0);
    one = jl_get_real(octets);
    if (one == one) {           /* by value, a NaN may change its bits */
        jl_put_real(again, one);
        FUZZ_HOLDS(memcmp(again, octets, JL_REAL_OCTETS) == 0);
    }
    FUZZ_HOLDS(jl_crc32(jl_crc32(0, octets, cut), octets + cut,
                        (int)sizeof octets - cut) ==
               jl_crc32(0, octets, sizeof octets));
}

int fuzz_wire(const unsigned char *data, size_t size)
{
    fuzz_script script;

    script.at = data;
    script.left = size < 2 * JL_FRAME_MAX ? size : 2 * JL_FRAME_MAX;
    decode(script);
    encode(script);
    numbers(script);
    return 0;
}
