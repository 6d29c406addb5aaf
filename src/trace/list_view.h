/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_view.h -- one view of Gaussians from the point where all its rays start: records in the axes of
   its faces, and the list of each tile. What list_faces.c and list_build.c make and the kernels of
   list_kernel.h read.

   In the axes u, v, w of a face a ray is s (a, b, 1): a and b are its slopes. Rays within 72 degrees of their
   mean direction have one face; others the six faces of a cube. */
#ifndef GBT_TRACE_LIST_VIEW_H
#define GBT_TRACE_LIST_VIEW_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "trace/kernel.h"

enum {
    LIST_GRAIN = 512, /* Gaussians whose records are made together; a multiple of 16 */
    LIST_FACES = 6
};

/* x = x_u u + x_v v + x_w w with x_u = dual[0] . x and so on: exact for axes that are at right angles only to
   float rounding. */
typedef struct list_frame {
    float axis[3][3]; /* u, v, w: world, unit */
    double dual[3][3];
    double origin[3];
} list_frame;

/* Range of slopes; nothing is in it when low > high. */
typedef struct slope_box {
    float low[2], high[2]; /* a, b */
} slope_box;

/* Rays of a tile of pixels that one face sees. */
typedef struct list_part {
    uint32_t tile;
    uint8_t face;
    bool whole;          /* all of the tile's rays */
    bool first;          /* the first part of the tile: pixels without a ray belong to it */
    bool has_traced_ray; /* some ray has a part to be traced (ray_image.near); else no Gaussian is listed */
} list_part;

/* Sixteen slope_box: lowest a, highest a, lowest b, highest b. */
typedef struct box_lanes {
    _Alignas(64) float edge[4][16];
} box_lanes;

/* One face and its parts, which are consecutive. */
typedef struct list_face {
    list_frame frame;
    slope_box bounds; /* of all its parts */
    size_t first_part, part_count;
    size_t first_box16, box16_count; /* its range of list_view.boxes16 */
    size_t first_box256, box256_count;
} list_face;

/* A Gaussian on the rays of a face (view_form16.h has the formulas). */
typedef struct list_record {
    double a, b; /* slopes of the mean */
    float q[5], depth, falloff, opacity, color[3];
    uint32_t id; /* with RECORD_GENERAL */
} list_record;
enum { RECORD_GENERAL = 1u << 31 }; /* the form does not hold for it: see list_ellipsoid */

static inline uint32_t record_id(const list_record *r) { return r->id & ~(uint32_t)RECORD_GENERAL; }
static inline bool record_is_general(const list_record *r) { return (r->id & RECORD_GENERAL) != 0; }

/* Where a record can be hit: the ellipse (c0 x + c1 y)^2 + (c2 y)^2 <= 1 of slopes about a centre that is (x,
   y) from the mean; slightly enlarged for rounding. */
typedef struct list_outline {
    float x, y, chol[3], half[2]; /* half: extents of the ellipse */
    float kappa;                  /* t >= |(a, b, 1)| depth (1 - kappa) / w1 */
} list_outline;

/* Replaces the outline of a Gaussian that view_form16.h does not hold for, because it would, if it were
   opaque, reach behind the near depth or be as large as it is far: centre and covariance of its ellipsoid in
   the face's axes. */
typedef struct list_ellipsoid {
    float center[3], uu, vv, ww, uw, vw;
} list_ellipsoid;

typedef union list_shape {
    list_outline outline;
    list_ellipsoid ellipsoid;
} list_shape;

_Static_assert(sizeof(list_record) == 64 && sizeof(list_shape) == 32, "a cache line, and half of one");

/* A Gaussian in the list of a tile. */
typedef struct list_pair {
    uint32_t record;
    uint32_t slot; /* number of its gradient_slot; those of one record are consecutive */
} list_pair;

/* What the tiles add to the gradients of a Gaussian: sums over hits of h = dL/d(d2), h v, h v v^T (xx yy zz
   yz zx xy), dL/d(colour), T alpha. v is in the turned axes of view_form16.h, and lacks R and the sign of the
   first component (turn_sums); for a general record it is in the Gaussian's own axes. */
enum { SLOT_H, SLOT_HV, SLOT_HVV = SLOT_HV + 3, SLOT_COLOR = SLOT_HVV + 6, SLOT_WEIGHT = SLOT_COLOR + 3 };
typedef struct gradient_slot {
    _Alignas(64) float sum[16];
} gradient_slot;

/* The sums of a gradient_record for the Gaussians or records of a block. Sixteen more than needed: arrays
   that lie 2,048 bytes apart would compete for the same cache sets. */
typedef struct block_sums {
    _Alignas(64) float sum[GRADIENT_FLOATS][LIST_GRAIN + 16];
} block_sums;

/* The records that one face has of a block of LIST_GRAIN Gaussians. */
typedef struct list_kept {
    size_t first;
    uint32_t records, general; /* general: those of them whose shapes are ellipsoids */
} list_kept;

typedef struct list_view {
    list_face face[LIST_FACES];
    int face_count;   /* 1 or LIST_FACES */
    list_part *parts; /* face by face, in the order of the tiles; with one face, a part is a tile */
    size_t part_count;
    slope_box *part_boxes; /* [parts] around each part's rays */
    box_lanes *boxes16;    /* part_boxes of sixteen parts each, in lanes; face by face */
    box_lanes *boxes256;   /* boxes around sixteen parts each, sixteen of them in lanes */
    size_t block_count;    /* of Gaussians */
    uint16_t *reached; /* [face][block][LIST_GRAIN / 16] bit per Gaussian that may reach into the face; six
                          faces only */
    list_kept *kept;   /* [face][block] */
    list_record *records;
    list_shape *shapes;   /* as many, and one more: shapes are read two at a time */
    uint32_t *slot_first; /* [records] */
    uint32_t *slot_count;
    list_pair *pairs; /* part by part, by index of the Gaussian */
    size_t *first;    /* [parts + 1] */
    size_t pair_count;
    gradient_slot *slots; /* [pairs] after an adjoint */
    uint8_t *slot_used;   /* [pairs]; the others are not set */
} list_view;

static inline const list_frame *part_frame(const list_view *view, size_t part)
{
    return &view->face[view->parts[part].face].frame;
}

/* Components of a direction along the three axes of the first face. */
static inline void face_components(const list_frame *frame, const float d[3], float out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = (float)frame->dual[k][0] * d[0] + (float)frame->dual[k][1] * d[1] +
                 (float)frame->dual[k][2] * d[2];
}

/* The face of six that a ray belongs to: that of its largest component. Faces look along w, -w, u, -u, v,
   -v. */
static inline int face_of(const float component[3])
{
    const float u = fabsf(component[0]), v = fabsf(component[1]), w = fabsf(component[2]);
    const int axis = w >= u && w >= v ? 2 : u >= v ? 0 : 1;
    return (axis + 1) % 3 * 2 + (component[axis] < 0);
}

/* Whether a ray of the part's tile is one of the part. */
static inline bool part_has_ray(const list_view *view, const list_part *part, const float d[3])
{
    float component[3];
    if (part->whole)
        return true;
    face_components(&view->face[0].frame, d, component);
    return face_of(component) == part->face;
}

/* May a ray with slopes in the box meet the ellipsoid? Tests its reach across the planes of the box's four
   edges, and across w = 0. */
static inline bool ellipsoid_meets_box(const list_ellipsoid *e, const slope_box *box)
{
    /* 64 ulps of the largest coordinates, more than rounding loses. */
    const float slack = 4e-6f * (fabsf(e->center[0]) + fabsf(e->center[1]) + fabsf(e->center[2]));
    const float behind = -e->center[2] - slack;
    if (behind > 0 && behind * behind > e->ww)
        return false;
    for (int k = 0; k < 2; k++) {
        const float x = e->center[k], xx = k == 0 ? e->uu : e->vv, xw = k == 0 ? e->uw : e->vw;
        for (int side = 0; side < 2; side++) {
            const float slope = side == 0 ? box->low[k] : box->high[k], across = x - slope * e->center[2];
            const float beyond = (side == 0 ? -across : across) - slack * (1 + fabsf(slope)),
                        reach = xx + slope * (slope * e->ww - 2 * xw);
            if (beyond > 0 && reach < beyond * beyond)
                return false;
        }
    }
    return true;
}

#endif
