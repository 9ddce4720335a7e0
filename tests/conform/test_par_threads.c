/* The parallel IMM on port threads, where PEs really run at the same time: the
 * serial bits for any number of PEs and any topology, whoever is faster. */
#include "par_case.h"

#include "threads/port_threads.h"

struct run {
    jl_threads *threads;
    struct par_shape shape;
    int status[JL_MAX_PES + 1];
    struct par_trace trace;
};

static void body(int node, void *context)
{
    struct run *run = context;
    jl_chan *to[JL_MAX_PES + 1] = { NULL }, *from[JL_MAX_PES + 1] = { NULL };
    int i, npe = run->shape.npe;

    for (i = 0; i <= npe; i++)
        if (i != node) {
            to[i] = jl_threads_tx(run->threads, node, i);
            from[i] = jl_threads_rx(run->threads, i, node);
        }
    run->status[node] = node == npe
        ? par_host(&run->trace, &run->shape, to[0], from[0], NULL)
        : par_pe(node, &run->shape, to, from, NULL);
}

static void compare(struct run *run, int slots)
{
    static struct par_trace serial;
    int i;

    par_serial(&serial, &run->shape);
    run->threads = jl_threads_new(run->shape.npe + 1,
                                  JL_PAR_MSG(PAR_M, PAR_N, PAR_Z), slots);
    assert_non_null(run->threads);
    assert_int_equal(jl_threads_run(run->threads, body, run), JL_OK);
    for (i = 0; i <= run->shape.npe; i++)
        assert_int_equal(run->status[i], JL_OK);
    jl_threads_free(run->threads);
    assert_same_bits(&run->trace, &serial, sizeof serial);
}

static void compare_all(int gate)
{
    static struct run run = { .shape = { .hangs_at = -1 } };
    struct par_shape *s = &run.shape;
    int slots, f;

    s->M = PAR_M;
    s->gate = gate;
    for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
         s->topology++)
        for (s->npe = 1; s->npe <= 8; s->npe++)
            for (s->sticky = 0; s->sticky < 2; s->sticky++)
                for (slots = 0; slots <= 2; slots++)
                    for (f = 0; f < PAR_FORMS; f++) {
                        s->form = par_forms[f];
                        compare(&run, slots);
                    }
}

static void test_par_gives_serial_bits_on_threads(void **state)
{
    (void)state;
    compare_all(0);
}

static void test_par_gate_gives_serial_bits_on_threads(void **state)
{
    (void)state;
    compare_all(1);
}

static void test_par_gives_serial_bits_with_functions(void **state)
{
    static struct run run = { .shape = { .hangs_at = -1, .nonlinear = 1 } };
    struct par_shape *s = &run.shape;

    (void)state;
    s->M = PAR_M;
    for (s->npe = 1; s->npe <= 8; s->npe++) {
        s->form = s->npe % 2 ? &jl_kf_unscented : &jl_kf_joseph;
        compare(&run, 1);
        s->sticky = !s->sticky;
    }
}

static void test_par_cg_gives_serial_bits_on_threads(void **state)
{
    static const int modes[] = { 1, 2, 3, 8 };
    static struct run run = { .shape = { .hangs_at = -1 } };
    struct par_shape *s = &run.shape;
    int k;

    (void)state;
    for (k = 0; k < 4; k++)
        for (s->axes = 1; s->axes <= PAR_CG_AXES; s->axes++)
            for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
                 s->topology++)
                for (s->npe = 1; s->npe <= 8; s->npe++) {
                    s->M = modes[k];
                    compare(&run, (s->npe + s->axes) % 3);
                }
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_par_gives_serial_bits_on_threads),
        cmocka_unit_test(test_par_gate_gives_serial_bits_on_threads),
        cmocka_unit_test(test_par_gives_serial_bits_with_functions),
        cmocka_unit_test(test_par_cg_gives_serial_bits_on_threads),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
