/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms_pose.c -- reads the pose of one frame of a transforms.json, and its motion under a rolling
   shutter. */
#include <math.h>

#include "base/camera_pose.h"
#include "base/vec.h"
#include "data/transforms_camera.h"

/* Gram-Schmidt orthonormalization of the columns; only called when they are nearly orthonormal. */
static void orthonormalize(double m[9])
{
    double column[3][3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            column[i][k] = m[3 * k + i];
    dvec_normalize(column[0]);
    const double along = dvec_dot(column[0], column[1]);
    for (int k = 0; k < 3; k++)
        column[1][k] -= along * column[0][k];
    dvec_normalize(column[1]);
    dvec_cross(column[0], column[1], column[2]);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            m[3 * k + i] = column[i][k];
}

static gbt_status read_matrix(const transforms_frame *s, const char *key, double m[4][4], gbt_error *err)
{
    const json_t *rows = transforms_value(s->frame, key);
    if (rows == NULL)
        return transforms_fail(s, err, "is missing", key);
    const size_t row_count = json_is_array(rows) ? json_array_size(rows) : 0;
    if (row_count != 3 && row_count != 4)
        return transforms_fail(s, err, "wanted 3 or 4 rows of 4 numbers", key);
    for (size_t i = 0; i < 4; i++)
        for (size_t k = 0; k < 4; k++)
            m[i][k] = i == k;
    for (size_t i = 0; i < row_count; i++) {
        const json_t *row = json_array_get(rows, i);
        if (!json_is_array(row) || json_array_size(row) != 4)
            return transforms_fail(s, err, "wanted 3 or 4 rows of 4 numbers", key);
        for (size_t k = 0; k < 4; k++) {
            const json_t *value = json_array_get(row, k);
            if (!json_is_number(value))
                return transforms_fail(s, err, "holds something that is not a number", key);
            m[i][k] = json_number_value(value);
            if (!(fabs(m[i][k]) <= RAW_COORDINATE_LIMIT))
                return transforms_fail(s, err, "holds a number that is too large", key);
        }
    }
    for (size_t k = 0; k < 4; k++)
        if (fabs(m[3][k] - (k == 3)) > 1e-3)
            return transforms_fail(s, err, "last row is not 0 0 0 1 (is the matrix transposed?)", key);
    return GBT_OK;
}

bool transforms_is_similarity(const transforms_frame *s, const char *key)
{
    double m[4][4], rotation[9];
    gbt_error ignored = {0};
    if (read_matrix(s, key, m, &ignored) != GBT_OK)
        return false;
    const double scale = sqrt(dvec_dot(m[0], m[0]));
    for (int i = 0; i < 9; i++)
        rotation[i] = m[i / 3][i % 3] / scale;
    return scale > 0 && dmat_is_rotation(rotation, 1e-3);
}

static gbt_status read_pose(const transforms_frame *s, const char *key, gbt_camera *camera, gbt_error *err)
{
    double m[4][4], rotation[9], worst = 0;
    GBT_TRY(read_matrix(s, key, m, err));
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            rotation[3 * i + k] = m[i][k];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            const double dot = m[0][i] * m[0][k] + m[1][i] * m[1][k] + m[2][i] * m[2][k];
            worst = fmax(worst, fabs(dot - (i == k)));
        }
    if (!(worst <= 1e-3))
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: frame %zu: %s is not a rotation (wanted |R'R - I| <= 1e-3, got %g)",
                         s->file->name, s->frame_index, key, worst);
    const double x[3] = {m[0][0], m[1][0], m[2][0]}, y[3] = {m[0][1], m[1][1], m[2][1]},
                 z[3] = {m[0][2], m[1][2], m[2][2]};
    double cross[3];
    dvec_cross(x, y, cross);
    if (dvec_dot(cross, z) < 0)
        return transforms_fail(s, err, "is a reflection (wanted determinant +1, got -1)", key);
    orthonormalize(rotation);
    for (int i = 0; i < 3; i++) {
        camera->center[i] = m[i][3];
        /* The rows of world to camera are the columns of camera to world; y and z change sign because
           OpenGL's camera axes point up and back, COLMAP's down and forward. */
        camera->rotation[0 + i] = rotation[3 * i];
        camera->rotation[3 + i] = -rotation[3 * i + 1];
        camera->rotation[6 + i] = -rotation[3 * i + 2];
    }
    return GBT_OK;
}

/* instant-ngp's rolling shutter: the image point (u, v), both in [0, 1], is taken at time a + b u + c v + d
   w, where 0 is the first pose and 1 the last. w covers the exposure; we use its middle, w = 1/2. */
static gbt_status read_times(const transforms_frame *s, double times[3], gbt_error *err)
{
    static const char key[] = "rolling_shutter";
    const json_t *list = transforms_find(s, key);
    for (size_t i = 0; i < 3; i++)
        times[i] = 0;
    if (list == NULL)
        return GBT_OK;
    if (!json_is_array(list) || json_array_size(list) != 4)
        return transforms_fail(s, err, "wanted 4 numbers: time at the start, across, down, exposure", key);
    for (size_t i = 0; i < 4; i++) {
        const json_t *value = json_array_get(list, i);
        if (!json_is_number(value) || !(fabs(json_number_value(value)) <= 1))
            return transforms_fail(s, err, "holds something that is not a number in -1..1", key);
        if (i < 3)
            times[i] = json_number_value(value);
        else
            times[0] += 0.5 * json_number_value(value);
    }
    return times[1] == 0 || times[2] == 0
               ? GBT_OK
               : transforms_fail(s, err, "goes across and down (wanted one of the two 0)", key);
}

gbt_status transforms_pose(const transforms_frame *s, gbt_camera *camera, gbt_error *err)
{
    static const char first[] = "transform_matrix_start", last[] = "transform_matrix_end";
    const bool has_first = transforms_value(s->frame, first) != NULL,
               has_last = transforms_value(s->frame, last) != NULL;
    if (!has_first && !has_last)
        return read_pose(s, "transform_matrix", camera, err);
    gbt_camera start = {0}, end = {0};
    double times[3];
    GBT_TRY(read_pose(s, has_first ? first : "transform_matrix", &start, err));
    end = start;
    if (has_last)
        GBT_TRY(read_pose(s, last, &end, err));
    GBT_TRY(read_times(s, times, err));
    const gbt_camera_shutter shutter = times[1] != 0 ? GBT_CAMERA_SHUTTER_COLUMNS : GBT_CAMERA_SHUTTER_ROWS;
    camera_set_readout(&start, &end, shutter, times[0], times[0] + times[1] + times[2], camera);
    return GBT_OK;
}
