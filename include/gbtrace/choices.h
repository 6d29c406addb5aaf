/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/choices.h -- what settings choose from: closed sets, and the names that they have in files and on
   the command line. Names stand in the order of their enum. */
#ifndef GBTRACE_CHOICES_H
#define GBTRACE_CHOICES_H

/** Where anchors start. */
typedef enum gbt_init_kind {
    GBT_INIT_GB,       /* the paper's granular balls */
    GBT_INIT_ADAPTIVE, /* granular balls where the scene needs them */
    GBT_INIT_VOXEL,    /* the voxels of Scaffold-GS */
    GBT_INIT_RANDOM    /* sparse points at random, for comparison */
} gbt_init_kind;
#define GBT_INIT_NAMES "gb|adaptive|voxel|random"

/** What the first scales of anchors come from; only GBT_INIT_GB has a choice, the others use spacing. */
typedef enum gbt_scale_prior {
    GBT_SCALE_PRIOR_GB, /* the balls' radii and the spacing of their centres */
    GBT_SCALE_PRIOR_NN  /* the spacing alone */
} gbt_scale_prior;
#define GBT_SCALE_PRIOR_NAMES "gb|nn"

/** How the voxel size is estimated from sparse points. */
typedef enum gbt_voxel_rule {
    GBT_VOXEL_RULE_MEDIAN, /* median distance to the nearest neighbour: what the paper's text says */
    GBT_VOXEL_RULE_SQUARED /* median of the mean squared distance to three: what the reference code computes
                            */
} gbt_voxel_rule;
#define GBT_VOXEL_RULE_NAMES "median|squared"

/** Whether the networks are given the distance from the camera to the anchor. */
typedef enum gbt_distance_input {
    GBT_DISTANCE_INPUT_AUTO, /* where the distances of a scene vary widely */
    GBT_DISTANCE_INPUT_ON,
    GBT_DISTANCE_INPUT_OFF
} gbt_distance_input;
#define GBT_DISTANCE_INPUT_NAMES "auto|on|off"

/** What the transparent part of photos is. */
typedef enum gbt_alpha {
    GBT_ALPHA_AUTO, /* white for Blender's synthetic scenes, else and with compat black */
    GBT_ALPHA_BLACK,
    GBT_ALPHA_WHITE,
    GBT_ALPHA_MASK /* it counts neither in the loss nor in the scores */
} gbt_alpha;
#define GBT_ALPHA_NAMES "auto|black|white|mask"

/** What is behind everything. */
typedef enum gbt_background {
    GBT_BACKGROUND_CONSTANT, /* one colour: what photos lie on that are transparent in places, else the mean
                                of the sparse points */
    GBT_BACKGROUND_SKY       /* colours by direction, learned: harmonics to degree 3. Not behind photos that
                                are transparent in places */
} gbt_background;
#define GBT_BACKGROUND_NAMES "constant|sky"

/** How Gaussians become a picture. */
typedef enum gbt_renderer {
    GBT_RENDERER_TRACE,
    GBT_RENDERER_RASTER,    /* EWA splats in the order of their centres; pinhole cameras only */
    GBT_RENDERER_PER_RAY,   /* the same tiles, with the response and the order of each ray */
    GBT_RENDERER_REFERENCE, /* in double, every Gaussian against every ray: slow. Renders, does not train */
    GBT_RENDERER_AS_TRAINED /* the one that the model was trained with; of a model that is there */
} gbt_renderer;
#define GBT_RENDERER_NAMES "trace|raster|per-ray|reference"
#define GBT_RENDERER_TRAINING_NAMES "trace|raster|per-ray"

/** Cut-offs of rays and responses (docs/accuracy.md). */
typedef enum gbt_preset {
    GBT_PRESET_EXACT,   /* leaves out alpha < 1e-5: an error of at most that per hit left out, and 1e-4 */
    GBT_PRESET_DEFAULT, /* that of the scores, and of the last steps of training */
    GBT_PRESET_FAST,
    GBT_PRESET_AS_TRAINED /* nothing is changed */
} gbt_preset;
#define GBT_PRESET_NAMES "exact|default|fast"

/** Which views of a data set. */
typedef enum gbt_split { GBT_SPLIT_TEST, GBT_SPLIT_TRAIN, GBT_SPLIT_ALL } gbt_split;
#define GBT_SPLIT_NAMES "test|train|all"

/** The lens that COLMAP fits to photos. */
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
    GBT_POSE_MATCHER_SEQUENTIAL, /* those that follow each other by name, and some farther apart */
    GBT_POSE_MATCHER_SPATIAL     /* those that GPS puts near each other */
} gbt_pose_matcher;
#define GBT_POSE_MATCHER_NAMES "auto|exhaustive|sequential|spatial"

/** Files of pictures. */
typedef enum gbt_picture_format {
    GBT_PICTURE_PNG,
    GBT_PICTURE_EXR /* 32-bit float */
} gbt_picture_format;
#define GBT_PICTURE_FORMAT_NAMES "png|exr"

#endif
