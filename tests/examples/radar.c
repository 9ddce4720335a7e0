/* A radar that measures range and bearing follows an aircraft that flies
 * straight, turns about at 3 degrees a second, and flies straight again.  An
 * IMM of a straight flight and a turn of unknown rate, once with extended
 * Kalman filters and once with unscented ones:
 *
 *     cc -Iinclude tests/examples/radar.c build/libjumplink.a -lm && ./a.out
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <jumplink.h>

enum { STRAIGHT, TURN, M };             /* modes                            */
enum { X, VX, Y, VY, RATE, N };         /* states; STRAIGHT lacks the last  */
enum { RANGE, BEARING, Z };             /* measurements                     */
enum { STEPS = 100 };

#define T JL_C(2.0)                     /* [s] between measurements         */
#define PI JL_C(3.14159265358979323846)
#define SIGMA_RANGE JL_C(30.0)          /* [m] of a measurement             */
#define SIGMA_BEARING JL_C(0.01)        /* [rad]                            */
#define SIGMA_ACCEL JL_C(0.5)           /* [m/s^2] of either mode           */
#define SIGMA_RATE JL_C(0.005)          /* [rad/s] of a turn, in each step  */
#define SIGMA_ANY_RATE JL_C(0.05)       /* [rad/s] of a turn that begins    */

static void check(int status)
{
    if (status != JL_OK) {
        printf("%s\n", jl_status_text(status));
        exit(1);
    }
}

/* --- the model --------------------------------------------------------- */

/* A turn: the way flown is the chord of an arc, half the turn off the velocity
 * before, and half the turn off the velocity after. */
static int turn(jl_real *y, const jl_real *x, void *context)
{
    jl_real half = x[RATE] * T / 2, s, c, vx, vy, chord;
    int status = jl_sincos(&s, &c, half);

    (void)context;
    if (status != JL_OK)
        return status;
    chord = half > 0 || half < 0 ? T * s / half : T;
    vx = c * x[VX] - s * x[VY];
    vy = s * x[VX] + c * x[VY];
    y[X] = x[X] + chord * vx;
    y[Y] = x[Y] + chord * vy;
    y[VX] = c * vx - s * vy;
    y[VY] = s * vx + c * vy;
    y[RATE] = x[RATE];
    return JL_OK;
}

static int radar(jl_real *z, const jl_real *x, void *context)
{
    (void)context;
    z[RANGE] = jl_sqrt(x[X] * x[X] + x[Y] * x[Y]);
    z[BEARING] = jl_atan2(x[Y], x[X]);
    return z[RANGE] > 0 ? JL_OK : JL_ERANGE;
}

/* Bearings on either side of west are neighbours. */
static void difference(jl_real *d, const jl_real *a, const jl_real *b,
                       void *context)
{
    (void)context;
    d[RANGE] = a[RANGE] - b[RANGE];
    d[BEARING] = a[BEARING] - b[BEARING];
    if (d[BEARING] >= PI)
        d[BEARING] -= 2 * PI;
    else if (d[BEARING] < -PI)
        d[BEARING] += 2 * PI;
}

/* Jacobians are left to the library. */
static jl_nonlinear straight_model = { NULL, NULL, radar, NULL, difference,
                                       NULL, 0 };
static jl_nonlinear turn_model = { turn, NULL, radar, NULL, difference, NULL,
                                   0 };

/* --- the filter -------------------------------------------------------- */

struct track {
    jl_mode modes[M];
    jl_imm imm;
    jl_real mode_mem[M][JL_MODE_MEM(N, Z, 3)];
    jl_real mem[JL_IMM_STATE(M, N, Z)];
    jl_real scratch[JL_IMM_SCRATCH(M, N, Z) + JL_MODE_SCRATCH(N, Z, 3)];
};

static void set_modes(struct track *t)
{
    static const jl_real F[] = { 1, T, 0, 0,  0, 1, 0, 0,
                                 0, 0, 1, T,  0, 0, 0, 1 };
    static const jl_real G[] = { T * T / 2, 0,  T, 0,  0, T * T / 2,  0, T };
    static const jl_real G_turn[] = { T * T / 2, 0, 0,  T, 0, 0,
                                      0, T * T / 2, 0,  0, T, 0,  0, 0, 1 };
    const jl_real a = SIGMA_ACCEL * SIGMA_ACCEL, w = SIGMA_RATE * SIGMA_RATE;
    jl_real Q[4] = { 0 }, Q_turn[9] = { 0 }, R[4] = { 0 };

    Q[0] = Q[3] = Q_turn[0] = Q_turn[4] = a;
    Q_turn[8] = w;
    R[0] = SIGMA_RANGE * SIGMA_RANGE;
    R[3] = SIGMA_BEARING * SIGMA_BEARING;
    check(jl_mode_init(&t->modes[STRAIGHT], 4, Z, 2, t->mode_mem[STRAIGHT],
                       JL_MODE_MEM(4, Z, 2)));
    check(jl_mode_set(&t->modes[STRAIGHT], F, G, Q, NULL, NULL, R,
                      t->scratch));
    check(jl_mode_nonlinear(&t->modes[STRAIGHT], &straight_model));
    check(jl_mode_init(&t->modes[TURN], N, Z, 3, t->mode_mem[TURN],
                       JL_MODE_MEM(N, Z, 3)));
    check(jl_mode_set(&t->modes[TURN], NULL, G_turn, Q_turn, NULL, NULL, R,
                      t->scratch));
    check(jl_mode_nonlinear(&t->modes[TURN], &turn_model));
}

/* From the first measurement. */
static void start(struct track *t, const jl_kf_form *form, const jl_real *z)
{
    static const int straight_has[] = { X, VX, Y, VY };
    static const int *const map[M] = { straight_has, NULL };
    static const jl_real prior_x[N] = { 0 }, sigma[N] = { 200, 200, 200, 200,
                                                          SIGMA_ANY_RATE };
    static const jl_real prior_var[N] = { 0, 0, 0, 0, SIGMA_ANY_RATE
                                                      * SIGMA_ANY_RATE };
    static const jl_real Pi[] = { JL_C(0.98), JL_C(0.02),
                                  JL_C(0.04), JL_C(0.96) };
    static const jl_real mu[] = { JL_C(0.9), JL_C(0.1) };
    jl_real x[M * N] = { 0 }, P[M * N * N] = { 0 }, s, c;
    int j, i;

    set_modes(t);
    check(jl_imm_init_sizes(&t->imm, M, N, t->modes, map, prior_x, prior_var,
                            form, JL_MIX_AUTO, t->mem, JL_IMM_STATE(M, N, Z)));
    check(jl_imm_chain(&t->imm, Pi));
    check(jl_sincos(&s, &c, z[BEARING]));
    for (j = 0; j < M; j++) {
        x[j * N + X] = z[RANGE] * c;
        x[j * N + Y] = z[RANGE] * s;
        for (i = 0; i < N; i++)
            P[j * N * N + i * (N + 1)] = sigma[i] * sigma[i];
    }
    check(jl_imm_set(&t->imm, x, P, mu, t->scratch));
}

/* --- the world --------------------------------------------------------- */

/* Close to normal: the sum of twelve uniform numbers. */
static jl_real noise(void)
{
    static unsigned long state = 1;
    jl_real sum = -6;
    int i;

    for (i = 0; i < 12; i++) {
        state = (state * 1664525UL + 1013904223UL) & 0xffffffffUL;
        sum += (jl_real)(state >> 8) / JL_C(16777216.0);
    }
    return sum;
}

static void fly(jl_real *x, int k)
{
    jl_real was[N];
    int i;

    x[RATE] = k >= 35 && k < 65 ? PI / 60 : 0;
    for (i = 0; i < N; i++)
        was[i] = x[i];
    check(turn(x, was, NULL));
}

static void measure(jl_real *z, const jl_real *x)
{
    check(radar(z, x, NULL));
    z[RANGE] += SIGMA_RANGE * noise();
    z[BEARING] += SIGMA_BEARING * noise();
}

static double apart(const jl_real *x, const jl_real *y)
{
    double dx = (double)(x[X] - y[X]), dy = (double)(x[Y] - y[Y]);

    return sqrt(dx * dx + dy * dy);
}

int main(void)
{
    static struct track ekf, ukf;
    jl_real x[N] = { -15000, 30, -6000, 250, 0 }, z[Z], raw[N], s, c;
    double error[3], sum[3] = { 0, 0, 0 };
    int k, i;

    measure(z, x);
    start(&ekf, &jl_kf_joseph, z);
    start(&ukf, &jl_kf_unscented, z);
    printf("          position error, m      P(turn)    deg/s\n"
           "   s  measured    EKF    UKF   EKF   UKF      UKF\n");
    for (k = 1; k <= STEPS; k++) {
        fly(x, k);
        measure(z, x);
        check(jl_imm_step(&ekf.imm, z, ekf.scratch));
        check(jl_imm_step(&ukf.imm, z, ukf.scratch));
        check(jl_sincos(&s, &c, z[BEARING]));
        raw[X] = z[RANGE] * c;
        raw[Y] = z[RANGE] * s;
        error[0] = apart(raw, x);
        error[1] = apart(ekf.imm.xhat, x);
        error[2] = apart(ukf.imm.xhat, x);
        for (i = 0; i < 3; i++)
            sum[i] += error[i] * error[i];
        if (k % 5 == 0)
            printf("%4.0f  %8.1f %6.1f %6.1f  %.2f  %.2f  %7.1f\n",
                   k * (double)T, error[0], error[1], error[2],
                   (double)ekf.imm.mu[TURN], (double)ukf.imm.mu[TURN],
                   (double)(ukf.imm.xhat[RATE] * 180 / PI));
    }
    printf("root mean square: measured %.1f m, EKF %.1f m, UKF %.1f m\n",
           sqrt(sum[0] / STEPS), sqrt(sum[1] / STEPS), sqrt(sum[2] / STEPS));
    return 0;
}
