#!/usr/bin/env bash
# Makes a release candidate of the commit that is checked out: the source as a .tar.gz, Debian packages of the runtime, the
# program and the GPU module, everything that is installed as a .tar.gz, a wheel for Python, a bill of materials (SPDX), and SHA256SUMS.
# A second run on the same commit and the same system makes the same bytes.
#
#   tools/release.sh [--output FOLDER] [-- CMAKE OPTIONS]      FOLDER: build/candidate
#
# Examples:
#   tools/release.sh
#   tools/release.sh -- -DNIF_WITH_CGAL=OFF                    a program without GPL code
#   tools/release.sh -- -DNIF_BUILD_TOOLS=OFF                  the runtime alone
#
# Builds from scratch in a separate folder, which takes as long as a clean build. If lintian is installed, the packages must
# pass it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() { echo "tools/release.sh: $1" >&2 && exit "${2:-1}"; }
output=build/candidate
while (($#)); do
  case $1 in
    --output) (($# > 1)) || fail '--output needs a folder' 2; output=$2; shift 2 ;;
    --) shift; break ;;
    -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
    *) fail "unknown option '$1'; see --help" 2 ;;
  esac
done
[[ -z $(git status --porcelain) ]] || fail 'there are uncommitted changes'
for program in cmake cpack ninja dpkg-shlibdeps python3; do
  command -v "$program" >/dev/null || fail "$program is not installed"
done

SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH LC_ALL=C TZ=UTC
umask 022
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
version=$(sed -nE 's/^#define NIF_VERSION_(MAJOR|MINOR|PATCH) ([0-9]+)$/\2/p' runtime/include/nif/nif.h | paste -sd.)
name=nifkit-$version

mkdir "$work/made"
git archive --prefix="$name/" --mtime="@$SOURCE_DATE_EPOCH" HEAD 2>/dev/null >"$work/source.tar" \
  || git archive --prefix="$name/" HEAD >"$work/source.tar"
gzip -9n <"$work/source.tar" >"$work/made/$name-source.tar.gz"
tar -xf "$work/source.tar" -C "$work"

# Keeps paths of this machine out of the binaries.
flags="-ffile-prefix-map=$work/$name=. -ffile-prefix-map=$work/build=build"
cmake -S "$work/$name" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr \
  -DNIF_BUILD_TESTS=OFF "-DCMAKE_C_FLAGS=$flags" "-DCMAKE_CXX_FLAGS=$flags" "$@" >/dev/null
cmake --build "$work/build" --parallel "$(nproc)"
(cd "$work/build" && cpack >/dev/null)
mv "$work"/build/*.deb "$work/made/"
cp "$work/build/packaging/nifkit.spdx.json" "$work/made/$name.spdx.json"

# cpack packs files in directory order, with the times at which they were made.
mkdir "$work/tree"
tar -xzf "$work/build/$name-Linux.tar.gz" -C "$work/tree"
tar -c --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --format=gnu -C "$work/tree" \
  "$name-Linux" | gzip -9n >"$work/made/$name-linux-$(dpkg --print-architecture).tar.gz"

# shellcheck source=bindings/python/python.sh
source bindings/python/python.sh
if find_python pip setuptools wheel >/dev/null; then
  NIFKIT=$work/tree/$name-Linux/usr "$work/$name/bindings/python/build.sh" "$work/made" >/dev/null
else
  echo 'tools/release.sh: no Python with pip, setuptools and wheel (tools/setup.sh python); no wheel was made' >&2
fi

if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error,warning "$work"/made/*.deb
else
  echo 'tools/release.sh: lintian is not installed; the packages were not checked' >&2
fi
(cd "$work/made" && sha256sum -- * >SHA256SUMS)
mkdir -p "$(dirname "$output")"
rm -rf "$output"
mv "$work/made" "$output"
echo "$output:"
cat "$output/SHA256SUMS"
