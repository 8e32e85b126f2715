#!/usr/bin/env bash
# Compiles the runtime with its NEON kernels for 64-bit ARM and compares them with the scalar reference, by emulation on
# other machines. Needs the Debian packages g++-aarch64-linux-gnu, qemu-user-static and libhwy-dev.
#
#   tests/neon/run.sh ASSET.nif...
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
(($#)) || { echo 'tests/neon/run.sh: name at least one asset' >&2 && exit 2; }
for program in aarch64-linux-gnu-g++ qemu-aarch64-static; do
  command -v "$program" >/dev/null || { echo "tests/neon/run.sh: $program is not installed" >&2 && exit 1; }
done
out=$root/build/neon
# Highway's headers without the others of this machine, and apart from what is made here: the program has the name of a
# standard header.
mkdir -p "$out/include"
ln -sfn /usr/include/hwy "$out/include/hwy"
# What the build compiles into the runtime, and the program. (Of the kernels not stages.cpp: it needs Highway's library.)
mapfile -t sources < <(find "$root"/runtime/src "$root"/kernels/cpu "$root"/kernels/packed "$root"/formats/nif -name '*.cpp' \
  ! -name stages.cpp ! -name 'write*.cpp' ! -name 'pack*.cpp' ! -name asset.cpp -o -path '*runtime/src*asset.cpp')
sources+=("$root/tests/neon/compare.cpp")
rm -f "$out"/*.o
export root out
# shellcheck disable=SC2016
printf '%s\n' "${sources[@]}" | xargs -P "$(nproc)" -I{} sh -c 'aarch64-linux-gnu-g++ -std=c++20 -O2 -Wall -Wextra -Wno-psabi \
  -ffp-contract=off -DNIF_HAS_SIMD -DNIF_LIBDIR=\"lib\" -DHWY_IS_DEBUG_BUILD=0 -I"$root" -I"$root/runtime/include" -I"$root/runtime/src" \
  -I"$out/include" -c {} -o "$out/$(echo {} | tr / _).o"'
aarch64-linux-gnu-g++ -static "$out"/*.o -o "$out/compare" -pthread
qemu-aarch64-static "$out/compare" "$@"
