/* SPDX-License-Identifier: Apache-2.0 */
/* report/facts.c -- the tables of a run's page. */
#include "report/facts.h"

#include <math.h>
#include <string.h>

#include "base/file.h"
#include "gbtrace/progress.h"
#include "gbtrace/version.h"
#include "report/metrics.h"
#include "report/rows.h"

static double mean_seconds(const evaluation *e)
{
    double sum = 0;
    for (size_t i = 0; i < e->view_count; i++)
        sum += e->views[i].seconds;
    return e->view_count > 0 ? sum / (double)e->view_count : (double)NAN;
}

static void add_speed(text *out, const evaluation *e, const json_t *metrics)
{
    text_add(out, "<div class=\"box card\"><h3>Speed</h3><table class=\"facts\"><tbody>\n");
    report_number_row(out, "One training step",
                      metrics_number(json_object_get(metrics, "stage_ms_per_step"), "all"), 1, "ms");
    report_number_row(out, "Rays in training", metrics_number(metrics, "rays_per_second") * 1e-6, 3,
                      "million per second, forward and adjoint");
    report_number_row(out, "Gaussians met per ray", metrics_number(metrics, "hits_per_ray"), 1, "");
    report_number_row(out, "Gaussians blended per ray", metrics_number(metrics, "blended_per_ray"), 1, "");
    report_number_row(out, "One held-out view", mean_seconds(e), 3, "s: decode, tree and trace");
    report_count_row(out, "Steps skipped", metrics_number(metrics, "skipped_steps"));
    report_bytes_row(out, "Peak memory", metrics_number(metrics, "peak_memory_bytes"));
    text_add(out, "</tbody></table></div>\n");
}

static void add_machine(text *out, const json_t *metrics)
{
    text_add(out, "<div class=\"box card\"><h3>The machine</h3><table class=\"facts\"><tbody>\n");
    report_text_row(out, "Processor", metrics_text(metrics, "processor"));
    report_count_row(out, "Threads", metrics_number(metrics, "threads"));
    report_text_row(out, "Instructions", metrics_text(metrics, "isa"));
    report_text_row(out, "Embree", metrics_text(metrics, "embree_version"));
    text_add(out, "</tbody></table></div>\n");
}

/** "50,50,...", the argument of --pace. False, with nothing added, unless it is a complete list of counts. */
static bool add_pace(text *out, const json_t *metrics)
{
    const json_t *pace = json_object_get(metrics, "pace");
    const size_t count = json_array_size(pace);
    for (size_t i = 0; i < count; i++)
        if (!json_is_integer(json_array_get(pace, i)))
            return false;
    for (size_t i = 0; i < count; i++)
        text_format(out, "%s%" JSON_INTEGER_FORMAT, i > 0 ? "," : "",
                    json_integer_value(json_array_get(pace, i)));
    return count > 0;
}

static void add_counts(text *out, const evaluation *e, const json_t *metrics)
{
    const double bytes = e->model_bytes > 0 ? (double)e->model_bytes : (double)NAN;
    text_add(out, "<div class=\"box card\"><h3>From points to a model</h3><table class=\"facts\"><tbody>\n");
    report_text_row(out, "Started from", metrics_text(metrics, "start"));
    report_count_row(out, "Anchors at the start", metrics_number(metrics, "anchors_initial"));
    report_count_row(out, "Anchors at the end", (double)e->anchors);
    report_count_row(out, "Gaussians per view", e->gaussians_per_view);
    report_bytes_row(out, "Model file", bytes);
    report_number_row(out, "Bytes per anchor", e->anchors > 0 ? bytes / (double)e->anchors : (double)NAN, 1,
                      "");
    text_add(
        out,
        "</tbody></table></div>\n<div class=\"box card\"><h3>The run</h3><table class=\"facts\"><tbody>\n");
    report_count_row(out, "Iterations", metrics_number(metrics, "iterations"));
    report_open_row(out, "Training time");
    text_duration(out, metrics_number(metrics, "train_seconds"));
    report_close_row(out);
    const double downscale = metrics_number(metrics, "downscale");
    if (downscale != 1)
        report_number_row(out, "Photos made smaller by a factor of", downscale,
                          downscale == floor(downscale) ? 0 : 3, "");
    report_text_row(out, "Held-out split", metrics_text(metrics, "eval_split"));
    report_count_row(out, "Held-out views", (double)e->view_count);
    if (metrics_text(metrics, "seed") != NULL) /* saved as text because it exceeds JSON's integers */
        report_text_row(out, "Seed", metrics_text(metrics, "seed"));
    else
        report_number_row(out, "Seed", metrics_number(metrics, "seed"), 0, "");
    report_open_row(out, "Pace: steps in each twentieth");
    if (!add_pace(out, metrics))
        text_add(out, "n/a");
    report_close_row(out);
    text_add(out, "</tbody></table></div>\n");
}

/** Lines "key = value" as table rows. */
static void add_settings(text *out, const char *settings)
{
    text_add(out, "<details class=\"card\"><summary>All settings</summary><table class=\"facts\"><tbody>\n");
    while (*settings != '\0') {
        char line[1200];
        const size_t length = strcspn(settings, "\n");
        snprintf(line, sizeof line, "%.*s", (int)(length < sizeof line ? length : sizeof line - 1), settings);
        settings += length + (settings[length] == '\n');
        char *equals = strstr(line, " = ");
        if (equals == NULL)
            continue;
        *equals = '\0';
        text_add(out, "<tr><th>");
        text_escaped(out, line);
        text_add(out, "</th><td>");
        text_escaped(out, equals + 3);
        report_close_row(out);
    }
    text_add(out, "</tbody></table></details>\n");
}

void report_facts(text *out, const evaluation *e, const json_t *metrics, const char *settings)
{
    text_add(out, "<section id=\"facts\"><h2>Facts</h2>\n<div class=\"grid2\">\n");
    add_counts(out, e, metrics);
    add_speed(out, e, metrics);
    add_machine(out, metrics);
    text_add(out, "</div>\n");
    if (settings != NULL)
        add_settings(out, settings);
    text_add(out, "</section>\n");
}

void report_again(text *out, const char *run, const json_t *metrics)
{
    const char *command = metrics_text(metrics, "command");
    const bool resumed = command != NULL && strstr(command, " --resume") != NULL;
    char config[4096], word[8192];
    snprintf(config, sizeof config, "%s/config", run);
    text_add(out, "</main>\n<footer id=\"again\">\n<h2>Make it again</h2>\n");
    if (file_exists(config)) { /* imported models have no config file */
        text_add(
            out,
            "<p>A time budget decides only how many steps there are. With the pace that this run "
            "recorded, the same photos give the same model, bit for bit, on any number of threads:</p>\n<pre "
            "class=\"card\">gbtrace train --config ");
        text_escaped(out, gbt_shell_word(config, word, sizeof word));
        text_add(out, " -o NEW");
        const size_t before = out->length;
        text_add(out, " --pace ");
        if (!add_pace(out, metrics))
            out->length = out->status == GBT_OK ? before : out->length;
        text_add(out, "</pre>\n");
    }
    if (resumed)
        text_add(out, "<p>If the run was given another length when it was resumed, its first steps had the "
                      "schedules of the former length, and this makes another model.</p>\n");
    text_add(out, "<p>The scores, the pictures and this page, from the model (<code>gbtrace "
                  "report</code> makes the page alone):</p>\n<pre class=\"card\">gbtrace eval ");
    text_escaped(out, gbt_shell_word(run, word, sizeof word));
    text_add(
        out,
        "</pre>\n<p>Pictures here are JPEG for size; the scores were made from the PNG files in "
        "<code>renders/test</code>. Every number is in <code>metrics.json</code>, every curve in "
        "<code>log.csv</code>. This page is one file and loads nothing.</p>\n<p>Made by gbtrace " GBT_VERSION
        ".</p>\n</footer>\n");
}
