#!/usr/bin/env bash
# Shows how many lines the fuzzers' corpora reach of what reads and of what builds tables, and fails where that is less
# than it has to be: then a fuzzer no longer gets where it is meant to.
#
#   tests/fuzz/coverage.sh            the corpora of the tree, tests/corpus
#   tests/fuzz/coverage.sh FOLDER     also those that tests/nightly.sh keeps, in FOLDER/corpus (build/nightly)
#
# Builds in build/coverage. Needs clang, llvm-profdata and llvm-cov.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
[[ $# -le 1 && ${1-} != -* ]] || { sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2 && exit 2; }
kept=${1:+$(realpath "$1")/corpus}

# FUZZER PERCENT FILES...: of all lines in these, by the seeds in the tree alone.
floors=(
  'asset 90 formats/nif'
  'asset 95 kernels/packed'
  'validate 85 formats/validate'
  'gpu 95 kernels/packed'
  'gpu 90 kernels/gpu/bvh/upload.cpp kernels/gpu/exact/upload.cpp kernels/gpu/proof/upload.cpp kernels/gpu/segment/upload.cpp kernels/gpu/spherical/upload.cpp runtime/gpu/upload.cpp'
  'api 80 runtime/src/api runtime/src/scene'
  'mesh 70 formats/mesh'
  'scene 70 tools/batch/manifest.cpp tools/batch/record.cpp tools/batch/glob.cpp tools/common/toml_table.cpp tools/render/scene_file.cpp tools/render/image.cpp'
  'attach 75 formats/mesh/gltf/attach.cpp formats/mesh/gltf/json_text.cpp tools/attach/nodes.cpp'
)

llvm=$(dirname "$(readlink -f "$(command -v clang)")")
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
names=()
for floor in "${floors[@]}"; do
  name=${floor%% *}
  [[ " ${names[*]-} " == *" $name "* ]] || names+=("$name")
done
cmake --preset fuzz -B build/coverage -DNIF_FUZZ_COVERAGE=ON -DNIF_SANITIZE= -DNIF_UNITY=ON "${launcher[@]}" >/dev/null
cmake --build build/coverage --parallel "$(nproc)" --target fuzz_seeds "${names[@]/#/fuzz_}" >/dev/null

profiles=build/coverage/profiles
mkdir -p "$profiles"
for name in "${names[@]}"; do
  read -ra folders < <(awk -F '\t' -v name="$name" '$1 == name { print $2 }' build/coverage/tests/fuzz/limits)
  [[ ${folders[0]} != tests/corpus/asset ]] || folders+=(build/coverage/tests/fuzz/seeds)
  [[ -z $kept || ! -d $kept/$name ]] || folders+=("$kept/$name")
  printf '%-8s' "$name"
  LLVM_PROFILE_FILE=$profiles/$name.raw "build/coverage/bin/fuzz_$name" "${folders[@]}"
  "$llvm/llvm-profdata" merge -sparse "$profiles/$name.raw" -o "$profiles/$name"
done

# percent FUZZER FILES...
percent() {
  "$llvm/llvm-cov" export -summary-only -instr-profile "$profiles/$1" "build/coverage/bin/fuzz_$1" "${@:2}" \
    | jq -r '.data[0].totals.lines.percent | floor'
}
printf '\n%-8s %7s %7s  %s\n' fuzzer lines floor of
status=0
for floor in "${floors[@]}"; do
  read -r name least files <<<"$floor"
  read -ra files <<<"$files"
  lines=$(percent "$name" "${files[@]}")
  said=''
  if ((lines < least)); then said='  too few' status=1; fi
  printf '%-8s %6d%% %6d%%  %s%s\n' "$name" "$lines" "$least" "${files[*]}" "$said"
done
exit "$status"
