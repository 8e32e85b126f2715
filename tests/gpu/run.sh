#!/usr/bin/env bash
# Proves the GPU kernels on a GPU, and times them. Builds the runtime alone with its GPU module and one program; needs a C++
# compiler, CMake and what compiles the kernels (nvcc, or clang for AMD), no meshes and no libraries. Compares answers with
# the scalar reference's on 10^7 rays of each of several sets, runs NVIDIA's memory checker where there is one, then times.
# The first answers that differ are printed, each with its ray.
#
#   tests/gpu/run.sh [--rays N] [--device N] [--emulate] [FILE.nif...]
#
# --rays: of each set, 10000000 by default. FILE: assets to ask; by default those of tests/golden, and one made of random
# numbers. What it finds is printed and kept in build/gpu-proof/gpu.md, with the GPU's name. Where there is no GPU, or with
# --emulate, 100000 rays are answered by an emulated GPU, and nothing is timed.
# Ends with 0 only where no answer differs; with 2 where an option is wrong.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

rays=10000000 emulated_rays=100000 device=0 emulate=0 files=()
while (($#)); do
  case $1 in
    -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
    --rays | --device)
      [[ ${2-} =~ ^[0-9]+$ && ($1 = --device || $2 -gt 0) ]] \
        || { echo "tests/gpu/run.sh: $1 wants a number, not '${2-}'" >&2 && exit 2; }
      if [[ $1 = --rays ]]; then rays=$2 emulated_rays=$2; else device=$2; fi
      shift ;;
    --emulate) emulate=1 ;;
    -*) echo "tests/gpu/run.sh: there is no option '$1'; see --help" >&2 && exit 2 ;;
    *) [[ -f $1 ]] || { echo "tests/gpu/run.sh: there is no file '$1'" >&2 && exit 2; }
      files+=("$(realpath "$1")") ;;
  esac
  shift
done

out=$root/build/gpu-proof
generator=()
if command -v ninja >/dev/null; then generator=(-G Ninja); fi
echo "Building in $out" >&2
mkdir -p "$out"
build() {
  cmake -S "$root/tests/gpu/proof" -B "$out" "${generator[@]}" -DCMAKE_BUILD_TYPE=Release \
    && cmake --build "$out" --parallel "$(nproc)"
}
build >"$out/build.log" 2>&1 \
  || { tail -40 "$out/build.log" >&2 && echo "tests/gpu/run.sh: building failed; see $out/build.log" >&2 && exit 1; }
proof=$out/bin/gpu_proof

report=$out/gpu.md
: >"$report"
# ask OPTION...: the assets one after the other, each with a table.
ask() {
  if ((${#files[@]})); then
    "$proof" --device "$device" "$@" "${files[@]}"
  else
    local failed=0
    "$proof" --device "$device" "$@" "$root"/tests/golden/*.nif || failed=1
    echo
    "$proof" --device "$device" "$@" || failed=1
    return "$failed"
  fi
}

status=0
if ((!emulate)); then
  # A few rays first: they tell whether there is a GPU at all.
  "$proof" --device "$device" --rays 1000 --rounds 0 >"$out/few.md" || status=$?
  if ((status == 3)); then
    echo 'tests/gpu/run.sh: no GPU here, so an emulated GPU answers; nothing is timed' >&2
    emulate=1 status=0
  elif ((status != 0)); then
    cat "$out/few.md" >&2
  fi
fi
if ((emulate)); then
  module=$(find "$out" -name libnif_gpu_emulated.so)
  ask --module "$module" --rays "$emulated_rays" --rounds 0 | tee -a "$report"
  exit
fi

# Whatever one step finds, the next ones are run: a GPU may not be at hand again soon.
if checker=$(command -v compute-sanitizer || ls /usr/local/cuda/bin/compute-sanitizer 2>/dev/null); then
  for tool in memcheck racecheck; do
    # That a pointer is the host's is learned from a call that fails.
    "$checker" --tool "$tool" --report-api-errors no --error-exitcode 9 "$proof" --device "$device" --rays 20000 --rounds 0 >"$out/$tool.log" 2>&1 \
      || { tail -30 "$out/$tool.log" >&2 && echo "tests/gpu/run.sh: $tool of compute-sanitizer found something" >&2; status=1; continue; }
    printf 'compute-sanitizer --tool %s, 20,000 rays of each set: nothing found.\n\n' "$tool" | tee -a "$report"
  done
fi
ask --rays "$rays" | tee -a "$report" || status=1
exit "$status"
