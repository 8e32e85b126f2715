// Coded payloads are decoded first, then checked like uncoded ones: a decoder is not trusted. Words come
// before sides. What planes prove is worked out again, and a file may claim no more than that.
#include "formats/nif/proof/read.hpp"

#include "formats/nif/proof/check.hpp"
#include "formats/nif/proof/coded_cells.hpp"
#include "formats/nif/proof/encoding.hpp"

namespace nif::format {
namespace {

/// Of the field, voxels, bricks and mixed_bricks are asked.
bool decode_occupancy(Bytes coded, Corners corners, const kernels::ProofField& field, std::byte* to) {
  RangeDecoder decoder(coded);
  const OccupancyArrays<std::byte> arrays(to, field.mixed_bricks, corners != Corners::none);
  return OccupancyCoder(decoder, field, arrays).code(nullptr, corners) && decoder.complete();
}

/// Of the field, the occupancy, levels, surface_voxels and part_count are asked. Where kinds are not stated,
/// they only say which cells separate: see proven_kind().
bool decode_cells(Bytes coded, bool kinds_stated, const kernels::ProofField& field, uint32_t* to) {
  RangeDecoder decoder(coded);
  return CellCoder(decoder, field, to).code(nullptr, kinds_stated) && decoder.complete();
}

/// Gives decoded words the kinds that say all that is proven. Where a file states kinds, some must say less.
void complete_kinds(const SideRegions& sides, bool stated, std::span<uint32_t> words, const Place& place) {
  bool same = true;
  for (uint32_t i = 0; i < words.size(); ++i) {
    const uint32_t kind = kernels::word_kind(words[i]);
    if (kind == kernels::kLink) continue;
    const uint32_t proven = proven_kind(sides, i, separates(kind));
    same = same && kind == proven;
    if (stated) continue;
    place.require(proven < kernels::kPlaneKinds, Rule::sides_not_separate);
    words[i] = (words[i] & ~15u) | proven;
  }
  place.require(!stated || !same, Rule::kinds_follow);
}

}  // namespace

Bytes take_payload(Payloads& payloads, const Payload& payload, uint32_t forms, PayloadForm form,
                   uint64_t bytes, const char* name, const Place& place) {
  const bool coded = (forms & form) != 0;
  if (coded && payload.bytes >= bytes)
    place.damaged(Rule::coded_no_smaller, std::string(name) + " payload is coded, but no smaller for it");
  return payloads.next(payload, coded ? payload.bytes : bytes, name, place);
}

OccupancyArrays<const std::byte> read_occupancy(Bytes payload, Corners corners, uint64_t bytes,
                                                const PayloadPlace& at, PayloadBytes& taken,
                                                kernels::ProofField& field) {
  const std::byte* usable =
      at.usable(payload, kCodedOccupancy, bytes, "occupancy", taken,
                [&](std::byte* to) { return decode_occupancy(payload, corners, field, to); });
  const OccupancyArrays<const std::byte> arrays(usable, field.mixed_bricks, corners != Corners::none);
  field.brick_states = arrays.brick_states;
  field.voxel_base = arrays.voxel_base;
  field.brick_table = arrays.brick_table;
  if (const auto fault = fault_of_bricks(field)) at.place.damaged(*fault);
  return arrays;
}

void read_cells(Bytes payload, const PayloadPlace& at, PayloadBytes& taken, kernels::ProofField& field) {
  const bool coded = (at.forms & kCodedCells) != 0, stated = (at.forms & kStatedKinds) != 0;
  uint32_t* words = nullptr;
  const std::byte* usable =
      at.usable(payload, kCodedCells, UncodedGrid(field).cells, "cells", taken, [&](std::byte* to) {
        words = reinterpret_cast<uint32_t*>(to);
        return decode_cells(payload, stated, field, words);
      });
  field.voxel_records = reinterpret_cast<const uint32_t*>(usable);
  field.parts = field.voxel_records + field.surface_voxels;
  if (const auto fault = fault_of_words(field)) at.place.damaged(*fault);
  const SideRegions sides(field);
  if (coded)
    complete_kinds(sides, stated, {words, size_t{field.surface_voxels} + field.part_count}, at.place);
  if (const auto fault = fault_of_sides(field, sides)) at.place.damaged(*fault);
}

ProofReader::ProofReader(const SectionTable& sections, std::string_view file, ProofSharedView& shared)
    : file_(file),
      shared_(shared),
      records_(sections[kProofRecords], "PROF", file),
      occupancy_(sections[kProofOccupancy]),
      cells_(sections[kProofCells]) {}

ProofView ProofReader::read(uint32_t index, const Bounds&) {
  const ProofRecord record = records_[index];
  const Place place{file_, "PROF", index};
  ProofView view;
  const GridReading grid(record, occupancy_, cells_, place, view.field);
  view.coded = grid.coded();
  grid.read(shared_.decoded_proofs, view.occupancy, view.cells);
  return view;
}

void ProofReader::finish() const {
  occupancy_.finish("POCC", file_);
  cells_.finish("PCEL", file_);
}

}  // namespace nif::format
