// Elementary functions whose results are defined by the code that computes them.
//
// Those of a C library differ between libraries, their versions and processors in the last bit, and so would
// images. These use only +, -, ·, /, square roots and fused multiply-add, which IEEE 754 defines exactly, and
// are the same everywhere. Their largest errors, measured against MPFR, are in
// docs/explanation/portable.md. Special values are those of the C standard; errno and rounding modes other
// than to nearest are not supported.
#pragma once

namespace lucerna {

double exp(double x);
double exp2(double x);
double expm1(double x);
double log(double x);
double log2(double x);
double log10(double x);
double log1p(double x);
double pow(double x, double y);
double cbrt(double x);
double hypot(double x, double y);

// The argument of sin(), cos() and tan() is reduced exactly up to 2^30; beyond, it is reduced by 2π as a double.
double sin(double x);
double cos(double x);
double tan(double x);
double asin(double x);
double acos(double x);
double atan(double x);
double atan2(double y, double x);

// Returns the logarithm of the gamma function, for x > 0.
double log_gamma(double x);

// The functions of floats are those of doubles, rounded.
inline float exp(float x) {
    return static_cast<float>(exp(static_cast<double>(x)));
}
inline float expm1(float x) {
    return static_cast<float>(expm1(static_cast<double>(x)));
}
inline float log(float x) {
    return static_cast<float>(log(static_cast<double>(x)));
}
inline float log2(float x) {
    return static_cast<float>(log2(static_cast<double>(x)));
}
inline float log1p(float x) {
    return static_cast<float>(log1p(static_cast<double>(x)));
}
inline float pow(float x, float y) {
    return static_cast<float>(pow(static_cast<double>(x), static_cast<double>(y)));
}
inline float cbrt(float x) {
    return static_cast<float>(cbrt(static_cast<double>(x)));
}
inline float hypot(float x, float y) {
    return static_cast<float>(hypot(static_cast<double>(x), static_cast<double>(y)));
}
float sin(float x);
float cos(float x);
inline float tan(float x) {
    return static_cast<float>(tan(static_cast<double>(x)));
}
inline float asin(float x) {
    return static_cast<float>(asin(static_cast<double>(x)));
}
inline float acos(float x) {
    return static_cast<float>(acos(static_cast<double>(x)));
}
inline float atan2(float y, float x) {
    return static_cast<float>(atan2(static_cast<double>(y), static_cast<double>(x)));
}

template <typename T>
struct SinCos {
    T sin, cos;
};
SinCos<double> sin_cos(double x);
SinCos<float> sin_cos(float x);

}  // namespace lucerna
