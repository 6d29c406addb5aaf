/* SPDX-License-Identifier: Apache-2.0 */
/* tests/render/test_peak.c -- memory as the kernel counts it, of a file drawn below a limit, and the picture.
 */
#include "child.h"
#include "folder.h"

#include "base/image.h"
#include "base/rng.h"
#include "data/gaussian_file.h"
#include "gbtrace/evaluate.h"

enum { COUNT = 400000 };

static void write_scene(void)
{
    static const char *const camera =
        "{\"origin\": [-9, -8, 3], \"target\": [0, 0, 0], \"up\": [0, 0, 1], \"fov_x_deg\": 60, "
        "\"width\": 64, \"height\": 48}";
    gaussian_cloud c;
    assert_ok(gaussian_cloud_alloc(&c, COUNT, NULL));
    c.sh_degree = 3;
    for (size_t i = 0; i < COUNT; i++) {
        for (size_t k = 0; k < 3; k++) {
            c.mean[3 * i + k] = 12 * rng_uniform(3, 1, 3 * i + k) - 6;
            c.scale_log[3 * i + k] = -4.5f + rng_uniform(3, 2, 3 * i + k);
            c.quat[4 * i + k + 1] = 0;
        }
        c.quat[4 * i] = 1;
        c.opacity[i] = 0.2f + 0.7f * rng_uniform(3, 3, i);
        for (size_t k = 0; k < 48; k++)
            c.sh[48 * i + k] = rng_uniform(3, 4, 48 * i + k) - 0.5f;
    }
    assert_ok(gaussian_file_write(in_folder("large.ply"), &c, (const double[3]){0, 0, 0}, NULL));
    gaussian_cloud_free(&c);
    write_text(in_folder("view.json"), camera);
}

typedef struct drawing {
    const char *out;
    size_t memory;
} drawing;

static int render(void *context)
{
    const drawing *d = context;
    gbt_render_def def = gbt_render_def_default();
    def.camera = in_folder("view.json");
    def.format = GBT_PICTURE_EXR;
    def.memory = d->memory;
    gbt_error err = {0};
    const gbt_status status = gbt_render(in_folder("large.ply"), in_folder("%s", d->out), &def, &err);
    if (status != GBT_OK)
        fprintf(stderr, "%s\n", err.text);
    return (int)status;
}

static size_t draw(const char *out, size_t memory, int *exit_code)
{
    return in_child(render, &(drawing){out, memory}, exit_code);
}

static void below_the_limit(void **state)
{
    (void)state;
    const size_t limit = (size_t)240 << 20;
    int code;
    image cells, whole;
    const size_t peak = draw("cells", limit, &code);
    assert_int_equal(code, GBT_OK);
    if (peak > limit)
        fail_msg("%zu MB were taken (limit %zu)", peak >> 20, limit >> 20);
    assert_true(draw("whole", 0, &code) > limit);
    assert_int_equal(code, GBT_OK);
    assert_ok(image_read(in_folder("cells/view.exr"), &cells, NULL));
    assert_ok(image_read(in_folder("whole/view.exr"), &whole, NULL));
    double largest = 0;
    for (size_t i = 0; i < 3 * 64 * 48; i++)
        largest = fmax(largest, fabs((double)cells.pixels[i] - (double)whole.pixels[i]));
    assert_true(largest < 3e-6);
    image_free(&cells);
    image_free(&whole);
}

static void too_little(void **state)
{
    (void)state;
    int code;
    draw("none", (size_t)100 << 20, &code);
    assert_int_equal(code, GBT_ERR_NO_MEMORY);
    assert_false(file_exists(in_folder("none/view.exr")));
}

static int set_up(void **state)
{
    if (folder_make(state) != 0)
        return -1;
    /* The scene is made by a child: its memory must not be this process's, nor that of the others. */
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0) {
        write_scene();
        _exit(0);
    }
    int ended;
    return waitpid(child, &ended, 0) == child && ended == 0 ? 0 : -1;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(too_little), cmocka_unit_test(below_the_limit)};
    return cmocka_run_group_tests(tests, set_up, folder_remove);
}
