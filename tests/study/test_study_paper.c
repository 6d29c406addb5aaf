/* SPDX-License-Identifier: Apache-2.0 */
/* tests/study/test_study_paper.c -- the studies that train: statistics, the paper's numbers, runs made once,
   figures that are those of the runs. */
#include "train/run_support.h"

#include "base/near.h"
#include "data/json_fields.h"
#include "eval/lpips.h"
#include "eval/lpips_network.h"
#include "io/model_file.h"
#include "study/paper.h"
#include "study/anchors.h"
#include "study/time.h"
#include "gbtrace/evaluate.h"
#include "gbtrace/export.h"

/* ---- numbers ---- */

static void mean_and_spread(void **state)
{
    (void)state;
    const stat_sample s = stat_of((const double[]){1, NAN, 2, 6}, 4), one = stat_of((const double[]){5}, 1),
                      none = stat_of((const double[]){NAN}, 1);
    assert_int_equal(s.count, 3);
    assert_near(s.mean, 3, 1e-15);
    assert_near(s.deviation, sqrt(7), 1e-15); /* (4 + 1 + 9) / 2 */
    assert_near(stat_half_width(&s), 4.303 * sqrt(7 / 3.0), 1e-12);
    assert_true(one.count == 1 && one.mean == 5 && isnan(one.deviation) && isnan(stat_half_width(&one)));
    assert_true(none.count == 0 && isnan(none.mean));
    assert_true(stat_is_apart(&s, 3 + 6.58) && !stat_is_apart(&s, 3 - 6.57) && !stat_is_apart(&one, 100) &&
                !stat_is_apart(&none, 0));
    const double ten[10] = {0, 1, 0, 1, 0, 1, 0, 1, 0, 1};
    const stat_sample many = stat_of(ten, 10);
    assert_near(stat_half_width(&many), 2.262 * sqrt(2.5 / 9) / sqrt(10), 1e-12);
    const stat_sample same = stat_of((const double[]){2, 2}, 2);
    assert_true(stat_is_apart(&same, 2.001) && !stat_is_apart(&same, 2));
}

static void figures_as_text(void **state)
{
    (void)state;
    const struct {
        double values[3];
        size_t count;
        int decimals;
        bool is_change;
        const char *wanted;
    } cases[] = {{{1, 2, 3}, 3, 2, false, "2.00 ± 1.00"},
                 {{1, 2, 3}, 3, 1, true, "+2.0 ± 1.0"},
                 {{7}, 1, 0, false, "7"},
                 {{NAN}, 1, 1, true, "n/a"},
                 {{-0.04}, 1, 1, true, "0.0"},
                 {{-0.06}, 1, 1, true, "-0.1"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        text out = {0};
        const stat_sample s = stat_of(cases[i].values, cases[i].count);
        stat_add(&out, &s, cases[i].decimals, cases[i].is_change);
        assert_int_equal(out.length, strlen(cases[i].wanted));
        assert_memory_equal(out.bytes, cases[i].wanted, out.length);
        text_free(&out);
    }
    /* 95 %: 4.3 standard deviations of the mean of three, 12.7 of two. */
    const struct {
        double values[3];
        size_t count;
        const char *wanted;
    } judged[] = {{{-2.4, -2, -2.2}, 3, "**-2.2 ± 0.2**"},
                  {{-3, -1, -2}, 3, "-2.0 ± 1.0"},
                  {{-2.4, -2}, 2, "-2.2 ± 0.3"},
                  {{-2}, 1, "-2.0"},
                  {{0, 0}, 2, "0.0 ± 0.0"}};
    for (size_t i = 0; i < sizeof judged / sizeof *judged; i++) {
        text out = {0};
        const stat_sample s = stat_of(judged[i].values, judged[i].count);
        stat_add_judged(&out, &s, 1);
        assert_int_equal(out.length, strlen(judged[i].wanted));
        assert_memory_equal(out.bytes, judged[i].wanted, out.length);
        text_free(&out);
    }
}

/* Halves of halves, counted one by one. */
static double count_balls(size_t points, int depth)
{
    return points <= 2 || depth == 0
               ? points > 0
               : count_balls(points / 2, depth - 1) + count_balls(points - points / 2, depth - 1);
}

static void closed_form_of_balls(void **state)
{
    (void)state;
    const struct {
        double points;
        int depth;
        double balls;
    } known[] = {{54275, 18, 32768}, {32049, 18, 16384}, {80861, 18, 48093}, {80861, 10, 1024},
                 {80861, 12, 4096},  {0, 18, 0},         {1, 18, 1},         {2, 18, 1},
                 {3, 18, 2},         {3, 0, 1},          {1e6, 18, 262144}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        assert_near(paper_ball_count(known[i].points, known[i].depth), known[i].balls, 0);
    for (size_t points = 0; points < 700; points++)
        for (int depth = 0; depth < 12; depth++)
            assert_near(paper_ball_count((double)points, depth), count_balls(points, depth), 0);
}

/* Two pairs of points: two small balls far apart, so that the spacing is all that counts: (1 + 1/4) / 2 of
   it. */
static void constant_of_pairs(void **state)
{
    (void)state;
    static const char ply[] = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float "
                              "y\nproperty float z\nend_header\n0 0 0\n.01 0 0\n.1 0 0\n.12 0 0\n";
    const char *path = in_folder("pairs.ply");
    assert_ok(file_write_atomic(path, ply, sizeof ply - 1, NULL));
    paper_scene look;
    assert_ok(paper_scene_look(path, 0, &look, NULL));
    assert_int_equal(look.tree_depth, 1);
    assert_near(look.scale_constant, 0.625, 1e-6);
    assert_ok(paper_scene_look(path, 1, &look, NULL)); /* all is one compact ball then */
    assert_int_equal(look.tree_depth, 0);
}

static void what_the_paper_says(void **state)
{
    (void)state;
    const struct {
        paper_claim claim;
        double wanted, near, low, high;
    } cases[] = {{{1, "", PAPER_GBSP, PAPER_VOXEL, PAPER_INITIAL}, -37.1, 0.05, -42.6, -30.0},
                 {{1, "", PAPER_GBSP, PAPER_VOXEL, PAPER_FINAL}, -10.0, 0.05, -12.0, -8.0},
                 {{1, "", PAPER_GBSP, PAPER_VOXEL, PAPER_STORAGE}, -9.8, 0.05, -11.9, -7.9},
                 {{2, "", PAPER_GBSP, PAPER_VOXEL, PAPER_FINAL}, -12.0, 0.05, -22.7, -5.4},
                 {{2, "", PAPER_GBAI, PAPER_VOXEL, PAPER_PSNR}, 0.071, 0.002, -0.376, 0.576},
                 {{3, "", PAPER_GBSP, PAPER_VOXEL, PAPER_ARITHMETIC}, -15.9, 0.05, -29.6, -5.0},
                 {{4, "", PAPER_DEPTH_10, PAPER_GBSP, PAPER_FINAL}, 1.9, 0.05, 1.9, 1.9}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double range[2];
        assert_near(paper_published(&cases[i].claim), cases[i].wanted, cases[i].near);
        assert_true(paper_published_range(&cases[i].claim, range));
        assert_near(range[0], cases[i].low, 0.06);
        assert_near(range[1], cases[i].high, 0.06);
    }
    double range[2];
    assert_true(isnan(paper_published(&(paper_claim){2, "", PAPER_GBAI_SCALED, PAPER_GBAI, PAPER_FINAL})));
    assert_false(paper_published_range(&(paper_claim){3, "", PAPER_GBSP, PAPER_VOXEL, PAPER_INITIAL}, range));
}

static void verdicts(void **state)
{
    (void)state;
    const struct {
        double ours[3];
        size_t count;
        double paper;
        const char *wanted;
    } cases[] = {{{-9, -10, -11}, 3, -10, "agrees with the paper"},
                 {{-11.9, -12, -12}, 3, -10, "within the range of the paper's scenes"},
                 {{-12.1, -12.1, -12.1}, 3, -10, "the same way as the paper, and more"},
                 {{-3, -3.1, -3.2}, 3, -10, "the same way as the paper, but less"},
                 {{-20, -21, -22}, 3, -10, "the same way as the paper, and more"},
                 {{3, 3.1, 3.2}, 3, -10, "opposite to the paper"},
                 {{-3, 1, 2}, 3, -10, "not told apart from zero, but from the paper"},
                 {{-30, 1, 2}, 3, -10, "told apart neither from zero nor from the paper"},
                 {{-30, 1, 2}, 3, NAN, "not told apart from zero"},
                 {{-3, -3.1, -3.2}, 3, NAN, "lower, beyond the spread"},
                 {{3, 3.1, 3.2}, 3, NAN, "higher, beyond the spread"},
                 {{0, 0, 0}, 3, -10, "none at all"},
                 {{-10}, 1, -10, "one seed says nothing of the spread"},
                 {{NAN}, 1, -10, "not measured"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const stat_sample s = stat_of(cases[i].ours, cases[i].count);
        assert_string_equal(paper_verdict_of(&s, cases[i].paper, (const double[]){-12, -8}), cases[i].wanted);
    }
}

static void when_a_curve_comes_there(void **state)
{
    (void)state;
    const study_figures run = {.mark_count = 2, .marks = {{1, 20}, {4, 22}}, .train_seconds = 16, .psnr = 24};
    assert_near(time_to_reach(&run, 19), 1, 0);
    assert_near(time_to_reach(&run, 21), 2, 1e-12); /* half way, over log seconds */
    assert_near(time_to_reach(&run, 22), 4, 1e-12);
    assert_near(time_to_reach(&run, 23), 8, 1e-12);
    assert_near(time_to_reach(&run, 24), 16, 1e-12);
    assert_true(isnan(time_to_reach(&run, 24.01)) && isnan(time_to_reach(&run, NAN)));
    assert_near(time_to_reach(&(study_figures){.train_seconds = 5, .psnr = 9}, 9), 5, 0);
}

static void names_and_folders(void **state)
{
    (void)state;
    char names[STUDY_SCENES_MAX][STUDY_NAME_SIZE], path[PATH_SIZE];
    gbt_error err = {0};
    make_tiny_scene(in_folder("other/tiny"));
    const char *same[] = {tiny, in_folder("other/tiny")}, *missing[] = {in_folder("nowhere")},
               *dotted[] = {in_folder("tiny/../other/./tiny/")};
    assert_int_equal(study_runs_names(same, 2, names, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "two data sets are called tiny"));
    assert_int_equal(study_runs_names(missing, 1, names, NULL), GBT_ERR_IO);
    assert_int_equal(study_runs_names(same, 0, names, NULL), GBT_ERR_ARGUMENT);
    assert_ok(study_runs_names(dotted, 1, names, NULL));
    assert_string_equal(names[0], "tiny");
    assert_ok(study_runs_folder("d", "a b/../c.1", "K = 10", 3, path, sizeof path, NULL));
    assert_string_equal(path, "d/runs/a-b-..-c.1/K---10/seed-3");
    assert_int_equal(study_runs_folder("d", "a", "b", 3, path, 10, NULL), GBT_ERR_ARGUMENT);
}

/* ---- whole studies ---- */

enum { SEEDS = 2 };

static lab_runs_def small_paper(const char *const *data, const char *tables)
{
    lab_runs_def def = lab_runs_def_default();
    def.data = data;
    def.data_count = 1;
    def.iterations = 40;
    def.seeds = SEEDS;
    def.tables = tables;
    return def;
}

static void paper_ok(const lab_runs_def *def, const char *folder)
{
    gbt_error err = {0};
    FILE *out = tmpfile();
    if (lab_study_paper(def, folder, out, &err) != GBT_OK)
        fail_msg("%s", err.text);
    fclose(out);
}

/* A file as a zero-terminated text; mem_free(). */
static char *read_text(const char *path) { return (char *)read_bytes(path).data; }

static size_t count_of(const char *where, const char *what)
{
    size_t count = 0;
    for (; (where = strstr(where, what)) != NULL; where++)
        count++;
    return count;
}

static double number_of(const char *run, const char *file, const char *field)
{
    json_t *whole;
    char path[2 * PATH_SIZE];
    snprintf(path, sizeof path, "%s/%s", run, file);
    assert_ok(json_read(path, &whole, NULL));
    const double value = json_number_value(json_object_get(whole, field));
    json_decref(whole);
    return value;
}

static double metric_of(const char *run, const char *field) { return number_of(run, "metrics.json", field); }

static struct timespec time_of(const char *run)
{
    struct stat info;
    char path[2 * PATH_SIZE];
    snprintf(path, sizeof path, "%s/model.gbt", run);
    if (stat(path, &info) != 0)
        fail_msg("%s is not there", path);
    return info.st_mtim;
}

static bool is_newer(struct timespec a, struct timespec b)
{
    return a.tv_sec > b.tv_sec || (a.tv_sec == b.tv_sec && a.tv_nsec > b.tv_nsec);
}

static double mean_in(const char *folder, const char *variant, const char *file, const char *field)
{
    double sum = 0;
    for (int seed = 0; seed < SEEDS; seed++)
        sum += number_of(in_folder("%s/runs/tiny/%s/seed-%d", folder, variant, seed), file, field) / SEEDS;
    return sum;
}

static double mean_over_seeds(const char *folder, const char *variant, const char *field)
{
    return mean_in(folder, variant, "metrics.json", field);
}

static double figure_of(const json_t *run, const char *name)
{
    return json_number_value(json_object_get(json_object_get(run, name), "mean"));
}

/* The figures of every variant are what the runs' own files say. */
static void check_figures(const char *folder, const json_t *figures)
{
    static const char *const fields[][2] = {{"initial anchors", "anchors_initial"},
                                            {"final anchors", "anchors_final"},
                                            {"PSNR", "psnr"},
                                            {"SSIM", "ssim"}};
    assert_int_equal(json_array_size(figures), 5);
    for (size_t i = 0; i < 5; i++) {
        const json_t *row = json_array_get(figures, i);
        const char *name = json_string_value(json_object_get(row, "variant"));
        for (size_t f = 0; f < sizeof fields / sizeof *fields; f++)
            assert_near(figure_of(row, fields[f][0]), mean_over_seeds(folder, name, fields[f][1]), 1e-9);
        const double final = figure_of(row, "final anchors"),
                     in_view = mean_in(folder, name, "study.json", "anchors_in_view");
        assert_near(figure_of(row, "model.gbt"), mean_over_seeds(folder, name, "model_bytes") / 1048576,
                    1e-9);
        assert_near(figure_of(row, "storage"), (316 * final + 4 * 7086) / 1048576, 1e-9);
        assert_true(in_view > 0 && in_view <= final);                       /* some of all */
        assert_near(figure_of(row, "arithmetic"), 6880e-9 * in_view, 1e-9); /* K = 10, no distance */
    }
    assert_string_equal(json_string_value(json_object_get(json_array_get(figures, 0), "variant")), "voxel");
}

static const json_t *row_of(const json_t *whole, const char *name)
{
    size_t i;
    json_t *row;
    json_array_foreach(json_object_get(whole, "rows"), i, row)
    {
        const char *is = json_string_value(json_object_get(row, "row"));
        if (is != NULL && strcmp(is, name) == 0)
            return row;
    }
    fail_msg("no row %s", name);
    return NULL;
}

static void check_json(const char *folder)
{
    json_t *whole;
    assert_ok(json_read(in_folder("%s/paper.json", folder), &whole, NULL));
    const json_t *counts = row_of(whole, "tiny: initial anchors at D_max 18 against the closed form"),
                 *change = row_of(whole, "table 1, tiny: balls in place of voxels: change of PSNR, dB");
    assert_true(json_is_true(json_object_get(counts, "pass")));
    assert_near(json_number_value(json_object_get(counts, "limit")), 0.015, 0);
    assert_true(json_is_null(json_object_get(change, "limit")) &&
                json_is_null(json_object_get(change, "pass")));
    assert_near(json_number_value(json_object_get(change, "value")),
                mean_over_seeds(folder, "gbai-gbsp", "psnr") - mean_over_seeds(folder, "voxel", "psnr"),
                1e-6);
    assert_near(json_number_value(json_object_get(change, "paper")), -0.071, 0.001);
    check_figures(folder, json_object_get(whole, "figures"));
    json_decref(whole);
}

static void check_page(const char *folder)
{
    char *page = read_text(in_folder("%s/paper.md", folder)),
         *svg = read_text(in_folder("%s/paper.svg", folder)), cell[160];
    assert_true(count_of(page, "\n## ") == 2 && strstr(page, "\n## 1. ") != NULL &&
                strstr(page, "\n## 2. ") != NULL);
    snprintf(cell, sizeof cell, "| tiny | %.0f | GBAI | %.0f ± ",
             metric_of(in_folder("%s/runs/tiny/gbai/seed-0", folder), "points"),
             mean_over_seeds(folder, "gbai", "anchors_initial"));
    assert_int_equal(count_of(page, cell), 1);
    assert_int_equal(count_of(page, "| balls in place of voxels | initial anchors, % |"), 1);
    assert_int_equal(count_of(page, "| -37.1 | -42.6 to -30.0 |"), 1);
    assert_int_equal(count_of(svg, "<circle class=\"seed"), 5 * SEEDS * 2);
    assert_int_equal(count_of(svg, "<circle class=\"mark"), 5 * 2);
    assert_true(strstr(svg, "nan") == NULL && strstr(page, "nan") == NULL);
    mem_free(page);
    mem_free(svg);
}

static void the_papers_tables(void **state)
{
    (void)state;
    const char *data[] = {tiny};
    const lab_runs_def def = small_paper(data, "1,2");
    paper_ok(&def, in_folder("paper"));
    check_json("paper");
    check_page("paper");
    assert_false(file_exists(in_folder("paper/runs/tiny/voxel/seed-0/checkpoints")));
    assert_false(file_exists(in_folder("paper/runs/tiny/gbai-gbsp-depth-10")));

    /* The control has the constant that the study names. */
    json_t *whole;
    char wanted[64];
    assert_ok(json_read(in_folder("paper/paper.json"), &whole, NULL));
    const double constant = json_number_value(
        json_object_get(json_array_get(json_object_get(whole, "scenes"), 0), "scale_constant"));
    json_decref(whole);
    assert_true(constant > 0.2 && constant < 1);
    char *config = read_text(in_folder("paper/runs/tiny/gbai-scaled/seed-1/config"));
    const char *line = strstr(config, "scale-factor = ");
    snprintf(wanted, sizeof wanted, "%.9g", constant);
    assert_true(line != NULL && fabs(strtod(line + 15, NULL) - constant) < 1e-9 &&
                strstr(config, "compat = 1") != NULL);
    mem_free(config);
}

/* After the_papers_tables(): runs that are there are scored again, not trained. */
static void lpips_of_finished_runs(void **state)
{
    (void)state;
    const char *data[] = {tiny};
    lab_runs_def def = small_paper(data, "1,2");
    network alex = make_alex();
    write_network(&alex, in_folder("alex.safetensors"), NULL);
    free_network(&alex);
    char *before = read_text(in_folder("paper/paper.json")), *page;
    assert_null(strstr(before, "\"LPIPS\""));
    const struct timespec made = time_of(in_folder("paper/runs/tiny/voxel/seed-0"));
    def.lpips = in_folder("alex.safetensors");
    paper_ok(&def, in_folder("paper"));
    const struct timespec now = time_of(in_folder("paper/runs/tiny/voxel/seed-0"));
    assert_true(!is_newer(now, made));
    const double score = mean_over_seeds("paper", "voxel", "lpips_01");
    assert_true(score > 0 && score < 10 && score != mean_over_seeds("paper", "voxel", "lpips"));
    page = read_text(in_folder("paper/paper.md"));
    assert_int_equal(count_of(page, " SSIM | LPIPS |\n"), 2);
    assert_int_equal(count_of(page, "| balls in place of voxels | LPIPS |"), 1);
    assert_int_equal(count_of(page, "| +0.0048 | +0.0010 to +0.0090 |"), 1); /* the paper's own four */
    mem_free(page);

    /* A result folder of 3DGS has it too. */
    gbt_export_def export = gbt_export_def_default();
    const char *result[] = {in_folder("result/")};
    json_t *means, *values;
    export.refine_steps = 0;
    export.lpips = def.lpips;
    assert_ok(gbt_export(in_folder("paper/runs/tiny/voxel/seed-0"), &export, result, 1, NULL, NULL));
    assert_ok(json_read(in_folder("result/results.json"), &means, NULL));
    assert_ok(json_read(in_folder("result/per_view.json"), &values, NULL));
    const json_t *ours = json_object_get(means, "ours_40"),
                 *each = json_object_get(json_object_get(values, "ours_40"), "LPIPS");
    const double first = json_number_value(json_object_get(each, "00000.png")),
                 second = json_number_value(json_object_get(each, "00001.png"));
    assert_true(json_object_size(each) == 2 && first > 0 && second > 0);
    assert_near(json_number_value(json_object_get(ours, "LPIPS")), (first + second) / 2, 1e-9);
    json_decref(means);
    json_decref(values);
    const char *file[] = {in_folder("scene.ply")};
    assert_int_equal(gbt_export(in_folder("paper/runs/tiny/voxel/seed-0"), &export, file, 1, NULL, NULL),
                     GBT_ERR_ARGUMENT);

    def.lpips = NULL; /* no column, and the scores of before */
    paper_ok(&def, in_folder("paper"));
    page = read_text(in_folder("paper/paper.json"));
    assert_string_equal(page, before);
    mem_free(before);
    mem_free(page);
}

/* After the_papers_tables(): what is there is taken, what is damaged, missing or of other settings is made
   again, to the same bits. */
static void runs_are_made_once(void **state)
{
    (void)state;
    static const char *const variants[] = {"voxel", "gbai", "gbai-gbsp", "voxel-scaled", "gbai-scaled"};
    enum { VARIANTS = sizeof variants / sizeof *variants };
    const char *data[] = {tiny};
    struct timespec before[VARIANTS][SEEDS];
    for (int v = 0; v < VARIANTS; v++)
        for (int seed = 0; seed < SEEDS; seed++)
            before[v][seed] = time_of(in_folder("paper/runs/tiny/%s/seed-%d", variants[v], seed));
    file_bytes metrics = read_bytes(in_folder("paper/runs/tiny/gbai/seed-1/metrics.json"));
    assert_ok(file_write_atomic(in_folder("paper/runs/tiny/gbai/seed-1/metrics.json"), metrics.data,
                                metrics.count / 2, NULL)); /* damaged */
    /* interrupted */
    assert_int_equal(unlink(in_folder("paper/runs/tiny/voxel-scaled/seed-0/study.json")), 0);
    /* and a table more */
    const lab_runs_def def = small_paper(data, "1,2,4");
    paper_ok(&def, in_folder("paper"));
    for (int v = 0; v < VARIANTS; v++)
        for (int seed = 0; seed < SEEDS; seed++) {
            const bool again = (v == 1 && seed == 1) || (v == 3 && seed == 0);
            assert_int_equal(is_newer(time_of(in_folder("paper/runs/tiny/%s/seed-%d", variants[v], seed)),
                                      before[v][seed]),
                             again);
        }
    assert_false(file_exists(in_folder("paper/runs/tiny/gbai-gbsp-depth-14"))); /* 150 points end at depth 7:
                                                                                 the runs are those of D_max
                                                                                 18 */
    char *page = read_text(in_folder("paper/paper.md"));
    assert_int_equal(count_of(page, "| D_max 14 in place of 18 | final anchors, % | 0.0 ± 0.0 | 0.0 ± "
                                    "0.0 | -6.0 |  | none at all |"),
                     1);
    mem_free(page);
    mem_free(metrics.data);

    lab_runs_def other = small_paper(data, "1"); /* other settings */
    other.iterations++;
    other.seeds = 1;
    paper_ok(&other, in_folder("paper"));
    assert_true(is_newer(time_of(in_folder("paper/runs/tiny/voxel/seed-0")), before[0][0]));
    assert_false(is_newer(time_of(in_folder("paper/runs/tiny/voxel/seed-1")), before[0][1]));
    assert_near(metric_of(in_folder("paper/runs/tiny/voxel/seed-0"), "iterations"), 41, 0);

    const double finer = metric_of(in_folder("paper/runs/tiny/voxel/seed-0"), "anchors_initial");
    other.voxel_size = 1;
    paper_ok(&other, in_folder("paper"));
    assert_true(metric_of(in_folder("paper/runs/tiny/voxel/seed-0"), "anchors_initial") < finer);

    /* By another path it is the same data set; the same path from another folder is another one. */
    char slash[PATH_SIZE + 1], here[4096];
    snprintf(slash, sizeof slash, "%s/", tiny);
    const struct timespec made = time_of(in_folder("paper/runs/tiny/voxel/seed-0"));
    data[0] = slash;
    paper_ok(&other, in_folder("paper"));
    data[0] = "tiny";
    assert_non_null(getcwd(here, sizeof here));
    assert_int_equal(chdir(test_folder), 0);
    paper_ok(&other, in_folder("paper"));
    assert_false(is_newer(time_of(in_folder("paper/runs/tiny/voxel/seed-0")), made));
    assert_int_equal(chdir(in_folder("other")), 0);
    paper_ok(&other, in_folder("paper"));
    assert_int_equal(chdir(here), 0);
    assert_true(is_newer(time_of(in_folder("paper/runs/tiny/voxel/seed-0")), made));
}

/* Its settings are saved as JSON, which has no such bytes. */
static void data_named_in_latin_1(void **state)
{
    (void)state;
    const gbt_train_def def = run_def();
    study_figures figures;
    make_tiny_scene(in_folder("l\xe4nge"));
    assert_ok(
        study_runs_do(in_folder("l\xe4nge"), in_folder("latin"), &def, NULL, &figures, &assert_ok_err_));
    const struct timespec made = time_of(in_folder("latin"));
    assert_ok(
        study_runs_do(in_folder("l\xe4nge"), in_folder("latin"), &def, NULL, &figures, &assert_ok_err_));
    assert_false(is_newer(time_of(in_folder("latin")), made));
}

static void bad_requests(void **state)
{
    (void)state;
    const char *data[] = {tiny};
    static const char *const lists[] = {"", "0", "5", "1,1", "1,", ",1", "12", "1 2"};
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
        const lab_runs_def def = small_paper(data, lists[i]);
        assert_int_equal(lab_study_paper(&def, in_folder("bad"), stdout, NULL), GBT_ERR_ARGUMENT);
    }
    lab_runs_def paper = small_paper(data, "1");
    paper.seeds = -1;
    assert_int_equal(lab_study_paper(&paper, in_folder("bad"), stdout, NULL), GBT_ERR_ARGUMENT);
    paper.seeds = 1;
    paper.iterations = 19;
    assert_int_equal(lab_study_paper(&paper, in_folder("bad"), stdout, NULL), GBT_ERR_ARGUMENT);
    lab_runs_def time = lab_runs_def_default();
    time.data = data;
    time.data_count = 1;
    time.budget_seconds = 0;
    assert_int_equal(lab_study_time(&time, in_folder("bad"), stdout, NULL), GBT_ERR_ARGUMENT);
    time.budget_seconds = 1;
    time.seeds = 11;
    assert_int_equal(lab_study_time(&time, in_folder("bad"), stdout, NULL), GBT_ERR_ARGUMENT);
    gbt_make_scene_def wide = gbt_make_scene_def_default();
    wide.lens = GBT_MAKE_SCENE_FISHEYE;
    wide.width = wide.height = 32;
    wide.view_count = VIEWS;
    wide.samples = 1;
    assert_ok(gbt_make_scene(&wide, in_folder("wide"), &assert_ok_err_));
    const char *with_wide[] = {tiny, in_folder("wide")};
    time.data = with_wide;
    time.data_count = 2;
    time.seeds = 1;
    gbt_error err = {0};
    assert_int_equal(lab_study_time(&time, in_folder("bad"), stdout, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "is not a pinhole's"));
    lab_runs_def needs = lab_runs_def_default();
    needs.data = data;
    needs.data_count = 1;
    needs.iterations = 19;
    assert_int_equal(lab_study_anchors(&needs, in_folder("bad"), stdout, NULL), GBT_ERR_ARGUMENT);
    needs.iterations = 20;
    needs.seeds = 11;
    assert_int_equal(lab_study_anchors(&needs, in_folder("bad"), stdout, NULL), GBT_ERR_ARGUMENT);
    assert_false(file_exists(in_folder("bad")));
}

/* ---- quality against time ---- */

static void time_ok(const char *const *data, const char *folder)
{
    gbt_error err = {0};
    lab_runs_def def = lab_runs_def_default();
    def.data = data;
    def.data_count = 1;
    def.budget_seconds = 0.1;
    FILE *out = tmpfile();
    if (lab_study_time(&def, folder, out, &err) != GBT_OK)
        fail_msg("%s", err.text);
    fclose(out);
}

static void quality_against_time(void **state)
{
    (void)state;
    const char *data[] = {tiny};
    time_ok(data, in_folder("time"));
    json_t *whole;
    assert_ok(json_read(in_folder("time/time.json"), &whole, NULL));
    const json_t *runs = json_object_get(whole, "runs");
    assert_int_equal(json_array_size(runs), time_variant_count);
    /* the seconds, and a change for all but the default */
    assert_int_equal(json_array_size(json_object_get(whole, "rows")), time_variant_count);
    struct timespec before[TIME_VARIANTS_MAX];
    char run[PATH_SIZE];
    for (size_t v = 0; v < time_variant_count; v++) {
        const json_t *psnr = json_object_get(json_array_get(runs, v), "psnr");
        assert_ok(
            study_runs_folder(in_folder("time"), "tiny", time_variants[v].name, 0, run, sizeof run, NULL));
        before[v] = time_of(run);
        assert_near(json_number_value(json_object_get(psnr, "mean")), metric_of(run, "psnr"), 1e-6);
        assert_true(metric_of(run, "train_seconds") >= 0.9 * time_variants[v].budgets * 0.1);
    }
    char *config = read_text(in_folder("time/runs/tiny/faithful-protocol--splats/seed-0/config"));
    assert_non_null(strstr(config, "\ncompat = 1\n"));
    assert_non_null(strstr(config, "\nrenderer = raster\n")); /* as the paper and its reference */
    mem_free(config);
    json_decref(whole);

    char *page = read_text(in_folder("time/time.md")), *svg = read_text(in_folder("time/time.svg"));
    assert_int_equal(count_of(page, "| faithful protocol, splats |"), 2);
    assert_int_equal(count_of(page, "The faithful protocol ends at "), 1);
    assert_true(count_of(svg, ">no growth<") <= 1 && count_of(svg, "no growth") >= 1 &&
                strstr(svg, "nan") == NULL);
    mem_free(svg);
    mem_free(page);
    time_ok(data, in_folder("time"));
    for (size_t v = 0; v < time_variant_count; v++) {
        assert_ok(
            study_runs_folder(in_folder("time"), "tiny", time_variants[v].name, 0, run, sizeof run, NULL));
        assert_false(is_newer(time_of(run), before[v]));
    }
}

/* ---- anchors ---- */

static void what_a_scene_needs(void **state)
{
    (void)state;
    const char *data[] = {tiny};
    lab_runs_def def = lab_runs_def_default();
    def.data = data;
    def.data_count = 1;
    def.iterations = 40;
    def.seeds = 2;
    gbt_error err = {0};
    FILE *out = tmpfile();
    if (lab_study_anchors(&def, in_folder("anchors"), out, &err) != GBT_OK)
        fail_msg("%s", err.text);
    fclose(out);
    json_t *whole;
    assert_ok(json_read(in_folder("anchors/anchors.json"), &whole, NULL));
    const json_t *runs = json_object_get(whole, "runs");
    assert_int_equal(json_array_size(runs), anchors_variant_count);
    for (size_t v = 0; v < anchors_variant_count; v++) {
        char run[PATH_SIZE];
        double psnr = 0, final = 0;
        for (uint64_t seed = 0; seed < 2; seed++) {
            assert_ok(study_runs_folder(in_folder("anchors"), "tiny", anchors_variants[v].name, seed, run,
                                        sizeof run, NULL));
            psnr += metric_of(run, "psnr") / 2;
            final += metric_of(run, "anchors_final") / 2;
        }
        snprintf(run + strlen(run), sizeof run - strlen(run), "/config");
        char *config = read_text(run);
        assert_non_null(strstr(config, "\nfind-exposure = 0\n"));
        mem_free(config);
        assert_near(figure_of(json_array_get(runs, v), "psnr"), psnr, 1e-6);
        assert_near(figure_of(json_array_get(runs, v), "anchors_final"), final, 1e-6);
    }
    /* More is asked of an anchor from 0.5 to 1 to 1.5 to 2.5. */
    assert_true(figure_of(json_array_get(runs, 6), "anchors_final") >
                figure_of(json_array_get(runs, 5), "anchors_final"));
    const double paper = figure_of(json_array_get(runs, 1), "anchors_initial");
    assert_true(figure_of(json_array_get(runs, 2), "anchors_initial") == floor(paper / 2));
    json_decref(whole);
    char *page = read_text(in_folder("anchors/anchors.md"));
    assert_int_equal(count_of(page, "| random points |"), 1);
    mem_free(page);
}

/* ---- photos that are masked whole, scores of half of each photo ---- */

enum { BLACK_WIDTH = 64, BLACK_HEIGHT = 36 }; /* AlexNet wants 31 pixels, of a half, too */

/* A tiny scene with two held-out photos, of which the first is masked whole; `second`: the name of the
 * other. */
static void make_half_black_scene(const char *folder, char second[64])
{
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.width = BLACK_WIDTH;
    def.height = BLACK_HEIGHT;
    def.view_count = VIEWS;
    def.points = 150;
    def.samples = 4;
    assert_ok(gbt_make_scene(&def, folder, &assert_ok_err_));
    assert_ok(file_make_folder(in_folder("black/masks"), NULL));
    scene s;
    assert_ok(scene_load(folder, NULL, &s, NULL));
    assert_true(s.views[0].is_test && s.views[8].is_test);
    image black;
    assert_ok(image_alloc(&black, BLACK_WIDTH, BLACK_HEIGHT, 1, NULL));
    memset(black.pixels, 0, BLACK_WIDTH * BLACK_HEIGHT * sizeof *black.pixels);
    assert_ok(image_write(in_folder("black/masks/%s.png", s.views[0].name), &black, NULL));
    snprintf(second, 64, "%s,", s.views[8].name);
    image_free(&black);
    scene_free(&s);
}

/* FOLDER/NAME.json of a study of one run. */
static json_t *study_of(const char *run, const char *name,
                        gbt_status (*study)(const lab_study_def *, const char *, FILE *, gbt_error *))
{
    const char *models[] = {run}, *folder = in_folder("of-%s", strrchr(run, '/') + 1);
    lab_study_def def = lab_study_def_default();
    def.models = models;
    def.model_count = 1;
    def.repeats = 1;
    gbt_error err = {0};
    json_t *whole;
    FILE *out = tmpfile();
    if (study(&def, folder, out, &err) != GBT_OK)
        fail_msg("%s: %s", run, err.text);
    fclose(out);
    assert_ok(json_read(in_folder("of-%s/%s.json", strrchr(run, '/') + 1, name), &whole, NULL));
    json_t *studied = json_incref(json_array_get(json_object_get(whole, "models"), 0));
    json_decref(whole);
    return studied;
}

/* What the study "speed" has for the preset "default" is what eval has. */
static void check_photo_psnr(const char *run)
{
    json_t *studied = study_of(run, "speed", lab_study_speed);
    const json_t *row = json_array_get(json_object_get(studied, "settings"), 1);
    assert_string_equal(json_string_value(json_object_get(row, "value")), "default");
    assert_near(json_number_value(json_object_get(row, "photo_psnr")), metric_of(run, "psnr"), 0.01);
    json_decref(studied);
}

/* Of the last held-out view of the run of halves, from now on with a mask that is black in its right quarter:
   that of its right half alone, and of the pictures that eval has saved of that. */
static void check_lpips_of_a_half(const gbt_evaluate_def *with_network)
{
    image mask, render, photo, halves[2];
    lpips *net;
    lpips_scores wanted;
    json_t *metrics;
    assert_ok(image_alloc(&mask, BLACK_WIDTH, BLACK_HEIGHT, 1, NULL));
    for (int i = 0; i < BLACK_WIDTH * BLACK_HEIGHT; i++)
        mask.pixels[i] = i % BLACK_WIDTH < BLACK_WIDTH * 3 / 4;
    assert_ok(image_write(in_folder("black/masks/0008.png.png"), &mask, NULL));
    assert_ok(gbt_evaluate(in_folder("halves-run"), with_network, &assert_ok_err_));
    assert_ok(image_read(in_folder("halves-run/renders/test/0008.png"), &render, &assert_ok_err_));
    assert_ok(image_read(in_folder("halves-run/renders/test/0008.photo.png"), &photo, &assert_ok_err_));
    assert_true(render.channels == 3 && photo.channels == 3 && render.width == BLACK_WIDTH);
    for (int i = 0; i < 2; i++) {
        assert_ok(image_alloc(&halves[i], BLACK_WIDTH / 2, BLACK_HEIGHT, 3, NULL));
        for (int y = 0; y < BLACK_HEIGHT; y++)
            for (int x = 0; x < BLACK_WIDTH / 2; x++) {
                const image *from = i == 0 && x < BLACK_WIDTH / 4 ? &render : &photo;
                memcpy(halves[i].pixels + 3 * (y * BLACK_WIDTH / 2 + x),
                       from->pixels + 3 * (y * BLACK_WIDTH + BLACK_WIDTH / 2 + x), 3 * sizeof(float));
            }
    }
    assert_ok(lpips_open(with_network->lpips, &net, NULL));
    assert_ok(lpips_compare(net, &halves[0], &halves[1], NULL, 0, &wanted, NULL));
    assert_ok(json_read(in_folder("halves-run/metrics.json"), &metrics, NULL));
    const json_t *view = json_array_get(json_object_get(metrics, "views"), 1);
    assert_true(wanted.lpips > 0);
    assert_near(json_number_value(json_object_get(view, "lpips")), wanted.lpips, 1e-4 * wanted.lpips);
    assert_near(json_number_value(json_object_get(view, "lpips_01")), wanted.lpips_01,
                1e-4 * wanted.lpips_01);
    json_decref(metrics);
    lpips_close(net);
    image_free(&mask);
    image_free(&render);
    image_free(&photo);
    image_free(&halves[0]);
    image_free(&halves[1]);
}

static void a_photo_masked_whole(void **state)
{
    (void)state;
    const char *folder = in_folder("black"), *run = in_folder("black-run"), *halves = in_folder("halves-run");
    char second[64], line[256] = "";
    gbt_error err = {0};
    gbt_train_def def = run_def();
    make_half_black_scene(folder, second);
    train_ok(folder, run, &def);
    def.exposure = true;
    train_ok(folder, halves, &def);
    const gbt_evaluate_def own = gbt_evaluate_def_default();
    assert_ok(gbt_evaluate(run, &own, NULL));
    assert_ok(gbt_evaluate(halves, &own, NULL));
    check_photo_psnr(run);
    check_photo_psnr(halves);

    network alex = make_alex();
    gbt_evaluate_def scores = gbt_evaluate_def_default();
    scores.lpips = in_folder("alex.safetensors");
    write_network(&alex, scores.lpips, NULL);
    free_network(&alex);
    assert_ok(gbt_evaluate(run, &scores, NULL));
    json_t *metrics;
    assert_ok(json_read(in_folder("black-run/metrics.json"), &metrics, NULL));
    const json_t *views = json_object_get(metrics, "views"), *other = json_array_get(views, 1);
    assert_true(json_is_null(json_object_get(json_array_get(views, 0), "lpips")));
    assert_near(json_number_value(json_object_get(other, "lpips")), metric_of(run, "lpips"), 1e-12);
    json_decref(metrics);

    json_t *studied = study_of(run, "rate", lab_study_rate);
    assert_int_equal(json_integer_value(json_object_get(studied, "views")), 1);
    assert_near(json_number_value(json_object_get(studied, "psnr")), metric_of(run, "psnr"), 1e-6);
    json_decref(studied);

    FILE *out = tmpfile();
    if (lab_check_grad(run, out, &err) != GBT_OK)
        fail_msg("%s", err.text);
    rewind(out);
    assert_non_null(fgets(line, sizeof line, out));
    if (strncmp(line, second, strlen(second)) != 0)
        fail_msg("%s", line);
    fclose(out);
    check_lpips_of_a_half(&scores);
}

/* Small files of such a model are lossless, whatever quality was asked for: no row says another one. */
static void an_anchor_far_from_the_others(void **state)
{
    (void)state;
    const char *run = in_folder("stray");
    gbt_train_def def = run_def();
    def.iterations = 3;
    train_ok(tiny, run, &def);
    model m;
    assert_ok(model_load(in_folder("stray/model.gbt"), &m, NULL));
    m.anchors.position[0] += 1e6f * m.extent;
    assert_ok(model_save(in_folder("stray/model.gbt"), &m, NULL));
    model_free(&m);
    json_t *studied = study_of(run, "rate", lab_study_rate);
    const json_t *rows = json_object_get(studied, "settings");
    assert_int_equal(json_array_size(rows), 1);
    assert_true(json_is_null(json_object_get(json_array_get(rows, 0), "quality")));
    json_decref(studied);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mean_and_spread),
        cmocka_unit_test(figures_as_text),
        cmocka_unit_test(closed_form_of_balls),
        cmocka_unit_test(constant_of_pairs),
        cmocka_unit_test(what_the_paper_says),
        cmocka_unit_test(verdicts),
        cmocka_unit_test(names_and_folders),
        cmocka_unit_test(when_a_curve_comes_there),
        cmocka_unit_test(bad_requests),
        cmocka_unit_test(the_papers_tables),
        cmocka_unit_test(lpips_of_finished_runs),
        cmocka_unit_test(runs_are_made_once),
        cmocka_unit_test(quality_against_time),
        cmocka_unit_test(what_a_scene_needs),
        cmocka_unit_test(data_named_in_latin_1),
        cmocka_unit_test(a_photo_masked_whole),
        cmocka_unit_test(an_anchor_far_from_the_others),
    };
    return cmocka_run_group_tests(tests, make_root, folder_remove);
}
