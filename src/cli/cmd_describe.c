/* cli/cmd_describe.c -- gbtrace describe: the manual page, the completion scripts. */
#include <string.h>

#include "cli/describe.h"

static const char *const forms[] = {"man", "bash", "zsh", "fish", NULL};
static void (*const writers[])(FILE *) = {describe_man, describe_bash, describe_zsh, describe_fish};

static const char *const *form_names(void)
{
    return forms;
}

static int run(const command *self, int argc, char **argv)
{
    operands form;
    const int code = options_parse(self, NULL, 0, 1, 1, argc, argv, &form);
    if (code >= 0)
        return code;
    for (int i = 0; forms[i] != NULL; i++)
        if (strcmp(forms[i], form.value[0]) == 0)
            writers[i](stdout);
    return 0;
}

const command command_describe = {
    .name = "describe", .summary = "this command line as a manual page, or as completion for a shell", .usage = "man|bash|zsh|fish",
        .run = run, .words = form_names};
