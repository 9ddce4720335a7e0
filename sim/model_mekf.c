/* Models of kind mekf: one of the zoo by its name, `model`, with its numbers in
 * `params`, and what its filters start from.
 *
 * n, m, r, p1, p2 must be the model's (mekf_zoo.h), but for r of spring2, the
 * rows of its C.  x0 [n], y0 [m], P0 [n+m,n+m], Q [p1+p2,p1+p2], R [r,r]; P10
 * [n,n] is P0's leading block unless given, `cb` prev (default), pred or filt.
 * `steps` is for whoever makes data. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "model_parts.h"

/* --- params -------------------------------------------------------------- */

/* A matrix has `columns` and so many rows; or it is a number. */
enum { NUMBER = -1, ABOVE_0 = -2, PER_MEASUREMENT = -3 };

struct param {
    const char *model, *key;
    size_t at;
    int rows, columns;
};

#define AT(field) #field, offsetof(struct mekf_zoo, field)

static const struct param params[] = {
    { "spring2", AT(T), ABOVE_0, 0 }, { "spring2", AT(d), NUMBER, 0 },
    { "spring2", AT(C), PER_MEASUREMENT, 2 },
    { "ct4pos", AT(T), ABOVE_0, 0 }, { "ct4rdc", AT(T), ABOVE_0, 0 },
    { "gen32", AT(A0), 3, 3 }, { "gen32", AT(A1), 3, 3 },
    { "gen32", AT(A2), 3, 3 }, { "gen32", AT(C0), 2, 3 },
    { "gen32", AT(C1), 2, 3 }, { "gen32", AT(C2), 2, 3 },
    { "gen32", AT(B1), 3, 2 }, { "gen32", AT(B2), 2, 2 },
    { "gen32", AT(B3), 2, 1 },
    { "gen32", AT(a1), NUMBER, 0 }, { "gen32", AT(a2), NUMBER, 0 },
    { "gen32", AT(b1), NUMBER, 0 }, { "gen32", AT(b2), NUMBER, 0 },
    { "gen32", AT(g), NUMBER, 0 }
};
enum { PARAMS = sizeof params / sizeof params[0] };

static int take_param(struct mekf_zoo *zoo, const struct param *p,
                      const struct json_at *at)
{
    jl_real *v = (jl_real *)(void *)((char *)zoo + p->at);

    if (p->rows == ABOVE_0)
        return model_take_above_0(v, at, p->key, 0);
    if (p->rows == NUMBER)
        return json_take_real(v, at, p->key);
    return json_take_matrix(v, at, p->key, p->rows == PER_MEASUREMENT
                            ? zoo->r : p->rows, p->columns, JL_LARGE);
}

static int take_params(struct mekf_zoo *zoo, const struct json_at *top,
                       const char *model)
{
    const char *keys[PARAMS + 1];
    struct json_at at;
    int i, count = 0;

    if (json_member(&at, top, "params") != 0)
        return -1;
    for (i = 0; i < PARAMS; i++)
        if (strcmp(params[i].model, model) == 0)
            keys[count++] = params[i].key;
    keys[count] = NULL;
    if (json_only(&at, keys) != 0)
        return -1;
    for (i = 0; i < PARAMS; i++)
        if (strcmp(params[i].model, model) == 0
            && take_param(zoo, &params[i], &at) != 0)
            return -1;
    return 0;
}

/* --- the model ----------------------------------------------------------- */

static int agrees(const struct json_at *top, const char *key, int is)
{
    int value;

    if (json_take_count(&value, top, key, 0, JL_MAX_STATES) != 0)
        return -1;
    return value == is ? 0
        : json_wrong(top, key, "%d, but this model has %d", value, is);
}

static int take_model(struct mekf_setup *s, const struct json_at *top)
{
    const jl_mekf_model *model = &s->model;
    const char *name;

    if (json_take_text(&name, top, "model") != 0
        || json_take_count(&s->zoo.r, top, "r", 1, ZOO_R) != 0)
        return -1;
    if (mekf_zoo_model(&s->model, name, &s->zoo) != 0)
        return json_wrong(top, "model", "'%.40s' is not ar1, spring2, ct4pos, "
                          "ct4rdc or gen32", name);
    return agrees(top, "n", model->n) != 0 || agrees(top, "m", model->m) != 0
        || agrees(top, "r", model->r) != 0
        || agrees(top, "p1", model->p1) != 0
        || agrees(top, "p2", model->p2) != 0 ? -1
        : take_params(&s->zoo, top, name);
}

static int take_cb(jl_mekf_c *c, const struct json_at *top)
{
    static const char *const known[] = { "prev", "pred", "filt" };
    const char *cb;
    int i;

    *c = JL_MEKF_PREV;
    if (!json_has(top, "cb"))
        return 0;
    if (json_take_text(&cb, top, "cb") != 0)
        return -1;
    for (i = 0; i < 3; i++)
        if (strcmp(cb, known[i]) == 0) {
            *c = (jl_mekf_c)(JL_MEKF_PREV + i);
            return 0;
        }
    return json_wrong(top, "cb", "'%.40s' is not prev, pred or filt", cb);
}

static int take_start(struct mekf_setup *s, const struct json_at *top)
{
    int n = s->model.n, N = n + s->model.m, i;

    if (json_take_vector(s->x, top, "x0", n, JL_LARGE) != 0
        || json_take_vector(s->x + n, top, "y0", N - n, JL_LARGE) != 0
        || model_take_cov(s->P, top, "P0", N, 0) != 0)
        return -1;
    if (json_has(top, "P10"))
        return model_take_cov(s->P1, top, "P10", n, 0);
    for (i = 0; i < n; i++)
        memcpy(s->P1 + i * n, s->P + i * N, (size_t)n * sizeof *s->P1);
    return 0;
}

/* What is left for the library to refuse: magnitudes. */
static int try_filters(struct mekf_setup *s, const struct json_at *top)
{
    static struct mekf_filter filter;
    int status = mekf_filter_start(&filter, s);

    s->plain = 1;
    if (status == JL_OK)
        status = mekf_filter_start(&filter, s);
    s->plain = 0;
    return status == JL_OK ? 0
        : json_wrong(top, NULL, "%s", jl_status_text(status));
}

int model_read_mekf(struct model *model, const struct json_at *top)
{
    static const char *const keys[] = {
        "kind", "model", "params", "n", "m", "r", "p1", "p2", "steps", "cb",
        "x0", "y0", "P0", "P10", "Q", "R", NULL
    };
    struct mekf_setup *s = calloc(1, sizeof *s);
    int steps;

    if (s == NULL)
        return model_no_memory(top);
    model->mekf = s;
    if (json_only(top, keys) != 0 || take_model(s, top) != 0
        || (json_has(top, "steps")
            && json_take_count(&steps, top, "steps", 0, 1000000000) != 0)
        || take_cb(&s->c, top) != 0 || take_start(s, top) != 0
        || model_take_cov(s->Q, top, "Q", s->model.p1 + s->model.p2, 0) != 0
        || model_take_cov(s->R, top, "R", s->model.r, 0) != 0)
        return -1;
    model->n = s->model.n + s->model.m;
    model->m = s->model.r;
    return try_filters(s, top);
}
