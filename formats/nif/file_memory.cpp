// Loads a file. The header is checked before memory is allocated, so a huge file that is no asset is refused
// at once. A file that shrinks while it is read gives an error, not a crash.
#include "formats/nif/file_memory.hpp"

#include <algorithm>

#include "formats/base/size.hpp"
#include "formats/nif/container.hpp"
#include "formats/nif/input_file.hpp"

namespace nif::format {

FileMemory FileMemory::load(const std::string& path, Mode mode, std::pmr::memory_resource* memory) {
  const InputFile file(path);
  const auto size = memory_size(file.size());
  std::byte start[sizeof(Header)];
  const size_t started = file.read_at(start, sizeof(start), 0);
  check_header({start, started}, size, path);

  if (mode == Mode::map) return {Kind::mapped, file.map(), memory};
  return filled(size, memory, [&](std::span<std::byte> to) {
    if (file.read_at(to.data(), size, 0) != size)
      throw Error(Status::file_unreadable, path + ": cannot be read: it shrank while it was read");
  });
}

FileMemory FileMemory::copy(std::span<const std::byte> bytes, std::pmr::memory_resource* memory) {
  return filled(bytes.size(), memory,
                [&](std::span<std::byte> to) { std::copy(bytes.begin(), bytes.end(), to.begin()); });
}

FileMemory FileMemory::borrow(std::span<const std::byte> bytes) { return {Kind::borrowed, bytes, nullptr}; }

FileMemory::~FileMemory() {
  auto* at = const_cast<std::byte*>(bytes_.data());
  if (kind_ == Kind::owned) memory_->deallocate(at, bytes_.size(), kAlignment);
  if (kind_ == Kind::mapped) InputFile::unmap(bytes_);
}

}  // namespace nif::format
