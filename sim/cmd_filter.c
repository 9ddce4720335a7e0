/* jumplink filter MODEL.json DATA.csv: one filter over a file. */
#include <stdio.h>

#include "command.h"
#include "jumplink/par.h"
#include "options.h"
#include "run_file.h"

static const char help[] =
    "usage: jumplink filter MODEL.json DATA.csv [OPTIONS]\n"
    "Runs a filter over the measurements in a file and writes its\n"
    "estimates as CSV: time, x0.., P00,P01.. (upper triangle), mu0..,\n"
    "loglik.\n\n"
    MODEL_HELP
    "  -o, --out FILE    where to (default: standard output)\n"
    COMMON_HELP
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

int cmd_filter(int argc, char **argv)
{
    struct options options;
    int status;

    options_init(&options, "filter");
    status = options_parse(&options, argc, argv, help);
    if (status >= 0)
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
    if (options.pes == 0)
        options.pes = 4;
    return run_file(argv[optind], argv[optind + 1], &options);
}
