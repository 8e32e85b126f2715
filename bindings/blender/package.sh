#!/usr/bin/env bash
# Makes the add-on's zip, for Blender's "Install..." (Edit > Preferences > Add-ons).
#
#   bindings/blender/package.sh [OUT.zip]    by default build/blender/nifkit_blender.zip
#
# NIFKIT names a folder that nifkit is installed in; then nothing is built.
set -euo pipefail

case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
out=$(realpath -m "${1:-$(dirname "${BASH_SOURCE[0]}")/../../build/blender/nifkit_blender.zip}")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

prepare_nifkit
mkdir -p "$(dirname "$out")"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
addon=$scratch/nifkit_blender
mkdir -p "$addon/nifkit"
cp bindings/blender/nifkit_blender/*.py LICENSE NOTICE "$addon"
# The package for Python, as its wheel has it.
cp bindings/python/nifkit/*.py "$addon/nifkit"
strip --strip-unneeded -o "$addon/nifkit/libnif.so" "$(realpath "$prefix"/lib*/libnif.so | head -n 1)"
# The same bytes from the same sources.
(cd "$scratch" && find nifkit_blender -type f | LC_ALL=C sort >list \
  && python3 - "$out.new" list <<'PYTHON'
import sys, zipfile
with zipfile.ZipFile(sys.argv[1], "w", zipfile.ZIP_DEFLATED) as package:
    for name in open(sys.argv[2], encoding="utf-8").read().split("\n")[:-1]:
        entry = zipfile.ZipInfo(name)
        entry.external_attr, entry.compress_type = 0o644 << 16, zipfile.ZIP_DEFLATED
        package.writestr(entry, open(name, "rb").read())
PYTHON
)
mv "$out.new" "$out"
echo "$out"
