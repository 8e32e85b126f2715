// What the runtime asks of its GPU module: a table of functions, which it gets from a shared library that is
// loaded on demand. Neither side links the other, and nothing of CUDA or HIP stands here.
//
// Both are made of one source tree at one time: the table is refused where its version, or the layout of what
// is passed through it, is another (crossing.hpp). Functions return NIF_OK, or a code, and then have written
// a sentence; they throw nothing and are thread-safe, but for calls that concern one scene, of which only
// queries may overlap.
#pragma once

#include <cstdint>

#include "kernels/reference/encodings.hpp"
#include "kernels/reference/hit_details.hpp"
#include "kernels/reference/scene_field.hpp"
#include "nif/nif.h"

namespace nif::runtime {

/// Changes with anything in this file.
inline constexpr uint32_t kGpuModuleVersion = 6;
/// The module's only symbol: const GpuModule* nif_gpu_module(void).
inline constexpr const char* kGpuModuleSymbol = "nif_gpu_module";

/// One sentence, cut where it is longer.
struct GpuMessage {
  char text[1024];
};

/// What tells a card from the others of the machine; zeros where its driver does not say.
struct GpuCardPlace {
  uint32_t pci_domain, pci_bus, pci_device;
  uint32_t has_luid;
  uint8_t uuid[16], luid[8];
};

/// A card, whether it can be used or not.
struct GpuCard {
  char backend[8];  ///< "cuda" or "hip"
  char name[256];
  char target[64];  ///< what code is made for, e.g. "gfx1100"
  char driver[64];
  uint64_t memory;  ///< bytes
  GpuCardPlace place;
  GpuMessage trouble;  ///< why it cannot be used; "" where it can
};

/// By which kernels queries are answered. Both ways give the same answers, but for half precision.
enum class GpuWay : uint32_t {
  automatic,   ///< the faster one, by measuring
  one_kernel,  ///< and nothing else
  pipeline     ///< where there is a network to ask
};

/// A device's, from its configuration.
struct GpuSettings {
  GpuWay way;
  uint32_t half;  ///< `spherical` objects are asked in half precision, where it fits; not with one_kernel
};

/// What measure_query() measures: a query as the device answers it, by one way, the pipeline's stages, or
/// `bvh` objects by triangles in single precision.
enum class GpuMeasure : uint32_t { query, one_kernel, pipeline, stages, single_bvh };
/// Walk; putting items in order; inputs and networks of `segment` and outer `spherical` items; those of inner
/// ones; threads alone with their items, and whatever the one kernel is left with.
inline constexpr uint32_t kMeasuredStages = 7;

struct GpuDevice;
struct GpuAsset;
struct GpuScene;
struct GpuJob;

/// An object of a scene: of an asset that is on the device.
struct GpuPlacedObject {
  const GpuAsset* asset;
  uint32_t object;
};

struct GpuSceneView {
  const kernels::TopNode* nodes;
  const kernels::PlacedInstance* instances;  ///< of those that no ray can meet, place is kNoPlace
  const uint64_t* users;                     ///< [as instances] the caller's values, or null: all 0
  const GpuPlacedObject* objects;
  uint64_t node_count, instance_count, object_count;
  uint32_t sole;  ///< the only instance that rays can meet, or kernels::kNoInstance
};

struct GpuModule {
  uint32_t version;  ///< kGpuModuleVersion
  uint64_t layout;   ///< kGpuLayout

  /// How many cards there are. Where there are none, the message says what is missing.
  uint32_t (*count_cards)(GpuMessage* why_none);
  /// card < count_cards().
  NifError (*describe_card)(uint32_t card, GpuCard* about, GpuMessage* message);

  NifError (*open_device)(uint32_t card, const GpuSettings* settings, GpuDevice** device,
                          GpuMessage* message);
  /// Everything of the device must have been freed. Here and below, freeing null does nothing.
  void (*close_device)(GpuDevice* device);

  /// Copies objects to the device, with what is told of hits with them (null: nothing but the hits); *bytes
  /// receives what they take there.
  NifError (*upload_asset)(GpuDevice* device, const kernels::AnyField* objects,
                           const kernels::HitDetails* details, uint32_t count, GpuAsset** asset,
                           uint64_t* bytes, GpuMessage* message);
  void (*free_asset)(GpuDevice* device, GpuAsset* asset);

  /// Copies a scene to the device, or copies it anew where *scene is not null, after its queries that are
  /// under way. Where it fails, *scene stays what it was, and must be uploaded before it is asked again.
  NifError (*upload_scene)(GpuDevice* device, const GpuSceneView* view, GpuScene** scene,
                           GpuMessage* message);
  /// Waits for the scene's queries that are under way.
  void (*free_scene)(GpuDevice* device, GpuScene* scene);

  /// Answers a query as nifQuery does; it has been checked but for what only the driver can tell.
  NifError (*query)(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
                    GpuMessage* message);
  /// Answers a query of device memory as nifQueryOpen does, likewise.
  NifError (*query_open)(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
                         const NifOpenRays* open, GpuMessage* message);
  /// Finds the first hits of rays in device memory as nifIntersect does, likewise.
  NifError (*intersect)(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifHits* hits,
                        GpuMessage* message);
  /// Answers a query of host memory from memory of the device, once and then `rounds` times, and tells how
  /// long each of those took there: seconds[rounds], or [rounds][kMeasuredStages] of stages.
  NifError (*measure_query)(GpuDevice* device, GpuScene* scene, const NifRays* rays,
                            const NifAnswers* answers, GpuMeasure measure, uint32_t rounds, double* seconds,
                            GpuMessage* message);
  /// Answers a query of device memory, or finds its first hits where `hits` is not null; *job is done when
  /// that is.
  NifError (*start_query)(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
                          const NifHits* hits, GpuJob** job, GpuMessage* message);
  NifError (*wait_job)(GpuDevice* device, GpuJob* job, GpuMessage* message);
  NifError (*is_job_done)(GpuDevice* device, GpuJob* job, uint32_t* done, GpuMessage* message);
  /// Neither waits for it nor ends it.
  void (*free_job)(GpuDevice* device, GpuJob* job);
};

}  // namespace nif::runtime
