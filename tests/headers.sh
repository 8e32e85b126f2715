#!/usr/bin/env bash
# Compiles headers by themselves, so that none leans on what its users include before it: all those that no source includes
# before anything else. (Of the others, compiling that source shows it, where NIF_UNITY is off: tests/run.sh --nightly.)
#
#   tests/headers.sh [HEADER]...     only these
#   tests/headers.sh --public        only those that are installed
set -euo pipefail
case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
cd "$(dirname "${BASH_SOURCE[0]}")/.."

first_includes() {
  git ls-files -z '*.cpp' ':!samples/' | xargs -0 awk '
    FNR == 1 { done = 0 }
    /^#include/ && !done { done = 1; if (gsub(/"/, "", $2)) print $2 }'
}
headers=("$@")
if [[ ${1-} == --public ]]; then
  headers=(runtime/include/nif/*.h runtime/include/nif/*.hpp)
elif ((!$#)); then
  # Those called -inl are included many times over, by a source that has prepared for it.
  mapfile -t headers < <(comm -23 <(git ls-files '*.h' '*.hpp' ':!*-inl.hpp' ':!samples/' | sort) <(first_includes | sort -u))
fi
# As the targets have them; other libraries' headers are where the compiler looks.
flags=(-std=c++20 -fsyntax-only -Wall -Wextra -Werror -I. -Iruntime/include -Iruntime/src -Iruntime/gpu
  -isystem /usr/include/OpenEXR -isystem /usr/include/Imath
  '-DNIF_EMULATED_MODULE=""' '-DNIF_SHADER_FOLDER=""' '-DNIF_VERSION_STRING=""')
check() {
  "${CXX:-c++}" "${@:2}" -include "$1" -x c++ /dev/null && return
  echo "tests/headers.sh: $1 does not compile by itself" >&2
  return 1
}
export -f check
printf '%s\0' "${headers[@]}" | xargs -0 -P "$(nproc)" -I{} bash -c 'check "$@"' _ {} "${flags[@]}"
echo "${#headers[@]} headers compile by themselves"
