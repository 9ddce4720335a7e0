#include "progress.h"

#include <stdio.h>
#include <unistd.h>

#include "clock.h"

/* PEs that are threads may complain while the host makes progress: the lock
 * of stderr also guards drawn_us. */
static const char *name = "";
static double drawn_us;

void progress_clear(void)
{
    flockfile(stderr);
    if (drawn_us > 0)
        fprintf(stderr, "\r\033[K");
    drawn_us = 0;
    funlockfile(stderr);
}

void progress_begin(const char *what)
{
    progress_clear();
    name = what == NULL ? "" : what;
}

void progress(long done, long total)
{
    double now = clock_us();

    if (name[0] == '\0')
        return;
    flockfile(stderr);
    if (now - drawn_us >= 1e5 && isatty(STDERR_FILENO)) {
        drawn_us = now;
        fprintf(stderr, "\r\033[K%s: %ld of %ld", name, done, total);
        fflush(stderr);
    }
    funlockfile(stderr);
}
