#!/usr/bin/env bash
# Where the paper's fields spend their time, on nine meshes, beside Embree and this project's own encoding; time against
# triangles and against rays. Writes docs/results/paper/time.md; takes some twenty minutes on two cores, and is worth
# nothing on a machine that does other things meanwhile.
#
#   docs/results/paper/time.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
source docs/results/paper/common.sh
dragon=$mesh

# Speed does not depend on what a field has learned, so these learn for moments only; errors stand beside.
# measure NAME MESH [options of nif bench]: leaves NAME.time.json; delete it to measure again.
measure() {
  local name=$1 mesh=$2
  shift 2
  [[ -f $out/$name.time.json ]] && return
  [[ -f $out/$name.spherical.nif ]] || "$nif" bake "$mesh" -o "$out/$name.spherical.nif" --preset paper \
    --training-rays 4000000 --training-passes 1 --rays 0 --quiet
  [[ -f $out/$name.segment.nif ]] || "$nif" bake "$mesh" -o "$out/$name.segment.nif" --encoding segment --preset fast \
    --rays 0 --quiet
  "$nif" bench "$out/$name.spherical.nif" --mesh "$mesh" --against "$out/$name.segment.nif" --stages -j 1 \
    --set outer-lines --set inner-surface --quiet --json "$@" >"$out/$name.time.json"
}

generated statue_1 statue 500000 1
generated statue_2m statue 2000000 2
generated statue_8m statue 8000000 3
generated tree_1 tree 300000 1
generated tree_2m tree 2000000 2
generated mail_1m chain-mail 1000000 1
generated terrain_1m terrain 1000000 1
generated tori_1 tori 200000 1
scenes='dragon statue_1 statue_2m statue_8m tree_1 tree_2m mail_1m terrain_1m tori_1'
for name in $scenes; do
  if [[ $name == dragon ]]; then measure dragon "$dragon" --rays 200000; else measure "$name" "$out/$name.ply" --rays 200000; fi
done
for rays in 10000 100000 1000000; do
  [[ -f $out/dragon_$rays.time.json ]] || {
    cp "$out/dragon.spherical.nif" "$out/dragon_$rays.spherical.nif"
    cp "$out/dragon.segment.nif" "$out/dragon_$rays.segment.nif"
  }
  measure "dragon_$rays" "$dragon" --rays "$rays"
done

# rows NAME LABEL: one for each ray set.
rows() {
  jq -r --arg what "$2" 'def ns: 1000 / . | round;
    .triangles as $triangles | .sets | to_entries[] | .key as $set | .value |
    "| \($what) | \($triangles) | \($set) | \([.stages[] | "\(.ns * 10 | round / 10)"] | join(" | ")) | " +
    "\(.nif.mrays_per_s | ns) | \(.against.mrays_per_s | ns) | \(.embree.mrays_per_s | ns) | " +
    "\(.ratio * 100 | round / 100) | \(.ratio / .against.ratio * 100 | round / 100) | " +
    "\(.error * 1000 | round / 10) % | \(.against.error * 1000 | round / 10) % |"' "$out/$1.time.json"
}
head='| mesh | triangles | rays | ray cast | outer grids | outer network | inner grids | inner network | `spherical`, all | `segment` | Embree | Embree / `spherical` | Embree / `segment` | wrong, `spherical` | wrong, `segment` |
| --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |'
{
  printf '# Time\n\nWritten by `docs/results/paper/time.sh`: change nothing here by hand. Machine: %s, one thread.\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)"
  printf 'Nanoseconds a ray, medians of seven rounds of `nif bench --stages` ([benchmark.md](../../benchmark.md)); Embree is the\n'
  printf 'fastest of its calls and builds in the same rounds. "Embree / x" is its time as a multiple of x'"'"'s. Stages are timed by\n'
  printf 'themselves; "all" is a whole query, in the race. `spherical` has the grids and networks of `--preset paper`, `segment` those\n'
  printf 'of `--preset fast`. A ray costs a `spherical` field the same whatever that has learned, so these learned for moments only: their\n'
  printf 'errors here are not what they reach. The dragon is of the Stanford University Computer Graphics Laboratory, the other models\n'
  printf 'are made by `nif mesh generate`.\n\n## Where it goes\n\n%s\n' "$head"
  for name in $scenes; do rows "$name" "${name%%_*}"; done
  printf '\n## Against the number of triangles\n\n'
  printf 'Busts of three sizes (rows above, in order): a field'"'"'s time is that of its networks, and a BVH'"'"'s grows with the mesh.\n\n'
  printf '| triangles | rays | `spherical` | `segment` | Embree |\n| ---: | --- | ---: | ---: | ---: |\n'
  for name in statue_1 statue_2m statue_8m; do
    jq -r 'def ns: 1000 / . | round; .triangles as $t | .sets | to_entries[] |
      "| \($t) | \(.key) | \(.value.nif.mrays_per_s | ns) | \(.value.against.mrays_per_s | ns) | \(.value.embree.mrays_per_s | ns) |"' \
      "$out/$name.time.json"
  done
  printf '\n## Against the number of rays\n\nThe dragon. Milliseconds for all rays of a call.\n\n'
  printf '| rays of a call | set | `spherical` | `segment` | Embree |\n| ---: | --- | ---: | ---: | ---: |\n'
  for rays in 10000 100000 1000000; do
    jq -r 'def ms($n): $n / . / 10 | round / 100; .sets | to_entries[] | .value.rays as $n |
      "| \($n) | \(.key) | \(.value.nif.mrays_per_s | ms($n)) | \(.value.against.mrays_per_s | ms($n)) | \(.value.embree.mrays_per_s | ms($n)) |"' \
      "$out/dragon_$rays.time.json"
  done
} >"$pages/time.md.new"
mv "$pages/time.md.new" "$pages/time.md"
