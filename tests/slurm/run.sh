#!/usr/bin/env bash
# Bakes a manifest on a real Slurm cluster of one node, which it starts and ends: tasks that are killed and requeued, one
# whose mesh is bad, a summary at the end, and a second submission that has nothing left to do. Ends with 77, a skipped
# test, where Slurm is not installed or this is not root.
#
#   tests/slurm/run.sh NIF
set -euo pipefail
(($# == 1)) || { echo 'tests/slurm/run.sh: name the program nif' >&2 && exit 2; }
nif=$(realpath "$1")
for program in munged slurmctld slurmd sbatch scontrol setpriv; do
  command -v "$program" >/dev/null || { echo "Skipped: $program is not installed" && exit 77; }
done
((EUID == 0)) || { echo 'Skipped: the daemons need root' && exit 77; }
source "$(dirname "${BASH_SOURCE[0]}")/cluster.sh"
start_cluster

fail() {
  echo "tests/slurm/run.sh: $*" >&2
  tail -n 20 "$library"/.nif-batch/farm/*/*.log "$cluster/slurmctld.log" >&2 || true
  exit 1
}
# wait_for SECONDS COMMAND...: until it succeeds.
wait_for() {
  local end=$((SECONDS + $1))
  shift
  until "$@"; do
    ((SECONDS < end)) || fail "waited in vain for: $*"
    sleep 0.1
  done
}

library="$cluster/a library" # with a space, as people have them
mkdir -p "$library/props"
cd "$library"
for i in 1 2 3; do "$nif" mesh generate torus -o "props/ring $i.ply" --triangles 2000 --seed "$i" --quiet; done
"$nif" mesh generate tori -o props/slow.ply --triangles 20000 --quiet
echo 'not a mesh' >props/bad.ply
cat >library.toml <<'EOF'
output = "out/{stem}.nif"
[defaults]
preset = "fast"
encoding = "segment"
rays = 1000
[[asset]]
mesh = "props/*.ply"
EOF

submitted=$("$nif" farm library.toml --slurm --cores 1 --json --report report.html)
array=$(jq -r '.arrays[0]' <<<"$submitted") summary=$(jq -r .summary <<<"$submitted")
[[ $(jq '.arrays | length' <<<"$submitted") == 1 ]] || fail "small meshes are of one class: $submitted"

# The slow one is the fifth of the names: requeued in the midst of its bake, as after the loss of its node.
slow_runs() { [[ $(squeue -h -j "${array}_4" -o %t 2>/dev/null) == R ]]; }
wait_for 120 slow_runs
sleep 0.5
scontrol requeue "${array}_4"
[[ ! -e out/slow.nif ]] || fail 'the task was over before it was killed'
# Slurm lets two minutes go by first, which teach nothing here.
waits() { [[ $(squeue -h -j "${array}_4" -o %t 2>/dev/null) == PD ]]; }
wait_for 60 waits
scontrol update "JobId=${array}_4" StartTime=now
wait_for 240 test -e "$summary"

counts=$(jq -c '[.baked, .current, .failed, .left]' "$summary")
[[ $counts == '[4,0,1,0]' ]] || fail "the summary says $counts"
jq -e '.assets[] | select(.outcome == "failed") | .code == 14 and (.error | contains("bad.ply"))' "$summary" >/dev/null ||
  fail 'the summary does not say what is wrong with bad.ply'
restarts=$(scontrol show job "${array}_4" 2>/dev/null | grep -o 'Restarts=[0-9]*' || echo 'Restarts=?')
[[ $restarts == Restarts=1 ]] || fail "the killed task: $restarts"
grep -q 'data:image/png' report.html || fail 'the report has no pictures'
"$nif" bake 'props/ring 2.ply' -o own.nif --preset fast --encoding segment --rays 1000 --quiet
cmp 'out/ring 2.nif' own.nif || fail 'the cluster bakes other bytes'

# Again: only what failed is left, and once that is mended, nothing.
"$nif" farm library.toml --slurm --dry-run | grep -q '^1 asset, 1 task,' || fail 'a second submission would bake more than the failed one'
cp 'props/ring 1.ply' props/bad.ply
"$nif" bake --manifest library.toml --quiet
"$nif" farm library.toml --slurm | grep -q 'all of 5 assets up to date' || fail 'there is something left to do'

# What Slurm refuses leaves no jobs behind.
printf ' ' >>props/bad.ply
code=0
said=$("$nif" farm library.toml --slurm --sbatch=--partition=none 2>&1) || code=$?
[[ $code == 53 && $said == 'nif: sbatch failed: '* ]] || fail "a partition that is not there: $code, $said"
[[ -z $(squeue -h) ]] || fail 'jobs are left'
echo "baked on Slurm $(sbatch --version | cut -d' ' -f2): 4 of 5, the bad one named; one task requeued"
