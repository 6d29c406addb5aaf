/* SPDX-License-Identifier: Apache-2.0 */
/* stability/lens.c -- cases of the study "stability" about cameras: wide angles (A10) and rolling shutter
   (A11). */
#include <math.h>
#include <string.h>

#include "base/compare.h"
#include "base/memory.h"
#include "base/rng.h"
#include "base/vec.h"
#include "stability/draw.h"

static const double degree = 0.017453292519943295;

/* ---- A10: wide angles ---- */

/* Settings with cut-offs so low that it is invisible on which side of one a response falls. */
static trace_settings without_edges(const stability *s)
{
    trace_settings settings = trace_settings_default();
    (void)s;
    settings.alpha_min = 1e-6f;
    settings.transmittance_min = 1e-7f;
    return settings;
}

static void all_around(stability *s, size_t count, gaussians *g)
{
    draw_alloc(s, g, count);
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        double mean[3], scale[3], color[3], quat[4];
        draw_random_turn(10, 0, i, quat);
        draw_random_direction(10, 4, i, mean);
        for (uint64_t k = 0; k < 3; k++) {
            mean[k] *= 2 + 4 * (double)rng_uniform(10, 10, i);
            scale[k] = 0.05 + 0.5 * (double)rng_uniform(10, 11 + k, i);
            color[k] = (double)rng_uniform(10, 14 + k, i);
        }
        draw_set(g, i, mean, scale, quat, 0.1 + 0.8 * (double)rng_uniform(10, 17, i), color);
    }
}

/* Rotate a camera to look through face `number` of a cube. */
static void face_cube(gbt_camera *camera, int number)
{
    draw_turned(number < 4 ? number * 90 * degree : 0, number < 4 ? 0 : (number == 4 ? 90 : -90) * degree,
                camera->rotation);
}

/* For each ray of a pinhole's picture, the ray that another camera has for the same direction, if it sees
   that direction. */
static size_t rays_of_other(const ray_image *face, const gbt_camera *other, double angle_max, ray_image *out)
{
    size_t seen = 0;
    for (size_t i = 0; i < ray_image_count(face); i++) {
        static const double nowhere[3] = {0, 0, 0};
        double dir[3], cam[3], pixel[2], origin[3] = {0, 0, 0};
        for (size_t k = 0; k < 3; k++)
            dir[k] = (double)face->dir[3 * i + k];
        dmat_apply(other->rotation, dir, cam);
        const bool found = acos(fmin(cam[2], 1)) <= angle_max && gbt_camera_project(other, cam, pixel) &&
                           gbt_camera_ray(other, pixel[0], pixel[1], origin, dir);
        draw_ray(out, i, origin, found ? dir : nowhere);
        seen += found;
    }
    return seen;
}

static double compare_faces(stability *s, const gaussians *g, const gbt_camera *other, double angle_max,
                            size_t *seen)
{
    static const double here[3] = {0, 0, 0};
    const int size = (int)stability_number(s, "face");
    const trace_settings settings = without_edges(s);
    gbt_camera camera = draw_pinhole(size, size, 0.5 * size, here);
    drawing face = {0}, whole = {0};
    ray_image rays = {0}, others = {0};
    double most = 0;
    for (int i = 0; i < 6 && s->status == GBT_OK; i++) {
        face_cube(&camera, i);
        draw_camera(s, &face, g, &settings, &camera, &rays);
        draw_rays(s, &others, size, size);
        if (s->status != GBT_OK)
            break;
        *seen += rays_of_other(&rays, other, angle_max, &others);
        draw_traced(s, &whole, g, &settings, &others);
        for (size_t p = 0; p < ray_image_count(&rays) && s->status == GBT_OK; p++) {
            const float *d = others.dir + 3 * p;
            if (d[0] != 0 || d[1] != 0 || d[2] != 0)
                most = larger_or_nan(most,
                                     draw_difference(face.rgb.pixels + 3 * p, whole.rgb.pixels + 3 * p, 3));
        }
    }
    drawing_free(&face);
    drawing_free(&whole);
    ray_image_free(&rays);
    ray_image_free(&others);
    return most;
}

/* One round Gaussian off the axis: largest error of alpha in a picture around it, for both renderers. */
static void off_axis(stability *s, double distance, double angle, drawing *ours, drawing *theirs,
                     double error[2])
{
    enum { WIDTH = 512, HEIGHT = 384 };
    static const double here[3] = {0, 0, 0}, white[3] = {1, 1, 1};
    const double size = stability_number(s, "scale"), scale[3] = {size, size, size},
                 mean[3] = {distance * sin(angle), 0, distance * cos(angle)};
    const double focal = stability_number(s, "focal");
    const trace_settings settings = without_edges(s);
    raster_settings splat = raster_settings_default();
    /* so that only the error of the projection remains */
    splat.alpha_min = settings.alpha_min;
    splat.dilation = 0;
    splat.exact_cut = true;
    gbt_camera camera = draw_pinhole(WIDTH, HEIGHT, focal, here);
    gaussians g = {0};
    ray_image rays = {0};
    camera.params[2] = 0.5 * WIDTH - focal * tan(angle);
    draw_alloc(s, &g, 1);
    if (s->status == GBT_OK)
        draw_set(&g, 0, mean, scale, NULL, 0.99, white);
    draw_camera(s, ours, &g, &settings, &camera, &rays);
    draw_splatted(s, theirs, &g, &splat, &camera);
    double *exact = s->status == GBT_OK ? draw_exact(s, &g, &settings, &rays, NULL) : NULL;
    if (exact != NULL)
        error[0] = draw_error(ours->rgb.pixels, exact, 3 * WIDTH * HEIGHT),
        error[1] = draw_error(theirs->rgb.pixels, exact, 3 * WIDTH * HEIGHT);
    mem_free(exact);
    gaussians_free(&g);
    ray_image_free(&rays);
}

static void off_axis_curves(stability *s)
{
    double angles[16], distances[4], worst[2] = {0, 0};
    const size_t angle_count = stability_list(s, "angles_deg", 16, angles),
                 distance_count = stability_list(s, "distances", 4, distances);
    drawing ours = {0}, theirs = {0};
    stability_chart *chart = stability_new_chart(
        s, "Wide angles",
        "Error of one round Gaussian's alpha. Splatting projects it as if the lens were flat there.",
        "angle from the axis, degrees", "largest error of alpha");
    chart->series[1].name = "rasterizer, 3 m away", chart->series[2].name = "rasterizer, 1 m away";
    for (size_t d = 0; d < distance_count; d++)
        for (size_t a = 0; a < angle_count && s->status == GBT_OK; a++) {
            double error[2] = {0, 0};
            off_axis(s, distances[d], angles[a] * degree, &ours, &theirs, error);
            for (int r = 0; r < 2; r++)
                worst[r] = larger_or_nan(worst[r], error[r]);
            if (d == 0)
                stability_point(chart, 0, angles[a], error[0]);
            stability_point(chart, d == 0 ? 1 : 2, angles[a], error[1]);
        }
    stability_check(s, "A10c", worst[0], worst[1],
                    "Size 0.3 at 3 and 1 m, to %g degrees. The rasterizer without its 0.3 px^2 and its cut "
                    "at 3 std-devs.",
                    angle_count > 0 ? angles[angle_count - 1] : 0);
    drawing_free(&ours);
    drawing_free(&theirs);
}

gbt_status stability_a10(stability *s)
{
    gbt_camera panorama = {
        .model = GBT_CAMERA_EQUIRECTANGULAR, .width = 512, .height = 256, .params = {512, 256}};
    gbt_camera fisheye = {.model = GBT_CAMERA_FISHEYE,
                          .width = 400,
                          .height = 400,
                          .params = {360 / 3.141592653589793, 360 / 3.141592653589793, 200, 200}};
    gaussians g = {0};
    size_t seen = 0, seen_fisheye = 0;
    draw_turned(0.3, 0.2, panorama.rotation);
    draw_turned(-0.4, 0.1, fisheye.rotation);
    all_around(s, (size_t)stability_number(s, "gaussians"), &g);
    const double apart = compare_faces(s, &g, &panorama, 4, &seen),
                 apart_fisheye = compare_faces(s, &g, &fisheye, 100 * degree, &seen_fisheye);
    stability_check(s, "A10a", apart, NAN, "%zu rays.", seen);
    stability_check(s, "A10b", apart_fisheye, NAN, "%zu rays within 100 degrees of the axis.", seen_fisheye);
    off_axis_curves(s);
    gaussians_free(&g);
    return s->status;
}

/* ---- A11: rolling shutter ---- */

/* Column of the post in row y: the mean column, weighted by brightness. */
static double post_in_row(const image *rgb, int y)
{
    double sum = 0, weighted = 0;
    for (int x = 0; x < rgb->width; x++) {
        const double value = (double)rgb->pixels[3 * ((size_t)y * (size_t)rgb->width + (size_t)x)];
        sum += value;
        weighted += value * (x + 0.5);
    }
    return weighted / sum; /* NaN, which fails, if the post is not visible in this row */
}

/* Largest distance, over all rows, of the post from its analytic position. */
static double post_error(const image *rgb, double x0, double skew, stability_chart *chart, int series)
{
    double most = 0;
    for (int y = 0; y < rgb->height; y++) {
        const double x = post_in_row(rgb, y), off = fabs(x - (x0 - skew * y / (rgb->height - 1)));
        if (!(off <= most))
            most = off;
        if (y % 8 == 0)
            stability_point(chart, series, y, x);
    }
    return most;
}

gbt_status stability_a11(stability *s)
{
    enum { WIDTH = 160, HEIGHT = 480 };
    static const double here[3] = {0, 0, 0};
    const double speed = stability_number(s, "speed"), readout = stability_number(s, "readout"),
                 focal = stability_number(s, "focal"), depth = stability_number(s, "depth");
    const double x0 = 120, skew = focal * speed * readout / depth;
    const trace_settings settings = trace_settings_default();
    const raster_settings splat = raster_settings_default();
    gbt_camera camera = draw_pinhole(WIDTH, HEIGHT, focal, here);
    drawing ours = {0}, still = {0}, theirs = {0};
    gaussians g = {0};
    ray_image rays = {0};
    size_t changed = 0;
    camera.params[2] = x0;
    stability_gaussians(s, &g);
    stability_chart *chart =
        stability_new_chart(s, "Rolling shutter",
                            "Column of an upright post while the camera moves at 10 m/s: analytic 120 to 60.",
                            "row", "column, px");
    ray_shot shot = ray_shot_of(&camera);
    shot.camera.shutter = GBT_CAMERA_SHUTTER_ROWS;
    if (s->status == GBT_OK && stability_ok(s, ray_image_from_shot(&shot, 0, &rays, s->err)))
        draw_traced(s, &still, &g, &settings, &rays);
    draw_camera(s, &ours, &g, &settings, &camera, &rays);
    for (size_t i = 0; i < 3 * WIDTH * HEIGHT && s->status == GBT_OK; i++)
        changed += memcmp(&ours.rgb.pixels[i], &still.rgb.pixels[i], sizeof(float)) != 0;
    const double apart =
        s->status == GBT_OK ? draw_difference(ours.rgb.pixels, still.rgb.pixels, 3 * WIDTH * HEIGHT) : 0;
    /* `readout` is the time from the middle of the first row to the middle of the last, while `motion` is
     * from edge to edge; `camera` has the pose of the first row, while a shot has that of the middle. */
    shot.camera.motion[0] = speed * readout * HEIGHT / (HEIGHT - 1.0);
    shot.camera.center[0] += 0.5 * speed * readout;
    if (s->status == GBT_OK && stability_ok(s, ray_image_from_shot(&shot, 0, &rays, s->err)))
        draw_traced(s, &ours, &g, &settings, &rays);
    draw_splatted(s, &theirs, &g, &splat, &camera);
    if (s->status == GBT_OK) {
        const double off = post_error(&ours.rgb, x0, skew, chart, 0),
                     splat_off = post_error(&theirs.rgb, x0, skew, chart, 1);
        stability_check(s, "A11a", off, splat_off,
                        "Skew %.0f px from top to bottom. The rasterizer has one pose per picture.", skew);
        stability_check(s, "A11b", (double)changed, NAN, "Largest difference %.2g.", apart);
    }
    drawing_free(&ours);
    drawing_free(&still);
    drawing_free(&theirs);
    gaussians_free(&g);
    ray_image_free(&rays);
    return s->status;
}
