#!/usr/bin/env bash
# What takes hours, and goes on where it was the last time: fuzzes all that reads (tests/fuzz) from the corpora that it keeps;
# bakes random meshes, whose certain answers must never be wrong; judges answers about hostile ones in exact arithmetic; and
# compares all instruction sets in random scenes (tests/exact). tests/run.sh --nightly builds what it needs and runs it.
#
#   tests/nightly.sh HOURS     by the clock; on every core but one it fuzzes, on that one it bakes and judges by turns
#
# Each round goes to the fuzzer that has had the least CPU time. What is known is kept in build/nightly, or in NIF_NIGHTLY:
# for each fuzzer a folder in corpus/ and one in findings/ (inputs that crashed; each is tried again at the start, and goes
# into the corpus once it is mended), fuzz.tsv, meshes.tsv, judged.tsv and scenes.tsv (a line for each round), failed (meshes
# that failed, tried again at the start, too), judged (cases that were answered wrongly, and what was said of them and of scenes
# that differed: once mended, move a case to tests/exact/cases and empty the folder). It may be ended at any time. Ends with 1
# where there is a finding, old or new, or a fuzzer does not start.
set -euo pipefail
[[ ${1-} =~ ^[0-9]+(\.[0-9]+)?$ && $# == 1 ]] \
  || { sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2 && exit 2; }
cd "$(dirname "${BASH_SOURCE[0]}")/.."
nif=build/release/bin/nif judge=build/release/bin/judge_rays compare=build/release/bin/scene_rays built=build/fuzz/tests/fuzz/limits
[[ -r $built ]] || { echo "tests/nightly.sh: no fuzzers are built; tests/run.sh --nightly builds them" >&2 && exit 2; }
# Of each fuzzer: which folders it starts with, and its limits.
declare -A seeds limits
while IFS=$'\t' read -r name folders options; do
  seeds[$name]=$folders limits[$name]=$options
  [[ $folders != tests/corpus/asset* ]] || seeds[$name]+=' build/fuzz/tests/fuzz/seeds'
done <"$built"
for program in "$nif" "$judge" "$compare" "${!seeds[@]}"; do
  [[ $program == build/* ]] || program=build/fuzz/bin/fuzz_$program
  [[ -x $program ]] || { echo "tests/nightly.sh: $program is not built; tests/run.sh --nightly builds it" >&2 && exit 2; }
done
state=${NIF_NIGHTLY:-build/nightly}
for name in "${!seeds[@]}"; do mkdir -p "$state/corpus/$name" "$state/findings/$name"; done
state=$(realpath "$state")
# As it was while there was one fuzzer.
for folder in corpus findings; do find "$state/$folder" -maxdepth 1 -type f -exec mv -t "$state/$folder/asset" {} +; done
mkdir -p "$state/judged"
touch "$state/fuzz.tsv" "$state/meshes.tsv" "$state/judged.tsv" "$state/scenes.tsv" "$state/failed"
# What fuzzers write is read once: on a disk some of them would wait for it most of their time.
[[ ! -w /dev/shm ]] || export TMPDIR=/dev/shm
scratch=$(mktemp -d)
end=$((SECONDS + $(awk -v hours="$1" 'BEGIN { printf "%d", hours * 3600 }')))
trap 'kill $(jobs -p) 2>/dev/null || true; wait; rm -rf "$scratch"' EXIT
round=300

# run NAME [options of libFuzzer, files and folders]
run() {
  local name=$1 options
  read -ra options <<<"${limits[$name]}"
  "build/fuzz/bin/fuzz_$name" "${options[@]}" -verbosity=0 "${@:2}"
}

# spent: CPU seconds and name of each fuzzer, those of the least first. Lines without a name are of the first fuzzer.
spent() {
  {
    printf '\t0\t0\tfuzz_%s\n' "${!seeds[@]}"
    cat "$state/fuzz.tsv"
  } | awk -F '\t' '{ of[NF > 3 ? $4 : "fuzz_asset"] += $2 } END { for (f in of) print of[f], substr(f, 6) }' | sort -n
}

# fuzz WORKER: rounds of fuzzing till the end, with the corpora that all workers share.
fuzz() {
  local left name folders log=$scratch/fuzz.$1 TIMEFORMAT='%U %S' inputs
  while left=$((end - SECONDS)) && ((left > 0)); do
    ((left < round)) || left=$round
    # The worker's own place in the list, so that they do not all take the same one.
    name=$(spent | sed -n "$(($1 % ${#seeds[@]} + 1))p" | cut -d ' ' -f 2)
    read -ra folders <<<"${seeds[$name]}"
    { time run "$name" -max_total_time="$left" -seed="$((RANDOM * 32768 + RANDOM))" -print_final_stats=1 \
      -artifact_prefix="$state/findings/$name/" "$state/corpus/$name" "${folders[@]}" >"$log" 2>&1 || true; } 2>"$log.cpu"
    inputs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -n 1)
    if [[ -z $inputs ]] && awk '$1 + $2 > 1 { exit 1 }' "$log.cpu"; then
      echo "tests/nightly.sh: fuzz_$name does not start: $(tail -n 1 "$log")" >&2
      touch "$scratch/broken"
      return
    fi
    awk -v date="$(date +%F)" -v inputs="${inputs:-0}" -v name="fuzz_$name" \
      '{ printf "%s\t%.0f\t%s\t%s\n", date, $1 + $2, inputs, name }' "$log.cpu" >>"$state/fuzz.tsv"
  done
}

# try_mesh NUMBER: a random mesh, baked; the number decides about everything. Prints "rays certain", fails where one is wrong.
shapes=(statue tori torus tree terrain chain-mail) encodings=(segment bvh auto segment bvh auto segment spherical)
try_mesh() {
  local n=$1 mesh=$scratch/mesh.ply asset=$scratch/mesh.nif rays=200000
  RANDOM=$((n % 32768))
  local shape=${shapes[RANDOM % ${#shapes[@]}]} encoding=${encodings[RANDOM % ${#encodings[@]}]}
  local triangles=$((100 + (RANDOM * RANDOM) % 20000)) options=(--preset fast)
  case $encoding in
    spherical) options=(--encoding spherical --training-rays 200000) ;;
    bvh) options=(--encoding bvh) ;;
    *) options+=(--encoding "$encoding" --resolution $((8 + RANDOM % 89))) ;;
  esac
  "$nif" mesh generate "$shape" -o "$mesh" --triangles "$triangles" --seed "$n" -j 1 --quiet \
    && "$nif" bake "$mesh" -o "$asset" "${options[@]}" --seed "$n" --rays 0 -j 1 --quiet \
    && "$nif" eval "$asset" --mesh "$mesh" --rays $rays --seed "$n" -j 1 --json >"$scratch/eval.json" \
    && jq -e -r '[.sets[]] | if all(.certain_wrong == 0) then "\(map(.rays) | add)\t\(map(.rays * .certain) | add | round)"
                 else error("a certain answer is wrong") end' "$scratch/eval.json"
}
# judge_some: the next cases, and a line of judged.tsv. What it says is kept where answers are wrong, or where it fails.
judge_some() {
  local n
  n=$(cat "$state/next_case" 2>/dev/null || echo 0)
  "$judge" --threads 1 --seed 2 --cases "$n" 200 --seconds 600 --keep "$state/judged" --log "$state/judged.tsv" >"$scratch/judged" 2>&1 \
    || cp "$scratch/judged" "$state/judged/cases_$n.said"
  echo "$((n + 200))" >"$state/next_case.tmp" && mv "$state/next_case.tmp" "$state/next_case"
}
# compare_some: the next random scenes, and a line of scenes.tsv. What differs is kept.
compare_some() {
  local n
  n=$(cat "$state/next_scene" 2>/dev/null || echo 0)
  "$compare" --threads 1 --seed 2 --scenes "$n" 200 --log "$state/scenes.tsv" >"$scratch/compared" 2>&1 \
    || cp "$scratch/compared" "$state/judged/scenes_$n.said"
  echo "$((n + 200))" >"$state/next_scene.tmp" && mv "$state/next_scene.tmp" "$state/next_scene"
}
meshes() {
  local n counts
  while ((SECONDS < end)); do
    judge_some
    compare_some
    n=$(($(cat "$state/next" 2>/dev/null || echo 0) + 1))
    if counts=$(try_mesh "$n" 2>"$scratch/said"); then
      printf '%s\t%d\t%s\n' "$(date +%F)" "$n" "$counts" >>"$state/meshes.tsv"
    else
      echo "tests/nightly.sh: random mesh $n failed: $(tail -n 1 "$scratch/said")" >&2
      echo "$n" >>"$state/failed"
    fi
    echo "$n" >"$state/next.tmp" && mv "$state/next.tmp" "$state/next"
  done
}

# What failed before: mended or not.
for name in "${!seeds[@]}"; do
  for input in "$state/findings/$name"/*; do
    [[ -f $input ]] || continue
    if run "$name" "$input" >/dev/null 2>&1; then
      echo "mended: fuzz_$name, $(basename "$input")"
      mv "$input" "$state/corpus/$name/"
    fi
  done
done
if [[ -s $state/failed ]]; then
  sort -nu "$state/failed" >"$scratch/failed"
  : >"$scratch/still"
  while read -r n; do
    if try_mesh "$n" >/dev/null 2>&1; then echo "mended: random mesh $n"; else echo "$n" >>"$scratch/still"; fi
  done <"$scratch/failed"
  cp "$scratch/still" "$state/failed"
fi

workers=$(($(nproc) - 1))
for ((worker = 0; worker < (workers > 0 ? workers : 1); ++worker)); do fuzz "$worker" & done
meshes
wait

findings=$(find "$state/findings" "$state/judged" -type f | wc -l) failures=$(sort -u "$state/failed" | wc -l)
while read -r name; do
  awk -F '\t' -v name="fuzz_$name" -v findings="$(find "$state/findings/$name" -type f | wc -l)" \
    -v corpus="$(find "$state/corpus/$name" -type f | wc -l)" '(NF > 3 ? $4 : "fuzz_asset") == name { cpu += $2; inputs += $3 }
    END { printf "%-13s %6.1f CPU hours altogether, %d inputs, %d in the corpus, %d findings\n", name, cpu / 3600, inputs, corpus, findings }' \
    "$state/fuzz.tsv"
done < <(printf '%s\n' "${!seeds[@]}" | sort)
awk '{ cpu += $2 } END { printf "fuzzed for %.1f CPU hours altogether\n", cpu / 3600 }' "$state/fuzz.tsv"
awk -v failures="$failures" '{ rays += $3; certain += $4 }
  END { printf "%d random meshes altogether, %d rays, %d of them certain and none of these wrong; %d meshes failed\n", NR, rays, certain, failures }' \
  "$state/meshes.tsv"
awk -F '\t' '{ rays += $2; certain += $3; answers += $4; wrong += $5 }
  END { printf "%.0f hostile rays judged altogether, %.0f of them certain, %.0f answers, %.0f wrong\n", rays, certain, answers, wrong }' "$state/judged.tsv"
awk -F '\t' '{ scenes += $2; rays += $3; differ += $4 }
  END { printf "%.0f rays of %.0f random scenes compared altogether, %.0f differ\n", rays, scenes, differ }' "$state/scenes.tsv"
if ((findings + failures)); then
  find "$state/findings" "$state/judged" -type f | sed 's/^/finding: /' >&2
  sed 's/^/failed: random mesh /' "$state/failed" >&2
  exit 1
fi
[[ ! -e $scratch/broken ]]
