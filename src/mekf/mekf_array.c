/* The array of a filter, made triangular: what the systolic array does. */
#include "mekf/mekf_parts.h"

#include "mat/givens_k.h"
#include "mat/mat_k.h"

void jli_array_start(struct jli_array *a, jl_real *A, const jl_real *UR,
                     int n, int r, int rows)
{
    int i;

    a->A = A;
    a->rows = rows;
    a->n = n;
    a->r = r;
    a->done = 0;
    memset(A, 0, (size_t)(r * (r + n)) * sizeof *A);
    for (i = 0; i < r; i++)
        jli_copy(A + i * (r + n), UR + i * r, r);
}

jl_real *jli_array_row(const struct jli_array *a, int row)
{
    return a->A + row * (a->r + a->n) + a->r;
}

void jli_array_products(jl_real *out, int width, const jl_real *L, int lw,
                        const jl_real *M, int mw, int rows, int n, int inner)
{
    int i, j, k;

    for (k = 0; k < rows; k++, out += width)
        for (i = 0; i < n; i++) {
            out[i] = 0;
            for (j = 0; j < inner; j++)
                out[i] += L[k * lw + j] * M[i * mw + j];
        }
}

int jli_array_sense(struct jli_array *a, const jl_real *H)
{
    int i, r = a->r;

    for (i = r; i < a->rows; i++) {
        jl_real *product = jli_array_row(a, i);

        jli_apply(product - r, H, product, NULL, r, a->n);
    }
    return jl_vec_within(a->A, a->rows * (r + a->n), JL_LARGE)
        ? JL_OK : JL_ENONFINITE;
}

/* Row i of V' (all its columns from i on) and the feed. */
static int pass(const jl_real *row, int i, const struct jli_array *a,
                struct jli_feed *feed)
{
    jl_real least = 4 * (jl_real)a->rows * JL_EPSILON, e;
    int r = a->r, j;

    for (j = i; j < r; j++)
        feed->S[j] += row[j - i] * row[j - i];
    if (row[0] <= least * jli_sqrt(feed->S[i]))
        return JL_ESINGULAR;
    e = feed->nu[i] / row[0];
    for (j = i + 1; j < r; j++)
        feed->nu[j] -= row[j - i] * e;
    for (j = 0; j < a->n; j++)
        feed->x[j] += row[r - i + j] * e;
    return JL_OK;
}

int jli_array_triangle(struct jli_array *a, int count, struct jli_feed *feed)
{
    int cols = a->r + a->n - a->done, i, status = JL_OK;

    jli_givens_some(a->A, count, a->rows - a->done, cols);
    for (i = 0; i < count && status == JL_OK; i++) {
        const jl_real *row = a->A + i * (cols + 1);

        if (!jl_vec_within(row, cols - i, JL_LARGE))
            status = JL_ENONFINITE;
        else if (a->done + i < a->r)
            status = pass(row, a->done + i, a, feed);
    }
    return status;
}

void jli_array_take(jl_real *U, const struct jli_array *a, int count)
{
    int cols = a->r + a->n - a->done, i;

    for (i = 0; i < count; i++) {
        int k = a->done + i - a->r;

        if (k >= 0)
            jli_copy(U + k * (a->n + 1), a->A + i * (cols + 1), a->n - k);
    }
}
