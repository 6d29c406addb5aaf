/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_query_write.c -- the figures of `bench query` as a table, as CSV and JSON, and as a chart.
 */
#include <jansson.h>
#include <math.h>

#include "base/cpu.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/parallel.h"
#include "benchmark/bench_query.h"
#include "data/json_out.h"
#include "report/plot.h"

enum { PANEL = 330, TOP = 96, HEIGHT = 250, GAP = 100, CHART_K = 8 };

static const char css[] =
    ".plot .join{fill:none;stroke:var(--k);stroke-width:2}\n"
    ".plot .mark{fill:var(--k);stroke:var(--page);stroke-width:1.5}\n"
    ".plot .key.s1,.plot .key.s2,.plot .key.s3,.plot .key.s4,.plot .key.s5{fill:var(--k)}\n";

static const char *const engine_texts[ENGINE_COUNT] = {
    "gbtrace, a batch", "gbtrace, one by one", "FLANN, exact", "FLANN, approximate: 16, 64, 256 checks",
    "brute force"};

/* ---- tables ---- */

static void add_tables(text *out, const query_bench *b)
{
    if (b->check_count > 0) {
        text_add(out, "| kind | queries | answers | other than brute force |\n|---|---|---|---|\n");
        for (size_t i = 0; i < b->check_count; i++)
            text_format(out, "| %s | %zu | %zu | %zu |\n", b->check[i].kind, b->check[i].queries,
                        b->check[i].answers, b->check[i].wrong);
        text_add(out, "\n");
    }
    text_add(out, "| cloud | points | engine | build, s | k = 1, us | right, % | k = 8, us | right, % |\n"
                  "|---|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < b->row_count; i++) {
        const query_row *one = &b->row[i], *eight = NULL;
        for (size_t n = i; n < b->row_count && one->k == 1 && eight == NULL; n++)
            if (b->row[n].k == 8 && b->row[n].engine == one->engine && b->row[n].checks == one->checks &&
                b->row[n].points == one->points && b->row[n].cloud == one->cloud)
                eight = &b->row[n];
        if (eight == NULL)
            continue;
        text_format(out, "| %s | %zu | %s", query_cloud_names[one->cloud], one->points,
                    query_engine_name(one->engine));
        if (one->checks > 0)
            text_format(out, " %d", one->checks);
        text_format(out, " | %.3f | %.3f | %.2f | %.3f | %.2f |\n", one->build_seconds, one->us,
                    100 * one->right, eight->us, 100 * eight->right);
    }
}

static void add_csv(text *out, const query_bench *b)
{
    text_add(out, "cloud,points,engine,checks,k,build_core_seconds,core_us_per_query,share_right,"
                  "bytes_per_point\n");
    for (size_t i = 0; i < b->row_count; i++) {
        const query_row *r = &b->row[i];
        text_format(out, "%s,%zu,%s,%d,%zu,%.6g,%.6g,%.6g,", query_cloud_names[r->cloud], r->points,
                    query_engine_name(r->engine), r->checks, r->k, r->build_seconds, r->us, r->right);
        if (isfinite(r->bytes))
            text_format(out, "%.3f", r->bytes);
        text_add(out, "\n");
    }
}

static gbt_status write_json(const query_bench *b, const char *folder, gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, folder, "query.json", err));
    json_t *rows = json_array(), *checks = json_array();
    for (size_t i = 0; i < b->row_count; i++) {
        const query_row *r = &b->row[i];
        json_array_append_new(rows, json_pack("{s:s,s:I,s:s,s:i,s:I,s:f,s:f,s:f,s:o}", "cloud",
                                              query_cloud_names[r->cloud], "points", (json_int_t)r->points,
                                              "engine", query_engine_name(r->engine), "checks", r->checks,
                                              "k", (json_int_t)r->k, "build_core_seconds", r->build_seconds,
                                              "core_us_per_query", r->us, "share_right", r->right,
                                              "bytes_per_point", json_number(r->bytes)));
    }
    for (size_t i = 0; i < b->check_count; i++) {
        const query_check *c = &b->check[i];
        json_array_append_new(checks, json_pack("{s:s,s:i,s:I,s:b,s:I}", "row", c->kind, "limit", 0, "value",
                                                (json_int_t)c->wrong, "pass", c->wrong == 0, "queries",
                                                (json_int_t)c->queries));
    }
    json_t *root = json_pack("{s:i,s:s,s:s,s:i,s:I,s:o,s:o}", "schema", 1, "bench", "query", "isa",
                             cpu_isa_name(cpu_best_isa()), "threads", parallel_threads(), "queries",
                             (json_int_t)b->def->queries, "rows", rows, "checks", checks);
    const gbt_status status = json_save(root, path, err);
    json_decref(root);
    return status;
}

/* ---- chart: above time against size, below what is right against time on the largest clouds ---- */

/* The largest cloud that every engine was asked about. */
static size_t accuracy_points(const query_bench *b)
{
    const size_t largest = b->row[b->row_count - 1].points;
    return largest < QUERY_APPROXIMATE_MAX ? largest : QUERY_APPROXIMATE_MAX;
}

static bool in_panel(const query_bench *b, const query_row *r, int cloud, bool accuracy)
{
    if (r->cloud != cloud || r->k != CHART_K)
        return false;
    if (accuracy)
        return r->points == accuracy_points(b) && r->engine != ENGINE_BRUTE;
    return r->engine != ENGINE_APPROXIMATE || r->checks == 64;
}

static void draw_panel(text *out, const query_bench *b, int cloud, bool accuracy)
{
    const int left = 54 + cloud * PANEL, top = accuracy ? TOP + HEIGHT + GAP : TOP;
    plot p = {.left = left,
              .right = left + PANEL - 76,
              .top = top,
              .bottom = top + HEIGHT,
              .x = {.label = accuracy ? "core-microseconds per query" : "points", .log = true, .wanted = 5},
              .y = {.label = accuracy ? "right neighbours, %" : "core-microseconds per query",
                    .log = !accuracy,
                    .from_ticks = true,
                    .grid = true,
                    .wanted = 5}};
    plot_clear(&p);
    for (size_t i = 0; i < b->row_count; i++)
        if (in_panel(b, &b->row[i], cloud, accuracy))
            plot_take(&p, accuracy ? b->row[i].us : (double)b->row[i].points,
                      accuracy ? 100 * b->row[i].right : b->row[i].us);
    if (!plot_close(&p))
        return;
    text_format(out, "<text class=\"title\" x=\"%d\" y=\"%d\">%s", left, top - 30, query_cloud_names[cloud]);
    if (accuracy)
        text_format(out, ", %zu points", accuracy_points(b));
    text_add(out, "</text>");
    plot_draw_axes(out, &p);
    for (int e = 0; e < ENGINE_COUNT; e++) {
        bool open = false;
        text_format(out, "<g class=\"s%d\"><path class=\"join\" d=\"", e + 1);
        for (size_t i = 0; i < b->row_count; i++)
            if ((int)b->row[i].engine == e && in_panel(b, &b->row[i], cloud, accuracy))
                plot_line_to(out, &p, &open, accuracy ? b->row[i].us : (double)b->row[i].points,
                             accuracy ? 100 * b->row[i].right : b->row[i].us);
        if (!open)
            plot_line_to(out, &p, &open, p.x.low, p.y.high);
        text_add(out, "\"/>");
        for (size_t i = 0; i < b->row_count; i++)
            if ((int)b->row[i].engine == e && in_panel(b, &b->row[i], cloud, accuracy))
                text_format(out, "<circle class=\"mark\" cx=\"%.1f\" cy=\"%.1f\" r=\"4\"/>",
                            plot_x(&p, accuracy ? b->row[i].us : (double)b->row[i].points),
                            plot_y(&p, accuracy ? 100 * b->row[i].right : b->row[i].us));
        text_add(out, "</g>");
    }
}

static void add_chart(text *out, const query_bench *b)
{
    plot_begin(out, "nearest neighbours: time and accuracy", css, "", 3 * PANEL, TOP + 2 * HEIGHT + GAP + 56,
               false);
    text_format(out,
                "<text class=\"title\" x=\"16\" y=\"28\">8 nearest neighbours of %llu queries: time against "
                "size, and accuracy against time</text>",
                (unsigned long long)b->def->queries);
    int at = 16;
    for (int e = 0; e < ENGINE_COUNT; e++) {
        text_format(out, "<text class=\"key s%d\" x=\"%d\" y=\"48\">&#9679; %s%s</text>", e + 1, at,
                    engine_texts[e], e == ENGINE_APPROXIMATE ? " (above: 64)" : "");
        at += e == ENGINE_APPROXIMATE ? 350 : 150;
    }
    for (int cloud = 0; cloud < QUERY_CLOUDS; cloud++)
        for (int accuracy = 0; accuracy < 2; accuracy++)
            draw_panel(out, b, cloud, accuracy == 1);
    text_add(out, "</svg>\n");
}

gbt_status query_bench_write(const query_bench *b, const char *folder, FILE *out, gbt_error *err)
{
    if (folder != NULL) {
        text csv = {.err = err}, svg = {.err = err};
        GBT_TRY(file_make_folder(folder, err));
        add_csv(&csv, b);
        GBT_TRY(text_save(&csv, folder, "query.csv"));
        add_chart(&svg, b);
        GBT_TRY(text_save(&svg, folder, "query.svg"));
        GBT_TRY(write_json(b, folder, err));
    }
    text tables = {.err = err};
    add_tables(&tables, b);
    return text_print(&tables, out);
}
