#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tools/parts_list.sh -- the parts of a Debian package with versions and licences, as SPDX 2.3 (tag-value): gbtrace and the libraries it links.
# Usage: parts_list.sh BUILD NAME. BUILD is the folder that it was built in, NAME is the package's. Versions are dpkg's, licences those of docs/parts.md.
set -eu
build=$1
name=$2
source=$(cd "$(dirname "$0")/.." && pwd)
version=$(sed -n 's/^#define GBT_VERSION "\(.*\)"/\1/p' "$source/include/gbtrace/version.h")
time=$(date -u -d "@${SOURCE_DATE_EPOCH:-$(date +%s)}" +%Y-%m-%dT%H:%M:%SZ)

# "package licence", of the first table of the page.
licences=$(awk -F ' *[|] *' '/^## / { part++ } part == 1 && $4 ~ /^`/ { gsub(/`/, "", $4); sub(/ \(.*/, "", $5); print $4, $5 }' "$source/docs/parts.md")

cat <<END
SPDXVersion: SPDX-2.3
DataLicense: CC0-1.0
SPDXID: SPDXRef-DOCUMENT
DocumentName: $name
DocumentNamespace: https://gbtrace.invalid/spdx/$name-${SOURCE_DATE_EPOCH:-$(date +%s)}
Creator: Organization: gbtrace developers
Creator: Tool: gbtrace-$version
Created: $time

PackageName: gbtrace
SPDXID: SPDXRef-gbtrace
PackageVersion: $version
PackageSupplier: Organization: gbtrace developers
PackageDownloadLocation: NOASSERTION
FilesAnalyzed: false
PackageLicenseConcluded: Apache-2.0
PackageLicenseDeclared: Apache-2.0
PackageCopyrightText: 2026 the gbtrace developers
Relationship: SPDXRef-DOCUMENT DESCRIBES SPDXRef-gbtrace
END

# The package of each library, by the place where the loader finds it: on Debian 12 dpkg knows files of /usr/lib also as files of /lib.
owner() { # library
    place=$(ldd "$build/gbtrace" "$build"/libgbtrace.so | awk -v name="$1" '$1 == name { print $3; exit }')
    dpkg-query -S "$(realpath "$place")" 2>/dev/null || dpkg-query -S "$(realpath "$place" | sed 's,^/usr,,')"
}
readelf -d "$build/gbtrace" "$build/libgbtrace.so" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' | LC_ALL=C sort -u | grep -v '^ld-linux' |
    while read -r library; do owner "$library" | sed 's/: .*//'; done | LC_ALL=C sort -u | while read -r package; do
        licence=$(printf '%s\n' "$licences" | awk -v package="$package" 'index(package, $1) == 1 { sub(/^[^ ]* /, ""); print; exit }')
        [ -n "$licence" ] || { echo "error: docs/parts.md has no licence of $package" >&2; exit 1; }
        dpkg-query -W -f '${Package} ${Version} ${source:Package} ${source:Version} ${Architecture}\n' "$package" | while read -r package version origin origin_version arch; do
            cat <<END

PackageName: $package
SPDXID: SPDXRef-$(printf '%s' "$package" | tr '+' 'x')
PackageVersion: $version
PackageSupplier: Organization: Debian
PackageDownloadLocation: NOASSERTION
PackageSourceInfo: Debian source package $origin $origin_version
ExternalRef: PACKAGE-MANAGER purl pkg:deb/debian/$(printf %s "$package" | sed "s/+/%2B/g")@$(printf '%s' "$version" | sed 's/+/%2B/g; s/:/%3A/g')?arch=$arch
FilesAnalyzed: false
PackageLicenseConcluded: NOASSERTION
PackageLicenseDeclared: $licence
PackageCopyrightText: NOASSERTION
Relationship: SPDXRef-gbtrace DYNAMIC_LINK SPDXRef-$(printf '%s' "$package" | tr '+' 'x')
END
        done
    done
