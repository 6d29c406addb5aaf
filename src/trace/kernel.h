/* SPDX-License-Identifier: Apache-2.0 */
/* trace/kernel.h -- what trace.c and its kernels share: the rays of a tile, their results, the tape, the
   gradient records.

   A kernel traces one tile of neighbouring packets of 16 rays: over its list (list_kernel.h) or through the
   tree (tree_kernel.h). It is written once and compiled per instruction set. */
#ifndef GBT_TRACE_KERNEL_H
#define GBT_TRACE_KERNEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/memory.h"
#include "bvh/gaussian_tree.h"
#include "trace/settings.h"

enum {
    PACKET_LANES = 16,
    PACKET_PIXELS = 4, /* a packet is 4 x 4 pixels */
    TILE_ACROSS = 4,   /* a tile is 4 x 4 packets */
    TILE_PACKETS = TILE_ACROSS * TILE_ACROSS,
    TILE_PIXELS = TILE_ACROSS * PACKET_PIXELS,
    RECORD_FLOATS = 16 /* one cache line per Gaussian */
};

/* A Gaussian as the kernels read it: rows of S^-1 R^T (9), mean (3), opacity, colour (3). */
enum { RECORD_MATRIX = 0, RECORD_MEAN = 9, RECORD_OPACITY = 12, RECORD_COLOR = 13 };

typedef struct kernel_scene {
    const tree_node *root;               /* NULL: nothing to hit */
    const struct gaussian_scene *embree; /* for forward_embree only */
    const float *records;                /* [count][RECORD_FLOATS], 64-byte aligned */
    float coordinate_max;                /* of boxes and ray origins */
    bool extra; /* all of packet_output is wanted, not only colour and transmittance */
    trace_settings settings;
} kernel_scene;

typedef struct packet_rays {
    _Alignas(64) float origin[3][PACKET_LANES];
    _Alignas(64) float dir[3][PACKET_LANES];        /* unit; lanes that are not active repeat an active one */
    _Alignas(64) float far[PACKET_LANES];           /* hits at this t_c or behind are not seen */
    _Alignas(64) float background[3][PACKET_LANES]; /* background colour of each ray */
    /* set with tile_rays.parts; only list kernels read them: */
    _Alignas(64) float near[PACKET_LANES], T_front[PACKET_LANES]; /* see ray_image */
    unsigned active; /* bit per lane; 0: the packet is not traced */
} packet_rays;

typedef struct packet_output {
    _Alignas(64) float rgb[3][PACKET_LANES]; /* with the background */
    _Alignas(64) float transmittance[PACKET_LANES];
    unsigned ended; /* for parts of rays: bit per lane that transmittance_min stopped in front of a hit */
    /* with kernel_scene.extra; see trace_outputs */
    _Alignas(64) float weighted_depth[PACKET_LANES], weight[PACKET_LANES]; /* sums of T alpha t and T alpha */
    _Alignas(64) float median_depth[PACKET_LANES], normal[3][PACKET_LANES], hit_count[PACKET_LANES];
    _Alignas(64) uint32_t strongest[PACKET_LANES];
} packet_output;

/* The tape: what the forward pass of a tile leaves for the adjoint, one entry for each Gaussian that a packet
   (or a single ray) blended. Tree kernels close it with TAPE_END. */
enum { TAPE_SINGLE = 0x4000, TAPE_END = 0x8000 };
/* List kernels have the packet's number in the low TAPE_BACK bits of tape_entry.packet. The bits above say
   how many of the packet's entries the row steps back past (list_rows16.h), if these are more than two;
   TAPE_SORTED: T has to be found by sorting. */
enum { TAPE_BACK = 4, TAPE_SORTED = 0xFFFF >> TAPE_BACK };
typedef struct tape_entry {
    uint32_t id;
    uint16_t lanes;  /* bit per ray that blended it; with TAPE_SINGLE: the one ray's number, and entries of a
                        ray are in blending order */
    uint16_t packet; /* number in the tile, or flags; over lists, with TAPE_BACK */
} tape_entry;

typedef struct hit_tape {
    tape_entry *entries;
    size_t count, capacity;
    float *sums; /* over lists with packet_order, [2][TILE_PACKETS][PACKET_LANES]: T behind all hits; sum of T
                    alpha u over them (trace_settings.spread) */
    size_t sum_capacity;
} hit_tape;

static inline size_t hit_tape_bytes(const hit_tape *tape)
{
    return tape->count * sizeof *tape->entries + tape->sum_capacity * sizeof *tape->sums;
}

static inline void hit_tape_free(hit_tape *tape)
{
    mem_free(tape->entries);
    mem_free(tape->sums);
    *tape = (hit_tape){0};
}

/** False when memory ran out. */
static inline bool tape_add(hit_tape *tape, tape_entry entry)
{
    if (tape->count == tape->capacity &&
        mem_reserve((void **)&tape->entries, &tape->capacity, tape->count,
                    tape->capacity + tape->capacity / 2 + 512, sizeof entry, "hit tape", NULL) != GBT_OK)
        return false;
    tape->entries[tape->count++] = entry;
    return true;
}

/* What one tile adds to the gradient of one Gaussian: sums over its hits of expressions in v, the canonical
   point, and h = dL/d(d2). */
enum {
    GRADIENT_V = 0,
    GRADIENT_VV = 3,
    GRADIENT_OPACITY = 9,
    GRADIENT_COLOR = 10,
    GRADIENT_WEIGHT = 13,
    GRADIENT_FLOATS = 15
};
typedef struct gradient_record {
    float sum[GRADIENT_FLOATS]; /* V: sum h v; VV: sum h (v v^T), xx yy zz yz zx xy; OPACITY, COLOR: dL/d;
                                   WEIGHT: sum T alpha */
    uint32_t id;
} gradient_record;

/* The records of a tile, one per Gaussian, in the order in which its packets met them. */
typedef struct gradient_list {
    gradient_record *records;
    size_t count, capacity;
    uint32_t *slots; /* hash table: record number + 1, 0 is free; slot_count is a power of two, at least twice
                        `count` */
    size_t slot_count;
} gradient_list;

/** The record of Gaussian `id`, made (all zero) if it is new; NULL when memory ran out. */
gradient_record *gradient_list_find(gradient_list *list, uint32_t id);

typedef struct kernel_counters {
    uint64_t rays, nodes, candidates, tests, hits, blended, rows;
    uint64_t order_steps; /* of finding the order of rows: steps of insertion (lists), compared pairs (tree)
                           */
    uint64_t spilled_packets, tape_bytes;
} kernel_counters;

/* Ordered by (t_c, index): depths are positive, so their bits are in the order of their values. */
typedef struct ray_hit {
    uint64_t key; /* bits of t_c << 32 | index */
    float alpha;
} ray_hit;

/* Least component of a ray's unit direction along the third axis of its frame, about the cosine of 72
 * degrees. */
#define AXIS_COMPONENT_MIN 0.3f

/* The rays of a tile of pixels. */
typedef struct tile_rays {
    packet_rays packet[TILE_PACKETS];
    bool common_origin;                /* all of them start at one point */
    bool parts;                        /* only a part of each ray is traced: near <= t_c < far */
    uint16_t other_part[TILE_PACKETS]; /* bit per lane whose pixel belongs to another part of the tile
                                         (list_view.h) */
} tile_rays;

#endif
