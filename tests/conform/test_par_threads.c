/* The parallel IMM on port threads, where PEs really run at the same time: the
 * serial filter's bits for any number of PEs, whoever is faster. */
#include "par_case.h"

#include "threads/port_threads.h"

struct run {
    jl_threads *threads;
    int npe, M, sticky;
    const jl_kf_form *form;
    int status[JL_MAX_PES + 1];
    struct par_trace trace;
};

static void body(int node, void *context)
{
    struct run *run = context;
    jl_chan *to[JL_MAX_PES + 1] = { NULL }, *from[JL_MAX_PES + 1] = { NULL };
    int i;

    for (i = 0; i <= run->npe; i++)
        if (i != node) {
            to[i] = jl_threads_tx(run->threads, node, i);
            from[i] = jl_threads_rx(run->threads, i, node);
        }
    if (node == run->npe)
        run->status[node] = par_host(&run->trace, run->M, to[0], from[0]);
    else
        run->status[node] = par_pe(node, run->npe, run->M, run->sticky,
                                   run->form, to, from);
}

static void compare(struct run *run, int slots)
{
    static struct par_trace serial;
    int i;

    par_serial(&serial, run->M, run->sticky, run->form);
    run->threads = jl_threads_new(run->npe + 1,
                                  JL_PAR_MSG(PAR_M, PAR_N, PAR_Z), slots);
    assert_non_null(run->threads);
    assert_int_equal(jl_threads_run(run->threads, body, run), JL_OK);
    for (i = 0; i <= run->npe; i++)
        assert_int_equal(run->status[i], JL_OK);
    jl_threads_free(run->threads);
    assert_same_bits(&run->trace, &serial, sizeof serial);
}

static void test_par_gives_serial_bits_on_threads(void **state)
{
    static struct run run;
    int slots, forms;

    (void)state;
    run.M = PAR_M;
    for (run.npe = 1; run.npe <= 8; run.npe++)
        for (run.sticky = 0; run.sticky < 2; run.sticky++)
            for (slots = 0; slots <= 2; slots++)
                for (forms = 0; forms < 2; forms++) {
                    run.form = forms == 0 ? &jl_kf_joseph : &jl_kf_standard;
                    compare(&run, slots);
                }
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_par_gives_serial_bits_on_threads),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
