/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_kernel.inc.h -- rays from one point, tile by tile over lists. Compiled once per instruction set.

     Gaussians --> records in a face's axes (list_records16.h) --> parts that each may be hit in
         (list_parts16.h) --> lists of the parts (list_build.c)
     list of a part, in the order of depth (list16.h)
         --> every packet: the rows that reach into it, evaluated, put in each ray's order (list_rows16.h),
             blended (list_forward16.h)
         --> back: list_adjoint16.h

   Wanted before inclusion: KERNEL_NAME, the name of the exported list_kernel. */

#include "trace/list_adjoint16.h"
#include "trace/list_forward16.h"
#include "trace/list_parts16.h"

const list_kernel KERNEL_NAME = {find_reached, make_records,  find_parts,
                                 forward_list, backward_list, turn_sums};
