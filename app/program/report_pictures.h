#pragma once

#include <filesystem>

namespace tendril::app {

/// Draws the pictures and the page of a finished run with tools/report, as a process of its own; where that
/// fails, logs the command to type. The figures are there already.
/// @param directory  folder with summary.json and trace.csv, or with latency.json
void draw_report(const std::filesystem::path& directory);

}  // namespace tendril::app
