/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_render.c -- gbtrace render. */
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "cli/options.h"
#include "gbtrace/evaluate.h"

/** "1280x720" and nothing else. */
static bool read_size(const char *text, int *width, int *height)
{
    int used = 0;
    return strspn(text, "0123456789x") == strlen(text) &&
           sscanf(text, "%5dx%5d%n", width, height, &used) == 2 && text[used] == '\0' && *width > 0 &&
           *height > 0;
}

static gbt_render_def def;
static const char *out, *size;

static const option *options(int *count)
{
    def = gbt_render_def_default();
    static const option rows[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &out,
         .value_name = "DIR",
         .help =
             "folder for the images; default for views as the run itself draws them: RUN/renders/SPLIT; with "
             "--path also a film: .mp4, .webm, .gif (by ffmpeg)"},
        RUN_OPTION(NULL),
        {.name = "split",
         .kind = OPTION_CHOICE,
         .value = &def.split,
         .choices = GBT_SPLIT_NAMES,
         .help = "which views of the data set"},
        {.name = "skip-train",
         .kind = OPTION_CHOICE,
         .value = &def.split,
         .choices = GBT_SPLIT_NAMES,
         .fixed = "test",
         .help = "the same as --split test",
         .rare = true},
        {.name = "skip-test",
         .kind = OPTION_CHOICE,
         .value = &def.split,
         .choices = GBT_SPLIT_NAMES,
         .fixed = "train",
         .help = "the same as --split train",
         .rare = true},
        {.name = "iteration", .kind = OPTION_ELSEWHERE, .help = "a run keeps only its last model"},
        {.name = "camera",
         .kind = OPTION_STRING,
         .value = &def.camera,
         .value_name = "FILE.json",
         .help = "render one picture from this camera file (lens, aperture, rolling shutter, rays: "
                 "docs/cameras.md) instead of views"},
        {.name = "path",
         .kind = OPTION_STRING,
         .value = &def.path,
         .value_name = "orbit|interpolate|FILE.json",
         .choices = "orbit|interpolate",
         .help = "render a film: an orbit around the scene, through the photos' cameras, or along a path "
                 "file (docs/video.md)"},
        {.name = "look-at",
         .kind = OPTION_STRING,
         .value = &def.look_at,
         .value_name = "X,Y,Z",
         .help = "orbit: the point to look at, in the data set's coordinates; default: where the photos' "
                 "cameras look",
         .rare = true},
        {.name = "radius",
         .kind = OPTION_DOUBLE,
         .value = &def.orbit_radius,
         .field = "orbit_radius",
         .min = 0,
         .max = 1e9,
         .value_name = "R",
         .help = "orbit: its radius, scene units; default: as far as the photos' cameras",
         .rare = true},
        {.name = "height",
         .kind = OPTION_DOUBLE,
         .value = &def.orbit_height,
         .field = "orbit_height",
         .min = -1e9,
         .max = 1e9,
         .value_name = "H",
         .help = "orbit: height above the point that it looks at, scene units; default: as high as the "
                 "photos' cameras",
         .rare = true},
        {.name = "frames",
         .kind = OPTION_INT,
         .value = &def.frames,
         .min = 0,
         .max = 100000,
         .value_name = "N",
         .help =
             "number of frames; 0: 240 for an orbit, 15 per photo but 900 at most, or all of a path file"},
        {.name = "fps",
         .kind = OPTION_DOUBLE,
         .value = &def.fps,
         .min = 0,
         .max = 1000,
         .value_name = "F",
         .help = "frames per second; 0: as the path file says, else 30",
         .rare = true},
        {.name = "size",
         .kind = OPTION_STRING,
         .value = &size,
         .field = "width",
         .value_name = "WxH",
         .help = "size of the film, such as 1280x720; default: that of the photos"},
        {.name = "outputs",
         .kind = OPTION_STRING,
         .value = &def.outputs,
         .value_name = "LIST",
         .choices = "transmittance|depth|median-depth|normal|hits|anchor",
         .list = true,
         .help = "also write these as EXR: any of transmittance,depth,median-depth,normal,hits,anchor "
                 "(docs/formats.md)",
         .aliases = "aov"},
        PRESET_OPTION(&def.preset),
        {.name = "insert",
         .kind = OPTION_STRING,
         .value = &def.insert,
         .value_name = "FILE.json",
         .help = "insert meshes into the scene, matt or mirrors, with shadows (docs/inserting.md)"},
        DATA_OPTION(&def.data, "cameras of this data set; needed for plain Gaussians without --camera"),
        {.name = "renderer",
         .kind = OPTION_CHOICE,
         .value = &def.renderer,
         .choices = GBT_RENDERER_NAMES,
         .help = "renderer; default: the one it was trained with. reference: double precision, slow"},
        {.name = "memory",
         .kind = OPTION_SIZE,
         .value = &def.memory,
         .min = 0,
         .max = 0x1p60,
         .value_name = "BYTES",
         .help = "upper limit for memory, such as 2G: a .ply that is larger is drawn cell by cell "
                 "(docs/memory.md); default: no limit"},
        {.name = "format",
         .kind = OPTION_CHOICE,
         .value = &def.format,
         .choices = GBT_PICTURE_FORMAT_NAMES,
         .help = "8-bit PNG, or float EXR"},
        DOWNSCALE_OPTION(&def.downscale),
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

/* Whether pictures come out as when the run was scored. RUN/renders/test holds the scored pictures, so only
   these may be written there by default. */
static bool draws_as_the_run(void)
{
    const gbt_render_def own = gbt_render_def_default();
    return def.data == NULL && def.downscale == own.downscale && def.format == own.format &&
           def.insert == NULL && def.path == NULL && def.preset == own.preset && def.renderer == own.renderer;
}

static int run(const operands *given)
{
    if (size != NULL && !read_size(size, &def.width, &def.height))
        return command_misused("--size: bad value (wanted WxH like 1280x720, got %.80s)", size);
    static const char *const split_names[] = {"test", "train", "all"};
    char folder[4096];
    if (out == NULL) {
        struct stat info;
        if (stat(given->value[0], &info) != 0 || !S_ISDIR(info.st_mode))
            return command_misused("--output is missing (usage: gbtrace %s %s)", command_render.name,
                                   command_render.usage);
        if (def.camera == NULL && !draws_as_the_run())
            return command_misused(
                "--output is missing (with --data, --downscale, --format, --insert, --path, "
                "--preset or --renderer, pictures do not go into %s/renders)",
                given->value[0]);
        if (snprintf(folder, sizeof folder, "%s/renders%s%s", given->value[0], def.camera == NULL ? "/" : "",
                     def.camera == NULL ? split_names[def.split] : "") >= (int)sizeof folder)
            return command_misused("%.60s...: the path is too long", given->value[0]);
        out = folder;
    }
    gbt_error err = {0};
    const gbt_status status = gbt_render(given->value[0], out, &def, &err);
    if (status == GBT_OK)
        printf("%s\n", out);
    return command_failed(status, &err);
}

const command command_render = {.name = "render",
                                .summary = "render the views of a scene, a camera of your own, or a film",
                                .usage = "RUN|GAUSSIANS [-o DIR]",
                                .options = options,
                                .min_operands = 1,
                                .max_operands = 1,
                                .shares_work = true,
                                .run = run};
