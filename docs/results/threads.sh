#!/usr/bin/env bash
# Measures what two threads of one device bring beside what the machine gives two processes of one thread each, and writes
# docs/results/threads.md. Takes some five minutes on two cores, and is worth nothing on a machine that does other things
# meanwhile.
#
#   docs/results/threads.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

mesh=build/sample/stanford_dragon.ply.gz asset=build/sample/stanford_dragon.nif
[[ -f $asset ]] || samples/run.sh >/dev/null
[[ -f $mesh ]] || { echo 'docs/results/threads.sh: the dragon is not to be had' >&2 && exit 1; }
cmake --build build/release --target two_threads >&2
out=build/speed
mkdir -p "$out"
launches=8 rounds=12 rays=1000000

for ((launch = 1; launch <= launches; ++launch)); do
  echo "docs/results/threads.sh: launch $launch of $launches" >&2
  build/release/bin/two_threads "$asset" "$mesh" "$rounds" "$rays" | sed "s/^/$launch /"
done >"$out/threads.txt"

# Median, and the tenth and ninetieth hundredth, of a column of numbers.
spread() { sort -g | awk '{ v[NR] = $1 } END { printf "%.2f (%.2f .. %.2f)", v[int((NR + 1) / 2)], v[int(NR / 10) + 1], v[NR - int(NR / 10)] }'; }
column() { awk -v set="$1" "\$2 == set { print $2 }" "$out/threads.txt" | spread; }
{
  printf '# Two threads\n\n'
  printf 'Written by `docs/results/threads.sh`: change nothing here by hand. Machine: %s, %s cores.\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(nproc)"
  printf 'Other programs may have run beside it; [cpu-kernels.md](cpu-kernels.md) says what follows from it.\n\n'
  printf 'Model: the Stanford dragon, Stanford University Computer Graphics Laboratory, preset `balanced`. %s launches of\n' "$launches"
  printf '`two_threads dragon.nif dragon.ply.gz %s %s` (tools/measure/two_threads.cpp), in each %s rounds, in each round every way once in\n' \
    "$rounds" "$rays" "$rounds"
  printf 'random order. Each figure: the median of the ratios within a round, and in brackets what a tenth of the rounds is below\n'
  printf 'and a tenth above.\n\n'
  printf '| ray set | one thread, Mray/s | two processes of one thread each : one | one device of two threads : one | the device : the processes |\n'
  printf '| --- | ---: | ---: | ---: | ---: |\n'
  for set in outer-lines inner-surface sun; do
    printf '| `%s` | %s | %s | %s | %s |\n' "$set" "$(column "$set" '$3')" "$(column "$set" '$4 / $3')" \
      "$(column "$set" '$5 / $3')" "$(column "$set" '$5 / $4')"
  done
} >"$out/threads.md"
mv "$out/threads.md" docs/results/threads.md
cat docs/results/threads.md
