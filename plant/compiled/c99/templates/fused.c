#if defined(__FAST_MATH__)
#error "this file tells missing samples by NAN: compile without -ffast-math"
#endif

/* A product and a sum rounded once, where the processor does so in one instruction; rounded twice elsewhere, unless
 * {{ NAME }}_EXACT asks for the bits of Python's kernels at any price. */
#if defined({{ NAME }}_EXACT) || defined(FP_FAST_FMA{{ f | upper }}) || defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define FUSED(a, b, c) fma{{ f }}((a), (b), (c))
#else
#define FUSED(a, b, c) (((a) * (b)) + (c))
#endif
