/* SPDX-License-Identifier: Apache-2.0 */
/* view/scene.c -- describe the scene as JSON: counts, extent, views and their cameras. */
#include <jansson.h>
#include <math.h>
#include <stdlib.h>

#include "base/choice.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/vec.h"
#include "data/json_out.h"
#include "view/viewer.h"

enum { SORTED_MAX = 100000 }; /* positions used to find the extent; of more, an even sample */

/* origin, target and up, as in a camera file. */
static json_t *describe_pose(const gbt_camera *camera, const double origin[3])
{
    const double *down = camera->rotation + 3, *forward = camera->rotation + 6;
    double at[3], to[3];
    for (int k = 0; k < 3; k++) {
        at[k] = camera->center[k] + origin[k];
        to[k] = at[k] + forward[k];
    }
    return json_pack("{s:[fff],s:[fff],s:[fff]}", "origin", at[0], at[1], at[2], "target", to[0], to[1],
                     to[2], "up", -down[0], -down[1], -down[2]);
}

static json_t *describe_view(const loaded_run *r, size_t i)
{
    const scene_view *view = &r->scene.views[i];
    const gbt_camera camera = photos_camera(&r->photos, i, 0);
    double half_fov_tan[2];
    gbt_camera_half_fov_tan(&camera, half_fov_tan);
    return json_pack("{s:o,s:b,s:i,s:i,s:s,s:f,s:o}", "name", json_text(view->name), "test", view->is_test,
                     "width", camera.width, "height", camera.height, "lens",
                     gbt_camera_model_name(camera.model), "fov_x_deg", 2 * (180 / PI) * atan(half_fov_tan[0]),
                     "camera", describe_pose(&camera, r->model.origin));
}

typedef struct extent {
    double center[3],
        size;            /* of the box with the middle half of all positions, by axis; size: longest side */
    double up[3], floor; /* up: mean up axis of the photos' cameras; floor: height above which 95 % lie */
} extent;

static void find_up(const loaded_run *r, double up[3])
{
    double sum[3] = {0, 0, 0};
    for (size_t i = 0; i < r->scene.view_count; i++)
        for (int k = 0; k < 3; k++)
            sum[k] -= r->scene.views[i].camera.rotation[3 + k];
    const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (int k = 0; k < 3; k++)
        up[k] = length > 1e-3 ? sum[k] / length : k == 1 ? -1 : 0;
}

/* Coordinates along an axis of `count` positions with a stride of `step`, ascending. */
static void sort_along(const float *position, size_t count, size_t step, const double axis[3], float *sorted)
{
    for (size_t i = 0; i < count; i++) {
        const float *p = position + 3 * i * step;
        sorted[i] = (float)(axis[0] * (double)p[0] + axis[1] * (double)p[1] + axis[2] * (double)p[2]);
    }
    qsort(sorted, count, sizeof *sorted, compare_floats);
}

static gbt_status find_extent(const loaded_run *r, extent *out, gbt_error *err)
{
    static const double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const bool plain = r->cloud.count > 0;
    const size_t all = plain ? r->cloud.count : r->model.anchors.count;
    const size_t step = all > SORTED_MAX ? (all + SORTED_MAX - 1) / SORTED_MAX : 1,
                 count = (all + step - 1) / step;
    const float *position = plain ? r->cloud.mean : r->model.anchors.position;
    float *sorted =
        mem_calloc(count + 1, sizeof *sorted, "positions", err); /* one more, as there may be none */
    if (sorted == NULL)
        return GBT_ERR_NO_MEMORY;
    const size_t last = count > 0 ? count - 1 : 0;
    out->size = 0;
    for (int k = 0; k < 3; k++) {
        sort_along(position, count, step, axes[k], sorted);
        const double low = (double)sorted[count / 4], high = (double)sorted[last - count / 4];
        out->center[k] = 0.5 * (low + high) + r->model.origin[k];
        out->size = fmax(out->size, high - low);
    }
    find_up(r, out->up);
    sort_along(position, count, step, out->up, sorted);
    out->floor = (double)sorted[count / 20];
    for (int k = 0; k < 3; k++)
        out->floor += out->up[k] * r->model.origin[k];
    mem_free(sorted);
    return GBT_OK;
}

gbt_status viewer_scene(const viewer_state *s, answer *out, gbt_error *err)
{
    const loaded_run *r = s->run;
    extent e;
    GBT_TRY(find_extent(r, &e, err));
    json_t *views = json_array();
    for (size_t i = 0; i < r->scene.view_count; i++)
        json_array_append_new(views, describe_view(r, i));
    json_t *root = json_pack(
        "{s:i,s:o,s:i,s:b,s:I,s:I,s:s,s:[fff],s:f,s:[fff],s:f,s:o}", "schema", 1, "input",
        json_text(s->input), "version", (int)s->version, "plain", r->cloud.count > 0, "gaussians",
        (json_int_t)r->cloud.count, "anchors", (json_int_t)r->model.anchors.count, "renderer",
        CHOICE_NAME(GBT_RENDERER_NAMES, s->trained), "center", e.center[0], e.center[1], e.center[2], "size",
        e.size, "up", e.up[0], e.up[1], e.up[2], "floor", e.floor, "views", views);
    char *text = root != NULL ? json_dumps(root, JSON_COMPACT) : NULL;
    json_decref(root);
    if (text == NULL)
        return base_fail(err, GBT_ERR_NO_MEMORY, "scene: no memory");
    answer_text(out, 200, "application/json", text);
    free(text);
    return GBT_OK;
}
