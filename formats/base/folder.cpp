#include "formats/base/folder.hpp"

#include <dirent.h>

#include <cerrno>
#include <memory>
#include <new>
#include <string_view>

namespace nif {

std::error_code for_each_name(const std::filesystem::path& folder,
                              const std::function<void(const std::string&)>& visit) {
  const auto close = [](DIR* opened) { ::closedir(opened); };
  const std::unique_ptr<DIR, decltype(close)> opened(::opendir(folder.empty() ? "." : folder.c_str()));
  if (!opened && errno == ENOMEM) throw std::bad_alloc();
  if (!opened) return {errno, std::generic_category()};
  for (;;) {
    errno = 0;
    const dirent* entry = ::readdir(opened.get());
    if (!entry) return {errno, std::generic_category()};
    const std::string_view name = entry->d_name;
    if (name != "." && name != "..") visit(std::string(name));
  }
}

}  // namespace nif
