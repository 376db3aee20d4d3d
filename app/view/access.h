// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

// Who may see and move the robot over the network. Real-time: no, all of it.
namespace tendril::app {

/// Where to listen.
struct Address {
  std::string host;  ///< an IP address, without brackets
  uint16_t port = 0;

  bool is_loopback() const;
  std::string text() const;  ///< "127.0.0.1:8765", "[::1]:8765"
};

/// Reads "ADDRESS:PORT", such as "127.0.0.1:8765" or "[::1]:8765". Port 0: any that is free.
/// @throws std::runtime_error with what is expected
Address read_address(const std::string& text);

/// Whether a browser that sends this Host header means us. Only an address or "localhost" does: a name may be
/// one that an attacker's page has let point to this machine, and then that page could read what we answer
/// (DNS rebinding).
bool is_own_host(std::string_view host);

/// Whether a page of ours opens the connection. A program that is no browser sends no origin, and can pretend
/// anything.
/// @param origin  the header Origin, empty where there is none
bool is_own_origin(std::string_view origin, std::string_view host);

/// Compares in a time that does not tell how much of it was right.
bool same_token(std::string_view given, std::string_view token);

/// 128 random bits, as 32 letters.
std::string make_token();

/// Whether a command of the control protocol only watches, so that it needs no token.
bool only_watches(std::string_view command);

}  // namespace tendril::app
