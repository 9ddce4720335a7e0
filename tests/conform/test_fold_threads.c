/* The folded MEKF on port threads, where PEs really run at the same time: the
 * serial bits and the same octets, whoever is faster. */
#include "fold_case.h"

#include "threads/port_threads.h"

struct run {
    jl_threads *threads;
    struct fold_shape shape;
    int bad[JL_MAX_PES];
    struct fold_pe pe[JL_MAX_PES];
};

static void body(int node, void *context)
{
    struct run *run = context;
    jl_chan *to[JL_MAX_PES], *from[JL_MAX_PES];
    int i;

    for (i = 0; i < run->shape.npe; i++) {
        to[i] = jl_threads_tx(run->threads, node, i);
        from[i] = jl_threads_rx(run->threads, i, node);
    }
    run->bad[node] = fold_pe(&run->pe[node], node, &run->shape, to, from);
}

static void compare(struct run *run, int slots)
{
    int i;

    run->threads = jl_threads_new(run->shape.npe, FOLD_MAX_MSG, slots);
    assert_non_null(run->threads);
    assert_int_equal(jl_threads_run(run->threads, body, run), JL_OK);
    jl_threads_free(run->threads);
    for (i = 0; i < run->shape.npe; i++)
        assert_int_equal(run->bad[i], 0);
}

static void compare_all(int fail)
{
    static struct run run;
    struct fold_shape *s = &run.shape;
    int slots;

    s->fail = fail;
    s->fail_pe = s->leaves = -1;
    for (s->model = 0; s->model < FOLD_MODELS; s->model++)
        for (s->npe = 1; s->npe <= 8; s->npe++)
            for (slots = 0; slots <= 2; slots++) {
                s->c = (jl_mekf_c)((s->npe + s->model) % 3);
                s->spread = s->npe / 3 % 2;
                compare(&run, slots);
            }
}

static void test_fold_gives_serial_bits_on_threads(void **state)
{
    (void)state;
    compare_all(FAIL_NEVER);
}

static void test_fold_fails_for_all_or_none_on_threads(void **state)
{
    (void)state;
    compare_all(FAIL_C);
    compare_all(FAIL_SINGULAR);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fold_gives_serial_bits_on_threads),
        cmocka_unit_test(test_fold_fails_for_all_or_none_on_threads),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
