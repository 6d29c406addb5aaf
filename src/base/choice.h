/* SPDX-License-Identifier: Apache-2.0 */
/* base/choice.h -- names of the enumerations in gbtrace/choices.h: "a|b|c", in the order of the enum. */
#ifndef GBT_BASE_CHOICE_H
#define GBT_BASE_CHOICE_H

#include "gbtrace/status.h"

enum { CHOICE_TEXT_SIZE = 128 };

/** Index of `text` among the names, or -1. */
int choice_find(const char *names, const char *text);

/** The name at `index`; "" when there is none. `out` has CHOICE_TEXT_SIZE bytes and is returned. */
const char *choice_name(const char *names, int index, char *out);

/** "a, b or c", for messages. `out` as above. */
const char *choice_list(const char *names, char *out);

/** GBT_OK when `value` has a name, else GBT_ERR_ARGUMENT: "FIELD: 7 (wanted a, b or c)". */
gbt_status choice_check(const char *field, const char *names, int value, gbt_error *err);

/** choice_name() with a buffer that lives until the end of the enclosing block. */
#define CHOICE_NAME(names, index) choice_name(names, (int)(index), (char[CHOICE_TEXT_SIZE]){0})

#endif
