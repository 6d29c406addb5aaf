/* SPDX-License-Identifier: Apache-2.0 */
/* tests/render/test_render_outputs.c -- outputs beside a picture: their list, the files and channels, the
   anchor behind each ray. */
#include "anchor/fixture.h"
#include "base/near.h"
#include "folder.h"
#include "render/render_outputs.h"

enum { WIDTH = 40, HEIGHT = 24, ANCHORS = 300, OFFSETS = 3 };

static const char *const names[] = {"transmittance", "depth", "median-depth", "normal", "hits", "anchor"};

static void lists_of_outputs(void **state)
{
    (void)state;
    static const struct {
        const char *list;
        unsigned wanted;
    } good[] = {{NULL, 0},          {"transmittance", 1},
                {"depth", 2},       {"median-depth", 4},
                {"normal", 8},      {"hits", 16},
                {"anchor", 32},     {"anchor,depth", 34},
                {"depth,depth", 2}, {"transmittance,depth,median-depth,normal,hits,anchor", 63}};
    static const char *const bad[] = {"",       "Depth",  "dept",        "depths",
                                      "depth,", ",depth", "depth,,hits", "depth hits"};
    unsigned wanted;
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        assert_ok(render_outputs_parse(good[i].list, &wanted, NULL));
        assert_int_equal(wanted, good[i].wanted);
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(render_outputs_parse(bad[i], &wanted, NULL), GBT_ERR_ARGUMENT);
}

static loaded_run *random_run(const ray_shot *shot)
{
    loaded_run *r = mem_calloc(1, sizeof *r, "test", NULL);
    r->model.anchors = random_anchors(ANCHORS, OFFSETS, 4);
    r->model.decoder = random_decoder(OFFSETS, false, 5);
    r->settings = trace_settings_default();
    for (size_t i = 0; i < ANCHORS; i++)
        for (size_t k = 0; k < 6; k++)
            r->model.anchors.scale_log[6 * i + k] = -2.5f;
    assert_ok(frame_render_with(&r->frame, frame_neural(&r->model.anchors, &r->model.decoder), shot,
                                &r->settings, NULL, NULL));
    return r;
}

/* Whether the Gaussian stands where one of the anchor's offsets puts it. */
static bool belongs_to(const gaussians *g, size_t i, const anchors *a, size_t anchor)
{
    const float mean[3] = {g->mean_x[i], g->mean_y[i], g->mean_z[i]};
    for (size_t k = 0; k < OFFSETS; k++) {
        float square = 0;
        for (size_t c = 0; c < 3; c++) {
            const float d = a->position[3 * anchor + c] +
                            a->offset[3 * (OFFSETS * anchor + k) + c] * expf(a->scale_log[6 * anchor + c]) -
                            mean[c];
            square += d * d;
        }
        if (square < 1e-10f)
            return true;
    }
    return false;
}

static void files_hold_what_was_traced(void **state)
{
    (void)state;
    gbt_camera camera = {.model = GBT_CAMERA_PINHOLE,
                         .width = WIDTH,
                         .height = HEIGHT,
                         .center = {0, 0, -5},
                         .params = {24, 24, 20, 12},
                         .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    ray_shot shot = ray_shot_of(&camera);
    /* outputs are those of the pinhole in its middle */
    shot.aperture_radius = 0.05;
    shot.focus_distance = 5;
    shot.samples = 2;
    loaded_run *r = random_run(&shot);
    assert_ok(render_outputs_write(r, &shot, 63, test_folder, "view", NULL));
    image of[6];
    for (int i = 0; i < 6; i++) {
        image_names channels;
        assert_ok(image_read_raw(in_folder("view.%s.exr", names[i]), &of[i], &channels, NULL));
        assert_int_equal(of[i].width, WIDTH);
        assert_int_equal(of[i].height, HEIGHT);
        assert_int_equal(of[i].channels, i == 3 ? 3 : 1);
        assert_string_equal(channels.name[0], i == 3 ? "R" : "Y");
    }
    assert_int_equal(count_files(test_folder), 6);
    static float depth[WIDTH * HEIGHT], hits[WIDTH * HEIGHT];
    static uint32_t strongest[WIDTH * HEIGHT];
    image rgb;
    ray_image rays = {0};
    assert_ok(image_alloc(&rgb, WIDTH, HEIGHT, 3, NULL));
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    assert_ok(trace_forward(
        &r->frame.scene, &rays, false,
        &(trace_outputs){.rgb = &rgb, .depth = depth, .hit_count = hits, .strongest = strongest}, NULL,
        NULL));
    size_t seen = 0, empty = 0, anchors_seen = 0;
    float last = -1;
    for (size_t i = 0; i < WIDTH * HEIGHT; i++) {
        const float anchor = of[5].pixels[i];
        assert_true(of[1].pixels[i] == depth[i] && of[4].pixels[i] == hits[i]);
        assert_true((of[0].pixels[i] == 1) == (hits[i] == 0));
        assert_true((anchor == -1) == (hits[i] == 0));
        empty += anchor < 0;
        if (anchor < 0)
            continue;
        seen++;
        anchors_seen += anchor != last;
        last = anchor;
        assert_true(anchor < ANCHORS &&
                    belongs_to(&r->frame.gaussians, strongest[i], &r->model.anchors, (size_t)anchor));
        const float *n = of[3].pixels + 3 * i;
        assert_true(sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) <= 1 - of[0].pixels[i] + 1e-5f);
    }
    assert_true(seen > WIDTH * HEIGHT / 4 && empty > 10 && anchors_seen > 30);
    for (int i = 0; i < 6; i++)
        image_free(&of[i]);
    image_free(&rgb);
    ray_image_free(&rays);
    loaded_run_close(r);
    mem_free(r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_of_outputs),
        cmocka_unit_test(files_hold_what_was_traced),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
