/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_faces.c -- the faces of a view, the parts of tiles that each of them sees, and their slopes.

     rays --> [make_frame] axes about their mean direction
     all rays within 72 degrees of it: one face, whose parts are the tiles
     otherwise: the six faces of a cube in these axes
     parts --> boxes around their slopes, and around those of 16 and 256 parts (list_parts16.h)

   With six faces, a tile all of whose rays lie within 72 degrees of the axis of one face is a part of that
   face; the rays of other tiles each go to the face of their largest component. */
#include "trace/list_faces.h"

#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
/* ---- axes ---- */

/* From the valid directions on a coarse grid of pixels: their sum (`middle`), and how they change along the
   rows of the picture (`along`). */
static void find_directions(const ray_image *rays, double middle[3], double along[3])
{
    enum { STEPS = 8 };
    memset(middle, 0, 3 * sizeof *middle);
    memset(along, 0, 3 * sizeof *along);
    for (int i = 0; i <= STEPS; i++)
        for (int k = 0; k <= STEPS; k++) {
            const size_t x = (size_t)((rays->width - 1) * (int64_t)k / STEPS),
                         y = (size_t)((rays->height - 1) * (int64_t)i / STEPS);
            const float *d = rays->dir + 3 * (y * (size_t)rays->width + x);
            for (int c = 0; c < 3 && ray_direction_is_sound(d); c++) {
                middle[c] += (double)d[c];
                along[c] += (k - STEPS / 2) * (double)d[c];
            }
        }
}

static bool make_frame(const ray_image *rays, list_frame *out)
{
    double u[3], v[3], w[3];
    const float *o = rays->origin;
    find_directions(rays, w, u);
    if (!ray_origin_is_sound(o))
        return false;
    if (!(dvec_length(w) > 1e-3)) { /* they look in all directions */
        w[0] = w[1] = 0;
        w[2] = 1;
    }
    dvec_normalize(w);
    const double lean = dvec_dot(u, w);
    for (int c = 0; c < 3; c++)
        u[c] -= lean * w[c];
    if (!(dvec_length(u) > 1e-9)) { /* one column */
        const double axis[3] = {fabs(w[0]) < 0.6, fabs(w[0]) >= 0.6, 0};
        dvec_cross(w, axis, u);
    }
    dvec_normalize(u);
    dvec_cross(w, u, v);
    const double *const axes[3] = {u, v, w};
    double m[3][3];
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) {
            out->axis[k][c] = (float)axes[k][c];
            m[k][c] = (double)out->axis[k][c];
        }
    for (int k = 0; k < 3; k++) {
        dvec_cross(m[(k + 1) % 3], m[(k + 2) % 3], out->dual[k]);
        const double det = dvec_dot(m[k], out->dual[k]);
        for (int c = 0; c < 3; c++)
            out->dual[k][c] /= det;
    }
    for (int c = 0; c < 3; c++)
        out->origin[c] = (double)o[c];
    return true;
}

/* Face `f` of a cube whose first face is `first`: it looks along w, -w, u, -u, v, -v for 0 to 5. */
static list_frame turn_frame(const list_frame *first, int f)
{
    const int look = (f / 2 + 2) % 3, a = (look + 1) % 3, b = (look + 2) % 3;
    const int from[3] = {f % 2 == 0 ? a : b, f % 2 == 0 ? b : a, look}; /* right-handed either way */
    list_frame out = *first;
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) {
            const bool back = k == 2 && f % 2 != 0;
            out.axis[k][c] = back ? -first->axis[from[k]][c] : first->axis[from[k]][c];
            out.dual[k][c] = back ? -first->dual[from[k]][c] : first->dual[from[k]][c];
        }
    return out;
}

/* ---- rays of a tile ---- */

typedef struct pixel_range {
    int x0, x1, y0, y1;
} pixel_range;

static pixel_range tile_pixels(const ray_image *rays, size_t tile)
{
    const int across = (rays->width + TILE_PIXELS - 1) / TILE_PIXELS,
              x0 = (int)(tile % (size_t)across) * TILE_PIXELS,
              y0 = (int)(tile / (size_t)across) * TILE_PIXELS;
    return (pixel_range){x0, x0 + TILE_PIXELS < rays->width ? x0 + TILE_PIXELS : rays->width, y0,
                         y0 + TILE_PIXELS < rays->height ? y0 + TILE_PIXELS : rays->height};
}

static const float *ray_at(const ray_image *rays, int x, int y)
{
    return rays->dir + 3 * ((size_t)y * (size_t)rays->width + (size_t)x);
}

static const slope_box nothing = {{FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX}};

/* ---- slopes of the parts ---- */

/* False if no ray of the tile has a part to be traced: no Gaussian needs to be listed then. The slopes of a
   part of the tile include all of its rays nevertheless, so that depths round as those of whole rays. */
static bool tile_has_traced_ray(const ray_image *rays, size_t tile)
{
    const pixel_range at = tile_pixels(rays, tile);
    if (rays->near == NULL)
        return true;
    for (int y = at.y0; y < at.y1; y++)
        for (int x = at.x0; x < at.x1; x++) {
            const size_t i = (size_t)y * (size_t)rays->width + (size_t)x;
            if (rays->near[i] < (rays->far != NULL ? rays->far[i] : INFINITY))
                return true;
        }
    return false;
}

typedef struct face_job {
    list_builder *lists;
    const ray_image *rays;
    uint8_t *tile_faces; /* list_builder.tile_faces */
    atomic_bool needs_six_faces;
} face_job;

/* Box around the slopes of the part's rays; false when some are too far from the axis. */
static bool slopes_of_part(const list_view *view, const ray_image *rays, const list_part *part,
                           slope_box *out)
{
    float dual[3][3];
    const list_frame *frame = &view->face[part->face].frame;
    for (int k = 0; k < 9; k++)
        dual[k / 3][k % 3] = (float)frame->dual[k / 3][k % 3];
    const pixel_range at = tile_pixels(rays, part->tile);
    bool near = true;
    slope_box box = nothing;
    for (int y = at.y0; y < at.y1; y++) {
        const float *d = ray_at(rays, at.x0, y);
        for (int x = at.x0; x < at.x1; x++, d += 3) {
            if (!ray_direction_is_sound(d) || !part_has_ray(view, part, d))
                continue;
            const float w = dual[2][0] * d[0] + dual[2][1] * d[1] + dual[2][2] * d[2], inverse = 1 / w;
            near = near && w > AXIS_COMPONENT_MIN;
            for (int k = 0; k < 2; k++) {
                const float s = (dual[k][0] * d[0] + dual[k][1] * d[1] + dual[k][2] * d[2]) * inverse;
                box.low[k] = s < box.low[k] ? s : box.low[k];
                box.high[k] = s > box.high[k] ? s : box.high[k];
            }
        }
    }
    for (int k = 0; k < 2 && box.low[0] <= box.high[0]; k++) {
        /* 16 ulps of the largest slope, tan 72 degrees; and more than the packets' boxes are enlarged by
           (slope_rays). */
        const float open = 4e-6f + 2e-3f * (box.high[k] - box.low[k]);
        box.low[k] -= open;
        box.high[k] += open;
    }
    *out = box;
    return near;
}

static void find_slopes(size_t block, size_t begin, size_t end, void *context)
{
    face_job *job = context;
    list_view *view = &job->lists->view;
    bool near = true;
    (void)block;
    for (size_t i = begin; i < end; i++) {
        list_part *part = &view->parts[i];
        part->has_traced_ray = tile_has_traced_ray(job->rays, part->tile);
        near = slopes_of_part(view, job->rays, part, &view->part_boxes[i]) && near;
    }
    if (!near)
        atomic_store(&job->needs_six_faces, true);
}

/* ---- six faces ---- */

/* Bit per face that a ray of the tile belongs to. */
static unsigned faces_of_rays(const list_frame *frame, const ray_image *rays, const pixel_range *at)
{
    unsigned faces = 0;
    for (int y = at->y0; y < at->y1; y++)
        for (int x = at->x0; x < at->x1; x++) {
            const float *d = ray_at(rays, x, y);
            float component[3];
            face_components(frame, d, component);
            faces |= ray_direction_is_sound(d) ? 1u << face_of(component) : 0;
        }
    return faces;
}

/* Bit per face that sees a tile: one face if all rays lie within 72 degrees of its axis, the first if it is
   among these, else the one with the largest margin; if there is none, the faces of the single rays. */
static unsigned faces_of_tile(const list_frame *frame, const ray_image *rays, size_t tile)
{
    const pixel_range at = tile_pixels(rays, tile);
    float low[3] = {FLT_MAX, FLT_MAX, FLT_MAX}, high[3] = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (int y = at.y0; y < at.y1; y++)
        for (int x = at.x0; x < at.x1; x++) {
            const float *d = ray_at(rays, x, y);
            float component[3];
            if (!ray_direction_is_sound(d))
                continue;
            face_components(frame, d, component);
            for (int k = 0; k < 3; k++) {
                low[k] = component[k] < low[k] ? component[k] : low[k];
                high[k] = component[k] > high[k] ? component[k] : high[k];
            }
        }
    if (low[2] > AXIS_COMPONENT_MIN) /* all rays, or there are none */
        return 1;
    float most = AXIS_COMPONENT_MIN;
    unsigned best = 0;
    for (int f = 0; f < LIST_FACES; f++) {
        const int axis = (f / 2 + 2) % 3;
        const float least = f % 2 == 0 ? low[axis] : -high[axis];
        best = least > most ? 1u << f : best;
        most = least > most ? least : most;
    }
    return best != 0 ? best : faces_of_rays(frame, rays, &at);
}

static void find_faces(size_t block, size_t begin, size_t end, void *context)
{
    const face_job *job = context;
    (void)block;
    for (size_t i = begin; i < end; i++)
        job->tile_faces[i] = (uint8_t)faces_of_tile(&job->lists->view.face[0].frame, job->rays, i);
}

static gbt_status reserve_parts(list_builder *lists, size_t count, gbt_error *err)
{
    list_view *view = &lists->view;
    view->part_count = count;
    GBT_TRY(mem_reserve((void **)&view->parts, &lists->part_capacity, 0, count, sizeof *view->parts,
                        "tile lists", err));
    return mem_reserve((void **)&view->part_boxes, &lists->part_box_capacity, 0, count,
                       sizeof *view->part_boxes, "tile lists", err);
}

/* With one face, parts are tiles. */
static gbt_status parts_of_one(list_builder *lists, size_t tiles, gbt_error *err)
{
    list_view *view = &lists->view;
    GBT_TRY(reserve_parts(lists, tiles, err));
    view->face_count = 1;
    view->face[0].first_part = 0;
    view->face[0].part_count = tiles;
    for (size_t i = 0; i < tiles; i++)
        view->parts[i] = (list_part){.tile = (uint32_t)i, .whole = true, .first = true};
    return GBT_OK;
}

static gbt_status parts_of_six(face_job *job, size_t tiles, gbt_error *err)
{
    list_builder *lists = job->lists;
    list_view *view = &lists->view;
    size_t count = 0;
    GBT_TRY(
        mem_reserve((void **)&lists->tile_faces, &lists->tile_face_capacity, 0, tiles, 1, "tile lists", err));
    job->tile_faces = lists->tile_faces;
    parallel_blocks(tiles, 16, find_faces, job);
    for (size_t i = 0; i < tiles; i++)
        count += (size_t)__builtin_popcount(job->tile_faces[i]);
    GBT_TRY(reserve_parts(lists, count, err));
    view->face_count = LIST_FACES;
    count = 0;
    for (int f = 0; f < LIST_FACES; f++) {
        list_face *face = &view->face[f];
        if (f > 0)
            face->frame = turn_frame(&view->face[0].frame, f);
        face->first_part = count;
        for (size_t i = 0; i < tiles; i++) {
            const unsigned faces = job->tile_faces[i], below = faces & ((1u << f) - 1);
            if (faces >> f & 1)
                view->parts[count++] = (list_part){.tile = (uint32_t)i,
                                                   .face = (uint8_t)f,
                                                   .whole = __builtin_popcount(faces) == 1,
                                                   .first = below == 0};
        }
        face->part_count = count - face->first_part;
    }
    return GBT_OK;
}

/* ---- boxes for the search ---- */

static void widen(slope_box *box, const slope_box *other)
{
    for (int k = 0; k < 2; k++) {
        box->low[k] = fminf(box->low[k], other->low[k]);
        box->high[k] = fmaxf(box->high[k], other->high[k]);
    }
}

static void set_lane(box_lanes *boxes, size_t lane, const slope_box *box)
{
    for (int k = 0; k < 2; k++) {
        boxes->edge[2 * k][lane] = box->low[k];
        boxes->edge[2 * k + 1][lane] = box->high[k];
    }
}

static void set_boxes(list_view *view, list_face *face)
{
    face->bounds = nothing;
    for (size_t i = 0; i < face->part_count; i++)
        widen(&face->bounds, &view->part_boxes[face->first_part + i]);
    for (size_t outer = 0; outer < face->box256_count; outer++)
        for (size_t i = 0; i < 16; i++) {
            const size_t at = 16 * outer + i;
            slope_box around = nothing;
            for (size_t lane = 0; lane < 16 && at < face->box16_count; lane++) {
                const size_t part = 16 * at + lane;
                const bool listed =
                    part < face->part_count && view->parts[face->first_part + part].has_traced_ray;
                const slope_box *box = listed ? &view->part_boxes[face->first_part + part] : &nothing;
                set_lane(&view->boxes16[face->first_box16 + at], lane, box);
                widen(&around, box);
            }
            set_lane(&view->boxes256[face->first_box256 + outer], i, &around);
        }
}

static gbt_status make_boxes(list_builder *lists, gbt_error *err)
{
    list_view *view = &lists->view;
    size_t count16 = 0, count256 = 0;
    for (int f = 0; f < view->face_count; f++) {
        list_face *face = &view->face[f];
        face->first_box16 = count16;
        face->first_box256 = count256;
        face->box16_count = (face->part_count + 15) / 16;
        face->box256_count = (face->box16_count + 15) / 16;
        count16 += face->box16_count;
        count256 += face->box256_count;
    }
    GBT_TRY(mem_reserve((void **)&view->boxes16, &lists->box16_capacity, 0, count16, sizeof *view->boxes16,
                        "tile lists", err));
    GBT_TRY(mem_reserve((void **)&view->boxes256, &lists->box256_capacity, 0, count256,
                        sizeof *view->boxes256, "tile lists", err));
    for (int f = 0; f < view->face_count; f++)
        set_boxes(view, &view->face[f]);
    return GBT_OK;
}

gbt_status list_faces_make(list_builder *lists, const ray_image *rays, bool *usable, gbt_error *err)
{
    const size_t tiles = (size_t)((rays->width + TILE_PIXELS - 1) / TILE_PIXELS) *
                         (size_t)((rays->height + TILE_PIXELS - 1) / TILE_PIXELS);
    face_job job = {.lists = lists, .rays = rays};
    *usable = rays->common_origin && make_frame(rays, &lists->view.face[0].frame);
    if (!*usable)
        return GBT_OK;
    GBT_TRY(parts_of_one(lists, tiles, err));
    atomic_init(&job.needs_six_faces, false);
    parallel_blocks(lists->view.part_count, 16, find_slopes, &job);
    if (atomic_load(&job.needs_six_faces)) {
        GBT_TRY(parts_of_six(&job, tiles, err));
        parallel_blocks(lists->view.part_count, 16, find_slopes, &job);
    }
    return make_boxes(lists, err);
}
