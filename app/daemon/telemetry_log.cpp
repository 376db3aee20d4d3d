// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/telemetry_log.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "app/daemon/trace_file.h"
#include "app/mcap/numbered_files.h"
#include "rt/periodic_clock.h"

namespace tendril::app {
namespace {

constexpr int64_t kSecond_ns = 1'000'000'000;
constexpr int64_t kDropsInterval_ns = 10 * kSecond_ns;  // between lines about what was dropped
constexpr std::size_t kQueueBytes = 16'000'000;         // half a minute of a robot with four cables at 600 Hz

double seconds(int64_t ns) { return 1e-9 * static_cast<double>(ns); }

int64_t monotonic_to_wall_ns() {
  const auto wall = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(wall).count() - rt::now_ns();
}

McapRecorder::Limits limits_of(uint64_t total_bytes) {
  const uint64_t file_bytes = total_bytes / NumberedFiles::kFiles;
  return {.file_bytes = file_bytes, .queue_bytes = std::min<std::size_t>(kQueueBytes, file_bytes / 2)};
}

}  // namespace

TelemetryLog::TelemetryLog(const Config& config, const std::filesystem::path& file, uint64_t total_bytes,
                           const RunFacts& facts)
    : config_(config),
      file_(file),
      offset_ns_(monotonic_to_wall_ns()),
      coordinates_(coordinate_groups(config)),
      watch_(config),
      errors_(config),
      recorder_(std::make_unique<NumberedFiles>(file, total_bytes),
                telemetry_content(config, facts, offset_ns_), limits_of(total_bytes)) {
  for (const ActuatorConfig& actuator : config.actuators) actuators_.push_back(in_quotes(actuator.name));
  for (auto& groups : sensor_groups(config)) sensors_.push_back({0, std::move(groups)});
}

void TelemetryLog::record(Topic topic, int64_t log_ns, int64_t publish_ns) {
  recorder_.record(static_cast<uint16_t>(topic), log_ns + offset_ns_, publish_ns + offset_ns_, json_.text());
}

void TelemetryLog::put(std::string_view name, const std::vector<ValueGroup>& groups, const double* values) {
  json_.open(name);
  for (const ValueGroup& group : groups) {
    json_.open(group.name);
    for (const auto& [value, place] : group.values) json_.put(value, values[place]);
    json_.close();
  }
  json_.close();
}

void TelemetryLog::add(const rt::TraceRecord& record, const Motion* motion) {
  put_state(record, motion);
  this->record(Topic::kState, record.intended_ns, record.intended_ns);
  watch_.add(record);
  add_samples(record);
  add_snapshot(record);
  add_errors(record, motion);
}

void TelemetryLog::put_state(const rt::TraceRecord& record, const Motion* motion) {
  json_.clear();
  json_.open();
  json_.put_raw("\"phase\"",
                approaches(record, motion) ? "\"approach\"" : fmt::format("\"{}\"", rt::name(record.phase)));
  json_.put("\"faults\"", record.faults.bits());
  if (record.phase >= rt::Phase::kRunning) {
    put("\"target\"", coordinates_, record.desired.data());
    put("\"model\"", coordinates_, record.p_e.data());
  }
  json_.open("\"actuators\"");
  for (std::size_t a = 0; a < actuators_.size(); ++a) {
    json_.open(actuators_[a]);
    json_.put("\"command\"", record.command[a]);
    json_.put("\"displacement\"", record.measured[a]);
    json_.put("\"effort\"", record.lambda[a]);
    json_.close();
  }
  json_.close();
  json_.open("\"qp\"");
  json_.put_raw("\"status\"",
                record.qp_solved ? fmt::format("\"{}\"", qp::name(record.qp_status)) : std::string("null"));
  json_.put("\"iterations\"", record.qp_iterations);
  json_.close();
  json_.open("\"snapshot\"");
  json_.put("\"sequence\"", record.snapshot_sequence);
  json_.put("\"age\"", seconds(record.snapshot_age_ns));
  json_.close();
  json_.open("\"timing\"");
  json_.put("\"wakeup\"", seconds(record.wakeup_ns));
  json_.put("\"read\"", seconds(record.read_ns));
  json_.put("\"solve\"", seconds(record.solve_ns));
  json_.put("\"work\"", seconds(record.cycle_ns));
  json_.close();
  json_.put("\"cycles\"", record.cycles);
  json_.put("\"late_cycles\"", record.late_cycles);
  json_.put("\"missed\"", record.missed);
  json_.put("\"bus_bits\"", record.bus_bits);
  json_.put("\"heap_calls\"", record.heap_calls);
  json_.put("\"page_faults\"", record.page_faults);
  json_.close();
}

/// What sensors have told since the cycle before.
void TelemetryLog::add_samples(const rt::TraceRecord& record) {
  for (std::size_t s = 0; s < sensors_.size(); ++s) {
    Sensor& sensor = sensors_[s];
    const int64_t stamp_ns = record.sensors.stamp_ns[s];
    if (stamp_ns <= sensor.known_ns) continue;
    sensor.known_ns = stamp_ns;
    json_.clear();
    json_.open();
    for (const ValueGroup& group : sensor.groups) {
      json_.open(group.name);
      for (const auto& [value, place] : group.values) json_.put(value, record.sensors.value[place]);
      json_.close();
    }
    json_.close();
    const auto channel = static_cast<std::size_t>(Topic::kSensors) + s;
    recorder_.record(static_cast<uint16_t>(channel), record.intended_ns + offset_ns_, stamp_ns + offset_ns_,
                     json_.text());
  }
}

/// A snapshot, in the first cycle on it.
void TelemetryLog::add_snapshot(const rt::TraceRecord& record) {
  if (record.snapshot_sequence == snapshot_) return;
  const int64_t stamp_ns = record.intended_ns + record.wakeup_ns - record.snapshot_age_ns;
  json_.clear();
  json_.open();
  json_.put("\"sequence\"", record.snapshot_sequence);
  json_.put("\"age\"", seconds(record.snapshot_age_ns));
  if (snapshot_ > 0) json_.put("\"interval\"", seconds(stamp_ns - snapshot_ns_));
  if (record.qp_solved) json_.put("\"iterations\"", record.qp_iterations);
  json_.close();
  this->record(Topic::kSnapshots, record.intended_ns, stamp_ns);
  snapshot_ = record.snapshot_sequence;
  snapshot_ns_ = stamp_ns;
}

void TelemetryLog::add_errors(const rt::TraceRecord& record, const Motion* motion) {
  errors_.add(record, motion);
  if (!errors_.tip() && errors_.efforts().empty()) return;
  json_.clear();
  json_.open();
  if (const auto& tip = errors_.tip()) {
    json_.open("\"tip\"");
    json_.put("\"to_path\"", tip->to_path);
    json_.put("\"to_model\"", tip->to_model);
    json_.close();
  }
  if (!errors_.efforts().empty()) {
    json_.open("\"effort\"");
    for (const SampleErrors::Effort& effort : errors_.efforts())
      json_.put(actuators_[effort.actuator], effort.error);
    json_.close();
  }
  json_.close();
  this->record(Topic::kErrors, record.intended_ns,
               errors_.tip() ? errors_.tip()->stamp_ns : record.intended_ns);
}

void TelemetryLog::add(const rt::Target& target, const TargetSource& source) {
  json_.clear();
  json_.open();
  json_.put_raw("\"mode\"", fmt::format("\"{}\"", name(source.mode())));
  json_.put("\"path_rate\"", source.path_rate());
  put("\"position\"", coordinates_, target.position.data());
  put("\"velocity\"", coordinates_, target.velocity.data());
  json_.close();
  this->record(Topic::kTargets, target.stamp_ns, target.stamp_ns);
}

void TelemetryLog::add(const RunProgress& progress, int64_t now_ns) {
  if (now_ns < status_due_ns_) return;
  status_due_ns_ = now_ns + kSecond_ns;
  record_status(progress, now_ns);
  log_dropped(now_ns);
}

void TelemetryLog::record_status(const RunProgress& progress, int64_t now_ns) {
  json_.clear();
  json_.open();
  json_.put("\"model_refreshes\"", progress.model_refreshes);
  json_.put("\"model_failures\"", progress.model_failures);
  json_.put("\"model_rate\"", progress.model_rate_hz);
  json_.put("\"trace_dropped\"", progress.trace_dropped);
  json_.put("\"log_dropped\"", recorder_.counts().dropped);
  json_.open("\"sensors\"");
  for (std::size_t s = 0; s < config_.sensors.size(); ++s) {
    const SensorWatch::Losses& losses = watch_.losses()[s];
    json_.open(in_quotes(config_.sensors[s].frame.name));
    json_.put_raw("\"lost\"", losses.lost ? "true" : "false");
    json_.put("\"losses\"", losses.count);
    json_.put("\"stale\"", losses.stale_s());
    json_.close();
  }
  json_.close();
  json_.close();
  this->record(Topic::kStatus, now_ns, now_ns);
}

void TelemetryLog::log_dropped(int64_t now_ns) {
  const McapRecorder::Counts counts = recorder_.counts();
  if (counts.dropped == drops_told_ || now_ns < drops_due_ns_) return;
  spdlog::warn("{}: {} messages dropped so far: {}", file_.string(), counts.dropped,
               counts.error.empty() ? "the disk is too slow" : counts.error);
  drops_told_ = counts.dropped;
  drops_due_ns_ = now_ns + kDropsInterval_ns;
}

void TelemetryLog::add_line(int level, const std::string& line) {
  const int64_t time_ns = rt::now_ns() + offset_ns_;
  JsonText json;  // any thread comes here
  json.open();
  json.open("\"timestamp\"");
  json.put("\"sec\"", time_ns / kSecond_ns);
  json.put("\"nsec\"", time_ns % kSecond_ns);
  json.close();
  json.put("\"level\"", level);
  json.put_raw("\"message\"", in_quotes(line));
  json.put_raw("\"name\"", "\"tendrild\"");
  json.put_raw("\"file\"", "\"\"");
  json.put("\"line\"", 0);
  json.close();
  recorder_.record(static_cast<uint16_t>(Topic::kLog), time_ns, time_ns, json.text());
}

void TelemetryLog::finish(const RunProgress& progress, const RunFacts& facts, const rt::LoopCounts& counts) {
  const int64_t now_ns = rt::now_ns();
  record_status(progress, now_ns);
  json_.clear();
  json_.open();
  json_.put_raw("\"stop_reason\"", in_quotes(facts.stop_reason));
  json_.put_raw("\"policy\"", in_quotes(std::string(counts.scheduling.policy)));
  json_.put("\"priority\"", counts.scheduling.priority);
  json_.put("\"heap_calls\"", counts.heap_calls);
  json_.put("\"major_faults\"", counts.page_faults.major);
  json_.put("\"minor_faults\"", counts.page_faults.minor);
  json_.put("\"bus_dropped\"", facts.bus_dropped);
  json_.close();
  this->record(Topic::kEnd, now_ns, now_ns);
  const bool complete = recorder_.close();
  const McapRecorder::Counts log = recorder_.counts();
  spdlog::info("{}: {} messages, {:.1f} MB", file_.string(), log.written,
               1e-6 * static_cast<double>(log.bytes));
  if (!complete)
    spdlog::warn("{} is incomplete: {} messages dropped: {}", file_.string(), log.dropped,
                 log.error.empty() ? "the disk is too slow" : log.error);
}

}  // namespace tendril::app
