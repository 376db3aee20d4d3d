// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/telemetry_sink.h"

#include <spdlog/sinks/base_sink.h>

#include <memory>
#include <mutex>
#include <string>

namespace tendril::app {
namespace {

class Sink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit Sink(TelemetryLog& log) : log_(log) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const int level = message.level >= spdlog::level::err ? 4 : message.level == spdlog::level::warn ? 3 : 2;
    log_.add_line(level, std::string(message.payload.data(), message.payload.size()));
  }
  void flush_() override {}

  TelemetryLog& log_;
};

}  // namespace

TelemetrySink::TelemetrySink(TelemetryLog& log) : sink_(std::make_shared<Sink>(log)) {
  spdlog::default_logger()->sinks().push_back(sink_);
}

TelemetrySink::~TelemetrySink() { std::erase(spdlog::default_logger()->sinks(), sink_); }

}  // namespace tendril::app
