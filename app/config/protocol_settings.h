// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "app/config/yaml_reader.h"
#include "hal/drive/drive_protocol.h"
#include "hal/drive/settings.h"

namespace tendril::app {

/// A section of a robot file from which a drive protocol reads its keys. Real-time: no.
class ProtocolSettings final : public hal::Settings {
 public:
  /// @param reader  of the section; outlives this
  explicit ProtocolSettings(Reader& reader) : reader_(reader) {}

  void number(std::string_view key, double& out, Dimension dimension, const Range& range, Need need) override;
  void whole(std::string_view key, int& out, const Range& range, Need need) override;
  void flag(std::string_view key, bool& out) override;
  void word(std::string_view key, int& index, std::span<const std::string_view> words) override;
  void section(std::string_view key, const std::function<void(Settings&)>& read) override;
  void refuse(std::string_view key, std::string_view reason) override;
  bool has(std::string_view key) const override { return reader_.has(key); }
  [[noreturn]] void fail(std::string_view key, std::string_view expected) const override;

 private:
  Reader& reader_;
};

/// The same section for a protocol that the bus does not speak: each key of it that nobody has asked for is
/// refused.
class ForeignSettings final : public hal::Settings {
 public:
  /// @param reader  of the section; outlives this
  /// @param spoken  the protocol of the bus, as the robot file names it
  ForeignSettings(Reader& reader, std::string_view spoken) : reader_(reader), spoken_(spoken) {}

  void number(std::string_view key, double&, Dimension, const Range&, Need) override { refuse_foreign(key); }
  void whole(std::string_view key, int&, const Range&, Need) override { refuse_foreign(key); }
  void flag(std::string_view key, bool&) override { refuse_foreign(key); }
  void word(std::string_view key, int&, std::span<const std::string_view>) override { refuse_foreign(key); }
  void section(std::string_view key, const std::function<void(Settings&)>&) override { refuse_foreign(key); }
  void refuse(std::string_view, std::string_view) override {}
  bool has(std::string_view) const override { return false; }
  [[noreturn]] void fail(std::string_view key, std::string_view expected) const override;

 private:
  void refuse_foreign(std::string_view key);

  Reader& reader_;
  std::string_view spoken_;
};

/// The protocols that a robot file may name.
using Protocols = std::span<const hal::DriveProtocol* const>;

/// Lets the protocol of the bus read its keys of a section into `out`, and refuses those of all others.
/// @param read  what a protocol does with a section: void(const hal::DriveProtocol&, hal::Settings&, T&)
template <class T, class Read>
void read_protocol_keys(Reader& reader, Protocols protocols, const hal::DriveProtocol& spoken, T& out,
                        const Read& read) {
  ProtocolSettings own(reader);
  read(spoken, own, out);
  for (const hal::DriveProtocol* other : protocols) {
    if (other == &spoken) continue;
    ForeignSettings foreign(reader, spoken.name());
    T nothing = out;
    read(*other, foreign, nothing);
  }
}

}  // namespace tendril::app
