/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms_camera.h -- reads the camera and the pose of one frame of a transforms.json. */
#ifndef GBT_DATA_TRANSFORMS_CAMERA_H
#define GBT_DATA_TRANSFORMS_CAMERA_H

#include <jansson.h>

#include "data/bytes.h"
#include "data/raw.h"

/** Where keys are looked up: first in the frame, then at the top level. */
typedef struct transforms_frame {
    const source_file *file;
    const json_t *frame, *top;
    size_t frame_index;
} transforms_frame;

/** The value of a key. NULL when it is missing or null, because some writers use null for "none". */
static inline const json_t *transforms_value(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_null(value) ? NULL : value;
}

/** The value of a key in the frame, or else at the top level. */
static inline const json_t *transforms_find(const transforms_frame *s, const char *key)
{
    const json_t *value = transforms_value(s->frame, key);
    return value != NULL ? value : transforms_value(s->top, key);
}

static inline gbt_status transforms_fail(const transforms_frame *s, gbt_error *err, const char *text,
                                         const char *key)
{
    return base_fail(err, GBT_ERR_FORMAT, "%s: frame %zu: %s: %s", s->file->name, s->frame_index, key, text);
}

/**
 * Read the size and lens. If the file has no size, it is read from `photo`. Contradictory angles are counted
 * in `out`.
 */
gbt_status transforms_camera(const transforms_frame *s, const char *photo, gbt_camera *camera, raw_scene *out,
                             gbt_error *err);

/** Read the rotation and centre; if the file gives the poses at the start and end of the readout, also the
    shutter and motion. */
gbt_status transforms_pose(const transforms_frame *s, gbt_camera *camera, gbt_error *err);

/** Whether s->frame holds, under `key`, a rotation with a scale (> 0) and a translation. */
bool transforms_is_similarity(const transforms_frame *s, const char *key);

#endif
