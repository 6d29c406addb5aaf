/* SPDX-License-Identifier: Apache-2.0 */
/* train/config.h -- the settings of a run as text: what is saved with every run, and what --resume reads
   back. */
#ifndef GBT_TRAIN_CONFIG_H
#define GBT_TRAIN_CONFIG_H

#include "train/settings.h"

enum { CONFIG_TEXT_SIZE = 4096 };

/** "key = value" lines for everything that decides the result (not threads, not when checkpoints are made),
    and the data folder. */
void config_text(const gbt_train_def *def, const char *data, char *out, size_t size);

/** Whether config_parse() would read that text back: GBT_ERR_ARGUMENT for a name of more than one line, or of
    SETTING_TEXT_SIZE bytes. */
gbt_status config_check(const gbt_train_def *def, const char *data, gbt_error *err);

/** Where config_parse() keeps the strings that the def points to. */
typedef struct config_strings {
    setting_texts texts;
    char data[SETTING_TEXT_SIZE];
} config_strings;

/** Read such text over `def` (other fields stay). GBT_ERR_FORMAT with file and line for anything else. */
gbt_status config_parse(const char *text, const char *path, gbt_train_def *def, config_strings *strings,
                        gbt_error *err);

#endif
