// SPDX-License-Identifier: Apache-2.0
#include "app/metrics/metrics_text.h"

#include <catch2/catch.hpp>

namespace tendril::app::metrics_text_test {

TEST_CASE("Families, labels and values are written as Prometheus reads them", "[unit]") {
  MetricsText text;
  text.counter("cycles_total", "Deadlines.");
  text.add(1e6);
  text.gauge("lost", "1 for lost.");
  text.add({{"sensor", "the \"old\" one\\\n"}, {"bus", "can0"}}, 0.25);
  CHECK(text.text() ==
        "# HELP cycles_total Deadlines.\n# TYPE cycles_total counter\ncycles_total 1000000\n"
        "# HELP lost 1 for lost.\n# TYPE lost gauge\n"
        "lost{sensor=\"the \\\"old\\\" one\\\\\\n\",bus=\"can0\"} 0.25\n");
}

TEST_CASE("A histogram is cumulative: each bucket holds what is at most its bound", "[law]") {
  ValueHistogram histogram({0.001, 0.002});
  for (const double value : {0.0005, 0.001, 0.0015, 0.003, 0.004}) histogram.add(value);
  MetricsText text;
  text.histogram("work_seconds", "Work.", histogram);
  CHECK(text.text() ==
        "# HELP work_seconds Work.\n# TYPE work_seconds histogram\n"
        "work_seconds_bucket{le=\"0.001\"} 2\nwork_seconds_bucket{le=\"0.002\"} 3\n"
        "work_seconds_bucket{le=\"+Inf\"} 5\nwork_seconds_sum 0.01\nwork_seconds_count 5\n");
}

}  // namespace tendril::app::metrics_text_test
