/* jumplink host: the host of a run over LCM whose PEs were started by hand. */
#include <stdio.h>

#include "command.h"
#include "options.h"
#include "run_file.h"

static const char help[] =
    "usage: jumplink host MODEL.json DATA.csv --pes P --lcm-url URL\n"
    "The host of a run on several machines: waits for the PEs (jumplink\n"
    "pe), feeds them the measurements, and writes the estimates like\n"
    "jumplink filter.\n\n"
    "  -o, --out FILE    where to (default: standard output)\n"
    "  --pes P           how many PEs there are\n"
    "  --timeout S       longest wait for an answer (default 2)\n"
    RUN_HELP
    COMMON_HELP
    DATA_HELP
    HELP_HELP;

int cmd_host(int argc, char **argv)
{
    struct options options;
    int status;

    options_init(&options, "host");
    options.run = "jumplink";
    options.start_us = 60000000;
    options.port = PORT_BY_HAND;
    status = options_parse(&options, argc, argv, help);
    if (status >= 0)
        return status;
    if (argc - optind != 2)
        return misuse("host", "needs MODEL.json and DATA.csv");
    if (options.pes == 0 || options.lcm_url == NULL)
        return misuse("host", "needs --pes and --lcm-url");
    if (options.port != PORT_BY_HAND)
        return misuse("host", "--port: it is always LCM");
    return run_file(argv[optind], argv[optind + 1], &options);
}
