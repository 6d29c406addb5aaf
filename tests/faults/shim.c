/* SPDX-License-Identifier: Apache-2.0 */
/* tests/faults/shim.c -- loaded before a program's libraries (LD_PRELOAD): makes one of its system calls
   fail, or ends the process there.

   GBT_FAULT=CALL:N:WHAT: the N-th CALL (open, write, fsync, close, rename, mkdir, find, look, read, thread,
   memory, library; from 1) does WHAT: fail, or kill. GBT_FAULT=CALL:0:count: nothing happens. In each case
   the number of such calls is written to the file GBT_FAULT_COUNT when the process ends by itself.
   GBT_FAULT=short:0:all: every read and write is interrupted once, then moves some bytes only.
   GBT_FAULT=clock:0:back: the time of day goes back by an hour at each look. Calls count when they make,
   write or rename files; find is open() to read, look is stat(); read counts for regular files; thread is
   pthread_create(); memory is aligned_alloc(), which is all that the program's own code takes; library is
   malloc() and its like, which libraries take. */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { FILES_MAX = 4096 };

static struct {
    char call[16];
    long at;
    bool kill;
} fault;
static atomic_long seen;
static atomic_bool is_written[FILES_MAX]; /* by number: opened to write */

/* Set before any thread is. */
__attribute__((constructor)) static void read_fault(void)
{
    const char *text = getenv("GBT_FAULT");
    char what[8] = "";
    if (text != NULL && sscanf(text, "%15[a-z]:%ld:%7[a-z]", fault.call, &fault.at, what) == 3)
        fault.kill = strcmp(what, "kill") == 0;
    unsetenv("LD_PRELOAD"); /* programs that this one starts are not meant */
}

__attribute__((destructor)) static void write_count(void)
{
    const char *path = getenv("GBT_FAULT_COUNT");
    FILE *file = path != NULL ? fopen(path, "w") : NULL;
    if (file == NULL)
        return;
    fprintf(file, "%ld\n", atomic_load(&seen));
    fclose(file);
}

/* True when this call is the one that fails. */
static bool strikes(const char *call)
{
    if (strcmp(call, fault.call) != 0 || atomic_fetch_add(&seen, 1) + 1 != fault.at)
        return false;
    if (fault.kill)
        raise(SIGKILL);
    return true;
}

static bool fails(const char *call, int why)
{
    if (!strikes(call))
        return false;
    errno = why;
    return true;
}

static void *next(const char *name) { return dlsym(RTLD_NEXT, name); }

static int open_as(const char *name, const char *path, int flags, mode_t mode)
{
    int (*real)(const char *, int, ...);
    *(void **)&real = next(name);
    const bool writes = (flags & O_ACCMODE) != O_RDONLY && strncmp(path, "/dev/", 5) != 0;
    if (strncmp(path, "/dev/", 5) != 0 && fails(writes ? "open" : "find", EMFILE))
        return -1;
    const int fd = real(path, flags, mode);
    if (fd >= 0 && fd < FILES_MAX)
        atomic_store(&is_written[fd], writes);
    return fd;
}

#pragma GCC visibility push(default)

int open(const char *path, int flags, ...)
{
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(more, mode_t) : 0;
    va_end(more);
    return open_as("open", path, flags, mode);
}

int open64(const char *path, int flags, ...)
{
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(more, mode_t) : 0;
    va_end(more);
    return open_as("open64", path, flags, mode);
}

/* In turns: interrupted, or fewer bytes than were asked for. */
static bool interrupts(size_t *count)
{
    static atomic_long turn;
    if (strcmp(fault.call, "short") != 0)
        return false;
    errno = EINTR;
    *count = (*count + 1) / 2;
    return atomic_fetch_add(&turn, 1) % 2 == 0;
}

static bool counts(int fd) { return fd >= 0 && fd < FILES_MAX && atomic_load(&is_written[fd]); }

ssize_t write(int fd, const void *bytes, size_t count)
{
    static ssize_t (*real)(int, const void *, size_t);
    if (real == NULL)
        *(void **)&real = next("write");
    if (counts(fd) && interrupts(&count))
        return -1;
    return counts(fd) && fails("write", ENOSPC) ? -1 : real(fd, bytes, count);
}

ssize_t read(int fd, void *bytes, size_t count)
{
    static ssize_t (*real)(int, void *, size_t);
    struct stat info;
    if (real == NULL)
        *(void **)&real = next("read");
    if (fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && (interrupts(&count) || fails("read", EIO)))
        return -1;
    return real(fd, bytes, count);
}

static int stat_as(const char *name, const char *path, void *out)
{
    int (*real)(const char *, void *);
    *(void **)&real = next(name);
    const bool is_system = strncmp(path, "/sys/", 5) == 0 || strncmp(path, "/proc/", 6) == 0;
    return !is_system && fails("look", EIO) ? -1 : real(path, out);
}

static ssize_t pread_as(const char *name, int fd, void *bytes, size_t count, off_t at)
{
    ssize_t (*real)(int, void *, size_t, off_t);
    struct stat info;
    *(void **)&real = next(name);
    if (fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && (interrupts(&count) || fails("read", EIO)))
        return -1;
    return real(fd, bytes, count, at);
}

ssize_t pread(int fd, void *bytes, size_t count, off_t at) { return pread_as("pread", fd, bytes, count, at); }

ssize_t pread64(int fd, void *bytes, size_t count, off_t at)
{
    return pread_as("pread64", fd, bytes, count, at);
}

int stat(const char *path, struct stat *out) { return stat_as("stat", path, out); }

int stat64(const char *path, struct stat64 *out) { return stat_as("stat64", path, out); }

int clock_gettime(clockid_t clock, struct timespec *out)
{
    static int (*real)(clockid_t, struct timespec *);
    static atomic_long looks;
    if (real == NULL)
        *(void **)&real = next("clock_gettime");
    const int result = real(clock, out);
    if (clock == CLOCK_REALTIME && strcmp(fault.call, "clock") == 0)
        out->tv_sec -= 3600 * atomic_fetch_add(&looks, 1);
    return result;
}

int fsync(int fd)
{
    static int (*real)(int);
    if (real == NULL)
        *(void **)&real = next("fsync");
    return counts(fd) && fails("fsync", EIO) ? -1 : real(fd);
}

int close(int fd)
{
    static int (*real)(int);
    if (real == NULL)
        *(void **)&real = next("close");
    const bool wanted = counts(fd) && fails("close", EIO);
    if (fd >= 0 && fd < FILES_MAX)
        atomic_store(&is_written[fd], false);
    const int result = real(fd);
    if (wanted)
        errno = EIO;
    return wanted ? -1 : result;
}

int rename(const char *from, const char *to)
{
    static int (*real)(const char *, const char *);
    if (real == NULL)
        *(void **)&real = next("rename");
    return fails("rename", EACCES) ? -1 : real(from, to);
}

int mkdir(const char *path, mode_t mode)
{
    static int (*real)(const char *, mode_t);
    if (real == NULL)
        *(void **)&real = next("mkdir");
    return fails("mkdir", EACCES) ? -1 : real(path, mode);
}

int pthread_create(pthread_t *out, const pthread_attr_t *attributes, void *(*run)(void *), void *argument)
{
    static int (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
    if (real == NULL)
        *(void **)&real = next("pthread_create");
    return fails("thread", EAGAIN) ? EAGAIN : real(out, attributes, run, argument);
}

void *aligned_alloc(size_t align, size_t size)
{
    static void *(*real)(size_t, size_t);
    if (real == NULL)
        *(void **)&real = next("aligned_alloc");
    return fails("memory", ENOMEM) ? NULL : real(align, size);
}

/* glibc's own names: dlsym() itself would allocate. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void *__libc_memalign(size_t align, size_t size);

void *malloc(size_t size) { return fails("library", ENOMEM) ? NULL : __libc_malloc(size); }

void *calloc(size_t count, size_t size)
{
    return fails("library", ENOMEM) ? NULL : __libc_calloc(count, size);
}

void *realloc(void *old, size_t size) { return fails("library", ENOMEM) ? NULL : __libc_realloc(old, size); }

int posix_memalign(void **out, size_t align, size_t size)
{
    if (fails("library", ENOMEM))
        return ENOMEM;
    *out = __libc_memalign(align, size);
    return *out != NULL ? 0 : ENOMEM;
}
