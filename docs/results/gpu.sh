#!/usr/bin/env bash
# Writes docs/results/gpu.md: what compilers make of the GPU kernels for every target, and how the kernels answer in the
# emulator, on the Stanford dragon. Needs no GPU; where there is one, tests/gpu/run.sh proves and times the kernels on it.
# Takes some fifteen minutes on two cores.
#
#   docs/results/gpu.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

asset=build/sample/stanford_dragon.nif
[[ -f $asset ]] || samples/run.sh >/dev/null
mesh=${asset%.nif}.ply.gz
[[ -f $asset && -f $mesh ]] || { echo 'docs/results/gpu.sh: the dragon is not to be had' >&2 && exit 1; }

# Before the page's first line, which depends on whether there is a GPU.
proof=$(tests/gpu/run.sh tests/golden/v1-shapes.nif "$asset")

out=build/gpu
mkdir -p "$out"

# Fields of the paper's kind, learned for a minute only: how precisely they are evaluated does not depend on it.
papers=$out/paper.nif
if [[ ! -f $papers ]]; then
  cmake --build build/release --target nif >&2
  build/release/bin/nif bake "$mesh" -o "$papers" --preset paper --training-rays 4000000 --rays 0 --quiet
fi

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
  printf 'Written by `docs/results/gpu.sh`: change nothing here by hand. How the kernels work stands in\n'
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
  printf 'By `kernels/hip/compile.sh`. Registers are those of a thread (AMD: vector registers, and accumulators after a +);\n'
  printf 'stack is memory that each thread has to itself, in bytes; spilled are registers (AMD) or bytes stored (NVIDIA);\n'
  printf 'scalar are scalar registers that lanes of vector registers keep (AMD);\n'
  printf 'waves are how many the registers leave room for on a SIMD (AMD). Shared memory is asked for at the launch and\n'
  printf 'depends on the network: see below; that of `nif_bvh` is 20480 bytes a block, that of `nif_spherical` 32768 for the\n'
  printf 'networks of the paper. On gfx1030 the stack of `nif_spherical_half` has copies of arguments that nothing reads.\n'
  for target in gfx1030 gfx1100 gfx90a gfx942 sm_80 sm_90; do
    compiler=$(kernels/hip/compile.sh --compiler "$target") || { printf '\n### %s\n\nNo compiler.\n' "$target" && continue; }
    kernels/hip/compile.sh "$target" "$out"
    printf '\n### %s, by %s\n\n' "$target" "$("$compiler" --version | grep -Em1 'version|release')"
    printf '| kernel | registers | stack | spilled | scalar | waves |\n| --- | ---: | ---: | ---: | ---: | ---: |\n'
    if [[ $target == gfx* ]]; then amd "$target"; else nvidia "$target"; fi
    printf '\nMatrix instructions: %s.\n' "$(grep -oE 'v_wmma_[a-z0-9_]+|v_mfma_[a-z0-9_]+|v_dot[24][a-z0-9_]*|mma\.sync[a-z0-9.]*|dp4a[a-z0-9.]*' \
      "$out/$target.s" | sort | uniq -c | awk '{ printf "%s%s `%s`", n++ ? ", " : "", $1, $2 }')"
  done
  printf '\n## What the emulator answers\n\n'
  printf '`tests/gpu/emulate.sh stanford_dragon.nif stanford_dragon.ply.gz`: a million rays of every set, and how many\n'
  printf 'answers differ from the reference in any bit. `open` rays are left to the network by the walk, `hard` ones have\n'
  printf 'more than eight runs. The second table compares the walk by leaps, which the kernels take, with the walk voxel by\n'
  printf 'voxel: steps of a ray, steps that a wave of 32 or 64 rays in their order waits for, and loads and bytes of a ray.\n\n'
  tests/gpu/emulate.sh "$asset" "$mesh" | sed 's/./    &/; s/ *$//'
  printf '\n## The fields of the paper, in both precisions\n\n'
  printf '`nif bake stanford_dragon.ply.gz -o paper.nif --preset paper --training-rays 4000000 --rays 0`, then\n'
  printf '`tests/gpu/emulate.sh paper.nif stanford_dragon.ply.gz`: first in single precision, where no answer differs from the\n'
  printf 'reference in any bit. Then in half precision: rays that a network was asked about; how many answers are others than\n'
  printf "the reference's; how many rays are answered wrongly in single and in half precision, by the mesh; by how much\n"
  printf 'probabilities move (dp) and log-odds at most (dz); and how many answers are farther off than the bound that follows\n'
  printf 'from the arithmetic (`tests/gpu/half_bound.hpp`). The instructions sum in different orders in the emulator, and\n'
  printf '`mfma` takes denormal halves as 0: so much the choice of a GPU may matter.\n\n'
  tests/gpu/emulate.sh "$papers" "$mesh" | sed 's/./    &/; s/ *$//'
} >docs/results/gpu.md.new
mv docs/results/gpu.md.new docs/results/gpu.md
