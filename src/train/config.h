/* SPDX-License-Identifier: Apache-2.0 */
/* train/config.h -- the settings of a run as text, saved with every run and read back by --resume. */
#ifndef GBT_TRAIN_CONFIG_H
#define GBT_TRAIN_CONFIG_H

#include "train/settings.h"

enum { CONFIG_TEXT_SIZE = 4096 };

/** "key = value" lines for every setting that affects the result (not threads, not the interval of
    checkpoints), and for the data folder. */
void config_text(const gbt_train_def *def, const char *data, char *out, size_t size);

/** Check that config_parse() can read the text back: GBT_ERR_ARGUMENT for a name with a line break, or of
    SETTING_TEXT_SIZE bytes or more. */
gbt_status config_check(const gbt_train_def *def, const char *data, gbt_error *err);

/** Where config_parse() keeps the strings that the def points to. */
typedef struct config_strings {
    setting_texts texts;
    char data[SETTING_TEXT_SIZE];
} config_strings;

/** Parse such text into `def`; fields that it does not name stay. GBT_ERR_FORMAT with file and line for
    invalid text. */
gbt_status config_parse(const char *text, const char *path, gbt_train_def *def, config_strings *strings,
                        gbt_error *err);

#endif
