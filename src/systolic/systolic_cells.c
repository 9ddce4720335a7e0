/* What a cell does in a tick.
 *
 * Each cell writes its own wires and registers, and of others it reads only
 * what was written a tick ago: the order of visits cannot matter. */
#include "systolic/systolic_parts.h"

#include <string.h>

#include "base/mathx.h"

/* --- Table 1 of the paper ------------------------------------------------- */

/* Two tiny numbers times this, a power of two, have squares that are normal. */
#define MAGNIFY (JL_EPSILON / JL_REAL_MIN)

/* c, s of a rotation that takes (r, x) to (r', 0).  Returns r'. */
static jl_real rotation(jl_systolic_packet *cs, jl_real r, jl_real x)
{
    jl_real sum = r * r + x * x, scale = 1, length;

    if (sum < 1 / MAGNIFY) {
        scale = MAGNIFY;
        r *= scale;
        x *= scale;
        sum = r * r + x * x;
    }
    length = jli_sqrt(sum);
    cs->a = r / length;
    cs->b = x / length;
    return length / scale;
}

static void boundary(jl_systolic_cell *cell, const jl_systolic_packet *in,
                     jl_systolic_packet *east)
{
    jl_real x = in->a, r = cell->r;

    *east = *in;
    if (in->mode == JL_SYSTOLIC_FADDEEV) {
        east->a = x / r;
    } else if (in->mode == JL_SYSTOLIC_MULTIPLY) {
        east->a = x * r;
    } else if (x == 0) {
        east->a = 1;
        east->b = 0;
    } else {
        cell->r = rotation(east, r, x);
    }
}

static void inner(jl_systolic_cell *cell, const jl_systolic_packet *in,
                  const jl_systolic_packet *west, jl_systolic_packet *south,
                  jl_systolic_packet *east)
{
    jl_real x = in->a, r = cell->r;

    *south = *in;
    *east = *west;
    if (in->mode == JL_SYSTOLIC_FADDEEV) {
        south->a = x - west->a * r;
    } else if (in->mode == JL_SYSTOLIC_MULTIPLY) {
        east->a = west->a + x * r;
    } else {
        south->a = west->a * x - west->b * r;
        cell->r = west->b * x + west->a * r;
    }
}

/* --- and the others ------------------------------------------------------- */

/* xhat stays here; what goes to the rows below is only handed on. */
static void diamond(jl_systolic_cell *cell, const jl_systolic_packet *in,
                    const jl_systolic_packet *west, jl_systolic_packet *south,
                    jl_systolic_packet *east)
{
    cell->mode = JL_SYSTOLIC_PASS;
    if (in->mode == JL_SYSTOLIC_FADDEEV) {
        cell->r = in->a;
        return;
    }
    *south = *in;
    if (in->mode == JL_SYSTOLIC_MULTIPLY) {
        cell->mode = in->mode;
        *east = *in;
        east->a = in->a * cell->r;
        if (west->mode != JL_SYSTOLIC_IDLE)
            east->a += west->a;
    }
}

/* --- a tick --------------------------------------------------------------- */

static void visit(jl_systolic *array, jl_systolic_cell *cell)
{
    static const jl_systolic_packet idle = { JL_SYSTOLIC_IDLE, 0, 0, 0 };
    const jl_systolic_packet *in = &idle, *west = &idle;
    jl_systolic_packet *south = &cell->south[!array->phase];
    jl_systolic_packet *east = &cell->east[!array->phase];
    int is_below = cell->row >= array->r;

    if (cell->host.mode != JL_SYSTOLIC_IDLE)
        in = &cell->host;
    else if (cell->north >= 0)
        in = &array->cell[cell->north].south[array->phase];
    if (cell->west >= 0)
        west = &array->cell[cell->west].east[array->phase];
    *south = *east = idle;
    cell->mode = in->mode;
    if (in->mode == JL_SYSTOLIC_IDLE)
        return;
    if (cell->part == JL_SYSTOLIC_SUBTRACTOR) {
        *east = *in;
        east->a = in->a - in->b;
    } else if (cell->part == JL_SYSTOLIC_DIAMOND) {
        diamond(cell, in, west, south, east);
    } else if (is_below && in->mode == JL_SYSTOLIC_FADDEEV) {
        cell->mode = JL_SYSTOLIC_IDLE;          /* it has left the array */
    } else if (!is_below && in->mode == JL_SYSTOLIC_MULTIPLY) {
        cell->mode = JL_SYSTOLIC_PASS;
        *south = *in;
    } else {
        if (in->mode == JL_SYSTOLIC_QR && (in->tag & JLI_FIRST))
            cell->r = cell->start;
        if (cell->row == cell->column)
            boundary(cell, in, east);
        else
            inner(cell, in, west, south, east);
        if (in->mode == JL_SYSTOLIC_QR && (in->tag & JLI_LAST))
            cell->end = cell->r;
    }
}

void jli_systolic_work(jl_systolic *array)
{
    int i;

    for (i = 0; i < array->cells; i++)
        visit(array, array->cell + (array->visit ? array->visit[i] : i));
    for (i = 0; i < array->cells; i++)
        array->count[array->cell[i].mode]++;
    array->phase = !array->phase;
    array->tick++;
    if (array->trace != NULL)
        array->trace(array, array->context);
}
