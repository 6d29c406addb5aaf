/* SPDX-License-Identifier: Apache-2.0 */
/* raster/kernel.inc.h -- the kernels of the rasterizer in one table. Compiled once per instruction set.

   Wanted before inclusion: KERNEL_NAME, the name of the exported raster_kernel. */

#include "raster/ewa16.h"
#include "raster/project16.h"
#include "raster/ray_form16.h"
#include "raster/reach16.h"

const raster_kernel KERNEL_NAME = {.project = project,
                                   .reach = reach,
                                   .forward = {forward_ewa, forward_rays},
                                   .backward = {backward_ewa, backward_rays}};
