/* The folded MEKF on port loop: the serial bits for any number of PEs and any
 * borders, the octets that fold.h says, and all or none if something fails. */
#include "fold_case.h"

#include "loop/port_loop.h"

struct run {
    jl_loop *loop;
    struct fold_shape shape;
    int bad;
    struct fold_pe pe[JL_MAX_PES];
};

static void body(int node, void *context)
{
    struct run *run = context;
    jl_chan *to[JL_MAX_PES], *from[JL_MAX_PES];
    int i;

    for (i = 0; i < run->shape.npe; i++) {
        to[i] = jl_loop_tx(run->loop, node, i);
        from[i] = jl_loop_rx(run->loop, i, node);
    }
    run->bad += fold_pe(&run->pe[node], node, &run->shape, to, from);
}

static void play(struct run *run, int slots)
{
    run->bad = 0;
    run->loop = jl_loop_new(run->shape.npe, FOLD_MAX_MSG, slots);
    assert_non_null(run->loop);
    assert_int_equal(jl_loop_run(run->loop, body, run), JL_OK);
}

static void compare(struct run *run, int slots)
{
    play(run, slots);
    jl_loop_free(run->loop);
    if (run->bad > 0)
        print_message("model %d, %d PEs, c %d, spread %d\n", run->shape.model,
                      run->shape.npe, (int)run->shape.c, run->shape.spread);
    assert_int_equal(run->bad, 0);
}

static struct run run;

static struct fold_shape *plain(int npe, int model)
{
    static const struct fold_shape zero;

    run.shape = zero;
    run.shape.npe = npe;
    run.shape.model = model;
    run.shape.fail_pe = run.shape.leaves = -1;
    return &run.shape;
}

static void test_fold_gives_serial_bits_for_any_pes(void **state)
{
    int model, npe, c, spread;

    (void)state;
    for (model = 0; model < FOLD_MODELS; model++)
        for (npe = 1; npe <= 8; npe++)
            for (c = JL_MEKF_PREV; c <= JL_MEKF_FILT; c++)
                for (spread = 0; spread < 2; spread++) {
                    struct fold_shape *s = plain(npe, model);

                    s->c = (jl_mekf_c)c;
                    s->spread = spread;
                    compare(&run, (npe + c + spread) % 3);
                }
}

static void test_fold_gives_serial_bits_for_any_borders(void **state)
{
    unsigned random = 5;
    int k, i, rows[9];

    (void)state;
    for (k = 0; k < 200; k++) {
        int npe = 1 + (int)(conform_random(&random) % 8);
        const struct fold_size *size = &fold_sizes[k % FOLD_MODELS];
        int N = size->n + size->m + size->r;
        struct fold_shape *s = plain(npe, k % FOLD_MODELS);

        rows[0] = 0;
        for (i = 1; i < npe; i++) {
            rows[i] = rows[i - 1] + (int)(conform_random(&random)
                                          % (unsigned)(1 + 3 * N / npe));
            rows[i] = clip(rows[i], N);
        }
        rows[npe] = N;
        s->rows = rows;
        s->c = (jl_mekf_c)(k % 3);
        s->spread = k / 3 % 2;
        compare(&run, k % 2);
    }
}

static void test_fold_octets_of_the_example(void **state)
{
    static const int rows[] = { 0, 4, 6, 9, 16 };
    static const int want[][3] = {
        { 1672, 3500, 168 }, { 1352, 2604, 168 }, { 872, 1500, 168 }
    };
    struct fold_shape *s = plain(4, 5);
    const jl_mekf_model *model;
    int i, o = JL_REAL_OCTETS;

    (void)state;
    s->rows = rows;
    compare(&run, 1);
    model = &run.pe[0].model.model;
    for (i = 0; i < 3; i++) {
        assert_int_equal(fold_up(model, 0, rows[i + 1]),
                         8 + (want[i][0] - 8) / 8 * o);
        assert_int_equal(fold_down(model, 0, rows[i + 1], 1),
                         12 + (want[i][1] - 12) / 8 * o);
        assert_int_equal(8 + (2 * model->n + model->m) * o,
                         8 + (want[i][2] - 8) / 8 * o);
    }
}

/* --- failures ------------------------------------------------------------- */

static void test_fold_fails_for_all_or_none(void **state)
{
    int fail, npe, slots, c;

    (void)state;
    for (fail = FAIL_F; fail <= FAIL_LARGE; fail++)
        for (npe = 1; npe <= 8; npe++)
            for (slots = 0; slots < 2; slots++)
                for (c = JL_MEKF_PREV; c <= JL_MEKF_FILT; c++) {
                    struct fold_shape *s = plain(npe, 3 + npe % 3);

                    s->fail = fail;
                    s->c = (jl_mekf_c)c;
                    compare(&run, slots);
                }
}

static void test_fold_fails_for_all_if_one_pe_does(void **state)
{
    int npe, pe;

    (void)state;
    for (npe = 1; npe <= 5; npe++)
        for (pe = 0; pe < npe; pe++) {
            struct fold_shape *s = plain(npe, 4);

            s->fail = npe % 2 ? FAIL_F : FAIL_G;
            s->fail_pe = pe;
            compare(&run, pe % 2);
        }
}

/* Who is left gets an error, and knows whom to blame. */
static void test_fold_blames_the_pe_that_left(void **state)
{
    int slots, gone, pe;

    (void)state;
    for (slots = 0; slots < 2; slots++)
        for (gone = 0; gone < 4; gone++) {
            struct fold_shape *s = plain(4, 5);

            s->leaves = gone;
            play(&run, slots);
            jl_loop_free(run.loop);
            for (pe = 0; pe < 4; pe++)
                if (pe != gone) {
                    assert_int_equal(run.pe[pe].fold.failed, JL_ECLOSED);
                    assert_int_equal(run.pe[pe].fold.failed_pe, gone);
                }
        }
}

/* By its deadlines PE0 knows, and all between; those behind know when the PE is
 * gone, since they wait for PE0 without limit. */
static void test_fold_blames_the_pe_that_hangs(void **state)
{
    int slots, hung, pe;

    (void)state;
    for (slots = 0; slots < 2; slots++)
        for (hung = 1; hung < 5; hung++) {
            struct fold_shape *s = plain(5, 5);

            s->leaves = hung;
            s->hangs = 1;
            play(&run, slots);
            jl_loop_free(run.loop);
            for (pe = 0; pe < 5; pe++)
                if (pe != hung) {
                    assert_int_equal(run.pe[pe].fold.failed,
                                     pe < hung ? JL_ETIMEOUT : JL_ECLOSED);
                    assert_int_equal(run.pe[pe].fold.failed_pe, hung);
                }
        }
}

/* --- a neighbour that says what does not belong here ---------------------- */

enum { OFF = -1 };

/* PE1 of two, model ar1, borders 0 1 3.  Octet `at` of its first or second
 * message is another, or octets are missing. */
static const struct odd {
    int message, at, value, missing, status;
} odds[] = {
    { 0, OFF, 0, 0, JL_OK },
    { 0, 0, 99, 0, JL_EMSG },           /* type */
    { 0, 1, 0, 0, JL_EMSG },            /* of PE0 */
    { 0, 4, 2, 0, JL_EMSG },            /* of another step */
    { 0, OFF, 0, 1, JL_ELENGTH },
    { 0, 2, 7, 0, JL_ELENGTH },         /* a failure with products */
    { 1, 0, 99, 0, JL_EMSG },
    { 1, 1, 0, 0, JL_EMSG },            /* of neither A nor B */
    { 1, 4, 2, 0, JL_EMSG },
    { 1, 8 + JL_REAL_OCTETS - 1, 0x7f, 0, JL_EMSG },    /* infinite */
    { 1, OFF, 0, 1, JL_ELENGTH },
    { 1, OFF, 0, 200, JL_ELENGTH }
};

struct meeting {
    jl_loop *loop;
    const struct odd *odd;
    int status, failed_pe;
};

static void say(const struct odd *odd, int message, jl_chan *to, int len)
{
    unsigned char msg[256] = { 0 };
    int i;

    msg[0] = message == 0 ? 16 : 18;    /* as fold_parts.h has them */
    msg[1] = message == 0 ? 1 : 1 | 2 | 4;
    msg[4] = 1;
    for (i = 8 + JL_REAL_OCTETS - 2; i < len; i += JL_REAL_OCTETS)
        msg[i] = 0xf0;
    if (odd->message == message) {
        if (odd->at != OFF)
            msg[odd->at] = (unsigned char)odd->value;
        len = len > odd->missing ? len - odd->missing : 0;
    }
    (void)jl_chan_send(to, msg, len, 1000000);
}

static void meeting_body(int node, void *context)
{
    static const int rows[] = { 0, 1, 3 };
    static struct fold_pe t;
    struct meeting *m = context;
    jl_chan *to = jl_loop_tx(m->loop, node, 1 - node);
    jl_chan *from = jl_loop_rx(m->loop, 1 - node, node);
    jl_fold_config config = { 0 };
    unsigned char in[FOLD_MAX_MSG];
    jl_real z = 1;

    if (node == 1) {
        say(m->odd, 0, to, 8 + 5 * JL_REAL_OCTETS);
        if (jl_chan_recv(from, in, sizeof in, 1000000) > 0)
            say(m->odd, 1, to, 8 + 3 * JL_REAL_OCTETS);
        return;
    }
    fold_model(&t.model, plain(2, 0));
    fold_filter_start(&t.folded, &t.model.model, &run.shape);
    config.npe = 2;
    config.rows = rows;
    config.to_next = to;
    config.from_next = from;
    config.timeout_us = 1000000;
    assert_int_equal(jl_fold_init(&t.fold, &t.folded.f, &config, t.buf,
                                  sizeof t.buf), JL_OK);
    m->status = jl_fold_step(&t.fold, &z, t.folded.scratch);
    m->failed_pe = t.fold.failed_pe;
}

static void test_fold_believes_no_odd_pe(void **state)
{
    size_t k;

    (void)state;
    for (k = 0; k < sizeof odds / sizeof *odds; k++) {
        struct meeting m = { 0 };

        m.odd = &odds[k];
        m.loop = jl_loop_new(2, FOLD_MAX_MSG, 1);
        assert_int_equal(jl_loop_run(m.loop, meeting_body, &m), JL_OK);
        jl_loop_free(m.loop);
        assert_int_equal(m.status, m.odd->status);
        assert_int_equal(m.failed_pe, m.odd->status != JL_OK);
    }
}

/* --- init ----------------------------------------------------------------- */

static void test_fold_init_refuses_what_does_not_fit(void **state)
{
    static struct fold_pe t;
    int rows[4] = { 0, 1, 2, 3 };
    jl_chan small = { 0 };
    jl_fold_config config = { 0 };
    jl_fold before;
    int need = JL_FOLD_MSG(1, 1, 1, 1, 1);

    (void)state;
    fold_model(&t.model, plain(3, 0));
    fold_filter_start(&t.folded, &t.model.model, &run.shape);
    small.max_len = need;
    config.pe = 1;
    config.npe = 3;
    config.rows = rows;
    config.to_prev = config.from_prev = config.to_next = config.from_next
        = &small;
    memset(&t.fold, 0x5a, sizeof t.fold);
    before = t.fold;
#define REFUSED(cap, code) \
    assert_int_equal(jl_fold_init(&t.fold, &t.folded.f, &config, t.buf, cap), \
                     code)
    config.pe = 3;
    REFUSED(2 * need, JL_EDIM);
    config.pe = -1;
    REFUSED(2 * need, JL_EDIM);
    config.pe = 1;
    config.npe = JL_MAX_PES + 1;
    REFUSED(2 * need, JL_EDIM);
    config.npe = 3;
    rows[3] = 4;
    REFUSED(2 * need, JL_EDIM);
    rows[3] = 3;
    rows[1] = 3;
    REFUSED(2 * need, JL_EDIM);
    rows[1] = 1;
    rows[0] = 1;
    REFUSED(2 * need, JL_EDIM);
    rows[0] = 0;
    REFUSED(2 * need - 1, JL_ENOMEM);
    small.max_len--;
    REFUSED(2 * need, JL_ETOOLONG);
    assert_memory_equal(&t.fold, &before, sizeof before);
    small.max_len++;
    REFUSED(2 * need, JL_OK);
#undef REFUSED
}

/* Numbers that the rotations of row j take part in. */
static long work_of(const jl_mekf_model *t, int j)
{
    int n = t->n, r = t->r, N = n + t->m;

    return (long)(r + N + t->p1 + t->p2 - j) * (r + N - j)
        + (j < r + n ? (long)(r + n + t->p1 - j) * (r + n - j) : 0);
}

/* Each border is the first at which the PEs before it have their share. */
static void test_fold_deal_shares_the_work(void **state)
{
    int npe, model, rows[JL_MAX_PES + 1], pe, j;

    (void)state;
    for (model = 0; model < FOLD_MODELS; model++)
        for (npe = 1; npe <= JL_MAX_PES; npe++) {
            const jl_mekf_model *t = &run.pe[0].model.model;
            int N = fold_sizes[model].n + fold_sizes[model].m
                + fold_sizes[model].r;
            long total = 0, sum = 0;

            fold_model(&run.pe[0].model, plain(npe, model));
            jl_fold_deal(rows, npe, t);
            for (j = 0; j < N; j++)
                total += work_of(t, j);
            assert_int_equal(rows[0], 0);
            assert_int_equal(rows[npe], N);
            for (pe = 1, j = 0; pe < npe; pe++) {
                assert_true(rows[pe] >= rows[pe - 1]);
                for (; j < rows[pe]; j++)
                    sum += work_of(t, j);
                assert_true(npe * sum >= pe * total - npe * npe);
                assert_true(j == 0 || npe * (sum - work_of(t, j - 1))
                            < pe * total);
            }
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fold_gives_serial_bits_for_any_pes),
        cmocka_unit_test(test_fold_gives_serial_bits_for_any_borders),
        cmocka_unit_test(test_fold_octets_of_the_example),
        cmocka_unit_test(test_fold_fails_for_all_or_none),
        cmocka_unit_test(test_fold_fails_for_all_if_one_pe_does),
        cmocka_unit_test(test_fold_blames_the_pe_that_left),
        cmocka_unit_test(test_fold_blames_the_pe_that_hangs),
        cmocka_unit_test(test_fold_believes_no_odd_pe),
        cmocka_unit_test(test_fold_init_refuses_what_does_not_fit),
        cmocka_unit_test(test_fold_deal_shares_the_work),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
