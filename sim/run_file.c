#include "run_file.h"

#include <string.h>
#include <sys/stat.h>

#include "complain.h"
#include "diagnostics.h"
#include "out_file.h"
#include "progress.h"
#include "run.h"

/* Better known before a long run.  What is not a file is not opened twice. */
static int can_write(const char *path)
{
    struct out_file out;
    struct stat is;

    if (path == NULL || (stat(path, &is) == 0 && !S_ISREG(is.st_mode)))
        return 1;
    return out_open(&out, path) == 0 && out_close(&out, 0) == 0;
}

static int run_data(const struct model *model, const struct data_file *data,
                    struct diagnostics *diagnostics,
                    const struct options *options)
{
    struct estimates e;
    struct traffic traffic;
    int status;

    if (!can_write(options->out))
        return 1;
    if (options->diagnostics && diagnostics_room(diagnostics, data) != 0)
        return 1;
    if (estimates_open(&e, data, model) != 0)
        return 1;
    e.diagnostics = options->diagnostics ? diagnostics : NULL;
    progress_begin(data->path);
    status = run(&e, &traffic, model, data, options);
    progress_begin(NULL);
    if (status == 0 && options->gate > 0)
        complain(data->path, 0, NULL, "the gate rejected %ld of %ld "
                 "measurements", e.rejected, e.judged);
    if (status == 0)
        status = estimates_save(&e, data, options->out) == 0 ? 0 : 1;
    else
        (void)estimates_save_partial(&e, data, options->out);
    estimates_close(&e);
    return status;
}

int run_file(const char *model_path, const char *data_path,
             const struct options *options)
{
    struct data_columns columns = { options->z, options->time, NULL };
    struct diagnostics diagnostics;
    struct model model;
    struct data_file data;
    int status;

    if (model_read(&model, model_path) != 0)
        return 2;
    memset(&diagnostics, 0, sizeof diagnostics);
    status = run_pick_mode(&model, options);
    if (status == 0)
        status = diagnostics_open(&diagnostics, &model, options);
    columns.extra = diagnostics.truth;
    if (status == 0 && data_read(&data, data_path, &columns) != 0)
        status = 2;
    if (status == 0) {
        status = run_data(&model, &data, &diagnostics, options);
        data_free(&data);
    }
    diagnostics_close(&diagnostics);
    model_free(&model);
    return status;
}
