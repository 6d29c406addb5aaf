/* SPDX-License-Identifier: Apache-2.0 */
/* study/time_curves.c -- statistics of the study "time": scores, intermediate scores, and the time to reach a
   score. */
#include "study/time.h"

#include <math.h>

stat_sample time_psnr(const grid_study *s, size_t scene, size_t variant)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->grid.seeds; seed++)
        values[seed] = study_grid_at(&s->grid, scene, variant, seed)->psnr;
    return stat_of(values, (size_t)s->grid.seeds);
}

stat_sample time_change(const grid_study *s, size_t scene, size_t variant)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->grid.seeds; seed++)
        values[seed] = study_grid_at(&s->grid, scene, variant, seed)->psnr -
                       study_grid_at(&s->grid, scene, TIME_DEFAULT, seed)->psnr;
    return stat_of(values, (size_t)s->grid.seeds);
}

bool time_mark(const grid_study *s, size_t scene, size_t variant, size_t mark, double *seconds, double *psnr)
{
    *seconds = *psnr = 0;
    for (int seed = 0; seed < s->grid.seeds; seed++) {
        const study_figures *run = study_grid_at(&s->grid, scene, variant, seed);
        if (mark < TIME_MARKS && mark >= run->mark_count)
            return false;
        *seconds += (mark < TIME_MARKS ? run->marks[mark].seconds : run->train_seconds) / s->grid.seeds;
        *psnr += (mark < TIME_MARKS ? run->marks[mark].psnr : run->psnr) / s->grid.seeds;
    }
    return isfinite(*psnr);
}

double time_to_reach(const study_figures *run, double psnr)
{
    double last_seconds = NAN, last_psnr = NAN;
    for (size_t i = 0; i <= run->mark_count; i++) {
        const bool is_end = i == run->mark_count;
        const double seconds = is_end ? run->train_seconds : run->marks[i].seconds,
                     here = is_end ? run->psnr : run->marks[i].psnr;
        if (here >= psnr) {
            const double share = i > 0 && here > last_psnr ? (psnr - last_psnr) / (here - last_psnr) : 1;
            return i > 0 && last_seconds > 0 ? last_seconds * pow(seconds / last_seconds, share) : seconds;
        }
        last_seconds = seconds;
        last_psnr = here;
    }
    return NAN;
}

stat_sample time_to_match(const grid_study *s, size_t scene)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->grid.seeds; seed++) {
        values[seed] = time_to_reach(study_grid_at(&s->grid, scene, TIME_DEFAULT, seed),
                                     study_grid_at(&s->grid, scene, TIME_FAITHFUL, seed)->psnr);
        if (!isfinite(values[seed]))
            return stat_of(NULL, 0); /* a mean without the slowest runs would be too good */
    }
    return stat_of(values, (size_t)s->grid.seeds);
}
