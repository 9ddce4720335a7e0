/* The forms of fixed size: for each line of kf_sizes.def the kernels once more,
 * with sizes that the compiler knows.  It pays when compiled at -O3. */
#include "kf/cov_k.h"
#include "kf/cov_ud_k.h"
#include "kf/kf_k.h"
#include "kf/sqrt_k.h"

#define PREDICT(name, kernel, N) \
    static int name(jl_real *xp, jl_real *Pp, const jl_mode *mode, \
                    const jl_real *x, const jl_real *P, jl_real *scratch) \
    { \
        return kernel(xp, Pp, mode, x, P, scratch, N); \
    }

#define UPDATE(name, kernel, N, M) \
    static int name(jl_real *x, jl_real *P, jl_innovation *innovation, \
                    const jl_mode *mode, const jl_real *xp, \
                    const jl_real *Pp, const jl_real *z, jl_real *scratch) \
    { \
        return kernel(x, P, innovation, mode, xp, Pp, z, scratch, N, M); \
    }

#define POOL(name, kernel, N) \
    static void name(jl_real *mean, jl_real *S, const jl_real *w, \
                     const jl_real *x, const jl_real *Ss, jl_real *scratch, \
                     int modes, int n) \
    { \
        (void)n; \
        kernel(mean, S, w, x, Ss, scratch, modes, N); \
    }

#define BLEND(name, kernel, N) \
    static void name(jl_real *x, jl_real *S, jl_real a, const jl_real *x1, \
                     const jl_real *S1, jl_real b, const jl_real *x2, \
                     const jl_real *S2, jl_real *scratch, int n) \
    { \
        (void)n; \
        kernel(x, S, a, x1, S1, b, x2, S2, scratch, N); \
    }

#define FORM(form, predict, cov, N, M) \
    const jl_kf_form JL_KF_FIXED(form, N, M) = { \
        predict##_##N##_##M, form##_update_##N##_##M, &cov##_##N##_##M, N, M \
    };

#define JL_KF_SIZE(N, M) \
    PREDICT(full_predict_##N##_##M, jli_kf_predict, N) \
    UPDATE(joseph_update_##N##_##M, jli_kf_update_joseph, N, M) \
    UPDATE(standard_update_##N##_##M, jli_kf_update_standard, N, M) \
    POOL(full_pool_##N##_##M, jli_full_pool, N) \
    BLEND(full_blend_##N##_##M, jli_full_blend, N) \
    static const jl_cov full_##N##_##M = { \
        0, jli_full_take, jli_full_give, full_pool_##N##_##M, \
        full_blend_##N##_##M, jli_full_part, jli_full_whole \
    }; \
    FORM(joseph, full_predict, full, N, M) \
    FORM(standard, full_predict, full, N, M) \
    \
    PREDICT(sqrt_predict_##N##_##M, jli_sqrt_predict, N) \
    UPDATE(sqrt_update_##N##_##M, jli_sqrt_update, N, M) \
    POOL(ud_pool_##N##_##M, jli_ud_pool, N) \
    BLEND(ud_blend_##N##_##M, jli_ud_blend, N) \
    static const jl_cov ud_##N##_##M = { \
        1, jli_ud_take, jl_mat_ud_product, ud_pool_##N##_##M, \
        ud_blend_##N##_##M, jli_ud_part, jli_ud_whole \
    }; \
    FORM(sqrt, sqrt_predict, ud, N, M)

#include JL_KF_SIZES_FILE
