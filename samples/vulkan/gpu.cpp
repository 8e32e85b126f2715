#include "gpu.hpp"

#include <chrono>
#include <cstring>
#include <stdexcept>

namespace {

void check(VkResult result, const char* call) {
  if (result != VK_SUCCESS)
    throw std::runtime_error(std::string(call) + " fails with VkResult " + std::to_string(result));
}

/// Calls a function at the end of the block.
template <class Function>
struct AtEnd {
  Function function;
  ~AtEnd() { function(); }
};
template <class Function>
AtEnd(Function) -> AtEnd<Function>;

bool has_compute(VkPhysicalDevice device, uint32_t& family) {
  uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  for (family = 0; family < count; ++family)
    if (families[family].queueFlags & VK_QUEUE_COMPUTE_BIT) return true;
  return false;
}

}  // namespace

Gpu::Gpu(const std::string& wanted) {
  VkApplicationInfo application{};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.apiVersion = VK_API_VERSION_1_1;
  VkInstanceCreateInfo about{};
  about.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  about.pApplicationInfo = &application;
  const VkResult started = vkCreateInstance(&about, nullptr, &instance_);
  if (started == VK_ERROR_INCOMPATIBLE_DRIVER) throw std::runtime_error("there is no driver for Vulkan");
  check(started, "vkCreateInstance");
  try {
    uint32_t count = 0;
    check(vkEnumeratePhysicalDevices(instance_, &count, nullptr), "vkEnumeratePhysicalDevices");
    std::vector<VkPhysicalDevice> devices(count);
    check(vkEnumeratePhysicalDevices(instance_, &count, devices.data()), "vkEnumeratePhysicalDevices");
    bool is_cpu = true;
    for (const VkPhysicalDevice each : devices) {
      VkPhysicalDeviceProperties properties;
      vkGetPhysicalDeviceProperties(each, &properties);
      uint32_t family;
      if (!std::strstr(properties.deviceName, wanted.c_str()) || !has_compute(each, family)) continue;
      if (physical_ && !is_cpu) continue;
      physical_ = each, family_ = family, limits_ = properties.limits, name_ = properties.deviceName;
      is_cpu = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    }
    if (!physical_)
      throw std::runtime_error(
          wanted.empty() ? "Vulkan has no device with compute shaders"
                         : "Vulkan has no device with compute shaders whose name contains '" + wanted + "'");
    const float priority = 1;
    VkDeviceQueueCreateInfo queue{};
    queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queue.queueFamilyIndex = family_;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkDeviceCreateInfo device{};
    device.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    device.queueCreateInfoCount = 1;
    device.pQueueCreateInfos = &queue;
    check(vkCreateDevice(physical_, &device, nullptr, &device_), "vkCreateDevice");
    vkGetDeviceQueue(device_, family_, 0, &queue_);
  } catch (...) {
    destroy();
    throw;
  }
}

Gpu::~Gpu() { destroy(); }

void Gpu::destroy() {
  if (device_) vkDestroyDevice(device_, nullptr);
  if (instance_) vkDestroyInstance(instance_, nullptr);
}

void Gpu::check_limits(const Task& task) const {
  uint64_t largest = 4 * task.output_words;
  for (const auto& input : task.inputs) largest = std::max<uint64_t>(largest, input.size_bytes());
  const auto refuse = [&](const char* what, uint64_t needed, uint64_t has) {
    if (needed > has)
      throw std::runtime_error(name_ + " allows " + std::to_string(has) + " " + what +
                               ", and the picture needs " + std::to_string(needed));
  };
  refuse("bytes in a storage buffer", largest, limits_.maxStorageBufferRange);
  refuse("storage buffers", task.inputs.size() + 1, limits_.maxPerStageDescriptorStorageBuffers);
  refuse("bytes of push constants", task.constants.size_bytes(), limits_.maxPushConstantsSize);
  refuse("invocations in a work group", 64,
         std::min(limits_.maxComputeWorkGroupInvocations, limits_.maxComputeWorkGroupSize[0]));
  refuse("work groups", task.groups, limits_.maxComputeWorkGroupCount[0]);
}

/// Memory that the program can write; by preference the GPU's own. An engine would rather copy the words once to memory that
/// only the GPU sees.
uint32_t Gpu::memory_type(uint32_t types) const {
  VkPhysicalDeviceMemoryProperties memory;
  vkGetPhysicalDeviceMemoryProperties(physical_, &memory);
  const VkMemoryPropertyFlags host =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  for (const VkMemoryPropertyFlags flags : {host | VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, host})
    for (uint32_t i = 0; i < memory.memoryTypeCount; ++i)
      if ((types >> i & 1) && (memory.memoryTypes[i].propertyFlags & flags) == flags) return i;
  throw std::runtime_error(name_ + " has no memory that the program can write");
}

struct Gpu::Buffer {
  VkDevice device;
  VkBuffer buffer = VK_NULL_HANDLE;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  uint32_t* words = nullptr;

  Buffer(const Gpu& gpu, uint64_t count) : device(gpu.device_) {
    VkBufferCreateInfo about{};
    about.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    about.size = 4 * count;
    about.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    check(vkCreateBuffer(device, &about, nullptr, &buffer), "vkCreateBuffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, buffer, &needs);
    VkMemoryAllocateInfo wanted{};
    wanted.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    wanted.allocationSize = needs.size;
    wanted.memoryTypeIndex = gpu.memory_type(needs.memoryTypeBits);
    check(vkAllocateMemory(device, &wanted, nullptr, &memory), "vkAllocateMemory");
    check(vkBindBufferMemory(device, buffer, memory, 0), "vkBindBufferMemory");
    void* mapped;
    check(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
    words = static_cast<uint32_t*>(mapped);
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() {
    vkDestroyBuffer(device, buffer, nullptr);
    vkFreeMemory(device, memory, nullptr);
  }
};

Gpu::Result Gpu::run(const Task& task) const {
  const uint32_t count = uint32_t(task.inputs.size()) + 1;
  std::vector<std::unique_ptr<Buffer>> buffers;
  for (const auto& input : task.inputs) {
    buffers.push_back(std::make_unique<Buffer>(*this, input.size()));
    std::memcpy(buffers.back()->words, input.data(), input.size_bytes());
  }
  buffers.push_back(std::make_unique<Buffer>(*this, task.output_words));

  // The layout: `count` storage buffers in set 0, and push constants.
  std::vector<VkDescriptorSetLayoutBinding> bindings(count);
  for (uint32_t i = 0; i < count; ++i)
    bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  VkDescriptorSetLayoutCreateInfo about_set{};
  about_set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  about_set.bindingCount = count;
  about_set.pBindings = bindings.data();
  VkDescriptorSetLayout set_layout;
  check(vkCreateDescriptorSetLayout(device_, &about_set, nullptr, &set_layout),
        "vkCreateDescriptorSetLayout");
  const AtEnd end_set_layout{[&] { vkDestroyDescriptorSetLayout(device_, set_layout, nullptr); }};
  const VkPushConstantRange constants{VK_SHADER_STAGE_COMPUTE_BIT, 0, uint32_t(task.constants.size_bytes())};
  VkPipelineLayoutCreateInfo about_layout{};
  about_layout.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  about_layout.setLayoutCount = 1;
  about_layout.pSetLayouts = &set_layout;
  about_layout.pushConstantRangeCount = 1;
  about_layout.pPushConstantRanges = &constants;
  VkPipelineLayout layout;
  check(vkCreatePipelineLayout(device_, &about_layout, nullptr, &layout), "vkCreatePipelineLayout");
  const AtEnd end_layout{[&] { vkDestroyPipelineLayout(device_, layout, nullptr); }};

  VkShaderModuleCreateInfo about_module{};
  about_module.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  about_module.codeSize = task.code.size_bytes();
  about_module.pCode = task.code.data();
  VkShaderModule module;
  check(vkCreateShaderModule(device_, &about_module, nullptr, &module), "vkCreateShaderModule");
  const AtEnd end_module{[&] { vkDestroyShaderModule(device_, module, nullptr); }};
  VkComputePipelineCreateInfo about_pipeline{};
  about_pipeline.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  about_pipeline.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  about_pipeline.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  about_pipeline.stage.module = module;
  about_pipeline.stage.pName = "main";
  about_pipeline.layout = layout;
  VkPipeline pipeline;
  check(vkCreateComputePipelines(device_, VK_NULL_HANDLE, 1, &about_pipeline, nullptr, &pipeline),
        "vkCreateComputePipelines");
  const AtEnd end_pipeline{[&] { vkDestroyPipeline(device_, pipeline, nullptr); }};

  // The buffers, bound.
  const VkDescriptorPoolSize room{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, count};
  VkDescriptorPoolCreateInfo about_sets{};
  about_sets.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  about_sets.maxSets = 1;
  about_sets.poolSizeCount = 1;
  about_sets.pPoolSizes = &room;
  VkDescriptorPool sets;
  check(vkCreateDescriptorPool(device_, &about_sets, nullptr, &sets), "vkCreateDescriptorPool");
  const AtEnd end_sets{[&] { vkDestroyDescriptorPool(device_, sets, nullptr); }};
  VkDescriptorSetAllocateInfo wanted_set{};
  wanted_set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
  wanted_set.descriptorPool = sets;
  wanted_set.descriptorSetCount = 1;
  wanted_set.pSetLayouts = &set_layout;
  VkDescriptorSet set;
  check(vkAllocateDescriptorSets(device_, &wanted_set, &set), "vkAllocateDescriptorSets");
  for (uint32_t i = 0; i < count; ++i) {
    const VkDescriptorBufferInfo whole{buffers[i]->buffer, 0, VK_WHOLE_SIZE};
    VkWriteDescriptorSet write{};
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstSet = set;
    write.dstBinding = i;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = &whole;
    vkUpdateDescriptorSets(device_, 1, &write, 0, nullptr);
  }

  VkCommandPoolCreateInfo about_commands{};
  about_commands.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  about_commands.queueFamilyIndex = family_;
  VkCommandPool commands;
  check(vkCreateCommandPool(device_, &about_commands, nullptr, &commands), "vkCreateCommandPool");
  const AtEnd end_commands{[&] { vkDestroyCommandPool(device_, commands, nullptr); }};
  VkCommandBufferAllocateInfo wanted_record{};
  wanted_record.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  wanted_record.commandPool = commands;
  wanted_record.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  wanted_record.commandBufferCount = 1;
  VkCommandBuffer record;
  check(vkAllocateCommandBuffers(device_, &wanted_record, &record), "vkAllocateCommandBuffers");
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(vkBeginCommandBuffer(record, &begin), "vkBeginCommandBuffer");
  vkCmdBindPipeline(record, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
  vkCmdBindDescriptorSets(record, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 1, &set, 0, nullptr);
  vkCmdPushConstants(record, layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, constants.size, task.constants.data());
  vkCmdDispatch(record, task.groups, 1, 1);
  VkMemoryBarrier written{};
  written.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  written.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
  written.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
  vkCmdPipelineBarrier(record, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1,
                       &written, 0, nullptr, 0, nullptr);
  check(vkEndCommandBuffer(record), "vkEndCommandBuffer");
  VkSubmitInfo submission{};
  submission.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  submission.commandBufferCount = 1;
  submission.pCommandBuffers = &record;
  const auto start = std::chrono::steady_clock::now();
  check(vkQueueSubmit(queue_, 1, &submission, VK_NULL_HANDLE), "vkQueueSubmit");
  check(vkQueueWaitIdle(queue_), "vkQueueWaitIdle");
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
  const uint32_t* const output = buffers.back()->words;
  return {{output, output + task.output_words}, took.count()};
}
