// Runs compute shaders by Vulkan, without a window: for tests of what shaders answer. By preference on a device
// that is the CPU (Mesa's lavapipe), so that tests do not depend on the machine.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace nif::test {

class VulkanCompute {
 public:
  /// NIF_TEST_VULKAN in the environment: part of the name of the device to take instead. Throws
  /// std::runtime_error if there is none.
  VulkanCompute();
  ~VulkanCompute();

  /// The device's name.
  const std::string& device() const;
  /// How many bytes a storage buffer may have.
  uint64_t most_bytes() const;
  /// Whether the validation layer watches.
  bool watched() const;
  /// Whether shaders may have products of packed integers (VK_KHR_shader_integer_dot_product).
  bool has_dot_products() const;
  /// Warnings and errors of the validation layer so far.
  const std::vector<std::string>& messages() const;

  /// Runs a shader (SPIR-V, entry point main) in `groups` work groups: its buffers 0 and 1 of set 0 hold `first`
  /// and `second`, and what it wrote to buffer 2, `words` words, is returned.
  std::vector<uint32_t> run(std::span<const uint32_t> code, std::span<const uint32_t> first,
                            std::span<const uint32_t> second, size_t words, uint32_t groups);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace nif::test
