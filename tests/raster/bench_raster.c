/* SPDX-License-Identifier: Apache-2.0 */
/* tests/raster/bench_raster.c -- the rasterizer's two forms beside the tracer on one model and camera; run by
   hand, judged by nobody. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/compare.h"
#include "benchmark/bench_scene.h"
#include "raster/raster.h"
#include "trace/trace.h"

enum { REPEATS_MAX = 99 };
typedef enum renderer { RENDER_TRACE, RENDER_EWA, RENDER_PER_RAY, RENDERER_COUNT } renderer;
static const char *const names[RENDERER_COUNT] = {"tracer", "EWA", "per ray"};

typedef struct bench {
    bench_scene scene;
    trace_scene traced;
    raster_scene raster;
    image rgb[RENDERER_COUNT], d_rgb;
    gaussians d;
    raster_counters counters[RENDERER_COUNT];
} bench;

static void need(gbt_status status, const gbt_error *err)
{
    if (status == GBT_OK)
        return;
    fprintf(stderr, "error: %s\n", err->text);
    exit(EXIT_FAILURE);
}

static void run(bench *b, renderer which, bool back, bool tape)
{
    gbt_error err = {0};
    const bench_scene *s = &b->scene;
    if (which == RENDER_TRACE) {
        if (back)
            need(trace_backward(&b->traced, &s->rays, &b->d_rgb, &b->d, NULL, NULL, &err), &err);
        else {
            need(trace_build(&b->traced, s->gaussians, &s->settings, ray_image_reach(&s->rays), &err), &err);
            need(trace_forward(&b->traced, &s->rays, tape, &(trace_outputs){.rgb = &b->rgb[which]}, NULL,
                               &err),
                 &err);
        }
        return;
    }
    raster_settings settings = raster_settings_default();
    if (which == RENDER_PER_RAY) {
        settings.form = RASTER_PER_RAY;
        settings.near = s->settings.t_near;
    }
    if (back)
        need(raster_backward(&b->raster, &b->d_rgb, &b->d, NULL, NULL, &err), &err);
    else {
        memset(&b->counters[which], 0, sizeof b->counters[which]);
        need(raster_forward(&b->raster, s->gaussians, &s->camera.shot.camera, &settings, tape, &b->rgb[which],
                            NULL, &b->counters[which], &err),
             &err);
    }
}

static float middle(float *times, int count)
{
    qsort(times, (size_t)count, sizeof *times, compare_floats);
    return times[count / 2];
}

static void measure(bench *b, renderer which, int repeats)
{
    float wall[2][REPEATS_MAX], core[2][REPEATS_MAX];
    for (int i = -1; i < repeats; i++)
        for (int back = 0; back < 2; back++) {
            const double wall_start = clock_wall(), core_start = clock_process();
            run(b, which, back, true);
            if (i >= 0) {
                wall[back][i] = (float)(clock_wall() - wall_start);
                core[back][i] = (float)(clock_process() - core_start);
            }
        }
    const double pixels = (double)b->rgb[which].width * b->rgb[which].height;
    printf("%-8s", names[which]);
    for (int back = 0; back < 2; back++)
        printf("  %s %8.2f ms %7.3f core-us/pixel", back ? "adjoint" : "forward",
               1e3 * (double)middle(wall[back], repeats), 1e6 * (double)middle(core[back], repeats) / pixels);
    const raster_counters *c = &b->counters[which];
    printf("  drawn %llu, pairs %llu, tests %.1f, blended %.1f per pixel\n", (unsigned long long)c->drawn,
           (unsigned long long)c->pairs, (double)c->tests / pixels, (double)c->blended / pixels);
}

int main(int argc, char **argv)
{
    bench b = {0};
    gbt_error err = {0};
    if (argc < 3) {
        fputs("usage: bench_raster MODEL.ply|RUN CAMERA.json [REPEATS [RENDERER]]\n", stderr);
        return 2;
    }
    const int repeats = argc > 3 ? atoi(argv[3]) : 7;
    need(bench_scene_open(argv[1], argv[2], &b.scene, &err), &err);
    need(bench_scene_decode(&b.scene, &err), &err);
    const gbt_camera *camera = &b.scene.camera.shot.camera;
    need(image_alloc(&b.d_rgb, camera->width, camera->height, 3, &err), &err);
    for (int i = 0; i < 3 * camera->width * camera->height; i++)
        b.d_rgb.pixels[i] = 1.0f + 0.001f * (float)(i % 7);
    for (renderer r = 0; r < RENDERER_COUNT; r++)
        need(image_alloc(&b.rgb[r], camera->width, camera->height, 3, &err), &err);
    for (renderer r = 0; r < RENDERER_COUNT; r++)
        if (argc <= 4 || strcmp(argv[4], names[r]) == 0)
            measure(&b, r, repeats < 1 || repeats > REPEATS_MAX ? 7 : repeats);
    trace_scene_free(&b.traced);
    raster_scene_free(&b.raster);
    for (renderer r = 0; r < RENDERER_COUNT; r++)
        image_free(&b.rgb[r]);
    image_free(&b.d_rgb);
    gaussians_free(&b.d);
    bench_scene_close(&b.scene);
    return EXIT_SUCCESS;
}
