#include "plot.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "complain.h"
#include "out_file.h"

/* Told apart also by the colour-blind (after Okabe and Ito). */
static const char *const colours[] = {
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9",
    "#7a5195", "#8c8c8c"
};
#define COLOURS ((int)(sizeof colours / sizeof colours[0]))

/* --- writing the script ------------------------------------------------ */

/* A text in gnuplot's single quotes, where only the quote is special. */
static void put_text(FILE *gp, const char *text)
{
    putc('\'', gp);
    for (; *text != '\0'; text++) {
        if (*text == '\'')
            putc('\'', gp);
        putc(*text == '\n' ? ' ' : *text, gp);
    }
    putc('\'', gp);
}

static void put_column(FILE *gp, const char *name)
{
    fprintf(gp, "column(");
    put_text(gp, name);
    putc(')', gp);
}

static void put_title(FILE *gp, const char *title)
{
    if (title == NULL) {
        fprintf(gp, " notitle");
        return;
    }
    fprintf(gp, " title ");
    put_text(gp, title);
}

/* Everything the plots have in common, ahead of their `plot` command. */
static void put_head(FILE *gp, const char *name, const char *title,
                     const char *x_label, const char *y_label)
{
    fprintf(gp,
            "# run me again: gnuplot %s.gp\n"
            "set encoding utf8\n"
            "set terminal pngcairo noenhanced size 1200,800 "
            "font 'DejaVu Sans,13' background '#ffffff'\n"
            "set output ", name);
    fprintf(gp, "'%s.png'\n", name);
    fprintf(gp,
            "set datafile separator comma\n"
            "set datafile columnheaders\n"
            "set border 3 linecolor '#404040' linewidth 1\n"
            "set tics nomirror out scale 0.6 textcolor '#202020'\n"
            "set grid front linetype 1 linewidth 0.7 linecolor '#c0707070'\n"
            "set key below center horizontal reverse Left samplen 2 "
            "spacing 1.3 textcolor '#202020'\n"
            "set lmargin 11\n"
            "set rmargin 4\n");
    if (title != NULL) {
        fprintf(gp, "set title ");
        put_text(gp, title);
        fprintf(gp, " font ',16' textcolor '#202020'\n");
    }
    fprintf(gp, "set xlabel ");
    put_text(gp, x_label);
    fprintf(gp, " offset 0,0.4\n");
    if (y_label != NULL) {
        fprintf(gp, "set ylabel ");
        put_text(gp, y_label);
        fprintf(gp, "\n");
    }
}

static void put_tail(FILE *gp, const char *name)
{
    fprintf(gp,
            "\nset terminal svg noenhanced size 1200,800 "
            "font 'DejaVu Sans,sans-serif,13' background '#ffffff'\n"
            "set output '%s.svg'\n"
            "replot\n"
            "unset output\n", name);
}

static void put_style(FILE *gp, enum plot_style style, int *lines)
{
    switch (style) {
    case PLOT_DOTS:
        fprintf(gp, " with points pointtype 7 pointsize 0.45 "
                "linecolor '#a0a0a0'");
        break;
    case PLOT_LINE:
        fprintf(gp, " with lines linewidth 1.6 linecolor '%s'",
                colours[(*lines)++ % COLOURS]);
        break;
    case PLOT_DASHES:
        fprintf(gp, " with lines linewidth 1.6 dashtype (16,16) "
                "linecolor '%s'", colours[(*lines)++ % COLOURS]);
        break;
    case PLOT_TRUTH:
        fprintf(gp, " with lines linewidth 1.4 dashtype 2 "
                "linecolor '#202020'");
        break;
    case PLOT_SHADE:
        fprintf(gp, " axes x1y2 with fillsteps fillstyle solid noborder "
                "linecolor '#ececec'");
        break;
    }
}

static void put_using(FILE *gp, const struct plot_series *series,
                      const char *unit)
{
    put_text(gp, series->file);
    fprintf(gp, " using (");
    put_column(gp, series->x);
    fprintf(gp, "%s):(", unit);
    put_column(gp, series->y);
    fprintf(gp, "%s)", series->style == PLOT_SHADE ? " != 0" : unit);
}

/* The same distance between tics both ways, 4 to 10 along the longer side. */
static void put_equal_tics(FILE *gp, const struct plot_series *series,
                           const char *unit)
{
    fprintf(gp, "stats ");
    put_using(gp, series, unit);
    fprintf(gp, " nooutput\n"
            "width = STATS_max_x - STATS_min_x\n"
            "height = STATS_max_y - STATS_min_y\n"
            "span = width > height ? width : height\n"
            "if (span > 0) {\n"
            "    step = 10 ** floor(log10(span / 4))\n"
            "    step = span / step > 20 ? 5 * step : "
            "span / step > 10 ? 2 * step : step\n"
            "    set xtics step\n"
            "    set ytics step\n"
            "}\n");
}

/* The plot command: x and y in units of `unit` of the file's. */
static void put_series(FILE *gp, const struct plot_series *series, int count,
                       const char *unit)
{
    int i, lines = 0;

    fprintf(gp, "plot");
    for (i = 0; i < count; i++) {
        fprintf(gp, "%s \\\n    ", i == 0 ? "" : ",");
        put_using(gp, &series[i], unit);
        put_style(gp, series[i].style, &lines);
        put_title(gp, series[i].title);
    }
    fprintf(gp, "\n");
}

/* --- running it -------------------------------------------------------- */

/* folder/name.ending, to be freed; NULL without memory. */
static char *path_of(const char *folder, const char *name, const char *ending)
{
    char *path;

    return asprintf(&path, "%s/%s.%s", folder, name, ending) < 0 ? NULL : path;
}

static int start(pid_t *child, const char *folder, const char *script)
{
    char program[] = "gnuplot", *argument = strdup(script);
    char *arguments[] = { program, argument, NULL };
    posix_spawn_file_actions_t actions;
    int error = argument != NULL ? posix_spawn_file_actions_init(&actions)
                                 : ENOMEM;

    if (error != 0) {
        free(argument);
        return error;
    }
    error = posix_spawn_file_actions_addchdir_np(&actions, folder);
    if (error == 0)
        error = posix_spawn_file_actions_addopen(&actions, 0, "/dev/null",
                                                 O_RDONLY, 0);
    if (error == 0)         /* it says a line for each row without a value */
        error = posix_spawn_file_actions_addopen(&actions, 2, "/dev/null",
                                                 O_WRONLY, 0);
    if (error == 0)
        error = posix_spawnp(child, program, &actions, NULL, arguments,
                             environ);
    posix_spawn_file_actions_destroy(&actions);
    free(argument);
    return error;
}

/* Half drawn, or of another run. */
static void remove_pictures(const char *folder, const char *name)
{
    char *png = path_of(folder, name, "png");
    char *svg = path_of(folder, name, "svg");

    if (png != NULL)
        unlink(png);
    if (svg != NULL)
        unlink(svg);
    free(png);
    free(svg);
}

static int run(const char *folder, const char *name, const char *path)
{
    const char *script = strrchr(path, '/') + 1;
    pid_t child;
    int status, error = start(&child, folder, script);

    if (error == ENOENT) {
        complain(path, 0, NULL,
                 "not drawn: gnuplot is not installed (gnuplot-nox)");
        return 1;
    }
    if (error != 0)
        return complain(path, 0, NULL, "cannot run gnuplot: %s",
                        strerror(error));
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR)
            return complain(path, 0, NULL, "cannot wait for gnuplot: %s",
                            strerror(errno));
    if (status != 0) {
        remove_pictures(folder, name);
        return complain(path, 0, NULL, "gnuplot failed (see: cd %s && "
                        "gnuplot %s.gp)", folder, name);
    }
    return 0;
}

/* Open the script of a plot; close it and run it. */
static int begin(struct out_file *out, const char *folder, const char *name)
{
    char *path = path_of(folder, name, "gp");
    int error = path != NULL ? out_open(out, path)
                             : complain(folder, 0, NULL, "out of memory");

    free(path);
    return error;
}

static int finish(struct out_file *out, const char *folder, const char *name)
{
    char *path;
    int result;

    put_tail(out->stream, name);
    if (out_close(out, 1) != 0)
        return -1;
    path = path_of(folder, name, "gp");
    result = path != NULL ? run(folder, name, path)
                          : complain(folder, 0, NULL, "out of memory");
    free(path);
    return result;
}

/* --- the plots --------------------------------------------------------- */

int plot_track(const char *folder, const char *name, const char *title,
               const struct plot_series *series, int count)
{
    struct out_file out;

    if (begin(&out, folder, name) != 0)
        return -1;
    put_head(out.stream, name, title, "east in km", "north in km");
    fprintf(out.stream, "set size ratio -1\n");
    if (count > 0)
        put_equal_tics(out.stream, &series[0], " / 1000");
    put_series(out.stream, series, count, " / 1000");
    return finish(&out, folder, name);
}

int plot_curves(const char *folder, const char *name, const char *title,
                const char *y_label, const struct plot_series *series,
                int count)
{
    struct out_file out;

    if (begin(&out, folder, name) != 0)
        return -1;
    put_head(out.stream, name, title, "time in s", y_label);
    fprintf(out.stream, "set autoscale xfix\n");
    put_series(out.stream, series, count, "");
    return finish(&out, folder, name);
}

int plot_errors(const char *folder, const char *name, const char *title,
                const char *y_label, const struct plot_series *series,
                int count)
{
    struct out_file out;

    if (begin(&out, folder, name) != 0)
        return -1;
    put_head(out.stream, name, title, "time in s", y_label);
    fprintf(out.stream,
            "set logscale y\n"
            "set format y '%%g'\n"
            "set ytics ()\n"
            "do for [e = -9:9] {\n"
            "    set ytics add (10.0 ** e, 2 * 10.0 ** e, 5 * 10.0 ** e)\n"
            "}\n"
            "set y2range [0:1]\n"
            "set autoscale xfix\n"
            "set autoscale yfix\n");
    put_series(out.stream, series, count, "");
    return finish(&out, folder, name);
}

/* A lane for each mode, named on the axis, the first one on top: with many
 * modes that change quickly, stacked areas cannot be told apart. */
static void put_lanes(FILE *gp, const char *file, const char *time,
                      const char *const *mode, int M)
{
    int i;

    fprintf(gp, "set yrange [0:%d]\nset ytics scale 0 (", M);
    for (i = 0; i < M; i++) {
        char number[32];

        snprintf(number, sizeof number, "mode %d", i);
        fprintf(gp, "%s", i == 0 ? "" : ", ");
        put_text(gp, mode != NULL ? mode[i] : number);
        fprintf(gp, " %d.45", M - 1 - i);
    }
    fprintf(gp, ")\nset grid noytics\n");
    for (i = 0; i < M; i++)             /* the frame of lane i: 0 to 1 */
        fprintf(gp, "set object rectangle from graph 0, first %d to graph 1, "
                "first %d.9 behind fillcolor '#f3f3f3' fillstyle solid "
                "noborder\n", i, i);
    fprintf(gp, "plot");
    for (i = 0; i < M; i++) {
        fprintf(gp, "%s \\\n    ", i == 0 ? "" : ",");
        put_text(gp, file);
        fprintf(gp, " using (");
        put_column(gp, time);
        fprintf(gp, "):(%d):(%d + 0.9 * column('mu%d')) with filledcurves "
                "fillstyle solid noborder linecolor '%s' notitle", M - 1 - i,
                M - 1 - i, i, colours[i % COLOURS]);
    }
    fprintf(gp, "\n");
}

int plot_modes(const char *folder, const char *name, const char *title,
               const char *file, const char *time, const char *const *mode,
               int M)
{
    struct out_file out;

    if (begin(&out, folder, name) != 0)
        return -1;
    put_head(out.stream, name, title, "time in s", NULL);
    fprintf(out.stream,
            "set autoscale xfix\n"
            "set border 1\n"
            "set lmargin 18\n"
            "set label 1 'a full lane: probability 1' at graph 1, -0.075 right "
            "textcolor '#707070'\n");
    put_lanes(out.stream, file, time, mode, M);
    return finish(&out, folder, name);
}

int plot_cells(const char *folder, const char *name, const char *title,
               const char *file, const char *const *mode, int M, int cells,
               int left)
{
    struct out_file out;
    int j;

    if (begin(&out, folder, name) != 0)
        return -1;
    put_head(out.stream, name, title, "tick", "cell, row by row");
    fprintf(out.stream,
            "set autoscale xfix\n"
            "set yrange [%d.5:-0.5]\n"
            "set style fill solid noborder\n"
            "unset grid\n"
            "set arrow 1 from graph 0, first %d.5 to graph 1, first %d.5 "
            "nohead linecolor '#404040'\n"
            "set label 1 'left triangle' at graph 1.02, first %d center "
            "rotate textcolor '#707070'\n"
            "set label 2 'right triangle, diamonds' at graph 1.02, first %d "
            "center rotate textcolor '#707070'\n"
            "plot", cells - 1, left - 1, left - 1, left / 2,
            (left + cells) / 2);
    for (j = 0; j < M; j++) {
        fprintf(out.stream, "%s\\\n    ", j > 0 ? ", " : " ");
        put_text(out.stream, file);
        fprintf(out.stream, " using (column('tick')):"
                "(strcol('mode') eq '%s' ? column('cell') : NaN):(0.45):(0.45)",
                mode[j]);
        put_title(out.stream, mode[j]);
        fprintf(out.stream, " with boxxyerror linecolor '%s'",
                colours[j % COLOURS]);
    }
    return finish(&out, folder, name);
}
