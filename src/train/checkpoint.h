/* SPDX-License-Identifier: Apache-2.0 */
/* train/checkpoint.h -- save and load the complete state of a run, so that it continues to the same bits. */
#ifndef GBT_TRAIN_CHECKPOINT_H
#define GBT_TRAIN_CHECKPOINT_H

#include "io/container.h"
#include "train/trainer.h"

/** A section of the file for an array of the learned exposures, poses or sky. */
typedef struct checkpoint_array {
    const char *section;
    container_dtype dtype; /* of 4 or 8 bytes */
    int dim_count;
    size_t dims[2]; /* [1] is 1 with dim_count 1 */
    void *data;
    void *pointer; /* address of the trainer's pointer to `data`; NULL when the array is a member of the
                      trainer */
} checkpoint_array;

enum { CHECKPOINT_ARRAYS = 12 };

/** The sections that this trainer needs; returns their number. Poses and sky are packed by poses_pack() and
    sky_pack(). */
int checkpoint_arrays(trainer *t, checkpoint_array out[CHECKPOINT_ARRAYS]);
size_t checkpoint_array_bytes(const checkpoint_array *a);

/** FNV-1a of the file sizes of all photos and of the first and last bytes of each, which detects a different
    photo under the same name. The same for all masks. GBT_ERR_IO when a file cannot be read. */
gbt_status checkpoint_hash_photos(const scene *s, uint64_t *of_photos, uint64_t *of_masks, gbt_error *err);

/** Number of hashes that together identify the data of a run. */
enum { CHECKPOINT_DATA_HASHES = 6 };
void checkpoint_hash_data(const trainer *t, uint64_t out[CHECKPOINT_DATA_HASHES]);

/** Name of the first hash that differs, such as "other masks"; NULL when all are equal. */
const char *checkpoint_data_difference(const uint64_t a[CHECKPOINT_DATA_HASHES],
                                       const uint64_t b[CHECKPOINT_DATA_HASHES]);

/** Write the trainer's state atomically. The previous checkpoint is kept as PATH.prev, and stays at PATH
    until the new one is complete. */
gbt_status checkpoint_save(trainer *t, const char *path, gbt_error *err);

/**
 * Load a saved state into a trainer that trainer_open() made for the same data and settings.
 *
 * @return GBT_ERR_FORMAT when the file is damaged, or belongs to other data or settings (says which)
 */
gbt_status checkpoint_load(trainer *t, const char *path, gbt_error *err);

/** The settings that a checkpoint was made with, as config text (config_text()). */
gbt_status checkpoint_config(const char *path, char *out, size_t size, gbt_error *err);

#endif
