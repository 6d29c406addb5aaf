/* SPDX-License-Identifier: Apache-2.0 */
/* train/config.c -- the settings of a run to text and back. */
#include "train/config.h"

#include <stdio.h>
#include <string.h>

#include "base/fail.h"

static gbt_status check_value(const char *field, const char *value, gbt_error *err)
{
    if (strchr(value, '\n') != NULL)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "%s: has a line break (wanted one line, as the files of a run keep it)", field);
    if (strlen(value) >= SETTING_TEXT_SIZE)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: \"%.60s...\": %zu bytes (wanted at most %d)", field,
                         value, strlen(value), SETTING_TEXT_SIZE - 1);
    return GBT_OK;
}

gbt_status config_check(const gbt_train_def *def, const char *data, gbt_error *err)
{
    GBT_TRY(check_value("data", data, err));
    for (size_t i = 0; i < gbt_train_setting_count(); i++) {
        const gbt_train_setting *s = gbt_train_setting_at(i);
        const char *text =
            s->kind == GBT_SETTING_TEXT ? *(const char *const *)((const char *)def + s->offset) : NULL;
        if (text != NULL)
            GBT_TRY(check_value(s->field, text, err));
    }
    return GBT_OK;
}

void config_text(const gbt_train_def *d, const char *data, char *out, size_t size)
{
    const gbt_train_def usual = gbt_train_def_default();
    size_t used = (size_t)snprintf(out, size, "data = %s\n", data);
    for (size_t i = 0; i < gbt_train_setting_count(); i++) {
        const gbt_train_setting *s = gbt_train_setting_at(i);
        char value[SETTING_TEXT_SIZE], by_default[SETTING_TEXT_SIZE];
        if (!s->saved || used >= size)
            continue;
        setting_text(s, d, value, sizeof value);
        setting_text(s, &usual, by_default, sizeof by_default);
        if (s->if_changed && strcmp(value, by_default) == 0)
            continue;
        used += (size_t)snprintf(out + used, size - used, "%s = %s\n", s->name, value);
    }
}

static bool set_key(const char *key, const char *value, gbt_train_def *d, config_strings *strings)
{
    if (strcmp(key, "data") == 0)
        return snprintf(strings->data, sizeof strings->data, "%s", value) < (int)sizeof strings->data;
    if (strcmp(key, "start-level") == 0) /* an obsolete key in older files; a trained model does not depend on
                                            it */
        return true;
    const gbt_train_setting *s = setting_find(key);
    return s != NULL && setting_read(s, value, &strings->texts, d);
}

gbt_status config_parse(const char *text, const char *path, gbt_train_def *def, config_strings *strings,
                        gbt_error *err)
{
    int line_number = 1;
    for (const char *line = text; *line != '\0'; line_number++) {
        const char *end = strchr(line, '\n');
        if (end == NULL)
            end = line + strlen(line);
        char copy[CONFIG_TEXT_SIZE];
        snprintf(copy, sizeof copy, "%.*s", (int)(end - line), line);
        char *equals = strstr(copy, " =");
        if (equals == NULL)
            return base_fail(err, GBT_ERR_FORMAT, "%s:%d: \"%.60s\" (wanted key = value)", path, line_number,
                             copy);
        *equals = '\0';
        const char *value = equals + 2 + (equals[2] == ' ');
        if (!set_key(copy, value, def, strings))
            return base_fail(err, GBT_ERR_FORMAT, "%s:%d: unknown setting or bad value: %.60s = %.60s", path,
                             line_number, copy, value);
        line = *end == '\0' ? end : end + 1;
    }
    return GBT_OK;
}
