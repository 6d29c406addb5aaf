/* SPDX-License-Identifier: Apache-2.0 */
/* train/held_out.c -- scores of held-out photos between steps. */
#include "train/held_out.h"

#include <math.h>

#include "base/fail.h"
#include "base/stop_signal.h"
#include "train/align.h"

gbt_status held_out_psnr(trainer *t, double *psnr, gbt_error *err)
{
    gbt_status status = t->poses.count > 0 ? align_held_out(t, err) : GBT_OK;
    double sum = 0;
    size_t count = 0;
    image photo = {0};
    for (size_t i = 0; i < t->scene.view_count && status == GBT_OK; i++) {
        if (!t->scene.views[i].is_test)
            continue;
        if (stop_signal_seen()) {
            status = base_fail(err, GBT_ERR_INTERRUPTED, "stopped while held-out photos were scored");
            break;
        }
        const unsigned char *valid = NULL;
        const gbt_camera camera = photos_camera(&t->photos, i, 0);
        status = step_view_draw(t, &t->views[0], i, &camera, false, err);
        if (status == GBT_OK)
            status = frame_read_photo(&t->views[0].frame, &t->scene.views[i], &photo, &valid, err);
        image_scores scores = {0};
        if (status == GBT_OK)
            status = image_score_photo(&t->views[0].frame.rgb, &photo, valid, t->exposures.count > 0, NULL,
                                       &scores, err);
        if (status == GBT_OK && isfinite(scores.psnr)) { /* otherwise every pixel is masked */
            sum += scores.psnr;
            count++;
        }
        image_free(&photo);
    }
    for (size_t i = 0; t->poses.count > 0 && i < t->scene.view_count; i++) /* aligned poses must not get into
                                                                              files */
        if (t->scene.views[i].is_test)
            t->scene.views[i].camera = t->poses.given[i];
    *psnr = count > 0 ? sum / (double)count : (double)NAN;
    return status;
}
