/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_parts16.h -- the parts of a face in which a record may be hit, for all records.

   A search in two levels, sixteen boxes at a time: the box of the record's ellipse against the boxes around
   sixteen parts each; then, in those that it meets, against the box of each part, and the ellipse itself
   against what is left. General records are tested against every part. Included by list_kernel.inc.h. */
#ifndef GBT_TRACE_LIST_PARTS16_H
#define GBT_TRACE_LIST_PARTS16_H

#include "trace/list_view.h"
#include "trace/list_records16.h"

/* Sixteen boxes of slopes relative to the centre of an ellipse. */
typedef struct boxes_about {
    vfloat16 left, right, bottom, top;
} boxes_about;

static inline boxes_about boxes_from(const box_lanes *boxes, float x, float y)
{
    const vfloat16 middle_x = vfloat16_set1(x), middle_y = vfloat16_set1(y);
    return (boxes_about){vfloat16_sub(vfloat16_load(boxes->edge[0]), middle_x),
                         vfloat16_sub(vfloat16_load(boxes->edge[1]), middle_x),
                         vfloat16_sub(vfloat16_load(boxes->edge[2]), middle_y),
                         vfloat16_sub(vfloat16_load(boxes->edge[3]), middle_y)};
}

/* Which boxes the box around the ellipse meets. Empty boxes meet nothing. */
static inline vmask16 boxes_meet(const boxes_about *b, const float half[2])
{
    const vfloat16 zero = vfloat16_set1(0), across = vfloat16_set1(half[0]), down = vfloat16_set1(half[1]);
    return vmask16_and(
        vmask16_and(vfloat16_le(b->left, across), vfloat16_le(vfloat16_sub(zero, b->right), across)),
        vmask16_and(vfloat16_le(b->bottom, down), vfloat16_le(vfloat16_sub(zero, b->top), down)));
}

/* (c0 x + c1 y)^2 + (c2 y)^2 */
static inline vfloat16 ellipse_form(const float c[3], vfloat16 x, vfloat16 y)
{
    const vfloat16 u = vfloat16_add(vfloat16_mul(vfloat16_set1(c[0]), x),
                                    vfloat16_mul(vfloat16_set1(c[1]), y)),
                   v = vfloat16_mul(vfloat16_set1(c[2]), y);
    return vfloat16_add(vfloat16_mul(u, u), vfloat16_mul(v, v));
}

static inline vfloat16 clamp_to(vfloat16 a, vfloat16 low, vfloat16 high)
{
    return vfloat16_min(vfloat16_max(a, low), high);
}

/* Which boxes the ellipse reaches into, found as in gaussians_in_packet() of list16.h. */
static inline vmask16 ellipse_meets(const boxes_about *b, const float c[3])
{
    const vfloat16 zero = vfloat16_set1(0), near_x = clamp_to(zero, b->left, b->right),
                   near_y = clamp_to(zero, b->bottom, b->top);
    const vfloat16 row_x =
                       clamp_to(vfloat16_div(vfloat16_mul(vfloat16_set1(-c[1]), near_y), vfloat16_set1(c[0])),
                                b->left, b->right),
                   column_y = clamp_to(vfloat16_div(vfloat16_mul(vfloat16_set1(-c[0] * c[1]), near_x),
                                                    vfloat16_set1(c[1] * c[1] + c[2] * c[2])),
                                       b->bottom, b->top);
    return vfloat16_le(vfloat16_min(ellipse_form(c, row_x, near_y), ellipse_form(c, near_x, column_y)),
                       vfloat16_set1(1));
}

static size_t find_parts(const list_view *view, const list_face *face, size_t record, uint32_t *parts)
{
    const list_record *r = &view->records[record];
    const list_shape *shape = &view->shapes[record];
    size_t count = 0;
    if (record_is_general(r)) {
        for (size_t i = face->first_part; i < face->first_part + face->part_count; i++) {
            const slope_box *box = &view->part_boxes[i];
            parts[count] = (uint32_t)i;
            count += view->parts[i].has_traced_ray && box->low[0] <= box->high[0] &&
                     ellipsoid_meets_box(&shape->ellipsoid, box);
        }
        return count;
    }
    const list_outline *o = &shape->outline;
    const float x = (float)(r->a + (double)o->x), y = (float)(r->b + (double)o->y);
    for (size_t i = 0; i < face->box256_count; i++) {
        const boxes_about around = boxes_from(&view->boxes256[face->first_box256 + i], x, y);
        for (unsigned rest = vmask16_bits(boxes_meet(&around, o->half)); rest != 0; rest &= rest - 1) {
            const size_t at = 16 * i + (size_t)__builtin_ctz(rest);
            const boxes_about boxes = boxes_from(&view->boxes16[face->first_box16 + at], x, y);
            const vmask16 near = boxes_meet(&boxes, o->half);
            if (vmask16_any(near))
                count += vmask16_numbers(vmask16_and(near, ellipse_meets(&boxes, o->chol)),
                                         (uint32_t)(face->first_part + 16 * at), parts + count);
        }
    }
    return count;
}

#endif
