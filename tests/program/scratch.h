/* A folder for a test's files, and what the tested code says on standard
 * error.  Failures here are failures of the test's surroundings: they abort. */
#ifndef TESTS_SCRATCH_H
#define TESTS_SCRATCH_H

#include "close.h"

#include <fcntl.h>
#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char scratch_dir[64];

static inline void scratch_must(int good, const char *what)
{
    if (good)
        return;
    perror(what);
    abort();
}

/* --- files ------------------------------------------------------------- */

/* cmocka's group setup and teardown. */
static inline int scratch_setup(void **state)
{
    (void)state;
    strcpy(scratch_dir, "/tmp/jumplink_test_XXXXXX");
    scratch_must(mkdtemp(scratch_dir) != NULL, "mkdtemp");
    return 0;
}

static inline int scratch_delete(const char *path, const struct stat *info,
                                 int kind, struct FTW *where)
{
    (void)info;
    (void)kind;
    (void)where;
    return remove(path);
}

static inline int scratch_teardown(void **state)
{
    (void)state;
    return nftw(scratch_dir, scratch_delete, 8, FTW_DEPTH | FTW_PHYS);
}

/* The path of a file in the folder; good until the eighth next call. */
static inline const char *scratch_path(const char *name)
{
    static char path[8][400];
    static int turn;

    turn = (turn + 1) % 8;
    snprintf(path[turn], sizeof path[turn], "%s/%s", scratch_dir, name);
    return path[turn];
}

static inline const char *scratch_write_octets(const char *name,
                                               const char *octets, size_t n)
{
    const char *path = scratch_path(name);
    FILE *stream = fopen(path, "w");

    scratch_must(stream != NULL, path);
    scratch_must(fwrite(octets, 1, n, stream) == n, path);
    scratch_must(fclose(stream) == 0, path);
    return path;
}

static inline const char *scratch_write(const char *name, const char *text)
{
    return scratch_write_octets(name, text, strlen(text));
}

/* A whole file as text, to be freed; NULL if it is not there. */
static inline char *scratch_read(const char *path)
{
    FILE *stream = fopen(path, "r");
    char *text = NULL;
    size_t size = 0;

    if (stream == NULL)
        return NULL;
    if (getdelim(&text, &size, '\0', stream) < 0) {
        free(text);
        text = strdup("");
    }
    fclose(stream);
    return text;
}

/* How many files the folder holds. */
static int scratch_counted;

static inline int scratch_count_one(const char *path, const struct stat *info,
                                    int kind, struct FTW *where)
{
    (void)path;
    (void)info;
    (void)where;
    scratch_counted += kind == FTW_F;
    return 0;
}

static inline int scratch_count(void)
{
    scratch_counted = 0;
    nftw(scratch_dir, scratch_count_one, 8, FTW_PHYS);
    return scratch_counted;
}

/* --- standard error ---------------------------------------------------- */

static FILE *scratch_said;
static int scratch_stderr;

static inline void capture_begin(void)
{
    scratch_said = tmpfile();
    scratch_must(scratch_said != NULL, "tmpfile");
    fflush(stderr);
    scratch_stderr = dup(STDERR_FILENO);
    scratch_must(dup2(fileno(scratch_said), STDERR_FILENO) >= 0, "dup2");
}

/* What was written since; good until the next call. */
static inline const char *capture_end(void)
{
    static char text[4096];
    size_t n;

    fflush(stderr);
    scratch_must(dup2(scratch_stderr, STDERR_FILENO) >= 0, "dup2");
    close(scratch_stderr);
    rewind(scratch_said);
    n = fread(text, 1, sizeof text - 1, scratch_said);
    text[n] = '\0';
    fclose(scratch_said);
    return text;
}

/* It was one line of the program's, and holds all that is expected of it. */
static inline void check_line(const char *said, const char *file,
                              const char *where, const char *what)
{
    const char *end = strchr(said, '\n');

    if (strncmp(said, "jumplink: ", 10) == 0 && end != NULL && end[1] == '\0'
        && strstr(said, file) != NULL && strstr(said, where) != NULL
        && strstr(said, what) != NULL)
        return;
    print_error("said     '%s'\nexpected '%s' '%s' '%s'\n", said, file, where,
                what);
    fail();
}

#endif
