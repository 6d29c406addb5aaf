/* SPDX-License-Identifier: Apache-2.0 */
/* examples/render.c -- render one view of a model into a PPM file, which every image program opens.

   Usage: render MODEL OUT.ppm [VIEW] */
#include <stdio.h>
#include <stdlib.h>

#include <gbtrace/model.h>

static unsigned char to_byte(float value)
{
    return (unsigned char)(value <= 0 ? 0 : value >= 1 ? 255 : value * 255 + 0.5f);
}

static int write_ppm(const char *path, const float *rgb, int width, int height)
{
    FILE *file = fopen(path, "wb");
    if (file == NULL)
        return 0;
    fprintf(file, "P6\n%d %d\n255\n", width, height);
    for (size_t i = 0; i < 3 * (size_t)width * (size_t)height; i++)
        fputc(to_byte(rgb[i]), file);
    return fclose(file) == 0;
}

int main(int argc, char **argv)
{
    gbt_error err = {0};
    gbt_model *model = NULL;
    gbt_model_view view;
    size_t count = 0;
    if (argc < 3) {
        fprintf(stderr, "usage: render MODEL OUT.ppm [VIEW]\n");
        return 2;
    }
    gbt_status status = gbt_model_open(argv[1], &model, &err);
    if (status == GBT_OK)
        status = gbt_model_open_views(model, NULL, &count, &err);
    if (status == GBT_OK)
        status = gbt_model_get_view(model, argc > 3 ? strtoul(argv[3], NULL, 10) : 0, &view, &err);
    if (status == GBT_OK) {
        float *rgb = malloc(3 * sizeof *rgb * (size_t)view.camera.width * (size_t)view.camera.height);
        const gbt_picture picture = {.rgb = rgb};
        if (rgb == NULL)
            status = GBT_ERR_NO_MEMORY;
        if (status == GBT_OK)
            status = gbt_model_render(model, &view.camera, false, &picture, &err);
        if (status == GBT_OK && !write_ppm(argv[2], rgb, view.camera.width, view.camera.height)) {
            status = GBT_ERR_IO;
            snprintf(err.text, sizeof err.text, "%.400s: cannot be written", argv[2]);
        }
        if (status == GBT_OK)
            printf("%s: %d x %d pixels of view %s, one of %zu\n", argv[2], view.camera.width,
                   view.camera.height, view.name, count);
        free(rgb);
    }
    if (status != GBT_OK)
        fprintf(stderr, "error: %s\n", err.text[0] != '\0' ? err.text : "out of memory");
    gbt_model_close(model);
    return gbt_status_exit_code(status);
}
