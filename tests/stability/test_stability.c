/* SPDX-License-Identifier: Apache-2.0 */
/* tests/stability/test_stability.c -- every row of the catalogue within its limit, in the quick sizes; and
   the study's own machinery. */
#include "folder.h"

#include "lab/lab.h"
#include "quiet.h"
#include "report/text.h"
#include "stability/draw.h"

static stability_study *measure(const char *only)
{
    stability_study *study = mem_calloc(1, sizeof *study, "study", NULL);
    gbt_error err = {0};
    if (stability_measure(only, true, test_folder, study, &err) != GBT_OK)
        fail_msg("%s: %s", only, err.text);
    return study;
}

/* One test per case, so that a failure says which. */
static void rows_of(const char *id)
{
    stability_study *study = measure(id);
    size_t broken = 0;
    assert_int_equal(study->part_count, 1);
    assert_true(study->row_count > 0);
    for (size_t i = 0; i < study->row_count; i++) {
        const stability_row *r = &study->rows[i];
        print_message("%s %s: %.4g (limit %.4g, rasterizer %.4g)\n", r->id, r->quantity, r->value, r->limit,
                      r->raster);
        broken += !r->timed && r->pass == r->open; /* an open row that passes is open no more */
    }
    assert_int_equal(broken, 0);
    mem_free(study);
}

#define X(tag, id, file)                                                                                     \
    static void case_##tag(void **state)                                                                     \
    {                                                                                                        \
        (void)state;                                                                                         \
        rows_of(id);                                                                                         \
    }
STABILITY_CASES(X)
#undef X

static void names_of_cases(void **state)
{
    (void)state;
    static const char *const bad[] = {"", "A", "A0", "A1,", ",A1", "a1", "A1 ,A2", "A1,A1", "A1;A2", "A111"};
    stability_study *study = mem_calloc(1, sizeof *study, "study", NULL);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        gbt_error err = {0};
        assert_int_equal(stability_measure(bad[i], true, test_folder, study, &err), GBT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, "A1 to A13"));
    }
    mem_free(study);
    study = measure("A7,A3");
    assert_int_equal(study->part_count, 2); /* in the order of the catalogue */
    assert_string_equal(study->parts[0].id, "A3");
    assert_string_equal(study->parts[1].id, "A7");
    assert_true(study->rows[study->row_count - 1].part == 1 && study->rows[0].part == 0);
    mem_free(study);
}

/* ---- what a scene file may say ---- */

static stability open_text(stability_study *study, const char *json, gbt_error *err)
{
    stability s = {.study = study, .folder = test_folder, .err = err, .path = "x.json"};
    s.scene = json_loads(json, 0, NULL);
    assert_non_null(s.scene);
    study->part_count = 1;
    return s;
}

static void numbers_and_their_quick_form(void **state)
{
    (void)state;
    stability_study *study = mem_calloc(1, sizeof *study, "study", NULL);
    gbt_error err = {0};
    stability s =
        open_text(study, "{\"numbers\":{\"a\":1,\"b\":[1,2,3],\"c\":\"no\"},\"quick\":{\"a\":0.5}}", &err);
    double list[3] = {0};
    assert_true(stability_number(&s, "a") == 1);
    study->quick = true;
    assert_true(stability_number(&s, "a") == 0.5);
    assert_int_equal(stability_list(&s, "b", 3, list), 3);
    assert_true(list[0] == 1 && list[2] == 3 && s.status == GBT_OK);
    assert_int_equal(stability_list(&s, "b", 2, list), 0); /* too long */
    assert_int_equal(s.status, GBT_ERR_FORMAT);
    assert_true(stability_number(&s, "a") == 0); /* nothing after a failure */
    assert_string_equal(err.text, "x.json: b: wanted a list of numbers, neither empty nor too long");
    static const char *const missing[] = {"c", "d"};
    for (size_t i = 0; i < 2; i++) {
        s.status = GBT_OK;
        err = (gbt_error){0};
        assert_true(stability_number(&s, missing[i]) == 0);
        assert_int_equal(s.status, GBT_ERR_FORMAT);
    }
    json_decref(s.scene);
    mem_free(study);
}

static void limits_are_exact(void **state)
{
    (void)state;
    stability_study *study = mem_calloc(1, sizeof *study, "study", NULL);
    gbt_error err = {0};
    stability s = open_text(study,
                            "{\"checks\":[{\"row\":\"a\",\"quantity\":\"q\",\"at_most\":1},{\"row\":\"b\","
                            "\"quantity\":\"q\",\"at_least\":1}]}",
                            &err);
    static const struct {
        const char *row;
        double value;
        bool pass;
    } tries[] = {
        {"a", 1, true}, {"a", 0, true}, {"a", 1.0000001, false}, {"a", NAN, false}, {"a", INFINITY, false},
        {"b", 1, true}, {"b", 2, true}, {"b", 0.9999999, false}, {"b", NAN, false}, {"b", -INFINITY, false},
    };
    for (size_t i = 0; i < sizeof tries / sizeof *tries; i++) {
        stability_check(&s, tries[i].row, tries[i].value, NAN, "note %d", 7);
        assert_int_equal(study->row_count, i + 1);
        assert_int_equal(study->rows[i].pass, tries[i].pass);
        assert_string_equal(study->rows[i].note, "note 7");
    }
    stability_check(&s, "c", 0, NAN, "%s", "");
    assert_int_equal(s.status, GBT_ERR_FORMAT);
    json_decref(s.scene);
    mem_free(study);
}

static void differences_keep_nan(void **state)
{
    (void)state;
    static const float a[4] = {0, 0.5f, 1, 0.25f}, b[4] = {0, 0.25f, 1, 0.25f},
                       bad[4] = {9, NAN, 0, INFINITY};
    static const double exact[4] = {0, 0.5, 0.5, 0.25};
    assert_true(draw_difference(a, a, 4) == 0 && draw_difference(a, b, 4) == 0.25);
    assert_true(isnan(draw_difference(a, bad, 4)) && isnan(draw_difference(bad, a, 2)));
    assert_true(draw_error(a, exact, 4) == 0.5 && isnan(draw_error(bad, exact, 3)));
    assert_true(fabs(draw_psnr(a, exact, 4) - -10 * log10(0.25 / 4)) < 1e-12 &&
                draw_psnr(a, exact, 2) == 200 && isnan(draw_psnr(bad, exact, 2)));
    assert_int_equal(draw_count_bad(bad, 4), 2);
    assert_int_equal(draw_count_bad(a, 4), 0);
}

static void turns_are_rotations(void **state)
{
    (void)state;
    for (int i = 0; i < 50; i++) {
        double m[9];
        draw_turned(0.3 * i, 0.2 * i - 3, m);
        for (int r = 0; r < 3; r++)
            for (int q = 0; q < 3; q++)
                assert_true(fabs(m[3 * r] * m[3 * q] + m[3 * r + 1] * m[3 * q + 1] +
                                 m[3 * r + 2] * m[3 * q + 2] - (r == q)) < 1e-14);
        const double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                                   m[2] * (m[3] * m[7] - m[4] * m[6]);
        assert_true(fabs(determinant - 1) < 1e-14);
    }
}

/* A chart without points says so; values that cannot be shown leave no mark, and texts are escaped. */
static void charts_of_little(void **state)
{
    (void)state;
    stability_study *study = mem_calloc(1, sizeof *study, "study", NULL);
    gbt_error err = {0};
    stability s = open_text(study, "{}", &err);
    stability_new_chart(&s, "empty", "note", "x", "y");
    stability_chart *chart = stability_new_chart(
        &s, "a < b", "a note that is so long that it has to go on in a second line below it", "x", "y");
    chart->log_y = true;
    static const double points[][2] = {{0, 1}, {1, 10}, {2, NAN}, {3, 0}, {INFINITY, 1}, {4, 100}};
    for (size_t i = 0; i < 6; i++)
        stability_point(chart, 0, points[i][0], points[i][1]);
    for (size_t i = 0; i < STABILITY_POINTS + 5; i++)
        stability_point(chart, 1, (double)i, 1);
    assert_int_equal(chart->series[1].count, STABILITY_POINTS); /* the rest is dropped */
    text out = {0};
    stability_draw_charts(study, &out);
    text_add(&out, "\n");
    assert_int_equal(out.status, GBT_OK);
    out.bytes[out.length - 1] = '\0';
    assert_non_null(strstr(out.bytes, "n/a: nothing was measured."));
    assert_non_null(strstr(out.bytes, "a &lt; b"));
    assert_null(strstr(out.bytes, "nan"));
    assert_null(strstr(out.bytes, "inf"));
    size_t dots = 0;
    for (const char *at = strstr(out.bytes, "class=\"dot"); at != NULL; at = strstr(at + 1, "class=\"dot"))
        dots++;
    assert_int_equal(dots, 3); /* of the short series only */
    text_free(&out);
    json_decref(s.scene);
    mem_free(study);
}

static void files_of_the_study(void **state)
{
    (void)state;
    static const char *const names[] = {"stability.json", "stability.md", "stability.svg",
                                        "stability_a1.png"};
    lab_stability_def def = lab_stability_def_default();
    gbt_error err = {0};
    FILE *out = tmpfile();
    def.only = "A1,A3";
    def.quick = 1;
    assert_non_null(out);
    assert_int_equal(lab_study_stability(&def, test_folder, out, &err), GBT_OK);
    assert_true(ftell(out) > 500);
    fclose(out);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        file_bytes b = read_bytes(in_folder("%s", names[i]));
        const char *said = (const char *)b.data;
        assert_true(b.count > 500);
        if (i < 3)
            assert_null(strstr(said, "nan"));
        if (i == 1) /* terminals show it too */
            assert_true(strstr(said, " | <= 0 | ") != NULL && strchr(said, '&') == NULL);
        mem_free(b.data);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(names_of_cases),
                                       cmocka_unit_test(numbers_and_their_quick_form),
                                       cmocka_unit_test(limits_are_exact),
                                       cmocka_unit_test(files_of_the_study),
                                       cmocka_unit_test(differences_keep_nan),
                                       cmocka_unit_test(turns_are_rotations),
                                       cmocka_unit_test(charts_of_little),
#define X(tag, id, file) cmocka_unit_test(case_##tag),
                                       STABILITY_CASES(X)
#undef X
    };
    be_quiet();
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
