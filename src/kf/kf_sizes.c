/* The forms of fixed size: for each line of kf_sizes.def the kernels once more,
 * with sizes that the compiler knows.  Worth it only when compiled at -O3. */
#include "kf/cov_k.h"
#include "kf/kf_k.h"

#define PASTE(name, n, m) name##_##n##_##m

#define JL_KF_SIZE(N, M) \
    static int PASTE(predict, N, M)(jl_real *xp, jl_real *Pp, \
        const jl_mode *mode, const jl_real *x, const jl_real *P, \
        jl_real *scratch) \
    { \
        return jli_kf_predict(xp, Pp, mode, x, P, scratch, N); \
    } \
    static int PASTE(joseph, N, M)(jl_real *x, jl_real *P, \
        jl_innovation *innovation, const jl_mode *mode, const jl_real *xp, \
        const jl_real *Pp, const jl_real *z, jl_real *scratch) \
    { \
        return jli_kf_update_joseph(x, P, innovation, mode, xp, Pp, z, \
                                    scratch, N, M); \
    } \
    static int PASTE(standard, N, M)(jl_real *x, jl_real *P, \
        jl_innovation *innovation, const jl_mode *mode, const jl_real *xp, \
        const jl_real *Pp, const jl_real *z, jl_real *scratch) \
    { \
        return jli_kf_update_standard(x, P, innovation, mode, xp, Pp, z, \
                                      scratch, N, M); \
    } \
    static void PASTE(pool, N, M)(jl_real *mean, jl_real *S, \
        const jl_real *w, const jl_real *x, const jl_real *Ss, \
        jl_real *scratch, int count, int n) \
    { \
        (void)n; \
        jli_full_pool(mean, S, w, x, Ss, scratch, count, N); \
    } \
    static void PASTE(blend, N, M)(jl_real *x, jl_real *S, jl_real a, \
        const jl_real *x1, const jl_real *S1, jl_real b, const jl_real *x2, \
        const jl_real *S2, jl_real *scratch, int n) \
    { \
        (void)n; \
        jli_full_blend(x, S, a, x1, S1, b, x2, S2, scratch, N); \
    } \
    static const jl_cov PASTE(cov, N, M) = { \
        0, jli_full_take, jli_full_give, PASTE(pool, N, M), \
        PASTE(blend, N, M), jli_full_part, jli_full_whole \
    }; \
    const jl_kf_form JL_KF_FIXED(joseph, N, M) = { \
        PASTE(predict, N, M), PASTE(joseph, N, M), &PASTE(cov, N, M), N, M \
    }; \
    const jl_kf_form JL_KF_FIXED(standard, N, M) = { \
        PASTE(predict, N, M), PASTE(standard, N, M), &PASTE(cov, N, M), N, M \
    };

#include JL_KF_SIZES_FILE
