// The least that Vulkan needs for a compute shader: an instance, a device with one queue, and a pipeline for each
// shader, and for each run buffers in memory that the host sees and one submission that is waited for.
#include "tests/shader/vulkan_compute.hpp"

#include <vulkan/vulkan.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string_view>

namespace nif::test {
namespace {

void check(VkResult result, const char* call) {
  if (result != VK_SUCCESS)
    throw std::runtime_error(std::string(call) + " gives VkResult " + std::to_string(result));
}

/// The list that a pair of calls of Vulkan returns.
template <class Item, class Call>
std::vector<Item> list_of(const Call& call) {
  uint32_t count = 0;
  call(&count, nullptr);
  std::vector<Item> items(count);
  call(&count, items.data());
  items.resize(count);
  return items;
}

constexpr const char* kValidation = "VK_LAYER_KHRONOS_validation";
constexpr uint32_t kBuffers = 3;

VKAPI_ATTR VkBool32 VKAPI_CALL keep_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                            VkDebugUtilsMessageTypeFlagsEXT,
                                            const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  static_cast<std::vector<std::string>*>(user)->emplace_back(data->pMessage);
  return VK_FALSE;
}

}  // namespace

struct VulkanCompute::State {
  VkInstance instance = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkPhysicalDeviceProperties properties{};
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  uint32_t family = 0;
  VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  std::map<std::vector<uint32_t>, VkPipeline> pipelines;
  std::string name;
  bool watched = false, has_dot_products = false;
  std::vector<std::string> messages;

  State() {
    try {
      make_instance();
      choose_device();
      make_device();
      make_layout();
    } catch (...) {
      destroy();
      throw;
    }
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { destroy(); }

  template <class Function>
  Function find(const char* call) const {
    return reinterpret_cast<Function>(vkGetInstanceProcAddr(instance, call));
  }

  void make_instance() {
    const auto layers = list_of<VkLayerProperties>(vkEnumerateInstanceLayerProperties);
    watched = std::any_of(layers.begin(), layers.end(), [](const VkLayerProperties& layer) {
      return std::string_view(layer.layerName) == kValidation;
    });
    VkApplicationInfo about{};
    about.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    about.apiVersion = VK_API_VERSION_1_1;
    VkDebugUtilsMessengerCreateInfoEXT listen{};
    listen.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
    listen.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    listen.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    listen.pfnUserCallback = keep_message;
    listen.pUserData = &messages;
    const char* const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    VkInstanceCreateInfo wanted{};
    wanted.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    wanted.pApplicationInfo = &about;
    wanted.enabledLayerCount = watched;
    wanted.ppEnabledLayerNames = &kValidation;
    wanted.enabledExtensionCount = watched;
    wanted.ppEnabledExtensionNames = &extension;
    check(vkCreateInstance(&wanted, nullptr, &instance), "vkCreateInstance");
    if (watched)
      check(find<PFN_vkCreateDebugUtilsMessengerEXT>("vkCreateDebugUtilsMessengerEXT")(instance, &listen,
                                                                                       nullptr, &messenger),
            "vkCreateDebugUtilsMessengerEXT");
  }

  void choose_device() {
    const char* const wanted = std::getenv("NIF_TEST_VULKAN");
    const auto devices = list_of<VkPhysicalDevice>(
        [&](uint32_t* count, VkPhysicalDevice* all) { vkEnumeratePhysicalDevices(instance, count, all); });
    for (const VkPhysicalDevice each : devices) {
      VkPhysicalDeviceProperties about;
      vkGetPhysicalDeviceProperties(each, &about);
      const bool fits = wanted ? std::strstr(about.deviceName, wanted) != nullptr
                               : about.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
      if (physical != VK_NULL_HANDLE && !fits) continue;
      if (wanted && !fits) continue;
      physical = each;
      properties = about;
      name = about.deviceName;
      if (fits) break;
    }
    if (physical == VK_NULL_HANDLE) throw std::runtime_error("Vulkan has no device here");
  }

  void make_device() {
    const auto families =
        list_of<VkQueueFamilyProperties>([&](uint32_t* count, VkQueueFamilyProperties* all) {
          vkGetPhysicalDeviceQueueFamilyProperties(physical, count, all);
        });
    const auto found = std::find_if(families.begin(), families.end(), [](const VkQueueFamilyProperties& own) {
      return (own.queueFlags & VK_QUEUE_COMPUTE_BIT) != 0;
    });
    if (found == families.end()) throw std::runtime_error(name + " has no queue for compute shaders");
    family = uint32_t(found - families.begin());
    const float priority = 1;
    VkDeviceQueueCreateInfo queues{};
    queues.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queues.queueFamilyIndex = family;
    queues.queueCount = 1;
    queues.pQueuePriorities = &priority;
    const auto extensions = list_of<VkExtensionProperties>([&](uint32_t* count, VkExtensionProperties* all) {
      vkEnumerateDeviceExtensionProperties(physical, nullptr, count, all);
    });
    const char* const dots = VK_KHR_SHADER_INTEGER_DOT_PRODUCT_EXTENSION_NAME;
    has_dot_products =
        std::any_of(extensions.begin(), extensions.end(), [&](const VkExtensionProperties& extension) {
          return std::string_view(extension.extensionName) == dots;
        });
    VkPhysicalDeviceShaderIntegerDotProductFeaturesKHR dot_products{};
    dot_products.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SHADER_INTEGER_DOT_PRODUCT_FEATURES_KHR;
    dot_products.shaderIntegerDotProduct = VK_TRUE;
    VkDeviceCreateInfo wanted{};
    wanted.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    wanted.pNext = has_dot_products ? &dot_products : nullptr;
    wanted.enabledExtensionCount = has_dot_products;
    wanted.ppEnabledExtensionNames = &dots;
    wanted.queueCreateInfoCount = 1;
    wanted.pQueueCreateInfos = &queues;
    check(vkCreateDevice(physical, &wanted, nullptr, &device), "vkCreateDevice");
    vkGetDeviceQueue(device, family, 0, &queue);
  }

  /// All shaders have the same three buffers.
  void make_layout() {
    std::array<VkDescriptorSetLayoutBinding, kBuffers> bindings{};
    for (uint32_t i = 0; i < kBuffers; ++i)
      bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
    VkDescriptorSetLayoutCreateInfo about_set{};
    about_set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
    about_set.bindingCount = kBuffers;
    about_set.pBindings = bindings.data();
    check(vkCreateDescriptorSetLayout(device, &about_set, nullptr, &set_layout),
          "vkCreateDescriptorSetLayout");
    VkPipelineLayoutCreateInfo about_layout{};
    about_layout.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
    about_layout.setLayoutCount = 1;
    about_layout.pSetLayouts = &set_layout;
    check(vkCreatePipelineLayout(device, &about_layout, nullptr, &layout), "vkCreatePipelineLayout");
  }

  /// Compiles a shader at its first use: that takes longer than most runs.
  VkPipeline pipeline_of(std::span<const uint32_t> code) {
    const std::vector<uint32_t> key(code.begin(), code.end());
    if (const auto known = pipelines.find(key); known != pipelines.end()) return known->second;
    VkShaderModuleCreateInfo about_module{};
    about_module.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    about_module.codeSize = code.size_bytes();
    about_module.pCode = code.data();
    VkShaderModule module;
    check(vkCreateShaderModule(device, &about_module, nullptr, &module), "vkCreateShaderModule");
    VkComputePipelineCreateInfo about{};
    about.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    about.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    about.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    about.stage.module = module;
    about.stage.pName = "main";
    about.layout = layout;
    VkPipeline pipeline = VK_NULL_HANDLE;
    const VkResult result = vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &about, nullptr, &pipeline);
    vkDestroyShaderModule(device, module, nullptr);
    check(result, "vkCreateComputePipelines");
    return pipelines[key] = pipeline;
  }

  void destroy() {
    for (const auto& [code, pipeline] : pipelines) vkDestroyPipeline(device, pipeline, nullptr);
    if (layout) vkDestroyPipelineLayout(device, layout, nullptr);
    if (set_layout) vkDestroyDescriptorSetLayout(device, set_layout, nullptr);
    if (device) vkDestroyDevice(device, nullptr);
    if (messenger)
      find<PFN_vkDestroyDebugUtilsMessengerEXT>("vkDestroyDebugUtilsMessengerEXT")(instance, messenger,
                                                                                   nullptr);
    if (instance) vkDestroyInstance(instance, nullptr);
  }

  /// Memory that the host and the device see alike.
  uint32_t host_memory(uint32_t types) const {
    VkPhysicalDeviceMemoryProperties all;
    vkGetPhysicalDeviceMemoryProperties(physical, &all);
    constexpr VkMemoryPropertyFlags kWanted =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    for (uint32_t i = 0; i < all.memoryTypeCount; ++i)
      if ((types >> i & 1) != 0 && (all.memoryTypes[i].propertyFlags & kWanted) == kWanted) return i;
    throw std::runtime_error(name + " has no memory that the host sees");
  }
};

namespace {

/// A storage buffer in memory of its own.
class Buffer {
 public:
  template <class State>
  Buffer(const State& state, size_t words) : device_(state.device), bytes_(4 * std::max<size_t>(words, 1)) {
    VkBufferCreateInfo wanted{};
    wanted.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    wanted.size = bytes_;
    wanted.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    check(vkCreateBuffer(device_, &wanted, nullptr, &buffer_), "vkCreateBuffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device_, buffer_, &needs);
    VkMemoryAllocateInfo memory{};
    memory.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    memory.allocationSize = needs.size;
    memory.memoryTypeIndex = state.host_memory(needs.memoryTypeBits);
    check(vkAllocateMemory(device_, &memory, nullptr, &memory_), "vkAllocateMemory");
    check(vkBindBufferMemory(device_, buffer_, memory_, 0), "vkBindBufferMemory");
    check(vkMapMemory(device_, memory_, 0, VK_WHOLE_SIZE, 0, &mapped_), "vkMapMemory");
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() {
    vkDestroyBuffer(device_, buffer_, nullptr);
    vkFreeMemory(device_, memory_, nullptr);
  }

  void fill(std::span<const uint32_t> words) {
    if (!words.empty()) std::memcpy(mapped_, words.data(), words.size_bytes());
  }
  std::vector<uint32_t> words(size_t count) const {
    std::vector<uint32_t> all(count);
    if (count != 0) std::memcpy(all.data(), mapped_, 4 * count);
    return all;
  }
  VkDescriptorBufferInfo info() const { return {buffer_, 0, VK_WHOLE_SIZE}; }

 private:
  VkDevice device_;
  size_t bytes_;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  void* mapped_ = nullptr;
};

/// Destroys something of Vulkan's at the end of a block.
template <class Handle, class Destroy>
class Owned {
 public:
  Owned(VkDevice device, Handle handle, Destroy destroy)
      : device_(device), handle_(handle), destroy_(destroy) {}
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  ~Owned() { destroy_(device_, handle_, nullptr); }

 private:
  VkDevice device_;
  Handle handle_;
  Destroy destroy_;
};

}  // namespace

VulkanCompute::VulkanCompute() : state_(std::make_unique<State>()) {}
VulkanCompute::~VulkanCompute() = default;
const std::string& VulkanCompute::device() const { return state_->name; }
uint64_t VulkanCompute::most_bytes() const { return state_->properties.limits.maxStorageBufferRange; }
bool VulkanCompute::watched() const { return state_->watched; }
bool VulkanCompute::has_dot_products() const { return state_->has_dot_products; }
const std::vector<std::string>& VulkanCompute::messages() const { return state_->messages; }

std::vector<uint32_t> VulkanCompute::run(std::span<const uint32_t> code, std::span<const uint32_t> first,
                                         std::span<const uint32_t> second, size_t words, uint32_t groups) {
  const State& state = *state_;
  const VkDevice device = state.device;
  Buffer in_0(state, first.size()), in_1(state, second.size()), out(state, words);
  in_0.fill(first);
  in_1.fill(second);

  const VkPipeline pipeline = state_->pipeline_of(code);

  const VkDescriptorPoolSize room{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, kBuffers};
  VkDescriptorPoolCreateInfo about_descriptors{};
  about_descriptors.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  about_descriptors.maxSets = 1;
  about_descriptors.poolSizeCount = 1;
  about_descriptors.pPoolSizes = &room;
  VkDescriptorPool descriptors;
  check(vkCreateDescriptorPool(device, &about_descriptors, nullptr, &descriptors), "vkCreateDescriptorPool");
  const Owned own_descriptors(device, descriptors, vkDestroyDescriptorPool);
  VkDescriptorSetAllocateInfo wanted_set{};
  wanted_set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
  wanted_set.descriptorPool = descriptors;
  wanted_set.descriptorSetCount = 1;
  wanted_set.pSetLayouts = &state.set_layout;
  VkDescriptorSet set;
  check(vkAllocateDescriptorSets(device, &wanted_set, &set), "vkAllocateDescriptorSets");
  const std::array<VkDescriptorBufferInfo, kBuffers> infos = {in_0.info(), in_1.info(), out.info()};
  std::array<VkWriteDescriptorSet, kBuffers> writes{};
  for (uint32_t i = 0; i < kBuffers; ++i) {
    writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    writes[i].dstSet = set;
    writes[i].dstBinding = i;
    writes[i].descriptorCount = 1;
    writes[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    writes[i].pBufferInfo = &infos[i];
  }
  vkUpdateDescriptorSets(device, kBuffers, writes.data(), 0, nullptr);

  VkCommandPoolCreateInfo about_commands{};
  about_commands.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  about_commands.queueFamilyIndex = state.family;
  VkCommandPool commands;
  check(vkCreateCommandPool(device, &about_commands, nullptr, &commands), "vkCreateCommandPool");
  const Owned own_commands(device, commands, vkDestroyCommandPool);
  VkCommandBufferAllocateInfo wanted_buffer{};
  wanted_buffer.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  wanted_buffer.commandPool = commands;
  wanted_buffer.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  wanted_buffer.commandBufferCount = 1;
  VkCommandBuffer record;
  check(vkAllocateCommandBuffers(device, &wanted_buffer, &record), "vkAllocateCommandBuffers");
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(vkBeginCommandBuffer(record, &begin), "vkBeginCommandBuffer");
  vkCmdBindPipeline(record, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
  vkCmdBindDescriptorSets(record, VK_PIPELINE_BIND_POINT_COMPUTE, state.layout, 0, 1, &set, 0, nullptr);
  vkCmdDispatch(record, groups, 1, 1);
  VkMemoryBarrier seen{};
  seen.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  seen.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
  seen.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
  vkCmdPipelineBarrier(record, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &seen,
                       0, nullptr, 0, nullptr);
  check(vkEndCommandBuffer(record), "vkEndCommandBuffer");
  VkSubmitInfo submit{};
  submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &record;
  check(vkQueueSubmit(state.queue, 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit");
  check(vkQueueWaitIdle(state.queue), "vkQueueWaitIdle");
  return out.words(words);
}

}  // namespace nif::test
