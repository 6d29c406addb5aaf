/* SPDX-License-Identifier: Apache-2.0 */
/* trace/trace.h -- ray tracing of Gaussians: build, forward, adjoint.

   What one ray sees is defined in docs/tracing.md; reference.h is that definition in double, and this is the
   same in float32, sixteen rays at a time, over lists of what a tile may see (list_build.h) or a tree
   (bvh/gaussian_tree.h). */
#ifndef GBT_TRACE_TRACE_H
#define GBT_TRACE_TRACE_H

#include <stdatomic.h>
#include <stdbool.h>

#include "base/gaussians.h"
#include "base/image.h"
#include "bvh/gaussian_scene.h"
#include "trace/gradients.h"
#include "trace/kernel.h"
#include "trace/list_build.h"
#include "trace/rays.h"
#include "trace/settings.h"

/** How rays find the Gaussians that they hit. All give the same picture to float rounding, except that
    TRACE_TREE may put the more opaque of two copies of one Gaussian first, whatever its index. The adjoint is
    the same for all. */
typedef enum trace_kernel {
    TRACE_LIST,   /* the default: 16 x 16 pixels over a list of what they may see, where all rays start at one
                     point and not too many Gaussians are near it; else as TRACE_TREE */
    TRACE_TREE,   /* 16 x 16 pixels share one traversal of the tree */
    TRACE_SINGLE, /* ray by ray: for incoherent rays */
    TRACE_EMBREE  /* packets of 16 in Embree's own traversal: the baseline of every benchmark */
} trace_kernel;

/** One view's Gaussians, ready to be traced; and the memory of passes over them, reused from view to view.
    Start from {0}. */
typedef struct trace_scene {
    trace_kernel kernel;     /* set before trace_build(); default TRACE_LIST */
    size_t tape_bytes_max;   /* tiles whose hits would go beyond this are traced again by trace_backward(), to
                                the same bits; 0: no limit */
    const atomic_bool *stop; /* optional (NULL): once true a pass ends with GBT_ERR_INTERRUPTED; borrowed */
    const gaussians *source; /* borrowed from trace_build() */
    gaussian_tree tree;      /* for TRACE_LIST made when it is first needed */
    bool tree_ready;
    gaussian_scene embree; /* in place of the tree, for TRACE_EMBREE */
    trace_settings settings;
    float *records;
    size_t record_capacity;
    float reach;              /* largest |coordinate| of the ray origins announced to trace_build() */
    struct trace_tile *tiles; /* internal: tape and gradient records of each tile or part */
    size_t tile_count, tile_capacity;
    int tape_width, tape_height;  /* rays of the forward pass that the tape holds; 0: none */
    gradient_order order;         /* internal */
    list_builder lists;           /* of the last forward pass, for TRACE_LIST */
    bool listed;                  /* whether it went over them */
    struct scratch_pool *scratch; /* internal */
} trace_scene;

/** What trace_forward() writes; arrays of one value per ray unless said otherwise. All but `rgb` are optional
    (NULL). */
typedef struct trace_outputs {
    image *rgb;           /* 3 channels, size of the rays, allocated by the caller; with the background */
    float *transmittance; /* what is left for the background, in [0, 1] */
    float *depth;         /* expected t_c: sum of T alpha t_c / sum of T alpha; 0 where nothing is hit */
    float *median_depth;  /* t_c of the hit that takes T below 1/2; 0 where none does */
    float *normal; /* [3] sum of T alpha n; n: the shortest axis, unit, world, turned towards the ray's origin
                    */
    float *hit_count;     /* hits that were blended */
    uint32_t *strongest;  /* Gaussian of the largest T alpha; UINT32_MAX where there is none */
    unsigned char *ended; /* of parts of rays: 1 where transmittance_min ended the ray */
} trace_outputs;

/**
 * Prepare `g` for tracing.
 *
 * @param g        [in] borrowed until the last pass over this build; padded (gaussians_pad)
 * @param reach    [in] largest |coordinate| of any ray origin that will be traced
 * @return GBT_OK, GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL. Gaussians with non-finite fields are not seen.
 *         Cost: 1 ms per 100,000 on two cores, and 10 to 20 for the tree, which
 *         TRACE_LIST makes with the first rays that need it.
 */
gbt_status trace_build(trace_scene *scene, const gaussians *g, const trace_settings *settings, float reach,
                       gbt_error *err);

/**
 * Trace rays.
 *
 * Parts of rays (rays->near) are traced by TRACE_LIST, over lists alone, without an adjoint. A hit has the
 * same t_c and alpha, to the bit, in every part and whatever else is in the scene; so parts that touch count
 * each hit once.
 *
 * @param keep_tape [in]  true when trace_backward() will follow: keeps about one byte per blended hit
 *                        (trace_scene.tape_bytes_max)
 * @param out       [out] colour costs what tracing costs; each other output a few per cent more
 * @param counters  [in,out] optional, added to
 * @return GBT_OK, GBT_ERR_ARGUMENT (size of out->rgb; parts that cannot be traced so), GBT_ERR_NO_MEMORY,
 *         GBT_ERR_INTERRUPTED (scene->stop), GBT_ERR_INTERNAL (the tree)
 * Threads: uses all; same bits for every thread count.
 */
gbt_status trace_forward(trace_scene *scene, const ray_image *rays, bool keep_tape, const trace_outputs *out,
                         kernel_counters *counters, gbt_error *err);

/**
 * Adjoint of the last trace_forward(keep_tape) on `scene`, with the same rays. Can be called once: it
 * releases the tape.
 *
 * @param d_rgb       [in]  dL/d(rgb), size of `rays`
 * @param d_gaussians [out] resized like the source and overwritten: dL/dfield (scales linear, quaternion
 *                          tangent)
 * @param weight      [out] optional (NULL), [count]: sum over rays of T alpha, how much each Gaussian was
 *                          seen
 * @return as trace_forward(); GBT_ERR_ARGUMENT also without such a forward pass before
 * Threads: uses all; same bits for every thread count (sums run in the order of packets and blocks).
 */
gbt_status trace_backward(trace_scene *scene, const ray_image *rays, const image *d_rgb,
                          gaussians *d_gaussians, float *weight, gbt_error *err);

void trace_scene_free(trace_scene *scene);

#endif
