/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/info.h -- summary of a data set or a model, as text or as JSON. */
#ifndef GBTRACE_INFO_H
#define GBTRACE_INFO_H

#include <stdbool.h>
#include <stdio.h>

#include "gbtrace/status.h"

GBT_API_BEGIN

/**
 * Print a summary of what a path contains.
 *
 * A data set (folder or point cloud): cameras by lens model, photos and their sizes, sparse points, extent,
 * split. A run folder or model file: anchors, Gaussians per anchor, bytes, iterations, configuration. What
 * training would refuse is refused here with the same message: missing photos are counted and named.
 * Unreadable photos are only counted.
 *
 * @param path [in]  data set folder, point cloud (.ply), run folder or model.gbt
 * @param json [in]  print one JSON object with "schema": 1 instead of text
 * @param out  [in]  open stream, written only after everything was read; the caller checks it for errors
 * @param err  [out] optional
 * @return GBT_OK, GBT_ERR_IO (cannot read), GBT_ERR_FORMAT (none of these, or damaged), GBT_ERR_NO_MEMORY
 *
 * Threads: any. Cost: reads cameras, points and image headers, not pixels.
 */
gbt_status gbt_info(const char *path, bool json, FILE *out, gbt_error *err);

GBT_API_END
#endif
