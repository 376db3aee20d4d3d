// SPDX-License-Identifier: Apache-2.0
#include "app/program/output.h"

#include <fcntl.h>
#include <poll.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string_view>
#include <utility>

#include "app/config/utf8.h"

namespace tendril::app {
namespace {

constexpr std::size_t kLongestLine = 4096;  // bytes, PIPE_BUF: what a pipe takes whole or not at all

/// stderr, as far as it takes what is written.
class StderrSink final : public spdlog::sinks::base_sink<std::mutex> {
 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    if (dropped_ > 0) {
      const std::string note =
          fmt::format("({} lines before this one were dropped: nobody read them)\n", dropped_);
      if (!write_line(note)) {
        ++dropped_;
        return;
      }
      dropped_ = 0;
    }
    // The journal shows a line that is no UTF-8 only as so many bytes.
    const std::string text = valid_utf8(std::string_view(line.data(), line.size()));
    if (!write_line(std::string_view(text).substr(0, kLongestLine))) ++dropped_;
  }
  void flush_() override {}

  static bool write_line(std::string_view text) {
    if (!takes_a_line(STDERR_FILENO)) return false;
    ssize_t written;
    do written = ::write(STDERR_FILENO, text.data(), text.size());
    while (written < 0 && errno == EINTR);
    return true;
  }

  long dropped_ = 0;
};

/// The priority of a line as the journal reads it, see sd-daemon(3).
class JournalPriority final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const char* priority = message.level >= spdlog::level::err    ? "<3>"
                           : message.level == spdlog::level::warn ? "<4>"
                                                                  : "<6>";
    out.append(priority, priority + 3);
  }
  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override {
    return spdlog::details::make_unique<JournalPriority>();
  }
};

}  // namespace

void open_standard_descriptors() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(descriptor, F_GETFD) < 0) ::open("/dev/null", O_RDWR);  // which takes the lowest free number
}

bool takes_a_line(int descriptor) noexcept {
  pollfd output{descriptor, POLLOUT, 0};
  return ::poll(&output, 1, 0) == 1 && (output.revents & POLLOUT) != 0;
}

bool is_journal(int descriptor) noexcept {
  unsigned long device = 0, inode = 0;
  struct stat file {};
  const char* stream = std::getenv("JOURNAL_STREAM");
  return stream && std::sscanf(stream, "%lu:%lu", &device, &inode) == 2 && ::fstat(descriptor, &file) == 0 &&
         file.st_dev == device && file.st_ino == inode;
}

void log_to_stderr(const std::string& program) {
  const auto logger = std::make_shared<spdlog::logger>(program, std::make_shared<StderrSink>());
  if (is_journal(STDERR_FILENO)) {
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<JournalPriority>('*').set_pattern("%*%v");
    logger->set_formatter(std::move(formatter));
  }
  spdlog::set_default_logger(logger);
}

}  // namespace tendril::app
