// Turns exceptions into error codes and messages: nothing may be thrown across the C boundary.
#pragma once

#include <new>
#include <stdexcept>
#include <string>

#include "formats/base/status.hpp"
#include "nif/nif.h"

namespace nif::runtime {

/// Thrown when a call of the C interface fails, with its code.
class Failure : public std::runtime_error {
 public:
  Failure(NifError code, const std::string& sentence) : std::runtime_error(sentence), code_(code) {}
  NifError code() const { return code_; }

 private:
  NifError code_;
};

NifError code_of(Status status);

/// Stores the sentence for nifGetErrorMessage() on this thread; returns the code.
NifError record_failure(NifError code, const char* sentence) noexcept;

/// Runs one call of the C interface, and turns exceptions into codes.
template <class Call>
NifError guarded(Call&& call) noexcept {
  try {
    call();
    return NIF_OK;
  } catch (const Failure& failure) {
    return record_failure(failure.code(), failure.what());
  } catch (const Error& error) {
    return record_failure(code_of(error.status()), error.what());
  } catch (const std::bad_alloc&) {
    return record_failure(NIF_ERROR_OUT_OF_MEMORY, "out of memory");
  } catch (const std::length_error&) {
    return record_failure(NIF_ERROR_OUT_OF_MEMORY, "out of memory");
  } catch (const std::exception& exception) {
    return record_failure(NIF_ERROR_UNKNOWN, exception.what());
  } catch (...) {
    return record_failure(NIF_ERROR_UNKNOWN, "a bug in nifkit");
  }
}

[[noreturn]] inline void refuse_argument(const std::string& sentence) {
  throw Failure(NIF_ERROR_INVALID_ARGUMENT, sentence);
}

inline void require_argument(const void* pointer, const char* name) {
  if (pointer == nullptr) refuse_argument(std::string(name) + " is null");
}

}  // namespace nif::runtime
