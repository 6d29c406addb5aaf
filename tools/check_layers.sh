#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tools/check_layers.sh -- holds every #include of the library to tools/layers.txt; prints each offence, exits 1 if there is one.
#
# Usage: check_layers.sh [TREE]. Needs sh, find and awk only. The rooms are src/ROOM/ and lab/ROOM/, scenes/ at the top, and lab/lab.h.
# Beside the table: only src/bvh/embree_api.h includes Embree; C++ is in src/shim only, and nobody includes shim/; cli sees
# nothing but gbtrace/*.h, lab/lab.h and itself, public headers nothing but each other; an include with quotes is written "room/file.h" or "gbtrace/file.h".
set -u
cd "${1:-$(dirname "$0")/..}" || exit 2
[ -f tools/layers.txt ] || { echo "tools/layers.txt is not there" >&2; exit 2; }

folders=src
[ -d scenes ] && folders="$folders scenes"
[ -d lab ] && folders="$folders lab"
[ -d include ] && folders="$folders include"
find -H $folders -type f \( -name '*.c' -o -name '*.h' -o -name '*.cpp' -o -name '*.hpp' -o -name '*.cc' -o -name '*.inc' \) | LC_ALL=C sort |
    awk '
function offence(text) { print where ": " text; bad = 1 }

BEGIN {
    while ((getline line < "tools/layers.txt") > 0) {
        sub(/#.*/, "", line)
        if (line ~ /^[ \t]*$/)
            continue
        if (line !~ /^[a-z_]+:/) {
            print "tools/layers.txt: not a row: " line
            bad = 1
            continue
        }
        room = line
        sub(/:.*/, "", room)
        sub(/^[^:]*:/, "", line)
        known[room] = 1
        used = split(line, names, " ")
        for (i = 1; i <= used; i++) {
            if (!(names[i] in known) || names[i] == room) { # a row names only rows above it: no cycle
                print "tools/layers.txt: " room ": " names[i] " does not stand above it"
                bad = 1
            }
            allowed[room, names[i]] = 1
        }
    }
}
{
    file = $0
    where = file
    part_count = split(file, parts, "/")
    room = parts[1] == "src" || (parts[1] == "lab" && part_count > 2) ? parts[2] : parts[1]
    if (room == "include") # public headers see each other only
        known[room] = 1
    if (parts[1] == "src" && part_count < 3)
        offence("stands in no room")
    else if (!(room in known))
        offence("room " room " is not in tools/layers.txt")
    if (file ~ /\.(cpp|hpp|cc)$/ && room != "shim")
        offence("C++ outside src/shim")
    number = 0
    while ((getline line < file) > 0) {
        number++
        if (line !~ /^[ \t]*#[ \t]*include[ \t]*["<]/)
            continue
        where = file ":" number
        name = line
        sub(/^[^"<]*["<]/, "", name)
        sub(/[">].*/, "", name)
        if (name ~ /^embree[34]?\// && file != "src/bvh/embree_api.h")
            offence("only src/bvh/embree_api.h may include Embree")
        if (name ~ /embree_api\.h$/ && room != "bvh")
            offence("only bvh may include bvh/embree_api.h")
        if (line ~ /</)
            continue
        if (name ~ /^gbtrace\//)
            continue
        if (name !~ /^[a-z_]+\//) {
            offence("\"" name "\" is not written as \"room/file.h\"")
            continue
        }
        other = name
        sub(/\/.*/, "", other)
        if (other == "shim")
            offence("nobody includes shim/")
        else if (other != room && !((room, other) in allowed))
            offence(room " may not include " name)
    }
    close(file)
}
END {
    if (NR == 0) {
        print "no source files found"
        bad = 1
    }
    exit bad
}'
