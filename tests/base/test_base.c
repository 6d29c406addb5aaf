/* SPDX-License-Identifier: Apache-2.0 */
/* tests/base/test_base.c -- what every room stands on: errors, memory, random numbers, files, Gaussian
   arrays, images, threads, vectors. */
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/cpu.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/gaussians.h"
#include "base/image.h"
#include "base/large_file.h"
#include "base/memory.h"
#include "base/near.h"
#include "base/parallel.h"
#include "base/stage.h"
#include "base/rng.h"
#include "base/stop_signal.h"
#include "base/vec.h"
#include "folder.h"
#include "gbtrace/progress.h"

/* A turn by 90 degrees about z: nothing that follows it in memory counts, and no column or row may be wrong.
 */
static void a_rotation_has_nine_numbers(void **state)
{
    (void)state;
    const double turn[12] = {0, -1, 0, 1, 0, 0, 0, 0, 1, 7, 7, 7};
    assert_true(dmat_is_rotation(turn, 1e-9));
    for (int i = 0; i < 9; i++) {
        double other[12];
        memcpy(other, turn, sizeof other);
        other[i] += 0.01;
        assert_false(dmat_is_rotation(other, 1e-3));
    }
    const double mirror[9] = {1, 0, 0, 0, 1, 0, 0, 0, -1};
    assert_false(dmat_is_rotation(mirror, 1e-3));
}

static void signals_have_their_handlers_back(void **state)
{
    (void)state;
    struct sigaction before[2], after[2];
    sigaction(SIGINT, NULL, &before[0]);
    sigaction(SIGTERM, NULL, &before[1]);
    stop_signal_catch();
    stop_signal_catch();
    raise(SIGINT);
    raise(SIGTERM); /* at once: it is the same request */
    stop_signal_release();
    assert_true(stop_signal_seen());
    stop_signal_release();
    assert_false(stop_signal_seen());
    sigaction(SIGINT, NULL, &after[0]);
    sigaction(SIGTERM, NULL, &after[1]);
    assert_true(after[0].sa_handler == before[0].sa_handler && after[1].sa_handler == before[1].sa_handler);
}

/* ThreadSanitizer holds back a signal that is raised in a handler until that has returned. */
static void skip_where_signals_wait(void)
{
#ifdef __SANITIZE_THREAD__
    skip();
#endif
}

/* How a process ends that has this handler of SIGINT, and two of them, one much later, in a loop that stops
   by signals; 7 if it goes on and the handler was called by the second alone. */
static volatile sig_atomic_t of_the_host;
static int end_of_two_signals(void (*handler)(int))
{
    const pid_t process = fork();
    assert_true(process >= 0);
    if (process == 0) {
        signal(SIGINT, handler);
        stop_signal_catch();
        raise(SIGINT);
        const bool kept = of_the_host == 0;
        usleep(1100000);
        raise(SIGINT);
        _exit(kept && of_the_host == SIGINT ? 7 : 8);
    }
    int ended = 0;
    assert_int_equal(waitpid(process, &ended, 0), process);
    return ended;
}

static void a_later_signal_ends_the_process(void **state)
{
    (void)state;
    skip_where_signals_wait();
    const int ended =
        end_of_two_signals(SIG_IGN); /* as a shell leaves it to what it starts in the background */
    assert_true(WIFSIGNALED(ended) && WTERMSIG(ended) == SIGINT);
}

static void host_handles(int number) { of_the_host = number; }

/* To the handler of the program that the library is in, such as Python's. */
static void a_later_signal_goes_to_the_host(void **state)
{
    (void)state;
    skip_where_signals_wait();
    const int ended = end_of_two_signals(host_handles);
    assert_true(WIFEXITED(ended));
    assert_int_equal(WEXITSTATUS(ended), 7);
}

static void first_cause_wins(void **state)
{
    (void)state;
    gbt_error err = {0};
    assert_int_equal(base_fail(&err, GBT_ERR_FORMAT, "a\nb:%d: wrong", 7), GBT_ERR_FORMAT);
    assert_string_equal(err.text, "a?b:7: wrong"); /* one line, whatever the file name holds */
    assert_int_equal(base_fail(&err, GBT_ERR_IO, "later"), GBT_ERR_IO);
    assert_string_equal(err.text, "a?b:7: wrong");
    assert_int_equal(err.status, GBT_ERR_FORMAT);
    assert_int_equal(base_fail(NULL, GBT_ERR_IO, "nobody listens"), GBT_ERR_IO);
    gbt_error cut = {0};
    base_fail(&cut, GBT_ERR_IO, "%0600d", 1);
    assert_int_equal(strlen(cut.text), sizeof cut.text - 1);
}

static void exit_codes(void **state)
{
    (void)state;
    static const int wanted[] = {0, 2, 3, 4, 5, 130, 1};
    for (int i = 0; i <= GBT_ERR_INTERNAL; i++)
        assert_int_equal(gbt_status_exit_code((gbt_status)i), wanted[i]);
}

static void memory_is_aligned_and_zeroed(void **state)
{
    (void)state;
    for (size_t bytes = 0; bytes < 300; bytes++) {
        unsigned char *p = mem_calloc(bytes, 1, "test", NULL);
        assert_non_null(p);
        assert_int_equal((uintptr_t)p % MEM_ALIGN, 0);
        for (size_t i = 0; i < bytes; i++)
            assert_int_equal(p[i], 0);
        mem_free(p);
    }
    mem_free(NULL);
    assert_true(mem_peak_bytes() > 100000);
}

static void memory_sizes_are_checked(void **state)
{
    (void)state;
    static const size_t sizes[][2] = {{SIZE_MAX, 2},
                                      {SIZE_MAX / 2 + 1, 2},
                                      {SIZE_MAX, 1},
                                      {(size_t)PTRDIFF_MAX, 1},
                                      {(size_t)1 << 32, (size_t)1 << 32}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        gbt_error err = {0};
        assert_null(mem_alloc(sizes[i][0], sizes[i][1], "points", &err));
        assert_int_equal(err.status, GBT_ERR_NO_MEMORY);
        assert_non_null(strstr(err.text, "points"));
        assert_null(mem_calloc(sizes[i][0], sizes[i][1], "points", NULL));
    }
}

static void memory_fails_on_demand(void **state)
{
    (void)state;
    for (long n = 0; n < 3; n++) {
        mem_fail_after(n);
        for (long i = 0; i < n; i++) {
            void *p = mem_alloc(1, 1, "test", NULL);
            assert_non_null(p);
            mem_free(p);
        }
        gbt_error err = {0};
        assert_null(mem_alloc(8, 1, "the one", &err));
        assert_int_equal(err.status, GBT_ERR_NO_MEMORY);
        assert_string_equal(err.text, "the one: no memory for 64 bytes");
        void *after = mem_alloc(1, 1, "test", NULL); /* only that one fails */
        assert_non_null(after);
        mem_free(after);
    }
    mem_fail_after(0);
    mem_fail_after(-5);
    void *p = mem_alloc(1, 1, "test", NULL);
    assert_non_null(p);
    mem_free(p);
}

static void memory_reserve_grows_and_keeps(void **state)
{
    (void)state;
    int *array = NULL;
    size_t capacity = 0, moves = 0;
    for (int i = 0; i < 10000; i++) {
        const size_t before = capacity;
        assert_ok(
            mem_reserve((void **)&array, &capacity, (size_t)i, (size_t)i + 1, sizeof *array, "list", NULL));
        moves += capacity != before;
        array[i] = i;
    }
    for (int i = 0; i < 10000; i++)
        assert_int_equal(array[i], i);
    assert_true(moves < 40); /* grows by half at least */
    int *const kept = array;
    const size_t kept_capacity = capacity;
    mem_fail_after(0);
    gbt_error err = {0};
    assert_int_equal(
        mem_reserve((void **)&array, &capacity, 10000, capacity + 1, sizeof *array, "list", &err),
        GBT_ERR_NO_MEMORY);
    assert_ptr_equal(array, kept);
    assert_int_equal(capacity, kept_capacity);
    assert_int_equal(array[9999], 9999);
    assert_int_equal(mem_reserve((void **)&array, &capacity, 10000, SIZE_MAX, sizeof *array, "list", NULL),
                     GBT_ERR_NO_MEMORY);
    assert_ptr_equal(array, kept);
    mem_fail_after(-1);
    mem_free(array);
}

/* Known answers of Philox4x32-10 (Random123): counter and key all 0, all ones, and the digits of pi. */
static void philox_known_answers(void **state)
{
    (void)state;
    static const struct {
        uint64_t seed, stream, index;
        uint32_t wanted[4];
    } rows[] = {
        {0, 0, 0, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
        {UINT64_MAX, UINT64_MAX, UINT64_MAX, {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
        {0x299f31d0a4093822,
         0x0370734413198a2e,
         0x85a308d3243f6a88,
         {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        uint32_t got[4];
        rng_philox(rows[i].seed, rows[i].stream, rows[i].index, got);
        assert_memory_equal(got, rows[i].wanted, sizeof got);
    }
}

static void random_numbers_have_their_moments(void **state)
{
    (void)state;
    enum { COUNT = 200000 };
    double sum = 0, normal = 0, normal2 = 0, normal4 = 0;
    for (uint64_t i = 0; i < COUNT; i++) {
        const float u = rng_uniform(1, 2, i);
        assert_true(u >= 0 && u < 1);
        const double z = rng_normal(3, 4, i);
        sum += (double)u;
        normal += z;
        normal2 += z * z;
        normal4 += z * z * z * z;
    }
    assert_near(sum / COUNT, 0.5, 0.004); /* six standard errors each */
    assert_near(normal / COUNT, 0, 0.014);
    assert_near(normal2 / COUNT, 1, 0.02);
    assert_near(normal4 / COUNT, 3, 0.14);
    assert_true(rng_uniform(1, 2, 5) != rng_uniform(1, 3, 5) && rng_uniform(1, 2, 5) != rng_uniform(2, 2, 5));
}

static void files_come_back(void **state)
{
    (void)state;
    const char *path = in_folder("a.bin");
    static const size_t sizes[] = {0, 1, 100000};
    for (size_t k = 0; k < 3; k++) {
        unsigned char *bytes = mem_alloc(sizes[k], 1, "test", NULL), *back;
        for (size_t i = 0; i < sizes[k]; i++)
            bytes[i] = (unsigned char)(i * 7);
        assert_ok(file_write_atomic(path, bytes, sizes[k], NULL)); /* replaces the one before */
        size_t count = 77;
        assert_ok(file_read(path, &back, &count, NULL));
        assert_int_equal(count, sizes[k]);
        assert_memory_equal(back, bytes, count);
        assert_int_equal(back[count], 0);
        mem_free(back);
        mem_free(bytes);
    }
    assert_int_equal(count_files(test_folder), 1); /* no temporary file */
    assert_true(file_exists(path) && !file_is_folder(path) && file_is_folder(test_folder));
    remove(path);
    assert_false(file_exists(path));
}

static void private_files_stay_private(void **state)
{
    (void)state;
    const char *path = in_folder("a.bin"), *name = in_folder("link");
    struct stat info;
    unsigned char *bytes;
    size_t count;
    static const mode_t modes[] = {0600, 0400, 0440}; /* the owner may write it from then on */
    assert_int_equal(symlink("a.bin", name), 0);
    for (int i = 0; i < 3; i++) {
        assert_ok(file_write_atomic(path, "old", 3, NULL));
        assert_int_equal(chmod(path, modes[i]), 0);
        assert_ok(file_write_atomic(path, "newer", 5, NULL));
        assert_int_equal(stat(path, &info), 0);
        assert_int_equal(info.st_mode & 0777, modes[i] | S_IWUSR);
    }
    assert_ok(file_write_atomic(name, "x", 1, NULL)); /* the photo behind a link is not lost */
    assert_true(lstat(name, &info) == 0 && S_ISREG(info.st_mode));
    assert_ok(file_read(path, &bytes, &count, NULL));
    assert_int_equal(count, 5);
    assert_memory_equal(bytes, "newer", 5);
    mem_free(bytes);
}

static void failed_writes_leave_nothing(void **state)
{
    (void)state;
    char inner[600];
    const char *path = in_folder("is_a_folder");
    assert_ok(file_make_folder(path, NULL));
    assert_ok(file_join(inner, sizeof inner, path, "keep", NULL));
    assert_ok(file_write_atomic(inner, "old", 3, NULL));
    gbt_error err = {0};
    assert_int_equal(file_write_atomic(path, "new", 3, &err), GBT_ERR_IO); /* the rename fails: a folder is
                                                                              there */
    assert_int_equal(err.status, GBT_ERR_IO);
    assert_ptr_equal(strstr(err.text, path), err.text);
    assert_int_equal(count_files(test_folder), 1);
    assert_int_equal(count_files(path), 1);
    assert_int_equal(file_write_atomic("/nowhere/at/all", "x", 1, NULL), GBT_ERR_IO);
    char long_path[5000];
    memset(long_path, 'x', sizeof long_path);
    long_path[sizeof long_path - 1] = '\0';
    assert_int_equal(file_write_atomic(long_path, "x", 1, NULL), GBT_ERR_ARGUMENT);
}

/* What a write would say, before there is anything to write. */
static void places_are_looked_at(void **state)
{
    (void)state;
    char inner[600];
    gbt_error err = {0};
    const char *path = in_folder("there");
    assert_ok(file_check_creatable(path, NULL));
    assert_ok(file_check_folder_creatable(path, NULL));
    assert_ok(file_join(inner, sizeof inner, path, "a/", NULL));
    assert_ok(file_check_folder_creatable(inner, NULL));
    assert_int_equal(file_check_creatable(inner, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "there/a/: cannot create: No such file or directory"));
    assert_int_equal(count_files(test_folder), 0);
    assert_ok(file_check_creatable("x", NULL)); /* here */
    assert_ok(file_check_folder_creatable("x/y", NULL));
    assert_ok(file_write_atomic(path, "x", 1, NULL));
    assert_ok(file_check_creatable(path, NULL)); /* is replaced */
    err = (gbt_error){0};
    assert_int_equal(file_check_folder_creatable(inner, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "cannot create: Not a directory"));
    err = (gbt_error){0};
    assert_int_equal(file_check_creatable(test_folder, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "cannot create: Is a directory"));
    if (geteuid() != 0) { /* who may write everywhere */
        assert_int_equal(chmod(test_folder, 0555), 0);
        assert_int_equal(file_check_creatable(path, NULL), GBT_ERR_IO);
        assert_int_equal(chmod(test_folder, 0755), 0);
    }
}

/* What is no file is written to, and stays what it is. */
static void streams_are_not_replaced(void **state)
{
    (void)state;
    char got[8] = {0};
    struct stat info;
    large_file large;
    const char *path = in_folder("pipe");
    assert_int_equal(mkfifo(path, 0600), 0);
    const int reader = open(path, O_RDONLY | O_NONBLOCK);
    assert_true(reader >= 0 && file_is_stream(path) && file_is_stream("/dev/null"));
    assert_ok(file_check_creatable(path, NULL));
    assert_ok(file_write_atomic(path, "abc", 3, NULL));
    assert_ok(large_file_create(path, &large, NULL));
    assert_ok(large_file_put(&large, "de", 2, NULL));
    assert_ok(large_file_close(&large, true, NULL));
    assert_int_equal(read(reader, got, sizeof got), 5);
    assert_string_equal(got, "abcde");
    close(reader);
    assert_int_equal(stat(path, &info), 0);
    assert_true(S_ISFIFO(info.st_mode));
    assert_int_equal(count_files(test_folder), 1);
    assert_ok(file_check_creatable("/dev/null", NULL));
    remove(path);
    assert_false(file_is_stream(path) || file_is_stream(test_folder));
}

/* A write that stops half-way (here at a file size limit) leaves the old file whole and no temporary one. */
static void full_disk_keeps_the_old_file(void **state)
{
    (void)state;
    static const unsigned char big[100000];
    const char *path = in_folder("model");
    assert_ok(file_write_atomic(path, "old", 3, NULL));
    struct rlimit keep, tight;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &keep), 0);
    tight = keep;
    tight.rlim_cur = 1000;
    void (*const handler)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &tight), 0);
    gbt_error err = {0};
    const gbt_status status = file_write_atomic(path, big, sizeof big, &err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &keep), 0);
    signal(SIGXFSZ, handler);
    assert_int_equal(status, GBT_ERR_IO);
    assert_ptr_equal(strstr(err.text, path), err.text);
    unsigned char *bytes;
    size_t count;
    assert_ok(file_read(path, &bytes, &count, NULL));
    assert_int_equal(count, 3);
    assert_memory_equal(bytes, "old", 3);
    mem_free(bytes);
    assert_int_equal(count_files(test_folder), 1);
}

static void reads_refuse_what_is_no_file(void **state)
{
    (void)state;
    unsigned char *bytes = (unsigned char *)1;
    size_t count = 9;
    gbt_error err = {0};
    assert_int_equal(file_read(test_folder, &bytes, &count, &err), GBT_ERR_IO);
    assert_null(bytes);
    assert_int_equal(count, 0);
    assert_ptr_equal(strstr(err.text, test_folder), err.text);
    assert_int_equal(file_read("/nowhere", &bytes, &count, NULL), GBT_ERR_IO);
    const char *path = in_folder("fifo");
    assert_int_equal(mkfifo(path, 0600), 0);
    assert_int_equal(file_read(path, &bytes, &count, NULL), GBT_ERR_IO); /* and does not hang */
    remove(path);
}

static void ends_tell_files_apart(void **state)
{
    (void)state;
    unsigned char out[12];
    size_t used = 9;
    gbt_error err = {0};
    const char *path = in_folder("ends");
    assert_ok(file_write_atomic(path, "abcde", 5, NULL));
    assert_ok(file_read_ends(path, 2, out, &used, NULL));
    assert_int_equal(used, 12);
    assert_memory_equal(out, "\5\0\0\0\0\0\0\0abde", 12);
    assert_ok(file_write_atomic(path, "abc", 3, NULL));
    assert_ok(file_read_ends(path, 2, out, &used, NULL));
    assert_int_equal(used, 11);
    assert_memory_equal(out + 8, "abc", 3);
    remove(path);
    assert_int_equal(file_read_ends(path, 2, out, &used, &err), GBT_ERR_IO);
    assert_ptr_equal(strstr(err.text, path), err.text);
    assert_ok(file_read_ends(test_folder, 2, out, &used, NULL));
    assert_int_equal(used, 0);
}

static void folders_and_names(void **state)
{
    (void)state;
    char file[600];
    const char *path = in_folder("a/b//c");
    assert_ok(file_make_folder(path, NULL));
    assert_ok(file_make_folder(path, NULL)); /* there already */
    assert_true(file_is_folder(path));
    assert_ok(file_join(file, sizeof file, path, "f", NULL));
    assert_ok(file_write_atomic(file, "x", 1, NULL));
    assert_int_equal(file_make_folder(file, NULL), GBT_ERR_IO);
    assert_int_equal(file_make_folder("", NULL), GBT_ERR_ARGUMENT);
    char out[8];
    assert_ok(file_join(out, sizeof out, "abc", "def", NULL)); /* 7 and the zero: just fits */
    assert_string_equal(out, "abc/def");
    assert_ok(file_join(out, sizeof out, "abc/", "def", NULL));
    assert_string_equal(out, "abc/def");
    assert_ok(file_join(out, sizeof out, "", "def", NULL));
    assert_int_equal(file_join(out, sizeof out, "abcd", "def", NULL), GBT_ERR_ARGUMENT);
}

static void gaussians_resize_pad_zero(void **state)
{
    (void)state;
    gaussians g = {0};
    for (size_t count = 0; count <= 40; count++) {
        assert_ok(gaussians_resize(&g, count, NULL));
        assert_int_equal(g.count, count);
        assert_int_equal(g.capacity % GAUSSIANS_LANES, 0);
        assert_true(g.capacity >= count);
        float *const fields[] = {
#define X(name, pad, meaning) g.name,
            GAUSSIANS_FIELDS(X)
#undef X
        };
        const float pads[] = {
#define X(name, pad, meaning) pad,
            GAUSSIANS_FIELDS(X)
#undef X
        };
        assert_int_equal(sizeof fields / sizeof fields[0], GAUSSIANS_FIELD_COUNT);
        const size_t padded = (count + GAUSSIANS_LANES - 1) / GAUSSIANS_LANES * GAUSSIANS_LANES;
        for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++) {
            assert_int_equal((uintptr_t)fields[f] % 64, 0);
            for (size_t i = 0; i < g.capacity; i++)
                fields[f][i] = (float)(100 * f) + 0.5f;
        }
        gaussians_pad(&g);
        for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
            for (size_t i = 0; i < padded; i++)
                assert_true(fields[f][i] == (i < count ? (float)(100 * f) + 0.5f
                                                       : pads[f])); /* also: fields do not overlap */
        gaussians copy = {0};
        assert_ok(gaussians_copy(&g, &copy, NULL));
        assert_int_equal(copy.count, count);
#define X(name, pad, meaning) assert_memory_equal(copy.name, g.name, padded * sizeof *g.name);
        GAUSSIANS_FIELDS(X)
#undef X
        gaussians_free(&copy);
        gaussians_zero(&g);
        for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
            for (size_t i = 0; i < padded; i++)
                assert_true(fields[f][i] == 0);
    }
    const gaussians before = g;
    mem_fail_after(0);
    assert_int_equal(gaussians_resize(&g, g.capacity + 1, NULL), GBT_ERR_NO_MEMORY);
    mem_fail_after(-1);
    assert_memory_equal(&g, &before, sizeof g); /* still the old arrays, still owned */
    gaussians_free(&g);
    assert_null(g.mean_x);
    gaussians_free(&g);
}

static void image_sizes(void **state)
{
    (void)state;
    image im;
    assert_ok(image_alloc(&im, 3, 2, 4, NULL));
    assert_int_equal(im.width * 100 + im.height * 10 + im.channels, 324);
    im.pixels[23] = 1;
    image_free(&im);
    assert_null(im.pixels);
    static const int bad[][3] = {{0, 1, 1}, {1, -1, 1}, {1, 1, 0}, {-2147483647, 5, 3}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        gbt_error err = {0};
        assert_int_equal(image_alloc(&im, bad[i][0], bad[i][1], bad[i][2], &err), GBT_ERR_ARGUMENT);
        assert_null(im.pixels);
        assert_true(err.text[0] != '\0');
    }
    assert_int_equal(image_alloc(&im, 2147483647, 2147483647, 4, NULL), GBT_ERR_NO_MEMORY);
    assert_null(im.pixels);
}

enum { COVER = 1000 };
static int covered[COVER];
static size_t begin_of[COVER];

static void cover(size_t block, size_t begin, size_t end, void *context)
{
    atomic_fetch_add((atomic_size_t *)context, 1);
    begin_of[block] = begin;
    for (size_t i = begin; i < end; i++)
        covered[i]++;
}

static void blocks_cover_once(void **state)
{
    (void)state;
    static const size_t grains[] = {1, 7, 16, 999, 1000, 5000};
    for (int threads = 1; threads <= 3; threads++) {
        parallel_set_threads(threads);
        assert_int_equal(parallel_threads(), threads);
        for (size_t k = 0; k < sizeof grains / sizeof grains[0]; k++) {
            atomic_size_t ran = 0;
            memset(covered, 0, sizeof covered);
            parallel_blocks(COVER, grains[k], cover, &ran);
            assert_int_equal(ran, parallel_block_count(COVER, grains[k]));
            for (int i = 0; i < COVER; i++)
                assert_int_equal(covered[i], 1);
            for (size_t block = 0; block < parallel_block_count(COVER, grains[k]); block++)
                assert_int_equal(begin_of[block], block * grains[k]);
        }
        atomic_size_t ran = 0;
        parallel_blocks(0, 16, cover, &ran);
        assert_int_equal(ran, 0);
    }
    const int before = parallel_threads();
    parallel_set_threads(INT_MAX);
    assert_in_range(parallel_threads(), before, PARALLEL_THREADS_MAX);
    parallel_set_threads(INT_MIN);
    assert_int_equal(parallel_threads(), 1);
    parallel_set_threads(before);
}

/* Long enough for any clock. */
static void spend(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    (void)begin;
    (void)end;
    const double until = clock_wall() + 1e-3;
    while (clock_wall() < until)
        if (context != NULL)
            parallel_blocks(2, 1, spend, NULL);
}

/* What blocks took is counted once, also of calls from inside a block. */
static void blocks_are_accounted(void **state)
{
    (void)state;
    for (int nested = 0; nested < 2; nested++) {
        parallel_set_threads(1);
        stage_clock clock = stage_begin();
        parallel_blocks(4, 1, spend, nested ? &nested : NULL);
        spend(0, 0, 1, NULL);
        const stage_time t = stage_lap(&clock);
        assert_true(t.work >= 5e-3 && t.work <= t.wall + 1e-6);
        assert_true(t.span >= 1.9e-3 && t.span < t.work);
        const stage_time none = stage_lap(&clock);
        assert_true(none.wall < t.wall && none.work <= none.wall + 1e-6 && none.span <= none.work + 1e-9);
    }
}

static void halve(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    volatile float *values = context;
    for (size_t i = begin; i < end; i++)
        values[i] = values[i] * 0.5f;
}

/* Denormals live on every thread, also when the caller, or a library in the worker threads, flushes them to
   zero. */
static void denormals_are_kept(void **state)
{
    (void)state;
    static float values[COVER];
#ifdef __SSE__
    const unsigned before = __builtin_ia32_stmxcsr();
    __builtin_ia32_ldmxcsr(before | 0x8040);
#endif
    for (int threads = 1; threads <= 3; threads++) {
        parallel_set_threads(threads);
        for (int i = 0; i < COVER; i++)
            memcpy(&values[i], &(uint32_t){0x00000100}, sizeof values[i]);
        parallel_blocks(COVER, 1, halve, values);
        for (int i = 0; i < COVER; i++) {
            uint32_t bits;
            memcpy(&bits, &values[i], sizeof bits);
            assert_int_equal(bits, 0x80);
        }
    }
#ifdef __SSE__
    assert_int_equal(__builtin_ia32_stmxcsr() & 0x8040, 0x8040); /* and the caller's own environment is not
                                                                    touched */
    __builtin_ia32_ldmxcsr(before);
#endif
}

static void instruction_sets_only_go_down(void **state)
{
    (void)state;
    const cpu_isa best = cpu_best_isa();
    assert_true(best >= CPU_PLAIN && best <= CPU_AVX512);
    cpu_limit_isa(CPU_PLAIN);
    assert_int_equal(cpu_best_isa(), CPU_PLAIN);
    cpu_limit_isa(CPU_AVX512);
    assert_true(cpu_best_isa() <= best);
    assert_string_equal(cpu_isa_name(CPU_PLAIN), "plain");
    for (cpu_isa isa = CPU_PLAIN; isa < CPU_ISA_COUNT; isa++) {
        cpu_limit_isa(isa);
        assert_true(cpu_has_isa(cpu_best_isa()) && cpu_best_isa() <= isa);
        assert_true(cpu_best_isa() == isa || !cpu_has_isa(isa));
    }
    assert_string_equal(cpu_isa_name(CPU_NEON), "neon");
    assert_string_equal(cpu_isa_name(CPU_AVX2), "avx2");
    assert_string_equal(cpu_isa_name(CPU_AVX512), "avx512");
}

/* A quarter turn about z takes x to y; matrices of unit quaternions are orthonormal; the transpose undoes
   them. */
static void rotations(void **state)
{
    (void)state;
    const double half = sqrt(0.5);
    double m[9], v[3] = {1, 0, 0};
    dquat_to_matrix((const double[4]){half, 0, 0, half}, m);
    dmat_apply(m, v, v);
    assert_near(v[0], 0, 1e-15);
    assert_near(v[1], 1, 1e-15);
    for (uint64_t i = 0; i < 100; i++) {
        double q[4], a[3] = {1, -2, 3}, b[3], length = 0;
        for (uint64_t k = 0; k < 4; k++) {
            q[k] = rng_normal(1, k, i);
            length += q[k] * q[k];
        }
        for (int k = 0; k < 4; k++)
            q[k] /= sqrt(length);
        dquat_to_matrix(q, m);
        dmat_apply(m, a, b);
        assert_near(dvec_length(b), sqrt(14), 1e-14);
        dmat_apply_transposed(m, b, b);
        for (int k = 0; k < 3; k++)
            assert_near(b[k], a[k], 1e-14);
        double third[3];
        dvec_cross(m, m + 3, third); /* det + 1: the third row is the cross product of the others */
        for (int k = 0; k < 3; k++)
            assert_near(third[k], m[6 + k], 1e-15);
        float mf[9];
        double back[4];
        dquat_of_matrix(m, back);
        for (int k = 0; k < 4; k++) /* q and -q turn alike */
            assert_near(back[k] *
                            (back[0] * q[0] + back[1] * q[1] + back[2] * q[2] + back[3] * q[3] < 0 ? -1 : 1),
                        q[k], 1e-15);
        quat_to_matrix((const float[4]){(float)q[0], (float)q[1], (float)q[2], (float)q[3]}, mf);
        for (int k = 0; k < 9; k++)
            assert_near((double)mf[k], m[k], 1e-6);
    }
    double zero[3] = {0, 0, 0};
    dvec_normalize(zero);
    assert_near(dvec_length(zero), 0, 0);
}

/* As a shell reads them back: what it prints of each is the text itself. */
static void a_shell_takes_a_text_for_one_word(void **state)
{
    (void)state;
    static const char *const texts[] = {"run",
                                        "a/b-1_2.x=3",
                                        "my photos",
                                        "it's mine",
                                        "$HOME `id` \"x\" *",
                                        "a#b",
                                        "<in >out | &;()",
                                        "'",
                                        "",
                                        "~",
                                        "\xc3\xa9",
                                        "a\nb",
                                        "!x",
                                        "\\"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        char word[256], command[300], got[256];
        snprintf(command, sizeof command, "printf '%%s' %s", gbt_shell_word(texts[i], word, sizeof word));
        FILE *shell = popen(command, "r");
        assert_non_null(shell);
        got[fread(got, 1, sizeof got - 1, shell)] = '\0';
        assert_int_equal(pclose(shell), 0);
        assert_string_equal(got, texts[i]);
    }
    char small[4];
    assert_string_equal(gbt_shell_word("run", small, sizeof small), "run");
    assert_string_equal(gbt_shell_word("a run", small, sizeof small), "'a ");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(signals_have_their_handlers_back),
        cmocka_unit_test(a_later_signal_ends_the_process),
        cmocka_unit_test(a_later_signal_goes_to_the_host),
        cmocka_unit_test(a_shell_takes_a_text_for_one_word),
        cmocka_unit_test(a_rotation_has_nine_numbers),
        cmocka_unit_test(first_cause_wins),
        cmocka_unit_test(exit_codes),
        cmocka_unit_test(memory_is_aligned_and_zeroed),
        cmocka_unit_test(memory_sizes_are_checked),
        cmocka_unit_test(memory_fails_on_demand),
        cmocka_unit_test(memory_reserve_grows_and_keeps),
        cmocka_unit_test(philox_known_answers),
        cmocka_unit_test(random_numbers_have_their_moments),
        cmocka_unit_test_setup_teardown(files_come_back, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(private_files_stay_private, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(failed_writes_leave_nothing, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(places_are_looked_at, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(streams_are_not_replaced, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(full_disk_keeps_the_old_file, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(reads_refuse_what_is_no_file, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(ends_tell_files_apart, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(folders_and_names, folder_make, folder_remove),
        cmocka_unit_test(gaussians_resize_pad_zero),
        cmocka_unit_test(image_sizes),
        cmocka_unit_test(blocks_cover_once),
        cmocka_unit_test(blocks_are_accounted),
        cmocka_unit_test(denormals_are_kept),
        cmocka_unit_test(instruction_sets_only_go_down),
        cmocka_unit_test(rotations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
