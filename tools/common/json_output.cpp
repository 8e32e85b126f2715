// A file name may contain any bytes, but JSON must be UTF-8. Invalid bytes are replaced instead of throwing.
#include "tools/common/json_output.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace nif::tools {

void write_json(const nlohmann::ordered_json& json, std::FILE* out) {
  fmt::print(out, "{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

}  // namespace nif::tools
