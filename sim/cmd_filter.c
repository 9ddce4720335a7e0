/* jumplink filter MODEL.json DATA.csv: one filter over a file. */
#include <stdio.h>

#include "command.h"
#include "jumplink/par.h"
#include "options.h"
#include "run_file.h"

/* In two, as C promises no longer texts. */
static const char help[] =
    "usage: jumplink filter MODEL.json DATA.csv [OPTIONS]\n"
    "Runs a filter over the measurements in a file and writes its\n"
    "estimates as CSV: time, x0.., P00,P01.. (upper triangle; not of kind\n"
    "cgimm), mu0.., loglik; of kind mekf time, xbar1.., ybar1.., xhat1..,\n"
    "P11,P22.., P1_11,P1_22.. (of its ekf x1.., y1.., P11,P22..).\n\n"
    MODEL_HELP
    "  -o, --out FILE    where to (default: standard output)\n"
    "  --diagnostics     more columns: of each mode j its innovation\n"
    "                    nu<j>_0.., nis<j> = nu' S^-1 nu, and nis_mean<j>\n"
    "                    of those accepted so far; rejected by the gate\n"
    "                    (0, 1); nan: not in this row\n"
    "  --truth A,-,B,..  ... and nees = e' P^-1 e, for data whose columns A,\n"
    "                    B,.. are the true state, in its order; -: unknown\n";
static const char more_help[] =
    COMMON_HELP
    "  --spread          of kind mekf: filter B's predicted covariance also\n"
    "                    has what not knowing the parameters does to x\n"
    DATA_HELP
    "  --pes P           run on this many PEs (default 4 with --port, else\n"
    "                    serial)\n"
    "  --port lcm|threads|loop  ... that are processes and talk over LCM\n"
    "                    (default with --pes), or threads, or threads that\n"
    "                    take turns\n"
    PORT_HELP
    "  --run NAME        name of what is published there, JL.NAME.estimate\n"
    "                    and JL.NAME.measurement (default jumplink)\n"
    HELP_HELP;

/* Only the serial filter has all of it in one place. */
static int check_diagnostics(const struct options *options)
{
    if (options->truth != NULL && !options->diagnostics)
        return misuse("filter", "--truth goes with --diagnostics");
    if (options->diagnostics && options->port != PORT_NONE)
        return misuse("filter", "--diagnostics: in a parallel run PE0 knows "
                      "only its own modes; the serial run, without --pes and "
                      "--port, has the same bits");
    return 0;
}

int cmd_filter(int argc, char **argv)
{
    static const struct option known[] = {
        { "diagnostics", no_argument, NULL, 2001 },
        { "spread", no_argument, NULL, 2002 },
        { "truth", required_argument, NULL, 't' },
        COMMON_OPTIONS, { 0 }
    };
    struct options options;
    int c, status = 0;

    options_init(&options, "filter");
    while ((c = getopt_long(argc, argv, SHORT_OPTIONS, known, NULL)) != -1) {
        if (c == 'h') {
            fputs(help, stdout);
            fputs(more_help, stdout);
            return 0;
        }
        if (c == 2001)
            options.diagnostics = 1;
        else if (c == 2002)
            options.spread = 1;
        else if (c == 't')
            options.truth = optarg;
        else
            status = options_take(&options, c, argv);
        if (status != 0)
            return status;
    }
    status = options_end(&options);
    if (status != 0)
        return status;
    if (argc - optind != 2)
        return misuse("filter", "needs MODEL.json and DATA.csv");
    if (options.port == PORT_NONE && options.pes > 0)
        options.port = PORT_LCM;
    if (options.port != PORT_LCM && options.lcm_url != NULL)
        return misuse("filter", "--lcm-url needs --port lcm");
    if (options.run != NULL && options.lcm_url == NULL)
        return misuse("filter", "--run names what is published on --lcm-url");
    if (options.port == PORT_NONE && (options.topology != JL_TOPO_FULL
                                      || options.exchange
                                             != JL_EXCHANGE_GATHER))
        return misuse("filter", "--topology and --exchange need --pes or "
                      "--port");
    status = check_diagnostics(&options);
    if (status != 0)
        return status;
    if (options.pes == 0)
        options.pes = 4;
    return run_file(argv[optind], argv[optind + 1], &options);
}
