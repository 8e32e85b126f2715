#!/usr/bin/env bash
# Compiles the runtime for 64-bit Windows with MinGW-w64, and tests it under Wine: nif.h as C99 with nif.dll and with the static
# library, the golden assets, the runtime's tests on every instruction set that this machine has, and the package: installed,
# moved, and as a .zip, with samples/engine and a C++ program built against it. Where clang is, nif.h is also read as
# Microsoft's compiler would.
#
#   tests/windows/run.sh [ctest options]
#
# Prints "Skipped: ..." and ends with 0 where what `tools/setup.sh build windows` installs is missing.
set -euo pipefail
case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source tests/windows/prepare.sh

configure_windows -DNIF_BUILD_TESTS=ON
cmake --build build/windows --parallel "$(nproc)" >&2

# No headers of Windows are here: of the standard library, nif.h needs fixed sizes, which clang has, and memset.
if command -v clang >/dev/null; then
  mkdir -p build/windows/msvc
  printf '#include <stddef.h>\nvoid* memset(void*, int, size_t);\n' >build/windows/msvc/string.h
  for language in c c++; do
    clang --target=x86_64-pc-windows-msvc -ffreestanding -nostdlibinc -Wall -Wextra -Wno-unused-function -pedantic -Werror \
      -fsyntax-only -x "$language" -isystem build/windows/msvc -I runtime/include runtime/include/nif/nif.h
  done
  echo 'nif.h: read by clang as by the compiler of Microsoft, as C and as C++'
fi
ctest --test-dir build/windows --output-on-failure --no-tests=error "$@"
