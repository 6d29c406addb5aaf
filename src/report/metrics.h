/* SPDX-License-Identifier: Apache-2.0 */
/* report/metrics.h -- read single values of metrics.json, whose content is not trusted. */
#ifndef GBT_REPORT_METRICS_H
#define GBT_REPORT_METRICS_H

#include <jansson.h>
#include <math.h>

/** NaN if it is missing or not a number. */
static inline double metrics_number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

/** NULL if it is missing, empty or not a string. */
static inline const char *metrics_text(const json_t *object, const char *key)
{
    const char *value = json_string_value(json_object_get(object, key));
    return value != NULL && value[0] != '\0' ? value : NULL;
}

#endif
