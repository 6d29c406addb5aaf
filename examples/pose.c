/* SPDX-License-Identifier: Apache-2.0 */
/* examples/pose.c -- find where a photo was taken: a camera is displaced from a view and led back by the
   gradient of its picture.

   Usage: pose MODEL */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <gbtrace/model.h>

enum { STEPS = 200 };

/* The angle between two cameras in degrees, from the trace of their relative rotation. */
static double angle_between(const gbt_camera *a, const gbt_camera *b)
{
    double trace = 0;
    for (int i = 0; i < 9; i++)
        trace += a->rotation[i] * b->rotation[i];
    return acos(fmin(1, fmax(-1, (trace - 1) / 2))) * 180 / 3.14159265358979;
}

static double distance_between(const gbt_camera *a, const gbt_camera *b)
{
    return sqrt(pow(a->center[0] - b->center[0], 2) + pow(a->center[1] - b->center[1], 2) +
                pow(a->center[2] - b->center[2], 2));
}

/* One step of Adam: moves the camera downhill by about `rate` in each of its six degrees of freedom. */
static void adam_step(const double gradient[6], int step, double rate, double first[6], double second[6],
                      gbt_camera *camera)
{
    double motion[6];
    for (int k = 0; k < 6; k++) {
        first[k] = 0.9 * first[k] + 0.1 * gradient[k];
        second[k] = 0.95 * second[k] + 0.05 * gradient[k] * gradient[k];
        const double mean = first[k] / (1 - pow(0.9, step)), size = sqrt(second[k] / (1 - pow(0.95, step)));
        motion[k] = size > 0 ? -rate * mean / size : 0;
    }
    *camera = gbt_camera_moved(camera, motion);
}

/* Move `camera` until its picture is `target`. `rgb` and `d_rgb` are scratch for one picture each. */
static gbt_status find_pose(gbt_model *model, const float *target, float *rgb, float *d_rgb,
                            gbt_camera *camera, gbt_error *err)
{
    const size_t values = 3 * (size_t)camera->width * (size_t)camera->height;
    const gbt_picture picture = {.rgb = rgb};
    double first[6] = {0}, second[6] = {0}, gradient[6];
    for (int step = 1; step <= STEPS; step++) {
        gbt_status status = gbt_model_render(model, camera, true, &picture, err);
        for (size_t i = 0; i < values; i++) /* gradient of the mean squared difference */
            d_rgb[i] = 2 * (rgb[i] - target[i]) / (float)values;
        if (status == GBT_OK)
            status = gbt_model_gradient(model, d_rgb, gradient, NULL, err);
        if (status != GBT_OK)
            return status;
        adam_step(gradient, step, 0.02 * pow(0.01, (double)step / STEPS), first, second, camera);
    }
    return GBT_OK;
}

static gbt_status run(gbt_model *model, gbt_error *err)
{
    gbt_model_view view;
    size_t count;
    gbt_status status = gbt_model_open_views(model, NULL, &count, err);
    if (status == GBT_OK)
        status = gbt_model_get_view(model, 0, &view, err);
    if (status != GBT_OK)
        return status;
    const double away[6] = {0.06, -0.05, 0.08, 0.015, 0.02, -0.03}; /* scene units, radians */
    gbt_camera camera = gbt_camera_moved(&view.camera, away);
    const size_t bytes = 3 * sizeof(float) * (size_t)camera.width * (size_t)camera.height;
    float *target = malloc(bytes), *rgb = malloc(bytes), *d_rgb = malloc(bytes);
    status = target != NULL && rgb != NULL && d_rgb != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    if (status == GBT_OK)
        status = gbt_model_render(model, &view.camera, false, &(gbt_picture){.rgb = target}, err);
    printf("before: %.4f units and %.3f degrees away\n", distance_between(&camera, &view.camera),
           angle_between(&camera, &view.camera));
    if (status == GBT_OK)
        status = find_pose(model, target, rgb, d_rgb, &camera, err);
    if (status == GBT_OK)
        printf("after:  %.4f units and %.3f degrees away\n", distance_between(&camera, &view.camera),
               angle_between(&camera, &view.camera));
    free(target);
    free(rgb);
    free(d_rgb);
    return status;
}

int main(int argc, char **argv)
{
    gbt_error err = {0};
    gbt_model *model = NULL;
    if (argc < 2) {
        fprintf(stderr, "usage: pose MODEL\n");
        return 2;
    }
    gbt_status status = gbt_model_open(argv[1], &model, &err);
    if (status == GBT_OK)
        status = run(model, &err);
    if (status != GBT_OK)
        fprintf(stderr, "error: %s\n", err.text[0] != '\0' ? err.text : "out of memory");
    gbt_model_close(model);
    return gbt_status_exit_code(status);
}
