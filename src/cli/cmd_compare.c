/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_compare.c -- gbtrace compare. */
#include <math.h>
#include <stdio.h>

#include "cli/options.h"
#include "cli/progress.h"
#include "gbtrace/evaluate.h"

static void print_number(const char *name, double value, const char *end)
{
    printf("\"%s\": ", name);
    json_write_number(stdout, value);
    fputs(end, stdout);
}

static bool json;
static const char *network;

static const option *options(int *count)
{
    static const option rows[] = {
        {.name = "lpips", .kind = OPTION_STRING, .value = &network, .value_name = "FILE", .help = LPIPS_HELP},
        {.name = "json", .kind = OPTION_FLAG, .value = &json, .help = "print JSON"},
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    gbt_error err = {0};
    gbt_comparison c;
    const gbt_status status = gbt_compare_images(given->value[0], given->value[1], network, &c, &err);
    if (status != GBT_OK)
        return command_failed(status, &err);
    if (json) {
        printf("{\"schema\": 1, \"width\": %d, \"height\": %d, ", c.width, c.height);
        print_number("psnr", c.psnr, ", ");
        print_number("ssim", c.ssim, ", ");
        print_number("ssim_interior", c.ssim_interior, ", ");
        if (network != NULL) {
            print_number("lpips", c.lpips, ", ");
            print_number("lpips_01", c.lpips_01, ", ");
        }
        print_number("flip", c.flip, "}\n");
    } else {
        char inside[32] = "n/a"; /* pictures smaller than a window have none inside */
        if (!isnan(c.ssim_interior))
            snprintf(inside, sizeof inside, "%.6f", c.ssim_interior);
        printf("%d x %d: PSNR %.4f dB, SSIM %.6f (windows inside: %s), FLIP %.6f", c.width, c.height, c.psnr,
               c.ssim, inside, c.flip);
        if (network != NULL)
            printf(", LPIPS %.6f (colours in [0, 1]: %.6f)", c.lpips, c.lpips_01);
        putchar('\n');
    }
    return 0;
}

const command command_compare = {.name = "compare",
                                 .summary = "compare two pictures: PSNR, SSIM, FLIP, LPIPS",
                                 .usage = "IMAGE REFERENCE",
                                 .options = options,
                                 .min_operands = 2,
                                 .max_operands = 2,
                                 .run = run};
