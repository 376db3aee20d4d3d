// SPDX-License-Identifier: Apache-2.0
#include "app/view/access.h"

#include <catch2/catch.hpp>
#include <set>

namespace tendril::app::access_test {

std::string refusal(const std::string& text) {
  try {
    read_address(text);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST_CASE("An address to listen at is one in numbers, with a port", "[unit]") {
  const Address here = read_address("127.0.0.1:8765");
  CHECK(here.host == "127.0.0.1");
  CHECK(here.port == 8765);
  CHECK(here.is_loopback());
  CHECK(here.text() == "127.0.0.1:8765");
  CHECK(read_address("[::1]:0").is_loopback());
  CHECK(read_address("[::1]:80").text() == "[::1]:80");
  CHECK_FALSE(read_address("0.0.0.0:8765").is_loopback());
  CHECK_FALSE(read_address("[::]:8765").is_loopback());
  for (const char* wrong : {"", "8765", ":8765", "localhost:8765", "127.0.0.1:", "127.0.0.1:65536",
                            "127.0.0.1:-1", "127.0.0.1:80x", "::1:8765", "[::1]", "127.0.0.1"}) {
    CAPTURE(wrong);
    CHECK_THAT(refusal(wrong), Catch::Contains("such as 127.0.0.1:8765"));
  }
}

TEST_CASE("A host that is a name other than localhost may be an attacker's", "[unit]") {
  for (const char* own : {"127.0.0.1:8765", "127.0.0.1", "localhost:8765", "localhost", "192.168.1.5:80",
                          "[::1]:8765", "[fe80::1]"})
    CHECK(is_own_host(own));
  for (const char* other : {"", "evil.example:8765", "127.0.0.1.evil.example", "localhost.evil.example",
                            "[::1", "::1", "[evil.example]", "127.0.0.1@evil.example", "[", "[]", ":8765"}) {
    CAPTURE(other);
    CHECK_FALSE(is_own_host(other));
  }
}

TEST_CASE("A page of another origin is not ours, a program without one is", "[unit]") {
  CHECK(is_own_origin("http://127.0.0.1:8765", "127.0.0.1:8765"));
  CHECK(is_own_origin("https://127.0.0.1:8765", "127.0.0.1:8765"));
  CHECK(is_own_origin("", "127.0.0.1:8765"));
  for (const char* other : {"http://evil.example", "http://127.0.0.1:8766", "http://localhost:8765", "null",
                            "file://127.0.0.1:8765", "http://127.0.0.1:8765.evil.example"})
    CHECK_FALSE(is_own_origin(other, "127.0.0.1:8765"));
}

TEST_CASE("Tokens are compared whole, and are never made twice", "[unit]") {
  CHECK(same_token("secret", "secret"));
  for (const char* wrong : {"", "secre", "secret ", "Secret", "secres"})
    CHECK_FALSE(same_token(wrong, "secret"));
  std::set<std::string> made;
  for (int k = 0; k < 100; ++k) made.insert(make_token());
  CHECK(made.size() == 100);
  CHECK(made.begin()->size() == 32);
}

TEST_CASE("Without a token a page asks for what it sees, and for nothing else", "[unit]") {
  for (const char* seen : {"status", "subscribe", "geometry", "surface"}) CHECK(only_watches(seen));
  for (const char* other :
       {"acquire", "release", "target", "hold", "play", "pause", "resume", "set", "stop", "", "dance"})
    CHECK_FALSE(only_watches(other));
}

}  // namespace tendril::app::access_test
