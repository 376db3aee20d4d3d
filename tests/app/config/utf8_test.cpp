// SPDX-License-Identifier: Apache-2.0
#include "app/config/utf8.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <random>

namespace tendril::app::utf8_test {

TEST_CASE("A text is left as it is where it is UTF-8, and made so where not", "[unit]") {
  for (const char* good : {"", "robots/dünne Finger.yaml", "a \"b\"\n\\c\x01", "\xF0\x9F\xA4\x96"})
    CHECK(valid_utf8(good) == good);
  CHECK(valid_utf8("a\xFF/b") == "a\uFFFD/b");
  CHECK(valid_utf8("cut short \xE2\x82") == "cut short \uFFFD");
}

TEST_CASE("No text that JSON holds keeps it from being written, and what is written can be read", "[law]") {
  const auto seed = GENERATE(range(1u, 200u));
  CAPTURE(seed);
  std::mt19937 random(seed);
  std::string text(random() % 40, ' ');
  for (char& letter : text) letter = static_cast<char>(random());
  const std::string valid = valid_utf8(text);
  CHECK(valid_utf8(valid) == valid);
  const nlohmann::ordered_json object{{"file", text}, {text, 1}};
  const auto read = nlohmann::ordered_json::parse(to_text(object), nullptr, false);
  REQUIRE(read.is_object());
  CHECK(read.at("file") == valid);
  CHECK(read == nlohmann::ordered_json::parse(to_text(object, 2)));
}

}  // namespace tendril::app::utf8_test
