/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/check_grad_setup.c -- choose the view on which gradients are checked, and allocate memory. */
#include "benchmark/check_grad.h"

#include "base/fail.h"
#include "base/memory.h"
#include "base/vec.h"

enum { CHECK_WIDTH = 48, CHECK_WIDTH_LARGE = 24, LARGE_COUNT = 50000 };

gbt_status grad_render_at(grad_checker *c, size_t view, int width, gbt_error *err)
{
    const gbt_camera full = photos_camera(&c->run->photos, view, 0);
    c->width = full.width < width ? full.width : width;
    c->height = (int)fmax(1, floor((double)full.height * c->width / full.width + 0.5));
    c->ray_count = (size_t)c->width * (size_t)c->height;
    const gbt_camera camera = gbt_camera_resized(&full, c->width, c->height);
    for (int k = 0; k < 3; k++)
        c->camera[k] = rounded_to_float(camera.center[k]);
    return frame_render(c->frame, frame_neural(&c->run->model.anchors, &c->run->model.decoder), &camera,
                        &c->run->settings, true, err);
}

static gbt_status allocate(grad_checker *c, gbt_error *err)
{
    const size_t slot_count = c->frame->visible_count * (size_t)c->run->model.anchors.offset_count;
    GBT_TRY(image_alloc(&c->d_image, c->width, c->height, 3, err));
    GBT_TRY(image_alloc(&c->d_masked, c->width, c->height, 3, err));
    GBT_TRY(reference_scene_make(frame_drawn(c->frame), &c->scene, err));
    GBT_TRY(decode_ref_load(&c->parameters, &c->run->model.anchors, &c->run->model.decoder, err));
    GBT_TRY(decode_ref_zero(&c->d_parameters, &c->parameters, err));
    c->d_anchors.offset_count = c->run->model.anchors.offset_count;
    GBT_TRY(anchors_resize(&c->d_anchors, c->run->model.anchors.count, err)); /* new rows are zero */
    c->weight = mem_calloc(c->scene.count, sizeof *c->weight, "check weights", err);
    c->d_params = mem_calloc(c->run->model.decoder.param_count, sizeof *c->d_params, "check gradient", err);
    c->slots = mem_calloc(slot_count, DECODE_REF_FIELDS * sizeof *c->slots, "check slots", err);
    c->d_slots = mem_calloc(slot_count, DECODE_REF_FIELDS * sizeof *c->d_slots, "check slots", err);
    c->rgb = mem_calloc(c->ray_count, 3 * sizeof *c->rgb, "check image", err);
    bool fine =
        c->weight != NULL && c->d_params != NULL && c->slots != NULL && c->d_slots != NULL && c->rgb != NULL;
    for (int i = 0; i < 3; i++) {
        c->terms[i] = mem_calloc(c->ray_count, 3 * sizeof *c->terms[i], "check loss", err);
        fine = fine && c->terms[i] != NULL;
    }
    return fine ? GBT_OK : GBT_ERR_NO_MEMORY;
}

/* Render a view at a small size, because the reference tests every Gaussian on every ray. */
static gbt_status take_view(grad_checker *c, size_t view, gbt_error *err)
{
    c->view = view;
    GBT_TRY(grad_render_at(c, view, CHECK_WIDTH, err));
    if (c->frame->gaussians.count > LARGE_COUNT)
        GBT_TRY(grad_render_at(c, view, CHECK_WIDTH_LARGE, err));
    image_free(&c->photo);
    mem_free(c->valid);
    GBT_TRY(
        scene_read_photo_valid(&c->run->scene.views[view], c->width, c->height, &c->photo, &c->valid, err));
    for (size_t i = 0; i < c->ray_count; i++)
        c->valid_count += c->valid == NULL || c->valid[i];
    return GBT_OK;
}

/* The first view that is not masked completely, held-out views first. */
gbt_status grad_set_up(grad_checker *c, gbt_error *err)
{
    const scene *s = &c->run->scene;
    for (int pass = 0; pass < 2; pass++)
        for (size_t i = 0; i < s->view_count && c->valid_count == 0; i++)
            if (s->views[i].is_test == (pass == 0))
                GBT_TRY(take_view(c, i, err));
    if (c->valid_count == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: every photo is masked whole (wanted one that is not)",
                         s->folder);
    GBT_TRY(allocate(c, err));
    image_loss_result loss;
    GBT_TRY(loss_of_image(&c->frame->rgb, &c->photo, c->valid, &c->scratch, &c->d_image, &loss, err));
    fprintf(c->out, "%s, %d x %d pixels: %zu Gaussians of %zu visible anchors, loss %.6g\n",
            s->views[c->view].name, c->width, c->height, c->scene.count, c->frame->visible_count,
            loss.loss + loss_of_gaussians(&c->frame->gaussians, grad_volume_weight(c)));
    fprintf(c->out, "%-12s%-12s%12s%12s\n", "stage", "class", "error", "limit");
    return GBT_OK;
}

void grad_free(grad_checker *c)
{
    image_free(&c->photo);
    image_free(&c->d_image);
    image_free(&c->d_masked);
    loss_scratch_free(&c->scratch);
    gaussians_free(&c->d_gaussians);
    mem_free(c->valid);
    mem_free(c->weight);
    anchors_free(&c->d_anchors);
    mem_free(c->d_params);
    reference_scene_free(&c->scene);
    decode_ref_free(&c->parameters);
    decode_ref_free(&c->d_parameters);
    mem_free(c->slots);
    mem_free(c->d_slots);
    mem_free(c->rgb);
    for (int i = 0; i < 3; i++)
        mem_free(c->terms[i]);
}
