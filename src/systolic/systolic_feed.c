/* Which row is fed to the array in which tick.
 *
 * A row that is launched in tick t is a wavefront: it enters column j in tick
 * t + j, since what it meets there comes from the west one column a tick, and
 * cell (i,j) works on it in tick t + i + j (a tick later below the diamonds).
 * Products that enter column r at row i in a tick count as launched r + i ticks
 * before it.  So two rows cannot meet if no two have the same launch, and what
 * follows is all there is to know.
 *
 *   - Estimates leave row r - 1: that of column j in tick t + r + j.  From them
 *     come F, and so the products' launch.
 *   - U F' leaves row i of N in the east in tick t + i + N (one later if there
 *     are diamonds), its column k that much after launch of row k of F: one
 *     after the other, just as they are wanted back at the north.  So row i can
 *     be launched when every column k will be in time, t + k >= launch of
 *     k + i + N.
 *   - Sums leave the diamonds in tick t + n + 2 r, differences one later.
 *   - The QR must not overtake the products, which need U; nor the Faddeev row
 *     the QR; nor products of the next step the Faddeev row: this is the order
 *     of launches.  But the QR enters at row 0, products at row r: its first
 *     row may enter before the last of them if it has the later launch.
 *
 * So a step takes, from the Faddeev row of A to the next, with Q first:
 *     m - 1 (at least 1), F waits for ybar ([y; x]);  n + m, F;  r, H F
 *     n + m + 2 r from the first of H F to the first row U F' (or until the
 *         n + m rows U_Q G' are in, whichever is more);  n + m, U F'
 * or, where H is what all waits for, 2 n - 1 from f to H F: n - 1 to the last
 * row of f, whose sum takes n through the diamonds. */
#include "systolic/systolic_parts.h"

/* feed of a cell: 1 .. rows for a row of the QR, rows + 1 for the Faddeev row,
 * above that a row of products by its tag. */
static int qr_rows(const jl_systolic *array, const jl_systolic_triangle *t)
{
    return t->noises + t->N - array->r;
}

/* --- products ------------------------------------------------------------- */

/* Rows of a block that are not fed yet. */
static int to_come(const jl_systolic *array, const jl_systolic_triangle *t,
                   int block)
{
    return JLI_BLOCK_ROWS(t, array->r, block) - t->sent[block];
}

static int remaining(const jl_systolic *array, const jl_systolic_triangle *t)
{
    return to_come(array, t, 0) + to_come(array, t, 1) + to_come(array, t, 2);
}

/* The block of which a row can be fed now; -1: none. */
static int choose_block(const jl_systolic *array, const jl_systolic_triangle *t)
{
    static const int orders[2][3] = {
        { JLI_SENSE, JLI_MOVE, JLI_PREDICT },
        { JLI_MOVE, JLI_SENSE, JLI_PREDICT }
    };
    int rule = array->schedule.products, i;
    const int *order = orders[t->delay || rule == JL_SYSTOLIC_F_FIRST];

    if (t->block >= 0 && (t->delay || rule != JL_SYSTOLIC_ROWS)
        && to_come(array, t, t->block) > 0)
        return t->block;
    for (i = 0; i < 3; i++) {
        int b = order[i];

        if (to_come(array, t, b) == 0)
            continue;
        if (t->known[b] >= t->step)
            return b;
        if (!t->delay && rule == JL_SYSTOLIC_F_FIRST)
            break;
    }
    return -1;
}

/* Launch a row of products, which enters the array in this tick. */
static void launch_product(jl_systolic *array, jl_systolic_triangle *t,
                           int port, int depth)
{
    long launch = array->tick - depth;
    int n = array->n, r = array->r, block, tag;

    if (launch <= t->busy)
        return;
    /* What B predicts is A's, too: has A taken what was predicted before? */
    if (t->delay && array->sums_of < t->step
        && (array->left.step < t->step
            || launch + n + 2 * r < array->left.busy + array->left.N))
        return;
    block = choose_block(array, t);
    if (block < 0)
        return;
    if (t->delay && array->sums_of < t->step) {
        array->sums_of = t->step;
        array->sums = array->differences = 0;
    }
    tag = JLI_BLOCK_TAG(t, r, block) + t->sent[block];
    if (t->sent[block]++ == 0)
        t->launch[block] = launch;
    t->block = block;
    if (tag < t->N && launch - tag + r + t->N + t->delay > t->due)
        t->due = launch - tag + r + t->N + t->delay;
    array->cell[port].feed = qr_rows(array, t) + 2 + tag;
}

/* --- rows of the QR, and the one for Faddeev ------------------------------ */

static int noise_row(const jl_systolic *array, const jl_systolic_triangle *t,
                     int row)
{
    if (array->schedule.noise_first)
        return row < t->noises ? row : -1;
    return row - (t->N - array->r);
}

/* Will the products that are still to come have been launched before this tick,
 * one after another? */
static int products_precede(const jl_systolic *array,
                            const jl_systolic_triangle *t, int depth)
{
    int more = remaining(array, t), b;
    long next = array->tick + 1 - depth;

    if (more == 0)
        return 1;
    if (t->delay && array->sums_of < t->step)
        return 0;                       /* B waits for A */
    for (b = 0; b < 3; b++)
        if (to_come(array, t, b) > 0 && t->known[b] < t->step)
            return 0;
    if (next <= t->busy)
        next = t->busy + 1;
    return next + more <= array->tick;
}

static int can_rotate(const jl_systolic *array, const jl_systolic_triangle *t,
                      int depth)
{
    if (!products_precede(array, t, depth))
        return 0;
    if (noise_row(array, t, t->rows) >= 0)
        return t->noise_known >= t->step;
    /* Not earlier than the last products enter, which is after the last step's
     * end: cov relies on it. */
    return remaining(array, t) == 0 && array->tick >= t->due
        + (t->rows - (array->schedule.noise_first ? t->noises : 0));
}

/* Will the k-th difference be there in tick + k, and the k-th prediction in
 * tick + r + k? */
static int can_correct(const jl_systolic *array, const jl_systolic_triangle *t)
{
    int n = array->n, r = array->r, b = t->delay ? JLI_SENSE : JLI_PREDICT;
    const jl_systolic_triangle *B = &array->right;
    int is_over = B->step > t->step;
    long later = !t->delay && array->schedule.y_first ? array->m : 0;

    if (array->sums_of != t->step || array->step + 1 < t->step
        || array->has_yp < t->step)
        return 0;
    if (array->differences < 2 * r
        && ((B->sent[b] < r && !is_over)
            || array->sums > array->differences + 1
            || array->tick < B->launch[b] + n + 2 * r + 1))
        return 0;
    return array->tick + r + later >= B->launch[JLI_MOVE] + n + 2 * r;
}

static void launch_row(jl_systolic *array, jl_systolic_triangle *t, int depth)
{
    int rows = qr_rows(array, t);

    if (t->rows < rows) {
        if (can_rotate(array, t, depth))
            array->cell[t->first].feed = ++t->rows;
    } else if (can_correct(array, t)) {
        array->cell[t->first].feed = rows + 1;
        t->busy = array->tick;
        t->step++;
        t->rows = t->out = 0;
        t->sent[0] = t->sent[1] = t->sent[2] = 0;
        t->block = -1;
        t->due = 0;
    }
}

/* --- elements ------------------------------------------------------------- */

static void put_element(jl_systolic *array, const jl_systolic_triangle *t,
                        jl_systolic_cell *cell)
{
    int r = array->r, inside = t->N - r, rows = qr_rows(array, t);
    int j = cell->column, row = cell->feed - 1;
    jl_systolic_packet *p = &cell->host;

    p->tag = 0;
    p->b = 0;
    if (row < 0) {
        p->mode = JL_SYSTOLIC_IDLE;
        p->a = 0;
    } else if (row < rows) {
        int k = noise_row(array, t, row);
        int u = array->schedule.noise_first ? row - t->noises : row;

        p->mode = JL_SYSTOLIC_QR;
        p->tag = (row == 0 ? JLI_FIRST : 0) | (row == rows - 1 ? JLI_LAST : 0);
        p->a = k >= 0 ? t->noise[k * t->N + j] : t->product[u * t->N + j];
    } else if (row == rows) {
        p->mode = JL_SYSTOLIC_FADDEEV;
        if (j < r)
            p->a = array->sum[(t->delay ? r : 0) + j];
        else
            p->a = array->xp[t->delay ? j - r : JLI_STATE_OF(array, j - r)];
    } else {
        p->mode = JL_SYSTOLIC_MULTIPLY;
        p->tag = row - rows - 1;
        p->a = t->map[p->tag * inside + j - r];
    }
}

/* A row goes on to the next column, of those from cell `first` on. */
static void shift(jl_systolic *array, int first, int columns)
{
    int j;

    for (j = columns - 1; j > 0; j--)
        array->cell[first + j].feed = array->cell[first + j - 1].feed;
    array->cell[first].feed = 0;
}

static void put_elements(jl_systolic *array, const jl_systolic_triangle *t,
                         int first, int columns)
{
    int j;

    for (j = 0; j < columns; j++)
        put_element(array, t, array->cell + first + j);
}

static void feed_triangle(jl_systolic *array, jl_systolic_triangle *t,
                          int launch)
{
    int r = array->r, inside = array->schedule.inside;
    int depth = inside ? 2 * r : r, n = t->N - r;
    int port = !inside ? t->first + r
        : t->delay ? JLI_DIAMOND(array, r) : JLI_CELL(t, r, r);

    shift(array, t->first, t->N);
    if (inside)
        shift(array, port, n);
    if (launch) {
        launch_product(array, t, port, depth);
        launch_row(array, t, depth);
    }
    put_elements(array, t, t->first, t->N);
    if (inside)
        put_elements(array, t, port, n);
}

void jli_systolic_feed(jl_systolic *array, int launch)
{
    jl_systolic_packet *p = &array->cell[JLI_SUBTRACTOR(array)].host;
    int d = array->differences, r = array->r;

    feed_triangle(array, &array->left, launch);
    feed_triangle(array, &array->right, launch);
    p->mode = JL_SYSTOLIC_IDLE;
    if (array->sums > d && array->sums_of <= array->step + 1) {
        int first = array->sum_first;

        p->mode = JL_SYSTOLIC_SUBTRACT;
        p->tag = (d < r ? first : 1 - first) * r + d % r;
        p->a = array->sum[p->tag];
        p->b = array->z[d % r];
    }
}
