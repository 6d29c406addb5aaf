/* train/run_log.c -- the progress line, log.csv and train.json. */
#include "train/run_log.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/cpu.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "bvh/device.h"

static const double row_every_seconds = 1, line_every_seconds = 10;

static const char header[] =
    "step,seconds,progress,width,height,loss,l1,ssim,train_psnr,test_psnr,anchors,gaussians,visible_anchors,blended_per_ray,rays_per_second,"
    "photo_ms,rays_ms,visible_ms,decode_ms,build_ms,trace_ms,loss_ms,adjoint_ms,decode_adjoint_ms,optimizer_ms,adjust_ms,memory_bytes\n";

/* Start the file, or go back to where the checkpoint was made: rows of steps that will be taken again, or that a kill cut short, go. */
static gbt_status rewind_rows(const char *csv_path, uint64_t step, gbt_error *err)
{
    unsigned char *bytes = NULL;
    size_t size = 0, kept = 0;
    if (step > 0 && file_exists(csv_path))
        GBT_TRY(file_read(csv_path, &bytes, &size, err));
    if (size >= sizeof header - 1 && memcmp(bytes, header, sizeof header - 1) == 0)
        kept = sizeof header - 1;
    for (const unsigned char *end; kept > 0 && (end = memchr(bytes + kept, '\n', size - kept)) != NULL; kept = (size_t)(end - bytes) + 1)
        if (strtoull((const char *)bytes + kept, NULL, 10) > step)
            break;
    const gbt_status status = kept > 0 ? file_write_atomic(csv_path, bytes, kept, err) : file_write_atomic(csv_path, header, sizeof header - 1, err);
    mem_free(bytes);
    return status;
}

gbt_status run_log_open(run_log *log, const trainer *t, const char *csv_path, gbt_error *err)
{
    memset(log, 0, sizeof *log);
    log->on_terminal = isatty(STDERR_FILENO);
    log->last_row_seconds = log->last_line_seconds = t->seconds;
    GBT_TRY(rewind_rows(csv_path, t->step, err));
    log->csv = fopen(csv_path, "a");
    if (log->csv == NULL)
        return base_fail(err, GBT_ERR_IO, "%s: cannot write", csv_path);
    log_info("%s: %zu photos to train on, %zu held out; %s -> %zu anchors x %d (voxel size %.4g, extent %.4g, distance input %s)", t->scene.folder,
             t->train_count, t->test_count, t->start_text, t->anchors.count, t->anchors.offset_count, (double)t->voxel_size, t->extent,
             t->decoder.has_distance ? "on" : "off");
    return GBT_OK;
}

static void add_step(run_sums *s, const trainer *t, const step_report *r)
{
    const frame *f = &t->frame;
    s->steps++;
    s->loss += r->loss, s->l1 += r->l1, s->ssim += r->ssim, s->psnr += r->psnr;
    s->gaussians += (double)r->gaussians, s->visible += (double)r->visible;
    s->rays += (double)f->counters.rays, s->hits += (double)f->counters.hits, s->blended += (double)f->counters.blended;
    s->seconds += r->total_seconds, s->photo += r->photo_seconds, s->loss_seconds += r->loss_seconds;
    s->optimizer += r->optimizer_seconds, s->adjust += r->adjust_seconds;
    s->rays_seconds += f->times.rays, s->visible_seconds += f->times.visible, s->decode += f->times.decode, s->build += f->times.build;
    s->trace += f->times.trace, s->adjoint += f->times.adjoint, s->decode_adjoint += f->times.decode_adjoint;
}

static void write_row(run_log *log, const trainer *t, int width, int height, double test_psnr)
{
    const run_sums *s = &log->row;
    const double n = s->steps > 0 ? (double)s->steps : 1, ms = 1000 / n;
    char test[32] = "";
    if (isfinite(test_psnr))
        snprintf(test, sizeof test, "%.4f", test_psnr);
    fprintf(log->csv, "%llu,%.3f,%.5f,%d,%d,%.6f,%.6f,%.6f,%.4f,%s,%zu,%.0f,%.0f,%.2f,%.0f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%zu\n",
            (unsigned long long)t->step, t->seconds, pace_progress(&t->pace, t->step), width, height, s->loss / n, s->l1 / n, s->ssim / n, s->psnr / n,
            test, t->anchors.count, s->gaussians / n, s->visible / n, s->blended / fmax(s->rays, 1), s->rays / fmax(s->seconds, 1e-9), s->photo * ms,
            s->rays_seconds * ms, s->visible_seconds * ms, s->decode * ms, s->build * ms, s->trace * ms, s->loss_seconds * ms, s->adjoint * ms,
            s->decode_adjoint * ms, s->optimizer * ms, s->adjust * ms, mem_peak_bytes());
    fflush(log->csv);
    memset(&log->row, 0, sizeof log->row);
    log->last_row_seconds = t->seconds;
}

static void progress_line(run_log *log, const trainer *t, const step_report *r)
{
    const double progress = pace_progress(&t->pace, t->step), left = progress > 0 ? t->seconds * (1 - progress) / progress : 0;
    const double left_shown = t->pace.known < PACE_SEGMENTS ? fmax(0, t->def.budget_seconds - t->seconds) : left;
    fprintf(stderr, "%sstep %llu  %3.0f %%  %dx%d  loss %.4f  psnr %.2f  anchors %zu  gaussians %zu  %.2f Mrays/s  %zu MB  %.0f:%02.0f left%s",
            log->on_terminal ? "\r" : "", (unsigned long long)t->step, 100 * progress, r->width, r->height, r->loss, log->psnr_smooth, t->anchors.count,
            r->gaussians, log->row.steps > 0 ? log->row.rays / fmax(log->row.seconds, 1e-9) * 1e-6 : (double)t->frame.counters.rays / r->total_seconds * 1e-6,
            mem_peak_bytes() / 1000000, floor(left_shown / 60), floor(fmod(left_shown, 60)), log->on_terminal ? "  " : "\n");
    log->last_line_seconds = t->seconds;
}

void run_log_step(run_log *log, const trainer *t, const step_report *report)
{
    add_step(&log->row, t, report);
    add_step(&log->all, t, report);
    log->psnr_smooth = log->all.steps == 1 ? report->psnr : 0.98 * log->psnr_smooth + 0.02 * report->psnr;
    if (t->seconds - log->last_line_seconds >= (log->on_terminal ? 0.5 : line_every_seconds))
        progress_line(log, t, report);
    if (t->seconds - log->last_row_seconds >= row_every_seconds)
        write_row(log, t, report->width, report->height, NAN);
}

void run_log_evaluation(run_log *log, const trainer *t, double psnr)
{
    if (log->evaluated_count < GBT_TRAIN_MAX_EVALS) {
        log->evaluated_seconds[log->evaluated_count] = t->seconds;
        log->evaluated_step[log->evaluated_count] = t->step;
        log->evaluated_psnr[log->evaluated_count++] = psnr;
    }
    write_row(log, t, t->frame.rgb.width, t->frame.rgb.height, psnr);
    log_info("%sheld-out PSNR after %.1f s (step %llu): %.3f dB", log->on_terminal ? "\n" : "", t->seconds, (unsigned long long)t->step, psnr);
}

gbt_status run_log_summary(run_log *log, const trainer *t, const char *json_path, gbt_error *err)
{
    if (log->on_terminal)
        fputc('\n', stderr);
    const run_sums *s = &log->all;
    const double n = s->steps > 0 ? (double)s->steps : 1, ms = 1000 / n;
    json_t *root = json_object(), *stages = json_object(), *parts = json_array(), *evals = json_array();
    const struct { const char *name; double value; } stage[] = {
        {"photo", s->photo}, {"rays", s->rays_seconds}, {"visible", s->visible_seconds}, {"decode", s->decode}, {"build", s->build}, {"trace", s->trace},
        {"loss", s->loss_seconds}, {"adjoint", s->adjoint}, {"decode_adjoint", s->decode_adjoint}, {"optimizer", s->optimizer}, {"adjust", s->adjust}, {"all", s->seconds}};
    for (size_t i = 0; i < sizeof stage / sizeof *stage; i++)
        json_object_set_new(stages, stage[i].name, json_real(stage[i].value * ms));
    for (int i = 0; i < t->pace.known; i++)
        json_array_append_new(parts, json_integer((json_int_t)t->pace.steps[i]));
    for (int i = 0; i < log->evaluated_count; i++)
        json_array_append_new(evals, json_pack("{s:f,s:I,s:f}", "seconds", log->evaluated_seconds[i], "step", (json_int_t)log->evaluated_step[i], "psnr",
                                               log->evaluated_psnr[i]));
    json_object_set_new(root, "schema", json_integer(1));
    json_object_set_new(root, "command", json_string(t->def.command));
    json_object_set_new(root, "data", json_string(t->scene.folder));
    json_object_set_new(root, "start", json_string(t->start_text));
    json_object_set_new(root, "points", json_integer((json_int_t)t->points_used));
    json_object_set_new(root, "anchors_initial", json_integer((json_int_t)t->anchors_initial));
    json_object_set_new(root, "anchors_final", json_integer((json_int_t)t->anchors.count));
    json_object_set_new(root, "iterations", json_integer((json_int_t)t->step));
    json_object_set_new(root, "skipped_steps", json_integer((json_int_t)t->skipped_steps));
    json_object_set_new(root, "revivals", json_integer((json_int_t)t->revivals));
    json_object_set_new(root, "exposure", json_boolean(t->exposures.count > 0));
    json_object_set_new(root, "train_seconds", json_real(t->seconds));
    json_object_set_new(root, "rays_per_second", json_real(s->rays / fmax(s->seconds, 1e-9)));
    json_object_set_new(root, "hits_per_ray", json_real(s->hits / fmax(s->rays, 1)));
    json_object_set_new(root, "blended_per_ray", json_real(s->blended / fmax(s->rays, 1)));
    json_object_set_new(root, "gaussians_per_view", json_real(s->gaussians / n));
    json_object_set_new(root, "stage_ms_per_step", stages);
    json_object_set_new(root, "pace", parts);
    json_object_set_new(root, "held_out", evals);
    json_object_set_new(root, "downscale", json_real(t->def.downscale));
    json_object_set_new(root, "eval_split", json_string(t->def.eval_split));
    json_object_set_new(root, "seed", json_integer((json_int_t)t->def.seed));
    json_object_set_new(root, "threads", json_integer(parallel_threads()));
    char processor[128];
    cpu_processor_name(processor, sizeof processor);
    json_object_set_new(root, "processor", json_string(processor));
    json_object_set_new(root, "isa", json_string(cpu_isa_name(cpu_best_isa())));
    json_object_set_new(root, "embree_version", json_string(bvh_embree_version()));
    json_object_set_new(root, "peak_memory_bytes", json_integer((json_int_t)mem_peak_bytes()));
    char *text = json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    json_decref(root);
    if (text == NULL)
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory", json_path);
    const gbt_status status = file_write_atomic(json_path, text, strlen(text), err);
    free(text);
    return status;
}

void run_log_close(run_log *log)
{
    if (log->csv != NULL)
        fclose(log->csv);
    log->csv = NULL;
}
