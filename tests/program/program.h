/* Running the program: what it says, its exit status, a time limit. */
#ifndef TESTS_PROGRAM_H
#define TESTS_PROGRAM_H

#include "scratch.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <time.h>

#define PROGRAM_LIMIT 30.0      /* seconds; a run that takes longer hangs */
#define TOLD_MAX 32             /* arguments */

struct program {
    pid_t pid;
    int out_fd, err_fd;
    int status;                 /* of exit; 128 + signal; -1: killed late */
    char *out, *err;
    double seconds, began;
    const char *told[TOLD_MAX]; /* for messages */
};

static inline double program_now(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static inline void program_sleep(double seconds)
{
    poll(NULL, 0, (int)(seconds * 1000));
}

/* --- start and end ----------------------------------------------------- */

/* Start `file` with arguments up to NULL.  `before` (may be NULL) is called in
 * the child: if it fails, status becomes 77.  The child dies with the test. */
static inline void program_start_file(struct program *p, const char *file,
                                      int (*before)(void),
                                      const char *const *told)
{
    const char *argv[TOLD_MAX];
    int i;

    memset(p, 0, sizeof *p);
    argv[0] = file;
    for (i = 0; told[i] != NULL && i < TOLD_MAX - 2; i++)
        p->told[i] = argv[i + 1] = told[i];
    argv[i + 1] = NULL;
    p->out_fd = memfd_create("out", MFD_CLOEXEC);
    p->err_fd = memfd_create("err", MFD_CLOEXEC);
    scratch_must(p->out_fd >= 0 && p->err_fd >= 0, "memfd_create");
    p->began = program_now();
    p->pid = fork();
    scratch_must(p->pid >= 0, "fork");
    if (p->pid > 0)
        return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(p->out_fd, STDOUT_FILENO);
    dup2(p->err_fd, STDERR_FILENO);
    if (before != NULL && before() != 0)
        _exit(77);
    execv(file, (char *const *)argv);
    _exit(127);
}

#define program_start(p, ...) \
    program_start_file((p), JUMPLINK, NULL, \
                       (const char *const[]){ __VA_ARGS__, NULL })

static inline char *program_text(int fd)
{
    off_t size = lseek(fd, 0, SEEK_END);
    char *text = calloc((size_t)size + 1, 1);

    scratch_must(text != NULL && pread(fd, text, (size_t)size, 0) == size,
                 "what the program said");
    close(fd);
    return text;
}

/* Wait until it ends; after `limit` seconds it is killed. */
static inline void program_end(struct program *p, double limit)
{
    double deadline = program_now() + limit;
    pid_t ended;
    int status = 0, late = 0;

    while ((ended = waitpid(p->pid, &status, WNOHANG)) == 0 && !late)
        if (program_now() > deadline)
            late = 1;
        else
            program_sleep(0.002);
    if (ended == 0) {
        kill(p->pid, SIGKILL);
        waitpid(p->pid, &status, 0);
    }
    p->status = late ? -1 : WIFSIGNALED(status) ? 128 + WTERMSIG(status)
                                                : WEXITSTATUS(status);
    p->seconds = program_now() - p->began;
    p->out = program_text(p->out_fd);
    p->err = program_text(p->err_fd);
}

static inline void program_free(struct program *p)
{
    free(p->out);
    free(p->err);
    p->out = p->err = NULL;
    p->pid = 0;
}

/* What a failed test left running: ended by its pid, and waited for. */
static inline void program_kill(struct program *p)
{
    if (p->pid > 0 && p->out == NULL)
        program_end(p, 0);
    program_free(p);
}

/* The one run that is looked at; it is freed by the next. */
static struct program ran;

static inline void run_file_told(const char *file, const char *const *told)
{
    program_free(&ran);
    program_start_file(&ran, file, NULL, told);
    program_end(&ran, PROGRAM_LIMIT);
}

/* Run jumplink with these arguments to its end, into `ran`. */
#define run_jumplink(...) \
    run_file_told(JUMPLINK, (const char *const[]){ __VA_ARGS__, NULL })

/* --- checks ------------------------------------------------------------ */

static inline void program_fail(const struct program *p, const char *expected)
{
    int i;

    print_error("jumplink");
    for (i = 0; p->told[i] != NULL; i++)
        print_error(" %s", p->told[i]);
    print_error("\nexpected %s\nexit status %d after %.1f s, on standard "
                "error:\n%s", expected, p->status, p->seconds, p->err);
    fail();
}

/* Exit status 0 and silence on standard error. */
static inline void check_good(const struct program *p)
{
    if (p->status != 0 || p->err[0] != '\0')
        program_fail(p, "success without a word");
}

/* The exit status, nothing on standard output, one line on standard error,
 * which begins with the program's name and holds all of `words`, "a|b". */
static inline void check_refused(const struct program *p, int status,
                                 const char *words)
{
    const char *end = strchr(p->err, '\n');
    char *copy = strdup(words), *rest = copy, *word;
    int good = p->status == status && p->out[0] == '\0' && end != NULL
        && end[1] == '\0' && strncmp(p->err, "jumplink", 8) == 0;

    scratch_must(copy != NULL, "memory");
    while (good && (word = strsep(&rest, "|")) != NULL)
        good = strstr(p->err, word) != NULL;
    free(copy);
    if (!good) {
        char expected[300];

        snprintf(expected, sizeof expected, "exit status %d and one line "
                 "with %s", status, words);
        program_fail(p, expected);
    }
}

/* A run that ended too early: status 1, a line that begins with the program's
 * name and holds `words`, and one that says how many rows are kept. */
static inline void check_ended(const struct program *p, const char *words)
{
    const char *end = strchr(p->err, '\n'), *found = strstr(p->err, words);

    if (p->status != 1 || strncmp(p->err, "jumplink", 8) != 0 || end == NULL
        || found == NULL || found > end
        || strstr(end, ": partial: the first ") == NULL)
        program_fail(p, words);
}

/* The same octets; says where they differ. */
static inline void check_same_text(const char *a, const char *b)
{
    long line = 1;

    while (*a != '\0' && *a == *b) {
        line += *a == '\n';
        a++;
        b++;
    }
    if (*a == *b)
        return;
    print_error("line %ld: '%.60s' and '%.60s'\n", line, a, b);
    fail();
}

/* --- files ------------------------------------------------------------- */

/* The text of a file that must be there. */
static inline char *program_file(const char *path)
{
    char *text = scratch_read(path);

    if (text == NULL) {
        print_error("no file %s\n", path);
        fail();
    }
    return text;
}

static inline const char *program_copy(const char *name, const char *from)
{
    char *text = program_file(from);
    const char *path = scratch_write(name, text);

    free(text);
    return path;
}

/* The first `lines` lines of a file, as a file of the scratch folder. */
static inline const char *program_head(const char *name, const char *from,
                                       int lines)
{
    char *text = program_file(from), *end = text;
    const char *path;

    for (; lines > 0 && (end = strchr(end, '\n')) != NULL; lines--)
        end++;
    if (end != NULL)
        *end = '\0';
    path = scratch_write(name, text);
    free(text);
    return path;
}

/* --- processes --------------------------------------------------------- */

/* The arguments of a process, separated by spaces; "" if there is none. */
static inline const char *program_cmdline(const char *pid)
{
    static char text[4096];
    char path[300];
    FILE *stream;
    size_t n, i;

    snprintf(path, sizeof path, "/proc/%s/cmdline", pid);
    stream = fopen(path, "r");
    n = stream == NULL ? 0 : fread(text, 1, sizeof text - 1, stream);
    if (stream != NULL)
        fclose(stream);
    for (i = 0; i < n; i++)
        if (text[i] == '\0')
            text[i] = ' ';
    text[n] = '\0';
    return text;
}

/* How many other processes have both texts in their arguments; *pid (may be
 * NULL) becomes one of them. */
static inline int program_find(const char *a, const char *b, pid_t *pid)
{
    DIR *proc = opendir("/proc");
    struct dirent *entry;
    int count = 0;

    scratch_must(proc != NULL, "/proc");
    while ((entry = readdir(proc)) != NULL) {
        const char *line;

        if (!isdigit((unsigned char)entry->d_name[0])
            || atol(entry->d_name) == (long)getpid())
            continue;
        line = program_cmdline(entry->d_name);
        if (strstr(line, a) == NULL || strstr(line, b) == NULL)
            continue;
        count++;
        if (pid != NULL)
            *pid = (pid_t)atol(entry->d_name);
    }
    closedir(proc);
    return count;
}

/* No process knows of the scratch folder (soon: the kernel needs its time). */
static inline void check_nobody_left(void)
{
    double deadline = program_now() + 10;
    pid_t pid = 0;

    while (program_find(scratch_dir, "", &pid) > 0)
        if (program_now() > deadline) {
            char text[32];

            snprintf(text, sizeof text, "%d", (int)pid);
            print_error("still there: %s\n", program_cmdline(text));
            fail();
        } else {
            program_sleep(0.01);
        }
}

#endif
