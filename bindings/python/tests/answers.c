/* answers ASSET RAYS OUT [BATCH ROUNDS THREADS]: what nif.h answers in C, for test_answers.py and measure.py.
 * RAYS is an array of NifRay. Without BATCH it writes all outputs to OUT, an array after the other: of a
 * query, then of first hits. With BATCH it asks ROUNDS times for `visible` of the first BATCH rays, from
 * arrays laid out as numpy's are, one round for each byte on standard input, prints the seconds of a call (of
 * processors, then by the clock), and in the end writes the answers. */
#include <nif/nif.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static void must(NifError error) {
  if (error == NIF_OK) return;
  fprintf(stderr, "%s\n", nifGetErrorMessage());
  exit(1);
}

static void* get(size_t bytes) {
  void* memory = calloc(bytes + 1, 1);
  if (!memory) exit(1);
  return memory;
}

static double now(clockid_t clock) {
  struct timespec time;
  clock_gettime(clock, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

#define HITS 13

static void answer(NifScene scene, const NifRay* rays, size_t n, FILE* out) {
  /* Size of an element, in the order of NifAnswers' and NifHits' members. */
  const size_t answer_bytes[5] = {1, 0, 4, 1, 4}, hit_bytes[HITS] = {1, 4, 12, 4, 4, 4, 4, 4, 1, 4, 4, 12, 8};
  void *answer_array[5], *hit_array[HITS];
  const NifRays batch = nifMakeRays(rays, n);
  for (int i = 0; i < 5; ++i) answer_array[i] = get(i == 1 ? (n + 7) / 8 : n * answer_bytes[i]);
  for (int i = 0; i < HITS; ++i) hit_array[i] = get(n * hit_bytes[i]);
  const NifHits hits = {.struct_size = sizeof(hits),
                        .hit = hit_array[0],
                        .t = hit_array[1],
                        .normal = hit_array[2],
                        .instance = hit_array[3],
                        .object = hit_array[4],
                        .triangle = hit_array[5],
                        .u = hit_array[6],
                        .v = hit_array[7],
                        .certain = hit_array[8],
                        .t_low = hit_array[9],
                        .t_high = hit_array[10],
                        .color = hit_array[11],
                        .user = hit_array[12]};
  must(nifIntersect(scene, &batch, &hits));
  const NifAnswers answers = {.struct_size = sizeof(answers),
                              .visible = answer_array[0],
                              .visible_bits = answer_array[1],
                              .probability = answer_array[2],
                              .certain = answer_array[3],
                              .logit = answer_array[4]};
  must(nifQuery(scene, &batch, &answers));
  for (int i = 0; i < 5; ++i) {
    fwrite(answer_array[i], 1, i == 1 ? (n + 7) / 8 : n * answer_bytes[i], out);
    free(answer_array[i]);
  }
  for (int i = 0; i < HITS; ++i) {
    fwrite(hit_array[i], 1, n * hit_bytes[i], out);
    free(hit_array[i]);
  }
}

static void measure(NifScene scene, const NifRay* rays, size_t n, int rounds, FILE* out) {
  float *origins = get(12 * n), *directions = get(12 * n);
  uint8_t* visible = get(n);
  const NifAnswers answers = {.struct_size = sizeof(answers), .visible = visible};
  NifRays batch = {.struct_size = sizeof(batch), .count = n, .origin_stride = 12, .direction_stride = 12};
  for (int a = 0; a < 3; ++a) {
    batch.origin[a] = origins + a;
    batch.direction[a] = directions + a;
    for (size_t i = 0; i < n; ++i) {
      origins[3 * i + (size_t)a] = rays[i].origin[a];
      directions[3 * i + (size_t)a] = rays[i].direction[a];
    }
  }
  /* A small batch takes less than the clock's steps; as in measure.py. */
  const size_t calls = 200000 / n + 1 < 2000 ? 200000 / n + 1 : 2000;
  for (int round = 0; round < rounds; ++round) {
    /* Commands come from a pipe, so that rounds of C and of Python can take turns. */
    if (getchar() == EOF) break;
    const double processor = now(CLOCK_PROCESS_CPUTIME_ID), wall = now(CLOCK_MONOTONIC);
    for (size_t call = 0; call < calls; ++call) must(nifQuery(scene, &batch, &answers));
    printf("%.9f %.9f\n", (now(CLOCK_PROCESS_CPUTIME_ID) - processor) / (double)calls,
           (now(CLOCK_MONOTONIC) - wall) / (double)calls);
    fflush(stdout);
  }
  fwrite(visible, 1, n, out);
  free(origins);
  free(directions);
  free(visible);
}

int main(int argc, char** argv) {
  NifDevice device;
  NifAsset asset;
  NifScene scene;
  char config[32];
  if (argc != 4 && argc != 7) return 2;
  snprintf(config, sizeof(config), "threads=%d", argc == 7 ? atoi(argv[6]) : 1);
  must(nifNewDevice(config, NULL, &device));
  must(nifLoadAssetFile(device, argv[1], NIF_LOAD_COPY, &asset));
  must(nifNewScene(device, &scene));
  must(nifAddAsset(scene, asset, NULL, NULL, NULL));
  must(nifCommitScene(scene));
  FILE* in = fopen(argv[2], "rb");
  FILE* out = fopen(argv[3], "wb");
  if (!in || !out || fseek(in, 0, SEEK_END) != 0) return 1;
  size_t n = (size_t)ftell(in) / sizeof(NifRay);
  rewind(in);
  NifRay* rays = get(n * sizeof(NifRay));
  if (fread(rays, sizeof(NifRay), n, in) != n) return 1;
  if (argc == 7) {
    const size_t batch = strtoull(argv[4], NULL, 10);
    measure(scene, rays, batch < n ? batch : n, atoi(argv[5]), out);
  } else {
    answer(scene, rays, n, out);
  }
  free(rays);
  fclose(in);
  if (fclose(out) != 0) return 1;
  nifReleaseScene(scene);
  nifReleaseAsset(asset);
  nifReleaseDevice(device);
  return 0;
}
