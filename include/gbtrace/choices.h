/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/choices.h -- enumerations that settings choose from, with their names in files and on the command
   line. Names are in the order of their enum. */
#ifndef GBTRACE_CHOICES_H
#define GBTRACE_CHOICES_H

/** Where the first anchors are placed. */
typedef enum gbt_init_kind {
    GBT_INIT_GB,       /* the paper's granular balls */
    GBT_INIT_ADAPTIVE, /* adaptive granular balls: finer where the scene has more detail (docs/balls.md) */
    GBT_INIT_VOXEL,    /* occupied voxels, as in Scaffold-GS */
    GBT_INIT_RANDOM    /* sparse points chosen at random, for comparison */
} gbt_init_kind;
#define GBT_INIT_NAMES "gb|adaptive|voxel|random"

/** What the initial scales of anchors are computed from. Only GBT_INIT_GB has a choice; the others use
    GBT_SCALE_PRIOR_NN. */
typedef enum gbt_scale_prior {
    GBT_SCALE_PRIOR_GB, /* the radii of the balls and the spacing of their centres */
    GBT_SCALE_PRIOR_NN  /* the spacing of the anchors alone */
} gbt_scale_prior;
#define GBT_SCALE_PRIOR_NAMES "gb|nn"

/** How the voxel size is estimated from sparse points. */
typedef enum gbt_voxel_rule {
    GBT_VOXEL_RULE_MEDIAN, /* median distance to the nearest neighbour: what the paper's text says */
    GBT_VOXEL_RULE_SQUARED /* median of the mean squared distance to the three nearest neighbours: what the
                              reference code computes */
} gbt_voxel_rule;
#define GBT_VOXEL_RULE_NAMES "median|squared"

/** Whether the distance from the camera to the anchor is an input of the networks. */
typedef enum gbt_distance_input {
    GBT_DISTANCE_INPUT_AUTO, /* when the distances in a scene vary widely (docs/training.md) */
    GBT_DISTANCE_INPUT_ON,
    GBT_DISTANCE_INPUT_OFF
} gbt_distance_input;
#define GBT_DISTANCE_INPUT_NAMES "auto|on|off"

/** How the transparent parts of photos are treated. */
typedef enum gbt_alpha {
    GBT_ALPHA_AUTO, /* white for Blender's synthetic scenes; otherwise, and with compat, black */
    GBT_ALPHA_BLACK,
    GBT_ALPHA_WHITE,
    GBT_ALPHA_MASK /* excluded from the loss and from the scores */
} gbt_alpha;
#define GBT_ALPHA_NAMES "auto|black|white|mask"

/** What is behind the scene. */
typedef enum gbt_background {
    GBT_BACKGROUND_CONSTANT, /* one colour: the one that transparent photos are composited onto, otherwise the
                                mean of the sparse points */
    GBT_BACKGROUND_SKY       /* a learned colour per direction above the horizon: spherical harmonics to
                                degree 3. Not with photos that are transparent in places */
} gbt_background;
#define GBT_BACKGROUND_NAMES "constant|sky"

/** How Gaussians are rendered. */
typedef enum gbt_renderer {
    GBT_RENDERER_TRACE,
    GBT_RENDERER_RASTER,    /* EWA splats, sorted by the depth of their centres; pinhole cameras only */
    GBT_RENDERER_PER_RAY,   /* the same tiles, with responses and sorting evaluated per ray */
    GBT_RENDERER_REFERENCE, /* double precision, every Gaussian against every ray: slow. Renders only, does
                               not train */
    GBT_RENDERER_AS_TRAINED /* the renderer that the model was trained with; only for an existing model */
} gbt_renderer;
#define GBT_RENDERER_NAMES "trace|raster|per-ray|reference"
#define GBT_RENDERER_TRAINING_NAMES "trace|raster|per-ray"

/** Cut-offs of rays and responses (docs/accuracy.md). */
typedef enum gbt_preset {
    GBT_PRESET_EXACT,   /* skips alpha < 1e-5: an error of at most that per skipped hit, plus 1e-4 */
    GBT_PRESET_DEFAULT, /* the one used for scores and in the last steps of training */
    GBT_PRESET_FAST,
    GBT_PRESET_AS_TRAINED /* keeps the cut-offs stored with the model */
} gbt_preset;
#define GBT_PRESET_NAMES "exact|default|fast"

/** Which views of a data set: held-out ones, training ones, or both. */
typedef enum gbt_split { GBT_SPLIT_TEST, GBT_SPLIT_TRAIN, GBT_SPLIT_ALL } gbt_split;
#define GBT_SPLIT_NAMES "test|train|all"

/** The lens model that COLMAP fits to photos. */
typedef enum gbt_pose_camera {
    GBT_POSE_CAMERA_AUTO, /* SIMPLE_RADIAL; OPENCV where many photos share a camera */
    GBT_POSE_CAMERA_PINHOLE,
    GBT_POSE_CAMERA_SIMPLE_RADIAL,
    GBT_POSE_CAMERA_OPENCV,
    GBT_POSE_CAMERA_OPENCV_FISHEYE
} gbt_pose_camera;
#define GBT_POSE_CAMERA_NAMES "auto|PINHOLE|SIMPLE_RADIAL|OPENCV|OPENCV_FISHEYE"

/** Which pairs of photos are matched. */
typedef enum gbt_pose_matcher {
    GBT_POSE_MATCHER_AUTO,
    GBT_POSE_MATCHER_EXHAUSTIVE, /* all */
    GBT_POSE_MATCHER_SEQUENTIAL, /* neighbours in the order of file names, and some pairs farther apart */
    GBT_POSE_MATCHER_SPATIAL     /* photos that are near each other by their GPS positions */
} gbt_pose_matcher;
#define GBT_POSE_MATCHER_NAMES "auto|exhaustive|sequential|spatial"

/** Formats of image files. */
typedef enum gbt_picture_format {
    GBT_PICTURE_PNG,
    GBT_PICTURE_EXR /* 32-bit float */
} gbt_picture_format;
#define GBT_PICTURE_FORMAT_NAMES "png|exr"

#endif
