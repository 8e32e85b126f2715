// A study, not a test: what a driver's compiler says of shaders: registers, scratch memory, instructions. docs/results/shaders.sh runs
// it with Mesa's driver for AMD, which compiles without a card if RADV_FORCE_FAMILY names one.
//
// shader_registers FILE.spv...
//
// Takes the first device. Prints a line for each file and statistic: the file, what, how many.
#include <vulkan/vulkan.h>

#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

void check(VkResult result, const char* what) {
  if (result != VK_SUCCESS) throw std::runtime_error(std::string(what) + " fails: " + std::to_string(result));
}

template <class Info>
Info made(VkStructureType type) {
  Info info{};
  info.sType = type;
  return info;
}

struct Compiler {
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;

  /// What it makes lives as long as the program.
  Compiler() {
    auto about = made<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
    about.apiVersion = VK_API_VERSION_1_1;
    auto of_instance = made<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
    of_instance.pApplicationInfo = &about;
    VkInstance instance = VK_NULL_HANDLE;
    check(vkCreateInstance(&of_instance, nullptr, &instance), "vkCreateInstance");
    uint32_t count = 1;
    if (vkEnumeratePhysicalDevices(instance, &count, &physical) < 0 || count == 0)
      throw std::runtime_error("Vulkan has no device here");

    auto tells = made<VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR>(
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR);
    tells.pipelineExecutableInfo = VK_TRUE;
    const float priority = 1;
    auto queue = made<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    const char* const extension = VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME;
    auto of_device = made<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
    of_device.pNext = &tells;
    of_device.queueCreateInfoCount = 1;
    of_device.pQueueCreateInfos = &queue;
    of_device.enabledExtensionCount = 1;
    of_device.ppEnabledExtensionNames = &extension;
    check(vkCreateDevice(physical, &of_device, nullptr, &device), "vkCreateDevice");

    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (uint32_t i = 0; i < 3; ++i)
      bindings.push_back({i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    auto of_set = made<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    of_set.bindingCount = uint32_t(bindings.size());
    of_set.pBindings = bindings.data();
    VkDescriptorSetLayout set = VK_NULL_HANDLE;
    check(vkCreateDescriptorSetLayout(device, &of_set, nullptr, &set), "vkCreateDescriptorSetLayout");
    auto of_layout = made<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    of_layout.setLayoutCount = 1;
    of_layout.pSetLayouts = &set;
    check(vkCreatePipelineLayout(device, &of_layout, nullptr, &layout), "vkCreatePipelineLayout");
  }

  void print(const std::string& path) const {
    std::ifstream file(path, std::ios::binary);
    const std::string code{std::istreambuf_iterator<char>(file), {}};
    if (code.empty() || code.size() % 4 != 0) throw std::runtime_error(path + " has no SPIR-V");
    const std::vector<uint32_t> words(reinterpret_cast<const uint32_t*>(code.data()),
                                      reinterpret_cast<const uint32_t*>(code.data() + code.size()));
    auto of_module = made<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    of_module.codeSize = code.size();
    of_module.pCode = words.data();
    auto wanted = made<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
    wanted.flags = VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
    wanted.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    wanted.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    check(vkCreateShaderModule(device, &of_module, nullptr, &wanted.stage.module), "vkCreateShaderModule");
    wanted.stage.pName = "main";
    wanted.layout = layout;
    VkPipeline pipeline = VK_NULL_HANDLE;
    check(vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &wanted, nullptr, &pipeline),
          "vkCreateComputePipelines");

    const auto get = reinterpret_cast<PFN_vkGetPipelineExecutableStatisticsKHR>(
        vkGetDeviceProcAddr(device, "vkGetPipelineExecutableStatisticsKHR"));
    auto first = made<VkPipelineExecutableInfoKHR>(VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR);
    first.pipeline = pipeline;
    uint32_t count = 0;
    check(get(device, &first, &count, nullptr), "vkGetPipelineExecutableStatisticsKHR");
    std::vector<VkPipelineExecutableStatisticKHR> all(
        count, {VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR, nullptr, {}, {}, {}, {}});
    check(get(device, &first, &count, all.data()), "vkGetPipelineExecutableStatisticsKHR");
    for (const VkPipelineExecutableStatisticKHR& each : all)
      if (each.format == VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_UINT64_KHR)
        std::printf("%s\t%s\t%" PRIu64 "\n", std::filesystem::path(path).stem().string().c_str(), each.name,
                    each.value.u64);
  }
};

}  // namespace

int main(int count, char** arguments) {
  try {
    const Compiler compiler;
    for (int i = 1; i < count; ++i) compiler.print(arguments[i]);
    return count > 1 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "shader_registers: %s\n", error.what());
    return 1;
  }
}
