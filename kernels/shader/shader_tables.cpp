// Writes an object's tables for shaders: the words for empty-space skipping and the corner bricks that GPU
// kernels read, the pairs of features two a word, and the network's rows in the order in which a shader has
// its inputs; and the tree of its triangles.
#include "kernels/shader/shader_tables.hpp"

#include <algorithm>
#include <iterator>

#include "kernels/packed/feature_grid.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "kernels/reference/network/samples.hpp"
#include "kernels/reference/planes/open.hpp"
#include "kernels/shader/triangle_tree.hpp"

namespace nif::kernels::shader {
namespace {

// Numbers that nif.glsl has, too.
static_assert(kSidesAbove == 0x06109610u && kSidesBelow == 0x04846484u && kWallKinds == 0x3f00u);
static_assert(kCertainReach == 16384.0f && kCullingReach == 4096.0f && kOpenLogit == -1);
static_assert(kEmptyVoxel == 14 && kLink == 15 && kMaxCells == 1024 && kMaxLevels == 4);
static_assert(kMinDirection == 0x1p-60f && kMaxDirection == 0x1p+60f && kFlatDirection == 0x1p-40f);
static_assert(kEstimateSlack == 1.0f / 32 && kTopHeight == 127 && kNormalSum == 62 && kPlaneOffsets == 256);
static_assert(kMaxBvhCoordinate == 0x1p61f && kBvhFarthest == 0x1p32f && kBvhFlattest == 0x1p-30f);
static_assert(kFirstMixedBrick == 3);
static_assert(kMaxLayers == 4 && kGlobalInputs == 8 && sizeof(CornerBrick) == 24);

using Words = std::pmr::vector<uint32_t>;

/// Appends a table, and returns where it begins.
template <class Table>
uint32_t append(Words& words, const Table& table) {
  const auto at = uint32_t(words.size());
  words.insert(words.end(), std::begin(table), std::end(table));
  return at;
}

/// A header.
Words start(const About& about, std::pmr::memory_resource* memory) {
  Words words(kHeaderWords, 0u, memory);
  words[kMagicWord] = kMagic;
  words[kVersionWord] = kVersion;
  words[kFlags] = about.proves ? uint32_t(kProves) : 0u;
  for (uint32_t k = 0; k < 6; ++k) words[kBounds + k] = bits_as<uint32_t>(about.bounds[k]);
  words[kBias] = bits_as<uint32_t>(about.bias);
  return words;
}

/// A header, and planes.
Words start(const PlanesField& field, const About& about, std::pmr::memory_resource* memory) {
  Words words = start(about, memory);
  words[kFlags] |= kHasPlanes;
  for (uint32_t a = 0; a < 3; ++a) {
    words[kOrigin + a] = bits_as<uint32_t>(field.origin[a]);
    words[kVoxels + a] = field.voxels[a];
  }
  words[kCellsPerUnit] = bits_as<uint32_t>(field.cells_per_unit);
  words[kVoxelsPerCell] = bits_as<uint32_t>(field.voxels_per_cell);
  words[kLevels] = field.levels;
  words[kReachUnits] = words[kCellsPerUnit];
  const cpu::TraversalGrid grid(field, memory);
  words[kVoxelWords] = append(words, grid.voxels);
  words[kChildren] = append(words, grid.children);
  return words;
}

void finish(Words& words) { words[kWordCount] = uint32_t(words.size()); }

void put_floats(Words& words, uint32_t at, const float (&values)[3]) {
  for (uint32_t a = 0; a < 3; ++a) words[at + a] = bits_as<uint32_t>(values[a]);
}

void append_triangles(Words& words, const TrianglesField& field, const SourceTriangles& source) {
  words[kFlags] |= kHasTriangles;
  words[kExtent] = bits_as<uint32_t>(field.extent);
  words[kReachUnits] = bits_as<uint32_t>(std::max(bits_as<float>(words[kReachUnits]), reach_scale(field)));
  words[kTree] = uint32_t(words.size());
  const TreeFrame frame = append_tree(field, words);
  words[kTreeEnd] = uint32_t(words.size());
  put_floats(words, kTreeCorner, frame.corner);
  put_floats(words, kTreeStep, frame.step);
  words[kVertices] = uint32_t(words.size());
  for (uint32_t i = 0; i < field.vertex_count; ++i)
    for (const float coordinate : field.vertices[i]) words.push_back(bits_as<uint32_t>(coordinate));
  if (source.words == nullptr) return;
  words[kSourceBits] = source.bits;
  words[kSourceNumbers] = uint32_t(words.size());
  words.insert(words.end(), source.words, source.words + source_words(source.count, source.bits));
  words.push_back(0);  // a shader reads the word behind a number, too
}

/// Appends a table of halves of words.
void append_halves(Words& words, const uint16_t* halves, uint64_t count) {
  for (uint64_t i = 0; i < count; i += 2)
    words.push_back(halves[i] | (i + 1 < count ? uint32_t(halves[i + 1]) << 16 : 0u));
}

uint64_t bricks_of(const PlanesField& field) {
  return uint64_t{field.bricks[0]} * field.bricks[1] * field.bricks[2];
}

void append_colors(Words& words, const VoxelColors& colors) {
  if (colors.values == nullptr) return;
  const PlanesField& grid = *colors.grid;
  words[kColorBricks] = uint32_t(words.size());
  append_halves(words, grid.brick_table, bricks_of(grid));
  words[kColorRecords] = uint32_t(words.size());
  for (uint32_t i = 0; i < grid.mixed_bricks; ++i) {
    const uint64_t surface = grid.brick_states[i].surface & ~grid.brick_states[i].aux;
    words.insert(words.end(), {grid.voxel_base[i], uint32_t(surface), uint32_t(surface >> 32)});
  }
  words[kColors] = uint32_t(words.size());
  append_halves(words, colors.values, grid.surface_voxels);
}
uint64_t count_color_words(const VoxelColors& colors) {
  if (colors.values == nullptr) return 0;
  const PlanesField& grid = *colors.grid;
  return (bricks_of(grid) + 1) / 2 + uint64_t{3} * grid.mixed_bricks + (grid.surface_voxels + 1) / 2;
}

/// A word of a row of weights from bytes.
uint32_t word_of(int8_t a, int8_t b, int8_t c, int8_t d) {
  return uint32_t(uint8_t(a)) | uint32_t(uint8_t(b)) << 8 | uint32_t(uint8_t(c)) << 16 |
         uint32_t(uint8_t(d)) << 24;
}

/// How many words the inputs of a layer take: in the first one for each point, then the global inputs.
uint32_t input_words(const SegmentField& field, uint32_t layer) {
  return layer == 0 ? field.samples + kGlobalInputs / 4 : field.network.layers[layer].inputs / 4;
}

/// The words of one row, in the order of the inputs.
void append_row(Words& words, const SegmentField& field, uint32_t number, uint32_t row) {
  const Network::Layer& layer = field.network.layers[number];
  const int8_t* weights = layer.weights + size_t(row) * layer.inputs;
  uint32_t first = 0;
  words.push_back(uint32_t(layer.biases[row]));
  if (number == 0) {
    const uint32_t heights = 2 * field.samples;
    for (uint32_t k = 0; k < field.samples; ++k)
      words.push_back(word_of(weights[2 * k], weights[2 * k + 1], weights[heights + k], 0));
    first = heights + field.samples;
  }
  for (uint32_t i = first; i < layer.inputs; i += 4)
    words.push_back(word_of(weights[i], weights[i + 1], weights[i + 2], weights[i + 3]));
}

}  // namespace

const char* unfit(const SegmentField& field, std::pmr::memory_resource* memory) {
  if (field.features_per_corner != 2)
    return "has a network whose corners do not have two features each, as shaders take them";
  if (!cpu::FeatureGrid(field, memory).complete)
    return "has features at corners that touch no surface voxel, where shaders find none";
  return nullptr;
}

/// A word for each voxel: shaders have no bricks, as kernels may.
uint64_t count_words(const PlanesField& field) {
  return kHeaderWords + uint64_t{field.voxels[0]} * field.voxels[1] * field.voxels[2] + field.child_count;
}

uint64_t count_words(const TrianglesField& field, const SourceTriangles& source) {
  const uint64_t numbers = source.words == nullptr ? 0 : source_words(source.count, source.bits) + 1;
  return kHeaderWords + count_tree_words(field) + uint64_t{3} * field.vertex_count + numbers;
}

uint64_t count_words(const ExactField& field, const HitDetails& details) {
  return count_words(field.planes) + count_words(field.triangles, details.source_triangles) - kHeaderWords +
         count_color_words(details.colors);
}

Words make_tables(const PlanesField& field, const About& about, std::pmr::memory_resource* memory) {
  Words words = start(field, about, memory);
  finish(words);
  return words;
}

Words make_tables(const SegmentField& field, const About& about, std::pmr::memory_resource* memory) {
  Words words = start(field, about, memory);
  words[kFlags] |= kHasNetwork;

  const cpu::FeatureGrid corners(field, memory);
  words[kCornerTable] = append(words, corners.table);
  words[kCornerBricks] = uint32_t(words.size());
  for (const CornerBrick& brick : corners.bricks) {
    words.push_back(brick.first);
    words.insert(words.end(), std::begin(brick.layer), std::end(brick.layer));
  }
  words[kPairs] = uint32_t(words.size());
  append_halves(words, corners.pairs.data(), corners.pairs.size());

  const Network& network = field.network;
  words[kSamples] = field.samples;
  words[kLengthScale] = bits_as<uint32_t>(field.length_scale);
  words[kLayerCount] = network.layer_count;
  words[kLogitScale] = bits_as<uint32_t>(network.calibration.scale);
  words[kThreshold] = uint32_t(network.calibration.threshold);
  for (uint32_t l = 0; l < network.layer_count; ++l) {
    const Network::Layer& layer = network.layers[l];
    const uint32_t about_layer[] = {uint32_t(words.size()), input_words(field, l), layer.outputs,
                                    layer.shift};
    std::copy_n(about_layer, 4, words.begin() + kLayers + 4 * l);
    words[kNetworkWords] = std::max(words[kNetworkWords], input_words(field, l));
    for (uint32_t row = 0; row < layer.outputs; ++row) append_row(words, field, l, row);
  }
  finish(words);
  return words;
}

Words make_tables(const TrianglesField& field, const SourceTriangles& source, const About& about,
                  std::pmr::memory_resource* memory) {
  Words words = start(about, memory);
  append_triangles(words, field, source);
  finish(words);
  return words;
}

Words make_tables(const ExactField& field, const HitDetails& details, const About& about,
                  std::pmr::memory_resource* memory) {
  Words words = start(field.planes, about, memory);
  append_triangles(words, field.triangles, details.source_triangles);
  append_colors(words, details.colors);
  finish(words);
  return words;
}

}  // namespace nif::kernels::shader
