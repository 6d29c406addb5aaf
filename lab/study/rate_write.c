/* SPDX-License-Identifier: Apache-2.0 */
/* study/rate_write.c -- the study "rate" as tables, JSON and a chart. */
#include <jansson.h>
#include <stdio.h>

#include "data/json_out.h"
#include "gbtrace/compress.h"
#include "study/chart.h"
#include "study/rate.h"

/* Goals for a compressed model: bytes per anchor such that it is a twelfth of a baseline with 1 / 0.7 as many
   anchors of 316 bytes, and an invisible loss in dB. */
static const double bytes_limit = 37, loss_limit = 0.05;

static double per_anchor(const rate_model *m, size_t bytes)
{
    return (double)bytes / (m->anchors > 0 ? (double)m->anchors : 1);
}

const char *rate_row_name(const rate_row *row, char *out, size_t size)
{
    snprintf(out, size, row->quality > 0 ? "%g dB" : "lossless", row->quality);
    return out;
}

static void add_tables(const void *of, text *out)
{
    const rate_study *study = of;
    char name[32];
    for (size_t i = 0; i < study->model_count; i++) {
        const rate_model *m = &study->models[i];
        text_format(out, "%s**%s**: %zu anchors, %zu bytes as trained (%.1f per anchor), PSNR ",
                    i > 0 ? "\n" : "", m->name, m->anchors, m->plain_bytes, per_anchor(m, m->plain_bytes));
        text_number(out, m->psnr, 3);
        text_add(out, " dB, SSIM ");
        text_number(out, m->ssim, 4);
        text_format(out, ", %zu held-out views; steps found in %.1f s\n\n", m->views, m->probe_seconds);
        text_add(out,
                 "| quality | bytes | per anchor | times smaller | positions | features | offsets | scales | "
                 "pixels | steps | networks | rest | PSNR loss, dB | SSIM loss | encoded, s | decoded, s |\n"
                 "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
        for (size_t j = 0; j < m->row_count; j++) {
            const rate_row *r = &m->rows[j];
            const model_sizes *s = &r->sizes;
            const size_t parts[] = {s->positions, s->features, s->offsets, s->scales,
                                    s->pixels,    s->steps,    s->networks};
            size_t rest = s->total;
            text_format(out, "| %s | %zu | %.2f | %.1f |", rate_row_name(r, name, sizeof name), s->total,
                        per_anchor(m, s->total), (double)m->plain_bytes / (double)s->total);
            for (size_t p = 0; p < sizeof parts / sizeof *parts; p++) {
                text_format(out, " %.2f |", per_anchor(m, parts[p]));
                rest -= parts[p];
            }
            text_format(out, " %.2f | ", per_anchor(m, rest));
            text_number(out, m->psnr - r->psnr, 3);
            text_add(out, " | ");
            text_number(out, m->ssim - r->ssim, 4);
            text_format(out, " | %.2f | %.2f |\n", r->encode_seconds, r->decode_seconds);
        }
    }
}

static json_t *model_to_json(const rate_model *m)
{
    json_t *rows = json_array();
    for (size_t j = 0; j < m->row_count; j++) {
        const rate_row *r = &m->rows[j];
        const model_sizes *s = &r->sizes;
        json_array_append_new(
            rows,
            json_pack("{s:o,s:I,s:f,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:o,s:o,s:o,s:f,s:f}", "quality",
                      r->quality > 0 ? json_real(r->quality) : json_null(), "bytes", (json_int_t)s->total,
                      "bytes_per_anchor", per_anchor(m, s->total), "positions", (json_int_t)s->positions,
                      "features", (json_int_t)s->features, "offsets", (json_int_t)s->offsets, "scales",
                      (json_int_t)s->scales, "pixels", (json_int_t)s->pixels, "steps", (json_int_t)s->steps,
                      "networks", (json_int_t)s->networks, "psnr", json_number(r->psnr), "ssim",
                      json_number(r->ssim), "psnr_loss", json_number(m->psnr - r->psnr), "encode_seconds",
                      r->encode_seconds, "decode_seconds", r->decode_seconds));
    }
    return json_pack("{s:o,s:I,s:I,s:I,s:o,s:o,s:f,s:o}", "model", json_text(m->name), "anchors",
                     (json_int_t)m->anchors, "plain_bytes", (json_int_t)m->plain_bytes, "views",
                     (json_int_t)m->views, "psnr", json_number(m->psnr), "ssim", json_number(m->ssim),
                     "probe_seconds", m->probe_seconds, "settings", rows);
}

static void add_check(json_t *checks, const rate_model *m, const char *what, double limit, double value)
{
    char row[400];
    snprintf(row, sizeof row, "%s: %s", m->name, what);
    json_array_append_new(checks, json_pack("{s:o,s:f,s:o,s:b}", "row", json_text(row), "limit", limit,
                                            "value", json_number(value), "pass", value <= limit));
}

static json_t *data_of(const void *of)
{
    const rate_study *study = of;
    json_t *models = json_array(), *checks = json_array();
    for (size_t i = 0; i < study->model_count; i++) {
        const rate_model *m = &study->models[i];
        json_array_append_new(models, model_to_json(m));
        for (size_t j = 0; j < m->row_count; j++) {
            const rate_row *r = &m->rows[j];
            if (r->quality != gbt_compress_def_default().quality)
                continue;
            add_check(checks, m, "bytes per anchor at the default quality", bytes_limit,
                      per_anchor(m, r->sizes.total));
            add_check(checks, m, "loss of PSNR at the default quality, dB", loss_limit, m->psnr - r->psnr);
        }
    }
    return json_pack("{s:o,s:o}", "models", models, "rows", checks);
}

/* One curve per model: PSNR against bytes. The lossless file is left out: it has no quality in dB. */
static void add_charts(const void *of, text *out)
{
    const rate_study *study = of;
    scatter_point points[RATE_MODELS_MAX * RATE_ROWS_MAX];
    char names[RATE_MODELS_MAX * RATE_ROWS_MAX][32];
    const scatter_level levels[] = {{0, "as trained"}, {-loss_limit, "0.05 dB less"}};
    scatter_chart chart = {.title = "Size of a model file against its picture",
                           .note = "held-out views; steps by quality, dB",
                           .x_unit = "bytes per anchor, everything counted (log)",
                           .y_unit = "change of PSNR, dB",
                           .points = points,
                           .levels = levels,
                           .level_count = sizeof levels / sizeof *levels};
    for (size_t i = 0; i < study->model_count; i++) {
        const rate_model *m = &study->models[i];
        chart.series[1 + i] = m->name;
        for (size_t j = 0; j < m->row_count; j++) {
            const rate_row *r = &m->rows[j];
            if (!(r->quality > 0))
                continue;
            snprintf(names[chart.point_count], sizeof names[0], "%g", r->quality);
            points[chart.point_count] = (scatter_point){1 + (int)i, per_anchor(m, r->sizes.total),
                                                        r->psnr - m->psnr, names[chart.point_count]};
            chart.point_count++;
        }
    }
    scatter_begin(out, "size against picture", "", SCATTER_HEIGHT);
    scatter_draw(out, &chart, 0);
    text_add(out, "</svg>\n");
}

const study_output rate_output = {
    .name = "rate", .tables = add_tables, .charts = add_charts, .data = data_of};
