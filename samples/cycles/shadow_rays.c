/* A library to preload between Cycles and Embree 3 (LD_PRELOAD), so that an asset answers shadow rays.
 *
 *   NIF_CYCLES_ASSET=dragon.nif LD_PRELOAD=libshadow_rays.so blender ...
 *
 * The object that the asset represents has its shadows switched off in Cycles (Ray Visibility, Shadow), so
 * that its triangles do not answer shadow rays. A shadow ray first queries the asset. If that does not block
 * it, Embree answers for the other objects, in a separate scene that is built here and does not contain the
 * triangles that the asset represents. All other rays go to Embree as before.
 *
 * The asset is placed in the world as in its file. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <math.h>
#include <nif/nif.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Cycles 3.4: the bit in a ray's mask for shadow rays without transparency. */
#define SHADOW 0x100u

/* ---- The functions replaced ---------------------------------------------------------------------------- */

static struct {
  RTCScene (*NewScene)(RTCDevice);
  void (*ReleaseScene)(RTCScene);
  void (*CommitScene)(RTCScene);
  void (*SetSceneBuildQuality)(RTCScene, enum RTCBuildQuality);
  void (*SetSceneFlags)(RTCScene, enum RTCSceneFlags);
  void (*SetGeometryMask)(RTCGeometry, unsigned);
  void (*AttachGeometryByID)(RTCScene, RTCGeometry, unsigned);
  void (*Intersect1)(RTCScene, struct RTCIntersectContext*, struct RTCRayHit*);
} embree;

/* ---- The asset ----------------------------------------------------------------------------------------- */

static NifDevice device;
static NifScene asset_scene;
static float bias; /* distance from its surface at which the asset expects rays to start */

static void give_up(const char* what, const char* why) {
  fprintf(stderr, "shadow_rays: %s: %s\n", what, why);
  _exit(2); /* a picture without the asset would be wrong */
}

static void load(const char* path) {
  NifAsset asset = NULL;
  NifAssetInfo info = {.struct_size = sizeof(info)};
  if (nifNewDevice(NULL, NULL, &device) != NIF_OK) give_up("device", nifGetErrorMessage());
  if (nifLoadAssetFile(device, path, NIF_LOAD_COPY, &asset) != NIF_OK) give_up("asset", nifGetErrorMessage());
  if (nifGetAssetInfo(asset, &info) != NIF_OK) give_up("asset", nifGetErrorMessage());
  for (uint32_t i = 0; i < info.object_count; ++i) {
    NifObjectInfo object = {.struct_size = sizeof(object)};
    if (nifGetObjectInfo(asset, i, &object) != NIF_OK) give_up("asset", nifGetErrorMessage());
    if (object.encoding == NIF_ENCODING_PROOF)
      give_up(path, "an asset with the encoding proof leaves rays open");
    bias = fmaxf(bias, object.bias);
  }
  if (nifNewScene(device, &asset_scene) != NIF_OK ||
      nifAddAsset(asset_scene, asset, NULL, NULL, NULL) != NIF_OK || nifCommitScene(asset_scene) != NIF_OK) {
    give_up("scene", nifGetErrorMessage());
  }
  nifReleaseAsset(asset); /* the scene keeps it */
}

__attribute__((constructor)) static void start(void) {
  const char* path = getenv("NIF_CYCLES_ASSET");
  if (!path || !*path) give_up("NIF_CYCLES_ASSET", "is not set; it names the asset");
#define TAKE(name) embree.name = (__typeof__(embree.name))dlsym(RTLD_NEXT, "rtc" #name)
  TAKE(NewScene);
  TAKE(ReleaseScene);
  TAKE(CommitScene);
  TAKE(SetSceneBuildQuality);
  TAKE(SetSceneFlags);
  TAKE(SetGeometryMask);
  TAKE(AttachGeometryByID);
  TAKE(Intersect1);
#undef TAKE
  if (!embree.Intersect1) give_up("this program", "does not link Embree 3 dynamically");
  load(path);
  unsetenv("LD_PRELOAD"); /* not for programs that this one starts */
}

/* ---- Scenes: each has a twin of the geometry that still casts shadows -------------------------------------
 */

typedef struct Twin {
  RTCScene scene, others;
  unsigned any_geometry; /* of `scene`; reported as hit by rays that the asset blocks */
  struct Twin* next;
} Twin;

/* Cycles builds its scenes before it traces rays, each on one thread; nothing is removed while rays are
 * traced. */
static _Atomic(Twin*) twins;
static _Thread_local RTCGeometry masked;
static _Thread_local unsigned mask;

static Twin* twin_of(RTCScene scene) {
  Twin* twin = atomic_load_explicit(&twins, memory_order_acquire);
  while (twin && twin->scene != scene) twin = twin->next;
  return twin;
}

RTC_API RTCScene rtcNewScene(RTCDevice owner) {
  Twin* twin = calloc(1, sizeof(*twin));
  if (!twin) give_up("scene", "no memory");
  twin->scene = embree.NewScene(owner);
  twin->others = embree.NewScene(owner);
  twin->any_geometry = RTC_INVALID_GEOMETRY_ID;
  twin->next = atomic_load(&twins);
  while (!atomic_compare_exchange_weak(&twins, &twin->next, twin)) {
  }
  return twin->scene;
}

RTC_API void rtcReleaseScene(RTCScene scene) {
  Twin* twin = twin_of(scene);
  if (twin && twin->others) {
    embree.ReleaseScene(twin->others);
    twin->scene = twin->others = NULL; /* the few bytes of the list are kept */
  }
  embree.ReleaseScene(scene);
}

RTC_API void rtcSetSceneFlags(RTCScene scene, enum RTCSceneFlags flags) {
  Twin* twin = twin_of(scene);
  if (twin) embree.SetSceneFlags(twin->others, flags);
  embree.SetSceneFlags(scene, flags);
}

RTC_API void rtcSetSceneBuildQuality(RTCScene scene, enum RTCBuildQuality quality) {
  Twin* twin = twin_of(scene);
  if (twin) embree.SetSceneBuildQuality(twin->others, quality);
  embree.SetSceneBuildQuality(scene, quality);
}

/* Cycles sets the mask of a geometry right before it attaches it. */
RTC_API void rtcSetGeometryMask(RTCGeometry geometry, unsigned bits) {
  masked = geometry;
  mask = bits;
  embree.SetGeometryMask(geometry, bits);
}

RTC_API void rtcAttachGeometryByID(RTCScene scene, RTCGeometry geometry, unsigned id) {
  Twin* twin = twin_of(scene);
  embree.AttachGeometryByID(scene, geometry, id);
  if (!twin) return;
  if (twin->any_geometry == RTC_INVALID_GEOMETRY_ID) twin->any_geometry = id;
  if (geometry != masked || (mask & SHADOW)) embree.AttachGeometryByID(twin->others, geometry, id);
}

RTC_API void rtcCommitScene(RTCScene scene) {
  Twin* twin = twin_of(scene);
  embree.CommitScene(scene);
  if (twin) embree.CommitScene(twin->others);
}

/* ---- Rays ---------------------------------------------------------------------------------------------- */

/* The last hit of a thread, and its counts. Cycles traces a path on one thread: its shadow rays start at the
 * hit of its last other ray. */
typedef struct Thread {
  int met;
  float point[3], normal[3]; /* the hit; normal of unit length, on the side that the ray came from */
  uint64_t asked, blocked;
  struct Thread* next;
} Thread;

static _Atomic(Thread*) threads;
static _Thread_local Thread* this_thread;

static Thread* thread(void) {
  if (!this_thread) {
    this_thread = calloc(1, sizeof(Thread));
    if (!this_thread) give_up("thread", "no memory");
    this_thread->next = atomic_load(&threads);
    while (!atomic_compare_exchange_weak(&threads, &this_thread->next, this_thread)) {
    }
  }
  return this_thread;
}

__attribute__((destructor)) static void finish(void) {
  uint64_t asked = 0, blocked = 0;
  for (Thread* t = atomic_load(&threads); t; t = t->next) {
    asked += t->asked;
    blocked += t->blocked;
  }
  fprintf(stderr, "shadow_rays: the asset answered %llu shadow rays, and blocked %llu\n",
          (unsigned long long)asked, (unsigned long long)blocked);
  nifReleaseScene(asset_scene);
  nifReleaseDevice(device);
}

static float dot(const float* a, const float* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Instances have normals in their own space; Cycles makes no instances when it renders without a window. */
static void remember(Thread* t, const struct RTCRayHit* r) {
  const float direction[3] = {r->ray.dir_x, r->ray.dir_y, r->ray.dir_z};
  const float normal[3] = {r->hit.Ng_x, r->hit.Ng_y, r->hit.Ng_z};
  const float size = sqrtf(dot(normal, normal));
  t->met =
      r->hit.geomID != RTC_INVALID_GEOMETRY_ID && r->hit.instID[0] == RTC_INVALID_GEOMETRY_ID && size > 0;
  if (!t->met) return;
  const float origin[3] = {r->ray.org_x, r->ray.org_y, r->ray.org_z};
  const float side = dot(direction, normal) > 0 ? -1 / size : 1 / size;
  for (int axis = 0; axis < 3; ++axis) {
    t->point[axis] = origin[axis] + r->ray.tfar * direction[axis];
    t->normal[axis] = side * normal[axis];
  }
}

/* Cycles starts shadow rays on the surface itself, and skips the triangle that they start on. The asset has
 * no triangles: its rays start off the surface by a bias, along the normal. */
static int blocked_by_asset(Thread* t, const struct RTCRay* r) {
  NifRay ray = {{r->org_x, r->org_y, r->org_z}, r->tnear, {r->dir_x, r->dir_y, r->dir_z}, r->tfar};
  const float away[3] = {ray.origin[0] - t->point[0], ray.origin[1] - t->point[1],
                         ray.origin[2] - t->point[2]};
  uint8_t visible = 1;
  const NifAnswers answers = {.struct_size = sizeof(answers), .visible = &visible};
  if (t->met && dot(away, away) < bias * bias) {
    for (int axis = 0; axis < 3; ++axis) ray.origin[axis] += bias * t->normal[axis];
  }
  if (nifQueryRay(asset_scene, &ray, &answers) != NIF_OK) give_up("query", nifGetErrorMessage());
  ++t->asked;
  t->blocked += !visible;
  return !visible;
}

RTC_API void rtcIntersect1(RTCScene scene, struct RTCIntersectContext* context, struct RTCRayHit* r) {
  Thread* t = thread();
  const Twin* twin = r->ray.mask & SHADOW ? twin_of(scene) : NULL;
  if (!twin) {
    embree.Intersect1(scene, context, r);
    remember(t, r);
    return;
  }
  if (!blocked_by_asset(t, &r->ray)) {
    embree.Intersect1(twin->others, context, r);
    return;
  }
  /* Any hit will do: for a shadow ray that hits something opaque, Cycles needs no more. */
  r->hit.geomID = twin->any_geometry;
  r->hit.primID = 0;
  r->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  r->hit.u = r->hit.v = 0;
}
