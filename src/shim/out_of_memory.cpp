/* SPDX-License-Identifier: Apache-2.0 */
/* shim/out_of_memory.cpp -- the end of a program in which a library has no memory.

   At the failed allocation itself, not where its exception is caught: OpenImageIO throws with locks held, so
   the next thread that wants one of them would wait forever. oneTBB throws without asking the handler of new,
   on threads of its own, where nobody catches. jansson would say of a text that it is not JSON, and write a
   file without the fields that it had no memory for. */
#include <atomic>
#include <cstdlib>
#include <exception>
#include <new>

#include <jansson.h>
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
        file_writes_end(); /* their temporary files would be left */
        end_process();
    }
    for (;;)
        pause(); /* another thread has begun to end the process */
}

static void end_by_exception()
{
    try {
        if (const std::exception_ptr why = std::current_exception())
            std::rethrow_exception(why);
    } catch (const std::bad_alloc &) {
        end_once();
    } catch (...) {
    }
    std::set_terminate(nullptr); /* anything else is a defect, and ends as such */
    std::terminate();
}

static void *alloc_for_json(size_t size)
{
    void *memory = std::malloc(size);
    if (memory == nullptr)
        end_once();
    return memory;
}

/* exit() calls this on its own thread. */
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
