// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <set>

#include "hal/drive/frame_layout.h"

namespace tendril::hal {
namespace {

/// The shortest text that reads back as the same number.
std::string to_text(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// " SG_ position : 16|32@1- (0.01,0) [0|0] "mm" Tendril"; a range from 0 to 0 means that none is stated.
std::string signal_line(const Signal& signal, const std::string& receiver) {
  return " SG_ " + signal.name + " : " + std::to_string(signal.start) + "|" + std::to_string(signal.length) +
         (signal.order == ByteOrder::kIntel ? "@1" : "@0") +
         (signal.type == SignalType::kUnsigned ? "+" : "-") + " (" + to_text(signal.scale) + "," +
         to_text(signal.offset) + ") [0|0] \"" + signal.unit + "\" " + receiver + "\n";
}

}  // namespace

std::string to_dbc(const std::vector<FrameLayout>& frames) {
  constexpr const char* kUnknown = "Vector__XXX";  // DBC's name for a node that is not stated
  std::string nodes = "BU_:", messages, floats;
  std::set<std::string> known;
  for (const FrameLayout& frame : frames) {
    if (known.insert(frame.sender).second) nodes += " " + frame.sender;
    const std::string id = std::to_string(frame.id);
    messages +=
        "BO_ " + id + " " + frame.name + ": " + std::to_string(frame.length) + " " + frame.sender + "\n";
    for (const Signal& signal : frame.signals) {
      messages += signal_line(signal, kUnknown);
      if (signal.type == SignalType::kFloat)
        floats +=
            "SIG_VALTYPE_ " + id + " " + signal.name + " : " + (signal.length == 64 ? "2" : "1") + ";\n";
    }
    messages += "\n";
  }
  return "VERSION \"\"\n\nNS_ :\n\nBS_:\n\n" + nodes + "\n\n" + messages + floats;
}

}  // namespace tendril::hal
