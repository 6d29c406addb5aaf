/* SPDX-License-Identifier: Apache-2.0 */
/* stability/case.c -- the cases of the study "stability", and how one runs: from its scene file to its rows.
 */
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "stability/stability.h"

typedef struct stability_case {
    const char *id, *file;
    gbt_status (*run)(stability *s);
} stability_case;

static const stability_case cases[] = {
#define X(tag, id, file) {id, file, stability_##tag},
    STABILITY_CASES(X)
#undef X
};
enum { CASE_COUNT = sizeof cases / sizeof *cases };

/* Whether a comma-separated list contains a name. *known counts the entries that are names of cases. */
static bool is_listed(const char *list, const char *name)
{
    const size_t length = strlen(name);
    for (const char *at = list; at != NULL && *at != '\0';
         at = strchr(at, ',') == NULL ? NULL : strchr(at, ',') + 1)
        if (strncmp(at, name, length) == 0 && (at[length] == ',' || at[length] == '\0'))
            return true;
    return false;
}

static gbt_status check_list(const char *only, gbt_error *err)
{
    size_t wanted = 1, found = 0;
    for (const char *at = only; at != NULL && (at = strchr(at, ',')) != NULL; at++)
        wanted++;
    for (size_t i = 0; i < CASE_COUNT && only != NULL; i++)
        found += is_listed(only, cases[i].id);
    if (only == NULL || found == wanted)
        return GBT_OK;
    return base_fail(
        err, GBT_ERR_ARGUMENT,
        "study stability: \"%.60s\" is not a list of different cases (wanted some of A1 to A13, as A1,A9)",
        only);
}

static gbt_status read_text(stability *s, const char *field, char *out, size_t size)
{
    const char *value = json_string_value(json_object_get(s->scene, field));
    if (value == NULL || strlen(value) >= size)
        stability_scene_fail(s, field, "wanted a text, not too long");
    else
        memcpy(out, value, strlen(value) + 1);
    return s->status;
}

static gbt_status open_scene(stability *s, const stability_case *c)
{
    json_error_t where;
    const char *file = stability_file(c->file);
    snprintf(s->path, sizeof s->path, "lab/stability/cases/%s.json", c->file);
    if (file == NULL)
        return base_fail(s->err, GBT_ERR_INTERNAL, "%s: not compiled into this program", s->path);
    s->scene = json_loads(file, JSON_REJECT_DUPLICATES, &where);
    if (s->scene == NULL)
        return base_fail(s->err, GBT_ERR_FORMAT, "%s:%d: not JSON: %s", s->path, where.line, where.text);
    return GBT_OK;
}

static gbt_status measure_case(const stability_case *c, stability *s)
{
    stability_part *part = &s->study->parts[s->study->part_count++];
    const size_t first = s->study->row_count;
    const double start = clock_wall();
    snprintf(part->id, sizeof part->id, "%s", c->id);
    s->scene = NULL;
    if (stability_ok(s, open_scene(s, c))) {
        read_text(s, "title", part->title, sizeof part->title);
        read_text(s, "elsewhere", part->elsewhere, sizeof part->elsewhere);
        read_text(s, "ours", part->ours, sizeof part->ours);
    }
    if (s->status == GBT_OK)
        stability_ok(s, c->run(s));
    if (s->status == GBT_OK &&
        s->study->row_count - first != json_array_size(json_object_get(s->scene, "checks")))
        stability_scene_fail(s, "checks", "a check was not measured, or measured twice");
    part->seconds = clock_wall() - start;
    json_decref(s->scene);
    return s->status;
}

gbt_status stability_measure(const char *only, bool quick, const char *folder, stability_study *study,
                             gbt_error *err)
{
    stability s = {.study = study, .folder = folder, .err = err};
    GBT_TRY(check_list(only, err));
    GBT_TRY(file_make_folder(folder, err));
    memset(study, 0, sizeof *study);
    study->quick = quick;
    for (size_t i = 0; i < CASE_COUNT && s.status == GBT_OK; i++)
        if (only == NULL || is_listed(only, cases[i].id)) {
            log_info("study stability: %s", cases[i].id);
            measure_case(&cases[i], &s);
        }
    return s.status;
}
