// SPDX-License-Identifier: Apache-2.0
#include "app/config/utf8.h"

#include <nlohmann/json.hpp>

namespace tendril::app {

std::string valid_utf8(std::string_view text) {
  return nlohmann::json::parse(to_text(nlohmann::json(text))).get<std::string>();
}

std::string to_text(const nlohmann::json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string to_text(const nlohmann::ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace tendril::app
