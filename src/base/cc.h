/* The only place that knows words of the compiler's. */
#ifndef JL_CC_H
#define JL_CC_H

/* Always inline: a kernel that is called is one whose sizes are not known. */
#if defined(__GNUC__)
#  define JL_INLINE static __inline__ __attribute__((always_inline))
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 199901L
#  define JL_INLINE static inline
#else
#  define JL_INLINE static
#endif

#if defined(__STDC_VERSION__) && __STDC_VERSION__ >= 199901L
#  define JL_RESTRICT restrict
#elif defined(__GNUC__)
#  define JL_RESTRICT __restrict__
#else
#  define JL_RESTRICT
#endif

#endif
