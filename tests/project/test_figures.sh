#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/project/test_figures.sh -- pages say what docs/figures.txt (bench/figures.py) holds, and how many wrong inputs, chosen changes and
# recorded files there are; no C file is longer than CONTRIBUTING.md says. Usage: test_figures.sh PROJECT
set -u
cd "$1" || exit 1
. tests/cli/report.sh
one_line() { tr '\n' ' ' <"$1" | tr -s ' '; }
rows() { grep -cvE '^(#|make |edit |[[:space:]]*$)' "$1"; }
while IFS= read -r line; do
    page=${line%%: *}
    says=${line#*: }
    one_line "$page" | grep -qF -- "$says"
    report $? "$page: $says" "  wanted: $says"
done <<END
$(cat docs/figures.txt)
docs/reliability.md: \`malformed\`: $(rows tests/malformed/cases.txt) inputs
docs/reliability.md: \`./run mutate --chosen\` | $(rows tests/mutate/chosen.txt)
docs/reliability.md: All $(rows tests/golden/hashes.txt) files
END
[ "$passed" -ge 10 ]
report $? "there are figures" "  only $passed"
long=$(find src lab -name '*.[ch]' -exec wc -l {} + | awk '$1 > 500 && $2 != "total"')
[ -z "$long" ]
report $? "C files have 500 lines at most" "$long"
finish
