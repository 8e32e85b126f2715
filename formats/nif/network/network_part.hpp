// The network part as files store it: features at corners of the planes' voxels, and networks, which objects
// may share.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/nif/layout.hpp"
#include "formats/nif/part_bytes.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/network/network_field.hpp"

namespace nif::format {

struct Asset;
struct AssetView;
struct Object;
struct ObjectView;

enum NetworkSection : uint32_t {
  kNetworks = fourcc("NETW"),  ///< NetworkRecord[]
  kMlps = fourcc("MLPS"),      ///< MlpRecord[]
};

/// How the payloads are stored, as bits.
enum NetworkForm : uint32_t {
  kCodedFeatures = 1,
  kCornersAround = 2,  ///< corners with features are those around surface voxels: the payload is empty
  kNetworkForms = 3    ///< all bits
};

struct NetworkRecord {  // 80 bytes: the members of kernels::NetworkField with the same names
  uint32_t mlp;         ///< index into kMlps; objects may share one
  uint32_t corners;
  uint32_t features_per_corner;
  uint32_t samples;
  float length_scale;
  uint32_t forms;         ///< NetworkForm
  uint32_t reserved[2];   ///< 0
  Payload brick_corners;  ///< brick_corners, corner_base, in that order, without gaps
  Payload features;       ///< [corners][features_per_corner] int8
};
static_assert(sizeof(NetworkRecord) == 80);

struct LayerRecord {  // 12 bytes
  uint32_t inputs, outputs, shift;
};

struct MlpRecord {  // 88 bytes
  uint32_t layer_count;
  float logit_scale;
  LayerRecord layers[4];  ///< those beyond layer_count are 0
  int32_t threshold;      ///< already subtracted from the last layer's bias
  uint32_t reserved;      ///< 0
  Payload weights;        ///< for each layer in turn, without gaps (inputs is a multiple of 4):
                          ///< int32 biases [outputs], int8 weights [outputs][inputs]
};
static_assert(sizeof(MlpRecord) == 88);

struct Layer {
  uint32_t inputs = 0, outputs = 0, shift = 0;
  std::vector<int32_t> biases;  ///< [outputs]
  std::vector<int8_t> weights;  ///< [outputs][inputs]
};

/// A multilayer perceptron in integers, as kernels::Network. Its logits are lower than trained by
/// `threshold`, which is subtracted from the last bias: see move_threshold().
struct Mlp {
  std::vector<Layer> layers;
  float logit_scale = 1;
  int32_t threshold = 0;

  kernels::Calibration calibration() const { return {logit_scale, threshold}; }
};

/// The least and the largest output of a network, for any inputs. int64, because a network need not be valid.
struct OutputRange {
  int64_t least, largest;
};
OutputRange output_range(const Mlp& mlp);

/// Raises the decision threshold by `by` and lowers every output by as much: above 0, answers shift towards
/// occluded. Probabilities stay the same.
void move_threshold(Mlp& mlp, int32_t by);

/// The network part of one object; members as in kernels::NetworkField.
struct NetworkData {
  uint32_t mlp = 0;  ///< index into Asset::mlps
  std::vector<uint64_t> brick_corners;
  std::vector<uint32_t> corner_base;
  std::vector<int8_t> features;
  uint32_t corners = 0;
  uint32_t features_per_corner = 0;
  uint32_t samples = 0;
  float length_scale = 0;
  uint32_t coded = 0;  ///< NetworkForm: what to code in a file, if possible and smaller
};

/// Bytes of the payloads if none is coded.
struct UncodedNetwork {
  uint64_t corners, features;

  /// From a record, or anything else with such members.
  template <class Record>
  UncodedNetwork(const Record& r, uint32_t mixed_bricks)
      : corners(uint64_t{mixed_bricks} * (sizeof(uint64_t) + sizeof(uint32_t))),
        features(uint64_t{r.corners} * r.features_per_corner) {}

  /// Whether a file may have them coded in this many bytes together.
  bool may_take(uint64_t bytes) const { return corners + features <= kMostExpansion * bytes; }
};

/// The kernels' view on planes like these; valid while data and network live and do not change.
kernels::NetworkField field_of(const NetworkData& data, const Mlp& mlp, const kernels::PlanesField& planes);

struct MlpView {
  kernels::Network network;
  uint64_t bytes = 0;
};

struct NetworkView {
  uint32_t mlp = 0;             ///< index into AssetView::mlps
  float length_scale = 0;       ///< as in NetworkData
  kernels::NetworkField field;  ///< ready to be queried, together with its object's planes
  PayloadBytes features;        ///< including the corners
  uint32_t coded = 0;           ///< as in NetworkData

  std::array<PartBytes, 1> parts() const { return {{{"features", features.file, features.decoded}}}; }
  /// Afterwards nothing points into the file, and the field cannot be queried; its numbers stay.
  void drop_bytes();
};

/// As formats/nif/parts.hpp requires.
struct MlpsOfNetworks {
  static constexpr uint32_t kRecords = kMlps;
  using Record = MlpRecord;

  template <class Asset>
  static auto& of(Asset& asset) {
    return asset.mlps;
  }
};

struct NetworkPart {
  static constexpr const char* kName = "network";
  static constexpr uint32_t kRecords = kNetworks;
  using Record = NetworkRecord;
  using Data = NetworkData;
  using View = NetworkView;
  using Shared = MlpsOfNetworks;

  template <class Held>
  struct Member {
    Held network{};
  };

  template <class Object>
  static auto& of(Object& object) {
    return object.network;
  }
};

MlpView read_record(const MlpRecord& record, const Reading& reading);
MlpRecord write_record(const Mlp& mlp, Section& payloads);
NetworkView read_record(const NetworkRecord& record, const ObjectView& object, const Reading& reading);
NetworkRecord write_record(const NetworkData& data, const Object& object, Section& payloads);
NetworkData to_data(const NetworkView& view, const kernels::PlanesField& planes);
Mlp to_mlp(const MlpView& view);

}  // namespace nif::format
