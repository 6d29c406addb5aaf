/* SPDX-License-Identifier: Apache-2.0 */
/* render/render.c -- gbt_render(): views of the data set, a camera file, or a path, to image files or a film.

        open_run() --> choose_renderer() --> render_views() | render_camera() | render_film()
                                                 each picture: draw() --> write_one(), or a frame of the film

   With several processes, pictures are distributed over them. A scene larger than memory is drawn cell by
   cell; then all processes may work on one picture together (deal_out()). */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/choice.h"
#include "base/def.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/image_header.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "cluster/cluster.h"
#include "gbtrace/evaluate.h"
#include "render/camera_file.h"
#include "render/insert_file.h"
#include "run/loaded_run.h"
#include "render/render_outputs.h"
#include "render/render_path.h"
#include "render/video.h"
#include "trace/reference.h"

gbt_render_def gbt_render_def_default(void)
{
    return (gbt_render_def){.split = GBT_SPLIT_TEST,
                            .renderer = GBT_RENDERER_AS_TRAINED,
                            .format = GBT_PICTURE_PNG,
                            .preset = GBT_PRESET_AS_TRAINED,
                            .orbit_radius = (double)NAN,
                            .orbit_height = (double)NAN,
                            .cookie_ = DEF_COOKIE};
}

/* The same Gaussians and rays in double: the reference image for the tracer. */
static gbt_status render_reference(loaded_run *r, const ray_shot *shot, gbt_error *err)
{
    frame *f = &r->frame;
    const int samples = ray_shot_sample_count(shot);
    const size_t pixels = ray_image_count(&f->rays);
    double *rgb = mem_alloc(pixels, 3 * sizeof *rgb, "reference image", err);
    double *sum = mem_calloc(pixels, 3 * sizeof *sum, "reference image", err);
    gbt_status status = rgb == NULL || sum == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    for (int s = 0; s < samples && status == GBT_OK; s++) {
        status = ray_image_from_shot(shot, s, &f->rays, err);
        if (status == GBT_OK)
            status = reference_forward(frame_drawn(f), &r->settings, &f->rays, rgb, NULL, NULL, err);
        for (size_t i = 0; status == GBT_OK && i < 3 * pixels; i++)
            sum[i] += rgb[i];
    }
    for (size_t i = 0; status == GBT_OK && i < 3 * pixels; i++)
        f->rgb.pixels[i] = (float)(sum[i] / samples);
    mem_free(rgb);
    mem_free(sum);
    return status;
}

/* The open run, what is inserted into it, and how it is drawn. */
typedef struct render_job {
    loaded_run run;
    insert_scene insert;
    unsigned outputs; /* bits of render_outputs_parse() */
    bool in_double;   /* by the double-precision reference */
    bool together;    /* all processes draw each picture: deal_out() */
} render_job;

/* Distribute pictures over the processes. If there are fewer pictures than processes and the scene is drawn
   by cells, all processes draw each picture together, each some of its cells. */
static void deal_out(render_job *job, size_t pictures)
{
    job->together = job->run.cells.count > 0 && pictures < (size_t)gbt_cluster_size();
}

static bool is_own(const render_job *job, size_t index)
{
    return job->together || index % (size_t)gbt_cluster_size() == (size_t)gbt_cluster_rank();
}

/* Render into run.frame.rgb. */
static gbt_status draw(render_job *job, const ray_shot *shot, const gbt_render_def *def, gbt_error *err)
{
    loaded_run *r = &job->run;
    if (r->cells.count > 0)
        return (job->together ? cell_draw_together : cell_draw)(&r->cell_drawer, &r->cells, shot,
                                                                &r->settings, r->frame.draw.footprint,
                                                                def->memory, &r->frame.rgb, err);
    const frame_tracer tracer = {.trace = insert_trace, .context = &job->insert, .reach = job->insert.reach};
    GBT_TRY(frame_render_with(&r->frame, loaded_run_subject(r), shot, &r->settings,
                              def->insert != NULL ? &tracer : NULL, err));
    if (job->in_double)
        GBT_TRY(render_reference(r, shot, err));
    return GBT_OK;
}

/* A scene that is not drawn by cells is drawn in full even if it exceeds the memory limit; only afterwards is
   the excess reported. */
static gbt_status check_memory(const render_job *job, const gbt_render_def *def, gbt_error *err)
{
    const size_t peak = mem_peak_bytes();
    if (def->memory == 0 || peak <= def->memory || job->run.cells.count > 0)
        return GBT_OK;
    return base_fail(err, GBT_ERR_NO_MEMORY,
                     "memory: the limit of %zu MiB was exceeded: this took %zu MiB (the output is complete; "
                     "only a .ply can be drawn cell by cell)",
                     def->memory >> 20, (peak >> 20) + 1);
}

static gbt_status write_one(render_job *job, const ray_shot *shot, const char *out, const char *name,
                            const gbt_render_def *def, gbt_error *err)
{
    char file[1100], path[4096];
    loaded_run *r = &job->run;
    snprintf(file, sizeof file, "%s.%s", name, CHOICE_NAME(GBT_PICTURE_FORMAT_NAMES, def->format));
    GBT_TRY(file_join(path, sizeof path, out, file, err));
    GBT_TRY(image_write(path, &r->frame.rgb, err));
    return render_outputs_write(r, shot, job->outputs, out, name, err);
}

static gbt_status check_size(const gbt_camera *c, const char *name, gbt_error *err)
{
    return (int64_t)c->width * c->height * 3 <= IMAGE_SAMPLES_MAX
               ? GBT_OK
               : base_fail(err, GBT_ERR_ARGUMENT,
                           "%s: a picture of %d x %d pixels (wanted at most %lld pixels)", name, c->width,
                           c->height, (long long)(IMAGE_SAMPLES_MAX / 3));
}

static gbt_status render_one(render_job *job, const ray_shot *shot, const char *out, const char *name,
                             const gbt_render_def *def, gbt_error *err)
{
    GBT_TRY(check_size(&shot->camera, name, err));
    GBT_TRY(draw(job, shot, def, err));
    if (!job->together)
        return write_one(job, shot, out, name, def, err);
    return cluster_follow(cluster_leads() ? write_one(job, shot, out, name, def, err) : GBT_OK, err);
}

static bool is_wanted(const scene_view *view, gbt_split split)
{
    return split == GBT_SPLIT_ALL || view->is_test == (split == GBT_SPLIT_TEST);
}

static gbt_status render_own_views(render_job *job, const char *out, const gbt_render_def *def, size_t wanted,
                                   gbt_error *err)
{
    loaded_run *r = &job->run;
    size_t index = 0;
    log_count("render", 0, wanted, (double)NAN);
    for (size_t i = 0; i < r->scene.view_count; i++) {
        const scene_view *view = &r->scene.views[i];
        if (!is_wanted(view, def->split) || !is_own(job, index++))
            continue;
        char name[FILE_NAME_SIZE];
        loaded_run_view_name(r, i, name);
        const gbt_camera camera = photos_camera(&r->photos, i, 0);
        const ray_shot shot = ray_shot_of(&camera);
        const trace_settings of_run = r->settings;
        r->settings = loaded_run_settings(r, i);
        const gbt_status status = render_one(job, &shot, out, name, def, err);
        r->settings = of_run;
        GBT_TRY(status);
        log_count("render", index, wanted, (double)NAN);
    }
    return GBT_OK;
}

static gbt_status render_views(render_job *job, const char *out, const gbt_render_def *def, gbt_error *err)
{
    const scene *s = &job->run.scene;
    size_t wanted = 0;
    for (size_t i = 0; i < s->view_count; i++)
        wanted += is_wanted(&s->views[i], def->split);
    if (wanted == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no views in this split (of %zu)", s->folder,
                         s->view_count);
    deal_out(job, wanted);
    GBT_TRY(cluster_agree(render_own_views(job, out, def, wanted, err), err));
    log_info("%zu views rendered into %s", wanted, out);
    return GBT_OK;
}

/* "folder/name.json" becomes "name". */
static void camera_name(const char *path, char *out, size_t size)
{
    const char *slash = strrchr(path, '/');
    snprintf(out, size, "%s", slash != NULL ? slash + 1 : path);
    char *dot = strrchr(out, '.');
    if (dot != NULL && dot != out)
        *dot = '\0';
}

static gbt_status render_camera(render_job *job, const char *out, const gbt_render_def *def, gbt_error *err)
{
    camera_file file = {0};
    char name[1024];
    camera_name(def->camera, name, sizeof name);
    gbt_status status = cluster_agree(camera_file_read(def->camera, job->run.model.origin, &file, err), err);
    deal_out(job, 1);
    if (status == GBT_OK && is_own(job, 0))
        status = render_one(job, &file.shot, out, name, def, err);
    status = cluster_agree(status, err);
    if (status == GBT_OK)
        log_info("%s rendered into %s", name, out);
    camera_file_free(&file);
    return status;
}

static gbt_status render_frames(render_job *job, const camera_path *path, const char *out,
                                const gbt_render_def *def, gbt_error *err)
{
    log_count("render", 0, path->count, (double)NAN);
    for (size_t i = 0; i < path->count; i++) {
        char name[32];
        snprintf(name, sizeof name, "frame_%05zu", i + 1);
        if (is_own(job, i))
            GBT_TRY(render_one(job, &path->shots[i], out, name, def, err));
        log_count("render", i + 1, path->count, (double)NAN);
    }
    return GBT_OK;
}

static void warn_of_older_frames(size_t count, const char *out, const gbt_render_def *def)
{
    char path[4096];
    const int length = snprintf(path, sizeof path, "%s/frame_%05zu.%s", out, count + 1,
                                CHOICE_NAME(GBT_PICTURE_FORMAT_NAMES, def->format));
    if (length < (int)sizeof path && file_exists(path))
        log_warn("%s: frames from %zu on are left over from an earlier film", out, count + 1);
}

/* Send the frame that process `from` drew last to the first process. */
static void collect_frame(const image *own, size_t from, image *out)
{
    size_t send[CLUSTER_SIZE_MAX] = {0}, receive[CLUSTER_SIZE_MAX] = {0};
    const size_t values = 3 * (size_t)own->width * (size_t)own->height, rank = (size_t)gbt_cluster_rank();
    send[0] = rank == from ? values : 0;
    receive[from] = rank == 0 ? values : 0;
    cluster_exchange(own->pixels, send, out->pixels, receive);
}

/* The first process writes the film, in order. In each round every process draws one frame, or all draw one
   together. `picture`: space for one frame. */
static gbt_status film_rounds(render_job *job, const camera_path *path, video *film, image *picture,
                              const gbt_render_def *def, gbt_error *err)
{
    const size_t size = job->together ? 1 : (size_t)gbt_cluster_size();
    const size_t rank = job->together ? 0 : (size_t)gbt_cluster_rank();
    log_count("render", 0, path->count, (double)NAN);
    for (size_t first = 0; first < path->count; first += size) {
        const size_t count = path->count - first < size ? path->count - first : size;
        gbt_status status = rank < count ? draw(job, &path->shots[first + rank], def, err) : GBT_OK;
        GBT_TRY(cluster_agree(status, err));
        for (size_t i = 0; i < count; i++) {
            collect_frame(&job->run.frame.rgb, i, picture);
            if (film != NULL && status == GBT_OK)
                status = video_add(film, picture, err);
        }
        GBT_TRY(cluster_follow(status, err));
        log_count("render", first + count, path->count, (double)NAN);
    }
    return GBT_OK;
}

static gbt_status make_film(render_job *job, const camera_path *path, const char *out,
                            const gbt_render_def *def, gbt_error *err)
{
    const gbt_camera *camera = &path->shots[0].camera;
    video *film = NULL;
    image picture = {0};
    gbt_status status = GBT_OK;
    GBT_TRY(check_size(camera, out, err)); /* all frames have one size */
    if (cluster_leads()) {
        status = video_open(out, camera->width, camera->height, path->fps, &film, err);
        if (status == GBT_OK)
            status = image_alloc(&picture, camera->width, camera->height, 3, err);
    }
    status = cluster_follow(status, err);
    if (status == GBT_OK)
        status = film_rounds(job, path, film, &picture, def, err);
    image_free(&picture);
    const gbt_status closed = video_close(film, status == GBT_OK, err);
    return status == GBT_OK ? cluster_follow(closed, err) : status;
}

static gbt_status render_film(render_job *job, const char *out, const gbt_render_def *def, gbt_error *err)
{
    camera_path path;
    gbt_status status = cluster_agree(render_path_make(&job->run, def, &path, err), err);
    deal_out(job, path.count);
    if (status == GBT_OK)
        status = video_named(out) ? make_film(job, &path, out, def, err)
                                  : cluster_agree(render_frames(job, &path, out, def, err), err);
    if (status == GBT_OK && !video_named(out) && cluster_leads())
        warn_of_older_frames(path.count, out, def);
    if (status == GBT_OK)
        log_info("%zu frames rendered into %s, %.2f s at %g frames per second", path.count, out,
                 (double)path.count / path.fps, path.fps);
    camera_path_free(&path);
    return status;
}

static const char insert_is_traced[] = "insert: only the renderer trace supports this";

/* Choose the renderer for the open model, and check that it can do what was asked for. */
static gbt_status choose_renderer(render_job *job, const gbt_render_def *def, gbt_error *err)
{
    gbt_renderer *renderer = &job->run.frame.draw.renderer;
    job->in_double = def->renderer == GBT_RENDERER_REFERENCE;
    if (job->in_double)
        *renderer = GBT_RENDERER_TRACE;
    else if (def->renderer != GBT_RENDERER_AS_TRAINED)
        *renderer = def->renderer;
    if (def->insert != NULL && *renderer != GBT_RENDERER_TRACE)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s", insert_is_traced);
    if (job->outputs != 0 && *renderer != GBT_RENDERER_TRACE)
        return base_fail(err, GBT_ERR_ARGUMENT, "outputs: only the renderer trace supports these");
    return GBT_OK;
}

static gbt_status check_path(const char *out, const gbt_render_def *def, gbt_error *err)
{
    if (def->path == NULL && (def->frames != 0 || def->fps != 0 || def->width != 0 || def->height != 0))
        return base_fail(err, GBT_ERR_ARGUMENT, "frames, fps, width: only with a path");
    const bool orbit = def->path != NULL && strcmp(def->path, "orbit") == 0;
    if (!orbit && (def->look_at != NULL || !isnan(def->orbit_radius) || !isnan(def->orbit_height)))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "look_at, orbit_radius, orbit_height: only with the path orbit");
    if (def->orbit_radius <= 0 || def->orbit_radius > 1e9)
        return base_fail(err, GBT_ERR_ARGUMENT, "orbit_radius: %g (wanted above 0, up to 1e+09)",
                         def->orbit_radius);
    if (fabs(def->orbit_height) > 1e9)
        return base_fail(err, GBT_ERR_ARGUMENT, "orbit_height: %g (wanted -1e+09 to 1e+09)",
                         def->orbit_height);
    if (def->path == NULL)
        return video_named(out) ? base_fail(err, GBT_ERR_ARGUMENT, "%s: a film needs a path", out) : GBT_OK;
    if (def->camera != NULL)
        return base_fail(err, GBT_ERR_ARGUMENT, "path: cannot be combined with a camera file");
    if (!render_path_wants_views(def->path) && def->downscale != 0)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "downscale: cannot be combined with a path file (wanted the size of the film)");
    if (def->frames < 0 || def->frames > CAMERA_PATH_FRAMES_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "frames: %d (wanted 1 to %d)", def->frames,
                         (int)CAMERA_PATH_FRAMES_MAX);
    if (!(def->fps >= 0 && def->fps <= 1000))
        return base_fail(err, GBT_ERR_ARGUMENT, "fps: %g (wanted up to 1000)", def->fps);
    if ((def->width != 0 || def->height != 0) &&
        !(def->width > 0 && def->height > 0 && def->width <= 65500 && def->height <= 65500))
        return base_fail(err, GBT_ERR_ARGUMENT, "width: %d x %d (wanted 1 to 65500 pixels)", def->width,
                         def->height);
    if (video_named(out) && def->outputs != NULL)
        return base_fail(err, GBT_ERR_ARGUMENT, "outputs: cannot be written as a film (wanted a folder)");
    if (video_named(out) && def->format != GBT_PICTURE_PNG)
        return base_fail(err, GBT_ERR_ARGUMENT, "format: does not apply to a film (wanted a folder)");
    return GBT_OK;
}

static bool wants_views(const gbt_render_def *def)
{
    return def->path != NULL ? render_path_wants_views(def->path) : def->camera == NULL;
}

static gbt_status check_def(const char *out, const gbt_render_def *def, gbt_error *err)
{
    GBT_TRY(video_check_name(out, err));
    GBT_TRY(def_check(def->cookie_, "gbt_render_def_default", err));
    GBT_TRY(choice_check("split", GBT_SPLIT_NAMES, (int)def->split, err));
    GBT_TRY(choice_check("format", GBT_PICTURE_FORMAT_NAMES, (int)def->format, err));
    if (def->renderer != GBT_RENDERER_AS_TRAINED)
        GBT_TRY(choice_check("renderer", GBT_RENDERER_NAMES, (int)def->renderer, err));
    if (!(def->downscale == 0 || (def->downscale >= 1 && def->downscale <= 64)))
        return base_fail(err, GBT_ERR_ARGUMENT, "downscale: %g (wanted 1 to 64)", def->downscale);
    if (def->camera != NULL && def->downscale != 0)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "downscale: cannot be combined with a camera file (which gives the size)");
    if (def->data != NULL && !wants_views(def))
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "data: cannot be combined with a camera file or a path file (which give the cameras)");
    if (def->insert != NULL && def->renderer != GBT_RENDERER_AS_TRAINED &&
        def->renderer != GBT_RENDERER_TRACE)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s", insert_is_traced);
    return check_path(out, def, err);
}

/* The folder that the pictures or the film are written to. */
static void folder_of(const char *out, char folder[4096])
{
    const char *slash = strrchr(out, '/');
    if (!video_named(out))
        snprintf(folder, 4096, "%s", out);
    else if (slash == NULL)
        snprintf(folder, 4096, ".");
    else
        snprintf(folder, 4096, "%.*s", (int)(slash == out ? 1 : slash - out), out);
}

/* Open the model, with its views if they are needed; as cells if it exceeds the memory limit. */
static gbt_status open_run(const char *run, const char *out, const gbt_render_def *def, loaded_run *r,
                           gbt_error *err)
{
    char folder[4096];
    bool large = false;
    folder_of(out, folder);
    if (def->memory > 0)
        GBT_TRY(loaded_run_is_larger(run, def->memory, &large, err));
    const bool is_traced = def->renderer == GBT_RENDERER_AS_TRAINED || def->renderer == GBT_RENDERER_TRACE;
    if (large && (!is_traced || def->insert != NULL || def->outputs != NULL))
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "memory: a model larger than this can only be traced, without outputs and meshes (wanted the "
            "renderer trace, no outputs, no inserted meshes)");
    if (large)
        GBT_TRY(file_make_folder(folder, err)); /* for the cells' temporary file */
    if (large)
        GBT_TRY(loaded_run_open_cells(run, def->memory, folder, r, err));
    if (large)
        return wants_views(def) ? loaded_run_open_views(run, def->data, def->downscale, r, err) : GBT_OK;
    return wants_views(def) ? loaded_run_open(run, def->data, def->downscale, r, err)
                            : loaded_run_open_model(run, r, err);
}

/* A run with exposures keeps its scored pictures in renders/test, after the photos' colour matrices. Pictures
   drawn here lack these, so they must not overwrite them. */
static gbt_status check_scored(const loaded_run *r, const char *out, const gbt_render_def *def,
                               gbt_error *err)
{
    char scored[4096];
    if (!r->def.exposure || def->camera != NULL || def->path != NULL || def->split == GBT_SPLIT_TRAIN)
        return GBT_OK;
    GBT_TRY(file_join(scored, sizeof scored, r->data.folder, "renders/test", err));
    return !file_is_same(out, scored)
               ? GBT_OK
               : base_fail(err, GBT_ERR_ARGUMENT,
                           "%s: holds the scored pictures, through the photos' colour matrices (wanted "
                           "another folder)",
                           out);
}

/* Pictures have the names of photos: in the folder of these they would replace them. */
static gbt_status check_photos(const loaded_run *r, const char *out, gbt_error *err)
{
    for (size_t i = 0; i < r->scene.view_count; i++) {
        const scene_view *view = &r->scene.views[i];
        const char *path =
            view->mask_path != NULL && file_is_in(view->mask_path, out) ? view->mask_path : view->path;
        if (path != NULL && file_is_in(path, out))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "%.1000s: holds photos or masks of the data set (wanted another folder)", out);
    }
    return GBT_OK;
}

gbt_status gbt_render(const char *run, const char *out, const gbt_render_def *def, gbt_error *err)
{
    PLAIN_NUMBERS;
    GBT_TRY(check_def(out, def, err));
    GBT_TRY(video_named(out) ? file_check_creatable(out, err) : file_check_folder_creatable(out, err));
    render_job *job = mem_calloc(1, sizeof *job, "run", err);
    if (job == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = render_outputs_parse(def->outputs, &job->outputs, err);
    if (status == GBT_OK)
        status = open_run(run, out, def, &job->run, err);
    if (status == GBT_OK)
        status = check_scored(&job->run, out, def, err);
    if (status == GBT_OK)
        status = check_photos(&job->run, out, err);
    if (status == GBT_OK)
        status = loaded_run_preset(def->preset, &job->run.settings, err);
    if (status == GBT_OK)
        status = choose_renderer(job, def, err);
    if (status == GBT_OK && def->insert != NULL)
        status = insert_file_read(def->insert, job->run.model.origin, &job->insert, err);
    if (status == GBT_OK && !video_named(out)) /* only now is it known that there is something to draw */
        status = file_make_folder(out, err);
    status = cluster_agree(status, err);
    if (status == GBT_OK)
        status = def->path != NULL     ? render_film(job, out, def, err)
                 : def->camera != NULL ? render_camera(job, out, def, err)
                                       : render_views(job, out, def, err);
    if (status == GBT_OK)
        status = check_memory(job, def, err);
    insert_scene_free(&job->insert);
    loaded_run_close(&job->run);
    mem_free(job);
    return status;
}
