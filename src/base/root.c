/* The square root under a public name, for the functions of nonlinear modes. */
#include "mathx.h"

jl_real jl_sqrt(jl_real x)
{
    return jli_sqrt(x);
}
