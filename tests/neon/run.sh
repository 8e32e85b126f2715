#!/usr/bin/env bash
# Compiles the runtime with its NEON kernels for 64-bit ARM and compares them with the scalar reference; then installs and moves
# it, and builds and runs programs against the package. By emulation on other machines. Needs what `tools/setup.sh build arm` installs.
#
#   tests/neon/run.sh [ASSET.nif]...     the golden assets where none is named
set -euo pipefail
case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
  -*) echo "tests/neon/run.sh: there is no option '$1'; see --help" >&2 && exit 2 ;;
esac
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
(($#)) || set -- "$root"/tests/golden/*.nif
for program in aarch64-linux-gnu-g++ qemu-aarch64-static; do
  command -v "$program" >/dev/null || { echo "tests/neon/run.sh: $program is not installed" >&2 && exit 1; }
done
out=$root/build/neon
cmake -S "$root/tests/neon" -B "$out" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$root/tests/neon/aarch64.cmake" \
  -DCMAKE_BUILD_TYPE=Release -DNIF_WERROR=ON -DNIF_WITH_GPU=OFF >/dev/null
cmake --build "$out" --parallel "$(nproc)" --target compare nif_shared >&2
qemu-aarch64-static "$out/bin/compare" "$@"

# Those of the package's tests that do not ask this machine's own tools. The shared library needs ARM's libraries.
log=$out/package.log
for step in install engine cpp_consumer symbols; do
  if ! cmake -D STEP=$step -D DIR="$out/package" -D SOURCE="$root" -D BUILD="$out" -D CONFIG=Release -D LIBDIR=lib \
    -D DATADIR=share -D GENERATOR=Ninja -D CC=aarch64-linux-gnu-gcc -D CXX=aarch64-linux-gnu-g++ \
    -D TOOLCHAIN="$root/tests/neon/aarch64.cmake" -D EMULATOR='qemu-aarch64-static;-L;/usr/aarch64-linux-gnu' \
    -D ASSET="$root/tests/golden/v2-objects.nif" -P "$root/tests/package/package.cmake" >"$log" 2>&1; then
    cat "$log" >&2
    exit 1
  fi
  echo "package: $step: passed"
done
