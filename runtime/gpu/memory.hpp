// Owns GPU memory and events, so that they are freed automatically.
#pragma once

#include <utility>

#include "driver.hpp"

namespace nif::gpu {

/// GPU memory. The thread that destroys it must have entered the GPU.
class Memory {
 public:
  Memory() = default;
  Memory(Context& context, size_t bytes)
      : context_(&context), data_(static_cast<unsigned char*>(context.allocate(bytes))), bytes_(bytes) {}
  Memory(Memory&& other) noexcept { swap(other); }
  Memory& operator=(Memory&& other) noexcept {
    Memory(std::move(other)).swap(*this);
    return *this;
  }
  ~Memory() {
    if (data_) context_->free(data_);
  }
  unsigned char* data() const { return data_; }
  size_t bytes() const { return bytes_; }

 private:
  void swap(Memory& other) {
    std::swap(context_, other.context_);
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
  }
  Context* context_ = nullptr;
  unsigned char* data_ = nullptr;
  size_t bytes_ = 0;
};

/// Two events, which measure how long the GPU takes for the work between them in a stream. The thread that
/// destroys it must have entered the GPU.
class Timer {
 public:
  Timer() = default;
  explicit Timer(Context& context) : context_(&context) {
    Timer made;  // frees the first event if making the second fails
    made.context_ = &context;
    made.from_ = context.make_event(true);
    made.to_ = context.make_event(true);
    swap(made);
  }
  Timer(Timer&& other) noexcept { swap(other); }
  Timer& operator=(Timer&& other) noexcept {
    Timer(std::move(other)).swap(*this);
    return *this;
  }
  ~Timer() {
    if (from_) context_->free_event(from_);
    if (to_) context_->free_event(to_);
  }
  explicit operator bool() const { return to_ != nullptr; }

  void start(Stream stream) const { context_->record(from_, stream); }
  void stop(Stream stream) const { context_->record(to_, stream); }
  bool is_done() const { return context_->is_done(to_); }
  void wait() const { context_->wait(to_); }
  /// Requires is_done().
  double seconds() const { return context_->seconds_between(from_, to_); }

 private:
  void swap(Timer& other) {
    std::swap(context_, other.context_);
    std::swap(from_, other.from_);
    std::swap(to_, other.to_);
  }
  Context* context_ = nullptr;
  Event from_ = nullptr, to_ = nullptr;
};

}  // namespace nif::gpu
