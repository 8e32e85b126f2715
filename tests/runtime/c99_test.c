/* The header is C99 without extensions, and a C program gets answers through it. */
#include <nif/nif.h>
#include <stdio.h>
#include <string.h>

#define CHECK(condition)                                                                        \
  do {                                                                                          \
    if (!(condition)) {                                                                         \
      fprintf(stderr, "%s:%d: %s: %s\n", __FILE__, __LINE__, #condition, nifGetErrorMessage()); \
      return 1;                                                                                 \
    }                                                                                           \
  } while (0)

enum { kRays = 19 };

static void occlude(void* user, uint64_t count, const uint64_t* indices, uint8_t* answers) {
  uint64_t k;
  for (k = 0; k < count; ++k) answers[k] = indices[k] >= kRays;
  *(uint64_t*)user += count;
}

int main(int argc, char** argv) {
  NifDevice device = NULL;
  NifAsset asset = NULL;
  NifScene scene = NULL;
  NifJob job = NULL;
  NifAssetInfo about = {.struct_size = sizeof(about)};
  NifObjectInfo object = {.struct_size = sizeof(object)};
  NifSceneInfo info = {.struct_size = sizeof(info)};
  NifRay rays[kRays];
  NifRays query;
  NifAnswers answers = {.struct_size = sizeof(answers)}, single = {.struct_size = sizeof(single)};
  NifHits first = {.struct_size = sizeof(first)};
  NifPose pose = {.struct_size = sizeof(pose), .memory = NIF_MEMORY_DEVICE};
  NifOpenRays open;
  uint32_t open_count = 0;
  uint8_t visible[kRays], bits[(kRays + 7) / 8], later[kRays], one;
  uint32_t done = 0;
  uint64_t bytes = 0, asked = 0;
  int i, axis;

  CHECK(argc == 2);
  CHECK(nifGetVersion() == NIF_VERSION);
  CHECK(strcmp(nifGetErrorMessage(), "") == 0);
  CHECK(nifNewDevice("threads=2,isa=auto,backend=cpu", NULL, &device) == NIF_OK);
  CHECK(nifLoadAssetFile(device, "no such file", NIF_LOAD_COPY, &asset) == NIF_ERROR_FILE_NOT_FOUND);
  CHECK(strstr(nifGetErrorMessage(), "no such file") != NULL);
  CHECK(nifLoadAssetFile(device, argv[1], NIF_LOAD_IN_PLACE, &asset) == NIF_OK);
  CHECK(nifGetAssetInfo(asset, &about) == NIF_OK && about.object_count == 3);
  CHECK(nifGetObjectInfo(asset, 0, &object) == NIF_OK && strcmp(object.name, "object 0") == 0);
  CHECK(object.encoding == NIF_ENCODING_SEGMENT && sizeof(object.encoding) == sizeof(uint32_t));
  CHECK(nifNewScene(device, &scene) == NIF_OK);
  CHECK(nifAddAsset(scene, asset, NULL, NULL, NULL) == NIF_OK);
  CHECK(nifCommitScene(scene) == NIF_OK);
  CHECK(nifGetSceneInfo(scene, &info) == NIF_OK && info.instance_count == about.instance_count);
  CHECK(nifPoseInstance(scene, 0, &pose) == NIF_ERROR_NOT_AVAILABLE);
  CHECK(strstr(nifGetErrorMessage(), "this device is a CPU") != NULL);
  nifReleaseAsset(asset);
  nifReleaseDevice(device);

  for (i = 0; i < kRays; ++i) {
    for (axis = 0; axis < 3; ++axis) {
      rays[i].origin[axis] = info.bounds_min[axis] - 1;
      rays[i].direction[axis] = (info.bounds_max[axis] - rays[i].origin[axis]) * (float)(1 + (i + axis) % 5);
    }
    rays[i].tmin = 0;
    rays[i].tmax = 1;
  }
  query = nifMakeRays(rays, kRays);
  answers.visible = visible;
  answers.visible_bits = bits;
  CHECK(nifQuery(scene, &query, &answers) == NIF_OK);
  for (i = 0; i < kRays; ++i) {
    CHECK(visible[i] <= 1);
    CHECK(visible[i] == ((bits[i / 8] >> (i % 8)) & 1));
    single.visible = &one;
    CHECK(nifQueryRay(scene, &rays[i], &single) == NIF_OK && one == visible[i]);
    first.hit = &one;
    CHECK(nifIntersectRay(scene, &rays[i], &first) == NIF_OK && one == !visible[i]);
  }
  CHECK(nifGetQueryScratchBytes(scene, kRays, &bytes) == NIF_OK && bytes > 0);

  answers.visible = later;
  answers.visible_bits = NULL;
  CHECK(nifQueryAsync(scene, &query, &answers, &job) == NIF_OK);
  CHECK(nifWaitJob(job) == NIF_OK);
  CHECK(nifIsJobDone(job, &done) == NIF_OK && done == 1);
  CHECK(memcmp(later, visible, kRays) == 0);
  nifRetainJob(job);
  nifReleaseJob(job);
  nifReleaseJob(job);
  CHECK(nifQueryWithFallback(scene, &query, &answers, 2.0f, occlude, &asked) == NIF_OK);
  for (i = 0; i < kRays; ++i) CHECK(later[i] <= visible[i]);
  memset(&open, 0, sizeof(open));
  open.struct_size = sizeof(open);
  open.count = &open_count;
  CHECK(nifQueryOpen(scene, &query, &answers, &open) == NIF_OK && open_count <= kRays);
  nifReleaseScene(scene);
  return 0;
}
