// Random scenes: instances of small objects of all encodings, placed in every way that may be hard for a hierarchy
// over their boxes, and rays for them.
#pragma once

#include <nif/nif.hpp>

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "formats/nif/reader.hpp"
#include "tests/exact/ways.hpp"
#include "tests/support/plain_scene.hpp"

namespace nif::test {

class RandomScene {
 public:
  /// Scene `number` of a seed; always the same one.
  RandomScene(uint64_t seed, uint64_t number);

  /// Where its instances are.
  const std::string& layout() const { return layout_; }
  size_t instances() const { return instances_.size(); }
  const std::vector<NifRay>& rays() const { return rays_; }

  /// What the simplest program answers: a plain loop over instances, by the reference.
  Said expected() const;
  /// The answers of a device. Throws std::runtime_error if calls disagree.
  Said ask(const nifkit::Device& device, const std::function<uint64_t()>& next_call) const;

 private:
  struct Instance {
    uint32_t asset, object;
    Matrix transform, before;  ///< `before`: until the first commit, if there are two
    std::array<double, 3> origin{};
    uint32_t mask = 0xffffffffu;
    enum class State { enabled, disabled, removed } state = State::enabled;
  };
  struct File {
    explicit File(std::vector<std::byte> encoded)
        : bytes(std::move(encoded)), view(format::read_asset(bytes, "file")) {}
    std::vector<std::byte> bytes;
    format::AssetView view;
  };

  void draw_file(Random& random);
  void place(Random& random);
  void place_beside_origin(Random& random);
  void change(Random& random);
  void draw_rays(Random& random);
  const format::ObjectView& object_of(const Instance& one) const {
    return files_[one.asset]->view.objects[one.object];
  }
  LongMatrix placed(const Instance& one) const { return at_origin(one.transform, one.origin, origin_); }
  PlainScene plain() const;

  std::string layout_;
  std::vector<std::unique_ptr<File>> files_;
  std::vector<Instance> instances_;
  std::array<double, 3> origin_{};
  bool changed_ = false;  ///< instances are changed after a first commit
  std::vector<NifRay> rays_;
  std::vector<uint32_t> masks_;  ///< for each ray, one for all, or none
};

}  // namespace nif::test
