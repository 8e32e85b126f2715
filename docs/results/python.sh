#!/usr/bin/env bash
# Measures bindings/python beside the same queries in C, and prints the tables of python.md.
#
#   docs/results/python.sh [ROUNDS]
#
# With NIF_TEST_MESHES it takes the Stanford dragon, else a generated knot; both baked with the preset `fast`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh
# shellcheck source=bindings/python/python.sh
source bindings/python/python.sh

python=$(find_python pip setuptools wheel venv numpy) || { say 'python.sh: no Python 3 with numpy, pip, setuptools, wheel, venv' && exit 1; }
prepare_nifkit
prepare_asset ''
asset=$(realpath "$asset")
wheel=$(NIF_PYTHON=$python bindings/python/build.sh)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$python" -m venv --without-pip --system-site-packages "$scratch/venv"
"$python" -m pip --python "$scratch/venv/bin/python" install --no-index --no-deps --quiet --disable-pip-version-check "$wheel"

# C with the very library of the wheel.
library=$(realpath "$scratch"/venv/lib/python3*/site-packages/nifkit/libnif.so)
soname=$(basename "$(find "$prefix"/lib*/ -name 'libnif.so.*.*' ! -name '*.*.*.*.*' -print -quit)")
ln -s "$library" "$scratch/$soname"
cc -O2 -Wall -Werror -I runtime/include "-Wl,-rpath,$scratch" bindings/python/tests/answers.c "$scratch/$soname" -o "$scratch/answers"

unset PYTHONPATH NIF_LIBRARY
echo "$(basename "$asset"), $("$scratch/venv/bin/python" --version), numpy $("$python" -c 'import numpy; print(numpy.__version__)')"
"$scratch/venv/bin/python" bindings/python/tests/measure.py "$asset" "$scratch/answers" "$wheel" "${1-41}"
