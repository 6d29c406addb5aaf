/* SPDX-License-Identifier: Apache-2.0 */
/* tests/bvh/test_device.c -- the Embree device: made once from any thread, its errors in words, its memory
   limit, the ray guard. */
#include "test_support.h"

#include <float.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bvh/device.h"
#include "bvh/embree_api.h"
#include "bvh/gaussian_scene.h"
#include "bvh/gaussian_tree.h"
#include "bvh/mesh.h"
#include "bvh/points.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SANITIZED = 1 };
#else
enum { SANITIZED = 0 };
#endif

/* First of all tests, in a child without address space: Embree gives no device, and every build says so. */
static void no_device_is_an_error(void **state)
{
    (void)state;
    if (SANITIZED)
        skip(); /* sanitizers need the address space themselves */
    gaussians g = {0};
    assert_ok(gaussians_resize(&g, 1, NULL));
    gaussians_pad(&g);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        long pages = 0;
        FILE *file = fopen("/proc/self/statm", "r");
        if (file == NULL || fscanf(file, "%ld", &pages) != 1)
            _exit(10);
        fclose(file);
        const rlim_t bytes = (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE) + (1 << 20);
        if (setrlimit(RLIMIT_AS, &(struct rlimit){bytes, bytes}) != 0)
            _exit(11);
        if (mmap(NULL, 1 << 28, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED)
            _exit(77); /* the limit is not held, as in an emulator */
        gbt_error err = {0};
        if (bvh_device(&err) != NULL)
            _exit(12);
        if (err.status == GBT_OK || strstr(err.text, "embree: no device: ") != err.text)
            _exit(13);
        const float point[3] = {1, 2, 3};
        point_tree *points = (point_tree *)&err;
        err = (gbt_error){0};
        gbt_status status = point_tree_build(number_floats(point), (number_array){0}, 1, &points, &err);
        if (status == GBT_OK || status != err.status || points != NULL || err.text[0] == '\0')
            _exit(14);
        const float vertices[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        const uint32_t corners[3] = {0, 1, 2};
        mesh_tree *mesh = (mesh_tree *)&err;
        err = (gbt_error){0};
        status = mesh_tree_build(vertices, 3, corners, 1, &mesh, &err);
        if (status == GBT_OK || status != err.status || mesh != NULL || err.text[0] == '\0')
            _exit(15);
        gaussian_tree tree = {0};
        err = (gbt_error){0};
        status = gaussian_tree_build(&g, 0.01f, 1, &tree, &err);
        if (status == GBT_OK || status != err.status || err.text[0] == '\0')
            _exit(17);
        gaussian_scene scene = {0};
        err = (gbt_error){0};
        status = gaussian_scene_build(&g, 0.01f, 1, &scene, &err);
        if (status == GBT_OK || status != err.status || err.text[0] == '\0')
            _exit(18);
        if (bvh_embree_version()[0] != '3' && bvh_embree_version()[0] != '4')
            _exit(16);
        _exit(0);
    }
    int how = 0;
    assert_int_equal(waitpid(child, &how, 0), child);
    assert_true(WIFEXITED(how));
    if (WEXITSTATUS(how) == 77)
        skip();
    assert_int_equal(WEXITSTATUS(how), 0);
    gaussians_free(&g);
}

static void *ask_device(void *argument)
{
    (void)argument;
    return bvh_device(NULL);
}

static void one_device_for_all_threads(void **state)
{
    (void)state;
    pthread_t threads[8];
    for (int i = 0; i < 8; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, ask_device, NULL), 0);
    gbt_error err = {0};
    void *device = bvh_device(&err);
    assert_non_null(device);
    assert_int_equal(err.status, GBT_OK);
    for (int i = 0; i < 8; i++) {
        void *seen = NULL;
        assert_int_equal(pthread_join(threads[i], &seen), 0);
        assert_ptr_equal(seen, device);
    }
}

static void version_is_that_of_the_library(void **state)
{
    (void)state;
    int major = 0, minor = 0, patch = 0;
    char rest = 0;
    assert_int_equal(sscanf(bvh_embree_version(), "%d.%d.%d%c", &major, &minor, &patch, &rest), 3);
    assert_int_equal(major, GBT_EMBREE_MAJOR);
}

static void complaints_reach_the_error(void **state)
{
    (void)state;
    gbt_error err = {0};
    assert_int_equal(bvh_check("test", &err), GBT_OK);
    assert_int_equal(err.status, GBT_OK);
    RTCGeometry geometry = rtcNewGeometry(bvh_device(NULL), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryTimeStepCount(geometry, 1u << 30); /* more than Embree has */
    assert_int_equal(bvh_check("test", &err), GBT_ERR_INTERNAL);
    assert_int_equal(err.status, GBT_ERR_INTERNAL);
    assert_ptr_equal(strstr(err.text, "test: embree: invalid "), err.text);
    assert_true(strlen(err.text) > strlen("test: embree: invalid operation: ")); /* and Embree's own words */
    assert_int_equal(bvh_check("test", &err), GBT_OK);                           /* said once */
    const size_t first_length = strlen(err.text);
    RTCScene scene = rtcNewScene(bvh_device(NULL));
    struct RTCBounds bounds;
    rtcGetSceneBounds(scene, &bounds); /* not built yet */
    gbt_error second = {0};
    assert_int_equal(bvh_check("test", &second), GBT_ERR_INTERNAL);
    assert_non_null(strstr(second.text, "commit")); /* its own words, not those of the first */
    assert_int_equal(strlen(err.text), first_length);
    rtcReleaseScene(scene);
    rtcReleaseGeometry(geometry);
}

typedef struct ray_case {
    const char *name;
    float origin[3], dir[3], t_min, t_max;
    bool ok;
} ray_case;

static const ray_case ray_cases[] = {
    {"plain", {0, 0, 0}, {0, 0, 1}, 0, 1, true},
    {"to infinity", {0, 0, 0}, {0, 0, 1}, 0, INFINITY, true},
    {"empty but legal", {0, 0, 0}, {0, 0, 1}, 1, 1, true},
    {"minus zero start", {0, 0, 0}, {0, 0, 1}, -0.0f, 1, true},
    {"at the limit", {1e18f, 0, 0}, {1e18f, 0, 0}, 0, 1, true},
    {"origin NaN", {0, NAN, 0}, {0, 0, 1}, 0, 1, false},
    {"origin infinite", {0, INFINITY, 0}, {0, 0, 1}, 0, 1, false},
    {"origin beyond the limit", {0, 0, -1.1e18f}, {0, 0, 1}, 0, 1, false},
    {"dir NaN", {0, 0, 0}, {0, 0, NAN}, 0, 1, false},
    {"dir infinite", {0, 0, 0}, {0, -INFINITY, 1}, 0, 1, false},
    {"dir beyond the limit", {0, 0, 0}, {0, FLT_MAX, 1}, 0, 1, false},
    {"dir zero", {0, 0, 0}, {0, -0.0f, 0}, 0, 1, false},
    {"t_min NaN", {0, 0, 0}, {0, 0, 1}, NAN, 1, false},
    {"t_min negative", {0, 0, 0}, {0, 0, 1}, -1e-30f, 1, false},
    {"t_min infinite", {0, 0, 0}, {0, 0, 1}, INFINITY, INFINITY, false},
    {"t_max NaN", {0, 0, 0}, {0, 0, 1}, 0, NAN, false},
    {"t_max before t_min", {0, 0, 0}, {0, 0, 1}, 2, 1, false},
};

static void ray_guard(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof ray_cases / sizeof *ray_cases; i++)
        if (bvh_ray_ok(ray_cases[i].origin, ray_cases[i].dir, ray_cases[i].t_min, ray_cases[i].t_max) !=
            ray_cases[i].ok)
            fail_msg("%s: wanted %d", ray_cases[i].name, ray_cases[i].ok);
}

/* Embree is refused memory at ever later points of a build, until it is enough: each time an error, nothing
   kept. */
static void memory_limit_is_safe(void **state)
{
    (void)state;
    enum { COUNT = 20000 };
    static float position[COUNT][3], radius[COUNT];
    for (int i = 0; i < COUNT; i++) {
        for (int j = 0; j < 3; j++)
            position[i][j] = (float)((i * (2 * j + 3) * 7919) % 10007) * 1e-3f;
        radius[i] = 0.01f;
    }
    const size_t before = bvh_memory_bytes();
    int refused = 0;
    bool built = false;
    for (size_t allowed = 256; !built; allowed += allowed / 4) {
        assert_true(allowed < 1u << 30);
        bvh_limit_memory(before + allowed);
        gbt_error err = {0};
        point_tree *tree = (point_tree *)&err;
        const gbt_status status =
            point_tree_build(number_floats(&position[0][0]), number_floats(radius), COUNT, &tree, &err);
        built = status == GBT_OK;
        if (!built) {
            refused++;
            assert_int_equal(status, GBT_ERR_NO_MEMORY);
            assert_int_equal(err.status, GBT_ERR_NO_MEMORY);
            assert_non_null(strstr(err.text, "points: embree: out of memory"));
            assert_null(tree);
        }
        point_tree_free(tree);
        assert_int_equal(bvh_memory_bytes(), before);
    }
    assert_true(refused > 10);

    refused = 0;
    built = false;
    static uint32_t corners[COUNT - 2][3];
    for (uint32_t i = 0; i < COUNT - 2; i++)
        for (uint32_t j = 0; j < 3; j++)
            corners[i][j] = i + j;
    for (size_t allowed = 256; !built; allowed += allowed / 4) {
        assert_true(allowed < 1u << 30);
        bvh_limit_memory(before + allowed);
        gbt_error err = {0};
        mesh_tree *mesh = (mesh_tree *)&err;
        const gbt_status status =
            mesh_tree_build(&position[0][0], COUNT, &corners[0][0], COUNT - 2, &mesh, &err);
        built = status == GBT_OK;
        if (!built) {
            refused++;
            assert_int_equal(status, GBT_ERR_NO_MEMORY);
            assert_null(mesh);
        }
        mesh_tree_free(mesh);
        assert_int_equal(bvh_memory_bytes(), before);
    }
    assert_true(refused > 10);
    bvh_limit_memory(SIZE_MAX);
}

static void rebuilding_leaks_nothing(void **state)
{
    (void)state;
    const size_t before = bvh_memory_bytes();
    float position[300];
    for (int i = 0; i < 300; i++)
        position[i] = (float)((i * 37) % 101);
    for (int round = 0; round < 100; round++) {
        point_tree *tree = NULL;
        gbt_error err = {0};
        assert_ok(point_tree_build(number_floats(position), (number_array){0}, 100, &tree, &err));
        assert_int_equal(bvh_memory_bytes(), before); /* Embree builds and keeps nothing */
        point_tree_free(tree);
    }
    assert_int_equal(bvh_memory_bytes(), before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_device_is_an_error),
        cmocka_unit_test(one_device_for_all_threads),
        cmocka_unit_test(version_is_that_of_the_library),
        cmocka_unit_test(complaints_reach_the_error),
        cmocka_unit_test(ray_guard),
        cmocka_unit_test(memory_limit_is_safe),
        cmocka_unit_test(rebuilding_leaks_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
