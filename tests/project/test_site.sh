#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/project/test_site.sh -- the pages that ./run site makes: every link leads to a file or heading, a wrong one is said. Usage: test_site.sh SOURCE
set -u
source=$1
. "$source/tests/cli/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
for tool in cmark-gfm python3; do
    command -v $tool >/dev/null || { skip "pages" "$tool is not installed"; finish; }
done
python3 "$source/tools/site.py" "$work/site" >"$work/out" 2>&1
report $? "pages are made" "$(cat "$work/out")"
python3 "$source/tests/project/check_links.py" "$work/site" >"$work/out" 2>&1
report $? "links lead to pages, pictures and headings; each page is reached" "$(cat "$work/out")"
[ "$(ls "$work"/site/*.html | wc -l)" = "$(ls "$source"/docs/*.md | wc -l | awk '{ print $1 + 3 }')" ]
report $? "one for each document, README, CONTRIBUTING and CHANGELOG" "$(ls "$work/site")"
awk '/^[-+*] / && before != "" && before !~ /^( |- |\|)/ && before !~ /[.:;)]$/ { print FILENAME ":" FNR ": " $0 } { before = $0 }' \
    "$source"/*.md "$source"/docs/*.md "$source"/docs/decisions/*.md >"$work/out"
[ ! -s "$work/out" ]
report $? "no minus at the start of a line makes an item of a list out of a formula" "$(cat "$work/out")"

# Wrong links, in a copy.
mkdir "$work/tree" && cp -r "$source/docs" "$source/tools" "$source/README.md" "$source/CONTRIBUTING.md" "$source/CHANGELOG.md" "$work/tree/"
mkdir -p "$work/tree/include/gbtrace" "$work/tree/src/view/page" && cp "$source/include/gbtrace/version.h" "$work/tree/include/gbtrace/" &&
    cp "$source/src/view/page/icon.svg" "$work/tree/src/view/page/"
for link in 'none.md' 'training.md#none' '#none' 'images/none.png'; do
    cp "$source/docs/balls.md" "$work/tree/docs/"
    printf '\n[x](%s)\n' "$link" >>"$work/tree/docs/balls.md"
    ! python3 "$work/tree/tools/site.py" "$work/site" >"$work/out" 2>&1 && grep -qF "docs/balls.md: $link: no such" "$work/out"
    report $? "a link to $link" "$(cat "$work/out")"
done
finish
