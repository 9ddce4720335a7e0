#include "feed.h"

#include <math.h>
#include <string.h>

#include "complain.h"

int feed_open(struct feed *feed, const struct data_file *data,
              const struct model *model, const struct options *options)
{
    memset(feed, 0, sizeof *feed);
    feed->data = data;
    feed->needs_first = model->x0 == NULL && model->mekf == NULL;
    feed->hold = options->hold;
    if (feed->hold == HOLD_DEFAULT)
        feed->hold = data->arrived != NULL ? HOLD_COLUMN : HOLD_NONE;
    if (data->m != model->m)
        return complain(data->path, 1, NULL, "has %d measurements a row, but "
                        "%s needs %d", data->m, model->path, model->m);
    if (feed->hold == HOLD_COLUMN && data->arrived == NULL)
        return complain(data->path, 1, "arrived", "no such column, but "
                        "--hold column needs it");
    if (model->motions != NULL && options->time == NULL
        && strcmp(data->time_name, "t_s") != 0)
        return complain(data->path, 1, "t_s", "no such column, but the motions "
                        "of %s need times in seconds (--time NAME chooses a "
                        "column)", model->path);
    return 0;
}

static int begins(const struct data_file *data, long row)
{
    return row == 0
        || (data->run != NULL && data->run[row] != data->run[row - 1]);
}

int feed_arrived(const struct feed *feed, long row)
{
    const struct data_file *data = feed->data;
    const jl_real *z = data->z + row * data->m;
    int i, repeats = !begins(data, row);

    for (i = 0; i < data->m; i++) {
        if (isnan((double)z[i]))
            return 0;
        if (repeats && !(z[i] >= z[i - data->m] && z[i] <= z[i - data->m]))
            repeats = 0;
    }
    if (feed->hold == HOLD_COLUMN)
        return data->arrived[row];
    return feed->hold != HOLD_DETECT || !repeats;
}

int feed_meas(struct feed *feed, long row, jl_meas *meas)
{
    const struct data_file *data = feed->data;
    int arrived = feed_arrived(feed, row);

    if (begins(data, row))
        feed->waiting = 1;
    if (feed->waiting && feed->needs_first && !arrived)
        return 0;
    meas->seq = (jl_u32)row + 1;
    meas->first = feed->waiting;
    meas->dt = feed->waiting ? 0 : (jl_real)(data->time[row] - feed->time);
    meas->z = arrived ? data->z + row * data->m : NULL;
    feed->waiting = 0;
    feed->time = data->time[row];
    return 1;
}
