/* SPDX-License-Identifier: Apache-2.0 */
/* tests/frame/test_frame.c -- frames of any shot: nothing that a ray reaches is left out, samples are
   averaged in order, same bits for all threads. */
#include "anchor/fixture.h"
#include "base/camera_pose.h"
#include "base/memory.h"
#include "base/near.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "frame/frame.h"
#include "frame/visible.h"

enum { OFFSETS = 3, ANCHORS = 400, W = 24, H = 16, KINDS = 9 };

static double uniform(uint64_t seed, uint64_t index, double low, double high)
{
    return low + (high - low) * (double)rng_uniform(seed, 77, index);
}

static void random_pose(uint64_t seed, uint64_t first, double distance, gbt_camera *camera)
{
    double q[4], length = 0;
    for (uint64_t i = 0; i < 4; i++) {
        q[i] = rng_normal(seed, first, i);
        length += q[i] * q[i];
    }
    for (int i = 0; i < 4; i++)
        q[i] /= sqrt(length);
    dquat_to_matrix(q, camera->rotation);
    for (int k = 0; k < 3; k++) /* looking at somewhere near the middle */
        camera->center[k] =
            uniform(seed, first * 16 + (uint64_t)k, -0.5, 0.5) - distance * camera->rotation[6 + k];
}

/* A shot of each kind: lenses, open apertures, shutters, rays given anyhow. */
static ray_shot random_shot(uint64_t seed, int kind, ray_image *given)
{
    static const gbt_camera_model models[KINDS] = {
        GBT_CAMERA_PINHOLE, GBT_CAMERA_ORTHOGRAPHIC,    GBT_CAMERA_PINHOLE,
        GBT_CAMERA_FISHEYE, GBT_CAMERA_PINHOLE,         GBT_CAMERA_ORTHOGRAPHIC,
        GBT_CAMERA_PINHOLE, GBT_CAMERA_EQUIRECTANGULAR, GBT_CAMERA_PINHOLE};
    const bool turn = models[kind] == GBT_CAMERA_EQUIRECTANGULAR;
    const double focal = kind == 3 ? 8 : uniform(seed, 0, 20, 60);
    gbt_camera camera = {.model = models[kind],
                         .width = W,
                         .height = H,
                         .params = {turn ? W : focal, turn ? H : focal, 0.5 * W, 0.4 * H}};
    random_pose(seed, 1, uniform(seed, 2, 0, 5), &camera);
    ray_shot shot = ray_shot_of(&camera);
    shot.samples = 3;
    shot.seed = seed;
    if (kind == 2 || kind == 3 || kind == 5 || kind == 6) {
        shot.aperture_radius = uniform(seed, 3, 0.01, 0.6);
        shot.focus_distance = uniform(seed, 4, 0.5, 6);
    }
    if (kind == 4 || kind == 6) {
        gbt_camera end = shot.camera;
        if (kind == 4)
            random_pose(seed, 9, 3, &end);
        else
            end.center[0] += 0.3;
        assert_true(camera_set_readout(&shot.camera, &end,
                                       seed % 2 == 0 ? GBT_CAMERA_SHUTTER_ROWS : GBT_CAMERA_SHUTTER_COLUMNS,
                                       0, 1, &shot.camera));
    }
    if (kind == 8) {
        assert_ok(ray_image_reserve(given, W, H, false, NULL));
        const double wide = seed % 2 == 0 ? 0.2 : 2; /* around an axis, or everywhere */
        for (size_t i = 0; i < W * H; i++) {
            double dir[3];
            for (size_t k = 0; k < 3; k++)
                given->origin[3 * i + k] = (float)(camera.center[k] + 0.5 * rng_normal(seed, 20 + k, i)),
                                      dir[k] = camera.rotation[6 + k] + wide * rng_normal(seed, 30 + k, i);
            dvec_normalize(dir);
            for (size_t k = 0; k < 3; k++)
                given->dir[3 * i + k] = i % 50 == 7 ? 0 : (float)dir[k];
        }
        shot.given = given;
    }
    return shot;
}

typedef struct world {
    anchors a;
    decoder d;
    trace_settings s;
} world;

static world make_world(uint64_t seed)
{
    world w = {.a = random_anchors(ANCHORS, OFFSETS, seed),
               .d = random_decoder(OFFSETS, false, seed + 1000),
               .s = trace_settings_default()};
    for (size_t i = 0; i < ANCHORS; i++)
        for (size_t k = 0; k < 6; k++)
            w.a.scale_log[6 * i + k] = spread(seed, 200 + k, i, -4.0f, -2.0f);
    decoder_network networks[3];
    decoder_networks(&w.d, networks);
    for (size_t i = 0; i < OFFSETS; i++) /* biases of the opacities */
        w.d.params[networks[0].end - 1 - i] = 0.7f;
    w.s.background[1] = 0.3f;
    return w;
}

static void free_world(world *w)
{
    anchors_free(&w->a);
    decoder_free(&w->d);
}

/* Against all anchors, decoded for the same eye, the same rays, sample after sample. */
static void nothing_reached_is_left_out(void **state)
{
    (void)state;
    size_t left_out[KINDS] = {0}, seen[KINDS] = {0};
    uint32_t all[ANCHORS];
    for (uint32_t i = 0; i < ANCHORS; i++)
        all[i] = i;
    for (uint64_t seed = 0; seed < 12; seed++)
        for (int kind = 0; kind < KINDS; kind++) {
            world w = make_world(seed);
            frame f = {0};
            ray_image given = {0}, rays = {0};
            gaussians g = {0};
            decode_tape tape = {0};
            trace_scene scene = {0};
            image rgb = {0};
            static double sum[3 * W * H];
            memset(sum, 0, sizeof sum);
            const ray_shot shot = random_shot(seed * KINDS + (uint64_t)kind, kind, &given);
            assert_ok(frame_render_with(&f, frame_neural(&w.a, &w.d), &shot, &w.s, NULL, NULL));
            left_out[kind] += ANCHORS - f.visible_count;
            assert_ok(decode_forward(&w.a, &w.d, f.eye, all, ANCHORS, w.s.alpha_min, &g, &tape, NULL));
            assert_ok(trace_build(&scene, &g, &w.s, 20, NULL));
            assert_ok(image_alloc(&rgb, W, H, 3, NULL));
            const int samples = ray_shot_sample_count(&shot);
            for (int s = 0; s < samples; s++) {
                assert_ok(ray_image_from_shot(&shot, s, &rays, NULL));
                assert_ok(trace_forward(&scene, &rays, false, &(trace_outputs){.rgb = &rgb}, NULL, NULL));
                for (size_t i = 0; i < 3 * W * H; i++)
                    sum[i] += (double)rgb.pixels[i];
            }
            for (size_t i = 0; i < 3 * W * H; i++) {
                const double want = sum[i] / samples;
                if (!(fabs((double)f.rgb.pixels[i] - want) < 3e-6))
                    fail_msg("seed %d, kind %d, pixel %zu: %.9g, with all anchors %.9g (%zu of them visible)",
                             (int)seed, kind, i / 3, (double)f.rgb.pixels[i], want, f.visible_count);
                seen[kind] += fabs(want - (double)w.s.background[i % 3]) > 0.01;
            }
            frame_free(&f);
            ray_image_free(&given);
            ray_image_free(&rays);
            gaussians_free(&g);
            decode_tape_free(&tape);
            trace_scene_free(&scene);
            image_free(&rgb);
            free_world(&w);
        }
    for (int kind = 0; kind < KINDS; kind++) { /* the test sees something, and something is left out (a
                                                  panorama sees all) */
        if (seen[kind] < 500 || (kind == 7) != (left_out[kind] < 15))
            fail_msg("kind %d: %zu values seen, %zu anchors left out", kind, seen[kind], left_out[kind]);
    }
}

/* The cone around a lens's rays holds them, and little more. */
static void the_cone_is_narrow(void **state)
{
    (void)state;
    static const gbt_camera_model models[] = {GBT_CAMERA_PINHOLE, GBT_CAMERA_FISHEYE};
    for (uint64_t seed = 0; seed < 20; seed++) {
        gbt_camera camera = {
            .model = models[seed % 2], .width = W, .height = H, .params = {0, 0, 0.5 * W, 0.4 * H}};
        camera.params[0] = camera.params[1] = uniform(seed, 0, 6, 60);
        random_pose(seed, 1, 3, &camera);
        const ray_shot shot = ray_shot_of(&camera);
        ray_image rays = {0};
        view_bounds b;
        assert_ok(ray_image_from_shot(&shot, 0, &rays, NULL));
        assert_ok(view_bounds_find(&shot, &rays, &b, NULL));
        float least = 1;
        for (size_t i = 0; i < W * H; i++)
            least = fminf(least, b.axis[0] * rays.dir[3 * i] + b.axis[1] * rays.dir[3 * i + 1] +
                                     b.axis[2] * rays.dir[3 * i + 2]);
        if (!(b.cos_angle <= least + 1e-6f && b.cos_angle > least - 5e-3f) ||
            !(fabsf(b.cos_angle * b.cos_angle + b.sin_angle * b.sin_angle - 1) < 1e-6f))
            fail_msg("seed %d: cosine %g, sine %g; of the rays %g", (int)seed, (double)b.cos_angle,
                     (double)b.sin_angle, (double)least);
        ray_image_free(&rays);
    }
}

/* frame_render() is the shot of a still camera. */
static void a_camera_is_a_shot(void **state)
{
    (void)state;
    world w = make_world(3);
    frame a = {0}, b = {0};
    const ray_shot shot = random_shot(5, 0, NULL);
    assert_ok(frame_render(&a, frame_neural(&w.a, &w.d), &shot.camera, &w.s, true, NULL));
    assert_ok(frame_render_with(&b, frame_neural(&w.a, &w.d), &shot, &w.s, NULL, NULL));
    assert_memory_equal(a.rgb.pixels, b.rgb.pixels, 3 * W * H * sizeof(float));
    for (int k = 0; k < 3; k++)
        assert_true(a.eye[k] == (float)shot.camera.center[k]);
    frame_free(&a);
    frame_free(&b);
    free_world(&w);
}

static gbt_status plain_tracer(void *context, trace_scene *scene, const ray_image *rays, image *rgb,
                               gbt_error *err)
{
    int *calls = context;
    assert_true(scene->reach >= 30);
    ++*calls;
    return trace_forward(scene, rays, false, &(trace_outputs){.rgb = rgb}, NULL, err);
}

/* A tracer of the caller gets every sample and every anchor; one that does nothing of its own changes
 * nothing. */
static void a_tracer_of_the_caller(void **state)
{
    (void)state;
    for (int kind = 0; kind < KINDS; kind++) {
        world w = make_world(6);
        frame a = {0}, b = {0};
        ray_image given = {0};
        int calls = 0;
        const ray_shot shot = random_shot(200 + (uint64_t)kind, kind, &given);
        const frame_tracer tracer = {.trace = plain_tracer, .context = &calls, .reach = 30};
        w.a.position[0] = NAN; /* an anchor that is nowhere is not decoded */
        assert_ok(frame_render_with(&a, frame_neural(&w.a, &w.d), &shot, &w.s, NULL, NULL));
        assert_ok(frame_render_with(&b, frame_neural(&w.a, &w.d), &shot, &w.s, &tracer, NULL));
        assert_int_equal(b.visible_count, ANCHORS - 1);
        assert_int_equal(calls, ray_shot_sample_count(&shot));
        for (size_t i = 0; i < 3 * W * H; i++)
            assert_near((double)b.rgb.pixels[i], (double)a.rgb.pixels[i], 3e-6);
        frame_free(&a);
        frame_free(&b);
        ray_image_free(&given);
        free_world(&w);
    }
}

static void same_bits_for_every_thread_count(void **state)
{
    (void)state;
    world w = make_world(4);
    for (int kind = 0; kind < KINDS; kind++) {
        uint64_t hash[3];
        for (int t = 0; t < 3; t++) {
            frame f = {0};
            ray_image given = {0};
            const ray_shot shot = random_shot(100 + (uint64_t)kind, kind, &given);
            parallel_set_threads(t == 2 ? 7 : t + 1);
            assert_ok(frame_render_with(&f, frame_neural(&w.a, &w.d), &shot, &w.s, NULL, NULL));
            hash[t] = hash_bytes(0, f.rgb.pixels, 3 * W * H * sizeof(float));
            frame_free(&f);
            ray_image_free(&given);
        }
        assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
    }
    parallel_set_threads(2);
    free_world(&w);
}

/* Rays that are all nowhere show the background. */
static void no_rays(void **state)
{
    (void)state;
    world w = make_world(5);
    frame f = {0};
    ray_image given = {0};
    ray_shot shot = random_shot(8, 8, &given);
    memset(given.dir, 0, 3 * W * H * sizeof *given.dir);
    assert_ok(frame_render_with(&f, frame_neural(&w.a, &w.d), &shot, &w.s, NULL, NULL));
    for (size_t i = 0; i < 3 * W * H; i++)
        assert_true(f.rgb.pixels[i] == w.s.background[i % 3]);
    shot.given = NULL;
    shot.aperture_radius = 1;
    shot.focus_distance = 0;
    gbt_error err = {0};
    assert_int_equal(frame_render_with(&f, frame_neural(&w.a, &w.d), &shot, &w.s, NULL, &err),
                     GBT_ERR_ARGUMENT);
    assert_string_equal(err.text, "camera: focus distance 0 (wanted > 0, as there is an aperture)");
    frame_free(&f);
    ray_image_free(&given);
    free_world(&w);
}

static void a_model_without_anchors(void **state)
{
    (void)state;
    world w = make_world(5);
    const anchors none = {.offset_count = OFFSETS};
    frame f = {0};
    const ray_shot shot = random_shot(5, 0, NULL);
    assert_ok(frame_render(&f, frame_neural(&none, &w.d), &shot.camera, &w.s, false, NULL));
    for (size_t i = 0; i < 3 * W * H; i++)
        assert_true(f.rgb.pixels[i] == w.s.background[i % 3]);
    frame_free(&f);
    free_world(&w);
}

/* Anchors of all sizes whose Gaussians end a little before or behind the edge of what is seen. */
static void reaching_into_view(void **state)
{
    (void)state;
    anchors a = random_anchors(ANCHORS, OFFSETS, 5);
    const view_bounds bounds = {.plane_count = 1, .plane = {{1, 0, 0}}};
    const visible_reach reach = {.sigmas = 3};
    for (size_t i = 0; i < ANCHORS; i++) {
        float *l = a.scale_log + 6 * i;
        const float *o = a.offset + 3 * OFFSETS * i;
        double farthest = 0;
        for (size_t k = 0; k < 6; k++)
            l[k] = spread(5, 200 + k, i, -40.0f, 35.0f);
        for (size_t k = 0; k < OFFSETS; k++) {
            double square = 0;
            for (size_t c = 0; c < 3; c++)
                square += pow((double)o[3 * k + c] * exp(fmin((double)l[c], 30)), 2);
            farthest = fmax(farthest, sqrt(square));
        }
        const double scale = exp(fmin((double)fmaxf(l[3], fmaxf(l[4], l[5])), 30));
        a.position[3 * i] = (float)((farthest + 3 * scale) * (i % 2 == 0 ? 1 - 1e-4 : 1 + 1e-4));
    }
    uint32_t *visible = NULL;
    size_t count = 0, capacity = 0;
    assert_ok(
        visible_find(frame_neural(&a, NULL), &bounds, &reach, NULL, NULL, &visible, &count, &capacity, NULL));
    assert_int_equal(count, ANCHORS / 2);
    for (size_t i = 0; i < count; i++)
        assert_int_equal(visible[i], 2 * i);
    mem_free(visible);
    anchors_free(&a);
}

/* Each draw leaves out others, and each anchor as often as is asked for. */
static void left_out_at_random(void **state)
{
    (void)state;
    enum { MANY = 4000, DRAWS = 3 };
    anchors a = random_anchors(MANY, OFFSETS, 6);
    const view_bounds all = view_bounds_none();
    const visible_reach reach = {.sigmas = 3};
    uint32_t *visible = NULL, seen[MANY] = {0};
    size_t count, capacity = 0, in_all = 0;
    for (uint64_t draw = 0; draw < DRAWS; draw++) {
        const visible_dropout dropout = {.share = 0.25f, .seed = 7, .draw = draw};
        assert_ok(visible_find(frame_neural(&a, NULL), &all, &reach, NULL, &dropout, &visible, &count,
                               &capacity, NULL));
        assert_in_range(count, MANY * 0.72, MANY * 0.78);
        for (size_t i = 0; i < count; i++)
            seen[visible[i]]++;
    }
    for (size_t i = 0; i < MANY; i++)
        in_all += seen[i] == DRAWS;
    assert_in_range(in_all, MANY * 0.39, MANY * 0.46); /* 0.75^3 = 0.42 */
    const visible_dropout none = {.share = 0, .seed = 7};
    assert_ok(
        visible_find(frame_neural(&a, NULL), &all, &reach, NULL, &none, &visible, &count, &capacity, NULL));
    assert_int_equal(count, MANY);
    mem_free(visible);
    anchors_free(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_reached_is_left_out),
        cmocka_unit_test(reaching_into_view),
        cmocka_unit_test(left_out_at_random),
        cmocka_unit_test(the_cone_is_narrow),
        cmocka_unit_test(a_camera_is_a_shot),
        cmocka_unit_test(a_tracer_of_the_caller),
        cmocka_unit_test(same_bits_for_every_thread_count),
        cmocka_unit_test(no_rays),
        cmocka_unit_test(a_model_without_anchors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
