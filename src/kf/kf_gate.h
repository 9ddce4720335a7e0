/* What gates of one filter and of many share. */
#ifndef JL_KF_GATE_H
#define JL_KF_GATE_H

#include "jumplink/kf.h"

#if JL_REAL_FLOAT
#define jli_gated_update jli_gated_update_f32
#endif

/* The form's update, for a gate (0: none).  JL_OK and a nis above the gate: x
 * and P are undefined.  A measurement, if finite, that is too large to be used
 * has an infinite nis or makes an x that is beyond JL_LARGE: an error without a
 * gate, outside it with one. */
int jli_gated_update(jl_real *x, jl_real *P, jl_innovation *innovation,
                     const jl_kf_form *form, const jl_mode *mode,
                     const jl_real *xp, const jl_real *Pp, const jl_real *z,
                     jl_real gate, jl_real *scratch);

#endif
