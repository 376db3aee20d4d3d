// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/vtu_array.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>

#include "fem/mesh/text_cursor.h"

namespace tendril::fem {
namespace {

constexpr size_t kMostPacking = 1032;  // zlib packs no better than 1032 to 1 [zlib.net, "Technical details"]
constexpr std::array kTypes = {"Int8",   "Int16",  "Int32",  "Int64",   "UInt8",
                               "UInt16", "UInt32", "UInt64", "Float32", "Float64"};

[[noreturn]] void fail(const VtuFile& file, const pugi::xml_node& array, const std::string& what) {
  throw MeshError(fmt::format("{}: byte {}: array '{}': {}", file.name, array.offset_debug(),
                              array.attribute("Name").value(), what));
}

NumberType type_of(const VtuFile& file, const pugi::xml_node& array) {
  using enum NumberType::Kind;
  const std::string_view name = array.attribute("type").value();
  const auto* known = std::find(kTypes.begin(), kTypes.end(), name);
  if (known == kTypes.end())
    fail(file, array, fmt::format("found type '{}', expected Int8 to Float64", name));
  const size_t bytes = name.ends_with("16") ? 2 : name.ends_with("32") ? 4 : name.ends_with("64") ? 8 : 1;
  return {name[0] == 'F' ? kFloat : name[0] == 'U' ? kUnsigned : kSigned, bytes};
}

/// The bytes of one array as they stand in the file, in base64 or not. Base64 may be wrapped into lines, and
/// its padding may close the header, which then is encoded by itself, or only the end of the array.
class Stream {
 public:
  Stream(const VtuFile& file, const pugi::xml_node& array, size_t begin, bool base64)
      : file_(file), array_(array), position_(std::min(begin, file.text.size())), base64_(base64) {}

  /// The next `count` bytes.
  std::string read(size_t count) {
    const size_t left = file_.text.size() - position_;
    if (count > (base64_ ? left / 4 * 3 + decoded_.size() : left)) fail_at_end(count);
    if (!base64_) {
      position_ += count;
      return file_.text.substr(position_ - count, count);
    }
    std::string bytes;
    bytes.reserve(count + 3);
    bytes.swap(decoded_);
    while (bytes.size() < count) decode_group(bytes, count);
    decoded_ = bytes.substr(count);
    bytes.resize(count);
    return bytes;
  }

 private:
  [[noreturn]] void fail_at_end(size_t count) const {
    fail(file_, array_, fmt::format("found the end of the file, expected {} bytes", count));
  }

  /// Four digits are three bytes, or fewer where '=' stands for the last digits.
  void decode_group(std::string& bytes, size_t wanted) {
    static constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned bits = 0;
    int digits = 0, padding = 0;
    while (digits + padding < 4) {
      if (position_ == file_.text.size()) fail_at_end(wanted);
      const char c = file_.text[position_++];
      if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
      const auto digit = kDigits.find(c);
      if (c == '=' && digits >= 2) {
        ++padding;
      } else if (digit == kDigits.npos || padding > 0) {
        fail(file_, array_, fmt::format("found '{}', expected base64", c));
      } else {
        bits |= static_cast<unsigned>(digit) << (18 - 6 * digits++);
      }
    }
    for (int k = 0; k < 3 - padding; ++k) bytes += static_cast<char>(bits >> (16 - 8 * k) & 0xFF);
  }

  const VtuFile& file_;
  const pugi::xml_node& array_;
  size_t position_;
  bool base64_;
  std::string decoded_;  // of the last group, not yet read
};

/// Numbers of the header before an array's bytes; at least as many as the file has bytes for.
std::vector<uint64_t> header(const VtuFile& file, const pugi::xml_node& array, Stream& stream,
                             uint64_t count) {
  if (count > file.text.size())
    fail(file, array, fmt::format("found {} packed blocks, expected fewer than bytes", count));
  return numbers<uint64_t>(stream.read(count * file.header_bytes),
                           {NumberType::Kind::kUnsigned, file.header_bytes}, file.big_endian);
}

/// What stands before blocks packed with zlib.
struct PackedHeader {
  uint64_t blocks, block_size, last_size;  ///< sizes unpacked
  std::vector<uint64_t> packed_sizes;
  size_t packed_total = 0;

  /// Whether the blocks unpack to so many bytes. Compared by division first: the product of wrong numbers may
  /// be too large for its type.
  bool unpacks_to(uint64_t expected) const {
    if (blocks == 0) return expected == 0;
    if (block_size == 0 && blocks > 1) return false;
    if (blocks > 1 && blocks - 1 > expected / block_size) return false;
    return (blocks - 1) * block_size + last_size == expected && expected / kMostPacking <= packed_total;
  }
};

PackedHeader packed_header(const VtuFile& file, const pugi::xml_node& array, Stream& stream,
                           size_t expected) {
  const auto sizes = header(file, array, stream, 3);
  PackedHeader result{.blocks = sizes[0],
                      .block_size = sizes[1],
                      .last_size = sizes[2] == 0 ? sizes[1] : sizes[2],
                      .packed_sizes = header(file, array, stream, sizes[0])};
  for (const auto size : result.packed_sizes) {
    if (size > file.text.size())
      fail(file, array, fmt::format("found a packed block of {} bytes, more than there are", size));
    result.packed_total += size;
  }
  if (!result.unpacks_to(expected))
    fail(file, array,
         fmt::format("found {} blocks of {} bytes and a last one of {}, expected {} bytes in all", sizes[0],
                     sizes[1], sizes[2], expected));
  return result;
}

std::string unpack(const VtuFile& file, const pugi::xml_node& array, Stream stream, size_t expected) {
  const PackedHeader head = packed_header(file, array, stream, expected);
  const std::string packed = stream.read(head.packed_total);
  std::string bytes(expected, '\0');
  size_t from = 0, to = 0;
  for (size_t block = 0; block < head.blocks; ++block) {
    const uLongf wanted = block + 1 < head.blocks ? head.block_size : head.last_size;
    const auto length = static_cast<uLong>(head.packed_sizes[block]);
    uLongf size = wanted;
    const int error = uncompress(reinterpret_cast<Bytef*>(bytes.data() + to), &size,
                                 reinterpret_cast<const Bytef*>(packed.data() + from), length);
    if (error != Z_OK || size != wanted)
      fail(file, array, fmt::format("block {} does not unpack with zlib", block));
    from += length;
    to += wanted;
  }
  return bytes;
}

std::string array_bytes(const VtuFile& file, const pugi::xml_node& array, Stream stream, size_t expected) {
  if (file.zlib) return unpack(file, array, stream, expected);
  const uint64_t found = header(file, array, stream, 1)[0];
  if (found != expected) fail(file, array, fmt::format("found {} bytes, expected {}", found, expected));
  return stream.read(expected);
}

template <typename T>
std::vector<T> read_ascii(const VtuFile& file, size_t begin, size_t count) {
  TextCursor in =
      TextCursor(file.text, file.name).part(begin, std::min(file.text.find('<', begin), file.text.size()));
  std::vector<T> result;
  for (size_t k = 0; k < count; ++k) result.push_back(in.number<T>("a number"));
  if (!in.at_end()) {
    in.word();
    in.fail(fmt::format("the end of {} numbers", count));
  }
  return result;
}

}  // namespace

template <typename T>
std::vector<T> read_array(VtuFile& file, const pugi::xml_node& array, size_t count) {
  if (count > file.numbers_left)
    fail(file, array,
         fmt::format("found {} numbers to read, more than a file of {} bytes can hold", count,
                     file.text.size()));
  file.numbers_left -= count;
  const std::string_view format = array.attribute("format").as_string("ascii");
  const auto text = array.text().data();  // none where no numbers are there
  const size_t begin =
      text ? std::min(file.text.find_first_not_of(" \t\r\n", text.offset_debug()), file.text.size())
           : file.text.size();
  if (format == "ascii") return read_ascii<T>(file, begin, count);
  const NumberType type = type_of(file, array);
  if (std::is_integral_v<T> && !type.whole()) fail(file, array, "found Float numbers, expected whole ones");
  if (format == "binary")
    return numbers<T>(array_bytes(file, array, {file, array, begin, true}, count * type.bytes), type,
                      file.big_endian);
  if (format != "appended")
    fail(file, array, fmt::format("found format '{}', expected ascii, binary or appended", format));
  if (file.appended == 0) fail(file, array, "found no AppendedData, where it should be");
  const size_t offset = array.attribute("offset").as_ullong(SIZE_MAX / 2);
  return numbers<T>(
      array_bytes(file, array,
                  {file, array, file.appended + std::min(offset, file.text.size()), !file.appended_raw},
                  count * type.bytes),
      type, file.big_endian);
}

template std::vector<double> read_array(VtuFile&, const pugi::xml_node&, size_t);
template std::vector<int64_t> read_array(VtuFile&, const pugi::xml_node&, size_t);

bool is_label(const pugi::xml_node& array) {
  return array.attribute("NumberOfComponents").as_int(1) == 1 &&
         std::string_view(array.attribute("type").value()).find("Int") != std::string_view::npos;
}

}  // namespace tendril::fem
