/* SPDX-License-Identifier: Apache-2.0 */
/* tests/cells/test_cells.c -- pictures cell by cell against those of the same file in memory, on the scenes
   on which renderers fail (docs/stability.md names them A1 to A10); and what is refused. */
#include "folder.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"
#include "cells/view.h"
#include "data/bytes.h"
#include "data/gaussian_file.h"
#include "frame/frame.h"

enum { WIDTH = 72, HEIGHT = 56, CHUNK_ROWS = 40 };

static const size_t plenty = (size_t)1 << 30;
static const char *ply;

static float between(uint64_t stream, uint64_t index, float low, float high)
{
    return low + (high - low) * rng_uniform(11, stream, index);
}

static void random_gaussian(gaussian_cloud *c, size_t i)
{
    double q[4];
    for (uint64_t k = 0; k < 4; k++)
        q[k] = rng_normal(11, 1, 4 * i + k);
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (size_t k = 0; k < 4; k++)
        c->quat[4 * i + k] = (float)(q[k] / length);
    for (size_t k = 0; k < 3; k++) {
        c->mean[3 * i + k] = between(2, 3 * i + k, -4, 4);
        c->scale_log[3 * i + k] = between(3, 3 * i + k, -3.5f, -0.8f);
    }
    c->opacity[i] = between(4, i, 0.05f, 0.95f);
    for (size_t k = 0; k < 48; k++)
        c->sh[48 * i + k] = between(5, 48 * i + k, -0.4f, 0.4f);
}

static void random_cloud(gaussian_cloud *c, size_t count)
{
    assert_ok(gaussian_cloud_alloc(c, count, NULL));
    c->sh_degree = 3;
    for (size_t i = 0; i < count; i++)
        random_gaussian(c, i);
}

static gbt_camera camera_at(double x, double y, double z)
{
    gbt_camera camera = {.model = GBT_CAMERA_PINHOLE,
                         .width = WIDTH,
                         .height = HEIGHT,
                         .params = {60, 60, 0.5 * WIDTH, 0.5 * HEIGHT}};
    const double origin[3] = {x, y, z}, target[3] = {0.1, 0.2, -0.1}, up[3] = {0, 0, 1};
    assert_true(gbt_camera_look_at(origin, target, up, &camera));
    return camera;
}

/* ---- the two ways ---- */

typedef struct both {
    gaussian_cloud cloud; /* as the file gives it, around the middle of its means */
    double middle[3];
    cell_store store;
    frame whole;
    cell_drawer drawer;
    trace_settings settings;
    float variance;
} both;

/* Opens the file both ways. */
static void open_written(both *b)
{
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    memset(b, 0, sizeof *b);
    assert_ok(gaussian_file_read(ply, &b->cloud, NULL));
    for (size_t i = 0; i < 3 * b->cloud.count; i++) {
        low[i % 3] = fmin(low[i % 3], (double)b->cloud.mean[i]);
        high[i % 3] = fmax(high[i % 3], (double)b->cloud.mean[i]);
    }
    gaussian_middle(b->cloud.mean, b->cloud.count, low, high, b->middle);
    for (size_t i = 0; i < 3 * b->cloud.count; i++)
        b->cloud.mean[i] = (float)((double)b->cloud.mean[i] - b->middle[i % 3]);
    assert_ok(cell_store_make(ply, test_folder, plenty, CHUNK_ROWS, &b->store, NULL));
    assert_int_equal(b->store.count, b->cloud.count);
    for (int k = 0; k < 3; k++)
        assert_true(b->store.origin[k] == b->cloud.origin[k] + b->middle[k]);
    b->settings = trace_settings_default();
    b->settings.background[1] = 0.3f;
    b->variance = 0.25f;
    b->drawer.cell_bytes = 340 * 400;
}

/* Writes the cloud, which is gone then, and opens it. */
static void open_both(both *b, gaussian_cloud *cloud)
{
    static const double nowhere[3] = {0, 0, 0};
    assert_ok(gaussian_file_write(ply, cloud, nowhere, NULL));
    gaussian_cloud_free(cloud);
    open_written(b);
}

static void close_both(both *b)
{
    gaussian_cloud_free(&b->cloud);
    cell_store_free(&b->store);
    cell_drawer_free(&b->drawer);
    frame_free(&b->whole);
}

/* Cameras are given around the middle of the means. @return the largest difference */
static double largest_difference(both *b, const gbt_camera *camera)
{
    image cells = {0};
    const ray_shot shot = ray_shot_of(camera);
    b->whole.draw.footprint = b->variance;
    assert_ok(frame_render_with(&b->whole, frame_plain(&b->cloud), &shot, &b->settings, NULL, NULL));
    assert_ok(cell_draw(&b->drawer, &b->store, &shot, &b->settings, b->variance, plenty, &cells, NULL));
    assert_int_equal(cells.width, camera->width);
    double largest = 0;
    for (size_t i = 0; i < 3 * (size_t)cells.width * (size_t)cells.height; i++) {
        assert_true(isfinite(cells.pixels[i]));
        largest = fmax(largest, fabs((double)cells.pixels[i] - (double)b->whole.rgb.pixels[i]));
    }
    image_free(&cells);
    return largest;
}

static void check_same(both *b, const gbt_camera *camera, double limit)
{
    const double difference = largest_difference(b, camera);
    if (!(difference <= limit))
        fail_msg("largest difference %g (limit %g), %zu cells", difference, limit, b->drawer.drawn_cells);
}

static const double rounding = 3e-6;

/* ---- scenes ---- */

static void views_from_all_sides(void **state)
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 3000);
    open_both(&b, &cloud);
    for (int i = 0; i < 12; i++) {
        const gbt_camera camera = camera_at(9 * cos(i), 9 * sin(i), 0.7 * i - 4);
        check_same(&b, &camera, rounding);
        assert_true(b.drawer.drawn_cells > 4);
    }
    for (int i = 0; i < 6; i++) { /* from within */
        const gbt_camera camera = camera_at(2 * cos(i), 2 * sin(i), 0.3 * i - 1);
        check_same(&b, &camera, rounding);
    }
    close_both(&b);
}

static void turning(void **state) /* A1 */
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 1500);
    open_both(&b, &cloud);
    gbt_camera camera = camera_at(6, 1, 1);
    for (int i = 0; i < 20; i++) {
        double turned[9];
        const double c = cos(1e-3), s = sin(1e-3);
        for (int k = 0; k < 3; k++) {
            turned[k] = c * camera.rotation[k] - s * camera.rotation[6 + k];
            turned[3 + k] = camera.rotation[3 + k];
            turned[6 + k] = s * camera.rotation[k] + c * camera.rotation[6 + k];
        }
        memcpy(camera.rotation, turned, sizeof turned);
        check_same(&b, &camera, rounding);
    }
    close_both(&b);
}

static void needles_and_pancakes(void **state) /* A2 */
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 1500);
    for (size_t i = 0; i < cloud.count; i++) {
        cloud.scale_log[3 * i] = 0.3f;
        cloud.scale_log[3 * i + 1] = i % 2 == 0 ? 0.3f : -between(9, i, 1, 8.5f);
        cloud.scale_log[3 * i + 2] = -between(10, i, 1, 8.5f);
    }
    open_both(&b, &cloud);
    b.drawer.cell_bytes = 740 * 1300; /* they reach everywhere */
    for (int i = 0; i < 3; i++) {
        const gbt_camera camera = camera_at(8 * cos(i), 8 * sin(i), i);
        check_same(&b, &camera, rounding);
    }
    close_both(&b);
}

static void camera_inside(void **state) /* A3 */
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 1200);
    for (size_t i = 0; i < 40; i++)
        for (size_t k = 0; k < 3; k++)
            cloud.scale_log[3 * i + k] = 0.7f;
    open_both(&b, &cloud);
    b.drawer.cell_bytes = 340 * 600;
    for (size_t i = 0; i < 8; i++) {
        const gbt_camera camera = camera_at((double)b.cloud.mean[3 * i], (double)b.cloud.mean[3 * i + 1],
                                            (double)b.cloud.mean[3 * i + 2]);
        check_same(&b, &camera, rounding);
    }
    close_both(&b);
}

static void many_in_one_place(void **state) /* A4 */
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 3000);
    for (size_t i = 0; i < 2000; i++) { /* the first half is red, and lies before the second */
        cloud.mean[3 * i] = cloud.mean[3 * i + 1] = cloud.mean[3 * i + 2] = 0.5f;
        for (size_t k = 0; k < 3; k++)
            cloud.scale_log[3 * i + k] = -0.5f;
        cloud.opacity[i] = 0.004f;
        memset(cloud.sh + 48 * i, 0, 48 * sizeof(float));
        cloud.sh[48 * i + (i < 1000 ? 0 : 2)] = 1.5f;
    }
    open_both(&b, &cloud);
    b.settings.alpha_min = 1e-4f;
    b.drawer.cell_bytes = 740 * 2600;
    const gbt_camera camera = camera_at(7, 2, 1);
    check_same(&b, &camera, 1e-5);
    close_both(&b);
}

static void far_from_the_origin(void **state) /* A5 */
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 1500);
    for (size_t i = 0; i < cloud.count; i++)
        cloud.mean[3 * i] += 40000;
    open_both(&b, &cloud);
    const gbt_camera camera = camera_at(8, 2, 1);
    check_same(&b, &camera, rounding);
    close_both(&b);
}

/* Map coordinates as doubles, of which floats would keep half a unit. */
static void means_in_double(void **state)
{
    (void)state;
    static const double place[3] = {691234.25, 5334567.5, 80.75};
    static const char *const names[] = {"x",      "y",       "z",       "f_dc_0",  "f_dc_1",
                                        "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                                        "rot_0",  "rot_1",   "rot_2",   "rot_3"};
    both b;
    gaussian_cloud c;
    sink s = {0};
    random_cloud(&c, 1500);
    sink_put_text(&s, "ply\nformat binary_little_endian 1.0\nelement vertex 1500\n");
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        char line[64];
        snprintf(line, sizeof line, "property %s %s\n", k < 3 ? "double" : "float", names[k]);
        sink_put_text(&s, line);
    }
    sink_put_text(&s, "end_header\n");
    for (size_t i = 0; i < c.count; i++) {
        for (size_t k = 0; k < 3; k++)
            sink_put_f64(&s, (double)c.mean[3 * i + k] + place[k]);
        for (size_t k = 0; k < 3; k++)
            sink_put_f32(&s, c.sh[48 * i + k]);
        sink_put_f32(&s, logf(c.opacity[i] / (1 - c.opacity[i])));
        for (size_t k = 0; k < 3; k++)
            sink_put_f32(&s, c.scale_log[3 * i + k]);
        for (size_t k = 0; k < 4; k++)
            sink_put_f32(&s, c.quat[4 * i + k]);
    }
    assert_ok(sink_write(&s, ply));
    open_written(&b);
    for (size_t i = 0; i < 3 * c.count; i++)
        assert_true(fabs((double)b.cloud.mean[i] + b.store.origin[i % 3] - place[i % 3] - (double)c.mean[i]) <
                    1e-6);
    gaussian_cloud_free(&c);
    const gbt_camera camera = camera_at(8, 2, 1);
    check_same(&b, &camera, rounding);
    close_both(&b);
}

/* It must not take the digits of the others' coordinates. */
static void one_far_from_the_others(void **state)
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 900);
    cloud.mean[3 * 700] = 1e9f;
    open_both(&b, &cloud);
    for (size_t k = 0; k < 3; k++)
        assert_true(fabs(b.store.origin[k]) < 4);
    const gbt_camera camera = camera_at(8, 2, 1);
    check_same(&b, &camera, rounding);
    close_both(&b);
}

static void fog(void **state) /* A6 */
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 6000);
    for (size_t i = 0; i < cloud.count; i++) {
        cloud.opacity[i] = 0.006f;
        for (size_t k = 0; k < 3; k++)
            cloud.scale_log[3 * i + k] = -0.2f;
    }
    open_both(&b, &cloud);
    b.settings.alpha_min = 1e-3f;
    b.drawer.cell_bytes = 340 * 5000;
    const gbt_camera camera = camera_at(8, 2, 1);
    check_same(&b, &camera, 1e-5);
    close_both(&b);
}

static void opaque_stacks(void **state) /* A7: rays end in one cell and see nothing of those behind */
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 3000);
    for (size_t i = 0; i < cloud.count; i++)
        cloud.opacity[i] = i % 3 == 0 ? 1 : 0.99f;
    open_both(&b, &cloud);
    for (int i = 0; i < 4; i++) {
        const gbt_camera camera = camera_at(7 * cos(i), 7 * sin(i), 1);
        check_same(&b, &camera, rounding);
    }
    close_both(&b);
}

static void bad_values(void **state) /* A8 */
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 1000);
    for (size_t i = 0; i < 60; i++) {
        const float bad[5] = {NAN, INFINITY, -INFINITY, 1e38f, -1e38f};
        float *const fields[4] = {cloud.mean + 3 * i, cloud.scale_log + 3 * i, cloud.quat + 4 * i,
                                  cloud.sh + 48 * i};
        *fields[i % 4] = bad[i / 4 % 5];
    }
    open_both(&b, &cloud);
    const gbt_camera camera = camera_at(8, 2, 1);
    check_same(&b, &camera, rounding);
    close_both(&b);
}

static void wide_lenses(void **state) /* A10: lists of six faces */
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 1500);
    open_both(&b, &cloud);
    b.drawer.cell_bytes = 340 * 500;
    gbt_camera camera = camera_at(1, 2, 0.5);
    camera.model = GBT_CAMERA_EQUIRECTANGULAR;
    camera.params[0] = WIDTH;
    camera.params[1] = HEIGHT;
    check_same(&b, &camera, 2e-5);
    assert_true(b.drawer.drawn_cells > 2);
    assert_true(b.drawer.scene.listed && b.drawer.scene.lists.view.face_count == LIST_FACES);
    camera = camera_at(1, 2, 0.5);
    camera.model = GBT_CAMERA_SIMPLE_FISHEYE;
    camera.params[0] = 20;
    camera.params[1] = 0.5 * WIDTH;
    camera.params[2] = 0.5 * HEIGHT;
    check_same(&b, &camera, 2e-5);
    close_both(&b);
}

static void cuts_through_the_eye(void **state)
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 2000);
    open_both(&b, &cloud);
    gbt_camera camera = camera_at(0.3, 0.4, 0.5);
    for (size_t i = 0; i < 8; i++) {
        camera.center[b.store.cuts[i].axis] = (double)b.store.cuts[i].at;
        check_same(&b, &camera, rounding);
    }
    close_both(&b);
}

static void nothing_in_view(void **state)
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 300);
    open_both(&b, &cloud);
    gbt_camera camera = camera_at(8, 2, 1);
    for (int k = 0; k < 3; k++) /* away from all of them */
        for (int row = 0; row < 3; row += 2)
            camera.rotation[3 * row + k] = -camera.rotation[3 * row + k];
    assert_true(largest_difference(&b, &camera) == 0);
    assert_int_equal(b.drawer.drawn_cells, 0);
    close_both(&b);
}

/* Shares drawn one by one, and their layers blended, as by so many processes. @return the largest difference
   to the picture drawn alone */
static double difference_of_shares(both *b, const ray_shot *shot, int count, size_t *again)
{
    enum { MOST = 9, PIXELS = WIDTH * HEIGHT };
    float *layers[MOST], *sum = malloc(PIXELS * CELL_LAYER_FLOATS * sizeof *sum),
                         *enter = malloc((size_t)count * PIXELS * sizeof *enter);
    image whole = {0}, part = {0};
    size_t next = 0, cells = 0;
    assert_ok(cell_draw(&b->drawer, &b->store, shot, &b->settings, b->variance, plenty, &whole, NULL));
    for (int k = 0; k < count; k++) {
        b->drawer.share = (cell_share){k, count};
        assert_ok(cell_draw(&b->drawer, &b->store, shot, &b->settings, b->variance, plenty, &part, NULL));
        assert_true(b->drawer.drawn_cells == 0 || b->drawer.scene.listed); /* as those of other processes */
        assert_int_equal(b->drawer.first, next);
        next = b->drawer.end;
        cells += b->drawer.drawn_cells;
        layers[k] = malloc(PIXELS * CELL_LAYER_FLOATS * sizeof(float));
        cell_layer_make(&b->drawer, &part, layers[k]);
    }
    assert_int_equal(next, b->store.chunk_count);
    assert_true(cells >= (size_t)count);
    cell_layers_blend((const float *const *)layers, count, PIXELS, b->settings.transmittance_min, sum, enter);
    *again = 0;
    for (int k = 0; k < count; k++) {
        for (size_t i = 0; i < PIXELS; i++)
            *again += enter[(size_t)k * PIXELS + i] > 0;
        b->drawer.share = (cell_share){k, count};
        b->drawer.share_T_front = enter + (size_t)k * PIXELS;
        assert_ok(cell_draw(&b->drawer, &b->store, shot, &b->settings, b->variance, plenty, &part, NULL));
        cell_layer_make(&b->drawer, &part, layers[k]);
    }
    cell_layers_add((const float *const *)layers, count, PIXELS, enter, sum);
    b->drawer.share = (cell_share){0};
    b->drawer.share_T_front = NULL;
    double largest = 0;
    for (size_t i = 0; i < (size_t)3 * PIXELS; i++) {
        const float *at = sum + i / 3 * CELL_LAYER_FLOATS;
        const double value = (double)(at[i % 3] + at[3] * b->settings.background[i % 3]);
        largest = fmax(largest, fabs(value - (double)whole.pixels[i]));
    }
    for (int k = 0; k < count; k++)
        free(layers[k]);
    free(sum);
    free(enter);
    image_free(&whole);
    image_free(&part);
    return largest;
}

/* As views_from_all_sides() and opaque_stacks(), in shares. */
static void check_shares(gaussian_cloud *cloud, bool ends)
{
    static const int counts[] = {2, 3, 9};
    both b;
    size_t again, sum = 0;
    open_both(&b, cloud);
    for (int i = 0; i < 9; i++) {
        const gbt_camera camera = camera_at((9 - i) * cos(i), (9 - i) * sin(i), 0.7 * i - 3);
        const ray_shot shot = ray_shot_of(&camera);
        const double difference = difference_of_shares(&b, &shot, counts[i % 3], &again);
        if (!(difference <= rounding))
            fail_msg("view %d: largest difference %g (limit %g)", i, difference, rounding);
        sum += again;
    }
    assert_int_equal(sum > 0, ends);
    close_both(&b);
}

/* Chunks that are out of view weigh nothing, the farthest ones, too; they still belong to a share, for
   Gaussians of nearer chunks reach into them. */
static void the_last_chunks_are_out_of_view(void **state)
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    size_t again;
    random_cloud(&cloud, 3000);
    open_both(&b, &cloud);
    gbt_camera camera = camera_at(0.3, 0.4, 0.5); /* amid the cloud, so half of it is behind */
    for (int i = 0; i < 2; i++) {
        const ray_shot shot = ray_shot_of(&camera);
        assert_true(difference_of_shares(&b, &shot, 3, &again) <= rounding);
        for (int k = 0; k < 3; k++) /* to the other side */
            for (int row = 0; row < 3; row += 2)
                camera.rotation[3 * row + k] = -camera.rotation[3 * row + k];
    }
    close_both(&b);
}

static void shares_make_the_picture(void **state)
{
    (void)state;
    gaussian_cloud cloud;
    random_cloud(&cloud, 3000);
    for (size_t i = 0; i < cloud.count; i++)
        cloud.opacity[i] *= 0.1f;
    check_shares(&cloud, false);
}

static void rays_that_end_in_a_share(void **state)
{
    (void)state;
    gaussian_cloud cloud;
    random_cloud(&cloud, 3000);
    for (size_t i = 0; i < cloud.count; i++)
        cloud.opacity[i] = i % 3 == 0 ? 1 : 0.99f;
    check_shares(&cloud, true);
}

static void threads_give_the_same_bits(void **state)
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 2000);
    open_both(&b, &cloud);
    const gbt_camera camera = camera_at(6, 2, 1);
    const ray_shot shot = ray_shot_of(&camera);
    const int before = parallel_threads();
    image picture[3] = {{0}, {0}, {0}};
    for (int i = 0; i < 3; i++) {
        cell_store store = {0};
        parallel_set_threads(i + 1);
        assert_ok(cell_store_make(ply, test_folder, plenty, CHUNK_ROWS, &store, NULL));
        assert_ok(cell_draw(&b.drawer, &store, &shot, &b.settings, b.variance, plenty, &picture[i], NULL));
        cell_store_free(&store);
    }
    parallel_set_threads(before);
    for (int i = 1; i < 3; i++)
        assert_memory_equal(picture[0].pixels, picture[i].pixels, 3 * WIDTH * HEIGHT * sizeof(float));
    for (int i = 0; i < 3; i++)
        image_free(&picture[i]);
    close_both(&b);
}

static void what_cannot_be_drawn(void **state)
{
    (void)state;
    both b;
    gaussian_cloud cloud;
    random_cloud(&cloud, 1000);
    open_both(&b, &cloud);
    image out = {0};
    gbt_error err = {0};
    gbt_camera camera = camera_at(6, 2, 1);
    ray_shot shot = ray_shot_of(&camera);
    assert_int_equal(cell_draw(&b.drawer, &b.store, &shot, &b.settings, 0, 1 << 20, &out, &err),
                     GBT_ERR_NO_MEMORY);
    assert_non_null(strstr(err.text, "memory: 1 MiB is too little for a picture of 72 x 56 (wanted "));
    memset(&err, 0, sizeof err);
    b.drawer.cell_bytes = 340 * 3; /* less than one chunk */
    assert_int_equal(cell_draw(&b.drawer, &b.store, &shot, &b.settings, 0, plenty, &out, &err),
                     GBT_ERR_NO_MEMORY);
    assert_non_null(strstr(err.text, "of one place"));
    memset(&err, 0, sizeof err);
    shot.aperture_radius = 0.1;
    shot.focus_distance = 5;
    assert_int_equal(cell_draw(&b.drawer, &b.store, &shot, &b.settings, 0, plenty, &out, &err),
                     GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "aperture"));
    memset(&err, 0, sizeof err);
    shot = ray_shot_of(&camera);
    shot.camera.shutter = GBT_CAMERA_SHUTTER_ROWS;
    shot.camera.motion[0] = 1;
    assert_int_equal(cell_draw(&b.drawer, &b.store, &shot, &b.settings, 0, plenty, &out, &err),
                     GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "rolling shutter"));
    image_free(&out);
    close_both(&b);
}

static void files_that_cannot_be_sorted(void **state)
{
    (void)state;
    cell_store store = {0};
    gbt_error err = {0};
    write_text(ply, "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n");
    assert_int_equal(cell_store_make(ply, test_folder, plenty, 0, &store, &err), GBT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "by parts"));
    cell_store_free(&store);
    gaussian_cloud cloud;
    random_cloud(&cloud, 500);
    assert_ok(gaussian_file_write(ply, &cloud, (const double[3]){0, 0, 0}, NULL));
    gaussian_cloud_free(&cloud);
    memset(&err, 0, sizeof err);
    assert_int_equal(cell_store_make(ply, "/nowhere/at/all", plenty, 0, &store, &err), GBT_ERR_IO);
    cell_store_free(&store);
    assert_int_equal(truncate(ply, 20000), 0);
    memset(&err, 0, sizeof err);
    assert_int_equal(cell_store_make(ply, test_folder, plenty, 0, &store, &err), GBT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "cannot be in the"));
    cell_store_free(&store);
}

static void no_memory_is_a_status(void **state)
{
    (void)state;
    gaussian_cloud cloud;
    random_cloud(&cloud, 300);
    assert_ok(gaussian_file_write(ply, &cloud, (const double[3]){0, 0, 0}, NULL));
    gaussian_cloud_free(&cloud);
    const gbt_camera camera = camera_at(6, 2, 1);
    const ray_shot shot = ray_shot_of(&camera);
    const trace_settings settings = trace_settings_default();
    bool done = false;
    for (long k = 0; !done; k++) {
        cell_store store = {0};
        cell_drawer drawer = {.cell_bytes = 340 * 100};
        image out = {0};
        gbt_error err = {0};
        mem_fail_after(k);
        gbt_status status = cell_store_make(ply, test_folder, plenty, CHUNK_ROWS, &store, &err);
        if (status == GBT_OK)
            status = cell_draw(&drawer, &store, &shot, &settings, 0.25f, plenty, &out, &err);
        mem_fail_after(-1);
        done = status == GBT_OK;
        if (!done) {
            assert_int_equal(status, GBT_ERR_NO_MEMORY);
            assert_true(err.text[0] != '\0');
        }
        image_free(&out);
        cell_drawer_free(&drawer);
        cell_store_free(&store);
        assert_true(k < 10000);
    }
}

static int set_up(void **state)
{
    const int failed = folder_make(state);
    ply = in_folder("g.ply");
    return failed;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_from_all_sides),
        cmocka_unit_test(turning),
        cmocka_unit_test(needles_and_pancakes),
        cmocka_unit_test(camera_inside),
        cmocka_unit_test(many_in_one_place),
        cmocka_unit_test(far_from_the_origin),
        cmocka_unit_test(means_in_double),
        cmocka_unit_test(one_far_from_the_others),
        cmocka_unit_test(fog),
        cmocka_unit_test(opaque_stacks),
        cmocka_unit_test(bad_values),
        cmocka_unit_test(wide_lenses),
        cmocka_unit_test(cuts_through_the_eye),
        cmocka_unit_test(nothing_in_view),
        cmocka_unit_test(shares_make_the_picture),
        cmocka_unit_test(rays_that_end_in_a_share),
        cmocka_unit_test(the_last_chunks_are_out_of_view),
        cmocka_unit_test(threads_give_the_same_bits),
        cmocka_unit_test(what_cannot_be_drawn),
        cmocka_unit_test(files_that_cannot_be_sorted),
        cmocka_unit_test(no_memory_is_a_status),
    };
    return cmocka_run_group_tests(tests, set_up, folder_remove);
}
