/* nif.h: ask loaded .nif assets whether segments are blocked. C99; nif.hpp is the same for C++20.
 *
 *   NifDevice device;  NifAsset asset;  NifScene scene;
 *   nifNewDevice(NULL, NULL, &device);
 *   nifLoadAssetFile(device, "dragon.nif", NIF_LOAD_READ, &asset);
 *   nifNewScene(device, &scene);
 *   nifAddAsset(scene, asset, NULL, NULL, NULL);
 *   nifCommitScene(scene);
 *
 *   NifQuery query = nifQueryRays(rays, count);      // NifRay rays[count]
 *   query.visible = visible;                         // uint8_t visible[count]: 1 visible, 0 occluded
 *   if (nifQuery(scene, &query) != NIF_OK) puts(nifGetErrorMessage());
 *
 *   nifReleaseScene(scene);  nifReleaseAsset(asset);  nifReleaseDevice(device);
 *
 * For every function, unless it says otherwise:
 * - It returns NIF_OK, or a code; nifGetErrorMessage() then holds one sentence. After a failure nothing has
 *   changed and outputs are as they were, except for output arrays of a query.
 * - Handles and pointers must not be null where no meaning of null is given; where one is, the call returns
 *   NIF_ERROR_INVALID_ARGUMENT. So it does for a handle whose last reference was released, or that never was
 *   one: handles are numbers that are not used again. (That is for mistakes in a row. A release of the last
 *   reference must not overlap with another call with that handle.)
 * - Thread-safe: calls on different scenes may run at the same time, and so may calls on one device or one
 *   asset. Calls that change a scene (nifAdd..., nifSet..., nifCommitScene) must not overlap with any other
 *   call on the same scene. Any number of threads may query one committed scene.
 * - It may allocate, through the device's allocator. Queries never allocate, but for the job of
 *   nifQueryAsync, and on a GPU (see there). (Of the system's memory are threads, error messages, handles
 *   beyond 1,024 at once, and what the GPU module needs on the host.)
 * - Pointers handed out belong to nifkit and live as long as the object that they were asked of.
 * - The caller's floating-point environment (rounding, flushing of denormals, exception flags) has no
 *   influence on any result and is left as it was.
 *
 * Structures start with struct_size, which the caller sets to sizeof(the structure): programs compiled with
 * an older header go on working with a newer library. In a structure that is passed in, members that are not
 * needed are zero: NifQuery query = {.struct_size = sizeof(query)}; sees to it. */
#ifndef NIF_NIF_H
#define NIF_NIF_H

#include <stdint.h>
#include <string.h>

/* Version of this header. Until 1.0.0 a new minor version may change calls; afterwards only a major one. */
#define NIF_VERSION_MAJOR 0
#define NIF_VERSION_MINOR 1
#define NIF_VERSION_PATCH 0
#define NIF_VERSION (NIF_VERSION_MAJOR * 10000 + NIF_VERSION_MINOR * 100 + NIF_VERSION_PATCH)

#if defined(_WIN32)
#define NIF_API
#else
#define NIF_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Errors ------------------------------------------------------------------------------------------ */

/* The numbers never change. Those of files are the exit codes of the program `nif`. */
typedef enum NifError {
  NIF_OK = 0,
  NIF_ERROR_UNKNOWN = 1,           /* a defect of nifkit */
  NIF_ERROR_INVALID_ARGUMENT = 2,  /* null, out of range, not finite, misaligned */
  NIF_ERROR_INVALID_OPERATION = 3, /* not now, e.g. a query of a scene that is not committed */
  NIF_ERROR_OUT_OF_MEMORY = 4,
  NIF_ERROR_NOT_AVAILABLE = 5, /* this build or this machine has it not; the message says which */
  NIF_ERROR_CANCELLED = 6,
  NIF_ERROR_SINGULAR_TRANSFORM = 7, /* a transform that flattens space has no inverse */

  NIF_ERROR_FILE_NOT_FOUND = 10,
  NIF_ERROR_FILE_UNREADABLE = 11, /* permission, a folder, an I/O error */
  NIF_ERROR_FILE_EMPTY = 12,
  NIF_ERROR_FILE_TRUNCATED = 13, /* ends before its own header says it does */
  NIF_ERROR_NOT_A_NIF = 30,
  NIF_ERROR_FOREIGN_NIF = 31,     /* a NetImmerse/Gamebryo model, which shares the extension */
  NIF_ERROR_DAMAGED_NIF = 32,     /* wrong checksum or structure */
  NIF_ERROR_UNSUPPORTED_NIF = 33, /* newer than this library */

  NIF_ERROR_DEVICE_LOST = 60, /* GPU backends only, as the next two */
  NIF_ERROR_OUT_OF_DEVICE_MEMORY = 61,
  NIF_ERROR_WRONG_POINTER = 62, /* host memory where device memory was promised, or the reverse */

  NIF_ERROR_ENUM_IS_32_BITS = 0x7fffffff
} NifError;

/* Version of the library, as NIF_VERSION. Allocates nothing; cannot fail. */
NIF_API uint32_t nifGetVersion(void);

/* One sentence about the latest call on this thread that failed; "" where none did. Needs no device. It stays
 * valid and unchanged until the next failing call on this thread. It names the file, or "memory" where an
 * asset came from there. Allocates nothing; cannot fail. */
NIF_API const char* nifGetErrorMessage(void);

/* The name of a code, e.g. "NIF_ERROR_FILE_NOT_FOUND". Allocates nothing; cannot fail. */
NIF_API const char* nifGetErrorName(NifError error);

/* ---- Device ------------------------------------------------------------------------------------------ */

/* Handles are opaque and reference-counted: nifNew... and nifLoad... give one reference, nifRetain... adds
 * one, nifRelease... gives one back and destroys the object with the last. Objects keep what they use alive:
 * a scene its assets, both their device. Retaining or releasing null, or a handle whose last reference was
 * released, does nothing. */
typedef struct NifDeviceHandle* NifDevice;
typedef struct NifAssetHandle* NifAsset;
typedef struct NifSceneHandle* NifScene;

/* Part of a query, given to the caller's task runner. */
typedef void (*NifTask)(void* argument, uint64_t index);

/* What a program may bring itself. Null members mean nifkit's own. Callbacks may be called from any thread
 * that calls nifkit and from the device's own, at the same time, until the device is destroyed; they must not
 * throw or call nifkit. */
typedef struct NifDeviceCallbacks {
  uint64_t struct_size;
  void* user; /* passed to each callback */

  /* Memory of `bytes` > 0 at an address that is a multiple of `alignment` (a power of 2, at most 64); null
   * where there is none. Both members or neither. deallocate is given what allocate was asked for. */
  void* (*allocate)(void* user, uint64_t bytes, uint64_t alignment);
  void (*deallocate)(void* user, void* memory, uint64_t bytes, uint64_t alignment);

  /* The caller's task runner, in place of threads of the device's own. Calls task(argument, i) once for each
   * i in 0 .. count - 1, on any threads, in any order, now or later, and may return before they have run;
   * count is less than the device's threads, or as many for nifQueryAsync. No query waits for a task that has
   * not begun: tasks that begin too late find nothing to do. But each must be run at some time, because the
   * device lives until then. Tasks need stack as nifQuery. */
  void (*submit)(void* user, NifTask task, void* argument, uint64_t count);
} NifDeviceCallbacks;

/* Creates a device. `config` is null or text such as "threads=2,isa=avx2,backend=cpu":
 *   threads=N   at most N threads for one query, 0 for all that the machine has (default 1): the calling
 *               thread and N - 1 that the device starts here and ends when it is destroyed, or tasks of
 *               `submit`. Batches of fewer than 2,048 rays stay on the calling thread. Answers are the same
 *               bits with any number.
 *   queries=N   so many queries can run at the same time without scratch of their own; more wait for one
 *               of these to end. The device keeps nifGetQueryScratchBytes for each; with the system's
 *               allocator only what is used takes memory. 0 for the machine's threads (default); never less
 *               than threads.
 *   isa=NAME    auto (default): the best that this build and this machine have. scalar, sse4, avx2, avx512
 *               (both with VNNI where there is), neon (64-bit ARM). Answers are the same bits with each.
 *   backend=NAME  cpu (default), or hip: a GPU of AMD's or NVIDIA's, by a module that is loaded now.
 *   device=N    with backend=hip: the card, as nifGetCardInfo counts them (default 0).
 *   module=PATH with backend=hip: the module's file. By default the one that the environment variable
 *               NIF_HIP_MODULE names; else libnif_hip.so beside this library or the program that it is a
 *               part of, in the folder for libraries beside that, or where the system looks for libraries.
 *   pipeline=NAME with backend=hip: how queries are answered. off: by one kernel. on: by the pipeline, which
 *               lists what networks have to be asked and runs them by matrix instructions; it takes memory of
 *               the GPU for up to 2^20 rays of each query that is under way. auto (default): the faster of
 *               both, which the first queries of each size are measured for; where there is no memory for
 *               the pipeline, by one kernel. Answers are the same bits with each.
 *   precision=NAME with backend=hip: single (default), or half: networks of `spherical` objects are evaluated
 *               in half precision, by the pipeline, where a network is not too wide. Answers then differ from
 *               those of the CPU and of other GPUs, by little (docs/model.md), and queries that the CPU
 *               answers (nifQueryRay, a fallback) stay in single precision. Not with pipeline=off.
 * What is not there gives NIF_ERROR_NOT_AVAILABLE, what is not in this list NIF_ERROR_INVALID_ARGUMENT.
 * `callbacks` may be null; they are copied. */
NIF_API NifError nifNewDevice(const char* config, const NifDeviceCallbacks* callbacks, NifDevice* device);
NIF_API void nifRetainDevice(NifDevice device);
NIF_API void nifReleaseDevice(NifDevice device);

typedef struct NifDeviceInfo {
  uint64_t struct_size;
  uint32_t threads; /* that one query uses at most */
  uint32_t reserved;
  const char* isa;     /* in use, e.g. "avx512" */
  const char* backend; /* "cpu" or "hip" */
  const char* card;    /* the GPU's name; "" for the CPU */
} NifDeviceInfo;

/* Allocates nothing. */
NIF_API NifError nifGetDeviceInfo(NifDevice device, NifDeviceInfo* info);

typedef struct NifBackendInfo {
  uint64_t struct_size;
  const char* name;   /* as in backend=NAME */
  uint32_t available; /* 0 or 1 */
  uint32_t reserved;
  const char* reason; /* why it is not available, as one sentence; "" where it is */
} NifBackendInfo;

/* The backends that this version knows, for index = 0, 1, ... NIF_ERROR_INVALID_ARGUMENT beyond the last.
 * Needs no device. For "hip" it loads the GPU module and the drivers, and looks for cards, anew each time;
 * the reason is that no module, no driver, or no card is there, that a driver is too old, or that the module
 * has no code for the cards. It stays until the next call of this function on this thread. */
NIF_API NifError nifGetBackendInfo(uint32_t index, NifBackendInfo* info);

typedef struct NifCardInfo {
  uint64_t struct_size;
  const char* name;
  const char* target; /* what code is made for, e.g. "gfx1100" or "sm_90" */
  const char* driver; /* e.g. "CUDA 13.0" */
  uint64_t memory_bytes;
  uint32_t available; /* 0 or 1 */
  uint32_t reserved;
  const char* reason; /* why it cannot be used, as one sentence; "" where it can */
} NifCardInfo;

/* The GPUs of backend=hip, for card = 0, 1, ... as in device=N. NIF_ERROR_INVALID_ARGUMENT beyond the last,
 * NIF_ERROR_NOT_AVAILABLE where there are none. Needs no device; looks anew each time. The texts stay until
 * the next call of this function on this thread. */
NIF_API NifError nifGetCardInfo(uint32_t card, NifCardInfo* info);

/* ---- Assets ------------------------------------------------------------------------------------------ */

typedef enum NifLoadMode {
  NIF_LOAD_READ = 0, /* the file is read into memory and closed */
  NIF_LOAD_MAP = 1,  /* the file is mapped; nobody may change or shorten it while the asset lives */
  NIF_LOAD_MODE_IS_32_BITS = 0x7fffffff
} NifLoadMode;

typedef enum NifMemoryMode {
  NIF_MEMORY_COPY = 0,   /* the bytes are copied; the caller may free them at once */
  NIF_MEMORY_BORROW = 1, /* used in place: they stay where they are, unchanged, until the asset is destroyed,
                            and start at a multiple of NIF_ASSET_ALIGNMENT */
  NIF_MEMORY_MODE_IS_32_BITS = 0x7fffffff
} NifMemoryMode;

#define NIF_ASSET_ALIGNMENT 64 /* bytes */

/* Loads a .nif file. `path` is 0-terminated, in the system's encoding. Safe on untrusted files: every byte is
 * covered by a checksum and every table is checked; memory taken is at most a small multiple of the file's
 * size. (NIF_LOAD_MAP: as long as nobody changes the file meanwhile.) */
NIF_API NifError nifLoadAssetFile(NifDevice device, const char* path, NifLoadMode mode, NifAsset* asset);

/* The same from `size` bytes in memory, which hold one whole .nif file. Safe on untrusted bytes. With
 * NIF_MEMORY_COPY `bytes` may have any alignment. */
NIF_API NifError nifLoadAssetMemory(NifDevice device, const void* bytes, uint64_t size, NifMemoryMode mode,
                                    NifAsset* asset);
NIF_API void nifRetainAsset(NifAsset asset);
NIF_API void nifReleaseAsset(NifAsset asset);

typedef struct NifAssetInfo {
  uint64_t struct_size;
  uint32_t object_count;   /* at least 1 */
  uint32_t instance_count; /* placements that the file states; may be 0 */
  uint32_t network_count;  /* objects may share networks */
  uint32_t format_version;
  uint64_t file_bytes;
  uint64_t
      resident_bytes;   /* everything that the library keeps for this asset, tables made at load included, and
                           the file's bytes, borrowed and mapped ones too, unless these tables replace them */
  const char* metadata; /* JSON, UTF-8, [metadata_bytes], not terminated; null where there is none */
  uint64_t metadata_bytes;
  uint64_t gpu_bytes; /* memory of the GPU that it takes: 0 until a scene with it is committed there */
} NifAssetInfo;

/* Allocates nothing. */
NIF_API NifError nifGetAssetInfo(NifAsset asset, NifAssetInfo* info);

typedef struct NifObjectInfo {
  uint64_t struct_size;
  const char* name;    /* UTF-8, 0-terminated, may be "" */
  uint32_t encoding;   /* 1: segment, 2: spherical, 3: bvh */
  uint32_t network;    /* 0 .. network_count - 1; of no meaning for a bvh, which has none */
  float bounds_min[3]; /* of the source mesh, in object space */
  float bounds_max[3];
  float bias;         /* how far from the surface to start shadow rays, in object units */
  uint32_t triangles; /* of the source mesh */
  uint64_t
      resident_bytes; /* the object's own data: occupancy and features, grids, BVH, and tables made at load */
} NifObjectInfo;

/* object = 0 .. object_count - 1. Allocates nothing. */
NIF_API NifError nifGetObjectInfo(NifAsset asset, uint32_t object, NifObjectInfo* info);

typedef struct NifInstanceInfo {
  uint64_t struct_size;
  const char* name; /* UTF-8, 0-terminated, may be "" */
  uint32_t object;  /* 0 .. object_count - 1 */
  uint32_t reserved;
  float transform[12]; /* object to asset space, as in nifAddInstance */
} NifInstanceInfo;

/* instance = 0 .. instance_count - 1. Allocates nothing. */
NIF_API NifError nifGetInstanceInfo(NifAsset asset, uint32_t instance, NifInstanceInfo* info);

/* ---- Scenes ------------------------------------------------------------------------------------------ */

/* A scene is a list of instances, each an object of an asset with a transform. Build it, commit it, query it;
 * after a change, commit it again. An empty scene can be committed: everything is visible in it. */
NIF_API NifError nifNewScene(NifDevice device, NifScene* scene);
NIF_API void nifRetainScene(NifScene scene);
NIF_API void nifReleaseScene(NifScene scene);

/* Places one object. `transform` maps object to world space: [12], row-major 3x4, world_x = t[0] x + t[1] y +
 * t[2] z + t[3] and so on; it may scale non-uniformly and mirror. Null: identity. Not finite:
 * NIF_ERROR_INVALID_ARGUMENT; no inverse in single precision: NIF_ERROR_SINGULAR_TRANSFORM. The asset must
 * be of the scene's device. `instance` (may be null) receives the number by which to change it later; numbers
 * count up from 0. */
NIF_API NifError nifAddInstance(NifScene scene, NifAsset asset, uint32_t object, const float* transform,
                                uint32_t* instance);

/* Places a whole asset: each instance that its file states, transformed by `transform` (as above) after its
 * own; an asset without instances has each object placed once. They are numbered from *first on, *count of
 * them (either may be null). */
NIF_API NifError nifAddAsset(NifScene scene, NifAsset asset, const float* transform, uint32_t* first,
                             uint32_t* count);

/* Moves one instance. `transform` as in nifAddInstance. Allocates nothing. */
NIF_API NifError nifSetInstanceTransform(NifScene scene, uint32_t instance, const float* transform);

/* Makes the changes since the last commit ready for queries. Where only transforms have changed, the
 * hierarchy over the instances is refitted, unless that has made it much worse; else it is built anew: n log
 * n for n instances, some 5 ms for 10,000. Does nothing where nothing has changed.
 *
 * On a GPU the scene is then copied there, and with it those of its assets that are not there yet: an asset
 * is copied once for all scenes and stays until it is destroyed. The call waits for the scene's own queries
 * that the GPU is still at, and for its copies; so does the release of a scene's last reference. Where the
 * GPU's part fails (NIF_ERROR_OUT_OF_DEVICE_MEMORY, NIF_ERROR_DEVICE_LOST), the scene is committed for the
 * CPU, which answers queries of host memory; committing again tries the GPU again. */
NIF_API NifError nifCommitScene(NifScene scene);

typedef struct NifSceneInfo {
  uint64_t struct_size;
  uint32_t instance_count;
  uint32_t committed; /* 0 where the scene has changed since its last commit, else 1 */
  /* World box of the last commit around everything that may block a ray: the objects' grids and a margin of
   * 1/8 voxel, a little more than their bounds. min > max: there is nothing. */
  float bounds_min[3];
  float bounds_max[3];
  uint64_t resident_bytes; /* of the scene itself, without the assets; after a commit at most 128 for each
                              instance and some for each object */
} NifSceneInfo;

/* Allocates nothing. */
NIF_API NifError nifGetSceneInfo(NifScene scene, NifSceneInfo* info);

/* ---- Queries ----------------------------------------------------------------------------------------- */

/* A query asks, of each ray, whether the points origin + t direction with tmin <= t <= tmax meet anything.
 * The direction may have any length but zero. A ray that is none has an answer all the same: visible, and
 * certain only where tmin > tmax (it has no points). That is so where a number is NaN, where an origin or
 * direction is infinite, where the direction is zero, or smaller or larger than can be computed with (its
 * largest component, in world space or in voxels of an object, outside of 2^-60 .. 2^60). tmin and tmax may
 * be infinite: -INFINITY .. INFINITY is the whole line. */

/* One ray, for programs that have no layout of their own. */
typedef struct NifRay {
  float origin[3];
  float tmin;
  float direction[3];
  float tmax;
} NifRay;

typedef enum NifMemory {
  NIF_HOST = 0,
  NIF_DEVICE = 1, /* the GPU can read and write all arrays of the query; GPU backends only */
  NIF_MEMORY_IS_32_BITS = 0x7fffffff
} NifMemory;

/* A batch of rays, and where the answers go.
 *
 * Inputs are described component by component, so that one description serves every layout: the value for ray
 * i is at (const char*)pointer + i * stride. Arrays of structures: point at the first structure's members,
 * the stride is the structure's size. Structures of arrays: the stride is sizeof(float). The same value for
 * all (a sun's direction, one tmin): stride 0. No alignment is needed, not even of a float.
 *
 * Outputs are dense arrays, each of which may be null, but not all; the answers do not depend on which are
 * asked for. They need no alignment, and may overlap neither each other nor the inputs. */
typedef struct NifQuery {
  uint64_t struct_size;
  uint64_t count; /* rays; 0 is fine and reads and writes nothing */

  const float* origin[3]; /* x, y, z */
  uint64_t origin_stride; /* bytes, as all strides */
  const float* direction[3];
  uint64_t direction_stride;
  const float* tmin; /* null: 0 for every ray */
  uint64_t tmin_stride;
  const float* tmax; /* null: +infinity for every ray */
  uint64_t tmax_stride;

  /* [count] 1 visible, 0 occluded. Occluded as soon as one instance says so; where nothing else is asked for,
   * the other instances are then not asked any more. */
  uint8_t* visible;
  /* [(count + 7) / 8] The same as bits: ray i is bit i % 8 (from the lowest) of byte i / 8; the last byte's
   * other bits are 0. */
  uint8_t* visible_bits;
  /* [count] Calibrated probability that the ray is visible: exactly 0 or 1 where certain; the product over
   * the instances. The last bits may differ between machines. (The other outputs never do.) */
  float* probability;
  /* [count] 1 where the answer is proven and not learned: occluded for certain where one instance is, visible
   * for certain where all are. Rays that start too far from an object, or meet it through a transform too
   * skewed, for single precision to prove anything are not certain. In a scene of several instances, rays
   * that miss an instance's box are visible for certain as far as that instance goes, however far away. */
  uint8_t* certain;
  /* [count] The smallest of the instances' network outputs, below 0 where occluded. NIF_LOGIT_CERTAIN where
   * every instance was decided without its network, -NIF_LOGIT_CERTAIN where one was decided to be blocking.
   * Networks of different objects may have different scales. */
  int32_t* logit;

  NifMemory memory; /* where the arrays are */
  uint32_t reserved;
  /* Memory for the calling thread to work in (other threads of the device use their own), of at least
   * nifGetQueryScratchBytes bytes, aligned to 64; free for other use afterwards. Null: the device's, see
   * queries=N. */
  void* scratch;
  uint64_t scratch_bytes;
  void* stream; /* hipStream_t or cudaStream_t to run on, null: the default stream; null on the CPU */
} NifQuery;

#define NIF_LOGIT_CERTAIN 0x7fffffff

/* How much scratch a query of `count` rays needs: on the CPU the same for any count but 0, less than a
 * megabyte. A GPU needs none and leaves it alone. Allocates nothing. */
NIF_API NifError nifGetQueryScratchBytes(NifScene scene, uint64_t count, uint64_t* bytes);

/* Answers a batch. Returns when the answers are there, but for device memory: see below. Any number of
 * threads may query one committed scene. Allocates nothing; needs at most 16 kB of stack, with scratch or
 * without. Any bits in the rays are safe; pointers and strides are trusted. An uncommitted scene gives
 * NIF_ERROR_INVALID_OPERATION; device memory or a stream without a GPU backend NIF_ERROR_NOT_AVAILABLE.
 *
 * On a GPU: with NIF_DEVICE the query is put into the stream and nothing is waited for; arrays and scene stay
 * as they are until the stream has come past it. With NIF_HOST rays and answers are copied, in the stream
 * where one is given, and the call returns when the answers are there; it allocates memory to copy by, which
 * the device keeps. The first array's element tells where an array is: memory of the wrong kind, or of
 * another card, gives NIF_ERROR_WRONG_POINTER (managed memory is right for both); a stream of another card
 * NIF_ERROR_INVALID_ARGUMENT, where the driver can tell. NIF_ERROR_DEVICE_LOST may stand for what an earlier
 * query has met. After that the CPU answers queries of host memory, as it does where a scene is not on the
 * GPU; to use the card again takes a new device, and with most drivers a new process. */
NIF_API NifError nifQuery(NifScene scene, const NifQuery* query);

/* One ray: *visible receives 1 or 0. Always answered by the CPU. As nifQuery in all else. */
NIF_API NifError nifQueryRay(NifScene scene, const NifRay* ray, uint8_t* visible);

/* A description of rays[count], without outputs. Null where count is 0. */
static inline NifQuery nifQueryRays(const NifRay* rays, uint64_t count) {
  NifQuery query;
  int axis;
  memset(&query, 0, sizeof(query));
  query.struct_size = sizeof(query);
  if (count == 0) return query;
  query.count = count;
  for (axis = 0; axis < 3; ++axis) {
    query.origin[axis] = &rays->origin[axis];
    query.direction[axis] = &rays->direction[axis];
  }
  query.tmin = &rays->tmin;
  query.tmax = &rays->tmax;
  query.origin_stride = query.direction_stride = query.tmin_stride = query.tmax_stride = sizeof(NifRay);
  return query;
}

/* ---- Exact answers for uncertain rays ---------------------------------------------------------------- */

/* Exact answers, e.g. by a triangle BVH: sets visible[k] to 1 or 0 for ray rays[k] of the query, k = 0 ..
 * count - 1; count is 1 to 1024, rays ascend. On entry visible[k] is the learned answer. Runs on every thread
 * that works on the query, at the same time where there are several, in the default floating-point
 * environment. It must not throw or query on the same device, and needs what stack it needs besides
 * nifQuery's. */
typedef void (*NifFallback)(void* user, uint64_t count, const uint64_t* rays, uint8_t* visible);

/* As nifQuery, and hands the rays that are neither certain nor have a probability p with max(p, 1 - p) >=
 * confidence to the fallback, in batches. Its answers replace the learned ones in all outputs, as certain
 * ones: probability 0 or 1, certain 1, logit -NIF_LOGIT_CERTAIN or NIF_LOGIT_CERTAIN. confidence: 0.5 or less
 * hands over none, more than 1 every ray that is not certain; negative or NaN: NIF_ERROR_INVALID_ARGUMENT.
 * `user` is passed on. Allocates nothing. Always answered by the CPU: device memory or a stream gives
 * NIF_ERROR_NOT_AVAILABLE. */
NIF_API NifError nifQueryWithFallback(NifScene scene, const NifQuery* query, float confidence,
                                      NifFallback fallback, void* user);

/* ---- Asynchronous queries ---------------------------------------------------------------------------- */

/* A query that others answer. Reference-counted, as all handles. */
typedef struct NifJobHandle* NifJob;

/* Starts a query and returns. The query's arrays and the scene must stay as they are until the job is done;
 * the structure itself is copied, its scratch not used. It is checked at once, as by nifQuery, and there is
 * no job where that fails. Who answers it: the caller's task runner, where the device has one; else the
 * device's own threads, of which there are threads - 1; with threads=1 the calling thread, before this
 * returns. The one query that allocates: the job, from the device's allocator. On a GPU a query of device
 * memory is the stream's work, and the job is done when that is; one of host memory is answered before this
 * returns. */
NIF_API NifError nifQueryAsync(NifScene scene, const NifQuery* query, NifJob* job);

/* Helps with what nobody has started on, then waits until the job is done. So it returns even where a task
 * runner never runs its tasks. Returns the query's code. Thread-safe; allocates nothing; needs stack as
 * nifQuery. */
NIF_API NifError nifWaitJob(NifJob job);

/* *done receives 1 or 0, without waiting; what the job wrote is then visible to the calling thread.
 * Thread-safe; allocates nothing. */
NIF_API NifError nifIsJobDone(NifJob job, uint32_t* done);

/* The job keeps its scene until it is done and its device until all tasks of the caller's runner have run.
 * Releasing does not wait for it, nor end it. */
NIF_API void nifRetainJob(NifJob job);
NIF_API void nifReleaseJob(NifJob job);

/* ---- Experimental: may change or go. Define NIF_NO_EXPERIMENTAL to do without. ----------------------- */

#ifndef NIF_NO_EXPERIMENTAL
typedef enum NifMeasure {
  NIF_MEASURE_QUERY = 0,      /* as the device answers it */
  NIF_MEASURE_ONE_KERNEL = 1, /* by one kernel, with pipeline=off */
  NIF_MEASURE_PIPELINE = 2,   /* by the pipeline, with pipeline=on; by one kernel where there is no network */
  NIF_MEASURE_STAGES = 3,     /* the stages of the pipeline */
  /* Scenes of `bvh` objects, asked only for what is visible, with triangles tested in single precision: what
   * proofs in double precision cost a card. These are not the answers of a query. */
  NIF_MEASURE_SINGLE_BVH = 4,
  NIF_MEASURE_IS_32_BITS = 0x7fffffff
} NifMeasure;

/* NIF_MEASURE_STAGES: the walk through top level and occupancy ("ray cast"), putting items in order, then
 * inputs and networks of `segment` objects and of outer `spherical` items, inputs and networks of inner ones,
 * and the rest: what threads do by themselves. Inputs are timed by a launch that leaves networks out;
 * networks are what a whole launch takes longer. */
#define NIF_MEASURED_STAGES 7

/* How long the GPU takes for a query, without copies. Rays are copied to memory of the GPU's; the query is
 * answered there once, and then `rounds` times, each time measured by the GPU's own clock; then the answers
 * are copied to the query's outputs. `seconds` receives [rounds], or [rounds][NIF_MEASURED_STAGES] of stages.
 * `query` is of host memory, without a stream. NIF_ERROR_NOT_AVAILABLE on the CPU. Takes memory of the GPU
 * for all rays, and gives it back. */
NIF_API NifError nifMeasureQuery(NifScene scene, const NifQuery* query, NifMeasure measure, uint32_t rounds,
                                 double* seconds);
#endif

#ifdef __cplusplus
}
#endif

#endif /* NIF_NIF_H */
