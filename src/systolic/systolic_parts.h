/* What the files of the systolic array share. */
#ifndef JL_SYSTOLIC_PARTS_H
#define JL_SYSTOLIC_PARTS_H

#include "jumplink/systolic.h"

#if JL_REAL_FLOAT
#define jli_systolic_work jli_systolic_work_f32
#define jli_systolic_collect jli_systolic_collect_f32
#define jli_systolic_prepare jli_systolic_prepare_f32
#define jli_systolic_evaluate jli_systolic_evaluate_f32
#define jli_systolic_feed jli_systolic_feed_f32
#endif

/* A tick is: the host evaluates what it has got the arguments of; rows are
 * launched and their elements put at the array's ports; all cells work; the
 * host collects what has left the array. */
int jli_systolic_evaluate(jl_systolic *array);
void jli_systolic_feed(jl_systolic *array, int launch);
void jli_systolic_work(jl_systolic *array);
void jli_systolic_collect(jl_systolic *array);

/* Evaluate what the schedule says never changes. */
int jli_systolic_prepare(jl_systolic *array);

/* Tags of QR: the first row of a step takes U_R as what is there, the last one
 * leaves what cov wants. */
enum { JLI_FIRST = 1, JLI_LAST = 2 };

/* The blocks of rows of products: H F and F; for B, c f of B, f, c f of A. */
enum { JLI_SENSE = 0, JLI_MOVE = 1, JLI_PREDICT = 2 };

/* Rows of a block, and the tag of its first: the column of the fed-back rows
 * that it makes, but for the last block, which is for the diamonds alone. */
#define JLI_BLOCK_ROWS(t, r, block) \
    ((block) == JLI_MOVE ? (t)->N - (r) \
     : (block) == JLI_SENSE || (t)->delay ? (r) : 0)
#define JLI_BLOCK_TAG(t, r, block) \
    ((block) == JLI_SENSE ? 0 : (block) == JLI_MOVE ? (r) : (t)->N)

/* Index of cell (i,j) of a triangle, of diamond j, of the subtractor. */
#define JLI_CELL(t, i, j) \
    ((t)->first + (i) * (t)->N - (i) * ((i) - 1) / 2 + (j) - (i))
#define JLI_DIAMOND(a, j) ((a)->cells - 1 - (a)->n + (j) - (a)->r)
#define JLI_SUBTRACTOR(a) ((a)->cells - 1)

/* Which state or parameter is the k-th in the left triangle. */
#define JLI_STATE_OF(a, k) \
    (!(a)->schedule.y_first ? (k) \
     : (k) < (a)->m ? (a)->n + (k) : (k) - (a)->m)

#endif
