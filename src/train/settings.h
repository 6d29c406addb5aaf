/* SPDX-License-Identifier: Apache-2.0 */
/* train/settings.h -- the settings of training, each on its own. */
#ifndef GBT_TRAIN_SETTINGS_H
#define GBT_TRAIN_SETTINGS_H

#include "gbtrace/train.h"

enum { SETTING_TEXT_SIZE = 1024, SETTING_TEXTS = 2 };

/** Where texts that were read are kept: the def points into it. One for each setting of the kind text. */
typedef struct setting_texts {
    char text[SETTING_TEXTS][SETTING_TEXT_SIZE];
} setting_texts;

/** The setting of a name: as RUN/config has it, or had it in former versions, or as the command line has it;
    NULL: there is none. */
const gbt_train_setting *setting_find(const char *name);

void setting_set_default(const gbt_train_setting *s, gbt_train_def *def);

/** GBT_OK, or GBT_ERR_ARGUMENT: "FIELD: value (wanted ...)". */
gbt_status setting_check(const gbt_train_setting *s, const gbt_train_def *def, gbt_error *err);

/** The value as text that setting_read() reads back to the same bits. */
void setting_text(const gbt_train_setting *s, const gbt_train_def *def, char *out, size_t size);

/** A value from text; false when it says none. Ranges are setting_check()'s. */
bool setting_read(const gbt_train_setting *s, const char *text, setting_texts *texts, gbt_train_def *def);

#endif
