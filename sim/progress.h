/* Progress of long work, on standard error when that is a terminal. */
#ifndef SIM_PROGRESS_H
#define SIM_PROGRESS_H

/* Name the work that begins; NULL: over, wipe the line. */
void progress_begin(const char *what);

/* Wipe the line, if there is one, for something else to be said. */
void progress_clear(void);

/* done of total; draws at most ten times a second. */
void progress(long done, long total);

#endif
