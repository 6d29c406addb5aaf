/* SPDX-License-Identifier: Apache-2.0 */
/* render/video.c -- write pictures into a film by running ffmpeg. */
#include "render/video.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/large_file.h"
#include "base/memory.h"

enum { ARGUMENTS_MAX = 48 };

/* By default ffmpeg converts to YUV by BT.601 without recording it in the file; players then assume BT.709.
 */
#define AS_BT709                                                                                             \
    "-vf", "scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709", "-color_primaries", "bt709", \
        "-color_trc", "bt709", "-color_range", "tv"

/* ffmpeg's options by file type. -f is needed because the temporary file's name does not end in the type. */
static const struct {
    const char *ending, *options[24];
} kinds[] = {
    {".mp4",
     {"-c:v", "libx264", "-preset", "medium", "-crf", "18", "-pix_fmt", "yuv420p", AS_BT709, "-movflags",
      "+faststart", "-f", "mp4"}},
    {".webm",
     {"-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "28", "-row-mt", "1", "-pix_fmt", "yuv420p", AS_BT709, "-f",
      "webm"}},
    {".gif", /* a palette per picture: one for the whole film would make ffmpeg keep all pictures in memory */
     {"-filter_complex", "[0:v]split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1",
      "-loop", "0", "-f", "gif"}},
};
enum { KINDS = sizeof kinds / sizeof *kinds };

struct video {
    large_file film; /* ffmpeg opens it by its temporary name */
    int width, height;
    int pictures;       /* socket to ffmpeg's standard input; -1: closed */
    FILE *complaints;   /* ffmpeg's error output */
    pid_t process;      /* 0: none */
    unsigned char *row; /* one picture, [height][width][3] */
};

static int kind_of(const char *path)
{
    int i = 0;
    while (i < KINDS && !file_ends_with(path, kinds[i].ending))
        i++;
    return i;
}

bool video_named(const char *path) { return kind_of(path) < KINDS; }

gbt_status video_check_name(const char *path, gbt_error *err)
{
    static const char *const others[] = {".mov", ".m4v", ".mkv", ".avi", ".mpg", ".mpeg", ".wmv", ".ogv"};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (file_ends_with(path, others[i]))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "%s: this type of film cannot be written (wanted .mp4, .webm, .gif or a folder)",
                             path);
    static const char *const pictures[] = {".png", ".jpg", ".jpeg", ".exr"};
    for (size_t i = 0; i < sizeof pictures / sizeof *pictures; i++)
        if (file_ends_with(path, pictures[i]))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "%s: wanted a folder (the picture is named after its camera or view)", path);
    return GBT_OK;
}

enum { NOT_STARTED = 127 }; /* exit code of a process whose program could not be started (POSIX) */

static gbt_status missing(const video *v, gbt_error *err)
{
    return base_fail(
        err, GBT_ERR_IO,
        "%s: a film needs the program ffmpeg, which is not installed (install it: apt install ffmpeg, "
        "or give a folder for pictures)",
        v->film.name);
}

/** posix_spawnp() with a socket as standard input: writing to a pipe after ffmpeg has ended early would raise
    SIGPIPE in the whole process. */
static gbt_status start(video *v, char *const *arguments, gbt_error *err)
{
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return base_fail(err, GBT_ERR_IO, "%s: no socket: %s", v->film.name, strerror(errno));
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, fileno(v->complaints), STDERR_FILENO);
    const int code = posix_spawnp(&v->process, "ffmpeg", &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    v->pictures = ends[0];
    if (code == 0)
        return GBT_OK;
    v->process = 0;
    if (code == ENOENT)
        return missing(v, err);
    return base_fail(err, GBT_ERR_IO, "%s: ffmpeg does not start: %s", v->film.name, strerror(code));
}

static gbt_status prepare(video *v, const char *path, int width, int height, double fps, gbt_error *err)
{
    const int kind = kind_of(path);
    if (kind == KINDS)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: not the name of a film (wanted .mp4, .webm or .gif)",
                         path);
    const bool gif = strcmp(kinds[kind].ending, ".gif") == 0;
    if (gif && fps > 50) /* players treat its shortest delay, 1/100 s, as a long one */
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: %g frames per second (wanted at most 50 in a .gif)",
                         path, fps);
    if (!gif && (width % 2 != 0 || height % 2 != 0))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "%s: %d x %d pixels (wanted even numbers: films keep colours for 2 x 2 pixels)",
                         path, width, height);
    struct sigaction now;
    if (sigaction(SIGCHLD, NULL, &now) == 0 && now.sa_handler == SIG_IGN)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "%s: SIGCHLD is ignored, so the exit status of ffmpeg would be lost (wanted SIG_DFL)", path);
    GBT_TRY(large_file_create(path, &v->film, err));
    v->width = width;
    v->height = height;
    v->row = mem_alloc((size_t)width * (size_t)height, 3, "film", err);
    v->complaints = tmpfile();
    if (v->row == NULL)
        return GBT_ERR_NO_MEMORY;
    if (v->complaints == NULL)
        return base_fail(err, GBT_ERR_IO, "%s: no temporary file: %s", path, strerror(errno));
    const char *made =
        v->film.temporary[0] != '\0' ? v->film.temporary : path; /* streams have no temporary file */
    char name[LARGE_FILE_NAME + 2], size[32], rate[32];
    /* "./" keeps ffmpeg from reading a leading dash as an option, or text before a colon as a protocol. */
    snprintf(name, sizeof name, "%s%s", made[0] == '/' ? "" : "./", made);
    snprintf(size, sizeof size, "%dx%d", width, height);
    snprintf(rate, sizeof rate, "%.6g", fps);
    const char *head[] = {"ffmpeg", "-hide_banner", "-nostdin", "-loglevel", "error", "-y",
                          "-f",     "rawvideo",     "-pix_fmt", "rgb24",     "-s",    size,
                          "-r",     rate,           "-i",       "pipe:0",    "-an"};
    char *arguments[ARGUMENTS_MAX];
    size_t count = 0;
    for (size_t i = 0; i < sizeof head / sizeof *head; i++)
        arguments[count++] = (char *)head[i];
    for (size_t i = 0; kinds[kind].options[i] != NULL; i++)
        arguments[count++] = (char *)kinds[kind].options[i];
    arguments[count++] = name;
    arguments[count] = NULL;
    return start(v, arguments, err);
}

gbt_status video_open(const char *path, int width, int height, double fps, video **out, gbt_error *err)
{
    *out = NULL;
    video *v = mem_calloc(1, sizeof *v, "film", err);
    if (v == NULL)
        return GBT_ERR_NO_MEMORY;
    v->pictures = -1;
    const gbt_status status = prepare(v, path, width, height, fps, err);
    if (status != GBT_OK) {
        gbt_error ignored = {0};
        video_close(v, false, &ignored);
        return status;
    }
    *out = v;
    return GBT_OK;
}

/** Close the socket and wait for ffmpeg. Returns the exit code, or 128 plus the signal number. */
static int finish(video *v)
{
    int state = 0;
    if (v->pictures >= 0)
        close(v->pictures);
    v->pictures = -1;
    if (v->process == 0)
        return 0;
    while (waitpid(v->process, &state, 0) < 0)
        if (errno != EINTR) { /* its exit status is unknown */
            state = 255 << 8;
            break;
        }
    v->process = 0;
    return WIFEXITED(state) ? WEXITSTATUS(state) : 128 + (WIFSIGNALED(state) ? WTERMSIG(state) : 0);
}

static gbt_status failed(video *v, int code, gbt_error *err)
{
    char line[200], last[200] = "no output";
    if (code == NOT_STARTED) /* where posix_spawnp() itself cannot report it */
        return missing(v, err);
    rewind(v->complaints);
    while (fgets(line, sizeof line, v->complaints) != NULL) {
        line[strcspn(line, "\r\n")] = '\0';
        if (line[0] != '\0')
            memcpy(last, line, sizeof last);
    }
    return base_fail(err, GBT_ERR_IO, "%s: ffmpeg failed (code %d): %s", v->film.name, code, last);
}

gbt_status video_add(video *v, const image *picture, gbt_error *err)
{
    if (picture->width != v->width || picture->height != v->height || picture->channels != 3)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: a picture of %d x %d (wanted %d x %d)", v->film.name,
                         picture->width, picture->height, v->width, v->height);
    const size_t count = 3 * (size_t)v->width * (size_t)v->height;
    for (size_t i = 0; i < count; i++) {
        const float value = picture->pixels[i];
        v->row[i] =
            value > 0.0f ? (unsigned char)(fminf(value, 1.0f) * 255.0f + 0.5f) : 0; /* NaN becomes 0 */
    }
    for (size_t done = 0; done < count;) {
        const ssize_t put = send(v->pictures, v->row + done, count - done, MSG_NOSIGNAL);
        if (put < 0 && errno == EINTR)
            continue;
        if (put <= 0)
            return failed(v, finish(v), err);
        done += (size_t)put;
    }
    return GBT_OK;
}

gbt_status video_close(video *v, bool keep, gbt_error *err)
{
    if (v == NULL)
        return GBT_OK;
    if (!keep && v->process != 0)
        kill(v->process, SIGKILL);
    const int code = finish(v);
    const gbt_status status = keep && code != 0 ? failed(v, code, err) : GBT_OK,
                     closed = large_file_close(&v->film, keep && status == GBT_OK, err);
    if (v->complaints != NULL)
        fclose(v->complaints);
    mem_free(v->row);
    mem_free(v);
    return status == GBT_OK ? closed : status;
}
