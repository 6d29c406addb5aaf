/* SPDX-License-Identifier: Apache-2.0 */
/* view/request.c -- parse and check a query. */
#include "view/request.h"

#include <string.h>

#include "base/camera_pose.h"
#include "base/choice.h"
#include "base/fail.h"
#include "data/number.h"
#include "render/camera_file.h"
#include "render/output_names.h"

typedef struct words {
    request_word *word;
    void *query;
    gbt_error *err;
} words;

static const char *word_of(const words *w, const char *name) { return w->word(w->query, name); }

static gbt_status take_number(const words *w, const char *name, double low, double high, double *out)
{
    const char *text = word_of(w, name);
    if (text == NULL)
        return GBT_OK;
    if (number_parse_double(text, strlen(text), out) != NUMBER_OK || !(*out >= low && *out <= high))
        return base_fail(w->err, GBT_ERR_ARGUMENT, "%s: \"%.40s\" (wanted a number from %g to %g)", name,
                         text, low, high);
    return GBT_OK;
}

static gbt_status take_whole(const words *w, const char *name, int low, int high, int *out)
{
    double value = *out;
    GBT_TRY(take_number(w, name, low, high, &value));
    *out = (int)value;
    return *out == value ? GBT_OK
                         : base_fail(w->err, GBT_ERR_ARGUMENT, "%s: %g (wanted a whole number)", name, value);
}

static gbt_status take_choice(const words *w, const char *name, const char *choices, int *out)
{
    const char *text = word_of(w, name);
    if (text == NULL)
        return GBT_OK;
    char list[CHOICE_TEXT_SIZE];
    const int index = choice_find(choices, text);
    if (index < 0)
        return base_fail(w->err, GBT_ERR_ARGUMENT, "%s: \"%.40s\" (wanted %s)", name, text,
                         choice_list(choices, list));
    *out = index;
    return GBT_OK;
}

gbt_status request_check_size(int width, int height, gbt_error *err)
{
    if (width > REQUEST_SIDE_MAX || height > REQUEST_SIDE_MAX || (double)width * height > REQUEST_PIXELS_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "picture of %d x %d pixels (wanted sides of at most %d, and at most %d pixels)",
                         width, height, REQUEST_SIDE_MAX, REQUEST_PIXELS_MAX);
    return GBT_OK;
}

static gbt_status take_camera(const words *w, request *out)
{
    static const double none[3] = {0, 0, 0};
    const char *text = word_of(w, "camera");
    if ((text != NULL) == (word_of(w, "view") != NULL))
        return base_fail(w->err, GBT_ERR_ARGUMENT, "wanted either camera=JSON or view=NUMBER");
    GBT_TRY(take_whole(w, "view", 0, INT32_MAX, &out->view));
    GBT_TRY(take_whole(w, "width", 1, REQUEST_SIDE_MAX, &out->width));
    GBT_TRY(take_whole(w, "height", 1, REQUEST_SIDE_MAX, &out->height));
    if ((out->width > 0) != (out->height > 0))
        return base_fail(w->err, GBT_ERR_ARGUMENT, "wanted width and height, or neither");
    if (text == NULL)
        return request_check_size(out->width, out->height, w->err);
    if (out->width > 0)
        return base_fail(w->err, GBT_ERR_ARGUMENT, "width: the camera gives its own");
    ray_shot shot;
    GBT_TRY(camera_text_read(text, "camera", none, &shot, w->err));
    if (shot.aperture_radius > 0 || !camera_is_still(&shot.camera))
        return base_fail(w->err, GBT_ERR_ARGUMENT,
                         "camera: an open aperture or a rolling shutter needs gbtrace render");
    out->camera = shot.camera;
    return request_check_size(shot.camera.width, shot.camera.height, w->err);
}

/* The background colour as six hexadecimal digits. */
static gbt_status take_background(const words *w, request *out)
{
    static const char digits[] = "0123456789abcdef";
    const char *text = word_of(w, "background");
    if (text == NULL)
        return GBT_OK;
    if (strlen(text) != 6 || strspn(text, digits) != 6)
        return base_fail(w->err, GBT_ERR_ARGUMENT,
                         "background: \"%.40s\" (wanted six digits, red, green and blue, as 3366ff)", text);
    for (int c = 0; c < 3; c++)
        out->background[c] = (float)(16 * (strchr(digits, text[2 * c]) - digits) +
                                     (strchr(digits, text[2 * c + 1]) - digits)) /
                             255;
    out->has_background = true;
    return GBT_OK;
}

static gbt_status take_picture(const words *w, request *out)
{
    int format = REQUEST_RAW, preset = GBT_PRESET_DEFAULT, renderer = GBT_RENDERER_TRACE;
    const char *output = word_of(w, "output");
    if (output != NULL && strcmp(output, "color") != 0)
        GBT_TRY(render_outputs_parse(output, &out->output, w->err));
    if ((out->output & (out->output - 1)) != 0)
        return base_fail(w->err, GBT_ERR_ARGUMENT, "output: \"%.40s\" (wanted a single output)", output);
    GBT_TRY(take_choice(w, "renderer", GBT_RENDERER_TRAINING_NAMES, &renderer));
    GBT_TRY(take_choice(w, "format", "raw|jpeg|png|float", &format));
    GBT_TRY(take_choice(w, "preset", GBT_PRESET_NAMES, &preset));
    GBT_TRY(take_background(w, out));
    GBT_TRY(take_whole(w, "quality", 1, 100, &out->quality));
    GBT_TRY(take_whole(w, "sample", 0, REQUEST_SAMPLE_MAX, &out->sample));
    out->format = (request_format)format;
    out->renderer = (gbt_renderer)renderer;
    out->preset = (gbt_preset)preset;
    if (out->output != 0 && (out->renderer != GBT_RENDERER_TRACE || out->format != REQUEST_FLOAT))
        return base_fail(w->err, GBT_ERR_ARGUMENT,
                         "output: \"%.40s\" needs the renderer trace and the format float", output);
    return GBT_OK;
}

static gbt_status take_pixel(const words *w, request *out)
{
    if (word_of(w, "x") == NULL || word_of(w, "y") == NULL)
        return base_fail(w->err, GBT_ERR_ARGUMENT, "wanted x and y");
    GBT_TRY(take_number(w, "x", 0, REQUEST_SIDE_MAX, &out->pixel[0]));
    return take_number(w, "y", 0, REQUEST_SIDE_MAX, &out->pixel[1]);
}

gbt_status request_parse(const char *path, request_word *word, void *query, request *out, gbt_error *err)
{
    static const char *const paths[] = {"/scene", "/render", "/pick", "/photo"};
    const words w = {word, query, err};
    int kind = 0;
    while (kind < 4 && strcmp(path, paths[kind]) != 0)
        kind++;
    if (kind == 4)
        return base_fail(err, GBT_ERR_IO, "%.100s: not here", path);
    *out = (request){.kind = (request_kind)kind,
                     .view = -1,
                     .renderer = GBT_RENDERER_TRACE,
                     .preset = GBT_PRESET_DEFAULT,
                     .quality = 85};
    if (kind == REQUEST_SCENE)
        return GBT_OK;
    GBT_TRY(take_camera(&w, out));
    GBT_TRY(take_picture(&w, out));
    if (kind == REQUEST_PHOTO && out->view < 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "wanted view=NUMBER");
    return kind == REQUEST_PICK ? take_pixel(&w, out) : GBT_OK;
}
