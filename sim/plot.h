/* Plots of a run's CSV files by gnuplot.  Each makes three files in a folder:
 * NAME.gp, the script, to be changed and run again; NAME.png; and NAME.svg. */
#ifndef SIM_PLOT_H
#define SIM_PLOT_H

enum plot_style {
    PLOT_DOTS,                  /* measurements                             */
    PLOT_LINE,                  /* estimates                                */
    PLOT_DASHES,                /* the same, for one that may hide another  */
    PLOT_TRUTH,                 /* what really was: thin and dashed         */
    PLOT_SHADE                  /* grey while y is not 0: lost measurements */
};

/* A curve: two columns of a CSV file.  Empty fields and nan leave a gap. */
struct plot_series {
    const char *file;           /* as seen from the folder, or absolute     */
    const char *x, *y;          /* names of columns                         */
    const char *title;          /* in the legend; NULL: not there           */
    enum plot_style style;
};

/* All return 0; 1 when gnuplot is not installed (the script is there, and one
 * line on standard error); or -1 with one line on standard error.  A title
 * may be NULL. */

/* Seen from above: columns in metres, drawn in km, the same scale both ways. */
int plot_track(const char *folder, const char *name, const char *title,
               const struct plot_series *series, int count);

/* Mode probabilities, columns mu0.. of a file over its column `time`, a lane
 * for each mode.  mode [M] are the names of the modes, or NULL: "mode 0".. */
int plot_modes(const char *folder, const char *name, const char *title,
               const char *file, const char *time, const char *const *mode,
               int M);

/* Curves over time in seconds; y_label with its unit. */
int plot_curves(const char *folder, const char *name, const char *title,
                const char *y_label, const struct plot_series *series,
                int count);

/* Errors over time in seconds, with a logarithmic scale; y_label with its
 * unit, "velocity error in m/s". */
int plot_errors(const char *folder, const char *name, const char *title,
                const char *y_label, const struct plot_series *series,
                int count);

/* What each of `cells` cells did in each tick: columns tick, cell, mode of a
 * file; mode [M] are the names of the modes.  A line below the first `left`. */
int plot_cells(const char *folder, const char *name, const char *title,
               const char *file, const char *const *mode, int M, int cells,
               int left);

#endif
