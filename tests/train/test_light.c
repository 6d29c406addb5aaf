/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_light.c -- what a run finds out about its photos before it begins: do exposures differ,
   and how near are things. */
#include "run_support.h"

#include "train/light.h"
#include "train/camera_sees.h"
#include "train/near.h"

/* ---- exposure ---- */

/* The photos of a scene of its own, each times 2^(stops * something in [-1, 1]). */
static const char *exposed_scene(const char *name, double stops)
{
    const char *folder = in_root("%s", name);
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    make_tiny_scene(folder);
    assert_ok(scene_load(folder, &split, &s, NULL));
    for (size_t v = 0; v < s.view_count; v++) {
        const float gain = (float)exp2(stops * ((double)(v * 5 % VIEWS) / (VIEWS - 1) * 2 - 1));
        image photo;
        assert_ok(image_read(s.views[v].path, &photo, NULL));
        for (int i = 0; i < photo.width * photo.height * photo.channels; i++)
            photo.pixels[i] = fminf(photo.pixels[i] * gain, 1);
        assert_ok(image_write(s.views[v].path, &photo, NULL));
        image_free(&photo);
    }
    scene_free(&s);
    return folder;
}

static light_differences differences_of(const trainer *t)
{
    light_differences out;
    assert_ok(light_differ(&t->photos, t->train_views, t->train_count, &out, NULL));
    return out;
}

/* By tracks, a fifth of a stop is enough; without, what hides points could be it. */
static void exposures_are_found(void **state)
{
    (void)state;
    static const struct {
        double stops;
        bool by_tracks, without;
    } cases[] = {{0, false, false}, {0.1, false, false}, {0.25, true, false}, {1, true, true}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        trainer t;
        const gbt_train_def def = run_def();
        open_ok(&t, exposed_scene("light", cases[i].stops), &def);
        const light_differences by_tracks = differences_of(&t);
        for (size_t v = 0; v < t.scene.view_count; v++) {
            assert_true(t.scene.views[v].seen_count > 0);
            t.scene.views[v].seen_count = 0;
        }
        const light_differences without = differences_of(&t);
        print_message("photos of -%g to %g stops: %.3f by tracks, %.3f without\n", cases[i].stops,
                      cases[i].stops, by_tracks.stops, without.stops);
        assert_int_equal(by_tracks.large, cases[i].by_tracks);
        assert_int_equal(without.large, cases[i].without);
        assert_int_equal(t.def.exposure, cases[i].by_tracks);
        assert_int_equal(t.exposures.count > 0, cases[i].by_tracks);
        trainer_free(&t);
    }
}

static void found_exposures_can_be_left(void **state)
{
    (void)state;
    for (int compat = 0; compat < 2; compat++) {
        trainer t;
        gbt_train_def def = run_def();
        def.compat = compat;
        def.find_exposure = compat;
        open_ok(&t, exposed_scene("left", 1), &def);
        assert_true(!t.def.exposure && t.exposures.count == 0);
        trainer_free(&t);
    }
}

/* ---- near ---- */

/* One close-up among many photos has its own near distance, and the others keep theirs. */
static void a_close_up_is_alone(void **state)
{
    (void)state;
    enum { COUNT = 40 };
    scene_view views[COUNT] = {{0}};
    size_t all[COUNT];
    for (size_t i = 0; i < COUNT; i++) {
        views[i].nearest = 4 + 0.01 * (double)i;
        all[i] = i;
    }
    views[17].nearest = 0.2;
    views[3].nearest = 0; /* unknown */
    const scene s = {.views = views, .view_count = COUNT};
    gbt_train_def def = gbt_train_def_default(), reference = def;
    def.near = 0.5;
    reference.compat = true;
    float near;
    assert_ok(scene_near(&s, all, COUNT, 0.5, &near, NULL));
    assert_true(near >= 2 && near < 2.1f);
    assert_true(view_near(near, &def, &views[17]) == 0.1f && view_near(near, &def, &views[3]) == near);
    for (size_t i = 5; i < COUNT; i++)
        assert_true(i == 17 || view_near(near, &def, &views[i]) > 1.9f);
    assert_true(view_near(0.3f, &reference, &views[17]) == 0.3f); /* nothing is asked of the points */
    assert_ok(scene_near(&s, all, 10, 0.5, &near, NULL));         /* of few photos, the least */
    assert_true(near == 2);
    assert_ok(scene_near(&s, all + 3, 1, 0.5, &near, NULL));
    assert_true(near == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exposures_are_found),
        cmocka_unit_test(found_exposures_can_be_left),
        cmocka_unit_test(a_close_up_is_alone),
    };
    return cmocka_run_group_tests(tests, make_root, remove_root);
}
