/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_scene.h -- the input of benchmarks and studies: Gaussians, plain or decoded from a run, and
   the rays of one camera. */
#ifndef GBT_BENCHMARK_BENCH_SCENE_H
#define GBT_BENCHMARK_BENCH_SCENE_H

#include "render/camera_file.h"
#include "run/loaded_run.h"

/** Start from {0}; free with bench_scene_close() after success or failure. Not copyable: it points into
    itself. */
typedef struct bench_scene {
    const gaussians *gaussians; /* owned by `run`; set by bench_scene_decode() */
    trace_settings settings; /* the model's own unless the caller changes them before bench_scene_decode() */
    ray_image rays;
    camera_file camera;
    loaded_run run;
    bool is_plain; /* bench_scene_needs_camera() */
} bench_scene;

/**
 * Open a model and its camera.
 *
 * @param path   [in] a file of plain Gaussians, which are traced without a footprint, or a run
 * @param camera [in] camera file, of whose aperture the first sample is used; NULL: the run's first held-out
 * view
 * @return GBT_OK, GBT_ERR_ARGUMENT (plain Gaussians without a camera), GBT_ERR_IO, GBT_ERR_FORMAT,
 *         GBT_ERR_NO_MEMORY
 */
gbt_status bench_scene_open(const char *path, const char *camera, bench_scene *out, gbt_error *err);

/** Make the rays and the Gaussians; of a run those that s->settings can make visible. */
gbt_status bench_scene_decode(bench_scene *s, gbt_error *err);

void bench_scene_close(bench_scene *s);

/** Whether a model is a file of plain Gaussians, which has no camera of its own. */
bool bench_scene_needs_camera(const char *path);

#endif
