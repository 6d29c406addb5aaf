/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_lens_prepare.c -- make a prepared lens from a camera's parameters, with the radius up to which
   it is valid. */
#include <math.h>
#include <string.h>

#include "base/poly.h"
#include "base/vec.h"

#define NUMBER double
#define TERMS(name) lens_##name
#include "base/camera_lens_terms.inc.h"

/* A perspective ray flatter than this (1e-6 rad from the image plane) is outside every real image. */
static const double perspective_radius_max = 1e6;

enum { SLOPE_COUNT = LENS_NUMERATOR + LENS_DENOMINATOR - 1 };

/* The distorted radius r f(r^2) has slope f + 2 x f' = (N D + 2 x (N' D - N D')) / D^2: find the first zero
   of the slope, and of D. */
static void find_monotone_range(camera_lens *lens, double radius_limit)
{
    double slope[SLOPE_COUNT] = {0};
    for (int i = 0; i < LENS_NUMERATOR; i++)
        for (int j = 0; j < LENS_DENOMINATOR; j++)
            slope[i + j] += lens->numerator[i] * lens->denominator[j] * (1 + 2 * (i - j));
    const double limit = radius_limit * radius_limit;
    const double turn = poly_first_root(slope, SLOPE_COUNT - 1, limit);
    const double pole = poly_first_root(lens->denominator, LENS_DENOMINATOR - 1, limit);
    double d_factor;
    if (pole < limit && pole <= turn) {
        lens->radius_max = sqrt(pole);
        lens->distorted_max = HUGE_VAL;
    } else {
        lens->radius_max = turn < limit ? sqrt(turn) : radius_limit;
        lens->distorted_max =
            lens->radius_max * lens_radial(lens, lens->radius_max * lens->radius_max, &d_factor);
    }
}

static bool any_nonzero(const double *values, int count)
{
    for (int i = 0; i < count; i++)
        if (values[i] != 0)
            return true;
    return false;
}

static int term_count(const double *terms, int count)
{
    while (count > 1 && terms[count - 1] == 0)
        count--;
    return count;
}

/* Copy the parameters of a camera into the slots that its model's row names; false if one is not finite. */
static bool take_params(const gbt_camera *camera, const camera_model *model, camera_lens *lens)
{
    double *const places[] = {[LENS_FX] = &lens->fx,
                              [LENS_FY] = &lens->fy,
                              [LENS_CX] = &lens->cx,
                              [LENS_CY] = &lens->cy,
                              [LENS_N1] = &lens->numerator[1],
                              [LENS_N2] = &lens->numerator[2],
                              [LENS_N3] = &lens->numerator[3],
                              [LENS_N4] = &lens->numerator[4],
                              [LENS_N5] = &lens->numerator[5],
                              [LENS_N6] = &lens->numerator[6],
                              [LENS_D1] = &lens->denominator[1],
                              [LENS_D2] = &lens->denominator[2],
                              [LENS_D3] = &lens->denominator[3],
                              [LENS_TX] = &lens->tangent_x,
                              [LENS_TY] = &lens->tangent_y,
                              [LENS_S0] = &lens->prism[0],
                              [LENS_S1] = &lens->prism[1],
                              [LENS_S2] = &lens->prism[2],
                              [LENS_S3] = &lens->prism[3],
                              [LENS_SHAPE0] = &lens->shape[0],
                              [LENS_SHAPE1] = &lens->shape[1]};
    const int count = gbt_camera_param_count(camera->model);
    for (int i = 0; i < count; i++) {
        const double value = camera->params[i];
        if (!isfinite(value))
            return false;
        if (model->slots[i] == LENS_F)
            lens->fx = lens->fy = value;
        else
            *places[model->slots[i]] = value;
    }
    if (model->kind == LENS_EQUIRECTANGULAR) {
        lens->cx = camera->params[camera_center_at(camera->model)];
        lens->cy = camera->params[camera_center_at(camera->model) + 1];
    }
    return isfinite(lens->cx) && isfinite(lens->cy);
}

/* Are the shape parameters of the closed-form lenses in their domain? Without distortion such a lens becomes
   a pinhole, with the same bits. */
static bool check_shape(camera_lens *lens)
{
    const double k = lens->shape[0];
    const lens_kind kind = lens->kind;
    if (k == 0 && (kind == LENS_FOV || kind == LENS_DIVISION || kind == LENS_EUCM))
        lens->kind = LENS_PERSPECTIVE;
    if (kind == LENS_FOV)
        return fabs(k) < PI;
    return kind != LENS_EUCM || (k >= 0 && k <= 1 && lens->shape[1] > 0);
}

bool camera_lens_prepare(const gbt_camera *camera, camera_lens *lens)
{
    const camera_model *model = camera_model_of(camera->model);
    if (model == NULL)
        return false;
    memset(lens, 0, sizeof *lens);
    lens->numerator[0] = lens->denominator[0] = 1;
    lens->kind = model->kind;
    lens->extra_last = model->extra_last;
    if (!take_params(camera, model, lens) || !(lens->fx > 0 && lens->fy > 0))
        return false;
    if (model->kind != LENS_PERSPECTIVE && model->kind != LENS_FISHEYE)
        return check_shape(lens);
    lens->numerator_count = term_count(lens->numerator, LENS_NUMERATOR);
    lens->denominator_count = term_count(lens->denominator, LENS_DENOMINATOR);
    lens->radial = lens->numerator_count > 1 || lens->denominator_count > 1;
    lens->extra = lens->tangent_x != 0 || lens->tangent_y != 0 || any_nonzero(lens->prism, 4);
    const double radius_limit = lens->kind == LENS_FISHEYE ? PI : perspective_radius_max;
    if (lens->radial)
        find_monotone_range(lens, radius_limit);
    else
        lens->radius_max = lens->distorted_max =
            lens->kind == LENS_FISHEYE || lens->extra ? radius_limit : HUGE_VAL;
    return true;
}
