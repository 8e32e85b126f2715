#!/usr/bin/env bash
# Assembles the page in build/samples/playcanvas/page: the files of page/ and those that samples/webgpu shares, PlayCanvas from npm,
# the object's words and the shader's text as `nif export-shader` writes them, and triangles to draw.
#
#   samples/playcanvas/build.sh ASSET.nif MESH [CREDIT]
#
# CREDIT is a sentence about the model that the page shows. Needs `nif` (build/release/bin/nif, or what the variable nif names),
# and npm's registry the first time.
set -euo pipefail
if (($# < 2 || $# > 3)) || [[ $1 == -* ]]; then
  sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2
  exit 2
fi
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
asset=$1 mesh=$2 credit=${3-}
nif=${nif-build/release/bin/nif}
out=build/samples/playcanvas
# shellcheck source=samples/webgpu/assemble.sh
source samples/webgpu/assemble.sh
fetch_npm samples/playcanvas

page=$out/page
rm -rf "$page.new"
mkdir -p "$page.new"
cp samples/playcanvas/page/* samples/webgpu/page/{nif.js,rays.js,style.css} "$page.new"
cp "$out/npm/node_modules/playcanvas/build/playcanvas.min.mjs" "$page.new/playcanvas.mjs"
cp "$out/npm/node_modules/playcanvas/LICENSE" "$page.new/playcanvas.LICENSE"
add_object "$page.new" "$asset" "$mesh" "$credit"
rm -rf "$page"
mv "$page.new" "$page"
echo "$page"
