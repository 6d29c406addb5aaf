/* SPDX-License-Identifier: Apache-2.0 */
/* view/request.h -- what the page asks for: a query's words to a checked struct. */
#ifndef GBT_VIEW_REQUEST_H
#define GBT_VIEW_REQUEST_H

#include "frame/frame.h"
#include "gbtrace/camera.h"

/** Sides and pixels of a picture at most: some seconds of work, some tens of megabytes. */
enum { REQUEST_SIDE_MAX = 8192, REQUEST_PIXELS_MAX = 1 << 23, REQUEST_SAMPLE_MAX = 4096 };

typedef enum request_kind {
    REQUEST_SCENE,  /* what there is to see, as JSON */
    REQUEST_RENDER, /* a picture */
    REQUEST_PICK,   /* the point behind a pixel */
    REQUEST_PHOTO   /* the photo of a view, at the size of training */
} request_kind;

typedef enum request_format {
    REQUEST_RAW, /* RGBA, 8 bit */
    REQUEST_JPEG,
    REQUEST_PNG,
    REQUEST_FLOAT /* the channels as they are, 32-bit floats of this machine; outputs beside colour have no
                     other */
} request_format;

typedef struct request {
    request_kind kind;
    int view;          /* the camera of this view; -1: `camera` */
    int width, height; /* of a view's picture; 0: as in training */
    gbt_camera camera; /* in the data set's own coordinates */
    int sample;        /* 0: rays through the middle of the pixels; n: through the n-th other point of them */
    unsigned output;   /* one bit of render_outputs_parse(); 0: colour */
    gbt_renderer renderer;
    gbt_preset preset;
    bool has_background;
    float background[3]; /* in place of the model's, [0, 1] */
    request_format format;
    int quality;     /* of JPEG */
    double pixel[2]; /* to pick */
} request;

/** The word behind a name in the query; NULL: not there. */
typedef const char *request_word(void *query, const char *name);

/** GBT_ERR_ARGUMENT for a picture of more pixels or longer sides than the two above. */
gbt_status request_check_size(int width, int height, gbt_error *err);

/**
 * @param path [in] "/scene", "/render", "/pick", "/photo"
 * @return GBT_OK, GBT_ERR_IO (no such path), GBT_ERR_ARGUMENT or GBT_ERR_FORMAT ("NAME: what was wrong")
 */
gbt_status request_parse(const char *path, request_word *word, void *query, request *out, gbt_error *err);

#endif
