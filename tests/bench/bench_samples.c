/* Samples of a time, and the file that the figures go to. */
#include "bench.h"

#include <stdlib.h>

void bench_must(int ok, const char *what)
{
    if (ok)
        return;
    fprintf(stderr, "bench: failed: %s\n", what);
    exit(1);
}

void samples_add(struct samples *s, double us)
{
    if (s->count == s->room) {
        s->room = s->room == 0 ? 1024 : 2 * s->room;
        s->us = realloc(s->us, (size_t)s->room * sizeof *s->us);
        bench_must(s->us != NULL, "memory for samples");
    }
    s->us[s->count++] = us;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

static double at(struct samples *s, int i)
{
    bench_must(s->count > 0, "no sample of a time");
    qsort(s->us, (size_t)s->count, sizeof *s->us, ascending);
    return s->us[i];
}

double samples_least(struct samples *s)
{
    return at(s, 0);
}

double samples_median(struct samples *s)
{
    return at(s, s->count / 2);
}

void bench_open(struct out_file *out, int argc, char **argv, const char *name)
{
    char path[1000];

    snprintf(path, sizeof path, "%s/%s", argc > 1 ? argv[1] : "build/bench",
             name);
    if (out_open(out, path) != 0)
        exit(1);
}

void bench_close(struct out_file *out)
{
    if (out_close(out, 1) != 0)
        exit(1);
}
