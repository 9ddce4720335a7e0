#include "rivals.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "complain.h"
#include "interrupt.h"
#include "philox.h"
#include "progress.h"

/* Numbers of tests/golden/mekf, whose true parameters these are, nearly. */
static const struct rivals_scenario scenarios[] = {
    { .name = "ar1", .model = "ar1",
      .what = "A process of first order whose pole is not known",
      .quantity = { "state", "pole" }, .unit = { "", "" },
      .zoo = { .T = 1 }, .steps = 100,
      .x0 = { 1 }, .y0 = 0, .var0 = { 0.01, 1 }, .y = 0.95,
      .q = { 0.01, 1e-4 }, .r = { 0.01 }, .states = 1, .at = { 0 } },
    { .name = "spring2", .model = "spring2",
      .what = "A mass on a spring whose stiffness is not known",
      .quantity = { "position", "stiffness" }, .unit = { "m", "1/s2" },
      .zoo = { .r = 1, .T = JL_C(0.1), .d = JL_C(0.2), .C = { 1, 0 } },
      .steps = 100,
      .x0 = { 1, 0 }, .y0 = 4, .var0 = { 0.04, 0.04, 4 }, .y = 6,
      .q = { 0.01, 1e-6 }, .r = { 0.01 }, .states = 1, .at = { 0 } },
    { .name = "turn", .model = "ct4pos",
      .what = "A target in a turn whose rate is not known",
      .quantity = { "position", "turn rate" }, .unit = { "m", "rad/s" },
      .zoo = { .T = 1 }, .steps = 80,
      .x0 = { 1000, 30, 1000, 0 }, .y0 = 0,
      .var0 = { 100, 25, 100, 25, 0.01 }, .y = -0.03,
      .q = { 0.04, 0.04, 1e-6 }, .r = { 100, 100 },
      .states = 2, .at = { 0, 2 } }
};

const struct rivals_scenario *rivals_scenario(const char *name)
{
    size_t i;

    for (i = 0; i < sizeof scenarios / sizeof *scenarios; i++)
        if (strcmp(scenarios[i].name, name) == 0)
            return &scenarios[i];
    return NULL;
}

/* --- the filters --------------------------------------------------------- */

static void diagonal(jl_real *A, const double *d, int n)
{
    int i;

    for (i = 0; i < n; i++)
        A[i * (n + 1)] = (jl_real)d[i];
}

/* What the rival is told in a situation; with the truth's model. */
static void set_up(struct mekf_setup *s, const struct rivals_scenario *c,
                   int situation, int rival)
{
    double var[ZOO_STATES], q[ZOO_NOISES];
    int n, p, i;

    memset(s, 0, sizeof *s);
    s->zoo = c->zoo;
    (void)mekf_zoo_model(&s->model, c->model, &s->zoo);
    n = s->model.n;
    p = s->model.p1 + s->model.p2;
    memcpy(var, c->var0, sizeof var);
    memcpy(q, c->q, sizeof q);
    if (situation == TOO_SURE)
        var[n] /= 100;
    for (i = 0; i < s->model.p1 && situation == TOO_NOISY; i++)
        q[i] *= 100;
    s->plain = rival == RIVAL_EKF;
    s->spread = rival == RIVAL_SPREAD;
    s->c = JL_MEKF_PREV;
    for (i = 0; i < n; i++)
        s->x[i] = (jl_real)c->x0[i];
    s->x[n] = (jl_real)c->y0;
    diagonal(s->P, var, n + 1);
    diagonal(s->P1, var, n);
    diagonal(s->Q, q, p);
    diagonal(s->R, c->r, s->model.r);
}

static const jl_real *state_of(const struct mekf_filter *f)
{
    return f->setup->plain ? f->ekf.x : f->mekf.xhat;
}

static jl_real parameter_of(const struct mekf_filter *f)
{
    return (f->setup->plain ? f->ekf.x : f->mekf.x)[f->setup->model.n];
}

/* --- a run --------------------------------------------------------------- */

struct truth {
    const struct rivals_scenario *scenario;
    jl_mekf_model model;
    uint64_t seed;
    uint32_t run, drawn;
    jl_real x[4], y, z[2];
};

static jl_real draw(struct truth *t, double variance)
{
    return jl_sqrt((jl_real)variance)
        * philox_normal(t->seed, t->run, t->drawn++);
}

static void begin(struct truth *t, uint32_t run)
{
    const struct rivals_scenario *c = t->scenario;
    int i;

    t->run = run;
    t->drawn = 0;
    for (i = 0; i < t->model.n; i++)
        t->x[i] = (jl_real)c->x0[i] + draw(t, c->var0[i]);
    t->y = (jl_real)c->y;
}

/* x = f x + G1 w1, y = y + w2, z = c x + v: none of the models' G and c depends
 * on x or y. */
static int move(struct truth *t)
{
    const jl_mekf_model *m = &t->model;
    jl_real f[16] = { 0 }, G1[8] = { 0 }, G2[2] = { 0 }, G3[1] = { 0 };
    jl_real c[8] = { 0 }, x[4], w;
    int i, k, status = m->f(f, &t->y, m->context);

    if (status == JL_OK)
        status = m->G(G1, G2, G3, t->x, &t->y, m->context);
    if (status == JL_OK)
        status = m->c(c, t->x, &t->y, m->context);
    if (status != JL_OK)
        return status;
    for (i = 0; i < m->n; i++)
        for (x[i] = 0, k = 0; k < m->n; k++)
            x[i] += f[i * m->n + k] * t->x[k];
    memcpy(t->x, x, sizeof x);
    for (k = 0; k < m->p1; k++) {
        w = draw(t, t->scenario->q[k]);
        for (i = 0; i < m->n; i++)
            t->x[i] += G1[i * m->p1 + k] * w;
    }
    t->y += G3[0] * draw(t, t->scenario->q[m->p1]);
    for (i = 0; i < m->r; i++) {
        t->z[i] = draw(t, t->scenario->r[i]);
        for (k = 0; k < m->n; k++)
            t->z[i] += c[i * m->n + k] * t->x[k];
    }
    return JL_OK;
}

/* Take down a step: the sums of a run that become its errors. */
static void note(struct rivals *r, struct rivals_error *e, double *squares,
                 int step, double first, double square)
{
    e->mean += first / r->scenario->steps;
    e->rms += square / r->scenario->steps;
    e->final = sqrt(square);
    squares[step] += square;
}

static void note_filter(struct rivals *r, struct rivals_run *run, int situation,
                        int rival, int step, const struct mekf_filter *f,
                        const struct truth *t)
{
    struct rivals_error *e = run->of[situation][rival];
    double (*squares)[RIVALS_STEPS] = r->squares[situation][rival];
    const struct rivals_scenario *c = r->scenario;
    const jl_real *x = state_of(f);
    double off = 0, first = (double)(x[c->at[0]] - t->x[c->at[0]]);
    double y = (double)(parameter_of(f) - t->y);
    int i;

    for (i = 0; i < c->states; i++) {
        double d = (double)(x[c->at[i]] - t->x[c->at[i]]);

        off += d * d;
    }
    note(r, &e[OF_STATE], squares[OF_STATE], step, first, off);
    note(r, &e[OF_PARAMETER], squares[OF_PARAMETER], step, y, y * y);
}

enum { FILTERS = SITUATIONS * RIVALS };

static int one_run(struct rivals *r, struct truth *truth,
                   struct mekf_filter *filters,
                   const struct mekf_setup *setups, long index)
{
    struct rivals_run *run = &r->run[index];
    struct rivals_error *e = &run->of[0][0][0];
    int i, k, status = JL_OK;

    begin(truth, (uint32_t)index);
    for (i = 0; i < FILTERS && status == JL_OK; i++)
        status = mekf_filter_start(&filters[i], &setups[i]);
    for (k = 0; k < r->scenario->steps && status == JL_OK; k++) {
        status = move(truth);
        for (i = 0; i < FILTERS && status == JL_OK; i++) {
            status = mekf_filter_step(&filters[i], truth->z);
            note_filter(r, run, i / RIVALS, i % RIVALS, k, &filters[i], truth);
        }
    }
    for (i = 0; i < FILTERS * QUANTITIES; i++)
        e[i].rms = sqrt(e[i].rms);
    return status;
}

int rivals_simulate(struct rivals *r, const struct rivals_scenario *scenario,
                    long runs, uint64_t seed)
{
    struct mekf_setup setups[FILTERS];
    struct mekf_filter *filters = calloc(FILTERS, sizeof *filters);
    struct truth truth = { .scenario = scenario, .seed = seed };
    long run;
    int i, status = JL_OK;

    memset(r, 0, sizeof *r);
    r->scenario = scenario;
    r->runs = runs;
    r->seed = seed;
    r->run = calloc((size_t)runs, sizeof *r->run);
    for (i = 0; i < FILTERS; i++)
        set_up(&setups[i], scenario, i / RIVALS, i % RIVALS);
    truth.model = setups[0].model;
    if (r->run == NULL || filters == NULL)
        runs = 0;
    progress_begin(scenario->name);
    for (run = 0; run < runs && status == JL_OK && interrupted() == NULL;
         run++) {
        status = one_run(r, &truth, filters, setups, run);
        progress(run + 1, runs);
    }
    progress_begin(NULL);
    free(filters);
    if (status == JL_OK && run == r->runs)
        return 0;
    if (runs == 0)
        complain(scenario->name, 0, NULL, "no memory for %ld runs", r->runs);
    else if (status != JL_OK)
        complain(scenario->name, 0, NULL, "run %ld: %s", run,
                 jl_status_text(status));
    else
        complain(scenario->name, 0, NULL, "%s after %ld of %ld runs",
                 interrupted(), run, runs);
    rivals_free(r);
    return 1;
}

void rivals_free(struct rivals *r)
{
    free(r->run);
    r->run = NULL;
}
