/* Whether a filter is as good as it thinks: innovations, their nis, and where
 * the truth is known the nees, row by row (Bar-Shalom, Li, Kirubarajan 2001,
 * section 5.4).  Of a serial run: in a parallel one nobody knows them all. */
#ifndef SIM_DIAGNOSTICS_H
#define SIM_DIAGNOSTICS_H

#include <stdio.h>

#include "data_file.h"
#include "jumplink/imm.h"
#include "model_file.h"
#include "options.h"

struct diagnostics {
    int M, m, n;
    int known;                  /* components of the state whose truth the
                                   data has                                 */
    int *component;             /* [known] these                            */
    char *truth;                /* their columns, "a,b"; NULL: none         */
    jl_real *work;              /* [known,known], [known]                   */
    const struct data_file *data;
    double *v;                  /* [rows,columns] of the file; NaN: there is
                                   none in this row                         */
};

/* Take the names of --truth apart.  Returns 0, or 2 after a message. */
int diagnostics_open(struct diagnostics *d, const struct model *model,
                     const struct options *options);
void diagnostics_close(struct diagnostics *d);

/* Room for a record, read with the extra columns d->truth.  Returns 0, or -1
 * after a message. */
int diagnostics_room(struct diagnostics *d, const struct data_file *data);

/* Take down a row: what the filter says of the step just made. */
void diagnostics_note(struct diagnostics *d, long row, const jl_imm *imm);

/* Columns, each after a comma: of each mode j nu<j>_<a>, nis<j>, nis_mean<j>;
 * rejected, 0 or 1; nees.  nan: not in this row. */
void diagnostics_write_names(const struct diagnostics *d, FILE *out);
void diagnostics_write(const struct diagnostics *d, long row, FILE *out);

#endif
