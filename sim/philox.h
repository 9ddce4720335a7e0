/* Random numbers by counter: each is a function of a seed and of two counters,
 * so that run 17 draws the same whatever was drawn before, or is not wanted.
 *
 * Philox4x32-10 of Salmon, Moraes, Dror, Shaw 2011, Parallel random numbers: as
 * easy as 1, 2, 3. */
#ifndef SIM_PHILOX_H
#define SIM_PHILOX_H

#include <stdint.h>

#include "jumplink/base.h"

/* Encipher counter [4], which becomes 128 random bits, by key [2]. */
void philox(uint32_t counter[4], const uint32_t key[2]);

/* A number of the normal distribution, mean 0, variance 1 (Box and Muller 1958,
 * with the library's logarithm and cosine: the same bits everywhere). */
jl_real philox_normal(uint64_t seed, uint32_t run, uint32_t index);

#endif
