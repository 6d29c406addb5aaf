/* SPDX-License-Identifier: Apache-2.0 */
/* data/unposed.h -- recognises captures without camera poses (folders of photos, films) by file names. */
#ifndef GBT_DATA_UNPOSED_H
#define GBT_DATA_UNPOSED_H

#include <stdbool.h>

#include "gbtrace/status.h"

/** Whether the name has the ending of a photo format that can be read: .jpg, .jpeg, .png. */
bool unposed_is_photo(const char *name);

/** Whether the name has the ending of a photo format that cannot be read: .heic, .webp, .tif, raw formats and
    others. */
bool unposed_is_other_photo(const char *name);

/** Whether a folder, or its subfolders to a depth of `depth`, contains a file that unposed_is_photo()
    accepts. */
bool unposed_has_photos(const char *folder, int depth);

/** When `path` is a capture instead of a data set: GBT_ERR_FORMAT, with the command that finds its poses.
    Otherwise GBT_OK. */
gbt_status unposed_check(const char *path, gbt_error *err);

#endif
