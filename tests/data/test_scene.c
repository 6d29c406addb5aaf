/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_scene.c -- scenes from folders: sniffing, photos, recentring, splits, memory failures, and
   the real data sets. */
#include "data_support.h"

#include <unistd.h>

#include "base/compare.h"
#include "base/rng.h"
#include "base/vec.h"
#include "colmap_text.h"
#include "data/colmap_write.h"
#include "data/photo_size.h"
#include "data/ply.h"
#include "data/raw.h"
#include "data/scene.h"
#include "gbtrace/progress.h"

enum { VIEW_COUNT = 9, POINT_COUNT = 5 };

/* Nine images v1.png .. v9.png on a line at x = 1000 + 10 i, five points around (1000, 0, 0), one of them far
   off. */
static void write_model(bool text, bool with_photos)
{
    colmap_image images[VIEW_COUNT] = {0};
    colmap_point points[POINT_COUNT] = {0};
    char names[VIEW_COUNT][16];
    for (int i = 0; i < VIEW_COUNT; i++) {
        snprintf(names[i], sizeof names[i], "v%d.png", VIEW_COUNT - i);
        images[i].name = names[i];
        images[i].camera = (gbt_camera){.model = GBT_CAMERA_PINHOLE,
                                        .width = 8,
                                        .height = 6,
                                        .params = {10, 10, 3.5, 2.5},
                                        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                                        .center = {1000 + 10 * i, 1, 2}};
        if (with_photos)
            write_picture(in_folder("images/%s", names[i]), 8, 6);
    }
    for (int i = 0; i < POINT_COUNT; i++)
        points[i] = (colmap_point){.position = {999 + i, -i, i == 4 ? 1e9 : 0}, .color = {10, 20, 30}};
    const char *model = in_folder("sparse/0");
    assert_ok(colmap_write(model, images, VIEW_COUNT, points, POINT_COUNT, &assert_ok_err_));
    if (text)
        colmap_to_text(model);
}

static void move(const char *from, const char *to)
{
    make_folder_of(in_folder("%s", to));
    assert_int_equal(rename(in_folder("%s", from), in_folder("%s", to)), 0);
}

static void recentred(void **state)
{
    (void)state;
    write_model(false, true);
    scene s;
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_string_equal(s.source, "colmap-bin");
    assert_string_equal(s.folder, test_folder);
    /* The median of the points; the one at 1e9 does not move it. */
    assert_true(s.origin[0] == 1001 && s.origin[1] == -2 && s.origin[2] == 0);
    assert_int_equal(s.view_count, VIEW_COUNT);
    for (size_t i = 0; i < VIEW_COUNT; i++) {
        char name[16];
        snprintf(name, sizeof name, "v%zu.png", i + 1);
        assert_string_equal(s.views[i].name, name);
        assert_true(file_exists(s.views[i].path));
        const double *c = s.views[i].camera.center;
        assert_true(c[0] == 1000 + 10 * (double)(VIEW_COUNT - 1 - i) - 1001 && c[1] == 3 && c[2] == 2);
        assert_true(s.views[i].camera.params[2] == 3.5);
        assert_int_equal(s.views[i].is_test, i % 8 == 0);
    }
    assert_int_equal(s.points.count, POINT_COUNT);
    assert_true(s.points.position[0] == -2 && s.points.position[1] == 2 && s.points.position[14] == 1e9f);
    assert_true(s.points.has_color && s.points.color[1] == 20.0f / 255);
    /* Training cameras are v2..v8, x = 1070 .. 1010: mean 1040, farthest 30. */
    assert_true(fabs(scene_camera_extent(&s) - 33) < 1e-9);
    scene_free(&s);
    assert_null(s.views);
}

static void folder_layouts(void **state)
{
    (void)state;
    static const char *const files[] = {"cameras.bin", "images.bin", "points3D.bin"};
    static const char *const places[] = {"sparse/0", "sparse", "."};
    write_model(false, true);
    scene s;
    char from[64], to[64];
    for (int place = 0; place < 3; place++) {
        for (int i = 0; i < 3 && place > 0; i++) {
            snprintf(from, sizeof from, "%s/%s", places[place - 1], files[i]);
            snprintf(to, sizeof to, "%s/%s", places[place], files[i]);
            move(from, to);
        }
        assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
        assert_int_equal(s.view_count, VIEW_COUNT);
        scene_free(&s);
    }
    /* Photos may lie in the folder itself. */
    move("images/v3.png", "v3.png");
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_non_null(strstr(s.views[2].path, "/v3.png"));
    assert_null(strstr(s.views[2].path, "images"));
    scene_free(&s);
}

/* nerfstudio keeps the model in colmap/, where a transforms.json beside it wins; models elsewhere are named.
 */
static void colmap_elsewhere(void **state)
{
    (void)state;
    scene s;
    write_model(false, true);
    move("sparse", "colmap/sparse");
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_string_equal(s.source, "colmap-bin");
    assert_int_equal(s.view_count, VIEW_COUNT);
    scene_free(&s);
    write_text(in_folder("transforms.json"),
               "{\"fl_x\": 8, \"frames\": [{\"file_path\": \"images/v1.png\", \"transform_matrix\": "
               "[[1,0,0,10],[0,1,0,20],[0,0,1,30],[0,0,0,1]]}]}");
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_string_equal(s.source, "transforms");
    scene_free(&s);
    unlink(in_folder("transforms.json"));

    const char *data = test_folder;
    char says[3][512];
    snprintf(says[0], sizeof says[0],
             "a COLMAP model is in %.100s/sparse/1 (wanted: moved to %.100s/sparse/0)", data, data);
    snprintf(says[1], sizeof says[1],
             "a COLMAP model is in %.100s/dense/sparse (wanted the folder %.100s/dense)", data, data);
    snprintf(says[2], sizeof says[2],
             "a COLMAP model is in %.100s/a/b/sparse/0 (wanted the folder %.100s/a/b)", data, data);
    static const char *const moves[3][2][2] = {
        {{"colmap/sparse/0", "sparse/1"}, {"images/v1.png", "images/v1.png"}},
        {{"sparse/1", "dense/sparse"}, {"images", "dense/images"}},
        {{"dense/sparse", "a/b/sparse/0"}, {"dense/images", "a/b/images"}}};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 2; k++)
            move(moves[i][k][0], moves[i][k][1]);
        gbt_error err = {0};
        assert_int_equal(scene_load(data, NULL, &s, &err), GBT_ERR_FORMAT);
        check_message(GBT_ERR_FORMAT, &err);
        if (strstr(err.text, says[i]) == NULL)
            fail_msg("%s", err.text);
    }
    assert_ok(scene_load(in_folder("a/b"), NULL, &s, &assert_ok_err_));
    scene_free(&s);
}

static void binary_is_preferred(void **state)
{
    (void)state;
    write_model(true, true);
    scene s;
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_string_equal(s.source, "colmap-txt");
    scene_free(&s);
    write_model(false, false);
    write_text(in_folder("sparse/0/rigs.bin"), "ignored");
    write_text(in_folder("sparse/0/frames.bin"), "ignored");
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_string_equal(s.source, "colmap-bin");
    scene_free(&s);
    /* 29: an incomplete binary set gives way to a complete text set, but not to an incomplete one. */
    unlink(in_folder("sparse/0/images.bin"));
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_string_equal(s.source, "colmap-txt");
    scene_free(&s);
    unlink(in_folder("sparse/0/points3D.txt"));
    gbt_error err = {0};
    assert_int_equal(scene_load(test_folder, NULL, &s, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "images.bin: missing (wanted cameras, images and points3D together)"));
    assert_null(s.views);
}

/* 27: views without a photo are left out and counted, the first three named; without any photo there is
   nothing to do. */
static void missing_photos(void **state)
{
    (void)state;
    write_model(false, true);
    scene s;
    for (int i = 1; i <= VIEW_COUNT; i++) {
        char name[32];
        snprintf(name, sizeof name, "images/v%d.png",
                 i == 1   ? 2
                 : i == 2 ? 1
                          : i); /* a first and a later one */
        unlink(in_folder("%s", name));
        if (i == 1)
            assert_ok(file_make_folder(in_folder("images/v2.png"), &assert_ok_err_)); /* a folder is not a
                                                                                         photo */
        if (i == VIEW_COUNT)
            break;
        assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
        assert_int_equal(s.photos_missing, i);
        assert_int_equal(s.view_count, VIEW_COUNT - i);
        assert_string_equal(s.views[0].name,
                            i == 1 ? "v1.png" : (snprintf(name, sizeof name, "v%d.png", i + 1), name));
        assert_string_equal(s.views[s.view_count - 1].name, "v9.png");
        for (size_t v = 0; v < s.view_count; v++) { /* who is held out does not depend on who is missing */
            const int number = s.views[v].name[1] - '1';
            assert_int_equal(s.views[v].is_test, s.view_count > 1 && number % 8 == 0);
        }
        scene_free(&s);
    }
    gbt_error err = {0};
    assert_int_equal(scene_load(test_folder, NULL, &s, &err), GBT_ERR_IO);
    check_message(GBT_ERR_IO, &err);
    if (strstr(err.text, "all 9 photos are missing: v1.png, v2.png, v3.png, ...") == NULL)
        fail_msg("%s", err.text);
}

static void keep_text(const gbt_event *event, void *text) { snprintf(text, 300, "%s", event->text); }

static void keep_first(const gbt_event *event, void *text)
{
    if (*(const char *)text == '\0')
        keep_text(event, text);
}

/* COLMAP's NAME.png, and two other habits; what has none stays without, and a warning counts it. */
static void masks_are_found(void **state)
{
    (void)state;
    char text[300] = "";
    write_model(false, true);
    static const char *const files[] = {"masks/v1.png.png", "masks/v2.png"};
    scene s;
    gbt_listen(keep_text, text);
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_null(s.views[0].mask_path);
    assert_null(strstr(text, "mask"));
    scene_free(&s);
    write_picture(in_folder("masks/other.png"), 8, 6);
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_null(s.views[0].mask_path);
    assert_non_null(strstr(text, "used completely: 9 of 9 (wanted masks/NAME.png)"));
    scene_free(&s);
    for (int i = 0; i < 2; i++)
        write_picture(in_folder("%s", files[i]), 8, 6);
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    gbt_listen(NULL, NULL);
    assert_non_null(strstr(text, "used completely: 7 of 9"));
    for (int i = 0; i < 2; i++)
        assert_string_equal(s.views[i].mask_path, in_folder("%s", files[i]));
    assert_null(s.views[2].mask_path);
    scene_free(&s);
}

typedef struct place_case {
    const char *name;
    const char *file, *text; /* written first, when not NULL */
    const char *path;        /* loaded, below the folder */
    gbt_status status;
    const char *says;
} place_case;

static const char empty_count[8];

static void nothing_to_load(void **state)
{
    (void)state;
    static const place_case cases[] = {
        {"nothing there", NULL, NULL, "no/such", GBT_ERR_IO, "no such file or folder"},
        {"empty folder", NULL, NULL, ".", GBT_ERR_FORMAT,
         "not a data set (wanted sparse/0/cameras.bin, transforms.json or transforms_train.json"},
        {"some file", "photo.jpg", "x", "photo.jpg", GBT_ERR_FORMAT,
         "not a data set (wanted a folder, a .ply or a transforms.json)"},
        {"bad ply", "p.ply", "x", "p.ply", GBT_ERR_FORMAT, "p.ply:1: not a PLY file"},
        {"ply without points", "p.ply",
         "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float "
         "z\nend_header\n",
         "p.ply", GBT_ERR_FORMAT, "holds no usable point (0 dropped)"},
        {"ply of NaN", "p.ply",
         "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
         "z\nend_header\nnan 1 2\n",
         "p.ply", GBT_ERR_FORMAT, "holds no usable point (1 dropped)"},
        {"bad json", "transforms.json", "x", ".", GBT_ERR_FORMAT, "transforms.json:1: not usable JSON"},
        {"bad json by name", "transforms.json", "x", "transforms.json", GBT_ERR_FORMAT,
         "transforms.json:1: not usable JSON"},
        {"empty cameras.txt", "b/cameras.txt", "", "b", GBT_ERR_FORMAT, "not a data set"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        if (cases[i].file != NULL)
            write_text(in_folder("%s", cases[i].file), cases[i].text);
        scene s;
        gbt_error err = {0};
        const gbt_status status = scene_load(in_folder("%s", cases[i].path), NULL, &s, &err);
        check_message(status, &err);
        if (status != cases[i].status || strstr(err.text, cases[i].says) == NULL)
            fail_msg("%s: status %d, message: %s", cases[i].name, (int)status, err.text);
        assert_null(s.views);
    }
    /* 28: a model without images. */
    assert_ok(file_make_folder(in_folder("sparse"), &assert_ok_err_));
    for (int i = 0; i < 3; i++) {
        static const char *const names[] = {"cameras", "images", "points3D"};
        assert_ok(file_write_atomic(in_folder("sparse/%s.bin", names[i]), empty_count, 8, &assert_ok_err_));
    }
    scene s;
    gbt_error err = {0};
    assert_int_equal(scene_load(test_folder, NULL, &s, &err), GBT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "images.bin: no registered image in the model"));
}

static void too_long_path(void **state)
{
    (void)state;
    char *path = malloc(20001);
    memset(path, 'a', 20000);
    path[20000] = '\0';
    scene s;
    gbt_error err = {0};
    assert_int_equal(scene_load(path, NULL, &s, &err), GBT_ERR_IO);
    check_message(GBT_ERR_IO, &err);
    free(path);
}

static void parse_split(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        bool good;
        scene_split_kind kind;
        int every, offset, validate_every, validate_offset;
    } cases[] = {
        {"every=8:3", true, SCENE_SPLIT_EVERY, .every = 8, .offset = 3},
        {"every=8:7", true, SCENE_SPLIT_EVERY, .every = 8, .offset = 7},
        {.text = "every=8:8"},
        {.text = "every=8:"},
        {.text = "every=8:-1"},
        {.text = "every=8:1x"},
        {.text = "every=:1"},
        {"validate=6", true, SCENE_SPLIT_AUTO, .every = 8, .validate_every = 6},
        {"validate=6:5", true, SCENE_SPLIT_AUTO, .every = 8, .validate_every = 6, .validate_offset = 5},
        {"validate=6:5,auto", true, SCENE_SPLIT_AUTO, .every = 8, .validate_every = 6, .validate_offset = 5},
        {"validate=2,none", true, SCENE_SPLIT_NONE, .every = 8, .validate_every = 2},
        {"validate=2,every=4:1", true, SCENE_SPLIT_EVERY, .every = 4, .offset = 1, .validate_every = 2},
        {"validate=2,list=a b.txt", true, SCENE_SPLIT_LIST, .every = 8, .validate_every = 2},
        {.text = "validate="},
        {.text = "validate=1"},
        {.text = "validate=6:6"},
        {.text = "validate=6,"},
        {.text = "validate=6:,auto"},
        {.text = "validate=6,validate=6"},
        {.text = "auto,validate=6"},
        {"every=8", true, SCENE_SPLIT_EVERY, .every = 8},
        {"every=2", true, SCENE_SPLIT_EVERY, .every = 2},
        {"every=2147483647", true, SCENE_SPLIT_EVERY, .every = 2147483647},
        {"auto", true, SCENE_SPLIT_AUTO, .every = 8},
        {.text = "autos"},
        {"none", true, SCENE_SPLIT_NONE, .every = 8},
        {"list=a b.txt", true, SCENE_SPLIT_LIST, .every = 8},
        {.text = "every=1"},
        {.text = "every=0"},
        {.text = "every=-8"},
        {.text = "every="},
        {.text = "every=8x"},
        {.text = "every=2147483648"},
        {.text = "every=99999999999999999999"},
        {.text = ""},
        {.text = "list="},
        {.text = "nonee"},
        {.text = "8"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        scene_split split;
        gbt_error err = {0};
        const gbt_status status = scene_split_parse(cases[i].text, &split, &err);
        check_message(status, &err);
        if ((status == GBT_OK) != cases[i].good)
            fail_msg("%s: status %d", cases[i].text, (int)status);
        if (!cases[i].good) {
            assert_int_equal(status, GBT_ERR_ARGUMENT);
            continue;
        }
        assert_int_equal(split.kind, cases[i].kind);
        assert_int_equal(split.every, cases[i].every);
        assert_int_equal(split.offset, cases[i].offset);
        assert_int_equal(split.validate_every, cases[i].validate_every);
        assert_int_equal(split.validate_offset, cases[i].validate_offset);
        if (split.kind == SCENE_SPLIT_LIST)
            assert_string_equal(split.list_path, "a b.txt");
    }
}

static size_t count_tests(const scene *s)
{
    size_t count = 0;
    for (size_t i = 0; i < s->view_count; i++)
        count += s->views[i].is_test;
    return count;
}

/* Held-out photos are gone, and each fold of the others is held out once. */
static void validation_leaves_held_out_photos_alone(void **state)
{
    (void)state;
    enum { EVERY = 3, FOLDS = 2 };
    write_model(false, true);
    for (int offset = 0; offset < EVERY; offset++) {
        size_t times[VIEW_COUNT] = {0};
        for (int fold = 0; fold < FOLDS; fold++) {
            scene s;
            const scene_split split = {.kind = SCENE_SPLIT_EVERY,
                                       .every = EVERY,
                                       .offset = offset,
                                       .validate_every = FOLDS,
                                       .validate_offset = fold};
            assert_ok(scene_load(test_folder, &split, &s, &assert_ok_err_));
            for (size_t i = 0; i < s.view_count; i++) {
                assert_int_not_equal(s.views[i].rank % EVERY, offset);
                times[s.views[i].rank] += s.views[i].is_test;
            }
            scene_free(&s);
        }
        for (size_t i = 0; i < VIEW_COUNT; i++)
            assert_int_equal(times[i], i % EVERY != (size_t)offset);
    }
    scene s;
    gbt_error none = {0};
    const scene_split far = {.kind = SCENE_SPLIT_NONE, .validate_every = 100, .validate_offset = 50};
    assert_int_equal(scene_load(test_folder, &far, &s, &none), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(none.text, "validation holds out none"));
}

/* Photos that were held out and are gone; a name that no view ever had is still an error. */
static void missing_photos_on_a_list(void **state)
{
    (void)state;
    char text[300] = "";
    const char *list = in_folder("list.txt");
    const scene_split by_list = {.kind = SCENE_SPLIT_LIST, .list_path = list};
    write_model(false, true);
    unlink(in_folder("images/v2.png"));
    unlink(in_folder("images/v5.png"));
    write_text(list, "v5.png\nv9.png\nv2.png\n");
    scene s;
    gbt_listen(keep_first, text);
    assert_ok(scene_load(test_folder, &by_list, &s, &assert_ok_err_));
    gbt_listen(NULL, NULL);
    assert_non_null(strstr(text, "list.txt: names of missing photos, ignored: 2"));
    assert_true(s.view_count == VIEW_COUNT - 2 && count_tests(&s) == 1 && s.views[6].is_test);
    scene_free(&s);
    static const char *const bad[] = {"v5.png\nv22.png\n", "v5.png\nv\n", "v5.png\nv2.pn\n"};
    for (size_t i = 0; i < 3; i++) {
        gbt_error err = {0};
        write_text(list, bad[i]);
        assert_int_equal(scene_load(test_folder, &by_list, &s, &err), GBT_ERR_FORMAT);
        assert_non_null(strstr(err.text, "list.txt:2: no image of the data set has this name"));
    }
#define FRAME(name)                                                                                          \
    "{\"file_path\": \"images\\\\" name "\", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}"
    write_text(in_folder("windows/transforms.json"),
               "{\"fl_x\": 10, \"frames\": [" FRAME("a.png") ", " FRAME("b.png") ", " FRAME("c.png") "]}");
    write_picture(in_folder("windows/images/a.png"), 8, 6);
    write_picture(in_folder("windows/images/b.png"), 8, 6);
    write_text(list, "images/b.png\nimages/c.png\n");
    assert_ok(scene_load(in_folder("windows"), &by_list, &s, &assert_ok_err_));
    assert_true(s.view_count == 2 && !s.views[0].is_test && s.views[1].is_test);
    scene_free(&s);
}

static void splits(void **state)
{
    (void)state;
    write_model(false, true);
    scene s;
    for (int every = 2; every <= 10; every++) {
        assert_ok(scene_load(test_folder, &(scene_split){.kind = SCENE_SPLIT_EVERY, .every = every}, &s,
                             &assert_ok_err_));
        assert_int_equal(count_tests(&s), (VIEW_COUNT + (size_t)every - 1) / (size_t)every);
        for (size_t i = 0; i < VIEW_COUNT; i++)
            assert_int_equal(s.views[i].is_test, i % (size_t)every == 0);
        scene_free(&s);
    }
    assert_ok(scene_load(test_folder, &(scene_split){.kind = SCENE_SPLIT_NONE}, &s, &assert_ok_err_));
    assert_int_equal(count_tests(&s), 0);
    scene_free(&s);

    const char *list = in_folder("list.txt");
    const scene_split by_list = {.kind = SCENE_SPLIT_LIST, .list_path = list};
    write_text(in_folder("list.txt"), "v9.png\r\n\nv2.png \nv9.png");
    assert_ok(scene_load(test_folder, &by_list, &s, &assert_ok_err_));
    assert_int_equal(count_tests(&s), 2);
    assert_true(s.views[1].is_test && s.views[8].is_test);
    scene_free(&s);
    write_text(in_folder("list.txt"), "\xef\xbb\xbfv9.png\n");
    assert_ok(scene_load(test_folder, &by_list, &s, &assert_ok_err_));
    assert_true(count_tests(&s) == 1 && s.views[8].is_test);
    scene_free(&s);
    static const struct {
        const char *text;
        gbt_status status;
        const char *says;
    } bad[] = {
        {"v9.png\nv99.png\n", GBT_ERR_FORMAT, "list.txt:2: no image of the data set has this name: v99.png"},
        {"v1.png\nv2.png\nv3.png\nv4.png\nv5.png\nv6.png\nv7.png\nv8.png\nv9.png\n", GBT_ERR_ARGUMENT,
         "all 9 views are held out"},
    };
    for (size_t i = 0; i < 2; i++) {
        gbt_error err = {0};
        write_text(in_folder("list.txt"), bad[i].text);
        assert_int_equal(scene_load(test_folder, &by_list, &s, &err), bad[i].status);
        check_message(bad[i].status, &err);
        assert_non_null(strstr(err.text, bad[i].says));
        assert_null(s.views);
    }
    unlink(list);
    gbt_error err = {0};
    assert_int_equal(scene_load(test_folder, &by_list, &s, &err), GBT_ERR_IO);
    gbt_error err2 = {0};
    assert_int_equal(
        scene_load(test_folder, &(scene_split){.kind = SCENE_SPLIT_EVERY, .every = 1}, &s, &err2),
        GBT_ERR_ARGUMENT);
}

static void transforms_folder(void **state)
{
    (void)state;
    write_picture(in_folder("photos/b.png"), 8, 6);
    write_picture(in_folder("photos/a.png"), 8, 6);
    write_text(in_folder("points.ply"),
               "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
               "z\nend_header\n5 6 7\n");
    static const char text[] = "{\"w\": 8, \"h\": 6, \"fl_x\": 10, \"ply_file_path\": \"points.ply\", "
                               "\"frames\": [{\"file_path\": \"./photos/b.png\", \"transform_matrix\": "
                               "[[1,0,0,10],[0,1,0,20],[0,0,1,30],[0,0,0,1]]},{\"file_path\": \"photos/a\", "
                               "\"transform_matrix\": [[1,0,0,11],[0,1,0,22],[0,0,1,33],[0,0,0,1]]}]}";
    write_text(in_folder("transforms.json"), text);
    scene s;
    for (int by_file = 0; by_file < 2; by_file++) {
        assert_ok(
            scene_load(by_file == 0 ? test_folder : in_folder("transforms.json"), NULL, &s, &assert_ok_err_));
        assert_string_equal(s.source, "transforms");
        assert_int_equal(s.view_count, 2);
        assert_string_equal(s.views[0].name, "photos/a");
        assert_string_equal(s.views[1].name, "photos/b.png");
        assert_non_null(strstr(s.views[0].path, "photos/a.png"));
        assert_true(s.origin[0] == 5 && s.origin[1] == 6 && s.origin[2] == 7);
        assert_true(s.views[0].camera.center[0] == 6 && s.views[1].camera.center[2] == 23);
        assert_int_equal(s.points.count, 1);
        assert_false(s.points.has_color);
        assert_true(s.points.color[0] == 0.5f);
        scene_free(&s);
    }
    /* Without points the origin is the median of the cameras, the lower one of two. */
    unlink(in_folder("points.ply"));
    char rest[1024];
    snprintf(rest, sizeof rest, "{\"w\": 8, \"h\": 6, \"fl_x\": 10, %s", strstr(text, "\"frames\""));
    write_text(in_folder("transforms.json"), rest);
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_true(s.origin[0] == 10 && s.origin[1] == 20 && s.origin[2] == 30);
    assert_int_equal(s.points.count, 0);
    assert_non_null(s.points.position);
    scene_free(&s);
    /* A named cloud that is missing, and two frames of one photo, are errors. */
    write_text(in_folder("transforms.json"), text);
    gbt_error err2 = {0};
    assert_int_equal(scene_load(test_folder, NULL, &s, &err2), GBT_ERR_IO);
    assert_non_null(strstr(err2.text, "points.ply"));
    snprintf(rest, sizeof rest,
             "{\"w\": 8, \"h\": 6, \"fl_x\": 10, \"frames\": ["
             "{\"file_path\": \"./photos/b.png\", \"transform_matrix\": "
             "[[1,0,0,10],[0,1,0,20],[0,0,1,30],[0,0,0,1]]},{\"file_path\": \"photos/b.png\", "
             "\"transform_matrix\": [[1,0,0,10],[0,1,0,20],[0,0,1,30],[0,0,0,1]]}]}");
    write_text(in_folder("transforms.json"), rest);
    gbt_error err3 = {0};
    assert_int_equal(scene_load(test_folder, NULL, &s, &err3), GBT_ERR_FORMAT);
    assert_non_null(strstr(err3.text, "duplicate image name: photos/b.png"));
}

/* The origin against a sort, over sizes and values that stress the radix selection. */
static void origin_is_the_median(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 60; seed++) {
        const size_t count = 1 + (size_t)(seed * 7 % 40);
        float *position = malloc(count * 3 * sizeof *position);
        double *sorted = malloc(count * sizeof *sorted);
        for (size_t i = 0; i < 3 * count; i++) {
            const float u = rng_uniform(seed, 0, i) - 0.5f;
            position[i] = seed % 4 == 0   ? roundf(4 * u)
                          : seed % 4 == 1 ? u * 1e-30f
                          : seed % 4 == 2 ? u * 1e11f
                                          : -fabsf(u);
        }
        assert_ok(ply_write(in_folder("m.ply"), &(ply_cloud){.vertex_count = count, .position = position},
                            &assert_ok_err_));
        scene s;
        assert_ok(scene_load(in_folder("m.ply"), NULL, &s, &assert_ok_err_));
        assert_string_equal(s.source, "ply");
        assert_int_equal(s.view_count, 0);
        for (size_t k = 0; k < 3; k++) {
            for (size_t i = 0; i < count; i++)
                sorted[i] = (double)position[3 * i + k];
            qsort(sorted, count, sizeof *sorted, compare_doubles);
            if (s.origin[k] != sorted[(count - 1) / 2])
                fail_msg("seed %llu: axis %zu: %g, wanted %g", (unsigned long long)seed, k, s.origin[k],
                         sorted[(count - 1) / 2]);
            for (size_t i = 0; i < count; i++)
                assert_true(s.points.position[3 * i + k] ==
                            (float)((double)position[3 * i + k] - s.origin[k]));
        }
        scene_free(&s);
        free(position);
        free(sorted);
    }
}

static void extent_is_positive(void **state)
{
    (void)state;
    scene_view one = {.camera = {.center = {5, 5, 5}}};
    scene s = {.view_count = 1, .views = &one};
    assert_true(scene_camera_extent(&s) == 1e-3);
    assert_true(scene_camera_extent(&(scene){0}) == 1e-3);
}

/* The k-th allocation fails, for every k: the right status, a message, an empty result; nothing is left
   behind (the sanitizer sees). */
static void no_memory(void **state)
{
    (void)state;
    write_model(false, false);
    for (int i = 2; i <= VIEW_COUNT; i++) { /* the first is missing */
        write_text(in_folder("images/v%d.png", i), "not read here");
    }
    write_text(in_folder("j/a.png"), "not read here");
    write_text(in_folder("j/p.ply"),
               "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
               "z\nend_header\n5 6 7\n");
    write_text(
        in_folder("j/transforms.json"),
        "{\"w\": 8, \"h\": 6, \"fl_x\": 10, \"ply_file_path\": \"p.ply\", \"frames\": [{\"file_path\": "
        "\"a\", \"transform_matrix\": [[1,0,0,10],[0,1,0,20],[0,0,1,30],[0,0,0,1]]}]}");
    write_text(in_folder("list.txt"), "v9.png\n");
    const char *list = in_folder("list.txt"), *j = in_folder("j");
    for (int which = 0; which < 2; which++) {
        const scene_split split = {.kind = which == 0 ? SCENE_SPLIT_LIST : SCENE_SPLIT_NONE,
                                   .list_path = list};
        long failures = 0;
        for (gbt_status status = GBT_ERR_NO_MEMORY; status != GBT_OK; failures++) {
            scene s;
            gbt_error err = {0};
            mem_fail_after(failures);
            status = scene_load(which == 0 ? test_folder : j, &split, &s, &err);
            mem_fail_after(-1);
            check_message(status, &err);
            if (status != GBT_OK) {
                assert_int_equal(status, GBT_ERR_NO_MEMORY);
                assert_null(s.views);
            }
            scene_free(&s);
        }
        assert_true(failures > 5);
    }
}

/* Area averages in double, straight from the definition. */
static double box_mean(const image *in, int channel, double x0, double x1, double y0, double y1)
{
    double sum = 0;
    for (int y = 0; y < in->height; y++)
        for (int x = 0; x < in->width; x++) {
            const double w = fmin(x1, x + 1) - fmax(x0, x), h = fmin(y1, y + 1) - fmax(y0, y);
            if (w > 0 && h > 0)
                sum += w * h * (double)in->pixels[(y * in->width + x) * in->channels + channel];
        }
    return sum / ((x1 - x0) * (y1 - y0));
}

static void resize_is_the_area_mean(void **state)
{
    (void)state;
    static const int sizes[][4] = {{7, 5, 3, 2}, {8, 6, 4, 3}, {10, 9, 7, 9}, {5, 4, 5, 4},
                                   {3, 2, 7, 5}, {1, 1, 4, 3}, {9, 11, 1, 1}, {640, 3, 641, 2}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        const int *n = sizes[i];
        image in, out;
        assert_ok(image_alloc(&in, n[0], n[1], 3, &assert_ok_err_));
        for (int k = 0; k < 3 * n[0] * n[1]; k++)
            in.pixels[k] = rng_uniform(i, 1, (uint64_t)k);
        assert_ok(photo_resize(&in, n[2], n[3], &out, &assert_ok_err_));
        assert_int_equal(out.width, n[2]);
        assert_int_equal(out.height, n[3]);
        for (int y = 0; y < n[3]; y++)
            for (int x = 0; x < n[2]; x++)
                for (int c = 0; c < 3; c++) {
                    const double fx = (double)n[0] / n[2], fy = (double)n[1] / n[3];
                    const double want = box_mean(&in, c, x * fx, (x + 1) * fx, y * fy, (y + 1) * fy);
                    const double got = (double)out.pixels[(y * n[2] + x) * 3 + c];
                    if (fabs(got - want) > 1.5e-7)
                        fail_msg("%d x %d to %d x %d at %d, %d: %.9g, wanted %.9g", n[0], n[1], n[2], n[3], x,
                                 y, got, want);
                }
        for (int k = 0; k < 3 * n[0] * n[1]; k++)
            in.pixels[k] = 0.6f;
        image_free(&out);
        assert_ok(photo_resize(&in, n[2], n[3], &out, &assert_ok_err_));
        for (int k = 0; k < 3 * n[2] * n[3]; k++)
            assert_true(out.pixels[k] == 0.6f);
        image_free(&in);
        image_free(&out);
    }
}

/* Blender's synthetic scenes: two files, names without endings, one angle for all. */
static void blender_folder(void **state)
{
    (void)state;
    static const char form[] =
        "{\"camera_angle_x\": 0.7853981633974483, \"frames\": [{\"file_path\": \"./%s/r_0\", "
        "\"transform_matrix\": [[1,0,0,%d],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}]}";
    static const char *const sets[] = {"train", "val", "test"};
    scene s;
    for (int i = 0; i < 3; i++) {
        char text[512];
        write_picture(in_folder("%s/r_0.png", sets[i]), 8, 6);
        snprintf(text, sizeof text, form, sets[i], i);
        write_text(in_folder("transforms_%s.json", sets[i]), text);
        assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
        assert_string_equal(s.source, "blender");
        assert_int_equal(s.has_split, i > 0);
        assert_int_equal(s.view_count, i == 0 ? 1 : 2);
        for (size_t v = 0; v < s.view_count; v++) {
            const bool is_train = strcmp(s.views[v].name, "train/r_0") == 0;
            assert_int_equal(s.views[v].is_test, i > 0 && !is_train);
            assert_int_equal(s.views[v].alpha, GBT_ALPHA_AUTO);
        }
        if (i > 0)
            assert_string_equal(s.views[i == 1].name, i == 1 ? "val/r_0" : "test/r_0");
        assert_true(fabs(s.views[0].camera.params[0] - 4 / tan(0.39269908169872414)) < 1e-12 &&
                    s.views[0].camera.params[3] == 3);
        scene_set_alpha(&s, GBT_ALPHA_AUTO);
        assert_int_equal(s.views[0].alpha, GBT_ALPHA_WHITE);
        scene_free(&s);
    }
    /* Another split replaces the data set's. */
    assert_ok(scene_load(test_folder, &(scene_split){.kind = SCENE_SPLIT_NONE}, &s, &assert_ok_err_));
    assert_int_equal(count_tests(&s), 0);
    scene_free(&s);
    /* By its name a file is a data set like any other. */
    assert_ok(scene_load(in_folder("transforms_test.json"), NULL, &s, &assert_ok_err_));
    assert_string_equal(s.source, "transforms");
    assert_int_equal(s.view_count, 1);
    scene_free(&s);
}

/* A file that holds out nothing is as none; what is trained on is not held out. */
static void blender_without_a_split(void **state)
{
    (void)state;
#define VIEW(name, x)                                                                                        \
    "{\"file_path\": \"" name "\", \"transform_matrix\": [[1,0,0," x "],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}"
#define BLENDER "{\"camera_angle_x\": 0.7, \"frames\": ["
    static const struct {
        const char *test, *val, *says;
        size_t views;
        bool has_split;
        const char *held_out; /* the first by its name */
    } cases[] = {
        {BLENDER "]}", NULL, "", 2, false, "train/0"},
        {BLENDER "]}", BLENDER VIEW("val/0", "5") "]}", "", 3, true, "val/0"},
        {BLENDER VIEW("train/0", "1") "," VIEW("./train/1", "2") "]}", NULL,
         "transforms_test.json: photos also listed for training, so not held out: 2", 2, false, "train/0"},
        {BLENDER VIEW("train/0.png", "1") "," VIEW("val/0", "2") "]}", BLENDER "]}",
         "transforms_test.json: photos also listed for training, so not held out: 1", 3, true, "val/0"},
    };
    char text[300];
    scene s;
    write_picture(in_folder("train/0.png"), 8, 6);
    write_picture(in_folder("train/1.png"), 8, 6);
    write_picture(in_folder("val/0.png"), 8, 6);
    write_text(in_folder("transforms_train.json"),
               BLENDER VIEW("train/0", "1") "," VIEW("train/1", "2") "]}");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_text(in_folder("transforms_test.json"), cases[i].test);
        unlink(in_folder("transforms_val.json"));
        if (cases[i].val != NULL)
            write_text(in_folder("transforms_val.json"), cases[i].val);
        text[0] = '\0';
        gbt_listen(keep_text, text);
        assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
        gbt_listen(NULL, NULL);
        assert_int_equal(text[0] != '\0', cases[i].says[0] != '\0');
        if (strstr(text, cases[i].says) == NULL)
            fail_msg("%zu: %s", i, text);
        assert_int_equal(s.view_count, cases[i].views);
        assert_int_equal(s.has_split, cases[i].has_split);
        size_t first = 0;
        while (!s.views[first].is_test)
            first++;
        assert_string_equal(s.views[first].name, cases[i].held_out);
        assert_int_equal(count_tests(&s), 1);
        scene_free(&s);
    }
    write_text(in_folder("transforms_train.json"), BLENDER "]}");
    gbt_error err = {0};
    assert_int_equal(scene_load(test_folder, NULL, &s, &err), GBT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "transforms_train.json: frames is not a list with at least one entry"));
#undef BLENDER
#undef VIEW
}

/* nerfstudio's mask_path and train_filenames; instant-ngp's x_fov. */
static void transforms_masks_and_split(void **state)
{
    (void)state;
    static const char form[] =
        "{\"x_fov\": 45, \"train_filenames\": [\"./b.png\"], \"frames\": ["
        "{\"file_path\": \"a.png\", \"mask_path\": %s, \"transform_matrix\": "
        "[[1,0,0,10],[0,1,0,20],[0,0,1,30],[0,0,0,1]]},"
        "{\"file_path\": \"b.png\", \"transform_matrix\": [[1,0,0,11],[0,1,0,22],[0,0,1,33],[0,0,0,1]]}]}";
    static const struct {
        const char *mask;
        gbt_status status;
        const char *says;
    } cases[] = {
        {"\"m.png\"", GBT_OK, ""},
        {"null", GBT_OK, ""},
        {"\"none.png\"", GBT_ERR_IO, "frame 0: mask is missing"},
        {"\"../m.png\"", GBT_ERR_FORMAT, "'..'"},
        {"7", GBT_ERR_FORMAT, "mask_path: wanted a string"},
    };
    write_picture(in_folder("a.png"), 8, 6);
    write_picture(in_folder("b.png"), 8, 6);
    write_picture(in_folder("m.png"), 8, 6);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[1024];
        snprintf(text, sizeof text, form, cases[i].mask);
        write_text(in_folder("transforms.json"), text);
        scene s;
        gbt_error err = {0};
        const gbt_status status = scene_load(test_folder, NULL, &s, &err);
        check_message(status, &err);
        if (status != cases[i].status || strstr(err.text, cases[i].says) == NULL)
            fail_msg("%s: status %d: %s", cases[i].mask, (int)status, err.text);
        if (status == GBT_OK) {
            assert_int_equal(s.views[0].mask_path != NULL, i == 0);
            assert_null(s.views[1].mask_path);
            assert_true(s.views[0].is_test && !s.views[1].is_test);
            assert_true(fabs(s.views[0].camera.params[0] - 4 / tan(0.39269908169872414)) < 1e-9);
        }
        scene_free(&s);
    }
    static const struct {
        const char *list, *says;
    } bad[] = {{"7", "train_filenames: wanted a list"},
               {"[7]", "entry 0 is not a string"},
               {"[]", "all 1 views are held out"}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        char text[512];
        snprintf(text, sizeof text,
                 "{\"x_fov\": 45, \"train_filenames\": %s, \"frames\": [{\"file_path\": \"a.png\", "
                 "\"transform_matrix\": [[1,0,0,10],[0,1,0,20],[0,0,1,30],[0,0,0,1]]}]}",
                 bad[i].list);
        write_text(in_folder("transforms.json"), text);
        scene s;
        gbt_error err = {0};
        assert_int_not_equal(scene_load(test_folder, NULL, &s, &err), GBT_OK);
        if (strstr(err.text, bad[i].says) == NULL)
            fail_msg("%s", err.text);
    }
}

/* Backslashes are slashes where nothing has the name as it is written. */
static void transforms_from_windows(void **state)
{
    (void)state;
    write_picture(in_folder("images/a.png"), 8, 6);
    write_picture(in_folder("images/b.png"), 8, 6);
    write_picture(in_folder("images\\a.png.png"), 8, 6);
    write_picture(in_folder("masks/a.png"), 8, 6);
    write_text(in_folder("points/p.ply"),
               "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
               "z\nend_header\n1 2 3\n");
    write_text(in_folder("transforms.json"),
               "{\"fl_x\": 10, \"ply_file_path\": \".\\\\points\\\\p.ply\", \"train_filenames\": "
               "[\".\\\\images\\\\b.png\", \"images\\\\a.png.png\"], \"frames\": ["
               "{\"file_path\": \"images\\\\a\", \"mask_path\": \"masks\\\\a.png\", \"transform_matrix\": "
               "[[1,0,0,10],[0,1,0,20],[0,0,1,30],[0,0,0,1]]},"
               "{\"file_path\": \"images\\\\a.png.png\", \"transform_matrix\": "
               "[[1,0,0,11],[0,1,0,22],[0,0,1,33],[0,0,0,1]]},"
               "{\"file_path\": \".\\\\images\\\\b.png\", \"transform_matrix\": "
               "[[1,0,0,12],[0,1,0,24],[0,0,1,36],[0,0,0,1]]}]}");
    static const struct {
        const char *name;
        bool is_test, has_mask;
    } want[] = {
        {"images/a", true, true}, {"images/b.png", false, false}, {"images\\a.png.png", false, false}};
    scene s;
    assert_ok(scene_load(test_folder, NULL, &s, &assert_ok_err_));
    assert_int_equal(s.view_count, 3);
    assert_int_equal(s.points.count, 1);
    for (int i = 0; i < 3; i++) {
        assert_string_equal(s.views[i].name, want[i].name);
        assert_int_equal(s.views[i].is_test, want[i].is_test);
        assert_int_equal(s.views[i].mask_path != NULL, want[i].has_mask);
    }
    scene_free(&s);
}

static void photos(void **state)
{
    (void)state;
    write_picture(in_folder("p.png"), 8, 6);
    char path[4096];
    snprintf(path, sizeof path, "%s/p.png", test_folder);
    scene_view view = {
        .name = path, .path = path, .camera = {.model = GBT_CAMERA_PINHOLE, .width = 8, .height = 6}};
    image im;
    assert_ok(scene_read_photo(&view, 8, 6, &im, &assert_ok_err_));
    assert_int_equal(im.channels, 3);
    assert_true(fabsf(im.pixels[3 * (2 * 8 + 5)] - 5.0f / 255) < 1e-7f &&
                fabsf(im.pixels[3 * (2 * 8 + 5) + 1] - 2.0f / 255) < 1e-7f);
    image_free(&im);
    assert_ok(scene_read_photo(&view, 4, 3, &im, &assert_ok_err_));
    assert_true(fabsf(im.pixels[3 * (2 * 4 + 1)] - 2.5f / 255) < 1e-7f &&
                fabsf(im.pixels[3 * (2 * 4 + 1) + 1] - 4.5f / 255) < 1e-7f);
    image_free(&im);
    /* 80: the aspect may miss by one pixel of the smaller image. */
    static const struct {
        int width, height;
        bool good;
    } stated[] = {{16, 12, true}, {16, 13, true},   {16, 14, true},   {16, 16, false}, {17, 12, true},
                  {4, 3, true},   {5, 3, true},     {6, 3, false},    {6, 8, false},   {8, 7, true},
                  {8, 8, false},  {800, 600, true}, {800, 750, false}};
    for (size_t i = 0; i < sizeof stated / sizeof stated[0]; i++) {
        view.camera.width = stated[i].width;
        view.camera.height = stated[i].height;
        gbt_error err = {0};
        const gbt_status status = scene_read_photo(&view, 4, 3, &im, &err);
        if (status != (stated[i].good ? GBT_OK : GBT_ERR_FORMAT))
            fail_msg("%d x %d: status %d: %s", stated[i].width, stated[i].height, (int)status, err.text);
        check_message(status, &err);
        image_free(&im);
    }
    gbt_error err = {0};
    assert_int_equal(scene_read_photo(&view, 0, 3, &im, &err), GBT_ERR_ARGUMENT);
    gbt_error err2 = {0};
    view.path = (char[]){"/no/such/photo.png"};
    assert_int_equal(scene_read_photo(&view, 4, 3, &im, &err2), GBT_ERR_IO);
    assert_null(im.pixels);
}

/* Alpha is composited on black; values that are not numbers do not survive. */
static void photo_alpha_and_nan(void **state)
{
    (void)state;
    char path[4096];
    image im;
    assert_ok(image_alloc(&im, 2, 1, 4, &assert_ok_err_));
    const float pixels[8] = {1, 0.6f, 0.2f, 1, 1, 0.6f, 0.2f, 0.4f};
    memcpy(im.pixels, pixels, sizeof pixels);
    snprintf(path, sizeof path, "%s/alpha.png", test_folder);
    assert_ok(image_write(path, &im, &assert_ok_err_));
    image_free(&im);
    scene_view view = {.name = path, .path = path, .camera = {.width = 2, .height = 1}};
    assert_ok(scene_read_photo(&view, 2, 1, &im, &assert_ok_err_));
    static const float want[6] = {1, 0.6f, 0.2f, 0.4f, 0.24f, 0.08f};
    assert_int_equal(im.channels, 3);
    for (int k = 0; k < 6; k++)
        assert_true(fabsf(im.pixels[k] - want[k]) < 1e-6f);
    image_free(&im);
    assert_ok(image_alloc(&im, 2, 1, 3, &assert_ok_err_));
    const float poisoned[6] = {0.5f, NAN, INFINITY, 0.25f, 0.5f, 0.75f};
    memcpy(im.pixels, poisoned, sizeof poisoned);
    snprintf(path, sizeof path, "%s/nan.exr", test_folder);
    assert_ok(image_write(path, &im, &assert_ok_err_));
    image_free(&im);
    assert_ok(scene_read_photo(&view, 2, 1, &im, &assert_ok_err_));
    static const float cleaned[6] = {0.5f, 0, 0, 0.25f, 0.5f, 0.75f};
    assert_memory_equal(im.pixels, cleaned, sizeof cleaned);
    image_free(&im);
}

/* Colours of an EXR are times alpha already: the same photo as a PNG, where they are not. The last pixel
   glows, and has no opacity. */
static void alpha_of_an_exr(void **state)
{
    (void)state;
    static const gbt_alpha kinds[] = {GBT_ALPHA_BLACK, GBT_ALPHA_WHITE, GBT_ALPHA_MASK};
    static const float pixels[16] = {1, 0.6f, 0.2f, 1, 1, 0.6f, 0.2f, 0.4f, 0.2f, 0.4f, 1, 0.8f, 0, 0, 0, 0},
                       glow = 0.5f;
    char path[2][4096];
    image im;
    assert_ok(image_alloc(&im, 4, 1, 4, &assert_ok_err_));
    for (int exr = 0; exr < 2; exr++) {
        for (int i = 0; i < 16; i++)
            im.pixels[i] = exr && i % 4 < 3 ? pixels[i] * pixels[i - i % 4 + 3] : pixels[i];
        im.pixels[12] = exr ? glow : 0;
        snprintf(path[exr], sizeof path[exr], "%s/alpha.%s", test_folder, exr ? "exr" : "png");
        assert_ok(image_write(path[exr], &im, &assert_ok_err_));
    }
    image_free(&im);
    for (int k = 0; k < 3; k++) {
        image read[2];
        unsigned char *valid[2];
        for (int exr = 0; exr < 2; exr++) {
            const scene_view view = {
                .name = path[exr], .path = path[exr], .alpha = kinds[k], .camera = {.width = 4, .height = 1}};
            assert_ok(scene_read_photo_valid(&view, 4, 1, &read[exr], &valid[exr], &assert_ok_err_));
        }
        for (int i = 0; i < 4; i++) {
            const bool counts = kinds[k] != GBT_ALPHA_MASK || pixels[4 * i + 3] >= 0.5f;
            for (int exr = 0; exr < 2; exr++)
                assert_true((valid[exr] == NULL || valid[exr][i]) == counts);
            for (int c = 0; c < 3 && counts; c++) {
                const float more = i == 3 && c == 0 ? glow : 0;
                assert_true(fabsf(read[1].pixels[3 * i + c] - more - read[0].pixels[3 * i + c]) < 1e-6f);
            }
        }
        for (int exr = 0; exr < 2; exr++) {
            image_free(&read[exr]);
            mem_free(valid[exr]);
        }
    }
}

/* A mask of 0 and 1, of 0 and 255, lossy, half the size; alpha as a mask, on white; and what is no mask. */
static void masked_photos(void **state)
{
    (void)state;
    char photo[4096], mask_path[4096];
    snprintf(photo, sizeof photo, "%s/p.png", test_folder);
    snprintf(mask_path, sizeof mask_path, "%s/m.exr", test_folder);
    image im;
    assert_ok(image_alloc(&im, 4, 2, 4, &assert_ok_err_));
    for (int i = 0; i < 8; i++)
        for (int c = 0; c < 4; c++)
            im.pixels[4 * i + c] = c < 3 ? 0.2f : i == 5 ? 0.4f : 1;
    assert_ok(image_write(photo, &im, &assert_ok_err_));
    image_free(&im);
    static const struct {
        int width, height;
        float values[8];
        gbt_alpha alpha;
        unsigned valid;
    } cases[] = {
        {4, 2, {1, 0, 1, 1, 1, 1, 0, 1}, GBT_ALPHA_BLACK, 0xbd},
        {4, 2, {0.004f, 0, 0.004f, 0.004f, 0.004f, 0.004f, 0, 0.004f}, GBT_ALPHA_BLACK, 0xbd},
        {4, 2, {0.97f, 0.04f, 1, 0.5f, 0.99f, 0.6f, 0.49f, 1}, GBT_ALPHA_BLACK, 0xbd},
        {4, 2, {1, 0, 1, 1, 1, 1, 0, 1}, GBT_ALPHA_MASK, 0x9d},
        {4, 2, {0}, GBT_ALPHA_BLACK, 0},
        {2, 1, {1, 0}, GBT_ALPHA_WHITE, 0x33},
        {0, 0, {0}, GBT_ALPHA_MASK, 0xdf}, /* no mask */
        {0, 0, {0}, GBT_ALPHA_WHITE, 0xff},
        {2, 8, {0}, GBT_ALPHA_WHITE, 0x100}, /* another aspect */
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        scene_view view = {
            .name = photo, .path = photo, .alpha = cases[k].alpha, .camera = {.width = 4, .height = 2}};
        if (cases[k].width > 0) {
            assert_ok(image_alloc(&im, cases[k].width, cases[k].height, 1, &assert_ok_err_));
            for (int i = 0; i < cases[k].width * cases[k].height; i++)
                im.pixels[i] = i < 8 ? cases[k].values[i] : 0;
            assert_ok(image_write(mask_path, &im, &assert_ok_err_));
            image_free(&im);
            view.mask_path = mask_path;
        }
        unsigned char *valid;
        gbt_error err = {0};
        const gbt_status status = scene_read_photo_valid(&view, 4, 2, &im, &valid, &err);
        check_message(status, &err);
        assert_int_equal(status, cases[k].valid == 0x100 ? GBT_ERR_FORMAT : GBT_OK);
        for (unsigned i = 0; i < 8 && status == GBT_OK; i++)
            if ((valid == NULL || valid[i]) != (cases[k].valid >> i & 1))
                fail_msg("case %zu, pixel %u", k, i);
        if (status == GBT_OK) {
            const float want = cases[k].alpha == GBT_ALPHA_BLACK   ? 0.08f
                               : cases[k].alpha == GBT_ALPHA_WHITE ? 0.68f
                                                                   : 0.2f;
            assert_true(fabsf(im.pixels[3 * 5] - want) < 1e-6f && fabsf(im.pixels[0] - 0.2f) < 1e-6f);
        }
        mem_free(valid);
        image_free(&im);
    }
}

/* Light in any channel counts, and only where it is opaque: 1, 2, 3 and 4 channels. */
static void masks_of_any_color(void **state)
{
    (void)state;
    char photo[4096], mask_path[4096];
    snprintf(photo, sizeof photo, "%s/p.png", test_folder);
    snprintf(mask_path, sizeof mask_path, "%s/m.png", test_folder);
    write_picture(in_folder("p.png"), 4, 1);
    static const struct {
        int channels;
        float values[16];
        unsigned valid;
    } cases[] = {
        {1, {0, 1, 0.4f, 0.6f}, 0xa},
        {2, {1, 0, 1, 1, 1, 0.4f, 0.6f, 1}, 0xa},
        {3, {0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0}, 0xe},
        {3, {0.2f, 0.4f, 0.1f, 0.2f, 0.6f, 0.1f, 0.1f, 0, 1, 0.3f, 0.3f, 0.3f}, 0x6},
        {4, {1, 1, 1, 0, 1, 0, 0, 1, 0, 0, 1, 0.4f, 0, 1, 0, 0.6f}, 0xa},
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        const scene_view view = {
            .name = photo, .path = photo, .mask_path = mask_path, .camera = {.width = 4, .height = 1}};
        image im;
        unsigned char *valid;
        assert_ok(image_alloc(&im, 4, 1, cases[k].channels, &assert_ok_err_));
        memcpy(im.pixels, cases[k].values, 4 * (size_t)cases[k].channels * sizeof *im.pixels);
        assert_ok(image_write(mask_path, &im, &assert_ok_err_));
        image_free(&im);
        assert_ok(scene_read_photo_valid(&view, 4, 1, &im, &valid, &assert_ok_err_));
        for (unsigned i = 0; i < 4; i++)
            if (valid[i] != (cases[k].valid >> i & 1))
                fail_msg("case %zu, pixel %u", k, i);
        mem_free(valid);
        image_free(&im);
    }
}

typedef struct real_case {
    const char *path, *source;
    size_t views, tests, points;
    int width, height;
    gbt_camera_model model;
} real_case;

static real_case real_cases[] = {
    {"data/fox", "colmap-bin", 50, 7, 19317, 360, 640, GBT_CAMERA_PINHOLE},
    {"data/castle", "colmap-bin", 30, 4, 50725, 640, 427, GBT_CAMERA_PINHOLE},
    {"data/aerial", "colmap-bin", 28, 4, 41827, 478, 640, GBT_CAMERA_PINHOLE},
    {"data/plush", "colmap-bin", 97, 13, 25784, 640, 479, GBT_CAMERA_PINHOLE},
    {"data/fox_transforms", "transforms", 50, 7, 0, 540, 960, GBT_CAMERA_OPENCV},
    {"data/garden_points/points.ply", "ply", 0, 0, 138766, 0, 0, 0},
};

static void real_data(void **state)
{
    const real_case *c = *state;
    const char *path = shared_path(c->path);
    if (path == NULL)
        skip();
    scene s;
    assert_ok(scene_load(path, NULL, &s, &assert_ok_err_));
    assert_string_equal(s.source, c->source);
    assert_int_equal(s.view_count, c->views);
    assert_int_equal(count_tests(&s), c->tests);
    assert_int_equal(s.points.count, c->points);
    assert_int_equal(s.points_dropped, 0);
    size_t seen = 0, looked_at = 0;
    for (size_t i = 0; i < s.view_count; i++) {
        const gbt_camera *camera = &s.views[i].camera;
        assert_int_equal(camera->width, c->width);
        assert_int_equal(camera->height, c->height);
        assert_int_equal(camera->model, c->model);
        for (size_t k = 0; k < s.points.count && i % 10 == 0; k += 100) {
            const double d[3] = {(double)s.points.position[3 * k] - camera->center[0],
                                 (double)s.points.position[3 * k + 1] - camera->center[1],
                                 (double)s.points.position[3 * k + 2] - camera->center[2]};
            double in_camera[3], pixel[2];
            dmat_apply(camera->rotation, d, in_camera);
            looked_at++;
            seen += in_camera[2] > 0 && gbt_camera_project(camera, in_camera, pixel) && pixel[0] >= 0 &&
                    pixel[0] <= camera->width && pixel[1] >= 0 && pixel[1] <= camera->height;
        }
    }
    /* Wrong axes or poses would put nearly all points behind the cameras or beside the photos. */
    if (looked_at > 0 && (double)seen < 0.15 * (double)looked_at)
        fail_msg("%s: only %zu of %zu points are seen", c->path, seen, looked_at);
    if (s.view_count > 0) {
        image im;
        assert_ok(scene_read_photo(&s.views[0], c->width / 4, c->height / 4, &im, &assert_ok_err_));
        assert_int_equal(im.width, c->width / 4);
        image_free(&im);
    }
    print_message("%s: origin %g %g %g, extent %g, seen %zu of %zu\n", c->path, s.origin[0], s.origin[1],
                  s.origin[2], scene_camera_extent(&s), seen, looked_at);
    scene_free(&s);
}

/* The two forms of fox share photos but not the world: angles between cameras must agree, so the axes of both
   readers do. */
static void fox_twice(void **state)
{
    (void)state;
    const char *path = shared_path("data/fox");
    scene a, b;
    if (path == NULL)
        skip();
    assert_ok(scene_load(path, NULL, &a, &assert_ok_err_));
    path = shared_path("data/fox_transforms");
    if (path == NULL)
        skip();
    assert_ok(scene_load(path, NULL, &b, &assert_ok_err_));
    size_t compared = 0;
    double worst = 0;
    for (size_t i = 0; i < b.view_count; i++) {
        const char *slash = strrchr(b.views[i].name, '/');
        for (size_t k = 0; k < a.view_count; k++) {
            if (strcmp(a.views[k].name, slash != NULL ? slash + 1 : b.views[i].name) != 0)
                continue;
            static const gbt_camera *first[2];
            if (compared++ == 0) {
                first[0] = &a.views[k].camera;
                first[1] = &b.views[i].camera;
            }
            /* Rotation from the first camera to this one, in camera axes: R_i R_0^T, whatever the world
               is. */
            const double *now[2] = {a.views[k].camera.rotation, b.views[i].camera.rotation};
            for (int r = 0; r < 3; r++)
                for (int q = 0; q < 3; q++) {
                    double relative[2];
                    for (int w = 0; w < 2; w++)
                        relative[w] = dvec_dot(now[w] + 3 * r, first[w]->rotation + 3 * q);
                    worst = fmax(worst, fabs(relative[0] - relative[1]));
                }
        }
    }
    assert_int_equal(compared, 50);
    print_message("fox: largest difference of a relative rotation %g\n", worst);
    assert_true(worst < 0.05); /* two separate reconstructions; wrong signs would give 2 */
    scene_free(&a);
    scene_free(&b);
}

/* One in a hundred points may be nearer, one in five hundred where the lens looks to all sides. */
static void nearest_depth_leaves_out_some(void **state)
{
    (void)state;
    enum { COUNT = 1000 };
    static double position[3 * COUNT];
    static uint32_t seen[COUNT];
    for (int i = 0; i < COUNT; i++) {
        position[3 * i + 2] = COUNT - i; /* depths 1 to COUNT, the farthest first */
        seen[i] = (uint32_t)i;
    }
    const raw_scene raw = {.point_count = COUNT, .position = position};
    raw_view view = {.camera = {.model = GBT_CAMERA_SIMPLE_PINHOLE,
                                .width = 64,
                                .height = 48,
                                .params = {50, 32, 24},
                                .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}},
                     .seen = seen,
                     .seen_count = COUNT};
    double depth;
    assert_ok(raw_nearest_depth(&raw, &view, &depth, NULL));
    assert_true(depth == 10);
    view.camera.model = GBT_CAMERA_SIMPLE_RADIAL_FISHEYE;
    assert_ok(raw_nearest_depth(&raw, &view, &depth, NULL));
    assert_true(depth == 2);
    view.seen_count = 0;
    assert_ok(raw_nearest_depth(&raw, &view, &depth, NULL));
    assert_true(depth == 0);
}

int main(void)
{
    enum { REAL_COUNT = sizeof real_cases / sizeof real_cases[0] };
    const struct CMUnitTest fixed[] = {
        cmocka_unit_test_setup_teardown(recentred, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(folder_layouts, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(colmap_elsewhere, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(binary_is_preferred, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(missing_photos, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(masks_are_found, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(nothing_to_load, folder_make, folder_remove),
        cmocka_unit_test(too_long_path),
        cmocka_unit_test(parse_split),
        cmocka_unit_test_setup_teardown(splits, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(missing_photos_on_a_list, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(validation_leaves_held_out_photos_alone, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(transforms_folder, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(blender_folder, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(blender_without_a_split, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(transforms_masks_and_split, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(transforms_from_windows, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(alpha_of_an_exr, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(masked_photos, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(masks_of_any_color, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(origin_is_the_median, folder_make, folder_remove),
        cmocka_unit_test(extent_is_positive),
        cmocka_unit_test_setup_teardown(no_memory, folder_make, folder_remove),
        cmocka_unit_test(resize_is_the_area_mean),
        cmocka_unit_test_setup_teardown(photos, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(photo_alpha_and_nan, folder_make, folder_remove),
        cmocka_unit_test(fox_twice),
        cmocka_unit_test(nearest_depth_leaves_out_some),
    };
    static struct CMUnitTest real[REAL_COUNT];
    for (size_t i = 0; i < REAL_COUNT; i++)
        real[i] = (struct CMUnitTest){
            .name = real_cases[i].path, .test_func = real_data, .initial_state = &real_cases[i]};
    const int failures = cmocka_run_group_tests_name("scene", fixed, NULL, NULL);
    return failures + cmocka_run_group_tests_name("real data", real, NULL, NULL);
}
