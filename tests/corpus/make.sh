#!/usr/bin/env bash
# Makes what depends on the format of planes anew, after that has changed: the golden files in tests/golden that have some,
# and what the fuzzers start with, tests/corpus.
#
#   tests/corpus/make.sh [BUILD]    BUILD: a folder with bin/nif, bin/make_golden and bin/make_mesh_seeds (build/release)
#
# NIF_TEST_MESHES names a folder of real meshes, of which some files of the corpus are bakes (SOURCES.txt says which, and who
# made the meshes); without it these are left as they are.
#
# Once a version of the format is out, its golden files are kept as they are.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
bin=$(cd "${1:-build/release}/bin" && pwd)
golden=tests/golden corpus=tests/corpus/asset

# The last number says which payloads are coded. Two files stay uncoded.
"$bin/make_golden" 4 $golden/v2-bvh 2
"$bin/make_golden" 3 $golden/v2-colors 1 0 7 1 1 0 3
"$bin/make_golden" 46 $golden/v2-cutout 1 0 0 0 0 2 0 0 4
"$bin/make_golden" 49 $golden/v2-bending 3 0 0 0 0 2 0 0 0 3
"$bin/make_golden" 3 $golden/v2-exact 0 0 7 3
"$bin/make_golden" 20 $golden/v2-leaning
"$bin/make_golden" 4 $golden/v2-objects 0 0 7
"$bin/make_golden" 30 $golden/v2-networks 0 5
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

"$bin/nif" mesh generate tree --cutout -o "$meshes/leaves.glb" --triangles 100 --quiet
for form in '' -uncoded; do
  "$bin/nif" bake "$meshes/leaves.glb" -o "$corpus/cutout-tree$form.nif" --alpha-resolution 64 --rays 0 --quiet ${form:+-$form}
done

# real NAME MESH [options of nif bake]: of a real mesh, whose folder is not to be seen in the file.
real() { (cd "$meshes" && "$bin/nif" bake "$2" -o "$top/$corpus/real-$1.nif" --quiet --rays 0 "${@:3}"); }
# reduced NAME MESH TRIANGLES
reduced() { "$bin/nif" mesh decimate "$NIF_TEST_MESHES/$2" -o "$meshes/$1" --triangles "$3" --fast --quiet --text; }
if [[ -n ${NIF_TEST_MESHES-} ]]; then
  top=$PWD skull=$NIF_TEST_MESHES/skull_100k.obj self=$NIF_TEST_MESHES/self_intersect_17k.obj
  openscad=$NIF_TEST_MESHES/openscad_nonmanifold_1k.obj cycloidal=$NIF_TEST_MESHES/cycloidal_43k_nonmanifold_100comp.ply
  soup=$NIF_TEST_MESHES/soup_100.stl engine=$NIF_TEST_MESHES/engine_hier_instanced_76k.glb
  reduced skull.stl skull_100k.obj 250
  reduced cycloidal.stl cycloidal_43k_nonmanifold_100comp.ply 600
  reduced openscad.stl openscad_nonmanifold_1k.obj 250
  for part in skull:skull_100k self:self_intersect_17k part:openscad_nonmanifold_1k; do
    reduced "${part%:*}-90.stl" "${part#*:}.obj" 90
  done
  cat "$meshes"/{skull,self,part}-90.stl >"$meshes/three.stl"  # three solids, so three objects
  grid=(--preset fast --resolution)
  real segment-skull "$skull" --encoding segment "${grid[@]}" 24
  real segment-skull-uncoded "$skull" --encoding segment "${grid[@]}" 14 --uncoded
  real segment-self "$self" --encoding segment "${grid[@]}" 24
  real segment-self-lean "$self" --encoding segment "${grid[@]}" 16 --max-leak 1%
  real segment-openscad "$openscad" --encoding segment "${grid[@]}" 13
  real segment-three three.stl --encoding segment "${grid[@]}" 10
  real proof-skull "$skull" --encoding proof "${grid[@]}" 24
  real proof-cycloidal-uncoded "$cycloidal" --encoding proof "${grid[@]}" 16 --uncoded
  real proof-engine-colours "$engine" --encoding proof "${grid[@]}" 4 --colors
  real exact-skull-source skull.stl --encoding exact "${grid[@]}" 24 --source-triangles
  real exact-skull-fine skull-90.stl --encoding exact "${grid[@]}" 48
  real exact-openscad-uncoded openscad.stl --encoding exact "${grid[@]}" 16 --uncoded
  real exact-three-uncoded three.stl --encoding exact "${grid[@]}" 10 --uncoded --no-merge
  real bvh-cycloidal-source cycloidal.stl --encoding bvh --source-triangles
  real bvh-soup "$soup" --encoding bvh
  real bvh-three-source three.stl --encoding bvh --source-triangles --no-merge
  real spherical-self "$self" --encoding spherical --training-rays 20000 --outer-resolution 8 --inner-resolution 6 \
    --distance-resolution 6 --outer-width 8 --inner-width 8
fi

"$bin/make_mesh_seeds" tests/corpus
tests/corpus/make_api.py tests/corpus/api
tests/corpus/make_rays.py tests/corpus/rays
tests/corpus/make_scene.py tests/corpus/scene
ls -l $golden/*.nif $corpus/*.nif
