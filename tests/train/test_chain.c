/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_chain.c -- the training loss as a function of the anchors and networks: its gradient in
   double against differences, and the float32 chain (frame_render, train/loss.h, the adjoint) against the
   gradient in double. */
#include "reference/decode_ref.h"
#include "anchor/fixture.h"
#include "base/near.h"
#include "base/parallel.h"
#include "image/metrics.h"
#include "trace/footprint_one.h"
#include "trace/reference.h"
#include "frame/frame.h"
#include "train/loss.h"

enum { OFFSETS = 5, WIDTH = 20, HEIGHT = 14, RAYS = WIDTH * HEIGHT, CLASS_COUNT = 6, RADIUS = 5 };
static const char *const class_names[CLASS_COUNT] = {"feature",     "offset",    "scale",
                                                     "opacity mlp", "shape mlp", "colour mlp"};
static const double dssim_weight = 0.2, volume_weight = 0.01;

/* One small view. The visible anchors, the rays and the Gaussians that count are those of the float32 frame;
   all else is in double. */
typedef struct view {
    anchors a;
    decoder d;
    gbt_camera camera;
    trace_settings s;
    image photo;
    frame f;
    decode_ref p;
    double center[3];
    double *slots;              /* [visible * K][14] */
    reference_scene g;          /* the slots that became Gaussians */
    footprint_gaussian *narrow; /* [g.count], before they are widened */
    double rgb[3 * RAYS];
} view;

static void make_view(view *v, uint64_t seed, bool has_distance)
{
    memset(v, 0, sizeof *v);
    const size_t count = 8 + seed % 5;
    v->a = random_anchors(count, OFFSETS, seed);
    v->d = random_decoder(OFFSETS, has_distance, seed + 1000);
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < 6; k++)
            v->a.scale_log[6 * i + k] = spread(seed, 200 + k, i, -1.5f, -0.2f);
    v->a.scale_log[6 * (seed % count) + 3 + seed % 3] =
        -14; /* a sheet or needle that the least ratio of scales holds */
    decoder_network networks[3];
    decoder_networks(&v->d, networks);
    for (size_t i = 0; i < OFFSETS; i++) /* biases of the opacities: most Gaussians are there */
        v->d.params[networks[0].end - 1 - i] = 0.7f;
    v->s = trace_settings_default();
    v->s.background[0] = 0.2f;
    v->s.background[1] = 0.4f;
    v->s.background[2] = 0.3f;
    v->camera = (gbt_camera){.model = GBT_CAMERA_PINHOLE,
                             .width = WIDTH,
                             .height = HEIGHT,
                             .params = {16, 16, 0.5 * WIDTH, 0.5 * HEIGHT},
                             .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                             .center = {0.25, -0.125, -5}};
    for (int k = 0; k < 3; k++)
        v->center[k] = v->camera.center[k]; /* exact in float */
    assert_ok(image_alloc(&v->photo, WIDTH, HEIGHT, 3, NULL));
    for (size_t i = 0; i < 3 * RAYS; i++)
        v->photo.pixels[i] = rng_uniform(seed, 300, i);
    v->f.draw.footprint = seed % 3 == 0 ? 0 : 0.25f; /* some with rays as wide as pixels */
    assert_ok(frame_render(&v->f, frame_neural(&v->a, &v->d), &v->camera, &v->s, true, NULL));
    assert_true(v->f.visible_count >= 6 && v->f.gaussians.count >= 12);
    assert_ok(decode_ref_load(&v->p, &v->a, &v->d, NULL));
    v->slots = mem_calloc(v->f.visible_count * OFFSETS, DECODE_REF_FIELDS * sizeof *v->slots, "test", NULL);
    assert_ok(reference_scene_make(frame_drawn(&v->f), &v->g, NULL));
    v->narrow = mem_alloc(v->g.count, sizeof *v->narrow, "test", NULL);
}

static void view_free(view *v)
{
    anchors_free(&v->a);
    decoder_free(&v->d);
    image_free(&v->photo);
    frame_free(&v->f);
    decode_ref_free(&v->p);
    mem_free(v->slots);
    mem_free(v->narrow);
    reference_scene_free(&v->g);
}

/* ---- the loss in double ---- */

static double tap(int dx, int dy)
{
    double sum = 0;
    for (int k = -RADIUS; k <= RADIUS; k++)
        sum += exp(-k * k / (2 * 1.5 * 1.5));
    return exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5)) / (sum * sum);
}

/* (1 - w) mean|x - y| + w (1 - mean SSIM); its gradient into d_x unless that is NULL: one window at a time,
   spread over its 121 pixels. */
static double image_term(const double *x, const float *y, double *d_x)
{
    const double c1 = 1e-4, c2 = 9e-4, values = 3.0 * RAYS;
    double taps[11][11], loss = 0;
    for (int j = 0; j < 11; j++)
        for (int i = 0; i < 11; i++)
            taps[j][i] = tap(i - RADIUS, j - RADIUS);
    for (size_t i = 0; i < 3 * RAYS; i++) {
        const double off = x[i] - (double)y[i];
        loss += (1 - dssim_weight) * fabs(off) / values;
        if (d_x != NULL)
            d_x[i] = (1 - dssim_weight) / values * ((off > 0) - (off < 0));
    }
    for (int row = 0; row < HEIGHT; row++)
        for (int column = 0; column < WIDTH; column++)
            for (int c = 0; c < 3; c++) {
                double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
                for (int pass = 0; pass < 2; pass++) {
                    const double va = aa - a * a, vb = bb - b * b, cov = ab - a * b;
                    const double n1 = 2 * a * b + c1, n2 = 2 * cov + c2, d1 = a * a + b * b + c1,
                                 d2 = va + vb + c2, ssim = n1 * n2 / (d1 * d2);
                    if (pass == 1) {
                        loss += dssim_weight * (1 - ssim) / values;
                        if (d_x == NULL)
                            break;
                    }
                    for (int dy = -RADIUS; dy <= RADIUS; dy++)
                        for (int dx = -RADIUS; dx <= RADIUS; dx++) {
                            if (row + dy < 0 || row + dy >= HEIGHT || column + dx < 0 || column + dx >= WIDTH)
                                continue;
                            const size_t at = (size_t)(3 * ((row + dy) * WIDTH + column + dx) + c);
                            const double t = taps[dy + RADIUS][dx + RADIUS], p = x[at], q = (double)y[at];
                            if (pass == 0) {
                                a += t * p;
                                b += t * q;
                                aa += t * p * p;
                                bb += t * q * q;
                                ab += t * p * q;
                                continue;
                            }
                            /* d(ssim)/dp by d(mean) = t, d(var) = 2 t (p - a), d(cov) = t (q - b) */
                            const double d_ssim =
                                t * ssim * (2 * b / n1 + 2 * (q - b) / n2 - 2 * a / d1 - 2 * (p - a) / d2);
                            d_x[at] -= dssim_weight / values * d_ssim;
                        }
                }
            }
    return loss;
}

/* The loss at v->p; leaves v->slots, v->g and v->rgb. */
static double loss_of(view *v)
{
    decode_ref_forward(&v->p, v->center, v->f.visible, v->f.visible_count, v->slots);
    double volume = 0;
    for (size_t i = 0; i < v->g.count; i++) {
        double *slot = v->slots + v->f.tape.slot[i] * (size_t)DECODE_REF_FIELDS;
        volume += slot[3] * slot[4] * slot[5];
        memcpy(&v->narrow[i], slot, sizeof *v->narrow);
        frame_widen_exact(&v->f, i, slot);
        for (size_t k = 0; k < DECODE_REF_FIELDS; k++)
            v->g.fields[k * v->g.count + i] = slot[k];
    }
    assert_ok(reference_scene_forward(&v->g, &v->s, &v->f.rays, v->rgb, NULL, NULL, NULL));
    return image_term(v->rgb, v->photo.pixels, NULL) + volume_weight * volume / (double)v->g.count;
}

/* Its gradient: decode_ref_backward o reference_scene_backward o image_term. */
static void gradient_of(view *v, decode_ref *out)
{
    loss_of(v);
    double d_rgb[3 * RAYS];
    image_term(v->rgb, v->photo.pixels, d_rgb);
    const size_t n = v->g.count;
    double *d = mem_calloc(n, GAUSSIANS_FIELD_COUNT * sizeof *d, "test", NULL);
    double *d_slots =
        mem_calloc(v->f.visible_count * OFFSETS, DECODE_REF_FIELDS * sizeof *d_slots, "test", NULL);
    assert_ok(reference_scene_backward(&v->g, &v->s, &v->f.rays, d_rgb, NULL, d, NULL));
    for (size_t i = 0; i < n; i++) {
        double *to = d_slots + v->f.tape.slot[i] * (size_t)DECODE_REF_FIELDS;
        for (size_t k = 0; k < DECODE_REF_FIELDS; k++)
            to[k] = d[k * n + i];
        const footprint_gaussian *g = &v->narrow[i];
        if (v->f.widened) {
            footprint_gaussian back;
            memcpy(&back, to, sizeof back);
            assert_ok(footprint_adjoint(&v->f.view, v->f.draw.footprint, 0, g, &back));
            memcpy(to, &back, sizeof back);
        }
        for (size_t k = 0; k < 3; k++)
            to[3 + k] += volume_weight / (double)n * g->scale[(k + 1) % 3] * g->scale[(k + 2) % 3];
    }
    assert_ok(decode_ref_zero(out, &v->p, NULL));
    decode_ref_backward(&v->p, v->center, v->f.visible, v->f.visible_count, d_slots, out);
    mem_free(d);
    mem_free(d_slots);
}

static size_t class_of(const decoder *d, decode_ref *r, int class, double **out)
{
    decoder_network networks[3];
    decoder_networks(d, networks);
    switch (class) {
    case 0:
        *out = r->feature;
        return r->count * ANCHOR_FEATURE_DIM;
    case 1:
        *out = r->offset;
        return r->count * OFFSETS * 3;
    case 2:
        *out = r->scale_log;
        return r->count * 6;
    default:
        *out = r->params + networks[class - 3].begin;
        return networks[class - 3].end - networks[class - 3].begin;
    }
}

/* ---- tests ---- */

/* Single parameters, those with the largest gradient and random ones; the difference of two steps tells where
   a cut was crossed. */
static void gradient_in_double_agrees_with_differences(void **state)
{
    (void)state;
    enum { SEEDS = 3, PARAMETERS = 24 };
    double worst[CLASS_COUNT] = {0};
    size_t tested[CLASS_COUNT] = {0}, crossed = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        view v;
        make_view(&v, seed, seed % 2 == 0);
        decode_ref gradient;
        gradient_of(&v, &gradient);
        for (int class = 0; class < CLASS_COUNT; class ++) {
            double *value, *got, square = 0, wanted_square = 0, largest = 0;
            const size_t count = class_of(&v.d, &v.p, class, &value);
            class_of(&v.d, &gradient, class, &got);
            for (size_t i = 0; i < count; i++)
                largest = fmax(largest, fabs(got[i]));
            for (uint64_t k = 0, drawn = 0; k < PARAMETERS && drawn < 5000; drawn++) {
                const size_t i =
                    (size_t)(rng_uniform(seed, 400 + (uint64_t) class, drawn) * (float)count) % count;
                if (fabs(got[i]) < 0.05 * largest) /* elsewhere a difference is rounding; the whole gradient
                                                      is compared along directions below */
                    continue;
                k++;
                const double keep = value[i], h = 1e-5;
                double difference[2];
                for (int half = 0; half < 2; half++) {
                    const double step = half ? h / 2 : h;
                    value[i] = keep + step;
                    const double high = loss_of(&v);
                    value[i] = keep - step;
                    difference[half] = (high - loss_of(&v)) / (2 * step);
                }
                value[i] = keep;
                if (fabs(difference[0] - difference[1]) > 1e-6 * largest) {
                    crossed++;
                    continue;
                }
                const double wanted =
                    (4 * difference[1] - difference[0]) / 3; /* without the error of second order */
                square += (got[i] - wanted) * (got[i] - wanted);
                wanted_square += wanted * wanted;
                tested[class]++;
            }
            const double error = sqrt(square / wanted_square);
            worst[class] = fmax(worst[class], error);
            if (!(error <= 1e-6))
                fail_msg("seed %d, %s: relative error %.3g", (int)seed, class_names[class], error);
        }
        decode_ref_free(&gradient);
        view_free(&v);
    }
    for (int class = 0; class < CLASS_COUNT; class ++) {
        print_message("%-12s worst relative L2 error %.1e in %zu parameters\n", class_names[class],
                      worst[class], tested[class]);
        assert_true(tested[class] >= SEEDS * PARAMETERS / 2);
    }
    print_message("%zu differences crossed a cut\n", crossed);
}

/* Along normally distributed directions of a whole class, so that parameters with small gradients count too:
   E[(d . (g - g'))^2] = |g - g'|^2. */
static void no_parameter_is_forgotten(void **state)
{
    (void)state;
    enum { DIRECTIONS = 6 };
    view v;
    make_view(&v, 3, true);
    decode_ref gradient;
    gradient_of(&v, &gradient);
    for (int class = 0; class < CLASS_COUNT; class ++) {
        double *value, *got, square = 0, norm = 0;
        const size_t count = class_of(&v.d, &v.p, class, &value);
        class_of(&v.d, &gradient, class, &got);
        double *direction = mem_alloc(count, sizeof *direction, "test", NULL),
               *keep = mem_alloc(count, sizeof *keep, "test", NULL);
        memcpy(keep, value, count * sizeof *keep);
        for (size_t i = 0; i < count; i++)
            norm += got[i] * got[i];
        int measured = 0;
        for (uint64_t attempt = 0; measured < DIRECTIONS && attempt < 60; attempt++) {
            double along = 0, side[3];
            const double h = 1e-6;
            for (size_t i = 0; i < count; i++) {
                direction[i] = rng_normal(500 + (uint64_t) class, attempt, i);
                along += direction[i] * got[i];
            }
            for (int k = 0; k < 3; k++) {
                for (size_t i = 0; i < count; i++)
                    value[i] = keep[i] + (k - 1) * h * direction[i];
                side[k] = loss_of(&v);
            }
            memcpy(value, keep, count * sizeof *keep);
            if (fabs(side[2] + side[0] - 2 * side[1]) > 1e-4 * h * sqrt(norm)) /* a jump or a kink: smooth
                                                                                  ones are of order h^2 */
                continue;
            square += pow(along - (side[2] - side[0]) / (2 * h), 2);
            measured++;
        }
        const double error = sqrt(square / DIRECTIONS / norm);
        print_message("%-12s relative error along %d directions %.1e\n", class_names[class], measured, error);
        assert_int_equal(measured, DIRECTIONS);
        assert_true(error <= 1e-6);
        mem_free(direction);
        mem_free(keep);
    }
    decode_ref_free(&gradient);
    view_free(&v);
}

static void float_chain_agrees_with_double(void **state)
{
    (void)state;
    enum { SEEDS = 8 };
    double worst[CLASS_COUNT] = {0}, worst_image = 0, worst_loss = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        view v;
        make_view(&v, 20 + seed, seed % 2 == 1);
        decode_ref wanted;
        gradient_of(&v, &wanted);
        for (size_t i = 0; i < 3 * RAYS; i++)
            worst_image = fmax(worst_image, fabs((double)v.f.rgb.pixels[i] - v.rgb[i]));
        loss_scratch scratch = {0};
        image d_image;
        image_loss_result loss;
        assert_ok(image_alloc(&d_image, WIDTH, HEIGHT, 3, NULL));
        assert_ok(loss_of_image(&v.f.rgb, &v.photo, NULL, &scratch, &d_image, &loss, NULL));
        worst_loss = fmax(worst_loss,
                          fabs(loss.loss + loss_of_gaussians(&v.f.gaussians, volume_weight) - loss_of(&v)));
        anchors d_anchors = {.offset_count = OFFSETS};
        assert_ok(anchors_resize(&d_anchors, v.a.count, NULL));
        float *d_params = mem_calloc(v.d.param_count, sizeof *d_params, "test", NULL);
        assert_ok(frame_backward_gaussians(&v.f, &d_image, NULL));
        loss_add_gradient(&v.f.gaussians, volume_weight, &v.f.d_gaussians);
        assert_ok(frame_backward_anchors(&v.f, &v.a, &v.d, &d_anchors, d_params, NULL));
        for (int class = 0; class < CLASS_COUNT; class ++) {
            decoder_network networks[3];
            decoder_networks(&v.d, networks);
            const float *got[CLASS_COUNT] = {d_anchors.feature,
                                             d_anchors.offset,
                                             d_anchors.scale_log,
                                             d_params + networks[0].begin,
                                             d_params + networks[1].begin,
                                             d_params + networks[2].begin};
            double *w, square = 0, norm = 0;
            const size_t count = class_of(&v.d, &wanted, class, &w);
            for (size_t i = 0; i < count; i++) {
                square += pow((double)got[class][i] - w[i], 2);
                norm += w[i] * w[i];
            }
            const double error = sqrt(square / norm);
            worst[class] = fmax(worst[class], error);
            if (!(error <= 1e-5))
                fail_msg("seed %d, %s: relative L2 error %.3g", (int)seed, class_names[class], error);
        }
        loss_scratch_free(&scratch);
        image_free(&d_image);
        anchors_free(&d_anchors);
        mem_free(d_params);
        decode_ref_free(&wanted);
        view_free(&v);
    }
    print_message("image within %.1e, loss within %.1e\n", worst_image, worst_loss);
    for (int class = 0; class < CLASS_COUNT; class ++)
        print_message("%-12s worst relative L2 error %.1e\n", class_names[class], worst[class]);
    assert_true(worst_image <= 2e-6 && worst_loss <= 1e-7);
}

/* The whole chain, bit for bit, for any number of threads. */
static void threads_give_the_same_bits(void **state)
{
    (void)state;
    const int before = parallel_threads();
    uint64_t hash[3];
    for (int threads = 1; threads <= 3; threads++) {
        parallel_set_threads(threads);
        view v;
        make_view(&v, 40, true);
        anchors d_anchors = {.offset_count = OFFSETS};
        assert_ok(anchors_resize(&d_anchors, v.a.count, NULL));
        float *d_params = mem_calloc(v.d.param_count, sizeof *d_params, "test", NULL);
        assert_ok(frame_backward_gaussians(&v.f, &v.photo, NULL));
        loss_add_gradient(&v.f.gaussians, volume_weight, &v.f.d_gaussians);
        assert_ok(frame_backward_anchors(&v.f, &v.a, &v.d, &d_anchors, d_params, NULL));
        uint64_t h = hash_bytes(1, v.f.rgb.pixels, 3 * RAYS * sizeof(float));
        h = hash_bytes(h, d_anchors.feature, v.a.count * ANCHOR_FEATURE_DIM * sizeof(float));
        h = hash_bytes(h, d_anchors.offset, v.a.count * OFFSETS * 3 * sizeof(float));
        h = hash_bytes(h, d_anchors.scale_log, v.a.count * 6 * sizeof(float));
        hash[threads - 1] = hash_bytes(h, d_params, v.d.param_count * sizeof(float));
        anchors_free(&d_anchors);
        mem_free(d_params);
        view_free(&v);
    }
    assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
    parallel_set_threads(before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gradient_in_double_agrees_with_differences),
        cmocka_unit_test(no_parameter_is_forgotten),
        cmocka_unit_test(float_chain_agrees_with_double),
        cmocka_unit_test(threads_give_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
