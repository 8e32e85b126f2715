// A library to be preloaded (LD_PRELOAD) into a program under test: lets allocations and the writing of files
// fail, or kills the program there, and lets the clock on the wall jump. What it does is in the environment;
// it begins with main().
//
//   NIF_FAULT_ALLOCATION="N once" | "N on"   the Nth allocation fails, alone or with all that follow
//   NIF_FAULT_FILE="CALL N ERROR|kill"       the Nth write, fsync, close or rename of a file that is being
//                                            written fails with that number of errno, or kills
//   NIF_FAULT_CLOCK="SECONDS"                each look at the clock jumps by up to so much, either way
//   NIF_FAULT_COUNT="FILE"                   at the end, how many allocations there were is written there
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
}

namespace {

std::atomic<bool> armed{false};

// Allocations.
std::atomic<uint64_t> allocations{0};
uint64_t failing = ~uint64_t{0};
bool failing_on = false;

bool fails() {
  if (!armed.load(std::memory_order_relaxed)) return false;
  const uint64_t number = allocations.fetch_add(1, std::memory_order_relaxed) + 1;
  if (number != failing && !(failing_on && number > failing)) return false;
  errno = ENOMEM;
  return true;
}

// Files. Those that are being written are those that were made by open(O_CREAT | O_EXCL).
std::atomic<bool> written[1024];
std::atomic<uint64_t> calls{0};
char failing_call[16] = "";
uint64_t failing_number = 0;
int failing_error = 0;  // 0: kill

/// Returns true if the call must fail, and sets errno.
bool file_fails(const char* call, int fd) {
  if (!armed || std::strcmp(call, failing_call) != 0) return false;
  if (fd >= 0 && (fd >= int(std::size(written)) || !written[fd])) return false;
  if (++calls != failing_number) return false;
  if (failing_error == 0) {
    kill(getpid(), SIGKILL);
    for (;;) pause();
  }
  errno = failing_error;
  return true;
}

// The clock.
int64_t jump = 0;
std::atomic<uint64_t> looks{1};

int64_t jumped(int64_t seconds) {
  if (!armed || jump == 0) return seconds;
  uint64_t x = looks.fetch_add(1) * 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x ^= x >> 27;
  return seconds + int64_t(x % uint64_t(2 * jump + 1)) - jump;
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

using Main = int (*)(int, char**, char**);
Main real_main;

void read_environment() {
  if (const char* text = getenv("NIF_FAULT_ALLOCATION")) {
    char mode[8] = "";
    if (std::sscanf(text, "%lu %7s", &failing, mode) != 2) std::abort();
    failing_on = std::strcmp(mode, "on") == 0;
  }
  if (const char* text = getenv("NIF_FAULT_FILE")) {
    char error[16] = "";
    if (std::sscanf(text, "%15s %lu %15s", failing_call, &failing_number, error) != 3) std::abort();
    failing_error = std::strcmp(error, "kill") == 0 ? 0 : std::atoi(error);
  }
  if (const char* text = getenv("NIF_FAULT_CLOCK")) jump = std::atoll(text);
}

int watched_main(int argc, char** argv, char** environment) {
  read_environment();
  armed = true;
  const int code = real_main(argc, argv, environment);
  armed = false;
  if (const char* file = getenv("NIF_FAULT_COUNT")) {
    if (std::FILE* out = std::fopen(file, "w")) {
      std::fprintf(out, "%lu\n", allocations.load());
      std::fclose(out);
    }
  }
  return code;
}

}  // namespace

extern "C" {

int __libc_start_main(Main main, int argc, char** argv, void (*init)(), void (*fini)(), void (*end)(),
                      void* stack) {
  using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
  real_main = main;
  return next<Start>("__libc_start_main")(watched_main, argc, argv, init, fini, end, stack);
}

void* malloc(size_t size) { return fails() ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) { return fails() ? nullptr : __libc_calloc(count, size); }
void* realloc(void* memory, size_t size) { return fails() ? nullptr : __libc_realloc(memory, size); }
void* memalign(size_t alignment, size_t size) { return fails() ? nullptr : __libc_memalign(alignment, size); }
void* aligned_alloc(size_t alignment, size_t size) {
  return fails() ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, size_t alignment, size_t size) {
  if (fails()) return ENOMEM;
  *memory = __libc_memalign(alignment, size);
  return *memory ? 0 : ENOMEM;
}

int open(const char* path, int flags, ...) {
  static const auto real = next<int (*)(const char*, int, ...)>("open");
  mode_t mode = 0;
  if (flags & (O_CREAT | O_TMPFILE)) {
    va_list arguments;
    va_start(arguments, flags);
    mode = va_arg(arguments, mode_t);
    va_end(arguments);
  }
  const bool made = (flags & (O_CREAT | O_EXCL)) == (O_CREAT | O_EXCL);
  if (made && file_fails("open", -1)) return -1;
  const int fd = real(path, flags, mode);
  if (fd >= 0 && fd < int(std::size(written))) written[fd] = made;
  return fd;
}
ssize_t write(int fd, const void* bytes, size_t size) {
  static const auto real = next<ssize_t (*)(int, const void*, size_t)>("write");
  if (!file_fails("write", fd)) return real(fd, bytes, size);
  // A disk that fills up accepts a part.
  if (failing_error == ENOSPC && size > 1 && calls-- > 0) {
    failing_number = calls + 1;
    errno = 0;
    const ssize_t half = real(fd, bytes, size / 2);
    return half;
  }
  return -1;
}
int fsync(int fd) {
  static const auto real = next<int (*)(int)>("fsync");
  return file_fails("fsync", fd) ? -1 : real(fd);
}
int close(int fd) {
  static const auto real = next<int (*)(int)>("close");
  const bool fails_now = file_fails("close", fd);
  const int error = errno;
  if (fd >= 0 && fd < int(std::size(written))) written[fd] = false;
  const int result = real(fd);
  if (!fails_now) return result;
  errno = error;
  return -1;
}
int rename(const char* from, const char* to) {
  static const auto real = next<int (*)(const char*, const char*)>("rename");
  return file_fails("rename", -1) ? -1 : real(from, to);
}

int clock_gettime(clockid_t clock, timespec* time) {
  static const auto real = next<int (*)(clockid_t, timespec*)>("clock_gettime");
  const int result = real(clock, time);
  if (clock == CLOCK_REALTIME) time->tv_sec = jumped(time->tv_sec);
  return result;
}
time_t time(time_t* out) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (out) *out = now.tv_sec;
  return now.tv_sec;
}
int gettimeofday(timeval* __restrict out, void* __restrict) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  out->tv_sec = now.tv_sec;
  out->tv_usec = now.tv_nsec / 1000;
  return 0;
}
}
