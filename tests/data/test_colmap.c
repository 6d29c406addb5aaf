/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_colmap.c -- COLMAP models: what is read, every malformed case, mutations, round trips
   through the writer. */
#include "data_support.h"

#include <unistd.h>

#include "base/rng.h"
#include "base/vec.h"
#include "colmap_text.h"
#include "data/colmap_bin.h"
#include "data/colmap_txt.h"
#include "data/colmap_write.h"
#include "data/scene.h"

enum { CAMERAS, IMAGES, POINTS };

/* The good model: one camera, two images, two points. Offsets below refer to it. */
static void build_seed(sink seed[3])
{
    sink *c = &seed[CAMERAS], *m = &seed[IMAGES], *p = &seed[POINTS];
    memset(seed, 0, 3 * sizeof *seed);
    sink_put_uint(c, 1, 8);
    sink_put_uint(c, 7, 4);                        /* id at 8 */
    sink_put_uint(c, GBT_CAMERA_PINHOLE, 4);       /* model at 12 */
    sink_put_uint(c, 640, 8);                      /* width at 16 */
    sink_put_uint(c, 480, 8);                      /* height at 24 */
    const double params[4] = {500, 510, 321, 239}; /* at 32, 40, 48, 56 */
    for (int k = 0; k < 4; k++)
        sink_put_f64(c, params[k]);
    sink_put_uint(m, 2, 8);
    static const char *const names[2] = {"b.png", "a.png"};
    for (unsigned i = 0; i < 2; i++) {
        const double pose[7] = {0.5, 0.5, 0.5, i == 0 ? 0.5 : -0.5, 1, 2, 3 + i};
        sink_put_uint(m, 10 + i, 4); /* ids at 8 and 110 */
        for (int k = 0; k < 7; k++)
            sink_put_f64(m, pose[k]); /* quaternions at 12 and 114, translations at 44 and 146 */
        sink_put_uint(m, 7, 4);       /* camera ids at 68 and 170 */
        sink_put(m, names[i], 6);     /* names at 72 and 174 */
        sink_put_uint(m, 1 - i, 8);   /* observation counts at 78 and 180 */
        for (unsigned k = 0; k < 1 - i; k++) {
            sink_put_f64(m, 12.5);
            sink_put_f64(m, 13.5);
            sink_put_uint(m, 3, 8);
        }
    }
    sink_put_uint(p, 2, 8);
    for (unsigned i = 0; i < 2; i++) {
        sink_put_uint(p, 3 + i, 8); /* ids at 8 and 75 */
        for (unsigned k = 0; k < 3; k++)
            sink_put_f64(p, 1 + i + 0.25 * k); /* positions at 16 and 83 */
        sink_put(p, (const unsigned char[3]){255, 51, 0}, 3);
        sink_put_f64(p, 0.5);           /* errors at 43 and 110 */
        sink_put_uint(p, 2 - 2 * i, 8); /* track lengths at 51 and 118 */
        for (unsigned k = 0; k < 2 - 2 * i; k++) {
            sink_put_uint(p, 10 + k, 4); /* first track image at 59 */
            sink_put_uint(p, 0, 4);
        }
    }
    assert_int_equal(c->size, 64);
    assert_int_equal(m->size, 188);
    assert_int_equal(p->size, 126);
}

static void free_seed(sink seed[3])
{
    for (int i = 0; i < 3; i++)
        sink_free(&seed[i]);
}

static colmap_files files_of(const sink seed[3])
{
    return (colmap_files){.cameras = {"cameras.bin", seed[CAMERAS].bytes, seed[CAMERAS].size},
                          .images = {"images.bin", seed[IMAGES].bytes, seed[IMAGES].size},
                          .points = {"points3D.bin", seed[POINTS].bytes, seed[POINTS].size}};
}

static void good_model(void **state)
{
    (void)state;
    sink seed[3];
    build_seed(seed);
    const colmap_files files = files_of(seed);
    raw_scene raw = {0};
    assert_ok(colmap_bin_read(&files, &raw, &assert_ok_err_));
    assert_true(raw_is_sound(&raw));
    assert_int_equal(raw.view_count, 2);
    assert_string_equal(raw.views[0].name, "b.png");
    const gbt_camera *camera = &raw.views[0].camera;
    assert_int_equal(camera->model, GBT_CAMERA_PINHOLE);
    assert_int_equal(camera->width, 640);
    assert_int_equal(camera->height, 480);
    assert_true(camera->params[0] == 500 && camera->params[1] == 510 && camera->params[2] == 321 &&
                camera->params[3] == 239);
    /* The quaternion (1, 1, 1, 1) / 2 takes x to y, y to z, z to x, so R^T (1, 2, 3) = (2, 3, 1). */
    const double rotation[9] = {0, 0, 1, 1, 0, 0, 0, 1, 0}, center[3] = {-2, -3, -1};
    for (int k = 0; k < 9; k++)
        assert_true(fabs(camera->rotation[k] - rotation[k]) < 1e-15);
    for (int k = 0; k < 3; k++)
        assert_true(fabs(camera->center[k] - center[k]) < 1e-15);
    assert_int_equal(raw.point_count, 2);
    assert_true(raw.position[3] == 2 && raw.position[4] == 2.25 && raw.position[5] == 2.5);
    assert_true(raw.has_color && raw.color[0] == 1.0f && raw.color[1] == 0.2f && raw.color[2] == 0.0f);
    assert_int_equal(raw.points_dropped + raw.tracks_missing + raw.trailing_bytes, 0);
    /* The track of the first point, (1, 1.25, 1.5), names both images; the third row of that rotation is (0,
       1, 0), the translation 3. */
    for (int i = 0; i < 2; i++)
        assert_true(raw.views[i].seen_count == 1 && raw.views[i].seen[0] == 0);
    double nearest;
    assert_int_equal(raw_nearest_depth(&raw, &raw.views[0], &nearest, NULL), GBT_OK);
    assert_true(fabs(nearest - 4.25) < 1e-6);
    raw_free(&raw);
    free_seed(seed);
}

/* One point in a hundred may be wrong, and what is behind the camera or not a number is not in the photo. */
static void nearest_in_a_photo(void **state)
{
    (void)state;
    enum { IN_FRONT = 201, ELSEWHERE = 5 };
    static const double out_of_view[ELSEWHERE] = {1, -5, NAN, INFINITY, 1e13};
    static const float grey[3] = {0.5f, 0.5f, 0.5f};
    raw_scene raw = {0};
    raw_view *view = raw_next_view(&raw, NULL);
    view->camera = (gbt_camera){.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .center = {0, 0, 1}};
    raw.view_count = 1;
    double nearest;
    assert_int_equal(raw_nearest_depth(&raw, view, &nearest, NULL), GBT_OK);
    assert_true(nearest == 0);
    assert_int_equal(raw_reserve_points(&raw, IN_FRONT + ELSEWHERE, NULL), GBT_OK);
    for (int i = 0; i < IN_FRONT + ELSEWHERE; i++) {
        const bool far = i >= IN_FRONT;
        const double position[3] = {far ? 0 : 7, far ? 0 : -7,
                                    far ? out_of_view[i - IN_FRONT] : IN_FRONT + 1 - i};
        assert_int_equal(raw_add_sighting_of_next(&raw, 0, position, NULL), GBT_OK);
        raw_add_point(&raw, position, grey);
    }
    assert_int_equal(raw.points_dropped, 3);
    assert_int_equal(view->seen_count, IN_FRONT + ELSEWHERE - 3);
    for (size_t i = 0; i < view->seen_count; i++)
        assert_int_equal(view->seen[i], i);
    assert_int_equal(raw_nearest_depth(&raw, view, &nearest, NULL), GBT_OK);
    assert_true(nearest == 3);
    raw_free(&raw);
}

/* A panorama has points on all sides, and its rays start in all directions: distances count, not depths. */
static void nearest_around_a_panorama(void **state)
{
    (void)state;
    enum { AROUND = 100 };
    static const float grey[3] = {0.5f, 0.5f, 0.5f};
    raw_scene raw = {0};
    raw_view *view = raw_next_view(&raw, NULL);
    view->camera = (gbt_camera){.model = GBT_CAMERA_EQUIRECTANGULAR,
                                .width = 64,
                                .height = 32,
                                .params = {64, 32},
                                .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                                .center = {0, 0, 1}};
    raw.view_count = 1;
    assert_int_equal(raw_reserve_points(&raw, AROUND, NULL), GBT_OK);
    for (int i = 0; i < AROUND; i++) {
        const double z = (2 * i + 1.0) / AROUND - 1, side = 2 * sqrt(1 - z * z);
        const double position[3] = {side * cos(i), side * sin(i), 1 + 2 * z};
        assert_int_equal(raw_add_sighting_of_next(&raw, 0, position, NULL), GBT_OK);
        raw_add_point(&raw, position, grey);
    }
    double nearest;
    assert_int_equal(raw_nearest_depth(&raw, view, &nearest, NULL), GBT_OK);
    assert_true(fabs(nearest - 2) < 1e-6);
    raw_free(&raw);
}

/* The cursor itself, at its exact ends: one byte past them reads as 0 and is noticed, and nothing moves. */
static void cursor_ends(void **state)
{
    (void)state;
    unsigned char *bytes = exact_copy("\x01\x02\x03\x04\x05\x06\x07", 7);
    const source_file file = {"x", bytes, 7};
    cursor c = {.file = &file};
    assert_true(cursor_u32(&c) == 0x04030201 && c.at == 4 && !c.short_read);
    assert_true(cursor_count_fits(&c, 3, 1) && !cursor_count_fits(&c, 4, 1) && cursor_count_fits(&c, 1, 3) &&
                !cursor_count_fits(&c, 1, 4));
    assert_int_equal(cursor_need(&c, 3, "it", NULL), GBT_OK);
    assert_int_equal(cursor_need(&c, 4, "it", NULL), GBT_ERR_FORMAT);
    assert_true(cursor_u32(&c) == 0 && c.at == 4 && c.short_read);
    c.short_read = false;
    assert_true(!cursor_skip(&c, UINT64_MAX) && !cursor_skip(&c, 4) && c.at == 4);
    assert_true(cursor_skip(&c, 3) && cursor_left(&c) == 0 && cursor_uint(&c, 1) == 0);
    free(bytes);
}

typedef enum edit_kind { SET_UINT, SET_DOUBLE, CUT, APPEND, PUT_TEXT } edit_kind;

typedef struct bin_case {
    const char *name;
    int file;
    edit_kind kind;
    size_t at;    /* offset; new size for CUT; bytes for APPEND */
    size_t width; /* of SET_UINT */
    uint64_t value;
    double number;
    const char *text; /* PUT_TEXT: its bytes with the final zero */
    gbt_status status;
    const char *says; /* substring of the message */
    size_t dropped, tracks_missing, trailing;
} bin_case;

#define BAD GBT_ERR_FORMAT
#define INF (double)INFINITY
#define NOT_A_NUMBER (double)NAN

static bin_case bin_cases[] = {
    {"1 empty cameras", CAMERAS, CUT, 0, .status = BAD, .says = "cameras.bin@0: file is empty"},
    {"1 empty images", IMAGES, CUT, 0, .status = BAD, .says = "images.bin@0: file is empty"},
    {"1 empty points", POINTS, CUT, 0, .status = BAD, .says = "points3D.bin@0: file is empty"},
    {"2 shorter than the count", IMAGES, CUT, 7, .status = BAD, .says = "file ends inside the count"},
    {"3 count 2^63 cameras", CAMERAS, SET_UINT, 0, 8, UINT64_C(1) << 63, .status = BAD,
     .says = "9223372036854775808 cameras cannot be"},
    {"3 count 2^63 images", IMAGES, SET_UINT, 0, 8, UINT64_C(1) << 63, .status = BAD,
     .says = "9223372036854775808 images cannot be"},
    {"3 count 2^63 points", POINTS, SET_UINT, 0, 8, UINT64_C(1) << 63, .status = BAD,
     .says = "9223372036854775808 points cannot be"},
    {"3 count 2^64 - 1", POINTS, SET_UINT, 0, 8, UINT64_MAX, .status = BAD,
     .says = "cannot be in the 118 bytes"},
    {"3 one camera too many", CAMERAS, SET_UINT, 0, 8, 2, .status = BAD,
     .says = "2 cameras cannot be in the 56 bytes"},
    {"3 one image too many", IMAGES, SET_UINT, 0, 8, 3, .status = BAD,
     .says = "3 images cannot be in the 180 bytes"},
    {"3 one point too many", POINTS, SET_UINT, 0, 8, 3, .status = BAD,
     .says = "3 points cannot be in the 118 bytes"},
    {"4 cameras cut in the parameters", CAMERAS, CUT, 63, .status = BAD,
     .says = "cameras.bin@32: file ends inside the camera's parameters"},
    {"4 images cut in a pose", IMAGES, CUT, 160, .status = BAD,
     .says = "images.bin@110: file ends inside an image"},
    {"4 images cut in the observation count", IMAGES, CUT, 184, .status = BAD,
     .says = "file ends inside the count of observations"},
    {"4 points cut", POINTS, CUT, 125, .status = BAD, .says = "points3D.bin@75: file ends inside a point"},
    {"5 extra bytes", IMAGES, APPEND, 5, .status = GBT_OK, .trailing = 5},
    {"5 extra bytes of cameras", CAMERAS, APPEND, 6, .status = GBT_OK, .trailing = 6},
    {"5 extra bytes of points", POINTS, APPEND, 7, .status = GBT_OK, .trailing = 7},
    {"6 model 99", CAMERAS, SET_UINT, 12, 4, 99, .status = BAD,
     .says = "cameras.bin@8: unknown camera model id 99"},
    {"6 model -1", CAMERAS, SET_UINT, 12, 4, UINT32_MAX, .status = BAD, .says = "unknown camera model id -1"},
    {"6 model 18", CAMERAS, SET_UINT, 12, 4, 18, .status = BAD, .says = "unknown camera model id 18"},
    {"6 model 100 is ours alone", CAMERAS, SET_UINT, 12, 4, 100, .status = BAD,
     .says = "unknown camera model id 100"},
    {"7 model with distortion, too short", CAMERAS, SET_UINT, 12, 4, 4, .status = BAD,
     .says = "wanted 64 more bytes, got 32"},
    {"8 width 0", CAMERAS, SET_UINT, 16, 8, 0, .status = BAD, .says = "wanted 1..65500, got 0 x 480"},
    {"8 height 65501", CAMERAS, SET_UINT, 24, 8, 65501, .status = BAD, .says = "got 640 x 65501"},
    {"8 height 65500", CAMERAS, SET_UINT, 24, 8, 65500, .status = GBT_OK},
    {"8 width 2^32 + 640", CAMERAS, SET_UINT, 16, 8, (UINT64_C(1) << 32) + 640, .status = BAD,
     .says = "out of range"},
    {"9 fx 0", CAMERAS, SET_DOUBLE, 32, .number = 0, .status = BAD,
     .says = "focal length of camera model PINHOLE is not positive"},
    {"9 fx negative", CAMERAS, SET_DOUBLE, 32, .number = -500, .status = BAD,
     .says = "not positive (got -500)"},
    {"9 fx NaN", CAMERAS, SET_DOUBLE, 32, .number = NOT_A_NUMBER, .status = BAD,
     .says = "parameter 0 of camera model PINHOLE"},
    {"9 fx infinite", CAMERAS, SET_DOUBLE, 32, .number = INF, .status = BAD,
     .says = "parameter 0 of camera model PINHOLE"},
    {"9 fy 0", CAMERAS, SET_DOUBLE, 40, .number = 0, .status = BAD, .says = "not positive"},
    {"10 cx NaN", CAMERAS, SET_DOUBLE, 48, .number = NOT_A_NUMBER, .status = BAD,
     .says = "parameter 2 of camera model PINHOLE"},
    {"10 cy infinite", CAMERAS, SET_DOUBLE, 56, .number = -INF, .status = BAD,
     .says = "parameter 3 of camera model PINHOLE"},
    {"12 missing camera", IMAGES, SET_UINT, 170, 4, 8, .status = BAD,
     .says = "images.bin@110: image refers to camera 8"},
    {"13 duplicate image id", IMAGES, SET_UINT, 110, 4, 10, .status = BAD,
     .says = "images.bin: duplicate image id 10"},
    {"14 name without end", IMAGES, CUT, 179, .status = BAD,
     .says = "images.bin@174: image name does not end"},
    {"15 name empty", IMAGES, SET_UINT, 174, 1, 0, .status = BAD, .says = "image name is empty"},
    {"15 name absolute", IMAGES, PUT_TEXT, 174, .text = "/.png", .status = BAD,
     .says = "image name is absolute"},
    {"15 name with ..", IMAGES, PUT_TEXT, 174, .text = "../ab", .status = BAD, .says = "leaves the data set"},
    {"15 name ends in ..", IMAGES, PUT_TEXT, 174, .text = "ab/..", .status = BAD,
     .says = "leaves the data set"},
    {"15 name with dots inside", IMAGES, PUT_TEXT, 174, .text = "a..b.", .status = GBT_OK},
    {"15 name with a newline", IMAGES, PUT_TEXT, 174, .text = "a\n.pn", .status = BAD,
     .says = "control character"},
    {"15 name with DEL", IMAGES, PUT_TEXT, 174, .text = "a\x7f.pn", .status = BAD,
     .says = "control character"},
    {"15 name with a space", IMAGES, PUT_TEXT, 174, .text = "a b.p", .status = GBT_OK},
    {"17 quaternion with NaN", IMAGES, SET_DOUBLE, 114, .number = NOT_A_NUMBER, .status = BAD,
     .says = "quaternion is not of unit length"},
    {"17 quaternion too long", IMAGES, SET_DOUBLE, 114, .number = 0.503, .status = BAD,
     .says = "quaternion is not of unit length"},
    {"17 quaternion nearly unit", IMAGES, SET_DOUBLE, 114, .number = 0.501, .status = GBT_OK},
    {"17 quaternion infinite", IMAGES, SET_DOUBLE, 114, .number = INF, .status = BAD,
     .says = "quaternion is not of unit length"},
    {"18 translation NaN", IMAGES, SET_DOUBLE, 146, .number = NOT_A_NUMBER, .status = BAD,
     .says = "translation is not usable"},
    {"18 translation 1e30", IMAGES, SET_DOUBLE, 146, .number = 1e30, .status = BAD, .says = "got 1e+30"},
    {"18 translation 1e12", IMAGES, SET_DOUBLE, 146, .number = 1e12, .status = GBT_OK},
    {"19 observation count 2^61", IMAGES, SET_UINT, 180, 8, UINT64_C(1) << 61, .status = BAD,
     .says = "images.bin@180: 2305843009213693952 obs"},
    {"19 observation count wraps", IMAGES, SET_UINT, 180, 8, UINT64_C(0x0AAAAAAAAAAAAAAB), .status = BAD,
     .says = "observations cannot be"},
    {"20 track length 2^61", POINTS, SET_UINT, 118, 8, UINT64_C(1) << 61, .status = BAD,
     .says = "points3D.bin@118: a track of 2305843009"},
    {"20 track length 1 too many", POINTS, SET_UINT, 118, 8, 1, .status = BAD,
     .says = "a track of 1 entries cannot be"},
    {"21 point NaN", POINTS, SET_DOUBLE, 16, .number = NOT_A_NUMBER, .status = GBT_OK, .dropped = 1},
    {"21 point infinite", POINTS, SET_DOUBLE, 99, .number = -INF, .status = GBT_OK, .dropped = 1},
    {"21 point far beyond use", POINTS, SET_DOUBLE, 91, .number = 1e13, .status = GBT_OK, .dropped = 1},
    {"22 error negative", POINTS, SET_DOUBLE, 43, .number = -1, .status = GBT_OK},
    {"22 error NaN", POINTS, SET_DOUBLE, 43, .number = NOT_A_NUMBER, .status = GBT_OK},
    {"23 track names a missing image", POINTS, SET_UINT, 59, 4, 99, .status = GBT_OK, .tracks_missing = 1},
    {"24 big-endian count", CAMERAS, SET_UINT, 0, 8, UINT64_C(1) << 56, .status = BAD, .says = "big-endian"},
    {"25 text in place of binary", CAMERAS, PUT_TEXT, 0, .text = "# Camera list with one line", .status = BAD,
     .says = "looks like text"},
    {"28 no images", IMAGES, SET_UINT, 0, 8, 0, .status = GBT_OK, .trailing = 180, .tracks_missing = 2},
};

static void apply_edit(const bin_case *c, sink *target)
{
    switch (c->kind) {
    case SET_UINT:
        memcpy(target->bytes + c->at, &c->value, c->width);
        break;
    case SET_DOUBLE:
        memcpy(target->bytes + c->at, &c->number, 8);
        break;
    case CUT:
        target->size = c->at;
        break;
    case APPEND:
        sink_put(target, "extra bytes", c->at);
        break;
    case PUT_TEXT:
        memcpy(target->bytes + c->at, c->text, strlen(c->text) + (c->at > 0));
        break;
    }
}

static void malformed_binary(void **state)
{
    const bin_case *c = *state;
    sink seed[3];
    build_seed(seed);
    apply_edit(c, &seed[c->file]);
    unsigned char *copies[3];
    for (int i = 0; i < 3; i++)
        copies[i] = exact_copy(seed[i].bytes, seed[i].size);
    colmap_files files = files_of(seed);
    files.cameras.bytes = copies[CAMERAS];
    files.images.bytes = copies[IMAGES];
    files.points.bytes = copies[POINTS];
    raw_scene raw = {0};
    gbt_error err = {0};
    const gbt_status status = colmap_bin_read(&files, &raw, &err);
    check_message(status, &err);
    if (status != c->status || (c->says != NULL && strstr(err.text, c->says) == NULL))
        fail_msg("status %d, message: %s", (int)status, err.text);
    if (status == GBT_OK) {
        assert_true(raw_is_sound(&raw));
        assert_int_equal(raw.points_dropped, c->dropped);
        assert_int_equal(raw.point_count, 2 - c->dropped);
        assert_int_equal(raw.tracks_missing, c->tracks_missing);
        assert_int_equal(raw.trailing_bytes, c->trailing);
    }
    raw_free(&raw);
    for (int i = 0; i < 3; i++)
        free(copies[i]);
    free_seed(seed);
}

static void duplicate_cameras(void **state)
{
    (void)state;
    sink seed[3];
    build_seed(seed);
    sink twice = {0};
    sink_put_uint(&twice, 2, 8);
    sink_put(&twice, seed[CAMERAS].bytes + 8, 56);
    sink_put(&twice, seed[CAMERAS].bytes + 8, 56);
    colmap_files files = files_of(seed);
    files.cameras.bytes = twice.bytes;
    files.cameras.size = twice.size;
    raw_scene raw = {0};
    gbt_error err = {0};
    assert_int_equal(colmap_bin_read(&files, &raw, &err), GBT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "duplicate camera id 7"));
    raw_free(&raw);
    sink_free(&twice);
    free_seed(seed);
}

static void name_length_limit(void **state)
{
    (void)state;
    for (size_t length = 4096; length <= 4097; length++) {
        sink seed[3];
        build_seed(seed);
        sink longer = {0};
        sink_put_uint(&longer, 1, 8);
        sink_put(&longer, seed[IMAGES].bytes + 8, 64);
        for (size_t i = 0; i < length; i++)
            sink_put(&longer, "n", 1);
        sink_put_uint(&longer, 0, 1);
        sink_put_uint(&longer, 0, 8);
        colmap_files files = files_of(seed);
        files.images.bytes = longer.bytes;
        files.images.size = longer.size;
        raw_scene raw = {0};
        gbt_error err = {0};
        const gbt_status status = colmap_bin_read(&files, &raw, &err);
        assert_int_equal(status, length == 4096 ? GBT_OK : GBT_ERR_FORMAT);
        assert_true(status == GBT_OK ||
                    strstr(err.text, "too long (wanted at most 4096 bytes, got 4097)") != NULL);
        raw_free(&raw);
        sink_free(&longer);
        free_seed(seed);
    }
}

/* Usable by every model. */
static double param_value(int k) { return 0.25 + (k < 4 ? k : 0.01 * k); }

/* Every model of the table, with its own number of parameters; those of some have a range. */
static void all_models(void **state)
{
    (void)state;
    for (int id = 0; id < GBT_CAMERA_MODEL_COUNT; id++) {
        sink seed[3], camera = {0};
        build_seed(seed);
        sink_put(&camera, seed[CAMERAS].bytes, 32);
        memcpy(camera.bytes + 12, &id, 4);
        const int count = gbt_camera_param_count((gbt_camera_model)id);
        for (int k = 0; k < count; k++)
            sink_put_f64(&camera, param_value(k));
        colmap_files files = files_of(seed);
        files.cameras.bytes = camera.bytes;
        files.cameras.size = camera.size;
        raw_scene raw = {0};
        assert_ok(colmap_bin_read(&files, &raw, &assert_ok_err_));
        assert_int_equal(raw.views[1].camera.model, id);
        for (int k = 0; k < count; k++)
            assert_true(raw.views[1].camera.params[k] == param_value(k));
        assert_int_equal(raw.trailing_bytes, 0);
        raw_free(&raw);
        if (id == GBT_CAMERA_FOV || id == GBT_CAMERA_EUCM) {
            gbt_error err = {0};
            const double beyond = 4;
            memcpy(camera.bytes + 32 + 4 * 8, &beyond, 8);
            assert_int_equal(colmap_bin_read(&files, &raw, &err), GBT_ERR_FORMAT);
            assert_non_null(strstr(err.text, "cameras.bin@8: no lens of camera model"));
            raw_free(&raw);
        }
        sink_free(&camera);
        free_seed(seed);
    }
}

static void no_truncation_passes(void **state)
{
    (void)state;
    sink seed[3];
    build_seed(seed);
    for (int file = 0; file < 3; file++) {
        const size_t whole = seed[file].size;
        for (size_t size = 0; size < whole; size++) {
            raw_scene raw = {0};
            seed[file].size = size;
            const colmap_files files = files_of(seed);
            assert_int_equal(colmap_bin_read(&files, &raw, NULL), GBT_ERR_FORMAT);
            raw_free(&raw);
        }
        seed[file].size = whole;
    }
    free_seed(seed);
}

static const char good_cameras[] = "# comment\n7 PINHOLE 640 480 500 510 321 239\n";
static const char good_images[] =
    "# comment\n10 0.5 0.5 0.5 0.5 1 2 3 7 b.png\n12.5 13.5 3\n11 0.5 0.5 0.5 -0.5 1 2 4 7 a.png\n\n";
static const char good_points[] =
    "# comment\n3 1 1.25 1.5 255 51 0 0.5 10 0 11 0\n4 2 2.25 2.5 255 51 0 0.5\n";

typedef struct txt_case {
    const char *name;
    const char *cameras, *images, *points; /* NULL: the good one */
    gbt_status status;
    const char *says;
    size_t views, points_kept, dropped;
} txt_case;

static txt_case txt_cases[] = {
    {"good", NULL, NULL, NULL, GBT_OK, NULL, 2, 2, 0},
    {"30 decimal comma in a camera", "7 PINHOLE 640 480 500,5 510 321 239\n", NULL, NULL, BAD,
     "cameras.txt:1: a camera parameter is not a number: 500,5", 0, 0, 0},
    {"30 decimal comma in a pose", NULL, "10 0,5 0.5 0.5 0.5 1 2 3 7 b.png\n\n", NULL, BAD,
     "images.txt:1: the quaternion is not a number: 0,5", 0, 0, 0},
    {"32 nan in a point", NULL, NULL, "3 nan 1 1 255 51 0 0.5\n4 2 2 2 1 2 3 0\n", GBT_OK, NULL, 2, 1, 1},
    {"32 -nan(ind) in a point", NULL, NULL, "3 -nan(ind) 1 1 255 51 0 0.5\n", GBT_OK, NULL, 2, 0, 1},
    {"32 inf in a point", NULL, NULL, "3 1 1 inf 255 51 0 0.5\n", GBT_OK, NULL, 2, 0, 1},
    {"32 nan focal length", "7 PINHOLE 640 480 nan 510 321 239\n", NULL, NULL, BAD,
     "cameras.txt:1: parameter 0", 0, 0, 0},
    {"32 nan pose", NULL, "10 nan 0.5 0.5 0.5 1 2 3 7 b.png\n\n", NULL, BAD, "images.txt:1: quaternion", 0, 0,
     0},
    {"33 CRLF", "7 PINHOLE 640 480 500 510 321 239\r\n",
     "10 0.5 0.5 0.5 0.5 1 2 3 7 b.png\r\n\r\n11 0.5 0.5 0.5 -0.5 1 2 4 7 a.png\r\n\r\n",
     "3 1 1.25 1.5 255 51 0 0.5 10 0 11 0\r\n", GBT_OK, NULL, 2, 1, 0},
    {"33 byte order mark",
     "\xEF\xBB\xBF"
     "7 PINHOLE 640 480 500 510 321 239\n",
     NULL, NULL, GBT_OK, NULL, 2, 2, 0},
    {"34 blank observation line", NULL,
     "10 0.5 0.5 0.5 0.5 1 2 3 7 b.png\n\n11 0.5 0.5 0.5 -0.5 1 2 4 7 a.png\n", NULL, GBT_OK, NULL, 2, 2, 0},
    {"34 blank lines between images", NULL,
     "10 0.5 0.5 0.5 0.5 1 2 3 7 b.png\n\n\n# x\n11 0.5 0.5 0.5 -0.5 1 2 4 7 a.png\n\n", NULL, GBT_OK, NULL,
     2, 2, 0},
    {"35 name with spaces", NULL, "10 0.5 0.5 0.5 0.5 1 2 3 7 my photo 1.png \n\n", NULL, GBT_OK, NULL, 1, 2,
     0},
    {"36 observations not in threes", NULL, "10 0.5 0.5 0.5 0.5 1 2 3 7 b.png\n1 2 -1 4\n", NULL, BAD,
     "images.txt:2: observations are not triples", 0, 0, 0},
    {"36 observation not a number", NULL, "10 0.5 0.5 0.5 0.5 1 2 3 7 b.png\n1 2 x\n", NULL, BAD,
     "images.txt:2: an observation is not a number: x", 0, 0, 0},
    {"36 observation line forgotten", NULL,
     "10 0.5 0.5 0.5 0.5 1 2 3 7 b.png\n11 0.5 0.5 0.5 -0.5 1 2 4 7 a.png\n", NULL, BAD,
     "images.txt:2: an observation is not a number: a.png", 0, 0, 0},
    {"38 camera lacks a column", "7 PINHOLE 640 480 500 510 321\n", NULL, NULL, BAD,
     "cameras.txt:1: line ends before a camera parameter", 0, 0, 0},
    {"38 camera has a column too many", "7 PINHOLE 640 480 500 510 321 239 0\n", NULL, NULL, BAD,
     "cameras.txt:1: camera has too many fields, from 0", 0, 0, 0},
    {"38 image lacks a name", NULL, "10 0.5 0.5 0.5 0.5 1 2 3 7\n\n", NULL, BAD,
     "images.txt:1: line ends before the image name", 0, 0, 0},
    {"38 point lacks a column", NULL, NULL, "3 1 1 1 255 51 0\n", BAD,
     "points3D.txt:1: line ends before the error", 0, 0, 0},
    {"38 track with half a pair", NULL, NULL, "3 1 1 1 255 51 0 0.5 10\n", BAD,
     "line ends before a track's observation", 0, 0, 0},
    {"39 overflow", NULL, NULL, "# x\n3 1e999 1 1 255 51 0 0.5\n", BAD,
     "points3D.txt:2: the position is out of range: 1e999", 0, 0, 0},
    {"39 integer overflow", NULL, "4294967296 0.5 0.5 0.5 0.5 1 2 3 7 b.png\n\n", NULL, BAD,
     "the image id is out of range: 4294967296", 0, 0, 0},
    {"39 colour 256", NULL, NULL, "3 1 1 1 256 51 0 0.5\n", BAD, "the colour is out of range: 256", 0, 0, 0},
    {"39 negative id", "-7 PINHOLE 640 480 500 510 321 239\n", NULL, NULL, BAD,
     "the camera id is not a number: -7", 0, 0, 0},
    {"39 width 2^31", "7 PINHOLE 2147483648 480 500 510 321 239\n", NULL, NULL, BAD,
     "the image width is out of range", 0, 0, 0},
    {"39 width 65501", "7 PINHOLE 65501 480 500 510 321 239\n", NULL, NULL, BAD,
     "image width is out of range (wanted 1..65500, got 65501)", 0, 0, 0},
    {"40 only comments", "# nothing\n", "# nothing\n", "# nothing\n", GBT_OK, NULL, 0, 0, 0},
    {"40 cameras only comments", "# nothing\n", NULL, NULL, BAD, "images.txt:2: image refers to camera 7", 0,
     0, 0},
    {"41 no final newline", "7 PINHOLE 640 480 500 510 321 239", "10 0.5 0.5 0.5 0.5 1 2 3 7 b.png",
     "3 1 1 1 255 51 0 0.5", GBT_OK, NULL, 1, 1, 0},
    {"6 unknown model", "7 MAGIC 640 480 500\n", NULL, NULL, BAD,
     "cameras.txt:1: unknown camera model: MAGIC", 0, 0, 0},
    {"6 model name cut", "7 PINHOL 640 480 500 510 321 239\n", NULL, NULL, BAD,
     "unknown camera model: PINHOL", 0, 0, 0},
    {"6 model is ours alone", "7 ORTHOGRAPHIC 640 480 1 1 0 0\n", NULL, NULL, BAD,
     "unknown camera model: ORTHOGRAPHIC", 0, 0, 0},
    {"11 duplicate camera", "7 PINHOLE 640 480 500 510 321 239\n7 PINHOLE 640 480 500 510 321 239\n", NULL,
     NULL, BAD, "duplicate camera id 7", 0, 0, 0},
    {"15 name leaves", NULL, "10 0.5 0.5 0.5 0.5 1 2 3 7 a/../../b.png\n\n", NULL, BAD,
     "images.txt:1: image name leaves", 0, 0, 0},
};

static void malformed_text(void **state)
{
    const txt_case *c = *state;
    const char *texts[3] = {c->cameras != NULL ? c->cameras : good_cameras,
                            c->images != NULL ? c->images : good_images,
                            c->points != NULL ? c->points : good_points};
    unsigned char *copies[3];
    for (int i = 0; i < 3; i++)
        copies[i] = exact_copy(texts[i], strlen(texts[i]));
    const colmap_files files = {.cameras = {"cameras.txt", copies[0], strlen(texts[0])},
                                .images = {"images.txt", copies[1], strlen(texts[1])},
                                .points = {"points3D.txt", copies[2], strlen(texts[2])}};
    raw_scene raw = {0};
    gbt_error err = {0};
    const gbt_status status = colmap_txt_read(&files, &raw, &err);
    check_message(status, &err);
    if (status != c->status || (c->says != NULL && strstr(err.text, c->says) == NULL))
        fail_msg("status %d, message: %s", (int)status, err.text);
    if (status == GBT_OK) {
        assert_true(raw_is_sound(&raw));
        assert_int_equal(raw.view_count, c->views);
        assert_int_equal(raw.point_count, c->points_kept);
        assert_int_equal(raw.points_dropped, c->dropped);
        if (strstr(c->name, "spaces") != NULL)
            assert_string_equal(raw.views[0].name, "my photo 1.png");
    }
    raw_free(&raw);
    for (int i = 0; i < 3; i++)
        free(copies[i]);
}

/* 37: a line of 10 MB is no different from any other line. */
static void very_long_line(void **state)
{
    (void)state;
    sink images = {0};
    sink_put_text(&images, "10 0.5 0.5 0.5 0.5 1 2 3 7 b.png\n");
    while (images.size < 10000000)
        sink_put_text(&images, "123.5 456.25 -1 ");
    sink_put_text(&images, "\n");
    colmap_files files = {
        .cameras = {"cameras.txt", (const unsigned char *)good_cameras, strlen(good_cameras)},
        .images = {"images.txt", images.bytes, images.size},
        .points = {"points3D.txt", (const unsigned char *)good_points, strlen(good_points)}};
    raw_scene raw = {0};
    assert_ok(colmap_txt_read(&files, &raw, &assert_ok_err_));
    assert_int_equal(raw.view_count, 1);
    raw_free(&raw);
    sink_free(&images);
}

enum { TRIP_IMAGES = 9, TRIP_POINTS = 40 };

typedef struct trip {
    colmap_image images[TRIP_IMAGES];
    char names[TRIP_IMAGES][32];
    colmap_observation observations[TRIP_IMAGES][TRIP_POINTS];
    colmap_point points[TRIP_POINTS];
    uint32_t tracks[TRIP_POINTS][TRIP_IMAGES][2];
} trip;

static double random_in(uint64_t stream, uint64_t index, double low, double high)
{
    uint32_t words[4];
    rng_philox(99, stream, index, words);
    return low + (high - low) * ((double)words[0] + 0.5) * 0x1p-32;
}

static void build_trip(trip *t)
{
    memset(t, 0, sizeof *t);
    for (unsigned i = 0; i < TRIP_IMAGES; i++) {
        colmap_image *im = &t->images[i];
        snprintf(t->names[i], sizeof t->names[i], "part %u/photo %u.png", i % 2, TRIP_IMAGES - i);
        im->name = t->names[i];
        im->camera = (gbt_camera){
            .model = i % 3 == 0 ? GBT_CAMERA_OPENCV : GBT_CAMERA_SIMPLE_RADIAL, .width = 64, .height = 48};
        const int count = gbt_camera_param_count(im->camera.model);
        for (int k = 0; k < count; k++)
            im->camera.params[k] = 50.1 + k / 3.0;
        /* Quaternions with every one of the four as the largest, and exact half turns. */
        double q[4], norm = 0;
        for (unsigned k = 0; k < 4; k++) {
            q[k] = i < 4 ? k == i : random_in(i, k, -1, 1) + (k == i % 4 ? 2 : 0);
            norm += q[k] * q[k];
        }
        for (int k = 0; k < 4; k++)
            q[k] /= sqrt(norm);
        dquat_to_matrix(q, im->camera.rotation);
        for (unsigned k = 0; k < 3; k++)
            im->camera.center[k] = random_in(100 + i, k, -10, 10) + 1e5;
        im->observations = t->observations[i];
        im->observation_count = i == 4 ? 0 : TRIP_POINTS;
        for (unsigned k = 0; k < TRIP_POINTS; k++)
            t->observations[i][k] = (colmap_observation){
                random_in(200 + i, k, 0, 64), random_in(300 + i, k, 0, 48), k % 5 == 0 ? COLMAP_NO_POINT : k};
    }
    for (unsigned i = 0; i < TRIP_POINTS; i++) {
        colmap_point *p = &t->points[i];
        for (unsigned k = 0; k < 3; k++) {
            p->position[k] = random_in(400 + i, k, -3, 3) + 1e5;
            p->color[k] = (unsigned char)(i * 7 + k);
        }
        p->error = i == 0 ? -1 : random_in(500, i, 0, 2);
        p->track = &t->tracks[i][0][0];
        p->track_count = i % 4;
        for (unsigned k = 0; k < p->track_count; k++) {
            t->tracks[i][k][0] = k;
            t->tracks[i][k][1] = i;
        }
    }
}

static const gbt_camera *find_camera(const trip *t, const char *name)
{
    for (size_t i = 0; i < TRIP_IMAGES; i++)
        if (strcmp(t->names[i], name) == 0)
            return &t->images[i].camera;
    return NULL;
}

/* Names sort differently from ids, so order is tested too. Poses agree to 1e-15, all else to the bit. */
static void check_trip(const trip *t, const scene *s)
{
    assert_int_equal(s->view_count, TRIP_IMAGES);
    assert_int_equal(s->points.count, TRIP_POINTS);
    for (size_t i = 0; i < s->view_count; i++) {
        const gbt_camera *got = &s->views[i].camera;
        assert_true(i == 0 || strcmp(s->views[i - 1].name, s->views[i].name) < 0);
        const gbt_camera *want = find_camera(t, s->views[i].name);
        assert_non_null(want);
        assert_int_equal(got->model, want->model);
        assert_int_equal(got->width, want->width);
        assert_memory_equal(got->params, want->params, sizeof got->params);
        for (int k = 0; k < 9; k++)
            assert_true(fabs(got->rotation[k] - want->rotation[k]) < 1e-15);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(got->center[k] + s->origin[k] - want->center[k]) < 1e-9); /* of 1e5, and two
                                                                                          rotations */
    }
    for (size_t i = 0; i < TRIP_POINTS; i++)
        for (size_t k = 0; k < 3; k++) {
            assert_true(s->points.position[3 * i + k] == (float)(t->points[i].position[k] - s->origin[k]));
            assert_true(s->points.color[3 * i + k] == (float)t->points[i].color[k] / 255);
        }
}

static void write_trip_photos(const trip *t)
{
    for (size_t i = 0; i < TRIP_IMAGES; i++) {
        write_text(in_folder("images/%s", t->names[i]), "not read here");
    }
}

static void round_trip(void **state)
{
    (void)state;
    trip *t = malloc(sizeof *t);
    scene binary, text;
    build_trip(t);
    write_trip_photos(t);
    assert_ok(
        colmap_write(in_folder("sparse/0"), t->images, TRIP_IMAGES, t->points, TRIP_POINTS, &assert_ok_err_));
    assert_ok(scene_load(test_folder, NULL, &binary, &assert_ok_err_));
    assert_string_equal(binary.source, "colmap-bin");
    check_trip(t, &binary);
    /* The text twin says exactly the same. */
    colmap_to_text(in_folder("sparse/0"));
    assert_ok(scene_load(test_folder, NULL, &text, &assert_ok_err_));
    assert_string_equal(text.source, "colmap-txt");
    check_trip(t, &text);
    assert_memory_equal(binary.origin, text.origin, sizeof text.origin);
    assert_memory_equal(binary.points.position, text.points.position, 3 * TRIP_POINTS * sizeof(float));
    assert_memory_equal(binary.points.color, text.points.color, 3 * TRIP_POINTS * sizeof(float));
    for (size_t i = 0; i < TRIP_IMAGES; i++) {
        assert_string_equal(binary.views[i].name, text.views[i].name);
        assert_memory_equal(binary.views[i].camera.rotation, text.views[i].camera.rotation,
                            9 * sizeof(double));
        assert_memory_equal(binary.views[i].camera.center, text.views[i].camera.center, 3 * sizeof(double));
        assert_memory_equal(binary.views[i].camera.params, text.views[i].camera.params,
                            sizeof text.views[i].camera.params);
    }
    scene_free(&binary);
    scene_free(&text);
    free(t);
}

/* Identical intrinsics share a camera: 2 kinds among 9 images. */
static void writer_shares_cameras(void **state)
{
    (void)state;
    trip *t = malloc(sizeof *t);
    build_trip(t);
    assert_ok(colmap_write(test_folder, t->images, TRIP_IMAGES, t->points, TRIP_POINTS, &assert_ok_err_));
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(in_folder("cameras.bin"), &bytes, &size, &assert_ok_err_));
    assert_int_equal(bytes[0], 2);
    assert_int_equal(size, 8 + (24 + 8 * 8) + (24 + 4 * 8));
    mem_free(bytes);
    free(t);
}

static void writer_refuses(void **state)
{
    (void)state;
    trip *t = malloc(sizeof *t);
    for (int i = 0; i < 5; i++) {
        build_trip(t);
        switch (i) {
        case 0:
            t->images[2].name = "../x.png";
            break;
        case 1:
            t->images[2].camera.params[0] = 0;
            break;
        case 2:
            t->observations[2][3].point = TRIP_POINTS;
            break;
        case 3:
            t->tracks[1][0][0] = TRIP_IMAGES;
            break;
        default:
            t->tracks[3][2][1] = TRIP_POINTS;
            break;
        }
        gbt_error err = {0};
        assert_int_equal(colmap_write(test_folder, t->images, TRIP_IMAGES, t->points, TRIP_POINTS, &err),
                         GBT_ERR_ARGUMENT);
        check_message(GBT_ERR_ARGUMENT, &err);
        assert_false(file_exists(in_folder("cameras.bin")));
    }
    free(t);
}

/* What COLMAP 4 wrote (colmap4/make.py): a rig of a panorama and a pinhole camera 0.1 beside it, three
   times. */
static void colmap_4_rig(void **state)
{
    (void)state;
    static const char *const names[3] = {"cameras", "images", "points3D"};
    const char *root = getenv("GBT_SOURCE");
    char paths[3][4096];
    unsigned char *bytes[3];
    source_file files[3];
    for (int i = 0; i < 3; i++) {
        snprintf(paths[i], sizeof paths[i], "%s/tests/data/colmap4/sparse/0/%s.bin",
                 root != NULL ? root : ".", names[i]);
        assert_ok(file_read(paths[i], &bytes[i], &files[i].size, &assert_ok_err_));
        files[i].name = paths[i];
        files[i].bytes = bytes[i];
    }
    raw_scene raw = {0};
    assert_ok(colmap_bin_read(&(colmap_files){files[0], files[1], files[2]}, &raw, &assert_ok_err_));
    assert_int_equal(raw.view_count, 6);
    assert_int_equal(raw.point_count, 1);
    for (size_t i = 0; i < raw.view_count; i++) {
        const raw_view *v = &raw.views[i];
        int camera, frame;
        assert_int_equal(sscanf(v->name, "c%d/%d.png", &camera, &frame), 2);
        assert_int_equal(v->camera.model,
                         camera == 1 ? GBT_CAMERA_EQUIRECTANGULAR : GBT_CAMERA_SIMPLE_PINHOLE);
        assert_true(fabs(v->camera.center[0] - (camera == 1 ? 0 : -0.1)) < 1e-12);
        assert_true(fabs(v->camera.center[2] + frame) < 1e-12);
    }
    raw_free(&raw);
    for (int i = 0; i < 3; i++)
        mem_free(bytes[i]);
}

int main(void)
{
    enum { BIN = sizeof bin_cases / sizeof bin_cases[0], TXT = sizeof txt_cases / sizeof txt_cases[0] };
    const struct CMUnitTest fixed[] = {
        cmocka_unit_test(cursor_ends),
        cmocka_unit_test(good_model),
        cmocka_unit_test(nearest_in_a_photo),
        cmocka_unit_test(nearest_around_a_panorama),
        cmocka_unit_test(duplicate_cameras),
        cmocka_unit_test(colmap_4_rig),
        cmocka_unit_test(name_length_limit),
        cmocka_unit_test(all_models),
        cmocka_unit_test(no_truncation_passes),
        cmocka_unit_test(very_long_line),
        cmocka_unit_test_setup_teardown(round_trip, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(writer_shares_cameras, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(writer_refuses, folder_make, folder_remove),
    };
    static struct CMUnitTest tests[BIN + TXT];
    for (size_t i = 0; i < BIN; i++)
        tests[i] = (struct CMUnitTest){
            .name = bin_cases[i].name, .test_func = malformed_binary, .initial_state = &bin_cases[i]};
    for (size_t i = 0; i < TXT; i++)
        tests[BIN + i] = (struct CMUnitTest){
            .name = txt_cases[i].name, .test_func = malformed_text, .initial_state = &txt_cases[i]};
    const int failures = cmocka_run_group_tests_name("colmap, malformed", tests, NULL, NULL);
    return failures + cmocka_run_group_tests_name("colmap", fixed, NULL, NULL);
}
