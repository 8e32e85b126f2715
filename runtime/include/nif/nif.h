/* nif.h: load .nif assets and ask whether rays are blocked. C99. nif.hpp wraps it for C++20.
 *
 *   NifDevice device;  NifAsset asset;  NifScene scene;
 *   nifNewDevice(NULL, NULL, &device);
 *   nifLoadAssetFile(device, "dragon.nif", NIF_LOAD_COPY, &asset);
 *   nifNewScene(device, &scene);
 *   nifAddAsset(scene, asset, NULL, NULL, NULL);
 *   nifCommitScene(scene);
 *
 *   NifRays rays = nifMakeRays(my_rays, count);      // NifRay my_rays[count]
 *   NifAnswers answers = {.struct_size = sizeof(answers), .visible = visible};
 *   if (nifQuery(scene, &rays, &answers) != NIF_OK)  // uint8_t visible[count]: 1 visible, 0 occluded
 *     puts(nifGetErrorMessage());
 *
 *   nifReleaseScene(scene);  nifReleaseAsset(asset);  nifReleaseDevice(device);
 *
 * docs/runtime.md in the source tree explains devices, queries on GPUs, jobs and the ABI at more length.
 *
 * Rules for every function, unless its comment says otherwise:
 * - Errors: it returns NIF_OK or an error code. After an error, nifGetErrorMessage() returns one sentence.
 *   A call that fails changes nothing, except that the output arrays of a query may hold anything.
 * - Null: handles and pointers must not be null, unless the comment says what null means. Null, a handle
 *   whose last reference was released, and a value that never was a handle give NIF_ERROR_INVALID_ARGUMENT.
 *   Handle values are never reused. But the release of the last reference must not run at the same time as
 *   another call with that handle.
 * - Threads: calls on different scenes may run at the same time, and so may calls on one device or one asset.
 *   Calls that change a scene (nifAdd..., nifRemove..., nifSet..., nifPoseInstance, nifCommitScene) must not run
 *   at the same time as any other call on that scene. Any number of threads may query one committed scene.
 * - Memory: a call may allocate, through the device's allocator. Queries do not allocate, except that
 *   nifQueryAsync and nifIntersectAsync allocate their job, and a query on a GPU may allocate memory for
 *   copies. Threads, error messages, handles beyond 1,024 at once, tables that exist only during a load, and
 *   host memory of the GPU module always come from the system.
 * - Ownership: pointers in a returned structure belong to nifkit. They are valid until the object that the
 *   call was made on is destroyed.
 * - Floating point: the caller's rounding mode, denormal mode and exception flags do not affect results, and
 *   are unchanged after the call.
 *
 * Structures start with struct_size, except NifRay. Set it to sizeof(the structure) before each call, also in
 * structures that the call fills: then a program compiled with an older header works with a newer library. In
 * a structure that you pass in, set members that you do not use to zero:
 * NifAnswers answers = {.struct_size = sizeof(answers)}; does that. Flags that this header does not name and
 * members called "reserved" must be zero. Members that hold an enum value are uint32_t. */
#ifndef NIF_NIF_H
#define NIF_NIF_H

#include <stdint.h>
#include <string.h>

/* Version of this header. Before 1.0.0 a new minor version may change calls; later only a new major one. */
#define NIF_VERSION_MAJOR 0
#define NIF_VERSION_MINOR 1
#define NIF_VERSION_PATCH 0
#define NIF_VERSION (NIF_VERSION_MAJOR * 10000 + NIF_VERSION_MINOR * 100 + NIF_VERSION_PATCH)

/* On Windows: define NIF_STATIC to link the static library instead of nif.dll. The target nifkit::runtime of
 * the CMake package does so. */
#if !defined(_WIN32)
#define NIF_API __attribute__((visibility("default")))
#elif defined(NIF_STATIC)
#define NIF_API
#else
#define NIF_API __declspec(dllimport)
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Errors ------------------------------------------------------------------------------------------ */

/* The numbers never change. Codes for files are also exit codes of the program `nif`. */
typedef enum NifError {
  NIF_OK = 0,
  NIF_ERROR_UNKNOWN = 1,           /* a bug in nifkit */
  NIF_ERROR_INVALID_ARGUMENT = 2,  /* null, out of range, not finite, misaligned */
  NIF_ERROR_INVALID_OPERATION = 3, /* not in this state, e.g. a query of a scene that is not committed */
  NIF_ERROR_OUT_OF_MEMORY = 4,
  NIF_ERROR_NOT_AVAILABLE = 5,      /* not in this build or on this machine; the message says which */
  NIF_ERROR_CANCELLED = 6,          /* from nifWaitJob: nifCancelJob stopped the job before its end */
  NIF_ERROR_SINGULAR_TRANSFORM = 7, /* the transform has no inverse: it flattens space */

  NIF_ERROR_FILE_NOT_FOUND = 10,
  NIF_ERROR_FILE_UNREADABLE = 11, /* no permission, a folder, or an I/O error */
  NIF_ERROR_FILE_EMPTY = 12,
  NIF_ERROR_FILE_TRUNCATED = 13, /* shorter than its header says */
  NIF_ERROR_NOT_A_NIF = 30,
  NIF_ERROR_FOREIGN_NIF = 31,     /* a NetImmerse/Gamebryo model: same extension, different format */
  NIF_ERROR_DAMAGED_NIF = 32,     /* wrong checksum or structure */
  NIF_ERROR_UNSUPPORTED_NIF = 33, /* needs a newer library */

  /* GPU backends only: */
  NIF_ERROR_DEVICE_LOST = 60, /* the GPU or its driver failed, perhaps in an earlier query */
  NIF_ERROR_OUT_OF_DEVICE_MEMORY = 61,
  NIF_ERROR_WRONG_POINTER = 62, /* memory of another kind than NifRays.memory or NifPose.memory says */

  NIF_ERROR_ENUM_IS_32_BITS = 0x7fffffff
} NifError;

/* Returns the library's version, encoded like NIF_VERSION. Allocates nothing; cannot fail. */
NIF_API uint32_t nifGetVersion(void);

/* Returns one sentence about the last failed call on this thread, or "" if none failed. Errors about a file
 * name it; errors about an asset loaded from memory say "memory". The text is valid until the next failed
 * call on this thread. Needs no device. Allocates nothing; cannot fail. */
NIF_API const char* nifGetErrorMessage(void);

/* Returns the name of a code, e.g. "NIF_ERROR_FILE_NOT_FOUND". Allocates nothing; cannot fail. */
NIF_API const char* nifGetErrorName(NifError error);

/* ---- Device ------------------------------------------------------------------------------------------ */

/* Handles are opaque and reference-counted. nifNew... and nifLoad... return one reference, nifRetain... adds
 * one, and nifRelease... removes one; the last release destroys the object. A scene keeps its assets alive;
 * scenes and assets keep their device alive. Retaining or releasing null or a dead handle does nothing. */
typedef struct NifDeviceHandle* NifDevice;
typedef struct NifAssetHandle* NifAsset;
typedef struct NifSceneHandle* NifScene;

/* One task of a query, for the caller's task runner. */
typedef void (*NifTask)(void* argument, uint64_t index);

typedef enum NifLogLevel {
  NIF_LOG_WARNING = 1, /* something was not done as asked, e.g. a scene could not be copied to the GPU */
  NIF_LOG_INFO = 2,    /* what was done: a device was made, an asset loaded */
  NIF_LOG_LEVEL_IS_32_BITS = 0x7fffffff
} NifLogLevel;

/* The caller's own allocator, task runner and log. A null member selects nifkit's own; nifkit's own log
 * discards everything. Callbacks may be called from any thread that calls nifkit and from the device's
 * threads, several at once, until the device is destroyed. They must not throw or call nifkit. */
typedef struct NifDeviceCallbacks {
  uint64_t struct_size;
  void* user; /* passed to each callback */

  /* allocate returns `bytes` > 0 bytes, aligned to `alignment` (a power of 2, at most 64), or null when it
   * has no memory. deallocate gets the same bytes and alignment. Set both or neither. */
  void* (*allocate)(void* user, uint64_t bytes, uint64_t alignment);
  void (*deallocate)(void* user, void* memory, uint64_t bytes, uint64_t alignment);

  /* Replaces the device's own threads. submit arranges that task(argument, i) is called once for each i in
   * 0 .. count - 1, on any threads, in any order, now or later. It may return before the tasks have run.
   * count is at most the device's number of threads. A query does not wait for tasks that have not started: a
   * late task finds nothing to do. Still, every task must eventually run, because the device lives until
   * then. A task needs as much stack as nifQuery. */
  void (*submit)(void* user, NifTask task, void* argument, uint64_t count);

  /* Receives one sentence at a time, 0-terminated, valid during the call. `level` is a NifLogLevel; levels
   * may be added. Queries log only the loss of a GPU. */
  void (*log)(void* user, uint32_t level, const char* message);
} NifDeviceCallbacks;

/* Creates a device: the CPU or a GPU, with threads and work memory. `config` is null or a list such as
 * "threads=2,isa=avx2". docs/runtime.md describes each key.
 * - threads=N: threads that work on one query (default 1; 0: as many as the machine has).
 * - queries=N: queries that can run at once without scratch from the caller (default 0: as many as the
 *   machine has threads).
 * - isa=NAME: the CPU's instruction set: auto (default), scalar, sse4, avx2, avx512, neon or wasm.
 * - memory=NAME: auto (default), or least: smaller grid tables and no decoded triangles, but slower queries.
 *   CPU only.
 * - backend=NAME: cpu (default), gpu (a GPU of NVIDIA or AMD), cuda (NVIDIA only) or hip (AMD only).
 * - device=N: which GPU, as numbered by nifGetGpuInfo (default: the backend's first).
 * - module=PATH: with a GPU, the file of the GPU module.
 * - shaders=NAME: off (default), or on: assets keep what nifGetShaderTables reads.
 * - pipeline=NAME: with a GPU, how it answers: auto (default), on or off. The answers are the same.
 * - precision=NAME: with a GPU, single (default), or half for networks of `spherical` objects.
 *
 * An unknown key or value gives NIF_ERROR_INVALID_ARGUMENT. NIF_ERROR_NOT_AVAILABLE means that this build or
 * this machine lacks what `config` asks for. `callbacks` may be null; the structure is copied. */
NIF_API NifError nifNewDevice(const char* config, const NifDeviceCallbacks* callbacks, NifDevice* device);
NIF_API void nifRetainDevice(NifDevice device);
NIF_API void nifReleaseDevice(NifDevice device);

typedef struct NifDeviceInfo {
  uint64_t struct_size;
  uint32_t threads; /* most that one query uses */
  uint32_t reserved;
  const char* isa;     /* in use, e.g. "avx512" */
  const char* backend; /* "cpu", "cuda" or "hip" */
  const char* gpu;     /* the GPU's name; "" for the CPU */
} NifDeviceInfo;

/* Allocates nothing. */
NIF_API NifError nifGetDeviceInfo(NifDevice device, NifDeviceInfo* info);

typedef struct NifBackendInfo {
  uint64_t struct_size;
  const char* name;   /* "cpu", "cuda" or "hip", as in backend=NAME */
  uint32_t available; /* 1: yes, 0: no */
  uint32_t reserved;
  const char* reason; /* one sentence on why it is not available; "" if it is */
} NifBackendInfo;

/* Lists the backends of this version: index = 0, 1, ... until NIF_ERROR_INVALID_ARGUMENT. For GPUs each call
 * loads the GPU module and the drivers and looks for GPUs. The reason names what is wrong: no module, no
 * driver, a driver that is too old, no GPU, or no code for the GPUs in the module. The text is valid until
 * the next call of this function on this thread. Needs no device. */
NIF_API NifError nifGetBackendInfo(uint32_t index, NifBackendInfo* info);

typedef struct NifGpuInfo {
  uint64_t struct_size;
  const char* name;
  const char* target; /* the architecture that its code is compiled for, e.g. "gfx1100" or "sm_90" */
  const char* driver; /* e.g. "CUDA 13.0" */
  uint64_t memory_bytes;
  uint32_t available; /* 1: yes, 0: no */
  uint32_t pci_domain;
  const char* reason;  /* one sentence on why it cannot be used; "" if it can */
  const char* backend; /* "cuda" or "hip" */
  /* These identify the GPU that a graphics API renders on. The PCI address does so for all graphics APIs on
   * Linux. uuid is VkPhysicalDeviceIDProperties::deviceUUID, or 0 if the driver does not report one. luid is
   * that of DXGI_ADAPTER_DESC, and Vulkan's deviceLUID; only Windows has one, so elsewhere has_luid is 0. */
  uint32_t pci_bus;
  uint32_t pci_device;
  uint8_t uuid[16];
  uint8_t luid[8];
  uint32_t has_luid; /* 1: yes, 0: no */
  uint32_t reserved;
} NifGpuInfo;

/* Lists the GPUs of backend=gpu: gpu = 0, 1, ... as in device=N, until NIF_ERROR_INVALID_ARGUMENT. If there
 * is no GPU, it returns NIF_ERROR_NOT_AVAILABLE. Each call looks for GPUs again. The texts are valid until
 * the next call of this function on this thread. Needs no device. */
NIF_API NifError nifGetGpuInfo(uint32_t gpu, NifGpuInfo* info);

/* ---- Assets ------------------------------------------------------------------------------------------ */

typedef enum NifLoadMode {
  NIF_LOAD_COPY = 0, /* the asset owns its bytes: a file is read and closed, memory is copied */
  /* The bytes are used in place until the asset is destroyed; coded payloads are decoded into other memory. A
   * file is mapped, and must not change. Memory must start at a multiple of NIF_ASSET_ALIGNMENT, and must not
   * move or change. */
  NIF_LOAD_IN_PLACE = 1,
  NIF_LOAD_MODE_IS_32_BITS = 0x7fffffff
} NifLoadMode;

#define NIF_ASSET_ALIGNMENT 64 /* bytes */

/* Loads a .nif file. `path` is 0-terminated; on Windows in UTF-8, elsewhere in the system's encoding. Safe on
 * untrusted files: checksums cover every byte, every table is checked, and the memory used is at most a small
 * multiple of the file's size. (With NIF_LOAD_IN_PLACE this holds only if the file does not change.) */
NIF_API NifError nifLoadAssetFile(NifDevice device, const char* path, NifLoadMode mode, NifAsset* asset);

/* Loads a .nif file from memory: `bytes` holds the whole file, `size` bytes. Safe on untrusted bytes. With
 * NIF_LOAD_COPY, `bytes` may have any alignment. */
NIF_API NifError nifLoadAssetMemory(NifDevice device, const void* bytes, uint64_t size, NifLoadMode mode,
                                    NifAsset* asset);

/* A source of a .nif file's bytes, e.g. the caller's archive. */
typedef struct NifReader {
  uint64_t struct_size;
  void* user;       /* passed to read */
  const char* name; /* what messages call the file; null: "reader" */
  uint64_t size;    /* of the whole file, in bytes */
  /* Writes the file's bytes offset .. offset + size - 1 to `to`, and returns 1; any other value is a failure.
   * Called on the calling thread, with offsets that ascend without gaps. It must not throw or call nifkit. */
  uint32_t (*read)(void* user, uint64_t offset, void* to, uint64_t size);
} NifReader;

/* Loads a .nif file through the caller's read function, which is not called again after this returns. The
 * length in the file's header is compared with `size` before memory is allocated. Safe on untrusted bytes. A
 * failed read gives NIF_ERROR_FILE_UNREADABLE. */
NIF_API NifError nifLoadAssetReader(NifDevice device, const NifReader* reader, NifAsset* asset);
NIF_API void nifRetainAsset(NifAsset asset);
NIF_API void nifReleaseAsset(NifAsset asset);

typedef struct NifAssetInfo {
  uint64_t struct_size;
  uint32_t object_count;   /* at least 1 */
  uint32_t instance_count; /* placements of objects in the file; may be 0: see nifAddAsset */
  uint32_t network_count;  /* objects may share networks */
  uint32_t format_version;
  uint64_t file_bytes;
  /* All memory that the library keeps for this asset: data decoded or built at load, and the file's bytes
   * (borrowed and mapped bytes too) unless tables built at load replace them. */
  uint64_t resident_bytes;
  const char* metadata; /* JSON, UTF-8, [metadata_bytes], not 0-terminated; null if there is none */
  uint64_t metadata_bytes;
  uint64_t gpu_bytes;      /* GPU memory for this asset; 0 until a scene with it is committed on a GPU */
  uint32_t places_nothing; /* 1: the file states that it places no object; then instance_count is 0 */
  uint32_t arithmetic;     /* the revision of docs/answers.md by which the file is answered */
  uint32_t prover;         /* the revision of what proved the file's planes; 0: nothing in it is proven */
  /* 0: no answer about its objects is certain, because nothing in it is proven, or its prover turned out to be
   * defective; 1: answers may be certain */
  uint32_t proves;
} NifAssetInfo;

/* Allocates nothing. */
NIF_API NifError nifGetAssetInfo(NifAsset asset, NifAssetInfo* info);

typedef struct NifPartInfo {
  uint64_t struct_size;
  const char* name; /* e.g. "planes"; docs/runtime.md lists all */
  uint64_t file_bytes;
  uint64_t resident_bytes; /* more than file_bytes if the part is coded in the file or built at load; less if
                              tables built at load replace it */
} NifPartInfo;

/* Lists the parts of an asset: part = 0, 1, ... until NIF_ERROR_INVALID_ARGUMENT. The bytes of all parts add
 * up to those of NifAssetInfo. Allocates nothing. */
NIF_API NifError nifGetPartInfo(NifAsset asset, uint32_t part, NifPartInfo* info);

/* How an object stores what blocks rays. The numbers never change. */
typedef enum NifEncoding {
  NIF_ENCODING_SEGMENT = 1,   /* voxels, and a small network for what they leave open; compact, may err */
  NIF_ENCODING_SPHERICAL = 2, /* the published Neural Intersection Function, for comparison; may err */
  NIF_ENCODING_BVH = 3,       /* the triangles in a compressed BVH; exact */
  NIF_ENCODING_EXACT = 4,     /* planes that prove most answers, and the triangles for the rest; exact */
  NIF_ENCODING_PROOF = 5,     /* the planes alone: rays that they do not prove are left to your own BVH */
  NIF_ENCODING_CUTOUT = 6,    /* triangles of which some have holes, as leaves and fences have; exact */
  NIF_ENCODING_IS_32_BITS = 0x7fffffff
} NifEncoding;

typedef struct NifObjectInfo {
  uint64_t struct_size;
  const char* name;    /* UTF-8, 0-terminated, may be "" */
  uint32_t encoding;   /* a NifEncoding; 0 if the object is unsupported */
  uint32_t network;    /* 0 .. network_count - 1; ignore it for encodings without networks */
  float bounds_min[3]; /* of the source mesh, in object space */
  float bounds_max[3];
  float bias;         /* start shadow rays this far from the surface, in object units */
  uint32_t triangles; /* of the source mesh */
  /* This object's own data: voxels, features, grids, BVH, triangle numbers, colours, tables built at load. */
  uint64_t resident_bytes;
  /* 0: an object of NIF_ENCODING_PROOF without planes, because the baker found that they would save too
   * little. It proves only that rays miss it: query your own BVH alone. 1: all other objects. */
  uint32_t proves;
  /* The number of triangles in the source mesh, if the object was baked with --source-triangles or was merged
   * of several meshes: then NifHits.triangle is a triangle's number in that mesh, from 0 (docs/meshes.md says
   * which part of a merged mesh it is on). Otherwise 0: then NifHits.triangle is the object's own number,
   * which says nothing about the source mesh. */
  uint32_t source_triangles;
  uint32_t colors; /* 1: hits have the surface's colours (nif bake --colors); 0: the object has none */
  /* 0: the object itself. k: a coarser stand-in for the next object of the asset, which has level k - 1; no
   * instance of the file names it, but nifAddInstance can place it. */
  uint32_t level;
  /* The largest distance of its surface from the source's, in object units; 0: none or unknown. */
  float error;
  /* Why this library cannot answer the object: it belongs to a later version of the format. Then encoding is
   * 0, and placing the object gives NIF_ERROR_UNSUPPORTED_NIF. "" for all others. */
  const char* unsupported;
  /* Vertices of the source mesh, if instances of the object can bend (nif bake --deforms): as many as
   * nifSetInstanceVertices takes. 0: they cannot. */
  uint32_t vertices;
  uint32_t joints;  /* of its skin, as nifPoseInstance takes them; 0: it has none */
  uint32_t targets; /* morph targets, likewise */
  uint32_t reserved;
} NifObjectInfo;

/* Describes one object: object = 0 .. object_count - 1. Allocates nothing. */
NIF_API NifError nifGetObjectInfo(NifAsset asset, uint32_t object, NifObjectInfo* info);

typedef struct NifAssetInstanceInfo {
  uint64_t struct_size;
  const char* name; /* UTF-8, 0-terminated, may be "" */
  uint32_t object;  /* 0 .. object_count - 1 */
  /* An earlier instance of the file that should take this one along when it moves; NIF_NONE: none. Scenes do
   * not use it. */
  uint32_t parent;
  /* Object to asset space (the parent's transform is already in it), laid out as in nifAddInstance. Rounded to
   * floats, although nifAddAsset places instances far from the origin in double (docs/meshes.md). */
  float transform[12];
  /* nifAddAsset sets these three, as nifSetInstanceUser, nifSetInstanceMask and nifSetInstanceFlags would. */
  uint64_t user;
  uint32_t mask;
  uint32_t flags;
} NifAssetInstanceInfo;

/* Describes one instance of the file: instance = 0 .. instance_count - 1. Allocates nothing. */
NIF_API NifError nifGetAssetInstanceInfo(NifAsset asset, uint32_t instance, NifAssetInstanceInfo* info);

/* ---- Shaders ----------------------------------------------------------------------------------------- */

/* Writes the tables of one object for a shader of your own: 32-bit words in this machine's byte order, to be
 * bound as one read-only storage buffer. docs/shaders.md describes each word, and the GLSL file nif.glsl has
 * the functions that answer rays from them, and says which bits are nifQuery's. Needs no GPU.
 *
 * *count receives how many words there are. `words` null: only that. Otherwise `words` has room for `capacity`
 * words; if those are too few, nothing is written and it gives NIF_ERROR_INVALID_ARGUMENT. The object must be of
 * `segment`, `proof`, `bvh` or `exact`, and its network like those that nif bake makes; otherwise it
 * gives NIF_ERROR_NOT_AVAILABLE. Where kernels free a file's bytes after the load (docs/runtime.md), it gives
 * NIF_ERROR_INVALID_OPERATION, unless the device was made with shaders=on. The tables are built
 * when they are written, those of a `segment` also when they are first counted, in memory of the device that is freed. */
NIF_API NifError nifGetShaderTables(NifAsset asset, uint32_t object, uint32_t* words, uint64_t capacity,
                                    uint64_t* count);

typedef enum NifShaderLanguage {
  NIF_SHADER_GLSL = 1,  /* for Vulkan: the file nif.glsl */
  NIF_SHADER_WGSL = 2,  /* for WebGPU: the file nif.wgsl */
  NIF_SHADER_HLSL = 3,  /* for Direct3D 12: the file nif.hlsl */
  NIF_SHADER_METAL = 4, /* for Metal: the file nif.metal */
  NIF_SHADER_LANGUAGE_IS_32_BITS = 0x7fffffff
} NifShaderLanguage;

/* Returns the text of this version's functions for shaders, to be put before your own: it reads the tables
 * that this library writes. 0-terminated, valid as long as the library is loaded; null if there is no such
 * language. Allocates nothing. */
NIF_API const char* nifGetShaderSource(NifShaderLanguage language);

/* ---- Scenes ------------------------------------------------------------------------------------------ */

/* A scene is a list of instances. An instance is an object of an asset with a transform. Build the scene,
 * commit it, then query it; after a change, commit again. A scene without instances can be committed too:
 * every ray is visible in it. */
NIF_API NifError nifNewScene(NifDevice device, NifScene* scene);
NIF_API void nifRetainScene(NifScene scene);
NIF_API void nifReleaseScene(NifScene scene);

/* Adds one instance of an object. `transform` maps object to world space: [12], a row-major 3x4 matrix,
 * world_x = t[0] x + t[1] y + t[2] z + t[3] and so on. It may scale non-uniformly and mirror. Null: identity.
 * A value that is not finite gives NIF_ERROR_INVALID_ARGUMENT; a matrix without an inverse in single
 * precision gives NIF_ERROR_SINGULAR_TRANSFORM. The asset must belong to the scene's device. `instance` (may
 * be null) receives the instance's number, for later changes: the lowest free one. The instance has the mask
 * 0xffffffff, no flags, the user value 0 and the origin 0 0 0. */
NIF_API NifError nifAddInstance(NifScene scene, NifAsset asset, uint32_t object, const float* transform,
                                uint32_t* instance);

/* Adds a whole asset: all instances in its file, with their masks, flags and user values. If the file has no
 * instances, it adds each object of level 0 once, or nothing if the file says so
 * (NifAssetInfo.places_nothing). If one of these objects is unsupported (NifObjectInfo.unsupported), it gives
 * NIF_ERROR_UNSUPPORTED_NIF and adds nothing. `transform` (as in nifAddInstance) is applied after each
 * instance's own transform. `first` receives the number of the first new instance, and `count` how many were
 * added; both may be null. The numbers are consecutive: the lowest free range. */
NIF_API NifError nifAddAsset(NifScene scene, NifAsset asset, const float* transform, uint32_t* first,
                             uint32_t* count);

/* Removes one instance. Its number becomes free for instances that are added later; the others keep theirs.
 * The scene keeps the asset until the next commit, and longer if other instances use it. */
NIF_API NifError nifRemoveInstance(NifScene scene, uint32_t instance);

/* Replaces the transform of one instance. `transform` as in nifAddInstance. Allocates nothing. */
NIF_API NifError nifSetInstanceTransform(NifScene scene, uint32_t instance, const float* transform);

/* Replaces the transforms of many instances: for each k below count, instance instances[k] gets the 12 floats
 * at (const char*)transforms + k * stride. `instances` null: 0 .. count - 1. On failure no transform changes.
 * Allocates nothing. */
NIF_API NifError nifSetInstanceTransforms(NifScene scene, uint64_t count, const uint32_t* instances,
                                          const float* transforms, uint64_t stride);

/* Sets an instance's origin: [3], finite, added to its transform's translation in double precision. Null:
 * 0 0 0. For worlds in which floats are too coarse for positions: put the position here, and keep the
 * transform's translation small. See nifSetSceneOrigin. Allocates nothing. */
NIF_API NifError nifSetInstanceOrigin(NifScene scene, uint32_t instance, const double* origin);

/* Sets the scene's origin: [3], finite; null: 0 0 0. Rays, hits and bounds are relative to it: an instance's
 * position is its translation plus its origin minus the scene's, computed in double precision and rounded to
 * 48 bits. Move it with the camera, and rays are as precise near the camera as they are near 0, in a world of
 * any size. Takes effect at the next commit, which then recomputes the transforms of all instances. If one of
 * them is too far from the new origin for a float, that commit gives NIF_ERROR_INVALID_ARGUMENT. */
NIF_API NifError nifSetSceneOrigin(NifScene scene, const double* origin);

/* Sets an instance's mask. A ray meets the instance only if the ray's mask (NifRays.mask) has a bit in common
 * with it. */
NIF_API NifError nifSetInstanceMask(NifScene scene, uint32_t instance, uint32_t mask);

typedef enum NifInstanceFlags {
  NIF_INSTANCE_DISABLED = 1, /* no ray meets it; answers are as if it were removed */
  NIF_INSTANCE_FLAGS_ARE_32_BITS = 0x7fffffff
} NifInstanceFlags;

/* Sets an instance's flags: a sum of NifInstanceFlags. Other bits give NIF_ERROR_NOT_AVAILABLE. */
NIF_API NifError nifSetInstanceFlags(NifScene scene, uint32_t instance, uint32_t flags);

/* Sets a value for the caller's use, which hits return (NifHits.user), e.g. an entity's number or address. */
NIF_API NifError nifSetInstanceUser(NifScene scene, uint32_t instance, uint64_t user);

/* Gives one instance vertices of its own, in object space, in the order of the source mesh: for each vertex v
 * below NifObjectInfo.vertices, the three floats at (const char*)positions + v * stride, in host memory (a GPU's:
 * NifPose.positions); null: the vertices at rest. They are copied, and take effect at the next commit, which fits the
 * instance's boxes to them. Answers are exact for these positions. These must be finite and at most 2^59; those of
 * vertices that no triangle has are not read. If one is not, the call gives NIF_ERROR_INVALID_ARGUMENT, and the instance
 * keeps the vertices that it had. Memory of a GPU gives NIF_ERROR_WRONG_POINTER on a device with a GPU, and an object
 * that was not baked with --deforms NIF_ERROR_INVALID_OPERATION.
 *
 * The first such call for an instance allocates its tree: about 100 bytes a triangle. Later ones, and the
 * commits after them, allocate nothing, unless the hierarchy is rebuilt (nifCommitScene) or a GPU gets a copy. */
NIF_API NifError nifSetInstanceVertices(NifScene scene, uint32_t instance, const float* positions,
                                        uint64_t stride);

/* How an instance bends: by the skin of its object, or by vertices of its own. */
typedef struct NifPose {
  uint64_t struct_size;
  /* [joint_count][12] row-major 3x4 matrices, as in nifAddInstance, from the mesh in its bind pose to the object's
   * space: of a glTF, the inverse of the instance's transform (NifAssetInstanceInfo) times the joint's world
   * matrix times its inverse bind matrix. The transform of the mesh's own node does not count. */
  const float* joints;
  /* [target_count] weights of the morph targets. Null, with target_count 0: all are 0. */
  const float* weights;
  uint32_t joint_count;  /* NifObjectInfo.joints */
  uint32_t target_count; /* NifObjectInfo.targets, or 0 */
  /* Instead of the above, which are then null and 0: vertices as nifSetInstanceVertices takes them, for example those
   * that a compute shader has moved. Null: the skin moves the vertices. */
  const float* positions;
  uint64_t position_stride; /* in bytes; in device memory at most 2048, forwards or backwards */
  uint32_t memory;          /* a NifMemory: where all arrays of the pose are */
  uint32_t flags;           /* must be 0 */
  /* Device memory: the hipStream_t or cudaStream_t that writes the arrays; null: the default stream. Host memory:
   * null. */
  void* stream;
} NifPose;

/* Moves the vertices of one instance by the skin of its object: first by morph targets, then by the weighted mean of
 * its joints' matrices; or sets them (NifPose.positions). Otherwise like nifSetInstanceVertices. docs/answers.md has the
 * order of operations: the same pose gives the same bits everywhere. An object without a skin, other numbers of joints or
 * targets, values that are not finite, and poses that could move a vertex beyond 2^59, give NIF_ERROR_INVALID_ARGUMENT.
 *
 * On a GPU, arrays in device memory (NIF_MEMORY_DEVICE) are copied to the host by the stream, and the call returns at
 * once: do not change them until the stream has executed the copy. Later work of the same stream may. The next commit
 * waits for the copies and moves the vertices on the CPU, with the same bits; only then are values refused
 * (nifCommitScene). Of several poses of an instance, the last call counts. The first such call for an instance, and one
 * that copies more bytes than any before, allocate pinned host memory. If the driver fails in the middle of a call, an
 * earlier pose in device memory may be lost that is not committed yet: the commit reports that, too. */
NIF_API NifError nifPoseInstance(NifScene scene, uint32_t instance, const NifPose* pose);

typedef struct NifInstanceInfo {
  uint64_t struct_size;
  NifAsset asset;  /* not retained for the caller; null if the caller has released it */
  uint32_t object; /* of the asset */
  uint32_t mask;
  uint64_t user;
  double origin[3];
  float transform[12]; /* as it was set; if nifAddAsset added the instance, rounded to floats */
  uint32_t flags;      /* a sum of NifInstanceFlags */
  uint32_t reserved;
} NifInstanceInfo;

/* Describes an instance as it was last set, committed or not. A number that no instance has gives
 * NIF_ERROR_INVALID_ARGUMENT. Allocates nothing. */
NIF_API NifError nifGetInstanceInfo(NifScene scene, uint32_t instance, NifInstanceInfo* info);

/* Makes all changes since the last commit visible to queries. If instances were added or enabled (by flags or
 * by a mask that was 0), the hierarchy over the instances is rebuilt, in O(n log n) for n instances: about
 * 5 ms for 10,000. After other changes it is refitted, unless that makes it much worse. Without changes the
 * call does nothing.
 *
 * Poses in device memory (NifPose.memory) arrive here. If values of one are refused, as nifPoseInstance would, its
 * instance keeps the vertices that it had; all else is committed, and the call gives NIF_ERROR_INVALID_ARGUMENT with
 * a message that names the instance. NifSceneInfo.committed tells this from a commit that failed.
 *
 * On a GPU it also copies the scene and its new assets to the GPU, after the scene's own queries there have
 * finished. If that fails (NIF_ERROR_OUT_OF_DEVICE_MEMORY, NIF_ERROR_DEVICE_LOST), the scene is committed for
 * the CPU, which then answers queries of host memory; another commit tries the GPU again. */
NIF_API NifError nifCommitScene(NifScene scene);

typedef struct NifSceneInfo {
  uint64_t struct_size;
  uint32_t instance_count; /* instances in the scene */
  uint32_t instance_end;   /* all their numbers are below this */
  /* Box around everything that can block a ray, at the last commit, relative to the scene's origin. It is a
   * little larger than the objects' bounds: their grids plus 1/8 voxel. min > max: nothing can block. */
  float bounds_min[3];
  float bounds_max[3];
  /* Memory of the scene without its assets: after a commit at most 256 bytes per instance, a few per object,
   * and what instances that bend have of their own. */
  uint64_t resident_bytes;
  double origin[3];
  uint32_t committed; /* 1: no changes since the last commit; 0: changed, or never committed */
  uint32_t reserved;
} NifSceneInfo;

/* Allocates nothing. */
NIF_API NifError nifGetSceneInfo(NifScene scene, NifSceneInfo* info);

/* Writes the tables of a committed scene for shaders, like nifGetShaderTables: its instances that rays can meet, then the objects
 * that they place. Rays are in world space. After instances moved, only the words before the objects have changed: if `capacity` is
 * exactly their number, which word 12 has, only these are written. What bends gives NIF_ERROR_NOT_AVAILABLE, and a scene that is
 * not committed NIF_ERROR_INVALID_OPERATION. */
NIF_API NifError nifGetSceneShaderTables(NifScene scene, uint32_t* words, uint64_t capacity, uint64_t* count);

/* ---- Queries ----------------------------------------------------------------------------------------- */

/* For each ray, a query asks: does a triangle contain one of the points origin + t direction with tmin <= t
 * <= tmax? Edges and corners belong to a triangle; a triangle exactly edge-on to the ray does not count. The
 * direction need not have length 1. tmin and tmax may be infinite: -INFINITY .. INFINITY is the whole line.
 *
 * Invalid rays are reported visible, and certain only if tmin > tmax (no points). A ray is invalid if tmin >
 * tmax, if a number is NaN, if the origin or direction is infinite, or if the direction's largest component
 * (in voxels of an object) is zero or outside 2^-60 .. 2^60; for an object with triangles, also if the origin
 * is further away than 2^32 times the object's largest coordinate. In a scene of several instances, a ray is
 * also invalid if the direction's largest component in world space is zero or outside 2^-60 .. 2^60, or if a
 * component of the origin is 2^126 or more; a component of the direction below 2^-126 counts as 0. */

/* One ray, for programs without a ray layout of their own. */
typedef struct NifRay {
  float origin[3];
  float tmin;
  float direction[3];
  float tmax;
} NifRay;

typedef enum NifMemory {
  NIF_MEMORY_HOST = 0,
  NIF_MEMORY_DEVICE = 1, /* GPU backends only: the GPU can read and write all arrays of the query */
  NIF_MEMORY_IS_32_BITS = 0x7fffffff
} NifMemory;

/* A batch of rays, and how to answer it.
 *
 * Each component has a pointer and a stride in bytes, so every layout fits. The value for ray i is at (const
 * char*)pointer + i * stride. For an array of structures, point at members of the first structure and set the
 * stride to the structure's size. For separate arrays, the stride is sizeof(float). To use one value for all
 * rays (a sun's direction, one tmin, one mask), set the stride to 0; to read an array backwards, to
 * (uint64_t)-4. No alignment is needed. */
typedef struct NifRays {
  uint64_t struct_size;
  uint64_t count; /* if 0, nothing is read or written */

  const float* origin[3]; /* x, y, z, relative to the scene's origin */
  uint64_t origin_stride; /* strides are in bytes */
  const float* direction[3];
  uint64_t direction_stride;
  const float* tmin; /* null: 0 for all rays */
  uint64_t tmin_stride;
  const float* tmax; /* null: +infinity for all rays */
  uint64_t tmax_stride;
  /* A ray with mask m meets the instances whose own mask has a bit in common with m. Null: 0xffffffff for all
   * rays. A ray whose mask matches no instance sees an empty scene. */
  const uint32_t* mask;
  uint64_t mask_stride;

  uint32_t memory; /* a NifMemory: where all arrays of the query are, outputs included */
  uint32_t flags;  /* must be 0 */
  /* Work memory for the calling thread: at least nifGetQueryScratchBytes bytes, aligned to 64. You may reuse
   * it after the call. Null: the device's own memory (see queries=N). Other threads that help always use the
   * device's memory. */
  void* scratch;
  uint64_t scratch_bytes;
  void* stream; /* the hipStream_t or cudaStream_t to run in; null: the default stream; CPU: null */
} NifRays;

/* Where to write the answers: dense arrays. Set at least one; leave the others null. Which ones you set does
 * not change the answers. They need no alignment, and must not overlap each other or the rays. */
typedef struct NifAnswers {
  uint64_t struct_size;
  /* [count] 1: visible, 0: occluded. A ray is occluded if any instance blocks it. If only this and
   * visible_bits are set, the search stops at the first instance that blocks the ray. */
  uint8_t* visible;
  /* [(count + 7) / 8] The same answers as bits: ray i is bit i % 8 (0 is the lowest) of byte i / 8. Unused
   * bits of the last byte are 0. */
  uint8_t* visible_bits;
  /* [count] Calibrated probability that the ray is visible: the product over the instances; exactly 0 or 1
   * for certain rays. The last bits may differ between machines; the other outputs never differ. */
  float* probability;
  /* [count] 1: the answer is proven, not learned. Occluded is certain if one instance certainly blocks the
   * ray; visible is certain if every instance certainly does not.
   * - Nothing is certain about an instance of an asset that proves nothing (NifAssetInfo.proves): unless it is
   *   disabled, no ray of the scene is certainly visible.
   * - Nothing is certain about an instance if the ray starts too far from it, or if its transform is too
   *   skewed, for a proof in single precision. But in a scene of several instances, an instance whose box the
   *   ray misses certainly does not block it, at any distance.
   * - If an instance's transform is not the identity, the answer of its `bvh` or `exact` object holds for a ray
   *   that is moved by less than 2^-14 of the largest coordinate of the object's box. */
  uint8_t* certain;
  /* [count] The smallest network output of all instances: below 0 means occluded. NIF_LOGIT_CERTAIN if every
   * instance was decided without its network, -NIF_LOGIT_CERTAIN if one of them was decided to block the ray.
   * Networks of different objects may have different scales. If an asset was baked with a decision threshold
   * (nif bake --max-leak), it is subtracted from the asset's outputs here, but not from its probabilities. */
  int32_t* logit;
} NifAnswers;

#define NIF_LOGIT_CERTAIN 0x7fffffff

/* Sets *bytes to the size of scratch (NifRays.scratch) that a query of `count` rays needs. On the CPU it is
 * less than a megabyte, and the same for all counts except 0. A GPU needs no scratch. Allocates nothing. */
NIF_API NifError nifGetQueryScratchBytes(NifScene scene, uint64_t count, uint64_t* bytes);

/* Answers a batch of rays, and returns when the answers are written. Any number of threads may query one
 * committed scene. Allocates nothing. Needs at most 16 kB of stack, with or without scratch. Ray values are
 * untrusted: any bits are safe. Pointers and strides are trusted. A scene that is not committed gives
 * NIF_ERROR_INVALID_OPERATION; device memory or a stream on a CPU device gives NIF_ERROR_NOT_AVAILABLE.
 *
 * On a GPU, a query in device memory (NIF_MEMORY_DEVICE) is put into the stream, and the call returns at
 * once: do not change the arrays or the scene until the stream has executed it. A query in host memory copies
 * the rays to the GPU and the answers back, and returns when they are written; it may allocate. Arrays in the
 * wrong kind of memory give NIF_ERROR_WRONG_POINTER. If the GPU is lost, the CPU answers queries in host
 * memory. docs/runtime.md has the rules for pointers, streams and lost GPUs. */
NIF_API NifError nifQuery(NifScene scene, const NifRays* rays, const NifAnswers* answers);

/* Describes an array of NifRay: my_rays[count] (null if count is 0), in host memory. */
static inline NifRays nifMakeRays(const NifRay* my_rays, uint64_t count) {
  NifRays rays;
  int axis;
  memset(&rays, 0, sizeof(rays));
  rays.struct_size = sizeof(rays);
  if (count == 0) return rays;
  rays.count = count;
  for (axis = 0; axis < 3; ++axis) {
    rays.origin[axis] = &my_rays->origin[axis];
    rays.direction[axis] = &my_rays->direction[axis];
  }
  rays.tmin = &my_rays->tmin;
  rays.tmax = &my_rays->tmax;
  rays.origin_stride = rays.direction_stride = rays.tmin_stride = rays.tmax_stride = sizeof(NifRay);
  return rays;
}

/* Answers one ray, with the mask 0xffffffff: `answers` has arrays of one element. The CPU answers it, even
 * with a GPU backend. Otherwise like nifQuery. */
NIF_API NifError nifQueryRay(NifScene scene, const NifRay* ray, const NifAnswers* answers);

/* ---- Exact answers for uncertain rays ---------------------------------------------------------------- */

/* The caller's function that answers rays exactly, e.g. with a triangle BVH. For each k below count, it sets
 * visible[k] to 1 or 0 for ray number rays[k] of the query. On entry, visible[k] is the learned answer. count
 * is 1 to 1024, and the ray numbers ascend. It is called on every thread that works on the query, possibly at
 * the same time, in the default floating-point environment. It must not throw, and must not query on the same
 * device. Its stack comes on top of nifQuery's. */
typedef void (*NifFallback)(void* user, uint64_t count, const uint64_t* rays, uint8_t* visible);

/* Like nifQuery, but passes uncertain rays to the fallback, in batches: rays that are not certain and whose
 * probability p has max(p, 1 - p) < confidence. Its answers replace the learned ones in all outputs and count
 * as certain: probability 0 or 1, certain 1, logit -NIF_LOGIT_CERTAIN or NIF_LOGIT_CERTAIN. A confidence of
 * 0.5 or less passes no rays, one above 1 passes every ray that is not certain; a negative one or NaN gives
 * NIF_ERROR_INVALID_ARGUMENT. `user` is passed to the fallback. Allocates nothing. The CPU answers it; device
 * memory or a stream gives NIF_ERROR_NOT_AVAILABLE. */
NIF_API NifError nifQueryWithFallback(NifScene scene, const NifRays* rays, const NifAnswers* answers,
                                      float confidence, NifFallback fallback, void* user);

/* ---- Rays that proofs leave open ---------------------------------------------------------------------- */

/* Lists of the rays that a query leaves open, for the caller's BVH: entry k is about ray number rays[k] of
 * the query. If anything blocks that ray, it does so between tmin[k] and tmax[k]. This interval lies within
 * the query's own tmin .. tmax, and is not NaN. */
typedef struct NifOpenRays {
  uint64_t struct_size;
  uint64_t capacity; /* entries that fit in each list; may be 0 */
  uint32_t* rays;    /* [capacity] */
  float* tmin;       /* [capacity], in the query's t, or null */
  float* tmax;       /* [capacity], likewise */
  uint32_t* count;   /* receives how many rays are open, which may be more than capacity; aligned to 4 */
  /* [capacity] or null. The instance, if only one leaves the ray open: then only it needs testing. NIF_NONE
   * if several do. */
  uint32_t* instance;
} NifOpenRays;

/* Answers the rays that have a proof and lists the others, without evaluating the networks of `segment`
 * objects. Objects of the encoding `proof` are made for this query; for others, the lists have the rays that
 * nifQuery would not call certain. For listed rays the outputs are visible 0, certain 0, probability 0.5 and
 * logit -1. Invalid rays are answered as by nifQuery, and not listed.
 *
 * Which rays are listed, with which tmin and tmax, does not depend on threads, instruction set or GPU; their
 * order does. If the lists are too small, they are filled, and the remaining rays are only counted. All
 * outputs may be null, and so may `answers`. At most 2^32 - 1 rays. Otherwise like nifQuery. Allocates
 * nothing.
 *
 * The CPU answers queries in host memory, even on a GPU device; a stream then gives NIF_ERROR_NOT_AVAILABLE.
 * For rays in device memory, all arrays of `open` are in device memory too, and the call returns at once: the
 * stream sets the count to 0, then lists the rays, ready for the stream's next work. */
NIF_API NifError nifQueryOpen(NifScene scene, const NifRays* rays, const NifAnswers* answers,
                              const NifOpenRays* open);

/* ---- First hits --------------------------------------------------------------------------------------- */

/* Where rays first meet the scene: dense arrays, as in NifAnswers. Set at least one; leave the others null.
 *
 * A ray has a hit exactly if nifQuery says occluded. Objects with triangles (`bvh`, `exact`) give the exact
 * first hit. `segment` and `proof` objects give the middle between two planes around the surface, which is
 * off by some hundredths to tenths of a voxel. A `spherical` object only knows that it is hit: t is where the
 * ray enters its box. */
typedef struct NifHits {
  uint64_t struct_size;
  uint8_t* hit; /* [count] 1: the ray hits something; 0: it does not, or is invalid */
  /* [count] Where, in units of the ray's direction. Finite, and from tmin to tmax (on a triangle: computed in
   * double precision and rounded once). INFINITY if hit is 0. */
  float* t;
  /* [count][3] The geometric normal at the hit, in world space: of unit length, on the side that the ray
   * comes from. If the object does not know it, the opposite of the ray's direction. 0 if hit is 0. */
  float* normal;
  /* [count] The scene's number of the instance hit; of several at the same t, the lowest. NIF_NONE if hit is
   * 0. */
  uint32_t* instance;
  uint32_t* object; /* [count] that instance's object, as numbered in its asset; NIF_NONE if hit is 0 */
  /* [count] The triangle hit. If the object has source triangles (NifObjectInfo.source_triangles), its number
   * in the source mesh, as docs/meshes.md counts; otherwise its index among the triangles that the object
   * stores, which are in another order than in the source mesh and lack those that the bake dropped. Of
   * several at the same t, the first one in the object. NIF_NONE if hit is 0, or if the object has no
   * triangles. */
  uint32_t* triangle;
  /* [count] Barycentric coordinates: the hit is 1 - u - v of the triangle's first vertex, u of its second and
   * v of its third, in the order of the source mesh. 0 if there is no triangle. */
  float* u;
  float* v;
  /* [count] 1: it is proven whether the ray hits something. As NifAnswers.certain. */
  uint8_t* certain;
  /* [count] Proven bounds of the first hit: nothing is hit before t_low, and something is hit at or before
   * t_high. If it is certain that there is no hit, both are INFINITY; if nothing is proven, they are
   * -INFINITY and INFINITY. For hits on triangles both equal t, unless an instance about which nothing is
   * proven may be hit earlier. */
  float* t_low;
  float* t_high;
  /* [count][3] The surface's base colour, linear red, green and blue from 0 to 1: the mean over the voxel
   * that contains the hit. 0.5 0.5 0.5 if the object has no colours (NifObjectInfo.colors). 0 if hit is 0. */
  float* color;
  uint64_t* user; /* [count] the user value of the instance (nifSetInstanceUser); 0 if hit is 0 */
} NifHits;

#define NIF_NONE 0xffffffffu

/* Finds the first hit of each ray. The answers do not depend on threads, instruction set or GPU. Otherwise
 * like nifQuery, including the scratch that it needs (nifGetQueryScratchBytes).
 *
 * The CPU answers queries in host memory, even on a GPU device; a stream then gives NIF_ERROR_NOT_AVAILABLE.
 * For rays in device memory, all arrays of `hits` are in device memory too, with any alignment, and the call
 * returns at once: the stream finds the hits, with networks in single precision. */
NIF_API NifError nifIntersect(NifScene scene, const NifRays* rays, const NifHits* hits);

/* Finds the first hit of one ray, with the mask 0xffffffff: `hits` has arrays of one element. The CPU finds
 * it, even with a GPU backend. Otherwise like nifIntersect. */
NIF_API NifError nifIntersectRay(NifScene scene, const NifRay* ray, const NifHits* hits);

/* ---- Asynchronous queries ---------------------------------------------------------------------------- */

/* A query that runs in the background. Reference-counted like all handles. */
typedef struct NifJobHandle* NifJob;

/* Starts a query and returns a job for it. The arguments are checked first, as in nifQuery; if that fails,
 * there is no job. Do not change the arrays or the scene until the job is done. The structures are
 * copied; scratch is not used. The job is allocated with the device's allocator.
 *
 * The caller's task runner answers it, if the device has one; otherwise the device's own threads (threads - 1
 * of them); with threads=1 the calling thread, before this returns. On a GPU, a query in device memory runs
 * in its stream, and one in host memory is answered before this returns. */
NIF_API NifError nifQueryAsync(NifScene scene, const NifRays* rays, const NifAnswers* answers, NifJob* job);

/* The same for first hits: nifIntersect in the background. The CPU answers queries in host memory, even on a
 * GPU device, as it would on a CPU device. */
NIF_API NifError nifIntersectAsync(NifScene scene, const NifRays* rays, const NifHits* hits, NifJob* job);

/* Waits until the job is done and returns the query's code. The calling thread first helps with rays that no
 * thread has started, so this returns even if a task runner never runs its tasks. Thread-safe; allocates
 * nothing; needs as much stack as nifQuery. */
NIF_API NifError nifWaitJob(NifJob job);

/* Sets *done to 1 if the job is done, else to 0, without waiting. After a 1, the calling thread sees
 * everything that the job wrote. Thread-safe; allocates nothing. */
NIF_API NifError nifIsJobDone(NifJob job, uint32_t* done);

/* Stops a job early: rays that no thread has started are not answered. The job is done when the threads that
 * work on it have finished their current rays, at most 1,024 each. Then nifWaitJob returns
 * NIF_ERROR_CANCELLED, unless all rays were already answered. Returns at once. A job on a GPU is not stopped.
 * Thread-safe; allocates nothing. */
NIF_API NifError nifCancelJob(NifJob job);

/* A job keeps its scene alive until it is done, and its device until the caller's task runner has run all
 * tasks. Releasing a job neither waits for it nor stops it. */
NIF_API void nifRetainJob(NifJob job);
NIF_API void nifReleaseJob(NifJob job);

/* ---- Experimental: may change or go away. --------------------------------------------------------------
 * Define NIF_EXPERIMENTAL to see it. The shared library has it only if it was built with the CMake option
 * NIF_EXPERIMENTAL; the static library always has it. */

#ifdef NIF_EXPERIMENTAL
typedef enum NifMeasure {
  NIF_MEASURE_QUERY = 0,      /* as the device answers it */
  NIF_MEASURE_ONE_KERNEL = 1, /* one kernel, as with pipeline=off */
  NIF_MEASURE_PIPELINE = 2,   /* the pipeline, as with pipeline=on; one kernel if there is no network */
  NIF_MEASURE_STAGES = 3,     /* each stage of the pipeline */
  /* For scenes of `bvh` objects and `visible` only: tests triangles in single precision, to see what the
   * proofs in double precision cost. The answers are not those of a query. */
  NIF_MEASURE_SINGLE_BVH = 4,
  NIF_MEASURE_IS_32_BITS = 0x7fffffff
} NifMeasure;

/* The stages of NIF_MEASURE_STAGES, in order: traversal of the top level and the voxels ("ray cast"); sorting
 * the items; inputs, then networks, of `segment` objects and of outer `spherical` items; inputs, then
 * networks, of inner `spherical` items; the remaining work, which single threads do. Inputs are timed by a
 * launch without networks; the networks' time is how much longer a full launch takes. */
#define NIF_MEASURED_STAGES 7

/* Measures how long the GPU takes for a query, without copies. It copies the rays to the GPU, answers them
 * there once and then `rounds` times more, each timed by the GPU's clock, and copies the answers to
 * `answers`. `seconds` receives [rounds] values, or [rounds][NIF_MEASURED_STAGES] with NIF_MEASURE_STAGES.
 * The query must be in host memory, without a stream. It uses GPU memory for all rays, and frees it before it
 * returns. NIF_ERROR_NOT_AVAILABLE on the CPU. */
NIF_API NifError nifMeasureQuery(NifScene scene, const NifRays* rays, const NifAnswers* answers,
                                 NifMeasure measure, uint32_t rounds, double* seconds);
#endif

#ifdef __cplusplus
}
#endif

#endif /* NIF_NIF_H */
