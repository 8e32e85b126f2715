# shellcheck shell=bash
# What scripts for Windows share: the check of what they need, an environment of Wine's, configuring. To be sourced, in the
# root of the source.
for program in x86_64-w64-mingw32-g++-posix cmake ninja; do
  command -v "$program" >/dev/null || { echo "Skipped: $program is not installed (tools/setup.sh windows)" && exit 0; }
done
wine=$(PATH=$PATH:/usr/lib/wine command -v wine64 || true)
[[ -n $wine ]] || { echo 'Skipped: wine64 is not installed (tools/setup.sh windows)' && exit 0; }
[[ -d /usr/src/googletest ]] || { echo 'Skipped: googletest is not installed (tools/setup.sh windows)' && exit 0; }

# A Windows of our own, without what it would offer to install, that ends with the script.
WINEPREFIX=$(mktemp -d)
export WINEPREFIX WINEDEBUG=-all WINEDLLOVERRIDES='mscoree,mshtml=' WINEARCH=win64
wineserver=$(PATH=/usr/lib/wine:$PATH command -v wineserver64 || PATH=/usr/lib/wine:$PATH command -v wineserver)
trap '"$wineserver" -k || true; "$wineserver" -w || true; rm -rf "$WINEPREFIX"' EXIT
"$wineserver" -p  # stays, so that each program starts at once
"$wine" wineboot --init >/dev/null 2>&1

# configure_windows [cmake options]
configure_windows() {
  local launcher=()
  if command -v ccache >/dev/null; then
    launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  fi
  cmake -S . -B build/windows -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/mingw-w64.cmake" -DCMAKE_BUILD_TYPE=Release \
    -DNIF_WERROR=ON -DNIF_BUILD_TOOLS=OFF "${launcher[@]}" "$@" >/dev/null
}
