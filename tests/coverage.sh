#!/usr/bin/env bash
# Shows what the tests reach of the code that reads files and answers queries: lines, and branches as they are written in the
# source. Fails where that is less than was agreed: 95 % of lines and 90 % of branches of the format, the runtime and the
# kernels, 90 % of lines of the mesh readers.
#
#   tests/coverage.sh           builds and runs the tests of these parts, in build/coverage-tests
#   tests/coverage.sh --lines   also lists each file's lines and branches, and the lines that no test reaches
#
# Needs clang, llvm-profdata, llvm-cov and jq. Takes half an hour on two cores. What fuzzers reach: tests/fuzz/coverage.sh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case ${1-} in
  '') lines=false ;;
  --lines) lines=true ;;
  *) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2 && exit 2 ;;
esac

tests=(arithmetic_test bvh_test format_test generate_test golden_test gpu_module_test gpu_test mesh_test runtime_no_memory_test
  runtime_test spherical_test traversal_test)
# PART LINES BRANCHES: folders, and the least percentages of them.
floors=('formats/nif 95 90' 'runtime 95 90' 'kernels 95 90' 'formats/mesh 90 0')

llvm=$(dirname "$(readlink -f "$(command -v clang)")")
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
build=build/coverage-tests
# Kernels are counted over all instruction sets. Counters of local functions go by the name of the main file, without its
# folder: that of the kernels is kernel.cpp for each encoding, so it is told with its folder.
# shellcheck disable=SC2016
compile='<CMAKE_CXX_COMPILER> <DEFINES> <INCLUDES> <FLAGS> -Xclang -main-file-name -Xclang <SOURCE> -o <OBJECT> -c <SOURCE>'
# What a system's header includes counts as the system's, too, and is left out: kernels are, by Highway's foreach_target.h.
# So Highway is included from a folder of our own.
highway=$(clang++ -H -fsyntax-only -x c++ - <<<'#include <hwy/base.h>' 2>&1 | sed -n '1s/^[.]* //p')
mkdir -p "$build/highway"
cp -r "$(dirname "$highway")" "$build/highway/"
cmake --preset release -B "$build" -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ -DNIF_BUILD_TESTS=ON -DNIF_WITH_GPU=OFF \
  -DCMAKE_CXX_FLAGS="-fprofile-instr-generate -fcoverage-mapping -I$PWD/$build/highway" -DCMAKE_CXX_FLAGS_RELEASE=-O1 \
  -DCMAKE_CXX_COMPILE_OBJECT="$compile" "${launcher[@]}" >/dev/null
cmake --build "$build" --parallel "$(nproc)" --target c99_test "${tests[@]}"

profiles=$build/profiles
rm -rf "$profiles"
mkdir -p "$profiles"
for name in "${tests[@]}"; do
  # One file for each program and library that is loaded, added up over processes.
  LLVM_PROFILE_FILE=$PWD/$profiles/%m.raw "$build/bin/$name" --gtest_brief=1
done
"$llvm/llvm-profdata" merge -sparse "$profiles"/*.raw -o "$profiles/all"

# What was run: the programs, and the GPU module that some of them load.
objects=()
for name in "${tests[@]:1}"; do objects+=(-object "$build/bin/$name"); done
while read -r module; do objects+=(-object "$module"); done < <(find "$build" -name 'libnif_gpu_emulated.so')
covered() {
  "$llvm/llvm-cov" "$1" "${@:2}" -instr-profile "$profiles/all" "$build/bin/${tests[0]}" "${objects[@]}" \
    "${floors[@]%% *}"
}
covered export -summary-only >"$profiles/summary.json"
# Names are of the build folder's way: FOLDER/build/coverage-tests/../../kernels/...
own='def own: .filename | sub(".*/[.][.]/[.][.]/"; "");'
if $lines; then
  jq -r "$own"' .data[0].files[] | [own] + (.summary | [.lines, .branches]
      | map("\(.covered)/\(.count)")) | @tsv' "$profiles/summary.json"
  covered show -region-coverage-lt=100 | grep -E '^[^ ].*:$|^ +[0-9]+\| +0\|' || true
fi

printf '%-13s %8s %9s   at least\n' part lines branches
status=0
for floor in "${floors[@]}"; do
  read -r part least_lines least_branches <<<"$floor"
  read -r line branch < <(jq -r --arg part "$part/" "$own"'
    [.data[0].files[] | select(own | startswith($part)) | .summary]
    | def share(what): (map(what.covered) | add) as $covered | (map(what.count) | add) | 1000 * $covered / . | floor / 10;
      "\(share(.lines)) \(share(.branches))"' "$profiles/summary.json")
  said=''
  if awk -v a="$line" -v b="$least_lines" -v c="$branch" -v d="$least_branches" 'BEGIN { exit !(a < b || c < d) }'; then
    said='  too few' status=1
  fi
  printf '%-13s %6s %% %7s %%   %s, %s%s\n' "$part" "$line" "$branch" "$least_lines" "$least_branches" "$said"
done
exit "$status"
