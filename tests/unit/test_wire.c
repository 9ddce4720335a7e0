/* Octets, reals, CRC and frames: every cut and every flipped bit. */
#include "close.h"

#include <stdio.h>
#include <stdlib.h>

#include "jumplink/wire.h"

static void test_wire_integers(void **state)
{
    unsigned char p[6];
    jl_u32 v;
    int i;

    (void)state;
    memset(p, 0xEE, sizeof p);
    jl_put_u16(p + 1, 0x1234);
    assert_memory_equal(p, "\xEE\x34\x12\xEE\xEE\xEE", 6);
    assert_int_equal(jl_get_u16(p + 1), 0x1234);
    jl_put_u16(p, 0xABCDEFFF);          /* what does not fit is cut off */
    assert_int_equal(jl_get_u16(p), 0xEFFF);
    memset(p, 0xEE, sizeof p);
    jl_put_u32(p + 1, 0x89ABCDEF);
    assert_memory_equal(p, "\xEE\xEF\xCD\xAB\x89\xEE", 6);
    for (i = 0; i < 32; i++) {
        v = (jl_u32)1 << i;
        jl_put_u32(p, v);
        assert_int_equal(jl_get_u32(p), v);
        assert_int_equal(p[i / 8], 1 << i % 8);
        jl_put_u32(p, ~v);
        assert_int_equal(jl_get_u32(p), ~v);
    }
}

/* Little-endian, whatever the machine is. */
static void test_wire_real_octets(void **state)
{
    unsigned char p[JL_REAL_OCTETS];

    (void)state;
    jl_put_real(p, JL_C(-1.5));
#if JL_REAL_FLOAT
    assert_memory_equal(p, "\0\0\xC0\xBF", 4);
#else
    assert_memory_equal(p, "\0\0\0\0\0\0\xF8\xBF", 8);
#endif
    assert_true(jl_get_real(p) == JL_C(-1.5));
}

static void test_wire_reals_keep_their_bits(void **state)
{
#if JL_REAL_FLOAT
    static const uint32_t bits[] = { 0, 0x80000000u, 1, 0x807FFFFFu,
        0x00800000u, 0x7F7FFFFFu, 0x7F800000u, 0xFF800000u, 0x7FC00000u,
        0x7F800001u, 0xFFFFFFFFu, 0x12345678u, 0x3F800000u };
#else
    static const uint64_t bits[] = { 0, 0x8000000000000000u, 1,
        0x800FFFFFFFFFFFFFu, 0x0010000000000000u, 0x7FEFFFFFFFFFFFFFu,
        0x7FF0000000000000u, 0xFFF0000000000000u, 0x7FF8000000000000u,
        0x7FF0000000000001u, 0xFFFFFFFFFFFFFFFFu, 0x123456789ABCDEF0u,
        0x3FF0000000000000u };
#endif
    enum { N = sizeof bits / sizeof bits[0] };
    unsigned char p[N * JL_REAL_OCTETS + 2];
    jl_real v[N], back[N];
    int i, k;

    (void)state;
    assert_int_equal(sizeof bits[0], JL_REAL_OCTETS);
    memcpy(v, bits, sizeof v);
    memset(p, 0xEE, sizeof p);
    assert_ptr_equal(jl_put_reals(p + 1, v, N), p + 1 + N * JL_REAL_OCTETS);
    assert_int_equal(p[0], 0xEE);
    assert_int_equal(p[N * JL_REAL_OCTETS + 1], 0xEE);
    for (i = 0; i < N; i++)
        for (k = 0; k < JL_REAL_OCTETS; k++)
            assert_int_equal(p[1 + i * JL_REAL_OCTETS + k],
                             bits[i] >> 8 * k & 255);
    assert_ptr_equal(jl_get_reals(p + 1, back, N),
                     p + 1 + N * JL_REAL_OCTETS);
    assert_memory_equal(back, bits, sizeof back);
    for (i = 0; i < N; i++) {
        jl_put_real(p, v[i]);
        v[i] = jl_get_real(p);
        assert_memory_equal(&v[i], &bits[i], JL_REAL_OCTETS);
    }
    assert_ptr_equal(jl_put_reals(p, v, 0), p);
    assert_ptr_equal(jl_get_reals(p, v, 0), p);
}

/* The definition, bit by bit. */
static jl_u32 slow_crc(const unsigned char *p, int len)
{
    jl_u32 crc = 0xFFFFFFFFu;
    int i, k;

    for (i = 0; i < len; i++)
        for (crc ^= p[i], k = 0; k < 8; k++)
            crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
    return ~crc;
}

static void test_wire_crc(void **state)
{
    const unsigned char *check = (const unsigned char *)"123456789";
    unsigned char all[256];
    int i;

    (void)state;
    assert_int_equal(jl_crc32(0, check, 9), 0xCBF43926u);
    assert_int_equal(jl_crc32(0, check, 0), 0);
    assert_int_equal(jl_crc32(0x12345678u, check, 0), 0x12345678u);
    for (i = 0; i < 256; i++)           /* every entry of the table */
        all[i] = (unsigned char)i;
    for (i = 0; i <= 256; i++) {
        assert_int_equal(jl_crc32(0, all, i), slow_crc(all, i));
        assert_int_equal(jl_crc32(jl_crc32(0, all, i), all + i, 256 - i),
                         slow_crc(all, 256));
    }
}

/* --- frames ------------------------------------------------------------ */

static const unsigned char text[] = "a jump, a link";

static jl_frame sample(void)
{
    jl_frame f = { JL_FRAME_LAST, 8, 3, 200, 0x01020304, 0xA0B0C0D0, 7,
                   0xFFFFFFFE, NULL, 14 };

    f.payload = text;
    return f;
}

static void same_frame(const jl_frame *a, const jl_frame *b)
{
    assert_int_equal(a->kind, b->kind);
    assert_int_equal(a->number, b->number);
    assert_int_equal(a->from, b->from);
    assert_int_equal(a->to, b->to);
    assert_int_equal(a->session, b->session);
    assert_int_equal(a->peer, b->peer);
    assert_int_equal(a->seq, b->seq);
    assert_int_equal(a->ack, b->ack);
    assert_int_equal(a->len, b->len);
    assert_memory_equal(a->payload, b->payload, (size_t)a->len);
}

/* The decoder refuses octets with this status, and leaves the frame alone.
 * The copy is exactly as long as said, so that a sanitizer sees any octet
 * read behind it. */
static void refused(const unsigned char *octets, int len, int number,
                    int status)
{
    unsigned char *copy = malloc((size_t)(len > 0 ? len : 1));
    jl_frame f, before;

    memset(&f, 0x5A, sizeof f);
    before = f;
    memcpy(copy, octets, (size_t)(len > 0 ? len : 0));
    if (status != 0)
        assert_int_equal(jl_frame_decode(&f, copy, len, number), status);
    else
        assert_true(jl_frame_decode(&f, copy, len, number) < 0);
    assert_memory_equal(&f, &before, sizeof f);
    free(copy);
}

static void test_wire_frame_round_trip(void **state)
{
    static unsigned char payload[JL_FRAME_PAYLOAD], buf[JL_FRAME_MAX + 1];
    jl_frame f = sample(), back;
    int kind, len, i;

    (void)state;
    for (i = 0; i < JL_FRAME_PAYLOAD; i++)
        payload[i] = (unsigned char)(i * 7 + 1);
    for (kind = JL_FRAME_HELLO; kind <= JL_FRAME_ALIVE; kind++)
        for (len = 0; len <= JL_FRAME_PAYLOAD; len++) {
            f = sample();
            f.kind = kind;
            f.number = len % 2 ? 4 : 8;
            f.from = len % 256;
            f.to = 255 - len % 256;
            f.payload = payload;
            f.len = len;
            if (len > 0 && kind != JL_FRAME_DATA && kind != JL_FRAME_LAST) {
                assert_int_equal(jl_frame_encode(buf, JL_FRAME_MAX, &f),
                                 JL_EDIM);
                continue;
            }
            buf[len + 36] = 0xEE;
            assert_int_equal(jl_frame_encode(buf, JL_FRAME_MAX, &f), len + 36);
            assert_int_equal(buf[len + 36], 0xEE);
            assert_int_equal(jl_frame_decode(&back, buf, len + 36, f.number),
                             JL_OK);
            same_frame(&back, &f);
            assert_ptr_equal(back.payload, buf + 32);
        }
    f = sample();               /* the payload may lie where it belongs */
    memcpy(buf + JL_FRAME_HEADER, text, 14);
    f.payload = buf + JL_FRAME_HEADER;
    assert_int_equal(jl_frame_encode(buf, 50, &f), 50);
    assert_memory_equal(buf + JL_FRAME_HEADER, text, 14);
    assert_int_equal(jl_frame_decode(&back, buf, 50, 8), JL_OK);
}

static void test_wire_frame_encode_refuses(void **state)
{
    unsigned char buf[JL_FRAME_MAX], before[JL_FRAME_MAX];
    jl_frame f;

    (void)state;
    memset(buf, 0xEE, sizeof buf);
    memcpy(before, buf, sizeof buf);
#define REFUSED(field, value) \
    (f = sample(), f.field = (value), \
     assert_int_equal(jl_frame_encode(buf, JL_FRAME_MAX, &f), JL_EDIM))
    REFUSED(kind, 0);
    REFUSED(kind, 8);
    REFUSED(kind, -1);
    REFUSED(kind, JL_FRAME_HELLO);      /* it has a payload */
    REFUSED(number, 0);
    REFUSED(number, 5);
    REFUSED(from, -1);
    REFUSED(from, 256);
    REFUSED(to, -1);
    REFUSED(to, 256);
    REFUSED(session, 0);
    REFUSED(len, -1);
    REFUSED(len, JL_FRAME_PAYLOAD + 1);
    REFUSED(len, INT_MAX);
    f = sample();
    assert_int_equal(jl_frame_encode(buf, 49, &f), JL_ENOMEM);
    assert_int_equal(jl_frame_encode(buf, -1, &f), JL_ENOMEM);
    assert_memory_equal(buf, before, sizeof buf);
    assert_int_equal(jl_frame_encode(buf, 50, &f), 50);
}

static void test_wire_frame_cuts(void **state)
{
    unsigned char buf[JL_FRAME_MAX + 1];
    jl_frame f = sample();
    int len = jl_frame_encode(buf, JL_FRAME_MAX, &f), cut;

    (void)state;
    assert_int_equal(len, 50);
    for (cut = 0; cut < len; cut++) {
        refused(buf, cut, 8, JL_ELENGTH);           /* its end is missing */
        refused(buf + len - cut, cut, 8, 0);        /* its beginning is */
    }
    memset(buf + len, 0, sizeof buf - (size_t)len);
    for (cut = len + 1; cut <= JL_FRAME_MAX + 1; cut++)
        refused(buf, cut, 8, JL_ELENGTH);           /* too much of it */
    refused(buf, -1, 8, JL_ELENGTH);
    refused(buf, INT_MIN, 8, 0);
}

static void test_wire_frame_flips(void **state)
{
    unsigned char buf[JL_FRAME_MAX];
    jl_frame f = sample();
    int len = jl_frame_encode(buf, JL_FRAME_MAX, &f), bit, other;

    (void)state;
    for (bit = 0; bit < 8 * len; bit++) {
        int at = bit / 8;
        buf[at] ^= (unsigned char)(1 << bit % 8);
        refused(buf, len, 8, at < 2 ? JL_EMAGIC : at == 2 ? JL_EVERSION :
                at == 24 || at == 25 ? JL_ELENGTH : JL_ECRC);
        for (other = bit + 1; other < 8 * len; other++) {   /* two bits */
            jl_frame g;
            buf[other / 8] ^= (unsigned char)(1 << other % 8);
            assert_true(jl_frame_decode(&g, buf, len, 8) < 0);
            buf[other / 8] ^= (unsigned char)(1 << other % 8);
        }
        buf[at] ^= (unsigned char)(1 << bit % 8);
    }
    assert_int_equal(jl_frame_decode(&f, buf, len, 8), JL_OK);
}

/* An octet of a frame without payload, changed, with a checksum that agrees. */
static void changed(int at, int value, int status)
{
    unsigned char buf[36];
    jl_frame f = sample();

    f.kind = JL_FRAME_ACK;
    f.len = 0;
    assert_int_equal(jl_frame_encode(buf, 36, &f), 36);
    buf[at] = (unsigned char)value;
    jl_put_u32(buf + 32, jl_crc32(0, buf, 32));
    if (status == JL_OK)
        assert_int_equal(jl_frame_decode(&f, buf, 36, 8), JL_OK);
    else
        refused(buf, 36, 8, status);
}

static void test_wire_frame_decode_codes(void **state)
{
    unsigned char buf[JL_FRAME_MAX];
    jl_frame f = sample();
    int at, kind, len;

    (void)state;
    changed(0, 'j', JL_EMAGIC);
    changed(1, 'l', JL_EMAGIC);
    changed(2, 0, JL_EVERSION);
    changed(2, 2, JL_EVERSION);
    changed(3, 0, JL_EMSG);
    for (kind = 1; kind <= 7; kind++)
        changed(3, kind, JL_OK);
    for (; kind < 256; kind++)
        changed(3, kind, JL_EMSG);
    changed(4, 4, JL_ENUMBER);
    changed(4, 0, JL_ENUMBER);
    changed(7, 1, JL_EMSG);
    changed(24, 1, JL_ELENGTH);
    changed(25, 1, JL_ELENGTH);
    for (at = 26; at < 32; at++)
        changed(at, 128, JL_EMSG);
    len = jl_frame_encode(buf, JL_FRAME_MAX, &f);
    refused(buf, len, 4, JL_ENUMBER);
    refused(buf, len, 0, JL_ENUMBER);
    for (kind = 1; kind <= 7; kind++) {         /* with a payload */
        buf[3] = (unsigned char)kind;
        jl_put_u32(buf + 46, jl_crc32(0, buf, 46));
        if (kind == JL_FRAME_DATA || kind == JL_FRAME_LAST)
            assert_int_equal(jl_frame_decode(&f, buf, len, 8), JL_OK);
        else
            refused(buf, len, 8, JL_EMSG);
    }
    buf[3] = JL_FRAME_DATA;
    memset(buf + 8, 0, 4);                      /* no session */
    jl_put_u32(buf + 46, jl_crc32(0, buf, 46));
    refused(buf, len, 8, JL_EMSG);
}

/* Noise of any length, also behind the beginning of a true frame. */
static void test_wire_frame_noise(void **state)
{
    unsigned char buf[128];
    jl_frame f = sample();
    jl_u32 r = 1;
    int i, k, len;

    (void)state;
    for (i = 0; i < 50000; i++) {
        jl_frame_encode(buf, JL_FRAME_MAX < 128 ? JL_FRAME_MAX : 128, &f);
        for (k = (int)(r >> 24) % 40; k < 128; k++) {
            r = r * 1664525u + 1013904223u;
            buf[k] = (unsigned char)(r >> 24);
        }
        len = (int)((r >> 8) % 128);
        refused(buf, len, 8, 0);
    }
}

/* The example in WIRE.md: the first fenced block whose lines are octets. */
static void test_wire_example_in_document(void **state)
{
    unsigned char doc[256], buf[JL_FRAME_MAX];
    jl_frame f = { JL_FRAME_LAST, 8, 0, 2, 0x6B8B4567, 0x327B23C6, 5, 9,
                   (const unsigned char *)"jump", 4 };
    char line[256];
    FILE *file = fopen(TOP_DIR "/src/wire/WIRE.md", "r");
    int n = 0, inside = 0, len;

    (void)state;
    assert_non_null(file);
    while (fgets(line, (int)sizeof line, file) != NULL) {
        char *p = line;
        unsigned v;
        int used;

        if (strncmp(line, "```hex", 6) == 0)
            inside = 1;
        else if (strncmp(line, "```", 3) == 0)
            inside = 0;
        else if (inside)
            while (n < 256 && sscanf(p, "%2x%n", &v, &used) == 1) {
                doc[n++] = (unsigned char)v;
                p += used;
            }
    }
    fclose(file);
    len = jl_frame_encode(buf, JL_FRAME_MAX, &f);
    assert_int_equal(n, len);
    assert_memory_equal(doc, buf, (size_t)len);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wire_integers),
        cmocka_unit_test(test_wire_real_octets),
        cmocka_unit_test(test_wire_reals_keep_their_bits),
        cmocka_unit_test(test_wire_crc),
        cmocka_unit_test(test_wire_frame_round_trip),
        cmocka_unit_test(test_wire_frame_encode_refuses),
        cmocka_unit_test(test_wire_frame_cuts),
        cmocka_unit_test(test_wire_frame_flips),
        cmocka_unit_test(test_wire_frame_decode_codes),
        cmocka_unit_test(test_wire_frame_noise),
        cmocka_unit_test(test_wire_example_in_document)
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
