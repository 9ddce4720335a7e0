/* The MEKF (mekf.h) on a systolic array, one clock tick at a time: what Mu and
 * Dai, "A parallel architecture for modified extended Kalman filter", draw.
 *
 * Two triangles of cells, of N = n+m+r rows for filter A (left) and of n+r rows
 * for B (right).  Of each, the first r rows come to hold V', the rest U:
 *
 *      left          right            A cell reads its north and west
 *      a b b b b b   a b b b b        neighbours' wires and writes its own
 *        a b b b b     a b b b        south and east ones.  Through the
 *      . . . . . .   . . d d d s      boundary cells a and the inner cells b,
 *          a b b b       a b b        x goes south; rotations (c, s), quotients
 *            a b b         a b        s or partial sums go east.  Diamonds d
 *              a b           a        hold xhat; s subtracts z.
 *                a
 *
 *      mode       a                               b
 *      QR         r' = sqrt(r^2 + x^2),           x_out = c x - s r
 *                 c = r / r', s = x / r', r = r'  r = s x + c r
 *      Faddeev    s = x / r                       x_out = x - s r
 *      multiply   s = x r                         s_out = s_in + x r
 *
 * A step feeds the rows of mekf.h's matrices, U_R being in place already, in
 * mode QR; [(c xp - z)' | xp'] in mode Faddeev through the first r rows, below
 * which the estimate comes out; and for the next step the rows of H F and F in
 * mode multiply, through the rows that hold U: products U F', U F'H' come out
 * in the east and are fed back from the north; diamonds do the same to xhat.
 * f, F, G, H, c, h, and H F and U_Q G' of them, are evaluated outside, by the
 * host, in no time, but not before their arguments have left the array.
 */
#ifndef JL_SYSTOLIC_H
#define JL_SYSTOLIC_H

#include "mekf.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- cells ---------------------------------------------------------------- */

typedef enum jl_systolic_mode {
    JL_SYSTOLIC_IDLE,
    JL_SYSTOLIC_QR,
    JL_SYSTOLIC_FADDEEV,
    JL_SYSTOLIC_MULTIPLY,
    JL_SYSTOLIC_SUBTRACT,       /* the subtractor                           */
    JL_SYSTOLIC_PASS            /* hands on or keeps a number: no arithmetic */
} jl_systolic_mode;
#define JL_SYSTOLIC_MODES 6

typedef enum jl_systolic_part {
    JL_SYSTOLIC_LEFT, JL_SYSTOLIC_RIGHT, JL_SYSTOLIC_DIAMOND,
    JL_SYSTOLIC_SUBTRACTOR
} jl_systolic_part;

/* What is on a wire; mode idle: nothing. */
typedef struct jl_systolic_packet {
    int mode, tag;
    jl_real a, b;               /* x; or c, s; or s; or a sum               */
} jl_systolic_packet;

typedef struct jl_systolic_cell {
    int part;                   /* jl_systolic_part                         */
    int row, column;            /* in its triangle, from 0; a diamond is of
                                   the right triangle's column, row r       */
    int mode;                   /* what it did in the last tick             */
    jl_real r;                  /* what it holds                            */

    /* the library's own */
    int north, west;            /* the neighbours, -1: none                 */
    int feed;                   /* which row the host feeds it of           */
    jl_systolic_packet host;    /* ... and what of it                       */
    jl_systolic_packet south[2], east[2];       /* read one, write one      */
    jl_real start, end;         /* r before and after a QR                  */
} jl_systolic_cell;

/* How many cells: two triangles, diamonds, subtractor. */
#define JL_SYSTOLIC_CELLS(n, m, r) \
    ((n) + 1 + (((n) + (m) + (r)) * ((n) + (m) + (r) + 1) \
                + ((n) + (r)) * ((n) + (r) + 1)) / 2)

/* --- schedules ------------------------------------------------------------ */

/* A row is fed as soon as what it needs is known, its port is free, and the
 * rows before it have been fed; this is the order. */
typedef struct jl_systolic_schedule {
    int known;                  /* what the host knows a step ahead, since it
                                   never changes: the sum of JL_SYSTOLIC_KNOW_*.
                                   Evaluated once, by init                  */
    int y_first;                /* 1: the state in the array is [y; x]      */
    int noise_first;            /* 1: rows U_Q G' before rows U F'          */
    int inside;                 /* 1: F and H F enter at row r; 0: at row 0,
                                   whose cells pass them on                 */
    int products;               /* JL_SYSTOLIC_F_FIRST: F, then H F;
                                   _BLOCKS: whichever is known first, H F if
                                   both are; _ROWS: a row of H F as soon as it
                                   is known, even between rows of F         */
} jl_systolic_schedule;

enum {
    JL_SYSTOLIC_KNOW_F = 1,     /* f, and d(f x)/dy, dh/d[x; y]             */
    JL_SYSTOLIC_KNOW_C = 2,     /* c, and H                                 */
    JL_SYSTOLIC_KNOW_G = 4
};
enum { JL_SYSTOLIC_F_FIRST, JL_SYSTOLIC_BLOCKS, JL_SYSTOLIC_ROWS };

/* Ticks of a step in the steady state, counted with p1 = n, p2 = m, n to 8, m
 * and r to 5, by the tests:
 *     paper  all is known ahead, so right for linear models only
 *                3n + 3m + 2r + 1, where r <= n + m
 *     naive  [x; y], rows U F' first, products through row 0
 *                6n + 4m + 4r - 2
 *     best   [y; x], rows U_Q G' first, products at row r, in blocks
 *                max(max(1, m-1) + 3n + 3m + 2r, 4n + 3m + 2r - 2),
 *                where r < n + m (n = m = r = 1: 8)
 *            with JL_SYSTOLIC_KNOW_C and _G added
 *                max(1, m-1) + 3n + 3m + r, where r <= n, r <= m, n <= 2m
 *     mixed  best, but with JL_SYSTOLIC_ROWS: 1 to 4 ticks less where n <= m
 * Elsewhere B is the slower one, or waits for G, and steps may take turns. */
extern const jl_systolic_schedule jl_systolic_paper;
extern const jl_systolic_schedule jl_systolic_naive;
extern const jl_systolic_schedule jl_systolic_best;
extern const jl_systolic_schedule jl_systolic_mixed;

/* What the paper counts for a step.  In a machine with a register on every wire
 * the first row of products follows the Faddeev row, a tick later. */
#define JL_SYSTOLIC_PAPER_TICKS(n, m, r) (3 * (n) + 3 * (m) + 2 * (r))

/* --- the machine ---------------------------------------------------------- */

typedef struct jl_systolic jl_systolic;

/* Called at the end of every tick, of which array->tick is the number, from 1;
 * what each cell did is in array->cell[].mode. */
typedef void (*jl_systolic_trace)(const jl_systolic *array, void *context);

/* A triangle and what is fed to it; the library's own. */
typedef struct jl_systolic_triangle {
    int first;                  /* its first cell; rows follow each other   */
    int N;                      /* rows                                     */
    int delay;                  /* ticks through the diamonds: 0 or 1       */
    int noises;                 /* rows U_Q G'                              */
    int step;                   /* the step it is fed for                   */
    int known[3], noise_known;  /* for which step the host has the rows     */
    int sent[3], block;         /* rows of products fed, of each block      */
    int rows;                   /* rows of the QR fed                       */
    int out;                    /* elements of the estimate that are out    */
    long launch[3];             /* of a block's first row                   */
    long busy;                  /* launch of the last Faddeev row           */
    long due;                   /* when U F' can be fed                     */
    jl_real *map;               /* [..,N-r] rows H F, F; c f, f, c f        */
    jl_real *product;           /* [N-r,N]  U F'H', U F'                    */
    jl_real *noise;             /* [noises,N] U_Q G'H', U_Q G'              */
} jl_systolic_triangle;

struct jl_systolic {
    /* set by the user; init: NULL */
    jl_systolic_trace trace;
    void *context;
    const int *visit;           /* [cells] the order in which a tick visits
                                   the cells, NULL: as they are.  Of no effect
                                   on anything, as a test shows             */
    /* to be read */
    int n, m, r, p1, p2;
    int cells;                  /* JL_SYSTOLIC_CELLS                        */
    jl_systolic_cell *cell;     /* [cells]                                  */
    int step;                   /* steps done                               */
    long tick;                  /* ticks done                               */
    long count[JL_SYSTOLIC_MODES];      /* cell-ticks of each mode, idle too */
    jl_real *x;                 /* [n+m] xbar, ybar                         */
    jl_real *xhat;              /* [n]                                      */

    /* the library's own */
    const jl_mekf_model *model;
    jl_mekf_c c;
    jl_systolic_schedule schedule;
    jl_systolic_triangle left, right;
    int phase;                  /* which wires are read                     */
    int status;                 /* what the estimates are                   */
    int has_x, has_y, has_xhat; /* which step's estimates are out           */
    int has_xp, has_yp;         /* ... predictions are known                */
    int has_f, has_F, has_G, has_c, has_cc;     /* ... matrices             */
    int sums_of, sum_first;     /* c xp from the diamonds: of which step, of
                                   which filter first                       */
    int sums, differences;      /* how many are out, and what is left of z  */
    jl_real *mem, *z, *f, *F, *G, *H, *c_A, *c_B, *xp, *xp_host, *sum, *UQ;
    jl_real *work;
    int reals;
};

/* Reals of state, half of it to undo a step that fails: the estimates and F, G,
 * H, c; what is fed to A; and to B. */
#define JL_SYSTOLIC_STATE(n, m, r, p1, p2) \
    (2 * (JL_SYSTOLIC_HOST(n, m, r, (p1) + (p2)) \
          + JL_SYSTOLIC_FED((n) + (m), r, (p1) + (p2)) \
          + JL_SYSTOLIC_FED(n, r, p1)))
#define JL_SYSTOLIC_HOST(n, m, r, p) \
    ((n) * ((n) + 1) + (p) * (p) + (r) * (2 * (n) + 3) \
     + ((n) + (m)) * (2 * ((n) + (m)) + 2 * (p) + 2 * (r) + 3) + (r) * (r))
#define JL_SYSTOLIC_FED(n, r, p) \
    (((n) + 2 * (r)) * (n) + ((n) + (p)) * ((n) + (r)))

/* Bind an array to its memory and give it a filter's state, factors, model and
 * choice of c; the filter may go, its model must not.
 *     cell [cap_cells]  cap_cells >= 2 JL_SYSTOLIC_CELLS (half to undo a step)
 *     mem  [cap]        cap >= JL_SYSTOLIC_STATE
 * Returns JL_OK; JL_ERANGE (filter->spread, for which the array has no rows; a
 * schedule that is none), JL_ENOMEM, or what a function returned that is known
 * ahead: *array is untouched then. */
int jl_systolic_init(jl_systolic *array, const jl_mekf *filter,
                     const jl_systolic_schedule *schedule,
                     jl_systolic_cell *cell, int cap_cells, jl_real *mem,
                     int cap);

/* Ticks until the estimates of a step with z [r] are out.  By then rows of the
 * next one are on their way.  Same estimates as jl_mekf_step, but for rounding,
 * and the same codes, and JL_ERANGE for z NULL: there is no step without a
 * measurement.  All is unchanged then, though trace has seen the ticks. */
int jl_systolic_step(jl_systolic *array, const jl_real *z);

/* P = U'U [n+m,n+m] of A; P1 [n,n] of B; NULL for what is not wanted.  Of the
 * last step: the last cells may get theirs later than the estimate is out, so
 * a copy of the array (in memory of its own) ticks on. */
void jl_systolic_cov(jl_systolic *array, jl_real *P, jl_real *P1);

/* Cell-ticks of work in count, as the paper has it: QR, Faddeev, multiply.
 * Utilisation is work / (cells x ticks). */
#define JL_SYSTOLIC_WORK(count) \
    ((count)[JL_SYSTOLIC_QR] + (count)[JL_SYSTOLIC_FADDEEV] \
     + (count)[JL_SYSTOLIC_MULTIPLY])

#ifdef __cplusplus
}
#endif
#endif
