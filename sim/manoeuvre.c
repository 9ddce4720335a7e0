#include "manoeuvre.h"

#include <math.h>
#include <string.h>

#include "complain.h"
#include "interrupt.h"
#include "jumplink/cgimm.h"
#include "jumplink/imm.h"
#include "philox.h"
#include "progress.h"

const struct man_phase man_phases[MAN_PHASES] = {
    { "quiet", 1, 10 }, { "turn begins", 11, 15 }, { "turn", 16, 25 },
    { "turn ends", 26, 30 }, { "late quiet", 31, 40 }, { "all", 1, 40 }
};

enum { BEFORE = 3 };            /* positions measured up to t = 0 */

#define ONSET 10
#define END 25
#define ACCELERATION 80
#define SPEED 450

static const jl_real Pi[4] = {
    JL_C(0.98), JL_C(0.02), JL_C(0.02), JL_C(0.98)
};
static const jl_real Q[2] = { 100, 4000 };
static const jl_real R = 10000;

/* Of the adaptive filter: d is chi-square with 1 degree of freedom while gains
 * fit; at the high level the turn's innovations are 1.3 sigma off, d is 9. */
static const jl_real smooth = JL_C(0.3), up = 9, down = 1;

/* --- the filters --------------------------------------------------------- */

struct filters {
    jl_mode modes[2];
    jl_real mode_mem[2][JL_MODE_MEM(3, 1, 1)];
    jl_real imm_mem[JL_IMM_STATE(2, 3, 1)];
    jl_real scratch[JL_IMM_SCRATCH(2, 3, 1)];
    jl_real cg_mem[JL_CGIMM_STATE(2, 1)];
    jl_real adaptive_mem[JL_CG_ADAPTIVE_STATE(1)];
    jl_cg_gains gains[2];
    jl_imm imm;
    jl_cgimm cg;
    jl_cg_adaptive adaptive;
};

static int open_imm(struct filters *f)
{
    static const int kinds[2] = { JL_MOTION_CV, JL_MOTION_CA };
    int j, status = JL_OK;

    for (j = 0; j < 2 && status == JL_OK; j++) {
        jl_motion motion = { 0, 1, 3, 0, 0, (jl_real)MAN_SIGMA, 0 };

        motion.kind = kinds[j];
        motion.accel_std = jl_sqrt(Q[j]);
        status = jl_mode_init(&f->modes[j], 3, 1, 1, f->mode_mem[j],
                              JL_MODE_MEM(3, 1, 1));
        if (status == JL_OK)
            status = jl_mode_motion(&f->modes[j], &motion, 1);
    }
    if (status == JL_OK)
        status = jl_imm_init(&f->imm, 2, f->modes,
                             jl_kf_fixed(&jl_kf_joseph, 3, 1), JL_MIX_AUTO,
                             f->imm_mem, JL_IMM_STATE(2, 3, 1));
    return status == JL_OK ? jl_imm_chain(&f->imm, Pi) : status;
}

static int open_filters(struct filters *f)
{
    jl_real low[2], high[2];
    int status = open_imm(f), j;

    for (j = 0; j < 2 && status == JL_OK; j++)
        status = jl_cg_design(&f->gains[j], 2 + j, 1, Q[j], R);
    if (status == JL_OK)
        status = jl_cgimm_init(&f->cg, 2, f->gains, 1, 1, R, Pi, f->cg_mem,
                               JL_CGIMM_STATE(2, 1));
    if (status == JL_OK)
        status = jl_cg_steady(low, 2, jl_sqrt(Q[0] / R));
    if (status == JL_OK)
        status = jl_cg_steady(high, 2, jl_sqrt(Q[1] / R));
    return status == JL_OK
        ? jl_cg_adaptive_init(&f->adaptive, 1, 1, R, low, high, smooth, up,
                              down, f->adaptive_mem, JL_CG_ADAPTIVE_STATE(1))
        : status;
}

/* From the positions z of the last three seconds. */
static int start_filters(struct filters *f, const jl_real *z)
{
    static const jl_real fits[2][9] = {         /* variances / R */
        { 1, 1, 0, 1, 2, 0, 0, 0, 0 },
        { 1, JL_C(1.5), 1, JL_C(1.5), JL_C(6.5), 6, 1, 6, 6 }
    };
    jl_real x[6], P[18];
    int i, status;

    x[0] = x[3] = z[2];
    x[1] = z[2] - z[1];
    x[2] = 0;
    x[4] = (3 * z[2] - 4 * z[1] + z[0]) / 2;
    x[5] = z[2] - 2 * z[1] + z[0];
    for (i = 0; i < 18; i++)
        P[i] = R * fits[i / 9][i % 9];
    status = jl_imm_set(&f->imm, x, P, NULL, f->scratch);
    if (status == JL_OK)
        status = jl_cgimm_set(&f->cg, x, NULL);
    return status == JL_OK ? jl_cg_adaptive_set(&f->adaptive, x) : status;
}

/* Step all with z, and tell what they think. */
static int step_filters(double x[MAN_FILTERS][MAN_STATES], struct filters *f,
                        jl_real z)
{
    jl_real cg[3];
    int i, status = jl_imm_step(&f->imm, &z, f->scratch);

    if (status == JL_OK)
        status = jl_cgimm_step(&f->cg, &z);
    if (status == JL_OK)
        status = jl_cg_adaptive_step(&f->adaptive, &z);
    if (status != JL_OK)
        return status;
    jl_cgimm_estimate(&f->cg, cg);
    for (i = 0; i < MAN_STATES; i++) {
        x[MAN_IMM][i] = (double)f->imm.xhat[i];
        x[MAN_CGIMM][i] = (double)cg[i];
        x[MAN_ADAPTIVE][i] = i < 2 ? (double)f->adaptive.x[i] : 0;
    }
    return JL_OK;
}

/* --- runs ---------------------------------------------------------------- */

/* The acceleration in the second before t. */
static double acceleration_at(int t)
{
    return t > ONSET && t <= END ? ACCELERATION : 0;
}

static void add_phases(struct manoeuvre *m,
                       double e[MAN_FILTERS][MAN_STATES][MAN_STEPS])
{
    int f, i, p, k;

    for (i = 0; i < MAN_STATES; i++)
        for (p = 0; p < MAN_PHASES; p++) {
            const struct man_phase *phase = &man_phases[p];
            double square[MAN_FILTERS];

            for (f = 0; f < MAN_FILTERS; f++) {
                double sum = 0;

                square[f] = 0;
                for (k = phase->from - 1; k < phase->to; k++) {
                    sum += e[f][i][k];
                    square[f] += e[f][i][k] * e[f][i][k];
                }
                m->mean2[f][i][p] += sum * sum;
                m->square2[f][i][p] += square[f] * square[f];
            }
            m->square_pair[i][p] += square[MAN_IMM] * square[MAN_CGIMM];
        }
}

static int one_run(struct manoeuvre *m, struct filters *filters, uint32_t run)
{
    double truth[MAN_STATES], x[MAN_FILTERS][MAN_STATES];
    double e[MAN_FILTERS][MAN_STATES][MAN_STEPS];
    jl_real z[BEFORE];
    int t, f, i, status = JL_OK;

    for (t = 1 - BEFORE; t <= MAN_STEPS && status == JL_OK; t++) {
        uint32_t index = (uint32_t)(t + BEFORE - 1);
        jl_real noise = (jl_real)MAN_SIGMA * philox_normal(m->seed, run, index);

        if (t <= 0) {
            z[index] = (jl_real)(SPEED * t) + noise;
            if (t == 0)
                status = start_filters(filters, z);
            truth[MAN_POSITION] = 0;
            truth[MAN_VELOCITY] = SPEED;
            continue;
        }
        truth[MAN_ACCELERATION] = acceleration_at(t);
        truth[MAN_POSITION] += truth[MAN_VELOCITY]
            + truth[MAN_ACCELERATION] / 2;
        truth[MAN_VELOCITY] += truth[MAN_ACCELERATION];
        status = step_filters(x, filters, (jl_real)truth[MAN_POSITION] + noise);
        for (f = 0; f < MAN_FILTERS && status == JL_OK; f++)
            for (i = 0; i < MAN_STATES; i++) {
                double off = x[f][i] - truth[i];

                e[f][i][t - 1] = off;
                m->sum[f][i][t - 1] += off;
                m->squares[f][i][t - 1] += off * off;
            }
    }
    if (status == JL_OK)
        add_phases(m, e);
    return status;
}

int manoeuvre_run(struct manoeuvre *m, long runs, uint64_t seed)
{
    struct filters filters;
    long run;
    int t, status;

    memset(m, 0, sizeof *m);
    m->runs = runs;
    m->seed = seed;
    for (t = 1; t <= MAN_STEPS; t++)
        m->acceleration[t - 1] = acceleration_at(t);
    status = open_filters(&filters);
    progress_begin("manoeuvre1d");
    for (run = 0; run < runs && status == JL_OK && interrupted() == NULL;
         run++) {
        status = one_run(m, &filters, (uint32_t)run);
        progress(run + 1, runs);
    }
    progress_begin(NULL);
    if (status != JL_OK)
        complain("manoeuvre1d", 0, NULL, "run %ld: %s", run,
                 jl_status_text(status));
    else if (run < runs)
        complain("manoeuvre1d", 0, NULL, "%s after %ld of %ld runs",
                 interrupted(), run, runs);
    return status == JL_OK && run == runs ? 0 : 1;
}

/* --- figures ------------------------------------------------------------- */

double manoeuvre_mean(const struct manoeuvre *m, int filter, int state, int k)
{
    return m->sum[filter][state][k] / (double)m->runs;
}

double manoeuvre_rms(const struct manoeuvre *m, int filter, int state, int k)
{
    return sqrt(m->squares[filter][state][k] / (double)m->runs);
}

static double over_phase(const double *steps, int phase)
{
    double sum = 0;
    int k;

    for (k = man_phases[phase].from - 1; k < man_phases[phase].to; k++)
        sum += steps[k];
    return sum;
}

static int length(int phase)
{
    return man_phases[phase].to - man_phases[phase].from + 1;
}

struct man_figure manoeuvre_phase_mean(const struct manoeuvre *m, int filter,
                                       int state, int phase)
{
    double N = (double)m->runs, steps = length(phase);
    double mean = over_phase(m->sum[filter][state], phase) / N;
    double var = m->mean2[filter][state][phase] / N - mean * mean;
    struct man_figure figure;

    figure.value = mean / steps;
    figure.error = sqrt(fmax(var, 0) / (N - 1)) / steps;
    return figure;
}

double manoeuvre_phase_rms(const struct manoeuvre *m, int filter, int state,
                           int phase)
{
    return sqrt(over_phase(m->squares[filter][state], phase)
                / (double)m->runs / length(phase));
}

/* Both filters see the same noise, so what counts is the variance of
 * A / mean A - B / mean B, A and B a run's sums of squares. */
struct man_figure manoeuvre_ratio(const struct manoeuvre *m, int state,
                                  int phase)
{
    double N = (double)m->runs;
    double A = over_phase(m->squares[MAN_CGIMM][state], phase) / N;
    double B = over_phase(m->squares[MAN_IMM][state], phase) / N;
    double var = m->square2[MAN_CGIMM][state][phase] / N / (A * A)
        + m->square2[MAN_IMM][state][phase] / N / (B * B)
        - 2 * m->square_pair[state][phase] / N / (A * B);
    struct man_figure ratio;

    ratio.value = sqrt(A / B);
    ratio.error = ratio.value / 2 * sqrt(fmax(var, 0) / (N - 1));
    return ratio;
}
