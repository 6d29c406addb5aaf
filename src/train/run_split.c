/* SPDX-License-Identifier: Apache-2.0 */
/* train/run_split.c -- RUN/held-out.txt: the names of the photos that a run holds out. */
#include "train/run_split.h"

#include <stdio.h>

#include "base/fail.h"
#include "base/file.h"

gbt_status run_split_text(const char *run, const char *text, char out[RUN_SPLIT_TEXT_SIZE], gbt_error *err)
{
    scene_split split;
    char own[4096];
    GBT_TRY(scene_split_parse(text, &split, err));
    GBT_TRY(file_join(own, sizeof own, run, RUN_SPLIT_NAME, err));
    const bool has_own = split.kind == SCENE_SPLIT_LIST && file_exists(own);
    const int length =
        has_own ? snprintf(out, RUN_SPLIT_TEXT_SIZE, "%.*s%s", (int)(split.list_path - text), text, own)
                : snprintf(out, RUN_SPLIT_TEXT_SIZE, "%s", text);
    return length < RUN_SPLIT_TEXT_SIZE
               ? GBT_OK
               : base_fail(err, GBT_ERR_ARGUMENT, "eval_split: \"%.200s...\" is too long", text);
}

gbt_status run_split_save(const char *run, const scene *s, gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, run, RUN_SPLIT_NAME, err));
    return s->held_out_list != NULL ? file_write_atomic(path, s->held_out_list, s->held_out_bytes, err)
                                    : GBT_OK;
}
