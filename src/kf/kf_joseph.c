/* The form joseph, for any size. */
#include "kf/kf_form.h"
#include "kf/kf_k.h"

JLI_FORM_CALLS(joseph, jli_kf_predict, jli_kf_update_joseph, mode->n,
               mode->m, mode->block, mode->every)

const jl_kf_form jl_kf_joseph = {
    joseph_predict, joseph_update, joseph_step, &jl_cov_full, 0, 0
};
