/* SPDX-License-Identifier: Apache-2.0 */
/* view/request.h -- requests of the page: a query, parsed and checked. */
#ifndef GBT_VIEW_REQUEST_H
#define GBT_VIEW_REQUEST_H

#include "gbtrace/camera.h"
#include "gbtrace/choices.h"
#include "gbtrace/status.h"

/** Limits for a picture, sides and pixels: a few seconds of work, tens of megabytes. SAMPLE_MAX: largest
    index of a sample. */
enum { REQUEST_SIDE_MAX = 8192, REQUEST_PIXELS_MAX = 1 << 23, REQUEST_SAMPLE_MAX = 4096 };

typedef enum request_kind {
    REQUEST_SCENE,  /* contents of the scene, as JSON */
    REQUEST_RENDER, /* a picture */
    REQUEST_PICK,   /* the point of the scene behind a pixel */
    REQUEST_PHOTO   /* the photo of a view, at the resolution of training */
} request_kind;

typedef enum request_format {
    REQUEST_RAW, /* RGBA, 8 bits */
    REQUEST_JPEG,
    REQUEST_PNG,
    REQUEST_FLOAT /* the channels unchanged, 32-bit floats in this machine's byte order; the only format of
                     outputs beside colour */
} request_format;

typedef struct request {
    request_kind kind;
    int view;          /* use the camera of this view; -1: use `camera` */
    int width, height; /* of a view's picture; 0: as in training */
    gbt_camera camera; /* in world coordinates */
    int sample;      /* 0: rays through the pixels' centres; n: through the n-th other point of the pixels */
    unsigned output; /* one bit of render_outputs_parse(); 0: colour */
    gbt_renderer renderer;
    gbt_preset preset;
    bool has_background;
    float background[3]; /* instead of the model's, [0, 1] */
    request_format format;
    int quality;     /* of JPEG */
    double pixel[2]; /* for REQUEST_PICK */
} request;

/** The value of a name in the query; NULL: not given. */
typedef const char *request_word(void *query, const char *name);

/** GBT_ERR_ARGUMENT for a picture that exceeds REQUEST_SIDE_MAX or REQUEST_PIXELS_MAX. */
gbt_status request_check_size(int width, int height, gbt_error *err);

/**
 * @param path [in] "/scene", "/render", "/pick", "/photo"
 * @return GBT_OK, GBT_ERR_IO (no such path), GBT_ERR_ARGUMENT or GBT_ERR_FORMAT ("NAME: what was wrong")
 */
gbt_status request_parse(const char *path, request_word *word, void *query, request *out, gbt_error *err);

#endif
