/* SPDX-License-Identifier: Apache-2.0 */
/* tests/write_text.h -- a file of a few words. */
#ifndef GBT_TEST_WRITE_TEXT_H
#define GBT_TEST_WRITE_TEXT_H

#include "base/file.h"
#include "test_support.h"

/** In the place of what was there. */
static inline void write_text(const char *path, const char *text)
{
    assert_ok(file_write_atomic(path, text, strlen(text), &assert_ok_err_));
}

#endif
