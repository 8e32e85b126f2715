/* The game's world: moving copies of one asset on a floor, a sun and a lamp. */
#ifndef ENGINE_WORLD_H
#define ENGINE_WORLD_H

#include <nif/nif.h>

typedef struct World {
  NifScene scene;
  float (*own)[12];        /* [per_copy] where the asset's file places its instances */
  float (*transforms)[12]; /* [copies * per_copy] of all instances in the scene */
  uint32_t copies, per_copy;
  int scatter;           /* copies at random places instead of a grid */
  float low[3], high[3]; /* box of one copy */
  float spacing;
  float sun[3];  /* direction towards the sun */
  float lamp[3]; /* position */
  float floor_low[2], floor_size[2];
  float floor_height;
} World;

/* Each returns 1, or 0 with a sentence on standard error. The new world is not committed yet. */
int make_world(NifDevice device, NifAsset asset, uint32_t copies, int scatter, World* world);
int commit_world(World* world);
/* Moves every copy and makes the scene ready for queries. */
int move_world(World* world, int frame);
void free_world(World* world);

#endif
