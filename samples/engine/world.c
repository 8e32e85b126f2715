/* The first copy is committed alone, to measure how much room one needs; then the others are placed.
 * A frame sets the transforms of all instances and commits once. */
#include "world.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static int failed(const char* what) {
  fprintf(stderr, "engine: %s: %s\n", what, nifGetErrorMessage());
  return 0;
}

/* c = a b for 3x4 matrices: applies b, then a. */
static void multiply(const float* a, const float* b, float* c) {
  int row, column, k;
  for (row = 0; row < 3; ++row) {
    for (column = 0; column < 4; ++column) {
      float sum = column == 3 ? a[4 * row + 3] : 0;
      for (k = 0; k < 3; ++k) sum += a[4 * row + k] * b[4 * k + column];
      c[4 * row + column] = sum;
    }
  }
}

/* A number in 0 .. 1 that depends only on the argument. */
static float random_of(uint32_t number) {
  number = (number ^ number >> 16) * 0x7feb352du;
  number = (number ^ number >> 15) * 0x846ca68bu;
  return (float)((number ^ number >> 16) >> 8) / (1 << 24);
}

/* The transform of a copy in a frame: it rotates around the y axis and bobs, at a random place or on a square
 * grid. */
static void place(const World* world, uint32_t copy, int frame, float* t) {
  uint32_t side = (uint32_t)ceil(sqrt((double)world->copies));
  float angle = 0.05f * (float)frame + (float)copy;
  float size = world->scatter ? 0.5f + random_of(3 * copy) : 1;
  float column = world->scatter ? (float)side * random_of(3 * copy + 1) : (float)(copy % side);
  float row = world->scatter ? (float)side * random_of(3 * copy + 2) : (float)(copy / side);
  float c = size * cosf(angle), s = size * sinf(angle);
  float middle[3];
  int axis;
  for (axis = 0; axis < 3; ++axis) middle[axis] = (world->low[axis] + world->high[axis]) / 2;
  memset(t, 0, 12 * sizeof(float));
  t[0] = c, t[2] = s, t[5] = size, t[8] = -s, t[10] = c;
  t[3] = world->spacing * column - c * middle[0] - s * middle[2];
  t[7] = 0.1f * (world->high[1] - world->low[1]) * sinf(2 * angle);
  t[11] = world->spacing * row + s * middle[0] - c * middle[2];
}

int make_world(NifDevice device, NifAsset asset, uint32_t copies, int scatter, World* world) {
  NifSceneInfo info = {.struct_size = sizeof(info)};
  NifAssetInfo about = {.struct_size = sizeof(about)};
  float extent, transform[12];
  uint32_t i, side = (uint32_t)ceil(sqrt((double)copies));
  int axis;

  memset(world, 0, sizeof(*world));
  if (nifGetAssetInfo(asset, &about) != NIF_OK) return failed("asset");
  world->copies = copies;
  world->scatter = scatter;
  world->per_copy = about.instance_count;
  for (i = 0; i < about.object_count && about.instance_count == 0; ++i) {
    NifObjectInfo object = {.struct_size = sizeof(object)};
    if (nifGetObjectInfo(asset, i, &object) != NIF_OK) return failed("asset");
    if (object.level == 0) ++world->per_copy; /* the others are coarser stand-ins */
  }
  world->own = calloc(world->per_copy, sizeof(*world->own));
  world->transforms = calloc((size_t)copies * world->per_copy, sizeof(*world->transforms));
  if (world->own == NULL || world->transforms == NULL) {
    fputs("engine: out of memory\n", stderr);
    return 0;
  }
  for (i = 0; i < world->per_copy; ++i) {
    NifAssetInstanceInfo instance = {.struct_size = sizeof(instance)};
    if (about.instance_count == 0) {
      world->own[i][0] = world->own[i][5] = world->own[i][10] = 1;
    } else if (nifGetAssetInstanceInfo(asset, i, &instance) == NIF_OK) {
      memcpy(world->own[i], instance.transform, sizeof(world->own[i]));
    } else {
      return failed("asset");
    }
  }

  /* One copy shows how much room each needs. */
  if (nifNewScene(device, &world->scene) != NIF_OK ||
      nifAddAsset(world->scene, asset, NULL, NULL, NULL) != NIF_OK ||
      nifCommitScene(world->scene) != NIF_OK || nifGetSceneInfo(world->scene, &info) != NIF_OK) {
    return failed("scene");
  }
  extent = 0;
  for (axis = 0; axis < 3; ++axis) {
    world->low[axis] = info.bounds_min[axis];
    world->high[axis] = info.bounds_max[axis];
    extent = fmaxf(extent, world->high[axis] - world->low[axis]);
  }
  if (!(extent > 0)) {
    fputs("engine: the asset is empty\n", stderr);
    return 0;
  }
  world->spacing = 1.5f * extent;
  for (i = 1; i < copies; ++i) {
    place(world, i, 0, transform);
    if (nifAddAsset(world->scene, asset, transform, NULL, NULL) != NIF_OK) return failed("scene");
  }

  world->sun[0] = 0.5f, world->sun[1] = 0.8f, world->sun[2] = 0.33f;
  for (axis = 0; axis < 2; ++axis) {
    world->floor_low[axis] = -world->spacing;
    world->floor_size[axis] = world->spacing * (float)(side + 1);
  }
  world->floor_height = world->low[1] - 0.2f * extent;
  world->lamp[0] = world->floor_low[0] + world->floor_size[0] / 2;
  world->lamp[1] = world->high[1] + extent;
  world->lamp[2] = world->floor_low[1] + world->floor_size[1] / 2;
  return 1;
}

int commit_world(World* world) { return nifCommitScene(world->scene) == NIF_OK ? 1 : failed("commit"); }

int move_world(World* world, int frame) {
  uint32_t copy, i;
  for (copy = 0; copy < world->copies; ++copy) {
    float placed[12];
    place(world, copy, frame, placed);
    for (i = 0; i < world->per_copy; ++i)
      multiply(placed, world->own[i], world->transforms[(size_t)copy * world->per_copy + i]);
  }
  /* All instances of the scene, in the order in which they were added. */
  if (nifSetInstanceTransforms(world->scene, (uint64_t)world->copies * world->per_copy, NULL,
                               world->transforms[0], sizeof(world->transforms[0])) != NIF_OK)
    return failed("move");
  return commit_world(world);
}

void free_world(World* world) {
  nifReleaseScene(world->scene);
  free(world->own);
  free(world->transforms);
  memset(world, 0, sizeof(*world));
}
