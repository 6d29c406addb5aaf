/* SPDX-License-Identifier: Apache-2.0 */
/* data/unposed.h -- captures without camera poses, by their names: folders of photos, films. */
#ifndef GBT_DATA_UNPOSED_H
#define GBT_DATA_UNPOSED_H

#include <stdbool.h>

#include "gbtrace/status.h"

/** Whether a file name ends as those of photos do that can be read: .jpg, .jpeg, .png. */
bool unposed_is_photo(const char *name);

/** Whether a file name ends as those of photos do that cannot: .heic, .webp, .tif, raw ones and others. */
bool unposed_is_other_photo(const char *name);

/** Whether a folder has a photo of such a name, or a folder in it, `depth` levels down at most. */
bool unposed_has_photos(const char *folder, int depth);

/** When `path` is no data set, but a capture: GBT_ERR_FORMAT, with the command that finds its poses. Else
    GBT_OK. */
gbt_status unposed_check(const char *path, gbt_error *err);

#endif
