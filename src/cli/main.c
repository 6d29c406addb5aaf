/* cli/main.c -- find the subcommand and run it. A new one is a file cmd_NAME.c, a line in command.h and a line here. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "cli/command.h"
#include "gbtrace/version.h"

static const command *const commands[] = {
    &command_demo,
    &command_info,
    &command_init,
    &command_train,
    &command_eval,
    &command_compare,
    &command_compress,
    &command_export,
    &command_render,
    &command_report,
    &command_view,
    &command_make_scene,
    &command_bench,
    &command_study,
    &command_check_grad,
};

enum { COMMAND_COUNT = sizeof commands / sizeof *commands };

static int print_help(void)
{
    puts("usage: gbtrace COMMAND [arguments]\n\nneural Gaussian scenes from photos, traced on the CPU\n\ncommands:");
    for (int i = 0; i < COMMAND_COUNT; i++)
        printf("  %-12s%s\n", commands[i]->name, commands[i]->summary);
    puts("\n`gbtrace COMMAND --help` lists the options of one; `gbtrace --version` prints the version.\n"
         "Exit codes: 0 done, 2 usage, 3 bad input, 4 input or output failed, 5 out of memory or over a limit, 128+n stopped by signal n.");
    return 0;
}

static const command *find(const char *name)
{
    for (int i = 0; i < COMMAND_COUNT; i++)
        if (strcmp(commands[i]->name, name) == 0)
            return commands[i];
    return NULL;
}

static int unknown(const char *name)
{
    const char *names[COMMAND_COUNT];
    for (int i = 0; i < COMMAND_COUNT; i++)
        names[i] = commands[i]->name;
    const char *nearest = command_nearest(name, names, COMMAND_COUNT);
    if (nearest != NULL)
        return command_misused("%.100s: unknown command (did you mean %s?)", name, nearest);
    return command_misused("%.100s: unknown command (see gbtrace --help)", name);
}

static int dispatch(int argc, char **argv)
{
    if (argc < 2)
        return command_misused("command missing (see gbtrace --help)");
    const char *verb = argv[1];
    if (strcmp(verb, "--version") == 0) {
        printf("gbtrace %s\n", gbt_version());
        return 0;
    }
    if (strcmp(verb, "--help") == 0 || strcmp(verb, "-h") == 0)
        return print_help();
    if (strcmp(verb, "help") == 0) {
        if (argc == 2)
            return print_help();
        const command *about = find(argv[2]);
        return about == NULL ? unknown(argv[2]) : about->run(about, 1, (char *[]){"--help", NULL});
    }
    const command *found = find(verb);
    return found == NULL ? unknown(verb) : found->run(found, argc - 2, argv + 2);
}

int main(int argc, char **argv)
{
    const int code = dispatch(argc, argv);
    if ((fflush(stdout) != 0 || ferror(stdout)) && code == 0) { /* a full disk must not look like success */
        gbt_error err = {.status = GBT_ERR_IO};
        snprintf(err.text, sizeof err.text, "standard output: write failed: %s", strerror(errno));
        return command_failed(GBT_ERR_IO, &err);
    }
    return code;
}
