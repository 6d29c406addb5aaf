/* SPDX-License-Identifier: Apache-2.0 */
/* data/usd_read.c -- reads the first prim of Gaussians in a USD text: its arrays and its translation. */
#include <math.h>
#include <stdio.h>

#include "base/log.h"
#include "data/archive.h"
#include "data/number.h"
#include "data/raw.h"
#include "data/usd.h"

static const char prim_type[] = "ParticleField3DGaussianSplat";

/* ---- tokens ---- */

/* A word, a string in quotes, or one punctuation character. */
typedef struct token {
    const char *at;
    size_t length;
} token;

typedef struct reading {
    const source_file *file;
    const char *at, *end;
} reading;

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ','; }

static bool is_single(char c) { return c != '\0' && strchr("()[]{}=;", c) != NULL; }

/* Skip blanks, commas and comments. */
static void skip_blanks(reading *r)
{
    while (r->at < r->end && (is_blank(*r->at) || *r->at == '#')) {
        if (*r->at == '#')
            while (r->at < r->end && *r->at != '\n')
                r->at++;
        else
            r->at++;
    }
}

/* The end of the string that starts at `from`, behind its closing quotes; quotes may be single or triple. */
static const char *behind_quotes(const reading *r, const char *from)
{
    const char quote = *from;
    const bool three = r->end - from >= 6 && from[1] == quote && from[2] == quote;
    const ptrdiff_t width = three ? 3 : 1;
    for (const char *c = from + width; c < r->end; c++) {
        if (*c == '\\')
            c++;
        else if (*c == quote && (!three || (r->end - c >= 3 && c[1] == quote && c[2] == quote)))
            return c + width;
    }
    return r->end;
}

/* Read the next token; false at the end of the text. */
static bool next(reading *r, token *out)
{
    skip_blanks(r);
    if (r->at >= r->end)
        return false;
    const char *from = r->at;
    if (is_single(*from))
        r->at++;
    else if (*from == '"' || *from == '\'')
        r->at = behind_quotes(r, from);
    else
        while (r->at < r->end && !is_blank(*r->at) && !is_single(*r->at) && *r->at != '#' && *r->at != '"')
            r->at++;
    if (r->at == from)
        r->at++;
    *out = (token){from, (size_t)(r->at - from)};
    return true;
}

static bool is(token t, const char *text)
{
    return t.length == strlen(text) && memcmp(t.at, text, t.length) == 0;
}

/* Skip to behind the bracket that closes the one just read, counting brackets of all kinds. */
static void skip_group(reading *r)
{
    token t;
    for (int depth = 1; depth > 0 && next(r, &t);)
        depth += is(t, "(") || is(t, "[") || is(t, "{") ? 1 : is(t, ")") || is(t, "]") || is(t, "}") ? -1 : 0;
}

static gbt_status fail(const reading *r, const char *what, gbt_error *err)
{
    return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: %s", r->file->name,
                     (size_t)(r->at - (const char *)r->file->bytes), what);
}

/* ---- the attributes of a prim ---- */

typedef enum field_id {
    POSITIONS,
    ORIENTATIONS,
    SCALES,
    OPACITIES,
    HARMONICS,
    DEGREE,
    TRANSLATE,
    TURN,
    NEAR,
    FIELDS
} field_id;

/*
 * Names of the attributes. An array with an "h" appended to its name has half precision, and is used only if
 * there is no full one.
 */
static const struct {
    const char *name;
    size_t width;
} fields[FIELDS] = {{"positions", 3},
                    {"orientations", 4},
                    {"scales", 3},
                    {"opacities", 1},
                    {"radiance:sphericalHarmonicsCoefficients", 3},
                    {"radiance:sphericalHarmonicsDegree", 1},
                    {"xformOp:translate", 3},
                    {"xformOp:rotateZ", 1},
                    {USD_NEAR, 1}};

typedef struct numbers {
    float *values; /* numbers of an array */
    size_t count, capacity;
} numbers;

typedef struct prim {
    numbers fields[FIELDS];
    double translate[3];    /* in double */
    bool is_moved;          /* xformOpOrder lists the translation */
    bool is_turned;         /* it lists the rotation about z */
    bool is_turned_first;   /* behind the translation, so that it applies first */
    bool ignored_transform; /* there is a transformation that is ignored */
} prim;

static field_id field_of(token name, bool *half)
{
    for (int f = 0; f < FIELDS; f++) {
        const size_t length = strlen(fields[f].name);
        if (name.length < length || memcmp(name.at, fields[f].name, length) != 0)
            continue;
        *half = name.length == length + 1 && name.at[length] == 'h';
        if (*half || name.length == length)
            return (field_id)f;
    }
    return FIELDS;
}

static gbt_status add_number(reading *r, prim *p, field_id f, token t, gbt_error *err)
{
    numbers *n = &p->fields[f];
    double value;
    const number_result result = number_parse_double(t.at, t.length, &value);
    if (result == NUMBER_BAD)
        return fail(r, "not a number, in a list of numbers", err);
    if (f == TRANSLATE && n->count < 3)
        p->translate[n->count] = value;
    void *grown = n->values;
    GBT_TRY(
        mem_reserve(&grown, &n->capacity, n->count, n->count + 1, sizeof *n->values, "numbers of USD", err));
    n->values = grown;
    n->values[n->count++] = result == NUMBER_RANGE ? NAN : (float)value;
    return GBT_OK;
}

/* Read a number, or all numbers in brackets. */
static gbt_status take_numbers(reading *r, prim *p, field_id f, gbt_error *err)
{
    token t;
    int depth = 0;
    p->fields[f].count = 0;
    do {
        if (!next(r, &t))
            return fail(r, "the text ends inside a list", err);
        if (is(t, "(") || is(t, "["))
            depth++;
        else if (is(t, ")") || is(t, "]"))
            depth--;
        else
            GBT_TRY(add_number(r, p, f, t, err));
    } while (depth > 0);
    return GBT_OK;
}

/* Skip a value that is not used. */
static void skip_value(reading *r)
{
    token t;
    if (next(r, &t) && (is(t, "(") || is(t, "[") || is(t, "{")))
        skip_group(r);
}

/* Whether the token is this text in quotes. */
static bool is_quoted(token t, const char *text)
{
    return t.length >= 2 && (*t.at == '"' || *t.at == '\'') && is((token){t.at + 1, t.length - 2}, text);
}

/* Read the name of the prim's colour space. An empty one states nothing. */
static gbt_status take_color_space(reading *r, gbt_error *err)
{
    token t;
    if (next(r, &t) && !is_quoted(t, "srgb_rec709_display") && !is_quoted(t, "") && !is(t, "None"))
        return fail(r, "colours of another space (wanted srgb_rec709_display)", err);
    return GBT_OK;
}

/* Whether the token names a transformation. */
static bool is_transform(token t)
{
    static const char place[] = "xformOp:";
    return t.length >= sizeof place && memcmp(t.at, place, sizeof place - 1) == 0;
}

/* Read which transformations apply, the last one first. USD ignores those that are not listed. */
static void take_order(reading *r, prim *p)
{
    token t;
    if (!next(r, &t) || !is(t, "["))
        return;
    while (next(r, &t) && !is(t, "]"))
        if (is_quoted(t, "xformOp:translate"))
            p->is_moved = true;
        else if (is_quoted(t, "xformOp:rotateZ")) {
            p->is_turned = true;
            p->is_turned_first = p->is_moved;
        } else
            p->ignored_transform = true;
}

static gbt_status take_value(reading *r, prim *p, token name, gbt_error *err)
{
    bool half = false;
    const field_id f = field_of(name, &half);
    if (is(name, "colorSpace:name"))
        return take_color_space(r, err);
    if (is(name, "xformOpOrder"))
        take_order(r, p);
    else if (f == FIELDS || (half && p->fields[f].count > 0))
        skip_value(r);
    else
        GBT_TRY(take_numbers(r, p, f, err));
    return GBT_OK;
}

/*
 * What the translation is in our axes. Those are the axes before the half turn about z, which the writer
 * lists first, so that it applies last: it only turns the axes to USD's. If it applies first, the translation
 * is along the turned axes.
 */
static void place_prim(prim *p)
{
    const numbers *turn = &p->fields[TURN];
    const bool is_half = turn->count == 1 && fabsf(turn->values[0]) == 180;
    p->ignored_transform |= (p->is_turned && !is_half) || (p->is_moved && p->fields[TRANSLATE].count != 3);
    for (int k = 0; k < 3; k++)
        if (!p->is_moved)
            p->translate[k] = 0;
        else if (p->is_turned_first && is_half && k < 2)
            p->translate[k] = 0 - p->translate[k];
}

/* Read the attributes between the braces of the prim. */
static gbt_status read_prim(reading *r, prim *p, gbt_error *err)
{
    token t, before = {.at = r->at};
    while (next(r, &t)) {
        if (is(t, "}"))
            return GBT_OK;
        if (is(t, "="))
            GBT_TRY(take_value(r, p, before, err));
        else if (is(t, "(") || is(t, "[") || is(t, "{"))
            skip_group(r); /* metadata, a child prim, or the [] of an array type */
        before = is(t, "]") ? before : t;
    }
    return fail(r, "the text ends inside the prim", err);
}

static gbt_status fail_without_prim(const char *name, gbt_error *err)
{
    return base_fail(err, GBT_ERR_FORMAT, "%s: holds no prim of type %s", name, prim_type);
}

/* Advance to behind the opening brace of the first prim of Gaussians. `depth`: how many ancestors it has. */
static gbt_status find_prim(reading *r, prim *p, int *depth, gbt_error *err)
{
    token t;
    bool defined = false;
    int transform_depth = 0; /* depth of the outermost ancestor with a transformation; 0: none */
    while (next(r, &t)) {
        if (is(t, "}"))
            transform_depth = *depth == transform_depth ? 0 : transform_depth;
        *depth += is(t, "{") ? 1 : is(t, "}") ? -1 : 0;
        if (transform_depth == 0 && is_transform(t))
            transform_depth = *depth;
        if (!(defined && is(t, prim_type))) {
            defined = is(t, "def");
            continue;
        }
        while (next(r, &t) && !is(t, "{"))
            if (is(t, "("))
                skip_group(r);
        p->ignored_transform |= transform_depth != 0;
        return GBT_OK;
    }
    return fail_without_prim(r->file->name, err);
}

/* Read the text behind the prim: transformations of its `depth` ancestors, and how many more prims there
   are. */
static size_t read_rest(reading *r, prim *p, int depth)
{
    token t;
    size_t more = 0;
    bool defined = false;
    for (int inside = 0; next(r, &t); defined = is(t, "def")) {
        if (is(t, "{"))
            inside++;
        else if (is(t, "}"))
            *(inside > 0 ? &inside : &depth) -= 1;
        else if (inside == 0 && depth > 0 && is_transform(t))
            p->ignored_transform = true;
        more += defined && is(t, prim_type);
    }
    return more;
}

/* ---- Gaussians ---- */

static gbt_status check(const reading *r, const prim *p, size_t *functions, gbt_error *err)
{
    for (int k = 0; k < 3; k++)
        if (!(fabs(p->translate[k]) <= RAW_COORDINATE_LIMIT))
            return base_fail(err, GBT_ERR_FORMAT, "%s: a translation of %g is not usable", r->file->name,
                             p->translate[k]);
    const size_t count = p->fields[POSITIONS].count / 3;
    for (int f = 0; f <= OPACITIES; f++)
        if (count == 0 || p->fields[f].count != count * fields[f].width)
            return base_fail(err, GBT_ERR_FORMAT,
                             "%s: %zu numbers in %s (wanted %zu for each of %zu positions)", r->file->name,
                             p->fields[f].count, fields[f].name, fields[f].width, count);
    const numbers *degree = &p->fields[DEGREE], *sh = &p->fields[HARMONICS];
    const float value = degree->count == 1 ? degree->values[0] : 3; /* the schema's default */
    if (!(value >= 0 && value <= 3))
        return base_fail(err, GBT_ERR_FORMAT, "%s: harmonics of degree %g (wanted 0 to 3)", r->file->name,
                         (double)value);
    *functions = sh->count == 0 ? 0 : (size_t)(((int)value + 1) * ((int)value + 1));
    if (sh->count != 3 * *functions * count)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %zu numbers of harmonics (wanted %zu)", r->file->name,
                         sh->count, 3 * *functions * count);
    return GBT_OK;
}

static void add_gaussian(const prim *p, size_t i, size_t functions, gaussian_cloud *out)
{
    gaussian_row row = {.opacity = (double)p->fields[OPACITIES].values[i]};
    for (size_t k = 0; k < 3; k++) {
        const double scale = (double)p->fields[SCALES].values[3 * i + k];
        row.mean[k] = (double)p->fields[POSITIONS].values[3 * i + k];
        row.scale_log[k] = scale >= 0 ? log(scale) : (double)NAN;
    }
    for (size_t k = 0; k < 4; k++)
        row.quat[k] = (double)p->fields[ORIENTATIONS].values[4 * i + k];
    for (size_t k = 0; k < 3 * functions; k++)
        row.sh[k / 3][k % 3] = (double)p->fields[HARMONICS].values[3 * functions * i + k];
    gaussian_cloud_add(out, &row);
}

static gbt_status read_text(reading *r, prim *p, gaussian_cloud *out, gbt_error *err)
{
    size_t functions = 0;
    int depth = 0;
    GBT_TRY(find_prim(r, p, &depth, err));
    GBT_TRY(read_prim(r, p, err));
    place_prim(p);
    const size_t more = read_rest(r, p, depth);
    GBT_TRY(check(r, p, &functions, err));
    const size_t count = p->fields[POSITIONS].count / 3;
    GBT_TRY(gaussian_cloud_alloc(out, count, err));
    out->count = 0; /* counts the usable rows from here on */
    memcpy(out->origin, p->translate, sizeof out->origin);
    if (p->fields[NEAR].count == 1)
        out->near = gaussian_cloud_near((double)p->fields[NEAR].values[0]);
    out->sh_degree = functions == 16 ? 3 : functions == 9 ? 2 : functions == 4 ? 1 : 0;
    for (size_t i = 0; i < count; i++)
        add_gaussian(p, i, functions, out);
    if (more > 0)
        log_warn("%s: only the first of %zu prims of Gaussians is read", r->file->name, more + 1);
    if (p->ignored_transform)
        log_warn("%s: only the translation of the Gaussians' prim is used; its rotation and scale, and the "
                 "transformations of its parents, are ignored",
                 r->file->name);
    return out->count > 0 ? GBT_OK
                          : base_fail(err, GBT_ERR_FORMAT, "%s: holds no usable Gaussian (%zu dropped)",
                                      r->file->name, out->dropped);
}

static reading start(const source_file *file)
{
    const char *text = (const char *)file->bytes;
    return (reading){.file = file, .at = text, .end = text + file->size};
}

static gbt_status refuse_binary(const char *name, gbt_error *err)
{
    return base_fail(err, GBT_ERR_FORMAT, "%s: binary USD (wanted text: convert it with usdcat)", name);
}

gbt_status usda_read(const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    reading r = start(file);
    prim p = {0};
    memset(out, 0, sizeof *out);
    if (file->size >= 8 && memcmp(file->bytes, "PXR-USDC", 8) == 0)
        return refuse_binary(file->name, err);
    if (file->size < 6 || memcmp(file->bytes, "#usda ", 6) != 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: not USD text (wanted a file that begins with #usda)",
                         file->name);
    const gbt_status status = read_text(&r, &p, out, err);
    for (int f = 0; f < FIELDS; f++)
        mem_free(p.fields[f].values);
    if (status != GBT_OK)
        gaussian_cloud_free(out);
    return status;
}

static bool has_prim(const source_file *file)
{
    reading r = start(file);
    prim p = {0};
    int depth = 0;
    return find_prim(&r, &p, &depth, NULL) == GBT_OK;
}

gbt_status usdz_read(const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    char name[1024];
    unsigned char *bytes;
    source_file inside = {.name = name};
    memset(out, 0, sizeof *out);
    GBT_TRY(archive_take_first(file, ".usda", has_prim, name, sizeof name, &bytes, &inside.size, err));
    if (bytes == NULL) {
        if (archive_find(file, ".usdc", name, sizeof name, NULL) == GBT_OK)
            return refuse_binary(file->name, err);
        GBT_TRY(archive_find(file, ".usda", name, sizeof name, err));
        return fail_without_prim(file->name, err);
    }
    inside.bytes = bytes;
    const gbt_status status = usda_read(&inside, out, err);
    mem_free(bytes);
    return status;
}
