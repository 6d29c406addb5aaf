/* SPDX-License-Identifier: Apache-2.0 */
/* tests/base/near.h -- cmocka's assert_float_equal() compares in single precision; this one in double. */
#ifndef GBT_TESTS_NEAR_H
#define GBT_TESTS_NEAR_H

#include "test_support.h"

/** |got - wanted| <= tolerance; fails on NaN. */
#define assert_near(got, wanted, tolerance)                                                                  \
    do {                                                                                                     \
        const double near_got_ = (got), near_wanted_ = (wanted);                                             \
        if (!(fabs(near_got_ - near_wanted_) <= (tolerance)))                                                \
            fail_msg("%s is %.17g, wanted %.17g (difference %g)", #got, near_got_, near_wanted_,             \
                     near_got_ - near_wanted_);                                                              \
    } while (0)

#endif
