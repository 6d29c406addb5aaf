/* SPDX-License-Identifier: Apache-2.0 */
/* base/machine.c -- read processor and memory limits from /proc and control groups. */
#include "base/machine.h"

#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/compare.h"

enum { PATH_SIZE = 4096, LINE_SIZE = 1024 };

/* The first line of root/folder/name that starts with `key`; its rest, without the newline. */
static bool read_line(const char *root, const char *folder, const char *name, const char *key,
                      char out[LINE_SIZE])
{
    char path[PATH_SIZE], line[LINE_SIZE];
    if (snprintf(path, sizeof path, "%s%s/%s", root, folder, name) >= (int)sizeof path)
        return false;
    FILE *file = fopen(path, "r");
    bool found = false;
    while (file != NULL && !found && fgets(line, sizeof line, file) != NULL)
        if (strncmp(line, key, strlen(key)) == 0) {
            found = true;
            line[strcspn(line, "\n")] = '\0';
            snprintf(out, LINE_SIZE, "%s", line + strlen(key));
        }
    if (file != NULL)
        fclose(file);
    return found;
}

/* "name : value kB" */
static size_t read_kilobytes(const char *root, const char *key)
{
    char line[LINE_SIZE];
    return read_line(root, "/proc", "meminfo", key, line) ? (size_t)strtoull(line, NULL, 10) * 1024 : 0;
}

/* "QUOTA PERIOD" or "max PERIOD" */
static double quota_of(const char *text)
{
    double quota, period;
    return sscanf(text, "%lf %lf", &quota, &period) == 2 && quota > 0 && period > 0 ? quota / period
                                                                                    : (double)INFINITY;
}

static void limit_memory(machine *m, const char *text)
{
    const unsigned long long bytes = strtoull(text, NULL, 10);
    if (bytes > 0) /* "max" */
        m->memory_limit_bytes = smaller_size(m->memory_limit_bytes, (size_t)bytes);
}

/* Apply the limits of `group` ("/a/b") and of all its parent groups, under `mount`. */
static void read_groups(machine *m, const char *root, const char *mount, char *group)
{
    char folder[PATH_SIZE], line[LINE_SIZE], period[LINE_SIZE];
    for (;;) {
        const bool fits = snprintf(folder, sizeof folder, "%s%s", mount, group) < (int)sizeof folder;
        if (fits && read_line(root, folder, "cpu.max", "", line))
            m->processors_quota = fmin(m->processors_quota, quota_of(line));
        if (fits && read_line(root, folder, "cpu.cfs_quota_us", "", line) &&
            read_line(root, folder, "cpu.cfs_period_us", "", period)) {
            char both[2 * LINE_SIZE + 1];
            snprintf(both, sizeof both, "%s %s", line, period);
            m->processors_quota = fmin(m->processors_quota, quota_of(both));
        }
        if (fits && (read_line(root, folder, "memory.max", "", line) ||
                     read_line(root, folder, "memory.limit_in_bytes", "", line)))
            limit_memory(m, line);
        char *slash = strrchr(group, '/');
        if (slash == NULL)
            return;
        *slash = '\0';
    }
}

/* /proc/self/cgroup: "0::/group" of version 2, "N:cpu,cpuacct:/group" of version 1. */
static void read_all_groups(machine *m, const char *root)
{
    char path[PATH_SIZE], line[LINE_SIZE];
    if (snprintf(path, sizeof path, "%s/proc/self/cgroup", root) >= (int)sizeof path)
        return;
    FILE *file = fopen(path, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        char *controllers = strchr(line, ':'),
             *group = controllers != NULL ? strchr(controllers + 1, ':') : NULL;
        if (group == NULL)
            continue;
        *group++ = '\0';
        controllers++;
        char mount[LINE_SIZE + 32] = "/sys/fs/cgroup";
        if (controllers[0] != '\0')
            snprintf(mount, sizeof mount, "/sys/fs/cgroup/%s",
                     strncmp(controllers, "cpu,", 4) == 0 ? "cpu" : controllers);
        if (controllers[0] == '\0' || strncmp(controllers, "cpu", 3) == 0 ||
            strcmp(controllers, "memory") == 0)
            read_groups(m, root, mount, group);
    }
    if (file != NULL)
        fclose(file);
}

machine machine_read(const char *root)
{
    machine m = {.processors_quota = (double)INFINITY, .memory_limit_bytes = SIZE_MAX};
    char line[LINE_SIZE];
    cpu_set_t allowed;
    struct rlimit space;
    if (read_line(root, "/proc", "cpuinfo", "model name", line)) {
        const char *name = line + strspn(line, " \t:");
        snprintf(m.processor, sizeof m.processor, "%.*s", (int)sizeof m.processor - 1, name);
    }
    const long online = sysconf(_SC_NPROCESSORS_ONLN);
    m.processors = online > 0 ? (int)online : 1;
    m.processors_allowed =
        sched_getaffinity(0, sizeof allowed, &allowed) == 0 ? CPU_COUNT(&allowed) : m.processors;
    m.memory_bytes = read_kilobytes(root, "MemTotal:");
    m.memory_free_bytes = read_kilobytes(root, "MemAvailable:");
    read_all_groups(&m, root);
    if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY)
        m.memory_limit_bytes = smaller_size(m.memory_limit_bytes, (size_t)space.rlim_cur);
    return m;
}

int machine_threads(const machine *m)
{
    return (int)fmax(1, floor(fmin((double)m->processors_allowed, m->processors_quota) + 0.5));
}
