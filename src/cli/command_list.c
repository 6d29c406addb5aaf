/* SPDX-License-Identifier: Apache-2.0 */
/* cli/command_list.c -- the list of subcommands. To add one: a file cmd_NAME.c, its variable in command.h,
   and an entry here. */
#include "cli/command.h"

const command *const command_list[] = {
    &command_demo,   &command_pose,    &command_info,       &command_init,   &command_train,
    &command_eval,   &command_compare, &command_compress,   &command_export, &command_import,
    &command_render, &command_report,  &command_view,       &command_query,  &command_make_scene,
    &command_bench,  &command_study,   &command_check_grad, &command_doctor, &command_describe,
};

const int command_list_count = sizeof command_list / sizeof *command_list;
