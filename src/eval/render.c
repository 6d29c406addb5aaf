/* eval/render.c -- the views of a split to image files. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "eval/loaded_run.h"
#include "gbtrace/evaluate.h"
#include "trace/reference.h"

gbt_render_def gbt_render_def_default(void)
{
    return (gbt_render_def){.split = GBT_SPLIT_TEST, .renderer = "trace", .format = "png"};
}

/* Same Gaussians, same rays, in double: the picture that the tracer is measured against. */
static gbt_status render_reference(loaded_run *r, gbt_error *err)
{
    frame *f = &r->frame;
    const size_t pixels = (size_t)f->rgb.width * (size_t)f->rgb.height;
    double *rgb = mem_alloc(pixels, 3 * sizeof *rgb, "reference image", err);
    double *transmittance = mem_alloc(pixels, sizeof *transmittance, "reference image", err);
    gbt_status status = rgb == NULL || transmittance == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK)
        status = reference_forward(&f->gaussians, &r->settings, &f->rays, rgb, transmittance, NULL, err);
    for (size_t i = 0; status == GBT_OK && i < 3 * pixels; i++)
        f->rgb.pixels[i] = (float)rgb[i];
    mem_free(rgb);
    mem_free(transmittance);
    return status;
}

static gbt_status render_views(loaded_run *r, const char *out, const gbt_render_def *def, gbt_error *err)
{
    size_t rendered = 0;
    for (size_t i = 0; i < r->scene.view_count; i++) {
        const scene_view *view = &r->scene.views[i];
        if ((def->split == GBT_SPLIT_TEST && !view->is_test) || (def->split == GBT_SPLIT_TRAIN && view->is_test))
            continue;
        GBT_TRY(loaded_run_render(r, i, err));
        if (strcmp(def->renderer, "reference") == 0)
            GBT_TRY(render_reference(r, err));
        char name[1024], file[1100], path[4096];
        loaded_run_view_name(view, name, sizeof name);
        snprintf(file, sizeof file, "%s.%s", name, def->format);
        GBT_TRY(file_join(path, sizeof path, out, file, err));
        GBT_TRY(image_write(path, &r->frame.rgb, err));
        rendered++;
    }
    if (rendered == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no views in this split (of %zu)", r->scene.folder, r->scene.view_count);
    log_info("%zu views rendered into %s", rendered, out);
    return GBT_OK;
}

gbt_status gbt_render(const char *run, const char *out, const gbt_render_def *def, gbt_error *err)
{
    if (strcmp(def->renderer, "trace") != 0 && strcmp(def->renderer, "reference") != 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "--renderer: \"%.40s\" (wanted trace or reference)", def->renderer);
    if (strcmp(def->format, "png") != 0 && strcmp(def->format, "exr") != 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "--format: \"%.40s\" (wanted png or exr)", def->format);
    if (!(def->downscale == 0 || (def->downscale >= 1 && def->downscale <= 64)))
        return base_fail(err, GBT_ERR_ARGUMENT, "--downscale: %g (wanted 1 to 64)", def->downscale);
    GBT_TRY(file_make_folder(out, err));
    loaded_run *r = mem_alloc(1, sizeof *r, "run", err);
    if (r == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = loaded_run_open(run, def->data, def->downscale, r, err);
    if (status == GBT_OK)
        status = render_views(r, out, def, err);
    loaded_run_close(r);
    mem_free(r);
    return status;
}
