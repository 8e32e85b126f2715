#!/usr/bin/env bash
# Assembles the page in build/samples/web/page: the files of page/, nifkit for the web, three.js and three-mesh-bvh from npm, and
# the object as .nif and .glb.
#
#   samples/web/build.sh ASSET.nif MESH [CREDIT]
#
# MESH is the mesh of the asset; '' shows only the asset. CREDIT is a sentence about the model that the page shows.
#
# Needs what `tools/setup.sh build web` installs, and npm's registry the first time.
set -euo pipefail
if (($# < 2 || $# > 3)) || [[ $1 == -* ]]; then
  sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2
  exit 2
fi
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
asset=$1 mesh=$2 credit=${3-}
nif=${nif-build/release/bin/nif}
out=build/samples/web
mkdir -p "$out/npm"

package=build/web/nifkit/index.js
if [[ ! -f $package || -n $(find bindings/web formats kernels runtime -type f -newer "$package" -print -quit) ]]; then
  bindings/web/build.sh >&2
fi
if ! cmp -s samples/web/package-lock.json "$out/npm/package-lock.json" || [[ ! -d $out/npm/node_modules ]]; then
  cp samples/web/package.json "$out/npm"
  (cd "$out/npm" && cp "$OLDPWD/samples/web/package-lock.json" . && npm ci --silent --ignore-scripts --no-audit --no-fund) >&2 || {
    rm -rf "$out/npm"
    echo 'samples/web/build.sh: npm could not fetch three.js and three-mesh-bvh' >&2
    exit 1
  }
fi

page=$out/page
rm -rf "$page.new"
mkdir -p "$page.new/three/loaders" "$page.new/three/controls" "$page.new/three/utils"
cp samples/web/page/* "$page.new"
cp -r build/web/nifkit "$page.new/nifkit"
# Worker modules do not support import maps, so their imports use paths.
modules=$out/npm/node_modules
third_party() {
  sed -E "s|^(import .*)?(\}?) from 'three';|\1\2 from '$3';|" "$modules/$1" >"$page.new/three/$2"
}
cp "$modules"/three/build/three.{core,module}.js "$modules/three/LICENSE" "$page.new/three"
cp "$modules/three-mesh-bvh/LICENSE" "$page.new/three/three-mesh-bvh.LICENSE"
third_party three-mesh-bvh/build/index.module.js three-mesh-bvh.js ./three.core.js
third_party three/examples/jsm/loaders/GLTFLoader.js loaders/GLTFLoader.js ../three.core.js
third_party three/examples/jsm/controls/OrbitControls.js controls/OrbitControls.js ../three.core.js
third_party three/examples/jsm/utils/BufferGeometryUtils.js utils/BufferGeometryUtils.js ../three.core.js
third_party three/examples/jsm/utils/SkeletonUtils.js utils/SkeletonUtils.js ../three.core.js
cp "$asset" "$page.new/object.nif"
if [[ -n $mesh ]]; then
  "$nif" mesh convert "$mesh" -o "$page.new/object.glb" --quiet
  sed -i "s/data-triangle-bytes=\"/&$(stat -c %s "$page.new/object.glb")/" "$page.new/index.html"
else
  sed -i 's/ data-triangles="object.glb" data-triangle-bytes=""//' "$page.new/index.html"
fi
sed -i "s|<p id=\"credit\" hidden>|&${credit//[|&\\]/\\&}|" "$page.new/index.html"
rm -rf "$page"
mv "$page.new" "$page"
echo "$page"
