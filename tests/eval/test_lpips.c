/* SPDX-License-Identifier: Apache-2.0 */
/* tests/eval/test_lpips.c -- LPIPS with networks of random weights against the plainest form of both, in
   double; what is cut off and masked; what is refused. */
#include "eval/picture_support.h"

#include "base/near.h"
#include "base/parallel.h"
#include "eval/lpips.h"
#include "eval/lpips_network.h"
#include "gbtrace/evaluate.h"

static lpips *open_network(const network *n, const char *name)
{
    lpips *net;
    write_network(n, in_folder("%s", name), NULL);
    assert_ok(lpips_open(in_folder("%s", name), &net, NULL));
    assert_string_equal(lpips_network(net), n->name);
    return net;
}

/* ---- the plainest form ---- */

typedef struct volume {
    int width, height, channels;
    double *at; /* [channels][height][width] */
} volume;

static volume new_volume(int width, int height, int channels)
{
    const volume v = {width, height, channels,
                      mem_calloc((size_t)(width * height * channels), sizeof(double), "volume", NULL)};
    assert_non_null(v.at);
    return v;
}

static double read_volume(const volume *v, int x, int y, int c)
{
    return x < 0 || y < 0 || x >= v->width || y >= v->height ? 0 : v->at[(c * v->height + y) * v->width + x];
}

static volume apply(const network *n, int i, volume in)
{
    const step *s = &n->steps[i];
    volume out =
        new_volume((in.width + 2 * s->pad - s->kernel) / s->stride + 1,
                   (in.height + 2 * s->pad - s->kernel) / s->stride + 1, s->out > 0 ? s->out : in.channels);
    for (int o = 0; o < out.channels; o++)
        for (int y = 0; y < out.height; y++)
            for (int x = 0; x < out.width; x++) {
                double sum = s->out > 0 ? (double)n->bias[i][o] : -1e30;
                for (int k = 0; k < s->kernel * s->kernel; k++) {
                    const int from_x = x * s->stride - s->pad + k % s->kernel,
                              from_y = y * s->stride - s->pad + k / s->kernel;
                    for (int c = 0; s->out > 0 && c < in.channels; c++)
                        sum += (double)n->weights[i][(o * in.channels + c) * s->kernel * s->kernel + k] *
                               read_volume(&in, from_x, from_y, c);
                    if (s->out == 0)
                        sum = fmax(sum, read_volume(&in, from_x, from_y, o));
                }
                out.at[(o * out.height + y) * out.width + x] = fmax(sum, 0);
            }
    mem_free(in.at);
    return out;
}

static double distance(const volume *a, const volume *b, const float *weight)
{
    double sum = 0;
    for (int y = 0; y < a->height; y++)
        for (int x = 0; x < a->width; x++) {
            double aa = 0, bb = 0;
            for (int c = 0; c < a->channels; c++) {
                aa += read_volume(a, x, y, c) * read_volume(a, x, y, c);
                bb += read_volume(b, x, y, c) * read_volume(b, x, y, c);
            }
            for (int c = 0; c < a->channels; c++) {
                const double d = read_volume(a, x, y, c) / (sqrt(aa) + 1e-10) -
                                 read_volume(b, x, y, c) / (sqrt(bb) + 1e-10);
                sum += (double)weight[c] * d * d;
            }
        }
    return sum / (a->width * a->height);
}

static volume seen_by_network(const image *im, double low)
{
    static const double shift[3] = {-0.030, -0.088, -0.188}, scale[3] = {0.458, 0.448, 0.450};
    const volume v = new_volume(im->width, im->height, 3);
    for (int i = 0; i < im->width * im->height * 3; i++)
        v.at[(i % 3) * im->width * im->height + i / 3] =
            (low + (1 - low) * (double)im->pixels[i] - shift[i % 3]) / scale[i % 3];
    return v;
}

static double plain_lpips(const network *n, const image *a, const image *b, double low)
{
    volume x = seen_by_network(a, low), y = seen_by_network(b, low);
    double sum = 0;
    for (int i = 0, tap = 0; i < n->count; i++) {
        x = apply(n, i, x);
        y = apply(n, i, y);
        if (n->steps[i].tap)
            sum += distance(&x, &y, n->taps[tap++]);
    }
    mem_free(x.at);
    mem_free(y.at);
    return sum;
}

/* ---- tests ---- */

/* Odd sizes: maxima leave a row and a column out. */
static void agrees(network whole, int width, int height)
{
    const network *n = &whole;
    lpips *net = open_network(n, "net.safetensors");
    image a = noise(width, height, 3, 1), b = noise(width, height, 3, 2);
    lpips_scores got, again;
    assert_ok(lpips_compare(net, &a, &b, NULL, 0, &got, NULL));
    assert_true(got.lpips > 0.01 && got.lpips_01 > 0.01 && fabs(got.lpips - got.lpips_01) > 1e-3);
    assert_near(got.lpips, plain_lpips(n, &a, &b, -1), 2e-5 * got.lpips);
    assert_near(got.lpips_01, plain_lpips(n, &a, &b, 0), 2e-5 * got.lpips_01);
    const int threads = parallel_threads();
    parallel_set_threads(threads == 1 ? 3 : 1);
    assert_ok(lpips_compare(net, &a, &b, NULL, 0, &again, NULL));
    parallel_set_threads(threads);
    assert_memory_equal(&got, &again, sizeof got);
    assert_ok(lpips_compare(net, &a, &a, NULL, 0, &again, NULL));
    assert_true(again.lpips == 0 && again.lpips_01 == 0);
    image_free(&a);
    image_free(&b);
    lpips_close(net);
    free_network(&whole);
}

static void vgg_agrees(void **state)
{
    (void)state;
    agrees(make_vgg(), 37, 25);
}

static void alex_agrees(void **state)
{
    (void)state;
    agrees(make_alex(), 71, 46);
}

/* Cutting off is as if it had never been there; a masked pixel is as if the render were right. */
static void halves_and_masks(void **state)
{
    (void)state;
    enum { WIDTH = 64, HEIGHT = 33, HALF = 32 };
    network alex = make_alex();
    lpips *net = open_network(&alex, "alex.safetensors");
    image a = noise(WIDTH, HEIGHT, 3, 3), b = noise(WIDTH, HEIGHT, 3, 4), mended = noise(WIDTH, HEIGHT, 3, 3),
          right_a = noise(HALF, HEIGHT, 3, 0), right_b = noise(HALF, HEIGHT, 3, 0);
    unsigned char valid[WIDTH * HEIGHT];
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const int x = i % WIDTH, to = (i / WIDTH) * HALF + x - HALF;
        valid[i] = rng_uniform(9, 0, (uint64_t)i) < 0.7f;
        for (int c = 0; c < 3; c++) {
            if (x >= HALF) {
                right_a.pixels[3 * to + c] = a.pixels[3 * i + c];
                right_b.pixels[3 * to + c] = b.pixels[3 * i + c];
            }
            if (!valid[i])
                mended.pixels[3 * i + c] = b.pixels[3 * i + c];
        }
    }
    lpips_scores cut, right, masked, whole;
    assert_ok(lpips_compare(net, &a, &b, NULL, HALF, &cut, NULL));
    assert_ok(lpips_compare(net, &right_a, &right_b, NULL, 0, &right, NULL));
    assert_memory_equal(&cut, &right, sizeof cut);
    assert_ok(lpips_compare(net, &a, &b, valid, 0, &masked, NULL));
    assert_ok(lpips_compare(net, &mended, &b, NULL, 0, &whole, NULL));
    assert_memory_equal(&masked, &whole, sizeof masked);
    image *const all[] = {&a, &b, &right_a, &right_b, &mended};
    for (int i = 0; i < 5; i++)
        image_free(all[i]);
    lpips_close(net);
    free_network(&alex);
}

static void files_compared(void **state)
{
    (void)state;
    network alex = make_alex();
    lpips *net = open_network(&alex, "alex.safetensors");
    image a = noise(40, 34, 3, 5), b = noise(40, 34, 3, 6);
    lpips_scores wanted;
    gbt_comparison got;
    gbt_error err = {0};
    assert_ok(image_write(in_folder("a.png"), &a, NULL));
    assert_ok(image_write(in_folder("b.png"), &b, NULL));
    assert_ok(lpips_compare(net, &a, &b, NULL, 0, &wanted, NULL));
    assert_ok(gbt_compare_images(in_folder("a.png"), in_folder("b.png"), in_folder("alex.safetensors"), &got,
                                 NULL));
    assert_near(got.lpips, wanted.lpips, 1e-6 * wanted.lpips);
    assert_near(got.lpips_01, wanted.lpips_01, 1e-6 * wanted.lpips_01);
    assert_int_equal(
        gbt_compare_images(in_folder("a.png"), in_folder("b.png"), in_folder("none"), &got, &err),
        GBT_ERR_IO);
    image_free(&a);
    image_free(&b);
    lpips_close(net);
    free_network(&alex);
}

static void assert_refused(const char *path, const char *says)
{
    gbt_error err = {0};
    lpips *net;
    assert_int_equal(lpips_open(path, &net, &err), GBT_ERR_FORMAT);
    assert_null(net);
    if (strstr(err.text, says) == NULL)
        fail_msg("%s (wanted %s)", err.text, says);
}

static void refusals(void **state)
{
    (void)state;
    gbt_error err = {0};
    lpips_scores scores;
    network alex = make_alex();
    lpips *net = open_network(&alex, "alex.safetensors");
    image small = noise(30, 40, 3, 1), least = noise(31, 31, 3, 1), other = noise(31, 32, 3, 1);
    assert_int_equal(lpips_compare(net, &small, &small, NULL, 0, &scores, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "too small"));
    assert_ok(lpips_compare(net, &least, &least, NULL, 0, &scores, &err));
    assert_int_equal(lpips_compare(net, &least, &least, NULL, 1, &scores, &err), GBT_ERR_ARGUMENT);
    assert_int_equal(lpips_compare(net, &least, &other, NULL, 0, &scores, &err), GBT_ERR_ARGUMENT);
    for (long n = 0;; n++) { /* every allocation that can fail */
        mem_fail_after(n);
        const gbt_status status = lpips_compare(net, &least, &least, NULL, 0, &scores, &err);
        mem_fail_after(-1);
        if (status == GBT_OK)
            break;
        assert_int_equal(status, GBT_ERR_NO_MEMORY);
    }
    image_free(&small);
    image_free(&least);
    image_free(&other);
    lpips_close(net);

    write_network(&alex, in_folder("a.safetensors"), "net.slice4.8.weight");
    assert_refused(in_folder("a.safetensors"), "no array net.slice4.8.weight");
    write_network(&alex, in_folder("a.safetensors"), "lin4.model.1.weight");
    assert_refused(in_folder("a.safetensors"), "no array lin4.model.1.weight");
    alex.bias[4][7] = NAN;
    write_network(&alex, in_folder("a.safetensors"), NULL);
    assert_refused(in_folder("a.safetensors"), "not finite");
    alex.bias[4][7] = 0;
    network narrow = alex;
    narrow.steps[2].out = 176;
    write_network(&narrow, in_folder("a.safetensors"), NULL);
    assert_refused(in_folder("a.safetensors"), "wanted 192 x 1600");
    narrow.steps[0].out = 48;
    write_network(&narrow, in_folder("a.safetensors"), NULL);
    assert_refused(in_folder("a.safetensors"), "neither VGG16 nor AlexNet");
    assert_ok(file_write_atomic(in_folder("a.safetensors"), "P6 1 1 255 xx", 13, NULL));
    assert_refused(in_folder("a.safetensors"), "not a .safetensors file");
    free_network(&alex);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vgg_agrees),     cmocka_unit_test(alex_agrees), cmocka_unit_test(halves_and_masks),
        cmocka_unit_test(files_compared), cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
