/* SPDX-License-Identifier: Apache-2.0 */
/* tests/view/test_request.c -- queries to requests: every word's range. */
#include "test_support.h"

#include "view/request.h"

/* A query is a list of names and values. */
static const char *word_in(void *query, const char *name)
{
    const char *const *words = query;
    for (; words[0] != NULL; words += 2)
        if (strcmp(words[0], name) == 0)
            return words[1];
    return NULL;
}

#define POSE "\"origin\":[1,2,3],\"target\":[1,2,9],\"up\":[0,-1,0]"
#define CAMERA(more) "{" POSE ",\"width\":64,\"height\":48" more "}"
#define PINHOLE CAMERA(",\"fov_x_deg\":90")

typedef struct request_case {
    const char *name, *path, *query[14], *says; /* says: in the message; NULL: it is a good one */
} request_case;

static request_case cases[] = {
    {"scene", "/scene", {NULL}, NULL},
    {"camera", "/render", {"camera", PINHOLE}, NULL},
    {"view", "/render", {"view", "3"}, NULL},
    {"view of a size", "/render", {"view", "3", "width", "40", "height", "30"}, NULL},
    {"everything",
     "/render",
     {"camera", PINHOLE, "format", "float", "output", "normal", "preset", "exact", "sample", "7"},
     NULL},
    {"splats",
     "/render",
     {"camera", PINHOLE, "renderer", "per-ray", "format", "jpeg", "quality", "1", "output", "color"},
     NULL},
    {"background", "/render", {"view", "0", "background", "00ff7a"}, NULL},
    {"background of a name",
     "/render",
     {"view", "0", "background", "white"},
     "background: \"white\" (wanted six digits"},
    {"background with a tail", "/render", {"view", "0", "background", "00ff7a0"}, "background: \"00ff7a0\""},
    {"pick", "/pick", {"camera", PINHOLE, "x", "63.5", "y", "0"}, NULL},
    {"photo", "/photo", {"view", "0", "format", "png"}, NULL},
    {"largest", "/render", {"view", "0", "width", "8192", "height", "1024"}, NULL},

    {"no such path", "/rendr", {NULL}, "/rendr: not here"},
    {"up and away", "/../etc/passwd", {NULL}, "not here"},
    {"no camera", "/render", {NULL}, "wanted either camera=JSON or view=NUMBER"},
    {"two cameras", "/render", {"view", "0", "camera", PINHOLE}, "wanted either"},
    {"no such view", "/render", {"view", "-1"}, "view: \"-1\" (wanted a number from 0"},
    {"half a view", "/render", {"view", "1.5"}, "view: 1.5 (wanted a whole number)"},
    {"view that is no number", "/render", {"view", "nan"}, "view: \"nan\""},
    {"view beyond int", "/render", {"view", "1e300"}, "view: \"1e300\""},
    {"view with a tail", "/render", {"view", "1;ls"}, "view: \"1;ls\""},
    {"empty view", "/render", {"view", ""}, "view: \"\""},
    {"width alone", "/render", {"view", "0", "width", "64"}, "wanted width and height"},
    {"no pixels", "/render", {"view", "0", "width", "0", "height", "64"}, "width: \"0\""},
    {"too wide", "/render", {"view", "0", "width", "8193", "height", "1"}, "width: \"8193\""},
    {"too many pixels",
     "/render",
     {"view", "0", "width", "8192", "height", "1025"},
     "at most 8388608 pixels"},
    {"camera too wide",
     "/render",
     {"camera", "{" POSE ",\"fov_x_deg\":9,\"width\":65000,\"height\":1}"},
     "sides of at most 8192"},
    {"camera and width",
     "/render",
     {"camera", PINHOLE, "width", "8", "height", "8"},
     "the camera gives its own"},
    {"not JSON", "/render", {"camera", "{"}, "camera:1: not usable JSON"},
    {"a list", "/render", {"camera", "[]"}, "camera: wanted a JSON object"},
    {"unknown field", "/render", {"camera", CAMERA(",\"fov\":3")}, "fov: unknown field"},
    {"no field of view", "/render", {"camera", CAMERA("")}, "camera: fov_x_deg: missing"},
    {"NaN", "/render", {"camera", CAMERA(",\"fov_x_deg\":NaN")}, "not usable JSON"},
    {"a file of rays",
     "/render",
     {"camera", "{\"rays\":\"/etc/passwd\"}"},
     "camera: rays: only a camera file can name them"},
    {"an aperture",
     "/render",
     {"camera", CAMERA(",\"fov_x_deg\":90,\"aperture\":1,\"focus\":2,\"samples\":65536")},
     "needs gbtrace render"},
    {"a rolling shutter",
     "/render",
     {"camera", CAMERA(",\"fov_x_deg\":90,\"end\":{\"origin\":[1,2,4]}")},
     "needs gbtrace render"},
    {"format", "/render", {"view", "0", "format", "exr"}, "format: \"exr\" (wanted raw, jpeg, png or float)"},
    {"preset", "/render", {"view", "0", "preset", ""}, "preset: \"\" (wanted exact, default or fast)"},
    {"renderer", "/render", {"view", "0", "renderer", "reference"}, "renderer: \"reference\""},
    {"output", "/render", {"view", "0", "output", "dept", "format", "float"}, "\"dept\""},
    {"two outputs",
     "/render",
     {"view", "0", "output", "depth,hits", "format", "float"},
     "output: \"depth,hits\" (wanted a single output)"},
    {"output as bytes", "/render", {"view", "0", "output", "depth"}, "the format float"},
    {"output of splats",
     "/render",
     {"view", "0", "output", "depth", "format", "float", "renderer", "raster"},
     "needs the renderer trace"},
    {"quality", "/render", {"view", "0", "quality", "101"}, "quality: \"101\""},
    {"sample", "/render", {"view", "0", "sample", "4097"}, "sample: \"4097\""},
    {"nothing to pick", "/pick", {"view", "0", "x", "1"}, "wanted x and y"},
    {"pick beyond", "/pick", {"view", "0", "x", "1", "y", "-0.5"}, "y: \"-0.5\""},
    {"photo of a camera", "/photo", {"camera", PINHOLE}, "wanted view=NUMBER"},
};

static void parses(void **state)
{
    request_case *c = *state;
    request r;
    gbt_error err = {0};
    const gbt_status status = request_parse(c->path, word_in, (void *)c->query, &r, &err);
    if ((status == GBT_OK) != (c->says == NULL) || (c->says != NULL && strstr(err.text, c->says) == NULL))
        fail_msg("wanted \"%s\", got status %d: %s", c->says != NULL ? c->says : "no error", (int)status,
                 err.text);
}

static void all_words_arrive(void **state)
{
    (void)state;
    request r;
    const char *const picture[] = {"camera", PINHOLE, "format", "float", "output", "normal",
                                   "preset", "fast",  "sample", "7",     NULL};
    assert_ok(request_parse("/render", word_in, (void *)picture, &r, NULL));
    assert_true(r.kind == REQUEST_RENDER && r.view == -1 && r.format == REQUEST_FLOAT &&
                r.renderer == GBT_RENDERER_TRACE && r.output == 8 && r.sample == 7);
    assert_int_equal(r.preset, GBT_PRESET_FAST);
    assert_true(r.camera.width == 64 && r.camera.height == 48 && r.camera.center[2] == 3);
    const char *const colored[] = {"view", "0", "background", "00ff33", NULL};
    assert_ok(request_parse("/render", word_in, (void *)colored, &r, NULL));
    assert_true(r.has_background && r.background[0] == 0 && r.background[1] == 1 &&
                fabsf(r.background[2] - 0.2f) < 1e-6f);
    const char *const pick[] = {"view", "4", "width", "40", "height", "30", "x", "1.5", "y", "2", NULL};
    assert_ok(request_parse("/pick", word_in, (void *)pick, &r, NULL));
    assert_true(r.kind == REQUEST_PICK && r.view == 4 && r.width == 40 && r.height == 30 &&
                r.pixel[0] == 1.5 && r.pixel[1] == 2);
    const char *const plain[] = {"view", "0", NULL};
    assert_ok(request_parse("/render", word_in, (void *)plain, &r, NULL));
    assert_true(r.width == 0 && r.output == 0 && r.sample == 0 && r.format == REQUEST_RAW &&
                !r.has_background && r.preset == GBT_PRESET_DEFAULT);
}

int main(void)
{
    enum { CASES = sizeof cases / sizeof *cases };
    struct CMUnitTest tests[CASES + 1] = {cmocka_unit_test(all_words_arrive)};
    for (size_t i = 0; i < CASES; i++)
        tests[i + 1] =
            (struct CMUnitTest){.name = cases[i].name, .test_func = parses, .initial_state = &cases[i]};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
