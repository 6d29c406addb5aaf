/* SPDX-License-Identifier: Apache-2.0 */
/* tests/fuzz/targets.c -- one reader each: bytes in, and nothing may go wrong. Which one is FUZZ_TARGET, a
   function here.

   With clang and -fsanitize=fuzzer each becomes a program of libFuzzer (./run fuzz); else replay.c runs all
   on the seeds. A reader may refuse what it gets: then with one line, and all memory given back. */
#include "fuzz/targets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/image.h"
#include "base/image_header.h"
#include "base/memory.h"
#include "data/colmap_bin.h"
#include "data/colmap_txt.h"
#include "data/gaussian_formats.h"
#include "data/gaussian_ply.h"
#include "data/mesh_file.h"
#include "data/ply.h"
#include "data/transforms.h"
#include "io/model_file.h"
#include "io/safetensors.h"
#include "quiet.h"
#include "render/camera_file.h"
#include "render/camera_path_file.h"
#include "train/config.h"
#include "view/request.h"

static const double world[3] = {0, 0, 0};

/* A failure says why, and nothing else does. */
static void check(gbt_status status, const gbt_error *err)
{
    if ((status == GBT_OK) != (err->text[0] == '\0'))
        abort();
}

/* Three files in one input: each but the last ends at the bytes ----. */
static void take_three(const source_file *file, source_file out[3])
{
    static const char mark[4] = {'-', '-', '-', '-'};
    size_t at = 0;
    for (int i = 0; i < 3; i++) {
        const unsigned char *end =
            i < 2 ? memmem(file->bytes + at, file->size - at, mark, sizeof mark) : NULL;
        const size_t size = end != NULL ? (size_t)(end - file->bytes) - at : file->size - at;
        out[i] = (source_file){.name = file->name, .bytes = file->bytes + at, .size = size};
        at += size + (end != NULL ? sizeof mark : 0);
    }
}

static void colmap(const source_file *file,
                   gbt_status (*read)(const colmap_files *, raw_scene *, gbt_error *))
{
    source_file parts[3];
    raw_scene raw = {0};
    gbt_error err = {0};
    take_three(file, parts);
    check(read(&(colmap_files){.cameras = parts[0], .images = parts[1], .points = parts[2]}, &raw, &err),
          &err);
    raw_free(&raw);
}

void fuzz_colmap_bin(const source_file *file) { colmap(file, colmap_bin_read); }

void fuzz_colmap_txt(const source_file *file) { colmap(file, colmap_txt_read); }

void fuzz_transforms(const source_file *file)
{
    raw_scene raw = {0};
    char *points = NULL;
    gbt_error err = {0};
    check(transforms_read(file, "/nowhere", false, &raw, &points, &err), &err);
    mem_free(points);
    raw_free(&raw);
}

void fuzz_ply_points(const source_file *file)
{
    raw_scene raw = {0};
    gbt_error err = {0};
    check(ply_read_points(file, &raw, &err), &err);
    raw_free(&raw);
}

static void gaussians_of(const source_file *file,
                         gbt_status (*read)(const source_file *, gaussian_cloud *, gbt_error *))
{
    gaussian_cloud cloud;
    gbt_error err = {0};
    const gbt_status status = read(file, &cloud, &err);
    check(status, &err);
    if (status == GBT_OK)
        gaussian_cloud_free(&cloud);
}

void fuzz_ply_gaussians(const source_file *file) { gaussians_of(file, gaussian_ply_read); }

void fuzz_splat(const source_file *file) { gaussians_of(file, gaussian_format_splat.read); }

void fuzz_spz(const source_file *file) { gaussians_of(file, gaussian_format_spz.read); }

void fuzz_sog(const source_file *file) { gaussians_of(file, gaussian_format_sog.read); }

void fuzz_glb(const source_file *file) { gaussians_of(file, gaussian_format_glb.read); }

void fuzz_usda(const source_file *file) { gaussians_of(file, gaussian_format_usda.read); }

void fuzz_usdz(const source_file *file) { gaussians_of(file, gaussian_format_usdz.read); }

void fuzz_safetensors(const source_file *file)
{
    tensor out;
    gbt_error err = {0};
    check(safetensors_read(file, "lin0.model.1.weight", &out, &err), &err);
    mem_free(out.values);
}

/* The container with its coder and the checkpoint's fields. */
void fuzz_model(const source_file *file)
{
    container c;
    model m;
    gbt_error err = {0};
    gbt_status status = container_parse(file->bytes, file->size, file->name, &c, &err);
    check(status, &err);
    if (status != GBT_OK)
        return;
    status = model_from_container(&c, &m, &err);
    check(status, &err);
    if (status == GBT_OK)
        model_free(&m);
    container_free(&c);
}

void fuzz_mesh(const source_file *file)
{
    mesh_data mesh = {0};
    gbt_error err = {0};
    check(mesh_file_parse(file, &mesh, &err), &err);
    mesh_data_free(&mesh);
}

void fuzz_config(const source_file *file)
{
    static config_strings strings;
    gbt_train_def def = gbt_train_def_default();
    gbt_error err = {0};
    check(config_parse((const char *)file->bytes, file->name, &def, &strings, &err), &err);
}

void fuzz_camera(const source_file *file)
{
    ray_shot shot;
    gbt_error err = {0};
    check(camera_text_read((const char *)file->bytes, file->name, world, &shot, &err), &err);
}

/* For those that take the name of a file: a file of our own with these bytes. */
static const char *as_file(const source_file *file)
{
    static char path[64];
    if (path[0] == '\0')
        snprintf(path, sizeof path, "/tmp/gbt_fuzz_%ld", (long)getpid());
    FILE *out = fopen(path, "wb"); /* never to the disk: file_write_atomic() would wait for it each time */
    if (out == NULL || fwrite(file->bytes, 1, file->size, out) != file->size || fclose(out) != 0)
        abort();
    return path;
}

void fuzz_path(const source_file *file)
{
    const char *path = as_file(file);
    camera_path out;
    gbt_error err = {0};
    check(camera_path_file_read(path, world, 0, &out, &err), &err);
    camera_path_free(&out);
    unlink(path);
}

void fuzz_photo(const source_file *file)
{
    const char *path = as_file(file);
    image_header h;
    image out;
    gbt_error err = {0}, second = {0};
    const gbt_status header = image_header_read(path, &h, &err),
                     status = header == GBT_OK && (int64_t)h.width * h.height > 1 << 20
                                  ? GBT_ERR_NO_MEMORY /* fine, but slow */
                                  : image_read(path, &out, &second);
    check(header, &err);
    if (status == GBT_OK) {
        if (header != GBT_OK || out.width != h.width || out.height != h.height)
            abort();
        image_free(&out);
    }
    unlink(path);
}

/* ---- a request: its path, then words NAME=VALUE, each on a line ---- */

static const char *word_of(void *query, const char *name)
{
    static char value[1 << 12];
    const size_t length = strlen(name);
    for (const char *line = query; line != NULL; line = strchr(line, '\n')) {
        line += *line == '\n';
        if (strncmp(line, name, length) != 0 || line[length] != '=')
            continue;
        snprintf(value, sizeof value, "%.*s", (int)strcspn(line + length + 1, "\n"), line + length + 1);
        char *copy = value;
        return copy;
    }
    return NULL;
}

void fuzz_request(const source_file *file)
{
    char text[1 << 12];
    request out;
    gbt_error err = {0};
    snprintf(text, sizeof text, "%s", (const char *)file->bytes);
    char *words = text + strcspn(text, "\n");
    if (*words != '\0')
        *words++ = '\0';
    check(request_parse(text, word_of, words, &out, &err), &err);
}

void fuzz_one(fuzz_target *target, const unsigned char *bytes, size_t size)
{
    unsigned char *copy = mem_alloc(size + 1, 1, "input", NULL);
    if (copy == NULL)
        return;
    if (size > 0)
        memcpy(copy, bytes, size);
    copy[size] = '\0'; /* as file_read() leaves it */
    const source_file file = {.name = "input", .bytes = copy, .size = size};
    be_quiet();
    target(&file);
    mem_free(copy);
}

#ifdef FUZZ_TARGET
int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size)
{
    fuzz_one(FUZZ_TARGET, bytes, size);
    return 0;
}
#endif
