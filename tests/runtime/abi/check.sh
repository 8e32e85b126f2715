#!/usr/bin/env bash
# Does nif.h still describe the binary interface that is kept here? Any difference ends this with 1, and shows what it is:
# then either it was a mistake, or it is a growth that old programs survive (old_program.c), and --renew keeps the new one.
#
#   tests/runtime/abi/check.sh [--renew]
#
# The description is of the header alone: it is compiled with empty functions. That the shared library exports these
# functions and no others is tested elsewhere (tests/package). Needs abidw and abidiff (Debian: abigail-tools) and gcc.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
header=$here/../../../runtime/include/nif/nif.h
kept=$here/libnif.abi
case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
  '' | --renew) ;;
  *) echo "tests/runtime/abi/check.sh: there is no option '$1'; see --help" >&2 && exit 2 ;;
esac

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Each declaration becomes a function that does nothing. Experimental ones may change.
{
  echo '#include "nif.h"'
  sed '/^#ifdef NIF_EXPERIMENTAL/,/^#endif/d' "$header" | tr '\n' ' ' | grep -oE 'NIF_API [^;{}]*\);' \
    | sed -E 's/^NIF_API void ([^;]*);/void \1 {}/; s/^NIF_API ([^;]*);/\1 { return 0; }/'
} >"$work/nif.c"
gcc -std=c99 -g -O0 -fPIC -shared -w -I"$(dirname "$header")" "$work/nif.c" -o "$work/libnif.so"
abidw --no-corpus-path --no-comp-dir-path --no-show-locs --no-architecture "$work/libnif.so" \
  | sed -E '/<elf-needed>/,/<\/elf-needed>/d; s/ path=.[^ >]*//; s/ comp-dir-path=.[^ >]*//' >"$work/libnif.abi"
if [[ ${1-} = --renew ]]; then
  cp "$work/libnif.abi" "$kept"
  echo "tests/runtime/abi/check.sh: kept $(grep -c '<function-decl' "$kept") functions in $kept"
elif ! abidiff --no-show-locs "$kept" "$work/libnif.abi"; then
  echo "tests/runtime/abi/check.sh: the binary interface is no longer that of $kept, as shown above" >&2
  exit 1
fi
