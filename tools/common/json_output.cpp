// A file name may hold any bytes, and JSON must be UTF-8. Bytes that are not are replaced instead of
// throwing.
#include "tools/common/json_output.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace nif::tools {

void write_json(const nlohmann::ordered_json& json, std::FILE* out) {
  fmt::print(out, "{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

}  // namespace nif::tools
