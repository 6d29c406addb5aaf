# SPDX-License-Identifier: Apache-2.0
# tools/release.sh -- the files of a release, and their checksums. Read by ./run, whose functions it uses.

# Each file is made from the last commit, in the state of that commit's time, and has the same bytes whenever and wherever it is made again.
# What cannot be made here is said at the end, in a line each.
release() {
    local dist=build/dist version name suite changes before='' missing=()
    is_repository && changes=$(git status --porcelain) || { say "error: a release is made of a commit (wanted a git repository: $top)"; return 1; }
    [ -z "$changes" ] || { say "error: a release is made of a commit: there are changes that are in none (git status)"; return 1; }
    version=$(sed -n 's/^#define GBT_VERSION "\(.*\)"/\1/p' include/gbtrace/version.h)
    grep -q "^## \[$version\] - [0-9]" CHANGELOG.md || { say "error: CHANGELOG.md has no day of version $version"; return 1; }
    grep -q "gbtrace-$version.tar.gz" docs/packages.md || { say "error: docs/packages.md names the files of another version than $version"; return 1; }
    SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
    export SOURCE_DATE_EPOCH
    name=gbtrace-$version
    [ "$(cat "$dist/COMMIT" 2>/dev/null)" != "$(git rev-parse HEAD)" ] || before=$(cat "$dist/SHA256SUMS" 2>/dev/null)
    rm -rf "$dist"
    mkdir -p "$dist"
    git rev-parse HEAD >"$dist/COMMIT"

    git archive --prefix="$name/" HEAD | gzip -n -9 >"$dist/$name.tar.gz" || return 1
    for suite in bookworm trixie bookworm-arm64 trixie-arm64; do
        say "release: Debian package of $suite"
        if in_chroot "$suite" package >&2; then
            cp "$chroots/$suite"/src/gbtrace/build/package/*.deb "$chroots/$suite"/src/gbtrace/build/package/*.spdx "$dist/" || return 1
        else
            missing+=("the Debian package of $suite: its chroot or its build failed, see above")
        fi
    done
    release_wheel "$dist" >&2 || missing+=("the wheel: pip and scikit-build-core from PyPI are needed, see above")
    if site; then
        tar --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --mode=u+rw,go=rX --transform="s,^site,$name-docs," -C build -cf - site |
            gzip -n -9 >"$dist/$name-docs.tar.gz" || return 1
    else
        missing+=("the pages: cmark-gfm is needed")
    fi
    if ! tool lintian; then
        missing+=("lintian's judgement: it is not here")
    elif ! lintian --allow-root --fail-on error,warning "$dist"/*.deb; then
        missing+=("packages that are lintian clean, see above")
    fi

    (cd "$dist" && sha256sum -- "$name"* gbtrace_* *.whl 2>/dev/null | LC_ALL=C sort -u -k 2 >SHA256SUMS)
    cat "$dist/SHA256SUMS"
    if [ -n "$before" ]; then
        [ "$before" = "$(cat "$dist/SHA256SUMS")" ] && echo "The same bytes as the last time." || { echo "Other bytes than the last time:"; diff <(echo "$before") "$dist/SHA256SUMS"; missing+=("the same bytes as the last time"); }
    fi
    [ "${#missing[@]}" -eq 0 ] && return 0
    printf 'missing: %s\n' "${missing[@]}" >&2
    return 1
}

# Python alone: it loads the library of the Debian package, so one file is for every Debian and processor.
release_wheel() { # folder
    python3 -m pip --version >/dev/null 2>&1 || as_root env DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends python3-pip || return 1
    python3 -m pip -q wheel --no-deps --disable-pip-version-check --config-settings=wheel.cmake=false --wheel-dir "$1" .
}
