/* SPDX-License-Identifier: Apache-2.0 */
/* render/video.h -- pictures to a film, by the program ffmpeg. */
#ifndef GBT_RENDER_VIDEO_H
#define GBT_RENDER_VIDEO_H

#include <stdbool.h>

#include "base/image.h"

/** Whether a file of this name is a film: .mp4 (H.264), .webm (VP9) or .gif. */
bool video_named(const char *path);

/** GBT_ERR_ARGUMENT where it ends as a picture or another kind of film, as .mov: nobody means a folder by it.
 */
gbt_status video_check_name(const char *path, gbt_error *err);

typedef struct video video;

/**
 * Start ffmpeg, which takes raw pictures from a socket and writes beside `path` under another name.
 *
 * @param width, height [in] > 0; both even, but for .gif
 * @param fps           [in] > 0; at most 50 for .gif, whose delays are whole 1/100 s
 * @param out           [out] end with video_close(); NULL on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (an odd size, too many frames a second), GBT_ERR_IO (no ffmpeg, no
 *         file can be made there), GBT_ERR_NO_MEMORY
 */
gbt_status video_open(const char *path, int width, int height, double fps, video **out, gbt_error *err);

/** One more picture, of that size and 3 channels, rounded to 8 bit. GBT_ERR_IO: ffmpeg's own last line says
    why. */
gbt_status video_add(video *v, const image *picture, gbt_error *err);

/**
 * Wait for ffmpeg; with `keep` the film gets its name when all went well, otherwise nothing is left of it
 * (large_file_close()). `v` is gone then. NULL is fine.
 */
gbt_status video_close(video *v, bool keep, gbt_error *err);

#endif
