/* 64 rays go from the listener to points spread evenly through a ball; the share of visible ones is the
 * answer. The asset is first measured alone in a scene, so that it can be scaled and centred. */
#include "occlusion.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static int failed(const char* what) {
  fprintf(stderr, "audio: %s: %s\n", what, nifGetErrorMessage());
  return 0;
}

/* Points that fill the unit ball evenly: a spiral of the golden angle with alternating radii. */
static void fill_ball(float (*points)[3], int count) {
  const double golden = 2.399963229728653;
  int i;
  for (i = 0; i < count; ++i) {
    double height = 1 - (2 * i + 1.0) / count, around = sqrt(1 - height * height);
    double radius = cbrt(((i * 29) % count + 0.5) / count);
    points[i][0] = (float)(radius * around * cos(golden * i));
    points[i][1] = (float)(radius * height);
    points[i][2] = (float)(radius * around * sin(golden * i));
  }
}

/* Objects with the encoding proof leave rays open for a BVH, which this program does not have. */
static int answers_all(const Occlusion* occlusion, const char* path) {
  NifAssetInfo asset = {.struct_size = sizeof(asset)};
  uint32_t i;
  if (nifGetAssetInfo(occlusion->asset, &asset) != NIF_OK) return failed("asset");
  for (i = 0; i < asset.object_count; ++i) {
    NifObjectInfo object = {.struct_size = sizeof(object)};
    if (nifGetObjectInfo(occlusion->asset, i, &object) != NIF_OK) return failed("asset");
    if (object.encoding == NIF_ENCODING_PROOF) {
      fprintf(stderr, "audio: %s: an asset of the encoding proof leaves rays open; bake another one\n", path);
      return 0;
    }
  }
  return 1;
}

/* The bounding box of the asset as placed in its file. */
static int measure(Occlusion* occlusion, float* low, float* high) {
  NifScene alone = NULL;
  NifSceneInfo info = {.struct_size = sizeof(info)};
  int fine = nifNewScene(occlusion->device, &alone) == NIF_OK &&
             nifAddAsset(alone, occlusion->asset, NULL, NULL, NULL) == NIF_OK &&
             nifCommitScene(alone) == NIF_OK && nifGetSceneInfo(alone, &info) == NIF_OK;
  memcpy(low, info.bounds_min, sizeof(info.bounds_min));
  memcpy(high, info.bounds_max, sizeof(info.bounds_max));
  if (!fine) failed("scene");
  nifReleaseScene(alone);
  return fine;
}

int occlusion_open(Occlusion* occlusion, const char* path, int up, int front, const float* middle,
                   float size) {
  float low[3], high[3], axes[3][3] = {{0}}, transform[12], longest = 0;
  int row, column;
  memset(occlusion, 0, sizeof(*occlusion));
  fill_ball(occlusion->spread, RAYS);
  if (nifNewDevice(NULL, NULL, &occlusion->device) != NIF_OK) return failed("device");
  /* The message names the file. */
  if (nifLoadAssetFile(occlusion->device, path, NIF_LOAD_COPY, &occlusion->asset) != NIF_OK)
    return failed("asset");
  if (!answers_all(occlusion, path) || !measure(occlusion, low, high)) return 0;
  for (row = 0; row < 3; ++row) longest = fmaxf(longest, high[row] - low[row]);
  if (!(longest > 0)) {
    fprintf(stderr, "audio: %s: the asset is empty\n", path);
    return 0;
  }

  axes[1][up] = 1;
  axes[2][front] = 1;
  for (column = 0; column < 3; ++column) { /* right = up x front */
    int a = (column + 1) % 3, b = (column + 2) % 3;
    axes[0][column] = axes[1][a] * axes[2][b] - axes[1][b] * axes[2][a];
  }
  for (row = 0; row < 3; ++row) {
    float* t = transform + 4 * row;
    t[3] = middle[row];
    for (column = 0; column < 3; ++column) {
      t[column] = axes[row][column] * size / longest;
      t[3] -= t[column] * (low[column] + high[column]) / 2;
    }
  }
  if (nifNewScene(occlusion->device, &occlusion->scene) != NIF_OK ||
      nifAddAsset(occlusion->scene, occlusion->asset, transform, NULL, NULL) != NIF_OK ||
      nifCommitScene(occlusion->scene) != NIF_OK) {
    return failed("scene");
  }
  return 1;
}

double occlusion_share(Occlusion* occlusion, const float* listener, const float* source, float radius) {
  const NifRays rays = nifMakeRays(occlusion->rays, RAYS);
  const NifAnswers answers = {.struct_size = sizeof(answers), .visible = occlusion->visible};
  int i, axis, count = 0;
  for (i = 0; i < RAYS; ++i) {
    NifRay* ray = &occlusion->rays[i];
    ray->tmin = 0;
    ray->tmax = 1; /* the direction reaches from the listener to the point */
    for (axis = 0; axis < 3; ++axis) {
      ray->origin[axis] = listener[axis];
      ray->direction[axis] = source[axis] + radius * occlusion->spread[i][axis] - listener[axis];
    }
  }
  if (nifQuery(occlusion->scene, &rays, &answers) != NIF_OK) {
    failed("query");
    return -1;
  }
  for (i = 0; i < RAYS; ++i) count += occlusion->visible[i];
  return (double)count / RAYS;
}

void occlusion_close(Occlusion* occlusion) {
  nifReleaseScene(occlusion->scene);
  nifReleaseAsset(occlusion->asset);
  nifReleaseDevice(occlusion->device);
  memset(occlusion, 0, sizeof(*occlusion));
}
