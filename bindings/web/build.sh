#!/usr/bin/env bash
# Builds the npm package `nifkit`: two builds of the module, with vectors and without, and their JavaScript, in build/web/nifkit, and packed as build/web/nifkit-VERSION.tgz. Needs what `tools/setup.sh build web` installs.
#
#   bindings/web/build.sh
#
# What a page downloads, one build and its JavaScript, must not be more than 165,000 bytes compressed by gzip; it ends with 1 if it is.
set -euo pipefail
if (($#)); then
  sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
  [[ $1 == -h || $1 == --help ]] && exit 0
  exit 2
fi
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
for program in emcmake node npm; do
  command -v "$program" >/dev/null || { echo "bindings/web/build.sh: $program is not installed; tools/setup.sh web" >&2 && exit 1; }
done
# Debian's Emscripten looks for its JavaScript where Debian's node has it; another node does not look there.
export NODE_PATH=${NODE_PATH:-/usr/share/nodejs}
web=build/web package=build/web/nifkit
rm -rf "$package"
mkdir -p "$package"
launcher=()
! command -v ccache >/dev/null || launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)

# build_module SIMD
build_module() {
  local out=$web/simd-$1 wasm
  emcmake cmake -S bindings/web -B "$out" -G Ninja -DCMAKE_BUILD_TYPE=Release -DNIF_WERROR=ON "-DNIF_WEB_SIMD=$1" "${launcher[@]}" \
    >"$out.log" 2>&1 || { cat "$out.log" >&2 && return 1; }
  cmake --build "$out" --parallel "$(nproc)" >&2 && cp "$out"/bin/* "$package" || return
  # A second time finds some more that is not needed.
  for wasm in "$out"/bin/*.wasm; do
    wasm-opt --enable-simd --enable-exception-handling --enable-mutable-globals --enable-sign-ext --enable-nontrapping-float-to-int \
      -Oz --converge "$wasm" -o "$package/$(basename "$wasm")" || return
  done
}
# Both at once: linking and wasm-opt take most of the time, on one core.
status=0
build_module ON &
build_module OFF || status=1
wait $! || status=1
((status == 0)) || exit 1

version=$(sed -n 's/^#define NIF_VERSION_[A-Z]* \([0-9]*\)$/\1/p' runtime/include/nif/nif.h | paste -sd .)
sed "s/@VERSION@/$version/" bindings/web/package.json >"$package/package.json"
cp bindings/web/js/*.d.ts bindings/web/README.md LICENSE NOTICE "$package"
# Without comments and empty lines.
for script in bindings/web/js/*.js; do
  sed -E '/^ *(\/\/|\/\*\*|\*|$)/d; s/^ +//; s, // .*,,' "$script" >"$package/$(basename "$script")"
done
npm pack --silent --pack-destination "$web" "./$package" >/dev/null

# What a page loads for a device: all JavaScript but that of other builds and of a pool's workers. As servers compress:
# without names of files.
status=0
for wasm in "$package"/*.wasm; do
  build=${wasm%.wasm}
  bytes=$(for file in "$wasm" "$build".mjs "$package"/*.js; do [[ $file == */worker.js ]] || gzip -9nc "$file" | wc -c; done | paste -sd + | bc)
  printf '%-22s %6d bytes of %6d, compressed with its JavaScript\n' "$(basename "$build")" "$bytes" 165000
  ((bytes <= 165000)) || status=1
done
exit $status
