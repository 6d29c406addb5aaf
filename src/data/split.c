/* SPDX-License-Identifier: Apache-2.0 */
/* data/split.c -- decides which views are held out. */
#include "data/split.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "data/number.h"

/* Parse "N" or "N:K" of `length` bytes; N >= 2, K < N. */
static bool parse_fold(const char *text, size_t length, int *every, int *offset)
{
    const char *colon = memchr(text, ':', length);
    const size_t first = colon != NULL ? (size_t)(colon - text) : length;
    uint64_t n, k = 0;
    if (number_parse_u64(text, first, &n) != NUMBER_OK || n < 2 || n > INT_MAX)
        return false;
    if (colon != NULL && (number_parse_u64(colon + 1, length - first - 1, &k) != NUMBER_OK || k >= n))
        return false;
    *every = (int)n;
    *offset = (int)k;
    return true;
}

/* Parse the part of a split other than validation. */
static bool parse_kind(const char *text, scene_split *out)
{
    if (strcmp(text, "auto") == 0)
        out->kind = SCENE_SPLIT_AUTO;
    else if (strcmp(text, "none") == 0)
        out->kind = SCENE_SPLIT_NONE;
    else if (strncmp(text, "list=", 5) == 0 && text[5] != '\0') {
        out->kind = SCENE_SPLIT_LIST;
        out->list_path = text + 5;
    } else
        return strncmp(text, "every=", 6) == 0 &&
               parse_fold(text + 6, strlen(text + 6), &out->every, &out->offset);
    return true;
}

gbt_status scene_split_parse(const char *text, scene_split *out, gbt_error *err)
{
    static const char validate[] = "validate=";
    *out = (scene_split){.kind = SCENE_SPLIT_EVERY, .every = SCENE_SPLIT_DEFAULT_EVERY};
    const char *kind = text;
    bool fine = true;
    if (strncmp(text, validate, strlen(validate)) == 0) {
        const char *fold = text + strlen(validate);
        const size_t length = strcspn(fold, ",");
        fine = parse_fold(fold, length, &out->validate_every, &out->validate_offset);
        kind = fold[length] == ',' ? fold + length + 1 : "auto";
    }
    if (fine && parse_kind(kind, out))
        return GBT_OK;
    return base_fail(
        err, GBT_ERR_ARGUMENT,
        "eval_split: \"%.200s\" (wanted auto, every=N or every=N:K with N >= 2 and K < N, none or "
        "list=FILE; before it, or alone, validate=N or validate=N:K)",
        text);
}

static int name_against_view(const void *name, const void *view)
{
    return strcmp(name, ((const scene_view *)view)->name);
}

/* Whether `name` is a view that was left out because its photo is missing. */
static bool is_missing(const scene *s, const char *name)
{
    const size_t length = strlen(name);
    for (size_t at = 0, end; at < s->missing_bytes; at = end + 1) {
        const char *line = s->missing_lines + at;
        end = at + (size_t)((const char *)memchr(line, '\n', s->missing_bytes - at) - line);
        if (end - at == length && memcmp(line, name, length) == 0)
            return true;
    }
    return false;
}

/* Mark the views named in the list. `bytes` is modified: every line becomes a string of its own. */
static gbt_status mark_listed(scene *s, char *bytes, size_t size, const char *path, gbt_error *err)
{
    size_t line = 0;
    for (char *at = bytes + file_mark_bytes(bytes, size); at < bytes + size;) {
        char *end = memchr(at, '\n', (size_t)(bytes + size - at));
        end = end != NULL ? end : bytes + size;
        char *next = end + 1;
        line++;
        while (end > at && (end[-1] == '\r' || end[-1] == ' ' || end[-1] == '\t'))
            end--;
        *end = '\0'; /* file_read() allocates one spare byte after the last line */
        if (*at != '\0') {
            scene_view *view = s->view_count > 0
                                   ? bsearch(at, s->views, s->view_count, sizeof *s->views, name_against_view)
                                   : NULL;
            if (view == NULL && !is_missing(s, at))
                return base_fail(err, GBT_ERR_FORMAT,
                                 "%s:%zu: no image of the data set has this name: %.200s", path, line, at);
            if (view != NULL)
                view->is_test = true;
            s->listed_missing += view == NULL;
        }
        at = next;
    }
    return GBT_OK;
}

static gbt_status apply_list(const char *path, scene *s, gbt_error *err)
{
    unsigned char *bytes;
    GBT_TRY(file_read(path, &bytes, &s->held_out_bytes, err));
    s->held_out_list = (char *)bytes;
    char *lines = mem_alloc(s->held_out_bytes + 1, 1, "list of held-out photos", err);
    if (lines == NULL)
        return GBT_ERR_NO_MEMORY;
    memcpy(lines, bytes, s->held_out_bytes + 1);
    const gbt_status status = mark_listed(s, lines, s->held_out_bytes, path, err);
    mem_free(lines);
    return status;
}

/* A single photo is never held out, because nothing would be left to train on. */
static void mark_every(scene *s, int every, int offset)
{
    for (size_t i = 0; i < s->view_count && s->view_count > 1; i++)
        s->views[i].is_test = s->views[i].rank % (size_t)every == (size_t)offset;
}

/* Remove the held-out views, and hold out some of the others instead: settings chosen by these scores are
   then independent of the removed views. */
static void validate(const scene_split *split, scene *s)
{
    size_t kept = 0;
    for (size_t i = 0; i < s->view_count; i++) {
        if (s->views[i].is_test) {
            scene_view_free(&s->views[i]);
            continue;
        }
        s->views[kept] = s->views[i];
        s->views[kept].is_test = kept % (size_t)split->validate_every == (size_t)split->validate_offset;
        kept++;
    }
    s->view_count = kept;
}

gbt_status split_apply(const scene_split *split, scene *s, gbt_error *err)
{
    for (size_t i = 0; i < s->view_count && split->kind != SCENE_SPLIT_AUTO; i++)
        s->views[i].is_test = false;
    switch (split->kind) {
    case SCENE_SPLIT_AUTO:
        if (!s->has_split)
            mark_every(s, SCENE_SPLIT_DEFAULT_EVERY, 0);
        break;
    case SCENE_SPLIT_NONE:
        break;
    case SCENE_SPLIT_EVERY:
        if (split->every < 2)
            return base_fail(err, GBT_ERR_ARGUMENT, "split: wanted every >= 2, got %d", split->every);
        mark_every(s, split->every, split->offset);
        break;
    case SCENE_SPLIT_LIST:
        GBT_TRY(apply_list(split->list_path, s, err));
        break;
    }
    const size_t all = s->view_count;
    if (split->validate_every > 0)
        validate(split, s);
    size_t test_count = 0;
    for (size_t i = 0; i < s->view_count; i++)
        test_count += s->views[i].is_test;
    if (split->validate_every > 0 && test_count == 0)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "split: validation holds out none of %zu training photos (%zu photos; wanted more than "
            "%d)",
            s->view_count, all, split->validate_offset);
    if (test_count > 0 && test_count == s->view_count)
        return base_fail(err, GBT_ERR_ARGUMENT, "split: all %zu views are held out, none is left to train on",
                         test_count);
    return GBT_OK;
}
