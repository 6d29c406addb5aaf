/* SPDX-License-Identifier: Apache-2.0 */
/* io/scaffold_file.c -- converts the anchors and networks of Scaffold-GS to ours. */
#include "io/scaffold_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "data/ply.h"
#include "io/safetensors.h"

enum { PATH_SIZE = 4096, DIMENSIONS = 3, SCALES = 6, NETWORKS = 3, VIEW_INPUTS = ANCHOR_FEATURE_DIM + 3 };

static const char *const network_names[NETWORKS] = {"opacity", "cov", "color"}; /* in the order of
                                                                                   decoder_networks() */
static const size_t outputs_per_offset[NETWORKS] = {1, 7, 3};

/* ---- anchors ---- */

typedef struct anchor_rows {
    anchors *out;
    size_t column_count, dropped;
} anchor_rows;

/* The columns are position, features, log-scales and offsets (first all x, then all y, then all z). */
static void add_row(void *context, const double *values)
{
    anchor_rows *rows = context;
    for (size_t i = 0; i < rows->column_count; i++)
        if (!(fabs(values[i]) <= RAW_COORDINATE_LIMIT)) {
            rows->dropped++;
            return;
        }
    anchors *a = rows->out;
    const size_t row = a->count++, k = (size_t)a->offset_count;
    for (size_t i = 0; i < DIMENSIONS; i++)
        a->position[DIMENSIONS * row + i] = (float)*values++;
    for (size_t i = 0; i < ANCHOR_FEATURE_DIM; i++)
        a->feature[ANCHOR_FEATURE_DIM * row + i] = (float)*values++;
    for (size_t i = 0; i < SCALES; i++)
        a->scale_log[SCALES * row + i] = (float)*values++;
    for (size_t c = 0; c < DIMENSIONS; c++)
        for (size_t i = 0; i < k; i++)
            a->offset[(row * k + i) * DIMENSIONS + c] = (float)*values++;
}

/* Find the columns STEM0, STEM1, ... up to `count`, or as many as there are when `count` is 0. */
static gbt_status find_columns(const source_file *file, const ply_header *header, int vertex,
                               const char *stem, size_t count, int *columns, size_t *used, gbt_error *err)
{
    for (size_t i = 0; (count == 0 || i < count) && *used < PLY_MAX_COLUMNS; i++) {
        char name[32];
        snprintf(name, sizeof name, "%s%zu", stem, i);
        const int column = ply_find_property(header, vertex, name);
        if (column < 0 && count == 0)
            break;
        if (column < 0 ||
            header->properties[header->elements[vertex].first_property + (size_t)column].is_list)
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s: element vertex has no number %s (wanted anchors of Scaffold-GS)",
                             file->name, name);
        columns[(*used)++] = column;
    }
    return GBT_OK;
}

static gbt_status read_anchors(const source_file *file, anchors *out, size_t *dropped, gbt_error *err)
{
    ply_header header;
    GBT_TRY(ply_read_header(file, &header, err));
    const int vertex = ply_find_element(&header, "vertex");
    if (vertex < 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no element vertex in the header", file->name);
    int columns[PLY_MAX_COLUMNS];
    size_t used = 0;
    static const char *const axes[] = {"x", "y", "z"};
    for (int i = 0; i < DIMENSIONS; i++)
        if ((columns[used++] = ply_find_property(&header, vertex, axes[i])) < 0)
            return base_fail(err, GBT_ERR_FORMAT, "%s: element vertex has no property %s", file->name,
                             axes[i]);
    GBT_TRY(find_columns(file, &header, vertex, "f_anchor_feat_", ANCHOR_FEATURE_DIM, columns, &used, err));
    GBT_TRY(find_columns(file, &header, vertex, "scale_", SCALES, columns, &used, err));
    const size_t fixed = used;
    GBT_TRY(find_columns(file, &header, vertex, "f_offset_", 0, columns, &used, err));
    const size_t offsets = used - fixed;
    if (offsets == 0 || offsets % DIMENSIONS != 0 || offsets / DIMENSIONS > ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: %zu properties f_offset_ (wanted 3 for each of 1 to %d offsets)", file->name,
                         offsets, (int)ANCHOR_MAX_OFFSETS);
    out->offset_count = (int)(offsets / DIMENSIONS);
    const uint64_t count = header.elements[vertex].count;
    if (count > (file->size - header.data_at) / used) /* every column takes at least one byte */
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: %llu anchors cannot be in the %zu bytes that follow",
                         file->name, header.data_at, (unsigned long long)count, file->size - header.data_at);
    GBT_TRY(anchors_resize(out, (size_t)count, err));
    anchor_rows rows = {.out = out, .column_count = used};
    out->count = 0; /* counts the usable rows from here on */
    GBT_TRY(ply_read_rows(file, &header, vertex, columns, used, add_row, &rows, err));
    *dropped = rows.dropped;
    return out->count > 0 ? GBT_OK
                          : base_fail(err, GBT_ERR_FORMAT, "%s: holds no usable anchor (%zu rows dropped)",
                                      file->name, rows.dropped);
}

/* Subtract the median of the positions, to keep their precision in float. */
static gbt_status recentre(anchors *a, double origin[DIMENSIONS], gbt_error *err)
{
    float *axis = mem_alloc(a->count, sizeof *axis, "anchors", err);
    if (axis == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t k = 0; k < DIMENSIONS; k++) {
        for (size_t i = 0; i < a->count; i++)
            axis[i] = a->position[DIMENSIONS * i + k];
        qsort(axis, a->count, sizeof *axis, compare_floats);
        origin[k] = (double)axis[(a->count - 1) / 2];
    }
    for (size_t i = 0; i < DIMENSIONS * a->count; i++)
        a->position[i] = (float)((double)a->position[i] - origin[i % DIMENSIONS]);
    mem_free(axis);
    return GBT_OK;
}

/* ---- networks ---- */

/* The two layers of a network, as in the file. */
typedef struct network {
    tensor w1, b1, w2, b2;
} network;

static void network_free(network *n)
{
    tensor *const all[] = {&n->w1, &n->b1, &n->w2, &n->b2};
    for (int i = 0; i < 4; i++)
        mem_free(all[i]->values);
}

static gbt_status check_shape(const char *path, const char *name, const tensor *t, size_t rows,
                              size_t columns, gbt_error *err)
{
    return t->rows == rows && t->columns == columns
               ? GBT_OK
               : base_fail(err, GBT_ERR_FORMAT, "%s: array %s is %zu x %zu (wanted %zu x %zu)", path, name,
                           t->rows, t->columns, rows, columns);
}

static gbt_status parse_network(const source_file *file, size_t outputs, network *out, gbt_error *err)
{
    const struct {
        const char *name;
        tensor *place;
    } parts[] = {{"0.weight", &out->w1}, {"0.bias", &out->b1}, {"2.weight", &out->w2}, {"2.bias", &out->b2}};
    for (int i = 0; i < 4; i++)
        GBT_TRY(safetensors_read(file, parts[i].name, parts[i].place, err));
    if (out->w1.columns > VIEW_INPUTS + 1)
        return base_fail(
            err, GBT_ERR_FORMAT,
            "%s: 0.weight takes %zu inputs (wanted %d or %d: an appearance embedding is not supported)",
            file->name, out->w1.columns, (int)VIEW_INPUTS, VIEW_INPUTS + 1);
    const size_t in = out->w1.columns == VIEW_INPUTS + 1 ? VIEW_INPUTS + 1 : VIEW_INPUTS;
    GBT_TRY(check_shape(file->name, "0.weight", &out->w1, ANCHOR_HIDDEN_DIM, in, err));
    GBT_TRY(check_shape(file->name, "0.bias", &out->b1, 1, ANCHOR_HIDDEN_DIM, err));
    GBT_TRY(check_shape(file->name, "2.weight", &out->w2, outputs, ANCHOR_HIDDEN_DIM, err));
    return check_shape(file->name, "2.bias", &out->b2, 1, outputs, err);
}

#define BY_PYTHON "python3 -c \"import torch; from safetensors.torch import save_file; "

/* The Python command that converts the networks, to be run in the folder of the files. `checkpoint`: a file
   with all networks; NULL: each network has its own file. */
static void conversion(const char *checkpoint, char *out, size_t size)
{
    if (checkpoint == NULL)
        snprintf(out, size,
                 BY_PYTHON "[save_file(torch.jit.load(n + '_mlp.pt', 'cpu').state_dict(), n + "
                           "'_mlp.safetensors') for n in ('opacity', 'cov', 'color')]\"");
    else
        snprintf(out, size,
                 BY_PYTHON
                 "[save_file(v, k + '.safetensors') for k, v in torch.load('%.60s', 'cpu').items()]\"",
                 checkpoint);
}

gbt_status scaffold_file_check_name(const char *path, gbt_error *err)
{
    const size_t length = strlen(path);
    const bool one = length > 7 && strcmp(path + length - 7, "_mlp.pt") == 0;
    if (!one && !(length > 3 && strcmp(path + length - 3, ".pt") == 0) &&
        !(length > 4 && strcmp(path + length - 4, ".pth") == 0))
        return GBT_OK;
    const char *slash = strrchr(path, '/');
    char command[320];
    conversion(one ? NULL : slash != NULL ? slash + 1 : path, command, sizeof command);
    return base_fail(
        err, GBT_ERR_FORMAT,
        "%.120s: files of PyTorch are not read; run this in its folder, then import the folder: %s", path,
        command);
}

static gbt_status load_network(const char *folder, const char *name, size_t outputs, network *out,
                               gbt_error *err)
{
    char file_name[64], path[PATH_SIZE], pickle[PATH_SIZE], checkpoint[PATH_SIZE], command[320];
    snprintf(file_name, sizeof file_name, "%s_mlp.safetensors", name);
    GBT_TRY(file_join(path, sizeof path, folder, file_name, err));
    snprintf(file_name, sizeof file_name, "%s_mlp.pt", name);
    GBT_TRY(file_join(pickle, sizeof pickle, folder, file_name, err));
    GBT_TRY(file_join(checkpoint, sizeof checkpoint, folder, "checkpoints.pth", err));
    if (!file_exists(path) && (file_exists(pickle) || file_exists(checkpoint))) {
        conversion(file_exists(pickle) ? NULL : "checkpoints.pth", command, sizeof command);
        return base_fail(err, GBT_ERR_IO, "%.150s: missing; run this in its folder: %s", path, command);
    }
    source_file file = {.name = path};
    unsigned char *bytes;
    GBT_TRY(file_read(path, &bytes, &file.size, err));
    file.bytes = bytes;
    const gbt_status status = parse_network(&file, outputs, out, err);
    mem_free(bytes);
    return status;
}

/* A network that does not take the distance gets weight 0 for that input. */
static void copy_network(const network *from, size_t in, float *to)
{
    for (size_t h = 0; h < ANCHOR_HIDDEN_DIM; h++)
        for (size_t i = 0; i < in; i++)
            *to++ = i < from->w1.columns ? from->w1.values[h * from->w1.columns + i] : 0;
    const tensor *rest[] = {&from->b1, &from->w2, &from->b2};
    for (int i = 0; i < 3; i++) {
        const size_t count = rest[i]->rows * rest[i]->columns;
        memcpy(to, rest[i]->values, count * sizeof *to);
        to += count;
    }
}

static gbt_status read_decoder(const char *folder, int offset_count, decoder *out, gbt_error *err)
{
    static const char *const banks[] = {"feature_bank_mlp.pt", "feature_bank_mlp.safetensors",
                                        "mlp_feature_bank.safetensors"};
    for (size_t i = 0; i < sizeof banks / sizeof *banks; i++) {
        char bank[PATH_SIZE];
        GBT_TRY(file_join(bank, sizeof bank, folder, banks[i], err));
        if (file_exists(bank))
            return base_fail(err, GBT_ERR_FORMAT, "%s: a feature bank is not supported", bank);
    }
    network networks[NETWORKS] = {0};
    bool has_distance = false;
    gbt_status status = GBT_OK;
    for (int i = 0; i < NETWORKS && status == GBT_OK; i++) {
        status = load_network(folder, network_names[i], outputs_per_offset[i] * (size_t)offset_count,
                              &networks[i], err);
        has_distance = has_distance || networks[i].w1.columns == VIEW_INPUTS + 1;
    }
    if (status == GBT_OK)
        status = decoder_init(out, offset_count, has_distance, 0, err);
    if (status == GBT_OK) {
        decoder_network ours[NETWORKS];
        decoder_networks(out, ours);
        out->distance_scale = 1; /* distances are in scene units */
        for (int i = 0; i < NETWORKS; i++)
            copy_network(&networks[i], VIEW_INPUTS + (has_distance ? 1 : 0), out->params + ours[i].begin);
    }
    for (int i = 0; i < NETWORKS; i++)
        network_free(&networks[i]);
    return status;
}

gbt_status scaffold_file_read(const char *ply, model *out, size_t *dropped, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    *dropped = 0;
    char folder[PATH_SIZE];
    const char *slash = strrchr(ply, '/');
    if (snprintf(folder, sizeof folder, "%.*s", slash == NULL ? 1 : (int)(slash - ply) + 1,
                 slash == NULL ? "." : ply) >= (int)sizeof folder)
        return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", ply);
    source_file file = {.name = ply};
    unsigned char *bytes;
    GBT_TRY(file_read(ply, &bytes, &file.size, err));
    file.bytes = bytes;
    gbt_status status = read_anchors(&file, &out->anchors, dropped, err);
    mem_free(bytes);
    if (status == GBT_OK)
        status = recentre(&out->anchors, out->origin, err);
    if (status == GBT_OK)
        status = read_decoder(folder, out->anchors.offset_count, &out->decoder, err);
    if (status != GBT_OK)
        model_free(out);
    return status;
}
