#!/usr/bin/env bash
# Bits of vector masks come from bits_of_mask() and bits_of_register(), which tells why. Prints lines that take them in another way, and ends with 1.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
grep -q 'bits_of_register(Mask mask)' kernels/cpu/lanes-inl.hpp || { echo 'bits_of_register() is not in lanes-inl.hpp any more' >&2 && exit 1; }
! grep -rnE 'StoreMaskBits|BitsFromMask|_cvtmask[0-9]+_u32|mm512_mask2int|uint32_t\(\w+\.raw\)|(=|return|\{) *_mm[0-9]*_(cmp|test)\w*_mask' kernels bake mesh runtime \
  --include='*.hpp' --include='*.cpp' --exclude=lanes-inl.hpp
