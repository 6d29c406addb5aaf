/* SPDX-License-Identifier: Apache-2.0 */
/* base/plain_numbers.h -- numbers in text have a point, whatever locale the program that uses the library has
 * set. */
#ifndef GBT_BASE_PLAIN_NUMBERS_H
#define GBT_BASE_PLAIN_NUMBERS_H

#include <locale.h>

/** Put this first in a function that reads or writes text: until it returns, printf() and strtod() of this
    thread use the C locale. */
#define PLAIN_NUMBERS                                                                                        \
    __attribute__((cleanup(plain_numbers_end), unused)) const locale_t plain_numbers_before =                \
        plain_numbers_begin()

locale_t plain_numbers_begin(void); /* returns the thread's previous locale */
void plain_numbers_end(const locale_t *before);

#endif
