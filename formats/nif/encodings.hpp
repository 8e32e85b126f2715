// The encodings of a .nif file: this list of includes, and what is built from it. Their order is that of
// kernels::AnyField.
#pragma once

#include <concepts>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

#include "formats/nif/bvh/encoding.hpp"
#include "formats/nif/exact/encoding.hpp"
#include "formats/nif/proof/encoding.hpp"
#include "formats/nif/segment/encoding.hpp"
#include "formats/nif/spherical/encoding.hpp"
#include "kernels/reference/encodings.hpp"

namespace nif::format {

template <template <class...> class T, class Fields>
struct MapEncodings;
template <template <class...> class T, class... Field>
struct MapEncodings<T, std::variant<Field...>> {
  using Type = T<EncodingOf<Field>...>;
};
/// T<EncodingOf<...>...>, of all encodings.
template <template <class...> class T>
using OfEncodings = typename MapEncodings<T, kernels::AnyField>::Type;

template <class... Encoding>
using AnyDataOf = std::variant<typename Encoding::Data...>;
template <class... Encoding>
using AnyViewOf = std::variant<typename Encoding::View...>;
/// One object of any encoding: owning its memory, or as views into a file.
using AnyData = OfEncodings<AnyDataOf>;
using AnyView = OfEncodings<AnyViewOf>;

template <class... Encoding>
struct SharedOf : Encoding::Shared... {};
template <class... Encoding>
struct SharedViewOf : Encoding::SharedView... {
  explicit SharedViewOf(std::pmr::memory_resource* memory) : Encoding::SharedView(memory)... {}
};
/// What the objects of an asset share, of all encodings together.
using Shared = OfEncodings<SharedOf>;
using SharedView = OfEncodings<SharedViewOf>;

template <class... Encoding>
using TupleOf = std::tuple<Encoding...>;

/// Calls ask(EncodingOf<...>()) for each encoding, in the order of the list.
template <class Ask>
constexpr void for_each_encoding(const Ask& ask) {
  std::apply([&](const auto&... encoding) { (ask(encoding), ...); }, OfEncodings<TupleOf>());
}

template <class Content, class... Encoding>
struct EncodingWith;
template <class Content, class First, class... Rest>
struct EncodingWith<Content, First, Rest...>
    : std::conditional_t<std::same_as<Content, typename First::Data> ||
                             std::same_as<Content, typename First::View>,
                         std::type_identity<First>, EncodingWith<Content, Rest...>> {};
template <class Content>
struct OfContent {
  template <class... Encoding>
  using In = typename EncodingWith<Content, Encoding...>::type;
};
/// The EncodingOf<...> that has this Data or View.
template <class Content>
using EncodingOfContent = OfEncodings<OfContent<Content>::template In>;

/// Calls ask(content, its EncodingOf<...>()) with what the variant holds, data or view.
template <class Any, class Ask>
decltype(auto) visit_encoding(Any&& any, const Ask& ask) {
  return std::visit(
      [&](auto&& content) -> decltype(auto) {
        return ask(content, EncodingOfContent<std::remove_cvref_t<decltype(content)>>());
      },
      std::forward<Any>(any));
}

/// What a file calls the object's encoding, and what texts do.
template <class Any>
uint32_t encoding_number(const Any& any) {
  return visit_encoding(any, [](const auto&, auto encoding) { return decltype(encoding)::kNumber; });
}
template <class Any>
const char* encoding_name(const Any& any) {
  return visit_encoding(any, [](const auto&, auto encoding) { return decltype(encoding)::kName; });
}

}  // namespace nif::format
