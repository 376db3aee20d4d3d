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

/// The bytes of one array as they stand in the file, in base64 or not.
class Stream {
 public:
  Stream(const VtuFile& file, const pugi::xml_node& array, size_t begin, bool base64)
      : file_(file), array_(array), begin_(std::min(begin, file.text.size())), base64_(base64) {}

  /// Goes on to where what follows `count` bytes begins: base64 fills groups of four characters.
  void skip(size_t count) {
    begin_ = std::min(begin_ + (base64_ ? 4 * ((count + 2) / 3) : count), file_.text.size());
  }

  /// The next `count` bytes; does not move on.
  std::string peek(size_t count) const {
    const size_t left = file_.text.size() - std::min(begin_, file_.text.size());
    if (count > left || (base64_ && (count + 2) / 3 > left / 4))
      fail(file_, array_, fmt::format("found the end of the file, expected {} bytes", count));
    if (!base64_) return file_.text.substr(begin_, count);
    return decoded(count);
  }

 private:
  std::string decoded(size_t count) const {
    static constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    unsigned held = 0;
    for (size_t k = 0; bytes.size() < count; ++k) {
      const char c = file_.text[begin_ + k];
      const auto digit = kDigits.find(c);
      if (digit == kDigits.npos) fail(file_, array_, fmt::format("found '{}', expected base64", c));
      held = (held << 6 | static_cast<unsigned>(digit)) & 0xFFFF;
      if (k % 4 != 0) bytes += static_cast<char>(held >> (6 - 2 * (k % 4)) & 0xFF);
    }
    return bytes;
  }

  const VtuFile& file_;
  const pugi::xml_node& array_;
  size_t begin_;
  bool base64_;
};

std::vector<std::int64_t> header(const VtuFile& file, const Stream& stream, size_t numbers_in_it) {
  return numbers<std::int64_t>(stream.peek(numbers_in_it * file.header_bytes),
                               {NumberType::Kind::kUnsigned, file.header_bytes}, file.big_endian);
}

void check_size(const VtuFile& file, const pugi::xml_node& array, std::int64_t found, size_t expected) {
  if (found != static_cast<std::int64_t>(expected))
    fail(file, array, fmt::format("found {} bytes, expected {}", found, expected));
}

/// What stands before blocks packed with zlib.
struct PackedHeader {
  size_t blocks, block_size, last_size;  ///< sizes unpacked
  std::vector<std::int64_t> packed_sizes;
  size_t packed_total = 0, bytes = 0;  ///< of this header: bytes
};

PackedHeader packed_header(const VtuFile& file, const pugi::xml_node& array, const Stream& stream,
                           size_t expected) {
  const auto in_file = [&](std::int64_t value) { return value >= 0 && value <= std::ssize(file.text); };
  const auto blocks = header(file, stream, 1)[0];
  if (!in_file(blocks))
    fail(file, array, fmt::format("found {} packed blocks, expected fewer than bytes", blocks));
  const auto sizes = header(file, stream, 3 + blocks);
  PackedHeader result{.blocks = static_cast<size_t>(blocks),
                      .block_size = static_cast<size_t>(sizes[1]),
                      .last_size = static_cast<size_t>(sizes[2] == 0 ? sizes[1] : sizes[2]),
                      .packed_sizes = {sizes.begin() + 3, sizes.end()}};
  result.bytes = sizes.size() * file.header_bytes;
  for (const auto size : result.packed_sizes) {
    if (!in_file(size))
      fail(file, array, fmt::format("found a packed block of {} bytes, more than there are", size));
    result.packed_total += size;
  }
  // Compared by division first: the product of wrong numbers may be too large for its type.
  const bool sizes_fit =
      result.last_size <= expected &&
      (blocks < 2 || result.blocks - 1 <= expected / std::max<size_t>(result.block_size, 1));
  const size_t total = blocks == 0 ? 0
                       : sizes_fit ? (result.blocks - 1) * result.block_size + result.last_size
                                   : 0;
  if (total != expected || expected / kMostPacking > result.packed_total)
    fail(file, array,
         fmt::format("found {} blocks of {} bytes and a last one of {}, expected {} bytes in all", blocks,
                     sizes[1], sizes[2], expected));
  return result;
}

std::string unpack(const VtuFile& file, const pugi::xml_node& array, Stream stream, size_t expected) {
  const PackedHeader head = packed_header(file, array, stream, expected);
  stream.skip(head.bytes);
  const std::string packed = stream.peek(head.packed_total);
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
  check_size(file, array, header(file, stream, 1)[0], expected);
  return stream.peek(file.header_bytes + expected).substr(file.header_bytes);
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
std::vector<T> read_array(const VtuFile& file, const pugi::xml_node& array, size_t count) {
  const std::string_view format = array.attribute("format").value();
  const auto text = array.first_child();  // none where no numbers are there
  const size_t begin = text ? file.text.find_first_not_of(" \t\r\n", text.offset_debug()) : file.text.size();
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
      array_bytes(file, array, {file, array, file.appended + offset, !file.appended_raw}, count * type.bytes),
      type, file.big_endian);
}

template std::vector<double> read_array(const VtuFile&, const pugi::xml_node&, size_t);
template std::vector<std::int64_t> read_array(const VtuFile&, const pugi::xml_node&, size_t);

bool is_label(const pugi::xml_node& array) {
  return array.attribute("NumberOfComponents").as_int(1) == 1 &&
         std::string_view(array.attribute("type").value()).find("Int") != std::string_view::npos;
}

}  // namespace tendril::fem
