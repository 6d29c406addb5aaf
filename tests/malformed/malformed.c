/* SPDX-License-Identifier: Apache-2.0 */
/* tests/malformed/malformed.c -- every row of cases.txt: a good input is spoiled, the program is run on it,
   and its exit code, its one line and what it leaves behind are looked at.

   usage: malformed PROGRAM CASES [NAME]: all rows, or those whose name begins with NAME. cases.txt says what
   its columns are. */
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <zlib.h>

enum { WORDS_MAX = 40, PATH_MAX_BYTES = 512, OUTPUT_BYTES = 1 << 16 };

static char work[PATH_MAX_BYTES], program[4096];

static void die(const char *what, const char *why)
{
    fprintf(stderr, "malformed: %s: %s\n", what, why);
    exit(1);
}

/* ---- programs ---- */

/* Run in `folder`; what it says goes to `out`. The exit code, or 128 + the signal. */
static int run(const char *folder, char *const words[], char out[OUTPUT_BYTES])
{
    int both[2], state;
    if (pipe(both) != 0)
        die("pipe", strerror(errno));
    const pid_t child = fork();
    if (child == 0) {
        const int nothing = open("/dev/null", O_RDONLY);
        if (chdir(folder) != 0)
            _exit(127);
        dup2(nothing, 0);
        dup2(both[1], 1);
        dup2(both[1], 2);
        close(both[0]);
        close(both[1]);
        execvp(words[0], words);
        _exit(127);
    }
    close(both[1]);
    size_t used = 0;
    char rest[4096];
    for (ssize_t got; (got = read(both[0], used < OUTPUT_BYTES - 1 ? out + used : rest,
                                  used < OUTPUT_BYTES - 1 ? OUTPUT_BYTES - 1 - used : sizeof rest)) > 0;)
        used += used < OUTPUT_BYTES - 1 ? (size_t)got : 0;
    out[used] = '\0';
    close(both[0]);
    waitpid(child, &state, 0);
    return WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
}

/* Cut at blanks, in place. */
static int split(char *text, char *words[WORDS_MAX])
{
    int count = 0;
    for (char *rest = NULL, *word = strtok_r(text, " ", &rest); word != NULL && count < WORDS_MAX - 1;
         word = strtok_r(NULL, " ", &rest))
        words[count++] = word;
    words[count] = NULL;
    return count;
}

static int run_line(const char *folder, const char *line, char out[OUTPUT_BYTES])
{
    char copy[4096], *words[WORDS_MAX];
    snprintf(copy, sizeof copy, "%s", line);
    if (split(copy, words) == 0)
        die(line, "no command");
    if (strcmp(words[0], "gbtrace") == 0)
        words[0] = program;
    return run(folder, words, out);
}

static void must_run(const char *line)
{
    static char out[OUTPUT_BYTES];
    const int code = run_line(work, line, out);
    if (code != 0)
        die(line, out);
}

/* ---- files ---- */

typedef struct bytes {
    unsigned char *at;
    size_t count;
} bytes;

static bytes load(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        die(path, strerror(errno));
    fseek(file, 0, SEEK_END);
    bytes b = {.count = (size_t)ftell(file)};
    rewind(file);
    b.at = calloc(1, b.count + 1);
    if (fread(b.at, 1, b.count, file) != b.count)
        die(path, "cannot be read");
    fclose(file);
    return b;
}

static void save(const char *path, const void *at, size_t count)
{
    FILE *file = fopen(path, "wb");
    if (file == NULL || fwrite(at, 1, count, file) != count || fclose(file) != 0)
        die(path, "cannot be written");
}

/* \n, \t, \s (blank), \p (bar), \e (semicolon), \\ and \xHH, in place; the length. */
static size_t unescape(char *text)
{
    char *to = text;
    for (const char *from = text; *from != '\0'; from++) {
        if (*from != '\\') {
            *to++ = *from;
            continue;
        }
        from++;
        const char *const names = "ntspe\\", *found = strchr(names, *from);
        if (*from == 'x') {
            const char digits[3] = {from[1], from[2], '\0'};
            *to++ = (char)strtol(digits, NULL, 16);
            from += 2;
        } else if (found != NULL && *from != '\0') {
            *to++ = "\n\t |;\\"[found - names];
        } else {
            die(text, "unknown escape");
        }
    }
    return (size_t)(to - text);
}

static void put_number(unsigned char *at, const char *type, const char *text)
{
    if (strcmp(type, "f64") == 0) {
        const double value = strtod(text, NULL);
        memcpy(at, &value, sizeof value);
    } else if (strcmp(type, "f32") == 0) {
        const float value = strtof(text, NULL);
        memcpy(at, &value, sizeof value);
    } else {
        const uint64_t value = text[0] == '-' ? (uint64_t)strtoll(text, NULL, 0) : strtoull(text, NULL, 0);
        memcpy(at, &value, (size_t)atoi(type + 1) / 8); /* little endian, as all that this is built for */
    }
}

static size_t type_bytes(const char *type) { return (size_t)atoi(type + 1) / 8; }

static void put_big(unsigned char *at, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (unsigned char)(value >> (24 - 8 * i));
}

/* A PNG of any stated size, whose pixels are one zero byte. */
static void write_png(const char *path, uint32_t width, uint32_t height)
{
    static const unsigned char magic[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'},
                               pixels[9] = {0x78, 0x9c, 0x63, 0x00, 0x00, 0x00, 0x01, 0x00, 0x01};
    unsigned char file[256], head[13] = {[8] = 8, [9] = 2};
    put_big(head, width);
    put_big(head + 4, height);
    const struct {
        const char *type;
        const unsigned char *body;
        uint32_t count;
    } chunks[] = {{"IHDR", head, sizeof head}, {"IDAT", pixels, sizeof pixels}, {"IEND", NULL, 0}};
    size_t used = sizeof magic;
    memcpy(file, magic, sizeof magic);
    for (size_t i = 0; i < 3; i++) {
        unsigned char *chunk = file + used;
        put_big(chunk, chunks[i].count);
        memcpy(chunk + 4, chunks[i].type, 4);
        if (chunks[i].count > 0)
            memcpy(chunk + 8, chunks[i].body, chunks[i].count);
        put_big(chunk + 8 + chunks[i].count, (uint32_t)crc32(0, chunk + 4, chunks[i].count + 4));
        used += 12 + chunks[i].count;
    }
    save(path, file, used);
}

/* ---- edits ---- */

static size_t place(const bytes *b, const char *text)
{
    const long long at = strtoll(text, NULL, 0);
    const long long from_start = at < 0 ? (long long)b->count + at : at;
    if (from_start < 0 || from_start > (long long)b->count)
        die(text, "not in the file");
    return (size_t)from_start;
}

static void swap_text(bytes *b, char *old, char *fresh)
{
    const size_t old_count = unescape(old), fresh_count = unescape(fresh);
    unsigned char *found = memmem(b->at, b->count, old, old_count);
    if (found == NULL)
        die(old, "not in the file");
    const size_t before = (size_t)(found - b->at), behind = b->count - before - old_count;
    unsigned char *made = malloc(before + fresh_count + behind + 1);
    memcpy(made, b->at, before);
    memcpy(made + before, fresh, fresh_count);
    memcpy(made + before + fresh_count, found + old_count, behind);
    free(b->at);
    *b = (bytes){made, before + fresh_count + behind};
}

static void edit(const char *folder, char *line)
{
    char copy[4096], path[2 * PATH_MAX_BYTES], *w[WORDS_MAX];
    snprintf(copy, sizeof copy, "%s", line);
    const int count = split(copy, w);
    if (count < 2)
        die(line, "wanted an edit and a file");
    w[1][unescape(w[1])] = '\0';
    snprintf(path, sizeof path, "%s/%s", folder, w[1]);
    if (strcmp(w[0], "remove") == 0)
        unlink(path);
    else if (strcmp(w[0], "folder") == 0)
        mkdir(path, 0777);
    else if (strcmp(w[0], "fifo") == 0)
        mkfifo(path, 0666);
    else if (strcmp(w[0], "link") == 0 && count == 3) {
        if (symlink(w[2], path) != 0)
            die(line, strerror(errno));
    } else if (strcmp(w[0], "copy") == 0 && count == 3) {
        char from[2 * PATH_MAX_BYTES];
        snprintf(from, sizeof from, "%s/%s", folder, w[2]);
        const bytes b = load(from);
        save(path, b.at, b.count);
        free(b.at);
    } else if (strcmp(w[0], "write") == 0)
        save(path, count > 2 ? w[2] : "", count > 2 ? unescape(w[2]) : 0);
    else if (strcmp(w[0], "png") == 0 && count == 4)
        write_png(path, (uint32_t)strtoul(w[2], NULL, 0), (uint32_t)strtoul(w[3], NULL, 0));
    else if (strcmp(w[0], "repeat") == 0 && count == 4) {
        FILE *file = fopen(path, "ab");
        const size_t length = unescape(w[2]);
        for (long i = 0; i < atol(w[3]); i++)
            fwrite(w[2], 1, length, file);
        fclose(file);
    } else if (strcmp(w[0], "size") == 0 && count == 3) { /* longer ones get a hole at their end */
        bytes b = {0};
        if (w[2][0] == '-')
            b = load(path);
        const off_t size = w[2][0] == '-' ? (off_t)place(&b, w[2]) : (off_t)strtoll(w[2], NULL, 0);
        free(b.at);
        const int fd = open(path, O_WRONLY | O_CREAT, 0666);
        if (fd < 0 || ftruncate(fd, size) != 0 || close(fd) != 0)
            die(line, strerror(errno));
    } else {
        bytes b = load(path);
        if (strcmp(w[0], "put") == 0 && count == 5 && place(&b, w[2]) + type_bytes(w[3]) <= b.count)
            put_number(b.at + place(&b, w[2]), w[3], w[4]);
        else if (strcmp(w[0], "swap") == 0 && (count == 4 || count == 3))
            swap_text(&b, w[2], count == 4 ? w[3] : w[2] + strlen(w[2]));
        else
            die(line, "no such edit");
        save(path, b.at, b.count);
        free(b.at);
    }
}

/* ---- what is left behind ---- */

static size_t file_count, temporary_count;

static int count_entry(const char *path, const struct stat *info, int kind, struct FTW *walk)
{
    (void)kind;
    const size_t length = strlen(path);
    if (!S_ISDIR(info->st_mode))
        file_count++;
    temporary_count += length > 4 && strcmp(path + length - 4, ".tmp") == 0 && path[walk->base] == '.';
    return 0;
}

static void count_files(const char *folder)
{
    file_count = temporary_count = 0;
    nftw(folder, count_entry, 16, FTW_PHYS);
}

/* ---- rows ---- */

typedef struct row {
    char *name, *base, *edits, *command, *code, *words;
} row;

static char *trim(char *text)
{
    while (*text == ' ')
        text++;
    for (size_t n = strlen(text); n > 0 && (text[n - 1] == ' ' || text[n - 1] == '\n'); n--)
        text[n - 1] = '\0';
    return text;
}

static bool take_row(char *line, row *out)
{
    char **fields[] = {&out->name, &out->base, &out->edits, &out->command, &out->code, &out->words};
    if (line[0] == '#' || trim(line)[0] == '\0')
        return false;
    for (size_t i = 0; i < 6; i++) {
        char *field = strsep(&line, "|");
        if (field == NULL)
            die(out->name, "wanted six columns");
        *fields[i] = trim(field);
    }
    return true;
}

/* One line that begins by "error: " beside warnings and progress, when it failed; all `words` in what it
 * said. */
static const char *judge(const row *r, int code, char *said, bool left)
{
    size_t errors = 0;
    if (code != atoi(r->code))
        return "another exit code";
    for (const char *line = said; line != NULL && *line != '\0'; line = strchr(line, '\n')) {
        line += *line == '\n';
        errors += strncmp(line, "error: ", 7) == 0;
    }
    if (errors != (code != 0))
        return "not one line with an error";
    char words[1024];
    snprintf(words, sizeof words, "%s", r->words);
    for (char *rest = words, *word; (word = strsep(&rest, ";")) != NULL;)
        if (strstr(said, trim(word)) == NULL)
            return "words are missing in what it said";
    return left ? "it left files behind" : NULL;
}

static bool run_row(const row *r, bool show)
{
    static char said[OUTPUT_BYTES];
    char folder[PATH_MAX_BYTES + 8], from[PATH_MAX_BYTES + 64], edits[4096];
    snprintf(folder, sizeof folder, "%s/case", work);
    snprintf(from, sizeof from, "cp -R %s %s", r->base, folder);
    must_run(from);
    snprintf(edits, sizeof edits, "%s", r->edits);
    for (char *rest = edits, *one; (one = strsep(&rest, ";")) != NULL;)
        if (trim(one)[0] != '\0')
            edit(folder, trim(one));
    count_files(folder);
    const size_t before = file_count;
    const int code = run_line(folder, r->command, said);
    count_files(folder);
    const char *why = judge(r, code, said, temporary_count > 0 || (code != 0 && file_count != before));
    if (why != NULL)
        printf("FAILED  %s: %s (wanted %s and \"%s\", got %d and %zu files for %zu)\n%.2000s", r->name, why,
               r->code, r->words, code, file_count, before, said);
    else if (show)
        printf("%s: %d %.600s", r->name, code, said);
    must_run("rm -rf case");
    return why == NULL;
}

int main(int count, char **arguments)
{
    static char line[8192];
    const char *root = getenv("TMPDIR");
    if (count < 3 || realpath(arguments[1], program) == NULL)
        die("usage", "malformed PROGRAM CASES [NAME]");
    snprintf(work, sizeof work, "%s/gbt_malformed_XXXXXX", root != NULL ? root : "/tmp");
    FILE *cases = fopen(arguments[2], "r");
    if (cases == NULL || mkdtemp(work) == NULL)
        die(arguments[2], strerror(errno));
    size_t failed = 0, done = 0;
    while (fgets(line, sizeof line, cases) != NULL) {
        row r = {0};
        if (strncmp(line, "make ", 5) == 0) {
            must_run(trim(line + 5));
            continue;
        }
        if (strncmp(line, "edit ", 5) == 0) { /* of a good input: once, before the rows */
            edit(work, trim(line + 5));
            continue;
        }
        if (!take_row(line, &r) || (count > 3 && strncmp(r.name, arguments[3], strlen(arguments[3])) != 0))
            continue;
        failed += !run_row(&r, count > 3);
        done++;
    }
    fclose(cases);
    snprintf(line, sizeof line, "rm -rf %s", work);
    must_run(line);
    printf("%zu inputs, %zu failed\n", done, failed);
    return failed > 0;
}
