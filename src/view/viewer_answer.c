/* SPDX-License-Identifier: Apache-2.0 */
/* view/viewer_answer.c -- dispatch requests to the parts of the viewer. */
#include "view/viewer.h"

void viewer_answer(viewer_state *s, const request *what, answer *out)
{
    gbt_error err = {0};
    gbt_status status;
    if (s->run == NULL) {
        answer_text(out, 503, "text/plain; charset=utf-8", s->note);
        return;
    }
    s->run->frame.scene.stop = s->run->frame.splats.stop = s->stop;
    if (what->kind == REQUEST_SCENE)
        status = viewer_scene(s, out, &err);
    else if (what->kind == REQUEST_PICK)
        status = viewer_pick(s, what, out, &err);
    else if (what->kind == REQUEST_PHOTO)
        status = viewer_photo(s, what, out, &err);
    else
        status = viewer_render(s, what, out, &err);
    if (status != GBT_OK)
        answer_failure(out, status, &err);
}
