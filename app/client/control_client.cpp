// SPDX-License-Identifier: Apache-2.0
#include "app/client/control_client.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "app/config/utf8.h"
#include "hal/bus/unix_address.h"

namespace tendril::app {
namespace {

using nlohmann::ordered_json;

constexpr int kPatience_s = 5;
constexpr int kVersion = 1;

}  // namespace

ControlClient::ControlClient(const std::filesystem::path& path) : name_(path.string()) {
  const hal::UnixAddress address = hal::unix_address(name_);
  socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval limit{kPatience_s, 0};
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  try {
    if (::connect(socket_, address.get(), address.size) != 0) {
      const int error = errno;
      throw std::runtime_error(fmt::format("no daemon at {}: {}; {}", name_, std::strerror(error),
                                           error == EACCES ? "join the group that may use the socket"
                                                           : "does tendrild run, and with this --socket?"));
    }
    greeting_ = read();
    if (greeting_.value("version", 0) != kVersion)
      throw std::runtime_error(fmt::format(
          "{}: whoever listens there does not speak version {} of the control protocol", name_, kVersion));
  } catch (...) {
    ::close(socket_);
    throw;
  }
}

ControlClient::~ControlClient() { ::close(socket_); }

ordered_json ControlClient::ask(const ordered_json& request) {
  ordered_json message = request;
  message["id"] = ++last_id_;
  message["version"] = kVersion;
  const std::string line = to_text(message) + "\n";
  for (std::size_t sent = 0; sent < line.size();) {
    const ssize_t size = ::send(socket_, line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
    if (size <= 0) throw std::runtime_error(fmt::format("{}: the daemon does not listen any more", name_));
    sent += static_cast<std::size_t>(size);
  }
  ordered_json answer = read();
  for (; !answer.contains("ok") || answer.value("id", ordered_json()) != last_id_; answer = read())
    if (answer.contains("event")) events_.push_back(answer);
  if (!answer.value("ok", false))
    throw RequestRefused(answer.value("error", ordered_json::object()).value("message", to_text(answer)));
  return answer;
}

ordered_json ControlClient::next() {
  if (!events_.empty()) {
    const ordered_json event = events_.front();
    events_.pop_front();
    return event;
  }
  ordered_json message = read();
  while (message.contains("ok")) message = read();
  return message;
}

ordered_json ControlClient::read() {
  std::size_t end;
  while ((end = received_.find('\n')) == std::string::npos) {
    char piece[16'384];
    const ssize_t size = ::recv(socket_, piece, sizeof piece, 0);
    if (size == 0) throw std::runtime_error(fmt::format("{}: the daemon has ended", name_));
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) throw std::runtime_error(fmt::format("{}: no answer for {} s", name_, kPatience_s));
    received_.append(piece, static_cast<std::size_t>(size));
  }
  const std::string line = received_.substr(0, end);
  received_.erase(0, end + 1);
  const ordered_json message = ordered_json::parse(line, nullptr, false);
  if (!message.is_object())
    throw std::runtime_error(fmt::format("{}: '{}' is no message of a daemon", name_, line));
  return message;
}

}  // namespace tendril::app
