#!/usr/bin/env bash
# Makes the part of docs/results/gpu.md that takes a GPU: docs/results/gpu/speed.md, how fast the GPU answers, and
# docs/results/gpu/proof.md, the answers compared with the scalar reference's (tests/gpu/run.sh). For a machine with a GPU, a
# C++ compiler, CMake and what compiles the kernels. Takes some six minutes where programs and assets are there.
#
#   docs/results/gpu/one_gpu.sh FOLDER [NIF]
#
# FOLDER: holds stanford_dragon.ply.gz and stanford_dragon.nif, as build/sample does after samples/run.sh; what else is needed
# is made there, but for kicad_board_1.0m.ply.zst, which is left out where it is not there. So everything can also be made on
# another machine, and copied. NIF: the program, build/release/bin/nif by default.
set -euo pipefail
case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
  '') echo 'docs/results/gpu/one_gpu.sh: name the folder of assets and meshes; see --help' >&2 && exit 2 ;;
esac
[[ -d $1 ]] || { echo "docs/results/gpu/one_gpu.sh: there is no folder '$1'" >&2 && exit 2; }
folder=$(realpath "$1")
nif=$(realpath "${2:-build/release/bin/nif}")
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
out=docs/results/gpu
dragon=$folder/stanford_dragon.ply.gz statue=$folder/statue_8000000.ply board=$folder/kicad_board_1.0m.ply.zst

[[ -f $statue ]] || "$nif" mesh generate statue -o "$statue" --triangles 8000000 --quiet
for mesh in "$statue" "$board"; do
  [[ ! -f $mesh || -f $mesh.nif ]] || "$nif" bake "$mesh" -o "$mesh.nif" --encoding segment --rays 0 --quiet
done
# Fields of the paper's kind, trained for a minute only. Neither speed nor precision depends on it.
papers=$folder/paper.nif
[[ -f $papers ]] || "$nif" bake "$dragon" -o "$papers" --preset paper --training-rays 4000000 --rays 0 --quiet

# bench ASSET MESH OPTION...: as a block of code; nothing where there is no such mesh.
bench() {
  [[ -f $2 ]] || return 0
  "$nif" bench "$1" --mesh "$2" --device gpu --quiet "${@:3}" | sed "s|^$folder/||; s/./    &/; s/ *\$//"
  printf '\n'
}
{
  printf 'Of commit %s.\n\n' "$(git describe --always --dirty 2>/dev/null || echo unknown)"
  printf '`nif bench ASSET --mesh MESH --device gpu --stages --batches`:\n\n'
  bench "$folder/stanford_dragon.nif" "$dragon" --stages --batches
  for mesh in "$statue" "$board"; do bench "$mesh.nif" "$mesh" --stages --batches; done
  printf 'The fields of the paper, by `nif bench paper.nif --mesh stanford_dragon.ply.gz --device gpu --stages --precision single`,\n'
  printf 'and `half`:\n\n'
  bench "$papers" "$dragon" --stages --precision single
  bench "$papers" "$dragon" --stages --precision half
} >"$out/speed.md.new"
sed -i '$d' "$out/speed.md.new"
mv "$out/speed.md.new" "$out/speed.md"
tests/gpu/run.sh "$folder/stanford_dragon.nif" tests/golden/v2-shapes.nif >"$out/proof.md.new"
mv "$out/proof.md.new" "$out/proof.md"
