/* SPDX-License-Identifier: Apache-2.0 */
/* eval/score_run.c -- score a run on its held-out views. */
#include "eval/score_run.h"

#include <math.h>
#include <stdio.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/stop_signal.h"
#include "cluster/cluster.h"

/* The images of a view, each with the status of writing its file. */
typedef struct view_pictures {
    const image *picture[3];
    const char *path[3];
    gbt_status status[3];
    gbt_error error[3];
} view_pictures;

static void write_pictures(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    view_pictures *p = context;
    for (size_t i = begin; i < end; i++)
        p->status[i] = image_write(p->path[i], p->picture[i], &p->error[i]);
}

static gbt_status write_view(view_pictures *p, gbt_error *err)
{
    parallel_blocks(3, 1, write_pictures, p);
    for (int i = 0; i < 3; i++)
        if (p->status[i] != GBT_OK) {
            if (err != NULL)
                *err = p->error[i];
            return p->status[i];
        }
    return GBT_OK;
}

/* Score one view; images are written into `folder` (NULL: not written). */
static gbt_status score_view(loaded_run *r, size_t index, const lpips *net, const char *folder,
                             view_score *score, gbt_error *err)
{
    const scene_view *view = &r->scene.views[index];
    const double start = clock_wall();
    GBT_TRY(loaded_run_render(r, index, err));
    score->seconds = clock_wall() - start;
    score->gaussians = r->frame.gaussians.count;
    snprintf(score->name, sizeof score->name, "%s", view->name);
    loaded_run_view_name(r, index, score->file);
    image photo = {0}, error_map = {0};
    image *render = &r->frame.rgb;
    const unsigned char *valid = NULL;
    image_scores scores = {0};
    gbt_status status = frame_read_photo(&r->frame, view, &photo, &valid, err);
    if (status == GBT_OK)
        status = image_alloc(&error_map, render->width, render->height, 1, err);
    if (status == GBT_OK)
        status = image_score_photo(render, &photo, valid, r->def.exposure, &error_map, &scores, err);
    const int first_column = r->def.exposure ? render->width / 2 : 0; /* the same columns as in
                                                                         image_score_photo() */
    if (status == GBT_OK)
        status = image_psnr_fitted(render, &photo, valid, first_column, &score->psnr_fitted, err);
    score->psnr = scores.psnr;
    score->ssim = scores.ssim;
    score->flip = scores.flip;
    score->masked = valid != NULL;
    if (status == GBT_OK && net != NULL)
        status = lpips_compare(net, render, &photo, valid, first_column, &score->lpips, err);
    if (isnan(score->psnr)) /* without a valid pixel both inputs are the photo and LPIPS would be 0 */
        score->lpips = (lpips_scores){(double)NAN, (double)NAN};
    if (status == GBT_OK && folder != NULL)
        status = view_score_paths(score, folder, err);
    if (status == GBT_OK && folder != NULL)
        status =
            write_view(&(view_pictures){.picture = {render, &photo, &error_map},
                                        .path = {score->render_path, score->photo_path, score->error_path}},
                       err);
    image_free(&photo);
    image_free(&error_map);
    return status;
}

/* Score this process's share of the views. */
static gbt_status score_own_views(loaded_run *r, const lpips *net, const char *folder, evaluation *e,
                                  gbt_error *err)
{
    const size_t size = (size_t)gbt_cluster_size(), rank = (size_t)gbt_cluster_rank();
    size_t index = 0, own = 0;
    if (e->view_count > 0)
        log_count("score", 0, e->view_count, (double)NAN);
    for (size_t i = 0; i < r->scene.view_count; i++) {
        if (!r->scene.views[i].is_test || index++ % size != rank)
            continue;
        view_score *v = &e->views[own++];
        if (stop_signal_seen())
            return base_fail(err, GBT_ERR_INTERRUPTED,
                             "stopped while held-out views were scored (eval scores the run)");
        GBT_TRY(score_view(r, i, net, folder, v, err));
        log_count("score", index, e->view_count, v->psnr);
    }
    return GBT_OK;
}

/* Gather the scores of all processes into e->views, in the order of the views. Before, e->views begins with
   those of this process. */
static gbt_status collect_scores(evaluation *e, gbt_error *err)
{
    enum { WORDS = sizeof(view_score) / sizeof(uint32_t) };
    _Static_assert(sizeof(view_score) % sizeof(uint32_t) == 0, "messages are words");
    const size_t size = (size_t)gbt_cluster_size();
    if (size == 1)
        return GBT_OK;
    size_t counts[CLUSTER_SIZE_MAX], next = 0;
    for (size_t rank = 0; rank < size; rank++)
        counts[rank] = (e->view_count + size - 1 - rank) / size * WORDS;
    view_score *dealt = mem_alloc(e->view_count + 1, sizeof *dealt, "view scores", err);
    if (dealt == NULL)
        return GBT_ERR_NO_MEMORY;
    cluster_gather(e->views, counts, dealt);
    for (size_t rank = 0; rank < size; rank++)
        for (size_t i = rank; i < e->view_count; i += size)
            e->views[i] = dealt[next++];
    mem_free(dealt);
    return GBT_OK;
}

static gbt_status score_views(loaded_run *r, const lpips *net, const char *folder, evaluation *e,
                              gbt_error *err)
{
    e->views = mem_calloc(r->scene.view_count + 1, sizeof *e->views, "view scores", err);
    if (e->views == NULL)
        return GBT_ERR_NO_MEMORY;
    if (folder != NULL)
        GBT_TRY(file_make_folder(folder, err));
    for (size_t i = 0; i < r->scene.view_count; i++)
        e->view_count += r->scene.views[i].is_test;
    if (r->poses_refined && !r->held_out_aligned && e->view_count > 0)
        log_warn("%s: held-out photos are not aligned to the scene: the run is not finished", r->data.folder);
    return score_own_views(r, net, folder, e, err);
}

gbt_status score_run(loaded_run *r, const char *run, bool pictures, const lpips *net, evaluation *e,
                     gbt_error *err)
{
    char folder[4096];
    GBT_TRY(file_join(folder, sizeof folder, run, "renders/test", err));
    GBT_TRY(cluster_agree(score_views(r, net, pictures ? folder : NULL, e, err), err));
    GBT_TRY(collect_scores(e, err));
    size_t scored = 0;
    for (size_t i = 0; i < e->view_count; i++) {
        const view_score *v = &e->views[i];
        e->masked = e->masked || v->masked;
        e->gaussians_per_view += (double)v->gaussians;
        if (!isfinite(v->psnr)) /* every pixel is masked */
            continue;
        scored++;
        e->psnr += v->psnr;
        e->psnr_fitted += v->psnr_fitted;
        e->ssim += v->ssim;
        e->flip += v->flip;
        e->lpips.lpips += v->lpips.lpips;
        e->lpips.lpips_01 += v->lpips.lpips_01;
    }
    const double n = (double)scored; /* 0 / 0 = NaN here becomes null in JSON and "n/a" on the page */
    e->lpips.lpips /= n;
    e->lpips.lpips_01 /= n;
    e->lpips_network = net != NULL ? lpips_network(net) : NULL;
    e->psnr /= n;
    e->psnr_fitted /= n;
    e->ssim /= n;
    e->flip /= n;
    e->gaussians_per_view /= (double)e->view_count;
    e->anchors = r->model.anchors.count;
    e->exposure = r->def.exposure;
    e->aligned = r->poses_refined && r->held_out_aligned;
    e->renderer = r->frame.draw.renderer;
    e->downscale = r->photos.downscale;
    char model_path[4096];
    struct stat info;
    GBT_TRY(file_join(model_path, sizeof model_path, run, "model.gbt", err));
    e->model_bytes = stat(model_path, &info) == 0 ? (size_t)info.st_size : 0;
    return GBT_OK;
}
