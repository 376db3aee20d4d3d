// SPDX-License-Identifier: Apache-2.0
#include "app/config/protocol_settings.h"

#include <fmt/format.h>

namespace tendril::app {

void ProtocolSettings::number(std::string_view key, double& out, Dimension dimension, const Range& range,
                              Need need) {
  if (need == Need::kRequired)
    reader_.need(key, out, dimension, range);
  else
    reader_.may(key, out, dimension, range);
}

void ProtocolSettings::whole(std::string_view key, int& out, const Range& range, Need need) {
  if (need == Need::kRequired)
    reader_.need(key, out, range);
  else
    reader_.may(key, out, range);
}

void ProtocolSettings::flag(std::string_view key, bool& out) { reader_.may(key, out); }

void ProtocolSettings::word(std::string_view key, int& index, std::span<const std::string_view> words) {
  Words<int> meanings;
  for (std::size_t k = 0; k < words.size(); ++k) meanings.emplace_back(words[k], static_cast<int>(k));
  reader_.may(key, index, meanings);
}

void ProtocolSettings::section(std::string_view key, const std::function<void(Settings&)>& read) {
  bool nothing = false;
  reader_.may(key, nothing, [&read](Reader& reader, bool&) {
    ProtocolSettings settings(reader);
    read(settings);
  });
}

void ProtocolSettings::refuse(std::string_view key, std::string_view reason) {
  bool nothing = false;
  reader_.may(key, nothing, [reason](const Value& value, bool&) { value.fail(reason); });
}

void ProtocolSettings::fail(std::string_view key, std::string_view expected) const {
  reader_.at(key).fail(expected);
}

void ForeignSettings::refuse_foreign(std::string_view key) {
  if (reader_.asked(key)) return;
  bool nothing = false;
  reader_.may(key, nothing, [this](const Value& value, bool&) {
    value.fail(fmt::format("no such key, as bus.protocol is {}", spoken_));
  });
}

void ForeignSettings::fail(std::string_view key, std::string_view expected) const {
  reader_.at(key).fail(expected);
}

}  // namespace tendril::app
