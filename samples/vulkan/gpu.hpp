// The least that Vulkan needs for a compute shader, without a window.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

class Gpu {
 public:
  /// The first device whose name contains `wanted`; '' takes the first of those that are not the CPU, if there is one.
  /// Throws std::runtime_error if there is none.
  explicit Gpu(const std::string& wanted);
  ~Gpu();

  const std::string& name() const { return name_; }

  /// A compute shader (SPIR-V, entry point main, 64 invocations a group) whose set 0 has storage buffers 0, 1, ...: the inputs,
  /// then the output.
  struct Task {
    std::span<const uint32_t> code;
    std::vector<std::span<const uint32_t>> inputs;
    uint64_t output_words;
    std::span<const uint32_t> constants;  ///< push constants
    uint32_t groups;
  };
  /// Throws std::runtime_error if the device's limits do not admit the task.
  void check_limits(const Task& task) const;

  struct Result {
    std::vector<uint32_t> output;
    double milliseconds;  ///< from submission to completion
  };
  Result run(const Task& task) const;

 private:
  struct Buffer;
  uint32_t memory_type(uint32_t types) const;
  void destroy();

  VkInstance instance_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkPhysicalDeviceLimits limits_{};
  std::string name_;
  uint32_t family_ = 0;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
};
