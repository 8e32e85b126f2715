#!/usr/bin/env bash
# Shows the share of lines of readers and table builders that the fuzzers' corpora reach. Fails if one is below its limit,
# because then a fuzzer no longer reaches its target.
#
#   tests/fuzz/coverage.sh            the corpora of the tree, tests/corpus
#   tests/fuzz/coverage.sh FOLDER     also those that tests/nightly.sh keeps, in FOLDER/corpus (build/nightly)
#
# Builds in build/coverage. Needs clang, llvm-profdata and llvm-cov.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
[[ $# -le 1 && ${1-} != -* ]] || { sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2 && exit 2; }
kept=${1:+$(realpath "$1")/corpus}

# FUZZER PERCENT FILES: of all lines in files of that name, by the seeds in the tree alone. About five points below the share
# when the line was written.
floors=(
  'asset 88 formats/nif/(reader|container)[.]|formats/nif/[a-z]+/(read_[a-z]+|check_[a-z]+|colors_section|cell_sides|source_triangles_section|coded_[a-z]+)[.]'
  'asset 90 kernels/packed/'
  'validate 86 formats/validate/'
  'gpu 88 kernels/packed/'
  'gpu 90 kernels/gpu/encodings/gpu_[a-z]+[.]cpp|runtime/gpu/upload[.]cpp'
  'api 72 runtime/src/(api|scene)/'
  'mesh 70 formats/mesh/([a-z]+_reader|ply_header|read|decompress|image|text_cursor)[.]cpp'
  'mesh 68 formats/mesh/gltf/(accessor|animation|fixtures|gltf_hierarchy|json|look|meshopt|gltf_reader|skin|uri)[.]cpp'
  'rays 83 tools/query/(input_stream|ray_line|ray_npy|ray_text)[.]cpp'
  'scene 72 tools/batch/(manifest_glob|manifest)[.]cpp|tools/common/toml_table[.]cpp|tools/render/(scene_file|image_file)[.]cpp'
  'attach 80 formats/mesh/gltf/(attach|gltf_json_text)[.]cpp|tools/attach/nodes[.]cpp'
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
  printf '%-9s' "$name"
  LLVM_PROFILE_FILE=$profiles/$name.raw "build/coverage/bin/fuzz_$name" "${folders[@]}"
  "$llvm/llvm-profdata" merge -sparse "$profiles/$name.raw" -o "$profiles/$name"
done

# percent FUZZER FILES
percent() {
  "$llvm/llvm-cov" export -summary-only -instr-profile "$profiles/$1" "build/coverage/bin/fuzz_$1" \
    | jq -r --arg files "$2" '[.data[0].files[] | select(.filename | test($files)) | .summary.lines]
                              | 100 * (map(.covered) | add) / (map(.count) | add) | floor'
}
printf '\n%-9s %7s %7s  %s\n' fuzzer lines floor of
status=0
for floor in "${floors[@]}"; do
  read -r name least files <<<"$floor"
  lines=$(percent "$name" "$files")
  said=''
  if ((lines < least)); then said='  too few' status=1; fi
  printf '%-9s %6d%% %6d%%  %s%s\n' "$name" "$lines" "$least" "$files" "$said"
done
exit "$status"
