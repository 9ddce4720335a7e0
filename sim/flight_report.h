/* What the runs over a recorded flight gave: table, CSV files, plots. */
#ifndef SIM_FLIGHT_REPORT_H
#define SIM_FLIGHT_REPORT_H

#include "run.h"

/* The velocity that the aircraft itself reported: the truth to compare with. */
#define FLIGHT_TRUTH "v_east_mps,v_north_mps"

struct flight_run {
    const struct model *source;
    char model[64];             /* "two_modes"                              */
    char positions[16];         /* "fresh", "recognised"                    */
    char name[96];              /* "two_modes_fresh"                        */
    struct estimates e;
    struct traffic traffic;
    int same;                   /* the serial filter's bits                 */
    double apart;               /* ... or so many sigmas from them at most;
                                   NaN without covariances                  */
    int partial;                /* the run failed: what is here is a start  */
    double serial_us;           /* median step of the serial filter         */
};

struct flight_report {
    const struct data_file *data;
    const struct options *options;
    struct flight_run *runs;
    int count;
};

/* 0 if the model moves in two axes, else -1 after a message. */
int flight_fits(const struct model *model);

/* Room for `most` runs.  Returns 0, or -1 after a message. */
int flight_report_open(struct flight_report *report,
                       const struct data_file *data,
                       const struct options *options, int most);
void flight_report_close(struct flight_report *report);

/* The name of a model: its file's without folder and ending. */
void flight_model_name(char *name, int size, const struct model *model);

/* Name a run after its model and its way with held positions. */
void flight_run_name(struct flight_run *run, const struct model *model,
                     enum hold hold);

/* Print the table and leave table.txt, table.csv, the estimates, track.csv and
 * the plots in the folder; a partial run's estimates in a file whose name ends
 * in .partial, and no plots then.  Returns the exit status: 1 if a file or plot
 * could not be made, or if a run is partial, or has not the serial filter's
 * bits although it should: without --exchange reduce. */
int flight_report_write(const struct flight_report *report,
                        const char *folder);

#endif
