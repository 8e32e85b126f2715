#!/usr/bin/env bash
# Compiles the GPU kernels for one target.
#
#   kernels/gpu/compile.sh TARGET FOLDER     TARGET: gfx1030, gfx1100, gfx90a, gfx942, sm_80, sm_90
#   kernels/gpu/compile.sh --compiler TARGET prints the compiler that would be taken
#   kernels/gpu/compile.sh --check TARGET    only whether it is valid source: a second, AMD only; writes nothing
#
# Writes to FOLDER: TARGET.co (AMD) or TARGET.cubin (NVIDIA), which a driver loads; TARGET.s, its assembly
# (for NVIDIA, PTX); TARGET.txt, what the compiler reports about registers, shared memory and spills.
#
# AMD targets need a clang with AMDGPU, version 15 or newer, and its lld: Debian's clang-15, lld-15, clang-19,
# lld-19. gfx942 needs clang 17 or newer. So does gfx1100: clang 15 lets v_mad_u64_u32 overwrite its own
# sources there, which its own assembler refuses, because the hardware gives a wrong result. NVIDIA targets
# need nvcc. Nothing else is needed: no headers and no libraries of HIP or CUDA. Exits with 3 if there is no
# compiler for the target.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

first_of() {
  local name
  for name in "$@"; do
    if command -v "$name"; then return; fi
  done
  return 1
}
# The first clang that has its linker; without it clang makes no code objects.
first_clang_of() {
  local name
  for name in "$@"; do
    if command -v "$name" >/dev/null && command -v "$("$name" -print-prog-name=ld.lld)" >/dev/null; then
      command -v "$name"
      return
    fi
  done
  return 1
}
find_compiler() {
  case $1 in
    gfx942 | gfx1100) first_clang_of clang++-19 clang++-18 clang++-17 ;;
    gfx*) first_clang_of clang++-15 clang++-16 clang++-17 clang++-18 clang++-19 ;;
    sm_*) first_of nvcc /usr/local/cuda/bin/nvcc ;;
  esac
}

check=0
if [[ ${1-} == --check ]]; then
  check=1
  shift
  [[ ${1-} == gfx* ]] || { echo "kernels/gpu/compile.sh: --check is for AMD targets, not '${1-}'" >&2 && exit 2; }
fi
case ${1-} in
  '' | -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
  --compiler) find_compiler "${2-}" || exit 3 ;;
  gfx1030 | gfx1100 | gfx90a | gfx942 | sm_80 | sm_90) ;;
  *) echo "kernels/gpu/compile.sh: there is no target '$1'; see --help" >&2 && exit 2 ;;
esac
[[ $1 != --compiler ]] || exit 0
target=$1 folder=${2-}
((check)) || [[ -d $folder ]] || { echo "kernels/gpu/compile.sh: there is no folder '$folder'" >&2 && exit 2; }
compiler=$(find_compiler "$target") || { echo "kernels/gpu/compile.sh: no compiler for $target" >&2 && exit 3; }

# The answer is defined without fused multiply-add, and with correctly rounded divisions and square roots. On
# a target without matrix units (gfx1030) products of halves are long once unrolled; without the option, clang
# gives up halfway. Without -fuse-cuid=none a symbol is named after the source's folder, and no two folders
# give the same bytes.
amd=(-x hip -std=c++20 --offload-arch="$target" --cuda-device-only --no-gpu-bundle-output -nogpuinc -nogpulib
  -fuse-cuid=none -O3 -ffp-contract=off -mllvm -pragma-unroll-threshold=65536 -Wall -Wextra -Werror -I.)
if ((check)); then
  exec "$compiler" "${amd[@]}" -Xclang -disable-llvm-passes -emit-llvm -S kernels/gpu/module.cpp -o /dev/null
fi
report=$folder/$target.txt
compile() {
  if [[ $target == gfx* ]]; then
    "$compiler" "${amd[@]}" -Rpass-analysis=kernel-resource-usage -S kernels/gpu/module.cpp -o "$folder/$target.s" \
      && "$compiler" --target=amdgcn-amd-amdhsa -mcpu="$target" -nogpulib "$folder/$target.s" -o "$folder/$target.co"
  else
    "$compiler" -x cu -std=c++20 -arch="${target/sm/compute}" -ptx -O3 -fmad=false -prec-div=true -prec-sqrt=true \
      -ftz=false -Werror all-warnings -I. kernels/gpu/module.cpp -o "$folder/$target.ptx" \
      && mv "$folder/$target.ptx" "$folder/$target.s" \
      && cp "$folder/$target.s" "$folder/$target.tmp.ptx" \
      && "$compiler" -arch="$target" -cubin -O3 -Xptxas -v "$folder/$target.tmp.ptx" -o "$folder/$target.cubin" \
      && rm "$folder/$target.tmp.ptx"
  fi
}
rm -f "$folder/$target".*
if ! compile >"$report" 2>&1; then
  grep -v remark: "$report" >&2 || true
  rm -f "$folder/$target".*
  echo "kernels/gpu/compile.sh: $compiler failed for $target" >&2
  exit 1
fi
