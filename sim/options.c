/* Options that several subcommands share. */
#include "options.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "chi_square.h"
#include "jumplink/config.h"
#include "jumplink/par.h"

int misuse(const char *command, const char *format, ...)
{
    va_list arguments;

    fprintf(stderr, "jumplink %s: ", command);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fprintf(stderr, " (see jumplink %s --help)\n", command);
    return 2;
}

void options_init(struct options *options, const char *command)
{
    memset(options, 0, sizeof *options);
    options->command = command;
    options->mode = -1;
    options->form = &jl_kf_joseph;
    options->timeout_us = 2000000;
    options->start_us = 10000000;
    opterr = 0;                         /* options_take says it in one line */
}

int option_long(long *number, const char *command, const char *option,
                const char *value, long low, long high)
{
    char *end;
    long n;

    errno = 0;
    n = strtol(value, &end, 10);
    if (end == value || *end != '\0' || errno != 0 || n < low || n > high)
        return misuse(command, "--%s %s: must be a whole number from %ld to "
                      "%ld", option, value, low, high);
    *number = n;
    return 0;
}

int option_seconds(long *us, const char *command, const char *option,
                   const char *value)
{
    char *end;
    double s = strtod(value, &end);

    if (end == value || *end != '\0' || !(s >= 0.001 && s <= 2000))
        return misuse(command, "--%s %s: must be seconds from 0.001 to 2000",
                      option, value);
    *us = lrint(s * 1e6);
    return 0;
}

static int take_probability(double *p, const char *command,
                            const char *option, const char *value)
{
    char *end;

    *p = strtod(value, &end);
    return end != value && *end == '\0' && *p > 0 && *p < 1 ? 0
        : misuse(command, "--%s %s: must be a probability above 0 and below 1",
                 option, value);
}

jl_real options_gate(const struct options *o, int m)
{
    return o->gate > 0 ? (jl_real)chi_square_quantile(o->gate, m) : 0;
}

static const char *const ports[] = { "loop", "threads", "lcm", NULL };

const char *options_port_name(enum port port)
{
    return ports[port - PORT_LOOP];
}

/* The index of value among names (ending in NULL), or -1 after a message. */
static int choose(const char *command, const char *option, const char *value,
                  const char *const *names)
{
    char known[100] = "";
    int i, used = 0;

    for (i = 0; names[i] != NULL; i++) {
        if (strcmp(value, names[i]) == 0)
            return i;
        used += snprintf(known + used, sizeof known - (size_t)used, "%s%s",
                         i > 0 ? ", " : "", names[i]);
    }
    (void)misuse(command, "--%s %s: unknown; known are %s", option, value,
                 known);
    return -1;
}

static int is_run_name(const char *name)
{
    size_t n = strspn(name, "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                      "abcdefghijklmnopqrstuvwxyz0123456789_");

    return name[n] == '\0' && n >= 1 && n <= 16;
}

static int take_word(const char **to, const char *command, const char *option,
                     const char *value)
{
    *to = value;
    return value[0] != '\0' ? 0
        : misuse(command, "--%s: must not be empty", option);
}

static const char *const topologies[] = {       /* JL_TOPO_... in order */
    "full", "star", "ring", "chain", NULL
};

const char *options_topology(const struct options *o)
{
    return topologies[o->topology];
}

static const char *const forms[] = { "joseph", "standard", "sqrt", NULL };
static const jl_kf_form *const form_of[] = {
    &jl_kf_joseph, &jl_kf_standard, &jl_kf_sqrt
};

const char *options_form(const struct options *o)
{
    int i = 0;

    while (form_of[i] != o->form)
        i++;
    return forms[i];
}

int options_take(struct options *o, int c, char *const *argv)
{
    const char *value = optarg;
    static const char *const filters[] = {
        "imm", "cgimm", "kf", "mekf", "ekf", NULL
    };
    static const char *const holds[] = { "none", "detect", "column", NULL };
    static const char *const exchanges[] = { "gather", "reduce", NULL };
    long number = 0;
    int i, status = 0;

    switch (c) {
    case 1001:
        i = choose(o->command, "filter", value, filters);
        o->filter = (enum filter)(i + FILTER_IMM);
        return i < 0 ? 2 : 0;
    case 1002:
        status = option_long(&number, o->command, "mode", value, 0,
                             JL_MAX_MODES - 1);
        o->mode = (int)number;
        return status;
    case 1003:
        i = choose(o->command, "form", value, forms);
        if (i < 0)
            return 2;
        o->form = form_of[i];
        o->form_given = 1;
        return 0;
    case 1004:
        i = choose(o->command, "hold", value, holds);
        o->hold = (enum hold)(i + HOLD_NONE);
        return i < 0 ? 2 : 0;
    case 1005:
        i = choose(o->command, "port", value, ports);
        o->port = (enum port)(i + PORT_LOOP);
        return i < 0 ? 2 : 0;
    case 1006:
        status = option_long(&number, o->command, "pes", value, 1,
                             JL_MAX_PES);
        o->pes = (int)number;
        return status;
    case 1007:
        return option_seconds(&o->timeout_us, o->command, "timeout", value);
    case 1008:
        o->lcm_url = value;
        return strncmp(value, "udpm://", 7) == 0 ? 0
            : misuse(o->command, "--lcm-url %s: must be udpm://ADDRESS:PORT"
                     "?ttl=N", value);
    case 1009:
        o->run = value;
        return is_run_name(value) ? 0
            : misuse(o->command, "--run '%s': must be 1 to 16 letters, digits "
                     "or _", value);
    case 1010:
        return take_word(&o->z, o->command, "z", value);
    case 1011:
        return take_word(&o->time, o->command, "time", value);
    case 1012:
        return option_seconds(&o->start_us, o->command, "start", value);
    case 1013:
        o->topology = choose(o->command, "topology", value, topologies);
        return o->topology < 0 ? 2 : 0;
    case 1014:
        o->exchange = choose(o->command, "exchange", value, exchanges);
        return o->exchange < 0 ? 2 : 0;
    case 1015:
        return take_probability(&o->gate, o->command, "gate", value);
    case 1016:
        status = option_long(&number, o->command, "gate-most", value, 1,
                             1000000000);
        o->gate_most = (int)number;
        return status;
    case 'o':
        return take_word(&o->out, o->command, "out", value);
    case ':':
        return misuse(o->command, "%s needs a value", argv[optind - 1]);
    default:                            /* what optopt is, getopt(3) says */
        if (optopt > 256 || optopt == 'h')
            return misuse(o->command, "%s: it takes no value",
                          argv[optind - 1]);
        if (optopt > 0)
            return misuse(o->command, "unknown option -%c", optopt);
        return misuse(o->command, "unknown option %s", argv[optind - 1]);
    }
}

int options_end(struct options *o)
{
    if (o->gate_most > 0 && !(o->gate > 0))
        return misuse(o->command, "--gate-most goes with --gate");
    if (o->gate > 0 && o->exchange == JL_EXCHANGE_REDUCE)
        return misuse(o->command, "--gate needs --exchange gather: a PE's pool "
                      "would depend on whether all others reject, too");
    if (o->gate_most == 0)
        o->gate_most = JL_GATE_MOST;
    return 0;
}

int options_parse(struct options *o, int argc, char **argv, const char *help)
{
    static const struct option known[] = { COMMON_OPTIONS, { 0 } };
    int c, status;

    while ((c = getopt_long(argc, argv, SHORT_OPTIONS, known, NULL)) != -1) {
        if (c == 'h') {
            fputs(help, stdout);
            return 0;
        }
        status = options_take(o, c, argv);
        if (status != 0)
            return status;
    }
    status = options_end(o);
    return status == 0 ? -1 : status;
}
