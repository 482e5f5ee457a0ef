// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/step_text.h"

#include <charconv>
#include <cstdint>
#include <optional>

namespace asbuilt::io {
namespace {

std::optional<std::uint32_t> hexadecimal(std::string_view digits) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  return error == std::errc() && end == digits.data() + digits.size() ? std::optional(value) : std::nullopt;
}

void append_utf8(std::string& text, std::uint32_t code) {
  if (code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) code = 0xFFFD;
  const auto put = [&](std::uint32_t byte) { text += static_cast<char>(byte); };
  if (code < 0x80) return put(code);
  if (code < 0x800) {
    put(0xC0 | (code >> 6));
  } else if (code < 0x10000) {
    put(0xE0 | (code >> 12));
    put(0x80 | ((code >> 6) & 0x3F));
  } else {
    put(0xF0 | (code >> 18));
    put(0x80 | ((code >> 12) & 0x3F));
    put(0x80 | ((code >> 6) & 0x3F));
  }
  put(0x80 | (code & 0x3F));
}

/// The characters of \X2\..\X0\ or \X4\..\X0\, `digits` hexadecimal digits each; nothing if the directive is not whole.
std::optional<std::string> wide_characters(std::string_view body, std::size_t digits) {
  std::string result;
  if (body.size() % digits != 0) return std::nullopt;
  for (std::size_t i = 0; i < body.size(); i += digits) {
    auto code = hexadecimal(body.substr(i, digits));
    if (!code) return std::nullopt;
    // Two halves of a character beyond the first 65 536, as UTF-16 has them.
    if (digits == 4 && *code >= 0xD800 && *code < 0xDC00 && i + 8 <= body.size()) {
      const auto low = hexadecimal(body.substr(i + 4, 4));
      if (low && *low >= 0xDC00 && *low < 0xE000) {
        code = 0x10000 + ((*code - 0xD800) << 10) + (*low - 0xDC00);
        i += 4;
      }
    }
    append_utf8(result, *code);
  }
  return result;
}

}  // namespace

std::string decoded_step_text(std::string_view text) {
  constexpr std::string_view kEnd = "\\X0\\";
  std::string result;
  while (!text.empty()) {
    if (text.starts_with("\\X2\\") || text.starts_with("\\X4\\")) {
      const std::size_t end = text.find(kEnd, 4);
      const auto wide = end == std::string_view::npos
                            ? std::nullopt
                            : wide_characters(text.substr(4, end - 4), text[2] == '2' ? 4 : 8);
      if (wide) {
        result += *wide;
        text.remove_prefix(end + kEnd.size());
        continue;
      }
    }
    if (text.starts_with("\\X\\") && text.size() >= 5) {
      if (const auto code = hexadecimal(text.substr(3, 2))) {
        append_utf8(result, *code);
        text.remove_prefix(5);
        continue;
      }
    }
    if (text.starts_with("\\S\\") && text.size() >= 4 && static_cast<std::uint8_t>(text[3]) < 0x80) {
      append_utf8(result, static_cast<std::uint32_t>(text[3]) + 0x80);
      text.remove_prefix(4);
      continue;
    }
    result += text.front();
    text.remove_prefix(text.starts_with("\\\\") ? 2 : 1);
  }
  return result;
}

}  // namespace asbuilt::io
