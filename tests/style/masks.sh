#!/usr/bin/env bash
# Bits of vector masks come from bits_of_mask(), which tells why. Prints lines that take them in another way, and ends with 1.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
grep -q 'StoreMaskBits' kernels/cpu/lanes-inl.hpp || { echo 'bits_of_mask() is not in lanes-inl.hpp any more' >&2 && exit 1; }
! grep -rnE 'StoreMaskBits|BitsFromMask|_cvtmask[0-9]+_u32|mm512_mask2int' kernels bake mesh runtime \
  --include='*.hpp' --include='*.cpp' --exclude=lanes-inl.hpp
