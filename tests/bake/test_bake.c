/* SPDX-License-Identifier: Apache-2.0 */
/* tests/bake/test_bake.c -- baked models against their networks. */
#include "anchor/fixture.h"
#include "bake/backdrop.h"
#include "bake/bake.h"
#include "bake/refine.h"
#include "base/near.h"
#include "base/parallel.h"
#include "frame/ring.h"
#include "image/metrics.h"

enum { ANCHORS = 150, OFFSETS = 2 };

/* ---- baking ---- */

typedef struct world {
    anchors a;
    decoder d;
    trace_settings s, of_cameras[CAMERAS];
    gbt_camera cameras[CAMERAS];
    frame f;
} world;

/* `blind`: networks that do not look at the direction, so that a bake loses nothing. */
static void make_world(world *w, bool blind)
{
    *w = (world){.a = random_anchors(ANCHORS, OFFSETS, 5),
                 .d = random_decoder(OFFSETS, true, 9),
                 .s = trace_settings_default(),
                 .f.draw.footprint = 0.1f};
    for (size_t i = 0; i < ANCHORS; i++)
        for (size_t k = 0; k < 6; k++)
            w->a.scale_log[6 * i + k] = spread(5, 200 + k, i, -2.5f, -0.5f);
    decoder_network networks[3];
    decoder_networks(&w->d, networks);
    for (size_t i = 0; i < OFFSETS; i++)
        w->d.params[networks[0].end - 1 - i] = 0.7f;
    const size_t inputs = ANCHOR_FEATURE_DIM + 4;
    for (int head = 0; head < 3 && blind; head++)
        for (size_t h = 0; h < ANCHOR_HIDDEN_DIM; h++)
            memset(w->d.params + networks[head].begin + h * inputs + ANCHOR_FEATURE_DIM, 0,
                   4 * sizeof(float));
    for (int i = 0; i < CAMERAS; i++)
        w->cameras[i] = ring_camera(i);
    for (int i = 0; i < CAMERAS; i++)
        w->of_cameras[i] = w->s;
}

static void free_world(world *w)
{
    anchors_free(&w->a);
    decoder_free(&w->d);
    frame_free(&w->f);
}

/* Mean PSNR of the cloud's pictures to the model's, cameras between those of the ring. */
static double likeness(world *w, const gaussian_cloud *cloud)
{
    frame f = {.draw.footprint = w->f.draw.footprint};
    double sum = 0;
    for (int i = 0; i < 4; i++) {
        gbt_camera camera = ring_camera(3 * i);
        camera.center[1] += 0.3;
        assert_ok(frame_render(&w->f, frame_neural(&w->a, &w->d), &camera, &w->s, false, NULL));
        assert_ok(frame_render(&f, frame_plain(cloud), &camera, &w->s, false, NULL));
        sum += metric_psnr(&f.rgb, &w->f.rgb) / 4;
    }
    frame_free(&f);
    return sum;
}

static void bake_world(world *w, int degree, double prior, bake_result *out)
{
    bake_def def = bake_def_default();
    def.sh_degree = degree;
    def.prior_weight = prior;
    assert_ok(bake_cloud(&w->f, &w->a, &w->d, w->cameras, CAMERAS, w->of_cameras, &def, out, NULL));
    assert_int_equal(out->cloud.count + out->unseen, ANCHORS * OFFSETS);
    assert_int_equal(w->f.draw.pixel_step, 0);
}

static void nothing_is_lost_without_directions(void **state)
{
    (void)state;
    world w;
    make_world(&w, true);
    for (int degree = 0; degree <= 3; degree += 3) {
        bake_result r;
        bake_world(&w, degree, 0.3, &r);
        const double psnr = likeness(&w, &r.cloud);
        if (!(psnr > 60))
            fail_msg("degree %d: %.2f dB", degree, psnr);
        gaussian_cloud_free(&r.cloud);
    }
    free_world(&w);
}

static void more_functions_and_steps_come_nearer(void **state)
{
    (void)state;
    world w;
    make_world(&w, false);
    bake_result flat, r;
    bake_world(&w, 0, 0.3, &flat);
    bake_world(&w, 3, 0.3, &r);
    const double constant = likeness(&w, &flat.cloud), baked = likeness(&w, &r.cloud);
    refine_def def = refine_def_default();
    def.steps = 100;
    assert_ok(refine_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, w.of_cameras, &def, &r.cloud, NULL));
    const double refined = likeness(&w, &r.cloud);
    if (!(constant < baked && baked < refined && refined > 35))
        fail_msg("degree 0: %.2f dB, 3: %.2f, refined: %.2f", constant, baked, refined);
    gaussian_cloud_free(&flat.cloud);
    gaussian_cloud_free(&r.cloud);
    free_world(&w);
}

typedef struct mean_of_views {
    double weight, opaque, color; /* of red */
    int made, decoded;
} mean_of_views;

/* What each Gaussian is in every second pixel of the cameras. */
static void look_at_all(world *w, mean_of_views *means)
{
    for (int c = 0; c < CAMERAS; c++) {
        gbt_camera sparse = w->cameras[c];
        w->f.draw.pixel_step = gbt_camera_every(&w->cameras[c], 2, 0, 0, &sparse) ? 2 : 1;
        assert_ok(frame_render(&w->f, frame_neural(&w->a, &w->d), &sparse, &w->s, true, NULL));
        assert_ok(frame_blend_weights(&w->f, NULL));
        for (size_t v = 0; v < w->f.visible_count; v++)
            for (uint32_t k = 0; k < OFFSETS; k++)
                means[w->f.visible[v] * OFFSETS + k].decoded++;
        for (size_t i = 0; i < w->f.gaussians.count; i++) {
            const uint32_t slot = w->f.tape.slot[i];
            mean_of_views *m = &means[w->f.visible[slot / OFFSETS] * OFFSETS + slot % OFFSETS];
            const double weight = (double)w->f.blend_weight[i];
            m->made++;
            m->weight += weight;
            m->opaque += weight / (double)w->f.gaussians.opacity[i];
            m->color += weight * ((double)w->f.gaussians.red[i] - 0.5);
        }
    }
    w->f.draw.pixel_step = 0;
}

/* Constant colours: the mean of what the cameras see, and `prior` times that of directions around. `bias` of
   the opacities: where one is below 0 the Gaussian is not made. */
static void check_means(float bias, size_t *partly, size_t *turned)
{
    static mean_of_views means[ANCHORS * OFFSETS];
    static const double priors[3] = {0, 0.25, 1}, y = 0.28209479177387814;
    world w;
    bake_result r[3];
    decoder_network networks[3];
    make_world(&w, false);
    decoder_networks(&w.d, networks);
    for (size_t k = 0; k < OFFSETS; k++)
        w.d.params[networks[0].end - 1 - k] = bias;
    memset(means, 0, sizeof means);
    look_at_all(&w, means);
    for (int p = 0; p < 3; p++)
        bake_world(&w, 0, priors[p], &r[p]);
    size_t row = 0;
    *partly = *turned = 0;
    for (size_t i = 0; i < ANCHORS * OFFSETS; i++) {
        const mean_of_views *m = &means[i];
        const double opacity = m->weight > 0 ? m->weight / m->opaque * m->made / m->decoded : 0;
        if (opacity < 1.0 / 255 + 1e-6)
            continue;
        double around[3];
        for (int p = 0; p < 3; p++) {
            assert_near((double)r[p].cloud.opacity[row], opacity, 1e-5);
            around[p] =
                y * (double)r[p].cloud.sh[row * GAUSSIAN_SH_COUNT * 3] * (1 + priors[p]) * (1 + 1e-4) -
                m->color / m->weight;
        }
        assert_near(around[0], 0, 1e-5);
        if (m->made == m->decoded && bias > 0.5f) /* in each direction, too */
            assert_near(around[1] / 0.25, around[2], 1e-4);
        *partly += m->made < m->decoded;
        *turned += fabs(around[2] - m->color / m->weight) > 0.01;
        row++;
    }
    assert_int_equal(row, r[0].cloud.count);
    for (int p = 0; p < 3; p++)
        gaussian_cloud_free(&r[p].cloud);
    free_world(&w);
}

static void opacities_and_colors_are_means(void **state)
{
    (void)state;
    size_t partly, turned;
    check_means(0.7f, &partly, &turned);
    assert_true(partly == 0 && turned > 50);
    check_means(0.1f, &partly, &turned);
    assert_true(partly > 10);
}

static void same_bits_for_all_threads(void **state)
{
    (void)state;
    gaussian_cloud first = {0};
    const int before = parallel_threads();
    for (int threads = 1; threads <= 3; threads++) {
        parallel_set_threads(threads);
        world w;
        make_world(&w, false);
        bake_result r;
        bake_world(&w, 2, 0.3, &r);
        refine_def def = refine_def_default();
        def.steps = 5;
        assert_ok(refine_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, w.of_cameras, &def, &r.cloud, NULL));
        if (threads == 1)
            first = r.cloud;
        else {
            assert_int_equal(first.count, r.cloud.count);
            assert_memory_equal(first.sh, r.cloud.sh, first.count * 48 * sizeof(float));
            assert_memory_equal(first.quat, r.cloud.quat, first.count * 4 * sizeof(float));
            assert_memory_equal(first.opacity, r.cloud.opacity, first.count * sizeof(float));
            gaussian_cloud_free(&r.cloud);
        }
        free_world(&w);
    }
    parallel_set_threads(before);
    gaussian_cloud_free(&first);
}

/* From any camera, in any direction, pictures on black are those on the background's colour, and what was
   there stays in front. */
static void a_backdrop_stands_for_the_background(void **state)
{
    (void)state;
    const float color[3] = {0.75f, 0.5f, 0.125f};
    world w;
    make_world(&w, false);
    bake_result r;
    bake_world(&w, 3, 0.3, &r);
    const size_t before = r.cloud.count;
    gaussian_cloud bare;
    assert_ok(gaussian_cloud_alloc(&bare, before, NULL));
    bare.sh_degree = r.cloud.sh_degree;
    memcpy(bare.mean, r.cloud.mean, 3 * before * sizeof(float));
    memcpy(bare.scale_log, r.cloud.scale_log, 3 * before * sizeof(float));
    memcpy(bare.quat, r.cloud.quat, 4 * before * sizeof(float));
    memcpy(bare.opacity, r.cloud.opacity, before * sizeof(float));
    memcpy(bare.sh, r.cloud.sh, before * GAUSSIAN_SH_COUNT * 3 * sizeof(float));
    sky behind = {.varies = true};
    for (int k = 0; k < 3 * SKY_HARMONICS; k++) /* not so steep that 1000 Gaussians could not follow */
        behind.harmonic[k / 3][k % 3] = 0.005f * cosf(1.7f * (float)k);
    assert_ok(backdrop_add(&r.cloud, w.cameras, CAMERAS, color, &behind, NULL));
    assert_int_equal(r.cloud.count, before + BACKDROP_COUNT);
    frame with = {0}, without = {0};
    trace_settings on_color = w.s;
    memcpy(on_color.background, color, sizeof color);
    on_color.sky = behind;
    for (int i = 0; i < 24; i++) { /* the last twelve look away from the Gaussians, half of them upward */
        gbt_camera camera = ring_camera(i % 12);
        if (i >= 12) {
            for (int k = 0; k < 3; k++) {
                camera.rotation[6 + k] = -camera.rotation[6 + k];
                camera.rotation[3 + k] = -camera.rotation[3 + k];
            }
            if (i % 2 == 0) /* a quarter turn about the picture's x axis */
                for (int k = 0; k < 3; k++) {
                    const double y = camera.rotation[3 + k], z = camera.rotation[6 + k];
                    camera.rotation[3 + k] = z;
                    camera.rotation[6 + k] = -y;
                }
        }
        assert_ok(frame_render(&with, frame_plain(&r.cloud), &camera, &w.s, false, NULL));
        assert_ok(frame_render(&without, frame_plain(&bare), &camera, &on_color, false, NULL));
        for (size_t p = 0; p < 3 * (size_t)camera.width * (size_t)camera.height; p++)
            if (!(fabsf(with.rgb.pixels[p] - without.rgb.pixels[p]) < 2.0f / 255)) /* seen from another place
                                                                                    */
                fail_msg("camera %d, value %zu: %g, on the colour %g", i, p, (double)with.rgb.pixels[p],
                         (double)without.rgb.pixels[p]);
    }
    frame_free(&with);
    frame_free(&without);
    gaussian_cloud_free(&bare);
    gaussian_cloud_free(&r.cloud);
    free_world(&w);
}

/* What is kept has the values that it has among all, and is more of the picture than what is left out. */
static void the_most_blended_are_kept(void **state)
{
    (void)state;
    world w;
    make_world(&w, false);
    bake_result all, some;
    bake_def def = bake_def_default();
    assert_ok(bake_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, w.of_cameras, &def, &all, NULL));
    def.count_max = all.cloud.count / 2;
    assert_ok(bake_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, w.of_cameras, &def, &some, NULL));
    assert_int_equal(some.cloud.count, def.count_max);
    assert_int_equal(some.thinned, all.cloud.count - def.count_max);
    assert_int_equal(some.unseen, all.unseen);
    size_t from = 0, left_out = 0;
    gaussian_cloud others;
    assert_ok(gaussian_cloud_alloc(&others, some.thinned, NULL));
    others.sh_degree = all.cloud.sh_degree;
    for (size_t i = 0; i < all.cloud.count; i++) {
        if (from < some.cloud.count &&
            memcmp(all.cloud.mean + 3 * i, some.cloud.mean + 3 * from, 3 * sizeof(float)) == 0) {
            assert_memory_equal(all.cloud.sh + 48 * i, some.cloud.sh + 48 * from, 48 * sizeof(float));
            assert_true(all.cloud.opacity[i] == some.cloud.opacity[from]);
            from++;
            continue;
        }
        assert_true(left_out < some.thinned);
        memcpy(others.mean + 3 * left_out, all.cloud.mean + 3 * i, 3 * sizeof(float));
        memcpy(others.scale_log + 3 * left_out, all.cloud.scale_log + 3 * i, 3 * sizeof(float));
        memcpy(others.quat + 4 * left_out, all.cloud.quat + 4 * i, 4 * sizeof(float));
        memcpy(others.sh + 48 * left_out, all.cloud.sh + 48 * i, 48 * sizeof(float));
        others.opacity[left_out++] = all.cloud.opacity[i];
    }
    assert_int_equal(from, some.cloud.count);
    assert_int_equal(left_out, some.thinned);
    assert_true(likeness(&w, &some.cloud) > likeness(&w, &others));
    gaussian_cloud_free(&others);
    gaussian_cloud_free(&all.cloud);
    gaussian_cloud_free(&some.cloud);
    free_world(&w);
}

/* A disc thinner than any file may say is as thick as they may after a step, and none is turned into nothing.
 */
static void refined_scales_stay_in_their_limits(void **state)
{
    (void)state;
    world w;
    bake_result r;
    refine_def def = refine_def_default();
    make_world(&w, false);
    bake_world(&w, 1, 0.3, &r);
    for (size_t i = 0; i < r.cloud.count; i++)
        r.cloud.scale_log[3 * i + i % 3] = -20;
    def.steps = 1;
    assert_ok(refine_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, w.of_cameras, &def, &r.cloud, NULL));
    for (size_t i = 0; i < r.cloud.count; i++) {
        const float *s = r.cloud.scale_log + 3 * i, *q = r.cloud.quat + 4 * i;
        const float most = fmaxf(s[0], fmaxf(s[1], s[2])), least = fminf(s[0], fminf(s[1], s[2]));
        assert_near((double)(most - least), log(GAUSSIAN_SCALE_RATIO), 1e-4);
        assert_near((double)(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), 1, 1e-5);
    }
    gaussian_cloud_free(&r.cloud);
    free_world(&w);
}

/* What all cameras but one cut away as too near is what that one sees. */
static void each_camera_has_its_near_distance(void **state)
{
    (void)state;
    world w;
    make_world(&w, true);
    size_t kept[3];
    for (int round = 0; round < 3; round++) { /* all see all; none sees a thing; one sees all */
        for (int i = 0; i < CAMERAS; i++)
            w.of_cameras[i].t_near = round == 0 || (round == 2 && i == 1) ? w.s.t_near : 1e6f;
        bake_result r;
        bake_def def = bake_def_default();
        gbt_error err = {0};
        const gbt_status status =
            bake_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, w.of_cameras, &def, &r, &err);
        assert_int_equal(status, round == 1 ? GBT_ERR_ARGUMENT : GBT_OK);
        kept[round] = status == GBT_OK ? r.cloud.count : 0;
        gaussian_cloud_free(&r.cloud);
    }
    assert_true(kept[2] > 0 && kept[2] <= kept[0]);
    free_world(&w);
}

static void refusals(void **state)
{
    (void)state;
    world w;
    make_world(&w, false);
    bake_result r;
    bake_def def = bake_def_default();
    gbt_error err = {0};
    def.sh_degree = 4;
    assert_int_equal(bake_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, w.of_cameras, &def, &r, &err),
                     GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "degree 4"));
    def.sh_degree = 3;
    err = (gbt_error){0};
    assert_int_equal(bake_cloud(&w.f, &w.a, &w.d, NULL, 0, w.of_cameras, &def, &r, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "no camera sees"));
    free_world(&w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_lost_without_directions),
        cmocka_unit_test(more_functions_and_steps_come_nearer),
        cmocka_unit_test(opacities_and_colors_are_means),
        cmocka_unit_test(same_bits_for_all_threads),
        cmocka_unit_test(a_backdrop_stands_for_the_background),
        cmocka_unit_test(the_most_blended_are_kept),
        cmocka_unit_test(refined_scales_stay_in_their_limits),
        cmocka_unit_test(each_camera_has_its_near_distance),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
