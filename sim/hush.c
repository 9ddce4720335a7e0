#include "hush.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

int hush_begin(void)
{
    int saved, null = open("/dev/null", O_WRONLY | O_CLOEXEC);

    fflush(stderr);
    saved = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
    if (saved >= 0 && null >= 0)
        dup2(null, STDERR_FILENO);
    if (null >= 0)
        close(null);
    return saved;
}

void hush_end(int saved)
{
    if (saved < 0)
        return;
    fflush(stderr);
    dup2(saved, STDERR_FILENO);
    close(saved);
}
