// Searches for the GPU module in a fixed order of places, and loads it. Refuses a module of another version
// or with other layouts of structures. Systems without dlopen have no module.
#include "gpu/load_module.hpp"

#include <cstdlib>
#include <string>

#include "api/error.hpp"

#if (defined(__unix__) || defined(__APPLE__)) && !defined(__EMSCRIPTEN__)
#include <dlfcn.h>
#include <unistd.h>

#include "gpu/crossing.hpp"
#define NIF_HAS_DLOPEN
#endif

namespace nif::runtime {

#ifdef NIF_HAS_DLOPEN
namespace {

constexpr const char* kFile = "libnif_gpu.so";

[[noreturn]] void refuse(const std::string& sentence) { throw Failure(NIF_ERROR_NOT_AVAILABLE, sentence); }

/// The folder that this code was loaded from, ending with '/'; "" if unknown.
std::string own_folder() {
  Dl_info info{};
  std::string file;
  if (dladdr(reinterpret_cast<void*>(&own_folder), &info) != 0 && info.dli_fname) file = info.dli_fname;
  if (file.find('/') == std::string::npos) {  // a program that was found in PATH
    char self[4096];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof(self));
    file.assign(self, length > 0 ? size_t(length) : 0);
  }
  return file.substr(0, file.rfind('/') + 1);
}

const GpuModule& table_of(void* library, const std::string& file) {
  using Entry = const GpuModule* (*)();
  const auto entry = reinterpret_cast<Entry>(dlsym(library, kGpuModuleSymbol));
  if (!entry) refuse(file + " is no GPU module of nifkit");
  const GpuModule* module = entry();
  if (module->version != kGpuModuleVersion || module->layout != kGpuLayout)
    refuse("the GPU module " + file + " is of another version than this library");
  return *module;
}

const GpuModule& open(const std::string& file) {
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    const char* reason = dlerror();
    refuse("the GPU module " + file + " cannot be loaded: " + (reason ? reason : "no reason is given"));
  }
  return table_of(library, file);
}

}  // namespace

const GpuModule& load_gpu_module(std::string_view file) {
  if (!file.empty()) return open(std::string(file));
  const char* named = std::getenv("NIF_GPU_MODULE");
  if (named && *named) return open(named);
  const std::string folder = own_folder();
  if (!folder.empty())
    for (const char* place : {"", "../" NIF_LIBDIR "/"}) {
      const std::string path = folder + place + kFile;
      if (access(path.c_str(), F_OK) == 0) return open(path);
    }
  if (void* library = dlopen(kFile, RTLD_NOW | RTLD_LOCAL)) return table_of(library, kFile);
  refuse(std::string("there is no GPU module: ") + kFile +
         " is neither beside this program nor where the system looks for libraries");
}

#else

const GpuModule& load_gpu_module(std::string_view) {
  throw Failure(NIF_ERROR_NOT_AVAILABLE, "there is no GPU module for this system");
}

#endif

}  // namespace nif::runtime
