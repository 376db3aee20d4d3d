// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "app/view/access.h"
#include "app/view/page_files.h"

namespace tendril::app {

/// What a server of the page is made of.
struct ViewConfig {
  std::filesystem::path socket;  ///< of the daemon
  Address listen;
  std::string token;  ///< a page that knows it may take the control
  std::map<std::string, PageFile> files;
};

/// Serves the page by HTTP, and joins each page to the daemon: lines of the control protocol go from its
/// WebSocket to the daemon's socket and back. Each page has a connection to the daemon of its own, so the
/// daemon's rules on control and on clients that do not read hold for pages as they are. A page that is slow
/// is read for slowly; the daemon then leaves out surfaces and states.
///
/// Beyond that protocol a page sends {"token": "..."} first, and hears {"view": {...}}: control, whether the
/// token was right; daemon, false while there is none; message, a sentence for a person.
///
/// One thread. Real-time: no, all of it.
class ViewServer {
 public:
  static constexpr int kMaxPages = 16;  ///< of the daemon's 32 clients, so that others find room

  /// Listens.
  /// @throws std::runtime_error with what to do where it cannot
  explicit ViewServer(ViewConfig config);
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  /// Where it listens, with the port that the system has chosen where that was 0.
  Address address() const;

  /// Serves until a stop signal comes, see stop_signalled().
  void run();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tendril::app
