/* SPDX-License-Identifier: Apache-2.0 */
/* shim/parallel_tbb.cpp -- base/parallel.h with oneTBB. */
#include "base/parallel.h"

#include <cfenv>
#include <cstdio>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>
#include <tbb/version.h>

extern "C" {
#include "base/library_end.h"
#include "base/log.h"
#include "base/machine.h"
}

/* Never without a limit, also not at the end of the process: then oneTBB would start threads. */
static tbb::global_control *limit;
/* oneTBB's default arena has one slot per processor; more threads than that need an arena of their own. */
static std::unique_ptr<tbb::task_arena> wide;
static int thread_count = 0;

/* How many of `threads` threads, this one among them, can exist at once. oneTBB throws when it cannot start
   one, at any time later, with tasks still running. */
static int threads_that_start(int threads)
{
    std::mutex end;
    std::vector<std::thread> started;
    {
        const std::lock_guard<std::mutex> not_yet(end);
        try {
            started.reserve(static_cast<size_t>(threads));
            while (static_cast<int>(started.size()) + 1 < threads)
                started.emplace_back([&end] { const std::lock_guard<std::mutex> now(end); });
        } catch (const std::exception &) {
        }
    }
    for (std::thread &thread : started)
        thread.join();
    return static_cast<int>(started.size()) + 1;
}

extern "C" void parallel_set_threads(int threads)
try {
    if (threads < 1)
        threads = 1;
    if (threads > PARALLEL_THREADS_MAX)
        threads = PARALLEL_THREADS_MAX;
    const int wanted = threads;
    threads = threads_that_start(wanted);
    if (threads < wanted)
        log_warn("only %d of %d threads could be started", threads, wanted);
    wide.reset();
    auto *const next =
        new tbb::global_control(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
    delete limit;
    limit = next;
    if (threads > tbb::info::default_concurrency())
        wide = std::make_unique<tbb::task_arena>(threads);
    thread_count = threads;
} catch (...) {
    /* Without a limit TBB uses every processor: possibly slower, but not wrong. */
}

/* oneTBB counts processors and does not know the CPU quotas of containers, so the number of threads is
   determined here. */
extern "C" int parallel_threads(void)
try {
    static std::once_flag once;
    std::call_once(once, [] {
        const machine m = machine_read("");
        if (thread_count == 0)
            parallel_set_threads(machine_threads(&m));
    });
    return thread_count > 0 ? thread_count : 1;
} catch (...) {
    return 1;
}

/* Sets the default floating-point environment during its lifetime. Embree switches its worker threads, which
   are also ours, to flush denormals to zero; without this class results would depend on the thread. Usually
   the default is already in force, and checking that is much cheaper than setting it. */
class default_float_environment {
    std::fenv_t saved;
    const bool was_default;

    static bool is_default()
    {
#ifdef __SSE__
        const unsigned flags = 0x3f, initial = 0x1f80; /* flags: the exception flags, which are no setting */
        return (__builtin_ia32_stmxcsr() & ~flags) == initial;
#else
        return false;
#endif
    }

  public:
    default_float_environment() : was_default(is_default())
    {
        if (was_default)
            return;
        std::fegetenv(&saved);
        std::fesetenv(FE_DFL_ENV);
    }
    ~default_float_environment()
    {
        if (!was_default)
            std::fesetenv(&saved);
    }
};

extern "C" void parallel_run(size_t count, size_t grain, parallel_body *body, void *context)
try {
    const int threads = parallel_threads();
    const size_t blocks = parallel_block_count(count, grain);
    const auto run = [=](size_t block) {
        const default_float_environment environment;
        const size_t begin = block * grain;
        const size_t end = begin + grain < count ? begin + grain : count;
        body(block, begin, end, context);
    };
    if (blocks <= 1 || threads == 1) {
        for (size_t block = 0; block < blocks; block++)
            run(block);
        return;
    }
    const auto run_all = [=] {
        tbb::parallel_for(
            tbb::blocked_range<size_t>(0, blocks, 1),
            [=](const tbb::blocked_range<size_t> &range) {
                for (size_t block = range.begin(); block != range.end(); block++)
                    run(block);
            },
            tbb::simple_partitioner());
    };
    if (wide)
        wide->execute(run_all);
    else
        run_all();
} catch (...) {
    /* The bodies are C and cannot throw: TBB itself had no memory, or could not start a thread. Blocks may
       still be running. */
    library_out_of_memory();
}

extern "C" const char *parallel_library(void)
{
    static char text[40];
    std::snprintf(text, sizeof text, "oneTBB %.20s", TBB_runtime_version());
    return text;
}
