/* SPDX-License-Identifier: Apache-2.0 */
/* tests/render/test_camera_path.c -- films: ways around and through cameras, path files, and pictures to
   ffmpeg and back. */
#include <signal.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/near.h"
#include "base/vec.h"
#include "folder.h"
#include "render/camera_path.h"
#include "render/camera_path_file.h"
#include "render/video.h"
#include "train/camera_sees.h"

#define PI 3.14159265358979323846
static const char *file_path;
static const double none[3] = {0, 0, 0};
static const orbit_shape as_cameras = {.radius = 0, .height = (double)NAN};

static int set_up(void **state)
{
    const int failed = folder_make(state);
    file_path = in_folder("path.json");
    return failed;
}

/* ---- cameras ---- */

static gbt_camera looking(double x, double y, double z, const double target[3])
{
    const double up[3] = {0, -1, 0}, at[3] = {x, y, z};
    gbt_camera c = {.model = GBT_CAMERA_PINHOLE, .width = 80, .height = 60, .params = {60, 60, 40, 30}};
    assert_true(gbt_camera_look_at(at, target, up, &c));
    return c;
}

/** On a circle of radius 4, 1.5 above (y is down) the target, from one angle to another in degrees. */
static void ring(gbt_camera *out, size_t count, double from, double to, const double target[3])
{
    for (size_t i = 0; i < count; i++) {
        const double angle =
            (from + (to - from) * (double)i / (double)(count > 1 ? count - 1 : 1)) * PI / 180;
        out[i] = looking(target[0] + 4 * cos(angle), target[1] - 1.5, target[2] + 4 * sin(angle), target);
    }
}

static double angle_between(const gbt_camera *a, const gbt_camera *b)
{
    double trace = 0;
    for (int k = 0; k < 9; k++)
        trace += a->rotation[k] * b->rotation[k];
    return acos(fmin(fmax((trace - 1) / 2, -1), 1));
}

static double distance_between(const gbt_camera *a, const gbt_camera *b)
{
    const double way[3] = {b->center[0] - a->center[0], b->center[1] - a->center[1],
                           b->center[2] - a->center[2]};
    return dvec_length(way);
}

static void assert_rotation(const gbt_camera *c)
{
    double cross[3];
    dvec_cross(c->rotation, c->rotation + 3, cross);
    for (int k = 0; k < 3; k++) {
        assert_near(dvec_length(c->rotation + 3 * k), 1, 1e-12);
        assert_near(cross[k], c->rotation[6 + k], 1e-12);
    }
}

static camera_group group_of(const gbt_camera *cameras, size_t count)
{
    camera_group g;
    assert_ok(camera_group_make(cameras, count, NULL, 0, &g, &assert_ok_err_));
    return g;
}

static void what_cameras_look_at(void **state)
{
    (void)state;
    const double target[3] = {10, -3, 5};
    gbt_camera cameras[12];
    ring(cameras, 12, 0, 330, target);
    camera_group g = group_of(cameras, 12);
    for (int k = 0; k < 3; k++) {
        assert_near(g.focus[k], target[k], 1e-9);
        assert_near(g.up[k], k == 1 ? -1 : 0, 1e-9);
    }
    assert_near(g.distance, sqrt(16 + 2.25), 1e-9);
    assert_near(g.lens.params[0], 60, 1e-9);
    const gbt_camera wide = camera_group_lens(&g, 320, 120), tall = camera_group_lens(&g, 30, 400);
    assert_near(wide.params[0], 120, 1e-9); /* the shorter side sees as much */
    assert_near(tall.params[1], 30, 1e-9);
    assert_near(tall.params[3], 200, 0);
}

/** All look along z: the axes never meet, the points say how deep. */
static void parallel_cameras(void **state)
{
    (void)state;
    gbt_camera cameras[5];
    for (int i = 0; i < 5; i++) {
        const double target[3] = {i, 0, 1};
        cameras[i] = looking(i, 0, 0, target);
    }
    const float points[12] = {0, 0, 3, 1, 0, 7, 2, 0, 8, 0, 0, -50};
    camera_group g;
    assert_ok(camera_group_make(cameras, 5, points, 4, &g, &assert_ok_err_));
    assert_near(g.focus[0], 2, 1e-9);
    assert_near(g.focus[2], 7, 1e-6);
    assert_ok(camera_group_make(cameras, 5, NULL, 0, &g, &assert_ok_err_)); /* nothing to go by: the local
                                                                               origin */
    assert_near(g.focus[2], 0, 0);
    assert_true(g.distance > 0);
}

/* ---- around ---- */

/** They look all around from one place, in a hand: their axes meet there, by chance. */
static void a_head_looks_at_what_is_around(void **state)
{
    (void)state;
    gbt_camera cameras[12];
    float points[40][3];
    for (int i = 0; i < 12; i++) {
        const double angle = i * PI / 6, x = 1e-3 * cos(5 * angle), z = 1e-3 * sin(7 * angle);
        cameras[i] = looking(x, 0, z, (const double[3]){x + cos(angle), 0, z + sin(angle)});
    }
    for (int i = 0; i < 40; i++) {
        points[i][0] = 3 * cosf(0.157f * (float)i);
        points[i][1] = 0.1f * (float)(i % 3 - 1);
        points[i][2] = 3 * sinf(0.157f * (float)i);
    }
    camera_group g;
    assert_ok(camera_group_make(cameras, 12, points[0], 40, &g, &assert_ok_err_));
    assert_near(g.distance, 3, 0.1);
}

/** Cameras on a line, and few of them, lie in no plane of their own: up is what they say. */
static void a_line_has_no_plane(void **state)
{
    (void)state;
    for (int count = 2; count <= 12; count += count == 3 ? 9 : 1) {
        gbt_camera cameras[12];
        for (int i = 0; i < count; i++) {
            const double bend = count == 3 && i == 1 ? 0.3 : 1e-9 * (i % 2);
            cameras[i] = looking(0.3 * i, 0.2 * i + bend, -0.1 * i - bend, (const double[3]){0, 0, 5});
        }
        double mean[3] = {0};
        for (int i = 0; i < count; i++)
            for (int k = 0; k < 3; k++)
                mean[k] -= cameras[i].rotation[3 + k];
        dvec_normalize(mean);
        const camera_group g = group_of(cameras, (size_t)count);
        for (int k = 0; k < 3; k++)
            assert_near(g.up[k], mean[k], 1e-9);
    }
}

static void closed_orbit(void **state)
{
    (void)state;
    const double target[3] = {1, 2, 3};
    gbt_camera cameras[12];
    ring(cameras, 12, 0, 330, target);
    const camera_group g = group_of(cameras, 12);
    camera_path path;
    assert_ok(camera_path_orbit(cameras, 12, &g, &g.lens, &as_cameras, 90, &path, &assert_ok_err_));
    assert_int_equal(path.count, 90);
    assert_near(distance_between(&path.shots[0].camera, &cameras[0]), 0, 1e-9);
    const double step = 2 * (4 * sin(PI / 90));
    for (size_t i = 0; i < 90; i++) {
        const gbt_camera *c = &path.shots[i].camera;
        assert_rotation(c);
        assert_near(distance_between(c, &path.shots[(i + 1) % 90].camera), step, 1e-9); /* the last goes on to
                                                                                           the first */
        const double way[3] = {target[0] - c->center[0], target[1] - c->center[1], target[2] - c->center[2]};
        assert_near(dvec_dot(way, c->rotation + 6), dvec_length(way), 1e-9);
        assert_true(c->rotation[4] > 0); /* down stays down */
    }
    camera_path_free(&path);
}

/** Half a circle of cameras: the way stays on it, and comes back. */
static void orbit_of_an_arc(void **state)
{
    (void)state;
    gbt_camera cameras[19];
    ring(cameras, 19, 30, 210, none);
    const camera_group g = group_of(cameras, 19);
    camera_path path;
    assert_ok(camera_path_orbit(cameras, 19, &g, &g.lens, &as_cameras, 100, &path, &assert_ok_err_));
    double least = 1e9, most = -1e9;
    for (size_t i = 0; i < 100; i++) {
        const gbt_camera *c = &path.shots[i].camera;
        double angle = atan2(c->center[2], c->center[0]) * 180 / PI;
        if (angle < -90)
            angle += 360;
        least = fmin(least, angle);
        most = fmax(most, angle);
        assert_near(distance_between(c, &path.shots[(100 - i) % 100].camera), 0, 1e-9); /* back as it came */
    }
    assert_near(least, 30, 1e-6);
    assert_near(most, 210, 1e-6);
    camera_path_free(&path);
    const camera_group alone = group_of(cameras, 1); /* one camera: it looks at the origin, and sways */
    assert_ok(camera_path_orbit(cameras, 1, &alone, &alone.lens, &as_cameras, 7, &path, &assert_ok_err_));
    for (size_t i = 0; i < 7; i++)
        assert_rotation(&path.shots[i].camera);
    camera_path_free(&path);
}

/** A ring that rises: the way follows it. */
static void orbit_follows_the_cameras(void **state)
{
    (void)state;
    gbt_camera cameras[72];
    for (int i = 0; i < 72; i++) {
        const double angle = i * PI / 36;
        cameras[i] = looking(4 * cos(angle), -2 - cos(angle), 4 * sin(angle), none);
    }
    const camera_group g = {.up = {0, -1, 0}, .focus = {0, 0, 0}, .distance = 4, .lens = cameras[0]};
    camera_path path;
    assert_ok(camera_path_orbit(cameras, 72, &g, &g.lens, &as_cameras, 36, &path, &assert_ok_err_));
    for (int i = 0; i < 36; i++) {
        const double *c = path.shots[i].camera.center;
        assert_near(hypot(c[0], c[2]), 4, 1e-9);
        assert_near(c[1], -2 - cos(atan2(c[2], c[0])), 0.1); /* smoothed over 20 degrees */
    }
    assert_true(path.shots[0].camera.center[1] < -2.9 && path.shots[18].camera.center[1] > -1.1);
    camera_path_free(&path);
}

/** Given radius and height, at every angle. */
static void orbit_of_a_shape(void **state)
{
    (void)state;
    gbt_camera cameras[12];
    ring(cameras, 12, 0, 330, none);
    const camera_group g = group_of(cameras, 12);
    const orbit_shape low = {.radius = 2.5, .height = -0.5};
    camera_path path;
    assert_ok(camera_path_orbit(cameras, 12, &g, &g.lens, &low, 40, &path, &assert_ok_err_));
    for (size_t i = 0; i < 40; i++) {
        const double *c = path.shots[i].camera.center;
        assert_near(hypot(c[0], c[2]), 2.5, 1e-9);
        assert_near(c[1], 0.5, 1e-9); /* y is down */
    }
    camera_path_free(&path);
}

/** A head before a wall: axes of view meet in the wall, and what sticks out left the picture at the ends of
    the arc. */
static void orbit_shows_what_most_see(void **state)
{
    (void)state;
    enum { HEAD = 300, WALL = 100, CAMERAS = 21 };
    const double wall[3] = {0, 0, 0.6};
    gbt_camera cameras[CAMERAS];
    ring(cameras, CAMERAS, 210, 330, wall); /* z < 0.6 */
    float points[3 * (HEAD + WALL + 50)];
    for (size_t i = 0; i < HEAD; i++) /* a cylinder from the wall towards the cameras */
        points[3 * i] = (float)(0.8 * cos(0.7 * (double)i)),
                   points[3 * i + 1] = (float)(0.8 * sin(0.7 * (double)i)),
                   points[3 * i + 2] = (float)(0.6 - 1.8 * (double)i / HEAD);
    for (size_t i = HEAD; i < HEAD + WALL; i++) {
        points[3 * i] = (float)(0.1 * (double)(i % 10) - 0.5);
        points[3 * i + 1] = (float)(0.01 * (double)i - 3.5);
        points[3 * i + 2] = 0.6f;
    }
    for (size_t i = HEAD + WALL; i < HEAD + WALL + 50; i++) { /* far to the side: in few pictures */
        points[3 * i] = 4 + 0.01f * (float)i;
        points[3 * i + 1] = 0;
        points[3 * i + 2] = 0.6f;
    }
    shared_points shared;
    assert_ok(shared_points_find(cameras, CAMERAS, points, HEAD + WALL + 50, &shared, &assert_ok_err_));
    assert_true(shared.count >= HEAD && shared.count <= HEAD + WALL);
    camera_group g;
    assert_ok(camera_group_make(cameras, CAMERAS, points, HEAD + WALL + 50, &g, &assert_ok_err_));
    assert_near(g.focus[2], 0.6, 0.01);
    camera_path path;
    gbt_camera lens = camera_group_lens(&g, 60, 80);
    lens.params[0] *= 1.3;
    lens.params[1] *= 1.3; /* too narrow for the head */
    assert_ok(camera_path_orbit(cameras, CAMERAS, &g, &lens, &as_cameras, 24, &path, &assert_ok_err_));
    const double before = path.shots[0].camera.params[0];
    assert_ok(camera_path_show(&path, &shared, &assert_ok_err_));
    assert_true(path.shots[0].camera.params[0] < 0.95 * before);
    for (size_t i = 0; i < 24; i++) {
        const gbt_camera *c = &path.shots[i].camera;
        size_t outside = 0;
        assert_near(c->params[0], path.shots[0].camera.params[0], 0); /* one lens for the film */
        for (size_t k = 0; k < shared.count; k++)
            outside += !camera_sees(c, shared.position + 3 * k, NULL);
        assert_true(outside * 100 <= shared.count);
    }
    camera_path_free(&path);
    shared_points_free(&shared);
    /* Too few, and cameras that look apart: nothing is shared. */
    assert_ok(shared_points_find(cameras, CAMERAS, points, 10, &shared, &assert_ok_err_));
    assert_int_equal(shared.count, 0);
    shared_points_free(&shared);
    for (int i = 0; i < CAMERAS; i++) {
        const double angle = 2 * PI * i / CAMERAS, target[3] = {cos(angle), 0, sin(angle)};
        cameras[i] = looking(0, 0, 0, target);
    }
    for (size_t i = 0; i < HEAD; i++) {
        points[3 * i] = (float)(3 * cos(0.1 * (double)i));
        points[3 * i + 2] = (float)(3 * sin(0.1 * (double)i));
    }
    assert_ok(shared_points_find(cameras, CAMERAS, points, HEAD, &shared, &assert_ok_err_));
    assert_int_equal(shared.count, 0);
    shared_points_free(&shared);
}

/** Photos that look up from everywhere make a film that does; a place that was asked for is in the middle. */
static void orbit_looks_as_the_cameras(void **state)
{
    (void)state;
    const double above[3] = {0, -2, 0};
    gbt_camera cameras[24];
    for (int i = 0; i < 24; i++)
        cameras[i] = looking(4 * cos(i * PI / 12), -0.5, 4 * sin(i * PI / 12), above);
    const camera_group g = {.up = {0, -1, 0}, .focus = {0, 0, 0}, .distance = 4, .lens = cameras[0]};
    const orbit_shape there = {.height = (double)NAN, .at_focus = true};
    camera_path paths[2];
    assert_ok(camera_path_orbit(cameras, 24, &g, &g.lens, &as_cameras, 24, &paths[0], &assert_ok_err_));
    assert_ok(camera_path_orbit(cameras, 24, &g, &g.lens, &there, 24, &paths[1], &assert_ok_err_));
    for (int i = 0; i < 24; i++) {
        const double *up = paths[0].shots[i].camera.rotation + 6,
                     *level = paths[1].shots[i].camera.rotation + 6;
        assert_near(up[1] / hypot(up[0], up[2]), -1.5 / 4, 0.05);
        assert_near(level[1] / hypot(level[0], level[2]), 0.5 / 4, 1e-6);
    }
    for (int i = 0; i < 2; i++)
        camera_path_free(&paths[i]);
}

/* ---- through ---- */

enum { KEYS = 9, FRAMES = 2001 };

static void through_all_keys(void **state)
{
    (void)state;
    const double target[3] = {0, 0, 20};
    gbt_camera keys[KEYS];
    for (int i = 0; i < KEYS; i++) {
        keys[i] = looking(3 * i + (i % 3), (i * 5) % 4, (i * i) % 7, target); /* uneven steps */
        keys[i].params[0] = keys[i].params[1] = 60 + i;
    }
    const double turn_length = 5;
    camera_path path;
    assert_ok(camera_path_through(keys, KEYS, turn_length, FRAMES, &path, &assert_ok_err_));
    double step[FRAMES], mean = 0;
    for (int i = 0; i + 1 < FRAMES; i++) {
        const gbt_camera *a = &path.shots[i].camera, *b = &path.shots[i + 1].camera;
        assert_rotation(a);
        step[i] = hypot(distance_between(a, b), turn_length * angle_between(a, b));
        mean += step[i] / (FRAMES - 1);
        if (i > 0) { /* no corners: the way turns little from step to step */
            const gbt_camera *before = &path.shots[i - 1].camera;
            const double came[3] = {a->center[0] - before->center[0], a->center[1] - before->center[1],
                                    a->center[2] - before->center[2]};
            const double goes[3] = {b->center[0] - a->center[0], b->center[1] - a->center[1],
                                    b->center[2] - a->center[2]};
            assert_true(dvec_dot(came, goes) > 0.98 * dvec_length(came) * dvec_length(goes));
        }
    }
    for (int i = 0; i + 1 < FRAMES; i++)
        assert_near(step[i], mean, 0.02 * mean);
    assert_near(distance_between(&path.shots[0].camera, &keys[0]), 0, 1e-9);
    assert_near(distance_between(&path.shots[FRAMES - 1].camera, &keys[KEYS - 1]), 0, 1e-6);
    for (int k = 0; k < KEYS; k++) {
        size_t nearest = 0;
        for (size_t i = 1; i < FRAMES; i++)
            if (distance_between(&path.shots[i].camera, &keys[k]) <
                distance_between(&path.shots[nearest].camera, &keys[k]))
                nearest = i;
        const gbt_camera *c = &path.shots[nearest].camera;
        assert_true(hypot(distance_between(c, &keys[k]), turn_length * angle_between(c, &keys[k])) <
                    0.6 * mean + 1e-9);
        assert_near(c->params[0], keys[k].params[0], 0.05);
    }
    camera_path_free(&path);
}

/** 1e-9 of what keys look at is more than a unit. */
static void through_keys_far_away(void **state)
{
    (void)state;
    const double target[3] = {0, 0, 4e9};
    const gbt_camera keys[2] = {looking(0, 0, 0, target), looking(2e9, 0, 0, target)};
    camera_path path;
    assert_ok(camera_path_through(keys, 2, 4e9, 3, &path, &assert_ok_err_));
    assert_near(distance_between(&path.shots[0].camera, &keys[0]), 0, 1);
    assert_near(distance_between(&path.shots[2].camera, &keys[1]), 0, 1);
    camera_path_free(&path);
}

/** Two ways of writing the same turn, a turn on the spot, keys that repeat. */
static void turning_on_the_spot(void **state)
{
    (void)state;
    gbt_camera keys[8];
    for (int i = 0; i < 8; i++) {
        /* each twice; quaternions change their signs on the way */
        const double angle = (i / 2) * 170 * PI / 180, target[3] = {sin(angle), 0, cos(angle)};
        keys[i] = looking(0, 0, 0, target);
    }
    camera_path path;
    assert_ok(camera_path_through(keys, 8, 1, 103, &path, &assert_ok_err_));
    double whole = 0;
    for (int i = 0; i + 1 < 103; i++) {
        const double turn = angle_between(&path.shots[i].camera, &path.shots[i + 1].camera);
        assert_near(turn, 3 * 170 * PI / 180 / 102, 0.25 * turn);
        whole += turn;
    }
    assert_true(whole < 1.05 * 3 * 170 * PI / 180); /* the short way round, each time */
    camera_path_free(&path);
    assert_ok(camera_path_through(keys, 2, 1, 3, &path, &assert_ok_err_)); /* one and the same */
    assert_memory_equal(path.shots[2].camera.center, keys[0].center, sizeof keys[0].center);
    camera_path_free(&path);
    assert_ok(camera_path_through(keys, 8, 1, 1, &path, &assert_ok_err_));
    assert_near(angle_between(&path.shots[0].camera, &keys[0]), 0, 1e-7);
    camera_path_free(&path);
}

/** Two fields of view from one place, and back. */
static void zooming_on_the_spot(void **state)
{
    (void)state;
    const double target[3] = {0, 0, 1};
    gbt_camera keys[3] = {looking(0, 0, 0, target), looking(0, 0, 0, target), looking(0, 0, 0, target)};
    keys[1].params[0] = keys[1].params[1] = 120;
    camera_path path;
    assert_ok(camera_path_through(keys, 3, 5, 9, &path, &assert_ok_err_));
    for (int i = 0; i < 9; i++) {
        const gbt_camera *c = &path.shots[i].camera;
        assert_near(c->params[0], 60 * exp2((i < 4 ? i : 8 - i) / 4.0), 1e-6); /* even ratios */
        assert_near(c->params[1], c->params[0], 0);
        assert_near(distance_between(c, &keys[0]), 0, 1e-12);
        assert_near(angle_between(c, &keys[0]), 0, 1e-6);
    }
    camera_path_free(&path);
}

/** Along x, a zoom, along y: the moves around it do not carry the camera away while it zooms. */
static void zooming_between_moves(void **state)
{
    (void)state;
    const gbt_camera at = looking(0, 0, 0, (const double[3]){0, 0, 1});
    gbt_camera keys[4] = {at, at, at, at};
    keys[1].center[0] = keys[2].center[0] = keys[3].center[0] = keys[3].center[1] = 1;
    keys[2].params[0] = keys[2].params[1] = keys[3].params[0] = keys[3].params[1] = 120;
    camera_path path;
    assert_ok(camera_path_through(keys, 4, 1, 101, &path, &assert_ok_err_));
    int zooming = 0;
    for (int i = 0; i < 101; i++) {
        const gbt_camera *c = &path.shots[i].camera;
        const bool zooms = c->params[0] > 60 + 1e-6 && c->params[0] < 120 - 1e-6;
        zooming += zooms;
        assert_near(c->center[0], zooms ? 1 : fmin(c->center[0], 1), 1e-9);
        assert_near(c->center[1], c->params[0] < 120 - 1e-6 ? 0 : fmax(c->center[1], 0), 1e-9);
        assert_near(c->center[1] * (1 - c->center[0]), 0, 1e-9);
    }
    assert_true(zooming > 20); /* of a way of 1 + log 2 + 1 */
    camera_path_free(&path);
}

static void order_to_go_through(void **state)
{
    (void)state;
    static const int mixed[10] = {0, 7, 3, 9, 1, 5, 8, 2, 6, 4}; /* photos whose names say nothing */
    gbt_camera keys[10], known[10];
    ring(known, 10, 0, 90, none);
    for (int i = 0; i < 10; i++)
        keys[i] = known[mixed[i]];
    assert_ok(camera_path_order(keys, 10, 1, &assert_ok_err_));
    for (int i = 0; i < 10; i++)
        assert_near(distance_between(&keys[i], &known[i]), 0, 0);
    const gbt_camera swap =
        keys[4]; /* nearly in order: names win, though the nearest would be a little shorter */
    keys[4] = keys[5];
    keys[5] = swap;
    assert_ok(camera_path_order(keys, 10, 1, &assert_ok_err_));
    assert_near(distance_between(&keys[4], &known[5]), 0, 0);
}

/* ---- files ---- */

static camera_path read_good(const char *text, const double origin[3], size_t frames)
{
    camera_path path;
    gbt_error err = {0};
    write_text(file_path, text);
    if (camera_path_file_read(file_path, origin, frames, &path, &err) != GBT_OK)
        fail_msg("%s: %s", text, err.text);
    return path;
}

#define COMMON "\"width\": 64, \"height\": 32, \"up\": [0, -1, 0], \"fov_x_deg\": 90"
#define TWO                                                                                                  \
    "[{\"origin\": [0, 0, 0], \"target\": [0, 0, 5]}, {\"origin\": [4, 0, 0], \"target\": [4, 0, 5], "       \
    "\"fov_x_deg\": 60}]"

static void our_file(void **state)
{
    (void)state;
    const double shift[3] = {1, 2, 3};
    camera_path p = read_good("{\"schema\": 1, \"fps\": 24, " COMMON ", \"cameras\": " TWO "}", shift, 0);
    assert_int_equal(p.count, 2);
    assert_near(p.fps, 24, 0);
    assert_near(p.shots[1].camera.center[0], 3, 1e-12);
    assert_near(p.shots[1].camera.center[2], -3, 1e-12);
    assert_near(p.shots[0].camera.params[0], 32, 1e-12);
    assert_near(p.shots[1].camera.params[0], 32 / tan(PI / 6), 1e-12); /* its own field of view over the
                                                                          common one */
    camera_path_free(&p);
    p = read_good("{\"frames\": 5, " COMMON ", \"cameras\": " TWO "}", none, 0);
    assert_int_equal(p.count, 5);
    for (int i = 0; i < 5; i++)
        assert_near(p.shots[i].camera.center[0], i, 1e-6);
    assert_near(p.shots[2].camera.params[0], 32 / sqrt(tan(PI / 6)), 1e-6);
    camera_path_free(&p);
    p = read_good("{" COMMON ", \"origin\": [0, 0, 0], \"target\": [0, 0, 5], \"cameras\": [{}, "
                  "{\"fov_x_deg\": 60}]}",
                  none, 3); /* at one place */
    for (int i = 0; i < 3; i++)
        assert_near(p.shots[i].camera.params[0], 32 * pow(tan(PI / 6), -i / 2.0), 1e-6);
    camera_path_free(&p);
    p = read_good("{\"frames\": 5, " COMMON ", \"cameras\": " TWO "}", none, 3); /* the caller wins */
    assert_int_equal(p.count, 3);
    assert_near(p.fps, 0, 0);
    camera_path_free(&p);
    p = read_good("{" COMMON ", \"aperture\": 0.5, \"focus\": 3, \"cameras\": " TWO "}", none,
                  0); /* all that a camera file can do */
    assert_near(p.shots[1].aperture_radius, 0.5, 0);
    camera_path_free(&p);
}

#define NERF "\"render_width\": 80, \"render_height\": 60, \"fps\": 12, \"seconds\": 1"
#define AT_123 "\"camera_to_world\": [1, 0, 0, 1,  0, 1, 0, 2,  0, 0, 1, 3,  0, 0, 0, 1]"

static void nerfstudio_file(void **state)
{
    (void)state;
    camera_path p = read_good("{\"keyframes\": [], \"camera_type\": \"perspective\", " NERF
                              ", \"camera_path\": [{" AT_123 ", \"fov\": 90, \"aspect\": 1}]}",
                              none, 0);
    const gbt_camera *c = &p.shots[0].camera;
    const double axes[9] = {1, 0, 0, 0, -1,
                            0, 0, 0, -1}; /* OpenGL's y up, z back: right x, down -y, forward -z */
    for (int k = 0; k < 9; k++)
        assert_near(c->rotation[k], axes[k], 1e-12);
    assert_near(c->center[2], 3, 1e-12);
    assert_near(c->params[0], 30, 1e-9); /* the field of view is vertical */
    assert_int_equal(c->model, GBT_CAMERA_PINHOLE);
    assert_near(p.fps, 12, 0);
    camera_path_free(&p);
    p = read_good("{\"camera_type\": \"fisheye\", " NERF ", \"camera_path\": [{" AT_123 ", \"fov\": 90}]}",
                  none, 0);
    assert_int_equal(p.shots[0].camera.model, GBT_CAMERA_FISHEYE);
    assert_near(p.shots[0].camera.params[0], 30, 1e-9);
    camera_path_free(&p);
    p = read_good("{\"camera_type\": \"equirectangular\", \"render_width\": 80, \"render_height\": 40, "
                  "\"seconds\": 2, \"camera_path\": [{" AT_123 "}, {" AT_123 "}]}",
                  none, 0);
    assert_int_equal(p.shots[1].camera.model, GBT_CAMERA_EQUIRECTANGULAR);
    assert_near(p.fps, 1, 1e-12);
    camera_path_free(&p);
}

/** The trainer's world is p' = 2 (R p + t), R a quarter turn about z, t = (1, 0, 0): (1, 2, 3) there is (1,
    0.5, 1.5) here. */
static void nerfstudio_world(void **state)
{
    (void)state;
#define WORLD "\"transform\": [[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0]], \"scale\": 2"
    const char *const path = "{" NERF ", \"camera_path\": [{" AT_123 ", \"fov\": 90}]}";
    for (int beside = 0; beside < 2; beside++) {
        if (beside)
            write_text(in_folder("dataparser_transforms.json"), "{" WORLD "}");
        camera_path p = read_good(
            beside ? path : "{" WORLD ", " NERF ", \"camera_path\": [{" AT_123 ", \"fov\": 90}]}", none, 0);
        const gbt_camera *c = &p.shots[0].camera;
        const double center[3] = {1, 0.5, 1.5}, right[3] = {0, -1, 0}, forward[3] = {0, 0, -1};
        for (int k = 0; k < 3; k++) {
            assert_near(c->center[k], center[k], 1e-12);
            assert_near(c->rotation[k], right[k], 1e-12);
            assert_near(c->rotation[6 + k], forward[k], 1e-12);
        }
        camera_path_free(&p);
    }
    unlink(in_folder("dataparser_transforms.json"));
}

static const struct bad_case {
    const char *text, *message;
} bad_cases[] = {
    {"", ":1: file is empty"},
    {"{}", ": not a camera path (wanted \"cameras\", or nerfstudio's \"camera_path\")"},
    {"{\"cameras\": []}", ": cameras: wanted a list of 1 to 100000 cameras"},
    {"{\"cameras\": {}}", ": cameras: wanted a list of 1 to 100000 cameras"},
    {"{\"cameras\": [1]}", ": cameras[0]: wanted an object"},
    {"{\"fps\": 0, " COMMON ", \"cameras\": " TWO "}", ": fps: wanted a number in (0, 1000]"},
    {"{\"frames\": 0, " COMMON ", \"cameras\": " TWO "}", ": frames: wanted a whole number in [1, 100000]"},
    {"{\"frames\": 2.5, " COMMON ", \"cameras\": " TWO "}", ": frames: wanted a whole number in [1, 100000]"},
    {"{" COMMON ", \"cameras\": [{\"origin\": [0, 0, 0]}]}",
     ": cameras[0].target: missing (wanted 3 numbers)"},
    {"{" COMMON ", \"fov\": 3, \"cameras\": " TWO "}", ": cameras[0].fov: unknown field"},
    {"{" COMMON ", \"cameras\": [{\"rays\": \"x.exr\"}]}",
     ": cameras[0].rays: not supported in a path (wanted a camera)"},
    {"{\"width\": 64, \"up\": [0, 1, 0], \"fov_x_deg\": 90, \"cameras\": [{\"origin\": [0, 0, 0], "
     "\"target\": [0, 0, 1], \"height\": 32}, {\"origin\": [0, 0, 0], \"target\": [0, 0, 1], \"height\": "
     "16}]}",
     ": cameras[1]: 64 x 16 pixels (wanted 64 x 32, as the first)"},
    {"{\"frames\": 9, " COMMON ", \"cameras\": [{\"origin\": [0, 0, 0], \"target\": [0, 0, 1]}, {\"origin\": "
     "[0, 0, 0], \"target\": [0, 0, 1], \"model\": \"fisheye\"}]}",
     ": cameras[1].model: not that of the first (wanted one lens in a path with \"frames\")"},
    {"{\"frames\": 9, \"aperture\": 1, \"focus\": 2, " COMMON ", \"cameras\": " TWO "}",
     ": cameras[0]: an aperture or a shutter (not possible"},
    {"{\"camera_path\": []}", ": camera_path: wanted a list of 1 to 100000 cameras"},
    {"{\"camera_path\": [{}]}", ": render_width: missing (pixels)"},
    {"{\"render_width\": 8, \"camera_path\": [{}]}", ": render_height: missing (pixels)"},
    {"{\"render_width\": 0, \"render_height\": 8, \"camera_path\": [{}]}",
     ": render_width: wanted a whole number in [1, 65500]"},
    {"{\"camera_type\": \"vr180\", " NERF ", \"camera_path\": [{}]}",
     ": camera_type: wanted one of perspective, fisheye, equirectangular"},
    {"{" NERF ", \"camera_path\": [3]}", ": camera_path[0]: wanted an object"},
    {"{" NERF ", \"camera_path\": [{}]}", ": camera_path[0].fov: missing (degrees from the top"},
    {"{" NERF ", \"camera_path\": [{\"fov\": 180}]}", ": camera_path[0].fov: wanted a number in (0, 179.9]"},
    {"{" NERF ", \"camera_path\": [{\"fov\": 50}]}",
     ": camera_path[0].camera_to_world: wanted 12 or 16 numbers, row after row"},
    {"{" NERF ", \"camera_path\": [{\"fov\": 50, \"camera_to_world\": [1, 2, 3]}]}",
     ": camera_path[0].camera_to_world: wanted 12 or 16 numbers, row after row"},
    {"{" NERF ", \"camera_path\": [{\"fov\": 50, \"camera_to_world\": [1,0,0,0,0,1,0,0,0,0,1,\"0\"]}]}",
     ": camera_path[0].camera_to_world: wanted 12 or 16 numbers"},
    {"{" NERF ", \"camera_path\": [{\"fov\": 50, \"camera_to_world\": [[1,0,0,0],[0,1,0,0],5]}]}",
     ": camera_path[0].camera_to_world: wanted 12 or 16 numbers"},
    {"{" NERF ", \"camera_path\": [{\"fov\": 50, \"camera_to_world\": [2,0,0,0,0,1,0,0,0,0,1,0]}]}",
     ": camera_path[0].camera_to_world: not a rotation"},
    {"{" NERF ", \"camera_path\": [{\"fov\": 50, \"camera_to_world\": [-1,0,0,0,0,1,0,0,0,0,1,0]}]}",
     ": camera_path[0].camera_to_world: not a rotation"},
    {"{\"transform\": [], " NERF ", \"camera_path\": [{}]}",
     ": transform: wanted 12 or 16 numbers, row after row"},
    {"{\"scale\": 0, \"transform\": [], " NERF ", \"camera_path\": [{}]}",
     ": scale: wanted a number in (0, 1e+15]"},
};

static void says_what_is_wrong(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof bad_cases / sizeof *bad_cases; i++) {
        camera_path p;
        gbt_error err = {0};
        write_text(file_path, bad_cases[i].text);
        const gbt_status status = camera_path_file_read(file_path, none, 0, &p, &err);
        const size_t length = strlen(file_path);
        if (status != GBT_ERR_FORMAT || strncmp(err.text, file_path, length) != 0 ||
            strncmp(err.text + length, bad_cases[i].message, strlen(bad_cases[i].message)) != 0)
            fail_msg("%s: %d: %s", bad_cases[i].text, (int)status, err.text);
        camera_path_free(&p);
    }
    camera_path p;
    gbt_error err = {0};
    assert_int_equal(camera_path_file_read("/nowhere/p.json", none, 0, &p, &err), GBT_ERR_IO);
    camera_path_free(&p);
}

/* ---- films ---- */

static void no_film_left(const char *path)
{
    assert_false(file_exists(path));
    assert_false(file_exists(in_folder(".%s.tmp", strrchr(path, '/') + 1)));
}

static void film_without_ffmpeg(void **state)
{
    (void)state;
    const char *path = in_folder("clip.mp4");
    char search[4096];
    video *v;
    gbt_error err = {0};
    snprintf(search, sizeof search, "%s", getenv("PATH") != NULL ? getenv("PATH") : "");
    setenv("PATH", "/nowhere", 1);
    gbt_status status = video_open(path, 16, 16, 30, &v, &err);
    setenv("PATH", search, 1);
    assert_true(status == GBT_OK || v == NULL);
    if (status == GBT_OK) /* where posix_spawnp() cannot say so: emulators */
        status = video_close(v, true, &err);
    assert_int_equal(status, GBT_ERR_IO);
    assert_non_null(strstr(err.text, "a film needs the program ffmpeg, which is not installed"));
    no_film_left(path);
    memset(&err, 0, sizeof err);
    assert_int_equal(video_open(path, 15, 16, 30, &v, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "15 x 16 pixels (wanted even numbers"));
    memset(&err, 0, sizeof err);
    assert_int_equal(video_open("clip.gif", 16, 16, 60, &v, &err), GBT_ERR_ARGUMENT);
    assert_string_equal(err.text, "clip.gif: 60 frames per second (wanted at most 50 in a .gif)");
    assert_true(video_named("a.webm") && video_named("b/a.gif") && !video_named(".mp4") &&
                !video_named("mp4") && !video_named("a.mp4/"));
}

/** A program of that name which reads nothing, says something and fails. */
static void film_that_fails(void **state)
{
    (void)state;
    const char *path = in_folder("clip.mp4"), *program = in_folder("ffmpeg");
    char search[4096];
    video *v;
    gbt_error err = {0};
    image picture;
    write_text(program, "#!/bin/sh\necho first >&2\necho no such encoder >&2\nexit 7\n");
    assert_int_equal(chmod(program, 0755), 0);
    snprintf(search, sizeof search, "%s", getenv("PATH") != NULL ? getenv("PATH") : "");
    setenv("PATH", test_folder, 1);
    signal(SIGCHLD, SIG_IGN);
    assert_int_equal(video_open(path, 256, 256, 30, &v, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "clip.mp4: SIGCHLD is ignored"));
    no_film_left(path);
    signal(SIGCHLD, SIG_DFL);
    err = (gbt_error){0};
    const gbt_status opened = video_open(path, 256, 256, 30, &v, &err);
    setenv("PATH", search, 1);
    assert_int_equal(opened, GBT_OK);
    assert_ok(image_alloc(&picture, 256, 256, 3, &assert_ok_err_));
    memset(picture.pixels, 0, 256 * 256 * 3 * sizeof *picture.pixels);
    gbt_status status = GBT_OK;
    for (int i = 0; i < 100 && status == GBT_OK; i++) /* more than a socket holds */
        status = video_add(v, &picture, &err);
    assert_int_equal(status, GBT_ERR_IO);
    assert_non_null(strstr(err.text, "clip.mp4: ffmpeg failed (code 7): no such encoder"));
    gbt_error ignored = {0};
    assert_int_equal(video_close(v, false, &ignored), GBT_OK);
    no_film_left(path);
    image_free(&picture);
}

/** Grey that grows from frame to frame, with a red last one, and back from the file; colours as BT.709. */
static void film_and_back(void **state)
{
    const char *const ending = *state;
    const float red[3] = {0.78f, 0.16f, 0.16f};
    enum { SIDE = 32, COUNT = 6, PICTURE = 3 * SIDE * SIDE, MIDDLE = (SIDE / 2 * SIDE + SIDE / 2) * 3 };
    if (system("ffmpeg -version >/dev/null 2>&1") != 0) {
        print_message("ffmpeg is not there: skipped\n");
        skip();
    }
    const char *path = in_folder("clip.%s", ending), *raw = in_folder("frames.rgb");
    char command[2048];
    video *v;
    image picture;
    struct stat info;
    write_text(path, "old");
    assert_int_equal(chmod(path, 0600), 0);
    assert_ok(video_open(path, SIDE, SIDE, 10, &v, &assert_ok_err_));
    assert_ok(image_alloc(&picture, SIDE, SIDE, 3, &assert_ok_err_));
    for (int frame = 0; frame < COUNT; frame++) {
        for (int i = 0; i < PICTURE; i++)
            picture.pixels[i] = frame + 1 < COUNT ? 0.1f + 0.15f * (float)frame : red[i % 3];
        assert_ok(video_add(v, &picture, &assert_ok_err_));
    }
    assert_true(stat(path, &info) == 0 && info.st_size == 3); /* not replaced before it is whole */
    assert_ok(video_close(v, true, &assert_ok_err_));
    assert_true(stat(path, &info) == 0 && (info.st_mode & 0777) == 0600);
    snprintf(command, sizeof command,
             "ffmpeg -nostdin -loglevel error -y -i %s -vf scale=in_color_matrix=bt709 -f rawvideo "
             "-pix_fmt rgb24 %s",
             path, raw);
    assert_int_equal(system(command), 0);
    unsigned char *bytes;
    size_t count;
    assert_ok(file_read(raw, &bytes, &count, &assert_ok_err_));
    assert_int_equal(count, COUNT * PICTURE);
    for (int frame = 0; frame + 1 < COUNT; frame++)
        assert_near(bytes[frame * PICTURE + MIDDLE], 255 * (0.1 + 0.15 * frame), 6);
    for (int k = 0; k < 3; k++)
        assert_near(bytes[(COUNT - 1) * PICTURE + MIDDLE + k], 255 * (double)red[k], 4);
    mem_free(bytes);
    image_free(&picture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_cameras_look_at),
        cmocka_unit_test(parallel_cameras),
        cmocka_unit_test(a_head_looks_at_what_is_around),
        cmocka_unit_test(a_line_has_no_plane),
        cmocka_unit_test(closed_orbit),
        cmocka_unit_test(orbit_of_an_arc),
        cmocka_unit_test(orbit_follows_the_cameras),
        cmocka_unit_test(orbit_of_a_shape),
        cmocka_unit_test(orbit_looks_as_the_cameras),
        cmocka_unit_test(orbit_shows_what_most_see),
        cmocka_unit_test(through_all_keys),
        cmocka_unit_test(through_keys_far_away),
        cmocka_unit_test(turning_on_the_spot),
        cmocka_unit_test(zooming_on_the_spot),
        cmocka_unit_test(zooming_between_moves),
        cmocka_unit_test(order_to_go_through),
        cmocka_unit_test(our_file),
        cmocka_unit_test(nerfstudio_file),
        cmocka_unit_test(nerfstudio_world),
        cmocka_unit_test(says_what_is_wrong),
        cmocka_unit_test(film_without_ffmpeg),
        cmocka_unit_test(film_that_fails),
        {.name = "film and back: mp4", .test_func = film_and_back, .initial_state = "mp4"},
        {.name = "film and back: webm", .test_func = film_and_back, .initial_state = "webm"},
        {.name = "film and back: gif", .test_func = film_and_back, .initial_state = "gif"},
    };
    return cmocka_run_group_tests(tests, set_up, folder_remove);
}
