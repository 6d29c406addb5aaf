#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/project/test_names.sh -- files, options and commands that pages and comments name are there. Usage: test_names.sh SOURCE PROGRAM
set -u
cd "$1" || exit 1
program=$2
. tests/cli/report.sh
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
sources="src lab include tests scenes examples tools cmake python bench"

# Files: every path that begins with a folder of the project and ends like a file.
grep -rnoE --include='*.md' --include='*.[ch]' --include='*.cpp' --include='*.sh' --include='*.cmake' --include='*.py' --include='CMakeLists.txt' \
    '(^|[^A-Za-z0-9_./{}-])(docs|src|lab|tests|include|scenes|examples|tools|cmake|python|bench)/[A-Za-z0-9_/.-]*[A-Za-z0-9_]\.(md|c|h|cpp|json|svg|png|sh|py|txt|cmake|js|css|html|awk|cjs|mjs)\b' \
    README.md CONTRIBUTING.md CHANGELOG.md docs $sources 2>/dev/null | awk -F: '{place = $1 ":" $2; name = $0; sub(/^[^:]*:[^:]*:/, "", name); sub(/^[^A-Za-z]*/, "", name); print place, name}' |
    sort -u >"$work/files"
while read -r place name; do
    [ -e "$name" ] || [ -e "$name.in" ] || printf '%s: %s is not there\n' "$place" "$name"
done <"$work/files" | grep -v '^tests/project/' >"$work/dangling"
[ ! -s "$work/dangling" ] && [ "$(wc -l <"$work/files")" -ge 100 ]
report $? "files that are named are there" "$(cat "$work/dangling")"

# Links of pages lead to files, beside the page.
grep -rnoE --include='*.md' '\]\([^):]+\)' README.md CONTRIBUTING.md CHANGELOG.md docs | sed 's/:[0-9]*:\](/ /; s/#.*//; s/)$//' | sort -u >"$work/links"
while read -r page link; do
    [ -e "$(dirname "$page")/$link" ] || printf '%s: %s is not there\n' "$page" "$link"
done <"$work/links" >"$work/dangling"
[ ! -s "$work/dangling" ] && [ "$(wc -l <"$work/links")" -ge 40 ]
report $? "links lead to files" "$(cat "$work/dangling")"

# Papers that comments cite as "Author year" have a row of docs/references.md.
grep -rhoE --include='*.[ch]' '\b[A-Z][A-Za-z-]+ (19|20)[0-9]{2}\b' src | sort -u >"$work/cited"
while read -r name; do
    grep -qF "| $name |" docs/references.md || echo "$name"
done <"$work/cited" >"$work/unknown"
[ ! -s "$work/unknown" ] && [ "$(wc -l <"$work/cited")" -ge 20 ]
report $? "papers that are cited are in docs/references.md" "$(cat "$work/unknown")"

# A file says in its first lines what its licence is and which file it is.
for file in $(find src lab include -name '*.[ch]' -o -name '*.cpp'); do
    own=${file#src/} own=${own#include/}
    case $(head -n 1 "$file") in "/* SPDX-License-Identifier: Apache-2.0 */") ;; *) echo "$file: $(head -n 1 "$file")" ;; esac
    case $(sed -n 2p "$file") in "/* $own -- "* | "/* ${own#lab/} -- "*) ;; *) echo "$file: $(sed -n 2p "$file")" ;; esac
done >"$work/first"
[ ! -s "$work/first" ]
report $? "first lines name licence and file" "$(cat "$work/first")"

# Commands and options: what stands on a page behind gbtrace COMMAND, up to a quote or the end of the line.
"$program" describe man >"$work/man" 2>/dev/null
"$program" --help | sed -n 's/^  \([a-z-]*\) .*/\1/p' >"$work/commands"
grep -rhoE 'gbtrace [a-z-]+ [^`|)]*' README.md docs/*.md | sed 's/#.*//' >"$work/lines"
awk '{print $2}' "$work/lines" | sort -u >"$work/named"
: >"$work/unknown"
sed 's/\\-/-/g' "$work/man" | grep -oE -- '--[a-z][a-z0-9-]*' | sort -u >"$work/options"
grep -oE -- ' --[a-z][a-z_-]*' "$work/lines" | tr -d ' ' | tr _ - | sort -u | while read -r option; do
    grep -qxF -- "$option" "$work/options" || echo "$option"
done >"$work/unknown"
[ ! -s "$work/unknown" ]
report $? "options that pages name are there" "$(cat "$work/unknown")"
grep -rhoE '^(    |.*`)(build/release/)?gbtrace [a-z-]+' README.md docs/*.md | sed 's/.*gbtrace //' | sort -u | while read -r word; do
    grep -qxF -- "$word" "$work/commands" || case $word in describe | help | --help | --version) ;; *) echo "$word" ;; esac
done >"$work/unknown"
[ ! -s "$work/unknown" ]
report $? "commands that pages name are there" "$(cat "$work/unknown")"

# Formats: the page on exporting has a row for each that the program knows, and no other.
"$program" export --help | sed -n 's/^  \(\.[a-z0-9.]*\) .*/\1/p' | sort >"$work/formats"
sed -n 's/^| `\(\.[a-z0-9.]*\)` .*/\1/p' docs/exporting.md | sort -u >"$work/named"
[ -s "$work/formats" ] && cmp -s "$work/formats" "$work/named"
report $? "formats on the page on exporting" "$(diff "$work/formats" "$work/named")"
finish
