/* SPDX-License-Identifier: Apache-2.0 */
/* tests/render/test_camera_file.c -- camera files: what each field means, and one clear line about what is
   wrong. */
#include "base/near.h"
#include "exr_file.h"
#include "folder.h"
#include "render/camera_file.h"

static const char *path;
static const double none[3] = {0, 0, 0};

static int set_up(void **state)
{
    const int failed = folder_make(state);
    path = in_folder("c.json");
    return failed;
}

#define POSE                                                                                                 \
    "\"origin\": [1, 2, 3], \"target\": [1, 2, 13], \"up\": [0, -2, 0], \"width\": 64, \"height\": 32"

static camera_file read_good(const char *text, const double origin[3])
{
    camera_file file;
    gbt_error err = {0};
    write_text(path, text);
    if (camera_file_read(path, origin, &file, &err) != GBT_OK)
        fail_msg("%s: %s", text, err.text);
    return file;
}

static void a_plain_pinhole(void **state)
{
    (void)state;
    const double shift[3] = {0.5, 2, -1};
    const camera_file f =
        read_good("{" POSE ", \"fov_x_deg\": 90, \"near_clip\": 0.1, \"far_clip\": 100}", shift);
    const gbt_camera *c = &f.shot.camera;
    assert_true(c->model == GBT_CAMERA_PINHOLE && c->width == 64 && c->height == 32);
    assert_near(c->params[0], 32, 1e-13);
    assert_near(c->params[1], 32, 1e-13);
    assert_near(c->params[2], 32, 0);
    assert_near(c->params[3], 16, 0);
    const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}; /* it looks along z, with -y up */
    for (int k = 0; k < 9; k++)
        assert_near(c->rotation[k], identity[k], 1e-15);
    assert_near(c->center[0], 0.5, 0);
    assert_near(c->center[1], 0, 0);
    assert_near(c->center[2], 4, 0);
    assert_true(f.shot.camera.shutter == GBT_CAMERA_SHUTTER_GLOBAL && f.shot.given == NULL &&
                f.shot.aperture_radius == 0);
    assert_int_equal(ray_shot_sample_count(&f.shot), 1);
}

static void models(void **state)
{
    (void)state;
    camera_file f = read_good("{" POSE ", \"model\": \"orthographic\", \"view_width\": 16}", none);
    assert_int_equal(f.shot.camera.model, GBT_CAMERA_ORTHOGRAPHIC);
    const double orthographic[4] = {4, 4, 32, 16};
    assert_memory_equal(f.shot.camera.params, orthographic, sizeof orthographic);
    f = read_good("{" POSE ", \"model\": \"equirectangular\"}", none);
    assert_int_equal(f.shot.camera.model, GBT_CAMERA_EQUIRECTANGULAR);
    const double turn[2] = {64, 32};
    assert_memory_equal(f.shot.camera.params, turn, sizeof turn);
    f = read_good("{" POSE ", \"model\": \"fisheye\", \"fov_x_deg\": 360}", none);
    assert_int_equal(f.shot.camera.model, GBT_CAMERA_FISHEYE);
    assert_near(f.shot.camera.params[0], 64 / 6.283185307179586, 1e-13);
    assert_near(f.shot.camera.params[1], 64 / 6.283185307179586, 1e-13);
}

/* When the middle of the last row and column is taken. */
static gbt_camera last_line(const gbt_camera *camera)
{
    return gbt_camera_at(camera, camera->width - 0.5, camera->height - 0.5);
}

static void aperture_and_shutter(void **state)
{
    (void)state;
    camera_file f = read_good("{" POSE ", \"fov_x_deg\": 90, \"aperture\": 0.25, \"focus\": 4}", none);
    assert_near(f.shot.aperture_radius, 0.25, 0);
    assert_near(f.shot.focus_distance, 4, 0);
    assert_int_equal(ray_shot_sample_count(&f.shot), 64);
    f = read_good(
        "{" POSE ", \"fov_x_deg\": 90, \"aperture\": 0.25, \"focus\": 4, \"samples\": 9, \"seed\": 3}", none);
    assert_int_equal(ray_shot_sample_count(&f.shot), 9);
    assert_true(f.shot.seed == 3);
    f = read_good("{" POSE ", \"fov_x_deg\": 90, \"aperture\": 0, \"samples\": 9}", none);
    assert_int_equal(ray_shot_sample_count(&f.shot), 1);
    /* What the end does not say is as at the start. */
    const double shift[3] = {1, 1, 1};
    f = read_good("{" POSE ", \"fov_x_deg\": 90, \"end\": {\"origin\": [1, 2, 5]}}", shift);
    assert_int_equal(f.shot.camera.shutter, GBT_CAMERA_SHUTTER_ROWS);
    gbt_camera last = last_line(&f.shot.camera);
    assert_near(last.center[2], 4, 1e-15);
    assert_near(last.center[0], 0, 1e-15);
    assert_near(last.rotation[8], 1, 1e-15);
    f = read_good("{" POSE ", \"fov_x_deg\": 90, \"shutter\": \"columns\", \"end\": {\"up\": [1, 0, 0]}}",
                  none);
    assert_int_equal(f.shot.camera.shutter, GBT_CAMERA_SHUTTER_COLUMNS);
    last = last_line(&f.shot.camera);
    assert_near(last.rotation[1], 1, 1e-15); /* right is now +y */
    assert_near(last.center[2], 3, 0);
}

static void rays_beside_it(void **state)
{
    (void)state;
    static const char *const names[] = {"dx", "dy", "dz", "ox", "oy", "oz"};
    const float pixels[12] = {0, 0, 2, 10, 20, 30, 0, 3, 4, 11, 21, 31};
    const double shift[3] = {10, 20, 30};
    exr_write(in_folder("r.exr"), 2, 1, 6, names, 2, pixels);
    camera_file f;
    gbt_error err = {0};
    write_text(path, "{\"rays\": \"r.exr\"}");
    if (camera_file_read(path, shift, &f, &err) != GBT_OK)
        fail_msg("%s", err.text);
    assert_ptr_equal(f.shot.given, &f.rays);
    assert_true(f.rays.width == 2 && f.rays.height == 1);
    const float origin[6] = {0, 0, 0, 1, 1, 1}, dir[6] = {0, 0, 1, 0, 0.6f, 0.8f};
    assert_memory_equal(f.rays.origin, origin, sizeof origin);
    assert_memory_equal(f.rays.dir, dir, sizeof dir);
    camera_file_free(&f);
    assert_null(f.rays.dir);
}

static const struct bad_case {
    const char *text, *message; /* behind "PATH" */
} bad_cases[] = {
    {"", ":1: file is empty"},
    {"[1]", ": wanted a JSON object"},
    {"{\"width\": 1, \"width\": 2}", ":1: not usable JSON: duplicate object key"},
    {"{" POSE "}", ": fov_x_deg: missing (degrees from the left edge of the picture to the right)"},
    {"{" POSE ", \"fov_x_deg\": 180}", ": fov_x_deg: wanted a number in (0, 179.9]"},
    {"{" POSE ", \"fov_x_deg\": 0}", ": fov_x_deg: wanted a number in (0, 179.9]"},
    {"{" POSE ", \"fov_x_deg\": \"60\"}", ": fov_x_deg: wanted a number in (0, 179.9]"},
    {"{" POSE ", \"model\": \"fisheye\", \"fov_x_deg\": 361}", ": fov_x_deg: wanted a number in (0, 360]"},
    {"{" POSE ", \"model\": \"orthographic\"}",
     ": view_width: missing (units of the data set from the left edge of the picture to the right)"},
    {"{" POSE ", \"model\": \"orthographic\", \"view_width\": 0}",
     ": view_width: wanted a number in (0, 1e+15]"},
    {"{" POSE ", \"model\": \"orthographic\", \"view_width\": 3, \"fov_x_deg\": 60}",
     ": fov_x_deg: only with the model pinhole or fisheye"},
    {"{" POSE ", \"view_width\": 3, \"fov_x_deg\": 60}", ": view_width: only with the model orthographic"},
    {"{" POSE ", \"model\": \"pinhoel\"}",
     ": model: wanted one of pinhole, fisheye, equirectangular, orthographic"},
    {"{" POSE ", \"model\": 3}", ": model: wanted one of pinhole, fisheye, equirectangular, orthographic"},
    {"{" POSE ", \"fov_x_deg\": 60, \"apperture\": 1}",
     ": apperture: unknown field (wanted one of origin target up model width"},
    {"{" POSE ", \"fov_x_deg\": 60, \"\": 1}", ": : unknown field (wanted one of origin"},
    {"{" POSE ", \"fov_x_deg\": 60, \"origin target\": 1}",
     ": origin target: unknown field (wanted one of origin"},
    {"{\"origin\": [1, 2, 3], \"up\": [0, 1, 0], \"fov_x_deg\": 60, \"width\": 4, \"height\": 4}",
     ": target: missing (wanted 3 numbers)"},
    {"{\"origin\": [1, 2], \"fov_x_deg\": 60, \"width\": 4, \"height\": 4}", ": origin: wanted 3 numbers"},
    {"{\"origin\": [1, 2, \"3\"], \"fov_x_deg\": 60, \"width\": 4, \"height\": 4}",
     ": origin: wanted 3 numbers, within 1e15"},
    {"{\"origin\": [1, 2, 1e16], \"fov_x_deg\": 60, \"width\": 4, \"height\": 4}",
     ": origin: wanted 3 numbers, within 1e15"},
    {"{\"height\": 4}", ": width: missing (pixels)"},
    {"{\"width\": 4}", ": height: missing (pixels)"},
    {"{\"width\": 0, \"height\": 4}", ": width: wanted a whole number in [1, 65500]"},
    {"{\"width\": 4.5, \"height\": 4}", ": width: wanted a whole number in [1, 65500]"},
    {"{\"width\": 4, \"height\": 65501}", ": height: wanted a whole number in [1, 65500]"},
    {"{\"origin\": [1, 2, 3], \"target\": [1, 2, 3], \"up\": [0, 1, 0], \"fov_x_deg\": 60, \"width\": 4, "
     "\"height\": 4}",
     ": target: is the origin (wanted another point)"},
    {"{\"origin\": [1, 2, 3], \"target\": [1, 3, 3], \"up\": [0, 1, 0], \"fov_x_deg\": 60, \"width\": 4, "
     "\"height\": 4}",
     ": up: is 0, or along the view"},
    {"{\"origin\": [1, 2, 3], \"target\": [1, 3, 3], \"up\": [0, 0, 0], \"fov_x_deg\": 60, \"width\": 4, "
     "\"height\": 4}",
     ": up: is 0, or along the view"},
    {"{" POSE ", \"fov_x_deg\": 60, \"focus\": 1}",
     ": aperture: missing (needed with focus, samples or seed)"},
    {"{" POSE ", \"fov_x_deg\": 60, \"aperture\": 1}",
     ": focus: missing (distance that is sharp, units of the data set)"},
    {"{" POSE ", \"fov_x_deg\": 60, \"aperture\": -1, \"focus\": 1}",
     ": aperture: wanted a number in [0, 1e+15]"},
    {"{" POSE ", \"fov_x_deg\": 60, \"aperture\": 1, \"focus\": 0}",
     ": focus: wanted a number in (0, 1e+15]"},
    {"{" POSE ", \"fov_x_deg\": 60, \"aperture\": 1, \"focus\": 1, \"samples\": 0}",
     ": samples: wanted a whole number in [1, 65536]"},
    {"{" POSE ", \"fov_x_deg\": 60, \"aperture\": 1, \"focus\": 1, \"seed\": -1}",
     ": seed: wanted a whole number in [0, 2147483647]"},
    {"{" POSE ", \"fov_x_deg\": 60, \"shutter\": \"rows\"}",
     ": end: missing (a rolling shutter needs the pose at its end)"},
    {"{" POSE ", \"fov_x_deg\": 60, \"shutter\": \"up\", \"end\": {}}",
     ": shutter: wanted one of rows, columns"},
    {"{" POSE ", \"fov_x_deg\": 60, \"end\": [1]}", ": end: wanted an object with origin, target or up"},
    {"{" POSE ", \"fov_x_deg\": 60, \"end\": {\"fov_x_deg\": 3}}",
     ": end.fov_x_deg: unknown field (wanted one of origin target up)"},
    {"{" POSE ", \"fov_x_deg\": 60, \"end\": {\"up\": [0, 0, 1]}}", ": end.up: is 0, or along the view"},
    {"{\"rays\": 3}", ": rays: wanted the name of an EXR file"},
    {"{\"rays\": \"r.exr\", \"width\": 3}", ": width: unknown field (wanted one of rays)"},
};

static void says_what_is_wrong(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof bad_cases / sizeof *bad_cases; i++) {
        camera_file f;
        gbt_error err = {0};
        write_text(path, bad_cases[i].text);
        const gbt_status status = camera_file_read(path, none, &f, &err);
        const size_t length = strlen(path);
        if (status != GBT_ERR_FORMAT || strncmp(err.text, path, length) != 0 ||
            strncmp(err.text + length, bad_cases[i].message, strlen(bad_cases[i].message)) != 0)
            fail_msg("%s: %d: %s", bad_cases[i].text, (int)status, err.text);
        assert_null(f.rays.dir);
        camera_file_free(&f);
    }
    camera_file f;
    gbt_error err = {0};
    assert_int_equal(camera_file_read("/nowhere/c.json", none, &f, &err), GBT_ERR_IO);
    camera_file_free(&f);
    write_text(path, "{\"rays\": \"nothing.exr\"}");
    memset(&err, 0, sizeof err);
    assert_int_equal(camera_file_read(path, none, &f, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "nothing.exr: cannot open"));
    camera_file_free(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plain_pinhole),      cmocka_unit_test(models),
        cmocka_unit_test(aperture_and_shutter), cmocka_unit_test(rays_beside_it),
        cmocka_unit_test(says_what_is_wrong),
    };
    return cmocka_run_group_tests(tests, set_up, folder_remove);
}
