/* tests/bake/test_bake.c -- spherical harmonics, the adjoint of plain Gaussians' colours and shapes, baked models against their networks. */
#include "anchor/fixture.h"
#include "bake/bake.h"
#include "bake/refine.h"
#include "bake/sh.h"
#include "base/near.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "image/metrics.h"

enum { ANCHORS = 150, OFFSETS = 2, CAMERAS = 12, W = 48, H = 36 };

/* ---- spherical harmonics ---------------------------------------------------------------------------------------------------------- */

static void basis_is_orthonormal(void **state)
{
    (void)state;
    enum { N = 20000 };
    double product[16][16] = {{0}};
    for (int i = 0; i < N; i++) {
        const double z = 1 - (2 * i + 1.0) / N, r = sqrt(1 - z * z), turn = i * 2.399963229728653;
        float y[16];
        sh_basis((const float[3]){(float)(r * cos(turn)), (float)(r * sin(turn)), (float)z}, y);
        for (int k = 0; k < 16; k++)
            for (int l = 0; l < 16; l++)
                product[k][l] += 4 * 3.14159265358979 / N * (double)y[k] * (double)y[l];
    }
    for (int k = 0; k < 16; k++)
        for (int l = 0; l < 16; l++)
            assert_near(product[k][l], k == l, 1e-4);
}

/* Half a turn about z, which .glb files need: every second function changes its sign. */
static void half_a_turn(void **state)
{
    (void)state;
    for (uint64_t i = 0; i < 100; i++) {
        double d[3] = {rng_normal(1, 1, i), rng_normal(1, 2, i), rng_normal(1, 3, i)};
        dvec_normalize(d);
        float y[16], turned[16];
        sh_basis((const float[3]){(float)d[0], (float)d[1], (float)d[2]}, y);
        sh_basis((const float[3]){(float)-d[0], (float)-d[1], (float)d[2]}, turned);
        for (int k = 0; k < 16; k++)
            assert_near((double)turned[k], k % 2 == 0 ? (double)y[k] : -(double)y[k], 2e-6);
    }
}

/* ---- adjoint ---------------------------------------------------------------------------------------------------------------------- */

static gbt_camera ring_camera(int i)
{
    const double turn = 6.283185307179586 * i / CAMERAS, distance = 7;
    gbt_camera camera = {.model = GBT_CAMERA_PINHOLE, .width = W, .height = H, .params = {50, 50, 0.5 * W, 0.5 * H}};
    const double forward[3] = {-cos(turn), -0.3 * sin(3 * turn), -sin(turn)};
    double z[3] = {forward[0], forward[1], forward[2]}, x[3], y[3];
    dvec_normalize(z);
    dvec_cross((const double[3]){0, 1, 0}, z, x);
    dvec_normalize(x);
    dvec_cross(z, x, y);
    for (int k = 0; k < 3; k++)
        camera.rotation[k] = x[k], camera.rotation[3 + k] = y[k], camera.rotation[6 + k] = z[k], camera.center[k] = -distance * z[k];
    return camera;
}

static void random_cloud(gaussian_cloud *c, size_t count)
{
    assert_ok(gaussian_cloud_alloc(c, count, NULL));
    c->sh_degree = 3;
    for (size_t i = 0; i < count; i++) {
        double q[4], length = 0;
        for (uint64_t k = 0; k < 4; k++)
            q[k] = rng_normal(3, 1, 4 * i + k), length += q[k] * q[k];
        for (size_t k = 0; k < 4; k++)
            c->quat[4 * i + k] = (float)(q[k] / sqrt(length));
        for (size_t k = 0; k < 3; k++)
            c->mean[3 * i + k] = spread(3, 2, 3 * i + k, -1.5f, 1.5f), c->scale_log[3 * i + k] = spread(3, 3, 3 * i + k, -2.5f, -0.7f);
        c->opacity[i] = spread(3, 4, i, 0.1f, 0.9f);
        for (size_t k = 0; k < 48; k++)
            c->sh[48 * i + k] = spread(3, 5, 48 * i + k, -0.8f, 0.8f);
    }
}

/* The tracer's adjoint has its own tests: here it is taken as it is, and the way from the cloud's parameters to its fields is differentiated in double. */
static void adjoint_of_colors_and_shapes(void **state)
{
    (void)state;
    enum { COUNT = 60 };
    gaussian_cloud cloud, d;
    random_cloud(&cloud, COUNT);
    assert_ok(gaussian_cloud_alloc(&d, COUNT, NULL));
    for (int wide = 0; wide < 2; wide++) {
        const trace_settings settings = trace_settings_default();
        const gbt_camera camera = ring_camera(1);
        cloud_frame f = {.footprint = wide ? 0.3f : 0};
        assert_ok(cloud_frame_render(&f, &cloud, &camera, &settings, true, NULL));
        image d_image;
        assert_ok(image_alloc(&d_image, W, H, 3, NULL));
        for (size_t i = 0; i < 3 * W * H; i++)
            d_image.pixels[i] = spread(4, 1, i, -1, 1);
        float weight[COUNT];
        assert_ok(cloud_frame_backward(&f, &cloud, &d_image, &d, weight, NULL));
        size_t cut = 0, seen = 0;
        for (size_t i = 0; i < COUNT; i++) {
            double direction[3];
            for (size_t k = 0; k < 3; k++)
                direction[k] = (double)cloud.mean[3 * i + k] - camera.center[k];
            dvec_normalize(direction);
            float y[16];
            sh_basis((const float[3]){(float)direction[0], (float)direction[1], (float)direction[2]}, y);
            const float *const field[3] = {f.seen.red, f.seen.green, f.seen.blue}, *const d_field[3] = {f.d_seen.red, f.d_seen.green, f.d_seen.blue};
            const float *const d_scale[3] = {f.d_seen.scale_x, f.d_seen.scale_y, f.d_seen.scale_z};
            seen += weight[i] > 0;
            for (size_t c = 0; c < 3; c++) {
                double color = 0.5;
                for (size_t k = 0; k < 16; k++)
                    color += (double)y[k] * (double)cloud.sh[48 * i + 3 * k + c];
                assert_near((double)field[c][i], fmax(color, 0), 1e-6);
                cut += color < 0;
                for (size_t k = 0; k < 16; k++)
                    assert_near((double)d.sh[48 * i + 3 * k + c], color > 0 ? (double)y[k] * (double)d_field[c][i] : 0, 1e-5 * (1 + fabs((double)d_field[c][i])));
                const double scale = exp((double)cloud.scale_log[3 * i + c]);
                assert_near((double)d.scale_log[3 * i + c], scale * (double)d_scale[c][i], 1e-5 * (1 + fabs((double)d_scale[c][i])));
            }
            assert_near((double)d.opacity[i], (double)f.d_seen.opacity[i], 0);
        }
        assert_true(cut > 5 && seen > COUNT / 2);
        image_free(&d_image);
        cloud_frame_free(&f);
    }
    gaussian_cloud_free(&cloud);
    gaussian_cloud_free(&d);
}

/* ---- baking ------------------------------------------------------------------------------------------------------------------------- */

typedef struct world {
    anchors a;
    decoder d;
    trace_settings s;
    gbt_camera cameras[CAMERAS];
    frame f;
} world;

/* `blind`: networks that do not look at the direction, so that a bake loses nothing. */
static void make_world(world *w, bool blind)
{
    *w = (world){.a = random_anchors(ANCHORS, OFFSETS, 5), .d = random_decoder(OFFSETS, true, 9), .s = trace_settings_default(), .f.draw.footprint = 0.1f};
    for (size_t i = 0; i < ANCHORS; i++)
        for (size_t k = 0; k < 6; k++)
            w->a.scale_log[6 * i + k] = spread(5, 200 + k, i, -2.5f, -0.5f);
    decoder_part parts[3];
    decoder_parts(&w->d, parts);
    for (size_t i = 0; i < OFFSETS; i++)
        w->d.params[parts[0].end - 1 - i] = 0.7f;
    const size_t inputs = ANCHOR_FEATURE_DIM + 4;
    for (int head = 0; head < 3 && blind; head++)
        for (size_t h = 0; h < ANCHOR_HIDDEN_DIM; h++)
            memset(w->d.params + parts[head].begin + h * inputs + ANCHOR_FEATURE_DIM, 0, 4 * sizeof(float));
    for (int i = 0; i < CAMERAS; i++)
        w->cameras[i] = ring_camera(i);
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
    cloud_frame f = {.footprint = w->f.draw.footprint};
    double sum = 0;
    for (int i = 0; i < 4; i++) {
        gbt_camera camera = ring_camera(3 * i);
        camera.center[1] += 0.3;
        assert_ok(frame_render(&w->f, &w->a, &w->d, &camera, &w->s, false, NULL));
        assert_ok(cloud_frame_render(&f, cloud, &camera, &w->s, false, NULL));
        sum += metric_psnr(&f.rgb, &w->f.rgb) / 4;
    }
    cloud_frame_free(&f);
    return sum;
}

static void bake_world(world *w, int degree, double prior, bake_result *out)
{
    bake_def def = bake_def_default();
    def.sh_degree = degree, def.prior = prior;
    assert_ok(bake_cloud(&w->f, &w->a, &w->d, w->cameras, CAMERAS, &w->s, &def, out, NULL));
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
    assert_ok(refine_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, &w.s, &def, &r.cloud, NULL));
    const double refined = likeness(&w, &r.cloud);
    if (!(constant < baked && baked < refined && refined > 35))
        fail_msg("degree 0: %.2f dB, 3: %.2f, refined: %.2f", constant, baked, refined);
    gaussian_cloud_free(&flat.cloud);
    gaussian_cloud_free(&r.cloud);
    free_world(&w);
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
        assert_ok(refine_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, &w.s, &def, &r.cloud, NULL));
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

static void refusals(void **state)
{
    (void)state;
    world w;
    make_world(&w, false);
    bake_result r;
    bake_def def = bake_def_default();
    gbt_error err = {0};
    def.sh_degree = 4;
    assert_int_equal(bake_cloud(&w.f, &w.a, &w.d, w.cameras, CAMERAS, &w.s, &def, &r, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "degree 4"));
    def.sh_degree = 3;
    err = (gbt_error){0};
    assert_int_equal(bake_cloud(&w.f, &w.a, &w.d, NULL, 0, &w.s, &def, &r, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "no camera sees"));
    free_world(&w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(basis_is_orthonormal),
        cmocka_unit_test(half_a_turn),
        cmocka_unit_test(adjoint_of_colors_and_shapes),
        cmocka_unit_test(nothing_is_lost_without_directions),
        cmocka_unit_test(more_functions_and_steps_come_nearer),
        cmocka_unit_test(same_bits_for_all_threads),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
