#!/usr/bin/env bash
# Races exact objects (`bvh` and `exact`) against Embree, and against other programs if there are any, on meshes of all kinds and
# on scenes of games: visibility and first hits, coherent and incoherent rays, one thread and two. Writes a page beside this script,
# in which the races that we lose come first. Takes some twenty minutes on two cores. Run it on an idle machine.
#
#   NIF_TEST_MESHES=FOLDER NIF_TEST_GAMES=FOLDER docs/results/race.sh [NAME...]    names as in the page; by default all
#   docs/results/race.sh --page                                                    only writes the page
#
# What is in build/race is not measured again; remove it to measure anew. From the environment:
#   NIF              a `nif` that is built already
#   RAYS, ROUNDS     to make it shorter, to try it (100000, 5)
#   NIF_RACERS       other programs that take part (docs/benchmark.md#other-programs), separated by spaces. Each is called as
#                    PROGRAM EXPORT RESULTS.json, with the folder of an export and the file that it writes.
#   NIF_RESULTS      a folder of results that are there already: NIF_RESULTS/NAME/*.json for the mesh or scene NAME. They must be
#                    of the same RAYS.
# A folder of games has knight/knight.glb, town/town_model.gltf, pine/scene.gltf and ship/dutch_ship_medium_1k.gltf.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
nif=${NIF:-build/release/bin/nif} out=build/race rays=${RAYS:-100000} rounds=${ROUNDS:-5}
sets=(--set outer-lines --set inner-surface --set sun --set camera)
measured=$out/$rays-$rounds
mkdir -p "$measured/raced"
# shellcheck source=docs/results/once.sh
source docs/results/once.sh

# others NAME QUERY: --compare for the results of other programs that have such a query.
others() {
  local file
  for file in "$measured/others/$1"/*.json "${NIF_RESULTS:-$out/none}/$1"/*.json; do
    [[ -f $file ]] || continue
    if jq -e --arg query "$2" 'any(.results[]; .query == $query)' "$file" >/dev/null; then printf '%s\n' --compare "$file"; fi
  done
}

# race NAME KIND AUTHOR FILE (KIND: mesh or scene): bakes it, lets other programs take part, and measures.
race() {
  local name=$1 kind=$2 author=$3 file=$4 encoding query racer asked compare
  local at=$out/$name to=$measured/$name
  echo "docs/results/race.sh: $name" >&2
  for encoding in bvh exact; do
    [[ -f $at.$encoding.nif ]] \
      || "$nif" bake "$file" -o "$at.$encoding.nif" --ignore-alpha --encoding "$encoding" --rays 0 --quiet 2>/dev/null
  done
  asked=("$at.bvh.nif" --mesh "$file")
  [[ $kind == scene ]] && asked=("$file" --asset "$at.bvh.nif")
  for racer in ${NIF_RACERS-}; do
    [[ -f $to.export/race.json ]] \
      || "$nif" bench "${asked[@]}" --rays "$rays" "${sets[@]}" --export "$to.export" --quiet
    mkdir -p "$measured/others/$name"
    [[ -f $measured/others/$name/$(basename "$racer").json ]] \
      || "$racer" "$to.export" "$measured/others/$name/$(basename "$racer").json"
  done
  rm -rf "$to.export"
  for query in visibility hits; do
    mapfile -t compare < <(others "$name" "$query")
    local options=(-j 1 -j 2 --rays "$rays" --rounds "$rounds" "${sets[@]}" "${compare[@]}" --quiet --json)
    [[ $query == hits ]] && options+=(--hits)
    [[ $kind == scene ]] && options+=(--moved 0)
    once "$to.$query.json" "$nif" bench "${asked[@]}" --against "$at.exact.nif" "${options[@]}"
  done
  # A line for each encoding, query, set and number of threads.
  for query in visibility hits; do
    jq -c --arg name "$name" --arg author "$author" --arg rays "$rays" '
      . as $report | .scaling[] | .threads as $threads | .sets | to_entries[] | .key as $set | .value
      | ([{name: "Embree, \(.embree.variant)", rate: .embree.mrays_per_s}]
         + [.entrants[]? | {name: ([.program, .variant] | map(values) | join(", ") | gsub("[|<>]"; " ")), rate: .mrays_per_s}] | max_by(.rate)) as $best
      | {name: $name, author: $author, rays: $rays, rounds: $report.rounds, triangles: ($report.placed_triangles // $report.triangles),
         instances: ($report.instances // null), query: (if $report.hits then "first hits" else "visibility" end), set: $set,
         threads: $threads, cores, best: $best, entrants: [.entrants[]? | del(.file)]} as $row
      | ({encoding: "bvh", rate: .nif.mrays_per_s, error}, (.against | {encoding: "exact", rate: .mrays_per_s, error}))
      | $row + . + {ratio: (.rate / $best.rate)}' "$to.$query.json"
  done >"$measured/raced/$name.jsonl.new"
  mv "$measured/raced/$name.jsonl.new" "$measured/raced/$name.jsonl"
}

wanted() { ((${#names[@]} == 0)) || [[ " ${names[*]} " == *" $1 "* ]]; }

names=("$@")
if [[ ${1-} != --page ]]; then
  : "${NIF_TEST_GAMES:?names the folder that holds the scenes}"
  [[ -n ${NIF-} ]] || cmake --build build/release --target nif >&2
  # shellcheck source=docs/results/meshes.sh
  source docs/results/meshes.sh
  find_meshes "$nif"
  for path in "${paths[@]}"; do
    name=$(basename "$path" | sed -E 's/\.(obj|ply|stl|glb)(\.gz|\.zst)?$//')
    case $name in
      cycloidal_* | openfoam_DTC_* | kicad_acepack_* | kicad_board_6.94m) continue ;; # like others here, or take long
    esac
    case $name in
      bunny_* | stanford_*) author='Stanford University Computer Graphics Laboratory' ;;
      kicad_*) author='parts of the KiCad libraries, CC-BY-SA 4.0 with exception' ;;
      generated_*) author='`nif mesh generate`' ;;
      *) author='' ;;
    esac
    if wanted "$name"; then race "$name" mesh "$author" "$path"; fi
  done
  # What a scene is called here, its file, and who made it.
  for scene in 'town|town/town_model.gltf|Godot truck town demo, MIT' \
    'knight|knight/knight.glb|Kay Lousberg (KayKit), CC0 1.0' \
    'pine|pine/scene.gltf|Oskar "K1TT3N" Adamczyk, CC BY 4.0' \
    'ship|ship/dutch_ship_medium_1k.gltf|Poly Haven, CC0 1.0'; do
    IFS='|' read -r name file author <<<"$scene"
    if wanted "$name"; then race "$name" scene "$author" "$NIF_TEST_GAMES/$file"; fi
  done
fi

{
  printf '# The race\n\nGenerated by `docs/results/race.sh`; do not edit by hand. Machine: %s, %s cores.\n\n' \
    "$(docs/results/machine.sh)" "$(nproc)"
  jq -r -s '
    def short: if . >= 100 then round else . * 100 | round / 100 end | tostring;
    def mean: if length == 0 then "-" else map(log) | add / length | exp | short end;
    def means: "\(length) | \(map(select(.ratio < 1)) | length) | \(map(.ratio) | mean) | \(map(.ratio) | min | short) | \(map(.ratio) | max | short)";
    def row: "| \(.ratio | short) | \(.name) | \(.query) | `\(.set)` | \(.threads) | \(.of.bvh | short) | \(.of.exact | short) | \(.rate | short) | \(.best.rate | short) | \(.best.name) |";
    def table: "| ratio | mesh or scene | query | rays | threads | `bvh` | `exact` | ours, Mrays/s | theirs, Mrays/s | the fastest rival |",
      "| ---: | --- | --- | --- | ---: | ---: | ---: | ---: | ---: | --- |", (.[] | row);
    . as $all
    | [group_by([.name, .query, .set, .threads])[]
       | (map({(.encoding): .ratio}) | add) as $of | max_by(.ratio) + {of: $of}] | sort_by(.ratio) as $races
    | ($races | map(select(.ratio < 1))) as $lost
    | ($races | map(.threads) | unique) as $threads
    | "Our exact objects against the fastest rival, in the same run. Ours is the better of `bvh` and `exact`, whose ratios stand in",
      "columns of their own; the rival is the fastest of all builds and calls of Embree" + (if any($all[]; .entrants != []) then ", and of the other programs below" else "" end) + ". `outer-lines` and",
      "`inner-surface` are incoherent, `sun` and `camera` coherent ([ray-sets.md](../ray-sets.md)). `nif bench` measured with \($all[0].rays) rays",
      "of each set and \($all[0].rounds) rounds ([benchmark.md](../benchmark.md)). A ratio below 1 is a race that we lose.", "",
      "| races | how many | lost | mean ratio | lowest | highest |", "| --- | ---: | ---: | ---: | ---: | ---: |",
      "| all | \($races | means) |",
      (["visibility", "first hits"][] as $query | [["incoherent", ["outer-lines", "inner-surface"]], ["coherent", ["sun", "camera"]]][] as $kind | $threads[] as $t
       | ($races | map(select(.query == $query and .threads == $t and (.set | IN($kind[1][])))))
       | select(length > 0) | "| \($query), \($kind[0]), \($t) \(if $t == 1 then "thread" else "threads" end) | \(means) |"),
      "", "Means are geometric. The rays whose visibility, or hit or miss, differs from that of the ground truth are at most \($all | map(.error) | max * 1e6 | round) in a million.",
      "Threads got at least \($all | map(.cores / .threads) | min * 100 | round) % of a core each; less than 85 % tells of other programs.",
      "", "## Lost: \($lost | length) of \($races | length)", "", ($lost | table),
      "", "## Won", "", ($races | map(select(.ratio >= 1)) | table),
      (if any($all[]; .entrants != []) then
         "", "## Other programs", "", "Their answers, over all races ([what the columns mean](../benchmark.md#what---compare-reads)).", "",
         "| program | races | differing | wrong | displaced | misplaced |", "| --- | ---: | ---: | ---: | ---: | ---: |",
         ([$all | unique_by([.name, .query, .set, .threads])[] | .entrants[]] | group_by([.program, .variant])[]
          | "| \([.[0].program, .[0].variant] | map(values) | join(", ") | gsub("[|<>]"; " ")) | \(length) | \(map(.differing) | add) | \(map(.wrong) | add) | \(map(.hits.displaced // 0) | add) | \(map(.hits.misplaced // 0) | add) |")
       else empty end),
      "", "## Meshes and scenes", "", "| name | triangles | instances | made by |", "| --- | ---: | ---: | --- |",
      ($all | unique_by(.name)[] | "| \(.name) | \(.triangles) | \(.instances // "") | \(.author) |")' "$measured"/raced/*.jsonl
} >"$out/race.md.new"
mv "$out/race.md.new" "${PAGE:-docs/results/race.md}"
