#!/usr/bin/env bash
# Assembles the page in build/samples/webgpu/page: the files of page/, three.js from npm, the object's words and the shader's text
# as `nif export-shader` writes them, and triangles to draw.
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
mkdir -p "$out/npm"

if ! cmp -s samples/webgpu/package-lock.json "$out/npm/package-lock.json" || [[ ! -d $out/npm/node_modules ]]; then
  cp samples/webgpu/package.json "$out/npm"
  cp samples/webgpu/package-lock.json "$out/npm"
  (cd "$out/npm" && npm ci --silent --ignore-scripts --no-audit --no-fund) >&2 || {
    rm -rf "$out/npm"
    echo 'samples/webgpu/build.sh: npm could not fetch three.js' >&2
    exit 1
  }
fi

page=$out/page
rm -rf "$page.new"
mkdir -p "$page.new/three/loaders" "$page.new/three/controls" "$page.new/three/utils"
cp samples/webgpu/page/* "$page.new"
modules=$out/npm/node_modules/three
cp "$modules"/build/three.{core,tsl,webgpu}.js "$modules/LICENSE" "$page.new/three"
# Without an import map, because the server's policy forbids scripts in pages.
for file in loaders/GLTFLoader.js controls/OrbitControls.js utils/BufferGeometryUtils.js utils/SkeletonUtils.js; do
  sed -E "s|from 'three';|from '../three.webgpu.js';|" "$modules/examples/jsm/$file" >"$page.new/three/$file"
done

# The words and the text, packed, because not every server packs.
rm -rf "$out/shader"
"$nif" export-shader "$asset" -o "$out/shader" --object 0 --quiet
python3 samples/webgpu/pack.py "$out/shader/$(basename "$asset" .nif).object-0.words" "$page.new/object.words.gz"
gzip -9 -n -c "$out/shader/nif.wgsl" >"$page.new/nif.wgsl.gz"
# At most some 100,000 triangles, as a game would draw: they need not be the ones that were baked.
triangles=$("$nif" info "$asset" --json | sed -nE 's/^ *"triangles": ([0-9]+).*/\1/p' | head -n 1)
if ((triangles > 120000)); then
  ratio=$(awk -v n="$triangles" 'BEGIN { printf "%.4f", 1e5 / n }')
  "$nif" mesh decimate "$mesh" -o "$page.new/object.glb" --ratio "$ratio" --quiet
else
  "$nif" mesh convert "$mesh" -o "$page.new/object.glb" --quiet
fi
[[ -z $credit ]] || sed -i "s|<p id=\"credit\" hidden>|<p id=\"credit\">${credit//[|&\\]/\\&}|" "$page.new/index.html"
rm -rf "$page"
mv "$page.new" "$page"
echo "$page"
