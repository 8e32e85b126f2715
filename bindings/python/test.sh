#!/usr/bin/env bash
# Tests bindings/python: builds the wheel and `nif`, installs the wheel in an environment of its own, and runs pytest on it, with
# the types checked where mypy is installed. NIFKIT names an installed nifkit, which is taken instead. Prints "Skipped: ..." and
# ends with 0 where numpy, pytest or what builds a wheel is missing.
#
#   bindings/python/test.sh [options of pytest]
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
here=$root/bindings/python
# shellcheck source=bindings/python/python.sh
source "$here/python.sh"

if ! python=$(find_python pip setuptools wheel venv numpy pytest); then
  echo 'Skipped: no Python 3 with numpy, pytest, pip, setuptools, wheel and venv (tools/setup.sh python)'
  exit 0
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# Nothing of the caller's is to be tested instead.
unset PYTHONPATH NIF_LIBRARY NIF_PROGRAM
export PYTHONDONTWRITEBYTECODE=1

wheel=$(NIF_PYTHON=$python "$here/build.sh" "$scratch/wheel")
NIF_PYTHON=$python "$here/build.sh" "$scratch/again" >/dev/null
cmp "$wheel" "$scratch"/again/*.whl
bytes=$(stat -c %s "$wheel")
echo "$(basename "$wheel"): $bytes bytes"
((bytes < 2000000)) || { echo 'the wheel has 2 MB or more' >&2 && exit 1; }
[[ $wheel == *-py3-none-linux_*.whl ]] || { echo "the wheel's name is wrong" >&2 && exit 1; }

[[ -n ${NIFKIT-} ]] || cmake --build "$root/build/release" --target nif >&2
export NIF_PROGRAM=${NIFKIT:-$root/build/release}/bin/nif

"$python" -m venv --without-pip --system-site-packages "$scratch/venv"
"$python" -m pip --python "$scratch/venv/bin/python" install --no-index --no-deps --quiet \
  --disable-pip-version-check "$wheel"
cd "$scratch"
if "$python" -c 'import mypy' 2>/dev/null; then
  MYPYPATH=$here "$python" -m mypy --strict --cache-dir "$scratch/mypy" -p nifkit
fi
venv/bin/python -m pytest -q -p no:cacheprovider --rootdir "$here" "$here/tests" "$@"
