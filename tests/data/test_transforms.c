/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_transforms.c -- transforms.json: axes, lenses, and every malformed case. */
#include "data_support.h"

#include "base/vec.h"
#include "base/near.h"
#include "data/transforms.h"

/* The photos of the cases, in one folder for all: a.png of 8 x 6 pixels, and sub/b.jpg. */
static gbt_status read_json(const char *text, size_t size, raw_scene *raw, char **points_name, gbt_error *err)
{
    unsigned char *copy = exact_copy(text, size);
    const source_file file = {"transforms.json", copy, size};
    const gbt_status status = transforms_read(&file, test_folder, false, raw, points_name, err);
    free(copy);
    return status;
}

#define POSE "\"transform_matrix\": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]"
#define FRAME "{\"file_path\": \"a.png\", " POSE "}"
#define FRAMES "\"frames\": [" FRAME "]}"
#define ROLLING(times)                                                                                       \
    "{\"w\": 8, \"h\": 6, \"fl_x\": 10, \"rolling_shutter\": " times ", \"frames\": [{\"file_path\": "       \
    "\"a.png\", \"transform_matrix_start\": [[1,0,0,1],[0,1,0,2],[0,0,1,3]]}]}"
#define SIZED "{\"w\": 8, \"h\": 6, \"fl_x\": 10, "

typedef struct json_case {
    const char *name, *text;
    gbt_status status;
    const char *says;
} json_case;

#define BAD GBT_ERR_FORMAT

static json_case json_cases[] = {
    {"good", SIZED FRAMES, GBT_OK, NULL},
    {"a byte order mark", "\xef\xbb\xbf" SIZED FRAMES, GBT_OK, NULL},
    {"a byte order mark alone", "\xef\xbb\xbf", BAD, "transforms.json:1: file is empty"},
    {"a byte order mark cut", "\xef\xbb", BAD, "not usable JSON"},
    {"42 empty", "", BAD, "transforms.json:1: file is empty"},
    {"42 not JSON", "hello", BAD, "transforms.json:1: not usable JSON"},
    {"42 truncated", "{\"w\": 8,\n\"frames\": [", BAD, "transforms.json:2: not usable JSON"},
    {"42 a list", "[1, 2]", BAD, "wanted a JSON object"},
    {"42 text behind", SIZED FRAMES " x", BAD, "not usable JSON"},
    {"44 no frames", "{\"w\": 8, \"h\": 6}", BAD, "no frames (wanted a transforms.json)"},
    {"45 frames is a number", "{\"frames\": 3}", BAD, "frames is not a list"},
    {"45 frames empty", "{\"frames\": []}", BAD, "frames is not a list with at least one entry"},
    {"45 a frame is a string", SIZED "\"frames\": [\"a.png\"]}", BAD, "frame 0: wanted an object"},
    {"46 3 x 3 matrix",
     SIZED "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0],[0,1,0],[0,0,1]]}]}", BAD,
     "3 or 4 rows of 4"},
    {"46 4 x 3 matrix",
     SIZED
     "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0],[0,1,0],[0,0,1],[1,2,3]]}]}",
     BAD, "3 or 4 rows of 4"},
    {"46 3 x 4 matrix",
     SIZED "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0,1],[0,1,0,2],[0,0,1,3]]}]}",
     GBT_OK, NULL},
    {"46 a string in it",
     SIZED
     "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0,\"1\"],[0,1,0,2],[0,0,1,3]]}]}",
     BAD, "something that is not a number"},
    {"46 a null in it",
     SIZED
     "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0,null],[0,1,0,2],[0,0,1,3]]}]}",
     BAD, "something that is not a number"},
    {"keys that are null are not there",
     "{\"w\": 8, \"h\": 6, \"fl_x\": 10, \"fl_y\": null, \"camera_angle_x\": null, \"k1\": null, "
     "\"camera_model\": null, \"distortion_params\": null, \"rolling_shutter\": null, "
     "\"train_filenames\": null, \"ply_file_path\": null, \"frames\": [{\"file_path\": \"a.png\", "
     "\"w\": null, \"mask_path\": null, \"transform_matrix_start\": null, "
     "\"transform_matrix\": [[1,0,0,1],[0,1,0,2],[0,0,1,3]]}]}",
     GBT_OK, NULL},
    {"46 a matrix that is null",
     SIZED "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": null}]}", BAD,
     "frame 0: transform_matrix: is missing"},
    {"46 a null row",
     SIZED "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [null,[0,1,0,2],[0,0,1,3]]}]}", BAD,
     "3 or 4 rows of 4"},
    {"46 no matrix", SIZED "\"frames\": [{\"file_path\": \"a.png\"}]}", BAD,
     "frame 0: transform_matrix: is missing"},
    {"46 transposed matrix",
     SIZED "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": "
           "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[1,2,3,1]]}]}",
     BAD, "transposed"},
    {"46 translation 1e30",
     SIZED
     "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0,1e30],[0,1,0,2],[0,0,1,3]]}]}",
     BAD, "too large"},
    {"47 scaled rotation",
     SIZED "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[2,0,0,1],[0,2,0,2],[0,0,2,3]]}]}",
     BAD, "is not a rotation (wanted |R'R - I| <= 1e-3, got 3)"},
    {"47 just too far",
     SIZED
     "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1.00051,0,0,1],[0,1,0,2],[0,0,1,3]]}]}",
     BAD, "is not a rotation"},
    {"47 just near enough",
     SIZED
     "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1.00049,0,0,1],[0,1,0,2],[0,0,1,3]]}]}",
     GBT_OK, NULL},
    {"47 reflection",
     SIZED
     "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0,1],[0,1,0,2],[0,0,-1,3]]}]}",
     BAD, "reflection"},
    {"47 zeros",
     SIZED "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": [[0,0,0,1],[0,0,0,2],[0,0,0,3]]}]}",
     BAD, "is not a rotation"},
    {"48 no focal length", "{\"w\": 8, \"h\": 6, " FRAMES, BAD, "neither fl_x nor camera_angle_x"},
    {"49 both, agreeing or not", "{\"w\": 8, \"h\": 6, \"fl_x\": 10, \"camera_angle_x\": 1.5, " FRAMES,
     GBT_OK, NULL},
    {"50 angle pi", "{\"w\": 8, \"h\": 6, \"camera_angle_x\": 3.14159265358979324, " FRAMES, BAD,
     "camera_angle_x: out of range (wanted 0..pi"},
    {"50 angle 0", "{\"w\": 8, \"h\": 6, \"camera_angle_x\": 0, " FRAMES, BAD,
     "camera_angle_x: out of range"},
    {"50 angle a string", "{\"w\": 8, \"h\": 6, \"camera_angle_x\": \"1\", " FRAMES, BAD,
     "camera_angle_x: not a number"},
    {"51 width 0", "{\"w\": 0, \"h\": 6, \"fl_x\": 10, " FRAMES, BAD,
     "frame 0: w: out of range (wanted a whole number in 1..65500, got 0)"},
    {"51 width 8.5", "{\"w\": 8.5, \"h\": 6, \"fl_x\": 10, " FRAMES, BAD, "got 8.5"},
    {"51 width 8.0", "{\"w\": 8.0, \"h\": 6.0, \"fl_x\": 10, " FRAMES, GBT_OK, NULL},
    {"51 height 65501", "{\"w\": 8, \"h\": 65501, \"fl_x\": 10, " FRAMES, BAD, "h: out of range"},
    {"52 duplicate keys", "{\"w\": 8, \"w\": 9, \"h\": 6, \"fl_x\": 10, " FRAMES, BAD, "duplicate"},
    {"53 NaN", "{\"w\": 8, \"h\": 6, \"fl_x\": NaN, " FRAMES, BAD, "not usable JSON"},
    {"53 1e400", "{\"w\": 8, \"h\": 6, \"fl_x\": 1e400, " FRAMES, BAD,
     "not usable JSON: real number overflow"},
    {"53 integer overflow", "{\"w\": 8, \"h\": 6, \"fl_x\": 99999999999999999999, " FRAMES, BAD, "too big"},
    {"53 focal length 0", "{\"w\": 8, \"h\": 6, \"fl_x\": 0, " FRAMES, BAD,
     "focal length of camera model PINHOLE is not positive"},
    {"53 focal length negative", "{\"w\": 8, \"h\": 6, \"fl_x\": -5, " FRAMES, BAD, "not positive (got -5)"},
    {"53 focal length 1e300", "{\"w\": 8, \"h\": 6, \"fl_x\": 1e300, " FRAMES, BAD,
     "fl_x: number is too large"},
    {"54 invalid UTF-8", SIZED "\"frames\": [{\"file_path\": \"a\xff.png\", " POSE "}]}", BAD,
     "not usable JSON"},
    {"54 zero in a path", SIZED "\"frames\": [{\"file_path\": \"a\\u0000.png\", " POSE "}]}", BAD,
     "not usable JSON"},
    {"54 newline in a path", SIZED "\"frames\": [{\"file_path\": \"a\\n.png\", " POSE "}]}", BAD,
     "frame 0: image name has a control character"},
    {"54 absolute path", SIZED "\"frames\": [{\"file_path\": \"/a.png\", " POSE "}]}", BAD,
     "image name is absolute"},
    {"54 path leaves", SIZED "\"frames\": [{\"file_path\": \"sub/../../a.png\", " POSE "}]}", BAD,
     "leaves the data set"},
    {"54 path empty", SIZED "\"frames\": [{\"file_path\": \"./\", " POSE "}]}", BAD, "image name is empty"},
    {"54 path a number", SIZED "\"frames\": [{\"file_path\": 3, " POSE "}]}", BAD,
     "file_path: wanted a string"},
    {"54 no path", SIZED "\"frames\": [{" POSE "}]}", BAD, "file_path: wanted a string"},
    {"55 without extension, png", SIZED "\"frames\": [{\"file_path\": \"./a\", " POSE "}]}", GBT_OK, NULL},
    {"55 without extension, jpg", SIZED "\"frames\": [{\"file_path\": \"sub/b\", " POSE "}]}", GBT_OK, NULL},
    {"slashes behind a dot", SIZED "\"frames\": [{\"file_path\": \".//./a\", " POSE "}]}", GBT_OK, NULL},
    {"backslashes", SIZED "\"frames\": [{\"file_path\": \".\\\\sub\\\\b\", " POSE "}]}", GBT_OK, NULL},
    {"backslashes leave", SIZED "\"frames\": [{\"file_path\": \"sub\\\\..\\\\..\\\\a.png\", " POSE "}]}", BAD,
     "frame 0: image name leaves the data set by '..'"},
    {"55 no photo at all", SIZED "\"frames\": [{\"file_path\": \"c\", " POSE "}]}", GBT_ERR_IO,
     "none of the 1 photos exists, the first is c"},
    {"55 a folder is no photo", SIZED "\"frames\": [{\"file_path\": \"sub\", " POSE "}]}", GBT_ERR_IO,
     "none of the 1 photos exists"},
    {"only an end", SIZED "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix_end\": [[1]]}]}", BAD,
     "frame 0: transform_matrix: is missing"},
    {"an end that is none",
     SIZED "\"frames\": [{\"file_path\": \"a.png\", " POSE ", \"transform_matrix_end\": 3}]}", BAD,
     "frame 0: transform_matrix_end: wanted 3 or 4 rows"},
    {"a shutter of three", ROLLING("[0, 0, 1]"), BAD, "frame 0: rolling_shutter: wanted 4 numbers"},
    {"a shutter of words", ROLLING("[0, 0, \"1\", 0]"), BAD, "rolling_shutter: holds something that is not"},
    {"a slow shutter", ROLLING("[0, 0, 1.5, 0]"), BAD, "not a number in -1..1"},
    {"a shutter both ways", ROLLING("[0, 1, 1, 0]"), BAD, "rolling_shutter: goes across and down"},
    {"a shutter", ROLLING("[0, 0, 1, 0]"), GBT_OK, NULL},
    {"unknown camera model", "{\"camera_model\": \"FISHEYE624\", \"w\": 8, \"h\": 6, \"fl_x\": 10, " FRAMES,
     BAD, "camera_model is not supported: FISHEYE624"},
    {"camera model a number", "{\"camera_model\": 4, \"w\": 8, \"h\": 6, \"fl_x\": 10, " FRAMES, BAD,
     "camera_model: not a string"},
    {"k4 on a perspective lens", "{\"k4\": 0.1, \"w\": 8, \"h\": 6, \"fl_x\": 10, " FRAMES, BAD,
     "k4: not supported"},
    {"p1 on a fisheye", "{\"p1\": 0.1, \"is_fisheye\": true, \"w\": 8, \"h\": 6, \"fl_x\": 10, " FRAMES, BAD,
     "fisheye with tangential"},
    {"five distortion parameters",
     "{\"distortion_params\": [0,0,0,0,0], \"w\": 8, \"h\": 6, \"fl_x\": 10, " FRAMES, BAD,
     "wanted 6 numbers"},
    {"size from the photo", "{\"fl_x\": 10, " FRAMES, GBT_OK, NULL},
    {"size from something that is no photo",
     "{\"fl_x\": 10, \"frames\": [{\"file_path\": \"sub/b.jpg\", " POSE "}]}", BAD, "b.jpg"},
    {"points named outside", "{\"ply_file_path\": \"../x.ply\", \"w\": 8, \"h\": 6, \"fl_x\": 10, " FRAMES,
     BAD, "transforms.json: ply_file_path leaves the data set"},
    {"a mask named outside",
     SIZED "\"frames\": [{\"file_path\": \"a.png\", \"mask_path\": \"/m.png\", " POSE "}]}", BAD,
     "frame 0: mask_path is absolute"},
    {"points behind backslashes outside",
     "{\"ply_file_path\": \"..\\\\x.ply\", \"w\": 8, \"h\": 6, \"fl_x\": 10, " FRAMES, BAD,
     "leaves the data set"},
    {"points name a number", "{\"ply_file_path\": 1, \"w\": 8, \"h\": 6, \"fl_x\": 10, " FRAMES, BAD,
     "ply_file_path: wanted a string"},
};

static void malformed(void **state)
{
    const json_case *c = *state;
    raw_scene raw = {0};
    char *points_name = NULL;
    gbt_error err = {0};
    const gbt_status status = read_json(c->text, strlen(c->text), &raw, &points_name, &err);
    check_message(status, &err);
    if (status != c->status || (c->says != NULL && strstr(err.text, c->says) == NULL))
        fail_msg("status %d, message: %s", (int)status, err.text);
    if (status == GBT_OK) {
        assert_true(raw_is_sound(&raw));
        assert_int_equal(raw.view_count, 1);
        assert_int_equal(raw.views[0].camera.width, 8);
        assert_int_equal(raw.views[0].camera.height, 6);
        assert_true(raw.views[0].camera.params[0] == 10);
        assert_int_equal(raw.angles_disagreeing, strstr(c->name, "49") != NULL);
        assert_true(file_exists(raw.views[0].path));
    }
    raw_free(&raw);
    mem_free(points_name);
}

/* 43: nesting of 100,000. */
static void deep_nesting(void **state)
{
    (void)state;
    sink s = {0};
    sink_put_text(&s, "{\"frames\": ");
    for (int i = 0; i < 100000; i++)
        sink_put_text(&s, "[");
    raw_scene raw = {0};
    char *points_name = NULL;
    gbt_error err = {0};
    assert_int_equal(read_json((const char *)s.bytes, s.size, &raw, &points_name, &err), GBT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "depth"));
    sink_free(&s);
}

typedef struct lens_case {
    const char *name, *keys; /* without w and h */
    gbt_camera_model model;
    double params[12];
} lens_case;

static lens_case lens_cases[] = {
    {"focal length only", "\"fl_x\": 10", GBT_CAMERA_PINHOLE, {10, 10, 4, 3}},
    {"two focal lengths",
     "\"fl_x\": 10, \"fl_y\": 11, \"cx\": 3.5, \"cy\": 2.5",
     GBT_CAMERA_PINHOLE,
     {10, 11, 3.5, 2.5}},
    {"only fl_y", "\"fl_y\": 11", GBT_CAMERA_PINHOLE, {11, 11, 4, 3}},
    {"named pinhole", "\"camera_model\": \"PINHOLE\", \"fl_x\": 10", GBT_CAMERA_PINHOLE, {10, 10, 4, 3}},
    {"one angle", "\"camera_angle_x\": 1.5707963267948966", GBT_CAMERA_PINHOLE, {4, 4, 4, 3}},
    {"two angles",
     "\"camera_angle_x\": 1.5707963267948966, \"camera_angle_y\": 1.0471975511965976",
     GBT_CAMERA_PINHOLE,
     {4, 5.196152422706632, 4, 3}},
    {"fl_x beats the angles",
     "\"fl_x\": 10, \"camera_angle_x\": 0.761, \"camera_angle_y\": 0.3",
     GBT_CAMERA_PINHOLE,
     {10, 10, 4, 3}},
    {"distortion without a name",
     "\"fl_x\": 10, \"k1\": 0.1, \"k2\": 0.2, \"p1\": 0.3, \"p2\": 0.4",
     GBT_CAMERA_OPENCV,
     {10, 10, 4, 3, 0.1, 0.2, 0.3, 0.4}},
    {"distortion of zeros", "\"fl_x\": 10, \"k1\": 0", GBT_CAMERA_OPENCV, {10, 10, 4, 3}},
    {"named OpenCV", "\"fl_x\": 10, \"camera_model\": \"OPENCV\"", GBT_CAMERA_OPENCV, {10, 10, 4, 3}},
    {"third radial term",
     "\"fl_x\": 10, \"k1\": 0.1, \"k3\": 0.5",
     GBT_CAMERA_FULL_OPENCV,
     {10, 10, 4, 3, 0.1, 0, 0, 0, 0.5}},
    {"list of parameters",
     "\"fl_x\": 10, \"distortion_params\": [0.1, 0.2, 0, 0, 0.3, 0.4]",
     GBT_CAMERA_OPENCV,
     {10, 10, 4, 3, 0.1, 0.2, 0.3, 0.4}},
    {"fisheye",
     "\"fl_x\": 10, \"camera_model\": \"OPENCV_FISHEYE\", \"k1\": 0.1, \"k2\": 0.2, \"k3\": 0.3, \"k4\": 0.4",
     GBT_CAMERA_OPENCV_FISHEYE,
     {10, 10, 4, 3, 0.1, 0.2, 0.3, 0.4}},
    {"is_fisheye",
     "\"fl_x\": 10, \"is_fisheye\": true, \"k1\": 0.1",
     GBT_CAMERA_OPENCV_FISHEYE,
     {10, 10, 4, 3, 0.1}},
    {"is_fisheye false", "\"fl_x\": 10, \"is_fisheye\": false", GBT_CAMERA_PINHOLE, {10, 10, 4, 3}},
    {"equirectangular", "\"camera_model\": \"EQUIRECTANGULAR\"", GBT_CAMERA_EQUIRECTANGULAR, {8, 6}},
};

/* Each set of keys must mean the same at the top level, in the frame, and in the frame above contradicting
   ones at the top. */
static void lenses(void **state)
{
    const lens_case *c = *state;
    for (int where = 0; where < 2; where++) {
        char text[2048];
        if (where == 0)
            snprintf(text, sizeof text, "{\"w\": 8, \"h\": 6, %s, \"frames\": [" FRAME "]}", c->keys);
        else
            snprintf(
                text, sizeof text,
                "{\"w\": 80, \"h\": 60, \"frames\": [{\"w\": 8, \"h\": 6, %s, \"file_path\": \"a.png\", " POSE
                "}]}",
                c->keys);
        raw_scene raw = {0};
        char *points_name = NULL;
        assert_ok(read_json(text, strlen(text), &raw, &points_name, &assert_ok_err_));
        const gbt_camera *camera = &raw.views[0].camera;
        assert_int_equal(camera->model, c->model);
        assert_int_equal(camera->width, 8);
        for (int k = 0; k < 12; k++)
            assert_true(fabs(camera->params[k] - c->params[k]) < 1e-12);
        raw_free(&raw);
    }
}

/* An OpenGL camera at the origin with axes as the world's looks along -z with y up: for COLMAP x right, y
   down, z forward. */
static void axes(void **state)
{
    (void)state;
    static const char text[] = SIZED FRAMES;
    raw_scene raw = {0};
    char *points_name = NULL;
    assert_ok(read_json(text, strlen(text), &raw, &points_name, &assert_ok_err_));
    static const double rotation[9] = {1, 0, 0, 0, -1, 0, 0, 0, -1}, center[3] = {1, 2, 3};
    for (int k = 0; k < 9; k++)
        assert_true(raw.views[0].camera.rotation[k] == rotation[k]);
    assert_memory_equal(raw.views[0].camera.center, center, sizeof center);
    raw_free(&raw);
}

/* A turned camera: its forward direction must be minus the third column of the file's matrix, its down minus
   the second. */
static void turned_axes(void **state)
{
    (void)state;
    static const char text[] =
        SIZED "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\":"
              "[[0.36, 0.48, -0.8, 5], [-0.8, 0.6, 0, 6], [0.48, 0.64, 0.6, 7], [0, 0, 0, 1]]}]}";
    raw_scene raw = {0};
    char *points_name = NULL;
    assert_ok(read_json(text, strlen(text), &raw, &points_name, &assert_ok_err_));
    const double *r = raw.views[0].camera.rotation;
    const double right[3] = {0.36, -0.8, 0.48}, down[3] = {-0.48, -0.6, -0.64}, forward[3] = {0.8, 0, -0.6};
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(r[k] - right[k]) < 1e-15);
        assert_true(fabs(r[3 + k] - down[k]) < 1e-15);
        assert_true(fabs(r[6 + k] - forward[k]) < 1e-15);
    }
    raw_free(&raw);
}

/* A camera that goes from (1, 2, 3) to (5, 2, 3) and turns a right angle about z while its rows are read: the
   pose is that of the middle, and every line has its own. */
static void rolling_shutters(void **state)
{
    (void)state;
#define WAY                                                                                                  \
    "\"transform_matrix_start\": [[1,0,0,1],[0,1,0,2],[0,0,1,3]], \"transform_matrix_end\": "                \
    "[[0,-1,0,5],[1,0,0,2],[0,0,1,3]]"
    static const struct {
        const char *shutter;
        gbt_camera_shutter kind;
        double first, last; /* share of the way at the edges of the picture */
    } rows[] = {{"[0, 0, 1, 0]", GBT_CAMERA_SHUTTER_ROWS, 0, 1},
                {"[1, 0, -1, 0]", GBT_CAMERA_SHUTTER_ROWS, 1, 0},
                {"[0.25, 0.5, 0, 0]", GBT_CAMERA_SHUTTER_COLUMNS, 0.25, 0.75},
                {"[0, 0, 0.5, 0.5]", GBT_CAMERA_SHUTTER_ROWS, 0.25, 0.75},
                {"[0.5, 0, 0, 0]", GBT_CAMERA_SHUTTER_ROWS, 0.5, 0.5}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (int in_frame = 0; in_frame < 2; in_frame++) {
            char text[1024];
            snprintf(text, sizeof text,
                     SIZED "\"%s\": %s, \"frames\": [{\"file_path\": \"a.png\", %s%s%s " WAY "}]}",
                     in_frame ? "unknown" : "rolling_shutter", rows[i].shutter,
                     in_frame ? "\"rolling_shutter\": " : "", in_frame ? rows[i].shutter : "",
                     in_frame ? "," : "");
            raw_scene raw = {0};
            char *points_name = NULL;
            assert_ok(read_json(text, strlen(text), &raw, &points_name, &assert_ok_err_));
            const gbt_camera *camera = &raw.views[0].camera;
            assert_int_equal(camera->shutter, rows[i].kind);
            for (int k = 0; k <= 4; k++) {
                const double share = rows[i].first + (rows[i].last - rows[i].first) * k / 4,
                             angle = 1.5707963267948966 * share;
                const gbt_camera at =
                    gbt_camera_at(camera, camera->width * k / 4.0, camera->height * k / 4.0);
                assert_near(at.center[0], 1 + 4 * share, 1e-12);
                assert_near(at.center[1], 2, 1e-12);
                assert_near(at.rotation[0], cos(angle), 1e-12); /* the camera's right in the world */
                assert_near(at.rotation[1], sin(angle), 1e-12);
            }
            raw_free(&raw);
        }
    /* Without times it is the first pose; with one matrix there is no way. */
    static const char *const still[] = {SIZED "\"frames\": [{\"file_path\": \"a.png\", " WAY "}]}",
                                        SIZED "\"rolling_shutter\": [0, 0, 1, 0], " FRAMES};
    for (int i = 0; i < 2; i++) {
        raw_scene raw = {0};
        char *points_name = NULL;
        assert_ok(read_json(still[i], strlen(still[i]), &raw, &points_name, &assert_ok_err_));
        const gbt_camera at = gbt_camera_at(&raw.views[0].camera, 0, 6);
        assert_near(at.center[0], 1, 1e-15);
        assert_near(at.rotation[0], 1, 1e-15);
        raw_free(&raw);
    }
}

/* A rotation with any scale passes; everything else is reported, although the key is not used. */
static void odd_transforms_are_noticed(void **state)
{
    (void)state;
    static const struct {
        const char *matrix;
        bool odd;
    } cases[] = {
        {"null", false},
        {"[[1,0,0,0],[0,1,0,0],[0,0,1,0]]", false},
        {"[[0,2,0,5],[2,0,0,6],[0,0,-2,7],[0,0,0,1]]", false},
        {"[[0,0,0,0],[0,0,0,0],[0,0,0,0]]", true},
        {"[[1,0,0,0],[1,0,0,0],[0,0,1,0]]", true},  /* singular */
        {"[[1,0,0,0],[0,2,0,0],[0,0,1,0]]", true},  /* stretched */
        {"[[1,0,0,0],[0,1,0,0],[0,0,-1,0]]", true}, /* a reflection */
        {"[[1,0,0],[0,1,0],[0,0,1]]", true},
        {"3", true},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[512];
        raw_scene raw = {0};
        char *points_name = NULL;
        snprintf(text, sizeof text, "%s\"applied_transform\": %s, %s", SIZED, cases[i].matrix, FRAMES);
        assert_ok(read_json(text, strlen(text), &raw, &points_name, &assert_ok_err_));
        if (raw.has_odd_transform != cases[i].odd)
            fail_msg("%s", cases[i].matrix);
        raw_free(&raw);
    }
}

static void missing_frames_are_counted(void **state)
{
    (void)state;
    static const char text[] =
        SIZED "\"ply_file_path\": \"p.ply\", \"frames\": [" FRAME ", {\"file_path\": \"c.png\", " POSE
              "}, {\"file_path\": \"d\", " POSE "}]}";
    raw_scene raw = {0};
    char *points_name = NULL;
    assert_ok(read_json(text, strlen(text), &raw, &points_name, &assert_ok_err_));
    assert_int_equal(raw.view_count, 1);
    assert_int_equal(raw.photos_missing, 2);
    assert_string_equal(points_name, "p.ply");
    mem_free(points_name);
    raw_free(&raw);
}

int main(void)
{
    enum {
        BAD_COUNT = sizeof json_cases / sizeof json_cases[0],
        LENS_COUNT = sizeof lens_cases / sizeof lens_cases[0]
    };
    static struct CMUnitTest tests[BAD_COUNT + LENS_COUNT];
    for (size_t i = 0; i < BAD_COUNT; i++)
        tests[i] = (struct CMUnitTest){
            .name = json_cases[i].name, .test_func = malformed, .initial_state = &json_cases[i]};
    for (size_t i = 0; i < LENS_COUNT; i++)
        tests[BAD_COUNT + i] = (struct CMUnitTest){
            .name = lens_cases[i].name, .test_func = lenses, .initial_state = &lens_cases[i]};
    const struct CMUnitTest fixed[] = {
        cmocka_unit_test(axes),
        cmocka_unit_test(turned_axes),
        cmocka_unit_test(deep_nesting),
        cmocka_unit_test(missing_frames_are_counted),
        cmocka_unit_test(odd_transforms_are_noticed),
        cmocka_unit_test(rolling_shutters),
    };
    if (folder_make(NULL) != 0)
        return 1;
    write_picture(in_folder("a.png"), 8, 6);
    write_text(in_folder("sub/b.jpg"), "not read here");
    int failures = cmocka_run_group_tests_name("transforms, tables", tests, NULL, NULL);
    failures += cmocka_run_group_tests_name("transforms", fixed, NULL, NULL);
    return failures + folder_remove(NULL);
}
