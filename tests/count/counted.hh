// A number that counts what is done with it: jl_real, where JL_REAL_FILE names
// this file.  Multiplications and divisions, additions and subtractions;
// comparisons, signs and copies are free, and so is what a compiler computes.
#ifndef COUNTED_HH
#define COUNTED_HH

#include <math.h>

struct count {
    long products, sums, exps, logs;
};
extern struct count counted;

struct jl_real {
    double v;

    jl_real() = default;
    jl_real(double value) : v(value) {}
    jl_real(int value) : v(value) {}
    jl_real(unsigned long value) : v((double)value) {}
    explicit operator double() const { return v; }
    explicit operator int() const { return (int)v; }
    jl_real operator-() const { return -v; }
    jl_real &operator+=(jl_real b) { return *this = *this + b; }
    jl_real &operator-=(jl_real b) { return *this = *this - b; }
    jl_real &operator*=(jl_real b) { return *this = *this * b; }
    jl_real &operator/=(jl_real b) { return *this = *this / b; }

    friend jl_real operator+(jl_real a, jl_real b)
    {
        counted.sums++;
        return a.v + b.v;
    }
    friend jl_real operator-(jl_real a, jl_real b)
    {
        counted.sums++;
        return a.v - b.v;
    }
    friend jl_real operator*(jl_real a, jl_real b)
    {
        counted.products++;
        return a.v * b.v;
    }
    friend jl_real operator/(jl_real a, jl_real b)
    {
        counted.products++;
        return a.v / b.v;
    }
    friend bool operator<(jl_real a, jl_real b) { return a.v < b.v; }
    friend bool operator>(jl_real a, jl_real b) { return a.v > b.v; }
    friend bool operator<=(jl_real a, jl_real b) { return a.v <= b.v; }
    friend bool operator>=(jl_real a, jl_real b) { return a.v >= b.v; }
    friend bool operator==(jl_real a, jl_real b) { return a.v == b.v; }
    friend bool operator!=(jl_real a, jl_real b) { return a.v != b.v; }
};

inline jl_real sqrt(jl_real x) { return sqrt(x.v); }

#define JL_C(x) x
#define JL_EPSILON DBL_EPSILON
#define JL_REAL_MIN DBL_MIN
#define JL_REAL_MAX DBL_MAX
#define JL_LARGE JL_C(1.0e150)

#endif
