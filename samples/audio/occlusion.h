/* Measures what is between the listener and the source: the only file that uses nifkit.
 *
 * Positions are in metres, in the axes of OpenAL: x right, y up, the listener looks along -z. */
#ifndef OCCLUSION_H
#define OCCLUSION_H

#include <nif/nif.h>

enum { RAYS = 64 }; /* for each answer */

typedef struct Occlusion {
  NifDevice device;
  NifAsset asset;
  NifScene scene;
  NifRay rays[RAYS];
  uint8_t visible[RAYS];
  float spread[RAYS][3]; /* points of the unit ball */
} Occlusion;

/* Loads the asset and places it: its centre at `middle`, its longest side `size` long, the asset's axes `up`
 * and `front` along y and z. Returns 0 after printing an error; close it in any case. */
int occlusion_open(Occlusion* occlusion, const char* path, int up, int front, const float* middle,
                   float size);

/* Traces RAYS rays from the listener to points of a ball around the source. Returns the share of visible
 * ones, 0 to 1, or -1 after printing an error. */
double occlusion_share(Occlusion* occlusion, const float* listener, const float* source, float radius);

void occlusion_close(Occlusion* occlusion);

#endif
