/* Forms of fixed size, looked up. */
#include "jumplink/kf.h"

struct entry {
    const jl_kf_form *any, *fixed;
};

#define JL_KF_SIZE(N, M) \
    { &jl_kf_joseph, &JL_KF_FIXED(joseph, N, M) }, \
    { &jl_kf_standard, &JL_KF_FIXED(standard, N, M) },

static const struct entry entries[] = {
#include JL_KF_SIZES_FILE
    { NULL, NULL }
};

const jl_kf_form *jl_kf_fixed(const jl_kf_form *form, int n, int m)
{
    const struct entry *e;

    for (e = entries; e->any != NULL; e++)
        if (e->any == form && e->fixed->n == n && e->fixed->m == m)
            return e->fixed;
    return form;
}
