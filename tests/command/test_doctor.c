/* SPDX-License-Identifier: Apache-2.0 */
/* tests/command/test_doctor.c -- what the doctor takes for a failure of the tracer or its gradients. */
#include "command/doctor.h"
#include "test_support.h"

static void verdicts(void **state)
{
    (void)state;
    static const struct {
        double error;
        size_t left_out;
        gbt_check_level wanted;
    } cases[] = {{0, 0, GBT_CHECK_OK},      {1e-4, 8, GBT_CHECK_OK},
                 {2e-4, 8, GBT_CHECK_FAIL}, {(double)NAN, 8, GBT_CHECK_FAIL},
                 {1e-5, 50, GBT_CHECK_OK},  {1e-5, 51, GBT_CHECK_FAIL},
                 {0, 100, GBT_CHECK_FAIL}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        gbt_diagnosis d = {0};
        doctor_compare(&d, "tracer", "largest error", cases[i].error, 1e-4, 100, cases[i].left_out);
        assert_int_equal(d.count, 1);
        assert_int_equal(d.checks[0].level, cases[i].wanted);
        assert_int_equal(d.checks[0].advice[0] != '\0', cases[i].wanted == GBT_CHECK_FAIL);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(verdicts)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
