/* SPDX-License-Identifier: Apache-2.0 */
/* pose/missing.c -- explains why photos were left out: features, matches and sharpness. */
#include "pose/missing.h"

#include <stdint.h>
#include <stdlib.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "data/bytes.h"
#include "pose/database.h"
#include "pose/frames.h"

enum {
    SHOWN = 10,
    SAMPLE = 15, /* registered photos from which the usual sharpness is taken */
    FEW_FEATURES = 200
};

static const double blurred = 0.3; /* of the usual sharpness; twice the blur leaves 1/4 or less */

typedef struct facts {
    int64_t features, matches;  /* number of matches, over all pairs, that are consistent with one geometry */
    int64_t registered_matches; /* those of pairs with a registered photo */
    size_t partners, registered_partners;
} facts;

typedef struct table {
    const bool *registered;
    facts *rows;
    size_t *place; /* [ids] index of a photo by COLMAP's id, plus one; 0: none */
    uint32_t ids;
} table;

static void add_pair(uint32_t a, uint32_t b, int64_t matches, void *context)
{
    table *t = context;
    if (a >= t->ids || b >= t->ids || t->place[a] == 0 || t->place[b] == 0)
        return;
    const size_t ends[2] = {t->place[a] - 1, t->place[b] - 1};
    for (int i = 0; i < 2; i++) {
        facts *f = &t->rows[ends[i]];
        const bool other = t->registered[ends[1 - i]];
        f->partners++;
        f->matches += matches;
        f->registered_partners += other;
        f->registered_matches += other ? matches : 0;
    }
}

static gbt_status read_facts(const job *j, table *t, gbt_error *err)
{
    database *d;
    database_photo found;
    GBT_TRY(database_open(j->database, &d, err));
    uint32_t *ids = mem_calloc(j->photo_count, sizeof *ids, "photos", err);
    gbt_status status = ids != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < j->photo_count && status == GBT_OK; i++) {
        status = database_find(d, j->photos[i].name, &found, err);
        if (found.id == 0 || found.id >= UINT32_C(1) << 24)
            continue;
        ids[i] = found.id;
        t->rows[i].features = found.features;
        t->ids = found.id >= t->ids ? found.id + 1 : t->ids;
    }
    if (status == GBT_OK && (t->place = mem_calloc(t->ids, sizeof *t->place, "photos", err)) == NULL)
        status = GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < j->photo_count && status == GBT_OK; i++)
        if (ids[i] > 0)
            t->place[ids[i]] = i + 1;
    if (status == GBT_OK)
        status = database_pairs(d, add_pair, t, err);
    mem_free(ids);
    database_close(d);
    return status;
}

/* ---- sharpness ---- */

static double sharpness_of(const job *j, size_t photo)
{
    char path[JOB_PATH_SIZE];
    double sharpness = 0;
    if (file_join(path, sizeof path, j->images, j->photos[photo].name, NULL) != GBT_OK ||
        frames_photo_sharpness(path, &sharpness, NULL) != GBT_OK)
        return -1;
    return sharpness;
}

/* The median sharpness of some registered photos. */
static double usual_sharpness(const job *j, const bool *registered, size_t count)
{
    double values[SAMPLE];
    size_t used = 0, seen = 0;
    for (size_t i = 0; i < j->photo_count; i++) {
        if (!registered[i])
            continue;
        if (seen++ * SAMPLE / count >= used && used < SAMPLE)
            values[used++] = sharpness_of(j, i);
    }
    qsort(values, used, sizeof *values, compare_doubles);
    return used > 0 ? values[used / 2] : 0;
}

/* ---- output ---- */

static void why(const job *j, size_t photo, const facts *f, double usual, char *out, size_t size)
{
    const double sharpness = sharpness_of(j, photo);
    if (sharpness >= 0 && sharpness < blurred * usual)
        snprintf(out, size, "blurred (sharpness %.0f, of registered photos %.0f; %lld features)", sharpness,
                 usual, (long long)f->features);
    else if (f->features < FEW_FEATURES)
        snprintf(out, size, "only %lld features: dark, or without texture", (long long)f->features);
    else if (f->partners == 0)
        snprintf(out, size, "matches no other photo (%lld features)", (long long)f->features);
    else if (f->registered_partners == 0)
        snprintf(out, size, "matches %zu photos, none of them registered: another part of the scene",
                 f->partners);
    else
        snprintf(out, size, "few matches: %lld with %zu registered photos", (long long)f->registered_matches,
                 f->registered_partners);
}

static gbt_status write_lines(const job *j, const table *t, size_t registered, FILE *report, gbt_error *err)
{
    char path[JOB_PATH_SIZE], reason[200];
    const double usual = usual_sharpness(j, t->registered, registered);
    size_t shown = 0;
    sink all = {.err = err};
    for (size_t i = 0; i < j->photo_count; i++) {
        if (t->registered[i])
            continue;
        why(j, i, &t->rows[i], usual, reason, sizeof reason);
        sink_put_text(&all, j->photos[i].name);
        sink_put_text(&all, ": ");
        sink_put_text(&all, reason);
        sink_put_text(&all, "\n");
        if (report != NULL && shown++ < SHOWN)
            fprintf(report, "  without   %s: %s\n", j->photos[i].name, reason);
    }
    gbt_status status = all.status;
    if (status == GBT_OK)
        status = job_path(j, "not_registered.txt", path, err);
    if (status == GBT_OK)
        status = file_write_atomic(path, all.bytes != NULL ? all.bytes : (const void *)"", all.size, err);
    if (status == GBT_OK && shown > SHOWN)
        fprintf(report, "  without   %zu more: %s\n", shown - SHOWN, path);
    sink_free(&all);
    return status;
}

gbt_status missing_report(const job *j, const bool *registered, FILE *report, gbt_error *err)
{
    size_t count = 0;
    for (size_t i = 0; i < j->photo_count; i++)
        count += registered[i];
    if (count == j->photo_count)
        return GBT_OK;
    table t = {.registered = registered, .rows = mem_calloc(j->photo_count, sizeof *t.rows, "photos", err)};
    gbt_status status = t.rows != NULL ? read_facts(j, &t, err) : GBT_ERR_NO_MEMORY;
    if (status == GBT_OK)
        status = write_lines(j, &t, count, report, err);
    mem_free(t.place);
    mem_free(t.rows);
    return status;
}
