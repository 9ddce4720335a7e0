/* The forms of fixed size: for each line of kf_sizes.def the kernels once more,
 * with sizes that the compiler knows.  It pays when compiled at -O3. */
#include "kf/cov_k.h"
#include "kf/cov_ud_k.h"
#include "kf/kf_form.h"
#include "kf/kf_k.h"
#include "kf/sqrt_k.h"

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

#ifdef JLI_WIDEST
#define FUNCTIONS JLI_FORM_FUNCTIONS
#else
#define FUNCTIONS JLI_FORM_CALLS
#endif

#define FORM(form, predict, update, cov, N, M) \
    FUNCTIONS(form##_##N##_##M, predict, update, N, M, N / M, N / M) \
    const jl_kf_form JL_KF_FIXED(form, N, M) = { \
        form##_##N##_##M##_predict, form##_##N##_##M##_update, \
        form##_##N##_##M##_step, &cov##_##N##_##M, N, M \
    };

#define JL_KF_SIZE(N, M) \
    POOL(full_pool_##N##_##M, jli_full_pool, N) \
    BLEND(full_blend_##N##_##M, jli_full_blend, N) \
    static const jl_cov full_##N##_##M = { \
        0, jli_full_take, jli_full_give, full_pool_##N##_##M, \
        full_blend_##N##_##M, jli_full_part, jli_full_whole \
    }; \
    FORM(joseph, jli_kf_predict, jli_kf_update_joseph, full, N, M) \
    FORM(standard, jli_kf_predict, jli_kf_update_standard, full, N, M) \
    \
    POOL(ud_pool_##N##_##M, jli_ud_pool, N) \
    BLEND(ud_blend_##N##_##M, jli_ud_blend, N) \
    static const jl_cov ud_##N##_##M = { \
        1, jli_ud_take, jl_mat_ud_product, ud_pool_##N##_##M, \
        ud_blend_##N##_##M, jli_ud_part, jli_ud_whole \
    }; \
    FORM(sqrt, jli_sqrt_predict, jli_sqrt_update, ud, N, M)

#include JL_KF_SIZES_FILE
