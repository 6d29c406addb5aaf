#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/package/test_deb.sh -- makes the Debian package and looks into it. Usage: test_deb.sh SOURCE BUILD. Needs cpack, dpkg-deb, dpkg-shlibdeps.
set -u
source=$1
build=$2
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
. "$source/tests/package/checks.sh"
for tool in dpkg-deb dpkg-shlibdeps; do
    command -v "$tool" >/dev/null 2>&1 || give_up "$tool is not there (Debian: dpkg-dev)"
done

umask 077
check "cpack" cpack -G DEB --config "$build/CPackConfig.cmake" -B "$work"
umask 022
deb=$(find "$work" -maxdepth 1 -name '*.deb')
dpkg-deb -c "$deb" >"$work/contents"
has() { awk -v wanted="$1" '$6 ~ "^\\./usr/" wanted "$" { found = 1 } END { exit !found }' "$work/contents"; }
check "the program" has bin/gbtrace
check "the library by its version" has 'lib/.*libgbtrace\.so\.[0-9.]+'
check "the library by its name" has 'lib/.*libgbtrace\.so'
check "headers" has include/gbtrace/model.h
check "pkg-config" has 'lib/.*pkgconfig/gbtrace\.pc'
check "CMake" has 'lib/.*cmake/gbtrace/gbtraceConfig\.cmake'
check "documents" has share/doc/gbtrace/README.md
check "files belong to root, nobody else may write" awk '$2 != "root/root" || ($1 !~ /^l/ && substr($1, 9, 1) == "w") { print; bad = 1 } END { exit bad }' "$work/contents"
check "everybody may read, whatever the umask" awk '(/^d/ && $1 != "drwxr-xr-x") || (/^-/ && $1 !~ /^-rw.r-.r-.$/) { print; bad = 1 } END { exit bad }' "$work/contents"
check "nothing from this machine's folders" sh -c "! grep -v ' \./usr/' '$work/contents' | grep -q ' \./.*[^/]$'"
dpkg-deb -I "$deb" >"$work/info"
for wanted in libc6 libstdc++6 libembree libtbb12 libopenimageio libjansson4 zlib1g libzstd1 libwebp libzip libmicrohttpd libsqlite3-0; do
    check "depends on $wanted" grep -q "^ Depends:.*$wanted" "$work/info"
done
check "depends on nothing of the tests" sh -c "! grep '^ Depends:.*flann' '$work/info'"
check "ldconfig is asked for" sh -c "dpkg-deb --ctrl-tarfile '$deb' | tar -xO ./triggers | grep -q ldconfig"
# What is our choice is in cmake/debian/lintian-overrides, with the reason.
if command -v lintian >/dev/null 2>&1; then
    lintian --allow-root "$deb" 2>/dev/null | grep '^[EW]:' >"$work/lintian"
    check "lintian says nothing" sh -c "cat '$work/lintian'; ! test -s '$work/lintian'"
fi
# Completion is where each shell of Debian looks; zsh finds it from there by the name of the command.
dpkg-deb -x "$deb" "$work/tree"
check "completion for bash" has share/bash-completion/completions/gbtrace
check "completion for fish" has share/fish/vendor_completions.d/gbtrace.fish
check "completion for zsh" has share/zsh/vendor-completions/_gbtrace
if command -v zsh >/dev/null 2>&1; then
    check "zsh looks there" zsh -fc '[[ ${fpath[(r)/usr/share/zsh/vendor-completions]} ]]'
    check "zsh completes by it" zsh -fc 'fpath=("$1"/usr/share/zsh/vendor-completions $fpath); autoload -U compinit && compinit -u -d "$1"/dump && [[ $_comps[gbtrace] = _gbtrace ]]' zsh "$work/tree"
fi
report "$work/info"
