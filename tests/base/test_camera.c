/* SPDX-License-Identifier: Apache-2.0 */
/* tests/base/test_camera.c -- lens models against numbers from their formulas, against their own inverse, and
   at their limits. */
#include "base/camera_lens.h"
#include "base/near.h"
#include "base/poly.h"
#include "base/rng.h"
#include "base/vec.h"
#include "test_support.h"

enum { WIDTH = 640, HEIGHT = 480 };

/* Pixels were computed from the formulas of docs/cameras.md by a script that shares nothing with the code. */
typedef struct lens_case {
    gbt_camera_model model;
    double params[GBT_CAMERA_MAX_PARAMS];
    double points[2][3], pixels[2][2];
} lens_case;

static const lens_case lens_cases[] = {
    {GBT_CAMERA_SIMPLE_PINHOLE,
     {800, 320, 240},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{480, 133.3333333333333}, {40, 440}}},
    {GBT_CAMERA_PINHOLE,
     {800, 810, 320, 240},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{480, 132}, {40, 442.5}}},
    {GBT_CAMERA_SIMPLE_RADIAL,
     {800, 320, 240, -0.12},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{478.8906666666667, 134.0728888888889}, {46.21600000000001, 435.56}}},
    {GBT_CAMERA_SIMPLE_RADIAL,
     {500, 310, 250, 0.3},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{411.7333333333333, 182.1777777777777}, {125.2875, 381.9375}}},
    {GBT_CAMERA_RADIAL,
     {800, 320, 240, -0.2, 0.05},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{478.1778172839506, 134.5481218106996}, {49.88085000000001, 432.94225}}},
    {GBT_CAMERA_RADIAL,
     {320, 320, 240, -0.28, 0.06},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{382.9774411851852, 198.0150392098765}, {213.571608, 316.02028}}},
    {GBT_CAMERA_OPENCV,
     {600, 610, 322, 238, -0.28, 0.07, 0.001, -0.0008},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{439.9885748148148, 158.0464133662551}, {122.0634925000001, 383.240351875}}},
    {GBT_CAMERA_OPENCV,
     {400, 400, 320, 240, -0.15, 0.02, 0.01, -0.01},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{398.5475634567901, 187.7119947325103}, {181.36917, 339.23345}}},
    {GBT_CAMERA_OPENCV_FISHEYE,
     {300, 301, 320, 240, -0.01, 0.005, -0.002, 0.0003},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{378.8510467249929, 200.6351887461714}, {-158.3340775552063, 453.3015664357291}}},
    {GBT_CAMERA_OPENCV_FISHEYE,
     {150, 150, 320, 240, 0.02, -0.004, 0.0005, -2e-05},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{349.4738647940632, 220.3507568039578}, {68.27433701960393, 351.8780724357316}}},
    {GBT_CAMERA_FULL_OPENCV,
     {600, 600, 320, 240, 0.5, -0.2, 0.001, 0.0005, 0.01, 0.8, 0.1, 0.02},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{437.9068170639042, 161.4416775129528}, {122.0291077477582, 381.5584230373155}}},
    {GBT_CAMERA_FULL_OPENCV,
     {350, 350, 320, 240, 4.2, 1.9, -0.0004, 0.0002, 0.08, 4.5, 3.1, 0.5},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{388.83688003985, 194.1033540475074}, {203.814676615929, 322.9728667029079}}},
    {GBT_CAMERA_FOV,
     {400, 400, 320, 240, 0.9},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{404.3808445443296, 183.7461036371136}, {177.5675424724563, 341.7374696625312}}},
    {GBT_CAMERA_FOV,
     {600, 590, 320, 240, 1.4},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{457.1963492631153, 150.0601710386244}, {101.3304292445999, 393.589341363912}}},
    {GBT_CAMERA_SIMPLE_RADIAL_FISHEYE,
     {250, 320, 240, 0.03},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{369.1510167316897, 207.2326555122069}, {-122.7006489247924, 436.7558439665744}}},
    {GBT_CAMERA_RADIAL_FISHEYE,
     {180, 320, 240, 0.03, -0.004},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{355.3882944494971, 216.4078037003353}, {12.72267549029812, 376.5676997820898}}},
    {GBT_CAMERA_THIN_PRISM_FISHEYE,
     {300, 300, 320, 240, 0.01, -0.003, 0.001, -0.0005, 0.0005, -0.0001, 0.002, -0.001},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{378.9132194310145, 200.7412142977083}, {-169.309369469311, 458.0982191923317}}},
    {GBT_CAMERA_RAD_TAN_THIN_PRISM_FISHEYE,
     {240, 240, 320, 240, 0.4, -0.5, 0.3, -0.1, 0.02, -0.001, 0.0005, -0.0003, 0.001, -0.0002, -0.0008,
      0.0001},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{368.1185128033729, 207.9195730277009}, {236.520473390107, 299.6266320810764}}},
    {GBT_CAMERA_SIMPLE_DIVISION,
     {400, 320, 240, -0.2},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{399.0963225865847, 187.2691182756102}, {-703.7056339441313, 694.9802817529472}}},
    {GBT_CAMERA_DIVISION,
     {250, 260, 320, 240, -0.4},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{368.8949575345776, 206.0994961093595}, {-103.830651186308, 435.9039454372269}}},
    {GBT_CAMERA_DIVISION,
     {600, 610, 320, 240, 0.1},
     {{0.3, -0.2, 1.5}, {-0.35, 0.25, 1}},
     {{440.7014628171879, 158.1912307572393}, {105.9642421212449, 395.4307289357626}}},
    {GBT_CAMERA_SIMPLE_FISHEYE,
     {200, 320, 240},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{359.2552809397344, 213.8298127068437}, {-3.697879006852247, 383.8657240030454}}},
    {GBT_CAMERA_FISHEYE,
     {130, 140, 320, 240},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{345.5159326108273, 221.6808688947906}, {109.5963786455461, 340.7060068021318}}},
    {GBT_CAMERA_EUCM,
     {300, 300, 320, 240, 0.6, 1.1},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{378.8943770741039, 200.7370819505974}, {-169.765350787544, 457.6734892389085}}},
    {GBT_CAMERA_EUCM,
     {200, 210, 320, 240, 0.4, 0.9},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{359.5934463775754, 212.2845875356972}, {-366.4880324195444, 560.3610817957874}}},
    {GBT_CAMERA_EQUIRECTANGULAR,
     {640, 480},
     {{0.3, -0.2, 1.5}, {-0.9, 0.4, -0.2}},
     {{340.1065466204804, 220.1364457923638}, {137.7265640726196, 302.5443661759895}}},
};
enum { CASE_COUNT = sizeof lens_cases / sizeof lens_cases[0] };

static gbt_camera camera_of(gbt_camera_model model, const double *params)
{
    gbt_camera camera = {
        .model = model, .width = WIDTH, .height = HEIGHT, .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    memcpy(camera.params, params, sizeof camera.params);
    return camera;
}

static const char *name_of(const lens_case *c) { return gbt_camera_model_name(c->model); }

static void every_model_has_a_case(void **state)
{
    (void)state;
    int seen[GBT_CAMERA_MODEL_COUNT] = {0};
    for (size_t i = 0; i < CASE_COUNT; i++)
        seen[lens_cases[i].model]++;
    for (int i = 0; i < GBT_CAMERA_MODEL_COUNT; i++)
        assert_true(seen[i] > 0);
}

static void names_and_counts(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        int count;
    } wanted[GBT_CAMERA_MODEL_COUNT] = {{"SIMPLE_PINHOLE", 3},
                                        {"PINHOLE", 4},
                                        {"SIMPLE_RADIAL", 4},
                                        {"RADIAL", 5},
                                        {"OPENCV", 8},
                                        {"OPENCV_FISHEYE", 8},
                                        {"FULL_OPENCV", 12},
                                        {"FOV", 5},
                                        {"SIMPLE_RADIAL_FISHEYE", 4},
                                        {"RADIAL_FISHEYE", 5},
                                        {"THIN_PRISM_FISHEYE", 12},
                                        {"RAD_TAN_THIN_PRISM_FISHEYE", 16},
                                        {"SIMPLE_DIVISION", 4},
                                        {"DIVISION", 5},
                                        {"SIMPLE_FISHEYE", 3},
                                        {"FISHEYE", 4},
                                        {"EUCM", 6},
                                        {"EQUIRECTANGULAR", 2}};
    for (int i = 0; i < GBT_CAMERA_MODEL_COUNT; i++) {
        assert_string_equal(gbt_camera_model_name((gbt_camera_model)i), wanted[i].name);
        assert_int_equal(gbt_camera_param_count((gbt_camera_model)i), wanted[i].count);
    }
    assert_null(gbt_camera_model_name(GBT_CAMERA_MODEL_COUNT));
    assert_null(gbt_camera_model_name((gbt_camera_model)-1));
    assert_int_equal(gbt_camera_param_count(GBT_CAMERA_MODEL_COUNT), 0);
}

static void projects_as_the_formula(void **state)
{
    (void)state;
    for (size_t i = 0; i < CASE_COUNT; i++) {
        const lens_case *c = &lens_cases[i];
        const gbt_camera camera = camera_of(c->model, c->params);
        for (int k = 0; k < 2; k++) {
            double pixel[2], dir[3];
            if (!gbt_camera_project(&camera, c->points[k], pixel))
                fail_msg("%s, case %zu: point %d is not seen", name_of(c), i, k);
            for (int axis = 0; axis < 2; axis++)
                if (fabs(pixel[axis] - c->pixels[k][axis]) > 1e-9)
                    fail_msg("%s, case %zu, point %d: %.12g, wanted %.12g", name_of(c), i, k, pixel[axis],
                             c->pixels[k][axis]);
            if (!gbt_camera_unproject(&camera, c->pixels[k][0], c->pixels[k][1], dir))
                fail_msg("%s, case %zu: pixel %d has no ray", name_of(c), i, k);
            const double length = dvec_length(c->points[k]);
            for (int axis = 0; axis < 3; axis++)
                if (fabs(dir[axis] - c->points[k][axis] / length) > 1e-10)
                    fail_msg("%s, case %zu, pixel %d: direction %d is %.12g", name_of(c), i, k, axis,
                             dir[axis]);
        }
    }
}

/* Every pixel of the image, borders included, has a ray of length 1 that comes back to it. */
static void pixels_come_back(void **state)
{
    (void)state;
    for (size_t i = 0; i < CASE_COUNT; i++) {
        const lens_case *c = &lens_cases[i];
        const gbt_camera camera = camera_of(c->model, c->params);
        for (int row = 0; row <= 48; row++)
            for (int column = 0; column <= 64; column++) {
                const double px = column * (WIDTH / 64.0), py = row * (HEIGHT / 48.0);
                double dir[3], pixel[2];
                if (!gbt_camera_unproject(&camera, px, py, dir))
                    fail_msg("%s, case %zu: no ray at %g %g", name_of(c), i, px, py);
                if (fabs(dvec_length(dir) - 1) > 4e-16)
                    fail_msg("%s, case %zu: length %.17g at %g %g", name_of(c), i, dvec_length(dir), px, py);
                const bool turn = c->model == GBT_CAMERA_EQUIRECTANGULAR;
                if (!gbt_camera_project(&camera, dir, pixel))
                    fail_msg("%s, case %zu: ray of %g %g is not seen", name_of(c), i, px, py);
                if (turn && (column == 0 || column == 64 || row == 0 || row == 48))
                    continue; /* the seam and the poles are one direction for many pixels */
                if (fabs(pixel[0] - px) > 1e-9 || fabs(pixel[1] - py) > 1e-9)
                    fail_msg("%s, case %zu: %g %g came back as %.15g %.15g", name_of(c), i, px, py, pixel[0],
                             pixel[1]);
            }
    }
}

/* A row of pixels has the bits of its pixels one by one, also where there is no ray: beyond a fold, too far
   out; and before a pole. */
static void rows_are_pixels(void **state)
{
    (void)state;
    enum { COUNT = WIDTH + 3 };
    static const lens_case limits[] = {
        {.model = GBT_CAMERA_SIMPLE_RADIAL, .params = {100, 320, 240, -0.5}},
        {.model = GBT_CAMERA_SIMPLE_RADIAL, .params = {1e-160, 320, 240, 0.5}},
        {.model = GBT_CAMERA_OPENCV_FISHEYE, .params = {60, 60, 320, 240, -0.05, 0.01}},
        {.model = GBT_CAMERA_FULL_OPENCV, .params = {100, 100, 320, 240, 0, 0, 0, 0, 0, -0.3}}};
    size_t none = 0;
    for (size_t i = 0; i < CASE_COUNT + 4; i++) {
        const lens_case *c = i < CASE_COUNT ? &lens_cases[i] : &limits[i - CASE_COUNT];
        const gbt_camera camera = camera_of(c->model, c->params);
        camera_lens lens;
        assert_true(camera_lens_prepare(&camera, &lens));
        for (double y = 0.5; y < HEIGHT; y += 37) {
            static double row[COUNT][3];
            camera_lens_unproject_row(&lens, y, COUNT, row[0]);
            for (int k = 0; k < COUNT; k++) {
                double dir[3] = {0, 0, 0};
                none += !camera_lens_unproject(&lens, k + 0.5, y, dir);
                if (memcmp(row[k], dir, sizeof dir) != 0)
                    fail_msg("%s, case %zu: other bits at %d %g", name_of(c), i, k, y);
            }
        }
    }
    assert_true(none > 3 * COUNT);
}

/* Lenses whose terms mix x and y have no closed inverse. Random strong ones: what is seen in the picture
 * comes back. */
static void strong_lenses_come_back(void **state)
{
    (void)state;
    static const gbt_camera_model models[] = {GBT_CAMERA_OPENCV, GBT_CAMERA_FULL_OPENCV,
                                              GBT_CAMERA_THIN_PRISM_FISHEYE,
                                              GBT_CAMERA_RAD_TAN_THIN_PRISM_FISHEYE};
    size_t seen = 0;
    for (uint64_t i = 0; i < 4000; i++) {
        gbt_camera camera =
            camera_of(models[i % 4], (const double[GBT_CAMERA_MAX_PARAMS]){400, 400, 320, 240});
        for (int k = 4; k < gbt_camera_param_count(camera.model); k++)
            camera.params[k] = 0.05 * rng_normal(23, (uint64_t)k, i);
        for (uint64_t k = 0; k < 10; k++) {
            double point[3] = {0.5 * rng_normal(24, 2 * k, i), 0.5 * rng_normal(24, 2 * k + 1, i), 1};
            double pixel[2], dir[3];
            if (!gbt_camera_project(&camera, point, pixel) || !(pixel[0] >= 0 && pixel[0] <= WIDTH) ||
                !(pixel[1] >= 0 && pixel[1] <= HEIGHT))
                continue;
            seen++;
            dvec_normalize(point);
            if (!gbt_camera_unproject(&camera, pixel[0], pixel[1], dir))
                fail_msg("lens %d, %s: no ray at %g %g", (int)i, gbt_camera_model_name(camera.model),
                         pixel[0], pixel[1]);
            for (int axis = 0; axis < 3; axis++)
                if (!(fabs(dir[axis] - point[axis]) <= 1e-9))
                    fail_msg("lens %d, %s: direction %.12g, wanted %.12g", (int)i,
                             gbt_camera_model_name(camera.model), dir[axis], point[axis]);
        }
    }
    assert_true(seen > 20000);
}

/* Directions over the whole sphere: what is seen comes back as the same direction, and wide lenses see behind
   themselves. */
static void directions_come_back(void **state)
{
    (void)state;
    for (size_t i = 0; i < CASE_COUNT; i++) {
        const lens_case *c = &lens_cases[i];
        const gbt_camera camera = camera_of(c->model, c->params);
        size_t seen = 0, seen_behind = 0;
        for (uint64_t k = 0; k < 2000; k++) {
            double point[3], pixel[2], dir[3];
            for (uint64_t axis = 0; axis < 3; axis++)
                point[axis] = rng_normal(7, axis, k);
            if (!gbt_camera_project(&camera, point, pixel))
                continue;
            const bool inside = pixel[0] >= 0 && pixel[0] <= WIDTH && pixel[1] >= 0 && pixel[1] <= HEIGHT;
            if (!inside)
                continue;
            seen++;
            seen_behind += point[2] < 0;
            dvec_normalize(point);
            if (!gbt_camera_unproject(&camera, pixel[0], pixel[1], dir))
                fail_msg("%s, case %zu, direction %d: no ray", name_of(c), i, (int)k);
            for (int axis = 0; axis < 3; axis++)
                if (fabs(dir[axis] - point[axis]) > 1e-10)
                    fail_msg("%s, case %zu, direction %d: %.12g, wanted %.12g", name_of(c), i, (int)k,
                             dir[axis], point[axis]);
        }
        assert_true(seen > 30);
        if (c->model == GBT_CAMERA_FISHEYE || c->model == GBT_CAMERA_EQUIRECTANGULAR ||
            (c->model == GBT_CAMERA_OPENCV_FISHEYE && c->params[0] == 150))
            assert_true(seen_behind > 100);
        if (c->model == GBT_CAMERA_PINHOLE || c->model == GBT_CAMERA_OPENCV || c->model == GBT_CAMERA_FOV)
            assert_int_equal(seen_behind, 0);
    }
}

/* RealityScan writes FULL_OPENCV with eight zeros: such a camera is a pinhole to the last bit. */
static void no_distortion_is_the_plain_model(void **state)
{
    (void)state;
    static const struct {
        gbt_camera_model model, plain;
        double params[GBT_CAMERA_MAX_PARAMS], plain_params[GBT_CAMERA_MAX_PARAMS];
    } rows[] = {
        {GBT_CAMERA_SIMPLE_RADIAL, GBT_CAMERA_PINHOLE, {517.3, 318.6, 255.3}, {517.3, 517.3, 318.6, 255.3}},
        {GBT_CAMERA_RADIAL, GBT_CAMERA_PINHOLE, {517.3, 318.6, 255.3}, {517.3, 517.3, 318.6, 255.3}},
        {GBT_CAMERA_OPENCV, GBT_CAMERA_PINHOLE, {517.3, 516.5, 318.6, 255.3}, {517.3, 516.5, 318.6, 255.3}},
        {GBT_CAMERA_FULL_OPENCV,
         GBT_CAMERA_PINHOLE,
         {517.3, 516.5, 318.6, 255.3},
         {517.3, 516.5, 318.6, 255.3}},
        {GBT_CAMERA_FOV, GBT_CAMERA_PINHOLE, {517.3, 516.5, 318.6, 255.3}, {517.3, 516.5, 318.6, 255.3}},
        {GBT_CAMERA_SIMPLE_DIVISION, GBT_CAMERA_PINHOLE, {517.3, 318.6, 255.3}, {517.3, 517.3, 318.6, 255.3}},
        {GBT_CAMERA_DIVISION, GBT_CAMERA_PINHOLE, {517.3, 516.5, 318.6, 255.3}, {517.3, 516.5, 318.6, 255.3}},
        {GBT_CAMERA_EUCM,
         GBT_CAMERA_PINHOLE,
         {517.3, 516.5, 318.6, 255.3, 0, 1.2},
         {517.3, 516.5, 318.6, 255.3}},
        {GBT_CAMERA_SIMPLE_PINHOLE, GBT_CAMERA_PINHOLE, {517.3, 318.6, 255.3}, {517.3, 517.3, 318.6, 255.3}},
        {GBT_CAMERA_OPENCV_FISHEYE,
         GBT_CAMERA_FISHEYE,
         {217.3, 216.5, 318.6, 255.3},
         {217.3, 216.5, 318.6, 255.3}},
        {GBT_CAMERA_RADIAL_FISHEYE, GBT_CAMERA_FISHEYE, {217.3, 318.6, 255.3}, {217.3, 217.3, 318.6, 255.3}},
        {GBT_CAMERA_SIMPLE_RADIAL_FISHEYE,
         GBT_CAMERA_FISHEYE,
         {217.3, 318.6, 255.3},
         {217.3, 217.3, 318.6, 255.3}},
        {GBT_CAMERA_THIN_PRISM_FISHEYE,
         GBT_CAMERA_FISHEYE,
         {217.3, 216.5, 318.6, 255.3},
         {217.3, 216.5, 318.6, 255.3}},
        {GBT_CAMERA_RAD_TAN_THIN_PRISM_FISHEYE,
         GBT_CAMERA_FISHEYE,
         {217.3, 216.5, 318.6, 255.3},
         {217.3, 216.5, 318.6, 255.3}},
        {GBT_CAMERA_SIMPLE_FISHEYE, GBT_CAMERA_FISHEYE, {217.3, 318.6, 255.3}, {217.3, 217.3, 318.6, 255.3}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const gbt_camera a = camera_of(rows[i].model, rows[i].params),
                         b = camera_of(rows[i].plain, rows[i].plain_params);
        for (int k = 0; k < 500; k++) {
            const double px = WIDTH * (double)rng_uniform(3, 0, (uint64_t)k),
                         py = HEIGHT * (double)rng_uniform(3, 1, (uint64_t)k);
            double dir_a[3], dir_b[3], pixel_a[2], pixel_b[2];
            assert_true(gbt_camera_unproject(&a, px, py, dir_a) && gbt_camera_unproject(&b, px, py, dir_b));
            assert_memory_equal(dir_a, dir_b, sizeof dir_a);
            assert_true(gbt_camera_project(&a, dir_a, pixel_a) && gbt_camera_project(&b, dir_a, pixel_b));
            assert_memory_equal(pixel_a, pixel_b, sizeof pixel_a);
        }
    }
}

/* k = -0.5, f = 400: r (1 - r^2 / 2) grows up to r = sqrt(2 / 3), where it is 2/3 sqrt(2/3), 217.7 px from
   the centre. */
static void nothing_beyond_the_fold(void **state)
{
    (void)state;
    const gbt_camera camera =
        camera_of(GBT_CAMERA_SIMPLE_RADIAL, (const double[GBT_CAMERA_MAX_PARAMS]){400, 320, 240, -0.5});
    const double edge_px = 400 * (2.0 / 3) * sqrt(2.0 / 3), edge = sqrt(2.0 / 3);
    double dir[3] = {7, 8, 9}, pixel[2] = {7, 8};
    assert_true(gbt_camera_unproject(&camera, 320 + edge_px - 1e-6, 240, dir));
    assert_near(dir[0] / dir[2], edge, 1e-3);
    memcpy(dir, (const double[3]){7, 8, 9}, sizeof dir);
    assert_false(gbt_camera_unproject(&camera, 320 + edge_px + 1e-6, 240, dir));
    assert_memory_equal(dir, ((const double[3]){7, 8, 9}), sizeof dir);
    assert_true(gbt_camera_project(&camera, (const double[3]){edge - 1e-9, 0, 1}, pixel));
    assert_near(pixel[0], 320 + edge_px, 1e-9);
    assert_false(gbt_camera_project(&camera, (const double[3]){edge + 1e-9, 0, 1}, pixel));
}

/* k < 0: almost straight behind, (r, 0, 1 - r^2 / 5) with r = 12345.6, where the textbook form of the
   division model cancels. */
static void division_is_exact_behind(void **state)
{
    (void)state;
    const gbt_camera camera =
        camera_of(GBT_CAMERA_DIVISION, (const double[GBT_CAMERA_MAX_PARAMS]){1, 1, 0, 0, -0.2});
    const double r = 12345.6;
    double pixel[2];
    assert_true(gbt_camera_project(&camera, (const double[3]){r / 7, 0, (1 - 0.2 * r * r) / 7}, pixel));
    assert_near(pixel[0], r, 1e-10);
}

/* A radial factor 1 / (1 - r^2) reaches every distorted radius before its pole at r = 1. */
static void a_pole_ends_the_range(void **state)
{
    (void)state;
    static const double params[GBT_CAMERA_MAX_PARAMS] = {100, 100, 320, 240, 0, 0, 0, 0, 0, -1};
    const gbt_camera camera = camera_of(GBT_CAMERA_FULL_OPENCV, params);
    double dir[3], pixel[2];
    assert_true(gbt_camera_unproject(&camera, 320 + 1e3, 240, dir));
    const double wanted = (sqrt(1 + 4 * 100.0) - 1) / (2 * 10.0); /* r / (1 - r^2) = 10 */
    assert_near(dir[0] / dir[2], wanted, 1e-12);
    assert_false(gbt_camera_project(&camera, (const double[3]){1.0001, 0, 1}, pixel));
}

/* No ray at the image point, and the camera point is not seen. */
static const struct blind_case {
    const char *why;
    gbt_camera_model model;
    double params[GBT_CAMERA_MAX_PARAMS], pixel[2], point[3];
} blind_cases[] = {
    {"behind a pinhole", GBT_CAMERA_PINHOLE, {400, 400, 320, 240}, {NAN, 1}, {0.1, 0.1, -1}},
    {"in the image plane", GBT_CAMERA_PINHOLE, {400, 400, 320, 240}, {1, INFINITY}, {1, 0, 0}},
    {"the centre itself", GBT_CAMERA_FISHEYE, {100, 100, 320, 240}, {320 + 315, 240}, {0, 0, 0}},
    {"exactly behind a fisheye", GBT_CAMERA_FISHEYE, {100, 100, 320, 240}, {320 + 314.16, 240}, {0, 0, -1}},
    {"not a number", GBT_CAMERA_EQUIRECTANGULAR, {640, 480}, {NAN, 3}, {NAN, 0, 1}},
    {"beside the panorama", GBT_CAMERA_EQUIRECTANGULAR, {640, 480}, {640.001, 3}, {0, 0, 0}},
    {"above the panorama", GBT_CAMERA_EQUIRECTANGULAR, {640, 480}, {3, -0.001}, {0, 0, 0}},
    {"division, k > 0, past the last angle",
     GBT_CAMERA_DIVISION,
     {400, 400, 320, 240, 1},
     {720.1, 240},
     {1, 0, 1.99}},
    {"division, k > 0, behind", GBT_CAMERA_DIVISION, {400, 400, 320, 240, 0.1}, {1e9, 240}, {0.1, 0, -1}},
    {"EUCM past its radius", GBT_CAMERA_EUCM, {100, 100, 320, 240, 1, 1}, {421, 240}, {0.1, 0, -1}},
    {"FOV past a right angle", GBT_CAMERA_FOV, {100, 100, 320, 240, 1}, {320 + 157.1, 240}, {0, 1, 0}},
    {"focal length 0", GBT_CAMERA_PINHOLE, {0, 400, 320, 240}, {1, 1}, {0, 0, 1}},
    {"focal length < 0", GBT_CAMERA_SIMPLE_PINHOLE, {-400, 320, 240}, {1, 1}, {0, 0, 1}},
    {"parameter not a number", GBT_CAMERA_OPENCV, {400, 400, 320, 240, NAN}, {1, 1}, {0, 0, 1}},
    {"EUCM alpha > 1", GBT_CAMERA_EUCM, {400, 400, 320, 240, 1.01, 1}, {320, 240}, {0, 0, 1}},
    {"EUCM beta 0", GBT_CAMERA_EUCM, {400, 400, 320, 240, 0.5, 0}, {320, 240}, {0, 0, 1}},
    {"FOV omega pi", GBT_CAMERA_FOV, {400, 400, 320, 240, 3.1415926535897936}, {320, 240}, {0, 0, 1}},
    {"unknown model", GBT_CAMERA_MODEL_COUNT, {400, 400, 320, 240}, {320, 240}, {0, 0, 1}},
    {"tangential fold", GBT_CAMERA_OPENCV, {400, 400, 320, 240, 0, 0, 0.2, 0}, {320, -500}, {0, -0.9, 1}},
};

static void sees_nothing(void **state)
{
    const struct blind_case *c = *state;
    const gbt_camera camera = camera_of(c->model, c->params);
    double dir[3] = {1, 2, 3}, pixel[2] = {4, 5};
    assert_false(gbt_camera_unproject(&camera, c->pixel[0], c->pixel[1], dir));
    assert_false(gbt_camera_project(&camera, c->point, pixel));
    assert_memory_equal(dir, ((const double[3]){1, 2, 3}), sizeof dir);
    assert_memory_equal(pixel, ((const double[2]){4, 5}), sizeof pixel);
}

/* The limits themselves still belong to the model. */
static void limits_are_inside(void **state)
{
    (void)state;
    double dir[3];
    const gbt_camera panorama =
        camera_of(GBT_CAMERA_EQUIRECTANGULAR, (const double[GBT_CAMERA_MAX_PARAMS]){640, 480});
    assert_true(gbt_camera_unproject(&panorama, 640, 480, dir));
    assert_near(dir[1], 1, 1e-15);
    assert_true(gbt_camera_unproject(&panorama, 320, 240, dir));
    assert_near(dir[2], 1, 0);
    assert_true(gbt_camera_unproject(&panorama, 480, 240, dir)); /* three quarters across looks along +x */
    assert_near(dir[0], 1, 1e-15);
    const gbt_camera division =
        camera_of(GBT_CAMERA_DIVISION, (const double[GBT_CAMERA_MAX_PARAMS]){400, 400, 320, 240, 1});
    assert_true(gbt_camera_unproject(&division, 720, 240, dir)); /* (1, 0, 1 + 1) */
    assert_near(dir[0] / dir[2], 0.5, 1e-15);
    const gbt_camera sphere =
        camera_of(GBT_CAMERA_EUCM, (const double[GBT_CAMERA_MAX_PARAMS]){100, 100, 320, 240, 1, 1});
    assert_true(gbt_camera_unproject(&sphere, 420, 240, dir)); /* orthographic: the rim is at 90 degrees */
    assert_near(dir[2], 0, 1e-15);
    const gbt_camera ball =
        camera_of(GBT_CAMERA_FISHEYE, (const double[GBT_CAMERA_MAX_PARAMS]){100, 100, 320, 240});
    assert_true(gbt_camera_unproject(&ball, 320 + 314.159, 240, dir));
    assert_near(dir[2], -1, 1e-9);
    for (size_t i = 0; i < CASE_COUNT; i++) { /* the axis itself */
        const gbt_camera camera = camera_of(lens_cases[i].model, lens_cases[i].params);
        double pixel[2];
        assert_true(gbt_camera_project(&camera, (const double[3]){0, 0, 2}, pixel));
        assert_true(gbt_camera_unproject(&camera, pixel[0], pixel[1], dir));
        assert_near(dir[2], 1, 1e-15);
    }
}

/* Wild parameters must neither hang nor give a ray that is not one. */
static void wild_parameters_stay_honest(void **state)
{
    (void)state;
    size_t rays = 0;
    for (uint64_t i = 0; i < 4000; i++) {
        gbt_camera camera = {
            .model = (gbt_camera_model)(i % GBT_CAMERA_MODEL_COUNT), .width = WIDTH, .height = HEIGHT};
        const int count = gbt_camera_param_count(camera.model);
        for (int k = 0; k < count; k++)
            camera.params[k] = rng_normal(11, (uint64_t)k, i) * (i % 5 == 0   ? 1e150
                                                                 : i % 5 == 1 ? 1e-200
                                                                              : 1);
        camera.params[0] = fabs(camera.params[0]) * 300;
        camera.params[1] = fabs(camera.params[1]) * 300;
        for (int k = 0; k < 10; k++) {
            const double px = 1000 * rng_normal(12, (uint64_t)k, i),
                         py = 1000 * rng_normal(13, (uint64_t)k, i);
            double dir[3], pixel[2];
            if (!gbt_camera_unproject(&camera, px, py, dir))
                continue;
            rays++;
            if (!(fabs(dvec_length(dir) - 1) < 1e-14))
                fail_msg("camera %d, model %d: direction %g %g %g", (int)i, (int)camera.model, dir[0], dir[1],
                         dir[2]);
            if (gbt_camera_project(&camera, dir, pixel) && !(isfinite(pixel[0]) && isfinite(pixel[1])))
                fail_msg("camera %d, model %d: pixel %g %g", (int)i, (int)camera.model, pixel[0], pixel[1]);
        }
    }
    assert_true(rays > 4000);
}

static void resizing_keeps_rays(void **state)
{
    (void)state;
    for (size_t i = 0; i < CASE_COUNT; i++) {
        const gbt_camera camera = camera_of(lens_cases[i].model, lens_cases[i].params);
        const gbt_camera half = gbt_camera_resized(&camera, WIDTH / 2, HEIGHT / 2);
        assert_int_equal(half.model, camera.model);
        assert_int_equal(half.width, WIDTH / 2);
        assert_int_equal(half.height, HEIGHT / 2);
        const bool own_ratios =
            gbt_camera_param_count(camera.model) >= 4 && camera.model != GBT_CAMERA_SIMPLE_RADIAL &&
            camera.model != GBT_CAMERA_RADIAL && camera.model != GBT_CAMERA_SIMPLE_RADIAL_FISHEYE &&
            camera.model != GBT_CAMERA_RADIAL_FISHEYE && camera.model != GBT_CAMERA_SIMPLE_DIVISION;
        const gbt_camera flat =
            gbt_camera_resized(&camera, 2 * WIDTH, HEIGHT / 4); /* only for models with fx and fy */
        for (int k = 0; k < 50; k++) {
            const double px = WIDTH * (double)rng_uniform(5, 0, (uint64_t)k),
                         py = HEIGHT * (double)rng_uniform(5, 1, (uint64_t)k);
            double dir[3], other[3];
            assert_true(gbt_camera_unproject(&camera, px, py, dir));
            assert_true(gbt_camera_unproject(&half, px / 2, py / 2, other));
            for (int axis = 0; axis < 3; axis++)
                assert_near(dir[axis], other[axis], 1e-12);
            if (!own_ratios && camera.model != GBT_CAMERA_EQUIRECTANGULAR)
                continue;
            assert_true(gbt_camera_unproject(&flat, px * 2, py / 4, other));
            for (int axis = 0; axis < 3; axis++)
                assert_near(dir[axis], other[axis], 1e-12);
        }
        const gbt_camera back = gbt_camera_resized(&half, WIDTH, HEIGHT);
        assert_memory_equal(back.params, camera.params, sizeof camera.params); /* powers of two are exact */
    }
}

static void every_step_keeps_rays(void **state)
{
    (void)state;
    for (size_t i = 0; i < CASE_COUNT; i++) {
        const gbt_camera camera = camera_of(lens_cases[i].model, lens_cases[i].params);
        gbt_camera few;
        assert_true(gbt_camera_every(&camera, 3, 1, 2, &few));
        assert_int_equal(few.width, WIDTH / 3);
        for (int k = 0; k < 50; k++) {
            const int x = k * few.width / 50, y = k * few.height / 50;
            double dir[3], other[3];
            assert_true(gbt_camera_unproject(&camera, 3 * x + 1.5, 3 * y + 2.5, dir));
            assert_true(gbt_camera_unproject(&few, x + 0.5, y + 0.5, other));
            for (int axis = 0; axis < 3; axis++)
                assert_near(dir[axis], other[axis], 1e-12);
            double pixel[2];
            assert_true(gbt_camera_project(&few, dir, pixel));
            assert_near(pixel[0], x + 0.5, 1e-9);
            assert_near(pixel[1], y + 0.5, 1e-9);
        }
        assert_false(gbt_camera_every(&camera, WIDTH + 1, 0, 0, &few)); /* no pixel would be left */
        assert_false(gbt_camera_every(&camera, 0, 0, 0, &few));
    }
}

static void shifting_keeps_rays(void **state)
{
    (void)state;
    for (size_t i = 0; i < CASE_COUNT; i++) {
        const gbt_camera camera = camera_of(lens_cases[i].model, lens_cases[i].params);
        gbt_camera shifted;
        assert_true(gbt_camera_shifted(&camera, 0.25, -0.375, &shifted));
        assert_int_equal(shifted.width, WIDTH);
        for (int k = 1; k < 50; k++) {
            const double x = k * camera.width / 50, y = k * camera.height / 50;
            double dir[3], other[3];
            assert_true(gbt_camera_unproject(&camera, x + 0.25, y - 0.375, dir));
            assert_true(gbt_camera_unproject(&shifted, x, y, other));
            for (int axis = 0; axis < 3; axis++)
                assert_near(dir[axis], other[axis], 1e-12);
        }
    }
}

static gbt_camera rolling_camera(gbt_camera_shutter shutter)
{
    static const double motion[6] = {0.3, -0.2, 0.1, 0.2, 0.3, -0.1}, turn[4] = {0.8, 0.36, -0.48, 0};
    gbt_camera camera =
        camera_of(GBT_CAMERA_PINHOLE, (const double[GBT_CAMERA_MAX_PARAMS]){400, 410, 320, 240});
    dquat_to_matrix(turn, camera.rotation);
    camera.center[1] = 5;
    camera.shutter = shutter;
    memcpy(camera.motion, motion, sizeof motion);
    return camera;
}

/* A line of the image is what the camera sees after its part of the motion. */
static void rolling_by_lines(void **state)
{
    (void)state;
    for (int by_columns = 0; by_columns < 2; by_columns++) {
        const gbt_camera camera =
            rolling_camera(by_columns ? GBT_CAMERA_SHUTTER_COLUMNS : GBT_CAMERA_SHUTTER_ROWS);
        for (int line = 0; line <= 8; line++) {
            const double x = by_columns ? line * WIDTH / 8.0 : 100, y = by_columns ? 50 : line * HEIGHT / 8.0;
            double part[6], start[3], dir[3], wanted_start[3], wanted_dir[3], way[3];
            for (int k = 0; k < 6; k++)
                part[k] = (line / 8.0 - 0.5) * camera.motion[k];
            gbt_camera there = gbt_camera_moved(&camera, part);
            const gbt_camera at = gbt_camera_at(&camera, x, y);
            there.shutter = GBT_CAMERA_SHUTTER_GLOBAL;
            assert_true(gbt_camera_ray(&there, x, y, wanted_start, wanted_dir));
            assert_true(gbt_camera_ray(&camera, x, y, start, dir));
            dmat_apply_transposed(camera.rotation, part, way);
            for (int k = 0; k < 3; k++) {
                assert_near(start[k], wanted_start[k], 1e-15);
                assert_near(start[k], camera.center[k] + way[k], 1e-15);
                assert_near(dir[k], wanted_dir[k], 1e-15);
                assert_near(at.center[k], start[k], 0);
                assert_near(at.motion[k], 0, 0);
            }
        }
    }
}

/* Parts of an image are taken in their part of the time: the same rays. */
static void parts_of_a_rolling_image(void **state)
{
    (void)state;
    for (gbt_camera_shutter s = GBT_CAMERA_SHUTTER_GLOBAL; s <= GBT_CAMERA_SHUTTER_COLUMNS; s++) {
        const gbt_camera camera = rolling_camera(s);
        gbt_camera some[4];
        assert_true(gbt_camera_every(&camera, 3, 1, 2, &some[0]));
        assert_true(gbt_camera_shifted(&camera, 0.25, -0.375, &some[1]));
        assert_true(gbt_camera_cropped(&camera, 200, 120, 64, 48, &some[2]));
        assert_false(gbt_camera_cropped(&camera, 200, 120, 0, 48, &some[3]));
        assert_false(gbt_camera_cropped(&camera, 200, 120, 64, -1, &some[3]));
        some[3] = gbt_camera_resized(&camera, WIDTH / 4, HEIGHT / 4);
        assert_int_equal(some[2].width, 64);
        assert_int_equal(some[2].height, 48);
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 20; k++) {
                const double x = 0.5 + k * some[i].width / 20, y = 0.5 + (19 - k) * some[i].height / 20;
                const double there[4][2] = {
                    {3 * x, 3 * y + 1}, {x + 0.25, y - 0.375}, {x + 200, y + 120}, {4 * x, 4 * y}};
                double start[3], dir[3], other_start[3], other_dir[3];
                assert_true(gbt_camera_ray(&some[i], x, y, start, dir));
                assert_true(gbt_camera_ray(&camera, there[i][0], there[i][1], other_start, other_dir));
                for (int axis = 0; axis < 3; axis++) {
                    assert_near(start[axis], other_start[axis], 1e-13);
                    assert_near(dir[axis], other_dir[axis], 1e-13);
                }
            }
    }
}

/* gbt_camera_pixel() inverts gbt_camera_ray(), moving or not. */
static void pixels_of_points(void **state)
{
    (void)state;
    for (gbt_camera_shutter s = GBT_CAMERA_SHUTTER_GLOBAL; s <= GBT_CAMERA_SHUTTER_COLUMNS; s++) {
        const gbt_camera camera = rolling_camera(s);
        for (int k = 0; k < 100; k++) {
            const double x = 6.4 * k, y = 4.8 * (k * 37 % 100);
            double start[3], dir[3], point[3], behind[3], pixel[2];
            assert_true(gbt_camera_ray(&camera, x, y, start, dir));
            for (int axis = 0; axis < 3; axis++) {
                point[axis] = start[axis] + 3 * dir[axis];
                behind[axis] = start[axis] - 3 * dir[axis];
            }
            assert_true(gbt_camera_pixel(&camera, point, pixel));
            assert_near(pixel[0], x, 1e-7);
            assert_near(pixel[1], y, 1e-7);
            assert_false(gbt_camera_pixel(&camera, behind, pixel));
        }
    }
    gbt_camera none = rolling_camera(GBT_CAMERA_SHUTTER_ROWS);
    double pixel[2];
    none.params[0] = 0;
    assert_false(gbt_camera_pixel(&none, (const double[3]){0, 5, 3}, pixel));
}

static void resizing_exact_numbers(void **state)
{
    (void)state;
    gbt_camera camera =
        camera_of(GBT_CAMERA_SIMPLE_RADIAL, (const double[GBT_CAMERA_MAX_PARAMS]){800, 310, 250, 0.1});
    camera.width = 1001;
    camera.height = 500;
    const gbt_camera out =
        gbt_camera_resized(&camera, 500, 250); /* 1001 / 2 was rounded: one f takes the mean of the ratios */
    assert_near(out.params[0], 800 * 0.5 * (500.0 / 1001 + 0.5), 1e-12);
    assert_near(out.params[1], 310 * 500.0 / 1001, 1e-12);
    assert_near(out.params[2], 125, 0);
    assert_near(out.params[3], 0.1, 0);
    const gbt_camera same = gbt_camera_resized(&camera, 0, 250); /* nonsense changes nothing */
    assert_memory_equal(same.params, camera.params, sizeof camera.params);
    assert_int_equal(same.width, 1001);
    assert_int_equal(same.height, 500);
}

static void half_fov(void **state)
{
    (void)state;
    double tan_half[2];
    gbt_camera camera =
        camera_of(GBT_CAMERA_PINHOLE, (const double[GBT_CAMERA_MAX_PARAMS]){320, 480, 300, 200});
    gbt_camera_half_fov_tan(&camera, tan_half);
    assert_near(tan_half[0], 1, 0);
    assert_near(tan_half[1], 0.5, 0);
    camera = camera_of(GBT_CAMERA_SIMPLE_RADIAL, (const double[GBT_CAMERA_MAX_PARAMS]){640, 300, 200, 0.1});
    gbt_camera_half_fov_tan(&camera, tan_half);
    assert_near(tan_half[0], 0.5, 0);
    assert_near(tan_half[1], 0.375, 0);
    camera = camera_of(GBT_CAMERA_EQUIRECTANGULAR, (const double[GBT_CAMERA_MAX_PARAMS]){640, 480});
    gbt_camera_half_fov_tan(&camera, tan_half); /* 2 pi across and pi down, in radians at the centre */
    assert_near(tan_half[0], 3.14159265358979, 1e-12);
    assert_near(tan_half[1], 1.57079632679490, 1e-12);
    camera.params[0] = 0;
    gbt_camera_half_fov_tan(&camera, tan_half);
    assert_near(tan_half[0], 0, 0);
    assert_near(tan_half[1], 0, 0);
}

/* Parallel rays: not one of COLMAP's models, so a data set cannot hold it; a pixel is a point of the plane, a
   point its place across the view. */
static void orthographic(void **state)
{
    (void)state;
    assert_true(GBT_CAMERA_ORTHOGRAPHIC >= GBT_CAMERA_MODEL_COUNT);
    assert_string_equal(gbt_camera_model_name(GBT_CAMERA_ORTHOGRAPHIC), "ORTHOGRAPHIC");
    assert_int_equal(gbt_camera_param_count(GBT_CAMERA_ORTHOGRAPHIC), 4);
    gbt_camera camera =
        camera_of(GBT_CAMERA_ORTHOGRAPHIC, (const double[GBT_CAMERA_MAX_PARAMS]){40, 50, 320, 240});
    double dir[3], origin[3], pixel[2], tan_half[2];
    assert_true(gbt_camera_unproject(&camera, 17, 400, dir));
    assert_memory_equal(dir, ((const double[3]){0, 0, 1}), sizeof dir);
    assert_true(gbt_camera_project(&camera, (const double[3]){-2, 3, 0.001}, pixel));
    assert_near(pixel[0], 240, 1e-12);
    assert_near(pixel[1], 390, 1e-12);
    assert_false(gbt_camera_project(&camera, (const double[3]){-2, 3, 0}, pixel)); /* on the plane, where the
                                                                                      rays start */
    assert_false(gbt_camera_project(&camera, (const double[3]){-2, 3, -1}, pixel));
    assert_false(gbt_camera_unproject(&camera, NAN, 400, dir));
    /* right = +y, down = -x of the world */
    const double turned[9] = {0, 1, 0, -1, 0, 0, 0, 0, 1};
    memcpy(camera.rotation, turned, sizeof turned);
    camera.center[0] = 10;
    camera.center[2] = -4;
    assert_true(gbt_camera_ray(&camera, 360, 290, origin, dir)); /* one unit right and one down */
    assert_memory_equal(origin, ((const double[3]){9, 1, -4}), sizeof origin);
    assert_memory_equal(dir, ((const double[3]){0, 0, 1}), sizeof dir);
    const gbt_camera half = gbt_camera_resized(&camera, WIDTH / 2, HEIGHT / 4);
    assert_memory_equal(half.params, ((const double[4]){20, 12.5, 160, 60}), 4 * sizeof(double));
    gbt_camera_half_fov_tan(&camera, tan_half);
    assert_true(tan_half[0] == 0 && tan_half[1] == 0);
    camera.params[1] = 0;
    assert_false(gbt_camera_ray(&camera, 360, 290, origin, dir));
    assert_memory_equal(origin, ((const double[3]){9, 1, -4}), sizeof origin);
    camera = camera_of(GBT_CAMERA_PINHOLE, (const double[GBT_CAMERA_MAX_PARAMS]){40, 50, 320, 240});
    camera.center[1] = 5;
    assert_true(gbt_camera_ray(&camera, 360, 240, origin, dir));
    assert_memory_equal(origin, camera.center, sizeof origin);
    assert_near(dir[0], sqrt(0.5), 1e-15);
}

/* A tiny distortion is close to none: no model has a jump at 0. */
static void continuous_at_zero(void **state)
{
    (void)state;
    static const gbt_camera_model with_k[] = {GBT_CAMERA_OPENCV, GBT_CAMERA_FOV, GBT_CAMERA_DIVISION,
                                              GBT_CAMERA_FULL_OPENCV};
    for (size_t i = 0; i < sizeof with_k / sizeof with_k[0]; i++) {
        const gbt_camera plain =
            camera_of(GBT_CAMERA_PINHOLE, (const double[GBT_CAMERA_MAX_PARAMS]){400, 410, 320, 240});
        gbt_camera tiny = plain;
        tiny.model = with_k[i];
        tiny.params[4] = 1e-9;
        double a[3], b[3], pixel[2];
        assert_true(gbt_camera_unproject(&plain, 17, 400, a) && gbt_camera_unproject(&tiny, 17, 400, b));
        for (int axis = 0; axis < 3; axis++)
            assert_near(a[axis], b[axis], 2e-9);
        assert_true(gbt_camera_project(&tiny, b, pixel));
        assert_near(pixel[0], 17, 1e-9);
        assert_near(pixel[1], 400, 1e-9);
    }
}

/* (x - 1)(x - 2)(x - 3)(x - 4)(x - 5), and the same with a double root at 2, where the sign does not
   change. */
static void polynomial_roots(void **state)
{
    (void)state;
    double roots[POLY_LIMIT];
    assert_int_equal(poly_roots((const double[]){-120, 274, -225, 85, -15, 1}, 5, 4.5, roots), 4);
    for (int i = 0; i < 4; i++)
        assert_near(roots[i], i + 1, 1e-12);
    assert_int_equal(poly_roots((const double[]){-12, 16, -7, 1}, 3, 10, roots), 1); /* (x - 2)^2 (x - 3) */
    assert_near(roots[0], 3, 1e-6);
    assert_int_equal(poly_roots((const double[]){4, -4, 1}, 2, 10, roots), 0); /* (x - 2)^2 */
    assert_near(poly_first_root((const double[]){1, 2, 3}, 2, 7), 7, 0);
    assert_near(poly_first_root((const double[]){6, -5, 1}, 2, 7), 2, 1e-15);
    assert_near(poly_first_root((const double[]){6, -3, 0, 0}, 3, 7), 2, 0);
    assert_near(poly_first_root((const double[]){6, -3, 0, 0}, 3, 2), 2, 0); /* at the limit: not inside */
}

/* docs/cameras.md lists every model as the library does: number, name and parameters. */
static void the_page_has_the_list(void **state)
{
    (void)state;
    static char page[1 << 16];
    char path[4096], row[256];
    const char *root = getenv("GBT_SOURCE");
    if (root == NULL)
        skip();
    snprintf(path, sizeof path, "%s/docs/cameras.md", root);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    page[fread(page, 1, sizeof page - 1, file)] = '\0';
    fclose(file);
    for (int i = 0; i < gbt_camera_model_count(); i++) {
        const gbt_camera_model model = gbt_camera_model_at(i);
        const bool colmap = i < GBT_CAMERA_MODEL_COUNT;
        char number[16] = "-";
        if (colmap)
            snprintf(number, sizeof number, "%d", (int)model);
        snprintf(row, sizeof row, "\n| %s | %s | %s |", number, gbt_camera_model_name(model),
                 gbt_camera_param_names(model));
        if (strstr(page, row) == NULL)
            fail_msg("docs/cameras.md has no row%s", row);
    }
}

int main(void)
{
    const struct CMUnitTest fixed[] = {
        cmocka_unit_test(every_model_has_a_case),
        cmocka_unit_test(names_and_counts),
        cmocka_unit_test(the_page_has_the_list),
        cmocka_unit_test(projects_as_the_formula),
        cmocka_unit_test(pixels_come_back),
        cmocka_unit_test(rows_are_pixels),
        cmocka_unit_test(strong_lenses_come_back),
        cmocka_unit_test(directions_come_back),
        cmocka_unit_test(no_distortion_is_the_plain_model),
        cmocka_unit_test(nothing_beyond_the_fold),
        cmocka_unit_test(division_is_exact_behind),
        cmocka_unit_test(a_pole_ends_the_range),
        cmocka_unit_test(limits_are_inside),
        cmocka_unit_test(wild_parameters_stay_honest),
        cmocka_unit_test(resizing_keeps_rays),
        cmocka_unit_test(every_step_keeps_rays),
        cmocka_unit_test(shifting_keeps_rays),
        cmocka_unit_test(rolling_by_lines),
        cmocka_unit_test(parts_of_a_rolling_image),
        cmocka_unit_test(pixels_of_points),
        cmocka_unit_test(resizing_exact_numbers),
        cmocka_unit_test(half_fov),
        cmocka_unit_test(orthographic),
        cmocka_unit_test(continuous_at_zero),
        cmocka_unit_test(polynomial_roots),
    };
    enum { FIXED = sizeof fixed / sizeof fixed[0], BLIND = sizeof blind_cases / sizeof blind_cases[0] };
    struct CMUnitTest tests[FIXED + BLIND];
    memcpy(tests, fixed, sizeof fixed);
    for (size_t i = 0; i < BLIND; i++)
        tests[FIXED + i] = (struct CMUnitTest){.name = blind_cases[i].why,
                                               .test_func = sees_nothing,
                                               .initial_state = (void *)(uintptr_t)&blind_cases[i]};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
