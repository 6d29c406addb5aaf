/* SPDX-License-Identifier: Apache-2.0 */
/* image/flip.c -- LDR-FLIP: perceptual difference of two images that are shown alternately (Andersson 2020).

   sRGB --> YCxCz --+--> [contrast sensitivity filters] --> L*a*b*, Hunt --> HyAB --> colour difference c
                    +--> [edge and point detectors on Y] -------------------------> feature difference f
                                                     c, f in [0, 1]                 error = c^(1 - f)

   Every 2-D filter of the paper is a sum of products of 1-D filters, so each is computed as a column pass and
   a row pass. Borders are replicated. */
#include "image/metrics.h"

#include <math.h>
#include <string.h>

#include "base/clones.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"

enum {
    ROWS_PER_BLOCK = 16,
    RADIUS_MAX = 16,
    TAPS_MAX = 2 * RADIUS_MAX + 1,
    PLANES = 3,
    FILTERED = 8, /* Y, Cx, Cz twice; Y by the edge and the point detector, each across and down */
    SEEN = 5,     /* L, a, b, edge and point strength */
    BLOCK_ROWS = 1 + FILTERED + 2 * SEEN
};

/* Section 5 of the paper: 0.7 m from a monitor 0.7 m wide with 3840 pixels. */
static const double pixels_per_degree = 0.7 * (3840 / 0.7) * (PI / 180);

/* Linear sRGB to XYZ, from the primaries and the white point (0.3127, 0.3290) of IEC 61966-2-1. */
static const double rgb_to_xyz[3][3] = {
    {0.41239079926595934, 0.357584339383878, 0.18048078840183424},
    {0.21263900587151027, 0.715168678767756, 0.0721923152607337},
    {0.01933081871559182, 0.11919477979462598, 0.9505321522496605},
};

typedef struct filter {
    int radius;
    double taps[TAPS_MAX];
} filter;

typedef struct flip_filters {
    filter luminance, red_green, blue_yellow[2]; /* each sums to 1 */
    double blue_yellow_weight[2];
    filter gauss, edge, point;
    double white[3];
    double xyz_to_rgb[3][3];
    double color_max; /* the largest possible HyAB distance of two colours, to the power qc */
} flip_filters;

typedef struct flip_job {
    const flip_filters *filters;
    const image *sources[2];
    float *planes[2]; /* [PLANES][height][width]: Y, Cx, Cz */
    double *rows;     /* per block: BLOCK_ROWS padded rows */
    double *sums;     /* one per row */
    float *map;       /* optional */
    size_t width, height, padded;
} flip_job;

static double srgb_to_linear(float value)
{
    const double v = !(value > 0.0f) ? 0 : value >= 1.0f ? 1 : (double)value;
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static void apply(const double m[3][3], const double in[3], double out[3])
{
    for (int r = 0; r < 3; r++)
        out[r] = m[r][0] * in[0] + m[r][1] * in[1] + m[r][2] * in[2];
}

static void invert(const double m[3][3], double out[3][3])
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
            out[r][c] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        }
    const double determinant = m[0][0] * out[0][0] + m[0][1] * out[1][0] + m[0][2] * out[2][0];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            out[r][c] /= determinant;
}

static double lab_curve(double t)
{
    const double delta = 6.0 / 29;
    return t > delta * delta * delta ? pow(t, 1.0 / 3) : t / (3 * delta * delta) + 4.0 / 29;
}

/* Linear RGB to L*a*b*, then the Hunt adjustment: chroma is reduced at low luminance. */
static void hunt_lab(const flip_filters *f, const double rgb[3], double lab[3])
{
    double xyz[3];
    apply(rgb_to_xyz, rgb, xyz);
    const double x = lab_curve(xyz[0] / f->white[0]), y = lab_curve(xyz[1] / f->white[1]),
                 z = lab_curve(xyz[2] / f->white[2]);
    lab[0] = 116 * y - 16;
    lab[1] = 0.01 * lab[0] * 500 * (x - y);
    lab[2] = 0.01 * lab[0] * 200 * (y - z);
}

/* HyAB distance to the power qc = 0.7. */
static double color_distance(const double a[3], const double b[3])
{
    const double da = a[1] - b[1], db = a[2] - b[2];
    return pow(fabs(a[0] - b[0]) + sqrt(da * da + db * db), 0.7);
}

/* Map [0, 0.4 max] to [0, 0.95], because small differences matter most, and the rest to [0.95, 1]. */
static double redistribute(const flip_filters *f, double distance)
{
    const double pc = 0.4, pt = 0.95, knee = pc * f->color_max;
    return distance < knee ? pt / knee * distance : pt + (distance - knee) / (f->color_max - knee) * (1 - pt);
}

/* Filter exp(-pi^2 x^2 / b) at x degrees, normalised to sum 1; returns the sum before normalisation. */
static double make_csf(filter *out, double b)
{
    const double widest = 0.04;
    out->radius = (int)ceil(3 * sqrt(widest / (2 * PI * PI)) * pixels_per_degree);
    double sum = 0;
    for (int k = -out->radius; k <= out->radius; k++) {
        const double x = k / pixels_per_degree;
        sum += out->taps[k + out->radius] = exp(-PI * PI * x * x / b);
    }
    for (int k = 0; k <= 2 * out->radius; k++)
        out->taps[k] /= sum;
    return sum;
}

/* Normalise so that positive taps sum to 1 and negative taps to -1. */
static void normalize_signed(filter *f)
{
    double positive = 0, negative = 0;
    for (int k = 0; k <= 2 * f->radius; k++)
        if (f->taps[k] > 0)
            positive += f->taps[k];
        else
            negative -= f->taps[k];
    for (int k = 0; k <= 2 * f->radius; k++)
        f->taps[k] /= f->taps[k] > 0 ? positive : negative;
}

static void make_filters(flip_filters *f)
{
    make_csf(&f->luminance, 0.0047);
    make_csf(&f->red_green, 0.0053);
    const double amplitude[2] = {34.1, 13.5}, b[2] = {0.04, 0.025};
    for (int i = 0; i < 2; i++) {
        const double sum = make_csf(&f->blue_yellow[i], b[i]);
        f->blue_yellow_weight[i] = amplitude[i] * sqrt(PI / b[i]) * sum * sum; /* weight of the 2-D filter */
    }
    const double total = f->blue_yellow_weight[0] + f->blue_yellow_weight[1];
    f->blue_yellow_weight[0] /= total;
    f->blue_yellow_weight[1] /= total;

    const double feature_degrees = 0.082, sigma = 0.5 * feature_degrees * pixels_per_degree;
    const int radius = (int)ceil(3 * sigma);
    f->gauss.radius = f->edge.radius = f->point.radius = radius;
    double sum = 0;
    for (int k = -radius; k <= radius; k++) {
        const double g = exp(-k * k / (2 * sigma * sigma));
        f->gauss.taps[k + radius] = g;
        sum += g;
        f->edge.taps[k + radius] = -k * g;
        f->point.taps[k + radius] = (k * k / (sigma * sigma) - 1) * g;
    }
    for (int k = 0; k <= 2 * radius; k++)
        f->gauss.taps[k] /= sum;
    normalize_signed(&f->edge);
    normalize_signed(&f->point);

    for (int i = 0; i < 3; i++)
        f->white[i] = rgb_to_xyz[i][0] + rgb_to_xyz[i][1] + rgb_to_xyz[i][2];
    invert(rgb_to_xyz, f->xyz_to_rgb);
    double green[3], blue[3];
    hunt_lab(f, (const double[3]){0, 1, 0}, green);
    hunt_lab(f, (const double[3]){0, 0, 1}, blue);
    f->color_max = color_distance(green, blue);
}

static void opponent_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const flip_job *job = context;
    const flip_filters *f = job->filters;
    const size_t plane = job->width * job->height;
    for (int s = 0; s < 2; s++)
        for (size_t i = begin * job->width; i < end * job->width; i++) {
            const float *in = job->sources[s]->pixels + 3 * i;
            const double rgb[3] = {srgb_to_linear(in[0]), srgb_to_linear(in[1]), srgb_to_linear(in[2])};
            double xyz[3];
            apply(rgb_to_xyz, rgb, xyz);
            const double x = xyz[0] / f->white[0], y = xyz[1] / f->white[1], z = xyz[2] / f->white[2];
            job->planes[s][i] = (float)(116 * y - 16);
            job->planes[s][plane + i] = (float)(500 * (x - y));
            job->planes[s][2 * plane + i] = (float)(200 * (y - z));
        }
}

/* Column pass into a row with a margin of RADIUS_MAX values on both sides, filled by replicating its ends. */
FASTEST_CLONE static void filter_columns(const flip_job *job, const float *plane, size_t row, const filter *f,
                                         double *restrict out)
{
    memset(out, 0, job->width * sizeof *out);
    for (int k = -f->radius; k <= f->radius; k++) {
        const ptrdiff_t at = (ptrdiff_t)row + k, last = (ptrdiff_t)job->height - 1;
        const float *in = plane + (size_t)(at < 0 ? 0 : at > last ? last : at) * job->width;
        const double tap = f->taps[k + f->radius];
        for (size_t i = 0; i < job->width; i++)
            out[i] += tap * (double)in[i];
    }
    for (int k = 1; k <= RADIUS_MAX; k++) {
        out[-k] = out[0];
        out[job->width - 1 + (size_t)k] = out[job->width - 1];
    }
}

/* Row pass over the output of filter_columns(). */
FASTEST_CLONE static void filter_row(const double *restrict in, const filter *f, size_t width,
                                     double *restrict out)
{
    memset(out, 0, width * sizeof *out);
    for (int k = -f->radius; k <= f->radius; k++) {
        const double tap = f->taps[k + f->radius];
        for (size_t i = 0; i < width; i++)
            out[i] += tap * in[(ptrdiff_t)i + k];
    }
}

/* Filter one row of a plane by the product of two 1-D filters. `column` is scratch for the column pass. */
static void filter_plane(const flip_job *job, const float *plane, size_t row, const filter *down,
                         const filter *across, double *column, double *out)
{
    filter_columns(job, plane, row, down, column);
    filter_row(column, across, job->width, out);
}

/* Perceived colour (L*a*b*) and feature strengths of one row of one image. */
static void appearance(const flip_job *job, int source, size_t row, double *column,
                       double *const filtered[FILTERED], double *const out[SEEN])
{
    const flip_filters *f = job->filters;
    const size_t plane = job->width * job->height;
    const float *y = job->planes[source], *cx = y + plane, *cz = cx + plane;
    filter_plane(job, y, row, &f->luminance, &f->luminance, column, filtered[0]);
    filter_plane(job, cx, row, &f->red_green, &f->red_green, column, filtered[1]);
    filter_plane(job, cz, row, &f->blue_yellow[0], &f->blue_yellow[0], column, filtered[2]);
    filter_plane(job, cz, row, &f->blue_yellow[1], &f->blue_yellow[1], column, filtered[3]);
    filter_plane(job, y, row, &f->gauss, &f->edge, column, filtered[4]);
    filter_plane(job, y, row, &f->edge, &f->gauss, column, filtered[5]);
    filter_plane(job, y, row, &f->gauss, &f->point, column, filtered[6]);
    filter_plane(job, y, row, &f->point, &f->gauss, column, filtered[7]);
    for (size_t i = 0; i < job->width; i++) {
        const double luminance = (filtered[0][i] + 16) / 116;
        const double red_green = filtered[1][i] / 500;
        const double blue_yellow =
            (f->blue_yellow_weight[0] * filtered[2][i] + f->blue_yellow_weight[1] * filtered[3][i]) / 200;
        const double xyz[3] = {(luminance + red_green) * f->white[0], luminance * f->white[1],
                               (luminance - blue_yellow) * f->white[2]};
        double rgb[3], lab[3];
        apply(f->xyz_to_rgb, xyz, rgb);
        for (int c = 0; c < 3; c++)
            rgb[c] = rgb[c] < 0 ? 0 : rgb[c] > 1 ? 1 : rgb[c];
        hunt_lab(f, rgb, lab);
        out[0][i] = lab[0];
        out[1][i] = lab[1];
        out[2][i] = lab[2];
        /* The paper's detectors use Y scaled to [0, 1]. Their taps sum to 0, so only the scale factor matters
           here. */
        out[3][i] = dvec_length2(filtered[4][i], filtered[5][i]) / 116;
        out[4][i] = dvec_length2(filtered[6][i], filtered[7][i]) / 116;
    }
}

static void error_rows(size_t block, size_t begin, size_t end, void *context)
{
    const flip_job *job = context;
    double *const column = job->rows + block * BLOCK_ROWS * job->padded + RADIUS_MAX;
    double *filtered[FILTERED], *seen[2][SEEN];
    for (size_t r = 0; r < FILTERED; r++)
        filtered[r] = column + (1 + r) * job->padded;
    for (size_t r = 0; r < SEEN; r++) {
        seen[0][r] = column + (1 + FILTERED + r) * job->padded;
        seen[1][r] = column + (1 + FILTERED + SEEN + r) * job->padded;
    }
    for (size_t row = begin; row < end; row++) {
        appearance(job, 0, row, column, filtered, seen[0]);
        appearance(job, 1, row, column, filtered, seen[1]);
        double sum = 0;
        for (size_t i = 0; i < job->width; i++) {
            const double a[3] = {seen[0][0][i], seen[0][1][i], seen[0][2][i]},
                         b[3] = {seen[1][0][i], seen[1][1][i], seen[1][2][i]};
            const double color = redistribute(job->filters, color_distance(a, b));
            const double feature =
                fmax(fabs(seen[0][3][i] - seen[1][3][i]), fabs(seen[0][4][i] - seen[1][4][i]));
            const double error = pow(color, 1 - fmin(1, sqrt(feature / sqrt(2)))); /* qf = 0.5 */
            sum += error;
            if (job->map != NULL)
                job->map[row * job->width + i] = (float)error;
        }
        job->sums[row] = sum;
    }
}

gbt_status metric_flip(const image *a, const image *reference, double *mean, image *error_map, gbt_error *err)
{
    *mean = 0;
    if (a->channels != 3 || reference->channels != 3 || a->width != reference->width ||
        a->height != reference->height)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "FLIP: images of %d x %d x %d and %d x %d x %d (wanted equal, 3 channels)", a->width,
                         a->height, a->channels, reference->width, reference->height, reference->channels);
    if (error_map != NULL &&
        (error_map->channels != 1 || error_map->width != a->width || error_map->height != a->height))
        return base_fail(err, GBT_ERR_ARGUMENT, "FLIP: error map of %d x %d x %d (wanted %d x %d x 1)",
                         error_map->width, error_map->height, error_map->channels, a->width, a->height);
    flip_filters filters;
    make_filters(&filters);
    const size_t width = (size_t)a->width, height = (size_t)a->height, padded = width + 2 * RADIUS_MAX;
    const size_t row_doubles = parallel_block_count(height, ROWS_PER_BLOCK) * BLOCK_ROWS * padded;
    gbt_status status = GBT_ERR_NO_MEMORY;
    float *planes = mem_alloc(2 * PLANES * height * width, sizeof *planes, "FLIP planes", err);
    double *rows = mem_alloc(row_doubles + height, sizeof *rows, "FLIP rows", err);
    if (planes != NULL && rows != NULL) {
        flip_job job = {.filters = &filters,
                        .sources = {a, reference},
                        .planes = {planes, planes + PLANES * height * width},
                        .rows = rows,
                        .sums = rows + row_doubles,
                        .map = error_map != NULL ? error_map->pixels : NULL,
                        .width = width,
                        .height = height,
                        .padded = padded};
        parallel_blocks(height, ROWS_PER_BLOCK, opponent_rows, &job);
        parallel_blocks(height, ROWS_PER_BLOCK, error_rows, &job);
        double sum = 0;
        for (size_t row = 0; row < height; row++)
            sum += job.sums[row];
        *mean = sum / ((double)width * (double)height);
        status = GBT_OK;
    }
    mem_free(planes);
    mem_free(rows);
    return status;
}
