/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms_camera.h -- the camera and the pose of one frame of a transforms.json. */
#ifndef GBT_DATA_TRANSFORMS_CAMERA_H
#define GBT_DATA_TRANSFORMS_CAMERA_H

#include <jansson.h>

#include "data/bytes.h"
#include "data/raw.h"

/** Where a key is looked up: the frame first, then the top level. */
typedef struct transforms_frame {
    const source_file *file;
    const json_t *frame, *top;
    size_t frame_index;
} transforms_frame;

/** The value of a key; NULL when the key is missing or its value is null, as writers say that there is none.
 */
static inline const json_t *transforms_value(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_null(value) ? NULL : value;
}

/** The same, of the frame, or else of the top level. */
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

/** Size and lens; `photo` is asked for a size that the file does not say. Counts angles that do not fit in
 * `out`. */
gbt_status transforms_camera(const transforms_frame *s, const char *photo, gbt_camera *camera, raw_scene *out,
                             gbt_error *err);

/** Rotation and centre; with the poses at which the picture was begun and ended, also shutter and motion. */
gbt_status transforms_pose(const transforms_frame *s, gbt_camera *camera, gbt_error *err);

#endif
