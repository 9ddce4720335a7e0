/* Triangles of fixed size: the kernel with sizes that the compiler knows.  It
 * pays when compiled at -O3. */
#include "mat/givens_k.h"

#define JL_GIVENS_SIZE(ROWS, COLS) \
    static void givens_##ROWS##_##COLS(jl_real *A, int rows, int cols) \
    { \
        (void)rows; \
        (void)cols; \
        jli_givens(A, ROWS, COLS); \
    }
#include JL_GIVENS_SIZES_FILE
#undef JL_GIVENS_SIZE

#define JL_GIVENS_SIZE(ROWS, COLS) { ROWS, COLS, givens_##ROWS##_##COLS },

static const struct entry {
    int rows, cols;
    jl_givens *fixed;
} entries[] = {
#include JL_GIVENS_SIZES_FILE
    { 0, 0, NULL }
};

jl_givens *jl_mat_givens_fixed(int rows, int cols)
{
    const struct entry *e;

    for (e = entries; e->fixed != NULL; e++)
        if (e->rows == rows && e->cols == cols)
            return e->fixed;
    return jl_mat_givens;
}
