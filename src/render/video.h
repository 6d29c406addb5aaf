/* SPDX-License-Identifier: Apache-2.0 */
/* render/video.h -- write pictures into a film by running ffmpeg. */
#ifndef GBT_RENDER_VIDEO_H
#define GBT_RENDER_VIDEO_H

#include <stdbool.h>

#include "base/image.h"

/** Whether a file name means a film that we can write: .mp4 (H.264), .webm (VP9) or .gif. */
bool video_named(const char *path);

/** GBT_ERR_ARGUMENT for the ending of a picture or of another kind of film, such as .mov: nobody means a
    folder of that name. */
gbt_status video_check_name(const char *path, gbt_error *err);

typedef struct video video;

/**
 * Start ffmpeg. It reads raw pictures from a socket and writes a temporary file beside `path`.
 *
 * @param width, height [in] > 0; both even, except for .gif
 * @param fps           [in] > 0; at most 50 for .gif, whose delays are whole 1/100 s
 * @param out           [out] close with video_close(); NULL on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (an odd size, too many frames per second), GBT_ERR_IO (ffmpeg is missing,
 *         the file cannot be created), GBT_ERR_NO_MEMORY
 */
gbt_status video_open(const char *path, int width, int height, double fps, video **out, gbt_error *err);

/** Append one picture of that size, 3 channels, rounded to 8 bits. On GBT_ERR_IO the message is ffmpeg's own
    last line. */
gbt_status video_add(video *v, const image *picture, gbt_error *err);

/**
 * Wait for ffmpeg and free `v`. With `keep`, and if all went well, the film gets its final name; otherwise
 * nothing is left of it (large_file_close()). NULL is fine.
 */
gbt_status video_close(video *v, bool keep, gbt_error *err);

#endif
