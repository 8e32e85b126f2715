// InputFile with Windows calls. Beware: paths become UTF-16 whatever the code page is, folders must be told
// apart from locked files, one call reads less than 4 GiB, and system messages are in any language.
#ifndef NOMINMAX
#define NOMINMAX
#endif
#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include <algorithm>

#include "formats/base/status.hpp"
#include "formats/nif/input_file.hpp"

namespace nif::format {
namespace {

[[noreturn]] void unreadable(const std::string& path, const std::string& why) {
  throw Error(Status::file_unreadable, path + ": cannot be read: " + why);
}

[[noreturn]] void not_found(const std::string& path) {
  throw Error(Status::file_not_found, path + ": there is no such file");
}

/// Windows' own messages are in the machine's language, in any encoding.
std::string reason(DWORD error) {
  switch (error) {
    case ERROR_ACCESS_DENIED:
      return "access is denied";
    case ERROR_SHARING_VIOLATION:
    case ERROR_LOCK_VIOLATION:
      return "another program is using it";
    default:
      return "error " + std::to_string(error) + " of Windows";
  }
}

/// As Windows takes it, whatever the process's code page.
std::wstring to_wide(const std::string& path) {
  constexpr size_t kMost = 1 << 20;  // far longer than any path that Windows accepts
  if (path.empty() || path.size() > kMost) not_found(path);
  const auto bytes = int(path.size());
  const int count = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path.data(), bytes, nullptr, 0);
  if (count <= 0)
    throw Error(Status::file_not_found, path + ": there is no such file: its name is not UTF-8");
  std::wstring wide(size_t(count), L'\0');
  MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path.data(), bytes, wide.data(), count);
  return wide;
}

/// Its size. Throws if it is not a file.
uint64_t size_of(HANDLE file, const std::string& path) {
  if (GetFileType(file) != FILE_TYPE_DISK) unreadable(path, "it is not a regular file");
  BY_HANDLE_FILE_INFORMATION about;
  if (!GetFileInformationByHandle(file, &about)) unreadable(path, reason(GetLastError()));
  if (about.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) unreadable(path, "it is a folder");
  return uint64_t{about.nFileSizeHigh} << 32 | about.nFileSizeLow;
}

HANDLE handle_of(intptr_t file) { return reinterpret_cast<HANDLE>(file); }

}  // namespace

InputFile::InputFile(const std::string& path) : path_(path) {
  // Others may keep writing, replacing and removing the file, as on other systems. Without "backup semantics"
  // a folder could not be opened, nor told apart from an unreadable file.
  HANDLE file =
      CreateFileW(to_wide(path).c_str(), GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                  nullptr, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL | FILE_FLAG_BACKUP_SEMANTICS, nullptr);
  if (file == INVALID_HANDLE_VALUE) {
    const DWORD error = GetLastError();
    if (error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND || error == ERROR_INVALID_NAME ||
        error == ERROR_BAD_PATHNAME || error == ERROR_DIRECTORY)
      not_found(path);
    unreadable(path, reason(error));
  }
  handle_ = reinterpret_cast<intptr_t>(file);
  try {
    size_ = size_of(file, path);
  } catch (...) {
    CloseHandle(file);
    throw;
  }
}

InputFile::~InputFile() { CloseHandle(handle_of(handle_)); }

size_t InputFile::read_at(std::byte* to, size_t count, uint64_t offset) const {
  size_t done = 0;
  while (done < count) {
    OVERLAPPED where{};
    where.Offset = DWORD(offset + done);
    where.OffsetHigh = DWORD((offset + done) >> 32);
    DWORD got = 0;
    // One call reads less than 4 GiB.
    const auto wanted = DWORD(std::min<size_t>(count - done, size_t{1} << 30));
    if (!ReadFile(handle_of(handle_), to + done, wanted, &got, &where)) {
      if (GetLastError() == ERROR_HANDLE_EOF) break;
      unreadable(path_, reason(GetLastError()));
    }
    if (got == 0) break;
    done += got;
  }
  return done;
}

std::span<const std::byte> InputFile::map() const {
  // The view keeps the mapping alive.
  HANDLE mapping = CreateFileMappingW(handle_of(handle_), nullptr, PAGE_READONLY, 0, 0, nullptr);
  const void* at = mapping ? MapViewOfFile(mapping, FILE_MAP_READ, 0, 0, 0) : nullptr;
  const DWORD error = GetLastError();
  if (mapping) CloseHandle(mapping);
  if (!at) unreadable(path_, "it cannot be mapped: " + reason(error));
  return {static_cast<const std::byte*>(at), size_t(size_)};
}

void InputFile::unmap(std::span<const std::byte> bytes) { UnmapViewOfFile(bytes.data()); }

}  // namespace nif::format
