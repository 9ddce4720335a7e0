/* jumplink sim: recorded flights through filters on PEs; table, CSV, plots. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "command.h"
#include "complain.h"
#include "flight_report.h"
#include "manoeuvre.h"
#include "out_file.h"
#include "progress.h"
#include "rivals.h"
#include "run.h"
#include "sim_live.h"

#define MODELS_MAX 8

static const char help[] =
    "usage: jumplink sim [OPTIONS]\n"
    "       jumplink sim --input lcm --model FILE --lcm-url URL [OPTIONS]\n"
    "       jumplink sim --scenario NAME [--runs N] [--seed S] [-o DIR]\n"
    "Filters a recorded flight on PEs that are processes talking over\n"
    "LCM, once with every position taken as fresh and once with held\n"
    "positions recognised, for each model; compares with the serial\n"
    "filter; writes a table, CSV and plots.\n\n"
    "  --data FILE       the record, with true velocities v_east_mps and\n"
    "                    v_north_mps (default, in the source folder:\n"
    "                    sim/data/carrier_held_1hz.csv)\n"
    "  --model FILE      a model; may be given several times (default, in\n"
    "                    the source folder: sim/data/two_modes.json and\n"
    "                    eight_modes.json; of kind cgimm two_gains.json)\n"
    "  -o, --out DIR     where results go (default build/sim)\n"
    "  --port lcm|threads|loop  processes over LCM (default), or threads,\n"
    "                    or threads that take turns\n"
    "  --pes P           PEs (default 4)\n"
    COMMON_HELP
    "  --hold none|detect|column  only this way with held positions\n"
    "  --z A,B           columns of the position (default\n"
    "                    east_m,north_m)\n"
    "  --time NAME       column of the time (default t_s, else k)\n"
    PORT_HELP
    "  --run NAME        name of what is published there, JL.NAME.estimate\n"
    "                    and JL.NAME.measurement (default jumplink)\n"
    "  --input lcm       measurements off the network instead: messages of\n"
    "                    sim/lcm/measurement.lcm on channel\n"
    "                    JL.NAME.measurement from any LCM program; lost\n"
    "                    ones are predicted through, and counted\n"
    "  --idle S          ... until none came for so long (default 5); the\n"
    "                    longest wait for the first is --start (default 60)\n"
    "  --scenario manoeuvre1d  no flight, but simulated runs of a target that\n"
    "                    accelerates at 10 s and stops doing so at 25 s: IMM,\n"
    "                    constant-gain IMM and an adaptive alpha-beta filter\n"
    "  --scenario ar1|spring2|turn  ... of a system with a parameter that is\n"
    "                    not known: EKF, and MEKF without and with spread; a\n"
    "                    verdict as measured (mostly the EKF is better)\n"
    "  --runs N          so many (default 2000; of ar1, spring2, turn 100)\n"
    "  --seed S          with noise that S determines (default 1)\n"
    HELP_HELP;

/* One model, one way with held positions: serial for comparison, then
 * parallel. */
static int one_run(struct flight_run *r, const struct model *model,
                   const struct data_file *data, const struct options *options)
{
    struct estimates serial;
    char what[200];
    double p99;
    int status;

    if (estimates_open(&serial, data, model) != 0)
        return 1;
    if (estimates_open(&r->e, data, model) != 0) {
        estimates_close(&serial);
        return 1;
    }
    status = run_serial(&serial, model, data, options);
    if (status == 0) {
        snprintf(what, sizeof what, "%s, positions %s, %d PEs", r->model,
                 r->positions, options->pes);
        progress_begin(what);
        status = run(&r->e, &r->traffic, model, data, options);
        progress_begin(NULL);
    }
    r->partial = status != 0;
    r->same = status == 0 && estimates_same(&serial, &r->e);
    r->apart = status == 0 ? estimates_apart(&r->e, &serial) : (double)NAN;
    (void)estimates_times(&serial, &r->serial_us, &p99);
    estimates_close(&serial);
    return status;
}

static int all_runs(struct flight_report *report, struct model *models,
                    int count, struct options *options)
{
    static const enum hold both[] = { HOLD_NONE, HOLD_DETECT };
    const struct data_file *data = report->data;
    enum hold wanted = options->hold;
    int i, h, status = 0;

    for (i = 0; i < count && status == 0; i++)
        for (h = 0; h < 2 && status == 0; h++) {
            struct flight_run *r = &report->runs[report->count];

            if (wanted != HOLD_DEFAULT && h > 0)
                break;
            options->hold = wanted != HOLD_DEFAULT ? wanted
                : h == 1 && data->arrived != NULL ? HOLD_COLUMN : both[h];
            flight_run_name(r, &models[i], options->hold);
            status = one_run(r, &models[i], data, options);
            if (status == 0 || r->e.done > 0)
                report->count++;
            else
                estimates_close(&r->e);
        }
    return status;
}

/* A flight without a single position is no use. */
static int has_position(const struct data_file *data)
{
    long i;

    for (i = 0; i < data->rows * data->m; i++)
        if (!isnan((double)data->z[i]))
            return 1;
    complain(data->path, 0, NULL, "there is no position in any row");
    return 0;
}

/* Files are named after the models. */
static int has_twin(const struct model *models, int i)
{
    char name[64], other[64];
    int j;

    flight_model_name(name, sizeof name, &models[i]);
    for (j = 0; j < i; j++) {
        flight_model_name(other, sizeof other, &models[j]);
        if (strcmp(name, other) == 0) {
            misuse("sim", "--model %s: another model is also named %s",
                   models[i].path, name);
            return 1;
        }
    }
    return 0;
}

static int sim(const char *data_path, const char *const *paths, int count,
               struct options *options)
{
    struct flight_report report;
    struct data_columns columns;
    struct data_file data;
    struct model models[MODELS_MAX];
    int i, read = 0, status = 0;

    columns.z = options->z != NULL ? options->z : "east_m,north_m";
    columns.time = options->time;
    columns.extra = FLIGHT_TRUTH;
    if (data_read(&data, data_path, &columns) != 0)
        return 2;
    if (!has_position(&data))
        status = 2;
    for (i = 0; i < count && status == 0; i++)
        if (model_read(&models[i], paths[i]) != 0)
            status = 2;
        else {
            read++;
            status = run_pick_mode(&models[i], options);
            if (status == 0 && (flight_fits(&models[i]) != 0
                                || has_twin(models, i)))
                status = 2;
        }
    if (status == 0)
        status = out_folder(options->out) != 0 ? 1 : 0;
    if (status == 0 && flight_report_open(&report, &data, options,
                                          2 * count) != 0)
        status = 1;
    else if (status == 0) {
        int written = 0;

        status = all_runs(&report, models, count, options);
        if (report.count > 0)
            written = flight_report_write(&report, options->out);
        if (status == 0)
            status = written;
        flight_report_close(&report);
    }
    for (i = 0; i < read; i++)
        model_free(&models[i]);
    data_free(&data);
    return status;
}

/* Measurements off the network: one model, and no file. */
static int live(const char *data, const char *const *models, int count,
                struct options *options, long idle_us)
{
    if (count != 1 || options->lcm_url == NULL)
        return misuse("sim", "--input lcm needs one --model, and --lcm-url");
    if (data != NULL || options->z != NULL || options->time != NULL)
        return misuse("sim", "--data, --z and --time are not for --input lcm");
    return sim_live(models[0], options, idle_us);
}

static int recorded(const char *data, const char *const *models, int count,
                    struct options *options, long idle_us)
{
    static const char *const gains[] = { "sim/data/two_gains.json" };

    if (idle_us > 0)
        return misuse("sim", "--idle goes with --input lcm");
    if (options->port != PORT_LCM && options->lcm_url != NULL)
        return misuse("sim", "--lcm-url needs --port lcm");
    if (options->run != NULL && options->lcm_url == NULL)
        return misuse("sim", "--run names what is published on --lcm-url");
    if (data == NULL)
        data = "sim/data/carrier_held_1hz.csv";
    if (count == 0 && options->filter == FILTER_CGIMM)
        return sim(data, gains, 1, options);
    return sim(data, models, count == 0 ? 2 : count, options);
}

static int manoeuvres(long runs, uint64_t seed, const char *folder)
{
    struct manoeuvre m;

    if (out_folder(folder) != 0
        || manoeuvre_run(&m, runs > 0 ? runs : 2000, seed) != 0)
        return 1;
    return manoeuvre_report(&m, folder);
}

/* Each run is kept. */
static int rivalry(const struct rivals_scenario *scenario, long runs,
                   uint64_t seed, const char *folder)
{
    struct rivals r;
    int status;

    if (runs > 100000)
        return misuse("sim", "--runs %ld: of --scenario %s at most 100000",
                      runs, scenario->name);
    if (out_folder(folder) != 0
        || rivals_simulate(&r, scenario, runs > 0 ? runs : 100, seed) != 0)
        return 1;
    status = rivals_report(&r, folder);
    rivals_free(&r);
    return status;
}

/* Simulated runs (0: as many as usual); `other` is an option they have no use
 * for, or NULL. */
static int simulated(const char *scenario, const char *other, long runs,
                     uint64_t seed, const char *folder)
{
    const struct rivals_scenario *rivals = rivals_scenario(scenario);

    if (rivals == NULL && strcmp(scenario, "manoeuvre1d") != 0)
        return misuse("sim", "--scenario %s: known are manoeuvre1d, ar1, "
                      "spring2 and turn", scenario);
    if (other != NULL)
        return misuse("sim", "%s is not for --scenario, which takes --runs, "
                      "--seed and --out", other);
    return rivals != NULL ? rivalry(rivals, runs, seed, folder)
                          : manoeuvres(runs, seed, folder);
}

int cmd_sim(int argc, char **argv)
{
    static const struct option known[] = {
        { "data", required_argument, NULL, 'd' },
        { "model", required_argument, NULL, 'm' },
        { "input", required_argument, NULL, 'i' },
        { "idle", required_argument, NULL, 'w' },
        { "scenario", required_argument, NULL, 's' },
        { "runs", required_argument, NULL, 'r' },
        { "seed", required_argument, NULL, 'n' },
        COMMON_OPTIONS, { 0 }
    };
    const char *data = NULL;
    const char *models[MODELS_MAX] = { "sim/data/two_modes.json",
                                       "sim/data/eight_modes.json" };
    struct options options;
    int c, count = 0, off_network = 0, status = 0;
    const char *scenario = NULL, *other = NULL;
    long idle_us = 0, runs = 0, seed = -1;

    options_init(&options, "sim");
    options.start_us = 0;               /* the default is not known yet */
    options.port = PORT_LCM;
    options.pes = 4;
    options.out = "build/sim";
    while ((c = getopt_long(argc, argv, SHORT_OPTIONS, known, NULL)) != -1) {
        if (c == 'h') {
            fputs(help, stdout);
            return 0;
        }
        if (c > 127 || strchr("srno:?", c) == NULL)
            other = argv[optind - 1] == optarg ? argv[optind - 2]
                                               : argv[optind - 1];
        if (c == 's')
            scenario = optarg;
        else if (c == 'r')
            status = option_long(&runs, "sim", "runs", optarg, 2, 100000000);
        else if (c == 'n')
            status = option_long(&seed, "sim", "seed", optarg, 0, 2147483647);
        else if (c == 'd')
            data = optarg;
        else if (c == 'i' && strcmp(optarg, "lcm") == 0)
            off_network = 1;
        else if (c == 'i')
            return misuse("sim", "--input %s: only lcm is known", optarg);
        else if (c == 'w')
            status = option_seconds(&idle_us, "sim", "idle", optarg);
        else if (c == 'm' && count < MODELS_MAX)
            models[count++] = optarg;
        else if (c == 'm')
            return misuse("sim", "at most %d times --model", MODELS_MAX);
        else
            status = options_take(&options, c, argv);
        if (status != 0)
            return status;
    }
    status = options_end(&options);
    if (status != 0)
        return status;
    if (optind < argc)
        return misuse("sim", "unexpected '%s'", argv[optind]);
    if (scenario != NULL)
        return simulated(scenario, other, runs,
                         seed >= 0 ? (uint64_t)seed : 1, options.out);
    if (runs > 0 || seed >= 0)
        return misuse("sim", "--runs and --seed go with --scenario");
    if (options.start_us == 0)
        options.start_us = off_network ? 60000000 : 10000000;
    return off_network
        ? live(data, models, count, &options, idle_us > 0 ? idle_us : 5000000)
        : recorded(data, models, count, &options, idle_us);
}
