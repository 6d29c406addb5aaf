/* SPDX-License-Identifier: Apache-2.0 */
/* train/exposure.c -- the photos' colour matrices and their optimizer. */
#include "train/exposure.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "data/json_out.h"
#include "train/adam.h"

gbt_status exposures_make(exposures *e, size_t count, gbt_error *err)
{
    const size_t numbers = count * AFFINE_NUMBERS;
    e->matrix = mem_alloc(numbers, sizeof *e->matrix, "exposures", err);
    e->moment1 = mem_calloc(numbers, sizeof *e->moment1, "exposures", err);
    e->moment2 = mem_calloc(numbers, sizeof *e->moment2, "exposures", err);
    e->visits = mem_calloc(count, sizeof *e->visits, "exposures", err);
    if (e->matrix == NULL || e->moment1 == NULL || e->moment2 == NULL || e->visits == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++)
        affine_identity(e->matrix + i * AFFINE_NUMBERS);
    e->count = count;
    return GBT_OK;
}

void exposures_free(exposures *e)
{
    mem_free(e->matrix);
    mem_free(e->moment1);
    mem_free(e->moment2);
    mem_free(e->visits);
    memset(e, 0, sizeof *e);
}

static void center(exposures *e)
{
    float identity[AFFINE_NUMBERS];
    affine_identity(identity);
    for (size_t k = 0; k < AFFINE_NUMBERS; k++) {
        double sum = 0;
        for (size_t i = 0; i < e->count; i++)
            sum += (double)e->matrix[i * AFFINE_NUMBERS + k];
        const float excess = (float)(sum / (double)e->count - (double)identity[k]);
        for (size_t i = 0; i < e->count; i++)
            e->matrix[i * AFFINE_NUMBERS + k] -= excess;
    }
}

void exposures_step(exposures *e, size_t index, const double gradient[AFFINE_NUMBERS], double rate)
{
    const size_t first = index * AFFINE_NUMBERS;
    float g[AFFINE_NUMBERS];
    for (int k = 0; k < AFFINE_NUMBERS; k++)
        g[k] = (float)gradient[k];
    adam_step(e->matrix + first, g, e->moment1 + first, e->moment2 + first, AFFINE_NUMBERS,
              adam_rates_at(rate, ++e->visits[index]));
    center(e);
}

double exposures_rate(size_t count, double progress, double step)
{
    const double way = 4, least = 0.001, most = 0.05, last = 0.1;
    return fmin(fmax(way * (double)count * step, least), most) * exp(progress * log(last));
}

gbt_status exposures_write(const exposures *e, const char *const *names, const char *path, gbt_error *err)
{
    json_t *root = json_object(), *photos = json_array();
    json_object_set_new(root, "schema", json_integer(1));
    json_object_set_new(root, "meaning",
                        json_string("photo = matrix (3 x 4, rows) * (red, green, blue, 1) of the scene"));
    for (size_t i = 0; i < e->count; i++) {
        json_t *numbers = json_array(), *photo = json_object();
        for (size_t k = 0; k < AFFINE_NUMBERS; k++)
            json_array_append_new(numbers, json_real((double)e->matrix[i * AFFINE_NUMBERS + k]));
        json_object_set_new(photo, "name", json_text(names[i]));
        json_object_set_new(photo, "matrix", numbers);
        json_array_append_new(photos, photo);
    }
    json_object_set_new(root, "photos", photos);
    const gbt_status status = json_save_styled(root, JSON_INDENT(1) | JSON_REAL_PRECISION(9), path, err);
    json_decref(root);
    return status;
}
