#!/usr/bin/env bash
# Bakes the same meshes with programs of three builds (g++ and clang++ optimised, g++ not optimised) and with one thread and
# several: all assets must be the same bytes. Then asks them about rays on every instruction set of this machine, with tables
# of either size where there are two, and by the scalar reference: all answers must be the same bits. Takes an hour or two on
# two cores, most of it the builds.
#
#   tests/determinism.sh [RAYS]      rays of each set, asset and instruction set (200000)
#
# The builds are kept in build/determinism. The mode of the caller's floating point is a test of its own
# (Outputs.* in tests/runtime), and so are the vectors of the trainers (*NarrowerVectors in tests/bake).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
rays=${1:-200000}
if [[ ! $rays =~ ^[1-9][0-9]*$ ]] || (($# > 1)); then
  echo "tests/determinism.sh: '$*' is no number of rays; see --help" >&2
  exit 2
fi
out=build/determinism
mkdir -p "$out"
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi

# build NAME CMAKE OPTIONS...: leaves build/determinism/NAME/bin/nif.
build() {
  cmake -S . -B "$out/$1" -G Ninja -DNIF_WITH_GPU=OFF -DNIF_BUILD_TESTS=OFF "${launcher[@]}" "${@:2}" >"$out/$1.log"
  cmake --build "$out/$1" --parallel "$(nproc)" --target nif >>"$out/$1.log" \
    || { echo "tests/determinism.sh: the build $1 failed; see $out/$1.log" >&2 && exit 1; }
}
build gcc-release -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=g++
build clang-release -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++
build gcc-debug -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_COMPILER=g++ -DNIF_UNITY=ON
builds=(gcc-release clang-release gcc-debug)
first=$out/${builds[0]}/bin/nif

shapes=(statue chain-mail tree)
encodings=(segment exact bvh proof spherical)
threads_of=(1 2 3)
failed=0 assets=0 baked=0
for shape in "${shapes[@]}"; do
  mesh=$out/$shape.ply
  "$first" mesh generate "$shape" -o "$mesh" --triangles 3000 --seed 5 --quiet
  for encoding in "${encodings[@]}"; do
    options=(--encoding "$encoding" --rays 0 --quiet)
    # Short trainings: what decides about bytes is done in each of their steps.
    case $encoding in
      segment) options+=(--preset fast --resolution 24) ;;
      spherical) options+=(--training-rays 100000) ;;
    esac
    sums=''
    for name in "${builds[@]}"; do
      for threads in "${threads_of[@]}"; do
        # Not optimised, it takes minutes: once is enough.
        [[ $name != gcc-debug || $threads == 1 ]] || continue
        baked=$((baked + 1))
        asset=$out/$shape.$encoding.$name.$threads.nif
        "$out/$name/bin/nif" bake "$mesh" -o "$asset" "${options[@]}" -j "$threads" 2>/dev/null
        sums+=$(sha256sum <"$asset")$'\n'
      done
    done
    assets=$((assets + 1))
    if (($(sort -u <<<"${sums%$'\n'}" | wc -l) != 1)); then
      echo "differs: $shape as $encoding" >&2
      failed=$((failed + 1))
    fi
  done
done
printf '%d assets, baked %d times; %d of them differ\n' "$assets" "$baked" "$failed"

# Every instruction set, against the scalar reference: eval --reference fails where a bit differs.
asked=0 wrong=0
for shape in "${shapes[@]}"; do
  for encoding in "${encodings[@]}"; do
    asset=$out/$shape.$encoding.gcc-release.1.nif
    tables=('')
    [[ $encoding == @(bvh|spherical) ]] || tables+=(--least-memory)
    for isa in $("$first" eval --help | sed -nE 's/.*Instruction set of the runtime: auto, (.*)/\1/p' | tr -d ,); do
      for memory in "${tables[@]}"; do
        json=$("$first" eval "$asset" --mesh "$out/$shape.ply" --rays "$rays" --isa "$isa" ${memory:+"$memory"} --reference \
          --quiet --json 2>"$out/said") || {
          # Not every machine has every instruction set.
          grep -q 'not available\|is not supported\|has no' "$out/said" && continue
          echo "differs: $shape as $encoding, $isa $memory: $(tail -n 1 "$out/said")" >&2
          wrong=$((wrong + 1))
          continue
        }
        asked=$((asked + $(jq '[.sets[].rays] | add' <<<"$json")))
      done
    done
  done
done
printf '%d answers on all instruction sets compared with the reference; %d runs differ\n' "$asked" "$wrong"
((failed + wrong == 0))
