/* SPDX-License-Identifier: Apache-2.0 */
/* command/init_report.c -- gbtrace init: the initial anchors as a PLY for viewers, and their number compared
   with the voxel baseline.

   scene --> voxel size --> anchors (+ balls)
        --> [one row per anchor: radius, scales, count, depth, colour] --> PLY, text, JSON */
#include "gbtrace/init.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "anchor/init.h"
#include "base/choice.h"
#include "base/compare.h"
#include "base/def.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "bvh/points.h"
#include "data/json_out.h"
#include "data/ply.h"
#include "data/scene.h"
#include "command/ball_mesh.h"
#include "command/init_quality.h"
#include "train/def.h"

enum { ANCHOR_SCALES = 6 };

gbt_init_def gbt_init_def_default(void)
{
    const gbt_train_def train = gbt_train_def_default();
    return (gbt_init_def){.init = train.init,
                          .init_count = train.init_count,
                          .scale_prior = train.scale_prior,
                          .max_depth = train.max_depth,
                          .voxel_size = train.voxel_size,
                          .voxel_rule = GBT_VOXEL_RULE_MEDIAN,
                          .cookie_ = DEF_COOKIE};
}

/* ---- one row per anchor ---- */

typedef struct anchor_rows {
    float *radius, *count, *depth; /* [anchors] */
    float *color;                  /* [anchors][3] */
    float *scale;                  /* [anchors][6], standard deviations */
} anchor_rows;

static void rows_free(anchor_rows *r)
{
    mem_free(r->radius);
    mem_free(r->count);
    mem_free(r->depth);
    mem_free(r->color);
    mem_free(r->scale);
}

static gbt_status rows_alloc(anchor_rows *r, size_t count, gbt_error *err)
{
    r->radius = mem_calloc(count, sizeof *r->radius, "anchor rows", err);
    r->count = mem_calloc(count, sizeof *r->count, "anchor rows", err);
    r->depth = mem_calloc(count, sizeof *r->depth, "anchor rows", err);
    r->color = mem_calloc(count, 3 * sizeof *r->color, "anchor rows", err);
    r->scale = mem_calloc(count, ANCHOR_SCALES * sizeof *r->scale, "anchor rows", err);
    return r->radius != NULL && r->count != NULL && r->depth != NULL && r->color != NULL && r->scale != NULL
               ? GBT_OK
               : GBT_ERR_NO_MEMORY;
}

static void rows_from_balls(anchor_rows *r, const balls *b, bool has_color)
{
    for (size_t j = 0; j < b->count; j++) {
        r->radius[j] = b->radius[j];
        r->count[j] = (float)(b->first[j + 1] - b->first[j]);
        r->depth[j] = (float)b->depth[j];
    }
    for (size_t i = 0; i < 3 * b->count; i++)
        r->color[i] = has_color ? b->color[i] : 0.5f;
}

/** Rows of voxel anchors, which keep no list of members: each point is assigned to the nearest centre. */
static gbt_status rows_from_nearest(anchor_rows *r, const anchors *a, const scene_points *points,
                                    gbt_error *err)
{
    uint32_t *nearest = mem_alloc(points->count, sizeof *nearest, "nearest anchors", err);
    if (nearest == NULL)
        return GBT_ERR_NO_MEMORY;
    const gbt_status status =
        points_find_nearest(a->position, a->count, points->position, points->count, nearest, NULL, err);
    for (size_t i = 0; i < points->count && status == GBT_OK; i++) {
        const size_t j = nearest[i];
        r->count[j] += 1.0f;
        for (size_t k = 0; k < 3; k++) /* a running mean, which keeps its precision in crowded cells */
            r->color[3 * j + k] += (points->color[3 * i + k] - r->color[3 * j + k]) / r->count[j];
    }
    mem_free(nearest);
    GBT_TRY(status);
    for (size_t j = 0; j < a->count; j++)
        r->radius[j] = expf(a->scale_log[ANCHOR_SCALES * j]);
    return GBT_OK;
}

/* ---- output ---- */

static gbt_status write_points(const char *path, const scene *s, const anchors *a, const anchor_rows *r,
                               gbt_error *err)
{
    const ply_extra extras[] = {
        {"radius", r->radius, 1},
        {"scale_0", r->scale, ANCHOR_SCALES},
        {"scale_1", r->scale + 1, ANCHOR_SCALES},
        {"scale_2", r->scale + 2, ANCHOR_SCALES},
        {"scale_3", r->scale + 3, ANCHOR_SCALES},
        {"scale_4", r->scale + 4, ANCHOR_SCALES},
        {"scale_5", r->scale + 5, ANCHOR_SCALES},
        {"count", r->count, 1},
        {"depth", r->depth, 1},
    };
    ply_cloud cloud = {.vertex_count = a->count,
                       .position = a->position,
                       .extra_count = sizeof extras / sizeof *extras,
                       .extras = extras,
                       .color = r->color,
                       .comment = "gbtrace init: one vertex per anchor"};
    memcpy(cloud.origin, s->origin, sizeof cloud.origin);
    return ply_write(path, &cloud, err);
}

static gbt_status write_mesh(const char *path, const scene *s, const anchors *a, const anchor_rows *r,
                             gbt_error *err)
{
    ball_mesh mesh;
    GBT_TRY(ball_mesh_build(a->position, r->radius, r->color, a->count, &mesh, err));
    ply_cloud cloud = {.vertex_count = mesh.vertex_count,
                       .position = mesh.position,
                       .color = mesh.color,
                       .face_count = mesh.face_count,
                       .faces = mesh.faces,
                       .comment = "gbtrace init: one sphere per anchor"};
    memcpy(cloud.origin, s->origin, sizeof cloud.origin);
    const gbt_status status = ply_write(path, &cloud, err);
    ball_mesh_free(&mesh);
    return status;
}

typedef struct spread {
    double min, median, mean, max;
} spread;

/** Spread of `values` with a stride; scratch is [count]. */
static spread spread_of(const float *values, size_t stride, size_t count, float *scratch)
{
    spread s = {0};
    if (count == 0)
        return s;
    for (size_t i = 0; i < count; i++) {
        scratch[i] = values[i * stride];
        s.mean += (double)scratch[i] / (double)count;
    }
    qsort(scratch, count, sizeof *scratch, compare_floats);
    s.min = (double)scratch[0];
    s.median = (double)scratch[(count - 1) / 2];
    s.max = (double)scratch[count - 1];
    return s;
}

typedef struct init_facts {
    gbt_init_kind kind;
    gbt_scale_prior scale_prior;
    gbt_voxel_rule voxel_rule;
    bool voxel_size_given;
    size_t points, anchors, voxel_anchors;
    float voxel_size;
    bool has_balls;
    spread radius, scale, count, depth;
    init_quality quality[INIT_QUALITY_ROWS];
} init_facts;

static json_t *spread_to_json(const spread *s)
{
    return json_pack("{s:f,s:f,s:f,s:f}", "min", s->min, "median", s->median, "mean", s->mean, "max", s->max);
}

static json_t *qualities_to_json(const init_quality *rows)
{
    json_t *list = json_array();
    for (int i = 0; i < INIT_QUALITY_ROWS; i++)
        json_array_append_new(list, json_pack("{s:s,s:I,s:f,s:f}", "init", rows[i].name, "anchors",
                                              (json_int_t)rows[i].anchors, "distance_rms", rows[i].distance,
                                              "color_rms", rows[i].color));
    return list;
}

/* Where the voxel size comes from. */
static const char *size_from(const init_facts *f, char *out)
{
    return f->voxel_size_given ? "given" : choice_name(GBT_VOXEL_RULE_NAMES, (int)f->voxel_rule, out);
}

static gbt_status save_json(const char *path, const char *data, const init_facts *f, gbt_error *err)
{
    char from[CHOICE_TEXT_SIZE];
    json_t *value = json_pack("{s:i,s:o,s:s,s:s,s:s,s:f,s:I,s:I,s:I,s:o,s:o,s:o,s:o,s:o}", "schema", 1,
                              "data", json_text(data), "init", CHOICE_NAME(GBT_INIT_NAMES, f->kind),
                              "scale_prior", CHOICE_NAME(GBT_SCALE_PRIOR_NAMES, f->scale_prior), "voxel_rule",
                              size_from(f, from), "voxel_size", (double)f->voxel_size, "points",
                              (json_int_t)f->points, "anchors", (json_int_t)f->anchors, "voxel_anchors",
                              (json_int_t)f->voxel_anchors, "radius", spread_to_json(&f->radius), "scale",
                              spread_to_json(&f->scale), "points_per_anchor", spread_to_json(&f->count),
                              "depth", spread_to_json(&f->depth), "quality", qualities_to_json(f->quality));
    const gbt_status status = json_save(value, path, err);
    json_decref(value);
    return status;
}

static void print_spread(FILE *out, const char *name, const spread *s)
{
    fprintf(out, "  %-18s %10.4g %10.4g %10.4g %10.4g\n", name, s->min, s->median, s->mean, s->max);
}

static const char *what_they_are(gbt_init_kind kind)
{
    static const char *const words[] = {[GBT_INIT_GB] = "granular balls",
                                        [GBT_INIT_ADAPTIVE] = "adaptive balls",
                                        [GBT_INIT_VOXEL] = "voxels",
                                        [GBT_INIT_RANDOM] = "random points"};
    return words[kind];
}

static void print_facts(FILE *out, const init_facts *f)
{
    char from[CHOICE_TEXT_SIZE];
    fprintf(out, "points             %zu\n", f->points);
    fprintf(out, "voxel size         %g (%s)\n", (double)f->voxel_size, size_from(f, from));
    fprintf(out, "anchors            %zu (%s), %.3g points each\n", f->anchors, what_they_are(f->kind),
            (double)f->points / (double)f->anchors);
    fprintf(out, "voxel baseline     %zu anchors at the same voxel size\n", f->voxel_anchors);
    fprintf(out, "%-20s %10s %10s %10s %10s\n", "per anchor", "min", "median", "mean", "max");
    print_spread(out, "radius", &f->radius);
    print_spread(out, "scale", &f->scale);
    print_spread(out, "points", &f->count);
    if (f->has_balls)
        print_spread(out, "depth", &f->depth);
    fprintf(out, "%-20s %10s %10s %10s\n", "points to centres", "anchors", "distance", "colour");
    for (const init_quality *q = f->quality; q < f->quality + INIT_QUALITY_ROWS; q++)
        fprintf(out, "  %-18s %10zu %10.4g %10.4g\n", q->name, q->anchors, q->distance, q->color);
}

/* The number of voxels from which the baseline starts; its grid is aligned with world coordinates. */
static gbt_status count_voxels(const scene *s, float voxel_size, size_t *out, gbt_error *err)
{
    const size_t values = 3 * s->points.count;
    float *world = mem_alloc(values, sizeof *world, "points", err), *centers = NULL;
    if (world == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < values; i++)
        world[i] = (float)((double)s->points.position[i] + s->origin[i % 3]);
    const gbt_status status = voxel_centers(world, s->points.count, voxel_size, &centers, out, err);
    mem_free(centers);
    mem_free(world);
    return status;
}

/* The outputs that were asked for. */
typedef struct init_outputs {
    const char *ply;
    bool mesh;        /* the PLY holds triangles, not points */
    const char *json; /* NULL: none */
    FILE *report;     /* NULL: none */
} init_outputs;

/** Everything after the anchors have been made. */
static gbt_status report_anchors(const char *data, const scene *s, const anchors *a, const balls *b,
                                 init_facts *facts, const init_outputs *out, gbt_error *err)
{
    anchor_rows rows = {0};
    float *scratch = NULL;
    gbt_status status = rows_alloc(&rows, a->count, err);
    if (status != GBT_OK)
        goto done;
    if (b->count == a->count)
        rows_from_balls(&rows, b, s->points.has_color);
    else
        status = rows_from_nearest(&rows, a, &s->points, err);
    if (status != GBT_OK)
        goto done;
    for (size_t i = 0; i < a->count * ANCHOR_SCALES; i++)
        rows.scale[i] = expf(a->scale_log[i]);
    status = out->mesh ? write_mesh(out->ply, s, a, &rows, err) : write_points(out->ply, s, a, &rows, err);
    if (status != GBT_OK)
        goto done;
    scratch = mem_alloc(a->count, sizeof *scratch, "anchor rows", err);
    if (scratch == NULL) {
        status = GBT_ERR_NO_MEMORY;
        goto done;
    }
    facts->radius = spread_of(rows.radius, 1, a->count, scratch);
    facts->scale = spread_of(rows.scale, ANCHOR_SCALES, a->count, scratch);
    facts->count = spread_of(rows.count, 1, a->count, scratch);
    facts->depth = spread_of(rows.depth, 1, a->count, scratch);
    if (out->json != NULL)
        status = save_json(out->json, data, facts, err);
    if (status == GBT_OK && out->report != NULL)
        print_facts(out->report, facts);
done:
    mem_free(scratch);
    rows_free(&rows);
    return status;
}

static gbt_status check_def(const gbt_init_def *def, gbt_error *err)
{
    GBT_TRY(def_check(def->cookie_, "gbt_init_def_default", err));
    GBT_TRY(choice_check("voxel_rule", GBT_VOXEL_RULE_NAMES, (int)def->voxel_rule, err));
    gbt_train_def train = gbt_train_def_default(); /* for its range checks: training has the same settings */
    train.init = def->init;
    train.init_count = def->init_count;
    train.scale_prior = def->scale_prior;
    train.max_depth = def->max_depth;
    train.voxel_size = def->voxel_size;
    return train_def_check(&train, err);
}

gbt_status gbt_init(const char *data, const gbt_init_def *def, const char *out_ply, const char *json_path,
                    FILE *report, gbt_error *err)
{
    PLAIN_NUMBERS;
    anchor_init_def how = anchor_init_def_default();
    GBT_TRY(check_def(def, err));
    if (file_is_same(data, out_ply) ||
        (json_path != NULL && (file_is_same(data, json_path) || file_is_one(out_ply, json_path))))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: would be overwritten (the output must be another file)",
                         file_is_same(data, out_ply) ? out_ply : json_path);
    scene s;
    anchors a = {0};
    balls b = {0};
    GBT_TRY((def->init == GBT_INIT_VOXEL ? scene_load_in_place : scene_load)(data, NULL, &s, err));
    const scene_points *points = &s.points;
    init_facts facts = {.kind = def->init,
                        .points = points->count,
                        .voxel_rule = def->voxel_rule,
                        .voxel_size_given = def->voxel_size > 0.0f,
                        .voxel_size = def->voxel_size};
    gbt_status status = GBT_OK;
    if (points->count == 0)
        status = base_fail(err, GBT_ERR_FORMAT, "%s: no sparse points to start from", data);
    if (status == GBT_OK && !(facts.voxel_size > 0.0f))
        status = balls_voxel_size(points->position, points->count, def->voxel_rule, &facts.voxel_size, err);
    if (status == GBT_OK) {
        how.kind = def->init;
        how.fraction = def->init_count;
        how.scale = def->scale_prior;
        how.balls.voxel_size = facts.voxel_size;
        how.balls.max_depth = def->max_depth;
        status = anchors_init(points->position, points->has_color ? points->color : NULL, points->count, &how,
                              &a, &b, err);
    }
    if (status == GBT_OK)
        status = count_voxels(&s, facts.voxel_size, &facts.voxel_anchors, err);
    if (status == GBT_OK) {
        facts.anchors = a.count;
        facts.has_balls = b.count > 0;
        facts.scale_prior = def->init == GBT_INIT_GB ? def->scale_prior : GBT_SCALE_PRIOR_NN;
        status = init_quality_measure(points, facts.voxel_size, def->max_depth, def->init_count,
                                      facts.quality, err);
    }
    const init_outputs out = {.ply = out_ply, .mesh = def->mesh, .json = json_path, .report = report};
    if (status == GBT_OK)
        status = report_anchors(data, &s, &a, &b, &facts, &out, err);
    balls_free(&b);
    anchors_free(&a);
    scene_free(&s);
    return status;
}
