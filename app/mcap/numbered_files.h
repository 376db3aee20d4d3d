// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "app/mcap/log_target.h"

namespace tendril::app {

/// A log in several files, of which the oldest go as new ones come, as logrotate numbers them: NAME.mcap is
/// the present one, NAME.1.mcap the one before it, and so on, those of earlier runs included. Real-time: no,
/// for all of it (may block).
class NumberedFiles final : public LogTarget {
 public:
  /// Opens the present file; one that is there becomes NAME.1.mcap.
  /// @param file   NAME.mcap
  /// @param total  bytes that all files together have at the most, where the present one has a kFiles-th of
  ///               them
  /// @throws std::runtime_error with what to do where it cannot be written
  NumberedFiles(std::filesystem::path file, uint64_t total);
  ~NumberedFiles() override;
  NumberedFiles(const NumberedFiles&) = delete;
  NumberedFiles& operator=(const NumberedFiles&) = delete;

  static constexpr int kFiles = 8;  ///< in which the total is kept

  bool next() override;
  bool append(std::string_view bytes) override;
  std::string error() const override { return error_; }

 private:
  std::filesystem::path older(int number) const;
  void make_room() const;
  bool failed(const char* what);

  std::filesystem::path file_;
  uint64_t total_;
  int descriptor_ = -1;
  uint64_t size_ = 0;
  std::string error_;
};

}  // namespace tendril::app
