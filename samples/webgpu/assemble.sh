# shellcheck shell=bash disable=SC2154
# Shared by build.sh of this sample and of samples/playcanvas, which are pages that show an object by the words and the text of
# `nif export-shader`. To be sourced from nifkit's root, with `nif`, the program, and `out`, the sample's build folder.

# fetch_npm SAMPLE: what its package-lock.json names, in $out/npm/node_modules.
fetch_npm() {
  mkdir -p "$out/npm"
  if ! cmp -s "$1/package-lock.json" "$out/npm/package-lock.json" || [[ ! -d $out/npm/node_modules ]]; then
    cp "$1/package.json" "$1/package-lock.json" "$out/npm"
    (cd "$out/npm" && npm ci --silent --ignore-scripts --no-audit --no-fund) >&2 || {
      rm -rf "$out/npm"
      echo "$1/build.sh: npm could not fetch what $1/package.json names" >&2
      return 1
    }
  fi
}

# add_object PAGE ASSET MESH CREDIT: words and text, packed, because not every server packs; triangles; the credit. The text goes
# without its comments.
add_object() {
  local page=$1 asset=$2 mesh=$3 credit=$4 triangles ratio
  rm -rf "$out/shader"
  "$nif" export-shader "$asset" -o "$out/shader" --object 0 --quiet
  python3 samples/webgpu/pack.py "$out/shader/$(basename "$asset" .nif).object-0.words" "$page/object.words.gz"
  sed -E 's|[[:space:]]*//.*||; /^$/d' "$out/shader/nif.wgsl" | gzip -9 -n >"$page/nif.wgsl.gz"
  # At most some 100,000 triangles, as a game would draw: they need not be the ones that were baked.
  triangles=$("$nif" info "$asset" --json | sed -nE 's/^ *"triangles": ([0-9]+).*/\1/p' | head -n 1)
  if ((triangles > 120000)); then
    ratio=$(awk -v n="$triangles" 'BEGIN { printf "%.4f", 1e5 / n }')
    "$nif" mesh decimate "$mesh" -o "$page/object.glb" --ratio "$ratio" --quiet
  else
    "$nif" mesh convert "$mesh" -o "$page/object.glb" --quiet
  fi
  [[ -z $credit ]] || sed -i "s|<p id=\"credit\" hidden>|<p id=\"credit\">${credit//[|&\\]/\\&}|" "$page/index.html"
}
