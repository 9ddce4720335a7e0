/* What the subcommands that run a filter have in common. */
#ifndef SIM_OPTIONS_H
#define SIM_OPTIONS_H

#include <getopt.h>

#include "jumplink/kf.h"

enum hold {                     /* which rows count as arrived */
    HOLD_DEFAULT,               /* column if there is one, else none        */
    HOLD_NONE,                  /* all that have a z                        */
    HOLD_DETECT,                /* ... and do not repeat the row before     */
    HOLD_COLUMN                 /* ... and say so in column `arrived`       */
};

/* BY_HAND: over LCM, with PEs that somebody else starts. */
enum port { PORT_NONE, PORT_LOOP, PORT_THREADS, PORT_LCM, PORT_BY_HAND };

enum filter {
    FILTER_OF_KIND, FILTER_IMM, FILTER_CGIMM, FILTER_KF, FILTER_MEKF,
    FILTER_EKF
};

struct live_input;

struct options {
    const char *command;        /* for messages: "filter"                   */
    enum filter filter;         /* OF_KIND: the one the model is of         */
    int mode;                   /* of FILTER_KF; -1: the only one           */
    int spread;                 /* of FILTER_MEKF (jumplink/mekf.h)         */
    const jl_kf_form *form;
    int form_given;
    double gate;                /* a good measurement passes with this
                                   probability; 0: no gate                  */
    int gate_most;              /* rejections in a row; 0: not given        */
    enum hold hold;
    enum port port;             /* PORT_NONE: serial                        */
    int pes;
    int topology;               /* JL_TOPO_...                              */
    int exchange;               /* JL_EXCHANGE_...                          */
    long timeout_us;            /* of each answer in a parallel run         */
    long start_us;              /* for all to be there at its start         */
    const char *lcm_url;        /* NULL: a private network                  */
    const char *run;            /* name of an LCM run, or NULL              */
    struct live_input *live;    /* rows come from there, one by one; or NULL */
    const char *z, *time;       /* columns of the data                      */
    int diagnostics;            /* more columns of the estimates            */
    const char *truth;          /* columns of the true state, "a,-,b"; NULL */
    const char *out;            /* -o or --out                              */
};

/* The long options above, for getopt_long; their values are beyond any
 * character, and those of a command's own options are its characters, or, of
 * one that takes no value, beyond them, too: such a value is then told from an
 * unknown short option. */
#define COMMON_OPTIONS \
    { "filter", required_argument, NULL, 1001 }, \
    { "mode", required_argument, NULL, 1002 }, \
    { "form", required_argument, NULL, 1003 }, \
    { "hold", required_argument, NULL, 1004 }, \
    { "port", required_argument, NULL, 1005 }, \
    { "pes", required_argument, NULL, 1006 }, \
    { "timeout", required_argument, NULL, 1007 }, \
    { "lcm-url", required_argument, NULL, 1008 }, \
    { "run", required_argument, NULL, 1009 }, \
    { "z", required_argument, NULL, 1010 }, \
    { "time", required_argument, NULL, 1011 }, \
    { "start", required_argument, NULL, 1012 }, \
    { "topology", required_argument, NULL, 1013 }, \
    { "exchange", required_argument, NULL, 1014 }, \
    { "gate", required_argument, NULL, 1015 }, \
    { "gate-most", required_argument, NULL, 1016 }, \
    { "out", required_argument, NULL, 'o' }, \
    { "help", no_argument, NULL, 'h' }

#define COMMON_HELP \
    "  --filter imm|cgimm|kf|mekf|ekf  by the model's kind (default), or the\n" \
    "                    Kalman filter of one mode of kind imm, or the plain\n" \
    "                    extended one of kind mekf\n" \
    "  --mode J          ... of this one, from 0 (default: the only one)\n" \
    "  --form joseph|standard|sqrt  how covariances are kept and updated\n" \
    "                    (default joseph; sqrt: as factors)\n" \
    "  --gate P          reject outliers, which no mode expects: a good\n" \
    "                    measurement passes with probability P, say 0.9999\n" \
    "                    (default: no gate)\n" \
    "  --gate-most N     ... until N were rejected in a row; then it is the\n" \
    "                    filter that is wrong (default 5)\n"
#define MODEL_HELP \
    "The model is JSON: { \"kind\": \"imm\", \"modes\": [ {..}, .. ], .. }.\n" \
    "Modes of the catalogue follow any time step; each has an accel_std\n" \
    "and a type: cv; ca (order 3); ct (axes 2), with a turn_rate; singer\n" \
    "(order 3), with a tau_s.  At the top: axes, order, sigma_z, sojourn_s\n" \
    "(mean times in each mode) or Pi; and v0_std, a0_std of velocity\n" \
    "(default 100) and acceleration (10) before anything is known.  A mode\n" \
    "may have order 2 beside others of order 3, the model's: to them its\n" \
    "acceleration is 0 +- a0_std.  Or modes by matrices: Phi, Gamma, Q, H,\n" \
    "R, and n, m, Pi, mu0 at the top; x0, P0 in each mode or at the top.\n" \
    "Or kind cgimm, constant gains: T, R, Pi, mu0, axes (default 1) at the\n" \
    "top; modes with gains w0, winf, kc, or with an order and a Q for each\n" \
    "at the top, which make the gains; x0 in all of them, or in none: then\n" \
    "it is the first measurement, at rest.  A row is a step of T.  Without\n" \
    "covariances: no --form, --gate, --diagnostics, --exchange reduce.\n" \
    "Or kind mekf: model ar1, spring2, ct4pos, ct4rdc or gen32, with its\n" \
    "params; n, m, r, p1, p2; x0, y0, P0, P10, Q, R; cb prev, pred or filt\n" \
    "(jumplink/mekf.h, sim/mekf_zoo.h).  A row is a step; on one processor.\n\n"
#define DATA_HELP \
    "  --hold HOW        which measurements count as lost: none; detect:\n" \
    "                    those that repeat the row before exactly; column:\n" \
    "                    those with 0 in column arrived (default: column\n" \
    "                    if there is one, else none).  Empty and nan always\n" \
    "                    do.  A new value in column run starts anew\n" \
    "  --z A,B,..        columns of the measurement (default z0,z1,..)\n" \
    "  --time NAME       column of the time (default t_s, else k)\n"
#define HELP_HELP \
    "  -h, --help        this text\n"
#define EXCHANGE_HELP \
    "  --topology full|star|ring|chain  which PEs are joined (default full)\n" \
    "  --exchange gather|reduce  in a step PEs exchange every mode's\n" \
    "                    estimate (default: the serial filter's bits), or\n" \
    "                    only a pool each: for chains that stay or jump\n" \
    "                    anywhere alike, Pi = diag(lambda) + 1 v'\n"
#define PORT_HELP \
    EXCHANGE_HELP \
    "  --timeout S       longest wait for an answer (default 2)\n" \
    "  --start S         longest wait for the PEs to start (default 10)\n" \
    "  --lcm-url URL     LCM address, on the network as it is (default: a\n" \
    "                    private network for this run)\n"
#define RUN_HELP \
    EXCHANGE_HELP \
    "  --run NAME        name of the run, if several share a network: 1 to\n" \
    "                    16 letters, digits or _ (default jumplink)\n" \
    "  --start S         longest wait for PEs that are not there yet\n" \
    "                    (default 60; a PE waits for its host without end)\n" \
    "  --lcm-url URL     LCM address, such as\n" \
    "                    udpm://239.255.76.67:7667?ttl=1\n"

/* "loop", "threads" or "lcm". */
const char *options_port_name(enum port port);

void options_init(struct options *options, const char *command);

/* The nis above which a measurement of m components is rejected; 0: never. */
jl_real options_gate(const struct options *options, int m);

/* The topology's name. */
const char *options_topology(const struct options *options);

/* The form's name: "joseph". */
const char *options_form(const struct options *options);

/* getopt_long's short options: those of COMMON_OPTIONS, and no words of its
 * own about wrong ones. */
#define SHORT_OPTIONS ":o:h"

/* Take the option `c` of the common ones, whose value is in optarg; anything
 * that getopt_long does not know is refused here.
 * Returns 0, or 2 (the exit status) after a message. */
int options_take(struct options *options, int c, char *const *argv);

/* When all are taken: what does not go together.  Returns 0, or 2 after a
 * message. */
int options_end(struct options *options);

/* Take all options of a command that has only the common ones.
 * Returns -1: go on with argv from optind; or the exit status, after the help
 * or a message. */
int options_parse(struct options *options, int argc, char **argv,
                  const char *help);

/* A whole number, or seconds, out of an option's value, within [low, high].
 * Return 0, or 2 after a message that names the option. */
int option_long(long *number, const char *command, const char *option,
                const char *value, long low, long high);
int option_seconds(long *us, const char *command, const char *option,
                   const char *value);

/* "jumplink COMMAND: message, see jumplink COMMAND --help"; returns 2. */
int misuse(const char *command, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

#endif
