// Holds the outputs of nifIntersect, and counts the rays for which two of them differ.
#pragma once

#include <nif/nif.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace nif::test {

/// All outputs of one call, in arrays of their exact lengths.
struct FirstHits {
  explicit FirstHits(size_t count)
      : hit(count, 0xcc),
        certain(count, 0xcc),
        t(count, -1),
        low(count, -1),
        high(count, -1),
        normal(3 * count, -1),
        color(3 * count, -1),
        u(count, -1),
        v(count, -1),
        instance(count, 0xcccccccc),
        object(count, 0xcccccccc),
        triangle(count, 0xcccccccc),
        user(count, 0xcccccccc) {}
  NifHits outputs() {
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.hit = hit.data();
    hits.certain = certain.data();
    hits.t = t.data();
    hits.t_low = low.data();
    hits.t_high = high.data();
    hits.normal = normal.data();
    hits.u = u.data();
    hits.v = v.data();
    hits.instance = instance.data();
    hits.object = object.data();
    hits.triangle = triangle.data();
    hits.color = color.data();
    hits.user = user.data();
    return hits;
  }
  bool operator==(const FirstHits&) const = default;
  /// Calls visit(member of this, member of the other) for each output.
  template <class Visit>
  void visit_with(const FirstHits& other, const Visit& visit) const {
    visit(hit, other.hit), visit(certain, other.certain);
    visit(t, other.t), visit(low, other.low), visit(high, other.high), visit(normal, other.normal);
    visit(color, other.color);
    visit(u, other.u), visit(v, other.v);
    visit(instance, other.instance), visit(object, other.object), visit(triangle, other.triangle);
    visit(user, other.user);
  }

  std::vector<uint8_t> hit, certain;
  std::vector<float> t, low, high, normal, color, u, v;
  std::vector<uint32_t> instance, object, triangle;
  std::vector<uint64_t> user;
};

/// Counts the rays with a different bit in any output.
inline size_t count_different_hits(const FirstHits& a, const FirstHits& b) {
  std::vector<uint8_t> differs(a.hit.size());
  if (differs.empty()) return 0;
  a.visit_with(b, [&](const auto& mine, const auto& theirs) {
    const size_t each = mine.size() / differs.size(), bytes = each * sizeof(mine[0]);
    for (size_t i = 0; i < differs.size(); ++i)
      differs[i] |= std::memcmp(&mine[each * i], &theirs[each * i], bytes) != 0;
  });
  return size_t(std::count(differs.begin(), differs.end(), uint8_t(1)));
}

}  // namespace nif::test
