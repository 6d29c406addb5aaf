/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_cameras_json.c -- cameras of a 3DGS result folder, and the folder itself. */
#include "data_support.h"

#include "data/cameras_json.h"
#include "data/gaussian_file.h"
#include "data/result_folder.h"

#define CAMERA(name, rotation)                                                                               \
    "{\"id\": 0, \"img_name\": \"" name                                                                      \
    "\", \"width\": 64, \"height\": 48, \"position\": [1, 2, 3], \"rotation\": " rotation ", "               \
    "\"fy\": 50, \"fx\": 51}"

static void cameras(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        gbt_status status;
        const char *says;
    } cases[] = {
        {"[" CAMERA("a", "[[0,0,1],[1,0,0],[0,1,0]]") "]", GBT_OK, ""},
        {"\xEF\xBB\xBF[" CAMERA("a", "[[0,0,1],[1,0,0],[0,1,0]]") "]", GBT_OK, ""},
        {"[" CAMERA("a", "[[0,0,1],[1,0,0],[0,2,0]]") "]", GBT_ERR_FORMAT, "frame 0: not a rotation"},
        {"[" CAMERA("a", "[[0,0,1],[-1,0,0],[0,1,0]]") "]", GBT_ERR_FORMAT, "no reflection"},
        {"[" CAMERA("../a", "[[0,0,1],[1,0,0],[0,1,0]]") "]", GBT_ERR_FORMAT, "'..'"},
        {"[" CAMERA("a", "[[0,0,1],[1,0,0]]") "]", GBT_ERR_FORMAT, "not a camera"},
        {"[{}]", GBT_ERR_FORMAT, "not a camera"},
        {"[7]", GBT_ERR_FORMAT, "not a camera"},
        {"[]", GBT_ERR_FORMAT, "no cameras"},
        {"{}", GBT_ERR_FORMAT, "wanted a JSON list"},
        {"[{", GBT_ERR_FORMAT, "not usable JSON"},
        {"[{\"fx\": 1, \"fx\": 2}]", GBT_ERR_FORMAT, "duplicate"},
        {"", GBT_ERR_FORMAT, "file is empty"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        write_text(in_folder("cameras.json"), cases[i].text);
        scene s;
        gbt_error err = {0};
        const gbt_status status = cameras_json_load(in_folder("cameras.json"), &s, &err);
        check_message(status, &err);
        if (status != cases[i].status || strstr(err.text, cases[i].says) == NULL)
            fail_msg("case %zu: status %d: %s", i, (int)status, err.text);
        if (status == GBT_OK) {
            const gbt_camera *c = &s.views[0].camera;
            static const double world_to_camera[9] = {0, 1, 0, 0, 0, 1, 1, 0, 0};
            assert_memory_equal(c->rotation, world_to_camera, sizeof world_to_camera);
            assert_true(c->center[2] == 3 && c->params[0] == 51 && c->params[1] == 50 && c->params[2] == 32 &&
                        c->params[3] == 24 && s.views[0].is_test);
            image im;
            gbt_error no_photo = {0};
            assert_int_equal(scene_read_photo(&s.views[0], 4, 4, &im, &no_photo), GBT_ERR_IO);
        }
        scene_free(&s);
    }
}

/* The largest iteration counts; a run of ours is none. */
static void newest_iteration(void **state)
{
    static const char point[] =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
        "z\nproperty float f_dc_0\nproperty float f_dc_1\n"
        "property float f_dc_2\nproperty float opacity\nproperty float scale_0\nproperty float "
        "scale_1\nproperty float scale_2\nproperty float rot_0\n"
        "property float rot_1\nproperty float rot_2\nproperty float rot_3\nend_header\n";
    (void)state;
    char text[1024];
    result_folder found;
    bool is_there;
    assert_ok(result_folder_find(test_folder, &found, &is_there, &assert_ok_err_));
    assert_false(is_there || gaussian_file_readable(test_folder));
    static const int iterations[] = {7000, 30000, 900};
    for (int i = 0; i < 3; i++) {
        snprintf(text, sizeof text, "%s%d 0 0 0 0 0 0 -1 -1 -1 1 0 0 0\n", point, iterations[i]);
        write_text(in_folder("point_cloud/iteration_%d/point_cloud.ply", iterations[i]), text);
    }
    write_text(in_folder("point_cloud/iteration_99999x"), "");
    write_text(in_folder("cfg_args"),
               "Namespace(sh_degree=3, source_path='/data/a b', white_background=True)");
    assert_ok(result_folder_find(test_folder, &found, &is_there, &assert_ok_err_));
    assert_true(is_there && found.iteration == 30000 && found.white_background);
    assert_string_equal(found.source, "/data/a b");
    assert_true(found.downscale == 0);
    static const char *const resolutions[] = {"resolution=4, ",
                                              "resolution=-1, ",
                                              "resolution=1200, ",
                                              "resolution=1)",
                                              "images='images', resolution=-1)",
                                              "images='images_4', resolution=-1)",
                                              "images='images_4', resolution=2)",
                                              "images='images_4', resolution=1200)",
                                              "images='images_2024', resolution=-1)"};
    static const double downscales[] = {4, 0, 0, 1, 0, 0, 8, 0, 0};
    static const int widths[] = {0, 0, 1200, 0, 0, 0, 0, 1200, 0}, reduced[] = {0, 0, 0, 0, 0, 4, 0, 0, 0};
    for (size_t i = 0; i < sizeof widths / sizeof *widths; i++) {
        write_text(in_folder("cfg_args"), resolutions[i]);
        assert_ok(result_folder_find(test_folder, &found, &is_there, &assert_ok_err_));
        assert_true(found.downscale == downscales[i] && found.width == widths[i] &&
                    found.reduced == reduced[i]);
    }
    assert_true(gaussian_file_readable(test_folder) && gaussian_file_has_gaussians(test_folder));
    gaussian_cloud cloud;
    assert_ok(gaussian_file_read(test_folder, &cloud, &assert_ok_err_));
    assert_true(cloud.count == 1 && cloud.mean[0] == 30000);
    gaussian_cloud_free(&cloud);
    write_text(in_folder("model.gbt"), "");
    assert_false(gaussian_file_readable(test_folder));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(cameras, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(newest_iteration, folder_make, folder_remove),
    };
    return cmocka_run_group_tests_name("result folders", tests, NULL, NULL);
}
