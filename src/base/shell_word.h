/* SPDX-License-Identifier: Apache-2.0 */
/* base/shell_word.h -- text in commands that are shown to be copied. */
#ifndef GBT_BASE_SHELL_WORD_H
#define GBT_BASE_SHELL_WORD_H

#include <stddef.h>

/**
 * Text so that a POSIX shell takes it for one word: as it is where it can be, else in single quotes.
 *
 * @param size [in] of `out`, at least 1; what does not fit is cut off
 * @return `out`
 */
const char *shell_word(const char *text, char *out, size_t size);

#endif
