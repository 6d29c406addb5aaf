/* eval/render.c -- the views of a split, or the camera of a file, to image files. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "eval/camera_file.h"
#include "eval/insert_file.h"
#include "eval/loaded_run.h"
#include "eval/render_outputs.h"
#include "gbtrace/evaluate.h"
#include "trace/reference.h"

gbt_render_def gbt_render_def_default(void)
{
    return (gbt_render_def){.split = GBT_SPLIT_TEST, .format = "png"};
}

/* Same Gaussians, same rays, in double: the picture that the tracer is measured against. */
static gbt_status render_reference(loaded_run *r, const ray_shot *shot, gbt_error *err)
{
    frame *f = &r->frame;
    const int samples = ray_shot_sample_count(shot);
    const size_t pixels = ray_image_count(&f->rays);
    double *rgb = mem_alloc(pixels, 3 * sizeof *rgb, "reference image", err);
    double *sum = mem_calloc(pixels, 3 * sizeof *sum, "reference image", err);
    gbt_status status = rgb == NULL || sum == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    for (int s = 0; s < samples && status == GBT_OK; s++) {
        status = ray_image_from_shot(shot, s, &f->rays, err);
        if (status == GBT_OK)
            status = reference_forward(frame_drawn(f), &r->settings, &f->rays, rgb, NULL, NULL, err);
        for (size_t i = 0; status == GBT_OK && i < 3 * pixels; i++)
            sum[i] += rgb[i];
    }
    for (size_t i = 0; status == GBT_OK && i < 3 * pixels; i++)
        f->rgb.pixels[i] = (float)(sum[i] / samples);
    mem_free(rgb);
    mem_free(sum);
    return status;
}

/* What to render with: the run, and what is put into it. */
typedef struct studio {
    loaded_run run;
    insert_scene insert;
    unsigned outputs; /* render_outputs_parse() */
    bool in_double;   /* by the reference */
} studio;

static gbt_status render_one(studio *st, const ray_shot *shot, const char *out, const char *name, const gbt_render_def *def, gbt_error *err)
{
    char file[1100], path[4096];
    loaded_run *r = &st->run;
    const frame_guest guest = {.trace = insert_trace, .context = &st->insert, .reach = st->insert.reach};
    GBT_TRY(frame_render_guest(&r->frame, loaded_run_subject(r), shot, &r->settings, def->insert != NULL ? &guest : NULL, err));
    if (st->in_double)
        GBT_TRY(render_reference(r, shot, err));
    snprintf(file, sizeof file, "%s.%s", name, def->format);
    GBT_TRY(file_join(path, sizeof path, out, file, err));
    GBT_TRY(image_write(path, &r->frame.rgb, err));
    return render_outputs_write(r, shot, st->outputs, out, name, err);
}

static bool is_wanted(const scene_view *view, gbt_split split)
{
    return split == GBT_SPLIT_ALL || view->is_test == (split == GBT_SPLIT_TEST);
}

static gbt_status render_views(studio *st, const char *out, const gbt_render_def *def, gbt_error *err)
{
    loaded_run *r = &st->run;
    size_t rendered = 0, wanted = 0;
    for (size_t i = 0; i < r->scene.view_count; i++)
        wanted += is_wanted(&r->scene.views[i], def->split);
    for (size_t i = 0; i < r->scene.view_count; i++) {
        const scene_view *view = &r->scene.views[i];
        if (!is_wanted(view, def->split))
            continue;
        char name[1024];
        loaded_run_view_name(view, name, sizeof name);
        const gbt_camera camera = photos_camera(&r->photos, i, 0);
        const ray_shot shot = ray_shot_of(&camera);
        GBT_TRY(render_one(st, &shot, out, name, def, err));
        log_count("render", ++rendered, wanted, (double)NAN);
    }
    if (rendered == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no views in this split (of %zu)", r->scene.folder, r->scene.view_count);
    log_info("%zu views rendered into %s", rendered, out);
    return GBT_OK;
}

/* "folder/name.json" becomes "name". */
static void camera_name(const char *path, char *out, size_t size)
{
    const char *slash = strrchr(path, '/');
    snprintf(out, size, "%s", slash != NULL ? slash + 1 : path);
    char *dot = strrchr(out, '.');
    if (dot != NULL && dot != out)
        *dot = '\0';
}

static gbt_status render_camera(studio *st, const char *out, const gbt_render_def *def, gbt_error *err)
{
    camera_file file = {0};
    char name[1024];
    camera_name(def->camera, name, sizeof name);
    gbt_status status = camera_file_read(def->camera, st->run.model.origin, &file, err);
    if (status == GBT_OK)
        status = render_one(st, &file.shot, out, name, def, err);
    if (status == GBT_OK)
        log_info("%s rendered into %s", name, out);
    camera_file_free(&file);
    return status;
}

static const char insert_is_traced[] = "--insert: meshes are traced (wanted --renderer trace)";

/* What draws the model that is open. */
static gbt_status choose_renderer(studio *st, const gbt_render_def *def, gbt_error *err)
{
    frame_renderer *renderer = &st->run.frame.draw.renderer;
    st->in_double = def->renderer != NULL && strcmp(def->renderer, "reference") == 0;
    if (st->in_double)
        *renderer = FRAME_TRACE;
    else if (def->renderer != NULL && !frame_renderer_named(def->renderer, renderer))
        return base_fail(err, GBT_ERR_ARGUMENT, "--renderer: \"%.40s\" (wanted trace, raster, per-ray or reference)", def->renderer);
    if (def->insert != NULL && *renderer != FRAME_TRACE)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s", insert_is_traced);
    if (st->outputs != 0 && *renderer != FRAME_TRACE)
        return base_fail(err, GBT_ERR_ARGUMENT, "--outputs: these are traced (wanted --renderer trace)");
    return GBT_OK;
}

gbt_status gbt_render(const char *run, const char *out, const gbt_render_def *def, gbt_error *err)
{
    if (strcmp(def->format, "png") != 0 && strcmp(def->format, "exr") != 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "--format: \"%.40s\" (wanted png or exr)", def->format);
    if (!(def->downscale == 0 || (def->downscale >= 1 && def->downscale <= 64)))
        return base_fail(err, GBT_ERR_ARGUMENT, "--downscale: %g (wanted 1 to 64)", def->downscale);
    if (def->camera != NULL && def->downscale != 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "--downscale: not with --camera (the camera file says the size)");
    if (def->insert != NULL && def->renderer != NULL && strcmp(def->renderer, "trace") != 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s", insert_is_traced);
    GBT_TRY(file_make_folder(out, err));
    studio *st = mem_calloc(1, sizeof *st, "run", err);
    if (st == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = render_outputs_parse(def->outputs, &st->outputs, err);
    if (status == GBT_OK)
        status = def->camera != NULL ? loaded_run_open_model(run, &st->run, err) : loaded_run_open(run, def->data, def->downscale, &st->run, err);
    if (status == GBT_OK)
        status = loaded_run_preset(def->preset, &st->run.settings, err);
    if (status == GBT_OK)
        status = choose_renderer(st, def, err);
    if (status == GBT_OK && def->insert != NULL)
        status = insert_file_read(def->insert, st->run.model.origin, &st->insert, err);
    if (status == GBT_OK)
        status = def->camera != NULL ? render_camera(st, out, def, err) : render_views(st, out, def, err);
    insert_scene_free(&st->insert);
    loaded_run_close(&st->run);
    mem_free(st);
    return status;
}
