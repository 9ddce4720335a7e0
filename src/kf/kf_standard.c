/* The form standard, for any size. */
#include "kf/kf_form.h"
#include "kf/kf_k.h"

JLI_FORM_CALLS(standard, jli_kf_predict, jli_kf_update_standard, mode->n,
               mode->m, mode->block, mode->every)

const jl_kf_form jl_kf_standard = {
    standard_predict, standard_update, standard_step, &jl_cov_full, 0, 0
};
