/* What is zero in the matrices of a mode. */
#ifndef JL_STRUCTURE_H
#define JL_STRUCTURE_H

#include "jumplink/model.h"

#if JL_REAL_FLOAT
#define jli_mode_structure jli_mode_structure_f32
#endif

/* Set mode->block and mode->every by F and H. */
void jli_mode_structure(jl_mode *mode);

#endif
