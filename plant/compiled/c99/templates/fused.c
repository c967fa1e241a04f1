#if defined(__FAST_MATH__)
#error "this file tells missing samples by NAN: compile without -ffast-math"
#endif

/* No compiler may fuse what is not written as fused: the bits are then those of Python's kernels under any options. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif

/* A product and a sum rounded once: in one instruction where the processor has it, {% if exact | default(false) %}by the library elsewhere. The covariance
 * of this filter spans many decades: rounded twice, which {{ NAME }}_ROUNDED_TWICE asks for where the library is slow, it
 * is up to 1e-9 from Python's. */
#if !defined({{ NAME }}_ROUNDED_TWICE) || defined(FP_FAST_FMA{{ f | upper }}) || defined(__FMA__) || defined(__ARM_FEATURE_FMA)
{% else %}rounded twice elsewhere, unless
 * {{ NAME }}_EXACT asks for the bits of Python's kernels at any price. */
#if defined({{ NAME }}_EXACT) || defined(FP_FAST_FMA{{ f | upper }}) || defined(__FMA__) || defined(__ARM_FEATURE_FMA)
{% endif %}
#define FUSED(a, b, c) fma{{ f }}((a), (b), (c))
#else
#define FUSED(a, b, c) (((a) * (b)) + (c))
#endif
