/* SPDX-License-Identifier: Apache-2.0 */
/* report/views.c -- the held-out views of the page: photo against render, where they differ, and their
   scores. */
#include "report/views.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "report/image.h"

/* Limits that keep a page to a few megabytes: the three pictures of a view take about 0.4 bytes per pixel.
   The full pictures are separate files, which the page links to. */
enum { PICTURES_MAX_PIXELS = 5600000, PICTURE_MAX_PIXELS = 1000000 };

typedef struct ranked {
    double psnr;
    size_t index;
} ranked;

static int compare_psnr(const void *a, const void *b)
{
    const ranked *x = a, *y = b;
    const double p = isnan(x->psnr) ? (double)INFINITY : x->psnr,
                 q = isnan(y->psnr) ? (double)INFINITY : y->psnr;
    if (p != q)
        return p < q ? -1 : 1;
    return x->index < y->index ? -1 : x->index > y->index;
}

size_t report_choose_views(const evaluation *e, size_t *shown, size_t *order)
{
    const size_t n = e->view_count, third = REPORT_MAX_VIEWS / 3;
    size_t scored = 0;
    gbt_error ignored = {0};
    ranked *rank = mem_alloc(n, sizeof *rank, "views", &ignored);
    for (size_t i = 0; i < n; i++) {
        order[i] = i;
        scored += !isnan(e->views[i].psnr);
    }
    if (rank != NULL) { /* out of memory: keep the order of the data set */
        for (size_t i = 0; i < n; i++)
            rank[i] = (ranked){e->views[i].psnr, i};
        qsort(rank, n, sizeof *rank, compare_psnr);
        for (size_t i = 0; i < n; i++)
            order[i] = rank[i].index;
        mem_free(rank);
    }
    if (n <= REPORT_MAX_VIEWS) {
        memcpy(shown, order, n * sizeof *order);
        return n;
    }
    const size_t end = scored > REPORT_MAX_VIEWS ? scored : REPORT_MAX_VIEWS; /* views behind the scored ones
                                                                                 have no score */
    for (size_t i = 0; i < third; i++) {
        shown[i] = order[i];
        shown[third + i] = order[end / 2 - third / 2 + i];
        shown[2 * third + i] = order[end - third + i];
    }
    return REPORT_MAX_VIEWS;
}

/** An <img>, or a line that says that there is no picture. */
static void add_picture(text *out, const char *class_name, const char *what, const view_score *v,
                        const char *path, picture_kind kind, size_t most)
{
    int width, height;
    report_picture_size(path, &width, &height);
    if (width > 0) {
        const size_t before = out->length;
        text_format(out, "<img class=\"%s\" alt=\"%s of ", class_name, what);
        text_escaped(out, v->name);
        text_add(out, "\" src=\"");
        report_picture(out, path, kind, most, &width, &height);
        text_format(out, "\" width=\"%d\" height=\"%d\">", width, height);
        if (width > 0 || out->status != GBT_OK)
            return;
        out->length = before; /* the file's header could be read, its pixels could not */
    }
    text_format(out, "<span class=\"missing\">%s: n/a</span>", what);
}

static void add_score(text *out, const char *name, double value, int decimals, const char *unit)
{
    text_format(out, "<span class=\"score\">%s <b>", name);
    text_number(out, value, decimals);
    text_format(out, "</b>%s</span>", unit);
}

static void add_key(text *out, const char *name, double value)
{
    if (isfinite(value))
        text_format(out, " data-%s=\"%.6f\"", name, value);
}

static void add_view(text *out, const evaluation *e, size_t index, size_t place, size_t most)
{
    const view_score *v = &e->views[index];
    int width, height;
    report_picture_size(v->render_path, &width, &height);
    if (width == 0)
        report_picture_size(v->photo_path, &width, &height);
    text_format(out, "<figure class=\"view card\" id=\"view-%zu\" data-place=\"%zu\"", index, place);
    add_key(out, "psnr", v->psnr);
    add_key(out, "ssim", v->ssim);
    add_key(out, "flip", v->flip);
    text_format(out, " style=\"--ratio:%.4f\"><figcaption><h3>",
                width > 0 && height > 0 ? (double)width / (double)height : 1.5);
    text_escaped(out, v->name);
    text_add(out, "</h3>");
    add_score(out, "PSNR", v->psnr, 2, " dB");
    add_score(out, "SSIM", v->ssim, 4, "");
    add_score(out, "FLIP", v->flip, 4, "");
    text_add(out, "</figcaption><div class=\"pair\"><div class=\"compare\">");
    add_picture(out, "render", "Render", v, v->render_path, PICTURE_COLOR, most);
    add_picture(out, "photo", "Photo", v, v->photo_path, PICTURE_COLOR, most);
    text_add(out, "<span class=\"tag l\">photo</span><span class=\"tag r\">render</span>"
                  "<input type=\"range\" min=\"0\" max=\"100\" step=\"0.5\" value=\"50\" aria-label=\"How "
                  "much of the photo to show over the render of ");
    text_escaped(out, v->name);
    text_add(out, "\"><span class=\"handle\"></span></div><div class=\"error\">");
    add_picture(out, "map", "FLIP error map", v, v->error_path, PICTURE_ERROR, most);
    text_add(out, "<span class=\"tag l\">FLIP error</span></div></div></figure>\n");
}

static void add_color_scale(text *out)
{
    enum { STOPS = 12 };
    text_add(out, "<span class=\"scale\">FLIP error: 0 <i style=\"background:linear-gradient(90deg");
    for (int i = 0; i <= STOPS; i++) {
        float rgb[3];
        error_color((double)i / STOPS, rgb);
        text_format(out, ",#%02x%02x%02x", (unsigned)(rgb[0] * 255.0f + 0.5f),
                    (unsigned)(rgb[1] * 255.0f + 0.5f), (unsigned)(rgb[2] * 255.0f + 0.5f));
    }
    text_add(out, ")\"></i> 1 (different at first sight)</span>");
}

/** A link to a file inside the run's folder, relative to the page; nothing for a file elsewhere. */
static void add_link(text *out, const char *run, const char *path, const char *name)
{
    const size_t length = strlen(run);
    if (strncmp(path, run, length) != 0)
        return;
    path += length;
    path += strspn(path, "/");
    text_add(out, " <a href=\"");
    text_url(out, path);
    text_format(out, "\">%s</a>", name);
}

static void add_cell(text *out, double value, int decimals)
{
    if (isfinite(value))
        text_format(out, "<td data-value=\"%.9g\">", value);
    else
        text_add(out, "<td>");
    if (decimals == 0)
        text_count(out, value);
    else
        text_number(out, value, decimals);
}

/* A row of the table. It links to the view's pictures above; if these are not shown, the row itself is the
   target of links to the view. */
static void add_row(text *out, const char *run, const evaluation *e, size_t index, bool is_shown,
                    size_t place, double low, double high)
{
    const view_score *v = &e->views[index];
    if (is_shown)
        text_format(out, "<tr data-place=\"%zu\"><th><a href=\"#view-%zu\">", place, index);
    else
        text_format(out, "<tr data-place=\"%zu\" id=\"view-%zu\"><th>", place, index);
    text_escaped(out, v->name);
    text_add(out, is_shown ? "</a></th>" : "</th>");
    add_cell(out, v->psnr, 2);
    const double share = high > low ? (v->psnr - low) / (high - low) : 1;
    if (isfinite(v->psnr))
        text_format(out, "<i class=\"meter\" style=\"--share:%.0f%%\"></i>", 100 * fmin(fmax(share, 0), 1));
    text_add(out, "</td>");
    add_cell(out, v->ssim, 4);
    text_add(out, "</td>");
    add_cell(out, v->flip, 4);
    text_add(out, "</td>");
    if (e->lpips_network != NULL) {
        add_cell(out, v->lpips.lpips, 4);
        text_add(out, "</td>");
    }
    add_cell(out, (double)v->gaussians, 0);
    text_add(out, "</td>");
    add_cell(out, v->seconds, 3);
    text_add(out, "</td><td class=\"links\">");
    add_link(out, run, v->render_path, "render");
    add_link(out, run, v->photo_path, "photo");
    add_link(out, run, v->error_path, "error");
    text_add(out, "</td></tr>");
}

static void add_table(text *out, const char *run, const evaluation *e, const size_t *order,
                      const size_t *shown, size_t shown_count)
{
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < e->view_count; i++)
        if (isfinite(e->views[i].psnr)) {
            low = fmin(low, e->views[i].psnr);
            high = fmax(high, e->views[i].psnr);
        }
    low = floor(low - 1); /* so that the worst view has a visible bar too */
    text_format(
        out,
        "<details class=\"card\" open><summary>All %zu views as a table</summary><div "
        "class=\"scroll\"><table class=\"list sortable\"><thead><tr><th data-sort=\"text\">View</th><th "
        "data-sort=\"number\">PSNR, dB</th><th data-sort=\"number\">SSIM</th><th "
        "data-sort=\"number\">FLIP</th>%s<th data-sort=\"number\">Gaussians</th><th "
        "data-sort=\"number\">Render, s</th><th>Whole pictures</th></tr></thead><tbody>",
        e->view_count, e->lpips_network != NULL ? "<th data-sort=\"number\">LPIPS</th>" : "");
    for (size_t i = 0; i < e->view_count; i++) {
        size_t k = 0;
        while (k < shown_count && shown[k] != order[i])
            k++;
        add_row(out, run, e, order[i], k < shown_count, i, low, high);
    }
    text_add(out, "</tbody></table></div></details>\n");
}

/** Whether most of the shown views are in portrait format: then two of them fit side by side. */
static bool are_tall(const evaluation *e, const size_t *shown, size_t count)
{
    size_t tall = 0;
    for (size_t i = 0; i < count; i++) {
        int width, height;
        report_picture_size(e->views[shown[i]].render_path, &width, &height);
        tall += height > width;
    }
    return 2 * tall > count;
}

void report_views(text *out, const char *run, const evaluation *e, const char *protocol, const char *scored)
{
    text_add(out, "<section id=\"views\"><h2>Held-out views</h2>\n");
    size_t shown[REPORT_MAX_VIEWS], *order = NULL;
    if (e->view_count == 0) {
        text_add(out, "<p class=\"none\">n/a: every photo was trained on, none was held out. Train with "
                      "<code>--eval-split every=8</code> to see how the scene looks from where no photo was "
                      "shown.</p></section>\n");
        return;
    }
    order = mem_alloc(e->view_count, sizeof *order, "views", out->err);
    if (order == NULL) {
        out->status = GBT_ERR_NO_MEMORY;
        return;
    }
    const size_t count = report_choose_views(e, shown, order);
    text_add(out, "<p class=\"lead\">Training never saw these photos. Drag over a picture, or use the arrow "
                  "keys, to go from the render to the photo.");
    if (count < e->view_count)
        text_format(out,
                    " Shown are %d of %zu views: the %d worst, %d from the middle and the %d best by PSNR.",
                    REPORT_MAX_VIEWS, e->view_count, REPORT_MAX_VIEWS / 3, REPORT_MAX_VIEWS / 3,
                    REPORT_MAX_VIEWS / 3);
    text_add(
        out,
        "</p>\n<div class=\"bar-top\"><label hidden>Order <select id=\"order\" autocomplete=\"off\"><option "
        "value=\"psnr up\">worst PSNR first</option><option value=\"psnr down\">best PSNR "
        "first</option><option value=\"ssim up\">worst SSIM first</option><option value=\"flip "
        "down\">worst FLIP first</option></select></label>");
    add_color_scale(out);
    text_format(out, "</div>\n<div class=\"views%s\">\n", are_tall(e, shown, count) ? " tall" : "");
    const size_t most =
        count > PICTURES_MAX_PIXELS / PICTURE_MAX_PIXELS ? PICTURES_MAX_PIXELS / count : PICTURE_MAX_PIXELS;
    for (size_t i = 0; i < count && out->status == GBT_OK; i++)
        add_view(out, e, shown[i], i, most);
    text_add(out, "</div>\n");
    if (protocol != NULL) {
        text_add(out, "<p class=\"note\">How it is scored: ");
        text_escaped(out, protocol);
        if (scored != NULL) {
            text_add(out, "; ");
            text_escaped(out, scored);
        }
        text_add(out, ".</p>\n");
    }
    add_table(out, run, e, order, shown, count);
    text_add(out, "</section>\n");
    mem_free(order);
}
