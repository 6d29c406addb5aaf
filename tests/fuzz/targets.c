/* SPDX-License-Identifier: Apache-2.0 */
/* tests/fuzz/targets.c -- one reader each: bytes in, and nothing may go wrong. Which one is FUZZ_TARGET, a
   function here.

   With clang and -fsanitize=fuzzer each becomes a program of libFuzzer (./run fuzz); else replay.c runs all
   on the seeds. A reader may refuse what it gets: then with one line, and all memory given back. */
#include "fuzz/targets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>
#include <zlib.h>

#include "base/image.h"
#include "base/image_header.h"
#include "base/memory.h"
#include "data/colmap_bin.h"
#include "data/colmap_txt.h"
#include "data/gaussian_formats.h"
#include "data/gaussian_ply.h"
#include "data/mesh_file.h"
#include "data/ply.h"
#include "data/sound.h"
#include "data/transforms.h"
#include "gbtrace/progress.h"
#include "io/model_file.h"
#include "io/safetensors.h"
#include "render/camera_file.h"
#include "render/camera_path_file.h"
#include "train/config.h"
#include "view/request.h"

static const double world[3] = {0, 0, 0};

size_t fuzz_accepted;

static void require(bool holds)
{
    if (!holds)
        abort();
}

/* A failure says why, in one line, and nothing else does. */
static void check(gbt_status status, const gbt_error *err)
{
    require((status == GBT_OK) == (err->text[0] == '\0') && err->status == status &&
            strchr(err->text, '\n') == NULL);
    fuzz_accepted += status == GBT_OK;
}

/* Of exactly its size, for tools that watch memory. */
static unsigned char *copy_of(const unsigned char *bytes, size_t size)
{
    unsigned char *copy = malloc(size > 0 ? size : 1);
    require(copy != NULL);
    if (size > 0)
        memcpy(copy, bytes, size);
    return copy;
}

/* With a zero behind it, as file_read() leaves it. */
static char *text_of(const source_file *file)
{
    char *text = calloc(file->size + 1, 1);
    require(text != NULL);
    if (file->size > 0)
        memcpy(text, file->bytes, file->size);
    return text;
}

static void check_raw(gbt_status status, const raw_scene *raw, const gbt_error *err)
{
    check(status, err);
    require(status != GBT_OK || raw_is_sound(raw));
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
        out[i] = (source_file){.name = file->name, .bytes = copy_of(file->bytes + at, size), .size = size};
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
    const gbt_status status =
        read(&(colmap_files){.cameras = parts[0], .images = parts[1], .points = parts[2]}, &raw, &err);
    check_raw(status, &raw, &err);
    require(status == GBT_OK || status == GBT_ERR_FORMAT);
    raw_free(&raw);
    for (int i = 0; i < 3; i++)
        free((void *)(uintptr_t)parts[i].bytes);
}

void fuzz_colmap_bin(const source_file *file) { colmap(file, colmap_bin_read); }

void fuzz_colmap_txt(const source_file *file) { colmap(file, colmap_txt_read); }

void fuzz_transforms(const source_file *file)
{
    raw_scene raw = {0};
    char *points = NULL;
    gbt_error err = {0};
    check_raw(transforms_read(file, FUZZ_PHOTOS, false, &raw, &points, &err), &raw, &err);
    mem_free(points);
    raw_free(&raw);
}

void fuzz_ply_points(const source_file *file)
{
    raw_scene raw = {0};
    gbt_error err = {0};
    const gbt_status status = ply_read_points(file, &raw, &err);
    check_raw(status, &raw, &err);
    require(status == GBT_OK || status == GBT_ERR_FORMAT);
    raw_free(&raw);
}

static void gaussians_of(const source_file *file,
                         gbt_status (*read)(const source_file *, gaussian_cloud *, gbt_error *))
{
    gaussian_cloud cloud;
    gbt_error err = {0};
    const gbt_status status = read(file, &cloud, &err);
    check(status, &err);
    require(status != GBT_OK || cloud_is_sound(&cloud));
    gaussian_cloud_free(&cloud);
}

void fuzz_ply_gaussians(const source_file *file) { gaussians_of(file, gaussian_ply_read); }

void fuzz_splat(const source_file *file) { gaussians_of(file, gaussian_format_splat.read); }

/* As it is, and as what was zipped: else its checksum would hide what is behind it. */
void fuzz_spz(const source_file *file)
{
    gaussians_of(file, gaussian_format_spz.read);
    z_stream z = {.next_in = (void *)(uintptr_t)file->bytes, .avail_in = (uInt)file->size};
    require(deflateInit2(&z, 1, Z_DEFLATED, 16 + 9, 1, Z_DEFAULT_STRATEGY) == Z_OK);
    const uLong room = deflateBound(&z, z.avail_in);
    unsigned char *zipped = malloc(room);
    require(zipped != NULL);
    z.next_out = zipped;
    z.avail_out = (uInt)room;
    require(deflate(&z, Z_FINISH) == Z_STREAM_END);
    gaussians_of(&(source_file){.name = file->name, .bytes = zipped, .size = z.total_out},
                 gaussian_format_spz.read);
    deflateEnd(&z);
    free(zipped);
}

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
    const gbt_status status = mesh_file_parse(file, &mesh, &err);
    check(status, &err);
    require(status == GBT_OK || status == GBT_ERR_FORMAT);
    for (size_t i = 0; status == GBT_OK && i < 3 * mesh.triangle_count; i++)
        require(mesh.triangles[i] < mesh.vertex_count &&
                fabs(mesh.position[3 * mesh.triangles[i]]) <= RAW_COORDINATE_LIMIT);
    mesh_data_free(&mesh);
}

void fuzz_config(const source_file *file)
{
    static config_strings strings;
    gbt_train_def def = gbt_train_def_default();
    gbt_error err = {0};
    char *text = text_of(file);
    check(config_parse(text, file->name, &def, &strings, &err), &err);
    free(text);
}

void fuzz_camera(const source_file *file)
{
    ray_shot shot;
    gbt_error err = {0};
    char *text = text_of(file);
    check(camera_text_read(text, file->name, world, &shot, &err), &err);
    free(text);
}

/* For those that take the name of a file: one in memory, with these bytes. */
static const char *as_file(const source_file *file)
{
    static char path[64];
    static int fd = -1;
    if (fd < 0)
        fd = memfd_create("input", 0);
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    require(ftruncate(fd, 0) == 0 && pwrite(fd, file->bytes, file->size, 0) == (ssize_t)file->size);
    return path;
}

void fuzz_path(const source_file *file)
{
    const char *path = as_file(file);
    camera_path out;
    gbt_error err = {0};
    check(camera_path_file_read(path, world, 0, &out, &err), &err);
    camera_path_free(&out);
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
        require(header == GBT_OK && out.width == h.width && out.height == h.height);
        image_free(&out);
    }
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
    char *text = text_of(file);
    request out;
    gbt_error err = {0};
    char *words = text + strcspn(text, "\n");
    if (*words != '\0')
        *words++ = '\0';
    check(request_parse(text, word_of, words, &out, &err), &err);
    free(text);
}

static void hear_nothing(const gbt_event *event, void *context)
{
    (void)event;
    (void)context;
}

void fuzz_one(fuzz_target *target, const unsigned char *bytes, size_t size)
{
    unsigned char *copy = copy_of(bytes, size);
    const source_file file = {.name = "input", .bytes = copy, .size = size};
    gbt_listen(hear_nothing, NULL);
    target(&file);
    free(copy);
}

#ifdef FUZZ_TARGET
int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size)
{
    fuzz_one(FUZZ_TARGET, bytes, size);
    return 0;
}
#endif
