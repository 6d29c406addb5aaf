/* SPDX-License-Identifier: Apache-2.0 */
/* study/speed_write.c -- the study "speed" as a table, JSON and a chart. */
#include <jansson.h>
#include <math.h>
#include <stdio.h>

#include "base/cpu.h"
#include "data/json_out.h"
#include "study/chart.h"
#include "study/speed.h"

enum { PANEL_GAP = 18 };

static const char x_unit[] = "core-microseconds per pixel: tree and picture (log)";
static const char y_unit[] = "PSNR to the picture without cut-offs, dB";
static const char y_photo_unit[] = "PSNR to the held-out photos, mean, dB";

static const char *knob_name(speed_knob knob)
{
    static const char *const names[KNOB_COUNT] = {"preset", "alpha_min",       "T_min",
                                                  "kernel", "instruction set", "renderer"};
    return names[knob];
}

/* ---- tables ---- */

static void add_tables(const void *of, text *out)
{
    const speed_study *study = of;
    for (size_t m = 0; m < study->model_count; m++) {
        const speed_model *model = &study->models[m];
        text_format(out,
                    "%s**%s**: %zu Gaussians, %zu rays, %zu of them checked; %d threads, medians of %d\n\n",
                    m > 0 ? "\n" : "", model->name, model->gaussians, model->rays, model->check_rays,
                    study->threads, study->repeats);
        text_add(out, "| knob | value | tree and forward, core-us/ray | forward | with adjoint | blended per "
                      "ray | pairs per packet | PSNR, dB | max error | to photos, dB |\n"
                      "|---|---|---|---|---|---|---|---|---|---|\n");
        for (size_t i = 0; i < model->row_count; i++) {
            const speed_row *row = &model->rows[i];
            text_format(out, "| %s | %s | %.3f | %.3f | %.3f | %.1f | %.0f | ", knob_name(row->knob),
                        row->value, row->picture_us, row->forward_us, row->both_us, row->blended, row->pairs);
            text_number(out, row->error.psnr, 1);
            text_format(out, " | %.2g | ", row->error.max);
            text_number(out, row->photo_psnr, 2);
            text_add(out, " |\n");
        }
    }
}

static json_t *model_to_json(const speed_model *model)
{
    json_t *rows = json_array();
    const double promised = 0.5 / 255,
                 kept = model->rows[0].error.max; /* of the preset "exact", which comes first */
    for (size_t i = 0; i < model->row_count; i++) {
        const speed_row *r = &model->rows[i];
        json_array_append_new(
            rows,
            json_pack("{s:s,s:s,s:s,s:s,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:f,s:o}", "knob", knob_name(r->knob),
                      "value", r->value, "kernel", r->splats ? "" : bench_kernel_name(r->kernel), "isa",
                      cpu_isa_name(r->isa), "alpha_min", (double)r->settings.alpha_min, "transmittance_min",
                      (double)r->settings.transmittance_min, "tree_forward_core_us_per_ray", r->picture_us,
                      "forward_core_us_per_ray", r->forward_us, "forward_adjoint_core_us_per_ray", r->both_us,
                      "blended_per_ray", r->blended, "row_pairs_per_packet", r->pairs, "psnr", r->error.psnr,
                      "max_error", r->error.max, "photo_psnr",
                      isfinite(r->photo_psnr) ? json_real(r->photo_psnr) : json_null()));
    }
    json_t *check = json_pack("{s:s,s:f,s:f,s:b}", "row", "exact: largest error", "limit", promised, "value",
                              kept, "pass", kept <= promised);
    return json_pack("{s:o,s:I,s:I,s:I,s:o,s:[o]}", "model", json_text(model->name), "gaussians",
                     (json_int_t)model->gaussians, "rays", (json_int_t)model->rays, "check_rays",
                     (json_int_t)model->check_rays, "settings", rows, "checks", check);
}

static json_t *data_of(const void *of)
{
    const speed_study *study = of;
    json_t *models = json_array();
    for (size_t m = 0; m < study->model_count; m++)
        json_array_append_new(models, model_to_json(&study->models[m]));
    return json_pack("{s:i,s:i,s:o}", "repeats", study->repeats, "threads", study->threads, "models", models);
}

/* ---- chart ---- */

/* Panels per model: error to the picture without cut-offs; for a run also to the photos. */
static size_t panel_count(const speed_model *model) { return model->photo_count > 0 ? 2 : 1; }

static void draw_panel(const speed_study *study, size_t m, bool photos, int top, text *out)
{
    const speed_model *model = &study->models[m];
    scatter_point points[SPEED_WAYS_MAX];
    char note[160];
    if (photos)
        snprintf(note, sizeof note, "%zu held-out photos", model->photo_count);
    else
        snprintf(note, sizeof note, "%zu Gaussians, %zu rays, %d threads, %s", model->gaussians, model->rays,
                 study->threads, cpu_isa_name(cpu_best_isa()));
    scatter_chart chart = {.title = model->name,
                           .note = note,
                           .x_unit = x_unit,
                           .y_unit = photos ? y_photo_unit : y_unit,
                           .points = points,
                           .point_count = model->row_count,
                           .apart = 1u << KNOB_KERNEL | 1u << KNOB_ISA | 1u << KNOB_RENDERER};
    for (int k = 0; k < KNOB_COUNT; k++)
        chart.series[k] = knob_name((speed_knob)k);
    for (size_t i = 0; i < model->row_count; i++) {
        const speed_row *r = &model->rows[i];
        points[i] = (scatter_point){(int)r->knob, r->picture_us, photos ? r->photo_psnr : r->error.psnr,
                                    r->is_default ? "" : r->value};
    }
    scatter_draw(out, &chart, top);
}

static void add_charts(const void *of, text *out)
{
    const speed_study *study = of;
    size_t panels = 0;
    for (size_t m = 0; m < study->model_count; m++)
        panels += panel_count(&study->models[m]);
    const int height = (int)panels * (SCATTER_HEIGHT + PANEL_GAP) - PANEL_GAP;
    scatter_begin(out, "speed against accuracy", "", height);
    int top = 0;
    for (size_t m = 0; m < study->model_count; m++)
        for (size_t panel = 0; panel < panel_count(&study->models[m]);
             panel++, top += SCATTER_HEIGHT + PANEL_GAP)
            draw_panel(study, m, panel == 1, top, out);
    text_add(out, "</svg>\n");
}

const study_output speed_output = {
    .name = "speed", .tables = add_tables, .charts = add_charts, .data = data_of};
