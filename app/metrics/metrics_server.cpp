// SPDX-License-Identifier: Apache-2.0
#include "app/metrics/metrics_server.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace tendril::app {
namespace {

constexpr const char* kEndOfRequest = "\r\n\r\n";

/// A socket's address, of either family.
struct Address {
  sockaddr_storage storage{};
  socklen_t size = sizeof(sockaddr_storage);

  sockaddr* any() { return reinterpret_cast<sockaddr*>(&storage); }
  sockaddr_in& v4() { return reinterpret_cast<sockaddr_in&>(storage); }
  sockaddr_in6& v6() { return reinterpret_cast<sockaddr_in6&>(storage); }
};

[[noreturn]] void refuse(const std::string& address, const std::string& why) {
  throw std::runtime_error(fmt::format("cannot tell metrics at '{}': {}", address, why));
}

Address parse(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  std::string host = colon == std::string::npos ? "127.0.0.1" : text.substr(0, colon);
  const std::string_view port_text =
      std::string_view(text).substr(colon == std::string::npos ? 0 : colon + 1);
  uint16_t port = 0;
  const char* end = port_text.data() + port_text.size();
  const auto [stop, error] = std::from_chars(port_text.data(), end, port);
  const bool is_v6 = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (is_v6) host = host.substr(1, host.size() - 2);
  Address address;
  address.size = is_v6 ? sizeof(sockaddr_in6) : sizeof(sockaddr_in);
  address.storage.ss_family = is_v6 ? AF_INET6 : AF_INET;
  void* place = is_v6 ? static_cast<void*>(&address.v6().sin6_addr) : &address.v4().sin_addr;
  (is_v6 ? address.v6().sin6_port : address.v4().sin_port) = htons(port);
  if (error != std::errc() || stop != end || ::inet_pton(address.storage.ss_family, host.c_str(), place) != 1)
    refuse(text, "expected an address and a port, as in --metrics 127.0.0.1:9477 or [::1]:9477");
  return address;
}

Address address_of(int socket) {
  Address address;
  ::getsockname(socket, address.any(), &address.size);
  return address;
}

void watch(int epoll, int socket, uint32_t events, int operation) {
  epoll_event event{};
  event.events = events;
  event.data.fd = socket;
  ::epoll_ctl(epoll, operation, socket, &event);
}

std::string response(const char* status, const char* type, std::string_view body) {
  return fmt::format("HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}",
                     status, type, body.size(), body);
}

}  // namespace

MetricsServer::MetricsServer(const std::string& address, std::function<std::string()> text)
    : text_(std::move(text)) {
  Address parsed = parse(address);
  socket_ = ::socket(parsed.storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;  // else the port stays taken for a minute after the daemon's end
  if (socket_ < 0 || ::setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
      ::bind(socket_, parsed.any(), parsed.size) != 0 || ::listen(socket_, kMaxClients) != 0) {
    const std::string why = std::strerror(errno);
    if (socket_ >= 0) ::close(socket_);
    refuse(address, why + "; choose another address or port with --metrics");
  }
  epoll_ = ::epoll_create1(EPOLL_CLOEXEC);
  watch(epoll_, socket_, EPOLLIN, EPOLL_CTL_ADD);
}

MetricsServer::~MetricsServer() {
  for (const Client& client : clients_) ::close(client.descriptor);
  ::close(epoll_);
  ::close(socket_);
}

std::string MetricsServer::address() const {
  Address address = address_of(socket_);
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool is_v6 = address.storage.ss_family == AF_INET6;
  ::inet_ntop(address.storage.ss_family,
              is_v6 ? static_cast<const void*>(&address.v6().sin6_addr) : &address.v4().sin_addr, text.data(),
              text.size());
  return is_v6 ? fmt::format("[{}]:{}", text.data(), ntohs(address.v6().sin6_port))
               : fmt::format("{}:{}", text.data(), ntohs(address.v4().sin_port));
}

bool MetricsServer::is_local() const {
  Address address = address_of(socket_);
  if (address.storage.ss_family == AF_INET6) return IN6_IS_ADDR_LOOPBACK(&address.v6().sin6_addr);
  return ntohl(address.v4().sin_addr.s_addr) >> 24 == IN_LOOPBACKNET;
}

void MetricsServer::serve() {
  std::array<epoll_event, kMaxClients + 1> events;
  const int count = ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), 0);
  for (int k = 0; k < count; ++k)
    for (Client& client : clients_) {
      if (client.descriptor != events[k].data.fd) continue;
      if (events[k].events & EPOLLOUT)
        write(client);
      else
        read(client);
    }
  std::erase_if(clients_, [](const Client& client) {
    if (client.ended) ::close(client.descriptor);
    return client.ended;
  });
  accept_clients();
}

/// Where all places are taken, the client that has been here for longest gives up its own.
void MetricsServer::accept_clients() {
  for (std::size_t k = 0; k < kMaxClients; ++k) {
    const int descriptor = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (descriptor < 0) return;
    if (clients_.size() == kMaxClients) {
      ::close(clients_.front().descriptor);
      clients_.pop_front();
    }
    clients_.push_back({descriptor, {}, {}});
    watch(epoll_, descriptor, EPOLLIN, EPOLL_CTL_ADD);
  }
}

void MetricsServer::read(Client& client) {
  std::array<char, 4'096> piece;
  const ssize_t size = ::recv(client.descriptor, piece.data(), piece.size(), 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  client.ended = size <= 0;
  if (client.ended) return;
  client.in.append(piece.data(), static_cast<std::size_t>(size));
  if (client.in.find(kEndOfRequest) != std::string::npos)
    client.out = answer(client.in);
  else if (client.in.size() > kMaxRequest)
    client.out = response("431 Request Header Fields Too Large", "text/plain", "the request is too long\n");
  else
    return;
  watch(epoll_, client.descriptor, EPOLLOUT, EPOLL_CTL_MOD);
  write(client);
}

void MetricsServer::write(Client& client) {
  const ssize_t size = ::send(client.descriptor, client.out.data(), client.out.size(), MSG_NOSIGNAL);
  if (size > 0) client.out.erase(0, static_cast<std::size_t>(size));
  client.ended = client.out.empty() || (size < 0 && errno != EAGAIN && errno != EINTR);
}

std::string MetricsServer::answer(const std::string& request) const {
  const std::string_view line = std::string_view(request).substr(0, request.find("\r\n"));
  if (!line.starts_with("GET "))
    return response("405 Method Not Allowed", "text/plain", "only GET is answered\n");
  const std::string_view path = line.substr(4, line.find_first_of(" ?", 4) - 4);
  if (path != "/metrics") return response("404 Not Found", "text/plain", "metrics are at /metrics\n");
  return response("200 OK", "text/plain; version=0.0.4; charset=utf-8", text_());
}

}  // namespace tendril::app
