/* SPDX-License-Identifier: Apache-2.0 */
/* shim/out_of_memory.cpp -- ends the program when a library runs out of memory.

   This happens at the failed allocation itself, not where an exception would be caught. OpenImageIO throws
   while it holds locks, so another thread would wait for them forever. oneTBB throws without calling the new
   handler, on threads of its own where nobody catches. jansson would write a file without the fields for
   which it had no memory. */
#include <atomic>
#include <cstdlib>
#include <exception>
#include <new>

#include <jansson.h>
#include <tbb/task_group.h>
#include <unistd.h>

extern "C" {
#include "base/file.h"
#include "base/library_end.h"
#include "gbtrace/train.h"
}

static void (*end_process)();
static thread_local bool exit_is_failure;

static void end_once()
{
    static std::atomic_flag ended = ATOMIC_FLAG_INIT;
    if (!ended.test_and_set()) {
        file_writes_end(); /* removes their temporary files */
        end_process();
    }
    for (;;)
        pause(); /* another thread is already ending the process */
}

extern "C" void library_out_of_memory(void)
{
    if (end_process == nullptr)
        std::abort();
    end_once();
}

static void end_by_exception()
{
    try {
        if (const std::exception_ptr why = std::current_exception())
            std::rethrow_exception(why);
    } catch (const std::bad_alloc &) {
        end_once();
    } catch (const tbb::missing_wait &) { /* Embree's tasks were left when oneTBB could not start a thread */
        end_once();
    } catch (...) {
    }
    std::set_terminate(nullptr); /* any other exception is a bug, and ends the program as usual */
    std::terminate();
}

static void *alloc_for_json(size_t size)
{
    void *memory = std::malloc(size);
    if (memory == nullptr)
        end_once();
    return memory;
}

/* Registered with atexit(): turns a library's call of exit() into a failure, on the thread that made it. */
static void at_exit()
{
    if (exit_is_failure)
        end_once();
}

extern "C" void library_exit_is_failure(bool on) { exit_is_failure = on; }

extern "C" void gbt_when_out_of_memory(void (*end)(void))
{
    end_process = end;
    std::set_new_handler(end_once);
    std::set_terminate(end_by_exception);
    std::atexit(at_exit);
    json_set_alloc_funcs(alloc_for_json, std::free);
}
