// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace tendril::app {

/// Draws the pictures and the page of a finished run with tools/report, as a process of its own. Where that
/// fails, and where a stop signal comes meanwhile, which ends it at once, logs the command to type. The
/// figures are there already.
/// @param directory  folder with summary.json and trace.csv, or with latency.json
void draw_report(const std::filesystem::path& directory);

/// Draws a robot with the same tool, and waits for it.
/// @param geometry  of robot_geometry()
/// @param file      ends in .png, .svg or .html
/// @throws std::runtime_error where the file cannot be written, or the tool fails; it has said why on stderr
/// Real-time: no.
void draw_robot(const std::string& geometry, const std::filesystem::path& file);

}  // namespace tendril::app
