// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/vtk_words.h"

#include <charconv>
#include <map>

namespace tendril::fem {

std::optional<VtkStorage> vtk_storage(std::string_view type) {
  using enum NumberType::Kind;
  using enum VtkStorage::Form;
  static const std::map<std::string, VtkStorage> kTypes = {{"CHAR", {kNumbers, {kSigned, 1}}},
                                                           {"SIGNED_CHAR", {kNumbers, {kSigned, 1}}},
                                                           {"UNSIGNED_CHAR", {kNumbers, {kUnsigned, 1}}},
                                                           {"SHORT", {kNumbers, {kSigned, 2}}},
                                                           {"UNSIGNED_SHORT", {kNumbers, {kUnsigned, 2}}},
                                                           {"INT", {kNumbers, kVtkInt}},
                                                           {"UNSIGNED_INT", {kNumbers, {kUnsigned, 4}}},
                                                           {"LONG", {kNumbers, {kSigned, 8}}},
                                                           {"UNSIGNED_LONG", {kNumbers, {kUnsigned, 8}}},
                                                           {"FLOAT", {kNumbers, {kFloat, 4}}},
                                                           {"DOUBLE", {kNumbers, {kFloat, 8}}},
                                                           {"VTKIDTYPE", {kNumbers, kVtkInt}},
                                                           {"VTKTYPEINT64", {kNumbers, {kSigned, 8}}},
                                                           {"VTKTYPEUINT64", {kNumbers, {kUnsigned, 8}}},
                                                           {"BIT", {kBits, kVtkInt}},
                                                           {"STRING", {kStrings, kVtkInt}},
                                                           {"UTF8_STRING", {kStrings, kVtkInt}},
                                                           {"VARIANT", {kVariants, kVtkInt}}};
  const auto found = kTypes.find(in_capitals(type));
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

std::string in_capitals(std::string_view word) {
  std::string result(word);
  for (char& c : result)
    if (c >= 'a' && c <= 'z') c -= 'a' - 'A';
  return result;
}

std::string decoded_name(std::string_view word) {
  std::string result;
  for (size_t k = 0; k < word.size(); ++k) {
    unsigned char code = 0;
    if (word[k] == '%' && k + 2 < word.size() &&
        std::from_chars(&word[k + 1], &word[k + 1] + 2, code, 16).ptr == &word[k + 1] + 2) {
      result += static_cast<char>(code);
      k += 2;
    } else {
      result += word[k];
    }
  }
  return result;
}

}  // namespace tendril::fem
