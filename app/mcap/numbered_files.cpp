// SPDX-License-Identifier: Apache-2.0
#include "app/mcap/numbered_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace tendril::app {

namespace fs = std::filesystem;

NumberedFiles::NumberedFiles(fs::path file, uint64_t total) : file_(std::move(file)), total_(total) {
  std::error_code ignored;
  const bool no_file = fs::exists(file_, ignored) && !fs::is_regular_file(file_, ignored);
  if (no_file) error_ = fmt::format("{} is no file", file_.string());
  if (no_file || !next())
    throw std::runtime_error(fmt::format("cannot write the log: {}; choose another file with --log", error_));
}

NumberedFiles::~NumberedFiles() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

fs::path NumberedFiles::older(int number) const {
  return fs::path(file_).replace_extension(fmt::format("{}{}", number, file_.extension().string()));
}

/// Gives the present file the number 1, and each older one the next number, as long as they have room.
void NumberedFiles::make_room() const {
  std::error_code error;
  const uint64_t room = total_ - total_ / kFiles;  // beside the present file
  uint64_t sum = fs::file_size(file_, error);
  int last = 0;
  while (fs::exists(older(last + 1), error)) {
    sum += fs::file_size(older(++last), error);
    if (sum > room) fs::remove(older(last), error);
  }
  for (int number = last; number > 0; --number)
    if (fs::exists(older(number), error)) fs::rename(older(number), older(number + 1), error);
  fs::rename(file_, older(1), error);
}

bool NumberedFiles::next() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  size_ = 0;
  std::error_code error;
  if (fs::exists(file_, error) && fs::file_size(file_, error) > 0) make_room();
  // What could not be renamed stays as it is, and this fails.
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR | S_IRGRP);
  if (descriptor_ < 0) return failed("cannot open");
  struct stat found {};
  if (::fstat(descriptor_, &found) != 0 || !S_ISREG(found.st_mode) || found.st_size > 0) {
    ::close(std::exchange(descriptor_, -1));
    error_ = fmt::format("{} is there already and cannot be renamed", file_.string());
    return false;
  }
  ::fchmod(descriptor_, S_IRUSR | S_IWUSR | S_IRGRP);
  return true;
}

bool NumberedFiles::append(std::string_view bytes) {
  if (descriptor_ < 0) return false;
  uint64_t end = size_;
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(end));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return failed("cannot write");
    end += static_cast<uint64_t>(written);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  // To the disk, as a power cut takes what is in memory only.
  if (::fdatasync(descriptor_) != 0 && errno != EINVAL) return failed("cannot write");
  size_ = end;
  return true;
}

/// Takes back what is there of the last bytes.
bool NumberedFiles::failed(const char* what) {
  error_ = fmt::format("{} {}: {}", what, file_.string(), std::strerror(errno));
  if (descriptor_ >= 0 && ::ftruncate(descriptor_, static_cast<off_t>(size_)) != 0)
    error_ += "; its end is incomplete";
  return false;
}

}  // namespace tendril::app
