// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "app/metrics/value_histogram.h"

namespace tendril::app {

/// Builds the text that Prometheus reads, format 0.0.4: family by family, each with its samples. Real-time:
/// no (allocates).
class MetricsText {
 public:
  using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

  /// Begins a family; its samples follow.
  /// @param name  in base units, with its unit: "tendril_snapshot_age_seconds"; a counter ends in "_total"
  void counter(std::string_view name, std::string_view help) { begin(name, "counter", help); }
  void gauge(std::string_view name, std::string_view help) { begin(name, "gauge", help); }

  /// A sample of the family that was begun last.
  void add(double value) { add({}, value); }
  void add(Labels labels, double value) { put(name_, labels, value); }

  /// A whole family.
  void histogram(std::string_view name, std::string_view help, const ValueHistogram& histogram);

  const std::string& text() const { return text_; }

 private:
  void begin(std::string_view name, std::string_view type, std::string_view help);
  void put(std::string_view name, Labels labels, double value);

  std::string name_, text_;
};

}  // namespace tendril::app
