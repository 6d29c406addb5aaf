/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_exposure_spread.c -- do photos differ in exposure? */
#include "run_support.h"

#include "train/exposure_spread.h"

/* The photos of a scene of its own, each times 2^(stops * something in [-1, 1]). */
static const char *exposed_scene(const char *name, double stops)
{
    const char *folder = in_folder("%s", name);
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

static exposure_spread differences_of(trainer *t)
{
    exposure_spread out;
    assert_ok(exposure_spread_find(&t->photos, t->train_views, t->train_count, &out, NULL));
    return out;
}

/* The trainer has let go of tracks. */
static void give_tracks(trainer *t, const char *folder)
{
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(folder, &split, &s, NULL));
    for (size_t v = 0; v < s.view_count; v++) {
        assert_true(t->scene.views[v].seen == NULL && s.views[v].seen_count > 0);
        t->scene.views[v].seen = s.views[v].seen;
        t->scene.views[v].seen_count = s.views[v].seen_count;
        s.views[v].seen = NULL;
    }
    scene_free(&s);
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
        const exposure_spread without = differences_of(&t);
        print_message("photos of -%g to %g stops: %.3f without tracks\n", cases[i].stops, cases[i].stops,
                      without.stops);
        assert_int_equal(without.large, cases[i].without);
        assert_int_equal(t.def.exposure, cases[i].by_tracks);
        assert_int_equal(t.exposures.count > 0, cases[i].by_tracks);
        trainer_free(&t);
    }
}

/* Memory decides where photos are, not what is learned from them. */
static void photos_without_room_count(void **state)
{
    (void)state;
    trainer t;
    const gbt_train_def def = run_def();
    const char *crowded = exposed_scene("crowded", 1);
    open_ok(&t, crowded, &def);
    give_tracks(&t, crowded);
    const exposure_spread all = differences_of(&t);
    photos_close(&t.photos);
    assert_ok(photos_open(&t.photos, &t.scene, 1, NULL));
    t.photos.bytes_max = 2 * 3 * 48 * 36;
    assert_ok(photos_load(&t.photos, t.train_views, t.train_count, NULL));
    const exposure_spread few = differences_of(&t);
    size_t kept = 0;
    for (size_t v = 0; v < t.scene.view_count; v++)
        kept += t.photos.full[v] != NULL;
    assert_int_equal(kept, 3); /* the last one stays until the next */
    assert_true(few.large && few.stops == all.stops);
    trainer_free(&t);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exposures_are_found),
        cmocka_unit_test(photos_without_room_count),
        cmocka_unit_test(found_exposures_can_be_left),
    };
    return cmocka_run_group_tests(tests, make_root, folder_remove);
}
