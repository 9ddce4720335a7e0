/* The subcommands: each parses its arguments, does its work, and returns the
 * program's exit status: 0 success, 1 the work failed, 2 wrong use or an input
 * that cannot be read. */
#ifndef SIM_COMMAND_H
#define SIM_COMMAND_H

int cmd_sim(int argc, char **argv);
int cmd_filter(int argc, char **argv);
int cmd_host(int argc, char **argv);
int cmd_pe(int argc, char **argv);
int cmd_systolic(int argc, char **argv);

#endif
