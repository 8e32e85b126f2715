#!/usr/bin/env bash
# Bakes meshes of 1,000 to 7 million triangles and writes a page about them beside this script: the time and the memory of each bake,
# beside what `nif bake --manifest` and `nif farm` expect. Takes some hours on two cores. Bakes that are in build/needs are
# not done again.
#
#   NIF_TEST_MESHES=FOLDER docs/results/needs.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
: "${NIF_TEST_MESHES:?names the folder that holds the meshes}"

meshes=(openscad_nonmanifold_1k.obj CesiumMan_skinned_4.7k.glb cycloidal_43k_nonmanifold_100comp.ply
  bunny_zipper_69k_open.ply skull_100k.obj openfoam_DTC_hull_116k.stl.gz openfoam_motorBike_332k_nasty.obj.gz
  stanford_dragon_871k.ply.gz kicad_board_1.0m.ply.zst kicad_board_6.94m.ply.zst)
nif=${NIF:-build/release/bin/nif} out=build/needs
mkdir -p "$out"

# bake NAME PRESET THREADS: the JSON that the program printed, and after it the seconds of processor that it took.
bake() {
  local mesh=$NIF_TEST_MESHES/$1 at=$out/$1.$2.j$3
  [[ ! -f $at.json ]] || return 0
  local TIMEFORMAT='%U %S'
  { time "$nif" bake "$mesh" -o "$at.nif" --encoding segment --preset "$2" -j "$3" --quiet --json >"$at.new"; } 2>"$at.time"
  tail -n 1 "$at.time" | awk '{ print $1 + $2 }' >>"$at.new"
  mv "$at.new" "$at.json"
}

for mesh in "${meshes[@]}"; do
  for preset in fast balanced; do for threads in 1 2; do bake "$mesh" "$preset" "$threads"; done; done
done
