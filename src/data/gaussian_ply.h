/* data/gaussian_ply.h -- plain 3DGS models (.ply with f_dc, f_rest, opacity, scale and rot) from bytes. */
#ifndef GBT_DATA_GAUSSIAN_PLY_H
#define GBT_DATA_GAUSSIAN_PLY_H

#include "data/bytes.h"

enum { GAUSSIAN_SH_COUNT = 16 };

/** Largest ratio of two scales of one Gaussian: canonical-space float arithmetic keeps 1/255 up to it. */
#define GAUSSIAN_SCALE_RATIO 1e4

/** Log-scales stay within +-GAUSSIAN_SCALE_LOG_LIMIT, so that scales, their inverses and the squares of both are floats. */
#define GAUSSIAN_SCALE_LOG_LIMIT 30

/** Gaussians as a 3DGS file gives them, checked and normalised. World coordinates of the file. */
typedef struct gaussian_cloud {
    size_t count;
    float *mean;      /* [count][3] */
    float *scale_log; /* [count][3], natural log of the std-dev; ratio limited */
    float *quat;      /* [count][4], w x y z, unit */
    float *opacity;   /* [count], [0, 1], the sigmoid applied */
    float *sh;        /* [count][GAUSSIAN_SH_COUNT][3], coefficient-major; those above sh_degree are 0 */
    int sh_degree;    /* 0..3 */
    size_t dropped;            /* rows with a value that is not usable */
    size_t identity_rotations; /* zero quaternions, read as no rotation */
    size_t scales_clamped;     /* rows with a scale raised to 1e-4 of their largest */
} gaussian_cloud;

/**
 * Read a 3DGS .ply: any property order and types, extra properties ignored, ASCII or binary.
 *
 * colour = max(0, 0.5 + sum sh_k Y_k). A row is dropped when a value is NaN or infinite; but an opacity logit of +-inf is 1 or 0 and a
 * log-scale of -inf is a flat axis, both as exporters write them. A log-scale above GAUSSIAN_SCALE_LOG_LIMIT also drops the row.
 *
 * @param out [out] free with gaussian_cloud_free(); zeroed on failure
 * @return GBT_OK; GBT_ERR_FORMAT also when no Gaussian remains; GBT_ERR_NO_MEMORY
 * Threads: any.
 */
gbt_status gaussian_ply_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

/** The same from a path. */
gbt_status gaussian_ply_load(const char *path, gaussian_cloud *out, gbt_error *err);
void gaussian_cloud_free(gaussian_cloud *cloud);

#endif
