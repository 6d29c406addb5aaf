/* SPDX-License-Identifier: Apache-2.0 */
/* tests/base/test_machine.c -- limits of made trees of /proc and /sys; events to a listener. */
#include "base/log.h"
#include "base/machine.h"
#include "base/parallel.h"
#include "folder.h"

enum { FILES_MAX = 6 };

typedef struct machine_case {
    const char *name;
    struct {
        const char *path, *text;
    } files[FILES_MAX];
    double quota;
    size_t memory, free, limit;
    const char *processor;
} machine_case;

static const char info[] = "MemTotal:        2048 kB\nMemFree: 1 kB\nMemAvailable:    1024 kB\n";

/* Limits of address space come from the process itself, so rows stay below what a test runs under. */
static const machine_case cases[] = {
    {"nothing can be read", {{NULL, NULL}}, INFINITY, 0, 0, SIZE_MAX, ""},
    {"version 2 without limits",
     {{"proc/meminfo", info},
      {"proc/self/cgroup", "0::/\n"},
      {"sys/fs/cgroup/cpu.max", "max 100000\n"},
      {"sys/fs/cgroup/memory.max", "max\n"}},
     INFINITY,
     2097152,
     1048576,
     SIZE_MAX,
     ""},
    {"version 2 with limits",
     {{"proc/self/cgroup", "0::/\n"},
      {"sys/fs/cgroup/cpu.max", "150000 100000\n"},
      {"sys/fs/cgroup/memory.max", "1000000\n"}},
     1.5,
     0,
     0,
     1000000,
     ""},
    {"the smallest of a group and those it is in",
     {{"proc/self/cgroup", "0::/a/b\n"},
      {"sys/fs/cgroup/a/cpu.max", "50000 100000\n"},
      {"sys/fs/cgroup/a/b/cpu.max", "300000 100000\n"},
      {"sys/fs/cgroup/a/memory.max", "max\n"},
      {"sys/fs/cgroup/a/b/memory.max", "2000000\n"}},
     0.5,
     0,
     0,
     2000000,
     ""},
    {"version 1",
     {{"proc/self/cgroup", "5:memory:/x\n4:cpu,cpuacct:/x\n3:pids:/x\n"},
      {"sys/fs/cgroup/cpu/x/cpu.cfs_quota_us", "200000\n"},
      {"sys/fs/cgroup/cpu/x/cpu.cfs_period_us", "100000\n"},
      {"sys/fs/cgroup/memory/x/memory.limit_in_bytes", "3000000\n"}},
     2,
     0,
     0,
     3000000,
     ""},
    {"version 1 without limits",
     {{"proc/self/cgroup", "4:cpu,cpuacct:/\n"},
      {"sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n"},
      {"sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n"}},
     INFINITY,
     0,
     0,
     SIZE_MAX,
     ""},
    {"odd texts",
     {{"proc/self/cgroup", "0\n\n::\n0:/\n"},
      {"proc/meminfo", "MemTotal: many\n"},
      {"proc/cpuinfo", "processor: 0\nmodel name\t: A chip (TM)\n"}},
     INFINITY,
     0,
     0,
     SIZE_MAX,
     "A chip (TM)"},
};

static void reads_limits(void **state)
{
    const machine_case *c = *state;
    for (int i = 0; i < FILES_MAX && c->files[i].path != NULL; i++)
        write_text(in_folder("%s", c->files[i].path), c->files[i].text);
    const machine m = machine_read(test_folder);
    assert_true(m.processors >= 1 && m.processors_allowed >= 1);
    if (m.processors_quota != c->quota)
        fail_msg("quota %g", m.processors_quota);
    assert_int_equal(m.memory_bytes, c->memory);
    assert_int_equal(m.memory_free_bytes, c->free);
    assert_true(m.memory_limit_bytes <= c->limit &&
                (c->limit == SIZE_MAX || m.memory_limit_bytes == c->limit));
    assert_string_equal(m.processor, c->processor);
}

static void reads_this_machine(void **state)
{
    (void)state;
    const machine m = machine_read("");
    assert_true(m.memory_bytes > 1000000 && m.memory_free_bytes <= m.memory_bytes &&
                m.memory_limit_bytes > 1000000);
    assert_true(m.processors_allowed <= m.processors && m.processors_quota > 0);
    assert_int_equal(parallel_threads(), machine_threads(&m)); /* nobody has set another number in this
                                                                  program */
}

static void threads_follow_the_quota(void **state)
{
    (void)state;
    const struct {
        int allowed;
        double quota;
        int threads;
    } rows[] = {{64, INFINITY, 64}, {64, 2, 2}, {64, 1.5, 2}, {64, 0.2, 1}, {4, 16, 4}, {1, 0.5, 1}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const machine m = {.processors_allowed = rows[i].allowed, .processors_quota = rows[i].quota};
        assert_int_equal(machine_threads(&m), rows[i].threads);
    }
}

typedef struct heard {
    int count[3];
    char text[64], stage[16];
    uint64_t done, total;
    double fraction;
} heard;

static void hear(const gbt_event *e, void *context)
{
    heard *h = context;
    h->count[e->kind]++;
    snprintf(h->text, sizeof h->text, "%s", e->text);
    if (e->kind == GBT_EVENT_PROGRESS) {
        snprintf(h->stage, sizeof h->stage, "%s", e->stage);
        h->done = e->done;
        h->total = e->total;
        h->fraction = e->fraction;
        assert_true(isnan(e->loss) && e->psnr == 30 && e->seconds >= 0 &&
                    (e->seconds_left >= 0 || e->done == 0 || (e->total == 0 && isnan(e->seconds_left))));
    }
}

static void tells_a_listener(void **state)
{
    (void)state;
    heard h = {.done = 0};
    gbt_listen(hear, &h);
    log_info("one %d", 1);
    assert_true(h.count[GBT_EVENT_MESSAGE] == 1 && strcmp(h.text, "one 1") == 0);
    log_warn("two");
    assert_true(h.count[GBT_EVENT_WARNING] == 1 && strcmp(h.text, "two") == 0);
    for (uint64_t i = 1; i <= 1000; i++)
        log_count("stage", i, 1000, 30);
    assert_true(h.count[GBT_EVENT_PROGRESS] >= 1 &&
                h.count[GBT_EVENT_PROGRESS] < 1000); /* the end for certain, the rest by the clock */
    assert_true(h.done == 1000 && h.total == 1000 && h.fraction == 1 && strcmp(h.stage, "stage") == 0);
    usleep(600000); /* progress is due again */
    log_count("endless", 7, 0, 30);
    assert_true(h.total == 0 && isnan(h.fraction) && strcmp(h.text, "endless: 7") == 0);
    gbt_listen(NULL, NULL);
}

int main(void)
{
    enum { CASES = sizeof cases / sizeof *cases };
    struct CMUnitTest tests[CASES + 3];
    for (int i = 0; i < CASES; i++)
        tests[i] =
            (struct CMUnitTest){cases[i].name, reads_limits, folder_make, folder_remove, (void *)&cases[i]};
    tests[CASES] = (struct CMUnitTest)cmocka_unit_test(reads_this_machine);
    tests[CASES + 1] = (struct CMUnitTest)cmocka_unit_test(tells_a_listener);
    tests[CASES + 2] = (struct CMUnitTest)cmocka_unit_test(threads_follow_the_quota);
    return cmocka_run_group_tests_name("machine", tests, NULL, NULL);
}
