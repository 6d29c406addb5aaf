/* SPDX-License-Identifier: Apache-2.0 */
/* cli/main.c -- find the subcommand and run it. */
#include <errno.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cli/options.h"
#include "cli/progress.h"
#include "gbtrace/cluster.h"
#include "gbtrace/train.h"
#include "gbtrace/version.h"

enum { NAMES_MAX = 64 };

static int print_help(void)
{
    puts("usage: gbtrace COMMAND [arguments]\n\nneural Gaussian scenes from photos, ray traced on the "
         "CPU\n\ncommands:");
    for (int i = 0; i < command_list_count; i++)
        printf("  %-12s%s\n", command_list[i]->name, command_list[i]->summary);
    puts("\n`gbtrace COMMAND --help` lists the options of one; `gbtrace --version` (-V, -v) prints the "
         "version.\n"
         "Exit codes: 0 done, 1 a check failed, 2 usage, 3 bad input, 4 input or output failed, 5 out of "
         "memory or over a limit, 130 interrupted, 141 who read the output has left.");
    return 0;
}

static const command *find(const char *name)
{
    for (int i = 0; i < command_list_count; i++)
        if (strcmp(command_list[i]->name, name) == 0 ||
            (command_list[i]->alias != NULL && strcmp(command_list[i]->alias, name) == 0))
            return command_list[i];
    return NULL;
}

static int unknown(const char *name)
{
    const char *names[NAMES_MAX];
    int count = 0;
    for (; count < command_list_count && count < NAMES_MAX; count++)
        names[count] = command_list[count]->name;
    const char *nearest = command_nearest(name, names, count);
    if (nearest != NULL)
        return command_misused("%.100s: unknown command (did you mean %s?)", name, nearest);
    return command_misused("%.100s: unknown command (see gbtrace --help)", name);
}

static int run(const command *self, int argc, char **argv)
{
    static operands given;
    const int code = options_parse(self, argc, argv, &given);
    if (code >= 0)
        return code;
    if (options_threads > 0)
        gbt_set_threads(options_threads);
    const bool first = gbt_cluster_rank() == 0;
    if (!self->shares_work)
        gbt_cluster_close(0, NULL);
    if (!first && !self->shares_work)
        return 0;
    gbt_error err = {0};
    const char *folder = getenv("TMPDIR");
    if (folder == NULL || folder[0] == '\0')
        folder = "/var/tmp"; /* not /tmp, which may be kept in memory (tmpfs) */
    if (options_memory > 0 && gbt_set_memory(options_memory, folder, &err) != GBT_OK)
        return command_failed(err.status, &err);
    const int done = self->run(&given);
    return done == 0 ? command_failed(options_memory_kept(options_memory, &err), &err) : done;
}

static int dispatch(int argc, char **argv)
{
    if (argc < 2)
        return command_misused("command missing (see gbtrace --help)");
    const char *verb = argv[1];
    if (strcmp(verb, "--version") == 0 || strcmp(verb, "-V") == 0 || strcmp(verb, "-v") == 0) {
        printf("gbtrace %s\n", gbt_version());
        return 0;
    }
    if (strcmp(verb, "--help") == 0 || strcmp(verb, "-h") == 0)
        return print_help();
    if (strcmp(verb, "help") == 0) {
        if (argc == 2)
            return print_help();
        const command *about = find(argv[2]);
        return about == NULL ? unknown(argv[2]) : run(about, 1, (char *[]){"--help", NULL});
    }
    const command *found = find(verb);
    return found == NULL ? unknown(verb) : run(found, argc - 2, argv + 2);
}

/* _exit() rather than exit(), whose handlers are unsafe while other threads run. */
static void end_without_memory(void)
{
    const int code = gbt_status_exit_code(GBT_ERR_NO_MEMORY);
    progress_error("out of memory or threads in a library");
    progress_end(code);
    _exit(code);
}

int main(int argc, char **argv)
{
    gbt_when_out_of_memory(end_without_memory);
    signal(SIGXFSZ, SIG_IGN); /* exceeding the file size limit becomes an ordinary write error */
    signal(SIGCHLD, SIG_DFL); /* if it were ignored, the exit codes of ffmpeg and COLMAP would be lost */
    signal(SIGPIPE, SIG_IGN); /* training continues when nobody reads its progress any more */
    gbt_error alone = {0};
    const gbt_status joined = gbt_cluster_open(&alone);
    int code = joined == GBT_OK ? dispatch(argc, argv) : command_failed(joined, &alone);
    if ((fflush(stdout) != 0 || ferror(stdout)) && code == 0) { /* a full disk must not look like success */
        gbt_error err = {.status = GBT_ERR_IO};
        snprintf(err.text, sizeof err.text, "standard output: write failed: %s", strerror(errno));
        code = errno == EPIPE ? 128 + SIGPIPE : command_failed(GBT_ERR_IO, &err); /* the reader, such as head,
                                                                                     has read enough */
    }
    progress_end(code);
    gbt_cluster_close(code, progress_last_error());
    return code;
}
