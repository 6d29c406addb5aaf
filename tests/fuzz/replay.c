/* SPDX-License-Identifier: Apache-2.0 */
/* tests/fuzz/replay.c -- every target on its seeds and on what fuzzing found before, and on each of them cut
   short and with bytes changed: small ones at every byte. Usage: replay SEEDS: a folder with one folder for
   each target. */
#include <dirent.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "base/file.h"
#include "base/memory.h"
#include "fuzz/targets.h"

enum {
    SMALL_BYTES = 2200, /* of a seed that is changed at every byte, in every way */
    PLACES_MAX = 1000   /* of others: evenly chosen, each changed in one way */
};

static const struct {
    const char *name;
    fuzz_target *target;
} targets[] = {
    {"colmap_bin", fuzz_colmap_bin},
    {"colmap_txt", fuzz_colmap_txt},
    {"transforms", fuzz_transforms},
    {"ply_points", fuzz_ply_points},
    {"ply_gaussians", fuzz_ply_gaussians},
    {"splat", fuzz_splat},
    {"spz", fuzz_spz},
    {"sog", fuzz_sog},
    {"glb", fuzz_glb},
    {"usda", fuzz_usda},
    {"usdz", fuzz_usdz},
    {"safetensors", fuzz_safetensors},
    {"model", fuzz_model},
    {"mesh", fuzz_mesh},
    {"config", fuzz_config},
    {"camera", fuzz_camera},
    {"path", fuzz_path},
    {"photo", fuzz_photo},
    {"request", fuzz_request},
};

/* Cut at `at`; of what consists of parts, the part. */
static void cut(fuzz_target *target, const unsigned char *bytes, size_t size, size_t at)
{
    const unsigned char *next = memmem(bytes + at, size - at, "----", 4);
    const size_t rest = next != NULL ? size - (size_t)(next - bytes) : 0;
    fuzz_one(target, bytes, at);
    if (rest == 0)
        return;
    unsigned char *shorter = mem_alloc(at + rest, 1, "input", NULL);
    if (shorter == NULL)
        return;
    memcpy(shorter, bytes, at);
    memcpy(shorter + at, next, rest);
    fuzz_one(target, shorter, at + rest);
    mem_free(shorter);
}

/* Other bytes in one place. */
static void put(fuzz_target *target, unsigned char *bytes, size_t size, size_t at, const void *others,
                size_t count)
{
    unsigned char old[8];
    if (at + count > size)
        return;
    memcpy(old, bytes + at, count);
    memcpy(bytes + at, others, count);
    fuzz_one(target, bytes, size);
    memcpy(bytes + at, old, count);
}

static void vary(fuzz_target *target, unsigned char *bytes, size_t size)
{
    static const unsigned char flips[] = {0xff, 0x80, 0x01};
    static const uint64_t extremes[] = {0,
                                        1,
                                        UINT64_MAX,
                                        INT32_MAX,
                                        (uint64_t)INT32_MAX + 1,
                                        UINT64_C(1) << 63,
                                        UINT64_C(1) << 61,
                                        UINT64_C(0x7FF8000000000000),
                                        UINT64_C(0x7FF0000000000000),
                                        UINT64_C(0x7FC00000),
                                        UINT64_C(0x7F800000)};
    const bool small = size <= SMALL_BYTES;
    const size_t step = small ? 1 : size / PLACES_MAX + 1;
    fuzz_one(target, bytes, size);
    for (size_t at = 0; at < size; at += step) {
        cut(target, bytes, size, at);
        for (size_t k = 0; k < sizeof flips; k++)
            if (small || at / step % sizeof flips == k)
                put(target, bytes, size, at, &(unsigned char){(unsigned char)(bytes[at] ^ flips[k])}, 1);
        for (size_t k = 0; small && k < sizeof extremes / sizeof *extremes; k++) {
            put(target, bytes, size, at, &extremes[k], 4);
            put(target, bytes, size, at, &extremes[k], 8);
        }
    }
}

int main(int count, char **arguments)
{
    size_t inputs = 0, empty = 0;
    if (count != 2)
        return 2;
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
        char folder[4096], path[4096];
        size_t own = 0;
        fuzz_accepted = 0;
        snprintf(folder, sizeof folder, "%s/%s", arguments[1], targets[i].name);
        DIR *entries = opendir(folder);
        for (const struct dirent *entry; entries != NULL && (entry = readdir(entries)) != NULL;) {
            unsigned char *bytes;
            size_t size;
            if (entry->d_name[0] == '.' ||
                file_join(path, sizeof path, folder, entry->d_name, NULL) != GBT_OK ||
                file_read(path, &bytes, &size, NULL) != GBT_OK)
                continue;
            vary(targets[i].target, bytes, size);
            mem_free(bytes);
            own++;
        }
        if (entries != NULL)
            closedir(entries);
        printf("%-14s %zu seeds, %zu inputs taken\n", targets[i].name, own, fuzz_accepted);
        empty += fuzz_accepted == 0;
        inputs += own;
    }
    printf("%zu seeds, %zu targets that took nothing\n", inputs, empty);
    return empty > 0;
}
