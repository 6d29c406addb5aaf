/* SPDX-License-Identifier: Apache-2.0 */
/* cli/describe_man.c -- the manual page. */
#include "cli/describe.h"
#include "gbtrace/version.h"

/* Write one line of text, escaped so that roff sees no request or escape sequence in it. */
static void write_text(FILE *out, const char *text)
{
    if (*text == '.' || *text == '\'')
        fputs("\\&", out);
    for (; *text != '\0'; text++)
        switch (*text) {
        case '\\':
            fputs("\\e", out);
            break;
        case '-':
            fputs("\\-", out);
            break;
        case '\'':
            fputs("\\(aq", out);
            break;
        case '`':
            fputs("\\(ga", out);
            break;
        case '^':
            fputs("\\(ha", out);
            break;
        case '~':
            fputs("\\(ti", out);
            break;
        default:
            fputc(*text, out);
        }
}

static void write_rows(const option_table *t, FILE *out)
{
    for (int i = 0; i < t->own; i++) {
        const option *o = &t->rows[i];
        if (o->kind == OPTION_ELSEWHERE)
            continue;
        const char *value_name = options_value_name(o);
        char notes[512], help[HELP_TEXT_SIZE];
        fputs(".TP\n\\fB", out);
        if (o->short_name != 0)
            fprintf(out, "\\-%c\\fR, \\fB", o->short_name);
        fputs("\\-\\-", out);
        write_text(out, o->name);
        fputs("\\fR", out);
        if (value_name[0] != '\0') {
            fputs(" \\fI", out);
            write_text(out, value_name);
            fputs("\\fR", out);
        }
        fputc('\n', out);
        write_text(out, options_help_text(o, help, sizeof help));
        options_notes(o, true, notes, sizeof notes);
        write_text(out, notes);
        fputc('\n', out);
    }
}

static const char head[] =
    ".SH NAME\n"
    "gbtrace \\- neural Gaussian scenes from photos, ray traced on the CPU\n"
    ".SH SYNOPSIS\n"
    ".B gbtrace\n"
    ".I COMMAND\n"
    ".RI [ arguments ]\n"
    ".br\n"
    ".B gbtrace help\n"
    ".RI [ COMMAND ]\n"
    ".br\n"
    ".BR \"gbtrace \\-\\-version\" \" (\" \\-V \", \" \\-v )\n"
    ".SH DESCRIPTION\n"
    "gbtrace trains neural Gaussian scenes from posed photos, renders them by ray tracing with Embree, "
    "scores, compresses and exports them.\n"
    "Results go to standard output, progress and errors to standard error.\n"
    ".PP\n"
    "Every option can also be given by its other names, and with underscores for dashes.\n"
    ".SH COMMANDS\n";

static const char tail[] =
    ".SH COMMON OPTIONS\n"
    "Every command has these.\n"
    ".TP\n\\fB\\-\\-config\\fR \\fIFILE\\fR\n"
    "Read options from lines\n.I name\n=\n.IR value ;\nlines that start with # are comments, flags are true "
    "or false.\n"
    ".TP\n\\fB\\-\\-progress\\fR \\fIauto|json|none\\fR\n"
    "Progress on standard error: text, one JSON object per line, or warnings and errors only.\n"
    ".TP\n\\fB\\-\\-quiet\\fR\nThe same as\n.BR \"\\-\\-progress none\" .\n"
    ".TP\n\\fB\\-h\\fR, \\fB\\-\\-help\\fR\n"
    "List the options that most people need.\n"
    ".TP\n\\fB\\-\\-help\\-all\\fR\n"
    "List all options of the command.\n"
    ".SH ENVIRONMENT\n"
    ".TP\n\\fBGBTRACE_\\fIOPTION\\fR\n"
    "Value of an option, for every command that has it: its name in capitals, with underscores for dashes.\n"
    ".B GBTRACE_THREADS=4\n"
    "is\n.B \\-\\-threads 4.\n"
    ".TP\n\\fBGBTRACE_\\fICOMMAND\\fB_\\fIOPTION\\fR\n"
    "The same for one command; it overrides the general one:\n.BR GBTRACE_TRAIN_BUDGET=10m .\n"
    ".PP\n"
    "The environment overrides\n.BR \\-\\-config ,\nthe command line overrides both. Empty variables are "
    "ignored.\n"
    ".TP\n\\fBGBT_ISA\\fR\n"
    "Highest instruction set that tracing, splats, networks and loss use:\n.BR plain ,\n.BR neon ,\n.B "
    "avx2\nor\n"
    ".BR avx512 .\nThe results are the same.\n"
    ".SH EXIT STATUS\n"
    ".TP\n0\ndone\n"
    ".TP\n1\na check failed (doctor, check\\-grad), or an internal error\n"
    ".TP\n2\nusage\n"
    ".TP\n3\nbad input\n"
    ".TP\n4\ninput or output failed\n"
    ".TP\n5\nout of memory, or over a limit\n"
    ".TP\n130\nstopped by SIGINT or SIGTERM, after saving; a signal\n.I n\nmore than a second "
    "after the first ends the process at once: 128+\\fIn\\fR in a shell\n"
    ".TP\n141\nwho read the output has left\n"
    ".SH EXAMPLES\n"
    ".nf\n"
    "gbtrace train PHOTOS \\-o RUN \\-\\-budget 10m\n"
    "gbtrace render RUN \\-o FOLDER \\-\\-split all\n"
    "gbtrace export RUN scene.ply scene.spz\n"
    ".fi\n";

static void write_words(FILE *out, const command_word *(*list)(void))
{
    const command_word *words = list != NULL ? list() : NULL;
    for (int w = 0; words != NULL && words[w].name != NULL; w++) {
        fprintf(out, ".TP\n\\fB%s\\fR\n", words[w].name);
        write_text(out, words[w].help);
        fputc('\n', out);
    }
}

void describe_man(FILE *out)
{
    fprintf(out,
            ".\\\" Made by gbtrace describe man.\n.TH GBTRACE 1 \"\" \"gbtrace %s\" \"User Commands\"\n%s",
            gbt_version(), head);
    for (int i = 0; i < command_list_count; i++) {
        const command *c = command_list[i];
        fputs(".SS gbtrace ", out);
        write_text(out, c->name);
        fputc(' ', out);
        write_text(out, c->usage);
        fputc('\n', out);
        write_text(out, c->summary);
        fputs(c->alias != NULL ? " (also " : "", out);
        write_text(out, c->alias != NULL ? c->alias : "");
        fputs(c->alias != NULL ? ").\n" : ".\n", out);
        write_words(out, c->words);
        write_words(out, c->endings);
        option_table t;
        options_table(c, &t);
        write_rows(&t, out);
    }
    fputs(tail, out);
}
