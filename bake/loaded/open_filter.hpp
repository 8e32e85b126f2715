// Finds the segments that a traversal leaves open. They are rare, so the search must be as fast as queries
// are.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kernels/reference/network/network_field.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::bake {

class OpenFilter {
 public:
  /// `field` must outlive this; its features and network have no effect.
  explicit OpenFilter(const kernels::SegmentField& field);
  ~OpenFilter();

  /// Appends the indices of the open segments, in ascending order. Thread-safe. The same on every machine,
  /// because kernels give the same bits.
  void select(std::span<const kernels::Segment> segments, std::vector<uint32_t>& open) const;

 private:
  struct BlankNetwork;
  struct FastKernel;
  kernels::SegmentField field_;
  std::unique_ptr<BlankNetwork> network_;
  std::unique_ptr<FastKernel> fast_;  ///< none if there is none for this machine
};

}  // namespace nif::bake
