#include "model_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "complain.h"
#include "model_parts.h"

/* Covariances go up to the square of what states may be. */
#define LARGE_COV (JL_LARGE * JL_LARGE)

int model_no_memory(const struct json_at *at)
{
    return complain(at->file, 0, NULL, "out of memory");
}

jl_real *model_reals(int n, int m, int k)
{
    return calloc((size_t)n * (size_t)m * (size_t)k, sizeof(jl_real));
}

/* --- covariances and probabilities ------------------------------------- */

/* Name the worst pair of a matrix that is not symmetric. */
static int asymmetric(const jl_real *A, const struct json_at *at,
                      const char *key, int n)
{
    char element[100];
    int i, j, row = 0, column = 0;
    jl_real worst = -1;

    for (i = 0; i < n; i++)
        for (j = i + 1; j < n; j++) {
            jl_real d = A[i * n + j] - A[j * n + i];

            if (d < 0)
                d = -d;
            if (d > worst) {
                worst = d;
                row = i;
                column = j;
            }
        }
    snprintf(element, sizeof element, "%s[%d][%d]", key, row, column);
    return json_wrong(at, element, "%.9g, but [%d][%d] is %.9g: %s",
                      (double)A[row * n + column], column, row,
                      (double)A[column * n + row], jl_status_text(JL_EASYM));
}

int model_take_cov(jl_real *A, const struct json_at *at, const char *key,
                   int n, int definite)
{
    jl_real *work;
    int status;

    if (json_take_matrix(A, at, key, n, n, LARGE_COV) != 0)
        return -1;
    work = model_reals(n, n, 1);
    if (work == NULL)
        return model_no_memory(at);
    status = jl_mat_check_cov(A, work, n);
    if (status == JL_OK && definite)
        status = jl_mat_cholesky(work, A, n);
    free(work);
    if (status == JL_EASYM)
        return asymmetric(A, at, key, n);
    if (status == JL_EDEF)
        return json_wrong(at, key, "not positive %s",
                          definite ? "definite" : "semidefinite");
    if (status != JL_OK)
        return json_wrong(at, key, "%s", jl_status_text(status));
    return 0;
}

/* Probabilities p [M] that stand at key. */
static int check_distribution(const jl_real *p, const struct json_at *at,
                              const char *key, int M)
{
    jl_real sum = 0;
    int i;

    for (i = 0; i < M; i++) {
        if (p[i] < 0) {
            char element[64];

            snprintf(element, sizeof element, "%s[%d]", key, i);
            return json_wrong(at, element, "%.9g: a probability is not "
                              "negative", (double)p[i]);
        }
        sum += p[i];
    }
    if (sum - 1 > JL_PROB_TOLERANCE || 1 - sum > JL_PROB_TOLERANCE)
        return json_wrong(at, key, "sums to 1%+.3g, not to 1",
                          (double)(sum - 1));
    return 0;
}

int model_take_mu0(struct model *model, const struct json_at *top, int needed)
{
    int i, M = model->M;

    model->mu0 = model_reals(M, 1, 1);
    if (model->mu0 == NULL)
        return model_no_memory(top);
    if (!needed && !json_has(top, "mu0")) {
        for (i = 0; i < M; i++)
            model->mu0[i] = 1 / (jl_real)M;
        return 0;
    }
    if (json_take_vector(model->mu0, top, "mu0", M, JL_REAL_MAX) != 0)
        return -1;
    return check_distribution(model->mu0, top, "mu0", M);
}

int model_take_Pi(struct model *model, const struct json_at *top)
{
    int i, status, M = model->M;

    model->Pi = model_reals(M, M, 1);
    if (model->Pi == NULL)
        return model_no_memory(top);
    if (json_take_matrix(model->Pi, top, "Pi", M, M, JL_REAL_MAX) != 0)
        return -1;
    for (i = 0; i < M; i++) {
        char row[32];

        snprintf(row, sizeof row, "Pi[%d]", i);
        if (check_distribution(model->Pi + i * M, top, row, M) != 0)
            return -1;
    }
    status = jl_chain_check(model->Pi, NULL, M);
    return status == JL_OK ? 0
        : json_wrong(top, "Pi", "%s", jl_status_text(status));
}

static int take_sojourn(struct model *model, const struct json_at *top)
{
    int i, M = model->M;

    model->sojourn_s = model_reals(M, 1, 1);
    if (model->sojourn_s == NULL)
        return model_no_memory(top);
    if (json_take_vector(model->sojourn_s, top, "sojourn_s", M,
                         JL_REAL_MAX) != 0)
        return -1;
    for (i = 0; i < M; i++)
        if (!(model->sojourn_s[i] > 0)) {
            char element[32];

            snprintf(element, sizeof element, "sojourn_s[%d]", i);
            return json_wrong(top, element, "%.9g: a dwell time is above 0",
                              (double)model->sojourn_s[i]);
        }
    return 0;
}

/* --- the start --------------------------------------------------------- */

/* 1 if the object has a start, 0 if not, -1 if half of one. */
static int has_start(const struct json_at *at)
{
    int x0 = json_has(at, "x0"), P0 = json_has(at, "P0");

    if (x0 != P0)
        return json_wrong(at, x0 ? "P0" : "x0", "missing while %s is there",
                          x0 ? "x0" : "P0");
    return x0;
}

/* Of k components: all n at the top, in a mode those that it has. */
static int take_start(struct model *model, const struct json_at *at, int mode,
                      int k)
{
    int n = model->n, i, j, error;
    jl_real *x = model_reals(k, k + 1, 1), *P = x + k;
    const int *map = k < n ? model->map[mode] : NULL;

    if (x == NULL)
        return model_no_memory(at);
    error = json_take_vector(x, at, "x0", k, JL_LARGE) != 0
        || model_take_cov(P, at, "P0", k, 0) != 0;
    for (i = 0; i < k && !error; i++) {
        int row = mode * n + (map != NULL ? map[i] : i);

        model->x0[row] = x[i];
        for (j = 0; j < k; j++)
            model->P0[row * n + (map != NULL ? map[j] : j)] = P[i * k + j];
    }
    free(x);
    return error ? -1 : 0;
}

/* x0, P0 in every mode, or once at the top, or nowhere. */
static int take_starts(struct model *model, const struct json_at *top)
{
    struct json_at mode;
    int i, n = model->n, M = model->M;
    int at_top = has_start(top), at_first;

    if (at_top < 0 || json_entry(&mode, top, "modes", 0) != 0)
        return -1;
    at_first = has_start(&mode);
    if (at_first < 0)
        return -1;
    for (i = 0; i < M; i++) {
        int here;

        if (json_entry(&mode, top, "modes", i) != 0)
            return -1;
        here = has_start(&mode);
        if (here < 0)
            return -1;
        if (here && at_top)
            return json_wrong(&mode, "x0", "there is one at the top, too");
        if (here != at_first)
            return json_wrong(&mode, "x0", "%s modes[0]: all modes have one, "
                              "or none", here ? "not in" : "missing, but in");
    }
    if (!at_top && !at_first)
        return model->motions != NULL ? 0
            : json_wrong(top, "x0", "missing: only a model of the catalogue "
                         "can start at the first measurement");

    model->x0 = model_reals(M, n, 1);
    model->P0 = model_reals(M, n, n);
    if (model->x0 == NULL || model->P0 == NULL)
        return model_no_memory(top);
    for (i = 0; i < M; i++) {
        if (!at_top && json_entry(&mode, top, "modes", i) != 0)
            return -1;
        if (take_start(model, at_top ? top : &mode, i,
                       at_top ? n : model->modes[i].n) != 0)
            return -1;
    }
    return 0;
}

/* --- modes by matrices ------------------------------------------------- */

/* The modes and their memory in one block: mode i has n[i] states and p[i]
 * noises. */
static int make_modes(struct model *model, const struct json_at *top,
                      const int *n, const int *p)
{
    int i, m = model->m, M = model->M;
    size_t octets = (size_t)M * sizeof(jl_mode);
    jl_real *mem;

    for (i = 0; i < M; i++)
        octets += (size_t)JL_MODE_MEM(n[i], m, p[i]) * sizeof(jl_real);
    model->modes = malloc(octets);
    if (model->modes == NULL)
        return model_no_memory(top);
    mem = (jl_real *)(void *)(model->modes + M);
    for (i = 0; i < M; i++) {
        int cap = JL_MODE_MEM(n[i], m, p[i]);
        int status = jl_mode_init(&model->modes[i], n[i], m, p[i], mem, cap);

        if (status != JL_OK)
            return json_wrong(top, "modes", "%s", jl_status_text(status));
        mem += cap;
    }
    return 0;
}

/* The noises p of a mode are the columns of its Gamma [n,p]. */
static int count_noises(int *p, const struct json_at *mode, int n)
{
    const json_t *Gamma = json_object_get(mode->object, "Gamma"), *row;

    if (Gamma == NULL)
        return json_wrong(mode, "Gamma", "missing");
    row = json_array_get(Gamma, 0);
    if (!json_is_array(row) || json_array_size(row) < 1
        || json_array_size(row) > JL_MAX_STATES)
        return json_wrong(mode, "Gamma", "must be an array of %d rows of 1 to "
                          "%d numbers", n, JL_MAX_STATES);
    *p = (int)json_array_size(row);
    return 0;
}

static int take_matrices(jl_mode *mode, const struct json_at *at)
{
    int n = mode->n, m = mode->m, p = mode->p, error, status = JL_OK;
    int own_mean = json_has(at, "w_bar");
    jl_real *mem = model_reals(1, 1, JL_MODE_MEM(n, m, p) + p
                               + JL_MODE_SCRATCH(n, m, p));
    jl_real *F = mem, *G = F + n * n, *Q = G + n * p, *w_bar = Q + p * p;
    jl_real *H = w_bar + p, *R = H + m * n, *scratch = R + m * m;

    if (mem == NULL)
        return model_no_memory(at);
    error = json_take_matrix(F, at, "Phi", n, n, JL_LARGE)
        || json_take_matrix(G, at, "Gamma", n, p, JL_LARGE)
        || model_take_cov(Q, at, "Q", p, 0)
        || (own_mean && json_take_vector(w_bar, at, "w_bar", p, JL_LARGE))
        || json_take_matrix(H, at, "H", m, n, JL_LARGE)
        || model_take_cov(R, at, "R", m, 1);
    if (!error)
        status = jl_mode_set(mode, F, G, Q, w_bar, H, R, scratch);
    if (status != JL_OK)
        error = json_wrong(at, NULL, "%s", jl_status_text(status));
    free(mem);
    return error ? -1 : 0;
}

static int read_matrices(struct model *model, const struct json_at *top)
{
    static const char *const top_keys[] = {
        "kind", "n", "m", "Pi", "mu0", "modes", "x0", "P0",
        NULL
    };
    static const char *const mode_keys[] = {
        "Phi", "Gamma", "Q", "H", "R", "w_bar", "x0", "P0",
        NULL
    };
    struct json_at mode;
    int n[JL_MAX_MODES], p[JL_MAX_MODES];
    int i;

    if (json_only(top, top_keys) != 0
        || json_take_count(&model->n, top, "n", 1, JL_MAX_STATES) != 0
        || json_take_count(&model->m, top, "m", 1, JL_MAX_STATES) != 0)
        return -1;
    for (i = 0; i < model->M; i++) {
        n[i] = model->n;
        if (json_entry(&mode, top, "modes", i) != 0
            || json_only(&mode, mode_keys) != 0
            || count_noises(&p[i], &mode, model->n) != 0)
            return -1;
    }
    if (make_modes(model, top, n, p) != 0)
        return -1;
    for (i = 0; i < model->M; i++)
        if (json_entry(&mode, top, "modes", i) != 0
            || take_matrices(&model->modes[i], &mode) != 0)
            return -1;
    return model_take_Pi(model, top);
}

/* --- modes of the catalogue -------------------------------------------- */

int model_take_above_0(jl_real *value, const struct json_at *at,
                       const char *key, jl_real usual)
{
    *value = usual;
    if (usual > 0 && !json_has(at, key))
        return 0;
    if (json_take_real(value, at, key) != 0)
        return -1;
    if (!(*value > 0))
        return json_wrong(at, key, "%.9g: must be above 0", (double)*value);
    return 0;
}

static int take_type(int *kind, const struct json_at *mode, int axes,
                     int order)
{
    const char *type;

    if (json_take_text(&type, mode, "type") != 0)
        return -1;
    if (strcmp(type, "cv") == 0)
        *kind = JL_MOTION_CV;
    else if (strcmp(type, "ca") == 0)
        *kind = JL_MOTION_CA;
    else if (strcmp(type, "ct") == 0)
        *kind = JL_MOTION_CT;
    else if (strcmp(type, "singer") == 0)
        *kind = JL_MOTION_SINGER;
    else
        return json_wrong(mode, "type", "'%.40s' is not cv, ca, ct or singer",
                          type);
    if ((*kind == JL_MOTION_CA || *kind == JL_MOTION_SINGER) && order != 3)
        return json_wrong(mode, "type", "%s needs order 3", type);
    if (*kind == JL_MOTION_CT && axes != 2)
        return json_wrong(mode, "type", "ct needs axes 2");
    return 0;
}

/* The mode's order, if it is not the model's. */
static int take_order(int *order, const struct json_at *mode)
{
    int most = *order;

    if (!json_has(mode, "order"))
        return 0;
    if (json_take_count(order, mode, "order", 2, 3) != 0)
        return -1;
    return *order <= most ? 0
        : json_wrong(mode, "order", "3, but at the top it is %d", most);
}

static int take_motion(jl_motion *motion, const struct json_at *mode)
{
    static const char *const keys[] = {
        "type", "order", "accel_std", "x0", "P0", NULL
    };
    static const char *const keys_ct[] = {
        "type", "order", "accel_std", "turn_rate", "x0", "P0", NULL
    };
    static const char *const keys_singer[] = {
        "type", "order", "accel_std", "tau_s", "x0", "P0", NULL
    };

    if (take_order(&motion->order, mode) != 0)
        return -1;
    if (take_type(&motion->kind, mode, motion->axes, motion->order) != 0)
        return -1;
    if (json_only(mode, motion->kind == JL_MOTION_CT ? keys_ct
                  : motion->kind == JL_MOTION_SINGER ? keys_singer : keys) != 0
        || json_take_real(&motion->accel_std, mode, "accel_std") != 0)
        return -1;
    if (motion->accel_std < 0)
        return json_wrong(mode, "accel_std", "%.9g: a standard deviation is "
                          "not negative", (double)motion->accel_std);
    if (motion->kind == JL_MOTION_CT)
        return json_take_real(&motion->turn_rate, mode, "turn_rate");
    if (motion->kind == JL_MOTION_SINGER)
        return model_take_above_0(&motion->tau_s, mode, "tau_s", 0);
    return 0;
}

/* What remains for the library to refuse: magnitudes that do not go together.
 * Uses the mode's memory, which every step fills anew anyway. */
static int try_motion(const struct model *model, const struct json_at *mode,
                      int i)
{
    jl_real *mem = model_reals(model->n, model->n, 2);
    jl_real *x = mem, *P = mem + model->n, *z;
    int status;

    if (mem == NULL)
        return model_no_memory(mode);
    z = P + model->n * model->n;        /* n + n n + m <= 2 n n, as n >= 2 m */
    status = jl_mode_motion(&model->modes[i], &model->motions[i], 1);
    if (status == JL_OK)
        status = jl_motion_start(x, P, &model->motions[i], z, model->v0_std,
                                 model->a0_std);
    free(mem);
    return status == JL_OK ? 0
        : json_wrong(mode, NULL, "%s", jl_status_text(status));
}

/* Modes of order 2 beside some of order 3: they share a map, and what they lack
 * is distributed like an acceleration at the start. */
static int take_prior(struct model *model, const struct json_at *top,
                      const jl_motion *common)
{
    int i, j, axes = common->axes, order = common->order, count = 0;
    jl_real var = model->a0_std * model->a0_std;
    int *two;

    for (j = 0; j < model->M; j++)
        count += model->motions[j].order < order;
    if (count == 0)
        return 0;
    if (count == model->M)
        return json_wrong(top, "order", "3, but every mode has order 2");
    if (!(var > 0))
        return json_wrong(top, "a0_std", "%.9g: its square is 0",
                          (double)model->a0_std);
    model->map = calloc(1, (size_t)model->M * sizeof *model->map
                        + (size_t)(2 * axes) * sizeof *two);
    model->prior_x = model_reals(model->n, 2, 1);
    if (model->map == NULL || model->prior_x == NULL)
        return model_no_memory(top);
    two = (int *)(void *)(model->map + model->M);
    for (i = 0; i < 2 * axes; i++)
        two[i] = i / 2 * order + i % 2;
    for (j = 0; j < model->M; j++)
        if (model->motions[j].order < order)
            model->map[j] = two;
    model->prior_var = model->prior_x + model->n;
    for (i = 0; i < model->n; i++)
        model->prior_var[i] = var;
    return 0;
}

static int take_motions(struct model *model, const struct json_at *top,
                        const jl_motion *common)
{
    struct json_at mode;
    int n[JL_MAX_MODES], p[JL_MAX_MODES];
    int i;

    model->motions = calloc((size_t)model->M, sizeof *model->motions);
    if (model->motions == NULL)
        return model_no_memory(top);
    for (i = 0; i < model->M; i++) {
        model->motions[i] = *common;
        if (json_entry(&mode, top, "modes", i) != 0
            || take_motion(&model->motions[i], &mode) != 0)
            return -1;
        n[i] = common->axes * model->motions[i].order;
        p[i] = jl_motion_noises(&model->motions[i]);
    }
    if (take_prior(model, top, common) != 0
        || make_modes(model, top, n, p) != 0)
        return -1;
    for (i = 0; i < model->M; i++)
        if (json_entry(&mode, top, "modes", i) != 0
            || try_motion(model, &mode, i) != 0)
            return -1;
    return 0;
}

static int read_catalogue(struct model *model, const struct json_at *top)
{
    static const char *const keys[] = {
        "kind", "axes", "order", "sigma_z", "v0_std", "a0_std",
        "sojourn_s", "Pi", "mu0", "modes", "x0", "P0", NULL
    };
    jl_motion common = { 0, 0, 0, 0, 0, 0, 0 };

    if (json_only(top, keys) != 0
        || json_take_count(&common.axes, top, "axes", 1, JL_MAX_STATES / 3)
        || json_take_count(&common.order, top, "order", 2, 3) != 0
        || model_take_above_0(&common.sigma_z, top, "sigma_z", 0) != 0
        || model_take_above_0(&model->v0_std, top, "v0_std", 100) != 0
        || model_take_above_0(&model->a0_std, top, "a0_std", 10) != 0)
        return -1;
    model->n = common.axes * common.order;
    model->m = common.axes;
    if (take_motions(model, top, &common) != 0)
        return -1;
    if (json_has(top, "sojourn_s") == json_has(top, "Pi"))
        return json_wrong(top, "sojourn_s", json_has(top, "Pi")
                          ? "there is Pi, too: one of them is enough"
                          : "missing, and no Pi either");
    return json_has(top, "Pi") ? model_take_Pi(model, top)
                               : take_sojourn(model, top);
}

/* --- the file ---------------------------------------------------------- */

/* What the file says, if it is one of those known. */
static int take_kind(const char **kind, const struct json_at *top)
{
    static const char *const known[] = { "imm", "cgimm", "mekf" };
    static const char *const others[] = { "particle", "dropout" };
    size_t i;

    if (json_take_text(kind, top, "kind") != 0)
        return -1;
    for (i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strcmp(*kind, known[i]) == 0)
            return 0;
    for (i = 0; i < sizeof others / sizeof others[0]; i++)
        if (strcmp(*kind, others[i]) == 0)
            return json_wrong(top, "kind",
                              "'%s' is not supported by this version", *kind);
    return json_wrong(top, "kind", "'%.40s' is unknown", *kind);
}

static int read_model(struct model *model, const struct json_at *top)
{
    struct json_at first;
    const char *kind;
    int catalogue;

    if (take_kind(&kind, top) != 0)
        return -1;
    if (strcmp(kind, "mekf") == 0)
        return model_read_mekf(model, top);
    if (json_take_list(&model->M, top, "modes", 1, JL_MAX_MODES) != 0
        || json_entry(&first, top, "modes", 0) != 0)
        return -1;
    if (strcmp(kind, "cgimm") == 0)
        return model_read_cgimm(model, top) != 0 ? -1
            : model_take_mu0(model, top, 1);
    catalogue = json_has(top, "axes") || json_has(&first, "type");
    if ((catalogue ? read_catalogue : read_matrices)(model, top) != 0)
        return -1;
    if (model_take_mu0(model, top, !catalogue) != 0)
        return -1;
    return take_starts(model, top);
}

int model_read(struct model *model, const char *path)
{
    struct json_at top = { path, NULL, "" };
    json_t *root;
    int error;

    memset(model, 0, sizeof *model);
    if (json_read(&root, &model->fingerprint, path) != 0) {
        model_free(model);
        return -1;
    }
    top.object = root;
    model->path = strdup(path);
    error = model->path != NULL ? read_model(model, &top)
                                : model_no_memory(&top);
    json_decref(root);
    if (error != 0)
        model_free(model);
    return error;
}

void model_free(struct model *model)
{
    free(model->path);
    free(model->modes);
    free(model->motions);
    free(model->gains);
    free(model->mekf);
    free(model->map);
    free(model->prior_x);
    free(model->sojourn_s);
    free(model->Pi);
    free(model->mu0);
    free(model->x0);
    free(model->P0);
    memset(model, 0, sizeof *model);
}
