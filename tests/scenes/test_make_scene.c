/* SPDX-License-Identifier: Apache-2.0 */
/* tests/scenes/test_make_scene.c -- what gbt_make_scene() writes: same bytes, true points, true cameras, and
   its refusals. */
#include "folder.h"

#include "base/image.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "data/gaussian_cloud.h"
#include "data/gaussian_file.h"
#include "data/scene.h"
#include "gbtrace/make_scene.h"

static gbt_make_scene_def small_def(const char *name)
{
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.name = name;
    def.width = 96;
    def.height = 72;
    def.view_count = 8;
    def.points = 300;
    def.samples = 4;
    def.depth = 1;
    return def;
}

/* ---- reading what was written: the test's own reader of the two files that hold tracks ---- */

typedef struct written {
    scene s; /* cameras, from the library's reader */
    size_t point_count, observation_count;
    double (*position)[3]; /* scene-local, as the cameras are */
    double *error;
    uint32_t (*track)[3]; /* [observation_count]: point, image, index in the image */
    double (*pixel)[2];   /* [observation_count] */
    unsigned char *points_file, *images_file;
} written;

static void take(const unsigned char **at, void *out, size_t size)
{
    memcpy(out, *at, size);
    *at += size;
}

static void read_written(const char *folder, written *out)
{
    memset(out, 0, sizeof *out);
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(folder, &split, &out->s, NULL));
    char path[512];
    size_t size;
    snprintf(path, sizeof path, "%s/sparse/0/images.bin", folder);
    assert_ok(file_read(path, &out->images_file, &size, NULL));
    snprintf(path, sizeof path, "%s/sparse/0/points3D.bin", folder);
    assert_ok(file_read(path, &out->points_file, &size, NULL));

    const unsigned char *at = out->images_file, *image_at[64];
    uint64_t count, ids[64] = {0};
    take(&at, &count, 8);
    assert_true(count < 64);
    for (uint64_t i = 0; i < count; i++) {
        uint32_t id;
        uint64_t observations;
        take(&at, &id, 4);
        at += 7 * 8 + 4;
        assert_string_equal((const char *)at, out->s.views[i].name);
        at += strlen((const char *)at) + 1;
        take(&at, &observations, 8);
        image_at[i] = at;
        ids[i] = id;
        at += observations * 24;
    }
    at = out->points_file;
    uint64_t points;
    take(&at, &points, 8);
    out->point_count = (size_t)points;
    out->position = mem_alloc(points, sizeof *out->position, "test", NULL);
    out->error = mem_alloc(points, sizeof *out->error, "test", NULL);
    out->track = mem_alloc(points * count, sizeof *out->track, "test", NULL);
    out->pixel = mem_alloc(points * count, sizeof *out->pixel, "test", NULL);
    for (size_t p = 0; p < points; p++) {
        uint64_t id, length;
        take(&at, &id, 8);
        take(&at, out->position[p], 24);
        for (int k = 0; k < 3; k++)
            out->position[p][k] -= out->s.origin[k];
        at += 3;
        take(&at, &out->error[p], 8);
        take(&at, &length, 8);
        assert_true(length >= 3 && length <= count);
        for (uint64_t k = 0; k < length; k++) {
            uint32_t image_id, index, number = 0;
            take(&at, &image_id, 4);
            take(&at, &index, 4);
            while (number < count && ids[number] != image_id)
                number++;
            assert_true(number < count);
            const unsigned char *observation = image_at[number] + 24 * (size_t)index;
            uint64_t back;
            memcpy(out->pixel[out->observation_count], observation, 16);
            memcpy(&back, observation + 16, 8);
            assert_true(back == id); /* both files tell the same story */
            out->track[out->observation_count][0] = (uint32_t)p,
            out->track[out->observation_count][1] = number, out->track[out->observation_count][2] = index;
            out->observation_count++;
        }
    }
}

static void free_written(written *w)
{
    scene_free(&w->s);
    mem_free(w->position);
    mem_free(w->error);
    mem_free(w->track);
    mem_free(w->pixel);
    mem_free(w->points_file);
    mem_free(w->images_file);
}

static double distance_to(const gbt_camera *camera, const double point[3], double in_camera[3])
{
    for (int k = 0; k < 3; k++)
        in_camera[k] = point[k] - camera->center[k];
    dmat_apply(camera->rotation, in_camera, in_camera);
    return dvec_length(in_camera);
}

/** Observations against cameras, points and exact depths. */
static void check_written(const char *folder, int points_wanted, double point_noise)
{
    written w;
    read_written(folder, &w);
    assert_int_equal(w.point_count, points_wanted);
    assert_int_equal(w.s.points.count, points_wanted);
    assert_int_equal(w.s.view_count, 8);
    image *depth = mem_calloc(w.s.view_count, sizeof *depth, "test", NULL);
    double *sum = mem_calloc(w.point_count, 2 * sizeof *sum, "test", NULL);
    for (size_t v = 0; v < w.s.view_count; v++) {
        char path[512];
        snprintf(path, sizeof path, "%s/depth/%04zu.exr", folder, v);
        assert_ok(image_read(path, &depth[v], NULL));
        assert_int_equal(depth[v].width, 96);
        assert_int_equal(depth[v].height, 72);
    }
    size_t outliers = 0, near = 0, tried = 0;
    for (size_t p = 0; p < w.point_count; p++)
        outliers += p % 100 == 99;
    for (size_t i = 0; i < w.observation_count; i++) {
        const uint32_t p = w.track[i][0], v = w.track[i][1];
        const gbt_camera *camera = &w.s.views[v].camera;
        double in_camera[3], pixel[2];
        const double distance = distance_to(camera, w.position[p], in_camera);
        assert_true(gbt_camera_project(camera, in_camera, pixel));
        const double miss = hypot(pixel[0] - w.pixel[i][0], pixel[1] - w.pixel[i][1]);
        sum[2 * p] += miss;
        sum[2 * p + 1] += 1;
        if (p % 100 == 99)
            continue; /* an outlier, on purpose */
        if (miss > 0.3 * 6 + 6 * point_noise * 80)
            fail_msg("point %u in view %u: %g pixels off", p, v, miss);
        const int x = (int)w.pixel[i][0], y = (int)w.pixel[i][1];
        if (x < 0 || y < 0 || x >= 96 || y >= 72)
            continue; /* the noise moved it out */
        /* The depth at the pixel's centre is not the depth at the point, but mostly near it. */
        tried++;
        near += fabs((double)depth[v].pixels[(size_t)depth[v].channels * ((size_t)y * 96 + (size_t)x)] -
                     distance) < 0.05 * distance;
    }
    if ((double)near < 0.85 * (double)tried)
        fail_msg("%zu of %zu observations agree with the depth of their pixel", near, tried);
    size_t bad = 0;
    for (size_t p = 0; p < w.point_count; p++) {
        assert_true(fabs(sum[2 * p] / sum[2 * p + 1] - w.error[p]) <= 1e-6 * (1 + w.error[p]));
        bad += w.error[p] > 1.5 + 6 * point_noise * 80;
    }
    assert_true(bad <= outliers);
    assert_true(bad * 2 >= outliers); /* outliers really are off */
    for (size_t v = 0; v < w.s.view_count; v++)
        image_free(&depth[v]);
    mem_free(depth);
    mem_free(sum);
    free_written(&w);
}

static void points_and_cameras_are_true(void **state)
{
    const gbt_make_scene_def def = small_def(*state);
    const char *folder = in_folder("%s", def.name);
    assert_ok(gbt_make_scene(&def, folder, NULL));
    check_written(folder, def.points, def.point_noise);
    written w;
    read_written(folder, &w);
    assert_int_equal(w.s.views[0].camera.model, GBT_CAMERA_PINHOLE);
    for (size_t v = 0; v < w.s.view_count; v++) { /* the photos are pictures: neither black nor blank */
        image photo;
        assert_ok(image_read(w.s.views[v].path, &photo, NULL));
        assert_int_equal(photo.width, 96);
        assert_int_equal(photo.height, 72);
        double mean = 0, square = 0;
        const size_t samples = 96 * 72 * 3;
        for (size_t i = 0; i < samples; i++)
            mean += (double)photo.pixels[i] / (double)samples,
                square += (double)photo.pixels[i] * (double)photo.pixels[i] / (double)samples;
        assert_true(mean > 0.25 && mean < 0.8);
        assert_true(square - mean * mean > 0.01);
        image_free(&photo);
    }
    free_written(&w);
    char path[512];
    snprintf(path, sizeof path, "%s/SCENE.md", folder);
    unsigned char *text;
    size_t size;
    assert_ok(file_read(path, &text, &size, NULL));
    assert_non_null(strstr((const char *)text, "gbtrace make-scene"));
    assert_non_null(strstr((const char *)text, def.name));
    mem_free(text);
}

/** Cameras all over it, and no point is found from farther than the scene says. */
static void district_is_seen_in_parts(void **state)
{
    (void)state;
    gbt_make_scene_def def = small_def("district");
    def.width = 32;
    def.height = 24;
    def.view_count = 60;
    def.points = 2000;
    def.depth = false;
    def.samples = 1;
    const char *folder = in_folder("district");
    assert_ok(gbt_make_scene(&def, folder, NULL));
    written w;
    read_written(folder, &w);
    assert_true(w.point_count > 50);
    double low[2] = {0, 0}, high[2] = {0, 0}, in_camera[3];
    for (size_t v = 0; v < w.s.view_count; v++)
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], w.s.views[v].camera.center[k]);
            high[k] = fmax(high[k], w.s.views[v].camera.center[k]);
        }
    assert_true(high[0] - low[0] > 150 && high[1] - low[1] > 150);
    for (size_t i = 0; i < w.observation_count; i++)
        if (w.track[i][0] % 100 != 99) /* not an outlier */
            assert_true(distance_to(&w.s.views[w.track[i][1]].camera, w.position[w.track[i][0]], in_camera) <
                        62);
    free_written(&w);
}

static void gaussians_lie_on_surfaces(void **state)
{
    (void)state;
    enum { COUNT = 1500 };
    gbt_make_scene_def def = small_def("tabletop");
    def.gaussians = COUNT;
    char path[512];
    const char *folder = in_folder("gaussians");
    assert_ok(gbt_make_scene(&def, folder, NULL));
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    scene s;
    gaussian_cloud cloud;
    assert_ok(scene_load(folder, &split, &s, NULL));
    snprintf(path, sizeof path, "%s/gaussians.ply", folder);
    assert_ok(gaussian_file_read(path, &cloud, NULL));
    assert_int_equal(cloud.count, COUNT);
    assert_int_equal(cloud.sh_degree, 3);
    image depth;
    snprintf(path, sizeof path, "%s/depth/0000.exr", folder);
    assert_ok(image_read(path, &depth, NULL));
    const gbt_camera *camera = &s.views[0].camera;
    size_t seen = 0, in_front = 0;
    for (size_t i = 0; i < COUNT; i++) {
        double point[3], in_camera[3], pixel[2];
        for (size_t k = 0; k < 3; k++)
            point[k] = (double)cloud.mean[3 * i + k] - s.origin[k];
        const double distance = distance_to(camera, point, in_camera);
        if (in_camera[2] <= 0 || !gbt_camera_project(camera, in_camera, pixel) || pixel[0] < 0 ||
            pixel[1] < 0 || pixel[0] >= 96 || pixel[1] >= 72)
            continue;
        const size_t at = (size_t)pixel[1] * 96 + (size_t)pixel[0];
        const double there = (double)depth.pixels[(size_t)depth.channels * at];
        seen += fabs(there - distance) < 0.03 * distance;
        in_front += distance < 0.9 * there;
    }
    assert_true(seen > COUNT / 10);     /* on what the camera sees */
    assert_true(in_front < COUNT / 50); /* and next to nothing in the air before it */
    image_free(&depth);
    gaussian_cloud_free(&cloud);
    scene_free(&s);
}

static void distorted_cameras_are_true(void **state)
{
    (void)state;
    gbt_make_scene_def def = small_def("tabletop");
    def.lens = GBT_MAKE_SCENE_DISTORTED;
    const char *folder = in_folder("distorted");
    assert_ok(gbt_make_scene(&def, folder, NULL));
    check_written(folder, def.points, def.point_noise);
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    scene s;
    assert_ok(scene_load(folder, &split, &s, NULL));
    assert_int_equal(s.views[0].camera.model, GBT_CAMERA_OPENCV);
    assert_true(s.views[0].camera.params[4] != 0);
    scene_free(&s);
}

static void lenses_that_see_far_around(void **state)
{
    (void)state;
    static const struct {
        gbt_make_scene_lens lens;
        gbt_camera_model model;
    } rows[] = {{GBT_MAKE_SCENE_FISHEYE, GBT_CAMERA_FISHEYE},
                {GBT_MAKE_SCENE_PANORAMA, GBT_CAMERA_EQUIRECTANGULAR}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        gbt_make_scene_def def = small_def("courtyard");
        def.depth = 0;
        def.samples = 1;
        def.lens = rows[i].lens;
        const char *folder = in_folder("%s", i == 0 ? "fisheye" : "panorama");
        assert_ok(gbt_make_scene(&def, folder, NULL));
        written w;
        read_written(folder, &w);
        assert_int_equal(w.s.views[0].camera.model, rows[i].model);
        assert_int_equal(w.point_count, def.points);
        size_t behind = 0;
        for (size_t k = 0; k < w.observation_count; k++) {
            double in_camera[3];
            distance_to(&w.s.views[w.track[k][1]].camera, w.position[w.track[k][0]], in_camera);
            behind += in_camera[2] < 0;
        }
        assert_true(behind > 10); /* corners of a fisheye see behind themselves, too */
        free_written(&w);
    }
    gbt_make_scene_def def = small_def("courtyard");
    def.lens = (gbt_make_scene_lens)99;
    assert_int_equal(gbt_make_scene(&def, in_folder("no lens"), NULL), GBT_ERR_ARGUMENT);
}

/* What a moving camera sees of a point is where its rays say: the exact depth there ends at the point. */
static void rolling_cameras_are_true(void **state)
{
    (void)state;
    gbt_make_scene_def def = small_def("courtyard");
    def.lens = GBT_MAKE_SCENE_ROLLING;
    def.samples = 1;
    def.point_noise = 0;
    const char *folder = in_folder("rolling");
    assert_ok(gbt_make_scene(&def, folder, NULL));
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    scene s;
    assert_ok(scene_load(folder, &split, &s, NULL));
    assert_int_equal(s.view_count, def.view_count);
    assert_int_equal(s.points.count, def.points);
    size_t seen = 0, moved = 0;
    for (size_t v = 0; v < s.view_count; v++) {
        char path[512];
        image depth;
        const gbt_camera *camera = &s.views[v].camera;
        gbt_camera still = *camera;
        still.shutter = GBT_CAMERA_SHUTTER_GLOBAL;
        assert_int_equal(camera->shutter, GBT_CAMERA_SHUTTER_ROWS);
        snprintf(path, sizeof path, "%s/depth/%04zu.exr", folder, v);
        assert_ok(image_read(path, &depth, NULL));
        for (size_t p = 0; p < s.points.count; p++) {
            double point[3], pixel[2], other[2];
            for (size_t k = 0; k < 3; k++)
                point[k] = (double)s.points.position[3 * p + k];
            if (!gbt_camera_pixel(camera, point, pixel) || pixel[0] < 0 || pixel[1] < 0 || pixel[0] >= 96 ||
                pixel[1] >= 72)
                continue;
            const gbt_camera at = gbt_camera_at(camera, pixel[0], pixel[1]);
            const double to[3] = {point[0] - at.center[0], point[1] - at.center[1], point[2] - at.center[2]},
                         there =
                             (double)depth
                                 .pixels[(size_t)depth.channels * ((size_t)pixel[1] * 96 + (size_t)pixel[0])];
            seen += fabs(there - dvec_length(to)) < 0.02 * dvec_length(to);
            moved += gbt_camera_pixel(&still, point, other) &&
                     dvec_length2(other[0] - pixel[0], other[1] - pixel[1]) > 0.5;
        }
        image_free(&depth);
    }
    assert_true(seen > 3 * s.points.count * 9 / 10); /* three views each, but for a few */
    assert_true(moved > seen / 4);
    scene_free(&s);
}

/* Without noise a point is on the surface: the exact depth along its first ray ends at it. With noise it is
   moved by what was asked. */
static void noise_is_what_was_asked(void **state)
{
    (void)state;
    gbt_make_scene_def def = small_def("tabletop");
    def.depth = 0;
    def.samples = 1;
    def.point_noise = 0;
    assert_ok(gbt_make_scene(&def, in_folder("exact"), NULL));
    def.point_noise = 0.01;
    assert_ok(gbt_make_scene(&def, in_folder("noisy"), NULL));
    written exact, noisy;
    read_written(in_folder("exact"), &exact);
    read_written(in_folder("noisy"), &noisy);
    assert_int_equal(exact.point_count, noisy.point_count);
    double *nearest = mem_alloc(exact.point_count, sizeof *nearest, "test", NULL);
    for (size_t p = 0; p < exact.point_count; p++)
        nearest[p] = INFINITY;
    for (size_t i = 0; i < exact.observation_count; i++) {
        double in_camera[3];
        const uint32_t p = exact.track[i][0];
        nearest[p] = fmin(
            nearest[p], distance_to(&exact.s.views[exact.track[i][1]].camera, exact.position[p], in_camera));
    }
    double square = 0;
    size_t used = 0;
    for (size_t p = 0; p < exact.point_count; p++) {
        if (p % 100 == 99)
            continue; /* outliers have moved, and with them their distance */
        for (int k = 0; k < 3; k++) {
            const double moved =
                noisy.position[p][k] + noisy.s.origin[k] - exact.position[p][k] - exact.s.origin[k];
            square += moved * moved / (nearest[p] * nearest[p]);
            used++;
        }
    }
    /* chi-square with about 900 degrees of freedom: its root is within 10 % */
    assert_true(fabs(sqrt(square / (double)used) - 0.01) < 0.001);
    mem_free(nearest);
    free_written(&exact);
    free_written(&noisy);
}

static void data_of_others_stay(void **state)
{
    (void)state;
    const gbt_make_scene_def def = small_def("tabletop");
    gbt_error err = {0};
    assert_ok(file_make_folder(in_folder("others/sparse"), NULL));
    assert_int_equal(gbt_make_scene(&def, in_folder("others"), &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "others/sparse: exists, but not from a scene that was made here"));
    assert_false(file_exists(in_folder("others/SCENE.md")) || file_exists(in_folder("others/images")));
}

static void same_seed_same_bytes(void **state)
{
    (void)state;
    static const char *const files[] = {"images/0000.png",       "images/0005.png",
                                        "sparse/0/cameras.bin",  "sparse/0/images.bin",
                                        "sparse/0/points3D.bin", "SCENE.md"};
    gbt_make_scene_def def = small_def("tabletop");
    /* 3 x 3: both passes of the sampler */
    def.samples = 5;
    def.view_count = 6;
    def.width = 64;
    def.height = 48;
    const int threads[2] = {1, 2};
    const int before = parallel_threads();
    for (int i = 0; i < 2; i++) {
        parallel_set_threads(threads[i]);
        assert_ok(gbt_make_scene(&def, in_folder("threads%d", threads[i]), NULL));
    }
    parallel_set_threads(before);
    for (size_t f = 0; f < sizeof files / sizeof files[0]; f++)
        assert_same_file(in_folder("threads1/%s", files[f]), in_folder("threads2/%s", files[f]));
    image depth[2]; /* EXR headers hold the time of writing, so only their values can be equal */
    assert_ok(image_read(in_folder("threads1/depth/0003.exr"), &depth[0], NULL));
    assert_ok(image_read(in_folder("threads2/depth/0003.exr"), &depth[1], NULL));
    assert_memory_equal(depth[0].pixels, depth[1].pixels,
                        (size_t)64 * 48 * (size_t)depth[0].channels * sizeof *depth[0].pixels);
    image_free(&depth[0]);
    image_free(&depth[1]);
    def.seed = 2;
    def.samples = 1;
    assert_ok(gbt_make_scene(&def, in_folder("seed2"), NULL));
    assert_false(
        is_same_file(in_folder("threads1/sparse/0/points3D.bin"), in_folder("seed2/sparse/0/points3D.bin")));
}

typedef struct refusal {
    const char *name;
    void (*spoil)(gbt_make_scene_def *def);
    const char *says;
} refusal;

static void width_0(gbt_make_scene_def *d) { d->width = 0; }
static void width_7(gbt_make_scene_def *d) { d->width = 7; }
static void width_8193(gbt_make_scene_def *d) { d->width = 8193; }
static void height_negative(gbt_make_scene_def *d) { d->height = -240; }
static void views_2(gbt_make_scene_def *d) { d->view_count = 2; }
static void views_10000(gbt_make_scene_def *d) { d->view_count = 10000; }
static void points_0(gbt_make_scene_def *d) { d->points = 0; }
static void points_negative(gbt_make_scene_def *d) { d->points = -1; }
static void samples_0(gbt_make_scene_def *d) { d->samples = 0; }
static void samples_1025(gbt_make_scene_def *d) { d->samples = 1025; }
static void noise_nan(gbt_make_scene_def *d) { d->point_noise = NAN; }
static void noise_negative(gbt_make_scene_def *d) { d->point_noise = -1e-9; }
static void noise_big(gbt_make_scene_def *d) { d->point_noise = 0.11; }
static void name_unknown(gbt_make_scene_def *d) { d->name = "kitchen"; }
static void name_null(gbt_make_scene_def *d) { d->name = NULL; }
static void all_zero(gbt_make_scene_def *d) { memset(d, 0, sizeof *d); }

static refusal refusals[] = {
    {"width 0", width_0, "width"},
    {"width 7", width_7, "width: 7"},
    {"width 8193", width_8193, "8192"},
    {"height -240", height_negative, "height"},
    {"2 views", views_2, "view_count: 2"},
    {"10000 views", views_10000, "view_count"},
    {"0 points", points_0, "points"},
    {"-1 points", points_negative, "points"},
    {"0 samples", samples_0, "samples"},
    {"1025 samples", samples_1025, "samples"},
    {"noise NaN", noise_nan, "noise"},
    {"noise below 0", noise_negative, "noise"},
    {"noise 0.11", noise_big, "noise"},
    {"unknown name", name_unknown, "tabletop, courtyard, terrain, district"},
    {"no name", name_null, "tabletop, courtyard, terrain, district"},
    {"zeroed def", all_zero, "gbt_make_scene_def_default"},
};

static void is_refused(void **state)
{
    const refusal *r = *state;
    gbt_make_scene_def def = small_def("tabletop");
    r->spoil(&def);
    gbt_error err = {0};
    assert_int_equal(gbt_make_scene(&def, in_folder("refused"), &err), GBT_ERR_ARGUMENT);
    assert_int_equal(err.status, GBT_ERR_ARGUMENT);
    if (strstr(err.text, r->says) == NULL)
        fail_msg("\"%s\" does not say \"%s\"", err.text, r->says);
    assert_false(file_exists(in_folder("refused"))); /* refused before anything was made */
}

static void missing_arguments_are_refused(void **state)
{
    (void)state;
    const gbt_make_scene_def def = small_def("tabletop");
    assert_int_equal(gbt_make_scene(NULL, in_folder("x"), NULL), GBT_ERR_ARGUMENT);
    assert_int_equal(gbt_make_scene(&def, NULL, NULL), GBT_ERR_ARGUMENT);
}

static void unwritable_folder_is_io(void **state)
{
    (void)state;
    const gbt_make_scene_def def = small_def("tabletop");
    assert_ok(file_write_atomic(in_folder("file"), "x", 1, NULL));
    gbt_error err = {0};
    assert_int_equal(gbt_make_scene(&def, in_folder("file"), &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "file"));
    err = (gbt_error){0};
    assert_int_equal(gbt_make_scene(&def, in_folder("file/below"), &err), GBT_ERR_IO);
    /* A photo that cannot be written: its name is taken by a folder. */
    gbt_make_scene_def tiny = def;
    tiny.width = tiny.height = 8;
    tiny.view_count = 3;
    tiny.samples = 1;
    tiny.depth = 0;
    assert_ok(file_make_folder(in_folder("taken/images/0001.png/x"), NULL));
    err = (gbt_error){0};
    assert_int_equal(gbt_make_scene(&tiny, in_folder("taken"), &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "0001.png"));
}

static void names_are_the_scenes(void **state)
{
    (void)state;
    const char *const *names = gbt_make_scene_names();
    assert_string_equal(names[0], gbt_make_scene_def_default().name);
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.width = def.height = 8;
    def.view_count = 3;
    def.points = 5;
    def.samples = 1;
    int count = 0;
    for (; names[count] != NULL; count++) {
        def.name = names[count];
        assert_ok(gbt_make_scene(&def, in_folder("named"), NULL));
        const char *summary = gbt_make_scene_summary(names[count]);
        assert_true(summary != NULL && strlen(summary) > 20 && strlen(summary) < 100 &&
                    strchr(summary, '\n') == NULL);
    }
    assert_int_equal(count, 4);
    assert_null(gbt_make_scene_summary("none"));
}

static void no_memory_is_a_status(void **state)
{
    (void)state;
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.width = def.height = 8;
    def.view_count = 3;
    def.points = 20;
    def.samples = 1;
    for (long k = 0;; k += 1 + k / 4) { /* every allocation would take a minute */
        gbt_error err = {0};
        mem_fail_after(k);
        const gbt_status status = gbt_make_scene(&def, in_folder("nomem"), &err);
        mem_fail_after(-1);
        if (status == GBT_OK) {
            assert_true(k > 50);
            break;
        }
        assert_int_equal(status, GBT_ERR_NO_MEMORY);
        assert_true(err.text[0] != '\0');
        assert_true(k < 100000);
    }
}

int main(void)
{
    enum { REFUSALS = sizeof refusals / sizeof refusals[0], OTHERS = 12 };
    static char tabletop[] = "tabletop", courtyard[] = "courtyard", terrain[] = "terrain";
    struct CMUnitTest tests[OTHERS + REFUSALS] = {
        {"tabletop: points and cameras are true", points_and_cameras_are_true, NULL, NULL, tabletop},
        {"courtyard: points and cameras are true", points_and_cameras_are_true, NULL, NULL, courtyard},
        {"terrain: points and cameras are true", points_and_cameras_are_true, NULL, NULL, terrain},
        cmocka_unit_test(district_is_seen_in_parts),
        cmocka_unit_test(distorted_cameras_are_true),
        cmocka_unit_test(gaussians_lie_on_surfaces),
        cmocka_unit_test(lenses_that_see_far_around),
        cmocka_unit_test(rolling_cameras_are_true),
        cmocka_unit_test(noise_is_what_was_asked),
        cmocka_unit_test(same_seed_same_bytes),
        cmocka_unit_test(data_of_others_stay),
        cmocka_unit_test(missing_arguments_are_refused),
        cmocka_unit_test(unwritable_folder_is_io),
        cmocka_unit_test(names_are_the_scenes),
        cmocka_unit_test(no_memory_is_a_status),
    };
    for (int i = 0; i < REFUSALS; i++)
        tests[OTHERS + i] = (struct CMUnitTest){
            .name = refusals[i].name, .test_func = is_refused, .initial_state = &refusals[i]};
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
