#!/usr/bin/env bash
# Checks that files and folders named in comments and docs exist. Prints those that do not, and ends with 1.
#
# Looked at are words that start with one of the top folders ("bake/ground_truth/closure", with or without the ending) and words
# that end as our own sources do ("grid_traversal-inl.hpp"); the end of a path is enough. Headers in .h are mostly others',
# and not looked at, and NAME is what the reader puts there. Ends with 77 outside a git work tree, where nothing tells our files
# from others.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
git rev-parse --is-inside-work-tree >/dev/null 2>&1 || exit 77

list=$(mktemp)
trap 'rm -f "$list"' EXIT
git ls-files -co --exclude-standard | while read -r file; do [[ ! -f $file ]] || echo "$file"; done >"$list"

# The changelog uses old names, and corpus.md is about third-party files.
mapfile -t texts < <(grep -E '\.(cpp|hpp|h|c|hip|md|sh|cmake|txt)$|^\.ci/' "$list" | grep -vxE 'CHANGELOG\.md|docs/results/corpus\.md')

awk '
  function know(path,   parts, count, i, end) {
    count = split(path, parts, "/")
    end = ""
    for (i = count; i > 0; --i) {
      end = parts[i] (end == "" ? "" : "/" end)
      known[end] = 1
    }
  }
  function resolved(folder, word,   parts, count, i, kept, path) {
    count = split(folder word, parts, "/")
    kept = 0
    for (i = 1; i <= count; ++i) {
      if (parts[i] == "." || parts[i] == "") continue
      if (parts[i] == ".." && kept > 0) { --kept; continue }
      parts[++kept] = parts[i]
    }
    path = ""
    for (i = 1; i <= kept; ++i) path = path (i > 1 ? "/" : "") parts[i]
    return path
  }
  FILENAME == ARGV[1] {
    path = $0
    know(path)
    sub(/\.[a-z]+$/, "", path)
    know(path)
    while (sub(/\/[^\/]*$/, "", path)) know(path)
    if ($0 ~ /\//) top[substr($0, 1, index($0, "/") - 1)] = 1
    next
  }
  FNR == 1 {
    folder = FILENAME
    if (!sub(/[^\/]*$/, "", folder)) folder = ""
    marked = FILENAME ~ /\.md$/ ? "" : FILENAME ~ /\.(cpp|hpp|h|c|hip)$/ ? "//|/\\*|^ \\*" : "(^|[ \t])#"
  }
  {
    text = $0
    if (marked != "") {
      if (!match(text, marked)) next
      text = substr(text, RSTART)
    }
    gsub(/https?:[^ )]*/, "", text)
    before = ""
    while (match(text, /[A-Za-z0-9_.\/-]+/)) {
      word = substr(text, RSTART, RLENGTH)
      if (RSTART > 1) before = substr(text, RSTART - 1, 1)
      after = substr(text, RSTART + RLENGTH, 1)
      text = substr(text, RSTART + RLENGTH)
      ours = before !~ /[$@{}<>*~%:]/ && after !~ /[*<{(]/
      before = ""
      sub(/[.\/-]+$/, "", word)
      first = substr(word, 1, index(word, "/") - 1)
      if (word !~ /^[A-Za-z_.]/ || first == "build" || !ours) continue
      if (word ~ /(^|[\/_])NAME(\/|\.|$)/) continue
      if (word !~ /[A-Za-z0-9_]\.(cpp|hpp|hip|md|sh|cmake)$/ && !(first in top)) continue
      if (word in known || resolved(folder, word) in known) continue
      printf "%s:%d: there is no %s\n", FILENAME, FNR, word
      missing = 1
    }
  }
  END { exit missing }
' "$list" "${texts[@]}"
