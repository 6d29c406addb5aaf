/* SPDX-License-Identifier: Apache-2.0 */
/* data/mesh_file.c -- reads triangle meshes from OBJ and PLY files in memory. */
#include "data/mesh_file.h"

#include <math.h>

#include "base/file.h"
#include "data/number.h"
#include "data/ply.h"

enum { TOKEN_SHOWN = 40 };

static gbt_status add_vertex(mesh_data *out, const double position[3], raw_place place, gbt_error *err)
{
    if (out->vertex_count >= UINT32_MAX - 1)
        return raw_fail(err, place, "too many vertices (at most %u)", UINT32_MAX - 1);
    for (int k = 0; k < 3; k++)
        if (!(fabs(position[k]) <= RAW_COORDINATE_LIMIT))
            return raw_fail(err, place, "vertex %zu: bad coordinate (wanted |x| <= %g, got %g)",
                            out->vertex_count, RAW_COORDINATE_LIMIT, position[k]);
    GBT_TRY(mem_reserve((void **)&out->position, &out->vertex_capacity, out->vertex_count,
                        out->vertex_count + 1, 3 * sizeof *out->position, "mesh", err));
    memcpy(out->position + 3 * out->vertex_count++, position, 3 * sizeof *position);
    return GBT_OK;
}

/* Splits a polygon into triangles while its corners are read: from the third corner on, each makes a triangle
   with the first and the previous corner. */
typedef struct fan {
    size_t count;
    uint32_t first, last;
} fan;

static gbt_status add_corner(mesh_data *out, fan *f, uint32_t corner, raw_place place, gbt_error *err)
{
    if (f->count == 0)
        f->first = corner;
    if (f->count++ >= 2) {
        if (out->triangle_count >= UINT32_MAX - 1)
            return raw_fail(err, place, "too many triangles (at most %u)", UINT32_MAX - 1);
        GBT_TRY(mem_reserve((void **)&out->triangles, &out->triangle_capacity, out->triangle_count,
                            out->triangle_count + 1, 3 * sizeof *out->triangles, "mesh", err));
        uint32_t *triangle = out->triangles + 3 * out->triangle_count++;
        triangle[0] = f->first;
        triangle[1] = f->last;
        triangle[2] = corner;
    }
    f->last = corner;
    return GBT_OK;
}

/* ---- OBJ ---- */

typedef struct obj_text {
    const char *at, *line_end; /* what is left of the line */
    const char *next, *end;    /* the lines behind it */
    bool continues;            /* the line ends in a backslash: the next one belongs to it */
    raw_place place;
} obj_text;

static void take_line(obj_text *t)
{
    const char *newline = memchr(t->next, '\n', (size_t)(t->end - t->next));
    t->at = t->next;
    t->line_end = newline != NULL ? newline : t->end;
    t->next = newline != NULL ? newline + 1 : t->end;
    t->place.at++;
    if (t->line_end > t->at && t->line_end[-1] == '\r')
        t->line_end--;
    t->continues = t->line_end > t->at && t->line_end[-1] == '\\';
    t->line_end -= t->continues;
}

static bool next_word(obj_text *t, const char **word, size_t *length)
{
    while (!number_next_token(&t->at, t->line_end, word, length)) {
        if (!t->continues || t->next >= t->end)
            return false;
        take_line(t);
    }
    return true;
}

static gbt_status take_vertex(mesh_data *out, obj_text *t, gbt_error *err)
{
    const char *token;
    size_t length, count = 0;
    double position[3];
    for (; count < 3 && next_word(t, &token, &length); count++)
        if (number_parse_double(token, length, &position[count]) != NUMBER_OK)
            return raw_fail(err, t->place, "not a coordinate: %.*s",
                            length < TOKEN_SHOWN ? (int)length : TOKEN_SHOWN, token);
    if (count < 3)
        return raw_fail(err, t->place, "vertex of %zu coordinates (wanted 3)", count);
    return add_vertex(out, position, t->place, err);
}

/* A corner such as "7", "-1/2" or "3//4": the vertex number before the first slash, as an index from 0. */
static gbt_status parse_corner(const mesh_data *mesh, const char *token, size_t length, raw_place place,
                               uint32_t *out, gbt_error *err)
{
    const char *slash = memchr(token, '/', length);
    const bool back = token[0] == '-';
    const size_t digits = (slash != NULL ? (size_t)(slash - token) : length) - back;
    uint64_t number;
    const number_result result = number_parse_u64(token + back, digits, &number);
    const int shown = length < TOKEN_SHOWN ? (int)length : TOKEN_SHOWN;
    if (result == NUMBER_BAD)
        return raw_fail(err, place, "not a corner of a face: %.*s", shown, token);
    if (result == NUMBER_RANGE || number == 0 || number > mesh->vertex_count)
        return raw_fail(err, place, "no such vertex: %.*s (there are %zu so far)", shown, token,
                        mesh->vertex_count);
    *out = (uint32_t)(back ? mesh->vertex_count - number : number - 1);
    return GBT_OK;
}

static gbt_status take_face(mesh_data *out, obj_text *t, gbt_error *err)
{
    const char *token;
    size_t length;
    fan f = {0};
    while (next_word(t, &token, &length)) {
        uint32_t corner = 0;
        GBT_TRY(parse_corner(out, token, length, t->place, &corner, err));
        GBT_TRY(add_corner(out, &f, corner, t->place, err));
    }
    return f.count >= 3 ? GBT_OK : raw_fail(err, t->place, "face of %zu corners (wanted 3 or more)", f.count);
}

static bool is_passed_over(const char *word, size_t length)
{
    static const char *const words[] = {"vt",       "vn",     "vp",         "g",        "o",
                                        "s",        "mg",     "l",          "p",        "usemtl",
                                        "mtllib",   "usemap", "maplib",     "bevel",    "c_interp",
                                        "d_interp", "lod",    "shadow_obj", "trace_obj"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strlen(words[i]) == length && memcmp(words[i], word, length) == 0)
            return true;
    return false;
}

static gbt_status parse_obj(const source_file *file, mesh_data *out, gbt_error *err)
{
    const char *text = (const char *)file->bytes, *word;
    size_t length;
    obj_text t = {.next = text + file_mark_bytes(text, file->size),
                  .end = text + file->size,
                  .place = {file->name, ':', 0}};
    while (t.next < t.end) {
        take_line(&t);
        const bool has_word = next_word(&t, &word, &length);
        if (has_word && word[0] == '#')
            t.continues = false; /* a backslash there may end a path of Windows */
        else if (has_word && length == 1 && word[0] == 'v')
            GBT_TRY(take_vertex(out, &t, err));
        else if (has_word && length == 1 && word[0] == 'f')
            GBT_TRY(take_face(out, &t, err));
        else if (has_word && !is_passed_over(word, length))
            return raw_fail(err, t.place, "not a line of an OBJ mesh: %.*s",
                            length < TOKEN_SHOWN ? (int)length : TOKEN_SHOWN, word);
        while (t.continues && t.next < t.end) /* what is not used of a line */
            take_line(&t);
    }
    return GBT_OK;
}

/* ---- PLY ---- */

typedef struct ply_mesh {
    mesh_data *out;
    raw_place place;
    gbt_status status; /* of the first vertex that failed, because a ply_row callback cannot stop the reader
                        */
    gbt_error *err;
} ply_mesh;

static void add_ply_vertex(void *context, const double *values)
{
    ply_mesh *m = context;
    if (m->status == GBT_OK)
        m->status = add_vertex(m->out, values, m->place, m->err);
}

static gbt_status add_ply_face(void *context, const double *items, size_t count, gbt_error *err)
{
    ply_mesh *m = context;
    const size_t face = m->place.at++;
    fan f = {0};
    if (count < 3)
        return raw_fail(err, m->place, "face %zu of %zu corners (wanted 3 or more)", face, count);
    for (size_t i = 0; i < count; i++) {
        if (!(items[i] >= 0 && items[i] < (double)m->out->vertex_count && items[i] == floor(items[i])))
            return raw_fail(err, m->place, "face %zu: no such vertex: %g (there are %zu)", face, items[i],
                            m->out->vertex_count);
        GBT_TRY(add_corner(m->out, &f, (uint32_t)items[i], m->place, err));
    }
    return GBT_OK;
}

static gbt_status parse_ply(const source_file *file, mesh_data *out, gbt_error *err)
{
    static const char *const names[] = {"x", "y", "z"};
    ply_header header;
    GBT_TRY(ply_read_header(file, &header, err));
    const int vertex = ply_find_element(&header, "vertex"), face = ply_find_element(&header, "face");
    if (vertex < 0 || face < 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no element %s in the header", file->name,
                         vertex < 0 ? "vertex" : "face");
    int columns[3], list = ply_find_property(&header, face, "vertex_indices");
    for (int k = 0; k < 3; k++) {
        columns[k] = ply_find_property(&header, vertex, names[k]);
        if (columns[k] < 0 ||
            header.properties[header.elements[vertex].first_property + (size_t)columns[k]].is_list)
            return base_fail(err, GBT_ERR_FORMAT, "%s: element vertex has no property %s", file->name,
                             names[k]);
    }
    list = list < 0 ? ply_find_property(&header, face, "vertex_index") : list;
    if (list < 0 || !header.properties[header.elements[face].first_property + (size_t)list].is_list)
        return base_fail(err, GBT_ERR_FORMAT, "%s: element face has no list vertex_indices", file->name);
    ply_mesh m = {.out = out, .place = {file->name, RAW_MARK_FILE, 0}, .err = err};
    GBT_TRY(ply_read_rows(file, &header, vertex, columns, 3, add_ply_vertex, &m, err));
    GBT_TRY(m.status);
    return ply_read_lists(file, &header, face, list, add_ply_face, &m, err);
}

gbt_status mesh_file_parse(const source_file *file, mesh_data *out, gbt_error *err)
{
    const bool is_ply = file->size >= 3 && memcmp(file->bytes, "ply", 3) == 0;
    GBT_TRY(is_ply ? parse_ply(file, out, err) : parse_obj(file, out, err));
    if (out->triangle_count == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no triangles in it (wanted an OBJ or PLY mesh)",
                         file->name);
    return GBT_OK;
}

gbt_status mesh_file_read(const char *path, mesh_data *out, gbt_error *err)
{
    unsigned char *bytes;
    source_file file = {.name = path};
    memset(out, 0, sizeof *out);
    GBT_TRY(file_read(path, &bytes, &file.size, err));
    file.bytes = bytes;
    const gbt_status status = mesh_file_parse(&file, out, err);
    mem_free(bytes);
    return status;
}

void mesh_data_free(mesh_data *mesh)
{
    mem_free(mesh->position);
    mem_free(mesh->triangles);
    memset(mesh, 0, sizeof *mesh);
}
