/* SPDX-License-Identifier: Apache-2.0 */
/* study/output.c -- write the files of a study. */
#include "study/output.h"

#include "base/fail.h"
#include "base/file.h"
#include "data/json_out.h"

static gbt_status save_data(const study_output *o, const void *study, const char *folder, const char *name,
                            gbt_error *err)
{
    char path[4096];
    GBT_TRY(file_join(path, sizeof path, folder, name, err));
    json_t *root = json_pack("{s:i,s:s}", "schema", 1, "study", o->name);
    json_t *data = o->data(study);
    json_object_update(root, data);
    json_decref(data);
    const gbt_status status = json_save(root, path, err);
    json_decref(root);
    return status;
}

gbt_status study_output_save(const study_output *o, const void *study, const char *folder, FILE *out,
                             gbt_error *err)
{
    const struct {
        const char *ending;
        void (*add)(const void *study, text *out);
    } texts[] = {{"svg", o->charts}, {"md", o->tables}};
    char name[64];
    snprintf(name, sizeof name, "%s.json", o->name);
    GBT_TRY(save_data(o, study, folder, name, err));
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        if (texts[i].add == NULL)
            continue;
        text body = {.err = err};
        texts[i].add(study, &body);
        if (texts[i].add == o->tables && out != NULL && body.status == GBT_OK)
            fwrite(body.bytes, 1, body.length, out);
        snprintf(name, sizeof name, "%s.%s", o->name, texts[i].ending);
        GBT_TRY(text_save(&body, folder, name));
    }
    return GBT_OK;
}
