/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/test_rays.c -- rays of every kind of shot against their formulas in double, and rays from a
   file. */
#include "base/camera_pose.h"
#include "base/near.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "exr_file.h"
#include "folder.h"
#include "trace/ray_file.h"

enum { W = 37, H = 23, COUNT = W * H };

/* A turned, shifted camera; its parameters suit the models that take fx fy cx cy. */
static gbt_camera camera_of(gbt_camera_model model)
{
    const double q[4] = {0.5, -0.5, 0.1, sqrt(0.49)};
    gbt_camera camera = {
        .model = model, .width = W, .height = H, .params = {30, 33, 18, 12}, .center = {1, -2, 3.5}};
    dquat_to_matrix(q, camera.rotation);
    return camera;
}

static ray_shot shot_of(gbt_camera_model model)
{
    const gbt_camera camera = camera_of(model);
    return ray_shot_of(&camera);
}

/* The last line is taken from another pose, half a radian and a unit away; the first from that of the camera.
 */
static void roll(ray_shot *shot, gbt_camera_shutter shutter)
{
    gbt_camera end = shot->camera;
    const int lines = shutter == GBT_CAMERA_SHUTTER_ROWS ? H : W;
    const double edge = 0.5 / (lines - 1);
    const double q[4] = {cos(0.25), sin(0.25) * 0.6, sin(0.25) * 0.8, 0};
    double turn[9];
    dquat_to_matrix(q, turn);
    for (int row = 0; row < 3; row++)
        dmat_apply_transposed(shot->camera.rotation, turn + 3 * row, end.rotation + 3 * row);
    end.center[0] += 0.6;
    end.center[1] -= 0.8;
    assert_true(camera_set_readout(&shot->camera, &end, shutter, -edge, 1 + edge, &shot->camera));
}

static void doubles(const float from[3], double to[3])
{
    for (int k = 0; k < 3; k++)
        to[k] = (double)from[k];
}

static void assert_ray(const ray_image *rays, int x, int y, const double origin[3], const double dir[3])
{
    const size_t at = (size_t)(W * y + x);
    for (int k = 0; k < 3; k++) {
        assert_near((double)ray_image_origin(rays, at)[k], (double)(float)origin[k], 2.4e-7);
        assert_near((double)rays->dir[3 * at + (size_t)k], dir[k], 6.1e-8);
    }
}

/* Without motion, aperture or a plane there is one origin, and the bits of ray_image_from_camera(). */
static void plain_shots_are_cameras(void **state)
{
    (void)state;
    static const gbt_camera_model models[] = {GBT_CAMERA_PINHOLE, GBT_CAMERA_FISHEYE, GBT_CAMERA_OPENCV};
    for (size_t m = 0; m < 3; m++) {
        ray_shot shot = shot_of(models[m]);
        ray_image a = {0}, b = {0};
        assert_int_equal(ray_shot_sample_count(&shot), 1);
        assert_ok(ray_image_from_camera(&shot.camera, &a, NULL));
        assert_ok(ray_image_from_shot(&shot, 0, &b, NULL));
        assert_true(a.common_origin && b.common_origin);
        assert_memory_equal(a.dir, b.dir, COUNT * 3 * sizeof *a.dir);
        /* A shutter that goes nowhere is none; one that goes ever so little gives every pixel its origin. */
        shot.camera.shutter = GBT_CAMERA_SHUTTER_ROWS;
        assert_ok(ray_image_from_shot(&shot, 0, &b, NULL));
        assert_true(b.common_origin);
        assert_memory_equal(a.dir, b.dir, COUNT * 3 * sizeof *a.dir);
        shot.camera.motion[0] = 1e-12;
        assert_ok(ray_image_from_shot(&shot, 0, &b, NULL));
        assert_false(b.common_origin);
        for (size_t i = 0; i < COUNT * 3; i++) {
            assert_near((double)a.dir[i], (double)b.dir[i], 6.1e-8);
            assert_near((double)b.origin[i], (double)a.origin[i % 3], 1e-6);
        }
        ray_image_free(&a);
        ray_image_free(&b);
    }
}

/* More lenses than are kept, of three sizes: always the bits of a lens seen for the first time. And two that
   take turns are kept, though their sizes differ. */
static void lenses_are_kept(void **state)
{
    (void)state;
    const ray_shot shot = shot_of(GBT_CAMERA_FISHEYE);
    ray_image kept = {0};
    for (int i = 0; i < 2 * (RAY_LENSES + 3); i++) {
        gbt_camera camera;
        ray_image fresh = {0};
        assert_true(gbt_camera_shifted(&shot.camera, 0.25 * (i % (RAY_LENSES + 3)), 0, &camera));
        camera.height -= i % 3;
        assert_ok(ray_image_from_camera(&camera, &kept, NULL));
        assert_ok(ray_image_from_camera(&camera, &fresh, NULL));
        assert_memory_equal(kept.dir, fresh.dir, ray_image_count(&fresh) * 3 * sizeof *fresh.dir);
        ray_image_free(&fresh);
    }
    ray_image_free(&kept);
    gbt_camera upright = shot.camera;
    upright.width = H;
    upright.height = W;
    for (int i = 0; i < 4; i++) {
        const double *wide = kept.lenses[0].dir, *high = kept.lenses[1].dir;
        assert_ok(ray_image_from_camera(i % 2 == 0 ? &shot.camera : &upright, &kept, NULL));
        assert_true(kept.lenses[0].dir == wide || i == 0);
        assert_true(kept.lenses[1].dir == high || i == 1);
    }
    assert_true(kept.lenses[1].dir != NULL && kept.lenses[2].dir == NULL);
    ray_image_free(&kept);
}

/* Pixels picked six apart, as of a photo of 1080 x 1920, are 36 lenses: none is computed twice. */
static void lenses_of_picked_pixels_are_kept(void **state)
{
    (void)state;
    enum { STEP = 6 };
    const double *dir[STEP * STEP];
    gbt_camera whole = shot_of(GBT_CAMERA_FISHEYE).camera;
    whole.width = 20 * STEP;
    whole.height = 15 * STEP;
    ray_image kept = {0};
    for (int i = 0; i < 2 * STEP * STEP; i++) {
        gbt_camera camera;
        const int phase = i % (STEP * STEP);
        assert_true(gbt_camera_every(&whole, STEP, phase % STEP, phase / STEP, &camera));
        assert_ok(ray_image_from_camera(&camera, &kept, NULL));
        if (i < STEP * STEP)
            dir[phase] = kept.lenses[phase].dir;
        assert_true(dir[phase] != NULL && kept.lenses[phase].dir == dir[phase]);
    }
    assert_null(kept.lenses[STEP * STEP].dir);
    ray_image_free(&kept);
}

static void orthographic(void **state)
{
    (void)state;
    const ray_shot shot = shot_of(GBT_CAMERA_ORTHOGRAPHIC);
    const gbt_camera *c = &shot.camera;
    ray_image rays = {0};
    assert_ok(ray_image_from_shot(&shot, 0, &rays, NULL));
    assert_false(rays.common_origin);
    float reach = 0;
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            const double u = (x + 0.5 - 18) / 30, v = (y + 0.5 - 12) / 33;
            double origin[3], made[3], dir[3];
            for (int k = 0; k < 3; k++) {
                origin[k] = c->center[k] + u * c->rotation[k] + v * c->rotation[3 + k];
                assert_true(rays.dir[3 * (W * y + x) + k] == (float)c->rotation[6 + k]); /* exact: the same
                                                                                            for all */
                reach = fmaxf(reach, fabsf(rays.origin[3 * (W * y + x) + k]));
            }
            assert_ray(&rays, x, y, origin, c->rotation + 6);
            assert_true(gbt_camera_ray(c, x + 0.5, y + 0.5, made, dir));
            assert_ray(&rays, x, y, made, dir);
        }
    assert_true(ray_image_reach(&rays) == reach);
    ray_image_free(&rays);
}

/* Line r is what a camera sees that stands at the pose between. */
static void rolling_shutter(void **state)
{
    (void)state;
    static const gbt_camera_model models[] = {GBT_CAMERA_PINHOLE, GBT_CAMERA_ORTHOGRAPHIC,
                                              GBT_CAMERA_FISHEYE};
    for (int m = 0; m < 3; m++)
        for (gbt_camera_shutter shutter = GBT_CAMERA_SHUTTER_ROWS; shutter <= GBT_CAMERA_SHUTTER_COLUMNS;
             shutter++) {
            ray_shot shot = shot_of(models[m]);
            const gbt_camera start = shot.camera;
            roll(&shot, shutter);
            ray_image rays = {0}, still = {0};
            assert_ok(ray_image_from_shot(&shot, 0, &rays, NULL));
            const int lines = shutter == GBT_CAMERA_SHUTTER_ROWS ? H : W;
            for (int line = 0; line < lines; line++) {
                /* The turn of half a radian about (0.6, 0.8, 0) in camera axes, in part. */
                const double t = (double)line / (lines - 1), half = 0.25 * t;
                const double q[4] = {cos(half), sin(half) * 0.6, sin(half) * 0.8, 0};
                double turn[9];
                gbt_camera at = start;
                dquat_to_matrix(q, turn);
                for (int row = 0; row < 3; row++)
                    dmat_apply_transposed(start.rotation, turn + 3 * row, at.rotation + 3 * row);
                at.center[0] += 0.6 * t;
                at.center[1] -= 0.8 * t;
                assert_ok(ray_image_from_camera(&at, &still, NULL));
                for (int i = 0; i < W + H - lines; i++) {
                    const int x = shutter == GBT_CAMERA_SHUTTER_ROWS ? i : line,
                              y = shutter == GBT_CAMERA_SHUTTER_ROWS ? line : i;
                    double origin[3], dir[3];
                    doubles(ray_image_origin(&still, (size_t)(W * y + x)), origin);
                    doubles(still.dir + 3 * (W * y + x), dir);
                    for (int k = 0; k < 3; k++) {
                        assert_near((double)rays.origin[3 * (W * y + x) + k], origin[k], 4.8e-7);
                        assert_near((double)rays.dir[3 * (W * y + x) + k], dir[k], 1.2e-7);
                    }
                }
            }
            ray_image_free(&rays);
            ray_image_free(&still);
        }
}

/* The way between two poses: any angle up to half a turn, any axis; the ends are the two cameras. */
static void poses_between(void **state)
{
    (void)state;
    static const double angles[] = {
        0, 1e-12, 1e-6, 0.3, 1.5707963267948966, 2, 3.1415, 3.14159265, 3.141592653589793};
    static const double axes[][3] = {{1, 0, 0},      {0, 1, 0},          {0, 0, 1},
                                     {0.6, -0.8, 0}, {0.48, 0.6, -0.64}, {-0.48, 0.6, 0.64}};
    for (size_t i = 0; i < sizeof angles / sizeof *angles; i++)
        for (size_t j = 0; j < sizeof axes / sizeof *axes; j++) {
            gbt_camera start = camera_of(GBT_CAMERA_PINHOLE), end = start;
            const double half = 0.5 * angles[i], q[4] = {cos(half), sin(half) * axes[j][0],
                                                         sin(half) * axes[j][1], sin(half) * axes[j][2]};
            double turn[9], rotation[9], center[3];
            dquat_to_matrix(q, turn);
            for (int row = 0; row < 3; row++)
                dmat_apply_transposed(start.rotation, turn + 3 * row, end.rotation + 3 * row);
            end.center[2] += 7;
            camera_motion motion;
            assert_true(camera_motion_prepare(&start, &end, &motion));
            assert_near(motion.angle, angles[i], 1e-9);
            camera_motion_at(&motion, 0, rotation, center);
            assert_memory_equal(rotation, start.rotation, sizeof rotation);
            camera_motion_at(&motion, 1, rotation, center);
            for (int k = 0; k < 9; k++)
                assert_near(rotation[k], end.rotation[k], 1e-9);
            assert_near(center[2], 10.5, 1e-15);
            camera_motion_at(&motion, 0.5, rotation, center); /* half the angle from both */
            double to_start = 0;
            for (int k = 0; k < 9; k++)
                to_start += rotation[k] * start.rotation[k];
            assert_near(to_start, 1 + 2 * cos(half), 1e-9);
            assert_near(center[2], 7, 1e-15);
        }
    gbt_camera good = camera_of(GBT_CAMERA_PINHOLE), bad = good;
    camera_motion motion;
    for (int k = 0; k < 3; k++)
        bad.rotation[k] = -bad.rotation[k]; /* a reflection */
    assert_false(camera_motion_prepare(&good, &bad, &motion));
    bad = good;
    bad.rotation[4] *= 1.1;
    assert_false(camera_motion_prepare(&bad, &good, &motion));
    bad = good;
    bad.center[1] = NAN;
    assert_false(camera_motion_prepare(&good, &bad, &motion));
}

/* All rays of a pixel meet where the ray through the middle is in focus, from points of the disc that fill it
   evenly. */
static void thin_lens(void **state)
{
    (void)state;
    static const gbt_camera_model models[] = {GBT_CAMERA_PINHOLE, GBT_CAMERA_FISHEYE,
                                              GBT_CAMERA_ORTHOGRAPHIC};
    static const int sample_counts[] = {1, 2, 7, 64};
    for (int m = 0; m < 3; m++)
        for (size_t n = 0; n < 4; n++) {
            ray_shot shot = shot_of(models[m]), middle = shot;
            const double radius = 0.25, focus = 6;
            const int samples = sample_counts[n];
            shot.aperture_radius = radius;
            shot.focus_distance = focus;
            shot.samples = samples;
            shot.seed = 5;
            assert_int_equal(ray_shot_sample_count(&shot), samples);
            ray_image rays = {0}, again = {0};
            double sum[3] = {0, 0, 0}, squares = 0;
            for (int s = 0; s < samples; s++) {
                assert_ok(ray_image_from_shot(&shot, s, &rays, NULL));
                for (int i = 0; i < COUNT; i++) {
                    double start[3], d[3], p[3], o[3], dir[3], shift[3], to[3], off[3];
                    assert_true(gbt_camera_ray(&middle.camera, i % W + 0.5, i / W + 0.5, o, d));
                    const double depth = models[m] == GBT_CAMERA_FISHEYE
                                             ? focus
                                             : focus / dvec_dot(d, shot.camera.rotation + 6);
                    doubles(ray_image_origin(&rays, (size_t)i), start);
                    doubles(rays.dir + 3 * i, dir);
                    for (int k = 0; k < 3; k++) {
                        p[k] = o[k] + depth * d[k];
                        to[k] = p[k] - start[k];
                        shift[k] = start[k] - o[k];
                        sum[k] += shift[k];
                    }
                    dvec_cross(to, dir, off);
                    assert_true(dvec_length(off) <= 1e-6 * focus);
                    assert_true(dvec_dot(to, dir) > 0);
                    assert_near(dvec_length(dir), 1, 2e-7);
                    assert_true(dvec_length(shift) <= radius * (1 + 3e-6));
                    /* The disc is across the axis, or across the ray when the focus is a sphere. */
                    assert_near(
                        dvec_dot(shift, models[m] == GBT_CAMERA_FISHEYE ? d : shot.camera.rotation + 6), 0,
                        1e-6);
                    squares += dvec_dot(shift, shift);
                }
            }
            const double rays_total = (double)samples * COUNT;
            for (int k = 0; k < 3; k++) /* 5 standard errors of unstratified samples: R / 2 per axis */
                assert_near(sum[k] / rays_total, 0, 5 * 0.5 * radius / sqrt(rays_total));
            assert_near(squares / rays_total, 0.5 * radius * radius,
                        5 * 0.29 * radius * radius / sqrt(rays_total));
            assert_ok(ray_image_from_shot(&shot, 0, &rays, NULL));
            shot.seed = 6;
            assert_ok(ray_image_from_shot(&shot, 0, &again, NULL));
            assert_memory_not_equal(rays.origin, again.origin, COUNT * 3 * sizeof *rays.origin);
            ray_image_free(&rays);
            ray_image_free(&again);
        }
}

/* Cut the disc into 4 sectors and 2 rings, of equal area: the 64 samples of a pixel are spread over them more
   evenly than by chance. */
static void samples_are_stratified(void **state)
{
    (void)state;
    gbt_camera camera = {.model = GBT_CAMERA_PINHOLE,
                         .width = W,
                         .height = H,
                         .params = {30, 33, 18, 12},
                         .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    ray_shot shot = ray_shot_of(&camera);
    shot.aperture_radius = 1;
    shot.focus_distance = 3;
    shot.samples = 64;
    ray_image rays = {0};
    static double share[COUNT][8];
    memset(share, 0, sizeof share);
    for (int s = 0; s < 64; s++) {
        assert_ok(ray_image_from_shot(&shot, s, &rays, NULL));
        for (int i = 0; i < COUNT; i++) {
            const double x = (double)rays.origin[3 * i], y = (double)rays.origin[3 * i + 1];
            const int ring = x * x + y * y > 0.5, sector = 2 * (x > y) + (x > -y);
            share[i][4 * ring + sector] += 1;
        }
    }
    double variance = 0;
    for (int i = 0; i < COUNT; i++)
        for (int bin = 0; bin < 8; bin++)
            variance += (share[i][bin] - 8) * (share[i][bin] - 8) / (8.0 * COUNT);
    assert_true(variance < 2.5); /* 64 independent points: 64 (1 / 8) (7 / 8) = 7 */
    ray_image_free(&rays);
}

static void same_bits_for_every_thread_count(void **state)
{
    (void)state;
    ray_shot shots[5];
    for (int i = 0; i < 5; i++)
        shots[i] = shot_of(i == 0   ? GBT_CAMERA_ORTHOGRAPHIC
                           : i == 4 ? GBT_CAMERA_OPENCV_FISHEYE
                                    : GBT_CAMERA_PINHOLE);
    roll(&shots[1], GBT_CAMERA_SHUTTER_ROWS);
    roll(&shots[2], GBT_CAMERA_SHUTTER_COLUMNS);
    roll(&shots[4], GBT_CAMERA_SHUTTER_ROWS);
    for (int i = 3; i < 5; i++) {
        shots[i].aperture_radius = 0.1;
        shots[i].focus_distance = 2;
    }
    for (int i = 0; i < 5; i++) {
        ray_image rays[4] = {{0}};
        for (int t = 0; t < 4; t++) {
            parallel_set_threads(t == 3 ? 8 : t + 1);
            assert_ok(ray_image_from_shot(&shots[i], ray_shot_sample_count(&shots[i]) - 1, &rays[t], NULL));
            assert_memory_equal(rays[0].dir, rays[t].dir, COUNT * 3 * sizeof(float));
            assert_memory_equal(rays[0].origin, rays[t].origin, COUNT * 3 * sizeof(float));
        }
        for (int t = 0; t < 4; t++)
            ray_image_free(&rays[t]);
    }
    parallel_set_threads(2);
}

/* A pixel without a ray has none, whatever the aperture. */
static void nothing_comes_from_nothing(void **state)
{
    (void)state;
    ray_shot shot = shot_of(GBT_CAMERA_FISHEYE);
    shot.camera.params[0] = shot.camera.params[1] = 4; /* the corners are beyond 180 degrees */
    shot.aperture_radius = 0.5;
    shot.focus_distance = 1;
    ray_image rays = {0};
    assert_ok(ray_image_from_shot(&shot, 3, &rays, NULL));
    size_t none = 0;
    for (size_t i = 0; i < COUNT; i++) {
        double d[3];
        const bool sees = gbt_camera_unproject(&shot.camera, (double)(i % W) + 0.5, (double)(i / W) + 0.5, d);
        const float *got = rays.dir + 3 * i;
        assert_true(sees == (got[0] != 0 || got[1] != 0 || got[2] != 0));
        none += !sees;
    }
    assert_true(none > 20 && none < COUNT / 2);
    ray_image_free(&rays);
}

static void bad_shots(void **state)
{
    (void)state;
    ray_shot bad[17];
    for (int i = 0; i < 17; i++) {
        bad[i] = shot_of(i == 9 ? GBT_CAMERA_ORTHOGRAPHIC : GBT_CAMERA_PINHOLE);
        bad[i].aperture_radius = 0.1;
        bad[i].focus_distance = 1;
    }
    bad[0].aperture_radius = -1;
    bad[1].aperture_radius = NAN;
    bad[2].aperture_radius = HUGE_VAL;
    bad[3].focus_distance = 0;
    bad[4].focus_distance = NAN;
    bad[5].samples = 0;
    bad[6].camera.motion[4] = NAN;
    bad[7].camera.center[1] = NAN;
    bad[8].camera.center[0] = 1.1e17;
    bad[9].camera.params[0] = 1e-17;
    bad[10].camera.rotation[3] = INFINITY;
    bad[11].camera.width = 0;
    bad[12].camera.model = (gbt_camera_model)99;
    bad[13].camera.shutter = (gbt_camera_shutter)3;
    for (int k = 0; k < 9; k++) { /* no rotations: twice one, none at all, a reflection */
        bad[14].camera.rotation[k] *= 2;
        bad[15].camera.rotation[k] = 0;
        bad[16].camera.rotation[k] *= k < 3 ? -1 : 1;
    }
    for (int i = 0; i < 17; i++) {
        ray_image rays = {0};
        gbt_error err = {0};
        assert_int_equal(ray_image_from_shot(&bad[i], 0, &rays, &err), GBT_ERR_ARGUMENT);
        assert_true(rays.dir == NULL && rays.origin == NULL && err.text[0] != '\0');
        assert_int_equal(ray_shot_check(&bad[i], NULL), GBT_ERR_ARGUMENT);
    }
    ray_shot good = shot_of(GBT_CAMERA_PINHOLE);
    ray_image rays = {0};
    assert_ok(ray_shot_check(&good, NULL));
    assert_int_equal(ray_image_from_shot(&good, 1, &rays, NULL), GBT_ERR_ARGUMENT); /* there is one sample */
    assert_int_equal(ray_image_from_shot(&good, -1, &rays, NULL), GBT_ERR_ARGUMENT);
}

static void memory_runs_out(void **state)
{
    (void)state;
    ray_shot shot = shot_of(GBT_CAMERA_FISHEYE);
    roll(&shot, GBT_CAMERA_SHUTTER_ROWS);
    shot.aperture_radius = 0.1;
    shot.focus_distance = 1;
    gbt_status status = GBT_ERR_NO_MEMORY;
    long k = 0;
    for (; status != GBT_OK && k < 20; k++) {
        ray_image rays = {0};
        gbt_error err = {0};
        mem_fail_after(k);
        status = ray_image_from_shot(&shot, 0, &rays, &err);
        mem_fail_after(-1);
        assert_true(status == GBT_OK ||
                    (status == GBT_ERR_NO_MEMORY && err.text[0] != '\0' && rays.dir == NULL));
        ray_image_free(&rays);
    }
    assert_true(status == GBT_OK && k == 6);
}

/* ---- rays from a file ---- */

/* Channel k of pixel i of a file, before it is disturbed. */
static float value_of(int i, int k)
{
    return k < 3 ? 1000 + 0.25f * (float)i + (float)k : (float)((i * 7 + k * 5) % 11 - 5) + 0.5f;
}

static void rays_of_a_file(void **state)
{
    (void)state;
    /* Alphabetical, as the format wants; slot[c]: what channel c holds. */
    static const struct {
        const char *names[8];
        int count, slot[8];
    } rows[] = {
        {{"dx", "dy", "dz", "ox", "oy", "oz"}, 6, {3, 4, 5, 0, 1, 2}},
        {{"Direction.X", "Direction.Y", "Direction.Z", "Origin.X", "Origin.Y", "Origin.Z"},
         6,
         {3, 4, 5, 0, 1, 2}},
        {{"A", "dir.x", "dir.y", "dir.z", "o.x", "o.y", "o.z", "weight"}, 8, {6, 3, 4, 5, 0, 1, 2, 7}},
        {{"c1", "c2", "c3", "c4", "c5", "c6"}, 6, {0, 1, 2, 3, 4, 5}},
    };
    const double origin[3] = {999.5, -3, 1e-3};
    const char *path = in_folder("r.exr");
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        enum { FW = 5, FH = 3 };
        float pixels[FW * FH * 8];
        for (int i = 0; i < FW * FH; i++)
            for (int c = 0; c < rows[r].count; c++)
                pixels[i * rows[r].count + c] =
                    i == 4 && rows[r].slot[c] >= 3 ? 0 : value_of(i, rows[r].slot[c]);
        exr_write(path, FW, FH, rows[r].count, rows[r].names, 2, pixels);
        ray_image rays = {0}, copy = {0};
        gbt_error err = {0};
        if (ray_image_read(path, origin, &rays, &err) != GBT_OK)
            fail_msg("%s", err.text);
        assert_true(rays.width == FW && rays.height == FH && !rays.common_origin);
        for (int i = 0; i < FW * FH; i++) {
            double d[3];
            for (int k = 0; k < 3; k++) {
                assert_true(rays.origin[3 * i + k] == (float)((double)value_of(i, k) - origin[k]));
                d[k] = i == 4 ? 0 : (double)value_of(i, 3 + k);
            }
            dvec_normalize(d);
            for (int k = 0; k < 3; k++)
                assert_true(rays.dir[3 * i + k] == (float)d[k]);
        }
        const gbt_camera none = {0};
        ray_shot shot = ray_shot_of(&none);
        shot.given = &rays;
        assert_ok(ray_image_from_shot(&shot, 0, &copy, NULL));
        assert_memory_equal(copy.dir, rays.dir, FW * FH * 3 * sizeof(float));
        assert_memory_equal(copy.origin, rays.origin, FW * FH * 3 * sizeof(float));
        ray_image_free(&rays);
        ray_image_free(&copy);
    }
}

/* The limit of an origin is that of each coordinate. */
static void sound_rays(void **state)
{
    (void)state;
    static const struct {
        float origin[3], dir[3];
        bool sound;
    } rows[] = {{{0, 0, 0}, {0, 0, 1}, true},         {{9e16f, -9e16f, 9e16f}, {0.6f, 0, -0.8f}, true},
                {{0, -1.1e17f, 0}, {0, 0, 1}, false}, {{0, 0, NAN}, {0, 0, 1}, false},
                {{0, 0, 0}, {0, 0, 0}, false},        {{0, 0, 0}, {0, 1.1f, 0}, false},
                {{0, 0, 0}, {NAN, 0, 1}, false},      {{INFINITY, 0, 0}, {0, 0, 1}, false}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_int_equal(ray_is_sound(rows[i].origin, rows[i].dir), rows[i].sound);
}

static void files_that_are_not_rays(void **state)
{
    (void)state;
    static const char *const good[] = {"dx", "dy", "dz", "ox", "oy", "oz"},
                             *const five[] = {"dx", "dy", "dz", "ox", "oy"}, *const twice[] = {"d.x", "dx",
                                                                                               "dy",  "ox",
                                                                                               "oy",  "oz"},
                             *const rgb[] = {"B", "G", "R"};
    static const struct {
        const char *text;
        const char *const *names;
        int count, type;
        float value;
        int channel;
    } rows[] = {
        {"pixel (1, 0): ray (", good, 6, 2, NAN, 0},
        {"pixel (1, 0): ray (", good, 6, 2, INFINITY, 4},
        {"pixel (1, 0): ray (", good, 6, 2, -INFINITY, 2},
        {"pixel (1, 0): ray (", good, 6, 2, 2e17f, 5},
        {"5 channels, 5 of them named as rays", five, 5, 2, 1, 0},
        {"name the same thing", twice, 6, 2, 1, 0},
        {"3 channels, 0 of them named as rays", rgb, 3, 2, 1, 0},
        {"wanted an EXR of 32-bit floats", good, 6, 1, 1, 0},
    };
    const double origin[3] = {0, 0, 0};
    const char *path = in_folder("r.exr");
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        float pixels[2 * 2 * 6];
        for (int i = 0; i < 24; i++)
            pixels[i] = 1;
        pixels[rows[r].count + rows[r].channel] = rows[r].value;
        exr_write(path, 2, 2, rows[r].count, rows[r].names, rows[r].type, pixels);
        ray_image rays = {0};
        gbt_error err = {0};
        const gbt_status status = ray_image_read(path, origin, &rays, &err);
        if (status != GBT_ERR_FORMAT || strstr(err.text, rows[r].text) == NULL ||
            strncmp(err.text, path, strlen(path)) != 0)
            fail_msg("row %zu: %d %s", r, (int)status, err.text);
        assert_true(rays.dir == NULL && rays.origin == NULL);
    }
    ray_image rays = {0};
    gbt_error err = {0};
    assert_int_equal(ray_image_read("/nowhere/rays.exr", origin, &rays, &err), GBT_ERR_IO);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plain_shots_are_cameras),
        cmocka_unit_test(orthographic),
        cmocka_unit_test(rolling_shutter),
        cmocka_unit_test(poses_between),
        cmocka_unit_test(lenses_are_kept),
        cmocka_unit_test(lenses_of_picked_pixels_are_kept),
        cmocka_unit_test(thin_lens),
        cmocka_unit_test(samples_are_stratified),
        cmocka_unit_test(same_bits_for_every_thread_count),
        cmocka_unit_test(nothing_comes_from_nothing),
        cmocka_unit_test(bad_shots),
        cmocka_unit_test(memory_runs_out),
        cmocka_unit_test(rays_of_a_file),
        cmocka_unit_test(sound_rays),
        cmocka_unit_test(files_that_are_not_rays),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
