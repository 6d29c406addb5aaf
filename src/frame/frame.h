/* SPDX-License-Identifier: Apache-2.0 */
/* frame/frame.h -- render one view of a model, and its adjoint; shared by training and evaluation.

   Forward: find the visible anchors or Gaussians, decode them for the camera, widen them by the pixel
   footprint, build the tree, trace (or rasterize). The adjoint goes back in two parts, from the image to the
   Gaussians, where callers may add gradients of their own, and from the Gaussians to the anchors and networks
   or to a cloud. */
#ifndef GBT_FRAME_FRAME_H
#define GBT_FRAME_FRAME_H

#include "anchor/decode.h"
#include "base/stage.h"
#include "frame/screen.h"
#include "frame/subject.h"
#include "frame/visible.h"
#include "gbtrace/choices.h"
#include "raster/raster.h"
#include "trace/footprint.h"
#include "trace/trace.h"

/** Seconds by stage of the last passes. */
typedef struct frame_times {
    stage_time rays, visible, decode, build, trace, adjoint, decode_adjoint;
} frame_times;

void frame_times_add(frame_times *sum, const frame_times *more);

/** Settings of the rasterizer that correspond to the tracer's: alphas, T, near, background. The rest are its
    defaults. */
raster_settings frame_splat_settings(const trace_settings *settings, raster_form form);

/** Which anchors a view decodes. */
typedef enum frame_sight {
    FRAME_SIGHT_WHOLE,    /* those whose Gaussians any ray of the view may hit */
    FRAME_SIGHT_BY_ANCHOR /* as in the reference: in pinhole views, those whose own ellipsoid touches the
                             image (frame/screen.h), however far their Gaussians reach */
} frame_sight;

/** How Gaussians are rendered. Set it in the frame before rendering; {0}: traced with thin rays. */
typedef struct frame_drawing {
    gbt_renderer renderer; /* one that can train */
    float footprint; /* variance of the pixel footprint, px^2 (trace/footprint.h); 0: thin rays, and splats
                        are dilated as in the reference */
    int pixel_step;  /* the camera has every n-th pixel of an image in each direction, and its pixels are as
                        wide as that image's; 0 and 1: all pixels */
    frame_sight sight;
    bool one_start; /* with a rolling shutter, let all rays start at one point and move the Gaussians instead
                       (frame/one_start.h), so that lists per tile can replace the tree. An approximation for
                       training; it needs a footprint */
    visible_dropout dropout;   /* anchors to leave out of the view at random, for training */
    bool makes_faint;          /* also make Gaussians with opacity below alpha_min, which are not drawn */
    const float *anchor_pixel; /* optional (NULL), [anchors]: the smallest pixel with which training saw each
                                  anchor; borrowed */
} frame_drawing;

/** Memory of one view, reused from view to view. Start from {0}; free with frame_free(). */
typedef struct frame {
    ray_image rays;
    uint32_t *visible; /* [visible_count] anchors, or plain Gaussians, ascending */
    size_t visible_count, visible_capacity;
    frame_drawing draw;
    gaussians gaussians, d_gaussians; /* the decoded ones, or the visible plain ones */
    gaussians wide;                   /* widened by the view's footprint; frame_drawn() returns those that
                                         were traced */
    bool widened;
    footprint_view view;
    float *pixel_min; /* [gaussians] */
    bool pixel_limited;
    size_t pixel_min_capacity;
    decode_tape tape;
    trace_scene scene;
    raster_scene splats;
    float *blend_weight; /* [gaussians] after an adjoint: sum over rays of T alpha */
    size_t blend_weight_capacity;
    float *through; /* [rays] transmittance of the last render with keep_tape, if the sky varies */
    size_t through_capacity;
    unsigned char *valid; /* mask of the last frame_valid(), if rays are missing */
    size_t valid_capacity;
    unsigned char *photo_valid; /* the photo's own mask of the last frame_read_photo(), or NULL */
    image rgb;                  /* the render */
    kernel_counters counters;
    frame_times times;
    double half_fov_tan[2]; /* of the camera */
    screen_view screen;     /* of the last view, if by_screen: FRAME_SIGHT_BY_ANCHOR applies to it */
    bool by_screen;
    gbt_camera camera;
    float eye[3]; /* the point for which the networks (or harmonics) were evaluated */
} frame;

/**
 * Render `camera` (any model) into f->rgb.
 *
 * An anchor or plain Gaussian is visible when a ball that encloses all its proxies intersects a region that
 * encloses all rays, so nothing that could be seen is left out. The region is bounded by planes along the
 * sides of the image for cameras that look forward, otherwise it is a cone around the mean direction, widened
 * by the spread of the ray origins. Networks and spherical harmonics are evaluated for the mean of the rays'
 * origins.
 *
 * @param keep_tape [in] true if frame_backward_gaussians(), frame_backward_plain() or frame_blend_weights()
 *                       will follow
 * @return GBT_OK, GBT_ERR_ARGUMENT (ray_shot_check(); with splats also what raster_takes() refuses),
 *         GBT_ERR_NO_MEMORY, GBT_ERR_INTERRUPTED (the stop of f->scene or f->splats), GBT_ERR_INTERNAL
 * Threads: one frame per thread; parallel inside; same bits for every thread count.
 */
gbt_status frame_render(frame *f, frame_subject subject, const gbt_camera *camera,
                        const trace_settings *settings, bool keep_tape, gbt_error *err);

/** frame_render() without the image: f->scene is built, for other passes over it (GBT_RENDERER_TRACE). f->rgb
    has the right size and undefined contents. */
gbt_status frame_prepare(frame *f, frame_subject subject, const gbt_camera *camera,
                         const trace_settings *settings, gbt_error *err);

/** A replacement of trace_forward() that may also trace secondary rays, which leave the region that the image
    sees. */
typedef struct frame_tracer {
    /* rgb has the size of rays */
    gbt_status (*trace)(void *context, trace_scene *scene, const ray_image *rays, image *rgb, gbt_error *err);
    void *context;
    float reach; /* largest |coordinate| of any secondary ray's origin */
} frame_tracer;

/**
 * Render a shot (trace/rays.h) into f->rgb: the mean over its samples, added in order in double.
 *
 * Anchors are decoded (harmonics summed) once, for one point: the mean origin of the rays through the middle
 * of the aperture. That is the camera centre, the middle of a rolling shutter's path, or the middle of an
 * orthographic image. (For the latter, a point far behind the image, where parallel rays would meet, is
 * outside the distances that the networks were trained for; measured, it ruins the image.) f->rays are those
 * of the last sample afterwards. There is no adjoint.
 *
 * @param tracer [in] optional (NULL); with a tracer all anchors or Gaussians are made, visible or not
 * @return as frame_render(); with splats also GBT_ERR_ARGUMENT for an aperture, given rays or a tracer
 * Threads: as frame_render(). Cost: decoding and building once; rays and tracing for every sample.
 */
gbt_status frame_render_with(frame *f, frame_subject subject, const ray_shot *shot,
                             const trace_settings *settings, const frame_tracer *tracer, gbt_error *err);

/** Adjoint of the last frame_render(keep_tape), its first part: d_image -> f->d_gaussians and
 * f->blend_weight. */
gbt_status frame_backward_gaussians(frame *f, const image *d_image, gbt_error *err);

/**
 * Gradient by the six numbers of a motion of the camera (trace/pose_gradient.h), after
 * frame_backward_gaussians() and before anything else is added to f->d_gaussians. Exact for rays, and for
 * splats except where their projection is clamped near the border of the image. The rotation of a learned sky
 * is left out.
 */
gbt_status frame_backward_pose(frame *f, frame_subject subject, double d_pose[6], gbt_error *err);

/** Gradient by the background's colour and the sky's harmonics (base/sky.h), after the last
    frame_render(keep_tape) with this sky, which must vary. Clamping of colours is ignored (straight-through).
    Pixels with a transmittance below 0.01 are left out. */
gbt_status frame_backward_sky(const frame *f, const sky *behind, const image *d_image,
                              double d_sky[SH_COUNT][3], gbt_error *err);

/** Second part of the adjoint for anchors: f->d_gaussians, with anything that the caller added to it ->
    d_anchors (rows of f->visible are added to; or only these rows, see decode_backward()) and d_params (added
    to). */
gbt_status frame_backward_anchors(frame *f, const anchors *a, const decoder *d, anchors *d_anchors,
                                  float *d_params, gbt_error *err);

/** Both parts of the adjoint for a cloud. `d_cloud` has as many Gaussians as the cloud; see
    plain_backward(). */
gbt_status frame_backward_plain(frame *f, const gaussian_cloud *cloud, const image *d_image,
                                gaussian_cloud *d_cloud, gbt_error *err);

/**
 * Mask of the pixels of the last render that can be compared with a photo: those that have a ray and are
 * valid in the photo's own mask.
 *
 * @param photo [in]  [height][width], mask, 0: invalid; NULL: all are valid
 * @param out   [out] `photo` itself if every pixel has a ray, else borrowed until the next call
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 */
gbt_status frame_valid(frame *f, const unsigned char *photo, const unsigned char **out, gbt_error *err);

struct scene_view;

/** scene_read_photo_valid() at the size of the last render, followed by frame_valid() with its mask. Free
    `photo` with image_free(), also after a failure; `valid` is borrowed until the next call. */
gbt_status frame_read_photo(frame *f, const struct scene_view *view, image *photo,
                            const unsigned char **valid, gbt_error *err);

/** Compute f->blend_weight of the last frame_render(keep_tape), without gradients. */
gbt_status frame_blend_weights(frame *f, gbt_error *err);

/** Index of the anchor or plain Gaussian of the subject that Gaussian `i` of the last render belongs to. */
static inline uint32_t frame_part(const frame *f, frame_subject subject, size_t i)
{
    return f->visible[subject.cloud != NULL ? i : f->tape.slot[i] / (uint32_t)subject.anchors->offset_count];
}

/** The Gaussians that were traced. */
static inline const gaussians *frame_drawn(const frame *f) { return f->widened ? &f->wide : &f->gaussians; }

/** Gaussian `i` of the last render after widening, recomputed in double, for checks. `field`: in the order of
    GAUSSIANS_FIELDS. */
void frame_widen_exact(const frame *f, size_t i, double field[GAUSSIANS_FIELD_COUNT]);

void frame_free(frame *f);

#endif
