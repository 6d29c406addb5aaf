/* SPDX-License-Identifier: Apache-2.0 */
/* train/checkpoint.h -- everything a run needs to go on to the same bits. */
#ifndef GBT_TRAIN_CHECKPOINT_H
#define GBT_TRAIN_CHECKPOINT_H

#include "io/container.h"
#include "train/trainer.h"

/** An array of the exposures, poses or sky that a trainer learns, and its section. */
typedef struct checkpoint_array {
    const char *section;
    container_dtype dtype; /* of 4 or 8 bytes */
    int dim_count;
    size_t dims[2]; /* [1] is 1 with dim_count 1 */
    void *data;
    void *pointer; /* the trainer's, to `data`; NULL: that is in the trainer itself */
} checkpoint_array;

enum { CHECKPOINT_ARRAYS = 11 };

/** Those of what this trainer learns; returns how many. Poses and sky are as poses_pack(), sky_pack(). */
int checkpoint_arrays(trainer *t, checkpoint_array out[CHECKPOINT_ARRAYS]);
size_t checkpoint_array_bytes(const checkpoint_array *a);

/** FNV-1a of the sizes of all photos, and of the bytes at both ends of each: another photo under the same
   name has another one. Likewise of all masks. GBT_ERR_IO: one cannot be read. */
gbt_status checkpoint_hash_photos(const scene *s, uint64_t *of_photos, uint64_t *of_masks, gbt_error *err);

/** All that tells the data of a run from other data. */
enum { CHECKPOINT_DATA_HASHES = 6 };
void checkpoint_hash_data(const trainer *t, uint64_t out[CHECKPOINT_DATA_HASHES]);

/** What the first of them that differs is of, such as "other masks"; NULL: none does. */
const char *checkpoint_data_difference(const uint64_t a[CHECKPOINT_DATA_HASHES],
                                       const uint64_t b[CHECKPOINT_DATA_HASHES]);

/** Write the trainer's state atomically; the checkpoint before it is kept as PATH.prev, and at PATH until the
    new one is whole. */
gbt_status checkpoint_save(trainer *t, const char *path, gbt_error *err);

/**
 * Put a saved state into a trainer that trainer_open() has made for the same data and the same settings.
 *
 * @return GBT_ERR_FORMAT when the file is damaged, or belongs to other data or settings (says which)
 */
gbt_status checkpoint_load(trainer *t, const char *path, gbt_error *err);

/** The settings that a checkpoint was made with, as config text (config_text()). */
gbt_status checkpoint_config(const char *path, char *out, size_t size, gbt_error *err);

#endif
