/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/info.h -- what is in a data set or a model, for a person or as JSON. */
#ifndef GBTRACE_INFO_H
#define GBTRACE_INFO_H

#include <stdbool.h>
#include <stdio.h>

#include "gbtrace/status.h"

GBT_API_BEGIN

/**
 * Print what a path holds.
 *
 * A data set (folder or point cloud): cameras by lens model, photos and their sizes, sparse points, extent,
 * split. A run folder or model file: anchors, Gaussians per anchor, bytes, iterations, configuration. What
 * training would refuse is refused here, with the same words: photos that are missing are counted and named.
 * Unreadable photos are only counted.
 *
 * @param path [in]  data set folder, point cloud (.ply), run folder or model.gbt
 * @param json [in]  one JSON object with "schema": 1 in place of lines for a person
 * @param out  [in]  open stream, written only after everything was read; its errors are the caller's to check
 * @param err  [out] optional
 * @return GBT_OK, GBT_ERR_IO (cannot read), GBT_ERR_FORMAT (neither of these, or damaged), GBT_ERR_NO_MEMORY
 *
 * Threads: any. Cost: reads cameras, points and image headers, not pixels.
 */
gbt_status gbt_info(const char *path, bool json, FILE *out, gbt_error *err);

GBT_API_END
#endif
