/* Standard error turned off for a while: LCM explains its failures there at
 * length, and we have a line of our own. */
#ifndef SIM_HUSH_H
#define SIM_HUSH_H

/* Returns what hush_end needs to turn it on again. */
int hush_begin(void);
void hush_end(int saved);

#endif
