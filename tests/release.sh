#!/usr/bin/env bash
# Makes the release candidate of the commit that is checked out twice, each time from nothing and in another folder: the files
# must be the same bytes. Takes twice as long as tools/release.sh, a quarter of an hour on two cores.
#
#   tests/release.sh [CMAKE OPTIONS]
#
# Examples:
#   tests/release.sh
#   tests/release.sh -DNIF_BUILD_TOOLS=OFF      the runtime and its GPU module alone
#
# Ends with "Skipped: " and a reason where there are changes that are not committed, of which no candidate can be made.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
  '' | -D*) ;;
  *) echo "tests/release.sh: '$1' is no option of CMake; see --help" >&2 && exit 2 ;;
esac
if [[ -n $(git status --porcelain) ]]; then
  echo 'Skipped: a release candidate needs a tree without changes'
  exit 0
fi
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
for run in first second; do
  tools/release.sh --output "$out/$run" -- "$@" >"$out/$run.log" 2>&1 \
    || { tail -n 20 "$out/$run.log" >&2 && echo "tests/release.sh: the $run run failed" >&2 && exit 1; }
done
if differing=$(diff -rq "$out/first" "$out/second"); then
  cat "$out/second/SHA256SUMS"
  echo "$(wc -l <"$out/second/SHA256SUMS") files, made twice: the same bytes"
else
  printf '%s\n' "$differing" "tests/release.sh: two runs made different bytes" >&2
  exit 1
fi
