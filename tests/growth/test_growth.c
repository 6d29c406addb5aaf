/* SPDX-License-Identifier: Apache-2.0 */
/* tests/growth/test_growth.c -- growing and pruning: the published oracles, every boundary, and a brute-force
   version of the whole. */
#include "anchor/fixture.h"

#include "anchor/activations.h"
#include "base/parallel.h"
#include "growth/growth.h"

typedef struct scene {
    anchors a;
    growth_stats s;
} scene;

static scene empty_scene(size_t count, int offset_count)
{
    scene sc = {.a = {.offset_count = offset_count}};
    assert_ok(anchors_resize(&sc.a, count, NULL));
    assert_ok(growth_stats_resize(&sc.s, count, offset_count, NULL));
    return sc;
}

static void free_scene(scene *sc, growth_result *r)
{
    anchors_free(&sc->a);
    growth_stats_free(&sc->s);
    if (r != NULL)
        mem_free(r->source);
}

static void set_gradient(scene *sc, size_t slot, float gradient)
{
    sc->s.grad_count[slot] = 50.0f;
    sc->s.grad_accum[slot] = 50.0f * gradient;
}

static bool survives(const growth_def *def, int level, size_t slot)
{
    return rng_uniform(def->seed, def->step * 8 + (uint64_t)level, slot) > ldexpf(1.0f, -(level + 1));
}

/* The first seed for which slots [0, count) survive the drop at every level. */
static void keep_all(growth_def *def, size_t count)
{
    for (def->seed = 0;; def->seed++) {
        bool all = true;
        for (int level = 0; level < 3; level++)
            for (size_t slot = 0; slot < count; slot++)
                all = all && survives(def, level, slot);
        if (all)
            return;
    }
}

/* Where the reference differs. */
static void set_reference(growth_def *def, bool on)
{
    def->integer_division = on;
    def->coarse_level_gates = on;
    def->at_cell_center = on;
}

/* ---- oracles ---- */

static void two_candidates_in_one_cell(void **state) /* T6 */
{
    (void)state;
    scene sc =
        empty_scene(2, 2); /* anchor 1 only sits in the way of nothing; its candidate shares the cell */
    sc.a.offset[0] = 17.0f;
    sc.a.position[3] = -3.0f;
    sc.a.offset[6] = 19.4f; /* at 16.4 */
    for (size_t i = 0; i < 32; i++) {
        sc.a.feature[i] = i % 2 == 0 ? 1.0f : -1.0f;
        sc.a.feature[32 + i] = i % 3 == 0 ? 2.0f : -3.0f;
    }
    set_gradient(&sc, 0, 3e-4f); /* passes 2e-4, not 4e-4 */
    set_gradient(&sc, 2, 3e-4f);
    growth_def def = growth_def_default();
    def.voxel_size = 1.0f;
    keep_all(&def, 4);
    growth_result r;
    assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
    assert_int_equal(r.grown, 1);
    assert_int_equal(r.pruned, 0);
    assert_int_equal(r.count, 3);
    assert_int_equal(sc.a.count, 3);
    assert_int_equal(sc.s.count, 3);
    assert_true(r.survivors == 2 && r.source[0] == 0 && r.source[1] == 1);
    assert_true(sc.a.position[6] == 17.0f && sc.a.position[7] == 0.0f && sc.a.position[8] == 0.0f);
    for (size_t c = 0; c < 6; c++)
        assert_true(fabs((double)sc.a.scale_log[12 + c] - log(16.0)) < 1e-6 && sc.a.offset[12 + c] == 0.0f);
    for (size_t i = 0; i < 32; i++)
        assert_true(sc.a.feature[64 + i] == fmaxf(sc.a.feature[i], sc.a.feature[32 + i]));
    assert_true(sc.s.visit_count[2] == 0 && sc.s.importance_accum[2] == 0 && sc.s.grad_count[4] == 0 &&
                sc.s.grad_accum[5] == 0);
    free_scene(&sc, &r);
}

typedef struct prune_case {
    const char *name;
    float accum, visits, shown;
    bool pruned, reset;
} prune_case;

static prune_case prune_cases[] = {
    {"0.4 < 0.405 at 81 views (T7)", 0.4f, 81, 81, true, false},
    {"80 views are not enough (T7)", 0.4f, 80, 80, false, false},
    {"exactly 0.005 of the views stays", 0.005f * 81, 81, 81, false, true},
    {"a hair below goes", 0x1.fffffep-1f * 0.005f * 81, 81, 81, true, false},
    {"opaque stays and is reset", 20, 500, 500, false, true},
    {"never seen", 0, 0, 0, false, false},
    {"the views that it is hidden from do not count", 0.04f, 100, 8, false, true},
    {"hidden from all", 0, 100, 0, true, false},
};

static void prunes(void **state)
{
    const prune_case *c = *state;
    scene sc = empty_scene(2, 1); /* anchor 0 keeps the scene from becoming empty */
    sc.s.importance_accum[1] = c->accum;
    sc.s.visit_count[1] = c->visits;
    sc.s.shown_count[1] = c->shown;
    growth_def def = growth_def_default();
    def.voxel_size = 1.0f;
    growth_result r;
    assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
    assert_int_equal(r.pruned, c->pruned);
    assert_int_equal(sc.a.count, c->pruned ? 1 : 2);
    if (!c->pruned) {
        assert_true(sc.s.importance_accum[1] == (c->reset ? 0 : c->accum));
        assert_true(sc.s.visit_count[1] == (c->reset ? 0 : c->visits));
    }
    free_scene(&sc, &r);
}

typedef struct grow_case {
    const char *name;
    float gradient, views;
    size_t grown;
    bool reset;
} grow_case;

static grow_case grow_cases[] = {
    {"gradient at the threshold", 2e-4f * 64 / 64, 64, 1, true},
    {"gradient below the threshold", 1.99e-4f, 64, 0, true},
    {"40 views are not enough", 1.0f, 40, 0, false},
    {"41 views are", 1.0f, 41, 1, true},
    {"no view: 0 / 0", 0.0f, 0, 0, false},
    {"gradient is not a number", NAN, 50, 0, true},
};

static void grows(void **state)
{
    const grow_case *c = *state;
    scene sc = empty_scene(1, 1);
    sc.a.position[0] = 0.0f;
    sc.a.offset[0] = 102.0f;
    sc.a.offset[1] = 50.0f; /* cells 6 (96), 26 (104), 102: three different places */
    sc.s.grad_count[0] = c->views;
    sc.s.grad_accum[0] = c->gradient * c->views;
    growth_def def = growth_def_default();
    def.voxel_size = 1.0f;
    keep_all(&def, 1);
    growth_result r;
    assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
    assert_int_equal(r.grown, c->grown);
    if (c->reset)
        assert_true(sc.s.grad_count[0] == 0 && sc.s.grad_accum[0] == 0);
    else
        assert_true(sc.s.grad_count[0] == c->views);
    free_scene(&sc, &r);
}

/* The reference puts anchors into the middle of cells, so one candidate may bring one per level; ours stand
   where it is. */
static void levels_have_their_own_cells_and_thresholds(void **state)
{
    (void)state;
    const float gradients[3] = {2.5e-4f, 5e-4f, 9e-4f}, expected[3][3] = {{96}, {96, 104}, {96, 104, 102}};
    for (size_t passes = 0; passes < 3; passes++) {
        scene sc = empty_scene(1, 1);
        sc.a.offset[0] = 102.0f;
        set_gradient(&sc, 0, gradients[passes]);
        growth_def def = growth_def_default();
        def.voxel_size = 1.0f;
        set_reference(&def, true);
        keep_all(&def, 1);
        growth_result r;
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        assert_int_equal(r.grown, passes + 1);
        for (size_t i = 0; i <= passes; i++)
            assert_true(sc.a.position[3 + 3 * i] == expected[passes][i]);
        free_scene(&sc, &r);

        sc = empty_scene(1, 1);
        sc.a.offset[0] = 102.0f;
        set_gradient(&sc, 0, gradients[passes]);
        set_reference(&def, false);
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        assert_int_equal(r.grown, 1);
        assert_true(sc.a.position[3] == 102.0f);
        free_scene(&sc, &r);
    }
}

static void a_silent_coarse_level_gates_only_by_the_reference_rule(void **state)
{
    (void)state;
    for (int reference = 0; reference <= 1; reference++) {
        scene sc = empty_scene(1, 1);
        sc.a.offset[0] = 7.0f; /* the coarse cell is the anchor's own; the finer ones are free */
        set_gradient(&sc, 0, 1.0f);
        growth_def def = growth_def_default();
        def.voxel_size = 1.0f;
        set_reference(&def, reference == 1);
        keep_all(&def, 1);
        growth_result r;
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        assert_int_equal(r.grown, reference == 1 ? 0 : 1);
        free_scene(&sc, &r);
    }
}

static void cells_finer_than_one_exist_only_without_integer_division(void **state)
{
    (void)state; /* init_factor 4: cells 4, 1 and then 0 in the reference's integers, 0.25 in ours */
    for (int reference = 0; reference <= 1; reference++) {
        scene sc = empty_scene(2, 1);
        sc.a.offset[0] = 11.3f;
        sc.a.position[3] = 11.0f; /* in its cells of 4 and 1, not in that of 0.25 */
        set_gradient(&sc, 0, 1.0f);
        growth_def def = growth_def_default();
        def.voxel_size = 1.0f;
        def.init_factor = 4;
        set_reference(&def, reference == 1);
        keep_all(&def, 2);
        growth_result r;
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        assert_int_equal(r.grown, reference == 1 ? 0 : 1);
        if (reference == 0)
            assert_true(sc.a.position[6] == 11.3f && fabs((double)sc.a.scale_log[12] - log(0.25)) < 1e-6);
        free_scene(&sc, &r);
    }
}

static void cells_round_half_to_even(void **state)
{
    (void)state;
    const float at[4] = {24.0f, 40.0f, -24.0f, 23.9f},
                expected[4] = {32.0f, 32.0f, -32.0f, 16.0f}; /* 1.5 -> 2, 2.5 -> 2 */
    for (size_t i = 0; i < 4; i++) {
        scene sc = empty_scene(1, 1);
        sc.a.offset[0] = at[i];
        set_gradient(&sc, 0, 3e-4f);
        growth_def def = growth_def_default();
        def.voxel_size = 1.0f;
        set_reference(&def, true);
        keep_all(&def, 1);
        growth_result r;
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        assert_int_equal(r.grown, 1);
        assert_true(sc.a.position[3] == expected[i]);
        free_scene(&sc, &r);
    }
}

static void shape_scales_are_cut(void **state)
{
    (void)state;
    scene sc = empty_scene(1, 1);
    sc.a.offset[0] = 17.0f;
    for (size_t c = 0; c < 6; c++)
        sc.a.scale_log[c] = c == 4 ? -1.0f : 0.5f;
    set_gradient(&sc, 0, 2.5e-4f);
    growth_def def = growth_def_default();
    def.voxel_size = 1.0f;
    def.shape_log_max = 0.05f;
    keep_all(&def, 1);
    growth_result r;
    assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
    const float expected[6] = {0.5f, 0.5f, 0.5f, 0.05f, -1.0f, 0.05f};
    assert_memory_equal(sc.a.scale_log, expected, sizeof expected);
    assert_int_equal(r.count, 2);
    assert_true(sc.a.scale_log[6] > 2.7f && sc.a.scale_log[9] == 0.05f); /* the new one too */
    free_scene(&sc, &r);
}

static void the_last_anchor_stays(void **state)
{
    (void)state;
    scene sc = empty_scene(3, 1);
    for (size_t i = 0; i < 3; i++) {
        sc.s.visit_count[i] = sc.s.shown_count[i] = 100;
        sc.s.importance_accum[i] = i == 1 ? 0.2f : 0.1f;
        sc.a.position[i * 3] = (float)i;
    }
    growth_def def = growth_def_default();
    def.voxel_size = 1.0f;
    growth_result r;
    assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
    assert_int_equal(r.count, 1);
    assert_int_equal(r.pruned, 2);
    assert_int_equal(r.source[0], 1); /* the most opaque of them */
    assert_true(sc.a.position[0] == 1.0f && r.kept_last);
    free_scene(&sc, &r);
}

static void growing_can_be_switched_off(void **state)
{
    (void)state;
    for (int grow = 0; grow < 2; grow++) {
        scene sc = empty_scene(2, 1);
        sc.a.offset[0] = 17.0f;
        set_gradient(&sc, 0, 2.5e-4f);
        sc.s.visit_count[1] = sc.s.shown_count[1] = 100;
        growth_def def = growth_def_default();
        def.voxel_size = 1.0f;
        def.grow = grow;
        keep_all(&def, 2);
        growth_result r;
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        assert_int_equal(r.grown, grow);
        assert_int_equal(r.pruned, 1);
        assert_true(sc.s.grad_count[0] == (def.grow ? 0.0f : 50.0f)); /* what was not used is kept */
        free_scene(&sc, &r);
    }
}

/* ---- the cap ---- */

static void the_cap_takes_the_largest_gradients(void **state)
{
    (void)state;
    /* Six free cells along x with gradients 3 1 2 3 3 1 (times 1e-4 above the threshold); one anchor is
       pruned and makes room. */
    const float gradients[6] = {3, 1, 2, 3, 3, 1};
    const struct {
        size_t max_anchors, expected_count;
        float expected[6]; /* cells, ascending */
    } cases[] = {
        {6 + 1, 1, {1}}, /* six survive: one place; ties by cell */
        {6 + 2, 2, {1, 4}},
        {6 + 4, 4, {1, 3, 4, 5}}, /* all the 3s and the 2 */
        {100, 6, {1, 2, 3, 4, 5, 6}},
        {3, 0, {0}}, /* never removes anything by itself */
    };
    for (size_t t = 0; t < 5; t++) {
        scene sc = empty_scene(7, 1);
        for (size_t i = 0; i < 6; i++) {
            sc.a.offset[i * 3] = 16.0f * (float)(i + 1);
            set_gradient(&sc, i, 2e-4f + gradients[i] * 1e-5f);
        }
        sc.s.visit_count[6] = sc.s.shown_count[6] = 100;
        growth_def def = growth_def_default();
        def.voxel_size = 1.0f;
        def.max_anchors = cases[t].max_anchors;
        keep_all(&def, 6);
        growth_result r;
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        assert_int_equal(r.pruned, 1);
        assert_int_equal(r.grown, cases[t].expected_count);
        for (size_t i = 0; i < r.grown; i++)
            assert_true(sc.a.position[(6 + i) * 3] == 16.0f * cases[t].expected[i]);
        free_scene(&sc, &r);
    }
}

static void a_cell_is_worth_its_best_candidate(void **state)
{
    (void)state;
    for (int order = 0; order <= 1; order++) {
        scene sc = empty_scene(3, 1); /* 0 and 1 share the cell of 32, 2 is alone in that of 64 and between
                                         them in gradient */
        const float to[3] = {32, 33, 64},
                    gradients[3] = {order == 0 ? 2.1e-4f : 3e-4f, order == 0 ? 3e-4f : 2.1e-4f, 2.5e-4f};
        for (size_t i = 0; i < 3; i++) {
            sc.a.offset[i * 3] = to[i];
            set_gradient(&sc, i, gradients[i]);
        }
        growth_def def = growth_def_default();
        def.voxel_size = 1.0f;
        def.max_anchors = 4;
        keep_all(&def, 3);
        growth_result r;
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        assert_int_equal(r.count, 4);
        assert_true(sc.a.position[9] == (order == 0 ? 33.0f : 32.0f));
        free_scene(&sc, &r);
    }
}

/* ---- brute force ---- */

typedef struct brute_anchor {
    double center[3], position[3], scale, feature[32], gradient;
} brute_anchor;

static int by_place(const void *a, const void *b)
{
    const brute_anchor *x = a, *y = b;
    for (int c = 0; c < 3; c++)
        if (x->center[c] < y->center[c] || x->center[c] > y->center[c])
            return x->center[c] < y->center[c] ? -1 : 1;
    return 0;
}

static bool right_of_the_middle(const void *context, const float position[3])
{
    (void)context;
    return position[0] >= 0;
}

static size_t keep_standing(brute_anchor *added, size_t count,
                            bool (*may_stand)(const void *, const float[3]))
{
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        const float at[3] = {(float)added[i].position[0], (float)added[i].position[1],
                             (float)added[i].position[2]};
        if (may_stand(NULL, at))
            added[kept++] = added[i];
    }
    return kept;
}

/* New anchors as the text says it, with quadratic searches; voxel sizes are powers of two, so that cells are
   exact in both. */
static size_t brute_grow(const scene *sc, const growth_def *def, brute_anchor *added)
{
    const size_t offsets = (size_t)sc->a.offset_count;
    size_t count = 0;
    for (int level = 0; level < 4; level++) { /* Gaussians, then places */
        const double factor = (double[4]){16, 4, 1, 0.25}[level];
        const double cell = (double)def->voxel_size * (def->integer_division ? floor(factor) : factor);
        if (!(cell > 0))
            continue;
        const bool as_start = def->points.as_start;
        const double threshold = (double)def->grad_threshold * (double[4]){1, 2, 4, as_start ? 1 : 4}[level];
        const size_t begin = count;
        if (def->coarse_level_gates && level > 0 && count == 0)
            break;
        const size_t slots = sc->a.count * offsets;
        const bool is_place = level == 3;
        for (size_t n = is_place ? slots : 0; n < slots + (is_place ? def->points.count : 0); n++) {
            const size_t p = n - slots, i = is_place ? def->points.anchor[p] : n / offsets;
            brute_anchor b = {.scale = !is_place  ? cell
                                       : as_start ? (double)def->points.scale[p]
                                                  : 4 * cell,
                              .gradient = -1};
            for (size_t slot = is_place ? i * offsets : n; slot < (is_place ? (i + 1) * offsets : n + 1);
                 slot++)
                if (sc->s.grad_count[slot] > (is_place && as_start ? 0 : 40))
                    b.gradient = fmax(b.gradient, (double)(sc->s.grad_accum[slot] / sc->s.grad_count[slot]));
            if (b.gradient < threshold || !(is_place || survives(def, level, n)))
                continue;
            for (size_t c = 0; c < 3; c++) {
                const float *anchor = &sc->a.position[i * 3 + c], *scale_log = &sc->a.scale_log[i * 6 + c];
                const float at = is_place ? def->points.position[p * 3 + c]
                                          : *anchor + sc->a.offset[n * 3 + c] * activation_exp(*scale_log);
                b.center[c] = rint((double)at / cell) * cell;
                b.position[c] = def->at_cell_center ? b.center[c] : (double)at;
            }
            bool taken = false;
            for (size_t j = 0; j < sc->a.count + begin; j++) {
                bool same = true;
                for (size_t c = 0; c < 3; c++) {
                    const double at = j < sc->a.count ? (double)sc->a.position[j * 3 + c]
                                                      : added[j - sc->a.count].position[c];
                    same = same && rint(at / cell) * cell == b.center[c];
                }
                taken = taken || same;
            }
            if (taken)
                continue;
            size_t known = begin;
            while (known < count && by_place(&added[known], &b) != 0)
                known++;
            if (known == count) {
                added[count++] = b;
                for (int f = 0; f < 32; f++)
                    added[known].feature[f] = -HUGE_VAL;
            } else if (b.gradient > added[known].gradient) {
                added[known].gradient = b.gradient;
                added[known].scale = b.scale;
                memcpy(added[known].position, b.position, sizeof b.position);
            }
            for (size_t f = 0; f < 32; f++)
                added[known].feature[f] = fmax(added[known].feature[f], (double)sc->a.feature[i * 32 + f]);
        }
        count =
            begin + keep_standing(added + begin, count - begin, is_place ? growth_anywhere : def->may_stand);
        qsort(added + begin, count - begin, sizeof *added, by_place);
    }
    return count;
}

static scene random_scene(uint64_t seed, size_t count, int offset_count)
{
    scene sc = {.a = random_anchors(count, offset_count, seed)};
    assert_ok(growth_stats_resize(&sc.s, count, offset_count, NULL));
    for (size_t i = 0; i < count; i++) {
        sc.s.visit_count[i] = floorf(spread(seed, 50, i, 0, 160));
        sc.s.shown_count[i] = floorf(sc.s.visit_count[i] * spread(seed, 52, i, 0.2f, 1));
        sc.s.importance_accum[i] = sc.s.shown_count[i] * spread(seed, 51, i, 0, 0.02f);
    }
    for (size_t i = 0; i < count * (size_t)offset_count; i++) {
        sc.s.grad_count[i] = floorf(spread(seed, 52, i, 0, 80));
        sc.s.grad_accum[i] = sc.s.grad_count[i] * spread(seed, 53, i, 0, 1.2e-3f);
    }
    return sc;
}

static void rounds_agree_with_brute_force(void **state)
{
    (void)state;
    size_t at_places = 0, total_grown = 0, total_pruned = 0, total_gated = 0;
    for (uint64_t seed = 0; seed < 120; seed++) {
        const size_t count = 1 + (size_t)spread(seed, 60, 0, 0, 60);
        const int offset_count = 1 + (int)spread(seed, 61, 0, 0, 5);
        scene sc = random_scene(seed, count, offset_count), before = random_scene(seed, count, offset_count);
        growth_def def = growth_def_default();
        def.voxel_size = seed % 3 == 0 ? 0.5f : seed % 3 == 1 ? 0.03125f : 0.00390625f;
        def.seed = seed;
        def.step = 100 * seed;
        def.integer_division = seed % 2 == 1;
        def.coarse_level_gates = seed / 2 % 2 == 1;
        def.at_cell_center = seed / 4 % 2 == 1;
        def.may_stand = seed % 5 == 0 ? right_of_the_middle : growth_anywhere;
        float place[40][3], place_scale[40];
        uint32_t place_anchor[40];
        def.points.position = place[0];
        def.points.as_start = seed % 4 < 2;
        def.points.scale = place_scale;
        def.points.anchor = place_anchor;
        def.points.count = (size_t)spread(seed, 62, 0, 0, 40);
        for (size_t p = 0; p < def.points.count; p++) {
            place_anchor[p] = (uint32_t)(rng_uniform(seed, 63, p) * (float)count);
            place_scale[p] = spread(seed, 67, p, 0.01f, 1);
            for (size_t c = 0; c < 3; c++)
                place[p][c] = spread(seed, 64 + c, p, -1, 1);
        }
        brute_anchor *added =
            mem_calloc(3 * (count * (size_t)offset_count + def.points.count), sizeof *added, "test", NULL);
        const size_t grown = brute_grow(&before, &def, added);
        total_gated += grown == 0;
        growth_result r;
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        if (r.grown != grown)
            fail_msg("seed %llu: %zu grown, not %zu", (unsigned long long)seed, r.grown, grown);
        total_grown += grown;
        total_pruned += r.pruned;
        for (size_t g = 0; g < grown; g++)
            for (size_t p = 0; p < def.points.count; p++)
                at_places += added[g].position[0] == (double)place[p][0] &&
                             added[g].position[1] == (double)place[p][1];
        assert_true(r.count == sc.a.count && r.count == sc.s.count && r.count >= 1 &&
                    r.count == count - r.pruned + grown);
        size_t row = 0;
        const size_t k = (size_t)offset_count;
        for (size_t i = 0; i < count; i++) {
            const bool is_judged = before.s.visit_count[i] > 80;
            const bool transparent =
                before.s.importance_accum[i] < 0.005f * fmaxf(before.s.shown_count[i], 1);
            if (is_judged && transparent && (row >= r.survivors || r.source[row] != i)) /* the last one may
                                                                                           have stayed */
                continue;
            assert_int_equal(r.source[row], i);
            assert_memory_equal(sc.a.feature + row * 32, before.a.feature + i * 32, 32 * sizeof(float));
            assert_memory_equal(sc.a.offset + row * k * 3, before.a.offset + i * k * 3,
                                k * 3 * sizeof(float));
            assert_memory_equal(sc.a.scale_log + row * 6, before.a.scale_log + i * 6, 6 * sizeof(float));
            assert_memory_equal(sc.a.position + row * 3, before.a.position + i * 3, 3 * sizeof(float));
            assert_true(sc.s.visit_count[row] == (is_judged ? 0 : before.s.visit_count[i]));
            assert_true(sc.s.shown_count[row] == (is_judged ? 0 : before.s.shown_count[i]));
            assert_true(sc.s.importance_accum[row] == (is_judged ? 0 : before.s.importance_accum[i]));
            for (size_t j = 0; j < k; j++) {
                const bool sampled = before.s.grad_count[i * k + j] > 40;
                assert_true(sc.s.grad_count[row * k + j] == (sampled ? 0 : before.s.grad_count[i * k + j]));
                assert_true(sc.s.grad_accum[row * k + j] == (sampled ? 0 : before.s.grad_accum[i * k + j]));
            }
            row++;
        }
        assert_int_equal(row, r.survivors);
        assert_int_equal(row + grown, r.count);
        for (size_t i = 0; i < grown; i++, row++) {
            for (size_t c = 0; c < 3; c++)
                assert_true((double)sc.a.position[row * 3 + c] == added[i].position[c]);
            for (size_t f = 0; f < 32; f++)
                assert_true((double)sc.a.feature[row * 32 + f] == added[i].feature[f]);
            assert_true(fabs((double)sc.a.scale_log[row * 6 + 5] - log(added[i].scale)) < 1e-6);
            for (size_t j = 0; j < k; j++)
                assert_true(sc.s.grad_count[row * k + j] == 0 && sc.s.grad_accum[row * k + j] == 0);
        }
        mem_free(added);
        free_scene(&before, NULL);
        free_scene(&sc, &r);
    }
    assert_true(total_grown > 1000 && total_pruned > 100 && total_gated > 0 && at_places > 100);
}

static void the_cap_holds_for_random_scenes(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 40; seed++) {
        for (size_t cap = 0; cap < 140; cap += 20) {
            scene sc = random_scene(seed, 50, 4);
            growth_def def = growth_def_default();
            def.voxel_size = 0.03125f;
            def.seed = seed;
            def.max_anchors = cap;
            growth_result r;
            assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
            assert_true(sc.a.count <= cap || r.grown == 0);
            assert_int_equal(50 + r.grown - r.pruned, sc.a.count);
            free_scene(&sc, &r);
        }
    }
}

static uint64_t round_hash(uint64_t seed)
{
    scene sc = random_scene(7, 400, 10);
    growth_def def = growth_def_default();
    def.voxel_size = 0.01f;
    def.seed = seed;
    def.max_anchors = 1500;
    growth_result r;
    assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
    uint64_t hash = hash_bytes(1, sc.a.position, sc.a.count * 3 * sizeof(float));
    hash = hash_bytes(hash, sc.a.feature, sc.a.count * 32 * sizeof(float));
    hash = hash_bytes(hash, r.source, r.survivors * sizeof *r.source);
    hash = hash_bytes(hash, sc.s.grad_accum, sc.s.count * 10 * sizeof(float));
    free_scene(&sc, &r);
    return hash;
}

static void same_bits_for_all_threads(void **state)
{
    (void)state;
    const int before = parallel_threads();
    parallel_set_threads(1);
    const uint64_t want = round_hash(5);
    parallel_set_threads(4);
    assert_true(round_hash(5) == want);
    assert_true(round_hash(6) != want);
    parallel_set_threads(before);
}

/* Every Gaussian a candidate: the largest gradients win, then the lower level, then the lower cell; the
   threshold may be 0. */
static void an_explosion_is_capped(void **state)
{
    (void)state;
    enum { COUNT = 400, OFFSETS = 5, SLOTS = COUNT * OFFSETS };
    for (int equal = 0; equal <= 1; equal++)
        for (size_t cap = COUNT; cap <= COUNT + 300; cap += 100) {
            scene capped = random_scene(77, COUNT, OFFSETS), whole = random_scene(77, COUNT, OFFSETS);
            scene *const both[2] = {&capped, &whole};
            growth_result r[2];
            for (int i = 0; i < 2; i++) {
                for (size_t slot = 0; slot < SLOTS; slot++)
                    set_gradient(both[i], slot, equal ? 1.0f : spread(78, 0, slot, 0, 1));
                growth_def def = growth_def_default();
                def.voxel_size = 0.01f;
                def.grad_threshold = 0.0f;
                def.importance_min = 0;
                def.max_anchors = i == 0 ? cap : SIZE_MAX;
                assert_ok(growth_round(&both[i]->a, &both[i]->s, &def, &r[i], NULL));
            }
            assert_true(r[1].count > COUNT + 300);
            assert_int_equal(r[0].count, cap);
            size_t from = COUNT; /* what was kept is in the order of what could have been */
            for (size_t row = COUNT; row < cap; row++, from++) {
                while (from < r[1].count && memcmp(whole.a.position + 3 * from, capped.a.position + 3 * row,
                                                   3 * sizeof(float)) != 0)
                    from++;
                assert_true(from < r[1].count);
                if (equal) /* ties: the first cells of the first levels */
                    assert_int_equal(from, row);
            }
            free_scene(&capped, &r[0]);
            free_scene(&whole, &r[1]);
        }
}

/* Cells of a millimetre at the coordinates of a map grid have indices beyond 2^32. */
static void far_cells_have_addresses(void **state)
{
    (void)state;
    scene sc = empty_scene(2, 1);
    sc.a.position[0] = 4.5e6f;
    sc.a.position[3] = -4.5e6f;
    for (size_t i = 0; i < 2; i++) {
        sc.a.offset[3 * i + 1] = i == 0 ? 8.0f : -8.0f;
        set_gradient(&sc, i, 1.0f);
    }
    growth_def def = growth_def_default();
    def.voxel_size = 0.001f / 16.0f;
    def.level_count = 1;
    keep_all(&def, 2);
    growth_result r;
    assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
    assert_int_equal(r.grown, 2);
    assert_true(fabsf(sc.a.position[6] + 4.5e6f) <= 0.5f && fabsf(sc.a.position[9] - 4.5e6f) <= 0.5f);
    assert_true(fabsf(sc.a.position[7] + 8.0f) < 0.001f && fabsf(sc.a.position[10] - 8.0f) < 0.001f);
    free_scene(&sc, &r);
}

/* ---- edges ---- */

static void wild_places_and_cells(void **state)
{
    (void)state;
    const float cells[] = {1e-30f, 0.0f, -1.0f, NAN, INFINITY, 1e30f};
    for (size_t t = 0; t < 6; t++) {
        scene sc = empty_scene(4, 1);
        const float offset[4] = {3e38f, NAN, 5.0f, INFINITY};
        for (size_t i = 0; i < 4; i++) {
            sc.a.offset[i * 3] = offset[i];
            set_gradient(&sc, i, 1.0f);
        }
        sc.a.position[3] = 3e38f;
        growth_def def = growth_def_default();
        def.voxel_size = cells[t];
        keep_all(&def, 4);
        growth_result r;
        assert_ok(growth_round(&sc.a, &sc.s, &def, &r, NULL));
        for (size_t i = 0; i < r.grown * 3; i++)
            assert_true(isfinite(sc.a.position[12 + i]));
        if (t >= 1 && t <= 4)
            assert_int_equal(r.grown, 0);
        free_scene(&sc, &r);
    }
}

static void wrong_arguments_are_refused(void **state)
{
    (void)state;
    scene sc = empty_scene(3, 2);
    growth_result r;
    gbt_error err = {0};
    growth_def def = growth_def_default();
    def.voxel_size = 1.0f;
    for (int t = 0; t < 5; t++) {
        growth_def wrong = def;
        if (t == 0)
            wrong.level_count = 9;
        else if (t == 1)
            wrong.init_factor = 0;
        else if (t == 2)
            wrong.hierarchy_factor = 0;
        else if (t == 3)
            wrong.grad_threshold = NAN;
        else
            wrong.shape_log_max = NAN;
        assert_int_equal(growth_round(&sc.a, &sc.s, &wrong, &r, &err), GBT_ERR_ARGUMENT);
        assert_null(r.source);
    }
    assert_string_not_equal(err.text, "");
    assert_ok(growth_stats_resize(&sc.s, 2, 2, NULL));
    assert_int_equal(growth_round(&sc.a, &sc.s, &def, &r, NULL), GBT_ERR_ARGUMENT);
    assert_int_equal(growth_stats_resize(&sc.s, 2, 3, NULL), GBT_ERR_ARGUMENT);
    free_scene(&sc, NULL);
}

static void no_memory_changes_nothing(void **state)
{
    (void)state;
    long n = 0;
    for (;; n++) {
        scene sc = random_scene(3, 40, 4);
        const uint64_t before =
            hash_bytes(hash_bytes(1, sc.a.feature, 40 * 32 * 4), sc.s.grad_count, 40 * 4 * 4);
        growth_def def = growth_def_default();
        def.voxel_size = 0.03125f;
        growth_result r;
        gbt_error err = {0};
        mem_fail_after(n);
        const gbt_status status = growth_round(&sc.a, &sc.s, &def, &r, &err);
        mem_fail_after(-1);
        if (status != GBT_OK) {
            assert_int_equal(status, GBT_ERR_NO_MEMORY);
            assert_true(err.text[0] != '\0' && r.source == NULL && sc.a.count == 40 && sc.s.count == 40);
            assert_true(hash_bytes(hash_bytes(1, sc.a.feature, 40 * 32 * 4), sc.s.grad_count, 40 * 4 * 4) ==
                        before);
        }
        free_scene(&sc, &r);
        if (status == GBT_OK)
            break;
    }
    assert_true(n > 10);
}

static void statistics_follow_rows(void **state)
{
    (void)state;
    growth_stats s = {0};
    assert_ok(growth_stats_resize(&s, 3, 2, NULL));
    for (size_t i = 0; i < 6; i++) {
        s.grad_accum[i] = (float)i;
        s.visit_count[i / 2] = (float)i;
    }
    assert_ok(growth_stats_resize(&s, 100, 2, NULL));
    assert_true(s.grad_accum[5] == 5 && s.visit_count[2] == 5 && s.grad_accum[6] == 0 &&
                s.grad_accum[199] == 0 && s.visit_count[99] == 0);
    assert_ok(growth_stats_resize(&s, 2, 2, NULL));
    assert_ok(growth_stats_resize(&s, 3, 2, NULL));
    assert_true(s.grad_accum[3] == 3 && s.grad_accum[4] == 0 && s.visit_count[2] == 0);
    growth_stats_free(&s);
    assert_int_equal(s.count, 0);
}

/* A camera at 0 that looks along z, farther to the sides than up and down; balls of 3 x 0.1 around the
   means. */
static void gradients_are_of_what_is_in_view(void **state)
{
    (void)state;
    static const struct {
        float mean[3];
        bool counts;
    } cases[] = {{{0, 0, 2}, true},       {{0, 0, -2}, false},     {{0, 0, 0.2f}, false},
                 {{0, 0, 0.21f}, true},   {{0, 1.25f, 2}, true},   {{0, 1.35f, 2}, false},
                 {{0, -1.35f, 2}, false}, {{2.75f, 0, 2}, true},   {{2.85f, 0, 2}, false},
                 {{-2.75f, 0, 2}, true},  {{-2.85f, 0, 2}, false}, {{2.75f, -1.25f, 2}, true}};
    enum { COUNT = sizeof cases / sizeof *cases };
    uint32_t visible[COUNT], slot[COUNT];
    float opacity_sum[COUNT];
    frame f = {.visible = visible,
               .visible_count = COUNT,
               .half_fov_tan = {1.25, 0.5},
               .camera.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    growth_stats s = {0};
    assert_ok(gaussians_resize(&f.gaussians, COUNT, NULL));
    assert_ok(gaussians_resize(&f.d_gaussians, COUNT, NULL));
    assert_ok(growth_stats_resize(&s, COUNT + 1, 1, NULL)); /* the last one is out of view */
    gaussians_zero(&f.d_gaussians);
    for (uint32_t i = 0; i < COUNT; i++) {
        visible[i] = COUNT - 1 - i; /* rows and Gaussians have other orders */
        slot[i] = i;
        opacity_sum[i] = (float)i;
        f.gaussians.mean_x[i] = cases[i].mean[0];
        f.gaussians.mean_y[i] = cases[i].mean[1];
        f.gaussians.mean_z[i] = cases[i].mean[2];
        f.gaussians.scale_x[i] = f.gaussians.scale_y[i] = 0.05f;
        f.gaussians.scale_z[i] = 0.1f;
        f.d_gaussians.mean_x[i] = 2.4f;
        f.d_gaussians.mean_y[i] = 8;
        f.d_gaussians.mean_z[i] = 100;
    }
    f.tape.slot = slot;
    f.tape.opacity_sum = opacity_sum;
    for (int twice = 0; twice < 2; twice++)
        growth_stats_gather(&s, &f, GROWTH_BY_OPACITY, GROWTH_COUNT_IN_CONE, 0.2f);
    for (size_t i = 0; i < COUNT; i++) {
        const size_t row = COUNT - 1 - i;
        assert_true(s.grad_count[row] == (cases[i].counts ? 2.0f : 0.0f));
        assert_float_equal(s.grad_accum[row], cases[i].counts ? 2 * 5 * cases[i].mean[2] : 0, 1e-5f);
        assert_true(s.visit_count[row] == 2 && s.importance_accum[row] == 2 * (float)i);
    }
    growth_stats_free(&s);
    gaussians_free(&f.gaussians);
    gaussians_free(&f.d_gaussians);
}

int main(void)
{
    struct CMUnitTest tests[64];
    size_t count = 0;
    for (size_t i = 0; i < sizeof prune_cases / sizeof *prune_cases; i++)
        tests[count++] = (struct CMUnitTest){
            .name = prune_cases[i].name, .test_func = prunes, .initial_state = &prune_cases[i]};
    for (size_t i = 0; i < sizeof grow_cases / sizeof *grow_cases; i++)
        tests[count++] = (struct CMUnitTest){
            .name = grow_cases[i].name, .test_func = grows, .initial_state = &grow_cases[i]};
    const struct CMUnitTest single[] = {
        cmocka_unit_test(two_candidates_in_one_cell),
        cmocka_unit_test(levels_have_their_own_cells_and_thresholds),
        cmocka_unit_test(a_silent_coarse_level_gates_only_by_the_reference_rule),
        cmocka_unit_test(cells_finer_than_one_exist_only_without_integer_division),
        cmocka_unit_test(cells_round_half_to_even),
        cmocka_unit_test(shape_scales_are_cut),
        cmocka_unit_test(the_last_anchor_stays),
        cmocka_unit_test(growing_can_be_switched_off),
        cmocka_unit_test(the_cap_takes_the_largest_gradients),
        cmocka_unit_test(a_cell_is_worth_its_best_candidate),
        cmocka_unit_test(rounds_agree_with_brute_force),
        cmocka_unit_test(the_cap_holds_for_random_scenes),
        cmocka_unit_test(same_bits_for_all_threads),
        cmocka_unit_test(an_explosion_is_capped),
        cmocka_unit_test(far_cells_have_addresses),
        cmocka_unit_test(wild_places_and_cells),
        cmocka_unit_test(wrong_arguments_are_refused),
        cmocka_unit_test(no_memory_changes_nothing),
        cmocka_unit_test(statistics_follow_rows),
        cmocka_unit_test(gradients_are_of_what_is_in_view),
    };
    for (size_t i = 0; i < sizeof single / sizeof *single; i++)
        tests[count++] = single[i];
    return _cmocka_run_group_tests("growth", tests, count, NULL, NULL);
}
