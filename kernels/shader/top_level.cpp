// Halves the instances along the axis along which their boxes' centres lie farthest apart, again and again, so that the
// tree's form depends on their number alone: after they moved its words lie where they did.
#include "kernels/shader/top_level.hpp"

#include <algorithm>
#include <numeric>

namespace nif::kernels::shader {
namespace {

constexpr size_t kMostOfLeaf = 2;

class Builder {
 public:
  Builder(std::span<const WorldBox> boxes, uint32_t first, TopLevel& made)
      : boxes_(boxes), first_(first), made_(made) {}

  void build(size_t begin, size_t end) {
    const size_t at = made_.words.size();
    made_.words.resize(at + kTopNodeWords);
    WorldBox whole = boxes_[made_.order[begin]];
    for (size_t i = begin + 1; i < end; ++i)
      for (int a = 0; a < 3; ++a) {
        whole.min[a] = std::min(whole.min[a], boxes_[made_.order[i]].min[a]);
        whole.max[a] = std::max(whole.max[a], boxes_[made_.order[i]].max[a]);
      }
    for (size_t a = 0; a < 3; ++a) {
      made_.words[at + a] = bits_as<uint32_t>(whole.min[a]);
      made_.words[at + 3 + a] = bits_as<uint32_t>(whole.max[a]);
    }
    if (end - begin <= kMostOfLeaf) {
      made_.words[at + kTopList] = uint32_t(begin * 8 + (end - begin));
    } else {
      sort(begin, end);
      const size_t middle = begin + (end - begin) / 2;
      build(begin, middle);
      build(middle, end);
    }
    made_.words[at + kTopNext] = first_ + uint32_t(made_.words.size());
  }

 private:
  double centre(uint32_t box, int axis) const {
    return double(boxes_[box].min[axis]) + double(boxes_[box].max[axis]);
  }
  void sort(size_t begin, size_t end) {
    int widest = 0;
    double width = -1;
    for (int a = 0; a < 3; ++a) {
      double low = centre(made_.order[begin], a), high = low;
      for (size_t i = begin + 1; i < end; ++i) {
        low = std::min(low, centre(made_.order[i], a));
        high = std::max(high, centre(made_.order[i], a));
      }
      if (high - low > width) width = high - low, widest = a;
    }
    const auto before = [&](uint32_t i, uint32_t j) {
      const double x = centre(i, widest), y = centre(j, widest);
      return x < y || (x == y && i < j);
    };
    std::sort(made_.order.begin() + ptrdiff_t(begin), made_.order.begin() + ptrdiff_t(end), before);
  }

  std::span<const WorldBox> boxes_;
  uint32_t first_;
  TopLevel& made_;
};

}  // namespace

size_t count_top_level_words(size_t boxes) {
  if (boxes <= kMostOfLeaf) return boxes == 0 ? 0 : kTopNodeWords;
  return kTopNodeWords + count_top_level_words(boxes / 2) + count_top_level_words(boxes - boxes / 2);
}

TopLevel make_top_level(std::span<const WorldBox> boxes, uint32_t first, std::pmr::memory_resource* memory) {
  TopLevel made{std::pmr::vector<uint32_t>(boxes.size(), 0u, memory), std::pmr::vector<uint32_t>(memory)};
  std::iota(made.order.begin(), made.order.end(), 0u);
  if (!boxes.empty()) Builder(boxes, first, made).build(0, boxes.size());
  return made;
}

}  // namespace nif::kernels::shader
