// SPDX-License-Identifier: Apache-2.0
#include "app/view/access.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <stdexcept>

namespace tendril::app {
namespace {

bool is_ip(int family, const std::string& text) {
  std::array<unsigned char, sizeof(in6_addr)> address;
  return ::inet_pton(family, text.c_str(), address.data()) == 1;
}

/// "HOST", "HOST:PORT" or "[HOST]:PORT" without its port.
std::string_view without_port(std::string_view host) {
  if (host.starts_with('[')) return host.substr(1, host.find(']') == host.npos ? 0 : host.find(']') - 1);
  return host.substr(0, host.find(':'));
}

}  // namespace

bool Address::is_loopback() const { return host.starts_with("127.") || host == "::1"; }

std::string Address::text() const {
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                             : fmt::format("[{}]:{}", host, port);
}

Address read_address(const std::string& text) {
  const auto refuse = [&] {
    throw std::runtime_error(fmt::format(
        "--listen is an address and a port, such as 127.0.0.1:8765 or [::1]:8765, not '{}'", text));
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) refuse();
  Address address;
  address.host = text.substr(0, colon);
  const bool brackets = address.host.starts_with('[') && address.host.ends_with(']');
  if (brackets) address.host = address.host.substr(1, address.host.size() - 2);
  if (!is_ip(brackets ? AF_INET6 : AF_INET, address.host)) refuse();
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, address.port);
  if (error != std::errc() || rest != end) refuse();
  return address;
}

bool is_own_host(std::string_view host) {
  const std::string name(without_port(host));
  return name == "localhost" || is_ip(AF_INET, name) || (host.starts_with('[') && is_ip(AF_INET6, name));
}

bool is_own_origin(std::string_view origin, std::string_view host) {
  if (origin.empty()) return true;
  for (const std::string_view scheme : {"http://", "https://"})
    if (origin.starts_with(scheme) && origin.substr(scheme.size()) == host) return true;
  return false;
}

bool same_token(std::string_view given, std::string_view token) {
  if (given.size() != token.size()) return false;
  unsigned difference = 0;
  for (std::size_t k = 0; k < token.size(); ++k)
    difference |=
        static_cast<unsigned>(static_cast<unsigned char>(given[k]) ^ static_cast<unsigned char>(token[k]));
  return difference == 0;
}

std::string make_token() {
  std::array<unsigned char, 16> bytes;
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error("the kernel gives no random numbers; choose a token with --token");
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

bool only_watches(std::string_view command) {
  return command == "status" || command == "subscribe" || command == "geometry" || command == "surface";
}

}  // namespace tendril::app
