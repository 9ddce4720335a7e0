/* SIGINT, SIGTERM and SIGHUP end a run in order, not the process at once. */
#ifndef SIM_INTERRUPT_H
#define SIM_INTERRUPT_H

/* From now on these signals are only noted.  Blocked calls return early. */
void interrupt_catch(void);

/* The name of the one that came, "SIGINT", or NULL. */
const char *interrupted(void);

#endif
