#!/usr/bin/env bash
# Makes what depends on the format of planes anew, after that has changed: the golden files in tests/golden that have some,
# and the bakes in tests/corpus/asset with which the fuzzer starts.
#
#   tests/corpus/make.sh [BUILD]    BUILD: a folder with bin/nif and bin/make_golden (build/release)
#
# Once a version of the format is out, its golden files are kept as they are.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
bin=$(cd "${1:-build/release}/bin" && pwd)
golden=tests/golden corpus=tests/corpus/asset

# The last number says which payloads are coded. Two files stay uncoded.
"$bin/make_golden" 4 $golden/v2-bvh 2
"$bin/make_golden" 3 $golden/v2-exact 0 0 7 3
"$bin/make_golden" 20 $golden/v2-leaning
"$bin/make_golden" 4 $golden/v2-objects 0 0 7
"$bin/make_golden" 5 $golden/v2-proof 0 0 7 0 3
"$bin/make_golden" 44 $golden/v2-shapes 0 0 7
"$bin/make_golden" 3 $golden/v2-single
"$bin/make_golden" 3 $golden/v2-source 2 0 7 2 0 3
"$bin/make_golden" 106 $golden/v2-spherical 0 2 3

meshes=$(mktemp -d)
trap 'rm -rf "$meshes"' EXIT
# bake NAME SHAPE [options of nif bake]
bake() {
  local name=$1 mesh=$meshes/$2.ply
  [[ -f $mesh ]] || "$bin/nif" mesh generate "$2" -o "$mesh" --triangles 300 --quiet
  "$bin/nif" bake "$mesh" -o "$corpus/$name.nif" --preset fast --quiet "${@:3}"
}
bake auto-torus torus --encoding auto --max-bytes 8kB
bake exact-statue statue --encoding exact --resolution 24
bake exact-source-statue statue --encoding exact --resolution 10 --source-triangles
bake exact-tori tori --encoding exact --resolution 24 --uncoded
bake exact-tree tree --encoding exact --resolution 10
bake proof-statue statue --encoding proof --resolution 24
bake proof-tree tree --encoding proof --resolution 10 --uncoded
# Whole voxels, and voxels that are cut.
bake segment-chain-mail chain-mail --encoding segment --resolution 10
bake segment-statue statue --encoding segment --resolution 11
bake segment-statue-cut statue --encoding segment --resolution 24
bake segment-tori tori --encoding segment --resolution 11
bake segment-tori-cut tori --encoding segment --resolution 24
bake segment-torus torus --encoding segment --resolution 20
bake segment-tree tree --encoding segment --resolution 8 --uncoded
bake segment-tree-cut tree --encoding segment --resolution 30
ls -l $golden/*.nif $corpus/*.nif
