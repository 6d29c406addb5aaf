#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/project/check_text.sh -- lines of the sources that break a rule. Usage: check_text.sh RULE SOURCE
set -u
cd "$2" || exit 1
case $1 in
lines) # at most 110 columns
    grep -rnE '^.{111}' --include=*.[ch] --include=*.cpp src lab include examples scenes
    ;;
messages) # the library names fields; dashes are the program's. A page of a run (report) has style sheets, and the command that made it.
    grep -rnE '"([^"]*[^-"a-z])?--[a-z]' --include=*.c --include=*.h --include=*.cpp --exclude-dir=cli --exclude-dir=report src
    ;;
functions) # of the C library whose last bits differ between x86-64 and ARM, or between its versions (docs/reliability.md)
    grep -rnE '(^|[^a-z_0-9])(hypot|cbrtf?|exp2f?|exp10f?|a?(sin|cos|tan)hf|a(sin|cos|tan|tan2)f|tanf|erfc?f?|[lt]gammaf?)\(' --include=*.c --include=*.h src lab scenes
    ;;
esac
[ $? = 1 ] # 0: there are some; 2: grep itself failed
