/* SPDX-License-Identifier: Apache-2.0 */
/* data/split.c -- which views are held out. */
#include "data/split.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "data/number.h"

gbt_status scene_split_parse(const char *text, scene_split *out, gbt_error *err)
{
    *out = (scene_split){.kind = SCENE_SPLIT_EVERY, .every = SCENE_SPLIT_DEFAULT_EVERY};
    uint64_t every;
    if (strcmp(text, "auto") == 0) {
        out->kind = SCENE_SPLIT_AUTO;
    } else if (strcmp(text, "none") == 0) {
        out->kind = SCENE_SPLIT_NONE;
    } else if (strncmp(text, "list=", 5) == 0 && text[5] != '\0') {
        out->kind = SCENE_SPLIT_LIST;
        out->list_path = text + 5;
    } else if (strncmp(text, "every=", 6) == 0 &&
               number_parse_u64(text + 6, strlen(text + 6), &every) == NUMBER_OK && every >= 2 &&
               every <= INT_MAX) {
        out->every = (int)every;
    } else {
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "eval_split: \"%.200s\" (wanted auto, every=N with N >= 2, none or list=FILE)",
                         text);
    }
    return GBT_OK;
}

static int name_against_view(const void *name, const void *view)
{
    return strcmp(name, ((const scene_view *)view)->name);
}

/* `bytes` are changed: every line becomes a string of its own. */
static gbt_status mark_listed(scene *s, char *bytes, size_t size, const char *path, gbt_error *err)
{
    size_t line = 0;
    for (char *at = bytes; at < bytes + size;) {
        char *end = memchr(at, '\n', (size_t)(bytes + size - at));
        end = end != NULL ? end : bytes + size;
        char *next = end + 1;
        line++;
        while (end > at && (end[-1] == '\r' || end[-1] == ' ' || end[-1] == '\t'))
            end--;
        *end = '\0'; /* file_read() leaves a spare byte behind the last line */
        if (*at != '\0') {
            scene_view *view = s->view_count > 0
                                   ? bsearch(at, s->views, s->view_count, sizeof *s->views, name_against_view)
                                   : NULL;
            if (view == NULL)
                return base_fail(err, GBT_ERR_FORMAT,
                                 "%s:%zu: no image of the data set has this name: %.200s", path, line, at);
            view->is_test = true;
        }
        at = next;
    }
    return GBT_OK;
}

/* A single photo is trained on: holding it out would leave nothing. */
static void mark_every(scene *s, int every)
{
    for (size_t i = 0; i < s->view_count && s->view_count > 1; i++)
        s->views[i].is_test = s->views[i].rank % (size_t)every == 0;
}

gbt_status split_apply(const scene_split *split, scene *s, gbt_error *err)
{
    for (size_t i = 0; i < s->view_count && split->kind != SCENE_SPLIT_AUTO; i++)
        s->views[i].is_test = false;
    switch (split->kind) {
    case SCENE_SPLIT_AUTO:
        if (!s->has_split)
            mark_every(s, SCENE_SPLIT_DEFAULT_EVERY);
        break;
    case SCENE_SPLIT_NONE:
        break;
    case SCENE_SPLIT_EVERY:
        if (split->every < 2)
            return base_fail(err, GBT_ERR_ARGUMENT, "split: wanted every >= 2, got %d", split->every);
        mark_every(s, split->every);
        break;
    case SCENE_SPLIT_LIST: {
        unsigned char *bytes;
        size_t size;
        GBT_TRY(file_read(split->list_path, &bytes, &size, err));
        const gbt_status status = mark_listed(s, (char *)bytes, size, split->list_path, err);
        mem_free(bytes);
        GBT_TRY(status);
        break;
    }
    }
    size_t test_count = 0;
    for (size_t i = 0; i < s->view_count; i++)
        test_count += s->views[i].is_test;
    if (test_count > 0 && test_count == s->view_count)
        return base_fail(err, GBT_ERR_ARGUMENT, "split: all %zu views are held out, none is left to train on",
                         test_count);
    return GBT_OK;
}
