/* SPDX-License-Identifier: Apache-2.0 */
/* cluster/cluster.c -- loads the module for the MPI that started this process, and exchanges data through
   it. */
#include "cluster/cluster.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/file.h"
#include "cluster/module.h"

enum { PATH_SIZE = 4096, WORD = 4 };

static const cluster_module *module;
static int own_rank, own_size = 1;
static bool stands_alone;          /* cluster_stand_alone() */
static gbt_status agreed = GBT_OK; /* the last failure that all processes know of */
static int own_stderr = -1;        /* the original stderr of a process whose output is discarded; else -1 */
static cluster_traffic traffic;

static bool is_alone(void) { return module == NULL || stands_alone; }

int gbt_cluster_rank(void) { return is_alone() ? 0 : own_rank; }
int gbt_cluster_size(void) { return is_alone() ? 1 : own_size; }
void cluster_stand_alone(bool on) { stands_alone = on; }
cluster_traffic cluster_traffic_so_far(void) { return traffic; }

/* ---- the module ---- */

/* The environment variables by which mpirun and Slurm tell the processes their number and rank. */
static const struct {
    const char *size, *rank, *module, *name;
} starters[] = {
    {"OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK", "gbtrace_openmpi.so", "Open MPI"},
    {"PMI_SIZE", "PMI_RANK", "gbtrace_mpich.so", "MPICH"},
    {"SLURM_STEP_NUM_TASKS", "PMIX_RANK", "gbtrace_openmpi.so", "Open MPI"}, /* srun, by PMIx */
};

/*
 * Find the module beside the program or library that contains this code, as in a build tree, or in the
 * installed folder.
 */
static bool find_module(const char *name, char out[PATH_SIZE])
{
    static const char *const folders[] = {".", "gbtrace", GBT_MODULE_FOLDER};
    Dl_info here;
    char own[PATH_SIZE];
    const bool found = dladdr((const void *)&own_size, &here) != 0;
    /* dladdr() gives a bare name for a program that was found through PATH. */
    const char *file = found && strchr(here.dli_fname, '/') != NULL ? here.dli_fname : "/proc/self/exe";
    if (realpath(file, own) == NULL)
        return false;
    *strrchr(own, '/') = '\0';
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++)
        if (snprintf(out, PATH_SIZE, "%s/%s/%s", own, folders[i], name) < PATH_SIZE && file_exists(out))
            return true;
    return false;
}

static gbt_status load_module(const char *file, const char *name, const char *variable, gbt_error *err)
{
    char path[PATH_SIZE];
    if (!find_module(file, path))
        return base_fail(
            err, GBT_ERR_IO,
            "started by mpirun of %s (%s is %s), but %s is not installed: build gbtrace where %s is "
            "(docs/cluster.md)",
            name, variable, getenv(variable), file, name);
    /* RTLD_GLOBAL, because plugins that MPI loads look up MPI's symbols. */
    void *library = dlopen(path, RTLD_NOW | RTLD_GLOBAL);
    module = library == NULL ? NULL : dlsym(library, CLUSTER_MODULE_SYMBOL);
    if (module == NULL)
        return base_fail(err, GBT_ERR_IO, "%s: cannot be loaded: %s", path, dlerror());
    if (module->version == CLUSTER_MODULE_VERSION)
        return GBT_OK;
    module = NULL;
    return base_fail(err, GBT_ERR_IO, "%s: is of another version of gbtrace", path);
}

/* Discard the output of all processes but the first, so that nothing is printed twice. */
static void be_silent(void)
{
    fflush(NULL);
    own_stderr = dup(STDERR_FILENO);
    const int nowhere = open("/dev/null", O_WRONLY);
    if (nowhere >= 0) {
        dup2(nowhere, STDOUT_FILENO);
        dup2(nowhere, STDERR_FILENO);
        close(nowhere);
    }
}

gbt_status gbt_cluster_open(gbt_error *err)
{
    for (size_t i = 0; i < sizeof starters / sizeof *starters && module == NULL; i++) {
        const char *size = getenv(starters[i].size), *rank = getenv(starters[i].rank);
        if (size == NULL || rank == NULL || atoi(size) <= 1)
            continue;
        if (atoi(rank) > 0)
            be_silent();
        GBT_TRY(load_module(starters[i].module, starters[i].name, starters[i].size, err));
        module->open(&own_rank, &own_size);
    }
    if (own_size > CLUSTER_SIZE_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "%d processes (limit %d)", own_size, CLUSTER_SIZE_MAX);
    return GBT_OK;
}

void gbt_cluster_close(int exit_code, const char *error)
{
    if (module == NULL)
        return;
    enum { USAGE = 2 }; /* all have the same command line, so all fail alike */
    if (exit_code == 0 || exit_code == USAGE || agreed != GBT_OK) {
        module->close();
        module = NULL;
        own_rank = 0;
        own_size = 1;
        return;
    }
    if (own_stderr >= 0 && error != NULL)
        dprintf(own_stderr, "error: process %d: %s\n", own_rank, error);
    module->abort(exit_code);
}

/* ---- communication ---- */

/* Convert counts and offsets to int, which MPI uses: at most 8 GB in 32-bit words. Larger messages end the
   run. */
static void message_offsets(const size_t *counts, int out_counts[CLUSTER_SIZE_MAX],
                            int offsets[CLUSTER_SIZE_MAX])
{
    size_t sum = 0;
    for (int i = 0; i < own_size; i++) {
        out_counts[i] = (int)counts[i];
        offsets[i] = (int)sum;
        sum += counts[i];
    }
    if (sum <= INT_MAX)
        return;
    dprintf(own_stderr >= 0 ? own_stderr : STDERR_FILENO,
            "error: process %d: a message of %zu bytes (limit %zu)\n", own_rank, sum * WORD,
            (size_t)INT_MAX * WORD);
    module->abort(5);
}

static size_t sum_of_others(const size_t *counts)
{
    size_t sum = 0;
    for (int i = 0; i < own_size; i++)
        sum += i != own_rank ? counts[i] : 0;
    return sum;
}

static void count(size_t words, double since)
{
    traffic.bytes += words * WORD;
    traffic.seconds += clock_wall() - since;
}

void cluster_gather(const void *mine, const size_t *counts, void *all)
{
    if (is_alone()) {
        memcpy(all, mine, counts[0] * WORD);
        return;
    }
    const double start = clock_wall();
    int n[CLUSTER_SIZE_MAX], offsets[CLUSTER_SIZE_MAX];
    message_offsets(counts, n, offsets);
    module->gather(mine, n[own_rank], all, n, offsets);
    count(sum_of_others(counts), start);
}

void cluster_exchange(const void *send, const size_t *send_counts, void *all, const size_t *counts)
{
    if (is_alone()) {
        memcpy(all, send, counts[0] * WORD);
        return;
    }
    const double start = clock_wall();
    int send_n[CLUSTER_SIZE_MAX], send_offsets[CLUSTER_SIZE_MAX], n[CLUSTER_SIZE_MAX],
        offsets[CLUSTER_SIZE_MAX];
    message_offsets(send_counts, send_n, send_offsets);
    message_offsets(counts, n, offsets);
    module->exchange(send, send_n, send_offsets, all, n, offsets);
    count(sum_of_others(send_counts), start);
}

void cluster_broadcast(void *data, size_t bytes)
{
    if (is_alone())
        return;
    const double start = clock_wall();
    module->broadcast(data, (int)(bytes / WORD));
    count(bytes / WORD, start);
}

/* ---- failures ---- */

/* A failure as a message; its size is a whole number of words. */
typedef struct status_message {
    int32_t status;
    char text[sizeof((gbt_error){0}.text)];
} status_message;
_Static_assert(sizeof(status_message) % WORD == 0, "messages are words");

static status_message message_of_status(gbt_status status, const gbt_error *err)
{
    status_message t = {.status = (int32_t)status};
    if (status != GBT_OK && err != NULL)
        memcpy(t.text, err->text, sizeof t.text);
    return t;
}

static gbt_status status_of_message(const status_message *t, gbt_error *err)
{
    if (t->status == GBT_OK)
        return GBT_OK;
    agreed = (gbt_status)t->status;
    if (err != NULL) {
        err->status = agreed;
        memcpy(err->text, t->text, sizeof err->text);
    }
    return agreed;
}

gbt_status cluster_agree(gbt_status status, gbt_error *err)
{
    if (is_alone())
        return status;
    int32_t all[CLUSTER_SIZE_MAX];
    size_t counts[CLUSTER_SIZE_MAX];
    status_message mine = message_of_status(status, err), first;
    for (int i = 0; i < own_size; i++)
        counts[i] = 1;
    cluster_gather(&mine.status, counts, all);
    int failed = 0;
    while (failed < own_size && all[failed] == GBT_OK)
        failed++;
    if (failed == own_size)
        return GBT_OK;
    for (int i = 0; i < own_size; i++)
        counts[i] = i == failed ? sizeof mine / WORD : 0;
    cluster_gather(&mine, counts, &first);
    return status_of_message(&first, err);
}

gbt_status cluster_follow(gbt_status status, gbt_error *err)
{
    if (is_alone())
        return status;
    status_message first = message_of_status(status, err);
    cluster_broadcast(&first, sizeof first);
    return status_of_message(&first, err);
}
