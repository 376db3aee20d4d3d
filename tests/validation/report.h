// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace tendril::validation {

/// How far a case goes.
enum class Extent {
  kShort,  ///< seconds for all cases together: what the tests run
  kFull,   ///< refines further, and draws more
};

/// A measured figure, held against limits where it has any.
struct Row {
  std::string what;
  double value;
  std::string unit;
  std::optional<double> at_least, at_most;

  bool passed() const;  ///< false also for a value that is not a number
};

/// Axes of a picture.
struct Picture {
  std::string title, x, y;  ///< x and y name a quantity and its unit
  bool logarithmic = false;
};

/// How a series of points is drawn.
enum class Style {
  kLine,
  kMarks,
  kBoth,
  kGuide,  ///< thin and dashed: a slope, or a theory in the background
};

/// Takes down what the cases measure: keeps the figures, and writes everything as JSON lines for
/// tools/validate where a stream is given. docs/validation.md describes the lines.
class Report {
 public:
  explicit Report(std::ostream* lines = nullptr) : lines_(lines) {}

  void begin_case(const std::string& name, const std::string& title);
  /// A figure without a limit.
  void note(const std::string& what, double value, const std::string& unit);
  void at_most(const std::string& what, double value, const std::string& unit, double limit);
  void within(const std::string& what, double value, const std::string& unit, double lower, double upper);
  /// Starts a picture, to which all series belong up to the next one.
  void picture(const Picture& picture);
  void series(const std::string& label, Style style, const std::vector<double>& x,
              const std::vector<double>& y);
  /// Says why a case, or a part of it, was left out.
  void skipped(const std::string& why);

  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<std::string>& reasons_skipped() const { return skipped_; }

 private:
  void add(const Row& row);

  std::ostream* lines_;
  std::vector<Row> rows_;
  std::vector<std::string> skipped_;
};

}  // namespace tendril::validation
