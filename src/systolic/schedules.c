/* Orders in which rows are fed: what is in the paper, and what is better. */
#include "jumplink/systolic.h"

const jl_systolic_schedule jl_systolic_paper = {
    JL_SYSTOLIC_KNOW_F + JL_SYSTOLIC_KNOW_C + JL_SYSTOLIC_KNOW_G, 0, 1, 0,
    JL_SYSTOLIC_F_FIRST
};

const jl_systolic_schedule jl_systolic_naive = {
    0, 0, 0, 0, JL_SYSTOLIC_ROWS
};

const jl_systolic_schedule jl_systolic_best = {
    0, 1, 1, 1, JL_SYSTOLIC_BLOCKS
};

const jl_systolic_schedule jl_systolic_mixed = {
    0, 1, 1, 1, JL_SYSTOLIC_ROWS
};
