/* SPDX-License-Identifier: Apache-2.0 */
/* tests/render/test_insert.c -- meshes among Gaussians: occlusion, mirrors and shadows against the double
   reference. */
#include "base/memory.h"
#include "base/near.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"
#include "render/insert.h"
#include "trace/footprint.h"
#include "trace/reference.h"

enum { W = 40, H = 24, COUNT = 300 };

static const float background[3] = {0.9f, 0.2f, 0.6f};

/* Gaussians in a box, half of them almost opaque. */
static gaussians cloud(uint64_t seed, const double low[3], const double high[3])
{
    gaussians g = {0};
    assert_ok(gaussians_resize(&g, COUNT, NULL));
    for (size_t i = 0; i < COUNT; i++) {
        double value[14];
        for (uint64_t k = 0; k < 14; k++)
            value[k] = (double)rng_uniform(seed, k, i);
        g.mean_x[i] = (float)(low[0] + value[0] * (high[0] - low[0]));
        g.mean_y[i] = (float)(low[1] + value[1] * (high[1] - low[1]));
        g.mean_z[i] = (float)(low[2] + value[2] * (high[2] - low[2]));
        g.scale_x[i] = (float)(0.05 + 0.3 * value[3]), g.scale_y[i] = (float)(0.05 + 0.3 * value[4]),
        g.scale_z[i] = (float)(0.05 + 0.3 * value[5]);
        const double length = sqrt(value[6] * value[6] + value[7] * value[7] + value[8] * value[8] + 1);
        g.quat_w[i] = (float)(1 / length);
        g.quat_x[i] = (float)(value[6] / length);
        g.quat_y[i] = (float)(value[7] / length);
        g.quat_z[i] = (float)(value[8] / length);
        g.opacity[i] = (float)(i % 2 == 0 ? 0.95 : 0.3 * value[9]);
        g.red[i] = (float)value[10];
        g.green[i] = (float)value[11];
        g.blue[i] = (float)value[12];
    }
    gaussians_pad(&g);
    return g;
}

/* A pinhole at the origin of the world that looks along z. */
static gbt_camera pinhole(double focal)
{
    return (gbt_camera){.model = GBT_CAMERA_PINHOLE,
                        .width = W,
                        .height = H,
                        .params = {focal, focal, 0.5 * W, 0.5 * H},
                        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

static ray_image look(void)
{
    const gbt_camera camera = pinhole(30);
    ray_image rays = {0};
    assert_ok(ray_image_from_camera(&camera, &rays, NULL));
    return rays;
}

static const insert_object matt = {.material = INSERT_MATT, .color = {0.25f, 0.5f, 1}};
static const insert_object mirror = {.material = INSERT_MIRROR, .color = {0.5f, 1, 0.25f}};

/* The part left of x = right of the plane z = depth, from -half on. */
static void add_rectangle(insert_scene *in, const insert_object *object, float depth, float right, float half)
{
    const float vertices[12] = {-half, -half, depth, right, -half, depth,
                                right, half,  depth, -half, half,  depth};
    const uint32_t triangles[6] = {0, 1, 2, 2, 3, 0};
    assert_ok(insert_add(in, object, vertices, 4, triangles, 2, NULL));
}

static void add_plane(insert_scene *in, const insert_object *object, float depth, float right)
{
    add_rectangle(in, object, depth, right, 99);
}

typedef struct studio {
    gaussians g;
    trace_settings settings;
    trace_scene scene;
    ray_image rays;
    image rgb;
} studio;

/* A cloud with z from `near` to `far`. */
static studio open_studio(uint64_t seed, double near, double far)
{
    studio st = {.g = cloud(seed, (const double[3]){-2, -1.5, near}, (const double[3]){2, 1.5, far}),
                 .settings = trace_settings_default(),
                 .rays = look()};
    memcpy(st.settings.background, background, sizeof background);
    assert_ok(image_alloc(&st.rgb, W, H, 3, NULL));
    return st;
}

static void shoot(studio *st, insert_scene *in)
{
    assert_ok(insert_finish(in, NULL));
    assert_ok(trace_build(&st->scene, &st->g, &st->settings, in->reach, NULL));
    assert_ok(insert_trace(in, &st->scene, &st->rays, &st->rgb, NULL));
    assert_memory_equal(st->scene.settings.background, background, sizeof background);
}

static void close_studio(studio *st, insert_scene *in)
{
    gaussians_free(&st->g);
    trace_scene_free(&st->scene);
    ray_image_free(&st->rays);
    image_free(&st->rgb);
    insert_scene_free(in);
}

/* Colour without a background, and what is left. */
static void reference(const studio *st, const ray_image *rays, double *rgb, double *transmittance)
{
    trace_settings black = st->settings;
    memset(black.background, 0, sizeof black.background);
    assert_ok(reference_forward(&st->g, &black, rays, rgb, transmittance, NULL, NULL));
}

static float *plane_distance(const ray_image *rays, float depth, float right)
{
    float *far = mem_alloc(W * H, sizeof *far, "far", NULL);
    for (size_t i = 0; i < W * H; i++) {
        const float t = depth / rays->dir[3 * i + 2];
        far[i] = t * rays->dir[3 * i] < right ? t : INFINITY;
    }
    return far;
}

static struct plane_case {
    const char *name;
    float depth, right;
    int hidden; /* 1: all Gaussians are behind it; -1: none */
} plane_cases[] = {
    {"a plane in front of the cloud", 1, 99, 1},
    {"a plane in the cloud", 5, 99, 0},
    {"a plane behind the cloud", 9, 99, -1},
    {"half a plane in the cloud", 4.5f, 0.3f, 0},
};

static void occlusion(void **state)
{
    const struct plane_case *c = *state;
    for (uint64_t seed = 0; seed < 5; seed++) {
        insert_scene in = {.ambient = 1};
        studio st = open_studio(seed, 3, 7);
        add_plane(&in, &matt, c->depth, c->right);
        shoot(&st, &in);
        double rgb[3 * W * H], left[W * H];
        st.rays.far = plane_distance(&st.rays, c->depth, c->right);
        reference(&st, &st.rays, rgb, left);
        double seen = 0, hidden = 0;
        for (size_t i = 0; i < W * H; i++) {
            const float *behind = isfinite(st.rays.far[i]) ? matt.color : background;
            for (size_t k = 0; k < 3; k++)
                assert_near((double)st.rgb.pixels[3 * i + k], rgb[3 * i + k] + left[i] * (double)behind[k],
                            1e-5);
            seen += 1 - left[i];
            hidden += left[i];
        }
        assert_true(c->hidden == 1 ? seen == 0 : seen > 50);
        assert_true(hidden > 50);
        close_studio(&st, &in);
    }
}

static void elsewhere_nothing_changes(void **state)
{
    (void)state;
    insert_scene in = {.ambient = 1};
    studio st = open_studio(1, 3, 7);
    add_plane(&in, &mirror, -3, 99);
    shoot(&st, &in);
    image plain = {0};
    assert_ok(image_alloc(&plain, W, H, 3, NULL));
    assert_ok(trace_forward(&st.scene, &st.rays, false, &(trace_outputs){.rgb = &plain}, NULL, NULL));
    assert_memory_equal(plain.pixels, st.rgb.pixels, W * H * 3 * sizeof *plain.pixels);
    image_free(&plain);
    close_studio(&st, &in);
}

/* The camera at 0 looks into a mirror at z = 5: what is behind the camera is seen as from 10, looking back.
   There is no room before the mirror, whatever there is before the camera. */
static void mirrored_camera(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 5; seed++) {
        insert_scene in = {.ambient = 1};
        studio st = open_studio(seed, -7, -1);
        const float usual = st.settings.t_near;
        add_plane(&in, &mirror, 5, 99);
        st.settings.t_near = seed % 2 == 0 ? usual : 20;
        shoot(&st, &in);
        assert_true(st.scene.settings.t_near == st.settings.t_near);
        st.settings.t_near = usual;
        double rgb[3 * W * H], left[W * H], seen = 0;
        st.rays.origin[2] = 10;
        for (size_t i = 0; i < W * H; i++)
            st.rays.dir[3 * i + 2] *= -1;
        reference(&st, &st.rays, rgb, left);
        for (size_t i = 0; i < W * H; i++) {
            seen += 1 - left[i];
            for (size_t k = 0; k < 3; k++)
                assert_near((double)st.rgb.pixels[3 * i + k],
                            (double)mirror.color[k] * (rgb[3 * i + k] + left[i] * (double)background[k]),
                            1e-4);
        }
        assert_true(seen > 50);
        close_studio(&st, &in);
    }
}

/* Mean squared difference from what the mirrored camera sees of st->g. */
static double mirrored_error(const studio *st)
{
    double rgb[3 * W * H], left[W * H], sum = 0;
    reference(st, &st->rays, rgb, left);
    for (size_t i = 0; i < 3 * W * H; i++) {
        const double seen = rgb[i] + left[i / 3] * (double)background[i % 3];
        sum += pow((double)st->rgb.pixels[i] - (double)mirror.color[i % 3] * seen, 2);
    }
    return sum / (3 * W * H);
}

/* Rays as wide as pixels: Gaussians behind the camera, smaller than pixels, in a mirror right before it. */
static void mirrored_pixels(void **state)
{
    (void)state;
    insert_scene in = {.ambient = 1};
    studio st = open_studio(3, -20, -10);
    gbt_camera camera = pinhole(100);
    footprint_view view = footprint_view_of(&camera);
    gaussians thin = st.g;
    st.g = (gaussians){0};
    for (size_t i = 0; i < COUNT; i++)
        thin.scale_x[i] /= 8, thin.scale_y[i] /= 8, thin.scale_z[i] /= 8;
    assert_ok(footprint_forward(&view, 0.1f, NULL, &thin, &st.g, NULL));
    ray_image_free(&st.rays);
    assert_ok(ray_image_from_camera(&camera, &st.rays, NULL));
    add_plane(&in, &mirror, 0.1f, 99);
    shoot(&st, &in);
    camera.center[2] = 0.2;
    camera.rotation[8] = -1;
    view = footprint_view_of(&camera);
    assert_ok(footprint_forward(&view, 0.1f, NULL, &thin, &st.g, NULL));
    st.rays.origin[2] = 0.2f;
    for (size_t i = 0; i < W * H; i++)
        st.rays.dir[3 * i + 2] *= -1;
    const double wide_error = mirrored_error(&st);
    gaussians_free(&st.g);
    st.g = thin;
    assert_true(wide_error < pow(10, -3.5));
    assert_true(wide_error < 0.2 * mirrored_error(&st));
    close_studio(&st, &in);
}

/* A smooth mirror whose vertices agree with its triangles is the same mirror. */
static void smooth_plane(void **state)
{
    (void)state;
    image flat_rgb = {0};
    for (int smooth = 0; smooth < 2; smooth++) {
        insert_scene in = {.ambient = 1};
        studio st = open_studio(3, -7, -1);
        insert_object object = mirror;
        object.smooth = smooth;
        add_plane(&in, &object, 5, 99);
        shoot(&st, &in);
        for (size_t i = 0; smooth && i < 3 * W * H; i++)
            assert_near((double)st.rgb.pixels[i], (double)flat_rgb.pixels[i], 1e-5);
        if (!smooth) {
            flat_rgb = st.rgb;
            st.rgb = (image){0};
        }
        close_studio(&st, &in);
    }
    image_free(&flat_rgb);
}

/* A plane far larger than what is seen of it is the same plane. The lamp sees it through the cloud. */
static void plane_of_any_size(void **state)
{
    (void)state;
    for (int mirrors = 0; mirrors < 2; mirrors++) {
        image small_rgb = {0};
        for (int large = 0; large < 2; large++) {
            insert_scene in = {.ambient = 0.25f, .lamp = INSERT_LAMP_POINT, .lamp_at = {0.5, -0.5, 1}};
            studio st = open_studio(3, mirrors ? -7 : 3, mirrors ? -1 : 7);
            const float half = large ? 1e6f : 99;
            add_rectangle(&in, mirrors ? &mirror : &matt, 7.5f, half, half);
            shoot(&st, &in);
            for (size_t i = 0; large && i < 3 * W * H; i++)
                assert_near((double)st.rgb.pixels[i], (double)small_rgb.pixels[i], 1e-4);
            if (!large) {
                small_rgb = st.rgb;
                st.rgb = (image){0};
            }
            close_studio(&st, &in);
        }
        image_free(&small_rgb);
    }
}

/* Between two mirrors: four reflections, and the fifth surface is matt. */
static void mirrors_end(void **state)
{
    (void)state;
    insert_scene in = {.ambient = 0.5f};
    studio st = open_studio(3, 30, 40);
    add_plane(&in, &mirror, 5, 99);
    add_plane(&in, &mirror, -5, 99);
    shoot(&st, &in);
    const size_t middle = 3 * (H / 2 * W + W / 2);
    for (size_t k = 0; k < 3; k++)
        assert_near((double)st.rgb.pixels[middle + k], 0.5 * pow((double)mirror.color[k], 5), 1e-6);
    close_studio(&st, &in);
}

static struct lamp_case {
    const char *name;
    insert_lamp lamp;
    double at[3];
} lamp_cases[] = {
    {"a distant lamp", INSERT_LAMP_DISTANT, {0.6, 0, -0.8}},
    {"a lamp in the cloud", INSERT_LAMP_POINT, {0.5, -0.5, 5}},
    {"a lamp behind the plane", INSERT_LAMP_POINT, {0.5, -0.5, 12}},
};

static void shadow_of_gaussians(void **state)
{
    const struct lamp_case *c = *state;
    const float depth = 7.5f, ambient = 0.25f;
    for (uint64_t seed = 0; seed < 4; seed++) {
        insert_scene in = {.ambient = ambient, .lamp = c->lamp, .lamp_at = {c->at[0], c->at[1], c->at[2]}};
        studio st = open_studio(seed, 3, 7);
        add_plane(&in, &matt, depth, 99);
        shoot(&st, &in);
        double rgb[3 * W * H], left[W * H], scratch[3 * W * H], visible[W * H], cosine[W * H], dark = 0;
        int loose = 0;
        ray_image to_lamp = {0};
        assert_ok(ray_image_reserve(&to_lamp, W, H, false, NULL));
        st.rays.far = plane_distance(&st.rays, depth, 99);
        to_lamp.far = mem_alloc(W * H, sizeof *to_lamp.far, "far", NULL);
        for (size_t i = 0; i < W * H; i++) {
            double d[3], length = INFINITY;
            for (size_t k = 0; k < 3; k++) {
                to_lamp.origin[3 * i + k] = st.rays.far[i] * st.rays.dir[3 * i + k];
                d[k] = c->lamp == INSERT_LAMP_POINT ? c->at[k] - (double)to_lamp.origin[3 * i + k] : c->at[k];
            }
            if (c->lamp == INSERT_LAMP_POINT)
                length = dvec_length(d);
            dvec_normalize(d);
            cosine[i] = fmax(0, -d[2]);
            to_lamp.far[i] = (float)length;
            for (size_t k = 0; k < 3; k++)
                to_lamp.dir[3 * i + k] = (float)d[k];
        }
        reference(&st, &st.rays, rgb, left);
        reference(&st, &to_lamp, scratch, visible);
        for (size_t i = 0; i < W * H; i++) {
            const double light = (double)ambient + (1 - (double)ambient) * cosine[i] * visible[i];
            dark += cosine[i] * (1 - visible[i]);
            /* A plane before the lamp takes it from the Gaussians as well. */
            const double given = c->at[2] < 10 ? 1 : (double)ambient;
            for (size_t k = 0; k < 3; k++) {
                const double wanted = given * rgb[3 * i + k] + left[i] * (double)matt.color[k] * light;
                assert_near((double)st.rgb.pixels[3 * i + k], wanted, 4e-3);
                loose += fabs((double)st.rgb.pixels[3 * i + k] - wanted) > 1e-4;
            }
        }
        /* Where the lamp's ray starts is rounded, so that a Gaussian may fall to the other side of
           alpha_min. */
        assert_true(loose <= 6);
        assert_true(c->at[2] < 10 ? dark > 20 : dark == 0);
        ray_image_free(&to_lamp);
        close_studio(&st, &in);
    }
}

/* A large flat Gaussian at z = 6 is a wall. */
static studio open_wall(void)
{
    studio st = open_studio(0, 3, 7);
    gaussians *g = &st.g;
    assert_ok(gaussians_resize(g, 1, NULL));
    g->mean_x[0] = g->mean_y[0] = 0;
    g->mean_z[0] = 6;
    g->scale_x[0] = g->scale_y[0] = 1000;
    g->scale_z[0] = 1e-3f;
    g->quat_w[0] = 1;
    g->quat_x[0] = g->quat_y[0] = g->quat_z[0] = 0;
    g->opacity[0] = 1;
    g->red[0] = 0.5f;
    g->green[0] = 0.25f;
    g->blue[0] = 1;
    gaussians_pad(g);
    return st;
}

/* The lamp at (-3, 0, 4) sees the screen, -0.6 < x < -0.2 at z = 5, in front of 1.8 < x < 2.6 of the wall.
   The camera sees the wall at x = +-0.1, +-0.3 and so on; a lamp of radius 0.08 makes half shadows of about
   0.16 to both sides of the edges. */
static void shadow_on_gaussians(void **state)
{
    (void)state;
    for (int soft = 0; soft < 2; soft++) {
        insert_scene in = {.ambient = 0.25f,
                           .lamp = INSERT_LAMP_POINT,
                           .lamp_at = {-3, 0, 4},
                           .lamp_radius = soft ? 0.08 : 0};
        studio st = open_wall();
        const float vertices[12] = {-0.6f, -50, 5, -0.2f, -50, 5, -0.2f, 50, 5, -0.6f, 50, 5};
        const uint32_t triangles[6] = {0, 1, 2, 2, 3, 0};
        int dark = 0, half = 0;
        assert_ok(insert_add(&in, &matt, vertices, 4, triangles, 2, NULL));
        add_plane(&in, &matt, -2, 99); /* behind the lamp: no shadow of it */
        shoot(&st, &in);
        for (size_t i = 0; i < W * H; i++) {
            const double x = 6 * (double)st.rays.dir[3 * i] / (double)st.rays.dir[3 * i + 2];
            if (x > -0.72 && x < -0.24)
                continue; /* the screen itself */
            /* The wall's alpha is cut at 0.99. */
            const double green = (double)st.rgb.pixels[3 * i + 1],
                         light = (green - 0.01 * (double)background[1]) / (0.99 * 0.25);
            const bool near_edge = fmin(fabs(x - 1.8), fabs(x - 2.6)) < 0.15;
            if (soft && near_edge) {
                assert_true(light > 0.26 && light < 0.99);
                half++;
            } else {
                assert_near(light, x > 1.8 && x < 2.6 ? 0.25 : 1, 1e-4);
                dark += light < 0.5;
            }
        }
        assert_int_equal(dark, (soft ? 2 : 4) * H);
        assert_int_equal(half, soft ? 4 * H : 0);
        close_studio(&st, &in);
    }
}

/* What a matt plane through `point` gives back, without Gaussians, to a lamp that nothing hides. */
static double lit(const double normal[3], const double point[3], const double lamp[3], double ambient)
{
    double d[3] = {lamp[0] - point[0], lamp[1] - point[1], lamp[2] - point[2]};
    dvec_normalize(d);
    return ambient + (1 - ambient) * fabs(dvec_dot(d, normal));
}

/* The middle of a lamp of radius R is at the height h right above what a pixel sees: the mean cosine over its
   disc has a closed form. */
static void light_of_a_disc(void **state)
{
    (void)state;
    const double h = 2, radius = 1.5, z = 5;
    const size_t at = H / 2 * W + W / 2;
    studio st = open_studio(1, 300, 310);
    const float *d = st.rays.dir + 3 * at;
    insert_scene in = {.lamp = INSERT_LAMP_POINT,
                       .lamp_at = {z * (double)d[0] / (double)d[2], z * (double)d[1] / (double)d[2], z - h},
                       .lamp_radius = radius};
    add_plane(&in, &matt, (float)z, 99);
    shoot(&st, &in);
    const double light = 2 * h * (sqrt(h * h + radius * radius) - h) / (radius * radius);
    for (size_t k = 0; k < 3; k++)
        assert_near((double)st.rgb.pixels[3 * at + k], (double)matt.color[k] * light, 0.005);
    close_studio(&st, &in);
}

/* The screen, -0.6 < x < -0.2 at z = 5, and its shadow, 1.8 < x < 2.6 at z = 7, each in the colour of its
   object. */
static void shadow_on_a_mesh(void **state)
{
    (void)state;
    insert_scene in = {.ambient = 0.25f, .lamp = INSERT_LAMP_POINT, .lamp_at = {-3, 0, 3}};
    studio st = open_studio(1, -40, -30);
    const insert_object red = {.material = INSERT_MATT, .color = {1, 0, 0}};
    const float vertices[12] = {-0.6f, -50, 5, -0.2f, -50, 5, -0.2f, 50, 5, -0.6f, 50, 5};
    const uint32_t triangles[6] = {0, 1, 2, 2, 3, 0};
    int screen = 0, dark = 0;
    add_plane(&in, &matt, 7, 99);
    assert_ok(insert_add(&in, &red, vertices, 4, triangles, 2, NULL));
    add_plane(&in, &matt, -2, 99); /* behind the lamp: no shadow of it */
    shoot(&st, &in);
    for (size_t i = 0; i < W * H; i++) {
        const double slope[2] = {(double)st.rays.dir[3 * i] / (double)st.rays.dir[3 * i + 2],
                                 (double)st.rays.dir[3 * i + 1] / (double)st.rays.dir[3 * i + 2]};
        const bool on_screen = slope[0] > -0.12 && slope[0] < -0.04;
        const double z = on_screen ? 5 : 7, point[3] = {z * slope[0], z * slope[1], z}, normal[3] = {0, 0, 1};
        const bool in_shadow = !on_screen && point[0] > 1.8 && point[0] < 2.6;
        const double light = in_shadow ? 0.25 : lit(normal, point, in.lamp_at, 0.25);
        for (size_t k = 0; k < 3; k++)
            assert_near((double)st.rgb.pixels[3 * i + k], light * (double)(on_screen ? red : matt).color[k],
                        1e-5);
        screen += on_screen;
        dark += in_shadow;
    }
    assert_true(screen >= H && dark >= 3 * H);
    close_studio(&st, &in);
}

/* A plane does not stand in its own light, and a mirror does not see itself, however they lie. */
static void no_surface_hides_itself(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 40; seed++) {
        insert_scene in = {.ambient = 0.25f, .lamp = INSERT_LAMP_POINT, .lamp_at = {-1, 0.5, 0.25}};
        studio st = open_studio(1, 300, 310);
        double normal[3] = {rng_normal(seed, 1, 0) * 0.4, rng_normal(seed, 1, 1) * 0.4, -1}, vertices[9];
        dvec_normalize(normal);
        float corners[9];
        for (size_t c = 0; c < 3; c++) { /* around (0, 0, 6) */
            const double x = 200 * cos(2.1 * (double)c), y = 200 * sin(2.1 * (double)c);
            vertices[3 * c] = x;
            vertices[3 * c + 1] = y;
            vertices[3 * c + 2] = 6 - (normal[0] * x + normal[1] * y) / normal[2];
            for (size_t k = 0; k < 3; k++)
                corners[3 * c + k] = (float)vertices[3 * c + k];
        }
        const bool mirrors = seed % 2 == 1;
        assert_ok(
            insert_add(&in, mirrors ? &mirror : &matt, corners, 3, (const uint32_t[3]){0, 1, 2}, 1, NULL));
        shoot(&st, &in);
        for (size_t i = 0; i < W * H; i++) {
            const double d[3] = {(double)st.rays.dir[3 * i], (double)st.rays.dir[3 * i + 1],
                                 (double)st.rays.dir[3 * i + 2]};
            const double t = 6 * normal[2] / dvec_dot(d, normal), point[3] = {t * d[0], t * d[1], t * d[2]};
            if (!(t > 0 && t < 40))
                continue;
            for (size_t k = 0; k < 3; k++)
                assert_near((double)st.rgb.pixels[3 * i + k],
                            mirrors ? (double)(mirror.color[k] * background[k])
                                    : (double)matt.color[k] * lit(normal, point, in.lamp_at, 0.25),
                            2e-5);
        }
        close_studio(&st, &in);
    }
}

/* Pixels without a ray have the background's colour, which a sky cuts to [0, 1], by whatever draws them. */
static void no_rays(void **state)
{
    (void)state;
    const double wanted[3] = {1, 0, (double)background[2]};
    double rgb[3 * W * H], left[W * H];
    insert_scene in = {.ambient = 1};
    studio st = open_studio(1, 3, 7);
    image plain = {0};
    add_plane(&in, &mirror, 5, 99);
    shoot(&st, &in);
    assert_ok(image_alloc(&plain, W, H, 3, NULL));
    memset(st.rays.dir, 0, 3 * W * H * sizeof *st.rays.dir);
    trace_settings *s = &st.scene.settings;
    s->background[0] = 1.2f;
    s->background[1] = -0.1f;
    s->sky.varies = true;
    s->sky.harmonic[0][2] = 0.5f;
    assert_ok(insert_trace(&in, &st.scene, &st.rays, &st.rgb, NULL));
    assert_ok(trace_forward(&st.scene, &st.rays, false, &(trace_outputs){.rgb = &plain}, NULL, NULL));
    assert_ok(reference_forward(&st.g, s, &st.rays, rgb, left, NULL, NULL));
    for (size_t i = 0; i < 3 * W * H; i++)
        assert_true((double)st.rgb.pixels[i] == wanted[i % 3] && (double)plain.pixels[i] == wanted[i % 3] &&
                    rgb[i] == wanted[i % 3]);
    image_free(&plain);
    close_studio(&st, &in);
}

static void threads_agree(void **state)
{
    (void)state;
    image first = {0};
    for (int threads = 1; threads <= 4; threads += 3) {
        parallel_set_threads(threads);
        insert_scene in = {
            .ambient = 0.3f, .lamp = INSERT_LAMP_POINT, .lamp_at = {1, -3, 2}, .lamp_radius = 0.3};
        studio st = open_studio(7, 3, 7);
        insert_object object = mirror;
        object.smooth = true;
        add_plane(&in, &object, 5, 0);
        add_plane(&in, &matt, 6, 99);
        add_plane(&in, &matt, -2, 99);
        shoot(&st, &in);
        if (threads > 1)
            assert_memory_equal(first.pixels, st.rgb.pixels, W * H * 3 * sizeof *first.pixels);
        else {
            first = st.rgb;
            st.rgb = (image){0};
        }
        close_studio(&st, &in);
    }
    image_free(&first);
}

static void a_corner_that_is_no_vertex(void **state)
{
    (void)state;
    static const float corners[9] = {0, 0, 1, 1, 0, 1, 0, 1, 1};
    insert_scene in = {0};
    gbt_error err = {0};
    assert_int_equal(insert_add(&in, &matt, corners, 3, (const uint32_t[3]){0, 1, 3}, 1, &err),
                     GBT_ERR_ARGUMENT);
    assert_string_equal(err.text, "mesh: triangle 0: bad vertex number (wanted < 3, got 3)");
    assert_ok(insert_add(&in, &matt, corners, 3, (const uint32_t[3]){0, 1, 2}, 1, NULL));
    insert_scene_free(&in);
}

static void without_memory(void **state)
{
    (void)state;
    insert_scene in = {.ambient = 0.3f, .lamp = INSERT_LAMP_DISTANT, .lamp_at = {0, 0, -1}};
    studio st = open_studio(7, 3, 7);
    add_plane(&in, &mirror, 5, 0);
    add_plane(&in, &matt, 6, 99);
    shoot(&st, &in);
    parallel_set_threads(1);
    gbt_status status = GBT_ERR_NO_MEMORY;
    for (long n = 0; n < 1000 && status != GBT_OK; n++) {
        gbt_error err = {0};
        mem_fail_after(n);
        status = insert_trace(&in, &st.scene, &st.rays, &st.rgb, &err);
        mem_fail_after(-1);
        assert_true(status == GBT_OK || status == GBT_ERR_NO_MEMORY);
        assert_memory_equal(st.scene.settings.background, background, sizeof background);
    }
    assert_int_equal(status, GBT_OK);
    close_studio(&st, &in);
}

int main(void)
{
    enum {
        PLANES = sizeof plane_cases / sizeof *plane_cases,
        LAMPS = sizeof lamp_cases / sizeof *lamp_cases
    };
    static struct CMUnitTest tables[PLANES + LAMPS];
    for (size_t i = 0; i < PLANES; i++)
        tables[i] = (struct CMUnitTest){
            .name = plane_cases[i].name, .test_func = occlusion, .initial_state = &plane_cases[i]};
    for (size_t i = 0; i < LAMPS; i++)
        tables[PLANES + i] = (struct CMUnitTest){
            .name = lamp_cases[i].name, .test_func = shadow_of_gaussians, .initial_state = &lamp_cases[i]};
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(elsewhere_nothing_changes),
        cmocka_unit_test(mirrored_camera),
        cmocka_unit_test(mirrored_pixels),
        cmocka_unit_test(smooth_plane),
        cmocka_unit_test(plane_of_any_size),
        cmocka_unit_test(mirrors_end),
        cmocka_unit_test(shadow_on_gaussians),
        cmocka_unit_test(shadow_on_a_mesh),
        cmocka_unit_test(light_of_a_disc),
        cmocka_unit_test(no_surface_hides_itself),
        cmocka_unit_test(no_rays),
        cmocka_unit_test(threads_agree),
        cmocka_unit_test(a_corner_that_is_no_vertex),
        cmocka_unit_test(without_memory),
    };
    const int failures = cmocka_run_group_tests_name("insert, tables", tables, NULL, NULL);
    return failures + cmocka_run_group_tests_name("insert", tests, NULL, NULL);
}
