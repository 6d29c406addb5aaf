/* SPDX-License-Identifier: Apache-2.0 */
/* tests/test_support.h -- cmocka in the order it wants, and the two things every test needs. */
#ifndef GBT_TEST_SUPPORT_H
#define GBT_TEST_SUPPORT_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "gbtrace/status.h"

/** Fails with the library's own message, where the call is given &assert_ok_err_. */
#define assert_ok(expr)                                                                                      \
    do {                                                                                                     \
        gbt_error assert_ok_err_ = {0};                                                                      \
        const gbt_status assert_ok_status_ = (expr);                                                         \
        if (assert_ok_status_ != GBT_OK)                                                                     \
            fail_msg("%s: status %d: %s", #expr, (int)assert_ok_status_, assert_ok_err_.text);               \
    } while (0)

/** Path of a file of the shared real data, or NULL when it is not there: then print a message and skip(). */
static inline const char *shared_path(const char *name)
{
    static char path[4096];
    const char *root = getenv("GBT_SHARED");
    snprintf(path, sizeof path, "%s/%s", root != NULL ? root : "../shared", name);
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        print_message("skipped: %s is not there\n", path);
        return NULL;
    }
    fclose(file);
    return path;
}

#endif
