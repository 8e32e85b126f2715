#!/usr/bin/env bash
# Fuzzes the asset reader and the runtime in 32 bits, as in WebAssembly. Needs what `tools/setup.sh build fuzz bits32` installs.
#
#   tests/fuzz/bits32/run.sh [RUNS]    inputs (20,000)
set -euo pipefail
runs=${1:-20000}
[[ $runs =~ ^[0-9]+$ && $# -le 1 ]] || { sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2 && exit 2; }
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
if ! echo 'int main() {}' | clang++ -m32 -fsanitize=address -x c++ - -o /dev/null 2>/dev/null; then
  echo 'Skipped: no clang that compiles for 32 bits (tools/setup.sh fuzz bits32)'
  exit
fi
out=build/bits32 found=build/bits32/found/
launcher=()
! command -v ccache >/dev/null || launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake -S tests/fuzz/bits32 -B "$out" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_C_COMPILER=clang \
  -DCMAKE_CXX_COMPILER=clang++ "${launcher[@]}" >/dev/null
cmake --build "$out" --parallel "$(nproc)" --target fuzz_asset >&2
mkdir -p "$found"
corpus=$(printf '%s,' tests/corpus/asset/* tests/golden/*.nif)
"$out/bin/fuzz_asset" -runs="$runs" -seed=32 -max_len=32768 -rss_limit_mb=2048 -malloc_limit_mb=1024 -timeout=60 -report_slow_units=1000 \
  -verbosity=0 -artifact_prefix="$found" -seed_inputs="${corpus%,}"
echo "fuzz_asset in 32 bits: $runs inputs, none found wrong"
