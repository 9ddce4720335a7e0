/* The bad carrier itself: each fault happens, as often as said, and no other;
 * and the same again for the same seed. */
#include "close.h"
#include "fault.h"

#define N 20000

static fault f;

/* Put datagram i [16 octets], whose octets all are determined by it. */
static void put(int i, jl_u32 now)
{
    unsigned char d[16];
    int k;

    for (k = 0; k < 16; k++)
        d[k] = (unsigned char)((unsigned)i >> 8 * (k % 4));
    fault_put(&f, i % 5, d, 16, now);
}

static int number(const unsigned char *d)
{
    return (int)jl_get_u32(d);
}

static void near_rate(unsigned long count, unsigned long of, int percent)
{
    double expected = (double)of * percent / 100;

    assert_true((double)count > 0.9 * expected);
    assert_true((double)count < 1.1 * expected);
}

/* What comes out, against what went in. */
struct outcome {
    int seen[N];
    int doubled, disordered, cut, altered, late, missing;
};

static struct outcome outcome;

static void take(unsigned char *d, int len, int to, jl_u32 now, int *last)
{
    int i = number(d), k, whole = len == 16;

    for (k = 0; k < len && k < 16; k++)
        if (d[k] != (unsigned char)((unsigned)i >> 8 * (k % 4)))
            whole = 0;
    outcome.cut += len != 16;
    if (!whole) {
        outcome.altered += len == 16;
        return;
    }
    assert_in_range(i, 0, N - 1);
    assert_int_equal(to, i % 5);
    outcome.doubled += outcome.seen[i]++;
    outcome.disordered += i < *last;
    outcome.late += now != (jl_u32)i * 10;
    *last = i > *last ? i : *last;
}

static void pass(const fault_set *set)
{
    unsigned char d[JL_FRAME_MAX];
    int i, len, to, last = -1;
    jl_u32 now = 0;
    long wait;

    memset(&outcome, 0, sizeof outcome);
    fault_init(&f, set, 3);
    for (i = 0; i < N; i++) {
        now = (jl_u32)i * 10;
        put(i, now);
        while (len = fault_get(&f, &to, d, now), len > 0)
            take(d, len, to, now, &last);
        assert_true(fault_timer(&f, now) != 0);
    }
    while (wait = fault_timer(&f, now), wait >= 0) {
        now += (jl_u32)wait;
        len = fault_get(&f, &to, d, now);
        assert_true(len > 0);
        take(d, len, to, now, &last);
    }
    assert_int_equal(fault_get(&f, &to, d, now + 1000000), 0);
    for (i = 0; i < N; i++)
        outcome.missing += outcome.seen[i] == 0;
    assert_int_equal(f.put, N);
    assert_int_equal(f.crowded, 0);
    assert_int_equal(f.got, N - f.count[FAULT_DROP] + f.count[FAULT_REPEAT]);
}

static fault_set only(enum fault_kind kind, int percent)
{
    fault_set set = { "", { 0 }, 200 };

    set.percent[kind] = percent;
    return set;
}

static void test_fault_happens_and_no_other(void **state)
{
    static const int rates[] = { 0, 10, 30 };
    int kind, k, other;

    (void)state;
    for (kind = 0; kind < FAULT_KINDS; kind++)
        for (k = 0; k < 3; k++) {
            fault_set set = only((enum fault_kind)kind, rates[k]);
            struct outcome *o = &outcome;

            pass(&set);
            if (k > 0)
                near_rate(f.count[kind], N, rates[k]);
            else
                assert_int_equal(f.count[kind], 0);
            for (other = 0; other < FAULT_KINDS; other++)
                if (other != kind)
                    assert_int_equal(f.count[other], 0);
            if (kind != FAULT_DROP && kind != FAULT_CUT
                && kind != FAULT_CORRUPT)
                assert_int_equal(o->missing, 0);
            if (kind == FAULT_DROP || kind == FAULT_CUT)
                assert_int_equal(o->missing, f.count[kind]);
            assert_int_equal(o->cut, f.count[FAULT_CUT]);
            assert_int_equal(o->doubled, f.count[FAULT_REPEAT]);
            /* two flips of one bit are none */
            assert_true(o->altered <= (int)f.count[FAULT_CORRUPT]);
            assert_true(100 * o->altered
                        >= 97 * (int)f.count[FAULT_CORRUPT]);
            if (kind != FAULT_REORDER && kind != FAULT_DELAY) {
                assert_int_equal(o->disordered, 0);
                assert_int_equal(o->late, 0);
            } else if (k > 0) {
                assert_true(o->disordered > (int)f.count[kind] / 4);
                assert_true(o->late > (int)f.count[kind] * 9 / 10);
            }
        }
}

static void test_fault_all_at_once(void **state)
{
    static const fault_set all = { "", { 30, 30, 30, 30, 30, 30 }, 200 };
    static struct outcome first;
    int kind;

    (void)state;
    pass(&all);
    first = outcome;
    near_rate(f.count[FAULT_DROP], N, 30);
    for (kind = 1; kind < FAULT_KINDS; kind++)
        near_rate(f.count[kind], kind == FAULT_REPEAT ? N * 7 / 10
                  : N * 7 / 10 * 13 / 10, 30);
    pass(&all);                         /* the same seed, the same fate */
    assert_memory_equal(&first, &outcome, sizeof first);
    fault_init(&f, &all, 4);
    assert_int_equal(fault_timer(&f, 0), -1);
}

/* All put before any is taken out: reordered as well. */
static void test_fault_reorders_a_burst(void **state)
{
    fault_set set = only(FAULT_REORDER, 30);
    unsigned char d[JL_FRAME_MAX];
    int i, to, last = -1, disordered = 0, got = 0;

    (void)state;
    fault_init(&f, &set, 1);
    for (i = 0; i < 100; i++)
        put(i, 0);
    while (fault_get(&f, &to, d, 0) > 0) {
        disordered += number(d) < last;
        last = number(d);
        got++;
    }
    assert_true(disordered > 10);
    assert_true(got >= 97);             /* the last may have to wait */
    assert_true(got < 100 ? fault_timer(&f, 0) == FAULT_WAIT_US : 1);
    while (fault_get(&f, &to, d, FAULT_WAIT_US) > 0)
        got++;
    assert_int_equal(got, 100);
}

static void test_fault_is_bounded(void **state)
{
    fault_set set = only(FAULT_DELAY, 100);
    unsigned char d[JL_FRAME_MAX] = { 0 };
    int i, to, got = 0;

    (void)state;
    fault_init(&f, &set, 1);
    for (i = 0; i < FAULT_PLACES + 9; i++)
        fault_put(&f, 0, d, JL_FRAME_MAX, 0);
    assert_int_equal(f.crowded, 9);
    while (fault_get(&f, &to, d, 200) > 0)
        got++;
    assert_int_equal(got, FAULT_PLACES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fault_happens_and_no_other),
        cmocka_unit_test(test_fault_all_at_once),
        cmocka_unit_test(test_fault_reorders_a_burst),
        cmocka_unit_test(test_fault_is_bounded),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
