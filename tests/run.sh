#!/usr/bin/env bash
# Checks nifkit, from a clean clone on a bare machine. There are three sizes:
#
#   tests/run.sh               what guards every change: builds with warnings as errors, checks the style, and runs all tests
#                              but the long ones. What needs CGAL is left out, and code for GPUs, whose source is checked
#   tests/run.sh --all         as continuous integration does: also CGAL, long tests, real meshes, what reads assets under the
#                              sanitizers, every fuzzer, code for a GPU, the public headers by themselves, and bindings whose hosts
#                              are installed
#   tests/run.sh --nightly [HOURS]   all tests, as users compile the program, with code for every GPU; each source and header by
#                              itself, and the runtime alone; NEON's kernels, emulated; the runtime's threads under the sanitizer,
#                              for an hour, and kernels of each instruction set; those, slow tests, the readers of meshes, the
#                              baker, the tools, the renderer and CGAL under the other sanitizers; hundreds of kills; 10^7
#                              segments of each mesh; 10^8 rays by shaders; the same bytes by clang++ and by code that is not
#                              optimised; a release candidate made twice; bindings in a browser, in Blender, under Wine; what tests
#                              and fuzzers reach; then fuzzes and bakes random meshes for so many hours (8), going on from the last
#                              time; see tests/nightly.sh
#
# Long tests, those above 3 seconds (tests/costs.py), have ctest's label `long`; those that take long and of which others ask the
# same in short have `nightly`, and run there. Those that take long under the sanitizers only, mostly because they train, have
# `slow` there, and run with --nightly. NIF_TEST_MESHES names a folder of real meshes, NIF_TEST_GAMES one of scenes of games;
# without them the tests over those are skipped.
# The last line is "N passed, N failed, N skipped", added up over all runs of tests; a step that fails without having
# run a test counts as one failure. Ends with 0 only where nothing failed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

size=plain hours=8
case ${1-} in
  '') ;;
  --all | --nightly) size=${1#--} ;;
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
  *) echo "tests/run.sh: unknown option '$1'; see --help" >&2 && exit 2 ;;
esac
if [[ $size == nightly && $# -gt 1 ]]; then
  hours=$2
  shift
fi
[[ $hours =~ ^[0-9]+(\.[0-9]+)?$ ]] || { echo "tests/run.sh: '$hours' is not a number of hours" >&2 && exit 2; }
(($# <= 1)) || { echo "tests/run.sh: one size at a time; see --help" >&2 && exit 2; }

passed=0 failed=0 skipped=0
times=() reasons=''

finish() {
  local status=$?
  if ((${#times[@]})); then
    printf '\nseconds  step\n'
    printf '%s\n' "${times[@]}"
  fi
  if [[ -n $reasons ]]; then
    printf '\nskipped  why\n'
    sort <<<"$reasons" | sed '/^$/d' | uniq -c | awk '{ n = $1; sub(/^ *[0-9]+ /, ""); printf "%7d  %s\n", n, $0 }'
  fi
  ((status == 0 || failed > 0)) || failed=1
  printf '\n%d passed, %d failed, %d skipped\n' "$passed" "$failed" "$skipped"
  ((failed == 0)) || exit 1
}
trap finish EXIT

# step NAME COMMAND...: runs it and notes how long it took. What fails is counted; the caller decides about going on.
step() {
  local name=$1 start=$SECONDS status=0
  shift
  printf '\n== %s\n' "$name"
  "$@" || status=$?
  times+=("$(printf '%7d  %s' $((SECONDS - start)) "$name")")
  if ((status)); then
    echo "== $name: failed" >&2
    times[-1]+=' (failed)'
    step_failed "$name"
  fi
  return "$status"
}
step_failed() { [[ $1 == test* ]] || failed=$((failed + 1)); }

# run_tests FOLDER [ctest options]: runs the tests of a build folder or of a part of it, the long ones with --all, these and the
# slow ones with --nightly, and adds up their outcomes.
run_tests() {
  local folder=$1 report status=0 tests failures skips
  shift
  case $size in
    all) set -- "$@" --label-exclude '^nightly$|slow$' ;;
    nightly) set -- "$@" --label-exclude '^too-slow$' ;;
    *) set -- "$@" --label-exclude '^(long|nightly)$|slow$' ;;
  esac
  report=$(mktemp)
  ctest --test-dir "$folder" --parallel 2 --output-on-failure --no-tests=error --output-junit "$report" "$@" \
    | sed -uE '/^ +Start +[0-9]+:/d; s/ \.{4,}/ .../' || status=$?
  tests=$(count tests "$report") failures=$(count failures "$report")
  skips=$(($(count skipped "$report") + $(count disabled "$report")))
  # GoogleTest prints a line that ends in ": Skipped", then the reason.
  reasons+=$(awk 'why { print; why = 0 } /: Skipped$/ { why = 1 }' "$report")$'\n'
  rm -f "$report"
  ((status == 0 || failures > 0)) || failures=1
  passed=$((passed + tests - failures - skips))
  failed=$((failed + failures))
  skipped=$((skipped + skips))
  return "$status"
}

# count KEY REPORT: an attribute of a JUnit report's test suite; 0 where ctest came to nothing.
count() {
  local number
  number=$(sed -n "s/^[[:space:]]*$1=\"\([0-9]*\)\".*/\1/p" "$2" | head -n 1)
  echo "${number:-0}"
}

jobs=$(nproc)
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi

# configure PRESET [cmake options]
configure() {
  cmake --preset "$1" -DNIF_WERROR=ON -DNIF_BUILD_TESTS=ON -DNIF_UNITY=ON "${launcher[@]}" "${@:2}" >/dev/null
}
# The emulator shows what is wrong with the kernels nearly always; their code for one GPU, some of the rest. What only the
# others' compilers can say, about registers and instructions, --nightly asks: each takes minutes. So does what includes CGAL.
configure_release() {
  if [[ $size == all ]]; then
    configure release -DNIF_LONG_TESTS=ON -DNIF_GPU_TARGETS=gfx90a -DNIF_WITH_CGAL=ON
  else
    configure release -DNIF_LONG_TESTS=OFF -DNIF_GPU_TARGETS= -DNIF_WITH_CGAL=OFF
  fi
}

# Whether the kernels are valid source for GPUs of each kind. Code for one takes minutes; clang's analysis, and nvcc without
# optimising, seconds.
check_gpus() {
  local target nvcc
  for target in gfx1030 gfx1100 gfx90a gfx942; do
    ! kernels/gpu/compile.sh --compiler "$target" >/dev/null || kernels/gpu/compile.sh --check "$target" || return
  done
  ! nvcc=$(kernels/gpu/compile.sh --compiler sm_80) \
    || "$nvcc" -x cu -std=c++20 -arch=compute_80 -ptx -G -Werror all-warnings -I. kernels/gpu/module.cpp -o /dev/null
}

check_style() {
  git ls-files -z '*.cpp' '*.hpp' '*.h' '*.c' | xargs -0 -n 32 -P "$jobs" clang-format --dry-run -Werror \
    && git ls-files -z '*.sh' .ci/run | xargs -0 shellcheck
}

# The runtime needs a compiler and nothing else: its own folder is all that CMake is shown. Its GPU module has been built.
# Each source is compiled by itself, with assertions; nobody runs it, so it is not optimised.
build_runtime() {
  cmake -S runtime -B build/runtime -G Ninja -DNIF_WERROR=ON -DNIF_WITH_GPU=OFF -DCMAKE_CXX_FLAGS_RELEASE= \
    "${launcher[@]}" >/dev/null \
    && cmake --build build/runtime --parallel "$jobs"
}

# build_part PRESET 'TARGET...' [cmake options]: configures a preset and builds some of its targets.
build_part() {
  local targets
  read -ra targets <<<"$2"
  configure "$1" "${@:3}" && cmake --build "build/$1" --parallel "$jobs" --target "${targets[@]}"
}

# Compiled together, sources hide what their neighbours forget to include and which of their names hide others.
build_alone() {
  configure release -B build/alone -DNIF_UNITY=OFF -DNIF_GPU_TARGETS= && cmake --build build/alone --parallel "$jobs"
}

# asan_tests PRESET FOLDER...: parts of the tests, named by folder: their targets are the folder's "all".
asan_tests() {
  local preset=$1 folder
  shift
  step "build $preset" build_part "$preset" "write_random_asset $(printf 'tests/%s/all ' "$@")" "${asan_options[@]}" || return
  for folder in "$@"; do
    step "test $preset: $folder" run_tests "build/$preset/tests/$folder" || true
  done
}
# With --all, CGAL takes too long to compile, and is not ours to check; vectors are those of the best instruction set.
asan_options=(-DNIF_WITH_CGAL=ON -DNIF_BEST_KERNELS=OFF)
[[ $size == nightly ]] || asan_options=(-DNIF_WITH_CGAL=OFF -DNIF_BUILD_TOOLS=ON)
# Threads are the runtime's. The baker's TBB and Embree are not built for the thread sanitizer. Tests that ask about arithmetic and
# messages, and take longer than all others under it, run with --nightly.
tsan_tests() {
  local more=() best=OFF
  [[ $size == nightly ]] || more=(--exclude-regex '/(AssetInformation|IsaTest|RuntimeBvh|RuntimeSpherical)\.|^BadInput\.') best=ON
  step 'build tsan' build_part tsan 'write_random_asset tests/runtime/all' -DNIF_BUILD_TOOLS=OFF "-DNIF_BEST_KERNELS=$best" \
    || return
  step 'test tsan: runtime' run_tests build/tsan/tests/runtime "${more[@]}" || true
}

# stress_threads: under the thread sanitizer, for an hour, or for the hours given where that is less.
stress_threads() {
  NIF_STRESS_SECONDS=$(awk -v hours="$hours" 'BEGIN { print hours < 1 ? hours * 3600 : 3600 }') \
    build/tsan/bin/runtime_test --gtest_filter=Stress.ForHalfAMinute
}

# host_test NAME COMMAND...: a test whose host may be missing. Then it prints a line that starts with "Skipped: ".
host_test() {
  local said skips
  said=$(mktemp)
  if step "test $1" saying_to "$said" "${@:2}"; then
    skips=$(sed -n 's/^Skipped: //p' "$said")
    if [[ -n $skips ]]; then
      skipped=$((skipped + $(wc -l <<<"$skips")))
      reasons+=$skips$'\n'
    else
      passed=$((passed + 1))
    fi
  else
    failed=$((failed + 1))
  fi
  rm -f "$said"
}
saying_to() { "${@:2}" 2>&1 | tee "$1"; }

# many_segments: proofs, exact objects and first hits on real meshes, proofs on generated ones, GPU kernels on each ray set, and
# 10^8 rays of them all by shaders, where Vulkan is installed.
many_segments() (
  export NIF_TEST_LARGEST=1 NIF_TEST_SEGMENTS=10000000
  build/release/bin/truth_test --gtest_filter='*OnRealMeshes.*:*OfRealMeshes.*:*.IsNeverWrongOnMillions/*' \
    && build/release/bin/exact_object_test --gtest_filter='*OnRealMeshes.*' \
    && build/release/bin/cli_test --gtest_filter='RealMeshes.*' \
    && NIF_TEST_SEGMENTS=1000000 build/release/bin/gpu_sets_test || return
  [[ ! -x build/release/bin/shader_sets_test ]] \
    || NIF_TEST_SEGMENTS=20000000 build/release/bin/shader_sets_test --gtest_filter='*.*AnsweredAsByTheCpu'
)

needed=(build check gpu shader)
case $size in
  all) needed+=(fuzz) ;;
  nightly) needed+=(fuzz arm) ;;
esac
step 'set up' tools/setup.sh "${needed[@]}" || exit 1
if [[ $size == nightly ]]; then
  step 'build release' build_part release all -DNIF_LONG_TESTS=ON -DNIF_WITH_CGAL=ON -UNIF_GPU_TARGETS || exit 1
  step 'build fuzz' build_part fuzz tests/fuzz/all || exit 1
  step 'test release' run_tests build/release || true
  step 'build each source by itself' build_alone || true
  step 'check headers' tests/headers.sh || true
  step 'build the runtime alone' build_runtime || true
  step 'NEON, emulated' tests/neon/run.sh || true
  tsan_tests || true
  step 'threads, for an hour at most' stress_threads || true
  step 'kills, 250 of each' env NIF_KILLS=250 build/release/bin/kill_test || true
  step 'no memory at every 1,000th allocation' env NIF_EVERY_ALLOCATION=1000 \
    build/release/bin/faults_test '--gtest_filter=NoMemory.*' || true
  step '10^7 segments of each mesh' many_segments || true
  asan_tests asan bake cli format golden kernels mesh mesh_verbs render runtime validate || true
  step 'the same bytes and bits by other compilers' tests/determinism.sh || true
  host_test 'a release candidate, made twice' tests/release.sh
  host_test 'fuzz in 32 bits' tests/fuzz/bits32/run.sh 100000
  host_test 'sound behind an object' samples/audio/test.sh
  host_test 'a game in LÖVE' samples/love/test.sh
  host_test 'pages in a browser' tests/pages/run.sh
  host_test 'WebAssembly in a browser' bindings/web/test/browser.sh
  host_test 'a page with three.js' samples/web/test.sh
  host_test 'a compute shader' samples/vulkan/test.sh
  host_test 'a page with WebGPU' samples/webgpu/test.sh
  host_test 'a page with PlayCanvas' samples/playcanvas/test.sh
  if step 'build cases of shaders' build_part release shader_cases; then
    host_test 'WGSL by two compilers' tests/shader/wgsl/run.sh 5000000
  fi
  host_test 'shadow rays of Cycles' samples/cycles/test.sh
  host_test 'Windows' tests/windows/run.sh
  host_test 'the add-on for Blender' bindings/blender/tests/run.sh
  step 'what tests reach' tests/coverage.sh || true
  step 'what fuzzers reach' tests/fuzz/coverage.sh || true
  step 'fuzz, and bake random meshes' tests/nightly.sh "$hours" || true
  exit
fi
if [[ $size == all && -z ${NIF_TEST_MESHES-} ]]; then
  echo 'NIF_TEST_MESHES is not set: tests over real meshes will be skipped'
fi
step 'configure release' configure_release || exit 1
step 'build release' cmake --build build/release --parallel "$jobs" || exit 1
step 'check style' check_style || true
# It runs under the sanitizers, too, where it says more.
once=()
[[ $size != all ]] || once=(--exclude-regex '^Stress.ForHalfAMinute$')
step 'test release' run_tests build/release "${once[@]}" || true
step 'check kernels for GPUs' check_gpus || true
[[ $size == all ]] || exit 0
step 'check public headers' tests/headers.sh --public || true
# Fuzzers have the address sanitizer, too, so one build does for both.
asan_tests fuzz fuzz format golden kernels runtime validate || true
tsan_tests || true
host_test 'Python' bindings/python/test.sh
host_test 'WebAssembly' bindings/web/test/run.sh
