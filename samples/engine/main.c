/* How a game uses nifkit: an asset is loaded from memory, its copies move each frame, and the program's own
 * threads answer the frame's shadow rays in batches. Prints the time of frames. */
#define _POSIX_C_SOURCE 200809L
#include <nif/nif.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "frame.h"
#include "jobs.h"
#include "options.h"
#include "stream.h"
#include "world.h"

static double now(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static int compare(const void* a, const void* b) {
  double x = *(const double*)a, y = *(const double*)b;
  return (x > y) - (x < y);
}

/* Sorts. */
static void print_times(const char* what, double* seconds, int count) {
  qsort(seconds, (size_t)count, sizeof(double), compare);
  printf("%-10s %9.3f %9.3f %9.3f\n", what, 1e3 * seconds[0], 1e3 * seconds[count / 2],
         1e3 * seconds[count - 1]);
}

/* Commits the world for the first time, and prints the time. */
static int build(World* world, NifAsset asset) {
  NifAssetInfo of_asset = {.struct_size = sizeof(of_asset)};
  NifSceneInfo of_scene = {.struct_size = sizeof(of_scene)};
  double start = now(), seconds;
  if (!commit_world(world)) return 0;
  seconds = now() - start;
  if (nifGetAssetInfo(asset, &of_asset) != NIF_OK || nifGetSceneInfo(world->scene, &of_scene) != NIF_OK) {
    fprintf(stderr, "engine: scene: %s\n", nifGetErrorMessage());
    return 0;
  }
  printf("first commit of %u instances: %.3f ms\n", of_scene.instance_count, 1e3 * seconds);
  printf("bytes: %llu of the asset, %llu of the scene: %.1f an instance\n\n",
         (unsigned long long)of_asset.resident_bytes, (unsigned long long)of_scene.resident_bytes,
         (double)of_scene.resident_bytes / of_scene.instance_count);
  return 1;
}

static int run(const Options* options, World* world, Jobs* jobs, Frame* frame, double* seconds) {
  double *move = seconds, *ask = seconds + options->frames, *all = seconds + 2 * options->frames, asking = 0;
  uint64_t lit = 0;
  double rays = 2.0 * options->rays * options->frames;
  int i;
  for (i = 0; i < options->frames; ++i) {
    double start = now(), moved;
    if (!move_world(world, i)) return 0;
    moved = now();
    if (!ask_frame(world, jobs, frame)) return 0;
    all[i] = now() - start;
    move[i] = moved - start;
    ask[i] = all[i] - move[i];
    asking += ask[i];
    lit += frame->lit;
  }
  printf("%-10s %9s %9s %9s\n", "ms", "min", "median", "max");
  print_times("move", move, options->frames);
  print_times("shadows", ask, options->frames);
  print_times("frame", all, options->frames);
  printf("\n%.3g million rays per second, %.1f %% of them visible\n", asking > 0 ? 1e-6 * rays / asking : 0.0,
         100 * (double)lit / rays);
  return 1;
}

int main(int argc, char** argv) {
  Options options;
  NifDevice device = NULL;
  NifAsset asset = NULL;
  NifDeviceInfo about = {.struct_size = sizeof(about)};
  World world = {0};
  Frame frame = {0};
  Jobs* jobs = NULL;
  double* seconds = NULL;
  char config[64];
  int fine = 0, usage = read_options(argc, argv, &options);
  if (usage != 0) return usage == 1 ? 0 : 2;

  /* This many queries can run at once; others wait until one ends. */
  snprintf(config, sizeof(config), "queries=%d", options.threads);
  if (nifNewDevice(config, NULL, &device) != NIF_OK || nifGetDeviceInfo(device, &about) != NIF_OK) {
    fprintf(stderr, "engine: device: %s\n", nifGetErrorMessage());
  } else if ((jobs = jobs_start(options.threads)) == NULL ||
             (seconds = malloc(3 * (size_t)options.frames * sizeof(double))) == NULL) {
    fputs("engine: no memory or no threads\n", stderr);
  } else if (stream_asset(device, options.path, &asset) &&
             make_world(device, asset, (uint32_t)options.instances, options.scatter, &world) &&
             make_frame(&world, options.rays, &frame)) {
    printf("%s: %d copies, %d frames, %d threads, %s\n\n", options.path, options.instances, options.frames,
           options.threads, about.isa);
    fine = build(&world, asset) && run(&options, &world, jobs, &frame, seconds);
  }
  jobs_stop(jobs);
  free(seconds);
  free_frame(&frame);
  free_world(&world);
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
  return fine ? 0 : 1;
}
