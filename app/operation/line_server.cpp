// SPDX-License-Identifier: Apache-2.0
#include "app/operation/line_server.h"

#include <fmt/format.h>
#include <pwd.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "hal/bus/unix_address.h"

namespace tendril::app {
namespace {

constexpr int kLinesAtOnce = 32;  // of one client in one call of serve()
constexpr int kListening = 0;     // number of the listening socket among those of the clients

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
  throw std::runtime_error(fmt::format("cannot listen at {}: {}", path.string(), why));
}

/// The name of a user of this machine, else the number: a directory in the network would be asked for it over
/// the network, for as long as that takes.
std::string user_name(uid_t user) {
  const std::unique_ptr<FILE, int (*)(FILE*)> users(std::fopen("/etc/passwd", "re"), std::fclose);
  if (users)
    while (const passwd* entry = ::fgetpwent(users.get()))
      if (entry->pw_uid == user) return entry->pw_name;
  return std::to_string(user);
}

bool somebody_listens(const hal::UnixAddress& address) {
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const bool answered = ::connect(probe, address.get(), address.size) == 0 || errno == EAGAIN;
  ::close(probe);
  return answered;
}

/// Removes a socket at which nobody listens any more.
void make_way(const std::filesystem::path& path, const hal::UnixAddress& address) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) return;  // what else is wrong shows when it is bound
  if (!S_ISSOCK(found.st_mode))
    refuse(path, "there is a file that is no socket; choose another path with --socket");
  if (somebody_listens(address))
    refuse(path, "another process listens there; stop it, or choose another path with --socket");
  ::unlink(path.c_str());
}

}  // namespace

LineServer::LineServer(const std::filesystem::path& path, Listener& listener)
    : path_(path), listener_(listener) {
  const hal::UnixAddress address = hal::unix_address(path.string());
  make_way(path, address);
  socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  // Nobody can connect before listen(), so the mode holds from the first client on.
  if (socket_ < 0 || ::bind(socket_, address.get(), address.size) != 0 ||
      ::chmod(path.c_str(), S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP) != 0 ||
      ::listen(socket_, kMaxClients) != 0) {
    const std::string why = std::strerror(errno);
    if (socket_ >= 0) ::close(socket_);
    refuse(path, why + "; choose a path in a folder that exists and may be written, with --socket");
  }
  epoll_ = ::epoll_create1(EPOLL_CLOEXEC);
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = kListening;
  ::epoll_ctl(epoll_, EPOLL_CTL_ADD, socket_, &event);
}

LineServer::~LineServer() {
  for (auto& [number, client] : clients_) {
    write(client);  // what is said last
    ::close(client.descriptor);
  }
  ::close(epoll_);
  ::close(socket_);
  ::unlink(path_.c_str());
}

void LineServer::serve() {
  std::array<epoll_event, kMaxClients + 1> events;
  const int count = ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), 0);
  for (int k = 0; k < count; ++k) {
    const auto client = clients_.find(events[k].data.fd);
    if (client == clients_.end()) continue;
    if (events[k].events & EPOLLOUT) write(client->second);
    if (events[k].events & (EPOLLIN | EPOLLHUP | EPOLLERR)) read(client->second);
  }
  std::vector<int> ended;
  for (auto& [number, client] : clients_) {
    hand_over_lines(number, client);
    if (client.ended && !client.lines_wait) ended.push_back(number);
  }
  for (const int number : ended) drop(number);
  for (auto& [number, client] : clients_) watch(number, client);
  accept_clients();
}

void LineServer::accept_clients() {
  for (int descriptor;
       (descriptor = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)) >= 0;) {
    if (!make_room()) {
      ::close(descriptor);
      continue;
    }
    const int number = next_number_++;
    Client& client = clients_[number];
    client.descriptor = descriptor;
    watch(number, client);
    listener_.connected(number);
  }
}

/// Where all places are taken, the client that has been silent for longest, from its start, gives up its own.
bool LineServer::make_room() {
  if (clients_.size() < kMaxClients) return true;
  const auto silent =
      std::find_if(clients_.begin(), clients_.end(), [](const auto& entry) { return !entry.second.spoke; });
  if (silent == clients_.end()) return false;
  drop(silent->first);
  return true;
}

/// A part of what a client has sent. What waits in the kernel beyond it holds up the sender.
void LineServer::read(Client& client) {
  std::array<char, 16'384> piece;
  if (client.lines_wait) return;
  const ssize_t size = ::recv(client.descriptor, piece.data(), piece.size(), 0);
  if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) client.ended = true;
  if (size > 0) client.in.append(piece.data(), static_cast<std::size_t>(size));
}

void LineServer::hand_over_lines(int number, Client& client) {
  std::size_t begin = 0;
  for (int lines = 0; lines < kLinesAtOnce; ++lines) {
    const std::size_t end = client.in.find('\n', begin);
    if (end == std::string::npos) break;
    client.spoke = true;
    if (!std::exchange(client.skipping, false)) {
      if (end - begin < kMaxLine)
        listener_.received(number, std::string_view(client.in).substr(begin, end - begin));
      else
        listener_.too_long(number);
    }
    begin = end + 1;
  }
  client.in.erase(0, begin);
  client.lines_wait = client.in.find('\n') != std::string::npos;
  if (client.lines_wait || client.in.size() < kMaxLine) return;
  client.in.clear();
  if (!std::exchange(client.skipping, true)) listener_.too_long(number);
}

bool LineServer::send(int number, std::string_view line) {
  const auto found = clients_.find(number);
  if (found == clients_.end()) return false;
  Client& client = found->second;
  if (client.out.size() >= kMaxUnread) return false;
  client.out.append(line).push_back('\n');
  write(client);
  watch(number, client);
  return true;
}

void LineServer::write(Client& client) {
  const ssize_t size = ::send(client.descriptor, client.out.data(), client.out.size(), MSG_NOSIGNAL);
  if (size > 0) client.out.erase(0, static_cast<std::size_t>(size));
  if (size < 0 && errno != EAGAIN && errno != EINTR) client.out.clear();  // reading will tell that it is gone
}

/// Lines that wait to be handed over count as something to do: the kernel says that a client may be written
/// to.
void LineServer::watch(int number, Client& client) const {
  const uint32_t wanted = client.lines_wait || !client.out.empty() ? EPOLLIN | EPOLLOUT : EPOLLIN;
  const uint32_t before = std::exchange(client.events, wanted);
  if (wanted == before) return;
  epoll_event event{};
  event.events = wanted;
  event.data.fd = number;
  ::epoll_ctl(epoll_, before == 0 ? EPOLL_CTL_ADD : EPOLL_CTL_MOD, client.descriptor, &event);
}

void LineServer::drop(int number) {
  ::close(clients_.at(number).descriptor);
  clients_.erase(number);
  listener_.gone(number);
}

std::size_t LineServer::unread(int number) const {
  const auto found = clients_.find(number);
  return found == clients_.end() ? 0 : found->second.out.size();
}

std::string LineServer::peer(int number) const {
  const auto found = clients_.find(number);
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (found == clients_.end() ||
      ::getsockopt(found->second.descriptor, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0)
    return "an unknown user";
  return fmt::format("user {} (process {})", user_name(credentials.uid), credentials.pid);
}

}  // namespace tendril::app
