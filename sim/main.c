/* jumplink: the subcommands by their names. */
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "command.h"
#include "interrupt.h"
#include "jumplink.h"

static const struct {
    const char *name, *does;
    int (*run)(int argc, char **argv);
} commands[] = {
    { "sim", "the main job: flights, filters on PEs over LCM, table, plots",
      cmd_sim },
    { "filter", "one filter over a file, on one processor or on several PEs",
      cmd_filter },
    { "host", "the host of a run whose PEs were started by hand", cmd_host },
    { "pe", "one PE of a run, started by hand", cmd_pe },
    { "systolic", "the MEKF on an array of cells: counts, picture",
      cmd_systolic },
};

#define COMMANDS (sizeof commands / sizeof *commands)

static void help(FILE *out)
{
    size_t i;

    fprintf(out, "usage: jumplink COMMAND [OPTIONS]\n"
            "Filters for systems that jump between models, on processing "
            "elements joined by links.\n\n");
    for (i = 0; i < COMMANDS; i++)
        fprintf(out, "  %-8s %s\n", commands[i].name, commands[i].does);
    fprintf(out, "\njumplink COMMAND --help says more; jumplink --version.\n");
}

/* A program may be started with 0, 1 or 2 closed; a file or pipe must not get
 * one of these numbers by chance. */
static void fill_standard(void)
{
    int fd;

    do
        fd = open("/dev/null", O_RDWR);
    while (fd >= 0 && fd <= 2);
    close(fd);
}

int main(int argc, char **argv)
{
    size_t i;

    fill_standard();
    signal(SIGCHLD, SIG_DFL);           /* or who ends is not waited for */
    if (argc < 2) {
        help(stderr);
        return 2;
    }
    for (i = 0; i < COMMANDS; i++)
        if (strcmp(argv[1], commands[i].name) == 0) {
            if (commands[i].run != cmd_pe)      /* its host says the word */
                interrupt_catch();
            return commands[i].run(argc - 1, argv + 1);
        }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        help(stdout);
        return 0;
    }
    if (strcmp(argv[1], "--version") == 0) {
        printf("jumplink %d.%d (%s)\n", JL_VERSION_MAJOR, JL_VERSION_MINOR,
               JL_REAL_FLOAT ? "float" : "double");
        return 0;
    }
    fprintf(stderr, "jumplink: unknown command '%s' (see jumplink --help)\n",
            argv[1]);
    return 2;
}
