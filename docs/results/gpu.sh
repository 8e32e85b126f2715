#!/usr/bin/env bash
# Writes docs/results/gpu.md: what compilers make of the GPU kernels for every target, and how the kernels answer in the
# emulator, on the Stanford dragon. Needs no GPU; where there is one, it also proves the kernels on it and times them: the
# dragon, generated meshes of up to 8 million triangles and, where NIF_TEST_MESHES names a folder that has it, a circuit
# board of 6.9 million. Takes about twenty minutes on two cores without a GPU.
#
#   docs/results/gpu.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

asset=build/sample/stanford_dragon.nif
[[ -f $asset ]] || samples/run.sh >/dev/null
mesh=${asset%.nif}.ply.gz
[[ -f $asset && -f $mesh ]] || { echo 'docs/results/gpu.sh: the Stanford dragon is not available' >&2 && exit 1; }

# Before the page's first line, which depends on whether there is a GPU.
proof=$(tests/gpu/run.sh tests/golden/v1-shapes.nif "$asset")

out=build/gpu nif=build/release/bin/nif mesh_of_dragon=$mesh
mkdir -p "$out"
cmake --build build/release --target nif >&2

# Fields of the paper's kind, learned for a minute only: how precisely they are evaluated does not depend on it.
papers=$out/paper.nif
if [[ ! -f $papers ]]; then
  "$nif" bake "$mesh" -o "$papers" --preset paper --training-rays 4000000 --rays 0 --quiet
fi

tools/measure/emulate_sets.sh "$asset" "$mesh" >"$out/dragon.txt"

# What a million ambiguous rays take at least, from the asset's network and what the emulator has counted.
floor() {
  local samples macs runs steps
  samples=$("$nif" info "$asset" --json | jq '.objects[0].samples')
  macs=$("$nif" info "$asset" --json \
    | jq '.objects[0] | [.samples * .features_per_corner + 8] + .layers | [.[:-1], .[1:]] | transpose | map(.[0] * .[1]) | add')
  # The columns of the last table, and of the walk's.
  runs=$(awk 'NF == 6 && $2 == "inner-surface" { r = $6 } END { print r }' "$out/dragon.txt")
  steps=$(awk '$2 == "inner-surface" && $3 == "leaps" { s = $(NF - 3) } END { print s }' "$out/dragon.txt")
  printf '\n## What a million ambiguous rays take at least\n\n'
  awk -v samples="$samples" -v macs="$macs" -v runs="$runs" -v steps="$steps" 'BEGIN {
    bytes = 32 + 2 * (8 + 8 * runs) + 32 + 1
    gathers = 8 * samples + steps
    sms = 132; clock = 1.83e9; memory = 3.35e12; products = 1978.9e12
    printf "By count, for `inner-surface` rays of the dragon, which the walk leaves open, on an H100 SXM5 (132 processors at\n"
    printf "1.83 GHz, 3.35 TB/s, 1,979 trillion operations on bytes a second, by its data sheet). Nothing here was measured.\n\n"
    printf "| what | of a ray | of a million, at least |\n| --- | ---: | ---: |\n"
    printf "| products of the network, %d and as many sums | %d operations | %.1f us |\n", macs, 2 * macs, 1e12 * 2 * macs / products
    printf "| memory: the ray twice, its item written and read (%.2f runs), the answer | %.0f bytes | %.1f us |\n", runs, bytes, 1e12 * bytes / memory
    printf "| first-level caches: %d words of features and %.1f of codes for the walk (as the longest of 32 rays), if each is in a sector of 32 bytes of its own, 128 bytes a clock and processor | %.0f bytes | %.1f us |\n\n", 8 * samples, steps, 32 * gathers, 1e12 * 32 * gathers / (sms * 128 * clock)
    printf "So the floor is what features and codes take of the caches, where neighbouring rays share nothing; with rays that go\n"
    printf "side by side it is memory. How near the kernels are takes a GPU.\n" }'
}

# The paper's breakdown, and time against triangles and rays: where there is a GPU.
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
  printf 'Generated by `docs/results/gpu.sh`; do not edit by hand. How the kernels work stands in\n'
  printf '[gpu.md](../gpu.md).'
  if [[ $proof == *'emulated card'* ]]; then
    printf ' **No GPU was to be had: nothing on this page was timed, and none of it ran on one.**'
  fi
  printf '\n\n## Whole scenes, through the runtime\n\n'
  printf '`tests/gpu/run.sh tests/golden/v1-shapes.nif stanford_dragon.nif`: rays that need no mesh, answered by the\n'
  printf 'scalar reference on the CPU and by the GPU module, and how many answers differ. The instances of all objects\n'
  printf 'of a file are mirrored, stretched, and lie in each other.\n\n'
  printf '%s\n\n' "$proof"
  printf '## What compilers say\n\n'
  printf 'By `kernels/gpu/compile.sh`. Registers are those of a thread (AMD: vector registers, and accumulators after a +);\n'
  printf 'stack is memory that each thread has to itself, in bytes; spilled are registers (AMD) or bytes stored (NVIDIA);\n'
  printf 'scalar are scalar registers that lanes of vector registers keep (AMD);\n'
  printf 'waves are how many the registers leave room for on a SIMD (AMD). Shared memory is asked for at the launch and\n'
  printf 'depends on the network.\n'
  for target in gfx1030 gfx1100 gfx90a gfx942 sm_80 sm_90; do
    compiler=$(kernels/gpu/compile.sh --compiler "$target") || { printf '\n### %s\n\nNo compiler.\n' "$target" && continue; }
    kernels/gpu/compile.sh "$target" "$out"
    printf '\n### %s, by %s\n\n' "$target" "$("$compiler" --version | grep -Em1 'version|release')"
    printf '| kernel | registers | stack | spilled | scalar | waves |\n| --- | ---: | ---: | ---: | ---: | ---: |\n'
    if [[ $target == gfx* ]]; then amd "$target"; else nvidia "$target"; fi
    printf '\nMatrix instructions: %s.\n' "$(grep -oE 'v_wmma_[a-z0-9_]+|v_mfma_[a-z0-9_]+|v_dot[24][a-z0-9_]*|mma\.sync[a-z0-9.]*|dp4a[a-z0-9.]*' \
      "$out/$target.s" | sort | uniq -c | awk '{ printf "%s%s `%s`", n++ ? ", " : "", $1, $2 }')"
  done
  printf '\n## What the emulator answers\n\n'
  printf '`tools/measure/emulate_sets.sh stanford_dragon.nif stanford_dragon.ply.gz`: a million rays of every set, and how many\n'
  printf 'answers differ from the reference in any bit. The second table compares the walk by leaps, which the kernels take,\n'
  printf 'with the walk voxel by voxel: steps of a ray, steps that a wave of 32 or 64 rays in their order waits for, and loads\n'
  printf 'and bytes of a ray. The third one tells how many rays the walk leaves open for the network, how many of those have\n'
  printf 'more than eight runs, and how many runs an open ray has.\n\n'
  sed 's/./    &/; s/ *$//' "$out/dragon.txt"
  floor
  printf '\n## The fields of the paper, in both precisions\n\n'
  printf '`nif bake stanford_dragon.ply.gz -o paper.nif --preset paper --training-rays 4000000 --rays 0`, then\n'
  printf '`tools/measure/emulate_sets.sh paper.nif stanford_dragon.ply.gz`: first in single precision, where no answer differs from the\n'
  printf 'reference in any bit. Then in half precision: rays that a network was asked about; how many answers are others than\n'
  printf "the reference's; how many rays are answered wrongly in single and in half precision, by the mesh; by how much\n"
  printf 'probabilities move (dp) and log-odds at most (dz); and how many answers are farther off than the bound that follows\n'
  printf 'from the arithmetic (`tests/gpu/half_bound.hpp`). The instructions sum in different orders in the emulator, and\n'
  printf '`mfma` takes denormal halves as 0: so much the choice of a GPU may matter.\n\n'
  tools/measure/emulate_sets.sh "$papers" "$mesh" | sed 's/./    &/; s/ *$//'
  times
} >docs/results/gpu.md.new
mv docs/results/gpu.md.new docs/results/gpu.md
