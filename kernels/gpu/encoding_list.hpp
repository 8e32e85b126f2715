// A list of encodings as a type, and the numbers that follow from each one's position in it.
//
// An encoding is a structure in kernels/gpu/encodings with
//   Field                            its field in device memory
//   kKinds                           how many kinds of its objects kernels tell apart: each has a bit in the
//                                    sets of kinds that kernels are made for. If 0, its objects are a kind of
//                                    another one, and what follows but describe() and upload() is missing
//   kHasItems                        whether its objects may leave rays to a network, as items of the
//                                    pipeline
//   ask<kKinds>(thread, object, kind, ray, row)
//                                    an object's answer, computed by one thread for its ray; kKinds are the
//                                    kinds that may occur, and `kind` the object's own, both counted from the
//                                    encoding's first bit
//   traverse(object, ray, column, item, answer)
//                                    the traversal of the pipeline: returns true if there is an answer, false
//                                    if a network must decide; then all of `item` is set but its instance
//   intersect(thread, object, kind, ray, limit, row)
//                                    the first hit with an object, by one thread for its ray; `limit`
//                                    as in the reference's intersect(), `kind` as in ask()
//   kProves                          whether its proofs can be queried alone; if so, there is
//   prove(object, ray, open)         what the proofs say, and the part of a ray that they leave open
//                                    (kernels/reference/planes/open.hpp)
//   describe(hash)                   what of its field on the host crosses from the runtime to the GPU module
//   upload(field)                    on the host: how a field gets to device memory (upload.hpp)
#pragma once

#include <cstdint>
#include <type_traits>

namespace nif::kernels::gpu {

template <class... Encoding>
struct EncodingList {};

/// The first bit of an encoding's kinds.
template <class Wanted, class... Encoding>
constexpr uint32_t first_kind_bit(EncodingList<Encoding...>) {
  uint32_t bit = 0;
  bool found = false;
  ((found = found || std::is_same_v<Wanted, Encoding>, bit += found ? 0 : Encoding::kKinds), ...);
  return bit;
}

/// For the field of each encoding on the host: `Encoding`, that structure. The structure's file says so.
template <class HostField>
struct GpuEncodingOf;
template <class... HostField>
using EncodingsOf = EncodingList<typename GpuEncodingOf<HostField>::Encoding...>;

}  // namespace nif::kernels::gpu
