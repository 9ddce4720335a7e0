/* jumplink pe: one PE of a run over LCM. */
#include <stdio.h>
#include <string.h>

#include "command.h"
#include "lcm_net.h"
#include "run.h"

static const char help[] =
    "usage: jumplink pe --pe I --pes P --model MODEL.json --lcm-url URL\n"
    "One PE of a run on several machines: the same model, filter and\n"
    "form on all PEs and on the host (jumplink host), which must be\n"
    "started too, in any order.  Ends when the host ends the run, and\n"
    "prints what it sent; or, with a word, when the host or another PE\n"
    "has been silent for the timeout.\n\n"
    "  --pe I            which PE this is, from 0; PE 0 talks to the host\n"
    "  --pes P           how many there are\n"
    "  --model MODEL.json  the model\n"
    "  --timeout S       longest wait for a word from the others (default 2)\n"
    RUN_HELP
    COMMON_HELP
    HELP_HELP;

static int serve(int pe, const struct model *model,
                 const struct options *options)
{
    struct lcm_node node;
    struct traffic traffic = { 0 };
    int status;

    if (lcm_node_open(&node, pe, options->lcm_url, options->run, model,
                      options) != 0)
        return 1;
    status = run_pe(pe, model, options, node.to, node.from);
    lcm_node_traffic(&node, &traffic);
    if (status != JL_OK)
        lcm_node_hint(&node);
    lcm_node_close(&node, status == JL_OK);
    if (status != JL_OK)
        return 1;
    printf("pe %d of %d: %lu messages, %lu octets, %lu sent again, %lu "
           "refused\n", pe, options->pes, traffic.messages, traffic.octets,
           traffic.resent, traffic.refused);
    return 0;
}

int cmd_pe(int argc, char **argv)
{
    static const struct option known[] = {
        { "pe", required_argument, NULL, 'p' },
        { "model", required_argument, NULL, 'm' },
        COMMON_OPTIONS, { 0 }
    };
    const char *path = NULL;
    struct options options;
    struct model model;
    long pe = -1;
    int c, status = 0;

    options_init(&options, "pe");
    options.run = "jumplink";
    options.start_us = 60000000;
    while ((c = getopt_long(argc, argv, SHORT_OPTIONS, known, NULL)) != -1) {
        if (c == 'h') {
            fputs(help, stdout);
            return 0;
        }
        if (c == 'p')
            status = option_long(&pe, "pe", "pe", optarg, 0, JL_MAX_PES - 1);
        else if (c == 'm')
            path = optarg;
        else
            status = options_take(&options, c, argv);
        if (status != 0)
            return status;
    }
    status = options_end(&options);
    if (status != 0)
        return status;
    if (optind < argc)
        return misuse("pe", "unexpected '%s'", argv[optind]);
    if (pe < 0 || options.pes == 0 || path == NULL || options.lcm_url == NULL)
        return misuse("pe", "needs --pe, --pes, --model and --lcm-url");
    if (pe >= options.pes)
        return misuse("pe", "--pe %ld: there are only %d PEs, 0 to %d", pe,
                      options.pes, options.pes - 1);
    if (options.hold != HOLD_DEFAULT || options.z != NULL
        || options.time != NULL || options.out != NULL
        || options.port != PORT_NONE)
        return misuse("pe", "--hold, --z, --time, --out and --port are not "
                      "for a PE");
    options.port = PORT_BY_HAND;
    if (model_read(&model, path) != 0)
        return 2;
    status = run_pick_mode(&model, &options);
    if (status == 0)
        status = serve((int)pe, &model, &options);
    model_free(&model);
    return status;
}
