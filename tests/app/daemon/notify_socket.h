// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "tests/app/program/process.h"

namespace tendril::app {

/// The service manager's end of sd_notify(3): a datagram socket with a name of its own, as systemd has it.
class NotifySocket {
 public:
  NotifySocket();
  ~NotifySocket();
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  /// What NOTIFY_SOCKET must say.
  const std::string& address() const { return address_; }

  struct Message {
    std::string text;  // "READY=1"
    pid_t sender = 0;  // as the kernel attests
  };

  /// The next message, in order; nothing where none comes in time.
  std::optional<Message> next(double seconds = kPatience_s);

 private:
  int socket_;
  std::string address_;
};

}  // namespace tendril::app
