// SPDX-License-Identifier: Apache-2.0
#include "tests/app/daemon/notify_socket.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <system_error>

namespace tendril::app {
namespace {

void require(bool done, const char* what) {
  if (!done) throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

NotifySocket::NotifySocket() : socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  require(socket_ >= 0, "cannot make a socket");
  sockaddr_un name{.sun_family = AF_UNIX, .sun_path = {}};
  auto* const any = reinterpret_cast<sockaddr*>(&name);
  // Without a name the kernel gives one that is free, outside the file system: a zero byte, which sd_notify
  // writes as @, and five digits.
  require(bind(socket_, any, sizeof name.sun_family) == 0, "cannot bind a socket");
  socklen_t length = sizeof name;
  require(getsockname(socket_, any, &length) == 0, "cannot ask for the name of a socket");
  address_.assign(name.sun_path, length - offsetof(sockaddr_un, sun_path));
  address_[0] = '@';
  const int on = 1;
  require(setsockopt(socket_, SOL_SOCKET, SO_PASSCRED, &on, sizeof on) == 0, "cannot ask for senders");
}

NotifySocket::~NotifySocket() { close(socket_); }

std::optional<NotifySocket::Message> NotifySocket::next(double seconds) {
  pollfd readable{socket_, POLLIN, 0};
  if (poll(&readable, 1, static_cast<int>(1e3 * seconds)) != 1) return std::nullopt;
  char bytes[4096];
  iovec payload{bytes, sizeof bytes};
  alignas(cmsghdr) char ancillary[CMSG_SPACE(sizeof(ucred))];
  msghdr header{};
  header.msg_iov = &payload;
  header.msg_iovlen = 1;
  header.msg_control = ancillary;
  header.msg_controllen = sizeof ancillary;
  const ssize_t got = recvmsg(socket_, &header, 0);
  require(got >= 0, "cannot receive");
  ucred sender{};
  if (const cmsghdr* control = CMSG_FIRSTHDR(&header))
    std::memcpy(&sender, CMSG_DATA(control), sizeof sender);
  return Message{{bytes, static_cast<std::size_t>(got)}, sender.pid};
}

}  // namespace tendril::app
