#!/usr/bin/env bash
# Measures the Stanford dragon and writes docs/results/dragon.md: what `samples/run.sh` prints, ten million certain
# answers, and two bakes with one and two threads compared. Takes some ten minutes on two cores.
#
#   docs/results/dragon.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

samples/run.sh >build/dragon_table.txt
nif=build/release/bin/nif mesh=build/sample/stanford_dragon.ply.gz asset=build/sample/stanford_dragon.nif
[[ -f $mesh ]] || { echo 'docs/results/dragon.sh: the dragon is not to be had' >&2 && exit 1; }

"$nif" eval "$asset" --mesh "$mesh" --rays 10000000 --seed 3 >build/dragon_ten_million.txt
for threads in 1 2; do "$nif" bake "$mesh" -o "build/dragon_j$threads.nif" -j "$threads" --rays 0 --quiet; done
if cmp build/dragon_j1.nif build/dragon_j2.nif; then same='The two files are identical.'; else same='THE TWO FILES DIFFER.'; fi

indent() { sed 's/^/    /; s/ *$//'; }
{
  printf '# The Stanford dragon, preset `balanced`\n\n'
  printf 'Written by `docs/results/dragon.sh`: change nothing here by hand. Machine: %s, %s cores.\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(nproc)"
  printf 'Times are those of one run on a machine that others use, too.\n\n## `samples/run.sh`\n\n'
  indent <build/dragon_table.txt
  printf '\n## Ten million rays of each set\n\n`nif eval dragon.nif --mesh dragon.ply.gz --rays 10000000 --seed 3`\n\n'
  indent <build/dragon_ten_million.txt
  printf '\n## Threads\n\n`nif bake dragon.ply.gz -o one.nif -j 1 --rays 0`, and again with `-j 2`: %s\n' "$same"
} >docs/results/dragon.md.new
mv docs/results/dragon.md.new docs/results/dragon.md
