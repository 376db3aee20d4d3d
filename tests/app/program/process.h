// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "tests/patience.h"

namespace tendril::app {

using tendril::testing::kPatience_s;

/// A program under test: started without a shell, in a process group of its own, and all that it writes kept.
/// None outlives its object: the destructor kills the group and reaps the program. Where it ends, or what it
/// is waited for does not come, the test's next assertion tells so if it fails, with all that it has said.
class Process {
 public:
  /// @param arguments  the program first: a path, or a name that is looked up in PATH
  /// @throws std::runtime_error where it cannot be started
  explicit Process(std::vector<std::string> arguments);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Sends a signal to the program, unless it has ended.
  void send(int signal);

  /// Writes a line to the program's standard input. Where nobody calls it that is empty and open.
  /// @throws std::runtime_error where the program no longer reads
  void write_line(const std::string& line);

  /// Waits for the program's end.
  /// @return  its exit code, or minus the number of the signal that ended it; nothing where it still runs
  std::optional<int> wait(double seconds = kPatience_s);

  /// Waits until the program has written a text to stdout or stderr.
  /// @return  false where it ended, or time did, before
  bool says(const std::string& text, double seconds = kPatience_s);

  std::string out() const;  ///< all that it has written to stdout so far
  std::string err() const;  ///< and to stderr

 private:
  /// Has the next assertion tell this, and what the program has said, if it fails.
  void note(const std::string& what) const;

  std::string name_;
  pid_t pid_ = -1;
  int in_ = -1;              // a socket, as writing to one raises no SIGPIPE
  int out_ = -1, err_ = -1;  // files in memory: a program is never held up by a reader
  std::optional<int> status_;
};

/// Runs a program to its end, or kills it when patience is at an end: the exit code is then -9.
struct Ended {
  int code;
  std::string out, err;
};
Ended run(const std::vector<std::string>& arguments);

/// The lines of a text.
std::vector<std::string> lines_of(const std::string& text);

}  // namespace tendril::app
