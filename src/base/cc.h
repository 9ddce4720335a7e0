/* The only place that knows words of the compiler's. */
#ifndef JL_CC_H
#define JL_CC_H

#if defined(__STDC_VERSION__) && __STDC_VERSION__ >= 199901L
#  define JL_INLINE static inline
#  define JL_RESTRICT restrict
#elif defined(__GNUC__)
#  define JL_INLINE static __inline__
#  define JL_RESTRICT __restrict__
#else
#  define JL_INLINE static
#  define JL_RESTRICT
#endif

#endif
