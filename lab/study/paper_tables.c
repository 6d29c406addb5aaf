/* SPDX-License-Identifier: Apache-2.0 */
/* study/paper_tables.c -- the study "paper" in Markdown: our tables, our changes beside the paper's, and how
   they compare in words. */
#include <limits.h>
#include <math.h>

#include "base/choice.h"
#include "study/paper.h"

static const char *const titles[PAPER_TABLES] = {"Voxels against balls",
                                                 "What each part does, and what a constant does",
                                                 "Growth stopped early", "Depth of the balls"};

/* ---- figures ---- */

static const paper_figure columns_compact[] = {PAPER_INITIAL, PAPER_FINAL, PAPER_STORAGE, PAPER_MODEL,
                                               PAPER_PSNR,    PAPER_SSIM,  PAPER_LPIPS};
static const paper_figure columns_growth[] = {PAPER_FINAL, PAPER_ARITHMETIC, PAPER_BLENDED,
                                              PAPER_PSNR,  PAPER_SSIM,       PAPER_LPIPS};

/* In tables that vary one setting, the full method is the last row, named by its value of that setting. */
static const char *row_name(int table, paper_variant_id variant)
{
    if (table == 3 && (variant == PAPER_VOXEL || variant == PAPER_GBSP))
        return variant == PAPER_VOXEL ? "voxels, growth to 1/2" : "GBAI + GBSP, growth to 1/2";
    return table == 4 && variant == PAPER_GBSP ? "D_max 18" : paper_variants[variant].says;
}

static void add_figures(const paper_study *s, int table, text *out)
{
    const paper_figure *columns = table == 3 ? columns_growth : columns_compact;
    size_t column_count =
        table == 3 ? sizeof columns_growth / sizeof *columns : sizeof columns_compact / sizeof *columns;
    column_count -= !paper_is_measured(s, columns[column_count - 1]); /* the last column is LPIPS */
    const paper_variant_id *variants;
    const size_t variant_count = paper_table_variants(table, &variants);
    text_add(out, "| scene | SfM points | start |");
    for (size_t c = 0; c < column_count; c++)
        text_format(out, " %s |", paper_figure_texts[columns[c]].value_name);
    text_add(out, "\n|---|---|---|");
    for (size_t c = 0; c < column_count; c++)
        text_add(out, "---|");
    text_add(out, "\n");
    for (size_t scene = 0; scene < s->grid.scene_count; scene++)
        for (size_t v = 0; v < variant_count; v++) {
            text_add(out, "| ");
            text_plain(out, s->grid.names[scene]);
            text_add(out, " | ");
            text_count(out, paper_run(s, scene, variants[v], 0)->points);
            text_format(out, " | %s |", row_name(table, variants[v]));
            for (size_t c = 0; c < column_count; c++) {
                const stat_sample stat = paper_stat(s, scene, variants[v], columns[c]);
                text_add(out, " ");
                stat_add(out, &stat, paper_figure_texts[columns[c]].decimals, false);
                text_add(out, " |");
            }
            text_add(out, "\n");
        }
}

/* ---- changes ---- */

const char *paper_verdict_of(const stat_sample *ours, double published, const double range[2])
{
    const bool has_paper = isfinite(published);
    if (!isfinite(ours->mean))
        return "not measured";
    if (ours->mean == 0 && !(ours->deviation > 0))
        return "none at all";
    if (ours->count < 2)
        return "one seed says nothing of the spread";
    if (!stat_is_apart(ours, 0) && has_paper)
        return stat_is_apart(ours, published) ? "not told apart from zero, but from the paper"
                                              : "told apart neither from zero nor from the paper";
    if (!stat_is_apart(ours, 0))
        return "not told apart from zero";
    if (!has_paper)
        return ours->mean < 0 ? "lower, beyond the spread" : "higher, beyond the spread";
    if ((ours->mean < 0) != (published < 0))
        return "opposite to the paper";
    if (!stat_is_apart(ours, published))
        return "agrees with the paper";
    if (ours->mean >= range[0] && ours->mean <= range[1])
        return "within the range of the paper's scenes";
    return fabs(ours->mean) < fabs(published) ? "the same way as the paper, but less"
                                              : "the same way as the paper, and more";
}

const char *paper_verdict(const stat_sample *ours, const paper_claim *claim)
{
    double range[2];
    paper_published_range(claim, range); /* if there is none, an empty range from infinity down, which
                                            contains nothing */
    return paper_verdict_of(ours, paper_published(claim), range);
}

static void add_change_row(const paper_study *s, const paper_claim *claim, text *out)
{
    const paper_figure_text *figure = &paper_figure_texts[claim->figure];
    const double published = paper_published(claim);
    double range[2];
    text_format(out, "| %s | %s |", claim->what, figure->change_name);
    for (size_t scene = 0; scene < s->grid.scene_count; scene++) {
        const stat_sample change = paper_change(s, scene, claim->variant, claim->base, claim->figure);
        text_add(out, " ");
        stat_add_judged(out, &change, figure->change_decimals);
        text_add(out, " |");
    }
    const stat_sample all = paper_change(s, PAPER_ALL, claim->variant, claim->base, claim->figure);
    text_add(out, " ");
    stat_add_judged(out, &all, figure->change_decimals);
    text_add(out, " | ");
    if (isfinite(published))
        stat_add_change(out, published, figure->change_decimals);
    text_add(out, " | ");
    if (paper_published_range(claim, range) && range[0] < range[1])
        text_format(out, "%+.*f to %+.*f", figure->change_decimals, range[0], figure->change_decimals,
                    range[1]);
    text_format(out, " | %s |\n", paper_verdict(&all, claim));
}

static void add_changes(const paper_study *s, int table, text *out)
{
    text_add(out, "\n| change | of |");
    for (size_t scene = 0; scene < s->grid.scene_count; scene++) {
        text_add(out, " ");
        text_plain(out, s->grid.names[scene]);
        text_add(out, " |");
    }
    text_add(out, " all | the paper | its scenes | all against the paper |\n|---|---|");
    for (size_t scene = 0; scene < s->grid.scene_count; scene++)
        text_add(out, "---|");
    text_add(out, "---|---|---|---|\n");
    for (size_t i = 0; i < paper_claim_count; i++)
        if (paper_claims[i].table == table && paper_is_measured(s, paper_claims[i].figure))
            add_change_row(s, &paper_claims[i], out);
}

/* ---- the document ---- */

static void add_scenes(const paper_study *s, text *out)
{
    text_add(out,
             "| scene | depth of the balls without a limit | constant in place of GBSP |\n|---|---|---|\n");
    for (size_t scene = 0; scene < s->grid.scene_count; scene++) {
        const paper_scene *p = &s->scenes[scene];
        text_add(out, "| ");
        text_plain(out, s->grid.names[scene]);
        text_format(out, p->tree_depth < INT_MAX ? " | %d |" : " | n/a |", p->tree_depth);
        text_format(out, " %.3f |\n", p->scale_constant);
    }
}

void paper_tables(const void *study, text *out)
{
    const paper_study *s = study;
    text_format(out,
                "# The paper's tables, from our runs\n\n%llu iterations of the faithful protocol "
                "(`--compat`), photos divided by %g, %s, ",
                (unsigned long long)s->def.iterations, s->def.downscale,
                CHOICE_NAME(GBT_RENDERER_NAMES, s->def.renderer));
    if (s->def.voxel_size > 0)
        text_format(out, "voxel size %g, ", s->def.voxel_size);
    study_grid_add_runs(&s->grid, s->def.eval_split, out);
    text_add(out, "Mean ± standard deviation over the seeds. Changes compare runs of the same seed; \"all\" "
                  "is the mean of the scenes' changes, the paper's the change of the sum over its scenes. "
                  "Told apart: outside the 95 % interval of the mean. " STAT_BOLD_MEANS
                  " The paper gives single runs on other scenes.\n\n");
    add_scenes(s, out);
    for (int table = 1; table <= PAPER_TABLES; table++) {
        if (!s->has_table[table])
            continue;
        text_format(out, "\n## %d. %s\n\n", table, titles[table - 1]);
        add_figures(s, table, out);
        add_changes(s, table, out);
    }
}
