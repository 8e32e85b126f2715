#!/usr/bin/env bash
# Assembles the page in build/samples/webgpu/page: the files of page/, three.js and three-mesh-bvh from npm, the object's words and
# the shader's text as `nif export-shader` writes them, and triangles to draw.
#
#   samples/webgpu/build.sh ASSET.nif MESH [CREDIT]
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
out=build/samples/webgpu
# shellcheck source=samples/webgpu/assemble.sh
source samples/webgpu/assemble.sh
fetch_npm samples/webgpu

page=$out/page
rm -rf "$page.new"
mkdir -p "$page.new/three/loaders" "$page.new/three/controls" "$page.new/three/utils"
cp samples/webgpu/page/* "$page.new"
modules=$out/npm/node_modules/three
bvh=$out/npm/node_modules/three-mesh-bvh
cp "$modules"/build/three.{core,tsl,webgpu}.js "$modules/LICENSE" "$page.new/three"
# Without an import map, because the server's policy forbids scripts in pages.
for file in loaders/GLTFLoader.js controls/OrbitControls.js utils/BufferGeometryUtils.js utils/SkeletonUtils.js; do
  sed -E "s|from 'three';|from '../three.webgpu.js';|" "$modules/examples/jsm/$file" >"$page.new/three/$file"
done
while read -r file; do
  up=../$(sed 's|[^/]||g; s|/|../|g' <<<"$file")
  mkdir -p "$page.new/three-mesh-bvh/$(dirname "$file")"
  sed -E "s#from 'three(/webgpu)?';#from '${up}three/three.webgpu.js';#; s#from 'three/tsl';#from '${up}three/three.tsl.js';#" \
    "$bvh/src/$file" >"$page.new/three-mesh-bvh/$file"
done < <(cd "$bvh/src" && find core math utils webgpu -name '*.js')
cp "$bvh/LICENSE" "$page.new/three-mesh-bvh"

add_object "$page.new" "$asset" "$mesh" "$credit"
rm -rf "$page"
mv "$page.new" "$page"
echo "$page"
