#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/package/test_install.sh -- installs into a temporary prefix and uses what is there as somebody else would.
# Usage: test_install.sh SOURCE BUILD. Needs cmake, ninja, cc, c++, pkg-config, nm.
set -u
source=$1
build=$2
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix
. "$source/tests/package/checks.sh"

check "install" cmake --install "$build" --prefix "$prefix"
library=$(find "$prefix" -name 'libgbtrace.so' | head -n 1)
folder=$(dirname "$library")

check "completion for zsh, where /usr/local has it" test -s "$prefix/share/zsh/site-functions/_gbtrace"

# Only gbt_ symbols, and every function that a header declares.
nm -D --defined-only "$library" | awk '{ print $3 }' | LC_ALL=C sort >"$work/shown"
sed -n 's/^[a-z][a-z_ *]*[ *]\(gbt_[a-z0-9_]*\)(.*/\1/p; s/^const char \*const \*\(gbt_[a-z_]*\)(.*/\1/p' "$prefix"/include/gbtrace/*.h | LC_ALL=C sort -u >"$work/declared"
check "the library shows what its headers declare, and no more" diff "$work/declared" "$work/shown"
check "there are headers with functions" test "$(wc -l <"$work/declared")" -ge 40
soname=$(readelf -d "$library" | sed -n 's/.*soname: \[\(.*\)\]/\1/p')
version=$(sed -n 's/^#define GBT_VERSION "\([0-9]*\)\..*/\1/p' "$prefix/include/gbtrace/version.h")
check "the soname is of the headers' first number" test "$soname" = "libgbtrace.so.$version"

# Headers are complete: each alone, twice, as C11 and C++17, from the installed tree.
alone() { # compiler, language, standard
    for header in "$prefix"/include/gbtrace/*.h; do
        name=gbtrace/$(basename "$header")
        printf '#include <%s>\n#include <%s>\nint main(void) { return 0; }\n' "$name" "$name" |
            "$1" -x "$2" -std="$3" -Wall -Wextra -Wpedantic -Werror -I "$prefix/include" -fsyntax-only - || return 1
    done
}
check "headers alone as C11" alone cc c c11
check "headers alone as C++17" alone c++ c++ c++17

# The examples, by pkg-config and by CMake.
PKG_CONFIG_PATH=$folder/pkgconfig
export PKG_CONFIG_PATH
by_pkg_config() {
    for example in render train pose; do
        cc -std=c11 -O2 -Wall -Wextra -Werror $(pkg-config --cflags gbtrace) "$source/examples/$example.c" -o "$work/$example" $(pkg-config --libs gbtrace) -lm \
            -Wl,-rpath,"$folder" || return 1
    done
}
by_cmake() {
    cmake -G Ninja -S "$source/examples" -B "$work/by_cmake" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release && cmake --build "$work/by_cmake"
}
check "examples by pkg-config" by_pkg_config
check "examples by CMake" by_cmake
check "the version that pkg-config says" test "$(pkg-config --modversion gbtrace)" = "$("$prefix/bin/gbtrace" --version | sed 's/gbtrace //')"

# Folders of other names: relative ones move with the tree.
other_folders() {
    cmake -G Ninja -S "$source" -B "$work/other" -DCMAKE_INSTALL_INCLUDEDIR=include/other -DCMAKE_INSTALL_LIBDIR=/elsewhere/lib &&
        grep -x 'includedir=${prefix}/include/other' "$work/other/gbtrace.pc" && grep -x 'libdir=/elsewhere/lib' "$work/other/gbtrace.pc" &&
        grep -rF 'INTERFACE_INCLUDE_DIRECTORIES "${_IMPORT_PREFIX}/include/other"' "$work/other/CMakeFiles/Export"
}
check "folders of other names" other_folders

# They run: a scene, a short training, a picture, a pose.
check "make-scene" "$prefix/bin/gbtrace" make-scene tabletop -o "$work/data" --width 64 --height 48 --views 12 --points 300 --samples 4
check "example train" "$work/by_cmake/train" "$work/data" "$work/run" 150
check "example render" "$work/by_cmake/render" "$work/run" "$work/view.ppm" 1
check "the picture has its size" test "$(head -c 9 "$work/view.ppm" | tr '\n' ' ')" = "P6 64 48 "
check "example render says what is missing" sh -c "! '$work/render' '$work/none' '$work/x.ppm' 2>'$work/said' && grep -q '^error: .*none' '$work/said'"
check "example pose" sh -c "'$work/pose' '$work/run' >'$work/pose.txt'"
check "the pose is found" awk '/^before/ { d = $2; a = $5 } /^after/ { ok = $2 < 0.01 * d && $5 < 0.01 * a } END { exit !ok }' "$work/pose.txt"
report "$work/pose.txt"
