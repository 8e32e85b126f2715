#!/usr/bin/env bash
# docs/command-line.md lists the exit codes of formats/base/status.hpp, with their numbers and names. Prints what differs
# ("<": the header, ">": the page), and ends with 1.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
in_header() { sed -nE '/^enum class Status/,/^};/s/^ *([a-z_]+) = ([0-9]+),.*/\2 \1/p' formats/base/status.hpp; }
in_page() { sed -nE 's/^\| ([0-9]+) \| `([a-z_]+)` \|.*/\1 \2/p' docs/command-line.md; }
codes=$(in_header | wc -l)
((codes > 0)) || { echo 'there are no exit codes in formats/base/status.hpp' >&2 && exit 1; }
diff <(in_header) <(in_page)
