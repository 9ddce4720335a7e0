/* Uses the library with numbers of one type: test_mixing.sh links it with the
 * library of the same type and of the other.  Also compiled as C++98. */
#include <stdio.h>

#include "jumplink.h"

int main(void)
{
    static jl_real mem[JL_KF_STATE(1, 1)];
    jl_mode mode;
    jl_kf kf;
    jl_real e = jl_exp(JL_C(0.0));

    mode.n = 1;
    mode.m = 1;
    if (jl_kf_init(&kf, &mode, &jl_kf_joseph, mem, JL_KF_STATE(1, 1)) != JL_OK)
        return 1;
    printf("%d octets\n", (int)sizeof kf.x[0]);
    return e > JL_C(0.5) ? 0 : 2;
}
