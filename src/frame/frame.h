/* SPDX-License-Identifier: Apache-2.0 */
/* frame/frame.h -- one view of a model, start to end: what is visible, its Gaussians, tree, trace; and back.
   Training and evaluation share it. */
#ifndef GBT_FRAME_FRAME_H
#define GBT_FRAME_FRAME_H

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

/** The rasterizer's settings for what the tracer's say: alphas, T, near, background. The rest is its
    default. */
raster_settings frame_splat_settings(const trace_settings *settings, raster_form form);

/** Which anchors a view decodes. */
typedef enum frame_sight {
    FRAME_SIGHT_WHOLE,    /* those whose Gaussians a ray may meet */
    FRAME_SIGHT_BY_ANCHOR /* as the reference does, and in pinhole views alone: those whose own ellipsoid
                             touches the picture (frame/screen.h), however far their Gaussians reach */
} frame_sight;

/** How Gaussians become a picture. Set in the frame before rendering; {0}: traced, thin rays. */
typedef struct frame_drawing {
    gbt_renderer renderer; /* one of those that train */
    float footprint; /* variance of a pixel, px^2 (trace/footprint.h); 0: rays are thin, splats dilated as in
                        the paper's base */
    int pixel_step;  /* the camera's pixels are every n-th of a picture, and as wide as that one's; 0 and 1:
                        all */
    frame_sight sight;
    bool one_start; /* rays of a camera that moves while it is read out start at one point, and Gaussians move
                       in their place (frame/one_start.h): lists take the place of the tree. An approximation,
                       for training; it needs a footprint */
    visible_chance chance;     /* anchors are left out of the view at random, for training */
    bool makes_faint;          /* Gaussians of opacity below alpha_min are made, though not drawn */
    const float *anchor_pixel; /* optional (NULL), [anchors]: the smallest pixel an anchor was made for;
                                  borrowed */
} frame_drawing;

/** Everything one view needs, reused from view to view. Start from {0}; free with frame_free(). */
typedef struct frame {
    ray_image rays;
    uint32_t *visible; /* [visible_count] anchors, or plain Gaussians, ascending */
    size_t visible_count, visible_capacity;
    frame_drawing draw;
    gaussians gaussians, d_gaussians; /* as decoded, or the visible plain ones */
    gaussians wide;                   /* with the view's footprint; frame_drawn() says which were traced */
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
    float *through; /* [rays] transmittance of the last render for an adjoint, where the sky varies */
    size_t through_capacity;
    unsigned char *valid; /* of the last frame_valid(), where rays are missing */
    size_t valid_capacity;
    unsigned char *photo_valid; /* of the last frame_read_photo(): the photo's own marks, or NULL */
    image rgb;                  /* the render */
    kernel_counters counters;
    frame_times times;
    double half_fov_tan[2]; /* of the camera */
    screen_view screen;     /* of the last view, if by_screen: FRAME_SIGHT_BY_ANCHOR holds for it */
    bool by_screen;
    gbt_camera camera;
    float eye[3]; /* from where the networks saw the anchors */
} frame;

/**
 * Render `camera` (any model) into f->rgb.
 *
 * An anchor or plain Gaussian is visible when the ball around it that holds all its proxies meets a region
 * that holds all rays, so nothing that could be seen is left out: planes along the sides of the picture for
 * cameras that look forward, else a cone around their mean direction, thickened by the distance between their
 * origins. Networks and spherical harmonics see it from the camera centre.
 *
 * @param keep_tape [in] true when frame_backward_gaussians(), frame_backward_plain() or frame_blend_weights()
 *                       follows
 * @return GBT_OK, GBT_ERR_ARGUMENT (ray_shot_check(); with splats also what raster_takes() refuses),
 *         GBT_ERR_NO_MEMORY, GBT_ERR_INTERRUPTED (the stop of f->scene or f->splats), GBT_ERR_INTERNAL
 * Threads: one frame per thread; parallel inside; same bits for every thread count.
 */
gbt_status frame_render(frame *f, frame_subject subject, const gbt_camera *camera,
                        const trace_settings *settings, bool keep_tape, gbt_error *err);

/** frame_render() up to the picture: f->scene is built, for other passes over it (GBT_RENDERER_TRACE). f->rgb
   has its size and no meaning. */
gbt_status frame_prepare(frame *f, frame_subject subject, const gbt_camera *camera,
                         const trace_settings *settings, gbt_error *err);

/** What traces the rays of a shot in place of trace_forward(), and sends rays of its own where the picture
    does not look. */
typedef struct frame_tracer {
    /* rgb has the size of rays */
    gbt_status (*trace)(void *context, trace_scene *scene, const ray_image *rays, image *rgb, gbt_error *err);
    void *context;
    float reach; /* largest |coordinate| of an origin of its own rays */
} frame_tracer;

/**
 * Render a shot (trace/rays.h) into f->rgb: the mean over its samples, added up in their order in double.
 *
 * Anchors are decoded (harmonics summed) once, for one point: the mean of the origins of the rays through the
 * middle of the aperture. That is the camera centre, the middle of the way of a rolling shutter, the middle
 * of an orthographic picture (a point far behind it, where parallel rays would meet, is farther than any the
 * networks were trained for: measured, it spoils the picture). f->rays are left those of the last sample.
 * There is no adjoint.
 *
 * @param tracer [in] optional (NULL); with one everything is made, seen from the camera or not
 * @return as frame_render(); GBT_ERR_ARGUMENT with splats also for an aperture, given rays and a tracer
 * Threads: as frame_render(). Cost: decoding and building once, rays and tracing for every sample.
 */
gbt_status frame_render_with(frame *f, frame_subject subject, const ray_shot *shot,
                             const trace_settings *settings, const frame_tracer *tracer, gbt_error *err);

/** Adjoint of the last frame_render(keep_tape), its first part: d_image -> f->d_gaussians and
 * f->blend_weight. */
gbt_status frame_backward_gaussians(frame *f, const image *d_image, gbt_error *err);

/**
 * Gradient by the six numbers of a motion of the camera (trace/pose_gradient.h), after
 * frame_backward_gaussians() and before anything else is added to f->d_gaussians. Exact for rays, and for
 * splats up to where their projection is cut at the border of the picture; but that a sky turns is left out.
 */
gbt_status frame_backward_pose(frame *f, frame_subject subject, double d_pose[6], gbt_error *err);

/** Gradient by the background's colour and the sky's harmonics (base/sky.h), after the last
    frame_render(keep_tape) with a sky that varies; where a colour is cut as if it were not.
    Pixels through which less than a hundredth of it shines are left out. */
gbt_status frame_backward_sky(const frame *f, const image *d_image, double d_sky[SH_COUNT][3],
                              gbt_error *err);

/** The second part, of anchors: f->d_gaussians, and what the caller has added to it -> d_anchors (rows of
    f->visible, added; or these rows alone: decode_backward()) and d_params (added). */
gbt_status frame_backward_anchors(frame *f, const anchors *a, const decoder *d, anchors *d_anchors,
                                  float *d_params, gbt_error *err);

/** Both parts of a cloud. `d_cloud`: as many Gaussians as it has; see plain_backward(). */
gbt_status frame_backward_plain(frame *f, const gaussian_cloud *cloud, const image *d_image,
                                gaussian_cloud *d_cloud, gbt_error *err);

/**
 * Which pixels of the last render can be compared with a photo: those that have a ray, where the photo's own
 * marks allow it too.
 *
 * @param photo [in]  [height][width], 0: does not count; NULL: all count
 * @param out   [out] `photo` where every pixel has a ray, else borrowed until the next call
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 */
gbt_status frame_valid(frame *f, const unsigned char *photo, const unsigned char **out, gbt_error *err);

struct scene_view;

/** scene_read_photo_valid() at the size of the last render, and frame_valid() of its marks. `photo`: for
    image_free(), after a failure too; `valid`: as there, borrowed until the next call. */
gbt_status frame_read_photo(frame *f, const struct scene_view *view, image *photo,
                            const unsigned char **valid, gbt_error *err);

/** f->blend_weight of the last frame_render(keep_tape), and no gradient. */
gbt_status frame_blend_weights(frame *f, gbt_error *err);

/** The part of the subject, an anchor or a plain Gaussian, that Gaussian `i` of the last render is of. */
static inline uint32_t frame_part(const frame *f, frame_subject subject, size_t i)
{
    return f->visible[subject.cloud != NULL ? i : f->tape.slot[i] / (uint32_t)subject.anchors->offset_count];
}

/** The Gaussians that were traced. */
static inline const gaussians *frame_drawn(const frame *f) { return f->widened ? &f->wide : &f->gaussians; }

/** What widening did to Gaussian `i` of the last render, in double: for checks. `field`: in the order of
    GAUSSIANS_FIELDS. */
void frame_widen_exact(const frame *f, size_t i, double field[GAUSSIANS_FIELD_COUNT]);

void frame_free(frame *f);

#endif
