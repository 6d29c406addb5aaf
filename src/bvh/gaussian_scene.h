/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/gaussian_scene.h -- the same proxies as bvh/gaussian_tree.h under Embree's own traversal: the baseline
   that ours is measured against.

   One primitive of user geometry per Gaussian. Nothing is ever reported to Embree as a hit, so that one
   traversal visits every box that a packet of sixteen rays crosses, in no particular order. */
#ifndef GBT_BVH_GAUSSIAN_SCENE_H
#define GBT_BVH_GAUSSIAN_SCENE_H

#include <stddef.h>
#include <stdint.h>

#include "base/gaussians.h"

enum { SCENE_LANES = 16 };

typedef struct gaussian_scene {
    size_t box_count; /* Gaussians in the scene; those with opacity <= alpha_min or non-finite fields are left
                         out */
    size_t rejected_count; /* of these, the non-finite or out-of-range ones */
    float coordinate_max;  /* largest |coordinate| of any box */
    void *internal;        /* Embree's scene and the boxes */
} gaussian_scene;

/**
 * Build (or rebuild) the scene. `g` is not needed afterwards.
 *
 * @param alpha_min  [in] smallest response that counts, (0, 1)
 * @param reach      [in] largest |coordinate| of any ray origin that will be traced: boxes are padded for it
 * @param scene      [in,out] start from {0}; memory is reused from build to build; free with
 *         gaussian_scene_free()
 * @return GBT_OK, GBT_ERR_NO_MEMORY or GBT_ERR_INTERNAL (Embree's own words); on failure nothing is visible
 *
 * Threads: one build at a time per scene; uses all threads inside. Cost: O(n log n); about 150 bytes per
 * Gaussian, most of it counted by bvh_memory_bytes().
 */
gbt_status gaussian_scene_build(const gaussians *g, float alpha_min, float reach, gaussian_scene *scene,
                                gbt_error *err);
void gaussian_scene_free(gaussian_scene *scene);

/** The box of Gaussian `id` is crossed by the rays of `lanes` (bit i: ray i), at least one. */
typedef void gaussian_visit_fn(uint32_t id, unsigned lanes, void *user);

/**
 * Call `visit` for every Gaussian whose box is crossed at t_near <= t <= t_far by some of the rays origin + t
 * dir; once for each such ray.
 *
 * A Gaussian may be visited several times with different lanes, since Embree splits packets whose rays part.
 * The test in float32 is conservative: no crossing is missed. Which rays are visited in one
 * call, and the order of calls, depend on the instruction set.
 *
 * @param dir    [in] any length but 0; need not be unit
 * @param t_near [in] >= 0
 * @param t_far  [in] may be infinite
 * @param active [in] bit i: ray i is traced. Rays that Embree cannot take (bvh_ray_ok) cross nothing
 *
 * Threads: any number at a time on a built scene. Cost: one rtcIntersect16.
 */
void gaussian_scene_visit(const gaussian_scene *scene, const float origin[3][SCENE_LANES],
                          const float dir[3][SCENE_LANES], float t_near, float t_far, unsigned active,
                          gaussian_visit_fn *visit, void *user);

#endif
