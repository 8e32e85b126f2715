/* A program that was compiled with the first frozen nif.h, against today's library. Each structure is passed with the
 * size that it had then: what lies behind it must stay as it is. Then each is passed as a newer header might have it,
 * longer: what the library does not know must be zero, and what it is asked for and does not know must be refused. */
#include <stdio.h>
#include <string.h>

#include "nif_first.h"

#define CHECK(condition)                                                                        \
  do {                                                                                          \
    if (!(condition)) {                                                                         \
      fprintf(stderr, "%s:%d: %s: %s\n", __FILE__, __LINE__, #condition, nifGetErrorMessage()); \
      return 1;                                                                                 \
    }                                                                                           \
  } while (0)

enum { kMore = 24, kGuard = 0x5a };

/* A structure with bytes behind it: of the caller's own, or members of a newer header. */
#define PADDED(Structure)      \
  struct {                     \
    Structure own;             \
    unsigned char more[kMore]; \
  }

static int all_are(const unsigned char* bytes, int value) {
  int i;
  for (i = 0; i < kMore; ++i)
    if (bytes[i] != value) return 0;
  return 1;
}

/* call: an expression with &it.own. Information that the library fills in. */
#define FILLS(Structure, call)                   \
  do {                                           \
    PADDED(Structure) it;                        \
    memset(&it, kGuard, sizeof(it));             \
    it.own.struct_size = sizeof(it.own);         \
    CHECK((call) == NIF_OK);                     \
    CHECK(it.own.struct_size == sizeof(it.own)); \
    CHECK(all_are(it.more, kGuard));             \
    it.own.struct_size = sizeof(it.own) + kMore; \
    CHECK((call) == NIF_OK);                     \
    CHECK(all_are(it.more, 0));                  \
    it.own.struct_size = sizeof(it.own) - 8;     \
    CHECK((call) == NIF_ERROR_INVALID_ARGUMENT); \
  } while (0)

/* What the caller passes in; good: how it is filled. */
#define TAKES(Structure, good, call)             \
  do {                                           \
    PADDED(Structure) it;                        \
    memset(&it, 0, sizeof(it));                  \
    it.own = (good);                             \
    memset(it.more, kGuard, kMore);              \
    it.own.struct_size = sizeof(it.own);         \
    CHECK((call) == NIF_OK);                     \
    memset(it.more, 0, kMore);                   \
    it.own.struct_size = sizeof(it.own) + kMore; \
    CHECK((call) == NIF_OK);                     \
    it.more[kMore - 1] = 1;                      \
    CHECK((call) == NIF_ERROR_NOT_AVAILABLE);    \
    it.own.struct_size = sizeof(it.own) - 8;     \
    CHECK((call) == NIF_ERROR_INVALID_ARGUMENT); \
  } while (0)

static uint32_t read_file(void* user, uint64_t offset, void* to, uint64_t size) {
  return fseek((FILE*)user, (long)offset, SEEK_SET) == 0 && fread(to, 1, size, (FILE*)user) == size;
}

int main(int argc, char** argv) {
  NifDevice device = NULL, other = NULL;
  NifAsset asset = NULL;
  NifScene scene = NULL;
  const NifRay ray = {{0, 0, -9}, 0, {0, 0, 1}, 1};
  const NifRays rays = nifMakeRays(&ray, 1);
  uint8_t byte = 0;
  uint32_t number = 0, count = 0;
  NifDeviceCallbacks callbacks;
  NifReader reader;
  NifAnswers answers;
  NifHits hits;
  NifOpenRays open;
  FILE* file;

  CHECK(argc == 2);
  CHECK(nifNewDevice(NULL, NULL, &device) == NIF_OK);
  CHECK(nifLoadAssetFile(device, argv[1], NIF_LOAD_COPY, &asset) == NIF_OK);
  CHECK(nifNewScene(device, &scene) == NIF_OK);
  CHECK(nifAddAsset(scene, asset, NULL, NULL, NULL) == NIF_OK);
  CHECK(nifCommitScene(scene) == NIF_OK);

  FILLS(NifDeviceInfo, nifGetDeviceInfo(device, &it.own));
  FILLS(NifBackendInfo, nifGetBackendInfo(0, &it.own));
  FILLS(NifAssetInfo, nifGetAssetInfo(asset, &it.own));
  FILLS(NifPartInfo, nifGetPartInfo(asset, 0, &it.own));
  FILLS(NifObjectInfo, nifGetObjectInfo(asset, 0, &it.own));
  FILLS(NifAssetInstanceInfo, nifGetAssetInstanceInfo(asset, 0, &it.own));
  FILLS(NifInstanceInfo, nifGetInstanceInfo(scene, 0, &it.own));
  FILLS(NifSceneInfo, nifGetSceneInfo(scene, &it.own));
  if (nifGetBackendInfo(1, &(NifBackendInfo){.struct_size = sizeof(NifBackendInfo)}) == NIF_OK) {
    NifGpuInfo gpu = {.struct_size = sizeof(gpu)};
    if (nifGetGpuInfo(0, &gpu) == NIF_OK) FILLS(NifGpuInfo, nifGetGpuInfo(0, &it.own));
  }

  memset(&callbacks, 0, sizeof(callbacks));
  TAKES(NifDeviceCallbacks, callbacks, (nifReleaseDevice(other), nifNewDevice(NULL, &it.own, &other)));
  nifReleaseDevice(other);

  file = fopen(argv[1], "rb");
  CHECK(file != NULL);
  CHECK(fseek(file, 0, SEEK_END) == 0);
  memset(&reader, 0, sizeof(reader));
  reader.user = file;
  reader.size = (uint64_t)ftell(file);
  reader.read = read_file;
  TAKES(NifReader, reader, (nifReleaseAsset(asset), nifLoadAssetReader(device, &it.own, &asset)));
  fclose(file);

  memset(&answers, 0, sizeof(answers));
  answers.struct_size = sizeof(answers);
  answers.visible = &byte;
  memset(&hits, 0, sizeof(hits));
  hits.hit = &byte;
  memset(&open, 0, sizeof(open));
  open.capacity = 1;
  open.rays = &number;
  open.count = &count;
  TAKES(NifRays, rays, nifQuery(scene, &it.own, &answers));
  TAKES(NifAnswers, answers, nifQuery(scene, &rays, &it.own));
  TAKES(NifHits, hits, nifIntersect(scene, &rays, &it.own));
  TAKES(NifOpenRays, open, nifQueryOpen(scene, &rays, &answers, &it.own));

  nifReleaseScene(scene);
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
  return 0;
}
