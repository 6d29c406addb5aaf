/* SPDX-License-Identifier: Apache-2.0 */
/* cli/command_list.c -- which subcommands there are. A new one is a file cmd_NAME.c, a line in command.h and
   a line here. */
#include "cli/command.h"

const command *const command_list[] = {
    &command_demo,   &command_pose,    &command_info,       &command_init,   &command_train,
    &command_eval,   &command_compare, &command_compress,   &command_export, &command_import,
    &command_render, &command_report,  &command_view,       &command_query,  &command_make_scene,
    &command_bench,  &command_study,   &command_check_grad, &command_doctor, &command_describe,
};

const int command_list_count = sizeof command_list / sizeof *command_list;
