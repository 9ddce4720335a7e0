/* The form sqrt, for any size. */
#include "kf/kf_form.h"
#include "kf/sqrt_k.h"

JLI_FORM_CALLS(sqrt, jli_sqrt_predict, jli_sqrt_update, mode->n, mode->m,
               mode->block, mode->every)

const jl_kf_form jl_kf_sqrt = {
    sqrt_predict, sqrt_update, sqrt_step, &jl_cov_ud, 0, 0
};
