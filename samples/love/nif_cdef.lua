-- The declarations of nif.h that the game uses, in the form that LuaJIT's FFI reads: without macros and comments (those are in
-- nif.h). They must match nif.h: test_cdef.lua has a C compiler compare the two.
return [[
typedef enum NifError {
  NIF_OK = 0,
  NIF_ERROR_NOT_AVAILABLE = 5,
  NIF_ERROR_FILE_NOT_FOUND = 10,
  NIF_ERROR_ENUM_IS_32_BITS = 0x7fffffff
} NifError;

uint32_t nifGetVersion(void);
const char* nifGetErrorMessage(void);
const char* nifGetErrorName(NifError error);

typedef struct NifDeviceHandle* NifDevice;
typedef struct NifAssetHandle* NifAsset;
typedef struct NifSceneHandle* NifScene;

typedef struct NifDeviceCallbacks NifDeviceCallbacks;
NifError nifNewDevice(const char* config, const NifDeviceCallbacks* callbacks, NifDevice* device);
void nifReleaseDevice(NifDevice device);

typedef struct NifDeviceInfo {
  uint64_t struct_size;
  uint32_t threads;
  uint32_t reserved;
  const char* isa;
  const char* backend;
  const char* gpu;
} NifDeviceInfo;
NifError nifGetDeviceInfo(NifDevice device, NifDeviceInfo* info);

typedef enum NifLoadMode {
  NIF_LOAD_COPY = 0,
  NIF_LOAD_IN_PLACE = 1,
  NIF_LOAD_MODE_IS_32_BITS = 0x7fffffff
} NifLoadMode;
NifError nifLoadAssetFile(NifDevice device, const char* path, NifLoadMode mode, NifAsset* asset);
void nifReleaseAsset(NifAsset asset);

typedef struct NifAssetInfo {
  uint64_t struct_size;
  uint32_t object_count;
  uint32_t instance_count;
  uint32_t network_count;
  uint32_t format_version;
  uint64_t file_bytes;
  uint64_t resident_bytes;
  const char* metadata;
  uint64_t metadata_bytes;
  uint64_t gpu_bytes;
  uint32_t places_nothing;
  uint32_t arithmetic;
  uint32_t prover;
  uint32_t proves;
} NifAssetInfo;
NifError nifGetAssetInfo(NifAsset asset, NifAssetInfo* info);

typedef enum NifEncoding {
  NIF_ENCODING_PROOF = 5,
  NIF_ENCODING_IS_32_BITS = 0x7fffffff
} NifEncoding;

typedef struct NifObjectInfo {
  uint64_t struct_size;
  const char* name;
  uint32_t encoding;
  uint32_t network;
  float bounds_min[3];
  float bounds_max[3];
  float bias;
  uint32_t triangles;
  uint64_t resident_bytes;
  uint32_t proves;
  uint32_t source_triangles;
  uint32_t colors;
  uint32_t level;
  float error;
  const char* unsupported;
} NifObjectInfo;
NifError nifGetObjectInfo(NifAsset asset, uint32_t object, NifObjectInfo* info);

NifError nifNewScene(NifDevice device, NifScene* scene);
void nifReleaseScene(NifScene scene);
NifError nifAddAsset(NifScene scene, NifAsset asset, const float* transform, uint32_t* first, uint32_t* count);
NifError nifCommitScene(NifScene scene);

typedef struct NifSceneInfo {
  uint64_t struct_size;
  uint32_t instance_count;
  uint32_t instance_end;
  float bounds_min[3];
  float bounds_max[3];
  uint64_t resident_bytes;
  double origin[3];
  uint32_t committed;
  uint32_t reserved;
} NifSceneInfo;
NifError nifGetSceneInfo(NifScene scene, NifSceneInfo* info);

typedef struct NifRay {
  float origin[3];
  float tmin;
  float direction[3];
  float tmax;
} NifRay;

typedef enum NifMemory {
  NIF_MEMORY_HOST = 0,
  NIF_MEMORY_DEVICE = 1,
  NIF_MEMORY_IS_32_BITS = 0x7fffffff
} NifMemory;

typedef struct NifRays {
  uint64_t struct_size;
  uint64_t count;
  const float* origin[3];
  uint64_t origin_stride;
  const float* direction[3];
  uint64_t direction_stride;
  const float* tmin;
  uint64_t tmin_stride;
  const float* tmax;
  uint64_t tmax_stride;
  const uint32_t* mask;
  uint64_t mask_stride;
  uint32_t memory;
  uint32_t flags;
  void* scratch;
  uint64_t scratch_bytes;
  void* stream;
} NifRays;

typedef struct NifAnswers {
  uint64_t struct_size;
  uint8_t* visible;
  uint8_t* visible_bits;
  float* probability;
  uint8_t* certain;
  int32_t* logit;
} NifAnswers;
NifError nifQuery(NifScene scene, const NifRays* rays, const NifAnswers* answers);

typedef struct NifHits {
  uint64_t struct_size;
  uint8_t* hit;
  float* t;
  float* normal;
  uint32_t* instance;
  uint32_t* object;
  uint32_t* triangle;
  float* u;
  float* v;
  uint8_t* certain;
  float* t_low;
  float* t_high;
  float* color;
  uint64_t* user;
} NifHits;
NifError nifIntersect(NifScene scene, const NifRays* rays, const NifHits* hits);
]]
