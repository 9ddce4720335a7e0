#include "mekf_zoo.h"

#include <string.h>

#include "jumplink/mat.h"

/* --- ar1: a process of first order whose pole is not known ---------------- */

static int ar1_f(jl_real *f, const jl_real *y, void *context)
{
    (void)context;
    f[0] = y[0];
    return JL_OK;
}

static int ar1_c(jl_real *c, const jl_real *x, const jl_real *y,
                 void *context)
{
    (void)x, (void)y, (void)context;
    c[0] = 1;
    return JL_OK;
}

static int ar1_G(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
                 const jl_real *y, void *context)
{
    (void)G2, (void)x, (void)y, (void)context;
    G1[0] = 1;
    G3[0] = 1;
    return JL_OK;
}

static int ar1_df(jl_real *J, const jl_real *x, const jl_real *y,
                  void *context)
{
    (void)y, (void)context;
    J[0] = x[0];
    return JL_OK;
}

static int ar1_dc(jl_real *J, const jl_real *x, const jl_real *y,
                  void *context)
{
    (void)x, (void)y, (void)context;
    J[0] = 1;
    return JL_OK;
}

/* --- spring2: a mass on a spring of unknown stiffness --------------------- */

static int spring_f(jl_real *f, const jl_real *y, void *context)
{
    const struct mekf_zoo *zoo = context;

    f[0] = 1;
    f[1] = zoo->T;
    f[2] = -zoo->T * y[0];
    f[3] = 1 - zoo->T * zoo->d;
    return JL_OK;
}

static int spring_c(jl_real *c, const jl_real *x, const jl_real *y,
                    void *context)
{
    const struct mekf_zoo *zoo = context;

    (void)x, (void)y;
    memcpy(c, zoo->C, (size_t)(2 * zoo->r) * sizeof *c);
    return JL_OK;
}

static int spring_G(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
                    const jl_real *y, void *context)
{
    (void)G2, (void)x, (void)y, (void)context;
    G1[1] = 1;
    G3[0] = 1;
    return JL_OK;
}

static int spring_df(jl_real *J, const jl_real *x, const jl_real *y,
                     void *context)
{
    const struct mekf_zoo *zoo = context;

    (void)y;
    J[1] = -zoo->T * x[0];
    return JL_OK;
}

static int spring_dc(jl_real *J, const jl_real *x, const jl_real *y,
                     void *context)
{
    const struct mekf_zoo *zoo = context;
    int i;

    (void)x, (void)y;
    for (i = 0; i < zoo->r; i++) {
        J[3 * i] = zoo->C[2 * i];
        J[3 * i + 1] = zoo->C[2 * i + 1];
    }
    return JL_OK;
}

/* --- ct4: a coordinated turn of unknown rate ------------------------------ */

/* The turn by a = y T: S = sin a / a, C = (1 - cos a) / a, derivatives by a.
 * Differences of nearly the same are avoided by half angles, and where that
 * is no help, in the derivatives at small a, by series. */
struct turn {
    jl_real sine, cosine, S, C, dS, dC;
};

static int turn_by(struct turn *t, jl_real a)
{
    jl_real s, c, sinc, aa = a * a, half = a / 2;
    int status = jl_sincos(&s, &c, half);

    if (status != JL_OK)
        return status;
    sinc = half < 0 || half > 0 ? s / half : 1;
    t->sine = 2 * s * c;
    t->cosine = 1 - 2 * s * s;
    t->S = sinc * c;
    t->C = sinc * s;
    if (aa < JL_C(0.01)) {
        t->dS = a * (-1 / JL_C(3.0) + aa * (1 / JL_C(30.0)
                     + aa * (-1 / JL_C(840.0) + aa / 45360)));
        t->dC = JL_C(0.5) + aa * (-JL_C(0.125) + aa * (1 / JL_C(144.0)
                     + aa * (-1 / JL_C(5760.0) + aa / 403200)));
    } else {
        t->dS = (t->cosine - t->S) / a;
        t->dC = (t->sine - t->C) / a;
    }
    return JL_OK;
}

static int ct4_f(jl_real *f, const jl_real *y, void *context)
{
    const struct mekf_zoo *zoo = context;
    jl_real T = zoo->T;
    struct turn t;
    int status = turn_by(&t, y[0] * T);

    if (status != JL_OK)
        return status;
    f[0] = 1, f[1] = T * t.S, f[3] = -T * t.C;
    f[5] = t.cosine, f[7] = -t.sine;
    f[9] = T * t.C, f[10] = 1, f[11] = T * t.S;
    f[13] = t.sine, f[15] = t.cosine;
    return JL_OK;
}

static int ct4_df(jl_real *J, const jl_real *x, const jl_real *y,
                  void *context)
{
    const struct mekf_zoo *zoo = context;
    jl_real T = zoo->T, vx = x[1], vy = x[3];
    struct turn t;
    int status = turn_by(&t, y[0] * T);

    if (status != JL_OK)
        return status;
    J[0] = T * T * (t.dS * vx - t.dC * vy);
    J[1] = T * (-t.sine * vx - t.cosine * vy);
    J[2] = T * T * (t.dC * vx + t.dS * vy);
    J[3] = T * (t.cosine * vx - t.sine * vy);
    return JL_OK;
}

static int ct4_G(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
                 const jl_real *y, void *context)
{
    const struct mekf_zoo *zoo = context;

    (void)G2, (void)x, (void)y;
    G1[0] = G1[5] = zoo->T * zoo->T / 2;
    G1[2] = G1[7] = zoo->T;
    G3[0] = 1;
    return JL_OK;
}

static int ct4pos_c(jl_real *c, const jl_real *x, const jl_real *y,
                    void *context)
{
    (void)x, (void)y, (void)context;
    c[0] = 1;
    c[6] = 1;
    return JL_OK;
}

static int ct4pos_dc(jl_real *J, const jl_real *x, const jl_real *y,
                     void *context)
{
    (void)x, (void)y, (void)context;
    J[0] = 1;
    J[7] = 1;
    return JL_OK;
}

/* Range q and px / q, py / q, as c x. */
static int ct4rdc_c(jl_real *c, const jl_real *x, const jl_real *y,
                    void *context)
{
    jl_real q = jl_sqrt(x[0] * x[0] + x[2] * x[2]);

    (void)y, (void)context;
    if (!(q > 0))
        return JL_ERANGE;
    c[0] = x[0] / q;
    c[2] = x[2] / q;
    c[4] = 1 / q;
    c[10] = 1 / q;
    return JL_OK;
}

static int ct4rdc_dc(jl_real *J, const jl_real *x, const jl_real *y,
                     void *context)
{
    jl_real q = jl_sqrt(x[0] * x[0] + x[2] * x[2]), u, v;

    (void)y, (void)context;
    if (!(q > 0))
        return JL_ERANGE;
    u = x[0] / q;
    v = x[2] / q;
    J[0] = u;
    J[2] = v;
    J[5] = v * v / q;
    J[7] = -u * v / q;
    J[10] = -u * v / q;
    J[12] = u * u / q;
    return JL_OK;
}

/* --- gen32: everything depends on everything ------------------------------ */

static int gen_f(jl_real *f, const jl_real *y, void *context)
{
    const struct mekf_zoo *zoo = context;
    jl_real s, c;
    int i, status = jl_sincos(&s, &c, y[1]);

    if (status != JL_OK)
        return status;
    for (i = 0; i < 9; i++)
        f[i] = zoo->A0[i] + y[0] * zoo->A1[i] + s * zoo->A2[i];
    return JL_OK;
}

static int gen_df(jl_real *J, const jl_real *x, const jl_real *y,
                  void *context)
{
    const struct mekf_zoo *zoo = context;
    jl_real s, c, A1x[3], A2x[3];
    int i, status = jl_sincos(&s, &c, y[1]);

    if (status != JL_OK)
        return status;
    jl_mat_apply(A1x, zoo->A1, x, NULL, 3, 3);
    jl_mat_apply(A2x, zoo->A2, x, NULL, 3, 3);
    for (i = 0; i < 3; i++) {
        J[2 * i] = A1x[i];
        J[2 * i + 1] = c * A2x[i];
    }
    return JL_OK;
}

/* Sines and cosines of x1 and y1. */
static int angles(jl_real *sx, jl_real *cx, jl_real *sy, jl_real *cy,
                  const jl_real *x, const jl_real *y)
{
    int status = jl_sincos(sx, cx, x[0]);

    return status != JL_OK ? status : jl_sincos(sy, cy, y[0]);
}

static int gen_h(jl_real *y_next, const jl_real *x, const jl_real *y,
                 void *context)
{
    const struct mekf_zoo *zoo = context;
    jl_real sx, cx, sy, cy;
    int status = angles(&sx, &cx, &sy, &cy, x, y);

    if (status != JL_OK)
        return status;
    y_next[0] = zoo->a1 * y[0] + zoo->b1 * sx;
    y_next[1] = zoo->a2 * y[1] + zoo->b2 * x[1] * cy;
    return JL_OK;
}

static int gen_dh(jl_real *J, const jl_real *x, const jl_real *y,
                  void *context)
{
    const struct mekf_zoo *zoo = context;
    jl_real sx, cx, sy, cy;
    int status = angles(&sx, &cx, &sy, &cy, x, y);

    if (status != JL_OK)
        return status;
    J[0] = zoo->b1 * cx;
    J[3] = zoo->a1;
    J[6] = zoo->b2 * cy;
    J[8] = -zoo->b2 * x[1] * sy;
    J[9] = zoo->a2;
    return JL_OK;
}

static int gen_c(jl_real *c, const jl_real *x, const jl_real *y,
                 void *context)
{
    const struct mekf_zoo *zoo = context;
    jl_real sx, cx;
    int i, status = jl_sincos(&sx, &cx, x[0]);

    if (status != JL_OK)
        return status;
    for (i = 0; i < 6; i++)
        c[i] = zoo->C0[i] + y[0] * zoo->C1[i] + cx * zoo->C2[i];
    return JL_OK;
}

static int gen_dc(jl_real *J, const jl_real *x, const jl_real *y,
                  void *context)
{
    const struct mekf_zoo *zoo = context;
    jl_real sx, cx, c[6], C1x[2], C2x[2];
    int i, k, status = jl_sincos(&sx, &cx, x[0]);

    if (status != JL_OK)
        return status;
    status = gen_c(c, x, y, context);
    jl_mat_apply(C1x, zoo->C1, x, NULL, 2, 3);
    jl_mat_apply(C2x, zoo->C2, x, NULL, 2, 3);
    for (i = 0; i < 2; i++) {
        for (k = 0; k < 3; k++)
            J[5 * i + k] = c[3 * i + k];
        J[5 * i] -= sx * C2x[i];
        J[5 * i + 3] = C1x[i];
    }
    return status;
}

static int gen_G(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
                 const jl_real *y, void *context)
{
    const struct mekf_zoo *zoo = context;
    jl_real sx, cx, sy, cy;
    int i, status = angles(&sx, &cx, &sy, &cy, x, y);

    if (status != JL_OK)
        return status;
    for (i = 0; i < 6; i++)
        G1[i] = (1 + zoo->g * sx) * zoo->B1[i];
    for (i = 0; i < 4; i++)
        G2[i] = (1 + zoo->g * cy) * zoo->B2[i];
    memcpy(G3, zoo->B3, sizeof zoo->B3);
    return JL_OK;
}

/* --- by name -------------------------------------------------------------- */

static const struct entry {
    const char *name;
    jl_mekf_model model;
} entries[] = {
    { "ar1", { 1, 1, 1, 1, 1, ar1_f, NULL, ar1_c, ar1_G,
               ar1_df, NULL, ar1_dc, NULL } },
    { "spring2", { 2, 1, 1, 1, 1, spring_f, NULL, spring_c, spring_G,
                   spring_df, NULL, spring_dc, NULL } },
    { "ct4pos", { 4, 1, 2, 2, 1, ct4_f, NULL, ct4pos_c, ct4_G,
                  ct4_df, NULL, ct4pos_dc, NULL } },
    { "ct4rdc", { 4, 1, 3, 2, 1, ct4_f, NULL, ct4rdc_c, ct4_G,
                  ct4_df, NULL, ct4rdc_dc, NULL } },
    { "gen32", { 3, 2, 2, 2, 1, gen_f, gen_h, gen_c, gen_G,
                 gen_df, gen_dh, gen_dc, NULL } }
};

int mekf_zoo_model(jl_mekf_model *model, const char *name,
                   struct mekf_zoo *zoo)
{
    size_t i;

    for (i = 0; i < sizeof entries / sizeof *entries; i++) {
        if (strcmp(entries[i].name, name) != 0)
            continue;
        if (entries[i].model.f == spring_f && (zoo->r < 1 || zoo->r > ZOO_R))
            return -1;
        *model = entries[i].model;
        if (model->f == spring_f)
            model->r = zoo->r;
        model->context = zoo;
        return 0;
    }
    return -1;
}
