/* The example radar.c, as it is, against an IMM written apart from the library:
 * long double, full covariances, Jacobians by hand, sigma points from a
 * Cholesky factor; and whether its filters are as good as they say, over many
 * runs. */
#include "close.h"

#include <stdint.h>

int radar_main(void);
#define main radar_main
#include "radar.c"
#undef main

typedef long double wide;

#define EPS ((double)JL_EPSILON)

/* Forms, and how the book does what they do. */
static const struct {
    const jl_kf_form *form;
    int points;                 /* sigma points; or Jacobians               */
    jl_real kappa;
} forms[] = {
    { &jl_kf_joseph, 0, 0 },
    { &jl_kf_standard, 0, 0 },
    { &jl_kf_sqrt, 0, 0 },
    { &jl_kf_unscented, 1, 0 },
    { &jl_kf_unscented, 1, 1 }
};
enum { FORMS = sizeof forms / sizeof *forms };

/* --- the book: model ------------------------------------------------------ */

static const wide t = T, ra = SIGMA_ACCEL, rr = SIGMA_RATE;
static const wide any_rate = SIGMA_ANY_RATE;

static int size(int mode)
{
    return mode == STRAIGHT ? 4 : 5;
}

/* sin(w t) / w, (1 - cos(w t)) / w, and their derivatives by w. */
static void arc(wide w, wide *s, wide *c, wide *ds, wide *dc)
{
    wide a = w * t;

    if (fabsl(a) < 1e-4L) {
        *s = t * (1 - a * a / 6);
        *c = t * (a / 2 - a * a * a / 24);
        *ds = -t * t * (a / 3 - a * a * a / 30);
        *dc = t * t * (0.5L - a * a / 8);
    } else {
        *s = sinl(a) / w;
        *c = (1 - cosl(a)) / w;
        *ds = (t * cosl(a) - *s) / w;
        *dc = (t * sinl(a) - *c) / w;
    }
}

static void book_f(wide *y, int mode, const wide *x)
{
    wide w = mode == STRAIGHT ? 0 : x[RATE], s, c, ds, dc;

    arc(w, &s, &c, &ds, &dc);
    y[X] = x[X] + s * x[VX] - c * x[VY];
    y[Y] = x[Y] + c * x[VX] + s * x[VY];
    y[VX] = cosl(w * t) * x[VX] - sinl(w * t) * x[VY];
    y[VY] = sinl(w * t) * x[VX] + cosl(w * t) * x[VY];
    if (mode == TURN)
        y[RATE] = x[RATE];
}

static void book_F(wide F[N][N], int mode, const wide *x)
{
    wide w = mode == STRAIGHT ? 0 : x[RATE], s, c, ds, dc;

    arc(w, &s, &c, &ds, &dc);
    memset(F, 0, N * N * sizeof(wide));
    F[X][X] = F[Y][Y] = F[RATE][RATE] = 1;
    F[X][VX] = F[Y][VY] = s;
    F[Y][VX] = c;
    F[X][VY] = -c;
    F[VX][VX] = F[VY][VY] = cosl(w * t);
    F[VY][VX] = sinl(w * t);
    F[VX][VY] = -sinl(w * t);
    F[X][RATE] = ds * x[VX] - dc * x[VY];
    F[Y][RATE] = dc * x[VX] + ds * x[VY];
    F[VX][RATE] = -t * (sinl(w * t) * x[VX] + cosl(w * t) * x[VY]);
    F[VY][RATE] = t * (cosl(w * t) * x[VX] - sinl(w * t) * x[VY]);
}

static void book_add_noise(wide P[N][N])
{
    int i, j, axis;
    const wide g[2] = { t * t / 2, t };

    for (axis = X; axis <= Y; axis += Y)
        for (i = 0; i < 2; i++)
            for (j = 0; j < 2; j++)
                P[axis + i][axis + j] += g[i] * g[j] * ra * ra;
    P[RATE][RATE] += rr * rr;
}

static void book_h(wide *z, const wide *x)
{
    z[RANGE] = hypotl(x[X], x[Y]);
    z[BEARING] = atan2l(x[Y], x[X]);
}

static void book_H(wide H[Z][N], const wide *x)
{
    wide r = hypotl(x[X], x[Y]);

    memset(H, 0, Z * N * sizeof(wide));
    H[RANGE][X] = x[X] / r;
    H[RANGE][Y] = x[Y] / r;
    H[BEARING][X] = -x[Y] / (r * r);
    H[BEARING][Y] = x[X] / (r * r);
}

static void book_difference(wide *d, const wide *a, const wide *b)
{
    const wide turn_about = 2 * acosl(-1);

    d[RANGE] = a[RANGE] - b[RANGE];
    d[BEARING] = a[BEARING] - b[BEARING];
    d[BEARING] -= turn_about * floorl(d[BEARING] / turn_about + 0.5L);
}

/* --- the book: filters ---------------------------------------------------- */

struct book {
    wide x[M][N], P[M][N][N], mu[M];
    wide xhat[N], Phat[N][N], loglik;
    int points;
    wide kappa;
};

/* The points x, x + a column of sqrt(n + kappa) L, x - a column, of P = L L';
 * returns how many, and their weights. */
static int sigma_points(wide points[2 * N + 1][N], wide *w, const wide *x,
                        wide P[N][N], wide kappa, int n)
{
    wide L[N][N] = { { 0 } };
    int i, j, k;

    for (j = 0; j < n; j++)
        for (i = j; i < n; i++) {
            wide s = P[i][j];

            for (k = 0; k < j; k++)
                s -= L[i][k] * L[j][k];
            L[i][j] = i == j ? sqrtl(s) : s / L[j][j];
        }
    for (k = 0; k <= 2 * n; k++) {
        w[k] = k == 0 ? kappa / (n + kappa) : 1 / (2 * (n + kappa));
        for (i = 0; i < n; i++)
            points[k][i] = x[i] + (k == 0 ? 0 : k <= n
                ? sqrtl(n + kappa) * L[i][k - 1]
                : -sqrtl(n + kappa) * L[i][k - n - 1]);
    }
    return 2 * n + 1;
}

static void predict_by_points(wide *x, wide P[N][N], int mode, wide kappa)
{
    wide at[2 * N + 1][N], to[2 * N + 1][N], w[2 * N + 1];
    int n = size(mode), i, j, k, count;

    count = sigma_points(at, w, x, P, kappa, n);
    memset(x, 0, N * sizeof *x);
    memset(P, 0, N * N * sizeof(wide));
    for (k = 0; k < count; k++) {
        book_f(to[k], mode, at[k]);
        for (i = 0; i < n; i++)
            x[i] += w[k] * to[k][i];
    }
    for (k = 0; k < count; k++)
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                P[i][j] += w[k] * (to[k][i] - x[i]) * (to[k][j] - x[j]);
}

static void predict_by_jacobian(wide *x, wide P[N][N], int mode)
{
    wide F[N][N], y[N], T2[N][N];
    int n = size(mode), i, j, k;

    book_F(F, mode, x);
    book_f(y, mode, x);
    memcpy(x, y, (size_t)n * sizeof *x);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            for (T2[i][j] = 0, k = 0; k < n; k++)
                T2[i][j] += F[i][k] * P[k][j];
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            for (P[i][j] = 0, k = 0; k < n; k++)
                P[i][j] += T2[i][k] * F[j][k];
}

/* Mean of h, its covariance (without R) and that with x. */
static void sense_by_points(wide *mean, wide S[Z][Z], wide C[N][Z],
                            const wide *x, wide P[N][N], wide kappa, int n)
{
    wide at[2 * N + 1][N], d[2 * N + 1][Z], w[2 * N + 1], centre[Z];
    wide shift[Z] = { 0 };
    int i, j, k, count = sigma_points(at, w, x, P, kappa, n);

    book_h(centre, x);
    for (k = 0; k < count; k++) {
        book_h(d[k], at[k]);
        book_difference(d[k], d[k], centre);
        for (i = 0; i < Z; i++)
            shift[i] += w[k] * d[k][i];
    }
    for (i = 0; i < Z; i++)
        mean[i] = centre[i] + shift[i];
    for (k = 0; k < count; k++)
        for (j = 0; j < Z; j++) {
            for (i = 0; i < Z; i++)
                S[i][j] += w[k] * (d[k][i] - shift[i]) * (d[k][j] - shift[j]);
            for (i = 0; i < n; i++)
                C[i][j] += w[k] * (at[k][i] - x[i]) * (d[k][j] - shift[j]);
        }
}

static void sense_by_jacobian(wide *mean, wide S[Z][Z], wide C[N][Z],
                              const wide *x, wide P[N][N], int n)
{
    wide H[Z][N];
    int i, j, k;

    book_h(mean, x);
    book_H(H, x);
    for (i = 0; i < n; i++)
        for (j = 0; j < Z; j++)
            for (k = 0; k < n; k++)
                C[i][j] += P[i][k] * H[j][k];
    for (i = 0; i < Z; i++)
        for (j = 0; j < Z; j++)
            for (k = 0; k < n; k++)
                S[i][j] += H[i][k] * C[k][j];
}

/* Returns the log-likelihood; *nis is nu' S^-1 nu. */
static wide book_update(const struct book *b, wide *x, wide P[N][N], int n,
                        const jl_real *given, wide *nis)
{
    wide z[Z] = { given[0], given[1] }, mean[Z], S[Z][Z] = { { 0 } };
    wide C[N][Z] = { { 0 } }, K[N][Z], nu[Z], det, inverse[Z][Z];
    int i, j;

    if (b->points)
        sense_by_points(mean, S, C, x, P, b->kappa, n);
    else
        sense_by_jacobian(mean, S, C, x, P, n);
    S[RANGE][RANGE] += (wide)SIGMA_RANGE * SIGMA_RANGE;
    S[BEARING][BEARING] += (wide)SIGMA_BEARING * SIGMA_BEARING;
    book_difference(nu, z, mean);
    det = S[0][0] * S[1][1] - S[0][1] * S[1][0];
    inverse[0][0] = S[1][1] / det;
    inverse[1][1] = S[0][0] / det;
    inverse[0][1] = inverse[1][0] = -S[0][1] / det;
    for (i = 0; i < n; i++)
        for (j = 0; j < Z; j++)
            K[i][j] = C[i][0] * inverse[0][j] + C[i][1] * inverse[1][j];
    for (i = 0; i < n; i++) {
        x[i] += K[i][0] * nu[0] + K[i][1] * nu[1];
        for (j = 0; j < n; j++)
            P[i][j] -= K[i][0] * C[j][0] + K[i][1] * C[j][1];
    }
    for (*nis = 0, i = 0; i < Z; i++)
        for (j = 0; j < Z; j++)
            *nis += nu[i] * inverse[i][j] * nu[j];
    return -(2 * logl(2 * acosl(-1)) + logl(det) + *nis) / 2;
}

static void book_predict(const struct book *b, wide *x, wide P[N][N],
                         int mode)
{
    if (b->points)
        predict_by_points(x, P, mode, b->kappa);
    else
        predict_by_jacobian(x, P, mode);
    book_add_noise(P);
}

/* Straight flight lacks the rate of a turn. */
static void forget_rate(wide *x, wide P[N][N])
{
    int i;

    for (i = 0; i < N; i++)
        P[i][RATE] = P[RATE][i] = 0;
    x[RATE] = 0;
    P[RATE][RATE] = any_rate * any_rate;
}

/* Mean and covariance of a mixture of the modes. */
static void book_mix(wide *mean, wide P[N][N], const struct book *b,
                     const wide *w)
{
    int i, r, s;

    memset(mean, 0, N * sizeof *mean);
    memset(P, 0, N * N * sizeof(wide));
    for (i = 0; i < M; i++)
        for (r = 0; r < N; r++)
            mean[r] += w[i] * b->x[i][r];
    for (i = 0; i < M; i++)
        for (r = 0; r < N; r++)
            for (s = 0; s < N; s++)
                P[r][s] += w[i] * (b->P[i][r][s] + (b->x[i][r] - mean[r])
                                   * (b->x[i][s] - mean[s]));
}

static void book_step(struct book *b, const jl_real *z)
{
    static const wide Pi[M][M] = { { 0.98L, 0.02L }, { 0.04L, 0.96L } };
    struct book old = *b;
    wide c[M], l[M], w[M], nis, sum = 0;
    int i, j;

    for (j = 0; j < M; j++) {
        c[j] = Pi[0][j] * old.mu[0] + Pi[1][j] * old.mu[1];
        for (i = 0; i < M; i++)
            w[i] = Pi[i][j] * old.mu[i] / c[j];
        book_mix(b->x[j], b->P[j], &old, w);
        book_predict(b, b->x[j], b->P[j], j);
        l[j] = book_update(b, b->x[j], b->P[j], size(j), z, &nis);
        if (j == STRAIGHT)
            forget_rate(b->x[j], b->P[j]);
        sum += c[j] * expl(l[j]);
    }
    for (j = 0; j < M; j++)
        b->mu[j] = c[j] * expl(l[j]) / sum;
    b->loglik = logl(sum);
    book_mix(b->xhat, b->Phat, b, b->mu);
}

static void book_start(struct book *b, const struct track *track, int points,
                       wide kappa)
{
    jl_real P[N * N];
    int i, j, k;

    b->points = points;
    b->kappa = kappa;
    for (j = 0; j < M; j++) {
        jl_imm_cov(&track->imm, j, P);
        b->mu[j] = track->imm.mu[j];
        for (i = 0; i < N; i++) {
            b->x[j][i] = track->imm.x[j * N + i];
            for (k = 0; k < N; k++)
                b->P[j][i][k] = P[i * N + k];
        }
    }
}

/* --- the example is the book ---------------------------------------------- */

static double worst;

static void check_within(wide got, wide want, wide unit, double within)
{
    double off = (double)(fabsl(got - want) / unit);

    worst = fmax(worst, off);
    assert_close(got / unit, want / unit, within);
}

static void compare(const jl_imm *imm, const struct book *b, double within)
{
    jl_real P[N * N];
    int i, j, k;

    for (j = 0; j <= M; j++) {
        const jl_real *x = j < M ? imm->x + j * N : imm->xhat;
        const wide *bx = j < M ? b->x[j] : b->xhat;
        const wide (*bP)[N] = (const wide (*)[N])(j < M ? b->P[j] : b->Phat);

        if (j < M)
            jl_imm_cov(imm, j, P);
        else
            memcpy(P, imm->Phat, sizeof P);
        for (i = 0; i < N; i++) {
            check_within(x[i], bx[i], sqrtl(bP[i][i]), within);
            for (k = 0; k < N; k++)
                check_within(P[i * N + k], bP[i][k],
                             sqrtl(bP[i][i] * bP[k][k]), within);
        }
    }
    for (j = 0; j < M; j++)
        check_within(imm->mu[j], b->mu[j], 1, within);
    check_within(imm->loglik, b->loglik, 1 + fabsl(b->loglik), within);
}

/* Jacobians by hand, in the library's numbers. */
static int given_F(jl_real *F, const jl_real *x, void *context)
{
    wide at[N], J[N][N];
    int i;

    (void)context;
    for (i = 0; i < N; i++)
        at[i] = x[i];
    book_F(J, TURN, at);
    for (i = 0; i < N * N; i++)
        F[i] = (jl_real)J[i / N][i % N];
    return JL_OK;
}

static int given_H(jl_real *H, const jl_real *x, int n)
{
    wide at[N], J[Z][N];
    int i;

    for (i = 0; i < n; i++)
        at[i] = x[i];
    book_H(J, at);
    for (i = 0; i < Z * n; i++)
        H[i] = (jl_real)J[i / n][i % n];
    return JL_OK;
}

static int given_H4(jl_real *H, const jl_real *x, void *context)
{
    (void)context;
    return given_H(H, x, 4);
}

static int given_H5(jl_real *H, const jl_real *x, void *context)
{
    (void)context;
    return given_H(H, x, 5);
}

static void give_jacobians(int yes)
{
    turn_model.jacobian_f = yes ? given_F : NULL;
    turn_model.jacobian_h = yes ? given_H5 : NULL;
    straight_model.jacobian_h = yes ? given_H4 : NULL;
}

/* The flight of the example; returns the worst difference from the book. */
static double follow(int f, double within)
{
    static struct track track;
    static struct book book;
    jl_real x[N] = { -15000, 30, -6000, 250, 0 }, z[Z];
    int k;

    worst = 0;
    straight_model.kappa = turn_model.kappa = forms[f].kappa;
    measure(z, x);
    start(&track, forms[f].form, z);
    book_start(&book, &track, forms[f].points, forms[f].kappa);
    for (k = 1; k <= STEPS; k++) {
        fly(x, k);
        measure(z, x);
        assert_int_equal(jl_imm_step(&track.imm, z, track.scratch), JL_OK);
        book_step(&book, z);
        compare(&track.imm, &book, within);
    }
    straight_model.kappa = turn_model.kappa = 0;
    return worst;
}

static void test_radar_is_the_book(void **state)
{
    int f;

    (void)state;
    give_jacobians(1);
    for (f = 0; f < FORMS; f++)
        print_message("form %d: %.1e of a deviation\n", f,
                      follow(f, 1e4 * EPS));
    give_jacobians(0);
}

/* Jacobians by differences are as good as eps^(2/3). */
static void test_radar_by_differences_is_the_book(void **state)
{
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++)
        if (!forms[f].points)
            print_message("form %d: %.1e of a deviation\n", f,
                          follow(f, 1e4 * cbrt(EPS * EPS)));
}

/* --- many runs ------------------------------------------------------------ */

/* Number i of step k of a run, from N(0, 1): two hashed uniform numbers through
 * Box and Muller's formula. */
static double hashed(uint64_t v)
{
    v += 0x9e3779b97f4a7c15u;
    v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9u;
    v = (v ^ (v >> 27)) * 0x94d049bb133111ebu;
    v ^= v >> 31;
    return ((double)(v >> 11) + 0.5) / 9007199254740992.0;
}

static jl_real normal(int run, int k, int i)
{
    uint64_t counter = ((uint64_t)run << 32 | (uint64_t)k << 8
                        | (uint64_t)i) * 2;

    return (jl_real)(sqrt(-2 * log(hashed(counter)))
                     * cos(2 * acos(-1) * hashed(counter + 1)));
}

/* A measurement of that run, with `noise` times the example's noise. */
static void measure_in(jl_real *z, const jl_real *x, jl_real noise, int run,
                       int k)
{
    assert_int_equal(radar(z, x, NULL), JL_OK);
    z[RANGE] += noise * SIGMA_RANGE * normal(run, k, 0);
    z[BEARING] += noise * SIGMA_BEARING * normal(run, k, 1);
}

/* (x - truth)' P^-1 (x - truth) */
static double nees(const jl_real *x, const jl_real *truth, const jl_real *P)
{
    jl_real L[N * N], d[N];
    double sum = 0;
    int i;

    for (i = 0; i < N; i++)
        d[i] = x[i] - truth[i];
    assert_int_equal(jl_mat_cholesky(L, P, N), JL_OK);
    jl_mat_lower_solve(L, d, N);
    for (i = 0; i < N; i++)
        sum += (double)(d[i] * d[i]);
    return sum;
}

enum { RUNS = 200, RUN_STEPS = 50 };

/* A target that does what the mode TURN says, from where the filter thinks, as
 * far as it thinks: sums of nis over all steps, and of nees over all ends. */
static void try_turns(double *nis_sum, double *nees_sum,
                      const jl_kf_form *form, jl_real noise)
{
    static const jl_real sigma[N] = { 100, 10, 100, 10, JL_C(0.01) };
    static const jl_real x0[N] = { -15000, 30, -6000, 250, JL_C(0.02) };
    static struct track track;
    jl_real mem[JL_KF_STATE(N, Z)], x[N], was[N], P[N * N] = { 0 }, z[Z];
    jl_kf kf;
    int run, k, i;

    set_modes(&track);
    for (i = 0; i < Z * Z; i++)
        track.modes[TURN].R[i] *= noise * noise;
    for (i = 0; i < Z; i++)
        track.modes[TURN].V[i * (Z + 1)] *= noise * noise;
    for (i = 0; i < N; i++)
        P[i * (N + 1)] = sigma[i] * sigma[i];
    *nis_sum = *nees_sum = 0;
    for (run = 0; run < RUNS; run++) {
        assert_int_equal(jl_kf_init(&kf, &track.modes[TURN], form, mem,
                                    JL_KF_STATE(N, Z)), JL_OK);
        assert_int_equal(jl_kf_set(&kf, x0, P, track.scratch), JL_OK);
        for (i = 0; i < N; i++)
            x[i] = x0[i] + sigma[i] * normal(run, 0, 10 + i);
        for (k = 1; k <= RUN_STEPS; k++) {
            jl_real ax = SIGMA_ACCEL * normal(run, k, 2);
            jl_real ay = SIGMA_ACCEL * normal(run, k, 3);

            memcpy(was, x, sizeof x);
            assert_int_equal(turn(x, was, NULL), JL_OK);
            x[X] += T * T / 2 * ax;
            x[VX] += T * ax;
            x[Y] += T * T / 2 * ay;
            x[VY] += T * ay;
            x[RATE] += SIGMA_RATE * normal(run, k, 4);
            measure_in(z, x, noise, run, k);
            assert_int_equal(jl_kf_step(&kf, NULL, z, track.scratch), JL_OK);
            *nis_sum += (double)kf.innovation.nis;
        }
        jl_kf_cov(&kf, track.scratch);
        *nees_sum += nees(kf.x, x, track.scratch);
    }
}

/* Deviations from the mean of chi-square with so many degrees of freedom. */
static double off_chi_square(double sum, double degrees)
{
    return (sum - degrees) / sqrt(2 * degrees);
}

static void uncertainty(double *nis_off, double *nees_off, int f,
                        jl_real noise)
{
    double nis, end;

    turn_model.kappa = forms[f].kappa;
    try_turns(&nis, &end, forms[f].form, noise);
    turn_model.kappa = 0;
    print_message("form %d: mean nis %.3f of 2, nees %.2f of 5\n", f,
                  nis / RUNS / RUN_STEPS, end / RUNS);
    *nis_off = off_chi_square(nis, 2.0 * RUNS * RUN_STEPS);
    *nees_off = off_chi_square(end, 5.0 * RUNS);
}

/* With a third of the example's noise every form is within 99.9% of what it
 * says of itself. */
static void test_radar_turns_are_as_uncertain_as_said(void **state)
{
    double nis, end;
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        uncertainty(&nis, &end, f, JL_C(0.3));
        assert_close(nis, 0, 3.29);
        assert_close(end, 0, 3.29);
    }
}

/* With all of it, only what does not linearise has the innovations it says; and
 * of the errors it is the one that is not far off. */
static void test_radar_points_are_surer_than_jacobians(void **state)
{
    double nis, end;
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        uncertainty(&nis, &end, f, 1);
        if (forms[f].points)
            assert_close(nis, 0, 3.29);
        else
            assert_true(nis > 3.29);
        assert_true(forms[f].points ? end < 6 : end > 12);
    }
}

/* The example's flight with other noise, in run after run: square errors of the
 * measured and the estimated positions. */
static void try_flights(double *raw, double *estimated, int *worse,
                        const jl_kf_form *form)
{
    static struct track track;
    jl_real x[N], z[Z], at[N], s, c;
    double raw_run, run_sum;
    int run, k;

    *raw = *estimated = 0;
    *worse = 0;
    for (run = 0; run < RUNS; run++) {
        jl_real x0[N] = { -15000, 30, -6000, 250, 0 };

        memcpy(x, x0, sizeof x);
        measure_in(z, x, 1, run, 0);
        start(&track, form, z);
        raw_run = run_sum = 0;
        for (k = 1; k <= STEPS; k++) {
            fly(x, k);
            measure_in(z, x, 1, run, k);
            assert_int_equal(jl_imm_step(&track.imm, z, track.scratch),
                             JL_OK);
            jl_sincos(&s, &c, z[BEARING]);
            at[X] = z[RANGE] * c;
            at[Y] = z[RANGE] * s;
            raw_run += pow(apart(at, x), 2);
            run_sum += pow(apart(track.imm.xhat, x), 2);
        }
        *worse += run_sum >= raw_run;
        *raw += raw_run;
        *estimated += run_sum;
    }
}

static void test_radar_estimates_beat_measurements(void **state)
{
    double raw, estimated, of_jacobians = 0;
    int f, worse;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        straight_model.kappa = turn_model.kappa = forms[f].kappa;
        try_flights(&raw, &estimated, &worse, forms[f].form);
        print_message("form %d: rms %.1f m, measured %.1f m\n", f,
                      sqrt(estimated / RUNS / STEPS),
                      sqrt(raw / RUNS / STEPS));
        assert_int_equal(worse, 0);
        assert_true(sqrt(estimated) < 0.5 * sqrt(raw));
        assert_true(!forms[f].points || estimated < of_jacobians);
        if (!forms[f].points)
            of_jacobians = estimated;
    }
    straight_model.kappa = turn_model.kappa = 0;
}

static void test_radar_runs(void **state)
{
    (void)state;
    assert_int_equal(radar_main(), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_radar_is_the_book),
        cmocka_unit_test(test_radar_by_differences_is_the_book),
        cmocka_unit_test(test_radar_turns_are_as_uncertain_as_said),
        cmocka_unit_test(test_radar_points_are_surer_than_jacobians),
        cmocka_unit_test(test_radar_estimates_beat_measurements),
        cmocka_unit_test(test_radar_runs),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
