/* cli/cmd_study.c -- gbtrace study: measurements that a chart is made of. */
#include <stdio.h>
#include <string.h>

#include "cli/options.h"
#include "gbtrace/bench.h"
#include "gbtrace/train.h"

static int run(const command *self, int argc, char **argv)
{
    gbt_study_def def = gbt_study_def_default();
    const char *out = NULL;
    int threads = 0;
    const option options[] = {
        {.name = "output", .short_name = 'o', .kind = OPTION_STRING, .value = &out, .value_name = "DIR", .help = "folder for the tables and the chart", .required = true},
        {.name = "camera", .kind = OPTION_STRING, .value = &def.camera, .value_name = "FILE.json", .help = "the camera of every .ply; default: camera.json beside it"},
        {.name = "repeats", .kind = OPTION_INT, .value = &def.repeats, .min = 1, .max = 1000, .value_name = "N", .help = "timed passes of each setting; the median counts"},
        {.name = "threads", .kind = OPTION_INT, .value = &threads, .min = 0, .max = 1024, .value_name = "T", .help = "0: all processors"},
    };
    operands named;
    const int code = options_parse(self, options, sizeof options / sizeof *options, 2, 17, argc, argv, &named);
    if (code >= 0)
        return code;
    if (strcmp(named.value[0], "speed") != 0)
        return command_misused("study: unknown study \"%.60s\" (wanted speed)", named.value[0]);
    if (threads > 0)
        gbt_set_threads(threads);
    def.models = named.value + 1, def.model_count = (size_t)named.count - 1;
    gbt_error err = {0};
    return command_failed(gbt_study_speed(&def, out, stdout, &err), &err);
}

const command command_study = {.name = "study", .summary = "speed against accuracy: measure every setting, draw the chart", .usage = "speed MODEL... -o DIR", .run = run};
