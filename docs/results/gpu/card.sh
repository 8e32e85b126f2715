#!/usr/bin/env bash
# Prints the part of docs/results/gpu.md that takes a GPU: proves the kernels on it (tests/gpu/run.sh) and times them. For a
# machine with a GPU, a C++ compiler, CMake and what compiles the kernels; the program `nif`, assets and meshes may be made
# elsewhere.
#
#   docs/results/gpu/card.sh FOLDER [NIF] >docs/results/gpu/card.md
#
# FOLDER: holds stanford_dragon.nif with its mesh .ply.gz, paper.nif of the same mesh, and for each NAME of statue_8000000.ply
# and kicad_board_1.0m.ply.zst the mesh and NAME.nif; docs/results/gpu.sh makes them all in build/gpu. What is missing is left
# out. NIF: the program, build/release/bin/nif by default. Takes some five minutes.
set -euo pipefail
folder=$(realpath "${1:?names the folder of assets and meshes}")
nif=$(realpath "${2:-build/release/bin/nif}")
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
dragon=$folder/stanford_dragon

# bench ASSET MESH OPTION...: as a block of code.
bench() {
  "$nif" bench "$1" --mesh "$2" --device hip --quiet "${@:3}" | sed "s|^$folder/||; s/./    &/; s/ *\$//"
}

printf '## On a card\n\n'
printf 'By `docs/results/gpu/card.sh`, on one machine, in one go.\n\n'
printf '### Speed, compared with a BVH\n\n'
printf '`nif bench ASSET --mesh MESH --device hip --stages --batches` ([benchmark.md](../benchmark.md)).\n'
for name in stanford_dragon statue_8000000.ply kicad_board_1.0m.ply.zst; do
  mesh=$folder/$name
  [[ $name != stanford_dragon ]] || mesh=$dragon.ply.gz
  if [[ -f $mesh && -f $folder/$name.nif ]]; then
    printf '\n' && bench "$folder/$name.nif" "$mesh" --stages --batches
  fi
done
printf '\n### The fields of the paper, in single and in half precision\n\n'
printf '`nif bench paper.nif --mesh stanford_dragon.ply.gz --device hip --stages --precision PRECISION`.\n\n'
bench "$folder/paper.nif" "$dragon.ply.gz" --stages --precision single
printf '\n'
bench "$folder/paper.nif" "$dragon.ply.gz" --stages --precision half
printf '\n### Every answer, compared with the scalar reference\n\n'
printf '`tests/gpu/run.sh tests/golden/v2-shapes.nif stanford_dragon.nif`: rays that need no mesh. The columns `different` are\n'
printf 'numbers of different answers: of `nifQuery`, of `nifQueryOpen` and of `nifIntersect`. The instances of all objects of a file\n'
printf 'are mirrored, stretched and overlapping.\n\n'
tests/gpu/run.sh tests/golden/v2-shapes.nif "$dragon.nif"
