/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/check_grad.c -- gbtrace check-grad: check gradients on the user's own scene. Renderers and
   decoder are compared with double-precision versions, the whole chain with finite differences.
   docs/gradients.md.

   tracer      float adjoint of the image gradient      | reference_scene_backward() on the same Gaussians
   rasterizer  the same                                 | raster_reference_backward()
   per-ray     the same                                 | reference_scene_backward()
   decode      float adjoint of the Gaussians' gradient | decode_ref_backward() on the same anchors
   chain       float gradient of the training loss g    | d . g against central differences of the loss,
                                                        | all of it in double; by the tracer

   For normally distributed directions d, E[(d . (g - g'))^2] = |g - g'|^2. So a few directions estimate the
   relative L2 error of a class of parameters, however many parameters it has. */
#include "benchmark/check_grad.h"

#include "base/fail.h"
#include "base/memory.h"
#include "lab/lab.h"

gbt_status lab_check_grad(const char *run, FILE *out, gbt_error *err)
{
    loaded_run *loaded = mem_calloc(1, sizeof *loaded, "run", err);
    if (loaded == NULL)
        return GBT_ERR_NO_MEMORY;
    grad_checker c = {.run = loaded, .frame = &loaded->frame, .out = out};
    gbt_status status = loaded_run_open_model(run, loaded, err);
    if (status == GBT_OK)
        status = loaded_run_need_anchors(loaded, run, err);
    if (status == GBT_OK)
        status = loaded_run_open_own_views(run, loaded, err);
    const gbt_renderer trained = loaded->frame.draw.renderer;
    loaded->frame.draw.renderer = GBT_RENDERER_TRACE;
    if (status == GBT_OK)
        status = grad_set_up(&c, err);
    if (status == GBT_OK)
        status = grad_check_renderers(&c, trained, err);
    if (status == GBT_OK)
        status = grad_check_decode(&c, err);
    if (status == GBT_OK)
        status = grad_check_chain(&c, err);
    if (status == GBT_OK && c.broken > 0)
        status =
            base_fail(err, GBT_ERR_INTERNAL, "%s: %zu gradient errors are above their limits", run, c.broken);
    grad_free(&c);
    loaded_run_close(loaded);
    mem_free(loaded);
    return status;
}
