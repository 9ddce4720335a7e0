/* What a step costs at sizes known to the compiler or not: the library beside
 * Eigen and beside plain loops, all compiled for this machine.  Before they are
 * timed all must agree.  Writes sizes.csv. */
#include <stdlib.h>
#include <string.h>
#include <tgmath.h>

#include "bench.h"
#include "clock.h"
#include "jumplink.h"
#include "progress.h"
#include "sizes.h"

#define STEPS 400
#ifndef ROUNDS
#define ROUNDS 40
#endif
#define SAME JL_C(1e-9)

static const struct {
    const char *name;
    sizes_make *make;
} who[] = {
    { "Eigen, fixed size", sizes_eigen },
    { "jumplink, fixed size", sizes_fixed },
    { "... zeros not known", sizes_dense },
    { "jumplink, any size", sizes_any },
    { "plain C, any size", sizes_plain }
};
#define WHO ((int)(sizeof who / sizeof *who))

static const struct {
    int kalman, M, n, m, sticky;
} cases[] = {
    { 0, 2, 3, 1, 0 },
    { 0, 3, 4, 2, 0 },
    { 0, 12, 6, 3, 0 },
    { 0, 12, 6, 3, 1 },
    { 1, 1, 4, 2, 0 },
    { 1, 1, 6, 3, 0 }
};
#define CASES ((int)(sizeof cases / sizeof *cases))

static struct entry {
    struct sizes_filter *filter;
    struct samples ns;          /* per step */
} entries[CASES][SIZES_FORMS][WHO];

static jl_real z[CASES][STEPS * 3];

/* The constant-gain IMM of the first case's modes: other estimates, so apart
 * from the check. */
static struct entry constant_gain[2];   /* and its log-likelihood           */

/* --- models and data ----------------------------------------------------- */

static jl_real *reals(int count)
{
    jl_real *r = calloc((size_t)count, sizeof *r);

    bench_must(r != NULL, "memory");
    return r;
}

/* n = 3: CV, CA in one axis; n = 4: CV and turns; n = 6: CV in three axes that
 * differ in how hard they manoeuvre. */
static jl_motion motion_of(int n, int j)
{
    jl_motion motion = { JL_MOTION_CV, 3, 2, JL_C(0.2), 0, 20, 0 };

    motion.accel_std *= (jl_real)(j + 1);
    if (n == 3) {
        motion.kind = j == 0 ? JL_MOTION_CV : JL_MOTION_CA;
        motion.axes = 1;
        motion.order = 3;
    } else if (n == 4) {
        motion.kind = j == 0 ? JL_MOTION_CV : JL_MOTION_CT;
        motion.axes = 2;
        motion.turn_rate = j == 0 ? 0 : j == 1 ? JL_C(0.1) : JL_C(-0.1);
    }
    return motion;
}

/* Sticky: stay with probability 0.95, elsewhere alike.  Else the next mode is
 * likelier than the others. */
static void set_chain(struct sizes_model *model)
{
    int M = model->M, i, j;
    jl_real out = JL_C(0.05);

    for (i = 0; i < M; i++) {
        for (j = 0; j < M; j++)
            model->Pi[i * M + j] = i == j ? 1 - out : out / (jl_real)(M - 1);
        if (M > 2 && !model->sticky) {
            model->Pi[i * M + (i + 1) % M] += out / (jl_real)M;
            model->Pi[i * M + (i + 2) % M] -= out / (jl_real)M;
        }
    }
}

static struct sizes_model *new_model(int c)
{
    int M = cases[c].M, n = cases[c].n, m = cases[c].m, j;
    struct sizes_model *model = calloc(1, sizeof *model);
    jl_real mem[JL_MODE_MEM(6, 3, 3)];

    bench_must(model != NULL, "memory");
    model->kalman = cases[c].kalman;
    model->M = M;
    model->n = n;
    model->m = m;
    model->sticky = cases[c].sticky;
    model->F = reals(M * n * n);
    model->W = reals(M * n * n);
    model->u = reals(M * n);
    model->H = reals(M * m * n);
    model->R = reals(M * m * m);
    model->x = reals(M * n);
    model->P = reals(M * n * n);
    model->mu = reals(M);
    model->Pi = reals(M * M);
    for (j = 0; j < M; j++) {
        jl_motion motion = motion_of(n, j);
        jl_mode mode;

        bench_must(jl_mode_init(&mode, n, m, m, mem, sizeof mem / sizeof *mem)
                   == JL_OK
                   && jl_mode_motion(&mode, &motion, 1) == JL_OK
                   && jl_motion_start(model->x + j * n, model->P + j * n * n,
                                      &motion, z[c], 100, 10) == JL_OK,
                   "a motion");
        memcpy(model->F + j * n * n, mode.F, sizeof *mem * (size_t)(n * n));
        memcpy(model->W + j * n * n, mode.W, sizeof *mem * (size_t)(n * n));
        memcpy(model->H + j * m * n, mode.H, sizeof *mem * (size_t)(m * n));
        memcpy(model->R + j * m * m, mode.R, sizeof *mem * (size_t)(m * m));
        model->mu[j] = 1 / (jl_real)M;
    }
    set_chain(model);
    return model;
}

/* A weaving path with noise. */
static void set_data(int c)
{
    int m = cases[c].m, k, i;
    unsigned r = 1;

    for (k = 0; k < STEPS; k++)
        for (i = 0; i < m; i++) {
            r = r * 1664525u + 1013904223u;
            z[c][k * m + i] = (jl_real)(50 * (i + 1) * k)
                + 300 * sin((jl_real)k / 10 + (jl_real)i)
                + (jl_real)(r >> 8) / (1 << 18) - 32;
        }
}

/* --- the same answers ---------------------------------------------------- */

/* x in units of its deviation, P_ij of those of i and j, as it was found at
 * that step; mu absolute; the log-likelihood by 1 + itself. */
static jl_real difference(int c, const struct sizes_estimate *a, jl_real la,
                          const struct sizes_estimate *b, jl_real lb)
{
    int M = cases[c].M, n = cases[c].n, i, j;
    jl_real most = fabs(la - lb) / (1 + fabs(la));

    for (i = 0; i < n; i++) {
        jl_real s = sqrt(a->P[i * (n + 1)]);

        most = fmax(most, fabs(a->x[i] - b->x[i]) / s);
        for (j = 0; j < n; j++)
            most = fmax(most, fabs(a->P[i * n + j] - b->P[i * n + j])
                              / (s * sqrt(a->P[j * (n + 1)])));
    }
    for (i = 0; i < M; i++)
        most = fmax(most, fabs(a->mu[i] - b->mu[i]));
    /* fmax drops a NaN; a sum does not. */
    for (i = 0; i < n * n; i++)
        most += 0 * (b->x[i % n] + b->P[i] + lb);
    return most;
}

/* All forms of everybody, beside the library's Joseph form. */
static void check(int c)
{
    struct sizes_filter *ours = sizes_any(new_model(c), JOSEPH);
    int k, f, w;

    for (k = 0; k < STEPS; k++) {
        const jl_real *zk = z[c] + k * cases[c].m;
        jl_real l = ours->step(ours, zk);
        struct sizes_estimate is = ours->estimate(ours);

        for (f = 0; f < SIZES_FORMS; f++)
            for (w = 0; w < WHO; w++) {
                struct sizes_filter *other = entries[c][f][w].filter;
                struct sizes_estimate is_too;
                jl_real lo;

                if (other == NULL)
                    continue;
                lo = other->step(other, zk);
                is_too = other->estimate(other);
                if (!(difference(c, &is, l, &is_too, lo) <= SAME)) {
                    fprintf(stderr, "%s, %d modes, %d states: step %d: %g\n",
                            who[w].name, cases[c].M, cases[c].n, k,
                            (double)difference(c, &is, l, &is_too, lo));
                    bench_must(0, "not the same estimate");
                }
            }
    }
}

/* --- times --------------------------------------------------------------- */

/* So that nobody's work can be left out. */
static volatile jl_real sink;

/* A run from the start; a sample is the mean of a block of steps, short enough
 * that few are interrupted. */
static void sample(int c, struct entry *entry)
{
    struct sizes_filter *f = entry->filter;
    int m = cases[c].m, block = cases[c].M > 4 ? 20 : 100, k;
    jl_real sum = 0;
    double from;

    f->start(f);
    from = clock_us();
    for (k = 0; k < STEPS; k++) {
        sum += f->step(f, z[c] + k * m);
        if ((k + 1) % block == 0) {
            double now = clock_us();

            samples_add(&entry->ns, (now - from) * 1000 / block);
            from = now;
        }
    }
    sink = sum;
}

static void time_all(void)
{
    int round, c, f, w, again;

    progress_begin("time per step");
    for (round = 0; round < ROUNDS; round++)
        for (c = 0; c < CASES; c++) {
            for (again = 0; again < 5; again++)
                for (f = 0; f < SIZES_FORMS; f++)
                    for (w = 0; w < WHO; w++)
                        if (entries[c][f][w].filter != NULL)
                            sample(c, &entries[c][f][w]);
            for (again = 0; again < 5 && c == 0; again++)
                for (w = 0; w < 2; w++)
                    sample(c, &constant_gain[w]);
            progress(round * CASES + c + 1, ROUNDS * CASES);
        }
    progress_begin(NULL);
}

/* --- results ------------------------------------------------------------- */

static const char *const form_names[] = { "standard", "joseph", "sqrt" };

static const char *case_name(int c)
{
    static char name[40];
    const char *kind = cases[c].kalman ? "Kalman filter"
        : cases[c].sticky ? "IMM, sticky" : "IMM";

    if (cases[c].kalman)
        snprintf(name, sizeof name, "%s %d/%d", kind, cases[c].n, cases[c].m);
    else
        snprintf(name, sizeof name, "%s %dx%dx%d", kind, cases[c].M,
                 cases[c].n, cases[c].m);
    return name;
}

static void print_constant_gain(FILE *csv)
{
    static const char *const what[] = { "constant-gain IMM",
                                        "... and loglik" };
    struct samples *unit = &entries[0][STANDARD][0].ns;
    int w;

    for (w = 0; w < 2; w++) {
        struct samples *s = &constant_gain[w].ns;
        double least = samples_least(s) / samples_least(unit);
        double median = samples_median(s) / samples_median(unit);

        printf("%-20s %-9s %-20s %8.1f %6.2f %8.1f %6.2f\n", case_name(0),
               "", what[w], samples_least(s), least, samples_median(s), median);
        fprintf(csv, "cgimm,0,%d,%d,%d,,\"%s\",%.2f,%.2f,%.3f,%.3f\n",
                cases[0].M, cases[0].n, cases[0].m, what[w], samples_least(s),
                samples_median(s), least, median);
    }
}

static void print_table(FILE *csv)
{
    int c, f, w;

    printf("A step, ns, and in units of Eigen's:\n%-20s %-9s %-20s %8s %6s "
           "%8s %6s\n", "modes x states x z", "form", "", "least", "", "median",
           "");
    fprintf(csv, "kind,sticky,modes,states,measured,form,by,least_ns,"
            "median_ns,least_ratio,median_ratio\n");
    for (c = 0; c < CASES; c++)
        for (f = 0; f < SIZES_FORMS; f++)
            for (w = 0; w < WHO; w++) {
                struct samples *s = &entries[c][f][w].ns;
                struct samples *unit = &entries[c][f == SQRT ? STANDARD : f][0].ns;
                double least, median;

                if (s->count == 0)
                    continue;
                least = samples_least(s) / samples_least(unit);
                median = samples_median(s) / samples_median(unit);
                printf("%-20s %-9s %-20s %8.1f %6.2f %8.1f %6.2f\n",
                       case_name(c), form_names[f], who[w].name,
                       samples_least(s), least, samples_median(s), median);
                fprintf(csv, "%s,%d,%d,%d,%d,%s,\"%s\",%.2f,%.2f,%.3f,%.3f\n",
                        cases[c].kalman ? "kf" : "imm", cases[c].sticky,
                        cases[c].M, cases[c].n, cases[c].m, form_names[f],
                        who[w].name, samples_least(s), samples_median(s),
                        least, median);
            }
}

int main(int argc, char **argv)
{
    struct out_file csv;
    int c, f, w;

    for (c = 0; c < CASES; c++) {
        set_data(c);
        for (f = 0; f < SIZES_FORMS; f++)
            for (w = 0; w < WHO; w++)
                entries[c][f][w].filter = who[w].make(new_model(c),
                                                      (enum sizes_form)f);
        check(c);
    }
    for (w = 0; w < 2; w++)
        constant_gain[w].filter = sizes_constant_gain(new_model(0), w);
    time_all();
    bench_open(&csv, argc, argv, "sizes.csv");
    print_table(csv.stream);
    print_constant_gain(csv.stream);
    bench_close(&csv);
    return 0;
}
