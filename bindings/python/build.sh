#!/usr/bin/env bash
# Builds the wheel of nifkit for Python, without the network, and prints its path.
#
#   bindings/python/build.sh [FOLDER]    writes it there (build/python)
#
# Needs a Python 3 with pip, setuptools and wheel (tools/setup.sh python); NIF_PYTHON names one. NIFKIT names a folder that
# nifkit is installed in; then its libnif.so is taken, and nothing is compiled.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=bindings/python/python.sh
source "$root/bindings/python/python.sh"

fail() { echo "bindings/python/build.sh: $*" >&2 && exit 1; }
if [[ ${1-} == -h || ${1-} == --help ]]; then
  sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "$0"
  exit 0
fi
folder=${1-$root/build/python}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
python=$(find_python pip setuptools wheel) || fail 'no Python 3 with pip, setuptools and wheel (tools/setup.sh python)'

cd "$root"
if [[ -n ${NIFKIT-} ]]; then
  library=$(find "$NIFKIT"/lib*/ -name libnif.so -print -quit 2>/dev/null) || true
  [[ -n $library ]] || fail "NIFKIT is $NIFKIT, but there is no libnif.so in its lib"
else
  if [[ ! -f build/release/build.ninja ]]; then
    tools/setup.sh build
    cmake --preset release -DNIF_BUILD_TESTS=OFF -DNIF_UNITY=ON >/dev/null
  fi
  cmake --build build/release --target nif_shared >&2
  library=build/release/runtime/libnif.so
fi

stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
cp -r bindings/python/{nifkit,pyproject.toml,setup.py,README.md} LICENSE NOTICE "$stage"
rm -rf "$stage/nifkit/__pycache__" "$stage/nifkit/libnif.so"
strip --strip-unneeded -o "$stage/nifkit/libnif.so" "$library"
sed -n 's/^#define NIF_VERSION_\(MAJOR\|MINOR\|PATCH\) //p' runtime/include/nif/nif.h | paste -sd. >"$stage/VERSION"

# The same bytes every time: files are as old as the format of archives allows.
find "$stage" -exec touch -d 1980-01-01 {} +
log=$stage/log
SOURCE_DATE_EPOCH=$(date -d '1980-01-01 UTC' +%s) "$python" -m pip wheel --no-deps --no-index --no-build-isolation \
  --disable-pip-version-check --wheel-dir "$stage/wheel" "$stage" >"$log" 2>&1 || { cat "$log" >&2 && fail 'pip failed'; }
rm -f "$folder"/nifkit-*.whl
mv "$stage"/wheel/*.whl "$folder"
echo "$folder"/nifkit-*.whl
