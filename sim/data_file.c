#include "data_file.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "complain.h"
#include "csv.h"

/* Where in the file the columns are; -1: not there. */
struct chosen {
    int time, arrived, run;
    int *z;                     /* [m]                                      */
    int *extra;                 /* [n_extra]                                */
};

/* --- choosing columns -------------------------------------------------- */

static int unknown_column(const struct csv *csv, const char *name,
                          const char *hint)
{
    char list[400];
    int i;
    size_t used = 0;

    for (i = 0; i < csv->columns && used < sizeof list; i++)
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%s",
                                 i == 0 ? "" : ", ", csv->name[i]);
    return complain(csv->path, 1, name, "no such column%s; there is: %s", hint,
                    list);
}

/* The columns named by list, "a,b": *column [*count].  Returns 0 or -1. */
static int find_listed(const struct csv *csv, const char *list, int **column,
                       int *count)
{
    char *copy = strdup(list), *rest = copy, *name;
    int i, error = 0;

    *column = calloc(strlen(list) + 1, sizeof **column);
    if (copy == NULL || *column == NULL)
        error = complain(csv->path, 0, NULL, "out of memory");
    while (error == 0 && (name = strsep(&rest, ",")) != NULL) {
        int found = csv_find(csv, name);

        if (found < 0)
            error = unknown_column(csv, name, "");
        for (i = 0; i < *count; i++)
            if (error == 0 && (*column)[i] == found)
                error = complain(csv->path, 1, name, "chosen twice");
        if (error == 0)
            (*column)[(*count)++] = found;
    }
    free(copy);
    return error;
}

/* z and a number, nothing else */
static int is_z(const char *name)
{
    return name[0] == 'z' && name[1] != '\0'
        && name[1 + strspn(name + 1, "0123456789")] == '\0';
}

/* Without a choice: z0, z1, .. or z1, z2, .. wherever they are. */
static int find_z(const struct csv *csv, int **column, int *count)
{
    int i, there = 0, first = csv_find(csv, "z0") >= 0 ? 0 : 1;

    for (i = 0; i < csv->columns; i++)
        there += is_z(csv->name[i]);
    if (there == 0)
        return unknown_column(csv, "z0", " (--z A,B chooses)");
    *column = calloc((size_t)there, sizeof **column);
    if (*column == NULL)
        return complain(csv->path, 0, NULL, "out of memory");
    for (i = 0; i < there; i++) {
        char name[32];

        snprintf(name, sizeof name, "z%d", first + i);
        (*column)[i] = csv_find(csv, name);
        if ((*column)[i] < 0)
            return complain(csv->path, 1, name, "missing: the z columns are "
                            "numbered without gaps from z0 or z1");
    }
    *count = there;
    return 0;
}

static int choose(struct data_file *data, struct chosen *chosen,
                  const struct csv *csv, const struct data_columns *columns)
{
    const char *time = columns->time;

    if (time == NULL)
        time = csv_find(csv, "t_s") >= 0 ? "t_s" : "k";
    chosen->time = csv_find(csv, time);
    if (chosen->time < 0)
        return unknown_column(csv, time, "");
    data->time_name = strdup(time);
    if (data->time_name == NULL)
        return complain(csv->path, 0, NULL, "out of memory");
    chosen->arrived = csv_find(csv, "arrived");
    chosen->run = csv_find(csv, "run");
    if (columns->z != NULL ? find_listed(csv, columns->z, &chosen->z, &data->m)
                           : find_z(csv, &chosen->z, &data->m))
        return -1;
    if (columns->extra == NULL)
        return 0;
    return find_listed(csv, columns->extra, &chosen->extra, &data->n_extra);
}

/* --- reading a row ----------------------------------------------------- */

static int wrong(const struct csv *csv, int column, const char *what)
{
    return complain(csv->path, csv->line, csv->name[column],
                    "'%.40s' %s", csv->field[column], what);
}

/* A plain decimal number, which strtod alone would not insist on; an empty
 * field or "nan" is NaN. */
static int number(const struct csv *csv, int column, double *value)
{
    const char *text = csv->field[column];
    const char *word = text + strspn(text, "+-");
    char *end;

    *value = (double)NAN;
    if (text[0] == '\0' || strcasecmp(word, "nan") == 0)
        return 0;
    if (strcasecmp(word, "inf") == 0 || strcasecmp(word, "infinity") == 0)
        return wrong(csv, column, "is not finite");
    *value = strtod(text, &end);
    if (*end != '\0' || text[strspn(text, "0123456789.+-eE")] != '\0')
        return wrong(csv, column, "is not a number");
    if (!isfinite(*value))
        return wrong(csv, column, "is out of range");
    return 0;
}

static int needed_number(const struct csv *csv, int column, double *value)
{
    if (number(csv, column, value) != 0)
        return -1;
    if (isnan(*value))
        return complain(csv->path, csv->line, csv->name[column],
                        "missing: every row needs one");
    return 0;
}

static int read_time(struct data_file *data, const struct csv *csv, int column)
{
    long row = data->rows;
    int same_run = row > 0 && (data->run == NULL
                               || data->run[row] == data->run[row - 1]);

    if (needed_number(csv, column, &data->time[row]) != 0)
        return -1;
    if (same_run && !(data->time[row] > data->time[row - 1]))
        return complain(csv->path, csv->line, csv->name[column],
                        "%s is not after %s in the row before",
                        csv->field[column], data->time_text[row - 1]);
    data->time_text[row] = strdup(csv->field[column]);
    if (data->time_text[row] == NULL)
        return complain(csv->path, 0, NULL, "out of memory");
    return 0;
}

static int read_z(struct data_file *data, const struct csv *csv,
                  const int *column)
{
    int i, here = -1, missing = -1;
    jl_real *z = data->z + data->rows * data->m;

    for (i = 0; i < data->m; i++) {
        double value;

        if (number(csv, column[i], &value) != 0)
            return -1;
        if (fabs(value) > (double)JL_REAL_MAX)
            return wrong(csv, column[i], "is out of range");
        if (isnan(value))
            missing = column[i];
        else
            here = column[i];
        z[i] = (jl_real)value;
    }
    if (here < 0 || missing < 0)
        return 0;
    return complain(csv->path, csv->line, csv->name[missing],
                    "missing while %s is there: a row has all of its "
                    "measurements or none", csv->name[here]);
}

static int read_arrived(struct data_file *data, const struct csv *csv,
                        int column)
{
    double value;

    if (needed_number(csv, column, &value) != 0)
        return -1;
    if (value < 0.0 || value > 1.0 || value != floor(value))
        return wrong(csv, column, "is not 0 or 1");
    data->arrived[data->rows] = value > 0.0;
    return 0;
}

static int read_run(struct data_file *data, const struct csv *csv, int column)
{
    double value;

    if (needed_number(csv, column, &value) != 0)
        return -1;
    if (value != floor(value) || fabs(value) > 1.0e9)
        return wrong(csv, column, "is not a whole number");
    data->run[data->rows] = (long)value;
    return 0;
}

static int read_row(struct data_file *data, const struct csv *csv,
                    const struct chosen *chosen)
{
    int i;

    data->line[data->rows] = csv->line;
    if (data->run != NULL && read_run(data, csv, chosen->run) != 0)
        return -1;
    if (data->arrived != NULL
        && read_arrived(data, csv, chosen->arrived) != 0)
        return -1;
    for (i = 0; i < data->n_extra; i++)
        if (number(csv, chosen->extra[i],
                   &data->extra[data->rows * data->n_extra + i]) != 0)
            return -1;
    if (read_z(data, csv, chosen->z) != 0)
        return -1;
    if (read_time(data, csv, chosen->time) != 0)
        return -1;
    data->rows++;
    return 0;
}

/* --- all rows ---------------------------------------------------------- */

/* Room for `rows` times `count` objects; 0, or -1 when there is none. */
static int resize(void *array, long rows, int count, size_t octets)
{
    void *old, *larger;

    if (count == 0)
        return 0;
    memcpy(&old, array, sizeof old);
    larger = reallocarray(old, (size_t)rows * (size_t)count, octets);
    if (larger == NULL)
        return -1;
    memcpy(array, &larger, sizeof larger);
    return 0;
}

static int make_room(struct data_file *data, const struct chosen *chosen,
                     long rows)
{
    if (resize(&data->line, rows, 1, sizeof *data->line)
        || resize(&data->time, rows, 1, sizeof *data->time)
        || resize(&data->time_text, rows, 1, sizeof *data->time_text)
        || resize(&data->z, rows, data->m, sizeof *data->z)
        || resize(&data->extra, rows, data->n_extra, sizeof *data->extra)
        || resize(&data->arrived, rows, chosen->arrived >= 0,
                  sizeof *data->arrived)
        || resize(&data->run, rows, chosen->run >= 0, sizeof *data->run))
        return complain(data->path, 0, NULL, "out of memory");
    return 0;
}

static int compare_run(const void *a, const void *b, void *run)
{
    const long *of = run;
    long i = *(const long *)a, j = *(const long *)b;

    if (of[i] != of[j])
        return of[i] < of[j] ? -1 : 1;
    return i < j ? -1 : i > j;
}

/* Rows of one run stand together.  (Were the runs interleaved, every row would
 * begin a run of its own, and nothing would tell.) */
static int check_runs(const struct data_file *data)
{
    long i, starts = 0, *start;
    int error = 0;

    if (data->run == NULL)
        return 0;
    start = calloc((size_t)data->rows, sizeof *start);
    if (start == NULL)
        return complain(data->path, 0, NULL, "out of memory");
    for (i = 0; i < data->rows; i++)
        if (i == 0 || data->run[i] != data->run[i - 1])
            start[starts++] = i;
    qsort_r(start, (size_t)starts, sizeof *start, compare_run, data->run);
    for (i = 1; i < starts && error == 0; i++)
        if (data->run[start[i]] == data->run[start[i - 1]])
            error = complain(data->path, data->line[start[i]], "run",
                             "run %ld begins a second time: the rows of a run "
                             "stand together", data->run[start[i]]);
    free(start);
    return error;
}

static int read_rows(struct data_file *data, struct csv *csv,
                     const struct chosen *chosen)
{
    long room = 0;
    int got;

    while ((got = csv_row(csv)) > 0) {
        if (data->rows == room) {
            room = room == 0 ? 1024 : 2 * room;
            if (make_room(data, chosen, room) != 0)
                return -1;
        }
        if (read_row(data, csv, chosen) != 0)
            return -1;
    }
    if (got < 0)
        return -1;
    if (data->rows == 0)
        return complain(data->path, 0, NULL, "no rows below the header");
    return check_runs(data);
}

int data_read(struct data_file *data, const char *path,
              const struct data_columns *columns)
{
    static const struct data_columns defaults;
    struct chosen chosen = { -1, -1, -1, NULL, NULL };
    struct csv csv;
    int error;

    memset(data, 0, sizeof *data);
    if (csv_open(&csv, path) != 0)
        return -1;
    data->path = strdup(path);
    error = data->path == NULL ? complain(path, 0, NULL, "out of memory") : 0;
    if (error == 0)
        error = choose(data, &chosen, &csv,
                       columns != NULL ? columns : &defaults);
    if (error == 0)
        error = read_rows(data, &csv, &chosen);
    free(chosen.z);
    free(chosen.extra);
    csv_close(&csv);
    if (error != 0)
        data_free(data);
    return error;
}

void data_free(struct data_file *data)
{
    while (data->rows > 0)
        free(data->time_text[--data->rows]);
    free(data->path);
    free(data->time_name);
    free(data->time_text);
    free(data->time);
    free(data->z);
    free(data->extra);
    free(data->arrived);
    free(data->run);
    free(data->line);
    memset(data, 0, sizeof *data);
}
