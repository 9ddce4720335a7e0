#include "out_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "complain.h"

static int failed(struct out_file *out, const char *what)
{
    int why = errno;

    if (out->stream != NULL && out->stream != stdout)
        fclose(out->stream);
    if (out->temporary != NULL)
        unlink(out->temporary);
    complain(out->path != NULL ? out->path : "standard output", 0, NULL,
             "%s: %s", what, strerror(why));
    free(out->path);
    free(out->temporary);
    memset(out, 0, sizeof *out);
    return -1;
}

/* A new file beside the target, with the rights any new file gets (which
 * mkstemp would not give).  Returns a descriptor or -1. */
static int create_beside(struct out_file *out)
{
    int attempt, fd = -1;

    for (attempt = 0; attempt < 1000 && fd < 0; attempt++) {
        free(out->temporary);
        if (asprintf(&out->temporary, "%s.%ld-%d.tmp", out->path,
                     (long)getpid(), attempt) < 0) {
            out->temporary = NULL;
            return -1;
        }
        fd = open(out->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC,
                  0666);
        if (fd < 0 && errno != EEXIST)
            break;
    }
    if (fd < 0) {                       /* nothing of ours to remove */
        free(out->temporary);
        out->temporary = NULL;
    }
    return fd;
}

/* The target decides: a new or regular file is replaced as a whole, behind a
 * symbolic link if it is one; a device or pipe is written to directly. */
static int open_target(struct out_file *out)
{
    struct stat there;

    if (stat(out->path, &there) != 0)
        return errno == ENOENT ? create_beside(out) : -1;
    if (S_ISDIR(there.st_mode)) {
        errno = EISDIR;
        return -1;
    }
    if (S_ISREG(there.st_mode)) {
        char *real = realpath(out->path, NULL);

        if (real == NULL)
            return -1;
        free(out->path);
        out->path = real;
        return create_beside(out);
    }
    return open(out->path, O_WRONLY | O_CLOEXEC);
}

int out_open(struct out_file *out, const char *path)
{
    int fd;

    memset(out, 0, sizeof *out);
    if (path == NULL || strcmp(path, "-") == 0) {
        out->stream = stdout;
        return 0;
    }
    out->path = strdup(path);
    fd = out->path != NULL ? open_target(out) : -1;
    if (fd < 0)
        return failed(out, "cannot create");
    out->stream = fdopen(fd, "w");
    if (out->stream == NULL) {
        close(fd);
        return failed(out, "cannot create");
    }
    return 0;
}

int out_open_in(struct out_file *out, const char *folder, const char *name)
{
    char *path;
    int status;

    if (asprintf(&path, "%s/%s", folder, name) < 0)
        return complain(folder, 0, NULL, "out of memory");
    status = out_open(out, path);
    free(path);
    return status;
}

int out_close(struct out_file *out, int keep)
{
    int closed;

    errno = EIO;                        /* when an earlier write failed */
    if (keep && (fflush(out->stream) != 0 || ferror(out->stream)))
        return failed(out, "cannot write");
    closed = out->stream == stdout ? 0 : fclose(out->stream);
    out->stream = NULL;
    if (keep && closed != 0)
        return failed(out, "cannot write");
    if (out->temporary != NULL) {
        if (keep && rename(out->temporary, out->path) != 0)
            return failed(out, "cannot rename");
        if (!keep)
            unlink(out->temporary);
    }
    free(out->path);
    free(out->temporary);
    memset(out, 0, sizeof *out);
    return 0;
}

static int is_folder(const char *path)
{
    int error = errno;
    struct stat is;

    if (stat(path, &is) == 0) {
        errno = ENOTDIR;
        return S_ISDIR(is.st_mode);
    }
    errno = error;
    return 0;
}

int out_folder(const char *path)
{
    char *copy = strdup(path), *p;
    int status = 0;

    for (p = copy; status == 0 && p != NULL; ) {
        p = strchr(p + 1, '/');
        if (p != NULL)
            *p = '\0';
        if (mkdir(copy, 0777) != 0 && !is_folder(copy))
            status = complain(copy, 0, NULL, "cannot create the folder: %s",
                              strerror(errno));
        if (p != NULL)
            *p = '/';
    }
    free(copy);
    if (status == 0 && access(path, W_OK | X_OK) != 0)
        status = complain(path, 0, NULL, "cannot write into the folder: %s",
                          strerror(errno));
    return status;
}
