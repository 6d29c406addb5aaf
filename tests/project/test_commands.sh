#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/project/test_commands.sh -- the commands of README.md and docs/first-ten-minutes.md do what the pages say, on a small scene: each ends
# well, or with the error that the page shows beneath it. commands.txt says which are run otherwise. Usage: test_commands.sh SOURCE PROGRAM
set -u
source=$1
program=$2
. "$source/tests/cli/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1

# The program by its name. The viewer is stopped when it has said where it is.
gbtrace() {
    [ "$1" = view ] || { "$program" "$@"; return; }
    "$program" "$@" --port 0 >viewer 2>&1 &
    viewer=$!
    until grep -q 'http://' viewer; do
        kill -0 $viewer 2>/dev/null || break
        sleep 0.1
    done
    kill $viewer
    wait $viewer && grep 'http://' viewer
}

# ---- a script that a page runs by its name can be run
grep -ohE '(^    |   |`)(bench|tests|tools|examples)/[a-z_/]+(\.py|\.sh)? ' "$source"/README.md "$source"/docs/*.md | tr -d '` ' | sort -u >scripts
while IFS= read -r script; do [ -x "$source/$script" ] || echo "$script"; done <scripts >no_programs
[ -s scripts ] && [ ! -s no_programs ]
report $? "scripts that pages run by name are executable" "$(cat no_programs)"

# ---- what stands in the folder before each command
mkdir fresh && cd fresh || exit 1
(
    gbtrace make-scene tabletop -o PHOTOS --width 64 --height 48 --views 9 --points 300 --samples 1 --quiet && cp -r PHOTOS DATA &&
        gbtrace train DATA -o RUN --iterations 40 --quiet
) >../out 2>&1
report $? "a scene and a run" "$(cat ../out)"
printf '{"origin": [0, -2, -3], "target": [0, 0, 0], "up": [0, -1, 0], "fov_x_deg": 50, "width": 24, "height": 16}' >CAMERA.json
printf 'v -50 -50 -1\nv 50 -50 -1\nv 0 50 -1\nf 1 2 3\n' >wall.obj
printf '{"objects": [{"mesh": "wall.obj", "material": "mirror"}]}' >OBJECTS.json
cd ..

# ---- the commands: lines of blocks, with the error that follows if one does, and README's table, where options alone belong to render.
tr -d '\r' <"$source/README.md" | awk '
    /^    [.\/a-z]/ { sub(/^ */, ""); sub(/  +#.*/, ""); print }
    /^- / || /^\|/ {
        line = $0
        while (match(line, /`[^`]*`/)) {
            command = substr(line, RSTART + 1, RLENGTH - 2)
            line = substr(line, RSTART + RLENGTH)
            if (command ~ /^--/ && line ~ /^ with render/) print "gbtrace render RUN -o FOLDER " command
            else if (command ~ /^(gbtrace [a-z]|mpirun |\.\/run |python3 -m |cd )/) print command
        }
    }' >commands
awk '/^    (\[[0-9:]+\] )?\$ / { sub(/^[^$]*\$ /, ""); command = $0; print; next }
    /^    error: / { sub(/^ */, ""); print command " => " $0 }' "$source/docs/first-ten-minutes.md" >>commands
sed 's,build/release/gbtrace,gbtrace,g' commands | awk '!seen[$0]++' >unique
[ "$(wc -l <unique)" -ge 30 ]
report $? "the pages have commands" "$(cat unique)"

# ---- each in a fresh folder
grep -v '^#' "$source/tests/project/commands.txt" >rows
while IFS= read -r line; do
    command=${line%% => *} wanted=
    [ "$command" = "$line" ] || wanted=${line#* => }
    row=$(awk -F ' [|] ' -v command="$command" '$1 == command { print substr($0, length($1) + 4) }' rows)
    case $row in "- "*) echo "not run: $command: ${row#- }"; continue ;; esac
    case $command in *film*) command -v ffmpeg >/dev/null || { skip "$command" "ffmpeg is not installed"; continue; } ;; esac
    run=$(printf '%s' "${row:-$command}" | sed -E 's/--budget [0-9]+[ms]/--iterations 40/; /^gbtrace train/{/--iterations/!s/$/ --iterations 40/}')
    rm -rf here && cp -r fresh here && cd here || exit 1
    case $command in
    *--resume* | *"-o DATA") ;;
    *) [ -n "$wanted" ] || case " $run " in *" -o RUN "* | *" -m RUN "*) [ -n "$row" ] || rm -r RUN ;; esac ;;
    esac
    (eval "$run") >../out 2>&1 </dev/null
    code=$?
    cd ..
    if [ -n "$wanted" ]; then
        [ $code != 0 ] && grep -qxF -- "$wanted" out
    else
        [ $code = 0 ] && ! grep -q '^error: ' out
    fi
    report $? "$command" "  run as $run: exit code $code, wanted ${wanted:-0}
$(tail -n 20 out)"
done <unique

awk -F ' [|] ' 'NR == FNR { sub(/ => .*/, ""); on_page[$0] = 1; next } !($1 in on_page) { print $1 }' unique rows >stale
[ ! -s stale ]
report $? "each row of commands.txt is a command of the pages" "$(cat stale)"
finish
