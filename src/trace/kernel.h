/* trace/kernel.h -- the contract between trace.c and the packet kernels.

   A kernel traces one packet of 16 rays. It is written once (packet_kernel.inc.h) and compiled per instruction set. */
#ifndef GBT_TRACE_KERNEL_H
#define GBT_TRACE_KERNEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bvh/gaussian_tree.h"
#include "trace/settings.h"

enum {
    PACKET_LANES = 16,
    RECORD_FLOATS = 16 /* one cache line per Gaussian */
};

/* A Gaussian as the kernels read it: rows of S^-1 R^T (9), mean (3), opacity, colour (3). */
enum { RECORD_MATRIX = 0, RECORD_MEAN = 9, RECORD_OPACITY = 12, RECORD_COLOR = 13 };

typedef struct kernel_scene {
    const tree_node *root; /* NULL: nothing to hit */
    const float *records;  /* [count][RECORD_FLOATS], 64-byte aligned */
    float coordinate_max;  /* of boxes and ray origins */
    trace_settings settings;
} kernel_scene;

typedef struct packet_rays {
    _Alignas(64) float origin[3][PACKET_LANES];
    _Alignas(64) float dir[3][PACKET_LANES]; /* unit; lanes that are not active repeat an active one */
    unsigned active;                         /* bit per lane; never 0 */
} packet_rays;

typedef struct packet_color {
    _Alignas(64) float rgb[3][PACKET_LANES]; /* with the background */
    _Alignas(64) float transmittance[PACKET_LANES];
} packet_color;

/* What forward leaves for backward: a growing run of bytes per block of packets. */
typedef struct tape_bytes {
    uint8_t *data;
    size_t size, capacity;
} tape_bytes;

/* What one block of packets adds to the gradient of one Gaussian. The sums are of one hit's v (canonical point), g = dL/d(d2), and so on. */
enum { GRADIENT_V = 0, GRADIENT_VV = 3, GRADIENT_OPACITY = 9, GRADIENT_COLOR = 10, GRADIENT_WEIGHT = 13, GRADIENT_FLOATS = 15 };
typedef struct gradient_record {
    float sum[GRADIENT_FLOATS]; /* V: sum g v; VV: sum g (v v^T), xx yy zz yz zx xy; OPACITY, COLOR: dL/d; WEIGHT: sum T alpha */
    uint32_t id;
} gradient_record;

/* The records of a block, one per Gaussian, in the order in which its packets met them. */
typedef struct gradient_list {
    gradient_record *records;
    size_t count, capacity;
    uint32_t *slots; /* hash table: record number + 1, 0 is free; slot_count is a power of two, at least twice `count` */
    size_t slot_count;
} gradient_list;

/** The record of Gaussian `id`, made (all zero) if it is new; NULL when memory ran out. */
gradient_record *gradient_list_find(gradient_list *list, uint32_t id);

typedef struct kernel_counters {
    uint64_t rays, nodes, tests, hits, blended, sorted_rows, spilled_packets;
} kernel_counters;

/* Growing scratch of one worker. Start from {0}. */
typedef struct kernel_scratch {
    float *rows;
    size_t row_capacity; /* floats */
    void *hits;          /* forward: hits of one lane of the spill path; backward: starts of the rounds on the tape */
    size_t hit_capacity; /* in elements of whichever it is: never share one scratch between the two */
} kernel_scratch;

/** Trace a packet. `tape` is NULL when no adjoint will follow. False when memory ran out. */
typedef bool packet_forward_fn(const kernel_scene *scene, const packet_rays *rays, packet_color *out, tape_bytes *tape, kernel_scratch *scratch,
                               kernel_counters *counters);

/**
 * Adjoint of a packet: replay the hits that forward left in tape[*cursor...], add to the record of every Gaussian that was blended.
 *
 * @param d_rgb        [in]  dL/d(rgb)
 * @param d_background [out] [3], added to
 */
typedef bool packet_backward_fn(const kernel_scene *scene, const packet_rays *rays, const float d_rgb[3][PACKET_LANES], const uint8_t *tape,
                                size_t *cursor, gradient_list *out, float d_background[3], kernel_scratch *scratch);

typedef struct packet_kernel {
    packet_forward_fn *forward;
    packet_backward_fn *backward;
} packet_kernel;

extern const packet_kernel packet_kernel_plain, packet_kernel_avx2, packet_kernel_avx512;

#endif
