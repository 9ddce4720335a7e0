#include "complain.h"

#include <stdarg.h>
#include <stdio.h>

#include "progress.h"

int complain(const char *file, long line, const char *field,
             const char *format, ...)
{
    char text[2000], where[32] = "";
    va_list arguments;
    int used;
    char *p;

    if (line > 0)
        snprintf(where, sizeof where, ":%ld", line);
    used = snprintf(text, sizeof text, "jumplink: %.500s%s: ", file, where);
    if (field != NULL && field[0] != '\0')
        used += snprintf(text + used, sizeof text - (size_t)used, "%.200s: ",
                         field);
    va_start(arguments, format);
    vsnprintf(text + used, sizeof text - (size_t)used, format, arguments);
    va_end(arguments);

    for (p = text; *p != '\0'; p++)     /* UTF-8 passes, controls do not */
        if ((unsigned char)*p < ' ' || *p == 127)
            *p = '?';
    flockfile(stderr);                  /* others may be drawing progress */
    progress_clear();
    fprintf(stderr, "%s\n", text);
    funlockfile(stderr);
    return -1;
}
