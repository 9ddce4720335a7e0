#include "progress.h"

#include <stdio.h>
#include <unistd.h>

#include "clock.h"

static const char *name = "";
static double drawn_us;

void progress_begin(const char *what)
{
    if (isatty(STDERR_FILENO))
        fprintf(stderr, "\r\033[K");
    name = what == NULL ? "" : what;
    drawn_us = 0;
}

void progress(long done, long total)
{
    double now = clock_us();

    if (name[0] == '\0' || now - drawn_us < 1e5 || !isatty(STDERR_FILENO))
        return;
    drawn_us = now;
    fprintf(stderr, "\r\033[K%s: %ld of %ld", name, done, total);
    fflush(stderr);
}
