// SPDX-License-Identifier: Apache-2.0
#include "tests/app/operation/line_client.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <stdexcept>

namespace tendril::app {

LineClient::LineClient(const std::filesystem::path& socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
  socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(socket_);
    throw std::runtime_error("nobody listens at " + socket.string());
  }
}

LineClient::~LineClient() { ::close(socket_); }

std::size_t LineClient::send(const std::string& bytes) {
  const ssize_t size = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  return size > 0 ? static_cast<std::size_t>(size) : 0;
}

std::string LineClient::receive() {
  std::string all;
  char piece[4096];
  ssize_t size;
  while ((size = ::recv(socket_, piece, sizeof piece, 0)) > 0)
    all.append(piece, static_cast<std::size_t>(size));
  ended_ = size == 0;
  return all;
}

}  // namespace tendril::app
