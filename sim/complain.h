/* How the program says that an input is wrong: one line on standard error. */
#ifndef SIM_COMPLAIN_H
#define SIM_COMPLAIN_H

/* Print "jumplink: FILE:LINE: field: what" and return -1, so that a reader can
 * write `return complain(...)`.  line 0 and field NULL or "" are left out.  It
 * stays one line, whatever octets the file put into the words. */
#if defined(__GNUC__)
__attribute__((format(printf, 4, 5)))
#endif
int complain(const char *file, long line, const char *field,
             const char *format, ...);

#endif
