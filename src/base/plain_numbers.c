/* SPDX-License-Identifier: Apache-2.0 */
/* base/plain_numbers.c -- switch a thread to the C locale and back. */
#include "base/plain_numbers.h"

#include <pthread.h>

static locale_t plain;
static void make_plain(void) { plain = newlocale(LC_ALL_MASK, "C", (locale_t)0); }

locale_t plain_numbers_begin(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, make_plain);
    return uselocale(plain); /* without memory for the locale it is (locale_t)0, which changes nothing */
}

void plain_numbers_end(const locale_t *before) { uselocale(*before); }
