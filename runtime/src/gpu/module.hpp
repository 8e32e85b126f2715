// The interface between the runtime and its GPU module: a table of functions, which the runtime gets from a
// shared library that it loads on demand. Neither side links the other, and nothing here depends on CUDA or
// HIP.
//
// Both are built from the same sources: the runtime refuses a table with another version, or other layouts of
// the structures that are passed (crossing.hpp). Functions return NIF_OK, or a code after writing a sentence.
// They do not throw, and are thread-safe, except that of the calls for one scene only queries may overlap.
#pragma once

#include <cstdint>

#include "kernels/reference/hit_details.hpp"
#include "kernels/reference/reference_encodings.hpp"
#include "kernels/reference/scene_field.hpp"
#include "nif/nif.h"

namespace nif::runtime {

/// Increase it whenever this interface changes.
inline constexpr uint32_t kGpuModuleVersion = 9;
/// The module's only symbol: const GpuModule* nif_gpu_module(void).
inline constexpr const char* kGpuModuleSymbol = "nif_gpu_module";

/// One sentence, truncated if it is too long.
struct GpuMessage {
  char text[1024];
};

/// Identifies a GPU among those of the machine; zeros if its driver does not report it.
struct GpuLocation {
  uint32_t pci_domain, pci_bus, pci_device;
  uint32_t has_luid;
  uint8_t uuid[16], luid[8];
};

/// A GPU, usable or not.
struct GpuDescription {
  char backend[8];  ///< "cuda" or "hip"
  char name[256];
  char target[64];  ///< what its code is compiled for, e.g. "gfx1100"
  char driver[64];
  uint64_t memory;  ///< bytes
  GpuLocation place;
  GpuMessage trouble;  ///< why it cannot be used; "" if it can
};

/// Which kernels answer queries. Both ways give the same answers, except in half precision.
enum class GpuWay : uint32_t {
  automatic,   ///< the faster way, as measured
  one_kernel,  ///< always the one kernel
  pipeline     ///< the pipeline, if there is a network to evaluate
};

/// A device's GPU settings, from its configuration.
struct GpuSettings {
  GpuWay way;
  uint32_t half;  ///< use half precision for networks of `spherical` objects that fit; not with one_kernel
};

/// What measure_query() measures: a query as the device answers it, one of the ways, the pipeline's stages,
/// or `bvh` objects with triangles in single precision.
enum class GpuMeasure : uint32_t { query, one_kernel, pipeline, stages, single_bvh };
/// Traversal; sorting items; inputs, then networks, of `segment` and outer `spherical` items; the same of
/// inner ones; items that single threads process, and what is left to the one kernel.
inline constexpr uint32_t kMeasuredStages = 7;

struct GpuDevice;
struct GpuAsset;
struct GpuScene;
struct GpuJob;
struct GpuFetch;

/// An object of a scene; its asset is on the device.
struct GpuPlacedObject {
  const GpuAsset* asset;  ///< null: no instance names this object
  uint32_t object;        ///< of that asset
  uint32_t number;        ///< what hits say: that of the object in its file
};

struct GpuSceneView {
  const kernels::TopNode* nodes;
  const kernels::PlacedInstance* instances;  ///< place is kNoBox if no ray can meet the instance
  const uint64_t* users;                     ///< [as instances] the caller's values; null if all are 0
  const GpuPlacedObject* objects;
  uint64_t node_count, instance_count, object_count;
  uint32_t sole;          ///< the only instance that rays can meet, or kernels::kNoInstance
  uint32_t unproven = 0;  ///< 1: rays can meet an instance whose file proves nothing
};

/// An array in memory of the GPU that the CPU wants to read.
struct FetchedArray {
  const void* array;  ///< null: bytes is 0
  uint64_t bytes;
  const char* name;  ///< for messages
};

struct GpuModule {
  uint32_t version;  ///< kGpuModuleVersion
  uint64_t layout;   ///< kGpuLayout

  /// Returns how many GPUs there are. If there are none, the message says what is missing.
  uint32_t (*count_gpus)(GpuMessage* why_none);
  /// Requires GPU < count_gpus().
  NifError (*describe_gpu)(uint32_t gpu, GpuDescription* about, GpuMessage* message);

  NifError (*open_device)(uint32_t gpu, const GpuSettings* settings, GpuDevice** device, GpuMessage* message);
  /// Everything on the device must have been freed. Here and below, freeing null does nothing.
  void (*close_device)(GpuDevice* device);

  /// Copies objects to the device, with their details of hits (null: they have none). Objects that are not
  /// supported are empty `bvh` ones. *bytes receives the memory that they take there.
  NifError (*upload_asset)(GpuDevice* device, const kernels::AnyField* objects,
                           const kernels::HitDetails* details, uint32_t count, GpuAsset** asset,
                           uint64_t* bytes, GpuMessage* message);
  void (*free_asset)(GpuDevice* device, GpuAsset* asset);

  /// Copies a scene to the device. If *scene is not null, waits for its running queries and replaces it. If
  /// the call fails, *scene is unchanged, and must be uploaded again before the next query.
  NifError (*upload_scene)(GpuDevice* device, const GpuSceneView* view, GpuScene** scene,
                           GpuMessage* message);
  /// Waits for the scene's running queries.
  void (*free_scene)(GpuDevice* device, GpuScene* scene);

  /// Answers a query as nifQuery does. The caller has checked everything that does not need the driver.
  NifError (*query)(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
                    GpuMessage* message);
  /// Answers a query in device memory as nifQueryOpen does, likewise.
  NifError (*query_open)(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
                         const NifOpenRays* open, GpuMessage* message);
  /// Finds the first hits of rays in device memory as nifIntersect does, likewise.
  NifError (*intersect)(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifHits* hits,
                        GpuMessage* message);
  /// Checks the arrays, and the scratch, of a query in host memory that the CPU answers: none may be memory of
  /// a GPU alone. `open` and `hits` may be null.
  NifError (*check_host_query)(GpuDevice* device, const NifRays* rays, const NifAnswers* answers,
                               const NifOpenRays* open, const NifHits* hits, GpuMessage* message);
  /// Checks an array that the CPU reads, and that may be null. `name`: of the array, for the message.
  NifError (*check_host_array)(GpuDevice* device, const void* array, const char* name, GpuMessage* message);
  /// Puts copies of arrays to host memory into the stream, and does not wait, unless *fetch must grow while copies are
  /// under way. Makes *fetch if it is null; otherwise overwrites what it has. If the call fails when it has begun to
  /// overwrite, wait_fetch() fails, too.
  NifError (*fetch_arrays)(GpuDevice* device, const FetchedArray* arrays, uint32_t count, void* stream,
                           GpuFetch** fetch, GpuMessage* message);
  /// Waits for the last copies. *bytes receives where they are, one array right behind the other, until the next
  /// fetch_arrays().
  NifError (*wait_fetch)(GpuDevice* device, GpuFetch* fetch, const unsigned char** bytes,
                         GpuMessage* message);
  /// Waits for copies that are under way.
  void (*free_fetch)(GpuDevice* device, GpuFetch* fetch);
  /// Copies a query in host memory to the device, answers it once and then `rounds` times, and measures how
  /// long each round took on the device: seconds[rounds], or [rounds][kMeasuredStages] for stages.
  NifError (*measure_query)(GpuDevice* device, GpuScene* scene, const NifRays* rays,
                            const NifAnswers* answers, GpuMeasure measure, uint32_t rounds, double* seconds,
                            GpuMessage* message);
  /// Starts a query in device memory, for first hits if `hits` is not null. *job is done when the query is.
  NifError (*start_query)(GpuDevice* device, GpuScene* scene, const NifRays* rays, const NifAnswers* answers,
                          const NifHits* hits, GpuJob** job, GpuMessage* message);
  NifError (*wait_job)(GpuDevice* device, GpuJob* job, GpuMessage* message);
  NifError (*is_job_done)(GpuDevice* device, GpuJob* job, uint32_t* done, GpuMessage* message);
  /// Neither waits for the job nor stops it.
  void (*free_job)(GpuDevice* device, GpuJob* job);
};

}  // namespace nif::runtime
