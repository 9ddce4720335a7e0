/* Status texts, and exp, log, sin, cos, sqrt, atan2: swept against the C
 * library's functions of the next wider type, and by the bits that every
 * machine must find. */
#include "close.h"

#include <float.h>

#include "jumplink/base.h"

#if JL_REAL_FLOAT
typedef double wide;
typedef uint32_t bits;
#define W(name) name
#define MANT_DIG FLT_MANT_DIG
#define MIN_EXP FLT_MIN_EXP
#define MAX_EXP FLT_MAX_EXP
#define WIDE_DIG DBL_MANT_DIG
#define RANDOMS 6000000
#else
typedef long double wide;
typedef uint64_t bits;
#define W(name) name##l
#define MANT_DIG DBL_MANT_DIG
#define MIN_EXP DBL_MIN_EXP
#define MAX_EXP DBL_MAX_EXP
#define WIDE_DIG LDBL_MANT_DIG
#define RANDOMS 800000
#endif

/* The functions do better than base.h promises; a change that loses this
 * should be noticed. */
#define USUAL_EXP 0.57                  /* ulp */
#define USUAL_DENORMAL 0.78             /* exp's denormal results */
#define USUAL_LOG 0.56
#define USUAL_SINCOS 0.83
#define USUAL_ATAN2 0.51

/* --- arguments ---------------------------------------------------------- */

static jl_real from_bits(bits b)
{
    jl_real x;

    memcpy(&x, &b, sizeof x);
    return x;
}

static bits to_bits(jl_real x)
{
    bits b;

    memcpy(&b, &x, sizeof b);
    return b;
}

/* i numbers further from 0 (or further up, for 0). */
static jl_real neighbour(jl_real x, int i)
{
    if (x == 0)
        return i < 0 ? -from_bits((bits)-i) : from_bits((bits)i);
    return from_bits(to_bits(x) + (bits)i);
}

static uint64_t random_state;

static uint64_t random_bits(void)       /* splitmix64 */
{
    uint64_t z = random_state += 0x9e3779b97f4a7c15u;

    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static jl_real random_within(jl_real a, jl_real b)
{
    return a + (b - a) * ((jl_real)(random_bits() >> 11)
                          / (jl_real)(1ull << 53));
}

/* Any positive number between two, each exponent as likely as another. */
static jl_real random_positive(jl_real a, jl_real b)
{
    return from_bits(to_bits(a) + (bits)random_bits()
                     % (to_bits(b) - to_bits(a) + 1));
}

/* --- errors ------------------------------------------------------------- */

typedef struct {
    double ulp;
    jl_real x;
} worst;

/* Distance in ulps of the true value; infinity counts as 2^MAX_EXP. */
static double error_in_ulp(jl_real got, wide truth)
{
    const wide limit = W(ldexp)(1, MAX_EXP);
    wide value = (wide)got;
    int e;

    if (isinf(got))
        value = W(copysign)(limit, value);
    if (W(fabs)(truth) > limit)
        truth = W(copysign)(limit, truth);
    W(frexp)(truth, &e);
    if (e < MIN_EXP)
        e = MIN_EXP;
    return (double)W(ldexp)(W(fabs)(value - truth), MANT_DIG - e);
}

static void note(worst *w, jl_real got, wide truth, jl_real x)
{
    const double ulp = error_in_ulp(got, truth);

    if (!(ulp <= w->ulp)) {             /* also for NaN */
        w->ulp = isnan(ulp) ? HUGE_VAL : ulp;
        w->x = x;
    }
}

static void check(const worst *w, const char *what, double bound)
{
    if (w->ulp <= bound)
        return;
    print_error("%s is %.4f ulp off at %.17g (%a)\n", what, w->ulp,
                (double)w->x, (double)w->x);
    fail();
}

static void need_wide(void)
{
    if (WIDE_DIG < MANT_DIG + 8)
        skip();                         /* no wider type here */
}

/* --- exp ---------------------------------------------------------------- */

typedef struct {
    worst normal;
    worst denormal;
} exp_errors;

static void exp_at(exp_errors *w, jl_real x)
{
    const wide truth = W(exp)((wide)x);

    note(truth < (wide)JL_REAL_MIN ? &w->denormal : &w->normal, jl_exp(x),
         truth, x);
}

static void exp_around(exp_errors *w, wide x)
{
    int i;

    for (i = -30; i <= 30; i++)
        exp_at(w, neighbour((jl_real)x, i));
}

static void test_exp_accuracy_over_the_whole_range(void **state)
{
    const wide ln2 = W(log)(2);
    exp_errors w = {{0, 0}, {0, 0}};
    jl_real lowest, highest;
    int i;

    (void)state;
    need_wide();
    lowest = (jl_real)((MIN_EXP - MANT_DIG - 2) * ln2);
    highest = (jl_real)((MAX_EXP + 1) * ln2);
    random_state = 1;
    for (i = 0; i < RANDOMS; i++)
        exp_at(&w, random_within(lowest, highest));
    for (i = 0; i < RANDOMS / 4; i++) {
        exp_at(&w, random_within(lowest, (jl_real)(MIN_EXP * ln2)));
        exp_at(&w, random_within(-1, 1));
        exp_at(&w, random_positive(JL_EPSILON / 16, 1));
        exp_at(&w, -random_positive(JL_EPSILON / 16, 1));
    }
    check(&w.normal, "exp", USUAL_EXP);
    check(&w.denormal, "exp (denormal)", USUAL_DENORMAL);
}

/* Multiples of ln2/32 are where the reduction changes its mind; ln2 times
 * MAX_EXP, MIN_EXP - 1, and MIN_EXP - 1 - MANT_DIG are its thresholds. */
static void test_exp_accuracy_at_borders(void **state)
{
    const wide ln2 = W(log)(2);
    exp_errors w = {{0, 0}, {0, 0}};
    int i;

    (void)state;
    need_wide();
    for (i = 32 * (MIN_EXP - MANT_DIG - 2); i <= 32 * (MAX_EXP + 1); i += 2) {
        exp_around(&w, i / 32 * ln2);
        exp_at(&w, (jl_real)(i * ln2 / 32));
        exp_at(&w, (jl_real)((i + 1) * ln2 / 32));
    }
    for (i = -2000; i <= 2000; i++) {
        exp_at(&w, neighbour((jl_real)(MAX_EXP * ln2), i));
        exp_at(&w, neighbour((jl_real)((MIN_EXP - 1) * ln2), i));
        exp_at(&w, neighbour((jl_real)((MIN_EXP - MANT_DIG - 1) * ln2), i));
    }
    check(&w.normal, "exp", USUAL_EXP);
    check(&w.denormal, "exp (denormal)", USUAL_DENORMAL);
}

static void test_exp_special_values(void **state)
{
    const jl_real infinity = (jl_real)INFINITY;

    (void)state;
    assert_true(jl_exp(0) == 1);
    assert_true(jl_exp(-JL_C(0.0)) == 1);
    assert_true(jl_exp(JL_REAL_MIN) == 1);
    assert_true(jl_exp(infinity) == infinity);
    assert_true(jl_exp(JL_REAL_MAX) == infinity);
    assert_true(jl_exp(JL_C(1.0e4)) == infinity);
    assert_true(jl_exp(-infinity) == 0);
    assert_true(jl_exp(-JL_REAL_MAX) == 0);
    assert_true(jl_exp(JL_C(-1.0e4)) == 0);
    assert_true(isnan(jl_exp((jl_real)NAN)));
}

static void test_exp_underflows_gradually(void **state)
{
    const jl_real ln2 = JL_C(0.69314718055994531);
    const jl_real lowest = ln2 * (MIN_EXP - MANT_DIG);  /* 2^that: the least */

    (void)state;
    assert_true(jl_exp(lowest + JL_C(0.5) * ln2) > 0);
    assert_true(jl_exp(lowest + JL_C(0.5) * ln2)
                < JL_REAL_MIN * JL_EPSILON * 2);
    assert_true(jl_exp(lowest - JL_C(1.5) * ln2) == 0);
}

/* --- log ---------------------------------------------------------------- */

static void log_at(worst *w, jl_real x)
{
    note(w, jl_log(x), W(log)((wide)x), x);
}

static void test_log_accuracy_over_the_whole_range(void **state)
{
    worst w = {0, 0};
    int i;

    (void)state;
    need_wide();
    random_state = 2;
    for (i = 0; i < RANDOMS; i++)
        log_at(&w, random_positive(JL_REAL_MIN, JL_REAL_MAX));
    for (i = 0; i < RANDOMS / 4; i++) {
        log_at(&w, random_positive(from_bits(1), JL_REAL_MIN));
        log_at(&w, random_positive(JL_C(0.5), 2));
    }
    check(&w, "log", USUAL_LOG);
}

static void test_log_accuracy_near_1(void **state)
{
    worst w = {0, 0};
    int i;

    (void)state;
    need_wide();
    random_state = 3;
    for (i = 0; i < RANDOMS / 2; i++) {
        log_at(&w, 1 + random_positive(JL_EPSILON, JL_C(0.1)));
        log_at(&w, 1 - random_positive(JL_EPSILON / 2, JL_C(0.1)));
    }
    for (i = 1; i < 100000; i++) {
        log_at(&w, neighbour(1, i));
        log_at(&w, neighbour(1, -i));
    }
    check(&w, "log", USUAL_LOG);
}

/* Each power of 2, and where the table's next row begins. */
static void test_log_accuracy_at_borders(void **state)
{
    worst w = {0, 0};
    int e, i, row;

    (void)state;
    need_wide();
    for (e = MIN_EXP; e < MAX_EXP; e++)
        for (row = 0; row < 32; row++)
            for (i = -2; i <= 2; i++)
                log_at(&w, neighbour((jl_real)W(ldexp)(32 + row, e - 6), i));
    check(&w, "log", USUAL_LOG);
}

static void test_log_of_the_smallest_numbers(void **state)
{
    worst w = {0, 0};
    int i;

    (void)state;
    need_wide();
    for (i = 1; i < 100000; i++)
        log_at(&w, from_bits((bits)i));
    for (i = 0; i < MANT_DIG; i++)
        log_at(&w, from_bits((bits)1 << i));
    check(&w, "log", USUAL_LOG);
}

static void test_log_special_values(void **state)
{
    const jl_real infinity = (jl_real)INFINITY;

    (void)state;
    assert_true(jl_log(1) == 0 && !signbit(jl_log(1)));
    assert_true(jl_log(0) == -infinity);
    assert_true(jl_log(-JL_C(0.0)) == -infinity);
    assert_true(jl_log(infinity) == infinity);
    assert_true(jl_log(JL_REAL_MAX) < JL_C(710.0));
    assert_true(isnan(jl_log(-1)));
    assert_true(isnan(jl_log(-from_bits(1))));
    assert_true(isnan(jl_log(-JL_REAL_MAX)));
    assert_true(isnan(jl_log(-infinity)));
    assert_true(isnan(jl_log((jl_real)NAN)));
}

/* --- sin, cos ----------------------------------------------------------- */

static void sincos_at(worst *w, jl_real x)
{
    jl_real s, c;

    assert_int_equal(jl_sincos(&s, &c, x), JL_OK);
    note(w, s, W(sin)((wide)x), x);
    note(w, c, W(cos)((wide)x), x);
}

static void test_sincos_accuracy_over_the_whole_range(void **state)
{
    worst w = {0, 0};
    int i;

    (void)state;
    need_wide();
    random_state = 4;
    for (i = 0; i < RANDOMS / 2; i++) {
        sincos_at(&w, random_within(-1024, 1024));
        sincos_at(&w, random_within(-4, 4));
    }
    for (i = 0; i < RANDOMS / 4; i++) {
        sincos_at(&w, random_positive(from_bits(1), JL_C(1024.0)));
        sincos_at(&w, -random_positive(JL_EPSILON / 16, JL_C(1024.0)));
    }
    check(&w, "sin or cos", USUAL_SINCOS);
}

/* Multiples of pi/4: zeros, and borders of the reduction.  Closest to a zero
 * the tests' own functions and ours must both know many digits of pi. */
static void test_sincos_accuracy_at_zeros_and_borders(void **state)
{
    const wide pi = W(acos)(-1);
    worst w = {0, 0};
    int i, n;

    (void)state;
    need_wide();
    for (n = -1303; n <= 1303; n++)
        for (i = -100; i <= 100; i++)
            sincos_at(&w, neighbour((jl_real)(n * pi / 4), i));
    for (n = -1024; n <= 1024; n++)
        sincos_at(&w, (jl_real)n);
    check(&w, "sin or cos", USUAL_SINCOS);
}

static void test_sincos_keeps_the_sign_of_zero(void **state)
{
    jl_real s = 1, c = 0;

    (void)state;
    assert_int_equal(jl_sincos(&s, &c, 0), JL_OK);
    assert_true(s == 0 && !signbit(s) && c == 1);
    assert_int_equal(jl_sincos(&s, &c, -JL_C(0.0)), JL_OK);
    assert_true(s == 0 && signbit(s) && c == 1);
}

static void test_sincos_refuses_what_is_out_of_range(void **state)
{
    const jl_real bad[] = {
        JL_C(1024.001), JL_C(-1024.001), JL_REAL_MAX, -JL_REAL_MAX,
        (jl_real)INFINITY, -(jl_real)INFINITY, (jl_real)NAN
    };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        jl_real s = 3, c = 4;

        assert_int_equal(jl_sincos(&s, &c, bad[i]), JL_ERANGE);
        assert_true(s == 3 && c == 4);
    }
}

/* --- sqrt ---------------------------------------------------------------- */

/* Half an ulp, and what the wider root it is compared with is off. */
static void test_sqrt_is_rounded_exactly(void **state)
{
    const double half = 0.5 + ldexp(1.0, MANT_DIG - WIDE_DIG);
    jl_real x, root;
    int i;

    (void)state;
    for (i = 0; i < RANDOMS; i++) {
        x = random_positive(JL_REAL_MIN, JL_REAL_MAX);
        assert_true(error_in_ulp(jl_sqrt(x), W(sqrt)((wide)x)) <= half);
    }
    for (i = 0; i < 4000; i++) {
        root = (jl_real)i;
        assert_true(to_bits(jl_sqrt(root * root)) == to_bits(root));
    }
    assert_true(isnan((double)jl_sqrt(-1)));
    assert_true(isnan((double)jl_sqrt((jl_real)NAN)));
}

/* --- atan2 -------------------------------------------------------------- */

/* In all four quadrants, and mirrored at the diagonal. */
static void atan2_at(double *worst_ulp, jl_real y, jl_real x)
{
    int i;

    for (i = 0; i < 8; i++) {
        const jl_real a = i & 1 ? -(i & 4 ? x : y) : i & 4 ? x : y;
        const jl_real b = i & 2 ? -(i & 4 ? y : x) : i & 4 ? y : x;
        const double ulp = error_in_ulp(jl_atan2(a, b),
                                        W(atan2)((wide)a, (wide)b));

        if (ulp > *worst_ulp)
            *worst_ulp = ulp;
        if (ulp <= USUAL_ATAN2)
            continue;
        print_error("atan2(%a, %a) is %.4f ulp off\n", (double)a, (double)b,
                    ulp);
        fail();
    }
}

static void test_atan2_accuracy_in_all_directions(void **state)
{
    double worst_ulp = 0;
    int i;

    (void)state;
    need_wide();
    random_state = 6;
    for (i = 0; i < RANDOMS / 8; i++) {
        atan2_at(&worst_ulp, random_within(0, 1), random_within(0, 1));
        atan2_at(&worst_ulp, random_positive(JL_EPSILON * JL_EPSILON, 1),
                 random_within(JL_C(0.5), 1));
    }
    assert_true(worst_ulp > 0.4);       /* it was looked at */
}

/* Where the table's next row begins, around its angles, and where atan r
 * becomes r, at many scales. */
static void test_atan2_accuracy_at_borders(void **state)
{
    double worst_ulp = 0;
    int row, k, i;

    (void)state;
    need_wide();
    random_state = 7;
    for (k = 0; k < 40; k++)
        for (i = -40; i <= 40; i++) {
            const jl_real x = random_within(JL_C(0.5), 1);
            const wide scale = W(ldexp)(1, -(k * (MAX_EXP - 30)) / 40);
            const jl_real b = (jl_real)(scale * (wide)x);

            for (row = 0; row <= 16; row++) {
                atan2_at(&worst_ulp, neighbour(
                    (jl_real)(scale * (wide)(x * (jl_real)row / 16)), i), b);
                atan2_at(&worst_ulp, neighbour((jl_real)(scale * (wide)(
                    x * ((jl_real)row + JL_C(0.55)) / 16)), i), b);
            }
            for (row = 10; row <= 32; row++)
                atan2_at(&worst_ulp, neighbour(
                    (jl_real)W(ldexp)((wide)b, -row), i), b);
        }
}

static void test_atan2_accuracy_at_extreme_lengths(void **state)
{
    const jl_real tiniest = from_bits(1);
    double worst_ulp = 0;
    int i, j;

    (void)state;
    need_wide();
    random_state = 8;
    for (i = 0; i < RANDOMS / 8; i++) {
        const jl_real far = random_positive(tiniest, JL_REAL_MAX);

        atan2_at(&worst_ulp, far, random_positive(tiniest, JL_REAL_MAX));
        if (far < JL_REAL_MAX / 1024)
            atan2_at(&worst_ulp, random_positive(far, far * 1024), far);
    }
    for (i = 1; i <= 60; i++)
        for (j = 1; j <= 60; j++) {
            atan2_at(&worst_ulp, from_bits((bits)i), from_bits((bits)j));
            atan2_at(&worst_ulp, neighbour(JL_REAL_MAX, -i),
                     neighbour(JL_REAL_MAX, -j));
            atan2_at(&worst_ulp, neighbour(JL_REAL_MIN, i - 30),
                     neighbour(JL_REAL_MIN, j - 30));
            atan2_at(&worst_ulp, from_bits((bits)i), JL_REAL_MIN * (jl_real)j);
            atan2_at(&worst_ulp, from_bits((bits)i), (jl_real)j);
        }
    atan2_at(&worst_ulp, tiniest, JL_REAL_MAX);
}

/* The same number, a zero's sign included. */
static void check_angle(jl_real y, jl_real x, wide angle)
{
    const jl_real got = jl_atan2(y, x), want = (jl_real)angle;

    if (to_bits(got) == to_bits(want))
        return;
    print_error("atan2(%g, %g) = %.17g, expected %.17g\n", (double)y,
                (double)x, (double)got, (double)want);
    fail();
}

/* C99, F.9.1.4. */
static void test_atan2_special_values(void **state)
{
    const jl_real infinity = (jl_real)INFINITY, zero = 0;
    const wide pi = W(acos)(-1);
    const jl_real some[] = { from_bits(1), JL_REAL_MIN, 1, JL_REAL_MAX };
    size_t i;
    int s;

    (void)state;
    for (s = -1; s <= 1; s += 2) {
        const jl_real sign = (jl_real)s;

        check_angle(sign * zero, zero, (wide)(sign * zero));
        check_angle(sign * zero, -zero, s * pi);
        check_angle(sign * infinity, infinity, s * pi / 4);
        check_angle(sign * infinity, -infinity, s * 3 * pi / 4);
        check_angle(sign * infinity, sign * zero, s * pi / 2);
        check_angle(sign * zero, infinity, (wide)(sign * zero));
        check_angle(sign * zero, -infinity, s * pi);
        for (i = 0; i < sizeof some / sizeof some[0]; i++) {
            check_angle(sign * zero, some[i], (wide)(sign * zero));
            check_angle(sign * zero, -some[i], s * pi);
            check_angle(sign * some[i], zero, s * pi / 2);
            check_angle(sign * some[i], -zero, s * pi / 2);
            check_angle(sign * some[i], infinity, (wide)(sign * zero));
            check_angle(sign * some[i], -infinity, s * pi);
            check_angle(sign * infinity, some[i], s * pi / 2);
            check_angle(sign * infinity, -some[i], s * pi / 2);
            check_angle(sign * some[i], some[i], s * pi / 4);
            check_angle(sign * some[i], -some[i], s * 3 * pi / 4);
        }
    }
}

static void test_atan2_of_nan_is_nan(void **state)
{
    const jl_real nan_ = (jl_real)NAN;
    const jl_real some[] = { 0, -JL_C(0.0), 1, -1, (jl_real)INFINITY,
                             -(jl_real)INFINITY, (jl_real)NAN };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof some / sizeof some[0]; i++) {
        assert_true(isnan(jl_atan2(nan_, some[i])));
        assert_true(isnan(jl_atan2(some[i], nan_)));
    }
}

/* --- the same bits everywhere -------------------------------------------- */

static uint32_t mixed(uint32_t hash, jl_real x)
{
    const uint64_t b = to_bits(x);

    hash = (hash ^ (uint32_t)b) * 16777619u;
    hash = (hash ^ (uint32_t)(b >> 32)) * 16777619u;
    return hash ^ hash >> 15;           /* or the signs would drop out */
}

/* What gcc and clang at any level found on x86-64; other machines must too. */
static void test_elementary_bits_are_the_known_ones(void **state)
{
    const uint32_t known = JL_REAL_FLOAT ? 0xfa9ab410u : 0x75769f8fu;
    uint32_t hash = 2166136261u;
    int i;

    (void)state;
    random_state = 5;
    for (i = 0; i < 200000; i++) {
        const jl_real x = (jl_real)((int32_t)(random_bits() >> 32))
                          / (jl_real)2097152.0;         /* below 1024 */
        jl_real s = 0, c = 0;

        hash = mixed(hash, jl_exp(x));
        hash = mixed(hash, jl_exp(x / 16));
        hash = mixed(hash, jl_log(random_positive(from_bits(1), JL_REAL_MAX)));
        hash = mixed(hash, jl_log(random_positive(JL_C(0.25), 4)));
        assert_int_equal(jl_sincos(&s, &c, x), JL_OK);
        hash = mixed(mixed(hash, s), c);
        assert_int_equal(jl_sincos(&s, &c, x / 256), JL_OK);
        hash = mixed(mixed(hash, s), c);
    }
    if (hash != known)
        print_error("hash is 0x%08x\n", (unsigned)hash);
    assert_true(hash == known);
}

static void test_atan2_bits_are_the_known_ones(void **state)
{
    const uint32_t known = JL_REAL_FLOAT ? 0x0fb06350u : 0xcbfb143bu;
    uint32_t hash = 2166136261u;
    int i;

    (void)state;
    random_state = 9;
    for (i = 0; i < 200000; i++) {
        const jl_real far = random_positive(from_bits(1), JL_REAL_MAX);
        const jl_real y = random_within(-1, 1), x = random_within(-1, 1);

        hash = mixed(hash, jl_atan2(y, x));
        hash = mixed(hash, jl_atan2(x / 65536, y));
        hash = mixed(hash, jl_atan2(far, x));
        hash = mixed(hash, jl_atan2(far * y, far * x));
    }
    if (hash != known)
        print_error("hash is 0x%08x\n", (unsigned)hash);
    assert_true(hash == known);
}

/* --- status ------------------------------------------------------------- */

static void test_status_texts_are_there_and_distinct(void **state)
{
    int a, b;

    (void)state;
    for (a = JL_EGATE; a <= JL_OK; a++) {
        const char *text = jl_status_text(a);

        assert_non_null(text);
        assert_in_range(strlen(text), 5, 70);
        assert_null(strchr(text, '\n'));
        assert_string_not_equal(text, "unknown status");
        for (b = JL_EGATE; b < a; b++)
            assert_string_not_equal(text, jl_status_text(b));
    }
    assert_string_equal(jl_status_text(JL_ESINGULAR),
                        "innovation covariance S is not positive definite");
}

static void test_status_unknown_codes_have_a_text(void **state)
{
    const int unknown[] = {1, 7, JL_EGATE - 1, -100, INT_MAX, INT_MIN};
    size_t i;

    (void)state;
    for (i = 0; i < sizeof unknown / sizeof unknown[0]; i++)
        assert_string_equal(jl_status_text(unknown[i]), "unknown status");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exp_accuracy_over_the_whole_range),
        cmocka_unit_test(test_exp_accuracy_at_borders),
        cmocka_unit_test(test_exp_special_values),
        cmocka_unit_test(test_exp_underflows_gradually),
        cmocka_unit_test(test_log_accuracy_over_the_whole_range),
        cmocka_unit_test(test_log_accuracy_near_1),
        cmocka_unit_test(test_log_accuracy_at_borders),
        cmocka_unit_test(test_log_of_the_smallest_numbers),
        cmocka_unit_test(test_log_special_values),
        cmocka_unit_test(test_sincos_accuracy_over_the_whole_range),
        cmocka_unit_test(test_sincos_accuracy_at_zeros_and_borders),
        cmocka_unit_test(test_sincos_keeps_the_sign_of_zero),
        cmocka_unit_test(test_sincos_refuses_what_is_out_of_range),
        cmocka_unit_test(test_sqrt_is_rounded_exactly),
        cmocka_unit_test(test_atan2_accuracy_in_all_directions),
        cmocka_unit_test(test_atan2_accuracy_at_borders),
        cmocka_unit_test(test_atan2_accuracy_at_extreme_lengths),
        cmocka_unit_test(test_atan2_special_values),
        cmocka_unit_test(test_atan2_of_nan_is_nan),
        cmocka_unit_test(test_elementary_bits_are_the_known_ones),
        cmocka_unit_test(test_atan2_bits_are_the_known_ones),
        cmocka_unit_test(test_status_texts_are_there_and_distinct),
        cmocka_unit_test(test_status_unknown_codes_have_a_text)
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
