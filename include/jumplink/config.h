/* Build options: the number type and the limits.
 *
 * Set them on the compiler's command line, or in a file of your own named by
 * -DJL_CONFIG_FILE='"my_config.h"', alike for the library and for its users.
 * A library and a program that disagree about the number type do not link.
 */
#ifndef JL_CONFIG_H
#define JL_CONFIG_H

#ifdef JL_CONFIG_FILE
#include JL_CONFIG_FILE
#endif

/* 0: jl_real is double.  1: jl_real is float, and no double is touched. */
#ifndef JL_REAL_FLOAT
#define JL_REAL_FLOAT 0
#endif
#if JL_REAL_FLOAT != 0 && JL_REAL_FLOAT != 1
#error "JL_REAL_FLOAT is 0 (double) or 1 (float)"
#endif

/* A file that defines jl_real, and JL_C to JL_LARGE of base.h, otherwise: for
 * measurements of the code itself, compiled as C++ (tests/count). */
#if defined(JL_REAL_FILE) && JL_REAL_FLOAT
#error "JL_REAL_FILE says what jl_real is: JL_REAL_FLOAT must be 0"
#endif

/* Largest sizes that an init accepts.  They cost nothing by themselves: the
 * memory is the caller's; they only keep the size products inside an int of 32
 * bits (where int has 16, JL_IMM_STATE and the like must stay below 32768). */
#ifndef JL_MAX_STATES
#define JL_MAX_STATES 64
#endif
#if JL_MAX_STATES < 1 || JL_MAX_STATES > 128
#error "JL_MAX_STATES must be 1 to 128"
#endif

#ifndef JL_MAX_MODES
#define JL_MAX_MODES 256
#endif
#if JL_MAX_MODES < 1 || JL_MAX_MODES > 1024
#error "JL_MAX_MODES must be 1 to 1024"
#endif

/* The sizes that have forms of fixed size (kf.h): a file with a line
 * JL_KF_SIZE(n, m) for each.  A line costs a program only what it names. */
#ifndef JL_KF_SIZES_FILE
#define JL_KF_SIZES_FILE "jumplink/kf_sizes.def"
#endif

/* Likewise of arrays that become triangles (mat.h): JL_GIVENS_SIZE(rows, cols).
 * Who names jl_mat_givens_fixed pays for all of them. */
#ifndef JL_GIVENS_SIZES_FILE
#define JL_GIVENS_SIZES_FILE "jumplink/givens_sizes.def"
#endif

/* Processing elements of one run.  Each costs ten octets of a jl_par, so the
 * library and its users must agree. */
#ifndef JL_MAX_PES
#define JL_MAX_PES 16
#endif
#if JL_MAX_PES < 1 || JL_MAX_PES > 64
#error "JL_MAX_PES must be 1 to 64"
#endif

/* Octets of the largest frame on a datagram carrier: below the 1400 that a
 * datagram may have before networks cut it into pieces.  Each frame that a
 * link may have in flight costs this much memory at either end. */
#ifndef JL_FRAME_MAX
#define JL_FRAME_MAX 1344
#endif
#if JL_FRAME_MAX < 64 || JL_FRAME_MAX > 32767
#error "JL_FRAME_MAX must be 64 to 32767"
#endif

#endif
