/* OpenAL Soft's loopback device renders into memory instead of playing. Its functions, and those of the
 * low-pass filter, are extensions that have to be looked up. Without HRTF, this refuses to start. */
#include "sound.h"

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>
#include <AL/efx.h>
#include <stdio.h>
#include <stdlib.h>

/* Functions of extensions, which have to be looked up. */
typedef struct Functions {
  LPALCLOOPBACKOPENDEVICESOFT open_loopback;
  LPALCISRENDERFORMATSUPPORTEDSOFT is_supported;
  LPALCRENDERSAMPLESSOFT render;
  LPALGENFILTERS gen_filters;
  LPALDELETEFILTERS delete_filters;
  LPALFILTERI filter_i;
  LPALFILTERF filter_f;
} Functions;

struct Sound {
  Functions call;
  ALCdevice* device;
  ALCcontext* context;
  ALuint buffer, source, filter;
};

static int failed(const char* what) {
  fprintf(stderr, "audio: OpenAL: %s\n", what);
  return 0;
}

/* Looks up a function by the type of the pointer to it: C has no cast from an object's address to a
 * function's. */
#define FIND(pointer, found)                            \
  do {                                                  \
    *(void**)&(pointer) = (void*)(found);               \
    if ((pointer) == NULL) return failed("no " #found); \
  } while (0)

static int open_device(Sound* sound) {
  static const ALCint format[] = {ALC_FORMAT_CHANNELS_SOFT,
                                  ALC_STEREO_SOFT,
                                  ALC_FORMAT_TYPE_SOFT,
                                  ALC_FLOAT_SOFT,
                                  ALC_FREQUENCY,
                                  RATE,
                                  ALC_HRTF_SOFT,
                                  ALC_TRUE,
                                  0};
  ALCint hrtf = ALC_HRTF_DISABLED_SOFT;
  if (!alcIsExtensionPresent(NULL, "ALC_SOFT_loopback")) return failed("it cannot render into memory");
  FIND(sound->call.open_loopback, alcGetProcAddress(NULL, "alcLoopbackOpenDeviceSOFT"));
  FIND(sound->call.is_supported, alcGetProcAddress(NULL, "alcIsRenderFormatSupportedSOFT"));
  FIND(sound->call.render, alcGetProcAddress(NULL, "alcRenderSamplesSOFT"));
  sound->device = sound->call.open_loopback(NULL);
  if (sound->device == NULL) return failed("no loopback device");
  if (!alcIsExtensionPresent(sound->device, "ALC_EXT_EFX")) return failed("it has no filters (ALC_EXT_EFX)");
  if (!sound->call.is_supported(sound->device, RATE, ALC_STEREO_SOFT, ALC_FLOAT_SOFT))
    return failed("it cannot render 48 kHz stereo");
  sound->context = alcCreateContext(sound->device, format);
  if (sound->context == NULL || !alcMakeContextCurrent(sound->context)) return failed("no context");
  alcGetIntegerv(sound->device, ALC_HRTF_STATUS_SOFT, 1, &hrtf);
  if (hrtf != ALC_HRTF_ENABLED_SOFT && hrtf != ALC_HRTF_REQUIRED_SOFT)
    return failed("it has no HRTF for 48 kHz stereo, or its configuration switches it off");
  return 1;
}

static int start_source(Sound* sound, const float* loop, int count) {
  FIND(sound->call.gen_filters, alGetProcAddress("alGenFilters"));
  FIND(sound->call.delete_filters, alGetProcAddress("alDeleteFilters"));
  FIND(sound->call.filter_i, alGetProcAddress("alFilteri"));
  FIND(sound->call.filter_f, alGetProcAddress("alFilterf"));
  if (!alIsExtensionPresent("AL_EXT_FLOAT32")) return failed("it does not take sounds in single precision");
  alGetError();
  alGenBuffers(1, &sound->buffer);
  alBufferData(sound->buffer, alGetEnumValue("AL_FORMAT_MONO_FLOAT32"), loop,
               (ALsizei)((size_t)count * sizeof(float)), RATE);
  alGenSources(1, &sound->source);
  alSourcei(sound->source, AL_BUFFER, (ALint)sound->buffer);
  alSourcei(sound->source, AL_LOOPING, AL_TRUE);
  /* Some headroom, because sound from the side is louder in one ear. No attenuation with distance, so that
   * only the object is heard. */
  alSourcef(sound->source, AL_GAIN, 0.5f);
  alSourcef(sound->source, AL_ROLLOFF_FACTOR, 0);
  sound->call.gen_filters(1, &sound->filter);
  sound->call.filter_i(sound->filter, AL_FILTER_TYPE, AL_FILTER_LOWPASS);
  alSourcei(sound->source, AL_DIRECT_FILTER, (ALint)sound->filter);
  alSourcePlay(sound->source);
  return alGetError() == AL_NO_ERROR ? 1 : failed("the source does not start");
}

Sound* sound_open(const float* loop, int count) {
  Sound* sound = calloc(1, sizeof(*sound));
  if (sound == NULL) {
    fputs("audio: out of memory\n", stderr);
    return NULL;
  }
  if (open_device(sound) && start_source(sound, loop, count)) return sound;
  sound_close(sound);
  return NULL;
}

void sound_move(Sound* sound, const float* source) {
  alSource3f(sound->source, AL_POSITION, source[0], source[1], source[2]);
}

void sound_filter(Sound* sound, float gain, float gain_high) {
  sound->call.filter_f(sound->filter, AL_LOWPASS_GAIN, gain);
  sound->call.filter_f(sound->filter, AL_LOWPASS_GAINHF, gain_high);
  /* A filter is copied when it is attached to a source. */
  alSourcei(sound->source, AL_DIRECT_FILTER, (ALint)sound->filter);
}

int sound_render(Sound* sound, float* samples, int frames) {
  sound->call.render(sound->device, samples, frames);
  return alGetError() == AL_NO_ERROR && alcGetError(sound->device) == ALC_NO_ERROR
             ? 1
             : failed("it does not render");
}

void sound_close(Sound* sound) {
  if (sound == NULL) return;
  if (sound->source != 0) alDeleteSources(1, &sound->source);
  if (sound->filter != 0) sound->call.delete_filters(1, &sound->filter);
  if (sound->buffer != 0) alDeleteBuffers(1, &sound->buffer);
  if (sound->context != NULL) {
    alcMakeContextCurrent(NULL);
    alcDestroyContext(sound->context);
  }
  if (sound->device != NULL) alcCloseDevice(sound->device);
  free(sound);
}
