// Keeps each thread's last error message, in a fixed buffer, so that keeping it cannot fail.
#include "api/error.hpp"

#include <string_view>

namespace nif::runtime {
namespace {

// Has room for a path of the greatest length, and a reason.
thread_local char message[5120] = "";

}  // namespace

NifError code_of(Status status) {
  switch (status) {
    case Status::usage:
      return NIF_ERROR_INVALID_ARGUMENT;
    case Status::file_not_found:
      return NIF_ERROR_FILE_NOT_FOUND;
    case Status::file_unreadable:
      return NIF_ERROR_FILE_UNREADABLE;
    case Status::file_empty:
      return NIF_ERROR_FILE_EMPTY;
    case Status::file_truncated:
      return NIF_ERROR_FILE_TRUNCATED;
    case Status::not_a_nif:
      return NIF_ERROR_NOT_A_NIF;
    case Status::foreign_nif:
      return NIF_ERROR_FOREIGN_NIF;
    case Status::damaged_nif:
      return NIF_ERROR_DAMAGED_NIF;
    case Status::unsupported_nif:
      return NIF_ERROR_UNSUPPORTED_NIF;
    case Status::out_of_memory:
      return NIF_ERROR_OUT_OF_MEMORY;
    default:
      return NIF_ERROR_UNKNOWN;
  }
}

NifError record_failure(NifError code, const char* sentence) noexcept {
  message[std::string_view(sentence).copy(message, sizeof(message) - 1)] = 0;
  return code;
}

const char* latest_message() noexcept { return message; }

}  // namespace nif::runtime

extern "C" {

const char* nifGetErrorMessage(void) { return nif::runtime::latest_message(); }

const char* nifGetErrorName(NifError error) {
  switch (error) {
#define NIF_NAME(code) \
  case code:           \
    return #code
    NIF_NAME(NIF_OK);
    NIF_NAME(NIF_ERROR_UNKNOWN);
    NIF_NAME(NIF_ERROR_INVALID_ARGUMENT);
    NIF_NAME(NIF_ERROR_INVALID_OPERATION);
    NIF_NAME(NIF_ERROR_OUT_OF_MEMORY);
    NIF_NAME(NIF_ERROR_NOT_AVAILABLE);
    NIF_NAME(NIF_ERROR_CANCELLED);
    NIF_NAME(NIF_ERROR_SINGULAR_TRANSFORM);
    NIF_NAME(NIF_ERROR_FILE_NOT_FOUND);
    NIF_NAME(NIF_ERROR_FILE_UNREADABLE);
    NIF_NAME(NIF_ERROR_FILE_EMPTY);
    NIF_NAME(NIF_ERROR_FILE_TRUNCATED);
    NIF_NAME(NIF_ERROR_NOT_A_NIF);
    NIF_NAME(NIF_ERROR_FOREIGN_NIF);
    NIF_NAME(NIF_ERROR_DAMAGED_NIF);
    NIF_NAME(NIF_ERROR_UNSUPPORTED_NIF);
    NIF_NAME(NIF_ERROR_DEVICE_LOST);
    NIF_NAME(NIF_ERROR_OUT_OF_DEVICE_MEMORY);
    NIF_NAME(NIF_ERROR_WRONG_POINTER);
#undef NIF_NAME
    default:
      return "unknown error code";
  }
}

}  // extern "C"
