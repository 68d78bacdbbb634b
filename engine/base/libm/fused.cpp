// Binds the elementary functions of libm to one of their variants when the program is linked.
//
// glibc has several variants of these functions and chooses between them by the processor when a program
// starts; their results sometimes differ in the last bit. This file binds each name to the variant that uses
// fused multiply-add, from glibc's static library, so that every processor computes the same. glibc's own
// functions (tgamma, asinhf, erfc) call these functions by the names that begin with two underscores.
//
// A dispatching function of glibc that is missing here does not link, because its static form needs data that
// only the dynamic linker has.
//
// This file includes no standard header, because those declare the functions with other attributes.

extern "C" {

double __ieee754_acos_fma(double);
double __ieee754_asin_fma(double);
double __ieee754_atan2_fma(double, double);
double __ieee754_exp_fma(double);
double __ieee754_log_fma(double);
double __ieee754_pow_fma(double, double);
double __atan_fma(double);
double __cos_fma(double);
double __expm1_fma(double);
double __log1p_fma(double);
double __log2_fma(double);
double __sin_fma(double);
double __tan_fma(double);
void __sincos_fma(double, double*, double*);

float __cosf_fma(float);
float __exp2f_fma(float);
float __expf_fma(float);
float __log2f_fma(float);
float __logf_fma(float);
float __powf_fma(float, float);
float __sinf_fma(float);
void __sincosf_fma(float, float*, float*);

double acos(double x) {
    return __ieee754_acos_fma(x);
}
double asin(double x) {
    return __ieee754_asin_fma(x);
}
double atan(double x) {
    return __atan_fma(x);
}
double atan2(double y, double x) {
    return __ieee754_atan2_fma(y, x);
}
double cos(double x) {
    return __cos_fma(x);
}
double exp(double x) {
    return __ieee754_exp_fma(x);
}
double expm1(double x) {
    return __expm1_fma(x);
}
double log(double x) {
    return __ieee754_log_fma(x);
}
double log1p(double x) {
    return __log1p_fma(x);
}
double log2(double x) {
    return __log2_fma(x);
}
double pow(double x, double y) {
    return __ieee754_pow_fma(x, y);
}
double sin(double x) {
    return __sin_fma(x);
}
double tan(double x) {
    return __tan_fma(x);
}
void sincos(double x, double* sin_x, double* cos_x) {
    __sincos_fma(x, sin_x, cos_x);
}

float cosf(float x) {
    return __cosf_fma(x);
}
float exp2f(float x) {
    return __exp2f_fma(x);
}
float expf(float x) {
    return __expf_fma(x);
}
float log2f(float x) {
    return __log2f_fma(x);
}
float logf(float x) {
    return __logf_fma(x);
}
float powf(float x, float y) {
    return __powf_fma(x, y);
}
float sinf(float x) {
    return __sinf_fma(x);
}
void sincosf(float x, float* sin_x, float* cos_x) {
    __sincosf_fma(x, sin_x, cos_x);
}

// ---- names by which glibc's own functions call them

double __atan(double x) {
    return __atan_fma(x);
}
double __cos(double x) {
    return __cos_fma(x);
}
double __expm1(double x) {
    return __expm1_fma(x);
}
double __ieee754_acos(double x) {
    return __ieee754_acos_fma(x);
}
double __ieee754_asin(double x) {
    return __ieee754_asin_fma(x);
}
double __ieee754_atan2(double y, double x) {
    return __ieee754_atan2_fma(y, x);
}
double __ieee754_exp(double x) {
    return __ieee754_exp_fma(x);
}
double __ieee754_log(double x) {
    return __ieee754_log_fma(x);
}
double __ieee754_pow(double x, double y) {
    return __ieee754_pow_fma(x, y);
}
double __log1p(double x) {
    return __log1p_fma(x);
}
double __sin(double x) {
    return __sin_fma(x);
}
double __tan(double x) {
    return __tan_fma(x);
}
void __sincos(double x, double* sin_x, double* cos_x) {
    __sincos_fma(x, sin_x, cos_x);
}
float __cosf(float x) {
    return __cosf_fma(x);
}
float __exp2f(float x) {
    return __exp2f_fma(x);
}
float __expf(float x) {
    return __expf_fma(x);
}
float __ieee754_exp2f(float x) {
    return __exp2f_fma(x);
}
float __ieee754_expf(float x) {
    return __expf_fma(x);
}
float __ieee754_logf(float x) {
    return __logf_fma(x);
}
float __ieee754_powf(float x, float y) {
    return __powf_fma(x, y);
}
float __logf(float x) {
    return __logf_fma(x);
}
float __sinf(float x) {
    return __sinf_fma(x);
}

// ---- exact functions of one instruction each, which glibc dispatches nevertheless

double ceil(double x) {
    return __builtin_ceil(x);
}
double floor(double x) {
    return __builtin_floor(x);
}
double fma(double x, double y, double z) {
    return __builtin_fma(x, y, z);
}
double nearbyint(double x) {
    return __builtin_nearbyint(x);
}
double rint(double x) {
    return __builtin_rint(x);
}
double trunc(double x) {
    return __builtin_trunc(x);
}
double __ceil(double x) {
    return __builtin_ceil(x);
}
double __floor(double x) {
    return __builtin_floor(x);
}
double __fma(double x, double y, double z) {
    return __builtin_fma(x, y, z);
}
double __nearbyint(double x) {
    return __builtin_nearbyint(x);
}
double __rint(double x) {
    return __builtin_rint(x);
}
double __trunc(double x) {
    return __builtin_trunc(x);
}

// ---- glibc's static functions refer to these of libc by names that its shared library does not export.
double frexp(double, int*);
float frexpf(float, int*);
long double frexpl(long double, int*);
long double ldexpl(long double, int);
long double scalbnl(long double, int);
double ldexp(double, int);
float ldexpf(float, int);
double scalbn(double, int);
float scalbnf(float, int);
double __frexp(double x, int* exponent) {
    return frexp(x, exponent);
}
float __frexpf(float x, int* exponent) {
    return frexpf(x, exponent);
}
double __ldexp(double x, int exponent) {
    return ldexp(x, exponent);
}
float __ldexpf(float x, int exponent) {
    return ldexpf(x, exponent);
}
long double __frexpl(long double x, int* exponent) {
    return frexpl(x, exponent);
}
long double __ldexpl(long double x, int exponent) {
    return ldexpl(x, exponent);
}
long double __scalbnl(long double x, int exponent) {
    return scalbnl(x, exponent);
}
double __scalbn(double x, int exponent) {
    return scalbn(x, exponent);
}
float __scalbnf(float x, int exponent) {
    return scalbnf(x, exponent);
}

}  // extern "C"
