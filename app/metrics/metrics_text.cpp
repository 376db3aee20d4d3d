// SPDX-License-Identifier: Apache-2.0
#include "app/metrics/metrics_text.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

namespace tendril::app {
namespace {

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\' || c == '"') result += '\\';
    if (c == '\n')
      result += "\\n";
    else
      result += c;
  }
  return result;
}

std::string number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  return fmt::format("{}", value);
}

}  // namespace

void MetricsText::begin(std::string_view name, std::string_view type, std::string_view help) {
  name_ = name;
  fmt::format_to(std::back_inserter(text_), "# HELP {0} {1}\n# TYPE {0} {2}\n", name, help, type);
}

void MetricsText::put(std::string_view name, Labels labels, double value) {
  text_ += name;
  char before = '{';
  for (const auto& [key, text] : labels) {
    fmt::format_to(std::back_inserter(text_), "{}{}=\"{}\"", before, key, escaped(text));
    before = ',';
  }
  if (labels.size() > 0) text_ += '}';
  fmt::format_to(std::back_inserter(text_), " {}\n", number(value));
}

void MetricsText::histogram(std::string_view name, std::string_view help, const ValueHistogram& histogram) {
  begin(name, "histogram", help);
  const std::string bucket = name_ + "_bucket";
  uint64_t count = 0;
  for (std::size_t k = 0; k < histogram.counts().size(); ++k) {
    count += histogram.counts()[k];
    const bool last = k == histogram.bounds().size();
    put(bucket, {{"le", last ? "+Inf" : number(histogram.bounds()[k])}}, static_cast<double>(count));
  }
  put(name_ + "_sum", {}, histogram.sum());
  put(name_ + "_count", {}, static_cast<double>(count));
}

}  // namespace tendril::app
