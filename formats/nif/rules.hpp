// The rules of a .nif file that its reader enforces. Each has a number that never changes and is never
// reused. docs/validation.md lists them; tests/corpus/validate has a file that breaks each.
#pragma once

#include <cstdint>

#include "formats/base/status.hpp"

namespace nif::format {

/// RULE(number, name, status of a file that breaks it, what is wrong then: a clause without punctuation at
/// the end). 1xx the shell, 2xx objects, instances and names, 3xx planes, 4xx networks, 5xx triangles, 6xx
/// `spherical`, 7xx what is optional, from 750 on parts that came later. The reader may describe the error more
/// precisely.
#define NIF_FORMAT_RULES(RULE)                                                                              \
  RULE(101, empty_file, file_empty, "the file is empty")                                                    \
  RULE(102, foreign_file, foreign_nif,                                                                      \
       "this is a NetImmerse/Gamebryo model, which shares the extension .nif but is another format")        \
  RULE(103, other_file, not_a_nif, "not a .nif asset: it does not start with the identifier")               \
  RULE(104, changed_identifier, damaged_nif, "changed on the way, as a text-mode or 7-bit transfer does")   \
  RULE(105, cut_header, file_truncated, "ends within the header")                                           \
  RULE(106, header_checksum, damaged_nif, "wrong checksum")                                                 \
  RULE(107, other_version, unsupported_nif, "a format version that this build does not read")               \
  RULE(108, reserved_not_zero, damaged_nif, "reserved bytes are not zero")                                  \
  RULE(109, section_count, damaged_nif, "the number of sections is out of range")                           \
  RULE(110, cut_file, file_truncated, "ends before the length that its header states")                      \
  RULE(111, bytes_after_end, damaged_nif, "bytes follow the end that the header states")                    \
  RULE(112, table_past_end, damaged_nif, "reaches past the end")                                            \
  RULE(113, table_checksum, damaged_nif, "wrong checksum")                                                  \
  RULE(115, section_place, damaged_nif, "does not start where the one before it ends")                      \
  RULE(116, section_past_end, damaged_nif, "reaches past the end of the file")                              \
  RULE(117, padding_not_zero, damaged_nif, "padding that is not zero")                                      \
  RULE(118, section_checksum, damaged_nif, "wrong checksum")                                                \
  RULE(119, section_twice, damaged_nif, "occurs twice")                                                     \
  RULE(120, bytes_of_no_section, damaged_nif, "bytes belong to no section")                                 \
  RULE(121, unknown_section, unsupported_nif, "required, and newer than this build")                        \
  RULE(122, section_flag, damaged_nif, "flags are not those of its type")                                   \
  RULE(123, section_missing, damaged_nif, "is missing")                                                     \
  RULE(124, section_unused, damaged_nif, "is there for no object")                                          \
  RULE(125, metadata_text, damaged_nif, "is required, empty or not UTF-8")                                  \
  RULE(126, record_size, damaged_nif,                                                                       \
       "its size is not a multiple of the record size, or records are too short")                           \
  RULE(127, payload_place, damaged_nif,                                                                     \
       "payload does not start at a multiple of 64 after the one before it")                                \
  RULE(128, payload_size, damaged_nif, "payload has not the bytes that its record asks for")                \
  RULE(129, payload_past_end, damaged_nif, "payload reaches past the end of its section")                   \
  RULE(130, payload_padding, damaged_nif, "padding before the payload is not zero")                         \
  RULE(132, unknown_flags, unsupported_nif, "flags that a reader must know, and this build does not")       \
  RULE(133, payloads_checksum, damaged_nif, "has a checksum, although its payloads have their own")         \
  RULE(134, unknown_arithmetic, unsupported_nif,                                                            \
       "a revision of the arithmetic that this build does not know")                                        \
  RULE(135, payload_checksum, damaged_nif, "payload has a wrong checksum")                                  \
  RULE(201, no_object, damaged_nif, "holds no object")                                                      \
  RULE(203, record_order, damaged_nif, "a part is not the number of objects that have one before it")       \
  RULE(204, record_missing, damaged_nif, "a part has no such record")                                       \
  RULE(205, records_of_no_object, damaged_nif, "has records that belong to no object")                      \
  RULE(206, bounds_not_finite, damaged_nif, "bounds are not finite")                                        \
  RULE(207, bounds_empty, damaged_nif, "bounds are empty")                                                  \
  RULE(208, bias_range, damaged_nif, "bias is negative or not finite")                                      \
  RULE(209, name_order, damaged_nif, "name does not follow the one before it")                              \
  RULE(210, name_past_end, damaged_nif, "name reaches past the end of section NAME")                        \
  RULE(211, name_end, damaged_nif, "name is not followed by a 0")                                           \
  RULE(212, name_text, damaged_nif, "name is not UTF-8 text")                                               \
  RULE(213, bytes_of_no_name, damaged_nif, "bytes that belong to no name")                                  \
  RULE(214, object_range, damaged_nif, "object is out of range")                                            \
  RULE(215, transform_not_finite, damaged_nif, "transform is not finite")                                   \
  RULE(216, places_after_all, damaged_nif, "has instances, though its header says that it places nothing")  \
  RULE(217, level_order, damaged_nif, "level is not followed by the level below it")                        \
  RULE(218, error_range, damaged_nif, "error is negative or not finite")                                    \
  RULE(219, level_placed, damaged_nif, "its object is a coarser level of another one")                      \
  RULE(220, translation_sum, damaged_nif, "translation is not the sum of two singles")                      \
  RULE(221, parent_order, damaged_nif, "parent is not an instance before it")                               \
  RULE(301, origin_not_finite, damaged_nif, "origin is not finite")                                         \
  RULE(302, voxels_per_unit, damaged_nif, "voxels_per_unit is not a finite number above 0")                 \
  RULE(303, voxels_per_unit_large, damaged_nif, "voxels_per_unit is too large")                             \
  RULE(304, levels_range, damaged_nif, "levels is out of range")                                            \
  RULE(305, voxels_range, damaged_nif, "voxels is out of range")                                            \
  RULE(306, mixed_bricks_range, damaged_nif, "mixed_bricks is out of range")                                \
  RULE(307, child_count_range, damaged_nif, "child_count is out of range")                                  \
  RULE(308, unknown_forms, damaged_nif, "forms has unknown bits")                                           \
  RULE(309, kinds_not_coded, damaged_nif, "forms states kinds of cells that are not coded")                 \
  RULE(310, decoded_size, damaged_nif,                                                                      \
       "payloads decode to more than 16 times their bytes, or have more bricks than half as many")          \
  RULE(312, not_as_encoded, damaged_nif, "payload is not what an encoder makes")                            \
  RULE(313, voxel_base, damaged_nif, "voxel_base is not the number of surface voxels before")               \
  RULE(314, surface_voxels, damaged_nif,                                                                    \
       "surface_voxels is not the number of surface voxels in brick_states")                                \
  RULE(315, brick_order, damaged_nif, "brick_table does not name each mixed brick once, in order")          \
  RULE(316, brick_missing, damaged_nif, "brick_table names a brick that is not there")                      \
  RULE(317, brick_left_out, damaged_nif, "brick_table leaves out a mixed brick")                            \
  RULE(318, voxel_beyond_grid, damaged_nif, "brick_states has a voxel beyond the grid")                     \
  RULE(319, cell_kind, damaged_nif, "a cell is of an unknown kind")                                         \
  RULE(320, normal_range, damaged_nif, "a normal is out of range")                                          \
  RULE(321, plane_order, damaged_nif, "a cell's lower plane is not below its upper plane")                  \
  RULE(322, cut_too_often, damaged_nif, "a voxel is cut more often than levels says")                       \
  RULE(323, no_children, damaged_nif, "a cell is cut into no children")                                     \
  RULE(324, child_order, damaged_nif, "links do not name all children in order")                            \
  RULE(325, child_of_no_cell, damaged_nif, "a child belongs to no cell")                                    \
  RULE(326, child_count, damaged_nif, "child_count is not the number of children that links name")          \
  RULE(327, sides_joined, damaged_nif, "planes join what is outside with what is inside")                   \
  RULE(328, side_not_proven, damaged_nif,                                                                   \
       "a cell has a side that its planes and its neighbours do not prove")                                 \
  RULE(401, network_range, damaged_nif, "network is out of range")                                          \
  RULE(402, length_scale, damaged_nif, "length_scale is negative or not finite")                            \
  RULE(403, features_range, damaged_nif, "features_per_corner is out of range")                             \
  RULE(404, samples_range, damaged_nif, "samples is out of range")                                          \
  RULE(405, samples_multiple, damaged_nif, "samples is no multiple of 4")                                   \
  RULE(406, other_inputs, damaged_nif, "its network takes another number of inputs")                        \
  RULE(408, corner_base, damaged_nif, "corner_base is not the number of corners before")                    \
  RULE(409, corners, damaged_nif, "corners is not the number of bits in brick_corners")                     \
  RULE(410, feature_range, damaged_nif, "a feature is -128")                                                \
  RULE(411, layer_count, damaged_nif, "layer_count is out of range")                                        \
  RULE(412, logit_scale, damaged_nif, "logit_scale is not a finite number above 0")                         \
  RULE(413, threshold_range, damaged_nif, "threshold is out of range")                                      \
  RULE(414, unused_layer, damaged_nif, "a layer beyond layer_count is not zero")                            \
  RULE(415, first_inputs, damaged_nif, "inputs of the first layer is out of range")                         \
  RULE(416, layers_join, damaged_nif, "a layer's inputs are not the outputs of the one before it")          \
  RULE(417, inputs_multiple, damaged_nif, "a layer's inputs are no multiple of 4")                          \
  RULE(418, last_outputs, damaged_nif, "the last layer has not one output")                                 \
  RULE(419, outputs_range, damaged_nif, "outputs of a hidden layer is out of range")                        \
  RULE(420, shift_range, damaged_nif, "shift is out of range")                                              \
  RULE(421, bias_value, damaged_nif, "a bias is out of range")                                              \
  RULE(422, weight_range, damaged_nif, "a weight is -128")                                                  \
  RULE(501, tree_empty, damaged_nif, "the bvh is empty")                                                    \
  RULE(502, tree_scale, damaged_nif, "a scale of the bvh is out of range")                                  \
  RULE(503, tree_large, damaged_nif, "the bvh is too large")                                                \
  RULE(504, node_of_no_node, damaged_nif, "a node of the bvh belongs to no other")                          \
  RULE(505, triangle_of_no_node, damaged_nif, "a triangle of the bvh belongs to no node")                   \
  RULE(506, slot_kind, damaged_nif, "a slot of the bvh is of no known kind")                                \
  RULE(507, slot_rank, damaged_nif, "a slot of the bvh has another rank")                                   \
  RULE(508, node_empty, damaged_nif, "a node of the bvh is empty")                                          \
  RULE(509, empty_slot, damaged_nif, "an empty slot of the bvh is not zero")                                \
  RULE(510, node_order, damaged_nif, "a node of the bvh does not name the next ones")                       \
  RULE(511, triangle_order, damaged_nif, "a node of the bvh does not name the next triangles")              \
  RULE(512, vertex_of_no_triangle, damaged_nif, "a node of the bvh names a vertex for no triangle")         \
  RULE(513, tree_deep, damaged_nif, "the bvh is too deep")                                                  \
  RULE(514, box_inside_out, damaged_nif, "a box of the bvh is inside out")                                  \
  RULE(515, box_outside, damaged_nif, "a box of the bvh reaches out of the one around it")                  \
  RULE(516, vertex_range, damaged_nif, "a triangle of the bvh names a vertex that is not there")            \
  RULE(517, vertex_outside, damaged_nif, "a vertex of the bvh lies outside of its box")                     \
  RULE(518, tree_far, damaged_nif, "the bvh reaches too far")                                               \
  RULE(519, grid_far, damaged_nif, "the grid reaches too far")                                              \
  RULE(520, tree_and_grid, damaged_nif, "the bvh is not where the grid is")                                 \
  RULE(601, inputs_range, damaged_nif, "inputs is out of range")                                            \
  RULE(602, width_range, damaged_nif, "width is out of range")                                              \
  RULE(603, width_multiple, damaged_nif, "width is no multiple of 4")                                       \
  RULE(604, hidden_layers_range, damaged_nif, "hidden_layers is out of range")                              \
  RULE(605, resolution_range, damaged_nif, "a grid's resolution is out of range")                           \
  RULE(606, latent_floats_range, damaged_nif, "a grid's number of features is out of range")                \
  RULE(607, latent_value, damaged_nif, "a latent vector is NaN or beyond +-4096")                           \
  RULE(608, weight_value, damaged_nif, "a weight is NaN or beyond +-4096")                                  \
  RULE(609, slope_range, damaged_nif, "slope is not a number from 0 to 1")                                  \
  RULE(610, half_range, damaged_nif, "whether values are halves is neither 0 nor 1")                        \
  RULE(611, bounds_to_compute, damaged_nif,                                                                 \
       "bounds of its object are too small or too large to compute with")                                   \
  RULE(701, optional_order, damaged_nif, "object does not come after that of the record before")            \
  RULE(702, margin_range, damaged_nif, "margin is not a number from 0 to 1")                                \
  RULE(703, no_triangles, damaged_nif, "its object has no triangles")                                       \
  RULE(705, triangle_number, damaged_nif, "a number is not below what its record says")                     \
  RULE(706, bits_after_numbers, damaged_nif, "bits after the last number are not zero")                     \
  RULE(707, no_voxels, damaged_nif, "its object has no voxels")                                             \
  RULE(708, color_count, damaged_nif, "surface_voxels is not that of its object")                           \
  RULE(711, numbers_order, damaged_nif, "does not come after the record before: by object, then by kind")   \
  RULE(750, alpha_map_size, damaged_nif, "width or height is out of range")                                 \
  RULE(751, alpha_wrap, damaged_nif, "wrap is out of range")                                                \
  RULE(752, alpha_tiles, damaged_nif, "the alpha maps of the file have more than 2^24 tiles together")      \
  RULE(753, patch_count, damaged_nif, "patches is out of range")                                            \
  RULE(754, patch_map, damaged_nif, "the alpha map of a patch is out of range")                             \
  RULE(755, patch_shift, damaged_nif, "the shift of a patch is out of range")                               \
  RULE(756, patch_number, damaged_nif, "the patch of a triangle is out of range")                           \
  RULE(757, skin_object, damaged_nif, "its object is not a BVH alone")                                      \
  RULE(758, skin_vertices, damaged_nif, "vertices is not what the source vertices of its object are below") \
  RULE(759, skin_joints, damaged_nif, "joints is out of range")                                             \
  RULE(760, skin_influences, damaged_nif, "influences is neither 4 nor 8, or does not go with joints")      \
  RULE(761, skin_weight, damaged_nif, "weights of a vertex are out of range, or do not add up to 1")        \
  RULE(762, skin_joint, damaged_nif, "a joint is out of range")                                             \
  RULE(763, skin_targets, damaged_nif, "morph targets are out of range")

enum class Rule : uint16_t {
#define NIF_RULE_NUMBER(number, name, status, what) name = number,
  NIF_FORMAT_RULES(NIF_RULE_NUMBER)
#undef NIF_RULE_NUMBER
};

struct RuleText {
  Rule rule;
  Status status;
  const char* name;  ///< as in the enum
  const char* what;
};
inline constexpr RuleText kRules[] = {
#define NIF_RULE_TEXT(number, name, status, what) {Rule::name, Status::status, #name, what},
    NIF_FORMAT_RULES(NIF_RULE_TEXT)
#undef NIF_RULE_TEXT
};

constexpr const RuleText& text_of(Rule rule) {
  const RuleText* text = kRules;
  while (text->rule != rule) ++text;
  return *text;
}

/// A file breaks a rule.
class Refusal : public Error {
 public:
  Refusal(Rule rule, std::string place, std::string what, const std::string& sentence)
      : Error(text_of(rule).status, sentence),
        rule_(rule),
        place_(std::move(place)),
        what_(std::move(what)) {}
  Rule rule() const { return rule_; }
  const std::string& place() const { return place_; }  ///< within the file; empty for the whole file
  const std::string& what_is_wrong() const { return what_; }

 private:
  Rule rule_;
  std::string place_, what_;
};

}  // namespace nif::format
