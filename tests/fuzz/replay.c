/* SPDX-License-Identifier: Apache-2.0 */
/* tests/fuzz/replay.c -- every target on its seeds and on what fuzzing found before, and on each of them cut
   short and with bytes changed. Usage: replay SEEDS: a folder with one folder for each target. */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/memory.h"
#include "fuzz/targets.h"

enum { CHANGES_MAX = 100 }; /* of one seed: places evenly chosen */

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

static void vary(fuzz_target *target, unsigned char *bytes, size_t size)
{
    static const unsigned char changes[] = {0x00, 0xff, 0x80, 0x7f};
    const size_t step = size / CHANGES_MAX + 1;
    fuzz_one(target, bytes, size);
    for (size_t at = 0; at < size; at += step) {
        const unsigned char old = bytes[at];
        fuzz_one(target, bytes, at);
        bytes[at] = changes[at / step % sizeof changes];
        fuzz_one(target, bytes, size);
        bytes[at] = old;
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
        printf("%-14s %zu seeds\n", targets[i].name, own);
        empty += own == 0;
        inputs += own;
    }
    printf("%zu seeds, %zu targets without one\n", inputs, empty);
    return empty > 0;
}
