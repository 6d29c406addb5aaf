/* SPDX-License-Identifier: Apache-2.0 */
/* train/settings.h -- access to single training settings: find, check, print and parse them. */
#ifndef GBT_TRAIN_SETTINGS_H
#define GBT_TRAIN_SETTINGS_H

#include "gbtrace/train.h"

enum { SETTING_TEXT_SIZE = 1024, SETTING_TEXTS = 2 };

/** Storage for parsed texts, to which the definition struct points. One buffer per setting of kind text. */
typedef struct setting_texts {
    char text[SETTING_TEXTS][SETTING_TEXT_SIZE];
} setting_texts;

/** Find a setting by its name in RUN/config, its name there in former versions, or its command-line option;
    NULL when there is none. */
const gbt_train_setting *setting_find(const char *name);

void setting_set_default(const gbt_train_setting *s, gbt_train_def *def);

/** GBT_OK, or GBT_ERR_ARGUMENT: "FIELD: value (wanted ...)". */
gbt_status setting_check(const gbt_train_setting *s, const gbt_train_def *def, gbt_error *err);

/** Print the value as text that setting_read() reads back to the same bits. */
void setting_text(const gbt_train_setting *s, const gbt_train_def *def, char *out, size_t size);

/** Parse a value; false when the text is not a value of this kind. The range is checked by
    setting_check(). */
bool setting_read(const gbt_train_setting *s, const char *text, setting_texts *texts, gbt_train_def *def);

#endif
