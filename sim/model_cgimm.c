/* Models of kind cgimm: gains instead of covariances.
 *
 * At the top T, R, Pi, mu0, modes, and axes (default 1).  A mode has its start
 * x0 [n], n = axes times the largest order, axis by axis (or none has: then all
 * start at the first measurement, at rest), and its gains: w0,
 * winf, kc (alpha, beta and, with order 3, gamma / 2), or none of them, and
 * then they follow from its order and the top's Q.  n, m, Phi say nothing new,
 * and must agree. */
#include <stdlib.h>
#include <string.h>

#include "jumplink/cgimm.h"
#include "model_parts.h"

static int is_order_3(const struct json_at *mode)
{
    const json_t *winf = json_object_get(mode->object, "winf");

    return json_array_size(winf) > 2
        && json_number_value(json_array_get(winf, 2)) > 0;
}

/* `order`, or what the gains say: those of order 2 have no third, or 0. */
static int take_order(int *order, const struct json_at *mode)
{
    if (json_has(mode, "order"))
        return json_take_count(order, mode, "order", 2, 3);
    if (!json_has(mode, "winf"))
        return json_wrong(mode, "order", "missing, and no winf either");
    *order = is_order_3(mode) ? 3 : 2;
    return 0;
}

/* --- gains --------------------------------------------------------------- */

/* w [order]; a third of order 2 has to be `third` or less. */
static int take_gains(jl_real *w, const struct json_at *mode, const char *key,
                      int order, jl_real third)
{
    const json_t *array = json_object_get(mode->object, key);
    jl_real v[3];
    int i, n = order;

    if (order == 2 && json_array_size(array) == 3)
        n = 3;
    if (json_take_vector(v, mode, key, n, JL_LARGE) != 0)
        return -1;
    for (i = 0; i < n; i++) {
        char element[32];

        snprintf(element, sizeof element, "%s[%d]", key, i);
        if (v[i] < 0)
            return json_wrong(mode, element, "%.9g: must not be negative",
                              (double)v[i]);
        if (i >= order && v[i] > third)
            return json_wrong(mode, element, "%.9g, but the mode has order 2",
                              (double)v[i]);
    }
    memcpy(w, v, (size_t)order * sizeof *w);
    return 0;
}

static int read_gains(jl_cg_gains *g, const struct json_at *mode,
                      jl_real T, jl_real R)
{
    jl_real P[9];

    if (take_gains(g->start, mode, "w0", g->order, 0) != 0
        || take_gains(g->steady, mode, "winf", g->order, 0) != 0
        || take_gains(g->k, mode, "kc", g->order, JL_LARGE) != 0)
        return -1;
    if (!(g->start[0] > 0 && g->start[0] <= 1))
        return json_wrong(mode, "w0[0]", "%.9g: alpha at the start must be "
                          "above 0, and 1 at most", (double)g->start[0]);
    return jl_cg_cov(P, g->steady, g->order, T, R) == JL_OK ? 0
        : json_wrong(mode, "winf", "gains of no stable filter");
}

/* By the tracking index. */
static int design_gains(jl_cg_gains *g, const struct json_at *top, int i,
                        int M, jl_real T, jl_real R)
{
    jl_real Q[JL_MAX_MODES];
    char element[32];
    int status;

    if (json_take_vector(Q, top, "Q", M, JL_LARGE) != 0)
        return -1;
    status = jl_cg_design(g, g->order, T, Q[i], R);
    snprintf(element, sizeof element, "Q[%d]", i);
    return status == JL_OK ? 0
        : json_wrong(top, element, "%.9g: T^2 sqrt(Q / R) must be from 1e-6 "
                     "to 1e6", (double)Q[i]);
}

static int take_mode_gains(struct model *model, const struct json_at *top,
                           const struct json_at *mode, int i)
{
    jl_cg_gains *g = &model->gains[i];

    if (json_has(mode, "w0") || json_has(mode, "winf") || json_has(mode, "kc"))
        return read_gains(g, mode, model->T, model->R);
    return design_gains(g, top, i, model->M, model->T, model->R);
}

/* --- what must agree ----------------------------------------------------- */

static int agrees(jl_real got, jl_real want)
{
    jl_real room = 64 * JL_EPSILON * want;

    return got >= want - room && got <= want + room;
}

/* Phi [n,n], if it is there, moves as the mode does: over T at constant
 * velocity, or, with order 3, acceleration. */
static int check_Phi(const struct model *model, const struct json_at *mode,
                     int order)
{
    const jl_real T = model->T, F[3][3] = {
        { 1, T, T * T / 2 }, { 0, 1, T }, { 0, 0, 1 }
    };
    int n = model->n, step = n / model->m, i, j, error;
    jl_real *Phi;

    if (!json_has(mode, "Phi"))
        return 0;
    Phi = model_reals(n, n, 1);
    if (Phi == NULL)
        return model_no_memory(mode);
    error = json_take_matrix(Phi, mode, "Phi", n, n, JL_LARGE);
    for (i = 0; i < n && error == 0; i++)
        for (j = 0; j < n && error == 0; j++) {
            int a = i % step, b = j % step;
            jl_real want = i / step == j / step && a < order && b < order
                ? F[a][b] : 0;
            char element[32];

            snprintf(element, sizeof element, "Phi[%d][%d]", i, j);
            if (!agrees(Phi[i * n + j], want))
                error = json_wrong(mode, element, "%.9g, but with order %d and "
                                   "T it is %.9g", (double)Phi[i * n + j],
                                   order, (double)want);
        }
    free(Phi);
    return error;
}

static int take_x0(struct model *model, const struct json_at *mode, int i)
{
    int n = model->n, step = n / model->m, a, here = json_has(mode, "x0");
    jl_real *x;

    if (here != (model->x0 != NULL))
        return json_wrong(mode, "x0", "%s modes[0]: all modes have one, or "
                          "none", here ? "not in" : "missing, but in");
    if (!here)
        return 0;
    x = model->x0 + i * n;
    if (json_take_vector(x, mode, "x0", n, JL_LARGE) != 0)
        return -1;
    for (a = 2; a < n; a += step)
        if (step == 3 && model->gains[i].order == 2 && (x[a] < 0 || x[a] > 0)) {
            char element[32];

            snprintf(element, sizeof element, "x0[%d]", a);
            return json_wrong(mode, element, "%.9g, but a mode of order 2 has "
                              "no acceleration", (double)x[a]);
        }
    return 0;
}

/* --- the file ------------------------------------------------------------ */

static int take_axes(int *axes, const struct json_at *top)
{
    int m;

    *axes = 1;
    if (json_has(top, "axes") && json_take_count(axes, top, "axes", 1,
                                                 JL_MAX_STATES / 3) != 0)
        return -1;
    if (!json_has(top, "m"))
        return 0;
    if (json_take_count(&m, top, "m", 1, JL_MAX_STATES / 3) != 0)
        return -1;
    if (!json_has(top, "axes"))
        *axes = m;
    return m == *axes ? 0
        : json_wrong(top, "m", "%d, but there are %d axes", m, *axes);
}

/* n = m times the largest order. */
static int take_sizes(struct model *model, const struct json_at *top)
{
    struct json_at mode;
    int i, order = 2, n;

    if (take_axes(&model->m, top) != 0)
        return -1;
    for (i = 0; i < model->M; i++) {
        if (json_entry(&mode, top, "modes", i) != 0
            || take_order(&model->gains[i].order, &mode) != 0)
            return -1;
        if (model->gains[i].order > order)
            order = model->gains[i].order;
    }
    model->n = model->m * order;
    if (!json_has(top, "n"))
        return 0;
    if (json_take_count(&n, top, "n", 1, JL_MAX_STATES) != 0)
        return -1;
    return n == model->n ? 0
        : json_wrong(top, "n", "%d, but axes and orders make %d", n, model->n);
}

static int read_mode(struct model *model, const struct json_at *top, int i)
{
    static const char *const keys[] = {
        "order", "Phi", "x0", "w0", "winf", "kc", NULL
    };
    struct json_at mode;

    return json_entry(&mode, top, "modes", i) != 0
        || json_only(&mode, keys) != 0
        || take_mode_gains(model, top, &mode, i) != 0
        || check_Phi(model, &mode, model->gains[i].order) != 0
        || take_x0(model, &mode, i) != 0 ? -1 : 0;
}

/* What is left for the library to refuse: magnitudes. */
static int try_filter(const struct model *model, const struct json_at *top)
{
    int cap = JL_CGIMM_STATE(model->M, model->m), status;
    jl_real *mem = model_reals(cap, 1, 1);
    jl_cgimm cg;

    if (mem == NULL)
        return model_no_memory(top);
    status = jl_cgimm_init(&cg, model->M, model->gains, model->m, model->T,
                           model->R, model->Pi, mem, cap);
    if (status == JL_OK && model->x0 != NULL)
        status = jl_cgimm_set(&cg, model->x0, NULL);
    free(mem);
    return status == JL_OK ? 0
        : json_wrong(top, NULL, "%s", jl_status_text(status));
}

int model_read_cgimm(struct model *model, const struct json_at *top)
{
    static const char *const keys[] = {
        "kind", "n", "m", "axes", "T", "R", "Q", "Pi", "mu0", "modes", NULL
    };
    struct json_at first;
    int i, M = model->M;

    model->gains = calloc((size_t)M, sizeof *model->gains);
    if (model->gains == NULL)
        return model_no_memory(top);
    if (json_only(top, keys) != 0
        || model_take_above_0(&model->T, top, "T", 0) != 0
        || model_take_above_0(&model->R, top, "R", 0) != 0
        || take_sizes(model, top) != 0
        || json_entry(&first, top, "modes", 0) != 0)
        return -1;
    if (json_has(&first, "x0")
        && (model->x0 = model_reals(M, model->n, 1)) == NULL)
        return model_no_memory(top);
    for (i = 0; i < M; i++)
        if (read_mode(model, top, i) != 0)
            return -1;
    return model_take_Pi(model, top) != 0 ? -1 : try_filter(model, top);
}
