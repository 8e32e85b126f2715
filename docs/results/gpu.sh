#!/usr/bin/env bash
# Writes docs/results/gpu.md: what compilers report about the GPU kernels for every target, and how the kernels answer in the
# emulator, on the Stanford dragon. Needs no GPU. If there is one, it also proves the kernels on it and times them, on the
# dragon, on generated meshes of up to 8 million triangles and, if the folder NIF_TEST_MESHES contains it, on a circuit board
# of 6.9 million. Takes about twenty minutes on two cores without a GPU.
#
#   docs/results/gpu.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

asset=build/sample/stanford_dragon.nif
[[ -f $asset ]] || samples/run.sh >/dev/null
mesh=${asset%.nif}.ply.gz
[[ -f $asset && -f $mesh ]] || { echo 'docs/results/gpu.sh: the Stanford dragon is not available' >&2 && exit 1; }

# Before the page's first line, which depends on whether there is a GPU.
proof=$(tests/gpu/run.sh tests/golden/v2-shapes.nif "$asset")

out=build/gpu nif=build/release/bin/nif mesh_of_dragon=$mesh
mkdir -p "$out"
cmake --build build/release --target nif >&2

# Fields of the paper's kind, trained for a minute only. The precision of their evaluation does not depend on it.
papers=$out/paper.nif
if [[ ! -f $papers ]]; then
  "$nif" bake "$mesh" -o "$papers" --preset paper --training-rays 4000000 --rays 0 --quiet
fi

tools/measure/emulate_sets.sh "$asset" "$mesh" >"$out/dragon.txt"

# A lower bound on the time of a million ambiguous rays, from the asset's network and the emulator's counts.
floor() {
  local samples macs runs steps
  samples=$("$nif" info "$asset" --json | jq '.objects[0].samples')
  macs=$("$nif" info "$asset" --json \
    | jq '.objects[0] | [.samples * .features_per_corner + 8] + .layers | [.[:-1], .[1:]] | transpose | map(.[0] * .[1]) | add')
  # The columns of the last table, and of the walk's.
  runs=$(awk 'NF == 6 && $2 == "inner-surface" { r = $6 } END { print r }' "$out/dragon.txt")
  steps=$(awk '$2 == "inner-surface" && $3 == "leaps" { s = $(NF - 3) } END { print s }' "$out/dragon.txt")
  printf '\n## Lower bound for a million ambiguous rays\n\n'
  awk -v samples="$samples" -v macs="$macs" -v runs="$runs" -v steps="$steps" 'BEGIN {
    bytes = 32 + 2 * (8 + 8 * runs) + 32 + 1
    gathers = 8 * samples + steps
    sms = 132; clock = 1.83e9; memory = 3.35e12; products = 1978.9e12
    printf "This is a count, not a measurement. It is for `inner-surface` rays of the dragon that are ambiguous, on an H100\n"
    printf "SXM5 (132 processors at 1.83 GHz, 3.35 TB/s, 1,979 trillion operations on bytes a second, by its data sheet).\n\n"
    printf "| what | of a ray | of a million, at least |\n| --- | ---: | ---: |\n"
    printf "| products of the network, %d and as many sums | %d operations | %.1f us |\n", macs, 2 * macs, 1e12 * 2 * macs / products
    printf "| memory: the ray twice, its item written and read (%.2f runs), the answer | %.0f bytes | %.1f us |\n", runs, bytes, 1e12 * bytes / memory
    printf "| first-level caches: %d words of features and %.1f of codes for the walk (as the longest of 32 rays), if each is in a different sector of 32 bytes, at 128 bytes a clock and processor | %.0f bytes | %.1f us |\n\n", 8 * samples, steps, 32 * gathers, 1e12 * 32 * gathers / (sms * 128 * clock)
    printf "If neighbouring rays share nothing, the bound is the time that the caches need for features and codes. For rays that go\n"
    printf "side by side it is memory. Only a GPU can show how near the kernels come to it.\n" }'
}

# If there is a GPU: the paper's breakdown, and time against triangles and rays.
times() {
  printf '\n## Times\n\n'
  if ! "$nif" devices | grep -q '^hip  device='; then
    printf 'Nothing was timed: %s\n' "$("$nif" devices | sed -n 's/^hip  //p')"
    return
  fi
  printf '`nif bench --device hip --stages --batches` ([benchmark.md](../benchmark.md)), by the number of triangles.\n'
  local name count mesh board=${NIF_TEST_MESHES:+$NIF_TEST_MESHES/kicad_board_6.94m.ply.zst}
  local meshes=("$mesh_of_dragon")
  for count in 500000 2000000 8000000; do
    [[ -f $out/statue_$count.ply ]] || "$nif" mesh generate statue -o "$out/statue_$count.ply" --triangles "$count" --quiet
    meshes+=("$out/statue_$count.ply")
  done
  if [[ -n $board && -f $board ]]; then meshes+=("$board"); fi
  for mesh in "${meshes[@]}"; do
    name=$(basename "$mesh")
    [[ -f $out/$name.nif ]] || "$nif" bake "$mesh" -o "$out/$name.nif" --encoding segment --rays 0 --quiet
    printf '\n### %s\n\n' "$name"
    "$nif" bench "$out/$name.nif" --mesh "$mesh" --device hip --stages --batches --quiet | sed 's/./    &/; s/ *$//'
  done
  printf '\n### The fields of the paper, in single and in half precision\n\n'
  for precision in single half; do
    "$nif" bench "$papers" --mesh "$mesh_of_dragon" --device hip --stages --precision "$precision" --quiet \
      | sed 's/./    &/; s/ *$//'
    printf '\n'
  done
}

# amd TARGET, nvidia TARGET: a row for each kernel: name, registers, stack, spilled, waves.
amd() {
  awk '/Function Name/ { name = $5 } /remark: +VGPRs:/ { v = $4 } /remark: +AGPRs:/ { a = $4 }
    /ScratchSize/ { stack = $5 } /Occupancy/ { waves = $5 } /VGPRs Spill/ { spilled = $5 } /SGPRs Spill/ { scalar = $5 }
    /LDS Size/ { if (name ~ /^nif_/) printf "| `%s` | %s | %s | %s | %s | %s |\n", name, (a > 0 ? v " + " a : v), stack, spilled, scalar, waves; a = 0 }' \
    "$out/$1.txt"
}
nvidia() {
  awk -F"[ ',]+" '/Compiling entry function/ { name = $7; seen = 0 } /bytes stack frame/ && !seen++ { stack = $2; spilled = $6 }
    / Used / { for (i = 1; i < NF; ++i) if ($i == "Used") printf "| `%s` | %s | %s | %s | | |\n", name, $(i + 1), stack, spilled }' \
    "$out/$1.txt"
}

{
  printf '# GPUs\n\n'
  printf 'Generated by `docs/results/gpu.sh`; do not edit by hand. [gpu.md](../gpu.md) describes the kernels.'
  if [[ $proof == *'emulated card'* ]]; then
    printf '\n**This page was made without a GPU: no kernel ran on one, and nothing was timed.**'
  fi
  printf '\n\n## Whole scenes, through the runtime\n\n'
  printf '`tests/gpu/run.sh tests/golden/v2-shapes.nif stanford_dragon.nif`: rays that need no mesh. The scalar reference on\n'
  printf 'the CPU and the GPU module answer them. The last column is the number of different answers. The instances of all objects\n'
  printf 'of a file are mirrored, stretched and overlapping.\n\n'
  printf '%s\n\n' "$proof"
  printf '## What compilers report\n\n'
  printf 'By `kernels/gpu/compile.sh`. The columns are:\n\n'
  printf -- '- registers: of a thread (AMD: vector registers, and accumulators after a +);\n'
  printf -- '- stack: private memory of each thread, in bytes;\n'
  printf -- '- spilled: registers (AMD) or bytes stored (NVIDIA);\n'
  printf -- '- scalar: scalar registers that are kept in lanes of vector registers (AMD);\n'
  printf -- '- waves: how many fit on a SIMD with these registers (AMD).\n\n'
  printf 'Shared memory is allocated at the launch and depends on the network.\n'
  for target in gfx1030 gfx1100 gfx90a gfx942 sm_80 sm_90; do
    compiler=$(kernels/gpu/compile.sh --compiler "$target") || { printf '\n### %s\n\nNo compiler.\n' "$target" && continue; }
    kernels/gpu/compile.sh "$target" "$out"
    printf '\n### %s, by %s\n\n' "$target" "$("$compiler" --version | grep -Em1 'version|release')"
    printf '| kernel | registers | stack | spilled | scalar | waves |\n| --- | ---: | ---: | ---: | ---: | ---: |\n'
    if [[ $target == gfx* ]]; then amd "$target"; else nvidia "$target"; fi
    printf '\nMatrix instructions: %s.\n' "$(grep -oE 'v_wmma_[a-z0-9_]+|v_mfma_[a-z0-9_]+|v_dot[24][a-z0-9_]*|mma\.sync[a-z0-9.]*|dp4a[a-z0-9.]*' \
      "$out/$target.s" | sort | uniq -c | awk '{ printf "%s%s `%s`", n++ ? ", " : "", $1, $2 }')"
  done
  printf '\n## Answers in the emulator\n\n'
  printf '`tools/measure/emulate_sets.sh stanford_dragon.nif stanford_dragon.ply.gz`, with a million rays of every set:\n\n'
  printf '1. The first table shows how many answers differ from the reference in any bit.\n'
  printf '2. The second table compares the walk by leaps, which the kernels use, with the walk voxel by voxel: steps of a ray; steps\n'
  printf '   of the longest ray in a wave of 32 or 64 rays, in their order; loads and bytes of a ray.\n'
  printf '3. The third table shows how many rays are ambiguous (open), how many of those have more than five runs\n'
  printf '   (hard), and how many runs an ambiguous ray has.\n\n'
  sed 's/./    &/; s/ *$//' "$out/dragon.txt"
  floor
  printf '\n## The fields of the paper, in both precisions\n\n'
  printf '`nif bake stanford_dragon.ply.gz -o paper.nif --preset paper --training-rays 4000000 --rays 0`, then\n'
  printf '`tools/measure/emulate_sets.sh paper.nif stanford_dragon.ply.gz`.\n\n'
  printf 'The first table is in single precision, where no answer differs from the reference in any bit. The second table is in half\n'
  printf 'precision. Its columns are:\n\n'
  printf -- '- asked: rays for which a network was evaluated;\n'
  printf -- '- different: answers that differ from the reference;\n'
  printf -- '- wrong, s and wrong, h: rays answered wrongly in single and in half precision, compared with the mesh;\n'
  printf -- '- mean dp, most dp: by how much probabilities move; most dz: by how much log-odds move at most;\n'
  printf -- '- beyond: answers farther off than the bound that follows from the arithmetic (`tests/gpu/half_bound.hpp`).\n\n'
  printf 'The emulated instructions sum in different orders, and `mfma` replaces denormal halves by 0. The rows of a set show how much\n'
  printf 'the choice of a GPU can matter.\n\n'
  tools/measure/emulate_sets.sh "$papers" "$mesh" | sed 's/./    &/; s/ *$//'
  times
} >docs/results/gpu.md.new
mv docs/results/gpu.md.new docs/results/gpu.md
