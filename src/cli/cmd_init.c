/* cli/cmd_init.c -- gbtrace init. */
#include "cli/options.h"
#include "gbtrace/init.h"

static int run(const command *self, int argc, char **argv)
{
    gbt_init_def def = gbt_init_def_default();
    const char *out = NULL, *json = NULL;
    bool mesh = false;
    const option options[] = {
        {.name = "output", .short_name = 'o', .kind = OPTION_STRING, .value = &out, .value_name = "FILE.ply",
         .help = "where to write balls and anchors", .required = true},
        {.name = "init", .kind = OPTION_CHOICE, .value = &def.init, .choices = "gb|adaptive|voxel|random",
         .help = "granular balls; balls where the scene needs them; the voxel baseline; or random points"},
        {.name = "init-count", .kind = OPTION_DOUBLE, .value = &def.init_count, .min = 0, .max = 1, .value_name = "F",
         .help = "anchors per point of adaptive and random; 0: half as many as gb"},
        {.name = "scale-prior", .kind = OPTION_CHOICE, .value = &def.scale_prior, .choices = "gb|nn",
         .help = "first scale of --init gb: balls and spacing, or spacing alone, as the others have"},
        {.name = "max-depth", .kind = OPTION_INT, .value = &def.max_depth, .min = 0, .max = 64, .value_name = "D",
         .help = "most splits of the cloud"},
        {.name = "voxel-size", .kind = OPTION_FLOAT, .value = &def.voxel_size, .min = 0, .max = 1e30, .value_name = "V",
         .help = "base scale, scene units; 0: from the points"},
        {.name = "voxel-rule", .kind = OPTION_CHOICE, .value = &def.voxel_rule, .choices = "median|squared",
         .help = "how it comes from the points: their spacing, or the reference code's squares"},
        {.name = "mesh", .kind = OPTION_FLAG, .value = &mesh, .help = "write a sphere per ball in place of a point"},
        {.name = "json", .kind = OPTION_STRING, .value = &json, .value_name = "FILE", .help = "write the counts there"},
    };
    operands data;
    const int code = options_parse(self, options, sizeof options / sizeof *options, 1, 1, argc, argv, &data);
    if (code >= 0)
        return code;
    def.mesh = mesh;
    gbt_error err = {0};
    return command_failed(gbt_init(data.value[0], &def, out, json, stdout, &err), &err);
}

const command command_init = {.name = "init", .summary = "granular balls and anchors of a data set, beside the voxel baseline",
                              .usage = "DATA -o FILE.ply", .run = run};
