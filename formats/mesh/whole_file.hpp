// What read() and Poser share: the way from a file's name to the input of a reader. Internal to formats/mesh.
#pragma once

#include <exception>
#include <functional>
#include <new>
#include <stdexcept>
#include <vector>

#include "formats/base/file_name.hpp"
#include "formats/mesh/file_bytes.hpp"
#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// The file, unpacked.
ByteBuffer load_unpacked(const std::filesystem::path& file, const ReadLimits& limits);

/// `bytes` are those of the file, unpacked.
Input describe(const std::filesystem::path& file, std::string_view bytes, const ReadLimits& limits);

/// A byte order mark would hide the first word of a text.
void skip_byte_order_mark(Input& input);

/// Whether the glTF reader reads it.
bool is_gltf(const Input& input);

/// Scene::source_hash. `external`: the files that its reader found.
uint64_t source_hash(const Input& input, std::string_view bytes, const std::vector<ExternalFile>& external);

/// Libraries throw anything; callers are promised an Error.
template <class Work>
auto promised(const std::filesystem::path& path, Work&& work) {
  const std::filesystem::path file = path == kStandardInput ? kStandardInputName : path;
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw Error(Status::too_large, file.string() + ": needs more memory than there is");
  } catch (const std::length_error&) {
    throw Error(Status::too_large, file.string() + ": needs more memory than there is");
  } catch (const std::exception& error) {
    throw Error(Status::malformed_mesh, file.string() + ": cannot be read (" + error.what() + ")");
  }
}

}  // namespace nif::mesh::detail
