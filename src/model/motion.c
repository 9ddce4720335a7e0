/* The catalogue of motions: modes for any time step. */
#include "jumplink/model.h"

#include "mat/mat_k.h"
#include "model/singer.h"
#include "model/structure.h"

static int motion_sizes(const jl_motion *motion)
{
    int order = motion->order;

    if ((order != 2 && order != 3) || motion->axes < 1
        || motion->axes > JL_MAX_STATES / order)
        return JL_EDIM;
    switch (motion->kind) {
    case JL_MOTION_CV:
        return JL_OK;
    case JL_MOTION_CA:
    case JL_MOTION_SINGER:
        return order == 3 ? JL_OK : JL_EDIM;
    case JL_MOTION_CT:
        return motion->axes == 2 ? JL_OK : JL_EDIM;
    default:
        return JL_EDIM;
    }
}

int jl_motion_noises(const jl_motion *motion)
{
    int status = motion_sizes(motion);

    if (status != JL_OK)
        return status;
    return motion->kind == JL_MOTION_SINGER ? 3 * motion->axes : motion->axes;
}

/* Everything finite, the largest element of W included: g q g', and less for
 * Singer's, as an acceleration that decays moves less. */
static int motion_numbers(const jl_motion *motion, jl_real dt)
{
    jl_real v[5], g;

    v[0] = motion->accel_std;
    v[1] = motion->sigma_z;
    v[2] = dt;
    v[3] = motion->kind == JL_MOTION_CT ? motion->turn_rate : 0;
    v[4] = motion->kind == JL_MOTION_SINGER ? motion->tau_s : 1;
    if (!jl_vec_within(v, 5, jli_sqrt(JL_LARGE)))
        return JL_ENONFINITE;
    if (v[0] < 0 || v[1] <= 0 || v[1] * v[1] < JL_REAL_MIN)
        return JL_ERANGE;               /* R must not underflow */
    if (v[4] <= 0 || v[4] * jli_sqrt(JL_LARGE) < 1)
        return JL_ERANGE;               /* nor dt / tau_s overflow */
    g = (dt > 2 ? dt * dt / 2 : 2) * v[0];
    if (!jl_vec_within(&g, 1, JL_LARGE))
        return JL_ENONFINITE;
    return dt >= 0 ? JL_OK : JL_ETIME;
}

/* One axis of CV or CA in the rows and columns from `at`. */
static void straight(jl_real *F, int n, int at, int kind, jl_real dt)
{
    jl_real *row = F + at * n + at;

    row[0] = 1;
    row[1] = dt;
    row[n + 1] = 1;
    if (kind == JL_MOTION_CA) {
        row[2] = dt * dt / 2;
        row[n + 2] = dt;
        row[2 * n + 2] = 1;
    }
}

#define TWO_TURNS JL_C(12.566370614359173)      /* 4 pi */

/* An angle less whole pairs of turns, so that half of it is one less whole
 * turns.  Every difference is exact; TWO_TURNS is as good as the angle is. */
static jl_real without_turns(jl_real angle)
{
    jl_real a = jli_abs(angle), turns = TWO_TURNS;

    while (turns <= a / 2)
        turns *= 2;
    for (; turns >= TWO_TURNS; turns /= 2)
        if (turns <= a)
            a -= turns;
    return angle < 0 ? -a : a;
}

/* Velocity (vx, vy) turns by a = rate dt; the position moves along the arc:
 * dx = (sin a vx - (1 - cos a) vy) / rate.  Both quotients are written as dt
 * times a quotient of half angles, which keeps every digit for slow turns:
 * sin a / a = sinc(a/2) cos(a/2), (1 - cos a) / a = sinc(a/2) sin(a/2). */
static void turn(jl_real *F, int n, int order, jl_real rate, jl_real dt)
{
    jl_real half = rate * dt / 2, a = rate * dt, along, across;
    jl_real s = 0, c = 1, sinc, sin_a = 0, cos_a = 1;
    int x = 0, y = order;

    if (jli_abs(a) > 1024)              /* what jl_sincos takes */
        a = without_turns(a);
    (void)jl_sincos(&s, &c, a / 2);
    (void)jl_sincos(&sin_a, &cos_a, a);
    sinc = jli_abs(half) > 0 ? s / half : 1;
    along = dt * sinc * c;
    across = dt * sinc * s;
    F[x * n + x] = 1;
    F[y * n + y] = 1;
    F[x * n + x + 1] = along;
    F[x * n + y + 1] = -across;
    F[y * n + x + 1] = across;
    F[y * n + y + 1] = along;
    F[(x + 1) * n + x + 1] = cos_a;
    F[(x + 1) * n + y + 1] = -sin_a;
    F[(y + 1) * n + x + 1] = sin_a;
    F[(y + 1) * n + y + 1] = cos_a;
}

/* Noise k: g [order] of weight q in the states from `at`, and what it adds to
 * W. */
static void noise(jl_mode *mode, int k, const jl_real *g, jl_real q, int at,
                  int order)
{
    jl_real *W = mode->W + at * (mode->n + 1);
    int n = mode->n, i, j;

    mode->q[k] = q;
    jli_copy(mode->N + k * n + at, g, order);
    for (i = 0; i < order; i++)
        for (j = i; j < order; j++) {
            W[i * n + j] += g[i] * q * g[j];
            W[j * n + i] = W[i * n + j];
        }
}

/* CV, CA and CT: one noise an axis. */
static void fill_straight(jl_mode *mode, const jl_motion *motion, jl_real dt)
{
    int n = mode->n, order = motion->order, a;
    jl_real g[3], q = motion->accel_std * motion->accel_std;

    g[0] = dt * dt / 2;
    g[1] = dt;
    g[2] = motion->kind == JL_MOTION_CA ? 1 : 0;
    if (motion->kind == JL_MOTION_CT)
        turn(mode->F, n, order, motion->turn_rate, dt);
    for (a = 0; a < motion->axes; a++) {
        if (motion->kind != JL_MOTION_CT)
            straight(mode->F, n, a * order, motion->kind, dt);
        noise(mode, a, g, q, a * order, order);
    }
}

static void fill_singer(jl_mode *mode, const jl_motion *motion, jl_real dt)
{
    jl_real F[9], N[9], q[3];
    int n = mode->n, a, k;

    jli_singer(F, N, q, motion, dt);
    for (a = 0; a < motion->axes; a++)
        for (k = 0; k < 3; k++) {
            jli_copy(mode->F + (3 * a + k) * n + 3 * a, F + 3 * k, 3);
            noise(mode, 3 * a + k, N + 3 * k, q[k], 3 * a, 3);
        }
}

int jl_mode_motion(jl_mode *mode, const jl_motion *motion, jl_real dt)
{
    int n = mode->n, m = mode->m, p = mode->p, a, status;

    status = motion_sizes(motion);
    if (status == JL_OK
        && (n != motion->axes * motion->order || m != motion->axes
            || p != jl_motion_noises(motion)))
        status = JL_EDIM;
    if (status == JL_OK)
        status = motion_numbers(motion, dt);
    if (status != JL_OK)
        return status;

    memset(mode->F, 0, (size_t)JL_MODE_MEM(n, m, p) * sizeof *mode->F);
    if (motion->kind == JL_MOTION_SINGER)
        fill_singer(mode, motion, dt);
    else
        fill_straight(mode, motion, dt);
    for (a = 0; a < m; a++) {
        mode->H[a * n + a * motion->order] = 1;
        mode->R[a * m + a] = motion->sigma_z * motion->sigma_z;
        mode->V[a * m + a] = mode->R[a * m + a];
    }
    jli_mode_structure(mode);
    return JL_OK;
}

int jl_motion_start(jl_real *x, jl_real *P, const jl_motion *motion,
                    const jl_real *z, jl_real v0_std, jl_real a0_std)
{
    jl_real std[3];
    int n, a, i;

    std[0] = motion->sigma_z;
    std[1] = v0_std;
    std[2] = a0_std;
    if (motion_sizes(motion) != JL_OK)
        return JL_EDIM;
    if (!jl_vec_within(std, 3, JL_LARGE)
        || !jl_vec_within(z, motion->axes, JL_LARGE))
        return JL_ENONFINITE;
    if (std[0] <= 0 || std[1] <= 0 || (motion->order == 3 && std[2] <= 0))
        return JL_ERANGE;
    n = motion->axes * motion->order;
    memset(x, 0, (size_t)n * sizeof *x);
    memset(P, 0, (size_t)(n * n) * sizeof *P);
    for (a = 0; a < motion->axes; a++) {
        int at = a * motion->order;

        x[at] = z[a];
        for (i = 0; i < motion->order; i++)
            P[(at + i) * (n + 1)] = std[i] * std[i];
    }
    return JL_OK;
}
