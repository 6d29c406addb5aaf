/* SPDX-License-Identifier: Apache-2.0 */
/* tests/anchor/test_decode.c -- the fast decoder against the double one, the double adjoint against
   differences, and the edges. */
#include "fixture.h"

#include "reference/decode_ref.h"
#include "base/cpu.h"
#include "base/parallel.h"

static const float camera_center[3] = {-3.0f, 0.7f, 1.1f};

static void widen_camera(double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = (double)camera_center[c];
}

/* In every fifth anchor one axis, or two, so thin that the least ratio of scales holds them. */
static void make_needles(anchors *a)
{
    for (size_t i = 0; i < a->count; i += 5) {
        a->scale_log[i * 6 + 3 + i % 3] = -14.0f;
        if (i % 2 == 0)
            a->scale_log[i * 6 + 3 + (i + 1) % 3] = -13.0f;
    }
}

/* ---- forward ---- */

typedef struct decode_case {
    const char *name;
    size_t count, step;
    int offset_count;
    bool has_distance;
    float opacity_min;
} decode_case;

static decode_case decode_cases[] = {
    {"K = 10, all visible", 501, 1, 10, false, 0.0f},
    {"K = 10, distance, every third", 1400, 3, 10, true, 0.0f},
    {"K = 1", 300, 1, 1, false, 0.0f},
    {"K = 1, distance", 121, 2, 1, true, 0.0f},
    {"K = 16", 250, 1, 16, true, 0.0f},
    {"K = 3, one visible", 40, 40, 3, false, 0.0f},
    {"all slots kept", 130, 1, 10, true, -2.0f},
    {"threshold above 0", 240, 1, 10, false, 0.05f},
};

static void forward_agrees_with_double(void **state)
{
    const decode_case *c = *state;
    anchors a = random_anchors(c->count, c->offset_count, 11);
    decoder d = random_decoder(c->offset_count, c->has_distance, 12);
    make_needles(&a);
    size_t visible_count;
    uint32_t *visible = every(c->count, c->step, &visible_count);
    gaussians g = {0};
    decode_tape tape = {0};
    assert_ok(decode_forward(&a, &d, camera_center, visible, visible_count, c->opacity_min, &g, &tape, NULL));

    decode_ref r;
    assert_ok(decode_ref_load(&r, &a, &d, NULL));
    const size_t slots = visible_count * (size_t)c->offset_count;
    double *want = mem_calloc(slots, DECODE_REF_FIELDS * sizeof *want, "test", NULL), camera[3];
    widen_camera(camera);
    decode_ref_forward(&r, camera, visible, visible_count, want);

    float *fields[GAUSSIANS_FIELD_COUNT];
    field_list(&g, fields);
    assert_true(g.count > 0);
    size_t at = 0;
    for (size_t slot = 0; slot < slots; slot++) {
        const double *w = want + slot * DECODE_REF_FIELDS, margin = w[10] - (double)c->opacity_min;
        const bool kept = at < g.count && tape.slot[at] == slot;
        if (fabs(margin) > 1e-6)
            assert_int_equal(kept, margin > 0);
        if (!kept)
            continue;
        for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++) {
            /* Opacity and quaternions come from sums of order 1 that cancel, so their error is relative to
               1. */
            const bool cancels = f == 10 || (f >= 6 && f < 10) || f < 3;
            const double scale = fabs(w[f]) > 1 || !cancels ? fabs(w[f]) : 1;
            if (!(fabs((double)fields[f][at] - w[f]) <= 1e-5 * scale))
                fail_msg("slot %zu field %d: %.9g, not %.9g", slot, f, (double)fields[f][at], w[f]);
        }
        at++;
    }
    assert_int_equal(at, g.count);
    for (size_t v = 0; v < visible_count; v++) {
        double sum = 0;
        for (int k = 0; k < c->offset_count; k++)
            sum += fmax(want[(v * (size_t)c->offset_count + (size_t)k) * DECODE_REF_FIELDS + 10], 0);
        assert_true(fabs((double)tape.opacity_sum[v] - sum) <= 1e-5 * fmax(1, sum));
    }
    for (size_t i = g.count; i % GAUSSIANS_LANES != 0; i++)
        assert_true(g.opacity[i] == 0.0f && g.quat_w[i] == 1.0f);
    mem_free(want);
    mem_free(visible);
    decode_ref_free(&r);
    decode_tape_free(&tape);
    gaussians_free(&g);
    decoder_free(&d);
    anchors_free(&a);
}

/* ---- adjoint in double against differences ---- */

typedef struct gradient_case {
    const char *name;
    int offset_count;
    bool has_distance;
} gradient_case;

static gradient_case gradient_cases[] = {
    {"K = 10", 10, false},
    {"K = 10, distance", 10, true},
    {"K = 1, distance", 1, true},
    {"K = 2", 2, false},
};

enum { FD_ANCHORS = 5 };

static double linear_loss(const decode_ref *r, const uint32_t *visible, size_t visible_count,
                          const double *weight, double *scratch)
{
    double camera[3], sum = 0;
    widen_camera(camera);
    decode_ref_forward(r, camera, visible, visible_count, scratch);
    for (size_t i = 0; i < visible_count * (size_t)r->offset_count * DECODE_REF_FIELDS; i++)
        sum += weight[i] * scratch[i];
    return sum;
}

static void double_adjoint_agrees_with_differences(void **state)
{
    const gradient_case *c = *state;
    anchors a = random_anchors(FD_ANCHORS, c->offset_count, 21);
    decoder d = random_decoder(c->offset_count, c->has_distance, 22);
    a.scale_log[3] = 31.0f;
    a.scale_log[9] = -31.0f;         /* beyond the cut: both must say 0 */
    a.scale_log[4 * 6 + 4] = -14.0f; /* held to a part of the largest scale */
    decode_ref r, grad;
    assert_ok(decode_ref_load(&r, &a, &d, NULL));
    assert_ok(decode_ref_zero(&grad, &r, NULL));
    const uint32_t visible[3] = {0, 1, 4};
    const size_t slots = 3 * (size_t)c->offset_count, fields = slots * DECODE_REF_FIELDS;
    double *weight = mem_alloc(fields, sizeof *weight, "test", NULL),
           *scratch = mem_alloc(fields, sizeof *scratch, "test", NULL);
    double camera[3];
    for (size_t i = 0; i < fields; i++)
        weight[i] = (double)spread(23, 0, i, -1, 1);
    for (size_t s = 0; s < slots; s += 3) /* dropped slots have gradient 0 */
        memset(weight + s * DECODE_REF_FIELDS, 0, DECODE_REF_FIELDS * sizeof *weight);
    for (size_t k = 0; k < (size_t)c->offset_count; k++)
        for (size_t f = 3; f < 6; f++)
            weight[k * DECODE_REF_FIELDS + f] *=
                1e-12; /* a scale of exp(30), and those held to it, would drown every other difference */
    widen_camera(camera);
    decode_ref_backward(&r, camera, visible, 3, weight, &grad);

    double *const values[4] = {r.feature, r.offset, r.scale_log, r.params};
    double *const grads[4] = {grad.feature, grad.offset, grad.scale_log, grad.params};
    const size_t counts[4] = {FD_ANCHORS * 32, FD_ANCHORS * (size_t)c->offset_count * 3, FD_ANCHORS * 6,
                              r.param_count};
    for (int class = 0; class < 4; class ++) {
        size_t nonzero = 0;
        for (size_t i = 0; i < counts[class]; i++) {
            double *p = &values[class][i];
            const double keep = *p, step = 1e-5;
            *p = keep + step;
            const double high = linear_loss(&r, visible, 3, weight, scratch);
            *p = keep - step;
            const double low = linear_loss(&r, visible, 3, weight, scratch);
            *p = keep;
            const double want = (high - low) / (2 * step), got = grads[class][i];
            nonzero += got != 0;
            if (!(fabs(got - want) <= 1e-6 * fmax(1, fabs(want))))
                fail_msg("class %d entry %zu: %.12g, not %.12g", class, i, got, want);
        }
        assert_true(nonzero > 0);
    }
    assert_true(grad.scale_log[3] == 0 && grad.scale_log[9] == 0 && grad.scale_log[4 * 6 + 4] == 0);
    for (size_t i = 2 * 32; i < 4 * 32; i++)
        assert_true(grad.feature[i] == 0); /* anchors 2 and 3 are not visible */
    mem_free(weight);
    mem_free(scratch);
    decode_ref_free(&r);
    decode_ref_free(&grad);
    decoder_free(&d);
    anchors_free(&a);
}

/* ---- float adjoint against the double one ---- */

static double relative_error(const float *got, const double *want, size_t begin, size_t end)
{
    double error = 0, norm = 0;
    for (size_t i = begin; i < end; i++) {
        error += ((double)got[i] - want[i]) * ((double)got[i] - want[i]);
        norm += want[i] * want[i];
    }
    return norm > 0 ? sqrt(error / norm) : error;
}

static void fill_gradient(gaussians *dg, const gaussians *g)
{
    assert_ok(gaussians_resize(dg, g->count, NULL));
    float *fields[GAUSSIANS_FIELD_COUNT];
    field_list(dg, fields);
    for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        for (size_t i = 0; i < g->count; i++)
            fields[f][i] = spread(31, (uint64_t)f, i, -1, 1);
    gaussians_pad(dg);
}

static void adjoint_agrees_with_double(void **state)
{
    const decode_case *c = *state;
    anchors a = random_anchors(c->count, c->offset_count, 11), da = {.offset_count = c->offset_count};
    decoder d = random_decoder(c->offset_count, c->has_distance, 12);
    make_needles(&a);
    a.scale_log[3] = 30.5f;
    a.scale_log[1] = -30.5f;
    size_t visible_count;
    uint32_t *visible = every(c->count, c->step, &visible_count);
    gaussians g = {0}, dg = {0};
    decode_tape tape = {0};
    assert_ok(decode_forward(&a, &d, camera_center, visible, visible_count, c->opacity_min, &g, &tape, NULL));
    fill_gradient(&dg, &g);
    for (size_t i = 0; i < g.count && tape.slot[i] < (uint32_t)c->offset_count; i++)
        dg.scale_x[i] *= 1e-12f; /* anchor 0 has a scale of exp(30) */
    assert_ok(anchors_resize(&da, a.count, NULL));
    float *dp = mem_calloc(d.param_count, sizeof *dp, "test", NULL);
    for (int twice = 0; twice < 2; twice++) /* gradients are added to */
        assert_ok(decode_backward(&a, &d, &tape, &dg, &da, dp, NULL));

    decode_ref r, grad;
    assert_ok(decode_ref_load(&r, &a, &d, NULL));
    assert_ok(decode_ref_zero(&grad, &r, NULL));
    double *d_out = mem_calloc(visible_count * (size_t)c->offset_count, DECODE_REF_FIELDS * sizeof *d_out,
                               "test", NULL),
           camera[3];
    float *fields[GAUSSIANS_FIELD_COUNT];
    field_list(&dg, fields);
    for (size_t i = 0; i < dg.count; i++)
        for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
            d_out[tape.slot[i] * DECODE_REF_FIELDS + (uint32_t)f] = 2 * (double)fields[f][i];
    widen_camera(camera);
    decode_ref_backward(&r, camera, visible, visible_count, d_out, &grad);

    decoder_network networks[3];
    decoder_networks(&d, networks);
    const struct {
        const char *name;
        const float *got;
        const double *want;
        size_t begin, end;
    } classes[] = {
        {"features", da.feature, grad.feature, 0, c->count * 32},
        {"offsets", da.offset, grad.offset, 0, c->count * (size_t)c->offset_count * 3},
        {"log-scales", da.scale_log, grad.scale_log, 0, c->count * 6},
        {"opacity network", dp, grad.params, networks[0].begin, networks[0].end},
        {"shape network", dp, grad.params, networks[1].begin, networks[1].end},
        {"colour network", dp, grad.params, networks[2].begin, networks[2].end},
    };
    for (size_t i = 0; i < 6; i++) {
        const double error =
            relative_error(classes[i].got, classes[i].want, classes[i].begin, classes[i].end);
        if (!(error <= 1e-5))
            fail_msg("%s: relative error %g", classes[i].name, error);
    }
    for (size_t i = 0; i < c->count; i++)
        if (i % c->step != 0)
            for (size_t j = 0; j < 6; j++)
                assert_true(da.scale_log[i * 6 + j] == 0.0f);
    assert_true(da.scale_log[3] == 0.0f && da.scale_log[1] == 0.0f);
    mem_free(d_out);
    mem_free(dp);
    mem_free(visible);
    decode_ref_free(&r);
    decode_ref_free(&grad);
    decode_tape_free(&tape);
    gaussians_free(&g);
    gaussians_free(&dg);
    decoder_free(&d);
    anchors_free(&a);
    anchors_free(&da);
}

static void quaternion_gradient_along_itself_is_ignored(void **state)
{
    (void)state;
    anchors a = random_anchors(30, 4, 5), da = {.offset_count = 4};
    decoder d = random_decoder(4, false, 6);
    size_t visible_count;
    uint32_t *visible = every(30, 1, &visible_count);
    gaussians g = {0}, dg = {0};
    decode_tape tape = {0};
    assert_ok(decode_forward(&a, &d, camera_center, visible, visible_count, 0.0f, &g, &tape, NULL));
    assert_ok(gaussians_resize(&dg, g.count, NULL));
    gaussians_zero(&dg);
    memcpy(dg.quat_w, g.quat_w, g.count * sizeof(float));
    memcpy(dg.quat_x, g.quat_x, g.count * sizeof(float));
    memcpy(dg.quat_y, g.quat_y, g.count * sizeof(float));
    memcpy(dg.quat_z, g.quat_z, g.count * sizeof(float));
    assert_ok(anchors_resize(&da, a.count, NULL));
    float *dp = mem_calloc(d.param_count, sizeof *dp, "test", NULL);
    assert_ok(decode_backward(&a, &d, &tape, &dg, &da, dp, NULL));
    for (size_t i = 0; i < d.param_count; i++)
        assert_true(fabsf(dp[i]) < 1e-4f);
    mem_free(dp);
    mem_free(visible);
    decode_tape_free(&tape);
    gaussians_free(&g);
    gaussians_free(&dg);
    decoder_free(&d);
    anchors_free(&a);
    anchors_free(&da);
}

/* ---- same bits ---- */

static uint64_t decode_hash(int offset_count)
{
    anchors a = random_anchors(1700, offset_count, 41), da = {.offset_count = offset_count};
    decoder d = random_decoder(offset_count, true, 42);
    size_t visible_count;
    uint32_t *visible = every(1700, 2, &visible_count);
    gaussians g = {0}, dg = {0};
    decode_tape tape = {0};
    float *dp = mem_calloc(d.param_count, sizeof *dp, "test", NULL);
    assert_ok(anchors_resize(&da, a.count, NULL));
    assert_ok(decode_forward(&a, &d, camera_center, visible, visible_count, 0.0f, &g, &tape, NULL));
    fill_gradient(&dg, &g);
    assert_ok(decode_backward(&a, &d, &tape, &dg, &da, dp, NULL));
    uint64_t hash = hash_gaussians(1469598103934665603u, &g);
    hash = hash_bytes(hash, tape.slot, g.count * sizeof(uint32_t));
    hash = hash_bytes(hash, tape.opacity_sum, visible_count * sizeof(float));
    hash = hash_bytes(hash, dp, d.param_count * sizeof(float));
    hash = hash_bytes(hash, da.feature, a.count * 32 * sizeof(float));
    hash = hash_bytes(hash, da.offset, a.count * (size_t)offset_count * 3 * sizeof(float));
    hash = hash_bytes(hash, da.scale_log, a.count * 6 * sizeof(float));
    mem_free(dp);
    mem_free(visible);
    decode_tape_free(&tape);
    gaussians_free(&g);
    gaussians_free(&dg);
    decoder_free(&d);
    anchors_free(&a);
    anchors_free(&da);
    return hash;
}

static void same_bits_for_all_threads_and_instructions(void **state)
{
    (void)state;
    const int threads_before = parallel_threads(), threads[] = {1, 2, 3, 8};
    const cpu_isa best = cpu_best_isa();
    for (int offset_count = 5; offset_count <= 10; offset_count += 5) {
        const uint64_t want = decode_hash(offset_count);
        for (int isa = 0; isa <= (int)best; isa++) {
            cpu_limit_isa((cpu_isa)isa);
            for (int t = isa == 0 ? 3 : 0; t < 4; t++) { /* plain C is slow: one count of threads is enough */
                parallel_set_threads(threads[t]);
                assert_true(decode_hash(offset_count) == want);
            }
        }
    }
    cpu_limit_isa(best);
    parallel_set_threads(threads_before);
}

/* ---- edges ---- */

/* Biases of the opacity network, its last K parameters. */
static void set_opacity_bias(decoder *d, float value)
{
    decoder_network networks[3];
    decoder_networks(d, networks);
    for (int k = 0; k < d->offset_count; k++)
        d->params[networks[0].end - 1 - (size_t)k] = value;
}

static void nothing_to_decode(void **state)
{
    (void)state;
    anchors a = random_anchors(20, 10, 1), da = {.offset_count = 10};
    decoder d = random_decoder(10, false, 2);
    assert_ok(anchors_resize(&da, 20, NULL));
    float *dp = mem_calloc(d.param_count, sizeof *dp, "test", NULL);
    size_t visible_count;
    uint32_t *visible = every(20, 1, &visible_count);
    gaussians g = {0}, dg = {0};
    decode_tape tape = {0};
    for (int round = 0; round < 2; round++) { /* no visible anchor; then none with a positive alpha */
        if (round == 1)
            set_opacity_bias(&d, -20.0f);
        assert_ok(decode_forward(&a, &d, camera_center, visible, round == 0 ? 0 : 20, 0.0f, &g, &tape, NULL));
        assert_int_equal(g.count, 0);
        assert_ok(gaussians_resize(&dg, 0, NULL));
        assert_ok(decode_backward(&a, &d, &tape, &dg, &da, dp, NULL));
    }
    for (size_t v = 0; v < 20; v++)
        assert_true(tape.opacity_sum[v] == 0.0f);
    for (size_t i = 0; i < d.param_count; i++)
        assert_true(dp[i] == 0.0f);
    mem_free(dp);
    mem_free(visible);
    decode_tape_free(&tape);
    gaussians_free(&g);
    gaussians_free(&dg);
    decoder_free(&d);
    anchors_free(&a);
    anchors_free(&da);
}

static void threshold_is_strict(void **state)
{
    (void)state;
    anchors a = {.offset_count = 2};
    assert_ok(anchors_resize(&a, 1, NULL));
    decoder d = random_decoder(2, false, 2);
    memset(d.params, 0, d.param_count * sizeof *d.params); /* alpha = tanh(0) = 0 */
    const uint32_t visible[1] = {0};
    gaussians g = {0};
    decode_tape tape = {0};
    assert_ok(decode_forward(&a, &d, camera_center, visible, 1, 0.0f, &g, &tape, NULL));
    assert_int_equal(g.count, 0);
    assert_ok(decode_forward(&a, &d, camera_center, visible, 1, -1e-30f, &g, &tape, NULL));
    assert_int_equal(g.count, 2);
    assert_true(g.scale_x[1] == 0.5f && g.red[0] == 0.5f && g.quat_w[0] == 1.0f && g.quat_x[1] == 0.0f &&
                g.opacity[0] == 0.0f);
    decode_tape_free(&tape);
    gaussians_free(&g);
    decoder_free(&d);
    anchors_free(&a);
}

static void camera_on_an_anchor(void **state)
{
    (void)state;
    anchors a = random_anchors(2, 10, 3);
    memcpy(a.position, camera_center, sizeof camera_center);
    memcpy(a.feature + 32, a.feature, 32 * sizeof(float));
    /* direction (0, 0, 1) */
    a.position[3] = camera_center[0];
    a.position[4] = camera_center[1];
    a.position[5] = camera_center[2] + 0.125f;
    decoder d = random_decoder(10, false, 4);
    const uint32_t visible[2] = {0, 1};
    gaussians g = {0};
    decode_tape tape = {0};
    assert_ok(decode_forward(&a, &d, camera_center, visible, 2, -2.0f, &g, &tape, NULL));
    for (size_t k = 0; k < 10; k++)
        assert_true(g.opacity[k] == g.opacity[10 + k] && g.red[k] == g.red[10 + k]);
    decode_tape_free(&tape);
    gaussians_free(&g);
    decoder_free(&d);
    anchors_free(&a);
}

static void distance_is_cut_to_twice_the_trained_range(void **state)
{
    (void)state;
    anchors a = {.offset_count = 1};
    assert_ok(anchors_resize(&a, 6, NULL));
    /* Along +z: the direction is the same, only the distance differs. Scale 0.4: cut below 0.1 / 0.4 = 0.25
       and above 5 / 0.4 = 12.5. */
    const float z[6] = {0.1f, 0.25f, 0.26f, 12.4f, 12.5f, 90.0f};
    for (size_t i = 0; i < 6; i++)
        a.position[i * 3 + 2] = z[i];
    decoder d = random_decoder(1, true, 9);
    size_t visible_count;
    uint32_t *visible = every(6, 1, &visible_count);
    gaussians g = {0};
    decode_tape tape = {0};
    assert_ok(decode_forward(&a, &d, (const float[3]){0, 0, 0}, visible, 6, -2.0f, &g, &tape, NULL));
    assert_true(fabsf(g.red[0] - g.red[1]) < 1e-7f && g.red[1] != g.red[2] && g.red[3] != g.red[4] &&
                fabsf(g.red[4] - g.red[5]) < 1e-7f);
    decode_tape_free(&tape);
    mem_free(visible);
    gaussians_free(&g);
    decoder_free(&d);
    anchors_free(&a);
}

static void finite_for_wild_parameters(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 20; seed++) {
        anchors a = random_anchors(37, 10, seed);
        decoder d = random_decoder(10, true, seed);
        const float wild[] = {3e38f, -3e38f, 1e30f, -1e20f, 1e-40f, 0.0f};
        for (size_t i = 0; i < 200; i++) {
            const float value = wild[i % 6];
            a.feature[(size_t)(spread(seed, 1, i, 0, 0.999f) * 37 * 32)] = value;
            a.offset[(size_t)(spread(seed, 2, i, 0, 0.999f) * 37 * 30)] = value;
            a.scale_log[(size_t)(spread(seed, 3, i, 0, 0.999f) * 37 * 6)] = value;
            a.position[(size_t)(spread(seed, 4, i, 0, 0.999f) * 37 * 3)] = value;
            d.params[(size_t)(spread(seed, 5, i, 0, 0.999f) * (float)d.param_count)] = value;
        }
        size_t visible_count;
        uint32_t *visible = every(37, 1, &visible_count);
        gaussians g = {0};
        decode_tape tape = {0};
        assert_ok(decode_forward(&a, &d, camera_center, visible, visible_count, -2.0f, &g, &tape, NULL));
        assert_int_equal(g.count, 370);
        float *fields[GAUSSIANS_FIELD_COUNT];
        field_list(&g, fields);
        for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
            for (size_t i = 0; i < g.count; i++)
                if (!isfinite(fields[f][i]) || (f >= 3 && f < 6 && !(fields[f][i] > 0)))
                    fail_msg("seed %llu: field %d of Gaussian %zu is %g", (unsigned long long)seed, f, i,
                             (double)fields[f][i]);
        decode_tape_free(&tape);
        mem_free(visible);
        gaussians_free(&g);
        decoder_free(&d);
        anchors_free(&a);
    }
}

static void wrong_arguments_are_refused(void **state)
{
    (void)state;
    anchors a = random_anchors(5, 10, 1), da = {.offset_count = 10}, other = random_anchors(5, 9, 1);
    decoder d = random_decoder(10, false, 2);
    gaussians g = {0}, dg = {0};
    decode_tape tape = {0};
    gbt_error err = {0};
    const uint32_t lists[3][2] = {{1, 1}, {3, 2}, {0, 5}};
    for (int i = 0; i < 3; i++)
        assert_int_equal(decode_forward(&a, &d, camera_center, lists[i], 2, 0, &g, &tape, &err),
                         GBT_ERR_ARGUMENT);
    assert_string_not_equal(err.text, "");
    const uint32_t visible[2] = {0, 4};
    assert_int_equal(decode_forward(&other, &d, camera_center, visible, 2, 0, &g, &tape, NULL),
                     GBT_ERR_ARGUMENT);
    assert_ok(decode_forward(&a, &d, camera_center, visible, 2, -2.0f, &g, &tape, NULL));
    float *dp = mem_calloc(d.param_count, sizeof *dp, "test", NULL);
    assert_ok(anchors_resize(&da, 5, NULL));
    assert_ok(gaussians_resize(&dg, g.count - 1, NULL));
    assert_int_equal(decode_backward(&a, &d, &tape, &dg, &da, dp, NULL), GBT_ERR_ARGUMENT);
    assert_ok(gaussians_resize(&dg, g.count, NULL));
    assert_ok(anchors_resize(&da, 4, NULL));
    assert_int_equal(decode_backward(&a, &d, &tape, &dg, &da, dp, NULL), GBT_ERR_ARGUMENT);
    assert_int_equal(decode_backward(&a, &d, &tape, &dg, &other, dp, NULL), GBT_ERR_ARGUMENT);
    mem_free(dp);
    decode_tape_free(&tape);
    gaussians_free(&g);
    gaussians_free(&dg);
    decoder_free(&d);
    anchors_free(&a);
    anchors_free(&da);
    anchors_free(&other);
}

static void no_memory_is_an_error(void **state)
{
    (void)state;
    anchors a = random_anchors(50, 10, 1), da = {.offset_count = 10};
    decoder d = random_decoder(10, false, 2);
    assert_ok(anchors_resize(&da, 50, NULL));
    float *dp = mem_calloc(d.param_count, sizeof *dp, "test", NULL);
    size_t visible_count, failures = 0;
    uint32_t *visible = every(50, 1, &visible_count);
    for (long n = 0;; n++) {
        gaussians g = {0}, dg = {0};
        decode_tape tape = {0};
        gbt_error err = {0};
        mem_fail_after(n);
        gbt_status status = decode_forward(&a, &d, camera_center, visible, visible_count, 0, &g, &tape, &err);
        if (status == GBT_OK)
            status = gaussians_resize(&dg, g.count, &err);
        if (status == GBT_OK) {
            gaussians_zero(&dg);
            status = decode_backward(&a, &d, &tape, &dg, &da, dp, &err);
        }
        mem_fail_after(-1);
        decode_tape_free(&tape);
        gaussians_free(&g);
        gaussians_free(&dg);
        if (status == GBT_OK)
            break;
        assert_int_equal(status, GBT_ERR_NO_MEMORY);
        assert_string_not_equal(err.text, "");
        failures++;
    }
    assert_true(failures >= 6);
    mem_free(dp);
    mem_free(visible);
    decoder_free(&d);
    anchors_free(&a);
    anchors_free(&da);
}

int main(void)
{
    struct CMUnitTest tests[64];
    size_t count = 0;
    static char names[64][128];
    for (size_t i = 0; i < sizeof decode_cases / sizeof *decode_cases; i++) {
        snprintf(names[count], sizeof names[count], "forward: %s", decode_cases[i].name);
        tests[count] = (struct CMUnitTest){
            .name = names[count], .test_func = forward_agrees_with_double, .initial_state = &decode_cases[i]};
        count++;
        snprintf(names[count], sizeof names[count], "adjoint: %s", decode_cases[i].name);
        tests[count] = (struct CMUnitTest){
            .name = names[count], .test_func = adjoint_agrees_with_double, .initial_state = &decode_cases[i]};
        count++;
    }
    for (size_t i = 0; i < sizeof gradient_cases / sizeof *gradient_cases; i++) {
        snprintf(names[count], sizeof names[count], "differences: %s", gradient_cases[i].name);
        tests[count] = (struct CMUnitTest){.name = names[count],
                                           .test_func = double_adjoint_agrees_with_differences,
                                           .initial_state = &gradient_cases[i]};
        count++;
    }
    const struct CMUnitTest single[] = {
        cmocka_unit_test(quaternion_gradient_along_itself_is_ignored),
        cmocka_unit_test(same_bits_for_all_threads_and_instructions),
        cmocka_unit_test(nothing_to_decode),
        cmocka_unit_test(threshold_is_strict),
        cmocka_unit_test(camera_on_an_anchor),
        cmocka_unit_test(distance_is_cut_to_twice_the_trained_range),
        cmocka_unit_test(finite_for_wild_parameters),
        cmocka_unit_test(wrong_arguments_are_refused),
        cmocka_unit_test(no_memory_is_an_error),
    };
    for (size_t i = 0; i < sizeof single / sizeof *single; i++)
        tests[count++] = single[i];
    return _cmocka_run_group_tests("decode", tests, count, NULL, NULL);
}
