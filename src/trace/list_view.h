/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_view.h -- one view of Gaussians from the point where all its rays start: records in the view's
   axes, and the list of each tile. What view_lists.c makes and the list kernels read.

   In the axes u, v, w of the view a ray is s (a, b, 1): a and b are its slopes. */
#ifndef GBT_TRACE_LIST_VIEW_H
#define GBT_TRACE_LIST_VIEW_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/cpu.h"
#include "base/gaussians.h"
#include "trace/kernel.h"

enum { VIEW_GRAIN = 2048 /* Gaussians whose records are made together; a multiple of 16 */ };

/* x = x_u u + x_v v + x_w w with x_u = dual[0] . x and so on: exact for axes that are at right angles only to
   float rounding. */
typedef struct view_frame {
    float axis[3][3]; /* u, v, w: world, unit */
    double dual[3][3];
    double origin[3];
} view_frame;

/* Range of slopes; nothing is in it when low > high. */
typedef struct slope_box {
    float low[2], high[2]; /* a, b */
} slope_box;

/* A Gaussian on the rays of the view (view_form16.h has the formulas). */
typedef struct view_record {
    double a, b; /* slopes of the mean */
    float q[5], depth, falloff, opacity, color[3];
    uint32_t id; /* with RECORD_GENERAL */
} view_record;
enum { RECORD_GENERAL = 1u << 31 }; /* the form does not hold for it: see view_ellipsoid */

static inline uint32_t record_id(const view_record *r) { return r->id & ~(uint32_t)RECORD_GENERAL; }
static inline bool record_is_general(const view_record *r) { return (r->id & RECORD_GENERAL) != 0; }

/* Where it can be hit. Seen from its mean, the outline is the ellipse (c0 x + c1 y)^2 + (c2 y)^2 <= 1 about
   (x, y); a little larger than it is, for rounding. */
typedef struct view_outline {
    float x, y, chol[3], half[2]; /* half: extents of the ellipse */
    float kappa;                  /* t >= |(a, b, 1)| depth (1 - kappa) / w1 */
} view_outline;

/* In place of the outline of a Gaussian that the form does not hold for, because it reaches behind the near
   depth or is as large as it is far: centre and covariance of its ellipsoid in the view's axes. */
typedef struct view_ellipsoid {
    float center[3], uu, vv, ww, uw, vw;
} view_ellipsoid;

typedef union view_shape {
    view_outline outline;
    view_ellipsoid ellipsoid;
} view_shape;

_Static_assert(sizeof(view_record) == 64 && sizeof(view_shape) == 32, "a cache line, and half of one");

/* A Gaussian in the list of a tile. */
typedef struct list_pair {
    uint32_t record;
    uint32_t slot; /* number of its gradient record: all of one Gaussian stand together */
} list_pair;

/* What the tiles add to the gradients of a Gaussian: sums over hits of h = dL/d(d2), h v, h v v^T (xx yy zz
   yz zx xy), dL/d(colour), T alpha. v is in the turned axes of view_form16.h, of a general record in the
   Gaussian's own. */
enum { SLOT_H, SLOT_HV, SLOT_HVV = SLOT_HV + 3, SLOT_COLOR = SLOT_HVV + 6, SLOT_WEIGHT = SLOT_COLOR + 3 };
typedef struct gradient_slot {
    _Alignas(64) float sum[16];
} gradient_slot;

typedef struct view_kept {
    uint32_t records, general; /* general: those of them whose shapes are ellipsoids */
    uint32_t rejected;         /* Gaussians with non-finite fields */
} view_kept;

typedef struct list_view {
    view_frame frame;
    int tiles_across, tiles_down;
    slope_box *tiles;     /* of each tile's rays */
    view_record *records; /* those of block i of VIEW_GRAIN Gaussians begin at i * VIEW_GRAIN */
    view_shape *shapes;   /* as many, and one more: shapes are read two at a time */
    view_kept *kept;      /* records of each block */
    uint32_t *slot_first; /* [records] */
    uint32_t *slot_count;
    list_pair *pairs; /* tile by tile, by index of the Gaussian */
    size_t *first;    /* [tiles + 1] */
    size_t pair_count, block_count;
    gradient_slot *slots; /* [pairs] after an adjoint */
    uint8_t *slot_used;   /* [pairs]; the others are not set */
} list_view;

/* May a ray of these slopes meet the ellipsoid? By its tangent planes. */
static inline bool ellipsoid_meets_box(const view_ellipsoid *e, const slope_box *box)
{
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

/* Memory of one tile in flight. Start from {0}. */
typedef struct list_scratch {
    float *list; /* the tile's Gaussians, list16.h */
    size_t list_capacity;
    float *rows; /* of a packet, list_rows16.h */
    size_t row_capacity;
    void *hits; /* of one ray */
    size_t hit_bytes;
    gradient_slot *sums;
    size_t sum_capacity;
} list_scratch;

static inline void list_scratch_free(list_scratch *s)
{
    mem_free(s->list);
    mem_free(s->rows);
    mem_free(s->hits);
    mem_free(s->sums);
    *s = (list_scratch){0};
}

typedef struct list_kernel {
    /** Write the records of the Gaussians [begin, end) that can be seen through `bounds`, in their order.
        begin is a multiple of 16. */
    view_kept (*make_records)(const kernel_scene *scene, const gaussians *g, const view_frame *frame,
                              const slope_box *bounds, size_t begin, size_t end, view_record *records,
                              view_shape *shapes);
    /** Trace a tile of the view, as tile_forward_fn. */
    bool (*forward)(const kernel_scene *scene, const list_view *view, size_t tile, const tile_rays *rays,
                    packet_output out[TILE_PACKETS], hit_tape *tape, list_scratch *scratch,
                    kernel_counters *counters);
    /** Its adjoint, into the slots of the tile's pairs. */
    bool (*backward)(const kernel_scene *scene, list_view *view, size_t tile, const tile_rays *rays,
                     float d_rgb[TILE_PACKETS][3][PACKET_LANES], const hit_tape *tape, float d_background[3],
                     list_scratch *scratch);
    /** Sums of the records [begin, end) over their slots, turned into the Gaussians' own axes. */
    void (*turn_sums)(const kernel_scene *scene, const list_view *view, size_t begin, size_t end,
                      gradient_record *out);
} list_kernel;

CPU_DECLARE_VARIANTS(list_kernel, list_kernel);

#endif
