#pragma once

namespace tendril::app {

/// Makes SIGTERM, SIGINT and SIGHUP ask for the end instead of ending the process, and lets a reader of our
/// output go away without harm (SIGPIPE). Call once, early in main.
void watch_stop_signals();

/// Whether one of them has come.
bool stop_signalled() noexcept;

}  // namespace tendril::app
