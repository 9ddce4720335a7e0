/* The catalogue of motions: modes for any time step. */
#include "jumplink/model.h"

#include "mat/mat_k.h"

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
        return order == 3 ? JL_OK : JL_EDIM;
    case JL_MOTION_CT:
        return motion->axes == 2 ? JL_OK : JL_EDIM;
    default:
        return JL_EDIM;
    }
}

/* Everything finite, the largest element of W = g q g' included. */
static int motion_numbers(const jl_motion *motion, jl_real dt)
{
    jl_real v[4], g;

    v[0] = motion->accel_std;
    v[1] = motion->sigma_z;
    v[2] = dt;
    v[3] = motion->kind == JL_MOTION_CT ? motion->turn_rate : 0;
    if (!jl_vec_within(v, 4, jli_sqrt(JL_LARGE)))
        return JL_ENONFINITE;
    if (v[0] < 0 || v[1] <= 0 || v[1] * v[1] < JL_REAL_MIN)
        return JL_ERANGE;               /* R must not underflow */
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

/* Velocity (vx, vy) turns by a = rate dt; the position moves along the arc:
 * dx = (sin a vx - (1 - cos a) vy) / rate.  Both quotients are written as dt
 * times a quotient of half angles, which keeps every digit for slow turns:
 * sin a / a = sinc(a/2) cos(a/2), (1 - cos a) / a = sinc(a/2) sin(a/2). */
static int turn(jl_real *F, int n, int order, jl_real rate, jl_real dt)
{
    jl_real half = rate * dt / 2, s, c, sinc, along, across, sin_a, cos_a;
    int x = 0, y = order;

    if (jl_sincos(&s, &c, half) != JL_OK
        || jl_sincos(&sin_a, &cos_a, rate * dt) != JL_OK)
        return JL_ERANGE;
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
    return JL_OK;
}

int jl_mode_motion(jl_mode *mode, const jl_motion *motion, jl_real dt)
{
    int n = mode->n, axes = motion->axes, order = motion->order;
    int i, j, a, status;
    jl_real g[3], q = motion->accel_std * motion->accel_std;

    status = motion_sizes(motion);
    if (status == JL_OK && (n != axes * order || mode->m != axes
                            || mode->p != axes))
        status = JL_EDIM;
    if (status == JL_OK)
        status = motion_numbers(motion, dt);
    if (status == JL_OK && motion->kind == JL_MOTION_CT
        && jli_abs(motion->turn_rate * dt) > 1024)
        status = JL_ERANGE;
    if (status != JL_OK)
        return status;

    memset(mode->F, 0,
           (size_t)JL_MODE_MEM(n, mode->m, mode->p) * sizeof *mode->F);
    if (motion->kind == JL_MOTION_CT)
        (void)turn(mode->F, n, order, motion->turn_rate, dt);
    g[0] = dt * dt / 2;
    g[1] = dt;
    g[2] = motion->kind == JL_MOTION_CA ? 1 : 0;
    for (a = 0; a < axes; a++) {
        int at = a * order;

        if (motion->kind != JL_MOTION_CT)
            straight(mode->F, n, at, motion->kind, dt);
        mode->H[a * n + at] = 1;
        mode->R[a * axes + a] = motion->sigma_z * motion->sigma_z;
        mode->V[a * axes + a] = mode->R[a * axes + a];
        mode->q[a] = q;
        for (i = 0; i < order; i++) {
            mode->N[a * n + at + i] = g[i];
            for (j = 0; j < order; j++)
                mode->W[(at + i) * n + at + j] = g[i] * q * g[j];
        }
    }
    for (i = 0; i < n; i++)             /* (g q) h may differ from (h q) g */
        for (j = 0; j < i; j++)
            mode->W[i * n + j] = mode->W[j * n + i];
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
